"""Segments and polylines: split by cracks, graded points on them, distances to them."""

import math

import numpy as np

from xcrack.base.kernels.jit import kernel

_FOOT = 1e-9  # share of a segment within which a foot at its end is the end
_ROUND_OFF = 1e-15  # of coordinates, as a share of the largest of them


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
        nearest, least = -1, np.inf
        for t in range(len(tips)):
            a, b = middle0 - tips[t, 0], middle1 - tips[t, 1]
            distance = math.sqrt(a * a + b * b)
            if distance < least:
                nearest, least = t, distance
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
            closest = min(max(foot, 0.0), 1.0)
            a = begin[s, 0] + closest * x - tips[nearest, 0]
            b = begin[s, 1] + closest * y - tips[nearest, 1]
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
def split(ends, cut, level):  # type: ignore[no-untyped-def]
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
def polyline_distance(x, vertices):  # type: ignore[no-untyped-def]
    """Signed distance to a polyline, positive on its left, and the closest segment.

    At a vertex the sign comes from the mean of the normals of its two segments.

    Parameters
    ----------
    x : (n, 2) array
    vertices : (p, 2) array

    Returns
    -------
    phi : (n,) array
    segment : (n,) array of int
    """
    n, last = len(x), len(vertices) - 2
    phi = np.empty(n)
    segment = np.empty(n, np.int64)
    length = np.empty(last + 1)
    ex = np.empty(last + 1)
    ey = np.empty(last + 1)
    for s in range(last + 1):
        dx = vertices[s + 1, 0] - vertices[s, 0]
        dy = vertices[s + 1, 1] - vertices[s, 1]
        length[s] = np.sqrt(dx * dx + dy * dy)
        ex[s] = dx / length[s]
        ey[s] = dy / length[s]
    for i in range(n):
        best = np.inf
        where = 0
        at = 0.0
        for s in range(last + 1):
            gx = x[i, 0] - vertices[s, 0]
            gy = x[i, 1] - vertices[s, 1]
            along = gx * ex[s] + gy * ey[s]
            if along < 0.0:
                along = 0.0
            elif along > length[s]:
                along = length[s]
            rx = gx - along * ex[s]
            ry = gy - along * ey[s]
            square = rx * rx + ry * ry
            if square < best:
                best = square
                where = s
                at = along
        s = where
        gx = x[i, 0] - vertices[s, 0]
        gy = x[i, 1] - vertices[s, 1]
        normal_part = ey[s] * -gx + ex[s] * gy
        segment[i] = s
        if 0.0 < at < length[s]:
            phi[i] = normal_part
            continue
        other = s
        if at == 0.0 and s > 0:
            other = s - 1
        elif at >= length[s] and s < last:
            other = s + 1
        rx = gx - at * ex[s]
        ry = gy - at * ey[s]
        sign = (-ey[s] - ey[other]) * rx + (ex[s] + ex[other]) * ry
        phi[i] = np.copysign(np.sqrt(best), sign)
    return phi, segment


@kernel
def nearest_vertices(x, vertices, bound):  # type: ignore[no-untyped-def]
    """Nearest vertex of a polyline to each point.

    The polyline is divided into stretches, each within a radius of its middle vertex. The stretch
    of the point before is looked at first: points in the order of their cells leave few others
    that may come nearer.

    Parameters
    ----------
    x : (n, d) array
    vertices : (p, d) array
    bound : float
        Points farther than this from all vertices have none.

    Returns
    -------
    nearest : (n,) array of int
        -1 where there is none.
    distance : (n,) array
        inf where there is none.
    """
    n, count, dim = len(x), len(vertices), x.shape[1]
    each = max(1, int(0.6 * math.sqrt(count)))
    stretches = (count + each - 1) // each
    middle, reach = np.empty((stretches, dim)), np.zeros(stretches)
    for b in range(stretches):
        first, end = b * each, min(count, (b + 1) * each)
        for j in range(dim):
            middle[b, j] = vertices[(first + end) // 2, j]
        for v in range(first, end):
            square = 0.0
            for j in range(dim):
                square += (vertices[v, j] - middle[b, j]) ** 2
            reach[b] = max(reach[b], math.sqrt(square) * (1.0 + 1e-12))
    nearest, distance = np.full(n, -1, np.int64), np.full(n, np.inf)
    start = 0
    for i in range(n):
        best, least, where = bound, bound * bound, -1
        for k in range(-1, stretches):
            b = start if k < 0 else k
            if k == start:
                continue
            square = 0.0
            for j in range(dim):
                square += (x[i, j] - middle[b, j]) ** 2
            if square >= (best + reach[b]) ** 2:
                continue
            closer = False
            for v in range(b * each, min(count, (b + 1) * each)):
                square = 0.0
                for j in range(dim):
                    square += (x[i, j] - vertices[v, j]) ** 2
                if square < least:
                    least, where, closer = square, v, True
            if closer:
                best = math.sqrt(least)
        if where >= 0:
            nearest[i], distance[i] = where, best
            start = where // each
    return nearest, distance
