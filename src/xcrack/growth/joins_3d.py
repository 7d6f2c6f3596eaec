"""Cracks in 3D that lie in one surface join as soon as their fronts meet; one front goes on."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.special import exprel

from xcrack.base.arrays import Floats, at
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import closed_fronts
from xcrack.crack.measures import crack_size
from xcrack.crack.merging import OFFSET, FrontGap, gap_between, merged_crack, turned_crack
from xcrack.growth import euler, fronts
from xcrack.growth.corrected import Corrected
from xcrack.growth.fronts import interpolate_along_front
from xcrack.growth.gaps import UNKNOWN, part_of_time
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates
from xcrack.growth.stations import Identities
from xcrack.growth.step import Join, Plan, Step, StepError, plan_of, solves_of
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

_INTEGRATORS = {"euler": euler, "pec": fronts}


def with_joins(rule: GrowthRule, step: Step, plan: Plan) -> Plan:
    """A plan in which cracks that meet within its advance are joined.

    The advance ends where the first two fronts are a quarter of a cell apart, which is closed.

    Parameters
    ----------
    rule : GrowthRule
    step : Step
    plan : Plan
        The whole advance.

    Raises
    ------
    GeometryError
        The gap between two fronts has a shape that cannot be closed.
    """
    if len(plan.cracks) < 2:
        return plan
    body = Body.of(rule.problem.mesh)
    close = _close(plan.cracks, body, _BESIDE)
    if not close:
        return plan
    hindrance = _hindrance(rule)
    if hindrance:
        i, k = close[0][0]
        raise GeometryError(f"cracks {i} and {k} meet near {at(close[0][1].x)}, and {hindrance}")
    m = solves_of(step)[1].exponent
    time, way, plain = min(_met(rule, step, plan, *each, body, m) for each in close)
    now = _advanced(rule, step, plan, way)
    cycles = time * plan.cycles / _gain(step, now, rule.problem.mesh, m)
    unsure = UNKNOWN[3] * abs(plain * plan.cycles - cycles)
    apart, joins = tuple(now), []
    number = list(range(len(now)))
    while pairs := _close(now, body, OFFSET):
        (i, k), gap, size = pairs[0]
        other = now[k] if gap.turn > 0 else turned_crack(now[k])
        now[i] = merged_crack(now[i], other, _RADIUS * size, _SPACING * size)
        x = tuple(gap.x.tolist())
        joins.append(Join(step.index + 1, step.cycles + cycles, x, (number[i], number[k])))
        del now[k], number[k]
    if not joins:
        return plan
    return replace(
        plan, part=way, cycles=cycles, error=unsure, cracks=tuple(now), apart=apart,
        joins=tuple(joins),
    )  # fmt: skip


def _advanced(rule: GrowthRule, step: Step, plan: Plan, part: float) -> list[Crack]:
    return _INTEGRATORS[rule.integrator].partly_advanced(rule, step, plan, part)


def joined(rule: GrowthRule, last: Step, rates: Rates, identities: Identities) -> Corrected:
    """A step whose cracks have just joined: growth begins anew, after the cycles so far."""
    mesh, before = rates.problem.mesh, 0.0 if last.error is None else last.error.cycles
    plan = plan_of(last)
    place = tuple(_errors(last, sif.x, mesh) for sif in rates.sif[0])
    error = StepError(place, before + plan.error)
    return _INTEGRATORS[rule.integrator].begin_at(
        rule, rates, identities, last.cycles + plan.cycles, error
    )


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
    rule: GrowthRule,
    step: Step,
    plan: Plan,
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
    way = _share(rule, step, plan, pair, size, share_left, body)
    first = gap_between(step.corrected[i], step.corrected[k], body, np.inf)
    gap, left = (0.0 if first is None else first.width), share_left * size
    if gap <= left:
        return way, way, way
    a = 2 * float(np.mean([step.sizes[c] for c in pair]))  # of a penny: its radius
    plain = way * gap / (gap - left)
    time = plain * part_of_time(gap / a, exponent, 3)
    most = way * (gap - _MOST * size) / (gap - left)
    return time, min(way, max(time, most)), plain


def _gain(step: Step, now: Sequence[Crack], mesh: Mesh, exponent: float) -> float:
    """Mean rate of an advance over that at its beginning, of the crack that grows most.

    As in `elapsed_3d`: K goes with the root of the size.
    """
    gains = []
    for old, crack in zip(step.sizes, now):
        x = np.log(crack_size(crack, mesh) / old)
        gains.append(float(exprel(x) / exprel(x - exponent / 2 * x)))
    return max(gains)


def _share(
    rule: GrowthRule,
    step: Step,
    plan: Plan,
    pair: tuple[int, int],
    size: float,
    left: float,
    body: Body,
) -> float:
    """Share of an advance after which a gap is closed but for `left` cells.

    At most the whole advance, or one of a cell where that is longer: what is left then is less
    than a cell wide, or the fronts do not come closer.
    """
    most = max(1.0, size / plan.largest)
    i, k = pair

    def excess(share: float) -> float:
        now = plan.cracks if share == 1.0 else _advanced(rule, step, plan, share)
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


def _hindrance(rule: GrowthRule) -> str:
    """Why cracks cannot join in a run; empty where they can."""
    hindrance = named_by_number(rule)
    if hindrance:
        return hindrance
    if isinstance(rule.problem.friction, Sequence) or any(rule.problem.frictions):
        return (
            "what slip has left on the faces of two cracks is not carried on to one: go on with "
            "friction=0, or with a new run from there."
        )
    if rule.retardation is not None:
        return (
            "what overloads have left at two fronts is not carried on to one: go on without "
            "retardation from there."
        )
    return ""


def named_by_number(rule: GrowthRule) -> str:
    """Why cracks cannot become one: a load names one by its number; empty where none does."""
    states = [state for state in rule.cycle.load_states if isinstance(state, list | tuple)]
    loads = [*rule.problem.loads, *(load for state in states for load in state)]
    if any(load.is_of_one_crack for load in loads):
        return (
            "a load names a crack by its number, which is another one's after they have joined: "
            "give it without crack."
        )
    return ""


__all__ = ["joined", "named_by_number", "with_joins"]
