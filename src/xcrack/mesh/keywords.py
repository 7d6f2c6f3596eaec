"""Decks: keywords with their data lines, and the table of what was used of them and what not."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from xcrack.base.errors import MeshError, XcrackError

_DEEPEST = 100  # files that include each other
_OPTION = re.compile(r"[A-Za-z]")  # what a keyword line that goes on begins with
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")  # 1.0D+5


@dataclass(frozen=True)
class KeywordUse:
    """What became of a keyword of a deck.

    Attributes
    ----------
    keyword : str
        As the deck has it, such as ``"*CLOAD"``.
    count : int
        How often it comes.
    place : str
        File and line of its first coming.
    is_used : bool
    reason : str
        What it was used for, or why it is ignored.
    is_harmless : bool
        Ignored, and it changes neither the mesh nor the solution.
    """

    keyword: str
    count: int
    place: str
    is_used: bool
    reason: str
    is_harmless: bool = False

    def __str__(self) -> str:
        times = f" ({self.count} times)" if self.count > 1 else ""
        use = "used" if self.is_used else "ignored"
        return f"{self.keyword}{times}, {self.place}: {use}: {self.reason}"


@dataclass(frozen=True, eq=False)
class Keyword:
    """A keyword line with the data lines that follow it.

    Attributes
    ----------
    name : str
        In capitals, words parted by one space, without the star.
    options : dict of str to str
        Names in capitals; without a value where there is none.
    data : list of (int, str)
        Number and text of each data line.
    path : Path
    line : int
    """

    name: str
    options: dict[str, str]
    data: list[tuple[int, str]]
    path: Path
    line: int

    @property
    def place(self) -> str:
        """File and line."""
        return f"{self.path.name}, line {self.line}"

    @property
    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Line number and entries of each data line."""
        for number, text in self.data:
            yield number, entries_of(text)

    def refuse(
        self, words: str, line: int | None = None, error: type[XcrackError] = MeshError
    ) -> NoReturn:
        """Raise an error that names file, line and keyword."""
        raise error(f"{self.path.name}, line {line or self.line}: *{self.name}: {words}")

    def number(
        self, text: str, line: int, label: str = "a number", default: float | None = None
    ) -> float:
        """An entry as a finite number; an empty one is the default, where there is one."""
        if not text and default is not None:
            return default
        try:
            value = float(_FORTRAN.sub("e", text))
        except ValueError:
            value = float("nan")
        if not abs(value) < float("inf"):
            self.refuse(f"{text!r:.40} is no finite number: give {label}.", line)
        return value

    def whole_number(self, text: str, line: int, label: str) -> int:
        """An entry as a whole number."""
        try:
            return int(text)
        except ValueError:
            self.refuse(f"{text!r:.40} is no whole number: give {label}.", line)

    def option(self, name: str) -> str:
        """An option that must be there."""
        value = self.options.get(name, "")
        if not value:
            self.refuse(f"the parameter {name} is missing: write *{self.name}, {name}=...")
        return value


def entries_of(text: str) -> list[str]:
    """Entries of a data line; one comma at its end means that it goes on, not an empty entry."""
    entries = [entry.strip() for entry in text.split(",")]
    if len(entries) > 1 and not entries[-1]:
        entries.pop()
    return entries


def numbers_of_text(text: str) -> str:
    """A text of numbers with exponents as Python has them."""
    return _FORTRAN.sub("e", text)


