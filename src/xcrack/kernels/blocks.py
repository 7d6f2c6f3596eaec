"""Dense blocks of a sparse matrix."""

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def dense_blocks(indptr, indices, data, members, offsets):  # type: ignore[no-untyped-def]
    """Gather K[block, block] for ragged blocks of unknowns.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K
    members : (k,) array of int
        Unknowns of the blocks, one block after the other.
    offsets : (b + 1,) array of int

    Returns
    -------
    (sum of squares of the block sizes,) array
        The blocks, row by row.
    """
    n_blocks = len(offsets) - 1
    total = 0
    for b in range(n_blocks):
        total += (offsets[b + 1] - offsets[b]) ** 2
    result = np.zeros(total)
    place = np.full(len(indptr) - 1, -1, np.int64)
    start = 0
    for b in range(n_blocks):
        first, last = offsets[b], offsets[b + 1]
        size = last - first
        for k in range(first, last):
            place[members[k]] = k - first
        for k in range(first, last):
            row = members[k]
            for j in range(indptr[row], indptr[row + 1]):
                column = place[indices[j]]
                if column >= 0:
                    result[start + (k - first) * size + column] += data[j]
        for k in range(first, last):
            place[members[k]] = -1
        start += size * size
    return result
