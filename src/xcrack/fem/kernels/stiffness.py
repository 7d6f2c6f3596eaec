"""Element stiffness summed into blocks: of plain cells, and of functions tabulated at points."""

import math

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.blas import dsyrk
from xcrack.base.kernels.jit import kernel


@kernel
def block_pattern(nodes, n_nodes):  # type: ignore[no-untyped-def]
    """Pattern of node blocks and the slot of each cell's pairs in it.

    Parameters
    ----------
    nodes : (m, n) array of int
        Nodes of each cell.
    n_nodes : int

    Returns
    -------
    indptr : (n_nodes + 1,) array of int32
    indices : (k,) array of int32
        Sorted in each row.
    slot : (m, n, n) array of int32
    """
    m, n = nodes.shape
    count = zeros(n_nodes + 1, np.int64)
    for e in range(m):
        for a in range(n):
            count[nodes[e, a] + 1] += 1
    for i in range(n_nodes):
        count[i + 1] += count[i]
    cells_around = empty(count[n_nodes], np.int64)
    place, mark = empty(n_nodes, np.int64), empty(n_nodes, np.int64)
    for i in range(n_nodes):
        place[i], mark[i] = count[i], -1
    for e in range(m):
        for a in range(n):
            node = nodes[e, a]
            cells_around[place[node]] = e
            place[node] += 1
    indptr = zeros(n_nodes + 1, np.int32)
    for i in range(n_nodes):
        entries = 0
        for k in range(count[i], count[i + 1]):
            e = cells_around[k]
            for a in range(n):
                if mark[nodes[e, a]] != i:
                    mark[nodes[e, a]] = i
                    entries += 1
        indptr[i + 1] = indptr[i] + entries
        place[i] = indptr[i]
    # The pattern is symmetric: nodes that go to their neighbours in turn fill sorted rows.
    indices = empty(indptr[n_nodes], np.int32)
    for i in range(n_nodes):
        for k in range(count[i], count[i + 1]):
            e = cells_around[k]
            for a in range(n):
                node = nodes[e, a]
                if mark[node] != n_nodes + i:
                    mark[node] = n_nodes + i
                    indices[place[node]] = i
                    place[node] += 1
    slot = empty((m, n, n), np.int32)
    for e in range(m):
        for a in range(n):
            i = nodes[e, a]
            for b in range(n):
                begin, end = indptr[i], indptr[i + 1] - 1
                node = nodes[e, b]
                while begin < end:
                    middle = (begin + end) // 2
                    if indices[middle] < node:
                        begin = middle + 1
                    else:
                        end = middle
                slot[e, a, b] = begin
    return indptr, indices, slot


@kernel
def _add_remainder(data, start, stop, slot, weight, G, remainder):  # type: ignore[no-untyped-def]
    """Add what a stiffness that is not isotropic has besides, at one point of a cell."""
    n, d = G.shape
    half_product = empty((d, d, d))
    for a in range(n):
        if not start <= slot[a, 0] < stop:
            continue
        for i in range(d):
            for j in range(d):
                for p in range(d):
                    total = 0.0
                    for k in range(d):
                        total += remainder[i, k, j, p] * G[a, k]
                    half_product[i, j, p] = weight * total
        for b in range(n):
            block = data[slot[a, b]]
            for i in range(d):
                for j in range(d):
                    for p in range(d):
                        block[i, j] += half_product[i, j, p] * G[b, p]


