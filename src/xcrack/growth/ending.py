"""Why growth ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, coordinates
from xcrack.base.checks import call_function, numbers
from xcrack.fatigue.criteria import clipped_K, equivalent_K
from xcrack.fem.system import discretise
from xcrack.growth.follow import following, place_name
from xcrack.growth.joins_2d import new_ends, new_unions
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Advance, Arrival, Join, Step, directions, memory_of
from xcrack.growth.validity import ahead_of
from xcrack.linalg.rigid_motion import pieces
from xcrack.mesh.locate import cell_extents
from xcrack.model.problem import Problem

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
    other : (int, int), optional
        The other tip, where both head for each other.
    name : str
        Facet set or crack that the tip heads for; empty between two tips.
    """

    length: float
    tip: _Place
    other: _Place | None
    name: str


def ligaments(run: GrowthRule, step: Step) -> list[Ligament]:
    """Ligaments of all tips: straight ahead to a crack or the boundary, and between two tips.

    Two tips have one between them where each lies ahead of the other.
    """
    tips = [(c, j) for c in range(len(step.cracks)) for j in range(len(step.sif[0][c].x))]
    x = np.array([step.sif[0][c].x[j] for c, j in tips]).reshape(-1, 2)
    ahead = np.array([directions(step, c)[j] for c, j in tips]).reshape(-1, 2)
    result = []
    for i, tip in enumerate(tips):
        met = ahead_of(x[i], ahead[i], tip[0], step.cracks, run.problem.mesh)
        if met is not None:
            result.append(Ligament(met.length, tip, None, met.label))
        for k in range(i):
            gap = x[k] - x[i]
            if gap @ ahead[i] > 0 > gap @ ahead[k]:
                result.append(Ligament(float(np.linalg.norm(gap)), tip, tips[k], ""))
    return result


def yielded(run: GrowthRule, step: Step) -> str:
    """Which ligament the plastic zones of the most severe state fill; empty where none does.

    Zones of two tips add up over the ligament between them (Swift 1994, Int. J. Fatigue 16, 75,
    from memory);
    the zone of one tip fills what lies ahead of it.
    """
    if run.link_up is None:
        return ""
    zone = [_zones(run.link_up, run, step, c) for c in range(len(step.cracks))]

    def size(place: _Place | None) -> float:
        return 0.0 if place is None else float(zone[place[0]][place[1]])

    known = ligaments(run, step)
    full = [(size(one.tip) + size(one.other)) / one.length for one in known]
    if not full or max(full) < 1:
        return ""
    one = known[int(np.argmax(full))]
    first = f"of {place_name(run.problem.mesh, step, *one.tip)}, {size(one.tip):.4g}"
    if one.other is None:
        what = f"the plastic zone {first}, fills the {one.length:.4g} to {one.name}"
    else:
        what = (
            f"the plastic zones {first}, and of {place_name(run.problem.mesh, step, *one.other)}, "
            f"{size(one.other):.4g}, fill the {one.length:.4g} between them"
        )
    return f"ligament yield: {what}"


def _zones(link_up: Callable[..., Any], run: GrowthRule, step: Step, c: int) -> Floats:
    K = clipped_K(np.stack([state[c].K for state in step.sif]))
    K_eq = equivalent_K(K, step.angle[c], run.problem.elasticity.poisson).max(axis=0, initial=0.0)
    zone = call_function(link_up, f"link_up at step {step.index}", K_eq)
    return numbers(zone, "what link_up returned", K_eq.shape)


_SAME = 1e-9  # of the largest K: states that do not differ
# A turn by more puts K 0.1 % off where the advance is 0.3 cells, 0.3 % at 20 degrees (measured).
_TURN = np.radians(10.0)


def end_at(run: GrowthRule, step: Step) -> str:
    """Why growth ends at this step; empty where it goes on."""
    if step.has_left and step.joins and not step.arrivals:
        return "no tip is left: " + "; ".join(map(str, step.joins))
    if step.has_left:
        return left_the_body(run, step.arrivals)
    for c, rate in enumerate(step.rate):
        for j in np.nonzero(np.isinf(rate))[0].tolist():
            return (
                f"K_c reached: the law returned da/dN = inf for dK_eq = {step.dK_eq[c][j]:.6g}, "
                f"R = {step.R[c][j]:.6g} at {place_name(run.problem.mesh, step, c, j)}"
            )
    K_c = run.toughness
    if K_c is not None:
        for c in range(len(step.cracks)):
            K = clipped_K(np.stack([state[c].K for state in step.sif]))
            K_eq = equivalent_K(K, step.angle[c], run.problem.elasticity.poisson).max(axis=0)
            for j in np.nonzero(K_eq >= K_c)[0].tolist():
                place = place_name(run.problem.mesh, step, c, j)
                return f"K_c reached: K_eq = {K_eq[j]:.6g} >= {K_c:.6g} at {place}"
    full = yielded(run, step)
    if full:
        return full
    if run.max_cycles is not None and step.cycles >= run.max_cycles:
        return f"max_cycles = {run.max_cycles:.6g} reached: {step.cycles:.6g} cycles"
    if run.max_steps is not None and step.index + 1 >= run.max_steps:
        return f"max_steps = {run.max_steps} reached"
    if not any((r > 0).any() for r in step.rate):
        if any((r > 0).any() for r in memory_of(step).law_rate):
            return f"rate is zero: dK_eq is below the threshold {run.threshold:.6g} at every tip"
        return "rate is zero at every tip" + _same_states(step)
    return ""


