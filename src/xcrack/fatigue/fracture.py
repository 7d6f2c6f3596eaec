"""Laws that know the toughness: Forman, Hartman and Schijve, NASGRO."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, shown
from xcrack.base.errors import ProblemError
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.law import (
    Bounds,
    Ratio,
    WithUnits,
    check_bounds,
    check_ratio,
    largest_K,
    powered,
    range_and_ratio,
    set_floats,
    sizes,
)
from xcrack.fatigue.shape import Approach, Shaped, shaped
from xcrack.fatigue.thresholds import (
    Powers,
    Threshold,
    nasgro3_threshold,
    nasgro4_threshold,
)


@dataclass(frozen=True)
class forman(Shaped):  # noqa: N801 - it is used as a function
    """Growth that rises without bound as K_max comes to the toughness.

    Parameters
    ----------
    C : float, length/cycle (stress √length)^(1 - m)
        Positive; one power of K more than that of `paris`.
    m : float
        Exponent, positive.
    K_c : float, stress √length
        Toughness, positive: inf where ΔK >= (1 - R) K_c.
    threshold, approach, ratio, R_range
        As of `paris`.

    Raises
    ------
    ProblemError
        A constant that is not positive, or a part that does not fit.

    Notes
    -----
    da/dN = C ΔK^m / ((1 - R) K_c - ΔK) (Forman, Kearney and Engle 1967).

    Examples
    --------
    >>> print(f"{forman(1e-8, 3, K_c=80.0)(20.0, 0.1):.6g}")
    1.53846e-06
    """

    C: float
    m: float
    K_c: float
    threshold: Threshold | None = None
    approach: Approach = "cut"
    ratio: Ratio | None = None
    R_range: Bounds | None = None

    def __post_init__(self) -> None:
        for name in ("C", "m", "K_c"):
            set_floats(self, **{name: number(getattr(self, name), f"forman: {name}", above=0)})
        self._check_shape()

    @property
    def knows_negative_ratios(self) -> bool:
        """Its answer for R < 0 depends on how R is meant."""
        return True

    def _powers(self) -> Powers:
        return {"C": (1 - self.m, 1), "K_c": (1, 0)}

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = range_and_ratio("forman", dK_eq, R, self.R_range)

        def rate(dK: Floats) -> Floats:
            left = np.asarray((1 - ratio) * self.K_c - dK)
            rise = np.broadcast_to(powered("forman", self.C, dK, self.m), left.shape)
            grows = np.broadcast_to(dK, left.shape) > 0
            unstable = np.where(grows, np.inf, 0.0)
            return np.divide(rise, left, out=unstable, where=grows & (left > 0))

        return shaped(
            rate, dK, ratio, a, threshold=self.threshold, approach=self.approach, K_c=None
        )[()]


@dataclass(frozen=True)
class hartman_schijve(WithUnits):  # noqa: N801
    """Growth by the range above a threshold, raised near the toughness.

    Parameters
    ----------
    D : float, length/cycle / (stress √length)^alpha
        Positive.
    alpha : float
        Exponent, positive.
    A : float, stress √length
        Apparent toughness, positive: inf where K_max reaches it.
    dK_thr : float, stress √length
        Threshold, not negative; what varies from crack to crack in this method.
    ratio, R_range
        As of `paris`.

    Raises
    ------
    ProblemError
        A constant out of bounds.

    Notes
    -----
    da/dN = D [(ΔK - ΔK_thr) / √(1 - K_max/A)]^α: the variant of Jones and Molent (2016), Int. J.
    Fatigue 82, 748.

    Examples
    --------
    >>> print(f"{hartman_schijve(7e-10, 2, A=47.0, dK_thr=0.1)(10.0, 0.1):.6g}")
    8.98476e-08
    """

    D: float
    alpha: float
    A: float
    dK_thr: float
    ratio: Ratio | None = None
    R_range: Bounds | None = None

    def __post_init__(self) -> None:
        name = "hartman_schijve"
        for constant in ("D", "alpha", "A"):
            value = number(getattr(self, constant), f"{name}: {constant}", above=0)
            set_floats(self, **{constant: value})
        set_floats(self, dK_thr=number(self.dK_thr, f"{name}: dK_thr", least=0))
        check_ratio(name, self.ratio)
        object.__setattr__(self, "R_range", check_bounds(name, self.R_range))

    @property
    def knows_negative_ratios(self) -> bool:
        """Its answer for R < 0 depends on how R is meant."""
        return True

    def _powers(self) -> Powers:
        return {"D": (-self.alpha, 1), "A": (1, 0), "dK_thr": (1, 0)}

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = range_and_ratio("hartman_schijve", dK_eq, R, self.R_range)
        left = 1 - largest_K(dK, ratio) / self.A
        with np.errstate(divide="ignore"):
            over = np.maximum(dK - self.dK_thr, 0.0) / np.sqrt(np.maximum(left, 0.0))
            rate = self.D * over**self.alpha  # inf at the toughness
        return np.asarray(np.where(left > 0, rate, np.inf))[()]


@dataclass(frozen=True)
class nasgro(WithUnits):  # noqa: N801
    """The equation of NASGRO: closure, threshold and toughness in one.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^n
        Positive.
    n, p, q : float
        Exponents: n positive, p and q not negative.
    K_c : float, stress √length
        Toughness, positive: inf where K_max reaches it. `nasgro_K_c` gives it for a thickness.
    closure : newman_closure
    threshold : nasgro3_threshold or nasgro4_threshold
        Of the generation that the constants were published for.
    ratio, R_range
        As of `paris`; the constants belong to nominal R, below 0 too.

    Raises
    ------
    ProblemError
        A constant out of bounds, or a part that does not fit.

    Notes
    -----
    da/dN = C (U ΔK)^n (1 - ΔK_th/ΔK)^p / (1 - K_max/K_c)^q with U = (1 - f)/(1 - R): Forman and
    Mettu (1992), ASTM STP 1131; compared with the program easigrow (DST Group).

    Examples
    --------
    >>> law = nasgro(6.35e-10, 2.5, 1, 1, K_c=35.16, closure=newman_closure(2.0, 0.3),
    ...              threshold=nasgro4_threshold(dK1=0.8, C_th_plus=2.2, C_th_minus=0.1,
    ...                                          a0=38.1e-6, R_clip=0.7))
    >>> print(f"{law(10.0, 0.5, a=0.01):.6e}")
    3.066434e-07
    """

    C: float
    n: float
    p: float
    q: float
    K_c: float
    closure: newman_closure
    threshold: nasgro3_threshold | nasgro4_threshold
    ratio: Ratio | None = None
    R_range: Bounds | None = None

    def __post_init__(self) -> None:
        for name in ("C", "n", "K_c"):
            set_floats(self, **{name: number(getattr(self, name), f"nasgro: {name}", above=0)})
        for name in ("p", "q"):
            set_floats(self, **{name: number(getattr(self, name), f"nasgro: {name}", least=0)})
        if not isinstance(self.closure, newman_closure):
            raise ProblemError(f"nasgro: closure = {shown(self.closure)}: give newman_closure.")
        if not isinstance(self.threshold, nasgro3_threshold | nasgro4_threshold):
            raise ProblemError(
                f"nasgro: threshold = {shown(self.threshold)}: give nasgro3_threshold or "
                "nasgro4_threshold, whichever the constants were published for."
            )
        check_ratio("nasgro", self.ratio)
        object.__setattr__(self, "R_range", check_bounds("nasgro", self.R_range))

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside the range and R."""
        return self.threshold.needs

    @property
    def knows_negative_ratios(self) -> bool:
        """Its answer for R < 0 depends on how R is meant."""
        return True

    def _powers(self) -> Powers:
        return {"C": (-self.n, 1), "K_c": (1, 0)}

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike, a: ArrayLike | None = None) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = range_and_ratio("nasgro", dK_eq, R, self.R_range)
        dK, ratio = np.broadcast_arrays(dK, ratio)
        a = sizes("nasgro", a, dK.shape)
        least = np.broadcast_to(self.threshold.of(self.closure, ratio, a), dK.shape)
        left = 1 - largest_K(dK, ratio) / self.K_c
        grows = (dK > least) & (left > 0)
        above = np.where(grows, 1 - least / np.where(grows, dK, 1.0), 0.0)
        rate = powered("nasgro", self.C, self.closure(ratio) * dK, self.n) * above**self.p
        rate = np.divide(rate, np.maximum(left, 0.0) ** self.q, out=np.zeros(dK.shape), where=grows)
        return np.asarray(np.where(left > 0, rate, np.inf))[()]


