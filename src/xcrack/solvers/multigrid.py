"""Multigrid for cracked bodies: the levels of the uncracked body, an enriched matrix on top.

Smoothed aggregation (Vanek, Mandel and Brezina, 1996) on the stiffness of the uncracked body is
made once a mesh. A crack only changes the finest level: its matrix is the enriched one, and the
prolongator gets a zero row for each enriched unknown. This works in the basis in which the
enriched unknowns of a node are orthonormal and orthogonal to its standard ones in energy.
Quadratic functions are one more level on top: they contain the linear ones (p-multigrid, Ronquist
and Patera, 1987).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, cast

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, Ints, lock
from xcrack.mesh.simplex import node_points
from xcrack.optional import required
from xcrack.solvers.basis import stars
from xcrack.solvers.row_blocks import Bordered, RowBlocks, in_fours, stored
from xcrack.solvers.schwarz import Patches
from xcrack.xfem.assembly import Bulk, bulk, rigid_modes

_COARSEST = 300  # unknowns below which a dense inverse ends the hierarchy
_LANCZOS = 12  # steps for the largest eigenvalue
_SAFETY = 1.1  # by which it is enlarged: Lanczos gives a lower bound
_SHARE = 0.1  # of the spectrum's upper end from which Chebyshev smooths
_OMEGA = 4 / 3  # damping of the step that smooths the prolongator
_START = 613_077  # seed of the vector that Lanczos starts from
_ROWS = 20_000  # of blocks, taken at once where a coarse matrix is made
_NULL = 1e-11  # eigenvalues of the coarsest matrix below this share are rigid motions


@dataclass(frozen=True, eq=False)
class Level:
    """One level of a cycle, in single precision.

    Attributes
    ----------
    matrix : RowBlocks or Bordered
    inverse : (n,) array
        Inverse diagonal, 0 where the diagonal is.
    largest : float
        Upper bound of the spectrum of D^-1 A.
    prolong, restrict : RowBlocks
        From and to the next level; their rows and columns are the leading unknowns of this one.
    patches : Patches, optional
        Smooth in the place of the inverse diagonal, which is then one.
    """

    matrix: RowBlocks | Bordered
    inverse: Any
    largest: float
    prolong: RowBlocks
    restrict: RowBlocks
    patches: Patches | None = None

    def solved(self, r: Any) -> Any:
        """What the smoother multiplies by the inverse diagonal."""
        return r if self.patches is None else _by_column(self.patches.times, r)

    @cached_property
    def inverse_of_four(self) -> Any:
        """The inverse diagonal for four vectors that stand side by side."""
        return lock(np.repeat(self.inverse, 4))


@dataclass(frozen=True, eq=False)
class Cycle:
    """A V-cycle with Chebyshev smoothing of degree 2: an approximate inverse, symmetric.

    Attributes
    ----------
    levels : tuple of Level
        The finest first.
    coarsest : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    levels: tuple[Level, ...]
    coarsest: Any

    def __call__(self, r: Floats) -> Floats:
        """Approximate A^-1 r."""
        return self.of_all([r])[0]

    def of_all(self, residuals: Sequence[Floats]) -> list[Floats]:
        """Approximate A^-1 r of several vectors, four at a time."""
        sizes = [float(np.abs(r).max(initial=0.0)) for r in residuals]
        sizes = [size if np.isfinite(size) else 0.0 for size in sizes]
        scaled = [
            (r / size if size > 0 else np.zeros_like(r)).astype(np.float32)
            for r, size in zip(residuals, sizes, strict=True)
        ]
        results = in_fours(partial(self._down, 0), scaled)
        return [z.astype(np.float64) * size for z, size in zip(results, sizes, strict=True)]

    def _down(self, number: int, b: Any) -> Any:
        if number == len(self.levels):
            return _by_column(self.coarsest.__matmul__, b)
        level = self.levels[number]
        x, r = np.zeros_like(b), b.copy()
        d = _smoothed(level, r, x)
        level.matrix.added(r, -1, d)
        n = level.prolong.shape[0]
        coarse = self._down(number + 1, level.restrict.times(r[:n]))
        correction = np.zeros_like(x)
        level.prolong.added(correction[:n], 1, coarse)
        x += correction
        level.matrix.added(r, -1, correction)
        _smoothed(level, r, x)
        return x


