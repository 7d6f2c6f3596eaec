"""From K of the load states to direction, range, ratio and rate at each place of the cracks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import call_function
from xcrack.base.errors import ProblemError, warn
from xcrack.crack.crack import Crack
from xcrack.fatigue.checks import evaluate_criterion, evaluate_law
from xcrack.fatigue.criteria import clipped_K, equivalent_K, kink_angle, nominal_range
from xcrack.fatigue.law import Law
from xcrack.fatigue.retardation import BlockCycles
from xcrack.fatigue.spectrum import Spectrum, distinct
from xcrack.growth.block import RangePairs, block_of, left_out_share, pairs_of, rated
from xcrack.growth.follow import following
from xcrack.growth.levels import respond_to_levels
from xcrack.growth.options import GrowthRule
from xcrack.growth.response import Answers, Response, checked_response, respond
from xcrack.growth.step import Cycle, PerCrack, Step, StepError
from xcrack.growth.trail import FrontTrail, Trail
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF

# Growth of cracks whose faces rub: ends that friction locks, and histories that it refuses.

_ROUND_OFF = 1e-5  # range over the largest K_eq below which it is the error of a stuck crack


def stop_locked_faces(
    problem: Problem,
    solutions: Sequence[Solution],
    sif: Sequence[Sequence[SIF]],
    dK_eq: PerCrack,
    rate: PerCrack,
) -> tuple[PerCrack, PerCrack]:
    """Ranges and rates, zero where the faces beside a tip stick in every state.

    K does not change there: what is left of its range is the error of quadrature, which a crack
    must not grow on. Without friction they stay as they are.

    Parameters
    ----------
    problem : Problem
    solutions : sequence of Solution
        One a state.
    sif : sequence of sequence of SIF
        ``sif[state][crack]``.
    dK_eq, rate : tuple of (f,) arrays
    """
    if not any(problem.frictions):
        return dK_eq, rate
    rubs = [c for c in range(len(dK_eq)) if _rubs(solutions[0], c)]
    if not rubs:
        return dK_eq, rate
    nu, largest = problem.elasticity.poisson, 0.0
    for c in range(len(dK_eq)):
        K = clipped_K(np.stack([state[c].K for state in sif]))
        largest = max(largest, float(equivalent_K(K, kink_angle(K), nu).max(initial=0.0)))
    ranges, rates = list(dK_eq), list(rate)
    for c in rubs:
        still = locked(solutions, c, sif[0][c]) | (dK_eq[c] <= _ROUND_OFF * largest)
        ranges[c] = np.where(still, 0.0, dK_eq[c])
        rates[c] = np.where(still, 0.0, rate[c])
    return tuple(ranges), tuple(rates)


def locked(solutions: Sequence[Solution], c: int, sif: SIF) -> Bools:
    """Ends of crack c beside which the faces stick in every state `(f,)`."""
    lips = solutions[0].lips[c]
    nearest = [int(np.argmin(np.linalg.norm(lips.x - x, axis=1))) for x in sif.x]
    stuck = [s.contact[c].stuck[nearest] for s in solutions]  # type: ignore[union-attr,index]
    return np.asarray(np.all(stuck, axis=0))


def refuse_friction(problem: Problem, solutions: Sequence[Solution]) -> None:
    """Raise where faces rub under a spectrum: K depends on the path, not on the factor alone."""
    for c, mu in enumerate(problem.frictions):
        if mu and _rubs(solutions[0], c):
            raise ProblemError(
                f"grow: a Spectrum with friction on crack {c}, whose faces press: K then depends "
                "on the loads before, and a spectrum takes its cycles one by one. Give "
                "Cycle(states=[...]), or friction=0."
            )


def _rubs(solution: Solution, c: int) -> bool:
    contact = solution.contact[c]
    return contact is not None and contact.shear is not None


_LEFT_OUT = 1e-3  # share of the growth of a block

Rates = tuple[PerCrack, PerCrack, PerCrack, PerCrack]
PerPlace = tuple[Floats, Floats, Floats, Floats]


def rates_of(
    run: GrowthRule, problem: Problem, response: Response, free: Response | None = None
) -> Rates:
    """Ask criterion and law of a run what K of all load states means.

    Parameters
    ----------
    run : GrowthRule
    problem : Problem
        With the cracks that K belongs to.
    response : Response
        Of all load states; of a spectrum its factors are the levels.
    free : Response, optional
        As of `response_without_contact`, where it is known already.

    Returns
    -------
    angle, dK_eq, R, law_rate : tuple of (f,) arrays
        One array a crack; the rates before a threshold of the run, but for a spectrum, whose cycles
        are held against it one by one.
    """
    _check_choice(run, response.sif)
    if free is None:
        free = response_without_contact(run, problem, response)
    asked = asked_of(run, problem, response, free)
    angles, ranges, ratios, rates = zip(*(one.answer(one.K) for one in asked), strict=True)
    return angles, ranges, ratios, rates


def response_without_contact(
    run: GrowthRule, problem: Problem, response: Response
) -> Response | None:
    """Response of the scene in which faces may overlap; None where no law asks for it."""
    if getattr(run.law, "ratio", None) != "nominal":
        return None
    if problem.contact == "off":
        return response
    return respond_to_states(run, replace(problem, contact="off"), SolverState())


@dataclass(frozen=True, eq=False)
class Asked:
    """K of one crack as criterion and law see it, and what they say of K of this shape.

    Attributes
    ----------
    K : (s, f, 2 or 3) array, stress √length
        Of the load states, or of both ends of each kind of cycle of a spectrum.
    answer : callable
        K -> direction, range, ratio, rate at the places, of the cycle or of the block.
    turn : callable
        K -> direction alone.
    """

    K: Floats
    answer: Callable[[Floats], PerPlace]
    turn: Callable[[Floats], Floats]


def asked_of(
    run: GrowthRule, problem: Problem, response: Response, free: Response | None = None
) -> list[Asked]:
    """What criterion and law are asked about each crack.

    Parameters
    ----------
    run : GrowthRule
    problem : Problem
    response : Response
        Of all states.
    free : Response, optional
        Without contact, for a law with nominal R.
    """
    asked = _asked_of_blocks if isinstance(run.cycle, Spectrum) else _asked_of_cycle
    return asked(run, problem, response, free)


def _asked_of_cycle(
    run: GrowthRule, problem: Problem, response: Response, free: Response | None
) -> list[Asked]:
    place, nu = following(problem.mesh).PLACE, problem.elasticity.poisson

    def one(c: int) -> Asked:
        given = np.stack([state[c].K for state in response.sif])
        a = crack_size(problem, c, given.shape[1])

        def answer(K: Floats) -> PerPlace:
            angle, dK, R = evaluate_criterion(run.criterion, K, nu, c, place)
            if free is not None:
                dK, R = nominal_range(np.stack([state[c].K for state in free.sif]), angle, nu)
            return angle, dK, R, evaluate_law(run.law, dK, R, c, place, a)

        def turn(K: Floats) -> Floats:
            return evaluate_criterion(run.criterion, K, nu, c, place)[0]

        return Asked(given, answer, turn)

    return [one(c) for c in range(len(problem.placed))]


def _asked_of_blocks(
    run: GrowthRule, problem: Problem, response: Response, free: Response | None
) -> list[Asked]:
    place, nu = following(problem.mesh).PLACE, problem.elasticity.poisson
    every = pairs_of(run, problem, response)
    nominal = [None] * len(every) if free is None else pairs_of(run, problem, free)

    def one(c: int, pairs: RangePairs, other: RangePairs | None) -> Asked:
        shape = pairs.K.shape
        a = crack_size(problem, c, shape[2])

        def answer(K: Floats) -> PerPlace:
            cycles = replace(pairs, K=K.reshape(shape))
            return block_of(rated(run, cycles, nu, c, place, a, other), pairs.count)

        def turn(K: Floats) -> Floats:  # the mean of the cycles' directions needs their rates
            return answer(K)[0]

        flat = (shape[0] * shape[1], *shape[2:])  # -1 means nothing where no tip is left
        return Asked(pairs.K.reshape(flat), answer, turn)

    return [one(c, *each) for c, each in enumerate(zip(every, nominal, strict=True))]


def crack_size(problem: Problem, c: int, n: int) -> Floats:
    """Crack size that a law is given at each place `(n,)`, length.

    In 2D the length inside the body over the number of tips: half of it for a crack with two. In 3D
    the area over the length of the fronts, which for a disc is half of its radius.
    """
    crack = problem.placed[c]
    size = following(problem.mesh).crack_size(crack, problem.mesh)
    tips = max(n, 1) if crack.fronts is None else 1
    return np.full(n, size / tips)


def levels_of(cycle: Cycle | Spectrum, response: Response) -> tuple[float, ...]:
    """Factors of the solved states of a spectrum of factors."""
    if not isinstance(cycle, Spectrum) or cycle.states is not None:
        return ()
    return tuple(response.factors.tolist())


def warn_of_left_out(run: GrowthRule, first: Step) -> None:
    """Say how much growth a spectrum leaves out with its small cycles, if it is worth a word."""
    if not isinstance(run.cycle, Spectrum):
        return
    response = Response(first.levels or run.cycle.load_states, first.sif)
    share = left_out_share(run, run.problem, response)
    if share > _LEFT_OUT:
        warn(
            f"the cycles that the spectrum leaves out are {share:.2%} of the growth of a block at "
            "the place where they matter most, before the first step: lives are too long by as "
            "much. Omit less to keep them."
        )


def check_choice(law: Law, ratio: float | None) -> None:
    """Refuse a cycle with R < 0 under a law that must know how R is meant, and was not told."""
    if ratio is not None and ratio < 0 and must_choose(law):
        raise ProblemError(_choice(f"the cycle has R = {ratio:.4g}", law))


def must_choose(law: Law) -> bool:
    """Whether R < 0 may mean two things to a law, and it does not say which."""
    return getattr(law, "ratio", "contact") is None and bool(law.knows_negative_ratios)  # type: ignore[attr-defined]


def _check_choice(run: GrowthRule, sif: Answers) -> None:
    """The same, where no factors say R: a tip that is closed in some state has R < 0."""
    if run.cycle.ratio is None and must_choose(run.law):
        closed = any(crack.closed.any() for state in sif for crack in state)
        if closed:
            raise ProblemError(_choice("a load state closes a tip, so that R < 0", run.law))


def _choice(reason: str, law: Law) -> str:
    name = type(law).__name__
    return (
        f"{reason}, and {name} does not say which K its constants belong to: give {name}(..., "
        'ratio="contact") for K as computed with contact, where a closed tip has K = 0, or '
        'ratio="nominal" for constants that were fitted with K_min < 0. The rates differ by up to '
        "a factor of 3."
    )


def respond_to_states(
    run: GrowthRule, problem: Problem, reuse: SolverState, bars: bool = False
) -> Response:
    """Response of a scene to all load states of a run; to the levels of a spectrum of factors."""
    spectrum = run.cycle if isinstance(run.cycle, Spectrum) else None

    def solve(states: Sequence[Any], reuse: SolverState) -> Response:
        if run.response is None:
            response = respond(problem, states, reuse, bars, solver=run.solver)
        else:
            given = call_function(
                run.response, "the response of a step", problem, tuple(states), reuse, bars
            )
            response = checked_response(given, problem, states)
        if spectrum is not None and response.solutions:
            refuse_friction(problem, response.solutions)
        return response

    if spectrum is not None and spectrum.states is None:
        return respond_to_levels(problem, spectrum, solve, reuse)
    return solve(run.cycle.load_states, reuse)


# What the load states of one crack state say of its growth, and what an integrator makes of it.


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Directions and rates of all places of the cracks of a problem.

    Attributes
    ----------
    problem : Problem
        With the cracks as they were advanced; `cracks` are what became of them in the body.
    response : Response
        Of all load states; its K is the best that is known.
    angle, dK_eq, R : tuple of (f,) arrays
        As of `Step`.
    law_rate, rate : tuple of (f,) arrays, length/cycle
        Growth before and after the threshold.
    free : Response, optional
        Without contact, where the law asks for it.
    """

    problem: Problem
    response: Response
    angle: PerCrack
    dK_eq: PerCrack
    R: PerCrack
    law_rate: PerCrack
    rate: PerCrack
    free: Response | None = None

    @property
    def sif(self) -> Answers:
        """K of each state and crack."""
        return self.response.sif

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


