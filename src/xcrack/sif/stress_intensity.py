"""K of a crack: at its tips in 2D, along its fronts in 3D."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.errors import ProblemError
from xcrack.sif.domain_2d import tip_intensity
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.sif import SIF, joined


def stress_intensity(solution: Solution, crack: int = 0) -> SIF:
    """K_I, K_II and T at the tips, or K_I to K_III along the fronts of a crack, from two domains.

    Parameters
    ----------
    solution : Solution
    crack : int

    Returns
    -------
    SIF

    Raises
    ------
    ProblemError
        No such crack.

    Warns
    -----
    XcrackWarning
        A domain that body or other tips clip below two cells beyond the tip's disc, or two
        domains that differ by more than 1 % of K there.
    """
    return stress_intensities([solution], crack)[0]


def stress_intensities(solutions: Sequence[Solution], crack: int = 0) -> list[SIF]:
    """K of several load states that one solve returned; what is geometry is made once.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    crack : int

    Returns
    -------
    list of SIF

    Raises
    ------
    ProblemError
        No such crack, or solutions of different problems.
    """
    space = solutions[0].space
    if any(solution.space is not space for solution in solutions):
        raise ProblemError("the solutions do not share one space: pass the states of one solve.")
    if not 0 <= crack < len(space.cuts):
        raise ProblemError(
            f"crack {crack}: the problem has {len(space.cuts)} crack(s), numbered from 0."
        )
    # Cycles from nothing are the most common ones: their lower state has no K to look for.
    live = [s for s in solutions if not s.at_rest] or list(solutions[:1])
    intensity = front_intensity if space.dim == 3 else tip_intensity
    ends = [t for t, tip in enumerate(space.tips) if tip.crack == crack]
    by_end = [intensity(live, t) for t in ends]
    by_state = [joined([states[k] for states in by_end], space.dim) for k in range(len(live))]
    place = np.cumsum([not s.at_rest for s in solutions]) - 1
    K, T = np.zeros_like(by_state[0].K), np.where(np.isnan(by_state[0].T), np.nan, 0.0)
    rest = replace(by_state[0], K=K, T=T, spread=K)
    return [rest if s.at_rest else by_state[k] for s, k in zip(solutions, place, strict=True)]
