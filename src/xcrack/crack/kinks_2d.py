"""Kinks of cracks in 2D: vertices at which a polyline turns by more than a curve's chords do."""

import numpy as np

from xcrack.arrays import Floats, Ints

TURN = np.radians(15.0)  # from which on a turn is a kink, and no chord of a curve


def turns(points: Floats) -> Floats:
    """Angles by which a polyline `(n, 2)` turns at its inner points `(n - 2,)`, 0 to pi."""
    along = np.diff(points, axis=0)
    along = along / np.linalg.norm(along, axis=1)[:, None]
    return np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1, 1))


def kink_numbers(points: Floats) -> Ints:
    """Numbers of the points of a polyline `(n, 2)` at which it has a kink."""
    return np.nonzero(turns(points) > TURN)[0] + 1


__all__ = ["TURN", "kink_numbers", "turns"]
