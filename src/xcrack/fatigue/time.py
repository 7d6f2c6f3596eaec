"""Growth in time beside growth by cycles: dwell, creep, corrosion under load."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers, one_of, shown
from xcrack.base.errors import ProblemError
from xcrack.fatigue.law import Law, WithUnits, largest_K, powered, range_and_ratio, set_floats

_WAVES = ("hold", "triangle", "sine")
_X, _W = np.polynomial.legendre.leggauss(8)
_PANELS = 16  # of half a period: a wave may cross the threshold or the plateau in any of them
_TAU = np.concatenate([(k + 0.5 * (_X + 1)) / _PANELS for k in range(_PANELS)])
_WEIGHT = np.tile(0.5 * _W / _PANELS, _PANELS)


@dataclass(frozen=True)
class time_rate(WithUnits):  # noqa: N801 - it is used as a function
    """Growth in time under a K that acts, da/dt = C K^n.

    Parameters
    ----------
    C : float, length/time/(stress √length)^n
        Positive.
    n : float
        Exponent, not negative.
    K_th : float, stress √length
        Nothing grows at or below it, K_Iscc of corrosion under load.
    plateau : float, length/time, optional
        Largest rate, where a reaction or transport limits it.

    Raises
    ------
    ProblemError
        A constant that does not fit.

    Examples
    --------
    >>> print(f"{time_rate(1e-9, 3.0, K_th=10.0)(20.0):.4g}")
    8e-06
    """

    C: float
    n: float
    K_th: float = 0.0
    plateau: float | None = None

    def __post_init__(self) -> None:
        set_floats(self, C=number(self.C, "time_rate: C", above=0))
        set_floats(self, n=number(self.n, "time_rate: n", least=0))
        set_floats(self, K_th=number(self.K_th, "time_rate: K_th", least=0))
        if self.plateau is not None:
            set_floats(self, plateau=number(self.plateau, "time_rate: plateau", above=0))

    def _powers(self) -> dict[str, tuple[float, float]]:
        return {"C": (-self.n, 1), "K_th": (1, 0), "plateau": (0, 1)}

    def __call__(self, K: ArrayLike) -> Floats:
        """Growth in a unit of time, length/time; none where K is not positive."""
        given = np.asarray(numbers(K, "time_rate: K"))
        acts = (given > self.K_th) & (given > 0)
        rate = powered("time_rate", self.C, np.where(acts, given, 1.0), self.n)
        if self.plateau is not None:
            rate = np.minimum(rate, self.plateau)
        return np.asarray(np.where(acts, rate, 0.0))[()]


@dataclass(frozen=True)
class with_time(WithUnits):  # noqa: N801
    """A law with growth in time added: da/dN + ∫ da/dt over a cycle.

    Parameters
    ----------
    law : callable (dK_eq, R) -> da/dN
    rate : time_rate
    period : float, time
        What a cycle lasts, or what is held of it; positive.
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

    law: Law
    rate: time_rate
    period: float
    wave: str = "hold"

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise ProblemError(
                f"with_time: law = {shown(self.law)} cannot be called: give a growth law."
            )
        if not isinstance(self.rate, time_rate):
            raise ProblemError(f"with_time: rate = {shown(self.rate)}: give a time_rate.")
        set_floats(self, period=number(self.period, "with_time: period", above=0))
        one_of(self.wave, "with_time: wave", _WAVES)

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

    def to(self, units: str, new: str) -> "with_time":
        """The same in other units, as of `paris`; time stays what it is."""
        if not isinstance(self.law, WithUnits):
            raise ProblemError("with_time: law has no units that are known: convert it by hand.")
        return super().to(units, new)

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike, **wanted: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = range_and_ratio("with_time", dK_eq, R)
        high = largest_K(dK, ratio)
        if not np.isfinite(high).all():
            raise ProblemError("with_time: R = 1 with a range, K_max is not known: give R < 1.")
        by_cycle = np.asarray(self.law(dK_eq, R, **wanted))
        return np.asarray(by_cycle + self.period * self._mean(high, high - dK))[()]

    def _mean(self, high: Floats, low: Floats) -> Floats:
        """Mean of the rate over a period."""
        if self.wave == "hold":
            return np.asarray(self.rate(high))
        rise = _TAU if self.wave == "triangle" else 0.5 * (1 - np.cos(np.pi * _TAU))
        K = low[..., None] + (high - low)[..., None] * rise
        return np.asarray(self.rate(K) @ _WEIGHT)


__all__ = ["time_rate", "with_time"]
