"""What tables of a case file may hold: the functions that they call, units of their arguments.

Units and kinds of arguments are those that the functions and classes declare (`base/arguments.py`):
a new load, law or support is known here as soon as it is there.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from xcrack.app.case_tables import Table
from xcrack.base.arguments import (
    Argument,
    Array,
    Declared,
    Either,
    FilePath,
    Function,
    Number,
    OneOrMore,
    Part,
    Parts,
    Text,
    arguments_of,
    classes_of,
    kinds_of,
)
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS, Dimension
from xcrack.crack.crack import Crack
from xcrack.crack.junctions_3d import arm
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import (
    elliptic_crack,
    penny_crack,
    plane_crack,
    read_surface,
    surface_crack,
)
from xcrack.fatigue import criteria, fracture, power  # noqa: F401 - laws are found as classes
from xcrack.fatigue.fracture import nasgro_K_c
from xcrack.fatigue.law import GrowthLaw
from xcrack.fatigue.metals import law as preset
from xcrack.fatigue.metals import material as metal
from xcrack.fatigue.tables import rate_table
from xcrack.fatigue.time import with_time
from xcrack.mesh.box import box
from xcrack.mesh.cylinder import notched_cylinder
from xcrack.mesh.fields import read_field
from xcrack.mesh.files import read_mesh
from xcrack.mesh.plates import plate, plate_with_hole
from xcrack.mesh.step_file import mesh_step
from xcrack.model.material import Isotropic, Material
from xcrack.model.values import ScalarField, StressField, VectorField
from xcrack.sif.handbook import KINDS as HANDBOOK
from xcrack.sif.specimens import (
    compact_tension,
    disc_compact,
    lug,
    middle_tension,
    single_edge_bend,
    single_edge_tension,
)

_WORD = "kind"
_BOXES = ("sets", "where")  # parts of a boundary, as boxes
_FIELDS = (VectorField, ScalarField, StressField, Function, Either)
_WAY = (
    " A function of the place has no words in a case file: sample it, write it to a file with its "
    'mesh, and give { path = "field.vtu" }, with name = "..." of several data, as of read_field.'
)

MESHES: dict[str, Callable[..., Any]] = {
    "file": read_mesh,
    "step": mesh_step,
    "box": box,
    "plate": plate,
    "plate_with_hole": plate_with_hole,
    "notched_cylinder": notched_cylinder,
}
SPECIMENS: dict[str, Callable[..., Any]] = {
    specimen.__name__: specimen
    for specimen in (compact_tension, disc_compact, lug, middle_tension, single_edge_bend,
                 single_edge_tension)
}  # fmt: skip
CRACKS: dict[str, Callable[..., Any]] = {
    "line": line_crack,
    "penny": penny_crack,
    "ellipse": elliptic_crack,
    "polygon": plane_crack,
    "file": read_surface,
    "surface": surface_crack,
    "arm": arm,
}
CRITERIA: dict[str, Callable[..., Any]] = {
    "max_hoop_stress": criteria.max_hoop_stress,
    "weighted_angle": criteria.weighted_angle,
    "mean_reference": criteria.mean_reference,
}
_NUMBERS: dict[str, Callable[..., Any]] = {"nasgro_K_c": nasgro_K_c}  # that a function computes

_Name = Annotated[str, Text("the name of a metal, see xc.materials()")]
_Thickness = Annotated[float | None, Number(above=0, unit=LENGTH)]


@dataclass(frozen=True, eq=False)
class RateCurve(Declared):
    """Points of a rate table at one R, as a file gives them.

    Attributes
    ----------
    R : float
    dK : (n,) array, stress √length
    rate : (n,) array, length/cycle
    """

    R: Annotated[float, Number()]
    dK: Annotated[Any, Array((None,), unit=TOUGHNESS)]
    rate: Annotated[Any, Array((None,), unit=LENGTH)]


def _rate_table(
    curves: Annotated[Any, Parts(RateCurve)], outside: str = "refuse", ratio: str | None = None
) -> rate_table:
    """A table of rates from a list of curves, each with R, dK and rate."""
    points = {curve.R: (curve.dK, curve.rate) for curve in curves}
    return rate_table(points, outside, ratio)  # type: ignore[arg-type]


def _metal_law(
    name: _Name, units: str, law: str | None = None, thickness: _Thickness = None
) -> Any:
    """A growth law of a metal by its name."""
    return metal(name, units=units).law(law, thickness=thickness)


def _metal_material(
    name: _Name,
    units: str,
    plane: str | None = None,
    thickness: _Thickness = None,
    E: Annotated[float | None, arguments_of(Isotropic)["E"].rule] = None,
    nu: Annotated[float | None, arguments_of(Isotropic)["nu"].rule] = None,
) -> Isotropic:
    """The elastic material of a metal by its name."""
    return metal(name, units=units).isotropic(plane, thickness=thickness, E=E, nu=nu)


def makers_of(base: type) -> dict[str, Callable[..., Any]]:
    """What makes values of a base, by name: loads, supports, laws and their parts."""
    makers: dict[str, Callable[..., Any]] = dict(kinds_of(base))
    if base is GrowthLaw:
        makers |= {
            "rate_table": _rate_table, "with_time": with_time, "preset": preset,
            "metal": _metal_law,
        }  # fmt: skip
    if base is Material:
        makers = {name: maker for name, maker in makers.items() if name != "MaterialSets"}
        makers["metal"] = _metal_material
    return makers


def value_of_table(table: Table, makers: Mapping[str, Callable[..., Any]]) -> Any:
    """Value of a table: that of the function which its key `kind` names.

    Raises
    ------
    ProblemError
        No such kind, a key that is unknown or missing, a wrong unit, or what the function says;
        with file and line.
    """
    if _WORD not in table:
        table.refuse("", f"the key 'kind' is missing: give one of {', '.join(makers)}.")
    kind = table.text(_WORD)
    if kind not in makers:
        table.refuse(_WORD, f"{kind!r:.40} is not known: known are {', '.join(makers)}.")
    return called_with(table, makers[kind], f" of {kind!r}", (_WORD,))


def value_of_kind(table: Table, base: type, default: type) -> Any:
    """Value of a table whose `kind` derives from a base; without one it is of the default kind."""
    if _WORD in table:
        return value_of_table(table, makers_of(base))
    return called_with(table, default)


def called_with(
    table: Table,
    maker: Callable[..., Any],
    label: str = "",
    other_names: Sequence[str] = (),
    arguments: Mapping[str, Any] | None = None,
) -> Any:
    """Call a function or class with the keys of a table, and values that are known already."""
    parameters = inspect.signature(maker).parameters
    all_arguments = dict(arguments or {})
    if "units" in parameters and "units" not in table:  # those of the model
        all_arguments["units"] = _units_of_laws(table)
    table.check_names(
        [*other_names, *(name for name in parameters if name not in (arguments or {}))], label
    )
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in table and name not in all_arguments:
            table.refuse("", f"the key {name!r}{label} is missing: give it.")
    for name in table.content:
        if name not in other_names:
            all_arguments[name] = argument_of(table, name, maker)
    try:
        return maker(**all_arguments)
    except (XcrackError, TypeError, ValueError) as error:
        table.wrap(error if isinstance(error, XcrackError) else ProblemError(str(error)))


def _units_of_laws(table: Table) -> str:
    """Length and K of the file, as laws by name take them."""
    units = table.source.units
    if not units.stress:
        table.refuse(
            "",
            "published values have units, and those of the file are not known, or their stress has "
            'no name: give [units] with length and force, such as "mm" and "N".',
        )
    return f"{units.length}, {units.stress}√{units.length}"


def argument_of(table: Table, name: str, maker: Callable[..., Any]) -> Any:
    """A key of a table as the argument of a function, by the rule that it declares."""
    declaration = arguments_of(maker).get(name)
    rule = None if declaration is None else declaration.rule
    value = table.content[name]
    if isinstance(rule, FilePath):
        return _file(table, name)
    if isinstance(rule, Part) and isinstance(value, dict):
        return _part(table.table(name), rule.kind)
    if isinstance(rule, Parts | OneOrMore) and _are_tables(value):
        return [_part(part_table, rule.kind) for part_table in table.tables(name)]
    if isinstance(rule, _FIELDS) and isinstance(value, dict):
        field_table = table.table(name)
        if _WORD in field_table:
            return value_of_table(field_table, makers_of(GrowthLaw))
        return called_with(field_table, read_field)
    if isinstance(rule, Function):
        table.refuse(name, f"{value!r:.60} is no function.{_WAY}")
    if isinstance(rule, Number) and isinstance(value, dict):
        return value_of_table(table.table(name), _NUMBERS)
    if rule is not None and rule.takes_names and isinstance(value, str):
        return value
    is_field = isinstance(rule, _FIELDS)
    dimension = LENGTH if name in _BOXES and rule is None else _dimension_of(declaration)
    content = table.value(name, dimension, _WAY if is_field else "")
    is_flat_list = (
        isinstance(content, list) and content and not any(isinstance(v, list) for v in content)
    )
    return tuple(content) if is_flat_list else content


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)


def _part(table: Table, kind: Any) -> Any:
    """A value within another one: a table that names its kind, where there are several."""
    makers = CRACKS if kind is Crack else classes_of(kind)
    if len(makers) == 1 and _WORD not in table:
        (maker,) = makers.values()
        return called_with(table, maker)
    return value_of_table(table, makers)


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


def _dimension_of(declaration: Argument | None) -> Dimension | None:
    """Dimension by the rule of an argument; text is refused for numbers without a unit."""
    if declaration is None:
        return None
    if declaration.rule is not None:
        unit = declaration.rule.unit
        return None if callable(unit) else unit
    return NUMBER if declaration.annotation in (float, float | None) else None


__all__ = [
    "CRACKS",
    "CRITERIA",
    "HANDBOOK",
    "MESHES",
    "SPECIMENS",
    "argument_of",
    "called_with",
    "makers_of",
    "value_of_kind",
    "value_of_table",
]
