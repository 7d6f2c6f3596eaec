"""Growth laws given as points."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from xcrack.base.arguments import CheckedBy, Choice
from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.fatigue.law import Bounds, GrowthLaw, Ratio
from xcrack.fatigue.units import factors

_ROUND_OFF = 1e-12


class Curve(NamedTuple):
    """Points of one R: ranges and rates."""

    R: float
    dK: tuple[float, ...]
    rate: tuple[float, ...]


def checked_curves(value: Any, label: str, error: type[XcrackError]) -> tuple[Curve, ...]:
    """Curves by rising R, checked: a mapping, or those of another table."""
    curves: list[tuple[Any, Any]] = []
    if isinstance(value, Mapping):
        curves = list(value.items())
    elif isinstance(value, tuple):  # a law that is made from another one
        parts = [curve for curve in value if isinstance(curve, tuple) and len(curve) == 3]
        if len(parts) == len(value):
            curves = [(R, (dK, rate)) for R, dK, rate in parts]
    if not curves:
        raise error(f"{label}: give a dict of R to (dK, rate).")
    return tuple(sorted(_curve(R, points, label, error) for R, points in curves))


def _curve(R: Any, points: Any, label: str, error: type[XcrackError]) -> Curve:
    """One curve, checked."""
    ratio = number(R, f"{label}: R", below=1, error=error)
    try:
        dK, rate = points
    except (TypeError, ValueError):
        raise error(f"{label}: curve of R = {ratio:g}: give (dK, rate).") from None
    dK = numbers(dK, f"{label}: dK of R = {ratio:g}", (None,), error=error)
    rate = numbers(rate, f"{label}: rate of R = {ratio:g}", (len(dK),), error=error)
    is_rising = all(len(x) > 1 and x[0] > 0 and (np.diff(x) > 0).all() for x in (dK, rate))
    if not is_rising:
        raise error(
            f"{label}: curve of R = {ratio:g}: give two or more points, ranges and rates "
            "positive and rising."
        )
    return Curve(ratio, tuple(dK.tolist()), tuple(rate.tolist()))


@dataclass(frozen=True)
class rate_table(GrowthLaw):  # noqa: N801 - it is used as a function
    """Measured points, straight lines between them over logarithms.

    Below the first point of a curve nothing grows, above the last the answer is inf, which ends a
    run: nothing is extrapolated.

    Parameters
    ----------
    curves : mapping of R to (dK, rate)
        Points of each R, both rising: stress √length and length/cycle.
    outside : {"refuse", "nearest"}
        What to do for R below or above all curves. A closed crack has R = 0 where contact is
        computed: give a curve for it, or "nearest".
    ratio
        As of `paris`.

    Raises
    ------
    ProblemError
        Fewer than two points, points that do not rise or are not positive, two curves of one R, or
        curves that a larger R does not make faster, or faster than growth by K_max alone; called
        for an R outside of all curves.

    Notes
    -----
    Between two curves ΔK at equal rate follows Walker's relation: ΔK (1 - R)^(m - 1) is constant,
    with m from both curves, the T-method of Harter (AFGROW manual). m must lie in [0, 1].

    Examples
    --------
    >>> law = rate_table({0.1: ([10, 20], [1e-8, 1e-7]), 0.5: ([7.5, 15], [1e-8, 1e-7])})
    >>> print(f"{law(17.685246, 0.3):.4g}")
    1e-07
    """

    curves: Annotated[Any, CheckedBy(checked_curves)]
    outside: Annotated[str, Choice(("refuse", "nearest"))] = "refuse"
    ratio: Ratio = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for c0, c1 in zip(self.curves, self.curves[1:]):
            _check_pair(c0, c1)

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether it has a curve for R < 0, or takes the nearest one."""
        return len(self.curves) > 1

    def to(self, units: str, new: str) -> "rate_table":
        """The same law in other units; see `paris.to`."""
        by_K, by_length = factors(units, new)
        curves = {
            R: (np.array(dK) * by_K, np.array(rate) * by_length) for R, dK, rate in self.curves
        }
        return rate_table(curves, self.outside, self.ratio)

    @property
    def R_range(self) -> Bounds | None:  # type: ignore[override]  # noqa: N802
        """Lowest and highest R of its curves, where others are refused."""
        if self.outside != "refuse" or len(self.curves) < 2:
            return None
        return self.curves[0][0], self.curves[-1][0]

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """Between the points; 0 below them and inf above."""
        lowest_R, highest_R = self.curves[0][0], self.curves[-1][0]
        ratio = np.clip(R, lowest_R, highest_R)
        result = np.zeros(dK.shape)
        is_left = np.ones(dK.shape, dtype=bool)
        for c0, c1 in zip(self.curves, self.curves[1:] or self.curves):
            is_between = is_left & (ratio <= c1[0] + (c1 is c0))
            result[is_between] = _rates_between(c0, c1, dK[is_between], ratio[is_between])
            is_left &= ~is_between
        return result


