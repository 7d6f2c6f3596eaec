"""Multigrid for cracked bodies: the levels of the uncracked body, an enriched matrix on top.

Smoothed aggregation (Vanek, Mandel and Brezina, 1996) on the stiffness of the uncracked body is
made once a mesh. A crack only changes the finest level: its matrix is the enriched one, and the
prolongator gets a zero row for each enriched unknown. This works in the basis in which the
enriched unknowns of a node are orthonormal and orthogonal to its standard ones in energy.
Quadratic functions are one more level on top: they contain the linear ones (p-multigrid, Ronquist
and Patera, 1987).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, cast

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, lock, offsets
from xcrack.base.machine import stream_tasks
from xcrack.base.optional import require_package
from xcrack.fem.assembly import Bulk, bulk, rigid_modes
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.basis import stars
from xcrack.linalg.products import BorderedFactor, RowBlocks, in_fours, store_blocks
from xcrack.mesh.simplex import node_points

_COARSEST = 300  # unknowns below which a dense inverse ends the hierarchy
_OMEGA = 4 / 3  # damping of the step that smooths the prolongator
_ROWS = 10_000  # of blocks, taken at once where a coarse matrix is made
_NULL = 1e-11  # eigenvalues of the coarsest matrix below this share are rigid motions
_LANCZOS = 12  # steps for the largest eigenvalue
SAFETY = 1.1  # by which it is enlarged: Lanczos gives a lower bound
_SHARE = 0.1  # of the spectrum's upper end from which Chebyshev smooths
_START = 613_077  # seed of the vector that Lanczos starts from
_RESOLVED = 1e-6  # of a block's largest eigenvalue: single precision resolves no more


# Smoothing by small overlapping blocks where functions of neighbouring nodes nearly repeat.
#
# At order 2 the tip functions on linear hats nearly repeat the quadratic functions of the same
# star, and Heaviside functions of the midpoints those of the points. A block holds the unknowns of
# a point and of the midpoints of its edges: their functions all end inside the cells around the
# point, as its tip functions do. The sum of the solutions of all blocks takes the place of the
# inverse diagonal (additive Schwarz, on vertex stars after Schoeberl, Melenk, Pechstein and
# Zaglmayr, 2008).


@dataclass(frozen=True, eq=False)
class Patches:
    """Overlapping blocks of unknowns with their inverses, in single precision.

    Attributes
    ----------
    members : array of uint32
        Unknowns of the blocks, one block after the other.
    start : (b + 1,) array of uint32
        Where each block begins in `members`.
    offset : (b,) array of uint64
        Where its inverse begins.
    inverse : array
        Symmetric inverses, row by row.
    inverse_diagonal : (n,) array
        Inverse diagonal of unknowns outside all blocks, 0 for the others.
    """

    members: Any
    start: Any
    offset: Any
    inverse: Any
    inverse_diagonal: Any

    def times(self, r: Any) -> Any:
        """Sum of the solutions of all blocks, and of the unknowns outside, in single precision."""
        from xcrack.linalg.kernels.sparse import add_solved

        result = self.inverse_diagonal * r
        add_solved(self.members, self.start, self.offset, self.inverse, r, result)
        return result


def star_patches(
    space: FunctionSpace,
    home: Ints,
    n_standard: int,
    diagonal: Floats,
    matrix_entries: Callable[[Ints], sp.csr_matrix],
) -> Patches:
    """Blocks of the stars of all points at which an enriched function acts.

    Parameters
    ----------
    space : FunctionSpace
    home : (n,) array of int
        Node at which each unknown of the matrix is at home, -1 for decoupled ones.
    n_standard : int
        Leading unknowns that are not enriched.
    diagonal : (n,) array
        Of the matrix.
    matrix_entries : callable
        Sorted unknowns (m,) -> their entries of the matrix (m, m).
    """
    members, start = _members(space, home, n_standard)
    members_in_use, place = np.unique(members, return_inverse=True)
    inverse, offset = _inverses(matrix_entries(members_in_use), place, start)
    inverse_of_others = (1 / diagonal).astype(np.float32)
    inverse_of_others[members_in_use] = 0
    short_arrays = [array.astype(np.uint32) for array in (members, start)]
    return Patches(*map(lock, (*short_arrays, offset, inverse, inverse_of_others)))


def _members(space: FunctionSpace, home: Ints, n_standard: int) -> tuple[Ints, Ints]:
    """Unknowns of each star, one star after the other, and where each begins."""
    n = space.mesh.n_points
    nodes = np.unique(home[n_standard:])
    ends = space.mesh.edges[nodes[nodes >= n] - n].ravel()
    points = np.unique(np.concatenate([nodes[nodes < n], ends]))
    nodes_with_home = np.nonzero(home >= 0)[0]
    at = sp.csr_matrix(
        (np.ones(len(nodes_with_home), np.int8), (home[nodes_with_home], nodes_with_home)),
        shape=(space.n_nodes, len(home)),
    )
    patches = sp.csr_matrix(stars(space.mesh, space.order)[points] @ at)
    patches.sort_indices()
    return patches.indices.astype(np.int64), patches.indptr.astype(np.int64)


def _inverses(A: sp.csr_matrix, members: Ints, start: Ints) -> tuple[Any, Any]:
    """Inverses of diagonal blocks, row by row, and where each begins."""
    from xcrack.linalg.kernels.sparse import dense_blocks

    size = np.diff(start)
    offset = offsets(size**2)
    result = np.empty(offset[-1], np.float32)
    blocks_in_row = dense_blocks(A.indptr, A.indices, A.data, members, start)
    for s in np.unique(size):
        entries = offset[:-1][size == s][:, None] + np.arange(s * s)
        inverse = _stable_inverses(blocks_in_row[entries].reshape(-1, s, s))
        result[entries] = inverse.reshape(-1, s * s)
    return result, offset[:-1].astype(np.uint64)


def _stable_inverses(A: Floats) -> Floats:
    """Inverses of positive matrices (b, s, s); eigenvalues that hardly count are lifted."""
    root = 1 / np.sqrt(np.einsum("bii->bi", A))
    scaled_blocks = root[:, :, None] * A * root[:, None, :]
    try:
        L = np.linalg.cholesky(scaled_blocks)
        if np.einsum("bii->bi", L).min() ** 2 > _RESOLVED:
            inverse = np.linalg.inv(L)
            return np.asarray(
                root[:, :, None] * (inverse.transpose(0, 2, 1) @ inverse) * root[:, None, :]
            )
    except np.linalg.LinAlgError:
        pass
    w, V = np.linalg.eigh(scaled_blocks)
    V = root[:, :, None] * V
    w = np.maximum(w, _RESOLVED * w[:, -1:])
    return np.asarray((V / w[:, None, :]) @ V.transpose(0, 2, 1))


# A V-cycle on given levels: an approximate inverse in single precision.


@dataclass(frozen=True, eq=False)
class GridLevel:
    """One level of a cycle, in single precision.

    Attributes
    ----------
    matrix : RowBlocks or BorderedFactor
    inverse_diagonal : (n,) array
        Inverse diagonal, 0 where the diagonal is.
    spectrum_bound : float
        Upper bound of the spectrum of D^-1 A.
    prolong, restrict : RowBlocks
        From and to the next level; their rows and columns are the leading unknowns of this one.
    patches : Patches, optional
        Smooth in the place of the inverse diagonal, which is then one.
    """

    matrix: RowBlocks | BorderedFactor
    inverse_diagonal: Any
    spectrum_bound: float
    prolong: RowBlocks
    restrict: RowBlocks
    patches: Patches | None = None

    def solve_blocks(self, r: Any) -> Any:
        """What the smoother multiplies by the inverse diagonal."""
        return r if self.patches is None else _by_column(self.patches.times, r)

    @cached_property
    def inverse_of_four(self) -> Any:
        """The inverse diagonal for four vectors that stand side by side."""
        return lock(np.repeat(self.inverse_diagonal, 4))


@dataclass(frozen=True, eq=False)
class VCycle:
    """A V-cycle with Chebyshev smoothing of degree 2: an approximate inverse, symmetric.

    Attributes
    ----------
    levels : tuple of GridLevel
        The finest first.
    coarse_inverse : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    levels: tuple[GridLevel, ...]
    coarse_inverse: Any

    def __call__(self, r: Floats) -> Floats:
        """Approximate A^-1 r."""
        return self.of_all([r])[0]

    def of_all(self, residuals: Sequence[Floats]) -> list[Floats]:
        """Approximate A^-1 r of several vectors, four at a time."""
        sizes = [float(np.abs(r).max(initial=0.0)) for r in residuals]
        sizes = [size if np.isfinite(size) else 0.0 for size in sizes]
        scaled_residuals = [
            (r / size if size > 0 else np.zeros_like(r)).astype(np.float32)
            for r, size in zip(residuals, sizes, strict=True)
        ]
        results = in_fours(partial(self._solve_below, 0), scaled_residuals)
        return [z.astype(np.float64) * size for z, size in zip(results, sizes, strict=True)]

    def _solve_below(self, number: int, b: Any) -> Any:
        if number == len(self.levels):
            return _by_column(self.coarse_inverse.__matmul__, b)
        level = self.levels[number]
        x, r = np.zeros_like(b), b  # nobody needs b any more
        d = _smooth(level, r, x)
        level.matrix.add_product(r, -1, d)
        n = level.prolong.shape[0]
        coarse_correction = self._solve_below(number + 1, level.restrict.times(r[:n]))
        correction = np.zeros_like(x)
        level.prolong.add_product(correction[:n], 1, coarse_correction)
        x += correction
        level.matrix.add_product(r, -1, correction)
        _smooth(level, r, x)
        return x


