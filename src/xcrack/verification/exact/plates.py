"""Stress intensity factors of cracked plates and strips: tables, and formulas fitted to tables.

A factor is K / (s sqrt(pi a)) for the stress s that the entry names.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.verification.exact.potentials_2d import Complexes, Plane, Values, potential_field

EDGE_HALFPLANE = 1.1215222552
"""Edge crack in a half plane under tension (Koiter, 1965)."""

STRIP_EDGE_TENSION: Mapping[float, float] = MappingProxyType({
    0.1: 1.1892, 0.2: 1.3673, 0.3: 1.6599, 0.4: 2.1114, 0.5: 2.8246,
    0.6: 4.0332, 0.7: 6.3549, 0.8: 11.955, 0.9: 34.633,
})  # fmt: skip
"""a / W to factor: edge crack in a long strip under tension (Kaya and Erdogan, 1987)."""

STRIP_EDGE_BENDING: Mapping[float, float] = MappingProxyType({
    0.1: 1.0472, 0.2: 1.0553, 0.3: 1.1241, 0.4: 1.2606, 0.5: 1.4972,
    0.6: 1.9140, 0.7: 2.7252, 0.8: 4.6764, 0.9: 12.462,
})  # fmt: skip
"""a / W to factor: edge crack in a long strip in bending (Kaya and Erdogan, 1987)."""

STRIP_CENTRE: Mapping[float, float] = MappingProxyType({
    0.1: 1.0060, 0.2: 1.0246, 0.3: 1.0577, 0.4: 1.1094, 0.5: 1.1867,
    0.6: 1.3033, 0.7: 1.4884, 0.8: 1.8169, 0.9: 2.585,
})  # fmt: skip
"""a / W to factor: centre crack of length 2 a in a long strip of width 2 W (Isida, 1971)."""

PLATE_EDGE: Mapping[tuple[float, float], float] = MappingProxyType({
    (1.0, 0.2): 1.36822, (1.0, 0.3): 1.66114, (1.0, 0.4): 2.11277, (1.0, 0.5): 2.82547,
    (1.0, 0.6): 4.03334,
})  # fmt: skip
"""(H / W, a / W) to factor: edge crack in a plate of height 2 H under uniform traction on its ends.

Least squares on the boundary with Williams' functions, good to 1e-5.
"""

PLATE_CENTRE: Mapping[tuple[float, float], float] = MappingProxyType({
    (1.0, 0.2): 1.05538, (1.0, 0.3): 1.12319, (1.0, 0.4): 1.21605, (1.0, 0.5): 1.33371,
    (1.0, 0.6): 1.48078, (1.0, 0.7): 1.67714, (2.0, 0.2): 1.02487, (2.0, 0.3): 1.05830,
    (2.0, 0.4): 1.11018, (2.0, 0.5): 1.18764, (2.0, 0.6): 1.30431, (2.0, 0.7): 1.48912,
})  # fmt: skip
"""The same for a centre crack of length 2 a in a plate of width 2 W."""

BOWIE: Mapping[float, tuple[float, float, float, float]] = MappingProxyType({
    0.01: (3.29338, 3.29318, 2.21330, 2.21316), 0.05: (3.04157, 3.03734, 2.10740, 2.10451),
    0.1: (2.78650, 2.77272, 1.99873, 1.98909), 0.2: (2.41302, 2.37459, 1.83566, 1.80767),
    0.3: (2.15621, 2.09286, 1.71923, 1.67155), 0.4: (1.97115, 1.88547, 1.63189, 1.56560),
    0.5: (1.83279, 1.72787, 1.56386, 1.48076), 0.6: (1.72620, 1.60491, 1.50929, 1.41129),
    0.8: (1.57419, 1.42712, 1.42694, 1.30426), 1.0: (1.47213, 1.30610, 1.36756, 1.22561),
    1.5: (1.32348, 1.12724, 1.27234, 1.09744), 2.0: (1.24452, 1.03067, 1.21581, 1.02022),
    3.0: (1.16355, 0.92971, 1.15189, 0.93160), 5.0: (1.09822, 0.84553, 1.09490, 0.85055),
    10.0: (1.04928, 0.77930, 1.04876, 0.78255),
})  # fmt: skip
"""a / R to factors: cracks of length a from a hole of radius R in an infinite plate (Bowie, 1956).

