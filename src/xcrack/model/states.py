"""Load states: which loads act in one, and how large each is."""

from collections.abc import Iterator
from dataclasses import dataclass

from xcrack.model.loads import Load


@dataclass(frozen=True, eq=False)
class LoadLevel:
    """A state in which the loads of a problem are scaled, beside steady ones.

    What supports impose is steady too.

    Attributes
    ----------
    factor : float
    steady : tuple of Load
    """

    factor: float
    steady: tuple[Load, ...] = ()


@dataclass(frozen=True, eq=False)
class LoadState:
    """Loads of a state, with the factor of each.

    Attributes
    ----------
    loads : tuple of Load
    factors : tuple of float
        1 for a steady load.
    factor : float
        Of the displacements that supports impose.
    """

    loads: tuple[Load, ...]
    factors: tuple[float, ...]
    factor: float

    def __iter__(self) -> Iterator[tuple[Load, float]]:
        return zip(self.loads, self.factors, strict=True)


def scaled_state(loads: tuple[Load, ...], factor: float) -> LoadState:
    """The loads times a factor, steady ones as they are."""
    return LoadState(loads, tuple(1.0 if load.is_steady else factor for load in loads), factor)


__all__ = ["LoadLevel", "LoadState", "scaled_state"]
