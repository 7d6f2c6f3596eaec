"""Sizes that the cells of the next mesh are to have, from their shares of the errors."""

import numpy as np

from xcrack.base.arrays import Floats

_MOST = 5  # bisections of a cell in one round
_STEPS = 60  # in which a threshold is halved in on


def size_ratios(shares: Floats, bar: Floats, target: float, order: int, dim: int) -> Floats:
    """Size of each cell in the next mesh over its size in this one.

    A cell's share falls with its size to the power of 2 p + d, while 1 / size^d such cells take its
    place. With the fewest of them all shares are alike: those above a threshold go down to it, and
    the threshold is such that bars, which follow the sum of the shares, are as wanted.

    Parameters
    ----------
    shares : (k, m) array
        Contributions of the cells to the errors of k values.
    bar : (k,) array
        Half-widths of these errors; nan where there is none, and the shares alone count.
    target : float
        Half-width that all are to have.
    order, dim : int

    Returns
    -------
    (m,) array
        Between `2^(-5 / dim)`, the most that bisection does in a round, and 1.
    """
    power = 2 * order + dim
    ratio = np.ones(shares.shape[1])
    for each, half in zip(shares, bar, strict=True):
        total = each.sum()
        error = half if np.isfinite(half) else total
        if not total > 0 or error <= target:
            continue
        aim = target * total / error
        low, high = 0.0, float(each.max())
        for _ in range(_STEPS):
            threshold = (low + high) / 2
            left = np.minimum(each, threshold) ** (2 * order / power)
            left *= each ** (dim / power)
            low, high = (threshold, high) if left.sum() < aim else (low, threshold)
        above = each > low
        ratio[above] = np.minimum(ratio[above], (max(low, 1e-300) / each[above]) ** (1 / power))
    return np.maximum(ratio, 2.0 ** (-_MOST / dim))


__all__ = ["size_ratios"]
