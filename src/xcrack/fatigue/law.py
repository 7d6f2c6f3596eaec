"""A growth law: rate, closure, threshold and toughness; its arguments, its R, its units."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from xcrack.base.arguments import Choice, Declared, Rule, arguments_of
from xcrack.base.arrays import Floats
from xcrack.base.checks import check_set_names, number, numbers, value_text, values_by_set
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import NUMBER, Dimension
from xcrack.fatigue.units import factors

ROUND_OFF = 1e-9

Law = Callable[..., Floats]
Bounds = tuple[float, float]

# Of what a law may ask for by name, beside the range and the ratio.
NEEDS = ("a", "K_max")


class Constants(Declared):
    """Constants in a dataclass: its fields have the rules that check and the units that convert."""

    def to(self, units: str, new: str) -> Self:
        """The same in other units.

        Parameters
        ----------
        units, new : str
            Those of the constants as they are, and of the result: length and K, such as
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
        converted: dict[str, Any] = {}
        for name, argument in arguments_of(type(self)).items():
            value = getattr(self, name)
            if isinstance(value, Constants):
                converted[name] = value.to(units, new)
                continue
            unit = argument.unit_of(self)
            if value is not None and unit not in (None, NUMBER):
                converted[name] = _times(value, _factor(unit, by_K, by_length))
        return replace(self, **converted)  # type: ignore[type-var]


def per_range(law: Any) -> Dimension:
    """Dimension of C in da/dN = C ΔK^m."""
    return 1.0 + 1.5 * law.m, -law.m


def _factor(unit: Dimension, by_K: float, by_length: float) -> float:
    """What a constant of a dimension is multiplied by: it has powers of K and of length."""
    length, force = unit  # K is force / length^1.5
    return float(by_K**force * by_length ** (length + 1.5 * force))


def _times(value: Any, factor: float) -> Any:
    return tuple(_times(v, factor) for v in value) if isinstance(value, tuple) else value * factor


class Closure(Constants):
    """Share U of a range during which a crack is open. Subclasses are dataclasses."""

    def __call__(self, R: ArrayLike) -> Floats:
        """U in [0, 1] for R."""
        raise NotImplementedError


