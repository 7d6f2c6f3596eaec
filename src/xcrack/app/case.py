"""A case file read: problem, load states, growth, what is made of it, where the results go."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np

from xcrack.adaptivity.adapt import adapt
from xcrack.analysis.solve import solve
from xcrack.app import case_values as values
from xcrack.app.case_histories import (
    inspection_of,
    life_of,
    load_states,
    loading,
    retardation_of,
    retarded_of,
    strength_of,
)
from xcrack.app.case_tables import Table, read_tables
from xcrack.base.arguments import FileName, arguments_of, check_arguments
from xcrack.base.arrays import Bools, Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import LENGTH
from xcrack.fatigue.law import GrowthLaw
from xcrack.fatigue.load_program import LoadProgram
from xcrack.fatigue.retardation import plastic_zone
from xcrack.growth.options import GrowthOptions, GrowthRule
from xcrack.linalg.direct import pardiso
from xcrack.mesh.mesh import Mesh, facet_set
from xcrack.mesh.parts import part, selector
from xcrack.mesh.refinement import refine
from xcrack.model.deck import read_deck
from xcrack.model.loads import Load, Support
from xcrack.model.material import Isotropic, Material, MaterialSets
from xcrack.model.numerics import Numerics
from xcrack.model.problem import Problem
from xcrack.runs.collect import names_of_sets

_BODIES = ("mesh", "deck", "specimen")  # of which a file has one
_SECTIONS = ("title", "units", *_BODIES, "material", "cracks", "supports", "loads", "handbook",
             "solve", "numerics", "growth", "life", "retarded", "inspection", "strength",
             "output")  # fmt: skip
_MORE_OF_MESH = ("refine", "parts", "cell_sets")  # beside the arguments of what makes it
_CHOICES = ("contact", "order", "friction")  # of the problem
_SOLVING = ("error", "solver", "tolerance", "max_unknowns")  # of solve and adapt
_TABLES = (
    "law",
    "criterion",
    "cycle",
    "spectrum",
    "retardation",
    "link_up",
    "load_program",
)  # of growth
_OUTPUT = ("folder", "pictures", "warp", "keep_solutions")
METHODS = ("contact_method", "tip_basis", "level_sets")  # of numerics, to compare with
_REST = "rest"  # of the cells: those in no box
_FUNCTIONS = ("response",)  # options of growth that a script alone can give
SOLVERS = {"pardiso": pardiso}


@dataclass(frozen=True, eq=False)
class CaseFile:
    """A scene as its file tells it.

    Attributes
    ----------
    path : Path
    title : str
    problem : Problem
    states : tuple of load states, optional
        Factors, or lists of loads, to solve for; None: the loads as they are.
    growth : mapping, optional
        Arguments of `grow` beside the problem; None where nothing grows.
    folder : Path
        Where results go.
    pictures : tuple of str
        Fields to draw.
    warp : float
        Displacements are drawn this many times as large.
    solving : mapping
        Arguments of `solve`, or with a tolerance of `adapt`, beside problem and states.
    life, inspection, strength : mapping, optional
        Arguments of `life`, `inspection` and `residual_strength` beside the history; None where
        they are not asked for.
    keep_solutions, until : optional
        As of `collect`.
    retarded : tuple of mapping
        Arguments of `retarded` beside history, law and spectrum, one for each model.
    units : str, optional
        Force, length and stress of the file, as `report` takes them.
    """

    path: Path
    title: str
    problem: Problem
    states: tuple[Any, ...] | None
    growth: Mapping[str, Any] | None
    folder: Path
    pictures: tuple[str, ...]
    warp: float
    solving: Mapping[str, Any] = field(default_factory=dict)
    life: Mapping[str, Any] | None = None
    inspection: Mapping[str, Any] | None = None
    strength: Mapping[str, Any] | None = None
    keep_solutions: bool = True
    until: tuple[str, ...] | None = None
    retarded: tuple[Mapping[str, Any], ...] = ()
    units: str | None = None


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
    root.check_names(_SECTIONS)
    problem = _problem(root)
    solve_table, output = root.table("solve"), root.table("output")
    output.check_names(_OUTPUT)
    growth = _growth(root.table("growth")) if "growth" in root else None
    for name in ("life", "retarded", "inspection", "strength"):
        if name in root and growth is None:
            root.refuse(name, "it is of a growth run: give the table [growth] too.")
    units = root.source.units
    return CaseFile(
        path=file,
        title=root.text("title", file.stem),
        problem=problem,
        states=load_states(solve_table, "states") if "states" in solve_table else None,
        growth=growth,
        folder=file.parent / output.text("folder", f"{file.stem}_results"),
        pictures=tuple(_texts(output, "pictures")),
        warp=_number(output, "warp", 0.0),
        solving=_solve_arguments(solve_table),
        life=life_of(root.table("life"), problem, growth) if growth and "life" in root else None,
        inspection=inspection_of(root.table("inspection")) if "inspection" in root else None,
        strength=strength_of(root.table("strength"), problem, growth)
        if growth and "strength" in root
        else None,
        keep_solutions=_flag(output, "keep_solutions", True),
        until=_end_conditions(root.table("growth"), problem.mesh),
        retarded=tuple(retarded_of(table, problem, growth) for table in root.tables("retarded"))
        if growth
        else (),
        units=f"{units.force}, {units.length}, {units.stress}" if units.stress else None,
    )


def _problem(root: Table) -> Problem:
    """Body, material, cracks, supports, loads and choices; of a deck or specimen what it has."""
    given_bodies = [name for name in _BODIES if name in root]
    if len(given_bodies) != 1:
        root.refuse(
            given_bodies[-1] if given_bodies else "",
            "give one of [mesh], [deck] and [specimen]."
            if given_bodies
            else "there is no body: give one of [mesh], [deck] and [specimen].",
        )
    scene: dict[str, Any] = {}
    if "material" in root:
        scene["material"] = _material(root.table("material"))
    scene |= {
        name: [values.value_of_table(table, load_names) for table in root.tables(name)]
        for name, load_names in (
            ("cracks", values.CRACKS),
            ("supports", values.makers_of(Support)),
            ("loads", values.makers_of(Load)),
            ("handbook", values.HANDBOOK),
        )
        if name in root
    }  # fmt: skip
    scene["numerics"] = _numerics(root.table("numerics"))
    solve_table = root.table("solve")
    solve_table.check_names((*_CHOICES, "states", *_SOLVING))
    choices = {name: values.argument_of(solve_table, name, Problem) for name in _CHOICES
              if name in solve_table}  # fmt: skip
    (body,) = given_bodies
    table = root.table(body)
    if body == "mesh":
        mesh = _mesh(table)
    elif body == "deck":
        deck = values.called_with(_table_without(table, _MORE_OF_MESH), read_deck)
        deck = replace(deck, mesh=_changed_mesh(table, deck.mesh))
        scene |= _loads_with_deck(deck, scene)
    else:
        specimen = values.value_of_table(table, values.SPECIMENS)
        scene |= _loads_with_deck(specimen, scene)
    if "material" not in scene and (body != "deck" or deck.material is None):
        root.refuse("", "the table [material] is missing: give it.")
    try:
        if body == "mesh":
            return Problem(mesh, **scene, **choices)
        if body == "deck":
            return deck.problem(**scene, **choices)  # type: ignore[no-any-return]
        return specimen.problem(**scene, **choices)  # type: ignore[no-any-return]
    except XcrackError as error:
        _wrap(root, error)


_SPEAKS_OF = {  # words of an error of a problem, and the table that it is about
    "material": r"plane=|\bmaterial\b|Isotropic|Graded",
    "solve": r"\b(contact|order|friction)\b",
    "cracks": r"\bcracks?\b",
}


def _wrap(root: Table, error: XcrackError) -> NoReturn:
    """Raise an error of a problem with the line of what it speaks of."""
    for name, words in _SPEAKS_OF.items():
        if name in root and re.search(words, str(error)):
            if name == "cracks":
                root.wrap(error, name)
            root.table(name).wrap(error)
    root.wrap(error)


def _loads_with_deck(body: Any, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Supports and loads of a deck or specimen, and behind them those of the file."""
    names = ("supports", "loads")
    return {name: [*getattr(body, name), *scene[name]] for name in names if name in scene}