def _by_column(function: Callable[[Any], Any], b: Any) -> Any:
    """A function of a vector, or of each column alone: the same bits."""
    if b.ndim == 1:
        return function(b)
    return np.stack([function(np.ascontiguousarray(column)) for column in b.T], axis=1)


def _smoothed(level: Level, r: Any, x: Any) -> Any:
    """Two Chebyshev steps; r is left one step behind x, by A times the result."""
    from xcrack.kernels.cycle import first_step, next_step

    high, low = level.largest, _SHARE * level.largest
    middle, half = (high + low) / 2, (high - low) / 2
    sigma = middle / half
    rho = 1 / (2 * sigma - 1 / sigma)
    single = np.float32
    d = np.empty_like(x)
    inverse = level.inverse if r.ndim == 1 else level.inverse_of_four
    first_step(inverse, level.solved(r).ravel(), single(1 / middle), d.ravel(), x.ravel())
    level.matrix.added(r, -1, d)
    scale = single(2 * rho / half)
    after = level.solved(r).ravel()
    next_step(inverse, after, single(rho / sigma), scale, d.ravel(), x.ravel())
    return d


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels of the uncracked body, kept from crack to crack.

    Attributes
    ----------
    bulk : Bulk
    fixed : (n,) array of bool
        Standard unknowns that supports decide.
    nodes : (k,) array of int
        Nodes with a free unknown; theirs are the unknowns of the hierarchy.
    free : (k d,) array of bool
        Which of these unknowns are free; the others are decoupled.
    matrix : RowBlocks (k d, k d)
        In double precision.
    diagonal : (k d,) array
    levels : tuple of Level
        The uncracked body first.
    coarsest : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    bulk: Bulk
    fixed: Bools
    nodes: Ints
    free: Bools
    matrix: RowBlocks
    diagonal: Floats
    levels: tuple[Level, ...]
    coarsest: Any

    def fits(self, bulk: Bulk, fixed: Bools) -> bool:
        """Whether the hierarchy is that of a stiffness and its supports."""
        n = len(self.fixed)
        return self.bulk.matrix is bulk.matrix and np.array_equal(self.fixed, fixed[:n])


def hierarchy(bulk: Bulk, fixed: Bools) -> Hierarchy:
    """Make the levels of the uncracked body by smoothed aggregation with its rigid motions.

    Parameters
    ----------
    bulk : Bulk
    fixed : (n,) array of bool
        Unknowns that supports decide; entries behind the standard unknowns are not looked at.
        An unsupported body is allowed: its motions are left out on the coarsest level.
    """
    n, d = bulk.matrix.shape[0], bulk.mesh.dim
    fixed = np.array(fixed[:n], dtype=bool)
    nodes = np.nonzero(~fixed.reshape(-1, d).all(axis=1))[0]
    unknowns = (nodes[:, None] * d + np.arange(d)).ravel()
    free = ~fixed[unknowns]
    A = _decoupled(_of_nodes(bulk.matrix, nodes), free)
    diagonal = A.diagonal()
    finest = stored(A, np.float64)
    if bulk.order == 2:
        levels, coarsest = _over_linear(bulk, fixed, nodes, free, finest, diagonal)
    else:
        motions = rigid_modes(node_points(bulk.mesh, bulk.order)[nodes]) * free[:, None]
        levels, coarsest = _aggregated(A, finest, motions)
    return Hierarchy(
        bulk=bulk,
        fixed=lock(fixed),
        nodes=lock(nodes),
        free=lock(free),
        matrix=finest,
        diagonal=lock(diagonal),
        levels=levels,
        coarsest=coarsest,
    )


def _aggregated(
    A: sp.bsr_matrix, finest: RowBlocks, candidates: Floats
) -> tuple[tuple[Level, ...], Floats]:
    """Levels of smoothed aggregation, and the inverse on the coarsest."""
    levels: list[Level] = []
    while A.shape[0] > _COARSEST or not levels:
        blocks = stored(A) if levels else finest.single()
        diagonal = A.diagonal()
        largest = largest_eigenvalue(blocks, diagonal)
        P, candidates = _prolongator(A, diagonal, largest, candidates)
        scale = float(diagonal.max())
        A, small = _coarse(A, P), sp.bsr_matrix(P, dtype=np.float32)
        del P
        levels.append(_level(blocks, diagonal, largest, small))
        if A.shape[0] > 0.7 * small.shape[0]:
            break
    return tuple(levels), _inverse(A.toarray(), scale)


