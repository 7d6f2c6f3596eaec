"""Curves and surfaces that a mesh stands for by a polygon: checks, and new points put onto them."""

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np
from scipy.sparse import coo_array

from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.checks import LARGEST, call_function, numbers
from xcrack.base.errors import MeshError, warn

Curve = Callable[[Floats], Any]
Curves = Mapping[str, Curve]

# Of a facet's longest edge. The middle of an edge over a quarter turn is .21 away from its arc.
_FARTHEST = 0.25
_FARTHEST_NEW = 1.0  # of the longest edge that there was
_FLAT = 0.5  # of a cell's volume: with less left, inner points follow those that are moved
_FLATTEST = 0.2  # of a cell's volume that must be left when points are moved
_SHARP = 0.9  # cosine of the angle across which two sides of the body are one smooth surface
_LAYERS = 2  # of cells around a folded one whose inner points follow
_SWEEPS = 30
_PASSES = 60
_AT_REST = 1e-13  # of the longest edge: a move that is round-off


def checked_curves(curves: Any, facet_sets: Mapping[str, Ints]) -> dict[str, Curve]:
    """Curves of a mesh as a dict.

    Parameters
    ----------
    curves : anything
    facet_sets : mapping of str to (k, d) array of int

    Raises
    ------
    MeshError
        Not a mapping from names of facet sets to functions.
    """
    if not isinstance(curves, Mapping):
        raise MeshError(
            "curves: give a dict of names of facet sets and functions, such as curves={'hole': "
            f"lambda x: ...}}, not {type(curves).__name__}."
        )
    for name, curve in curves.items():
        if name not in facet_sets:
            names = ", ".join(repr(n) for n in facet_sets)
            raise MeshError(f"curves: the mesh has no facet set {name!r}; it has {names}.")
        if not callable(curve):
            raise MeshError(
                f"curves[{name!r}] is {type(curve).__name__}: give a function that returns the "
                "nearest points of the curve (n, d) for points (n, d)."
            )
    return dict(curves)


def check_on_curves(points: Floats, facet_sets: Mapping[str, Ints], curves: Curves) -> None:
    """Check that the points of each set are on its curve, but for the height of an arc.

    Parameters
    ----------
    points : (n, d) array, length
    facet_sets : mapping of str to (k, d) array of int
    curves : mapping of str to callable

    Raises
    ------
    MeshError
        A point of a set is elsewhere, or the function returns no points.
    """
    for name, curve in curves.items():
        facets = facet_sets[name]
        number = np.unique(facets)
        _nearest_points(name, curve, points[number], _reach(points, facets)[number], _FARTHEST)


def longest_edge(points: Floats, facets: Iterable[Ints]) -> float:
    """Longest edge of the facets of some sets, length."""
    return max((float(_reach(points, f).max(initial=0.0)) for f in facets), default=0.0)


def _reach(points: Floats, facets: Ints) -> Floats:
    """Longest edge of the facets around each point `(n,)`; zero where there is none."""
    corner = points[facets]
    size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1, initial=0)
    reach = np.zeros(len(points))
    for column in facets.T:
        np.maximum.at(reach, column, size)
    return reach


def _nearest_points(name: str, curve: Curve, x: Floats, reach: Floats, far_ratio: float) -> Floats:
    """Nearest points of a curve, no farther than `far_ratio` times the size of the facets there."""
    if not len(x):
        return x
    label = f"curves[{name!r}]"
    result = numbers(
        call_function(curve, f"the nearest points of {label}", x.copy()),
        label,
        x.shape,
        error=MeshError,
    )
    distance = np.linalg.norm(np.clip(result, -LARGEST, LARGEST) - x, axis=1)
    is_far = distance > far_ratio * reach
    if is_far.any():
        i = int(np.argmax(np.where(is_far, distance, 0)))
        raise MeshError(
            f"{label} takes the point {at(x[i])} of the boundary to {at(result[i])}, "
            f"{distance[i]:.4g} away, where facets are {reach[i]:.4g} long ({int(is_far.sum())} "
            f"such points): it must return the nearest points of the curve for which the set "
            f"stands."
        )
    return result


