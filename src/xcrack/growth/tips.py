"""Growth of second order at one solve a step: predict, evaluate, correct; tips of 2D cracks.

From the corrected tips of a step the last two solves predict the next tips; there all states are
solved; the parabola through the last three solves then moves the tips once more, without a solve.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import GeometryError, XcrackError, collected_warnings
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.measures import exit_ahead
from xcrack.crack.meetings import (
    AHEAD,
    LEAST,
    Meeting,
    joined_cracks,
    last_faces,
    meetings,
    moved_on,
    with_tips_at,
)
from xcrack.crack.placing_2d import MOUTH
from xcrack.fatigue.criteria import START, clipped_K, kinked_K, limit_angles
from xcrack.fatigue.retardation import BlockCycles, no_zones
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.gaps import UNKNOWN_OF_TIPS, part_of_time
from xcrack.growth.interfaces import (
    InterfacesAhead,
    cycles_of_jump,
    interfaces_ahead,
    mixed_solves,
    passage,
    rates_behind,
    warn_of_passages,
)
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import (
    CriterionInput,
    Rates,
    criterion_inputs,
    kinds_of,
    rates_by_law_of,
)
from xcrack.growth.solves import (
    Growth,
    SolveHistory,
    Stretch,
    bisected_length,
    rates_at,
    stretch_of,
)
from xcrack.growth.stations import GrowthStations, Identities
from xcrack.growth.step import (
    Corrected,
    Plan,
    Step,
    StepControl,
    StepError,
    plan_of,
    solves_of,
)
from xcrack.growth.step_length import (
    PAST,
    first_control,
    leaves,
    longest_advance,
    next_control,
    share_left,
    shortest_length,
)
from xcrack.mesh.locate import cell_sizes, contains, nearest_boundary
from xcrack.mesh.mesh import Mesh

_LONGER = np.array(
    [1.5, 12.0, 96.0]
)  # times a step: until ends behind interfaces are where they were
_FASTER = 2.0  # times the last rate: what a step of prescribed cycles may reckon with

# The next step of 2D cracks as the last two solves see it, up to where tips meet other cracks.


def predict(rule: GrowthRule, step: Step) -> Plan:
    """The next step, by the rates of the last two solves or of the only one."""
    stations, solves = solves_of(step)
    cell = cell_sizes(rule.problem.mesh, stations.x)
    rate = np.concatenate([np.zeros(0), *step.rate])
    if not (rate > 0).any() or np.isinf(rate).any():
        return Plan.at_rest(step, cell)
    stretch, stops = _piece_ahead(rule, step)
    growth = _growth(stations, stretch)
    has_interfaces = rule.has_interfaces
    interfaces = interfaces_ahead(rule, stations.x, growth.move) if has_interfaces else None
    if interfaces is not None and (growth.arc > interfaces.stop).any():
        stretch, growth = _up_to_interfaces(rule, step, interfaces, stretch, growth)
    else:
        stretch, growth = _up_to_boundary(rule, step, stretch, growth)
    row = int(np.argmax(growth.arc))
    plan = Plan(
        sigma=solves.start,
        length=stretch.length,
        cycles=growth.cycles,
        arc=growth.arc,
        move=growth.move,
        moves=np.zeros(len(stations), dtype=bool),
        cell=cell,
        tip=row,
        largest=stretch.length,
        cracks=step.corrected,
    )
    if stops and growth.arc[row] < LEAST * cell[row]:
        return replace(plan, limit="arrest")
    if plan.largest < LEAST * cell[row]:
        return replace(plan, limit="short")
    try:
        cracks_after, moves = with_tips_at(
            step.corrected, stations.x + growth.move, stations.fresh, cell
        )
        plan = replace(plan, cracks=tuple(cracks_after), moves=moves)
        # Where plastic zones end the run, they do so before the tips meet.
        meetings_ahead = meetings(cracks_after, rule.problem.mesh) if rule.link_up is None else []
        return (
            _step_to_meeting(rule, step, plan, stretch, meetings_ahead) if meetings_ahead else plan
        )
    except GeometryError as error:
        return replace(plan, limit="geometry", refusal=str(error))


def _piece_ahead(rule: GrowthRule, step: Step) -> tuple[Stretch, bool]:
    """The next step of σ without regard to boundaries, and whether all tips stop growing in it."""
    solves = solves_of(step)[1]
    last_solves = solves.last_solves(2)
    length = longest_advance(rule, step.control)
    if rule.cycles is not None:
        fastest_rate = float(solves.rate[-1].max(initial=0.0))
        factor = 1.0 if solves.n_solves == 1 else _FASTER
        length = min(length, rule.cycles * fastest_rate * factor)
    blocks = np.inf if rule.cycles is None else rule.cycles
    stretch = stretch_of(rule, last_solves, solves.start, length, step.zones, blocks)
    if stretch.integration is not None:
        length_reached = min(length, stretch.integration.grown_length)
        is_over_cycles = rule.cycles is not None and stretch.arcs(length_reached)[
            1
        ] >= rule.cycles * (1 - 1e-9)
        return replace(
            stretch, length=length_reached
        ), length_reached < length and not is_over_cycles
    if rule.cycles is not None:
        stretch = replace(stretch, length=stretch.length_of_cycles(rule.cycles))
    growing_length = stretch.growing_length()
    return replace(stretch, length=growing_length), growing_length < stretch.length


def _up_to_interfaces(
    rule: GrowthRule, step: Step, interfaces: InterfacesAhead, stretch: Stretch, growth: Growth
) -> tuple[Stretch, Growth]:
    """A step that ends before an interface, or behind it with the law there at the last known K."""
    stations, solves = solves_of(step)
    history = solves.last_solves(2)
    goal = np.where(growth.arc > interfaces.stop, interfaces.goal, np.inf)
    largest_length, row = stretch.length, int(np.argmax(growth.arc))
    is_crossing = np.isfinite(goal) & (goal > interfaces.way)
    solves_after = history
    if is_crossing.any():
        rate = rates_behind(rule, step, interfaces)
        rate = np.where(is_crossing & (rate > 0), rate, history.rate[-1])
        solves_after = replace(history, rate=np.broadcast_to(rate, history.rate.shape))
        if is_crossing[row]:  # da and cycles are shorter than the cells there
            largest_length = max(largest_length, min(float(goal[row]), step.control.length))
    passage_done = passage(
        rule,
        stations.frame,
        lambda is_passed: mixed_solves(history, solves_after, interfaces.set_after, is_passed),
        interfaces,
        goal,
        solves.start,
        largest_length,
        step.zones,
    )
    return replace(stretch, length=passage_done.length), passage_done.growth


def _up_to_boundary(
    rule: GrowthRule, step: Step, stretch: Stretch, growth: Growth
) -> tuple[Stretch, Growth]:
    """A step that ends as the first tip reaches the boundary: K of the others jumps there.

    A tip so close to the boundary that the mesh takes it for a mouth has reached it.
    """
    stations, mesh = solves_of(step)[0], rule.problem.mesh
    if len(stations) < 2:
        return stretch, growth
    place, leaves = stations.x + growth.move, np.zeros(len(stations), dtype=bool)
    for row, is_inside in enumerate(contains(mesh, place).tolist()):
        gap, size = nearest_boundary(mesh, place[row])
        leaves[row] = growth.arc[row] > 0 and not (is_inside and gap > MOUTH * size)
    if not leaves.any() or leaves.all():
        return stretch, growth
    longer_length = stretch.length + float(cell_sizes(mesh, stations.x).max())
    if stretch.integration is not None and longer_length > stretch.integration.sigma[-1]:
        zones = step.zones
        longest_stretch = stretch_of(rule, stretch.solves, stretch.start, longer_length, zones)
        stretch = replace(longest_stretch, length=stretch.length)

    def is_in_body(length: float) -> bool:
        return _is_inside(mesh, (stations.x + _growth(stations, stretch, length).move)[leaves])

    if is_in_body(longer_length):  # it runs along a side
        return stretch, growth
    length = bisected_length(is_in_body, longer_length)[1]
    return replace(stretch, length=length), _growth(stations, stretch, length)


def _growth(stations: GrowthStations, stretch: Stretch, length: float | None = None) -> Growth:
    frame = stations.frame
    return stretch.growth(frame, stretch.solves.angles(frame), length)


def _step_to_meeting(
    rule: GrowthRule, step: Step, plan: Plan, stretch: Stretch, meetings_ahead: list[Meeting]
) -> Plan:
    """A step that ends as the first tip meets another crack, with the cracks joined there."""
    stations = solves_of(step)[0]
    faces = last_faces(plan.cracks)
    directions = np.stack([np.cos(faces.direction), np.sin(faces.direction)], axis=1)

    def distance_left(meeting: Meeting, length: float) -> float:
        place = stations.x + _growth(stations, stretch, length).move
        to = meeting.x if meeting.facing_tip < 0 else place[meeting.facing_tip]
        return float((to - place[meeting.tip]) @ directions[meeting.tip])

    largest_length = plan.length + max(AHEAD * meeting.size for meeting in meetings_ahead)
    if stretch.integration is not None and largest_length > stretch.integration.sigma[-1]:
        zones, solves = step.zones, stretch.solves
        stretch = stretch_of(rule, solves, plan.sigma, largest_length, zones)
    arrival = [
        _arrival(partial(distance_left, meeting), largest_length) for meeting in meetings_ahead
    ]
    first = min(arrival)
    if first == np.inf and not any(meeting.is_soon for meeting in meetings_ahead):
        return plan
    length = plan.length if first == np.inf else first
    growth = _growth(stations, stretch, length)
    place = stations.x + growth.move
    cracks_apart, moves = with_tips_at(step.corrected, place, stations.fresh, plan.cell)
    tips_arrived = {
        meeting.tip
        for meeting, arrival_length in zip(meetings_ahead, arrival)
        if arrival_length <= length
    }
    meetings_now = [
        meeting
        for meeting in meetings(cracks_apart, rule.problem.mesh, 2 * AHEAD)
        if meeting.is_soon or meeting.tip in tips_arrived
    ]
    if not meetings_now:
        return plan
    growth, cycle_error = _as_gap_closes(step, growth, meetings_now)
    place = stations.x + growth.move
    cracks_apart, moves = with_tips_at(step.corrected, place, stations.fresh, plan.cell)
    cracks_joined = joined_cracks(cracks_apart, moves.tolist(), meetings_now)
    return replace(
        plan,
        length=length,
        cycles=growth.cycles,
        arc=growth.arc,
        move=growth.move,
        moves=moves,
        cracks=tuple(cracks_joined),
        apart=tuple(cracks_apart),
        error=cycle_error,
    )


def _as_gap_closes(step: Step, growth: Growth, meetings_now: list[Meeting]) -> tuple[Growth, float]:
    """Growth until two facing tips have met, and the uncertainty of its cycles.

    K rises faster in a closing gap than polynomials through earlier solves: the cycles are those
    of two equal cracks that face each other, and the other tips grow for as long.
    """
    facing_pairs = [meeting for meeting in meetings_now if meeting.facing_tip >= 0]
    if not facing_pairs or step.zones is not None:
        return growth, 0.0
    stations, solves = solves_of(step)
    rate, m, radius = solves.rate[-1], solves.exponent, _radii(step)
    best_estimate = growth.cycles, 0.0
    for meeting in facing_pairs:
        i, k = meeting.tip, meeting.facing_tip
        gap, speed = float(np.linalg.norm(stations.x[k] - stations.x[i])), float(rate[i] + rate[k])
        if speed <= 0:
            continue
        cycles_at_first_rate = gap / speed
        cycles = cycles_at_first_rate * part_of_time(2 * gap / float(radius[i] + radius[k]), m, 2)
        if cycles < best_estimate[0]:
            best_estimate = cycles, UNKNOWN_OF_TIPS * (cycles_at_first_rate - cycles)
    cycles, cycle_error = best_estimate
    share = cycles / growth.cycles if growth.cycles > 0 else 1.0
    is_meeting = np.isin(
        np.arange(len(rate)),
        [row for meeting in facing_pairs for row in (meeting.tip, meeting.facing_tip)],
    )
    part = np.where(is_meeting, 1.0, share)
    return Growth(part[:, None] * growth.move, part * growth.arc, cycles), cycle_error


def _radii(step: Step) -> Floats:
    """Half the length of each tip's crack, or its whole length where it has one tip `(n,)`."""
    half = [size / max(crack.n_tips, 1) for size, crack in zip(step.sizes, step.cracks)]
    return np.repeat(half, [crack.n_tips for crack in step.cracks])


