"""Lengths of steps of a run: as it was asked for, and as a tolerance allows."""

from dataclasses import replace
from typing import Any

import numpy as np

from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Step, memory_of
from xcrack.growth.trail import (
    REJECTED,
    StepControl,
    first_length,
    next_length,
    step_error,
    within,
)

PATH = 0.75  # of it in the path, which K has less in
STEPS = 0.5  # of the tolerance: what the length of the steps may take
# Of a correction: more than the error that is left, on nearly all scenes, in equal steps and in
# those of a tolerance, which are fewer and change their length.
_LEFT, _LEFT_OF_FEW = 0.25, 0.6


def longest(run: GrowthRule, control: StepControl) -> float:
    """Largest advance of any tip in the next step, length; inf where only cycles limit it."""
    return min(np.inf if run.da is None else run.da, control.length)


def share_left(run: GrowthRule) -> float:
    """Share of a correction that is left as an error."""
    return _LEFT if run.tolerance is None else _LEFT_OF_FEW


def first(run: GrowthRule, size: float, least: float, room: float) -> StepControl:
    """Length of the first step, and of the first after K has jumped.

    Parameters
    ----------
    run : GrowthRule
    size : float, length
        Of the smallest crack.
    least, room : float, length
        Shortest step, and the way to the boundary ahead of the fastest tip.
    """
    if run.tolerance is None:
        return StepControl()
    length = first_length(size, STEPS * run.tolerance, least)
    return StepControl(within(length, room, least), None, least)


def following(
    run: GrowthRule,
    last: StepControl,
    length: float,
    off: float,
    off_cycles: float,
    cycles: float,
    before: float,
    least: float,
    room: float,
) -> StepControl:
    """Length of the step after one whose errors are estimated.

    Parameters
    ----------
    run : GrowthRule
    last : StepControl
        Of the step that is done.
    length, off, off_cycles, cycles, before
        As of `step_error`.
    least, room
        As of `first`.
    """
    if run.tolerance is None:
        return StepControl()
    error = step_error(
        off * STEPS / PATH, length, off_cycles, cycles, before, STEPS * run.tolerance
    )
    wanted = next_length(length, error, last.error, least)
    return StepControl(within(wanted, room, least), error, least)


def shortened(last: Step, next_step: Step) -> Step | None:
    """The step before one whose error is too large, with a shorter way ahead; None if that is not.

    It follows from what is stored with both: a run that is taken up again does the same.
    """
    old, new = (memory_of(step).trail for step in (last, next_step))
    if old is None or new is None or new.control.error is None:
        return None
    control = old.control
    if new.control.error <= REJECTED or not control.can_shorten:
        return None
    length = next_length(control.length, new.control.error, None, control.least)
    trail: Any = replace(old, control=replace(control, length=length))
    return replace(last, memory=replace(memory_of(last), trail=trail))


def can_be_shortened(last: Step) -> bool:
    """Whether cells leave room for a shorter step after one."""
    trail = memory_of(last).trail
    return trail is not None and trail.control.can_shorten


__all__ = [
    "PATH",
    "STEPS",
    "can_be_shortened",
    "first",
    "following",
    "longest",
    "share_left",
    "shortened",
]
