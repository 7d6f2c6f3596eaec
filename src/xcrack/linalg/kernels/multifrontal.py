"""Numerical half of a multifrontal Cholesky factorisation, on scipy's BLAS and LAPACK.

A part assembles its entries and the update matrices of its two children into a dense front, factors
its own columns, and hands the rest to its parent (Duff and Reid, 1983). Panels hold pivots and the
rows below them, column by column; update matrices the lower triangle, packed. BLAS is called by
address, with one thread: sums in another order would have other last bits.
"""

import numba
import numpy as np

from xcrack.base.kernels.blas import dgemm, dgemv, doubles_at, dpotrf, dsyrk, dtrsm, dtrsv
from xcrack.base.kernels.jit import kernel

_SMALL = 24  # rows of a front below which plain loops are quicker than calls of BLAS


@kernel
def _factored_by_loops(F, m, k):  # type: ignore[no-untyped-def]
    """Factor the first k columns of a front `(m, m)` and update the others; columns that failed."""
    for j in range(k):
        pivot = F[j * m + j]
        if not pivot > 0.0:
            return 1
        d = np.sqrt(pivot)
        F[j * m + j] = d
        for i in range(j + 1, m):
            F[j * m + i] /= d
        for c in range(j + 1, m):
            f = F[j * m + c]
            if f != 0.0:
                for i in range(c, m):
                    F[c * m + i] -= f * F[j * m + i]
    return 0