def _knots(c0: Curve, c1: Curve) -> tuple[Floats, Floats, Floats]:
    """Logarithms of the rates that both curves have, and of the range of each there."""
    start, end = max(c0[2][0], c1[2][0]), min(c0[2][-1], c1[2][-1])
    rates = np.union1d(c0[2], c1[2])
    rates = np.log(rates[(rates >= start) & (rates <= end)])
    x_low, x_high = (np.interp(rates, np.log(c[2]), np.log(c[1])) for c in (c0, c1))
    return rates, x_low, x_high


def _check_pair(c0: Curve, c1: Curve) -> None:
    """Refuse neighbours whose curves cross, or are too far apart."""
    if c0[0] == c1[0]:
        raise ProblemError(f"rate_table: two curves of R = {c0[0]:g}.")
    rates, x_low, x_high = _knots(c0, c1)
    if len(rates) < 2:
        raise ProblemError(
            f"rate_table: the curves of R = {c0[0]:g} and {c1[0]:g} have no rates in common."
        )
    m = 1 + (x_low - x_high) / np.log((1 - c1[0]) / (1 - c0[0]))
    if (m < -_ROUND_OFF).any() or (m > 1 + _ROUND_OFF).any():
        worst_row = int(np.argmax(np.abs(m - 0.5)))
        raise ProblemError(
            f"rate_table: the curves of R = {c0[0]:g} and {c1[0]:g} have Walker's exponent "
            f"{m[worst_row]:.3g} at the rate {np.exp(rates[worst_row]):.3g}: it must lie in [0, 1]."
        )


def _rates_between(c0: Curve, c1: Curve, dK: Floats, R: Floats) -> Floats:
    """Rates of points `(n,)` with R between those of two curves, or on one curve."""
    if c1[0] == c0[0]:
        rates, x_low = np.log(c0[2]), np.log(c0[1])
        weight, x_high = np.zeros(len(R)), x_low
    else:
        rates, x_low, x_high = _knots(c0, c1)
        weight = np.log((1 - c0[0]) / (1 - R)) / np.log((1 - c0[0]) / (1 - c1[0]))
        # on a curve all of it counts, not only the rates that its neighbour has too
        on_low, on_high = R <= c0[0], R >= c1[0]
        if on_low.any() or on_high.any():
            result = np.zeros(len(R))
            for curve, is_on_curve in ((c0, on_low), (c1, on_high)):
                result[is_on_curve] = _rates_between(curve, curve, dK[is_on_curve], R[is_on_curve])
            is_between = ~(on_low | on_high)
            if is_between.any():
                result[is_between] = _rates_between(c0, c1, dK[is_between], R[is_between])
            return result
    knots = x_low + weight[:, None] * (x_high - x_low)
    with np.errstate(divide="ignore"):
        x = np.log(dK)
    piece = np.clip((knots <= x[:, None]).sum(axis=1), 1, len(rates) - 1)
    row = np.arange(len(x))
    left_knot, right_knot = knots[row, piece - 1], knots[row, piece]
    x_inside = np.clip(x, knots[:, 0], knots[:, -1])
    share = (x_inside - left_knot) / (right_knot - left_knot)
    rate = np.exp(rates[piece - 1] + share * (rates[piece] - rates[piece - 1]))
    is_below, is_above = x < knots[:, 0] - _ROUND_OFF, x > knots[:, -1] + _ROUND_OFF
    return np.asarray(np.where(is_below, 0.0, np.where(is_above, np.inf, rate)))


__all__ = ["rate_table"]
