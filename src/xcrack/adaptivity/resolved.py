"""A mesh into which the cracks of a scene can be put: finer around those that are too small."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from xcrack.base.arrays import Floats, ranges
from xcrack.base.errors import CoarseMeshError
from xcrack.crack.crack import Crack
from xcrack.crack.measures import area_inside, length_inside
from xcrack.mesh.locate import Body, contains, nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import graded_sizes, growing_sizes, refine, with_room
from xcrack.mesh.triangulation import loops
from xcrack.model.problem import Problem

_CELLS = 4.0  # of a crack's length
_ROOM = 2.5  # cells between two ends
_SLOPE = 0.4  # growth of cells a length
_MOUTH, _MEANT = 0.5, 0.1  # as `placing_2d` has them: shares of a cell
_MOST_ON_LINES = 400  # places along a crack


def _hidden_tips(problem: Problem) -> bool:
    """Whether an end counts as a mouth because of the cells beside it only."""
    for crack in problem.cracks:
        least_size = length_inside(crack, problem.mesh) / _CELLS
        for x in _ends(crack, problem.mesh):
            gap, size = nearest_boundary(problem.mesh, x)
            if size > least_size and gap <= _MOUTH * size:
                return True
    return False


def _sizes_at_lines(problem: Problem, trial: int) -> Callable[[Floats], Floats]:
    """Longest edges of cells at points: small at the ends, and in later trials all along."""
    mesh = problem.mesh
    place, size = [np.zeros((0, 2))], [np.zeros(0)]
    ends = [_ends(crack, mesh) for crack in problem.cracks]
    for c, crack in enumerate(problem.cracks):
        length = length_inside(crack, mesh)
        for k, x in enumerate(ends[c]):
            other_points = np.concatenate([np.delete(ends[c], k, 0), *ends[:c], *ends[c + 1 :]])
            distance = np.linalg.norm(other_points - x, axis=1)
            least_distance = float(distance[distance > 0].min(initial=np.inf))
            place.append(x[None])
            size.append(np.array([min(length / _CELLS, least_distance / _ROOM) / 2**trial]))
        if trial:
            points_along = _points_along(crack, length / _CELLS / 2**trial)
            points_along = points_along[contains(mesh, points_along)]
            place.append(points_along)
            size.append(np.full(len(points_along), length / _CELLS / 2**trial))
    return growing_sizes(np.concatenate(place), np.concatenate(size), _SLOPE)


def _ends(crack: Crack, mesh: Mesh) -> Floats:
    """Ends within the body, farther from its boundary than anybody means a mouth to be."""
    number = np.array([0, -1] if crack.tips is None else crack.tips, dtype=np.int64)
    x = crack.points[number]
    cell_size = _MEANT * length_inside(crack, mesh) / _CELLS
    is_inside = [
        contains(mesh, end[None])[0] and nearest_boundary(mesh, end)[0] > cell_size for end in x
    ]
    return np.asarray(x[np.array(is_inside, dtype=bool)])


def _points_along(crack: Crack, spacing: float) -> Floats:
    """Points of a crack, no farther apart than a spacing as long as they are not too many."""
    length = np.linalg.norm(np.diff(crack.points, axis=0), axis=1)
    spacing = max(spacing, float(length.sum()) / _MOST_ON_LINES)
    parts = [
        a + np.linspace(0, 1, int(np.ceil(piece_length / spacing)) + 1)[:, None] * (b - a)
        for a, b, piece_length in zip(crack.points[:-1], crack.points[1:], length, strict=True)
    ]
    return np.concatenate(parts)


# Cells of a crack's size (half the radius of a penny) along its outline, by their longest edges.
CELLS = 1.25
_COARSER = 4.0  # than that, to see where the fronts are
_MOUTH = 0.5  # as `placing_3d` has it: share of a cell
_FINE = 0.5  # of a cell: spacing of the places
_MOST_ON_OUTLINES = 2000  # places along an outline


def _hidden_fronts(problem: Problem) -> bool:
    """Whether parts of an outline count as mouths because of the cells beside them only."""
    body = Body.of(problem.mesh)
    for crack in problem.cracks:
        x, size = _outline(crack, body)
        depth, facet = body.depth(x)
        is_coarse = (-depth > _MOUTH * size) & (-depth <= _MOUTH * facet)
        if is_coarse.mean() > 0.1:  # some are beside the places at which it leaves the body
            return True
    return False


def _sizes_at_outlines(problem: Problem, trial: int) -> Callable[[Floats], Floats]:
    """Longest edges of cells at points: small along the outlines."""
    body = Body.of(problem.mesh)
    places, sizes = [], []
    for crack in problem.cracks:
        x, size = _outline(crack, body)
        places.append(x)
        sizes.append(np.full(len(x), _COARSER * size / 2**trial))
    return graded_sizes(places, with_room(places, sizes))


def _outline(crack: Crack, body: Body) -> tuple[Floats, float]:
    """Places of an outline within the body, or of the fronts if they are known, and a size there.

    The size is that of the first mesh, with the outline in place of the fronts.
    """
    lines = [np.append(loop, loop[0]) for loop in loops(crack.faces)]
    lines = lines if crack.fronts is None else list(crack.fronts)
    ends = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    a, b = crack.points[ends].transpose(1, 0, 2)
    side = np.linalg.norm(b - a, axis=1)
    area = area_inside(crack, body.mesh)
    spacing = max(_FINE * np.sqrt(area) / CELLS / 4, float(side.sum()) / _MOST_ON_OUTLINES)
    parts = np.maximum(np.ceil(side / spacing), 1).astype(np.int64)
    row, part = ranges(parts)
    x = a[row] + ((part + 0.5) / parts[row])[:, None] * (b - a)[row]
    is_inside = body.contains(x)
    x, length = x[is_inside], float((side / parts)[row][is_inside].sum())
    return x, area / length / CELLS if length > 0 else np.inf


_TRIALS = 5  # each on cells of half the size


def resolved_tips(problem: Problem) -> Problem:
    """The scene on a mesh that is fine enough to tell tips of its cracks from mouths.

    Cells around the ends of a crack become a quarter of its length, or as small as what lies
    between two ends asks for; smaller ones where that does not do. A mesh that is fine enough
    stays as it is.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    Problem

    Raises
    ------
    CoarseMeshError
        No mesh will do: the message of the last one.
    """
    return _resolved_problem(problem, _hidden_tips, _sizes_at_lines)


def resolved_fronts(problem: Problem) -> Problem:
    """The scene on a mesh that is fine enough to tell fronts from mouths, as `resolved_tips`."""
    return _resolved_problem(problem, _hidden_fronts, _sizes_at_outlines)


def _resolved_problem(
    problem: Problem,
    hidden_ends: Callable[[Problem], bool],
    edge_lengths: Callable[[Problem, int], Callable[[Floats], Floats]],
) -> Problem:
    if _fits(problem) and not hidden_ends(problem):
        return problem
    for trial in range(_TRIALS):
        problem = replace(problem, mesh=refine(problem.mesh, size=edge_lengths(problem, trial)))
        if _fits(problem):
            break
    _ = problem.placed
    return problem


def _fits(problem: Problem) -> bool:
    try:
        _ = problem.placed
    except CoarseMeshError:
        return False
    return True


__all__ = ["CELLS", "resolved_fronts", "resolved_tips"]
