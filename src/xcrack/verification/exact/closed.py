"""Straight cracks in 2D whose faces touch, along all of the crack or along a part of it.

The fields of partly closed cracks are Westergaard's (1939) of the open part, whose ends follow from
K = 0 where the faces close.
"""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError
from xcrack.verification.exact.fields_2d import griffith
from xcrack.verification.exact.potentials_2d import (
    Complexes,
    Plane,
    Values,
    complex_points,
    cut_root,
    plane_modulus,
    uniform_stress,
    westergaard_field,
)


def closed_crack(
    x: ArrayLike, y: ArrayLike, a: float, E: float, nu: float, sxx: float = 0.0, syy: float = -1.0,
    sxy: float = 0.0, mu_f: float = 0.0, plane: Plane = "strain", side: int = 1,
) -> Values:  # fmt: skip
    """Crack [-a, a] on y = 0 closed by remote compression, loaded in one go, Coulomb's friction.

    K_I = 0, K_II = sign(sxy) max(|sxy| - mu_f |syy|, 0) sqrt(pi a); the pressure is |syy|.

    Parameters
    ----------
    x, y : (...), length
    a : float, length
    E : float, stress
    nu : float
    sxx, syy, sxy : float, stress
        Remote; syy <= 0.
    mu_f : float
        Coefficient of friction.
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress

    Raises
    ------
    ProblemError
        If syy is a tension, which opens the crack.
    """
    if syy > 0:
        raise ProblemError(f"closed_crack: syy = {syy:g} opens the crack; use griffith")
    shear = float(np.sign(sxy) * max(abs(sxy) - mu_f * abs(syy), 0.0))
    u_crack, s_crack = griffith(x, y, a, E, nu, 0.0, 0.0, shear, plane, side)
    u_body, s_body = uniform_stress(x, y, sxx, syy, sxy - shear, E, nu, plane)
    return u_crack + u_body, s_crack + s_body


def partial_closure_params(a: float, s_m: float, s_b: float) -> tuple[float, float, float]:
    """Open part and K_I of a crack [-a, a] in bending: remote s_yy = s_m + s_b x / a on y = 0.

    Parameters
    ----------
    a : float, length
    s_m, s_b : float, stress
        -s_b < s_m <= s_b / 2.

    Returns
    -------
    middle, c : float, length
        The crack is open on [middle - c, middle + c], which ends at a.
    K_I : float, stress √length
        At a; it is 0 at the closed tip in -a.

    Raises
    ------
    ProblemError
        If the crack is open or closed everywhere.
    """
    ratio = s_m / s_b
    if not -1 < ratio <= 0.5:
        raise ProblemError(
            f"s_m / s_b = {ratio:g}: above -1 and at most 1/2, or the crack is not partly closed"
        )
    c = 2 * a * (1 + ratio) / 3
    return a - c, c, float(s_b * c / a * np.sqrt(np.pi * c))


