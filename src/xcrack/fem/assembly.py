"""Stiffness: the uncracked body once a mesh, enriched cells once a crack."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, row_stretches
from xcrack.base.threads import one_blas_thread, stream_tasks
from xcrack.fem.consistent import boundary_points, corrected
from xcrack.fem.facets import LipPoints
from xcrack.fem.function_space import Batch, FunctionSpace
from xcrack.fem.quadrature import Points, cell_points
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, shape_derivatives, simplex_rule
from xcrack.model.loads import Load
from xcrack.model.material import Material, isotropic_part
from xcrack.model.numerics import Numerics

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
        _, slope = space.tabulate(batch, row, points.bary[number], points.side[number])
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
    enriched: Enriched

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        n = (len(self.enriched.indptr) - 1) * self.enriched.data.shape[1]
        return n, n

    def __matmul__(self, x: Floats) -> Floats:
        """Forces `(n_dof,)` or `(n_dof, k)` of displacements of the same shape."""
        return _product((self.body, self.enriched), x)

    def joined(self, rows: Bools | None = None) -> sp.csr_matrix:
        """The sum, of all rows or of some functions `(n_functions,)`; others are empty."""
        from xcrack.fem.kernels.bulk import joined_blocks

        body, over = self.body, self.enriched
        chosen_rows = np.ones(len(over.indptr) - 1, dtype=bool) if rows is None else rows
        entries = body.data.size + over.data.size
        kind = np.int32 if entries < np.iinfo(np.int32).max else np.int64
        indptr, indices, data = joined_blocks(
            body.indptr.astype(kind, copy=False), body.indices, body.data, over.indptr,
            over.indices, over.data, chosen_rows,
        )  # fmt: skip
        return sp.csr_matrix((data, indices, indptr), shape=self.shape)


def body_forces(body: sp.bsr_matrix, x: Floats) -> Floats:
    """Forces `(n,)` or `(n, k)` of displacements of the uncracked body of the same shape."""
    return _product((body,), x)


def _product(parts: tuple[sp.bsr_matrix | Enriched, ...], x: Floats) -> Floats:
    from xcrack.fem.kernels.bulk import add_block_product

    columns = np.ascontiguousarray(x).reshape(len(x), -1)
    result = np.zeros_like(columns)
    for part in parts:
        add_block_product(part.indptr, part.indices, part.data, columns, result)
    return result.reshape(x.shape)


def next_to_enriched(space: FunctionSpace) -> Bools:
    """Functions that couple with those around a node with enriched functions `(n_functions,)`.

    The enriched columns of a solver's basis hold standard functions of such nodes too.
    """
    carries = np.zeros(space.n_nodes, dtype=bool)
    for number in space.heaviside:
        carries |= number >= 0
    for tip in space.tips:
        carries[: space.mesh.n_points] |= tip.point_to_function >= 0
    is_enriched = np.zeros(space.n_functions, dtype=bool)
    is_enriched[space.cell_nodes[carries[space.cell_nodes].any(axis=1)]] = True
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
    one = (mask & (mask - 1) == 0) & (mask < 1 << len(space.cuts))
    for joint in space.joints:
        one &= ~joint.near[cells]
    return np.asarray(one)


def reused_cells(
    space: FunctionSpace, cells: Ints, earlier: ReusedCells | None
) -> tuple[ReusedCells, int]:
    """Integrate cells with one jump, but those that are known already.

    Parameters
    ----------
    space : FunctionSpace
    cells : (m,) array of int
        Growing.
    earlier : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    ReusedCells
    n_points : int
        Integration points used.
    """
    from xcrack.fem.kernels.enriched import gradient_products

    n, key = space.cell_nodes.shape[1], _keys(space, cells)
    products = np.empty((len(cells), 2 * n * space.dim, 2 * n * space.dim))
    old = np.zeros(len(cells), dtype=bool)
    if earlier is not None and len(earlier.cells):
        row = np.minimum(np.searchsorted(earlier.cells, cells), len(earlier.cells) - 1)
        old = (earlier.cells[row] == cells) & (earlier.key[row] == key).all(axis=1)
        products[old] = earlier.products[row[old]]
    new = np.nonzero(~old)[0]
    points = cell_points(space, cells[new], 0, 2 * (space.order - 1))
    for batch, rows in space.batches(cells[new]):
        number, place, first = points.of_cells(batch.cells)
        _, G = space.tabulate(batch, place, points.bary[number], points.side[number])
        products[new[rows]] = gradient_products(first, points.weight[number], G, n)
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
        _, bent, row = np.intersect1d(cells_of_rows, kinks.cells, return_indices=True)
        if len(bent):
            key[rows[bent], 1:end] = kinks.values[row]
            key[rows[bent], end + nodes :] = np.nan_to_num(kinks.vertex[row])
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
    material : Material
    order : int
    matrix : sparse matrix (n, n), stress · length^(d - 2)
        Node blocks, BSR; in 3D each is stored column by column, as products of the solvers read it.
    cells : ReusedCells, optional
        Cut cells of the last crack that may serve the next.
    loads : tuple of MeshLoad
        Of the last solve, that do not act beside a crack.
    free : (fixed, modes), optional
        Standard unknowns that supports decide, and the rigid motions that they leave free.
    """

    mesh: Mesh
    material: Material
    order: int
    matrix: sp.bsr_matrix
    cells: ReusedCells | None = None
    loads: tuple[MeshLoad, ...] = ()
    free: tuple[Bools, Floats] | None = None


