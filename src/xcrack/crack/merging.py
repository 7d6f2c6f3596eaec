"""Two cracks in 3D that lie in one surface made one: their fronts meet, and one front goes on.

The merged surface is the closing of both by a disc (Serra, 1982, sec. II.C): what a disc in the
surface ahead of the fronts cannot reach without entering one of the cracks is filled. Hollow
corners where the fronts meet are thus rounded with its radius.
"""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.errors import GeometryError
from xcrack.crack.boundary_trace import runs_of
from xcrack.crack.crack import Crack
from xcrack.crack.fronts import Front, front_frames
from xcrack.mesh.distances import TriangleTree, closest_in, triangle_tree
from xcrack.mesh.locate import Body
from xcrack.mesh.polygon import cross, ear_clipped, self_crossing, without_slivers
from xcrack.mesh.triangulation import unit

_ANGLE = np.cos(np.radians(20.0))  # normals of both cracks may differ by as much
OFFSET = 0.5  # of a cell: one crack may lie as far beside the surface of the other
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
    """

    width: float
    offset: float
    turn: float
    x: Floats

    def in_surface(self, size: float, most: float = OFFSET) -> bool:
        """Whether both lie in one surface, up to a share of a size."""
        return abs(self.turn) >= _ANGLE and self.offset <= most * size


def gap_between(one: Crack, other: Crack, body: Body, reach: float) -> FrontGap | None:
    """Where the fronts of two cracks come closest in a body; None where farther than `reach`.

    Parameters
    ----------
    one, other : Crack
        With fronts.
    body : Body
    reach : float, length

    Returns
    -------
    Gap or None
    """
    best: FrontGap | None = None
    for a, b in ((one, other), (other, one)):
        low, high = b.points.min(axis=0) - reach, b.points.max(axis=0) + reach
        tree: TriangleTree | None = None
        for front in front_frames(a):
            near_box = ((front.x >= low) & (front.x <= high)).all(axis=1)
            if not near_box.any():
                continue
            tree = triangle_tree(b.points, b.faces) if tree is None else tree
            x, normal = front.x[near_box], front.frame[near_box, 1]
            closest = closest_in(tree, x, reach)
            rows = np.nonzero((closest.triangle >= 0) & body.contains(x))[0]
            if not len(rows):
                continue
            way = closest.foot[rows] - x[rows]
            across = np.einsum("ij,ij->i", way, normal[rows])
            along = np.linalg.norm(way - across[:, None] * normal[rows], axis=1)
            k = int(np.argmin(along))
            row = rows[k]
            if best is None or along[k] < best.width:
                turn = float(tree.normal[closest.triangle[row]] @ normal[row])
                best = FrontGap(float(along[k]), float(abs(across[k])), turn, x[row] + way[k] / 2)
    return best


def turned_crack(crack: Crack) -> Crack:
    """The same crack with lip + and lip - exchanged; its fronts run the other way."""
    fronts = None if crack.fronts is None else tuple(front[::-1] for front in crack.fronts)
    return Crack(crack.points, crack.faces[:, ::-1], crack.tips, fronts)


def merged_crack(one: Crack, other: Crack, radius: float, size: float) -> Crack:
    """Two cracks that lie in one surface, and nearly touch, as one.

    Parameters
    ----------
    one, other : Crack
        With fronts that do not overlap; their normals agree where they are close.
    radius : float, length
        Of the disc that closes the gap.
    size : float, length
        Spacing of new front points.

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
    n = len(one.points)
    shifted = Crack(
        np.concatenate([one.points, other.points]),
        other.faces + n,
        None,
        tuple(front + n for front in other.fronts or ()),
    )
    pair = (front_frames(one), front_frames(shifted))
    trees = tuple(triangle_tree(c.points, c.faces) for c in (other, one))
    runs = [
        (front, run)
        for front in pair[0]
        for run in _runs(front, _blocked_points(front, trees[0], radius))
    ]
    others = [
        (front, run)
        for front in pair[1]
        for run in _runs(front, _blocked_points(front, trees[1], radius))
    ]
    if not runs or len(runs) != len(others):
        raise GeometryError(
            f"{len(runs)} and {len(others)} pieces of the fronts of two cracks face each other: "
            "the gap between them cannot be closed."
        )
    points, faces = [shifted.points], [one.faces, shifted.faces]
    following = dict(side for fronts in pair for front in fronts for side in _sides(front))
    count = len(shifted.points)
    for front, run in runs:
        mate = others.pop(_facing_number(front, run, others))
        patch = _patch(front, run, *mate, radius, size, count)
        for number in patch.used:
            following.pop(int(number), None)
        following.update(patch.sides)
        points.append(patch.points)
        faces.append(patch.faces)
        count += len(patch.points)
    return Crack(np.concatenate(points), np.concatenate(faces), None, tuple(_chains(following)))


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
    used: Ints


def _blocked_points(front: Front, tree: TriangleTree, radius: float) -> Bools:
    """Points of a front ahead of which a disc cannot lie without entering the other crack."""
    centre = front.x + radius * front.frame[:, 0]
    closest = closest_in(tree, centre, radius)
    return np.asarray((closest.triangle >= 0) & (closest.distance < radius * (1 - 1e-9)))


def _runs(front: Front, blocked: Bools) -> list[FacingPart]:
    m = len(blocked)
    if front.closed and blocked.all():
        raise GeometryError(
            f"the front around {at(front.x.mean(axis=0))} faces another crack all the way round: "
            "one of them encloses the other."
        )
    result = []
    for run in runs_of(blocked) if front.closed else _open_runs(blocked):
        first, last = int(run[0]), int(run[-1])
        if front.closed:
            count = len(run) + 2
            result.append(
                FacingPart(tuple(int((first - 1 + k) % m) for k in range(count)), (False, False))
            )
            continue
        ends = first == 0, last == m - 1
        place = range(max(first - 1, 0), min(last + 1, m - 1) + 1)
        result.append(FacingPart(tuple(place), ends))
    return result


