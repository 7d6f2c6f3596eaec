"""Thresholds: the range below which a crack does not grow, as a value that is called."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers, shown
from xcrack.base.errors import ProblemError
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.law import WithUnits, set_floats, sizes, stress_ratio
from xcrack.fatigue.units import factors

Powers = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class klesnil_lukas(WithUnits):  # noqa: N801 - it is used as a function
    """Threshold as a power of 1 - R.

    Parameters
    ----------
    dK0 : float, stress √length
        Threshold for R = 0, positive.
    gamma : float
        Exponent, in [0, 1]; 0 is a threshold that does not depend on R.

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

    dK0: float
    gamma: float

    def __post_init__(self) -> None:
        set_floats(self, dK0=number(self.dK0, "klesnil_lukas: dK0", above=0))
        set_floats(self, gamma=number(self.gamma, "klesnil_lukas: gamma", least=0, most=1))

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside R: nothing."""
        return ()

    def _powers(self) -> Powers:
        return {"dK0": (1, 0)}

    def __call__(self, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold for R, stress √length."""
        ratio = stress_ratio("klesnil_lukas", R)
        return np.asarray(self.dK0 * np.maximum(1.0 - ratio, 0.0) ** self.gamma)[()]


@dataclass(frozen=True)
class stepped_threshold(WithUnits):  # noqa: N801
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

    R: tuple[float, float]
    dK: tuple[float, float, float]
    slope: float

    def __post_init__(self) -> None:
        name = "stepped_threshold"
        R = numbers(self.R, f"{name}: R", (2,)).tolist()
        dK = numbers(self.dK, f"{name}: dK", (3,)).tolist()
        if not R[0] < R[1] or min(dK) <= 0:
            raise ProblemError(f"{name}: R = {R} must be in order, and dK = {dK} positive.")
        object.__setattr__(self, "R", tuple(R))
        object.__setattr__(self, "dK", tuple(dK))
        set_floats(self, slope=number(self.slope, f"{name}: slope", least=0))

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside R: nothing."""
        return ()

    def _powers(self) -> Powers:
        return {"slope": (1, 0)}

    def to(self, units: str, new: str) -> "stepped_threshold":
        """The same threshold in other units; see `WithUnits.to`."""
        scaled = super().to(units, new)
        by_K, _ = factors(units, new)
        low, falling, high = (dK * by_K for dK in self.dK)
        return stepped_threshold(self.R, (low, falling, high), scaled.slope)

    def __call__(self, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold for R, stress √length."""
        ratio = stress_ratio("stepped_threshold", R)
        low, high = self.R
        falling = self.dK[1] - self.slope * (ratio - low)
        return np.asarray(
            np.where(ratio < low, self.dK[0], np.where(ratio < high, falling, self.dK[2]))
        )[()]


