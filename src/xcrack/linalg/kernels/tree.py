"""The tree that a mesh gives to a factorisation: cells bisected, unknowns at common ancestors.

Parts are numbered as in a heap: 1 is the whole body, 2 p and 2 p + 1 are the halves of p.
"""

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
