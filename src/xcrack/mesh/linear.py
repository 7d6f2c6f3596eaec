"""Elements of other programs made simplices: midside nodes left out, the rest split conformingly.

A face of four corners is divided from its corner of smallest number, so that cells on both sides of
it agree whatever their kinds; a cell becomes the tetrahedra from its own corner of smallest number
to all triangles of its faces without that corner (Dompierre et al. 1999, How to subdivide pyramids,
prisms and hexahedra into tetrahedra). Quadrilaterals of a plane body take the better diagonal.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.errors import MeshError, warn
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.raw import RawMesh

_Faces = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class CellShape:
    """A kind of element: its dimension, corners and faces (right-handed normals point out)."""

    dim: int
    corners: int
    edges: tuple[tuple[int, int], ...] = ()
    faces: _Faces = ()


_RING_3 = ((0, 1), (1, 2), (2, 0))
_RING_4 = ((0, 1), (1, 2), (2, 3), (3, 0))

# Corner numbers are those of VTK, which meshio, gmsh and Abaqus share.
SHAPES = {
    "vertex": CellShape(0, 1),
    "line": CellShape(1, 2, ((0, 1),)),
    "triangle": CellShape(2, 3, _RING_3),
    "quad": CellShape(2, 4, _RING_4),
    "tetra": CellShape(3, 4, (*_RING_3, (0, 3), (1, 3), (2, 3))),
    "pyramid": CellShape(
        3,
        5,
        (*_RING_4, (0, 4), (1, 4), (2, 4), (3, 4)),
        ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    ),
    "wedge": CellShape(
        3,
        6,
        (*_RING_3, (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
        ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ),
    "hexahedron": CellShape(
        3,
        8,
        (*_RING_4, (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
        ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    ),
}  # fmt: skip
_SIMPLICES = {"vertex", "line", "triangle", "tetra"}
_SOLIDS = {"tetra", "pyramid", "wedge", "hexahedron"}
_PLURAL = {
    "line": "lines", "triangle": "triangles", "quad": "quadrilaterals", "tetra": "tetrahedra",
    "pyramid": "pyramids", "wedge": "prisms", "hexahedron": "hexahedra",
}  # fmt: skip
_FLAT = 1e-9  # share of the largest piece of a cell below which a piece of it has no volume
_STRAIGHT = 1e-6  # of an edge: a midside node this close to the middle is on it
_HIGHEST = 0.51  # of an edge: an arc of half a turn, and its round-off
_SAMPLE = 500  # cells from which the order of nodes is taken
_ORDERS = {
    (kind, nodes): order
    for kind, counts in {
        "line": {3: 2, 4: 3, 5: 4, 6: 5}, "triangle": {6: 2, 7: 2, 10: 3, 15: 4, 21: 5},
        "quad": {8: 2, 9: 2, 12: 3, 16: 3, 25: 4, 36: 5},
        "tetra": {10: 2, 11: 2, 20: 3, 35: 4, 56: 5}, "pyramid": {13: 2, 14: 2, 29: 3, 30: 3},
        "wedge": {15: 2, 18: 2, 40: 3}, "hexahedron": {20: 2, 27: 2, 64: 3, 125: 4},
    }.items()
    for nodes, order in counts.items()
}  # fmt: skip


def base_kind(kind: str) -> str | None:
    """Shape of a kind of element without the number of its nodes, None for what is not read.

    Examples
    --------
    >>> base_kind("tetra10"), base_kind("quad"), base_kind("polygon5")
    ('tetra', 'quad', None)
    """
    name = re.fullmatch(r"([a-z]+)\d*", kind)
    return name.group(1) if name and name.group(1) in SHAPES else None


def linear_mesh(raw_mesh: RawMesh, source: str, strict: bool) -> RawMesh:
    """What a file holds with vertices, lines, triangles and tetrahedra only.

    Parameters
    ----------
    raw_mesh : RawMesh
        Elements of any kind; those of unknown kinds are left as they are.
    source : str
        Name of the file, for messages.
    strict : bool
        Refuse instead of changing anything.

    Returns
    -------
    RawMesh
        With points added in the middle of cells that cannot be divided from a corner.

    Raises
    ------
    MeshError
        Elements to change where `strict`, a damaged file, cells that are inside out.
    """
    shapes = {kind: base for kind, _ in raw_mesh.blocks if (base := base_kind(kind)) is not None}
    bases = {kind: base for kind, base in shapes.items() if kind not in _SIMPLICES}
    counts = {k: sum(len(d) for kind, d in raw_mesh.blocks if kind == k) for k in bases}
    if not sum(counts.values()):
        return raw_mesh
    if strict:
        content = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
        raise MeshError(
            f"{source} has {content}, and strict=True takes linear triangles and tetrahedra only. "
            "Save the mesh at first order with triangles or tetrahedra (gmsh: Mesh.ElementOrder = "
            "1, Mesh.RecombineAll = 0; Abaqus: CPE3, CPS3, C3D4), or leave strict out: midside "
            "nodes are left out then and cells divided."
        )
    _check_points(raw_mesh, source)
    top = max(SHAPES[base].dim for base in shapes.values())
    curved_blocks = [
        _curved_edges(raw_mesh.points, kind, data, source)
        for kind, data in raw_mesh.blocks
        if kind in bases and SHAPES[bases[kind]].dim == top and len(data)
    ]
    pairs, middles, bulge = _joined_edges(curved_blocks)
    entries = [*raw_mesh.blocks, *((kind, data) for kind, _, data in raw_mesh.sets)]
    corners = [
        (shapes[kind], data[:, : SHAPES[shapes[kind]].corners]) if kind in bases else (kind, data)
        for kind, data in entries
    ]
    plane = _SOLIDS.isdisjoint(shapes.values()) and _is_plane(raw_mesh.points)
    points, split = np.asarray(raw_mesh.points, dtype=float), dict[int, tuple[str, Ints]]()
    for base in ("quad", "pyramid", "wedge", "hexahedron"):
        rows = [i for i, (kind, data) in enumerate(corners) if kind == base and len(data)]
        if not rows:
            continue
        corner_numbers = np.concatenate([corners[i][1] for i in rows]).astype(np.int64)
        if base in _SOLIDS:
            pieces, parent, points = _tetrahedra(points, corner_numbers, base, source)
        else:
            pieces, parent = _triangles(points, corner_numbers, plane, source)
        begin = np.concatenate([[0], np.cumsum([len(corners[i][1]) for i in rows])])
        limits = np.searchsorted(parent, begin)
        kind = "tetra" if base in _SOLIDS else "triangle"
        for i, first, stop in zip(rows, limits, limits[1:], strict=False):
            split[i] = (kind, pieces[first:stop])
    all_entries = [split.get(i, entry) for i, entry in enumerate(corners)]
    blocks = all_entries[: len(raw_mesh.blocks)]
    names = [name for _, name, _ in raw_mesh.sets]
    sets = [(k, n, d) for n, (k, d) in zip(names, all_entries[len(blocks) :], strict=True)]
    # An element may be in the file as part of the body and of sets: what was done is told once.
    _tell(source, counts, shapes, blocks, bulge, len(points) - len(raw_mesh.points))
    return RawMesh(points, blocks, sets, raw_mesh.point_sets, pairs, middles)


def _is_plane(points: Floats) -> bool:
    """Whether all points have one z: quadrilaterals of other surfaces are refused later."""
    spread = np.ptp(np.asarray(points, dtype=float), axis=0)
    return bool(len(spread) == 2 or spread[2] <= _STRAIGHT * spread.max())


def _tell(
    source: str,
    counts: dict[str, int],
    shapes: dict[str, str],
    blocks: Sequence[tuple[str, Ints]],
    bulge: tuple[float, float],
    added_points: int,
) -> None:
    body = "tetra" if any(kind == "tetra" for kind, _ in blocks) else "triangle"
    top = SHAPES[body].dim
    total = sum(len(data) for kind, data in blocks if kind == body)
    dims = {kind: SHAPES[shapes[kind]].dim for kind in counts}
    curved_count = sum(n for k, n in counts.items() if k != shapes[k] and dims[k] == top)
    parts = []
    if curved_count:
        parts.append(
            f"the midside nodes of {curved_count} cells of second or higher order are left out ("
            + (
                f"the sides are straight now, which moves them by up to {bulge[1]:.3g}, "
                f"{bulge[0]:.1%} of an edge; refine puts new points onto the curves of the boundary"
                if bulge[0] > _STRAIGHT
                else "all sides were straight"
            )
            + "; Problem(order=2) puts functions of second order on the cells)"
        )
    divided_counts: dict[str, int] = {}
    for kind, count in counts.items():
        base = shapes[kind]
        if dims[kind] == top and base not in _SIMPLICES and count:
            divided_counts[base] = divided_counts.get(base, 0) + count
    if divided_counts:
        content = ", ".join(f"{count} {_PLURAL[base]}" for base, count in divided_counts.items())
        middle = f", {added_points} of them from a point in their middle" if added_points else ""
        parts.append(f"{content} are divided{middle}")
    if parts:
        warn(
            f"{source}: {'; '.join(parts)}: {total} {_PLURAL[body]} in all. "
            "read_mesh(..., strict=True) refuses such a file."
        )


def _check_points(raw_mesh: RawMesh, source: str) -> None:
    for kind, data in raw_mesh.blocks:
        if base_kind(kind) and data.size and (data.min() < 0 or data.max() >= len(raw_mesh.points)):
            raise MeshError(
                f"{source}: a cell names a point that the file lacks (it has "
                f"{len(raw_mesh.points)} points): the file is damaged."
            )


_CurvedEdges = tuple[Ints, Floats, tuple[float, float]]


def _joined_edges(parts: Sequence[_CurvedEdges]) -> _CurvedEdges:
    """Curved edges of several blocks as one list, each once, and the largest bulge."""
    if not parts:
        return np.zeros((0, 2), np.int64), np.zeros((0, 3)), (0.0, 0.0)
    pairs, middles, bulges = zip(*parts, strict=True)
    all_pairs, first = np.unique(np.concatenate(pairs), axis=0, return_index=True)
    return all_pairs, np.concatenate(middles)[first], max(bulges)


def _curved_edges(points: Floats, kind: str, data: Ints, source: str) -> _CurvedEdges:
    """Edges of cells of second or higher order that are not straight, smaller end first.

    Also diagonals of their quadrilaterals, whose middle is that of the serendipity element; and
    the largest distance of a middle from the straight one: share of the edge, length.
    """
    shape = SHAPES[base_kind(kind) or "vertex"]
    count = len(shape.edges)
    order = _order_of(kind, data.shape[1])
    nodes = data[:, shape.corners : shape.corners + count * (order - 1)]
    x = np.asarray(points, dtype=float)
    ends = x[data[:, np.array(shape.edges).reshape(-1, 2)]]
    slots = _nodes_of_edges(x[nodes], ends, order) if nodes.size else None
    if slots is None:
        return np.zeros((0, 2), np.int64), np.zeros((0, x.shape[1])), (0.0, 0.0)
    middles = _middles(x[nodes], ends, slots)
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    _check_middles(middles, ends, length, data, source)
    offset = np.linalg.norm(middles - ends.mean(axis=2), axis=2)
    share = offset / np.maximum(length, np.finfo(float).tiny)
    worst_edge = np.unravel_index(int(np.argmax(share)), share.shape)
    pairs = data[:, np.array(shape.edges)]
    faces = [face for face in shape.faces if len(face) == 4]
    if faces:
        corner = data[:, np.array(faces)]
        number = {frozenset(edge): k for k, edge in enumerate(shape.edges)}
        edges_around = [[number[frozenset((f[i], f[i - 1]))] for i in range(4)] for f in faces]
        centre = middles[:, edges_around].sum(axis=2) / 2 - x[corner].sum(axis=2) / 4
        pairs = np.concatenate([pairs, corner[:, :, [0, 2]], corner[:, :, [1, 3]]], axis=1)
        middles = np.concatenate([middles, centre, centre], axis=1)
        edge_ends = x[pairs]
        offset = np.linalg.norm(middles - edge_ends.mean(axis=2), axis=2)
        share = offset / np.maximum(
            np.linalg.norm(edge_ends[:, :, 1] - edge_ends[:, :, 0], axis=2), 1e-300
        )
    is_curved = share > _STRAIGHT
    listed_pairs = np.sort(pairs[is_curved], axis=1).astype(np.int64)
    listed_pairs, first = np.unique(listed_pairs, axis=0, return_index=True)
    bulge = (float(share[worst_edge]), float(offset[worst_edge])) if count else (0.0, 0.0)
    return listed_pairs, middles[is_curved][first], bulge


def _order_of(kind: str, nodes: int) -> int:
    """Order of an element by its number of nodes; 1 where it is not known."""
    return _ORDERS.get((base_kind(kind) or "", nodes), 1)


def _nodes_of_edges(x: Floats, ends: Floats, order: int) -> list[list[int]] | None:
    """Which nodes lie on each edge, and none where that is not clear.

    Programs number them in different orders, the same for all cells of a kind: a node's edge is
    that to which it is nearest in most cells.
    """
    part = slice(None, None, max(1, len(x) // _SAMPLE))
    a, b = ends[part, None, :, 0], ends[part, None, :, 1]
    square = np.maximum(((b - a) ** 2).sum(axis=-1), np.finfo(float).tiny)
    offset = np.linalg.norm(x[part, :, None] - closest_on_segment(x[part, :, None], a, b), axis=-1)
    mean_offset = np.median(offset / np.sqrt(square), axis=0)
    if order == 2:  # beside the middle of an edge, not anywhere on it
        middle = np.linalg.norm(x[part, :, None] - (a + b) / 2, axis=-1)
        mean_offset = np.median(middle / np.sqrt(square), axis=0)
    edge = np.argmin(mean_offset, axis=1)
    slots = [np.nonzero(edge == k)[0].tolist() for k in range(ends.shape[1])]
    return slots if all(len(slot) == order - 1 for slot in slots) else None


def _middles(x: Floats, ends: Floats, slots: list[list[int]]) -> Floats:
    """Middle of each edge: its node there, or what a polynomial through two beside it says."""
    order = len(slots[0]) + 1
    result = np.empty((len(x), len(slots), x.shape[2]))
    for k, slot in enumerate(slots):
        a, b = ends[:, k, 0], ends[:, k, 1]
        from_middle = np.linalg.norm(x[:, slot] - ((a + b) / 2)[:, None], axis=2).mean(axis=0)
        by_distance = np.array(slot)[np.argsort(from_middle, kind="stable")]
        if order % 2 == 0:
            result[:, k] = x[:, by_distance[0]]
            continue
        t = (order - 1) / (2 * order)  # of the node before the middle, and 1 - t of that behind it
        share = (0.5 - t) ** 2 / (2 * t * (1 - t))
        result[:, k] = (0.5 + share) * (x[:, by_distance[0]] + x[:, by_distance[1]]) - share * (
            a + b
        )
    return result


def _check_middles(middles: Floats, ends: Floats, length: Floats, data: Ints, source: str) -> None:
    """Refuse midside nodes that lie outside of their edge."""
    a, b = ends[:, :, 0], ends[:, :, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = ((middles - a) * (b - a)).sum(axis=2) / length**2
        foot = a + fraction[..., None] * (b - a)
        height = np.linalg.norm(middles - foot, axis=2) / length
    is_curved = height > _STRAIGHT
    is_between_ends = np.where(
        is_curved, (fraction > 0.25) & (fraction < 0.75), (fraction > 0) & (fraction < 1)
    )
    is_wrong = ~(is_between_ends & (height < _HIGHEST)) & (length > 0)
    if is_wrong.any():
        cell, edge = np.argwhere(is_wrong)[0]
        raise MeshError(
            f"{source}: a midside node of the cell with the nodes {data[cell].tolist()} (numbers "
            f"from 0) lies outside of its edge from {at(a[cell, edge])} to {at(b[cell, edge])}, at "
            f"{at(middles[cell, edge])} ({int(is_wrong.sum())} such nodes): it must lie between "
            "the quarters of a curved edge, and no farther from it than half of its length. Mend "
            "the order of the nodes or the mesh, or save it at first order (gmsh: "
            "Mesh.ElementOrder = 1)."
        )


def _fans(rows: Ints, faces: _Faces) -> Ints:
    """Triangles of the faces of cells, each from the face's smallest point number `(m, t, 3)`."""
    parts = []
    for face in faces:
        corner = rows[:, list(face)]
        if len(face) == 3:
            parts.append(corner[:, None])
            continue
        first = np.argmin(corner, axis=1)
        place = (first[:, None] + np.arange(4)) % 4
        ring = np.take_along_axis(corner, place, axis=1)
        parts.append(ring[:, [[0, 1, 2], [0, 2, 3]]])
    return np.concatenate(parts, axis=1)


