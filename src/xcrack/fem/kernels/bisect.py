"""Triangles bisected towards points."""

import math

import numpy as np

from xcrack.base.kernels.jit import kernel


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
    stack, deep = np.empty((3 * levels + 4, 3, 3)), np.empty(3 * levels + 4, np.int64)
    triangle, middle, corner = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 2))
    count = 0
    for s in range(len(x)):
        top = 1
        deep[0] = 0
        for i in range(3):
            for b in range(3):
                stack[0, i, b] = 1.0 if i == b else 0.0
        while top > 0:
            top -= 1
            level = deep[top]
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
                if size > _distance(tips[t, 0], tips[t, 1], corner):
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
                deep[top + i] = level + 1
            top += 4
    return count