def _by_column(function: Callable[[Any], Any], b: Any) -> Any:
    """A function of a vector, or of each column alone: the same bits."""
    if b.ndim == 1:
        return function(b)
    return np.stack([function(np.ascontiguousarray(column)) for column in b.T], axis=1)


def _smooth(level: GridLevel, r: Any, x: Any) -> Any:
    """Two Chebyshev steps; r is left one step behind x, by A times the result."""
    from xcrack.linalg.kernels.cycle import first_step, next_step

    lambda_max, lambda_min = level.spectrum_bound, _SHARE * level.spectrum_bound
    middle, half = (lambda_max + lambda_min) / 2, (lambda_max - lambda_min) / 2
    sigma = middle / half
    rho = 1 / (2 * sigma - 1 / sigma)
    dtype = np.float32
    d = np.empty_like(x)
    inverse = level.inverse_diagonal if r.ndim == 1 else level.inverse_of_four
    first_step(inverse, level.solve_blocks(r).ravel(), dtype(1 / middle), d.ravel(), x.ravel())
    level.matrix.add_product(r, -1, d)
    scale = dtype(2 * rho / half)
    smoothed_residual = level.solve_blocks(r).ravel()
    next_step(inverse, smoothed_residual, dtype(rho / sigma), scale, d.ravel(), x.ravel())
    return d


