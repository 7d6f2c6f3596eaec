"""Distances of points to segments and triangles."""

import numpy as np

from xcrack.arrays import Floats


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
