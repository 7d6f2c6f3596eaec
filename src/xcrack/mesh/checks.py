"""Checks of what a mesh is made of: errors where it cannot be used, doubts where it may mislead."""

import re
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints, at, ranges, row_stretches
from xcrack.base.checks import numbers, point_coordinates, value_text, whole_numbers
from xcrack.base.errors import MeshError
from xcrack.mesh.distances import distance_to_simplices

_FLAT = 1e-12  # a cell whose volume is below this share of (longest edge)^d has no shape
_SAME = 1e-6  # of a facet: points this close to each other, or to a facet, are on each other
_INSIDE = 1e-3  # barycentric: a point this deep in a cell is in it, whatever the round-off
# Names that programs make: `read_mesh` for groups without a name, gmsh for surfaces and volumes in
# Abaqus files, Abaqus for faces and picked elements.
_UNNAMED = re.compile(r"cells_\d+|(Physical)?(Surface|Volume)\d+|_.*")
_AT_ONCE = 200_000  # pairs of points and cells looked at together


def checked_cells(points: Any, cells: Any) -> tuple[Floats, Ints]:
    """Points and cells of a mesh as arrays, the cells turned to positive orientation.

    Parameters
    ----------
    points, cells : anything

    Returns
    -------
    points : (n, d) array, length
    cells : (m, d + 1) array of int

    Raises
    ------
    MeshError
        Whatever keeps them from being a mesh; the message names the first such point or cell.
    """
    x = numbers(points, "points of the mesh", must_be_finite=False, error=MeshError)
    c = whole_numbers(cells, "cells of the mesh", error=MeshError)
    if c.size == 0:
        raise MeshError(
            "the mesh has no cells: give triangles (2D) or tetrahedra (3D); in gmsh, mesh the "
            "surface or volume and put it into a physical group."
        )
    if x.ndim != 2 or x.shape[1] not in (2, 3):
        raise MeshError(f"points must be (n, 2) or (n, 3), not {x.shape}.")
    if c.ndim != 2 or c.shape[1] != x.shape[1] + 1:
        raise MeshError(
            f"cells must be (m, {x.shape[1] + 1}) for points with {x.shape[1]} coordinates, "
            f"not {c.shape}: only triangles in 2D and tetrahedra in 3D are used."
        )
    is_infinite = ~np.isfinite(x).all(axis=1)
    if is_infinite.any():
        raise MeshError(
            f"point {int(np.argmax(is_infinite))} has coordinates "
            f"{x[np.argmax(is_infinite)].tolist()} ({int(is_infinite.sum())} such points): every "
            f"coordinate must be finite."
        )
    point_coordinates(x, "points of the mesh", x.shape)
    if c.min() < 0 or c.max() >= len(x):
        raise MeshError(
            f"cell {int(np.argmax(((c < 0) | (c >= len(x))).any(axis=1)))} names a point outside "
            f"0 ... {len(x) - 1}: points are numbered from 0."
        )
    is_unused = np.bincount(c.ravel(), minlength=len(x)) == 0
    if is_unused.any():
        raise MeshError(
            f"point {int(np.argmax(is_unused))} belongs to no cell ({int(is_unused.sum())} such "
            "points): remove them (read_mesh does)."
        )
    sorted_cells = np.sort(c, axis=1)
    order = np.lexsort(sorted_cells.T)
    is_repeated = (np.diff(sorted_cells[order], axis=0) == 0).all(axis=1)
    if is_repeated.any():
        raise MeshError(
            f"cells {int(order[np.argmax(is_repeated)])} and "
            f"{int(order[np.argmax(is_repeated) + 1])} have the same points "
            f"({int(is_repeated.sum())} such pairs): remove one of each."
        )
    return x, _oriented_cells(x, c)


