"""Small helpers for read-only arrays, ragged rows and places in messages."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, dtype: Any = None) -> NDArray[Any]:
    """Return a contiguous read-only copy of `values`."""
    result = np.array(values, dtype=dtype, order="C", copy=True)
    result.flags.writeable = False
    return result


def lock(values: NDArray[Any]) -> NDArray[Any]:
    """Make an array of one's own read-only, and return it."""
    values.flags.writeable = False
    return values


def at(x: ArrayLike) -> list[float]:
    """A place for a message: coordinates with six digits."""
    return list((np.round(np.asarray(x, dtype=float), 6) + 0.0).tolist())  # no -0.0


def ranges(counts: Ints) -> tuple[Ints, Ints]:
    """Row number and position within the row for ragged rows of the given lengths.

    >>> ranges(np.array([2, 0, 3]))
    (array([0, 0, 2, 2, 2]), array([0, 1, 0, 1, 2]))
    """
    counts = np.asarray(counts, dtype=np.int64)
    row = np.repeat(np.arange(len(counts)), counts)
    start = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else np.zeros(0, np.int64)
    return row, np.arange(len(row)) - start[row]


def offsets(counts: Ints) -> Ints:
    """Offsets `(n + 1,)` of ragged rows of the given lengths."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
