"""Points of a crack front on their way: moved, faired, merged."""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, frozen_copy
from xcrack.crack.fronts import steps, tangents

_FEWEST = 8  # points of a closed front that are not merged for their spacing
_ALIKE = 1e-7  # share by which sides differ whose lengths are one
_PART = 0.1  # of its advance by which fairing may move a point
_NOTCH = np.cos(np.radians(100.0))  # a hollow front that turns by more has a notch


@dataclass(frozen=True, eq=False)
class FrontChain:
    """Points of a new front, and which points of the old one each of them has come from.

    Attributes
    ----------
    x : (g, 3) array, length
        In the direction of the front.
    is_closed : bool
    is_pinned : (g,) array of bool
        Points that stay where they are: those that do not advance, and the ends of open fronts.
    start : (r, 3) array, length
        Points that were sent out, on the old front.
    stop : (r, 3) array, length
        Where these arrived.
    is_at_rest : (r,) array of bool
        Which of these did not advance; they keep their point number.
    owner : (r,) array of int
        The point of the new front that each of them became.
    """

    x: Floats
    is_closed: bool
    is_pinned: Bools
    start: Floats
    stop: Floats
    is_at_rest: Bools
    owner: Ints

    def __post_init__(self) -> None:
        for name in ("x", "is_pinned", "start", "stop", "is_at_rest", "owner"):
            object.__setattr__(self, name, frozen_copy(getattr(self, name)))

    @property
    def side(self) -> Floats:
        """Vectors from each point to the next one."""
        return steps(self.x, self.is_closed)

    @property
    def old_side(self) -> Floats:
        """Where each side comes from: between the middles of what its ends were."""
        first, last_row = self.members()
        return steps((self.start[first] + self.start[last_row]) / 2, self.is_closed)

    def members(self) -> tuple[Ints, Ints]:
        """First and last of those that became each point, `(g,)` both."""
        changes = self.owner != np.roll(self.owner, 1)
        changes[0] |= not self.is_closed
        first = np.nonzero(changes)[0]
        if not len(first):
            first = np.zeros(1, dtype=np.int64)
        last_row = (np.roll(first, -1) - 1) % len(self.owner)
        order = np.argsort(self.owner[first], kind="stable")
        return first[order], last_row[order]

    def fixed_sides(self) -> Bools:
        """Sides that are part of the old front and remain."""
        is_at_rest = np.zeros(len(self.x), dtype=bool)
        is_at_rest[self.owner[self.is_at_rest]] = True
        is_next_at_rest = np.roll(is_at_rest, -1)
        return np.asarray((is_at_rest & is_next_at_rest)[: len(self.side)])


def chain(start: Floats, stop: Floats, is_at_rest: Bools, is_closed: bool) -> FrontChain:
    """All that was sent out, each a point of its own.

    Parameters
    ----------
    start, stop : (r, 3) arrays, length
        Points on the old front in its direction, and where they arrived.
    is_at_rest : (r,) array of bool
        Which did not move.
    is_closed : bool

    Returns
    -------
    FrontChain
    """
    is_pinned = np.array(is_at_rest)
    if not is_closed:
        is_pinned[[0, -1]] = True
    return FrontChain(stop, is_closed, is_pinned, start, stop, is_at_rest, np.arange(len(start)))


def merge_side(front: FrontChain, side: int, x: Floats) -> FrontChain:
    """A front with the ends of one side made one point.

    Parameters
    ----------
    front : FrontChain
    side : int
        Leads from the point with this number to the next one.
    x : (3,) array, length
        Where the point is to lie, unless one of the two is pinned.

    Returns
    -------
    FrontChain
    """
    n = len(front.x)
    point, next_point = side, (side + 1) % n
    if front.is_pinned[point]:
        x = front.x[point]
    elif front.is_pinned[next_point]:
        x = front.x[next_point]
    is_pinned = np.array(front.is_pinned)
    is_pinned[point] |= is_pinned[next_point]
    points = np.array(front.x)
    points[point] = x
    number = np.arange(n)
    number[next_point] = point
    number[number > next_point] -= 1
    is_other = np.arange(n) != next_point
    return replace(
        front, x=points[is_other], is_pinned=is_pinned[is_other], owner=number[front.owner]
    )


