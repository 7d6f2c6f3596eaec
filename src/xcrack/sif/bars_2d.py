"""Bars of K at tips in 2D: how estimates become half-widths, and where there are none.

The coefficients were fitted to drawn scenes (benchmarks/bars_of_K.py says which), so that the bar
holds in 95 % of them.
"""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.plan import LIPS
from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats, at
from xcrack.mesh.locate import cell_sizes
from xcrack.sif.bars import Bars, bars_of, no_bars
from xcrack.sif.domain_2d import domain_of
from xcrack.sif.error_2d import TipErrors, kinks_inside, tip_errors
from xcrack.sif.sif import SIF

_CAUGHT = 1.3  # exact error over what the blocks of the surplus space give of it, in the median
_ETA, _SHARES, _SPREAD = 1.3, 0.25, 0.4  # half-width over eta, sum of the shares, and spread
_RIM, _CHORDS, _END = 0.1, 1.0, 0.1  # of changes of shape, and of the contact's end
# Cells, by their longest edges: the shortest crack between two tips and from a mouth to a tip, and
# the room between a tip and the next boundary or crack. Of drawn cracks between two tips the bar
# holds in 93 % from 2.8 cells on, in 60 % from 2.5 to 2.8, in 15 % below.
_SHORTEST = {1: 2.0, 2: 2.8}
_ROOM = 1.5
_OVERLAP = 0.02  # share of an overlap at one tip, as its negative K_I, that counts at all tips
# Of the shares of cells at kinks, whose functions catch a part only of what is singular, and of
# what moving the crack onto its kinks changes where faces press: no estimate has a sign there.
_AT_KINKS, _MOVED = 6.0, 2.0


def tip_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[Bars]:
    """Bars of the tips of one crack in some states of a solve that kept its factor.

    Parameters
    ----------
    solutions : sequence of Solution
    sifs : sequence of SIF
        One for each.
    crack : int
    """
    bars = bars_and_shares(solutions, sifs, crack)[0]
    every = zip(bars, [_rounded(s, crack) for s in solutions], strict=True)
    return [_without(one, reason) if reason else one for one, reason in every]


def bars_and_shares(
    solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int
) -> tuple[list[Bars], Floats]:
    """Bars of the tips, and the absolute contributions of the cells to the estimates.

    Bars of cracks whose faces press at kinks that the cut rounds off are too short: `tip_bars` has
    none there.

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
        _bars(sif, errors, k, places, s, crack)
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
    if any(contact is not None and contact.shear is not None for contact in solution.contact):
        return "friction has no estimate"
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


def _bars(
    sif: SIF, errors: TipErrors, k: int, places: Sequence[str], solution: Solution, crack: int
) -> Bars:
    """Bars of one state."""
    own = _CAUGHT * errors.eta[k]
    shape = errors.bend[k] + errors.rim[k]
    eta = own + shape
    shares = errors.shares[k].sum(axis=-1)
    bar = np.maximum(_ETA * np.abs(own), np.maximum(_SHARES * shares, _SPREAD * sif.spread))
    bar = np.maximum(bar, _AT_KINKS * errors.kinks[k])
    if any(_presses(solution, crack, x) for x in kinks_inside(solution, crack)):
        eta = errors.rim[k].copy()
        bar += _MOVED * np.abs(errors.bend[k])
    contact = _END * errors.end[k]
    bar += errors.bend_bar[k] + _RIM * np.abs(errors.rim[k]) + contact
    if solution.problem.contact != "off":  # negative K_I: faces overlap where contact is blind
        overlap = np.maximum(np.maximum(-sif.K_I, -sif.K_I - eta[:, 0]), 0.0)
        bar += _OVERLAP * overlap.max()
        contact = contact + _OVERLAP * overlap.max()
        contact[:, 0] += np.maximum(overlap - bar[:, 0], 0.0)
        bar[:, 0] = np.maximum(bar[:, 0], overlap)
    reasons = [place or _polygon(errors.chords[k][i], bar[i]) for i, place in enumerate(places)]
    bar += _CHORDS * np.abs(errors.chords[k])
    # K_I of closed tips is zero; its bar is what the integral gave.
    eta[sif.closed, 0] = 0.0
    bar[sif.closed, 0] = contact[sif.closed, 0] = np.abs(sif.K_integral[sif.closed, 0])
    return bars_of(eta, bar, reasons, contact)


def _without(bars: Bars, reason: str) -> Bars:
    reasons = [own or reason for own in bars.reasons]
    return bars_of(bars.eta, bars.bar, reasons, bars.contact)


def _presses(solution: Solution, crack: int, x: Floats) -> bool:
    """Whether the faces press at a point of a crack."""
    contact = solution.contact[crack]
    if contact is None:
        return False
    near = np.linalg.norm(contact.points - x, axis=1) <= cell_sizes(solution.problem.mesh, x[None])
    return bool((contact.closed & (contact.pressure > 0))[near].any())


def _rounded(solution: Solution, crack: int) -> str:
    """Why faces that press at a kink leave no estimate, or nothing.

    A sharp kink locks where one that the cut rounds off slides: no first-order estimate sees that.
    """
    cut = solution.space.cuts[crack]
    for x in kinks_inside(solution, crack):
        size = cell_sizes(solution.problem.mesh, x[None])[0]
        away = np.linalg.norm(cut.kinks.points - x, axis=1).min(initial=np.inf)
        if away > size and _presses(solution, crack, x):
            return (
                f"the faces press at the kink at {at(x)}, which the cut rounds off because it is "
                "sharper than 100° or less than a cell from a tip or another kink: compare with a "
                "mesh that is finer there"
            )
    return ""


def _polygon(change: Floats, bar: Floats) -> str:
    """Why a polygon instead of a curve leaves no estimate, or nothing."""
    if np.abs(change).max() <= bar.max():
        return ""
    return (
        "parts of the boundary look like chords of curves, which would change K by "
        f"{np.abs(change).max():.2g}: give the mesh its curves, or refine it there"
    )
