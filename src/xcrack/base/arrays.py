"""Small helpers for read-only arrays, ragged rows and places in messages."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Shape = tuple[int | None, ...]


def frozen_copy(values: ArrayLike, dtype: Any = None) -> NDArray[Any]:
    """Return a contiguous read-only copy of `values`."""
    result = np.array(values, dtype=dtype, order="C", copy=True)
    result.flags.writeable = False
    return result


def lock(values: NDArray[Any]) -> NDArray[Any]:
    """Make an array of one's own read-only, and return it."""
    values.flags.writeable = False
    return values


def has_shape(shape: tuple[int, ...], pattern: Shape | None) -> bool:
    """Whether a shape is the wanted one, in which None stands for any length."""
    if pattern is None:
        return True
    if len(shape) != len(pattern):
        return False
    for side, pattern_side in zip(shape, pattern):
        if pattern_side is not None and side != pattern_side:
            return False
    return True


def at(x: ArrayLike) -> list[float]:
    """A place for a message: coordinates with six digits."""
    return list((np.round(np.asarray(x, dtype=float), 6) + 0.0).tolist())  # no -0.0


def coordinates(x: Iterable[float]) -> str:
    """A place as text: its coordinates with six digits, in brackets.

    >>> coordinates((0.5, 2.0))
    '(0.5, 2)'
    """
    return "(" + ", ".join(f"{v:.6g}" for v in x) + ")"


def row_stretches(count: int, length: int = 50_000) -> Iterator[slice]:
    """Stretches of so many rows one after the other: what is computed on all at once takes memory.

    >>> [(part.start, part.stop) for part in row_stretches(5, 2)]
    [(0, 2), (2, 4), (4, 5)]
    """
    for first in range(0, count, length):
        yield slice(first, min(first + length, count))


def ranges(counts: Ints) -> tuple[Ints, Ints]:
    """Row number and position within the row for ragged rows of the given lengths.

    >>> ranges(np.array([2, 0, 3]))
    (array([0, 0, 2, 2, 2]), array([0, 1, 0, 1, 2]))
    """
    row = np.arange(len(counts)).repeat(counts)
    start = offsets(counts)
    return row, np.arange(len(row)) - start[row]


def offsets(counts: Ints) -> Ints:
    """Offsets `(n + 1,)` of ragged rows of the given lengths."""
    result = np.zeros(len(counts) + 1, dtype=np.int64)
    np.add.accumulate(counts, out=result[1:])
    return result


def runs_of(flag: Bools) -> list[Ints]:
    """Cyclic runs of true values, each as its places in order."""
    if flag.all():
        return [np.arange(len(flag))]
    start = np.nonzero(flag & ~np.roll(flag, 1))[0]
    result = []
    for first in start:
        place = (first + np.arange(len(flag))) % len(flag)
        result.append(place[: int(np.argmin(flag[place]))])
    return result


def open_runs(flag: Bools) -> list[Ints]:
    """Runs of true values that do not go round, each as its places in order."""
    places = np.nonzero(flag)[0]
    return [run for run in np.split(places, np.nonzero(np.diff(places) > 1)[0] + 1) if len(run)]
