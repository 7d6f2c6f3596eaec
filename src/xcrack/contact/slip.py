"""Slip that a crack state leaves to the next one of the grown crack.

It is stored by face of the crack and share of the face's length: the last face, along which the
crack was solved, may be corrected, and the slip goes with it. Faces that are new have none.
"""

import numpy as np

from xcrack.arrays import Floats, lock
from xcrack.contact.multipliers import Multipliers
from xcrack.contact.result import Rubbing
from xcrack.solvers.reuse import Slip
from xcrack.xfem.lips import LipPoints, arc_position
from xcrack.xfem.model import Model


def slip_of(model: Model, rubbing: tuple[Rubbing, ...], u: Floats) -> tuple[Slip | None, ...]:
    """Slip of all cracks in one state, None where nothing rubs.

    Parameters
    ----------
    model : Model
    rubbing : tuple of Rubbing
    u : (n_dof,) array, length
    """
    result: list[Slip | None] = [None] * len(model.lips)
    for each in rubbing:
        points = model.space.cracks[each.crack].points
        place = _places(points, model.lips[each.crack])
        result[each.crack] = Slip(points, lock(place), lock(np.asarray(each.jump @ u)))
    return tuple(result)


def weak_slip(model: Model, m: Multipliers, before: Slip | None) -> Floats:
    """Integrals of each function times the slip that was left `(g,)`.

    Parameters
    ----------
    model : Model
    m : Multipliers
    before : Slip or None
        None where nothing was left.
    """
    lips = model.lips[m.crack]
    slip = np.zeros(len(lips))
    if before is not None and len(before.place):
        points = model.space.cracks[m.crack].points
        place = _places(points, lips) - _first(before.points, points)
        inside = (place >= 0) & (place <= len(before.points) - 1)
        slip[inside] = np.interp(place[inside], before.place, before.slip)
    return np.asarray(m.values.T @ (lips.weight * slip))


def _places(points: Floats, lips: LipPoints) -> Floats:
    """Number of the face, plus share of its length `(q,)`."""
    ends = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.interp(arc_position(points, lips.x), ends, np.arange(len(points)))


def _first(old: Floats, new: Floats) -> int:
    """Number of the new point that the first old one is.

    Cracks grow by points at their ends, and corrections move the last ones a little.
    """
    shifts = range(min(0, len(new) - len(old)), max(1, len(new) - len(old) + 1))
    return min(shifts, key=lambda shift: _distance(old, new, shift))


def _distance(old: Floats, new: Floats, shift: int) -> float:
    """Median distance of old points to the new ones that they would be."""
    first, last = max(0, -shift), min(len(old), len(new) - shift)
    return float(
        np.median(np.linalg.norm(old[first:last] - new[first + shift : last + shift], axis=1))
    )


__all__ = ["slip_of", "weak_slip"]
