"""Polygons in 2D: ears, crossings, what lies inside; circles and cylinders."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.mesh.simplex import boxes_meet

_ON_CIRCLE = 1e-6  # of a half turn, by which four points on one circle may miss it


def cross(a: Floats, b: Floats) -> Floats:
    """Area of the parallelogram of vectors `(..., 2)`, positive from a to b to the left."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def ear_clipped(polygon: Floats) -> Ints:
    """Triangles `(m - 2, 3)` of a simple polygon `(m, 2)` run through counter-clockwise.

    The best-shaped ear is cut first.
    """
    rest = list(range(len(polygon)))
    triangles = []
    while len(rest) > 3:
        best_shape, ear = -np.inf, -1
        remaining_polygon = polygon[rest]
        previous_corner, next_corner = (
            np.roll(remaining_polygon, 1, axis=0),
            np.roll(remaining_polygon, -1, axis=0),
        )
        area = cross(remaining_polygon - previous_corner, next_corner - remaining_polygon)
        for k in np.nonzero(area > 0)[0]:
            a, b, c = previous_corner[k], remaining_polygon[k], next_corner[k]
            is_within = (
                (cross(b - a, remaining_polygon - a) >= 0)
                & (cross(c - b, remaining_polygon - b) >= 0)
                & (cross(a - c, remaining_polygon - c) >= 0)
            )
            is_within &= (np.abs(remaining_polygon[:, None] - [a, b, c]).max(axis=2) > 0).all(
                axis=1
            )
            longest_square = max(np.sum((b - a) ** 2), np.sum((c - b) ** 2), np.sum((a - c) ** 2))
            if not is_within.any() and area[k] / longest_square > best_shape:
                best_shape, ear = float(area[k] / longest_square), int(k)
        if ear < 0:
            # Only points on one line are left over at this end; they hold no area.
            ear = int(np.argmin(np.abs(area)))
        n = len(rest)
        triangles.append((rest[ear - 1], rest[ear], rest[(ear + 1) % n]))
        del rest[ear]
    triangles.append((rest[0], rest[1], rest[2]))
    return np.array(triangles, dtype=np.int64)


def without_slivers(points: Floats, triangles: Ints, height: Floats | None = None) -> Ints:
    """Triangles `(k, 3)` of points in a plane with diagonals flipped until they are Delaunay's.

    The outline stays (Lawson, 1977, Software for C1 surface interpolation). Triangles run round
    counter-clockwise before and after.

    Parameters
    ----------
    points : (n, 2) array, length
    triangles : (k, 3) array of int
    height : (n,) array, length, optional
        Of the points over the plane: of four on one circle the higher diagonal is taken, which
        depends on the numbers of points no more than the others do.
    """
    heights = np.zeros(len(points)) if height is None else height
    faces = [tuple(int(p) for p in face) for face in triangles]
    for _ in range(len(faces) ** 2):
        owner = {(f[k], f[k - 2]): n for n, f in enumerate(faces) for k in range(3)}
        for (p, q), first in owner.items():
            neighbour = owner.get((q, p))
            if neighbour is None or p > q:
                continue
            a, b = sum(faces[first]) - p - q, sum(faces[neighbour]) - p - q
            corners = [p, q, a, b]
            if _is_flipped(points[corners], heights[corners]):
                faces[first], faces[neighbour] = (a, p, b), (b, q, a)
                break
        else:
            break
    return np.array(faces, dtype=np.int64)


def _is_flipped(points: Floats, height: Floats) -> bool:
    """Whether b of p, q, a, b lies in the circle of p, q, a, beyond pq, and ab may be cut.

    On the circle it is whether ab is higher than pq where they cross.
    """
    p, q, a, b = points
    angles = []
    for corner in (a, b):
        to_p, to_q = p - corner, q - corner
        angles.append(abs(np.arctan2(cross(to_p, to_q), to_p @ to_q)))
    if not (cross(b - p, a - p) > 0 and cross(a - q, b - q) > 0):
        return False
    excess = sum(angles) / np.pi - 1
    if abs(excess) > _ON_CIRCLE:
        return bool(excess > 0)
    base = cross(q - p, b - a)
    t, u = cross(a - p, b - a) / base, cross(a - p, q - p) / base
    gain = (1 - u) * height[2] + u * height[3] - (1 - t) * height[0] - t * height[1]
    return bool(gain > _ON_CIRCLE * np.linalg.norm(q - p))


def self_crossing(polygon: Floats) -> tuple[int, int] | None:
    """Two sides of a closed 2D polygon that meet other than at their common end."""
    m = len(polygon)
    ends = np.roll(polygon, -1, axis=0)
    r = ends - polygon
    cross = r[:, None, 0] * r[None, :, 1] - r[:, None, 1] * r[None, :, 0]
    gap = polygon[None] - polygon[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * r[None, :, 1] - gap[..., 1] * r[None, :, 0]) / cross
        u = (gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / cross
    hit = (t >= -1e-12) & (t <= 1 + 1e-12) & (u >= -1e-12) & (u <= 1 + 1e-12)
    # Of sides on one line t and u are quotients of round-off, however far apart they are.
    length = np.linalg.norm(r, axis=1)
    reach = 1e-12 * float(length.max())
    hit &= boxes_meet(polygon[:, None], ends[:, None], polygon[None], ends[None], reach)
    i, j = np.indices(hit.shape)
    places_between = (i - j) % m
    hit &= (places_between > 1) & (places_between < m - 1)
    # Sides on one line: neighbours that turn back, others that overlap.
    offset = np.abs(gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / length[:, None]
    fraction = np.einsum("ijk,ik->ij", gap, r) / length[:, None] ** 2
    on = (offset <= 1e-12 * length.max()) & (fraction >= -1e-12) & (fraction <= 1 + 1e-12)
    hit |= on & (places_between != 0) & (((j - i) % m) != 1)
    if not hit.any():
        return None
    side, crossed_side = np.argwhere(hit)[0]
    return int(side), int(crossed_side)


def is_within(x: Floats, edges: Floats) -> Bools:
    """Which points of a plane lie inside outlines given by their sides `(k, 2, 2)`."""
    result = np.zeros(len(x), dtype=bool)
    for a, b in edges:
        spans = (a[1] > x[:, 1]) != (b[1] > x[:, 1])
        if spans.any():
            cut = a[0] + (x[spans, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
            result[spans] ^= x[spans, 0] < cut
    return result


# Curves and surfaces that points are projected onto.


@dataclass(frozen=True)
class Arc:
    """A circle in 2D, a cylinder around an axis in 3D: a function that projects onto it.

    Parameters
    ----------
    center : (d,) floats, length
        Centre, or any point of the axis.
    radius : float, length
    axis : (3,) floats, optional
        Direction of a cylinder's axis, of length one.
    """

    center: tuple[float, ...]
    radius: float
    axis: tuple[float, ...] | None = None

    def __call__(self, x: Floats) -> Floats:
        """Nearest points on it `(n, d)`; a point of the axis stays where it is."""
        from_center = x - np.array(self.center)
        if self.axis is not None:
            from_center = from_center - np.outer(from_center @ np.array(self.axis), self.axis)
        distance = np.linalg.norm(from_center, axis=1)
        stretch = self.radius / np.where(distance > 0, distance, np.inf) - (distance > 0)
        return np.asarray(x + stretch[:, None] * from_center)


__all__ = ["Arc"]
