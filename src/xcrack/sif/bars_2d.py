"""Bars of K at tips in 2D: how estimates become half-widths, and where there are none.

The coefficients were fitted to drawn scenes (benchmarks/bars_of_K.py says which), so that the bar
holds in 95 % of them.
"""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.plan import LIPS
from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.sif.bars import Bars, bars_of, no_bars
from xcrack.sif.domain_2d import domain_of
from xcrack.sif.error_2d import TipErrors, tip_errors
from xcrack.sif.sif import SIF

_CAUGHT = 1.3  # exact error over what the blocks of the surplus space give of it, in the median
_ETA, _SHARES, _SPREAD = 1.15, 0.22, 0.35  # half-width over eta, sum of the shares, and spread
_RIM, _CHORDS, _END = 0.1, 1.0, 0.08  # of changes of shape, and of the contact's end
# Cells, by their longest edges: the shortest crack between two tips and from a mouth to a tip, and
# the room between a tip and the next boundary or crack. Of drawn cracks between two tips the bar
# holds in 93 % from 2.8 cells on, in 60 % from 2.5 to 2.8, in 15 % below.
_SHORTEST = {1: 2.0, 2: 2.8}
_ROOM = 1.5


def tip_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[Bars]:
    """Bars of the tips of one crack in some states of a solve that kept its factor.

    Parameters
    ----------
    solutions : sequence of Solution
    sifs : sequence of SIF
        One for each.
    crack : int
    """
    return bars_and_shares(solutions, sifs, crack)[0]


def bars_and_shares(
    solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int
) -> tuple[list[Bars], Floats]:
    """Bars of the tips, and the absolute contributions of the cells to the estimates.

    Parameters
    ----------
    solutions, sifs, crack
        As of `tip_bars`.

    Returns
    -------
    bars : list of Bars
    shares : (states, tips, 2, cells) array, stress · √length
        Zero where there are no estimates.
    """
    shape = sifs[0].K.shape
    general = _unsuited(solutions[0], crack)
    if general or not shape[0]:
        cells = len(solutions[0].problem.mesh.cells)
        return [no_bars(shape, general)] * len(sifs), np.zeros((len(sifs), *shape, cells))
    errors = tip_errors(solutions, crack)
    places = _unresolved(solutions[0], crack)
    bars = [
        _bars(sif, errors, k, places, s)
        for k, (sif, s) in enumerate(zip(sifs, solutions, strict=True))
    ]
    return bars, errors.shares


def _unsuited(solution: Solution, crack: int) -> str:
    """Why a solution has no estimates at all, or nothing."""
    problem = solution.problem
    if solution.space.order == 1:
        return "order 1 has no estimate in 2D: give order=2"
    if solution.contact[crack] is not None and problem.numerics.comparison.lips in LIPS:
        return f"contact by {LIPS[problem.numerics.comparison.lips]} has no estimate"
    return ""


def _unresolved(solution: Solution, crack: int) -> list[str]:
    """Why the mesh at each tip is too coarse for an estimate, or nothing."""
    reasons = []
    tips = [t for t, tip in enumerate(solution.space.tips) if tip.crack == crack]
    least = _SHORTEST[len(tips)]
    length = float(solution.lips[crack].weight.sum())
    for t in tips:
        domain = domain_of(solution, t)
        reason = ""
        if length < least * domain.size:
            reason = (
                f"the crack is {length / domain.size:.1f} cells long, and bars hold from {least:g} "
                "on: refine the mesh there"
            )
        elif domain.room < _ROOM * domain.size:
            reason = (
                f"the next boundary, crack or tip is {domain.room / domain.size:.1f} cells away, "
                f"and bars hold from {_ROOM:g} on: refine the mesh there"
            )
        reasons.append(reason)
    return reasons


def _bars(sif: SIF, errors: TipErrors, k: int, places: Sequence[str], solution: Solution) -> Bars:
    """Bars of one state."""
    own = _CAUGHT * errors.eta[k]
    shape = errors.bend[k] + errors.rim[k]
    eta = own + shape
    shares = errors.shares[k].sum(axis=-1)
    bar = np.maximum(_ETA * np.abs(own), np.maximum(_SHARES * shares, _SPREAD * sif.spread))
    bar += errors.bend_bar[k] + _RIM * np.abs(errors.rim[k]) + _END * errors.end[k]
    if solution.problem.contact != "off":  # negative K_I: faces overlap where contact is blind
        bar[:, 0] = np.maximum(bar[:, 0], np.maximum(-sif.K_I, -sif.K_I - eta[:, 0]))
    reasons = [place or _polygon(errors.chords[k][i], bar[i]) for i, place in enumerate(places)]
    bar += _CHORDS * np.abs(errors.chords[k])
    # K_I of closed tips is zero; its bar is what the integral gave.
    eta[sif.closed, 0] = 0.0
    bar[sif.closed, 0] = np.abs(sif.K_integral[sif.closed, 0])
    return bars_of(eta, bar, reasons)


def _polygon(change: Floats, bar: Floats) -> str:
    """Why a polygon instead of a curve leaves no estimate, or nothing."""
    if np.abs(change).max() <= bar.max():
        return ""
    return (
        "parts of the boundary look like chords of curves, which would change K by "
        f"{np.abs(change).max():.2g}: give the mesh its curves, or refine it there"
    )