def _table_without(table: Table, names: tuple[str, ...]) -> Table:
    content = {name: value for name, value in table.content.items() if name not in names}
    return Table(table.source, table.key, content)


def _mesh(table: Table) -> Mesh:
    """A mesh by the function that its kind names, and what is made of it."""
    mesh = values.value_of_table(_table_without(table, _MORE_OF_MESH), values.MESHES)
    return _changed_mesh(table, mesh)


def _changed_mesh(table: Table, mesh: Mesh) -> Mesh:
    """The mesh refined, with parts of its facet sets, and cell sets by boxes."""
    if "refine" in table:
        is_list = isinstance(table.content["refine"], list)
        for refinement in table.tables("refine") if is_list else [table.table("refine")]:
            mesh = values.called_with(refinement, refine, arguments={"mesh": mesh})
    for part_table in table.tables("parts"):
        mesh = values.called_with(part_table, part, arguments={"mesh": mesh})
    if "cell_sets" in table:
        boxes = table.table("cell_sets")
        try:
            mesh_tables = {
                name: selector(boxes.value(name, LENGTH), mesh.dim, f"cell set {name!r}")
                for name, box in boxes.content.items()
                if box != _REST
            }
            other_tables = list(mesh_tables.values())
            for name in boxes.content:
                if name not in mesh_tables:
                    mesh_tables[name] = partial(_beside_all, other_tables)
            mesh = mesh.with_cell_sets(mesh_tables)
        except XcrackError as error:
            boxes.wrap(error)
    return mesh


def _beside_all(other_selectors: Sequence[Callable[[Floats], Bools]], x: Floats) -> Bools:
    """Points that are in none of other parts."""
    return ~np.any([is_inside(x) for is_inside in other_selectors], axis=0)


