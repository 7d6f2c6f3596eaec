"""Cracks that meet during growth: the choice between 2D and 3D, and what they become."""

from collections.abc import Callable, Sequence

from xcrack.crack.crack import Crack
from xcrack.growth import joins_2d, joins_3d
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled
from xcrack.growth.step import Arriving, Joined, Step


def joined(run: GrowthRule, last: Step, cracks: Sequence[Crack]) -> Joined | None:
    """Cracks in 3D that meet within the advance after a step, joined; None where none do.

    In 2D tips have met in the advance itself.

    Parameters
    ----------
    run : GrowthRule
    last : Step
    cracks : sequence of Crack
        After the whole advance.

    Returns
    -------
    Joined or None

    Raises
    ------
    GeometryError
        They meet, and what they would become cannot be made, or a load belongs to one of them.
    """
    return _JOINED[run.problem.mesh.dim](run, last, cracks)


def arriving(run: GrowthRule, last: Step, met: Joined) -> list[Arriving]:
    """What comes to the boundary in an advance in which cracks join, numbered as before it."""
    return joins_3d.arriving(run, last, met)


def settled(run: GrowthRule, last: Step, seen: Evaluation, met: Joined) -> Settled:
    """What the step means in which cracks have joined."""
    return joins_3d.settled(run, last, seen, met)


_JOINED: dict[int, Callable[[GrowthRule, Step, Sequence[Crack]], Joined | None]] = {
    2: joins_2d.joined,
    3: joins_3d.joined,
}


__all__ = ["arriving", "joined", "settled"]
