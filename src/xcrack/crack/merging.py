"""Fronts in 3D that meet in one surface, of two cracks or of one: one front goes on.

The merged surface is the closing of both by a disc (Serra, 1982, sec. II.C): what a disc in the
surface ahead of the fronts cannot reach without entering the crack behind one of them is filled.
Hollow corners where the fronts meet are thus rounded with its radius.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints, at, open_runs, runs_of
from xcrack.base.errors import GeometryError
from xcrack.crack.boundary_trace import is_at_hole, is_enclosed
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import Front, front_frames
from xcrack.mesh.distances import TriangleTree, closest_in, front_distance, triangle_tree
from xcrack.mesh.locate import Body
from xcrack.mesh.polygon import cross, ear_clipped, self_crossing, without_slivers
from xcrack.mesh.triangulation import rim, unit

_ANGLE = np.cos(np.radians(20.0))  # normals of both pieces of a front may differ by as much
_TILT = np.cos(np.radians(45.0))  # and those of two cracks
_BETWEEN = 8  # points of a side of a front, where the gap to another one is sought
OFFSET = 0.5  # of a cell: both lie in one surface up to that, and beyond it a step leads across
STEP = 2.05  # cells: the highest step; farther apart fronts pass each other
_NEAR = 1.1  # cells between two fronts of a crack below which they join
_WIDE = 2.0  # cells between two ends of fronts behind a hole below which they join
_FACES = 0.3  # cosine between the direction ahead of a front and another one that it meets
_STRAIGHT = 0.8  # cosine, or share of a radius, from which on fronts face each other
_SMALLER = (1.0, 0.7, 0.5)  # of the radius of a disc: those tried one after the other
_LOOSE = 3.0  # radii from the end of an open front within which the other one ends too


@dataclass(frozen=True, eq=False)
class FrontGap:
    """Where the fronts of two cracks come closest.

    Attributes
    ----------
    width : float, length
        Along the surface.
    offset : float, length
        Across it.
    turn : float
        Cosine between the normals there; negative where one crack looks the other way.
    x : (3,) array, length
        Half way between the two.
    faces : bool
        Whether a front is nearest there, and not a face of the other crack.
    """

    width: float
    offset: float
    turn: float
    x: Floats
    faces: bool

    def in_surface(self, size: float) -> bool:
        """Whether both lie in one surface, or one within a step of that of the other."""
        return abs(self.turn) >= _TILT and self.offset <= STEP * size


def gap_between(crack_a: Crack, crack_b: Crack, body: Body, reach: float) -> FrontGap | None:
    """Where the fronts of two cracks come closest in a body; None where farther than `reach`.

    Parameters
    ----------
    crack_a, crack_b : Crack
        With fronts.
    body : Body
    reach : float, length

    Returns
    -------
    Gap or None
    """
    gap: FrontGap | None = None
    ends = [_points_near(a, b, body, reach) for a, b in ((crack_a, crack_b), (crack_b, crack_a))]
    for (x, normal), (y, normal_there), b in zip(ends, ends[::-1], (crack_b, crack_a), strict=True):
        if not len(x):
            continue
        tree = triangle_tree(b.points, b.faces)
        nearest_point = closest_in(tree, x, reach)
        rows = np.nonzero((nearest_point.triangle >= 0) & body.contains(nearest_point.foot))[0]
        feet, other_normal = nearest_point.foot[rows], tree.normal[nearest_point.triangle[rows]]
        if len(y):  # nearest where they come out of the body a foot would lie beyond it
            distance, place = cKDTree(y).query(x)
            near_rows = np.nonzero(distance < reach)[0]
            rows, feet = np.append(rows, near_rows), np.concatenate([feet, y[place[near_rows]]])
            other_normal = np.concatenate([other_normal, normal_there[place[near_rows]]])
        if not len(rows):
            continue
        way = feet - x[rows]
        normal_distance = np.einsum("ij,ij->i", way, normal[rows])
        offset = np.linalg.norm(way - normal_distance[:, None] * normal[rows], axis=1)
        k = int(np.argmin(offset))
        if gap is None or offset[k] < gap.width:
            gap = FrontGap(
                float(offset[k]),
                float(abs(normal_distance[k])),
                float(other_normal[k] @ normal[rows[k]]),
                x[rows[k]] + way[k] / 2,
                _is_on_front(b, feet[k], tree.distance_tolerance),
            )
    return gap


def _points_near(crack: Crack, crack_b: Crack, body: Body, reach: float) -> tuple[Floats, Floats]:
    """Points close along fronts in a body, near the box of another crack, and normals `(n, 3)`."""
    box_min, box_max = crack_b.points.min(axis=0) - reach, crack_b.points.max(axis=0) + reach
    parts = [np.zeros((0, 6))]
    for front in front_frames(crack):
        values = _values_along(front)
        parts.append(np.hstack([values[:, 0], values[:, 2]]))
    points, normals = np.split(np.concatenate(parts), 2, axis=1)
    rows = np.nonzero(((points >= box_min) & (points <= box_max)).all(axis=1))[0]
    rows = rows[body.contains(points[rows])]
    return points[rows], unit(normals[rows])


def _values_along(front: Front) -> Floats:
    """Places close along a front, directions ahead and normals `(n, 3, 3)`, these not unit."""
    number = np.arange(len(front.x) + front.is_closed)
    t = np.linspace(0, number[-1], _BETWEEN * number[-1] + 1)
    corners = np.concatenate([front.x[:, None], front.frame[:, :2]], axis=1)
    columns = corners.reshape(-1, 9)[number % len(front.x)].T
    values = [np.interp(t, number, column) for column in columns]
    return np.stack(values, axis=1).reshape(-1, 3, 3)


def _is_on_front(crack: Crack, x: Floats, tolerance: float) -> bool:
    return any(
        front_distance(x[None], front.x, front.is_closed, np.inf)[0][0] <= 10 * tolerance
        for front in front_frames(crack)
    )


def turned_crack(crack: Crack) -> Crack:
    """The same crack with lip + and lip - exchanged; its fronts run the other way."""
    fronts = None if crack.fronts is None else tuple(front[::-1] for front in crack.fronts)
    return Crack(crack.points, crack.faces[:, ::-1], crack.tips, fronts)


def merged_crack(
    crack_a: Crack,
    crack_b: Crack,
    radius: float,
    size: float,
    step: float = 0.0,
    body: Body | None = None,
) -> Crack:
    """Two cracks that lie in one surface, or a step apart, and nearly touch, as one.

    Parameters
    ----------
    crack_a, crack_b : Crack
        With fronts that do not overlap; their normals agree where they are close.
    radius : float, length
        Of the disc that closes the gap.
    size : float, length
        Spacing of new front points.
    step : float, length
        By which one may lie beside the surface of the other.
    body : Body, optional
        Ends of fronts outside it may lie across each other: as much of them is left out.

    Returns
    -------
    Crack
        Points and faces of the first, of the second, and those of the gap; with fronts, not yet
        placed again.

    Raises
    ------
    GeometryError
        They do not lie in one surface, one encloses the other, or the gap has a shape that cannot
        be closed.
    """
    n = len(crack_a.points)
    shifted = Crack(
        np.concatenate([crack_a.points, crack_b.points]),
        crack_b.faces + n,
        None,
        tuple(front + n for front in crack_b.fronts or ()),
    )
    both_cracks = Crack(shifted.points, np.concatenate([crack_a.faces, shifted.faces]))
    trees = tuple(triangle_tree(c.points, c.faces) for c in (crack_b, crack_a))

    def find_blocked(tree: TriangleTree) -> Callable[[Front], Bools]:
        return lambda front: _blocked_points(front, tree, radius, step)

    facing_fronts = (front_frames(crack_a), front_frames(shifted))
    flags = tuple(map(find_blocked, trees))

    if body is None:
        return _with_gap_closed(
            both_cracks, facing_fronts, (), flags, radius, size, begins_far=True
        )

    def close_gap(count: int) -> Crack:
        short_fronts = tuple(
            [_with_short_ends(f, count, body) for f in group] for group in facing_fronts
        )
        return _with_gap_closed(
            both_cracks, (short_fronts[0], short_fronts[1]), (), flags, radius, size,
            begins_far=True,
        )  # fmt: skip

    return _first_that_closes(close_gap, facing_fronts)


def _first_that_closes(
    close_gap: Callable[[int], Crack], groups: Sequence[Sequence[Front]]
) -> Crack:
    """A gap closed between fronts with all, or a few, of their points outside the body."""
    longest_front = max(len(front.x) for group in groups for front in group)
    is_open = any(not front.is_closed for group in groups for front in group)
    for count in (longest_front, *range(8, -1, -1)) if is_open else (longest_front,):
        try:
            return close_gap(count)
        except GeometryError as error:
            failure = error
    raise failure


@dataclass(frozen=True, eq=False)
class OwnGap:
    """Where fronts of one crack come to face each other: width, size of the cell, place."""

    width: float
    size: float
    x: Floats


def own_gap(crack: Crack, body: Body, reach: float) -> OwnGap | None:
    """Where closed fronts of one crack that face each other are nearest; None if nowhere.

    Parameters
    ----------
    crack : Crack
        With fronts.
    body : Body
    reach : float
        In cells; farther apart they do not count.
    """
    ends, width, size = _facing_points(crack, body, reach)
    if not len(width):
        return None
    k = int(np.argmin(width))
    return OwnGap(float(width[k]), float(size[k]), ends[k].mean(axis=0))


def own_gap_around(crack: Crack, body: Body, reach: float, x: Floats) -> Floats:
    """Width of the gap between fronts of one crack at places, and twice the way to it `(n,)`.

    The least sum of both; infinite where no fronts face each other, see `own_gap`.
    """
    ends, width, _ = _facing_points(crack, body, reach)
    if not len(width):
        return np.full(len(x), np.inf)
    way = np.linalg.norm(x[:, None] - ends.reshape(-1, 3), axis=2)
    return np.asarray((2 * way + np.repeat(width, 2)).min(axis=1))


def _facing_points(crack: Crack, body: Body, reach: float) -> tuple[Floats, Floats, Floats]:
    """Points of closed fronts that face each other across a gap.

    Returns
    -------
    ends : (n, 2, 3) array, length
    width : (n,) array, length
    size : (n,) array, length
        Of the cells.
    """
    fronts = [front for front in front_frames(crack) if front.is_closed]  # open: `joined_fronts`
    if not fronts:
        return np.zeros((0, 2, 3)), np.zeros(0), np.zeros(0)
    x, t, n = np.concatenate([_values_along(front) for front in fronts]).transpose(1, 0, 2)
    t, n = unit(t), unit(n)
    size = body.cell_size(x)
    pairs = cKDTree(x).query_pairs(reach * float(size.max()), output_type="ndarray")
    way = x[pairs[:, 1]] - x[pairs[:, 0]]
    width = np.linalg.norm(way, axis=1)
    faces = np.einsum("ij,ij->i", way, t[pairs[:, 0]]) > _STRAIGHT * width
    faces &= np.einsum("ij,ij->i", way, t[pairs[:, 1]]) < -_STRAIGHT * width
    faces &= np.einsum("ij,ij->i", n[pairs[:, 0]], n[pairs[:, 1]]) > _ANGLE
    faces &= width < reach * size[pairs[:, 0]]
    pairs, width = pairs[faces], width[faces]
    rows = np.nonzero(body.contains(x[pairs].mean(axis=1)))[0] if len(pairs) else np.zeros(0, int)
    return x[pairs[rows]], width[rows], size[pairs[rows, 0]]


def with_own_gap_closed(crack: Crack, x: Floats, radius: float, size: float) -> Crack:
    """A crack whose fronts face each other near a place, with faces in the gap between.

    Parameters
    ----------
    crack : Crack
        With fronts.
    x : (3,) array, length
    radius : float, length
        Of the disc that closes the gap; a smaller one does where this one is as large as the hollow
        of a front beside the gap.
    size : float, length
        Spacing of new front points.

    Raises
    ------
    GeometryError
        Not two pieces of fronts face each other there, or the gap cannot be closed.
    """
    for share in _SMALLER:
        try:
            return _with_own_gap_closed(crack, x, share * radius, size)
        except GeometryError as error:
            failure = error
    raise failure


def _with_own_gap_closed(crack: Crack, x: Floats, radius: float, size: float) -> Crack:
    tree, parts = triangle_tree(crack.points, crack.faces), []
    fronts = front_frames(crack)
    for f, front in enumerate(fronts):
        centre = front.x + radius * front.frame[:, 0]
        flag = closest_in(tree, centre, radius).distance < _STRAIGHT * radius
        flag |= np.roll(flag, 1) & np.roll(flag, -1)  # one that its neighbours enclose
        flag &= np.linalg.norm(front.x - x, axis=1) < _LOOSE * radius
        runs = runs_of(flag) if front.is_closed else open_runs(flag)
        parts += [(f, run) for run in runs if len(run)]
    parts.sort(key=lambda part: float(np.linalg.norm(fronts[part[0]].x[part[1]] - x, axis=1).min()))
    if len(parts) > 2 and _faces(fronts, *parts[:2]):
        parts = parts[:2]
    if len(parts) == 1:  # the end of a slit between faces of the crack
        return _with_slit_filled(crack, fronts, *parts[0], size)
    if len(parts) != 2:
        raise GeometryError(
            f"{len(parts)} pieces of the fronts of one crack face each other near {at(x)}: the "
            "ligament between them cannot be closed. End growth before, or give what has joined."
        )

    def find_blocked(k: int) -> Callable[[Front], Bools]:
        f, run = parts[k]

        def flags(front: Front) -> Bools:
            flag = np.zeros(len(front.x), dtype=bool)
            flag[run] = front is fronts[f]
            return flag

        return flags

    pair = ([fronts[parts[0][0]]], [fronts[parts[1][0]]])
    rest = [front for f, front in enumerate(fronts) if f not in (parts[0][0], parts[1][0])]
    crack_without_ends = Crack(crack.points, crack.faces)
    closed_crack = _with_gap_closed(
        crack_without_ends, pair, rest, (find_blocked(0), find_blocked(1)), radius, size
    )
    return replace(closed_crack, ends_on=crack.ends_on)


def _with_slit_filled(
    crack: Crack, fronts: Sequence[Front], number: int, run: Ints, size: float
) -> Crack:
    """A crack with faces in a slit around which one piece of a front runs."""
    front = fronts[number]
    (part,) = _runs(front, np.isin(np.arange(len(front.x)), run))
    place = list(part.place)
    facing_share = front.frame[place[0], 0] @ front.frame[place[-1], 0]
    if any(part.ends) or len(set(place)) < len(place) or facing_share > 0:
        raise GeometryError(
            f"one piece of a front faces itself near {at(front.x[run].mean(axis=0))}: the ligament "
            "inside cannot be closed. End growth before, or give what has joined."
        )
    mouth = _arc(front, place[-1], front, place[0], size)
    mouth_number = len(crack.points) + np.arange(len(mouth))
    outline = np.concatenate([front.number[place], mouth_number])
    triangles = _triangles(
        np.concatenate([front.x[place], mouth]), front.frame[place, 1].mean(axis=0)
    )
    next_number = dict(side for f in fronts for side in _sides(f))
    for used_number in front.number[place[:-1]]:
        next_number.pop(int(used_number), None)
    line = [front.number[place[0]], *mouth_number[::-1], front.number[place[-1]]]
    next_number.update({int(p): int(q) for p, q in zip(line, line[1:])})
    points = np.concatenate([crack.points, mouth])
    faces = np.concatenate([crack.faces, outline[triangles]])
    return Crack(points, faces, None, tuple(_chains(next_number)), crack.ends_on)


def _faces(fronts: Sequence[Front], p: tuple[int, Ints], q: tuple[int, Ints]) -> bool:
    """Whether two pieces of fronts look towards each other."""
    (f, run), (g, run_of_other) = p, q
    direction, opposite_direction = (
        fronts[f].frame[run, 0].mean(axis=0),
        fronts[g].frame[run_of_other, 0].mean(axis=0),
    )
    return bool(direction @ opposite_direction < 0)


def without_inner_front(crack: Crack, number: int) -> tuple[Crack, Floats]:
    """A crack whose closed front around a ligament is gone, filled up to its middle, and that."""
    front = (crack.fronts or ())[number]
    centre = crack.points[front[:-1]].mean(axis=0)
    middle = np.full(len(front) - 1, len(crack.points))
    fan = np.stack([front[:-1], front[1:], middle], axis=1)
    fronts = tuple(line for f, line in enumerate(crack.fronts or ()) if f != number)
    points = np.concatenate([crack.points, centre[None]])
    faces = np.concatenate([crack.faces, fan])
    return Crack(points, faces, None, fronts, crack.ends_on), centre


def through_holes(
    crack: Crack, fronts: Sequence[Front], body: Body
) -> list[tuple[tuple[int, ...], bool]]:
    """Fronts that run on in each other across holes, as numbers of fronts in a row.

    Parameters
    ----------
    crack : Crack
        Placed. Fronts belong to each other where one ends a side of the outline before the other
        begins, or both do outside the body, close to each other in one hole.
    fronts : sequence of Front
    body : Body

    Returns
    -------
    list of (tuple of int, bool)
        Fronts in a row, and whether the last one runs on in the first.
    """
    follower = {int(b): int(a) for a, b in rim(crack.faces)[0]}
    pairs = []
    for i, f in enumerate(fronts):
        for j, g in enumerate(fronts):
            if f.is_closed or g.is_closed:
                continue
            way = g.x[0] - f.x[-1]
            gap = float(np.linalg.norm(way))
            is_beside = follower.get(int(f.number[-1])) == int(g.number[0])
            facing_share = min(f.frame[-1, 2] @ way, g.frame[0, 2] @ way)
            if not is_beside and facing_share > _FACES * gap:
                is_near = gap < _WIDE * float(body.cell_size(f.x[-1:])[0])
                points_between = f.x[-1] + np.linspace(0.0, 1.0, 9)[:, None] * way
                is_beside = is_near and not body.contains(points_between).any()
            frame = f.frame[-1]
            if is_beside and is_at_hole(f.x[-1] + way / 2, frame[0], frame[1], body):
                pairs.append((gap, i, j))
    next_front: dict[int, int] = {}
    for _, i, j in sorted(pairs):
        if i not in next_front and j not in next_front.values():
            next_front[i] = j
    chains, starts = [], sorted(set(range(len(fronts))) - set(next_front.values()))
    open_fronts = set(range(len(fronts)))
    while open_fronts:
        k = starts.pop(0) if starts else min(open_fronts)
        row: list[int] = []
        while k in open_fronts:
            row.append(k)
            open_fronts.discard(k)
            k = next_front.get(k, -1)
        chains.append((tuple(row), fronts[row[0]].is_closed or k == row[0]))
    return chains


def ends_at_holes(crack: Crack, body: Body) -> list[Floats]:
    """Middles of the gaps across which fronts of a placed crack run on, length."""
    fronts, result = front_frames(crack), []
    for row, goes_round in through_holes(crack, fronts, body):
        pairs = list(zip(row, row[1:]))
        if goes_round and not fronts[row[0]].is_closed:
            pairs.append((row[-1], row[0]))
        result += [(fronts[i].x[-1] + fronts[j].x[0]) / 2 for i, j in pairs]
    return result


def joined_fronts(crack: Crack, body: Body) -> Crack | None:
    """A crack two of whose fronts have met, with one front in their place; None where none have.

    Parameters
    ----------
    crack : Crack
        With fronts, such as the two on both sides of a hole that it has grown past.
    body : Body

    Returns
    -------
    Crack or None
        With all points and faces as they were, and those of the gap; not yet placed again.

    Raises
    ------
    GeometryError
        The gap has a shape that cannot be closed.
    """
    fronts = front_frames(crack)
    if not _meets_in_hole(fronts, body):
        return None
    rows = through_holes(crack, fronts, body)
    pairs_in_order = {pair for row, _ in rows for pair in zip(row, row[1:])}
    pairs_in_order |= {(row[-1], row[0]) for row, goes_round in rows if goes_round}
    for i, f in enumerate(fronts):
        for j, g in enumerate(fronts[: i + 1]):
            pair = (f, g) if i != j else _thirds(f)
            if pair is None or (i, j) in pairs_in_order or (j, i) in pairs_in_order:
                continue
            ends = _meeting_ends(*pair, body)
            meeting_place = _meeting_place(*pair, body) if ends is None else ends[2]
            if meeting_place is None:
                continue
            rest = [front for k, front in enumerate(fronts) if k not in (i, j)]
            rest += [] if i != j else [_middle_of_front(f, *pair)]
            return _join(crack, pair, rest, float(body.cell_size(meeting_place[None])[0]), body)
    return None


def _meets_in_hole(fronts: Sequence[Front], body: Body) -> bool:
    """Whether one front ends in a hole near where another one, or itself, begins in it."""
    open_ones = [front for front in fronts if not front.is_closed]
    if not open_ones:
        return False
    first, last_x = (np.array([front.x[end] for front in open_ones]) for end in (0, -1))
    gap = np.linalg.norm(last_x[:, None] - first[None], axis=2)
    i, j = np.nonzero(gap < _LOOSE * body.cell_size(last_x)[:, None])
    normal = np.array([front.frame[-1, 1] for front in open_ones])
    is_met = is_enclosed(last_x[i], normal[i], body) & is_enclosed(first[j], normal[i], body)
    return bool(is_met.any())


def _thirds(front: Front) -> tuple[Front, Front] | None:
    """What lies at both ends of an open front."""
    first, last_row = (int(np.searchsorted(front.s, part * front.s[-1] / 3)) for part in (1, 2))
    if front.is_closed or first < 1 or last_row > len(front.x) - 2:
        return None
    return _piece(front, slice(0, first + 1)), _piece(front, slice(last_row, None))


def _middle_of_front(front: Front, first: Front, last_piece: Front) -> Front:
    """An open front between the pieces at its ends."""
    return _piece(front, slice(len(first.x) - 1, len(front.x) - len(last_piece.x) + 1))


def _piece(front: Front, part: slice) -> Front:
    return replace(
        front, x=front.x[part], frame=front.frame[part], s=front.s[part], number=front.number[part]
    )


def _ends_outside(front: Front, body: Body) -> list[tuple[int, int]]:
    """Last point in the body at each end of an open front that leaves it, and which end that is."""
    is_inside = body.contains(front.x)
    if front.is_closed or not is_inside.any():
        return []
    places = np.nonzero(is_inside)[0]
    end_places = ((int(places[0]), 0), (int(places[-1]), -1))
    return [(place, end) for place, end in end_places if not is_inside[end]]


def _meeting_ends(f: Front, g: Front, body: Body) -> tuple[int, int, Floats] | None:
    """Which ends at a hole have met behind it, so that no hole lies between them, and where."""
    for p, end in _ends_outside(f, body):
        for q, end_there in _ends_outside(g, body):
            x, y = f.x[p], g.x[q]
            size = float(body.cell_size(((x + y) / 2)[None])[0])
            way = (y - x) if end_there == 0 else (x - y)  # as a front runs that goes on from f
            gap = float(np.linalg.norm(way))
            is_aligned = end != end_there and bool(f.frame[p, 1] @ g.frame[q, 1] > _ANGLE)
            is_aligned &= min(f.frame[p, 2] @ way, g.frame[q, 2] @ way) > _FACES * gap
            if not is_aligned or gap > _WIDE * size:
                continue
            points_between = x + np.linspace(0.0, 1.0, 9)[:, None] * (y - x)
            if body.contains(points_between).all():
                return end, end_there, np.asarray((x + y) / 2)
    return None


def _meeting_place(f: Front, g: Front, body: Body) -> Floats | None:
    """Where two fronts in one surface are closer than about a cell, and lead to each other."""
    rows = np.nonzero(body.contains(f.x))[0]
    size = body.cell_size(f.x[rows])
    if not len(rows) or not body.contains(g.x).any():
        return None
    r, segment, position = front_distance(f.x[rows], g.x, g.is_closed, _NEAR * float(size.max()))
    is_near = (segment >= 0) & (r < _NEAR * size) & (r > 0)
    rows, r, size = rows[is_near], r[is_near], size[is_near]
    segment, position = segment[is_near], position[is_near]
    if not len(rows):
        return None
    t, next_point = position[:, None], (segment + 1) % len(g.x)
    foot = (1 - t) * g.x[segment] + t * g.x[next_point]
    frame = (1 - t[..., None]) * g.frame[segment] + t[..., None] * g.frame[next_point]
    way = foot - f.x[rows]
    direction, normal = f.frame[rows, 0], f.frame[rows, 1]
    normal_distance = np.abs(np.einsum("ij,ij->i", way, normal))
    faces = np.einsum("ij,ij->i", way, direction) > _FACES * r
    faces &= np.einsum("ij,ij->i", way, frame[:, 0]) < -_FACES * r
    faces &= (np.einsum("ij,ij->i", normal, frame[:, 1]) > _ANGLE) & (
        normal_distance < OFFSET * size
    )
    if not faces.any():
        return None
    k = int(np.argmin(np.where(faces, r / size, np.inf)))
    return np.asarray(f.x[rows[k]] + way[k] / 2)


def _join(
    crack: Crack, pair: tuple[Front, Front], rest: Sequence[Front], radius: float, body: Body
) -> Crack:
    """The gap between two fronts of a crack closed.

    Their ends outside the body may lie across each other: as much of them is left out.
    """
    ends = _nearest_ends(*pair, body)

    def find_blocked(k: int, fronts: tuple[Front, Front]) -> Callable[[Front], Bools]:
        facing_front = fronts[1 - k]

        def is_ahead(front: Front) -> Bools:
            centre = front.x + radius * front.frame[:, 0]
            r, segment, _ = front_distance(centre, facing_front.x, facing_front.is_closed, radius)
            flag = (segment >= 0) & (r < radius * (1 - 1e-9))
            inner_rows = np.nonzero(body.contains(front.x))[0]
            if not front.is_closed:
                flag[: inner_rows[0]] = ends is not None and ends[k] == 0
                flag[inner_rows[-1] + 1 :] = ends is not None and ends[k] == -1
            return np.asarray(flag)

        return is_ahead

    def close_gap(count: int) -> Crack:
        short_pair = (
            _with_short_ends(pair[0], count, body),
            _with_short_ends(pair[1], count, body),
        )
        return _with_gap_closed(
            Crack(crack.points, crack.faces), ([short_pair[0]], [short_pair[1]]), rest,
            (find_blocked(0, short_pair), find_blocked(1, short_pair)), radius, radius / 2,
        )  # fmt: skip

    return _first_that_closes(close_gap, (pair,))


def _nearest_ends(f: Front, g: Front, body: Body) -> tuple[int, int] | None:
    """Those ends of two fronts outside the body that lie in one hole, if any do."""
    pairs = [
        (float(np.linalg.norm(f.x[p] - g.x[q])), end, end_there)
        for p, end in _ends_outside(f, body)
        for q, end_there in _ends_outside(g, body)
        if end != end_there
    ]
    if not pairs:
        return None
    gap, end, end_there = min(pairs)
    size = float(body.cell_size(f.x[[end]])[0])
    return (end, end_there) if gap < _LOOSE * size else None


def _with_short_ends(front: Front, count: int, body: Body) -> Front:
    """An open front with at most some points outside the body at each end."""
    inner_rows = np.nonzero(body.contains(front.x))[0]
    if front.is_closed or not len(inner_rows):
        return front
    return _piece(front, slice(max(int(inner_rows[0]) - count, 0), int(inner_rows[-1]) + 1 + count))


def _with_gap_closed(
    crack: Crack,
    pair: tuple[Sequence[Front], Sequence[Front]],
    rest: Sequence[Front],
    blocked_by: tuple[Callable[[Front], Bools], ...],
    radius: float,
    size: float,
    *,
    begins_far: bool = False,
) -> Crack:
    """A crack with faces between those pieces of two groups of fronts that face each other.

    A new closed front begins at its lowest point number, or far from the gap.
    """
    runs, other_runs = (
        [(front, run) for front in group for run in _runs(front, is_blocked(front))]
        for group, is_blocked in zip(pair, blocked_by)
    )
    if not runs or len(runs) != len(other_runs):
        raise GeometryError(
            f"{len(runs)} and {len(other_runs)} pieces of the fronts of two cracks face each "
            "other: the gap between them cannot be closed."
        )
    points, faces = [crack.points], [crack.faces]
    all_fronts = (*pair[0], *pair[1], *rest)
    next_number = dict(side for front in all_fronts for side in _sides(front))
    count, left_points = len(crack.points), []
    for front, run in runs:
        facing_run = other_runs.pop(_facing_number(front, run, other_runs))
        patch = _patch(front, run, *facing_run, radius, size, count)
        for number in patch.used_faces:
            next_number.pop(int(number), None)
        next_number.update(patch.sides)
        points.append(patch.points)
        faces.append(patch.faces)
        left_points.append(crack.points[patch.used_faces])
        count += len(patch.points)
    x, gap_middle = np.concatenate(points), np.concatenate(left_points).mean(axis=0)
    lines = _chains(next_number)
    if begins_far:
        lines = [_with_start(line, all_fronts, x, gap_middle) for line in lines]
    return Crack(x, np.concatenate(faces), None, tuple(lines))


def _with_start(line: Ints, fronts: Sequence[Front], x: Floats, gap_middle: Floats) -> Ints:
    """A closed front that begins where it did, or, a new one, where it is farthest from the gap.

    Places of K follow from where it begins, so that must not depend on how points are numbered.
    """
    if line[0] != line[-1]:
        return line
    points = line[:-1]
    numbers = set(points.tolist())
    old_starts = [
        int(f.number[0]) for f in fronts if f.is_closed and set(f.number.tolist()) == numbers
    ]
    if old_starts:
        begin = int(np.nonzero(points == old_starts[0])[0][0])
    else:
        begin = int(np.argmax(np.linalg.norm(x[points] - gap_middle, axis=1)))
    return np.append(np.roll(points, -begin), points[begin])


@dataclass(frozen=True)
class FacingPart:
    """Piece of a front that faces another crack: places of its points, in the front's direction.

    Attributes
    ----------
    place : tuple of int
        With the first point on either side that a disc can touch.
    ends : (bool, bool)
        Whether the piece ends with the front itself, at its beginning and at its end.
    """

    place: tuple[int, ...]
    ends: tuple[bool, bool]


@dataclass(frozen=True, eq=False)
class _Patch:
    """New faces between two fronts, the sides of the new front, and the points it leaves."""

    points: Floats
    faces: Ints
    sides: dict[int, int]
    used_faces: Ints


def _blocked_points(front: Front, tree: TriangleTree, radius: float, step: float) -> Bools:
    """Points of a front ahead of which a disc cannot lie without entering the other crack.

    Beyond a step the other crack is seen as it lies along the surface.
    """
    centre = front.x + radius * front.frame[:, 0]
    nearest_point = closest_in(tree, centre, float(np.hypot(radius, step)))
    way = nearest_point.foot - centre
    normal_distance = np.einsum("ij,ij->i", way, front.frame[:, 1])
    distance_along = np.sqrt(np.maximum(nearest_point.distance**2 - normal_distance**2, 0.0))
    distance = np.where(np.abs(normal_distance) <= step, distance_along, nearest_point.distance)
    return np.asarray((nearest_point.triangle >= 0) & (distance < radius * (1 - 1e-9)))


def _runs(front: Front, is_blocked: Bools) -> list[FacingPart]:
    m = len(is_blocked)
    if front.is_closed and is_blocked.all():
        raise GeometryError(
            f"the front around {at(front.x.mean(axis=0))} faces another crack all the way round: "
            "one of them encloses the other."
        )
    result = []
    for run in runs_of(is_blocked) if front.is_closed else open_runs(is_blocked):
        first, end = int(run[0]), int(run[-1])
        if front.is_closed:
            count = len(run) + 2
            result.append(
                FacingPart(tuple(int((first - 1 + k) % m) for k in range(count)), (False, False))
            )
            continue
        ends = first == 0, end == m - 1
        place = range(max(first - 1, 0), min(end + 1, m - 1) + 1)
        result.append(FacingPart(tuple(place), ends))
    return result


def _sides(front: Front) -> list[tuple[int, int]]:
    number = front.number.tolist()
    next_number = number[1:] + number[:1] if front.is_closed else number[1:]
    return list(zip(number, next_number))


def _facing_number(
    front: Front, run: FacingPart, other_runs: list[tuple[Front, FacingPart]]
) -> int:
    """Number of the piece of the other crack's fronts that faces this one."""
    middle = front.x[list(run.place)].mean(axis=0)
    distances = [
        float(np.linalg.norm(front_there.x[list(piece.place)].mean(axis=0) - middle))
        for front_there, piece in other_runs
    ]
    return int(np.argmin(distances))


