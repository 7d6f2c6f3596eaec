"""One load cycle, and how many of them a crack needs from one length to another."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import exprel

from xcrack.base.arguments import CheckedBy, Declared, Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import entries, number, numbers, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.model.loads import Load


def _load_states(value: Any, label: str, error: type[XcrackError]) -> tuple[Any, ...]:
    """Load states, checked: each a number, or loads."""
    states = entries(value, label, error=error)
    if not states:
        raise error("Cycle(states=...) takes a list of at least one load state.")
    return tuple(_load_state(state, f"{label}[{k}]", error) for k, state in enumerate(states))


def _load_state(state: Any, label: str, error: type[XcrackError]) -> Any:
    if isinstance(state, Real):
        return number(state, label, error=error)
    loads = entries(state, label, error=error)
    for load in loads:
        if not isinstance(load, Load):
            raise error(f"{label} has {value_text(load)}, which is not a load: see traction.")
    return state if isinstance(state, list | tuple) else loads


@dataclass(frozen=True, eq=False)
class Cycle(Declared):
    """The load states of one cycle.

    Parameters
    ----------
    min, max : float, optional
        Two factors on all loads of the problem.
    states : sequence of load states, optional
        Any number of states instead: each a factor, or a list of loads.

    Raises
    ------
    ProblemError
        Neither or both are given, a factor is no finite number, or min > max.

    Examples
    --------
    >>> Cycle(0.1, 1.0).load_states
    (0.1, 1.0)
    """

    min: Annotated[float | None, Number()] = None
    max: Annotated[float | None, Number()] = None
    states: Annotated[Sequence[Any] | None, CheckedBy(_load_states)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.states is None:
            if self.min is None or self.max is None:
                raise ProblemError("Cycle: give min and max, or states=[...].")
            if not self.min <= self.max:
                raise ProblemError(f"Cycle({self.min}, {self.max}): give finite min <= max.")
            return
        if self.min is not None or self.max is not None:
            raise ProblemError("Cycle: give min and max, or states=[...], not both.")

    @property
    def ratio(self) -> float | None:
        """Smallest over largest factor of the cycle, as it was asked for.

        None where that is no ratio of forces: a state that is a list of loads, or no factor > 0.
        """
        factors = [float(state) for state in self.load_states if isinstance(state, Real)]
        if len(factors) < len(self.load_states) or max(factors) <= 0:
            return None
        return min(factors) / max(factors)

    @property
    def load_states(self) -> tuple[Any, ...]:
        """The states as `solve` takes them."""
        return (self.min, self.max) if self.states is None else tuple(self.states)


def cycles_between(a0: ArrayLike, a1: ArrayLike, rate0: ArrayLike, rate1: ArrayLike) -> Floats:
    """Cycles that a crack needs from length a0 to a1, by the power law through both rates.

    Parameters
    ----------
    a0, a1 : (...) array, length
        Crack length before and after, 0 < a0 <= a1.
    rate0, rate1 : (...) array, length/cycle
        da/dN at a0 and at a1.

    Returns
    -------
    (...) array
        Cycles, 0 where a1 = a0. Where the rate falls to exactly 0, or rises to inf, no power law
        passes through both: the rate is then taken to fall in proportion to the cycles, which
        gives 2 (a1 - a0) / rate0, or its inverse to fall to 0 in proportion to the length as close
        to the toughness, which gives half of (a1 - a0) / rate0.

    Raises
    ------
    ProblemError
        Lengths that shrink or are not positive, rates that are negative or nan, or 0 or inf at a0.

    Notes
    -----
    With da/dN = rate0 (a/a0)^g, g = ln(rate1/rate0) / ln(a1/a0):
    ΔN = a0/rate0 [(a1/a0)^(1-g) - 1] / (1-g), which for g → 1 is a0/rate0 ln(a1/a0). Written with
    x = ln(a1/a0) and (e^q - 1)/q, q = (1-g) x, it needs no branch. Exact for every law
    da/dN ~ a^g; else of second order in the steps.

    Examples
    --------
    >>> print(cycles_between(1.0, 2.0, 1e-3, 2e-3).round(6))   # rate ~ a: ln 2 / 1e-3
    693.147181
    """
    a0, a1 = numbers(a0, "crack length a0"), numbers(a1, "crack length a1")
    rate0 = numbers(rate0, "growth rate rate0")
    rate1 = numbers(rate1, "growth rate rate1", must_be_finite=False)
    try:
        np.broadcast_shapes(a0.shape, a1.shape, rate0.shape, rate1.shape)
    except ValueError as error:
        raise ProblemError(
            f"cycles_between: lengths and rates have the shapes {a0.shape}, {a1.shape}, "
            f"{rate0.shape} and {rate1.shape}, which do not fit: give arrays of one shape."
        ) from error
    if not (np.all(a0 > 0) and np.all(a1 >= a0)):
        raise ProblemError(f"crack lengths must be positive and not shrink: from {a0} to {a1}.")
    if not (np.all(rate0 > 0) and np.all(rate1 >= 0)):
        raise ProblemError(
            f"growth rates {rate0} (before) and {rate1} (after) must be positive and not negative."
        )
    x = np.log1p((a1 - a0) / a0)
    stops, is_break = rate1 == 0, np.isinf(rate1)
    q = x - np.log(np.where(stops | is_break, 1.0, rate1 / rate0))
    by_first_rate = (a1 - a0) / rate0
    by_power = np.where(is_break, 0.5 * by_first_rate, a0 / rate0 * x * exprel(q))
    return np.asarray(np.where(stops, 2 * by_first_rate, by_power))[()]


__all__ = ["Cycle", "cycles_between"]
