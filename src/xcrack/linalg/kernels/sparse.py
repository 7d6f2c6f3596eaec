"""Sparse matrices: products in the order of scipy's, and a stiffness in another basis."""

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


@kernel
def bordered_matrix(indptr, indices, data, Z, across, down, corner_block, fixed, first):  # type: ignore[no-untyped-def]
    """A symmetric matrix in a basis of its first unknowns and of enriched columns.

    Columns are scaled to energy one. Standard unknowns that are fixed or have no energy are left
    out.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K, (n, n)
    Z : tuple of CSR arrays, (n, m)
    across, down, corner_block : tuples of CSR arrays, (n, m), (m, n), (m, m)
        K Z, its transpose, and Zᵀ K Z; sorted.
    fixed : (n,) array of bool
    first : int
        Number of standard unknowns.

    Returns
    -------
    matrix : tuple of CSC arrays, (k, k)
        Sorted, int32.
    basis : tuple of CSR arrays, (n, k)
    energy : (m,) array
        Of the enriched columns before they are scaled; where one is not positive, drop its column
        and call again.
    """
    Z_start, Z_column, Z_value = Z
    across_start, across_column, across_value = across
    down_start, down_row, down_value = down
    own_start, own_column, own_value = corner_block
    n, m = len(indptr) - 1, len(own_start) - 1
    energy = np.zeros(m)
    for c in range(m):
        for k in range(own_start[c], own_start[c + 1]):
            if own_column[k] == c:
                energy[c] = own_value[k]
    number, count = np.empty(first, np.int32), 0
    scale = np.empty(first + m)
    for i in range(first):
        energy_i = 0.0
        number[i] = -1
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                energy_i = data[k]
        if energy_i > 0 and not fixed[i]:
            number[i] = count
            scale[count] = 1 / np.sqrt(energy_i)
            count += 1
    for c in range(m):
        scale[count + c] = 1 / np.sqrt(energy[c])
    start = np.zeros(count + m + 1, np.int32)
    for i in range(first):
        if number[i] >= 0:
            entries = across_start[i + 1] - across_start[i]
            for j in range(indptr[i], indptr[i + 1]):
                if indices[j] < first and number[indices[j]] >= 0:
                    entries += 1
            start[number[i] + 1] = entries
    for c in range(m):
        entries = own_start[c + 1] - own_start[c]
        for j in range(down_start[c], down_start[c + 1]):
            if down_row[j] < first and number[down_row[j]] >= 0:
                entries += 1
        start[count + c + 1] = entries
    for c in range(count + m):
        start[c + 1] += start[c]
    rows, values = np.empty(start[count + m], np.int32), np.empty(start[count + m])
    for i in range(first):
        if number[i] >= 0:
            place = start[number[i]]
            for j in range(indptr[i], indptr[i + 1]):
                if indices[j] < first and number[indices[j]] >= 0:
                    rows[place] = number[indices[j]]
                    values[place] = data[j] * scale[number[i]] * scale[rows[place]]
                    place += 1
            for j in range(across_start[i], across_start[i + 1]):
                rows[place] = count + across_column[j]
                values[place] = across_value[j] * scale[number[i]] * scale[rows[place]]
                place += 1
    for c in range(m):
        place = start[count + c]
        for j in range(down_start[c], down_start[c + 1]):
            if down_row[j] < first and number[down_row[j]] >= 0:
                rows[place] = number[down_row[j]]
                values[place] = down_value[j] * scale[count + c] * scale[rows[place]]
                place += 1
        for j in range(own_start[c], own_start[c + 1]):
            rows[place] = count + own_column[j]
            values[place] = own_value[j] * scale[count + c] * scale[rows[place]]
            place += 1
    entries = count + len(Z_column)
    begin = np.zeros(n + 1, np.int32)
    column, value = np.empty(entries, np.int32), np.empty(entries)
    to = 0
    for i in range(n):
        if i < first and number[i] >= 0:
            column[to], value[to] = number[i], scale[number[i]]
            to += 1
        for k in range(Z_start[i], Z_start[i + 1]):
            column[to] = count + Z_column[k]
            value[to] = Z_value[k] * scale[column[to]]
            to += 1
        begin[i + 1] = to
    return (start, rows, values), (begin, column, value), energy
