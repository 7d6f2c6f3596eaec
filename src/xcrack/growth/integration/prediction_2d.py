"""The next step of 2D cracks as the last two solves see it, up to where tips meet other cracks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.crack.crack import Crack
from xcrack.growth.integration.envelope import Growth
from xcrack.growth.integration.halving import halved
from xcrack.growth.integration.reach import growth_until, reach_of
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.trail import Trail
from xcrack.growth.tracking.meeting_2d import AHEAD, Meeting, joined, meetings
from xcrack.growth.tracking.tips_2d import ending_at, faces_of
from xcrack.mesh.locate import cell_sizes


@dataclass(frozen=True, eq=False)
class Prediction:
    """The next step as the last two solves see it.

    Attributes
    ----------
    length : float, length
        Of σ.
    stops : bool
        Whether all growth is seen to stop at its end.
    growth : Growth
    place : (n, 2) array, length
        Where the tips come to.
    cracks : list of Crack
    moves : (n,) array of bool
        Tips that move in the mesh; the others wait.
    size : (n,) array, length
        Of the cells at the tips before.
    asked : float, length
        Of σ, where nothing is met.
    apart : list of Crack
        The cracks before tips that meet others have ended or joined there.
    """

    length: float
    stops: bool
    growth: Growth
    place: Floats
    cracks: list[Crack]
    moves: Bools
    size: Floats
    asked: float
    apart: list[Crack]


def predict(run: Run, cracks: Sequence[Crack], trail: Trail) -> Prediction:
    """Where the last two solves lead; from a first one straight on, at its rates."""
    size = cell_sizes(run.problem.mesh, trail.place)
    reach = reach_of(run, trail)
    place = trail.place + reach.growth.move
    after, moves = ending_at(cracks, place, trail.grown, size)
    ahead = Prediction(
        reach.length, reach.stops, reach.growth, place, after, moves, size, reach.length, after
    )
    # Where plastic zones end the run, they do so before the tips meet.
    met = meetings(after, run.problem.mesh) if run.link_up is None else []
    return _met(run, cracks, trail, ahead, met) if met else ahead


def _met(
    run: Run, cracks: Sequence[Crack], trail: Trail, ahead: Prediction, met: list[Meeting]
) -> Prediction:
    """A step that ends when the first tip meets another crack, and the cracks joined there."""
    faces = faces_of(ahead.apart)
    along = np.stack([np.cos(faces.direction), np.sin(faces.direction)], axis=1)

    def left(own: Meeting, length: float) -> float:
        place = trail.place + growth_until(run, trail, length).move
        to = own.x if own.other < 0 else place[own.other]
        return float((to - place[own.tip]) @ along[own.tip])

    most = ahead.length + max(AHEAD * own.size for own in met)
    arrival = [_arrival(partial(left, own), most) for own in met]
    first = min(arrival)
    if first == np.inf and not any(own.soon for own in met):
        return ahead
    length = ahead.length if first == np.inf else first
    growth = growth_until(run, trail, length)
    place = trail.place + growth.move
    apart, moves = ending_at(cracks, place, trail.grown, ahead.size)
    arrived = {own.tip for own, when in zip(met, arrival) if when <= length}
    now = [
        own
        for own in meetings(apart, run.problem.mesh, 2 * AHEAD)
        if own.soon or own.tip in arrived
    ]
    if not now:
        return ahead
    whole = joined(apart, moves.tolist(), now)
    return replace(
        ahead, length=length, growth=growth, place=place, cracks=whole, moves=moves, apart=apart
    )


def _arrival(left: Callable[[float], float], most: float) -> float:
    """Length of σ after which nothing is left of a way; inf where that takes too long."""
    if left(most) > 0:
        return np.inf
    return halved(lambda length: left(length) > 0, most)[1]


__all__ = ["Prediction", "predict"]
