"""Lives with scatter, inspections and residual strength, as tables of a case file ask for them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from xcrack.app.case_histories import retardation_of
from xcrack.app.case_tables import Table
from xcrack.app.case_values import argument_of, called_with, value_of_table
from xcrack.base.arguments import Array, Declared, arguments_of
from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS
from xcrack.fatigue.spectrum import Spectrum
from xcrack.model.problem import Problem
from xcrack.runs.assessment import assessment_line, residual_strength
from xcrack.runs.inspection import inspection, logistic_pod
from xcrack.runs.life import life
from xcrack.runs.retarded import retarded
from xcrack.runs.scatter import Scatter, lognormal, normal

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


def _check_points(x: Floats, y: Floats, what: str, other: str) -> None:
    if len(x) != len(y) or len(x) < 2 or not (np.diff(x) > 0).all():
        raise ProblemError(f"{what}: give two rising numbers at least, and as many of {other}.")


def _scatter(table: Table) -> Scatter:
    """What varies, by its name."""
    table.known(arguments_of(Scatter))
    given: dict[str, Any] = {
        name: _distribution(table.table(name), name)
        for name in table.content
        if name not in ("constants", "correlation")
    }
    constants = table.table("constants")
    if "constants" in table:
        given["constants"] = {
            name: _distribution(constants.table(name), name) for name in constants.content
        }
    if "correlation" in table:
        rows = table.content["correlation"]
        if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 3 for r in rows):
            table.refuse("correlation", 'give a list of pairs and numbers, [["C", "m", -0.98]].')
        given["correlation"] = {(one, other): rho for one, other, rho in rows}
    try:
        return Scatter(**given)
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
    table.known([name for name in arguments_of(life) if name not in _OF_RUN])
    for name in ("scatter", "seed"):
        if name not in table:
            table.refuse("", f"the key {name!r} is missing: give it.")
    given = {name: argument_of(table, name, life) for name in table.content
             if name not in ("scatter", "nu")}  # fmt: skip
    given |= {"scatter": _scatter(table.table("scatter")), "law": growth["law"]}
    if isinstance(growth["law"], Mapping):
        given["law"] = None  # laws by material: what needs one is refused by `life`
    if isinstance(growth["cycle"], Spectrum):
        given |= {"spectrum": growth["cycle"], "criterion": growth["criterion"],
                  "nu": _poisson(table, problem)}  # fmt: skip
        given |= {name: growth[name] for name in ("threshold", "retardation") if name in growth}
    return MappingProxyType(given)


def retarded_of(table: Table, problem: Problem, growth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Arguments of `retarded` beside the history; law and spectrum are those of the growth.

    Raises
    ------
    ProblemError
        A wrong key, unit or value, or growth without a spectrum; with file and line.
    """
    if not isinstance(growth["cycle"], Spectrum):
        table.refuse("", "overloads are of a spectrum: give [growth.spectrum] in place of a cycle.")
    own = [name for name in arguments_of(retarded) if name not in (*_OF_RUN, "model")]
    given = {name: argument_of(table, name, retarded) for name in own if name in table}
    content = {name: value for name, value in table.content.items() if name not in own}
    given["model"] = retardation_of(Table(table.source, table.key, content))
    if isinstance(given["model"], dict):
        table.refuse("", "it is of one model: give kind, its numbers and zone.")
    given |= {"nu": _poisson(table, problem), "law": growth["law"], "spectrum": growth["cycle"]}
    return MappingProxyType(given)


def inspection_of(table: Table) -> Mapping[str, Any]:
    """Arguments of `inspection` beside the history.

    Raises
    ------
    ProblemError
        A wrong key, unit or value; with file and line.
    """
    table.known([name for name in arguments_of(inspection) if name not in _OF_RUN])
    given = {name: argument_of(table, name, inspection) for name in table.content if name != "pod"}
    if "pod" in table:
        given["pod"] = called_with(table.table("pod"), logistic_pod)
    if ("a_detect" in given) == ("interval" in given):
        table.refuse("", "give a_detect or interval, and not both.")
    return MappingProxyType(given)


def strength_of(table: Table, problem: Problem, growth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Arguments of `residual_strength` beside the history; of the material where none are given.

    Raises
    ------
    ProblemError
        A wrong key, unit or value, or no toughness; with file and line.
    """
    table.known([name for name in arguments_of(residual_strength) if name not in _OF_RUN])
    material = problem.elasticity.material
    given: dict[str, Any] = {"nu": _poisson(table, problem)}
    of_body = {"K_c": growth.get("K_c", material.K_c), "yield_stress": material.yield_stress}
    for name, known in of_body.items():
        if name in table:
            given[name] = argument_of(table, name, residual_strength)
        elif known is not None:
            given[name] = known
    if "K_c" not in given:
        table.refuse(
            "", "the key 'K_c' is missing, and neither growth nor material have it: give it."
        )
    makers = {"resistance": ResistanceCurve, "collapse": CollapseFactor, "line": assessment_line}
    for name, maker in makers.items():
        if name in table:
            given[name] = called_with(table.table(name), maker)
    return MappingProxyType(given)


__all__ = ["inspection_of", "life_of", "retarded_of", "strength_of"]