def keywords_of(path: Path, parents: tuple[Path, ...] = ()) -> Iterator[Keyword]:
    """Keywords of an Abaqus or CalculiX deck in their order, those of included files in place.

    Raises
    ------
    MeshError
        A file that is not there or includes itself, data before the first keyword.
    """
    if len(parents) > _DEEPEST:
        raise MeshError(
            f"{path.name} is included by {len(parents)} files, one in the other: join some of them."
        )
    resolved_path = path.resolve()
    if resolved_path in parents:
        raise MeshError(f"{path.name} includes itself: leave that *INCLUDE out.")
    keyword: Keyword | None = None
    open_line: tuple[int, str] | None = None  # a keyword line that goes on
    for number, line in enumerate(_lines(path), 1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if open_line is not None and _OPTION.match(text):
            number, text = open_line[0], open_line[1] + text
            open_line = None
        elif open_line is not None:  # the comma at its end was one too many
            if keyword is not None:
                yield from _complete_keyword(keyword, (*parents, resolved_path))
            keyword = _keyword(open_line[1], path, open_line[0])
            open_line = None
        if not text.startswith("*"):
            if keyword is None:
                raise MeshError(
                    f"{path.name}, line {number}: data stand before any keyword ({text!r:.40}): an "
                    "Abaqus deck begins with a keyword such as *HEADING or *NODE."
                )
            keyword.data.append((number, text))
            continue
        if text.endswith(","):
            open_line = (number, text)
            continue
        if keyword is not None:
            yield from _complete_keyword(keyword, (*parents, resolved_path))
        keyword = _keyword(text, path, number)
    if open_line is not None:
        if keyword is not None:
            yield from _complete_keyword(keyword, (*parents, resolved_path))
        keyword = _keyword(open_line[1].rstrip(","), path, open_line[0])
    if keyword is not None:
        yield from _complete_keyword(keyword, (*parents, resolved_path))


def _lines(path: Path) -> Sequence[str]:
    return path.read_text(encoding="utf-8", errors="replace").splitlines()


def _keyword(text: str, path: Path, line: int) -> Keyword:
    head, *entries = text[1:].split(",")
    name = " ".join(head.upper().split())
    pairs = (entry.partition("=") for entry in entries)
    options = {
        " ".join(key.upper().split()): value.strip().strip('"')
        for key, _, value in pairs
        if key.strip()
    }
    return Keyword(name, options, [], path, line)


def _complete_keyword(keyword: Keyword, parents: tuple[Path, ...]) -> Iterator[Keyword]:
    """A keyword with the data of the file that it names, or the keywords of an included one."""
    input_name = keyword.options.get("INPUT", "")
    if not input_name:
        if keyword.name == "INCLUDE":
            keyword.refuse("the parameter INPUT is missing: write *INCLUDE, INPUT=file.inp.")
        yield keyword
        return
    included_path = keyword.path.parent / input_name
    if not included_path.is_file():
        keyword.refuse(
            f"the file {str(included_path)!r} does not exist: put it beside {keyword.path.name}."
        )
    if keyword.name == "INCLUDE":
        yield from keywords_of(included_path, parents)
        return
    data = [
        (number, text.strip())
        for number, text in enumerate(_lines(included_path), 1)
        if text.strip() and not text.strip().startswith("*")
    ]
    yield Keyword(keyword.name, keyword.options, [*keyword.data, *data], keyword.path, keyword.line)


def table_of(uses: Iterable[KeywordUse]) -> str:
    """The table as text: what is used first, then what is ignored."""
    rows = [
        (use.keyword, str(use.count), use.place, "used" if use.is_used else "ignored", use.reason)
        for use in sorted(uses, key=lambda use: not use.is_used)
    ]
    widths = [max((len(row[k]) for row in rows), default=0) for k in range(4)]
    return "\n".join(
        "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths)), row[4]])
        for row in rows
    )


def missed_words(uses: Iterable[KeywordUse]) -> list[str]:
    """Keywords that are ignored and may matter, each with its count."""
    return [
        use.keyword + (f" ({use.count} times)" if use.count > 1 else "")
        for use in uses
        if not use.is_used and not use.is_harmless
    ]


__all__ = [
    "Keyword",
    "KeywordUse",
    "entries_of",
    "keywords_of",
    "missed_words",
    "numbers_of_text",
    "table_of",
]
