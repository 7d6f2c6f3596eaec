"""Slip that a crack state leaves to the next one of the grown crack.

In 2D it is stored by face of the crack and share of the face's length: the last face, along which
the crack was solved, may be corrected, and the slip goes with it. In 3D it is stored at the points
of the faces. Faces that are new have none.
"""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats, lock
from xcrack.contact.multipliers import Multipliers
from xcrack.contact.result import Rubbing
from xcrack.solvers.reuse import Slip
from xcrack.xfem.lips import LipPoints, arc_position
from xcrack.xfem.model import Model

_OTHER = 0.1  # distance over the length of a crack from which on it is another crack


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
        along = np.stack([jump @ u for jump in each.jumps], axis=1)
        result[each.crack] = _LEFT[model.space.dim](model, each, along)
    return tuple(result)


def weak_slip(model: Model, m: Multipliers, tangents: Floats, before: Slip | None) -> Floats:
    """Integrals of each function times the slip that was left `(d - 1, g)`.

    Parameters
    ----------
    model : Model
    m : Multipliers
    tangents : (q, d - 1, d) array
    before : Slip or None
        None where nothing was left.
    """
    lips = model.lips[m.crack]
    slip = np.zeros((len(lips), tangents.shape[1]))
    if before is not None and len(before.slip):
        slip = _AGAIN[model.space.dim](model, m.crack, tangents, before)
    return np.asarray((m.values.T @ (lips.weight[:, None] * slip)).T)


def _left_2d(model: Model, rubbing: Rubbing, along: Floats) -> Slip:
    points = model.space.cracks[rubbing.crack].points
    place = _places(points, model.lips[rubbing.crack])
    return Slip(points, lock(place), lock(along[:, 0]))


def _left_3d(model: Model, rubbing: Rubbing, along: Floats) -> Slip:
    lips = model.lips[rubbing.crack]
    slip = np.einsum("qm,qmd->qd", along, rubbing.tangents)
    return Slip(lips.x, lock(np.sqrt(lips.weight)), lock(slip))


def _again_2d(model: Model, c: int, tangents: Floats, before: Slip) -> Floats:
    lips, points = model.lips[c], model.space.cracks[c].points
    first = _first(before.points, points)
    whole = np.linalg.norm(np.diff(before.points, axis=0), axis=1).sum()
    if _distance(before.points, points, first) > _OTHER * whole:
        return np.zeros((len(lips), 1))
    place = _places(points, lips) - first
    inside = (place >= 0) & (place <= len(before.points) - 1)
    slip = np.where(inside, np.interp(place, before.place, before.slip), 0.0)
    return np.asarray(slip[:, None])


def _again_3d(model: Model, c: int, tangents: Floats, before: Slip) -> Floats:
    """Of the nearest point before, none farther than its own piece of face is wide."""
    far, nearest = cKDTree(before.points).query(model.lips[c].x)
    slip = np.where((far <= before.place[nearest])[:, None], before.slip[nearest], 0.0)
    return np.einsum("qmd,qd->qm", tangents, slip)


_LEFT = {2: _left_2d, 3: _left_3d}
_AGAIN = {2: _again_2d, 3: _again_3d}


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
