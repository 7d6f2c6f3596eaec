"""How long the next step may be for a wanted error of path and life."""

from dataclasses import dataclass

import numpy as np

_LEAST = 1e-3  # a step without any correction does not ask for an endless next one
_SAFE = 0.95
_NOW, _BEFORE = 0.35, 0.15  # exponents of the last error and of the one before
_BEGIN = 2.0  # of the crack, times the root of the tolerance: the first step
_FIRST = 0.5  # exponent after the first step, whose predictor is of first order
_CHANGE, _FIRST_CHANGE = (0.4, 1.6), (0.5, 1.6)
# Cells of the shortest step: straight on, and more behind a right-angled kink, where K on a shorter
# face is that of a kink between two cells.
_STRAIGHT, _KINKED = 0.12, 1.6
_PAST = 0.05  # of the cycles so far: a step of fewer cycles may err by a share of this many
_AHEAD = 0.5  # of the way to the boundary ahead: the longest step
REJECTED = 2.0  # errors from which on a step is done again with a shorter one


@dataclass(frozen=True, eq=False)
class Control:
    """How long the next step may be.

    Attributes
    ----------
    length : float, length
        Largest advance of any tip; inf where no tolerance was asked for.
    error : float or None
        `step_error` of the last step; None where there is none, as before the first.
    least : float, length
        Shortest step that the cells at the fastest tip allow.
    """

    length: float = np.inf
    error: float | None = None
    least: float = 0.0

    @property
    def can_shorten(self) -> bool:
        """Whether the cells leave room for a shorter step."""
        return self.length > 1.001 * self.least


def shortest(cell: float, turn: float) -> float:
    """Shortest step in cells of some size, behind a kink of some angle (rad)."""
    return (_STRAIGHT + _KINKED * float(np.sin(min(abs(turn), np.pi / 2))) ** 2) * cell


def step_error(
    off: float, length: float, off_cycles: float, cycles: float, before: float, tolerance: float
) -> float:
    """Error of a step in units of the tolerance, at least a thousandth.

    Parameters
    ----------
    off : float, length
        Largest estimated error of a tip.
    length : float, length
        Of the step.
    off_cycles, cycles : float
        Estimated error of the cycles of the step, and these.
    before : float
        Cycles before the step.
    tolerance : float
        Of the path, relative to the length grown, and of the life.
    """
    path = off / (length * tolerance)
    whole = max(cycles, _PAST * before)
    life = off_cycles / (whole * tolerance) if whole > 0 else 0.0
    return float(max(path, life, _LEAST))


def first_length(size: float, tolerance: float, least: float) -> float:
    """Length of the first step for a crack of some size, and no less than the least."""
    return float(max(_BEGIN * size * np.sqrt(tolerance), least))


def next_length(length: float, error: float, before: float | None, least: float) -> float:
    """Length of the next step.

    Parameters
    ----------
    length : float, length
        Of the last step.
    error : float
        `step_error` of it.
    before : float or None
        That of the step before; None after the first step, and to do a step again.
    least : float, length

    Returns
    -------
    float, length

    Notes
    -----
    Proportional and integral control (Gustafsson 1991) for a rule of second order.
    """
    if before is None:
        factor = np.clip(_SAFE * error**-_FIRST, *_FIRST_CHANGE)
    else:
        factor = np.clip(_SAFE * error**-_NOW * before**_BEFORE, *_CHANGE)
    return float(max(length * factor, least))


def within(length: float, room: float, least: float) -> float:
    """A length that leaves half of the way to the boundary ahead, but the least at least."""
    return float(max(min(length, _AHEAD * room), least))


__all__ = ["REJECTED", "Control", "first_length", "next_length", "shortest", "step_error", "within"]
