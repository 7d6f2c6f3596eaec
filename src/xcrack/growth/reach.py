"""Growth of tips over a piece of their way: by rates, or cycle by cycle with overloads."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.fatigue.retardation import (
    POINTS,
    BlockCycles,
    CycleIntegration,
    OverloadZones,
    march,
    no_zones,
)
from xcrack.growth.controlled import longest
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, block_order, kinds_of
from xcrack.growth.trail import KEPT, Overloads, Trail, directions_at, rates_at

# Where along a way something begins, between two lengths that are halved.


def halved(holds: Callable[[float], bool], most: float, times: int = 40) -> tuple[float, float]:
    """Lengths between which a condition ceases to hold, in [0, most].

    Parameters
    ----------
    holds : callable length -> bool
        True at 0, false at `most`.
    most : float
    times : int
        The two lengths are most / 2^times apart.

    Returns
    -------
    low, high : float
        It holds at `low`, or low is 0; not at `high`, or high is `most`.
    """
    low, high = 0.0, most
    for _ in range(times):
        middle = 0.5 * (low + high)
        if holds(middle):
            low = middle
        else:
            high = middle
    return low, high


# Growth of all tips over a piece of σ, the integral of the largest rate over the cycles.

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


_FASTER = 2.0  # times the last rate: what a step of prescribed cycles may reckon with


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of σ, over which tips may grow along different directions.

    Attributes
    ----------
    over : callable
        Trail, for its directions -> Growth.
    after : OverloadZones, optional
        What overloads have left then.
    """

    over: Callable[[Trail], Growth]
    after: OverloadZones | None


@dataclass(frozen=True, eq=False)
class Reach:
    """How far the next step goes.

    Attributes
    ----------
    length : float, length
        Of σ.
    stops : bool
        Whether all growth is seen to stop at its end.
    growth : Growth
    """

    length: float
    stops: bool
    growth: Growth


def piece_of(
    run: GrowthRule, trail: Trail, start: float, length: float, begin: OverloadZones | None
) -> Piece:
    """Growth over [start, start + length] of σ, with the overloads left at its begin."""
    if begin is None:
        return Piece(lambda other: growth_over(other, start, length, run.threshold), None)
    marched = _march(run, trail, start, length, begin)
    return Piece(lambda other: _along(marched, other, start, length), marched.zones)


def reach_of(run: GrowthRule, trail: Trail) -> Reach:
    """The next step as the last two solves see it; from a first one straight on, at its rates."""
    known, start = trail.last(2), float(trail.sigma[-1])
    length = _farthest(run, trail)
    if trail.overloads is not None:
        ahead = _ahead(run, trail, length)
        came = min(length, ahead.reached)
        over = run.cycles is not None and ahead.until(came)[1] >= run.cycles * (1 - 1e-9)
        return Reach(came, came < length and not over, _along(ahead, known, start, came))
    if run.cycles is not None:
        length = length_of_cycles(known, start, run.cycles, length, run.threshold)
    grows = growing_length(known, start, length, run.threshold)
    return Reach(grows, grows < length, growth_over(known, start, grows, run.threshold))


def growth_until(run: GrowthRule, trail: Trail, sigma: float) -> Growth:
    """Growth over a first part of the step that is seen ahead."""
    known, start = trail.last(2), float(trail.sigma[-1])
    if trail.overloads is None:
        return growth_over(known, start, sigma, run.threshold)
    return _along(_ahead(run, trail, sigma), known, start, sigma)


def looked_ahead(run: GrowthRule, trail: Trail) -> Trail:
    """The same with the march of the next step, so that it is made once."""
    own = trail.overloads
    if own is None or not _can_grow(trail):
        return trail
    ahead = _ahead(run, trail, _farthest(run, trail))
    return replace(trail, overloads=replace(own, ahead=ahead))


