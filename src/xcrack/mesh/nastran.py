"""Decks of Nastran (bdf): nodes and elements of the bulk data, and what becomes of its cards.

Fields of a card have eight columns, sixteen after a star, or are parted by commas; what goes on in
the next line begins there with a blank, a plus or a star.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from xcrack.base.arrays import Ints
from xcrack.base.errors import MeshError
from xcrack.mesh.keywords import KeywordUse
from xcrack.mesh.linear import SHAPES, base_kind
from xcrack.mesh.raw import RawMesh

_BRICK = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]  # VTK has the upright edges last
_WEDGE = [*range(9), 12, 13, 14, 9, 10, 11]
# Kinds of each card: with corners alone, and with the middles of all edges.
_ELEMENTS: dict[str, tuple[str, str]] = {
    "CTETRA": ("tetra", "tetra10"), "CHEXA": ("hexahedron", "hexahedron20"),
    "CPENTA": ("wedge", "wedge15"), "CPYRA": ("pyramid", "pyramid13"),
    "CPYRAM": ("pyramid", "pyramid13"), "CTRIA3": ("triangle", ""), "CTRIAR": ("triangle", ""),
    "CTRIA6": ("triangle", "triangle6"), "CQUAD4": ("quad", ""), "CQUADR": ("quad", ""),
    "CQUAD8": ("quad", "quad8"),
}  # fmt: skip
_NODES = {"tetra10": 10, "hexahedron20": 20, "wedge15": 15, "pyramid13": 13, "triangle6": 6,
          "quad8": 8}  # fmt: skip
_ORDER = {"hexahedron20": _BRICK, "wedge15": _WEDGE}
_PLURAL = {"tetra": "cells", "hexahedron": "cells", "wedge": "cells", "pyramid": "cells",
           "triangle": "triangles", "quad": "quadrilaterals"}  # fmt: skip
_SETTINGS = ("PARAM", "ENDDATA", "ECHOON", "ECHOOFF", "INCLUDE")
_NOT_MESH = "it is not of the mesh"
_EXPONENT = re.compile(r"(?<=[\d.])[dD]?(?=[+-]\d)")  # 1.0-3, 1.0D+3
_DEEPEST = 100  # files that include each other
_WHOLE_DECK = "give the whole deck, with the files that it includes"


@dataclass(frozen=True, eq=False)
class Card:
    """A card of the bulk data with the lines in which it goes on.

    Attributes
    ----------
    name : str
        In capitals, without a star.
    fields : list of str
        Behind the name.
    path : Path
    line : int
    """

    name: str
    fields: list[str] = field(default_factory=list)
    path: Path = Path()
    line: int = 0

    def refuse(self, words: str) -> NoReturn:
        """Raise an error that names file, line and card."""
        raise MeshError(f"{self.path.name}, line {self.line}: {self.name}: {words}")

    def whole_number(self, k: int, label: str) -> int:
        """A field as a whole number above zero."""
        text = self.fields[k] if k < len(self.fields) else ""
        if not text.isdecimal() or not int(text) or len(text) > 18:
            self.refuse(f"{text!r:.40} is no whole number above 0: give {label}.")
        return int(text)

    def coordinate(self, k: int) -> float:
        """A field as a finite number; 0 where it is blank."""
        text = self.fields[k] if k < len(self.fields) else ""
        try:
            value = float(_EXPONENT.sub("e", text)) if text else 0.0
        except ValueError:
            value = float("nan")
        if not abs(value) < float("inf"):
            self.refuse(f"{text!r:.40} is no finite number: give a coordinate.")
        return value


def read_nastran(path: Path) -> tuple[RawMesh, list[KeywordUse]]:
    """Nodes and elements of a Nastran deck; elements of a property make a set.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawMesh
    list of KeywordUse
        What became of each of its cards.

    Raises
    ------
    MeshError
        A damaged card, a node that is not there or comes twice, points in a coordinate system of
        their own, a file that is not there or includes itself; with its line.
    """
    counts: dict[str, list[int]] = {}
    rows: dict[int, int] = {}
    points: list[list[float]] = []
    elements: dict[str, list[tuple[Card, int, list[int]]]] = {}
    for card in _cards(path):
        counts.setdefault(card.name, [0, card.line])[0] += 1
        if card.name == "GRID":
            number = card.whole_number(0, "the number of a node")
            if len(card.fields) > 1 and card.fields[1] not in ("", "0"):
                card.refuse(
                    f"the point is given in the coordinate system {card.fields[1]}: let Nastran or "
                    "gmsh write the deck with points in the basic system (CP = 0)."
                )
            if number in rows:
                card.refuse(f"there is a node {number} already: give each its own number.")
            rows[number] = len(points)
            points.append([card.coordinate(k) for k in (2, 3, 4)])
        elif card.name in _ELEMENTS:
            card.whole_number(0, "the number of an element")
            kind, nodes = _nodes(card)
            property_number = (
                card.whole_number(1, "the number of a property") if card.fields[1] else 0
            )
            elements.setdefault(kind, []).append((card, property_number, nodes))
    if not elements:
        raise MeshError(
            f"{path.name} has no GRID and no elements such as CTETRA, CHEXA or CTRIA3: export the "
            "bulk data of the mesh."
        )
    blocks, sets = [], []
    top = max((SHAPES[base_kind(kind) or "vertex"].dim for kind in elements), default=0)
    for kind, of_kind in elements.items():
        for card, _, nodes in of_kind:
            for node in nodes:
                if node not in rows:
                    card.refuse(f"it names node {node}, which the deck lacks: {_WHOLE_DECK}.")
        data = np.array([[rows[node] for node in nodes] for *_, nodes in of_kind], dtype=np.int64)
        blocks.append((kind, data))
        sets += _sets_by_property(kind, data, [number for _, number, _ in of_kind], top)
    uses = [_use(path, name, count, line) for name, (count, line) in counts.items()]
    return RawMesh(np.array(points, dtype=float).reshape(-1, 3), blocks, sets), uses


def _sets_by_property(
    kind: str, data: Ints, numbers: Sequence[int], top: int
) -> list[tuple[str, str, Ints]]:
    noun = "cells" if SHAPES[base_kind(kind) or "vertex"].dim == top else "facets"
    of = np.array(numbers)
    return [(kind, f"{noun}_{n}", data[of == n]) for n in np.unique(of[of > 0]).tolist()]


def _nodes(card: Card) -> tuple[str, list[int]]:
    """Kind of an element, and its nodes in VTK's order: all of them, or its corners alone."""
    kind, full_kind = _ELEMENTS[card.name]
    n, n_full = SHAPES[kind].corners, _NODES.get(full_kind, 0)
    middles = card.fields[2 + n : 2 + n_full]
    is_full = bool(middles) and len(middles) == n_full - n and all(middles)
    count = n_full if is_full else n
    nodes = [card.whole_number(2 + k, f"the numbers of its {count} nodes") for k in range(count)]
    order = _ORDER.get(full_kind) if is_full else None
    return (full_kind if is_full else kind), nodes if order is None else [nodes[k] for k in order]


