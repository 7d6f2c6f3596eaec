"""Simplices cut by a linear function; see `xcrack.mesh.split`."""

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def _put(bary, to, first, point, chosen):  # type: ignore[no-untyped-def]
    """Set vertices of a part, from one on, to chosen points."""
    for v in range(len(chosen)):
        for b in range(bary.shape[2]):
            bary[to, first + v, b] = point[chosen[v], b]


@kernel
def _mix(point, phi, i, j):  # type: ignore[no-untyped-def]
    """Set the cut point of edge (i, j) in barycentric coordinates; its positions from i and j."""
    a, b = phi[i], phi[j]
    t, u = a / (a - b), b / (b - a)
    for b in range(len(point)):
        point[b] = 0.0
    point[i] = u
    point[j] = t
    return t, u


@kernel
def _set_corner(point, i):  # type: ignore[no-untyped-def]
    for b in range(len(point)):
        point[b] = 0.0
    point[i] = 1.0


@kernel
def _sides(phi, order):  # type: ignore[no-untyped-def]
    """Number of vertices that are not negative; `order` is set to them, then to the others."""
    n, count = len(phi), 0
    for i in range(n):
        if phi[i] >= 0:
            order[count] = i
            count += 1
    to = count
    for i in range(n):
        if not phi[i] >= 0:
            order[to] = i
            to += 1
    return count


@kernel
def _one_alone(phi, alone, side, others, by_value):  # type: ignore[no-untyped-def]
    """Set the vertices but one, which is alone on its side; its own side."""
    m = 0
    for i in range(len(phi)):
        if i != alone:
            others[m] = i
            m += 1
    if by_value:  # stable insertion
        for i in range(1, m):
            one, j = others[i], i
            while j > 0 and abs(phi[others[j - 1]]) > abs(phi[one]):
                others[j] = others[j - 1]
                j -= 1
            others[j] = one
    return side


@kernel
def cut_simplices(phi, least):  # type: ignore[no-untyped-def]
    """Sub-simplices of triangles or tetrahedra with vertex values of both signs.

    Parameters
    ----------
    phi : (k, n) array
        n = d + 1.
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
    order, others = np.empty(n, np.int64), np.empty(n - 1, np.int64)
    t, u, point = np.empty(n), np.empty(n), np.empty((4, n))
    every, three = np.arange(4), np.array([[0, 1, 3], [0, 2, 3]])
    to = 0
    for e in range(k):
        count = _sides(phi[e], order)
        if count == 0 or count == n:
            continue
        if count == 1 or count == n - 1:
            # The values decide which diagonal splits what is left, not the numbers of the nodes.
            alone = order[0] if count == 1 else order[n - 1]
            own = _one_alone(phi[e], alone, 1 if count == 1 else -1, others, True)
            total = 1.0
            for m in range(n - 1):
                t[m], u[m] = _mix(point[m], phi[e], alone, others[m])
                total *= t[m]
            _set_corner(bary[to, 0], alone)
            _put(bary, to, 1, point, every[: n - 1])
            fraction[to], side[to], parent[to] = total, own, e
            to += total > least
            share = 1.0
            for m in range(n - 1):
                _put(bary, to, 0, point, every[: m + 1])
                for i in range(m, n - 1):
                    _set_corner(bary[to, 1 + i], others[i])
                fraction[to], side[to], parent[to] = share * u[m], -own, e
                to += fraction[to] > least
                share *= t[m]
            continue
        for own in (1, -1):
            a, b, c, d = order[0], order[1], order[2], order[3]
            if own < 0:
                a, b, c, d = c, d, a, b
            t_ac, _ = _mix(point[0], phi[e], a, c)
            t_ad, _ = _mix(point[1], phi[e], a, d)
            t_bc, t_cb = _mix(point[2], phi[e], b, c)
            t_bd, t_db = _mix(point[3], phi[e], b, d)
            for piece in range(3):
                _set_corner(bary[to, 0], a)
                if piece == 0:
                    _put(bary, to, 1, point, three[0])
                    fraction[to] = t_ac * t_ad * t_db
                elif piece == 1:
                    _put(bary, to, 1, point, three[1])
                    fraction[to] = t_ac * t_cb * t_bd
                else:
                    _set_corner(bary[to, 1], b)
                    _put(bary, to, 2, point, every[2:4])
                    fraction[to] = t_bc * t_bd
                side[to], parent[to] = own, e
                to += fraction[to] > least
    return bary[:to].copy(), fraction[:to].copy(), side[:to].copy(), parent[:to].copy()


@kernel
def _degenerate(vertices):  # type: ignore[no-untyped-def]
    """Whether two vertices are the same: phi vanishes at a corner, and nothing lies between."""
    for i in range(len(vertices)):
        for j in range(i):
            same = True
            for b in range(vertices.shape[1]):
                same = same and vertices[i, b] == vertices[j, b]
            if same:
                return True
    return False


@kernel
def interface_simplices(phi):  # type: ignore[no-untyped-def]
    """Segments or triangles on which a function of both signs vanishes.

    Parameters
    ----------
    phi : (k, n) array

    Returns
    -------
    bary : (s, n - 1, n) array
    parent : (s,) array of int
    """
    k, n = phi.shape
    bary, parent = np.empty((2 * k + 1, n - 1, n)), np.empty(2 * k + 1, np.int64)
    order, others = np.empty(n, np.int64), np.empty(n - 1, np.int64)
    point, three = np.empty((4, n)), np.array([[0, 1, 2], [0, 2, 3]])
    to = 0
    for e in range(k):
        count = _sides(phi[e], order)
        if count == 1 or count == n - 1:
            _one_alone(phi[e], order[0] if count == 1 else order[n - 1], 1, others, False)
            for m in range(n - 1):
                _mix(bary[to, m], phi[e], order[0] if count == 1 else order[n - 1], others[m])
            parent[to] = e
            to += not _degenerate(bary[to])
        elif 0 < count < n:
            a, b, c, d = order[0], order[1], order[2], order[3]
            _mix(point[0], phi[e], a, c)
            _mix(point[1], phi[e], a, d)
            _mix(point[2], phi[e], b, d)
            _mix(point[3], phi[e], b, c)
            for half in range(2):
                _put(bary, to, 0, point, three[half])
                parent[to] = e
                to += not _degenerate(bary[to])
    return bary[:to].copy(), parent[:to].copy()
