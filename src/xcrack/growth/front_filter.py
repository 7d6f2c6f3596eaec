"""Advance of a front over a step, with the response of K to the shape that the advance changes.

Where a front lags behind, K is larger: a wave of wave number k and height u changes K by the
share u |k|/2 (Rice 1985), so that growth flattens it. A long step by the K of its beginning
overshoots: waves turn over, and grow. The exponential of the linear response does not, at any
length of a step.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct

from xcrack.base.arrays import Bools, Floats
from xcrack.crack.front_chain import along_front
from xcrack.sif.sif import SIF

_TINY = 1e-3  # of the largest advance: what hardly moves has no waves
_FEWEST = 4  # places of a front


@dataclass(frozen=True, eq=False)
class FrontWaves:
    """How the advance of one front answers to its own change of shape.

    Attributes
    ----------
    place : (n,) array, length
        Even points along the front.
    root : (n,) array, √length
        √(m a/2) at these, a the advance at the beginning of the step.
    modes : (n, n) array
        Columns: waves that keep their shape.
    decay : (n,) array
        By which exponent each of them falls over the step.
    is_closed : bool
    length : float, length
    """

    place: Floats
    root: Floats
    modes: Floats
    decay: Floats
    is_closed: bool
    length: float


def response(
    s: Floats, advance: Floats, exponent: float, turning_rate: float, is_closed: bool, length: float
) -> FrontWaves | None:
    """Response of one front; None where it is too short to have any.

    Parameters
    ----------
    s : (f,) array, length
        Places.
    advance : (f,) array, length
        By the rates at the beginning of the step.
    exponent : float
        Of the growth law.
    turning_rate : float, rad
        By which the front turns from its first place to its last one: a circle stays one.
    is_closed : bool
    length : float, length
        Of the whole front.

    Notes
    -----
    With B the operator of max(|k| - κ, 0), κ the turning over the length, r = √(m a/2) and
    S = r B r = E Λ Eᵀ, a disturbance u of the front obeys du/dt = -r S (u/r) over the step.
    """
    if len(s) < _FEWEST or advance.max() <= 0:
        return None
    n = 2 * len(s)
    span = length if is_closed else float(s.max() - s.min())
    if span <= 0:
        return None
    place = np.arange(n) * span / n if is_closed else s.min() + (np.arange(n) + 0.5) * span / n
    even_advance = along_front(s, advance, place, is_closed, length)
    root = np.sqrt(
        0.5 * exponent * np.where(even_advance > _TINY * even_advance.max(), even_advance, 0.0)
    )
    S = root[:, None] * _wave_operator(n, span, is_closed, turning_rate / span) * root
    decay, modes = np.linalg.eigh((S + S.T) / 2)
    return FrontWaves(place, root, modes, np.maximum(decay, 0.0), is_closed, length)


def _wave_operator(n: int, span: float, is_closed: bool, kappa: float) -> Floats:
    """Matrix `(n, n)` of max(|k| - κ, 0) on even points: by Fourier, or mirrored at both ends."""
    if is_closed:
        number = np.abs(np.fft.fftfreq(n, 1 / n))
        wave = np.exp(2j * np.pi * np.outer(np.arange(n), np.fft.fftfreq(n, 1 / n)) / n) / np.sqrt(
            n
        )
        factor = np.maximum(2 * np.pi * number / span - kappa, 0.0)
        return np.asarray(((wave * factor) @ wave.conj().T).real)
    number = np.arange(n)
    cosine = np.cos(np.pi * np.outer(np.arange(n) + 0.5, number) / n) * np.sqrt(2 / n)
    cosine[:, 0] /= np.sqrt(2)
    factor = np.maximum(np.pi * number / span - kappa, 0.0)
    return np.asarray((cosine * factor) @ cosine.T)


def predicted_advance(front: FrontWaves | None, s: Floats, advance: Floats) -> Floats:
    """Advance of a step by the rates at its beginning `(f,)`, length."""
    if front is None:
        return advance

    def change(even_advance: Floats) -> Floats:
        return _weighted_response(front, even_advance, _phi_1(front.decay) - 1)

    return _changed_advance(front, s, advance, advance, change)


def corrected_advance(
    front: FrontWaves | None, s: Floats, advance: Floats, later_advance: Floats
) -> Floats:
    """Advance of a step by the rates at its beginning and those at its predicted end.

    Notes
    -----
    r E [φ₁ ã₀ + φ₂ (ã* - e^-Λ ã₀)], ã = Eᵀ(a/r): of second order, and stable.
    """
    mean = 0.5 * (advance + later_advance)
    if front is None:
        return mean

    def change(even_advance: Floats) -> Floats:
        later_at_places = along_front(s, later_advance, front.place, front.is_closed, front.length)
        phi_1, phi_2 = _phi_1(front.decay), _phi_2(front.decay)
        first = _weighted_response(front, even_advance, phi_1 - phi_2 * np.exp(-front.decay) - 0.5)
        return first + _weighted_response(front, later_at_places, phi_2 - 0.5)

    return _changed_advance(front, s, advance, mean, change)


def _changed_advance(
    front: FrontWaves,
    s: Floats,
    advance: Floats,
    advance_without: Floats,
    change: Callable[[Floats], Floats],
) -> Floats:
    """A plain advance with the change that the response makes on even points."""
    even_advance = along_front(s, advance, front.place, front.is_closed, front.length)
    place_change = along_front(front.place, change(even_advance), s, front.is_closed, front.length)
    return np.asarray(np.maximum(advance_without + place_change, 0.0))


def _weighted_response(front: FrontWaves, values: Floats, factor: Floats) -> Floats:
    """Value r E f Eᵀ (values/r), zero where nothing grows."""
    is_growing = front.root > 0
    scaled_values = np.where(is_growing, values / np.where(is_growing, front.root, 1.0), 0.0)
    return np.asarray(front.root * (front.modes @ (factor * (front.modes.T @ scaled_values))))


def _phi_1(q: Floats) -> Floats:
    """(1 - e^-q)/q."""
    is_small = q < 1e-6
    safe_q = np.where(is_small, 1.0, q)
    return np.where(is_small, 1 - q / 2, -np.expm1(-safe_q) / safe_q)


def _phi_2(q: Floats) -> Floats:
    """(e^-q - 1 + q)/q²."""
    is_small = q < 1e-3
    safe_q = np.where(is_small, 1.0, q)
    return np.where(is_small, 0.5 - q / 6 + q**2 / 24, (np.expm1(-safe_q) + safe_q) / safe_q**2)


def turning_of(x: Floats, is_closed: bool) -> float:
    """By how much a front turns as a whole, rad: not by its zigzag.

    Parameters
    ----------
    x : (f, 3) array, length
        Points in order.
    is_closed : bool
    """
    if is_closed:
        return 2 * np.pi
    j = max(1, len(x) // 6)
    first_chord, last_chord = x[j] - x[0], x[-1] - x[-1 - j]
    cosine = first_chord @ last_chord / (np.linalg.norm(first_chord) * np.linalg.norm(last_chord))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


_BAND = 2  # waves on either side over which a power is averaged
_WAVES = 2.3  # places to a wave of K: tops of its hats are two cells apart
_FEWEST_OF_A_WAVE = 8  # places of a front
_MIXED = 3.0  # times its noise, from which on K_II is an answer that a filter would only bend


def without_noise(sif: SIF, angle: Floats, is_closed: Bools, length: Floats) -> Floats:
    """Kink angles along all fronts of a crack by a Wiener filter in wave number.

    Parameters
    ----------
    sif : SIF
        Of the state with the largest K_I.
    angle : (f,) array, rad
    is_closed : (f,) array of bool
    length : (f,) array, length
        Of the front of each place.

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
        rows = np.nonzero(sif.front == number)[0]
        K_I, noise = sif.K_I[rows], sif.spread[rows, 1]
        has_waves = np.isfinite(sif.K[rows]).all() and np.isfinite(noise).all() and K_I.max() > 0
        if len(rows) < _FEWEST_OF_A_WAVE or not has_waves or angle[rows].any() == 0:
            continue
        if np.sqrt((sif.K_II[rows] ** 2).mean()) > _MIXED * np.sqrt((noise**2).mean()):
            continue
        error = 2 * noise / np.maximum(K_I, 0.3 * K_I.max())
        first = rows[0]
        result[rows] = _filtered_angle(
            sif.s[rows], angle[rows], error, bool(is_closed[first]), float(length[first])
        )
    return result


