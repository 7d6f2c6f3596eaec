"""Fronts of cracks in space: frames and weights of their points, smooth curves through them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.errors import GeometryError
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
        # Outside the body a face may be without area: its corner has the normal of the next one.
        with_normal = np.nonzero(normal[number].any(axis=1))[0]
        nearest_row = np.abs(np.arange(len(number))[:, None] - with_normal).argmin(axis=1)
        n = normal[number[with_normal[nearest_row]]]
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


# A smooth curve through the vertices of a front, with the frames along it.

# Points among which the first guess of a foot is looked for: in all, and at least on a piece.
_SAMPLES, _LEAST = 400, 3
_STRAIGHT = 1e-9  # turn of a front over its whole length that is round-off
_ARCS = 4  # times at most that the arc lengths of the vertices are measured along a spline
_SAME = 1e-14  # of the length of a front: change of arc lengths that is round-off
_GAUSS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True, eq=False)
class FootPoints:
    """Points around a front in its local coordinates, x = X(s) + x1 t(s) + x2 n(s).

    Attributes
    ----------
    s : (q,) array, length
        Parameter of the foot.
    offset : (q, 2) array, length
        x1 along t and x2 along n.
    frame : (q, 3, 3) array
        Rows (t, n, b) at the foot.
    turn : (q, 4) array
        Curvatures kt = b'.t and kn = b'.n, twist t'.n, and the speed of the parameter.
    """

    s: Floats
    offset: Floats
    frame: Floats
    turn: Floats

    def subset(self, selection: Bools | Ints) -> "FootPoints":
        """Some of the points, by a mask or by their numbers."""
        return FootPoints(
            self.s[selection], self.offset[selection], self.frame[selection], self.turn[selection]
        )

    @property
    def r(self) -> Floats:
        """Distance to the front `(q,)`."""
        return np.hypot(self.offset[:, 0], self.offset[:, 1])

    @property
    def metric(self) -> Floats:
        """Length along b for a unit of arc of the front, 1 - kt x1 - kn x2 `(q,)`."""
        return 1 - (self.turn[:, :2] * self.offset).sum(axis=1)


@dataclass(frozen=True, eq=False)
class FrontCurve:
    """Cubic splines of the points and normals of a front, periodic where it is closed.

    The parameter s is close to the arc length from the first vertex: it is the arc length at the
    vertices, and the speed in between is known and used. Beyond its ends a front is straight.

    Attributes
    ----------
    breaks : (m + 1,) array, length
        Arc length at the vertices; a closed front ends with its first vertex again.
    place, normal : (4, m, 3) arrays
        Coefficients of the pieces, highest power first.
    is_closed : bool
    gaps : (float, float), length
        From the first and the last vertex to where another front begins ahead of them: points
        farther on belong to that. inf without one.
    """

    breaks: Floats
    place: Floats
    normal: Floats
    is_closed: bool
    gaps: tuple[float, float] = (np.inf, np.inf)

    @property
    def length(self) -> float:
        """Length of the front."""
        return float(self.breaks[-1])

    @cached_property
    def _guesses(self) -> tuple[Floats, Floats]:
        n_parts = max(_LEAST, -(-_SAMPLES // (len(self.breaks) - 1)))
        share = np.arange(n_parts) / n_parts
        s = (self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * share).ravel()
        s = np.append(s, self.breaks[-1])
        step = float(np.diff(s).max())
        s_before, s_behind = (
            step * np.arange(1, 1 + math.ceil(gap / step)) if 0 < gap < np.inf else np.empty(0)
            for gap in self.gaps
        )
        s = np.concatenate([-s_before[::-1], s, self.length + s_behind])
        return s, self.at(s)[0]

    def at(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Points of the front.

        Parameters
        ----------
        s : (q,) array, length
            Parameters; on a closed front any number of turns, on an open one beyond its ends.

        Returns
        -------
        x : (q, 3) array, length
        frame : (q, 3, 3) array
            Rows (t, n, b).
        turn : (q, 4) array
            Curvatures kt, kn, twist, speed.
        """
        from xcrack.crack.kernels.front import frames_at

        u = np.ascontiguousarray(s, dtype=float)
        u = np.mod(u, self.length) if self.is_closed else u
        return frames_at(u, self.breaks, self.place, self.normal)

    def feet(self, x: Floats) -> FootPoints:
        """Nearest points of the front.

        Parameters
        ----------
        x : (q, 3) array, length

        Returns
        -------
        FootPoints
            Unique where the metric is positive, that is nearer than the radius of curvature.
        """
        return self.points_near(x, np.inf)[1]

    def points_near(self, x: Floats, radius: float) -> tuple[Ints, FootPoints]:
        """Points within a radius of the front, and a few more, with their feet.

        Parameters
        ----------
        x : (q, 3) array, length
        radius : float, length

        Returns
        -------
        rows : (k,) array of int
            Which points; without those beyond gaps.
        feet : FootPoints
            Theirs.
        """
        from xcrack.crack.kernels.front import feet
        from xcrack.mesh.kernels.location import nearest_vertices

        s, samples = self._guesses
        step = float(np.diff(s).max())
        sample, _ = nearest_vertices(lock(x.view()), samples, radius + step)
        rows = np.nonzero(sample >= 0)[0]
        picked = np.ascontiguousarray(x[rows], dtype=float)
        curve = (self.breaks, self.place, self.normal, self.is_closed)
        points = FootPoints(*feet(picked, s[sample[rows]], 2 * step, *curve))
        is_on_front = (points.s > -self.gaps[0]) & (points.s < self.length + self.gaps[1])
        if is_on_front.all():
            return rows, points
        return rows[is_on_front], points.subset(is_on_front)

    def distance(self, x: Floats, bound: float = np.inf) -> Floats:
        """Distance of points to the samples of the front `(q,)`; inf beyond a bound, length.

        It bounds the distance to the front from above.
        """
        from xcrack.mesh.kernels.location import nearest_vertices

        # Read-only as everywhere: a kernel is compiled once more for arrays that are not.
        return np.asarray(nearest_vertices(lock(x.view()), self._guesses[1], bound)[1])

    def bend(self, s: Floats, length_of_mean: float) -> Floats:
        """Radius of curvature, averaged over a length: a much shorter bend counts for little.

        Parameters
        ----------
        s : (q,) array, length
        length_of_mean : float, length

        Returns
        -------
        (q,) array, length
            inf where a front is straight.
        """
        start, stop = np.asarray(s) - length_of_mean / 2, np.asarray(s) + length_of_mean / 2
        if not self.is_closed:
            start, stop = np.clip(start, 0.0, self.length), np.clip(stop, 0.0, self.length)
        tangent_ahead, tangent_behind = self.at(stop)[1][:, 2], self.at(start)[1][:, 2]
        angle = 2 * np.arcsin(
            np.minimum(np.linalg.norm(tangent_ahead - tangent_behind, axis=1) / 2, 1.0)
        )
        is_straight = angle * self.length <= _STRAIGHT * (stop - start)
        return np.where(is_straight, np.inf, (stop - start) / np.where(is_straight, 1.0, angle))

    def arc(self, s: Floats) -> Floats:
        """Arc length from the first vertex `(q,)` at parameters within the breaks."""
        u = np.asarray(s, dtype=float)
        piece = np.clip(np.searchsorted(self.breaks, u, side="right") - 1, 0, len(self.breaks) - 2)
        begin = self.breaks[piece]
        t = begin[:, None] + (u - begin)[:, None] * (_GAUSS[0] + 1) / 2
        speed = self.at(t.ravel())[2][:, 3].reshape(t.shape)
        return np.asarray(begin + (u - begin) * (speed @ _GAUSS[1]) / 2)