def _arrival(gap_left: Callable[[float], float], largest_length: float) -> float:
    """Step of σ after which a distance left is 0; inf where a step is too short for that."""
    if gap_left(largest_length) > 0:
        return np.inf
    return bisected_length(lambda length: gap_left(length) > 0, largest_length)[1]


def ends_of(step: Step, plan: Plan) -> Floats:
    """Where the ends of the cracks at the stations come to `(n, 2)`, to the last bit."""
    stations = solves_of(step)[0]
    tip = last_faces(step.corrected).tip
    return np.where(plan.moves[:, None], stations.x + plan.move, tip)


def advance_of(step: Step, plan: Plan, rates: Rates) -> Floats:
    """Advance to the next step at the stations that were solved `(n,)`, length."""
    del rates
    stations = solves_of(step)[0]
    way = np.linalg.norm(stations.x + plan.move - last_faces(step.corrected).tip, axis=1)
    return np.where(plan.moves, way, 0.0)


# Directions and rates of tips in 2D: at the beginning, behind a kink, and as a face turns.

_COTTERELL_RICE = 4 * np.sqrt(2 / np.pi)
_GEOMETRY = 0.65  # times the face's share of the crack: read off four scenes
_GAMMA = (-2.5, 0.5)


def first_solves(rule: GrowthRule, rates: Rates) -> SolveHistory:
    """What growth begins with, or begins anew with after K has jumped.

    Notes
    -----
    Where a criterion turns a crack by more than three degrees, the kinked crack begins in the
    direction in which the criterion, asked again at the kink, turns no further (`limit_angles`),
    with the rate of the kinked crack. From there its direction changes by
    4 √(2/π) T/K_I* sin θ cos θ √s over the length s (the shear that T adds on the kink, Cotterell
    and Rice 1980); with a tolerance K_I too, by 2 √(2/π) T/K_I* sin² θ √s (the tension on it).
    """
    angle, rate, dK_eq = np.array(rates.angle), np.array(rates.law_rate), np.array(rates.dK_eq)
    bend, rate_bend = np.zeros(len(rate)), np.zeros(len(rate))
    # Of a law with nominal R the rates of a kinked crack are not known, nor a block's direction.
    is_nominal = getattr(rule.law, "ratio", None) == "nominal"
    is_known = not (is_nominal and isinstance(rule.cycle, Spectrum))
    turns = (np.abs(angle) > START) & (rate > 0)
    if is_known and turns.any():
        inputs = criterion_inputs(rule, rates.problem, rates.response)
        for c, inputs_of_crack in enumerate(inputs):
            rows = np.nonzero(rates.stations.crack == c)[0]
            if not turns[rows].any():
                continue
            first_angle, ratio, is_kinked = _kink(inputs_of_crack, turns[rows], rates, rows)
            rate_behind, dK = rate[rows], dK_eq[rows]
            if not is_nominal:
                with collected_warnings([]):  # they are of cracks that nobody has
                    answer = inputs_of_crack.rates_of_K(
                        clipped_K(kinked_K(clipped_K(inputs_of_crack.K), first_angle))
                    )
                rate_behind, dK = answer.rate, answer.dK_eq
            kinks = is_kinked & (rate_behind > 0) & np.isfinite(rate_behind)
            angle[rows] = np.where(kinks, first_angle, angle[rows])
            rate[rows] = np.where(kinks, rate_behind, rate[rows])
            dK_eq[rows] = np.where(kinks, dK, dK_eq[rows])
            shear = ratio * np.sin(first_angle) * np.cos(first_angle)
            bend[rows] = np.where(kinks, _COTTERELL_RICE * shear, 0.0)
            opening = ratio * np.sin(first_angle) ** 2
            rate_bend[rows] = np.where(kinks, 0.5 * _COTTERELL_RICE * opening, 0.0)
    slowness = np.sqrt(rate / rate.max()) if np.isfinite(rate).all() and rate.any() else 0.0
    bend, rate_bend = slowness * bend, slowness * rates.exponent(rule.law) * rate_bend
    direction = replace(rates, angle=angle).direction
    kinds = kinds_of(rule, rates)
    if kinds is not None:  # behind a kink scaled as the range
        growth_of_dK = np.divide(dK_eq, rates.dK_eq, out=np.ones_like(dK_eq), where=rates.dK_eq > 0)
        kinds = replace(kinds, dK=kinds.dK * growth_of_dK[None, :, None])
    return SolveHistory(
        sigma=np.zeros(1),
        rate=rate[None],
        dK_eq=dK_eq[None],
        direction=direction[None],
        scale=rates.size_of_law,
        bend=bend,
        exponent=rates.exponent(rule.law),
        kinds=kinds,
        rate_bend=rate_bend if rule.tolerance is not None and rate_bend.any() else None,
    )


