"""Flat cracks in 3D: a penny and an ellipse under remote uniform stress.

The crack lies in z = 0. Its field is that of a harmonic function h of z > 0 whose z derivative is
half of the jump on the face: `Derivatives` holds that derivative as "g", and the others of h by
their names, at |z|.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from xcrack.base.arrays import Floats
from xcrack.verification.exact.potentials_2d import shear_modulus

Derivatives = Mapping[str, Floats]


def uniform_stress_3d(x: ArrayLike, S: Floats, E: float, nu: float) -> tuple[Floats, Floats]:
    """Uniform stress; the displacement has no rotation.

    Parameters
    ----------
    x : (..., 3), length
    S : (3, 3), stress
    E : float, stress
    nu : float

    Returns
    -------
    u : (..., 3), length
    s : (..., 3, 3), stress
    """
    points = np.asarray(x, float)
    strain = (1 + nu) / E * S - nu / E * np.trace(S) * np.eye(3)
    return points @ strain, np.broadcast_to(S, (*points.shape[:-1], 3, 3))


def crack_displacement(
    x: Floats, h: Derivatives, mode: Literal["n", "x"], nu: float
) -> Floats:  # fmt: skip
    """Displacement of a flat crack whose jump is described by a harmonic function.

    The fields of Papkovich's potentials; with b = 1 / (2 (1 - nu)) and for z >= 0, of opening

        u_i = -b ((1 - 2 nu) h_i + z h_iz) along x and y, u_z = h_z - b z h_zz,

    and of slip along x

        u_x = h_z - b z h_xx, u_y = -b z h_xy, u_z = (1 - 2 nu) b h_x - b z h_xz.

    Parameters
    ----------
    x : (..., 3), length
    h : Derivatives
        At x.
    mode : {"n", "x"}
        Opening with u_z = h_z on the upper face, or slip with u_x = h_z there.
    nu : float

    Returns
    -------
    (..., 3), length
    """
    z, side = np.abs(x[..., 2]), np.where(x[..., 2] < 0, -1.0, 1.0)
    b, c = -1 / (2 * (1 - nu)), (1 - 2 * nu) / (2 * (1 - nu))
    if mode == "n":
        u_along = b * ((1 - 2 * nu) * h["x"] + z * h["xz"])
        u_across = b * ((1 - 2 * nu) * h["y"] + z * h["yz"])
        opening = b * (-2 * (1 - nu) * h["g"] + z * h["zz"])
        return np.stack([u_along, u_across, side * opening], -1)
    slip = h["g"] + b * z * h["xx"]
    u_across = b * z * h["xy"]
    return np.stack([side * slip, side * u_across, b * z * h["xz"] + c * h["x"]], -1)


def penny(
    x: ArrayLike, a: float, E: float, nu: float, S: Floats, friction: float | None = None
) -> Floats:
    """Displacement around a penny of radius a under remote uniform stress, in closed form.

    s_zz >= 0: open. s_zz < 0: closed, and it slides without friction or with Coulomb's, loaded in
    one go. Sneddon (1946), Segedin (1951), with the lengths of Fabrikant (1989).

    Parameters
    ----------
    x : (..., 3), length
    a : float, length
    E : float, stress
    nu : float
    S : (3, 3), stress
        Remote.
    friction : float, optional
        Coefficient of friction of closed faces.

    Returns
    -------
    (..., 3), length
    """
    points = np.asarray(x, float)
    mu = shear_modulus(E, nu)
    u, _ = uniform_stress_3d(points, S, E, nu)
    shear = float(np.hypot(S[0, 2], S[1, 2]))
    sliding_shear = _sliding_shear(shear, float(S[2, 2]), friction)
    opening = 2 * (1 - nu) * max(float(S[2, 2]), 0.0) / (np.pi * mu)
    u = u + opening * crack_displacement(points, _penny_harmonic(points, a), "n", nu)
    if sliding_shear > 0:
        c, s = S[0, 2] / shear, S[1, 2] / shear
        Q = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])  # rows: along the slip, across, normal
        local = points @ Q.T
        slip = crack_displacement(local, _penny_harmonic(local, a), "x", nu)
        u = u + 4 * (1 - nu) * sliding_shear / (np.pi * (2 - nu) * mu) * slip @ Q
    return u


def penny_K(
    omega: Floats | float, a: float, nu: float, szz: float = 0.0, tau: float = 0.0,
    friction: float | None = None,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """K along the front of that penny (Sneddon, 1946; Segedin, 1951).

    Parameters
    ----------
    omega : (...), radians
        Along the front, from the direction of the shear on the upper face.
    a : float, length
    nu : float
    szz, tau : float, stress
        Remote tension and shear.
    friction : float, optional
        Coefficient of friction of closed faces.

    Returns
    -------
    K_I, K_II, K_III : (...), stress √length
        K_III along (-sin omega, cos omega).
    """
    root = np.sqrt(a / np.pi)
    sliding_shear = _sliding_shear(tau, szz, friction)
    return (
        np.asarray(2 * max(szz, 0.0) * root + 0 * omega),
        np.asarray(4 / (2 - nu) * sliding_shear * root * np.cos(omega)),
        np.asarray(-4 * (1 - nu) / (2 - nu) * sliding_shear * root * np.sin(omega)),
    )


def ellipse_coeffs(
    a: float, b: float, E: float, nu: float, szz: float = 0.0, sxz: float = 0.0, syz: float = 0.0
) -> tuple[float, float, float]:
    """Halves of the largest jumps of an elliptical crack (Green and Sneddon, 1950; Kassir and Sih).

    Parameters
    ----------
    a, b : float, length
        Half axes along x and y.
    E : float, stress
    nu : float
    szz, sxz, syz : float, stress
        Remote.

    Returns
    -------
    w_z, w_x, w_y : float, length
        Factors of sqrt(1 - x² / a² - y² / b²).
    """
    mu = shear_modulus(E, nu)
    # Second derivatives of the integral of sqrt(1 - x²/a² - y²/b²) / R over the ellipse.
    V_xx = -np.pi * a * b * (2 / 3 * special.elliprd(0, b * b, a * a))
    V_yy = -np.pi * a * b * (2 / 3 * special.elliprd(0, a * a, b * b))
    h_zz = (V_xx + V_yy) / (2 * np.pi)
    h_xx, h_yy = -V_xx / (2 * np.pi), -V_yy / (2 * np.pi)
    # On the crack s_zz = mu / (1 - nu) w h_zz = -szz, s_xz = mu w (h_zz - nu / (1 - nu) h_xx).
    return (
        float(-szz * (1 - nu) / (mu * h_zz)),
        float(-sxz / (mu * (h_zz - nu / (1 - nu) * h_xx))),
        float(-syz / (mu * (h_zz - nu / (1 - nu) * h_yy))),
    )


def ellipse_K(
    theta: ArrayLike, a: float, b: float, nu: float, szz: float = 0.0, sxz: float = 0.0,
    syz: float = 0.0,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """K along the front of an elliptical crack (Irwin, 1962; Kassir and Sih, 1966).

    Parameters
    ----------
    theta : (...), radians
        Of the point (a cos theta, b sin theta).
    a, b : float, length
        Half axes along x and y.
    nu : float
    szz, sxz, syz : float, stress
        Remote.

    Returns
    -------
    K_I, K_II, K_III : (...), stress √length
        K_III along (-n_y, n_x) of the outward normal n.
    """
    mu = shear_modulus(1.0, nu)
    w_z, w_x, w_y = ellipse_coeffs(a, b, 1.0, nu, max(szz, 0.0), sxz, syz)
    gradient_x, gradient_y = np.cos(theta) / a, np.sin(theta) / b
    size = np.hypot(gradient_x, gradient_y)
    n_x, n_y, root = gradient_x / size, gradient_y / size, np.sqrt(np.pi * size)
    return (
        mu / (1 - nu) * w_z * root,
        mu / (1 - nu) * (w_x * n_x + w_y * n_y) * root,
        mu * (-w_x * n_y + w_y * n_x) * root,
    )


def ellipse_K_I(theta: ArrayLike, a: float, b: float, stress: float) -> Floats:
    """K_I along an elliptical crack under tension, in Irwin's (1962) form; b <= a.

    Parameters
    ----------
    theta : (...), radians
        Of the point (a cos theta, b sin theta).
    a, b : float, length
        Half axes, the longer one first.
    stress : float

    Returns
    -------
    (...), stress √length
    """
    axes = b / a
    shape = (np.sin(theta) ** 2 + axes**2 * np.cos(theta) ** 2) ** 0.25
    return np.asarray(stress * np.sqrt(np.pi * b) / special.ellipe(1 - axes**2) * shape)


def ellipse_displacement(
    x: ArrayLike, a: float, b: float, E: float, nu: float, S: Floats, nr: int = 60, nt: int = 120
) -> Floats:
    """Displacement around an elliptical crack, by quadrature: accurate beyond 0.2 b from it.

    Parameters
    ----------
    x : (..., 3), length
    a, b : float, length
        Half axes along x and y.
    E : float, stress
    nu : float
    S : (3, 3), stress
        Remote.
    nr, nt : int
        Points of the quadrature along the radius and around.

    Returns
    -------
    (..., 3), length
    """
    points = np.asarray(x, float)
    w_z, w_x, w_y = ellipse_coeffs(a, b, E, nu, max(S[2, 2], 0), S[0, 2], S[1, 2])
    h = _harmonic_by_quadrature(points, *_ellipse_points(a, b, nr, nt))
    u, _ = uniform_stress_3d(points, S, E, nu)
    u = u + w_z * crack_displacement(points, h, "n", nu)
    u = u + w_x * crack_displacement(points, h, "x", nu)
    by_axis = {
        "g": h["g"], "x": h["y"], "y": -h["x"], "xx": h["yy"], "yy": h["xx"], "xy": -h["xy"],
        "zz": h["zz"], "xz": h["yz"], "yz": -h["xz"],
    }  # fmt: skip
    slip = w_y * crack_displacement(points, by_axis, "x", nu)
    return np.asarray(u + np.stack([-slip[..., 1], slip[..., 0], slip[..., 2]], -1))


def _sliding_shear(tau: float, szz: float, friction: float | None) -> float:
    """Shear that friction does not carry."""
    if friction is None or szz >= 0:
        return tau
    return max(tau - friction * abs(szz), 0.0)


def _penny_harmonic(x: Floats, a: float) -> Derivatives:
    """Derivatives of the h whose h_z on the face is sqrt(a² - r²)."""
    z = np.abs(x[..., 2])
    r = np.maximum(np.hypot(x[..., 0], x[..., 1]), 1e-12 * a)
    far_distance, near_distance = np.sqrt((r + a) ** 2 + z * z), np.sqrt((r - a) ** 2 + z * z)
    outer = (far_distance + near_distance) / 2
    inner = a * r / outer
    difference = np.maximum(far_distance * near_distance, 1e-300)  # outer² - inner²
    root_in = np.sqrt(np.maximum(a * a - inner * inner, 0))
    root_out = np.sqrt(np.maximum(outer * outer - a * a, 0))
    angle = np.arcsin(np.minimum(a / outer, 1))
    h_r = r / 2 * (angle - a * root_out / outer**2)
    h_zz = -angle + a * root_out / difference
    h_rz = -r * a * a * root_in / (outer**2 * difference)
    h_rr = -h_zz - h_r / r
    c, s = x[..., 0] / r, x[..., 1] / r
    return {
        "g": root_in - z * angle, "x": h_r * c, "y": h_r * s, "xx": h_rr * c * c + h_r / r * s * s,
        "yy": h_rr * s * s + h_r / r * c * c, "xy": (h_rr - h_r / r) * c * s, "zz": h_zz,
        "xz": h_rz * c, "yz": h_rz * s,
    }  # fmt: skip


def _harmonic_by_quadrature(x: Floats, points: Floats, jump: Floats) -> Derivatives:
    """Derivatives of h = -1 / (2 pi) times the integral of the half jump over the distance.

    `jump` holds it at points `(n, 2)` of the crack, times their areas.
    """
    dx = x[..., 0, None] - points[:, 0]
    dy = x[..., 1, None] - points[:, 1]
    z = np.abs(x[..., 2])[..., None]
    square = dx * dx + dy * dy + z * z
    R3, R5 = square**-1.5, square**-2.5
    weight = jump / (2 * np.pi)
    integrands = {
        "g": z * R3, "x": dx * R3, "y": dy * R3, "xx": R3 - 3 * dx * dx * R5,
        "yy": R3 - 3 * dy * dy * R5, "xy": -3 * dx * dy * R5, "zz": R3 - 3 * z * z * R5,
        "xz": -3 * dx * z * R5, "yz": -3 * dy * z * R5,
    }  # fmt: skip
    return {name: np.sum(weight * values, -1) for name, values in integrands.items()}


def _ellipse_points(a: float, b: float, nr: int, nt: int) -> tuple[Floats, Floats]:
    """Points `(nr nt, 2)` of an ellipse and areas times sqrt(1 - x² / a² - y² / b²)."""
    t, w = np.polynomial.legendre.leggauss(nr)
    t, w = (t + 1) * np.pi / 4, w * np.pi / 4
    r, theta = np.sin(t), 2 * np.pi * np.arange(nt) / nt
    x = a * np.outer(r, np.cos(theta)).ravel()
    y = b * np.outer(r, np.sin(theta)).ravel()
    area = np.outer(w * np.cos(t) * r, np.full(nt, 2 * np.pi / nt)).ravel() * a * b
    return np.stack([x, y], -1), np.repeat(np.cos(t), nt) * area
