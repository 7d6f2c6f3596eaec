"""A multifrontal Cholesky factorisation: tree, rows and places of its parts, then numbers.

A part assembles its entries and the update matrices of its two children into a dense front, factors
its own columns, and hands the rest to its parent (Duff and Reid, 1983). Fronts are not copied:
columns are made where they stay, as a panel of pivots and the rows below them, and the rest in a
square of a stack; update matrices that are kept are packed, as lower triangles. Large fronts are
left to scipy's BLAS and LAPACK, called by address, with one thread: sums in another order would
have other last bits.
"""

import numba
import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.blas import dgemm, dgemv, doubles_at, dpotrf, dsyrk, dtrsm, dtrsv
from xcrack.base.kernels.jit import kernel

_SMALL = 64  # rows of a front below which loops update it quicker than BLAS
_SLACK = 0.1  # share of the cells by which halves may differ from a half
_NARROW = 32  # and columns up to which they factor it quicker


@kernel
def _add_stretch(target, source, count):  # type: ignore[no-untyped-def]
    """Add numbers at an address to those at another."""
    x = numba.carray(doubles_at(target), (count,))
    y = numba.carray(doubles_at(source), (count,))
    for i in range(count):
        x[i] += y[i]


@kernel
def _subtract_products(target, first, step, columns, count):  # type: ignore[no-untyped-def]
    """Subtract from a column the sum of others times their first numbers, four at a time.

    Column j begins at `first` + j `step`.
    """
    x = numba.carray(doubles_at(target), (count,))
    for _ in range(columns // 4):
        a = numba.carray(doubles_at(first), (count,))
        b = numba.carray(doubles_at(first + step), (count,))
        c = numba.carray(doubles_at(first + 2 * step), (count,))
        d = numba.carray(doubles_at(first + 3 * step), (count,))
        f, g, h, o = a[0], b[0], c[0], d[0]
        for i in range(count):
            x[i] -= (f * a[i] + g * b[i]) + (h * c[i] + o * d[i])
        first += 4 * step
    for _ in range(columns % 4):
        a = numba.carray(doubles_at(first), (count,))
        f = a[0]
        for i in range(count):
            x[i] -= f * a[i]
        first += step


@kernel
def _factored_panel(panel, m, k):  # type: ignore[no-untyped-def]
    """Factor a panel `(m, k)` by columns; 1 where a pivot is not positive."""
    step = np.uint64(8 * m)
    for j in range(k):
        # Column j less what the columns before it have in its row.
        at = panel + np.uint64(8 * (j * m + j))
        _subtract_products(at, panel + np.uint64(8 * j), step, j, m - j)
        x = numba.carray(doubles_at(at), (m - j,))
        if not x[0] > 0.0:
            return 1
        x[0] = np.sqrt(x[0])
        for i in range(1, m - j):
            x[i] /= x[0]
    return 0


@kernel
def _add_update(panel, update, source, is_packed, places, m, k, run):  # type: ignore[no-untyped-def]
    """Add the update matrix of a child to the columns of its parent's front.

    `places` of its rows in that front ascend; stretches of them without a gap are added at once.
    """
    b, runs = len(places), 0
    for j in range(b):
        if j == 0 or places[j] != places[j - 1] + 1:
            run[runs] = j
            runs += 1
    run[runs] = b
    n_before = 0
    for j in range(b):
        if j == run[n_before + 1]:
            n_before += 1
        c = places[j]
        column = panel + np.uint64(8 * c * m)
        if c >= k:
            column = update + np.uint64(8 * (c - k) * (m - k)) - np.uint64(8 * k)
        i = j
        for r in range(n_before, runs):
            _add_stretch(
                column + np.uint64(8 * places[i]), source + np.uint64(8 * i), run[r + 1] - i
            )
            i = run[r + 1]
        source += np.uint64(8 * (b - j - 1 if is_packed else b))


@kernel
def factor_parts(fronts, panel, update, square, is_packed, chosen_parts, low_part, high_part):  # type: ignore[no-untyped-def]
    """Factor parts of a tree, and hand their updates upwards.

    Parameters
    ----------
    fronts : tuple of arrays
        first, begin, in_parent, start, row, value, order, rank of `arrange_parts`.
    panel, update, square : (parts,) arrays of uint64
        Addresses of the panel, of the packed update matrix of a part that is kept, and of the room
        of `(b, b)` that it is made in. They are written to; panels must be zero.
    is_packed, chosen_parts : (parts,) arrays of bool
        Parts whose update matrices are packed, and parts to factor; the panels and update matrices
        of others are there.
    low_part, high_part : int
        Range of parts in postorder.

    Returns
    -------
    int
        1 where a pivot is not positive, else 0.
    """
    first, begin, in_parent, start, row, value, order, rank = fronts
    parts = len(order)
    most_rows = 0
    for t in range(parts):
        most_rows = max(most_rows, begin[t + 1] - begin[t])
    run = empty(most_rows + 1, np.int64)
    size, factors, letter = empty(4, np.int32), empty(2), empty(4, np.uint8)
    factors[0], factors[1] = 1.0, -1.0
    letter[0], letter[1], letter[2], letter[3] = 76, 78, 84, 82  # L N T R
    lower_letter, no_transpose = letter.ctypes.data, letter.ctypes.data + 1
    transpose, right_side = lower_letter + 2, lower_letter + 3
    plus_one, minus_one = factors.ctypes.data, factors.ctypes.data + 8
    rows, pivots, rest, info = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    for t in range(low_part, high_part):
        if not chosen_parts[t]:
            continue
        first_pivot = first[t]
        k, b = first[t + 1] - first_pivot, begin[t + 1] - begin[t]
        m = k + b
        L = numba.carray(doubles_at(panel[t]), (k * m,))
        for j in range(k):
            for e in range(start[first_pivot + j], start[first_pivot + j + 1]):
                L[j * m + row[e]] = value[e]
        for j in range(b):
            square_column = numba.carray(
                doubles_at(square[t] + np.uint64(8 * j * (b + 1))), (b - j,)
            )
            for i in range(b - j):
                square_column[i] = 0.0
        p = order[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                source = update[child] if is_packed[child] else square[child]
                places = in_parent[begin[child] : begin[child + 1]]
                _add_update(panel[t], square[t], source, is_packed[child], places, m, k, run)
        size[0], size[1], size[2] = m, k, b
        panel_below = panel[t] + np.uint64(8 * k)
        if k <= _NARROW:
            if _factored_panel(panel[t], m, k) != 0:
                return 1
        else:
            dpotrf(lower_letter, pivots, panel[t], rows, info)
            if size[3] != 0:
                return 1
            if b > 0:
                dtrsm(
                    right_side,
                    lower_letter,
                    transpose,
                    no_transpose,
                    rest,
                    pivots,
                    plus_one,
                    panel[t],
                    rows,
                    panel_below,
                    rows,
                )
        if m <= _SMALL:
            for c in range(b):
                target = square[t] + np.uint64(8 * c * (b + 1))
                _subtract_products(
                    target, panel_below + np.uint64(8 * c), np.uint64(8 * m), k, b - c
                )
        elif k > 0 and b > 0:
            dsyrk(
                lower_letter,
                no_transpose,
                rest,
                pivots,
                minus_one,
                panel_below,
                rows,
                plus_one,
                square[t],
                rest,
            )
        if is_packed[t]:
            packed_update = numba.carray(doubles_at(update[t]), (b * (b + 1) // 2,))
            to = 0
            for j in range(b):
                square_column = numba.carray(
                    doubles_at(square[t] + np.uint64(8 * j * (b + 1))), (b - j,)
                )
                for i in range(b - j):
                    packed_update[to + i] = square_column[i]
                to += b - j
    # Addresses alone keep no array alive: numba frees it after its last use.
    return 0 if letter[0] == 76 and factors[0] == 1.0 else 2


@kernel
def copy_stretches(source, target, count):  # type: ignore[no-untyped-def]
    """Copy stretches of numbers from address to address."""
    for t in range(len(count)):
        if count[t] > 0:
            source_values = numba.carray(doubles_at(source[t]), (count[t],))
            target_values = numba.carray(doubles_at(target[t]), (count[t],))
            for i in range(count[t]):
                target_values[i] = source_values[i]


@kernel
def substituted_one(first, begin, boundary, panel, x, is_forward, is_backward):  # type: ignore[no-untyped-def]
    """Solve for one right-hand side `(n,)`, in place; see `substitute`."""
    parts, largest_boundary = len(first) - 1, 1
    for t in range(parts):
        largest_boundary = max(largest_boundary, begin[t + 1] - begin[t])
    B = empty(largest_boundary)
    size, factors, letter = empty(4, np.int32), empty(3), empty(3, np.uint8)
    size[3] = 1
    factors[0], factors[1], factors[2] = 1.0, -1.0, 0.0
    letter[0], letter[1], letter[2] = 76, 78, 84  # L N T
    lower_letter, no_transpose, transpose = (
        letter.ctypes.data,
        letter.ctypes.data + 1,
        letter.ctypes.data + 2,
    )
    unit, minus_one, zero = factors.ctypes.data, factors.ctypes.data + 8, factors.ctypes.data + 16
    pivots, rows, rest, step = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    x0, b0 = x.ctypes.data, B.ctypes.data
    for t in range(parts if is_forward else 0):
        row, q = first[t], begin[t]
        k, b = first[t + 1] - row, begin[t + 1] - q
        if k == 0:
            continue
        size[0], size[1], size[2] = k, k + b, b
        dtrsv(lower_letter, no_transpose, no_transpose, pivots, panel[t], rows, x0 + 8 * row, step)
        if b > 0:
            dgemv(
                no_transpose,
                rest,
                pivots,
                unit,
                panel[t] + np.uint64(8 * k),
                rows,
                x0 + 8 * row,
                step,
                zero,
                b0,
                step,
            )
            for i in range(b):
                x[boundary[q + i]] -= B[i]
    for t in range(parts - 1 if is_backward else -1, -1, -1):
        row, q = first[t], begin[t]
        k, b = first[t + 1] - row, begin[t + 1] - q
        if k == 0:
            continue
        size[0], size[1], size[2] = k, k + b, b
        if b > 0:
            for i in range(b):
                B[i] = x[boundary[q + i]]
            dgemv(
                transpose,
                rest,
                pivots,
                minus_one,
                panel[t] + np.uint64(8 * k),
                rows,
                b0,
                step,
                unit,
                x0 + 8 * row,
                step,
            )
        dtrsv(lower_letter, transpose, no_transpose, pivots, panel[t], rows, x0 + 8 * row, step)
    return letter[0] == 76 and factors[0] == 1.0  # which keeps both alive until here


@kernel
def substitute(first, begin, boundary, order, rank, panel, X, is_touched, is_forward, is_backward):  # type: ignore[no-untyped-def]
    """Solve with the factor, in place.

    Parameters
    ----------
    first, begin, boundary, order, rank, panel : arrays
        Of the factor.
    X : (n, r) array
        Right-hand sides in permuted order.
    is_touched : (parts,) array of bool
        Parts whose rows of the right-hand sides are not zero; ancestors are added in the forward
        half, and all parts count in the backward one.
    is_forward, is_backward : bool
        Halves to do: L^-1 X, and L^-T of that.
    """
    parts, r = len(order), X.shape[1]
    size, factors, letter = empty(4, np.int32), empty(3), empty(4, np.uint8)
    factors[0], factors[1], factors[2] = 1.0, -1.0, 0.0
    letter[0], letter[1], letter[2], letter[3] = 76, 78, 84, 82
    lower_letter, no_transpose = letter.ctypes.data, letter.ctypes.data + 1
    transpose, right_side = lower_letter + 2, lower_letter + 3
    unit, minus_one, zero = factors.ctypes.data, factors.ctypes.data + 8, factors.ctypes.data + 16
    columns, pivots, rows, rest = (
        size.ctypes.data,
        size.ctypes.data + 4,
        size.ctypes.data + 8,
        size.ctypes.data + 12,
    )
    largest_boundary = 1
    for t in range(parts):
        largest_boundary = max(largest_boundary, begin[t + 1] - begin[t])
    B = empty((largest_boundary, r))
    size[0] = r
    x0, b0 = X.ctypes.data, B.ctypes.data
    if is_forward:
        for t in range(parts):
            if not is_touched[t]:
                continue
            p = order[t]
            if p > 1:
                is_touched[rank[p >> 1]] = True
            row, at, q = first[t], panel[t], begin[t]
            k, b = first[t + 1] - row, begin[t + 1] - q
            m = k + b
            if k == 0:
                continue
            size[1], size[2], size[3] = k, m, b
            # Rows of X, (k, r) in C order, are a matrix (r, k) by columns: X <- X L^-T.
            dtrsm(
                right_side,
                lower_letter,
                transpose,
                no_transpose,
                columns,
                pivots,
                unit,
                at,
                rows,
                x0 + 8 * row * r,
                columns,
            )
            if b > 0:
                dgemm(
                    no_transpose,
                    transpose,
                    columns,
                    rest,
                    pivots,
                    unit,
                    x0 + 8 * row * r,
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
    if is_backward:
        for t in range(parts - 1, -1, -1):
            row, at, q = first[t], panel[t], begin[t]
            k, b = first[t + 1] - row, begin[t + 1] - q
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
                    no_transpose,
                    no_transpose,
                    columns,
                    pivots,
                    rest,
                    minus_one,
                    b0,
                    columns,
                    at + np.uint64(8 * k),
                    rows,
                    unit,
                    x0 + 8 * row * r,
                    columns,
                )
            dtrsm(
                right_side,
                lower_letter,
                no_transpose,
                no_transpose,
                columns,
                pivots,
                unit,
                at,
                rows,
                x0 + 8 * row * r,
                columns,
            )
    return letter[0] == 76 and factors[0] == 1.0  # which keeps both alive until here


@kernel
def _cut(ranking, centre, cells, begin, end, last_cell, visit, begin_of_point):  # type: ignore[no-untyped-def]
    """Axis and place of a cut near the middle of some cells, with the fewest points on it.

    `last_cell` is that of each point, `visit` the latest look at it and, at its end, how many
    looks there were, `begin_of_point` the number of points that come with each cell.
    """
    half, width = begin + (end - begin) // 2, 0.0
    axis, place, lowest_price = 0, half, np.inf
    for i in range(len(ranking)):
        width = max(width, centre[ranking[i, end - 1], i] - centre[ranking[i, begin], i])
    slack = int(_SLACK * (end - begin))
    for i in range(len(ranking)):
        if centre[ranking[i, end - 1], i] - centre[ranking[i, begin], i] < 0.5 * width:
            continue
        visit[-1] += 1
        for k in range(begin, end):
            begin_of_point[k] = 0
            for j in range(cells.shape[1]):
                point = cells[ranking[i, k], j]
                last_cell[point] = k
                if visit[point] != visit[-1]:
                    visit[point] = visit[-1]
                    begin_of_point[k] += 1
        points = 0  # that have cells on both sides of the cut behind cell k
        for k in range(begin, half + slack):
            points += begin_of_point[k]
            for j in range(cells.shape[1]):
                points -= last_cell[cells[ranking[i, k], j]] == k
            distance = abs(k + 1 - half)
            if distance <= slack:
                price = points * (1.0 + 4.0 * (distance / (end - begin)) ** 2)
                if price < lowest_price or (price == lowest_price and distance < abs(place - half)):
                    axis, place, lowest_price = i, k + 1, price
    return axis, place


@kernel
def bisect_cells(ranking, centre, cells, n_points, depth):  # type: ignore[no-untyped-def]
    """Leaf of each cell after halving across a long side, where few points lie on the cut.

    Parameters
    ----------
    ranking : (d, n) array of int
        Cells in the order of each coordinate. It is changed.
    centre : (n, d) array
    cells : (n, d + 1) array of int
    n_points : int
    depth : int
        Levels of halving.

    Returns
    -------
    (n,) array of int
        Number 0 to 2^depth - 1.
    """
    d, n = ranking.shape
    last_cell, visit = empty(n_points, dtype=np.int64), zeros(n_points + 1, dtype=np.int64)
    begin_of_point = empty(n, dtype=np.int64)
    leaf = empty(n, dtype=np.int64)
    begin, end = zeros(1, dtype=np.int64), zeros(1, dtype=np.int64)
    end[0] = n
    is_lower = empty(n, dtype=np.bool_)
    buffer = empty(n, dtype=np.int64)
    for _ in range(depth):
        m = len(begin)
        new_begin, new_end = empty(2 * m, dtype=np.int64), empty(2 * m, dtype=np.int64)
        for g in range(m):
            a, b = begin[g], end[g]
            half, axis = a + (b - a) // 2, 0
            if b - a > 1:
                axis, half = _cut(ranking, centre, cells, a, b, last_cell, visit, begin_of_point)
            new_begin[2 * g], new_end[2 * g] = a, half
            new_begin[2 * g + 1], new_end[2 * g + 1] = half, b
            if b - a < 2:
                continue
            for k in range(a, b):
                is_lower[ranking[axis, k]] = k < half
            for i in range(d):
                if i == axis:
                    continue
                lower_end, n_upper = a, 0
                for k in range(a, b):
                    c = ranking[i, k]
                    if is_lower[c]:
                        ranking[i, lower_end] = c
                        lower_end += 1
                    else:
                        buffer[n_upper] = c
                        n_upper += 1
                for k in range(n_upper):
                    ranking[i, lower_end + k] = buffer[k]
        begin, end = new_begin, new_end
    for g in range(len(begin)):
        for k in range(begin[g], end[g]):
            leaf[ranking[0, k]] = g
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
    part = zeros(n, dtype=np.int64)
    for c in range(len(cell_nodes)):
        leaf_number = leaf[c] + (1 << depth)
        for j in range(cell_nodes.shape[1]):
            node = cell_nodes[c, j]
            part[node] = _ancestor(part[node], leaf_number)
    return part


@kernel
def order_columns(indptr, indices, n_columns, owner, d, part, rank):  # type: ignore[no-untyped-def]
    """Columns of a basis part by part: each belongs to the lowest that holds its support.

    Parameters
    ----------
    indptr, indices : arrays
        Rows of the basis, CSR.
    n_columns : int
    owner : (n_functions,) array of int
        Node of each function; unknown i belongs to function i // d.
    d : int
    part : (n_nodes,) array of int
    rank : (parts + 1,) array of int
        Of `postorder`.

    Returns
    -------
    perm : (n_columns,) array of int
        Column at each place.
    place : (n_columns,) array of int32
        Place of each column.
    first : (parts + 1,) array of int
        First place of each part in postorder.
    """
    own_part = zeros(n_columns, dtype=np.int64)
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            own_part[indices[k]] = _ancestor(own_part[indices[k]], part[owner[i // d]])
    first = zeros(len(rank), dtype=np.int64)
    for column in range(n_columns):
        own_part[column] = rank[max(own_part[column], 1)]
        first[own_part[column] + 1] += 1
    perm, place = empty(n_columns, dtype=np.int64), empty(n_columns, dtype=np.int32)
    end = empty(len(rank), dtype=np.int64)
    for t in range(len(rank) - 1):
        end[t] = first[t]
        first[t + 1] += first[t]
    for column in range(n_columns):
        place[column] = end[own_part[column]]
        perm[place[column]] = column
        end[own_part[column]] += 1
    return perm, place, first


@kernel
def postorder(depth):  # type: ignore[no-untyped-def]
    """Parts, children before parents; the place of each part there; levels below each place."""
    count = (1 << (depth + 1)) - 1
    order, rank = empty(count, dtype=np.int64), zeros(count + 1, dtype=np.int64)
    height = empty(count, dtype=np.int64)
    # The subtree of a part with h levels below it takes 2^(h + 1) - 1 places, its own last.
    begin = zeros(count + 1, dtype=np.int64)
    depth_below = depth
    for p in range(1, count + 1):
        if p >= (2 << (depth - depth_below)):
            depth_below -= 1
        rank[p] = begin[p] + (2 << depth_below) - 2
        order[rank[p]], height[rank[p]] = p, depth_below
        if depth_below > 0:
            begin[2 * p] = begin[p]
            begin[2 * p + 1] = begin[p] + (1 << depth_below) - 1
    return order, rank, height


@kernel
def _sort(values, begin, end):  # type: ignore[no-untyped-def]
    """Sort a stretch (Shell); numba's own sort takes longer to compile than the rest."""
    gap = 1
    while 3 * gap + 1 < end - begin:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(begin + gap, end):
            value, j = values[i], i
            while j >= begin + gap and values[j - gap] > value:
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
    start = zeros(n + 1, dtype=np.int64)
    room = len(indices)  # twice what is needed, but no pattern is symmetric to the last zero
    row, value = empty(room, dtype=np.int32), empty(room)
    begin = zeros(parts + 1, dtype=np.int64)
    capacity = 8 * n + 1000
    boundary = empty(capacity, dtype=np.int32)
    in_parent = empty(capacity, dtype=np.int32)
    mark, row_in_front = zeros(n, dtype=np.int32), empty(n, dtype=np.int32)
    to = 0
    for t in range(parts):
        first_pivot, end_pivot, top = first[t], first[t + 1], begin[t]
        if top + n > capacity:
            capacity = 2 * capacity + n
            longer_boundary, wider_map = empty(capacity, np.int32), empty(capacity, np.int32)
            for k in range(top):
                longer_boundary[k], wider_map[k] = boundary[k], in_parent[k]
            boundary, in_parent = longer_boundary, wider_map
        for c in range(first_pivot, end_pivot):
            for k in range(indptr[perm[c]], indptr[perm[c] + 1]):
                i = place[indices[k]]
                row[to], value[to] = i, data[k]
                to += i >= c  # without a branch, which no processor foresees
            start[c + 1] = to
        for k in range(start[first_pivot], to):
            i = row[k]
            if i >= end_pivot and mark[i] != t + 1:
                mark[i] = t + 1
                boundary[top] = i
                top += 1
        p = order[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                for k in range(begin[child], begin[child + 1]):
                    i = boundary[k]
                    if i >= end_pivot and mark[i] != t + 1:
                        mark[i] = t + 1
                        boundary[top] = i
                        top += 1
        _sort(boundary, begin[t], top)
        begin[t + 1] = top
        for j in range(end_pivot - first_pivot):
            row_in_front[first_pivot + j] = j
        for k in range(begin[t], top):
            row_in_front[boundary[k]] = end_pivot - first_pivot + k - begin[t]
        if 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                for k in range(begin[child], begin[child + 1]):
                    in_parent[k] = row_in_front[boundary[k]]
        for k in range(start[first_pivot], to):
            row[k] = row_in_front[row[k]]
    end = begin[parts]
    return begin, boundary[:end].copy(), in_parent[:end].copy(), start, row[:to], value[:to]


@kernel
def sizes(first, begin):  # type: ignore[no-untyped-def]
    """Entries of the panel of each part and of its update matrix."""
    parts = len(begin) - 1
    panel, update = zeros(parts, dtype=np.int64), zeros(parts, dtype=np.int64)
    for t in range(parts):
        k, b = first[t + 1] - first[t], begin[t + 1] - begin[t]
        panel[t] = (k + b) * k
        update[t] = b * (b + 1) // 2
    return panel, update


@kernel
def places_of_squares(order, rank, begin, height, is_packed, level):  # type: ignore[no-untyped-def]
    """Where the update matrix of each part is made: in stacks, which parts take in postorder.

    Even and odd levels have a stack each, so that a part and its children never share one. Subtrees
    with `level` levels have stacks of their own, and so has what is above them.

    Returns
    -------
    place : (parts,) array of int
    below, above : int
        Entries that the stacks of a subtree take, and those above the subtrees.
    """
    place = zeros(len(order), dtype=np.int64)
    top, most_room = zeros(4, dtype=np.int64), zeros(4, dtype=np.int64)
    for t in range(len(order)):
        p, h = order[t], height[t]
        stack = 2 * (h > level) + h % 2
        place[t] = top[stack]
        size = (begin[t + 1] - begin[t]) ** 2
        most_room[stack] = max(most_room[stack], top[stack] + size)
        if h > 0:
            for child in (rank[2 * p], rank[2 * p + 1]):
                if not is_packed[child]:
                    top[2 * (h - 1 > level) + (h - 1) % 2] -= (begin[child + 1] - begin[child]) ** 2
        if not is_packed[t]:
            top[stack] += size
    for t in range(len(order)):
        if height[t] % 2 == 1:
            place[t] += most_room[2 * (height[t] > level)]
    return place, most_room[0] + most_room[1], most_room[2] + most_room[3]


@kernel
def unchanged_parts(fronts, previous_factor):  # type: ignore[no-untyped-def]
    """Parts whose entries and whose children's places are those of before `(parts,)`.

    Parameters
    ----------
    fronts, previous_factor : tuples of arrays
        first, begin, in_parent, start, row, value, order, rank.
    """
    first, begin, in_parent, start, row, value, order, rank = fronts
    first0, begin0, in_parent0, start0, row0, value0 = previous_factor[:6]
    parts = len(order)
    is_unchanged = zeros(parts, dtype=np.bool_)
    for t in range(parts):
        k, b = first[t + 1] - first[t], begin[t + 1] - begin[t]
        if k != first0[t + 1] - first0[t] or b != begin0[t + 1] - begin0[t]:
            continue
        e, e0 = start[first[t]], start0[first0[t]]
        count = start[first[t + 1]] - e
        is_same = count == start0[first0[t + 1]] - e0
        if is_same:
            for j in range(k):
                c, c0 = first[t] + j, first0[t] + j
                if start[c + 1] - start[c] != start0[c0 + 1] - start0[c0]:
                    is_same = False
                    break
        if is_same:
            for i in range(count):
                if row[e + i] != row0[e0 + i] or value[e + i] != value0[e0 + i]:
                    is_same = False
                    break
        p = order[t]
        if is_same and 2 * p <= parts:
            for child in (rank[2 * p], rank[2 * p + 1]):
                count = begin[child + 1] - begin[child]
                if count != begin0[child + 1] - begin0[child]:
                    is_same = False
                    break
                for i in range(count):
                    if in_parent[begin[child] + i] != in_parent0[begin0[child] + i]:
                        is_same = False
                        break
        is_unchanged[t] = is_same
    return is_unchanged
