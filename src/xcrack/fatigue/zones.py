"""Models of retardation after overloads, as values."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Number, Part
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import STRESS, TOUGHNESS
from xcrack.fatigue.law import Constants

_LARGEST = 1e120  # K whose square is a number


@dataclass(frozen=True)
class plastic_zone(Constants):  # noqa: N801 - it is used as a function
    """Size of the plastic zone, (K / sigma_y)² / (beta π).

    Parameters
    ----------
    sigma_y : float, stress
        Yield stress, positive.
    beta : float
        Positive. 1: width in plane stress (Irwin), 2: radius in plane stress, 3: width and 6:
        radius in plane strain; 8/π² is the strip of Dugdale. Which one belongs to a model's
        constants.

    Raises
    ------
    ProblemError
        A value that is not positive.

    Examples
    --------
    >>> print((1000 * plastic_zone(400.0, beta=2)(30.0)).round(6))      # MPa √m to mm
    0.895247
    """

    sigma_y: Annotated[float, Number(above=0, unit=STRESS)]
    beta: Annotated[float, Number(above=0)]

    def __call__(self, K: ArrayLike) -> Floats:
        """Size for K, length."""
        given = numbers(K, "plastic_zone: K")
        if np.abs(given).max(initial=0.0) > _LARGEST:
            raise ProblemError(
                f"plastic_zone: K = {np.abs(given).max():.3g} has no square: take another unit."
            )
        return np.asarray(self.factor * given**2)[()]

    @property
    def factor(self) -> float:
        """Size over K²."""
        return 1.0 / (self.sigma_y**2 * self.beta * np.pi)


@dataclass(frozen=True)
class wheeler(Constants):  # noqa: N801
    """Growth slowed while the plastic zone lies inside that of an overload.

    Parameters
    ----------
    w : float
        Exponent, positive: fitted to a material and a kind of spectrum.
    zone : plastic_zone

    Raises
    ------
    ProblemError
        A value that does not fit.

    Notes
    -----
    da/dN times [r / (a_OL + r_OL - a)]^w while a + r < a_OL + r_OL (Wheeler 1972, J. Basic Eng. 94,
    181). A cycle whose zone reaches beyond that of the overload is the new overload.

    Examples
    --------
    >>> model = wheeler(1.5, plastic_zone(400.0, beta=2))
    >>> print(model.factor(15.0, 30.0, 0.3e-3).round(6))
    0.230557
    """

    w: Annotated[float, Number(above=0)]
    zone: Annotated[plastic_zone, Part(plastic_zone, needs="plastic_zone(sigma_y, beta)")]

    def factor(self, K: ArrayLike, K_overload: ArrayLike, da: ArrayLike) -> Floats:
        """Factor on the rate for K, after growth by da since an overload."""
        own = self.zone(K)
        left = self.zone(K_overload) - numbers(da, "wheeler: da")
        inside = left > own
        share = np.divide(own, left, out=np.ones_like(left + own), where=inside)
        return np.asarray(share**self.w)[()]


@dataclass(frozen=True)
class willenborg(Constants):  # noqa: N801
    """Growth by a K that the residual stress of an overload reduces.

    Parameters
    ----------
    shutoff : float
        Overload over K at which the crack stops, above 1; 2.3 to 3 for aluminium (from memory).
    dK_th : float, stress √length
        Threshold, not negative.
    zone : plastic_zone

    Raises
    ------
    ProblemError
        A value that does not fit.

    Notes
    -----
    K_R = φ [K_OL √(1 - da/r_OL) - K_max] >= 0, φ = (1 - ΔK_th/ΔK) / (S - 1) >= 0 (generalised
    Willenborg model: Gallagher 1974; Gallagher and Hughes, AFFDL-TR-74-27; the same formula is in
    the program easigrow). Both ends of the cycle are shifted by -K_R and cut at 0: K with contact.

    Examples
    --------
    >>> model = willenborg(2.5, 2.0, plastic_zone(400.0, beta=2))
    >>> print(model.reduction(1.5, 15.0, 30.0, 0.0).round(6))
    8.518519
    """

    shutoff: Annotated[float, Number(above=1)]
    dK_th: Annotated[float, Number(least=0, unit=TOUGHNESS)]
    zone: Annotated[plastic_zone, Part(plastic_zone, needs="plastic_zone(sigma_y, beta)")]

    def reduction(
        self, K_min: ArrayLike, K_max: ArrayLike, K_overload: ArrayLike, da: ArrayLike
    ) -> Floats:
        """Reduction of K, after growth by da since an overload, stress √length."""
        low, high, over, grown = (
            numbers(value, f"willenborg: {name}")
            for name, value in zip(
                ("K_min", "K_max", "K_overload", "da"), (K_min, K_max, K_overload, da)
            )
        )
        dK = high - low
        share = np.divide(self.dK_th, dK, out=np.ones_like(dK), where=dK > 0)
        phi = np.maximum(1 - share, 0.0) / (self.shutoff - 1)
        left = np.maximum(1 - grown / self.zone(over), 0.0)
        return np.asarray(np.maximum(phi * (over * np.sqrt(left) - high), 0.0))[()]


Retardation = wheeler | willenborg


__all__ = ["Retardation", "plastic_zone", "wheeler", "willenborg"]
