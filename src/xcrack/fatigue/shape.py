"""What a power of the range becomes near the threshold and near the toughness."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, shown
from xcrack.base.errors import ProblemError
from xcrack.fatigue.law import (
    Bounds,
    Ratio,
    WithUnits,
    check_bounds,
    check_ratio,
    largest_K,
    sizes,
    toughness,
)
from xcrack.fatigue.thresholds import Threshold, check_threshold

Approach = str | float


class Shaped(WithUnits):
    """A law that may have a threshold, and bounds of R: what `paris` shares with its kin."""

    threshold: Threshold | None
    approach: Approach
    K_c: float | None
    ratio: Ratio | None
    R_range: Bounds | None

    @property
    def needs(self) -> tuple[str, ...]:
        """What it asks for beside the range and R."""
        return () if self.threshold is None else self.threshold.needs

    def _check_shape(self) -> None:
        """Refuse parts that are none, at the end of a law's own checks."""
        name = type(self).__name__
        check_threshold(name, self.threshold)
        approach = _check_approach(name, self.approach, self.threshold)
        object.__setattr__(self, "approach", approach)
        object.__setattr__(self, "K_c", toughness(name, self.K_c))
        check_ratio(name, self.ratio)
        object.__setattr__(self, "R_range", check_bounds(name, self.R_range))


def _check_approach(name: str, approach: Any, threshold: Threshold | None) -> Approach:
    """The way to the threshold: "cut", "difference", or an exponent."""
    if isinstance(approach, str):
        if approach not in ("cut", "difference"):
            raise ProblemError(
                f'{name}: approach = {shown(approach)}: give "cut", "difference" or an exponent p.'
            )
    else:
        approach = number(approach, f"{name}: approach", above=0)
    if threshold is None and approach != "cut":
        raise ProblemError(
            f"{name}: approach = {shown(approach)} without a threshold: give threshold=."
        )
    return approach


def shaped(
    rate: Callable[[Floats], Floats],
    dK: Floats,
    R: Floats,
    a: ArrayLike | None,
    *,
    threshold: Threshold | None,
    approach: Approach,
    K_c: float | None,
) -> Floats:
    """Growth a cycle with threshold and toughness.

    Parameters
    ----------
    rate : callable dK -> length/cycle
        The law between the two, for these ratios R.
    dK, R : arrays
    a : array, optional
        Crack size, where the threshold asks for it.
    threshold, approach, K_c
        As of `paris`.
    """
    a = sizes("the law", a, np.broadcast_shapes(dK.shape, R.shape))
    result = np.asarray(rate(dK))
    if threshold is not None:
        least = np.asarray(threshold(R, a))
        if approach == "difference":
            result = result - rate(np.broadcast_to(least, result.shape))
        elif approach != "cut":
            share = np.divide(least, dK, out=np.ones(result.shape), where=dK > 0)
            result = result * np.maximum(1 - share, 0.0) ** float(approach)
        result = np.where(dK > least, result, 0.0)
    if K_c is not None:
        result = np.where(largest_K(dK, R) >= K_c, np.inf, result)
    return np.asarray(result)


__all__ = ["Approach", "Shaped", "shaped"]
