"""Loads times a factor: a load state beside loads that stay as they are."""

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.scene.conditions import (
    BodyForce,
    CrackPressure,
    Displacement,
    InitialStress,
    Load,
    PointForce,
    Pressure,
    Traction,
)
from xcrack.scene.set_loads import Bearing, Resultant


@dataclass(frozen=True, eq=False)
class Level:
    """Load state of one factor: scaled loads, and steady ones.

    Attributes
    ----------
    factor : float
    loads : tuple of loads
    """

    factor: float
    loads: tuple[Load, ...]

    def __iter__(self) -> Iterator[Load]:
        return iter(self.loads)


def level(loads: Sequence[Load], steady: Sequence[Load], factor: float) -> Level:
    """The loads times a factor, with the steady ones."""
    return Level(factor, (*(scaled(load, factor) for load in loads), *steady))


def scaled(load: Load, factor: float) -> Load:
    """A load times a factor; an initial stress stays as it is."""
    match load:
        case InitialStress():
            return load
        case PointForce():
            return replace(load, force=np.asarray(load.force) * factor)
        case Bearing() | Resultant():  # the tractions: a pin that pulls is what factors mean here
            return replace(load, factor=load.factor * factor)
        case Displacement() | Traction() | Pressure() | BodyForce() | CrackPressure():
            return replace(load, value=_times(load.value, factor))
    raise AssertionError(load)


def _times(value: Any, factor: float) -> Any:
    """A value or a function of place times a factor; None, a component that is free, stays so."""
    if callable(value):
        return _times_of(value, factor)
    if isinstance(value, tuple | list):
        return tuple(None if part is None else _times(part, factor) for part in value)
    return value * factor


def _times_of(function: Callable[..., Any], factor: float) -> Callable[..., Any]:
    @functools.wraps(function)
    def times(*arguments: Any) -> Any:
        return np.asarray(function(*arguments)) * factor

    return times


__all__ = ["Level", "level", "scaled"]