def _filtered_angle(
    s: Floats, angle: Floats, error: Floats, is_closed: bool, length: float
) -> Floats:
    n = 2 * len(s)
    span = length if is_closed else float(s.max() - s.min())
    place = np.arange(n) * span / n if is_closed else s.min() + (np.arange(n) + 0.5) * span / n
    even_angle = along_front(s, angle, place, is_closed, length)
    noise = n * float((error**2).mean()) / max(4, int(len(s) / _WAVES))
    wave = np.fft.fft(even_angle, norm="ortho") if is_closed else dct(even_angle, norm="ortho")
    power = np.abs(wave) ** 2
    window = np.arange(-_BAND, _BAND + 1)
    rows_nearby = np.arange(n)[:, None] + window
    rows_nearby = rows_nearby % n if is_closed else np.abs(np.clip(rows_nearby, 1 - n, n - 1))
    mean = power[rows_nearby].mean(axis=1)
    share = np.clip(1 - noise / np.maximum(mean, 1e-300), 0.0, 1.0)
    share[0] = 1.0
    if is_closed:
        change = np.fft.ifft((share - 1) * wave, norm="ortho").real
    else:
        change = idct((share - 1) * wave, norm="ortho")
    return np.asarray(angle + along_front(place, change, s, is_closed, length))


__all__ = [
    "FrontWaves",
    "corrected_advance",
    "predicted_advance",
    "response",
    "turning_of",
    "without_noise",
]
