"""A scout: growth in long steps on a coarse mesh, that shows where cracks will run."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import collected_warnings
from xcrack.crack.crack import Crack
from xcrack.fatigue.checks import law_exponent
from xcrack.fatigue.kink import START
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Step, solves_of
from xcrack.growth.step_length import STEPS, first_length
from xcrack.model.problem import Problem

TOLERANCE = 0.1  # of the scout: its path only says where cells are to be small
_MOST_STEPS = 60
_KINKED, _STRAIGHT = 1.0, 8.0  # first steps to cells; those behind a kink are two cells at least


@dataclass(frozen=True, eq=False)
class Stage:
    """Cracks at one step of a scout.

    Attributes
    ----------
    cracks : tuple of Crack
        In the body.
    places : (n, d) array, length
        Tips, or places along the fronts.
    counts : tuple of int
        Number of these of each crack.
    cycles : float
    """

    cracks: tuple[Crack, ...]
    places: Floats
    counts: tuple[int, ...]
    cycles: float


@dataclass(frozen=True, eq=False)
class Scouted:
    """What a scout has seen.

    Attributes
    ----------
    stages : tuple of Stage
    exponent : float
        Of the growth law, at the first step.
    step : (n,) array, length
        Longest edges of cells at the first places that leave room for a short first step.
    """

    stages: tuple[Stage, ...]
    exponent: float
    step: Floats


def scouted(
    rule: GrowthRule,
    scene: Problem,
    steps_of: Callable[[GrowthRule], Generator[Step, None, str]],
    begin: int = 0,
) -> Scouted:
    """Grow the cracks of a run in long steps, as far as they go, whatever stops the run itself.

    Parameters
    ----------
    rule : GrowthRule
    scene : Problem
        On a coarse mesh.
    steps_of : callable
        What makes the steps of a run.
    begin : int
        Number of the step that it goes on from.
    """
    stages: list[Stage] = []
    exponent, first = 1.0, np.zeros(0)
    with collected_warnings([]):  # they are of a mesh that nobody has
        scout = replace(
            rule,
            problem=scene,
            da=None,
            cycles=None,
            tolerance=TOLERANCE,
            max_unknowns=None,
            K_c=None,
            link_up=None,
            max_cycles=None,
            max_size=None,
            max_steps=_MOST_STEPS,
            progress=False,
            scouts=True,
        )
        for step in steps_of(scout):
            if not stages:
                dK_eq, R = np.concatenate(step.dK_eq), np.concatenate(step.R)
                exponent = law_exponent(rule.law, dK_eq, R)
                first = _first_cells(rule, step)
                if begin:  # the run goes on in steps of its own length
                    first = np.full(len(first), np.inf)
            places = np.concatenate([sif.x for sif in step.sif[0]])
            if not len(places):  # all have left the body
                continue
            counts = tuple(len(sif.x) for sif in step.sif[0])
            stages.append(Stage(step.cracks, places, counts, step.cycles))
    return Scouted(tuple(stages), exponent, first)


def _first_cells(rule: GrowthRule, step: Step) -> Floats:
    """Longest edges of cells at the first tips, for the first step that a tolerance asks for."""
    angle = np.concatenate(step.angle)
    if rule.problem.mesh.dim == 3:  # fronts begin without kinks of one cell
        return np.full(len(angle), np.inf)
    scale = solves_of(step)[1].scale
    length = first_length(1.0, STEPS * float(rule.tolerance or 0.0), 0.0) * scale
    return np.where(np.abs(angle) > START, _KINKED, _STRAIGHT) * length


def samples(seen: Scouted, most: int, life: float) -> Ints:
    """Numbers of a few stages that stand for all of them, up to a share of the life.

    What comes then runs through the last of the ligament.
    """
    cycles = np.array([stage.cycles for stage in seen.stages])
    last = int(np.searchsorted(cycles, life * cycles[-1]))
    return np.unique(np.linspace(0, last, min(most, last + 1)).round().astype(np.int64))


__all__ = ["TOLERANCE", "Scouted", "Stage", "samples", "scouted"]
