"""How fast the last ligament between two coplanar fronts breaks.

K at the point where one penny faces an equal one in its plane, over K of one alone, follows from
Fabrikant's kernel (1987, Acta Mechanica 67, 39): each penny loads the other by the traction ahead
of it. With x the gap over the radius it is 1.02 at 1, 1.18 at 0.2, 1.71 at 0.03, and grows without
bound.
"""

import numpy as np

from xcrack.arrays import Floats

_A, _P, _B, _Q = 0.0977222, 0.575392, 3.22635, 1.32721  # fitted to 0.2 % from x = 0.03 to 4
_POINTS = 48


def amplification(x: Floats) -> Floats:
    """K of a penny that faces an equal one at a gap of x radii, over K of one alone."""
    return np.asarray(1 + _A * x**-_P / (1 + _B * x**_Q))


def part_of_time(x: float, exponent: float) -> float:
    """Time in which a gap of x radii closes, over the time at the rate of its beginning.

    Parameters
    ----------
    x : float
        Gap over radius.
    exponent : float
        Of the growth law.

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
    ratio = (amplification(np.array([x])) / amplification(x * u**2)) ** exponent
    return float((weight / 2 * 2 * u * ratio).sum())


__all__ = ["amplification", "part_of_time"]
