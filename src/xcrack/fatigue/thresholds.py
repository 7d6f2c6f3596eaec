"""Thresholds: the range below which a crack does not grow, as a value that is called."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, Number, Part
from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH, TOUGHNESS
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.law import Closure, Threshold, sizes, stress_ratio


@dataclass(frozen=True)
class klesnil_lukas(Threshold):  # noqa: N801 - it is used as a function
    """Threshold as a power of 1 - R.

    Parameters
    ----------
    dK0 : float, stress √length
        Threshold for R = 0.
    gamma : float
        Exponent; 0 is a threshold that does not depend on R.

    Raises
    ------
    ProblemError
        Constants out of bounds.

    Notes
    -----
    ΔK_th = ΔK_0 (1 - R)^γ (Klesnil and Lukáš 1972).

    Examples
    --------
    >>> print(klesnil_lukas(6.0, 0.7)(0.5).round(6))
    3.693433
    """

    dK0: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    gamma: Annotated[float, Number(least=0, most=1)]

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R, stress √length."""
        return np.asarray(self.dK0 * np.maximum(1.0 - R, 0.0) ** self.gamma)


@dataclass(frozen=True)
class stepped_threshold(Threshold):  # noqa: N801
    """Threshold that falls in a straight line from one R to another, and is constant outside.

    Parameters
    ----------
    R : (float, float)
        Where it begins and ends to fall, in order.
    dK : (float, float, float), stress √length
        Below the first R, where it begins to fall, and at and above the second R.
    slope : float, stress √length
        dK[1] - slope (R - R[0]) between the two.

    Raises
    ------
    ProblemError
        Constants out of bounds or order.

    Notes
    -----
    BS 7910, steels in air, N/mm^1.5: 170 for R < 0, 170 - 214 R up to R = 0.5 and 63 above:
    ``stepped_threshold(R=(0, 0.5), dK=(170, 170, 63), slope=214)``. These numbers are from memory
    and were not compared with the standard; the line meets 63 at R = 0.5 exactly.

    Examples
    --------
    >>> print(stepped_threshold(R=(0, 0.5), dK=(170, 170, 63), slope=214)(0.2).round(6))
    127.2
    """

    R: Annotated[tuple[float, float], Array(shape=(2,), is_hashable=True)]
    dK: Annotated[tuple[float, float, float], Array(shape=(3,), unit=TOUGHNESS, is_hashable=True)]
    slope: Annotated[float, Number(least=0, unit=TOUGHNESS)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.R[0] < self.R[1] or min(self.dK) <= 0:
            raise ProblemError(
                f"stepped_threshold: R = {self.R} must be in order, and dK = {self.dK} positive."
            )

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R, stress √length."""
        R0, R1 = self.R
        on_slope = self.dK[1] - self.slope * (R - R0)
        return np.asarray(np.where(R < R0, self.dK[0], np.where(R < R1, on_slope, self.dK[2])))


@dataclass(frozen=True)
class el_haddad(Threshold):  # noqa: N801
    """Threshold of short cracks: that of long ones times √(a / (a + a0)).

    Parameters
    ----------
    long : klesnil_lukas or stepped_threshold
        Threshold of long cracks.
    a0 : float, length
        (dK / (Y Δσ))² / π with the range Δσ at the endurance limit.

    Raises
    ------
    ProblemError
        Another kind of threshold.

    Notes
    -----
    El Haddad, Smith and Topper (1979), J. Eng. Mater. Technol. 101, 42.

    Examples
    --------
    >>> print(el_haddad(klesnil_lukas(6.0, 0.0), a0=1e-4)(0.0, a=1e-4).round(6))
    4.242641
    """

    long: Annotated[Threshold, Part(Threshold, needs="klesnil_lukas or stepped_threshold")]
    a0: Annotated[float, Number(above=0, unit=LENGTH)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.long.needs or isinstance(self.long, _OfNewman):
            raise ProblemError(
                f"el_haddad: long = {value_text(self.long)}: give klesnil_lukas or "
                f"stepped_threshold."
            )

    @property
    def needs(self) -> tuple[str, ...]:
        """The crack size at the point."""
        return ("a",)

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R of a crack of the size a, stress √length."""
        return np.asarray(
            self.long.value(R, None, closure) * short_crack_factor(a, self.a0, "el_haddad")
        )


class _OfNewman(Threshold):
    """A threshold that Newman's opening function is part of."""

    a0: float

    @property
    def needs(self) -> tuple[str, ...]:
        """The crack size at the point, unless a0 is 0."""
        return ("a",) if self.a0 else ()

    def check_closure(self, law: str, closure: Closure | None) -> None:
        """Raise where the closure of the law is another."""
        if not isinstance(closure, newman_closure):
            raise ProblemError(
                f"{law}: {type(self).__name__} holds Newman's opening function: give "
                f"closure=newman_closure(...), not {value_text(closure)}."
            )

    def of(self, closure: newman_closure, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold of a law with this closure, for R and a crack of the size a."""
        name = type(self).__name__
        self.check_closure(name, closure)
        ratio = stress_ratio(name, R)
        size = sizes(name, a, ratio.shape or None)
        return np.asarray(self.value(ratio, size, closure))[()]


@dataclass(frozen=True, kw_only=True)
class nasgro3_threshold(_OfNewman):  # noqa: N801
    """Threshold of NASGRO up to version 3: its constant is the one for R = 0.

    Parameters
    ----------
    dK0 : float, stress √length
        Threshold of long cracks for R = 0.
    C_th : float
        Its dependence on R.
    a0 : float, length
        Intrinsic crack size, 38.1e-6 m in the program; 0 for long cracks only.

    Raises
    ------
    ProblemError
        Constants out of bounds.

    Notes
    -----
    ΔK_th = ΔK0 √(a/(a + a0)) / [(1 - f) / ((1 - A0) (1 - R))]^(1 + C_th R) (Forman and Mettu 1992,
    ASTM STP 1131); compared with the program easigrow (DST Group), which evaluates this form. Its
    constants mean something else than those of `nasgro4_threshold`: 0.8 is a threshold of 0.8 for
    R = 0 here, of 2.8 there.
    """

    dK0: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    C_th: Annotated[float, Number()]
    a0: Annotated[float, Number(least=0, unit=LENGTH)]

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R of a crack of the size a, stress √length."""
        assert isinstance(closure, newman_closure)
        opening_ratio = closure(R) / (1 - closure.A[0])
        size = short_crack_factor(a, self.a0, "nasgro3_threshold")
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            value = np.asarray(self.dK0 * size / opening_ratio ** (1 + self.C_th * R))
        return _check_finite("nasgro3_threshold", value, R)


@dataclass(frozen=True, kw_only=True)
class nasgro4_threshold(_OfNewman):  # noqa: N801
    """Threshold of NASGRO since version 4: its constant is the one for R towards 1.

    Parameters
    ----------
    dK1 : float, stress √length
        Threshold of long cracks for R towards 1.
    C_th_plus, C_th_minus : float
        Dependence on R >= 0 and on R < 0.
    a0 : float, length
        Intrinsic crack size, 38.1e-6 m in the program; 0 for long cracks only.
    R_clip : float, optional
        Larger R count as this one, in the threshold only; 0.7 is usual for aluminium.

    Raises
    ------
    ProblemError
        Constants out of bounds.

    Notes
    -----
    ΔK_1* = ΔK_1 √(a/(a + a0));
    ΔK_th = ΔK_1* [(1 - R)/(1 - f)]^(1 + R C+) / (1 - A0)^((1 - R) C+) for R >= 0,
    ΔK_th = ΔK_1* [(1 - R)/(1 - f)]^(1 + R C-) / (1 - A0)^(C+ - R C-) for R < 0 (Forman et al. 2005,
    DOT/FAA/AR-05/15, from memory). Its text was not at hand: what was checked is that both branches
    meet at R = 0 and that R → 1 gives ΔK_1*, which wrong exponents would not. No copy was
    found to compare with: three public programs with constants of this generation, easigrow among
    them, put them into the form of version 3 or into one of their own.
    """

    dK1: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    C_th_plus: Annotated[float, Number()]
    C_th_minus: Annotated[float, Number()]
    a0: Annotated[float, Number(least=0, unit=LENGTH)]
    R_clip: Annotated[float | None, Number(least=0, below=1)] = None

    def value(self, R: Floats, a: Floats | None, closure: Closure | None) -> Floats:
        """Threshold for R of a crack of the size a, stress √length."""
        assert isinstance(closure, newman_closure)
        if self.R_clip is not None:
            R = np.minimum(R, self.R_clip)
        with np.errstate(over="ignore", divide="ignore"):
            by_range, open_at_0 = 1 / closure(R), 1 - closure.A[0]
        exponent_plus, exponent_minus = self.C_th_plus, self.C_th_minus
        size = short_crack_factor(a, self.a0, "nasgro4_threshold")
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            at_positive_R = by_range ** (1 + R * exponent_plus) / open_at_0 ** (
                (1 - R) * exponent_plus
            )
            at_negative_R = by_range ** (1 + R * exponent_minus) / open_at_0 ** (
                exponent_plus - R * exponent_minus
            )
            value = np.asarray(self.dK1 * size * np.where(R >= 0, at_positive_R, at_negative_R))
        return _check_finite("nasgro4_threshold", value, R)


def _check_finite(name: str, value: Floats, ratio: Floats) -> Floats:
    if not np.isfinite(value).all():
        raise ProblemError(
            f"{name}: for R down to {ratio.min():.6g} the threshold is no number: give R of real "
            "cycles."
        )
    return value


def short_crack_factor(a: Floats | None, a0: float, name: str) -> Floats:
    """√(a / (a + a0)) of a crack of the size a; 1 where a0 is 0."""
    if not a0:
        return np.asarray(1.0)
    if a is None:
        raise ProblemError(f"{name}: the crack size a is needed: call the law with a=...")
    if (a <= 0).any():
        raise ProblemError(
            f"{name}: a = {a.min():.6g}: a crack size is positive, give one above 0."
        )
    return np.asarray(np.sqrt(a / (a + a0)))


__all__ = [
    "el_haddad",
    "klesnil_lukas",
    "nasgro3_threshold",
    "nasgro4_threshold",
    "stepped_threshold",
]
