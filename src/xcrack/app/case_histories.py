"""Load states, histories, lives and inspections, as tables of a case file give them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from xcrack.app.case_tables import Table
from xcrack.app.case_values import argument_of, called_with, makers_of, value_of_table
from xcrack.base.arguments import Array, Declared, arguments_of
from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.files import read_spectrum, twist
from xcrack.fatigue.retardation import Retardation, wheeler, willenborg
from xcrack.fatigue.spectrum import Spectrum
from xcrack.model.loads import Load
from xcrack.model.problem import Problem
from xcrack.runs.assessment import assessment_line, residual_strength
from xcrack.runs.inspection import inspection, logistic_pod
from xcrack.runs.life import life
from xcrack.runs.retarded import retarded
from xcrack.runs.scatter import Scatter, lognormal, normal

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
            result.append([value_of_table(load_table, makers_of(Load)) for load_table in tables])
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
        cycle.check_names(("states",), " beside states")
        try:
            return Cycle(states=load_states(cycle, "states"))
        except XcrackError as error:
            cycle.wrap(error)
    if "cycle" in table:
        table.refuse("spectrum", "give cycle or spectrum, not both.")
    spectrum_table = table.table("spectrum")
    kind = spectrum_table.text(
        "kind", next((name for name in _HISTORIES if name in spectrum_table), "factors")
    )
    if kind not in _HISTORIES:
        spectrum_table.refuse(
            "kind", f"{kind!r:.40} is not known: known are {', '.join(_HISTORIES)}."
        )
    maker = _HISTORIES[kind]
    names = list(arguments_of(maker)) if maker else [kind, *(["sequence"] * (kind == "states"))]
    spectrum_table.check_names(["kind", *names, *_CHOICES], f" of {kind!r}")
    choices: dict[str, Any] = {
        name: (
            tuple(value_of_table(load, makers_of(Load)) for load in spectrum_table.tables(name))
            if name == "steady"
            else argument_of(spectrum_table, name, Spectrum)
        )
        for name in _CHOICES
        if name in spectrum_table
    }
    try:
        if maker is not None:
            content = {
                n: v for n, v in spectrum_table.content.items() if n not in _CHOICES and n != "kind"
            }
            return replace(
                called_with(Table(spectrum_table.source, spectrum_table.key, content), maker),
                **choices,
            )
        for name in names:
            if name not in spectrum_table:
                spectrum_table.refuse("", f"the key {name!r} of {kind!r} is missing: give it.")
        forms: dict[str, Any] = {
            name: load_states(spectrum_table, name)
            if name == "states"
            else argument_of(spectrum_table, name, Spectrum)
            for name in names
        }
        return Spectrum(**forms, **choices)
    except XcrackError as error:
        if str(error).startswith(str(spectrum_table.source.path)):
            raise
        spectrum_table.wrap(error)


def retardation_of(table: Table) -> Retardation | dict[str, Retardation]:
    """The model of a table, whose zone is a table too; or by tables one for each material."""
    is_by_set = table.content and all(isinstance(part, dict) for part in table.content.values())
    if is_by_set and "zone" not in table:
        return {name: _model(table.table(name)) for name in table.content}
    return _model(table)


def _model(table: Table) -> Retardation:
    if "zone" not in table:
        table.refuse("", "the key 'zone' is missing: give zone = { sigma_y = ..., beta = ... }.")
    return value_of_table(table, _MODELS)  # type: ignore[no-any-return]


# --- lives with scatter, inspections and residual strength ---


_DISTRIBUTIONS = {"lognormal": lognormal, "normal": normal}
_MIDDLES = ("median", "mean")  # of a distribution; a length where it is of lengths
_OF_RUN = ("history", "curve", "law", "spectrum", "criterion", "threshold", "retardation")


@dataclass(frozen=True, eq=False)
class ResistanceCurve(Declared):
    """An R-curve by its points: straight between them, level beyond the last.

    Attributes
    ----------
    da : (n,) array, length
    K : (n,) array, stress √length
    """

    da: Annotated[Any, Array((None,), unit=LENGTH)]
    K: Annotated[Any, Array((None,), unit=TOUGHNESS)]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_points(self.da, self.K, "resistance: da", "K")

    def __call__(self, da: float) -> float:
        """Resistance after an extension."""
        return float(np.interp(da, self.da, self.K))


@dataclass(frozen=True, eq=False)
class CollapseFactor(Declared):
    """Factor on the load at which the section yields, by points over the length of the crack.

    Attributes
    ----------
    a : (n,) array, length
    factor : (n,) array
    """

    a: Annotated[Any, Array((None,), unit=LENGTH)]
    factor: Annotated[Any, Array((None,))]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_points(self.a, self.factor, "collapse: a", "factor")

    def __call__(self, a: float) -> float:
        """Factor at a length; that of the nearer end outside."""
        return float(np.interp(a, self.a, self.factor))


def _check_points(x: Floats, y: Floats, label: str, name_of_y: str) -> None:
    if len(x) != len(y) or len(x) < 2 or not (np.diff(x) > 0).all():
        raise ProblemError(
            f"{label}: give two rising numbers at least, and as many of {name_of_y}."
        )


def _scatter(table: Table) -> Scatter:
    """What varies, by its name."""
    table.check_names(arguments_of(Scatter))
    arguments: dict[str, Any] = {
        name: _distribution(table.table(name), name)
        for name in table.content
        if name not in ("constants", "correlation")
    }
    constants = table.table("constants")
    if "constants" in table:
        arguments["constants"] = {
            name: _distribution(constants.table(name), name) for name in constants.content
        }
    if "correlation" in table:
        rows = table.content["correlation"]
        if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 3 for r in rows):
            table.refuse("correlation", 'give a list of pairs and numbers, [["C", "m", -0.98]].')
        arguments["correlation"] = {(p, q): rho for p, q, rho in rows}
    try:
        return Scatter(**arguments)
    except XcrackError as error:
        table.wrap(error)


def _distribution(table: Table, name: str) -> Any:
    """A distribution; one of lengths has a length in its middle."""
    if name == "a0":
        lengths = {n: table.value(n, LENGTH) for n in _MIDDLES if n in table}
        table = Table(table.source, table.key, {**table.content, **lengths})
    return value_of_table(table, _DISTRIBUTIONS)


def _poisson(table: Table, problem: Problem) -> float:
    """Poisson's ratio that is given, or that of the material."""
    if "nu" in table:
        return float(table.value("nu", NUMBER))
    try:
        return problem.elasticity.material.at_tip().nu
    except XcrackError:
        table.refuse("", "the key 'nu' is missing: give it, the body has no one Poisson's ratio.")


