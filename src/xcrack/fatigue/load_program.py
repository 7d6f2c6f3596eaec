"""Loads that change as the crack grows: a factor on all of them, or the K that they are to give."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, Either, Function, Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH, TOUGHNESS
from xcrack.fatigue.law import Constants

Curve = Callable[[Floats], ArrayLike] | ArrayLike
_PER_LENGTH = (-1.0, 0.0)
_CURVE = Either(Array((None, 2)), Function("a function, or rows (place, value)"))


class LoadProgram(Constants):
    """What all loads of a run are multiplied by, asked for each solve. Subclasses are dataclasses.

    Attributes
    ----------
    needs_K : bool
        `factors` are asked with K of the loads as they were given, which they scale: for scenes in
        which K is in proportion to them. Else they are known before the solve, of any scene.
    needs_N : bool
        They depend on the cycles, so that they do not follow from a path alone.
    """

    needs_K: ClassVar[bool] = False
    needs_N: ClassVar[bool] = False

    def factors(self, a: Floats, N: Floats, K_max: Floats) -> Floats:
        """Factors `(n,)`.

        Parameters
        ----------
        a : (n,) array, length
            Size of the largest crack as a law is given it: in 2D its length in the body over the
            number of its tips, in 3D its area over the length of its fronts.
        N : (n,) array
            Cycles until then.
        K_max : (n,) array, stress √length
            Largest equivalent K of a cycle under the loads as they were given; nan where these are
            not solved yet.
        """
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class load_over_size(LoadProgram):  # noqa: N801 - it is used as a function
    """Loads times a function of the crack size: load shedding.

    Parameters
    ----------
    function : callable a -> factor, or (n, 2) array
        Called with arrays of sizes (length), positive; or rows (a, factor), linear between them
        and constant beyond.

    Examples
    --------
    >>> import numpy as np
    >>> shed = load_over_size(lambda a: np.sqrt(5.0 / a))
    >>> print(shed.factors(np.array([5.0, 20.0]), None, None).tolist())
    [1.0, 0.5]
    """

    function: Annotated[Curve, _CURVE]

    def factors(self, a: Floats, N: Floats, K_max: Floats) -> Floats:
        """Factors for sizes."""
        return _positive_values(self.function, a, "load_over_size: the factor", "a")


@dataclass(frozen=True, eq=False)
class load_over_cycles(LoadProgram):  # noqa: N801
    """Loads times a function of the cycles so far.

    With friction or steady loads they are those that the last solves foretell for a solve.

    Parameters
    ----------
    function : callable N -> factor, or (n, 2) array
        Called with arrays of cycles, positive; or rows (N, factor), linear between them and
        constant beyond. Where it jumps, a step errs as if it jumped at one of its ends.

    Examples
    --------
    >>> import numpy as np
    >>> rising = load_over_cycles([(0.0, 1.0), (1e5, 2.0)])
    >>> print(rising.factors(None, np.array([5e4]), None).tolist())
    [1.5]
    """

    function: Annotated[Curve, _CURVE]
    needs_N = True

    def factors(self, a: Floats, N: Floats, K_max: Floats) -> Floats:
        """Factors for cycles."""
        return _positive_values(self.function, N, "load_over_cycles: the factor", "N")


@dataclass(frozen=True, eq=False)
class K_over_size(LoadProgram):
    """Loads that give a K by a function of the crack size.

    Parameters
    ----------
    function : callable a -> largest equivalent K of a cycle, or (n, 2) array
        As of `load_over_size` (stress √length): the loads are scaled by it over K of the same
        solve.
    """

    function: Annotated[Curve, _CURVE]
    needs_K = True

    def factors(self, a: Floats, N: Floats, K_max: Floats) -> Floats:
        """Factors for sizes and K of the loads as they were given."""
        return _values_over_K(_positive_values(self.function, a, "K_over_size: K", "a"), K_max)


@dataclass(frozen=True)
class K_gradient(LoadProgram):
    """Constant K, or K that changes by a constant share a length (ASTM E647).

    Parameters
    ----------
    K : float, stress √length
        Largest equivalent K of a cycle at `a0`.
    gradient : float, 1/length
        (dK/da)/K: K exp(gradient (a - a0)). 0: constant K; below 0: for thresholds, where E647 asks
        for -0.08/mm or more.
    a0 : float, length

    Notes
    -----
    ASTM E647, section 8.6 (from memory).

    Examples
    --------
    >>> import numpy as np
    >>> falling = K_gradient(20.0, gradient=-0.08, a0=10.0)
    >>> print(falling.factors(np.array([10.0, 15.0]), None, np.array([20.0, 26.8])).round(3))
    [1.  0.5]
    """

    K: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    gradient: Annotated[float, Number(unit=_PER_LENGTH)] = 0.0
    a0: Annotated[float, Number(unit=LENGTH)] = 0.0
    needs_K = True

    def factors(self, a: Floats, N: Floats, K_max: Floats) -> Floats:
        """Factors for sizes and K of the loads as they were given."""
        return _values_over_K(self.K * np.exp(self.gradient * (a - self.a0)), K_max)


def _positive_values(curve: Any, x: Floats, label: str, of: str) -> Floats:
    """Values of a curve, one for each place.

    Raises
    ------
    ProblemError
        A function that returns something else than positive numbers.
    """
    x = np.asarray(x, dtype=float)
    if callable(curve):
        values = numbers(call_function(curve, label, x), f"{label}({of})")
    else:
        values = np.asarray(np.interp(x, curve[:, 0], curve[:, 1]))
    if values.shape not in ((), x.shape):
        raise ProblemError(
            f"{label}({of}) has the shape {values.shape} for {x.size} places: give one value for "
            "each."
        )
    values = np.broadcast_to(values, x.shape)
    if not (values > 0).all():
        at = x.ravel()[int(np.argmin(values > 0))]
        raise ProblemError(f"{label}({of}) is not positive at {of} = {at:g}.")
    return np.asarray(values)


def _values_over_K(K: Floats, K_max: Floats) -> Floats:
    if not (np.asarray(K_max) > 0).all():
        raise ProblemError(
            "the loads are to give K, but open no crack: K is 0 under those of the problem."
        )
    return np.asarray(K / K_max)


__all__ = [
    "Curve",
    "K_gradient",
    "K_over_size",
    "LoadProgram",
    "load_over_cycles",
    "load_over_size",
]
