"""Fronts of error against time, and how far a curve lies behind them."""

from collections.abc import Sequence
from math import exp, inf, log
from typing import Any

Point = tuple[float, float]  # time, error


def front(points: Sequence[Point]) -> list[Point]:
    """Points that no other beats in both time and error, by rising time."""
    best: list[Point] = []
    for time, error in sorted(points):
        if not best or error < best[-1][1]:
            best.append((time, error))
    return best


def time_at(points: Sequence[Point], error: float) -> float:
    """Time at which a curve reaches an error: interpolated in logarithms along its front.

    Infinite where it does not reach it; its first point where that is better already.
    """
    steps = front(points)
    for i, (time, reached) in enumerate(steps):
        if reached <= error:
            if i == 0:
                return time
            before, worse = steps[i - 1]
            share = log(worse / error) / log(worse / reached)
            return exp((1 - share) * log(before) + share * log(time))
    return inf


def settled(points: Sequence[Point]) -> list[Point]:
    """Points with the largest error of their own and of all slower ones of a curve.

    An error that changes its sign between two meshes is small by luck on some mesh between.
    """
    worst: list[Point] = []
    for time, error in sorted(points, reverse=True):
        worst.append((time, max(error, worst[-1][1]) if worst else error))
    return worst[::-1]


def points_of(rows: Sequence[dict[str, Any]], name: str, clock: str) -> list[Point]:
    """Time and error of rows that have this error."""
    return [(r[clock], r["errors"][name]) for r in rows if r["errors"].get(name, 0) > 0]


def behind(
    rows: Sequence[dict[str, Any]], name: str, clock: str, kinds: Sequence[str], wanted: float
) -> tuple[float, str]:
    """Time of the default settings over the least of others, at an error, and who is ahead.

    Parameters
    ----------
    rows : sequence of dict
        As `measure` returns them.
    name : str
        Of the error.
    clock : {"wall", "processor"}
    kinds : sequence of str
        Kinds of series to compare with.
    wanted : float

    Returns
    -------
    ratio : float
        1 or less where the defaults are ahead of all.
    series : str
    """
    default = points_of([r for r in rows if r["kind"] == "default"], name, clock)
    ours = time_at(settled(default), wanted)
    least, ahead = inf, ""
    for series in dict.fromkeys(r["series"] for r in rows if r["kind"] in kinds):
        chosen = [r for r in rows if r["series"] == series]
        time = time_at(settled(points_of(chosen, name, clock)), wanted)
        if time < least:
            least, ahead = time, series
    return (ours / least if least < inf else 0.0), ahead