def _kink(
    inputs: CriterionInput, turns: Bools, rates: Rates, rows: Ints
) -> tuple[Floats, Floats, Bools]:
    """Limit angles of kinks at the tips of a crack, T/K_I behind them, and where both are known."""

    def without_warning(K: Floats) -> Floats:
        with collected_warnings([]):
            return inputs.angle_of_K(clipped_K(K))

    theta, is_converged = limit_angles(without_warning, clipped_K(inputs.K))
    is_kinked = turns & is_converged
    theta = np.where(is_kinked, theta, 0.0)
    opening = clipped_K(kinked_K(clipped_K(rates.K[:, rows]), theta))[..., 0]
    return theta, _T_over_K(opening, rates.T[:, rows]), is_kinked


def turn_of_faces(rates: Rates, length: Floats) -> Floats:
    """How much the direction of growth at a tip turns as its last face is turned `(n,)`.

    Notes
    -----
    γ = 4 √(2/π) T √ℓ / K_I + 0.65 ℓ/a, ℓ the last face and a the crack, after Cotterell and Rice
    (1980) for a short kink; of the state with the largest K_I.
    """
    K_I = rates.K[..., 0]
    gamma = _COTTERELL_RICE * _T_over_K(K_I, rates.T) * np.sqrt(length)
    gamma += _GEOMETRY * length / rates.size_of_law
    return np.where(K_I.max(axis=0) > 0, np.clip(gamma, *_GAMMA), 0.0)