def without_loops(front: FrontChain) -> FrontChain:
    """A front whose sides all run on in their old direction; points of others are merged.

    Where a hollow front converges its points overtake each other: the sides between them turn
    round first, and merging these until none is left shrinks the loop to a point.
    """
    while len(front.x) > 2:
        side, old_side = front.side, front.old_side
        forward_share = np.einsum("ij,ij->i", side, old_side) / np.einsum(
            "ij,ij->i", old_side, old_side
        )
        is_pinned_side = front.is_pinned & np.roll(front.is_pinned, -1)
        forward_share[is_pinned_side[: len(side)]] = np.inf
        worst_place = int(np.argmin(forward_share))
        if forward_share[worst_place] > 0:
            break
        front = _join_side_ends(front, worst_place)
    return front


def _join_side_ends(front: FrontChain, side: int) -> FrontChain:
    """Both ends of a side merged half way between the outermost of what they come from."""
    first, last_row = front.members()
    end = (side + 1) % len(front.x)
    return merge_side(front, side, (front.stop[first[side]] + front.stop[last_row[end]]) / 2)


def without_sides(front: FrontChain, sides: Ints) -> FrontChain:
    """A front in which the ends of the sides with these numbers are merged if one is free."""
    for side in sorted(set(sides.tolist()), reverse=True):
        end = (side + 1) % len(front.x)
        if len(front.x) > 3 and not (front.is_pinned[side] and front.is_pinned[end]):
            front = _join_side_ends(front, side)
    return front


