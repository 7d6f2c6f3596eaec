"""Products of a sparse matrix with columns: sums in the order of scipy's, with fewer calls."""

import numpy as np

from xcrack.base.kernels.jit import kernel


@kernel
def times(indptr, indices, data, x):  # type: ignore[no-untyped-def]
    """A x.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of A, (n, m)
    x : (m, k) array

    Returns
    -------
    (n, k) array
    """
    columns = x.shape[1]
    result = np.empty((len(indptr) - 1, columns))
    for i in range(len(result)):
        for first in range(0, columns, 2):  # two at once, which stay in registers
            second = min(first + 1, columns - 1)
            total, other = 0.0, 0.0
            for k in range(indptr[i], indptr[i + 1]):
                total += data[k] * x[indices[k], first]
                other += data[k] * x[indices[k], second]
            result[i, first], result[i, second] = total, other
    return result


@kernel
def times_transposed(indptr, indices, data, n_columns, x):  # type: ignore[no-untyped-def]
    """Aᵀ x; see `times`.

    Parameters
    ----------
    n_columns : int
        m.
    x : (n, k) array

    Returns
    -------
    (m, k) array
    """
    result = np.zeros((n_columns, x.shape[1]))
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            for c in range(x.shape[1]):
                result[indices[k], c] += data[k] * x[i, c]
    return result


@kernel
def residual(indptr, indices, data, x, b):  # type: ignore[no-untyped-def]
    """Largest norm of b - A x over that of b, of all columns `(n, k)`."""
    largest, columns = 0.0, x.shape[1]
    for first in range(0, columns, 2):  # two at once: reading A is what takes the time
        second = min(first + 1, columns - 1)
        largest_residual, size, other_rest, other_size = 0.0, 0.0, 0.0, 0.0
        for i in range(len(indptr) - 1):
            total, other = 0.0, 0.0
            for k in range(indptr[i], indptr[i + 1]):
                total += data[k] * x[indices[k], first]
                other += data[k] * x[indices[k], second]
            largest_residual += (b[i, first] - total) ** 2
            size += b[i, first] ** 2
            other_rest += (b[i, second] - other) ** 2
            other_size += b[i, second] ** 2
        for r, n in ((largest_residual, size), (other_rest, other_size)):
            share = np.sqrt(r / n) if n > 0 else np.sqrt(r)
            if np.isnan(share):
                return share
            largest = max(largest, share)
    return largest
