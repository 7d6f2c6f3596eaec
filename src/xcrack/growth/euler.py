"""Growth of first order: each step goes on with the directions and rates at its beginning."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import exprel

from xcrack.base.arrays import Floats, Ints
from xcrack.crack.advance_2d import advance
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import closed_fronts
from xcrack.crack.meetings import LEAST, joined_cracks, meetings
from xcrack.crack.placing_3d import place_arms
from xcrack.fatigue.cycle import cycles_between
from xcrack.growth import fronts
from xcrack.growth.fronts import advanced_crack, interpolate_along_front, solved_ends
from xcrack.growth.interfaces import (
    InterfacesAhead,
    cycles_across,
    cycles_of_jump,
    interfaces_ahead,
    rates_behind,
    warn_of_passages,
    whole_front_ahead,
)
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates, rates_by_law_of
from xcrack.growth.solves import SolveHistory
from xcrack.growth.stations import Identities, PerCrack
from xcrack.growth.step import Corrected, Plan, Step, StepError, moved_places, plan_of, solves_of
from xcrack.growth.step_length import longest_advance
from xcrack.mesh.locate import cell_sizes

_SAME = 1e-6  # of the coordinates: a tip recognised after its advance
_DRIVING = 0.5  # share of the largest rate from which on a point counts as driving


def predict(rule: GrowthRule, step: Step) -> Plan:
    """The advance after a step."""
    stations, solves = solves_of(step)
    ends = _ENDS[rule.problem.mesh.dim]
    cell = cell_sizes(rule.problem.mesh, stations.x)
    rate = np.concatenate([np.zeros(0), *step.rate])
    fastest_rate = float(rate.max(initial=0.0))
    plan = Plan.at_rest(step, cell)
    if fastest_rate == 0 or np.isinf(fastest_rate):
        return plan
    by_cycles = np.inf if rule.cycles is None else rule.cycles * fastest_rate
    length = float(min(longest_advance(rule, step.control), by_cycles))
    score = _score(rule, step)
    growth = stations.growth(score, length)
    is_growing = growth >= ends.waits_below * cell
    way = np.where(is_growing, growth, 0.0)
    interfaces = None
    if rule.has_interfaces:
        interfaces = ends.interfaces_ahead(rule, stations.x, way[:, None] * solves.direction[-1])
    if interfaces is not None and (way > interfaces.stop).any():  # a step ends before it, or behind
        is_beyond = way > interfaces.stop
        length *= float((interfaces.goal[is_beyond] / way[is_beyond]).min())
        growth = stations.growth(score, length)
        is_growing = growth >= ends.waits_below * cell
        way = np.where(is_growing, growth, 0.0)
    row = int(np.argmax(score))
    plan = replace(
        plan,
        length=length,
        cycles=length / float(rate[row]),
        arc=way,
        move=way[:, None] * solves.direction[-1],
        moves=is_growing,
        tip=row,
        largest=length,
    )
    return plan.with_cracks(lambda: advanced_cracks(rule, step, way))


def advanced_cracks(rule: GrowthRule, step: Step, way: Floats) -> list[Crack]:
    """The cracks after the advance of their stations."""
    return _ENDS[rule.problem.mesh.dim].advanced_cracks(rule, step, way)


def _advanced_surfaces(rule: GrowthRule, step: Step, way: Floats) -> list[Crack]:
    mesh, stations = rule.problem.mesh, solves_of(step)[0]
    angle = np.concatenate([np.zeros(0), *step.angle])
    cracks = [
        advanced_crack(crack, stations, c, angle, way, mesh) for c, crack in enumerate(step.cracks)
    ]
    return place_arms(cracks, mesh)


def _advanced_lines(rule: GrowthRule, step: Step, way: Floats) -> list[Crack]:
    mesh, stations = rule.problem.mesh, solves_of(step)[0]
    angle = np.concatenate([np.zeros(0), *step.angle])
    rows = [stations.crack == c for c in range(len(step.cracks))]
    cracks = [advance(crack, angle[r], way[r]) for crack, r in zip(step.cracks, rows, strict=True)]
    if rule.link_up is not None:
        return cracks
    meetings_now = [meeting for meeting in meetings(cracks, mesh) if meeting.is_soon]
    return joined_cracks(cracks, (way > 0).tolist(), meetings_now) if meetings_now else cracks


def partly_advanced(rule: GrowthRule, step: Step, plan: Plan, part: float | Floats) -> list[Crack]:
    """The cracks after a part of a planned advance, or parts of it `(n,)` at the stations."""
    return advanced_cracks(rule, step, part * plan.arc)


def ends_of(step: Step, plan: Plan) -> Floats:
    """Where the ends of the cracks come to `(n, d)`."""
    return solves_of(step)[0].x + plan.move


def advance_of(step: Step, plan: Plan, rates: Rates) -> Floats:
    """Advance to the next step at the stations that were solved `(n,)`, length."""
    del step, rates
    return plan.arc


def begin(rule: GrowthRule, rates: Rates, identities: Identities) -> Corrected:
    """The first step of a run."""
    return _step_of_solve(rule, rates, identities, 0.0, np.zeros(len(rates.stations)))


def begin_at(
    rule: GrowthRule,
    rates: Rates,
    identities: Identities,
    cycles: float,
    error: StepError,
    step: Step | None = None,
) -> Corrected:
    """A step before which there is nothing to follow."""
    del error, step
    return _step_of_solve(rule, rates, identities, cycles, np.zeros(len(rates.stations)))


def correct(rule: GrowthRule, step: Step, rates: Rates, identities: Identities) -> Corrected:
    """What the cracks after an advance mean for the cycles and for the next advance."""
    way_since, growth_owed = _ENDS[rates.problem.mesh.dim].growth_since(rule, step, rates)
    return _step_of_solve(rule, rates, identities, step.cycles + way_since, growth_owed)


def _step_of_solve(
    rule: GrowthRule, rates: Rates, identities: Identities, cycles: float, growth_owed: Floats
) -> Corrected:
    direction = rates.direction
    stations = solved_ends(rates, identities)
    stations = replace(stations, offset=growth_owed[:, None] * direction)
    solves = SolveHistory(
        np.zeros(1), rates.law_rate[None], rates.dK_eq[None], direction[None],
        rates.size_of_law, np.zeros(len(stations)), rates.exponent(rule.law),
    )  # fmt: skip
    return Corrected(cycles, rates.cracks, stations, solves)


def cycles_until(rule: GrowthRule, step: Step, part: float, end_rate: float | None) -> float:
    """Cycles of a part of the advance after a step, in proportion to it."""
    del rule
    return part * (plan_of(step).cycles if end_rate is None else end_rate)


# Cycles of a step, by the local power law of what drives it, and growth that goes on waiting.


def _followed_2d(rule: GrowthRule, step: Step, rates: Rates) -> tuple[float, Floats]:
    """Cycles since the last step, and the growth that waits at the tips of this one.

    All tips together: where two cracks have become one, their numbers have changed. Their moved
    places are recognised; one that has left the body has no rate.
    """
    stations, solves = solves_of(step)
    moved_x = np.concatenate([moved_places(step, c) for c in range(len(step.cracks))])
    row = _rows_after(moved_x, rates.stations.x)
    has_row = row >= 0
    growth_owed = np.zeros(len(rates.stations))
    growth_owed[row[has_row]] = _rest(rule, step)[has_row]
    rate0, da = solves.rate[-1], np.concatenate(step.da)
    is_growing = (da > 0) & (rate0 > 0)
    stay = is_growing & has_row
    choice = stay if stay.any() else is_growing
    j = int(np.argmax(np.where(choice, rate0, -1.0)))
    if not has_row[j]:
        return float(da[j] / rate0[j]), growth_owed
    if rule.has_interfaces:
        interfaces = interfaces_ahead(rule, stations.x, plan_of(step).move)
        if interfaces is not None and da[j] > interfaces.way[j]:
            return _cycles_across(rule, step, rates, interfaces, j, int(row[j])), growth_owed
    c = int(stations.crack[j])
    a = step.sizes[c] * float(da[j] / da[stations.crack == c].sum())
    return float(cycles_between(a, a + da[j], rate0[j], rates.law_rate[row[j]])), growth_owed


def _cycles_across(
    rule: GrowthRule, step: Step, rates: Rates, interfaces: InterfacesAhead, j: int, row: int
) -> float:
    """Cycles of a step in which the driving tip j has passed an interface; `row` is it behind."""
    solves, way = solves_of(step)[1], float(interfaces.way[j])
    way_behind = float(plan_of(step).arc[j]) - way
    begin, end = float(solves.rate[-1, j]), float(rates.law_rate[row])
    if not 0 < end < np.inf:  # the run ends there
        cycles = np.array([way, way_behind]) / begin
    elif interfaces.is_smooth[j]:
        sets = np.array(rule.problem.elasticity.sets_at(rates.stations.x))
        sets[row] = interfaces.set_before[j]
        rate_here = rates_by_law_of(rule, rates.problem, rates.response, sets)[row]
        rate_there = rates_behind(rule, step, interfaces)[j]
        rate = np.array([[begin, rate_here], [rate_there, end]])
        cycles = cycles_across(float(solves.scale[j]), way, way_behind, *rate)
    else:
        exponent, power = rates.exponent(rule.law), float(interfaces.power[j])
        cycles = np.array(cycles_of_jump(solves, exponent, end, j, way, way_behind, power))
    at = np.full(len(interfaces.way), np.nan)
    at[j] = cycles[0]
    warn_of_passages(rule, step, interfaces, at)
    return float(cycles.sum())


def _score(rule: GrowthRule, step: Step) -> Floats:
    """What the advances of the stations are in proportion to `(n,)`."""
    rate = np.concatenate([np.zeros(0), *step.rate])
    return rate if rule.scaling == "law" else np.where(rate > 0, solves_of(step)[1].dK_eq[-1], 0.0)


def _rest(rule: GrowthRule, step: Step) -> Floats:
    """Growth that goes on waiting at the stations of a step `(n,)`."""
    plan = plan_of(step)
    return np.where(plan.moves, 0.0, solves_of(step)[0].growth(_score(rule, step), plan.length))


def _rows_after(moved_x: Floats, tips: Floats) -> Ints:
    """Row of each tip after the step, -1 where it has left the body."""
    if not len(tips) or not len(moved_x):
        return np.full(len(moved_x), -1)
    distance, row = cKDTree(tips).query(moved_x)
    return np.where(distance <= _SAME * np.abs(tips).max(), row, -1)


def _followed_3d(rule: GrowthRule, step: Step, rates: Rates) -> tuple[float, Floats]:
    """Cycles since the last step, and the growth that waits at the places of this one."""
    stations, mesh = solves_of(step)[0], rates.problem.mesh
    rest = _rest(rule, step)
    rates_after: list[Floats] = []
    growth_owed: list[Floats] = []
    for c, crack in enumerate(rates.cracks):
        new_sif, moved_x = rates.sif[0][c], moved_places(step, c)
        reach = fronts.REACH * float(cell_sizes(mesh, new_sif.x).mean() if len(new_sif.x) else 0.0)
        is_of_crack, is_closed = rates.stations.crack == c, closed_fronts(crack)
        rates_after.append(
            interpolate_along_front(
                new_sif.x, new_sif.front, is_closed, rates.law_rate[is_of_crack], moved_x, reach
            )
        )
        old_sif, is_closed_before = step.sif[0][c], closed_fronts(step.cracks[c])
        growth_nearby = interpolate_along_front(
            moved_x, old_sif.front, is_closed_before, rest[stations.crack == c], new_sif.x, reach
        )
        growth_owed.append(np.nan_to_num(growth_nearby))
    cycles_across = fronts.cycles_of_passage(rule, step, rates)
    if cycles_across is not None:
        return cycles_across, np.concatenate(growth_owed)
    sizes = (step.sizes, rates.problem.sizes)
    cycles = elapsed_3d(*sizes, step.da, step.law_rate, rates_after)
    return cycles, np.concatenate(growth_owed)


def elapsed_3d(
    size0: tuple[float, ...],
    size1: tuple[float, ...],
    da: PerCrack,
    rate0: PerCrack,
    rate1: list[Floats],
) -> float:
    """Cycles of one step of 3D cracks, by the power law of the point that drives it.

    Parameters
    ----------
    size0, size1 : tuple of float, length
        Size of each crack before and after the step.
    da, rate0 : tuple of (f,) arrays
        Advance of the places along the fronts of each crack, and growth a cycle before the step.
    rate1 : list of (f,) arrays, length/cycle
        Growth a cycle after the step where these places have come to, nan where they have left the
        body, inf where the toughness is reached.

    Notes
    -----
    The driving point is the one with the largest rate of those that moved and are still there;
    if none is, the rate before the step stands for the whole of it. Its rate is taken as a power
    of the size, which is proportional to the advance within the step: with x = ln(size1/size0),
    y = ln(rate1/rate0) and E(q) = (e^q - 1)/q the step takes da/rate0 E(x - y)/E(x) cycles. For
    a straight front, and for any front that keeps its shape, this is `cycles_between`. y is that
    of all points of the crack which grow at least half as fast, so that the scatter of K from
    point to point averages out.
    """
    is_moved = [(d > 0) & (r > 0) for d, r in zip(da, rate0)]
    stay = [m & ~np.isnan(r) for m, r in zip(is_moved, rate1)]
    has_rate = any(m.any() for m in stay)
    maxima = [float(r[m].max(initial=-1.0)) for r, m in zip(rate0, stay if has_rate else is_moved)]
    c = int(np.argmax(maxima))
    driving = (stay if has_rate else is_moved)[c] & (rate0[c] >= maxima[c])
    j = int(np.argmax(driving))
    by_first_rate = float(da[c][j] / rate0[c][j])
    if not has_rate:
        return by_first_rate
    is_fast = stay[c] & (rate0[c] >= _DRIVING * maxima[c])
    if np.isinf(rate1[c][is_fast]).any():
        return 0.5 * by_first_rate  # as in `cycles_between`
    ratio = float(rate1[c][is_fast].sum() / rate0[c][is_fast].sum())
    if ratio == 0:
        return 2 * by_first_rate
    x, y = np.log(size1[c] / size0[c]), np.log(ratio)
    return by_first_rate * float(exprel(x - y) / exprel(x))


@dataclass(frozen=True)
class _Ends:
    """What tips and fronts do in ways of their own.

    `waits_below` in cells; `growth_since` the last step: cycles, and growth that waits.
    """

    waits_below: float
    interfaces_ahead: Callable[[GrowthRule, Floats, Floats], InterfacesAhead | None]
    advanced_cracks: Callable[[GrowthRule, Step, Floats], list[Crack]]
    growth_since: Callable[[GrowthRule, Step, Rates], tuple[float, Floats]]


_ENDS = {
    2: _Ends(LEAST, interfaces_ahead, _advanced_lines, _followed_2d),
    3: _Ends(fronts.WAITS_BELOW, whole_front_ahead, _advanced_surfaces, _followed_3d),
}

__all__ = [
    "advance_of",
    "advanced_cracks",
    "begin",
    "begin_at",
    "correct",
    "cycles_until",
    "elapsed_3d",
    "ends_of",
    "partly_advanced",
    "predict",
]
