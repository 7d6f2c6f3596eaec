"""Symbolic half of a multifrontal factorisation: tree of the mesh, rows and places of parts."""

import numpy as np

from xcrack.base.kernels.jit import kernel


@kernel
def bisect_cells(ranked, centre, depth):  # type: ignore[no-untyped-def]
    """Leaf of each cell after halving at medians along the longer side.

    Parameters
    ----------
    ranked : (d, n) array of int
        Cells in the order of each coordinate. It is changed.
    centre : (n, d) array
    depth : int
        Levels of halving.

    Returns
    -------
    (n,) array of int
        Number 0 to 2^depth - 1.
    """
    d, n = ranked.shape
    leaf = np.empty(n, dtype=np.int64)
    low, high = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    high[0] = n
    lower = np.empty(n, dtype=np.bool_)
    spare = np.empty(n, dtype=np.int64)
    for _ in range(depth):
        m = len(low)
        new_low, new_high = np.empty(2 * m, dtype=np.int64), np.empty(2 * m, dtype=np.int64)
        for g in range(m):
            a, b = low[g], high[g]
            half = a + (b - a) // 2
            new_low[2 * g], new_high[2 * g], new_low[2 * g + 1], new_high[2 * g + 1] = (
                a,
                half,
                half,
                b,
            )
            if b - a < 2:
                continue
            axis, widest = 0, -1.0
            for i in range(d):
                width = centre[ranked[i, b - 1], i] - centre[ranked[i, a], i]
                if width > widest:
                    axis, widest = i, width
            for k in range(a, b):
                lower[ranked[axis, k]] = k < half
            for i in range(d):
                if i == axis:
                    continue
                one, other = a, 0
                for k in range(a, b):
                    c = ranked[i, k]
                    if lower[c]:
                        ranked[i, one] = c
                        one += 1
                    else:
                        spare[other] = c
                        other += 1
                for k in range(other):
                    ranked[i, one + k] = spare[k]
        low, high = new_low, new_high
    for g in range(len(low)):
        for k in range(low[g], high[g]):
            leaf[ranked[0, k]] = g
    return leaf


@kernel
def _ancestor(a, b):  # type: ignore[no-untyped-def]
    """Lowest common ancestor of two parts; 0 stands for none yet."""
    if a == 0:
        return b
    if b == 0:
        return a
    while a != b:
        if a > b:
            a >>= 1
        else:
            b >>= 1
    return a


@kernel
def node_parts(cell_nodes, leaf, depth, n):  # type: ignore[no-untyped-def]
    """Lowest part that holds all cells of each node `(n,)`."""
    part = np.zeros(n, dtype=np.int64)
    for c in range(len(cell_nodes)):
        leaf_number = leaf[c] + (1 << depth)
        for j in range(cell_nodes.shape[1]):
            node = cell_nodes[c, j]
            part[node] = _ancestor(part[node], leaf_number)
    return part


@kernel
def column_parts(indptr, indices, n_columns, owner, d, part):  # type: ignore[no-untyped-def]
    """Lowest part that holds the support of each column of a basis.

    Parameters
    ----------
    indptr, indices : arrays
        Rows of the basis, CSR.
    n_columns : int
    owner : (n_functions,) array of int
        Node of each function; unknown i belongs to function i // d.
    d : int
    part : (n_nodes,) array of int

    Returns
    -------
    (n_columns,) array of int
    """
    result = np.zeros(n_columns, dtype=np.int64)
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            result[indices[k]] = _ancestor(result[indices[k]], part[owner[i // d]])
    for column in range(n_columns):
        result[column] = max(result[column], 1)
    return result


@kernel
def postorder(depth):  # type: ignore[no-untyped-def]
    """Parts in the order children before parents, and the place of each part in it."""
    count = (1 << (depth + 1)) - 1
    order, rank = np.empty(count, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    # The subtree of a part with h levels below it takes 2^(h + 1) - 1 places, its own last.
    begin = np.zeros(count + 1, dtype=np.int64)
    below = depth
    for p in range(1, count + 1):
        if p >= (2 << (depth - below)):
            below -= 1
        rank[p] = begin[p] + (2 << below) - 2
        order[rank[p]] = p
        if below > 0:
            begin[2 * p] = begin[p]
            begin[2 * p + 1] = begin[p] + (1 << below) - 1
    return order, rank


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