def _T_over_K(K_I: Floats, T: Floats) -> Floats:
    """T over K_I of the state with the largest K_I of each tip `(f,)`; 0 where none opens it."""
    tip = np.arange(K_I.shape[1])
    state = np.argmax(K_I, axis=0)
    opening, T_of_tip = K_I[state, tip], T[state, tip]
    is_opening = (opening > 0) & np.isfinite(T_of_tip)
    return np.asarray(np.where(is_opening, T_of_tip, 0.0) / np.where(is_opening, opening, 1.0))


# A solve: correct the step that led there.

_PASSES = 6  # of the correction, which turns the last face, which turns the direction
_OF_LENGTH = 0.5  # relative change of K with that of the length of a crack, also of another one
# Of the first step, until a second one tells better: of its cycles, and of places with retardation.
_FIRST, _FIRST_OF_PLACE = 0.2, 0.5
_MENDED = 0.04  # of its correction squared and relative: what is left once the second has mended it
LONGER_FIRST = 1.5  # times a first step of which no later one mends the cycles
# What two polynomials say of the step before to what its own said beside a line.
_RATIOS, _RATIOS_OF_PLACE = (0.1, 1.0), (0.5, 3.0)
_RATIO_OF_FIRST, _OF_SECOND = 0.9, 0.5  # of cycles of the first two steps, of the second alone
_RATIO_OF_PROLONGED = 0.25  # a parabola behind the first step errs more in it than its own
# Of what the parabola says beside the line, in the steps of a tolerance, which are few and long:
# what the cycles of the first one are mended by, and what is not known. All of it is too much
# behind kinks and where cracks pull at each other, though right for single ones that grow straight.
_MENDS_OF_FEW, _LEAST_OF_FIRST = 0.5, 0.3
_ASTRAY = 1.0  # of what a face turns by, as the one before it was turned: growth of errors of paths
_OF_GAP = 0.08  # of a correction: as K was solved where the tip is not


def begin(rule: GrowthRule, rates: Rates, identities: Identities) -> Corrected:
    """The first step of a run."""
    n = len(rates.stations)
    stations = _stations(rates.cracks, identities, rates.stations.x, np.zeros(n, dtype=bool))
    solves = first_solves(rule, rates)
    zones = None if rule.retardation is None else no_zones(n)
    control = _first_length(rule, stations, solves, rates)
    error = StepError(rates.split(np.zeros(n)), 0.0)
    return Corrected(0.0, rates.cracks, stations, solves, error, control, zones)


def _stations(
    cracks: Sequence[Crack], identities: Identities, x: Floats, is_fresh: Bools
) -> GrowthStations:
    """Tips of cracks whose growth has come to some places."""
    count = [crack.n_tips for crack in cracks]
    frame = [tip_frames(crack)[1] for crack in cracks]
    n = len(x)
    ends = [end for ends_of_crack in identities.ends for end in ends_of_crack]
    return GrowthStations(
        crack=np.repeat(np.arange(len(cracks)), count),
        front=np.concatenate([np.zeros(0, dtype=np.int64), *map(np.arange, count)]),
        s=np.zeros(n),
        x=x,
        frame=np.concatenate([np.zeros((0, 2, 2)), *frame]),
        end=np.array(ends, dtype=np.int64),
        closed=np.zeros(n, dtype=bool),
        length=np.zeros(n),
        offset=x - last_faces(cracks).tip,
        fresh=is_fresh,
    )


def correct(rule: GrowthRule, step: Step, rates: Rates, identities: Identities) -> Corrected:
    """Correct a predicted step by what was solved there."""
    plan = plan_of(step)
    rows = _rows_that_stay(ends_of(step, plan), rates.cracks)
    if len(rows) < len(plan.arc):
        return _without_lost_tips(rule, step, rates, identities, rows)
    if np.isinf(rates.rate).any():
        return _last_step_of_run(step, rates, identities)
    if rule.has_interfaces:
        interfaces = interfaces_ahead(rule, solves_of(step)[0].x, plan.move)
        if interfaces is not None and (plan.arc > interfaces.way).any():
            return _step_through_interface(rule, step, rates, identities, interfaces)
    return _corrected_points(rule, step, rates, identities)


