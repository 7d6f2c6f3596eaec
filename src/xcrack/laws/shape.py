"""What a power of the range becomes near the threshold and near the toughness."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.inputs import number, shown
from xcrack.laws.law import largest_K, sizes
from xcrack.laws.thresholds import Threshold

Approach = str | float


def check_approach(name: str, approach: Any, threshold: Threshold | None) -> Approach:
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


__all__ = ["Approach", "check_approach", "shaped"]
