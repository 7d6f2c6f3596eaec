"""Products of sparse matrices with vectors, those of scipy to the bit; proportional vectors."""

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Floats, Ints
from xcrack.kernels import sparse
from xcrack.solvers.projected_cg import Operator
from xcrack.xfem.stiffness import Stiffness

_SAME = 1e-15  # share of the largest entry up to which vectors are multiples of each other


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


def proportional(b: Floats) -> tuple[Ints, Floats]:
    """First column that each of `(n, k)` is a multiple of, to round-off, and the factor `(k,)`.

    Load states are often one load, scaled.
    """
    first, scale = np.arange(b.shape[1]), np.ones(b.shape[1])
    for k in range(1, len(first)):
        for i in range(k):
            at = int(np.abs(b[:, i]).argmax())
            if first[i] != i or b[at, i] == 0:
                continue
            factor = b[at, k] / b[at, i]
            away = np.abs(b[:, k] - factor * b[:, i]).max()
            if away <= _SAME * np.abs(b[at, k]):
                first[k], scale[k] = i, factor
                break
    return first, scale


def best_guess(K: Operator, solved: Floats, b: Floats) -> Floats:
    """The combination of other solutions with the least energy: exact for proportional loads."""
    y = np.zeros(len(b))
    if not solved.shape[1]:
        return y
    image = np.stack([K.times(v) for v in solved.T], axis=1)
    return np.asarray(solved @ (np.linalg.pinv(solved.T @ image, 1e-12, True) @ (solved.T @ b)))
