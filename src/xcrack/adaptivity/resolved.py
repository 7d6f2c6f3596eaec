"""A mesh into which the cracks of a scene can be put: finer around those that are too small."""

from dataclasses import replace
from types import ModuleType

from xcrack.adaptivity import outlines_2d, outlines_3d
from xcrack.base.errors import CoarseMeshError
from xcrack.mesh.refinement import refine
from xcrack.model.problem import Problem

_TWINS: dict[int, ModuleType] = {2: outlines_2d, 3: outlines_3d}
_TRIALS = 5  # each on cells of half the size


def resolved_problem(problem: Problem) -> Problem:
    """The scene on a mesh that is fine enough to tell tips and fronts of its cracks from mouths.

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
    twin = _TWINS[problem.mesh.dim]
    if _fits(problem) and not twin.hidden_ends(problem):
        return problem
    for trial in range(_TRIALS):
        problem = replace(
            problem, mesh=refine(problem.mesh, size=twin.edge_lengths(problem, trial))
        )
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


__all__ = ["resolved_problem"]
