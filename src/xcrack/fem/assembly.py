"""Stiffness, of the uncracked body once a mesh, of enriched cells once a crack."""

from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, ranges, row_stretches
from xcrack.base.machine import (
    map_tasks,
    number_of_threads,
    one_blas_thread,
    stream_tasks,
)
from xcrack.fem.facets import LipPoints, part_points
from xcrack.fem.function_space import Batch, FunctionSpace
from xcrack.fem.quadrature import (
    Points,
    at_joints,
    cell_points,
    cell_side,
    lip_side,
    n_parts,
    part_numbers,
)
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, shape_derivatives, simplex_rule
from xcrack.model.elasticity import Elasticity
from xcrack.model.loads import Load
from xcrack.model.material import Material, isotropic_part
from xcrack.model.numerics import Numerics

# Variationally consistent gradients of the tip functions.
#
# Quadrature integrates the derivatives of tip functions with an error that pollutes the contact
# pressure near the tip. On each piece (cell, or side of a cut cell) a gradient linear in x is added
# so that the discrete divergence theorem holds for the moments 1 and x: constant and linear stress
# fields then pass the patch test to round-off with any rule (after Chen, Hillman and Rüter, 2013).
# The integrals over the boundary of a piece use points that neighbours share.

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
    parts = space.geometry.split_facets(space, ends)
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
    corner_in_cell = is_end.argmax(axis=1)
    inward_normal = mesh.gradient[cells].reshape(-1, mesh.dim)
    outward_normal = -inward_normal / np.linalg.norm(inward_normal, axis=1, keepdims=True)
    bary = np.zeros((len(owner), corners))
    bary[np.arange(len(owner))[:, None], corner_in_cell[owner]] = at[point]
    normal = outward_normal[owner] * weight[point, None]
    cell = cells[owner // corners]
    side = cell_side(space, cell)
    for c, cut in enumerate(space.cuts):
        is_crossed = cut.is_cut[cell] | (cut.is_tip[cell] & (side[:, c] == 0))
        side_of_part = parts.side[piece[point], c]
        side[is_crossed, c] = side_of_part[is_crossed]
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


def corrected_gradients(
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
    values, gradients : tabulated functions at these points; gradients are changed in place, and
        values are needed where the correction is linear
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
    is_linear = (d, space.order) in _LINEAR
    parts = n_parts(space)
    piece = parts * row + part_numbers(space, batch.cells[row], side)

    boundary_rows, brow = _of_batch(batch, boundary.cell)
    bary_, bside = boundary.bary[boundary_rows], boundary.side[boundary_rows]
    bpiece = parts * brow + part_numbers(space, batch.cells[brow], bside)
    n_pieces = parts * len(batch.cells)
    inner_bary = bary_
    if _has_crosses(space):
        inner_bary = _moved_inward(bary_, bpiece, bary, weight, piece, n_pieces)
    bvalues = space.tip_values(batch, brow, inner_bary, bside)

    moments = moments_at(row, bary, corners, is_linear)
    bmoments = moments_at(brow, bary_, corners, is_linear)
    count = moments.shape[1]
    defect, gram = np.zeros((n_pieces, n_tip, d, count)), np.zeros((n_pieces, count, count))
    add_flux(defect, bpiece, bvalues, boundary.normal[boundary_rows], bmoments)
    take_volume(
        defect, gram, piece, weight, values[:, first:], gradients[:, first:], moments, 1 / size[row]
    )
    solve_moments(defect, gram, 1e-12)
    add_correction(gradients, first, piece, row, defect, moments, batch.functions)
    return gradients


_INWARD = 1e-6  # share of the way to the middle of a piece
_SAME = 1e-9  # of the body: ends that are one


def _has_crosses(space: FunctionSpace) -> bool:
    """Whether in 2D two cracks end at one place: each may lie on the prolongation of the other."""
    if space.dim > 2 or len(space.joints) < 2:
        return False
    ends = np.array([joint.centre for joint in space.joints])
    distance = np.linalg.norm(ends[:, None] - ends, axis=2)[np.triu_indices(len(ends), 1)]
    return bool((distance <= _SAME * space.mesh.extent).any())


def _moved_inward(
    bary: Floats, piece: Ints, volume_bary: Floats, weight: Floats, owner: Ints, n_pieces: int
) -> Floats:
    """Boundary points `(q, v)` moved into their pieces by a hair.

    Tip functions of an arm of a cross jump along the arm on the other side, where only the piece
    tells on which side a point of the faces is: round-off must not decide.
    """
    total = np.bincount(owner, weight, n_pieces)
    columns = [np.bincount(owner, weight * column, n_pieces) for column in volume_bary.T]
    middle = np.stack(columns, axis=1) / np.where(total > 0, total, 1.0)[:, None]
    way = np.where(total[piece, None] > 0, middle[piece] - bary, 0.0)
    return np.asarray(bary + _INWARD * way)


def _of_batch(batch: Batch, cell: Ints) -> tuple[Ints, Ints]:
    place = np.minimum(batch.cells.searchsorted(cell), len(batch.cells) - 1)
    rows = (batch.cells[place] == cell).nonzero()[0]
    return rows, place[rows]


# Points in cells together with the functions that act there, for sums over several columns.


@dataclass(frozen=True, eq=False)
class Tabulated:
    """Integration points with the gradients of the functions there.

    Attributes
    ----------
    points : Points
    batches : tuple of (batch, number, row, slope)
        Each serves the points of the given numbers `(k,)`: their cells' rows in the batch `(k,)`,
        and the gradients of its functions `(k, n, d)`.
    """

    points: Points
    batches: tuple[tuple[Batch, Ints, Ints, Floats], ...]

    def gradients(self, coefficients: Floats) -> Floats:
        """Gradients of displacements `(q, d, d, s)` from the unknowns by function `(f, d, s)`."""
        from xcrack.fem.kernels.functions import set_gradients

        coefficients = np.ascontiguousarray(coefficients)
        d, states = coefficients.shape[1:]
        gradient = np.zeros((len(self.points.cell), d, d, states))
        for batch, number, row, slope in self.batches:
            set_gradients(gradient, number, slope, batch.functions, row, coefficients)
        return gradient


def tabulate_functions(space: FunctionSpace, points: Points) -> Tabulated:
    """The functions of a space at points.

    Parameters
    ----------
    space : FunctionSpace
    points : Points
    """
    batches = []
    for batch, number, row in space.batches_of_points(points.cell):
        bary_and_side = points.bary[number], points.side[number]
        _, slope = space.tabulate(batch, row, *bary_and_side, values=False)
        batches.append((batch, number, row, slope))
    return Tabulated(points, tuple(batches))


# Stiffness of all unknowns: that of the body and that of enriched functions, apart or joined.


@dataclass(frozen=True, eq=False)
class Enriched:
    """Entries with an enriched function, in blocks of function pairs.

    Attributes
    ----------
    indptr : (n_functions + 1,) array of int
    indices : (k,) array of int32
        Sorted in each row.
    data : (k, d, d) array
    """

    indptr: Ints
    indices: Any
    data: Floats


@dataclass(frozen=True, eq=False)
class Stiffness:
    """The two parts of a stiffness; large bodies have no memory for their sum.

    Attributes
    ----------
    body : sparse matrix (n, n)
        Node blocks of the uncracked body, BSR.
    enriched : Enriched
    """

    body: sp.bsr_matrix
    enriched_blocks: Enriched

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        n = (len(self.enriched_blocks.indptr) - 1) * self.enriched_blocks.data.shape[1]
        return n, n

    def __matmul__(self, x: Floats) -> Floats:
        """Forces `(n_dof,)` or `(n_dof, k)` of displacements of the same shape."""
        return _product((self.body, self.enriched_blocks), x)

    def sum_of_rows(self, rows: Bools | None = None) -> sp.csr_matrix:
        """The sum, of all rows or of some functions `(n_functions,)`; others are empty."""
        from xcrack.fem.kernels.stiffness import joined_blocks

        body, blocks = self.body, self.enriched_blocks
        chosen_rows = np.ones(len(blocks.indptr) - 1, dtype=bool) if rows is None else rows
        entries = body.data.size + blocks.data.size
        kind = np.int32 if entries < np.iinfo(np.int32).max else np.int64
        indptr, indices, data = joined_blocks(
            body.indptr.astype(kind, copy=False), body.indices, body.data, blocks.indptr,
            blocks.indices, blocks.data, chosen_rows,
        )  # fmt: skip
        return sp.csr_matrix((data, indices, indptr), shape=self.shape)


def body_forces(body: sp.bsr_matrix, x: Floats) -> Floats:
    """Forces `(n,)` or `(n, k)` of displacements of the uncracked body of the same shape."""
    return _product((body,), x)


def _product(parts: tuple[sp.bsr_matrix | Enriched, ...], x: Floats) -> Floats:
    from xcrack.fem.kernels.stiffness import add_block_product

    columns = np.ascontiguousarray(x).reshape(len(x), -1)
    result = np.zeros_like(columns)
    for part in parts:
        add_block_product(part.indptr, part.indices, part.data, columns, result)
    return result.reshape(x.shape)


def next_to_enriched(space: FunctionSpace) -> Bools:
    """Functions that couple with those around a node with enriched functions `(n_functions,)`.

    The enriched columns of a solver's basis hold standard functions of such nodes too.
    """
    has_function = np.zeros(space.n_nodes, dtype=bool)
    for number in space.heaviside:
        has_function |= number >= 0
    for tip in space.tips:
        has_function[: space.mesh.n_points] |= tip.point_to_function >= 0
    is_enriched = np.zeros(space.n_functions, dtype=bool)
    is_enriched[space.cell_nodes[has_function[space.cell_nodes].any(axis=1)]] = True
    is_enriched[space.n_nodes :] = True
    return is_enriched


# Cells that a crack cuts away from its tips: integrated once, as long as their cut stays.


@dataclass(frozen=True, eq=False)
class ReusedCells:
    """Integrals of cells with the Heaviside functions of one crack and no others.

    Attributes
    ----------
    cells : (m,) array of int
        Growing.
    key : (m, k) array
        What the integrals depend on.
    products : (m, n d, n d) array
        Integrals of products of gradients, as `kernels.enriched.gradient_products` makes them.
    """

    cells: Ints
    key: Floats
    products: Floats


def with_one_jump(space: FunctionSpace, cells: Ints) -> Bools:
    """On which cells the Heaviside functions of one crack act, and nothing else.

    Without those around junctions, where they depend on a second crack.
    """
    mask = space.signature[cells]
    has_one_jump = (mask & (mask - 1) == 0) & (mask < 1 << len(space.cuts))
    for joint in space.joints:
        has_one_jump &= ~joint.is_near[cells]
    return np.asarray(has_one_jump)


def reused_cells(
    space: FunctionSpace, elasticity: Elasticity, cells: Ints, previous_cells: ReusedCells | None
) -> tuple[ReusedCells, int]:
    """Integrate cells with one jump, but those that are known already.

    Parameters
    ----------
    space : FunctionSpace
    elasticity : Elasticity
    cells : (m,) array of int
        Growing.
    previous_cells : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    ReusedCells
    n_points : int
        Integration points used.
    """
    from xcrack.fem.kernels.stiffness import gradient_products

    n, key = space.cell_nodes.shape[1], _keys(space, cells)
    products = np.empty((len(cells), 2 * n * space.dim, 2 * n * space.dim))
    is_known_cell = np.zeros(len(cells), dtype=bool)
    if previous_cells is not None and len(previous_cells.cells):
        row = np.minimum(
            np.searchsorted(previous_cells.cells, cells), len(previous_cells.cells) - 1
        )
        is_known_cell = (previous_cells.cells[row] == cells) & (previous_cells.key[row] == key).all(
            axis=1
        )
        products[is_known_cell] = previous_cells.products[row[is_known_cell]]
    new_rows = np.nonzero(~is_known_cell)[0]
    points = cell_points(space, cells[new_rows], 0, _degree(space.order, elasticity))
    weight = elasticity.weights(points.cell, points.bary, points.weight)
    for batch, rows in space.batches(cells[new_rows]):
        number, place, first = points.of_cells(batch.cells)
        bary_and_side = points.bary[number], points.side[number]
        _, G = space.tabulate(batch, place, *bary_and_side, values=False)
        products[new_rows[rows]] = gradient_products(first, weight[number], G, n)
    return ReusedCells(cells, key, products), len(points.weight)


def _keys(space: FunctionSpace, cells: Ints) -> Floats:
    """Crack, its level set, the nodes with its function.

    Side and sub-cells of a cell without a tip follow from the level set at its corners alone, at
    kinks from that of the cut and from where the kink is, and where functions jump in a cell whose
    level set changes its sign, the crack cuts it.
    """
    mesh = space.mesh
    crack = np.log2(space.signature[cells]).astype(np.int64)
    end, nodes = 1 + mesh.cells.shape[1], space.cell_nodes.shape[1]
    key = np.zeros((len(cells), 2 * end + nodes - 1))
    for c in np.unique(crack):
        rows = np.nonzero(crack == c)[0]
        cells_of_rows = cells[rows]
        key[rows, 0] = c
        key[rows, 1:end] = space.cuts[c].level_set.phi[mesh.cells[cells_of_rows]]
        key[rows, end : end + nodes] = space.heaviside[c][space.cell_nodes[cells_of_rows]] >= 0
        kinks = space.cuts[c].kinks
        _, columns, row = np.intersect1d(cells_of_rows, kinks.cells, return_indices=True)
        if len(columns):
            key[rows[columns], 1:end] = kinks.values[row]
            key[rows[columns], end + nodes :] = np.nan_to_num(kinks.vertex[row])
    return key


_CHUNK = 20_000  # integration points tabulated at once; bounds the memory


@dataclass(frozen=True, eq=False)
class MeshLoad:
    """The vector of a load on facets of plain cells: it belongs to the mesh, not to the cracks.

    Attributes
    ----------
    load : Load
    cells : (k,) array of int
        Of its facets.
    f : (n,) array, force
        By standard unknown.
    """

    load: Load
    cells: Ints
    f: Floats


@dataclass(frozen=True, eq=False)
class Bulk:
    """Stiffness of the uncracked body; the same for every crack in a mesh.

    Attributes
    ----------
    mesh : Mesh
    elasticity : Elasticity
    order : int
    matrix : sparse matrix (n, n), stress · length^(d - 2)
        Node blocks, BSR; in 3D each is stored column by column, as products of the solvers read it.
    cells : ReusedCells, optional
        Cut cells of the last crack that may serve the next.
    loads : tuple of MeshLoad
        Of the last solve, that do not act beside a crack.
    free_motions : (fixed, modes), optional
        Standard unknowns that supports decide, and the rigid motions that they leave free.
    """

    mesh: Mesh
    elasticity: Elasticity
    order: int
    matrix: sp.bsr_matrix
    cells: ReusedCells | None = None
    loads: tuple[MeshLoad, ...] = ()
    free_motions: tuple[Bools, Floats] | None = None


def bulk(elasticity: Elasticity, order: int) -> Bulk:
    """Stiffness of the uncracked body."""
    from xcrack.fem.kernels.stiffness import add_block_stiffness, block_pattern

    mesh = elasticity.mesh
    nodes = np.ascontiguousarray(cell_nodes(mesh, order))
    n_nodes = mesh.n_points + (len(mesh.edges) if order == 2 else 0)
    indptr, indices, slot = block_pattern(nodes, n_nodes)
    data = np.zeros((len(indices), mesh.dim, mesh.dim))
    # Threads have rows of their own, so that each sum has the order of the cells.
    rows = np.linspace(0, n_nodes, number_of_threads() + 1).astype(np.int64)
    spans = list(pairwise(indptr[rows].tolist()))

    def add_rows(arrays: tuple[Any, ...], span: tuple[int, int]) -> None:
        add_block_stiffness(data, *span, *arrays)

    for material, cells in elasticity.groups(np.arange(len(mesh.cells))):
        factor = elasticity.factor if material.is_graded else None
        bary, weight = simplex_rule(mesh.dim, 2 * (order - 1) + material.is_graded)
        bulk_arrays = (
            cells, slot, mesh.gradient, mesh.volume, shape_derivatives(order, bary), bary, weight,
            factor, *isotropic_part(material.unit.tensor(mesh.dim)),
        )  # fmt: skip
        map_tasks(partial(add_rows, bulk_arrays), spans)
    if mesh.dim == 3:
        for part in row_stretches(len(data)):
            data[part] = data[part].transpose(0, 2, 1).copy()
        data = data.transpose(0, 2, 1)
    size = n_nodes * mesh.dim
    return Bulk(mesh, elasticity, order, sp.bsr_matrix((data, indices, indptr), shape=(size, size)))


def _degree(order: int, elasticity: Elasticity) -> int:
    """Degree of the stiffness of standard functions: one more where the modulus is linear."""
    return 2 * (order - 1) + elasticity.is_graded


def enriched_stiffness(
    space: FunctionSpace,
    elasticity: Elasticity,
    numerics: Numerics,
    lips: tuple[LipPoints, ...],
    previous_cells: ReusedCells | None = None,
) -> tuple[Enriched, int, ReusedCells | None]:
    """Entries with an enriched function.

    Entries of two standard functions are left out: they are those of the uncracked body.

    Parameters
    ----------
    previous_cells : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    enriched : Enriched
    n_points : int
        Integration points used.
    reused : ReusedCells or None
        For the next crack.
    """
    from xcrack.fem.kernels.stiffness import add_products, add_stiffness, enriched_pattern

    cells, d = space.enriched_cells, space.dim
    if not len(cells):
        indptr, indices = np.zeros(space.n_functions + 1, np.int64), np.zeros(0, np.int32)
        return Enriched(indptr, indices, np.zeros((0, d, d))), 0, None
    has_one_jump = with_one_jump(space, cells)
    reused, n_points = reused_cells(space, elasticity, cells[has_one_jump], previous_cells)
    other_cells = cells[~has_one_jump]
    points = cell_points(space, other_cells, numerics.points, _degree(space.order, elasticity))
    with_tip = cells[space.has_tip[cells]]
    boundary = None
    if numerics.consistent and len(with_tip):
        boundary = boundary_points(space, with_tip, lips)
    indptr, indices = enriched_pattern(_functions(space, cells), space.n_functions, space.n_nodes)
    data = np.zeros((len(indices), d, d))
    for material, group in elasticity.groups(reused.cells):
        stiffness = isotropic_part(material.unit.tensor(d))
        for batch, _ in space.batches(group):
            products = reused.products[np.searchsorted(reused.cells, batch.cells)]
            add_products(
                data, indptr, indices, batch.functions, products, space.n_nodes, *stiffness
            )  # fmt: skip

    def tabulate_batch(task: tuple[Material, Batch]) -> tuple[Material, Ints, Ints, Floats, Floats]:
        material, batch = task
        number, row, first = points.of_cells(batch.cells)
        bary, weight, side = points.bary[number], points.weight[number], points.side[number]
        is_corrected = bool(batch.tips) and boundary is not None
        values = is_corrected and (d, space.order) in _LINEAR
        N, G = space.tabulate(batch, row, bary, side, values=values)
        if boundary is not None and is_corrected:
            G = corrected_gradients(space, batch, (row, bary, weight, side), N, G, boundary)
        return (
            material,
            batch.functions,
            first,
            elasticity.weights(batch.cells[row], bary, weight),
            G,
        )

    tasks = (
        (material, batch)
        for chunk in _chunks(space, points, other_cells)
        for material, group in elasticity.groups(chunk)
        for batch, _ in space.batches(group)
    )
    # Few points take less time than threads to begin.
    is_one_chunk = len(points.weight) <= _CHUNK
    tables = map(tabulate_batch, tasks) if is_one_chunk else stream_tasks(tabulate_batch, tasks)
    for material, functions, first, weight, G in tables:
        with one_blas_thread():
            stiffness = isotropic_part(material.unit.tensor(d))
            add_stiffness(
                data, indptr, indices, functions, first, weight, G, space.n_nodes, *stiffness
            )  # fmt: skip
    return Enriched(indptr, indices, data), n_points + len(points.weight), reused


def _functions(space: FunctionSpace, cells: Ints) -> Ints:
    """Functions that act on cells, in rows of one length."""
    parts = [batch.functions for batch, _ in space.batches(cells)]
    table = np.full((len(cells), max(part.shape[1] for part in parts)), -1, dtype=np.int64)
    first = 0
    for part in parts:
        table[first : first + len(part), : part.shape[1]] = part
        first += len(part)
    return table


def _chunks(space: FunctionSpace, points: Points, cells: Ints) -> list[Ints]:
    counts = np.searchsorted(points.cell, cells, side="right") - np.searchsorted(points.cell, cells)
    group = np.cumsum(counts) // _CHUNK
    return [cells[group == g] for g in np.unique(group)]


def total_stiffness(bulk_: Bulk, blocks: Enriched) -> sp.csr_matrix:
    """Stiffness of all unknowns."""
    return Stiffness(bulk_.matrix, blocks).sum_of_rows()


def rigid_modes(x: Floats) -> Floats:
    """Rigid motions of points `(n, d)`: `(n d, 3)` in 2D, `(n d, 6)` in 3D."""
    n, d = x.shape
    y = x - x.mean(axis=0)
    turns = list(combinations(range(d), 2))
    modes = np.zeros((n, d, d + len(turns)))
    for i in range(d):
        modes[:, i, i] = 1.0
    for k, (i, j) in enumerate(turns):
        modes[:, i, d + k], modes[:, j, d + k] = -y[:, j], y[:, i]
    return modes.reshape(n * d, -1)
