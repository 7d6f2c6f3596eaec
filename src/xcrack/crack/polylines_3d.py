"""Sides and tangents of polylines in 3D, open or closed."""

import numpy as np

from xcrack.arrays import Floats


def steps(x: Floats, closed: bool) -> Floats:
    """Vectors from each point of a polyline to the next one."""
    return np.asarray(np.roll(x, -1, axis=0) - x if closed else np.diff(x, axis=0))


def tangents(x: Floats, closed: bool) -> Floats:
    """Unit tangents of the circles through three points in a row, of the sides at open ends."""
    side = steps(x, closed)
    ahead = side if closed else np.concatenate([side, side[-1:]])
    back = np.roll(side, 1, axis=0) if closed else np.concatenate([side[:1], side])
    ahead_length = np.linalg.norm(ahead, axis=1, keepdims=True)
    back_length = np.linalg.norm(back, axis=1, keepdims=True)
    tangent = ahead / ahead_length * back_length + back / back_length * ahead_length
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(tangent / np.where(length > 0, length, 1.0))
