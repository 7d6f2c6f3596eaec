"""TWIST, the flight-by-flight spectrum of the lower wing skin of a transport aircraft."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.inputs import number, whole
from xcrack.spectra.spectrum import Spectrum

# Amplitudes of the gusts I to X over the mean stress in flight, and the load on the ground.
_GUSTS = np.array([1.60, 1.50, 1.30, 1.15, 0.995, 0.84, 0.685, 0.53, 0.375, 0.222])
_GROUND = -0.5
# Flights of the types A to J in a block, and gusts I to X in one flight of each.
_FLIGHTS = np.array([1, 1, 3, 9, 24, 60, 181, 420, 1090, 2211])
_PER_FLIGHT = np.array(
    [
        [1, 1, 1, 4, 8, 18, 64, 112, 391, 900],
        [0, 1, 1, 2, 5, 11, 39, 76, 366, 899],
        [0, 0, 1, 1, 2, 7, 22, 61, 277, 879],
        [0, 0, 0, 1, 1, 2, 14, 44, 208, 680],
        [0, 0, 0, 0, 1, 1, 6, 24, 165, 603],
        [0, 0, 0, 0, 0, 1, 3, 19, 115, 512],
        [0, 0, 0, 0, 0, 0, 1, 7, 70, 412],
        [0, 0, 0, 0, 0, 0, 0, 1, 16, 233],
        [0, 0, 0, 0, 0, 0, 0, 0, 1, 69],
        [0, 0, 0, 0, 0, 0, 0, 0, 0, 25],
    ]
)


def twist(*, mean: float, seed: int, flights: int = 4000) -> Spectrum:
    """TWIST by its definition: 4000 flights of ten types, drawn anew.

    The order of the flights, and of the gusts within each, is random by definition. This is a draw
    of its own, not the tape of the institutes that made it: lives with retardation may differ.

    Parameters
    ----------
    mean : float
        Factor of the mean stress in flight.
    seed : int
        Of the draw.
    flights : int
        The first ones of a block only, at most 4000.

    Returns
    -------
    Spectrum
        Each flight begins with the load on the ground, -0.5 times the mean; then each gust up is
        followed by one down, of a size drawn from those of the flight. `unit` is "4000 flights".

    Raises
    ------
    ProblemError
        A mean that is not positive, more than 4000 flights, a seed that is no whole number.

    Notes
    -----
    de Jonge, Schütz, Lowak and Schijve (1973), NLR TR 73029 / LBF FB-106. The table is from memory;
    its totals are those of the report: 4000 flights, 398 665 gusts, and per level 1, 2, 5, 18, 52,
    152, 800, 4170, 34 800 and 358 665. No other copy was found to compare it with.

    Examples
    --------
    >>> spectrum = twist(mean=1.0, seed=73, flights=10)
    >>> print(spectrum.extremes[0])
    -0.5
    """
    mean = number(mean, "twist: mean", above=0)
    seed = whole(seed, "twist: seed", least=0)
    flights = whole(flights, "twist: flights", least=1, most=int(_FLIGHTS.sum()))
    draw = np.random.default_rng(seed)
    kinds = draw.permutation(np.repeat(np.arange(len(_FLIGHTS)), _FLIGHTS))[:flights]
    factors = np.concatenate([_flight(draw, _PER_FLIGHT[kind]) for kind in kinds])
    return Spectrum(mean * factors, unit=f"{flights} flights")


def _flight(draw: np.random.Generator, gusts: Ints) -> Floats:
    sizes = np.repeat(_GUSTS, gusts)
    flight = np.empty(2 * len(sizes) + 1)
    flight[0] = _GROUND
    flight[1::2] = 1 + draw.permutation(sizes)
    flight[2::2] = 1 - draw.permutation(sizes)
    return flight


__all__ = ["twist"]
