"""What all growth laws share: their arguments, the ratio R that they belong to, their units."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers, shown
from xcrack.base.errors import ProblemError
from xcrack.fatigue.units import factors

ROUND_OFF = 1e-9

Law = Callable[..., Floats]
Ratio = Literal["contact", "nominal"]
Bounds = tuple[float, float]

# Of what a law may ask for by name, beside the range and the ratio.
NEEDS = ("a", "K_max")

Constants = TypeVar("Constants", bound="WithUnits")


class WithUnits:
    """Constants that carry units: each names the powers of K and of length that it has."""

    def _powers(self) -> dict[str, tuple[float, float]]:
        """Powers of K and of length, by the name of the constant; others have none."""
        return {}

    def to(self: Constants, units: str, new: str) -> Constants:
        """The same law in other units.

        Parameters
        ----------
        units, new : str
            Those of the constants as they are, and the wanted ones: length and K, such as
            ``"m, MPa√m"`` or ``"mm, N/mm^1.5"``. Both lengths of one text may differ, as where
            the literature has mm/cycle over MPa√m.

        Raises
        ------
        ProblemError
            Units that are not known, or others than those the law was given with.

        Examples
        --------
        >>> from xcrack.fatigue.power import paris
        >>> print(f"{paris(1e-11, 3.0).to('m, MPa√m', 'mm, MPa√mm').C:.6g}")
        3.16228e-13
        """
        by_K, by_length = factors(units, new)
        changed: dict[str, Any] = {}
        for name, (K, length) in self._powers().items():
            value = getattr(self, name)
            if value is not None:
                changed[name] = value * by_K**K * by_length**length
        for field in fields(self):  # type: ignore[arg-type]
            part = getattr(self, field.name)
            if isinstance(part, WithUnits):
                changed[field.name] = part.to(units, new)
        return replace(self, **changed)  # type: ignore[type-var]


def set_floats(law: object, **values: float) -> None:
    """Constants of a law as floats: 3 and 3.0 are the same setting."""
    for name, value in values.items():
        object.__setattr__(law, name, value)


def check_ratio(name: str, ratio: Any) -> None:
    """Refuse anything but the two kinds of R, and None for a choice that is not made."""
    if ratio is not None and not (isinstance(ratio, str) and ratio in ("contact", "nominal")):
        raise ProblemError(
            f'{name}: ratio = {shown(ratio)}: give "contact" for constants that belong to the '
            'computed K of a crack with contact, or "nominal" for those fitted with K_min < 0.'
        )


def check_bounds(name: str, bounds: Any) -> Bounds | None:
    """Lowest and highest R of a law, where it has them."""
    if bounds is None:
        return None
    low, high = numbers(bounds, f"{name}: R_range", (2,)).tolist()
    if not low < high:
        raise ProblemError(f"{name}: R_range = ({low:g}, {high:g}): give (lowest, highest).")
    return low, high


def range_and_ratio(
    name: str, dK_eq: ArrayLike, R: ArrayLike, bounds: Bounds | None = None
) -> tuple[Floats, Floats]:
    """What a law is called with, as arrays that fit each other.

    Parameters
    ----------
    name : str
        Of the law, for messages.
    dK_eq, R : arrays
    bounds : (lowest, highest) R, optional
        Of the tests that the constants come from.

    Raises
    ------
    ProblemError
        Arrays that do not fit each other, a negative range, R above 1 or, where dK_eq > 0, outside
        the bounds.
    """
    dK, ratio = numbers(dK_eq, f"{name}: dK_eq"), numbers(R, f"{name}: R")
    try:
        np.broadcast_shapes(dK.shape, ratio.shape)
    except ValueError as error:
        raise ProblemError(
            f"{name}: dK_eq and R have the shapes {dK.shape} and {ratio.shape}: give one R for "
            "each range, or one for all."
        ) from error
    if (dK < 0).any() or (ratio > 1 + ROUND_OFF).any():
        least, most = dK.min(initial=np.inf), ratio.max(initial=-np.inf)
        raise ProblemError(
            f"{name}: dK_eq from {least:.6g} and R up to {most:.6g}: a range is not "
            "negative, and R = K_min / K_max is at most 1; check both, and their order."
        )
    if bounds is not None:
        _check_within(name, dK, ratio, bounds)
    return dK, ratio


def _check_within(name: str, dK: Floats, ratio: Floats, bounds: Bounds) -> None:
    low, high = bounds
    outside = (dK > 0) & ((ratio < low - ROUND_OFF) | (ratio > high + ROUND_OFF))
    if outside.any():
        first = np.broadcast_to(ratio, outside.shape)[outside].flat[0]
        raise ProblemError(
            f"{name}: R = {first:.6g} is outside {low:g} to {high:g}, where its constants were "
            "fitted: take a law for this R, or give another R_range if you know that they hold."
        )


def stress_ratio(name: str, R: ArrayLike) -> Floats:
    """R as an array, at most 1."""
    ratio = np.asarray(numbers(R, f"{name}: R"))
    if (ratio > 1 + ROUND_OFF).any():
        raise ProblemError(
            f"{name}: R = {ratio.max():.6g}: give R = K_min / K_max, which is at most 1."
        )
    return ratio


def sizes(name: str, a: ArrayLike | None, shape: tuple[int, ...]) -> Floats | None:
    """Crack sizes for ranges of a shape, where they are given."""
    if a is None:
        return None
    given = numbers(a, f"{name}: a")
    if given.ndim and given.shape != shape:
        raise ProblemError(
            f"{name}: a has the shape {given.shape}: give one crack size for each range, of shape "
            f"{shape}, or one for all."
        )
    return given


def powered(name: str, C: Floats | float, base: Floats, m: Floats | float) -> Floats:
    """C base^m, which must stay a number where the base is one.

    Raises
    ------
    ProblemError
        It does not: inf would say that the toughness is reached.
    """
    with np.errstate(over="ignore"):
        rate = np.asarray(C * base**m)
    if not np.isfinite(rate).all():
        raise ProblemError(
            f"{name}: a rate is too large for a number, dK_eq or its effective part is up to "
            f"{np.max(base):.6g}: check the units of the constants, and R."
        )
    return rate


def largest_K(dK: Floats, R: Floats) -> Floats:
    """K_max of a range and a ratio; inf where R is 1 and the range is not 0."""
    share = np.maximum(1.0 - R, np.finfo(float).tiny)
    with np.errstate(over="ignore"):
        return np.asarray(np.where(dK > 0, dK / share, 0.0))


def toughness(name: str, value: Any) -> float | None:
    """A toughness that may be left out."""
    return None if value is None else number(value, f"{name}: K_c", above=0)


__all__ = [
    "NEEDS",
    "Bounds",
    "Law",
    "Ratio",
    "WithUnits",
    "check_bounds",
    "check_ratio",
    "largest_K",
    "powered",
    "range_and_ratio",
    "set_floats",
    "sizes",
    "stress_ratio",
    "toughness",
]
