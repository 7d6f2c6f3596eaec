"""Units of length and of K, read from text."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254, "inch": 0.0254}
# International foot-pound units (NIST SP 811): 1 lbf = 4.4482216152605 N, 1 in = 0.0254 m.
_PSI = 4.4482216152605 / 0.0254**2
_STRESSES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "psi": _PSI, "ksi": 1e3 * _PSI}
_SQUARE_MM = {f"N/mm{power}": 1e6 * np.sqrt(1e-3) for power in ("^1.5", "^3/2", "^(3/2)", "**1.5")}


@dataclass(frozen=True)
class Units:
    """Units of a law.

    Attributes
    ----------
    text : str
        As they were given.
    length : float
        One unit of length in m.
    K : float
        One unit of K in Pa√m.
    consistent : bool
        Whether K has the root of the same length: only then do the constants fit a model.
    """

    text: str
    length: float
    K: float
    is_consistent: bool

    @classmethod
    def read(cls, text: Any) -> "Units":
        """Units of a text such as ``"mm, MPa√mm"``.

        Raises
        ------
        ProblemError
            It is no text, or not of this form, or a unit is not known.
        """
        if not isinstance(text, str):
            raise ProblemError(f'units = {value_text(text)}: give a text such as "mm, MPa√mm".')
        parts = [part.strip() for part in text.split(",")]
        if len(parts) != 2 or parts[0] not in _LENGTHS:
            raise ProblemError(
                f'units = {value_text(text)}: give length and K, such as "m, MPa√m" or "mm, '
                f'N/mm^1.5"; '
                f"lengths are {', '.join(_LENGTHS)}."
            )
        length = _LENGTHS[parts[0]]
        K, root = _K_of(parts[1].replace(" ", ""), text)
        return cls(text, length, K, bool(np.isclose(length, root, rtol=1e-12, atol=0)))


def _K_of(text: str, full_text: str) -> tuple[float, float]:
    """One unit of K in Pa√m, and the length under its root in m."""
    if text in _SQUARE_MM:
        return _SQUARE_MM[text], 1e-3
    stress, root, length = (
        text.replace("sqrt(", "√").replace("(", "").replace(")", "").partition("√")
    )
    if not root or stress.rstrip("*·") not in _STRESSES or length not in _LENGTHS:
        raise ProblemError(
            f"units = {value_text(full_text)}: {value_text(text)} is no unit of K that is known: "
            f"give a stress ({', '.join(_STRESSES)}), √ and a length, such as MPa√m, or N/mm^1.5."
        )
    return _STRESSES[stress.rstrip("*·")] * np.sqrt(_LENGTHS[length]), _LENGTHS[length]


def factors(units: str, new_units: str) -> tuple[float, float]:
    """What a K and a length are multiplied by from one set of units to another."""
    old_system, new_system = Units.read(units), Units.read(new_units)
    return old_system.K / new_system.K, old_system.length / new_system.length


__all__ = ["Units", "factors"]
