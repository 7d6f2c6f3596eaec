"""Cracks in 3D join as soon as they meet: in one surface one front goes on, else one is an arm."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from scipy.special import exprel

from xcrack.base.arrays import Bools, Floats, at
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import front_frames
from xcrack.crack.junctions_3d import (
    FaceAhead,
    crossings,
    face_ahead,
    face_led_on,
    front_distance_of,
    is_before,
    led_through,
    may_touch,
    renumbered_arms,
    with_room,
)
from xcrack.crack.measures import crack_areas, crack_size
from xcrack.crack.merging import (
    OFFSET,
    STEP,
    FrontGap,
    OwnGap,
    gap_between,
    merged_crack,
    own_gap,
    own_gap_around,
    turned_crack,
    with_own_gap_closed,
    without_inner_front,
)
from xcrack.crack.placing_3d import meeting_points, place_arm, place_arms
from xcrack.fem.system import discretise
from xcrack.growth import euler, fronts
from xcrack.growth.gaps import UNKNOWN_OF_FRONTS, closing_annulus, part_of_time
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates
from xcrack.growth.stations import Identities
from xcrack.growth.step import Corrected, Join, Plan, Step, StepError, plan_of, solves_of
from xcrack.mesh.distances import closest_in, triangle_tree
from xcrack.mesh.locate import Body
from xcrack.mesh.mesh import Mesh

_LIGAMENT = 0.9  # cells: radius of a ligament inside a front below which it breaks
_OWN = "of the same crack"  # what advancing says of a front that meets its own crack
_NEAR = 1.1  # cells between fronts below which they join: closer ones cannot be solved
_NEAR_OWN = 0.65  # the same of fronts of one crack that face each other: K is 5 to 9 % low there
_WIDER = 0.75  # of a gap: the disc is as large where a step leads across
_STEEP = 0.5  # of the height of a step of a cell or more: the gap over which it leads
_AHEAD = 1.8  # legs of cells before a face in which no front can be solved: it is led through
_ACROSS = 2.6  # legs of cells, the same where another front beside it is led on to be its face
_NARROW = 0.6  # legs of cells behind the nearest place, that are led to a front that is led on too
_BREAKS = 2.5  # cells: farther a front is not led on at once for an arm to end on its face
_LEAD = 1.5  # cells by which that one is led on to see where both meet
_TILT = np.cos(np.radians(60.0))  # fronts tilted by up to that join where no arm can be
_FLAT = np.cos(np.radians(20.0))  # fronts tilted by more may end on each other
_ROOM = 0.75  # cells between an arm and the front of the crack on which it ends: less breaks
_PARTS = (0.75, 0.5, 0.25)  # of the way to where fronts meet that can neither join nor be arms
_LEFT = 0.25  # of a cell: the gap that is closed at once
_RADIUS = 1.0  # cells: of the disc that rounds hollow corners of the joined front
_SPACING = 0.5  # of a cell, between the points of a new front
_WITHIN = 1e-3  # of a cell: to which the gap is closed
_TRIES = 12  # advances until it is
_MOST = 0.75  # of a cell: gap that may be left where the fronts speed up towards each other

_INTEGRATORS = {"euler": euler, "pec": fronts}


def with_joins(rule: GrowthRule, step: Step, plan: Plan) -> Plan:
    """A plan in which cracks that meet within its advance are joined.

    The advance ends where the first two fronts are a quarter of a cell apart, which is closed. What
    ends on a face close to the front of that crack breaks the ligament: that front is led on. So
    it is where fronts in other planes come too close to be solved: one ends on the face of the
    other, or, where both would run past the other's front, they become one crack.

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
    body = Body.of(rule.problem.mesh)
    broken_plan = _with_ligament_broken(rule, step, plan, body)
    if broken_plan is not None or plan.limit:
        return broken_plan or plan
    if len(plan.cracks) < 2:
        return plan
    close_pairs = _close_pairs(plan.cracks, body, step.corrected)
    facing_pairs = {
        pair for pair, _, _ in close_pairs
    }  # their fronts join; faces are those of other pairs
    faces = [pair for pair in _faces_met(plan.cracks, body) if pair not in facing_pairs]
    pairs_beside = [
        pair for pair in _pairs_beside(plan.cracks, body) if pair not in {*facing_pairs, *faces}
    ]
    if not close_pairs and not faces and not pairs_beside:
        return plan
    hindrance = _hindrance(rule) if close_pairs else ""
    if hindrance:
        i, k = close_pairs[0][0]
        raise GeometryError(
            f"cracks {i} and {k} meet near {at(close_pairs[0][1].x)}, and {hindrance}"
        )
    m = solves_of(step)[1].exponent
    facing_times = [
        _shares_at_meeting(rule, step, plan, *close_pair, body, m) for close_pair in close_pairs
    ]
    face_times = [_met_face(rule, step, plan, *pair, body, m) for pair in faces]
    face_times += [_met_face(rule, step, plan, *pair, body, m, True) for pair in pairs_beside]
    time, way, time_at_first_rate = first_meeting = min([*facing_times, *face_times])
    pairs_near = [*pairs_beside, *faces]  # fronts that only touch have no face ahead
    share: float | Floats = way
    if first_meeting in facing_times:
        share = _shares_of_stations(step, plan, facing_pairs, way, time, body)
    cracks_apart, part = _cracks_after(rule, step, plan, share), 1.0
    joined_now = _joined_cracks(rule, cracks_apart, facing_pairs, pairs_near, body)
    # Fronts that overlap may join while they are apart.
    for lesser_part in _PARTS if joined_now.failed_pairs else ():
        cracks_before = _cracks_after(rule, step, plan, lesser_part * share)
        joined_sooner = _joined_cracks(
            rule, cracks_before, facing_pairs, [*pairs_near, *joined_now.failed_pairs], body
        )
        if not joined_sooner.failed_pairs:
            joined_now, part = joined_sooner, lesser_part
            break
    if joined_now.failure is not None:
        if _pairs_beside(plan.cracks, body):
            raise joined_now.failure
        return plan  # beside each other by a cell or more they go on, and end on faces later
    if not joined_now.places:
        return plan
    way, time, time_at_first_rate = part * way, part * time, part * time_at_first_rate
    gain = _gain(step, joined_now.cracks_apart, rule.problem.mesh, m)
    area, area_apart, area_joined = (
        crack_areas(cracks, body.mesh)
        for cracks in (step.corrected, joined_now.cracks_apart, joined_now.cracks)
    )
    led_on = _led_on(joined_now, area_apart, area_joined, bool(pairs_beside))
    if led_on > 0:
        # Fronts that are led on to each other make area at once. It takes as long as fronts take
        # for as much: else on coarse cells, which lead them farther, it would cost nothing.
        total = area.sum()
        growth = max(area_apart.sum() - total, 1e-3 * total)
        way_of_area = way * (1 + led_on / growth)
        time *= max(1.0, way_of_area / time_at_first_rate)
        time_at_first_rate = max(time_at_first_rate, way_of_area)
        gain = max(gain, _gain_of((area_apart.sum() + led_on) / total, m))
    cycles = time * plan.cycles / gain
    cycle_error = UNKNOWN_OF_FRONTS * abs(time_at_first_rate * plan.cycles - cycles)
    joins_of_step = [
        Join(step.index + 1, step.cycles + cycles, tuple(x.tolist()), pair)
        for pair, x in joined_now.places
    ]
    return replace(
        plan, part=way, cycles=cycles, error=cycle_error, cracks=tuple(joined_now.cracks),
        apart=tuple(joined_now.cracks_apart), joins=tuple(joins_of_step),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Joined:
    """Cracks that have joined.

    Attributes
    ----------
    cracks_apart, cracks : sequence of Crack
        Before, and after.
    places : list of (pair of int, (3,) array)
        Which have met, and where, length.
    failed_pairs : list of pair of int
        Which are too close to be solved, but could not join.
    failure : GeometryError or None
        Why two fronts could not become one.
    """

    cracks_apart: Sequence[Crack]
    cracks: Sequence[Crack]
    places: list[tuple[tuple[int, int], Floats]]
    failed_pairs: list[tuple[int, int]]
    failure: GeometryError | None = None


def _led_on(joined_now: _Joined, area_apart: Floats, area_joined: Floats, is_beside: bool) -> float:
    """Area of fronts that are led on for others to meet them.

    What leads an arm through a face is part of its way there, but for fronts beside each other.
    """
    if is_beside:
        return float(area_joined.sum() - area_apart.sum())
    if len(area_apart) != len(area_joined):
        return 0.0
    pairs = zip(joined_now.cracks_apart, joined_now.cracks, strict=True)
    is_host = np.array([crack.ends_on == crack_joined.ends_on for crack, crack_joined in pairs])
    return float((area_joined - area_apart)[is_host].sum())


def _joined_cracks(
    rule: GrowthRule,
    cracks_apart: Sequence[Crack],
    facing_pairs: Collection[tuple[int, int]],
    pairs_beside: Sequence[tuple[int, int]],
    body: Body,
) -> _Joined:
    """Cracks of which some become arms on faces ahead of them, and others one; see `with_joins`."""
    cracks_now, places, failed_pairs = list(cracks_apart), [], []
    pairs_ahead = [
        (min(face_near.crack, face_near.on), max(face_near.crack, face_near.on))
        for face_near in _faces_near(cracks_now, body)
    ]
    steep_pairs = set(
        facing_pairs
    )  # and those of which neither can be an arm: their fronts join if they can
    for pair in dict.fromkeys([*pairs_ahead, *pairs_beside]):
        if pair in facing_pairs or may_touch(cracks_now, *pair):
            continue
        arm = _with_arm(rule, cracks_now, pair, body)
        if arm is None or not arm[2]:
            if _steep_pairs(cracks_now, [pair], body) and not _hindrance(rule):
                steep_pairs.add(pair)
                continue
            failed_pairs.append(pair)
        if arm is not None:
            cracks_now = arm[0]
            places.append((pair, arm[1]))
    number = list(range(len(cracks_now)))
    while pairs := _close_pairs(cracks_now, body) + _steep_pairs(
        cracks_now, _numbers(steep_pairs, number), body
    ):
        (i, k), gap, size = pairs[0]
        second_crack = cracks_now[k] if gap.turn > 0 else turned_crack(cracks_now[k])
        lateral_step = STEP * size if gap.offset > OFFSET * size else 0.0
        radius, pair_met = max(_RADIUS * size, _WIDER * gap.width), (number[i], number[k])
        try:
            cracks_now[i] = merged_crack(
                cracks_now[i], second_crack, radius, _SPACING * size, lateral_step, body
            )
        except GeometryError as failure:  # of tilted fronts whose gap has no outline one is an arm
            arm = _with_arm(rule, cracks_now, (i, k), body) if abs(gap.turn) < _FLAT else None
            if arm is None:
                return _Joined(cracks_apart, cracks_now, places, [*failed_pairs, pair_met], failure)
            cracks_now = arm[0]
            failed_pairs += [] if arm[2] else [pair_met]
        else:
            cracks_now = renumbered_arms(cracks_now, i, k, gap.turn > 0)
            del number[k]
        places.append((pair_met, gap.x))
    return _Joined(cracks_apart, cracks_now, places, failed_pairs)


# Fronts of one crack: those that close around a ligament, and those that come to face each other.


def _with_ligament_broken(rule: GrowthRule, step: Step, plan: Plan, body: Body) -> Plan | None:
    """A plan in which a ligament inside one crack breaks within its advance; None without one."""
    ligament = _closing_ligament(step, plan, body)
    m = solves_of(step)[1].exponent
    if ligament is None:
        gap_met = _facing_gap(rule, step, plan, body)
        if gap_met is None:
            return None
        c, way, gap = gap_met

        def crack_without_gap(cracks: Sequence[Crack]) -> Crack:
            return with_own_gap_closed(cracks[c], gap.x, _RADIUS * gap.size, _SPACING * gap.size)

        cracks_apart = _cracks_after(rule, step, plan, way)
        first_cracks = cracks_apart[c], crack_without_gap(cracks_apart)
        time = _time_of_gap(step, plan, c, way, gap, first_cracks, body)
        stations = solves_of(step)[0]
        widths = np.full(len(stations), np.inf)
        rows, reach = stations.crack == c, _reach_of_gap(plan, way, gap)
        widths[rows] = own_gap_around(step.corrected[c], body, reach, stations.x[rows])
        share = _shares_beyond(plan, widths, way, time, body.cell_size(stations.x))
        crack = first_cracks[1]
        with suppress(GeometryError):  # a gap that cannot be closed so is as all fronts leave it
            cracks_beside = _cracks_after(rule, step, plan, share)
            crack, cracks_apart = crack_without_gap(cracks_beside), cracks_beside
        x = gap.x
        cycles = time * plan.cycles / _gain(step, cracks_apart, body.mesh, m)
    else:
        c, f = ligament.crack, ligament.front
        stations = solves_of(step)[0]
        radii = _radii(step, ligament, body.mesh)
        cycles, advance, _ = closing_annulus(*radii, ligament.rates, m)
        longest_share = max(1.0, ligament.cell / plan.largest)
        way = min(cycles / plan.cycles, longest_share)
        cycles = way * plan.cycles
        share = np.full(len(stations), way)
        is_of_crack = stations.crack == c
        if ligament.ways[1] > 0:
            share[is_of_crack] = min(advance / ligament.ways[1], longest_share)
        share[is_of_crack & (stations.front == f)] = 0.0
        cracks_apart = _INTEGRATORS[rule.integrator].advanced_cracks(rule, step, share * plan.arc)
        crack, x = without_inner_front(cracks_apart[c], f)
    cracks_now = [crack if k == c else crack_apart for k, crack_apart in enumerate(cracks_apart)]
    join = Join(step.index + 1, step.cycles + cycles, tuple(x.tolist()), (c, c))
    return replace(
        plan, part=min(way, 1.0), cycles=cycles, error=UNKNOWN_OF_FRONTS * cycles,
        cracks=tuple(cracks_now),
        apart=tuple(cracks_apart), joins=(join,), limit="", refusal="",
    )  # fmt: skip


@dataclass(frozen=True)
class _Ligament:
    """A round ligament inside a crack.

    Attributes
    ----------
    crack, front : int
        Which, and its closed front around the ligament.
    radius : float, length
        Of the ligament.
    rates, ways : (float, float), length/cycle and length
        Of the inner front and the outer ones: means of the rates, and of what is planned.
    cell : float, length
        Size of the cells there.
    """

    crack: int
    front: int
    radius: float
    rates: tuple[float, float]
    ways: tuple[float, float]
    cell: float


def _ligaments(step: Step, plan: Plan, body: Body) -> Iterator[_Ligament]:
    """Closed fronts around ligaments that grow."""
    stations, solves = solves_of(step)
    for c, crack in enumerate(step.corrected):
        for f, front in enumerate(front_frames(crack)):
            if not front.is_closed or len(crack.fronts or ()) < 2:
                continue
            outward_way = front.x.mean(axis=0) - front.x
            if np.einsum("ij,ij->i", outward_way, front.frame[:, 0]).mean() <= 0:
                continue
            is_inner = (stations.crack == c) & (stations.front == f)
            is_outer = (stations.crack == c) & (stations.front != f)
            if not is_inner.any() or plan.arc[is_inner].mean() <= 0:
                continue
            rate = np.where(plan.arc > 0, solves.rate[-1], 0.0)
            ligament = _Ligament(
                crack=c,
                front=f,
                radius=float(np.linalg.norm(outward_way, axis=1).max()),
                rates=_mean_pair(rate, is_inner, is_outer),
                ways=_mean_pair(plan.arc, is_inner, is_outer),
                cell=float(body.cell_size(front.x).mean()),
            )
            if ligament.rates[0] > 0:
                yield ligament


def _radii(step: Step, ligament: _Ligament, mesh: Mesh) -> tuple[float, float]:
    """Radii of a ligament and of the annulus around it that has the area of the crack."""
    whole_crack, _ = without_inner_front(step.corrected[ligament.crack], ligament.front)
    disc_radius = float(np.sqrt(crack_areas([whole_crack], mesh)[0] / np.pi))
    return ligament.radius, max(disc_radius, ligament.radius)


def _mean_pair(values: Floats, is_inner: Bools, is_outer: Bools) -> tuple[float, float]:
    outer_mean = float(values[is_outer].mean()) if is_outer.any() else 0.0
    return float(values[is_inner].mean()), outer_mean


def _closing_ligament(step: Step, plan: Plan, body: Body) -> _Ligament | None:
    """A ligament of whose radius less than a cell would be left: it breaks."""
    for ligament in _ligaments(step, plan, body):
        if ligament.radius - ligament.ways[0] < _LIGAMENT * ligament.cell:
            return ligament
    return None


def _facing_gap(
    rule: GrowthRule, step: Step, plan: Plan, body: Body
) -> tuple[int, float, OwnGap] | None:
    """Crack whose fronts come to face each other, the share of the advance, and the gap then."""

    def nearest_gap(share: float) -> tuple[int, OwnGap] | None:
        cracks_now = plan.cracks if share == 1.0 else _cracks_after(rule, step, plan, share)
        gaps = [(c, own_gap(crack, body, _NEAR_OWN)) for c, crack in enumerate(cracks_now)]
        open_gaps = [(c, gap) for c, gap in gaps if gap is not None]
        return min(open_gaps, key=lambda pair: pair[1].width, default=None)

    if not plan.limit:
        gap_met = nearest_gap(1.0)
        if gap_met is None:
            return None
        if gap_met[1].width > _LEFT * gap_met[1].size:
            return gap_met[0], 1.0, gap_met[1]
    elif _OWN not in plan.refusal:
        return None
    s_min, s_max, last_met = 0.0, 1.0, None
    for _ in range(_TRIES):
        share = 0.5 * (s_min + s_max)
        try:
            gap_met = nearest_gap(share)
        except GeometryError:
            s_max = share
            continue
        if gap_met is None:  # not there yet
            s_min = share
        elif gap_met[1].width <= _LEFT * gap_met[1].size:
            s_max = share
        else:
            s_min, last_met = share, (gap_met[0], share, gap_met[1])
            if gap_met[1].width <= 2 * _LEFT * gap_met[1].size:
                break
    return last_met


def _reach_of_gap(plan: Plan, way: float, gap: OwnGap) -> float:
    """Cells up to which a gap may have been wide before a part of an advance."""
    return 1.01 * (gap.width + 2 * way * plan.largest) / gap.size


def _time_of_gap(
    step: Step, plan: Plan, c: int, way: float, gap: OwnGap, cracks: tuple[Crack, Crack], body: Body
) -> float:
    """When fronts of one crack that face each other have met, in shares of an advance.

    Ends of arms amplify K of each other as pennies of half their width do (to 2 %). What is closed
    at once takes no longer than fronts take for as much area, where the ends are slower than they.

    Parameters
    ----------
    step : Step
    plan : Plan
    c : int
    way : float
        Share of the advance after which the gap is closed.
    gap : OwnGap
        That is left then.
    cracks : (Crack, Crack)
        The crack with the gap, and without.
    body : Body
    """
    first_gap = own_gap(step.corrected[c], body, _reach_of_gap(plan, way, gap))
    area, area_apart, area_joined = (
        crack_areas([crack], body.mesh)[0] for crack in (step.corrected[c], *cracks)
    )
    growth = max(area_apart - area, 1e-3 * area)
    longest_time = way * (1 + max(area_joined - area_apart, 0.0) / growth)
    if first_gap is None or first_gap.width <= gap.width:
        return float(longest_time)
    way_of_gap = way * first_gap.width / (first_gap.width - gap.width)
    half_width = float(step.sizes[c])  # of arms: their area over the length of both sides
    m = solves_of(step)[1].exponent
    time = way_of_gap * part_of_time(first_gap.width / half_width, m, 3)
    return float(min(time, longest_time))


def _shares_of_stations(
    step: Step,
    plan: Plan,
    pairs: Collection[tuple[int, int]],
    way: float,
    time: float,
    body: Body,
) -> Floats:
    """Shares of an advance up to a meeting at the stations `(n,)`.

    Fronts that meet wait where what is left between them is closed at once, while the others go on
    for the cycles that this takes; where a gap closes faster than at first the others come less
    far. Between the two shares lies as much as keeps the gap, and a cell at least.

    Parameters
    ----------
    step : Step
    plan : Plan
    pairs : collection of pair of int
        Cracks that meet.
    way, time : float
        Shares of the advance of fronts that meet, and of the cycles until they have.
    body : Body
    """
    stations = solves_of(step)[0]
    gap = np.full(len(stations), np.inf)
    for c, on in {pair for i, k in pairs for pair in ((i, k), (k, i))}:
        rows = np.nonzero(stations.crack == c)[0]
        crack = step.corrected[on]
        nearest_point = closest_in(triangle_tree(crack.points, crack.faces), stations.x[rows])
        gap[rows] = np.minimum(gap[rows], nearest_point.distance)
    return _shares_beyond(plan, gap, way, time, body.cell_size(stations.x))


def _shares_beyond(plan: Plan, gap: Floats, way: float, time: float, size: Floats) -> Floats:
    """Shares of an advance from those at the least gap to those far from it `(n,)`."""
    if not np.isfinite(gap).any():
        return np.full(len(gap), way)
    ramp = np.maximum(2 * abs(time - way) * plan.largest, size)
    return np.asarray(way + (time - way) * np.clip((gap - gap.min()) / ramp, 0.0, 1.0))


def _cracks_after(rule: GrowthRule, step: Step, plan: Plan, part: float | Floats) -> list[Crack]:
    return _INTEGRATORS[rule.integrator].partly_advanced(rule, step, plan, part)


def correct_join(rule: GrowthRule, step: Step, rates: Rates, identities: Identities) -> Corrected:
    """A step whose cracks have just joined: growth begins anew, after the cycles so far."""
    mesh, cycles_before = rates.problem.mesh, 0.0 if step.error is None else step.error.cycles
    plan = plan_of(step)
    cracks = range(len(step.cracks))
    place = tuple(
        np.max([fronts.errors_before(step, c, sif.x, mesh) for c in cracks], axis=0)
        for sif in rates.sif[0]
    )
    error = StepError(place, cycles_before + plan.error)
    result = _INTEGRATORS[rule.integrator].begin_at(
        rule, rates, identities, step.cycles + plan.cycles, error, step
    )
    share = _share_of_cycles(step, plan, result, Body.of(mesh))
    return replace(result, cycles=step.cycles + share * plan.cycles)


def _share_of_cycles(step: Step, plan: Plan, result: Corrected, body: Body) -> float:
    """Cycles of a ligament that broke inside a crack by the rates after it, over those before."""
    c = plan.joins[0].cracks[0]
    if set(plan.joins[0].cracks) != {c} or len(plan.cracks) != len(step.corrected):
        return 1.0
    m = solves_of(step)[1].exponent
    later_rate = result.solves.rate[-1][result.stations.crack == c]
    if not (len(later_rate) and np.isfinite(later_rate).all() and later_rate.mean() > 0):
        return 1.0
    lines = [set(line.tolist()) for line in plan.cracks[c].fronts or ()]
    waiting_lines = [line.tolist() for line in plan.apart[c].fronts or ()]
    for ligament in _ligaments(step, plan, body):
        front = (step.corrected[c].fronts or ())[ligament.front].tolist()
        if ligament.crack != c or front not in waiting_lines or set(front) in lines:
            continue
        radii = _radii(step, ligament, body.mesh)
        cycles, _, rate = closing_annulus(*radii, ligament.rates, m)
        if rate == 0:
            return 1.0
        softening = float(later_rate.mean()) / rate
        return closing_annulus(*radii, ligament.rates, m, softening)[0] / cycles
    return 1.0


def _faces_near(cracks: Sequence[Crack], body: Body) -> list[FaceAhead]:
    """Faces of others close ahead of fronts, nearest first."""
    faces_near = [
        face_ahead(cracks, c, on, body, _AHEAD)
        for c, on in permutations(range(len(cracks)), 2)
        if not may_touch(cracks, c, on)
    ]
    return sorted([face for face in faces_near if face is not None], key=lambda face: face.width)


def _faces_met(cracks: Sequence[Crack], body: Body) -> list[tuple[int, int]]:
    """Pairs of cracks of which one has come to the face of the other, or through it."""
    pairs = {(min(m.crack, m.on), max(m.crack, m.on)) for m in _faces_near(cracks, body)}
    for i, k in combinations(range(len(cracks)), 2):
        if (i, k) not in pairs and not may_touch(cracks, i, k) and _cross(cracks, i, k, body):
            pairs.add((i, k))
    return sorted(pairs)


def _cross(cracks: Sequence[Crack], i: int, k: int, body: Body) -> bool:
    x = meeting_points(cracks[i], cracks[k], body)
    return bool((is_before(cracks, i, x) & is_before(cracks, k, x)).any()) if len(x) else False


def _with_arm(
    rule: GrowthRule, cracks: Sequence[Crack], pair: tuple[int, int], body: Body
) -> tuple[list[Crack], Floats, bool] | None:
    """Cracks of which one of a pair is an arm on the other, and where; None if neither can be.

    Of both ways, and of the front that is led on where no face is ahead, the first that the mesh
    can cut.
    """
    first = None
    for face_met, face in _arms_to_be(cracks, pair, body):
        try:
            cracks_now = _led_through(cracks, face_met, face, body)
            first = (cracks_now, face_met.x, False) if first is None and face is None else first
            if (
                face is not None
                and _lead(cracks[face_met.on], cracks_now[face_met.on], body) > _BREAKS
            ):
                continue
            discretise(replace(rule.problem, cracks=tuple(cracks_now)))
        except GeometryError:
            continue
        return cracks_now, face_met.x, True
    return first


def _steep_pairs(
    cracks: Sequence[Crack], pairs: Collection[tuple[int, int]], body: Body
) -> list[tuple[tuple[int, int], FrontGap, float]]:
    """Those of some pairs whose fronts touch tilted by up to 60 degrees; as of `_close_pairs`."""
    result = []
    for pair in sorted(pairs):
        if may_touch(cracks, *pair):
            continue
        gap = gap_between(cracks[pair[0]], cracks[pair[1]], body, np.inf)
        if gap is None or not gap.faces or abs(gap.turn) < _TILT:
            continue
        size = float(body.cell_size(gap.x[None])[0])
        if gap.offset <= STEP * size and gap.width < _NEAR * size:
            result.append((pair, gap, size))
    return result


def _numbers(pairs: Collection[tuple[int, int]], number: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of cracks by the places of their numbers, where both are still there."""
    return [(number.index(i), number.index(k)) for i, k in pairs if {i, k} <= set(number)]


def _arms_to_be(
    cracks: Sequence[Crack], pair: tuple[int, int], body: Body
) -> Iterator[tuple[FaceAhead, Crack | None]]:
    """Faces ahead of the fronts of either of two cracks; then those of fronts that are led on."""
    pair_orders = (pair, pair[::-1])
    faces_met = [face_ahead(cracks, c, on, body, _AHEAD) for c, on in pair_orders]
    yield from ((face, None) for face in sorted(filter(None, faces_met), key=lambda f: f.width))
    faces_beside = (_face_beside(cracks, c, on, body) for c, on in pair_orders)
    yield from (row[1:] for row in sorted(filter(None, faces_beside), key=lambda row: row[0]))


def _face_beside(
    cracks: Sequence[Crack], c: int, on: int, body: Body
) -> tuple[float, FaceAhead, Crack] | None:
    """What the front of crack c meets if that of `on` is led on: how far that is beyond it."""
    face = face_led_on(cracks, c, on, body, _LEAD, _SPACING)
    if face is None:
        return None
    cracks_now = [face if number == on else crack for number, crack in enumerate(cracks)]
    face_met = face_ahead(cracks_now, c, on, body, _ACROSS)
    if face_met is None:
        return None
    tree = triangle_tree(cracks[on].points, cracks[on].faces)
    return float(closest_in(tree, face_met.x[None]).distance[0]), face_met, face


def _led_through(
    cracks: Sequence[Crack], face_met: FaceAhead, face: Crack | None, body: Body
) -> list[Crack]:
    """Cracks of which one has been led through the face of another one, and ends there.

    Parameters
    ----------
    cracks : sequence of Crack
    face_met : FaceAhead
    face : Crack or None
        That one with its front led on before the other: of it as much stays as the arm needs.
    body : Body
    """
    cracks_now, reach = list(cracks), _AHEAD
    if face is not None:
        cracks_now[face_met.on], reach = face, face_met.width / face_met.leg + _NARROW
    cracks_now[face_met.crack] = led_through(
        cracks_now, face_met.crack, face_met.on, body, reach, _SPACING
    )
    if face is not None:
        line = crossings(cracks_now[face_met.crack], face)
        line = line[body.contains(line)]
        cracks_now[face_met.on] = with_room(
            cracks, face_met.crack, face_met.on, body, _ROOM, _SPACING, line
        )
    cracks_now[face_met.crack] = place_arm(cracks_now, face_met.crack, body.mesh)
    host = with_room(cracks_now, face_met.crack, face_met.on, body, _ROOM, _SPACING)
    if face is not None or host is not cracks_now[face_met.on]:
        cracks_now[face_met.on] = host
        cracks_now = place_arms(cracks_now, body.mesh)
    return cracks_now


def _lead(old_crack: Crack, new_crack: Crack, body: Body) -> float:
    """Farthest way of new points of a crack from what it was, in cells."""
    x = new_crack.points[len(old_crack.points) :]
    if not len(x):
        return 0.0
    distance = closest_in(triangle_tree(old_crack.points, old_crack.faces), x).distance
    return float((distance / body.cell_size(x)).max())


def _pairs_beside(cracks: Sequence[Crack], body: Body) -> list[tuple[int, int]]:
    """Pairs of cracks whose fronts are closer than can be solved."""
    return [
        (i, k)
        for i, k in combinations(range(len(cracks)), 2)
        if not may_touch(cracks, i, k) and front_distance_of(cracks, i, k, body) < _NEAR
    ]


def _met_face(
    rule: GrowthRule,
    step: Step,
    plan: Plan,
    i: int,
    k: int,
    body: Body,
    exponent: float,
    is_beside: bool = False,
) -> tuple[float, float, float]:
    """When a front has met the face of another crack, in shares of an advance; as of `_met`.

    Before a free face K grows as between two cracks that face each other at twice the distance.
    Of fronts beside each other one is led on, and the other meets its face.
    """

    def face_after(share: float) -> FaceAhead | None:
        cracks_now = plan.cracks if share == 1.0 else _cracks_after(rule, step, plan, share)
        if _cross(cracks_now, i, k, body):
            return FaceAhead(i, k, 0.0, 1.0, np.zeros(3))
        pair_orders = ((i, k), (k, i))
        if is_beside:
            faces_beside = (_face_beside(cracks_now, *pair, body) for pair in pair_orders)
            nearest_row = min(filter(None, faces_beside), key=lambda row: row[0], default=None)
            return None if nearest_row is None else nearest_row[1]
        faces_ahead = (face_ahead(cracks_now, *pair, body, _AHEAD) for pair in pair_orders)
        return min(filter(None, faces_ahead), key=lambda face: face.width, default=None)

    def is_near(face: FaceAhead, share: float = 1.0) -> bool:
        return face.width <= share * _LEFT * face.leg

    w_min, w_max, face_met = 0.0, 1.0, face_after(1.0)
    while face_met is not None and not is_near(face_met) and w_max * plan.largest < face_met.leg:
        w_min, w_max = w_max, w_max + face_met.leg / plan.largest
        face_met = face_after(w_max)
    way = w_max
    if face_met is not None and is_near(face_met):
        for _ in range(_TRIES):
            way = 0.5 * (w_min + w_max)
            face_met = face_after(way)
            if face_met is not None and is_near(face_met, 0.5):
                w_max = way
            elif face_met is None or not is_near(face_met):
                w_min = way
            else:
                break
        else:
            way = w_min
            face_met = face_after(way)
    if face_met is None:
        return way, way, way
    whole_way = way + face_met.width / plan.largest
    gap = whole_way * plan.largest
    return whole_way * part_of_time(gap / step.sizes[face_met.crack], exponent, 3), way, whole_way


def _close_pairs(
    cracks: Sequence[Crack], body: Body, cracks_before: Sequence[Crack] = ()
) -> list[tuple[tuple[int, int], FrontGap, float]]:
    """Pairs of cracks in one surface whose fronts are too close to be solved, nearest first.

    Those beside each other by up to two cells are, too: a step leads across. Of fronts that come
    there in an advance those count that faced each other before it.

    With each pair the gap between them, and the size of the cell there.
    """
    result = []
    for i, k in combinations(range(len(cracks)), 2):
        x = np.concatenate(
            [
                np.zeros((0, 3)),
                *(crack.points[f] for crack in (cracks[i], cracks[k]) for f in crack.fronts or ()),
            ]
        )
        if not len(x) or may_touch(cracks, i, k):
            continue
        gap = gap_between(cracks[i], cracks[k], body, 3 * float(body.cell_size(x).max()))
        if gap is None:
            continue
        size = float(body.cell_size(gap.x[None])[0])
        if gap.width >= _NEAR * size or not gap.in_surface(size):
            continue
        if gap.faces if not cracks_before else _is_facing(cracks_before[i], cracks_before[k], body):
            result.append(((i, k), gap, size))
    return sorted(result, key=lambda row: row[1].width / row[2])


def _is_facing(first_crack: Crack, second_crack: Crack, body: Body) -> bool:
    gap = gap_between(first_crack, second_crack, body, np.inf)
    return gap is not None and gap.faces


def _shares_at_meeting(
    rule: GrowthRule,
    step: Step,
    plan: Plan,
    pair: tuple[int, int],
    gap_near: FrontGap,
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
    way_of_gap : float
        Time at the rates of the beginning.
    """
    i, k = pair
    # Over an offset a wider gap is closed: of half a cell, or half as wide as a high step.
    offset_share = gap_near.offset / size
    share_left = float(np.clip(offset_share, _LEFT, max(OFFSET, _STEEP * offset_share)))
    way = _share(rule, step, plan, pair, size, share_left, body)
    first = gap_between(step.corrected[i], step.corrected[k], body, np.inf)
    gap, gap_left = (0.0 if first is None else first.width), share_left * size
    if gap <= gap_left:
        return way, way, way
    a = 2 * float(np.mean([step.sizes[c] for c in pair]))  # of a penny: its radius
    way_of_gap = way * gap / (gap - gap_left)
    time = way_of_gap * part_of_time(gap / a, exponent, 3)
    longest_way = way * (gap - _MOST * size) / (gap - gap_left)
    return time, min(way, max(time, longest_way)), way_of_gap


def _gain(step: Step, cracks_now: Sequence[Crack], mesh: Mesh, exponent: float) -> float:
    """Mean rate of an advance over that at its beginning, of the crack that grows most.

    As in `elapsed_3d`: K goes with the root of the size.
    """
    sizes = zip(step.sizes, (crack_size(cracks_now, c, mesh) for c in range(len(step.sizes))))
    return max(_gain_of((size / old_size) ** 2, exponent) for old_size, size in sizes)


def _gain_of(area_ratio: float, exponent: float) -> float:
    """Mean rate while an area grows by a ratio, over that at its beginning.

    K goes with the root of the size, whose square the area is.
    """
    x = 0.5 * np.log(area_ratio)
    return float(exprel(x) / exprel(x - exponent * 0.5 * x))


def _share(
    rule: GrowthRule,
    step: Step,
    plan: Plan,
    pair: tuple[int, int],
    size: float,
    gap_left: float,
    body: Body,
) -> float:
    """Share of an advance after which a gap is closed but for `gap_left` cells.

    At most the whole advance, or one of a cell where that is longer: what is left then is less
    than a cell wide, or the fronts do not come closer.
    """
    largest_share = max(1.0, size / plan.largest)
    i, k = pair

    def excess(share: float) -> float:
        cracks_now = plan.cracks if share == 1.0 else _cracks_after(rule, step, plan, share)
        gap = gap_between(cracks_now[i], cracks_now[k], body, 10 * size + 2 * share * plan.largest)
        return np.inf if gap is None else gap.width / size - gap_left

    s_min, at_min = 0.0, excess(0.0)
    s_max, at_max = 1.0, excess(1.0)
    while at_max > 0 and s_max < largest_share:
        s_min, at_min = s_max, at_max
        s_max = min(2 * s_max, largest_share)
        at_max = excess(s_max)
    if at_max > 0 or not np.isfinite(at_min):
        return s_max
    if at_min <= 0:
        return 0.0
    for _ in range(_TRIES):
        # Where fronts overlap the gap is zero and says nothing of how far: then halve.
        part = at_min / (at_min - at_max) if at_max > -0.99 * gap_left else 0.5
        share = s_min + part * (s_max - s_min)
        value = excess(share)
        if abs(value) < _WITHIN:
            return share
        if value > 0:
            s_min, at_min = share, value
        else:
            s_max, at_max = share, value
    return s_max


def _hindrance(rule: GrowthRule) -> str:
    """Why cracks cannot join in a run; empty where they can."""
    hindrance = named_by_number(rule)
    if hindrance:
        return hindrance
    if isinstance(rule.problem.friction, Sequence):
        return "friction differs between them: give one number for all cracks."
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


__all__ = ["correct_join", "named_by_number", "with_joins"]
