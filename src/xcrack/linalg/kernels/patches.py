"""Overlapping blocks of unknowns, each solved by itself and summed."""

import numpy as np

from xcrack.base.kernels.jit import kernel


@kernel
def add_solved(members, start, offset, inverse, r, out):  # type: ignore[no-untyped-def]
    """Add the inverse of each block times its part of r.

    Parameters
    ----------
    members, start, offset, inverse : as of `Patches`
    r : (n,) array
    out : (n,) array
        Changed.
    """
    part = np.empty(len(out), out.dtype)  # no block holds more
    for g in range(len(start) - 1):
        first, size = start[g], start[g + 1] - start[g]
        part_values = part[:size]
        part_values[:] = 0
        p = offset[g]
        # Column by column: a sum of columns is vectorised, a scalar product is not.
        for j in range(size):
            value = r[members[first + j]]
            part_values += value * inverse[p : p + size]
            p += np.uint64(size)
        for i in range(size):
            out[members[first + i]] += part_values[i]
