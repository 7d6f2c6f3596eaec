"""A symmetric matrix with a few more rows and columns, put together and scaled."""

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def bordered(  # type: ignore[no-untyped-def]
    indptr, indices, data, number, scale, across, down, own
):
    """Columns of the symmetric matrix [[A, X], [Xᵀ, Y]], scaled from both sides.

    Parameters
    ----------
    indptr, indices, data : CSR arrays
        A among other rows and columns; it is symmetric.
    number : (n,) array of int
        Place in the result of each row of A, growing, or -1 for a row that does not count.
    scale : (k,) array
        Of all rows of the result.
    across : CSR arrays of X, (n, m)
        Rows that do not count are passed over.
    down : CSC arrays of X
    own : CSC arrays of Y, (m, m)

    Returns
    -------
    indptr, indices : array of int32
    data : array
    """
    n, m = len(number), len(down[0]) - 1
    k = len(scale)
    first = k - m
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