def faired_front(front: FrontChain, passes: int) -> FrontChain:
    """A front without zigzag; what is smooth over five of its points hardly moves.

    In each pass each free point goes towards the cubic, over the arc length, that fits it and its
    four neighbours best, perpendicular to the front; in all at most a tenth of its advance. On
    evenly spaced points a zigzag vanishes at once, a wave of n points loses sin(π/n)^4 of its
    height in a pass: a circle of 64 points 6e-6 of its radius.

    Parameters
    ----------
    front : FrontChain
    passes : int

    Returns
    -------
    FrontChain
    """
    n = len(front.x)
    length = np.linalg.norm(front.side, axis=1)
    if n < 5 or length.min() <= 1e-6 * length.max():
        return front
    window = np.arange(n)[:, None] + np.arange(-2, 3)
    if front.is_closed:
        total = length.sum()
        s = np.concatenate([[0.0], np.cumsum(length[:-1])])
        place = s[window % n] + total * (window // n)
        window %= n
    else:
        window += np.maximum(-window[:, :1], 0) - np.maximum(window[:, -1:] - (n - 1), 0)
        place = np.concatenate([[0.0], np.cumsum(length)])[window]
    gap = place[:, :, None] - place[:, None, :] + length.mean() * np.eye(5)
    weight = 1 / (gap / length.mean()).prod(axis=2)
    own_column = np.argmax(window == np.arange(n)[:, None], axis=1)
    # 3/8 at the middle of five even points, which is 36/70 of the whole way to the cubic.
    weight *= (
        0.375 * 70 / 36 * weight[np.arange(n), own_column] / np.einsum("ij,ij->i", weight, weight)
    )[:, None]
    tangent = tangents(front.x, front.is_closed)
    x = np.array(front.x)
    for _ in range(passes):
        move = -np.einsum("ij,ijk->ik", weight, x[window])
        move -= np.einsum("ij,ij->i", move, tangent)[:, None] * tangent
        x[~front.is_pinned] += move[~front.is_pinned]
    advance = np.full(n, np.inf)
    np.minimum.at(advance, front.owner, np.linalg.norm(front.stop - front.start, axis=1))
    move, largest_move = x - front.x, _PART * advance
    size = np.linalg.norm(move, axis=1)
    move *= (np.minimum(largest_move, size) / np.where(size > 0, size, 1.0))[:, None]
    return replace(front, x=np.where(front.is_pinned[:, None], front.x, front.x + move))


def spaced_front(front: FrontChain, least_side: float) -> FrontChain:
    """A front without short sides: of two points that are too close one is left out.

    Parameters
    ----------
    front : FrontChain
    least_side : float, length
        Sides are at least that long, unless both ends are pinned or a closed front has few points.

    Returns
    -------
    FrontChain
    """
    while True:
        n = len(front.x)
        if n <= (_FEWEST if front.is_closed else 2):
            return front
        length = np.linalg.norm(front.side, axis=1)
        is_free = ~(front.is_pinned & np.roll(front.is_pinned, -1))[: len(length)]
        free_length = np.where(is_free, length, np.inf)
        least_length = free_length.min()
        if least_length >= least_side:
            return front
        # Sides of a regular front are alike but for round-off, which is no choice: those at the
        # ends come first, so that a front with a mirror keeps it.
        is_least = free_length <= (1 + _ALIKE) * least_length
        from_middle = 2 * np.arange(len(length)) + 1 - len(length)
        side = int(np.argmax(np.where(is_least, np.abs(from_middle), -1)))
        end = (side + 1) % n
        # The point whose neighbour on the far side is nearer can better be spared.
        length_back, length_ahead = length[side - 1], length[end % len(length)]
        is_even = abs(length_back - length_ahead) <= _ALIKE * length_back
        is_end_spared = from_middle[side] > 0 if is_even else length_back > length_ahead
        point_that_stays = side if is_end_spared else end
        front = merge_side(front, side, front.x[point_that_stays])


def without_notches(front: FrontChain) -> FrontChain:
    """A front without hollow corners of less than 80 degrees; what lies in them is passed over."""
    n = len(front.x)
    side = front.side
    previous_side = np.roll(side, 1, axis=0)
    if not front.is_closed:
        previous_side, side = np.concatenate([side[:1], side]), np.concatenate([side, side[-1:]])
    first, _ = front.members()
    advance = front.stop[first] - front.start[first]
    is_hollow = np.einsum("ij,ij->i", side - previous_side, advance) > 0
    ahead_length, back_length = np.linalg.norm(side, axis=1), np.linalg.norm(previous_side, axis=1)
    turn = np.einsum("ij,ij->i", side, previous_side) / (ahead_length * back_length)
    for i in np.nonzero(is_hollow & (turn < _NOTCH) & ~front.is_pinned)[0][::-1]:
        if len(front.x) > 3:
            target = i if ahead_length[i] < back_length[i] else (i - 1) % n
            goal = (i + 1) % n if target == i else target
            return merge_side(front, int(target), front.x[goal])
    return front


# The strip between an old crack front and its new one: sides divided, triangles stitched.

_BEND = np.cos(np.radians(60.0))  # a polyline that turns by more has a corner


_FLAT = 1e-7  # double area over the square of the longest side of a triangle without area


_LIKE = 0.95  # a diagonal is as good as another if its worst triangle is at most that much worse


_EVEN = 1e-7  # of the cube of its extent: volume between two ways to cut a plane piece


def division_points(x: Floats, is_closed: bool, pieces: Ints, is_straight: Bools) -> list[Floats]:
    """Points inside each side of a polyline, which divide it evenly.

    Parameters
    ----------
    x : (m, 3) array, length
    is_closed : bool
        Whether a last side leads back to the first point.
    pieces : (sides,) array of int
        Into how many parts each side is divided.
    is_straight : (m,) array of bool
        Points whose sides are to be divided as they are.

    Returns
    -------
    list of (pieces - 1, 3) arrays
        On the cubic with the tangents of the circles through three points in a row; on the
        straight side where one of its ends is a corner.
    """
    side = steps(x, is_closed)
    length = np.linalg.norm(side, axis=1)
    tangent = tangents(x, is_closed)
    unit = side / length[:, None]
    result = []
    for j, count in enumerate(pieces):
        t = (np.arange(1, count) / count)[:, None]
        a, b = j, (j + 1) % len(x)
        points = x[a] + t * side[j]
        bends = count > 1 and not (is_straight[a] or is_straight[b])
        if bends and min(tangent[a] @ unit[j], tangent[b] @ unit[j]) > np.sqrt((1 + _BEND) / 2):
            # Written as chord and bulge: a straight side stays straight to the last bit.
            p, q = length[j] * tangent[a] - side[j], length[j] * tangent[b] - side[j]
            points += t * (1 - t) * ((1 - t) * p - t * q)
        result.append(points)
    return result


def stitch_side(
    corners: tuple[int, int], numbers: list[int], x: Floats, normal: Floats
) -> tuple[list[tuple[int, int, int]], float]:
    """Triangles between one side of the old front and the new front ahead of it.

    Parameters
    ----------
    corners : (int, int)
        Point numbers of the old side in the direction of the front.
    numbers : list of int
        Point numbers of the new front ahead of it, in the same direction.
    x : (2 + len(numbers), 3) array, length
        The points of both.
    normal : (3,) array
        Where about the triangles look.

    Returns
    -------
    triangles : list of (int, int, int)
        Without those that have a point twice.
    best_cosine : float
        Smallest cosine between the normal of a triangle and the given one; -1 for one without
        area.
    """
    place = [corners[0], corners[1], *numbers]
    height = (x - x[0]) @ normal
    ways, shapes, cosines, bulges = [], [], [], []
    for turn in range(len(numbers)):
        triangles = [(0, q + 3, q + 2) for q in range(turn)]
        triangles.append((0, 1, turn + 2))
        triangles.extend((1, q + 3, q + 2) for q in range(turn, len(numbers) - 1))
        triangles = [
            (a, b, c)
            for a, b, c in triangles
            if place[a] != place[b] != place[c] and place[a] != place[c]
        ]
        if not triangles:
            return [], 1.0
        shape, cosine, bulge = _measures_of_strip(x, np.array(triangles), normal, height)
        ways.append(triangles)
        shapes.append(shape)
        cosines.append(cosine)
        bulges.append(bulge)
    # Of ways that are as good the one that bulges to lip +: neighbours are cut alike, and so is
    # what is mirrored. Where none bulges all of them are one surface.
    best_shape = max(shapes)
    good_ways = [k for k, shape in enumerate(shapes) if shape >= best_shape * _LIKE]
    if best_shape <= 0:
        good_ways = [int(np.argmax(shapes))]
    limit = max(bulges[k] for k in good_ways) - _EVEN * float(np.ptp(x, axis=0).max()) ** 3
    way = next(k for k in good_ways if bulges[k] >= limit)
    return [(place[a], place[b], place[c]) for a, b, c in ways[way]], cosines[way]


def _measures_of_strip(
    x: Floats, triangles: Ints, normal: Floats, height: Floats
) -> tuple[float, float, float]:
    """Smallest double area along the normal over longest side squared, cosine to it, and volume.

    The volume is that below the triangles, down to height zero.
    """
    a, b, c = (x[triangles[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    longest_side = np.maximum(
        np.maximum(((b - a) ** 2).sum(axis=1), ((c - b) ** 2).sum(axis=1)),
        ((a - c) ** 2).sum(axis=1),
    )
    projected_area, total = area @ normal, np.linalg.norm(area, axis=1)
    cosine = np.where(
        total > _FLAT * longest_side, projected_area / np.where(total > 0, total, 1.0), -1.0
    )
    volume = projected_area @ height[triangles].sum(axis=1) / 6
    return float((projected_area / longest_side).min()), float(cosine.min()), float(volume)


def along_front(s: Floats, values: Floats, place: Floats, is_closed: bool, length: float) -> Floats:
    """Values at other places of a front, by monotone cubics (Fritsch and Butland, 1984).

    Parameters
    ----------
    s : (f,) array, length
        Where the values are known, in any order.
    values : (f,) array
    place : (k,) array, length
        Where they are sought.
    is_closed : bool
        Whether the front is closed; else values beyond the first and last place are theirs.
    length : float, length
        Length of the front, the period of a closed one.

    Returns
    -------
    (k,) array
    """
    from scipy.interpolate import PchipInterpolator

    if is_closed:
        s, place = s % length, place % length
    s, inverse = np.unique(s, return_inverse=True)
    values = np.bincount(inverse, weights=values) / np.bincount(inverse)
    if len(s) == 1:
        return np.full(len(place), values[0])
    if is_closed:
        n = min(3, len(s))
        s = np.concatenate([s[-n:] - length, s, s[:n] + length])
        values = np.concatenate([values[-n:], values, values[:n]])
    return np.asarray(PchipInterpolator(s, values)(np.clip(place, s[0], s[-1])))


__all__ = []
