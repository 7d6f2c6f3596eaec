"""Cracks in 2D put into a mesh: which ends are tips, and mouths led outside."""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, at, coordinates, lock
from xcrack.base.checks import copy_without_checks
from xcrack.base.errors import CoarseMeshError, GeometryError, warn
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.junctions import Junction, junctions
from xcrack.crack.lines import crossing_points, touching_points
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.locate import (
    barycentric,
    cell_sizes,
    cells_around,
    cells_at,
    contains,
    locate,
    nearest_boundary,
    parts_inside,
)
from xcrack.mesh.mesh import Mesh

ON_MESH = 1e-10  # share of a cell within which a tip lies on a mesh point or on an edge
# Share of a cell within which a tip or kink is moved there. A tip on a mesh point and one beside it
# have other functions, and K differs by the error of the mesh: nothing of the size of round-off, or
# of what is lost where coordinates are written with nine digits, may decide which it is.
_BESIDE_MESH = 1e-7
MOUTH = 0.5  # an end within this share of a cell from the boundary is a mouth
_MEANT = 0.1  # share of a cell inside the boundary up to which nobody means a tip
_WAY = 3.0  # cells to the boundary, along the crack, from an end that is close to it
_ROUND = 1.1  # a way outside the body that is this much longer than its chord goes out and back
_OWN = 2.0  # cells along a crack within which it is close to its own tip
_TOWARDS = 0.17  # cosine of the widest angle at which a tip points to another crack
_TOUCH = 1e-6  # share of a cell within which cracks touch


def place_line(crack: Crack, mesh: Mesh) -> Crack:
    """Decide which ends of a crack are tips in this mesh, and prolong its mouths outwards.

    Parameters
    ----------
    crack : Crack
        If its tips are known already, only these are looked at again.
    mesh : Mesh

    Returns
    -------
    Crack
        With `tips` set; a mouth lies at least one cell outside the body.

    Raises
    ------
    GeometryError
        No part of the crack lies inside the body; or the crack is shorter than a cell, runs along
        the boundary, leaves the body by a kink for less than a cell, or ends less than half a
        cell inside the boundary that it comes from.
    """
    last_point = len(crack.points) - 1
    first_time = crack.tips is None
    candidates = (0, last_point) if crack.tips is None else crack.tips
    points = np.array(crack.points)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if first_time:
        _check_inside(points, mesh)
    is_inside = contains(mesh, points[[0, last_point]])
    tips = []
    for end, is_end_inside in zip((0, last_point), is_inside.tolist()):
        inner_point = 1 if end == 0 else last_point - 1
        direction = (points[end] - points[inner_point]) / np.linalg.norm(
            points[end] - points[inner_point]
        )
        gap, size = nearest_boundary(mesh, points[end])
        if end in candidates and is_end_inside and gap > MOUTH * size:
            tips.append(end)
            continue
        if end not in candidates:
            continue
        if is_end_inside:
            _check_nick(mesh, points[end], direction, gap, size)
        distance_out = -gap if is_end_inside else gap
        if distance_out < size:
            way, new_end = _prolonged_end(mesh, points[end], direction, size)
            if first_time and is_end_inside:
                _check_mouth(points[end], gap, size, way)
            points[end] = new_end
    placed_crack = Crack(points, crack.faces, tuple(tips))
    if tips:
        h = cell_sizes(mesh, points[tips])
        if length.sum() < h.min():
            raise CoarseMeshError(
                f"the crack at {points[tips[0]].tolist()} has length {length.sum():.4g}, less than "
                f"the cell there ({h.min():.4g}): refine the mesh around it (adapt does), or leave "
                "it out."
            )
    return placed_crack


