"""Isotropic linear elasticity."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers, shown
from xcrack.base.errors import ProblemError

_PLANES = ("strain", "stress")


@dataclass(frozen=True)
class Isotropic:
    """Isotropic linear elastic material; nothing has a default but the plane of a 3D body.

    Parameters
    ----------
    E : float, stress
        Young's modulus, positive.
    nu : float
        Poisson's ratio in (-1, 0.5).
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

    E: float
    nu: float
    plane: str | None = None

    def __post_init__(self) -> None:
        number(self.E, "Young's modulus E", above=0)
        if not -1 < number(self.nu, "Poisson's ratio nu") < 0.5:
            raise ProblemError(
                f"Poisson's ratio nu = {self.nu} must lie in (-1, 0.5); for a nearly "
                "incompressible material take a value such as 0.4999."
            )
        if not (self.plane is None or (isinstance(self.plane, str) and self.plane in _PLANES)):
            raise ProblemError(
                f'Isotropic(plane={shown(self.plane)}): give "strain" or "stress" in 2D, nothing '
                "in 3D."
            )

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
