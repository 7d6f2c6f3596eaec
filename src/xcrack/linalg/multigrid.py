"""Multigrid for cracked bodies: the levels of the uncracked body, an enriched matrix on top.

Smoothed aggregation (Vanek, Mandel and Brezina, 1996) on the stiffness of the uncracked body is
made once a mesh. A crack only changes the finest level: its matrix is the enriched one, and the
prolongator gets a zero row for each enriched unknown. This works in the basis in which the
enriched unknowns of a node are orthonormal and orthogonal to its standard ones in energy.
Quadratic functions are one more level on top: they contain the linear ones (p-multigrid, Ronquist
and Patera, 1987).
"""

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, lock, offsets
from xcrack.base.optional import require_package
from xcrack.base.threads import stream_tasks
from xcrack.fem.assembly import Bulk, bulk, rigid_modes
from xcrack.linalg.basis import stars
from xcrack.linalg.cycle import SAFETY, GridLevel, VCycle, largest_eigenvalue, reciprocal
from xcrack.linalg.row_blocks import BorderedFactor, RowBlocks, stored
from xcrack.linalg.schwarz import Patches
from xcrack.mesh.simplex import node_points

_COARSEST = 300  # unknowns below which a dense inverse ends the hierarchy
_OMEGA = 4 / 3  # damping of the step that smooths the prolongator
_ROWS = 10_000  # of blocks, taken at once where a coarse matrix is made
_NULL = 1e-11  # eigenvalues of the coarsest matrix below this share are rigid motions


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels of the uncracked body, kept from crack to crack.

    Attributes
    ----------
    bulk : Bulk
    fixed : (n,) array of bool
        Standard unknowns that supports decide.
    free : (n,) array of bool
        The others are zero: the rows of these are left out, and nobody moves them.
    matrix : RowBlocks (n, n)
        In double precision; in 3D it shares the memory of the body's stiffness.
    diagonal : (n,) array
    levels : tuple of GridLevel
        The uncracked body first.
    coarsest : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    bulk: Bulk
    fixed: Bools
    free: Bools
    matrix: RowBlocks
    diagonal: Floats
    levels: tuple[GridLevel, ...]
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
    A, d = bulk.matrix, bulk.mesh.dim
    fixed = np.array(fixed[: A.shape[0]], dtype=bool)
    free, diagonal = ~fixed, _diagonal(A)
    finest = stored(A, np.float64)
    if fixed.any():
        finest = replace(finest, idle=lock(np.nonzero(fixed)[0]))
    if bulk.order == 2:
        levels, coarsest = _over_linear(bulk, fixed, finest, diagonal)
    else:
        motions = rigid_modes(node_points(bulk.mesh, bulk.order)) * free[:, None]
        alone = np.asarray(fixed.reshape(-1, d).all(axis=1))
        levels, coarsest = _aggregation_levels(A, finest, motions, alone)
    return Hierarchy(
        bulk=bulk,
        fixed=lock(fixed),
        free=lock(free),
        matrix=finest,
        diagonal=lock(diagonal),
        levels=levels,
        coarsest=coarsest,
    )


def _aggregation_levels(
    A: sp.bsr_matrix, finest: RowBlocks, candidates: Floats, alone: Bools
) -> tuple[tuple[GridLevel, ...], Floats]:
    """Levels of smoothed aggregation, and the inverse on the coarsest.

    Nodes that are alone belong to no aggregate.
    """
    levels: list[GridLevel] = []
    while A.shape[0] > _COARSEST or not levels:
        blocks = stored(A) if levels else finest.single()
        diagonal = _diagonal(A)
        largest = largest_eigenvalue(blocks, diagonal)
        P, candidates = _prolongator(A, diagonal, largest, candidates, alone, blocks.idle)
        scale = float(diagonal.max())
        A, small = _coarse_matrix(A, P), sp.bsr_matrix(P, dtype=np.float32)
        alone = np.zeros(len(A.indptr) - 1, dtype=bool)
        del P
        levels.append(_level(blocks, diagonal, largest, small))
        if A.shape[0] > 0.7 * small.shape[0]:
            break
    return tuple(levels), _inverse(A.toarray(), scale)


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
    bulk_: Bulk, fixed: Bools, finest: RowBlocks, diagonal: Floats
) -> tuple[tuple[GridLevel, ...], Floats]:
    """Quadratic functions over the levels of the linear ones, which they contain."""
    mesh, d = bulk_.mesh, bulk_.mesh.dim
    lower = hierarchy(bulk(mesh, bulk_.material, 1), fixed)
    half = 0.5 * stars(mesh, 2)
    half.setdiag(1.0)
    P = sp.kron(half.T.tocsr(), sp.identity(d))
    P = sp.bsr_matrix(sp.diags(~fixed * 1.0) @ P @ sp.diags(lower.free * 1.0), blocksize=(d, d))
    single = finest.single()
    top = _level(single, diagonal, largest_eigenvalue(single, diagonal), P)
    return (top, *lower.levels), lower.coarsest


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
    finest = levels.levels[0]
    standard = cast(RowBlocks, finest.matrix)
    single = BorderedFactor(standard, A.across.single(), A.below.single())
    if patches is None:
        inverse = reciprocal(diagonal).astype(np.float32)
        largest = largest_eigenvalue(single, diagonal)
    else:
        inverse = np.ones(len(diagonal), np.float32)
        largest = largest_eigenvalue(single, diagonal, patches.times)
    top = GridLevel(single, lock(inverse), largest, finest.prolong, finest.restrict, patches)
    return VCycle((top, *levels.levels[1:]), levels.coarsest)


