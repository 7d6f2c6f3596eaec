"""Sizes of cells with which the ends of cracks in 2D are seen, before anything is placed."""

from collections.abc import Callable

import numpy as np

from xcrack.adaptivity.start_2d import growing_sizes
from xcrack.base.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.measures import length_inside
from xcrack.mesh.locate import contains, nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem

_CELLS = 4.0  # of a crack's length
_ROOM = 2.5  # cells between two ends
_SLOPE = 0.4  # growth of cells a length
_MOUTH, _MEANT = 0.5, 0.1  # as `placing_2d` has them: shares of a cell
_MOST = 400  # places along a crack


def hidden_ends(problem: Problem) -> bool:
    """Whether an end counts as a mouth because of the cells beside it only."""
    for crack in problem.cracks:
        small = length_inside(crack, problem.mesh) / _CELLS
        for x in _ends(crack, problem.mesh):
            gap, size = nearest_boundary(problem.mesh, x)
            if size > small and gap <= _MOUTH * size:
                return True
    return False


def edge_lengths(problem: Problem, trial: int) -> Callable[[Floats], Floats]:
    """Longest edges of cells at points: small at the ends, and in later trials all along."""
    mesh = problem.mesh
    place, size = [np.zeros((0, 2))], [np.zeros(0)]
    every = [_ends(crack, mesh) for crack in problem.cracks]
    for c, crack in enumerate(problem.cracks):
        length = length_inside(crack, mesh)
        for k, x in enumerate(every[c]):
            others = np.concatenate([np.delete(every[c], k, 0), *every[:c], *every[c + 1 :]])
            distance = np.linalg.norm(others - x, axis=1)
            least = float(distance[distance > 0].min(initial=np.inf))
            place.append(x[None])
            size.append(np.array([min(length / _CELLS, least / _ROOM) / 2**trial]))
        if trial:
            along = _points_along(crack, length / _CELLS / 2**trial)
            along = along[contains(mesh, along)]
            place.append(along)
            size.append(np.full(len(along), length / _CELLS / 2**trial))
    return growing_sizes(np.concatenate(place), np.concatenate(size), _SLOPE)


def _ends(crack: Crack, mesh: Mesh) -> Floats:
    """Ends within the body, farther from its boundary than anybody means a mouth to be."""
    number = np.array([0, -1] if crack.tips is None else crack.tips, dtype=np.int64)
    x = crack.points[number]
    meant = _MEANT * length_inside(crack, mesh) / _CELLS
    inside = [contains(mesh, end[None])[0] and nearest_boundary(mesh, end)[0] > meant for end in x]
    return np.asarray(x[np.array(inside, dtype=bool)])


def _points_along(crack: Crack, spacing: float) -> Floats:
    """Points of a crack, no farther apart than a spacing as long as they are not too many."""
    length = np.linalg.norm(np.diff(crack.points, axis=0), axis=1)
    spacing = max(spacing, float(length.sum()) / _MOST)
    parts = [
        a + np.linspace(0, 1, int(np.ceil(piece_length / spacing)) + 1)[:, None] * (b - a)
        for a, b, piece_length in zip(crack.points[:-1], crack.points[1:], length, strict=True)
    ]
    return np.concatenate(parts)


__all__ = ["edge_lengths", "hidden_ends"]
