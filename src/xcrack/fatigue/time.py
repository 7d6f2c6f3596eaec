"""Growth in time beside growth by cycles: dwell, creep, corrosion under load."""

from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Choice, Function, Number, Part
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH, TOUGHNESS, Dimension
from xcrack.fatigue.law import Constants, Law, largest_K, power_of, range_and_ratio

_X, _W = np.polynomial.legendre.leggauss(8)
_PANELS = 16  # of half a period: a wave may cross the threshold or the plateau in any of them
_TAU = np.concatenate([(k + 0.5 * (_X + 1)) / _PANELS for k in range(_PANELS)])
_WEIGHT = np.tile(0.5 * _W / _PANELS, _PANELS)


def _per_time(law: "time_rate") -> Dimension:
    return 1.0 + 1.5 * law.n, -law.n


@dataclass(frozen=True)
class time_rate(Constants):  # noqa: N801 - it is used as a function
    """Growth in time under a K that acts, da/dt = C K^n.

    Parameters
    ----------
    C : float, length/time/(stress √length)^n
    n : float
        Exponent.
    K_th : float, stress √length
        Nothing grows at or below it, K_Iscc of corrosion under load.
    plateau : float, length/time, optional
        Largest rate, where a reaction or transport limits it.

    Examples
    --------
    >>> print(f"{time_rate(1e-9, 3.0, K_th=10.0)(20.0):.4g}")
    8e-06
    """

    C: Annotated[float, Number(above=0, unit=_per_time)]
    n: Annotated[float, Number(least=0)]
    K_th: Annotated[float, Number(least=0, unit=TOUGHNESS)] = 0.0
    plateau: Annotated[float | None, Number(above=0, unit=LENGTH)] = None

    def __call__(self, K: ArrayLike) -> Floats:
        """Growth in a unit of time, length/time; none where K is not positive."""
        values = np.asarray(numbers(K, "time_rate: K"))
        is_above = (values > self.K_th) & (values > 0)
        rate = power_of("time_rate", self.C, np.where(is_above, values, 1.0), self.n)
        if self.plateau is not None:
            rate = np.minimum(rate, self.plateau)
        return np.asarray(np.where(is_above, rate, 0.0))[()]


@dataclass(frozen=True)
class with_time(Constants):  # noqa: N801
    """A law with growth in time added: da/dN + ∫ da/dt over a cycle.

    Parameters
    ----------
    law : callable (dK_eq, R) -> da/dN
    rate : time_rate
    period : float, time
        What a cycle lasts, or what is held of it.
    wave : {"hold", "triangle", "sine"}
        How K runs over the period: held at K_max, or between K_min and K_max.

    Raises
    ------
    ProblemError
        A part that does not fit; called with a range of zero at R = 1, of which K is not known.

    Notes
    -----
    Superposition of Wei and Landes (1969, Mater. Res. Stand. 9, 25); K_min < 0 of a nominal R does
    nothing. Each cycle of a spectrum has the same period. Time is the number of cycles times it.

    Examples
    --------
    >>> from xcrack.fatigue.power import paris
    >>> law = with_time(paris(1e-8, 3.0), time_rate(1e-9, 3.0), period=120.0)
    >>> print(f"{law(20.0, 0.0):.4g}")
    0.00104
    """

    law: Annotated[Law, Function("a growth law")]
    rate: Annotated[time_rate, Part(time_rate)]
    period: Annotated[float, Number(above=0)]
    wave: Annotated[str, Choice(("hold", "triangle", "sine"))] = "hold"

    @property
    def needs(self) -> tuple[str, ...]:
        """What the law asks for beside the range and R."""
        return tuple(getattr(self.law, "needs", ()))

    @property
    def ratio(self) -> Any:
        """Which R the law belongs to."""
        return getattr(self.law, "ratio", None)

    @property
    def closure(self) -> Any:
        """Closure of the law, if it has one."""
        return getattr(self.law, "closure", None)

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether the law's answer for R < 0 depends on how R is meant."""
        return bool(getattr(self.law, "knows_negative_ratios", False))

    def to(self, units: str, new: str) -> Self:
        """The same in other units, as of `paris`; time stays what it is."""
        if not isinstance(self.law, Constants):
            raise ProblemError("with_time: law has no units that are known: convert it by hand.")
        return super().to(units, new)

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike, **inputs: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = range_and_ratio("with_time", dK_eq, R)
        K_max = largest_K(dK, ratio)
        if not np.isfinite(K_max).all():
            raise ProblemError("with_time: R = 1 with a range, K_max is not known: give R < 1.")
        by_cycle = np.asarray(self.law(dK_eq, R, **inputs))
        return np.asarray(by_cycle + self.period * self._mean_rate(K_max, K_max - dK))[()]

    def _mean_rate(self, K_max: Floats, K_min: Floats) -> Floats:
        """Mean of the rate over a period."""
        if self.wave == "hold":
            return np.asarray(self.rate(K_max))
        rise = _TAU if self.wave == "triangle" else 0.5 * (1 - np.cos(np.pi * _TAU))
        K = K_min[..., None] + (K_max - K_min)[..., None] * rise
        return np.asarray(self.rate(K) @ _WEIGHT)


__all__ = ["time_rate", "with_time"]
