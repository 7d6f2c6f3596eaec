"""Matrices in blocks of rows with one pattern, and the sweeps of a multigrid cycle on them.

The unknowns of a node couple with the same others: their rows share one list of columns, which
nearly halves the memory that a product has to read. Values are stored three rows at a time, row
beside row, so that they are read in one stream. All indices are unsigned: numba guards signed
ones against negative values, which costs up to four times.
"""

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel
from xcrack.base.kernels.vectors import one_row, three_rows

_ONE, _TWO, _THREE = np.uint32(1), np.uint32(2), np.uint32(3)


@kernel
def pattern_sizes(indptr, indices, first, n_columns):  # type: ignore[no-untyped-def]
    """Number of different columns in each block of rows.

    Parameters
    ----------
    indptr, indices : CSR pattern
    first : (b + 1,) array of int
        First row of each block.
    n_columns : int

    Returns
    -------
    (b,) array of int
    """
    n_blocks = len(first) - 1
    mark = np.full(n_columns, -1, np.int64)
    count = zeros(n_blocks, np.int64)
    for g in range(n_blocks):
        for k in range(indptr[first[g]], indptr[first[g + 1]]):
            column = indices[k]
            if mark[column] != g:
                mark[column] = g
                count[g] += 1
    return count


@kernel
def _sort(values, first, end):  # type: ignore[no-untyped-def]
    """Sort a stretch (Shell); numba's own sort takes longer to compile than the rest."""
    gap = 1
    while 3 * gap + 1 < end - first:
        gap = 3 * gap + 1
    while gap > 0:
        for place in range(first + gap, end):
            value = values[place]
            at = place
            while at >= first + gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap //= 3


@kernel
def fill_blocks(indptr, indices, data, first, start, size, offset, n_columns, shift, columns, values):  # type: ignore[no-untyped-def]  # fmt: skip # noqa: E501
    """Copy the entries of a CSR matrix into blocks of rows, which other matrices may share.

    Parameters
    ----------
    indptr, indices, data : CSR arrays
    first : (b + 1,) array of int
        First row of each block.
    start : (b,) array of int
        Where the columns of this matrix begin in each block's list.
    size : (b, 2) array of int
        Columns to the left of this matrix in each block, and columns of the whole block.
    offset : (b,) array of int
        Where the values of each block begin.
    n_columns, shift : int
        Columns of the matrix, and what is added to their numbers.
    columns : array of uint32
        Filled: columns of each block, sorted.
    values : array
        Zero; filled: full chunks of three rows column by column, then single rows.
    """
    mark = np.full(n_columns, -1, np.int64)
    place = empty(n_columns, np.int64)
    for g in range(len(first) - 1):
        m = start[g]
        for k in range(indptr[first[g]], indptr[first[g + 1]]):
            column = indices[k]
            if mark[column] != g:
                mark[column] = g
                columns[m] = column
                m += 1
        _sort(columns, start[g], m)
        n_standard, n_members = size[g]
        for k in range(start[g], m):
            place[columns[k]] = n_standard + k - start[g]
            columns[k] += np.uint32(shift)
        n_rows = first[g + 1] - first[g]
        for i in range(n_rows):
            row = first[g] + i
            base, stride = offset[g] + i * n_members, 1
            if i < n_rows - n_rows % 3:
                base, stride = offset[g] + (i - i % 3) * n_members + i % 3, 3
            for k in range(indptr[row], indptr[row + 1]):
                values[base + stride * place[indices[k]]] += data[k]


@kernel
def product(first, start, offset, columns, values, x, y, scale, out):  # type: ignore[no-untyped-def]
    """Write y + scale A x into `out`.

    Parameters
    ----------
    first, start, offset, columns : arrays of uint32
        Blocks of rows as in `fill_blocks`.
    values, x, y : arrays of one type
    scale : scalar of that type
    out : array
        May be y.
    """
    zero = scale - scale
    for g in range(len(first) - 1):
        begin, stop = start[g], start[g + 1]
        row, end, p = first[g], first[g + 1], offset[g]
        while row + _TWO < end:
            a, b, c = zero, zero, zero
            for k in range(begin, stop):
                xk = x[columns[k]]
                a += values[p] * xk
                b += values[p + _ONE] * xk
                c += values[p + _TWO] * xk
                p += _THREE
            out[row] = y[row] + scale * a
            out[row + _ONE] = y[row + _ONE] + scale * b
            out[row + _TWO] = y[row + _TWO] + scale * c
            row += _THREE
        while row < end:
            a = zero
            for k in range(begin, stop):
                a += values[p] * x[columns[k]]
                p += _ONE
            out[row] = y[row] + scale * a
            row += _ONE


@kernel
def product_of_four(first, start, offset, columns, values, x, y, scale, out):  # type: ignore[no-untyped-def]
    """Write y + scale A x into `out`, for x, y and out `(n, 4)`: four vectors side by side.

    A value is read once for all four, and each sum is that of `product` to the bit: the result for
    a vector does not depend on those beside it.

    Parameters
    ----------
    first, start, offset, columns : arrays of uint32
        Blocks of rows as in `fill_blocks`.
    values, x, y : contiguous arrays of one type
    scale : scalar of that type
    out : contiguous array
        May be y.
    """
    for g in range(len(first) - 1):
        begin, stop = np.int64(start[g]), np.int64(start[g + 1])
        row, end, place = np.int64(first[g]), np.int64(first[g + 1]), np.int64(offset[g])
        while row + 2 < end:
            three_rows(columns, values, x, y, scale, out, begin, stop, place, row)
            place += 3 * (stop - begin)
            row += 3
        while row < end:
            one_row(columns, values, x, y, scale, out, begin, stop, place, row)
            place += stop - begin
            row += 1


@kernel
def first_step(inverse, r, scale, d, x):  # type: ignore[no-untyped-def]
    """Begin a Chebyshev sweep: d = scale D^-1 r, x += d.

    Parameters
    ----------
    inverse : (n,) array
        Inverse diagonal.
    r : (n,) array
        Residual.
    scale : scalar
    d, x : (n,) arrays
        Changed.
    """
    for i in range(len(r)):
        d[i] = scale * inverse[i] * r[i]
        x[i] += d[i]


@kernel
def next_step(inverse, r, keep, scale, d, x):  # type: ignore[no-untyped-def]
    """Go on with a Chebyshev sweep: d = keep d + scale D^-1 r, x += d.

    Parameters
    ----------
    inverse : (n,) array
        Inverse diagonal.
    r : (n,) array
        Residual.
    keep, scale : scalar
    d, x : (n,) arrays
        Changed.
    """
    for i in range(len(r)):
        d[i] = keep * d[i] + scale * inverse[i] * r[i]
        x[i] += d[i]
