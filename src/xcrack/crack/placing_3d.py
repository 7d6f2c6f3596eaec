"""Cracks in 3D put into a mesh: what of their outline is front, and mouths led outside."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from xcrack.base.arrays import Bools, Floats, Ints, at, runs_of
from xcrack.base.errors import CoarseMeshError, GeometryError, warn
from xcrack.crack.boundary_trace import (
    OUTSIDE,
    SIDE,
    SMOOTH,
    TraceOutline,
    behind_holes,
    open_fronts,
    under_holes,
)
from xcrack.crack.crack import Crack
from xcrack.crack.junctions import Junction
from xcrack.crack.junctions_3d import (
    are_opposite,
    body_before,
    check_numbers,
    crossings,
    is_before,
    may_touch,
    signed_distance,
)
from xcrack.crack.merging import joined_fronts
from xcrack.mesh.distances import closest_in, first_crossing, signed_in, triangle_tree
from xcrack.mesh.locate import Body, locate
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.polygon import cross, is_within
from xcrack.mesh.triangulation import (
    components,
    face_areas,
    face_normals,
    loops,
    on_rim,
    rim,
    sides,
    split_sides,
    unit,
)

# Corners of plane cracks rounded, and the plane triangulated anew between the new outlines.

_CORNER = np.cos(np.radians(30.0))  # an outline that turns by more has a corner
_PIECE = np.radians(18.0)  # turn between the sides of an arc
_ROOM = 0.45  # share of the way to the next corner that an arc may take


def rounded_surface(
    points: Floats, faces: Ints, corners: Ints, radius: Floats
) -> tuple[Floats, Ints]:
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
    radius_at = dict(zip(corners.tolist(), radius.tolist(), strict=True))
    outlines = [_rounded_loop(points[loop], loop, radius_at) for loop in loops(faces)]
    rim = np.zeros(len(points), dtype=bool)
    rim[np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[on_rim(faces)].ravel()] = True
    outline = np.concatenate(outlines)
    inner_points = points[~rim]
    inner_points = inner_points[_inner_points(inner_points, outline)]
    origin = points[faces[0, 0]]
    return _triangles_within(outlines, inner_points, origin, plane)


def _rounded_loop(x: Floats, loop: Ints, radius_at: dict[int, float]) -> Floats:
    """Points of one loop with arcs in place of some of its corners."""
    m = len(x)
    directions = np.roll(x, -1, axis=0) - x
    length = np.linalg.norm(directions, axis=1)
    directions = directions / length[:, None]
    turn = np.einsum("ij,ij->i", directions, np.roll(directions, 1, axis=0))
    is_sharp = turn < _CORNER
    s = np.concatenate([[0.0], np.cumsum(length)])
    total = s[-1]
    at = s[:-1][is_sharp]
    keep = np.ones(m, dtype=bool)
    pieces: list[tuple[float, Floats]] = []
    for i in np.nonzero(is_sharp)[0]:
        radius = radius_at.get(int(loop[i]))
        if radius is None:
            continue
        gap = np.abs(at - s[i])
        gap = np.minimum(gap, total - gap)
        other_gaps = np.sort(gap)[1:]
        half = np.arccos(np.clip(turn[i], -1, 1)) / 2
        reach = min(radius * np.tan(half), _ROOM * float(np.min(other_gaps, initial=total / 2)))
        arc = _arc(x, s, int(i), reach, half)
        distance = np.abs(s[:-1] - s[i])
        distance = np.minimum(distance, total - distance)
        # What is left of the side that the arc ends on should not be a splinter.
        keep &= (distance > reach + 0.4 * np.minimum(length, radius)) | (
            is_sharp & (distance > reach)
        )
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
    weight_a, weight_x, weight_b = (1 - t) ** 2, 2 * np.cos(half) * t * (1 - t), t**2
    weight = weight_a + weight_x + weight_b
    return np.asarray(
        (weight_a[:, None] * a + weight_x[:, None] * x[i] + weight_b[:, None] * b) / weight[:, None]
    )


def _at(x: Floats, s: Floats, place: float) -> Floats:
    """Point of a closed polyline at an arc length."""
    place = place % s[-1]
    j = min(int(np.searchsorted(s, place, side="right")) - 1, len(x) - 1)
    share = (place - s[j]) / (s[j + 1] - s[j])
    return np.asarray(x[j] + share * (x[(j + 1) % len(x)] - x[j]))


def _inner_points(points: Floats, outline: Floats) -> Bools:
    """Inner points not too close to the outline for well-shaped triangles."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    distance, rows = cKDTree(outline).query(points)
    spacing = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
    return np.asarray(distance > 0.6 * np.maximum(spacing, np.roll(spacing, -1))[rows])