def _use(path: Path, name: str, count: int, line: int) -> KeywordUse:
    """What became of the cards of a name."""
    if name == "GRID":
        reason = "nodes"
    elif name in _ELEMENTS:
        reason = _PLURAL[_ELEMENTS[name][0]]
    else:
        reason = "a setting" if name in _SETTINGS else _NOT_MESH
    is_taken = name == "GRID" or name in _ELEMENTS
    return KeywordUse(name, count, f"{path.name}, line {line}", is_taken, reason, name in _SETTINGS)


def _cards(path: Path) -> Iterator[Card]:
    """Cards of the bulk data in their order, those of included files in place."""
    lines = list(_lines(path, ()))
    begin = [k for k, (_, _, text) in enumerate(lines) if re.match(r"\s*BEGIN\s+BULK", text, re.I)]
    card: Card | None = None
    size = 8  # fields of the line before
    for source, number, text in lines[begin[0] + 1 if begin else 0 :]:
        head, fields, n = _fields(text)
        if head and head[0] not in "+*":
            if card is not None:
                yield card
            card = Card(head.upper().rstrip("*_"), fields, source, number)  # meshio writes CTETRA_
            if card.name == "ENDDATA":
                break
        elif card is not None:
            card.fields.extend([""] * (-len(card.fields) % size))
            card.fields.extend(fields)
        size = n
    if card is not None:
        yield card


def _fields(text: str) -> tuple[str, list[str], int]:
    """First field of a line, those behind it, and how many it has room for."""
    if "," in text:
        head, *fields = (entry.strip() for entry in text.split(","))
        n = 4 if head.endswith("*") or head.startswith("*") else 8
        return head, fields[:n], n
    head = text[:8].strip()
    n, width = (4, 16) if "*" in head else (8, 8)
    ends = range(8, 8 + n * width, width)
    return head, [text[k : k + width].strip() for k in ends], n


def _lines(path: Path, parents: tuple[Path, ...]) -> Iterator[tuple[Path, int, str]]:
    """Lines with file and number, without comments, those of included files in place."""
    path_here = path.resolve()
    if path_here in parents or len(parents) > _DEEPEST:
        raise MeshError(f"{path.name} includes itself: leave that INCLUDE out.")
    content = path.read_text(encoding="utf-8", errors="replace").expandtabs(8)
    for number, line in enumerate(content.splitlines(), 1):
        text = line.split("$")[0].rstrip()
        if not text.strip():
            continue
        include = re.fullmatch(r"\s*INCLUDE\s+['\"]?([^'\"]+)['\"]?\s*", text, re.I)
        if include is None:
            yield path, number, text
            continue
        target = path.parent / include[1].strip()
        if not target.is_file():
            raise MeshError(
                f"{path.name}, line {number}: INCLUDE: there is no file {str(target)!r}: "
                "put it there (paths begin at the file that names it)."
            )
        yield from _lines(target, (*parents, path_here))


__all__ = ["read_nastran"]
