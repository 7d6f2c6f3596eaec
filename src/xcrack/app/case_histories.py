"""Load histories, and retardation after overloads, as tables of a case file give them."""

import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from xcrack.app.case_tables import Table
from xcrack.app.case_values import called_with, makers_of, value_of_table
from xcrack.base.arguments import FileName
from xcrack.base.errors import XcrackError
from xcrack.base.units import NUMBER
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.files import read_spectrum, twist
from xcrack.fatigue.retardation import Retardation, wheeler, willenborg
from xcrack.fatigue.spectrum import Spectrum
from xcrack.model.loads import Load

_CHOICES = ("unit", "least_range", "levels", "tolerance", "steady")


def _factors(factors: Any) -> Spectrum:
    return Spectrum(factors)


def _rows(rows: Any) -> Spectrum:
    return Spectrum(rows=rows)


def _file(path: FileName, column: int | None = None, rows: bool = False) -> Spectrum:
    return read_spectrum(path, column=column, rows=rows)


_HISTORIES: dict[str, Callable[..., Any]] = {
    "factors": _factors,
    "rows": _rows,
    "file": _file,
    "twist": twist,
}
_MODELS = {"wheeler": wheeler, "willenborg": willenborg}


def loading(table: Table) -> Cycle | Spectrum:
    """The cycle of a growth table, or its spectrum.

    Raises
    ------
    ProblemError
        Neither or both are there, or one that does not fit; with file and line.
    """
    if "spectrum" not in table:
        if "cycle" not in table:
            table.refuse("", "the key 'cycle' is missing; or give 'spectrum'.")
        return called_with(table.table("cycle"), Cycle)
    if "cycle" in table:
        table.refuse("spectrum", "give cycle or spectrum, not both.")
    given = table.table("spectrum")
    kind = given.text("kind", next((name for name in _HISTORIES if name in given), "factors"))
    if kind in _HISTORIES:
        parameters_of_kind = inspect.signature(_HISTORIES[kind]).parameters
        given.known(["kind", *parameters_of_kind, *_CHOICES], f" of {kind!r}")
    remaining = {name: value for name, value in given.content.items() if name not in _CHOICES}
    spectrum = value_of_table(
        Table(given.source, given.key, {"kind": kind, **remaining}), _HISTORIES
    )
    choices = {name: given.value(name, NUMBER) for name in _CHOICES[1:4] if name in given
               and name != "levels"}  # fmt: skip
    if "levels" in given:
        choices["levels"] = given.content["levels"]
    if "unit" in given:
        choices["unit"] = given.text("unit")
    if "steady" in given:
        choices["steady"] = tuple(
            value_of_table(load, makers_of(Load)) for load in given.tables("steady")
        )
    try:
        return replace(spectrum, **choices)
    except XcrackError as error:
        given.wrap(error)


def retardation_of(table: Table) -> Retardation | dict[str, Retardation]:
    """The model of a table, whose zone is a table too; or by tables one for each material."""
    several = table.content and all(isinstance(each, dict) for each in table.content.values())
    if several and "zone" not in table:
        return {name: _model(table.table(name)) for name in table.content}
    return _model(table)


def _model(table: Table) -> Retardation:
    if "zone" not in table:
        table.refuse("", "the key 'zone' is missing: zone = { sigma_y = ..., beta = ... }.")
    return value_of_table(table, _MODELS)


__all__ = ["loading", "retardation_of"]
