"""Simplices split: by a linear function, segments by cracks, and both towards tips."""

import math

import numpy as np

from xcrack.base.kernels.jit import kernel

_FOOT = 1e-9  # share of a segment within which a foot at its end is the end
_ROUND_OFF = 1e-15  # of coordinates, as a share of the largest of them
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
def _distance_sum(x, e, i, order, first, last):  # type: ignore[no-untyped-def]
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
                distance, other_distance = abs(phi[e, one]), abs(phi[e, other])
                if abs(distance - other_distance) > _SAME * max(distance, other_distance):
                    if distance > other_distance:
                        break
                elif x.shape[0] == 0:
                    break
                else:
                    distance_sum = _distance_sum(x, e, one, order, begin, end)
                    other_sum = _distance_sum(x, e, other, order, begin, end)
                    if distance_sum > (1.0 - _SAME) * other_sum:
                        break
                order[j] = other
                j -= 1
            order[j] = one


@kernel
def cut_simplices(phi, x, least_volume):  # type: ignore[no-untyped-def]
    """Sub-simplices of triangles or tetrahedra with vertex values of both signs.

    Parameters
    ----------
    phi : (k, n) array
        n = d + 1.
    x : (k or 0, n, m) array
        Vertices, whose distances decide how equal values are split.
    least_volume : float
        Share of a simplex up to which a part is left out.

    Returns
    -------
    bary : (s, n, n) array
    fraction : (s,) array
    side, parent : (s,) arrays of int
    """
    k, n = phi.shape
    capacity = n * k if n == 3 else 6 * k
    bary, fraction = np.empty((capacity, n, n)), np.empty(capacity)
    side, parent = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
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
            apex = order[(n - 1) * (1 - other)]
            total = 1.0
            chosen[0] = apex
            for m in range(n - 1):
                t[m], u[m] = _mix(point, 4 + m, phi, e, apex, order[other + m])
                total *= t[m]
                chosen[1 + m] = 4 + m
            _set_vertices(bary, to, point, chosen)
            fraction[to], side[to], parent[to] = total, side_sign, e
            to += total > least_volume
            share = 1.0
            for i in range(n - 1):
                chosen[1 + i] = order[other + i]
            for m in range(n - 1):
                chosen[m] = 4 + m
                _set_vertices(bary, to, point, chosen)
                fraction[to], side[to], parent[to] = share * u[m], -side_sign, e
                to += fraction[to] > least_volume
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
                to += fraction[to] > least_volume
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
            apex, other = (order[0], 1) if count == 1 else (order[n - 1], 0)
            for m in range(n - 1):
                _mix(point, 4 + m, phi, e, apex, order[other + m])
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


