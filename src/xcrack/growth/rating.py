"""From K of the load states to direction, range, ratio and rate at each place of the cracks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.growth.advance import PerCrack
from xcrack.growth.checks import evaluate_criterion, evaluate_law
from xcrack.growth.follow import following
from xcrack.growth.options import Run
from xcrack.laws.law import Law
from xcrack.scene.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities

Rates = tuple[PerCrack, PerCrack, PerCrack, PerCrack]
Answers = Sequence[Sequence[SIF]]  # of each state, of each crack


def rates_of(run: Run, problem: Problem, sif: Answers) -> Rates:
    """Ask criterion and law of a run what K of all load states means.

    Parameters
    ----------
    run : Run
    problem : Problem
        With the cracks that K belongs to.
    sif : sequence of sequence of SIF
        ``sif[state][crack]``.

    Returns
    -------
    angle, dK_eq, R, law_rate : tuple of (f,) arrays
        One array a crack; the rates before a threshold of the run.
    """
    place, nu = following(problem.mesh).PLACE, problem.material.nu
    nominal = sif
    if getattr(run.law, "ratio", None) == "nominal" and problem.contact != "off":
        nominal = _without_contact(run, problem)
    _check_choice(run, sif)
    parts = []
    for c in range(len(problem.placed)):
        K = np.stack([state[c].K for state in sif])
        angle, dK, R = evaluate_criterion(run.criterion, K, nu, c, place)
        if getattr(run.law, "ratio", None) == "nominal":
            dK, R = nominal_range(np.stack([state[c].K for state in nominal]), angle, nu)
        a = size_at_places(problem, c, len(dK))
        parts.append((angle, dK, R, evaluate_law(run.law, dK, R, c, place, a)))
    angles, ranges, ratios, rates = zip(*parts, strict=True)
    return angles, ranges, ratios, rates


def nominal_range(K: Floats, angle: Floats, nu: float) -> tuple[Floats, Floats]:
    """Range and ratio of a crack whose faces may overlap, R < 0 included.

    Parameters
    ----------
    K : (s, f, 2 or 3) array, stress √length
        Of the scene without contact.
    angle : (f,) array, rad
        Direction at each place.
    nu : float

    Returns
    -------
    dK_eq : (f,) array, stress √length
    R : (f,) array
        0 where no state opens the place; the range is 0 there too.

    Notes
    -----
    K_eq as of `equivalent_K`, but for its sign: where the hoop stress is compressive it is the
    bracket of Erdogan and Sih alone, and negative.
    """
    cos, sin = np.cos(angle / 2), np.sin(angle / 2)
    K_eq = cos**2 * (K[..., 0] * cos - 3 * K[..., 1] * sin)
    if K.shape[-1] == 3:
        K_eq = np.where(K_eq >= 0, np.hypot(K_eq, K[..., 2] / np.sqrt(1 - nu)), K_eq)
    largest, smallest = K_eq.max(axis=0), K_eq.min(axis=0)
    opens = largest > 0
    R = np.divide(smallest, largest, out=np.zeros_like(largest), where=opens)
    return np.where(opens, largest - smallest, 0.0), R


def size_at_places(problem: Problem, c: int, n: int) -> Floats:
    """Crack size that a law is given at each place `(n,)`, length.

    In 2D the length inside the body over the number of tips: half of it for a crack with two. In 3D
    the area over the length of the fronts, which for a disc is half of its radius.
    """
    crack = problem.placed[c]
    size = following(problem.mesh).crack_size(crack, problem.mesh)
    tips = max(n, 1) if crack.fronts is None else 1
    return np.full(n, size / tips)


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


def _without_contact(run: Run, problem: Problem) -> tuple[tuple[SIF, ...], ...]:
    """K of all states of the scene in which crack faces may overlap."""
    free = replace(problem, contact="off")
    solutions = solve_states(free, run.cycle.load_states, solver=run.solver)
    by_crack = [stress_intensities(solutions, c) for c in range(len(problem.cracks))]
    return tuple(zip(*by_crack, strict=True))


__all__ = [
    "check_choice",
    "must_choose",
    "nominal_range",
    "rates_of",
    "size_at_places",
]