class Threshold(Constants):
    """Range below which a crack does not grow. Subclasses are dataclasses with `value`."""

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside R: of `NEEDS`."""
        return ()

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R of a crack of the size a, in a law with this closure."""
        raise NotImplementedError

    def check_closure(self, law: str, closure: Closure | None) -> None:
        """Raise where it does not go with the closure of a law."""

    def __call__(self, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold for R of a crack of the size a, stress √length."""
        name = type(self).__name__
        self.check_closure(name, None)
        ratio = stress_ratio(name, R)
        size = sizes(name, a, ratio.shape or None)
        return np.asarray(self.value(ratio, size, None))[()]


class ApproachRule(Rule):
    """How growth begins above a threshold: in words, or an exponent."""

    def check(self, value: Any, label: str, error: type[XcrackError]) -> str | float:
        """The word, or the exponent as float."""
        if not isinstance(value, str):
            return number(value, label, above=0, error=error)
        if value not in ("cut", "difference", "shift"):
            raise error(
                f'{label} = {value_text(value)}: give "cut", "difference", "shift" or an '
                "exponent p."
            )
        return value


class BoundsRule(Rule):
    """Lowest and highest R, in order; kept as a tuple."""

    def check(self, value: Any, label: str, error: type[XcrackError]) -> Bounds:
        """Both as float."""
        lower_bound, upper_bound = numbers(value, label, (2,), error=error).tolist()
        if not lower_bound < upper_bound:
            raise error(f"{label} = ({lower_bound:g}, {upper_bound:g}): give (lowest, highest).")
        return lower_bound, upper_bound


Approach = Annotated[str | float, ApproachRule()]
RRange = Annotated[Bounds | None, BoundsRule()]
Ratio = Annotated[
    Literal["contact", "nominal"] | None,
    Choice(
        ("contact", "nominal"),
        needs='"contact" for constants that belong to the computed K of a crack with contact, or '
        '"nominal" for those fitted with K_min < 0',
    ),
]


class GrowthLaw(Constants):
    """Growth a cycle, da/dN = rate(U ΔK) near threshold and toughness. Subclasses are dataclasses.

    A law has four parts: `rate` between threshold and toughness, a closure, a threshold with the
    way to it, and a toughness `K_c` with the `rise` towards it. What a subclass does not have,
    does nothing.

    Attributes
    ----------
    closure : Closure or None
        U ΔK stands for ΔK in the rate then.
    threshold : Threshold or None
        Compared with ΔK itself.
    approach : {"cut", "difference", "shift"} or float
        Above the threshold: rate(ΔK), rate(ΔK) - rate(ΔK_th), rate(ΔK - ΔK_th), or rate(ΔK) times
        (1 - ΔK_th / ΔK)^p.
    K_c : float or None, stress √length
        inf where K_max reaches it, which ends a run.
    ratio : {"contact", "nominal"} or None
        Which ΔK and R the constants belong to; None: to be given where R < 0 is asked for and
        `knows_negative_ratios`.
    R_range : (float, float) or None
        Others are an error.
    """

    closure: Closure | None = None
    threshold: Threshold | None = None
    approach: str | float = "cut"
    K_c: float | None = None
    ratio: str | None = None
    R_range: Bounds | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self).__name__
        if self.threshold is not None:
            self.threshold.check_closure(name, self.closure)
        elif self.approach != "cut":
            raise ProblemError(
                f"{name}: approach = {value_text(self.approach)} without a threshold: give "
                f"threshold=."
            )

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """Growth a cycle between threshold and toughness, of the open part of the range."""
        raise NotImplementedError

    def rise(self, dK: Floats, R: Floats) -> Floats:
        """Factor on the rate where K_max is below the toughness."""
        return np.ones(dK.shape)

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside the range and R."""
        return () if self.threshold is None else self.threshold.needs

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether its answer for R < 0 depends on how R is meant."""
        has_rise = type(self).rise is not GrowthLaw.rise
        return self.closure is not None or self.threshold is not None or has_rise

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Growth a cycle of each point, length.

        Parameters
        ----------
        dK_eq : array, stress √length
        R : array
            One for each range, or one for all.
        a : array, optional, length
            Crack size, where the threshold asks for it.

        Raises
        ------
        ProblemError
            Arrays that do not fit each other, a negative range, an R above 1 or outside `R_range`.
        """
        name = type(self).__name__
        dK, ratio = np.broadcast_arrays(*range_and_ratio(name, dK_eq, R, self.R_range))
        U = None if self.closure is None else self.closure(ratio)
        size = sizes(name, a, dK.shape)

        def rate(dK: Floats) -> Floats:
            return np.asarray(self.rate(dK if U is None else U * dK, ratio))

        if self.threshold is None:
            result = rate(dK)
        else:
            threshold_range = np.broadcast_to(
                self.threshold.value(ratio, size, self.closure), dK.shape
            )
            result = np.where(
                dK > threshold_range, _growth_above(rate, dK, threshold_range, self.approach), 0.0
            )
        if self.K_c is not None:
            is_break = largest_K(dK, ratio) >= self.K_c
            range_below = np.where(is_break, 0.0, dK)
            result = np.where(is_break, np.inf, result * self.rise(range_below, ratio))
        return np.asarray(result)[()]


def _growth_above(
    rate: Callable[[Floats], Floats], dK: Floats, threshold_range: Floats, approach: str | float
) -> Floats:
    """Growth above a threshold; anything below."""
    if approach == "cut":
        return rate(dK)
    if approach == "difference":
        return rate(dK) - rate(threshold_range)
    if approach == "shift":
        return rate(np.maximum(dK - threshold_range, 0.0))
    share = np.divide(threshold_range, dK, out=np.ones(dK.shape), where=dK > 0)
    return np.asarray(rate(dK) * np.maximum(1 - share, 0.0) ** float(approach))


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
        least_range, largest_ratio = dK.min(initial=np.inf), ratio.max(initial=-np.inf)
        raise ProblemError(
            f"{name}: dK_eq from {least_range:.6g} and R up to {largest_ratio:.6g}: a range is not "
            "negative, and R = K_min / K_max is at most 1; check both, and their order."
        )
    if bounds is not None:
        _check_within(name, dK, ratio, bounds)
    return dK, ratio


def _check_within(name: str, dK: Floats, ratio: Floats, bounds: Bounds) -> None:
    R_min, R_max = bounds
    is_outside = (dK > 0) & ((ratio < R_min - ROUND_OFF) | (ratio > R_max + ROUND_OFF))
    if is_outside.any():
        first = np.broadcast_to(ratio, is_outside.shape)[is_outside].flat[0]
        raise ProblemError(
            f"{name}: R = {first:.6g} is outside {R_min:g} to {R_max:g}, where its constants were "
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


def sizes(name: str, a: ArrayLike | None, shape: tuple[int, ...] | None) -> Floats | None:
    """Crack sizes for ranges of a shape (None: of any), where they are given."""
    if a is None:
        return None
    length = numbers(a, f"{name}: a")
    if length.ndim and shape is not None and length.shape != shape:
        raise ProblemError(
            f"{name}: a has the shape {length.shape}: give one crack size for each range, of shape "
            f"{shape}, or one for all."
        )
    return length


def power_of(name: str, C: Floats | float, base: Floats, m: Floats | float) -> Floats:
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


# --- laws of growth by the materials that tips are in ---


Names = NDArray[np.str_]


@dataclass(frozen=True)
class LawSets:
    """Laws by the names of the cell sets that materials have; each tip grows by that of its own.

    ``grow(problem, {"plate": ..., "weld": ...}, ...)`` is short for it.

    Parameters
    ----------
    laws : mapping of str to callable

    Raises
    ------
    ProblemError
        No mapping of names to laws, or laws whose R is not meant alike.
    """

    laws: Any

    def __post_init__(self) -> None:
        pairs = values_by_set(
            self.laws, "law", "laws", "paris", "a law such as paris(...)",
            lambda law: callable(law) and not isinstance(law, LawSets),
        )  # fmt: skip
        object.__setattr__(self, "laws", pairs)
        ratios = {getattr(law, "ratio", None) for _, law in self.laws}
        if len(ratios) > 1:
            raise ProblemError(
                f"law: R is meant in several ways, ratio = {', '.join(sorted(map(str, ratios)))}: "
                "give all laws of a run the same."
            )

    @property
    def ratio(self) -> str | None:
        """Which R the constants belong to: the same for all."""
        return getattr(self.laws[0][1], "ratio", None)

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether the answer of one of them for R < 0 depends on how R is meant."""
        return any(getattr(law, "knows_negative_ratios", False) for _, law in self.laws)

    def check(self, names: Sequence[str]) -> None:
        """Raise where the materials of a problem are others.

        Raises
        ------
        ProblemError
            A material without a law, or a law without a material.
        """
        set_names = [name for name, _ in self.laws]
        check_set_names(set_names, names, "law", "laws", "a law")


__all__ = [
    "NEEDS",
    "Approach",
    "Bounds",
    "Closure",
    "Constants",
    "GrowthLaw",
    "Law",
    "LawSets",
    "Names",
    "RRange",
    "Ratio",
    "Threshold",
    "largest_K",
    "per_range",
    "power_of",
    "range_and_ratio",
    "sizes",
    "stress_ratio",
]