def _same_states(step: Step) -> str:
    """What to say where K is the same in all load states; empty where it is not, or is zero."""
    K = np.stack([np.concatenate([sif.K for sif in state]) for state in step.sif])
    size = float(np.abs(K).max(initial=0.0))
    if len(K) < 2 or size == 0 or float(np.ptp(K, axis=0).max(initial=0.0)) > _SAME * size:
        return ""
    return (
        f": K is the same in all {len(K)} load states of the cycle. An initial stress or a "
        "temperature among the loads of the problem acts in each of them: leave it out there if "
        "the states give others."
    )


def falls_to_zero(run: GrowthRule, step: Step, plan: Advance) -> str:
    """Why a run ends in which all growth is seen to stop within a tenth of a cell."""
    what = (
        f"dK_eq falls below the threshold {run.threshold:.6g}"
        if run.threshold > 0
        else "it falls to zero"
    )
    if run.retardation is not None:
        what += ", or retardation all but stops it,"
    return (
        f"rate is zero: {what} within a tenth of a cell at every tip, as of "
        f"{place_name(run.problem.mesh, step, *plan.tip)}"
    )


def too_short(run: GrowthRule, step: Step, plan: Advance) -> str:
    """Why a run ends whose advance is below a tenth of a cell."""
    remedy = "cycles" if run.da is None else "da"
    place = place_name(run.problem.mesh, step, *plan.tip)
    return (
        f"the advance {plan.largest:.4g} at {place} is below a tenth of the cell there (cell size "
        f"{plan.size:.4g}): the mesh cannot see it. Take a larger {remedy} or a finer mesh around "
        "the tip."
    )


def short_kink(run: GrowthRule, step: Step, plan: Advance) -> str:
    """What to warn of where the fastest tip turns within one cell; empty where it does not."""
    c, j = plan.tip
    da, angle = step.da[c][j], step.angle[c][j]
    ahead = directions(step, c)[[j]]
    middle = step.sif[0][c].x[[j]] + 0.5 * da * ahead
    extent = float(cell_extents(run.problem.mesh, middle, ahead)[0])
    if da >= extent or abs(angle) <= _TURN:
        return ""
    place = place_name(run.problem.mesh, step, c, j)
    return (
        f"the advance {da:.4g} at {place} is below one cell along the path ({extent:.4g}) and "
        f"turns by {np.degrees(angle):.3g} degrees: K of the next step feels "
        "the kink through one cell only. Take a larger da or a finer mesh around the tip."
    )


def left_the_body(run: GrowthRule, arrivals: Sequence[Arrival]) -> str:
    """Why a run ends whose last tips or fronts have left the body."""
    end = following(run.problem.mesh).END
    return ": ".join([f"{end} left the body", "; ".join(map(str, arrivals))]).removesuffix(": ")


def joins_of(step: Step, problem: Problem, cycles: float) -> tuple[Join, ...]:
    """Cracks that meet at the end of an advance of so many cycles after a step, in 2D."""
    N, index = step.cycles + cycles, step.index + 1
    ends = new_ends(step.corrected, problem.placed)
    unions = new_unions(step.corrected, problem.placed)
    return tuple(
        [Join(index, N, tuple(x.tolist()), (min(c, on), max(c, on))) for c, on, x in ends]
        + [Join(index, N, tuple(x.tolist()), pair) for pair, x in unions]
    )


def cut_off(step: Step, problem: Problem, joins: Sequence[Join]) -> str:
    """Why a run ends in which cracks that met cut a piece off; empty where they do not."""
    space, _ = discretise(problem)
    piece, n, share = pieces(space)
    if n < 2 or n <= _pieces_before(step):
        return ""
    k = int(np.argmin(share))
    x = coordinates(space.node_points[piece == k].mean(axis=0))
    words = "; ".join(map(str, joins))
    return f"{words}: the piece around {x}, {100 * share[k]:.3g} % of the body, is cut off"


def _pieces_before(step: Step) -> int:
    return pieces(step.solutions[0].space)[1] if step.solutions else 1


# How fast the last ligament between two coplanar fronts breaks.

_A, _P, _B, _Q = 0.0977222, 0.575392, 3.22635, 1.32721  # fitted to 0.2 % from x = 0.03 to 4
_POINTS = 48


def amplification(x: Floats) -> Floats:
    """K of a penny that faces an equal one at a gap of x radii, over K of one alone."""
    return np.asarray(1 + _A * x**-_P / (1 + _B * x**_Q))


def part_of_time(x: float, exponent: float) -> float:
    """Time in which a gap of x radii closes, over the time at the rate of its beginning.

    Parameters
    ----------
    x : float
        Gap over radius.
    exponent : float
        Of the growth law.

    Returns
    -------
    float
        Below 1: the mean of (f(x)/f)^m over the gap, f the amplification.

    Examples
    --------
    >>> print(round(part_of_time(0.5, 3.0), 2), round(part_of_time(4.0, 3.0), 2))
    0.73 0.93
    """
    u, weight = np.polynomial.legendre.leggauss(_POINTS)
    u = (u + 1) / 2
    # Points crowd towards the end of the gap, where K is singular.
    ratio = (amplification(np.array([x])) / amplification(x * u**2)) ** exponent
    return float((weight / 2 * 2 * u * ratio).sum())


__all__ = [
    "Ligament",
    "amplification",
    "cut_off",
    "end_at",
    "falls_to_zero",
    "joins_of",
    "left_the_body",
    "ligaments",
    "part_of_time",
    "short_kink",
    "too_short",
    "yielded",
]