def _check_inside(points: Floats, mesh: Mesh) -> None:
    """Raise where no part of a crack lies in the body; warn where it leaves it by a kink."""
    parts = parts_inside(mesh, points)
    first = [piece[0, 0] if len(piece) else np.inf for piece in parts]
    stop = [piece[-1, 1] if len(piece) else -np.inf for piece in parts]
    rows = [i for i, piece in enumerate(parts) if len(piece)]
    if not rows:
        box_min, box_max = mesh.points.min(axis=0), mesh.points.max(axis=0)
        raise GeometryError(
            f"the crack from {points[0].tolist()} to {points[-1].tolist()} lies outside the body, "
            f"which fills [{box_min.tolist()}, {box_max.tolist()}]: move it inside."
        )
    for i, j in zip(rows, rows[1:]):
        if stop[i] == 1 and first[j] == 0 and j == i + 1:
            continue  # the vertex between lies in the body
        kinks = points[i + 1 : j + 1]
        ends = [
            points[k] + t * (points[k + 1] - points[k]) for k, t in ((i, stop[i]), (j, first[j]))
        ]
        way = np.linalg.norm(np.diff([ends[0], *kinks, ends[1]], axis=0), axis=1).sum()
        chord = float(np.linalg.norm(ends[1] - ends[0]))
        if way < _ROUND * chord:
            continue  # across a hole or a notch
        _, size = nearest_boundary(mesh, ends[0])
        if chord < size:
            raise CoarseMeshError(
                f"the crack leaves the body by its kink at {at(kinks[0])} and comes back only "
                f"{chord:.4g} beside, less than a cell ({size:.4g}): refine the mesh there, or "
                "move the kink inside."
            )
        warn(
            f"the crack leaves the body by its kink at {at(kinks[0])}, from {at(ends[0])} to "
            f"{at(ends[1])}: in the body these are two cracks with mouths there. If that is not "
            "meant, move the kink inside."
        )


def _check_mouth(end: Floats, gap: float, size: float, way: float) -> None:
    """Raise or warn where an end inside the body is taken for a mouth, but may not be meant so."""
    if way > _WAY * size:
        raise CoarseMeshError(
            f"the crack runs along the boundary: it ends at {at(end)}, {gap:.4g} from it and less "
            f"than half a cell ({size:.4g}), but would leave the body only after {way:.4g}. Move "
            "it inside or refine the mesh there. A crack on the symmetry plane of a half model "
            "cuts nothing: model both halves."
        )
    if gap > _MEANT * size:
        warn(
            f"the crack ends at {at(end)}, {gap:.4g} inside the boundary and less than half a cell "
            f"({size:.4g}): this end is taken as a mouth, at which the body is cut through. If it "
            "is to be a tip, refine the mesh there; else end the crack at the boundary."
        )


def _check_nick(mesh: Mesh, end: Floats, direction: Floats, gap: float, size: float) -> None:
    """Raise where a crack has just come in through the boundary that its end is close to."""
    place_ahead = end + 0.25 * size * direction
    if (
        contains(mesh, place_ahead[None])[0]
        and nearest_boundary(mesh, place_ahead)[0] > gap + 0.01 * size
    ):
        raise CoarseMeshError(
            f"the crack ends at {at(end)}, {gap:.4g} inside the boundary that it "
            f"comes from, which is less than half a cell ({size:.4g}): refine the mesh there, or "
            "leave this part of the crack out."
        )


def _prolonged_end(mesh: Mesh, end: Floats, direction: Floats, size: float) -> tuple[float, Floats]:
    """How far an end is from leaving the body, and the end moved one cell outside.

    Half way across a narrower gap in the body.
    """
    step = size / 8
    steps = step * np.arange(97)
    is_inside = contains(mesh, end + steps[:, None] * direction)
    first_out = int(np.argmin(is_inside)) if not is_inside.all() else len(steps) - 1
    rows_inside = np.nonzero(is_inside[first_out:])[0]
    gap = float(rows_inside[0]) * step if len(rows_inside) else np.inf
    way = float(steps[first_out])
    return way, np.asarray(end + direction * (way + min(size, gap / 2)))


def vertices_on_mesh(crack: Crack, mesh: Mesh) -> Crack:
    """A placed crack whose tips and kinks lie on mesh points and edges, or well beside them.

    What is cut between a tip and a mesh point closer than round-off allows has no area, and points
    of integration on the tip itself.
    """
    points = np.array(crack.points)
    cell, bary = locate(mesh, points)
    is_close = (cell >= 0) & (np.abs(bary) <= 2 * _BESIDE_MESH).any(axis=1)
    is_close[list(crack.tips or ())] = True
    end_numbers = {0, len(points) - 1} - set(crack.tips or ())  # mouths, and ends on other cracks
    for number in set(np.nonzero(is_close)[0].tolist()) - end_numbers:
        points[number] = _on_mesh(points[number], mesh)
    return copy_without_checks(crack, points=lock(points))


