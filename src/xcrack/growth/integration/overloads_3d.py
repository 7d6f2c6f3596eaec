"""Overloads along fronts: rates as means over a step, and zones carried from front to front."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.arrays import Floats
from xcrack.crack.fronts_3d import closed_fronts
from xcrack.growth.rates.evaluation import Evaluation
from xcrack.growth.rates.kinds import kinds_of
from xcrack.growth.rates.marching import POINTS, march
from xcrack.growth.steps.advance import PerCrack
from xcrack.growth.steps.front_trail import FrontTrail, Places
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.overloads import Kinds, March, Zones, no_zones
from xcrack.growth.tracking.follow_3d import carried


def with_kinds(run: Run, seen: Evaluation, parts: Sequence[Places]) -> tuple[Places, ...]:
    """Places with the cycles of a block that were solved close by."""
    if run.retardation is None:
        return tuple(parts)
    result = []
    for c, (part, kinds) in enumerate(zip(parts, kinds_of(run, seen))):
        near = _near(seen, c, kinds, part.x)
        zones = no_zones(len(part.s)) if part.zones is None else part.zones
        result.append(replace(part, kinds=near, zones=zones))
    return tuple(result)


def with_mean_rates(run: Run, trail: FrontTrail) -> FrontTrail:
    """The same with rates that are means over the step ahead, as K at its begin leads to.

    All are 0 where the growths of a step take more cycles than can be counted.
    """
    fastest = max((float(part.rate.max(initial=0.0)) for part in trail.parts), default=0.0)
    if run.retardation is None or not 0 < fastest < np.inf:
        return trail
    length = np.inf if run.da is None else run.da
    blocks = np.inf if run.cycles is None else run.cycles
    length = min(length, blocks * fastest)
    kinds = [_kinds(part) for part in trail.parts]
    ahead = _marched(run, trail, [kinds], length, [1.0] * len(kinds), blocks)
    cycles = float(ahead.cycles[-1])
    grows = cycles > 0 and (ahead.reached >= length or cycles >= blocks * (1 - 1e-9))
    rates = split(ahead.arc[-1] / cycles if grows else 0.0 * ahead.arc[-1], trail)
    parts = [replace(part, rate=rate, law_rate=rate) for part, rate in zip(trail.parts, rates)]
    return replace(trail, parts=tuple(parts))


def overloads_between(
    run: Run,
    trail: FrontTrail,
    seen: Evaluation,
    moved: Sequence[Floats],
    length: float,
) -> tuple[PerCrack, float, list[Zones]]:
    """Growth of the places of a step with K between that of its begin and that of its end.

    Parameters
    ----------
    run : Run
    trail : FrontTrail
        Of the begin.
    seen : Evaluation
        Of the end.
    moved : sequence of (f, 3) arrays, length
        Where the places of the begin have come to.
    length : float, length
        Of the fastest place.

    Returns
    -------
    arc : tuple of (f,) arrays, length
    blocks : float
    zones : list of Zones
        At the places when they have grown by `arc`.
    """
    solved = kinds_of(run, seen)
    first = [_kinds(part) for part in trail.parts]
    last = [_near(seen, c, solved[c], moved[c], first[c]) for c in range(len(first))]
    ratio = [seen.length[c] / part.size for c, part in enumerate(trail.parts)]
    done = _marched(run, trail, [first, last], length, ratio, np.inf)
    blocks = float(done.cycles[-1])
    rest = length / done.reached if 0 < done.reached < length else 1.0
    which = np.repeat(np.arange(len(trail.parts)), [len(part.s) for part in trail.parts])
    zones = [done.zones.at(which == c) for c in range(len(trail.parts))]
    return split(rest * done.arc[-1], trail), rest * blocks, zones


def rate_at_end(rate: Floats, arc: Floats, blocks: float) -> Floats:
    """Rates that, as a mean with those of the begin, let places grow by an arc in some blocks."""
    return np.maximum(2 * arc / blocks - rate, 0.0)


def beyond_trapezoid(blocks: float, predicted: float) -> float:
    """Blocks of a step by a power of the rates at both ends, against the mean of their inverses."""
    return abs(0.5 * (predicted + blocks**2 / predicted) - blocks)


def zones_onto(zones: Zones, arc: Floats, way: Floats, moved: Floats, x: Floats) -> Zones:
    """What overloads have left, at the places of the next front.

    Parameters
    ----------
    zones : Zones
        At the places of the last front, after growth by `arc`.
    arc, way : (f,) arrays, length
        Growth that was marched, and the advance that the whole front made of it.
    moved : (f, 3) array, length
        Where these places have come to.
    x : (g, 3) array, length
        Places of the next front: each takes over from the nearest.
    """
    if not len(moved):
        return replace(no_zones(len(x)), position=zones.position, part=zones.part)
    within = np.minimum(zones.since, arc)
    share = np.divide(within, arc, out=np.zeros_like(arc), where=arc > 0)
    since = np.maximum(zones.since + share * (way - arc), 0.0)
    nearest = np.linalg.norm(x[:, None] - moved, axis=2).argmin(axis=1)
    return Zones(since[nearest], zones.size[nearest], zones.K[nearest], zones.position, zones.part)


def split(values: Floats, trail: FrontTrail) -> tuple[Floats, ...]:
    """Values at all places as one array a crack."""
    ends = np.cumsum([0, *(len(part.s) for part in trail.parts)])
    return tuple(values[a:b] for a, b in zip(ends, ends[1:]))


def _kinds(part: Places) -> Kinds:
    assert part.kinds is not None
    return part.kinds


def _near(seen: Evaluation, c: int, kinds: Kinds, x: Floats, lost: Kinds | None = None) -> Kinds:
    """Cycles of a block at some places, linear between those that were solved."""
    sif, closed = seen.sif[0][c], closed_fronts(seen.cracks[c])
    if not len(sif.x):
        return kinds if lost is None else lost
    p = kinds.dK.shape[2]
    values = np.concatenate([kinds.dK[0], kinds.R[0]], axis=1)
    near = carried(sif.x, sif.front, closed, values, x, np.inf)
    a = np.full((1, len(x)), float(kinds.a.flat[0]))
    return Kinds(near[None, :, :p], near[None, :, p:], a)


def _marched(
    run: Run,
    trail: FrontTrail,
    solves: Sequence[Sequence[Kinds]],
    length: float,
    ratio: Sequence[float],
    blocks: float,
) -> March:
    """All places of all fronts; rates are powers of the sizes of the cracks."""
    names = ("dK", "R", "a")
    kinds = Kinds(
        *(
            np.concatenate(
                [np.concatenate([getattr(k, name) for k in one], axis=1) for one in solves]
            )
            for name in names
        )
    )
    counts = [len(part.s) for part in trail.parts]
    growth = np.repeat(np.array(ratio), counts)
    t = np.linspace(0.0, 1.0, POINTS)[:, None]
    even = np.abs(growth - 1) < 1e-6
    safe = np.where(even, 2.0, growth)
    x = np.where(even, t, np.log1p(t * (safe - 1)) / np.log(safe))
    nodes = np.repeat(np.arange(float(len(solves)))[:, None], len(growth), axis=1)
    every = [part.zones for part in trail.parts if part.zones is not None]
    since, size, K = (
        np.concatenate([getattr(z, name) for z in every]) for name in ("since", "size", "K")
    )
    zones = Zones(since, size, K, every[0].position, every[0].part)
    return march(
        run,
        kinds,
        nodes,
        x,
        zones,
        length,
        exponent=trail.exponent,
        blocks=blocks,
    )


__all__ = [
    "beyond_trapezoid",
    "overloads_between",
    "rate_at_end",
    "with_kinds",
    "with_mean_rates",
    "zones_onto",
]
