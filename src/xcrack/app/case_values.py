"""What tables of a case file may hold: the functions that they call, units of their arguments."""

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from xcrack.app.case_tables import Table
from xcrack.base.arguments import (
    Argument,
    FilePath,
    Function,
    Part,
    arguments_of,
    classes_of,
    kinds_of,
)
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import NUMBER, Dimension
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import (
    elliptic_crack,
    penny_crack,
    plane_crack,
    read_surface,
    surface_crack,
)
from xcrack.fatigue import criteria, fracture, power  # noqa: F401 - laws are found as classes
from xcrack.fatigue.law import GrowthLaw
from xcrack.fatigue.tables import rate_table
from xcrack.fatigue.time import with_time
from xcrack.mesh.box import box
from xcrack.mesh.cylinder import notched_cylinder
from xcrack.mesh.files import read_mesh
from xcrack.mesh.plates import plate, plate_with_hole
from xcrack.mesh.step_file import mesh_step

_WORD = "kind"


MESHES: dict[str, Callable[..., Any]] = {
    "file": read_mesh,
    "step": mesh_step,
    "box": box,
    "plate": plate,
    "plate_with_hole": plate_with_hole,
    "notched_cylinder": notched_cylinder,
}
CRACKS: dict[str, Callable[..., Any]] = {
    "line": line_crack,
    "penny": penny_crack,
    "ellipse": elliptic_crack,
    "polygon": plane_crack,
    "file": read_surface,
    "surface": surface_crack,
}


def _rate_table(curves: Any, outside: str = "refuse", ratio: str | None = None) -> rate_table:
    """A table of rates from a list of curves, each with R, dK and rate."""
    rows = [curve if isinstance(curve, dict) else {} for curve in curves]
    if not all(set(row) == {"R", "dK", "rate"} for row in rows):
        raise ProblemError("rate_table: curves: give a list of { R = .., dK = [..], rate = [..] }.")
    points = {row["R"]: (row["dK"], row["rate"]) for row in rows}
    return rate_table(points, outside, ratio)  # type: ignore[arg-type]


def makers_of(base: type) -> dict[str, Callable[..., Any]]:
    """What makes values of a base, by name: loads, supports, laws and their parts."""
    makers: dict[str, Callable[..., Any]] = dict(kinds_of(base))
    if base is GrowthLaw:
        makers |= {"rate_table": _rate_table, "with_time": with_time}
    return makers


CRITERIA: dict[str, Callable[..., Any]] = {
    "max_hoop_stress": criteria.max_hoop_stress,
    "weighted_angle": criteria.weighted_angle,
    "mean_reference": criteria.mean_reference,
}


def value_of_table(
    table: Table, makers: Mapping[str, Callable[..., Any]], default: str = ""
) -> Any:
    """Value of a table: that of the function which its key `kind` names.

    Raises
    ------
    ProblemError
        No such kind, a key that is unknown or missing, a wrong unit, or what the function says;
        with file and line.
    """
    kind = table.text(_WORD, default or None)
    if kind not in makers:
        table.refuse(_WORD, f"{kind!r:.40} is not known: known are {', '.join(makers)}.")
    return called_with(table, makers[kind], f" of {kind!r}", (_WORD,))


def value_of_kind(table: Table, base: type, default: type) -> Any:
    """Value of a table whose `kind` derives from a base; without one it is of the default kind."""
    if _WORD in table:
        return value_of_table(table, makers_of(base))
    return called_with(table, default)


def called_with(
    table: Table, maker: Callable[..., Any], what: str = "", besides: tuple[str, ...] = ()
) -> Any:
    """Call a function or class with the keys of a table."""
    parameters = inspect.signature(maker).parameters
    table.known([*besides, *parameters], what)
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in table:
            table.refuse("", f"the key {name!r}{what} is missing: give it.")
    given: dict[str, Any] = {}
    for name in table.content:
        if name in besides:
            continue
        given[name] = _argument(table, name, maker, parameters[name])
    try:
        return maker(**given)
    except (XcrackError, TypeError, ValueError) as error:
        table.wrap(error if isinstance(error, XcrackError) else ProblemError(str(error)))


def _argument(
    table: Table, name: str, maker: Callable[..., Any], parameter: inspect.Parameter
) -> Any:
    declared = arguments_of(maker).get(name)
    rule = None if declared is None else declared.rule
    if isinstance(rule, FilePath):
        return _file(table, name)
    if isinstance(rule, Part) and isinstance(table.content[name], dict):
        return _part(table.table(name), rule)
    if isinstance(rule, Function) and isinstance(table.content[name], dict):
        return value_of_table(table.table(name), makers_of(GrowthLaw))
    if rule is not None and rule.takes_names and isinstance(table.content[name], str):
        return table.content[name]
    value = table.value(name, _dimension_of(declared, parameter))
    is_flat_list = isinstance(value, list) and value and not any(isinstance(v, list) for v in value)
    return tuple(value) if is_flat_list else value


def _part(table: Table, rule: Part) -> Any:
    """A value within another one: a table that names its kind, where there are several."""
    kinds = classes_of(rule.kind)
    if len(kinds) == 1 and _WORD not in table:
        (kind,) = kinds.values()
        return called_with(table, kind)
    return value_of_table(table, kinds)


def _file(table: Table, name: str) -> Path:
    """A file that a key names, from the folder of the case file."""
    path = table.source.path.parent / table.text(name)
    if not path.is_file():
        similar_files = (
            sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.suffix else []
        )
        hint = f"; beside it are {', '.join(similar_files[:5])}" if similar_files else ""
        table.refuse(name, f"there is no file {path}{hint}: paths begin at the case file.")
    return path


def _dimension_of(declared: Argument | None, parameter: inspect.Parameter) -> Dimension | None:
    """Dimension by the rule of an argument; text is refused for numbers without a unit."""
    unit = None if declared is None or declared.rule is None else declared.rule.unit
    if unit is not None:
        return None if callable(unit) else unit
    return NUMBER if str(parameter.annotation) in ("<class 'float'>", "float | None") else None


__all__ = [
    "CRACKS",
    "CRITERIA",
    "MESHES",
    "called_with",
    "makers_of",
    "value_of_kind",
    "value_of_table",
]
