"""Laws that know the toughness: Forman, Hartman and Schijve, NASGRO."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

import numpy as np

from xcrack.base.arguments import Number, Part, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.units import LENGTH, STRESS, TOUGHNESS, Dimension
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.law import (
    Approach,
    GrowthLaw,
    Ratio,
    RRange,
    Threshold,
    largest_K,
    power_of,
)
from xcrack.fatigue.power import LawThreshold
from xcrack.fatigue.thresholds import klesnil_lukas, nasgro3_threshold, nasgro4_threshold

_Positive = Annotated[float, Number(above=0)]
_NotNegative = Annotated[float, Number(least=0)]
_Toughness = Annotated[float, Number(above=0, unit=TOUGHNESS)]


def _per_forman(law: "forman") -> Dimension:
    return 1.0 - 1.5 * (1 - law.m), 1 - law.m


def _per_power(law: "hartman_schijve") -> Dimension:
    return 1.0 + 1.5 * law.alpha, -law.alpha


def _per_nasgro(law: "nasgro") -> Dimension:
    return 1.0 + 1.5 * law.n, -law.n


@dataclass(frozen=True)
class forman(GrowthLaw):  # noqa: N801 - it is used as a function
    """Growth that rises without bound as K_max comes to the toughness.

    Parameters
    ----------
    C : float, length/cycle (stress √length)^(1 - m)
        One power of K more than that of `paris`.
    m : float
        Exponent.
    K_c : float, stress √length
        Toughness: inf where ΔK >= (1 - R) K_c.
    threshold, approach, ratio, R_range
        As of `paris`.

    Raises
    ------
    ProblemError
        A part that does not fit.

    Notes
    -----
    da/dN = C ΔK^m / ((1 - R) K_c - ΔK) (Forman, Kearney and Engle 1967).

    Examples
    --------
    >>> print(f"{forman(1e-8, 3, K_c=80.0)(20.0, 0.1):.6g}")
    1.53846e-06
    """

    C: Annotated[float, Number(above=0, unit=_per_forman)]
    m: _Positive
    K_c: _Toughness = field()
    threshold: LawThreshold = None
    approach: Approach = "cut"
    ratio: Ratio = None
    R_range: RRange = None

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C ΔK^m."""
        return power_of("forman", self.C, dK, self.m)

    def rise(self, dK: Floats, R: Floats) -> Floats:
        """1 / ((1 - R) K_c - ΔK)."""
        distance = (1 - R) * self.K_c - dK
        return np.divide(1.0, distance, out=np.zeros(dK.shape), where=distance > 0)


@dataclass(frozen=True)
class hartman_schijve(GrowthLaw):  # noqa: N801
    """Growth by the range above a threshold, raised near the toughness.

    Parameters
    ----------
    D : float, length/cycle / (stress √length)^alpha
    alpha : float
        Exponent.
    A : float, stress √length
        Apparent toughness: inf where K_max reaches it.
    dK_thr : float, stress √length
        Threshold; what varies from crack to crack in this method.
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

    D: Annotated[float, Number(above=0, unit=_per_power)]
    alpha: _Positive
    A: _Toughness
    dK_thr: Annotated[float, Number(least=0, unit=TOUGHNESS)]
    ratio: Ratio = None
    R_range: RRange = None

    @property
    def K_c(self) -> float:  # type: ignore[override]
        """The apparent toughness A."""
        return self.A

    @property
    def approach(self) -> str:  # type: ignore[override]
        """Growth by the range above the threshold."""
        return "shift" if self.dK_thr else "cut"

    @cached_property
    def threshold(self) -> Threshold | None:  # type: ignore[override]
        """One for all R."""
        return klesnil_lukas(self.dK_thr, 0.0) if self.dK_thr else None

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """D ΔK^α."""
        return power_of("hartman_schijve", self.D, dK, self.alpha)

    def rise(self, dK: Floats, R: Floats) -> Floats:
        """(1 - K_max/A)^(-α/2)."""
        return np.asarray((1 - largest_K(dK, R) / self.A) ** (-0.5 * self.alpha))


@dataclass(frozen=True)
class nasgro(GrowthLaw):  # noqa: N801
    """The equation of NASGRO: closure, threshold and toughness in one.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^n
    n : float
    p, q : float
        Exponents.
    K_c : float, stress √length
        Toughness: inf where K_max reaches it. `nasgro_K_c` gives it for a thickness.
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

    C: Annotated[float, Number(above=0, unit=_per_nasgro)]
    n: _Positive
    p: _NotNegative
    q: _NotNegative
    K_c: _Toughness = field()
    closure: Annotated[newman_closure, Part(newman_closure)] = field()
    threshold: Annotated[
        nasgro3_threshold | nasgro4_threshold,
        Part(
            (nasgro3_threshold, nasgro4_threshold),
            needs="nasgro3_threshold or nasgro4_threshold, whichever the constants were published "
            "for",
        ),
    ] = field()
    ratio: Ratio = None
    R_range: RRange = None

    @property
    def approach(self) -> float:  # type: ignore[override]
        """The exponent p."""
        return self.p

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C ΔK^n."""
        return power_of("nasgro", self.C, dK, self.n)

    def rise(self, dK: Floats, R: Floats) -> Floats:
        """(1 - K_max/K_c)^-q."""
        return np.asarray((1 - largest_K(dK, R) / self.K_c) ** -self.q)


@check_arguments()
def nasgro_K_c(
    K_Ic: _Toughness,
    sigma_y: Annotated[float, Number(above=0, unit=STRESS)],
    t: Annotated[float, Number(above=0, unit=LENGTH)],
    A_k: _NotNegative,
    B_k: _NotNegative,
) -> float:
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

    Notes
    -----
    K_c = K_Ic [1 + B_k exp(-(A_k t / t0)²)], t0 = 2.5 (K_Ic / σ_y)²: manual of NASGRO, from memory.

    Examples
    --------
    >>> print(round(nasgro_K_c(30.0, 450.0, 0.005, 1.0, 1.0), 4))
    54.5006
    """
    with np.errstate(over="ignore", divide="ignore"):
        t0 = 2.5 * np.square(K_Ic / sigma_y)
        thickness = A_k * t / t0 if A_k else 0.0
        return float(K_Ic * (1 + B_k * np.exp(-np.square(thickness))))


__all__ = ["forman", "hartman_schijve", "nasgro", "nasgro_K_c"]
