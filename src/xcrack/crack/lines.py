"""Cracks in 2D: polylines."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Points, check_arguments
from xcrack.base.arrays import Bools, Floats, at
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.simplex import boxes_meet

_SAME = 1e-9  # share of its length within which points of a line are the same, or it touches itself
_PARALLEL = 1e-10  # sine up to which pieces cross nowhere: they touch along a length, or not at all
_AT_ONCE = 1_000_000  # pairs of pieces looked at together


@check_arguments(GeometryError)
def line_crack(points: Annotated[ArrayLike, Points((None, 2))]) -> Crack:
    """2D crack along a polyline.

    An end outside the body, or within half a cell of its boundary, becomes a mouth as soon as
    the crack is put into a mesh; an end inside is a tip. Lip + lies to the left of the order of
    the points.

    Parameters
    ----------
    points : (p, 2) array, length
        At least two points.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        Fewer than two points, points that coincide, a line that is closed, crosses or
        touches itself, or turns back.

    Examples
    --------
    >>> line_crack([(0, 0), (1, 0), (2, 1)])
    Crack(3 points, 2 faces, not placed)
    """
    x = np.asarray(points)
    if len(x) < 2:
        raise GeometryError(f"a line crack needs at least two points (p, 2), not {len(x)}.")
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if (length <= _SAME * length.sum()).any():
        i = int(np.argmin(length))
        raise GeometryError(
            f"the crack has a piece of zero length: points {i} and {i + 1} both lie at "
            f"{x[i].tolist()}; leave one out."
        )
    directions = np.diff(x, axis=0) / length[:, None]
    turns = (directions[1:] * directions[:-1]).sum(axis=1)
    if (turns < -1 + 1e-12).any():
        turning_point = x[1 + int(np.argmin(turns))]
        raise GeometryError(
            f"the crack turns back on itself at {at(turning_point)}: leave out "
            "what runs over it twice."
        )
    if np.linalg.norm(x[-1] - x[0]) <= _SAME * length.sum():
        raise GeometryError(
            f"the line is closed: its first and last point both lie at {at(x[0])}. A closed crack "
            "cuts a piece out of the body; leave a gap of a few cells between its ends, or give "
            "two arcs as two cracks that do not meet."
        )
    meeting = crossing_points(x, x, is_same_line=True)
    if not len(meeting):
        meeting = touching_points(x, x, _SAME * float(length.sum()), is_same_line=True)
    if len(meeting):
        raise GeometryError(
            f"the crack crosses itself near {at(meeting[0])}: end it there, or describe it by two "
            "cracks that do not meet."
        )
    return polyline_crack(x)


def polyline_crack(points: Floats, tips: tuple[int, ...] | None = None) -> Crack:
    """Crack along points that are known to be sound, each piece a face."""
    number = np.arange(len(points))
    return Crack(points, np.stack([number[:-1], number[1:]], axis=1), tips)


def crossing_points(a: Floats, b: Floats, is_same_line: bool = False) -> Floats:
    """Points where polylines a and b cross `(k, 2)`; neighbours of one line do not count.

    Pieces that lie on each other cross nowhere; see `touching_points`.
    """
    parts = [np.zeros((0, 2))]
    if is_same_line and len(a) < 4:  # all pieces are neighbours
        return parts[0]
    s, q = np.diff(b, axis=0)[None], b[None, :-1]
    step = max(_AT_ONCE // max(len(b), 1), 1)
    for first in range(0, len(a) - 1, step):
        start = a[first : first + step + 1]
        p, r = start[:-1, None], np.diff(start, axis=0)[:, None]
        cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
        gap = q - p
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            t = (gap[..., 0] * s[..., 1] - gap[..., 1] * s[..., 0]) / cross
            u = (gap[..., 0] * r[..., 1] - gap[..., 1] * r[..., 0]) / cross
        hit: Bools = (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
        # Of pieces on one line t and u are quotients of round-off, however far apart they are.
        length = np.linalg.norm(r, axis=-1) * np.linalg.norm(s, axis=-1)
        hit &= np.abs(cross) > _PARALLEL * length
        hit &= boxes_meet(p, start[1:, None], q, b[None, 1:])
        if is_same_line:
            i, j = np.indices(hit.shape)
            hit &= np.abs(i + first - j) > 1
        row = np.nonzero(hit)[0]
        parts.append(start[row] + t[hit][:, None] * (start[row + 1] - start[row]))
    return np.concatenate(parts)


def touching_points(a: Floats, b: Floats, reach: float, is_same_line: bool = False) -> Floats:
    """Vertices of polylines a and b within a reach of the other line `(k, 2)`.

    Lines that lie on each other touch so, though they cross nowhere. Of one line the neighbours
    of a vertex do not count.
    """
    parts = [np.zeros((0, 2))]
    if is_same_line and len(a) < 3:
        return parts[0]
    for x, line in ((a, b),) if is_same_line else ((a, b), (b, a)):
        step = max(_AT_ONCE // max(len(line), 1), 1)
        for first in range(0, len(x), step):
            vertex = x[first : first + step]
            foot = closest_on_segment(vertex[:, None], line[None, :-1], line[None, 1:])
            is_close: Bools = np.linalg.norm(foot - vertex[:, None], axis=2) <= reach
            if is_same_line:
                i, j = np.indices(is_close.shape)
                i += first
                is_close &= (j < i - 1) | (j > i)
            parts.append(vertex[is_close.any(axis=1)])
    return np.concatenate(parts)


__all__ = ["crossing_points", "line_crack", "polyline_crack", "touching_points"]