def _material(table: Table) -> Material:
    """One material, or by tables [material.name] one for each cell set."""
    parts = table.content.values()
    if parts and all(isinstance(part, dict) for part in parts) and not _is_one(table, Isotropic):
        return MaterialSets({
            name: values.value_of_kind(table.table(name), Material, Isotropic)
            for name in table.content
        })  # fmt: skip
    return values.value_of_kind(table, Material, Isotropic)  # type: ignore[no-any-return]


def _is_one(table: Table, kind: type) -> bool:
    """Whether the tables are arguments of one value, rather than values by name."""
    return all(name in kind.__annotations__ for name in table.content)


def _numerics(table: Table) -> Numerics:
    """Choices of method; those for comparison stay in scripts."""
    names = [f.name for f in fields(Numerics) if f.name not in METHODS]
    table.check_names(names)
    return values.called_with(table, Numerics)  # type: ignore[no-any-return]


def _law(table: Table) -> Any:
    """One law, or by tables [growth.law.name] one for each material."""
    makers = values.makers_of(GrowthLaw)
    if table.content and all(isinstance(value, dict) for value in table.content.values()):
        return {name: values.value_of_table(table.table(name), makers) for name in table.content}
    return values.value_of_table(table, makers)


def _criterion(table: Table) -> Any:
    """A criterion by its name, or a table of its kind with its choices."""
    if not isinstance(table.content.get("criterion"), dict):
        criterion = table.text("criterion", "max_hoop_stress")
        if criterion not in values.CRITERIA:
            table.refuse("criterion", f"known are {', '.join(values.CRITERIA)}.")
        return values.CRITERIA[criterion]
    criterion_table = table.table("criterion")
    kind = criterion_table.text("kind")
    if kind not in values.CRITERIA:
        criterion_table.refuse("kind", f"known are {', '.join(values.CRITERIA)}.")
    criterion_of_kind = values.CRITERIA[kind]
    argument_names = [name for name in arguments_of(criterion_of_kind) if name not in ("K", "nu")]
    criterion_table.check_names(["kind", *argument_names], f" of {kind!r}")
    choices = {}
    for name in criterion_table.content:
        if name != "kind":
            value = values.argument_of(criterion_table, name, criterion_of_kind)
            try:
                choices[name] = arguments_of(criterion_of_kind)[name].check(value, name)
            except XcrackError as error:
                criterion_table.wrap(error)
    return partial(criterion_of_kind, **choices)


def _growth(table: Table) -> Mapping[str, Any]:
    """Arguments of `grow`."""
    options = [name for name in GrowthOptions.__annotations__ if name not in _FUNCTIONS]
    for name in _FUNCTIONS:
        if name in table:
            table.refuse(
                name, f"it is a function: a script gives it, grow(case.problem, {name}=...)."
            )
    table.check_names(("law", "criterion", "cycle", "spectrum", "da", "until", *options))
    if "law" not in table:
        table.refuse("", "the key 'law' is missing: give it.")
    arguments = {
        name: values.argument_of(table, name, GrowthRule)
        for name in table.content
        if name not in _TABLES and name not in ("solver", "until")
    }
    if "solver" in table:
        arguments["solver"] = _solver(table)
    if "retardation" in table:
        arguments["retardation"] = retardation_of(table.table("retardation"))
    if "load_program" in table:
        arguments["load_program"] = values.value_of_table(
            table.table("load_program"), values.makers_of(LoadProgram)
        )
    if "link_up" in table:
        arguments["link_up"] = values.called_with(table.table("link_up"), plastic_zone)
    return MappingProxyType({
        "law": _law(table.table("law")),
        "criterion": _criterion(table),
        "cycle": loading(table),
        **arguments,
    })  # fmt: skip


def _end_conditions(table: Table, mesh: Mesh) -> tuple[str, ...] | None:
    """Facet sets on which the cracks are when growth ends."""
    if "until" not in table:
        return None
    try:
        names = names_of_sets(table.content["until"], "until")
        for name in names:
            facet_set(mesh, name, "until")
    except XcrackError as error:
        table.wrap(error)
    return names


def _solver(table: Table) -> Any:
    name = table.text("solver")
    if name not in SOLVERS:
        table.refuse("solver", f"{name!r:.40}: known is {', '.join(SOLVERS)}; else a script.")
    return SOLVERS[name]


def _solve_arguments(table: Table) -> Mapping[str, Any]:
    """Arguments of `solve`, or with a tolerance of `adapt`, beside problem and states."""
    maker = adapt if "tolerance" in table else solve
    arguments = {}
    for name in _SOLVING:
        if name not in table:
            continue
        if name not in arguments_of(maker):
            condition = "with a tolerance" if maker is adapt else "without a tolerance"
            table.refuse(name, f"it has no meaning {condition}: leave one of them out.")
        arguments[name] = (
            _solver(table) if name == "solver" else values.argument_of(table, name, maker)
        )
    return MappingProxyType(arguments)


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


def _flag(table: Table, name: str, default: bool) -> bool:
    value = table.content.get(name, default)
    if not isinstance(value, bool):
        table.refuse(name, f"{value!r:.60}: give true or false.")
    return value


__all__ = ["METHODS", "SOLVERS", "CaseFile", "read_case"]
