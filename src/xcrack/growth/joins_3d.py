"""Cracks in 3D that lie in one surface join as soon as their fronts meet; one front goes on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.special import exprel

from xcrack.base.arrays import Floats, at
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.crack.merging import OFFSET, FrontGap, gap_between, merged_crack, turned_crack
from xcrack.crack.placing import place_crack
from xcrack.crack.stations import closed_fronts
from xcrack.fatigue.checks import law_exponent
from xcrack.growth import euler, follow_3d, pec_3d
from xcrack.growth.ending import part_of_time
from xcrack.growth.follow_3d import crack_size, interpolate_along_front
from xcrack.growth.integrators import integrator_of
from xcrack.growth.joins_2d import named_by_number
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled
from xcrack.growth.step import Arriving, Join, Joined, Step, StepError, memory_of
from xcrack.growth.trail import FrontTrail
from xcrack.mesh.locate import Body, cell_sizes
from xcrack.mesh.mesh import Mesh

_NEAR = 1.1  # cells between fronts below which they join: closer ones cannot be solved
_BESIDE = 1.0  # cells that fronts may pass beside each other at the end of the whole advance
_LEFT = 0.25  # of a cell: the gap that is closed at once
_RADIUS = 1.0  # cells: of the disc that rounds hollow corners of the joined front
_SPACING = 0.5  # of a cell, between the points of a new front
_WITHIN = 1e-3  # of a cell: to which the gap is closed
_TRIES = 12  # advances until it is
_REACH = 4.0  # cells from a place along a front to those of the step before
_MOST = 0.75  # of a cell: gap that may be left where the fronts speed up towards each other
_UNKNOWN = 0.25  # of what the cycles differ by from those at the last rate: what is unsure of them

_ADVANCED: dict[str, Callable[[GrowthRule, Step, float], list[Crack]]] = {
    "euler": euler.advanced,
    "pec": pec_3d.advanced,
}
_BEGUN: dict[str, Callable[[GrowthRule, Evaluation, float, StepError], Settled]] = {
    "euler": euler.begun_at,
    "pec": pec_3d.begun_at,
}


def joined(run: GrowthRule, last: Step, cracks: Sequence[Crack]) -> Joined | None:
    """Cracks that meet within the advance after a step, joined; None where none do.

    The advance ends where the first two fronts are a quarter of a cell apart, which is closed.

    Parameters
    ----------
    run : GrowthRule
    last : Step
    cracks : sequence of Crack
        After the whole advance.

    Returns
    -------
    Joined or None

    Raises
    ------
    GeometryError
        The gap between two fronts has a shape that cannot be closed.
    """
    if len(cracks) < 2:
        return None
    body = Body.of(run.problem.mesh)
    close = _close(cracks, body, _BESIDE)
    if not close:
        return None
    hindrance = _hindrance(run)
    if hindrance:
        i, k = close[0][0]
        raise GeometryError(f"cracks {i} and {k} meet near {at(close[0][1].x)}, and {hindrance}")
    m = law_exponent(run.law, np.concatenate(last.dK_eq), np.concatenate(last.R))
    met = [_met(run, last, cracks, *each, body, m) for each in close]
    share, way, plain = min(met)
    now = _ADVANCED[run.integrator](run, last, way)
    by_first_rate = integrator_of(run).planned(run, last).largest / _fastest(last)
    cycles = share * by_first_rate / _gain(last, now, run.problem.mesh, m)
    unsure = _UNKNOWN * abs(plain * by_first_rate - cycles)
    apart, joins = tuple(now), []
    number = list(range(len(now)))
    while pairs := _close(now, body, OFFSET):
        (i, k), gap, size = pairs[0]
        other = now[k] if gap.turn > 0 else turned_crack(now[k])
        now[i] = merged_crack(now[i], other, _RADIUS * size, _SPACING * size)
        x = tuple(gap.x.tolist())
        joins.append(Join(last.index + 1, last.cycles + cycles, x, (number[i], number[k])))
        del now[k], number[k]
    return Joined(tuple(now), apart, tuple(joins), way, cycles, unsure) if joins else None


def arriving(run: GrowthRule, last: Step, met: Joined) -> list[Arriving]:
    """What comes to the boundary in an advance in which cracks join, numbered as before it."""
    mesh = run.problem.mesh
    step = replace(last, da=tuple(met.way * da for da in last.da))
    return follow_3d.arriving(
        step, met.apart, [place_crack(crack, mesh) for crack in met.apart], mesh
    )


def settled(run: GrowthRule, last: Step, seen: Evaluation, met: Joined) -> Settled:
    """A step whose cracks have just joined: growth begins anew, after the cycles so far."""
    mesh, before = seen.problem.mesh, 0.0 if last.error is None else last.error.cycles
    place = tuple(_errors(last, sif.x, mesh) for sif in seen.sif[0])
    error = StepError(place, before + met.error)
    return _BEGUN[run.integrator](run, seen, last.cycles + met.cycles, error)


def _close(
    cracks: Sequence[Crack], body: Body, beside: float
) -> list[tuple[tuple[int, int], FrontGap, float]]:
    """Pairs of cracks in one surface whose fronts are too close to be solved, nearest first.

    In one surface: within `beside` cells of each other across it.

    With each pair the gap between them, and the size of the cell there.
    """
    result = []
    for i, k in combinations(range(len(cracks)), 2):
        x = np.concatenate([cracks[i].points[front] for front in cracks[i].fronts or ()])
        if not len(x):
            continue
        gap = gap_between(cracks[i], cracks[k], body, 2 * float(body.cell_size(x).max()))
        if gap is None:
            continue
        size = float(body.cell_size(gap.x[None])[0])
        if gap.width < _NEAR * size and gap.in_surface(size, beside):
            result.append(((i, k), gap, size))
    return sorted(result, key=lambda each: each[1].width / each[2])


def _met(
    run: GrowthRule,
    last: Step,
    cracks: Sequence[Crack],
    pair: tuple[int, int],
    near: FrontGap,
    size: float,
    body: Body,
    exponent: float,
) -> tuple[float, float, float]:
    """When two fronts have met, in shares of an advance.

    Where they face each other K grows as the gap closes: they meet sooner than at the rates of the
    beginning, and the rest of the fronts has not come as far.

    Returns
    -------
    time : float
        Until they have met.
    way : float
        Up to which they advance: some of the gap stays, to be closed at once.
    plain : float
        Time at the rates of the beginning.
    """
    i, k = pair
    # Over an offset a wider gap is closed, so that no face stands steeper than 45 degrees.
    share_left = float(np.clip(near.offset / size, _LEFT, OFFSET))
    way = _share(run, last, cracks, pair, size, share_left, body)
    first = gap_between(last.corrected[i], last.corrected[k], body, np.inf)
    gap, left = (0.0 if first is None else first.width), share_left * size
    if gap <= left:
        return way, way, way
    a = 2 * float(np.mean([memory_of(last).length[c] for c in pair]))  # of a penny: its radius
    plain = way * gap / (gap - left)
    time = plain * part_of_time(gap / a, exponent)
    most = way * (gap - _MOST * size) / (gap - left)
    return time, min(way, max(time, most)), plain


def _gain(last: Step, now: Sequence[Crack], mesh: Mesh, exponent: float) -> float:
    """Mean rate of an advance over that at its beginning, of the crack that grows most.

    As in `elapsed_3d`: K goes with the root of the size.
    """
    gains = []
    for old, crack in zip(memory_of(last).length, now):
        x = np.log(crack_size(crack, mesh) / old)
        gains.append(float(exprel(x) / exprel(x - exponent / 2 * x)))
    return max(gains)


def _share(
    run: GrowthRule,
    last: Step,
    cracks: Sequence[Crack],
    pair: tuple[int, int],
    size: float,
    left: float,
    body: Body,
) -> float:
    """Share of an advance after which a gap is closed but for `left` cells.

    At most the whole advance, or one of a cell where that is longer: what is left then is less
    than a cell wide, or the fronts do not come closer.
    """
    plan = integrator_of(run).planned(run, last)
    most = max(1.0, size / plan.largest)
    i, k = pair

    def excess(share: float) -> float:
        now = cracks if share == 1.0 else _ADVANCED[run.integrator](run, last, share)
        gap = gap_between(now[i], now[k], body, 10 * size + 2 * share * plan.largest)
        return np.inf if gap is None else gap.width / size - left

    low, at_low = 0.0, excess(0.0)
    high, at_high = 1.0, excess(1.0)
    while at_high > 0 and high < most:
        low, at_low = high, at_high
        high = min(2 * high, most)
        at_high = excess(high)
    if at_high > 0 or not np.isfinite(at_low):
        return high
    for _ in range(_TRIES):
        # Where fronts overlap the gap is zero and says nothing of how far: then halve.
        part = at_low / (at_low - at_high) if at_high > -0.99 * left else 0.5
        share = low + part * (high - low)
        value = excess(share)
        if abs(value) < _WITHIN:
            return share
        if value > 0:
            low, at_low = share, value
        else:
            high, at_high = share, value
    return high


def _fastest(step: Step) -> float:
    """Largest rate of those that the advance after a step is made of."""
    trail = memory_of(step).trail
    parts = [part.rate for part in trail.parts] if isinstance(trail, FrontTrail) else step.rate
    return max(float(rate.max(initial=0.0)) for rate in parts)


def _errors(last: Step, x: Floats, mesh: Mesh) -> Floats:
    """Estimated errors of the places of a step at places close by, 0 elsewhere."""
    result = np.zeros(len(x))
    for c, crack in enumerate(last.cracks):
        own = None if last.error is None else last.error.place[c]
        old = last.sif[0][c]
        if own is None or not len(old.x):
            continue
        reach = _REACH * float(cell_sizes(mesh, old.x).mean())
        near = interpolate_along_front(old.x, old.front, closed_fronts(crack), own, x, reach)
        result = np.maximum(result, np.nan_to_num(near))
    return result


def _hindrance(run: GrowthRule) -> str:
    """Why cracks cannot join in a run; empty where they can."""
    hindrance = named_by_number(run)
    if hindrance:
        return hindrance
    if isinstance(run.problem.friction, Sequence) or any(run.problem.frictions):
        return (
            "what slip has left on the faces of two cracks is not carried on to one: go on with "
            "friction=0, or with a new run from there."
        )
    if run.retardation is not None:
        return (
            "what overloads have left at two fronts is not carried on to one: go on without "
            "retardation from there."
        )
    return ""


__all__ = ["joined", "settled"]