def on_curves(
    points: Floats,
    cells: Ints,
    is_new: Bools,
    sets: Mapping[str, Ints],
    boundary: Ints,
    curves: Curves,
    size: float,
) -> tuple[Floats, Bools, Ints]:
    """Points of refined cells, those of curved sets that are new on their curves.

    Where a curved side meets another one at an edge, the point stays on both: on the border of a
    curve that knows one, else on both curves, or in the plane of the facet on the other side.

    Parameters
    ----------
    points : (n, d) array, length
    cells : (m, d + 1) array of int
    is_new : (n,) array of bool
        Points that may be moved.
    sets : mapping of str to (k, d) array of int
        Facets of the sets with a curve.
    boundary : (k, d) array of int
        All facets of the boundary.
    curves : mapping of str to callable
    size : float, length
        Longest edge that the facets had at first: no point is farther from its curve.

    Returns
    -------
    points : (n, d) array, length
    changed : (n,) array of bool
        Which points are others now.
        Where a cell would be folded, inner points move along.
    flat_points : (k,) array of int
        Points that stay where they were all the same.

    Raises
    ------
    MeshError
        As `checked_curves`.
    """
    rows = [
        (name, curve, number)
        for name, facets in sets.items()
        for curve, number in _curves_of_points(curves[name], facets, is_new)
    ]
    moving_points = np.unique(
        np.concatenate([np.zeros(0, dtype=np.int64), *(row[2] for row in rows)])
    )
    if not len(moving_points):
        return points, np.zeros(len(points), dtype=bool), moving_points
    plane, normal = _other_sides(points, moving_points, sets, boundary)
    x = points.copy()
    for _ in range(_PASSES):
        earlier_places = x[moving_points]
        for name, curve, number in rows:
            reach = np.full(len(number), size)
            x[number] = _nearest_points(name, curve, x[number], reach, _FARTHEST_NEW)
        distance = ((x[plane] - points[plane]) * normal).sum(axis=1)
        x[plane] -= distance[:, None] * normal
        if (np.linalg.norm(x[moving_points] - earlier_places, axis=1) <= _AT_REST * size).all():
            break
    is_moved = np.zeros(len(points), dtype=bool)
    is_moved[moving_points] = (x[moving_points] != points[moving_points]).any(axis=1)
    x, flat_points = _unfolded_points(points, x, cells, is_moved, boundary)
    return x, np.asarray((x != points).any(axis=1)), flat_points


def _curves_of_points(curve: Curve, facets: Ints, is_new: Bools) -> list[tuple[Curve, Ints]]:
    """New points of a set with what they are put onto: its curve, or the border of that.

    A curve may have a `border`: that on which the points of edges lie that only one facet of the
    set has.
    """
    number = np.unique(facets[is_new[facets]])
    border: Curve | None = getattr(curve, "border", None)
    if border is None or facets.shape[1] < 3:
        return [(curve, number)]
    pairs = np.sort(np.concatenate([facets[:, [i, i - 1]] for i in range(3)]), axis=1)
    edges, count = np.unique(pairs, axis=0, return_counts=True)
    at_border = np.isin(number, edges[count == 1])
    return [(curve, number[~at_border]), (border, number[at_border])]


def _other_sides(
    points: Floats, point_numbers: Ints, sets: Mapping[str, Ints], boundary: Ints
) -> tuple[Ints, Floats]:
    """New points at a sharp edge to a side without a curve, and that side's normal."""
    curved_facets = np.unique(np.sort(np.concatenate(list(sets.values())), axis=1), axis=0)
    all_facets = np.concatenate([curved_facets, np.sort(boundary, axis=1)])
    _, start, count = np.unique(all_facets, axis=0, return_index=True, return_counts=True)
    flat_facets = all_facets[start[(count == 1) & (start >= len(curved_facets))]]
    number = np.full(len(points), -1, dtype=np.int64)
    number[point_numbers] = np.arange(len(point_numbers))
    sides = []
    for facets in (curved_facets, flat_facets):
        mean = np.zeros((len(point_numbers), points.shape[1]))
        touching_facets = facets[(number[facets] >= 0).any(axis=1)]
        vector = _normals(points[touching_facets])
        for column in touching_facets.T:  # parts of a facet lie in one plane: any of them will do
            at_new = number[column] >= 0
            mean[number[column[at_new]]] = vector[at_new]
        sides.append(mean)
    curved_normal, flat_normal = sides
    has_side = (flat_normal != 0).any(axis=1) & (
        np.abs((curved_normal * flat_normal).sum(axis=1)) < _SHARP
    )
    return point_numbers[has_side], flat_normal[has_side]