@kernel
def factor_parts(fronts, panel, update, chosen_parts, low_part, high_part):  # type: ignore[no-untyped-def]
    """Factor parts of a tree, and hand their updates upwards.

    Parameters
    ----------
    fronts : tuple of arrays
        first, begin, in_parent, start, row, value, order, rank of `fronts.arranged`.
    panel, update : (parts,) arrays of uint64
        Addresses of the panel and of the update matrix of each part; they are written to.
    chosen_parts : (parts,) array of bool
        Parts to factor; the panels and update matrices of others are there.
    low_part, high_part : int
        Range of parts in postorder.

    Returns
    -------
    int
        1 where a pivot is not positive, else 0.
    """
    first, begin, in_parent, start, row, value, order, rank = fronts
    parts = len(order)
    largest = 0
    for t in range(low_part, high_part):
        largest = max(largest, first[t + 1] - first[t] + begin[t + 1] - begin[t])
    F = np.empty(largest * largest)
    size, scalar, letter = np.empty(4, np.int32), np.empty(2), np.empty(4, np.uint8)
    scalar[0], scalar[1] = 1.0, -1.0
    letter[0], letter[1], letter[2], letter[3] = 76, 78, 84, 82  # L N T R
    lower, plain = letter.ctypes.data, letter.ctypes.data + 1
    transposed, right = lower + 2, lower + 3
    one, minus = scalar.ctypes.data, scalar.ctypes.data + 8
    rows, pivots, rest, info = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    for t in range(low_part, high_part):
        if not chosen_parts[t]:
            continue
        low = first[t]
        k, b = first[t + 1] - low, begin[t + 1] - begin[t]
        m = k + b
        for j in range(m):
            for i in range(j, m):
                F[j * m + i] = 0.0
        for j in range(k):
            for e in range(start[low + j], start[low + j + 1]):
                F[j * m + row[e]] = value[e]
        p = order[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                at, end, source = begin[child], begin[child + 1], 0
                below = end - at
                W = numba.carray(doubles_at(update[child]), (below * (below + 1) // 2,))
                for j in range(at, end):
                    column = in_parent[j] * m
                    for i in range(j, end):
                        F[column + in_parent[i]] += W[source]
                        source += 1
        if k > 0:
            if m <= _SMALL:
                if _factored_by_loops(F, m, k) != 0:
                    return 1
            else:
                size[0], size[1], size[2] = m, k, b
                front = F.ctypes.data
                dpotrf(lower, pivots, front, rows, info)
                if size[3] != 0:
                    return 1
                if b > 0:
                    panel21 = front + 8 * k
                    dtrsm(
                        right, lower, transposed, plain, rest, pivots, one, front, rows, panel21,
                        rows,
                    )  # fmt: skip
                    dsyrk(
                        lower, plain, rest, pivots, minus, panel21, rows, one,
                        front + 8 * (k * m + k), rows,
                    )  # fmt: skip
            L = numba.carray(doubles_at(panel[t]), (k * m,))
            for j in range(k):
                for i in range(j, m):
                    L[j * m + i] = F[j * m + i]
        W = numba.carray(doubles_at(update[t]), (b * (b + 1) // 2,))
        to = 0
        for j in range(k, m):
            for i in range(j, m):
                W[to] = F[j * m + i]
                to += 1
    # Addresses alone keep no array alive: numba frees it after its last use.
    return 0 if letter[0] == 76 and scalar[0] == 1.0 else 2


@kernel
def copy_stretches(source, target, count):  # type: ignore[no-untyped-def]
    """Copy stretches of numbers from address to address."""
    for t in range(len(count)):
        if count[t] > 0:
            one = numba.carray(doubles_at(source[t]), (count[t],))
            other = numba.carray(doubles_at(target[t]), (count[t],))
            for i in range(count[t]):
                other[i] = one[i]


@kernel
def substituted_one(first, begin, boundary, panel, x, forward, backward):  # type: ignore[no-untyped-def]
    """Solve for one right-hand side `(n,)`, in place; see `substitute`."""
    parts, largest = len(first) - 1, 1
    for t in range(parts):
        largest = max(largest, begin[t + 1] - begin[t])
    B = np.empty(largest)
    size, scalar, letter = np.empty(4, np.int32), np.empty(3), np.empty(3, np.uint8)
    size[3] = 1
    scalar[0], scalar[1], scalar[2] = 1.0, -1.0, 0.0
    letter[0], letter[1], letter[2] = 76, 78, 84  # L N T
    lower, plain, transposed = letter.ctypes.data, letter.ctypes.data + 1, letter.ctypes.data + 2
    one, minus, zero = scalar.ctypes.data, scalar.ctypes.data + 8, scalar.ctypes.data + 16
    pivots, rows, rest, step = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    x0, b0 = x.ctypes.data, B.ctypes.data
    for t in range(parts if forward else 0):
        low, q = first[t], begin[t]
        k, b = first[t + 1] - low, begin[t + 1] - q
        if k == 0:
            continue
        size[0], size[1], size[2] = k, k + b, b
        dtrsv(lower, plain, plain, pivots, panel[t], rows, x0 + 8 * low, step)
        if b > 0:
            dgemv(
                plain,
                rest,
                pivots,
                one,
                panel[t] + np.uint64(8 * k),
                rows,
                x0 + 8 * low,
                step,
                zero,
                b0,
                step,
            )
            for i in range(b):
                x[boundary[q + i]] -= B[i]
    for t in range(parts - 1 if backward else -1, -1, -1):
        low, q = first[t], begin[t]
        k, b = first[t + 1] - low, begin[t + 1] - q
        if k == 0:
            continue
        size[0], size[1], size[2] = k, k + b, b
        if b > 0:
            for i in range(b):
                B[i] = x[boundary[q + i]]
            dgemv(
                transposed,
                rest,
                pivots,
                minus,
                panel[t] + np.uint64(8 * k),
                rows,
                b0,
                step,
                one,
                x0 + 8 * low,
                step,
            )
        dtrsv(lower, transposed, plain, pivots, panel[t], rows, x0 + 8 * low, step)
    return letter[0] == 76 and scalar[0] == 1.0  # which keeps both alive until here


@kernel
def substitute(first, begin, boundary, order, rank, panel, X, touched, forward, backward):  # type: ignore[no-untyped-def]
    """Solve with the factor, in place.

    Parameters
    ----------
    first, begin, boundary, order, rank, panel : arrays
        Of the factor.
    X : (n, r) array
        Right-hand sides in permuted order.
    touched : (parts,) array of bool
        Parts whose rows of the right-hand sides are not zero; ancestors are added in the forward
        half, and all parts count in the backward one.
    forward, backward : bool
        Halves to do: L^-1 X, and L^-T of that.
    """
    parts, r = len(order), X.shape[1]
    size, scalar, letter = np.empty(4, np.int32), np.empty(3), np.empty(4, np.uint8)
    scalar[0], scalar[1], scalar[2] = 1.0, -1.0, 0.0
    letter[0], letter[1], letter[2], letter[3] = 76, 78, 84, 82
    lower, plain = letter.ctypes.data, letter.ctypes.data + 1
    transposed, right = lower + 2, lower + 3
    one, minus, zero = scalar.ctypes.data, scalar.ctypes.data + 8, scalar.ctypes.data + 16
    columns, pivots, rows, rest = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    largest = 1
    for t in range(parts):
        largest = max(largest, begin[t + 1] - begin[t])
    B = np.empty((largest, r))
    size[0] = r
    x0, b0 = X.ctypes.data, B.ctypes.data
    if forward:
        for t in range(parts):
            if not touched[t]:
                continue
            p = order[t]
            if p > 1:
                touched[rank[p >> 1]] = True
            low, at, q = first[t], panel[t], begin[t]
            k, b = first[t + 1] - low, begin[t + 1] - q
            m = k + b
            if k == 0:
                continue
            size[1], size[2], size[3] = k, m, b
            # Rows of X, (k, r) in C order, are a matrix (r, k) by columns: X <- X L^-T.
            dtrsm(
                right,
                lower,
                transposed,
                plain,
                columns,
                pivots,
                one,
                at,
                rows,
                x0 + 8 * low * r,
                columns,
            )
            if b > 0:
                dgemm(
                    plain,
                    transposed,
                    columns,
                    rest,
                    pivots,
                    one,
                    x0 + 8 * low * r,
                    columns,
                    at + np.uint64(8 * k),
                    rows,
                    zero,
                    b0,
                    columns,
                )
                for i in range(b):
                    g = boundary[q + i]
                    for c in range(r):
                        X[g, c] -= B[i, c]
    if backward:
        for t in range(parts - 1, -1, -1):
            low, at, q = first[t], panel[t], begin[t]
            k, b = first[t + 1] - low, begin[t + 1] - q
            m = k + b
            if k == 0:
                continue
            size[1], size[2], size[3] = k, m, b
            if b > 0:
                for i in range(b):
                    g = boundary[q + i]
                    for c in range(r):
                        B[i, c] = X[g, c]
                dgemm(
                    plain,
                    plain,
                    columns,
                    pivots,
                    rest,
                    minus,
                    b0,
                    columns,
                    at + np.uint64(8 * k),
                    rows,
                    one,
                    x0 + 8 * low * r,
                    columns,
                )
            dtrsm(
                right,
                lower,
                plain,
                plain,
                columns,
                pivots,
                one,
                at,
                rows,
                x0 + 8 * low * r,
                columns,
            )
    return letter[0] == 76 and scalar[0] == 1.0  # which keeps both alive until here