def bulk(mesh: Mesh, material: Material, order: int) -> Bulk:
    """Stiffness of the uncracked body."""
    from xcrack.fem.kernels.bulk import block_pattern, block_stiffness

    nodes = np.ascontiguousarray(cell_nodes(mesh, order))
    n_nodes = mesh.n_points + (len(mesh.edges) if order == 2 else 0)
    indptr, indices, slot = block_pattern(nodes, n_nodes)
    bary, weight = simplex_rule(mesh.dim, 2 * (order - 1))
    data = block_stiffness(
        slot,
        len(indices),
        mesh.gradient,
        mesh.volume,
        shape_derivatives(order, bary),
        weight,
        *isotropic_part(material.tensor(mesh.dim)),
    )
    if mesh.dim == 3:
        for part in row_stretches(len(data)):
            data[part] = data[part].transpose(0, 2, 1).copy()
        data = data.transpose(0, 2, 1)
    size = n_nodes * mesh.dim
    return Bulk(mesh, material, order, sp.bsr_matrix((data, indices, indptr), shape=(size, size)))


def enriched_stiffness(
    space: FunctionSpace,
    material: Material,
    numerics: Numerics,
    lips: tuple[LipPoints, ...],
    earlier: ReusedCells | None = None,
) -> tuple[Enriched, int, ReusedCells | None]:
    """Entries with an enriched function.

    Entries of two standard functions are left out: they are those of the uncracked body.

    Parameters
    ----------
    earlier : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    enriched : Enriched
    n_points : int
        Integration points used.
    reusable : ReusedCells or None
        For the next crack.
    """
    from xcrack.fem.kernels.enriched import add_products, add_stiffness, enriched_pattern

    cells, d = space.enriched, space.dim
    if not len(cells):
        indptr, indices = np.zeros(space.n_functions + 1, np.int64), np.zeros(0, np.int32)
        return Enriched(indptr, indices, np.zeros((0, d, d))), 0, None
    simple = with_one_jump(space, cells)
    reusable, n_points = reused_cells(space, cells[simple], earlier)
    others = cells[~simple]
    points = cell_points(space, others, numerics.points, 2 * (space.order - 1))
    with_tip = cells[space.has_tip[cells]]
    boundary = None
    if numerics.consistent and len(with_tip):
        boundary = boundary_points(space, with_tip, lips)
    indptr, indices = enriched_pattern(_functions(space, cells), space.n_functions, space.n_nodes)
    data = np.zeros((len(indices), d, d))
    stiffness = isotropic_part(material.tensor(d))
    for batch, rows in space.batches(reusable.cells):
        products = reusable.products[rows]
        add_products(data, indptr, indices, batch.functions, products, space.n_nodes, *stiffness)

    def tabulated(batch: Batch) -> tuple[Ints, Ints, Floats, Floats]:
        number, row, first = points.of_cells(batch.cells)
        bary, weight, side = points.bary[number], points.weight[number], points.side[number]
        N, G = space.tabulate(batch, row, bary, side)
        if batch.tips and boundary is not None:
            G = corrected(space, batch, (row, bary, weight, side), N, G, boundary)
        return batch.functions, first, weight, G

    chunks = _chunks(space, points, others)
    for part in stream_tasks(tabulated, (b for chunk in chunks for b, _ in space.batches(chunk))):
        with one_blas_thread():
            functions, first, weight, G = part
            add_stiffness(
                data, indptr, indices, functions, first, weight, G, space.n_nodes, *stiffness
            )  # fmt: skip
    return Enriched(indptr, indices, data), n_points + len(points.weight), reusable


def _functions(space: FunctionSpace, cells: Ints) -> Ints:
    """Functions that act on cells, in rows of one length."""
    parts = [batch.functions for batch, _ in space.batches(cells)]
    filled = np.full((len(cells), max(part.shape[1] for part in parts)), -1, dtype=np.int64)
    first = 0
    for part in parts:
        filled[first : first + len(part), : part.shape[1]] = part
        first += len(part)
    return filled


def _chunks(space: FunctionSpace, points: Points, cells: Ints) -> list[Ints]:
    counts = np.searchsorted(points.cell, cells, side="right") - np.searchsorted(points.cell, cells)
    group = np.cumsum(counts) // _CHUNK
    return [cells[group == g] for g in np.unique(group)]


def total_stiffness(bulk_: Bulk, enriched: Enriched) -> sp.csr_matrix:
    """Stiffness of all unknowns."""
    return Stiffness(bulk_.matrix, enriched).joined()


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


__all__ = []