Two cracks and one crack under tension across them, then both under equal tension along x and y.
"""


def strip_centre_K(share: ArrayLike) -> Floats:
    """Factor of a centre crack in a long strip, good to 0.1 % (Tada, Paris and Irwin).

    Parameters
    ----------
    share : (...)
        a / W of a crack of length 2 a in a width 2 W.

    Returns
    -------
    (...)
    """
    al = np.asarray(share, float)
    return np.asarray((1 - 0.025 * al**2 + 0.06 * al**4) * np.sqrt(1 / np.cos(np.pi * al / 2)))


def strip_edge_K(share: ArrayLike) -> Floats:
    """Factor of an edge crack in a long strip under tension, good to 0.5 % (Tada, Paris and Irwin).

    Parameters
    ----------
    share : (...)
        a / W.

    Returns
    -------
    (...)
    """
    half = np.pi * np.asarray(share, float) / 2
    shape = 0.752 + 2.02 * np.asarray(share, float) + 0.37 * (1 - np.sin(half)) ** 3
    return np.asarray(np.sqrt(np.tan(half) / half) * shape / np.cos(half))


def strip_bending_K(share: ArrayLike) -> Floats:
    """Factor of an edge crack in bending, to 0.4 % up to a / W = 0.6 (Brown and Srawley, 1966).

    Parameters
    ----------
    share : (...)
        a / W.

    Returns
    -------
    (...)
    """
    al = np.asarray(share, float)
    return np.asarray(1.122 - 1.40 * al + 7.33 * al**2 - 13.08 * al**3 + 14.0 * al**4)


def newman_raju_surface(
    phi: ArrayLike, a: float, c: float, t: float, b: float, S_t: float = 1.0, S_b: float = 0.0
) -> Floats:
    """K_I of a semi-elliptical surface crack in a plate, good to 5 % (Newman and Raju, 1981).

    Parameters
    ----------
    phi : (...), radians
        Parametric angle: 0 at the surface, pi / 2 at the deepest point.
    a, c : float, length
        Depth and half length, a <= c.
    t, b : float, length
        Thickness, above a, and half width of the plate, above 2 c.
    S_t, S_b : float, stress
        Of tension and of bending at the surface.

    Returns
    -------
    (...), stress √length
    """
    r, q, s = a / c, a / t, np.sin(phi)
    Q = 1 + 1.464 * r**1.65
    M1 = 1.13 - 0.09 * r
    M2 = -0.54 + 0.89 / (0.2 + r)
    M3 = 0.5 - 1 / (0.65 + r) + 14 * (1 - r) ** 24
    g = 1 + (0.1 + 0.35 * q * q) * (1 - s) ** 2
    width = np.sqrt(1 / np.cos(np.pi * c / (2 * b) * np.sqrt(q)))
    F = (M1 + M2 * q**2 + M3 * q**4) * g * _round(phi, r) * width
    H1 = 1 - 0.34 * q - 0.11 * r * q
    G1 = -1.22 - 0.12 * r
    G2 = 0.55 - 1.05 * r**0.75 + 0.47 * r**1.5
    H2 = 1 + G1 * q + G2 * q * q
    H = H1 + (H2 - H1) * s ** (0.2 + r + 0.6 * q)
    return np.asarray((S_t + H * S_b) * np.sqrt(np.pi * a / Q) * F)


def newman_raju_corner(
    phi: ArrayLike, a: float, c: float, t: float, b: float, S_t: float = 1.0
) -> Floats:
    """K_I of a quarter-elliptical corner crack in a plate under tension (Newman and Raju, 1984).

    Parameters
    ----------
    phi : (...), radians
        Parametric angle: 0 at the surface along which c lies.
    a, c : float, length
        Along the thickness and along the width, a <= c.
    t, b : float, length
        Thickness and width of the plate.
    S_t : float, stress

    Returns
    -------
    (...), stress √length
    """
    r, q, s = a / c, a / t, np.sin(phi)
    Q = 1 + 1.464 * r**1.65
    M1 = 1.08 - 0.03 * r
    M2 = -0.44 + 1.06 / (0.3 + r)
    M3 = -0.5 + 0.25 * r + 14.8 * (1 - r) ** 15
    g1 = 1 + (0.08 + 0.4 * q * q) * (1 - s) ** 3
    g2 = 1 + (0.08 + 0.15 * q * q) * (1 - np.cos(phi)) ** 3
    lam = c / b * np.sqrt(q)
    width = 1 - 0.2 * lam + 9.4 * lam**2 - 19.4 * lam**3 + 27.1 * lam**4
    F = (M1 + M2 * q**2 + M3 * q**4) * g1 * g2 * _round(phi, r) * width
    return np.asarray(S_t * np.sqrt(np.pi * a / Q) * F)


def _round(phi: ArrayLike, r: float) -> Floats:
    """How K varies along an ellipse in an infinite body (Irwin, 1962)."""
    return np.asarray((r * r * np.cos(phi) ** 2 + np.sin(phi) ** 2) ** 0.25)


# --- bodies with a hole in 2D; a radial crack on which the hoop stress is negative is closed ---


def kirsch(
    x: ArrayLike, y: ArrayLike, R: float, E: float, nu: float, s: float = 1.0, alpha: float = 0.0,
    s2: float = 0.0, plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Circular hole around 0 under remote stress (Kirsch, 1898).

    Parameters
    ----------
    x, y : (...), length
    R : float, length
        Radius of the hole.
    E : float, stress
    nu : float
    s : float, stress
        Remote, along the direction `alpha`.
    alpha : float, radians
    s2 : float, stress
        Remote, across that direction.
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    z = _points(x, y)

    def uniaxial(stress: float, angle: float) -> Values:
        e = np.exp(2j * angle)
        phi = stress / 4 * (z + 2 * R * R * e / z)
        Phi = stress / 4 * (1 - 2 * R * R * e / z**2)
        dPhi = stress * R * R * e / z**3
        psi = -stress / 2 * (z / e + R * R / z - e * R**4 / z**3)
        Psi = -stress / 2 * (1 / e - R * R / z**2 + 3 * e * R**4 / z**4)
        return potential_field(z, phi, Phi, dPhi, psi, Psi, E, nu, plane)

    u_along, s_along = uniaxial(s, alpha)
    u_across, s_across = uniaxial(s2, alpha + np.pi / 2)
    return u_along + u_across, s_along + s_across


def kirsch_hoop(r: ArrayLike, R: float, s: float, angle: ArrayLike) -> Floats:
    """Hoop stress around that hole under s alone.

    Parameters
    ----------
    r : (...), length
        From the middle of the hole.
    R : float, length
        Radius of the hole.
    s : float, stress
    angle : (...), radians
        From the direction of the load.

    Returns
    -------
    (...), stress
    """
    q = (R / np.asarray(r)) ** 2
    return np.asarray(
        s / 2 * (1 + q) - s / 2 * (1 + 3 * q * q) * np.cos(2 * np.asarray(angle))
    )  # fmt: skip


def lame_cylinder(
    x: ArrayLike, y: ArrayLike, r_in: float, r_out: float, p_in: float, p_out: float, E: float,
    nu: float, plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Thick-walled cylinder under pressure (Lamé, 1852).

    Parameters
    ----------
    x, y : (...), length
    r_in, r_out : float, length
        Radii.
    p_in, p_out : float, stress
        Pressures inside and outside.
    E : float, stress
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    z = _points(x, y)
    A = (p_in * r_in**2 - p_out * r_out**2) / (r_out**2 - r_in**2)
    B = (p_in - p_out) * r_in**2 * r_out**2 / (r_out**2 - r_in**2)
    return potential_field(z, A / 2 * z, A / 2 + 0 * z, 0 * z, -B / z, B / z**2, E, nu, plane)


def _points(x: ArrayLike, y: ArrayLike) -> Complexes:
    return np.asarray(np.asarray(x, float) + 1j * np.asarray(y, float))


def newman_raju_at_hole(phi: ArrayLike, a: float, c: float, t: float, R: float) -> Floats:
    """K_I of one quarter-elliptical corner crack at a hole in a wide plate under unit tension.

    The fit of Newman and Raju (1981, NASA TM 83200; Murakami's handbook, 1987, p. 716) for two
    cracks, made one by the factor of Shah (1976); later fits differ by 2 %. For a = c all terms
    were read in the program easigrow (github.com/Easigrow/easigrow, commit ea8196f3, src/beta.rs,
    "DoubleSidedCornerCrackHoleTensionNewman81"), which cites the paper. For a < c that program has
    a factor c/a in g1 that the paper has not, and no last term of M3: there M3 is from memory.

    Parameters
    ----------
    phi : (...), radians
        Parametric angle: 0 at the surface of the plate, pi / 2 at the wall of the hole.
    a, c : float, length
        Along the wall and along the surface, a <= c.
    t, R : float, length
        Thickness and radius of the hole.

    Returns
    -------
    (...), stress √length
    """
    r, q = a / c, a / t
    sine, cosine = np.sin(phi), np.cos(phi)
    M1 = 1.13 - 0.09 * r
    M2 = -0.54 + 0.89 / (0.2 + r)
    M3 = 0.5 - 1 / (0.65 + r) + 14 * (1 - r) ** 24
    g1 = 1 + (0.1 + 0.35 * q * q) * (1 - sine) ** 2
    lam = 1 / (1 + c / R * np.cos(0.85 * np.asarray(phi, float)))
    g2 = (1 - 0.15 * lam + 3.46 * lam**2 - 4.47 * lam**3 + 3.52 * lam**4) / (1 + 0.13 * lam**2)
    g3 = (1 + 0.04 * r) * (1 + 0.1 * (1 - cosine) ** 2) * (0.8 + 0.2 * q**0.25)
    ellipse = (r * r * cosine**2 + sine**2) ** 0.25
    one_side = np.sqrt((4 / np.pi + a * c / (2 * t * R)) / (4 / np.pi + a * c / (t * R)))
    F = (M1 + M2 * q**2 + M3 * q**4) * g1 * g2 * g3 * ellipse * one_side
    return np.asarray(np.sqrt(np.pi * a / (1 + 1.464 * r**1.65)) * F)


__all__ = []