def _step_through_interface(
    rule: GrowthRule, step: Step, rates: Rates, identities: Identities, interfaces: InterfacesAhead
) -> Corrected:
    """A step in which tips have passed an interface: each part counts by the law of its material.

    Where only the laws differ, K is a power of the length between both solves. Where the stiffness
    differs, K is extrapolated up to the interface, and behind it is that at the end of the step.
    """
    plan, error = plan_of(step), _error(step)
    stations, old_solves = solves_of(step)
    is_crossing = plan.arc > interfaces.way
    kinds = kinds_of(rule, rates)
    begin = old_solves.last_solves(1)
    solves_now = begin.with_solve(
        plan.end, rates.law_rate, rates.dK_eq, rates.direction, rates.exponent(rule.law), kinds
    )
    jumps = is_crossing & ~interfaces.is_smooth
    rate_here = np.where(
        jumps, rates_at(old_solves.last_solves(2), np.array([plan.end]))[0], rates.law_rate
    )
    rate_there = np.where(jumps, rates.law_rate, begin.rate[0])
    is_smooth = is_crossing & interfaces.is_smooth
    if is_smooth.any():
        sets = np.where(is_smooth, interfaces.set_before, interfaces.set_after)
        rate_before = rates_by_law_of(rule, rates.problem, rates.response, sets)
        rate_here = np.where(is_smooth, rate_before, rate_here)
        rate_there = np.where(is_smooth, rates_behind(rule, step, interfaces), rate_there)
    history = old_solves.with_solve(
        plan.end, rate_here, rates.dK_eq, rates.direction, rates.exponent(rule.law), kinds
    )
    solves_after = replace(solves_now, rate=np.stack([rate_there, rates.law_rate]))
    if jumps.any():
        history = replace(history, dK_eq=np.where(jumps, begin.dK_eq[0], history.dK_eq))
        solves_after = replace(solves_after, dK_eq=np.where(jumps, rates.dK_eq, solves_after.dK_eq))
        history, solves_after = (
            _with_jumps(history, jumps, -2),
            _with_jumps(solves_after, jumps, -1),
        )
    if history.kinds is not None and begin.kinds is not None:
        history = replace(history, kinds=replace(history.kinds, sets=begin.kinds.sets))
    is_standing = is_crossing & ~(rates.rate > 0)  # nothing grows behind: the run ends there
    solves_after = replace(
        solves_after, rate=np.where(is_standing, history.rate[-2:], solves_after.rate)
    )
    goal = np.where(is_crossing, plan.arc, np.inf)

    def solves_in(is_passed: Bools) -> SolveHistory:
        return (
            mixed_solves(history.last_solves(2), solves_after, interfaces.set_after, is_passed)
            if is_passed.any()
            else history
        )

    for largest_length in _LONGER * plan.length:
        passage_done = passage(
            rule,
            rates.stations.frame,
            solves_in,
            interfaces,
            goal,
            plan.sigma,
            largest_length,
            step.zones,
        )
        if (passage_done.growth.arc >= goal * (1 - 1e-9)).any():
            break
    cycles, cycles_at = passage_done.growth.cycles, np.array(passage_done.cycles_at)
    row = int(np.argmax(np.where(jumps, plan.arc, -1.0)))
    if jumps[row] and step.zones is None and rates.rate[row] > 0:
        way_behind = float(plan.arc[row] - interfaces.way[row])
        cycles_before, cycles_behind = cycles_of_jump(
            old_solves, history.exponent, float(rates.law_rate[row]), row,
            float(interfaces.way[row]), way_behind,
            float(interfaces.power[row]),
        )  # fmt: skip
        cycles, cycles_at[row] = cycles_before + cycles_behind, cycles_before
    warn_of_passages(rule, step, interfaces, cycles_at)
    after_it = _stations(
        rates.cracks, identities, stations.x + plan.move, stations.fresh | plan.moves
    )
    goes_on = not jumps.any() and plan.sigma > 0 and bool((is_crossing | (rates.rate == 0)).all())
    solves = replace(solves_after, kinds=solves_now.kinds) if goes_on else first_solves(rule, rates)
    own_error = share_left(rule) * abs(cycles - plan.cycles) + plan.error
    own_error += solves.exponent * error.behind * cycles
    return Corrected(
        step.cycles + cycles,
        rates.cracks,
        after_it,
        solves,
        StepError(error.place, error.cycles + own_error, behind=error.behind),
        step.control if goes_on else _first_length(rule, after_it, solves, rates),
        passage_done.zones,
    )


def _with_jumps(solves: SolveHistory, jumps: Bools, k: int) -> SolveHistory:
    """Solves whose cycles of a block, at some tips, are those of one of the solves."""
    kinds = solves.kinds
    if kinds is None:
        return solves
    dK, R, a = (
        np.where(jumps.reshape(1, -1, *[1] * (part.ndim - 2)), part[[k]], part)
        for part in kinds.arrays
    )
    return replace(solves, kinds=BlockCycles(dK, R, a, kinds.sets))


