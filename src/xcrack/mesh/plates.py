"""Plane bodies with round holes, meshed by gmsh and graded towards where cracks will run."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import ceil, frexp, hypot, inf, pi
from types import ModuleType
from typing import Annotated, Any, cast

import numpy as np

from xcrack.base.arguments import (
    CheckedBy,
    Distance,
    Error,
    Length,
    Points,
    check_arguments,
)
from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import (
    LARGEST,
    entries,
    number,
    point_coordinates,
    value_text,
    whole_numbers,
)
from xcrack.base.errors import GeometryError, MeshError
from xcrack.base.units import LENGTH
from xcrack.mesh.gmsh_session import FINEST, Along, graded_size, session
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.outlines import (
    Side,
    distance_to,
    finer_at_arcs,
    is_inside,
    polygon_of,
    rectangle,
    sides_of,
    split_sides,
)
from xcrack.mesh.parts import Where, chosen_facets
from xcrack.mesh.polygon import Arc

Point = tuple[float, float]
Hole = tuple[Point, float]
Sets = Mapping[str, Where]

_FEWEST_HOLE_EDGES = 24  # an inscribed polygon of 24 edges has lost 1.1 % of the disc's area
_BAND = 0.25  # of the smallest radius: lengths of the body, so that halving both sizes halves
_TRANSITION = 8.0  # the cell size everywhere, as convergence studies need
_STEEPEST = 0.5  # growth of the cell size a unit of distance that still gives good triangles
_MOST_POINTS = 5_000_000


def checked_holes(value: Any, label: str, error: Error) -> list[Hole]:
    """Centres and radii of holes, checked."""
    try:
        pairs = [(center, radius) for center, radius in entries(value, label, error=error)]
    except (error, TypeError, ValueError):
        raise error(
            f"{label} = {value_text(value)} must be a list of centres and radii, such as "
            "[((x, y), radius)]."
        ) from None
    return [
        (
            _pair(point_coordinates(center, f"{label}[{i}]: centre", (2,), error=error)),
            number(radius, f"{label}[{i}]: radius", above=0, most=LARGEST, error=error),
        )
        for i, (center, radius) in enumerate(pairs)
    ]


def checked_outline(value: Any, label: str, error: Error) -> list[Side]:
    """Sides of an outline, checked."""
    return sides_of(value)


@check_arguments(GeometryError)
def plate_with_hole(
    *,
    width: Length,
    height: Length,
    radius: Length,
    size: Length,
    size_near: Length | None = None,
    center: Annotated[Point, Points((2,))] = (0.0, 0.0),
    along: Along = None,
    band: Distance | None = None,
    transition: Distance | None = None,
    sets: Sets | None = None,
) -> Mesh:
    """Rectangular plate centred at the origin with one round hole.

    Parameters
    ----------
    width, height : float, length
        Sides of the plate.
    radius : float, length
        Radius of the hole.
    size : float, length
        Cell size far away.
    size_near : float, length, optional
        Cell size at the hole and along `along`. By default `size`, or what a round hole needs.
    center : (2,) floats, length
        Centre of the hole.
    along : (k, 2) points or several such polylines, length, optional
        Where cracks will run: `size_near` holds within `band` of these lines.
    band : float, length, optional
        Distance from the hole and from `along` up to which `size_near` holds. By default a
        quarter of the radius.
    transition : float, length, optional
        Distance beyond the band over which cells grow linearly to `size`. By default eight
        radii, and never less than twice `size - size_near`.
    sets : mapping of name to part of the boundary, optional
        As of `plate`.

    Returns
    -------
    Mesh
        Facet sets ``left``, ``right``, ``bottom``, ``top``, ``hole``. A node lies at
        ``center + (radius, 0)`` and at the three quarter turns from it; `refine` puts new points
        of the hole onto its circle.

    Raises
    ------
    GeometryError
        A hole that does not fit, sizes larger than the plate, or too many points.
    MeshError
        A set without facets, or with a name that is taken.
    XcrackError
        gmsh cannot be imported; the message says what to install.

    Examples
    --------
    A crack is to start at the right of the hole::

        mesh = plate_with_hole(
            width=100.0, height=100.0, radius=5.0, size=4.0, size_near=0.25,
            along=[(5.0, 0.0), (12.0, 0.0)], transition=15.0,
        )
    """
    sides = rectangle((-width / 2, -height / 2), width, height)
    holes = [(_pair(center), radius)]
    return _plate(sides, holes, ["hole"], size, size_near, along, band, transition, sets)


@check_arguments(GeometryError)
def plate(
    width: Length | None = None,
    height: Length | None = None,
    *,
    size: Length,
    size_near: Length | None = None,
    lower: Annotated[Point, Points((2,))] = (0.0, 0.0),
    holes: Annotated[Iterable[Hole], CheckedBy(checked_holes, unit=LENGTH)] = (),
    along: Along = None,
    band: Distance | None = None,
    transition: Distance | None = None,
    outline: Annotated[Sequence[Any] | None, CheckedBy(checked_outline, unit=LENGTH)] = None,
    sets: Sets | None = None,
) -> Mesh:
    """Plate, rectangular or of any outline, with any number of round holes, none included.

    Parameters
    ----------
    width, height : float, length
        Sides of a rectangular plate; left out with an `outline`.
    size : float, length
        Cell size far away.
    size_near : float, length, optional
        Cell size at the holes and along `along`. By default `size`, or what a hole needs.
    lower : (2,) floats, length
        Lower left corner of a rectangular plate.
    holes : iterable of ((x, y), radius), length
        Centre and radius of each hole. They may not touch the sides or each other.
    along, band, transition
        As in `plate_with_hole`; without holes a tenth of the smaller side stands for the radius.
    outline : sequence, length, optional
        Points in the order in which one walks around the body. An entry is a point, to which a
        straight side leads, or a pair of points, through the first of which an arc leads to the
        second: ``[(0, 0), (4, 0), ((5, 1), (4, 2)), (0, 2)]`` has one round end. It closes by
        itself.
    sets : mapping of name to part of the boundary, optional
        Further facet sets: a function f(x) -> (n,) bool of points (n, 2), two corners of a box
        (None where it has no end), or numbers of sides of an outline, from 0. A facet belongs to a
        set if its middle does; where a box ends on a straight side a point of the mesh is put.

    Returns
    -------
    Mesh
        Facet sets ``left``, ``right``, ``bottom``, ``top`` of a rectangle, ``arc_<number of the
        side>`` of each arc of an outline; ``hole_0``, ``hole_1``, ... and those of `sets`. `refine`
        puts new points of arcs and holes onto them.

    Raises
    ------
    GeometryError
        An outline that crosses itself, a hole that does not fit, sizes larger than the plate, or
        too many points.
    MeshError
        A set without facets, or with a name that is taken.
    XcrackError
        gmsh cannot be imported; the message says what to install.

    Examples
    --------
    A plate with two holes and a path for a crack from its left side, held along 3 of its 20::

        mesh = plate(
            20.0, 10.0, holes=[((3.0, 7.0), 2.0), ((17.0, 3.0), 2.0)], size=0.6, size_near=0.25,
            along=[(0.0, 2.85), (12.8, 2.3)], sets={"seat": ((0, 0), (3, 0))},
        )

    Half a disc, loaded at its crown::

        mesh = plate(
            outline=[(-50, 0), (50, 0), ((0, 50), (-50, 0))], size=4.0,
            sets={"crown": ((-2, None), (2, None)), "base": [0]},
        )
    """
    round_holes = cast(list[Hole], holes)
    names = [f"hole_{i}" for i in range(len(round_holes))]
    if outline is not None and width is None and height is None:
        sides = cast(list[Side], outline)
    elif outline is None and width is not None and height is not None:
        sides = rectangle(_pair(lower), width, height)
    else:
        raise GeometryError(
            "plate: give width and height of a rectangle, or an outline; not both, not neither."
        )
    return _plate(sides, round_holes, names, size, size_near, along, band, transition, sets)


def _plate(
    sides: Sequence[Side],
    holes: Sequence[Hole],
    names: Sequence[str],
    size: float,
    size_near: float | None,
    along: Any,
    band: float | None,
    transition: float | None,
    sets: Sets | None,
) -> Mesh:
    polygon = polygon_of(sides)
    width, height = np.ptp(polygon, axis=0).tolist()
    _check_holes(sides, max(width, height), holes)
    smallest_radius = min((radius for _, radius in holes), default=inf)
    hole_size = 2 * pi * smallest_radius / _FEWEST_HOLE_EDGES
    near_size = min(size, hole_size) if size_near is None else size_near
    _check_sizes(width, height, size, near_size)
    reach = smallest_radius if holes else min(width, height) / 10
    if band is None:
        band = _BAND * reach
    if transition is None:
        transition = max(_TRANSITION * reach, (size - near_size) / _STEEPEST)
    paths = along or []
    _check_cost(width, height, size, near_size, band, paths)
    named_sets = _checked_sets(sets, [*(side.name for side in sides), *names])
    parts = split_sides(sides, named_sets)
    # gmsh's tolerances are absolute: mesh a plate of unit size; powers of two lose no digit.
    scale = 2.0 ** frexp(max(width, height))[1]
    length = graded_size(
        [(x / scale, y / scale, r / scale) for (x, y), r in holes],
        [path / scale for path in paths],
        size / scale,
        near_size / scale,
        band / scale,
        transition / scale,
    )
    scaled_sides = [_scaled_side(side, scale) for side in parts]
    length = finer_at_arcs(length, scaled_sides, _FEWEST_HOLE_EDGES, _STEEPEST)
    scaled_holes = [((x / scale, y / scale), r / scale) for (x, y), r in holes]
    with session() as gmsh:
        curves = _draw(gmsh, scaled_sides, scaled_holes, names, near_size / scale)
        points, cells, facets = mesh_model(gmsh, curves, length)
    rims: dict[str, Arc] = {
        name: Arc(center, radius) for name, (center, radius) in zip(names, holes)
    }
    rims |= {side.name: side.curve for side in sides if side.curve is not None}
    return _finish(points * scale, cells, facets, rims, parts, named_sets)


def _scaled_side(side: Side, scale: float) -> Side:
    def shifted_point(x: Point) -> Point:
        return x[0] / scale, x[1] / scale

    center = None if side.center is None else shifted_point(side.center)
    return Side(
        shifted_point(side.start),
        shifted_point(side.end),
        center,
        side.turn,
        side.name,
        side.number,
    )


def _draw(
    gmsh: ModuleType,
    sides: Sequence[Side],
    holes: Sequence[Hole],
    names: Sequence[str],
    near_size: float,
) -> dict[str, list[int]]:
    """Draw the plate in the current model; return the curves of each side and hole."""
    geo = gmsh.model.geo
    corners: dict[Point, int] = {}

    def corner(x: Point) -> int:
        if x not in corners:
            corners[x] = geo.addPoint(*x, 0.0)
        return corners[x]

    pieces = [side.parts(pi / 2) for side in sides]  # gmsh draws less than half a turn
    for parts in pieces:
        for piece in parts:
            corner(piece.start)
    curves: dict[str, list[int]] = {}
    outer_curves = []
    for n, parts in enumerate(pieces):
        tags = []
        for piece in parts:
            if piece.center is None:
                tags.append(geo.addLine(corner(piece.start), corner(piece.end)))
            else:
                middle = geo.addPoint(*piece.center, 0.0)
                tags.append(geo.addCircleArc(corner(piece.start), middle, corner(piece.end)))
        curves[f"side {n}"] = tags
        outer_curves += tags
    loops = [geo.addCurveLoop(outer_curves)]
    for name, ((x, y), radius) in zip(names, holes, strict=True):
        middle = geo.addPoint(x, y, 0.0)
        turn = [(radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius)]
        rim = [geo.addPoint(x + dx, y + dy, 0.0) for dx, dy in turn]
        curves[name] = [geo.addCircleArc(rim[i], middle, rim[(i + 1) % 4]) for i in range(4)]
        edges = ceil(max(_FEWEST_HOLE_EDGES / 4, pi / 2 * radius / near_size - 1e-9))
        for arc in curves[name]:
            geo.mesh.setTransfiniteCurve(arc, edges + 1)
        loops.append(geo.addCurveLoop(curves[name]))
    geo.addPlaneSurface(loops)
    geo.synchronize()
    return curves


def mesh_model(
    gmsh: ModuleType, curves: dict[str, list[int]], length: Callable[[float, float], float]
) -> tuple[Floats, Ints, dict[str, Ints]]:
    """Mesh the current gmsh model of one plane surface or several.

    Parameters
    ----------
    gmsh : module
        gmsh with an open session.
    curves : dict of name to list of int
        Curves of each facet set.
    length : callable
        Maps x, y to the cell size.

    Returns
    -------
    points : (n, 2) array, length
        Coordinates, of points that cells use.
    cells : (m, 3) array of int
        Triangles.
    facets : dict of name to (k, 2) array of int
        Edges of each set.

    Raises
    ------
    MeshError
        gmsh made no mesh.
    """
    mesh = gmsh.model.mesh
    mesh.setSizeCallback(lambda dim, tag, x, y, z, size: length(x, y))
    try:
        mesh.generate(2)
    except Exception as error:  # gmsh raises nothing more precise
        raise MeshError(f"gmsh made no mesh ({error}); smaller sizes may help.") from error
    tags, coordinates, _ = mesh.getNodes()
    points = coordinates.reshape(-1, 3)[:, :2]
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    cells = number[mesh.getElementsByType(2)[1]].reshape(-1, 3)
    facets = {
        name: np.concatenate([number[mesh.getElementsByType(1, c)[1]].reshape(-1, 2) for c in tags])
        for name, tags in curves.items()
    }
    # Centres of arcs are nodes of the model, but of no cell.
    point_numbers = np.unique(cells)
    new_number = np.full(len(points), -1, dtype=np.int64)
    new_number[point_numbers] = np.arange(len(point_numbers))
    return (
        points[point_numbers],
        new_number[cells],
        {name: new_number[edges] for name, edges in facets.items()},
    )


def _finish(
    points: Floats,
    cells: Ints,
    facets: dict[str, Ints],
    rims: dict[str, Arc],
    sides: Sequence[Side],
    sets: Sets,
) -> Mesh:
    """Put the nodes of the sides exactly onto them, name and order the sets."""
    of_sides = [facets.pop(f"side {n}") for n in range(len(sides))]
    edges_by_name: dict[str, list[Ints]] = {}
    for side, edges in zip(sides, of_sides, strict=True):
        for axis in (0, 1) if side.center is None else ():
            if side.start[axis] == side.end[axis]:
                points[edges.ravel(), axis] = side.start[axis]
        if side.name:
            edges_by_name.setdefault(side.name, []).append(edges)
    first = [name for name in ("left", "right", "bottom", "top") if name in edges_by_name]
    order = dict.fromkeys([*first, *edges_by_name])
    facet_sets = {name: np.concatenate(edges_by_name[name]) for name in order} | facets
    boundary = np.concatenate([*of_sides, *facets.values()])
    for name, choice in sets.items():
        if callable(choice) or not _are_numbers(choice):
            facet_sets[name] = chosen_facets(points, boundary, choice, f"sets[{name!r}]")
            continue
        numbers = whole_numbers(choice, f"sets[{name!r}]", (None,), error=MeshError).tolist()
        strange_numbers = sorted(set(numbers) - {side.number for side in sides})
        if strange_numbers or not numbers:
            n_max = max(side.number for side in sides)
            raise MeshError(
                f"sets[{name!r}] = {value_text(choice)}: the sides have the numbers 0 to {n_max}: "
                "give some of them."
            )
        edges_of_set = [edges for side, edges in zip(sides, of_sides) if side.number in numbers]
        facet_sets[name] = np.concatenate(edges_of_set)
    return sound_mesh(points, cells, facet_sets, curves=rims)


def _are_numbers(choice: Any) -> bool:
    return isinstance(choice, Sequence) and not any(np.ndim(entry) for entry in choice)


def _checked_sets(sets: Any, names: Sequence[str]) -> Sets:
    """Parts of the boundary by name."""
    if sets is None:
        return {}
    if not isinstance(sets, Mapping) or not all(isinstance(name, str) and name for name in sets):
        raise MeshError(
            "sets must be a dict of names and parts of the boundary, such as sets={'grip': "
            f"((0, 0), (10, 0))}}, not {value_text(sets)}."
        )
    taken_names = sorted({*sets} & {*names, "boundary"})
    if taken_names:
        raise MeshError(f"sets: the plate has {taken_names[0]!r} by itself: give another name.")
    return sets


def _pair(point: Any) -> Point:
    return float(point[0]), float(point[1])


def _check_sizes(width: float, height: float, size: float, near_size: float) -> None:
    if size > min(width, height):
        raise GeometryError(
            f"size = {size:g} is larger than the plate ({width:g} x {height:g}): "
            f"give at most {min(width, height):g}, better a tenth of it."
        )
    if near_size > size:
        raise GeometryError(
            f"size_near = {near_size:g} is larger than size = {size:g}: cells grow away from holes "
            f"and paths; exchange the two or leave size_near out."
        )


def _check_holes(sides: Sequence[Side], size: float, holes: Sequence[Hole]) -> None:
    for i, (center, radius) in enumerate(holes):
        if radius < FINEST * size:
            raise GeometryError(
                f"the radius {radius:g} of hole {i} is too small for a plate of {size:g}: leave "
                "the hole out, or make it larger."
            )
        gap = distance_to(sides, center) * (1 if is_inside(sides, center) else -1) - radius
        if gap <= 0:
            raise GeometryError(
                f"hole {i} (centre {tuple(center)}, radius {radius:g}) reaches {-gap:g} beyond the "
                "plate: move it inwards or make it smaller."
            )
        for j, (place, other_radius) in enumerate(holes[:i]):
            gap = hypot(center[0] - place[0], center[1] - place[1]) - radius - other_radius
            if gap <= 0:
                raise GeometryError(
                    f"holes {j} and {i} overlap by {-gap:g}: move them apart or make them smaller."
                )


def _check_cost(
    width: float, height: float, size: float, near_size: float, band: float, paths: Sequence[Floats]
) -> None:
    run = sum(float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum()) for p in paths)
    cell = 3**0.5 / 2
    fine_area = min(2 * band * run, width * height)
    points = inf  # also where squares of sizes are too small for a number
    if near_size > FINEST * max(width, height):
        points = width * height / (cell * size**2) + fine_area / (cell * near_size**2)
    if points > _MOST_POINTS:
        raise GeometryError(
            f"size = {size:g} and size_near = {near_size:g} ask for about {points:.1e} points, "
            f"more than {_MOST_POINTS:.0e}: enlarge the size, or narrow the band."
        )
