"""Sparse matrices: their products, and dense blocks cut out, made orthonormal and solved."""

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.blas import dgesv, dsyev
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
    result = empty((len(indptr) - 1, columns))
    for i in range(len(result)):
        for first in range(0, columns, 2):  # two at once, which stay in registers
            next_column = min(first + 1, columns - 1)
            total, next_total = 0.0, 0.0
            for k in range(indptr[i], indptr[i + 1]):
                total += data[k] * x[indices[k], first]
                next_total += data[k] * x[indices[k], next_column]
            result[i, first], result[i, next_column] = total, next_total
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
    result = zeros((n_columns, x.shape[1]))
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            for c in range(x.shape[1]):
                result[indices[k], c] += data[k] * x[i, c]
    return result


@kernel
def residual(indptr, indices, data, x, b):  # type: ignore[no-untyped-def]
    """Largest norm of b - A x over that of b, of all columns `(n, k)`."""
    largest_share, columns = 0.0, x.shape[1]
    for first in range(0, columns, 2):  # two at once: reading A is what takes the time
        next_column = min(first + 1, columns - 1)
        largest_residual, size, other_rest, other_size = 0.0, 0.0, 0.0, 0.0
        for i in range(len(indptr) - 1):
            total, next_total = 0.0, 0.0
            for k in range(indptr[i], indptr[i + 1]):
                total += data[k] * x[indices[k], first]
                next_total += data[k] * x[indices[k], next_column]
            largest_residual += (b[i, first] - total) ** 2
            size += b[i, first] ** 2
            other_rest += (b[i, next_column] - next_total) ** 2
            other_size += b[i, next_column] ** 2
        for r, n in ((largest_residual, size), (other_rest, other_size)):
            share = np.sqrt(r / n) if n > 0 else np.sqrt(r)
            if np.isnan(share):
                return share
            largest_share = max(largest_share, share)
    return largest_share


