"""A stiffness in a basis that differs from that of the space in its enriched columns alone."""

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def _product(indptr, indices, data, indptr0, indices0, data0, n_columns):  # type: ignore[no-untyped-def]
    """CSR arrays of the product of two sparse matrices, rows sorted, no zeros."""
    n = len(indptr) - 1
    start = np.zeros(n + 1, np.int32)
    last = np.full(n_columns, -1, np.int32)
    for i in range(n):
        count = 0
        for j in range(indptr[i], indptr[i + 1]):
            row = indices[j]
            for k in range(indptr0[row], indptr0[row + 1]):
                if last[indices0[k]] != i:
                    last[indices0[k]] = i
                    count += 1
        start[i + 1] = start[i] + count
    column, value = np.empty(start[n], np.int32), np.empty(start[n])
    sums = np.zeros(n_columns)
    last[:] = -1
    to = 0
    for i in range(n):
        begin = to
        for j in range(indptr[i], indptr[i + 1]):
            row = indices[j]
            for k in range(indptr0[row], indptr0[row + 1]):
                c = indices0[k]
                if last[c] != i:
                    last[c] = i
                    sums[c] = 0.0
                    column[to] = c
                    to += 1
                sums[c] += data[j] * data0[k]
        _sort(column, begin, to)
        other = begin
        for k in range(begin, to):
            if sums[column[k]] != 0.0:
                column[other], value[other] = column[k], sums[column[k]]
                other += 1
        to = other
        start[i + 1] = to
    return start, column[:to], value[:to]


@kernel
def _sort(values, low, high):  # type: ignore[no-untyped-def]
    """Sort a stretch (Shell); numba's own sort takes longer to compile than the rest."""
    gap = 1
    while 3 * gap + 1 < high - low:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(low + gap, high):
            value, j = values[i], i
            while j >= low + gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value
        gap //= 3


@kernel
def _transposed(start, column, value, n_columns):  # type: ignore[no-untyped-def]
    n = len(start) - 1
    begin = np.zeros(n_columns + 1, np.int32)
    for k in range(len(column)):
        begin[column[k] + 1] += 1
    for c in range(n_columns):
        begin[c + 1] += begin[c]
    fill = begin[:-1].copy()
    row, turned = np.empty(len(column), np.int32), np.empty(len(column))
    for i in range(n):
        for k in range(start[i], start[i + 1]):
            c = column[k]
            row[fill[c]], turned[fill[c]] = i, value[k]
            fill[c] += 1
    return begin, row, turned


@kernel
def bordered(indptr, indices, data, Z, n_enriched, fixed, first):  # type: ignore[no-untyped-def]
    """A symmetric matrix in a basis of its first unknowns and of enriched columns.

    Columns are scaled to energy one. Standard unknowns that are fixed or have no energy are left
    out. With K and Z sorted, sums are those of scipy's products, in their order.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K, (n, n)
    Z : tuple of CSR arrays, (n, n_enriched)
    n_enriched : int
    fixed : (n,) array of bool
    first : int
        Number of standard unknowns.

    Returns
    -------
    matrix : tuple of CSC arrays, (k, k)
        Sorted, int32.
    basis : tuple of CSR arrays, (n, k)
    energy : (n_enriched,) array
        Of the enriched columns before they are scaled; where one is not positive, drop its column
        and call again.
    """
    n, m = len(indptr) - 1, n_enriched
    across = _product(indptr, indices, data, Z[0], Z[1], Z[2], m)
    down = _transposed(across[0], across[1], across[2], m)
    own = _product(down[0], down[1], down[2], Z[0], Z[1], Z[2], m)
    energy = np.zeros(m)
    for c in range(m):
        for k in range(own[0][c], own[0][c + 1]):
            if own[1][k] == c:
                energy[c] = own[2][k]
    number, count = np.full(first, -1, np.int32), 0
    scale = np.empty(first + m)
    for i in range(first):
        energy_i = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                energy_i = data[k]
        if energy_i > 0 and not fixed[i]:
            number[i] = count
            scale[count] = 1 / np.sqrt(energy_i)
            count += 1
    for c in range(m):
        scale[count + c] = 1 / np.sqrt(energy[c])
    matrix = _scaled(indptr, indices, data, number, scale[: count + m], count, across, down, own)
    entries = count + len(Z[1])
    begin = np.zeros(n + 1, np.int32)
    column, value = np.empty(entries, np.int32), np.empty(entries)
    to = 0
    for i in range(n):
        if i < first and number[i] >= 0:
            column[to], value[to] = number[i], scale[number[i]]
            to += 1
        for k in range(Z[0][i], Z[0][i + 1]):
            column[to] = count + Z[1][k]
            value[to] = Z[2][k] * scale[column[to]]
            to += 1
        begin[i + 1] = to
    return matrix, (begin, column, value), energy


@kernel
def _scaled(indptr, indices, data, number, scale, first, across, down, own):  # type: ignore[no-untyped-def]
    """Columns of the symmetric matrix [[A, X], [Xᵀ, Y]], scaled from both sides; see `bordered`.

    `across` are CSR arrays of X with all rows of A, `down` its columns, `own` columns of Y.
    """
    n, m = len(number), len(down[0]) - 1
    k = len(scale)
    start = np.zeros(k + 1, np.int32)
    for i in range(n):
        if number[i] >= 0:
            count = across[0][i + 1] - across[0][i]
            for j in range(indptr[i], indptr[i + 1]):
                if indices[j] < n and number[indices[j]] >= 0:
                    count += 1
            start[number[i] + 1] = count
    for c in range(m):
        count = own[0][c + 1] - own[0][c]
        for j in range(down[0][c], down[0][c + 1]):
            if down[1][j] < n and number[down[1][j]] >= 0:
                count += 1
        start[first + c + 1] = count
    for c in range(k):
        start[c + 1] += start[c]
    rows, values = np.empty(start[k], np.int32), np.empty(start[k])
    for i in range(n):
        if number[i] >= 0:
            place = start[number[i]]
            for j in range(indptr[i], indptr[i + 1]):
                if indices[j] < n and number[indices[j]] >= 0:
                    rows[place] = number[indices[j]]
                    values[place] = data[j] * scale[number[i]] * scale[rows[place]]
                    place += 1
            for j in range(across[0][i], across[0][i + 1]):
                rows[place] = first + across[1][j]
                values[place] = across[2][j] * scale[number[i]] * scale[rows[place]]
                place += 1
    for c in range(m):
        place = start[first + c]
        for j in range(down[0][c], down[0][c + 1]):
            if down[1][j] < n and number[down[1][j]] >= 0:
                rows[place] = number[down[1][j]]
                values[place] = down[2][j] * scale[first + c] * scale[rows[place]]
                place += 1
        for j in range(own[0][c], own[0][c + 1]):
            rows[place] = first + own[1][j]
            values[place] = own[2][j] * scale[first + c] * scale[rows[place]]
            place += 1
    return start, rows, values
