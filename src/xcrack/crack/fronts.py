"""Fronts of cracks in space: sides, tangents, frames and weights of their points."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.crack.crack import Crack
from xcrack.mesh.distances import corner_normals
from xcrack.mesh.triangulation import unit

_FAR = 2.5  # median spacings that still close a front, from its last point to its first


# Sides and tangents of polylines in 3D, open or closed.


def steps(x: Floats, is_closed: bool) -> Floats:
    """Vectors from each point of a polyline to the next one."""
    return np.asarray(np.roll(x, -1, axis=0) - x if is_closed else np.diff(x, axis=0))


def tangents(x: Floats, is_closed: bool) -> Floats:
    """Unit tangents of the circles through three points in a row, of the sides at open ends."""
    side = steps(x, is_closed)
    next_side = side if is_closed else np.concatenate([side, side[-1:]])
    previous_side = np.roll(side, 1, axis=0) if is_closed else np.concatenate([side[:1], side])
    ahead_length = np.linalg.norm(next_side, axis=1, keepdims=True)
    back_length = np.linalg.norm(previous_side, axis=1, keepdims=True)
    tangent = next_side / ahead_length * back_length + previous_side / back_length * ahead_length
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(tangent / np.where(length > 0, length, 1.0))


@dataclass(frozen=True, eq=False)
class Front:
    """One front of a 3D crack.

    Attributes
    ----------
    x : (m, 3) array, length
        Vertices in the direction of the last row of the frames; of a closed front each once.
    frame : (m, 3, 3) array
        Rows (t ahead, n normal, b = t x n along).
    is_closed : bool
    s : (m,) array, length
        Arc length from the first vertex.
    number : (m,) array of int
        Point numbers of the crack.
    """

    x: Floats
    frame: Floats
    is_closed: bool
    s: Floats
    number: Ints


def closed_fronts(crack: Crack) -> list[bool]:
    """Of each front whether it is closed."""
    return [bool(front[0] == front[-1]) for front in crack.fronts or ()]


def front_frames(crack: Crack) -> list[Front]:
    """Vertices, frames and arc lengths of the fronts of a placed 3D crack.

    b is the tangent of the circle through a vertex and its two neighbours, n the normal of the
    faces around the vertex made perpendicular to b, and t = n x b shows out of the crack.

    Parameters
    ----------
    crack : Crack

    Returns
    -------
    list of Front
    """
    normal = corner_normals(crack.points, crack.faces)
    result = []
    for front in crack.fronts or ():
        is_closed = bool(front[0] == front[-1])
        number = np.array(front[:-1] if is_closed else front)
        x = crack.points[number]
        b = tangents(x, is_closed)
        n = normal[number]
        n = unit(n - np.einsum("ij,ij->i", n, b)[:, None] * b)
        frame = np.stack([np.cross(n, b), n, b], axis=1)
        length = np.linalg.norm(np.diff(x, axis=0), axis=1)
        s = np.concatenate([[0.0], np.cumsum(length)])
        result.append(Front(lock(x), lock(frame), is_closed, lock(s), lock(number)))
    return result


def is_closed(x: Floats) -> bool:
    """Whether points along a front, each once, go round: the last lies next to the first."""
    if len(x) < 4:
        return False
    spacing = np.linalg.norm(np.diff(x, axis=0), axis=1)
    return bool(np.linalg.norm(x[-1] - x[0]) < _FAR * np.median(spacing))


def front_weights(x: Floats) -> Floats:
    """Share of the length of a front that belongs to each of its points `(m,)`; their sum is 1."""
    if len(x) == 1:
        return np.ones(1)
    side_length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if is_closed(x):
        side_length = np.append(side_length, np.linalg.norm(x[0] - x[-1]))
        weight = side_length + np.roll(side_length, 1)
    else:
        weight = np.append(side_length, 0.0) + np.append(0.0, side_length)
    total = float(weight.sum())
    return np.asarray(weight / total if total else np.full(len(x), 1 / len(x)))


__all__ = [
    "Front",
    "closed_fronts",
    "front_frames",
    "front_weights",
    "is_closed",
    "steps",
    "tangents",
]
