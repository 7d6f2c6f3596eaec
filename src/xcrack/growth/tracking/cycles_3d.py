"""Number of load cycles between two states of growing 3D cracks."""

from collections.abc import Sequence

import numpy as np
from scipy.special import exprel

from xcrack.arrays import Floats
from xcrack.errors import ProblemError

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


__all__ = ["elapsed_3d"]