def _oriented_cells(points: Floats, cells: Ints) -> Ints:
    start, end = np.array(list(combinations(range(cells.shape[1]), 2))).T
    volume, longest_edge = np.empty(len(cells)), np.empty(len(cells))
    for part in row_stretches(len(cells)):
        x = points[cells[part]]
        with np.errstate(all="ignore"):  # lengths whose products are too small for a number
            volume[part] = np.linalg.det(x[:, 1:] - x[:, :1])
        longest_edge[part] = np.sqrt(((x[:, start] - x[:, end]) ** 2).sum(axis=2).max(axis=1))
    is_flat = np.abs(volume) <= _FLAT * longest_edge ** points.shape[1]
    if is_flat.any():
        worst_cell = int(np.argmax(is_flat))
        raise MeshError(
            f"cell {worst_cell} at {at(points[cells[worst_cell]].mean(axis=0))} has no volume "
            f"({int(is_flat.sum())} such cells): remesh, or merge its points."
        )
    cells_turned = np.array(cells)
    cells_turned[volume < 0] = cells_turned[volume < 0][:, [1, 0, *range(2, cells.shape[1])]]
    return cells_turned


def checked_sets(
    facet_sets: Any, cell_sets: Any, n_points: int, n_cells: int, dim: int
) -> tuple[dict[str, Ints], dict[str, Ints]]:
    """Sets of a mesh as arrays.

    Parameters
    ----------
    facet_sets, cell_sets : anything
    n_points, n_cells, dim : int
        Of the mesh.

    Raises
    ------
    MeshError
        Not mappings from names to arrays of the right shape, or numbers out of range.
    """
    for label, sets in (("facet_sets", facet_sets), ("cell_sets", cell_sets)):
        if not isinstance(sets, Mapping) or not all(isinstance(name, str) for name in sets):
            raise MeshError(
                f"{label}: give a dict of names and arrays, such as {label}={{'left': ...}}, not "
                f"{type(sets).__name__}{' with other keys' * isinstance(sets, Mapping)}."
            )
    facets, cells = {}, {}
    for name, members in facet_sets.items():
        label = f"facet set {value_text(name)}"
        array = whole_numbers(members, label, error=MeshError)
        facets[name] = (
            whole_numbers(array, label, (None, dim), error=MeshError)
            if array.size
            else np.zeros((0, dim), dtype=np.int64)
        )
        if array.size and (array.min() < 0 or array.max() >= n_points):
            raise MeshError(
                f"{label} names points beyond the {n_points} of the mesh; points are numbered "
                "from 0."
            )
    for name, members in cell_sets.items():
        label = f"cell set {value_text(name)}"
        array = whole_numbers(members, label, (None,), error=MeshError)
        if array.size and (array.min() < 0 or array.max() >= n_cells):
            raise MeshError(
                f"{label} names cells beyond the {n_cells} of the mesh; cells are numbered from 0."
            )
        cells[name] = array
    return facets, cells


def mesh_doubts(points: Floats, cells: Ints, facets: Ints, owner: Ints) -> list[str]:
    """Why a mesh may not be the body it looks like: doubled points, hanging ones, overlaps.

    Parameters
    ----------
    points, cells : arrays
        Of the mesh.
    facets : (k, d) array of int
        Facets that belong to one cell only: whatever is not joined has such facets.
    owner : (k,) array of int
        Cell of each.

    Returns
    -------
    list of str
        Messages with place, number and remedy; none for a sound mesh.
    """
    number = np.unique(facets)
    corner = points[facets]
    size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    smallest_distance = np.zeros(len(points))
    for column in facets.T:
        np.maximum.at(smallest_distance, column, size)
    messages = []
    tree = cKDTree(points)
    distance, partner = tree.query(points[number], k=2)
    twin = distance[:, 1] <= _SAME * smallest_distance[number]
    if twin.any():
        i = int(np.argmax(twin))
        pair = sorted(
            map(int, (number[i], partner[i, 1] if partner[i, 0] == number[i] else partner[i, 0]))
        )
        messages.append(
            f"points {pair[0]} and {pair[1]} of the mesh both lie at {at(points[number[i]])} "
            f"({int(twin.sum())} points have such a twin): cells are not joined there, which acts "
            "as a cut, or bodies lie on top of each other. Merge the points (gmsh: Coherence, or "
            "removeDuplicateNodes), unless the cut is meant."
        )
    messages += _hanging_points(points, facets, owner, number[~twin], corner, size)
    messages += _overlapping_cells(points, cells, owner, corner)
    return messages


