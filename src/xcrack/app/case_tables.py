"""A toml file as tables that know the lines their keys stand in."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.paths import system_errors
from xcrack.base.units import Dimension, Units

Key = tuple[str | int, ...]

FREE = "free"  # a direction that nothing holds, a side of a box without an end
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
        raise ProblemError(f"{self.path}, line {self.line(key)}, {_key_text(key)}: {words}")

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

    def check_names(self, names: Iterable[str], label: str = "") -> None:
        """Refuse keys that are not among these."""
        names = list(names)
        for name in self.content:
            if name not in names:
                similar_keys = difflib.get_close_matches(name, names, 1)
                hint = f"did you mean {similar_keys[0]!r}? " if similar_keys else ""
                self.refuse(
                    name, f"there is no such key{label}: {hint}known are {', '.join(names)}."
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
            self.refuse("", f"the key {name!r} is missing: give it.")
        if not isinstance(value, str):
            self.refuse(name, f"{value!r:.60} is no text: put it into quotes.")
        return value

    def value(self, name: str, dimension: Dimension | None, hint: str = "") -> Any:
        """A key in the units of the file, lists and tables entry by entry.

        Text stays text without a dimension; "free" in a list is None.
        """
        try:
            return self._in_file_units(self.content[name], dimension)
        except ProblemError as error:
            self.refuse(name, f"{error}{hint}")

    def _in_file_units(
        self, value: Any, dimension: Dimension | None, is_component: bool = False
    ) -> Any:
        if isinstance(value, list):
            return [self._in_file_units(item, dimension, True) for item in value]
        if isinstance(value, dict):
            return {key: self._in_file_units(item, dimension) for key, item in value.items()}
        if value == FREE and is_component:
            return None
        if isinstance(value, str) and dimension is not None:
            return self.source.units.number(value, dimension)
        return value

    def wrap(self, error: XcrackError | TypeError, key_of_error: str = "") -> NoReturn:
        """Raise an error of a function that this table was given to, with file and line.

        It is about a key, where that is known; else about the first that it names.
        """
        text = str(error)
        places = {
            name: match.start()
            for name in self.content
            if (match := re.search(rf"\b{re.escape(name)}\b", text))
        }
        key = key_of_error or min(places, key=places.__getitem__, default="")
        place = (*self.key, key) if key else self.key
        kind = type(error) if isinstance(error, XcrackError) else ProblemError
        line = self.source.line(place)
        raise kind(f"{self.source.path}, line {line}, {_key_text(place)}: {text}") from error


def read_tables(path: Path, changes: Mapping[str, Any] | None = None) -> Table:
    """The root table of a file, with other values of some keys.

    Raises
    ------
    ProblemError
        No such file, one that is no toml, or a key to be changed that it does not have.
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
            f"{path}, line {line}: this is no toml: {_words_of_toml(str(error))}."
        ) from error
    except RecursionError as error:
        raise ProblemError(
            f"{path}: lists or tables are nested too deeply: give those that the keys need."
        ) from error
    for key, value in (changes or {}).items():
        _change(content, key, value, path)
    source = Source(path, _lines(text))
    root = Table(source, (), content)
    units = root.table("units")
    units.check_names(("length", "force"))
    try:
        units_of_file = Units(**units.content)
    except ProblemError as error:
        units.wrap(error)
    return Table(Source(path, source.lines, units_of_file), (), content)


# What tomllib says, and what a reader is to do.
_TOML = {
    "Cannot overwrite a value": "the key stands here a second time: leave one of them out",
    r"Cannot declare \('?(.*?)'?,?\) twice": "the table [{}] begins a second time: put its keys "
    "together; each entry of a list begins with two brackets, as [[loads]]",
    "Cannot mutate immutable|Cannot redefine": "this table was given in one line before: put all "
    "keys into that",
    "Expected '='": "a line is `key = value`, a table [name] or a remark behind #: write one",
    "Invalid statement": "a line is `key = value`, a table [name] or a remark behind #: write one",
    "Invalid value": "the value is no number, text in quotes, true, false or list: give one",
    "Unclosed array": "a list is not closed: write ]",
    "Unclosed inline": "a table in one line is not closed: write }}",
    "Expected '\\]": "the name of a table is not closed: write ]",
    'Illegal character|Unterminated|Expected "|end of document|Unescaped': "a text is not closed "
    "or holds a sign that it may not: write it in one line between quotes",
    "Expected newline": "more stands behind the value: write one key a line, texts in quotes",
}


def _words_of_toml(reason: str) -> str:
    """An error of tomllib as what to do about it."""
    for pattern, words in _TOML.items():
        if match := re.match(pattern, reason):
            name = match[1].replace("', '", ".") if match.groups() else ""
            return words.format(name)
    message = re.sub(r" \(at .*?\)$", "", reason)
    return f"{message}; texts stand in quotes, lists in [ ]: write it so"


def _change(content: dict[str, Any], key: str, value: Any, path: Path) -> None:
    """Set a key such as ``cracks.0.radius``: tables of a list and entries are counted from 0."""
    place: Any = content
    parts = key.split(".")
    for n, part in enumerate(parts):
        parent = ".".join(parts[:n]) or "the file"
        if isinstance(place, list):
            if not part.isdecimal() or int(part) >= len(place):
                raise ProblemError(
                    f"{path}: {key}: {parent} is a list of {len(place)}, counted from 0: give one "
                    f"of its numbers in place of {part!r:.40}."
                )
            index: Any = int(part)
        elif isinstance(place, dict):
            index = part
            if part not in place and n < len(parts) - 1:
                path_text = ", ".join(place) or "nothing"
                raise ProblemError(
                    f"{path}: {key}: {parent} has no {part!r:.40}; it has {path_text}."
                )
        else:
            raise ProblemError(f"{path}: {key}: {parent} is {place!r:.40}, which has no parts.")
        if n == len(parts) - 1:
            place[index] = value
        else:
            place = place[index]


def _lines(text: str) -> dict[Key, int]:
    """Line of each header and each key."""
    lines: dict[Key, int] = {}
    counts: dict[Key, int] = {}
    table: Key = ()
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        unquoted = _QUOTED.sub('""', line).partition("#")[0]
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
            depth + sum(unquoted.count(c) for c in "[{") - sum(unquoted.count(c) for c in "]}"), 0
        )
    return lines


def _parts(name: str) -> Key:
    return tuple(part.strip().strip("\"'") for part in name.split("."))


def _key_text(key: Key) -> str:
    """A key as a reader would look for it."""
    names = [f"{key[k - 1]} {part + 1}" if isinstance(part, int) else part
             for k, part in enumerate(key)
             if not (k + 1 < len(key) and isinstance(key[k + 1], int))]  # fmt: skip
    return ".".join(names) if names else "the file"


__all__ = ["FREE", "Key", "Source", "Table", "read_tables"]
