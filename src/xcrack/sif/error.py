"""Error bars of K: from the factor that a solve has kept, or from another one."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.errors import ProblemError
from xcrack.sif.bars import Bars
from xcrack.sif.bars_2d import tip_bars
from xcrack.sif.bars_3d import front_bars
from xcrack.sif.finer_3d import finer_bars
from xcrack.sif.sif import SIF

_Estimate = Callable[[Sequence[Solution], Sequence[SIF], int], list[Bars]]


def with_bars(
    solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int, by: str = ""
) -> list[SIF]:
    """K of one crack in some states with its error bars; zero in states at rest.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one solve. Where it kept no factor, these states are solved again in 2D.
    sifs : sequence of SIF
        One for each.
    crack : int
    by : {"", "front"}
        "front": from a solution with smaller cells along the fronts, in 3D.

    Raises
    ------
    ProblemError
        "front" in 2D.
    """
    live = [k for k, s in enumerate(solutions) if not s.at_rest]
    zero = np.zeros_like(sifs[0].K)
    result = [replace(sif, errors=Bars(zero, zero, ("",) * len(zero))) for sif in sifs]
    if not live:
        return result
    chosen = [solutions[k] for k in live]
    of_dim = _BARS[by].get(chosen[0].space.dim)
    if of_dim is None:
        raise ProblemError(
            'stress_intensity: error="front" is for fronts in 3D: give True, from one solve.'
        )
    for k, bars in zip(live, of_dim(chosen, [sifs[k] for k in live], crack), strict=True):
        result[k] = replace(sifs[k], errors=bars)
    return result


def _of_tips(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[Bars]:
    """In 2D, from the factor."""
    if solutions[0].factored is None:
        problem, states = solutions[0].problem, [s.state for s in solutions]
        solutions = solve_states(problem, states, error=True)
    return tip_bars(solutions, sifs, crack)


_BARS: dict[str, dict[int, _Estimate]] = {
    "": {2: _of_tips, 3: front_bars},
    "front": {3: finer_bars},
}
