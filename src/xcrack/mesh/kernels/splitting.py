"""Simplices cut by a linear function; see `xcrack.mesh.simplex`."""

import numpy as np

from xcrack.base.kernels.jit import kernel

_SAME = 1e-9  # relative difference below which values or lengths are equal


@kernel
def _set_vertices(bary, to, point, chosen):  # type: ignore[no-untyped-def]
    """Set the vertices of a part to chosen points."""
    for v in range(bary.shape[1]):
        for b in range(bary.shape[2]):
            bary[to, v, b] = point[chosen[v], b]


@kernel
def _corners(n):  # type: ignore[no-untyped-def]
    """Corners of a simplex in barycentric coordinates, rows 0 to 3; cut points are put below."""
    point = np.zeros((8, n))
    for i in range(n):
        point[i, i] = 1.0
    return point


@kernel
def _mix(point, row, phi, e, i, j):  # type: ignore[no-untyped-def]
    """Set the cut point of edge (i, j) in barycentric coordinates; its positions from i and j."""
    a, b = phi[e, i], phi[e, j]
    t, u = a / (a - b), b / (b - a)
    for k in range(point.shape[1]):
        point[row, k] = 0.0
    point[row, i] = u
    point[row, j] = t
    return t, u


@kernel
def _sides(phi, e, order):  # type: ignore[no-untyped-def]
    """Number of vertices that are not negative; `order` is set to them, then to the others.

    Where one vertex is alone on its side, it is first or last, and the others grow.
    """
    n, count = phi.shape[1], 0
    for i in range(n):
        count += phi[e, i] >= 0
    first, to = 0, count
    for i in range(n):
        if phi[e, i] >= 0:
            order[first] = i
            first += 1
        else:
            order[to] = i
            to += 1
    return count


@kernel
def _across(x, e, i, order, first, last):  # type: ignore[no-untyped-def]
    """Sum of the distances of vertex i to some vertices."""
    total = 0.0
    for m in range(first, last):
        square = 0.0
        for a in range(x.shape[2]):
            square += (x[e, i, a] - x[e, order[m], a]) ** 2
        total += np.sqrt(square)
    return total


@kernel
def _sort(phi, x, e, order, count):  # type: ignore[no-untyped-def]
    """Sort the vertices of both sides: those nearest to the cut first.

    Of equally near ones that which is nearest to the vertices beyond. Values and lengths decide
    what is split how, not the numbers of the nodes: turned, mirrored or renumbered simplices are
    split alike.
    """
    n = len(order)
    for first, last in ((0, count), (count, n)):
        begin, end = count - first, count + n - last  # of the other side
        for i in range(first + 1, last):  # stable insertion
            one, j = order[i], i
            while j > first:
                other = order[j - 1]
                near, far = abs(phi[e, one]), abs(phi[e, other])
                if abs(near - far) > _SAME * max(near, far):
                    if near > far:
                        break
                elif x.shape[0] == 0:
                    break
                else:
                    short = _across(x, e, one, order, begin, end)
                    long = _across(x, e, other, order, begin, end)
                    if short > (1.0 - _SAME) * long:
                        break
                order[j] = other
                j -= 1
            order[j] = one


