"""Segments: split where cracks cross them, and points on them that are graded towards tips."""

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
