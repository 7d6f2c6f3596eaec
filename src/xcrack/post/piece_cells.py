"""Simplices of which a cracked body is drawn: whole cells, and sub-cells that fit each other."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Bools, Floats, Ints
from xcrack.mesh.mesh import local_edges
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.quadrature import SubCells, sub_cells

_REACH = 1.731  # lengths of an edge from a tip within which it is halved; no tie on regular meshes
_LEVELS = 4  # times that an edge at a tip is halved
# Parts of a triangle by its halved edges 01, 02, 12; numbers 3, 4, 5 are their midpoints.
_PARTS = {
    (True, False, False): [(0, 3, 2), (3, 1, 2)],
    (False, True, False): [(0, 1, 4), (4, 1, 2)],
    (False, False, True): [(0, 1, 5), (0, 5, 2)],
    (True, True, False): [(0, 3, 4), (3, 1, 2), (3, 2, 4)],
    (True, False, True): [(3, 1, 5), (0, 3, 5), (0, 5, 2)],
    (False, True, True): [(4, 5, 2), (0, 1, 5), (0, 5, 4)],
    (True, True, True): [(0, 3, 4), (3, 1, 5), (4, 5, 2), (3, 5, 4)],
}


@dataclass(frozen=True, eq=False)
class PieceCells:
    """Simplices that fill a body.

    Attributes
    ----------
    plain : (m,) array of int
        Cells drawn whole.
    cell : (s,) array of int
        Cell of each sub-cell of the others.
    bary : (s, d + 1, d + 1) array
        Vertices of the sub-cells in barycentric coordinates of the cell, turning as it does.
    side : (s, cracks) array of int
        Side of each crack, 0 where that means nothing.
    """

    plain: Ints
    cell: Ints
    bary: Floats
    side: Ints


def piece_cells(space: FunctionSpace) -> PieceCells:
    """Split the cells on which enriched functions act, in 2D finer towards the tips.

    In 3D a face of a cell at a front may be split while its neighbour ahead is whole, and two
    neighbours may halve a four-sided face along different diagonals: points on such a face hang.
    They lie where they should and carry the value of the solution there, which a picture needs.
    """
    touched = space.signature > 0
    for cut in space.cuts:
        touched = touched | cut.is_cut | cut.is_tip
    mesh, plane = space.mesh, space.dim == 2
    if plane:
        near = _near_tip(space, mesh.points[mesh.edges])
        touched = touched | near[mesh.cell_to_edge].any(axis=1)
    plain, others = np.nonzero(~touched)[0], np.nonzero(touched)[0]
    subs = sub_cells(space, others)
    cell, bary, side = (
        _without_exits(space, subs) if plane else (subs.cell, subs.bary.copy(), subs.side.copy())
    )
    wrong = np.linalg.det(bary) < 0
    bary[wrong, -2:] = bary[wrong, -2:][:, ::-1]
    for _ in range(_LEVELS if plane else 0):
        cell, bary, side = _halved(space, cell, bary, side)
    return PieceCells(plain, cell, bary, side)


def _near_tip(space: FunctionSpace, ends: Floats) -> Bools:
    """Edges `(..., 2, d)` to be halved: a matter of the edge alone, so that neighbours agree."""
    if not space.tips:
        return np.zeros(ends.shape[:-2], dtype=bool)
    tips = cKDTree(np.array([tip.x for tip in space.tips]))
    length = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
    return np.asarray(tips.query(ends.mean(axis=-2))[0] < _REACH * length)


def _halved(
    space: FunctionSpace, cell: Ints, bary: Floats, side: Ints
) -> tuple[Ints, Floats, Ints]:
    """Halve the edges of triangles near a tip."""
    pairs = local_edges(2)
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[space.mesh.cells[cell]])
    mark = _near_tip(space, x[:, pairs])
    nodes = np.concatenate([bary, bary[:, pairs].mean(axis=2)], axis=1)
    rest = np.nonzero(~mark.any(axis=1))[0]
    rows, parts = [rest], [bary[rest]]
    for pattern, triangles in _PARTS.items():
        mine = np.nonzero((mark == pattern).all(axis=1))[0]
        for triangle in triangles:
            rows.append(mine)
            parts.append(nodes[mine][:, triangle])
    every = np.concatenate(rows)
    return cell[every], np.concatenate(parts), side[every]


def _without_exits(space: FunctionSpace, subs: SubCells) -> tuple[Ints, Floats, Ints]:
    """Join the two sub-cells of a tip cell that meet where the prolonged crack leaves it.

    No function jumps there, and the cell ahead is whole: its edge would not fit two.
    """
    bary, side = subs.bary.copy(), subs.side.copy()
    keep = np.ones(len(bary), dtype=bool)
    corner = space.mesh.cells[subs.cell]
    for c, cut in enumerate(space.cuts):
        if not cut.n_tips:
            continue
        phi = np.einsum("svb,sb->sv", bary, cut.level_set.phi[corner])
        inside = np.einsum("svb,sb->sv", bary, cut.level_set.inside[corner])
        small = 1e-9 * space.mesh.cell_size[subs.cell][:, None]
        exits = (np.abs(phi) <= small) & (inside > 0) & (bary.max(axis=2) < 1 - 1e-12)
        exits &= (subs.fan & cut.is_tip[subs.cell])[:, None]
        before, after = np.nonzero(exits[:, 2])[0], np.nonzero(exits[:, 1])[0]
        _, i, j = np.intersect1d(subs.cell[before], subs.cell[after], return_indices=True)
        before, after = before[i], after[j]
        bary[before, 2] = bary[after, 2]
        side[before, c] = 0
        keep[after] = False
    return subs.cell[keep], bary[keep], side[keep]
