"""Body of a deck: its mesh, its materials, and where nodes and elements of the deck are in it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.errors import MeshError, ProblemError, warn
from xcrack.mesh.abaqus import MESH_KEYWORDS, AbaqusModel
from xcrack.mesh.fields import CellField, Field
from xcrack.mesh.files import with_stored_curves
from xcrack.mesh.keywords import Keyword
from xcrack.mesh.linear import linear_mesh
from xcrack.mesh.mesh import Mesh, nearest_nodes, numbers_of, sound_mesh
from xcrack.mesh.raw import RawMesh, mesh_parts, with_curved_edges
from xcrack.model.deck_state import SpreadLoad
from xcrack.model.material import Graded, Isotropic, Material

_PROPERTIES = ("ELASTIC", "EXPANSION", "DENSITY", "PLASTIC")
_EQUAL = 1e-9  # relative: values this close are one
# Edges of a cell in the order of Field, by the ends.
_EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])


def _zero(x: Floats) -> Floats:
    return np.zeros(len(x))


@dataclass(frozen=True, eq=False)
class DeckMaterial:
    """A material as a deck has it.

    Attributes
    ----------
    name, place : str
    elastic : (k, 3) array
        Rows of E, nu and temperature.
    expansion : (k, 2) array
        Rows of the secant coefficient of expansion from the temperature `zero`, and temperature.
    zero, density : float
    yield_stress : float or None
    """

    name: str
    place: str
    elastic_rows: Floats
    expansion: Floats
    zero: float
    density: float
    yield_stress: float | None

    def strain(self, T: Floats, T_0: Floats) -> Floats:
        """Thermal strain from temperatures T_0 to T."""
        alpha, at = self.expansion[np.argsort(self.expansion[:, 1])].T
        parts = [np.interp(t, at, alpha) * (t - self.zero) for t in (T, T_0)]
        return np.asarray(parts[0] - parts[1])

    def elastic_at(self, plane: str | None, T: Floats, field: Any, alpha: Any) -> Material:
        """Elastic constants at the temperatures of its elements.

        Parameters
        ----------
        plane : str or None
        T : (k,) array
            Temperatures of its nodes.
        field : callable
            Temperature at points.
        alpha : float, callable or None
            Coefficient of expansion.

        Raises
        ------
        ProblemError
            It has none.
        """
        if not len(self.elastic_rows):
            raise ProblemError(
                f"{self.place}: *MATERIAL {self.name!r} has no *ELASTIC: give E and nu."
            )
        E, nu, at = self.elastic_rows[np.argsort(self.elastic_rows[:, 2])].T
        is_variable = np.ptp(T) > _EQUAL * max(float(np.abs(T).max()), 1.0)
        if not callable(alpha) and not (len(self.elastic_rows) > 1 and is_variable):
            E_of_body, nu_of_body = (float(np.interp(T[0], at, v)) for v in (E, nu))
            return Isotropic(E_of_body, nu_of_body, plane, self.yield_stress, alpha=alpha)
        nu_0, nu_1 = np.interp([T.min(), T.max()], at, nu)
        if abs(nu_1 - nu_0) > _EQUAL:
            warn(
                f"{self.place}: Poisson's ratio of *MATERIAL {self.name!r} goes from {nu_0:g} to "
                f"{nu_1:g} with the temperature of the body: it is taken as {(nu_0 + nu_1) / 2:g}."
            )
        modulus = OfTemperature(field, tuple(at.tolist()), tuple(E.tolist()))
        return Graded(modulus, float((nu_0 + nu_1) / 2), plane, self.yield_stress, alpha=alpha)


@dataclass(frozen=True)
class OfTemperature:
    """A table over the temperature, with the temperature of the place."""

    field: Any
    temperatures: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, x: Floats) -> Floats:
        """Values at points `(q,)`; beyond its ends that of the end."""
        return np.asarray(np.interp(self.field(x), self.temperatures, self.values))


@dataclass(frozen=True)
class MeanExpansion:
    """Mean coefficient of expansion between two temperatures of the place, from a secant table."""

    field: Any
    initial_field: Any
    material: DeckMaterial

    def __call__(self, x: Floats) -> Floats:
        """At points `(q,)`."""
        T, T_0 = self.field(x), self.initial_field(x)
        change = T - T_0
        is_small = np.abs(change) <= _EQUAL * np.maximum(np.abs(T), 1.0)
        T = np.where(is_small, T_0 + 1e-3, T)
        return np.asarray(self.material.strain(T, T_0) / np.where(is_small, 1e-3, change))


class DeckBody:
    """Mesh and materials of a deck.

    Parameters
    ----------
    model : AbaqusModel
    loads : sequence of SpreadLoad
        Those on faces get facet sets, those on volumes sets of cells.
    parts : mapping of name to (k,) array of int
        Further sets of elements whose cells are asked for.

    Attributes
    ----------
    raw_mesh : RawMesh
    mesh : Mesh
        With the facet sets of deck and loads.
    dim : int
    plane : str or None
    thickness : float
        Of a 2D body.
    materials : dict of DeckMaterial by name in lower case
    sections : dict of (k,) arrays of int
        Elements of each material.
    """

    def __init__(
        self, model: AbaqusModel, loads: list[SpreadLoad], parts: Mapping[str, Ints]
    ) -> None:
        self.model = model
        if not model.body_groups:
            raise MeshError(
                f"{model.path.name} has no triangles, quadrilaterals, tetrahedra, pyramids, prisms "
                "or hexahedra of which a body could be made: export the elements too."
            )
        self.dim, self.plane, self.thickness = model.dim, _plane_state(model), 1.0
        self.materials = _materials(model)
        self.sections = self._sections()
        facets = [
            (kind, self.facet_name(load), rows)
            for load in loads
            for elements, faces in zip(load.elements, load.faces, strict=True)
            for kind, rows in model.facets_of(elements, faces)
        ]
        parts = {**parts, **{f"material {key}": rows for key, rows in self.sections.items()}}
        cells = [
            (group.kind, f"\0{name}", group.nodes[rows])
            for name, elements in parts.items()
            for group, rows in model.rows_of(elements)
            if model.is_body(group)
        ]
        source = model.path.name
        self.raw_mesh: RawMesh = model.raw_mesh([*facets, *cells])
        linear_raw = linear_mesh(self.raw_mesh, source, strict=False)
        points, simplices, facet_sets, self._cell_sets, self._number = mesh_parts(
            linear_raw, source
        )
        mesh = Mesh(points, simplices, facet_sets)
        mesh = with_curved_edges(mesh, linear_raw, self._number)
        self.mesh = with_stored_curves(mesh, model.path)
        ends = model.edge_of_middle_node()
        self._ends = np.full((len(model.points), 2), -1, dtype=np.int64)
        if ends:
            self._ends[list(ends)] = list(ends.values())

    # --- materials

    def _sections(self) -> dict[str, Ints]:
        groups = self.model.body_groups
        all_rows = np.concatenate([group.first + np.arange(len(group.nodes)) for group in groups])
        members: dict[str, list[Ints]] = {}
        thicknesses: set[float] = set()
        for line in self.model.lines:
            keyword = line.keyword
            if keyword.name != "SOLID SECTION":
                continue
            if "COMPOSITE" in keyword.options:
                keyword.refuse("composite sections are not modelled.", error=ProblemError)
            name = keyword.option("MATERIAL")
            if name.casefold() not in self.materials:
                names = ", ".join(m.name for m in self.materials.values()) or "none"
                keyword.refuse(
                    f"the deck has no *MATERIAL {name!r}; it has {names}.", error=ProblemError
                )
            elements = self.model.elements_of(keyword.option("ELSET"), line)
            members.setdefault(name.casefold(), []).append(np.intersect1d(elements, all_rows))
            if self.dim == 2:
                row = next((keyword.number(r[0], k, "", 1.0) for k, r in keyword.rows), 1.0)
                thicknesses.add(row or 1.0)
        if len(thicknesses) > 1:
            words = ", ".join(f"{t:g}" for t in sorted(thicknesses))
            raise ProblemError(
                f"{self.model.path.name}: the sections have the thicknesses {words}: a 2D body has "
                "one."
            )
        self.thickness = thicknesses.pop() if thicknesses else 1.0
        sections = {name: np.unique(np.concatenate(rows)) for name, rows in members.items()}
        sections = {name: rows for name, rows in sections.items() if len(rows)}
        n_missing = len(np.setdiff1d(all_rows, np.concatenate([all_rows[:0], *sections.values()])))
        if sections and n_missing:
            raise ProblemError(
                f"{self.model.path.name}: {n_missing} of {len(all_rows)} elements have no *SOLID "
                "SECTION: give them a material."
            )
        if not sections and len(self.materials) == 1:
            return {name: all_rows for name in self.materials}
        return sections

    def material(self, T: Floats, T_0: Floats) -> Material | dict[str, Material] | None:
        """The material at temperatures of the nodes, or several by name.

        Those of a body of several have an expansion, of the temperatures T_0 to T.
        """
        field = self.function_of(T, "temperature")
        by_name: dict[str, Material] = {}
        for key in self.sections:
            m, rows = self.materials[key], self.nodes_of_material(key)
            alpha: Any = None
            if len(self.sections) > 1 and not np.array_equal(T, T_0):
                alpha = m.expansion[0, 0] if len(m.expansion) else 0.0
                if len(m.expansion) > 1:
                    alpha = MeanExpansion(field, self.function_of(T_0, "temperature"), m)
            by_name[m.name] = m.elastic_at(self.plane, T[rows], field, alpha)
        return by_name if len(set(by_name.values())) > 1 else next(iter(by_name.values()), None)

    def function_of(self, values: Floats, name: str) -> Any:
        """`point_field`, a function also where the value is one."""
        field = self.point_field(values, name)
        return field if callable(field) else OfTemperature(_zero, (0.0,), (field,))

    def nodes_of_material(self, key: str) -> Ints:
        """Nodes of the elements of a material."""
        rows = self.model.rows_of(self.sections[key])
        return np.unique(np.concatenate([group.nodes[k].ravel() for group, k in rows]))

    @cached_property
    def density(self) -> Floats:
        """Density of each cell; nan where it is not given `(m,)`."""
        density = np.full(len(self.mesh.cells), np.nan)
        for key in self.sections:
            density[self.cells(f"material {key}")] = self.materials[key].density or np.nan
        return density

    # --- where nodes and elements are

    def facet_name(self, load: SpreadLoad) -> str:
        """Name of the facet set of a load on faces."""
        if load.line.keyword.name == "DSLOAD":
            return load.target
        face = f" S{load.faces[0][0] + 1}" if len(load.faces[0]) else ""
        return f"{load.target or f'{load.line.keyword.name} line {load.line.keyword.line}'}{face}"

    def cells(self, name: str) -> Ints:
        """Cells of one of the `parts`, or of a material."""
        return self._cell_sets.get(f"\0{name}", np.zeros(0, np.int64))

    def cells_beside(self, kind: str, corners: Ints) -> Ints:
        """Cells behind faces of elements, given by the nodes of their corners."""
        choices: dict[str, list[tuple[int, ...]]] = {"line": [(0, 1)], "triangle": [(0, 1, 2)]}
        quad: list[tuple[int, ...]] = [(0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3)]  # two are facets
        vertices = np.concatenate([corners[:, c] for c in choices.get(kind, quad)])
        facet = numbers_of(self.mesh, self._number[vertices])
        return np.asarray(self.mesh.facet_to_cell[facet[facet >= 0], 0])

    def is_inside(self, rows: Ints) -> Any:
        """Which nodes are corners of the body or middles of its edges `(k,)`."""
        return (self._number[rows] >= 0) | (self._ends[rows, 0] >= 0)

    def nodes(self, rows: Ints) -> Ints:
        """Numbers of nodes of the deck in the mesh: points, middles of edges after all points."""
        number = self._number[rows].copy()
        is_middle = number < 0
        if is_middle.any():
            x = self.mesh.points[self._number[self._ends[rows[is_middle]]]].mean(axis=1)
            number[is_middle] = nearest_nodes(self.mesh, x, self.model.path.name)
        return number

    @cached_property
    def places(self) -> Floats:
        """Mesh points, then the middles of edges `(n, d)`."""
        return np.concatenate([self.mesh.points, self.mesh.edge_middles])

    @cached_property
    def is_bare(self) -> Any:
        """Which middles of edges, numbered after all points, are no nodes of the deck `(n,)`."""
        is_bare = np.ones(len(self.places), dtype=bool)
        is_bare[: self.mesh.n_points] = False
        is_bare[self.nodes(np.nonzero(self._ends[:, 0] >= 0)[0])] = False
        return is_bare

    def edges_of(self, facets: Ints) -> Ints:
        """Numbers of the edges of facets, after all points `(k, 1 or 3)`."""
        pairs = [(0, 1)] if self.dim == 2 else [(0, 1), (0, 2), (1, 2)]
        return self._edge_numbers(facets[:, pairs].reshape(-1, 2)).reshape(-1, len(pairs))

    def _edge_numbers(self, ends: Ints) -> Ints:
        """Numbers of edges by their ends, after all points `(k,)`."""
        mesh = self.mesh
        keys = mesh.edges @ [mesh.n_points, 1]
        order = np.argsort(keys)
        keys_of_edges = np.sort(ends, axis=1) @ [mesh.n_points, 1]
        return np.asarray(mesh.n_points + order[np.searchsorted(keys, keys_of_edges, sorter=order)])

    # --- values over it

    def cell_field(self, values: Floats, name: str) -> Any:
        """The value of the cells where it is one, else a field."""
        if (values == values[0]).all():
            return values[0]
        return CellField(self.mesh, lock(values), f"{name} of {self.model.path.name}")

    def node_field(self, numbers: Ints, values: Floats, name: str) -> Field:
        """Field of the second order with values at some mesh points and middles of edges."""
        mesh = sound_mesh(self.mesh.points, self.mesh.cells)
        at_nodes = np.zeros(len(self.places))
        at_nodes[numbers] = values
        ends = at_nodes[mesh.edges].mean(axis=1)
        at_nodes[mesh.n_points :] = np.where(
            self.is_bare[mesh.n_points :], ends, at_nodes[mesh.n_points :]
        )
        pairs = _EDGES[_EDGES.max(axis=1) <= self.dim]
        corners = mesh.cells[:, pairs].reshape(-1, 2)
        middles = self._edge_numbers(corners).reshape(len(mesh.cells), -1)
        nodes = np.concatenate([mesh.cells, middles], axis=1)
        return Field(mesh, lock(nodes), lock(at_nodes), f"{name} of {self.model.path.name}")

    def point_field(self, values: Floats, name: str) -> Any:
        """The value of the nodes where it is one, else a linear field.

        Points that were added in the middle of cells get the mean of those around.
        """
        mesh = self.mesh
        result = np.full(mesh.n_points, np.nan)
        rows = np.nonzero(self._number[: len(values)] >= 0)[0]
        result[self._number[rows]] = values[rows]
        for point in np.nonzero(np.isnan(result))[0].tolist():
            neighbours = np.unique(mesh.cells[(mesh.cells == point).any(axis=1)])
            result[point] = np.nanmean(result[neighbours])
        if np.ptp(result) <= _EQUAL * np.abs(result).max():
            return float(result[0])
        straight_mesh = sound_mesh(mesh.points, mesh.cells)
        return Field(
            straight_mesh, straight_mesh.cells, lock(result), f"{name} of {self.model.path.name}"
        )

    def finished_mesh(self, more_facets: Mapping[str, Ints]) -> Mesh:
        """The mesh with further facet sets, and with cell sets of deck and materials."""
        cell_sets = {n: rows for n, rows in self._cell_sets.items() if not n.startswith("\0")}
        if len(self.sections) > 1:
            cell_sets |= {
                self.materials[key].name: self.cells(f"material {key}") for key in self.sections
            }
        facet_sets = {n: f for n, f in self.mesh.facet_sets.items() if n != "boundary"}
        return sound_mesh(
            self.mesh.points, self.mesh.cells, {**facet_sets, **more_facets}, cell_sets
        )

    def facets_within(self, numbers: Ints) -> Ints:
        """Facets of the boundary all of whose nodes are among these `(k, d)`."""
        is_inside = np.zeros(len(self.places), dtype=bool)
        is_inside[numbers] = True
        facets = self.mesh.boundary
        facets = facets[is_inside[facets].all(axis=1)]
        if len(facets):
            edges = self.edges_of(facets)
            facets = facets[(is_inside[edges] | self.is_bare[edges]).all(axis=1)]
        return facets

    def name_of_facets(self, facets: Ints, names: Iterable[tuple[str, Ints]]) -> str:
        """Name of the first facet set that has these facets; empty where none has."""
        facet_numbers = np.unique(numbers_of(self.mesh, facets))
        for name, members in names:
            if np.array_equal(np.unique(numbers_of(self.mesh, members)), facet_numbers):
                return name
        return ""


def _plane_state(model: AbaqusModel) -> str | None:
    """State of a plane body by the types of its elements."""
    planes: dict[str, str] = {}
    for group in model.body_groups if model.dim == 2 else ():
        plane = {"CPS": "stress", "CPE": "strain"}.get(group.type[:3], "")
        if not plane:
            raise ProblemError(
                f"{group.place}: *ELEMENT, TYPE={group.type}: in 2D elements of plane strain (CPE) "
                "and of plane stress (CPS) are known. read_mesh reads the mesh alone."
            )
        planes[plane] = group.place
    if len(planes) > 1:
        raise ProblemError(
            f"{planes['stress']} has elements of plane stress, {planes['strain']} of plane strain: "
            "a body is of one plane state."
        )
    return next(iter(planes), None)


def _materials(model: AbaqusModel) -> dict[str, DeckMaterial]:
    by_name: dict[str, dict[str, Keyword]] = {}
    keywords_of_material: dict[str, Keyword] = {}
    for line in model.lines:
        keyword = line.keyword
        if keyword.name == "MATERIAL":
            keywords_of_material = by_name.setdefault(keyword.option("NAME").casefold(), {})
            keywords_of_material["MATERIAL"] = keyword
        elif keyword.name in _PROPERTIES:
            keywords_of_material[keyword.name] = keyword
        elif keyword.name in MESH_KEYWORDS or keyword.name == "SOLID SECTION":
            keywords_of_material = {}
    return {name: _material(parts) for name, parts in by_name.items()}


def _material(parts: dict[str, Keyword]) -> DeckMaterial:
    head = parts["MATERIAL"]
    for name in ("ELASTIC", "EXPANSION"):
        kind = parts[name].options.get("TYPE", "ISO").upper() if name in parts else "ISO"
        if not kind.startswith("ISO"):
            parts[name].refuse(
                f"TYPE={kind}: the material depends on the direction, and only isotropic ones are "
                "modelled: give isotropic constants.", error=ProblemError
            )  # fmt: skip
    zero = 0.0
    if expansion := parts.get("EXPANSION"):
        zero = expansion.number(expansion.options.get("ZERO", ""), expansion.line, "ZERO", 0.0)
    rows = {name: _columns(parts[name], 3) if name in parts else np.zeros((0, 3))
            for name in _PROPERTIES}  # fmt: skip
    density, plastic_rows = rows["DENSITY"], rows["PLASTIC"]
    yield_stress = (
        float(plastic_rows[0, 0]) if len(plastic_rows) and plastic_rows[0, 0] > 0 else None
    )
    return DeckMaterial(
        head.option("NAME"), head.place, rows["ELASTIC"], rows["EXPANSION"][:, :2], zero,
        float(density[0, 0]) if len(density) else 0.0, yield_stress,
    )  # fmt: skip


def _columns(keyword: Keyword, width: int) -> Floats:
    """Rows of numbers, those that are left out as zero."""
    rows = [
        [*(keyword.number(e, line, "a number", 0.0) for e in row[:width]), *[0.0] * width][:width]
        for line, row in keyword.rows
    ]
    if not rows:
        keyword.refuse("its data line is missing: give it.", error=ProblemError)
    return np.array(rows)


__all__ = ["DeckBody", "DeckMaterial"]
