"""Load histories."""

from pathlib import Path

import xcrack as xc
from fuzz.entry import Entry, arg
from fuzz.kinds import Filename, ListOf, Number, Numbers, Of, Seen, Whole, Word, real
from xcrack import Load


def varies(values):
    """Whether a history has two values that differ."""
    return values.size > 1 and bool(values.min() < values.max())


def rows_fit(rows):
    """Whether rows are min, max and count."""
    return bool(len(rows) and (rows[:, 0] < rows[:, 1]).all() and (rows[:, 2] > 0).all())


def levels(value):
    """Whether a value is a number of levels, or says that they are found."""
    if isinstance(value, str):
        return value == "auto"
    x = real(value)
    return x is not None and x.is_integer() and (None if x > 50 else x >= 2)


FACTORS = arg(Numbers((None,), rule=varies), [0.0, 1.0, 0.4, 0.6], (1, -1))
UNIT = arg(Word(rule=bool), "flight")
LEVELS = arg(Seen(rule=levels), "auto", 9)
TOLERANCE = arg(Number(above=0, below=1), 0.01)
STEADY = arg(ListOf(item=Of(type=Load)), (), [xc.traction("top", (0.0, 1.0))])


def _read(path, column):
    Path("history.txt").write_text("0 0\n1 5\n2 1\n")
    return xc.read_spectrum(path, column=column)


def _rows(least):
    return xc.Spectrum(rows=[(0.0, 1.0, 5.0), (0.2, 0.4, 50.0)], least_range=least)


ENTRIES = [
    Entry("rainflow", xc.rainflow, {"values": FACTORS}),
    Entry(
        "Spectrum",
        xc.Spectrum,
        {
            "factors": FACTORS,
            "unit": UNIT,
            "steady": STEADY,
            "levels": LEVELS,
            "tolerance": TOLERANCE,
        },
    ),
    Entry(
        "Spectrum",
        lambda rows: xc.Spectrum(rows=rows),
        {"rows": arg(Numbers((None, 3), rule=rows_fit), [(0.0, 1.0, 10)])},
    ),
    Entry(
        "Spectrum",
        lambda sequence: xc.Spectrum(states=[0.0, 1.0, 0.5], sequence=sequence),
        {"sequence": arg(Numbers((None,), whole=True, least=0, most=2, rule=varies), [0, 1, 2, 1])},
    ),
    Entry("Spectrum", _rows, {"least": arg(Number(least=0), 0.0, 0.3)}),
    Entry(
        "Spectrum",
        lambda range: xc.Spectrum([0.0, 1.0, 0.4, 0.6]).omit(range),
        {"range": arg(Number(least=0, most=1), 0.3)},
    ),
    Entry(
        "Spectrum",
        lambda factor: xc.Spectrum([0.0, 1.0, 0.4, 0.6]).scaled(factor),
        {"factor": arg(Number(above=0), 2.0)},
    ),
    Entry(
        "twist",
        lambda mean, seed, flights: xc.twist(mean=mean, seed=seed, flights=flights),
        {
            "mean": arg(Number(above=0), 1.0),
            "seed": arg(Whole(least=0), 3),
            "flights": arg(Whole(least=1, most=4000), 5),
        },
    ),
    Entry(
        "read_spectrum",
        _read,
        {
            "path": arg(Filename(known=("history.txt",)), "history.txt"),
            "column": arg(Whole(least=0, most=1), 1),
        },
        in_folder=True,
    ),
]
HOOKS = []
