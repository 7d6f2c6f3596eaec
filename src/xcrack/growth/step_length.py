"""How long the next step may be: as it was asked for, and for a wanted error of path and life."""

import numpy as np

from xcrack.growth.options import GrowthRule
from xcrack.growth.step import StepControl

PATH = 0.75  # of it in the path, which K has less in
STEPS = 0.6  # of the tolerance: what the length of the steps may take
REJECTED = 1.8  # errors from which on a step is done again with a shorter one
# Of a correction: more than the error that is left, on nearly all scenes, in equal steps and in
# those of a tolerance, which are fewer and change their length.
_LEFT, _LEFT_OF_FEW = 0.25, 0.6

_LEAST = 1e-3  # a step without any correction does not ask for an endless next one
_SAFE = 0.95
_NOW, _BEFORE = 0.25, -0.15  # exponents of the last error and of the one before
_BEGIN = 2.0  # of the crack, times the root of the tolerance: the first step
_FIRST = 0.5  # exponent after the first step, whose predictor is of first order
_CHANGE, _FIRST_CHANGE = (0.4, 2.0), (0.5, 3.0)
# Cells of the shortest step: straight on, and more behind a right-angled kink, where K on a shorter
# face is that of a kink between two cells.
_STRAIGHT, _KINKED = 0.12, 1.6
# Of the cycles and of the way so far: a step of less may err by a share of this many.
PAST, _PAST_WAY = 0.15, 0.2
# Of the way to the boundary ahead: the longest step, and that times the cube root of the tolerance,
# as K changes over such a way, and errs by the third power of a step.
_AHEAD, _AHEAD_OF_FEW = 0.7, 3.2
_AHEAD_AT_FIRST = 0.5  # of it: the first step, before a second K says how fast it changes
_LIGAMENT = 0.2  # of the tolerance: cycles of a last ligament that no K need be known for


def cell_for(length: float, turn: float) -> float:
    """Size of cells that leave room for a step, behind a kink of some angle (rad)."""
    return length / shortest_length(1.0, turn)


def shortest_length(cell: float, turn: float) -> float:
    """Shortest step in cells of some size, behind a kink of some angle (rad)."""
    return (_STRAIGHT + _KINKED * float(np.sin(min(abs(turn), np.pi / 2))) ** 2) * cell


def step_error(
    path_error: float,
    length: float,
    off_cycles: float,
    cycles: float,
    cycles_before: float,
    tolerance: float,
    way: float = 0.0,
) -> float:
    """Error of a step in units of the tolerance, at least a thousandth.

    Parameters
    ----------
    path_error : float, length
        Largest estimated error of a tip.
    length : float, length
        Of the step.
    off_cycles, cycles : float
        Estimated error of the cycles of the step, and these.
    cycles_before : float
        Cycles before the step.
    tolerance : float
        Of the path, relative to the length grown, and of the life.
    way : float, length
        Grown before the step.
    """
    path = path_error / (max(length, _PAST_WAY * way) * tolerance)
    whole_cycles = max(cycles, PAST * cycles_before)
    life = off_cycles / (whole_cycles * tolerance) if whole_cycles > 0 else 0.0
    return float(max(path, life, _LEAST))


def first_length(size: float, tolerance: float, least_length: float) -> float:
    """Length of the first step for a crack of some size, and no less than the least."""
    return float(max(_BEGIN * size * np.sqrt(tolerance), least_length))


def next_length(
    length: float, error: float, error_before: float | None, least_length: float
) -> float:
    """Length of the next step.

    Parameters
    ----------
    length : float, length
        Of the last step.
    error : float
        `step_error` of it.
    error_before : float or None
        That of the step before; None after the first step, and to do a step again.
    least_length : float, length

    Returns
    -------
    float, length

    Notes
    -----
    Proportional and integral control (Gustafsson 1991) for a rule of second order.
    """
    if error_before is None:
        factor = np.clip(_SAFE * error**-_FIRST, *_FIRST_CHANGE)
    else:
        factor = np.clip(_SAFE * error**-_NOW * error_before**_BEFORE, *_CHANGE)
    return float(max(length * factor, least_length))


def longest_advance(rule: GrowthRule, control: StepControl) -> float:
    """Largest advance of any end in the next step, length; inf where only cycles limit it."""
    return min(np.inf if rule.da is None else rule.da, control.length)


def share_left(rule: GrowthRule) -> float:
    """Share of a correction that is left as an error."""
    return _LEFT if rule.tolerance is None else _LEFT_OF_FEW


def first_control(rule: GrowthRule, size: float, least_length: float, room: float) -> StepControl:
    """Length of the first step, and of the first after K has jumped.

    Parameters
    ----------
    rule : GrowthRule
    size : float, length
        Of the smallest crack.
    least_length, room : float, length
        Shortest step, and the way to the boundary ahead of the fastest tip.
    """
    if rule.tolerance is None:
        return StepControl()
    length = first_length(size, STEPS * rule.tolerance, least_length)
    return StepControl(
        _length_in_room(rule, length, room, least_length, _AHEAD_AT_FIRST), None, least_length
    )


def next_control(
    rule: GrowthRule,
    last_control: StepControl,
    length: float,
    path_error: float,
    off_cycles: float,
    cycles: float,
    cycles_before: float,
    least_length: float,
    room: float,
    way: float = 0.0,
) -> StepControl:
    """Length of the step after one whose errors are estimated.

    Parameters
    ----------
    rule : GrowthRule
    last_control : StepControl
        Of the step that is done.
    length, path_error, off_cycles, cycles, cycles_before, way
        As of `step_error`.
    least_length, room
        As of `first_control`.
    """
    if rule.tolerance is None:
        return StepControl()
    error = step_error(
        path_error * STEPS / PATH,
        length,
        off_cycles,
        cycles,
        cycles_before,
        STEPS * rule.tolerance,
        way,
    )
    target = next_length(length, error, last_control.error, least_length)
    return StepControl(_length_in_room(rule, target, room, least_length), error, least_length)


def leaves(rule: GrowthRule, room: float, rate: float, cycles: float) -> bool:
    """Whether the ligament ahead of a tip takes so few cycles that it may leave in one step."""
    if rule.tolerance is None:
        return False
    return room <= _LIGAMENT * rule.tolerance * cycles * rate


def _length_in_room(
    rule: GrowthRule, length: float, room: float, least_length: float, most_of_room: float = _AHEAD
) -> float:
    """A length that leaves some of the way to the boundary ahead, but the least at least."""
    share = min(most_of_room, _AHEAD_OF_FEW * (STEPS * float(rule.tolerance or 1.0)) ** (1 / 3))
    return float(max(min(length, share * room), least_length))


__all__ = [
    "PAST",
    "PATH",
    "REJECTED",
    "STEPS",
    "cell_for",
    "first_control",
    "first_length",
    "leaves",
    "longest_advance",
    "next_control",
    "next_length",
    "share_left",
    "shortest_length",
    "step_error",
]
