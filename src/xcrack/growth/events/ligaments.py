"""Ligaments in front of the tips of 2D cracks, and whether plastic zones fill them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.arrays import Floats
from xcrack.crack.lines import crossing_points
from xcrack.growth.directions.criteria import clipped, equivalent_K
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Step, directions
from xcrack.growth.tracking.follow import place_name
from xcrack.growth.tracking.follow_2d import exit_ahead
from xcrack.inputs import called, numbers

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


def ligaments(run: Run, step: Step) -> list[Ligament]:
    """Ligaments of all tips: straight ahead to a crack or the boundary, and between two tips.

    Two tips have one between them where each lies ahead of the other.
    """
    tips = [(c, j) for c in range(len(step.cracks)) for j in range(len(step.sif[0][c].x))]
    x = np.array([step.sif[0][c].x[j] for c, j in tips]).reshape(-1, 2)
    ahead = np.array([directions(step, c)[j] for c, j in tips]).reshape(-1, 2)
    result = []
    for i, tip in enumerate(tips):
        hit = exit_ahead(x[i], ahead[i], run.problem.mesh)
        if hit is not None:
            way = np.stack([x[i], hit[0]])
            met = [(float(np.linalg.norm(hit[0] - x[i])), repr(hit[1]))]
            for c, crack in enumerate(step.cracks):
                crossed = crossing_points(way, crack.points) if c != tip[0] else way[:0]
                met += [(float(np.linalg.norm(y - x[i])), f"crack {c}") for y in crossed]
            length, name = min(met)
            result.append(Ligament(length, tip, None, name))
        for k in range(i):
            gap = x[k] - x[i]
            if gap @ ahead[i] > 0 > gap @ ahead[k]:
                result.append(Ligament(float(np.linalg.norm(gap)), tip, tips[k], ""))
    return result


def yielded(run: Run, step: Step) -> str:
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


def _zones(link_up: Callable[..., Any], run: Run, step: Step, c: int) -> Floats:
    K = clipped(np.stack([state[c].K for state in step.sif]))
    K_eq = equivalent_K(K, step.angle[c], run.problem.material.nu).max(axis=0, initial=0.0)
    zone = called(link_up, f"link_up at step {step.index}", K_eq)
    return numbers(zone, "what link_up returned", K_eq.shape)


__all__ = ["Ligament", "ligaments", "yielded"]
