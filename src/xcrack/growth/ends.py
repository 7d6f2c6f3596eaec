"""Why growth ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, log

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import XcrackError, collected_warnings
from xcrack.crack.stations import stations_of
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.cycle import Cycle
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import law_size
from xcrack.growth.step import (
    Arrival,
    Step,
    growth_directions,
    largest_K_eq,
    place_name,
    plan_of,
    solves_of,
)
from xcrack.growth.validity import ahead_of
from xcrack.mesh.locate import cell_extents
from xcrack.sif.sif import at_stations

# Ligaments in front of the tips of 2D cracks, and whether plastic zones fill them.

_Place = tuple[int, int]


@dataclass(frozen=True)
class Ligament:
    """What lies between a tip and what it heads for.

    Attributes
    ----------
    length : float
    tip : (int, int)
        Crack and number.
    second_tip : (int, int), optional
        The other tip, where both head for each other.
    name : str
        Facet set or crack that the tip heads for; empty between two tips.
    """

    length: float
    tip: _Place
    second_tip: _Place | None
    name: str


def ligaments(rule: GrowthRule, step: Step) -> list[Ligament]:
    """Ligaments of all tips: straight ahead to a crack or the boundary, and between two tips.

    Two tips have one between them where each lies ahead of the other.
    """
    tips = [(c, j) for c in range(len(step.cracks)) for j in range(len(step.sif[0][c].x))]
    x = np.array([step.sif[0][c].x[j] for c, j in tips]).reshape(-1, 2)
    directions = np.array([growth_directions(step, c)[j] for c, j in tips]).reshape(-1, 2)
    result = []
    for i, tip in enumerate(tips):
        obstacle = ahead_of(x[i], directions[i], tip[0], step.cracks, rule.problem.mesh)
        if obstacle is not None:
            result.append(Ligament(obstacle.length, tip, None, obstacle.label))
        for k in range(i):
            gap = x[k] - x[i]
            if gap @ directions[i] > 0 > gap @ directions[k]:
                result.append(Ligament(float(np.linalg.norm(gap)), tip, tips[k], ""))
    return result


def ligament_yields(rule: GrowthRule, step: Step) -> str:
    """Which ligament the plastic zones of the most severe state fill; empty where none does.

    Zones of two tips add up over the ligament between them (Swift 1994, Int. J. Fatigue 16, 75,
    from memory);
    the zone of one tip fills what lies ahead of it.
    """
    filled_shares = _filled_shares(rule, step)
    if not filled_shares:
        return ""
    share, ligament = max(filled_shares, key=lambda pair: pair[0])
    if share < 1:
        return ""
    zone = [_zones(rule, step, c) for c in range(len(step.cracks))]

    def size(place: _Place) -> float:
        return float(zone[place[0]][place[1]])

    first = f"of {place_name(step, *ligament.tip)}, {size(ligament.tip):.4g}"
    if ligament.second_tip is None:
        label = f"the plastic zone {first}, fills the {ligament.length:.4g} to {ligament.name}"
    else:
        label = (
            f"the plastic zones {first}, and of {place_name(step, *ligament.second_tip)}, "
            f"{size(ligament.second_tip):.4g}, fill the {ligament.length:.4g} between them"
        )
    return f"ligament yield: {label}"


def _filled_shares(rule: GrowthRule, step: Step) -> list[tuple[float, Ligament]]:
    """Ligaments, and the share of each that plastic zones fill; none without a rule for them."""
    if rule.link_up is None or step.has_left:
        return []
    zone = [_zones(rule, step, c) for c in range(len(step.cracks))]
    result = []
    for ligament in ligaments(rule, step):
        c, j = ligament.tip
        size = float(zone[c][j])
        if ligament.second_tip is not None:
            size += float(zone[ligament.second_tip[0]][ligament.second_tip[1]])
        result.append((size / ligament.length, ligament))
    return result


def _zones(rule: GrowthRule, step: Step, c: int) -> Floats:
    assert rule.link_up is not None
    K_eq = largest_K_eq(step, c, rule.problem.elasticity.poisson_at(step.sif[0][c].x))
    zone = call_function(rule.link_up, f"link_up at step {step.index}", K_eq)
    return numbers(zone, "what link_up returned", K_eq.shape)


_SAME = 1e-9  # of the largest K, or of a length: what does not differ
# A turn by more puts K 0.1 % off where the advance is 0.3 cells, 0.3 % at 20 degrees (measured).
_TURN = np.radians(10.0)


# Reasons for which a run ends at a step: each is asked in turn, and is empty where it goes on.


def no_end_is_left(rule: GrowthRule, step: Step) -> str:
    """All tips or fronts have left the body, or joined."""
    if not step.has_left:
        return ""
    if step.joins and not step.arrivals:
        return "no tip is left: " + "; ".join(map(str, step.joins))
    return left_the_body(rule, step.arrivals)


def law_reaches_toughness(rule: GrowthRule, step: Step) -> str:
    """The law returns an infinite rate."""
    del rule
    for c, rate in enumerate(step.rate):
        for j in np.nonzero(np.isinf(rate))[0].tolist():
            return (
                f"K_c reached: the law returned da/dN = inf for dK_eq = {step.dK_eq[c][j]:.6g}, "
                f"R = {step.R[c][j]:.6g} at {place_name(step, c, j)}"
            )
    return ""


def toughness_is_reached(rule: GrowthRule, step: Step) -> str:
    """K_eq of some state reaches K_c of the material there."""
    if rule.toughness is None:
        return ""
    for c in range(len(step.cracks)):
        K_eq = largest_K_eq(step, c, rule.problem.elasticity.poisson_at(step.sif[0][c].x))
        K_c = rule.toughness_at(step.sif[0][c].x)
        for j in np.nonzero(K_eq >= K_c)[0].tolist():
            place = place_name(step, c, j)
            return f"K_c reached: K_eq = {K_eq[j]:.6g} >= {K_c[j]:.6g} at {place}"
    return ""


def interface_is_passed(rule: GrowthRule, step: Step) -> str:
    """A tip is in a material in which none was at the start, and the run stops there."""
    elasticity = rule.problem.elasticity
    if not rule.stop_at_interface or not rule.has_interfaces:
        return ""
    start = stations_of(rule.problem.placed, rule.problem.mesh).x
    start_names = set(elasticity.names_at(start).tolist())
    for c in range(len(step.cracks)):
        names = elasticity.names_at(step.sif[0][c].x)
        for j, name in enumerate(names.tolist()):
            if name not in start_names:
                words = " and ".join(map(repr, sorted(start_names)))
                place = place_name(step, c, j)
                return f"interface passed: {place} has come from {words} into {name!r}"
    return ""


def limit_is_reached(rule: GrowthRule, step: Step) -> str:
    """As many cycles or steps as asked for, or a crack as long."""
    if rule.max_cycles is not None and step.cycles >= rule.max_cycles:
        return f"max_cycles = {rule.max_cycles:.6g} reached: {step.cycles:.6g} cycles"
    if rule.max_size is not None and size_beyond(rule, step.sizes) >= -_SAME:
        c = int(np.argmax(step.sizes))
        return f"max_size = {rule.max_size:.6g} reached: crack {c} is {step.sizes[c]:.6g} long"
    if rule.max_steps is not None and step.index + 1 >= rule.max_steps:
        return f"max_steps = {rule.max_steps} reached"
    return ""


def size_beyond(rule: GrowthRule, sizes: Sequence[float]) -> float:
    """Share by which the largest of some cracks is longer than asked for."""
    return -inf if rule.max_size is None else max(sizes, default=0.0) / rule.max_size - 1


def nothing_grows(rule: GrowthRule, step: Step) -> str:
    """No rate is positive."""
    if any((r > 0).any() for r in step.rate):
        return ""
    if any((r > 0).any() for r in step.law_rate):
        return f"rate is zero: dK_eq is below the threshold {rule.threshold:.6g} at every tip"
    return "rate is zero at every tip" + _same_states(step)


ENDS: tuple[Callable[[GrowthRule, Step], str], ...] = (
    no_end_is_left,
    law_reaches_toughness,
    toughness_is_reached,
    ligament_yields,
    interface_is_passed,
    limit_is_reached,
    nothing_grows,
)


def end_of_run(rule: GrowthRule, step: Step) -> str:
    """Why a run ends at a step; empty where it goes on."""
    return next(filter(None, (end(rule, step) for end in ENDS)), "")


# How far a step is beyond ends that come within one: the last step is made as long as that.


def cycles_beyond(rule: GrowthRule, step: Step) -> float:
    """Cycles over those asked for."""
    return -inf if rule.max_cycles is None else step.cycles / rule.max_cycles - 1


def K_beyond(rule: GrowthRule, step: Step) -> float:
    """Logarithm of the largest K_eq over K_c of the material there."""
    if rule.toughness is None or step.has_left:
        return -inf
    largest_share = 0.0
    for c, sif in enumerate(step.sif[0]):
        nu = rule.problem.elasticity.poisson_at(sif.x)
        share = largest_K_eq(step, c, nu) / rule.toughness_at(sif.x)
        largest_share = max(largest_share, float(share.max(initial=0.0)))
    return log(largest_share) if largest_share > 0 else -inf


def law_beyond(rule: GrowthRule, step: Step) -> float:
    """Logarithm of the largest range over the one from which on the law returns inf.

    Where cycles of several ranges count, only its sign is known.
    """
    if step.has_left or not isinstance(rule.cycle, Cycle):
        return 1.0 if law_reaches_toughness(rule, step) else -1.0
    dK_eq, R = np.concatenate(step.dK_eq), np.concatenate(step.R)
    f_min, f_max = -_FAR, _FAR
    x = [sif.x for sif in step.sif[0]]
    names = rule.problem.elasticity.names_at(np.concatenate(x))
    dim = rule.problem.mesh.dim
    sizes = [law_size(dim, a, len(of_crack)) for a, of_crack in zip(step.sizes, x, strict=True)]
    a = np.concatenate(sizes)

    def breaks(factor: float) -> bool:
        with collected_warnings([]):
            rate = evaluate_law(rule.law, np.exp(factor) * dK_eq, R, 0, a=a, material=names)
            return bool(np.isinf(rate).any())

    try:
        if not breaks(f_max):
            return -_FAR
        for _ in range(_HALVINGS):
            middle = 0.5 * (f_min + f_max)
            f_min, f_max = (f_min, middle) if breaks(middle) else (middle, f_max)
    except XcrackError:  # a table ends there
        return 1.0 if law_reaches_toughness(rule, step) else -1.0
    return -f_max


def zones_beyond(rule: GrowthRule, step: Step) -> float:
    """Logarithm of the share of a ligament that plastic zones fill."""
    share = max((share for share, _ in _filled_shares(rule, step)), default=0.0)
    return log(share) if share > 0 else -inf


_FAR, _HALVINGS = 1.0, 40  # of the logarithm of a range
WITHIN: tuple[Callable[[GrowthRule, Step], float], ...] = (cycles_beyond, K_beyond, zones_beyond)


def beyond_end(rule: GrowthRule, step: Step, is_break: bool) -> float:
    """How far a step is beyond the first of these ends: 0 is there, negative before.

    `is_break` says that the law returns inf within the step: elsewhere it is not asked.
    """
    ends = (*WITHIN, law_beyond) if is_break else WITHIN
    return max(end_rule(rule, step) for end_rule in ends)


def _same_states(step: Step) -> str:
    """What to say where K is the same in all load states; empty where it is not, or is zero."""
    K = at_stations(step.sif, "K")
    size = float(np.abs(K).max(initial=0.0))
    if len(K) < 2 or size == 0 or float(np.ptp(K, axis=0).max(initial=0.0)) > _SAME * size:
        return ""
    return (
        f": K is the same in all {len(K)} load states of the cycle. An initial stress or a "
        "temperature among the loads of the problem acts in each of them: leave it out there if "
        "the states give others."
    )


def left_the_body(rule: GrowthRule, arrivals: Sequence[Arrival]) -> str:
    """Why a run ends whose last tips or fronts have left the body."""
    end = "tip" if rule.problem.mesh.dim == 2 else "front"
    return ": ".join([f"{end} left the body", "; ".join(map(str, arrivals))]).removesuffix(": ")


# Plans that cannot be taken.


def refusal_of(rule: GrowthRule, step: Step) -> str:
    """Why the plan of a step cannot be taken; empty where it can."""
    plan = plan_of(step)
    if not plan.limit:
        return ""
    if plan.limit == "geometry":
        return cannot_go_on(step, plan.refusal)
    place = place_name(step, *driving_place(step))
    if plan.limit == "short":
        remedy = "cycles" if rule.da is None else "da"
        return (
            f"the advance {plan.largest:.4g} at {place} is below a tenth of the cell there (cell "
            f"size {plan.cell[plan.tip]:.4g}): the mesh cannot see it. Take a larger {remedy} or a "
            "finer mesh around the tip."
        )
    label = "it falls to zero"
    if rule.threshold > 0:
        label = f"dK_eq falls below the threshold {rule.threshold:.6g}"
    if rule.retardation is not None:
        label += ", or retardation all but stops it,"
    return f"rate is zero: {label} within a tenth of a cell at every tip, as of {place}"


def cannot_go_on(step: Step, reason: object) -> str:
    """Why a run ends whose cracks cannot be advanced, or solved."""
    return f"the cracks cannot go on after step {step.index}, N = {step.cycles:.6g}: {reason}"


def driving_place(step: Step) -> tuple[int, int]:
    """Crack and number of the solved station that is nearest to the one that drives the plan."""
    stations, row = solves_of(step)[0], plan_of(step).tip
    c = int(stations.crack[row])
    distance = np.linalg.norm(step.sif[0][c].x - stations.x[row], axis=1)
    return c, int(np.argmin(distance))


def short_kink(rule: GrowthRule, step: Step) -> str:
    """What to warn of where the fastest tip turns within one cell; empty where it does not."""
    c, j = driving_place(step)
    da, angle = step.da[c][j], step.angle[c][j]
    direction = growth_directions(step, c)[[j]]
    middle = step.sif[0][c].x[[j]] + 0.5 * da * direction
    extent = float(cell_extents(rule.problem.mesh, middle, direction)[0])
    if da >= extent or abs(angle) <= _TURN:
        return ""
    place = place_name(step, c, j)
    return (
        f"the advance {da:.4g} at {place} is below one cell along the path ({extent:.4g}) and "
        f"turns by {np.degrees(angle):.3g} degrees: K of the next step feels "
        "the kink through one cell only. Take a larger da or a finer mesh around the tip."
    )


__all__ = [
    "ENDS",
    "WITHIN",
    "Ligament",
    "beyond_end",
    "cannot_go_on",
    "driving_place",
    "end_of_run",
    "law_reaches_toughness",
    "left_the_body",
    "ligaments",
    "nothing_grows",
    "refusal_of",
    "short_kink",
    "size_beyond",
]