def _open_runs(flag: Bools) -> list[Ints]:
    """Runs of true values that do not go round."""
    places = np.nonzero(flag)[0]
    return [run for run in np.split(places, np.nonzero(np.diff(places) > 1)[0] + 1) if len(run)]


def _sides(front: Front) -> list[tuple[int, int]]:
    number = front.number.tolist()
    ahead = number[1:] + number[:1] if front.closed else number[1:]
    return list(zip(number, ahead))


def _facing_number(front: Front, run: FacingPart, others: list[tuple[Front, FacingPart]]) -> int:
    """Number of the piece of the other crack's fronts that faces this one."""
    middle = front.x[list(run.place)].mean(axis=0)
    away = [
        float(np.linalg.norm(other.x[list(piece.place)].mean(axis=0) - middle))
        for other, piece in others
    ]
    return int(np.argmin(away))


def _patch(
    front: Front,
    run: FacingPart,
    other: Front,
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
        a, b = _up_to_end(front, a, 0, radius), _up_to_end(other, b, -1, radius)
    if at_stop:
        a, b = _up_to_end(front, a, -1, radius), _up_to_end(other, b, 0, radius)
    none = np.zeros((0, 3))
    stop = none if at_stop else _arc(front, a[-1], other, b[0], size)
    start = none if at_start else _arc(other, b[-1], front, a[0], size)
    stop_number = count + np.arange(len(stop))
    start_number = count + len(stop) + np.arange(len(start))
    number = np.concatenate([front.number[a], stop_number, other.number[b], start_number])
    x = np.concatenate([front.x[a], stop, other.x[b], start])
    # The front turns round where the pieces end: its way along an arc is against the outline.
    lines = []
    if not at_start:
        lines.append([front.number[a[0]], *start_number[::-1], other.number[b[-1]]])
    if not at_stop:
        lines.append([other.number[b[0]], *stop_number[::-1], front.number[a[-1]]])
    sides = {int(p): int(q) for line in lines for p, q in zip(line, line[1:])}
    used = np.concatenate([front.number[a[:-1]], other.number[b[:-1]]])
    normal = np.concatenate([front.frame[a, 1], other.frame[b, 1]]).mean(axis=0)
    return _Patch(np.concatenate([stop, start]), number[_triangles(x, normal)], sides, used)


def _up_to_end(front: Front, place: list[int], end: int, radius: float) -> list[int]:
    """Places of a piece led on to the first (0) or last (-1) point of its front.

    There both fronts lie outside the body, where one may be longer than the other.
    """
    m = len(front.x)
    remaining = list(range(place[0])) if end == 0 else list(range(place[-1] + 1, m))
    if not remaining:
        return place
    way = np.linalg.norm(front.x[remaining] - front.x[place[end]], axis=1)
    if front.closed or way.max() > _LOOSE * radius:
        raise GeometryError(
            f"a front ends where it faces another crack at {at(front.x[place[end]])}, whose front "
            "goes on: the gap between them cannot be closed."
        )
    return remaining + place if end == 0 else place + remaining


def _arc(one: Front, i: int, other: Front, j: int, size: float) -> Floats:
    """Points between point i of one front and point j of another, tangential to both.

    The cubic of a circle that both fronts touch.
    """
    first, last = one.x[i], other.x[j]
    away, back = -one.frame[i, 2], other.frame[j, 2]
    turn = float(np.arccos(np.clip(-(away @ back), -1.0, 1.0)))
    chord = float(np.linalg.norm(last - first))
    radius = chord / (2 * max(np.sin(turn / 2), 0.1))
    handle = 4 / 3 * np.tan(turn / 4) * radius if turn > 0.1 else chord / 3
    count = max(2, round(max(turn * radius, chord) / size))
    t = (np.arange(1, count) / count)[:, None]
    second, third = first + handle * away, last + handle * back
    return np.asarray(
        (1 - t) ** 3 * first
        + 3 * t * (1 - t) ** 2 * second
        + 3 * t**2 * (1 - t) * third
        + t**3 * last
    )


def _triangles(x: Floats, normal: Floats) -> Ints:
    """Triangles of an outline `(m, 3)` that is nearly plane, run through round the normal."""
    normal = unit(normal)
    first = unit(np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]))
    flat = (x - x.mean(axis=0)) @ np.stack([first, np.cross(normal, first)], axis=1)
    following = np.roll(flat, -1, axis=0)
    if self_crossing(flat) is not None or cross(flat, following).sum() <= 0:
        raise GeometryError(
            f"the gap between two fronts around {at(x.mean(axis=0))} has an outline that crosses "
            "itself: it cannot be closed. Take a smaller da."
        )
    return without_slivers(flat, ear_clipped(flat))


def _chains(following: dict[int, int]) -> list[Ints]:
    """Fronts as point numbers: open ones first from their beginning, closed ones repeat theirs."""
    following_points, result = dict(following), []
    starts = sorted(set(following) - set(following.values()))
    while following_points:
        begin = starts.pop(0) if starts else min(following_points)
        line = [begin]
        while line[-1] in following_points:
            line.append(following_points.pop(line[-1]))
        result.append(np.array(line))
    return sorted(result, key=lambda line: int(line.min()))


__all__ = ["OFFSET", "FrontGap", "gap_between", "merged_crack", "turned_crack"]
