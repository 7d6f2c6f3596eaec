"""Sizes of cells around where cracks will run."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints
from xcrack.growth.scout import Scouted

_PLATEAU = 1.0  # cells around the path that are as small as those on it
_SLOPE = 0.4  # growth of cells with the distance
_CLOSER = 0.5  # of a cell: distance of the points that stand for the path
_ACROSS = 3.0  # cells across a corridor at least, for the unknowns that it will have


@dataclass(frozen=True, eq=False)
class Ways:
    """Where each tip, or place along a front, of a scout goes, from stage to stage.

    Attributes
    ----------
    start, stop : (k, d) arrays, length
    stage : (k,) array of int
        At which it starts.
    label : (k,) array of int
        Of the tip at the first stage that it comes from.
    labels : list of (n,) arrays of int
        Of all tips at each stage.
    """

    start: Floats
    stop: Floats
    stage: Ints
    label: Ints
    labels: list[Ints]


def ways_of(seen: Scouted) -> Ways:
    """Pieces of all paths; what is new belongs to the nearest of what was there before."""
    places = [stage.places for stage in seen.stages]
    labels = [np.arange(len(places[0]))]
    start, stop, number, label = [], [], [], []
    for k, (old, new) in enumerate(zip(places[:-1], places[1:], strict=True)):
        nearest = cKDTree(old).query(new)[1]
        labels.append(labels[-1][nearest])
        start.append(old[nearest])
        stop.append(new)
        number.append(np.full(len(new), k))
        label.append(labels[-1])
    empty = np.zeros((0, places[0].shape[1]))
    none = np.zeros(0, dtype=np.int64)
    return Ways(
        np.concatenate([empty, *start]),
        np.concatenate([empty, *stop]),
        np.concatenate([none, *number]),
        np.concatenate([none, *label]),
        labels,
    )


@dataclass(frozen=True, eq=False)
class Corridor:
    """Wanted sizes of cells along paths, wider with the distance; a value of `refine`.

    Attributes
    ----------
    x : (n, d) array, length
        Points of the paths.
    size : (n,) array, length
        Longest edges wanted there.
    """

    x: Floats
    size: Floats

    def __call__(self, x: Floats) -> Floats:
        """Longest edges wanted at points `(m, d)`."""
        if not len(self.x):
            return np.full(len(x), np.inf)
        # The nearest few points decide: sizes along a path change slowly.
        k = min(4, len(self.x))
        distance, row = self._tree.query(x, k=k)
        distance, row = distance.reshape(len(x), k), row.reshape(len(x), k)
        size = self.size[row]
        return np.asarray((size + _SLOPE * np.maximum(distance - _PLATEAU * size, 0)).min(axis=1))

    @property
    def _tree(self) -> cKDTree:
        return cKDTree(self.x)


def corridor(seen: Scouted, ways: Ways, chosen: Ints, sizes: list[Floats], most: int) -> Corridor:
    """Sizes along all paths from those at the tips of some stages.

    Cells are not smaller than those with which the corridor alone has more than all the unknowns:
    a mesh finer than that is given up anyway, and need not be made to see it.

    Parameters
    ----------
    seen : Scouted
    ways : Ways
    chosen : (k,) array of int
        Stages.
    sizes : list of (n,) arrays, length
        At the places of each of these.
    most : int
        Unknowns that the mesh may have.
    """
    way = float(np.linalg.norm(ways.stop - ways.start, axis=1).sum())
    sizes = [np.maximum(size, _ACROSS * way / most) for size in sizes]
    points, values = [seen.stages[0].places], [sizes[0]]
    by_label: dict[int, list[tuple[int, float]]] = {}
    for stage, own in zip(chosen.tolist(), sizes, strict=True):
        for label, size in zip(ways.labels[stage].tolist(), own.tolist(), strict=True):
            by_label.setdefault(label, []).append((stage, size))
    every = zip(ways.start, ways.stop, ways.stage.tolist(), ways.label.tolist(), strict=True)
    for a, b, stage, label in every:
        known = np.array(by_label[label])
        h = np.exp(np.interp([stage, stage + 1], known[:, 0], np.log(known[:, 1])))
        n = int(np.ceil(np.linalg.norm(b - a) / (_CLOSER * h.min()))) + 1
        share = np.linspace(0, 1, n)
        points.append(a + share[:, None] * (b - a))
        values.append(h[0] + share * (h[1] - h[0]))
    return Corridor(np.concatenate(points), np.concatenate(values))


__all__ = ["Corridor", "Ways", "corridor", "ways_of"]
