"""A notched round bar for bending in many directions, meshed by gmsh."""

from math import frexp, inf, pi, sin, tan
from types import ModuleType
from typing import Annotated

import numpy as np

from xcrack.base.arguments import Distance, Length, Number, check_arguments
from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import GeometryError, MeshError
from xcrack.mesh.gmsh_session import FINEST, graded_size, session
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.polygon import Arc

_FACES = 24
_TURN = 2 * pi / _FACES  # from one face of an end to the next
_BAND = 0.05  # of the diameter: lengths of the body, so that halving both sizes halves the cell
_TRANSITION = 1.0  # size everywhere, as convergence studies need
_STEEPEST = 0.5  # growth of the cell size a unit of distance that still gives good cells
_TOLERANCE = 1e-6  # of the diameter: far above round-off, far below every cell
_MOST_POINTS = 5_000_000
_RADIANS = "it is in rad, and np.radians turns degrees into it"


@check_arguments(GeometryError)
def notched_cylinder(
    *,
    diameter: Length,
    length: Length,
    notch_depth: Length,
    notch_angle: Annotated[float, Number(above=0, below=pi, hint=_RADIANS)],
    outer_span: Length,
    inner_span: Length,
    size: Length,
    size_near: Length | None = None,
    patch_length: Length | None = None,
    crack_depth: Length | None = None,
    band: Distance | None = None,
    transition: Distance | None = None,
) -> Mesh:
    """Round bar with a straight V-notch at mid-length and ends of 24 plane faces.

    The axis is x, from ``-length / 2`` to ``length / 2``. The notch opens downwards (-z); its root
    is the chord ``x = 0, z = notch_depth - diameter / 2`` along y. Between the inner stations the
    bar is round but for a transition of up to half a radius at each; beyond, its section is the
    polygon of 24 edges with its corners on the circle.

    Face k looks towards ``(0, sin(15 k deg), -cos(15 k deg))``: 00 down, where the notch opens, 06
    to the back (+y), 12 up, 18 to the front (-y). Reactions on the outer faces 00 and loads on the
    inner faces 12 open the notch; faces k and ``(12 + k) % 24`` turn that by 15 k deg about +x.

    Parameters
    ----------
    diameter, length : float, length
        Of the bar.
    notch_depth : float, length
        Depth of the root below the lowest line of the bar.
    notch_angle : float, rad
        Angle between the two faces of the notch.
    outer_span, inner_span : float, length
        Distance between the middles of the left and the right outer patches, and inner ones.
    size : float, length
        Cell size far from the notch, as gmsh takes it: an average edge. Edges across a face are
        no longer than it is wide, ``diameter * sin(7.5 deg)``.
    size_near : float, length, optional
        Cell size at the notch and where the crack will run; the longest edges of the cells are
        1.6 times as long there. By default `size`.
    patch_length : float, length, optional
        Length of the patches along the axis. By default the width of a face: square patches.
    crack_depth : float, length, optional
        Depth, from where `notch_depth` counts, that the crack will reach in the plane x = 0. By
        default half of the diameter.
    band : float, length, optional
        Distance from that part of the plane up to which `size_near` holds. By default a
        twentieth of the diameter.
    transition : float, length, optional
        Distance beyond the band over which cells grow linearly to `size`. By default one
        diameter, and never less than twice `size - size_near`.

    Returns
    -------
    Mesh
        Facet sets ``left``, ``right`` (ends), ``notch`` (both faces), ``round`` (the cylinder
        between the inner stations, onto which `refine` puts its new points), ``outer_left_00`` ...
        ``outer_left_23``, ``outer_right_00`` ..., ``inner_left_00`` ..., ``inner_right_00`` ...
        (plane rectangles of one area). Nodes of the root lie exactly in x = 0.

    Raises
    ------
    GeometryError
        Stations that overlap or do not fit between the ends and the notch, sizes that do not
        fit, or too many points.
    MeshError
        gmsh made no mesh.
    XcrackError
        gmsh cannot be imported; the message says what to install.

    Examples
    --------
    Four-point bending, with a crack that is to take half of the section::

        mesh = notched_cylinder(
            diameter=20.0, length=140.0, notch_depth=2.0, notch_angle=np.pi / 3,
            outer_span=120.0, inner_span=40.0, size=4.0, size_near=0.5,
        )
        loads = [
            traction("inner_left_12", (0.0, 0.0, -p)), traction("outer_left_00", (0.0, 0.0, p)),
            traction("inner_right_12", (0.0, 0.0, -p)), traction("outer_right_00", (0.0, 0.0, p)),
        ]
    """
    radius = diameter / 2
    near_size = size if size_near is None else size_near
    patch = diameter * sin(_TURN / 2) if patch_length is None else patch_length
    depth = radius if crack_depth is None else crack_depth
    if band is None:
        band = _BAND * diameter
    if transition is None:
        transition = max(_TRANSITION * diameter, (size - near_size) / _STEEPEST)
    _check_depths(diameter, notch_depth, depth)
    _check_sizes(diameter, length, size, near_size, band, depth)
    slope = tan(notch_angle / 2)
    room = _check_stations(length, outer_span, inner_span, patch, notch_depth * slope)
    limits = [(s + d) / 2 for s in (outer_span, inner_span) for d in (patch, -patch)]
    sections = [length / 2, *limits]
    round_half = sections[-1] - min(radius, room) / 2
    # gmsh's tolerances are absolute: mesh a bar of unit size; powers of two lose no digit.
    scale = 2.0 ** frexp(length)[1]
    plane = np.array([(0.0, -radius), (0.0, depth - radius)])
    cell_size = graded_size(
        [], [plane / scale], size / scale, near_size / scale, band / scale, transition / scale
    )
    with session(Geometry__OCCUnionUnify=0, Mesh__OptimizeNetgen=1) as gmsh:
        # Without unifying, the fused bar keeps its patches apart.
        gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, default: cell_size(x, z))
        try:
            _draw(
                gmsh, radius / scale, [x / scale for x in sections], round_half / scale,
                notch_depth / scale, slope,
            )  # fmt: skip
            gmsh.model.mesh.generate(3)
        except Exception as error:  # gmsh raises nothing more precise
            raise MeshError(
                f"gmsh made no mesh ({error}); smaller sizes or wider gaps between patches, "
                "notch and ends may help."
            ) from error
        points, cells = _tetrahedra(gmsh)
    return _with_sets(points * scale, cells, radius, sections, round_half, notch_depth, slope)


