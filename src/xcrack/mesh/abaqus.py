"""Abaqus and CalculiX decks: nodes, elements, sets and surfaces of parts and their instances.

meshio's reader has no plane strain elements, no surfaces and one part only.
"""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import MeshError
from xcrack.mesh.keywords import Keyword, KeywordUse, entries_of, keywords_of, numbers_of_text
from xcrack.mesh.linear import SHAPES, base_kind
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.raw import RawMesh, sets_to_write

_PLANE = r"(?:CPS|CPEG?|CG?AX|DC2D|DCAX|AC2D|STRI|S|DS|M3D|SFM3D|R3D|F3D)(\d)"
_SOLID = r"(?:C3D|DC3D|AC3D)(\d+)"
_LINE = r"(?:T2D2|T3D2|R2D2|RAX2|B21|B23|B31|B33|SAX1|DC1D2|F2D2)"
_LINE_3 = r"(?:T2D3|T3D3|B22|B32|SAX2|DC1D3)"
_PLANE_KIND = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8", "9": "quad9"}
_SOLID_KIND = {
    "4": "tetra", "5": "pyramid", "6": "wedge", "8": "hexahedron", "10": "tetra10",
    "13": "pyramid13", "15": "wedge15", "20": "hexahedron20", "27": "hexahedron27",
}  # fmt: skip
_NODES = {
    "line": 2, "line3": 3, "triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 9,
    "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8, "tetra10": 10, "pyramid13": 13,
    "wedge15": 15, "hexahedron20": 20, "hexahedron27": 27,
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

# What a mesh is made of.
MESH_KEYWORDS = {
    "NODE": "nodes", "ELEMENT": "elements", "NSET": "node sets", "ELSET": "element sets",
    "SURFACE": "surfaces", "PART": "parts", "END PART": "parts", "ASSEMBLY": "the assembly",
    "END ASSEMBLY": "the assembly", "INSTANCE": "instances of parts", "END INSTANCE": "instances",
}  # fmt: skip
# What changes neither the mesh nor a solution in static equilibrium.
OUTPUT_KEYWORDS = {
    **dict.fromkeys(
        ("HEADING", "PREPRINT", "COMMENT"), "words about the deck"
    ),
    **dict.fromkeys(
        ("OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "ENERGY OUTPUT",
         "SURFACE OUTPUT", "SECTION PRINT", "MODAL OUTPUT", "INCREMENTATION OUTPUT", "FILE FORMAT",
         "FILE OUTPUT", "NODE FILE", "NODE PRINT", "EL FILE", "EL PRINT", "ELEMENT FILE",
         "ENERGY FILE", "ENERGY PRINT", "CONTACT FILE", "CONTACT PRINT", "MONITOR", "PRINT",
         "RESTART", "SECTION FILE", "INTEGRATED OUTPUT", "INTEGRATED OUTPUT SECTION", "FILTER",
         "USER OUTPUT VARIABLES"),
        "what another program writes",
    ),
}  # fmt: skip
# What makes nodes or elements out of others: without it the mesh would be another one.
_MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "SUBSTRUCTURE GENERATE",
           "SUPER ELEMENT", "IMPORT", "ASSEMBLY COPY")  # fmt: skip


