"""Bars of K along fronts in 3D: order 2 beside order 1, and two domains at order 2.

Weighted residuals have the wrong sign or size there: fronts are chords, and the functionals know no
curvature. What holds is another solution on the same mesh, which is best itself, and at order 2
the difference of two domains, as half the width.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
from xcrack.sif.bars import Bars, bars_of, no_bars
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.sif import SIF, joined

_SPREAD = 2.0  # half-width over the spread of a place, or its root mean square along the front


def front_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[Bars]:
    """Bars along the fronts of one crack in some states of a solve.

    Parameters
    ----------
    solutions : sequence of Solution
        At order 1 their states are solved again at order 2 on the same mesh.
    sifs : sequence of SIF
        One for each.
    crack : int
    """
    missing = without_estimate(solutions, sifs)
    if missing is not None:
        return missing
    if solutions[0].space.order == 2:
        return [_of_spread(sif) for sif in sifs]
    problem = replace(solutions[0].problem, order=2)
    finer = solve_states(problem, [s.state for s in solutions])
    fronts = [t for t, tip in enumerate(finer[0].space.tips) if tip.crack == crack]
    by_front = [front_intensity(finer, t) for t in fronts]
    every = [joined([states[k] for states in by_front], 3) for k in range(len(finer))]
    reason = "order 2 has other fronts than order 1: refine the mesh along them"
    return bars_beside(sifs, every, reason)


def without_estimate(solutions: Sequence[Solution], sifs: Sequence[SIF]) -> list[Bars] | None:
    """Empty bars where nothing can be estimated, else None."""
    if not len(sifs[0].K):
        return [no_bars(sifs[0].K.shape, "")] * len(sifs)
    if any(c is not None and c.shear is not None for c in solutions[0].contact):
        return [no_bars(sifs[0].K.shape, "friction has no estimate")] * len(sifs)
    return None


def bars_beside(sifs: Sequence[SIF], better: Sequence[SIF], reason: str) -> list[Bars]:
    """Bars of K that are the difference to a better one, which is best.

    Parameters
    ----------
    sifs, better : sequences of SIF
        One a state, along the fronts of one crack.
    reason : str
        Why there is none, where the better one has other fronts.
    """
    if any(
        len(np.unique(a.front)) != len(np.unique(b.front))
        for a, b in zip(sifs, better, strict=True)
    ):
        return [no_bars(sif.K.shape, reason) for sif in sifs]
    return [_of_difference(sif, other) for sif, other in zip(sifs, better, strict=True)]


def _of_spread(sif: SIF) -> Bars:
    """At order 2: two domains; K is best itself.

    They may agree by chance in one mode, less likely in all: what they differ by in the root mean
    square of any of them is the least for each.
    """
    spread = np.array(sif.spread)
    spread[sif.closed, 0] = 0.0
    least = _mean(sif, spread).max(axis=1)[:, None]
    return _completed(sif, np.zeros_like(sif.K), _SPREAD * np.maximum(spread, least))


def _of_difference(sif: SIF, finer: SIF) -> Bars:
    """K of the other solution is best, and the difference its bar."""
    eta = np.empty_like(sif.K)
    for front in np.unique(sif.front):
        own, other = sif.front == front, finer.front == front
        eta[own] = _at(sif.x[own], finer.x[other], finer.K[other]) - sif.K[own]
    eta[sif.closed, 0] = 0.0
    return _completed(sif, eta, np.maximum(np.abs(eta), _mean(sif, eta)))


def _at(x: Floats, vertices: Floats, values: Floats) -> Floats:
    """Values between the vertices of a front, at the places nearest to points."""
    nearest = np.linalg.norm(x[:, None] - vertices, axis=2).argmin(axis=1)
    result, distance = values[nearest], np.linalg.norm(x - vertices[nearest], axis=1)
    for step in (-1, 1):
        next_to = (nearest + step) % len(vertices)  # beyond the ends the nearest stays nearer
        side = vertices[next_to] - vertices[nearest]
        square = np.einsum("ij,ij->i", side, side)
        share = np.einsum("ij,ij->i", x - vertices[nearest], side)
        share = np.clip(share / np.where(square > 0, square, 1.0), 0.0, 1.0)[:, None]
        apart = np.linalg.norm(x - vertices[nearest] - share * side, axis=1)
        nearer = apart < distance
        between = (1 - share) * values[nearest] + share * values[next_to]
        result = np.where(nearer[:, None], between, result)
        distance = np.minimum(distance, apart)
    return np.asarray(result)


def _mean(sif: SIF, values: Floats) -> Floats:
    """Root mean square of values along the front of each place."""
    result = np.array(values)
    inner = ~sif.at_surface if not sif.at_surface.all() else sif.at_surface
    for front in np.unique(sif.front):
        own = sif.front == front
        rows = values[own & inner] if (own & inner).any() else values[own]
        result[own] = np.sqrt((rows**2).mean(axis=0))
    return result


def _completed(sif: SIF, eta: Floats, bar: Floats) -> Bars:
    """With K_I of closed places, and without what is beside a free surface."""
    contact = np.zeros_like(bar)
    bar[sif.closed, 0] = contact[sif.closed, 0] = np.abs(sif.K_integral[sif.closed, 0])
    reason = "K has no meaning so close to a free surface: it is prolonged from inside"
    return bars_of(eta, bar, [reason if at else "" for at in sif.at_surface], contact)