def _patch(
    front: Front,
    run: FacingPart,
    front_there: Front,
    piece: FacingPart,
    radius: float,
    size: float,
    count: int,
) -> _Patch:
    """Faces that close the gap between two pieces of fronts that run against each other."""
    a, b = list(run.place), list(piece.place)
    at_start = run.ends[0] or piece.ends[1]
    at_stop = run.ends[1] or piece.ends[0]
    if at_start:
        a, b = _up_to_end(front, a, 0, radius), _up_to_end(front_there, b, -1, radius)
    if at_stop:
        a, b = _up_to_end(front, a, -1, radius), _up_to_end(front_there, b, 0, radius)
    no_triangles = np.zeros((0, 3))
    stop = no_triangles if at_stop else _arc(front, a[-1], front_there, b[0], size)
    start = no_triangles if at_start else _arc(front_there, b[-1], front, a[0], size)
    stop_number = count + np.arange(len(stop))
    start_number = count + len(stop) + np.arange(len(start))
    number = np.concatenate([front.number[a], stop_number, front_there.number[b], start_number])
    x = np.concatenate([front.x[a], stop, front_there.x[b], start])
    # The front turns round where the pieces end: its way along an arc is against the outline.
    lines = []
    if not at_start:
        lines.append([front.number[a[0]], *start_number[::-1], front_there.number[b[-1]]])
    if not at_stop:
        lines.append([front_there.number[b[0]], *stop_number[::-1], front.number[a[-1]]])
    sides = {int(p): int(q) for line in lines for p, q in zip(line, line[1:])}
    used_numbers = np.concatenate([front.number[a[:-1]], front_there.number[b[:-1]]])
    normal = np.concatenate([front.frame[a, 1], front_there.frame[b, 1]]).mean(axis=0)
    return _Patch(np.concatenate([stop, start]), number[_triangles(x, normal)], sides, used_numbers)