def _hanging_points(
    points: Floats, facets: Ints, owner: Ints, number: Ints, corner: Floats, size: Floats
) -> list[str]:
    """Points that lie on a facet of a cell without being one of its points."""
    middle = corner.mean(axis=1)
    reach = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
    row, candidate = pairs_within(cKDTree(points[number]), middle, reach + _SAME * size)
    candidate = number[candidate]
    is_own_facet = (facets[row] == candidate[:, None]).any(axis=1)
    row, candidate = row[~is_own_facet], candidate[~is_own_facet]
    x = points[candidate]
    on = distance_to_simplices(x, corner[row]) <= _SAME * size[row]
    on &= np.linalg.norm(corner[row] - x[:, None], axis=2).min(axis=1) > _SAME * size[row]
    if not on.any():
        return []
    i = int(np.argmax(on))
    return [
        f"point {int(candidate[i])} of the mesh at {at(x[i])} lies on a side of cell "
        f"{int(owner[row[i]])} without being one of its points ({len(np.unique(candidate[on]))} "
        "such points): the mesh does not conform, and the body is open there. Mesh its parts "
        "together (gmsh: BooleanFragments or Coherence before meshing)."
    ]


def _overlapping_cells(points: Floats, cells: Ints, owner: Ints, corner: Floats) -> list[str]:
    """Cells in which the middle of a boundary facet of another cell lies."""
    x = corner.mean(axis=1)
    shape = points[cells]
    middle = shape.mean(axis=1)
    reach = np.linalg.norm(shape - middle[:, None], axis=2).max(axis=1)
    step = np.floor(np.log2(reach / reach.min())).astype(np.int64)
    cell_of_point = np.zeros(len(x), dtype=np.int64) - 1
    for k in np.unique(step):
        rows = np.nonzero(step == k)[0]
        tree, largest_reach = cKDTree(middle[rows]), float(reach[rows].max())
        for begin in range(0, len(x), chunk := max(_AT_ONCE // 100, 1)):
            part = np.arange(begin, min(begin + chunk, len(x)))
            point, cell = pairs_within(tree, x[part], np.full(len(part), largest_reach))
            point, cell = part[point], rows[cell]
            is_close = np.linalg.norm(middle[cell] - x[point], axis=1) < reach[cell]
            is_close &= cell != owner[point]
            point, cell = point[is_close], cell[is_close]
            edges = shape[cell, 1:] - shape[cell, :1]
            coordinates = np.linalg.solve(
                np.swapaxes(edges, 1, 2), (x[point] - shape[cell, 0])[..., None]
            )
            bary = np.concatenate([1 - coordinates.sum(axis=1), coordinates[..., 0]], axis=1)
            is_inside = bary.min(axis=1) > _INSIDE
            cell_of_point[point[is_inside]] = cell[is_inside]
    if (cell_of_point < 0).all():
        return []
    i = int(np.argmax(cell_of_point >= 0))
    return [
        f"cells {int(owner[i])} and {int(cell_of_point[i])} of the mesh overlap at {at(x[i])} "
        f"({int((cell_of_point >= 0).sum())} such places): parts of the body are there twice, and "
        f"twice as stiff. Unite them before meshing (gmsh: BooleanUnion or BooleanFragments)."
    ]


def pairs_within(tree: cKDTree, x: Floats, reach: Floats) -> tuple[Ints, Ints]:
    """Pairs of places and points of a tree no farther from them than a reach."""
    neighbours = tree.query_ball_point(x, reach)
    row, _ = ranges(np.array([len(rows) for rows in neighbours], dtype=np.int64))
    all_rows = [np.asarray(rows, dtype=np.int64) for rows in neighbours]
    return row, np.concatenate([np.zeros(0, dtype=np.int64), *all_rows])


def unused_sets(cell_sets: Mapping[str, Ints], n_cells: int) -> list[str]:
    """A message where cell sets with names of the user's divide the body; else nothing."""
    parts = [
        name
        for name, members in cell_sets.items()
        if 0 < len(np.unique(members)) < n_cells and not _UNNAMED.fullmatch(name)
    ]
    if len(parts) < 2:
        return []
    names = ", ".join(repr(name) for name in parts[:5]) + (" ..." if len(parts) > 5 else "")
    return [
        f"the mesh has {len(parts)} cell sets that each cover a part of the body ({names}), and "
        "the whole body is given one material. If they stand for different ones, give them by "
        f"name: Problem(mesh, {{{parts[0]!r}: ..., ...}})."
    ]


__all__ = ["checked_cells", "checked_sets", "mesh_doubts", "pairs_within", "unused_sets"]
