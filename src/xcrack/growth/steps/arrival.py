"""A tip or a front that reaches the boundary of the body."""

from dataclasses import dataclass

from xcrack.arrays import coordinates


@dataclass(frozen=True)
class Arrival:
    """Where and when a tip, or a front, came to the boundary.

    Attributes
    ----------
    crack : int
    tip : int
        Number of the tip before the step; in 3D of the place along the front that came first, or
        last where the whole front has left the body.
    x : (d,) tuple, length
        Place on the boundary.
    name : str
        Smallest facet set there; "boundary" where none has a name.
    ligament : float, length
        From the last solved step to there, along a straight line.
    cycles : float
        Cycles until then: the ligament at rates that the last solves predict.
    """

    crack: int
    tip: int
    x: tuple[float, ...]
    name: str
    ligament: float
    cycles: float

    def __str__(self) -> str:
        return (
            f"crack {self.crack} reached {self.name!r} at {coordinates(self.x)}, "
            f"N = {self.cycles:.6g} (the last {self.ligament:.4g} at predicted rates)"
        )


@dataclass(frozen=True)
class Arriving:
    """An arrival during an advance that is not solved yet.

    Attributes
    ----------
    crack, tip, x, name, ligament
        As of `Arrival`.
    share : float
        Part of the advance until then; above 1 where the boundary is a little farther.
    """

    crack: int
    tip: int
    x: tuple[float, ...]
    name: str
    ligament: float
    share: float


__all__ = ["Arrival", "Arriving"]
