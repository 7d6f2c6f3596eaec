"""Meshes of simplices: triangles in the plane, tetrahedra in space."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import factorial
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.arrays import Floats, Ints, frozen, lock
from xcrack.errors import MeshError

_FLAT = 1e-12  # a cell whose volume is below this share of (longest edge)^d has no shape
_CELLS = {2: "triangles", 3: "tetrahedra"}


@dataclass(frozen=True, eq=False)
class Mesh:
    """Simplices with sets by name; it never changes, whatever the crack does.

    Cells of negative orientation are turned. The facet set ``"boundary"`` always exists: where
    it is not given, it is made of the facets that belong to one cell only.

    Parameters
    ----------
    points : (n, d) array, length
        Coordinates, d = 2 or 3. Every point must belong to a cell.
    cells : (m, d + 1) array of int
        Point numbers of each simplex.
    facet_sets : mapping of name to (k, d) array of int, optional
        Point numbers of the facets (edges in the plane, triangles in space) of each set.
    cell_sets : mapping of name to (k,) array of int, optional
        Cell numbers of each set.

    Raises
    ------
    MeshError
        No cells, wrong shapes, nan coordinates, point numbers out of range, points without a
        cell, flat, doubled or inverted (folded) cells, facets that no cell has.

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

    def __post_init__(self) -> None:
        points, cells = _checked(self.points, self.cells)
        object.__setattr__(self, "points", frozen(points))
        object.__setattr__(self, "cells", frozen(_oriented(points, cells)))
        self._check_folds()
        d = points.shape[1]
        facet_sets = {
            str(name): frozen(np.asarray(facets, dtype=np.int64).reshape(-1, d))
            for name, facets in dict(self.facet_sets).items()
        }
        for name, facets in facet_sets.items():
            self._check_facets(name, facets)
        facet_sets.setdefault("boundary", self._boundary)
        cell_sets = {}
        for name, members in dict(self.cell_sets).items():
            members = np.asarray(members, dtype=np.int64).ravel()
            if len(members) and (members.min() < 0 or members.max() >= len(cells)):
                raise MeshError(
                    f"cell set {name!r} names cells beyond the {len(cells)} of the mesh; "
                    "cells are numbered from 0."
                )
            cell_sets[str(name)] = frozen(members)
        object.__setattr__(self, "facet_sets", MappingProxyType(facet_sets))
        object.__setattr__(self, "cell_sets", MappingProxyType(cell_sets))

    def __reduce__(self) -> tuple[Any, ...]:
        return Mesh, (self.points, self.cells, dict(self.facet_sets), dict(self.cell_sets))

    def __repr__(self) -> str:
        names = ", ".join(self.facet_sets)
        cells = f"{len(self.cells)} {_CELLS[self.dim]}"
        return f"Mesh({self.n_points} points, {cells}, facet sets: {names})"

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
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
    def _edges_and_map(self) -> tuple[Ints, Ints]:
        local = local_edges(self.dim)
        pairs = np.sort(self.cells[:, local].reshape(-1, 2), axis=1)
        key = pairs[:, 0] * np.int64(self.n_points) + pairs[:, 1]
        unique, inverse = np.unique(key, return_inverse=True)
        edges = np.stack([unique // self.n_points, unique % self.n_points], axis=1)
        return lock(edges), lock(inverse.reshape(len(self.cells), len(local)))

    @cached_property
    def _facets(self) -> tuple[Ints, Ints, Ints]:
        """Sorted facets `(f, d)`, their cells `(f, 2)` (-1: none), facet numbers `(m, d + 1)`."""
        d = self.dim
        local = local_facets(d)
        all_facets = np.sort(self.cells[:, local].reshape(-1, d), axis=1)
        _, first, inverse, counts = np.unique(
            _scalar_key(all_facets, self.n_points),
            return_index=True,
            return_inverse=True,
            return_counts=True,
        )
        if counts.max(initial=0) > 2:
            bad = all_facets[first[np.argmax(counts)]]
            raise MeshError(
                f"facet {bad.tolist()} belongs to {counts.max()} cells, at most two are possible: "
                "some cells are doubled or overlap; remove them."
            )
        cells_of = np.full((len(first), 2), -1, dtype=np.int64)
        order = np.argsort(inverse, kind="stable")
        owner = order // (d + 1)
        begin = np.concatenate([[0], np.cumsum(counts)[:-1]])
        cells_of[:, 0] = owner[begin]
        two = counts == 2
        cells_of[two, 1] = owner[begin[two] + 1]
        return lock(all_facets[first]), lock(cells_of), lock(inverse.reshape(-1, d + 1))

    @property
    def facets(self) -> Ints:
        """Point numbers of every facet, sorted `(f, d)`."""
        return self._facets[0]

    @property
    def facet_to_cell(self) -> Ints:
        """Cells on both sides of each facet `(f, 2)`; -1 where there is none."""
        return self._facets[1]

    @property
    def cell_to_facet(self) -> Ints:
        """Facet numbers of each cell, opposite to its vertices 0 ... d, `(m, d + 1)`."""
        return self._facets[2]

    @cached_property
    def _facet_keys(self) -> Ints:
        """One number a facet, growing."""
        return lock(_scalar_key(self.facets, self.n_points))

    @cached_property
    def _boundary(self) -> Ints:
        return lock(self.facets[self.facet_to_cell[:, 1] < 0])

    @cached_property
    def _edge_matrices(self) -> Floats:
        x = self.points[self.cells]
        return x[:, 1:] - x[:, :1]

    @cached_property
    def volume(self) -> Floats:
        """Area or volume of each cell `(m,)`."""
        return lock(np.linalg.det(self._edge_matrices) / factorial(self.dim))

    @cached_property
    def gradient(self) -> Floats:
        """Gradients of the barycentric coordinates of each cell `(m, d + 1, d)`, 1/length."""
        inverse = np.linalg.inv(self._edge_matrices)
        last = np.swapaxes(inverse, 1, 2)
        return lock(np.concatenate([-last.sum(axis=1, keepdims=True), last], axis=1))

    @cached_property
    def cell_size(self) -> Floats:
        """Longest edge of each cell `(m,)`, length."""
        x = self.points[self.edges]
        length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        return lock(length[self.cell_to_edge].max(axis=1))

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
        flat = self.cells.ravel()
        order = np.argsort(flat, kind="stable")
        counts = np.bincount(flat, minlength=self.n_points)
        return lock(np.concatenate([[0], np.cumsum(counts)])), lock(order // (self.dim + 1))

    @cached_property
    def cell_tree(self) -> cKDTree:
        """Search tree of the centroids of the cells."""
        return cKDTree(self.points[self.cells].mean(axis=1))

    @cached_property
    def cell_classes(self) -> tuple[tuple[Ints, cKDTree, float], ...]:
        """Cells of like size: their numbers, a search tree of centroids, the largest size.

        One class where sizes differ by less than four: in a graded mesh a search that reaches as
        far as the largest cell would look at thousands of small ones.
        """
        size = self.cell_size
        if size.max() < 4 * size.min():
            return ((np.arange(len(size)), self.cell_tree, float(size.max())),)
        step = np.floor(np.log2(size / size.min())).astype(np.int64)
        centre = self.points[self.cells].mean(axis=1)
        rows = [np.nonzero(step == k)[0] for k in np.unique(step)]
        return tuple((r, cKDTree(centre[r]), float(size[r].max())) for r in rows)

    @cached_property
    def boundary_tree(self) -> cKDTree:
        """Search tree of the centroids of the boundary facets."""
        return cKDTree(self.points[self.facet_sets["boundary"]].mean(axis=1))

    def facet_numbers(self, facets: Ints) -> Ints:
        """Numbers (rows of `facets`) of the given facets `(k, d)`; -1 where there is none."""
        known = self._facet_keys
        asked = _scalar_key(np.sort(np.asarray(facets, dtype=np.int64), axis=1), self.n_points)
        number = np.minimum(np.searchsorted(known, asked), len(known) - 1)
        return np.where(known[number] == asked, number, -1)

    def _check_folds(self) -> None:
        """Cells on both sides of a facet must lie on different sides of it."""
        inner = self.facet_to_cell[:, 1] >= 0
        one, other = self.facet_to_cell[inner].T
        place = np.argmax(self.cell_to_facet[one] == np.nonzero(inner)[0][:, None], axis=1)
        across = np.argmax(self.cell_to_facet[other] == np.nonzero(inner)[0][:, None], axis=1)
        corner = self.points[self.cells[other, across]] - self.points[self.cells[one, place]]
        # The barycentric coordinate is 1 at the cell's own corner, 0 on the facet.
        coordinate = 1 + np.einsum("fd,fd->f", self.gradient[one, place], corner)
        folded = coordinate >= 0
        if folded.any():
            i = int(np.argmax(folded))
            where = np.round(self.points[self.cells[other[i]]].mean(axis=0), 6).tolist()
            raise MeshError(
                f"cell {int(other[i])} at {where} is inverted: it folds over its neighbour "
                f"{int(one[i])} ({int(folded.sum())} such pairs). Move its points back or remesh."
            )

    def _check_facets(self, name: str, facets: Ints) -> None:
        if not len(facets):
            return
        if facets.min() < 0 or facets.max() >= self.n_points:
            raise MeshError(
                f"facet set {name!r} names points beyond the {self.n_points} of the mesh; "
                "points are numbered from 0."
            )
        missing = self.facet_numbers(facets) < 0
        if missing.any():
            raise MeshError(
                f"facet set {name!r}: facet {facets[np.argmax(missing)].tolist()} is no facet of "
                f"any cell ({int(missing.sum())} in all); mesh body and sets together."
            )


def _scalar_key(facets: Ints, n_points: int) -> Ints:
    key = facets[:, 0].astype(np.int64)
    for column in facets.T[1:]:
        key = key * np.int64(n_points) + column
    return key


def _checked(points: ArrayLike, cells: ArrayLike) -> tuple[Floats, Ints]:
    x = np.asarray(points, dtype=np.float64)
    c = np.asarray(cells)
    if c.size == 0:
        raise MeshError(
            "the mesh has no cells: give triangles (plane) or tetrahedra (space); in gmsh, mesh "
            "the surface or volume and put it into a physical group."
        )
    if x.ndim != 2 or x.shape[1] not in (2, 3):
        raise MeshError(f"points must be (n, 2) or (n, 3), not {x.shape}.")
    if c.ndim != 2 or c.shape[1] != x.shape[1] + 1:
        raise MeshError(
            f"cells must be (m, {x.shape[1] + 1}) for points in {x.shape[1]} dimensions, "
            f"not {c.shape}: only triangles in the plane and tetrahedra in space are used."
        )
    c = c.astype(np.int64)
    bad = ~np.isfinite(x).all(axis=1)
    if bad.any():
        raise MeshError(
            f"point {int(np.argmax(bad))} has coordinates {x[np.argmax(bad)].tolist()} "
            f"({int(bad.sum())} such points): every coordinate must be finite."
        )
    if c.min() < 0 or c.max() >= len(x):
        raise MeshError(
            f"cell {int(np.argmax(((c < 0) | (c >= len(x))).any(axis=1)))} names a point outside "
            f"0 ... {len(x) - 1}."
        )
    unused = np.bincount(c.ravel(), minlength=len(x)) == 0
    if unused.any():
        raise MeshError(
            f"point {int(np.argmax(unused))} belongs to no cell ({int(unused.sum())} such "
            "points): remove them (read_mesh does)."
        )
    doubled = np.sort(c, axis=1)
    order = np.lexsort(doubled.T)
    same = (np.diff(doubled[order], axis=0) == 0).all(axis=1)
    if same.any():
        raise MeshError(
            f"cells {int(order[np.argmax(same)])} and {int(order[np.argmax(same) + 1])} have the "
            f"same points ({int(same.sum())} such pairs): remove one of each."
        )
    return x, c


def _oriented(points: Floats, cells: Ints) -> Ints:
    x = points[cells]
    volume = np.linalg.det(x[:, 1:] - x[:, :1])
    one, other = local_edges(points.shape[1]).T
    longest = np.sqrt(((x[:, one] - x[:, other]) ** 2).sum(axis=2).max(axis=1))
    flat = np.abs(volume) <= _FLAT * longest ** points.shape[1]
    if flat.any():
        worst = int(np.argmax(flat))
        raise MeshError(
            f"cell {worst} at {np.round(x[worst].mean(axis=0), 6).tolist()} has no volume "
            f"({int(flat.sum())} such cells): remesh, or merge its points."
        )
    turned = np.array(cells)
    turned[volume < 0] = turned[volume < 0][:, [1, 0, *range(2, cells.shape[1])]]
    return turned


def local_edges(dim: int) -> Ints:
    """Pairs of local vertex numbers of a simplex, `(d (d + 1) / 2, 2)`."""
    return np.array(list(combinations(range(dim + 1), 2)), dtype=np.int64)


def local_facets(dim: int) -> Ints:
    """Local vertex numbers of the facet opposite to each vertex, `(d + 1, d)`."""
    every = range(dim + 1)
    return np.array([[j for j in every if j != i] for i in every], dtype=np.int64)
