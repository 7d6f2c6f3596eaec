"""K at the tip of a kink of no length, and where a criterion turns it no further.

A criterion is made for a tip whose crack is straight. At a kink of finite angle it is asked again
on the kink, until it goes straight on: growth begins there, not in its first answer.
"""

from collections.abc import Callable

import numpy as np

from xcrack.base.arrays import Bools, Floats

Turn = Callable[[Floats], Floats]  # K (s, f, 2) -> kink angle (f,), rad

START = np.radians(3.0)  # a smaller turn is its own limit to 0.02 degrees
_PASSES = 30
_ROUND_OFF = 1e-8  # rad
_CONVERGED = 1e-3  # rad
_MOST = np.radians(100.0)  # the series is good to 1e-4 up to 80 degrees


def kinked_K(K: Floats, angle: Floats) -> Floats:
    """Factors at the tip of a kink of no length.

    Parameters
    ----------
    K : (..., 2) array, stress √length
        K_I, K_II of the crack without the kink.
    angle : (...) array, rad
        Of the kink, positive towards the crack normal.

    Returns
    -------
    (..., 2) array, stress √length

    Notes
    -----
    K* = F(θ) K with the series of F in θ/π of Amestoy and Leblond (1992), *Crack paths in plane
    situations* II; faces free of traction.
    """
    m = np.asarray(angle) / np.pi
    K = np.asarray(K)
    F = [np.polynomial.polynomial.polyval(m, series) for series in _SERIES]
    return np.stack(
        [F[0] * K[..., 0] + F[1] * K[..., 1], F[2] * K[..., 0] + F[3] * K[..., 1]], axis=-1
    )


def limit_angles(turn: Turn, K: Floats) -> tuple[Floats, Bools]:
    """Angles of a first kink from which a criterion turns no further.

    Parameters
    ----------
    turn : callable
        Kink angle by the criterion.
    K : (s, f, 2) array, stress √length
        Of s load states at f tips.

    Returns
    -------
    angle : (f,) array, rad
    converged : (f,) array of bool
        Elsewhere there is no such angle within 100 degrees.
    """
    angle = np.zeros(K.shape[1])
    more = np.full(K.shape[1], np.inf)
    for _ in range(_PASSES):
        more = turn(kinked_K(K, angle))
        angle = np.clip(angle + more, -_MOST, _MOST)
        if (np.abs(more) < _ROUND_OFF).all():
            break
    return angle, (np.abs(more) < _CONVERGED) & (np.abs(angle) < _MOST)


def _series() -> tuple[Floats, ...]:
    """Coefficients of F_11, F_12, F_21, F_22 over (θ/π)^0, (θ/π)^1, ..."""
    p = np.pi
    F = np.zeros((4, 21))
    F[0, ::2] = [
        1, -3 * p**2 / 8, p**2 - 5 * p**4 / 128, p**2 / 9 - 11 * p**4 / 72 + 119 * p**6 / 15360,
        5.07790, -2.88312, -0.0925, 2.996, -4.059, 1.63, 4.1,
    ]  # fmt: skip
    F[1, 1::2] = [
        -3 * p / 2, 10 * p / 3 + p**3 / 16, -2 * p - 133 * p**3 / 180 + 59 * p**5 / 1280,
        12.313906, -7.32433, 1.5793, 4.0216, -6.915, 4.21, 4.56,
    ]  # fmt: skip
    F[2, 1::2] = [
        p / 2, -4 * p / 3 - p**3 / 48, -2 * p / 3 + 13 * p**3 / 30 - 59 * p**5 / 3840,
        -6.176023, 4.44112, -1.5340, -2.0700, 4.684, -3.95, -1.32,
    ]  # fmt: skip
    F[3, ::2] = [
        1, -4 - 3 * p**2 / 8, 8 / 3 + 29 * p**2 / 18 - 5 * p**4 / 128,
        -32 / 15 - 4 * p**2 / 9 - 1159 * p**4 / 7200 + 119 * p**6 / 15360,
        10.58254, -4.78511, -1.8804, 7.280, -7.591, 0.25, 12.5,
    ]  # fmt: skip
    return tuple(F)


_SERIES = _series()

__all__ = ["START", "Turn", "kinked_K", "limit_angles"]