def _diagonal(A: sp.bsr_matrix) -> Floats:
    """The diagonal; scipy copies blocks that are stored column by column."""
    row = np.repeat(np.arange(len(A.indptr) - 1), np.diff(A.indptr))
    diagonal_entries = np.nonzero(row == A.indices)[0]
    result = np.zeros((len(A.indptr) - 1, A.blocksize[0]))
    result[row[diagonal_entries]] = np.einsum("kii->ki", A.data[diagonal_entries])
    return result.ravel()


def _level(blocks: RowBlocks, diagonal: Floats, largest: float, P: sp.bsr_matrix) -> GridLevel:
    R = sp.bsr_matrix(P.T, blocksize=P.blocksize[::-1])
    inverse = lock(reciprocal(diagonal).astype(np.float32))
    return GridLevel(blocks, inverse, largest, stored(P), stored(R))


def _prolongator(
    A: sp.bsr_matrix,
    diagonal: Floats,
    largest: float,
    candidates: Floats,
    alone: Bools,
    idle: Ints | None,
) -> tuple[sp.bsr_matrix, Floats]:
    """Aggregates whose motions are smoothed once, and the motions of the next level."""
    instead = 'Numerics(linear="direct") does without it.'
    aggregation = require_package("pyamg.aggregation", "a large 3D body", instead)
    n, size = len(alone), A.blocksize[0]
    ones = np.ones(len(A.indices), np.int8)
    graph = sp.csr_matrix((ones, A.indices, A.indptr), shape=(n, n))
    nodes = np.nonzero(~alone)[0]
    if len(nodes) < n:
        graph = graph[nodes][:, nodes]
    motions = candidates.reshape(n, size, -1)[nodes].reshape(-1, candidates.shape[1])
    T, coarse = aggregation.fit_candidates(aggregation.standard_aggregation(graph)[0], motions)
    count = np.zeros(n, dtype=np.int64)
    count[nodes] = np.diff(sp.bsr_matrix(T).indptr)
    T = sp.bsr_matrix((T.data, T.indices, offsets(count)), shape=(len(diagonal), T.shape[1]))
    factor = _OMEGA * SAFETY / largest * reciprocal(diagonal)
    if idle is not None:
        factor[idle] = 0.0
    damped = factor.reshape(n, -1)

    def smoothed(first: int) -> sp.bsr_matrix:
        image = _rows(A, first) @ T
        damped_rows = damped[first : first + _ROWS]
        image.data *= np.repeat(damped_rows, np.diff(image.indptr), axis=0)[:, :, None]
        return _rows(T, first) - image

    # Of all rows at once the image takes more memory than the result.
    return _stacked_rows(list(stream_tasks(smoothed, range(0, n, _ROWS)))), coarse


def _stacked_rows(parts: list[sp.bsr_matrix]) -> sp.bsr_matrix:
    """Rows of blocks under each other; scipy would take them apart."""
    data = np.concatenate([part.data for part in parts])
    indices = np.concatenate([part.indices for part in parts])
    counts = np.concatenate([np.diff(part.indptr) for part in parts])
    rows = sum(part.shape[0] for part in parts)
    return sp.bsr_matrix((data, indices, offsets(counts)), shape=(rows, parts[0].shape[1]))


def _inverse(A: Floats, scale: float) -> Any:
    """Pseudo-inverse of a symmetric matrix, in single precision.

    A body that nothing holds may end in one aggregate, whose matrix is round-off of entries of
    size `scale`: nothing of it is inverted.
    """
    diagonal = np.diag(A)
    root = np.sqrt(np.where(diagonal > _NULL * scale, reciprocal(diagonal), 0.0))
    w, V = np.linalg.eigh(root[:, None] * A * root)
    significant = w > _NULL * max(w[-1], _NULL)
    V = root[:, None] * V[:, significant]
    return lock(((V / w[significant]) @ V.T).astype(np.float32))