def _corrected_points(
    rule: GrowthRule, step: Step, rates: Rates, identities: Identities
) -> Corrected:
    """Correct the last points by the parabola through the last three solves."""
    plan, error = plan_of(step), _error(step)
    stations, old_solves = solves_of(step)
    faces = last_faces(rates.cracks)
    solves = old_solves.with_solve(
        plan.end, rates.law_rate, rates.dK_eq, rates.direction, rates.exponent(rule.law),
        kinds_of(rule, rates),
    )  # fmt: skip
    stretch = stretch_of(rule, solves, plan.sigma, plan.length, step.zones)
    frame = rates.stations.frame
    angle = solves.angles(frame)
    solved_angle = np.array(angle[-1])
    gamma = np.where(plan.moves, turn_of_faces(rates, faces.length), 0.0)
    old_faces = last_faces(step.corrected)
    is_replaced = moved_on(old_faces, stations.fresh, plan.cell)
    begin_of_face = np.where(is_replaced[:, None], old_faces.anchor, old_faces.tip)
    growth = Growth(plan.move, plan.arc, plan.cycles)
    for _ in range(_PASSES):
        growth = stretch.growth(frame, angle)
        face = stations.x + growth.move - begin_of_face
        components = np.einsum("nij,nj->in", frame, face)
        angle[-1] = solved_angle + gamma * np.arctan2(components[1], components[0])
    solves = solves.with_direction(replace(rates, angle=angle[-1]).direction)
    x = stations.x + growth.move
    try:
        cracks, moves = with_tips_at(step.corrected, x, stations.fresh, plan.cell)
    except GeometryError:  # which the predicted cracks are free of
        x, cracks, moves = stations.x + plan.move, list(rates.cracks), plan.moves
    gap = x - (stations.x + plan.move)
    spans = _spans(rule, step, stretch)
    by_places = _places(rule, step, solves, spans, frame, gap)
    known_error, newest_error = by_places.known_error, by_places.newest_error
    cycles, of_life = _cycles(rule, step, spans, growth)
    lag = _OF_LENGTH * by_places.errors_ahead / solves.scale
    lag_behind = error.behind + float(lag[0].max(initial=0.0))
    # What an end lags behind by after this step counts in all cycles that follow.
    whole_cycles = max(growth.cycles, PAST * step.cycles)
    cycle_error_alone = (
        of_life.own_error + solves.exponent * float(lag.sum(axis=0).max(initial=0.0)) * whole_cycles
    )
    cycle_error = of_life.known_error + of_life.newest_error - error.newest_cycles
    cycle_error += solves.exponent * lag_behind * growth.cycles
    stations_after = _stations(cracks, identities, x, stations.fresh | moves)
    # A tip that is astray turns its next face by a share of that: where T > 0 it goes farther so.
    drift = 1 + _ASTRAY * np.maximum(gamma, 0.0)
    place_error = drift * by_places.own_error
    control = next_control(
        rule, step.control, plan.length, float(place_error.max(initial=0.0)), cycle_error_alone,
        growth.cycles,
        step.cycles, *_room(rule, stations_after, solves, rates, step.cycles + cycles), plan.sigma,
    )  # fmt: skip
    error_before = np.concatenate([np.zeros(0), *error.place])
    if error.newest_place:
        error_before -= np.concatenate(error.newest_place)
    place = drift * error_before + known_error + newest_error
    fastest_row = int(np.argmax(plan.arc))
    return Corrected(
        step.cycles + cycles,
        tuple(cracks),
        stations_after,
        solves,
        StepError(
            rates.split(place),
            error.cycles + cycle_error,
            K_place=float(drift[fastest_row]) * error.K_place,
            behind=lag_behind,
            newest_place=rates.split(newest_error),
            newest_cycles=of_life.newest_error,
        ),
        control,
        stretch.zones,
        step.zones,
    )


def _error(step: Step) -> StepError:
    if step.error is None:
        raise XcrackError(f"step {step.index} was not made by integrator='pec'.")
    return step.error


def _first_length(
    rule: GrowthRule, stations: GrowthStations, solves: SolveHistory, rates: Rates
) -> StepControl:
    """Length of the first step."""
    size = float(solves.scale.min(initial=np.inf))
    return first_control(rule, LONGER_FIRST * size, *_room(rule, stations, solves, rates))


def _room(
    rule: GrowthRule,
    stations: GrowthStations,
    solves: SolveHistory,
    rates: Rates,
    cycles: float = 0.0,
) -> tuple[float, float]:
    """Shortest step of the fastest tip, and its distance to the boundary ahead, length.

    The distance is inf where the tip would cross it in next to none of the cycles so far.
    """
    if not len(stations):
        return 0.0, np.inf
    tip = int(np.argmax(solves.rate[-1]))
    x, mesh = stations.x[tip], rule.problem.mesh
    hit = exit_ahead(x, solves.direction[-1, tip], mesh)
    room = np.inf if hit is None else float(np.linalg.norm(hit[0] - x))
    if len(stations) == 1 and leaves(rule, room, float(solves.rate[-1, tip]), cycles):
        room = np.inf
    return shortest_length(float(cell_sizes(mesh, x[None])[0]), float(rates.angle[tip])), room


@dataclass(frozen=True, eq=False)
class _Spans:
    """Growth in a corrected step and in the one before, by polynomials through different solves.

    Attributes
    ----------
    curve, line : Stretch
        The step by all solves that are known, and by the last two.
    of_step_before : tuple of Stretch
        The step before: by the last two solves of then, by all solves of then, and by those of
        now. Empty after the first step and where overloads make its error unknown.
    """

    curve: Stretch
    line: Stretch
    of_step_before: tuple[Stretch, ...] = ()


def _spans(rule: GrowthRule, step: Step, curve: Stretch) -> _Spans:
    solves, solves_then = curve.solves, solves_of(step)[1]
    if solves_then.n_solves == 1:
        return _Spans(curve, curve)
    line = stretch_of(rule, solves.last_solves(2), curve.start, curve.length, step.zones)
    if solves_then.n_solves > 2 and step.zones is not None:
        return _Spans(curve, line)
    begin, end = solves_then.sigma[-2:].tolist()

    def stretch_before(history: SolveHistory) -> Stretch:
        return stretch_of(rule, history, begin, end - begin, step.earlier_zones)

    then = stretch_before(solves_then)
    return _Spans(
        curve,
        line,
        (
            then if solves_then.n_solves == 2 else stretch_before(solves_then.last_solves(2)),
            then,
            stretch_before(solves),
        ),
    )