@kernel
def cut_simplices(phi, x, least):  # type: ignore[no-untyped-def]
    """Sub-simplices of triangles or tetrahedra with vertex values of both signs.

    Parameters
    ----------
    phi : (k, n) array
        n = d + 1.
    x : (k or 0, n, m) array
        Vertices, whose distances decide how equal values are split.
    least : float
        Share of a simplex up to which a part is left out.

    Returns
    -------
    bary : (s, n, n) array
    fraction : (s,) array
    side, parent : (s,) arrays of int
    """
    k, n = phi.shape
    most = n * k if n == 3 else 6 * k
    bary, fraction = np.empty((most, n, n)), np.empty(most)
    side, parent = np.empty(most, np.int64), np.empty(most, np.int64)
    order, chosen = np.empty(n, np.int64), np.empty(n, np.int64)
    t, u, point = np.empty(n), np.empty(n), _corners(n)
    to = 0
    for e in range(k):
        count = _sides(phi, e, order)
        if count == 0 or count == n:
            continue
        _sort(phi, x, e, order, count)
        if count == 1 or count == n - 1:
            side_sign, other = (1, 1) if count == 1 else (-1, 0)
            alone = order[(n - 1) * (1 - other)]
            total = 1.0
            chosen[0] = alone
            for m in range(n - 1):
                t[m], u[m] = _mix(point, 4 + m, phi, e, alone, order[other + m])
                total *= t[m]
                chosen[1 + m] = 4 + m
            _set_vertices(bary, to, point, chosen)
            fraction[to], side[to], parent[to] = total, side_sign, e
            to += total > least
            share = 1.0
            for i in range(n - 1):
                chosen[1 + i] = order[other + i]
            for m in range(n - 1):
                chosen[m] = 4 + m
                _set_vertices(bary, to, point, chosen)
                fraction[to], side[to], parent[to] = share * u[m], -side_sign, e
                to += fraction[to] > least
                share *= t[m]
            continue
        for side_sign in (1, -1):
            a, b, c, d = (
                order[1 - side_sign],
                order[2 - side_sign],
                order[1 + side_sign],
                order[2 + side_sign],
            )
            t_ac, _ = _mix(point, 4, phi, e, a, c)
            t_ad, _ = _mix(point, 5, phi, e, a, d)
            t_bc, t_cb = _mix(point, 6, phi, e, b, c)
            t_bd, t_db = _mix(point, 7, phi, e, b, d)
            for piece in range(3):
                chosen[0], chosen[1], chosen[2], chosen[3] = a, 4, 6, 7
                fraction[to] = t_ac * t_cb * t_bd
                if piece == 0:
                    chosen[2] = 5
                    fraction[to] = t_ac * t_ad * t_db
                elif piece == 2:
                    chosen[1] = b
                    fraction[to] = t_bc * t_bd
                _set_vertices(bary, to, point, chosen)
                side[to], parent[to] = side_sign, e
                to += fraction[to] > least
    return bary[:to], fraction[:to], side[:to], parent[:to]


@kernel
def _is_degenerate(bary, to):  # type: ignore[no-untyped-def]
    """Whether two vertices are the same: phi vanishes at a corner, and nothing lies between."""
    for i in range(bary.shape[1]):
        for j in range(i):
            is_same = True
            for b in range(bary.shape[2]):
                is_same = is_same and bary[to, i, b] == bary[to, j, b]
            if is_same:
                return True
    return False


@kernel
def interface_simplices(phi, x):  # type: ignore[no-untyped-def]
    """Segments or triangles on which a function of both signs vanishes.

    Parameters
    ----------
    phi : (k, n) array
    x : (k or 0, n, m) array
        As of `cut_simplices`.

    Returns
    -------
    bary : (s, n - 1, n) array
    parent : (s,) array of int
    """
    k, n = phi.shape
    bary, parent = np.empty((2 * k + 1, n - 1, n)), np.empty(2 * k + 1, np.int64)
    order, chosen = np.empty(n, np.int64), np.empty(n, np.int64)
    point, to = _corners(n), 0
    for e in range(k):
        count = _sides(phi, e, order)
        if count == 1 or count == n - 1:
            alone, other = (order[0], 1) if count == 1 else (order[n - 1], 0)
            for m in range(n - 1):
                _mix(point, 4 + m, phi, e, alone, order[other + m])
                chosen[m] = 4 + m
            _set_vertices(bary, to, point, chosen)
            parent[to] = e
            to += not _is_degenerate(bary, to)
        elif 0 < count < n:
            _sort(phi, x, e, order, count)
            for m in range(4):
                _mix(point, 4 + m, phi, e, order[m // 2], order[2 + (m == 1 or m == 2)])
            for half in range(2):
                chosen[0], chosen[1], chosen[2] = 4, 5 + half, 6 + half
                _set_vertices(bary, to, point, chosen)
                parent[to] = e
                to += not _is_degenerate(bary, to)
    return bary[:to], parent[:to]
