"""What the load states of one crack state say of its growth, and what an integrator makes of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.growth.rates.rating import Response, rates_of, response_without_contact
from xcrack.growth.steps.advance import PerCrack
from xcrack.growth.steps.friction import without_locked
from xcrack.growth.steps.front_trail import FrontTrail
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import StepError
from xcrack.growth.steps.trail import Trail
from xcrack.growth.tracking.follow import following
from xcrack.scene.problem import Problem
from xcrack.sif.sif import SIF


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Directions and rates of all places of the cracks of a problem.

    Attributes
    ----------
    problem : Problem
        With the cracks as they were advanced; `cracks` are what became of them in the body.
    sif : tuple of tuple of SIF
        ``sif[state][crack]``.
    angle, dK_eq, R : tuple of (f,) arrays
        As of `Step`.
    law_rate, rate : tuple of (f,) arrays, length/cycle
        Growth before and after the threshold.
    solutions : tuple of Solution
        One for each load state.
    free : solutions and SIF, optional
        Without contact, where the law asks for them.
    """

    problem: Problem
    sif: tuple[tuple[SIF, ...], ...]
    angle: PerCrack
    dK_eq: PerCrack
    R: PerCrack
    law_rate: PerCrack
    rate: PerCrack
    solutions: tuple[Solution, ...] = ()
    free: Response | None = None

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """The cracks in the body."""
        return self.problem.placed

    @cached_property
    def length(self) -> tuple[float, ...]:
        """Size of each crack in the body, length."""
        mesh = self.problem.mesh
        return tuple(following(mesh).crack_size(crack, mesh) for crack in self.cracks)

    def K(self, c: int) -> Floats:
        """Factors at the places of crack c in all states `(s, f, 2 or 3)`."""
        return np.stack([state[c].K for state in self.sif])


@dataclass(frozen=True, eq=False)
class Settled:
    """What an integrator makes of an evaluation.

    Attributes
    ----------
    cycles : float
        Cycles until the corrected cracks are reached.
    corrected : tuple of Crack
        Where growth goes on.
    da, pending : tuple of (f,) arrays, length
        As of `Step` and `Memory`.
    trail : Trail or FrontTrail, optional
    error : StepError, optional
    """

    cycles: float
    corrected: tuple[Crack, ...]
    da: PerCrack
    pending: PerCrack
    trail: Trail | FrontTrail | None = None
    error: StepError | None = None


def evaluate(
    run: Run,
    problem: Problem,
    sif: tuple[tuple[SIF, ...], ...],
    solutions: Sequence[Solution],
) -> Evaluation:
    """Ask criterion and law of a run what K of all load states means."""
    free = response_without_contact(run, problem, sif, solutions)
    angle, dK_eq, R, law_rate = rates_of(run, problem, sif, solutions, free)
    dK_eq, law_rate = without_locked(problem, solutions, sif, dK_eq, law_rate)
    rate = tuple(np.where(d < run.threshold, 0.0, r) for d, r in zip(dK_eq, law_rate))
    return Evaluation(problem, sif, angle, dK_eq, R, law_rate, rate, tuple(solutions), free)


__all__ = ["Evaluation", "Settled", "evaluate"]