def _coarse(A: sp.bsr_matrix, P: sp.bsr_matrix) -> sp.bsr_matrix:
    """P^T A P, summed over stretches of rows: A P takes more memory than A."""
    size = P.blocksize[1]
    total = sp.bsr_matrix((P.shape[1],) * 2, blocksize=(size, size))
    for first in range(0, len(P.indptr) - 1, _ROWS):
        own = _rows(P, first)
        total = total + sp.bsr_matrix(own.T @ (_rows(A, first) @ P), blocksize=(size, size))
    return total


def _rows(A: sp.bsr_matrix, first: int) -> sp.bsr_matrix:
    """Some rows of blocks, which share the memory of the matrix."""
    indptr = A.indptr[first : first + _ROWS + 1]
    part = slice(indptr[0], indptr[-1])
    shape = (len(indptr) - 1) * A.blocksize[0], A.shape[1]
    return sp.bsr_matrix((A.data[part], A.indices[part], indptr - indptr[0]), shape=shape)


def _over_linear(
    bulk_: Bulk, fixed: Bools, nodes: Ints, free: Bools, finest: RowBlocks, diagonal: Floats
) -> tuple[tuple[Level, ...], Floats]:
    """Quadratic functions over the levels of the linear ones, which they contain."""
    mesh, d = bulk_.mesh, bulk_.mesh.dim
    lower = hierarchy(bulk(mesh, bulk_.material, 1), fixed)
    half = 0.5 * stars(mesh, 2)
    half.setdiag(1.0)
    P = sp.kron(half.T.tocsr()[nodes][:, lower.nodes], sp.identity(d))
    P = sp.bsr_matrix(sp.diags(free * 1.0) @ P @ sp.diags(lower.free * 1.0), blocksize=(d, d))
    single = finest.single()
    top = _level(single, diagonal, largest_eigenvalue(single, diagonal), P)
    return (top, *lower.levels), lower.coarsest


def extended(
    levels: Hierarchy, A: Bordered, diagonal: Floats, patches: Patches | None = None
) -> Cycle:
    """Cycle for an enriched matrix whose standard block is that of a hierarchy.

    Parameters
    ----------
    levels : Hierarchy
    A : Bordered
        In the basis in which the enriched unknowns of a node are orthogonal to its standard ones.
    diagonal : (n,) array
    patches : Patches, optional
        Blocks that smooth in the place of the diagonal.
    """
    finest = levels.levels[0]
    standard = cast(RowBlocks, finest.matrix)
    single = Bordered(standard, A.across.single(), A.below.single())
    if patches is None:
        inverse = _reciprocal(diagonal).astype(np.float32)
        largest = largest_eigenvalue(single, diagonal)
    else:
        inverse = np.ones(len(diagonal), np.float32)
        largest = largest_eigenvalue(single, diagonal, patches.times)
    top = Level(single, lock(inverse), largest, finest.prolong, finest.restrict, patches)
    return Cycle((top, *levels.levels[1:]), levels.coarsest)


def largest_eigenvalue(
    A: RowBlocks | Bordered, diagonal: Floats, solved: Callable[[Any], Any] | None = None
) -> float:
    """Upper bound of the spectrum of B A, from a few steps of Lanczos.

    They run in the inner product of the inverse of B, in which B A is symmetric.

    Parameters
    ----------
    A : RowBlocks or Bordered
    diagonal : (n,) array
    solved : callable, optional
        B r of a residual r in single precision; without it B is the inverse diagonal.
    """
    inverse = _reciprocal(diagonal)

    def image(w: Floats) -> Floats:
        z = inverse * w if solved is None else solved(w.astype(np.float32))
        return np.asarray(z, dtype=float)

    w = np.sqrt(np.maximum(diagonal, 0.0)) * np.random.default_rng(_START).standard_normal(
        len(diagonal)
    )
    z, before = image(w), np.zeros_like(w)
    beta = float(np.sqrt(np.einsum("i,i", w, z)))
    alphas: list[float] = []
    betas: list[float] = []
    for _ in range(_LANCZOS):
        q, p = w / beta, z / beta
        w = A.times(p.astype(A.dtype)) - beta * before
        alphas.append(float(np.einsum("i,i", w, p)))
        w -= alphas[-1] * q
        z, before = image(w), q
        beta = float(np.sqrt(max(np.einsum("i,i", w, z), 0.0)))
        if beta <= 1e-6 * abs(alphas[-1]):
            break
        betas.append(beta)
    n = len(alphas)
    T = np.diag(alphas) + np.diag(betas[: n - 1], 1) + np.diag(betas[: n - 1], -1)
    return _SAFETY * float(np.linalg.eigvalsh(T)[-1])


