"""Cycles until a crack has a length, where the integral of the growth law is known."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats


def paris_life(a0: float, a1: float, C: float, m: float, ds: float, Y: float = 1.0) -> float:
    """Cycles from a0 to a1 by da/dN = C (Y ds sqrt(pi a))^m (Paris and Erdogan, 1963).

    Parameters
    ----------
    a0, a1 : float, length
    C, m : float
        Of the law.
    ds : float, stress
        Range.
    Y : float
        Factor of K, the same for all lengths.

    Returns
    -------
    float
    """
    rate = C * (Y * ds) ** m * np.pi ** (m / 2)
    if m == 2:
        return float(np.log(a1 / a0) / rate)
    return float((a1 ** (1 - m / 2) - a0 ** (1 - m / 2)) / ((1 - m / 2) * rate))


def paris_life_periodic(a0: float, a1: float, W: float, C: float, ds: float) -> float:
    """Cycles of the row of cracks of `fields_2d.periodic_K` from a0 to a1, m = 2.

    Parameters
    ----------
    a0, a1 : float, length
    W : float, length
        Period.
    C : float
        Of the law.
    ds : float, stress
        Range.

    Returns
    -------
    float
    """
    sines = np.sin(np.pi * a1 / W) / np.sin(np.pi * a0 / W)
    return float(np.log(sines) / (np.pi * C * ds**2))


def penny_life(a0: float, a1: float, C: float, m: float, ds: float) -> float:
    """Cycles of a penny under tension, which stays a circle, K = 2 ds sqrt(a / pi).

    Parameters
    ----------
    a0, a1 : float, length
        Radii.
    C, m : float
        Of Paris's law.
    ds : float, stress
        Range.

    Returns
    -------
    float
    """
    return paris_life(a0, a1, C, m, 2 * ds / np.pi)


def elber_share(R: ArrayLike) -> Floats:
    """Share of the range in which a crack is open, 2024-T3 (Elber, 1970): -0.1 < R < 0.7.

    Parameters
    ----------
    R : (...)
        Stress ratio.

    Returns
    -------
    (...)
    """
    return np.asarray(0.5 + 0.4 * np.asarray(R))
