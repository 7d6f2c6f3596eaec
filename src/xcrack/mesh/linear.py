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


def base_kind(kind: str) -> str | None:
    """Shape of a kind of element without the number of its nodes, None for what is not read.

    Examples
    --------
    >>> base_kind("tetra10"), base_kind("quad"), base_kind("polygon5")
    ('tetra', 'quad', None)
    """
    name = re.fullmatch(r"([a-z]+)\d*", kind)
    return name.group(1) if name and name.group(1) in SHAPES else None


def linear_mesh(raw: RawMesh, source: str, strict: bool) -> RawMesh:
    """What a file holds with vertices, lines, triangles and tetrahedra only.

    Parameters
    ----------
    raw : RawMesh
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
    shapes = {kind: base for kind, _ in raw.blocks if (base := base_kind(kind)) is not None}
    other = {kind: base for kind, base in shapes.items() if kind not in _SIMPLICES}
    counts = {k: sum(len(d) for kind, d in raw.blocks if kind == k) for k in other}
    if not sum(counts.values()):
        return raw
    if strict:
        content = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
        raise MeshError(
            f"{source} has {content}, and strict=True takes linear triangles and tetrahedra only. "
            "Save the mesh at first order with triangles or tetrahedra (gmsh: Mesh.ElementOrder = "
            "1, Mesh.RecombineAll = 0; Abaqus: CPE3, CPS3, C3D4), or leave strict out: midside "
            "nodes are left out then and cells divided."
        )
    _check_points(raw, source)
    bulge = max((_bulge(raw.points, k, d) for k, d in raw.blocks if k in other), default=(0.0, 0.0))
    entries = [*raw.blocks, *((kind, data) for kind, _, data in raw.sets)]
    corners = [
        (shapes[kind], data[:, : SHAPES[shapes[kind]].corners]) if kind in other else (kind, data)
        for kind, data in entries
    ]
    plane = _SOLIDS.isdisjoint(shapes.values()) and _is_plane(raw.points)
    points, split = np.asarray(raw.points, dtype=float), dict[int, tuple[str, Ints]]()
    for base in ("quad", "pyramid", "wedge", "hexahedron"):
        rows = [i for i, (kind, data) in enumerate(corners) if kind == base and len(data)]
        if not rows:
            continue
        together = np.concatenate([corners[i][1] for i in rows]).astype(np.int64)
        if base in _SOLIDS:
            pieces, parent, points = _tetrahedra(points, together, base, source)
        else:
            pieces, parent = _triangles(points, together, plane, source)
        begin = np.concatenate([[0], np.cumsum([len(corners[i][1]) for i in rows])])
        limits = np.searchsorted(parent, begin)
        kind = "tetra" if base in _SOLIDS else "triangle"
        for i, first, last in zip(rows, limits, limits[1:], strict=False):
            split[i] = (kind, pieces[first:last])
    done = [split.get(i, entry) for i, entry in enumerate(corners)]
    blocks = done[: len(raw.blocks)]
    names = [name for _, name, _ in raw.sets]
    sets = [(k, n, d) for n, (k, d) in zip(names, done[len(blocks) :], strict=True)]
    # An element may be in the file as part of the body and of sets: what was done is told once.
    _tell(source, counts, shapes, blocks, bulge, len(points) - len(raw.points))
    return RawMesh(points, blocks, sets, raw.point_sets)


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
    added: int,
) -> None:
    body = "tetra" if any(kind == "tetra" for kind, _ in blocks) else "triangle"
    top = SHAPES[body].dim
    total = sum(len(data) for kind, data in blocks if kind == body)
    dims = {kind: SHAPES[shapes[kind]].dim for kind in counts}
    curved = sum(n for k, n in counts.items() if k != shapes[k] and dims[k] == top)
    parts = []
    if curved:
        parts.append(
            f"the midside nodes of {curved} cells of second or higher order are left out ("
            + (
                f"the sides are straight now, which moves them by up to {bulge[1]:.3g}, "
                f"{bulge[0]:.1%} of an edge"
                if bulge[0] > _STRAIGHT
                else "all sides were straight"
            )
            + "; Problem(order=2) puts functions of second order on the cells)"
        )
    divided: dict[str, int] = {}
    for kind, count in counts.items():
        base = shapes[kind]
        if dims[kind] == top and base not in _SIMPLICES and count:
            divided[base] = divided.get(base, 0) + count
    if divided:
        content = ", ".join(f"{count} {_PLURAL[base]}" for base, count in divided.items())
        middle = f", {added} of them from a point in their middle" if added else ""
        parts.append(f"{content} are divided{middle}")
    if parts:
        warn(
            f"{source}: {'; '.join(parts)}: {total} {_PLURAL[body]} in all. "
            "read_mesh(..., strict=True) refuses such a file."
        )


def _check_points(raw: RawMesh, source: str) -> None:
    for kind, data in raw.blocks:
        if base_kind(kind) and data.size and (data.min() < 0 or data.max() >= len(raw.points)):
            raise MeshError(
                f"{source}: a cell names a point that the file lacks (it has {len(raw.points)} "
                "points): the file is damaged."
            )


def _bulge(points: Floats, kind: str, data: Ints) -> tuple[float, float]:
    """Largest distance of a midside node from the middle of the nearest edge: share, length."""
    shape = SHAPES[base_kind(kind) or "vertex"]
    nodes = data[:, shape.corners : shape.corners + len(shape.edges)]
    if not nodes.size:
        return 0.0, 0.0
    x = np.asarray(points, dtype=float)
    ends = x[data[:, np.array(shape.edges)]]
    middle, length = ends.mean(axis=2), np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    # Programs number midside nodes in different orders; the nearest edge is the node's own.
    best = np.full(nodes.shape, np.inf)
    share = np.zeros(nodes.shape)
    for edge in range(len(shape.edges)):
        distance = np.linalg.norm(x[nodes] - middle[:, edge, None], axis=2)
        nearer = distance < best
        best = np.where(nearer, distance, best)
        relative = distance / np.maximum(length[:, edge, None], np.finfo(float).tiny)
        share = np.where(nearer, relative, share)
    worst = np.unravel_index(int(np.argmax(share)), share.shape)
    return float(share[worst]), float(best[worst])


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
    ordered = np.sort(simplices, axis=-1)
    return np.asarray((np.diff(ordered, axis=-1) > 0).all(axis=-1))


def _tetrahedra(points: Floats, rows: Ints, base: str, source: str) -> tuple[Ints, Ints, Floats]:
    """Tetrahedra of cells, the cell of each (growing), and the points with those added."""
    triangles = _fans(rows, SHAPES[base].faces)
    pieces, keep = _cones(rows.min(axis=1), triangles)
    folded = _folded_cells(points, pieces, keep)
    if folded.any():
        number = np.nonzero(folded)[0]
        # A cell may be there several times, in the body and in sets: one point for all of them.
        _unique, first, inverse = np.unique(
            np.sort(rows[number], axis=1), axis=0, return_index=True, return_inverse=True
        )
        middle = points[rows[number[first]]].mean(axis=1)
        centre = len(points) + inverse.ravel()
        points = np.concatenate([points, middle])
        again, solid = _cones(centre, triangles[number])
        wrong = _folded_cells(points, again, solid)
        if wrong.any():
            cell = rows[number[np.argmax(wrong)]]
            different = len(np.unique(inverse.ravel()[wrong]))
            raise MeshError(
                f"{source}: the {base} with the corners {cell.tolist()} (numbers from 0) at "
                f"{at(points[cell].mean(axis=0))} is turned inside out or twisted "
                f"({different} such cells): its corners are in a wrong order, or it has no volume "
                "in places. Mend it in the program that made the mesh."
            )
        pieces[number], keep[number] = again, solid
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
        most = np.nanmax(np.abs(volume), axis=1, initial=0.0)[:, None]
        positive = ((volume > _FLAT * most) | ~keep).all(axis=1)
        negative = ((volume < -_FLAT * most) | ~keep).all(axis=1)
    return np.asarray(~(positive | negative))


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
        turned = ring[:, [[1, 2, 3], [1, 3, 0]]]
        also = _proper_simplices(turned)
        quality = [_worst_shape(points, p, k) for p, k in ((pieces, keep), (turned, also))]
        other = quality[1] > quality[0] + 1e-9
        pieces, keep = (
            np.where(other[:, None, None], turned, pieces),
            np.where(other[:, None], also, keep),
        )
        folded = np.maximum(*quality) <= 0
        if folded.any():
            cell = rows[np.argmax(folded)]
            raise MeshError(
                f"{source}: the quadrilateral with the corners {cell.tolist()} (numbers from 0) "
                f"at {at(points[cell].mean(axis=0))} crosses itself ({int(folded.sum())} such "
                "cells): its corners are in a wrong order. Mend it in the program that made the "
                "mesh."
            )
    parent, place = np.nonzero(keep)
    return pieces[parent, place], parent


def _worst_shape(points: Floats, triangles: Ints, keep: Bools) -> Floats:
    """Least area over squared edges of the triangles of each cell; negative where they fold."""
    x = points[triangles][..., :2]
    one, two = x[:, :, 1] - x[:, :, 0], x[:, :, 2] - x[:, :, 0]
    area = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    edges = x - np.roll(x, 1, axis=2)
    square = np.maximum((edges**2).sum(axis=(2, 3)), np.finfo(float).tiny)
    shape = np.where(keep, area / square, np.nan)
    # A quadrilateral given clockwise has areas below zero, in both of its triangles.
    sign = np.where(np.nansum(shape, axis=1) < 0, -1.0, 1.0)
    with np.errstate(all="ignore"):
        return np.nanmin(np.where(keep, shape * sign[:, None], np.inf), axis=1)