@kernel
def add_block_stiffness(  # type: ignore[no-untyped-def]
    data, start, stop, cells, slot, gradient, volume, derivative, bary, weight, factor, lam, mu,
    remainder,
):  # fmt: skip
    """Add the elastic stiffness of plain cells of one material to some rows of node blocks.

    Parameters
    ----------
    data : (n_blocks, d, d) array
        Changed in place.
    low, high : int
        Blocks of the rows: from one to before the other.
    cells : (k,) array of int
    slot : (m, n, n) array of int
    gradient : (m, d + 1, d) array
        Gradients of the barycentric coordinates.
    volume : (m,) array
    derivative : (q, n, d + 1) array
        Shape derivatives at the integration points.
    bary, weight : (q, d + 1) array and (q,) array
    factor : (m, d + 1) array or None
        By which the stiffness counts at the corners, linear between. None is compiled for itself.
    lam, mu : float
    remainder : (d, d, d, d) array or None
        Stiffness besides. None is compiled for itself: isotropic bodies pay nothing.
    """
    n, d = slot.shape[1], gradient.shape[2]
    G = empty((n, d))
    P_modulus = lam + 2.0 * mu
    for e in cells:
        is_touched = False
        for a in range(n):
            is_touched |= start <= slot[e, a, 0] < stop
        if not is_touched:
            continue
        for q in range(len(weight)):
            w = weight[q] * volume[e]
            if factor is not None:
                at_point = 0.0
                for k in range(d + 1):
                    at_point += bary[q, k] * factor[e, k]
                w *= at_point
            for a in range(n):
                for i in range(d):
                    total = 0.0
                    for k in range(d + 1):
                        total += derivative[q, a, k] * gradient[e, k, i]
                    G[a, i] = total
            if remainder is not None:
                _add_remainder(data, start, stop, slot[e], w, G, remainder)
            if d == 2:  # written out: two thirds of the time
                for a in range(n):
                    if not start <= slot[e, a, 0] < stop:
                        continue
                    ax, ay = w * G[a, 0], w * G[a, 1]
                    for b in range(n):
                        k = slot[e, a, b]
                        bx, by = G[b, 0], G[b, 1]
                        xx, yy, xy, yx = ax * bx, ay * by, ax * by, ay * bx
                        data[k, 0, 0] += P_modulus * xx + mu * yy
                        data[k, 0, 1] += lam * xy + mu * yx
                        data[k, 1, 0] += lam * yx + mu * xy
                        data[k, 1, 1] += P_modulus * yy + mu * xx
                continue
            for a in range(n):
                if not start <= slot[e, a, 0] < stop:
                    continue
                for b in range(n):
                    block = data[slot[e, a, b]]
                    dot = 0.0
                    for i in range(d):
                        dot += G[a, i] * G[b, i]
                    dot *= w * mu
                    for i in range(d):
                        for j in range(d):
                            block[i, j] += w * (lam * G[a, i] * G[b, j] + mu * G[a, j] * G[b, i])
                        block[i, i] += dot


@kernel
def joined_blocks(  # type: ignore[no-untyped-def]
    indptr, indices, data, over_indptr, over_indices, over_data, chosen_rows
):
    """Sum of two matrices of blocks of which no block is in both, without its zeros.

    Parameters
    ----------
    indptr, indices, data : BSR arrays, (m, m) blocks
        Sorted.
    over_indptr, over_indices, over_data : BSR arrays, (n, n) blocks, n >= m
        Sorted; in the first m rows its columns come after those of the other.
    chosen_rows : (n,) array of bool
        Rows of blocks to take.

    Returns
    -------
    indptr, indices, data : CSR arrays
        Sorted, int32.
    """
    m, n, d = len(indptr) - 1, len(over_indptr) - 1, data.shape[1]
    start = zeros(n * d + 1, np.int32)
    for i in range(n):
        for a in range(d):
            count = 0
            if i < m and chosen_rows[i]:
                for k in range(indptr[i], indptr[i + 1]):
                    for b in range(d):
                        count += data[k, a, b] != 0.0
            if chosen_rows[i]:
                for k in range(over_indptr[i], over_indptr[i + 1]):
                    for b in range(d):
                        count += over_data[k, a, b] != 0.0
            start[i * d + a + 1] = start[i * d + a] + count
    column, value = empty(start[n * d], np.int32), empty(start[n * d])
    for i in range(n):
        if not chosen_rows[i]:
            continue
        for a in range(d):
            to = start[i * d + a]
            if i < m:
                for k in range(indptr[i], indptr[i + 1]):
                    for b in range(d):
                        if data[k, a, b] != 0.0:
                            column[to], value[to] = indices[k] * d + b, data[k, a, b]
                            to += 1
            for k in range(over_indptr[i], over_indptr[i + 1]):
                for b in range(d):
                    if over_data[k, a, b] != 0.0:
                        column[to], value[to] = over_indices[k] * d + b, over_data[k, a, b]
                        to += 1
    return start, column, value


@kernel
def add_block_product(indptr, indices, data, x, result):  # type: ignore[no-untyped-def]
    """Add A x to a result.

    Parameters
    ----------
    indptr, indices, data : BSR arrays of A, (n, m) blocks (d, d)
    x : (>= m d, k) array
    result : (>= n d, k) array
        Changed in place.
    """
    d = data.shape[1]
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            for a in range(d):
                for b in range(d):
                    value = data[k, a, b]
                    for c in range(x.shape[1]):
                        result[i * d + a, c] += value * x[indices[k] * d + b, c]


