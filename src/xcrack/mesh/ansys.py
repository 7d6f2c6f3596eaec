"""Archives of Ansys (cdb): nodes, elements and components, and what becomes of other commands.

What CDWRITE writes has its nodes, elements and components in blocks of fixed width.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from xcrack.base.arrays import Ints
from xcrack.base.errors import MeshError
from xcrack.mesh.keywords import KeywordUse, numbers_of_text
from xcrack.mesh.linear import base_kind
from xcrack.mesh.raw import RawMesh

# Kinds of the elements of Ansys, by their number: solids and plane ones of structures.
_KINDS = {
    **dict.fromkeys((45, 185, 5, 62, 64, 65), "hexahedron"),
    **dict.fromkeys((95, 186, 90, 226, 231), "hexahedron20"),
    **dict.fromkeys((92, 187, 227, 232, 237, 87), "tetra10"),
    285: "tetra",
    **dict.fromkeys((42, 182, 55), "quad"),
    **dict.fromkeys((82, 183, 77, 223), "quad8"),
}
_BY_NODES = {("quad8", 6): "triangle6", ("hexahedron20", 8): "hexahedron", ("quad", 3): "triangle",
             ("hexahedron20", 10): "tetra10", ("tetra10", 4): "tetra", ("quad8", 4): "quad",
             ("hexahedron", 4): "tetra"}  # fmt: skip
_FIELD = re.compile(r"(\d+)([ie])(\d+)(?:\.\d+)?(?:e\d+)?")
_ENTRIES = 11  # of an element before its nodes
_TAKEN = {"NBLOCK": "nodes", "EBLOCK": "elements", "ET": "kinds of elements",
          "CMBLOCK": "components become sets"}  # fmt: skip
_SETTINGS = (
    "FINISH IMME SHPP NUMOFF NUMOFFSET DOF "
    "CSYS DSYS RSYS TYPE MAT REAL SECNUM ESYS TSHAP KEYOPT KEYOP ETBLOCK EXTOPT FTYPE ERESX FINI "
    "OUTRES OUTPR ANTYPE NSUBST KBC TIME AUTOTS NEQIT CNVTOL SOLCONTROL CRPLIM NCNV KUSE IRLF "
    "MODOPT MODCONTROL QRDOPT"
).split()
# Loads of the whole body that an archive always has, mostly zero.
_ALWAYS = ("ACEL OMEGA DOMEGA CGLOC CGOMEGA DCGOMG CMOMEGA TREF BFUNIF ALPHAD BETAD DMPRAT "
           "DMPSTR").split()  # fmt: skip
_AGAIN = "write the archive again with CDWRITE, DB"
_NOT_MESH = "it is not of the mesh"


def read_ansys(path: Path) -> tuple[RawMesh, list[KeywordUse]]:
    """Nodes, elements and components of an Ansys archive.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawMesh
    list of KeywordUse
        What became of each of its commands.

    Raises
    ------
    MeshError
        A damaged block, elements that name unknown nodes, a file without blocks; with its line.
    """
    archive = _Archive(path)
    for number, text in archive:
        name = re.split(r"[,\s=]", text, maxsplit=1)[0].upper()
        entries = [entry.strip() for entry in text.split(",")][1:]
        if not name or name.startswith("!") or name == "-1":
            continue
        if name == "NBLOCK":
            archive.take_nodes(number)
        elif name == "EBLOCK":
            archive.take_elements(number, entries)
        elif name == "CMBLOCK":
            archive.take_component(number, entries)
        elif name == "ET" and len(entries) > 1:
            archive.kinds[_whole_entry(entries[0], path, number)] = _whole_entry(
                re.sub(r"[A-Za-z]", "", entries[1]), path, number
            )
        elif name in ("N", "EN") and re.match(r"R\d", entries[0] if entries else ""):
            continue  # the end of a block
        elif name[0] in "/*_" or (name in _ALWAYS and not any(map(_is_load, entries))):
            name = "settings"
        elif name in ("N", "EN", "E"):
            _refuse(path, number, f"{name} alone is not read: write the archive with CDWRITE, DB.")
        archive.counts.setdefault(name, [0, number])[0] += 1
    return archive.raw_mesh(), archive.uses()


class _Archive:
    """Lines of an archive, and what their blocks add up to."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lines = enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        self.counts: dict[str, list[int]] = {}
        self.kinds: dict[int, int] = {}
        self.rows: dict[int, int] = {}
        self.points: list[list[float]] = []
        self.elements: list[tuple[int, int, list[int]]] = []  # number, type, nodes
        self.components: list[tuple[str, str, list[int]]] = []

    def __iter__(self) -> Iterator[tuple[int, str]]:
        for number, line in self._lines:
            if line.strip():
                yield number, line.strip()

    def _format(self, line: int) -> tuple[list[int], int]:
        """Widths of the columns of a block, by its format; how many are of whole numbers."""
        _, text = next(self._lines, (line, ""))
        columns = [
            (kind, int(width))
            for n, kind, width in _FIELD.findall(text.lower())
            for _ in range(int(n))
        ]
        if not columns:
            _refuse(
                self.path,
                line,
                f"the block has the format {text.strip()!r:.40}, and not such as "
                f"(3i9,6e21.13e3): {_AGAIN}.",
            )
        return [width for _, width in columns], sum(kind == "i" for kind, _ in columns)

    def take_nodes(self, line: int) -> None:
        """A block of nodes: number, two entries that are not used, coordinates, angles."""
        widths, n_whole = self._format(line)
        ends = np.concatenate([[0], np.cumsum(widths)]).tolist()
        for number, text in self._lines:
            if text.strip().startswith(("N,", "-1")):
                return
            label = _whole_entry(text[: ends[1]], self.path, number)
            cuts = list(zip(ends[n_whole:], ends[n_whole + 1 :], strict=False))[:3]
            entries = [text[a:b].strip() for a, b in cuts]
            try:
                x = [float(numbers_of_text(entry)) if entry else 0.0 for entry in entries]
            except ValueError:
                _refuse(self.path, number, f"{text.strip()!r:.60} is no node: {_AGAIN}.")
            self.rows[label] = len(self.points)
            self.points.append([*x, 0.0, 0.0, 0.0][:3])
        _refuse(self.path, line, f"the nodes have no end, the file is cut off: {_AGAIN}.")

    def take_elements(self, line: int, entries: Sequence[str]) -> None:
        """A block of elements in the format of solids: eleven entries and the nodes."""
        if "SOLID" not in [entry.upper() for entry in entries]:
            _refuse(self.path, line, "EBLOCK without SOLID is not read: write it with CDWRITE, DB.")
        width = self._format(line)[0][0]
        numbers: list[int] = []
        for number, text in self._lines:
            if text.strip() == "-1":
                return
            pieces = [text[k : k + width] for k in range(0, len(text.rstrip()), width)]
            row = [_whole_entry(piece, self.path, number) for piece in pieces]
            if numbers:
                numbers += row
            elif len(row) < _ENTRIES:
                _refuse(self.path, number, f"{text.strip()!r:.60} is no element: {_AGAIN}.")
            else:
                numbers = row
            if len(numbers) - _ENTRIES >= numbers[8]:
                nodes = numbers[_ENTRIES : _ENTRIES + numbers[8]]
                self.elements.append((numbers[10], numbers[1], nodes))
                numbers = []
        _refuse(self.path, line, f"the elements have no end, the file is cut off: {_AGAIN}.")

    def take_component(self, line: int, entries: Sequence[str]) -> None:
        """A component: numbers of nodes or elements, a negative one closes a range."""
        if len(entries) < 3:
            _refuse(self.path, line, "CMBLOCK needs a name, NODE or ELEM, and a count.")
        count = _whole_entry(entries[2].split("!")[0], self.path, line)
        width = self._format(line)[0][0]
        members: list[int] = []
        n = 0
        while n < count:
            number, text = next(self._lines, (line, ""))
            pieces = [text[k : k + width] for k in range(0, len(text.rstrip()), width)]
            if not pieces:
                _refuse(self.path, number, f"the component {entries[0]!r} is cut off: {_AGAIN}.")
            for piece in pieces:
                value = _whole_entry(piece, self.path, number)
                members += range(members[-1] + 1, -value + 1) if value < 0 and members else [value]
                n += 1
        self.components.append((entries[0], entries[1].upper(), members))

    def _kind(self, element_type: int, n_nodes: int) -> str:
        kind = _KINDS.get(self.kinds.get(element_type, -1), "")
        return _BY_NODES.get((kind, n_nodes), kind)

    def raw_mesh(self) -> RawMesh:
        """The mesh with components as sets; elements that are no part of a body are left out."""
        blocks: dict[str, list[list[int]]] = {}
        place: dict[int, tuple[str, int]] = {}
        for number, element_type, nodes in self.elements:
            kind = self._kind(element_type, len(nodes))
            if base_kind(kind) is None:
                continue
            rows = blocks.setdefault(kind, [])
            place[number] = kind, len(rows)
            try:
                rows.append([self.rows[node] for node in nodes])
            except KeyError as error:
                raise MeshError(
                    f"{self.path.name}: element {number} names node {error}, which the file lacks: "
                    f"{_AGAIN}."
                ) from error
        for kind, rows in blocks.items():
            if len({len(row) for row in rows}) > 1:
                raise MeshError(
                    f"{self.path.name}: {kind} elements have different numbers of nodes: {_AGAIN}."
                )
        arrays = {kind: np.array(rows, dtype=np.int64) for kind, rows in blocks.items()}
        sets: list[tuple[str, str, Ints]] = []
        point_sets: list[tuple[str, Ints]] = []
        for name, entity, members in self.components:
            if entity.startswith("NODE"):
                node_rows = [self.rows[m] for m in members if m in self.rows]
                point_sets.append((name, np.array(node_rows, dtype=np.int64)))
                continue
            for kind, rows_of_kind in arrays.items():
                element_rows = [place[m][1] for m in members if place.get(m, ("",))[0] == kind]
                if element_rows:
                    sets.append((kind, name, rows_of_kind[element_rows]))
        points = np.array(self.points, dtype=float).reshape(-1, 3)
        return RawMesh(points, list(arrays.items()), sets, point_sets)

    def uses(self) -> list[KeywordUse]:
        """What became of each command."""
        uses = []
        for name, (count, line) in self.counts.items():
            place = f"{self.path.name}, line {line}"
            is_setting = name in _SETTINGS or name == "settings"
            reason = _TAKEN.get(name, "a setting" if is_setting else _NOT_MESH)
            uses.append(KeywordUse(name, count, place, name in _TAKEN, reason, is_setting))
        left_out: dict[int, int] = {}
        for _, element_type, nodes in self.elements:
            if base_kind(self._kind(element_type, len(nodes))) is None:
                number = self.kinds.get(element_type, element_type)
                left_out[number] = left_out.get(number, 0) + 1
        place = f"{self.path.name}, line {self.counts.get('EBLOCK', [0, 1])[1]}"
        for number, count in left_out.items():
            words = f"{count} elements that are no part of the body"
            uses.append(KeywordUse(f"elements of type {number}", 1, place, False, words))
        return uses


def _is_load(entry: str) -> bool:
    """Whether an entry is a number other than zero."""
    try:
        return float(numbers_of_text(entry)) != 0
    except ValueError:
        return False


def _whole_entry(text: str, path: Path, line: int) -> int:
    try:
        return int(text)
    except ValueError:
        _refuse(path, line, f"{text.strip()!r:.40} is no whole number, where one stands: {_AGAIN}.")


def _refuse(path: Path, line: int, words: str) -> NoReturn:
    raise MeshError(f"{path.name}, line {line}: {words}")


__all__ = ["read_ansys"]
