"""Polygons in 2D: ears, crossings, what lies inside."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints


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
        remaining_polygon = polygon[remaining]
        before, after = (
            np.roll(remaining_polygon, 1, axis=0),
            np.roll(remaining_polygon, -1, axis=0),
        )
        area = cross(remaining_polygon - before, after - remaining_polygon)
        for k in np.nonzero(area > 0)[0]:
            a, b, c = before[k], remaining_polygon[k], after[k]
            within = (
                (cross(b - a, remaining_polygon - a) >= 0)
                & (cross(c - b, remaining_polygon - b) >= 0)
                & (cross(a - c, remaining_polygon - c) >= 0)
            )
            within &= (np.abs(remaining_polygon[:, None] - [a, b, c]).max(axis=2) > 0).all(axis=1)
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


def without_slivers(points: Floats, triangles: Ints) -> Ints:
    """Triangles `(k, 3)` of points in a plane with diagonals flipped until they are Delaunay's.

    The outline stays (Lawson, 1977, Software for C1 surface interpolation). Triangles run round
    counter-clockwise before and after.
    """
    faces = [tuple(int(p) for p in face) for face in triangles]
    for _ in range(len(faces) ** 2):
        owner = {(f[k], f[k - 2]): n for n, f in enumerate(faces) for k in range(3)}
        for (p, q), first in owner.items():
            second = owner.get((q, p))
            if second is None or p > q:
                continue
            a, b = sum(faces[first]) - p - q, sum(faces[second]) - p - q
            if _in_circle(*points[[p, q, a, b]]):
                faces[first], faces[second] = (a, p, b), (b, q, a)
                break
        else:
            break
    return np.array(faces, dtype=np.int64)


def _in_circle(p: Floats, q: Floats, a: Floats, b: Floats) -> bool:
    """Whether b lies inside the circle of p, q, a, beyond pq, and the diagonal ab may be cut."""
    angles = []
    for corner in (a, b):
        one, other = p - corner, q - corner
        angles.append(abs(np.arctan2(cross(one, other), one @ other)))
    convex = cross(b - p, a - p) > 0 and cross(a - q, b - q) > 0
    return bool(convex and sum(angles) > np.pi * (1 + 1e-9))


def self_crossing(flat: Floats) -> tuple[int, int] | None:
    """Two sides of a closed 2D polygon that meet other than at their common end."""
    m = len(flat)
    ends = np.roll(flat, -1, axis=0)
    r = ends - flat
    cross = r[:, None, 0] * r[None, :, 1] - r[:, None, 1] * r[None, :, 0]
    gap = flat[None] - flat[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * r[None, :, 1] - gap[..., 1] * r[None, :, 0]) / cross
        u = (gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / cross
    hit = (t >= -1e-12) & (t <= 1 + 1e-12) & (u >= -1e-12) & (u <= 1 + 1e-12)
    # Of sides on one line t and u are quotients of round-off, however far apart they are.
    length = np.linalg.norm(r, axis=1)
    reach = 1e-12 * float(length.max())
    hit &= boxes_meet(flat[:, None], ends[:, None], flat[None], ends[None], reach)
    i, j = np.indices(hit.shape)
    places_between = (i - j) % m
    hit &= (places_between > 1) & (places_between < m - 1)
    # Sides on one line: neighbours that turn back, others that overlap.
    off = np.abs(gap[..., 0] * r[:, None, 1] - gap[..., 1] * r[:, None, 0]) / length[:, None]
    along = np.einsum("ijk,ik->ij", gap, r) / length[:, None] ** 2
    on = (off <= 1e-12 * length.max()) & (along >= -1e-12) & (along <= 1 + 1e-12)
    hit |= on & (places_between != 0) & (((j - i) % m) != 1)
    if not hit.any():
        return None
    first, second = np.argwhere(hit)[0]
    return int(first), int(second)


def is_within(x: Floats, edges: Floats) -> Bools:
    """Which points of a plane lie inside outlines given by their sides `(k, 2, 2)`."""
    result = np.zeros(len(x), dtype=bool)
    for a, b in edges:
        spans = (a[1] > x[:, 1]) != (b[1] > x[:, 1])
        if spans.any():
            cut = a[0] + (x[spans, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
            result[spans] ^= x[spans, 0] < cut
    return result


# Sizes of cells around lines: room between lines, and sizes that grow with the distance.

_PLATEAU = 1.0  # cells around a front that are as small as those at it
_SLOPE = 0.7
_ROOM = 2.0  # cells between two fronts
_CLOSEST = 1 / 16  # of the size of a crack: less room is none
_LEVEL = 2.0**0.25  # sizes closer than this are taken for the smaller one


def points_between(lines: Sequence[Floats]) -> Floats:
    """Points of polylines `(n, 3)`, closer than their edges."""
    share = np.linspace(0, 1, 4)[:, None, None]
    parts = [(x[:-1] + share * (x[1:] - x[:-1])).reshape(-1, 3) for x in lines]
    return np.concatenate([np.zeros((0, 3)), *parts])


def radii(lines: Sequence[Floats], over: float) -> Floats:
    """Radius of curvature at the points of `points_between`, from the turn over a length."""
    result = [np.zeros(0)]
    for x in lines:
        side = np.diff(x, axis=0)
        length = np.linalg.norm(side, axis=1)
        arc = np.concatenate([[0.0], np.cumsum(length)])
        middle, along = (arc[1:] + arc[:-1]) / 2, side / np.maximum(length, 1e-300)[:, None]
        if (x[0] == x[-1]).all():
            middle = np.concatenate([middle - arc[-1], middle, middle + arc[-1]])
            along = np.concatenate([along, along, along])
        s = (arc[:-1] + np.linspace(0, 1, 4)[:, None] * length).ravel()
        before, after = (
            np.stack([np.interp(s + way, middle, part) for part in along.T], axis=1)
            for way in (-over / 2, over / 2)
        )
        cosine = np.einsum("ij,ij->i", before, after)
        cosine /= np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1) + 1e-300
        result.append(over / np.maximum(np.arccos(np.clip(cosine, -1, 1)), 1e-12))
    return np.concatenate(result)


def with_room(places: Sequence[Floats], sizes: Sequence[Floats]) -> list[Floats]:
    """Sizes at the places of each crack, less where those of another one are close."""
    result = []
    for c, (x, size) in enumerate(zip(places, sizes, strict=True)):
        others = np.concatenate([np.zeros((0, 3)), *places[:c], *places[c + 1 :]])
        distance = (
            cKDTree(others).query(x)[0] if len(others) and len(x) else np.full(len(x), np.inf)
        )
        result.append(np.minimum(size, np.maximum(distance / _ROOM, _CLOSEST * size)))
    return result


def graded_sizes(places: Sequence[Floats], sizes: Sequence[Floats]) -> Callable[[Floats], Floats]:
    """Longest edges wanted at points, from those at places `(n, 3)` of each crack."""
    trees = []
    for x, size in zip(places, sizes, strict=True):
        if not len(x):
            continue
        level = np.floor(np.log(size.max() / size) / np.log(_LEVEL) + 1e-9)
        for step in np.unique(level):
            is_of_step = level == step
            trees.append((cKDTree(x[is_of_step]), float(size[is_of_step].min())))

    def wanted_size(x: Floats) -> Floats:
        each = [h + _SLOPE * np.maximum(tree.query(x)[0] - _PLATEAU * h, 0) for tree, h in trees]
        return np.asarray(np.min(each, axis=0)) if each else np.full(len(x), np.inf)

    return wanted_size


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


# Distances of points to segments and triangles.


def distance_to_simplices(x: Floats, corners: Floats) -> Floats:
    """Distance of one or k points to segments `(k, 2, d)` or triangles `(k, 3, d)`."""
    a, b = corners[:, 0], corners[:, 1]
    if corners.shape[1] == 2:
        return np.linalg.norm(x - closest_on_segment(x, a, b), axis=1)
    c = corners[:, 2]
    normal = np.cross(b - a, c - a)
    area = np.einsum("kd,kd->k", normal, normal)
    v = np.einsum("kd,kd->k", np.cross(b - a, x - a), normal) / area
    w = np.einsum("kd,kd->k", np.cross(x - a, c - a), normal) / area
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    plane = np.abs(np.einsum("kd,kd->k", x - a, normal)) / np.sqrt(area)
    edges = np.min(
        [
            np.linalg.norm(x - closest_on_segment(x, p, q), axis=1)
            for p, q in ((a, b), (b, c), (c, a))
        ],
        axis=0,
    )
    return np.where(inside, plane, edges)


def closest_on_segment(x: Floats, a: Floats, b: Floats) -> Floats:
    """Closest points on segments a b `(..., d)` to x."""
    along = b - a
    square = np.maximum((along * along).sum(axis=-1), 1e-300)
    t = np.clip(((x - a) * along).sum(axis=-1) / square, 0, 1)
    return np.asarray(a + t[..., None] * along)


def boxes_meet(a: Floats, b: Floats, c: Floats, d: Floats, reach: float = 0.0) -> Bools:
    """Whether the boxes along the axes around segments ab and cd `(..., d)` come within a reach."""
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray((low <= high + reach).all(axis=-1))


__all__ = ["Arc", "graded_sizes", "points_between", "with_room"]