def life_of(table: Table, problem: Problem, growth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Arguments of `life` beside the history; law and spectrum are those of the growth.

    Raises
    ------
    ProblemError
        A wrong key, unit or value; with file and line.
    """
    table.check_names([name for name in arguments_of(life) if name not in _OF_RUN])
    for name in ("scatter", "seed"):
        if name not in table:
            table.refuse("", f"the key {name!r} is missing: give it.")
    arguments = {name: argument_of(table, name, life) for name in table.content
             if name not in ("scatter", "nu")}  # fmt: skip
    arguments |= {"scatter": _scatter(table.table("scatter")), "law": growth["law"]}
    if isinstance(growth["law"], Mapping):
        arguments["law"] = None  # laws by material: what needs one is refused by `life`
    if isinstance(growth["cycle"], Spectrum):
        arguments |= {"spectrum": growth["cycle"], "criterion": growth["criterion"],
                  "nu": _poisson(table, problem)}  # fmt: skip
        arguments |= {name: growth[name] for name in ("threshold", "retardation") if name in growth}
    return MappingProxyType(arguments)


def retarded_of(table: Table, problem: Problem, growth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Arguments of `retarded` beside the history; law and spectrum are those of the growth.

    Raises
    ------
    ProblemError
        A wrong key, unit or value, or growth without a spectrum; with file and line.
    """
    if not isinstance(growth["cycle"], Spectrum):
        table.refuse("", "overloads are of a spectrum: give [growth.spectrum] in place of a cycle.")
    names = [name for name in arguments_of(retarded) if name not in (*_OF_RUN, "model")]
    arguments = {name: argument_of(table, name, retarded) for name in names if name in table}
    content = {name: value for name, value in table.content.items() if name not in names}
    arguments["model"] = retardation_of(Table(table.source, table.key, content))
    if isinstance(arguments["model"], dict):
        table.refuse("", "it is of one model: give kind, its numbers and zone.")
    arguments |= {"nu": _poisson(table, problem), "law": growth["law"], "spectrum": growth["cycle"]}
    return MappingProxyType(arguments)


def inspection_of(table: Table) -> Mapping[str, Any]:
    """Arguments of `inspection` beside the history.

    Raises
    ------
    ProblemError
        A wrong key, unit or value; with file and line.
    """
    table.check_names([name for name in arguments_of(inspection) if name not in _OF_RUN])
    arguments = {
        name: argument_of(table, name, inspection) for name in table.content if name != "pod"
    }
    if "pod" in table:
        arguments["pod"] = called_with(table.table("pod"), logistic_pod)
    if ("a_detect" in arguments) == ("interval" in arguments):
        table.refuse("", "give a_detect or interval, and not both.")
    return MappingProxyType(arguments)


def strength_of(table: Table, problem: Problem, growth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Arguments of `residual_strength` beside the history; of the material where none are given.

    Raises
    ------
    ProblemError
        A wrong key, unit or value, or no toughness; with file and line.
    """
    table.check_names([name for name in arguments_of(residual_strength) if name not in _OF_RUN])
    material = problem.elasticity.material
    arguments: dict[str, Any] = {"nu": _poisson(table, problem)}
    of_body = {"K_c": growth.get("K_c", material.K_c), "yield_stress": material.yield_stress}
    for name, value_of_body in of_body.items():
        if name in table:
            arguments[name] = argument_of(table, name, residual_strength)
        elif value_of_body is not None:
            arguments[name] = value_of_body
    if "K_c" not in arguments:
        table.refuse(
            "", "the key 'K_c' is missing, and neither growth nor material have it: give it."
        )
    makers = {"resistance": ResistanceCurve, "collapse": CollapseFactor, "line": assessment_line}
    for name, maker in makers.items():
        if name in table:
            arguments[name] = called_with(table.table(name), maker)
    return MappingProxyType(arguments)


__all__ = [
    "inspection_of",
    "life_of",
    "load_states",
    "loading",
    "retardation_of",
    "retarded_of",
    "strength_of",
]