def largest_eigenvalue(
    A: RowBlocks | BorderedFactor, diagonal: Floats, smoother: Callable[[Any], Any] | None = None
) -> float:
    """Upper bound of the spectrum of B A, from a few steps of Lanczos.

    They run in the inner product of the inverse of B, in which B A is symmetric.

    Parameters
    ----------
    A : RowBlocks or BorderedFactor
    diagonal : (n,) array
    smoother : callable, optional
        B r of a residual r in single precision; without it B is the inverse diagonal.
    """
    inverse = reciprocal(diagonal)

    def image(w: Floats) -> Floats:
        z = inverse * w if smoother is None else smoother(w.astype(np.float32))
        return np.asarray(z, dtype=float)

    w = np.sqrt(np.maximum(diagonal, 0.0)) * np.random.default_rng(_START).standard_normal(
        len(diagonal)
    )
    if A.idle_rows is not None:
        w[A.idle_rows] = 0.0
    z, previous_vector = image(w), np.zeros_like(w)
    beta = float(np.sqrt(np.einsum("i,i", w, z)))
    alphas: list[float] = []
    betas: list[float] = []
    for _ in range(_LANCZOS):
        q, p = w / beta, z / beta
        w = A.times(p.astype(A.dtype)) - beta * previous_vector
        alphas.append(float(np.einsum("i,i", w, p)))
        w -= alphas[-1] * q
        z, previous_vector = image(w), q
        beta = float(np.sqrt(max(np.einsum("i,i", w, z), 0.0)))
        if beta <= 1e-6 * abs(alphas[-1]):
            break
        betas.append(beta)
    n = len(alphas)
    T = np.diag(alphas) + np.diag(betas[: n - 1], 1) + np.diag(betas[: n - 1], -1)
    return SAFETY * float(np.linalg.eigvalsh(T)[-1])