@dataclass(frozen=True, eq=False)
class _PlacesError:
    """Estimated errors of the tips by a step, in two parts of the errors so far.

    Attributes
    ----------
    known_error, newest_error : (n,) arrays, length
        Parts that are final with this step, and that the next solve will replace.
    own_error : (n,) array, length
        Of this step alone.
    ahead : (2, n) array, length
        Parts of `known_error` and of `newest_error` along the paths.
    """

    known_error: Floats
    newest_error: Floats
    own_error: Floats
    errors_ahead: Floats


def _places(
    rule: GrowthRule, step: Step, solves: SolveHistory, spans: _Spans, frame: Floats, gap: Floats
) -> _PlacesError:
    """Estimated errors of the tips by a corrected step; `solves` have its corrected directions.

    Notes
    -----
    The error of the step before is the difference of two polynomials: through the solves of then,
    and through those of now. For this step only one is known: its difference from a line is scaled
    as in the step before, and grows with the length.
    """
    plan, old_solves = plan_of(step), solves_of(step)[1]
    direction = solves.direction[-1]
    size, arc = np.linalg.norm(gap, axis=1), np.abs((gap * direction).sum(axis=1))
    no_error = np.zeros(len(size))
    if step.zones is not None:
        share = share_left(rule) * (_FIRST_OF_PLACE if old_solves.n_solves == 1 else 1.0)
        return _PlacesError(share * size, no_error, share * size, np.stack([share * arc, no_error]))
    by_gap, arc = _OF_GAP * size, _OF_GAP * arc
    if old_solves.n_solves == 1:
        return _PlacesError(by_gap, no_error, by_gap, np.stack([arc, no_error]))

    angle, old_angle = solves.angles(frame), old_solves.angles(frame)
    move_now = spans.curve.growth(frame, angle).move - spans.line.growth(frame, angle[-2:]).move
    by_last_two, by_solves_then, by_solves_now = spans.of_step_before
    move = by_solves_then.growth(frame, old_angle).move
    move_before = by_solves_now.growth(frame, angle).move - move
    ratio, move_length = np.ones(len(size)), np.linalg.norm(move_before, axis=1)
    if old_solves.n_solves > 2:
        move_error = np.linalg.norm(move - by_last_two.growth(frame, old_angle[-2:]).move, axis=1)
        length_ratio = plan.length / float(solves.sigma[-2] - solves.sigma[-3])
        ratio = np.divide(length_ratio * move_length, move_error, out=ratio, where=move_error > 0)
        ratio = np.clip(ratio, *_RATIOS_OF_PLACE)
    newest_error = ratio * np.linalg.norm(move_now, axis=1)
    errors_ahead = np.stack([
        arc + np.abs((move_before * direction).sum(axis=1)),
        ratio * np.abs((move_now * direction).sum(axis=1))
    ])  # fmt: skip
    return _PlacesError(by_gap + move_length, newest_error, by_gap + newest_error, errors_ahead)


@dataclass(frozen=True, eq=False)
class _CyclesError:
    """Estimated errors of the cycles: of a step alone, and two parts of that so far.

    `known_error` is final with this step, `newest_error` will be replaced by the next solve.
    """

    own_error: float
    known_error: float
    newest_error: float


def _cycles(
    rule: GrowthRule, step: Step, spans: _Spans, growth: Growth
) -> tuple[float, _CyclesError]:
    """Cycles of a corrected step, and their estimated error."""
    plan, old_solves, share = plan_of(step), solves_of(step)[1], share_left(rule)
    if old_solves.n_solves == 1:
        cycle_difference = abs(growth.cycles - plan.cycles)
        # The parabola of the next step mends it: of that, a square is left.
        rest = _MENDED * share * cycle_difference**2 / growth.cycles if growth.cycles > 0 else 0.0
        return growth.cycles, _CyclesError(rest, 0.0, _FIRST * share * cycle_difference)
    line_error = share * abs(growth.cycles - spans.line.arcs()[1])
    if old_solves.n_solves > 2:
        return growth.cycles, _better_known(rule, step, spans, line_error)
    if old_solves.sigma[0] > 0:  # the step before has passed an interface
        return growth.cycles, _CyclesError(line_error, 0.0, line_error)
    # The second step: the parabola tells what the first one, along a line, was off, less or more.
    line, curve = (span.arcs()[1] for span in spans.of_step_before[1:])
    line_and_curve_error = _RATIO_OF_FIRST * (line_error + share * abs(curve - line))
    part = 1.0 if rule.tolerance is None else _MENDS_OF_FEW
    return growth.cycles + part * (curve - line), _CyclesError(
        _OF_SECOND * line_error, 0.0, line_and_curve_error
    )