@kernel
def graded_points(begin, end, tips, u, w):  # type: ignore[no-untyped-def]
    """Gauss points on segments, graded towards a tip that is closer than their length.

    A segment is split at the foot of the nearest tip, with r = u² from there; also where the foot
    lies beyond an end.

    Parameters
    ----------
    begin, end : (k, 2) arrays
    tips : (t, 2) array
    u, w : (n,) arrays
        Gauss rule on [0, 1].

    Returns
    -------
    segment : (q,) array of int
    place : (q, 2) array
        Barycentric coordinates in the segment.
    weight : (q,) array
        Summing to the length of each segment.
    """
    k, n = len(begin), len(u)
    number = np.empty(2 * n * k, np.int64)
    place, weight = np.empty((2 * n * k, 2)), np.empty(2 * n * k)
    to = 0
    for s in range(k):
        x, y = end[s, 0] - begin[s, 0], end[s, 1] - begin[s, 1]
        length = math.sqrt(x * x + y * y)
        middle0, middle1 = (begin[s, 0] + end[s, 0]) / 2, (begin[s, 1] + end[s, 1]) / 2
        nearest, smallest = -1, np.inf
        for t in range(len(tips)):
            a, b = middle0 - tips[t, 0], middle1 - tips[t, 1]
            distance = math.sqrt(a * a + b * b)
            if distance < smallest:
                nearest, smallest = t, distance
        is_near, foot = False, 0.0
        if nearest >= 0:
            a, b = tips[nearest, 0] - begin[s, 0], tips[nearest, 1] - begin[s, 1]
            square = x * x + y * y
            foot = (a * x + b * y) / square if square > 1e-300 else 0.0
            # A part as long as the round-off of coordinates would have points on the tip itself.
            largest = max(
                abs(begin[s, 0]), abs(begin[s, 1]), abs(end[s, 0]), abs(end[s, 1]),
                abs(tips[nearest, 0]), abs(tips[nearest, 1]),
            )  # fmt: skip
            close_share = max(_FOOT, min(0.5, _ROUND_OFF * largest / max(length, 1e-300)))
            if abs(foot) < close_share:
                foot = 0.0
            elif abs(foot - 1) < close_share:
                foot = 1.0
            position = min(max(foot, 0.0), 1.0)
            a = begin[s, 0] + position * x - tips[nearest, 0]
            b = begin[s, 1] + position * y - tips[nearest, 1]
            is_near = math.sqrt(a * a + b * b) < length
        for part in range(2):
            sign = 1.0 if part == 1 else -1.0
            # From the foot to the near end of this part and to the far one, in this direction.
            first, last = sign * (1 - part - foot), sign * (part - foot)
            if (is_near and last <= 0) or (not is_near and part == 1):
                continue
            low, high = math.sqrt(max(first, 0.0)), math.sqrt(max(last, 0.0))
            for i in range(n):
                p, share = u[i], w[i]
                if is_near:
                    v = low + (high - low) * u[i]
                    p, share = foot + sign * (v * v), (high - low) * (2 * v * w[i])
                number[to], weight[to] = s, length * share
                place[to, 0], place[to, 1] = 1 - p, p
                to += 1
    return number[:to], place[:to], weight[:to]


@kernel
def split_segments(ends, cut, level):  # type: ignore[no-untyped-def]
    """Parts of edges of a mesh: first parts of all, then second ones, and so on.

    Parameters
    ----------
    ends : (k, 2) array of int
        Points of the edges.
    cut : (c, k) array
        Where each crack cuts the edge, counted from the smaller point number; nan: nowhere. Next
        to a junction several cracks may cross one edge, three where two end on either side.
    level : (c, k, 2) array
        Level sets of the cracks at the ends.

    Returns
    -------
    number : (s,) array of int
    bary : (s, 2, 2) array
        Vertices of the part in the edge.
    side : (s, c) array of int
        0 where phi changes its sign though no crack cuts.
    """
    cracks, k = cut.shape
    at_cut, cuts = np.empty((k, cracks)), np.zeros(k, np.int64)
    place = np.zeros(cracks + 2, np.int64)  # of the next part, by its rank on its edge
    for e in range(k):
        for c in range(cracks):
            t = cut[c, e]
            if np.isnan(t):
                continue
            if ends[e, 0] >= ends[e, 1]:
                t = 1 - t
            i = cuts[e]
            while i > 0 and at_cut[e, i - 1] >= t:
                i -= 1
            if i < cuts[e] and at_cut[e, i] == t:
                continue
            for j in range(cuts[e], i, -1):
                at_cut[e, j] = at_cut[e, j - 1]
            at_cut[e, i] = t
            cuts[e] += 1
        for part in range(cuts[e] + 1):
            place[part + 1] += 1
    for part in range(cracks + 1):
        place[part + 1] += place[part]
    number = np.empty(place[cracks + 1], np.int64)
    bary, side = np.empty((len(number), 2, 2)), np.empty((len(number), cracks), np.int64)
    for e in range(k):
        for part in range(cuts[e] + 1):
            row = place[part]
            place[part] += 1
            begin = 0.0 if part == 0 else at_cut[e, part - 1]
            end = 1.0 if part == cuts[e] else at_cut[e, part]
            number[row] = e
            bary[row, 0, 0], bary[row, 0, 1] = 1 - begin, begin
            bary[row, 1, 0], bary[row, 1, 1] = 1 - end, end
            middle = (begin + end) / 2
            for c in range(cracks):
                a, b = level[c, e, 0], level[c, e, 1]
                at, t = (1 - middle) * a + middle * b, cut[c, e]
                if a * b < 0:
                    # The end on the same side of the cut, which at a kink is not where phi is zero.
                    # Ahead of a tip phi changes its sign on an edge that no crack splits.
                    t = 1 - t if ends[e, 0] >= ends[e, 1] else t
                    at = 0.0 if np.isnan(t) else (a if middle < t else b)
                side[row, c] = 0 if at == 0 else (1 if at > 0 else -1)
    return number, bary, side


