"""Sizes of cells around lines: room between lines, and sizes that grow with the distance."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats

_PLATEAU = 2.0  # cells around a front that are as small as those at it
_SLOPE = 0.5
_ROOM = 2.0  # cells between two fronts
_CLOSEST = 1 / 16  # of the size of a crack: less room is none
_LEVEL = 2.0**0.25  # sizes closer than this are taken for the smaller one


def between(lines: Sequence[Floats]) -> Floats:
    """Points of polylines `(n, 3)`, closer than their edges."""
    share = np.linspace(0, 1, 4)[:, None, None]
    parts = [(x[:-1] + share * (x[1:] - x[:-1])).reshape(-1, 3) for x in lines]
    return np.concatenate([np.zeros((0, 3)), *parts])


def radii(lines: Sequence[Floats], over: float) -> Floats:
    """Radius of curvature at the points of `between`, from the turn over a length."""
    result = [np.zeros(0)]
    for x in lines:
        side = np.diff(x, axis=0)
        length = np.linalg.norm(side, axis=1)
        arc = np.concatenate([[0.0], np.cumsum(length)])
        middle, along = (arc[1:] + arc[:-1]) / 2, side / np.maximum(length, 1e-300)[:, None]
        if (x[0] == x[-1]).all():
            middle = np.concatenate([middle - arc[-1], middle, middle + arc[-1]])
            along = np.concatenate([along, along, along])
        s = (arc[:-1] + np.linspace(0, 1, 4)[:, None] * length).ravel()
        before, after = (
            np.stack([np.interp(s + way, middle, part) for part in along.T], axis=1)
            for way in (-over / 2, over / 2)
        )
        cosine = np.einsum("ij,ij->i", before, after)
        cosine /= np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1) + 1e-300
        result.append(over / np.maximum(np.arccos(np.clip(cosine, -1, 1)), 1e-12))
    return np.concatenate(result)


def with_room(places: Sequence[Floats], sizes: Sequence[Floats]) -> list[Floats]:
    """Sizes at the places of each crack, less where those of another one are close."""
    result = []
    for c, (x, size) in enumerate(zip(places, sizes, strict=True)):
        others = np.concatenate([np.zeros((0, 3)), *places[:c], *places[c + 1 :]])
        apart = cKDTree(others).query(x)[0] if len(others) and len(x) else np.full(len(x), np.inf)
        result.append(np.minimum(size, np.maximum(apart / _ROOM, _CLOSEST * size)))
    return result


def graded(places: Sequence[Floats], sizes: Sequence[Floats]) -> Callable[[Floats], Floats]:
    """Longest edges wanted at points, from those at places `(n, 3)` of each crack."""
    trees = []
    for x, size in zip(places, sizes, strict=True):
        if not len(x):
            continue
        level = np.floor(np.log(size.max() / size) / np.log(_LEVEL) + 1e-9)
        for step in np.unique(level):
            own = level == step
            trees.append((cKDTree(x[own]), float(size[own].min())))

    def wanted(x: Floats) -> Floats:
        each = [h + _SLOPE * np.maximum(tree.query(x)[0] - _PLATEAU * h, 0) for tree, h in trees]
        return np.asarray(np.min(each, axis=0)) if each else np.full(len(x), np.inf)

    return wanted


__all__ = ["between", "graded", "with_room"]
