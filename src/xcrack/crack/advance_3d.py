"""Growth of cracks in 3D: their fronts advance, and a strip of triangles joins the surface."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import GeometryError, warn
from xcrack.crack.advance_in_body import BESIDE, SAMPLES, Rays, rays_in_body
from xcrack.crack.boundary_trace import is_enclosed
from xcrack.crack.crack import Crack
from xcrack.crack.front_chain import (
    FrontChain,
    along_front,
    chain,
    division_points,
    faired_front,
    spaced_front,
    stitch_side,
    without_loops,
    without_notches,
    without_sides,
)
from xcrack.crack.fronts import Front, front_curve, front_frames, joined_front, steps
from xcrack.crack.merging import through_holes
from xcrack.mesh.distances import first_crossing, front_distance, surface_distance, triangle_tree
from xcrack.mesh.locate import Body
from xcrack.mesh.triangulation import rim, sides

LOW, HIGH = 0.5, 1.5  # bounds of the spacing of front points, in sizes
_LEAST = 0.02  # of the size, and at most a tenth of the largest: a smaller advance is ignored
_UPRIGHT = 0.05  # cosine to the expected normal below which a triangle is turned over
_LOST = 0.05  # share of its length that fairing may take from a front before a warning
_PASSES = 2.0  # of fairing, an advance of one size
_SHARP = np.cos(np.radians(30.0))  # a front that turns by more has a corner
_REACH = (1.15, 0.5)  # advances, and sizes, that a new front is at most away from the old one
_AHEAD = 0.6  # of the size: half as far from this place ahead of a front no crack may lie


def advance_fronts(
    crack: Crack,
    s: ArrayLike,
    front: ArrayLike,
    angle: ArrayLike,
    da: ArrayLike,
    size: float,
    body: Body | None = None,
) -> Crack:
    """Let the fronts of a placed 3D crack advance.

    Each vertex of a front moves by da (cos(angle) t + sin(angle) n) in its frame, and a strip of
    triangles joins the old front with the new one. Angle and advance run between the given
    places as monotone cubics, around closed fronts periodically; beyond the first and last place
    of an open front they are constant. The new front is faired (see `front_chain.faired_front`),
    its points are merged and split so that they lie between 0.5 and 1.5 sizes apart.

    In a body, what comes to a hole goes into it and no farther, and from then on ends of open
    fronts are led out of the body anew, fronts on both sides of a hole advance as one that runs on
    across it, and two fronts of one crack that meet stop a short way before (`placing_3d` joins
    them).

    Parameters
    ----------
    crack : Crack
        Placed in a mesh.
    s : (f,) array, length
        Places along the fronts, from the first point of each, as in `SIF`.
    front : (f,) array of int
        Which front. A front that is not named stays.
    angle : (f,) array, rad
        Kink angle, positive towards the normal of lip +.
    da : (f,) array, length
        Advance; where it is 0 on both sides of a point of the front, that point stays. Advances
        below a fiftieth of `size` (or a tenth of the largest one, if that is less) are none.
    size : float, length
        Spacing of the points of the new front, about half a cell to a cell.
    body : Body, optional
        That the crack lies in; without it the crack grows as in an unbounded one.

    Returns
    -------
    Crack
        The old points and faces come first and are unchanged to the last bit; `fronts` hold the
        new ones, in the same order and direction, one for those on both sides of a hole. Not yet
        placed again: parts of the fronts may lie outside the body.

    Raises
    ------
    GeometryError
        Numbers that do not fit or are not finite, a front that closes upon itself, meets another
        part of the crack, or folds because its neighbours turn in opposite directions.
    """
    s, angle, da = (np.asarray(v, dtype=float) for v in (s, angle, da))
    number = np.asarray(front, dtype=np.int64)
    _check(crack, s, number, angle, da, size)
    fronts = front_frames(crack)
    single_fronts = [((k,), front.is_closed) for k, front in enumerate(fronts)]
    chains = through_holes(crack, fronts, body) if body is not None else single_fronts
    rays_of_chains, wholes = [], []
    for members, goes_round in chains:
        old_front, begin = joined_front([fronts[k] for k in members], goes_round)
        is_member = np.isin(number, members)
        shift = np.zeros(len(fronts))
        shift[list(members)] = begin
        wholes.append(old_front)
        place = s[is_member] + shift[number[is_member]]
        rays_of_chains.append(
            _advanced_points(old_front, place, angle[is_member], da[is_member], size)
        )
    meeting_points = np.zeros((0, 3))
    if body is not None and chains == single_fronts and not _has_way_to_hole(rays_of_chains, body):
        body = None  # no hole is near: the way of any front
    if body is not None:
        rays_of_chains, meeting_points = rays_in_body(rays_of_chains, size, body)
    n_points = len(crack.points)
    points, faces = [crack.points], [crack.faces]
    lines: list[Ints] = []
    strips: list[tuple[int, AdvanceStrip]] = []
    for (members, _), old_front, rays in zip(chains, wholes, rays_of_chains):
        if rays is None or rays[0].is_at_rest.all():
            lines.extend((crack.fronts or ())[k] for k in members)
            continue
        path = float(np.linalg.norm(rays[0].stop - rays[0].start, axis=1).max())
        longest_path = float(da[number == members[0]].max()) if body is None else path
        strip = _strip(old_front, rays, longest_path, size, n_points, body)
        if body is not None:
            _check_reach(
                old_front, strip.points, float(da[np.isin(number, members)].max()), size, body
            )
        points.append(strip.points)
        faces.append(strip.faces)
        parts = [strip.front] if len(members) == 1 else _parts(strip.front, crack)
        strips.extend((len(lines) + k, strip) for k in range(len(parts)))
        lines.extend(parts)
        n_points += len(strip.points)
    grown_crack = Crack(
        np.concatenate(points), np.concatenate(faces), None, tuple(lines), crack.ends_on
    )
    if body is not None:
        _check_folds(grown_crack)
    for k, strip in strips:
        _check_free(crack, grown_crack, k, strip, size, body, meeting_points)
    return grown_crack


def _has_way_to_hole(rays_of_fronts: Sequence[Rays | None], body: Body) -> bool:
    """Whether something that fronts send out comes from the body into a hole of it."""
    share = np.linspace(0.0, 1.0, SAMPLES + 1)[1:]
    for rays in rays_of_fronts:
        if rays is None:
            continue
        front, normal = rays[0], rays[2]
        move = front.stop - front.start
        x = front.start[:, None] + share[:, None] * move[:, None]
        is_outside = ~body.contains(x.reshape(-1, 3)).reshape(len(move), -1)
        rows = np.nonzero(is_outside.any(axis=1) & body.contains(front.start))[0]
        leaving_points = x[rows, np.argmax(is_outside[rows], axis=1)]
        if len(rows) and is_enclosed(leaving_points, normal[rows], body).any():
            return True
    return False


def _check_reach(old_front: Front, x: Floats, da: float, size: float, body: Body) -> None:
    """Raise where a front in the body has come farther from the old one than it advances."""
    x = x[body.contains(x)]
    largest_reach = _REACH[0] * da + _REACH[1] * size
    if not len(x):
        return
    distance, _, _ = front_distance(x, old_front.x, old_front.is_closed, 4 * largest_reach)
    k = int(np.argmax(distance))
    if distance[k] > largest_reach:
        raise GeometryError(
            f"the front that has come to {_at(x[k : k + 1])} runs over itself, {distance[k]:.4g} "
            f"from where it was with an advance of {da:.4g}: parts that meet behind a hole pass "
            "each other. Take a smaller da, or smaller cells there."
        )


def _check_folds(crack: Crack) -> None:
    """Raise where faces lie on each other, so that they share a side in one direction."""
    pairs, count = np.unique(sides(crack.faces).reshape(-1, 2), axis=0, return_counts=True)
    if (count > 1).any():
        raise GeometryError(
            f"the front that has come to {_at(crack.points[pairs[count > 1][0]])} folds: its ends "
            "outside the body run into faces that lie there. Take a smaller da."
        )


def _parts(line: Ints, crack: Crack) -> list[Ints]:
    """A new front cut where it would run on from one old front to another that both stay."""
    outline = {(int(b), int(a)) for a, b in rim(crack.faces)[0]}
    is_old, n = line < len(crack.points), len(line) - 1
    cuts = [
        k for k in range(n)
        if is_old[k] and is_old[k + 1] and (int(line[k]), int(line[k + 1])) not in outline
    ]  # fmt: skip
    if cuts and line[0] == line[-1]:
        line = np.append(np.roll(line[:-1], -1 - cuts[0]), line[cuts[0] + 1])[:-1]
        cuts = [k - cuts[0] - 1 for k in cuts[1:]]
    ends = [0, *(k + 1 for k in cuts), len(line)]
    return [line[a:b] for a, b in zip(ends, ends[1:]) if b - a > 1]


@dataclass(frozen=True, eq=False)
class AdvanceStrip:
    """What one front adds to its crack."""

    points: Floats
    faces: Ints
    front: Ints
    start: Floats
    stop: Floats


def _check(crack: Crack, s: Floats, front: Ints, angle: Floats, da: Floats, size: float) -> None:
    if crack.fronts is None:
        raise GeometryError("the crack is not placed in a mesh: it has no fronts to advance.")
    if not (s.ndim == 1 and s.shape == front.shape == angle.shape == da.shape):
        raise GeometryError(
            f"s, front, angle and da must be as long as each other, not {s.shape}, {front.shape}, "
            f"{angle.shape} and {da.shape}."
        )
    if not (np.isfinite(size) and size > 0):
        raise GeometryError(
            f"the size {value_text(size)} of a front's sides must be positive and finite."
        )
    for name, values in (("s", s), ("angle", angle), ("da", da)):
        if not np.isfinite(values).all():
            place = int(np.argmin(np.isfinite(values)))
            raise GeometryError(f"{name} = {values[place]} at front place {place} is not finite.")
    if (da < 0).any():
        place = int(np.argmin(da))
        raise GeometryError(f"da = {da[place]} at front place {place}: a crack does not shrink.")
    if len(front) and not (front.min() >= 0 and front.max() < len(crack.fronts)):
        raise GeometryError(
            f"places name fronts {front.min()} to {front.max()}; the crack has fronts 0 to "
            f"{len(crack.fronts) - 1}."
        )


def _strip(
    old_front: Front,
    rays_of_front: Rays,
    longest_path: float,
    size: float,
    n_points: int,
    body: Body | None,
) -> AdvanceStrip:
    """New points and faces ahead of one front."""
    rays, vertex, normal = rays_of_front
    front = without_loops(rays)
    if len(front.x) < 3 and old_front.is_closed:
        raise _closing_error(old_front)
    # A wave along the front is damped, beyond da of a few sides turned over, by the growth itself:
    # K is larger where the front lags behind. What longer steps overshoot more passes take away.
    faired = faired_front(front, int(np.clip(np.ceil(_PASSES * longest_path / size), 1, 8)))
    length_before = np.linalg.norm(front.side, axis=1).sum()
    length_after = np.linalg.norm(faired.side, axis=1).sum()
    if abs(length_after - length_before) > _LOST * length_before:
        warn(
            f"fairing changes the length of the front at {_at(faired.x)} from {length_before:.4g} "
            f"to {length_after:.4g}: its points zigzag. K along the front, or the advance, jumps "
            "from point to point; smooth it, or take a smaller da."
        )
    return _joined_strip(old_front, rays, faired, vertex, normal, size, n_points, body)


def _joined_strip(
    old_front: Front,
    rays: FrontChain,
    front: FrontChain,
    vertex: Ints,
    normal: Floats,
    size: float,
    n_points: int,
    body: Body | None,
) -> AdvanceStrip:
    """The strip to a new front whose points are merged and split, no triangle turned over.

    Where points that have been left out turn triangles over (a short advance of a curved front)
    they are taken back; where points that have run into each other do so, these are merged.
    Outside the body nothing depends on it.
    """
    is_pinned = rays.is_pinned[rays.owner]
    is_needed = np.zeros(len(rays.owner), dtype=bool)
    while True:
        trial = _cleared_front(_pinned_front(front, is_pinned | is_needed), size)
        strip, turned_sides = _stitched_strip(old_front, trial, vertex, normal, size, n_points)
        if not len(turned_sides):
            return strip
        ends = np.concatenate([turned_sides, (turned_sides + 1) % len(trial.x)])
        is_around = np.isin(trial.owner, ends)
        if (is_around & ~is_needed).any():
            is_needed |= is_around
            continue
        if body is not None:
            is_inside = body.contains(trial.x)
            turned_sides = turned_sides[
                is_inside[turned_sides] | is_inside[(turned_sides + 1) % len(is_inside)]
            ]
            if not len(turned_sides):
                return strip
        front = without_sides(_pinned_front(trial, is_pinned), turned_sides)
        if old_front.is_closed and len(front.x) < 3:
            raise _closing_error(old_front)
        if len(front.x) == len(trial.x):
            raise GeometryError(
                f"the front that has come to {_at(trial.x[turned_sides[:1]])} folds: neighbours "
                f"turn in opposite directions or run into each other there. Take a smaller da, or "
                f"smooth the angles along the front."
            )


def _pinned_front(front: FrontChain, rays: Bools) -> FrontChain:
    """A front of which those points are pinned that one of the given rays has become."""
    is_pinned = np.zeros(len(front.x), dtype=bool)
    is_pinned[front.owner[rays]] = True
    return replace(front, is_pinned=is_pinned)


def _cleared_front(front: FrontChain, size: float) -> FrontChain:
    """A front without short sides and notches."""
    while True:
        count = len(front.x)
        front = without_notches(spaced_front(front, LOW * size))
        if len(front.x) == count:
            return front


def _closing_error(old_front: Front) -> GeometryError:
    return GeometryError(
        f"the front around {_at(old_front.x)} closes upon itself: what it went around is cut "
        "through. End growth before, or take a smaller da to come closer."
    )


def _at(x: Floats) -> list[float]:
    return list(np.round(x.mean(axis=0), 6).tolist())


def _advanced_points(
    old_front: Front, s: Floats, angle: Floats, da: Floats, size: float
) -> Rays | None:
    """Where the points of a front go, which of them are its vertices, and the new normals.

    Sides of the front much longer than `size` send out points from between their ends. None where
    the front stays.
    """
    if not len(s) or da.max() == 0:
        return None
    m, is_closed = len(old_front.x), old_front.is_closed
    next_point = np.roll(np.arange(m), -1) if is_closed else np.arange(1, m)
    first_point = np.arange(len(next_point))
    side = np.linalg.norm(old_front.x[next_point] - old_front.x[first_point], axis=1)
    arc_of_points = front_curve(old_front.x, old_front.frame, is_closed).breaks
    length = float(arc_of_points[-1])
    pieces = np.where(side > HIGH * size, np.round(side / size), 1).astype(np.int64)
    inner_points = division_points(old_front.x, is_closed, pieces, np.zeros(m, dtype=bool))
    own_frame = _frames(old_front)
    x: list[Floats] = []
    place: list[float] = []
    frame: list[Floats] = []
    vertex: list[int] = []
    for j in range(m):
        vertex.append(len(place))
        x.append(old_front.x[j : j + 1])
        place.append(float(arc_of_points[j]))
        frame.append(own_frame[j : j + 1, :2])
        if j == len(first_point):
            break
        t = np.arange(1, pieces[j]) / pieces[j]
        x.append(inner_points[j])
        place.extend(arc_of_points[j] + t * (arc_of_points[j + 1] - arc_of_points[j]))
        blend = t[:, None, None]
        frame.append((1 - blend) * own_frame[j, :2] + blend * own_frame[next_point[j], :2])
    start, arcs = np.concatenate(x), np.array(place)
    frame_ahead, normal = np.concatenate(frame).transpose(1, 0, 2)
    step = along_front(s, da, arcs, is_closed, length)
    turn = along_front(s, angle, arcs, is_closed, length)
    step[step < min(_LEAST * size, 0.1 * float(step.max()))] = 0.0
    direction = np.cos(turn)[:, None] * frame_ahead + np.sin(turn)[:, None] * normal
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    stop = start + step[:, None] * direction
    new_normal = np.cos(turn)[:, None] * normal - np.sin(turn)[:, None] * frame_ahead
    is_at_rest = step == 0
    if is_at_rest.all():
        return None
    is_vertex = np.zeros(len(start), dtype=bool)
    is_vertex[vertex] = True
    has_ray = is_vertex | ~is_at_rest
    number = np.cumsum(has_ray) - 1
    rays = chain(start[has_ray], stop[has_ray], is_at_rest[has_ray], is_closed)
    return rays, number[np.array(vertex)], new_normal[has_ray]


def _frames(front: Front) -> Floats:
    """Frames of a front, at its corners with the bisector of both sides for the direction ahead."""
    frame = np.array(front.frame)
    side = steps(front.x, front.is_closed)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    previous_side = np.roll(side, 1, axis=0)
    if not front.is_closed:
        previous_side, side = np.concatenate([side[:1], side]), np.concatenate([side, side[-1:]])
    is_sharp = np.einsum("ij,ij->i", previous_side, side) < _SHARP
    bisector = (previous_side + side)[is_sharp]
    bisector /= np.maximum(np.linalg.norm(bisector, axis=1, keepdims=True), 1e-300)
    normal = frame[is_sharp, 1]
    normal -= np.einsum("ij,ij->i", normal, bisector)[:, None] * bisector
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    frame[is_sharp] = np.stack([np.cross(normal, bisector), normal, bisector], axis=1)
    return frame


def _stitched_strip(
    old_front: Front, front: FrontChain, vertex: Ints, normal: Floats, size: float, n_points: int
) -> tuple[AdvanceStrip, Ints]:
    """The strip up to a new front, and the sides of it at which triangles are turned over."""
    is_fixed = front.fixed_sides()
    length = np.linalg.norm(front.side, axis=1)
    pieces = np.where(~is_fixed & (length > HIGH * size), np.round(length / size), 1).astype(
        np.int64
    )
    n, n_rays = len(front.x), len(front.owner)
    own_number = np.full(n, -1)
    ray_to_vertex = np.full(n_rays, -1)
    ray_to_vertex[vertex] = np.arange(len(vertex))
    rows_at_rest = np.nonzero(front.is_at_rest)[0]
    own_number[front.owner[rows_at_rest]] = old_front.number[ray_to_vertex[rows_at_rest]]
    inner_points = division_points(front.x, front.is_closed, pieces, own_number >= 0)
    points: list[Floats] = []
    line: list[int] = []
    begin = np.zeros(n, dtype=np.int64)
    count = n_points
    x_of: dict[int, Floats] = {int(number): x for number, x in zip(old_front.number, old_front.x)}
    for g in range(n):
        begin[g] = len(line)
        new_places = [] if own_number[g] >= 0 else [front.x[g]]
        if g < len(inner_points):
            new_places.extend(inner_points[g])
        if own_number[g] >= 0:
            line.append(int(own_number[g]))
        for x in new_places:
            x_of[count] = x
            line.append(count)
            count += 1
        points.extend(new_places)
    if front.is_closed:
        line.append(line[0])
    end = np.append(begin[1:], len(line) - 1)
    faces: list[tuple[int, int, int]] = []
    turned_sides: list[int] = []
    n_sides = len(vertex) if front.is_closed else len(vertex) - 1
    for j in range(n_sides):
        first, last_ray = int(vertex[j]), int(vertex[(j + 1) % len(vertex)])
        last_ray += n_rays if last_ray <= first else 0
        owners = front.owner[np.arange(first, last_ray + 1) % n_rays]
        chain_ahead, crossing_owners = [line[begin[owners[0]]]], []
        for owner, next_owner in zip(owners, owners[1:]):
            if owner != next_owner:
                crossing_owners.append(int(owner))
                chain_ahead.extend(line[begin[owner] + 1 : end[owner] + 1])
        corners = int(old_front.number[j]), int(old_front.number[(j + 1) % len(vertex)])
        x = np.array([x_of[p] for p in (*corners, *chain_ahead)])
        expected_normal = normal[first] + normal[last_ray % n_rays]
        expected_normal /= np.linalg.norm(expected_normal)
        triangles, cosine = stitch_side(corners, chain_ahead, x, expected_normal)
        faces.extend(triangles)
        if cosine < _UPRIGHT:
            turned_sides.extend(crossing_owners or [(int(owners[0]) - 1) % n, int(owners[0])])
    turned_sides = [side for side in turned_sides if side < len(front.side)]
    strip = AdvanceStrip(
        np.array(points).reshape(-1, 3),
        np.array(faces, dtype=np.int64).reshape(-1, 3),
        np.array(line),
        front.start[~front.is_at_rest],
        front.stop[~front.is_at_rest],
    )
    return strip, np.array(turned_sides, dtype=np.int64)


def _check_free(
    old_crack: Crack, grown_crack: Crack, number: int, strip: AdvanceStrip, size: float,
    body: Body | None, meeting_points: Floats,
) -> None:  # fmt: skip
    """Raise where a front that has advanced meets another part of its crack.

    Outside the body it may, and beside the places where two fronts meet.
    """
    new_front = front_frames(grown_crack)[number]
    is_moved = new_front.number >= len(old_crack.points)
    if not new_front.is_closed:
        is_moved[[0, -1]] = False  # outside the body, beside the outline of the mouth
    probe = new_front.x[is_moved] + _AHEAD * size * _frames(new_front)[is_moved, 0]
    probe = probe[_must_be_free(new_front.x[is_moved], size, body, meeting_points)]
    phi, _, _ = surface_distance(probe, grown_crack.points, grown_crack.faces, _AHEAD * size)
    hit = probe[np.abs(phi) < 0.5 * _AHEAD * size]
    if not len(hit):
        path = strip.stop - strip.start
        length = np.linalg.norm(path, axis=1)
        # The faces around the start of a path are its own.
        is_far = (length > 0.5 * size) & _must_be_free(strip.stop, size, body, meeting_points)
        start = strip.start[is_far] + path[is_far] * (0.5 * size / length[is_far])[:, None]
        stop = strip.stop[is_far]
        triangle_hit, place = first_crossing(
            triangle_tree(old_crack.points, old_crack.faces), start, stop
        )
        hit = (start + place[:, None] * (stop - start))[triangle_hit >= 0]
    if len(hit):
        raise GeometryError(
            f"front {number} of a crack meets another part of the same crack near "
            f"{np.round(hit[0], 6).tolist()}: the ligament between them is cut through, which is "
            "not modelled. End growth before, or describe what has joined as one crack and go on."
        )


def _must_be_free(x: Floats, size: float, body: Body | None, meeting_points: Floats) -> Bools:
    """Which points of a front lie in the body, and not beside others that it meets `(n,)`."""
    if body is None:
        return np.ones(len(x), dtype=bool)
    is_free = body.contains(x)
    if len(meeting_points):
        is_free &= cKDTree(meeting_points).query(x)[0] > BESIDE * size
    return np.asarray(is_free)
