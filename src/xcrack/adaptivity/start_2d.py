"""First mesh: cells at tips and kinks that are smaller than what is around them."""

from collections.abc import Callable

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.crack.crack import kink_numbers
from xcrack.crack.measures import length_inside
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.polygon import distance_to_simplices
from xcrack.mesh.refinement import refine
from xcrack.model.problem import Problem

_CELLS = 4.0  # of a crack's length: less, and no estimate sees what is left out
_ROOM = 2.5  # cells between a tip and the next boundary, crack or tip
_KINK = 20.0  # cells of a crack's length at its kinks: stresses are singular there
_SLOPE = 0.4  # growth of cells a length


def first_mesh(problem: Problem) -> Mesh:
    """The mesh of a scene in 2D, finer at tips and kinks where it is coarser than they are."""
    place, size = tip_sizes(problem)
    bends = [
        (x, length_inside(crack, problem.mesh) / _KINK)
        for crack in problem.placed
        for x in crack.points[kink_numbers(crack.points)]
    ]
    if bends:
        place = np.concatenate([place, [x for x, _ in bends]])
        size = np.concatenate([size, [h for _, h in bends]])
    if not len(place):
        return problem.mesh
    # A mesh that is fine enough at its ends stays as it was given.
    if (cell_sizes(problem.mesh, place) <= size).all():
        return problem.mesh
    return refine(problem.mesh, size=growing_sizes(place, size, _SLOPE))


def growing_sizes(place: Floats, size: Floats, slope: float) -> Callable[[Floats], Floats]:
    """Sizes of cells at points that grow with the distance from places `(n, 2)` by a slope."""

    def wanted(x: Floats) -> Floats:
        distance = np.linalg.norm(x[:, None] - place, axis=2)
        return np.asarray((size + slope * distance).min(axis=1))

    return wanted


def tip_sizes(problem: Problem) -> tuple[Floats, Floats]:
    """All tips `(n, 2)`, and the longest edges of cells there that see crack and room `(n,)`."""
    spots, sizes = [np.zeros((0, 2))], []
    tips = [crack.points[i] for crack in problem.placed for i in crack.tips or ()]
    for crack in problem.placed:
        length = length_inside(crack, problem.mesh)
        for i in crack.tips or ():
            x = crack.points[i]
            spots.append(x[None])
            sizes.append(min(length / _CELLS, _room_of_tip(problem, x, tips, crack.points) / _ROOM))
    return np.concatenate(spots), np.array(sizes)


def _room_of_tip(problem: Problem, x: Floats, tips: list[Floats], other_tips: Floats) -> float:
    """Distance of a tip to the boundary, to other cracks and tips."""
    mesh = problem.mesh
    walls = [mesh.points[mesh.boundary]]
    walls += [
        np.stack([crack.points[:-1], crack.points[1:]], axis=1)
        for crack in problem.placed
        if crack.points is not other_tips
    ]
    distance = [float(distance_to_simplices(x, wall).min()) for wall in walls]
    others = [float(np.linalg.norm(x - tip)) for tip in tips if (tip != x).any()]
    return min(distance + others)


__all__ = ["first_mesh", "growing_sizes", "tip_sizes"]
