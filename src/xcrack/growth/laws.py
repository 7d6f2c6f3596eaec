"""Growth laws: plain callables ``(dK_eq, R) -> da/dN``.

A law of your own is any function of that form; `xcrack.testing.check_law` tries it. It may return
inf where the toughness is reached, which ends a run. C carries the units of da/dN over
(stress √length)^m: it belongs to one set of units only.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.inputs import number, numbers

_ROUND_OFF = 1e-9

Law = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class paris:  # noqa: N801 - it is used as a function: paris(C, m)(dK_eq, R)
    """Growth as a power of the range.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
        Positive.
    m : float
        Exponent, positive.

    Raises
    ------
    ProblemError
        C or m not positive and finite.

    Notes
    -----
    da/dN = C ΔK^m (Paris and Erdogan 1963).

    Examples
    --------
    >>> law = paris(C=1e-11, m=3)
    >>> print(f"{law(10.0, 0.0):.3g}")
    1e-08
    """

    C: float
    m: float

    def __post_init__(self) -> None:
        _set(self, C=number(self.C, "paris: C", above=0), m=number(self.m, "paris: m", above=0))

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, _ = _range_and_ratio("paris", dK_eq, R)
        return np.asarray(self.C * dK**self.m)[()]


@dataclass(frozen=True)
class elber:  # noqa: N801 - it is used as a function
    """Growth by the part of the range in which the plastic wake lets the crack open.

    Where contact of the crack faces is computed, the smallest K is that of the closed crack
    already; U then stands for the closure by plasticity only.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
        Positive.
    m : float
        Exponent, positive.
    a, b : float
        U = a + b R, cut to [0, 1].

    Raises
    ------
    ProblemError
        C or m not positive, a or b not finite, or U = 0 for all R in [0, 1].

    Notes
    -----
    da/dN = C (U ΔK)^m (Elber 1971). His own a = 0.5, b = 0.4 were fitted on the alloy 2024-T3 for
    -0.1 < R < 0.7.

    Examples
    --------
    >>> law = elber(C=1e-11, m=3, a=0.5, b=0.4)
    >>> print(f"{law(10.0, 0.0):.4g}")
    1.25e-09
    """

    C: float
    m: float
    a: float
    b: float

    def __post_init__(self) -> None:
        _set(self, C=number(self.C, "elber: C", above=0), m=number(self.m, "elber: m", above=0))
        _set(self, a=number(self.a, "elber: a"), b=number(self.b, "elber: b"))
        if max(self.a, self.a + self.b) <= 0:
            raise ProblemError(
                f"elber: U = {self.a} + {self.b} R is not positive for any R in [0, 1]: nothing "
                "would ever grow."
            )

    def U(self, R: ArrayLike) -> Floats:  # noqa: N802 - Elber's own name
        """Share of the range that opens the crack, in [0, 1]."""
        return np.asarray(np.clip(self.a + self.b * numbers(R, "elber: R"), 0.0, 1.0))[()]

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = _range_and_ratio("elber", dK_eq, R)
        return np.asarray(self.C * (self.U(ratio) * dK) ** self.m)[()]


@dataclass(frozen=True)
class walker:  # noqa: N801 - it is used as a function
    """Growth by a range that the mean load raises.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
        Positive; valid for R = 0.
    m : float
        Exponent, positive.
    gamma : float
        In [0, 1]; 1 makes it the law of Paris.

    Raises
    ------
    ProblemError
        C or m not positive, gamma outside [0, 1].

    Notes
    -----
    da/dN = C (ΔK / (1 - R)^(1 - γ))^m (Walker 1970).

    Examples
    --------
    >>> law = walker(C=1e-11, m=2, gamma=0.5)
    >>> print(f"{law(10.0, 0.75):.3g}")
    4e-09
    """

    C: float
    m: float
    gamma: float

    def __post_init__(self) -> None:
        _set(self, C=number(self.C, "walker: C", above=0), m=number(self.m, "walker: m", above=0))
        _set(self, gamma=number(self.gamma, "walker: gamma", least=0, most=1))

    def __call__(self, dK_eq: ArrayLike, R: ArrayLike) -> Floats:
        """Growth a cycle of each point, length."""
        dK, ratio = _range_and_ratio("walker", dK_eq, R)
        # R = 1 is a load that does not vary: ΔK = 0, and 0/0 must not become nan
        share = np.maximum(1.0 - ratio, np.finfo(float).tiny)
        effective = np.where(dK > 0, dK / share ** (1.0 - self.gamma), 0.0)
        return np.asarray(self.C * effective**self.m)[()]


def _set(law: object, **values: float) -> None:
    """Constants of a law as floats: 3 and 3.0 are the same setting."""
    for name, value in values.items():
        object.__setattr__(law, name, value)


def _range_and_ratio(name: str, dK_eq: ArrayLike, R: ArrayLike) -> tuple[Floats, Floats]:
    """What a law is called with, as arrays that fit each other."""
    dK, ratio = numbers(dK_eq, f"{name}: dK_eq"), numbers(R, f"{name}: R")
    try:
        np.broadcast_shapes(dK.shape, ratio.shape)
    except ValueError as error:
        raise ProblemError(
            f"{name}: dK_eq and R have the shapes {dK.shape} and {ratio.shape}: give one R for "
            "each range, or one for all."
        ) from error
    if (dK < 0).any() or (ratio > 1 + _ROUND_OFF).any():
        raise ProblemError(
            f"{name}: dK_eq from {dK.min():.6g} and R up to {ratio.max():.6g}: a range is not "
            "negative, and R = K_min / K_max is at most 1."
        )
    return dK, ratio


__all__ = ["Law", "elber", "paris", "walker"]
