"""Tips in 2D that meet other cracks: they end on them, or two facing tips become one crack.

Close before another crack K is no longer that of the tip alone, and within a cell nothing resolves
it. A tip whose straight prolongation meets another crack within a cell and a quarter of its advance
ends there: it keeps its direction, and the step ends when it arrives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.advance_2d import with_tips
from xcrack.crack.crack import Crack
from xcrack.crack.lines import crossing_points, polyline_crack
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.locate import cell_sizes, contains
from xcrack.mesh.mesh import Mesh

# Tips of all 2D cracks as rows of one array, and cracks that end at given places.

_WHOLE = 0.5  # cells: a shorter face is not left behind, its end moves on with the tip
LEAST = 0.1  # cells: a shorter new face turns the tip's frame, but not the crack the mesh sees


@dataclass(frozen=True, eq=False)
class Faces:
    """Last faces of cracks, a row for each tip.

    Attributes
    ----------
    tip, anchor : (n, 2) arrays, length
        Where they end and begin.
    length : (n,) array, length
    direction : (n,) array, rad
        From the x-axis.
    side : (n,) array
        1, or -1 where the tip's frame is left-handed.
    """

    tip: Floats
    anchor: Floats
    length: Floats
    direction: Floats
    side: Floats


def last_faces(cracks: Sequence[Crack]) -> Faces:
    """The last faces of all tips of placed cracks."""
    if len(cracks) == 1:
        return Faces(*cracks[0]._last_faces)
    no_faces = [np.zeros((0, 2))] * 2 + [np.zeros(0)] * 3
    parts = zip(no_faces, *(crack._last_faces for crack in cracks), strict=True)
    return Faces(*map(np.concatenate, parts))


def moved_on(faces: Faces, has_grown: Bools, size: Floats) -> Bools:
    """Whether the last point of each tip moves on with it: its face was added, and is short."""
    return np.asarray(has_grown & (faces.length < _WHOLE * size))


def with_tips_at(
    cracks: Sequence[Crack], place: Floats, has_grown: Bools, size: Floats
) -> tuple[list[Crack], Bools]:
    """Cracks that go on to given places.

    Parameters
    ----------
    cracks : sequence of Crack
        Placed.
    place : (n, 2) array, length
        Where the tips of all of them are to be.
    has_grown : (n,) array of bool
        Whether the last face was added by growth.
    size : (n,) array, length
        Of the cells there.

    Returns
    -------
    cracks : list of Crack
        The last face of a tip moves on until it is half a cell long; then another one begins, once
        that is a tenth of a cell long.
    moves : (n,) array of bool
        Tips that moved; the others wait.
    """
    faces = last_faces(cracks)
    is_replaced = moved_on(faces, has_grown, size)
    begin = np.where(is_replaced[:, None], faces.anchor, faces.tip)
    moves = np.linalg.norm(place - begin, axis=1) >= LEAST * size
    result = []
    for crack, rows in zip(cracks, rows_of(cracks)):
        result.append(
            with_tips(crack, place[rows], moves[rows], is_replaced[rows]) if crack.n_tips else crack
        )
    return result, moves


def rows_of(cracks: Sequence[Crack]) -> list[slice]:
    """Rows of the tips of each crack."""
    end = np.cumsum([0, *(crack.n_tips for crack in cracks)])
    return [slice(int(a), int(b)) for a, b in zip(end, end[1:])]


AHEAD = 1.25  # cells beyond the advance within which a tip is taken to meet what lies ahead
_FACING = 0.6  # of that for each of two facing tips
_SOON = 1.0  # cells: tips closer than that to what they meet join in the same step
_BESIDE = 1.2  # cells by which facing tips may miss each other and still become one crack
_BEHIND = 1.3  # cells behind a tip at which others end that would meet it closer


@dataclass(frozen=True, eq=False)
class Meeting:
    """What a tip meets.

    Attributes
    ----------
    tip : int
        Row of the tip among those of all cracks.
    x : (2,) array, length
        Where it ends.
    away : float, length
        From the tip to there; negative where it lies beyond.
    crack : int
        The other crack.
    facing_tip : int
        Row of the facing tip, or -1 for a flank.
    size : float, length
        Of the cell there.
    """

    tip: int
    x: Floats
    distance: float
    crack: int
    facing_tip: int
    size: float

    @property
    def is_soon(self) -> bool:
        """Whether the tip is too close to what it meets for another step."""
        return self.distance <= _SOON * self.size * (1.0 if self.facing_tip < 0 else _FACING)


def meetings(cracks: Sequence[Crack], mesh: Mesh, reach_in_cells: float = AHEAD) -> list[Meeting]:
    """What tips meet within some cells ahead of them, or have run across, the nearest first.

    Parameters
    ----------
    cracks : sequence of Crack
        Placed, or advanced from placed ones.
    mesh : Mesh
    reach_in_cells : float
        In cells.
    """
    if len(cracks) < 2:
        return []
    faces = last_faces(cracks)
    owner = np.repeat(np.arange(len(cracks)), [crack.n_tips for crack in cracks])
    size = cell_sizes(mesh, faces.tip)
    result = []
    for row in range(len(owner)):
        h, x = float(size[row]), faces.tip[row]
        direction = np.array([np.cos(faces.direction[row]), np.sin(faces.direction[row])])
        facing_tip = _facing_tip(row, faces, owner, 2 * _FACING * reach_in_cells * h, _BESIDE * h)
        if facing_tip is not None:
            middle = (x + faces.tip[facing_tip]) / 2
            half_distance = float((faces.tip[facing_tip] - x) @ direction) / 2
            result.append(
                Meeting(row, middle, half_distance, int(owner[facing_tip]), facing_tip, h)
            )
            continue
        flank = _flank(
            int(owner[row]), faces.anchor[row], x + reach_in_cells * h * direction, cracks, mesh
        )
        if flank is not None:
            end, on = flank
            end = _behind_tips(end, cracks[on], _BEHIND * h)
            result.append(Meeting(row, end, float((end - x) @ direction), on, -1, h))
    return sorted(result, key=lambda meeting: meeting.distance)


def _facing_tip(row: int, faces: Faces, owner: Ints, reach: float, room: float) -> int | None:
    """The tip of another crack that comes towards this one, or has come past it just now."""
    direction = faces.direction
    direction_of_tip = np.array([np.cos(direction[row]), np.sin(direction[row])])
    gap = faces.tip - faces.tip[row]
    distance_ahead, distance_beside = (
        gap @ direction_of_tip,
        np.abs(gap @ np.array([-direction_of_tip[1], direction_of_tip[0]])),
    )
    is_opposite = np.cos(direction - direction[row]) < -0.5
    is_before = (faces.anchor - faces.anchor[row]) @ direction_of_tip > 0
    is_near = (distance_ahead < reach) & is_before & (distance_beside <= room)
    rows = np.nonzero(is_near & is_opposite & (owner != owner[row]))[0]
    return int(rows[np.argmin(np.abs(distance_ahead[rows]))]) if len(rows) else None


def _flank(
    c: int, begin: Floats, end: Floats, cracks: Sequence[Crack], mesh: Mesh
) -> tuple[Floats, int] | None:
    """Where the last face of crack c, prolonged, first crosses another crack in the body."""
    crossing, distance = None, np.inf
    for c_there, crack in enumerate(cracks):
        if c_there == c:
            continue
        x = crossing_points(np.stack([begin, end]), crack.points)
        x = x[contains(mesh, x)] if len(x) else x
        distance_to_points = np.linalg.norm(x - begin, axis=1)
        distance_to_points = np.where(
            distance_to_points > 1e-9 * np.linalg.norm(end - begin), distance_to_points, np.inf
        )
        if len(x) and distance_to_points.min() < distance:
            k = int(np.argmin(distance_to_points))
            crossing, distance = (x[k], c_there), float(distance_to_points[k])
    return crossing


def _behind_tips(x: Floats, crack: Crack, room: float) -> Floats:
    """A point of a crack, moved along it until its tips are not too close."""
    for tip in crack.tips or ():
        line = crack.points if tip == 0 else crack.points[::-1]
        length = np.linalg.norm(np.diff(line, axis=0), axis=1)
        at_vertex = np.concatenate([[0.0], np.cumsum(length)])
        foot = closest_on_segment(x, line[:-1], line[1:])
        piece = int(np.argmin(np.linalg.norm(foot - x, axis=1)))
        distance_along = at_vertex[piece] + float(np.linalg.norm(foot[piece] - line[piece]))
        if distance_along < room < at_vertex[-1]:
            piece = int(np.searchsorted(at_vertex, room, side="right")) - 1
            share = (room - at_vertex[piece]) / length[piece]
            x = (1 - share) * line[piece] + share * line[piece + 1]
    return x


def joined_cracks(
    cracks: Sequence[Crack], has_moved: Sequence[bool], meetings_made: Sequence[Meeting]
) -> list[Crack]:
    """Cracks after meetings: tips that end on others are none, facing ones are gone.

    Parameters
    ----------
    cracks : sequence of Crack
        As the meetings were found with.
    has_moved : sequence of bool
        For each tip whether its last point was added, so that it may be replaced.
    meetings_made : sequence of Meeting
    """
    result: list[Crack | None] = list(cracks)
    tip_of = [
        (c, k) for c, rows in enumerate(rows_of(cracks)) for k in range(rows.stop - rows.start)
    ]
    at_end = {}  # crack and whether it is the first point: where a facing pair meets
    pairs = []
    for meeting in meetings_made:
        c, k = tip_of[meeting.tip]
        first = (cracks[c].tips or ())[k] == 0
        if meeting.facing_tip < 0:
            crack = result[c]
            assert crack is not None
            result[c] = _with_new_end(crack, first, meeting.x, has_moved[meeting.tip], True)
        elif meeting.tip < meeting.facing_tip and (c, first) not in at_end:
            d, tip_number = tip_of[meeting.facing_tip]
            first_there = (cracks[d].tips or ())[tip_number] == 0
            if (d, first_there) in at_end:
                continue
            for key, row in (((c, first), meeting.tip), ((d, first_there), meeting.facing_tip)):
                at_end[key] = meeting.x
                crack = result[key[0]]
                assert crack is not None
                result[key[0]] = _with_new_end(crack, key[1], meeting.x, has_moved[row], False)
            pairs.append(((c, first), (d, first_there), meeting.x))
    number = list(range(len(cracks)))
    for (c, _), (d, _), x in pairs:
        k_min, k_max = sorted((number[c], number[d]))
        if k_min == k_max:
            continue  # they are one crack by now: it closes, which placing refuses
        first_crack, second_crack = result[k_min], result[k_max]
        assert first_crack is not None
        assert second_crack is not None
        result[k_min], result[k_max] = _crack_of_two(first_crack, second_crack, x), None
        number = [k_min if n == k_max else n for n in number]
    return [crack for crack in result if crack is not None]


def _with_new_end(crack: Crack, first: bool, x: Floats, replace: bool, drop: bool) -> Crack:
    """A crack with another end, which is a tip no more where asked for."""
    points = crack.points[::-1] if first else crack.points
    points = np.concatenate([points[:-1] if replace and len(points) > 2 else points, x[None]])
    end = len(points) - 1
    other_tips = [tip for tip in crack.tips or () if (tip == 0) != first]
    tips = [0 if tip == 0 else end for tip in other_tips]
    if not drop:
        tips.append(0 if first else end)
    return polyline_crack(points[::-1] if first else points, tuple(sorted(tips)))


def _crack_of_two(first_crack: Crack, second_crack: Crack, x: Floats) -> Crack:
    """Two cracks that end at x as one, in the direction of the first."""
    is_begin = np.array_equal(first_crack.points[0], x)
    ends = (
        second_crack.points[::-1]
        if np.array_equal(second_crack.points[0], x) == is_begin
        else second_crack.points
    )
    free_ends = [
        k
        for k in (0, len(second_crack.points) - 1)
        if not np.array_equal(second_crack.points[k], x)
    ]
    tip_beyond = any(k in (second_crack.tips or ()) for k in free_ends)
    if is_begin:
        points = np.concatenate([ends, first_crack.points[1:]])
        tips = [0] * tip_beyond + [len(points) - 1] * (
            len(first_crack.points) - 1 in (first_crack.tips or ())
        )
    else:
        points = np.concatenate([first_crack.points, ends[1:]])
        tips = [0] * (0 in (first_crack.tips or ())) + [len(points) - 1] * tip_beyond
    return polyline_crack(points, tuple(tips))


# Where cracks have met between one step and the next: the polylines alone tell.

_SAME = 1e-9  # of the extent of the cracks: an end lies on another crack


def ends_on_others(cracks: Sequence[Crack]) -> list[tuple[int, int, Floats]]:
    """Ends of placed cracks on others in 2D: crack, the other one, place `(2,)`."""
    if len(cracks) < 2 or any(crack.tips is None for crack in cracks):
        return []
    reach = _SAME * float(np.ptp(np.concatenate([crack.points for crack in cracks]), axis=0).max())
    result = []
    for c, crack in enumerate(cracks):
        for end in (0, len(crack.points) - 1):
            if end in (crack.tips or ()):
                continue
            x = crack.points[end]
            for on, crack_there in enumerate(cracks):
                line = crack_there.points
                if on == c or np.linalg.norm(line[[0, -1]] - x, axis=1).min() <= reach:
                    continue
                foot = closest_on_segment(x, line[:-1], line[1:])
                if np.linalg.norm(foot - x, axis=1).min() <= reach:
                    result.append((c, on, x))
                    break
    return result


def new_ends(
    cracks_before: Sequence[Crack], cracks_after: Sequence[Crack]
) -> list[tuple[int, int, Floats]]:
    """Ends on others that were not there before."""
    known_ends = {tuple(x.tolist()) for _, _, x in ends_on_others(cracks_before)}
    return [end for end in ends_on_others(cracks_after) if tuple(end[2].tolist()) not in known_ends]


def new_unions(
    cracks_before: Sequence[Crack], cracks_after: Sequence[Crack]
) -> list[tuple[tuple[int, int], Floats]]:
    """Points at which two tips have become one crack; none in 3D.

    Returns
    -------
    list of (numbers of the cracks before, the smaller one first, place (2,))
    """
    if len(cracks_after) >= len(cracks_before) or any(crack.tips is None for crack in cracks_after):
        return []
    owner = {tuple(x): c for c, crack in enumerate(cracks_before) for x in crack.points.tolist()}
    result = []
    for crack in cracks_after:
        of_point = [owner.get(tuple(x), -1) for x in crack.points.tolist()]
        for k in range(1, len(of_point) - 1):
            if of_point[k] >= 0:
                continue
            left_crack = next((c for c in of_point[k::-1] if c >= 0), -1)
            right_crack = next((c for c in of_point[k:] if c >= 0), -1)
            if left_crack != right_crack and min(left_crack, right_crack) >= 0:
                result.append(
                    ((min(left_crack, right_crack), max(left_crack, right_crack)), crack.points[k])
                )
    return result


__all__ = [
    "AHEAD",
    "LEAST",
    "Faces",
    "Meeting",
    "ends_on_others",
    "joined_cracks",
    "last_faces",
    "meetings",
    "moved_on",
    "new_ends",
    "new_unions",
    "rows_of",
    "with_tips_at",
]
