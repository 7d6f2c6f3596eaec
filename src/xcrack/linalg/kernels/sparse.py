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
def _transpose(start, index, value, n_columns):  # type: ignore[no-untyped-def]
    """CSR arrays of the transposed matrix, sorted."""
    begin = zeros(n_columns + 1, np.int32)
    for k in range(len(index)):
        begin[index[k] + 1] += 1
    place = empty(n_columns, np.int32)
    for c in range(n_columns):
        place[c] = begin[c]
        begin[c + 1] += begin[c]
    row, entry = empty(len(index), np.int32), empty(len(index))
    for i in range(len(start) - 1):
        for k in range(start[i], start[i + 1]):
            to = place[index[k]]
            row[to], entry[to] = i, value[k]
            place[index[k]] = to + 1
    return begin, row, entry


@kernel
def _groups(start, row):  # type: ignore[no-untyped-def]
    """First row of each group of rows that follow each other and have the same columns."""
    first, count = zeros(len(start), np.int64), 0
    for c in range(1, len(start)):
        size = start[c] - start[c - 1]
        is_alike = c < len(start) - 1 and start[c + 1] - start[c] == size
        for k in range(size if is_alike else 0):
            is_alike = is_alike and row[start[c] + k] == row[start[c - 1] + k]
        if not is_alike:
            count += 1
            first[count] = c
    return first[: count + 1]


@kernel
def _group_product(  # type: ignore[no-untyped-def]
    first, start, row, value, other_start, other_column, other_value, width, is_symmetric
):
    """A B for a matrix A in groups of rows with the same columns, group by group.

    Parameters
    ----------
    first : (groups + 1,) array of int
        First row of each group.
    start, row, value : arrays
        Columns of A in each group, and their values, those in the rows of a group side by side.
    other_start, other_column, other_value : CSR arrays of B
    width : int
        Columns of B.
    is_symmetric : bool
        Of a symmetric product columns before those of the group are left out.

    Returns
    -------
    start, column, value : arrays
        The same of the product, sorted.
    back_start, back_group, back_place : arrays of int
        Groups that have each column, increasing, and where its values begin.
    """
    groups, entries = len(first) - 1, 0
    for k in range(start[groups]):
        entries += other_start[row[k] + 1] - other_start[row[k]]
    begin, unsorted_column = zeros(groups + 1, np.int64), empty(entries, np.int32)
    back_start, place = zeros(width + 1, np.int64), empty(width, np.int64)
    for c in range(width):
        place[c] = -1
    for g in range(groups):
        count, first_column = begin[g], first[g] if is_symmetric else 0
        for k in range(start[g], start[g + 1]):
            for j in range(other_start[row[k]], other_start[row[k] + 1]):
                c = other_column[j]
                if c >= first_column and place[c] != g:
                    place[c], unsorted_column[count] = g, c
                    back_start[c + 1] += 1
                    count += 1
        begin[g + 1] = count
    for c in range(width):
        place[c] = back_start[c]
        back_start[c + 1] += back_start[c]
    back_group, back_place = empty(begin[groups], np.int64), empty(begin[groups], np.int64)
    numbers, end, to = 0, empty(groups, np.int64), empty(groups, np.int64)
    for g in range(groups):
        end[g], to[g] = numbers, begin[g]
        numbers += (first[g + 1] - first[g]) * (begin[g + 1] - begin[g])
        for k in range(begin[g], begin[g + 1]):
            c = unsorted_column[k]
            back_group[place[c]] = g
            place[c] += 1
    column = unsorted_column
    for c in range(width):
        for k in range(back_start[c], back_start[c + 1]):
            g = back_group[k]
            back_place[k], column[to[g]] = end[g], c
            end[g] += first[g + 1] - first[g]
            to[g] += 1
    result, source, numbers = zeros(numbers), 0, 0
    for g in range(groups):
        rows, first_column = first[g + 1] - first[g], first[g] if is_symmetric else 0
        for k in range(begin[g], begin[g + 1]):
            place[column[k]] = numbers
            numbers += rows
        for k in range(start[g], start[g + 1]):
            for j in range(other_start[row[k]], other_start[row[k] + 1]):
                if other_column[j] >= first_column:
                    at, factor = place[other_column[j]], other_value[j]
                    for q in range(rows):
                        result[at + q] += value[source + q] * factor
            source += rows
    return begin, column, result, back_start, back_group, back_place


