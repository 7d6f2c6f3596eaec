"""Rainflow counting of a history that is repeated."""

from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from xcrack.base.arguments import Array, check_arguments
from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError

CYCLE = np.dtype([("min", float), ("max", float), ("count", float), ("at", np.int64)])


def turning_points(values: Floats) -> Ints:
    """Numbers of the points at which a history turns, as it is repeated `(n,)`.

    Parameters
    ----------
    values : (n,) array

    Returns
    -------
    (k,) array of int
        In order; of equal neighbours the first. Empty where nothing varies.
    """
    different = np.nonzero(values != np.roll(values, 1))[0]
    x = values[different]
    turns = (x > np.roll(x, 1)) != (np.roll(x, -1) > x)  # neighbours differ
    return np.asarray(different[turns], dtype=np.int64)


def closed_cycles(values: Floats) -> list[tuple[int, int]]:
    """Pairs of points that make a cycle when a history is repeated.

    Parameters
    ----------
    values : (n,) array

    Returns
    -------
    list of (int, int)
        Numbers of the two turning points of each cycle, in the order in which they close.

    Notes
    -----
    ASTM E1049-85, 5.4.5, simplified rainflow for repeating histories: begun at the largest peak,
    all cycles are whole.
    """
    points = turning_points(values)
    if not len(points):
        return []
    begin = int(np.argmax(values[points]))
    order = [*points[begin:].tolist(), *points[: begin + 1].tolist()]
    x = values.tolist()
    stack: list[int] = []
    pairs: list[tuple[int, int]] = []
    for point in order:
        stack.append(point)
        while len(stack) >= 3:
            first, second, third = x[stack[-3]], x[stack[-2]], x[stack[-1]]
            if abs(third - second) < abs(second - first):
                break
            pairs.append((stack[-3], stack[-2]))
            del stack[-3:-1]
    return pairs


@check_arguments()
def rainflow(values: Annotated[ArrayLike, Array((None,))]) -> NDArray[Any]:
    """Cycles of a history that is repeated, with exact ranges.

    Parameters
    ----------
    values : (n,) array
        At least two that differ; points between turning points do not matter.

    Returns
    -------
    (k,) structured array
        Columns min, max, count (1: no halves are left when a history is repeated) and at, the
        number of the value that is the maximum; ordered by it.

    Raises
    ------
    ProblemError
        Nothing varies.

    Notes
    -----
    ASTM E1049-85, 5.4.5. `rainflow` of a history that is not repeated (5.4.4) would leave halves,
    which growth by blocks has no use for.

    Examples
    --------
    >>> print(rainflow([-2, 1, -3, 5, -1, 3, -4, 4, -2])[["min", "max"]].tolist())
    [(-2.0, 1.0), (-4.0, 5.0), (-1.0, 3.0), (-3.0, 4.0)]
    """
    history = np.asarray(values)
    pairs = closed_cycles(history)
    if not pairs:
        raise ProblemError("rainflow: the values do not vary: give two that differ, at least.")
    cycles = np.zeros(len(pairs), dtype=CYCLE)
    ends = history[np.array(pairs)]
    cycles["min"], cycles["max"], cycles["count"] = ends.min(axis=1), ends.max(axis=1), 1.0
    cycles["at"] = np.array(pairs)[np.arange(len(pairs)), ends.argmax(axis=1)]
    return cycles[np.argsort(cycles["at"], kind="stable")]


__all__ = ["CYCLE", "closed_cycles", "rainflow", "turning_points"]
