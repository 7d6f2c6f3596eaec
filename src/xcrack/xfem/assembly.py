"""Stiffness: the uncracked body once a mesh, enriched cells once a crack."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, Ints, stretches
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, shape_derivatives, simplex_rule
from xcrack.scene.conditions import Load
from xcrack.scene.material import Isotropic
from xcrack.scene.numerics import Numerics
from xcrack.threads import one_blas_thread, streamed
from xcrack.xfem.consistent import boundary_points, corrected
from xcrack.xfem.function_space import Batch, FunctionSpace
from xcrack.xfem.lips import LipPoints
from xcrack.xfem.quadrature import Points, cell_points
from xcrack.xfem.reused_cells import ReusedCells, reused_cells, with_one_jump
from xcrack.xfem.stiffness import Enriched, Stiffness

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
    material : Isotropic
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
    material: Isotropic
    order: int
    matrix: sp.bsr_matrix
    cells: ReusedCells | None = None
    loads: tuple[MeshLoad, ...] = ()
    free: tuple[Bools, Floats] | None = None


def bulk(mesh: Mesh, material: Isotropic, order: int) -> Bulk:
    """Stiffness of the uncracked body."""
    from xcrack.kernels.bulk import block_pattern, block_stiffness

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
        material.lam,
        material.mu,
    )
    if mesh.dim == 3:
        for part in stretches(len(data)):
            data[part] = data[part].transpose(0, 2, 1).copy()
        data = data.transpose(0, 2, 1)
    size = n_nodes * mesh.dim
    return Bulk(mesh, material, order, sp.bsr_matrix((data, indices, indptr), shape=(size, size)))


def enriched_stiffness(
    space: FunctionSpace,
    material: Isotropic,
    numerics: Numerics,
    lips: tuple[LipPoints, ...],
    known: ReusedCells | None = None,
) -> tuple[Enriched, int, ReusedCells | None]:
    """Entries with an enriched function.

    Entries of two standard functions are left out: they are those of the uncracked body.

    Parameters
    ----------
    known : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    enriched : Enriched
    n_points : int
        Integration points used.
    reusable : ReusedCells or None
        For the next crack.
    """
    from xcrack.kernels.enriched import add_products, add_stiffness, enriched_pattern

    cells, d = space.enriched, space.dim
    if not len(cells):
        indptr, indices = np.zeros(space.n_functions + 1, np.int64), np.zeros(0, np.int32)
        return Enriched(indptr, indices, np.zeros((0, d, d))), 0, None
    simple = with_one_jump(space, cells)
    reusable, n_points = reused_cells(space, cells[simple], known)
    others = cells[~simple]
    points = cell_points(space, others, numerics.points, 2 * (space.order - 1))
    with_tip = cells[space.has_tip[cells]]
    boundary = None
    if numerics.consistent and len(with_tip):
        boundary = boundary_points(space, with_tip, lips)
    indptr, indices = enriched_pattern(_functions(space, cells), space.n_functions, space.n_nodes)
    data = np.zeros((len(indices), d, d))
    lame = material.lam, material.mu
    for batch, rows in space.batches(reusable.cells):
        products = reusable.products[rows]
        add_products(data, indptr, indices, batch.functions, products, space.n_nodes, *lame)

    def tabulated(batch: Batch) -> tuple[Ints, Ints, Floats, Floats]:
        number, row, first = points.of_cells(batch.cells)
        bary, weight, side = points.bary[number], points.weight[number], points.side[number]
        N, G = space.tabulate(batch, row, bary, side)
        if batch.tips and boundary is not None:
            G = corrected(space, batch, (row, bary, weight, side), N, G, boundary)
        return batch.functions, first, weight, G

    chunks = _chunks(space, points, others)
    for part in streamed(tabulated, (b for chunk in chunks for b, _ in space.batches(chunk))):
        with one_blas_thread():
            functions, first, weight, G = part
            add_stiffness(
                data, indptr, indices, functions, first, weight, G, space.n_nodes, *lame
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
