"""A scene, and its growth, written as a case file: the way back from what `case` reads.

What a table says is what the class of a value declares, as in `case_values`: a new load, law or
support can be written as soon as it is there.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, NoReturn, Unpack

import numpy as np

from xcrack.adaptivity.adapt import adapt
from xcrack.analysis.solve import solve
from xcrack.app import case_values as values
from xcrack.app.case import METHODS, SOLVERS, read_case
from xcrack.app.case_tables import FREE
from xcrack.base.arguments import FilePath, Items, Text, arguments_of, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.description import describe, differences
from xcrack.base.errors import ProblemError, collected_warnings
from xcrack.base.paths import system_errors, written_whole
from xcrack.crack.crack import Crack
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import GrowthLaw, Law, LawSets
from xcrack.fatigue.retardation import RetardationSets
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.options import GrowthOptions, GrowthRule, lists_options
from xcrack.mesh.fields import Field, read_field, write_field
from xcrack.mesh.files import write_mesh
from xcrack.model.loads import Load, Support
from xcrack.model.material import Material, MaterialSets
from xcrack.model.problem import Problem, ProblemArgument
from xcrack.runs.collect import names_of_sets

_WIDTH = 96  # of a line; a longer array has a line for each entry
_OF_MESH = ".vtu"  # it keeps all that a mesh has, to the last bit
_OF_SOLVE = ("tolerance", "max_unknowns", "solver")  # beside the loads, where nothing grows
_SETS = (LawSets, MaterialSets, RetardationSets)  # values by the names of cell sets
_MENDS = {
    "function": "a case file holds data. Where it is a field, sample it, write it to a file with "
    "its mesh, and give read_field(...)",
    "class": "case files know the classes that xcrack declares: give one of them",
    "method": "it is there to compare methods with: leave it to a script",
}


@lists_options
@check_arguments()
def write_case(
    path: Annotated[str | PathLike[str], FilePath(is_file=True)],
    problem: ProblemArgument,
    law: Law | None = None,
    criterion: Criterion | None = None,
    cycle: Cycle | Spectrum | None = None,
    da: float | None = None,
    *,
    states: Annotated[Sequence[Any] | None, Items()] = None,
    until: str | Sequence[str] | None = None,
    title: Annotated[str | None, Text("a text, or leave it out")] = None,
    **options: Unpack[GrowthOptions],
) -> None:
    """Write a problem, and what grows in it, as a case file.

    `read_case` of it gives the same problem to the last bit, and with it the same results; this is
    checked before the file is there. The mesh goes into a ``.vtu`` beside it, fields of
    `read_field` too.

    Parameters
    ----------
    path : path
        A toml file.
    problem : Problem
    law, criterion, cycle, da : optional
        As of `grow`; left out where nothing grows.
    states : sequence of load states, optional
        As of `solve`, where nothing grows.
    until : str or sequence of str, optional
        Names of facet sets, as of `collect`.
    title : str, optional
    tolerance, max_unknowns : optional
        As of `grow`; where nothing grows as of `adapt`.
    cycles, scaling, integrator, threshold, retardation, solver, response, load_program, K_c, \
    link_up, stop_at_interface, max_steps, max_cycles, max_size, progress
        As of `grow`.

    Raises
    ------
    ProblemError
        What is no data: a function of the place, a law, criterion or class of your own, a method
        to compare with; the message names it. A file that cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from xcrack import Isotropic, box, line_crack, read_case, traction
    >>> crack, pull = line_crack([(0, 0.1), (0.5, 0.1)]), traction("top", (0, 1))
    >>> scene = Problem(box((0, -1), (1, 1), 9), Isotropic(1, 0.3, "strain"), [crack], loads=[pull])
    >>> file = Path(tempfile.mkdtemp()) / "edge.toml"
    >>> write_case(file, scene)
    >>> read_case(file).problem.cracks[0].points[1].tolist()
    [0.5, 0.1]
    """
    file = Path(path)
    if unknown_names := sorted(set(options) - set(GrowthOptions.__annotations__)):
        raise TypeError(f"write_case() got an unexpected keyword argument {unknown_names[0]!r}")
    arguments = {"law": law, "criterion": criterion, "cycle": cycle, "da": da, **options}
    arguments = {name: value for name, value in arguments.items() if value is not None}
    solve_arguments = (
        {} if law else {name: arguments.pop(name) for name in _OF_SOLVE if name in arguments}
    )
    for name, value in solve_arguments.items():
        maker = adapt if name in arguments_of(adapt) else solve
        arguments_of(maker)[name].check(value, f"write_case: {name}")
    _check(arguments, states, until)
    writing = _Writing(file)
    tables: dict[str, Any] = {"mesh": {"kind": "file", "path": f"{file.stem}{_OF_MESH}"}}
    tables |= writing.scene(problem)
    if states is not None:
        tables["solve"]["states"] = writing.states(states, "states")
    tables["solve"] |= writing.growth(solve_arguments)
    if arguments:
        tables["growth"] = writing.growth(arguments)
    if until is not None:
        tables["growth"]["until"] = list(names_of_sets(until, "write_case: until"))
    text = "\n".join(_lines({"title": title or file.stem}, tables)) + "\n"
    with system_errors("the case file cannot be written to", file, error=ProblemError):
        write_mesh(file.with_suffix(_OF_MESH), problem.mesh)
        with written_whole(file, "the case file is not written to", error=ProblemError) as part:
            part.write_text(text, encoding="utf-8")
            _compare(part, problem, arguments, solve_arguments)


def _check(arguments: Mapping[str, Any], states: Any, until: Any) -> None:
    """Refuse arguments that do not go together."""
    if arguments and not {"law", "criterion", "cycle"} <= set(arguments):
        raise ProblemError(
            f"write_case: {', '.join(arguments)}: growth needs law, criterion and cycle: give all "
            "three, or none of growth."
        )
    if until is not None and (callable(until) or not arguments):
        raise ProblemError(
            f"write_case: until = {value_text(until)}: give names of facet sets, and what grows; a "
            "function is no data."
        )
    if arguments and states is not None:
        raise ProblemError(
            "write_case: states are of a scene that is solved; where cracks grow, cycle says what "
            "is solved: leave states out."
        )


def _compare(
    file: Path, problem: Problem, arguments: Mapping[str, Any], solve_arguments: Mapping[str, Any]
) -> None:
    """Read what was written, and refuse where it says something else."""
    with collected_warnings([]):  # those of the mesh and the cycle were said when they were made
        case = read_case(file)
        lines = differences(describe("", problem), describe("", case.problem))
        lines += differences(
            describe("solve", solve_arguments), describe("solve", dict(case.solving))
        )
        if arguments and not lines:
            rule, rule_of_file = (
                describe("", GrowthRule(problem, **growth))  # type: ignore[arg-type]
                for growth in (arguments, dict(case.growth or {}))
            )
            lines = differences(rule, rule_of_file)
    if lines:
        raise ProblemError(
            f"write_case: a case file cannot say all of this scene: {lines[0]:.200}. Give it by a "
            "script."
        )


@dataclass(frozen=True)
class _Writing:
    """Values as what toml holds: tables, lists, numbers, texts.

    Attributes
    ----------
    file : Path
        The case file; fields go beside it.
    """

    file: Path

    def scene(self, problem: Problem) -> dict[str, Any]:
        """Tables of a problem but that of its mesh."""
        numerics: Any = problem.numerics
        for name in METHODS:
            if getattr(numerics, name) is not None:
                self._refuse(f"numerics: {name}", "method")
        tables: dict[str, Any] = {"material": self._by_set(problem.material, Material, "material")}
        for name, makers in (
            ("cracks", values.CRACKS),
            ("supports", values.makers_of(Support)),
            ("loads", values.makers_of(Load)),
            ("handbook", values.HANDBOOK),
        ):
            tables[name] = [
                self._crack(part)
                if name == "cracks"
                else self._table(part, makers, f"{name}[{k}], {getattr(part, 'name', part.kind)}")
                for k, part in enumerate(getattr(problem, name))
            ]
        tables["solve"] = {"order": problem.order, "contact": problem.contact}
        if any(problem.frictions):
            tables["solve"]["friction"] = self._plain_value(problem.friction, "friction")
        tables["numerics"] = self._fields(numerics, "numerics")
        return {name: table for name, table in tables.items() if table}

    def growth(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The table of what grows."""
        table: dict[str, Any] = {}
        for name, value in arguments.items():
            match name:
                case "law":
                    table[name] = self._by_set(value, GrowthLaw, name)
                case "criterion":
                    table[name] = self._criterion(value)
                case "cycle":
                    self._loading(table, value)
                case "retardation":
                    table[name] = self._by_set(value, None, name)
                case "link_up":
                    table[name] = self._fields(value, name)
                case "solver":
                    table[name] = self._name(value, SOLVERS, name)
                case _:
                    table[name] = self._plain_value(value, name)
        return table

    def states(self, states: Sequence[Any], label: str) -> list[Any]:
        """Load states: each a factor, or tables of loads."""
        makers, result = values.makers_of(Load), []
        for n, state in enumerate(states):
            if np.ndim(state) == 0 and not isinstance(state, Load):
                result.append(self._plain_value(state, f"{label}[{n}]"))
                continue
            result.append([
                self._table(load, makers, f"{label}[{n}][{k}], {load.name}")
                for k, load in enumerate([state] if isinstance(state, Load) else state)
            ])  # fmt: skip
        return result

    def _loading(self, table: dict[str, Any], loading: Any) -> None:
        """The table of a cycle or of a spectrum."""
        name = "cycle" if isinstance(loading, Cycle) else "spectrum"
        content = dict(self._values_off_default(loading))
        content_of_file = {
            field: self._plain_value(value, f"{name}: {field}")
            for field, value in content.items()
            if field not in ("states", "steady")
        }
        if "states" in content:
            content_of_file["states"] = self.states(content["states"], f"{name}: states")
        if "steady" in content:
            (content_of_file["steady"],) = self.states([content["steady"]], f"{name}: steady")
        table[name] = content_of_file

    def _criterion(self, criterion: Any) -> Any:
        if not isinstance(criterion, partial):
            return self._name(criterion, values.CRITERIA, "criterion")
        kind = self._name(criterion.func, values.CRITERIA, "criterion")
        return {"kind": kind, **self._plain_value(criterion.keywords, "criterion")}

    def _crack(self, crack: Crack) -> dict[str, Any]:
        """A crack by its points, its faces, and the cracks on which it ends."""
        points = crack.points.tolist()
        if crack.dim == 2:
            return {"kind": "line", "points": points}
        table: dict[str, Any] = {"kind": "surface", "points": points}
        table["triangles"] = crack.faces.tolist()
        for on, side in crack.ends_on:
            table = {"kind": "arm", "crack": table, "on": on, "side": side}
        return table

    def _by_set(self, value: Any, base: Any, label: str) -> dict[str, Any]:
        """A value, or one for each cell set."""
        makers = values.makers_of(base) if base else None
        if isinstance(value, _SETS):
            (pairs,) = (getattr(value, field.name) for field in fields(value))
            value = dict(pairs)
        if isinstance(value, Mapping):
            return {name: self._table(value_of_set, makers, f"{label} of {name!r}")
                    for name, value_of_set in value.items()}  # fmt: skip
        return self._table(value, makers, label)

    def _table(self, value: Any, makers: Any, label: str) -> dict[str, Any]:
        """A value of a class that is declared: its kind, and what it was made of."""
        kind = type(value)
        if makers is None:
            makers = {kind.__name__: kind}
        names = [name for name, maker in makers.items() if maker is kind or name == kind.__name__]
        if not names:
            is_function = callable(value) and not isinstance(value, GrowthLaw)
            self._refuse(label, "function" if is_function else "class")
        return {"kind": names[0], **self._fields(value, label)}

    def _fields(self, value: Any, label: str) -> dict[str, Any]:
        """What a value was made of, less what it would be without."""
        if not is_dataclass(value):
            self._refuse(label, "function")
        return {
            name: self._plain_value(field_value, f"{label}: {name}")
            for name, field_value in self._values_off_default(value)
        }

    def _values_off_default(self, value: Any) -> Iterator[tuple[str, Any]]:
        for name, argument in arguments_of(type(value)).items():
            field_value = getattr(value, name)
            default = argument.default
            if field_value is None or (
                type(field_value) is type(default) and field_value == default
            ):
                continue
            yield name, field_value

    def _plain_value(self, value: Any, label: str) -> Any:
        if value is None:
            return FREE
        if isinstance(value, np.ndarray | np.generic):
            return value.tolist()
        if isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, tuple) and hasattr(value, "_asdict"):  # a curve of a rate_table
            value = value._asdict()
        if isinstance(value, list | tuple):
            return [self._plain_value(entry, f"{label}[{k}]") for k, entry in enumerate(value)]
        if isinstance(value, Mapping):
            return {
                name: self._plain_value(entry, f"{label}: {name}") for name, entry in value.items()
            }
        if isinstance(value, Field):
            return self._field(value)
        if isinstance(value, Crack):
            return self._crack(value)
        if is_dataclass(value):
            return self._table(value, None, label)
        self._refuse(label, "function")

    def _field(self, field: Field) -> dict[str, Any]:
        """A field in a file beside the case: that of its name, if it is this one."""
        name, _, source = field.name.partition(" ")
        for target in (self.file.with_name(Path(source).name or "field.vtu"),
                       self.file.with_name(f"{self.file.stem}_{name}.vtu")):  # fmt: skip
            if target.suffix != _OF_MESH:
                continue
            if not target.exists():
                write_field(target, field, name)
            if describe("", read_field(target, name)) == describe("", field):
                return {"path": target.name, "name": name}
        raise ProblemError(
            f"write_case: the field {field.name} does not go into {target}, where another one is: "
            "give a folder of its own for the case."
        )

    def _name(self, value: Any, public_values: Mapping[str, Any], label: str) -> str:
        for name, public_value in public_values.items():
            if public_value is value:
                return name
        self._refuse(label, "function")

    def _refuse(self, label: str, kind: str) -> NoReturn:
        noun = {"function": "a function", "class": "of a class of its own", "method": "a method"}
        raise ProblemError(f"write_case: {label} is {noun[kind]}: {_MENDS[kind]}.")


def _lines(head: Mapping[str, Any], tables: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a toml file: plain keys, then tables, and lists of tables."""
    yield from (f"{name} = {_toml(value)}" for name, value in head.items())
    for name, content in tables.items():
        is_list = isinstance(content, list)
        for table in content if is_list else [content]:
            yield ""
            yield f"[[{name}]]" if is_list else f"[{name}]"
            yield from (
                f"{_key(key)} = {_toml(value, is_long=True)}" for key, value in table.items()
            )


def _toml(value: Any, is_long: bool = False) -> str:
    """A value as toml; with `is_long` an array of more than a line has a line for each entry."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {_toml(v)}' for k, v in value.items())} }}"
    entries = [_toml(entry) for entry in value]
    text = f"[{', '.join(entries)}]"
    if not is_long or len(text) <= _WIDTH:
        return text
    return "[\n" + "".join(f"    {entry},\n" for entry in entries) + "]"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name, ensure_ascii=False)


__all__ = ["write_case"]
