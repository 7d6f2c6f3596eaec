"""Growth of all tips over a piece of σ, the integral of the largest rate over the cycles."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats
from xcrack.growth.integration.halving import halved
from xcrack.growth.steps.trail import Trail, directions_at, rates_at

_PIECES = 4  # a step's: rates may start, stop or overtake each other inside it
_X, _W = np.polynomial.legendre.leggauss(8)
_POINTS = np.concatenate([(k + 0.5 * (_X + 1)) / _PIECES for k in range(_PIECES)])
_WEIGHTS = np.tile(0.5 * _W / _PIECES, _PIECES)
_PASSES = 60  # of a bisection: to the last bit


@dataclass(frozen=True, eq=False)
class Growth:
    """What happens over a piece of σ.

    Attributes
    ----------
    move : (n, 2) array, length
        How far each tip comes.
    arc : (n,) array, length
        Length of its path.
    cycles : float
    """

    move: Floats
    arc: Floats
    cycles: float


def growth_over(trail: Trail, start: float, length: float, threshold: float = 0.0) -> Growth:
    """Growth over [start, start + length] of σ by the solves of a trail.

    Parameters
    ----------
    trail : Trail
        Directions and rates are the polynomials through all of its solves.
    start, length : float, length
        Piece of σ.
    threshold : float, stress √length
        As of `rates_at`.

    Returns
    -------
    Growth

    Notes
    -----
    dx_i/dσ = r_i / max_j r_j (cos D_i, sin D_i), dN/dσ = 1 / max_j r_j. σ is the arc of the tips
    that drive, one after the other, so that a change of the driving tip is no event.
    """
    s, weight = start + length * _POINTS, length * _WEIGHTS
    rate, angle = rates_at(trail, s, threshold), directions_at(trail, s)
    largest = rate.max(axis=1, initial=0.0)
    grows = largest > 0
    share = np.where(grows[:, None], rate / np.where(grows, largest, 1.0)[:, None], 0.0)
    return Growth(
        move=np.stack([weight @ (share * np.cos(angle)), weight @ (share * np.sin(angle))], axis=1),
        arc=weight @ share,
        cycles=float((weight[grows] / largest[grows]).sum()),
    )


def length_of_cycles(
    trail: Trail, start: float, cycles: float, most: float, threshold: float = 0.0
) -> float:
    """Piece of σ that takes a number of cycles, at most `most`, length."""
    if growth_over(trail, start, most, threshold).cycles <= cycles:
        return most

    def holds(length: float) -> bool:
        return growth_over(trail, start, length, threshold).cycles < cycles

    return halved(holds, most, _PASSES)[1]


def growing_length(trail: Trail, start: float, length: float, threshold: float) -> float:
    """Part of a piece of σ up to which any tip grows, length."""
    if _grows(trail, start + length, threshold):
        return length
    return halved(lambda part: _grows(trail, start + part, threshold), length, _PASSES)[0]


def _grows(trail: Trail, s: float, threshold: float) -> bool:
    return bool((rates_at(trail, np.array([s]), threshold) > 0).any())


__all__ = ["Growth", "growing_length", "growth_over", "length_of_cycles"]
