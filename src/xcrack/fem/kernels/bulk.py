"""Sparsity pattern and stiffness of plain cells."""

import numpy as np

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
    count = np.zeros(n_nodes + 1, np.int64)
    for e in range(m):
        for a in range(n):
            count[nodes[e, a] + 1] += 1
    for i in range(n_nodes):
        count[i + 1] += count[i]
    around = np.empty(count[n_nodes], np.int64)
    place, mark = np.empty(n_nodes, np.int64), np.empty(n_nodes, np.int64)
    for i in range(n_nodes):
        place[i], mark[i] = count[i], -1
    for e in range(m):
        for a in range(n):
            node = nodes[e, a]
            around[place[node]] = e
            place[node] += 1
    indptr = np.zeros(n_nodes + 1, np.int32)
    for i in range(n_nodes):
        entries = 0
        for k in range(count[i], count[i + 1]):
            e = around[k]
            for a in range(n):
                if mark[nodes[e, a]] != i:
                    mark[nodes[e, a]] = i
                    entries += 1
        indptr[i + 1] = indptr[i] + entries
        place[i] = indptr[i]
    # The pattern is symmetric: nodes that go to their neighbours in turn fill sorted rows.
    indices = np.empty(indptr[n_nodes], np.int32)
    for i in range(n_nodes):
        for k in range(count[i], count[i + 1]):
            e = around[k]
            for a in range(n):
                node = nodes[e, a]
                if mark[node] != n_nodes + i:
                    mark[node] = n_nodes + i
                    indices[place[node]] = i
                    place[node] += 1
    slot = np.empty((m, n, n), np.int32)
    for e in range(m):
        for a in range(n):
            i = nodes[e, a]
            for b in range(n):
                low, high = indptr[i], indptr[i + 1] - 1
                node = nodes[e, b]
                while low < high:
                    middle = (low + high) // 2
                    if indices[middle] < node:
                        low = middle + 1
                    else:
                        high = middle
                slot[e, a, b] = low
    return indptr, indices, slot


@kernel
def _add_remainder(data, slot, weight, G, remainder):  # type: ignore[no-untyped-def]
    """Add what a stiffness that is not isotropic has besides, at one point of a cell."""
    n, d = G.shape
    half_product = np.empty((d, d, d))
    for a in range(n):
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
def block_stiffness(  # type: ignore[no-untyped-def]
    slot, n_blocks, gradient, volume, derivative, weight, lam, mu, remainder
):
    """Elastic stiffness of plain cells, summed into node blocks.

    Parameters
    ----------
    slot : (m, n, n) array of int
    n_blocks : int
    gradient : (m, d + 1, d) array
        Gradients of the barycentric coordinates.
    volume : (m,) array
    derivative : (q, n, d + 1) array
        Shape derivatives at the integration points.
    weight : (q,) array
    lam, mu : float
    remainder : (d, d, d, d) array or None
        Stiffness besides. None is compiled for itself: isotropic bodies pay nothing.

    Returns
    -------
    (n_blocks, d, d) array
    """
    m, n, _ = slot.shape
    d = gradient.shape[2]
    data = np.zeros((n_blocks, d, d))
    G = np.empty((n, d))
    both = lam + 2.0 * mu
    for e in range(m):
        for q in range(len(weight)):
            w = weight[q] * volume[e]
            for a in range(n):
                for i in range(d):
                    total = 0.0
                    for k in range(d + 1):
                        total += derivative[q, a, k] * gradient[e, k, i]
                    G[a, i] = total
            if remainder is not None:
                _add_remainder(data, slot[e], w, G, remainder)
            if d == 2:  # written out: two thirds of the time
                for a in range(n):
                    ax, ay = w * G[a, 0], w * G[a, 1]
                    for b in range(n):
                        k = slot[e, a, b]
                        bx, by = G[b, 0], G[b, 1]
                        xx, yy, xy, yx = ax * bx, ay * by, ax * by, ay * bx
                        data[k, 0, 0] += both * xx + mu * yy
                        data[k, 0, 1] += lam * xy + mu * yx
                        data[k, 1, 0] += lam * yx + mu * xy
                        data[k, 1, 1] += both * yy + mu * xx
                continue
            for a in range(n):
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
    return data


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
    start = np.zeros(n * d + 1, np.int32)
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
    column, value = np.empty(start[n * d], np.int32), np.empty(start[n * d])
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
