"""Load histories from text files."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import FileName, Number, Switch, Whole, check_arguments
from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors
from xcrack.fatigue.spectrum import BlockName, Spectrum

_COMMENTS = ("#", "%", "!", "//")


@check_arguments()
def read_spectrum(
    path: FileName,
    *,
    column: Annotated[int | None, Whole(least=0)] = None,
    rows: Switch = False,
    unit: BlockName = "block",
) -> Spectrum:
    """Read a load history: turning points, or counted cycles.

    Parameters
    ----------
    path : path
        Text; numbers are separated by spaces, tabs, commas or semicolons. Empty lines and those
        that begin with #, %, ! or // are passed over, and lines of text at the head.
    column : int, optional
        The column with the factor. If omitted, the file has one column.
    rows : bool
        Each line is min, max and count of a kind of cycle.
    unit : str
        What one repetition is called.

    Returns
    -------
    Spectrum

    Raises
    ------
    ProblemError
        A file that cannot be read, a line that does not fit (with its number), no such column.
    """
    file = Path(path)
    with system_errors(
        "read_spectrum: path: the spectrum cannot be read from", file, error=ProblemError
    ):
        text = file.read_text(encoding="utf-8", errors="replace")
    table: list[list[float]] = []
    for n, line in enumerate(text.splitlines(), 1):
        words = line.replace(",", " ").replace(";", " ").split()
        if not words or words[0].startswith(_COMMENTS):
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            if table:
                raise ProblemError(
                    f"{file}, line {n}: {line.strip()!r:.60} is no number: give "
                    "numbers, one line for each of them."
                ) from None
            continue
        if not np.isfinite(values).all():
            raise ProblemError(
                f"{file}, line {n}: {line.strip()!r:.60}: every number must be finite."
            )
        if table and len(values) != len(table[0]):
            raise ProblemError(
                f"{file}, line {n}: {len(values)} numbers, where the lines before have "
                f"{len(table[0])}: give as many in each."
            )
        table.append(values)
    if not table:
        raise ProblemError(
            f"{file}: there are no numbers in it: give a file with a level in each line."
        )
    data = np.array(table)
    if rows:
        if data.shape[1] != 3:
            raise ProblemError(f"{file}: {data.shape[1]} numbers a line: give min, max and count.")
        return _spectrum_of(file, rows=data, unit=unit)
    if column is None and data.shape[1] > 1:
        raise ProblemError(f"{file}: {data.shape[1]} columns: give column= or rows=True.")
    k = column or 0
    if k >= data.shape[1]:
        raise ProblemError(f"{file}: there is no column {k}: give 0 to {data.shape[1] - 1}.")
    return _spectrum_of(file, factors=data[:, k], unit=unit)


def _spectrum_of(file: Path, **arguments: Any) -> Spectrum:
    """A spectrum of numbers of a file, which errors name."""
    try:
        return Spectrum(**arguments)
    except ProblemError as error:
        raise ProblemError(f"{file}: {error}") from error


# TWIST, the flight-by-flight spectrum of the lower wing skin of a transport aircraft.

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


@check_arguments()
def twist(
    *,
    mean: Annotated[float, Number(above=0)],
    seed: Annotated[int, Whole(least=0)],
    flights: Annotated[int, Whole(least=1, most=int(_FLIGHTS.sum()))] = 4000,
) -> Spectrum:
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
        The first ones of a block only.

    Returns
    -------
    Spectrum
        Each flight begins with the load on the ground, -0.5 times the mean; then each gust up is
        followed by one down, of a size drawn from those of the flight. `unit` is "4000 flights".

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


__all__ = ["read_spectrum", "twist"]