def _up_to_end(front: Front, place: list[int], end: int, radius: float) -> list[int]:
    """Places of a piece led on to the first (0) or last (-1) point of its front.

    There both fronts lie outside the body, where one may be longer than the other.
    """
    m = len(front.x)
    rest = list(range(place[0])) if end == 0 else list(range(place[-1] + 1, m))
    if not rest:
        return place
    way = np.linalg.norm(front.x[rest] - front.x[place[end]], axis=1)
    if front.is_closed or way.max() > _LOOSE * radius:
        raise GeometryError(
            f"a front ends where it faces another crack at {at(front.x[place[end]])}, whose front "
            "goes on: the gap between them cannot be closed."
        )
    return rest + place if end == 0 else place + rest


def _arc(f: Front, i: int, g: Front, j: int, size: float) -> Floats:
    """Points between point i of one front and point j of another, tangential to both.

    The cubic of a circle that both fronts touch.
    """
    first_point, last_point = f.x[i], g.x[j]
    tangent_out, tangent_in = -f.frame[i, 2], g.frame[j, 2]
    turn = float(np.arccos(np.clip(-(tangent_out @ tangent_in), -1.0, 1.0)))
    chord = float(np.linalg.norm(last_point - first_point))
    radius = chord / (2 * max(np.sin(turn / 2), 0.1))
    handle = 4 / 3 * np.tan(turn / 4) * radius if turn > 0.1 else chord / 3
    count = max(2, round(max(turn * radius, chord) / size))
    t = (np.arange(1, count) / count)[:, None]
    second_point, third_point = first_point + handle * tangent_out, last_point + handle * tangent_in
    return np.asarray(
        (1 - t) ** 3 * first_point
        + 3 * t * (1 - t) ** 2 * second_point
        + 3 * t**2 * (1 - t) * third_point
        + t**3 * last_point
    )


