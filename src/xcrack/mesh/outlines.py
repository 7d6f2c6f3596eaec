"""Outlines of plane bodies: straight sides and arcs that close."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import acos, asin, atan2, ceil, hypot, inf, pi
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, at
from xcrack.base.checks import point_coordinates, value_text
from xcrack.base.errors import GeometryError
from xcrack.mesh.parts import box_of, selector
from xcrack.mesh.polygon import Arc, is_within, self_crossing

Point = tuple[float, float]
_CHORDS = 32  # of an arc, where it is looked at as a polygon
_ROUND = 1e-9  # of the size of a body: ends as close as this are one


@dataclass(frozen=True)
class Side:
    """A straight side or an arc of an outline.

    Attributes
    ----------
    start, end : (2,) floats, length
    center : (2,) floats, length, optional
        Of an arc.
    turn : float, rad
        Angle that an arc runs through, positive counter-clockwise.
    name : str
        Facet set that it belongs to; empty for none.
    number : int
        Of the side as it was given, from 0.
    """

    start: Point
    end: Point
    center: Point | None = None
    turn: float = 0.0
    name: str = ""
    number: int = 0

    @property
    def radius(self) -> float:
        """Radius of an arc, infinite of a straight side."""
        if self.center is None:
            return inf
        return hypot(self.start[0] - self.center[0], self.start[1] - self.center[1])

    @property
    def length(self) -> float:
        """Its length."""
        if self.center is None:
            return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])
        return abs(self.turn) * self.radius

    @property
    def curve(self) -> Arc | None:
        """The circle of an arc."""
        return None if self.center is None else Arc(self.center, self.radius)

    def at(self, share: Floats) -> Floats:
        """Points on it at shares of its length `(n, 2)`."""
        start, end = np.array(self.start), np.array(self.end)
        if self.center is None:
            return np.asarray(start + share[:, None] * (end - start))
        first = atan2(self.start[1] - self.center[1], self.start[0] - self.center[0])
        angle = first + share * self.turn
        unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.asarray(np.array(self.center) + self.radius * unit)

    def cut_at(self, shares: Sequence[float]) -> list["Side"]:
        """It in parts that end at shares of its length, which grow."""
        ends = [tuple(x) for x in self.at(np.array(shares, dtype=float)).tolist()]
        corners, turns = [self.start, *ends, self.end], np.diff([0.0, *shares, 1.0]) * self.turn
        return [
            replace(self, start=a, end=b, turn=float(turn))
            for a, b, turn in zip(corners, corners[1:], turns, strict=False)
        ]

    def parts(self, largest_turn: float) -> list["Side"]:
        """It in equal parts that turn by no more than an angle each."""
        n = max(ceil(abs(self.turn) / largest_turn - 1e-9), 1)
        return self.cut_at((np.arange(1, n) / n).tolist())

    def crossings(self, axis: int, value: float) -> list[float]:
        """Shares of its length at which a coordinate has a value."""
        if self.center is None:
            extent = self.end[axis] - self.start[axis]
            return [(value - self.start[axis]) / extent] if extent else []
        height = (value - self.center[axis]) / self.radius
        if abs(height) > 1:
            return []
        x, y = (self.start[k] - self.center[k] for k in (0, 1))
        first, angle = atan2(y, x), acos(height) if axis == 0 else asin(height)
        angles = (angle, -angle) if axis == 0 else (angle, pi - angle)
        sign = 1 if self.turn > 0 else -1
        return [sign * ((sign * (a - first)) % (2 * pi)) / self.turn for a in angles]


def rectangle(lower: Point, width: float, height: float) -> list[Side]:
    """The four sides of a rectangle by name."""
    (x0, y0), x1, y1 = lower, lower[0] + width, lower[1] + height
    corner = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    names = ("bottom", "right", "top", "left")
    return [Side(corner[i], corner[(i + 1) % 4], name=names[i], number=i) for i in range(4)]


def sides_of(outline: Any) -> list[Side]:
    """Sides of an outline as a user gives it.

    Parameters
    ----------
    outline : sequence
        Its first entry is a point. Each further one is a point, to which a straight side leads; or
        a pair of points, through the first of which an arc leads to the second. A straight side
        closes it where the last point is not the first one.

    Raises
    ------
    GeometryError
        Something else, fewer than two sides, sides that cross, an arc through three points of one
        line.
    """
    entries = _entries(outline)
    if len(entries) < 2 or len(entries[0]) != 1:
        raise GeometryError(
            f"outline = {value_text(outline)}: give points in order, such as [(0, 0), (4, 0), "
            "((5, 1), (4, 2)), (0, 2)], where a pair of points is an arc through the first one to "
            "the second."
        )
    points = np.concatenate(entries)
    size = float(np.ptp(points, axis=0).max())
    start = entries[0][0]
    sides: list[Side] = []
    for n, entry in enumerate([*entries[1:], entries[0]]):
        end = entry[-1]
        is_closing = n == len(entries) - 1
        if np.linalg.norm(end - start) <= _ROUND * size and len(entry) == 1:
            if is_closing:
                break
            raise GeometryError(
                f"outline: the point {at(end)} comes twice, one after the other: leave one out."
            )
        center, turn = (None, 0.0) if len(entry) == 1 else _arc(start, entry[0], end)
        first = (float(start[0]), float(start[1]))
        stop = sides[0].start if _is_first(sides, end, size) else (float(end[0]), float(end[1]))
        sides.append(Side(first, stop, center, turn, f"arc_{n}" if center else "", n))
        start = end
    if len(sides) < (2 if any(side.center for side in sides) else 3):
        raise GeometryError("outline: it encloses nothing: give an arc and a side, or three sides.")
    polygon = polygon_of(sides)
    crossing = self_crossing(polygon)
    if crossing is not None:
        raise GeometryError(
            f"outline: it crosses itself near {at(polygon[crossing[0]])}: give its points in the "
            "order in which one walks around it."
        )
    return sides


def _is_first(sides: Sequence[Side], end: Floats, size: float) -> bool:
    return bool(sides) and bool(np.linalg.norm(end - np.array(sides[0].start)) <= _ROUND * size)


def _entries(outline: Any) -> list[Floats]:
    """Points of each entry: one, or two of an arc."""
    try:
        entries = list(outline)
        is_nested = [bool(np.ndim(entry[0])) for entry in entries]
    except Exception:  # whatever an object's own methods raise
        return []
    return [
        point_coordinates(entry if has_many else [entry], "outline", (2 if has_many else 1, 2),
                    error=GeometryError)
        for entry, has_many in zip(entries, is_nested, strict=True)
    ]  # fmt: skip


def _arc(start: Floats, middle: Floats, end: Floats) -> tuple[Point, float]:
    """Centre and angle of an arc through a point; a full circle where it comes back."""
    a, b = middle - start, end - start
    area = 2 * (a[0] * b[1] - a[1] * b[0])
    if abs(area) <= 1e-9 * max(float(a @ a), float(b @ b)):
        raise GeometryError(
            f"outline: the points {at(start)}, {at(middle)} and {at(end)} of an arc lie on one "
            "line: give a point beside it, or a straight side."
        )
    x = (b[1] * (a @ a) - a[1] * (b @ b)) / area
    y = (a[0] * (b @ b) - b[0] * (a @ a)) / area
    center = (float(start[0] + x), float(start[1] + y))
    alpha, beta = (atan2(p[1] - center[1], p[0] - center[0]) for p in (start, end))
    turn = (beta - alpha) % (2 * pi)
    return center, turn if area > 0 else turn - 2 * pi


def polygon_of(sides: Sequence[Side]) -> Floats:
    """Corners of a polygon along the sides `(m, 2)`."""
    share = np.arange(_CHORDS) / _CHORDS
    return np.concatenate([side.at(share if side.center else np.zeros(1)) for side in sides])


def split_sides(sides: Sequence[Side], sets: Mapping[str, Any]) -> list[Side]:
    """Sides with corners where boxes of sets end."""
    limits: list[tuple[int, float, Callable[[Floats], Bools]]] = []
    for name, choice in sets.items():
        if not callable(choice) and not _are_numbers(choice):
            label = f"sets[{name!r}]"
            limits += [
                (axis, value, selector(choice, 2, label))
                for corner in box_of(choice, 2, label)
                for axis, value in enumerate(corner.tolist())
                if np.isfinite(value)
            ]
    result: list[Side] = []
    for side in sides:
        shares = {
            round(share, 12)
            for axis, value, is_inside in limits
            for share in side.crossings(axis, value)
            if _ROUND < share < 1 - _ROUND and is_inside(side.at(np.array([share])))[0]
        }
        result += side.cut_at(sorted(shares))
    return result


def _are_numbers(choice: Any) -> bool:
    """Whether a choice is a list of numbers of sides."""
    return isinstance(choice, Sequence) and all(
        isinstance(n, int) and not isinstance(n, bool) for n in choice
    )


def distance_to(sides: Sequence[Side], x: Point) -> float:
    """Distance of a point from an outline."""
    distance = inf
    for side in sides:
        ends = [hypot(x[0] - p[0], x[1] - p[1]) for p in (side.start, side.end)]
        if side.center is None:
            a, b = np.array(side.start), np.array(side.end)
            direction = (b - a) / hypot(*(b - a))
            t = float(np.clip((np.array(x) - a) @ direction / hypot(*(b - a)), 0, 1))
            foot = a + t * (b - a)
            distance = min(distance, hypot(x[0] - foot[0], x[1] - foot[1]))
            continue
        (cx, cy), (sx, sy) = side.center, side.start
        angle = atan2(x[1] - cy, x[0] - cx) - atan2(sy - cy, sx - cx)
        angle = angle % (2 * pi) if side.turn > 0 else -((-angle) % (2 * pi))
        on_arc = abs(hypot(x[0] - cx, x[1] - cy) - side.radius)
        distance = min(distance, on_arc if abs(angle) <= abs(side.turn) else min(ends))
    return distance


def is_inside(sides: Sequence[Side], x: Point) -> bool:
    """Whether a point lies inside an outline."""
    polygon = polygon_of(sides)
    edges = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)
    return bool(is_within(np.array([x]), edges)[0])


def finer_at_arcs(
    size: Callable[[float, float], float], sides: Sequence[Side], edges: int, slope: float
) -> Callable[[float, float], float]:
    """A cell size that is small on arcs: so many edges a full turn, growing away from them."""
    spots = []
    for side in sides:
        if side.center is not None:
            n = max(ceil(abs(side.turn) * edges / (2 * pi)), 2)
            h = 2 * pi * side.radius / edges
            spots += [(x, y, h) for x, y in side.at(np.linspace(0, 1, n)).tolist()]
    if not spots:
        return size

    def finer_spacing(x: float, y: float) -> float:
        near_spots = min(h + slope * hypot(x - a, y - b) for a, b, h in spots)
        return min(size(x, y), near_spots)

    return finer_spacing


__all__ = [
    "Side",
    "distance_to",
    "finer_at_arcs",
    "is_inside",
    "polygon_of",
    "rectangle",
    "sides_of",
    "split_sides",
]
