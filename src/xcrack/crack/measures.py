"""A crack as an engineer measures it: area, depth, lengths on surfaces, and where its ends lie."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from xcrack.base.arguments import Part, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints, lock, ranges
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.junctions_3d import body_before
from xcrack.crack.stations import place_crack
from xcrack.mesh.distances import distance_to_simplices, signed_in
from xcrack.mesh.locate import Body, parts_inside
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import leg_sizes

# Length of a 2D crack in the body.


def length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of the part of a 2D crack that lies in the body.

    A mouth lies outside, as far as the crack was prolonged; that part does not count.
    """
    length = np.linalg.norm(np.diff(crack.points, axis=0), axis=1)
    share = [float(np.diff(parts, axis=1).sum()) for parts in parts_inside(mesh, crack.points)]
    total = float(length @ share)
    if total <= 0:
        raise ProblemError(f"no part of the crack from {crack.points[0].tolist()} is in the body.")
    return total


# Length of a line in a body, and where it meets the boundary.

_END = 1e-9  # share of a piece of a line within which it begins or ends


# Area, or length in 2D; length of the fronts; length and depth by number of a facet set; ends as
# place, facet and number of the front. `group` is the number of the set of each facet.
_Measures = tuple[float, float, dict[int, tuple[float, float]], list[tuple[Floats, int, int]]]


def measures_of_line(crack: Crack, mesh: Mesh, group: Ints) -> _Measures:
    """Measures of a placed 2D crack: its length inside, 0, depths, mouths with front -1."""
    walls = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    sides = mesh.points[mesh.facets[walls]]
    tips, _ = tip_frames(crack)
    ends: list[tuple[Floats, int, int]] = []
    pieces = list(zip(crack.points, np.diff(crack.points, axis=0), strict=False))
    for (p, r), parts in zip(pieces, parts_inside(mesh, crack.points), strict=True):
        for t in np.unique(parts):
            x = p + t * r
            distance = distance_to_simplices(x, sides)
            row = int(np.argmin(distance))
            # Pieces meet inside the body, and tips lie there: neither is a mouth.
            if distance[row] <= _END * mesh.extent and not _is_tip(x, tips, mesh.extent):
                if not any(np.linalg.norm(x - y) <= _END * mesh.extent for y, _, _ in ends):
                    ends.append((x, int(walls[row]), -1))
    traces: dict[int, tuple[float, float]] = {}
    for x, facet, _ in ends:
        tip_distance = np.linalg.norm(tips - x, axis=1).max(initial=0.0)
        span = max((float(np.linalg.norm(x - y)) for y, _, _ in ends), default=0.0)
        k = int(group[facet])
        depth = float(tip_distance) if len(tips) else span
        traces[k] = (0.0, max(depth, traces.get(k, (0.0, 0.0))[1]))
    return length_inside(crack, mesh), 0.0, traces, ends


def _is_tip(x: Floats, tips: Floats, extent: float) -> bool:
    return bool((np.linalg.norm(tips - x, axis=1) <= _END * extent).any())


# Area of a 3D crack and length of its fronts in the body.

_FINE = 0.25  # of a cell: sides of the pieces that the boundary of the body clips
_MOST = 1000  # parts of a side of a front


def area_inside(crack: Crack, mesh: Mesh, body: Body | None = None) -> float:
    """Area of the part of a 3D crack that lies in the body.

    Faces near the boundary are halved until their sides are a quarter of a cell, and what the
    boundary then still crosses is clipped as if it were plane there.

    Parameters
    ----------
    crack : Crack
        3D.
    mesh : Mesh
    body : Body, optional
        Of the mesh, where it is known, or what of it counts.

    Returns
    -------
    float
        length².

    Raises
    ------
    ProblemError
        No part of the crack lies in the body.
    """
    body = body or Body.of(mesh)
    piece = crack.points[crack.faces]
    total = 0.0
    while len(piece):
        area = np.linalg.norm(
            np.cross(piece[:, 1] - piece[:, 0], piece[:, 2] - piece[:, 0]), axis=1
        )
        area /= 2
        centre = piece.mean(axis=1)
        radius = np.linalg.norm(piece - centre[:, None], axis=2).max(axis=1)
        depth = body.depth(centre)[0]
        is_near = np.abs(depth) < radius
        total += float(area[~is_near & (depth < 0)].sum())
        side = np.linalg.norm(np.roll(piece, -1, axis=1) - piece, axis=2)
        cell = body.cell_size(centre)
        is_small = is_near & (side.max(axis=1) <= _FINE * cell)
        corners = piece[is_small].reshape(-1, 3)
        share = _share_below_zero(body.depth(corners)[0].reshape(-1, 3))
        total += float((area[is_small] * share).sum())
        piece = halved_triangles(piece[is_near & ~is_small], side[is_near & ~is_small])
    if total <= 0:
        raise ProblemError(f"no part of the crack at {crack.points[0].tolist()} is in the body.")
    return total


