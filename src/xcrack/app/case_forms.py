"""What tables of a case file may hold: the functions that they call, units of their arguments."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from xcrack.app.case_tables import Table
from xcrack.base.arguments import arguments_of, kinds_of
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS, Dimension
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import elliptic_crack, penny_crack, plane_crack, read_surface
from xcrack.fatigue import criteria, fracture, power
from xcrack.mesh.box import box
from xcrack.mesh.cylinder import notched_cylinder
from xcrack.mesh.files import read_mesh
from xcrack.mesh.plates import plate, plate_with_hole
from xcrack.model.loads import Load
from xcrack.model.supports import Support

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
}
SUPPORTS = {name: Form(kind) for name, kind in kinds_of(Support).items()}
LOADS = {name: Form(kind) for name, kind in kinds_of(Load).items()}
LAWS = {
    "paris": Form(power.paris),
    "elber": Form(power.elber),
    "walker": Form(power.walker),
    "forman": Form(fracture.forman, {"K_c": TOUGHNESS}),
    "hartman_schijve": Form(fracture.hartman_schijve, {"A": TOUGHNESS, "dK_thr": TOUGHNESS}),
}
CRITERIA: dict[str, Callable[..., Any]] = {
    "max_hoop_stress": criteria.max_hoop_stress,
    "weighted_angle": criteria.weighted_angle,
    "mean_reference": criteria.mean_reference,
}


def made(table: Table, forms: Mapping[str, Form], default: str = "") -> Any:
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
        path = table.source.path.parent / table.text(name)
        if not path.is_file():
            near = (
                sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.suffix else []
            )
            hint = f"; beside it are {', '.join(near[:5])}" if near else ""
            table.refuse(name, f"there is no file {path}{hint}: paths begin at the case file.")
        return path
    rule = arguments_of(form.function)[name].rule
    declared = None if rule is None or callable(rule.unit) else rule.unit
    value = table.value(name, form.units.get(name, declared or _dimension_of(parameter)))
    whole = isinstance(value, list) and value and not any(isinstance(v, list) for v in value)
    return tuple(value) if whole else value


def _dimension_of(parameter: inspect.Parameter) -> Dimension | None:
    """Text is refused for numbers without a unit; names stay what they are."""
    text = str(parameter.annotation)
    return NUMBER if text in ("<class 'float'>", "float | None") else None


__all__ = [
    "CRACKS",
    "CRITERIA",
    "LAWS",
    "LOADS",
    "MESHES",
    "SUPPORTS",
    "Form",
    "called_with",
    "made",
]
