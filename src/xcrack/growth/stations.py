"""Where growth has come to: the ends of all cracks as arrays over stations, and their names.

A station is a tip in 2D and a vertex of a front in 3D. Numbers of cracks, tips and fronts are those
of a step; identities last through joins, exits and stored runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.stations import Stations
from xcrack.sif.sif import SIF

PerCrack = tuple[Floats, ...]  # one array (f,) a crack


@dataclass(frozen=True, eq=False)
class GrowthStations(Stations):
    """Stations that growth goes on from.

    Attributes
    ----------
    crack : (n,) array of int
        Number of the crack in the step.
    front : (n,) array of int
        Number of the tip or front within its crack.
    s : (n,) array, length
        Position along the front; 0 in 2D.
    x : (n, d) array, length
        Where growth has come to.
    frame : (n, d, d) array
        Rows (ahead, normal), in 3D (ahead, normal, ahead x normal).
    end : (n,) array of int
        Identity of the tip or front: the same through a run.
    closed : (n,) array of bool
        Whether the front is closed.
    length : (n,) array, length
        Of the whole front; 0 in 2D.
    offset : (n, d) array, length
        Of `x` from the end of the crack: growth that is too short to be modelled waits.
    fresh : (n,) array of bool
        Whether the last face was added by growth, so that it may be moved on (2D).
    """

    end: Ints
    closed: Bools
    length: Floats
    offset: Floats
    fresh: Bools

    def at(self, rows: Bools | Ints) -> "GrowthStations":
        """Some of the stations."""
        return replace(self, **{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    @property
    def waiting_length(self) -> Floats:
        """Length of the growth that waits `(n,)`."""
        return np.linalg.norm(self.offset, axis=1)

    def growth(self, rate: Floats, advance: float) -> Floats:
        """Growth in proportion to rates, the largest as given, on top of what waits `(n,)`."""
        return np.asarray(self.waiting_length + advance * (rate / rate.max()))


def solved_stations(sif: Sequence[SIF]) -> Stations:
    """Stations at which K of all cracks was solved, from K of one load state."""
    return Stations(
        np.repeat(np.arange(len(sif)), [len(s.x) for s in sif]),
        *(np.concatenate([getattr(s, name) for s in sif]) for name in ("front", "s", "x", "frame")),
    )


def split(values: Floats, counts: Sequence[int]) -> PerCrack:
    """Values of all stations as one array a crack."""
    ends = np.cumsum([0, *counts])
    return tuple(np.array(values[a:b]) for a, b in zip(ends, ends[1:]))


def directions(frame: Floats, angle: Floats) -> Floats:
    """Unit vectors `(n, d)` at angles in frames."""
    beta = angle[:, None]
    return np.asarray(np.cos(beta) * frame[:, 0] + np.sin(beta) * frame[:, 1])


# Which tips, fronts and cracks are the same through a run.


@dataclass(frozen=True, eq=False)
class Identities:
    """What the numbers of a step stand for.

    Attributes
    ----------
    cracks : tuple of int
        Number that each crack had at first; of joined ones the smallest.
    ends : tuple of tuples of int
        Identity of each tip, in 3D of each front, of each crack.
    names : tuple of str
        Name of each identity so far, such as "left tip of crack 2".
    """

    cracks: tuple[int, ...]
    ends: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]

    def name_of(self, crack: int, number: int) -> str:
        """Name of a tip or front by its numbers in the step."""
        return self.names[self.ends[crack][number]]

    def of(self, stations: Stations) -> Ints:
        """Identity of each station `(n,)`."""
        pairs = zip(stations.crack.tolist(), stations.front.tolist(), strict=True)
        return np.array([self.ends[c][f] for c, f in pairs], dtype=np.int64)


def first_identities(cracks: Sequence[Crack]) -> Identities:
    """Identities of placed cracks at the begin of a run."""
    ends: list[tuple[int, ...]] = []
    names: list[str] = []
    for c, crack in enumerate(cracks):
        words = _names_of(crack)
        ends.append(tuple(range(len(names), len(names) + len(words))))
        names += [f"{word} of crack {c}" for word in words]
    return Identities(tuple(range(len(cracks))), tuple(ends), tuple(names))


def _names_of(crack: Crack) -> list[str]:
    """What the ends of a crack are called."""
    n = crack.n_tips
    if crack.fronts is not None:
        return ["front"] if n == 1 else [f"front {k}" for k in range(n)]
    if n < 2:
        return ["tip"] * n
    x = tip_frames(crack)[0]
    way = np.abs(x[1] - x[0])
    axis = 0 if way[0] >= way[1] else 1
    words = (("left", "right"), ("lower", "upper"))[axis]
    first = int(x[0, axis] > x[1, axis])
    return [f"{words[first]} tip", f"{words[1 - first]} tip"]


def identities_after(
    identities_before: Identities,
    numbers: Sequence[int],
    stations: GrowthStations,
    place: Floats,
    cracks: Sequence[Crack],
) -> Identities:
    """Identities after an advance.

    An end is the one of its crack that has come nearest to where it lies; of several that claim
    one, that with most of its points has it, and the others are new.

    Parameters
    ----------
    identities_before : Identities
    numbers : sequence of int
        Number that each crack of before has now.
    stations : GrowthStations
        Before.
    place : (n, d) array, length
        Where the ends of the cracks at these have come to.
    cracks : sequence of Crack
        Placed, after the advance.
    """
    names = list(identities_before.names)
    pairs = list(zip(identities_before.cracks, numbers, strict=True))
    firsts = [min(name for name, number in pairs if number == c) for c in range(len(cracks))]
    crack_now = np.array(numbers, dtype=np.int64)[stations.crack]
    ends = []
    for c, crack in enumerate(cracks):
        rows = np.nonzero(crack_now == c)[0]
        points = [[tip] for tip in crack.tips or ()] if crack.fronts is None else crack.fronts
        ids = _identities_at(stations.end[rows], place[rows], [crack.points[p] for p in points])
        word = "tip" if crack.fronts is None else "front"
        for k, end in enumerate(ids):
            if end < 0:
                ids[k] = len(names)
                names.append(f"{word} {len(names)} of crack {firsts[c]}")
        ends.append(tuple(ids))
    return Identities(tuple(firsts), tuple(ends), tuple(names))


def _identities_at(end: Ints, place: Floats, points: Sequence[Floats]) -> list[int]:
    """Identity of each of some new ends, by their points; -1 for one that is new."""
    result = [-1] * len(points)
    if not len(end) or not len(points):
        return result
    number = np.repeat(np.arange(len(points)), [len(x) for x in points])
    nearest_end = end[cKDTree(place).query(np.concatenate(points))[1]]
    pairs, count = np.unique(np.stack([number, nearest_end], axis=1), axis=0, return_counts=True)
    for k in np.argsort(-count, kind="stable").tolist():
        front, claimed_front = pairs[k].tolist()
        if result[front] < 0 and claimed_front not in result:
            result[front] = claimed_front
    return result


@dataclass(frozen=True, eq=False)
class CellSizes:
    """Cells that the bars of a run ask for, smaller than those of the mesh that it begins with.

    Attributes
    ----------
    x : (n, d) array, length
        Places.
    size : (n,) array, length
        Longest edges of cells there.
    moves : (n,) array of bool
        At an end of a crack, with which the size moves on; the others stay.
    """

    x: Floats
    size: Floats
    moves: Bools

    @classmethod
    def without_places(cls, dim: int) -> "CellSizes":
        """No places."""
        return cls(np.zeros((0, dim)), np.zeros(0), np.zeros(0, dtype=bool))

    def size_at(self, x: Floats) -> Floats:
        """Of points `(k, d)`: that of the nearest place that moves; inf where none does."""
        if not self.moves.any():
            return np.full(len(x), np.inf)
        return np.asarray(self.size[self.moves][cKDTree(self.x[self.moves]).query(x)[1]])

    def with_ends(self, x: Floats, size: Floats) -> "CellSizes":
        """With sizes `(k,)` at the ends `(k, d)` of the cracks of another step."""
        is_staying = ~self.moves
        cells_that_stay = CellSizes(
            self.x[is_staying], self.size[is_staying], self.moves[is_staying]
        )
        return cells_that_stay.with_places(CellSizes(x, size, np.ones(len(x), dtype=bool)))

    def with_places(self, cells: "CellSizes") -> "CellSizes":
        """With the places of another one too."""
        return CellSizes(
            np.concatenate([self.x, cells.x]),
            np.concatenate([self.size, cells.size]),
            np.concatenate([self.moves, cells.moves]),
        )


__all__ = [
    "CellSizes",
    "GrowthStations",
    "Identities",
    "PerCrack",
    "directions",
    "first_identities",
    "identities_after",
    "solved_stations",
    "split",
]
