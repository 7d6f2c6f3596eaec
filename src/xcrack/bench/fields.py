"""Exact fields whose boundary values load the scenes. E = 1, nu = 0.3, plane strain."""

from collections.abc import Callable

import numpy as np

from xcrack.arrays import Floats
from xcrack.xfem.williams import mode_matrix, tip_values, unit_gradients

E, NU = 1.0, 0.3
MU = E / (2 * (1 + NU))
LAMBDA = E * NU / ((1 + NU) * (1 - 2 * NU))
KOLOSOV = 3 - 4 * NU
E_PRIME = E / (1 - NU**2)

Field = Callable[[Floats], Floats]


def stress_of(gradient: Floats) -> Floats:
    """Stress `(n, 2, 2)` of displacement gradients, by Hooke's law."""
    strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return 2 * MU * strain + LAMBDA * trace * np.eye(2)


def energy(stress: Floats) -> Floats:
    """Twice the energy of a volume in plane strain, sigma : C^-1 : sigma, `(n,)`."""
    trace = np.trace(stress, axis1=-2, axis2=-1)
    square = np.einsum("...ij,...ij->...", stress, stress)
    return np.asarray((1 + NU) / E * (square - NU * trace**2))


def edge_fields(K: tuple[float, float], pressure: float = 0.0) -> tuple[Field, Field]:
    """Displacement and stress of Williams (1957) at a tip at 0, crack on x < 0, y = 0.

    A pressure adds uniform compression, which closes the lips where K_I = 0.
    """

    def displacement(x: Floats) -> Floats:
        r, theta = np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0])
        modes = np.tensordot(K, mode_matrix(KOLOSOV, MU), axes=1)
        uniform = -pressure * (1 + NU) * (1 - 2 * NU) / E
        return tip_values(r, theta) @ modes.T + uniform * x

    def stress(x: Floats) -> Floats:
        r, theta = np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0])
        gradient = np.tensordot(K, unit_gradients(r, theta, KOLOSOV, MU)[:2], axes=1)
        return stress_of(gradient) - pressure * np.eye(2)

    return displacement, stress


def partial_closure(s_m: float, s_b: float = 1.0) -> tuple[Field, float, float]:
    """Displacement, K_I at the right tip and end of contact of a crack [-1, 1] half closed.

    The remote stress across it is s_m + s_b x (-s_b < s_m <= s_b / 2): a field of Westergaard
    (1939) of the open part, whose half length c = 2 (1 + s_m / s_b) / 3 follows from K = 0 at its
    left end.
    """
    c = 2 * (1 + s_m / s_b) / 3
    middle = 1 - c
    mean = s_m + s_b * middle

    def displacement(x: Floats) -> Floats:
        z = x[:, 0] - middle + 1j * x[:, 1]
        root = np.sqrt(z - c) * np.sqrt(z + c)
        Z = (mean * z + s_b * (z * z - c * c / 2)) / root
        integral = root * (mean + s_b * z / 2)
        across = (KOLOSOV - 1) / 2 * integral.real - x[:, 1] * Z.imag
        along = (KOLOSOV + 1) / 2 * integral.imag - x[:, 1] * Z.real
        return np.stack([across, along], axis=1) / (2 * MU)

    return displacement, float(s_b * c * np.sqrt(np.pi * c)), float(middle - c)


def closure_pressure(x: Floats, s_m: float, s_b: float = 1.0) -> Floats:
    """Pressure on the lips of the crack of `partial_closure`."""
    c = 2 * (1 + s_m / s_b) / 3
    r = np.abs(x - (1 - c))
    p = s_b * (r + c / 2) * np.sqrt(np.maximum(r - c, 0) / (r + c))
    return np.where(x < 1 - 2 * c, p, 0.0)


