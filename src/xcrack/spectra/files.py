"""Load histories from text files."""

from pathlib import Path

import numpy as np

from xcrack.errors import ProblemError
from xcrack.inputs import flag, whole
from xcrack.paths import path_of, system_errors
from xcrack.spectra.spectrum import Spectrum

_COMMENTS = ("#", "%", "!", "//")


def read_spectrum(
    path: str | Path, *, column: int | None = None, rows: bool = False, unit: str = "block"
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
    file = path_of(path, "read_spectrum: path", error=ProblemError)
    rows = flag(rows, "read_spectrum: rows")
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
                    f"{file}, line {n}: {line.strip()!r:.60} is no number."
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
            raise ProblemError(f"{file}: {data.shape[1]} numbers a line: rows are min, max, count.")
        return Spectrum(rows=data, unit=unit)
    if column is None and data.shape[1] > 1:
        raise ProblemError(f"{file}: {data.shape[1]} columns: give column= or rows=True.")
    number = 0 if column is None else whole(column, "read_spectrum: column", least=0)
    if number >= data.shape[1]:
        raise ProblemError(f"{file}: there is no column {number}: give 0 to {data.shape[1] - 1}.")
    return Spectrum(data[:, number], unit=unit)


__all__ = ["read_spectrum"]
