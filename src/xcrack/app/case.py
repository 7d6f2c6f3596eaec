"""A case file read: problem, load states, growth, and where the results go."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

from xcrack.app import case_values as values
from xcrack.app.case_histories import loading, retardation_of
from xcrack.app.case_tables import Table, read_tables
from xcrack.base.arguments import FileName, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS
from xcrack.fatigue.law import GrowthLaw
from xcrack.fatigue.retardation import plastic_zone
from xcrack.growth.options import GrowthOptions
from xcrack.model.loads import Load
from xcrack.model.material import Isotropic, Material, MaterialSets
from xcrack.model.numerics import Numerics
from xcrack.model.problem import Problem
from xcrack.model.supports import Support

_SECTIONS = ("title", "units", "mesh", "material", "cracks", "supports", "loads", "solve",
             "numerics", "growth", "output")  # fmt: skip
_OPTIONS = {"K_c": TOUGHNESS}  # of grow, that have a unit
_TABLES = ("law", "criterion", "cycle", "spectrum", "retardation", "link_up")  # of growth
_OUTPUT = ("folder", "pictures", "warp")
_METHODS = ("contact_method", "tip_basis", "level_sets")  # of numerics, to compare with


@dataclass(frozen=True, eq=False)
class CaseFile:
    """A scene as its file tells it.

    Attributes
    ----------
    path : Path
    title : str
    problem : Problem
    states : tuple of float, optional
        Factors of the loads to solve for; None: the loads as they are.
    growth : mapping, optional
        Arguments of `grow` beside the problem; None where nothing grows.
    folder : Path
        Where results go.
    pictures : tuple of str
        Fields to draw.
    warp : float
        Displacements are drawn this many times as large.
    """

    path: Path
    title: str
    problem: Problem
    states: tuple[float, ...] | None
    growth: Mapping[str, Any] | None
    folder: Path
    pictures: tuple[str, ...]
    warp: float


@check_arguments()
def read_case(path: FileName, changes: Mapping[str, Any] | None = None) -> CaseFile:
    """Read a scene from a toml file.

    Parameters
    ----------
    path : path
    changes : mapping of key to value, optional
        Other values than the file has, such as ``{"cracks.0.radius": 2.0}``; tables of a list and
        entries of an array are counted from 0.

    Returns
    -------
    CaseFile

    Raises
    ------
    ProblemError, GeometryError, MeshError
        No such file, no toml, a wrong key, unit or file, or a scene that is not well posed: the
        message has file, line, and how to mend it.
    """
    file = Path(path)
    if not isinstance(changes, Mapping | None):
        raise ProblemError(
            f"read_case: changes = {value_text(changes)}: give a dict of keys and values."
        )
    root = read_tables(file, {str(key): value for key, value in (changes or {}).items()})
    root.known(_SECTIONS)
    for name in ("mesh", "material"):
        if name not in root:
            root.refuse("", f"the table [{name}] is missing: give it.")
    mesh = values.value_of_table(root.table("mesh"), values.MESHES)
    material = _material(root.table("material"))
    solving = root.table("solve")
    solving.known(("contact", "order", "friction", "states"))
    scene: dict[str, Any] = {
        name: [values.value_of_table(table, allowed) for table in root.tables(name)]
        for name, allowed in (
            ("cracks", values.CRACKS),
            ("supports", values.makers_of(Support)),
            ("loads", values.makers_of(Load)),
        )
    }  # fmt: skip
    numerics = _numerics(root.table("numerics"))
    named = [name for name in ("contact", "order", "friction") if name in solving]
    chosen = {name: solving.value(name, None) for name in named}
    try:
        problem = Problem(mesh, material, **scene, **chosen, numerics=numerics)
    except XcrackError as error:
        (solving if chosen else root).wrap(error)
    output = root.table("output")
    output.known(_OUTPUT)
    return CaseFile(
        path=file,
        title=root.text("title", file.stem),
        problem=problem,
        states=_states(solving),
        growth=_growth(root.table("growth")) if "growth" in root else None,
        folder=file.parent / output.text("folder", f"{file.stem}_results"),
        pictures=tuple(_texts(output, "pictures")),
        warp=_number(output, "warp", 0.0),
    )


def _material(table: Table) -> Material:
    """One material, or by tables [material.name] one for each cell set."""
    parts = table.content.values()
    if parts and all(isinstance(part, dict) for part in parts):
        return MaterialSets({
            name: values.value_of_kind(table.table(name), Material, Isotropic)
            for name in table.content
        })  # fmt: skip
    return values.value_of_kind(table, Material, Isotropic)  # type: ignore[no-any-return]


def _numerics(table: Table) -> Numerics:
    """Choices of method; those for comparison stay in scripts."""
    names = [f.name for f in fields(Numerics) if f.name not in _METHODS]
    table.known(names)
    return values.called_with(table, Numerics)  # type: ignore[no-any-return]


def _law(table: Table) -> Any:
    """One law, or by tables [growth.law.name] one for each material."""
    makers = values.makers_of(GrowthLaw)
    if table.content and all(isinstance(value, dict) for value in table.content.values()):
        return {name: values.value_of_table(table.table(name), makers) for name in table.content}
    return values.value_of_table(table, makers)


def _growth(table: Table) -> Mapping[str, Any]:
    """Arguments of `grow`."""
    options = [name for name in GrowthOptions.__annotations__ if name not in ("solver", "response")]
    table.known(("law", "criterion", "cycle", "spectrum", "da", *options))
    if "law" not in table:
        table.refuse("", "the key 'law' is missing: give it.")
    criterion = table.text("criterion", "max_hoop_stress")
    if criterion not in values.CRITERIA:
        table.refuse("criterion", f"known are {', '.join(values.CRITERIA)}.")
    units = {"da": LENGTH, **_OPTIONS}
    given = {
        name: table.value(name, units.get(name)) for name in table.content if name not in _TABLES
    }
    if "retardation" in table:
        given["retardation"] = retardation_of(table.table("retardation"))
    if "link_up" in table:
        given["link_up"] = values.called_with(table.table("link_up"), plastic_zone)
    return MappingProxyType({
        "law": _law(table.table("law")),
        "criterion": values.CRITERIA[criterion],
        "cycle": loading(table),
        **given,
    })  # fmt: skip


def _states(table: Table) -> tuple[float, ...] | None:
    if "states" not in table:
        return None
    value = table.value("states", NUMBER)
    if not isinstance(value, list) or not value:
        table.refuse("states", f"{value!r:.60}: give a list of factors, such as [0.1, 1.0].")
    return tuple(value)


def _texts(table: Table, name: str) -> list[str]:
    value = table.content.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        table.refuse(name, f'{value!r:.60}: give a list of texts, such as ["von_mises"].')
    return list(value)


def _number(table: Table, name: str, default: float) -> float:
    value = table.content.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        table.refuse(name, f"{value!r:.60}: give a number.")
    return float(value)


__all__ = ["CaseFile", "read_case"]
