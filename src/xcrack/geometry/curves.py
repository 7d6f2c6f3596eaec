"""Curves and surfaces that points are projected onto."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats


@dataclass(frozen=True)
class Round:
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
        away = x - np.array(self.center)
        if self.axis is not None:
            away = away - np.outer(away @ np.array(self.axis), self.axis)
        distance = np.linalg.norm(away, axis=1)
        stretch = self.radius / np.where(distance > 0, distance, np.inf) - (distance > 0)
        return np.asarray(x + stretch[:, None] * away)


__all__ = ["Round"]