def reciprocal(diagonal: Floats) -> Floats:
    """1 / diagonal, 0 where an aggregate was too small for all motions."""
    has_stiffness = diagonal > 1e-12 * diagonal.max(initial=0.0)
    return np.where(has_stiffness, 1 / np.where(has_stiffness, diagonal, 1.0), 0.0)


# The levels.


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels of the uncracked body, kept from crack to crack.

    Attributes
    ----------
    bulk : Bulk
    is_fixed : (n,) array of bool
        Standard unknowns that supports decide.
    is_free : (n,) array of bool
        The others are zero: the rows of these are left out, and nobody moves them.
    matrix : RowBlocks (n, n)
        In double precision; in 3D it shares the memory of the body's stiffness.
    diagonal : (n,) array
    levels : tuple of GridLevel
        The uncracked body first.
    coarse_inverse : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    bulk: Bulk
    is_fixed: Bools
    is_free: Bools
    matrix: RowBlocks
    diagonal: Floats
    levels: tuple[GridLevel, ...]
    coarse_inverse: Any

    def fits(self, bulk: Bulk, is_fixed: Bools) -> bool:
        """Whether the hierarchy is that of a stiffness and its supports."""
        n = len(self.is_fixed)
        return self.bulk.matrix is bulk.matrix and np.array_equal(self.is_fixed, is_fixed[:n])


def hierarchy(bulk: Bulk, is_fixed: Bools) -> Hierarchy:
    """Make the levels of the uncracked body by smoothed aggregation with its rigid motions.

    Parameters
    ----------
    bulk : Bulk
    is_fixed : (n,) array of bool
        Unknowns that supports decide; entries behind the standard unknowns are not looked at.
        An unsupported body is allowed: its motions are left out on the coarsest level.
    """
    A, d = bulk.matrix, bulk.mesh.dim
    is_fixed = np.array(is_fixed[: A.shape[0]], dtype=bool)
    is_free, diagonal = ~is_fixed, _diagonal(A)
    finest_blocks = store_blocks(A, np.float64)
    if is_fixed.any():
        finest_blocks = replace(finest_blocks, idle_rows=lock(np.nonzero(is_fixed)[0]))
    if bulk.order == 2:
        levels, coarsest_inverse = _over_linear(bulk, is_fixed, finest_blocks, diagonal)
    else:
        motions = rigid_modes(node_points(bulk.mesh, bulk.order)) * is_free[:, None]
        is_fixed_node = np.asarray(is_fixed.reshape(-1, d).all(axis=1))
        levels, coarsest_inverse = _aggregation_levels(A, finest_blocks, motions, is_fixed_node)
    return Hierarchy(
        bulk=bulk,
        is_fixed=lock(is_fixed),
        is_free=lock(is_free),
        matrix=finest_blocks,
        diagonal=lock(diagonal),
        levels=levels,
        coarse_inverse=coarsest_inverse,
    )