def _on_mesh(x: Floats, mesh: Mesh) -> Floats:
    """A point, or the mesh point or the point of an edge that it lies on but for 1e-7 of a cell."""
    cells = cells_around(mesh, x, _BESIDE_MESH)
    bary = barycentric(mesh, cells, np.broadcast_to(x, (len(cells), 2)))
    count = (np.abs(bary) > _BESIDE_MESH).sum(axis=1)
    if count.min(initial=3) == 3:
        return x
    row = int(np.argmin(count))
    share = np.where(np.abs(bary[row]) > _BESIDE_MESH, bary[row], 0.0)
    corners = mesh.points[mesh.cells[cells[row]]]
    first = corners[np.argmax(share)]  # the mesh point itself where it is alone
    return np.asarray(first + share / share.sum() @ (corners - first))


def check_lines(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where cracks cross or touch, or a tip is closer than a cell to what it must not meet.

    An end of a crack on another one is neither.

    Parameters
    ----------
    cracks : tuple of Crack
        Placed in the mesh.
    mesh : Mesh

    Raises
    ------
    GeometryError
        Two cracks cross or lie on each other, two tips are closer than a cell, or a tip is closer
        than half a cell to another part of its own crack.
    """
    meeting = junctions(cracks, mesh)
    for i, crack in enumerate(cracks):
        for j in range(i):
            crossing = crossing_points(cracks[j].points, crack.points)
            crossing = _points_off_junctions(crossing, i, j, meeting, mesh)
            if len(crossing):
                x = coordinates(crossing[0])
                raise GeometryError(
                    f"cracks {j} and {i} cross near {at(crossing[0])}: give crack {i} as two "
                    f"cracks that both end there on crack {j}, line_crack([..., {x}]) and "
                    f"line_crack([{x}, ...]); or end it a few cells before."
                )
    _check_tips(cracks, mesh)
    for i, crack in enumerate(cracks):
        _check_own(i, crack, mesh)
        for j in range(i):
            _check_touch((j, cracks[j]), (i, crack), meeting, mesh)
    for i in range(len(cracks)):
        _check_flanks(i, cracks, mesh)


def _points_off_junctions(
    x: Floats, i: int, j: int, meeting: tuple[Junction, ...], mesh: Mesh
) -> Floats:
    """Those of the points in the body at which cracks i and j meet that are no junctions."""
    if not len(x):
        return x
    x = x[contains(mesh, x)]
    for meeting_point in meeting:
        if i in (meeting_point.crack, meeting_point.on) or j in (
            meeting_point.crack,
            meeting_point.on,
        ):
            x = x[
                np.linalg.norm(x - meeting_point.x, axis=1)
                > _MEANT * cell_sizes(mesh, meeting_point.x[None])[0]
            ]
    return x


def _check_flanks(number: int, cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where a tip that points to another crack ends less than half a cell before it."""
    if len(cracks) < 2:
        return
    x, frame = tip_frames(cracks[number])
    for end, size, direction in zip(x, cell_sizes(mesh, x), frame[:, 0]):
        for k, crack in enumerate(cracks):
            if k == number:
                continue
            foot = closest_on_segment(end, crack.points[:-1], crack.points[1:])
            distance = np.linalg.norm(foot - end, axis=1)
            row = int(np.argmin(distance))
            if (foot[row] - end) @ direction < _TOWARDS * distance[row]:
                continue
            if distance[row] < MOUTH * size and contains(mesh, foot[[row]])[0]:
                raise CoarseMeshError(
                    f"a tip of crack {number} at {at(end)} is {distance[row]:.4g} from crack "
                    f"{k}, less than half a cell ({size:.4g}), but does not end on it: to let "
                    f"it end there give a point of crack {k}, such as {at(foot[row])}, as "
                    "its end; else leave a few cells between, or refine the mesh there."
                )


def _check_tips(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where two tips lie in one cell or closer than one."""
    tips = [tip_frames(crack)[0] for crack in cracks]
    x = np.concatenate([np.zeros((0, 2)), *tips])
    owner = np.repeat(np.arange(len(cracks)), [len(tips_of_crack) for tips_of_crack in tips])
    if len(x) < 2:
        return
    cell = cells_at(mesh, x)
    size = mesh.cell_size[cell]
    for i, j in sorted(cKDTree(x).query_pairs(float(size.max()))):
        distance = float(np.linalg.norm(x[i] - x[j]))
        if distance < min(size[i], size[j]) or cell[i] == cell[j]:
            if owner[i] == owner[j]:
                raise CoarseMeshError(
                    f"the tips of crack {owner[i]} at {at(x[i])} and {at(x[j])} are {distance:.4g} "
                    f"apart, closer than a cell ({size[i]:.4g}): a crack that closes cuts a piece "
                    "out of the body. Refine the mesh between them, or leave a gap of a few cells."
                )
            if distance <= _TOUCH * size[i]:
                raise GeometryError(
                    f"cracks {owner[i]} and {owner[j]} both end at {at(x[i])}, where no mesh can "
                    "part them: give a crack that stands there twice only once, or join the cracks "
                    "to one that runs through that point."
                )
            raise CoarseMeshError(
                f"a tip of crack {owner[i]} at {at(x[i])} and one of crack {owner[j]} at "
                f"{at(x[j])} are {distance:.4g} apart, closer than a "
                f"cell ({size[i]:.4g}): refine the mesh between them, or join the cracks."
            )


def _check_own(number: int, crack: Crack, mesh: Mesh) -> None:
    """Raise where a tip comes closer than half a cell to another part of its own crack."""
    x, _ = tip_frames(crack)
    for tip, end, size in zip(crack.tips or (), x, cell_sizes(mesh, x)):
        line = crack.points if tip == 0 else crack.points[::-1]
        length = np.linalg.norm(np.diff(line, axis=0), axis=1)
        arc = np.concatenate([[0.0], np.cumsum(length)])  # along the crack, from the tip
        if arc[-1] <= _OWN * size:
            continue
        # The piece on which that distance is reached counts from there.
        first = int(np.searchsorted(arc, _OWN * size, side="right")) - 1
        begin = line[first] + (_OWN * size - arc[first]) / length[first] * (
            line[first + 1] - line[first]
        )
        remaining_line = np.concatenate([begin[None], line[first + 1 :]])
        foot = closest_on_segment(end, remaining_line[:-1], remaining_line[1:])
        distance = np.linalg.norm(foot - end, axis=1)
        row = int(np.argmin(distance))
        if distance[row] < MOUTH * size:
            raise CoarseMeshError(
                f"a tip of crack {number} at {at(end)} is {distance[row]:.4g} from another "
                f"part of the same crack at {at(foot[row])}, less than half a cell "
                f"({size:.4g}): what lies between is all but cut out. End growth before, or refine "
                f"the mesh there."
            )


def _check_touch(
    pair_a: tuple[int, Crack],
    pair_b: tuple[int, Crack],
    meeting: tuple[Junction, ...],
    mesh: Mesh,
) -> None:
    """Raise where two cracks lie on each other in the body: they cross nowhere."""
    (i, a), (j, b) = pair_a, pair_b
    reach = _TOUCH * float(mesh.cell_size.max())
    box_min = np.maximum(a.points.min(axis=0), b.points.min(axis=0)) - reach
    box_max = np.minimum(a.points.max(axis=0), b.points.max(axis=0)) + reach
    if (box_min > box_max).any():
        return
    touching_places = touching_points(a.points, b.points, reach)
    touching_places = _points_off_junctions(touching_places, i, j, meeting, mesh)
    if len(touching_places):
        raise GeometryError(
            f"cracks {i} and {j} touch or lie on each other near {at(touching_places[0])}: "
            "describe them by one crack, or leave a few cells between them."
        )
