"""The material of all charts, E = 1 and nu = 0.3, and Hooke's law for the baselines."""

import numpy as np

import xcrack as xc
from xcrack.base.arrays import Floats
from xcrack.verification.exact.potentials_2d import kolosov, plane_modulus, shear_modulus

E, NU = 1.0, 0.3
MU = shear_modulus(E, NU)
LAMBDA = E * NU / ((1 + NU) * (1 - 2 * NU))
KOLOSOV = kolosov(NU)  # plane strain
E_PRIME = plane_modulus(E, NU)
STEEL = {2: xc.Isotropic(E, NU, "strain"), 3: xc.Isotropic(E, NU)}


def stress_of(gradient: Floats) -> Floats:
    """Stress `(..., d, d)` of displacement gradients, in plane strain for d = 2.

    Parameters
    ----------
    gradient : (..., d, d)

    Returns
    -------
    (..., d, d), stress
    """
    strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return 2 * MU * strain + LAMBDA * trace * np.eye(gradient.shape[-1])


def energy(stress: Floats) -> Floats:
    """Twice the energy of a volume in plane strain, sigma : C^-1 : sigma.

    Parameters
    ----------
    stress : (..., 2, 2)

    Returns
    -------
    (...)
    """
    trace = np.trace(stress, axis1=-2, axis2=-1)
    square = np.einsum("...ij,...ij->...", stress, stress)
    return np.asarray((1 + NU) / E * (square - NU * trace**2))