def _proper_simplices(simplices: Ints) -> Bools:
    """Which simplices have no point twice: collapsed elements give such pieces."""
    sorted_corners = np.sort(simplices, axis=-1)
    return np.asarray((np.diff(sorted_corners, axis=-1) > 0).all(axis=-1))


def _tetrahedra(points: Floats, rows: Ints, base: str, source: str) -> tuple[Ints, Ints, Floats]:
    """Tetrahedra of cells, the cell of each (growing), and the points with those added."""
    triangles = _fans(rows, SHAPES[base].faces)
    pieces, keep = _cones(rows.min(axis=1), triangles)
    is_folded = _folded_cells(points, pieces, keep)
    if is_folded.any():
        number = np.nonzero(is_folded)[0]
        # A cell may be there several times, in the body and in sets: one point for all of them.
        _rows, first, inverse = np.unique(
            np.sort(rows[number], axis=1), axis=0, return_index=True, return_inverse=True
        )
        middle = points[rows[number[first]]].mean(axis=1)
        centre = len(points) + inverse.ravel()
        points = np.concatenate([points, middle])
        cone_pieces, solid = _cones(centre, triangles[number])
        is_wrong = _folded_cells(points, cone_pieces, solid)
        if is_wrong.any():
            cell = rows[number[np.argmax(is_wrong)]]
            wrong_count = len(np.unique(inverse.ravel()[is_wrong]))
            raise MeshError(
                f"{source}: the {base} with the corners {cell.tolist()} (numbers from 0) at "
                f"{at(points[cell].mean(axis=0))} is turned inside out or twisted "
                f"({wrong_count} such cells): its corners are in a wrong order, or it has no "
                "volume in places. Mend it in the program that made the mesh."
            )
        pieces[number], keep[number] = cone_pieces, solid
    parent, place = np.nonzero(keep)
    return pieces[parent, place], parent, points


