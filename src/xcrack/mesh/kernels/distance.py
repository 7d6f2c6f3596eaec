"""Distances of points to polylines."""

import math

import numpy as np

from xcrack.base.kernels.jit import kernel


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
