"""Fields in 2D from complex potentials (Kolosov, 1909; Muskhelishvili, 1953; Westergaard, 1939)."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError

Plane = Literal["strain", "stress"]
Complexes = NDArray[np.complex128]
Function = Callable[[Complexes], Complexes]
Values = tuple[Floats, Floats]  # displacements (..., 2), stresses (..., 3): xx, yy, xy

_TINY = 1e-150  # distance from a crack to the points on its faces


def kolosov(nu: float, plane: Plane = "strain") -> float:
    """Kolosov's constant.

    Parameters
    ----------
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    float

    Raises
    ------
    ProblemError
        If `plane` is another word.
    """
    return 3 - 4 * nu if _is_strain(plane) else (3 - nu) / (1 + nu)


def shear_modulus(E: float, nu: float) -> float:
    """Shear modulus, stress."""
    return E / (2 * (1 + nu))


def plane_modulus(E: float, nu: float, plane: Plane = "strain") -> float:
    """E' of G = (K_I² + K_II²) / E', stress.

    Parameters
    ----------
    E : float, stress
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    float

    Raises
    ------
    ProblemError
        If `plane` is another word.
    """
    return E / (1 - nu**2) if _is_strain(plane) else E


def complex_points(x: ArrayLike, y: ArrayLike, side: int = 1) -> Complexes:
    """Points x + i y; those on y = 0 move off it by next to nothing, to the given side.

    Parameters
    ----------
    x, y : (...), length
    side : {1, -1}

    Returns
    -------
    (...) complex
    """
    first, second = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    second = np.where(second == 0, np.copysign(_TINY, side), second)
    return np.asarray(first + 1j * second)


def cut_root(z: Complexes, a: float, b: float) -> Complexes:
    """Root of (z - a)(z - b) whose cut is the segment from a to b, and which is z at infinity.

    Parameters
    ----------
    z : (...) complex
    a, b : float

    Returns
    -------
    (...) complex
    """
    return np.asarray(np.sqrt(z - a) * np.sqrt(z - b))


def potential_field(
    z: Complexes, phi: Complexes, Phi: Complexes, dPhi: Complexes, psi: Complexes, Psi: Complexes,
    E: float, nu: float, plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Field of Muskhelishvili's (1953) potentials.

    Parameters
    ----------
    z : (...) complex, length
        Points.
    phi, Phi, dPhi : (...) complex
        The first potential there, with its first and second derivative.
    psi, Psi : (...) complex
        The second one, with its derivative.
    E : float, stress
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    kappa, mu = kolosov(nu, plane), shear_modulus(E, nu)
    w = (kappa * phi - z * np.conj(Phi) - np.conj(psi)) / (2 * mu)
    trace = 4 * Phi.real
    difference = 2 * (np.conj(z) * dPhi + Psi)  # s_yy - s_xx + 2 i s_xy
    return _pack(w, trace, (trace + difference.real) / 2, difference.imag / 2)


def westergaard_field(
    z: Complexes, Z_I: Function | None, integral_I: Function | None, slope_I: Function | None,
    Z_II: Function | None, integral_II: Function | None, slope_II: Function | None, T: float,
    E: float, nu: float, plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Field of Westergaard's (1939) functions, which are real on y = 0 off the crack.

    Parameters
    ----------
    z : (...) complex, length
        Points.
    Z_I, integral_I, slope_I : callable (complex) -> complex, or None
        Function of mode I with an antiderivative and its derivative; None where it is zero.
    Z_II, integral_II, slope_II : callable (complex) -> complex, or None
        Those of mode II.
    T : float, stress
        Uniform s_xx that is added.
    E : float, stress
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    kappa, mu = kolosov(nu, plane), shear_modulus(E, nu)

    def mix_modes(first: Function | None, second: Function | None, at: Complexes) -> Complexes:
        total = np.zeros_like(at)
        if first is not None:
            total = total + first(at) / 2
        if second is not None:
            total = total - 0.5j * second(at)
        return total

    mirrored = np.conj(z)
    phi, Phi = mix_modes(integral_I, integral_II, z), mix_modes(Z_I, Z_II, z)
    dPhi = mix_modes(slope_I, slope_II, z)
    omega, Omega = mix_modes(integral_I, integral_II, mirrored), mix_modes(Z_I, Z_II, mirrored)
    phi, Phi = phi + T * z / 4, Phi + T / 4
    omega, Omega = omega - T * mirrored / 4, Omega - T / 4
    w = (kappa * phi - omega - (z - mirrored) * np.conj(Phi)) / (2 * mu)
    traction = Phi + Omega + (z - mirrored) * np.conj(dPhi)  # s_yy - i s_xy
    return _pack(w, 4 * Phi.real, traction.real, -traction.imag)


def uniform_stress(
    x: ArrayLike, y: ArrayLike, sxx: float, syy: float, sxy: float, E: float, nu: float,
    plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Uniform stress; the displacement has no rotation.

    Parameters
    ----------
    x, y : (...), length
    sxx, syy, sxy : float, stress
    E : float, stress
    nu : float
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    X, Y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    mu, kappa = shear_modulus(E, nu), kolosov(nu, plane)
    exx = ((kappa + 1) * sxx - (3 - kappa) * syy) / (8 * mu)
    eyy = ((kappa + 1) * syy - (3 - kappa) * sxx) / (8 * mu)
    exy = sxy / (2 * mu)
    u = np.stack([exx * X + exy * Y, exy * X + eyy * Y], -1)
    return u, np.stack([sxx + 0 * X, syy + 0 * X, sxy + 0 * X], -1)


def _pack(w: Complexes, trace: Floats, syy: Floats, sxy: Floats) -> Values:
    """Displacement and stress of u + i v, s_xx + s_yy, s_yy and s_xy."""
    return np.stack([w.real, w.imag], -1), np.stack([trace - syy, syy, sxy], -1)


def _is_strain(plane: str) -> bool:
    if plane not in ("strain", "stress"):
        raise ProblemError(f'plane is "strain" or "stress", not {value_text(plane)}')
    return plane == "strain"
