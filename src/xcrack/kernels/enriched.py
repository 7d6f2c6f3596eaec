"""Element stiffness from functions tabulated at integration points, summed into blocks."""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
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
    count = np.zeros(n_functions + 1, np.int64)
    for e in range(m):
        for a in range(n):
            if functions[e, a] >= 0:
                count[functions[e, a] + 1] += 1
    for i in range(n_functions):
        count[i + 1] += count[i]
    around = np.empty(count[n_functions], np.int64)
    fill = count[:-1].copy()
    for e in range(m):
        for a in range(n):
            f = functions[e, a]
            if f >= 0:
                around[fill[f]] = e
                fill[f] += 1
    mark = np.full(n_functions, -1, np.int64)
    indptr = np.zeros(n_functions + 1, np.int64)
    for i in range(n_functions):
        found = 0
        for k in range(count[i], count[i + 1]):
            e = around[k]
            for a in range(n):
                f = functions[e, a]
                if f >= 0 and (f >= n_standard or i >= n_standard) and mark[f] != i:
                    mark[f] = i
                    found += 1
        indptr[i + 1] = indptr[i] + found
    # The pattern is symmetric: functions that go to their neighbours in turn fill sorted rows.
    indices = np.empty(indptr[n_functions], np.int32)
    place = indptr[:-1].copy()
    for i in range(n_functions):
        for k in range(count[i], count[i + 1]):
            e = around[k]
            for a in range(n):
                f = functions[e, a]
                if f >= 0 and (f >= n_standard or i >= n_standard) and mark[f] != n_functions + i:
                    mark[f] = n_functions + i
                    indices[place[f]] = i
                    place[f] += 1
    return indptr, indices


@numba.njit(cache=True, error_model="numpy")
def _slot(indptr, indices, row, column):  # type: ignore[no-untyped-def]
    low, high = indptr[row], indptr[row + 1] - 1
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(  # type: ignore[no-untyped-def]
    data, indptr, indices, functions, offsets, weight, gradient, n_standard, lam, mu
):
    """Add the elastic stiffness of cells with enriched functions.

    Entry of functions a, b and components i, j: the integral of
    lam G_ai G_bj + mu G_aj G_bi + mu delta_ij G_a . G_b.

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
    """
    m, n = functions.shape
    d = gradient.shape[2]
    place = np.empty(n, np.int64)
    block = np.zeros((n * d, n * d))
    row = np.empty(n * d)
    for e in range(m):
        active = 0
        plain = 0  # standard functions come first
        for a in range(n):
            if functions[e, a] >= 0:
                place[active] = a
                active += 1
                if functions[e, a] < n_standard:
                    plain = active
        for k in range(active * d):
            for j in range(active * d):
                block[k, j] = 0.0
        for q in range(offsets[e], offsets[e + 1]):
            for a in range(active):
                for i in range(d):
                    row[a * d + i] = gradient[q, place[a], i]
            for a in range(active):
                start = d * max(a, plain)
                for i in range(d):
                    scaled = weight[q] * row[a * d + i]
                    line = block[a * d + i]
                    for k in range(start, active * d):
                        line[k] += scaled * row[k]
        for a in range(active):
            fa = functions[e, place[a]]
            for b in range(max(a, plain), active):
                fb = functions[e, place[b]]
                trace = 0.0
                for i in range(d):
                    trace += block[a * d + i, b * d + i]
                one = data[_slot(indptr, indices, fa, fb)]
                other = data[_slot(indptr, indices, fb, fa)]
                for i in range(d):
                    for j in range(d):
                        v = lam * block[a * d + i, b * d + j] + mu * block[a * d + j, b * d + i]
                        if i == j:
                            v += mu * trace
                        one[i, j] += v
                        if a != b:
                            other[j, i] += v
