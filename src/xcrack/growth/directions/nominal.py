"""Range and ratio of a crack whose faces may overlap."""

import numpy as np

from xcrack.arrays import Floats


def nominal_range(K: Floats, angle: Floats, nu: float) -> tuple[Floats, Floats]:
    """Range and ratio of a crack whose faces may overlap, R < 0 included.

    Parameters
    ----------
    K : (s, f, 2 or 3) array, stress √length
        Of the scene without contact.
    angle : (f,) array, rad
        Direction at each place.
    nu : float

    Returns
    -------
    dK_eq : (f,) array, stress √length
    R : (f,) array
        0 where no state opens the place; the range is 0 there too.

    Notes
    -----
    K_eq as of `equivalent_K`, but for its sign: where the hoop stress is compressive it is the
    bracket of Erdogan and Sih alone, and negative.
    """
    cos, sin = np.cos(angle / 2), np.sin(angle / 2)
    K_eq = cos**2 * (K[..., 0] * cos - 3 * K[..., 1] * sin)
    if K.shape[-1] == 3:
        K_eq = np.where(K_eq >= 0, np.hypot(K_eq, K[..., 2] / np.sqrt(1 - nu)), K_eq)
    largest, smallest = K_eq.max(axis=0), K_eq.min(axis=0)
    opens = largest > 0
    R = np.divide(smallest, largest, out=np.zeros_like(largest), where=opens)
    return np.where(opens, largest - smallest, 0.0), R


__all__ = ["nominal_range"]
