"""From K of the load states to direction, range, ratio and rate at each place of the cracks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ProblemError, warn
from xcrack.crack.crack import Crack
from xcrack.fatigue.checks import evaluate_criterion, evaluate_law
from xcrack.fatigue.criteria import clipped, equivalent_K, kink_angle, nominal_range
from xcrack.fatigue.law import Law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.block import Answers, Pairs, block_of, left_out_share, pairs_of, rated
from xcrack.growth.follow import following
from xcrack.growth.levels import factors_of, respond_to
from xcrack.growth.options import Run
from xcrack.growth.step import Cycle, PerCrack, Step, StepError
from xcrack.growth.trail import FrontTrail, Kinds, Trail
from xcrack.linalg.reuse import Reuse
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities

# Growth of cracks whose faces rub: ends that friction locks, and histories that it refuses.

_ROUND_OFF = 1e-5  # range over the largest K_eq below which it is the error of a stuck crack


def without_locked(
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
    nu, largest = problem.material.nu, 0.0
    for c in range(len(dK_eq)):
        K = clipped(np.stack([state[c].K for state in sif]))
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
Response = tuple[Sequence[Solution], Answers]


def rates_of(
    run: Run,
    problem: Problem,
    sif: Answers,
    solutions: Sequence[Solution],
    free: Response | None = None,
) -> Rates:
    """Ask criterion and law of a run what K of all load states means.

    Parameters
    ----------
    run : Run
    problem : Problem
        With the cracks that K belongs to.
    sif : sequence of sequence of SIF
        ``sif[state][crack]``.
    solutions : sequence of Solution
        One a state; their factors are the levels of a spectrum.
    free : solutions and SIF, optional
        As of `response_without_contact`, where it is known already.

    Returns
    -------
    angle, dK_eq, R, law_rate : tuple of (f,) arrays
        One array a crack; the rates before a threshold of the run, but for a spectrum, whose cycles
        are held against it one by one.
    """
    _check_choice(run, sif)
    if free is None:
        free = response_without_contact(run, problem, sif, solutions)
    asked = asked_of(run, problem, (solutions, sif), free)
    angles, ranges, ratios, rates = zip(*(one.answer(one.K) for one in asked), strict=True)
    return angles, ranges, ratios, rates


def response_without_contact(
    run: Run, problem: Problem, sif: Answers, solutions: Sequence[Solution]
) -> Response | None:
    """Solutions and K of the scene in which faces may overlap; None where no law asks for them."""
    if getattr(run.law, "ratio", None) != "nominal":
        return None
    return (solutions, sif) if problem.contact == "off" else _without_contact(run, problem)


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
    run: Run, problem: Problem, response: Response, free: Response | None = None
) -> list[Asked]:
    """What criterion and law are asked about each crack.

    Parameters
    ----------
    run : Run
    problem : Problem
    response : solutions and SIF of all states
    free : the same, optional
        Without contact, for a law with nominal R.
    """
    asked = _asked_of_blocks if isinstance(run.cycle, Spectrum) else _asked_of_cycle
    return asked(run, problem, response, free)


def _asked_of_cycle(
    run: Run, problem: Problem, response: Response, free: Response | None
) -> list[Asked]:
    place, nu = following(problem.mesh).PLACE, problem.material.nu

    def one(c: int) -> Asked:
        given = np.stack([state[c].K for state in response[1]])
        a = size_at_places(problem, c, given.shape[1])

        def answer(K: Floats) -> PerPlace:
            angle, dK, R = evaluate_criterion(run.criterion, K, nu, c, place)
            if free is not None:
                dK, R = nominal_range(np.stack([state[c].K for state in free[1]]), angle, nu)
            return angle, dK, R, evaluate_law(run.law, dK, R, c, place, a)

        def turn(K: Floats) -> Floats:
            return evaluate_criterion(run.criterion, K, nu, c, place)[0]

        return Asked(given, answer, turn)

    return [one(c) for c in range(len(problem.placed))]


def _asked_of_blocks(
    run: Run, problem: Problem, response: Response, free: Response | None
) -> list[Asked]:
    place, nu = following(problem.mesh).PLACE, problem.material.nu
    every = pairs_of(run, problem, *response)
    nominal = [None] * len(every) if free is None else pairs_of(run, problem, *free)

    def one(c: int, pairs: Pairs, other: Pairs | None) -> Asked:
        shape = pairs.K.shape
        a = size_at_places(problem, c, shape[2])

        def answer(K: Floats) -> PerPlace:
            cycles = replace(pairs, K=K.reshape(shape))
            return block_of(rated(run, cycles, nu, c, place, a, other), pairs.count)

        def turn(K: Floats) -> Floats:  # the mean of the cycles' directions needs their rates
            return answer(K)[0]

        flat = (shape[0] * shape[1], *shape[2:])  # -1 means nothing where no tip is left
        return Asked(pairs.K.reshape(flat), answer, turn)

    return [one(c, *each) for c, each in enumerate(zip(every, nominal, strict=True))]


def size_at_places(problem: Problem, c: int, n: int) -> Floats:
    """Crack size that a law is given at each place `(n,)`, length.

    In 2D the length inside the body over the number of tips: half of it for a crack with two. In 3D
    the area over the length of the fronts, which for a disc is half of its radius.
    """
    crack = problem.placed[c]
    size = following(problem.mesh).crack_size(crack, problem.mesh)
    tips = max(n, 1) if crack.fronts is None else 1
    return np.full(n, size / tips)


def levels_of(cycle: Cycle | Spectrum, solutions: Sequence[Solution]) -> tuple[float, ...]:
    """Factors of the solved states of a spectrum of factors."""
    if not isinstance(cycle, Spectrum) or cycle.states is not None:
        return ()
    return tuple(factors_of(solutions).tolist())


def warn_of_left_out(run: Run, first: Step) -> None:
    """Say how much growth a spectrum leaves out with its small cycles, if it is worth a word."""
    if not isinstance(run.cycle, Spectrum):
        return
    share = left_out_share(run, first.solutions[0].problem, first.solutions, first.sif)
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


def _check_choice(run: Run, sif: Answers) -> None:
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


def _without_contact(run: Run, problem: Problem) -> Response:
    """Solutions and K of the scene in which crack faces may overlap."""
    free = replace(problem, contact="off")
    return respond_to_cycle(free, run.cycle, run.solver, Reuse())[:2]


def respond_to_cycle(
    problem: Problem, cycle: Cycle | Spectrum, solver: Any, reuse: Reuse, error: bool = False
) -> tuple[tuple[Solution, ...], Answers, Reuse]:
    """Solutions of all load states, K of each crack in each of them, and what serves the next.

    The factor is handed on, but not kept with the solutions; with `error` K has its bars.
    """

    def solve(states: Sequence[Any], reuse: Reuse) -> tuple[tuple[Solution, ...], Answers, Reuse]:
        flat = problem.mesh.dim < 3  # of fronts, the bars need no factor
        solutions = solve_states(
            problem, states, reuse=reuse, solver=solver, repeated=True, error=error and flat
        )
        if isinstance(cycle, Spectrum):
            refuse_friction(problem, solutions)
        handed_on = solutions[0].reuse
        light = handed_on.without_factor()
        solutions = [replace(solution, reuse=light) for solution in solutions]
        by_crack = [stress_intensities(solutions, c, error) for c in range(len(problem.cracks))]
        solutions = [replace(solution, factored=None) for solution in solutions]
        return tuple(solutions), tuple(zip(*by_crack, strict=True)), handed_on

    if isinstance(cycle, Spectrum) and cycle.states is None:
        return respond_to(problem, cycle, solve, reuse)
    return solve(cycle.load_states, reuse)


# What the load states of one crack state say of its growth, and what an integrator makes of it.


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


# The kinds of cycles of a block at the places of the cracks that were solved.


def kinds_of(run: Run, seen: Evaluation) -> list[Kinds]:
    """Range and ratio of each kind of cycle, one `Kinds` of a single solve a crack."""
    problem = seen.problem
    place, nu = following(problem.mesh).PLACE, problem.material.nu
    result = []
    for c, pairs in enumerate(pairs_of(run, problem, seen.solutions, seen.sif)):
        a = size_at_places(problem, c, pairs.K.shape[2])
        every = rated(run, pairs, nu, c, place, a)
        dK, R = (np.ascontiguousarray(each.T)[None] for each in (every.dK, every.R))
        result.append(Kinds(dK, R, a[None]))
    return result


__all__ = [
    "Asked",
    "Evaluation",
    "Settled",
    "asked_of",
    "check_choice",
    "evaluate",
    "kinds_of",
    "levels_of",
    "locked",
    "must_choose",
    "rates_of",
    "refuse_friction",
    "respond_to_cycle",
    "size_at_places",
    "warn_of_left_out",
    "without_locked",
]
