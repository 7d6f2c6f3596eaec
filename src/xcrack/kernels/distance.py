"""Signed distance of points to a polyline."""

import numpy as np

from xcrack.kernels.jit import kernel


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