def _triangles_within(
    outlines: list[Floats], inner_points: Floats, origin: Floats, plane: Floats
) -> tuple[Floats, Ints]:
    """Triangles between outlines through the given inner points."""
    for _ in range(30):
        points = np.concatenate([*outlines, inner_points])
        edges = _edges(outlines)
        plane_points = (points - origin) @ plane.T
        if len(inner_points):
            is_inside = is_within(plane_points, plane_points[edges])
            is_inside[: len(points) - len(inner_points)] = True
            inner_points = inner_points[is_inside[len(points) - len(inner_points) :]]
            points, plane_points = points[is_inside], plane_points[is_inside]
        faces = Delaunay(plane_points).simplices.astype(np.int64)
        corner = plane_points[faces]
        area = cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        faces = np.where(area[:, None] < 0, faces[:, ::-1], faces)
        longest_square = np.max(np.sum((corner - np.roll(corner, 1, axis=1)) ** 2, axis=2), axis=1)
        # Three points of a straight side leave triangles that are round-off.
        faces = faces[
            (np.abs(area) > 1e-9 * longest_square)
            & is_within(corner.mean(axis=1), plane_points[edges])
        ]
        rim = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[on_rim(faces)]
        rim_sides = {(int(b), int(a)) for a, b in rim}
        is_missing = np.array([tuple(edge) not in rim_sides for edge in edges.tolist()])
        if not is_missing.any() and len(rim_sides) == len(edges):
            used_points, inverse = np.unique(faces, return_inverse=True)
            return points[used_points], inverse.reshape(-1, 3)
        is_present = np.isin(
            np.sort(edges, axis=1) @ np.array([len(points), 1]),
            (np.sort(rim, axis=1) @ np.array([len(points), 1])),
        )
        outlines = _halved_sides(outlines, ~is_present)
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


def _halved_sides(outlines: list[Floats], flag: Bools) -> list[Floats]:
    """Outlines with a point in the middle of every flagged side."""
    result, begin = [], 0
    for x in outlines:
        cut = np.nonzero(flag[begin : begin + len(x)])[0]
        middle = (x[cut] + x[(cut + 1) % len(x)]) / 2
        result.append(np.insert(x, cut + 1, middle, axis=0))
        begin += len(x)
    return result


_MOUTH = 0.5  # an edge within this share of a cell from the boundary is a mouth
_LOST = 0.4  # of a cell: a shorter rest of a front has left the body
_SEEN = 0.05  # share of a cell inside the boundary from which on an outline ends in the body
_NEAR = 3.0  # cells around the body in which the outline is refined
_BEFORE_FRONT = 0.5  # of a cell: an arm ends no closer to the front of the crack on which it ends
_FLUSH = np.cos(np.radians(5.0))  # between normals of cracks that lie on each other
_TOUCH = 1e-6  # share of a cell within which cracks touch
_OPPOSITE = 0.5  # of a cell: parts of one surface that face each other within it lie in one cell
_ALONG = 0.75  # of a cell: what is joined within it is a fold, from 35 degrees on, or a bend
_OFF = 1e-3  # share of a way at its ends, where it meets the faces around
_PARTED = (
    "give what crosses as cracks of their own, of which one ends on the other, "
    "arm(crack, on=0, side=1), and goes on beyond as another arm, side=-1; leave out what lies "
    "on the rest."
)