def _better_known(rule: GrowthRule, step: Step, spans: _Spans, line_error: float) -> _CyclesError:
    """Errors of the cycles from the third step on.

    The error of the step before is the difference of the parabolas of that step and of this one; it
    replaces the estimate made then. The estimate of this step is reduced in the same ratio.
    """
    old_solves, cycles_before = solves_of(step)[1], _error(step).newest_cycles
    if step.zones is not None:
        return _CyclesError(line_error, line_error + cycles_before, 0.0)

    share = share_left(rule)
    by_last_two, by_solves_then, by_solves_now = (span.arcs()[1] for span in spans.of_step_before)
    error_before, error_now = (
        share * abs(by_solves_then - by_last_two),
        abs(by_solves_then - by_solves_now),
    )
    length_ratio = plan_of(step).length / float(old_solves.sigma[2] - old_solves.sigma[1])
    newest_error = line_error * (
        float(np.clip(length_ratio * error_now / error_before, *_RATIOS))
        if error_before > 0
        else 1.0
    )
    if (
        old_solves.sigma[0] == 0
    ):  # the first step of all is spanned by one parabola: the next is prolonged
        by_last_two, by_solves_then, by_solves_now = (
            Stretch(history, 0.0, float(old_solves.sigma[1]), rule.threshold).arcs()[1]
            for history in (old_solves.first_solves(2), old_solves, spans.curve.solves)
        )
        prolonged_error, error_before = (
            _RATIO_OF_PROLONGED * abs(by_solves_then - by_solves_now),
            abs(by_solves_then - by_last_two),
        )
        error_of_first = min(prolonged_error, _RATIO_OF_FIRST * share * error_before)
        if rule.tolerance is not None:
            error_of_first = max(error_of_first, _LEAST_OF_FIRST * error_before)
        error_now += error_of_first
    return _CyclesError(newest_error, error_now, newest_error)


def _rows_that_stay(ends: Floats, placed_cracks: Sequence[Crack]) -> Ints:
    """Row of each placed tip among the advanced ones `(n,)`, of which some have left or joined."""
    row = {tuple(x): k for k, x in enumerate(ends.tolist())}
    return np.array([row[tuple(x)] for x in last_faces(placed_cracks).tip.tolist()], dtype=np.int64)


def _without_lost_tips(
    rule: GrowthRule, step: Step, rates: Rates, identities: Identities, rows_that_stay: Ints
) -> Corrected:
    """Start anew after tips have left or met, since K of the other tips has jumped.

    Cycles up to the first exit are as predicted; from there the new rates count.
    """
    plan, error = plan_of(step), _error(step)
    stations_before = solves_of(step)[0]
    x = (stations_before.x + plan.move)[rows_that_stay]
    stations = _stations(
        rates.cracks, identities, x, (stations_before.fresh | plan.moves)[rows_that_stay]
    )
    solves = first_solves(rule, rates)
    last_solves = solves_of(step)[1].last_solves(2)
    stretch_ahead = stretch_of(rule, last_solves, plan.sigma, plan.length, step.zones)
    zones = stretch_ahead.zones if stretch_ahead.integration is not None else None
    zones = None if zones is None else zones.at(rows_that_stay)
    lost_rows = np.setdiff1d(np.arange(len(plan.arc)), rows_that_stay)
    exit_ = _exit(rule, step, stretch_ahead, lost_rows)
    rest = plan.length - exit_
    cycles = stretch_ahead.arcs(exit_)[1] if rest > 0 else plan.cycles
    if 0 < rates.largest_rate < np.inf and step.zones is None:
        cycles += rest / rates.largest_rate
    elif rest > 0:
        cycles = plan.cycles
    place_error = np.concatenate(error.place)[rows_that_stay]
    cycle_error = share_left(rule) * abs(cycles - plan.cycles) + plan.error
    cycle_error += solves.exponent * error.behind * cycles
    return Corrected(
        step.cycles + cycles,
        rates.cracks,
        stations,
        solves,
        StepError(rates.split(place_error), error.cycles + cycle_error, behind=error.behind),
        _first_length(rule, stations, solves, rates),
        zones,
    )


def _exit(rule: GrowthRule, step: Step, stretch_ahead: Stretch, lost_rows: Ints) -> float:
    """Step of σ until the first of the lost tips leaves the body; all of it where none does."""
    plan, mesh = plan_of(step), rule.problem.mesh
    stations = solves_of(step)[0]
    if _is_inside(mesh, (stations.x + plan.move)[lost_rows]):
        return plan.length

    def is_in_body(length: float) -> bool:
        return _is_inside(
            mesh, (stations.x + _growth(stations, stretch_ahead, length).move)[lost_rows]
        )

    return bisected_length(is_in_body, plan.length)[1]


def _is_inside(mesh: Mesh, x: Floats) -> bool:
    return bool(contains(mesh, x).all())


def _last_step_of_run(step: Step, rates: Rates, identities: Identities) -> Corrected:
    """The last step of a run, at whose end a rate is infinite: no polynomial leads there.

    The inverse of the largest rate is taken to fall to zero along the step, as `cycles_between`
    does it.
    """
    plan, error = plan_of(step), _error(step)
    stations, old_solves = solves_of(step)
    cycles = 0.5 * plan.length / float(old_solves.rate[-1].max())
    if step.zones is not None:
        cycles = 0.5 * plan.cycles
    stations_after = _stations(
        rates.cracks, identities, stations.x + plan.move, stations.fresh | plan.moves
    )
    solves = replace(old_solves, rate=np.vstack([old_solves.rate[:-1], rates.law_rate]))
    return Corrected(
        step.cycles + cycles, rates.cracks, stations_after, solves,
        StepError(error.place, error.cycles + cycles), StepControl(), step.zones,
    )  # fmt: skip


def cycles_until(rule: GrowthRule, step: Step, part: float, end_rate: float | None) -> float:
    """Cycles of a part of the advance after a step, by the line through two solves."""
    del end_rate  # behind the first exit other rates count
    plan, solves = plan_of(step), solves_of(step)[1]
    length = part * plan.length
    return stretch_of(rule, solves.last_solves(2), plan.sigma, length, step.zones).arcs()[1]


__all__ = [
    "LONGER_FIRST",
    "advance_of",
    "begin",
    "correct",
    "cycles_until",
    "ends_of",
    "first_solves",
    "predict",
    "turn_of_faces",
]
