"""A toml file as tables that know the lines their keys stand in."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from pathlib import Path
from typing import Any, NoReturn

from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.paths import system_errors

# Numbers with units, such as "210 GPa" or "40 MPa*sqrt(m)", in the units of a file.

Dimension = tuple[float, float]  # powers of length and force

NUMBER: Dimension = (0.0, 0.0)
LENGTH: Dimension = (1.0, 0.0)
FORCE: Dimension = (0.0, 1.0)
STRESS: Dimension = (-2.0, 1.0)
BODY_FORCE: Dimension = (-3.0, 1.0)
TOUGHNESS: Dimension = (-1.5, 1.0)

_NAMES: Mapping[Dimension, str] = {
    NUMBER: "a plain number", LENGTH: "a length", FORCE: "a force", STRESS: "a stress",
    BODY_FORCE: "a force by volume", TOUGHNESS: "a stress times √length",
}  # fmt: skip
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254}
_FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
_STRESSES = {
    "Pa": 1.0,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "psi": 6894.757293168,
    "ksi": 6894757.293168,
}
_UNITS: dict[str, tuple[float, Dimension]] = {
    **{name: (size, LENGTH) for name, size in _LENGTHS.items()},
    **{name: (size, FORCE) for name, size in _FORCES.items()},
    **{name: (size, STRESS) for name, size in _STRESSES.items()},
}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_FACTOR = re.compile(r"\s*([*·/]?)\s*(?:(sqrt\(|√)?\s*([A-Za-zµ]+)\s*\)?)(?:\^(-?\d+(?:\.\d+)?))?")


@dataclass(frozen=True)
class Units:
    """The units of a file.

    Attributes
    ----------
    length, force : str
        Their names; empty where the file names none.
    """

    length: str = ""
    force: str = ""

    def __post_init__(self) -> None:
        for name, known in (("length", _LENGTHS), ("force", _FORCES)):
            given = getattr(self, name)
            if given and (not isinstance(given, str) or given not in known):
                raise ProblemError(f"{name} = {given!r:.40}: known are {', '.join(known)}.")

    def number(self, text: str, dimension: Dimension) -> float:
        """A quantity as a number in these units.

        Raises
        ------
        ProblemError
            No number, an unknown unit, one of another dimension, or a file without units.
        """
        match = _QUANTITY.fullmatch(text)
        if match is None:
            raise ProblemError(
                f"{text!r:.60} is no number with a unit, such as {_example(dimension)}."
            )
        value, size, computed = float(match[1]), 1.0, NUMBER
        rest = match[2]
        while rest:
            size, computed, rest = _times(size, computed, rest)
        wanted = _NAMES.get(dimension, "another quantity")
        if computed != dimension:
            have = _NAMES.get(computed, "another quantity")
            raise ProblemError(f"{text!r:.60} is {have}, but {wanted} belongs here.")
        if dimension != NUMBER and not (self.length and self.force):
            raise ProblemError(
                f"{text!r:.60} has a unit, but the file does not say its own: give [units] with "
                'length and force, such as length = "mm" and force = "N".'
            )
        if dimension != NUMBER:
            size /= _LENGTHS[self.length] ** dimension[0] * _FORCES[self.force] ** dimension[1]
        result = value * size
        return result if isfinite(result) else inf


def _times(size: float, result: Dimension, rest: str) -> tuple[float, Dimension, str]:
    """One more factor of a unit."""
    match = _FACTOR.match(rest)
    if match is None or match[3] not in _UNITS:
        name = rest if match is None else match[3]
        known = ", ".join(_UNITS)
        raise ProblemError(f"the unit {name!r:.40} is not known: known are {known}.")
    power = float(match[4] or 1) * (0.5 if match[2] else 1.0) * (-1 if match[1] == "/" else 1)
    factor, own = _UNITS[match[3]]
    powers = result[0] + power * own[0], result[1] + power * own[1]
    return size * factor**power, powers, rest[match.end() :]


def _example(dimension: Dimension) -> str:
    names = {LENGTH: '"5 mm"', FORCE: '"2 kN"', STRESS: '"80 MPa"', TOUGHNESS: '"40 MPa*sqrt(m)"'}
    return names.get(dimension, "3.0")


Key = tuple[str | int, ...]

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?")
_ENTRY = re.compile(r"\s*([\w.\"'-]+(?:\s*\.\s*[\w\"'-]+)*)\s*=(.*)", re.DOTALL)
_QUOTED = re.compile(r"\"(?:\\.|[^\"\\])*\"|'[^']*'")


@dataclass(frozen=True)
class Source:
    """A file, and the line of each of its keys."""

    path: Path
    lines: dict[Key, int]
    units: Units = field(default_factory=Units)

    def refuse(self, key: Key, words: str) -> NoReturn:
        """Raise an error that names file, line and place."""
        raise ProblemError(f"{self.path}, line {self.line(key)}, {_shown(key)}: {words}")

    def line(self, key: Key) -> int:
        """Line of a key, or of the table that it is missing from."""
        while key and key not in self.lines:
            key = key[:-1]
        return self.lines.get(key, 1)


@dataclass(frozen=True)
class Table:
    """A table of the file."""

    source: Source
    key: Key
    content: dict[str, Any]

    def __contains__(self, name: str) -> bool:
        return name in self.content

    def known(self, names: Iterable[str], what: str = "") -> None:
        """Refuse keys that are not among these."""
        names = list(names)
        for name in self.content:
            if name not in names:
                near = difflib.get_close_matches(name, names, 1)
                hint = f"did you mean {near[0]!r}? " if near else ""
                self.refuse(
                    name, f"there is no such key{what}: {hint}known are {', '.join(names)}."
                )

    def refuse(self, name: str, words: str) -> NoReturn:
        """Raise an error that names file, line and key."""
        self.source.refuse((*self.key, name) if name else self.key, words)

    def table(self, name: str) -> "Table":
        """A table within this one; an empty one where it is missing."""
        value = self.content.get(name, {})
        if not isinstance(value, dict):
            self.refuse(name, f"{value!r:.60} is no table: begin it with [{name}].")
        return Table(self.source, (*self.key, name), value)

    def tables(self, name: str) -> list["Table"]:
        """Tables of an array; none where it is missing."""
        value = self.content.get(name, [])
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self.refuse(name, f"give a list of tables: begin each with [[{name}]].")
        return [Table(self.source, (*self.key, name, k), item) for k, item in enumerate(value)]

    def text(self, name: str, default: str | None = None) -> str:
        """A key that is text."""
        value = self.content.get(name, default)
        if value is None:
            self.refuse("", f"the key {name!r} is missing.")
        if not isinstance(value, str):
            self.refuse(name, f"{value!r:.60} is no text: put it into quotes.")
        return value

    def value(self, name: str, dimension: Dimension | None) -> Any:
        """A key in the units of the file, lists entry by entry; text stays text without one."""
        try:
            return self._converted(self.content[name], dimension)
        except ProblemError as error:
            self.refuse(name, str(error))

    def _converted(self, value: Any, dimension: Dimension | None) -> Any:
        if isinstance(value, list):
            return [self._converted(item, dimension) for item in value]
        if isinstance(value, str) and dimension is not None:
            return self.source.units.number(value, dimension)
        return value

    def wrap(self, error: XcrackError | TypeError) -> NoReturn:
        """Raise an error of a function that this table was given to, with file and line."""
        text = str(error)
        key = next((name for name in self.content if re.search(rf"\b{name}\b", text)), "")
        place = (*self.key, key) if key else self.key
        kind = type(error) if isinstance(error, XcrackError) else ProblemError
        line = self.source.line(place)
        raise kind(f"{self.source.path}, line {line}, {_shown(place)}: {text}") from error


def read_tables(path: Path) -> Table:
    """The root table of a file.

    Raises
    ------
    ProblemError
        No such file, or one that is no toml.
    """
    with system_errors("the scene cannot be read from", path, error=ProblemError):
        data = path.read_bytes()
    try:
        text = data.decode("utf-8")
        content = tomllib.loads(text)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ProblemError(f"{path}, line {line}: this is no text in utf-8.") from error
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"line (\d+)", str(error))
        line = int(place[1]) if place else text.count("\n") + 1
        raise ProblemError(
            f"{path}, line {line}: this is no toml ({error}); texts stand in quotes, lists in [ ]."
        ) from error
    source = Source(path, _lines(text))
    root = Table(source, (), content)
    units = root.table("units")
    units.known(("length", "force"))
    try:
        own = Units(**units.content)
    except ProblemError as error:
        units.wrap(error)
    return Table(Source(path, source.lines, own), (), content)


def _lines(text: str) -> dict[Key, int]:
    """Line of each header and each key."""
    lines: dict[Key, int] = {}
    counts: dict[Key, int] = {}
    table: Key = ()
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        plain = _QUOTED.sub('""', line).partition("#")[0]
        header = _HEADER.fullmatch(line) if depth == 0 else None
        entry = _ENTRY.fullmatch(line) if depth == 0 and header is None else None
        if header is not None:
            table = _parts(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                lines.setdefault(table, number)
                table = (*table, counts[table])
            lines.setdefault(table, number)
            continue
        if entry is not None:
            parts = _parts(entry[1])
            for n in range(1, len(parts) + 1):
                lines.setdefault((*table, *parts[:n]), number)
        depth = max(
            depth + sum(plain.count(c) for c in "[{") - sum(plain.count(c) for c in "]}"), 0
        )
    return lines


def _parts(name: str) -> Key:
    return tuple(part.strip().strip("\"'") for part in name.split("."))


def _shown(key: Key) -> str:
    """A key as a reader would look for it."""
    names = [f"{key[k - 1]} {part + 1}" if isinstance(part, int) else part
             for k, part in enumerate(key)
             if not (k + 1 < len(key) and isinstance(key[k + 1], int))]  # fmt: skip
    return ".".join(names) if names else "the file"


__all__ = [
    "BODY_FORCE",
    "FORCE",
    "LENGTH",
    "NUMBER",
    "STRESS",
    "TOUGHNESS",
    "Dimension",
    "Key",
    "Source",
    "Table",
    "Units",
    "read_tables",
]
