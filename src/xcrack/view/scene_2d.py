"""What a picture of a solution shows, as arrays: triangles, contours, lips and colours."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.mesh.locate import barycentric
from xcrack.mesh.mesh import local_edges
from xcrack.model.material import von_mises
from xcrack.output.curved_sides import CurvedSides
from xcrack.output.pieces import Pieces, pieces

FIELDS = {
    "von_mises": "von Mises stress",
    "sxx": "stress xx",
    "syy": "stress yy",
    "sxy": "stress xy",
    "displacement": "displacement",
    "ux": "displacement x",
    "uy": "displacement y",
    "material": "material",
}
SPACE_FIELDS = FIELDS | {
    "szz": "stress zz",
    "syz": "stress yz",
    "sxz": "stress xz",
    "uz": "displacement z",
}
CLOSED = "#d6006c"  # colour of lips that touch
STRESSES = ("von_mises", "sxx", "syy", "sxy", "szz", "syz", "sxz")
_SHARE = 99.0  # % of the area at least whose stress stays within the colours
_NEAR = 1e-8  # share of a cell within which a point lies on a crack


@dataclass(frozen=True, eq=False)
class Scene:
    """A field on the moved body, ready to draw.

    Attributes
    ----------
    points : (n, 2) array, length
    triangles : (t, 3) array of int
    values : (n,) array
    label : str
        What the colour bar says.
    limits : (float, float)
        Ends of the colours.
    is_beyond : (bool, bool)
        Whether values lie below or above the colours.
    has_sign : bool
        The field has a sign: its colours part at zero.
    outline, lips, closed_lips, cell_edges, at_rest, interfaces : (k, 3, 2) arrays, length
        Edges as three points: of the body, of open crack faces, of closed crack faces, between
        cells of the mesh, of the body that has not moved, and between materials.
    focus_box : (2, 2) array, length, optional
        Box to show instead of the whole body.
    """

    points: Floats
    triangles: Ints
    values: Floats
    label: str
    limits: tuple[float, float]
    is_beyond: tuple[bool, bool]
    has_sign: bool
    outline: Floats
    lips: Floats
    closed_lips: Floats
    cell_edges: Floats
    at_rest: Floats
    interfaces: Floats
    focus_box: Floats | None = None

    @property
    def box(self) -> Floats:
        """Lowest and highest coordinates of what is drawn `(2, 2)`, length."""
        if self.focus_box is not None:
            return self.focus_box
        x = np.concatenate([self.points, self.at_rest.reshape(-1, 2)])
        return np.stack([x.min(axis=0), x.max(axis=0)])


def scene(solution: Solution, field: str, warp: float, limits: tuple[float, float] | None) -> Scene:
    """Field on the moved body, each piece with its own side of the crack."""
    body = pieces(solution)
    values = field_values(body, field)
    v_min, v_max, share = _range(body, field, values, limits)
    # Rounded down: "100 %" would not be true.
    label = label_of(body, field)
    label += f", clipped at {int(10 * share) / 10:g} %" if share < 100 else ""
    edge, owner = _edges(body)
    crack, is_closed = _on_lips(body, edge)
    lip = crack >= 0
    on_facet, facet, is_between = _on_facets(body, edge, owner)
    rim = (facet >= 0) & ~lip
    points, triangles = body.points, _triangles(body)
    data = np.concatenate([body.displacement, values[:, None]], axis=1)
    curved_sides = CurvedSides.of(solution.space.mesh)
    rims = None
    if curved_sides is not None:
        points, halves, of_half = _onto_curves(curved_sides, points, edge[rim], facet[rim])
        rims = curved_sides.bend(points[halves], of_half, data[halves])
        points, data, triangles = _curved_triangles(
            curved_sides, points, data, triangles, halves, of_half
        )
    moved_points, values = points + warp * data[:, :2], data[:, 2]
    curve, rest = _curves(edge, moved_points), _curves(edge, points)[rim]
    outline = curve[rim]
    if rims is not None:
        rest = _with_middles(rims[0])
        outline = _with_middles(rims[0] + warp * rims[1][..., :2])
    return Scene(
        points=moved_points,
        triangles=triangles,
        values=values,
        label=label,
        limits=(v_min, v_max),
        is_beyond=(
            bool(values.min() < v_min - 1e-9 * (v_max - v_min)),
            bool(values.max() > v_max + 1e-9 * (v_max - v_min)),
        ),
        has_sign=v_min < 0 < v_max,
        outline=outline,
        lips=curve[lip & ~is_closed],
        closed_lips=curve[lip & is_closed],
        cell_edges=curve[on_facet & ~lip & ~rim],
        at_rest=rest,
        interfaces=curve[is_between & ~lip],
    )


def _onto_curves(
    curved_sides: CurvedSides, points: Floats, edge: Ints, facet: Ints
) -> tuple[Floats, Ints, Ints]:
    """Points with those of curved edges on their curves, and halves of all edges: ends, facet."""
    x, bends = points.copy(), curved_sides.facet_to_curve[facet] >= 0
    number, first = np.unique(edge[bends], return_index=True)
    of_point = np.repeat(facet[bends], 3)[first]
    x[number[number >= 0]] = curved_sides.project(x[number[number >= 0]], of_point[number >= 0])
    a, b, middle = edge.T
    has_middle = middle >= 0
    halves = [
        np.stack(pair, axis=1)
        for pair in ((a[~has_middle], b[~has_middle]), (a[has_middle], middle[has_middle]))
    ]
    halves.append(np.stack([middle[has_middle], b[has_middle]], axis=1))
    return (
        x,
        np.concatenate(halves),
        np.concatenate([facet[~has_middle], facet[has_middle], facet[has_middle]]),
    )


def _curved_triangles(
    curved_sides: CurvedSides,
    points: Floats,
    point_data: Floats,
    triangles: Ints,
    lines: Ints,
    facet: Ints,
) -> tuple[Floats, Floats, Ints]:
    """Points, values and triangles, those beside a curved edge in parts that follow it."""
    edges = curved_sides.facets_of_edges(triangles, lines, facet)
    is_beside = (edges >= 0).any(axis=1)
    corners = triangles[is_beside]
    x, data = curved_sides.bend_edges(points[corners], edges[is_beside], point_data[corners])
    number = len(points) + np.arange(3 * len(x)).reshape(-1, 3)
    return (
        np.concatenate([points, x.reshape(-1, 2)]),
        np.concatenate([point_data, data.reshape(len(number) * 3, -1)]),
        np.concatenate([triangles[~is_beside], number]),
    )


def _with_middles(lines: Floats) -> Floats:
    """Straight lines `(k, 2, 2)` as three points each."""
    return np.stack([lines[:, 0], lines.mean(axis=1), lines[:, 1]], axis=1)


def label_of(body: Pieces, field: str) -> str:
    """What the colour bar says."""
    if field != "material":
        return SPACE_FIELDS[field]
    material_by_set = body.solution.problem.elasticity.named
    names = [f"{k} {name or material.kind}" for k, (name, material) in enumerate(material_by_set)]
    return f"material: {', '.join(names)}"


def field_values(body: Pieces, field: str) -> Floats:
    """Values of a field at the points of the pieces `(n,)`."""
    if field == "von_mises":
        return von_mises(body.stress)
    if field in STRESSES:
        i, j = ("xyz".index(letter) for letter in field[1:])
        return np.array(body.stress[:, i, j])
    if field == "material":
        return body.material.astype(float)
    if field == "displacement":
        return np.asarray(np.linalg.norm(body.displacement, axis=1))
    return np.array(body.displacement[:, "xyz".index(field[1])])


def _range(
    body: Pieces, field: str, values: Floats, limits: tuple[float, float] | None
) -> tuple[float, float, float]:
    """Ends of the colours, and the share of the area (%) within them."""
    if limits is not None:
        return float(limits[0]), float(limits[1]), 100.0
    if field in STRESSES and body.solution.space.tips:
        regular_values = values[body.corners[~body.solution.space.has_tip[body.cell]]]
        v_min, v_max, share = clipped_range(
            values[body.corners], body.volume, float(np.abs(regular_values).max(initial=0.0))
        )
        v_min, v_max = max(v_min, float(values.min())), min(v_max, float(values.max()))
    else:
        v_min, v_max, share = float(values.min()), float(values.max()), 100.0
    return *rounded_range(v_min, v_max, field), share


def clipped_range(
    values: Floats, measure: Floats, regular_limit: float = 0.0
) -> tuple[float, float, float]:
    """Lowest and highest value without the few that are very large, and the share kept (%).

    Parameters
    ----------
    values : (k, v) array
        At the vertices of simplices.
    measure : (k,) array
        Their areas or volumes: otherwise small pieces around a tip would count for more than
        they cover.
    regular_limit : float
        Values up to this size are kept at any rate.
    """
    v_min, v_max = float(values.min()), float(values.max())
    size = np.abs(values)
    order = np.argsort(size, axis=None)
    area = np.cumsum(np.repeat(measure / size.shape[1], size.shape[1])[order])
    size_sorted = size.ravel()[order]
    limit = size_sorted[min(np.searchsorted(area, _SHARE / 100 * area[-1]), len(area) - 1)]
    top = max(regular_limit, float(limit))
    if max(-v_min, v_max) <= top:
        return v_min, v_max, 100.0
    last_shown = np.searchsorted(size_sorted, top, side="right") - 1
    return max(v_min, -top), min(v_max, top), 100 * float(area[last_shown] / area[-1])


def rounded_range(v_min: float, v_max: float, field: str) -> tuple[float, float]:
    """Ends of the colours for values from v_min to v_max."""
    if v_min < 0 < v_max and min(-v_min, v_max) > 0.05 * max(-v_min, v_max):
        v_max = max(-v_min, v_max)
        v_min = -v_max
    if field in ("von_mises", "displacement"):
        v_min = 0.0
    if v_max - v_min <= 1e-6 * max(abs(v_min), abs(v_max)):
        # One value everywhere: noise should not be spread over all the colours.
        middle, reach = (v_min + v_max) / 2, 0.05 * max(abs(v_min), abs(v_max), 1e-300)
        v_min, v_max = middle - reach, middle + reach
    return v_min, v_max


def _triangles(body: Pieces) -> Ints:
    """Straight triangles between all nodes of the pieces."""
    parts = []
    for block in (body.plain_nodes, body.split):
        if block.shape[1] == 6:
            a, b, c, ab, ac, bc = block.T
            quarters = [(a, ab, ac), (ab, b, bc), (ac, bc, c), (ab, bc, ac)]
            parts.append(np.stack([np.stack(t, axis=1) for t in quarters], axis=1).reshape(-1, 3))
        else:
            parts.append(block)
    return np.concatenate(parts)


def _edges(body: Pieces) -> tuple[Ints, Ints]:
    """Edges of pieces: vertices and midpoint (-1: straight), and one of their pieces."""
    pairs = local_edges(2)
    parts = []
    for block in (body.plain_nodes, body.split):
        middle = block[:, 3:] if block.shape[1] == 6 else np.full((len(block), 3), -1)
        parts.append(np.concatenate([block[:, pairs], middle[:, :, None]], axis=2).reshape(-1, 3))
    edge = np.concatenate(parts)
    owner = np.repeat(np.arange(len(body.cell)), 3)
    ends = np.sort(edge[:, :2], axis=1)
    order = np.lexsort((edge[:, 2], ends[:, 1], ends[:, 0]))
    ends = ends[order]
    # The last of a group knows the midpoint if any does.
    is_last = np.append((ends[1:] != ends[:-1]).any(axis=1), True)
    return edge[order][is_last], owner[order][is_last]


def _on_facets(body: Pieces, edge: Ints, owner: Ints) -> tuple[Bools, Ints, Bools]:
    """Which edges lie on facets, on which of the boundary (-1: none), which between materials.

    Counting the pieces at an edge would not tell: sub-cells of neighbours need not match.
    """
    mesh = body.solution.space.mesh
    cell = body.cell[owner]
    a, b = (barycentric(mesh, cell, body.points[edge[:, k]]) for k in (0, 1))
    on = (np.abs(a) < _NEAR) & (np.abs(b) < _NEAR)
    rim = mesh.facet_to_cell[mesh.cell_to_facet, 1] < 0  # opposite to each corner of a cell
    rims = on & rim[cell]
    facet = mesh.cell_to_facet[cell, np.argmax(rims, axis=1)]
    is_interface = np.zeros(len(mesh.facets), dtype=bool)
    is_interface[body.solution.problem.elasticity.interfaces] = True
    is_bonded = (on & is_interface[mesh.cell_to_facet[cell]]).any(axis=1)
    return np.asarray(on.any(axis=1)), np.where(rims.any(axis=1), facet, -1), np.asarray(is_bonded)


def _curves(edge: Ints, points: Floats) -> Floats:
    a, b = points[edge[:, 0]], points[edge[:, 1]]
    middle = np.where(edge[:, 2:] >= 0, points[edge[:, 2]], (a + b) / 2)
    return np.stack([a, middle, b], axis=1)


def _on_lips(body: Pieces, edge: Ints) -> tuple[Ints, Bools]:
    """Crack on which each edge lies, or -1, and whether its faces touch there."""
    crack = np.full(len(edge), -1, dtype=np.int64)
    is_closed = np.zeros(len(edge), dtype=bool)
    a, b = body.points[edge[:, 0]], body.points[edge[:, 1]]
    tolerance = _NEAR * float(body.solution.space.mesh.cell_size.min())
    for c, phi in enumerate(body.phi):
        is_on_crack = (np.abs(phi[edge[:, :2]]) <= tolerance).all(axis=1)
        # Ahead of a tip phi is zero as well.
        for psi in body.psi[c]:
            is_on_crack &= (psi[edge[:, :2]] <= tolerance).all(axis=1)
        crack[is_on_crack] = c
        contact = body.solution.contact[c]
        if contact is not None and is_on_crack.any():
            nearest_points = cKDTree(contact.points).query((a[is_on_crack] + b[is_on_crack]) / 2)[1]
            is_closed[is_on_crack] = contact.closed[nearest_points]
    return crack, is_closed