def front_curve(x: Floats, frame: Floats, is_closed: bool) -> FrontCurve:
    """Smooth curve through the vertices of a front.

    Parameters
    ----------
    x : (m, 3) array, length
        Vertices in the direction of b; the last of a closed front may repeat the first.
    frame : (m, 3, 3) array
        Rows (t, n, b); only the normals n count, t and b follow from the curve.
    is_closed : bool

    Returns
    -------
    FrontCurve

    Raises
    ------
    GeometryError
        Too few vertices, coinciding ones, or vertices that run against b.

    Examples
    --------
    A straight front along y with the normal z runs in the direction of b = x × z = -y.

    >>> frame = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    >>> curve = front_curve(np.array([[0, 1.0, 0], [0, -1, 0]]), np.stack([frame, frame]), False)
    >>> curve.length
    2.0
    """
    from scipy.interpolate import CubicSpline  # a sixth of what a Problem imports

    x, normal = np.asarray(x, dtype=float), np.asarray(frame, dtype=float)[:, 1]
    b = np.asarray(frame, dtype=float)[:, 2]
    if is_closed and len(x) > 1 and np.allclose(x[0], x[-1], atol=1e-12 * np.ptp(x)):
        x, normal, b = x[:-1], normal[:-1], b[:-1]
    if len(x) < (3 if is_closed else 2):
        raise GeometryError(f"a crack front needs more than {len(x)} points.")
    if is_closed:
        x, normal, b = (np.concatenate([v, v[:1]]) for v in (x, normal, b))
    chord = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if chord.min() <= 1e-9 * chord.sum():
        spot = np.round(x[int(np.argmin(chord))], 6).tolist()
        raise GeometryError(f"two vertices of a crack front coincide at {spot}: leave one out.")
    if np.einsum("md,md->", np.diff(x, axis=0), b[1:] + b[:-1]) < 0:
        raise GeometryError("the vertices of a crack front run against b = t × n: reverse them.")
    ends = "periodic" if is_closed else "not-a-knot"
    break_arcs = np.concatenate([[0.0], np.cumsum(chord)])
    for _ in range(_ARCS):
        place = CubicSpline(break_arcs, x, bc_type=ends)
        step = np.diff(break_arcs)
        t = break_arcs[:-1, None] + step[:, None] * (_GAUSS[0] + 1) / 2
        speed = np.linalg.norm(place(t, 1), axis=2)
        previous_arcs = break_arcs
        break_arcs = np.concatenate([[0.0], np.cumsum(step * (speed @ _GAUSS[1]) / 2)])
        if np.abs(break_arcs - previous_arcs).max() <= _SAME * break_arcs[-1]:
            break
    spline = CubicSpline(break_arcs, np.concatenate([x, normal], axis=1), bc_type=ends)
    return FrontCurve(
        lock(break_arcs),
        lock(np.ascontiguousarray(spline.c[..., :3])),
        lock(np.ascontiguousarray(spline.c[..., 3:])),
        is_closed,
    )


def joined_front(fronts: Sequence[Front], goes_round: bool) -> tuple[Front, list[float]]:
    """Fronts in a row as one, and where on it each of them begins."""
    if len(fronts) == 1 and fronts[0].is_closed == goes_round:
        return fronts[0], [0.0]
    x = np.concatenate([front.x for front in fronts])
    frame = np.concatenate([front.frame for front in fronts])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    number = np.concatenate([front.number for front in fronts])
    first = np.cumsum([0, *(len(front.x) for front in fronts[:-1])])
    front_of_all = Front(x, frame, goes_round, s, number)
    return front_of_all, front_curve(x, frame, goes_round).breaks[first].tolist()


__all__ = [
    "FootPoints",
    "Front",
    "FrontCurve",
    "closed_fronts",
    "front_curve",
    "front_frames",
    "front_weights",
    "is_closed",
    "joined_front",
    "steps",
    "tangents",
]