@dataclass(frozen=True)
class ShortFront:
    """A piece of outline in the body that is too short for the mesh to be a front.

    Attributes
    ----------
    x : tuple of float, length
        Its middle.
    length : float, length
        Of the part that lies more than half a cell inside; 0 where none of it does.
    cell : float, length
        Size of the largest cell there.
    """

    x: tuple[float, ...]
    length: float
    cell: float

    def __str__(self) -> str:
        if self.length == 0:
            return (
                f"the front at {at(self.x)} lies everywhere within half a cell "
                f"({self.cell / 2:.4g}) of the boundary"
            )
        return (
            f"the front at {at(self.x)}, {self.length:.4g} long without what lies within half a "
            f"cell of the boundary, is shorter than a cell ({self.cell:.4g})"
        )


def surface_placement(crack: Crack, mesh: Mesh) -> tuple[Crack, list[ShortFront]]:
    """Decide which parts of a crack's outline are front in this mesh, and lead mouths outside.

    Parts of the outline inside the body are front; parts outside, or within half a cell of the
    boundary, are mouth. The outline is divided into sides of about a cell; corners of the front
    of a plane crack are rounded with a radius of two cells.

    Parameters
    ----------
    crack : Crack
        In 3D. If its fronts are known already, only these are looked at again, and its points
        stay as they are; two of them that have met become one.
    mesh : Mesh

    Returns
    -------
    crack : Crack
        With `fronts` set. Ends of open fronts lie two cells outside the body, mouths at least
        one cell (less in a gap that is narrower). A warning names a front that is shorter than a
        cell and becomes part of the mouth; of a crack that has grown, where none is left.
    short_fronts : list of ShortFront
        Pieces of the outline that are no fronts, of a crack that is placed for the first time.

    Raises
    ------
    GeometryError
        No part of the crack lies inside the body; or the crack is smaller than a cell, or ends
        less than half a cell inside the boundary that it comes from; it crosses itself, or comes
        back to within half a cell of itself.
    """
    if crack.ends_on and crack.fronts is not None:
        return crack, []
    body = Body.of(mesh)
    placed_crack, short_fronts = _placed_crack(crack, body)
    if crack.fronts is None:
        _check_apart_from_itself(placed_crack, body)
        for front in short_fronts:
            warn(
                f"{front}: it becomes part of the mouth, the crack cuts through there and has no "
                "K. Take at least three cells along it, and across the body around it."
            )
    elif crack.fronts and not placed_crack.fronts:
        for front in short_fronts:
            if front.length > _LOST * front.cell:
                warn(
                    f"{front}: the crack cuts through there, as if it had left the body. Take at "
                    "least three cells across what is left of the body there."
                )
    return placed_crack, short_fronts if crack.fronts is None else []


