"""Variationally consistent gradients of the tip functions.

Quadrature integrates the derivatives of tip functions with an error that pollutes the contact
pressure near the tip. On each piece (cell, or side of a cut cell) a gradient linear in x is added
so that the discrete divergence theorem holds for the moments 1 and x: constant and linear stress
fields then pass the patch test to round-off with any rule (after Chen, Hillman and Rüter, 2013).
The integrals over the boundary of a piece use points that neighbours share.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Floats, Ints
from xcrack.cut import Cut
from xcrack.lip_points import LipPoints
from xcrack.mesh import local_facets
from xcrack.quadrature import cell_side, segment_points
from xcrack.space import Batch, Space


@dataclass(frozen=True, eq=False)
class BoundaryPoints:
    """Points on the boundary of pieces.

    Attributes
    ----------
    cell : (q,) array of int
    bary : (q, d + 1) array
    normal : (q, d) array, length^(d - 1)
        Outward normal of the piece times the weight.
    side : (q, cracks) array of int
    piece_side : (q,) array of int
        0 for a piece that is a whole cell, else the side of the cut.
    """

    cell: Ints
    bary: Floats
    normal: Floats
    side: Ints
    piece_side: Ints


def boundary_points(space: Space, cells: Ints, lips: tuple[LipPoints, ...]) -> BoundaryPoints:
    """Points on all facets and lips of the pieces of the given cells, sorted by cell."""
    parts = [_facet_points(space, cells)]
    wanted = np.zeros(len(space.mesh.cells), dtype=bool)
    wanted[cells] = True
    for c, (cut, points) in enumerate(zip(space.cuts, lips, strict=True)):
        parts.extend(_lip_parts(space, c, cut, points, wanted))
    cell, bary, normal, side, piece = (np.concatenate(p) for p in zip(*parts, strict=True))
    order = np.argsort(cell, kind="stable")
    return BoundaryPoints(cell[order], bary[order], normal[order], side[order], piece[order])


_Part = tuple[Ints, Floats, Floats, Ints, Ints]


def _facet_points(space: Space, cells: Ints) -> _Part:
    """Points on the edges of plane cells, split where a crack crosses them."""
    mesh = space.mesh
    facet_ids, inverse = np.unique(mesh.cell_to_facet[cells].ravel(), return_inverse=True)
    ends = mesh.facets[facet_ids]
    number, begin, end, sides = split_facets(space, ends)
    x = mesh.points[ends]
    first = (1 - begin)[:, None] * x[number, 0] + begin[:, None] * x[number, 1]
    last = (1 - end)[:, None] * x[number, 0] + end[:, None] * x[number, 1]
    rule = segment_points(space, first, last)
    piece = rule.segment
    t = begin[piece] + (end - begin)[piece] * rule.position
    weight = (end - begin)[piece] * rule.weight
    facet = number[piece]
    # Each facet's points are handed to every cell that has it.
    by_facet = sp.csr_matrix(
        (np.arange(len(t)) + 1, (facet, np.arange(len(t)))), shape=(len(facet_ids), len(t))
    )
    counts = np.diff(by_facet.indptr)[inverse]
    start = by_facet.indptr[inverse]
    owner = np.repeat(np.arange(len(inverse)), counts)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    point = by_facet.indices[start[owner] + place]
    row, opposite = owner // (mesh.dim + 1), owner % (mesh.dim + 1)
    cell = cells[row]
    local = local_facets(mesh.dim)[opposite]
    vertices = np.take_along_axis(mesh.cells[cell], local, 1)
    low_first = vertices[:, 0] == ends[facet[point], 0]
    position = np.where(low_first, t[point], 1 - t[point])
    other = np.where(low_first, 1 - t[point], t[point])
    bary = np.zeros((len(owner), mesh.dim + 1))
    rows = np.arange(len(owner))
    bary[rows, local[:, 0]] = other
    bary[rows, local[:, 1]] = position
    outward = -mesh.gradient[cell, opposite] * (mesh.dim * mesh.volume[cell])[:, None]
    normal = outward * weight[point, None]
    side = cell_side(space, cell)
    piece_side = np.zeros(len(owner), dtype=np.int64)
    for c, cut in enumerate(space.cuts):
        crossed = cut.is_cut[cell] | (cut.is_tip[cell] & (side[:, c] == 0))
        own = sides[piece[point], c]
        side[crossed, c] = own[crossed]
        piece_side = np.where(cut.is_cut[cell], own, piece_side)
    return cell, bary, normal, side, piece_side


def split_facets(space: Space, ends: Ints) -> tuple[Ints, Floats, Floats, Ints]:
    """Split plane facets `(k, 2)` where cracks cross them.

    Returns
    -------
    number : (s,) array of int
        Row of `ends` of each part.
    begin, end : (s,) arrays
        Positions from the first point.
    side : (s, cracks) array of int
        Sign of phi on the part, 0 where it lies on the crack or phi changes its sign on it.
    """
    mesh = space.mesh
    edge = _edge_numbers(mesh, ends)
    k = len(ends)
    position = np.full(k, np.nan)
    for cut in space.cuts:
        t = cut.cut_edge[edge]
        # cut_edge counts from the smaller point number.
        t = np.where(ends[:, 0] < ends[:, 1], t, 1 - t)
        position = np.where(np.isnan(position), t, position)
    split = ~np.isnan(position)
    number = np.concatenate([np.arange(k), np.nonzero(split)[0]])
    begin = np.concatenate([np.zeros(k), position[split]])
    end = np.concatenate([np.where(split, position, 1.0), np.ones(int(split.sum()))])
    side = np.zeros((len(number), len(space.cuts)), dtype=np.int64)
    for c, cut in enumerate(space.cuts):
        values = cut.level_set.phi[ends[number]]
        middle = (begin + end) / 2
        at = (1 - middle) * values[:, 0] + middle * values[:, 1]
        # Ahead of a tip phi changes its sign on a facet that no crack splits.
        ahead = np.isnan(cut.cut_edge[edge])[number] & (values[:, 0] * values[:, 1] < 0)
        side[:, c] = np.where(ahead, 0, np.sign(at))
    return number, begin, end, side


def _edge_numbers(mesh: object, ends: Ints) -> Ints:
    edges, n = mesh.edges, mesh.n_points  # type: ignore[attr-defined]
    key = edges[:, 0] * np.int64(n) + edges[:, 1]
    low, high = np.sort(ends, axis=1).T
    return np.searchsorted(key, low * np.int64(n) + high)


def _lip_parts(space: Space, c: int, cut: Cut, lips: LipPoints, wanted: np.ndarray) -> list[_Part]:
    parts = []
    same = lips.cell[:, 0] == lips.cell[:, 1]
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        mine = same & wanted[cell]
        side = cell_side(space, cell[mine])
        side[:, c] = sign
        # The normal points from lip - to lip +: outward for the minus side, inward for the plus.
        normal = -sign * lips.normal[mine] * lips.weight[mine, None]
        piece = np.where(cut.is_cut[cell[mine]], sign, 0)
        parts.append((cell[mine], lips.bary[mine, s], normal, side, piece))
    return parts


def corrected(
    space: Space,
    batch: Batch,
    points: tuple[Ints, Floats, Floats, Ints],
    values: Floats,
    gradients: Floats,
    boundary: BoundaryPoints,
) -> Floats:
    """Gradients `(q, n, d)` with those of the tip functions corrected.

    Parameters
    ----------
    points : row in batch, barycentric coordinates, weights and sides of the volume points
    values, gradients : tabulated functions at these points
    boundary : points on the boundary of all pieces
    """
    row, bary, weight, side = points
    d = space.dim
    n_tip = sum((d + 1) * space.tips[t].functions for t in batch.tips)
    first = batch.functions.shape[1] - n_tip
    x, size = _local(space, batch, row, bary)
    piece, n_pieces = _pieces(space, batch, row, side)

    chosen, brow = _of_batch(batch, boundary.cell)
    bvalues, _ = space.tabulate(batch, brow, boundary.bary[chosen], boundary.side[chosen])
    bx, _ = _local(space, batch, brow, boundary.bary[chosen])
    bpiece = 2 * brow + (boundary.piece_side[chosen] > 0)

    moments = np.concatenate([np.ones((len(x), 1)), x], axis=1)
    bmoments = np.concatenate([np.ones((len(bx), 1)), bx], axis=1)
    psi, dpsi = values[:, first:], gradients[:, first:]
    flux = np.einsum("qf,qj,qa->qfja", bvalues[:, first:], boundary.normal[chosen], bmoments)
    inner = np.einsum("q,qfj,qa->qfja", weight, dpsi, moments)
    # d(x_a)/dx_j is 1/size in the scaled coordinates of a cell.
    for j in range(d):
        inner[:, :, j, 1 + j] += weight[:, None] * psi / size[row][:, None]
    defect = _sum(bpiece, flux, n_pieces) - _sum(piece, inner, n_pieces)
    gram = _sum(piece, np.einsum("q,qa,qb->qab", weight, moments, moments), n_pieces)
    total = np.maximum(gram[:, 0, 0], 1e-300)
    inverse = np.linalg.pinv(gram / total[:, None, None], rcond=1e-12, hermitian=True)
    coefficient = np.einsum("pab,pfjb->pfja", inverse, defect / total[:, None, None, None])
    result = gradients.copy()
    result[:, first:] += np.einsum("qfja,qa->qfj", coefficient[piece], moments)
    # Functions that do not act on a cell stay zero.
    result[:, first:] *= (batch.functions[row, first:] >= 0)[:, :, None]
    return result


def _local(space: Space, batch: Batch, row: Ints, bary: Floats) -> tuple[Floats, Floats]:
    mesh = space.mesh
    corners = mesh.points[mesh.cells[batch.cells]]
    centre, size = corners.mean(axis=1), mesh.cell_size[batch.cells]
    # Summing the differences avoids the cancellation of absolute coordinates.
    relative = np.einsum("qb,qbd->qd", bary, corners[row] - centre[row][:, None])
    return relative / size[row][:, None], size


def _pieces(space: Space, batch: Batch, row: Ints, side: Ints) -> tuple[Ints, int]:
    plus = np.zeros(len(row), dtype=bool)
    for c, cut in enumerate(space.cuts):
        plus |= cut.is_cut[batch.cells][row] & (side[:, c] > 0)
    return 2 * row + plus, 2 * len(batch.cells)


def _of_batch(batch: Batch, cell: Ints) -> tuple[Ints, Ints]:
    place = np.searchsorted(batch.cells, cell)
    place = np.minimum(place, len(batch.cells) - 1)
    chosen = np.nonzero(batch.cells[place] == cell)[0]
    return chosen, place[chosen]


def _sum(group: Ints, values: Floats, n: int) -> Floats:
    gather = sp.csr_matrix(
        (np.ones(len(group)), (group, np.arange(len(group)))), shape=(n, len(group))
    )
    flat = gather @ values.reshape(len(group), -1)
    return np.asarray(flat).reshape(n, *values.shape[1:])
