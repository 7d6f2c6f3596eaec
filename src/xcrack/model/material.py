"""Isotropic linear elasticity."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from xcrack.base.arguments import Choice, Declared, Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import STRESS


@dataclass(frozen=True)
class Isotropic(Declared):
    """Isotropic linear elastic material; nothing has a default but the plane of a 3D body.

    Parameters
    ----------
    E : float, stress
        Young's modulus.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress"}, optional
        State of a 2D body; None in 3D.

    Raises
    ------
    ProblemError
        E <= 0, nu outside (-1, 0.5), or another word for `plane`.

    Examples
    --------
    >>> round(Isotropic(E=210e3, nu=0.3, plane="strain").E_prime)
    230769
    """

    E: Annotated[float, Number(above=0, unit=STRESS)]
    nu: Annotated[
        float,
        Number(above=-1, below=0.5, hint="a nearly incompressible material has such as 0.4999"),
    ]
    plane: Annotated[
        str | None, Choice(("strain", "stress"), needs='"strain" or "stress" in 2D, nothing in 3D')
    ] = None

    @property
    def mu(self) -> float:
        """Shear modulus, stress."""
        return self.E / (2 * (1 + self.nu))

    @property
    def lam(self) -> float:
        """First Lamé constant in use, stress; in plane stress 2 lam mu / (lam + 2 mu)."""
        lam = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        return 2 * lam * self.mu / (lam + 2 * self.mu) if self.plane == "stress" else lam

    @property
    def kolosov(self) -> float:
        """Kolosov's constant: 3 - 4 nu (plane strain and 3D) or (3 - nu) / (1 + nu)."""
        return (3 - self.nu) / (1 + self.nu) if self.plane == "stress" else 3 - 4 * self.nu

    @property
    def E_prime(self) -> float:
        """E in plane stress, else E / (1 - nu²), stress."""
        return self.E if self.plane == "stress" else self.E / (1 - self.nu**2)

    def thermal_stress(self, change: Floats, alpha: float, dim: int) -> Floats:
        """Stress `(n, dim, dim)` of a change of temperature `(n,)` that cannot expand."""
        stiff = -self.E / (1 - self.nu if self.plane == "stress" else 1 - 2 * self.nu)
        return np.asarray(alpha * stiff * change[:, None, None] * np.eye(dim))

    def stress(self, gradient: Floats) -> Floats:
        """Stress `(..., d, d)` of a displacement gradient `(..., d, d)` (row: component)."""
        gradient = _tensors(gradient, "Isotropic.stress: gradient")
        strain = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
        trace = np.trace(strain, axis1=-2, axis2=-1)
        return 2 * self.mu * strain + self.lam * trace[..., None, None] * np.eye(strain.shape[-1])

    def strain(self, stress: Floats) -> Floats:
        """Strain `(..., d, d)` of an in-plane (or 3D) stress `(..., d, d)`."""
        stress = _tensors(stress, "Isotropic.strain: stress")
        d = stress.shape[-1]
        trace = np.trace(stress, axis1=-2, axis2=-1)[..., None, None]
        return (stress - self.lam / (d * self.lam + 2 * self.mu) * trace * np.eye(d)) / (
            2 * self.mu
        )


def _tensors(value: object, what: str) -> Floats:
    tensors = numbers(value, what)
    if tensors.shape[-2:] not in ((2, 2), (3, 3)):
        raise ProblemError(
            f"{what} has the shape {tensors.shape}: give (..., 2, 2) or (..., 3, 3)."
        )
    return tensors
