"""Curves and surfaces that a mesh stands for by a polygon: checks, and new points put onto them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.checks import LARGEST, call_function, numbers
from xcrack.base.errors import MeshError, warn

Curve = Callable[[Floats], Any]
Curves = Mapping[str, Curve]

# Of a facet's longest edge. The middle of an edge over a quarter turn is .21 away from its arc.
_FARTHEST = 0.25
_FARTHEST_NEW = 1.0  # the edge may be the fourth part of the one that the arc was as far from
_FLATTEST = 0.2  # of a cell's volume that must be left when its points are moved
_SHARP = 0.9  # cosine of the angle across which two sides of the body are one smooth surface
_PASSES = 60
_AT_REST = 1e-13  # of a facet's edge: a move that is round-off


def checked_curves(given: Any, facet_sets: Mapping[str, Ints]) -> dict[str, Curve]:
    """Curves of a mesh as a dict.

    Parameters
    ----------
    given : anything
    facet_sets : mapping of str to (k, d) array of int

    Raises
    ------
    MeshError
        Not a mapping from names of facet sets to functions.
    """
    if not isinstance(given, Mapping):
        raise MeshError(
            "curves: give a dict of names of facet sets and functions, such as curves={'hole': "
            f"lambda x: ...}}, not {type(given).__name__}."
        )
    for name, curve in given.items():
        if name not in facet_sets:
            names = ", ".join(repr(n) for n in facet_sets)
            raise MeshError(f"curves: the mesh has no facet set {name!r}; it has {names}.")
        if not callable(curve):
            raise MeshError(
                f"curves[{name!r}] is {type(curve).__name__}: give a function that returns the "
                "nearest points of the curve (n, d) for points (n, d)."
            )
    return dict(given)


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


def _reach(points: Floats, facets: Ints) -> Floats:
    """Longest edge of the facets around each point `(n,)`; zero where there is none."""
    corner = points[facets]
    size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1, initial=0)
    reach = np.zeros(len(points))
    for column in facets.T:
        np.maximum.at(reach, column, size)
    return reach


def _nearest_points(name: str, curve: Curve, x: Floats, reach: Floats, most: float) -> Floats:
    """Nearest points of a curve, no farther than `most` times the size of the facets there."""
    if not len(x):
        return x
    what = f"curves[{name!r}]"
    result = numbers(
        call_function(curve, f"the nearest points of {what}", x.copy()),
        what,
        x.shape,
        error=MeshError,
    )
    distance = np.linalg.norm(np.clip(result, -LARGEST, LARGEST) - x, axis=1)
    is_far = distance > most * reach
    if is_far.any():
        i = int(np.argmax(np.where(is_far, distance, 0)))
        raise MeshError(
            f"{what} takes the point {at(x[i])} of the boundary to {at(result[i])}, "
            f"{distance[i]:.4g} away, where facets are {reach[i]:.4g} long ({int(is_far.sum())} "
            f"such points): it must return the nearest points of the curve for which the set "
            f"stands."
        )
    return result


def on_curves(
    points: Floats, cells: Ints, first: int, sets: Mapping[str, Ints], outer: Ints, curves: Curves
) -> tuple[Floats, Bools]:
    """Points of refined cells, those of curved sets that are new on their curves.

    Where a curved side meets another one at an edge, the point stays on both: on both curves, or
    in the plane of the facet on the other side.

    Parameters
    ----------
    points : (n, d) array, length
    cells : (m, d + 1) array of int
    first : int
        Number of the first new point.
    sets : mapping of str to (k, d) array of int
        Facets of the sets with a curve.
    outer : (k, d) array of int
        All facets of the boundary.
    curves : mapping of str to callable

    Returns
    -------
    points : (n, d) array, length
    changed : (n,) array of bool
        Which points are others now.

    Raises
    ------
    MeshError
        As `checked_curves`.
    """
    rows = {name: np.unique(facets[facets >= first]) for name, facets in sets.items()}
    new = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *rows.values()]))
    if not len(new):
        return points, np.zeros(len(points), dtype=bool)
    reach = np.max([_reach(points, facets) for facets in sets.values()], axis=0)
    plane, normal = _other_sides(points, new, sets, outer)
    x = points.copy()
    for _ in range(_PASSES):
        before = x[new]
        for name, number in rows.items():
            x[number] = _nearest_points(name, curves[name], x[number], reach[number], _FARTHEST_NEW)
        off = ((x[plane] - points[plane]) * normal).sum(axis=1)
        x[plane] -= off[:, None] * normal
        if (np.linalg.norm(x[new] - before, axis=1) <= _AT_REST * reach[new]).all():
            break
    changed = np.zeros(len(points), dtype=bool)
    changed[new] = (x[new] != points[new]).any(axis=1)
    return _unfolded_points(points, x, cells, changed)


def _other_sides(
    points: Floats, new: Ints, sets: Mapping[str, Ints], outer: Ints
) -> tuple[Ints, Floats]:
    """New points at a sharp edge to a side without a curve, and that side's normal."""
    curved = np.unique(np.sort(np.concatenate(list(sets.values())), axis=1), axis=0)
    every = np.concatenate([curved, np.sort(outer, axis=1)])
    _, start, count = np.unique(every, axis=0, return_index=True, return_counts=True)
    flat = every[start[(count == 1) & (start >= len(curved))]]
    number = np.full(len(points), -1, dtype=np.int64)
    number[new] = np.arange(len(new))
    sides = []
    for facets in (curved, flat):
        mean = np.zeros((len(new), points.shape[1]))
        touching = facets[(number[facets] >= 0).any(axis=1)]
        vector = _normals(points[touching])
        for column in touching.T:  # parts of a facet lie in one plane: any of them will do
            at_new = number[column] >= 0
            mean[number[column[at_new]]] = vector[at_new]
        sides.append(mean)
    side_here, other = sides
    has = (other != 0).any(axis=1) & (np.abs((side_here * other).sum(axis=1)) < _SHARP)
    return new[has], other[has]


def _normals(corner: Floats) -> Floats:
    """Unit normals of facets `(k, d, d)`."""
    edges = corner[:, 1:] - corner[:, :1]
    normal = (
        np.cross(edges[:, 0], edges[:, -1]) if edges.shape[1] > 1 else edges[:, 0, ::-1] * (1, -1)
    )
    return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])


def _unfolded_points(
    points: Floats, x: Floats, cells: Ints, changed: Bools
) -> tuple[Floats, Bools]:
    """Moved points, but those that would fold or flatten a cell where they were."""
    cells_near = cells[changed[cells].any(axis=1)]
    before, stay, where = _volume(points[cells_near]), 0, points[0]
    while True:
        is_folded = (
            _volume(x[cells_near]) / before < _FLATTEST
        )  # cells may still be of either orientation
        back = np.unique(cells_near[is_folded])
        back = back[changed[back]]
        if not len(back):
            break
        stay += len(back)
        where, x[back], changed[back] = points[back[0]], points[back], False
    if stay:
        warn(
            f"{stay} new points of the boundary stay off their curve, such as that near "
            f"{at(where)}: cells there are flatter than the arc is high. Refine the mesh further "
            "there, or mesh it anew."
        )
    return x, changed


def _volume(corner: Floats) -> Floats:
    return np.asarray(np.linalg.det(corner[:, 1:] - corner[:, :1]))


__all__ = ["Curve", "Curves", "check_on_curves", "checked_curves", "on_curves"]
