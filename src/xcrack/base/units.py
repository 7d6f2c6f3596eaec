"""Dimensions, and numbers with units such as "210 GPa" or "40 MPa*sqrt(m)"."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite

from xcrack.base.errors import ProblemError

Dimension = tuple[float, float]  # powers of length and force

NUMBER: Dimension = (0.0, 0.0)
LENGTH: Dimension = (1.0, 0.0)
FORCE: Dimension = (0.0, 1.0)
STRESS: Dimension = (-2.0, 1.0)
LINE_FORCE: Dimension = (-1.0, 1.0)
BODY_FORCE: Dimension = (-3.0, 1.0)
TOUGHNESS: Dimension = (-1.5, 1.0)
MOMENT: Dimension = (1.0, 1.0)
TEMPERATURE = PER_TEMPERATURE = NUMBER  # degrees have no conversions

_NAMES: Mapping[Dimension, str] = {
    NUMBER: "a plain number", LENGTH: "a length", FORCE: "a force", STRESS: "a stress",
    LINE_FORCE: "a force by length",
    BODY_FORCE: "a force by volume", TOUGHNESS: "a stress times √length",
}  # fmt: skip
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254}
_FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
_STRESSES = {
    "Pa": 1.0,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "psi": 6894.757293168,
    "ksi": 6894757.293168,
}
_UNITS: dict[str, tuple[float, Dimension]] = {
    **{name: (size, LENGTH) for name, size in _LENGTHS.items()},
    **{name: (size, FORCE) for name, size in _FORCES.items()},
    **{name: (size, STRESS) for name, size in _STRESSES.items()},
}
_SAME = 1e-9  # relative: round-off of a unit of stress
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_FACTOR = re.compile(r"\s*([*·/]?)\s*(?:(sqrt\(|√)?\s*([A-Za-zµ]+)\s*\)?)(?:\^(-?\d+(?:\.\d+)?))?")


@dataclass(frozen=True)
class Units:
    """The units of a file.

    Attributes
    ----------
    length, force : str
        Their names; empty where the file names none.
    """

    length: str = ""
    force: str = ""

    def __post_init__(self) -> None:
        for name, units_of_kind in (("length", _LENGTHS), ("force", _FORCES)):
            unit = getattr(self, name)
            if unit and (not isinstance(unit, str) or unit not in units_of_kind):
                raise ProblemError(f"{name} = {unit!r:.40}: known are {', '.join(units_of_kind)}.")

    @property
    def stress(self) -> str:
        """Name of the force over the square of the length; empty where it has none."""
        if not (self.length and self.force):
            return ""
        size = _FORCES[self.force] / _LENGTHS[self.length] ** 2
        return next((n for n, unit in _STRESSES.items() if abs(unit / size - 1) < _SAME), "")

    def number(self, text: str, dimension: Dimension) -> float:
        """A quantity as a number in these units.

        Raises
        ------
        ProblemError
            No number, an unknown unit, one of another dimension, or a file without units.
        """
        match = _QUANTITY.fullmatch(text)
        if match is None:
            raise ProblemError(
                f"{text!r:.60} is no number with a unit, such as {_example(dimension)}."
            )
        value, size, powers = float(match[1]), 1.0, NUMBER
        remainder = match[2]
        while remainder:
            size, powers, remainder = _times(size, powers, remainder)
        expectation = _NAMES.get(dimension, "another quantity")
        if powers != dimension:
            quantity = _NAMES.get(powers, "another quantity")
            raise ProblemError(f"{text!r:.60} is {quantity}, but {expectation} belongs here.")
        if dimension != NUMBER and not (self.length and self.force):
            raise ProblemError(
                f"{text!r:.60} has a unit, but the file does not say its own: give [units] with "
                'length and force, such as length = "mm" and force = "N".'
            )
        if dimension != NUMBER:
            size /= _LENGTHS[self.length] ** dimension[0] * _FORCES[self.force] ** dimension[1]
        result = value * size
        return result if isfinite(result) else inf


def _times(size: float, result: Dimension, remainder: str) -> tuple[float, Dimension, str]:
    """One more factor of a unit."""
    match = _FACTOR.match(remainder)
    if match is None or match[3] not in _UNITS:
        name = remainder if match is None else match[3]
        unit_names = ", ".join(_UNITS)
        raise ProblemError(f"the unit {name!r:.40} is not known: known are {unit_names}.")
    power = float(match[4] or 1) * (0.5 if match[2] else 1.0) * (-1 if match[1] == "/" else 1)
    factor, factor_dimension = _UNITS[match[3]]
    powers = result[0] + power * factor_dimension[0], result[1] + power * factor_dimension[1]
    return size * factor**power, powers, remainder[match.end() :]


def _example(dimension: Dimension) -> str:
    names = {LENGTH: '"5 mm"', FORCE: '"2 kN"', STRESS: '"80 MPa"', TOUGHNESS: '"40 MPa*sqrt(m)"'}
    return names.get(dimension, "3.0")


__all__ = [
    "BODY_FORCE",
    "FORCE",
    "LENGTH",
    "MOMENT",
    "NUMBER",
    "PER_TEMPERATURE",
    "STRESS",
    "TEMPERATURE",
    "TOUGHNESS",
    "Dimension",
    "Units",
]
