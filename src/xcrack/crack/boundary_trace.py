"""Outlines of cracks in 3D against a body: open fronts led outside, mouths moved outside."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, open_runs, runs_of
from xcrack.base.errors import CoarseMeshError
from xcrack.mesh.distances import first_crossing
from xcrack.mesh.locate import ON, Body
from xcrack.mesh.triangulation import face_normals, rim, ruled_strip, unit

SIDE = 0.75  # sides of a front are at most this share of a cell long
OUTSIDE = 2.0  # cells by which an open front leaves the body
SMOOTH = np.cos(np.radians(30.0))  # an outline that turns by more has a corner
_LEAST = 1.25  # cells by which an old front may still be outside, and that an outline is followed
_REACH = 12.0  # cells within which a way out of the body is sought
_INSIDE = (
    4.0,
    2.0,
)  # cells of the body that lie at most on this way, of a new crack and of a grown one
_STEP = 0.125  # of a cell, in this search
_SLOPE = (
    0.35  # by which depth falls at least on a way to the wall of a hole: else it leads along it
)
_SLACK = 0.1  # of a cell, in this
_BEFORE = 0.25  # of a facet: a wall is as far ahead of what comes to it
_STRAIGHT = 0.8  # cosine between both parts of a front, drawn across a hole, and the way across
_AROUND = 32  # directions in which a hole has a wall
_OPEN = 3  # of these may lead out of it: bores and slots that lie in the plane of a crack
_GRAZE = 0.3  # of a facet: a chord behind a hole that cuts off no more of its wall lies in the body
_ALONG = (0.05, 1.0)  # a way on which depth grows by less, over a cell, leads along a wall
_MEET = 0.3  # share of a mouth that its ends may come closer to each other outside


@dataclass(frozen=True, eq=False)
class TraceOutline:
    """One loop of a surface: its points, and of its sides which may be and which are front."""

    loop: Ints
    candidate: Bools
    is_inside: Bools
    first_time: bool


def open_fronts(
    points: Floats, faces: Ints, outline: TraceOutline, body: Body
) -> tuple[Floats, Ints, list[Ints]]:
    """Open fronts of one outline, led out of the body, and its mouths moved outside."""
    loop, m = outline.loop, len(outline.loop)
    x = points[loop]
    depth, _ = body.depth(x)
    size = body.cell_size(x)
    outward_direction, normal = _outward_directions(points, faces, loop)
    runs = runs_of(outline.is_inside)
    is_movable = outline.candidate | np.roll(outline.candidate, 1)
    points_before: dict[int, Ints] = {}
    points_after: dict[int, Ints] = {}
    for mouth in runs_of(~outline.is_inside):
        vertex = np.append(mouth, (mouth[-1] + 1) % m) if runs else mouth
        offset = np.zeros((len(vertex), 3))
        is_inner = np.array(is_movable[vertex])
        if runs:
            room = (len(mouth) - 1) // 2
            is_old = outline.candidate[mouth] & (not outline.first_time)
            deepest_point = int(vertex[np.argmax(depth[vertex])])
            if _passes_hole(x, mouth, deepest_point, outward_direction, normal, is_old, body):
                first, end = _across_hole(depth[vertex], size[vertex])
                points_after[int(vertex[0])] = loop[vertex[1 : first + 1]]
                points_before[int(vertex[-1])] = loop[vertex[end:-1]]
                continue
            ways = (x, depth, size, outward_direction)
            largest_length = _INSIDE[0] if outline.first_time else _INSIDE[1]
            first, offset[0] = _led_out(*ways, vertex, is_old, room, largest_length, body)
            stop, offset[-1] = _led_out(
                *ways, vertex[::-1], is_old[::-1], room, largest_length, body
            )
            end = len(vertex) - 1 - stop
            points_after[int(vertex[0])] = loop[vertex[1 : first + 1]]
            points_before[int(vertex[-1])] = loop[vertex[end:-1]]
            ends = offset[[0, -1]]
            start, vertex = int(vertex[0]), vertex[first : end + 1]
            goal = int(mouth[-1] + 1) % m
            offset, is_inner = offset[: len(vertex)], is_inner[first : end + 1]
            offset[[0, -1]] = ends
            is_inner[[0, -1]] = False
        way = (
            _side_by_side(x[vertex], outward_direction[vertex], offset)
            if runs
            else outward_direction[vertex]
        )
        offset[is_inner] = _push_vectors(
            x[vertex[is_inner]], way[is_inner], depth[vertex[is_inner]], size[vertex[is_inner]],
            body, outline.first_time,
        )  # fmt: skip
        offset = _untangled_rays(x, vertex, offset, normal, not runs)
        offset_length = np.linalg.norm(offset, axis=1)
        if not offset_length.any():
            continue
        layers = int(np.ceil((offset_length / (SIDE * size[vertex])).max()))
        number = len(points) + np.arange(layers)
        new_points, strip = ruled_strip(
            len(points), loop[vertex], x[vertex], offset, layers, not runs
        )
        if runs and offset_length[0] > 0:
            points_after[start] = np.append(points_after[start], number)
        if runs and offset_length[-1] > 0:
            chain = number + (int((offset_length > 0).sum()) - 1) * layers
            points_before[goal] = np.append(chain[::-1], points_before[goal])
        points, faces = np.concatenate([points, new_points]), np.concatenate([faces, strip])
    fronts = [
        np.concatenate(
            [
                points_before[int(run[0])],
                loop[run],
                loop[[(run[-1] + 1) % m]],
                points_after[int(run[-1] + 1) % m],
            ]
        )
        for run in runs
    ]
    return points, faces, fronts


def is_enclosed(x: Floats, normal: Floats, body: Body) -> Bools:
    """Which points outside a body it has around, in planes: in holes, cavities, bores and slots.

    Parameters
    ----------
    x : (n, 3) array, length
    normal : (n, 3) array
        Of the plane through each.
    body : Body

    Returns
    -------
    (n,) array of bool
        False for points in the body, and before walls that leave a wide way out, as a notch does
        that opens by more than some 35 degrees.
    """
    result = ~body.contains(x)
    if result.any():
        corner, angle = body.mesh.points, 2 * np.pi * (np.arange(_AROUND) + 0.3) / _AROUND
        reach = float(np.linalg.norm(corner.max(axis=0) - corner.min(axis=0)))
        axis = np.eye(3)[np.argmin(np.abs(normal[result]), axis=1)]
        u = unit(np.cross(normal[result], axis))
        v = np.cross(normal[result], u)
        way = np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * v[:, None]
        start = np.repeat(x[result], _AROUND, axis=0)
        triangle_hit, _ = first_crossing(body.boundary, start, start + reach * way.reshape(-1, 3))
        n_blocked = (triangle_hit.reshape(-1, _AROUND) >= 0).sum(axis=1)
        result[result] = n_blocked >= _AROUND - _OPEN
    return result


def is_at_hole(x: Floats, direction: Floats, normal: Floats, body: Body) -> bool:
    """Whether a point of an outline lies in a hole, or comes to one on its way straight ahead."""
    depth, size = (float(value[0]) for value in body.depth(x[None]))
    if depth <= ON * size:
        x = x + (_BEFORE * size - depth) * direction
    return bool(is_enclosed(x[None], normal[None], body)[0])


def _passes_hole(
    x: Floats,
    mouth: Ints,
    deepest_point: int,
    outward_direction: Floats,
    normal: Floats,
    is_old: Bools,
    body: Body,
) -> bool:
    """Whether a front goes on across a mouth: it did before, or is drawn straight across a hole."""
    m = len(x)
    if (~is_old).sum() > 1:
        first, end = int(mouth[0]), int(mouth[-1] + 1) % m
        way = unit(x[end] - x[first])
        direction_back, direction_on = (
            unit(x[first] - x[first - 1]),
            unit(x[(end + 1) % m] - x[end]),
        )
        if is_old.any() or min(direction_back @ way, direction_on @ way) < _STRAIGHT:
            return False
    return is_at_hole(
        x[deepest_point], outward_direction[deepest_point], normal[deepest_point], body
    )


def behind_holes(points: Floats, faces: Ints, outline: TraceOutline, body: Body) -> Bools:
    """Sides in the body, of what was front before, that have just come out of a hole `(m,)`."""
    result = np.zeros(len(outline.loop), dtype=bool)
    x = points[outline.loop]
    outward_direction, normal = _outward_directions(points, faces, outline.loop)
    depth, size = body.depth((x + np.roll(x, -1, axis=0)) / 2)
    for run in runs_of(~outline.is_inside):
        if outline.candidate[run].all() and (depth[run] <= _GRAZE * size[run]).all():
            k = run[np.argmax(depth[run])]
            # Behind a hole the way back leads into it, before one into the body.
            distance_back = max(_GRAZE + _BEFORE, _BEFORE - float(depth[k] / size[k])) * size[k]
            place_behind = (x[k] + x[(k + 1) % len(x)]) / 2 - distance_back * outward_direction[k]
            result[run] = is_enclosed(place_behind[None], normal[k : k + 1], body)[0]
    return result


def under_holes(points: Floats, faces: Ints, outline: TraceOutline, body: Body) -> Bools:
    """Sides of what was front that pass the bottom of a hole within half a cell `(m,)`.

    The boundary is beside them, not ahead: a cell farther on they still are in the body.
    """
    result = np.zeros(len(outline.loop), dtype=bool)
    x = points[outline.loop]
    middle = (x + np.roll(x, -1, axis=0)) / 2
    for run in runs_of(~outline.is_inside):
        if len(run) < len(x) and outline.candidate[run].all():
            outward_direction = _outward_directions(points, faces, outline.loop)[0][run]
            place_ahead = middle[run] + body.cell_size(middle[run])[:, None] * outward_direction
            depth = body.depth(np.concatenate([middle[run], place_ahead]))[0]
            result[run] = (depth < 0).all()
    return result


def _across_hole(depth: Floats, size: Floats) -> tuple[int, int]:
    """How far the fronts on both sides of a hole go on into it along their outline.

    To one side in its middle, or until they are far enough outside.
    """
    far_points = np.nonzero(depth >= 0.999 * OUTSIDE * size)[0]
    if len(far_points) > 1:
        return int(far_points[0]), int(far_points[-1])
    first = int(np.argmax(depth[:-1] + depth[1:]))
    return first, first + 1


def _outward_directions(points: Floats, faces: Ints, loop: Ints) -> tuple[Floats, Floats]:
    """Directions out of the surface at the points of a loop, and the normals at its sides."""
    edges, owner = rim(faces)
    n = len(points)
    key = edges[:, 1] * n + edges[:, 0]
    order = np.argsort(key)
    side = np.searchsorted(key[order], loop * n + np.roll(loop, -1))
    normal = face_normals(points, faces[owner[order[side]]])
    next_side = np.roll(points[loop], -1, axis=0) - points[loop]
    direction = unit(np.cross(normal, next_side))
    return unit(direction + np.roll(direction, 1, axis=0)), normal


def _side_by_side(x: Floats, outward_direction: Floats, offset: Floats) -> Floats:
    """Ways out along a mouth that turn towards the rays at its ends, so that none are crossed."""
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(length)])
    slack, direction = np.ones(len(x)), np.zeros_like(x)
    for end, distance in ((0, s), (-1, s[-1] - s)):
        offset_length = float(np.linalg.norm(offset[end]))
        if offset_length > 0:
            weight = np.maximum(1 - distance / (2 * offset_length), 0)
            direction += weight[:, None] * offset[end] / offset_length
            slack -= weight
    return unit(direction + np.maximum(slack, 0)[:, None] * outward_direction)


def _untangled_rays(
    x: Floats, vertex: Ints, offset: Floats, normal: Floats, is_closed: bool
) -> Floats:
    """Rays of a mouth made even where neighbours cross, those at its ends as they are."""
    offset = np.array(offset)
    for _ in range(40):
        a, o = x[vertex], offset
        if is_closed:
            a, o = np.append(a, a[:1], axis=0), np.append(o, o[:1], axis=0)
        inner_sides, outer_sides = np.diff(a, axis=0), np.diff(a + o, axis=0)
        n = normal[vertex[: len(inner_sides)]]
        is_turned = np.zeros(len(inner_sides), dtype=bool)
        for u, v in ((inner_sides, inner_sides + o[1:]), (inner_sides + o[1:], o[:-1])):
            area = np.einsum("ij,ij->i", np.cross(u, v), n)
            is_turned |= area < -1e-12 * np.einsum("ij,ij->i", outer_sides, outer_sides)
        if not is_turned.any():
            break
        is_moved = (
            is_turned | np.roll(is_turned, 1) if is_closed else np.zeros(len(vertex), dtype=bool)
        )
        if not is_closed:
            is_moved[1:-1] = is_turned[1:] | is_turned[:-1]
        mean_offset = (np.roll(offset, 1, axis=0) + 2 * offset + np.roll(offset, -1, axis=0)) / 4
        offset[is_moved] = mean_offset[is_moved]
    return offset


def _led_out(
    x: Floats,
    depth: Floats,
    size: Floats,
    outward_direction: Floats,
    vertex: Ints,
    is_old: Bools,
    room: int,
    largest_length: float,
    body: Body,
) -> tuple[int, Floats]:
    """How a front goes on from its last point `vertex[0]` until it is two cells outside.

    It follows the outline while this is smooth, and always where it was front before (`is_old`), or
    where no way leads out with less than `largest_length` cells of the body on it.
    Returns the number of points along the outline that it takes over, and a vector by which it
    goes on straight from there (zero where the outline itself leads far enough).
    """
    m = len(x)
    step = int((vertex[1] - vertex[0] + 1) % m) - 1
    tangent_in = unit(x[vertex[0]] - x[(vertex[0] - step) % m])
    tangent, leaves, corner, has_followed = tangent_in, -1, False, False
    for k in range(room + 1):
        at = vertex[k]
        if leaves < 0 and depth[at] >= -ON * size[at]:
            leaves, tangent = k, tangent_in
        least_depth = _LEAST if k > 0 and is_old[k - 1] and not is_old[k] else 0.999 * OUTSIDE
        if depth[at] >= least_depth * size[at]:
            return k, np.zeros(3)
        if not has_followed and depth[at] >= _LEAST * size[at]:
            leaves, tangent, has_followed = k, tangent_in, True
        tangent_out = unit(x[vertex[k + 1]] - x[at])
        # Round a hollow corner the outline leads on; straight on lies the surface itself.
        corner = (
            bool(tangent_out @ tangent_in < SMOOTH and tangent_out @ outward_direction[at] < 0)
            and not is_old[k]
        )
        turns_round = depth[at] > 0 and depth[vertex[k + 1]] < depth[at] and not is_old[k]
        if corner or turns_round or k == room:
            # From a corner the front goes on straight; an outline that turns round is left
            # where it is out of reach, or else where it comes out of the body.
            if corner or leaves < 0:
                leaves, tangent = k, tangent_in
            break
        tangent_in = tangent_out
    at = vertex[leaves]
    way = outward_direction[at]
    gap = x[vertex[-1 - leaves]] - x[at]
    width = float(np.linalg.norm(gap))
    # Beside an outline that turns round its own tangent leaves no room for the mouth.
    ways = [unit(tangent + way), way]
    ways.insert(0 if corner else 2, tangent)
    for direction in ways:
        offset = _straight_out(x[at], direction, float(size[at]), largest_length, body)
        share = float(offset @ gap) / width
        if share > _MEET * width:
            # The front at the other end of this mouth would be met outside the body.
            direction_off_gap = direction - (direction @ gap) * gap / width**2
            offset = _straight_out(
                x[at], unit(direction_off_gap + 1e-3 * way), float(size[at]), largest_length, body
            )
        if offset.any():
            return leaves, offset
    deepest_row = int(np.argmax(depth[vertex[: room + 1]]))
    return deepest_row if depth[vertex[deepest_row]] > 0 else leaves, np.zeros(3)


def _straight_out(
    x: Floats, direction: Floats, size: float, largest_length: float, body: Body
) -> Floats:
    """Vector by which the end of a front goes on, no shorter than a side; zero: no way out."""
    length = _way_out(x[None], direction[None], np.array([size]), OUTSIDE, largest_length, body)[0]
    return np.asarray(direction * (max(length, SIDE * size) if length > 0 else 0.0))


def _way_out(
    x: Floats,
    direction: Floats,
    size: Floats,
    target_depth: float,
    largest_length: float,
    body: Body,
) -> Floats:
    """Lengths by which points move until they are some cells outside; zero: no way out.

    Where the body begins again before, this is half way across the gap; where another wall comes
    nearer, where both are as far; where a way leads on between walls that are no farther than that,
    where it begins to.

    Parameters
    ----------
    x, direction : (k, 3) arrays
    size : (k,) array, length
        Of the cells.
    target_depth : float
        Cells that the points shall lie outside.
    largest_length : float
        Cells of the body on the way.
    body : Body

    Returns
    -------
    (k,) array, length
    """
    steps = _STEP * np.arange(int(_REACH / _STEP) + 1)
    trial = x[:, None] + (steps * size[:, None])[..., None] * direction[:, None]
    depth, _ = body.depth(trial.reshape(-1, 3))
    result = np.zeros(len(x))
    for k, row in enumerate(depth.reshape(len(x), -1) / size[:, None]):
        is_outside = row > ON
        first = int(np.argmax(is_outside))
        if (
            not is_outside[first]
            or steps[first] > largest_length
            or (first == 0 and row[1] < row[0])
        ):
            continue
        rows_inside = np.nonzero(~is_outside[first:])[0]
        stop = first + int(rows_inside[0]) if len(rows_inside) else len(steps)
        deep_enough = np.nonzero(row[first:stop] >= target_depth)[0]
        end = first + int(deep_enough[0]) if len(deep_enough) else stop - 1
        way_along = _way_along_wall(row[first : end + 1])
        between_walls = _end_between_walls(row[first : end + 1], target_depth)
        if way_along is not None:
            result[k] = steps[first + way_along]
        elif between_walls is not None and stop == len(steps):
            result[k] = steps[first + between_walls]
        elif len(deep_enough) and first + deep_enough[0] > 0:
            j = first + int(deep_enough[0])
            result[k] = steps[j] - _STEP * (row[j] - target_depth) / (row[j] - row[j - 1])
        elif len(rows_inside):
            result[k] = (steps[first] + steps[stop]) / 2
        else:
            result[k] = steps[first] + target_depth
    return result * size


def _way_along_wall(depth: Floats) -> int | None:
    """From which sample on a way that has left the body leads along a wall; None: nowhere."""
    slope, count = _ALONG[0] * _STEP, int(_ALONG[1] / _STEP)
    is_flat = np.abs(np.diff(depth)) < slope
    for run in open_runs(is_flat):
        if len(run) >= count and depth[run[0]] > ON:
            return int(run[0])
    return None


def _end_between_walls(depth: Floats, target_depth: float) -> int | None:
    """Sample at which a way outside ends that another wall comes nearer to; None: none does.

    Where both walls are as far, but not before the way is as long as it should be deep: fields
    around a front are measured from it, also in the body beside its end.
    """
    falls = np.nonzero(np.maximum.accumulate(depth) - depth > _SLACK)[0]
    if not len(falls):
        return None
    top = int(np.argmax(depth[: falls[0]]))
    near_wall = np.nonzero(depth[top:] < depth[top] / 2)[0]
    last_step = top + int(near_wall[0]) if len(near_wall) else len(depth) - 1
    return max(top, min(int(target_depth / _STEP), last_step))


def way_to_middle(x: Floats, direction: Floats, size: float, body: Body) -> float:
    """Length by which a point moves into a hole until it is two cells outside; zero: no way out.

    A way goes straight to the boundary, never along it through the body, and outside no farther
    than to where another wall is as near: a hole is divided among what comes from its walls, and
    ways that start across them do not meet (they end at the medial axis; Blum, 1967).

    Parameters
    ----------
    x, direction : (3,) arrays
    size : float, length
        Of the cells.
    body : Body

    Returns
    -------
    float, length
    """
    steps = _STEP * np.arange(int(_REACH / _STEP) + 1)
    row = body.depth(x + (steps * size)[:, None] * direction)[0] / size
    is_outside = row > ON
    first = int(np.argmax(is_outside))
    if not is_outside[first] or (row[:first] < row[0] + _SLOPE * steps[:first] - _SLACK).any():
        return 0.0
    falls = np.nonzero(row[first + 1 :] < row[first:-1] - 1e-9)[0]
    end = first + int(falls[0]) if len(falls) else len(steps) - 1
    deep_enough = np.nonzero(row[first : end + 1] >= OUTSIDE)[0]
    if not len(deep_enough):
        return float(steps[first + int(np.argmax(row[first : end + 1]))] * size)
    j = first + int(deep_enough[0])
    if j == 0:
        return 0.0
    return float((steps[j] - _STEP * (row[j] - OUTSIDE) / (row[j] - row[j - 1])) * size)


def _push_vectors(
    x: Floats, outward_direction: Floats, depth: Floats, size: Floats, body: Body, first_time: bool
) -> Floats:
    """Vectors that lead points of a mouth one cell out of the body, zero where they are there."""
    offset = np.zeros_like(x)
    is_inside = depth < 0.999 * size
    if is_inside.any():
        if first_time:
            _check_nick(
                x[is_inside], outward_direction[is_inside], depth[is_inside], size[is_inside], body
            )
        length = _way_out(
            x[is_inside], outward_direction[is_inside], size[is_inside], 1.0, _INSIDE[0], body
        )
        offset[is_inside] = length[:, None] * outward_direction[is_inside]
    return offset


def _check_nick(x: Floats, way: Floats, depth: Floats, size: Floats, body: Body) -> None:
    """Raise where a crack has just come in through the boundary that its outline is close to."""
    inner_rows = np.nonzero(depth < 0)[0]
    if not len(inner_rows):
        return
    depth_ahead, _ = body.depth(x[inner_rows] + 0.25 * size[inner_rows, None] * way[inner_rows])
    nicks = inner_rows[depth_ahead < depth[inner_rows] - 0.01 * size[inner_rows]]
    if len(nicks):
        raise CoarseMeshError(
            f"the crack ends at {np.round(x[nicks[0]], 6).tolist()}, {-depth[nicks[0]]:.4g} inside "
            f"the boundary that it comes from, which is less than half a cell "
            f"({size[nicks[0]]:.4g}): refine the mesh there, or leave this part of the crack out."
        )
