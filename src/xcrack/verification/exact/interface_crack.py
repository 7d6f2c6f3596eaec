"""Crack along the interface of two half-planes (England, 1965; Rice and Sih, 1965)."""

import numpy as np

from xcrack.base.arrays import Bools, Floats
from xcrack.verification.exact.potentials_2d import Complexes, Plane, kolosov, shear_modulus

Constants = tuple[float, float]  # E, nu


def _slopes(upper: Constants, lower: Constants, plane: Plane) -> tuple[float, float]:
    """a_1 and a_2, by which both potentials of a half-plane follow from one function."""
    (k_1, mu_1), (k_2, mu_2) = (
        (kolosov(nu, plane), shear_modulus(E, nu)) for E, nu in (upper, lower)
    )
    return k_1 / mu_1 + 1 / mu_2, k_2 / mu_2 + 1 / mu_1


def oscillation(upper: Constants, lower: Constants, plane: Plane = "strain") -> float:
    """Index epsilon of the stress at a tip of a crack between two half-planes.

    >>> round(oscillation((3.0, 0.3), (1.0, 0.3)), 5)
    -0.04579
    """
    a_1, a_2 = _slopes(upper, lower, plane)
    return float(np.log(a_1 / a_2) / (2 * np.pi))


def intensity(
    pressure: float, half_length: float, upper: Constants, lower: Constants, plane: Plane = "strain"
) -> complex:
    """K_1 + i K_2 of faces that are pressed apart, r measured in lengths of the crack.

    Rice and Sih, 1965 (J. Appl. Mech. 32, 418): p √(pi a) (1 + 2 i epsilon).
    """
    turn = 1 + 2j * oscillation(upper, lower, plane)
    return complex(pressure * np.sqrt(np.pi * half_length) * turn)


def displacement(
    x: Floats,
    pressure: float,
    half_length: float,
    upper: Constants,
    lower: Constants,
    plane: Plane = "strain",
) -> Floats:
    """Displacement of planes whose crack from (-a, 0) to (a, 0) bears a pressure.

    Parameters
    ----------
    x : (n, 2) array, length
    pressure : float, stress
    half_length : float, length
    upper, lower : tuple of float
        E (stress) and nu of the half-planes y > 0 and y < 0.
    plane : {"strain", "stress"}

    Returns
    -------
    (n, 2) array, length
    """
    a_1, a_2 = _slopes(upper, lower, plane)
    epsilon, a = oscillation(upper, lower, plane), half_length
    scale = pressure * a_1 * a_2 / (a_1 + a_2)
    is_above: Bools = np.asarray(x[:, 1] >= 0)
    z: Complexes = x[:, 0] + 1j * x[:, 1]

    def logarithm(w: Complexes, is_upper: Bools) -> Complexes:
        angle = np.angle(w)
        angle = np.where(is_upper & (angle < 0), angle + 2 * np.pi, angle)
        return np.log(np.abs(w)) + 1j * np.where(~is_upper & (angle > 0), angle - 2 * np.pi, angle)

    def integral(z: Complexes, is_upper: Bools) -> Complexes:
        log_left, log_right = logarithm(z + a, is_upper), logarithm(z - a, is_upper)
        power = np.exp((0.5 - 1j * epsilon) * log_right + (0.5 + 1j * epsilon) * log_left)
        return np.asarray(scale * (power - z))

    log_below, log_above = logarithm(z + a, is_above), logarithm(z - a, is_above)
    power = np.exp((-0.5 - 1j * epsilon) * log_above + (-0.5 + 1j * epsilon) * log_below)
    slope = scale * ((z - 2j * epsilon * a) * power - 1)
    own_factor, other = np.where(is_above, a_1, a_2), np.where(is_above, a_2, a_1)
    k = np.where(is_above, kolosov(upper[1], plane), kolosov(lower[1], plane))
    mu = np.where(is_above, shear_modulus(*upper), shear_modulus(*lower))
    phi, omega = integral(z, is_above) / own_factor, integral(np.conj(z), ~is_above) / other
    u = (k * phi - omega - (z - np.conj(z)) * np.conj(slope / own_factor)) / (2 * mu)
    return np.stack([u.real, u.imag], axis=1)


__all__ = ["displacement", "intensity", "oscillation"]
