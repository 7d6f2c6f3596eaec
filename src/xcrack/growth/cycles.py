"""Number of load cycles between two states of a growing crack."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import exprel

from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.growth.step import PerCrack


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
    rate1 = numbers(rate1, "growth rate rate1", finite=False)
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
    stops, breaks = rate1 == 0, np.isinf(rate1)
    q = x - np.log(np.where(stops | breaks, 1.0, rate1 / rate0))
    by_first_rate = (a1 - a0) / rate0
    by_power = np.where(breaks, 0.5 * by_first_rate, a0 / rate0 * x * exprel(q))
    return np.asarray(np.where(stops, 2 * by_first_rate, by_power))[()]


def elapsed(
    length: Sequence[float],
    da: PerCrack,
    rate0: PerCrack,
    rate1: Sequence[Sequence[float | None]],
) -> float:
    """Cycles of one step, by the local power law of the tip that drives it.

    The driving tip is the one with the largest rate of those that moved, and that are still
    there: a tip that has left the body has no rate after the step. If none is left, the rate
    before the step stands for the whole of it.

    Parameters
    ----------
    length : sequence of float, length
        Length of each crack before the step. A tip is given the part of it that its advance has
        in that of its crack: half for each tip of a crack that grows evenly.
    da, rate0 : tuple of (f,) arrays
        Advance of each tip, and growth a cycle before the step.
    rate1 : sequence of sequence of float or None
        Growth a cycle after the step, None at tips that are gone.

    Returns
    -------
    float
    """
    moved = [
        (c, j) for c, d in enumerate(da) for j in range(len(d)) if d[j] > 0 and rate0[c][j] > 0
    ]
    stay = [(c, j) for c, j in moved if rate1[c][j] is not None]
    c, j = max(stay or moved, key=lambda tip: rate0[tip[0]][tip[1]])
    after = rate1[c][j]
    if after is None:
        return float(da[c][j] / rate0[c][j])
    a = length[c] * float(da[c][j] / da[c].sum())
    return float(cycles_between(a, a + da[c][j], rate0[c][j], after))


# Number of load cycles between two states of growing 3D cracks.

_DRIVING = 0.5  # share of the largest rate from which on a point counts as driving


def elapsed_3d(
    size0: Sequence[float],
    size1: Sequence[float],
    da: Sequence[Floats],
    rate0: Sequence[Floats],
    rate1: Sequence[Floats],
) -> float:
    """Cycles of one step of 3D cracks, by the power law of the point that drives it.

    Parameters
    ----------
    size0, size1 : sequence of float, length
        `surface_size` of each crack before and after the step.
    da, rate0 : sequence of (f,) arrays
        Advance of the places along the fronts of each crack, and growth a cycle before the step.
    rate1 : sequence of (f,) arrays, length/cycle
        Growth a cycle after the step where these places have come to (see `carried`), nan where
        they have left the body, inf where the toughness is reached.

    Returns
    -------
    float

    Raises
    ------
    ProblemError
        No place with a rate has advanced.

    Notes
    -----
    The driving point is the one with the largest rate of those that moved and are still there;
    if none is, the rate before the step stands for the whole of it. Its rate is taken as a power
    of the size, which is proportional to the advance within the step: with x = ln(size1/size0),
    y = ln(rate1/rate0) and E(q) = (e^q - 1)/q the step takes da/rate0 E(x - y)/E(x) cycles. For
    a straight front, and for any front that keeps its shape, this is `cycles_between`. y is that
    of all points of the crack which grow at least half as fast, so that the scatter of K from
    point to point averages out.

    Examples
    --------
    >>> import numpy as np
    >>> one, two = np.full(4, 1e-3), np.full(4, 2e-3)      # a penny, rate ~ radius
    >>> print(round(elapsed_3d([0.5], [1.0], [np.full(4, 1.0)], [one], [two]), 6))
    693.147181
    """
    moved = [(d > 0) & (r > 0) for d, r in zip(da, rate0)]
    if not any(m.any() for m in moved):
        raise ProblemError("no point of a front with a growth rate has advanced.")
    stay = [m & ~np.isnan(r) for m, r in zip(moved, rate1)]
    there = any(m.any() for m in stay)
    largest = [float(r[m].max(initial=-1.0)) for r, m in zip(rate0, stay if there else moved)]
    c = int(np.argmax(largest))
    driving = (stay if there else moved)[c] & (rate0[c] >= largest[c])
    j = int(np.argmax(driving))
    by_first_rate = float(da[c][j] / rate0[c][j])
    if not there:
        return by_first_rate
    fast = stay[c] & (rate0[c] >= _DRIVING * largest[c])
    if np.isinf(rate1[c][fast]).any():
        return 0.5 * by_first_rate  # as in `cycles_between`
    ratio = float(rate1[c][fast].sum() / rate0[c][fast].sum())
    if ratio == 0:
        return 2 * by_first_rate
    x, y = np.log(size1[c] / size0[c]), np.log(ratio)
    return by_first_rate * float(exprel(x - y) / exprel(x))


__all__ = ["cycles_between", "elapsed", "elapsed_3d"]
