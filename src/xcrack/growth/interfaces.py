"""Ends that come to an interface of materials: steps end before it, and go on behind it.

K of a tip that is nearer to another material than a cell is off by more than a per cent, and there
is none on the interface. The last step before it ends a cell away; the next one passes, and ends
a cell behind. Its cycles are those of both parts, each by the law of the material it runs in.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, coordinates
from xcrack.base.description import describe
from xcrack.base.errors import ProblemError, collected_warnings, warn
from xcrack.fatigue.cycle import cycles_between
from xcrack.fatigue.law import LawSets
from xcrack.fatigue.retardation import BlockCycles, OverloadZones, RetardationSets
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import rates_by_law_of
from xcrack.growth.response import Response, best_K
from xcrack.growth.solves import Growth, SolveHistory, Stretch, bisected_length, stretch_of
from xcrack.growth.step import Step, plan_of, solves_of
from xcrack.mesh.locate import cell_sizes
from xcrack.model.elasticity import Elasticity
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem

# Cells between an interface and the end of a step before or behind it: where K jumps, and where the
# laws differ alone.
_GAPS = (1.1, 0.3)
_SOON = 0.25  # cells: a step that would be shorter passes at once
_LEAST = 0.05  # cells: a shorter piece of a way is the corner of a set, not a layer
_SPLITS = 60  # of a bisection: to the last bit


@dataclass(frozen=True, eq=False)
class InterfacesAhead:
    """Interfaces on the ways of n ends.

    Attributes
    ----------
    way : (n,) array, length
        To the first one; inf where there is none.
    behind : (n,) array, length
        From there to where a step behind it ends.
    set_before, set_after : (n,) array of int
        Numbers of the sets on both sides.
    is_smooth : (n,) array of bool
        The materials differ in their laws alone: K does not feel the interface.
    cell, gap : (n,) arrays, length
        Size of the cells there, and from the interface to the ends of steps beside it.
    power : (n,) array
        K close to the interface goes like this power of the distance to it, on both sides.
    """

    way: Floats
    way_behind: Floats
    set_before: Ints
    set_after: Ints
    is_smooth: Bools
    cell: Floats
    gap: Floats
    power: Floats

    @property
    def stop(self) -> Floats:
        """Way to where the last step before the interface ends `(n,)`, length; inf without one."""
        return np.where(np.isfinite(self.way), self.way - self.gap, np.inf)

    @property
    def goal(self) -> Floats:
        """Way to where the next step ends at the latest `(n,)`, length; inf without an interface.

        Before it, and behind where that is too short a step.
        """
        return np.where(self.stop < _SOON * self.cell, self.way + self.way_behind, self.stop)


def interfaces_ahead(rule: GrowthRule, x: Floats, move: Floats) -> InterfacesAhead | None:
    """Interfaces on the ways of ends, and a little beyond; None where there are none.

    Parameters
    ----------
    rule : GrowthRule
    x : (n, d) array, length
        Where the ends are.
    move : (n, d) array, length
        How far they would come.
    """
    elasticity = rule.problem.elasticity
    mesh, kinds = rule.problem.mesh, _kinds(rule)
    cell_0, cell_1 = mesh.facet_to_cell.T
    of_cell = kinds[elasticity.set_number]
    facets = mesh.facets[(cell_1 >= 0) & (of_cell[cell_0] != of_cell[cell_1])]
    length = np.linalg.norm(move, axis=1)
    if not len(facets) or not length.any():
        return None
    n, number = len(x), _numbers_of_sets(rule)
    way, way_behind, gap, power = np.full(n, np.inf), np.full(n, np.inf), np.zeros(n), np.zeros(n)
    set_before = np.array(elasticity.sets_at(x))
    set_after, cell, is_smooth = np.array(set_before), cell_sizes(mesh, x), np.zeros(n, dtype=bool)
    by_K = getattr(rule.law, "ratio", None) != "nominal"
    for i in np.nonzero(length > 0)[0].tolist():
        direction = move[i] / length[i]
        largest_way = length[i] + 3 * _GAPS[0] * cell[i]
        hits = _hits(mesh.points[facets], x[i], direction, largest_way)
        ends = np.concatenate([[0.0], hits, [largest_way]])
        middle = x[i] + 0.5 * (ends[1:] + ends[:-1])[:, None] * direction
        sets = elasticity.sets_at(middle)
        is_long = np.diff(ends) > _LEAST * cell[i]
        begin_of_part, sets = ends[:-1][is_long], sets[is_long]
        changes = np.nonzero(kinds[sets[1:]] != kinds[sets[:-1]])[0] + 1
        if not len(changes):
            continue
        first = int(changes[0])
        way[i], set_before[i], set_after[i] = begin_of_part[first], sets[first - 1], sets[first]
        is_smooth[i] = by_K and number[set_before[i]] == number[set_after[i]]
        place = x[i] + (way[i] + _LEAST * cell[i]) * direction
        cell[i] = float(cell_sizes(mesh, place[None])[0])
        gap[i] = _GAPS[int(is_smooth[i])] * cell[i]
        room = begin_of_part[int(changes[1])] - way[i] if len(changes) > 1 else np.inf
        way_behind[i] = min(gap[i], 0.5 * room)
        if number[set_before[i]] != number[set_after[i]]:
            places_beside = [x[i] + (way[i] + k * _LEAST * cell[i]) * direction for k in (-1, 1)]
            power[i] = _power_of_K(elasticity, *places_beside)
    if np.isinf(way).all():
        return None
    return InterfacesAhead(way, way_behind, set_before, set_after, is_smooth, cell, gap, power)


def whole_front_ahead(rule: GrowthRule, x: Floats, move: Floats) -> InterfacesAhead | None:
    """The same of places along fronts that are all in one material, which they leave together.

    A front that is in several already goes on with the law of each place.
    """
    interfaces = interfaces_ahead(rule, x, move)
    if interfaces is None or len(np.unique(_kinds(rule)[interfaces.set_before])) > 1:
        return None
    return interfaces


def _numbers_of_sets(rule: GrowthRule) -> Ints:
    """Number of the stiffness of each named set `(m,)`."""
    elasticity = rule.problem.elasticity
    if not len(elasticity.number):
        return np.zeros(len(elasticity.named), dtype=np.int64)
    first = [int(np.argmax(elasticity.set_number == k)) for k in range(len(elasticity.named))]
    return elasticity.number[first]


def _kinds(rule: GrowthRule) -> Ints:
    """Which of the named sets are alike in stiffness and law `(m,)`: equal numbers."""
    number, names = _numbers_of_sets(rule), [name for name, _ in rule.problem.elasticity.named]
    texts = [""] * len(names)
    if isinstance(rule.law, LawSets):
        laws = dict(rule.law.laws)
        texts = [str(describe("law", laws[name])) for name in names]
    if isinstance(rule.retardation, RetardationSets):
        models = dict(rule.retardation.models)
        texts = [words + str(models[name]) for words, name in zip(texts, names, strict=True)]
    pairs = list(zip(number.tolist(), texts, strict=True))
    return np.array([pairs.index(pair) for pair in pairs], dtype=np.int64)


def _hits(facets: Floats, x: Floats, direction: Floats, largest_way: float) -> Floats:
    """Lengths at which a straight way passes facets `(k, d, d)`, rising."""
    if len(x) == 3:
        first_side, second_side = facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0]
        normal, gap = np.cross(first_side, second_side), facets[:, 0] - x
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.einsum("ki,ki->k", gap, normal) / (normal @ direction)
            place = distance[:, None] * direction - gap
            size = np.einsum("ki,ki->k", normal, normal)
            u = np.einsum("ki,ki->k", np.cross(place, second_side), normal) / size
            v = np.einsum("ki,ki->k", np.cross(first_side, place), normal) / size
        is_inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        return np.unique(distance[is_inside & (distance > 0) & (distance < largest_way)])
    start, side = facets[:, 0], facets[:, 1] - facets[:, 0]
    gap, cross = start - x, direction[0] * side[:, 1] - direction[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (gap[:, 0] * side[:, 1] - gap[:, 1] * side[:, 0]) / cross
        share = (gap[:, 0] * direction[1] - gap[:, 1] * direction[0]) / cross
    hit = (
        (cross != 0)
        & (share >= -1e-9)
        & (share <= 1 + 1e-9)
        & (distance > 0)
        & (distance < largest_way)
    )
    return np.unique(distance[hit])


def _power_of_K(elasticity: Elasticity, place_before: Floats, place_behind: Floats) -> float:
    """Power of the distance to an interface that K goes like: above 0 before a stiffer material."""
    try:
        material, solid = (
            elasticity.isotropic_at(place_before),
            elasticity.isotropic_at(place_behind),
        )
    except ProblemError:  # not isotropic
        return 0.0
    return 0.5 - singularity_at_interface(material, solid)


def singularity_at_interface(material_at_tip: Isotropic, solid: Isotropic) -> float:
    """Order λ of the stresses r^-λ at a tip on an interface, which its crack meets at right angles.

    Parameters
    ----------
    material_at_tip, solid : Isotropic
        Materials of the crack, and of the solid ahead of it.

    Notes
    -----
    cos λπ = 2 (β - α) / (1 + β) (1 - λ)² + (α + β²) / (1 - β²) with the parameters of Dundurs,
    α > 0 where the material ahead is stiffer (Zak and Williams 1963, J. Appl. Mech. 30, 142; as in
    He and Hutchinson 1989, Int. J. Solids Struct. 25, 1053).

    Examples
    --------
    >>> from xcrack.model.material import Isotropic
    >>> steel = Isotropic(210e3, 0.3, "strain")
    >>> round(singularity_at_interface(steel, steel), 6)
    0.5
    """
    alpha = (solid.E_prime - material_at_tip.E_prime) / (solid.E_prime + material_at_tip.E_prime)
    beta = (solid.mu * (material_at_tip.kolosov - 1) - material_at_tip.mu * (solid.kolosov - 1)) / (
        solid.mu * (material_at_tip.kolosov + 1) + material_at_tip.mu * (solid.kolosov + 1)
    )

    def is_above(order: float) -> bool:
        right_side = 2 * (beta - alpha) / (1 + beta) * (1 - order) ** 2
        right_side += (alpha + beta**2) / (1 - beta**2)
        return bool(np.cos(np.pi * order) > right_side)

    return sum(bisected_length(is_above, 1.0)) / 2


# A step that ends before an interface, or passes.


@dataclass(frozen=True, eq=False)
class Passage:
    """What happens until the first of some ends is where its step ends.

    Attributes
    ----------
    length : float, length
        Of σ.
    growth : Growth
    cycles_at : (n,) array
        Cycles at which ends were on their interface; nan where they were not.
    zones : OverloadZones, optional
        What overloads have left then.
    """

    length: float
    growth: Growth
    cycles_at: Floats
    zones: OverloadZones | None


def passage(
    rule: GrowthRule,
    frame: Floats,
    solves_in: Callable[[Bools], SolveHistory],
    interfaces: InterfacesAhead,
    goal: Floats,
    start: float,
    most_length: float,
    zones: OverloadZones | None,
) -> Passage:
    """Let ends grow, through their interfaces, until the first of them has come as far as wanted.

    Parameters
    ----------
    rule : GrowthRule
    frame : (n, 2, 2) array
        Of the ends.
    solves_in : callable (n,) array of bool -> SolveHistory
        What solves say when some ends have passed.
    interfaces : InterfacesAhead
    goal : (n,) array, length
        Way of each at which the passage ends; inf for those that do not end it.
    start, most_length : float, length
        Of σ: where it begins, and its longest piece.
    zones : OverloadZones, optional
        Left at the begin.
    """
    n = len(goal)
    is_passed, arc_done = np.zeros(n, dtype=bool), np.zeros(n)
    cycles_at, move, total, cycles = np.full(n, np.nan), np.zeros((n, 2)), 0.0, 0.0
    while total < most_length * (1 - 1e-12):
        solves = solves_in(is_passed)
        piece = stretch_of(rule, solves, start + total, most_length - total, zones)
        is_crossing = (goal > interfaces.way) & ~is_passed
        length, row = _first_end(piece, np.where(is_crossing, interfaces.way, goal) - arc_done)
        if length < most_length - total:
            piece = stretch_of(rule, solves, start + total, length, zones)
        growth = piece.growth(frame, solves.angles(frame))
        move, arc_done = move + growth.move, arc_done + growth.arc
        cycles, total = cycles + growth.cycles, total + length
        zones = piece.zones
        if row < 0 or not is_crossing[row]:
            break
        is_passed[row], arc_done[row], cycles_at[row] = True, interfaces.way[row], cycles
    return Passage(total, Growth(move, arc_done, cycles), cycles_at, zones)


def _first_end(piece: Stretch, target: Floats) -> tuple[float, int]:
    """Part of a piece of σ until the first end is where it should be, and which; -1 where none."""
    length, first = piece.length, -1
    for row in np.nonzero(piece.arcs()[0] >= target)[0].tolist():

        def is_before(part: float, row: int = row) -> bool:
            return bool(piece.arcs(part)[0][row] < target[row])

        part = bisected_length(is_before, length, _SPLITS)[1]
        if part < length or first < 0:
            length, first = part, row
    return length, first


def mixed_solves(
    solves_before: SolveHistory, solves_after: SolveHistory, sets: Ints, is_passed: Bools
) -> SolveHistory:
    """What solves say of ends of which some have passed into another set.

    Parameters
    ----------
    solves_before, solves_after : SolveHistory
        Before and behind the interfaces.
    sets : (n,) array of int
        Behind.
    is_passed : (n,) array of bool
    """
    kinds = solves_before.kinds
    if kinds is not None and solves_after.kinds is not None:
        dK, R, a = (
            np.where(
                is_passed.reshape(1, -1, *[1] * (value_after.ndim - 2)), value_after, value_before
            )
            for value_before, value_after in zip(
                kinds.arrays, solves_after.kinds.arrays, strict=True
            )
        )
        if kinds.sets is not None:
            sets = np.where(is_passed, sets, kinds.sets)
        kinds = BlockCycles(dK, R, a, sets)
    return replace(
        solves_before,
        rate=np.where(is_passed, solves_after.rate, solves_before.rate),
        dK_eq=np.where(is_passed, solves_after.dK_eq, solves_before.dK_eq),
        kinds=kinds,
    )


_MOST_POWER = 0.9  # of the distance, in a rate: from 1 on a crack would take for ever to pass
_X, _W = np.polynomial.legendre.leggauss(24)


def cycles_of_jump(
    old_solves: SolveHistory,
    exponent: float,
    rate: float,
    row: int,
    way: float,
    way_behind: float,
    power: float,
) -> tuple[float, float]:
    """Cycles of an end up to an interface at which K jumps, and from there to its place behind.

    Parameters
    ----------
    old_solves : SolveHistory
        Before it.
    exponent : float
        Of the law behind.
    rate : float, length/cycle
        At the place behind.
    row : int
        Of the end.
    way, way_behind : float, length
        From the last solve to the interface, and from there.
    power : float
        As of `InterfacesAhead`.

    Notes
    -----
    The rate is a power of the distance to the interface times one of the size of the crack. That
    of the size follows from the last two solves before it, on both sides.
    """
    last_solves, scale = old_solves.last_solves(2), float(old_solves.scale[row])
    size = scale + last_solves.sigma
    power_before, power_after = (
        float(np.clip(power * m, -_MOST_POWER, _MOST_POWER))
        for m in (old_solves.exponent, exponent)
    )
    distance = way + last_solves.sigma[-1] - last_solves.sigma
    regular_rate = last_solves.rate[:, row] / distance**power_before
    growth = 0.0
    if len(size) > 1 and regular_rate.min() > 0:
        growth = float(np.log(regular_rate[-1] / regular_rate[0]) / np.log(size[-1] / size[0]))
    size_there = size[-1] + way

    def time(length: float, at_end: float, power: float, side: float) -> float:
        # With u = (distance / length)^(1 - power) the power of the distance is gone.
        distance = length * (0.5 * (_X + 1)) ** (1 / (1 - power))
        factor = ((size_there + side * length) / (size_there + side * distance)) ** growth
        return float(length / (at_end * (1 - power)) * (0.5 * _W @ factor))

    first = time(way, float(last_solves.rate[-1, row]), power_before, -1.0)
    return first, time(way_behind, rate, power_after, 1.0)


def rates_behind(rule: GrowthRule, step: Step, interfaces: InterfacesAhead) -> Floats:
    """Rates `(n,)` of the last solve by the laws of the materials behind interfaces."""
    if getattr(rule.law, "ratio", None) == "nominal":  # K without contact is not known any more
        return solves_of(step)[1].rate[-1]
    problem, response = scene_of(rule, step)
    with collected_warnings([]):  # they were given at the solve
        return rates_by_law_of(rule, problem, response, interfaces.set_after)


def scene_of(rule: GrowthRule, step: Step) -> tuple[Problem, Response]:
    """The scene of a step, and K of its load states."""
    response = Response(step.levels or rule.cycle.load_states, best_K(step.sif))
    return replace(rule.problem, cracks=step.cracks), response


def rates_in_set(rule: GrowthRule, problem: Problem, response: Response, number: int) -> Floats:
    """Rates at the stations of a solve `(n,)` by the law of one material."""
    n = sum(len(sif.x) for sif in response.sif[0])
    with collected_warnings([]):
        return rates_by_law_of(rule, problem, response, np.full(n, number))


def cycles_across(
    size: float, way: float, way_behind: float, rates_before: Floats, rates_after: Floats
) -> Floats:
    """Cycles of an end before an interface at which only laws differ, and behind it `(2,)`.

    Parameters
    ----------
    size : float, length
        Of the crack at first.
    way, way_behind : float, length
        To the interface, and from there.
    rates_before, rates_after : (2,) arrays, length/cycle
        Rates at both ends of the step by the law before, and by that behind.
    """
    ends = size + np.array([0.0, way, way + way_behind])
    share = np.log(ends[1] / size) / np.log(ends[2] / size)
    rates_there = [rate[0] * (rate[1] / rate[0]) ** share for rate in (rates_before, rates_after)]
    return cycles_between(
        ends[:2], ends[1:], [rates_before[0], rates_there[1]], [rates_there[0], rates_after[1]]
    )


def warn_of_passages(
    rule: GrowthRule, step: Step, interfaces: InterfacesAhead, cycles: Floats
) -> None:
    """Say where ends pass interfaces, `cycles` `(n,)` after a step; nan where they do not."""
    stations, move = solves_of(step)[0], plan_of(step).move
    names = [name for name, _ in rule.problem.elasticity.named]
    for row in np.nonzero(np.isfinite(cycles))[0].tolist():
        name = step.end_name(int(stations.crack[row]), int(stations.front[row]))
        x = stations.x[row] + interfaces.way[row] * move[row] / np.linalg.norm(move[row])
        warn(
            f"{name} passes from {names[interfaces.set_before[row]]!r} into "
            f"{names[interfaces.set_after[row]]!r} at {coordinates(x.tolist())}, "
            f"N = {step.cycles + float(cycles[row]):.6g}"
        )


__all__ = [
    "InterfacesAhead",
    "Passage",
    "cycles_across",
    "cycles_of_jump",
    "interfaces_ahead",
    "mixed_solves",
    "passage",
    "rates_behind",
    "rates_in_set",
    "scene_of",
    "singularity_at_interface",
    "warn_of_passages",
    "whole_front_ahead",
]
