"""What a body does to an advance in 3D: holes stop it, other fronts too, and ends lie outside.

A crack that comes to a hole goes into it: faces outside the body span what lies between its parts
on both sides, as far as these have come, and no face lies in the body that growth did not make.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints, open_runs, runs_of
from xcrack.crack.boundary_trace import way_to_middle
from xcrack.crack.front_chain import FrontChain, chain
from xcrack.mesh.locate import Body

Rays = tuple[FrontChain, Ints, Floats]  # what is sent out, which are vertices, normals there

_LEAST = 0.02  # of the size: a shorter advance is none
SAMPLES = 16  # of a way, to find holes on it
_HOLE = 1.0  # sizes: a shorter way through a hole is passed over
_ROOM = 0.5  # sizes that two fronts which meet leave between them
_FACES = 0.5  # cosine between a way and another front that it leads to
_TANGENT = 1.5  # sizes over which the direction of a front at its end is taken
_SHORT = 0.5  # sizes: an end outside the body that is shorter is none
_CROSS = 0.5  # sizes by which two ends outside the body come closer only where they cross
_THROUGH = 4.0  # sizes of the body that a way from end to end of a front may lead through
BESIDE = 4.0  # sizes from where fronts meet, and between their ends, where they may come close


def rays_in_body(
    rays_of_fronts: Sequence[Rays | None], size: float, body: Body
) -> tuple[list[Rays | None], Floats]:
    """What the fronts of a crack send out, as far as it goes in a body.

    Parameters
    ----------
    rays_of_fronts : sequence of Rays or None
        One a front.
    size : float, length
        Of the sides of fronts.
    body : Body

    Returns
    -------
    rays_of_fronts : list of Rays or None
    meeting_points : (k, 3) array, length
        Where two fronts of the crack, or its ends at a hole, are about to meet.
    """
    fronts = [
        None if rays is None else _stopped_in_holes(rays[0], size, body) for rays in rays_of_fronts
    ]
    fronts, meeting_points = _stopped_at_fronts(fronts, size, body)
    fronts, end_points = _with_ends_outside(fronts, size, body)
    result = [
        None if rays is None or front is None else (_still_at_vertices(front, rays[1]), *rays[1:])
        for rays, front in zip(rays_of_fronts, fronts)
    ]
    return result, np.concatenate([meeting_points, end_points])


def _still_at_vertices(front: FrontChain, vertex: Ints) -> FrontChain:
    """A front on which points within its old sides that do not move fall on vertices beside."""
    is_between = front.is_at_rest & ~np.isin(np.arange(len(front.is_at_rest)), vertex)
    if not is_between.any():
        return front
    rows, n = np.nonzero(is_between)[0], len(is_between)
    neighbour = np.zeros(n, dtype=np.int64)
    for run in runs_of(is_between) if front.is_closed else open_runs(is_between):
        # What moves beside them stays between its neighbours, or the front would turn back.
        row_before, row_after = (run[0] - 1) % n, (run[-1] + 1) % n
        neighbour[run] = (
            row_after if row_after in vertex and row_before not in vertex else row_before
        )
    neighbour = neighbour[rows]
    owner, is_at_rest, stop = (
        np.array(front.owner),
        np.array(front.is_at_rest),
        np.array(front.stop),
    )
    remains = np.ones(len(front.x), dtype=bool)
    remains[owner[rows]] = False
    owner[rows] = owner[neighbour]
    is_at_rest[rows], stop[rows] = False, front.x[owner[neighbour]]
    number = np.cumsum(remains) - 1
    return replace(
        front,
        x=front.x[remains],
        is_pinned=front.is_pinned[remains],
        owner=number[owner],
        is_at_rest=is_at_rest,
        stop=stop,
    )


def _stopped_in_holes(front: FrontChain, size: float, body: Body) -> FrontChain:
    """Ways that lead out of the body and in again end half way across what lies between."""
    share = np.linspace(0.0, 1.0, SAMPLES + 1)
    move = front.stop - front.start
    depth, _ = body.depth((front.start[:, None] + share[:, None] * move[:, None]).reshape(-1, 3))
    is_outside = depth.reshape(len(move), -1) > 0
    first = np.argmax(is_outside, axis=1)
    is_inside_again = ~is_outside & (np.arange(SAMPLES + 1) > first[:, None])
    end = np.argmax(is_inside_again, axis=1)
    comes_back = ~is_outside[:, 0] & is_outside.any(axis=1) & is_inside_again.any(axis=1)
    width = (share[end] - share[first]) * np.linalg.norm(move, axis=1)
    comes_back &= width > _HOLE * size
    largest_share = np.where(comes_back, (share[first] + share[end]) / 2, 1.0)
    return _short_ways(front, largest_share, size)


def _short_ways(front: FrontChain, share: Floats, size: float) -> FrontChain:
    """Ways cut to a share of their length; below a fiftieth of a size nothing is left of them."""
    if not (share < 1).any():
        return front
    move = share[:, None] * (front.stop - front.start)
    is_staying = front.is_at_rest | ((share < 1) & (np.linalg.norm(move, axis=1) < _LEAST * size))
    return chain(
        front.start,
        np.where(is_staying[:, None], front.start, front.start + move),
        is_staying,
        front.is_closed,
    )


def _facing_parts(fronts: Sequence[FrontChain | None]) -> Iterator[tuple[int, Ints, int, Ints]]:
    """Pairs of parts of fronts that may meet: two fronts, a third of an open one at each end."""
    for i, f in enumerate(fronts):
        for j, g in enumerate(fronts[: i + 1]):
            if f is None or g is None:
                continue
            if i != j:
                yield i, np.arange(len(f.x)), j, np.arange(len(g.x))
            elif not f.is_closed and len(f.x) > 3:
                s = np.cumsum(np.linalg.norm(f.start[1:] - f.start[:-1], axis=1))
                first, last_row = (int(np.searchsorted(s, part * s[-1] / 3)) + 1 for part in (1, 2))
                yield i, np.arange(first), i, np.arange(last_row, len(f.x))


def _stopped_at_fronts(
    fronts: Sequence[FrontChain | None], size: float, body: Body
) -> tuple[list[FrontChain | None], Floats]:
    """Ways of two fronts that lead to each other end before they meet; where they would have."""
    share = [np.ones(0) if front is None else np.ones(len(front.x)) for front in fronts]
    meeting_points = [np.zeros((0, 3))]
    for i, rows_of_one, j, rows_of_other in _facing_parts(fronts):
        for a, p, b, q in ((i, rows_of_one, j, rows_of_other), (j, rows_of_other, i, rows_of_one)):
            f, g = fronts[a], fronts[b]
            assert f is not None
            assert g is not None
            way, opposite_way = f.stop[p] - f.start[p], g.stop[q] - g.start[q]
            reach = float(
                np.linalg.norm(way, axis=1).max() + np.linalg.norm(opposite_way, axis=1).max()
            )
            distance, nearest_rows = cKDTree(g.start[q]).query(
                f.start[p], distance_upper_bound=reach + _ROOM * size
            )
            rows = np.nonzero(np.isfinite(distance) & (distance > 0))[0]
            rows = rows[body.contains(f.start[p[rows]])]
            gap, k = distance[rows], nearest_rows[rows]
            gap_direction = (g.start[q[k]] - f.start[p[rows]]) / gap[:, None]
            advance_of_one = np.einsum("ij,ij->i", way[rows], gap_direction)
            advance_of_other = -np.einsum("ij,ij->i", opposite_way[k], gap_direction)
            way_length, opposite_length = (
                np.linalg.norm(way[rows], axis=1),
                np.linalg.norm(opposite_way[k], axis=1),
            )
            hit = (advance_of_one >= _FACES * way_length) & (
                advance_of_other >= _FACES * opposite_length
            )
            hit &= advance_of_one + advance_of_other > gap - _ROOM * size
            part = (
                np.maximum(gap - _ROOM * size, 0.0)[hit] / (advance_of_one + advance_of_other)[hit]
            )
            np.minimum.at(share[a], p[rows[hit]], part)
            meeting_points.append((f.start[p[rows]] + g.start[q[k]])[hit] / 2)
    result = [
        None if front is None else _short_ways(front, part, size)
        for front, part in zip(fronts, share)
    ]
    return result, np.concatenate(meeting_points)


@dataclass(frozen=True, eq=False)
class _FrontEnd:
    """How a front goes on outside of the body after an advance.

    Attributes
    ----------
    front : int
    base : int
        Its ray from which it goes on, the first outside or the last in the body.
    is_inside : bool
        Whether the base lies in the body.
    path : (k, 3) array, length
        Where it goes on, from the base; without room one point.
    """

    front: int
    base: int
    is_inside: bool
    path: Floats


@dataclass(frozen=True, eq=False)
class _Gap:
    """Rays of a front outside the body: beyond its end, or between two parts of it.

    Attributes
    ----------
    rays : (k,) array of int
        In their order along the front.
    ends : (int, int)
        Numbers of the ends on both sides; -1 where the front ends outside.
    """

    rays: Ints
    ends: tuple[int, int]


def _with_ends_outside(
    fronts: Sequence[FrontChain | None], size: float, body: Body
) -> tuple[list[FrontChain | None], Floats]:
    """Fronts that go on straight from where they leave the body, and where two ends meet.

    What lay outside before the advance does not advance with a front: behind a curved wall it
    would come into the body elsewhere. Across a hole a front goes on from end to end.
    """
    ends: list[_FrontEnd] = []
    gaps: list[list[_Gap]] = []
    for k, front in enumerate(fronts):
        gaps.append([] if front is None else _gaps(k, front, ends, size, body))
    meeting_points = [np.zeros((0, 3))]
    for i in range(len(ends)):
        for j in range(i):
            if np.linalg.norm(ends[i].path[0] - ends[j].path[0]) < BESIDE * size:
                meeting_points.append((ends[i].path[:1] + ends[j].path[:1]) / 2)
            ends[i], ends[j] = _cut_where_crossing(ends[i], ends[j], size)
    result = [
        None if front is None else _led_on(front, gap, ends, size, body)
        for front, gap in zip(fronts, gaps)
    ]
    return result, np.concatenate(meeting_points)


def _gaps(
    number: int, front: FrontChain, ends: list[_FrontEnd], size: float, body: Body
) -> list[_Gap]:
    """Where a front lies outside the body; its ends there are added to a list."""
    n = len(front.x)
    is_inside_before, is_inside_after = body.contains(front.start), body.contains(front.stop)
    if is_inside_before.all() or not (is_inside_before & is_inside_after).any():
        return []
    result = []
    for run in runs_of(~is_inside_before) if front.is_closed else open_runs(~is_inside_before):
        sides = []
        for reverse in (False, True):
            row = run[::-1] if reverse else run
            step = -1 if reverse else 1
            rows_back = row[0] - step * np.arange(1, n)
            rows_back = (
                rows_back % n if front.is_closed else rows_back[(rows_back >= 0) & (rows_back < n)]
            )
            # As far back as the front lay in the body before.
            rows_back = (
                rows_back[: int(np.argmin(is_inside_before[rows_back]))]
                if not is_inside_before[rows_back].all()
                else rows_back
            )
            order = np.concatenate([rows_back[::-1], row])
            first = len(rows_back)  # the first ray that started outside
            rows_inside = np.nonzero(is_inside_after[order[: first + 1]])[0]
            if not len(rows_back) or not len(rows_inside):
                sides.append(-1)  # it ends here, or what lay in the body has left it
                continue
            leaves = min(int(rows_inside[-1]) + 1, first)
            base = int(order[leaves])
            way = _lead_out(front.stop[order[: leaves + 1]], size, body)
            path = front.stop[base][None]
            if way is not None:
                path = np.stack([path[0], path[0] + way])
            sides.append(len(ends))
            ends.append(_FrontEnd(number, base, bool(is_inside_after[base]), path))
        if max(sides) >= 0:
            result.append(_Gap(run, (sides[0], sides[1])))
    return result


def _lead_out(x: Floats, size: float, body: Body) -> Floats | None:
    """Vector by which a front goes straight on from its last point; None where none leads out."""
    distance = np.linalg.norm(x - x[-1], axis=1)
    rows_behind = np.nonzero(distance > _TANGENT * size)[0]
    begin = int(rows_behind[-1]) if len(rows_behind) else 0
    if distance[begin] == 0:
        return None
    tangent = (x[-1] - x[begin]) / distance[begin]
    length = way_to_middle(x[-1], tangent, float(body.cell_size(x[-1:])[0]), body)
    return np.asarray(length * tangent) if length > _SHORT * size else None


def _up_to_other_walls(start: Floats, stop: Floats, body: Body) -> Floats:
    """Points outside the body after a move, or the part of it over which no wall comes nearer."""
    share = np.linspace(0.0, 1.0, SAMPLES + 1)
    move = stop - start
    depth, size = body.depth((start[:, None] + share[:, None] * move[:, None]).reshape(-1, 3))
    depth, size = depth.reshape(len(move), -1), size.reshape(len(move), -1)
    is_nearer = depth < depth[:, :1] - 1e-9 * size
    end = np.where(is_nearer.any(axis=1), np.argmax(is_nearer, axis=1) - 1, SAMPLES)
    return np.asarray(start + share[end][:, None] * move)


def _cut_where_crossing(
    end_a: _FrontEnd, end_b: _FrontEnd, size: float
) -> tuple[_FrontEnd, _FrontEnd]:
    """Two ends, as far as they do not cross each other."""
    if len(end_a.path) < 2 or len(end_b.path) < 2:
        return end_a, end_b
    (x, s), (y, t) = _samples(end_a.path), _samples(end_b.path)
    gap = np.linalg.norm(x[:, None] - y[None], axis=2)
    longer_way = np.maximum(s[:, None], t[None])
    is_near = gap < _CROSS * size
    if not is_near.any():
        return end_a, end_b
    i, j = np.unravel_index(np.argmin(np.where(is_near, longer_way, np.inf)), is_near.shape)
    return _cut(end_a, float(s[i]), size), _cut(end_b, float(t[j]), size)


def _samples(path: Floats) -> tuple[Floats, Floats]:
    """Points along a path, and their arc lengths."""
    s = _arc(path)
    at = np.linspace(0.0, s[-1], 4 * SAMPLES + 1)
    return _point_on_path(path, at), at


def _arc(path: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def _point_on_path(path: Floats, at: Floats) -> Floats:
    s = _arc(path)
    return np.stack([np.interp(at, s, path[:, k]) for k in range(3)], axis=1)


def _cut(end: _FrontEnd, length: float, size: float) -> _FrontEnd:
    """An end up to an arc length."""
    total = float(_arc(end.path)[-1])
    if length >= total:
        return end
    if length < _SHORT * size:
        return replace(end, path=end.path[:1])
    return replace(end, path=_point_on_path(end.path, np.array([0.0, length])))


def _led_on(
    front: FrontChain, gaps: Sequence[_Gap], ends: Sequence[_FrontEnd], size: float, body: Body
) -> FrontChain:
    """A front whose rays outside the body come to the ways that its ends take there."""
    if not gaps:
        return front
    n = len(front.x)
    stop, is_at_rest, owner = np.array(front.stop), np.array(front.is_at_rest), np.arange(n)
    is_outside = np.zeros(n, dtype=bool)
    for gap in gaps:
        first, last_end = (ends[k] if k >= 0 else None for k in gap.ends)
        begin = int(gap.rays[0]) - 1 if first is None else first.base
        end = int(gap.rays[-1]) + 1 if last_end is None else last_end.base
        if begin == end:
            continue  # a single point, which goes on from both sides
        rays = (begin + 1 + np.arange((end - begin - 1) % n)) % n
        if not len(rays):
            continue
        target, bends = _way_across(front, rays, first, last_end, size, body)
        if not len(target):
            base = first if first is not None else last_end
            assert base is not None
            owner[rays], stop[rays], is_at_rest[rays] = base.base, base.path[0], False
            continue
        # What would turn behind the old end stays there: outside, faces need not follow it.
        way = front.stop[rays] - front.start[rays]
        advance = np.einsum("ij,ij->i", target - front.start[rays], way)
        is_staying = advance <= _LEAST * size * np.linalg.norm(way, axis=1)
        stop[rays] = np.where(is_staying[:, None], front.start[rays], target)
        is_at_rest[rays], is_outside[rays[bends]] = is_staying, True
    remains = owner == np.arange(n)
    is_pinned = (is_at_rest | is_outside)[remains]
    if not front.is_closed:
        is_pinned[[0, -1]] = True
    number = np.cumsum(remains) - 1
    return FrontChain(
        stop[remains], front.is_closed, is_pinned, front.start, stop, is_at_rest, number[owner]
    )


def _way_across(
    front: FrontChain,
    rays: Ints,
    first: _FrontEnd | None,
    last_end: _FrontEnd | None,
    size: float,
    body: Body,
) -> tuple[Floats, Ints]:
    """Where the rays of a gap go, none where the front ends before, and at which it bends."""
    start, no_bends = front.start[rays], np.zeros(0, dtype=np.int64)
    if first is None or last_end is None:
        end = first if first is not None else last_end
        assert end is not None
        points_outwards = start if first is not None else start[::-1]
        if len(end.path) > 1:
            s = _arc(np.concatenate([front.start[[end.base]], points_outwards]))
            way = _point_on_path(end.path, s[1:] / s[-1] * _arc(end.path)[-1])
            return (way if first is not None else way[::-1]), no_bends
        if end.is_inside:
            return _up_to_other_walls(start, front.stop[rays], body), no_bends
        return np.zeros((0, 3)), no_bends
    link = np.linspace(0.0, 1.0, 4 * SAMPLES + 1)[:, None] * (last_end.path[-1] - first.path[-1])
    width = float(np.linalg.norm(link[-1]))
    if float(body.contains(first.path[-1] + link).mean()) * width > _THROUGH * size:
        # Other walls lie between: faces go on up to them.
        return _up_to_other_walls(start, front.stop[rays], body), no_bends
    path = np.concatenate([first.path, last_end.path[::-1]])
    inner_path = path[1:-1]
    if len(inner_path) == 2 and width < size:
        inner_path = inner_path.mean(axis=0, keepdims=True)
    path = np.concatenate([path[:1], inner_path, path[-1:]])
    s = _arc(np.concatenate([front.start[[first.base]], start, front.start[[last_end.base]]]))
    share = _arc(path)[1:-1] / _arc(path)[-1]
    bends = np.unique(np.abs(s[1:-1, None] / s[-1] - share).argmin(axis=0))
    if len(bends) < len(inner_path):
        inner_path, bends = inner_path[:0], no_bends
    # A bend falls on a ray, and the others lie evenly between.
    known_rows = np.concatenate([[0], bends + 1, [len(s) - 1]])
    full_path = np.concatenate([path[:1], inner_path, path[-1:]])
    at = np.interp(s[1:-1], s[known_rows], np.arange(len(known_rows)))
    return np.stack(
        [np.interp(at, np.arange(len(known_rows)), full_path[:, k]) for k in range(3)], axis=1
    ), bends
