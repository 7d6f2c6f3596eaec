"""The four tip functions and the fields of Williams (1957) that they span."""

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints


def polar_coordinates(psi: Floats, phi: Floats, side: Ints) -> tuple[Floats, Floats]:
    """Radius and angle in (-pi, pi] from the level sets; `side` decides the angle on a lip.

    `side` is +1 or -1 where the point belongs to a known side of the crack, else 0. A point with
    phi = 0 exactly has atan2 = +pi on both crack faces; its side decides.
    """
    least_radius = 1e-300
    phi_on_side = np.where((side != 0) & (phi * side <= 0), side * least_radius, phi)
    return np.hypot(psi, phi), np.arctan2(phi_on_side, psi)


def continued_polar(xi: Floats, side: Ints, is_kinked_face: Bools) -> tuple[Floats, Floats]:
    """Polar coordinates at a tip, the cut of the angle following the real lips.

    A point on side + of a crack that bends down may have a negative polar angle: it is continued
    by a turn, so that the auxiliary field jumps where the crack is. `is_kinked_face` gives the side
    of the crack from that of its prolongation ahead.
    """
    r = np.hypot(xi[:, 0], xi[:, 1])
    theta = np.arctan2(xi[:, 1], xi[:, 0])
    is_behind = is_kinked_face & (side != 0)
    theta = np.where(is_behind & (side > 0) & (theta < 0), theta + 2 * np.pi, theta)
    return r, np.where(is_behind & (side < 0) & (theta > 0), theta - 2 * np.pi, theta)


def angular_functions(theta: Floats) -> tuple[Floats, Floats]:
    """Angular parts of the tip functions and their derivatives `(..., 4)`.

    F = sqrt(r) {cos(t/2), sin(t/2), sin(t/2) sin(t), cos(t/2) sin(t)}; only the second jumps.
    """
    c, s = np.cos(theta / 2), np.sin(theta / 2)
    C, S = np.cos(theta), np.sin(theta)
    value = np.stack([c, s, s * S, c * S], axis=-1)
    slope = np.stack([-s / 2, c / 2, c * S / 2 + s * C, -s * S / 2 + c * C], axis=-1)
    return value, slope


def tip_values(r: Floats, theta: Floats, n: int = 4) -> Floats:
    """The first n tip functions `(..., n)`, sqrt(length)."""
    return np.sqrt(r)[..., None] * angular_functions(theta)[0][..., :n]


def tip_derivatives(r: Floats, theta: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the tip functions along (ahead, normal), `(..., 4)` each."""
    g, dg = angular_functions(theta)
    scale = 1 / np.sqrt(r)[..., None]
    C, S = np.cos(theta)[..., None], np.sin(theta)[..., None]
    slope_ahead = scale * (0.5 * g * C - dg * S)
    normal = scale * (0.5 * g * S + dg * C)
    return slope_ahead, normal


def mode_matrix(kolosov: float, mu: float) -> Floats:
    """Displacements of unit K in terms of the tip functions: `(modes, components, 4)`.

    Rows of the result are modes I and II (plane components ahead, normal); Williams (1957).
    """
    k = kolosov
    scale = 1 / (2 * mu * np.sqrt(2 * np.pi))
    mode_I = [[k - 1, 0, 1, 0], [0, k + 1, 0, -1]]
    mode_II = [[0, k + 1, 0, 1], [1 - k, 0, 1, 0]]
    return scale * np.array([mode_I, mode_II], dtype=float)


def unit_gradients(r: Floats, theta: Floats, kolosov: float, mu: float) -> Floats:
    """Displacement gradients of unit K_I, unit K_II and a unit point force `(3, q, 2, 2)`.

    Plane components (ahead, normal). The force acts on the tip, along the crack faces, which it
    leaves free of traction: sigma_rr = -cos(theta) / (pi r) (Michell, 1902); it is the field of T.
    """
    modes = mode_matrix(kolosov, mu)
    slope_ahead, normal = tip_derivatives(r, theta)
    fields = [np.stack([slope_ahead @ mode.T, normal @ mode.T], axis=-1) for mode in modes]
    c, s = np.cos(theta), np.sin(theta)
    radial_stress = -c / (np.pi * r)
    radial_direction = np.stack([c, s], axis=-1)
    stress = (
        radial_stress[:, None, None] * radial_direction[:, :, None] * radial_direction[:, None, :]
    )
    force = (stress - (3 - kolosov) / 4 * radial_stress[:, None, None] * np.eye(2)) / (2 * mu)
    # The rotation is part of the gradient.
    turn = (kolosov + 1) / (8 * mu * np.pi) * s / r
    force[:, 0, 1] -= turn
    force[:, 1, 0] += turn
    return np.stack([*fields, force])
