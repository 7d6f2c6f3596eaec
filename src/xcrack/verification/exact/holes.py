"""Bodies with a hole in 2D; a radial crack on which the hoop stress is negative is closed."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.verification.exact.potentials_2d import Complexes, Plane, Values, potential_field


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
    single = np.sqrt((4 / np.pi + a * c / (2 * t * R)) / (4 / np.pi + a * c / (t * R)))
    F = (M1 + M2 * q**2 + M3 * q**4) * g1 * g2 * g3 * ellipse * single
    return np.asarray(np.sqrt(np.pi * a / (1 + 1.464 * r**1.65)) * F)