def _cones(apex: Ints, triangles: Ints) -> tuple[Ints, Bools]:
    """Tetrahedra from a point of each cell to its triangles, and which of them are any."""
    tips = np.broadcast_to(apex[:, None, None], (*triangles.shape[:2], 1))
    pieces = np.concatenate([tips, triangles], axis=2)
    return pieces, _proper_simplices(pieces)


def _folded_cells(points: Floats, pieces: Ints, keep: Bools) -> Bools:
    """Cells whose pieces do not all have volumes of one sign."""
    x = points[pieces]
    volume = np.where(keep, np.linalg.det(x[:, :, 1:] - x[:, :, :1]), np.nan)
    with np.errstate(all="ignore"):
        largest_volume = np.nanmax(np.abs(volume), axis=1, initial=0.0)[:, None]
        is_positive = ((volume > _FLAT * largest_volume) | ~keep).all(axis=1)
        is_negative = ((volume < -_FLAT * largest_volume) | ~keep).all(axis=1)
    return np.asarray(~(is_positive | is_negative))


def _triangles(points: Floats, rows: Ints, plane: bool, source: str) -> tuple[Ints, Ints]:
    """Triangles of quadrilaterals and the quadrilateral of each.

    As faces of a 3D body they follow the rule of faces; in a plane body the better one of two
    diagonals is taken, since neighbours share no diagonal.
    """
    first = np.argmin(rows, axis=1)
    ring = np.take_along_axis(rows, (first[:, None] + np.arange(4)) % 4, axis=1)
    pieces = ring[:, [[0, 1, 2], [0, 2, 3]]]
    keep = _proper_simplices(pieces)
    if plane:
        pieces_turned = ring[:, [[1, 2, 3], [1, 3, 0]]]
        keep_turned = _proper_simplices(pieces_turned)
        quality = [
            _worst_shape(points, p, k) for p, k in ((pieces, keep), (pieces_turned, keep_turned))
        ]
        is_better = quality[1] > quality[0] + 1e-9
        pieces, keep = (
            np.where(is_better[:, None, None], pieces_turned, pieces),
            np.where(is_better[:, None], keep_turned, keep),
        )
        is_folded = np.maximum(*quality) <= 0
        if is_folded.any():
            cell = rows[np.argmax(is_folded)]
            raise MeshError(
                f"{source}: the quadrilateral with the corners {cell.tolist()} (numbers from 0) "
                f"at {at(points[cell].mean(axis=0))} crosses itself ({int(is_folded.sum())} such "
                "cells): its corners are in a wrong order. Mend it in the program that made the "
                "mesh."
            )
    parent, place = np.nonzero(keep)
    return pieces[parent, place], parent


def _worst_shape(points: Floats, triangles: Ints, keep: Bools) -> Floats:
    """Least area over squared edges of the triangles of each cell; negative where they fold."""
    x = points[triangles][..., :2]
    first_side, second_side = x[:, :, 1] - x[:, :, 0], x[:, :, 2] - x[:, :, 0]
    area = first_side[..., 0] * second_side[..., 1] - first_side[..., 1] * second_side[..., 0]
    edges = x - np.roll(x, 1, axis=2)
    square = np.maximum((edges**2).sum(axis=(2, 3)), np.finfo(float).tiny)
    shape = np.where(keep, area / square, np.nan)
    # A quadrilateral given clockwise has areas below zero, in both of its triangles.
    sign = np.where(np.nansum(shape, axis=1) < 0, -1.0, 1.0)
    with np.errstate(all="ignore"):
        return np.nanmin(np.where(keep, shape * sign[:, None], np.inf), axis=1)
