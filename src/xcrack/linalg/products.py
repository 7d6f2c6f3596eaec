"""Products of sparse matrices with vectors, those of scipy to the bit; proportional vectors."""

import itertools
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Floats, Ints
from xcrack.base.threads import map_tasks, number_of_threads
from xcrack.fem.assembly import Stiffness
from xcrack.linalg.kernels import sparse
from xcrack.linalg.projected_cg import Operator, Request

_LEAST = 100_000  # entries of a factor that a thread is worth
_SAME = 1e-15  # share of the largest entry up to which vectors are multiples of each other
_NEARLY = 1e-5  # share of a load beside the combinations of others, up to which those come first


def times(A: sp.csr_matrix | Stiffness, x: Floats) -> Floats:
    """A x for columns `(m,)` or `(m, k)`."""
    if isinstance(A, Stiffness):
        return A @ x
    x = np.ascontiguousarray(x)
    result = sparse.times(A.indptr, A.indices, A.data, x.reshape(len(x), -1))
    return np.asarray(result.reshape(len(result), *x.shape[1:]))


def times_transposed(A: sp.csr_matrix, x: Floats) -> Floats:
    """A^T x for columns `(n,)` or `(n, k)`."""
    x, n = np.ascontiguousarray(x), A.shape[1]
    result = sparse.times_transposed(A.indptr, A.indices, A.data, n, x.reshape(len(x), -1))
    return np.asarray(result.reshape(n, *x.shape[1:]))


def product(A: sp.csr_matrix, B: sp.csr_matrix) -> sp.csr_matrix:
    """A B of sparse matrices, stretches of rows by threads: the same bits for any number."""
    count = min(number_of_threads(), A.nnz // _LEAST)
    if count < 2:
        return sp.csr_matrix(A @ B)
    inner = np.searchsorted(A.indptr, np.linspace(0, A.nnz, count + 1)[1:-1])
    ends = [0, *inner.tolist(), A.shape[0]]

    def rows(span: tuple[int, int]) -> sp.csr_matrix:
        indptr = A.indptr[span[0] : span[1] + 1]
        entries_of_rows = slice(indptr[0], indptr[-1])
        shape = span[1] - span[0], A.shape[1]
        return (
            sp.csr_matrix(
                (A.data[entries_of_rows], A.indices[entries_of_rows], indptr - indptr[0]),
                shape=shape,
            )
            @ B
        )

    return sp.csr_matrix(sp.vstack(map_tasks(rows, list(itertools.pairwise(ends))), format="csr"))


def proportional_columns(b: Floats, tolerance: float = _SAME) -> tuple[Ints, Floats]:
    """First column that each of `(n, k)` is a multiple of, to round-off, and the factor `(k,)`.

    Load states are often one load, scaled. `tolerance` is the share of the largest entry by which
    they may differ.
    """
    first, scale = np.arange(b.shape[1]), np.ones(b.shape[1])
    for k in range(1, len(first)):
        for i in range(k):
            at = int(np.abs(b[:, i]).argmax())
            if first[i] != i or b[at, i] == 0:
                continue
            factor = b[at, k] / b[at, i]
            difference = np.abs(b[:, k] - factor * b[:, i]).max()
            if difference <= tolerance * np.abs(b[at, k]):
                first[k], scale[k] = i, factor
                break
    return first, scale


def independent_columns(vectors: Sequence[Floats]) -> list[int]:
    """Those that are no combination of others before them, nearly."""
    chosen, directions = [], list[Floats]()
    for k, vector in enumerate(vectors):
        residual, size = vector.copy(), _norm(vector)
        for q in directions * 2:  # twice: what is left of nearly parallel vectors is small
            residual -= np.einsum("i,i", q, residual) * q
        if not _norm(residual) <= _NEARLY * size:
            chosen.append(k)
            directions.append(residual / _norm(residual))
    return chosen


def _norm(vector: Floats) -> float:
    return float(np.sqrt(np.einsum("i,i", vector, vector)))


def best_guesses(K: Operator, solved: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Combinations of solutions with the least energy: exact for combinations of their loads."""
    if not solved:
        return [np.zeros_like(right_hand_side) for right_hand_side in b]
    y = np.stack(solved, axis=1)
    image = np.stack(K.answers(Request.TIMES, solved), axis=1)
    inverse = np.linalg.pinv(y.T @ image, 1e-12, True)
    return [y @ (inverse @ (y.T @ right_hand_side)) for right_hand_side in b]
