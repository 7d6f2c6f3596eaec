"""Symbolic half of a multifrontal factorisation: rows of each part, places of the entries."""

import numpy as np

from xcrack.base.kernels.jit import kernel


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
def arrange_parts(indptr, indices, data, first, order, rank, perm, place):  # type: ignore[no-untyped-def]
    """Rows below the pivots of each part, and entries of the matrix by their place in its front.

    Parameters
    ----------
    indptr, indices, data : arrays
        Symmetric matrix, CSC, both triangles.
    first : (parts + 1,) array of int
        First permuted unknown of each part in postorder.
    order, rank : arrays of int
        Of `postorder`.
    perm, place : (n,) arrays of int
        Unknown at each permuted place, and the reverse.

    Returns
    -------
    begin : (parts + 1,) array of int
        Where the boundary of each part begins.
    boundary : array of int32
        Permuted unknowns beyond the part that its front touches, sorted.
    in_parent : array of int32
        Place of each in the front of the part's parent.
    start : (n + 1,) array of int
        Where the entries of each permuted column begin.
    row : array of int32
        Place in the front of the column's part.
    value : array
    """
    parts, n = len(order), len(perm)
    start = np.zeros(n + 1, dtype=np.int64)
    room = len(indices)  # twice what is needed, but no pattern is symmetric to the last zero
    row, value = np.empty(room, dtype=np.int32), np.empty(room)
    begin = np.zeros(parts + 1, dtype=np.int64)
    capacity = 8 * n + 1000
    boundary = np.empty(capacity, dtype=np.int32)
    in_parent = np.empty(capacity, dtype=np.int32)
    mark, local = np.zeros(n, dtype=np.int32), np.empty(n, dtype=np.int32)
    to = 0
    for t in range(parts):
        low, high, top = first[t], first[t + 1], begin[t]
        if top + n > capacity:
            capacity = 2 * capacity + n
            wider, wider_map = np.empty(capacity, np.int32), np.empty(capacity, np.int32)
            for k in range(top):
                wider[k], wider_map[k] = boundary[k], in_parent[k]
            boundary, in_parent = wider, wider_map
        for c in range(low, high):
            for k in range(indptr[perm[c]], indptr[perm[c] + 1]):
                i = place[indices[k]]
                row[to], value[to] = i, data[k]
                to += i >= c  # without a branch, which no processor foresees
            start[c + 1] = to
        for k in range(start[low], to):
            i = row[k]
            if i >= high and mark[i] != t + 1:
                mark[i] = t + 1
                boundary[top] = i
                top += 1
        p = order[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                for k in range(begin[child], begin[child + 1]):
                    i = boundary[k]
                    if i >= high and mark[i] != t + 1:
                        mark[i] = t + 1
                        boundary[top] = i
                        top += 1
        _sort(boundary, begin[t], top)
        begin[t + 1] = top
        for j in range(high - low):
            local[low + j] = j
        for k in range(begin[t], top):
            local[boundary[k]] = high - low + k - begin[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                for k in range(begin[child], begin[child + 1]):
                    in_parent[k] = local[boundary[k]]
        for k in range(start[low], to):
            row[k] = local[row[k]]
    end = begin[parts]
    return begin, boundary[:end].copy(), in_parent[:end].copy(), start, row[:to], value[:to]


@kernel
def sizes(first, begin):  # type: ignore[no-untyped-def]
    """Entries of the panel of each part and of its update matrix, and its operations."""
    parts = len(begin) - 1
    panel, update = np.zeros(parts, dtype=np.int64), np.zeros(parts, dtype=np.int64)
    work = np.zeros(parts)
    for t in range(parts):
        k, b = first[t + 1] - first[t], begin[t + 1] - begin[t]
        panel[t] = (k + b) * k
        update[t] = b * (b + 1) // 2
        work[t] = k**3 / 3.0 + k * k * b + k * b * (b + 1.0)
    return panel, update, work


@kernel
def places_of_updates(order, rank, update, lowest):  # type: ignore[no-untyped-def]
    """Where the update matrix of each part is stored.

    Parts with fewer than `lowest` levels below them share a stack, which is empty again once a part
    with that many has taken what it needs; the others have places of their own.

    Returns
    -------
    place : (parts,) array of int
        In the stack; -1 for a place of its own.
    height : (parts,) array of int
        Levels below each part.
    stack : int
        Entries that the stack takes.
    """
    parts = len(order)
    place, height = np.zeros(parts, dtype=np.int64), np.zeros(parts, dtype=np.int64)
    top, stack = 0, 0
    for t in range(parts):
        p = order[t]
        if 2 * p <= parts:
            height[t] = height[rank[2 * p]] + 1
        if height[t] >= lowest:
            place[t] = -1
            top = 0
            continue
        if 2 * p <= parts:
            top = place[rank[2 * p]]
        place[t] = top
        top += update[t]
        stack = max(stack, top)
    return place, height, stack


@kernel
def unchanged_parts(fronts, before):  # type: ignore[no-untyped-def]
    """Parts whose entries and whose children's places are the same bits as before `(parts,)`.

    Parameters
    ----------
    fronts, before : tuples of arrays
        first, begin, in_parent, start, row, value, order, rank.
    """
    first, begin, in_parent, start, row, value, order, rank = fronts
    first0, begin0, in_parent0, start0, row0, value0 = before[:6]
    parts = len(order)
    is_unchanged = np.zeros(parts, dtype=np.bool_)
    bits, bits0 = value.view(np.uint64), value0.view(np.uint64)
    for t in range(parts):
        k, b = first[t + 1] - first[t], begin[t + 1] - begin[t]
        if k != first0[t + 1] - first0[t] or b != begin0[t + 1] - begin0[t]:
            continue
        low, low0 = start[first[t]], start0[first0[t]]
        count = start[first[t + 1]] - low
        alike = count == start0[first0[t + 1]] - low0
        if alike:
            for j in range(k):
                c, c0 = first[t] + j, first0[t] + j
                if start[c + 1] - start[c] != start0[c0 + 1] - start0[c0]:
                    alike = False
                    break
        if alike:
            for i in range(count):
                if row[low + i] != row0[low0 + i] or bits[low + i] != bits0[low0 + i]:
                    alike = False
                    break
        p = order[t]
        if alike and 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                count = begin[child + 1] - begin[child]
                if count != begin0[child + 1] - begin0[child]:
                    alike = False
                    break
                for i in range(count):
                    if in_parent[begin[child] + i] != in_parent0[begin0[child] + i]:
                        alike = False
                        break
        is_unchanged[t] = alike
    return is_unchanged
