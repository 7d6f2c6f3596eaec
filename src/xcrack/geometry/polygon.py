"""Polygons in 2D: ears, crossings, what lies inside."""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints


def cross(a: Floats, b: Floats) -> Floats:
    """Area of the parallelogram of vectors `(..., 2)`, positive from a to b to the left."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def ear_clipped(polygon: Floats) -> Ints:
    """Triangles `(m - 2, 3)` of a simple polygon `(m, 2)` run through counter-clockwise.

    The best-shaped ear is cut first.
    """
    remaining = list(range(len(polygon)))
    triangles = []
    while len(remaining) > 3:
        best, where = -np.inf, -1
        rest = polygon[remaining]
        before, after = np.roll(rest, 1, axis=0), np.roll(rest, -1, axis=0)
        area = cross(rest - before, after - rest)
        for k in np.nonzero(area > 0)[0]:
            a, b, c = before[k], rest[k], after[k]
            within = (
                (cross(b - a, rest - a) >= 0)
                & (cross(c - b, rest - b) >= 0)
                & (cross(a - c, rest - c) >= 0)
            )
            within &= (np.abs(rest[:, None] - [a, b, c]).max(axis=2) > 0).all(axis=1)
            longest = max(np.sum((b - a) ** 2), np.sum((c - b) ** 2), np.sum((a - c) ** 2))
            if not within.any() and area[k] / longest > best:
                best, where = float(area[k] / longest), int(k)
        if where < 0:
            # Only points on one line are left over at this end; they hold no area.
            where = int(np.argmin(np.abs(area)))
        n = len(remaining)
        triangles.append((remaining[where - 1], remaining[where], remaining[(where + 1) % n]))
        del remaining[where]
    triangles.append((remaining[0], remaining[1], remaining[2]))
    return np.array(triangles, dtype=np.int64)


def self_crossing(flat: Floats) -> tuple[int, int] | None:
    """Two sides of a closed 2D polygon that meet other than at their common end."""
    m = len(flat)
    r = np.roll(flat, -1, axis=0) - flat
    cross = r[:, None, 0] * r[None, :, 1] - r[:, None, 1] * r[None, :, 0]
    gap = flat[None] - flat[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * r[None, :, 1] - gap[..., 1] * r[None, :, 0]) / cross
        u = (gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / cross
    hit = (cross != 0) & (t >= -1e-12) & (t <= 1 + 1e-12) & (u >= -1e-12) & (u <= 1 + 1e-12)
    i, j = np.indices(hit.shape)
    apart = (i - j) % m
    hit &= (apart > 1) & (apart < m - 1)
    # Sides on one line: neighbours that turn back, others that overlap.
    length = np.linalg.norm(r, axis=1)
    off = np.abs(gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / length[:, None]
    along = np.einsum("ijk,ik->ij", gap, r) / length[:, None] ** 2
    on = (off <= 1e-12 * length.max()) & (along >= -1e-12) & (along <= 1 + 1e-12)
    hit |= on & (apart != 0) & (((j - i) % m) != 1)
    if not hit.any():
        return None
    first, second = np.argwhere(hit)[0]
    return int(first), int(second)


def within(x: Floats, edges: Floats) -> Bools:
    """Which points of a plane lie inside outlines given by their sides `(k, 2, 2)`."""
    result = np.zeros(len(x), dtype=bool)
    for a, b in edges:
        spans = (a[1] > x[:, 1]) != (b[1] > x[:, 1])
        if spans.any():
            cut = a[0] + (x[spans, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
            result[spans] ^= x[spans, 0] < cut
    return result