@kernel
def enriched_pattern(functions, n_functions, n_standard):  # type: ignore[no-untyped-def]
    """Pattern of the blocks of function pairs of which one is enriched.

    Parameters
    ----------
    functions : (m, n) array of int
        Function numbers, -1 for an empty place; below n_standard: standard functions.
    n_functions, n_standard : int

    Returns
    -------
    indptr : (n_functions + 1,) array of int64
    indices : (k,) array of int32
        Sorted in each row.
    """
    m, n = functions.shape
    count = zeros(n_functions + 1, np.int64)
    for e in range(m):
        for a in range(n):
            if functions[e, a] >= 0:
                count[functions[e, a] + 1] += 1
    for i in range(n_functions):
        count[i + 1] += count[i]
    cells_around = empty(count[n_functions], np.int64)
    place, mark = empty(n_functions, np.int64), empty(n_functions, np.int64)
    for i in range(n_functions):
        place[i], mark[i] = count[i], -1
    for e in range(m):
        for a in range(n):
            f = functions[e, a]
            if f >= 0:
                cells_around[place[f]] = e
                place[f] += 1
    indptr = zeros(n_functions + 1, np.int64)
    for i in range(n_functions):
        entries = 0
        for k in range(count[i], count[i + 1]):
            e = cells_around[k]
            for a in range(n):
                f = functions[e, a]
                if f >= 0 and (f >= n_standard or i >= n_standard) and mark[f] != i:
                    mark[f] = i
                    entries += 1
        indptr[i + 1] = indptr[i] + entries
        place[i] = indptr[i]
    # The pattern is symmetric: functions that go to their neighbours in turn fill sorted rows.
    indices = empty(indptr[n_functions], np.int32)
    for i in range(n_functions):
        for k in range(count[i], count[i + 1]):
            e = cells_around[k]
            for a in range(n):
                f = functions[e, a]
                if f >= 0 and (f >= n_standard or i >= n_standard) and mark[f] != n_functions + i:
                    mark[f] = n_functions + i
                    indices[place[f]] = i
                    place[f] += 1
    return indptr, indices


@kernel
def _slot(indptr, indices, row, column):  # type: ignore[no-untyped-def]
    begin, end = indptr[row], indptr[row + 1] - 1
    while begin < end:
        middle = (begin + end) // 2
        if indices[middle] < column:
            begin = middle + 1
        else:
            end = middle
    return begin


@kernel
def _set_active_places(functions, n_standard, place):  # type: ignore[no-untyped-def]
    """Set the places of the functions of a cell; their number, and that of standard ones."""
    n_active, n_std = 0, 0  # standard functions come first
    for a in range(len(functions)):
        if functions[a] >= 0:
            place[n_active] = a
            n_active += 1
            if functions[a] < n_standard:
                n_std = n_active
    return n_active, n_std


@kernel
def _products(begin, end, weight, gradient, place, n_active, n_std, row, block):  # type: ignore[no-untyped-def]
    """Integrals of G_ai G_bj over the points of a cell, b >= a, b enriched."""
    d = gradient.shape[2]
    for k in range(n_active * d):
        for j in range(n_active * d):
            block[k, j] = 0.0
    for q in range(begin, end):
        for a in range(n_active):
            for i in range(d):
                row[a * d + i] = gradient[q, place[a], i]
        for a in range(n_active):
            start = d * max(a, n_std)
            for i in range(d):
                factor = weight[q] * row[a * d + i]
                line = block[a * d + i]
                for k in range(start, n_active * d):
                    line[k] += factor * row[k]


@kernel
def _products_by_blas(begin, end, weight, gradient, place, n_active, rows, block):  # type: ignore[no-untyped-def]
    """The same products as those of rows of gradients times the root of the weight, by dsyrk."""
    d, width = gradient.shape[2], block.shape[1]
    k = n_active * d
    for q in range(begin, end):
        root, at = math.sqrt(weight[q]), (q - begin) * k
        for a in range(n_active):
            for i in range(d):
                rows[at + a * d + i] = root * gradient[q, place[a], i]
    size, factors, letter = empty(3, np.int32), empty(2), empty(2, np.uint8)
    size[0], size[1], size[2] = k, end - begin, width
    factors[0], factors[1] = 1.0, 0.0
    letter[0], letter[1] = 76, 78  # L N
    integer, factor_pointer, text = size.ctypes.data, factors.ctypes.data, letter.ctypes.data
    dsyrk(
        text,
        text + 1,
        integer,
        integer + 4,
        factor_pointer,
        rows.ctypes.data,
        integer,
        factor_pointer + 8,
        block.ctypes.data,
        integer + 8,
    )
    for a in range(n_active):
        for i in range(d):
            for j in range(i):
                block[a * d + i, a * d + j] = block[a * d + j, a * d + i]
    return size[0] + letter[0] + factors[0]  # addresses alone keep no array alive