def _draw(
    gmsh: ModuleType,
    radius: float,
    sections: list[float],
    round_half: float,
    notch_depth: float,
    slope: float,
) -> None:
    """Draw the bar in the current model: polygons at +-`sections`, round within `round_half`."""
    occ = gmsh.model.occ
    angles = [(k - 0.5) * _TURN for k in range(_FACES)]

    def ring(x: float, is_round: bool) -> int:
        corner = [occ.addPoint(x, radius * np.sin(a), -radius * np.cos(a)) for a in angles]
        pairs = [(corner[k], corner[(k + 1) % _FACES]) for k in range(_FACES)]
        if is_round:
            middle = occ.addPoint(x, 0.0, 0.0)
            return int(occ.addWire([occ.addCircleArc(a, middle, b) for a, b in pairs]))
        return int(occ.addWire([occ.addLine(a, b) for a, b in pairs]))

    # A step from polygon to circle would leave slivers: each edge bends into its arc instead.
    ends = []
    for side in (-1, 1):
        rings = [ring(side * x, is_round=False) for x in sections]
        rings.append(ring(side * round_half, is_round=True))
        ends += occ.addThruSections(rings, makeSolid=True, makeRuled=True)
    # One whole face: lines along the bar could pass the ends of the notch too closely.
    middle = (3, occ.addCylinder(-round_half, 0.0, 0.0, 2 * round_half, 0.0, 0.0, radius))
    bar, _ = occ.fuse([middle], ends)
    root, mouth = notch_depth - radius, -notch_depth - radius
    half = (root - mouth) * slope
    corner = [
        occ.addPoint(x, -2 * radius, z) for x, z in ((0.0, root), (-half, mouth), (half, mouth))
    ]
    loop = occ.addCurveLoop([occ.addLine(corner[i], corner[(i + 1) % 3]) for i in range(3)])
    wedge = occ.extrude([(2, occ.addPlaneSurface([loop]))], 0.0, 4 * radius, 0.0)
    occ.cut(bar, [entity for entity in wedge if entity[0] == 3])
    occ.synchronize()