@kernel
def bordered_matrix(  # type: ignore[no-untyped-def]
    indptr, indices, data, Z, coupling, coupling_of_columns, corner_block, is_fixed, first
):
    """A symmetric matrix in a basis of its first unknowns and of enriched columns.

    Columns are scaled to energy one. Standard unknowns that are fixed or have no energy are left
    out.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K, (n, n)
    Z : tuple of CSR arrays, (n, m)
    coupling, coupling_of_columns, corner_block : tuples of CSR arrays, (n, m), (m, n), (m, m)
        K Z, its transpose, and Zᵀ K Z; sorted.
    is_fixed : (n,) array of bool
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
    across_start, across_column, across_value = coupling
    down_start, down_row, down_value = coupling_of_columns
    own_start, own_column, own_value = corner_block
    n, m = len(indptr) - 1, len(own_start) - 1
    energy = zeros(m)
    for c in range(m):
        for k in range(own_start[c], own_start[c + 1]):
            if own_column[k] == c:
                energy[c] = own_value[k]
    number, count = empty(first, np.int32), 0
    scale = empty(first + m)
    for i in range(first):
        energy_i = 0.0
        number[i] = -1
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                energy_i = data[k]
        if energy_i > 0 and not is_fixed[i]:
            number[i] = count
            scale[count] = 1 / np.sqrt(energy_i)
            count += 1
    for c in range(m):
        scale[count + c] = 1 / np.sqrt(energy[c])
    start = zeros(count + m + 1, np.int32)
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
    rows, values = empty(start[count + m], np.int32), empty(start[count + m])
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
    begin = zeros(n + 1, np.int32)
    column, value = empty(entries, np.int32), empty(entries)
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
    result = zeros(total)
    place = np.full(len(indptr) - 1, -1, np.int64)
    start = 0
    for b in range(n_blocks):
        first, end = offsets[b], offsets[b + 1]
        size = end - first
        for k in range(first, end):
            place[members[k]] = k - first
        for k in range(first, end):
            row = members[k]
            for j in range(indptr[row], indptr[row + 1]):
                column = place[indices[j]]
                if column >= 0:
                    result[start + (k - first) * size + column] += data[j]
        for k in range(first, end):
            place[members[k]] = -1
        start += size * size
    return result


@kernel
def orthonormal_columns(  # type: ignore[no-untyped-def]
    indptr, indices, data, members, offsets, n_standard, tolerance
):
    """Columns that replace the enriched unknowns of blocks, orthonormal in the energy of K.

    Of each block, the enriched unknowns are made orthogonal to its standard ones, scaled by the
    diagonal, and turned into eigenvectors; those of small eigenvalues are dropped.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K, (n, n)
    members, offsets : arrays of int
        As of `dense_blocks`; standard unknowns first.
    n_standard : (b,) array of int
    tolerance : float
        Share of the largest eigenvalue of a block up to which others are dropped.

    Returns
    -------
    start, column, value : CSR arrays of the columns, (n, k)
    count : int
        k; -1 where a block cannot be factored.
    """
    n, blocks = len(indptr) - 1, len(offsets) - 1
    width, room = 0, 0
    for b in range(blocks):
        size = offsets[b + 1] - offsets[b]
        if size > width:
            width = size
        room += size * (size - n_standard[b])
    place = empty(n, np.int64)
    for i in range(n):
        place[i] = -1
    k, Z = empty((width, width)), empty(room)
    Q, C = empty(width * width), empty(width * width)
    ss, w, D = empty(width * width), empty(width), empty(width)
    work, pivots = empty(34 * width + 1), empty(width + 1, np.int32)
    sizes, letters = empty(4, np.int32), empty(2, np.uint8)
    sizes[2] = len(work)
    letters[0], letters[1] = 86, 76  # V L
    at = sizes.ctypes.data
    start = zeros(n + 1, np.int32)
    begin, has_failed = 0, False
    for b in range(blocks):
        first, end = offsets[b], offsets[b + 1]
        size, s = end - first, n_standard[b]
        e = size - s
        if e == 0:
            continue
        for i in range(size):
            place[members[first + i]] = i
        for i in range(size):
            row = members[first + i]
            for j in range(size):
                k[i, j] = 0.0
            for j in range(indptr[row], indptr[row + 1]):
                if place[indices[j]] >= 0:
                    k[i, place[indices[j]]] += data[j]
        for i in range(size):
            place[members[first + i]] = -1
        for j in range(e):
            for i in range(s):
                C[j * s + i] = k[i, s + j]
        if s > 0:
            for j in range(s):
                for i in range(s):
                    ss[j * s + i] = k[i, j]
            sizes[0], sizes[1] = s, e
            dgesv(
                at, at + 4, ss.ctypes.data, at, pivots.ctypes.data, C.ctypes.data, at, at + 12
            )  # fmt: skip
            has_failed = has_failed or sizes[3] != 0
        for j in range(e):
            D[j] = 1 / np.sqrt(k[s + j, s + j]) if k[s + j, s + j] > 0 else 0.0
        for j in range(e):
            for i in range(e):
                schur = k[s + i, s + j]
                for m in range(s):
                    schur -= k[m, s + i] * C[j * s + m]
                Q[j * e + i] = D[i] * schur * D[j]
        sizes[0] = e
        dsyev(
            letters.ctypes.data, letters.ctypes.data + 1, at, Q.ctypes.data, at, w.ctypes.data,
            work.ctypes.data, at + 8, at + 12,
        )  # fmt: skip
        has_failed = has_failed or sizes[3] != 0
        for j in range(e):
            scale = 1 / np.sqrt(w[j]) if w[j] > tolerance * w[e - 1] else 0.0
            for i in range(e):
                Z[begin + (s + i) * e + j] = D[i] * Q[j * e + i] * scale
            for i in range(s):
                total = 0.0
                for m in range(e):
                    total += C[m * s + i] * Z[begin + (s + m) * e + j]
                Z[begin + i * e + j] = -total
            for i in range(size):
                start[members[first + i] + 1] += Z[begin + i * e + j] != 0
        begin += size * e
    for i in range(n):
        place[i] = start[i]
        start[i + 1] += start[i]
    column, value = empty(start[n], np.int32), empty(start[n])
    begin, count = 0, 0
    for b in range(blocks):
        first, size = offsets[b], offsets[b + 1] - offsets[b]
        e = size - n_standard[b]
        for j in range(e):
            has_energy = False
            for i in range(size):
                entry = Z[begin + i * e + j]
                if entry != 0:
                    to = place[members[first + i]]
                    column[to], value[to] = count, entry
                    place[members[first + i]] += 1
                    has_energy = True
            count += has_energy
        begin += size * e
    # Addresses alone keep no array alive: numba frees it after its last use.
    if has_failed or letters[0] + len(work) + len(pivots) + len(ss) + len(w) + len(Q) < 1:
        count = -1
    return start, column, value, count


@kernel
def add_solved(members, start, offset, inverse, r, result):  # type: ignore[no-untyped-def]
    """Add the inverse of each block times its part of r.

    Parameters
    ----------
    members, start, offset, inverse : as of `Patches`
    r : (n,) array
    result : (n,) array
        Changed.
    """
    part = empty(len(result), result.dtype)  # no block holds more
    for g in range(len(start) - 1):
        first, size = start[g], start[g + 1] - start[g]
        for i in range(size):
            part[i] = 0
        p = offset[g]
        # Column by column: a sum of columns is vectorised, a scalar product is not.
        for j in range(size):
            value = r[members[first + j]]
            for i in range(size):
                part[i] += value * inverse[p + i]
            p += size
        for i in range(size):
            result[members[first + i]] += part[i]
