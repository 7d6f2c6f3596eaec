"""Sizes of cells with which the outlines of cracks in 3D are seen, before anything is placed."""

from collections.abc import Callable

import numpy as np

from xcrack.base.arrays import Floats, ranges
from xcrack.crack.crack import Crack
from xcrack.crack.measures import area_inside
from xcrack.mesh.locate import Body
from xcrack.mesh.polygon import graded_sizes, with_room
from xcrack.mesh.triangulation import loops
from xcrack.model.problem import Problem

# Cells of a crack's size (half the radius of a penny) along its outline, by their longest edges.
CELLS = 1.25
_COARSER = 2.0  # than that, to see where the fronts are
_MOUTH = 0.5  # as `placing_3d` has it: share of a cell
_FINE = 0.5  # of a cell: spacing of the places
_MOST = 2000  # places along an outline


def hidden_ends(problem: Problem) -> bool:
    """Whether parts of an outline count as mouths because of the cells beside them only."""
    body = Body.of(problem.mesh)
    for crack in problem.cracks:
        x, size = _outline(crack, body)
        depth, facet = body.depth(x)
        coarse = (-depth > _MOUTH * size) & (-depth <= _MOUTH * facet)
        if coarse.mean() > 0.1:  # some are beside the places at which it leaves the body
            return True
    return False


def edge_lengths(problem: Problem, trial: int) -> Callable[[Floats], Floats]:
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
    ends = np.concatenate([np.stack([one[:-1], one[1:]], axis=1) for one in lines])
    a, b = crack.points[ends].transpose(1, 0, 2)
    side = np.linalg.norm(b - a, axis=1)
    area = area_inside(crack, body.mesh)
    spacing = max(_FINE * np.sqrt(area) / CELLS / 4, float(side.sum()) / _MOST)
    parts = np.maximum(np.ceil(side / spacing), 1).astype(np.int64)
    row, part = ranges(parts)
    x = a[row] + ((part + 0.5) / parts[row])[:, None] * (b - a)[row]
    inside = body.contains(x)
    x, length = x[inside], float((side / parts)[row][inside].sum())
    return x, area / length / CELLS if length > 0 else np.inf


__all__ = ["CELLS", "edge_lengths", "hidden_ends"]
