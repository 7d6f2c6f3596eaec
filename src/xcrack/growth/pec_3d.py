"""Growth of second order at one solve a step, of fronts of 3D cracks.

A step advances the corrected fronts of the last one by the rates known there, solves, and advances
the same fronts again by the rates at both ends, which are carried along the strip between the two.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import GeometryError, XcrackError
from xcrack.crack.crack import Crack
from xcrack.crack.placing import place_crack
from xcrack.crack.stations import closed_fronts, front_frames
from xcrack.fatigue.checks import law_exponent
from xcrack.fatigue.retardation import (
    POINTS,
    BlockCycles,
    CycleIntegration,
    OverloadZones,
    march,
    no_zones,
)
from xcrack.growth import follow_3d
from xcrack.growth.controlled import first, following, longest, share_left
from xcrack.growth.cycles import elapsed_3d
from xcrack.growth.follow_3d import interpolate_along_front
from xcrack.growth.front_filter import (
    FrontWaves,
    corrected,
    predicted,
    response,
    turning_of,
    without_noise,
)
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled, block_order, kinds_of
from xcrack.growth.step import Advance, PerCrack, Step, StepError, memory_of, plan_advance
from xcrack.growth.trail import FrontTrail, Places
from xcrack.mesh.locate import cell_sizes, contains
from xcrack.mesh.mesh import Mesh

REACH = 2.0  # cells from a place along a front to those that values are carried from


@dataclass(frozen=True, eq=False)
class Later:
    """What was solved at the end of a step, at the places of its beginning.

    Attributes
    ----------
    rate, law_rate : (f,) arrays, length/cycle
        nan in law_rate where a place has left the body.
    direction : (f, 3) array
    way : (f,) array, length
        Predicted advance.
    """

    rate: Floats
    law_rate: Floats
    direction: Floats
    way: Floats


def move_of(part: Places, angle: Floats, way: Floats) -> Floats:
    """Moves `(f, 3)` of places by ways at angles."""
    t, n = part.frame[:, 0], part.frame[:, 1]
    return way[:, None] * (np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * n)


def front_lengths(crack: Crack) -> Floats:
    """Length of each front, length."""
    fronts = [crack.points[front] for front in crack.fronts or ()]
    return np.array([np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x in fronts])


def interpolate_within_reach(
    part: Places, closed: Bools, values: Floats, x: Floats, mesh: Mesh
) -> Floats:
    """Values of places at points `(f, 3)` beside them; nan where there are none."""
    if not len(part.x):
        return np.full(len(x), np.nan)
    reach = REACH * float(cell_sizes(mesh, part.x).mean())
    return interpolate_along_front(part.x, part.front, closed.tolist(), values, x, reach)


# Overloads along fronts: rates as means over a step, and zones carried from front to front.


def with_kinds(run: GrowthRule, seen: Evaluation, parts: Sequence[Places]) -> tuple[Places, ...]:
    """Places with the cycles of a block that were solved close by."""
    if run.retardation is None:
        return tuple(parts)
    result = []
    for c, (part, kinds) in enumerate(zip(parts, kinds_of(run, seen))):
        near = _near(seen, c, kinds, part.x)
        zones = no_zones(len(part.s)) if part.zones is None else part.zones
        result.append(replace(part, kinds=near, zones=zones))
    return tuple(result)


def with_mean_rates(run: GrowthRule, trail: FrontTrail) -> FrontTrail:
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
    run: GrowthRule,
    trail: FrontTrail,
    seen: Evaluation,
    moved: Sequence[Floats],
    length: float,
) -> tuple[PerCrack, float, list[OverloadZones]]:
    """Growth of the places of a step with K between that of its begin and that of its end.

    Parameters
    ----------
    run : GrowthRule
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
    zones : list of OverloadZones
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