def _triangles(x: Floats, normal: Floats) -> Ints:
    """Triangles of an outline `(m, 3)` that is nearly plane, run through round the normal."""
    normal = unit(normal)
    first = unit(np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]))
    plane_points = (x - x.mean(axis=0)) @ np.stack([first, np.cross(normal, first)], axis=1)
    next_points = np.roll(plane_points, -1, axis=0)
    if self_crossing(plane_points) is not None or cross(plane_points, next_points).sum() <= 0:
        raise GeometryError(
            f"the gap between two fronts around {at(x.mean(axis=0))} has an outline that crosses "
            "itself: it cannot be closed. Take a smaller da."
        )
    return without_slivers(plane_points, ear_clipped(plane_points), (x - x.mean(axis=0)) @ normal)


def _chains(next_number: dict[int, int]) -> list[Ints]:
    """Fronts as point numbers: open ones first from their beginning, closed ones repeat theirs."""
    following_points, result = dict(next_number), []
    starts = sorted(set(next_number) - set(next_number.values()))
    while following_points:
        begin = starts.pop(0) if starts else min(following_points)
        line = [begin]
        while line[-1] in following_points:
            line.append(following_points.pop(line[-1]))
        result.append(np.array(line))
    return sorted(result, key=lambda line: int(line.min()))


__all__ = [
    "OFFSET",
    "STEP",
    "FrontGap",
    "OwnGap",
    "ends_at_holes",
    "gap_between",
    "joined_fronts",
    "merged_crack",
    "own_gap",
    "own_gap_around",
    "turned_crack",
    "with_own_gap_closed",
    "without_inner_front",
]
