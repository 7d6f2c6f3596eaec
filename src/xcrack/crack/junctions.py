"""Cracks in 2D that end on other cracks: where, from which side, and what lies too close.

A placed crack whose end lies inside the body and is no tip ends there on another crack. The end is
a point of its polyline, so that cracks alone say which of them meet: growth, run files and meshes
need to know nothing besides.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, at
from xcrack.base.errors import CoarseMeshError, GeometryError
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.lines import crossing_points, polyline_crack
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.locate import cells_at, contains, nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import leg_size

_ON = 0.1  # share of a cell within which an end is meant to lie on another crack
_SAME = 1e-6  # share of a cell within which the end of a placed crack lies on another one
_SINE = np.sin(np.radians(10.0))  # of the smallest angle between two cracks that meet
_BEYOND = 1.6  # cells by which a crack is prolonged beyond the other one, across it
_BEFORE_TIP = 1.3  # cells before the next tip of both up to which it is
_LEAST = 1.0  # cells to a third crack beyond it below which nothing can be resolved
_APART = 1.0  # cells between a junction and a tip, or another junction on the same side
REACH = 3.2  # cells around a junction in which sides are those of the junction


@dataclass(frozen=True, eq=False)
class Junction:
    """An end of one crack on another one.

    Attributes
    ----------
    crack, end : int
        The crack that ends, and the number of the point.
    on : int
        The crack that it ends on.
    x : (2,) array, length
    side : int
        Side of the other crack, +1 or -1, from which it comes.
    prolongation_end : (2,) array, length
        Point on the other side up to which the level set of the crack is prolonged.
    reach : float, length
        Radius of the neighbourhood in which the crack is cut off by the other one.
    """

    crack: int
    end: int
    on: int
    x: Floats
    side: int
    prolongation_end: Floats
    reach: float


def on_others(
    given_cracks: Sequence[Crack], cracks: tuple[Crack, ...], mesh: Mesh
) -> tuple[Crack, ...]:
    """Cracks whose ends on other cracks are no tips, moved onto them exactly.

    Parameters
    ----------
    given_cracks : sequence of Crack
        Cracks whose tips are known there keep them.
    cracks : tuple of Crack
        The same ones, placed in the mesh.
    mesh : Mesh
    """
    if len(cracks) < 2:
        return cracks
    result = list(cracks)
    for c, crack in enumerate(cracks):
        for tip in (crack.tips or ()) if given_cracks[c].tips is None else ():
            end, previous_point = crack.points[tip], crack.points[1 if tip == 0 else tip - 1]
            on = _ends_on(c, previous_point, end, result, _size(mesh, end))
            if on is None:
                continue
            points = np.array(result[c].points)
            points[tip] = _on_line(previous_point, end, result[on].points)
            tips = tuple(t for t in result[c].tips or () if t != tip)
            result[c] = Crack(points, crack.faces, tips)
    return tuple(result)


def _ends_on(
    c: int, previous_point: Floats, end: Floats, cracks: Sequence[Crack], size: float
) -> int | None:
    """The crack that is meant where crack c ends close to others; None where it has a tip.

    Cracks that it lies along do not count: the arm on the other side of an X is one, and placing
    refuses those that overlap it. Of others those count first that do not end there too.
    """
    direction = (end - previous_point) / np.linalg.norm(end - previous_point)
    best_rank, on = (True, np.inf), None
    for k, crack in enumerate(cracks):
        if k == c:
            continue
        foot, distance = _nearest_point(end, crack.points)
        if distance > _ON * size or _sine(direction, _arms(foot, crack.points, size)) < 1e-3:
            continue
        to_ends = np.linalg.norm(crack.points[[0, -1]] - foot, axis=1)
        rank = bool(to_ends.min() < _APART * size), distance
        if rank < best_rank:
            best_rank, on = rank, k
    return on


def _nearest_point(x: Floats, line: Floats) -> tuple[Floats, float]:
    """Point of a polyline that is nearest to x, and its distance."""
    foot = closest_on_segment(x, line[:-1], line[1:])
    distance = np.linalg.norm(foot - x, axis=1)
    k = int(np.argmin(distance))
    return foot[k], float(distance[k])


def _on_line(previous_point: Floats, end: Floats, line: Floats) -> Floats:
    """Where the last piece of a crack, prolonged, meets the polyline that it ends close to."""
    foot, distance = _nearest_point(end, line)
    if distance == 0:
        return end
    hits = crossing_points(np.stack([previous_point, end + (end - previous_point)]), line)
    from_end = np.linalg.norm(hits - end, axis=1)
    # A crack that comes in at a small angle meets the other one far from the foot of its end.
    if len(hits) and from_end.min() <= distance / _SINE:
        return np.asarray(hits[int(np.argmin(from_end))])
    return foot


def _size(mesh: Mesh, x: Floats) -> float:
    return leg_size(mesh, cells_at(mesh, x[None]))


def junctions(cracks: tuple[Crack, ...], mesh: Mesh) -> tuple[Junction, ...]:
    """Where placed cracks end on others, by crack and end.

    Raises
    ------
    GeometryError
        An end in the body that is neither a tip nor on another crack, or on the end of one; a
        junction close to a tip or to another one; two cracks that meet at less than 10 degrees.
    """
    result = []
    for c, crack in enumerate(cracks):
        last_point = len(crack.points) - 1
        ends = [end for end in (0, last_point) if end not in (crack.tips or ())]
        if not ends:
            continue
        for end, is_inside in zip(ends, contains(mesh, crack.points[ends]).tolist()):
            # The last step of a run has cracks that end on the boundary itself.
            if is_inside and not _on_boundary(crack.points[end], mesh):
                result.append(_junction(c, end, cracks, mesh))
    _check_apart(result, cracks, mesh)
    return tuple(result)


def _on_boundary(x: Floats, mesh: Mesh) -> bool:
    gap, size = nearest_boundary(mesh, x)
    return gap <= _SAME * size


def _junction(c: int, end: int, cracks: tuple[Crack, ...], mesh: Mesh) -> Junction:
    x, h = cracks[c].points[end], _size(mesh, cracks[c].points[end])
    on = _crack_at(c, x, cracks, h)
    previous_point = cracks[c].points[1 if end == 0 else end - 1]
    length = float(np.linalg.norm(x - previous_point))
    direction = (x - previous_point) / length
    line = cracks[on].points
    sine = _sine(direction, _arms(x, line, h))
    if sine < _SINE:
        raise GeometryError(
            f"crack {c} ends on crack {on} at {at(x)} at an angle of "
            f"{np.degrees(np.arcsin(sine)):.3g} degrees, or runs on along it: below 10 degrees "
            "they are not told apart. Of three arms give the two that are nearly in line as one "
            "crack, and let the third end on it."
        )
    step = min(0.1 * h * sine, 0.5 * length) * direction
    side = _side(x - step, line)
    if _side(x + step, line) == side:
        raise GeometryError(
            f"crack {c} ends on a kink of crack {on} at {at(x)}, from outside, and would come out "
            "on the same side again: of three arms give the two that are most nearly in line as "
            "one crack, and let the third end on it."
        )
    # What lies beyond is taken away again, but only within a reach that ends before the next tip.
    tips = [p for k in (c, on) for p in tip_frames(cracks[k])[0]]
    to_tip = min((float(np.linalg.norm(p - x)) for p in tips), default=np.inf)
    way = min(_BEYOND * h / sine, max(to_tip - _BEFORE_TIP * h, _BEYOND * h))
    crossings = crossing_points(np.stack([x + 1e-3 * h * direction, x + 2 * way * direction]), line)
    free_length = float(np.linalg.norm(crossings - x, axis=1).min(initial=np.inf)) / 2
    if free_length < _LEAST * h:
        raise CoarseMeshError(
            f"crack {on}, on which crack {c} ends at {at(x)}, turns back to it within "
            f"{2 * free_length:.4g}, two cells ({h:.4g}) or less: refine the mesh there."
        )
    reach = max(REACH, 2 / sine + 2) * h
    return Junction(c, end, on, x, side, x + min(way, free_length) * direction, reach)


def _crack_at(c: int, x: Floats, cracks: tuple[Crack, ...], h: float) -> int:
    """The crack on which x lies between its ends; of several the one with its ends farthest."""
    largest_distance, on = -1.0, -1
    for k, crack in enumerate(cracks):
        if k == c or _nearest_point(x, crack.points)[1] > _SAME * h:
            continue
        to_ends = float(np.linalg.norm(crack.points[[0, -1]] - x, axis=1).min())
        if to_ends > largest_distance:
            largest_distance, on = to_ends, k
    if largest_distance > _SAME * h:
        return on
    if on >= 0:
        raise GeometryError(
            f"crack {c} ends at {at(x)} on the end of crack {on}: give both as one crack; of "
            "three arms give two as one crack, and let the third end between its ends."
        )
    raise GeometryError(
        f"crack {c} ends at {at(x)} inside the body, but this end is neither a tip nor on another "
        "crack: end it on one, or make it with line_crack, which leaves that to the mesh."
    )


def _arms(x: Floats, line: Floats, h: float) -> Floats:
    """Directions of the pieces of a polyline at one of its points."""
    foot = closest_on_segment(x, line[:-1], line[1:])
    pieces = np.linalg.norm(foot - x, axis=1) <= _SAME * h
    pieces_at_point = np.diff(line, axis=0)[pieces]
    return np.asarray(pieces_at_point / np.linalg.norm(pieces_at_point, axis=1, keepdims=True))


def _sine(direction: Floats, arms: Floats) -> float:
    return float(np.abs(direction[0] * arms[:, 1] - direction[1] * arms[:, 0]).min())


def _side(x: Floats, line: Floats) -> int:
    """Side of a polyline on which a point next to it lies."""
    from xcrack.mesh.kernels.location import polyline_distance

    return 1 if polyline_distance(x[None], line)[0][0] > 0 else -1


def _check_apart(result: list[Junction], cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where a junction is closer than a cell to a tip, an end or a junction beside it."""
    for i, junction in enumerate(result):
        least_distance = _APART * _size(mesh, junction.x)
        for c, crack in enumerate(cracks):
            for tip in crack.tips or ():
                distance = float(np.linalg.norm(crack.points[tip] - junction.x))
                if distance < least_distance:
                    raise CoarseMeshError(
                        f"crack {junction.crack} ends on crack {junction.on} at {at(junction.x)}, "
                        f"{distance:.4g} from a tip of crack {c} at {at(crack.points[tip])} and "
                        f"closer than a cell ({least_distance:.4g}): move it away from the tip, "
                        f"refine the mesh there, or let both cracks be one that runs through."
                    )
        for joint in result[:i]:
            distance = float(np.linalg.norm(joint.x - junction.x))
            is_opposite = joint.on == junction.on and joint.side != junction.side
            if distance < least_distance and not is_opposite:
                raise GeometryError(
                    f"cracks {joint.crack} and {junction.crack} end {distance:.4g} from each other "
                    f"at {at(junction.x)}, closer than a cell ({least_distance:.4g}) and from the "
                    f"same side: let them end on each other's continuation, a cell or more apart, "
                    f"or on opposite sides of one crack."
                )


def prolonged_cracks(cracks: tuple[Crack, ...], ends: tuple[Junction, ...]) -> tuple[Crack, ...]:
    """Cracks prolonged beyond those on which they end: what level sets are made of."""
    result = list(cracks)
    for end_of_crack in ends:
        crack = result[end_of_crack.crack]
        points, tips = crack.points, crack.tips or ()
        if end_of_crack.end == 0:
            points, tips = (
                np.concatenate([end_of_crack.prolongation_end[None], points]),
                tuple(t + 1 for t in tips),
            )
        else:
            points = np.concatenate([points, end_of_crack.prolongation_end[None]])
        result[end_of_crack.crack] = polyline_crack(points, tips)
    return tuple(result)
