"""What cracks have become that met during an advance."""

from dataclasses import dataclass

from xcrack.crack.crack import Crack
from xcrack.growth.steps.joins import Join


@dataclass(frozen=True, eq=False)
class Joined:
    """Cracks after an advance in which some of them have joined.

    Attributes
    ----------
    cracks : tuple of Crack
        Those that are left, not placed again.
    apart : tuple of Crack
        The same before they joined.
    joins : tuple of Join
    way : float
        Share of the whole advance that they have come.
    cycles : float
        Of the advance.
    error : float
        Estimated error of these.
    """

    cracks: tuple[Crack, ...]
    apart: tuple[Crack, ...]
    joins: tuple[Join, ...]
    way: float
    cycles: float
    error: float


__all__ = ["Joined"]
