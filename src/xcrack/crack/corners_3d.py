"""Corners of plane cracks rounded, and the plane triangulated anew between the new outlines."""

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from xcrack.arrays import Bools, Floats, Ints, at
from xcrack.errors import CoarseMeshError
from xcrack.geometry.polygon import cross, within
from xcrack.geometry.triangulation import face_normals, loops, on_rim

_CORNER = np.cos(np.radians(30.0))  # an outline that turns by more has a corner
_PIECE = np.radians(18.0)  # turn between the sides of an arc
_ROOM = 0.45  # share of the way to the next corner that an arc may take


def rounded(points: Floats, faces: Ints, corners: Ints, radius: Floats) -> tuple[Floats, Ints]:
    """Round some corners of a plane surface by arcs, hollow ones as well.

    Parameters
    ----------
    points : (p, 3) array, length
        In one plane.
    faces : (f, 3) array of int
        Oriented alike.
    corners : (k,) array of int
        Point numbers of the corners.
    radius : (k,) array, length
        Smaller where the next corner is too near.

    Returns
    -------
    points : (q, 3) array, length
    faces : (g, 3) array of int
        New numbers; the outline comes first.

    Raises
    ------
    GeometryError
        The new outline crosses itself.
    """
    normal = face_normals(points, faces)[0]
    first = points[faces[0, 1]] - points[faces[0, 0]]
    first = first / np.linalg.norm(first)
    plane = np.stack([first, np.cross(normal, first)])
    wanted = dict(zip(corners.tolist(), radius.tolist(), strict=True))
    outlines = [_rounded_loop(points[loop], loop, wanted) for loop in loops(faces)]
    rim = np.zeros(len(points), dtype=bool)
    rim[np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[on_rim(faces)].ravel()] = True
    outline = np.concatenate(outlines)
    inner = points[~rim]
    inner = inner[_roomy(inner, outline)]
    origin = points[faces[0, 0]]
    return _triangulated(outlines, inner, origin, plane)


def _rounded_loop(x: Floats, loop: Ints, wanted: dict[int, float]) -> Floats:
    """Points of one loop with arcs in place of some of its corners."""
    m = len(x)
    along = np.roll(x, -1, axis=0) - x
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    turn = np.einsum("ij,ij->i", along, np.roll(along, 1, axis=0))
    sharp = turn < _CORNER
    s = np.concatenate([[0.0], np.cumsum(length)])
    total = s[-1]
    at = s[:-1][sharp]
    keep = np.ones(m, dtype=bool)
    pieces: list[tuple[float, Floats]] = []
    for i in np.nonzero(sharp)[0]:
        radius = wanted.get(int(loop[i]))
        if radius is None:
            continue
        gap = np.abs(at - s[i])
        gap = np.minimum(gap, total - gap)
        others = np.sort(gap)[1:]
        half = np.arccos(np.clip(turn[i], -1, 1)) / 2
        reach = min(radius * np.tan(half), _ROOM * float(np.min(others, initial=total / 2)))
        arc = _arc(x, s, int(i), reach, half)
        away = np.abs(s[:-1] - s[i])
        away = np.minimum(away, total - away)
        # What is left of the side that the arc ends on should not be a splinter.
        keep &= (away > reach + 0.4 * np.minimum(length, radius)) | (sharp & (away > reach))
        pieces.append((float(s[i]), arc))
    rows = [(float(s[i]), x[i : i + 1]) for i in np.nonzero(keep)[0]] + pieces
    rows.sort(key=lambda row: row[0])
    return np.concatenate([row for _, row in rows])


