"""How fast the last ligament between fronts breaks: K grows as they come closer."""

import numpy as np
from scipy.special import ellipe, ellipk

from xcrack.base.arrays import Floats

# Of what cycles differ by from those at the last rate: what is unsure of them. Tips are those of
# cracks of which one is up to five times as long as the other.
UNKNOWN_OF_TIPS, UNKNOWN_OF_FRONTS = 0.1, 0.25

_A, _P, _B, _Q = 0.0977222, 0.575392, 3.22635, 1.32721  # fitted to 0.2 % from x = 0.03 to 4
_POINTS = 48

# K of an annular crack over that of a strip as wide, fitted to 2e-4 from x = 0.003 to 0.9: of the
# inner front times √x, and of the outer one. First terms are those of a punch inside a penny.
_INNER, _OUTER = 4 * np.sqrt(2) / np.pi**2, 2 * np.sqrt(2) / np.pi
_OF_INNER, _OF_OUTER = (0.08911, -0.03711), (-0.01394, -0.00796)
_STEPS = 64  # of the radius of a ligament that closes


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


def annulus_factors(x: float) -> tuple[float, float]:
    """K of the inner front of an annular crack times √x, and of the outer one, x < 1.

    Parameters
    ----------
    x : float
        Radius of the ligament over that of the outer front.

    Returns
    -------
    (float, float)
        Over p √(π b), p the pressure inside and b the radius of the outer front.

    Notes
    -----
    In a body without sides; fitted to the integral equation of a penny whose opening is zero
    within the ligament.
    """
    strip = np.sqrt((1 - x) / 2)

    def factor(limit: float, bend: tuple[float, float]) -> float:
        return float(strip * (limit + (1 - limit) * x + x * (1 - x) * (bend[0] + bend[1] * x)))

    return factor(_INNER, _OF_INNER), factor(_OUTER, _OF_OUTER)


def closing_annulus(
    inner_radius: float,
    outer_radius: float,
    rates: tuple[float, float],
    exponent: float,
    growth_beside: float = 1.0,
) -> tuple[float, float, float]:
    """How long the ligament inside an annular crack lasts, and how far the outer front comes.

    Parameters
    ----------
    inner_radius, outer_radius : float, length
    rates : (float, float), length/cycle
        Of the inner front and the outer one now.
    exponent : float
        Of the growth law.
    growth_beside : float
        By how much rates have grown at the end beyond what the annulus alone says, as the body
        around it gives way: in proportion to what of the ligament is gone.

    Returns
    -------
    cycles : float
    advance : float, length
        Of the outer front.
    outer_rate : float, length/cycle
        Of the outer front once the ligament is gone.

    Examples
    --------
    >>> cycles, advance, rate = closing_annulus(0.05, 1.0, (1e-3, 1e-4), 3.0)
    >>> print(round(cycles * 1e-3 / 0.05, 3), round(advance, 4))
    0.404 0.0021
    """
    inner_rate, outer_rate = rates

    def ratios(c: float, b: float) -> tuple[float, float]:
        inner_factor, outer_factor = annulus_factors(c / b)
        return inner_factor * b, outer_factor * np.sqrt(b)

    first_inner, first_outer = ratios(inner_radius, outer_radius)

    def slopes(s: float, b: float) -> tuple[float, float]:
        """Of cycles and of b, over s from 1 to 0: the radius of the ligament is that of now, s²."""
        inner_K, outer_K = ratios(inner_radius * s * s, b)
        softening = growth_beside ** (1 - s * s)
        rate_of_ligament = inner_rate * (inner_K / first_inner) ** exponent * softening
        cycles_of_s = 2 * inner_radius * s ** (1 + exponent) / rate_of_ligament
        return cycles_of_s, cycles_of_s * outer_rate * (
            outer_K / first_outer
        ) ** exponent * softening

    cycles, b, h = 0.0, outer_radius, 1 / _STEPS
    for k in range(_STEPS):  # the rule of the middle
        s = 1 - k * h
        b_middle = b + h / 2 * slopes(s, b)[1]
        in_cycles, in_radius = slopes(s - h / 2, b_middle)
        cycles, b = cycles + h * in_cycles, b + h * in_radius
    last_rate = outer_rate * (ratios(0.0, b)[1] / first_outer) ** exponent * growth_beside
    return float(cycles), float(b - outer_radius), float(last_rate)


__all__ = [
    "UNKNOWN_OF_FRONTS",
    "UNKNOWN_OF_TIPS",
    "amplification",
    "annulus_factors",
    "closing_annulus",
    "part_of_time",
]