def _aggregation_levels(
    A: sp.bsr_matrix, finest_blocks: RowBlocks, candidates: Floats, is_fixed_node: Bools
) -> tuple[tuple[GridLevel, ...], Floats]:
    """Levels of smoothed aggregation, and the inverse on the coarsest.

    Nodes that are alone belong to no aggregate.
    """
    levels: list[GridLevel] = []
    while A.shape[0] > _COARSEST or not levels:
        blocks = store_blocks(A) if levels else finest_blocks.in_single_precision()
        diagonal = _diagonal(A)
        lambda_max = largest_eigenvalue(blocks, diagonal)
        P, candidates = _prolongator(
            A, diagonal, lambda_max, candidates, is_fixed_node, blocks.idle_rows
        )
        scale = float(diagonal.max())
        A, prolongation = _coarse_matrix(A, P), sp.bsr_matrix(P, dtype=np.float32)
        is_fixed_node = np.zeros(len(A.indptr) - 1, dtype=bool)
        del P
        levels.append(_level(blocks, diagonal, lambda_max, prolongation))
        if A.shape[0] > 0.7 * prolongation.shape[0]:
            break
    return tuple(levels), _pseudo_inverse(A.toarray(), scale)


def _coarse_matrix(A: sp.bsr_matrix, P: sp.bsr_matrix) -> sp.bsr_matrix:
    """P^T A P, summed over stretches of rows: A P takes more memory than A."""
    size = P.blocksize[1]
    total = sp.bsr_matrix((P.shape[1],) * 2, blocksize=(size, size))

    def part(first: int) -> sp.bsr_matrix:
        partial_sum = _rows(P, first).T @ (_rows(A, first) @ P)
        return sp.bsr_matrix(partial_sum, blocksize=(size, size))

    for partial_sum in stream_tasks(part, range(0, len(P.indptr) - 1, _ROWS)):
        total = total + partial_sum
    return total


def _rows(A: sp.bsr_matrix, first: int) -> sp.bsr_matrix:
    """Some rows of blocks, which share the memory of the matrix."""
    indptr = A.indptr[first : first + _ROWS + 1]
    part = slice(indptr[0], indptr[-1])
    shape = (len(indptr) - 1) * A.blocksize[0], A.shape[1]
    return sp.bsr_matrix((A.data[part], A.indices[part], indptr - indptr[0]), shape=shape)


def _over_linear(
    bulk_: Bulk, is_fixed: Bools, finest_blocks: RowBlocks, diagonal: Floats
) -> tuple[tuple[GridLevel, ...], Floats]:
    """Quadratic functions over the levels of the linear ones, which they contain."""
    mesh, d = bulk_.mesh, bulk_.mesh.dim
    linear_levels = hierarchy(bulk(bulk_.elasticity, 1), is_fixed)
    half = 0.5 * stars(mesh, 2)
    half.setdiag(1.0)
    P = sp.kron(half.T.tocsr(), sp.identity(d))
    P = sp.bsr_matrix(
        sp.diags(~is_fixed * 1.0) @ P @ sp.diags(linear_levels.is_free * 1.0), blocksize=(d, d)
    )
    single_blocks = finest_blocks.in_single_precision()
    top = _level(single_blocks, diagonal, largest_eigenvalue(single_blocks, diagonal), P)
    return (top, *linear_levels.levels), linear_levels.coarse_inverse


def extended_cycle(
    levels: Hierarchy, A: BorderedFactor, diagonal: Floats, patches: Patches | None = None
) -> VCycle:
    """Cycle for an enriched matrix whose standard block is that of a hierarchy.

    Parameters
    ----------
    levels : Hierarchy
    A : BorderedFactor
        In the basis in which the enriched unknowns of a node are orthogonal to its standard ones.
    diagonal : (n,) array
    patches : Patches, optional
        Blocks that smooth in the place of the diagonal.
    """
    finest_level = levels.levels[0]
    standard = cast(RowBlocks, finest_level.matrix)
    single_factor = BorderedFactor(
        standard, A.coupling.in_single_precision(), A.border_rows.in_single_precision()
    )
    if patches is None:
        inverse = reciprocal(diagonal).astype(np.float32)
        bound = largest_eigenvalue(single_factor, diagonal)
    else:
        inverse = np.ones(len(diagonal), np.float32)
        bound = largest_eigenvalue(single_factor, diagonal, patches.times)
    top = GridLevel(
        single_factor, lock(inverse), bound, finest_level.prolong, finest_level.restrict, patches
    )
    return VCycle((top, *levels.levels[1:]), levels.coarse_inverse)