def partial_closure(
    x: ArrayLike, y: ArrayLike, a: float, E: float, nu: float, s_m: float = 0.0, s_b: float = 1.0,
    sxx: float = 0.0, plane: Plane = "strain", side: int = 1,
) -> Values:  # fmt: skip
    """Field of that crack, whose left part is closed, without friction.

    Ahead of it s_xx is s_yy plus a constant: the remote s_xx is linear in x too, which does not
    load the crack.

    Parameters
    ----------
    x, y : (...), length
    a : float, length
    E : float, stress
    nu : float
    s_m, s_b : float, stress
        As of `partial_closure_params`.
    sxx : float, stress
        Remote s_xx at the middle of the open part.
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    middle, c, _ = partial_closure_params(a, s_m, s_b)
    slope_of_stress = s_b / a
    mean = s_m + slope_of_stress * middle

    def root(z: Complexes) -> Complexes:
        return cut_root(z, -c, c)

    def numerator(z: Complexes) -> Complexes:
        return np.asarray(mean * z + slope_of_stress * (z * z - c * c / 2))

    def function(z: Complexes) -> Complexes:
        return np.asarray(numerator(z) / root(z))

    def integral(z: Complexes) -> Complexes:
        return np.asarray(root(z) * (mean + slope_of_stress * z / 2))

    def slope(z: Complexes) -> Complexes:
        return np.asarray(
            (mean + 2 * slope_of_stress * z) / root(z) - z * numerator(z) / root(z) ** 3
        )

    z = complex_points(np.asarray(x, float) - middle, y, side)
    return westergaard_field(
        z, function, integral, slope, None, None, None, sxx - mean, E, nu, plane
    )


def partial_closure_pressure(
    x: ArrayLike, a: float, s_m: float = 0.0, s_b: float = 1.0
) -> Floats:  # fmt: skip
    """Pressure on the closed part of that crack, and 0 elsewhere; beyond -a, on the ligament.

    Parameters
    ----------
    x : (...), length
    a : float, length
    s_m, s_b : float, stress
        As of `partial_closure_params`.

    Returns
    -------
    (...), stress
    """
    middle, c, _ = partial_closure_params(a, s_m, s_b)
    X = np.asarray(x, float)
    r = np.abs(X - middle)
    pressure = s_b / a * (r + c / 2) * np.sqrt(np.maximum(r - c, 0) / (r + c))
    return np.where(X < middle - c, pressure, 0.0)


def partial_closure_opening(
    x: ArrayLike, a: float, E: float, nu: float, s_m: float = 0.0, s_b: float = 1.0,
    plane: Plane = "strain",
) -> Floats:  # fmt: skip
    """Opening of that crack, (2 s_b / (E' a)) (c + xi) sqrt(c² - xi²), xi from the middle.

    Parameters
    ----------
    x : (...), length
    a : float, length
    E : float, stress
    nu : float
    s_m, s_b : float, stress
        As of `partial_closure_params`.
    plane : {"strain", "stress"}

    Returns
    -------
    (...), length
    """
    middle, c, _ = partial_closure_params(a, s_m, s_b)
    xi = np.clip(np.asarray(x, float) - middle, -c, c)
    scale = 2 * s_b / a / plane_modulus(E, nu, plane)
    return np.asarray(scale * (c + xi) * np.sqrt(c * c - xi * xi))


def centre_open(
    x: ArrayLike, y: ArrayLike, a: float, E: float, nu: float, s0: float = 1.0, q: float = 0.3,
    plane: Plane = "strain", side: int = 1,
) -> Values:  # fmt: skip
    """Crack [-a, a] that is open in the middle and closed at both tips, where K_I = 0.

    The remote stress on y = 0 is s_yy = s0 (q - x² / a²), the open part |x| < a sqrt(2 q).

    Parameters
    ----------
    x, y : (...), length
    a : float, length
    E : float, stress
    nu : float
    s0 : float, stress
    q : float
        Below 1/2.
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    b = a * np.sqrt(2 * q)
    scale = -s0 / a**2

    def root(z: Complexes) -> Complexes:
        return cut_root(z, -b, b)

    return westergaard_field(
        complex_points(x, y, side),
        lambda z: np.asarray(scale * z * root(z)),
        lambda z: np.asarray(scale * root(z) ** 3 / 3),
        lambda z: np.asarray(scale * (root(z) + z * z / root(z))),
        None, None, None, 0.0, E, nu, plane,
    )  # fmt: skip


def centre_open_pressure(x: ArrayLike, a: float, s0: float = 1.0, q: float = 0.3) -> Floats:
    """Pressure on the closed parts of that crack.

    Parameters
    ----------
    x : (...), length
    a : float, length
    s0 : float, stress
    q : float

    Returns
    -------
    (...), stress
    """
    b = a * np.sqrt(2 * q)
    X = np.abs(np.asarray(x, float))
    return np.asarray(s0 / a**2 * X * np.sqrt(np.maximum(X * X - b * b, 0)))


def centre_open_opening(
    x: ArrayLike, a: float, E: float, nu: float, s0: float = 1.0, q: float = 0.3,
    plane: Plane = "strain",
) -> Floats:  # fmt: skip
    """Opening of that crack, 4 s0 / (3 E' a²) (b² - x²)^(3/2).

    Parameters
    ----------
    x : (...), length
    a : float, length
    E : float, stress
    nu : float
    s0 : float, stress
    q : float
    plane : {"strain", "stress"}

    Returns
    -------
    (...), length
    """
    scale = 4 * s0 / (3 * plane_modulus(E, nu, plane) * a * a)
    return np.asarray(scale * np.maximum(2 * q * a * a - np.asarray(x, float) ** 2, 0) ** 1.5)