@kernel
def _scatter(  # type: ignore[no-untyped-def]
    data, indptr, indices, functions, place, at, n_active, n_std, block, lam, mu, remainder
):
    """Add the stiffness that follows from the products of a cell, in which functions stand `at`."""
    d = data.shape[1]
    for a in range(n_active):
        fa, k = functions[place[a]], at[a] * d
        for b in range(max(a, n_std), n_active):
            fb, m = functions[place[b]], at[b] * d
            slot_ab, slot_ba = _slot(indptr, indices, fa, fb), _slot(indptr, indices, fb, fa)
            trace = 0.0
            for i in range(d):
                trace += block[k + i, m + i]
            for i in range(d):
                for j in range(d):
                    v = lam * block[k + i, m + j] + mu * block[k + j, m + i]
                    if i == j:
                        v += mu * trace
                    if remainder is not None:
                        for p in range(d):
                            for q in range(d):
                                v += remainder[i, p, j, q] * block[k + p, m + q]
                    data[slot_ab, i, j] += v
                    if a != b:
                        data[slot_ba, j, i] += v


@kernel
def add_stiffness(  # type: ignore[no-untyped-def]
    data, indptr, indices, functions, offsets, weight, gradient, n_standard, lam, mu, remainder
):
    """Add the elastic stiffness of cells with enriched functions.

    Entry of functions a, b and components i, j: the integral of
    lam G_ai G_bj + mu G_aj G_bi + mu delta_ij G_a . G_b, and remainder_ikjl G_ak G_bl.

    Parameters
    ----------
    data : (k, d, d) array
        Changed in place.
    indptr, indices : pattern of the blocks
    functions : (m, n) array of int
        Function numbers, -1 for an empty place; below n_standard: standard functions.
    offsets : (m + 1,) array of int
        Points of each cell.
    weight : (q,) array
    gradient : (q, n, d) array
    n_standard : int
    lam, mu : float
        Lamé constants.
    remainder : (d, d, d, d) array or None
        Stiffness besides. None is compiled for itself: isotropic bodies pay nothing.
    """
    m, n = functions.shape
    d = gradient.shape[2]
    place, at = empty(n, np.int64), empty(n, np.int64)
    block, row = zeros((n * d, n * d)), empty(n * d)
    for a in range(n):
        at[a] = a
    most_points = 0
    for e in range(m):
        most_points = max(most_points, offsets[e + 1] - offsets[e])
    rows = empty(most_points * n * d)
    for e in range(m):
        n_active, n_std = _set_active_places(functions[e], n_standard, place)
        begin, end = offsets[e], offsets[e + 1]
        least_weight = 0.0
        for q in range(begin, end):
            least_weight = min(least_weight, weight[q])
        if least_weight < 0.0:
            _products(begin, end, weight, gradient, place, n_active, n_std, row, block)
        else:
            _products_by_blas(begin, end, weight, gradient, place, n_active, rows, block)
        _scatter(
            data,
            indptr,
            indices,
            functions[e],
            place,
            at,
            n_active,
            n_std,
            block,
            lam,
            mu,
            remainder,
        )


@kernel
def gradient_products(offsets, weight, gradient, n_std):  # type: ignore[no-untyped-def]
    """Integrals of G_ai G_bj in cells, from which their stiffness follows for any material.

    Parameters
    ----------
    offsets : (m + 1,) array of int
        Points of each cell.
    weight : (q,) array
    gradient : (q, n, d) array
    n_std : int
        Leading functions that are standard ones: their products are left out.

    Returns
    -------
    (m, n d, n d) array
        Zero where b < a.
    """
    n, d, m = gradient.shape[1], gradient.shape[2], len(offsets) - 1
    place, row = empty(n, np.int64), empty(n * d)
    for a in range(n):
        place[a] = a
    result = empty((m, n * d, n * d))
    for e in range(m):
        _products(offsets[e], offsets[e + 1], weight, gradient, place, n, n_std, row, result[e])
    return result


@kernel
def add_products(  # type: ignore[no-untyped-def]
    data, indptr, indices, functions, products, n_standard, lam, mu, remainder
):
    """Add the stiffness of cells whose products are known.

    Parameters
    ----------
    data, indptr, indices, functions, n_standard, lam, mu, remainder : as of `add_stiffness`
    products : (m, n d, n d) array
        As of `gradient_products`.
    """
    m, n = functions.shape
    place = empty(n, np.int64)
    for e in range(m):
        n_active, n_std = _set_active_places(functions[e], n_standard, place)
        block = products[e]
        _scatter(
            data, indptr, indices, functions[e], place, place, n_active, n_std, block, lam, mu,
            remainder,
        )  # fmt: skip