def _normals(corner: Floats) -> Floats:
    """Unit normals of facets `(k, d, d)`."""
    edges = corner[:, 1:] - corner[:, :1]
    normal = (
        np.cross(edges[:, 0], edges[:, -1]) if edges.shape[1] > 1 else edges[:, 0, ::-1] * (1, -1)
    )
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def _unfolded_points(
    points: Floats, target: Floats, cells: Ints, is_moved: Bools, boundary: Ints
) -> tuple[Floats, Ints]:
    """Points that are moved, and inner ones that follow where a cell would be folded or flattened.

    Points of the boundary stay where they were, and are returned as numbers, where that does not
    help: walls are thinner than the arc is high, say.
    """
    x, is_moved, flat_points = target, is_moved.copy(), [np.zeros(0, dtype=np.int64)]
    nearby_cells = np.nonzero(is_moved[cells].any(axis=1))[0]
    earlier_volume, region = _volume(points[cells[nearby_cells]]), np.zeros(0, dtype=np.int64)
    while True:
        # Cells may still be of either orientation.
        share = _volume(x[cells[nearby_cells]]) / earlier_volume
        flat_cells, folded_cells = nearby_cells[share < _FLAT], nearby_cells[share < _FLATTEST]
        if not len(folded_cells) and (len(region) or not len(flat_cells)):
            return x, np.concatenate(flat_points)
        if not np.isin(folded_cells, region).all() or not len(region):
            region = np.union1d(region, flat_cells)
            for _ in range(_LAYERS):
                at_region = np.zeros(len(points), dtype=bool)
                at_region[cells[region]] = True
                region = np.nonzero(at_region[cells].any(axis=1))[0]
            nearby_cells = np.union1d(nearby_cells, region)
            earlier_volume = _volume(points[cells[nearby_cells]])
        else:
            points_back = np.unique(cells[folded_cells])
            points_back = points_back[is_moved[points_back]]
            if not len(points_back):  # only inner points fold it: none of them follows
                points_back = np.unique(cells[region])
                points_back = points_back[is_moved[points_back]]
            is_moved[points_back] = False
            flat_points.append(points_back)
        x = np.where(is_moved[:, None], target, points)
        _let_follow(points, x, cells, region, boundary)


def _let_follow(points: Floats, x: Floats, cells: Ints, region: Ints, boundary: Ints) -> None:
    """Move the inner points of a region by means of the moves around them (in place)."""
    is_beyond = np.ones(len(cells), dtype=bool)
    is_beyond[region] = False
    is_free = np.zeros(len(points), dtype=bool)
    is_free[cells[region]] = True
    is_free[cells[is_beyond]] = False
    is_free[boundary] = False
    number, corner = np.unique(cells[region], return_inverse=True)
    corner = corner.reshape(len(region), -1)
    start, end = np.array(list(combinations(range(cells.shape[1]), 2))).T
    i, j = corner[:, start].ravel(), corner[:, end].ravel()
    weight = 1 / ((points[number[i]] - points[number[j]]) ** 2).sum(axis=1)
    rows, columns = np.concatenate([i, j]), np.concatenate([j, i])
    links = coo_array((np.tile(weight, 2), (rows, columns)), shape=(len(number),) * 2).tocsr()
    total = links.sum(axis=1)[:, None]
    move, is_movable = x[number] - points[number], is_free[number]
    for _ in range(_SWEEPS):
        move[is_movable] = (links @ move / total)[is_movable]
    x[number[is_movable]] = points[number[is_movable]] + move[is_movable]


def warn_of_flat_points(points: Floats, flat_points: Ints) -> None:
    """Name the points that stay off their curve."""
    if len(flat_points):
        warn(
            f"{len(flat_points)} new points of the boundary stay off their curve, such as that "
            f"near {at(points[flat_points[0]])}: cells there are flatter than the arc is high. "
            "Refine the mesh further there, or mesh it anew."
        )


def _volume(corner: Floats) -> Floats:
    return np.asarray(np.linalg.det(corner[:, 1:] - corner[:, :1]))


__all__ = [
    "Curve", "Curves", "check_on_curves", "checked_curves", "longest_edge", "on_curves",
    "warn_of_flat_points",
]  # fmt: skip
