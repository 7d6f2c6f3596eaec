"""Where and when cracks join during growth."""

from collections.abc import Sequence
from dataclasses import dataclass

from xcrack.arrays import coordinates
from xcrack.errors import ProblemError
from xcrack.inputs import entries, number, numbers, shown, whole


@dataclass(frozen=True)
class Join:
    """Two cracks that became one, or a crack that runs into another one and ends there.

    Attributes
    ----------
    step : int
        Index of the first step in which they are joined.
    N : float
        Cycles at which they met.
    point : tuple of float, length
        Where they met first.
    cracks : (int, int)
        Their numbers in the step before, the smaller one first. Where two become one, that one has
        the smaller number, and the cracks behind the other move up by one.

    Raises
    ------
    ProblemError
        Parts that are not of these types.
    """

    step: int
    N: float
    point: tuple[float, ...]
    cracks: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "step", whole(self.step, "Join: step", least=0))
        object.__setattr__(self, "N", number(self.N, "Join: N", least=0))
        point = numbers(self.point, "Join: point", (None,))
        if len(point) not in (2, 3):
            raise ProblemError(f"Join: point = {shown(self.point)}: give 2 or 3 coordinates.")
        object.__setattr__(self, "point", tuple(point.tolist()))
        pair = entries(self.cracks, "Join: cracks")
        if len(pair) != 2:
            raise ProblemError(f"Join: cracks = {shown(self.cracks)}: give the numbers of two.")
        first, second = (whole(c, "Join: cracks", least=0) for c in pair)
        object.__setattr__(self, "cracks", (first, second))

    def __str__(self) -> str:
        first, second = self.cracks
        place = coordinates(self.point)
        return f"cracks {first} and {second} join at {place}, N = {self.N:.6g}"


def checked_joins(given: Sequence[Join], what: str) -> tuple[Join, ...]:
    """Joins as a tuple.

    Raises
    ------
    ProblemError
        One of them is no `Join`.
    """
    joins = entries(given, what)
    for join in joins:
        if not isinstance(join, Join):
            raise ProblemError(f"{what}: {shown(join)} is none: give a tuple of Join.")
    return joins


def numbers_after(n: int, joins: Sequence[Join], left: int) -> list[int]:
    """Number that each of n cracks has after joins that leave `left` cracks.

    Joins in which both cracks stay, because one ends on the other, come first.
    """
    number = list(range(n))
    for join in joins[len(joins) - (n - left) :]:
        one, other = sorted(number[c] for c in join.cracks)
        number = [one if c == other else c - (c > other) for c in number]
    return number


__all__ = ["Join", "checked_joins", "numbers_after"]