def overloads_begin(
    run: GrowthRule, seen: Evaluation, trail: Trail, before: OverloadZones | None = None
) -> Trail:
    """A first trail with the kinds of cycles of its solve; behind a kink scaled as its range."""
    if run.retardation is None:
        return trail
    kinds = _joined(kinds_of(run, seen))
    was = np.concatenate(seen.dK_eq)
    scale = np.divide(trail.dK_eq[-1], was, out=np.ones_like(was), where=was > 0)
    kinds = BlockCycles(kinds.dK * scale[None, :, None], kinds.R, kinds.a)
    zones = no_zones(len(was)) if before is None else before
    return replace(trail, overloads=Overloads(kinds, zones))


def overloads_go_on(run: GrowthRule, seen: Evaluation, old: Trail, trail: Trail) -> Trail:
    """A trail with one more solve, with the kinds of cycles of that."""
    own = old.overloads
    if own is None:
        return trail
    kinds = own.kinds.followed_by(_joined(kinds_of(run, seen)), KEPT)
    return replace(trail, overloads=Overloads(kinds, own.zones, own.earlier))


def overloads_of_rest(before: Trail, stays: Bools | Ints) -> OverloadZones | None:
    """What overloads have left after a predicted step at the tips that are still there."""
    own = before.overloads
    if own is None:
        return None
    return (own.zones if own.ahead is None else own.ahead.zones).at(stays)


def _farthest(run: GrowthRule, trail: Trail) -> float:
    """Piece of σ that the next step does not exceed, length."""
    length = longest(run, trail.control)
    if run.cycles is None:
        return length
    fastest = float(trail.rate[-1].max(initial=0.0))
    return min(length, run.cycles * fastest * (1.0 if trail.n_solves == 1 else _FASTER))


def _ahead(run: GrowthRule, trail: Trail, length: float) -> CycleIntegration:
    own = trail.overloads
    assert own is not None
    if own.ahead is not None and length <= own.ahead.sigma[-1]:
        return own.ahead
    known = trail.last(2)
    blocks = np.inf if run.cycles is None else run.cycles
    return _march(run, known, float(trail.sigma[-1]), length, own.zones, blocks)


def _march(
    run: GrowthRule,
    trail: Trail,
    start: float,
    length: float,
    begin: OverloadZones,
    blocks: float = np.inf,
) -> CycleIntegration:
    own = trail.overloads
    assert own is not None
    grid = np.linspace(0.0, length, POINTS)
    return march(
        run.law,
        run.retardation,
        block_order(run),
        own.kinds,
        np.log(trail.scale + trail.sigma[:, None]),
        np.log(trail.scale + start + grid[:, None]),
        begin,
        length,
        exponent=trail.exponent,
        threshold=run.threshold,
        blocks=blocks,
    )


def _along(marched: CycleIntegration, trail: Trail, start: float, length: float) -> Growth:
    """Growth over the first part of a march, in the directions of a trail."""
    inside = marched.sigma < length
    arc, cycles = marched.until(length)
    sigma = np.append(marched.sigma[inside], length)
    every = np.vstack([marched.arc[inside], arc])
    angle = directions_at(trail, start + 0.5 * (sigma[1:] + sigma[:-1]))
    piece = np.diff(every, axis=0)
    move = [(piece * f(angle)).sum(axis=0) for f in (np.cos, np.sin)]
    return Growth(np.stack(move, axis=1), every[-1], cycles)


def _joined(parts: list[BlockCycles]) -> BlockCycles:
    """BlockCycles at all tips, from those of each crack."""
    columns = zip(*((part.dK, part.R, part.a) for part in parts))
    return BlockCycles(*(np.concatenate(column, axis=1) for column in columns))


def _can_grow(trail: Trail) -> bool:
    rate = trail.rate[-1]
    return bool((rate > 0).any() and np.isfinite(rate).all())


__all__ = [
    "Growth",
    "Piece",
    "Reach",
    "growing_length",
    "growth_over",
    "growth_until",
    "halved",
    "length_of_cycles",
    "looked_ahead",
    "overloads_begin",
    "overloads_go_on",
    "overloads_of_rest",
    "piece_of",
    "reach_of",
]