@dataclass(frozen=True, eq=False)
class NamedSet:
    """A set of nodes, elements or faces.

    Attributes
    ----------
    name : str
        As a user calls it.
    members : (k,) array of int
        Nodes (rows of the points) or elements; of a surface its elements.
    faces : (k,) array of int, optional
        Of a surface: number of the face of each element, from 0.
    """

    name: str
    members: Ints
    faces: Ints | None = None


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements of one keyword.

    Attributes
    ----------
    type : str
        Such as ``"C3D10"``.
    kind : str
        meshio's name; the type again where no body is made of it.
    first : int
        Number of its first element in the deck.
    nodes : (m, k) array of int
        Rows of the points; (m, 0) where no body is made of it.
    place : str
    """

    type: str
    kind: str
    first: int
    nodes: Ints
    place: str


@dataclass(frozen=True, eq=False)
class DeckLine:
    """A keyword with where it stands: in which instance ("" is the assembly), in which step."""

    keyword: Keyword
    instance: str
    step: int | None


@dataclass(frozen=True, eq=False)
class AbaqusModel:
    """A deck with its parts put together.

    Attributes
    ----------
    path : Path
    lines : tuple of DeckLine
        All keywords in their order, those of a part once for each of its instances.
    points : (n, 3) array, length
    nodes : dict of (instance, number) to int
        Row of each node among the points.
    elements : dict of (instance, number) to int
        Number of each element in the deck.
    groups : tuple of ElementGroup
    node_sets, element_sets, surfaces : dict of (instance, name in lower case) to NamedSet
    instances : tuple of str
    unused_parts : tuple of str
        Parts without an instance.
    """

    path: Path
    lines: tuple[DeckLine, ...]
    points: Floats
    nodes: dict[tuple[str, int], int]
    elements: dict[tuple[str, int], int]
    groups: tuple[ElementGroup, ...]
    node_sets: dict[tuple[str, str], NamedSet]
    element_sets: dict[tuple[str, str], NamedSet]
    surfaces: dict[tuple[str, str], NamedSet]
    instances: tuple[str, ...]
    unused_parts: tuple[str, ...]

    def nodes_of(self, entry: str, line: DeckLine, number: int | None = None) -> Ints:
        """Rows of the nodes that an entry names: a number, a set, or either of an instance."""
        return _members(entry, line, number, self.nodes, self.node_sets, "node", self.instances)

    def elements_of(self, entry: str, line: DeckLine, number: int | None = None) -> Ints:
        """Numbers of the elements that an entry names."""
        return _members(
            entry, line, number, self.elements, self.element_sets, "element", self.instances
        )

    def set_of(self, sets: str, name: str, instance: str) -> NamedSet | None:
        """A set by its name as it is written in an instance; None where there is none."""
        return _find(getattr(self, sets), name, instance, self.instances)

    def rows_of(self, elements: Ints) -> Iterator[tuple[ElementGroup, Ints]]:
        """Groups of elements and the rows of these among them."""
        elements = np.unique(elements)
        firsts = [group.first for group in self.groups]
        group_of = np.searchsorted(firsts, elements, side="right") - 1
        for number in np.unique(group_of):
            group = self.groups[number]
            yield group, elements[group_of == number] - group.first

    @property
    def dim(self) -> int:
        """Dimension of the body: that of its highest elements."""
        kinds = [base_kind(group.kind) for group in self.groups if len(group.nodes)]
        return max((SHAPES[base].dim for base in kinds if base is not None), default=0)

    def is_body(self, group: ElementGroup) -> bool:
        """Whether elements are part of the body."""
        base = base_kind(group.kind)
        return base is not None and SHAPES[base].dim == self.dim and len(group.nodes) > 0

    @property
    def body_groups(self) -> list[ElementGroup]:
        """Groups that the body is made of."""
        return [group for group in self.groups if self.is_body(group)]

    def facets_of(self, elements: Ints, faces: Ints) -> list[tuple[str, Ints]]:
        """Faces of elements as rows of corners, by kind."""
        result = []
        for face in np.unique(faces):
            for group, rows in self.rows_of(elements[faces == face]):
                face_corners = _FACES.get(base_kind(group.kind) or "", ())
                if self.is_body(group) and face < len(face_corners):
                    corners = face_corners[face]
                    result.append((_FACE_KIND[len(corners)], group.nodes[rows][:, corners]))
        return result

    def edge_of_middle_node(self) -> dict[int, tuple[int, int]]:
        """Corners at the ends of the edge in whose middle a node lies, by node."""
        edges: dict[int, tuple[int, int]] = {}
        for group in self.body_groups:
            shape = SHAPES[base_kind(group.kind) or ""]
            edge_ends = shape.edges
            middles = group.nodes[:, shape.corners : shape.corners + len(edge_ends)]
            for k in range(middles.shape[1]):
                i, j = edge_ends[k]
                edges.update(
                    zip(middles[:, k].tolist(), group.nodes[:, (i, j)].tolist(), strict=True)
                )
        return edges

    def raw_mesh(self, sets: Sequence[tuple[str, str, Ints]] = ()) -> RawMesh:
        """Blocks and sets of a mesh; further sets of facets or elements may be given.

        Parameters
        ----------
        sets : sequence of (kind, name, rows)
            As of `RawMesh`.
        """
        has_body = bool(self.body_groups)
        blocks = [
            (g.kind, g.nodes if base_kind(g.kind) else np.zeros((len(g.nodes), 1), np.int64))
            for g in self.groups
            if base_kind(g.kind) or not has_body
        ]
        set_entries: list[tuple[str, str, Ints]] = list(sets)
        for key, s in self.element_sets.items():
            name = self.shown_name(key, s)
            set_entries += [
                (group.kind, name, group.nodes[rows])
                for group, rows in self.rows_of(s.members)
                if base_kind(group.kind)
            ]
        for key, s in self.surfaces.items():
            name = self.shown_name(key, s)
            faces = np.zeros(0, np.int64) if s.faces is None else s.faces
            set_entries += [(kind, name, rows) for kind, rows in self.facets_of(s.members, faces)]
        point_sets = [(self.shown_name(key, s), s.members) for key, s in self.node_sets.items()]
        point_sets += [
            (self.shown_name(key, s), s.members)
            for key, s in self.surfaces.items()
            if s.faces is None
        ]
        return RawMesh(self.points, blocks, set_entries, point_sets)

    def shown_name(self, key: tuple[str, str], named_set: NamedSet) -> str:
        """Name of a set in the mesh: with its instance where there are several."""
        instance, name = key
        tables = (self.node_sets, self.element_sets, self.surfaces)
        if instance and (len(self.instances) > 1 or any(("", name) in sets for sets in tables)):
            return f"{instance}.{named_set.name}"
        return named_set.name

    def mesh_uses(self) -> list[KeywordUse]:
        """What the mesh was made of, keyword by keyword."""
        uses = []
        for name, words in MESH_KEYWORDS.items():
            lines = self.lines_of(name)
            if name == "ELEMENT":
                uses += self._element_uses()
            elif lines:
                uses.append(use_of(lines, True, words))
        uses += [
            KeywordUse("*PART without instance", 1, part, False, "it is no part of the body")
            for part in self.unused_parts
        ]
        return uses

    def lines_of(self, name: str) -> list[DeckLine]:
        """Where a keyword comes, once for a part with several instances."""
        first: dict[tuple[Path, int], DeckLine] = {}
        for line in self.lines:
            if line.keyword.name == name:
                first.setdefault((line.keyword.path, line.keyword.line), line)
        return list(first.values())

    def _element_uses(self) -> list[KeywordUse]:
        counts: dict[tuple[str, str, bool], tuple[int, str, int]] = {}
        for group in self.groups:
            key = (group.type, group.kind, self.is_body(group))
            n, place, count = counts.get(key, (0, group.place, 0))
            counts[key] = (n + len(group.nodes), place, count + 1)
        uses = []
        for (element, kind, is_body), (n, place, count) in counts.items():
            base = base_kind(kind)
            if is_body:
                words = f"{n} cells of the body"
            elif base is not None and SHAPES[base].dim == self.dim - 1:
                words = f"{n} elements on the body: its sets become facet sets"
            else:
                words = f"{n} elements that are no part of the body"
            is_used = is_body or (base is not None and SHAPES[base].dim == self.dim - 1)
            uses.append(KeywordUse(f"*ELEMENT, TYPE={element}", count, place, is_used, words))
        return uses


def use_of(lines: Sequence[DeckLine], is_used: bool, reason: str) -> KeywordUse:
    """A row of the table for all comings of a keyword."""
    keyword = lines[0].keyword
    is_harmless = not is_used and keyword.name in OUTPUT_KEYWORDS
    return KeywordUse(f"*{keyword.name}", len(lines), keyword.place, is_used, reason, is_harmless)


def read_abaqus(path: Path) -> tuple[RawMesh, list[KeywordUse]]:
    """Read nodes, elements, sets and element surfaces of an Abaqus input file.

    Parameters
    ----------
    path : Path
        The file; files that it includes are looked for beside it.

    Returns
    -------
    RawMesh
        Its contents. Sets keep the case of their first coming.
    list of KeywordUse
        What became of each of its keywords.

    Raises
    ------
    MeshError
        An element that names an unknown node, a line without numbers, a file that includes itself,
        with file and line.
    """
    model = read_model(path)
    names = dict.fromkeys(line.keyword.name for line in model.lines)
    other_groups = [
        use_of(model.lines_of(name), False, OUTPUT_KEYWORDS.get(name, "it is not of the mesh"))
        for name in names
        if name not in MESH_KEYWORDS
    ]
    return model.raw_mesh(), [*model.mesh_uses(), *other_groups]


def read_model(path: Path) -> AbaqusModel:
    """Read a deck and put its parts together.

    Raises
    ------
    MeshError
        As of `read_abaqus`.
    """
    lines, instances, unused_parts = _assemble_parts(keywords_of(path))
    builder = _Builder(instances)
    for line, place in lines:
        builder.take(line, place)
    groups = builder.groups()
    node_sets, element_sets = builder.sets(groups)
    points = np.array(builder.points, dtype=float).reshape(-1, 3)
    surfaces = builder.surfaces(element_sets, node_sets, groups)
    return AbaqusModel(
        path, tuple(line for line, _ in lines), points, builder.nodes, builder.elements,
        tuple(groups), node_sets, element_sets, surfaces, instances, unused_parts,
    )  # fmt: skip


Placing = Callable[[Floats], Floats] | None  # of points of an instance


def _assemble_parts(
    keywords: Iterable[Keyword],
) -> tuple[list[tuple[DeckLine, Placing]], tuple[str, ...], tuple[str, ...]]:
    """Keywords, those of parts where their instances stand; instances; parts without one."""
    parts: dict[str, tuple[Keyword, list[Keyword]]] = {}
    lines: list[tuple[DeckLine, Placing]] = []
    instances: dict[str, Keyword] = {}
    part: list[Keyword] | None = None
    instance, step, n_steps = "", None, 0
    placed_titles: set[str] = set()
    for keyword in keywords:
        name = keyword.name
        if name == "PART":
            title = keyword.option("NAME")
            if title.casefold() in parts:
                first = parts[title.casefold()][0].place
                keyword.refuse(
                    f"there is a part {title!r} already ({first}): give it another name."
                )
            part = []
            parts[title.casefold()] = keyword, part
        elif name == "END PART":
            if part is not None:
                part.append(keyword)
            part = None
        elif part is not None:
            part.append(keyword)
        elif name == "INSTANCE":
            instance = keyword.option("NAME")
            if instance.casefold() in map(str.casefold, instances):
                keyword.refuse(f"there is an instance {instance!r} already: give it another name.")
            instances[instance] = keyword
            lines.append((DeckLine(keyword, "", None), None))
            title = keyword.options.get("PART", "").casefold()
            if title and title not in parts:
                names = ", ".join(k.option("NAME") for k, _ in parts.values()) or "none"
                keyword.refuse(
                    f"the deck has no part {keyword.options['PART']!r} before this line; it has "
                    f"{names}."
                )
            placing = _placing(keyword)
            if title:
                placed_titles.add(title)
                begin, content = parts[title]
                lines.append((DeckLine(begin, instance, None), None))
                lines += [(DeckLine(line, instance, None), placing) for line in content]
        elif name == "END INSTANCE":
            lines.append((DeckLine(keyword, "", None), None))
            instance = ""
        else:
            if name == "STEP":
                n_steps += 1
                step = n_steps
            lines.append((DeckLine(keyword, instance, step), None))
            if name == "END STEP":
                step = None
    unplaced = [title for title in parts if title not in placed_titles]
    if not instances:  # a deck of parts without an assembly: each stands where it was made
        part_lines: list[tuple[DeckLine, Placing]] = []
        for begin, content in parts.values():
            title = begin.option("NAME") if len(parts) > 1 else ""
            part_lines += [(DeckLine(line, title, None), None) for line in (begin, *content)]
        titles = [begin.option("NAME") for begin, _ in parts.values()]
        return part_lines + lines, tuple(titles) if len(parts) > 1 else (), ()
    unused_places = tuple(parts[title][0].place for title in unplaced)
    return lines, tuple(instances), unused_places


def _placing(keyword: Keyword) -> Placing:
    """How an instance is moved: a translation, then a turn about an axis."""
    rows = [
        [keyword.number(entry, line, "a coordinate", 0.0) for entry in entries]
        for line, entries in keyword.rows
    ][:2]
    if not rows:
        return None
    shift = np.array([*rows[0], 0.0, 0.0, 0.0][:3])
    if len(rows) < 2:
        return lambda x: x + shift
    if len(rows[1]) < 7:
        keyword.refuse("a turn needs two points of its axis and an angle: seven numbers.")
    begin, end = np.array(rows[1][:3]), np.array(rows[1][3:6])
    axis = end - begin
    if not np.any(axis):
        keyword.refuse("the two points of the axis of its turn are one: give two.")
    axis = axis / np.linalg.norm(axis)
    angle = radians(rows[1][6])
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * cross.T + (1 - np.cos(angle)) * cross @ cross
    return lambda x: begin + (x + shift - begin) @ turn.T


class _Builder:
    """What the keywords of a mesh add up to, in their order."""

    def __init__(self, instances: Sequence[str]) -> None:
        self.instances = tuple(instances)
        self.points: list[list[float]] = []
        self.nodes: dict[tuple[str, int], int] = {}
        self.elements: dict[tuple[str, int], int] = {}
        self._groups: list[tuple[DeckLine, str, str, int, list[list[int]]]] = []
        self._n_elements = 0
        self._node_sets: list[tuple[DeckLine, str, list[int] | None]] = []
        self._element_sets: list[tuple[DeckLine, str, list[int] | None]] = []
        self._surfaces: list[DeckLine] = []

    def take(self, line: DeckLine, placing: Placing) -> None:
        keyword = line.keyword
        name = keyword.name
        if name in _MAKERS:
            keyword.refuse(
                "it makes nodes or elements out of others, which is not read: let Abaqus or "
                "CalculiX write the deck with all of them (a flat input file)."
            )
        if name == "NODE":
            self._take_nodes(line, placing)
        elif name == "ELEMENT":
            self._take_elements(line)
        elif name == "NSET":
            self._node_sets.append((line, keyword.option("NSET"), None))
        elif name == "ELSET":
            self._element_sets.append((line, keyword.option("ELSET"), None))
        elif name == "SURFACE":
            self._surfaces.append(line)

    def _take_nodes(self, line: DeckLine, placing: Placing) -> None:
        keyword = line.keyword
        labels, x = _node_rows(keyword)
        system = keyword.options.get("SYSTEM", "R").upper()
        if system == "C":  # cylindrical: radius, angle in degrees, height
            angle = np.radians(x[:, 1])
            x = np.stack([x[:, 0] * np.cos(angle), x[:, 0] * np.sin(angle), x[:, 2]], axis=1)
        elif system == "S":  # spherical: radius, longitude and latitude in degrees
            longitude, up = np.radians(x[:, 1]), np.radians(x[:, 2])
            radius = x[:, 0] * np.cos(up)
            x = np.stack(
                [radius * np.cos(longitude), radius * np.sin(longitude), x[:, 0] * np.sin(up)],
                axis=1,
            )
        elif system != "R":
            keyword.refuse(f"SYSTEM={system}: R, C and S are known.")
        if placing is not None:
            x = placing(x)
        members = []
        for label, place in zip(labels, x.tolist(), strict=True):
            row = self.nodes.setdefault((line.instance, label), len(self.points))
            if row == len(self.points):
                self.points.append(place)
            else:
                self.points[row] = place
            members.append(row)
        if "NSET" in keyword.options:
            self._node_sets.append((line, keyword.option("NSET"), members))

    def _take_elements(self, line: DeckLine) -> None:
        keyword = line.keyword
        element_type = keyword.option("TYPE").upper()
        kind = _kind(element_type)
        rows = _element_rows(keyword, kind)
        first = self._n_elements
        for n, row in enumerate(rows):
            key = (line.instance, row[0])
            if key in self.elements:
                keyword.refuse(f"there is an element {row[0]} already: give each its own number.")
            self.elements[key] = first + n
        self._n_elements += len(rows)
        self._groups.append((line, element_type, kind, first, [row[1:] for row in rows]))
        if "ELSET" in keyword.options:
            members = list(range(first, first + len(rows)))
            self._element_sets.append((line, keyword.option("ELSET"), members))

    def groups(self) -> list[ElementGroup]:
        """Elements with the rows of their nodes.

        Raises
        ------
        MeshError
            An element that names a node which the deck lacks.
        """
        result = []
        for line, element_type, kind, first, rows in self._groups:
            nodes = np.zeros((len(rows), 0), dtype=np.int64)
            if base_kind(kind) is not None:
                try:
                    nodes = np.array(
                        [[self.nodes[line.instance, label] for label in row] for row in rows],
                        dtype=np.int64,
                    ).reshape(len(rows), _NODES[kind])
                except KeyError as error:
                    label = error.args[0][1]
                    line.keyword.refuse(
                        f"element {self._owner_of(label, rows, first)} names node {label}, "
                        "which the deck lacks: give the whole deck, with the files that it "
                        "includes."
                    )
            result.append(ElementGroup(element_type, kind, first, nodes, line.keyword.place))
        return result

    def _owner_of(self, label: int, rows: list[list[int]], first: int) -> int:
        """Number of the first of some elements that names a node."""
        n = first + next(k for k, row in enumerate(rows) if label in row)
        return next(key[1] for key, number in self.elements.items() if number == n)

    def sets(
        self, groups: Sequence[ElementGroup]
    ) -> tuple[dict[tuple[str, str], NamedSet], dict[tuple[str, str], NamedSet]]:
        """Node sets and element sets."""
        elements = _SetTable("element", self.elements, self.instances)
        for line, name, members in self._element_sets:
            elements.add(line, name, members)
        nodes = _SetTable("node", self.nodes, self.instances)
        for line, name, members in self._node_sets:
            if members is None and "ELSET" in line.keyword.options:
                numbers = elements.members(line.keyword.options["ELSET"], line, None)
                rows = [g.nodes[numbers[(numbers >= g.first) & (numbers < g.first + len(g.nodes))]
                                - g.first].ravel() for g in groups]  # fmt: skip
                members = np.unique(np.concatenate([np.zeros(0, np.int64), *rows])).tolist()
            nodes.add(line, name, members)
        return nodes.set_by_key, elements.set_by_key

    def surfaces(
        self,
        element_sets: dict[tuple[str, str], NamedSet],
        node_sets: dict[tuple[str, str], NamedSet],
        groups: Sequence[ElementGroup],
    ) -> dict[tuple[str, str], NamedSet]:
        """Surfaces of element faces, and of nodes."""
        result: dict[tuple[str, str], NamedSet] = {}
        free_faces: set[tuple[int, int]] | None = None
        for line in self._surfaces:
            keyword = line.keyword
            name = keyword.option("NAME")
            scope = line.instance
            kind = keyword.options.get("TYPE", "ELEMENT").upper()
            if kind == "NODE":
                parts = [
                    _members(
                        entries[0], line, number, self.nodes, node_sets, "node", self.instances
                    )
                    for number, entries in keyword.rows
                ]
                members = np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
                result[scope, name.casefold()] = NamedSet(name, members)
                continue
            if kind != "ELEMENT" or "COMBINE" in keyword.options:
                continue  # the table names them
            owners: list[int] = []
            faces: list[int] = []
            for number, entries in keyword.rows:
                members = _members(
                    entries[0], line, number, self.elements, element_sets, "element", self.instances
                ).tolist()
                face = entries[1].upper() if len(entries) > 1 else ""
                if match := re.fullmatch(r"S([1-6])", face):
                    owners += members
                    faces += [int(match[1]) - 1] * len(members)
                elif not face:
                    if free_faces is None:
                        free_faces = _free_faces(groups)
                    member_set = set(members)
                    pairs = sorted(pair for pair in free_faces if pair[0] in member_set)
                    owners += [pair[0] for pair in pairs]
                    faces += [pair[1] for pair in pairs]
                elif face not in ("SPOS", "SNEG"):  # sides of a shell
                    keyword.refuse(
                        f"the face {face!r:.20} is not known: give one of S1 to S6.", number
                    )
            key = scope, name.casefold()
            entry = result.get(key)
            if entry is not None and entry.faces is not None:
                owners, faces = [*entry.members, *owners], [*entry.faces, *faces]
            result[key] = NamedSet(name, np.array(owners, np.int64), np.array(faces, np.int64))
        return result


class _SetTable:
    """Sets of nodes or elements by name; a set may name others that come before it."""

    def __init__(
        self, kind: str, numbers: dict[tuple[str, int], int], instances: tuple[str, ...]
    ) -> None:
        self.kind, self.numbers, self.instances = kind, numbers, instances
        self.set_by_key: dict[tuple[str, str], NamedSet] = {}

    def add(self, line: DeckLine, name: str, members: list[int] | None) -> None:
        keyword = line.keyword
        if members is None:
            parts = [np.zeros(0, np.int64)]
            for number, entries in keyword.rows:
                if "GENERATE" in keyword.options:
                    parts.append(self._generated_numbers(line, number, entries))
                else:
                    parts += [self.members(entry, line, number) for entry in entries if entry]
            members = np.concatenate(parts).tolist()
        key = (line.instance, name.casefold())
        earlier_set = self.set_by_key.get(key)
        earlier_members = [] if earlier_set is None else earlier_set.members.tolist()
        self.set_by_key[key] = NamedSet(
            name if earlier_set is None else earlier_set.name,
            np.array(list(dict.fromkeys([*earlier_members, *members])), dtype=np.int64),
        )

    def members(self, entry: str, line: DeckLine, number: int | None) -> Ints:
        return _members(
            entry, line, number, self.numbers, self.set_by_key, self.kind, self.instances
        )

    def _generated_numbers(self, line: DeckLine, number: int, entries: list[str]) -> Ints:
        keyword = line.keyword
        if len(entries) < 2:
            keyword.refuse("GENERATE needs a first and a last number, and a step if not 1.", number)
        first, end, *rest = (
            keyword.whole_number(entry, number, "a number") for entry in entries[:3]
        )
        step = rest[0] if rest else 1
        if not step or end - first > _MOST_MEMBERS * abs(step):
            words = f"GENERATE from {first} to {end} makes too many members: give those there are."
            keyword.refuse(words, number)
        scope = _instance_of(line, self.instances)
        labels = range(first, end + 1, step)
        rows = [self.numbers.get((scope, label), -1) for label in labels]
        return np.array([row for row in rows if row >= 0], dtype=np.int64)


def _instance_of(line: DeckLine, instances: Sequence[str]) -> str:
    """Instance whose numbers a keyword names."""
    name = line.keyword.options.get("INSTANCE", line.instance)
    return next(
        (instance for instance in instances if instance.casefold() == name.casefold()), name
    )


def _find(
    sets: dict[tuple[str, str], NamedSet], name: str, instance: str, instances: Sequence[str]
) -> NamedSet | None:
    """A set by name: that of the instance, of the one named before a dot, or of the only one."""
    title = name.strip('"').casefold()
    for scope in dict.fromkeys((instance, "")):
        if (scope, title) in sets:
            return sets[scope, title]
    first, dot, remainder = title.partition(".")
    if dot:
        for instance in instances:
            if instance.casefold() == first and (instance, remainder) in sets:
                return sets[instance, remainder]
    if len(instances) == 1:
        return sets.get((instances[0], title))
    return None


def _members(
    entry: str,
    line: DeckLine,
    number: int | None,
    numbers: dict[tuple[str, int], int],
    sets: dict[tuple[str, str], NamedSet],
    kind: str,
    instances: Sequence[str],
) -> Ints:
    """Rows that an entry names; an error where the deck has none of that name or number."""
    keyword = line.keyword
    scope = _instance_of(line, instances)
    first, dot, remainder = entry.partition(".")
    if dot and remainder.isdigit():
        scope = next(
            (instance for instance in instances if instance.casefold() == first.casefold()), first
        )
        entry = remainder
    if entry.isdigit():
        label = int(entry)
        for owner in dict.fromkeys((scope, *(instances if len(instances) == 1 else ()))):
            if (owner, label) in numbers:
                return np.array([numbers[owner, label]], dtype=np.int64)
        location = f" in instance {scope}" if scope else ""
        keyword.refuse(
            f"the deck has no {kind} {label}{location}: give the number of one that it has.", number
        )
    named_set = _find(sets, entry, scope, instances)
    if named_set is None:
        names = ", ".join(dict.fromkeys(entry_set.name for entry_set in sets.values()))
        keyword.refuse(
            f"the deck has no {kind} set {value_text(entry)} before this line; it has "
            f"{names or 'none'}: give one of them.", number
        )  # fmt: skip
    return named_set.members


def _free_faces(groups: Sequence[ElementGroup]) -> set[tuple[int, int]]:
    """Faces of the body that belong to one element only: number of the element, of the face."""
    rows: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    dims = [SHAPES[base].dim for g in groups if (base := base_kind(g.kind)) is not None]
    for group in groups:
        base = base_kind(group.kind)
        if base is None or SHAPES[base].dim != max(dims):
            continue
        for face, corners in enumerate(_FACES.get(base, ())):
            for n, key in enumerate(np.sort(group.nodes[:, corners], axis=1).tolist()):
                rows.setdefault(tuple(key), []).append((group.first + n, face))
    return {owners[0] for owners in rows.values() if len(owners) == 1}


def _node_rows(keyword: Keyword) -> tuple[list[int], Floats]:
    """Numbers and coordinates `(n, 3)` of nodes."""
    texts = [text for _, text in keyword.data]
    width = texts[0].count(",") if texts else 0
    if width in (2, 3) and all(text.count(",") == width for text in texts):
        table = _number_table(texts, width + 1)
        if len(table) and np.isfinite(table).all() and (table[:, 0] % 1 == 0).all():
            x = np.zeros((len(table), 3))
            x[:, :width] = table[:, 1:]
            return table[:, 0].astype(np.int64).tolist(), x
    labels, places = [], []
    for line, entries in keyword.rows:
        labels.append(keyword.whole_number(entries[0], line, "the number of a node"))
        coordinates = [keyword.number(entry, line, "a coordinate", 0.0) for entry in entries[1:4]]
        places.append([*coordinates, 0.0, 0.0, 0.0][:3])
    return labels, np.array(places, dtype=float).reshape(-1, 3)


def _number_table(texts: Sequence[str], width: int) -> Floats:
    """Rows of numbers that are all alike, taken at once; empty where they are not."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of numpy, about what is no number
        try:
            values = np.fromstring(numbers_of_text(",".join(texts)), sep=",")
        except (ValueError, DeprecationWarning):
            values = np.zeros(0)
    return values.reshape(-1, width) if len(values) == width * len(texts) else np.zeros((0, width))


