"""Longest-edge bisection of triangles and tetrahedra on arrays.

Every cell with a bisected edge must have its own longest edge bisected (Rivara, 1984, Int. J.
Numer. Meth. Eng. 20, 745; in 3D Rivara and Levin, 1992, Comm. Appl. Numer. Meth. 8, 281). Edges
are in one order: by length, where these are equal by direction (in a regular mesh neighbours then
agree, and a cell is bisected with one neighbour, not with a long chain of them), at last by the
place of their middle. So facets are split alike from both sides, it ends, and numbers of points
play no part.
"""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.mesh.mesh import Mesh, local_edges

_ALIKE = 1e7  # steps a factor of two in which lengths are compared
_PLACE = 1e6  # steps a length in which directions and places of middles are
_BASE = np.int64(2**31)  # above every number of a point


@dataclass(frozen=True, eq=False)
class Simplices:
    """Simplices between bisections; edges that were split stay in the list.

    Attributes
    ----------
    points : (n, d) array, length
    cells : (m, d + 1) array of int
    edges : (e, 2) array of int
    middle : (e, d) array, length
    rank : (e, 2 d + 1) array of int
        Order of the edges: length, the longest lowest, direction, place of the middle.
    cell_to_edge : (m, d (d + 1) / 2) array of int
    longest : (m,) array of int
        Local number of each cell's longest edge.
    facet : (m, d + 1) array of int
        Facet of the mesh at the beginning in which each cell's facet lies; -1 inside, and for
        the second cell of a facet.
    parent : (m,) array of int
        Cell of that mesh in which each lies.
    """

    points: Floats
    cells: Ints
    edges: Ints
    middle: Floats
    rank: Ints
    cell_to_edge: Ints
    longest: Ints
    facet: Ints
    parent: Ints

    @property
    def size(self) -> Floats:
        """Longest edge of each cell `(m,)`, length."""
        ends = self.points[self.edges[_row(self.cell_to_edge, self.longest)]]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @property
    def centre(self) -> Floats:
        """Centres of the cells `(m, d)`, length."""
        return np.asarray(self.points[self.cells].mean(axis=1))


def simplices(mesh: Mesh) -> Simplices:
    """A mesh as it enters bisection."""
    middle, rank = _ranked(mesh.points, mesh.edges)
    own = mesh.facet_to_cell[mesh.cell_to_facet, 0] == np.arange(len(mesh.cells))[:, None]
    return Simplices(
        mesh.points, mesh.cells, mesh.edges, middle, rank, mesh.cell_to_edge,
        _longest(middle, rank, mesh.cell_to_edge), np.where(own, mesh.cell_to_facet, -1),
        np.arange(len(mesh.cells)),
    )  # fmt: skip


def moved(whole: Simplices, points: Floats) -> Simplices:
    """The same simplices with their points at other places."""
    middle, rank = _ranked(points, whole.edges)
    longest = _longest(middle, rank, whole.cell_to_edge)
    return replace(whole, points=points, middle=middle, rank=rank, longest=longest)


