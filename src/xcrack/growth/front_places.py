"""Values at the places along the fronts of 3D cracks: how they move, and come to other places."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats
from xcrack.crack.crack import Crack
from xcrack.growth.follow_3d import interpolate_along_front
from xcrack.growth.trail import Places
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh

REACH = 2.0  # cells from a place along a front to those that values are carried from


@dataclass(frozen=True, eq=False)
class Later:
    """What was solved at the end of a step, at the places of its beginning.

    Attributes
    ----------
    rate, law_rate : (f,) arrays, length/cycle
        nan in law_rate where a place has left the body.
    direction : (f, 3) array
    way : (f,) array, length
        Predicted advance.
    """

    rate: Floats
    law_rate: Floats
    direction: Floats
    way: Floats


def move_of(part: Places, angle: Floats, way: Floats) -> Floats:
    """Moves `(f, 3)` of places by ways at angles."""
    t, n = part.frame[:, 0], part.frame[:, 1]
    return way[:, None] * (np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * n)


def front_lengths(crack: Crack) -> Floats:
    """Length of each front, length."""
    fronts = [crack.points[front] for front in crack.fronts or ()]
    return np.array([np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x in fronts])


def interpolate_within_reach(
    part: Places, closed: Bools, values: Floats, x: Floats, mesh: Mesh
) -> Floats:
    """Values of places at points `(f, 3)` beside them; nan where there are none."""
    if not len(part.x):
        return np.full(len(x), np.nan)
    reach = REACH * float(cell_sizes(mesh, part.x).mean())
    return interpolate_along_front(part.x, part.front, closed.tolist(), values, x, reach)


__all__ = ["REACH", "Later", "front_lengths", "interpolate_within_reach", "move_of"]