def _element_rows(keyword: Keyword, kind: str) -> list[list[int]]:
    """Number and nodes of each element; long ones go on in the next line."""
    if kind not in _NODES:
        labels = []
        goes_on = False
        for line, text in keyword.data:
            if not goes_on:
                labels.append(
                    [keyword.whole_number(entries_of(text)[0], line, "the number of an element")]
                )
            goes_on = text.rstrip().endswith(",")
        return labels
    width = _NODES[kind] + 1
    numbers: list[int] = []
    for line, text in keyword.data:
        entries = [entry for entry in text.split(",") if entry.strip()]
        try:
            numbers += map(int, entries)
        except ValueError:
            for entry in entries:
                keyword.whole_number(entry.strip(), line, "the number of a node")
    if len(numbers) % width:
        keyword.refuse(
            f"{len(numbers)} numbers for elements of {width} each (a number and {width - 1} "
            "nodes): give the whole deck, or the type that the elements have."
        )
    return [numbers[i : i + width] for i in range(0, len(numbers), width)]


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
    third_coordinate = ", 0." * (3 - mesh.dim)
    facet_type, cell_type = _WRITTEN_TYPES[mesh.dim]
    lines = ["*HEADING", "mesh written by xcrack", "*NODE"]
    lines += [
        f"{i}, {', '.join(map(repr, x))}{third_coordinate}"
        for i, x in enumerate(mesh.points.tolist(), 1)
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


def _kind(element_type: str) -> str:
    """Name that meshio has for a type of element; the type itself where no body is made of it."""
    if solid := re.match(_SOLID, element_type):
        return _SOLID_KIND.get(solid.group(1), element_type)
    if re.match(_LINE_3, element_type):
        return "line3"
    if re.match(_LINE, element_type):
        return "line"
    if plane := re.match(_PLANE, element_type):
        return _PLANE_KIND.get(plane.group(1), element_type)
    return element_type
