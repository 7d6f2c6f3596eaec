"""Products of matrices in blocks of rows with four vectors at once, which stand side by side.

A value is read once for all four, and each sum is that of `cycle.product` to the bit: the result
for a vector does not depend on those beside it.
"""

import numpy as np

from xcrack.base.kernels.jit import kernel
from xcrack.base.kernels.vectors import one_row, three_rows


@kernel
def product_of_four(first, start, offset, columns, values, x, y, scale, out):  # type: ignore[no-untyped-def]
    """Write y + scale A x into `out`, for x, y and out `(n, 4)`.

    Parameters
    ----------
    first, start, offset, columns : arrays of uint32
        Blocks of rows as in `cycle.fill_blocks`.
    values, x, y : contiguous arrays of one type
    scale : scalar of that type
    out : contiguous array
        May be y.
    """
    for g in range(len(first) - 1):
        low, high = np.int64(start[g]), np.int64(start[g + 1])
        row, end, place = np.int64(first[g]), np.int64(first[g + 1]), np.int64(offset[g])
        while row + 2 < end:
            three_rows(columns, values, x, y, scale, out, low, high, place, row)
            place += 3 * (high - low)
            row += 3
        while row < end:
            one_row(columns, values, x, y, scale, out, low, high, place, row)
            place += high - low
            row += 1
