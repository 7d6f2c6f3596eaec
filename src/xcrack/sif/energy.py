"""Energy release rate from K."""

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.inputs import shown
from xcrack.scene.material import Isotropic
from xcrack.sif.sif import SIF


def energy_release_rate(sif: SIF, material: Isotropic) -> Floats:
    """Energy that is released per area of new crack straight ahead; J of an elastic body.

    Parameters
    ----------
    sif : SIF
    material : Isotropic

    Returns
    -------
    (f,) array, stress length

    Raises
    ------
    ProblemError
        Other kinds of value.

    Notes
    -----
    G = J = (K_I² + K_II²) / E' + K_III² / (2 µ) (Irwin 1957), E' = E / (1 - nu²) in plane strain
    and 3D, E in plane stress. At a tip that is closed K_I is zero.
    """
    if not isinstance(sif, SIF):
        raise ProblemError(
            f"energy_release_rate: sif = {shown(sif)}: give what stress_intensity returns."
        )
    if not isinstance(material, Isotropic):
        raise ProblemError(f"energy_release_rate: material = {shown(material)}: give Isotropic.")
    K = sif.K
    G = (K[:, 0] ** 2 + K[:, 1] ** 2) / material.E_prime
    if K.shape[1] == 3:
        G = G + K[:, 2] ** 2 / (2 * material.mu)
    return np.asarray(G)


__all__ = ["energy_release_rate"]
