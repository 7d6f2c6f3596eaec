"""Cracks in 3D that end on the face of others: arms, where they meet, and what is too close.

An arm is a surface drawn through the crack on which it ends; only what lies on one side of that one
counts. Of two surfaces that cross one runs through, and the other is two arms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arguments import Part, Whole, check_arguments
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import GeometryError
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import Front, front_frames
from xcrack.mesh.distances import (
    TriangleTree,
    closest_in,
    first_crossing,
    signed_in,
    triangle_tree,
)
from xcrack.mesh.locate import Body
from xcrack.mesh.triangulation import sides

_LED = 2.2  # cells beyond it, to which a front that comes to its face is led
_BESIDE = 1.0  # cells beyond their smallest distance, up to which a front is led on before another
_STEEP = 0.5  # sine of the angle from which on an arm is led out as far as from the body
_LEAST_SINE = 1e-2  # surfaces at less lie along each other
_LEG = 3**-0.5  # leg of a cell over its longest edge


@check_arguments(GeometryError)
def arm(
    crack: Annotated[Crack, Part(Crack)],
    on: Annotated[int, Whole(least=0)],
    side: Annotated[int, Whole(least=-1, most=1)],
) -> Crack:
    """What of a 3D crack lies on one side of another one, on which it ends.

    Parameters
    ----------
    crack : Crack
        Drawn to the other one or through it; what lies beyond does not count.
    on : int
        Number of the other one in `Problem.cracks`. It runs through: where they meet it must reach
        at least a cell beyond the arm.
    side : {1, -1}
        Side of the other one that counts: 1 is that to which its normal points, its lip +.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        A crack in 2D, where ends that lie on others say the same.

    Notes
    -----
    An arm may end on several others. Two cracks that cross are one and two arms.

    Examples
    --------
    >>> from xcrack.crack.surfaces import penny_crack
    >>> one = penny_crack((0, 0, 0), (0, 0, 1), 0.6)
    >>> other = penny_crack((0, 0, 0), (1, 0, 0), 0.3)
    >>> crossing = [one, arm(other, 0, 1), arm(other, 0, -1)]
    """
    if side == 0:
        raise GeometryError("arm: side = 0: give 1 or -1, the side of the other crack that counts.")
    return replace(crack, ends_on=(*crack.ends_on, (int(on), int(side))))


def distance_to_side(cracks: Sequence[Crack], c: int, x: Floats) -> Floats:
    """Distance of points to the nearest crack on which crack c ends, negative beyond it `(n,)`."""
    result = np.full(len(x), np.inf)
    for on, side in cracks[c].ends_on:
        result = np.minimum(result, side * signed_distance(cracks[on], x))
    return result


def is_before(cracks: Sequence[Crack], c: int, x: Floats) -> Bools:
    """Which points do not lie beyond a crack on which crack c ends `(n,)`."""
    if not cracks[c].ends_on:
        return np.ones(len(x), dtype=bool)
    return np.asarray(distance_to_side(cracks, c, x) > 0)


@dataclass(frozen=True, eq=False)
class BodyBefore(Body):
    """What of a body lies before the cracks on which one ends: their faces are sides of it.

    Attributes
    ----------
    crack_trees : tuple of (TriangleTree, int)
        Those cracks, and the side of each that counts.
    arm : Crack
        The crack that ends on them.
    """

    crack_trees: tuple[tuple[TriangleTree, int], ...]
    arm: Crack

    @cached_property
    def _arm_tree(self) -> TriangleTree:
        return triangle_tree(self.arm.points, self.arm.faces)

    def depth(self, x: Floats) -> tuple[Floats, Floats]:
        """Distance to the boundary or to such a crack, negative inside, and the size there."""
        depth, size = super().depth(x)
        for tree, side in self.crack_trees:
            distance, face, _ = signed_in(tree, x)
            depth_beyond = -side * distance
            rows = np.nonzero(depth_beyond > 0)[0]
            if len(rows):
                depth_beyond[rows] *= self._stretch(x[rows], tree.normal[face[rows]])
            first = depth_beyond > depth
            depth = np.where(first, depth_beyond, depth)
            size = np.where(first, self.cell_size(x), size)
        return depth, size

    def _stretch(self, x: Floats, normal: Floats) -> Floats:
        """By how much more an arm beyond a crack counts that comes to it at less than 30 degrees.

        Its front is led out until it is some cells beyond: at a small angle that would be past the
        front of the other one.
        """
        arm_normal = self._arm_tree.normal[closest_in(self._arm_tree, x).triangle]
        sine = np.linalg.norm(np.cross(arm_normal, normal), axis=1)
        return np.asarray(np.maximum(_STEEP / np.maximum(sine, _LEAST_SINE), 1.0))


def body_before(cracks: Sequence[Crack], c: int, body: Body) -> Body:
    """The body for an arm among some cracks: without what lies beyond those on which it ends."""
    cracks_under = tuple(
        (triangle_tree(cracks[on].points, cracks[on].faces), side) for on, side in cracks[c].ends_on
    )
    return BodyBefore(body.mesh, body.boundary, body.facet_size, cracks_under, cracks[c])


def signed_distance(crack: Crack, x: Floats) -> Floats:
    """Distance of points to the faces of a crack, positive on the side of its lip + `(n,)`."""
    return signed_in(triangle_tree(crack.points, crack.faces), x)[0]


def may_touch(cracks: Sequence[Crack], i: int, j: int) -> bool:
    """Whether two cracks meet on purpose: one ends on the other, or both on opposite sides."""
    return _ends_on(cracks[i], j) or _ends_on(cracks[j], i) or are_opposite(cracks[i], cracks[j])


def _ends_on(crack: Crack, on: int) -> bool:
    return any(number == on for number, _ in crack.ends_on)


def are_opposite(crack_a: Crack, crack_b: Crack) -> bool:
    """Whether two cracks end on opposite sides of the same one."""
    return any((on, -side) in crack_b.ends_on for on, side in crack_a.ends_on)


def renumbered_arms(cracks: Sequence[Crack], i: int, k: int, is_aligned: bool) -> list[Crack]:
    """Cracks without number k, which has become part of i; `is_aligned` where both look one way.

    Raises
    ------
    GeometryError
        The two ended on each other, or on both sides of a third one.
    """
    result = [replace(crack, ends_on=()) for c, crack in enumerate(cracks) if c != k]
    for c, crack in enumerate(cracks):
        if not crack.ends_on:
            continue
        number = i if c == k else c
        number -= number > k
        ends = list(result[number].ends_on)
        for on, side in crack.ends_on:
            new_side = -side if on == k and not is_aligned else side
            end = ((i if on == k else on) - ((i if on == k else on) > k), new_side)
            if end[0] == number or (end[0], -new_side) in ends:
                raise GeometryError(
                    f"cracks {i} and {k} become one, which would end on itself or on both sides of "
                    "another one: end growth before, and give what has become of them."
                )
            ends += [end] if end not in ends else []
        result[number] = replace(result[number], ends_on=tuple(ends))
    return result


def check_numbers(cracks: Sequence[Crack]) -> None:
    """Raise where arms end on what is not there, on themselves, or in a circle."""
    for c, crack in enumerate(cracks):
        numbers_below, number = [c], c
        reached_cracks = {c}
        while numbers_below:
            number = numbers_below.pop()
            for on, _ in cracks[number].ends_on:
                if on >= len(cracks):
                    raise GeometryError(
                        f"crack {number} ends on crack {on}, but there are {len(cracks)}, numbered "
                        "from 0 on: give the number of one of them."
                    )
                if on == c:
                    raise GeometryError(
                        f"crack {c} ends on itself, or on one that ends on it: of cracks that meet "
                        "let one run through."
                    )
                if on not in reached_cracks:
                    reached_cracks.add(on)
                    numbers_below.append(on)
        if len({on for on, _ in crack.ends_on}) < len(crack.ends_on):
            raise GeometryError(
                f"crack {c} ends on one crack twice: give an arm for each side of it."
            )


# Fronts that come to the face of another crack: straight ahead through it, and arms from there.


@dataclass(frozen=True, eq=False)
class FaceAhead:
    """The face of a crack ahead of the front of another one.

    Attributes
    ----------
    crack, on : int
        Whose front it is, and whose face.
    width : float, length
        From the nearest place of the front straight ahead to the face.
    leg : float, length
        Of the cell there.
    x : (3,) array, length
        Where the face is met.
    """

    crack: int
    on: int
    width: float
    leg: float
    x: Floats


def face_ahead(
    cracks: Sequence[Crack], c: int, on: int, body: Body, reach: float
) -> FaceAhead | None:
    """Where the face of another crack is nearest straight ahead of the fronts of crack c.

    Parameters
    ----------
    cracks : sequence of Crack
        With fronts.
    c, on : int
    body : Body
    reach : float
        Legs of cells; farther away nothing is sought.
    """
    nearest_face = None
    for front, way, leg in _ways_to_face(cracks, c, on, body, reach):
        k = int(np.argmin(way))
        if np.isfinite(way[k]) and (nearest_face is None or way[k] < nearest_face.width):
            x = front.x[k] + way[k] * front.frame[k, 0]
            nearest_face = FaceAhead(c, on, float(way[k]), float(leg[k]), x)
    return nearest_face


def _ways_to_face(
    cracks: Sequence[Crack], c: int, on: int, body: Body, reach: float
) -> list[tuple[Front, Floats, Floats]]:
    """Fronts of crack c near another one: ways `(m,)` straight ahead to its face, legs of cells."""
    largest_reach = reach * _LEG * float(body.mesh.cell_size.max())
    box_min = cracks[on].points.min(axis=0) - largest_reach
    box_max = cracks[on].points.max(axis=0) + largest_reach
    result = []
    tree: TriangleTree | None = None
    body_of_crack = body
    for front in front_frames(cracks[c]):
        rows = np.nonzero(((front.x >= box_min) & (front.x <= box_max)).all(axis=1))[0]
        if not len(rows):
            continue
        if tree is None:
            tree = triangle_tree(cracks[on].points, cracks[on].faces)
            body_of_crack = body_before(cracks, c, body) if cracks[c].ends_on else body
        leg = _LEG * body.cell_size(front.x)
        start, advance = front.x[rows], (reach * leg[:, None] * front.frame[:, 0])[rows]
        triangle, share = first_crossing(tree, start, start + advance)
        is_met = (triangle >= 0) & body_of_crack.contains(start)
        is_met &= body_of_crack.contains(start + np.where(is_met, share, 0.0)[:, None] * advance)
        way = np.full(len(front.x), np.inf)
        way[rows[is_met]] = (share * reach * leg[rows])[is_met]
        result.append((front, way, leg))
    return result


def led_through(
    cracks: Sequence[Crack], c: int, on: int, body: Body, reach: float, size: float
) -> Crack:
    """Crack c, its fronts led straight on through the face of another one, on which it then ends.

    Parameters
    ----------
    cracks : sequence of Crack
        With fronts.
    c, on : int
    body : Body
    reach : float
        Legs of cells: places of a front whose way to the face is no longer are led on.
    size : float
        Of the sides of the new front, in cells.

    Returns
    -------
    Crack
        Not placed again.
    """
    tree = triangle_tree(cracks[on].points, cracks[on].faces)
    nearby_fronts = {
        int(front.number[0]): (way, leg)
        for front, way, leg in _ways_to_face(cracks, c, on, body, reach)
    }
    s, number, da, cell, depth = [], [], [], [], []
    for f, front in enumerate(front_frames(cracks[c])):
        s.append(front.s)
        number.append(np.full(len(front.x), f))
        da.append(np.zeros(len(front.x)))
        if int(front.number[0]) in nearby_fronts:
            way, leg = nearby_fronts[int(front.number[0])]
            is_led = np.isfinite(way)
            da[-1][is_led] = (way + _LED / _LEG * leg)[is_led]
            depth.append(signed_in(tree, front.x[is_led])[0])
            cell.append(leg[is_led] / _LEG)
    side = 1 if np.concatenate(depth).mean() > 0 else -1
    ways = np.concatenate(da)
    grown_crack = advance_fronts(
        cracks[c], np.concatenate(s), np.concatenate(number), 0 * ways, ways,
        size * float(np.concatenate(cell).mean()),
    )  # fmt: skip
    return replace(grown_crack, ends_on=(*cracks[c].ends_on, (on, side)))


def with_room(
    cracks: Sequence[Crack],
    c: int,
    on: int,
    body: Body,
    room: float,
    size: float,
    x: Floats | None = None,
) -> Crack:
    """The crack on which crack c ends, its fronts led on where that one comes too near to them.

    Parameters
    ----------
    cracks : sequence of Crack
        With fronts, placed.
    c, on : int
    body : Body
    room : float
        In cells, that is to lie between the front and what ends before it.
    size : float
        Of the sides of the new front, in cells.
    x : (n, 3) array, length, optional
        Places for which there is to be room, in place of the fronts of crack c.

    Returns
    -------
    Crack
        Not placed again; the same one where there is room.
    """
    x = _front_points(cracks, c, body) if x is None else x
    fronts = front_frames(cracks[on])
    s, number, da, cells = [], [], [], []
    for f, front in enumerate(fronts):
        cell = body.cell_size(front.x)
        advance, height, distance_along = np.moveaxis(
            np.einsum("mij,mkj->mki", front.frame, x[None] - front.x[:, None]), 2, 0
        )
        least_room = room * cell[:, None]
        # A parabola twice as wide as it is high: the front that is led on stays smooth.
        lead = advance + least_room - distance_along**2 / (4 * least_room)
        lead[(np.abs(height) > least_room) | (np.abs(distance_along) > 2 * least_room)] = 0.0
        is_inside = body.contains(front.x)
        s.append(front.s)
        number.append(np.full(len(front.x), f))
        da.append(np.where(is_inside, lead.max(axis=1, initial=0.0), 0.0))
        cells.append(cell)
    ways = np.concatenate(da)
    if not ways.any():
        return cracks[on]
    spacing = size * float(np.concatenate(cells)[ways > 0].mean())
    grown_crack = advance_fronts(
        cracks[on], np.concatenate(s), np.concatenate(number), 0 * ways, ways, spacing
    )
    return replace(grown_crack, ends_on=cracks[on].ends_on)


def face_led_on(
    cracks: Sequence[Crack], c: int, on: int, body: Body, way: float, size: float
) -> Crack | None:
    """Crack `on`, its fronts led straight on where those of crack c are close beside them.

    Parameters
    ----------
    cracks : sequence of Crack
        With fronts.
    c, on : int
    body : Body
    way : float
        In cells, by which they are led on where that is closest.
    size : float
        Of the sides of the new front, in cells.

    Returns
    -------
    Crack or None
        Not placed again; None where no front is near.
    """
    x = _front_points(cracks, c, body)
    if not len(x):
        return None
    fronts = front_frames(cracks[on])
    y = np.concatenate([np.zeros((0, 3)), *(front.x for front in fronts)])
    is_inside = body.contains(y)
    if not is_inside.any():
        return None
    cell = body.cell_size(y)
    distance = np.where(is_inside, cKDTree(x).query(y)[0], np.inf)
    relative_distance = (distance - distance.min()) / (_BESIDE * cell)
    ways = way * cell * np.maximum(1 - relative_distance**2, 0.0)
    spacing = size * float(cell[ways > 0].mean())
    s = np.concatenate([front.s for front in fronts])
    number = np.repeat(np.arange(len(fronts)), [len(front.x) for front in fronts])
    grown_crack = advance_fronts(cracks[on], s, number, 0 * ways, ways, spacing)
    return replace(grown_crack, ends_on=cracks[on].ends_on)


def _front_points(cracks: Sequence[Crack], c: int, body: Body) -> Floats:
    """Points of the fronts of a crack in the body, before cracks on which it ends `(n, 3)`."""
    x = np.concatenate([np.zeros((0, 3)), *(cracks[c].points[f] for f in cracks[c].fronts or ())])
    x = x[body.contains(x)]
    return np.asarray(x[is_before(cracks, c, x)])


def front_distance_of(cracks: Sequence[Crack], i: int, k: int, body: Body) -> float:
    """Smallest distance of the fronts of two cracks in cells there; inf where one has none."""
    x, y = (_front_points(cracks, c, body) for c in (i, k))
    if not len(x) or not len(y):
        return np.inf
    return float((cKDTree(y).query(x)[0] / body.cell_size(x)).min())


def crossings(crack_a: Crack, crack_b: Crack) -> Floats:
    """Points at which edges of either surface cross the other one `(n, 3)`."""
    parts = [np.zeros((0, 3))]
    for a, b in ((crack_a, crack_b), (crack_b, crack_a)):
        tree = triangle_tree(b.points, b.faces)
        pairs = np.unique(np.sort(sides(a.faces).reshape(-1, 2), axis=1), axis=0)
        start, stop = a.points[pairs[:, 0]], a.points[pairs[:, 1]]
        triangle, position = first_crossing(tree, start, stop)
        hit = triangle >= 0
        parts.append(start[hit] + position[hit, None] * (stop - start)[hit])
    return np.concatenate(parts)


__all__ = [
    "BodyBefore",
    "FaceAhead",
    "are_opposite",
    "arm",
    "body_before",
    "check_numbers",
    "crossings",
    "distance_to_side",
    "face_ahead",
    "face_led_on",
    "front_distance_of",
    "is_before",
    "led_through",
    "may_touch",
    "renumbered_arms",
    "signed_distance",
    "with_room",
]