def nasgro_K_c(K_Ic: float, sigma_y: float, t: float, A_k: float, B_k: float) -> float:
    """Toughness of a plate of some thickness.

    Parameters
    ----------
    K_Ic : float, stress √length
        Toughness in plane strain.
    sigma_y : float, stress
        Yield stress.
    t : float, length
        Thickness.
    A_k, B_k : float
        Fitted constants of the material.

    Returns
    -------
    float, stress √length

    Raises
    ------
    ProblemError
        A value that is not positive; A_k and B_k may be 0.

    Notes
    -----
    K_c = K_Ic [1 + B_k exp(-(A_k t / t0)²)], t0 = 2.5 (K_Ic / σ_y)²: manual of NASGRO, from memory.

    Examples
    --------
    >>> print(round(nasgro_K_c(30.0, 450.0, 0.005, 1.0, 1.0), 4))
    54.5006
    """
    name = "nasgro_K_c"
    K_Ic, sigma_y = (
        number(K_Ic, f"{name}: K_Ic", above=0),
        number(sigma_y, f"{name}: sigma_y", above=0),
    )
    t, A_k = number(t, f"{name}: t", above=0), number(A_k, f"{name}: A_k", least=0)
    B_k = number(B_k, f"{name}: B_k", least=0)
    with np.errstate(over="ignore", divide="ignore"):
        t0 = 2.5 * np.square(K_Ic / sigma_y)
        thickness = A_k * t / t0 if A_k else 0.0
        return float(K_Ic * (1 + B_k * np.exp(-np.square(thickness))))


__all__ = ["forman", "hartman_schijve", "nasgro", "nasgro_K_c"]
