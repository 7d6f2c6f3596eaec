"""Kink angles along fronts without the noise of K_II, by which a front would leave its plane."""

import numpy as np
from scipy.fft import dct, idct

from xcrack.base.arrays import Floats
from xcrack.crack.front_chain import along_front
from xcrack.sif.sif import SIF

_BAND = 2  # waves on either side over which a power is averaged
_WAVES = 2.3  # places to a wave of K: tops of its hats are two cells apart
_FEWEST = 8  # places of a front
_MIXED = 3.0  # times its noise, from which on K_II is an answer that a filter would only bend


def without_noise(sif: SIF, angle: Floats, closed: Floats, length: Floats) -> Floats:
    """Kink angles along all fronts of a crack by a Wiener filter in wave number.

    Parameters
    ----------
    sif : SIF
        Of the state with the largest K_I.
    angle : (f,) array, rad
    closed : (k,) array of bool
        Of each front.
    length : (k,) array, length
        Of each front.

    Returns
    -------
    (f,) array, rad
        The mean along each front stays. Fronts in mixed mode, whose K_II is more than three times
        the difference of its two domains, keep their angles.

    Notes
    -----
    The noise of an angle is 2 ΔK_II/K_I, ΔK_II the difference of two domains, whose power is shared
    out over the waves that K can have; a wave is multiplied by 1 - noise/power, at least 0.
    """
    result = np.array(angle)
    for number in np.unique(sif.front):
        own = np.nonzero(sif.front == number)[0]
        K_I, noise = sif.K_I[own], sif.spread[own, 1]
        good = np.isfinite(sif.K[own]).all() and np.isfinite(noise).all() and K_I.max() > 0
        if len(own) < _FEWEST or not good or angle[own].any() == 0:
            continue
        if np.sqrt((sif.K_II[own] ** 2).mean()) > _MIXED * np.sqrt((noise**2).mean()):
            continue
        error = 2 * noise / np.maximum(K_I, 0.3 * K_I.max())
        result[own] = _filtered(
            sif.s[own], angle[own], error, bool(closed[number]), float(length[number])
        )
    return result


def _filtered(s: Floats, angle: Floats, error: Floats, closed: bool, length: float) -> Floats:
    n = 2 * len(s)
    span = length if closed else float(s.max() - s.min())
    place = np.arange(n) * span / n if closed else s.min() + (np.arange(n) + 0.5) * span / n
    even = along_front(s, angle, place, closed, length)
    noise = n * float((error**2).mean()) / max(4, int(len(s) / _WAVES))
    wave = np.fft.fft(even, norm="ortho") if closed else dct(even, norm="ortho")
    power = np.abs(wave) ** 2
    window = np.arange(-_BAND, _BAND + 1)
    near = np.arange(n)[:, None] + window
    near = near % n if closed else np.abs(np.clip(near, 1 - n, n - 1))
    mean = power[near].mean(axis=1)
    share = np.clip(1 - noise / np.maximum(mean, 1e-300), 0.0, 1.0)
    share[0] = 1.0
    if closed:
        less = np.fft.ifft((share - 1) * wave, norm="ortho").real
    else:
        less = idct((share - 1) * wave, norm="ortho")
    return np.asarray(angle + along_front(place, less, s, closed, length))


__all__ = ["without_noise"]
