"""Cracks along a circular arc in 2D."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from xcrack.verification.exact.potentials_2d import (
    Complexes,
    Plane,
    Values,
    kolosov,
    potential_field,
    shear_modulus,
)


@dataclass(frozen=True)
class ArcCrack:
    """Open crack on |z| = R, |arg z| < alpha, under remote uniform stress (Muskhelishvili, 1953).

    The potentials are Phi = (F + g0 + g2 / z²) / 2 and Omega = (F - g0 - g2 / z²) / 2 of z / R with
    F = (c1 z + c0 + d1 / z + d2 / z²) / q, q² = (z - t1)(z - t2), t1 and t2 the tips. Their
    coefficients follow from the stress at infinity, from single displacements, and from regular
    stress at the origin.

    Attributes
    ----------
    R : float, length
    alpha : float, radians
        Half of the angle that the arc spans; its middle lies in (R, 0).
    E : float, stress
    nu : float
    sxx, syy, sxy : float, stress
        Remote.
    plane : {"strain", "stress"}
    """

    R: float
    alpha: float
    E: float
    nu: float
    sxx: float = 0.0
    syy: float = 0.0
    sxy: float = 0.0
    plane: Plane = "strain"

    @property
    def K_upper(self) -> tuple[float, float]:
        """K_I and K_II at the tip at +alpha, whose x1 continues the arc."""
        return self._K(1)

    @property
    def K_lower(self) -> tuple[float, float]:
        """K_I and K_II at the tip at -alpha, whose x1 continues the arc."""
        return self._K(-1)

    def field(self, x: ArrayLike, y: ArrayLike) -> Values:
        """Displacements and stresses at points off the arc; a face is r = R (1 +- 1e-9).

        Parameters
        ----------
        x, y : (...), length

        Returns
        -------
        u : (..., 2), length
        s : (..., 3), stress
        """
        z = np.asarray((np.asarray(x, float) + 1j * np.asarray(y, float)) / self.R)
        c1, c0, d1, d2, g0 = self._coefficients
        g2, ca = self._g2, np.cos(self.alpha)

        def first(t: Complexes) -> Complexes:
            return np.asarray(0.5 * (self._potentials(t) + g0 + g2 / t**2))

        def second(t: Complexes) -> Complexes:
            return np.asarray(0.5 * (self._potentials(t) - g0 - g2 / t**2))

        def integral(t: Complexes) -> Complexes:  # of F
            return np.asarray((c1 - d2 / t) * self._q(t))

        q = self._q(z)
        dF = (c1 - d1 / z**2 - 2 * d2 / z**3) / q
        dF -= (c1 * z + c0 + d1 / z + d2 / z**2) * (z - ca) / q**3
        dPhi = 0.5 * (dF - 2 * g2 / z**3)
        inverse: Complexes = np.asarray(1 / np.conj(z))
        Psi = (first(z) - z * dPhi - np.conj(second(inverse))) / z**2
        kappa, mu = kolosov(self.nu, self.plane), shear_modulus(self.E, self.nu)
        phi = 0.5 * (integral(z) + g0 * z - g2 / z)
        omega = 0.5 * (integral(inverse) - g0 * inverse + g2 / inverse)
        w = self.R * (kappa * phi - omega - (z - inverse) * np.conj(first(z))) / (2 * mu)
        trace, difference = 4 * first(z).real, 2 * (np.conj(z) * dPhi + Psi)
        syy = (trace + difference.real) / 2
        return (
            np.stack([w.real, w.imag], -1),
            np.stack([trace - syy, syy, difference.imag / 2], -1),
        )

    @cached_property
    def _g2(self) -> complex:
        """Of the remote stress s_yy - s_xx + 2 i s_xy."""
        return complex(np.conj((self.syy - self.sxx) / 2 + 1j * self.sxy))

    @cached_property
    def _coefficients(self) -> tuple[complex, complex, complex, complex, complex]:
        """c1, c0, d1, d2 of F, and g0."""
        G, g2, ca = (self.sxx + self.syy) / 4, self._g2, np.cos(self.alpha)
        q0 = self._q(np.array([0j]))[0]  # 1 / q = X0 + X1 z + X2 z² + ...
        X0, X1, X2 = 1 / q0, ca / q0, (3 * ca * ca - 1) / 2 / q0
        d2 = -g2 / X0
        d1 = -d2 * X1 / X0
        # Phi = G at infinity, where F has no 1 / z, and Omega there is the conjugate of Phi(0).
        imposed_part = 0.5 * (-ca * X0 * 2 * G + d1 * X1 + d2 * X2)
        factor = 0.5 * (ca * X0 + 1)  # real
        rhs = G - np.conj(imposed_part)
        g0 = rhs.real / (1 + factor)
        if abs(1 - factor) > 1e-14:
            g0 = g0 + 1j * rhs.imag / (1 - factor)
        c1 = 2 * G - g0
        return c1, -ca * c1, d1, d2, g0

    def _q(self, z: Complexes) -> Complexes:
        """Root of (z - t1)(z - t2), cut along the arc through z = 1, z at infinity."""
        t1, t2 = np.exp(1j * self.alpha), np.exp(-1j * self.alpha)
        ratio = (1 - t1) / (1 - t2)  # of the middle of the arc
        root = np.sqrt(-(z - t1) / (z - t2) / ratio)
        return np.asarray((z - t2) * root / np.sqrt(-1 / ratio + 0j))

    def _potentials(self, z: Complexes) -> Complexes:
        c1, c0, d1, d2, _ = self._coefficients
        return np.asarray((c1 * z + c0 + d1 / z + d2 / z**2) / self._q(z))

    def _K(self, sign: int) -> tuple[float, float]:
        """K_I and K_II at the tip of that sign: s_rr + i s_rt is F on the circle ahead of it."""
        c1, c0, d1, d2, _ = self._coefficients
        tip, distance = np.exp(1j * sign * self.alpha), 1e-8
        point_ahead = np.array([tip * np.exp(1j * sign * distance)])
        limit = (
            (c1 * tip + c0 + d1 / tip + d2 / tip**2) / self._q(point_ahead)[0] * np.sqrt(distance)
        )
        K = np.sqrt(2 * np.pi) * np.sqrt(self.R) * limit
        return float(K.real), float(-K.imag)


def arc_K_biaxial(R: float, alpha: float, stress: float = 1.0) -> tuple[float, float]:
    """K_I and |K_II| of an arc under equal tension along x and y (Muskhelishvili, 1953).

    Parameters
    ----------
    R : float, length
    alpha : float, radians
        Half of the angle that the arc spans.
    stress : float

    Returns
    -------
    K_I, K_II : float, stress √length
    """
    size = stress * np.sqrt(np.pi * R * np.sin(alpha)) / (1 + np.sin(alpha / 2) ** 2)
    return float(size * np.cos(alpha / 2)), float(size * np.sin(alpha / 2))


def arc_manufactured(
    x: ArrayLike, y: ArrayLike, R: float, E: float, nu: float, p0: float = 1.0, p2: float = 0.5,
    plane: Plane = "strain",
) -> Values:  # fmt: skip
    """Smooth field with s_rt = 0 and s_rr = -(p0 + p2 cos 2 theta) on r = R.

    Any crack on that circle is closed under this pressure. The potentials are
    phi = -p0 z / 2 + A z³ and psi = B z with A = -p2 / (6 R²), B = -6 A R².

    Parameters
    ----------
    x, y : (...), length
    R : float, length
    E : float, stress
    nu : float
    p0, p2 : float, stress
        |p2| <= p0.
    plane : {"strain", "stress"}

    Returns
    -------
    u : (..., 2), length
    s : (..., 3), stress
    """
    z = np.asarray(np.asarray(x, float) + 1j * np.asarray(y, float))
    A = -p2 / (6 * R * R)
    B = -6 * A * R * R
    phi, Phi = -p0 * z / 2 + A * z**3, -p0 / 2 + 3 * A * z * z
    return potential_field(z, phi, Phi, 6 * A * z, B * z, B + 0 * z, E, nu, plane)
