"""The strip between an old crack front and its new one: sides divided, triangles stitched."""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.crack.polylines_3d import steps, tangents

_BEND = np.cos(np.radians(60.0))  # a polyline that turns by more has a corner


_FLAT = 1e-7  # double area over the square of the longest side of a triangle without area


_LIKE = 0.95  # a diagonal is as good as another if its worst triangle is at most that much worse


def divided(x: Floats, closed: bool, pieces: Ints, straight: Bools) -> list[Floats]:
    """Points inside each side of a polyline, which divide it evenly.

    Parameters
    ----------
    x : (m, 3) array, length
    closed : bool
        Whether a last side leads back to the first point.
    pieces : (sides,) array of int
        Into how many parts each side is divided.
    straight : (m,) array of bool
        Points whose sides are to be divided as they are.

    Returns
    -------
    list of (pieces - 1, 3) arrays
        On the cubic with the tangents of the circles through three points in a row; on the
        straight side where one of its ends is a corner.
    """
    side = steps(x, closed)
    length = np.linalg.norm(side, axis=1)
    tangent = tangents(x, closed)
    unit = side / length[:, None]
    result = []
    for j, count in enumerate(pieces):
        t = (np.arange(1, count) / count)[:, None]
        a, b = j, (j + 1) % len(x)
        inner = x[a] + t * side[j]
        bends = count > 1 and not (straight[a] or straight[b])
        if bends and min(tangent[a] @ unit[j], tangent[b] @ unit[j]) > np.sqrt((1 + _BEND) / 2):
            # Written as chord and bulge: a straight side stays straight to the last bit.
            first, last = length[j] * tangent[a] - side[j], length[j] * tangent[b] - side[j]
            inner += t * (1 - t) * ((1 - t) * first - t * last)
        result.append(inner)
    return result


def stitched(
    corners: tuple[int, int], numbers: list[int], x: Floats, normal: Floats
) -> tuple[list[tuple[int, int, int]], float]:
    """Triangles between one side of the old front and the new front ahead of it.

    Parameters
    ----------
    corners : (int, int)
        Point numbers of the old side in the direction of the front.
    numbers : list of int
        Point numbers of the new front ahead of it, in the same direction.
    x : (2 + len(numbers), 3) array, length
        The points of both.
    normal : (3,) array
        Where about the triangles look.

    Returns
    -------
    triangles : list of (int, int, int)
        Without those that have a point twice.
    upright : float
        Smallest cosine between the normal of a triangle and the given one; -1 for one without
        area.
    """
    place = [corners[0], corners[1], *numbers]
    best: list[tuple[int, int, int]] = []
    quality, upright = -np.inf, -1.0
    for turn in range(len(numbers)):
        local = [(0, q + 3, q + 2) for q in range(turn)]
        local.append((0, 1, turn + 2))
        local.extend((1, q + 3, q + 2) for q in range(turn, len(numbers) - 1))
        local = [
            (a, b, c)
            for a, b, c in local
            if place[a] != place[b] != place[c] and place[a] != place[c]
        ]
        if not local:
            return [], 1.0
        shape, cosine = _worst(x, np.array(local), normal)
        # The first way unless another is clearly better: neighbours are cut alike.
        if shape > (quality / _LIKE if quality > 0 else quality):
            best = [(place[a], place[b], place[c]) for a, b, c in local]
            quality, upright = shape, cosine
    return best, upright


def _worst(x: Floats, triangles: Ints, normal: Floats) -> tuple[float, float]:
    """Smallest double area along the normal over longest side squared, and cosine to it."""
    a, b, c = (x[triangles[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    longest = np.maximum(
        np.maximum(((b - a) ** 2).sum(axis=1), ((c - b) ** 2).sum(axis=1)),
        ((a - c) ** 2).sum(axis=1),
    )
    along, total = area @ normal, np.linalg.norm(area, axis=1)
    cosine = np.where(total > _FLAT * longest, along / np.where(total > 0, total, 1.0), -1.0)
    return float((along / longest).min()), float(cosine.min())


def along_front(s: Floats, values: Floats, place: Floats, closed: bool, length: float) -> Floats:
    """Values at other places of a front, by monotone cubics (Fritsch and Butland, 1984).

    Parameters
    ----------
    s : (f,) array, length
        Where the values are known, in any order.
    values : (f,) array
    place : (k,) array, length
        Where they are sought.
    closed : bool
        Whether the front is closed; else values beyond the first and last place are theirs.
    length : float, length
        Length of the front, the period of a closed one.

    Returns
    -------
    (k,) array
    """
    from scipy.interpolate import PchipInterpolator

    if closed:
        s, place = s % length, place % length
    s, inverse = np.unique(s, return_inverse=True)
    values = np.bincount(inverse, weights=values) / np.bincount(inverse)
    if len(s) == 1:
        return np.full(len(place), values[0])
    if closed:
        n = min(3, len(s))
        s = np.concatenate([s[-n:] - length, s, s[:n] + length])
        values = np.concatenate([values[-n:], values, values[:n]])
    return np.asarray(PchipInterpolator(s, values)(np.clip(place, s[0], s[-1])))