def kirsch(angle: float) -> Field:
    """Stress around a hole of radius 1 in a plate pressed by 1 across a direction (Kirsch, 1898).

    The line that leaves the hole in that direction is under `kirsch_pressure` and free of shear.
    """

    def stress(x: Floats) -> Floats:
        r, along = np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0])
        q, c2, s2 = 1 / r**2, np.cos(2 * (along - angle)), np.sin(2 * (along - angle))
        rr = -0.5 * ((1 - q) - (1 - 4 * q + 3 * q**2) * c2)
        tt = -0.5 * ((1 + q) + (1 + 3 * q**2) * c2)
        rt = -0.5 * (1 + 2 * q - 3 * q**2) * s2
        c, s = np.cos(along), np.sin(along)
        xx, yy = rr * c**2 + tt * s**2 - 2 * rt * s * c, rr * s**2 + tt * c**2 + 2 * rt * s * c
        xy = (rr - tt) * s * c + rt * (c**2 - s**2)
        return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)

    return stress


def kirsch_pressure(r: Floats) -> Floats:
    """Pressure on that line at a distance from the middle of the hole."""
    return 0.5 * (2 + 1 / r**2 + 3 / r**4)


def penny(radius: float, tension: float, shear: float = 0.0) -> Field:
    """Displacement around a penny in z = 0 under remote stresses zz and xz.

    Fabrikant's (1989) lengths l1, l2 give the harmonic function whose z derivative is the half
    jump sqrt(a² - r²) on the lip. Negative tension: closed lips that slide.
    """

    def harmonic(x: Floats) -> dict[str, Floats]:
        a, z = radius, np.abs(x[:, 2])
        r = np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-12 * a)
        far, near = np.hypot(r + a, z), np.hypot(r - a, z)
        outer = (far + near) / 2
        inner = a * r / outer
        below = np.sqrt(np.maximum(a * a - inner**2, 0))
        above = np.sqrt(np.maximum(outer**2 - a * a, 0))
        angle = np.arcsin(np.minimum(a / outer, 1))
        difference = np.maximum(far * near, 1e-300)
        h_r = r / 2 * (angle - a * above / outer**2)
        h_zz = a * above / difference - angle
        h_rz = -r * a * a * below / (outer**2 * difference)
        h_rr = -h_zz - h_r / r
        c, s = x[:, 0] / r, x[:, 1] / r
        return {
            "z": below - z * angle, "x": h_r * c, "y": h_r * s, "zz": h_zz,
            "xz": h_rz * c, "yz": h_rz * s,
            "xx": h_rr * c * c + h_r / r * s * s, "xy": (h_rr - h_r / r) * c * s,
        }  # fmt: skip

    def displacement(x: Floats) -> Floats:
        h, z, side = harmonic(x), np.abs(x[:, 2]), np.where(x[:, 2] < 0, -1.0, 1.0)
        s = np.array([[0, 0, shear], [0, 0, 0], [shear, 0, tension]])
        u = x @ ((1 + NU) * s - NU * tension * np.eye(3)) / E
        half, part = 1 / (2 * (1 - NU)), (1 - 2 * NU) / (2 * (1 - NU))
        opening = 2 * (1 - NU) * max(tension, 0.0) / (np.pi * MU)
        u[:, 0] -= opening * (part * h["x"] + half * z * h["xz"])
        u[:, 1] -= opening * (part * h["y"] + half * z * h["yz"])
        u[:, 2] += opening * side * (h["z"] - half * z * h["zz"])
        slip = 4 * (1 - NU) * shear / (np.pi * (2 - NU) * MU)
        u[:, 0] += slip * side * (h["z"] - half * z * h["xx"])
        u[:, 1] -= slip * side * half * z * h["xy"]
        u[:, 2] += slip * (part * h["x"] - half * z * h["xz"])
        return u

    return displacement


def penny_K_I(radius: float, tension: float) -> float:
    """K_I around a penny under tension: 2 s sqrt(a / pi) (Sneddon, 1946)."""
    return 2 * tension * float(np.sqrt(radius / np.pi))