@kernel
def _distance(x, y, corner):  # type: ignore[no-untyped-def]
    """Distance of a point to a triangle (3, 2), 0 inside."""
    best = np.inf
    low, high = np.inf, -np.inf
    for i in range(3):
        j = (i + 1) % 3
        ax, ay = corner[j, 0] - corner[i, 0], corner[j, 1] - corner[i, 1]
        bx, by = x - corner[i, 0], y - corner[i, 1]
        square = max(ax * ax + ay * ay, 1e-300)
        t = min(max((bx * ax + by * ay) / square, 0.0), 1.0)
        best = min(best, math.hypot(bx - t * ax, by - t * ay))
        turn = ax * by - ay * bx
        low, high = min(low, turn), max(high, turn)
    return 0.0 if low >= 0.0 or high <= 0.0 else best


@kernel
def bisect(x, tips, levels, fill, owner, bary, depth, near_tip):  # type: ignore[no-untyped-def]
    """Quarter triangles until they are no larger than their distance to every tip.

    Parameters
    ----------
    x : (s, 3, 2) array
    tips : (t, 2) array
    levels : int
        Most bisections.
    fill : bool
        Whether the parts are written; else they are counted only.
    owner : (n,) array of int
    bary : (n, 3, 3) array
        Vertices of each part in its triangle.
    depth : (n,) array of int
    near_tip : (n,) array of bool
        Still too large after all bisections.

    Returns
    -------
    int
        Number of parts.
    """
    stack, depths = np.empty((3 * levels + 4, 3, 3)), np.empty(3 * levels + 4, np.int64)
    triangle, middle, corner = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 2))
    count = 0
    for s in range(len(x)):
        top = 1
        depths[0] = 0
        for i in range(3):
            for b in range(3):
                stack[0, i, b] = 1.0 if i == b else 0.0
        while top > 0:
            top -= 1
            level = depths[top]
            for i in range(3):
                for b in range(3):
                    triangle[i, b] = stack[top, i, b]
                for k in range(2):
                    corner[i, k] = 0.0
                    for b in range(3):
                        corner[i, k] += triangle[i, b] * x[s, b, k]
            size = 0.0
            for i in range(3):
                j = (i + 1) % 3
                edge = math.hypot(corner[j, 0] - corner[i, 0], corner[j, 1] - corner[i, 1])
                size = max(size, edge)
            is_close = False
            for t in range(len(tips)):
                # Equal lengths are common in regular meshes: round-off must not decide.
                if size > (1.0 + _SAME) * _distance(tips[t, 0], tips[t, 1], corner):
                    is_close = True
                    break
            if not is_close or level == levels:
                if fill:
                    owner[count] = s
                    for i in range(3):
                        for b in range(3):
                            bary[count, i, b] = triangle[i, b]
                    depth[count] = level
                    near_tip[count] = is_close
                count += 1
                continue
            for i in range(3):
                for b in range(3):
                    middle[i, b] = (triangle[i, b] + triangle[(i + 1) % 3, b]) / 2
            for i in range(3):
                for b in range(3):
                    stack[top, i, b] = middle[i, b]
                    stack[top + 1 + i, 0, b] = triangle[i, b]
                    stack[top + 1 + i, 1, b] = middle[i, b]
                    stack[top + 1 + i, 2, b] = middle[(i + 2) % 3, b]
            for i in range(4):
                depths[top + i] = level + 1
            top += 4
    return count