def _tetrahedra(gmsh: ModuleType) -> tuple[Floats, Ints]:
    """Points (only those that cells use) and cells of the current model."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    corners = gmsh.model.mesh.getElementsByType(4)[1]
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    point_numbers, cells = np.unique(number[corners], return_inverse=True)
    return coordinates.reshape(-1, 3)[point_numbers], cells.reshape(-1, 4)


def _with_sets(
    points: Floats,
    cells: Ints,
    radius: float,
    sections: list[float],
    round_half: float,
    notch_depth: float,
    slope: float,
) -> Mesh:
    """Name the facets by where they lie, and put ends and root exactly into their planes."""
    tolerance = _TOLERANCE * 2 * radius
    root = notch_depth - radius
    in_root = (abs(points[:, 0]) < tolerance) & (abs(points[:, 2] - root) < tolerance)
    points[in_root, 0], points[in_root, 2] = 0.0, root
    for end in (-sections[0], sections[0]):
        points[abs(points[:, 0] - end) < tolerance, 0] = end
    facets = sound_mesh(points, cells).boundary
    x, y, z = np.moveaxis(points[facets], -1, 0)

    round_side = Arc((0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0))
    on_round = (abs(np.hypot(y, z) - radius) < tolerance) & (abs(x) < round_half + tolerance)
    in_notch = (abs(abs(x) - (root - z) * slope) < tolerance).all(axis=1)
    sets = {
        "left": facets[(x == -sections[0]).all(axis=1)],
        "right": facets[(x == sections[0]).all(axis=1)],
        "notch": facets[in_notch],
        "round": facets[on_round.all(axis=1) & ~in_notch],
    }
    angle = _TURN * np.arange(_FACES)[:, None, None]
    height = np.sin(angle) * y - np.cos(angle) * z - radius * np.cos(_TURN / 2)
    on_face = (abs(height) < tolerance).all(axis=-1)
    _, *limits = sections
    for station, (x1, x0) in (("outer", limits[:2]), ("inner", limits[2:])):
        for side, position in (("left", -x), ("right", x)):
            is_in_notch = ((position > x0 - tolerance) & (position < x1 + tolerance)).all(axis=1)
            for k in range(_FACES):
                sets[f"{station}_{side}_{k:02d}"] = facets[is_in_notch & on_face[k]]
    return sound_mesh(points, cells, sets, curves={"round": round_side})


def _check_depths(diameter: float, notch_depth: float, depth: float) -> None:
    if not notch_depth < depth <= diameter:
        raise GeometryError(
            f"crack_depth = {depth:g} must exceed notch_depth = {notch_depth:g} and not "
            f"diameter = {diameter:g}: both count from the lowest line of the bar."
        )


def _check_sizes(
    diameter: float, length: float, size: float, near_size: float, band: float, depth: float
) -> None:
    if size > diameter:
        raise GeometryError(
            f"size = {size:g} is larger than the diameter: give at most {diameter:g}, "
            "better a fifth of it."
        )
    if near_size > size:
        raise GeometryError(
            f"size_near = {near_size:g} is larger than size = {size:g}: cells grow away from the "
            f"notch; exchange the two or leave size_near out."
        )
    body = pi / 4 * diameter**2 * length
    points = inf  # also where powers of sizes are too small for a number
    if near_size > FINEST * length:
        points = body / size**3 + min(2 * band * diameter * depth, body) / near_size**3
    if points > _MOST_POINTS:
        raise GeometryError(
            f"size = {size:g} and size_near = {near_size:g} ask for about {points:.1e} points, "
            f"more than {_MOST_POINTS:.0e}: enlarge the size, or narrow the band."
        )


def _check_stations(
    length: float, outer_span: float, inner_span: float, patch: float, mouth: float
) -> float:
    """Half of what the inner patches leave between them beside the notch, which is 2 `mouth`."""
    gaps = {
        f"the outer patches and the ends: make length exceed {outer_span + patch:g}": (
            length - outer_span - patch
        ),
        f"outer and inner patches: make outer_span exceed {inner_span + 2 * patch:g}": (
            outer_span - inner_span - 2 * patch
        ),
        f"the inner patches and the notch: make inner_span exceed {patch + 2 * mouth:g}": (
            inner_span - patch - 2 * mouth
        ),
    }
    for neighbours, gap in gaps.items():
        if gap <= 0:
            raise GeometryError(
                f"no room ({gap / 2:g}) between {neighbours}, or shorten patch_length = {patch:g}."
            )
    return gap / 2
