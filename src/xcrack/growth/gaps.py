"""How fast the last ligament between two cracks breaks: K grows as they come closer."""

import numpy as np
from scipy.special import ellipe, ellipk

from xcrack.base.arrays import Floats

# Of what cycles differ by from those at the last rate: what is unsure of them. Tips are those of
# cracks of which one is up to five times as long as the other.
UNKNOWN_OF_TIPS, UNKNOWN_OF_FRONTS = 0.1, 0.25

_A, _P, _B, _Q = 0.0977222, 0.575392, 3.22635, 1.32721  # fitted to 0.2 % from x = 0.03 to 4
_POINTS = 48


def amplification(x: Floats, dim: int = 3) -> Floats:
    """K where two equal cracks face each other at a gap of x radii, over K of one alone.

    Notes
    -----
    In 3D pennies in one plane, fitted to Fabrikant (1987); in 2D collinear cracks, radius being
    half their length: exact (Tada, Paris and Irwin 2000, 5.20).
    """
    if dim == 3:
        return np.asarray(1 + _A * x**-_P / (1 + _B * x**_Q))
    inner_tip, outer_tip = x / 2, x / 2 + 2
    m = 1 - (inner_tip / outer_tip) ** 2
    opening = outer_tip**2 * ellipe(m) / ellipk(m) - inner_tip**2
    return np.asarray(opening / np.sqrt(inner_tip * (outer_tip**2 - inner_tip**2)))


def part_of_time(x: float, exponent: float, dim: int = 3) -> float:
    """Time in which a gap of x radii closes, over the time at the rate of its beginning.

    Parameters
    ----------
    x : float
        Gap over radius.
    exponent : float
        Of the growth law.
    dim : {2, 3}

    Returns
    -------
    float
        Below 1: the mean of (f(x)/f)^m over the gap, f the amplification.

    Examples
    --------
    >>> print(round(part_of_time(0.5, 3.0), 2), round(part_of_time(4.0, 3.0), 2))
    0.73 0.93
    """
    u, weight = np.polynomial.legendre.leggauss(_POINTS)
    u = (u + 1) / 2
    # Points crowd towards the end of the gap, where K is singular.
    ratio = (amplification(np.array([x]), dim) / amplification(x * u**2, dim)) ** exponent
    return float((weight / 2 * 2 * u * ratio).sum())


__all__ = ["UNKNOWN_OF_FRONTS", "UNKNOWN_OF_TIPS", "amplification", "part_of_time"]