def _of_nodes(A: sp.bsr_matrix, nodes: Ints) -> sp.bsr_matrix:
    """Rows and columns of some nodes, given sorted; the matrix itself where they are all."""
    n = A.shape[0] // A.blocksize[0]
    if len(nodes) == n:
        return A
    number = np.arange(1, len(A.indices) + 1)
    chosen = sp.csr_matrix((number, A.indices, A.indptr), shape=(n, n))[nodes][:, nodes]
    shape = (len(nodes) * A.blocksize[0],) * 2
    return sp.bsr_matrix((A.data[chosen.data - 1], chosen.indices, chosen.indptr), shape=shape)


def _decoupled(A: sp.bsr_matrix, free: Bools) -> sp.bsr_matrix:
    """Matrix in which unknowns that are not free keep their diagonal entry alone."""
    if free.all():
        return A
    keep = free.reshape(-1, A.blocksize[0]).astype(float)
    row = np.repeat(np.arange(len(keep)), np.diff(A.indptr))
    data = A.data * keep[row][:, :, None] * keep[A.indices][:, None, :]
    own = np.nonzero(row == A.indices)[0]
    data[own] += (A.data[own] * np.eye(A.blocksize[0])) * (1 - keep[row[own]])[:, :, None]
    return sp.bsr_matrix((data, A.indices, A.indptr), shape=A.shape)


def _level(blocks: RowBlocks, diagonal: Floats, largest: float, P: sp.bsr_matrix) -> Level:
    R = sp.bsr_matrix(P.T, blocksize=P.blocksize[::-1])
    inverse = lock(_reciprocal(diagonal).astype(np.float32))
    return Level(blocks, inverse, largest, stored(P), stored(R))


def _prolongator(
    A: sp.bsr_matrix, diagonal: Floats, largest: float, candidates: Floats
) -> tuple[sp.bsr_matrix, Floats]:
    """Aggregates whose motions are smoothed once, and the motions of the next level."""
    instead = 'Numerics(linear="direct") does without it.'
    aggregation = required("pyamg.aggregation", "a large 3D body", instead)
    n = A.shape[0] // A.blocksize[0]
    ones = np.ones(len(A.indices))
    graph = sp.csr_matrix((ones, A.indices, A.indptr), shape=(n, n))
    T, coarse = aggregation.fit_candidates(aggregation.standard_aggregation(graph)[0], candidates)
    T = sp.bsr_matrix(T)
    image = A @ T
    damped = (_OMEGA * _SAFETY / largest * _reciprocal(diagonal)).reshape(n, -1)
    image.data *= np.repeat(damped, np.diff(image.indptr), axis=0)[:, :, None]
    return sp.bsr_matrix(T - image, blocksize=T.blocksize), coarse


def _reciprocal(diagonal: Floats) -> Floats:
    """1 / diagonal, 0 where an aggregate was too small for all motions."""
    alive = diagonal > 1e-12 * diagonal.max(initial=0.0)
    return np.where(alive, 1 / np.where(alive, diagonal, 1.0), 0.0)


def _inverse(A: Floats, scale: float) -> Any:
    """Pseudo-inverse of a symmetric matrix, in single precision.

    A body that nothing holds may end in one aggregate, whose matrix is round-off of entries of
    size `scale`: nothing of it is inverted.
    """
    diagonal = np.diag(A)
    root = np.sqrt(np.where(diagonal > _NULL * scale, _reciprocal(diagonal), 0.0))
    w, V = np.linalg.eigh(root[:, None] * A * root)
    significant = w > _NULL * max(w[-1], _NULL)
    V = root[:, None] * V[:, significant]
    return lock(((V / w[significant]) @ V.T).astype(np.float32))