def _diagonal(A: sp.bsr_matrix) -> Floats:
    """The diagonal; scipy copies blocks that are stored column by column."""
    row = np.repeat(np.arange(len(A.indptr) - 1), np.diff(A.indptr))
    diagonal_entries = np.nonzero(row == A.indices)[0]
    result = np.zeros((len(A.indptr) - 1, A.blocksize[0]))
    result[row[diagonal_entries]] = np.einsum("kii->ki", A.data[diagonal_entries])
    return result.ravel()


def _level(blocks: RowBlocks, diagonal: Floats, lambda_max: float, P: sp.bsr_matrix) -> GridLevel:
    R = sp.bsr_matrix(P.T, blocksize=P.blocksize[::-1])
    inverse = lock(reciprocal(diagonal).astype(np.float32))
    return GridLevel(blocks, inverse, lambda_max, store_blocks(P), store_blocks(R))


def _prolongator(
    A: sp.bsr_matrix,
    diagonal: Floats,
    lambda_max: float,
    candidates: Floats,
    is_fixed_node: Bools,
    idle_rows: Ints | None,
) -> tuple[sp.bsr_matrix, Floats]:
    """Aggregates whose motions are smoothed once, and the motions of the next level."""
    remedy = 'Numerics(linear="direct") does without it.'
    aggregation = require_package("pyamg.aggregation", "a large 3D body", remedy)
    n, size = len(is_fixed_node), A.blocksize[0]
    unit_entries = np.ones(len(A.indices), np.int8)
    graph = sp.csr_matrix((unit_entries, A.indices, A.indptr), shape=(n, n))
    nodes = np.nonzero(~is_fixed_node)[0]
    if len(nodes) < n:
        graph = graph[nodes][:, nodes]
    motions = candidates.reshape(n, size, -1)[nodes].reshape(-1, candidates.shape[1])
    T, coarse_motions = aggregation.fit_candidates(
        aggregation.standard_aggregation(graph)[0], motions
    )
    count = np.zeros(n, dtype=np.int64)
    count[nodes] = np.diff(sp.bsr_matrix(T).indptr)
    T = sp.bsr_matrix((T.data, T.indices, offsets(count)), shape=(len(diagonal), T.shape[1]))
    factor = _OMEGA * SAFETY / lambda_max * reciprocal(diagonal)
    if idle_rows is not None:
        factor[idle_rows] = 0.0
    damped_factor = factor.reshape(n, -1)

    def smooth_rows(first: int) -> sp.bsr_matrix:
        image = _rows(A, first) @ T
        damped_rows = damped_factor[first : first + _ROWS]
        image.data *= np.repeat(damped_rows, np.diff(image.indptr), axis=0)[:, :, None]
        return _rows(T, first) - image

    # Of all rows at once the image takes more memory than the result.
    return _stacked_rows(list(stream_tasks(smooth_rows, range(0, n, _ROWS)))), coarse_motions


def _stacked_rows(parts: list[sp.bsr_matrix]) -> sp.bsr_matrix:
    """Rows of blocks under each other; scipy would take them apart."""
    data = np.concatenate([part.data for part in parts])
    indices = np.concatenate([part.indices for part in parts])
    counts = np.concatenate([np.diff(part.indptr) for part in parts])
    rows = sum(part.shape[0] for part in parts)
    return sp.bsr_matrix((data, indices, offsets(counts)), shape=(rows, parts[0].shape[1]))


def _pseudo_inverse(A: Floats, scale: float) -> Any:
    """Pseudo-inverse of a symmetric matrix, in single precision.

    A body that nothing holds may end in one aggregate, whose matrix is round-off of entries of
    size `scale`: nothing of it is inverted.
    """
    diagonal = np.diag(A)
    root = np.sqrt(np.where(diagonal > _NULL * scale, reciprocal(diagonal), 0.0))
    w, V = np.linalg.eigh(root[:, None] * A * root)
    is_significant = w > _NULL * max(w[-1], _NULL)
    V = root[:, None] * V[:, is_significant]
    return lock(((V / w[is_significant]) @ V.T).astype(np.float32))