def bisected(whole: Simplices, marked: Bools) -> tuple[Simplices, Bools]:
    """Split the longest edge of each marked cell, and what it takes to conform.

    Parameters
    ----------
    whole : Simplices
    marked : (m,) array of bool

    Returns
    -------
    whole : Simplices
        Untouched cells first, in their order; the old points have their numbers.
    untouched : (m,) array of bool
        Which of the cells are still there.
    """
    untouched = np.ones(len(whole.cells), dtype=bool)
    split = np.zeros(len(whole.edges), dtype=bool)
    split[_row(whole.cell_to_edge, whole.longest)[marked]] = True
    # Of each split edge its middle, and the first of its two halves.
    point, half = np.full((2, len(split)), -1, dtype=np.int64)
    known, number = np.zeros((2, 0), dtype=np.int64)  # edges between a middle and another point
    while True:
        top = _row(whole.cell_to_edge, whole.longest)
        hanging = np.asarray(split[whole.cell_to_edge].any(axis=1))
        while (ahead := hanging & ~split[top]).any():
            split[top[ahead]] = True
            hanging = np.asarray(split[whole.cell_to_edge].any(axis=1))
        if not hanging.any():
            return whole, untouched
        still = np.nonzero(untouched)[0]
        untouched[still[hanging[: len(still)]]] = False
        new = np.unique(top[hanging])
        new = new[point[new] < 0]
        point[new] = len(whole.points) + np.arange(len(new))
        half[new] = len(whole.edges) + 2 * np.arange(len(new))
        ends, middle = whole.edges[new], point[new]
        halves = np.stack([ends[:, 0], middle, ends[:, 1], middle], axis=1).reshape(-1, 2)
        whole = replace(whole, points=np.concatenate([whole.points, whole.middle[new]]))
        whole = _with_edges(whole, halves)
        across = _across(whole, hanging, point)
        key = across[..., 0] * _BASE + across[..., 1]
        fresh = np.setdiff1d(key, known)
        first = len(whole.edges)
        whole = _with_edges(whole, np.stack([fresh // _BASE, fresh % _BASE], axis=1))
        known = np.concatenate([known, fresh])
        number = np.concatenate([number, first + np.arange(len(fresh))])
        order = np.argsort(known)
        known, number = known[order], number[order]
        whole = _halved(whole, hanging, point, half, number[np.searchsorted(known, key)])
        more = len(whole.edges) - len(split)
        split = np.concatenate([split, np.zeros(more, dtype=bool)])
        point, half = (np.concatenate([a, np.full(more, -1)]) for a in (point, half))


def _row(table: Ints, column: Ints) -> Ints:
    """One entry of each row."""
    return np.asarray(table[np.arange(len(table)), column])


def _ranked(points: Floats, edges: Ints) -> tuple[Floats, Ints]:
    """Middles of edges, and what orders them: the same bits however points are numbered."""
    one, other = points[edges[:, 0]], points[edges[:, 1]]
    middle = 0.5 * (one + other)
    step = np.round(np.log2(np.linalg.norm(one - other, axis=1)) * _ALIKE)
    length = np.exp2(step / _ALIKE)[:, None]
    direction = np.round((one - other) / length * _PLACE)
    leading = direction[np.arange(len(edges)), np.argmax(direction != 0, axis=1)]
    direction *= np.sign(leading)[:, None]
    place = np.round(middle / length * _PLACE)
    return middle, np.concatenate([-step[:, None], direction, place], axis=1).astype(np.int64)


def _longest(middle: Floats, rank: Ints, cell_to_edge: Ints) -> Ints:
    """Local number of the first edge of each cell in the order of the edges."""
    first = np.ones(cell_to_edge.shape, dtype=bool)
    rows = np.arange(len(first))
    for column in (*rank.T, *middle.T):  # middles for slivers, where all else is the same
        candidate = np.where(first[rows], column[cell_to_edge[rows]], column.max(initial=0) + 1)
        first[rows] = candidate == candidate.min(axis=1, keepdims=True)
        rows = rows[first[rows].sum(axis=1) > 1]
        if not len(rows):
            break
    return np.asarray(np.argmax(first, axis=1))


def _with_edges(whole: Simplices, edges: Ints) -> Simplices:
    middle, rank = _ranked(whole.points, edges)
    return replace(
        whole,
        edges=np.concatenate([whole.edges, edges]),
        middle=np.concatenate([whole.middle, middle]),
        rank=np.concatenate([whole.rank, rank]),
    )


def _across(whole: Simplices, rows: Bools, point: Ints) -> Ints:
    """Edges from the middle of each cell's longest edge to its other points `(k, d - 1, 2)`."""
    dim = whole.cells.shape[1] - 1
    others = np.array([[k for k in range(dim + 1) if k not in pair] for pair in local_edges(dim)])
    longest, cells = whole.longest[rows], whole.cells[rows]
    middle = point[_row(whole.cell_to_edge[rows], longest)]
    other = np.take_along_axis(cells, others[longest], axis=1)
    return np.stack([other, np.broadcast_to(middle[:, None], other.shape)], axis=-1)


def _halved(whole: Simplices, rows: Bools, point: Ints, half: Ints, across: Ints) -> Simplices:
    """Cells split at the middle of their longest edge; the other ones come first."""
    dim = whole.cells.shape[1] - 1
    pairs = local_edges(dim)
    pair_of = np.zeros((dim + 1, dim + 1), dtype=np.int64)
    pair_of[pairs[:, 0], pairs[:, 1]] = pair_of[pairs[:, 1], pairs[:, 0]] = np.arange(len(pairs))
    others = np.array([[k for k in range(dim + 1) if k not in pair] for pair in pairs])
    cells, longest, facet = whole.cells[rows], whole.longest[rows], whole.facet[rows]
    edges = whole.cell_to_edge[rows]
    n = np.arange(len(cells))
    top = edges[n, longest]
    children = []
    for side in (0, 1):
        stays, goes = pairs[longest, side], pairs[longest, 1 - side]
        corners, sides, outside = cells.copy(), edges.copy(), facet.copy()
        corners[n, goes] = point[top]
        sides[n, longest] = half[top] + (whole.edges[top, 0] != cells[n, stays])
        for k, number in zip(others[longest].T, across.T, strict=True):
            sides[n, pair_of[goes, k]] = number
        outside[n, stays] = -1
        children.append((corners, sides, outside))
    corners, sides, outside = (np.concatenate(parts) for parts in zip(*children, strict=True))
    rest = ~rows
    longest = _longest(whole.middle, whole.rank, sides)
    return replace(
        whole,
        cells=np.concatenate([whole.cells[rest], corners]),
        cell_to_edge=np.concatenate([whole.cell_to_edge[rest], sides]),
        longest=np.concatenate([whole.longest[rest], longest]),
        facet=np.concatenate([whole.facet[rest], outside]),
        parent=np.concatenate([whole.parent[rest], np.tile(whole.parent[rows], 2)]),
    )


__all__ = ["Simplices", "bisected", "moved", "simplices"]