def _arc(x: Floats, s: Floats, i: int, reach: float, half: float) -> Floats:
    """Points of the arc from `reach` before point i of a loop to as much behind it.

    A rational quadratic with weight cos(turn / 2) is the circle where the sides are straight.
    """
    a, b = _at(x, s, s[i] - reach), _at(x, s, s[i] + reach)
    n = max(3, int(np.ceil(2 * half / _PIECE)))
    # Equal angles in the parameter of the circle.
    angle = np.linspace(-half, half, n + 1)
    t = 0.5 * (1 + np.tan(angle / 2) / np.tan(half / 2))
    one, two, three = (1 - t) ** 2, 2 * np.cos(half) * t * (1 - t), t**2
    weight = one + two + three
    return np.asarray(
        (one[:, None] * a + two[:, None] * x[i] + three[:, None] * b) / weight[:, None]
    )


def _at(x: Floats, s: Floats, place: float) -> Floats:
    """Point of a closed polyline at an arc length."""
    place = place % s[-1]
    j = min(int(np.searchsorted(s, place, side="right")) - 1, len(x) - 1)
    share = (place - s[j]) / (s[j + 1] - s[j])
    return np.asarray(x[j] + share * (x[(j + 1) % len(x)] - x[j]))


def _roomy(inner: Floats, outline: Floats) -> Bools:
    """Inner points not too close to the outline for well-shaped triangles."""
    if not len(inner):
        return np.zeros(0, dtype=bool)
    distance, near = cKDTree(outline).query(inner)
    spacing = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
    return np.asarray(distance > 0.6 * np.maximum(spacing, np.roll(spacing, -1))[near])


def _triangulated(
    outlines: list[Floats], inner: Floats, origin: Floats, plane: Floats
) -> tuple[Floats, Ints]:
    """Triangles between outlines through the given inner points."""
    for _ in range(30):
        points = np.concatenate([*outlines, inner])
        edges = _edges(outlines)
        flat = (points - origin) @ plane.T
        if len(inner):
            inside = within(flat, flat[edges])
            inside[: len(points) - len(inner)] = True
            inner = inner[inside[len(points) - len(inner) :]]
            points, flat = points[inside], flat[inside]
        faces = Delaunay(flat).simplices.astype(np.int64)
        corner = flat[faces]
        area = cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        faces = np.where(area[:, None] < 0, faces[:, ::-1], faces)
        longest = np.max(np.sum((corner - np.roll(corner, 1, axis=1)) ** 2, axis=2), axis=1)
        # Three points of a straight side leave triangles that are round-off.
        faces = faces[(np.abs(area) > 1e-9 * longest) & within(corner.mean(axis=1), flat[edges])]
        rim = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[on_rim(faces)]
        outer = {(int(b), int(a)) for a, b in rim}
        missing = np.array([tuple(edge) not in outer for edge in edges.tolist()])
        if not missing.any() and len(outer) == len(edges):
            used, inverse = np.unique(faces, return_inverse=True)
            return points[used], inverse.reshape(-1, 3)
        present = np.isin(
            np.sort(edges, axis=1) @ np.array([len(points), 1]),
            (np.sort(rim, axis=1) @ np.array([len(points), 1])),
        )
        outlines = _halved(outlines, ~present)
    raise CoarseMeshError(
        f"the plane crack at {at(origin)} has an outline too narrow for rounded "
        "corners: refine the mesh there, or simplify the crack."
    )


def _edges(outlines: list[Floats]) -> Ints:
    """Sides of all outlines as point numbers `(k, 2)`."""
    result, begin = [], 0
    for outline in outlines:
        i = np.arange(len(outline))
        result.append(begin + np.stack([i, (i + 1) % len(outline)], axis=1))
        begin += len(outline)
    return np.concatenate(result)


def _halved(outlines: list[Floats], flag: Bools) -> list[Floats]:
    """Outlines with a point in the middle of every flagged side."""
    result, begin = [], 0
    for x in outlines:
        cut = np.nonzero(flag[begin : begin + len(x)])[0]
        middle = (x[cut] + x[(cut + 1) % len(x)]) / 2
        result.append(np.insert(x, cut + 1, middle, axis=0))
        begin += len(x)
    return result
