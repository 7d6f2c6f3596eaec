"""Meshes of simplices: triangles in 2D, tetrahedra in 3D."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import combinations
from math import factorial
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints, frozen_copy, lock, row_stretches
from xcrack.base.checks import call_function, value_text, whole_numbers
from xcrack.base.errors import MeshError, ProblemError, warn
from xcrack.mesh.checks import checked_cells, checked_sets, mesh_doubts, unused_sets
from xcrack.mesh.curves import Curves, check_on_curves, checked_curves
from xcrack.mesh.distances import TriangleTree, triangle_tree

_CELLS = {2: "triangles", 3: "tetrahedra"}


@dataclass(frozen=True, eq=False)
class Mesh:
    """Simplices with sets by name; it never changes, whatever the crack does.

    Cells of negative orientation are turned. The facet set ``"boundary"`` always exists: all
    facets that belong to one cell only. A warning names doubled and hanging points, and cells that
    overlap.

    Parameters
    ----------
    points : (n, d) array, length
        Coordinates, d = 2 or 3. Every point must belong to a cell.
    cells : (m, d + 1) array of int
        Point numbers of each simplex.
    facet_sets : mapping of name to (k, d) array of int, optional
        Point numbers of the facets (edges in 2D, triangles in 3D) of each set.
    cell_sets : mapping of name to (k,) array of int, optional
        Cell numbers of each set.
    curves : mapping of name to callable, optional
        Of facet sets that stand for a curve or a curved surface: ``f(x) -> (n, d)`` returns its
        points nearest to the points x (n, d), which are close to it. `refine` puts new points
        there, and pictures show it. Generators, `mesh_step` and second-order meshes bring their
        own, which files hold; of functions of yours they hold none.

    Raises
    ------
    MeshError
        No cells, wrong shapes, nan coordinates, point numbers out of range, points without a
        cell, flat, doubled or inverted (folded) cells, facets that no cell has, a set
        ``"boundary"`` that is not the boundary, a curve far from the points of its set.

    Examples
    --------
    >>> mesh = Mesh([(0, 0), (1, 0), (0, 1)], [(0, 1, 2)])
    >>> mesh.volume
    array([0.5])
    """

    points: Floats
    cells: Ints
    facet_sets: Mapping[str, Ints] = field(default_factory=dict)
    cell_sets: Mapping[str, Ints] = field(default_factory=dict)
    # What is computed on a mesh does not know them; what refines describes them itself.
    curves: Curves = field(default_factory=dict, metadata={"changes_results": False})

    def __post_init__(self) -> None:
        self._complete_arrays()
        check_on_curves(self.points, self.facet_sets, self.curves)
        facet = np.nonzero(self.facet_to_cell[:, 1] < 0)[0]
        owner = self.facet_to_cell[facet, 0]
        for message in mesh_doubts(self.points, self.cells, self.facets[facet], owner):
            warn(message)
        object.__setattr__(self, "_is_new", True)

    def _complete_arrays(self) -> None:
        """Check what was given, and put read-only arrays in its place."""
        points, cells = checked_cells(self.points, self.cells)
        object.__setattr__(self, "points", frozen_copy(points))
        object.__setattr__(self, "cells", frozen_copy(cells))
        self._check_folds()
        facet_sets, cell_sets = checked_sets(
            self.facet_sets, self.cell_sets, self.n_points, len(cells), self.dim
        )
        for name, facets in facet_sets.items():
            self._check_facets(name, facets)
        frozen_sets = {name: frozen_copy(facets) for name, facets in facet_sets.items()}
        frozen_sets.setdefault("boundary", self.boundary)
        sets = {name: frozen_copy(members) for name, members in cell_sets.items()}
        object.__setattr__(self, "facet_sets", MappingProxyType(frozen_sets))
        object.__setattr__(self, "cell_sets", MappingProxyType(sets))
        curves = checked_curves(self.curves, self.facet_sets)
        object.__setattr__(self, "curves", MappingProxyType(curves))

    def __reduce__(self) -> tuple[Any, ...]:
        given_sets = {
            name: facets for name, facets in self.facet_sets.items() if name != "boundary"
        }
        named_parts = (dict(self.cell_sets), dict(self.curves))
        return sound_mesh, (self.points, self.cells, given_sets, *named_parts)

    def __repr__(self) -> str:
        names = ", ".join(self.facet_sets)
        if self.cell_sets:
            names += f", cell sets: {', '.join(self.cell_sets)}"
        cells = f"{len(self.cells)} {_CELLS[self.dim]}"
        return f"Mesh({self.n_points} points, {cells}, facet sets: {names})"

    @cached_property
    def dim(self) -> int:
        """Number of dimensions, 2 or 3."""
        return int(self.points.shape[1])

    @cached_property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.points)

    @cached_property
    def edges(self) -> Ints:
        """Point numbers of each edge, smaller first `(e, 2)`."""
        return self._edges_and_map[0]

    @cached_property
    def cell_to_edge(self) -> Ints:
        """Edge numbers of each cell, in the order of `local_edges(d)`, `(m, d (d + 1) / 2)`."""
        return self._edges_and_map[1]

    @cached_property
    def edge_middles(self) -> Floats:
        """Middle of each edge `(e, d)`, length."""
        return lock(np.asarray(self.points[self.edges].mean(axis=1)))

    @cached_property
    def edge_length(self) -> Floats:
        """Length of each edge `(e,)`."""
        x = self.points[self.edges]
        return lock(np.asarray(np.linalg.norm(x[:, 1] - x[:, 0], axis=1)))

    @cached_property
    def longest_edge(self) -> Floats:
        """Length of the longest edge at each point `(n,)`."""
        edge_length = np.zeros(self.n_points)
        for end in (0, 1):
            np.maximum.at(edge_length, self.edges[:, end], self.edge_length)
        return lock(edge_length)

    @cached_property
    def corners_and_edges(self) -> Ints:
        """Points of each cell, then its edges, numbered after all points `(m, n)`."""
        return lock(np.concatenate([self.cells, self.n_points + self.cell_to_edge], axis=1))

    @cached_property
    def _edges_and_map(self) -> tuple[Ints, Ints]:
        edge_ends = local_edges(self.dim)
        if self.facets.shape[1] == edge_ends.shape[1]:  # in 2D each edge is a facet
            return self.facets, lock(np.ascontiguousarray(self.cell_to_facet[:, ::-1]))
        key = np.empty((len(self.cells), len(edge_ends)), dtype=np.int64)
        for part in row_stretches(len(self.cells)):
            pairs = np.sort(self.cells[part][:, edge_ends], axis=2)
            key[part] = pairs[:, :, 0] * np.int64(self.n_points) + pairs[:, :, 1]
        edge_keys, inverse = np.unique(key, return_inverse=True)
        edges = np.stack([edge_keys // self.n_points, edge_keys % self.n_points], axis=1)
        return lock(edges), lock(inverse.reshape(len(self.cells), len(edge_ends)))

    @cached_property
    def _facets(self) -> tuple[Ints, Ints, Ints]:
        """Sorted facets `(f, d)`, their cells `(f, 2)` (-1: none), facet numbers `(m, d + 1)`."""
        d = self.dim
        corners = local_facets(d)
        key = np.empty((len(self.cells), d + 1), dtype=np.int64)
        for part in row_stretches(len(self.cells)):
            facets = np.sort(self.cells[part][:, corners], axis=2)
            key[part] = _scalar_key(facets.reshape(-1, d), self.n_points).reshape(-1, d + 1)
        facet_keys = key.ravel()
        order = np.argsort(facet_keys, kind="stable")
        facet_keys = facet_keys[order]
        is_begin = np.concatenate([[True], facet_keys[1:] != facet_keys[:-1]])
        begin = np.nonzero(is_begin)[0]
        counts = np.diff(np.append(begin, len(facet_keys)))
        first = order[begin]
        facet_corners = np.sort(
            self.cells[first[:, None] // (d + 1), corners[first % (d + 1)]], axis=1
        )
        if counts.max(initial=0) > 2:
            raise MeshError(
                f"facet {facet_corners[np.argmax(counts)].tolist()} belongs to {counts.max()} "
                "cells, at most two are possible: some cells are doubled or overlap; remove them."
            )
        number = key.reshape(-1)
        number[order] = np.cumsum(is_begin) - 1
        cells_of = np.full((len(first), 2), -1, dtype=np.int64)
        cells_of[:, 0] = first // (d + 1)
        is_inner = counts == 2
        cells_of[is_inner, 1] = order[begin[is_inner] + 1] // (d + 1)
        return lock(facet_corners), lock(cells_of), lock(key)

    @cached_property
    def facets(self) -> Ints:
        """Point numbers of every facet, sorted `(f, d)`."""
        return self._facets[0]

    @cached_property
    def facet_to_cell(self) -> Ints:
        """Cells on both sides of each facet `(f, 2)`; -1 where there is none."""
        return self._facets[1]

    @cached_property
    def cell_to_facet(self) -> Ints:
        """Facet numbers of each cell, opposite to its vertices 0 ... d, `(m, d + 1)`."""
        return self._facets[2]

    @cached_property
    def _facet_keys(self) -> Ints:
        """One number a facet, growing."""
        return lock(_scalar_key(self.facets, self.n_points))

    @cached_property
    def boundary(self) -> Ints:
        """Facets that belong to one cell only, as sorted point numbers `(k, d)`."""
        return lock(self.facets[self.facet_to_cell[:, 1] < 0])

    def _edge_matrices(self, part: slice) -> Floats:
        x = self.points[self.cells[part]]
        return x[:, 1:] - x[:, :1]

    @cached_property
    def volume(self) -> Floats:
        """Area or volume of each cell `(m,)`."""
        volume = np.empty(len(self.cells))
        for part in row_stretches(len(volume)):
            volume[part] = np.linalg.det(self._edge_matrices(part)) / factorial(self.dim)
        return lock(volume)

    @cached_property
    def gradient(self) -> Floats:
        """Gradients of the barycentric coordinates of each cell `(m, d + 1, d)`, 1/length."""
        gradient = np.empty((*self.cells.shape, self.dim))
        for part in row_stretches(len(gradient)):
            inverse = np.swapaxes(np.linalg.inv(self._edge_matrices(part)), 1, 2)
            gradient[part, 1:] = inverse
            gradient[part, 0] = -inverse.sum(axis=1)
        return lock(gradient)

    @cached_property
    def cell_size(self) -> Floats:
        """Longest edge of each cell `(m,)`, length."""
        size = np.zeros(len(self.cells))
        for part in row_stretches(len(size)):
            x = self.points[self.cells[part].T]
            for a, b in local_edges(self.dim):
                square = sum(v * v for v in (x[b] - x[a]).T)
                np.maximum(size[part], square, out=size[part])
        return lock(np.sqrt(size))

    @cached_property
    def cell_middles(self) -> Floats:
        """Centroid of each cell `(m, d)`, length."""
        middle = np.zeros((len(self.cells), self.dim))
        for corner in self.cells.T:
            middle += self.points[corner]
        return lock(middle / (self.dim + 1))

    @cached_property
    def extent(self) -> float:
        """Largest side of the box around the body, length."""
        return float(np.max(np.ptp(self.points, axis=0)))

    @cached_property
    def lower(self) -> Floats:
        """Lower corner of the box around the body, a cell's round-off farther out `(d,)`."""
        return lock(self.points.min(axis=0) - 1e-9 * self.extent)

    @cached_property
    def upper(self) -> Floats:
        """Upper corner of that box `(d,)`."""
        return lock(self.points.max(axis=0) + 1e-9 * self.extent)

    @cached_property
    def point_to_cell(self) -> tuple[Ints, Ints]:
        """Cells around each point as offsets `(n + 1,)` and cell numbers."""
        points = self.cells.ravel()
        order = np.argsort(points, kind="stable")
        counts = np.bincount(points, minlength=self.n_points)
        return lock(np.concatenate([[0], np.cumsum(counts)])), lock(order // (self.dim + 1))

    @cached_property
    def cell_tree(self) -> cKDTree:
        """Search tree of the centroids of the cells."""
        return cKDTree(self.cell_middles)

    @cached_property
    def cell_grid(self) -> tuple[tuple[Floats, Floats, Ints, Ints], Ints]:
        """Cells in the bins of a regular grid, and its shape.

        About as many bins as triangles, and a third as many as tetrahedra, whose boxes meet about
        twelve bins each then, and 22 where there are as many.
        """
        from xcrack.mesh.kernels.location import cells_in_bins

        body_box = np.stack([self.points.min(axis=0), self.points.max(axis=0)])
        side = np.maximum(body_box[1] - body_box[0], 1e-300)
        bins = 2 * len(self.cells) / factorial(self.dim)
        edge = (np.prod(side / side.max()) / bins) ** (1 / self.dim) * side.max()
        shape = np.clip(side / edge, 1, len(self.cells)).astype(np.int64)
        return cells_in_bins(self.points, self.cells, body_box, shape), shape

    @cached_property
    def boundary_tree(self) -> tuple[TriangleTree, Floats]:
        """In 3D: search tree of the boundary, its normals outward, and the size of its facets."""
        place = np.nonzero(self.facet_to_cell[:, 1] < 0)[0]
        cell = self.facet_to_cell[place, 0]
        facets = self.facets[place]
        corner = self.points[facets]
        # Barycentric coordinates decrease towards the facet opposite to their corner.
        corner_across = np.argmax(self.cell_to_facet[cell] == place[:, None], axis=1)
        inward_normal = self.gradient[cell, corner_across]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        is_turned = np.einsum("ij,ij->i", normal, inward_normal) > 0
        facets = np.where(is_turned[:, None], facets[:, ::-1], facets)
        size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
        return triangle_tree(self.points, facets), lock(size)

    def facet_numbers(self, facets: Ints) -> Ints:
        """Numbers (rows of `facets`) of the given facets `(k, d)`; -1 where there is none.

        Raises
        ------
        MeshError
            Not whole numbers of that shape.
        """
        facets = whole_numbers(facets, "facet_numbers: facets", (None, self.dim), error=MeshError)
        return numbers_of(self, facets)

    def with_cell_sets(self, cell_sets: Mapping[str, Any]) -> "Mesh":
        """The mesh with other cell sets, in place of those that it has.

        Parameters
        ----------
        cell_sets : mapping of str to (k,) array of int, or callable
            Cell numbers of each set, or f(x) -> (m,) bool of the centroids of all cells (m, d).

        Returns
        -------
        Mesh

        Raises
        ------
        MeshError
            No mapping of names, cells that there are not, or a function that returns something
            else than a flag for each cell.

        Examples
        --------
        >>> mesh = Mesh([(0, 0), (1, 0), (0, 1), (1, 1)], [(0, 1, 2), (1, 3, 2)])
        >>> mesh.with_cell_sets({"low": lambda x: x[:, 1] < 0.5}).cell_sets["low"].tolist()
        [0]
        """
        if not isinstance(cell_sets, Mapping):
            raise MeshError(
                f"with_cell_sets: {value_text(cell_sets)}: give a mapping of names to cell numbers."
            )
        middle = self.points[self.cells].mean(axis=1)
        sets = {}
        for name, members in cell_sets.items():
            if callable(members):
                label = f"with_cell_sets: the function of {value_text(name)}"
                flags = np.asarray(call_function(members, label, middle))
                if flags.shape != (len(middle),) or flags.dtype != bool:
                    raise MeshError(
                        f"{label} returned {flags.dtype} of shape {flags.shape}: return True or "
                        f"False for each of the {len(middle)} cells, as x[:, 0] < 1.0 does."
                    )
                members = np.nonzero(flags)[0]
            sets[name] = members
        given_sets = {name: f for name, f in self.facet_sets.items() if name != "boundary"}
        sets = checked_sets({}, sets, self.n_points, len(self.cells), self.dim)[1]
        return sound_mesh(self.points, self.cells, given_sets, sets, self.curves)

    def _check_folds(self) -> None:
        """Cells on both sides of a facet must lie on different sides of it.

        All have a positive volume here, so they do where they name its points in opposite turns:
        that takes no coordinates.
        """
        corners = local_facets(self.dim)
        is_odd = np.empty(self.cell_to_facet.shape, dtype=bool)
        for part in row_stretches(len(is_odd)):
            a, b, *c = self.cells[part].T[corners.T]
            is_turned = (a > b) ^ (a > c[0]) ^ (b > c[0]) if c else a > b
            is_turned[1::2] ^= True  # the corner across counts too
            is_odd[part] = is_turned.T
        balance = np.bincount(self.cell_to_facet.ravel(), is_odd.ravel(), len(self.facets))
        folded_facets = np.nonzero((balance != 1) & (self.facet_to_cell[:, 1] >= 0))[0]
        if len(folded_facets):
            neighbour, cell = self.facet_to_cell[folded_facets[0]].tolist()
            location = np.round(self.points[self.cells[cell]].mean(axis=0), 6).tolist()
            raise MeshError(
                f"cell {cell} at {location} is inverted: it folds over its neighbour {neighbour} "
                f"({len(folded_facets)} such pairs). Move its points back or remesh."
            )

    def _check_facets(self, name: str, facets: Ints) -> None:
        number = numbers_of(self, facets)
        if (number < 0).any():
            raise MeshError(
                f"facet set {value_text(name)}: facet {facets[np.argmax(number < 0)].tolist()} is "
                f"no facet of any cell ({int((number < 0).sum())} in all); mesh body and sets "
                "together."
            )
        if name != "boundary":
            return
        boundary = np.nonzero(self.facet_to_cell[:, 1] < 0)[0]
        if not np.array_equal(np.unique(number), boundary):
            raise MeshError(
                f'facet set "boundary" has {len(np.unique(number))} facets, the boundary of the '
                f"mesh has {len(boundary)}: that name means all facets of one cell only, and every "
                "mesh makes the set itself. Leave it out, or give yours another name."
            )


def sound_mesh(
    points: Floats,
    cells: Ints,
    facet_sets: Mapping[str, Ints] | None = None,
    cell_sets: Mapping[str, Ints] | None = None,
    curves: Curves | None = None,
) -> Mesh:
    """A mesh that conforms by its making, as those of generators: errors, but no doubts.

    Parameters
    ----------
    points, cells, facet_sets, cell_sets, curves
        As of `Mesh`.

    Returns
    -------
    Mesh
    """
    mesh = object.__new__(Mesh)
    for name, value in (
        ("points", points),
        ("cells", cells),
        ("facet_sets", facet_sets or {}),
        ("cell_sets", cell_sets or {}),
        ("curves", curves or {}),
    ):
        object.__setattr__(mesh, name, value)
    mesh._complete_arrays()
    return mesh


def warn_of_sets(mesh: Mesh) -> None:
    """Say once that cell sets of a user's mesh divide a body that is given one material."""
    if vars(mesh).get("_is_new"):  # a mesh of a generator, or one that was refined, has no new sets
        object.__setattr__(mesh, "_is_new", False)
        for message in unused_sets(mesh.cell_sets, len(mesh.cells)):
            warn(message)


def numbers_of(mesh: Mesh, facets: Ints) -> Ints:
    """`Mesh.facet_numbers` of facets that need no check."""
    facet_keys = mesh._facet_keys
    facet_rows = np.array(facets)
    facet_rows.sort(axis=1)
    facet_rows = _scalar_key(facet_rows, mesh.n_points)
    number = np.minimum(facet_keys.searchsorted(facet_rows), len(facet_keys) - 1)
    return np.where(facet_keys[number] == facet_rows, number, -1)


def _scalar_key(facets: Ints, n_points: int) -> Ints:
    key = facets[:, 0]
    for column in facets.T[1:]:
        key = key * np.int64(n_points) + column
    return key


@cache
def local_edges(dim: int) -> Ints:
    """Pairs of local vertex numbers of a simplex, `(d (d + 1) / 2, 2)`."""
    return lock(np.array(list(combinations(range(dim + 1), 2)), dtype=np.int64))


@cache
def local_facets(dim: int) -> Ints:
    """Local vertex numbers of the facet opposite to each vertex, `(d + 1, d)`."""
    vertices = range(dim + 1)
    return lock(np.array([[j for j in vertices if j != i] for i in vertices], dtype=np.int64))


# Named sets of facets, and the mesh point nearest to a place.


def facet_set(mesh: Mesh, name: str, label: str) -> Ints:
    """Facets of a set by name; an error lists the known names."""
    if name not in mesh.facet_sets:
        set_names = ", ".join(repr(n) for n in mesh.facet_sets)
        raise ProblemError(
            f"{label}: the mesh has no facet set {value_text(name)}; it has {set_names}."
        )
    return mesh.facet_sets[name]


def nearest_point(mesh: Mesh, x: Floats, label: str) -> int:
    """Number of the mesh point nearest to x; an error where x is not in or at the body."""
    if len(x) != mesh.dim:
        raise ProblemError(f"{label}: the point {x.tolist()} needs {mesh.dim} coordinates.")
    distance = np.linalg.norm(mesh.points - x, axis=1)
    number = int(np.argmin(distance))
    if distance[number] > mesh.cell_size.max():
        raise ProblemError(
            f"{label}: {x.tolist()} is {distance[number]:.4g} away from the nearest mesh point "
            f"{mesh.points[number].tolist()}: give a point of the body."
        )
    return number


def nearest_nodes(mesh: Mesh, x: Floats, label: str) -> Ints:
    """Numbers of the mesh points or middles of edges nearest to points `(k, d)`.

    The middle of edge e has the number ``n_points + e``. An error names the farthest point that is
    not in or at the body.
    """
    if x.shape[1] != mesh.dim:
        raise ProblemError(f"{label}: the points need {mesh.dim} coordinates, not {x.shape[1]}.")
    places = np.concatenate([mesh.points, mesh.edge_middles])
    distance, number = cKDTree(places).query(x)
    worst_point = int(np.argmax(distance))
    if distance[worst_point] > mesh.cell_size.max():
        raise ProblemError(
            f"{label}: {x[worst_point].tolist()} is {distance[worst_point]:.4g} away from the "
            f"nearest mesh point {places[number[worst_point]].tolist()}: give points of the body."
        )
    return np.asarray(number, dtype=np.int64)


def supported_nodes(mesh: Mesh, place: Floats, label: str) -> Ints:
    """Numbers of what a support at a point `(d,)` or at several `(k, d)` holds.

    Of a point it is the nearest mesh point, of several each may be the middle of an edge too, as of
    `nearest_nodes`.
    """
    if place.ndim == 1:
        return np.array([nearest_point(mesh, place, label)])
    return nearest_nodes(mesh, place, label)


__all__ = []