@kernel
def bordered_matrix(  # type: ignore[no-untyped-def]
    indptr, indices, data, Z_start, Z_column, Z_value, m, is_fixed, n_standard
):
    """A symmetric matrix in a basis of its first unknowns and of enriched columns.

    Columns are scaled to energy one. Standard unknowns that are fixed or have no energy are left
    out. Only rows of K in which a column has entries are multiplied out, for columns with the same
    rows at once.

    Parameters
    ----------
    indptr, indices, data : CSR arrays of K, (n, n)
    Z_start, Z_column, Z_value : CSR arrays of Z, (n, m)
    m : int
    is_fixed : (n,) array of bool
    n_standard : int
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
    n = len(indptr) - 1
    Zt_start, Zt_row, Zt_value = _transpose(Z_start, Z_column, Z_value, m)
    first = _groups(Zt_start, Zt_row)
    start = zeros(len(first), np.int64)
    for g in range(len(first) - 1):
        start[g + 1] = start[g] + Zt_start[first[g] + 1] - Zt_start[first[g]]
    row, value, to = empty(start[-1], np.int32), empty(len(Zt_value)), 0
    for g in range(len(first) - 1):
        for k in range(start[g + 1] - start[g]):
            row[start[g] + k] = Zt_row[Zt_start[first[g]] + k]
            for c in range(first[g], first[g + 1]):
                value[to] = Zt_value[Zt_start[c] + k]
                to += 1
    # Zᵀ K, and Zᵀ K Z from the diagonal on.
    side_start, side_row, side_value, across_start, across_group, across_place = _group_product(
        first, start, row, value, indptr, indices, data, n, False
    )
    own_start, own_column, own_value, back_start, back_group, back_place = _group_product(
        first, side_start, side_row, side_value, Z_start, Z_column, Z_value, m, True
    )
    energy, scale = zeros(m), empty(n_standard + m)
    for g in range(len(first) - 1):
        for c in range(first[g], first[g + 1]):
            for k in range(back_start[c], back_start[c + 1]):
                if back_group[k] == g:
                    energy[c] = own_value[back_place[k] + c - first[g]]
    number, count = empty(n_standard, np.int32), 0
    for i in range(n_standard):
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
    room = len(data)  # and what couples with enriched columns, on both sides of the diagonal
    for g in range(len(first) - 1):
        couplings = side_start[g + 1] - side_start[g] + own_start[g + 1] - own_start[g]
        room += 2 * (first[g + 1] - first[g]) * couplings
    rows, values = empty(room, np.int32), empty(room)
    begin, place = zeros(count + m + 1, np.int32), 0
    for i in range(n_standard):
        if number[i] >= 0:
            own_scale = scale[number[i]]
            for j in range(indptr[i], indptr[i + 1]):
                if indices[j] < n_standard and number[indices[j]] >= 0:
                    rows[place] = number[indices[j]]
                    values[place] = data[j] * own_scale * scale[rows[place]]
                    place += 1
            for j in range(across_start[i], across_start[i + 1]):
                g, at = across_group[j], across_place[j]
                for c in range(first[g], first[g + 1]):
                    rows[place] = count + c
                    values[place] = side_value[at + c - first[g]] * own_scale * scale[count + c]
                    place += 1
            begin[number[i] + 1] = place
    side_place, own_place = 0, 0
    for g in range(len(first) - 1):
        size = first[g + 1] - first[g]
        for c in range(first[g], first[g + 1]):
            own_scale = scale[count + c]
            for k in range(side_start[g], side_start[g + 1]):
                if side_row[k] < n_standard and number[side_row[k]] >= 0:
                    entry = side_value[side_place + size * (k - side_start[g]) + c - first[g]]
                    rows[place] = number[side_row[k]]
                    values[place] = entry * own_scale * scale[rows[place]]
                    place += 1
            for k in range(back_start[c], back_start[c + 1]):
                h, at = back_group[k], back_place[k]
                if h < g:
                    for column_h in range(first[h], first[h + 1]):
                        rows[place] = count + column_h
                        entry = own_value[at + column_h - first[h]]
                        values[place] = entry * own_scale * scale[rows[place]]
                        place += 1
            for k in range(own_start[g], own_start[g + 1]):
                entry = own_value[own_place + size * (k - own_start[g]) + c - first[g]]
                rows[place] = count + own_column[k]
                values[place] = entry * own_scale * scale[rows[place]]
                place += 1
            begin[count + c + 1] = place
        side_place += size * (side_start[g + 1] - side_start[g])
        own_place += size * (own_start[g + 1] - own_start[g])
    entries = count + len(Z_column)
    basis_start, to = zeros(n + 1, np.int32), 0
    column, entry_of_column = empty(entries, np.int32), empty(entries)
    for i in range(n):
        if i < n_standard and number[i] >= 0:
            column[to], entry_of_column[to] = number[i], scale[number[i]]
            to += 1
        for k in range(Z_start[i], Z_start[i + 1]):
            column[to] = count + Z_column[k]
            entry_of_column[to] = Z_value[k] * scale[column[to]]
            to += 1
        basis_start[i + 1] = to
    return (begin, rows[:place], values[:place]), (basis_start, column, entry_of_column), energy


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