def _check_apart_from_itself(crack: Crack, body: Body) -> None:
    """Raise where a surface crosses itself, or parts of it face each other within half a cell."""
    x, faces = crack.points, crack.faces
    piece = components(faces)
    pieces = []
    for k in range(piece.max() + 1):
        used_points, inverse = np.unique(faces[piece == k], return_inverse=True)
        pieces.append(Crack(x[used_points], inverse.reshape(-1, 3), None))
    for a, b in combinations(pieces, 2):
        for place in meeting_points(b, a, body)[:1]:
            raise GeometryError(f"pieces of the surface crack meet near {at(place)}: {_PARTED}")
    middle, normal = x[faces].mean(axis=1), face_normals(x, faces)
    reach = (_OPPOSITE * body.cell_size(middle))[:, None] * normal
    pairs, first = np.unique(np.sort(sides(faces).reshape(-1, 2)), axis=0, return_index=True)
    edge = x[pairs[:, 1]] - x[pairs[:, 0]]
    # Edges first: what they cross is no matter of the mesh.
    origin = np.concatenate([x[pairs[:, 0]], middle, middle])
    way = np.concatenate([edge, reach, -reach])
    owner = np.concatenate([first // 3, *[np.arange(len(faces))] * 2])
    start, stop = origin + _OFF * way, origin + (1 - _OFF) * way
    hit, share = first_crossing(triangle_tree(x, faces), start, stop)
    end = start + share[:, None] * (stop - start)
    is_common = faces[owner][:, :, None] == faces[hit][:, None, :]
    rows = np.nonzero((hit >= 0) & ~is_common.any(axis=(1, 2)))[0]
    rows = rows[body.contains(end[rows]) & body.contains(start[rows])]
    for row, size in zip(rows.tolist(), body.cell_size(end[rows]).tolist(), strict=True):
        is_near = (np.linalg.norm(x - end[row], axis=1) <= _ALONG * size)[faces].any(axis=1)
        is_near[[owner[row], hit[row]]] = True
        component = np.full(len(faces), -1)
        component[is_near] = components(faces[is_near])
        if component[owner[row]] == component[hit[row]]:
            continue  # at a fold or a bend
        if row < len(pairs):
            raise GeometryError(f"the surface crack crosses itself near {at(end[row])}: {_PARTED}")
        gap = float(np.linalg.norm(end[row] - origin[row]))
        raise CoarseMeshError(
            f"the surface crack comes back to itself: at {at(end[row])} and {at(origin[row])} it "
            f"is {gap:.4g} apart, less than half a cell ({size / 2:.4g}), and no mesh parts that: "
            "refine the mesh between; or where it is folded, open it to 40 degrees or more, or "
            "leave one part out."
        )


def place_arm(cracks: Sequence[Crack], c: int, mesh: Mesh) -> Crack:
    """Place one of some cracks whose fronts are known, and that may end on others of them.

    The faces of those are to its fronts what the boundary of the body is: fronts go on beyond by
    two cells, and no farther.

    Parameters
    ----------
    cracks : sequence of Crack
    c : int
    mesh : Mesh
    """
    crack = cracks[c]
    placed_crack = _placed_crack(crack, body_before(cracks, c, Body.of(mesh)))[0]
    return replace(placed_crack, ends_on=crack.ends_on)


def arms_placed(
    given_cracks: Sequence[Crack], cracks: tuple[Crack, ...], mesh: Mesh
) -> tuple[Crack, ...]:
    """Placed cracks, the arms among them placed before the cracks on which they end.

    Parameters
    ----------
    given_cracks : sequence of Crack
        Arms whose fronts are known keep them.
    cracks : tuple of Crack
        The same ones, placed in the mesh.
    mesh : Mesh

    Raises
    ------
    GeometryError
        An arm on a crack that is not there, in a circle, or that lies on one side of it.
    CoarseMeshError
        An arm without a front that is as long as a cell.
    """
    if not any(crack.ends_on for crack in given_cracks):
        return cracks
    check_numbers(given_cracks)
    result = [
        replace(arm, ends_on=crack.ends_on) for crack, arm in zip(given_cracks, cracks, strict=True)
    ]
    for c, crack in enumerate(given_cracks):
        if crack.ends_on and crack.fronts is None:
            is_too_small = _check_reach(result, c, Body.of(mesh))
            try:
                placed_crack, short_fronts = _placed_crack(
                    crack, body_before(result, c, Body.of(mesh))
                )
            except CoarseMeshError as error:
                raise CoarseMeshError(is_too_small) from error
            if short_fronts and not placed_crack.fronts:
                raise CoarseMeshError(is_too_small)
            result[c] = replace(placed_crack, ends_on=crack.ends_on)
    return tuple(result)


def surface_junctions(cracks: tuple[Crack, ...], mesh: Mesh) -> tuple[Junction, ...]:
    """Which placed cracks in 3D end on others, and a point where they meet."""
    result = []
    for c, crack in enumerate(cracks):
        for on, side in crack.ends_on:
            line = crossings(crack, cracks[on])
            if not len(line):
                d = np.abs(signed_distance(cracks[on], crack.points))
                line = crack.points[[int(np.argmin(d))]]
            is_inside = Body.of(mesh).contains(line)
            line = line[is_inside] if is_inside.any() else line
            middle = line[int(np.argmin(np.linalg.norm(line - line.mean(axis=0), axis=1)))]
            result.append(Junction(c, -1, on, middle, side, middle, np.inf))
    return tuple(result)


def _check_reach(cracks: Sequence[Crack], c: int, body: Body) -> str:
    """Raise where an arm does not reach a crack on which it ends.

    Else what to say where it hardly comes off it.
    """
    x = cracks[c].points
    x = x[body.contains(x)]
    size = body.cell_size(x)
    deviation = np.full(len(x), np.inf)
    for on, side in cracks[c].ends_on:
        _check_not_flush(cracks, c, on, body)
        depth = side * signed_in(triangle_tree(cracks[on].points, cracks[on].faces), x)[0]
        if not len(x) or (depth < _TOUCH * size).all():
            raise GeometryError(
                f"crack {c} lies wholly beyond crack {on}, on which it is to end from side "
                f"{side:+d}: take side {-side}."
            )
        k = int(np.argmin(depth))
        if depth[k] > _TOUCH * size[k]:
            raise GeometryError(
                f"crack {c} does not reach crack {on}, on which it is to end: it stops "
                f"{depth[k]:.4g} before it, as at {at(x[k])}. Draw it on to that crack or through "
                "it (what lies beyond does not count), or take the other side of it."
            )
        deviation = np.minimum(deviation, depth)
    k = int(np.argmax(deviation))
    names = " and ".join(f"{on} from side {side:+d}" for on, side in cracks[c].ends_on)
    return (
        f"crack {c} ends on crack {names}, but comes only {deviation[k]:.4g} off it, as at "
        f"{at(x[k])}: on that side no front is left as long as a cell ({size[k]:.4g}). Leave this "
        "arm out, or refine the mesh there."
    )


def _check_not_flush(cracks: Sequence[Crack], c: int, on: int, body: Body) -> None:
    """Raise where faces of an arm lie on those of the crack on which it ends."""
    faces = cracks[c].points[cracks[c].faces]
    middle, normals = faces.mean(axis=1), face_normals(cracks[c].points, cracks[c].faces)
    tree = triangle_tree(cracks[on].points, cracks[on].faces)
    nearest_point = closest_in(tree, middle)
    cosine = np.einsum("ij,ij->i", tree.normal[nearest_point.triangle], normals)
    is_flush = nearest_point.distance < _TOUCH * body.cell_size(middle)
    is_flush &= (np.abs(cosine) > _FLUSH) & body.contains(middle)
    if is_flush.any():
        raise GeometryError(
            f"crack {c} lies on crack {on}, on which it is to end, near {at(middle[is_flush][0])}: "
            f"leave out of crack {c} what lies in crack {on}, or give both as one surface."
        )


def place_arms(cracks: Sequence[Crack], mesh: Mesh) -> list[Crack]:
    """Cracks after an advance, those that end on others placed again; see `place_arm`."""
    result = list(cracks)
    for c, crack in enumerate(cracks):
        if crack.ends_on:
            result[c] = place_arm(result, c, mesh)
    return result


def _placed_crack(crack: Crack, body: Body) -> tuple[Crack, list[ShortFront]]:
    _check_inside(crack, body)
    points, faces = np.array(crack.points), np.array(crack.faces)
    first_time = crack.fronts is None
    if first_time:
        points, faces = _refined_faces(points, faces, body)
        points, faces = _with_round_corners(points, faces, body)
        _check_size(points, faces, body)
    owner = {
        (int(a), int(b)): number
        for number, front in enumerate(crack.fronts or ())
        for a, b in zip(front, front[1:], strict=False)
    }
    fronts: list[tuple[int, Ints]] = []
    short_fronts: list[ShortFront] = []
    for loop in loops(faces):
        pairs = zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
        number = np.array([0 if first_time else owner.get(pair, -1) for pair in pairs])
        if (number < 0).all():
            continue
        is_inside, too_short = _front_sides(points[loop], number >= 0, body)
        short_fronts.extend(too_short)
        if first_time and not is_inside.any() and not too_short:
            short_fronts.extend(_front_along_boundary(points[loop], body))
        if not first_time and not crack.ends_on and not is_inside.all():
            outline = TraceOutline(loop, number >= 0, is_inside, first_time)
            is_inside = is_inside | behind_holes(points, faces, outline, body)
            outline = TraceOutline(loop, number >= 0, is_inside, first_time)
            is_inside = is_inside | under_holes(points, faces, outline, body)
        if is_inside.all():
            line = loop
            if crack.fronts is not None:  # begins where it did: places of K follow from that
                line = np.roll(loop, -int(np.argmax(loop == crack.fronts[number[0]][0])))
            fronts.append((int(number[0]), np.append(line, line[0])))
            continue
        outline = TraceOutline(loop, number >= 0, is_inside, first_time)
        points, faces, own_fronts = open_fronts(points, faces, outline, body)
        fronts.extend(
            (int(number[run[0]]), front)
            for run, front in zip(runs_of(is_inside), own_fronts, strict=True)
        )
    fronts.sort(key=lambda pair: pair[0])
    placed_crack = Crack(points, faces, None, tuple(front for _, front in fronts))
    if first_time or crack.ends_on:
        return placed_crack, short_fronts
    joined_crack = joined_fronts(placed_crack, body)
    return (
        _placed_crack(joined_crack, body)
        if joined_crack is not None
        else (placed_crack, short_fronts)
    )


def _check_inside(crack: Crack, body: Body) -> None:
    """Raise where no part of the crack lies inside the body."""
    mesh = body.mesh
    tree, reach = triangle_tree(crack.points, crack.faces), 1.001 * float(mesh.cell_size.max())
    on_boundary = np.zeros((0, 3))
    # A body of one cell across has points on its boundary only.
    for x in (mesh.points, mesh.cell_middles):
        nearest_point = closest_in(tree, x, reach)
        foot = nearest_point.foot[nearest_point.triangle >= 0]
        if len(foot):
            depth, size = body.depth(foot)
            if (depth < -_TOUCH * size).any():
                return
            if (depth < _TOUCH * size).any():
                on_boundary = foot[[int(np.argmin(depth))]]
    # A crack that lies on the boundary does not cut the body.
    if len(on_boundary):
        raise GeometryError(
            f"the crack near {at(on_boundary[0])} lies on the boundary and cuts nothing: move it "
            "inside. If that is the symmetry plane of a half model, model both halves."
        )
    box_min, box_max = mesh.points.min(axis=0), mesh.points.max(axis=0)
    at_low, at_high = crack.points.min(axis=0), crack.points.max(axis=0)
    raise GeometryError(
        f"the crack in [{at_low.tolist()}, {at_high.tolist()}] lies outside the body, which fills "
        f"[{box_min.tolist()}, {box_max.tolist()}]: move it inside."
    )


def _check_size(points: Floats, faces: Ints, body: Body) -> None:
    """Raise where a piece of a crack inside the body is smaller than a cell."""
    piece = components(faces)
    edges, owner = rim(faces)
    length = np.bincount(
        piece[owner], weights=np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    )
    # The diameter of a disc, twice the width of a strip.
    width = 4 * np.bincount(piece, weights=face_areas(points, faces)) / length
    for k in np.nonzero(width < body.mesh.cell_size.max())[0]:
        x = points[edges[piece[owner] == k, 0]]
        depth, size = body.depth(x)
        is_inside = depth < -_MOUTH * size
        cell = float(body.cell_size(x).min())
        if width[k] < cell and is_inside.any():
            raise CoarseMeshError(
                f"the crack at {at(x[is_inside][0])} is {width[k]:.4g} wide, less "
                f"than the cell there ({cell:.4g}): refine the mesh around it (adapt does), or "
                "leave it out."
            )


def _refined_faces(points: Floats, faces: Ints, body: Body) -> tuple[Floats, Ints]:
    """Faces divided until the sides of the outline in and near the body are shorter than a cell."""
    for _ in range(40):
        pairs = sides(faces)
        is_rim = on_rim(faces)
        ends = points[pairs[is_rim]]
        middle = ends.mean(axis=1)
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        size = body.cell_size(middle)
        is_long = length > SIDE * size
        if is_long.any():
            is_long[is_long] = (
                body.depth(middle[is_long])[0] < length[is_long] / 2 + _NEAR * size[is_long]
            )
        if not is_long.any():
            break
        is_rim[is_rim] = is_long
        points, faces = split_sides(points, faces, is_rim)
    return points, faces


def _with_round_corners(points: Floats, faces: Ints, body: Body) -> tuple[Floats, Ints]:
    """Front corners of a plane crack rounded with a radius of two cells."""
    normal = face_normals(points, faces)
    extent = float(np.ptp(points, axis=0).max())
    level = (points - points[0]) @ normal[0]
    if np.abs(normal - normal[0]).max() > 1e-6 or np.abs(level).max() > 1e-8 * extent:
        return points, faces
    corners: list[int] = []
    for loop in loops(faces):
        x = points[loop]
        directions = unit(np.roll(x, -1, axis=0) - x)
        turn = np.einsum("ij,ij->i", directions, np.roll(directions, 1, axis=0))
        depth, size = body.depth((x + np.roll(x, -1, axis=0)) / 2)
        is_inside = depth < -_MOUTH * size
        corners.extend(loop[(turn < SMOOTH) & is_inside & np.roll(is_inside, 1)].tolist())
    if not corners:
        return points, faces
    number = np.array(corners)
    return rounded_surface(points, faces, number, 2 * body.cell_size(points[number]))


def _front_sides(x: Floats, candidate: Bools, body: Body) -> tuple[Bools, list[ShortFront]]:
    """Sides of an outline that are front, and pieces too short for that.

    Where a front comes close to the boundary over less than two cells without leaving the body,
    it runs on; pieces shorter than a cell are no fronts.
    """
    next_point = np.roll(x, -1, axis=0)
    depth, facet = body.depth((x + next_point) / 2)
    size = body.cell_size((x + next_point) / 2)
    length = np.linalg.norm(next_point - x, axis=1)
    is_inside: Bools = (depth < -_MOUTH * facet) & candidate
    short_runs = []
    for value, least_length in ((False, OUTSIDE), (True, 1.0)):
        for run in runs_of(is_inside == value):
            if len(run) == len(is_inside) or length[run].sum() >= least_length * size[run].max():
                continue
            if value:
                place = tuple(((x + next_point) / 2)[run].mean(axis=0).tolist())
                short_runs.append(
                    ShortFront(place, float(length[run].sum()), float(size[run].max()))
                )
                is_inside[run] = False
            elif (candidate[run] & (depth[run] < -_TOUCH * size[run])).all():
                is_inside[run] = True
    return is_inside, short_runs


def _front_along_boundary(x: Floats, body: Body) -> list[ShortFront]:
    """What of an outline ends in the body, but nowhere half a cell from its boundary."""
    middle = (x + np.roll(x, -1, axis=0)) / 2
    depth, facet = body.depth(middle)
    deepest_point = int(np.argmin(depth / facet))
    if depth[deepest_point] > -_SEEN * facet[deepest_point]:
        return []
    size = float(body.cell_size(middle[[deepest_point]])[0])
    return [ShortFront(tuple(middle[deepest_point].tolist()), 0.0, size)]


def check_surfaces(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where 3D cracks cross or touch, or fronts of two come closer than a cell.

    Parameters
    ----------
    cracks : tuple of Crack
        Placed in the mesh.
    mesh : Mesh

    Raises
    ------
    GeometryError
        Two cracks meet inside the body, or their fronts are too close for the mesh.
    """
    if len(cracks) < 2:
        return
    body = Body.of(mesh)
    for j, crack in enumerate(cracks):
        for i in range(j):
            if may_touch(cracks, i, j):
                continue
            meeting = meeting_points(cracks[i], crack, body)
            meeting = meeting[is_before(cracks, i, meeting) & is_before(cracks, j, meeting)]
            if len(meeting):
                normal_a, normal_b = (_normal_at(c, meeting[:1]) for c in (cracks[i], crack))
                if abs(float(normal_a @ normal_b)) > _FLUSH:
                    raise GeometryError(
                        f"cracks {i} and {j} lie on each other near {at(meeting[0])}: give both "
                        "as one surface, or leave out one that lies in the other."
                    )
                raise GeometryError(
                    f"cracks {i} and {j} cross or touch near {at(meeting[0])}: let one of them end "
                    f"on the other, arm(crack, on={i}, side=1), and where it goes on beyond give a "
                    "second arm with side=-1; or end it a few cells before. Give two that share "
                    "an edge as one surface."
                )
    _check_apart(cracks, body)


def _normal_at(crack: Crack, x: Floats) -> Floats:
    """Unit normal of the face that is nearest to a point `(1, 3)`."""
    face = closest_in(triangle_tree(crack.points, crack.faces), x).triangle
    return np.asarray(face_normals(crack.points, crack.faces[face])[0])


def _check_apart(cracks: tuple[Crack, ...], body: Body) -> None:
    """Raise where fronts of two cracks come closer than a cell."""
    parts, owners = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)]
    for i, crack in enumerate(cracks):
        for front in crack.fronts or ():
            part = crack.points[front]
            part = part[is_before(cracks, i, part)]
            parts.append(part)
            owners.append(np.full(len(part), i))
    x, owner = np.concatenate(parts), np.concatenate(owners)
    is_inside = body.contains(x)
    x, owner = x[is_inside], owner[is_inside]
    if len(np.unique(owner)) < 2:
        return
    cell, _ = locate(body.mesh, x)
    size = body.cell_size(x)
    pairs = cKDTree(x).query_pairs(float(size.max()), output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    if any(crack.ends_on for crack in cracks):
        is_apart = [not are_opposite(cracks[a], cracks[b]) for a, b in owner[pairs].tolist()]
        pairs = pairs[np.array(is_apart, dtype=bool)]
    distance = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    is_meeting = np.array([may_touch(cracks, a, b) for a, b in owner[pairs].tolist()], dtype=bool)
    least_distance = size[pairs].min(axis=1) * np.where(is_meeting, _BEFORE_FRONT, 1.0)
    close_pairs = np.nonzero(
        (distance < least_distance) | (cell[pairs[:, 0]] == cell[pairs[:, 1]])
    )[0]
    if len(close_pairs):
        k = close_pairs[np.argmin(distance[close_pairs])]
        i, j = pairs[k]
        if distance[k] <= _TOUCH * size[i]:
            raise GeometryError(
                f"the fronts of cracks {owner[i]} and {owner[j]} share the point {at(x[i])}, where "
                "no mesh can part them: leave a few cells between, or join them to one surface."
            )
        if is_meeting[k]:
            arm, on = owner[[i, j]] if cracks[owner[i]].ends_on else owner[[j, i]]
            raise CoarseMeshError(
                f"crack {arm} comes to within {distance[k]:.4g} of the front of crack {on}, on "
                f"which it ends, at {at(x[i])}, closer than half a cell ({size[i] / 2:.4g}): "
                f"refine the mesh there, let crack {on} reach farther beyond crack {arm}, or end "
                "it a few cells before. Give two that share an edge as one surface."
            )
        raise CoarseMeshError(
            f"the front of crack {owner[i]} at {at(x[i])} and that of crack "
            f"{owner[j]} at {at(x[j])} are {distance[k]:.4g} apart, closer than a "
            f"cell ({size[i]:.4g}): refine the mesh between them, or join the cracks."
        )


def meeting_points(crack_a: Crack, crack_b: Crack, body: Body) -> Floats:
    """Points inside the body where two surfaces cross or touch `(n, 3)`."""
    box_min = np.maximum(crack_a.points.min(axis=0), crack_b.points.min(axis=0))
    box_max = np.minimum(crack_a.points.max(axis=0), crack_b.points.max(axis=0))
    if (box_min > box_max).any():
        return np.zeros((0, 3))
    parts = [crossings(crack_a, crack_b)]
    # Surfaces in one plane cross nothing, but lie on each other.
    for a, b in ((crack_a, crack_b), (crack_b, crack_a)):
        x = np.concatenate([a.points, a.points[a.faces].mean(axis=1)])
        size = body.cell_size(x)
        nearest_point = closest_in(triangle_tree(b.points, b.faces), x, _TOUCH * float(size.max()))
        parts.append(x[(nearest_point.triangle >= 0) & (nearest_point.distance < _TOUCH * size)])
    points = np.concatenate(parts)
    return points[body.contains(points)]


__all__ = ["surface_junctions"]
