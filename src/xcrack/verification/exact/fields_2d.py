"""Straight open cracks in 2D: the field at a tip, one crack, a row of cracks."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from xcrack.verification.exact.potentials_2d import (
    Complexes,
    Function,
    Plane,
    Values,
    complex_points,
    cut_root,
    uniform_stress,
    westergaard_field,
)


def williams(
    x: ArrayLike, y: ArrayLike, E: float, nu: float, K_I: float = 0.0, K_II: float = 0.0,
    T: float = 0.0, plane: Plane = "strain", side: int = 1, A: Sequence[float] = (),
    B: Sequence[float] = (),
) -> Values:  # fmt: skip
    """Field at a tip in 0 with the crack on x < 0 (Williams, 1957).

    Westergaard's functions are K / sqrt(2 pi z) + sum of A[j] z^(j + 1/2).

    Parameters
    ----------
    x, y : (...), length
    E : float, stress
    nu : float
    K_I, K_II : float, stress √length
    T : float, stress
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.
    A, B : sequence of float
        Higher terms of mode I and of mode II.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """

    def functions(K: float, higher: Sequence[float]) -> tuple[Function, Function, Function]:
        terms = list(enumerate([K / np.sqrt(2 * np.pi), *higher]))

        def function(z: Complexes) -> Complexes:
            return np.asarray(sum(c * z ** (j - 0.5) for j, c in terms))

        def integral(z: Complexes) -> Complexes:
            return np.asarray(sum(c * z ** (j + 0.5) / (j + 0.5) for j, c in terms))

        def slope(z: Complexes) -> Complexes:
            return np.asarray(sum(c * (j - 0.5) * z ** (j - 1.5) for j, c in terms))

        return function, integral, slope

    z = complex_points(x, y, side)
    return westergaard_field(z, *functions(K_I, A), *functions(K_II, B), T, E, nu, plane)


def griffith(
    x: ArrayLike, y: ArrayLike, a: float, E: float, nu: float, sxx: float = 0.0, syy: float = 0.0,
    sxy: float = 0.0, plane: Plane = "strain", side: int = 1,
) -> Values:  # fmt: skip
    """Open crack [-a, a] on y = 0 under remote uniform stress (Griffith, 1921; Westergaard, 1939).

    K_I = syy sqrt(pi a), K_II = sxy sqrt(pi a). For syy < 0 see `closed.closed_crack`.

    Parameters
    ----------
    x, y : (...), length
    a : float, length
    E : float, stress
    nu : float
    sxx, syy, sxy : float, stress
        Remote.
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """

    def functions(stress: float) -> tuple[Function, Function, Function]:
        return (
            lambda z: np.asarray(stress * z / cut_root(z, -a, a)),
            lambda z: np.asarray(stress * cut_root(z, -a, a)),
            lambda z: np.asarray(-stress * a * a / cut_root(z, -a, a) ** 3),
        )

    z = complex_points(x, y, side)
    return westergaard_field(z, *functions(syy), *functions(sxy), sxx - syy, E, nu, plane)


def inclined_remote(
    stress: float, angle: float, transverse: float = 0.0
) -> tuple[float, float, float]:
    """Remote stresses in the frame of a crack inclined to the load.

    Parameters
    ----------
    stress : float
        Along the load.
    angle : float, radians
        From the direction of the load to the crack.
    transverse : float
        Stress across the load over that along it.

    Returns
    -------
    along, across, shear : float, stress
        K_I = across sqrt(pi a), K_II = shear sqrt(pi a) of a crack of length 2 a.
    """
    s, c = np.sin(angle), np.cos(angle)
    stress_along = stress * (c * c + transverse * s * s)
    stress_across = stress * (s * s + transverse * c * c)
    return stress_along, stress_across, stress * (1 - transverse) * s * c


def periodic_K(a: float, W: float, stress: float = 1.0) -> float:
    """K of a row of collinear cracks under remote stress, of mode I and II alike (Irwin, 1957).

    Parameters
    ----------
    a : float, length
        Half length of each crack.
    W : float, length
        Period.
    stress : float
        Remote tension, or shear.

    Returns
    -------
    float, stress √length
    """
    return float(stress * np.sqrt(W * np.tan(np.pi * a / W)))


def periodic(
    x: ArrayLike, y: ArrayLike, a: float, W: float, E: float, nu: float, syy: float = 1.0,
    sxx: float = 0.0, sxy: float = 0.0, plane: Plane = "strain", side: int = 1,
) -> Values:  # fmt: skip
    """Row of collinear open cracks on y = 0, one of them on [-a, a] (Westergaard, 1939).

    Parameters
    ----------
    x, y : (...), length
        |x| <= W / 2.
    a : float, length
        Half length of each crack.
    W : float, length
        Period.
    E : float, stress
    nu : float
    syy, sxx, sxy : float, stress
        Remote.
    plane : {"strain", "stress"}
    side : {1, -1}
        Face of points on the crack.

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    S2, C = np.sin(np.pi * a / W) ** 2, np.cos(np.pi * a / W)

    def root(w: Complexes) -> Complexes:
        return np.asarray(np.sqrt(1 - S2 / np.sin(w) ** 2))

    def integral(z: Complexes) -> Complexes:
        sign = np.where(z.real >= 0, 1, -1)
        return np.asarray(W / np.pi * sign * np.arccos(np.cos(np.pi * z / W) / C))

    def slope(z: Complexes) -> Complexes:
        w = np.pi * z / W
        return np.asarray(-np.pi / W * S2 * np.cos(w) / np.sin(w) ** 3 / root(w) ** 3)

    def functions(stress: float) -> tuple[Function | None, ...]:
        if not stress:
            return None, None, None
        return (
            lambda z: np.asarray(stress / root(np.pi * z / W)),
            lambda z: stress * integral(z),
            lambda z: stress * slope(z),
        )

    X = np.where(np.asarray(x, float) == 0, 1e-100, x)  # the sine there is a divisor
    one, two = functions(syy), functions(sxy)
    z = complex_points(X, y, side)
    return westergaard_field(
        z, one[0], one[1], one[2], two[0], two[1], two[2], sxx - syy, E, nu, plane
    )  # fmt: skip


def slip_patch(
    x: ArrayLike, y: ArrayLike, E: float, nu: float, p: float = 1.0, s_up: float = 0.3,
    s_lo: float = -0.2, shift: float = 0.01, plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Two halves that slide on y = 0 under a uniform pressure, without friction.

    The displacement is linear on each side, so that linear elements have it exactly.

    Parameters
    ----------
    x, y : (...), length
    E : float, stress
    nu : float
    p : float, stress
        Pressure, s_yy = -p on both sides.
    s_up, s_lo : float, stress
        s_xx above and below.
    shift : float, length
        Uniform slip that is added above.
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    X, Y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    u_up, stress_up = uniform_stress(X, Y, s_up, -p, 0.0, E, nu, plane)
    u_lo, stress_lo = uniform_stress(X, Y, s_lo, -p, 0.0, E, nu, plane)
    is_above = (Y >= 0)[..., None]
    return (
        np.where(is_above, u_up + np.array([shift, 0]), u_lo),
        np.where(is_above, stress_up, stress_lo),
    )