def front_length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of all fronts of a 3D crack within the body.

    Parameters
    ----------
    crack : Crack
        3D, placed.
    mesh : Mesh

    Returns
    -------
    float
        length; 0 where no front is left.
    """
    return _front_length_inside(crack, Body.of(mesh))


def _front_length_inside(crack: Crack, body: Body) -> float:
    finest_size = _FINE * float(body.mesh.cell_size.min())
    total = 0.0
    for front in crack.fronts or ():
        x = crack.points[front]
        side = np.diff(x, axis=0)
        length = np.linalg.norm(side, axis=1)
        parts = np.clip(np.ceil(length / finest_size), 1, _MOST).astype(np.int64)
        row, part = ranges(parts)
        depth_a, depth_b = (
            body.depth(x[row] + ((part + end) / parts[row])[:, None] * side[row])[0]
            for end in (0, 1)
        )
        d_min, d_max = np.minimum(depth_a, depth_b), np.maximum(depth_a, depth_b)
        width = np.where(d_max > d_min, d_max - d_min, 1.0)
        share = np.where(d_max <= 0, 1.0, np.where(d_min >= 0, 0.0, -d_min / width))
        total += float(share @ (length / parts)[row])
    return total


def surface_size(crack: Crack, mesh: Mesh, body: Body | None = None) -> float:
    """Area of a 3D crack over the length of its fronts, within the body.

    Parameters
    ----------
    crack : Crack
        3D, placed.
    mesh : Mesh
    body : Body, optional
        Of the mesh, where it is known.

    Returns
    -------
    float
        length: that of a crack with a straight front, half the radius of a penny; the root of the
        area where all fronts have left the body.
    """
    body = body or Body.of(mesh)
    area, length = area_inside(crack, mesh, body), _front_length_inside(crack, body)
    return area / length if length > 0 else float(np.sqrt(area))


def crack_size(cracks: Sequence[Crack], c: int, mesh: Mesh) -> float:
    """Length of one of some placed cracks in the body, in 3D its area over that of its fronts.

    What lies beyond a crack on which it ends does not count.
    """
    crack = cracks[c]
    if crack.fronts is None:
        return length_inside(crack, mesh)
    return surface_size(crack, mesh, _body_of(cracks, c, mesh))


def crack_areas(cracks: Sequence[Crack], mesh: Mesh) -> Floats:
    """Areas of placed cracks that count as in `crack_size` `(c,)`, in 2D lengths."""
    if mesh.dim == 2:
        return np.array([length_inside(crack, mesh) for crack in cracks])
    areas = [area_inside(x, mesh, _body_of(cracks, c, mesh)) for c, x in enumerate(cracks)]
    return np.array(areas)


def _body_of(cracks: Sequence[Crack], c: int, mesh: Mesh) -> Body:
    """The body for one of some cracks: without what lies beyond others on which it ends."""
    body = Body.of(mesh)
    return body_before(cracks, c, body) if cracks[c].ends_on else body


# Cells by which a crack must be deep at order 1 in 3D: K is up to 6.1 % low below, within 2 % above
# (47 meshes, even and graded; in even cells around inner cracks it is within .7 % from two on).
DEEP = 7.0
_AROUND = 1.5  # depths of a crack, up to which cells around its front bear its stress
_SAMPLES = 10_000  # points and cells that are looked at, at most


def cells_deep(x: Floats, front: Floats, mesh: Mesh) -> float:
    """Depth of a crack in 3D over the mean size of the cells around its front.

    Parameters
    ----------
    x, front : (n, 3) and (m, 3) arrays, length
        Points on its faces in the body, and along its fronts.
    mesh : Mesh
    """
    from xcrack.mesh.kernels.location import nearest_vertices

    points, vertices = lock(x[:: len(x) // _SAMPLES + 1].copy()), lock(front.copy())
    depth = float(nearest_vertices(points, vertices, np.inf)[1].max())
    cells = np.arange(0, len(mesh.cells), len(mesh.cells) // _SAMPLES + 1)
    middle = lock(mesh.cell_middles[cells])
    cells = cells[nearest_vertices(middle, vertices, _AROUND * depth)[0] >= 0]
    if not len(cells):
        return 0.0
    return depth / float(np.average(leg_sizes(mesh, cells), weights=mesh.volume[cells]))


def halved_triangles(piece: Floats, side: Floats) -> Floats:
    """Triangles `(k, 3, 3)` cut through the middle of their longest sides."""
    turn = (np.argmax(side, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(piece, turn[..., None], axis=1).transpose(1, 0, 2)
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _share_below_zero(values: Floats) -> Floats:
    """Share of each triangle in which the linear function with these corner values is < 0."""
    n_below = (values < 0).sum(axis=1)
    sorted_values = np.sort(values, axis=1)
    v_min, middle, v_max = sorted_values.T
    spread = np.where(v_max > v_min, v_max - v_min, 1.0)
    share_of_one = v_min**2 / (np.where(middle > v_min, middle - v_min, 1.0) * spread)
    share_of_two = 1 - v_max**2 / (spread * np.where(v_max > middle, v_max - middle, 1.0))
    return np.asarray(
        np.choose(n_below, [np.zeros_like(v_min), share_of_one, share_of_two, np.ones_like(v_min)])
    )


# Lines in which a surface meets the boundary of a body, and what lies how deep below them.

_FINE_SURFACE = (
    0.1  # of a facet of the boundary: pieces of the crack that meet it, steps along fronts
)
_MOST_TRIANGLES = 2000  # steps on a side of a front
_REACH = 1.5  # cells up to which a front that ends inside is prolonged to the boundary
_BISECTIONS = 60


def measures_of_surface(crack: Crack, mesh: Mesh, group: Ints) -> _Measures:
    """Measures of a placed 3D crack."""
    body = Body.of(mesh)
    walls = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    segment = _trace(crack, body)
    facet = walls[signed_in(body.boundary, segment.mean(axis=1))[1]] if len(segment) else walls[:0]
    fronts = [_front_points(crack, front, body) for front in crack.fronts or ()]
    candidates = np.concatenate([np.zeros((0, 3)), *fronts])
    ends = [
        (x, int(walls[signed_in(body.boundary, x[None])[1][0]]), k)
        for k, x in front_ends(crack, body)
    ]
    # Traces and fronts end at the same places.
    candidates = np.concatenate([candidates, *(x[None] for x, _, _ in ends)])
    if not len(candidates):
        candidates = segment.reshape(-1, 3)
    of = group[facet]
    traces = {}
    for k in np.unique(of).tolist():
        segments_on_set = segment[of == k]
        length = float(np.linalg.norm(segments_on_set[:, 1] - segments_on_set[:, 0], axis=1).sum())
        depth = max(
            (float(distance_to_simplices(x, segments_on_set).min()) for x in candidates),
            default=0.0,
        )
        traces[k] = (length, depth)
    return area_inside(crack, mesh), front_length_inside(crack, mesh), traces, ends


def front_ends(crack: Crack, body: Body) -> list[tuple[int, Floats]]:
    """Where the fronts of a placed crack meet the boundary: number of the front, place.

    Parameters
    ----------
    crack : Crack
    body : Body

    Returns
    -------
    list of (int, (3,) array)
        Places in the direction of the front.
    """
    return [
        (k, x)
        for k, front in enumerate(crack.fronts or ())
        for x in _ends(crack.points[front], body)
    ]


def _trace(crack: Crack, body: Body) -> Floats:
    """Segments in which the faces of a crack meet the boundary `(k, 2, 3)`."""
    piece = crack.points[crack.faces]
    parts = [np.zeros((0, 2, 3))]
    while len(piece):
        centre = piece.mean(axis=1)
        radius = np.linalg.norm(piece - centre[:, None], axis=2).max(axis=1)
        depth, size = body.depth(centre)
        is_near = np.abs(depth) < radius
        piece, size = piece[is_near], size[is_near]
        side = np.linalg.norm(np.roll(piece, -1, axis=1) - piece, axis=2)
        is_small = side.max(axis=1) <= _FINE_SURFACE * size
        parts.append(_zero_lines(piece[is_small], body))
        piece = halved_triangles(piece[~is_small], side[~is_small])
    return np.concatenate(parts)


def _zero_lines(piece: Floats, body: Body) -> Floats:
    """Segments of small triangles where the depth, linear between their corners, is zero."""
    if not len(piece):
        return np.zeros((0, 2, 3))
    depth = body.depth(piece.reshape(-1, 3))[0].reshape(-1, 3)
    is_outside: Bools = depth >= 0
    count = is_outside.sum(axis=1)
    is_crossed = (count == 1) | (count == 2)
    piece, depth, is_outside, count = (
        piece[is_crossed],
        depth[is_crossed],
        is_outside[is_crossed],
        count[is_crossed],
    )
    # The corner alone on its side first, the two others after it.
    lone_corner = np.argmax(is_outside == (count == 1)[:, None], axis=1)
    order = (lone_corner[:, None] + np.arange(3)) % 3
    x = np.take_along_axis(piece, order[..., None], axis=1)
    d = np.take_along_axis(depth, order, axis=1)
    t = d[:, :1] / (d[:, :1] - d[:, 1:])
    return np.asarray(x[:, :1] + t[..., None] * (x[:, 1:] - x[:, :1]))


def _front_points(crack: Crack, front: Ints, body: Body) -> Floats:
    """Points along a front inside the body."""
    x = _dense_points(crack.points[front], body)
    return x[body.depth(x)[0] <= 0]


def _dense_points(x: Floats, body: Body) -> Floats:
    side = np.diff(x, axis=0)
    length = np.linalg.norm(side, axis=1)
    size = body.depth((x[1:] + x[:-1]) / 2)[1]
    parts = np.clip(np.ceil(length / (_FINE_SURFACE * size)), 1, _MOST_TRIANGLES).astype(np.int64)
    row, part = ranges(parts)
    points = x[row] + (part / parts[row])[:, None] * side[row]
    return np.concatenate([points, x[-1:]])


def _ends(x: Floats, body: Body) -> list[Floats]:
    """Where an open front meets the boundary, or would if its end were prolonged."""
    is_closed = bool((x[0] == x[-1]).all())
    points = _dense_points(x, body)
    is_inside = body.depth(points)[0] < 0
    if not is_inside.any():
        return []
    change = np.nonzero(is_inside[1:] != is_inside[:-1])[0]
    result = [_boundary_crossing(points[i], points[i + 1], body) for i in change]
    if is_closed:
        return result
    for end, previous_point in ((points[0], points[1]), (points[-1], points[-2])):
        if body.depth(end[None])[0][0] >= 0:
            continue
        direction = (end - previous_point) / max(
            float(np.linalg.norm(end - previous_point)), 1e-300
        )
        prolonged_end = end + _REACH * body.cell_size(end[None])[0] * direction
        if body.depth(prolonged_end[None])[0][0] >= 0:
            result.append(_boundary_crossing(end, prolonged_end, body))
    return result


def _boundary_crossing(p: Floats, q: Floats, body: Body) -> Floats:
    """Place on the boundary between a point inside and one outside."""
    is_inside = body.depth(p[None])[0][0] < 0
    for _ in range(_BISECTIONS):
        middle = (p + q) / 2
        if (body.depth(middle[None])[0][0] < 0) == is_inside:
            p = middle
        else:
            q = middle
    return np.asarray((p + q) / 2)


@dataclass(frozen=True)
class SurfaceTrace:
    """A crack on one facet set of the boundary.

    Attributes
    ----------
    name : str
        Of the smallest facet set that has the facets; "boundary" where none has a name.
    length : float, length
        Of the line in which the crack meets the set; 0 in 2D.
    depth : float, length
        Largest distance of the front, in 2D of a tip, from that line.
    """

    name: str
    length: float
    depth: float


@dataclass(frozen=True)
class FrontEnd:
    """A place where a front, in 2D the crack, meets the boundary.

    Attributes
    ----------
    x : (d,) tuple, length
    name : str
        Facet set there, as in `SurfaceTrace`.
    front : int
        Number of the front; -1 in 2D.
    """

    x: tuple[float, ...]
    name: str
    front: int


@dataclass(frozen=True)
class Measures:
    """What an engineer reads off a crack.

    Attributes
    ----------
    area : float, length²
        Inside the body; in 2D the length of the crack inside the body.
    front_length : float, length
        Of all fronts inside the body; 0 in 2D.
    depth : float, length
        Below the surface on which the crack is longest, in 2D the largest one; nan where it meets
        none. Another surface that it breaks through to is met by a shorter line at first.
    traces : tuple of SurfaceTrace
        One for each facet set that the crack meets, in the order of their names.
    ends : tuple of FrontEnd
        Where its fronts meet the boundary; in 2D its mouths.
    """

    area: float
    front_length: float
    depth: float
    traces: tuple[SurfaceTrace, ...]
    ends: tuple[FrontEnd, ...]

    def __str__(self) -> str:
        lines = [f"area {self.area:.6g}, front {self.front_length:.6g}, depth {self.depth:.6g}"]
        lines += [
            f"on {t.name!r}: length {t.length:.6g}, depth below it {t.depth:.6g}"
            for t in self.traces
        ]
        lines += [
            f"end at ({', '.join(f'{v:.6g}' for v in end.x)}) on {end.name!r}" for end in self.ends
        ]
        return "\n".join(lines)


_ROUND_OFF = 1e-12  # of the body: a place as near to zero is zero
_BY_DIMENSION: dict[int, Callable[[Crack, Mesh, Ints], _Measures]] = {
    2: measures_of_line,
    3: measures_of_surface,
}


@check_arguments(GeometryError)
def measures(crack: Annotated[Crack, Part(Crack)], mesh: Annotated[Mesh, Part(Mesh)]) -> Measures:
    """Area, depth, surface lengths of a crack, and where its fronts meet which facet sets.

    Traces and ends are intersections of the crack with the facets of the boundary: a semi-ellipse
    has its length 2c on the surface and its depth a below it, a corner crack one pair for each of
    the two surfaces.

    Parameters
    ----------
    crack : Crack
        As it was made or grown.
    mesh : Mesh
        The body, with facet sets by name.

    Returns
    -------
    Measures

    Raises
    ------
    GeometryError
        A crack of another dimension, or one that does not lie in the body.

    Examples
    --------
    >>> import xcrack as xc
    >>> print(measures(xc.line_crack([(-0.1, 0.5), (0.3, 0.5)]), xc.box((0, 0), (1, 1), 9)))
    area 0.3, front 0, depth 0.3
    on 'left': length 0, depth below it 0.3
    end at (0, 0.5) on 'left'
    """
    if crack.dim != mesh.dim:
        raise GeometryError(
            f"measures: a crack of {crack.dim}D needs a body of {crack.dim}D, not {mesh.dim}D."
        )
    placed_crack = crack if crack.placed else place_crack(crack, mesh)
    names, group = facet_names(mesh)
    area, front_length, traces, ends = _BY_DIMENSION[mesh.dim](placed_crack, mesh, group)
    rows = [SurfaceTrace(names[k], *traces[k]) for k in sorted(traces, key=lambda k: names[k])]
    depth = max(((row.length, row.depth) for row in rows), default=(0.0, float("nan")))[1]
    points = []
    for x, facet, front in ends:
        place = np.where(np.abs(x) < _ROUND_OFF * mesh.extent, 0.0, x)
        points.append(FrontEnd(tuple(place.tolist()), names[group[facet]], front))
    return Measures(area, front_length, depth, tuple(rows), tuple(points))


def facet_names(mesh: Mesh) -> tuple[list[str], Ints]:
    """Names of sets, and for each facet of the mesh the number of its smallest set.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    names : list of str
    group : (f,) array of int
        0, which is "boundary", for facets in no other set.
    """
    sets = sorted(mesh.facet_sets.items(), key=lambda item: -len(item[1]))
    # "boundary" has all: any other set of as many facets is more telling.
    sets = sorted(sets, key=lambda item: item[0] != "boundary")
    group = np.zeros(len(mesh.facets), dtype=np.int64)
    for k, (_, facets) in enumerate(sets):
        if len(facets):
            group[mesh.facet_numbers(facets)] = k
    return [name for name, _ in sets], group


def exit_ahead(x: Floats, direction: Floats, mesh: Mesh) -> tuple[Floats, str] | None:
    """Where a tip that runs straight meets the boundary, and the facet set there."""
    facet = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    start, stop = mesh.points[mesh.facets[facet]].transpose(1, 0, 2)
    side, gap = stop - start, start - x
    cross = direction[0] * side[:, 1] - direction[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (gap[:, 0] * side[:, 1] - gap[:, 1] * side[:, 0]) / cross
        share = (gap[:, 0] * direction[1] - gap[:, 1] * direction[0]) / cross
    hit = (cross != 0) & (share >= 0) & (share <= 1) & (distance > 0)
    if not hit.any():
        return None
    first = int(np.argmin(np.where(hit, distance, np.inf)))
    names, group = facet_names(mesh)
    return x + distance[first] * direction, names[group[facet[first]]]


__all__ = [
    "area_inside",
    "crack_areas",
    "crack_size",
    "exit_ahead",
    "front_length_inside",
    "halved_triangles",
    "length_inside",
    "surface_size",
]
