"""K over the factor of a load: solved at some levels, interpolated between them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from xcrack.analysis.solution import Solution
from xcrack.arrays import Bools, Floats
from xcrack.scene.conditions import InitialStress
from xcrack.scene.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.solvers.reuse import Reuse
from xcrack.spectra.scaling import Level, level
from xcrack.spectra.spectrum import Spectrum

_FIRST = 5  # levels before the first look at what lies between them
_MOST = 33

Answers = tuple[tuple[SIF, ...], ...]
Solve = Callable[[Sequence[Any], Reuse], tuple[tuple[Solution, ...], Answers, Reuse]]


@dataclass(frozen=True, eq=False)
class Ladder:
    """K of one crack over the factor.

    Attributes
    ----------
    levels : (n,) array
        Rising.
    K : (n, f, 2 or 3) array, stress √length
    smooth : bool
        Between the levels a monotone cubic (Fritsch and Butland 1984), else straight lines.
    """

    levels: Floats
    K: Floats
    smooth: bool

    def at(self, factors: Floats) -> Floats:
        """K for some factors `(k,)`: `(k, f, 2 or 3)`; at a level the solved one, to the bit."""
        n = len(self.levels)
        left = np.clip(np.searchsorted(self.levels, factors, side="right") - 1, 0, n - 2)
        if self.smooth and n > 2:
            result = np.asarray(PchipInterpolator(self.levels, self.K, axis=0)(factors))
        else:
            share = (factors - self.levels[left]) / (self.levels[left + 1] - self.levels[left])
            low, high = self.K[left], self.K[left + 1]
            result = low + share[:, None, None] * (high - low)
        nearest = left + (factors == self.levels[left + 1])
        solved = factors == self.levels[nearest]
        result[solved] = self.K[nearest[solved]]
        return result


def respond_to(
    problem: Problem, spectrum: Spectrum, solve: Solve, reuse: Reuse
) -> tuple[tuple[Solution, ...], Answers, Reuse]:
    """Solutions and K at the levels of a spectrum, in the order of their factors.

    Parameters
    ----------
    problem : Problem
    spectrum : Spectrum
        Of factors or rows.
    solve : callable (states, reuse) -> (solutions, sif, reuse)
    reuse : Reuse
        Of the step before.
    """
    low, high = spectrum.extremes
    every = np.unique([spectrum.cycles["min"], spectrum.cycles["max"]])
    exact = is_homogeneous(problem, spectrum) or problem.contact == "off"
    if spectrum.levels != "auto":
        factors = np.linspace(low, high, int(spectrum.levels))
    elif exact:
        factors = np.array([low, high])
    elif len(every) <= _FIRST:
        factors, exact = every, True  # all that is asked for is solved
    else:
        factors = np.linspace(low, high, _FIRST)
    solutions, sif, handed_on = solve(_states(problem, spectrum, factors), reuse)
    if exact or spectrum.levels != "auto" or _is_linear(solutions):
        return solutions, sif, handed_on
    first = handed_on
    steps = list(zip(factors, solutions, sif))
    active = np.ones(len(factors) - 1, dtype=bool)  # intervals in which K may still bend
    while active.any() and len(steps) < _MOST:
        factors = np.array([step[0] for step in steps])
        wanted = np.nonzero(active)[0][: _MOST - len(steps)]
        middle = 0.5 * (factors[wanted] + factors[wanted + 1])
        solutions, answers, handed_on = solve(_states(problem, spectrum, middle), handed_on)
        off = _is_off(factors, [step[2] for step in steps], middle, answers, spectrum.tolerance)
        steps += zip(middle, solutions, answers)
        steps.sort(key=lambda step: step[0])
        bent = {float(m) for m, is_off in zip(middle, off) if is_off}
        factors = np.array([step[0] for step in steps])
        active = np.array([a in bent or b in bent for a, b in zip(factors, factors[1:])])
    # the next step begins with the closed sets of the same first levels
    handed_on = replace(handed_on, centre=first.centre, active=first.active)
    return tuple(step[1] for step in steps), tuple(step[2] for step in steps), handed_on


def ladders(problem: Problem, spectrum: Spectrum, factors: Floats, sif: Answers) -> list[Ladder]:
    """Ladder of each crack, from K at the levels that were solved."""
    linear = len(factors) == 2
    origin = linear and is_homogeneous(problem, spectrum) and factors[0] < 0 < factors[1]
    result = []
    for c in range(len(sif[0])):
        K = np.stack([state[c].K for state in sif])
        if origin:  # K is in proportion to the factor, on both sides with a slope of its own
            K = np.stack([K[0], np.zeros_like(K[0]), K[1]])
            result.append(Ladder(np.array([factors[0], 0.0, factors[1]]), K, smooth=False))
        else:
            result.append(Ladder(factors, K, smooth=not linear))
    return result


def factors_of(solutions: Sequence[Solution]) -> Floats:
    """Factor of each solved level."""
    states = [solution.state for solution in solutions]
    return np.array([s.factor if isinstance(s, Level) else s for s in states], dtype=float)


def is_homogeneous(problem: Problem, spectrum: Spectrum) -> bool:
    """Whether twice the factor gives twice the answer, with contact too."""
    stressed = any(isinstance(load, InitialStress) for load in problem.loads)
    return not spectrum.steady and not stressed


def _states(problem: Problem, spectrum: Spectrum, factors: Floats) -> list[float | Level]:
    if not spectrum.steady:
        return [float(factor) for factor in factors]
    return [level(problem.loads, spectrum.steady, float(factor)) for factor in factors]


def _is_linear(solutions: Sequence[Solution]) -> bool:
    """Whether no crack has contact in any state: its gaps are straight over the factor too."""
    return all(part is None for solution in solutions for part in solution.contact)


def _is_off(
    factors: Floats, sif: Sequence[Sequence[SIF]], middle: Floats, answers: Answers, share: float
) -> Bools:
    """Middles `(k,)` at which K of some place is not what the levels so far say."""
    off = np.zeros(len(middle), dtype=bool)
    for c in range(len(sif[0])):
        K = np.stack([state[c].K for state in sif])
        if K.shape[1] == 0:
            continue
        solved = np.stack([state[c].K for state in answers])
        expected = Ladder(factors, K, smooth=True).at(middle)
        largest = max(float(np.abs(K).max()), np.finfo(float).tiny)
        off |= np.abs(solved - expected).max(axis=(1, 2)) > share * largest
    return off


__all__ = ["Ladder", "factors_of", "is_homogeneous", "ladders", "respond_to"]
