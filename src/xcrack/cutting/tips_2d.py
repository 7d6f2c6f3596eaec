"""Cells at the tips of a crack in 2D: fans of sub-cells, and the crack faces that end there."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.cutting.level_set import LevelSet
from xcrack.mesh.locate import barycentric
from xcrack.mesh.mesh import Mesh, local_edges

_ON_FACET = 1e-13  # barycentric coordinates of a tip below this are zero
_ROUND_OFF = 1e-14  # sub-cells below this share of their cell are left out: they are determinants


SubParts = tuple[Ints, Floats, Floats, Ints]  # cell, barycentric vertices, share, side
LipParts = tuple[Ints, Floats]  # cell, barycentric vertices


@dataclass(frozen=True, eq=False)
class _Ends:
    bary: Floats
    psi: Floats
    edge: Ints


def _cut_points(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats, exists: Bools
) -> _Ends:
    """The two points where phi = 0 meets the boundary of triangles in which it changes sign."""
    pairs = local_edges(mesh.dim)
    edge = mesh.cell_to_edge[cells]
    phi = level_set.phi[mesh.cells[cells]]
    on_vertex = phi == 0
    on_edge = exists[edge]
    n_vertices = mesh.dim + 1
    flags = np.concatenate([on_edge, on_vertex], axis=1)
    order = np.argsort(~flags, axis=1, kind="stable")[:, : mesh.dim]
    bary = np.zeros((len(cells), mesh.dim, n_vertices))
    number = np.full((len(cells), mesh.dim), -1, dtype=np.int64)
    row = np.arange(len(cells))
    for k in range(mesh.dim):
        choice = order[:, k]
        vertex = choice >= len(pairs)
        bary[row[vertex], k, choice[vertex] - len(pairs)] = 1.0
        e = choice[~vertex]
        i, j = pairs[e].T
        # Both cut positions are computed from the values, never one as 1 minus the other.
        a, b = phi[~vertex, i], phi[~vertex, j]
        bary[row[~vertex], k, i] = b / (b - a)
        bary[row[~vertex], k, j] = a / (a - b)
        number[row[~vertex], k] = edge[row[~vertex], e]
    inside = level_set.inside[mesh.cells[cells]]
    psi = np.einsum("cvb,cb->cv", bary, inside)
    return _Ends(bary, psi, number)


def tip_parts(
    mesh: Mesh, level_set: LevelSet, positions: Floats, exists: Bools
) -> list[tuple[SubParts, LipParts, Ints]]:
    """Sub-cells, lips and entry edges of the cells at each tip; see `_tip_cells`."""
    return [
        _tip_cells(mesh, level_set, k, cells, positions, exists)
        for k, cells in enumerate(level_set.tip_cells)
    ]


def _tip_cells(
    mesh: Mesh, level_set: LevelSet, k: int, cells: Ints, positions: Floats, exists: Bools
) -> tuple[SubParts, LipParts, Ints]:
    """Fans of sub-cells from tip k, the crack face piece that ends there, and its entry edges."""
    tip = level_set.tip[k]
    apex = barycentric(mesh, cells, np.broadcast_to(tip, (len(cells), mesh.dim)))
    # Round-off of a tip on a facet would leave a sub-cell without area whose points hit the tip.
    apex = np.where(apex > _ON_FACET, apex, 0.0)
    apex /= apex.sum(axis=1, keepdims=True)
    phi = level_set.phi[mesh.cells[cells]]
    crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    owner, bary, side = [], [], []
    lip_cells, lip_bary, entries = [], [], []
    ends = _cut_points(mesh, level_set, cells[crossed], positions, exists)
    row_of = np.cumsum(crossed) - 1
    for i, cell in enumerate(cells):
        corners = [np.eye(mesh.dim + 1)[v] for v in range(mesh.dim + 1)]
        loop: list[Floats] = []
        for v in range(mesh.dim + 1):
            loop.append(corners[v])
            a, b = phi[i, v], phi[i, (v + 1) % 3]
            if a * b < 0:
                point = np.zeros(3)
                point[v], point[(v + 1) % 3] = b / (b - a), a / (a - b)
                loop.append(point)
        for p, q in zip(loop, loop[1:] + loop[:1], strict=True):
            middle = phi[i] @ (p + q)
            owner.append(cell)
            bary.append([apex[i], p, q])
            largest = phi[i, np.argmax(np.abs(phi[i]))]
            side.append(1 if (middle if middle != 0 else largest) >= 0 else -1)
        if crossed[i]:
            e = row_of[i]
            psi = level_set.psi[k][mesh.cells[cell]] @ ends.bary[e].T
            first = int(np.argmin(psi))
            if psi[first] < -1e-9 * mesh.cell_size[cell]:
                lip_cells.append(cell)
                lip_bary.append([ends.bary[e, first], apex[i]])
                if ends.edge[e, first] >= 0:
                    entries.append(ends.edge[e, first])
    b = np.array(bary, dtype=float).reshape(-1, 3, 3)
    fraction = np.abs(np.linalg.det(b))
    keep = fraction > _ROUND_OFF
    subs = (np.array(owner)[keep], b[keep], fraction[keep], np.array(side, dtype=np.int64)[keep])
    both = np.array(lip_cells, dtype=np.int64)
    two = np.array(lip_bary, dtype=float).reshape(-1, 2, 3)
    return subs, (both, two), np.array(entries, dtype=np.int64)


def lips_up_to_tips(
    mesh: Mesh, level_set: LevelSet, facets: Ints, cells: Ints, psi: Floats
) -> tuple[Floats, Ints]:
    """Ends of the crack faces on edges of the mesh, and the facet of each.

    Those at a tip end there.
    """
    x = mesh.points[mesh.facets[facets]]
    ends_at_tip = np.zeros(len(facets), dtype=bool)
    for k, tip in enumerate(level_set.tip):
        own = level_set.psi[k][mesh.facets[facets]]
        length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        ahead, behind_ = own.argmax(axis=1), own.argmin(axis=1)
        row = np.arange(len(facets))
        reaches = (own[row, ahead] > -1e-9 * length) & (own[row, behind_] < -1e-9 * length)
        reaches &= np.isin(cells, level_set.tip_cells[k]).any(axis=1)
        begin = x[row, behind_]
        x = np.where(
            reaches[:, None, None], np.stack([begin, np.broadcast_to(tip, begin.shape)], 1), x
        )
        ends_at_tip |= reaches
    near = np.nonzero(ends_at_tip | (psi.mean(axis=1) < 0))[0]
    return x[near], near
