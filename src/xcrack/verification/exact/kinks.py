"""Where a crack turns: K at the tip of a kink, and the angles that two criteria give."""

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from xcrack.base.arrays import Floats

_PI = np.pi
# Of powers of m = angle / pi: even ones for F11 and F22, odd ones for F12 and F21.
_F11 = (
    1, -3 * _PI**2 / 8, _PI**2 - 5 * _PI**4 / 128,
    _PI**2 / 9 - 11 * _PI**4 / 72 + 119 * _PI**6 / 15360,
    5.07790, -2.88312, -0.0925, 2.996, -4.059, 1.63, 4.1,
)  # fmt: skip
_F12 = (
    -3 * _PI / 2, 10 * _PI / 3 + _PI**3 / 16, -2 * _PI - 133 * _PI**3 / 180 + 59 * _PI**5 / 1280,
    12.313906, -7.32433, 1.5793, 4.0216, -6.915, 4.21, 4.56,
)  # fmt: skip
_F21 = (
    _PI / 2, -(4 * _PI / 3 + _PI**3 / 48), -2 * _PI / 3 + 13 * _PI**3 / 30 - 59 * _PI**5 / 3840,
    -6.176023, 4.44112, -1.5340, -2.0700, 4.684, -3.95, -1.32,
)  # fmt: skip
_F22 = (
    1, -(4 + 3 * _PI**2 / 8), 8 / 3 + 29 * _PI**2 / 18 - 5 * _PI**4 / 128,
    -32 / 15 - 4 * _PI**2 / 9 - 1159 * _PI**4 / 7200 + 119 * _PI**6 / 15360,
    10.58254, -4.78511, -1.8804, 7.280, -7.591, 0.25, 12.5,
)  # fmt: skip


def hoop_angle(K_I: ArrayLike, K_II: ArrayLike) -> Floats:
    """Angle of the largest hoop stress (Erdogan and Sih, 1963).

    Parameters
    ----------
    K_I, K_II : (...), stress √length

    Returns
    -------
    (...), radians
        Its sign is opposite to that of K_II; 0 where K_II is 0. With K_I = 0 it is 70.53°, with
        K_I < 0 more than that, up to 180°.
    """
    K_I, K_II = np.broadcast_arrays(np.asarray(K_I, float), np.asarray(K_II, float))
    d = K_I + np.sqrt(K_I**2 + 8 * K_II**2)
    angle = 2 * np.arctan2(-2 * K_II * np.sign(d + (d == 0)), np.abs(d))
    return np.where(K_II == 0, 0.0, angle)


def hoop_K(K_I: ArrayLike, K_II: ArrayLike, angle: ArrayLike) -> Floats:
    """Hoop stress in a direction, times sqrt(2 pi r).

    Parameters
    ----------
    K_I, K_II : (...), stress √length
    angle : (...), radians

    Returns
    -------
    (...), stress √length
    """
    half = np.asarray(angle, float) / 2
    c, s = np.cos(half), np.sin(half)
    return np.asarray(np.asarray(K_I) * c**3 - 3 * np.asarray(K_II) * c * c * s)


def equivalent_K(
    K_I: ArrayLike, K_II: ArrayLike, K_III: ArrayLike = 0.0, angle: ArrayLike | None = None,
    c3: float = 1 / 0.7,
) -> Floats:  # fmt: skip
    """Root of the square of the hoop K, where it is positive, plus c3 K_III².

    Parameters
    ----------
    K_I, K_II, K_III : (...), stress √length
    angle : (...), radians, optional
        That of `hoop_angle` where it is left out.
    c3 : float
        1 / (1 - nu), as in the energy release rate.

    Returns
    -------
    (...), stress √length
    """
    angle = hoop_angle(K_I, K_II) if angle is None else angle
    opening = np.maximum(hoop_K(K_I, K_II, angle), 0)
    return np.asarray(np.sqrt(opening**2 + c3 * np.asarray(K_III) ** 2))


def kink_factors(angle: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    """K at the tip of a kink of no length (Amestoy and Leblond, 1992).

    Parameters
    ----------
    angle : (...), radians
        Of the kink, below 80° for the digits of the series.

    Returns
    -------
    F11, F12, F21, F22 : (...)
        K_I and K_II of the kink are F11 K_I + F12 K_II and F21 K_I + F22 K_II.
    """
    m = np.asarray(angle, float) / np.pi
    return (
        np.asarray(polyval(m * m, _F11)), np.asarray(m * polyval(m * m, _F12)),
        np.asarray(m * polyval(m * m, _F21)), np.asarray(polyval(m * m, _F22)),
    )  # fmt: skip


def local_symmetry_angle(K_I: float, K_II: float) -> float:
    """Angle at which K_II of a kink vanishes (Goldstein and Salganik, 1974).

    Parameters
    ----------
    K_I, K_II : float, stress √length

    Returns
    -------
    float, radians
    """
    if K_II == 0:
        return 0.0

    def shear(angle: float) -> float:
        _, _, F21, F22 = kink_factors(angle)
        return float(F21 * K_I + F22 * K_II)

    sign = -np.sign(K_II)
    return float(brentq(shear, sign * 1e-9, sign * np.radians(80)))
