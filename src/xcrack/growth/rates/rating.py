"""From K of the load states to direction, range, ratio and rate at each place of the cracks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
from xcrack.errors import ProblemError, warn
from xcrack.growth.directions.checks import evaluate_criterion, evaluate_law
from xcrack.growth.directions.nominal import nominal_range
from xcrack.growth.rates.block import Answers, Pairs, block_of, left_out_share, pairs_of, rated
from xcrack.growth.rates.ladder import factors_of, respond_to
from xcrack.growth.steps.advance import PerCrack
from xcrack.growth.steps.friction import refuse_friction
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Cycle, Step
from xcrack.growth.tracking.follow import following
from xcrack.laws.law import Law
from xcrack.scene.problem import Problem
from xcrack.sif.stress_intensity import stress_intensities
from xcrack.solvers.reuse import Reuse
from xcrack.spectra.spectrum import Spectrum

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


__all__ = [
    "Asked",
    "asked_of",
    "check_choice",
    "levels_of",
    "must_choose",
    "rates_of",
    "respond_to_cycle",
    "size_at_places",
    "warn_of_left_out",
]