def zones_onto(
    zones: OverloadZones, arc: Floats, way: Floats, moved: Floats, x: Floats
) -> OverloadZones:
    """What overloads have left, at the places of the next front.

    Parameters
    ----------
    zones : OverloadZones
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
    return OverloadZones(
        since[nearest], zones.size[nearest], zones.K[nearest], zones.position, zones.part
    )


def split(values: Floats, trail: FrontTrail) -> tuple[Floats, ...]:
    """Values at all places as one array a crack."""
    ends = np.cumsum([0, *(len(part.s) for part in trail.parts)])
    return tuple(values[a:b] for a, b in zip(ends, ends[1:]))


def _kinds(part: Places) -> BlockCycles:
    assert part.kinds is not None
    return part.kinds


def _near(
    seen: Evaluation, c: int, kinds: BlockCycles, x: Floats, lost: BlockCycles | None = None
) -> BlockCycles:
    """Cycles of a block at some places, linear between those that were solved."""
    sif, closed = seen.sif[0][c], closed_fronts(seen.cracks[c])
    if not len(sif.x):
        return kinds if lost is None else lost
    p = kinds.dK.shape[2]
    values = np.concatenate([kinds.dK[0], kinds.R[0]], axis=1)
    near = interpolate_along_front(sif.x, sif.front, closed, values, x, np.inf)
    a = np.full((1, len(x)), float(kinds.a.flat[0]))
    return BlockCycles(near[None, :, :p], near[None, :, p:], a)


def _marched(
    run: GrowthRule,
    trail: FrontTrail,
    solves: Sequence[Sequence[BlockCycles]],
    length: float,
    ratio: Sequence[float],
    blocks: float,
) -> CycleIntegration:
    """All places of all fronts; rates are powers of the sizes of the cracks."""
    names = ("dK", "R", "a")
    kinds = BlockCycles(
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
    zones = OverloadZones(since, size, K, every[0].position, every[0].part)
    return march(
        run.law,
        run.retardation,
        block_order(run),
        kinds,
        nodes,
        x,
        zones,
        length,
        exponent=trail.exponent,
        threshold=run.threshold,
        blocks=blocks,
    )


_SHORTEST = 0.6  # cells: a shorter step of a front would end in those in which it began


def begun(run: GrowthRule, seen: Evaluation) -> Settled:
    """The first step of a run."""
    none = tuple(np.zeros(len(sif.x)) for sif in seen.sif[0])
    return begun_at(run, seen, 0.0, StepError(none, 0.0))


def begun_at(run: GrowthRule, seen: Evaluation, cycles: float, error: StepError) -> Settled:
    """A step before which there is nothing to correct."""
    parts = tuple(_solved_places(seen, c, None) for c in range(len(seen.cracks)))
    parts = with_kinds(run, seen, parts)
    trail = _trail(run, seen, parts)
    size = min((part.size for part in parts if len(part.s)), default=np.inf)
    trail = replace(trail, control=first(run, size, _shortest(run, trail), np.inf))
    return _settled(run, seen, cycles, seen.cracks, trail, error)


def settled(run: GrowthRule, last: Step, seen: Evaluation) -> Settled:
    """Advance the fronts of the last step again, now by the rates at both ends of the step."""
    trail, error = _remembered(last)
    plan = _plan(run, trail)
    ahead = _ahead(trail, plan)
    after = [
        _carried_back(seen, c, part, way) for c, (part, way) in enumerate(zip(trail.parts, ahead))
    ]
    fastest = [max((float(r.max(initial=0.0)) for r in rates), default=0.0) for rates in (
        [part.rate for part in trail.parts], [part.rate for part in after])]  # fmt: skip
    cycles, own = _cycles(run, trail, plan, seen)
    moved = [part.x + move_of(part, part.angle, way) for part, way in zip(trail.parts, ahead)]
    marched = None
    if run.retardation is not None and 0 < fastest[0] < np.inf:
        marched = overloads_between(run, trail, seen, moved, plan.largest)
        after = [
            replace(later, rate=rate_at_end(part.rate, arc, plan.largest / fastest[0]))
            for later, part, arc in zip(after, trail.parts, marched[0])
        ]
        fastest[1] = fastest[0]
        cycles, own = (
            marched[1],
            share_left(run) * beyond_trapezoid(marched[1], plan.largest / fastest[0]),
        )
    parts, cracks, gaps = [], [], []
    broken = any(np.isinf(rate).any() for rate in seen.rate)
    for c, (part, later) in enumerate(zip(trail.parts, after)):
        again = None
        if not broken and fastest[1] > 0:
            share = plan.largest / fastest[1] * later.rate
            again = _again(run, trail, plan, c, last.corrected[c], seen.cracks[c], later, share)
        if again is None:
            crack, gap, way = seen.cracks[c], np.zeros(len(part.s)), ahead[c]
            new = _solved_places(seen, c, _waiting(seen, c, part, plan.pending[c]))
        else:
            crack, pending, gap, way = again
            new = _corrected_places(seen, c, crack, part, pending)
        if marched is not None:
            left = zones_onto(marched[2][c], marched[0][c], way, moved[c], new.x)
            new = replace(new, zones=left)
        cracks.append(crack)
        parts.append(new)
        gaps.append(gap)
    place = tuple(
        _onto(run, seen, c, part, last, error.place[c], gaps[c])
        for c, part in enumerate(trail.parts)
    )
    now = _trail(run, seen, with_kinds(run, seen, parts))
    off = share_left(run) * max((float(gap.max(initial=0.0)) for gap in gaps), default=0.0)
    control = following(
        run, trail.control, plan.largest, off, own, cycles, last.cycles, _shortest(run, now), np.inf
    )
    return _settled(
        run, seen, last.cycles + cycles, cracks, replace(now, control=control),
        StepError(place, error.cycles + own),
    )  # fmt: skip


def planned(run: GrowthRule, step: Step) -> Advance:
    """The advance after a step."""
    trail, _ = _remembered(step)
    plan = _plan(run, trail)
    c, place = plan.tip
    if plan.largest == 0 or not len(step.sif[0][c].x):
        stopped = run.retardation is not None and plan.largest == 0
        return replace(plan, falls_to_zero=stopped)
    away = np.linalg.norm(step.sif[0][c].x - trail.parts[c].x[place], axis=1)
    return replace(plan, tip=(c, int(np.argmin(away))))


def advanced(run: GrowthRule, step: Step, share: float = 1.0) -> list[Crack]:
    """The cracks after the predicted advance of a step, or after a share of it."""
    trail, _ = _remembered(step)
    plan = _plan(run, trail)
    ahead = _ahead(trail, replace(plan, da=tuple(share * da for da in plan.da)))
    return [
        follow_3d.advanced(crack, part, part.angle, way, run.problem.mesh)
        for crack, part, way in zip(step.corrected, trail.parts, ahead)
    ]


def cycles_to(run: GrowthRule, step: Step, share: float, after: float | None) -> float:
    """Cycles of a share of the advance after a step, in proportion to it."""
    if after is not None:
        return share * after
    trail, _ = _remembered(step)
    fastest = max(float(part.rate.max(initial=0.0)) for part in trail.parts)
    return share * _plan(run, trail).largest / fastest


def _remembered(step: Step) -> tuple[FrontTrail, StepError]:
    trail, error = memory_of(step).trail, step.error
    if not isinstance(trail, FrontTrail) or error is None:
        raise XcrackError(f"step {step.index} was not made by integrator='pec'.")
    return trail, error


def _settled(
    run: GrowthRule,
    seen: Evaluation,
    cycles: float,
    cracks: Sequence[Crack],
    trail: FrontTrail,
    error: StepError,
) -> Settled:
    """A step that is settled, with the advance that follows at the places of its K."""
    plan = _plan(run, trail)
    ahead = _ahead(trail, plan)
    mesh = seen.problem.mesh
    da: list[Floats] = []
    pending: list[Floats] = []
    for c, (part, way) in enumerate(zip(trail.parts, ahead)):
        x = seen.sif[0][c].x
        for target, values in ((da, way), (pending, plan.pending[c])):
            target.append(
                np.nan_to_num(interpolate_within_reach(part, part.closed, values, x, mesh))
            )
    return Settled(cycles, tuple(cracks), tuple(da), tuple(pending), trail, error)


def _trail(run: GrowthRule, seen: Evaluation, parts: tuple[Places, ...]) -> FrontTrail:
    dK_eq, R = np.concatenate(seen.dK_eq), np.concatenate(seen.R)
    return with_mean_rates(run, FrontTrail(parts, law_exponent(run.law, dK_eq, R)))


def _shortest(run: GrowthRule, trail: FrontTrail) -> float:
    """Shortest step of the fastest place, length."""
    part = max(trail.parts, key=lambda each: float(each.rate.max(initial=-1.0)))
    if not len(part.s):
        return 0.0
    fastest = part.x[[int(np.argmax(part.rate))]]
    return _SHORTEST * float(cell_sizes(run.problem.mesh, fastest)[0])


def _plan(run: GrowthRule, trail: FrontTrail) -> Advance:
    mesh = run.problem.mesh
    rate = tuple(part.rate for part in trail.parts)
    return plan_advance(
        rate,
        rate,
        tuple(part.pending for part in trail.parts),
        tuple(cell_sizes(mesh, part.x) for part in trail.parts),
        da=longest(run, trail.control),
        cycles=run.cycles,
        scaling="law",
        least=follow_3d.WAITS_BELOW,
    )


def _responses(trail: FrontTrail, c: int, advance: Floats) -> list[tuple[Bools, FrontWaves | None]]:
    """Places of each front of a crack, and its response."""
    part = trail.parts[c]
    result = []
    for number in np.unique(part.front):
        own = part.front == number
        closed = bool(part.closed[number])
        order = np.argsort(part.s[own])
        turning = turning_of(part.x[own][order], closed) if own.sum() > 2 else 0.0
        length = float(part.length[number])
        result.append(
            (own, response(part.s[own], advance[own], trail.exponent, turning, closed, length))
        )
    return result


def _ahead(trail: FrontTrail, plan: Advance) -> PerCrack:
    """Advance of all places by the rates at the beginning of a step."""
    ways = []
    for c, (part, da) in enumerate(zip(trail.parts, plan.da)):
        way = np.array(da)
        for own, front in _responses(trail, c, da):
            way[own] = np.where(da[own] > 0, predicted(front, part.s[own], da[own]), 0.0)
        ways.append(way)
    return tuple(ways)


def _again(
    run: GrowthRule,
    trail: FrontTrail,
    plan: Advance,
    c: int,
    crack: Crack,
    solved: Crack,
    later: Later,
    share: Floats,
) -> tuple[Crack, Floats, Floats, Floats] | None:
    """The corrected crack, growth that waits at the old places, how far these are moved, and grow.

    None where the crack that was solved has other fronts: there is nothing to correct.
    """
    part, mesh = trail.parts[c], run.problem.mesh
    fastest = max(float(p.rate.max(initial=0.0)) for p in trail.parts)
    if not len(part.s) or fastest == 0:
        return None
    first = plan.largest / fastest * part.rate
    way = 0.5 * (first + share)
    for own, front in _responses(trail, c, first):
        way[own] = corrected(front, part.s[own], first[own], share[own])
    wanted = part.pending + way
    goes = wanted >= follow_3d.WAITS_BELOW * cell_sizes(mesh, part.x)
    heading = first[:, None] * part.direction + share[:, None] * later.direction
    t, n = part.frame[:, 0], part.frame[:, 1]
    along, across = np.einsum("ij,ij->i", heading, t), np.einsum("ij,ij->i", heading, n)
    still = np.hypot(along, across) == 0
    angle = np.where(still, part.angle, np.arctan2(across, along))
    try:
        again = place_crack(
            follow_3d.advanced(crack, part, angle, np.where(goes, wanted, 0.0), mesh), mesh
        )
    except GeometryError:
        return None
    if closed_fronts(again) != closed_fronts(solved):
        return None
    gap = np.linalg.norm(
        move_of(part, part.angle, later.way) - move_of(part, angle, wanted), axis=1
    )
    return again, np.where(goes, 0.0, wanted), np.where(goes, gap, 0.0), way


def _carried_back(seen: Evaluation, c: int, part: Places, way: Floats) -> Later:
    target = part.x + move_of(part, part.angle, way)
    sif, mesh = seen.sif[0][c], seen.problem.mesh
    here = _solved_places(seen, c, None)
    closed = closed_fronts(seen.cracks[c])
    size = float(cell_sizes(mesh, sif.x).mean()) if len(sif.x) else 0.0

    def back(values: Floats) -> Floats:
        return interpolate_along_front(sif.x, sif.front, closed, values, target, REACH * size)

    law_rate = back(seen.law_rate[c])
    lost = np.isnan(law_rate)
    rate = np.where(lost, part.rate, np.nan_to_num(back(seen.rate[c])))
    direction = np.stack([back(here.direction[:, k]) for k in range(3)], axis=1)
    direction = np.where(lost[:, None], part.direction, direction)
    return Later(rate, law_rate, direction, way)


def _solved_places(seen: Evaluation, c: int, pending: Floats | None) -> Places:
    """Places of a crack as it was solved."""
    sif, closed = seen.sif[0][c], np.array(closed_fronts(seen.cracks[c]), dtype=bool)
    length = front_lengths(seen.cracks[c])
    most = max((state[c] for state in seen.sif), key=lambda each: each.K_I.max(initial=-np.inf))
    angle = without_noise(most, seen.angle[c], closed, length)
    t, n = sif.frame[:, 0], sif.frame[:, 1]
    return Places(
        s=sif.s,
        front=sif.front,
        x=sif.x,
        frame=sif.frame,
        closed=closed,
        length=length,
        rate=seen.rate[c],
        law_rate=seen.law_rate[c],
        direction=np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * n,
        pending=np.zeros(len(sif.s)) if pending is None else pending,
        size=float(seen.length[c]),
    )


def _corrected_places(
    seen: Evaluation, c: int, crack: Crack, old: Places, pending: Floats
) -> Places:
    """Places of a corrected crack, with what was solved close by."""
    here, mesh = _solved_places(seen, c, None), seen.problem.mesh
    fronts = front_frames(crack)
    x = np.concatenate([front.x for front in fronts])
    s = np.concatenate([front.s[: len(front.x)] for front in fronts])
    number = np.repeat(np.arange(len(fronts)), [len(front.x) for front in fronts])
    frame = np.concatenate([front.frame for front in fronts])

    def near(values: Floats) -> Floats:
        return interpolate_within_reach(here, here.closed, values, x, mesh)

    rate = near(here.rate)
    there = ~np.isnan(rate) & contains(mesh, x)
    direction = np.stack([near(here.direction[:, k]) for k in range(3)], axis=1)
    waits = np.nan_to_num(interpolate_within_reach(old, old.closed, pending, x, mesh))
    return Places(
        s=s[there],
        front=number[there],
        x=x[there],
        frame=frame[there],
        closed=np.array(closed_fronts(crack), dtype=bool),
        length=front_lengths(crack),
        rate=rate[there],
        law_rate=near(here.law_rate)[there],
        direction=direction[there],
        pending=waits[there],
        size=follow_3d.crack_size(crack, mesh),
    )


def _waiting(seen: Evaluation, c: int, part: Places, pending: Floats) -> Floats:
    x = seen.sif[0][c].x
    return np.nan_to_num(interpolate_within_reach(part, part.closed, pending, x, seen.problem.mesh))


def _onto(
    run: GrowthRule, seen: Evaluation, c: int, part: Places, last: Step, before: Floats, gap: Floats
) -> Floats:
    """Estimated error of the places that were solved, with what this step adds."""
    x, mesh, old = seen.sif[0][c].x, seen.problem.mesh, last.sif[0][c]
    own = np.nan_to_num(interpolate_within_reach(part, part.closed, share_left(run) * gap, x, mesh))
    if not len(old.x):
        return own
    reach = 2 * REACH * float(cell_sizes(mesh, old.x).mean()) + float(gap.max(initial=0.0))
    earlier = interpolate_along_front(
        old.x, old.front, closed_fronts(last.cracks[c]), before, x, reach
    )
    return np.asarray(own + np.nan_to_num(earlier))


def _cycles(
    run: GrowthRule, trail: FrontTrail, plan: Advance, seen: Evaluation
) -> tuple[float, float]:
    """Cycles of a step by the largest rates at both ends, and what they add to the error.

    All places advance in proportion to these, and without the response of the front: so the
    scatter of the largest of many rates costs nothing.
    """
    c = plan.tip[0]
    before = max(float(part.law_rate.max(initial=0.0)) for part in trail.parts)
    later = max((float(rate.max(initial=0.0)) for rate in seen.law_rate), default=0.0)
    size0, size1 = [trail.parts[c].size], [seen.length[c]]
    one = [np.array([value]) for value in (plan.largest, before, later)]
    cycles = elapsed_3d(size0, size1, one[:1], one[1:2], one[2:])
    if not 0 < later < np.inf:
        return cycles, 0.0
    trapezoid = 0.5 * plan.largest * (1 / before + 1 / later)
    return cycles, share_left(run) * abs(cycles - trapezoid)


__all__ = [
    "REACH",
    "Later",
    "advanced",
    "begun",
    "beyond_trapezoid",
    "cycles_to",
    "front_lengths",
    "interpolate_within_reach",
    "move_of",
    "overloads_between",
    "planned",
    "rate_at_end",
    "settled",
    "with_kinds",
    "with_mean_rates",
    "zones_onto",
]
