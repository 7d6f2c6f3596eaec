"""Abaqus input files: meshio's reader has no plane strain elements and no surfaces."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import MeshError
from xcrack.mesh.linear import base_kind
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.raw import RawMesh, sets_to_write

_PLANE = r"(?:CPS|CPEG?|CG?AX|DC2D|DCAX|AC2D|STRI|S|DS|M3D|SFM3D|R3D|F3D)(\d)"
_SOLID = r"(?:C3D|DC3D|AC3D)(\d+)"
_LINE = r"(?:T2D2|T3D2|R2D2|RAX2|B21|B23|B31|B33|SAX1|DC1D2|F2D2)"
_LINE_3 = r"(?:T2D3|T3D3|B22|B32|SAX2|DC1D3)"
_PLANE_KIND = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8", "9": "quad9"}
_SOLID_KIND = {
    "4": "tetra", "5": "pyramid", "6": "wedge", "8": "hexahedron", "10": "tetra10",
    "15": "wedge15", "20": "hexahedron20",
}  # fmt: skip
_NODES = {
    "line": 2, "line3": 3, "triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 9,
    "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8, "tetra10": 10, "wedge15": 15,
    "hexahedron20": 20,
}  # fmt: skip
# Faces S1, S2, ... of an element, as local node numbers (Abaqus manual, element library).
_FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "hexahedron": (
        (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0),
    ),
}  # fmt: skip
_WRITTEN_TYPES = {2: ("T3D2", "CPS3"), 3: ("S3", "C3D4")}  # facets, cells
_FACE_KIND = {2: "line", 3: "triangle", 4: "quad"}  # by corners
_MOST_MEMBERS = 10_000_000  # that one line of GENERATE makes
_DEEPEST = 100  # files that include each other

Section = tuple[str, dict[str, str], list[list[str]]]


def read_abaqus(path: Path) -> RawMesh:
    """Read nodes, elements, sets and element surfaces of an Abaqus input file.

    Parameters
    ----------
    path : Path
        The file; files that it includes are looked for beside it.

    Returns
    -------
    RawMesh
        Its contents. Sets keep the case of their first coming.

    Raises
    ------
    MeshError
        Several parts, an element that names an unknown node, a line without numbers, a file that
        includes itself.
    """
    nodes: dict[int, list[float]] = {}
    elements: dict[int, tuple[str, list[int]]] = {}
    element_sets: dict[str, list[int]] = {}
    point_sets: dict[str, list[int]] = {}
    faces: dict[str, list[tuple[str, str]]] = {}
    parts = 0
    for keyword, options, rows in _sections(path):
        try:
            if keyword == "NODE":
                nodes.update((int(r[0]), [float(v or 0) for v in r[1:4]]) for r in rows)
            elif keyword == "ELEMENT":
                kind = _kind(options.get("TYPE", ""))
                new = {e[0]: (kind, e[1:]) for e in _elements(kind, rows)}
                elements.update(new)
                if "ELSET" in options:
                    _collect(element_sets, options["ELSET"], new)
            elif keyword == "ELSET":
                _collect(element_sets, options["ELSET"], _members(options, rows, element_sets))
            elif keyword == "NSET":
                _collect(point_sets, options["NSET"], _members(options, rows, point_sets))
            elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
                pairs = [(r[0], r[1].upper()) for r in rows if len(r) > 1]
                faces.setdefault(options["NAME"], []).extend(pairs)
            parts += keyword == "PART"
        except (ValueError, KeyError, IndexError) as error:
            raise MeshError(f"{path.name}: cannot read a *{keyword} section ({error}).") from error
    if parts > 1:
        raise MeshError(
            f"{path.name} has {parts} parts, whose node numbers clash: merge them into one part "
            "and write the input file anew."
        )
    return _raw(path.name, nodes, elements, element_sets, point_sets, faces)


def abaqus_text(mesh: Mesh) -> str:
    """A mesh as Abaqus input: cells as CPS3 or C3D4, facets of sets as T3D2 or S3.

    Parameters
    ----------
    mesh : Mesh
        What to write; its sets become ``*ELSET``.

    Returns
    -------
    str

    Raises
    ------
    MeshError
        A name of a set with a comma, a line break or space at an end.
    """
    facet_sets, cell_sets = sets_to_write(mesh)
    for name in (*facet_sets, *cell_sets):
        if not name or "," in name or "\n" in name or name != name.strip():
            raise MeshError(
                f"set name {value_text(name)}: Abaqus files take no commas or line breaks."
            )
    numbers = {name: mesh.facet_numbers(facets) for name, facets in facet_sets.items()}
    rows = np.unique(np.concatenate([np.zeros(0, np.int64), *numbers.values()]))
    flat = ", 0." * (3 - mesh.dim)
    facet_type, cell_type = _WRITTEN_TYPES[mesh.dim]
    lines = ["*HEADING", "mesh written by xcrack", "*NODE"]
    lines += [
        f"{i}, {', '.join(map(repr, x))}{flat}" for i, x in enumerate(mesh.points.tolist(), 1)
    ]
    if len(rows):
        lines += [f"*ELEMENT, TYPE={facet_type}", *_rows(mesh.facets[rows], 1)]
    lines += [f"*ELEMENT, TYPE={cell_type}", *_rows(mesh.cells, 1 + len(rows))]
    for name in dict.fromkeys([*facet_sets, *cell_sets]):
        members = np.concatenate(
            [
                1 + np.searchsorted(rows, numbers.get(name, np.zeros(0, np.int64))),
                1 + len(rows) + np.asarray(cell_sets.get(name, []), dtype=np.int64),
            ]
        ).tolist()
        lines.append(f"*ELSET, ELSET={name}")
        lines += [", ".join(map(str, members[i : i + 16])) for i in range(0, len(members), 16)]
    return "\n".join(lines) + "\n"


def _rows(elements: Ints, first: int) -> Iterable[str]:
    for i, row in enumerate((elements + 1).tolist(), first):
        yield f"{i}, {', '.join(map(str, row))}"


def _sections(path: Path, outer: tuple[Path, ...] = ()) -> Iterator[Section]:
    """Keyword, options and data rows of each section, included files in their place."""
    if len(outer) > _DEEPEST:
        raise MeshError(
            f"{path.name} is included by {len(outer)} files, one in the other: join some of them."
        )
    resolved_path = path.resolve()
    if resolved_path in outer:
        raise MeshError(f"{path.name} includes itself: leave that *INCLUDE out.")
    keyword = ""
    options: dict[str, str] = {}
    rows: list[list[str]] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            rows.append([entry.strip() for entry in text.rstrip(",").split(",")])
            continue
        if keyword:
            yield keyword, options, rows
        head, *entries = text[1:].split(",")
        keyword, rows = head.strip().upper(), []
        pairs = (entry.partition("=") for entry in entries)
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        if keyword == "INCLUDE" and "INPUT" in options:
            inner = path.parent / options["INPUT"]
            if not inner.is_file():
                raise MeshError(f"{path.name} includes {str(inner)!r}, which does not exist.")
            yield from _sections(inner, (*outer, resolved_path))
    if keyword:
        yield keyword, options, rows


def _kind(element_type: str) -> str:
    name = element_type.upper()
    if solid := re.match(_SOLID, name):
        return _SOLID_KIND.get(solid.group(1), element_type)
    if re.match(_LINE_3, name):
        return "line3"
    if re.match(_LINE, name):
        return "line"
    if plane := re.match(_PLANE, name):
        return _PLANE_KIND.get(plane.group(1), element_type)
    return element_type or "element without TYPE"


def _elements(kind: str, rows: list[list[str]]) -> list[list[int]]:
    if kind not in _NODES:
        return [[int(v) for v in row if v] for row in rows]
    # Long elements go on in the next line, so count entries, not lines.
    flat = [int(v) for row in rows for v in row if v]
    width = _NODES[kind] + 1
    if len(flat) % width:
        raise ValueError(f"{len(flat)} numbers for elements of {width} each")
    return [flat[i : i + width] for i in range(0, len(flat), width)]


def _find(sets: dict[str, list[int]], name: str) -> str:
    return next((set_name for set_name in sets if set_name.casefold() == name.casefold()), name)


def _collect(sets: dict[str, list[int]], name: str, members: Iterable[int]) -> None:
    sets.setdefault(_find(sets, name), []).extend(members)


def _members(
    options: dict[str, str], rows: list[list[str]], sets: dict[str, list[int]]
) -> list[int]:
    if "GENERATE" in options:
        members: list[int] = []
        for row in rows:
            first, last, step = (*map(int, row), 1)[:3]
            numbers = range(first, last + 1, step)
            if last - first > _MOST_MEMBERS * abs(step):
                raise ValueError(f"GENERATE from {first} to {last} makes too many members")
            members += numbers
        return members
    members = []
    for entry in (entry for row in rows for entry in row if entry):
        members += [int(entry)] if entry.isdigit() else sets.get(_find(sets, entry), [])
    return members


def _raw(
    source: str,
    nodes: dict[int, list[float]],
    elements: dict[int, tuple[str, list[int]]],
    element_sets: dict[str, list[int]],
    point_sets: dict[str, list[int]],
    faces: dict[str, list[tuple[str, str]]],
) -> RawMesh:
    points: Floats = np.zeros((len(nodes), 3))
    for i, x in enumerate(nodes.values()):
        points[i, : len(x)] = x
    number = {node: i for i, node in enumerate(nodes)}

    def by_kind(members: Iterable[int]) -> Iterator[tuple[str, Ints]]:
        kinds: dict[str, list[list[int]]] = {}
        for member in dict.fromkeys(members):
            if member in elements:
                kind, corners = elements[member]
                kinds.setdefault(kind, []).append(corners)
        for kind, rows in kinds.items():
            if base_kind(kind) is not None:
                try:
                    yield kind, np.array([[number[node] for node in row] for row in rows])
                except KeyError as error:
                    raise MeshError(
                        f"{source}: an element names node {error}, which the file lacks."
                    ) from error
            else:
                yield kind, np.zeros((len(rows), 1), dtype=np.int64)

    blocks = list(by_kind(elements))
    sets = [
        (kind, name, rows)
        for name, members in element_sets.items()
        for kind, rows in by_kind(members)
    ]
    for name, pairs in faces.items():
        for where, face in pairs:
            if not re.fullmatch(r"S\d", face):
                continue  # SPOS, SNEG: sides of a shell
            element_rows = element_sets.get(_find(element_sets, where), [])
            for kind, rows in by_kind([int(where)] if where.isdigit() else element_rows):
                local = _FACES.get(base_kind(kind) or "", ())
                if 1 <= int(face[1]) <= len(local):
                    corners = local[int(face[1]) - 1]
                    sets.append((_FACE_KIND[len(corners)], name, rows[:, corners]))
    rows_of = [
        (name, np.array([number[n] for n in members if n in number], dtype=np.int64))
        for name, members in point_sets.items()
    ]
    return RawMesh(points, blocks, sets, rows_of)