def evaluate(run: GrowthRule, problem: Problem, response: Response) -> Evaluation:
    """Ask criterion and law of a run what K of all load states means."""
    free = response_without_contact(run, problem, response)
    angle, dK_eq, R, law_rate = rates_of(run, problem, response, free)
    if response.solutions:
        dK_eq, law_rate = stop_locked_faces(
            problem, response.solutions, response.sif, dK_eq, law_rate
        )
    rate = tuple(np.where(d < run.threshold, 0.0, r) for d, r in zip(dK_eq, law_rate))
    return Evaluation(problem, response, angle, dK_eq, R, law_rate, rate, free)


# The kinds of cycles of a block at the places of the cracks that were solved.


def block_order(run: GrowthRule) -> Ints:
    """Kinds of the cycles of a block, in time `(c,)`, of a run with retardation."""
    assert isinstance(run.cycle, Spectrum)
    return distinct(run.cycle.cycles)[2]


def kinds_of(run: GrowthRule, seen: Evaluation) -> list[BlockCycles]:
    """Range and ratio of each kind of cycle, one `BlockCycles` of a single solve a crack."""
    problem = seen.problem
    place, nu = following(problem.mesh).PLACE, problem.elasticity.poisson
    result = []
    for c, pairs in enumerate(pairs_of(run, problem, seen.response)):
        a = crack_size(problem, c, pairs.K.shape[2])
        every = rated(run, pairs, nu, c, place, a)
        dK, R = (np.ascontiguousarray(each.T)[None] for each in (every.dK, every.R))
        result.append(BlockCycles(dK, R, a[None]))
    return result


__all__ = [
    "Asked",
    "Evaluation",
    "Settled",
    "asked_of",
    "block_order",
    "check_choice",
    "crack_size",
    "evaluate",
    "kinds_of",
    "levels_of",
    "locked",
    "must_choose",
    "rates_of",
    "refuse_friction",
    "respond_to_states",
    "stop_locked_faces",
    "warn_of_left_out",
]
