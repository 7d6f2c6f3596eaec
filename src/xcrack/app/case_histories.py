"""Load states, histories, and retardation after overloads, as tables of a case file give them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from xcrack.app.case_tables import Table
from xcrack.app.case_values import argument_of, called_with, makers_of, value_of_table
from xcrack.base.arguments import arguments_of
from xcrack.base.errors import XcrackError
from xcrack.base.units import NUMBER
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.files import read_spectrum, twist
from xcrack.fatigue.retardation import Retardation, wheeler, willenborg
from xcrack.fatigue.spectrum import Spectrum
from xcrack.model.loads import Load

_HISTORIES: dict[str, Callable[..., Any] | None] = {
    "factors": None,  # those that are None are forms of Spectrum itself
    "rows": None,
    "states": None,
    "file": read_spectrum,
    "twist": twist,
}
_FORMS = ("factors", "rows", "states", "sequence")
_CHOICES = tuple(name for name in arguments_of(Spectrum) if name not in _FORMS)
_MODELS = {"wheeler": wheeler, "willenborg": willenborg}


def load_states(table: Table, name: str) -> tuple[Any, ...]:
    """A list of load states: each a factor, a load or a list of loads.

    Raises
    ------
    ProblemError
        Something else than these; with file and line.
    """
    value = table.content[name]
    if not isinstance(value, list) or not value:
        table.refuse(name, f"{value!r:.60}: give a list of factors, such as [0.1, 1.0].")
    result: list[Any] = []
    for k, state in enumerate(value):
        loads = [state] if isinstance(state, dict) else state
        if isinstance(loads, list) and all(isinstance(load, dict) for load in loads):
            tables = Table(table.source, (*table.key, name), {str(k): loads}).tables(str(k))
            result.append([value_of_table(each, makers_of(Load)) for each in tables])
        else:
            result.append(Table(table.source, table.key, {name: state}).value(name, NUMBER))
    return tuple(result)


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
        cycle = table.table("cycle")
        if "states" not in cycle:
            return called_with(cycle, Cycle)  # type: ignore[no-any-return]
        cycle.known(("states",), " beside states")
        try:
            return Cycle(states=load_states(cycle, "states"))
        except XcrackError as error:
            cycle.wrap(error)
    if "cycle" in table:
        table.refuse("spectrum", "give cycle or spectrum, not both.")
    given = table.table("spectrum")
    kind = given.text("kind", next((name for name in _HISTORIES if name in given), "factors"))
    if kind not in _HISTORIES:
        given.refuse("kind", f"{kind!r:.40} is not known: known are {', '.join(_HISTORIES)}.")
    maker = _HISTORIES[kind]
    own = list(arguments_of(maker)) if maker else [kind, *(["sequence"] * (kind == "states"))]
    given.known(["kind", *own, *_CHOICES], f" of {kind!r}")
    choices: dict[str, Any] = {
        name: (
            tuple(value_of_table(load, makers_of(Load)) for load in given.tables(name))
            if name == "steady"
            else argument_of(given, name, Spectrum)
        )
        for name in _CHOICES
        if name in given
    }
    try:
        if maker is not None:
            content = {n: v for n, v in given.content.items() if n not in _CHOICES and n != "kind"}
            return replace(called_with(Table(given.source, given.key, content), maker), **choices)
        for name in own:
            if name not in given:
                given.refuse("", f"the key {name!r} of {kind!r} is missing: give it.")
        forms: dict[str, Any] = {
            name: load_states(given, name)
            if name == "states"
            else argument_of(given, name, Spectrum)
            for name in own
        }
        return Spectrum(**forms, **choices)
    except XcrackError as error:
        if str(error).startswith(str(given.source.path)):
            raise
        given.wrap(error)


def retardation_of(table: Table) -> Retardation | dict[str, Retardation]:
    """The model of a table, whose zone is a table too; or by tables one for each material."""
    several = table.content and all(isinstance(each, dict) for each in table.content.values())
    if several and "zone" not in table:
        return {name: _model(table.table(name)) for name in table.content}
    return _model(table)


def _model(table: Table) -> Retardation:
    if "zone" not in table:
        table.refuse("", "the key 'zone' is missing: give zone = { sigma_y = ..., beta = ... }.")
    return value_of_table(table, _MODELS)  # type: ignore[no-any-return]


__all__ = ["load_states", "loading", "retardation_of"]
