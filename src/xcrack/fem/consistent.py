"""Variationally consistent gradients of the tip functions.

Quadrature integrates the derivatives of tip functions with an error that pollutes the contact
pressure near the tip. On each piece (cell, or side of a cut cell) a gradient linear in x is added
so that the discrete divergence theorem holds for the moments 1 and x: constant and linear stress
fields then pass the patch test to round-off with any rule (after Chen, Hillman and Rüter, 2013).
The integrals over the boundary of a piece use points that neighbours share.
"""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints, ranges
from xcrack.fem.facets import LipPoints, part_points, split_facets
from xcrack.fem.function_space import Batch, FunctionSpace
from xcrack.fem.quadrature import at_joints, cell_side, lip_side, n_parts, part_numbers

# Dimension and order at which the moments 1 and x are used: in 3D at order 1 only 1, since its
# pressures cannot be linear to round-off anyway.
_LINEAR = {(2, 1), (2, 2), (3, 2)}


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
    """

    cell: Ints
    bary: Floats
    normal: Floats
    side: Ints


def boundary_points(
    space: FunctionSpace, cells: Ints, lips: tuple[LipPoints, ...]
) -> BoundaryPoints:
    """Points on all facets and faces of the pieces of the given cells, sorted by cell."""
    parts = [_facet_points(space, cells)]
    chosen_cells = np.zeros(len(space.mesh.cells), dtype=bool)
    chosen_cells[cells] = True
    for c, points in enumerate(lips):
        parts.extend(_lip_parts(space, c, points, chosen_cells))
    cell, bary, normal, side = (np.concatenate(p) for p in zip(*parts, strict=True))
    order = np.argsort(cell, kind="stable")
    return BoundaryPoints(cell[order], bary[order], normal[order], side[order])


_Part = tuple[Ints, Floats, Floats, Ints]


def _facet_points(space: FunctionSpace, cells: Ints) -> _Part:
    """Points on the facets of cells, split where a crack crosses them."""
    mesh = space.mesh
    facet_ids, inverse = np.unique(mesh.cell_to_facet[cells].ravel(), return_inverse=True)
    ends = mesh.facets[facet_ids]
    parts = split_facets(space, ends)
    piece, place, weight = part_points(space, ends[parts.number], parts.bary)
    at = np.einsum("qv,qvb->qb", place, parts.bary[piece])
    facet = parts.number[piece]
    order = np.argsort(facet, kind="stable")
    piece, at, weight, facet = piece[order], at[order], weight[order], facet[order]
    # Each facet's points are handed to every cell that has it.
    first = np.searchsorted(facet, np.arange(len(facet_ids)))
    counts = np.bincount(facet, minlength=len(facet_ids))[inverse]
    owner, k = ranges(counts)
    point = first[inverse][owner] + k
    # Of each facet of each cell: its corners among those of the cell, and its outward normal.
    corners = mesh.dim + 1
    is_end = np.repeat(mesh.cells[cells], corners, axis=0)[:, :, None] == ends[inverse][:, None, :]
    local = is_end.argmax(axis=1)
    inward = mesh.gradient[cells].reshape(-1, mesh.dim)
    outward = -inward / np.linalg.norm(inward, axis=1, keepdims=True)
    bary = np.zeros((len(owner), corners))
    bary[np.arange(len(owner))[:, None], local[owner]] = at[point]
    normal = outward[owner] * weight[point, None]
    cell = cells[owner // corners]
    side = cell_side(space, cell)
    for c, cut in enumerate(space.cuts):
        crossed = cut.is_cut[cell] | (cut.is_tip[cell] & (side[:, c] == 0))
        side_of_part = parts.side[piece[point], c]
        side[crossed, c] = side_of_part[crossed]
    return cell, bary, normal, at_joints(space, cell, bary, side)


def _lip_parts(
    space: FunctionSpace, c: int, lips: LipPoints, chosen_cells: np.ndarray
) -> list[_Part]:
    parts = []
    in_one_cell = lips.cell[:, 0] == lips.cell[:, 1]
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        is_chosen = in_one_cell & chosen_cells[cell]
        side = lip_side(space, c, cell[is_chosen], lips.bary[is_chosen, s], sign)
        # The normal points from lip - to lip +: outward for the minus side, inward for the plus.
        normal = -sign * lips.normal[is_chosen] * lips.weight[is_chosen, None]
        parts.append((cell[is_chosen], lips.bary[is_chosen, s], normal, side))
    return parts


def corrected(
    space: FunctionSpace,
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
    values, gradients : tabulated functions at these points; gradients are changed in place
    boundary : points on the boundary of all pieces
    """
    from xcrack.fem.kernels.functions import (
        add_correction,
        add_flux,
        moments_at,
        solve_moments,
        take_volume,
    )

    row, bary, weight, side = points
    mesh, d = space.mesh, space.dim
    n_tip = sum((d + 1) * space.tips[t].functions for t in batch.tips)
    first = batch.functions.shape[1] - n_tip
    # Differences of corners avoid the cancellation of absolute coordinates.
    corners = mesh.points[mesh.cells[batch.cells]]
    size = mesh.cell_size[batch.cells]
    corners = (corners - corners.mean(axis=1, keepdims=True)) / size[:, None, None]
    linear = (d, space.order) in _LINEAR
    parts = n_parts(space)
    piece = parts * row + part_numbers(space, batch.cells[row], side)

    chosen, brow = _of_batch(batch, boundary.cell)
    bary_, bside = boundary.bary[chosen], boundary.side[chosen]
    bvalues = space.tip_values(batch, brow, bary_, bside)
    bpiece = parts * brow + part_numbers(space, batch.cells[brow], bside)

    moments = moments_at(row, bary, corners, linear)
    bmoments = moments_at(brow, bary_, corners, linear)
    count = moments.shape[1]
    n_pieces = parts * len(batch.cells)
    defect, gram = np.zeros((n_pieces, n_tip, d, count)), np.zeros((n_pieces, count, count))
    add_flux(defect, bpiece, bvalues, boundary.normal[chosen], bmoments)
    take_volume(
        defect, gram, piece, weight, values[:, first:], gradients[:, first:], moments, 1 / size[row]
    )
    solve_moments(defect, gram, 1e-12)
    add_correction(gradients, first, piece, row, defect, moments, batch.functions)
    return gradients


def _of_batch(batch: Batch, cell: Ints) -> tuple[Ints, Ints]:
    place = np.minimum(batch.cells.searchsorted(cell), len(batch.cells) - 1)
    chosen = (batch.cells[place] == cell).nonzero()[0]
    return chosen, place[chosen]