@dataclass(frozen=True)
class el_haddad(WithUnits):  # noqa: N801
    """Threshold of short cracks: that of long ones times √(a / (a + a0)).

    Parameters
    ----------
    long : klesnil_lukas or stepped_threshold
        Threshold of long cracks.
    a0 : float, length
        Positive; (dK / (Y Δσ))² / π with the range Δσ at the endurance limit.

    Raises
    ------
    ProblemError
        Another kind of threshold, or a0 that is not positive.

    Notes
    -----
    El Haddad, Smith and Topper (1979), J. Eng. Mater. Technol. 101, 42.

    Examples
    --------
    >>> print(el_haddad(klesnil_lukas(6.0, 0.0), a0=1e-4)(0.0, a=1e-4).round(6))
    4.242641
    """

    long: "klesnil_lukas | stepped_threshold"
    a0: float

    def __post_init__(self) -> None:
        if not isinstance(self.long, klesnil_lukas | stepped_threshold):
            raise ProblemError(
                f"el_haddad: long = {shown(self.long)}: give klesnil_lukas or stepped_threshold."
            )
        set_floats(self, a0=number(self.a0, "el_haddad: a0", above=0))

    @property
    def needs(self) -> tuple[str, ...]:
        """The crack size at the point."""
        return ("a",)

    def _powers(self) -> Powers:
        return {"a0": (0, 1)}

    def __call__(self, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold for R of a crack of the size a, stress √length."""
        ratio = stress_ratio("el_haddad", R)
        a = sizes("el_haddad", a, ratio.shape) if ratio.ndim else a
        return np.asarray(self.long(R) * short(a, self.a0, "el_haddad"))[()]


@dataclass(frozen=True, kw_only=True)
class nasgro3_threshold(WithUnits):  # noqa: N801
    """Threshold of NASGRO up to version 3: its constant is the one for R = 0.

    Parameters
    ----------
    dK0 : float, stress √length
        Threshold of long cracks for R = 0, positive.
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

    dK0: float
    C_th: float
    a0: float

    def __post_init__(self) -> None:
        set_floats(self, dK0=number(self.dK0, "nasgro3_threshold: dK0", above=0))
        set_floats(self, C_th=number(self.C_th, "nasgro3_threshold: C_th"))
        set_floats(self, a0=number(self.a0, "nasgro3_threshold: a0", least=0))

    @property
    def needs(self) -> tuple[str, ...]:
        """The crack size at the point, unless a0 is 0."""
        return ("a",) if self.a0 else ()

    def _powers(self) -> Powers:
        return {"dK0": (1, 0), "a0": (0, 1)}

    def of(self, closure: newman_closure, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold of a law with this closure, for R and a crack of the size a."""
        _check_newman("nasgro3_threshold", closure)
        ratio = stress_ratio("nasgro3_threshold", R)
        a = sizes("nasgro3_threshold", a, ratio.shape) if ratio.ndim else a
        U = closure(ratio)
        inner = U / (1 - closure.A[0])
        size = short(a, self.a0, "nasgro3_threshold")
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            value = np.asarray(self.dK0 * size / inner ** (1 + self.C_th * ratio))
        return _finite("nasgro3_threshold", value, ratio)[()]


@dataclass(frozen=True, kw_only=True)
class nasgro4_threshold(WithUnits):  # noqa: N801
    """Threshold of NASGRO since version 4: its constant is the one for R towards 1.

    Parameters
    ----------
    dK1 : float, stress √length
        Threshold of long cracks for R towards 1, positive.
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

    dK1: float
    C_th_plus: float
    C_th_minus: float
    a0: float
    R_clip: float | None = None

    def __post_init__(self) -> None:
        set_floats(self, dK1=number(self.dK1, "nasgro4_threshold: dK1", above=0))
        set_floats(self, C_th_plus=number(self.C_th_plus, "nasgro4_threshold: C_th_plus"))
        set_floats(self, C_th_minus=number(self.C_th_minus, "nasgro4_threshold: C_th_minus"))
        set_floats(self, a0=number(self.a0, "nasgro4_threshold: a0", least=0))
        if self.R_clip is not None:
            clip = number(self.R_clip, "nasgro4_threshold: R_clip", least=0, below=1)
            set_floats(self, R_clip=clip)

    @property
    def needs(self) -> tuple[str, ...]:
        """The crack size at the point, unless a0 is 0."""
        return ("a",) if self.a0 else ()

    def _powers(self) -> Powers:
        return {"dK1": (1, 0), "a0": (0, 1)}

    def of(self, closure: newman_closure, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Threshold of a law with this closure, for R and a crack of the size a."""
        _check_newman("nasgro4_threshold", closure)
        ratio = stress_ratio("nasgro4_threshold", R)
        a = sizes("nasgro4_threshold", a, ratio.shape) if ratio.ndim else a
        if self.R_clip is not None:
            ratio = np.minimum(ratio, self.R_clip)
        with np.errstate(over="ignore", divide="ignore"):
            by_range, open_at_0 = 1 / closure(ratio), 1 - closure.A[0]
        plus, minus = self.C_th_plus, self.C_th_minus
        size = short(a, self.a0, "nasgro4_threshold")
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            above = by_range ** (1 + ratio * plus) / open_at_0 ** ((1 - ratio) * plus)
            below = by_range ** (1 + ratio * minus) / open_at_0 ** (plus - ratio * minus)
            value = np.asarray(self.dK1 * size * np.where(ratio >= 0, above, below))
        return _finite("nasgro4_threshold", value, ratio)[()]


Threshold = klesnil_lukas | stepped_threshold | el_haddad


def check_threshold(name: str, threshold: object) -> None:
    """Refuse what is no threshold of a law with a free closure."""
    if threshold is not None and not isinstance(threshold, Threshold):
        raise ProblemError(
            f"{name}: threshold = {shown(threshold)}: give klesnil_lukas, stepped_threshold or "
            "el_haddad; those of NASGRO belong to nasgro."
        )


def _finite(name: str, value: Floats, ratio: Floats) -> Floats:
    if not np.isfinite(value).all():
        raise ProblemError(
            f"{name}: for R down to {ratio.min():.6g} the threshold is no number: give R of real "
            "cycles."
        )
    return value


def _check_newman(name: str, closure: object) -> None:
    if not isinstance(closure, newman_closure):
        raise ProblemError(f"{name}: closure = {shown(closure)}: give newman_closure.")


def short(a: ArrayLike | None, a0: float, name: str) -> Floats:
    """√(a / (a + a0)) of a crack of the size a; 1 where a0 is 0."""
    if not a0:
        return np.asarray(1.0)
    if a is None:
        raise ProblemError(f"{name}: the crack size a is needed: call the law with a=...")
    size = numbers(a, f"{name}: a")
    if (size <= 0).any():
        raise ProblemError(
            f"{name}: a = {size.min():.6g}: a crack size is positive, give one above 0."
        )
    return np.asarray(np.sqrt(size / (size + a0)))


__all__ = [
    "Threshold",
    "check_threshold",
    "el_haddad",
    "klesnil_lukas",
    "nasgro3_threshold",
    "nasgro4_threshold",
    "stepped_threshold",
]
