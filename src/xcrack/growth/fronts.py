"""Growth of second order at one solve a step, of fronts of 3D cracks.

A step advances the corrected fronts of the last one by the rates known there, solves, and advances
the same fronts again by the rates at both ends, which are carried along the strip between the two.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial

import numpy as np
from scipy.special import exprel

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import GeometryError
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import Front, closed_fronts, front_curve, front_frames
from xcrack.crack.measures import crack_size
from xcrack.crack.placing_3d import place_arm, place_arms
from xcrack.crack.stations import front_in_body, inside_body, place_crack
from xcrack.fatigue.retardation import (
    POINTS,
    BlockCycles,
    CycleIntegration,
    OverloadZones,
    no_zones,
)
from xcrack.growth.front_filter import (
    FrontWaves,
    corrected_advance,
    predicted_advance,
    response,
    turning_of,
    without_noise,
)
from xcrack.growth.interfaces import (
    cycles_across,
    cycles_of_jump,
    rates_in_set,
    scene_of,
    warn_of_passages,
    whole_front_ahead,
)
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates, kinds_of
from xcrack.growth.solves import SolveHistory, cycle_by_cycle
from xcrack.growth.stations import GrowthStations, Identities, directions
from xcrack.growth.step import Corrected, Plan, Step, StepError, plan_of, solves_of
from xcrack.growth.step_length import first_control, longest_advance, next_control, share_left
from xcrack.mesh.distances import front_distance
from xcrack.mesh.locate import Body, cell_sizes
from xcrack.mesh.mesh import Mesh

WAITS_BELOW = 0.02  # of a cell: neighbours along a front move on, so a slow part has to follow
REACH = 2.0  # cells from a place along a front to those that values are carried from

_SPACING = 0.5  # of a cell, between the points of a new front
_SHORTEST = 0.6  # cells: a shorter step of a front would end in those in which it began

# Values along fronts, from one to the next.


def interpolate_along_front(
    x: Floats,
    front: Ints,
    is_closed: Sequence[bool],
    values: Floats,
    target: Floats,
    reach: float,
) -> Floats:
    """Values along fronts, taken over to points nearby, as those of the fronts after a step.

    Parameters
    ----------
    x : (f, 3) array, length
        Places with values, in order along each front.
    front : (f,) array of int
        Which front.
    is_closed : sequence of bool
        Whether each front is closed.
    values : (f,) or (f, m) array
    target : (g, 3) array, length
        Where values are sought.
    reach : float, length
        A point farther from all places than this gets none.

    Returns
    -------
    (g,) or (g, m) array
        Linear between the places, nan beyond reach.
    """
    result = np.full((len(target), *values.shape[1:]), np.nan)
    least_distance = np.full(len(target), float(reach))
    for number in np.unique(front):
        is_of_front = front == number
        line, values_on_line = x[is_of_front], values[is_of_front]
        if len(line) == 1:
            line, values_on_line = (
                np.concatenate([line, line]),
                np.concatenate([values_on_line, values_on_line]),
            )
        is_loop = bool(is_closed[number]) and len(line) > 2
        r, segment, place = front_distance(target, line, is_loop)
        next_point = (segment + 1) % len(line)
        place = np.nan_to_num(place).reshape(-1, *[1] * (values.ndim - 1))
        begin_value, end_value = values_on_line[segment], values_on_line[next_point]
        with np.errstate(invalid="ignore"):  # inf where the toughness is reached
            interpolated = (1 - place) * begin_value + place * end_value
        value = np.where(place == 0, begin_value, np.where(place == 1, end_value, interpolated))
        is_nearer = r <= least_distance
        result[is_nearer], least_distance[is_nearer] = value[is_nearer], r[is_nearer]
    return result


def _values_beside(part: GrowthStations, values: Floats, x: Floats, mesh: Mesh) -> Floats:
    """Values at the stations of a crack at points beside them; nan where there are none."""
    if not len(part.x):
        return np.full((len(x), *values.shape[1:]), np.nan)
    reach = REACH * float(cell_sizes(mesh, part.x).mean())
    return interpolate_along_front(part.x, part.front, _closed_fronts(part), values, x, reach)


def _values_at(
    stations: GrowthStations, values: Floats, crack: Ints, x: Floats, mesh: Mesh
) -> Floats:
    """Values at stations at points of some cracks beside them; nan where there are none."""
    result = np.full((len(x), *values.shape[1:]), np.nan)
    for c in np.unique(crack):
        rows, rows_there = stations.crack == c, crack == c
        result[rows_there] = _values_beside(stations.at(rows), values[rows], x[rows_there], mesh)
    return result


def _closed_fronts(part: GrowthStations) -> list[bool]:
    """Of each front of a crack whether it is closed."""
    result = [False] * (int(part.front.max(initial=-1)) + 1)
    for number, is_closed in zip(part.front.tolist(), part.closed.tolist(), strict=True):
        result[number] = is_closed
    return result


def _front_lengths(crack: Crack) -> Floats:
    """Length of each front along its curve, as places of K are measured, length."""
    return np.array([_arcs_of_vertices(front)[-1] for front in front_frames(crack)])


def _arcs_of_vertices(front: Front) -> Floats:
    """Arc length at the vertices of a front; of a closed one also of its first vertex again."""
    return front_curve(front.x, front.frame, front.is_closed).breaks


# Stations and solves of the cracks as they were solved, and as they are corrected.


def solved_ends(rates: Rates, identities: Identities) -> GrowthStations:
    """Ends of all cracks as K was solved there: nothing waits."""
    at, n = rates.stations, len(rates.stations)
    is_closed, length = np.zeros(n, dtype=bool), np.zeros(n)
    for c, crack in enumerate(rates.cracks):
        if crack.fronts is not None:
            rows = at.crack == c
            is_closed[rows] = np.array(closed_fronts(crack), dtype=bool)[at.front[rows]]
            length[rows] = _front_lengths(crack)[at.front[rows]]
    return GrowthStations(
        crack=at.crack,
        front=at.front,
        s=at.s,
        x=at.x,
        frame=at.frame,
        end=identities.of(at),
        closed=is_closed,
        length=length,
        offset=np.zeros_like(at.x),
        fresh=np.zeros(n, dtype=bool),
    )


def _solved_fronts(
    rule: GrowthRule, rates: Rates, identities: Identities, sigma: float
) -> tuple[GrowthStations, SolveHistory]:
    """Stations and solves of all fronts at which K was solved."""
    stations = solved_ends(rates, identities)
    n, angle = len(stations), np.zeros(len(stations))
    for c in range(len(rates.cracks)):
        rows = stations.crack == c
        most_open = max(
            (state[c] for state in rates.sif), key=lambda sif: sif.K_I.max(initial=-np.inf)
        )
        angle[rows] = without_noise(
            most_open, rates.angle[rows], stations.closed[rows], stations.length[rows]
        )
    solves = SolveHistory(
        sigma=np.array([sigma]),
        rate=rates.law_rate[None],
        dK_eq=rates.dK_eq[None],
        direction=directions(stations.frame, angle)[None],
        scale=np.array(rates.problem.sizes)[stations.crack],
        bend=np.zeros(n),
        exponent=rates.exponent(rule.law),
        kinds=kinds_of(rule, rates),
    )
    return stations, solves


def _corrected_part(
    rule: GrowthRule,
    c: int,
    cracks: Sequence[Crack],
    identities: Identities,
    solved_part: tuple[GrowthStations, SolveHistory],
    stations_before: GrowthStations,
    growth_owed: Floats,
) -> tuple[GrowthStations, SolveHistory]:
    """Stations of a corrected crack, with rates interpolated from those solved close by."""
    stations_here, solves = solved_part
    crack = cracks[c]
    mesh, fronts = rule.problem.mesh, front_frames(crack)
    is_inside = partial(inside_body, cracks, c, mesh)
    places, s, frame, length = [], [], [], []
    for front in fronts:
        place = front_in_body(front.x, front.frame, front.is_closed, is_inside)
        arcs = _arcs_of_vertices(front)
        places.append(place.x)
        s.append(np.interp(place.number, np.arange(len(arcs)), arcs))
        frame.append(place.with_frames(front.frame))
        length.append(arcs[-1])
    x, number = np.concatenate(places), np.repeat(np.arange(len(fronts)), [*map(len, places)])
    rate = _values_beside(stations_here, solves.rate[0], x, mesh)
    has_rate = ~np.isnan(rate)
    x, number = x[has_rate], number[has_rate]
    part = GrowthStations(
        crack=np.full(len(x), c),
        front=number,
        s=np.concatenate(s)[has_rate],
        x=x,
        frame=np.concatenate(frame)[has_rate],
        end=np.array(identities.ends[c], dtype=np.int64)[number],
        closed=np.array(closed_fronts(crack), dtype=bool)[number],
        length=np.array(length)[number],
        offset=np.zeros_like(x),
        fresh=np.zeros(len(x), dtype=bool),
    )
    direction = _values_beside(stations_here, solves.direction[0], x, mesh)
    rest = np.nan_to_num(_values_beside(stations_before, growth_owed, x, mesh))
    unit = direction / np.linalg.norm(direction, axis=1)[:, None]
    part = replace(part, offset=rest[:, None] * unit)
    return part, replace(
        solves,
        rate=rate[has_rate][None],
        dK_eq=_values_beside(stations_here, solves.dK_eq[0], x, mesh)[None],
        direction=direction[None],
        scale=np.full(len(x), crack_size(cracks, c, mesh)),
        bend=np.zeros(len(x)),
        kinds=None,
    )


def _kinds_near(
    solved_stations: GrowthStations,
    kinds: BlockCycles,
    x: Floats,
    kinds_elsewhere: BlockCycles | None = None,
) -> BlockCycles:
    """Cycles of a block of a crack at some places, linear between those that were solved."""
    if not len(solved_stations.x):
        return kinds if kinds_elsewhere is None else kinds_elsewhere
    p = kinds.dK.shape[2]
    values = np.concatenate([kinds.dK[0], kinds.R[0]], axis=1)
    values_nearby = interpolate_along_front(
        solved_stations.x, solved_stations.front, _closed_fronts(solved_stations), values, x, np.inf
    )
    a = np.full((1, len(x)), float(kinds.a.flat[0]))
    sets = kinds.sets
    if sets is not None:
        sets = sets[np.linalg.norm(x[:, None] - solved_stations.x, axis=2).argmin(axis=1)]
    return BlockCycles(values_nearby[None, :, :p], values_nearby[None, :, p:], a, sets)


def _all_kinds(parts: Sequence[BlockCycles]) -> BlockCycles:
    arrays = zip(*(kinds.arrays for kinds in parts), strict=True)
    sets = [kinds.sets for kinds in parts if kinds.sets is not None]
    dK, R, a = (np.concatenate(part, axis=1) for part in arrays)
    return BlockCycles(dK, R, a, np.concatenate(sets) if sets else None)


def _all_cracks(
    parts: Sequence[tuple[GrowthStations, SolveHistory]],
) -> tuple[GrowthStations, SolveHistory]:
    """Stations and solves of all cracks."""
    stations = GrowthStations(
        *(
            np.concatenate([getattr(part[0], f.name) for part in parts])
            for f in fields(GrowthStations)
        )
    )
    solves = [part[1] for part in parts]

    def rows(name: str, axis: int) -> Floats:
        return np.concatenate([getattr(history, name) for history in solves], axis=axis)

    return stations, replace(
        solves[0],
        rate=rows("rate", 1),
        dK_eq=rows("dK_eq", 1),
        direction=rows("direction", 1),
        scale=rows("scale", 0),
        bend=rows("bend", 0),
        kinds=None,
    )


def _part(of: tuple[GrowthStations, SolveHistory], c: int) -> tuple[GrowthStations, SolveHistory]:
    """Stations and solves of one crack."""
    stations, solves = of
    rows = stations.crack == c
    return stations.at(rows), replace(
        solves,
        rate=solves.rate[:, rows],
        dK_eq=solves.dK_eq[:, rows],
        direction=solves.direction[:, rows],
        scale=solves.scale[rows],
        bend=solves.bend[rows],
        kinds=None if solves.kinds is None else solves.kinds.at(rows),
    )


def _rate(rule: GrowthRule, solves: SolveHistory) -> Floats:
    """Rates after the threshold `(n,)`."""
    return np.where(solves.dK_eq[-1] < rule.threshold, 0.0, solves.rate[-1])


def _angle(stations: GrowthStations, solves: SolveHistory) -> Floats:
    return solves.angles(stations.frame)[-1]


def _move(stations: GrowthStations, angle: Floats, way: Floats) -> Floats:
    """Moves `(n, 3)` by ways at angles."""
    t, n = stations.frame[:, 0], stations.frame[:, 1]
    return np.asarray(way[:, None] * (np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * n))


# The next step.


def predict(rule: GrowthRule, step: Step) -> Plan:
    """The next step by the rates at its beginning."""
    stations, solves = solves_of(step)
    rate, cell = _rate(rule, solves), cell_sizes(rule.problem.mesh, stations.x)
    fastest_rate = float(rate.max(initial=0.0))
    plan = Plan.at_rest(step, cell)
    if fastest_rate == 0 or np.isinf(fastest_rate):
        is_arrested = rule.retardation is not None and fastest_rate == 0
        return replace(plan, limit="arrest" if is_arrested else "")
    by_cycles = np.inf if rule.cycles is None else rule.cycles * fastest_rate
    length = float(min(longest_advance(rule, step.control), by_cycles))
    row = int(np.argmax(rate))
    growth = stations.growth(rate, length)
    is_growing = growth >= WAITS_BELOW * cell
    way = _arcs(step, np.where(is_growing, growth, 0.0))
    interfaces = None
    if rule.has_interfaces:
        move = _move(stations, _angle(stations, solves), way)
        interfaces = whole_front_ahead(rule, stations.x, move)
    # It ends before an interface, or behind.
    if interfaces is not None and (way > interfaces.stop).any():
        is_beyond = way > interfaces.stop
        share, passes = (
            interfaces.goal[is_beyond] / way[is_beyond],
            (interfaces.goal > interfaces.way)[is_beyond],
        )
        length *= float(share[passes].max() if passes.any() else share.min())
        growth = stations.growth(rate, length)
        is_growing = growth >= WAITS_BELOW * cell
        way = _arcs(step, np.where(is_growing, growth, 0.0))
    plan = replace(
        plan,
        length=length,
        cycles=length / fastest_rate,
        arc=way,
        move=_move(stations, _angle(stations, solves), way),
        moves=is_growing,
        tip=row,
        largest=length,
    )
    return plan.with_cracks(lambda: advanced_cracks(rule, step, way))


def _arcs(step: Step, da: Floats) -> Floats:
    """Advance of the stations by rates `(n,)` with what the shape of their fronts makes of it."""
    stations, solves = solves_of(step)
    way = np.array(da)
    for rows, front in _waves(stations, solves, da):
        way[rows] = np.where(
            da[rows] > 0, predicted_advance(front, stations.s[rows], da[rows]), 0.0
        )
    return way


def advanced_cracks(rule: GrowthRule, step: Step, way: Floats) -> list[Crack]:
    """The cracks of a step after its stations have advanced."""
    stations, solves = solves_of(step)
    angle = _angle(stations, solves)
    mesh = rule.problem.mesh
    return place_arms(
        [
            advanced_crack(crack, stations, c, angle, way, mesh)
            for c, crack in enumerate(step.corrected)
        ],
        mesh,
    )


def partly_advanced(rule: GrowthRule, step: Step, plan: Plan, part: float | Floats) -> list[Crack]:
    """The cracks after a part of a planned advance, or parts of it `(n,)` at the stations."""
    stations, solves = solves_of(step)
    growth = stations.growth(_rate(rule, solves), plan.largest)
    is_growing = growth >= WAITS_BELOW * plan.cell
    return advanced_cracks(rule, step, _arcs(step, part * np.where(is_growing, growth, 0.0)))


def advanced_crack(
    crack: Crack, stations: GrowthStations, c: int, angle: Floats, way: Floats, mesh: Mesh
) -> Crack:
    """A crack after the advance of its fronts at stations along them."""
    rows = stations.crack == c
    if not rows.any():
        return crack
    size = _SPACING * float(cell_sizes(mesh, stations.x[rows]).mean())
    s, front = stations.s[rows], stations.front[rows]
    return advance_fronts(crack, s, front, angle[rows], way[rows], size, Body.of(mesh))


def _waves(
    stations: GrowthStations, solves: SolveHistory, advance: Floats
) -> list[tuple[Ints, FrontWaves | None]]:
    """Rows of each front, and its response: how rates change with the shape of the front."""
    result = []
    for end in np.unique(stations.crack * 10**6 + stations.front):
        rows = np.nonzero(stations.crack * 10**6 + stations.front == end)[0]
        is_closed, s = bool(stations.closed[rows[0]]), stations.s[rows]
        order = np.argsort(s)
        turning_rate = turning_of(stations.x[rows][order], is_closed) if len(rows) > 2 else 0.0
        length = float(stations.length[rows[0]])
        waves = response(s, advance[rows], solves.exponent, turning_rate, is_closed, length)
        result.append((rows, waves))
    return result


def ends_of(step: Step, plan: Plan) -> Floats:
    """Where the fronts at the stations come to `(n, 3)`."""
    return solves_of(step)[0].x + plan.move


def advance_of(step: Step, plan: Plan, rates: Rates) -> Floats:
    """Advance to the next step at the stations that were solved `(n,)`, length."""
    at = rates.stations
    advance = _values_at(solves_of(step)[0], plan.arc, at.crack, at.x, rates.problem.mesh)
    return np.nan_to_num(advance)


# A solve: correct the step that led there.


def begin(rule: GrowthRule, rates: Rates, identities: Identities) -> Corrected:
    """The first step of a run."""
    no_error = rates.split(np.zeros(len(rates.stations)))
    return begin_at(rule, rates, identities, 0.0, StepError(no_error, 0.0))


def begin_at(
    rule: GrowthRule,
    rates: Rates,
    identities: Identities,
    cycles: float,
    error: StepError,
    step: Step | None = None,
) -> Corrected:
    """A first step, or a restart with the overload zones that `step` had at the nearest places."""
    stations, solves = _solved_fronts(rule, rates, identities, 0.0)
    zones = None if rule.retardation is None else no_zones(len(stations))
    if zones is not None and step is not None:
        zones = _zones_after(rule, step, stations.x)
    size = min((rates.problem.sizes[c] for c in set(stations.crack.tolist())), default=np.inf)
    solves = _with_mean_rates(rule, stations, solves, zones)
    control = first_control(rule, size, _shortest_step(rule, stations, solves), np.inf)
    return Corrected(cycles, rates.cracks, stations, solves, error, control, zones)


def _shortest_step(rule: GrowthRule, stations: GrowthStations, solves: SolveHistory) -> float:
    """Shortest step of the fastest station, length."""
    if not len(stations):
        return 0.0
    fastest_place = stations.x[[int(np.argmax(_rate(rule, solves)))]]
    return _SHORTEST * float(cell_sizes(rule.problem.mesh, fastest_place)[0])


def correct(rule: GrowthRule, step: Step, rates: Rates, identities: Identities) -> Corrected:
    """Advance the fronts of the last step again, now by the rates at both ends of the step."""
    plan, (stations, solves) = plan_of(step), solves_of(step)
    error = StepError((), 0.0) if step.error is None else step.error
    solved_fronts = _solved_fronts(rule, rates, identities, plan.end)
    parts_here = [_part(solved_fronts, c) for c in range(len(rates.cracks))]
    first_rate = _rate(rule, solves)
    fastest_rate = float(first_rate.max(initial=0.0))
    rate, direction = _carried_back(rule, step, rates, solved_fronts)
    cycles, cycle_error = _cycles(rule, step, rates)
    share = plan.length / rate.max(initial=0.0) * rate if rate.max(initial=0.0) > 0 else None
    overloads = None
    if rule.retardation is not None and 0 < fastest_rate < np.inf:
        overloads = _overloads_between(rule, step, rates, parts_here)
        rate = rate_at_end(first_rate, overloads[0], plan.cycles)
        share = plan.length / fastest_rate * rate
        cycles = overloads[1]
        cycle_error = share_left(rule) * beyond_trapezoid(cycles, plan.cycles)
    cycles_across = cycles_of_passage(rule, step, rates)
    if cycles_across is not None:  # places stay where they are, a cell behind
        cycles, share = cycles_across, None
    if np.isinf(rates.rate).any() or fastest_rate == 0:
        share = None
    parts, zones = [], []
    cracks: list[Crack] = []
    gap, way = np.zeros(len(stations)), np.array(plan.arc)
    for c in range(len(rates.cracks)):
        rows = stations.crack == c
        corrected_crack = None
        if share is not None and rows.any():
            corrected_crack = _corrected_crack(rule, step, c, rates.cracks, share, direction)
        part = parts_here[c]
        if corrected_crack is None:
            crack = rates.cracks[c]
            growth = stations.growth(first_rate, plan.length)
            growth_owed = np.where(plan.moves[rows], 0.0, growth[rows])
            growth_nearby = _values_beside(
                stations.at(rows), growth_owed, part[0].x, rule.problem.mesh
            )
            part = (
                replace(
                    part[0], offset=np.nan_to_num(growth_nearby)[:, None] * part[1].direction[0]
                ),
                part[1],
            )
        else:
            crack, growth_owed, gap[rows], way[rows] = corrected_crack
            stations_before = stations.at(rows)
            network = [*cracks, crack, *rates.cracks[c + 1 :]]
            part = _corrected_part(rule, c, network, identities, part, stations_before, growth_owed)
        if overloads is not None:
            moved_x = (stations.x + plan.move)[rows]
            arc, zones_left = overloads[0][rows], overloads[2].at(rows)
            zones.append(zones_onto(zones_left, arc, way[rows], moved_x, part[0].x))
        cracks.append(crack)
        parts.append(part)
    new_stations, new_solves = _all_cracks(parts)
    if rule.retardation is not None:
        kinds = [
            _kinds_near(solved_part[0], _kinds(solved_part[1]), part[0].x)
            for solved_part, part in zip(parts_here, parts, strict=True)
        ]
        new_solves = replace(new_solves, kinds=_all_kinds(kinds))
    zones_of_all = _all_zones(zones) if zones else None
    if rule.retardation is not None and zones_of_all is None:
        zones_of_all = no_zones(len(new_stations))
    new_solves = _with_mean_rates(rule, new_stations, new_solves, zones_of_all)
    place_error = share_left(rule) * float(gap.max(initial=0.0))
    control = next_control(
        rule, step.control, plan.length, place_error, cycle_error, cycles, step.cycles,
        _shortest_step(rule, new_stations, new_solves), np.inf,
    )  # fmt: skip
    place = _errors_at(rule, step, rates, gap)
    return Corrected(
        step.cycles + cycles, tuple(cracks), new_stations, new_solves,
        StepError(place, error.cycles + cycle_error), control, zones_of_all,
    )  # fmt: skip


def _carried_back(
    rule: GrowthRule, step: Step, rates: Rates, solved_fronts: tuple[GrowthStations, SolveHistory]
) -> tuple[Floats, Floats]:
    """Rates (n,) and directions (n, 3) at the end of a step, at the stations of its beginning."""
    plan, (stations, solves) = plan_of(step), solves_of(step)
    solved_stations, at_end = solved_fronts
    columns = np.column_stack([at_end.rate[0], _rate(rule, at_end), at_end.direction[0]])
    target, mesh = stations.x + plan.move, rates.problem.mesh
    columns = _values_at(solved_stations, columns, stations.crack, target, mesh)
    is_lost = np.isnan(columns[:, 0])
    return (
        np.where(is_lost, _rate(rule, solves), np.nan_to_num(columns[:, 1])),
        np.where(is_lost[:, None], solves.direction[-1], columns[:, 2:]),
    )


def _corrected_crack(
    rule: GrowthRule,
    step: Step,
    c: int,
    cracks: Sequence[Crack],
    share: Floats,
    later_direction: Floats,
) -> tuple[Crack, Floats, Floats, Floats] | None:
    """The corrected crack; at the old places the growth that waits, their moves and their growth.

    None where the crack that was solved has other fronts: there is nothing to correct.
    """
    plan, (stations, solves) = plan_of(step), solves_of(step)
    mesh, rows = rule.problem.mesh, stations.crack == c
    rate = _rate(rule, solves)
    first = plan.length / rate.max() * rate
    way = 0.5 * (first + share)
    for is_of_front, front in _waves(stations, solves, first):
        way[is_of_front] = corrected_advance(
            front, stations.s[is_of_front], first[is_of_front], share[is_of_front]
        )
    target = stations.waiting_length + way
    is_growing = target >= WAITS_BELOW * plan.cell
    heading = first[:, None] * solves.direction[-1] + share[:, None] * later_direction
    growth_along = np.einsum("ij,ij->i", heading, stations.frame[:, 0])
    growth_across = np.einsum("ij,ij->i", heading, stations.frame[:, 1])
    first_angle = _angle(stations, solves)
    angle = np.where(
        np.hypot(growth_along, growth_across) == 0,
        first_angle,
        np.arctan2(growth_across, growth_along),
    )
    try:
        moved_length = np.where(is_growing, target, 0.0)
        crack = advanced_crack(step.corrected[c], stations, c, angle, moved_length, mesh)
        if crack.ends_on:
            network = [crack if k == c else old_crack for k, old_crack in enumerate(cracks)]
            placed_crack = place_arm(network, c, mesh)
        else:
            placed_crack = place_crack(crack, mesh)
    except GeometryError:
        return None
    if closed_fronts(placed_crack) != closed_fronts(cracks[c]):
        return None
    gap = np.linalg.norm(plan.move - _move(stations, angle, target), axis=1)
    growth_owed, gap = np.where(is_growing, 0.0, target), np.where(is_growing, gap, 0.0)
    return placed_crack, growth_owed[rows], gap[rows], way[rows]


def _errors_at(rule: GrowthRule, step: Step, rates: Rates, gap: Floats) -> tuple[Floats, ...]:
    """Errors of the places of the stations, with the part that this step adds."""
    stations, mesh = solves_of(step)[0], rates.problem.mesh
    result = []
    for c in range(len(rates.cracks)):
        rows = stations.crack == c
        x, largest_gap = rates.sif[0][c].x, float(gap[rows].max(initial=0.0))
        error_of_place = _values_beside(stations.at(rows), share_left(rule) * gap[rows], x, mesh)
        error_before = errors_before(step, c, x, mesh, largest_gap)
        result.append(np.nan_to_num(error_of_place) + error_before)
    return tuple(result)


def errors_before(step: Step, c: int, x: Floats, mesh: Mesh, gap: float = 0.0) -> Floats:
    """Errors of the places of a crack of a step at others close by, across a gap; 0 elsewhere."""
    sif = step.sif[0][c]
    if step.error is None or not len(sif.x):
        return np.zeros(len(x))
    reach = 2 * REACH * float(cell_sizes(mesh, sif.x).mean()) + gap
    is_closed = closed_fronts(step.cracks[c])
    error = interpolate_along_front(sif.x, sif.front, is_closed, step.error.place[c], x, reach)
    return np.nan_to_num(error)


def _cycles(rule: GrowthRule, step: Step, rates: Rates) -> tuple[float, float]:
    """Cycles of a step by the largest rates at both ends, and what they add to the error.

    The largest rate alone counts cycles: all places advance in proportion to it, so that its
    scatter along the front costs nothing. It is a power of the crack size, which grows linearly
    with the advance within the step.
    """
    plan, (stations, solves) = plan_of(step), solves_of(step)
    c = int(stations.crack[plan.tip])
    first_rate, later_rate = float(solves.rate[-1].max()), float(rates.law_rate.max(initial=0.0))
    by_first_rate = plan.length / first_rate
    if later_rate == 0:
        return 2 * by_first_rate, 0.0
    if np.isinf(later_rate):
        return 0.5 * by_first_rate, 0.0
    x = np.log(rates.problem.sizes[c] / float(solves.scale[plan.tip]))
    y = np.log(later_rate / first_rate)
    cycles = by_first_rate * float(exprel(x - y) / exprel(x))
    trapezoid = 0.5 * plan.length * (1 / first_rate + 1 / later_rate)
    return cycles, share_left(rule) * abs(cycles - trapezoid)


def cycles_of_passage(rule: GrowthRule, step: Step, rates: Rates) -> float | None:
    """Cycles of a step in which the fastest place has passed an interface; None elsewhere."""
    if not rule.has_interfaces:
        return None
    plan, (stations, solves) = plan_of(step), solves_of(step)
    interfaces, row = whole_front_ahead(rule, stations.x, plan.move), plan.tip
    if interfaces is None or not plan.arc[row] > interfaces.way[row]:
        return None
    way, length = float(interfaces.way[row]), float(plan.arc[row])
    begin, end = float(solves.rate[-1].max()), float(rates.law_rate.max(initial=0.0))
    if not 0 < end < np.inf:  # the run ends there
        cycles = np.array([way, length - way]) / begin
    elif interfaces.is_smooth[row]:
        rate_here, rate_there = (
            float(rates_in_set(rule, problem, response, int(k)).max())
            for problem, response, k in (
                (rates.problem, rates.response, interfaces.set_before[row]),
                (*scene_of(rule, step), interfaces.set_after[row]),
            )
        )
        size = float(solves.scale[row])
        size_after = rates.problem.sizes[int(stations.crack[row])]
        unit = (
            size_after - size
        ) / length  # of size, which the rates are powers of, over the advance
        parts = cycles_across(
            size, unit * way, unit * (length - way),
            unit * np.array([begin, rate_here]), unit * np.array([rate_there, end]),
        )  # fmt: skip
        cycles = np.asarray(parts)
    else:
        exponent, power = rates.exponent(rule.law), float(interfaces.power[row])
        cycles = np.array(cycles_of_jump(solves, exponent, end, row, way, length - way, power))
    at = np.full(len(interfaces.way), np.nan)
    at[row] = cycles[0]
    warn_of_passages(rule, step, interfaces, at)
    return float(cycles.sum())


def cycles_until(rule: GrowthRule, step: Step, part: float, end_rate: float | None) -> float:
    """Cycles of a part of the advance after a step, in proportion to it."""
    del rule
    return part * (plan_of(step).cycles if end_rate is None else end_rate)


# Overloads along fronts: rates as means over a step, and zones carried from front to front.


def _kinds(solves: SolveHistory) -> BlockCycles:
    assert solves.kinds is not None
    return solves.kinds


def _all_zones(parts: Sequence[OverloadZones]) -> OverloadZones:
    growth_since, size, K = (
        np.concatenate([getattr(z, name) for z in parts]) for name in ("since", "size", "K")
    )
    return OverloadZones(growth_since, size, K, parts[0].position, parts[0].part)


def _with_mean_rates(
    rule: GrowthRule, stations: GrowthStations, solves: SolveHistory, zones: OverloadZones | None
) -> SolveHistory:
    """Solves whose rates are means over the step ahead, by K at its begin and overloads.

    All are 0 where the growths of a step take more cycles than can be counted.
    """
    fastest_rate = float(_rate(rule, solves).max(initial=0.0))
    if rule.retardation is None or zones is None or not 0 < fastest_rate < np.inf:
        return solves
    length = np.inf if rule.da is None else rule.da
    blocks = np.inf if rule.cycles is None else rule.cycles
    length = min(length, blocks * fastest_rate)
    ratio = np.ones(len(stations))
    growth_ahead = _growth_ahead(rule, solves, [_kinds(solves)], zones, length, ratio, blocks)
    cycles = float(growth_ahead.cycles[-1])
    is_growing = cycles > 0 and (
        growth_ahead.grown_length >= length or cycles >= blocks * (1 - 1e-9)
    )
    rate = growth_ahead.arc[-1] / cycles if is_growing else 0.0 * growth_ahead.arc[-1]
    return replace(solves, rate=rate[None])


def _overloads_between(
    rule: GrowthRule,
    step: Step,
    rates: Rates,
    parts_here: Sequence[tuple[GrowthStations, SolveHistory]],
) -> tuple[Floats, float, OverloadZones]:
    """Growth under overloads in a step, with K interpolated between its begin and its end.

    Returns
    -------
    arc : (n,) array, length
    blocks : float
    zones : OverloadZones
        At the stations when they have grown by `arc`.
    """
    plan, (stations, solves) = plan_of(step), solves_of(step)
    first = _kinds(solves)
    later_kinds, ratio = [], np.ones(len(stations))
    for c, (part, values) in enumerate(parts_here):
        rows = np.nonzero(stations.crack == c)[0]
        moved_x = (stations.x + plan.move)[rows]
        later_kinds.append(_kinds_near(part, _kinds(values), moved_x, first.at(rows)))
        ratio[rows] = rates.problem.sizes[c] / solves.scale[rows]
    assert step.zones is not None
    integration = _growth_ahead(
        rule, solves, [first, _all_kinds(later_kinds)], step.zones, plan.length, ratio, np.inf
    )
    rest = (
        plan.length / integration.grown_length
        if 0 < integration.grown_length < plan.length
        else 1.0
    )
    return rest * integration.arc[-1], rest * float(integration.cycles[-1]), integration.zones


def _zones_after(rule: GrowthRule, step: Step, x: Floats) -> OverloadZones:
    """Overload zones at the new places of some of the stations of a step."""
    plan, (stations, solves) = plan_of(step), solves_of(step)
    assert step.zones is not None
    ones_of_stations, length = np.ones(len(stations)), plan.part * plan.length
    integration = _growth_ahead(
        rule, solves, [_kinds(solves)], step.zones, length, ones_of_stations, np.inf
    )
    arc, moved_x = integration.arc[-1], stations.x + plan.part * plan.move
    return zones_onto(integration.zones, arc, arc, moved_x, x)


def rate_at_end(rate: Floats, arc: Floats, blocks: float) -> Floats:
    """Rates at the end of a step whose mean with those of the begin is arc over blocks."""
    return np.maximum(2 * arc / blocks - rate, 0.0)


def beyond_trapezoid(blocks: float, expected_blocks: float) -> float:
    """Blocks by a power law between both rates, less those by the mean of their inverses."""
    return abs(0.5 * (expected_blocks + blocks**2 / expected_blocks) - blocks)


def zones_onto(
    zones: OverloadZones, arc: Floats, way: Floats, moved_x: Floats, x: Floats
) -> OverloadZones:
    """Overload zones at the places of the next front.

    Parameters
    ----------
    zones : OverloadZones
        At the places of the last front, after growth by `arc`.
    arc, way : (f,) arrays, length
        Growth that was marched, and the advance that the whole front made of it.
    moved_x : (f, 3) array, length
        Where these places have come to.
    x : (g, 3) array, length
        Places of the next front: each takes over from the nearest.
    """
    if not len(moved_x):
        return replace(no_zones(len(x)), position=zones.position, part=zones.part)
    arc_within_zone = np.minimum(zones.since, arc)
    share = np.divide(arc_within_zone, arc, out=np.zeros_like(arc), where=arc > 0)
    growth_since = np.maximum(zones.since + share * (way - arc), 0.0)
    nearest_rows = np.linalg.norm(x[:, None] - moved_x, axis=2).argmin(axis=1)
    return replace(zones.at(nearest_rows), since=growth_since[nearest_rows])


def _growth_ahead(
    rule: GrowthRule,
    solves: SolveHistory,
    kinds: Sequence[BlockCycles],
    zones: OverloadZones,
    length: float,
    ratio: Floats,
    blocks: float,
) -> CycleIntegration:
    """All stations of all fronts; rates are powers of the sizes of the cracks."""
    arrays = zip(*(kind.arrays for kind in kinds), strict=True)
    dK, R, a = (np.concatenate(part) for part in arrays)
    cycles = BlockCycles(dK, R, a, kinds[0].sets)
    t = np.linspace(0.0, 1.0, POINTS)[:, None]
    is_even = np.abs(ratio - 1) < 1e-6
    safe_ratio = np.where(is_even, 2.0, ratio)
    x = np.where(is_even, t, np.log1p(t * (safe_ratio - 1)) / np.log(safe_ratio))
    nodes = np.repeat(np.arange(float(len(kinds)))[:, None], len(ratio), axis=1)
    return cycle_by_cycle(rule, cycles, nodes, x, zones, length, solves.exponent, blocks)


__all__ = [
    "advance_of",
    "advanced_cracks",
    "begin",
    "begin_at",
    "beyond_trapezoid",
    "correct",
    "cycles_of_passage",
    "cycles_until",
    "ends_of",
    "errors_before",
    "interpolate_along_front",
    "partly_advanced",
    "predict",
    "rate_at_end",
    "solved_ends",
    "zones_onto",
]
