"""Closures: the share U of a range during which the crack is open, as a value that is called.

A closure stands for what the plastic wake does. Where contact of the crack faces is computed, K
already is that of the closed crack, and a closure for R < 0 would count the same effect twice.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.fatigue.law import Bounds, BoundsRule, Closure, stress_ratio

_LOWEST = -2.0  # f of Newman is constant below


@dataclass(frozen=True)
class linear_closure(Closure):  # noqa: N801 - it is used as a function
    """U as a straight line over R.

    Parameters
    ----------
    a, b : float
        U = a + b R, cut to [0, 1].
    R_range : (float, float)
        Lowest and highest R for which the constants hold; (-0.1, 0.7) for Elber's.

    Raises
    ------
    ProblemError
        Constants that are not finite, bounds that are not in order; called outside the bounds.

    Notes
    -----
    Elber (1971), ASTM STP 486: U = 0.5 + 0.4 R for 2024-T3, -0.1 < R < 0.7.

    Examples
    --------
    >>> print(linear_closure(0.5, 0.4, R_range=(-0.1, 0.7))(0.5))
    0.7
    """

    a: Annotated[float, Number()]
    b: Annotated[float, Number()]
    R_range: Annotated[Bounds, BoundsRule()]

    def __call__(self, R: ArrayLike) -> Floats:
        """Share of the range that opens the crack, in [0, 1]."""
        ratio = _check_range("linear_closure", R, self.R_range)
        return np.asarray(np.clip(self.a + self.b * ratio, 0.0, 1.0))[()]


@dataclass(frozen=True)
class schijve_closure(Closure):  # noqa: N801
    """U as a parabola over R, from -1 to 1.

    Parameters
    ----------
    a, b, c : float
        U = a + b R + c R², cut to [0, 1]; 0.55, 0.33 and 0.12 are those of 2024-T3.

    Raises
    ------
    ProblemError
        Constants that are not finite; called outside -1 to 1.

    Notes
    -----
    Schijve (1981), Eng. Fract. Mech. 14, 461: U = 0.55 + 0.33 R + 0.12 R² for 2024-T3. The
    constants agree with his K_op/K_max = 0.45 + 0.22 R + 0.21 R² + 0.12 R³, of which they are
    (1 - K_op/K_max) / (1 - R).

    Examples
    --------
    >>> print(schijve_closure(0.55, 0.33, 0.12)(0.5).round(3))
    0.745
    """

    a: Annotated[float, Number()]
    b: Annotated[float, Number()]
    c: Annotated[float, Number()]

    def __call__(self, R: ArrayLike) -> Floats:
        """Share of the range that opens the crack, in [0, 1]."""
        ratio = _check_range("schijve_closure", R, (-1.0, 1.0))
        return np.asarray(np.clip(self.a + ratio * (self.b + ratio * self.c), 0.0, 1.0))[()]


@dataclass(frozen=True)
class newman_closure(Closure):  # noqa: N801
    """U from Newman's opening function f = K_op / K_max.

    Parameters
    ----------
    alpha : float
        Constraint, from 1 (plane stress) to 3 (plane strain); up to 6, as 5.845 with S = 1 switches
        closure off.
    S : float
        Largest stress over flow stress, in (0, 1].

    Raises
    ------
    ProblemError
        Constants out of bounds.

    Notes
    -----
    Newman (1984), Int. J. Fracture 24, R131, in the form of Forman and Mettu (1992), ASTM STP 1131:
    f = max(R, A0 + A1 R + A2 R² + A3 R³) for R >= 0 and A0 + A1 R below, constant below R = -2;
    A0 = (0.825 - 0.34 α + 0.05 α²) cos(π S/2)^(1/α), A1 = (0.415 - 0.071 α) S,
    A3 = 2 A0 + A1 - 1, A2 = 1 - A0 - A1 - A3; U = (1 - f) / (1 - R).

    Examples
    --------
    >>> closure = newman_closure(alpha=2.0, S=0.3)
    >>> print(closure.f(0.0).round(6), closure(0.5).round(6))
    0.325656 0.903869
    """

    alpha: Annotated[float, Number(least=1, most=6)]
    S: Annotated[float, Number(above=0, most=1)]

    @property
    def A(self) -> tuple[float, float, float, float]:  # noqa: N802 - Newman's own name
        """The four coefficients; they add up to 1."""
        alpha, S = self.alpha, self.S
        opening = 0.0 if S == 1 else np.cos(np.pi * S / 2) ** (1 / alpha)
        A0 = float((0.825 - 0.34 * alpha + 0.05 * alpha**2) * opening)
        A1 = (0.415 - 0.071 * alpha) * S
        A3 = 2 * A0 + A1 - 1
        return A0, A1, 1 - A0 - A1 - A3, A3

    def f(self, R: ArrayLike) -> Floats:
        """K at opening over K_max."""
        A0, A1, A2, A3 = self.A
        ratio = stress_ratio("newman_closure", R)
        part = np.maximum(ratio, 0.0)
        at_positive_R = np.maximum(part, A0 + part * (A1 + part * (A2 + part * A3)))
        at_negative_R = A0 + A1 * np.maximum(ratio, _LOWEST)
        return np.asarray(np.where(ratio >= 0, at_positive_R, at_negative_R))[()]

    def __call__(self, R: ArrayLike) -> Floats:
        """Share of the range that opens the crack, in [0, 1]; 1 for R = 1."""
        ratio = stress_ratio("newman_closure", R)
        one_less_ratio = 1 - ratio
        return np.asarray(
            np.divide(
                1 - self.f(ratio),
                one_less_ratio,
                out=np.ones_like(one_less_ratio),
                where=one_less_ratio > 0,
            )
        )[()]


def _check_range(name: str, R: ArrayLike, bounds: Bounds) -> Floats:
    ratio = numbers(R, f"{name}: R")
    is_outside = (ratio < bounds[0]) | (ratio > bounds[1])
    if is_outside.any():
        raise ProblemError(
            f"{name}: R = {ratio[is_outside].flat[0]:.6g} is outside {bounds[0]:g} to "
            f"{bounds[1]:g}, where U was measured: take another closure for it."
        )
    return ratio


__all__ = ["linear_closure", "newman_closure", "schijve_closure"]
