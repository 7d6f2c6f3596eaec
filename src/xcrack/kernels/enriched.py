"""Element stiffness from functions tabulated at integration points."""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def stiffness_triplets(functions, offsets, weight, gradient, n_standard, lam, mu):  # type: ignore[no-untyped-def]
    """Entries of the elastic stiffness that involve an enriched function.

    Entry of functions a, b and components i, j: the integral of
    lam G_ai G_bj + mu G_aj G_bi + mu delta_ij G_a . G_b.

    Parameters
    ----------
    functions : (m, n) array of int
        Function numbers, -1 for an empty place; below n_standard: standard functions.
    offsets : (m + 1,) array of int
        Points of each cell.
    weight : (q,) array
    gradient : (q, n, d) array
    n_standard : int
    lam, mu : float
        Lamé constants.

    Returns
    -------
    row, column : (t,) arrays of int
    value : (t,) array
    """
    m, n = functions.shape
    d = gradient.shape[2]
    total = 0
    for e in range(m):
        standard = 0
        active = 0
        for a in range(n):
            if functions[e, a] >= 0:
                active += 1
                if functions[e, a] < n_standard:
                    standard += 1
        total += (active * active - standard * standard) * d * d
    row = np.empty(total, np.int64)
    column = np.empty(total, np.int64)
    value = np.empty(total)
    place = np.empty(n, np.int64)
    t = 0
    for e in range(m):
        active = 0
        for a in range(n):
            if functions[e, a] >= 0:
                place[active] = a
                active += 1
        first, last = offsets[e], offsets[e + 1]
        block = np.zeros((active, active, d, d))
        for q in range(first, last):
            w = weight[q]
            for a in range(active):
                pa = place[a]
                for b in range(a, active):
                    if functions[e, place[b]] < n_standard:
                        continue
                    pb = place[b]
                    for i in range(d):
                        gai = w * gradient[q, pa, i]
                        for j in range(d):
                            block[a, b, i, j] += gai * gradient[q, pb, j]
        for a in range(active):
            fa = functions[e, place[a]]
            for b in range(a, active):
                fb = functions[e, place[b]]
                if fa < n_standard and fb < n_standard:
                    continue
                trace = 0.0
                for i in range(d):
                    trace += block[a, b, i, i]
                for i in range(d):
                    for j in range(d):
                        v = lam * block[a, b, i, j] + mu * block[a, b, j, i]
                        if i == j:
                            v += mu * trace
                        row[t] = fa * d + i
                        column[t] = fb * d + j
                        value[t] = v
                        t += 1
                        if a != b:
                            row[t] = fb * d + j
                            column[t] = fa * d + i
                            value[t] = v
                            t += 1
    return row, column, value
