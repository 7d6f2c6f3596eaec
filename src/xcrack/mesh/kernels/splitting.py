"""Simplices split by linear functions, segments by cracks; points of both, denser towards tips."""

import math

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel

_FOOT = 1e-9  # share of a segment within which a foot at its end is the end
_ROUND_OFF = 1e-15  # of coordinates, as a share of the largest of them
_SAME = 1e-9  # relative difference below which values or lengths are equal
_SECTOR = 0.6  # rad, widest sector of a fan


@kernel
def _set_vertices(bary, to, point, numbers):  # type: ignore[no-untyped-def]
    """Set the vertices of a part to chosen points."""
    for v in range(bary.shape[1]):
        for b in range(bary.shape[2]):
            bary[to, v, b] = point[numbers[v], b]


@kernel
def _corners(n):  # type: ignore[no-untyped-def]
    """Corners of a simplex in barycentric coordinates, rows 0 to 3; cut points are put below."""
    point = zeros((8, n))
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
def _distance_sum(x, e, i, order, first, end):  # type: ignore[no-untyped-def]
    """Sum of the distances of vertex i to some vertices."""
    total = 0.0
    for m in range(first, end):
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
    for first, stop in ((0, count), (count, n)):
        begin, end = count - first, count + n - stop  # of the other side
        for i in range(first + 1, stop):  # stable insertion
            vertex, j = order[i], i
            while j > first:
                neighbour = order[j - 1]
                distance, other_distance = abs(phi[e, vertex]), abs(phi[e, neighbour])
                if abs(distance - other_distance) > _SAME * max(distance, other_distance):
                    if distance > other_distance:
                        break
                elif x.shape[0] == 0:
                    break
                else:
                    distance_sum = _distance_sum(x, e, vertex, order, begin, end)
                    other_sum = _distance_sum(x, e, neighbour, order, begin, end)
                    if distance_sum > (1.0 - _SAME) * other_sum:
                        break
                order[j] = neighbour
                j -= 1
            order[j] = vertex


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
    bary, fraction = empty((capacity, n, n)), empty(capacity)
    side, parent = empty(capacity, np.int64), empty(capacity, np.int64)
    order, vertices = empty(n, np.int64), empty(n, np.int64)
    t, u, point = empty(n), empty(n), _corners(n)
    to = 0
    for e in range(k):
        count = _sides(phi, e, order)
        if count == 0 or count == n:
            continue
        _sort(phi, x, e, order, count)
        if count == 1 or count == n - 1:
            side_sign, base = (1, 1) if count == 1 else (-1, 0)
            apex = order[(n - 1) * (1 - base)]
            total = 1.0
            vertices[0] = apex
            for m in range(n - 1):
                t[m], u[m] = _mix(point, 4 + m, phi, e, apex, order[base + m])
                total *= t[m]
                vertices[1 + m] = 4 + m
            _set_vertices(bary, to, point, vertices)
            fraction[to], side[to], parent[to] = total, side_sign, e
            to += total > least_volume
            share = 1.0
            for i in range(n - 1):
                vertices[1 + i] = order[base + i]
            for m in range(n - 1):
                vertices[m] = 4 + m
                _set_vertices(bary, to, point, vertices)
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
                vertices[0], vertices[1], vertices[2], vertices[3] = a, 4, 6, 7
                fraction[to] = t_ac * t_cb * t_bd
                if piece == 0:
                    vertices[2] = 5
                    fraction[to] = t_ac * t_ad * t_db
                elif piece == 2:
                    vertices[1] = b
                    fraction[to] = t_bc * t_bd
                _set_vertices(bary, to, point, vertices)
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
    bary, parent = empty((2 * k + 1, n - 1, n)), empty(2 * k + 1, np.int64)
    order, vertices = empty(n, np.int64), empty(n, np.int64)
    point, to = _corners(n), 0
    for e in range(k):
        count = _sides(phi, e, order)
        if count == 1 or count == n - 1:
            apex, base = (order[0], 1) if count == 1 else (order[n - 1], 0)
            for m in range(n - 1):
                _mix(point, 4 + m, phi, e, apex, order[base + m])
                vertices[m] = 4 + m
            _set_vertices(bary, to, point, vertices)
            parent[to] = e
            to += not _is_degenerate(bary, to)
        elif 0 < count < n:
            _sort(phi, x, e, order, count)
            for m in range(4):
                _mix(point, 4 + m, phi, e, order[m // 2], order[2 + (m == 1 or m == 2)])
            for half in range(2):
                vertices[0], vertices[1], vertices[2] = 4, 5 + half, 6 + half
                _set_vertices(bary, to, point, vertices)
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
    number = empty(2 * n * k, np.int64)
    place, weight = empty((2 * n * k, 2)), empty(2 * n * k)
    to = 0
    for s in range(k):
        x, y = end[s, 0] - begin[s, 0], end[s, 1] - begin[s, 1]
        length = math.sqrt(x * x + y * y)
        middle0, middle1 = (begin[s, 0] + end[s, 0]) / 2, (begin[s, 1] + end[s, 1]) / 2
        nearest_tip, least_distance = -1, np.inf
        for t in range(len(tips)):
            a, b = middle0 - tips[t, 0], middle1 - tips[t, 1]
            distance = math.sqrt(a * a + b * b)
            if distance < least_distance:
                nearest_tip, least_distance = t, distance
        is_near, foot = False, 0.0
        if nearest_tip >= 0:
            a, b = tips[nearest_tip, 0] - begin[s, 0], tips[nearest_tip, 1] - begin[s, 1]
            square = x * x + y * y
            foot = (a * x + b * y) / square if square > 1e-300 else 0.0
            # A part as long as the round-off of coordinates would have points on the tip itself.
            scale = max(
                abs(begin[s, 0]), abs(begin[s, 1]), abs(end[s, 0]), abs(end[s, 1]),
                abs(tips[nearest_tip, 0]), abs(tips[nearest_tip, 1]),
            )  # fmt: skip
            close_share = max(_FOOT, min(0.5, _ROUND_OFF * scale / max(length, 1e-300)))
            if abs(foot) < close_share:
                foot = 0.0
            elif abs(foot - 1) < close_share:
                foot = 1.0
            position = min(max(foot, 0.0), 1.0)
            a = begin[s, 0] + position * x - tips[nearest_tip, 0]
            b = begin[s, 1] + position * y - tips[nearest_tip, 1]
            is_near = math.sqrt(a * a + b * b) < length
        for part in range(2):
            sign = 1.0 if part == 1 else -1.0
            # From the foot to the near end of this part and to the far one, in this direction.
            first, stop = sign * (1 - part - foot), sign * (part - foot)
            if (is_near and stop <= 0) or (not is_near and part == 1):
                continue
            u_min, u_max = math.sqrt(max(first, 0.0)), math.sqrt(max(stop, 0.0))
            for i in range(n):
                p, share = u[i], w[i]
                if is_near:
                    v = u_min + (u_max - u_min) * u[i]
                    p, share = foot + sign * (v * v), (u_max - u_min) * (2 * v * w[i])
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
    at_cut, cuts = empty((k, cracks)), zeros(k, np.int64)
    place = zeros(cracks + 2, np.int64)  # of the next part, by its rank on its edge
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
    number = empty(place[cracks + 1], np.int64)
    bary, side = empty((len(number), 2, 2)), empty((len(number), cracks), np.int64)
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
    least_distance = np.inf
    turn_min, turn_max = np.inf, -np.inf
    for i in range(3):
        j = (i + 1) % 3
        ax, ay = corner[j, 0] - corner[i, 0], corner[j, 1] - corner[i, 1]
        bx, by = x - corner[i, 0], y - corner[i, 1]
        square = max(ax * ax + ay * ay, 1e-300)
        t = min(max((bx * ax + by * ay) / square, 0.0), 1.0)
        least_distance = min(least_distance, math.hypot(bx - t * ax, by - t * ay))
        turn = ax * by - ay * bx
        turn_min, turn_max = min(turn_min, turn), max(turn_max, turn)
    return 0.0 if turn_min >= 0.0 or turn_max <= 0.0 else least_distance


@kernel
def _longest_side(corner):  # type: ignore[no-untyped-def]
    """Longest side of a triangle (3, 2)."""
    size = 0.0
    for i in range(3):
        j = (i + 1) % 3
        size = max(size, math.hypot(corner[j, 0] - corner[i, 0], corner[j, 1] - corner[i, 1]))
    return size


@kernel
def _with_room(table, count, n_rows):  # type: ignore[no-untyped-def]
    """A table with so many more rows than those in use, twice as long where it is too short."""
    if count + n_rows <= len(table):
        return table
    long_table = empty((2 * (count + n_rows), 5))
    for q in range(count):
        for k in range(5):
            long_table[q, k] = table[q, k]
    return long_table


@kernel
def _put_rule(table, count, number, vertex, share, bary, weight):  # type: ignore[no-untyped-def]
    """Points of a rule in a triangle with these vertices; the table and its number of rows."""
    table = _with_room(table, count, len(weight))
    for p in range(len(weight)):
        table[count, 0] = number
        for b in range(3):
            x = bary[p, 0] * vertex[0, b]
            table[count, 1 + b] = x + bary[p, 1] * vertex[1, b] + bary[p, 2] * vertex[2, b]
        table[count, 4] = share * weight[p]
        count += 1
    return table, count


@kernel
def _where_far_side_meets(circles, ax, ay, bx, by):  # type: ignore[no-untyped-def]
    """Places 0, …, 1 on the side from a to b, increasing, between which it crosses no circle."""
    place = empty(2 * len(circles) + 2)
    place[0], count = 0.0, 1
    dx, dy = bx - ax, by - ay
    square, half = dx * dx + dy * dy, ax * dx + ay * dy
    for c in range(len(circles)):
        discriminant = half * half - square * (ax * ax + ay * ay - circles[c] * circles[c])
        if circles[c] <= 0.0 or square <= 0.0 or not 0.0 < discriminant < np.inf:
            continue
        for sign in (-1.0, 1.0):
            at = (-half + sign * math.sqrt(discriminant)) / square
            if _SAME < at < 1.0 - _SAME:
                i = count
                while at < place[i - 1]:
                    place[i] = place[i - 1]
                    i -= 1
                place[i] = at
                count += 1
    place[count] = 1.0
    return place[: count + 1]


@kernel
def _put_fan(  # type: ignore[no-untyped-def]
    table, count, number, vertex, corner, share, s, ws, t, wt, circles
):
    """Points that sweep a triangle from vertex 0 in sectors, x = A + s² (E - A), E on the far side.

    Exact for polynomials, and for products of derivatives of the tip functions along r; the angle
    is resolved by sectors of at most 0.6 rad. Rules begin and end at circles around vertex 0, and
    nothing is put within the first and beyond the last.
    """
    ax, ay = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
    bx, by = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
    place = _where_far_side_meets(circles, ax, ay, bx, by)
    for piece in range(len(place) - 1):
        start, width = place[piece], place[piece + 1] - place[piece]
        stop = start + width
        a0, a1 = (1 - start) * ax + start * bx, (1 - start) * ay + start * by
        b0, b1 = (1 - stop) * ax + stop * bx, (1 - stop) * ay + stop * by
        a, b = math.sqrt(a0 * a0 + a1 * a1), math.sqrt(b0 * b0 + b1 * b1)
        angle = abs(math.atan2(a0 * b1 - a1 * b0, a0 * b0 + a1 * b1))
        sectors = 1
        while sectors * _SECTOR < angle:
            sectors += 1
        table = _with_room(table, count, sectors * (len(circles) - 1) * len(s) * len(t))
        end = 0.0
        for k in range(sectors):
            begin, part = end, (k + 1) / sectors
            first, remainder = a * math.sin(part * angle), b * math.sin((1 - part) * angle)
            end = first / (first + remainder) if first + remainder > 0 else part
            for c in range(len(circles) - 1):
                for i in range(len(s)):
                    for j in range(len(t)):
                        tau = start + width * (begin + (end - begin) * t[j])
                        x, y = (1 - tau) * ax + tau * bx, (1 - tau) * ay + tau * by
                        square = max(x * x + y * y, 1e-300)
                        reach = math.sqrt(square)
                        s_min, s_max = circles[c] / reach, circles[c + 1] / reach
                        if s_min >= 1.0:
                            continue
                        s_min, s_max = math.sqrt(s_min), math.sqrt(min(s_max, 1.0))
                        root = s_min + (s_max - s_min) * s[i]
                        u = root * root
                        # dV = 2 area u du dtau with u = s²
                        radial_weight = 4 * root**3 * (s_max - s_min) * ws[i]
                        table[count, 0] = number
                        for v in range(3):
                            far_point = (1 - tau) * vertex[1, v] + tau * vertex[2, v]
                            table[count, 1 + v] = (1 - u) * vertex[0, v] + u * far_point
                        table[count, 4] = share * width * (end - begin) * radial_weight * wt[j]
                        count += 1
    return table, count


@kernel
def _put_fans_around(  # type: ignore[no-untyped-def]
    table, count, number, vertex, corner, share, tip, s, ws, t, wt, fan, fan_corner, circles
):
    """Points of two fans around the place of a triangle that is nearest to a tip outside it."""
    nearest_row, best_at, least_distance = 0, 0.0, np.inf
    for i in range(3):
        j = (i + 1) % 3
        dx, dy = corner[j, 0] - corner[i, 0], corner[j, 1] - corner[i, 1]
        x, y = tip[0] - corner[i, 0], tip[1] - corner[i, 1]
        at = min(max((x * dx + y * dy) / max(dx * dx + dy * dy, 1e-300), 0.0), 1.0)
        distance = math.hypot(x - at * dx, y - at * dy)
        if distance < least_distance:
            nearest_row, best_at, least_distance = i, at, distance
    i, j, k = nearest_row, (nearest_row + 1) % 3, (nearest_row + 2) % 3
    for half in range(2):
        part = best_at if half == 0 else 1 - best_at
        j2, j3 = k if half == 0 else j, i if half == 0 else k
        if part <= 1e-14:
            continue
        for b in range(3):
            fan[0, b] = (1 - best_at) * vertex[i, b] + best_at * vertex[j, b]
            fan[1, b], fan[2, b] = vertex[j2, b], vertex[j3, b]
        for b in range(2):
            fan_corner[0, b] = (1 - best_at) * corner[i, b] + best_at * corner[j, b]
            fan_corner[1, b], fan_corner[2, b] = corner[j2, b], corner[j3, b]
        table, count = _put_fan(
            table, count, number, fan, fan_corner, share * part, s, ws, t, wt, circles
        )  # fmt: skip
    return table, count


@kernel
def _misses_ring(corner, centre, radii):  # type: ignore[no-untyped-def]
    """Whether a triangle (3, 2) lies within the first of some circles, or beyond the last."""
    largest_distance = 0.0
    for i in range(3):
        x, y = corner[i, 0] - centre[0], corner[i, 1] - centre[1]
        largest_distance = max(largest_distance, math.hypot(x, y))
    return largest_distance <= radii[0] or _distance(centre[0], centre[1], corner) >= radii[-1]


@kernel
def triangle_points(  # type: ignore[no-untyped-def]
    bary, corners, share, bears_tip, fan, tips, levels, plain_rule, plain_share, rule_near,
    rule_near_share, s, ws, t, wt, centre, radii,
):  # fmt: skip
    """Integration points of triangles, denser towards tips where their functions act.

    Triangles on which tip functions act are quartered until they are no larger than their distance
    to every tip; what is still too large then, and what has a tip as a vertex, is swept in a fan.

    Parameters
    ----------
    bary : (k, 3, 3) array
        Vertices in some barycentric coordinates.
    corners : (k, 3, 2) array, length
    share : (k,) array
        Of the area of what these coordinates belong to.
    bears_tip, fan : (k,) arrays of bool
        Tip functions act; vertex 0 is a tip.
    tips : (m, 2) array
    levels : int
        Most bisections.
    plain_rule, plain_share : (p, 3) and (p,) arrays
        Rule of triangles without tip functions.
    rule_near, rule_near_share : (p, 3) and (p,) arrays
        Rule of those with tip functions that lie away from tips.
    s, ws, t, wt : (i,) and (j,) arrays
        Gauss rules of fans, along the radius and across.
    centre : (2,) array, length
        The tip whose fans begin and end at circles around it.
    radii : (c,) array, length
        Of these circles, increasing, at which an integrand is not smooth: it is zero within the
        first and beyond the last, so that parts there get no points. Where there are none, fans are
        whole.

    Returns
    -------
    number : (q,) array of int
        Triangle of each point, increasing.
    place : (q, 3) array
    weight : (q,) array
    """
    stack, depths = empty((3 * levels + 4, 3, 3)), empty(3 * levels + 4, np.int64)
    full_range = zeros(2)
    full_range[1] = np.inf
    part, middle, corner = empty((3, 3)), empty((3, 3)), empty((3, 2))
    vertex, fan_vertex, fan_corner = empty((3, 3)), empty((3, 3)), empty((3, 2))
    table, count = empty((len(bary) * len(plain_share), 5)), 0
    for k in range(len(bary)):
        if not bears_tip[k]:
            table, count = _put_rule(table, count, k, bary[k], share[k], plain_rule, plain_share)
            continue
        if fan[k]:
            distance = math.hypot(corners[k, 0, 0] - centre[0], corners[k, 0, 1] - centre[1])
            is_at_centre = len(radii) > 0 and distance <= _SAME * radii[0]
            table, count = _put_fan(
                table, count, k, bary[k], corners[k], share[k], s, ws, t, wt,
                radii if is_at_centre else full_range,
            )  # fmt: skip
            continue
        top = 1
        depths[0] = 0
        for i in range(3):
            for b in range(3):
                stack[0, i, b] = 1.0 if i == b else 0.0
        while top > 0:
            top -= 1
            level, fraction = depths[top], share[k]
            for _ in range(level):
                fraction *= 0.25
            for i in range(3):
                for b in range(3):
                    part[i, b] = stack[top, i, b]
                    vertex[i, b] = 0.0
                for j in range(2):
                    corner[i, j] = 0.0
                for v in range(3):
                    for b in range(3):
                        vertex[i, b] += part[i, v] * bary[k, v, b]
                    for j in range(2):
                        corner[i, j] += part[i, v] * corners[k, v, j]
            if len(radii) > 0 and _misses_ring(corner, centre, radii):
                continue
            size, tip_of_part, least_distance = _longest_side(corner), 0, np.inf
            for m in range(len(tips)):
                distance = _distance(tips[m, 0], tips[m, 1], corner)
                if distance < least_distance:
                    tip_of_part, least_distance = m, distance
            # Equal lengths are common in regular meshes: round-off must not decide.
            if size <= (1.0 + _SAME) * least_distance:
                table, count = _put_rule(
                    table, count, k, vertex, fraction, rule_near, rule_near_share
                )
                continue
            if level == levels:
                table, count = _put_fans_around(
                    table, count, k, vertex, corner, fraction,
                    tips[tip_of_part], s, ws, t, wt, fan_vertex, fan_corner, full_range,
                )  # fmt: skip
                continue
            for i in range(3):
                for b in range(3):
                    middle[i, b] = (part[i, b] + part[(i + 1) % 3, b]) / 2
            for i in range(3):
                for b in range(3):
                    stack[top, i, b] = middle[i, b]
                    stack[top + 1 + i, 0, b] = part[i, b]
                    stack[top + 1 + i, 1, b] = middle[i, b]
                    stack[top + 1 + i, 2, b] = middle[(i + 2) % 3, b]
            for i in range(4):
                depths[top + i] = level + 1
            top += 4
    number, place, weight = empty(count, np.int64), empty((count, 3)), empty(count)
    for q in range(count):
        number[q], weight[q] = int(table[q, 0]), table[q, 4]
        for b in range(3):
            place[q, b] = table[q, 1 + b]
    return number, place, weight


@kernel
def _least_radius(levels, i, j):  # type: ignore[no-untyped-def]
    """Distance to the nearest front in the middle of two vertices, or at one."""
    r_min = np.inf
    for t in range(len(levels)):
        phi = 0.5 * (levels[t, i, 0] + levels[t, j, 0])
        psi = 0.5 * (levels[t, i, 1] + levels[t, j, 1])
        r_min = min(r_min, math.sqrt(phi * phi + psi * psi))
    return r_min


@kernel
def bisected_towards_fronts(bary, x, levels, share, nearness, n_bisections, tolerance):  # type: ignore[no-untyped-def]
    """Bisect tetrahedra until none is nearer to a front than its size and share allow.

    They are halved across the middle of their longest edge; of equally long ones that counts whose
    middle is nearest to a front.

    Parameters
    ----------
    bary : (k, 4, 4) array
        Vertices in some barycentric coordinates.
    x : (k, 4, 3) array, length
        Vertices.
    levels : (k, t, 4, 2) array, length
        Level sets of each front at the vertices, linear in between.
    share : (k,) array
        Of the volume of what these coordinates belong to.
    nearness : float
        Parts nearer than this times the fourth root of their share times their longest edge are
        cut.
    n_bisections : int
        Most of them.
    tolerance : float
        Relative difference below which lengths are equal.

    Returns
    -------
    number : (q,) array of int
        Tetrahedron of each part, increasing.
    bary : (q, 4, 4) array
    share : (q,) array
    """
    n_fronts = levels.shape[1]
    part_bary, part_x = empty((n_bisections + 1, 4, 4)), empty((n_bisections + 1, 4, 3))
    part_levels, depth = (
        empty((n_bisections + 1, n_fronts, 4, 2)),
        empty(n_bisections + 1, np.int64),
    )
    number, count = empty(4 * len(share) + 16, np.int64), 0
    result, fraction = empty((len(number), 4, 4)), empty(len(number))
    length = empty(6)
    for k in range(len(share)):
        part_bary[0], part_x[0], part_levels[0], depth[0] = bary[k], x[k], levels[k], 0
        top = 0
        while top >= 0:
            volume = share[k] * 0.5 ** depth[top]
            r_min = np.inf
            for i in range(4):
                r_min = min(r_min, _least_radius(part_levels[top], i, i))
            longest_edge, e = 0.0, 0
            for i in range(3):
                for j in range(i + 1, 4):
                    square = 0.0
                    for a in range(3):
                        square += (part_x[top, i, a] - part_x[top, j, a]) ** 2
                    length[e] = math.sqrt(square)
                    longest_edge = max(longest_edge, length[e])
                    e += 1
            if (
                depth[top] == n_bisections
                or r_min >= nearness * math.sqrt(math.sqrt(volume)) * longest_edge
            ):
                if count == len(number):
                    number = np.concatenate((number, np.empty_like(number)))
                    result = np.concatenate((result, np.empty_like(result)))
                    fraction = np.concatenate((fraction, np.empty_like(fraction)))
                number[count], result[count], fraction[count] = k, part_bary[top], volume
                count += 1
                top -= 1
                continue
            first, end, nearest_radius, e = 0, 1, np.inf, 0
            for i in range(3):
                for j in range(i + 1, 4):
                    if length[e] >= (1.0 - tolerance) * longest_edge:
                        r = math.floor(
                            1e7 * _least_radius(part_levels[top], i, j) / longest_edge + 0.5
                        )
                        if r < nearest_radius:
                            first, end, nearest_radius = i, j, r
                    e += 1
            part_bary[top + 1], part_x[top + 1] = part_bary[top], part_x[top]
            part_levels[top + 1] = part_levels[top]
            for a in range(4):
                middle = 0.5 * (part_bary[top, first, a] + part_bary[top, end, a])
                part_bary[top + 1, first, a] = part_bary[top, end, a] = middle
            for a in range(3):
                middle = 0.5 * (part_x[top, first, a] + part_x[top, end, a])
                part_x[top + 1, first, a] = part_x[top, end, a] = middle
            for t in range(n_fronts):
                for a in range(2):
                    middle = 0.5 * (part_levels[top, t, first, a] + part_levels[top, t, end, a])
                    part_levels[top + 1, t, first, a] = part_levels[top, t, end, a] = middle
            depth[top] += 1
            depth[top + 1] = depth[top]
            top += 1
    return number[:count], result[:count], fraction[:count]
