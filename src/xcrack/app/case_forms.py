"""What tables of a case file may hold: the functions that they call, units of their arguments."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from xcrack.app.case_tables import Table
from xcrack.base.arguments import Argument, Function, Part, arguments_of, classes_of, kinds_of
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, Dimension
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


@dataclass(frozen=True)
class Form:
    """A function that a table may name, and what its arguments are.

    Attributes
    ----------
    function : callable
    units : mapping of name to dimension
        Of arguments that may have a unit.
    files : tuple of str
        Arguments that are paths, from the folder of the file.
    """

    function: Callable[..., Any]
    units: Mapping[str, Dimension] = field(default_factory=dict)
    files: tuple[str, ...] = ()


def _lengths(*names: str) -> dict[str, Dimension]:
    return dict.fromkeys(names, LENGTH)


_PLATE = _lengths("width", "height", "radius", "size", "size_near", "center", "lower", "holes",
                  "along", "band", "transition")  # fmt: skip
MESHES = {
    "file": Form(read_mesh, files=("path",)),
    "step": Form(mesh_step, _lengths("size"), files=("path",)),
    "box": Form(box, _lengths("lower", "upper")),
    "plate": Form(plate, _PLATE),
    "plate_with_hole": Form(plate_with_hole, _PLATE),
    "notched_cylinder": Form(
        notched_cylinder,
        _lengths("diameter", "length", "notch_depth", "outer_span", "inner_span", "size",
                 "size_near", "patch_length", "crack_depth", "band", "transition"),
    ),
}  # fmt: skip
CRACKS = {
    "line": Form(line_crack, _lengths("points")),
    "penny": Form(penny_crack, _lengths("center", "radius")),
    "ellipse": Form(elliptic_crack, _lengths("center", "a", "b")),
    "polygon": Form(plane_crack, _lengths("polygon")),
    "file": Form(read_surface, files=("path",)),
    "surface": Form(surface_crack, _lengths("points")),
}


def _rate_table(curves: Any, outside: str = "refuse", ratio: str | None = None) -> rate_table:
    """A table of rates from a list of curves, each with R, dK and rate."""
    rows = [curve if isinstance(curve, dict) else {} for curve in curves]
    if not all(set(row) == {"R", "dK", "rate"} for row in rows):
        raise ProblemError("rate_table: curves: give a list of { R = .., dK = [..], rate = [..] }.")
    points = {row["R"]: (row["dK"], row["rate"]) for row in rows}
    return rate_table(points, outside, ratio)  # type: ignore[arg-type]


def forms_of(base: type) -> dict[str, Form]:
    """Forms of all classes that derive from one: loads, supports, laws and their parts."""
    forms = {name: Form(kind) for name, kind in kinds_of(base).items()}
    if base is GrowthLaw:
        forms |= {"rate_table": Form(_rate_table), "with_time": Form(with_time)}
    return forms


CRITERIA: dict[str, Callable[..., Any]] = {
    "max_hoop_stress": criteria.max_hoop_stress,
    "weighted_angle": criteria.weighted_angle,
    "mean_reference": criteria.mean_reference,
}


def value_of_table(table: Table, forms: Mapping[str, Form], default: str = "") -> Any:
    """Value of a table: that of the function which its key `kind` names.

    Raises
    ------
    ProblemError
        No such kind, a key that is unknown or missing, a wrong unit, or what the function says;
        with file and line.
    """
    kind = table.text(_WORD, default or None)
    if kind not in forms:
        table.refuse(_WORD, f"{kind!r:.40} is not known: known are {', '.join(forms)}.")
    return called_with(table, forms[kind], f" of {kind!r}", (_WORD,))


def value_of_kind(table: Table, base: type, default: type) -> Any:
    """Value of a table whose `kind` derives from a base; without one it is of the default kind."""
    if _WORD in table:
        return value_of_table(table, forms_of(base))
    return called_with(table, Form(default))


def called_with(table: Table, form: Form, what: str = "", besides: tuple[str, ...] = ()) -> Any:
    """Call a function with the keys of a table."""
    parameters = inspect.signature(form.function).parameters
    table.known([*besides, *parameters], what)
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in table:
            table.refuse("", f"the key {name!r}{what} is missing.")
    given: dict[str, Any] = {}
    for name in table.content:
        if name in besides:
            continue
        given[name] = _argument(table, name, form, parameters[name])
    try:
        return form.function(**given)
    except (XcrackError, TypeError, ValueError) as error:
        table.wrap(error if isinstance(error, XcrackError) else ProblemError(str(error)))


def _argument(table: Table, name: str, form: Form, parameter: inspect.Parameter) -> Any:
    if name in form.files:
        return _file(table, name)
    declared = arguments_of(form.function).get(name)
    rule = None if declared is None else declared.rule
    if isinstance(rule, Part) and isinstance(table.content[name], dict):
        return _part(table.table(name), rule)
    if isinstance(rule, Function) and isinstance(table.content[name], dict):
        return value_of_table(table.table(name), forms_of(GrowthLaw))
    if rule is not None and rule.takes_names and isinstance(table.content[name], str):
        return table.content[name]
    unit = form.units.get(name, _dimension_of(declared, parameter))
    value = table.value(name, unit)
    is_flat_list = isinstance(value, list) and value and not any(isinstance(v, list) for v in value)
    return tuple(value) if is_flat_list else value


def _part(table: Table, rule: Part) -> Any:
    """A value within another one: a table that names its kind, where there are several."""
    kinds = classes_of(rule.kind)
    if len(kinds) == 1 and _WORD not in table:
        (kind,) = kinds.values()
        return called_with(table, Form(kind))
    return value_of_table(table, {name: Form(kind) for name, kind in kinds.items()})


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
    "Form",
    "called_with",
    "forms_of",
    "value_of_kind",
    "value_of_table",
]
