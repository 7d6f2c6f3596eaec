"""K over the factor of a load: solved at some levels, interpolated between them."""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.growth.rates.levels import Answers, Ladder, Solve, refined, states_of
from xcrack.scene.conditions import InitialStress
from xcrack.scene.problem import Problem
from xcrack.solvers.reuse import Reuse
from xcrack.spectra.scaling import Level
from xcrack.spectra.spectrum import Spectrum

_FIRST = 5  # levels before the first look at what lies between them


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
    if exact or spectrum.levels != "auto":
        return solve(states_of(problem, spectrum, factors), reuse)
    return refined(problem, spectrum, factors, solve, reuse)


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


__all__ = ["Ladder", "factors_of", "is_homogeneous", "ladders", "respond_to"]
