"""Meshes of a run with a tolerance in 2D: for the scout, and by the cells' shares of the bars."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.adaptivity.indicators import Indicators
from xcrack.adaptivity.resolved import resolved_problem
from xcrack.adaptivity.sizes_2d import joint_mesh, tip_sizes
from xcrack.base.arrays import Floats
from xcrack.growth.scout import Stage
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import growing_sizes, refine
from xcrack.model.problem import Problem

MOST_UNKNOWNS = 300_000
STAGES, ROUNDS = 4, 6
LIFE = 0.98
SCOUT_ORDER = 2
_COARSEST = 1.3  # times the size that sees crack and room: error bars can just be had there
_SLOPE = 0.25  # growth of cells with the distance from a tip, for the scout
_AIM = 1.0  # of the wanted half-widths: bars become shorter than foretold


def given_mesh(problem: Problem) -> Mesh:
    """The mesh as it was given, where cracks are long enough in it; else finer at the tips."""
    problem = resolved_problem(problem)
    place, size = tip_sizes(problem)
    if (cell_sizes(problem.mesh, place) <= _COARSEST * size).all():
        return problem.mesh
    return scout_mesh(problem)


def scout_mesh(problem: Problem) -> Mesh:
    """The mesh of a scene, finer around tips where it is coarser than their cracks are short."""
    problem = resolved_problem(problem)
    place, size = tip_sizes(problem)
    if not len(place):
        return problem.mesh
    return refine(problem.mesh, size=growing_sizes(place, size, _SLOPE))


def first_sizes(problem: Problem, stage: Stage) -> Floats:
    """Longest edges of cells at the tips of a stage that see crack and room `(n,)`."""
    place, size = tip_sizes(replace(problem, cracks=stage.cracks))
    return np.minimum(size, cell_sizes(problem.mesh, place))


def error(now: Indicators) -> float:
    """Largest half-width of K over the largest K, of those that are known."""
    scale = now.scale_of(now.K[np.isfinite(now.K)])
    return float(now.bar[np.isfinite(now.bar)].max(initial=0.0)) / scale if scale > 0 else 0.0


def finer(
    each: Sequence[Indicators],
    wanted: Sequence[float],
    places: Sequence[Floats],
    sizes: list[Floats],
) -> tuple[Mesh, list[Floats]]:
    """The next mesh but for the corridor, and the sizes along that.

    Parameters
    ----------
    each : sequence of Indicators
        Stages on one mesh.
    wanted : sequence of float, stress · √length
        Half-widths of their K.
    places : sequence of (n,2) arrays, length
        Tips of all stages.
    sizes : list of (n,) arrays, length
        Of cells there.
    """
    mesh = joint_mesh(each, wanted, _AIM)
    return mesh, [np.minimum(cell_sizes(mesh, x), h) for x, h in zip(places, sizes, strict=True)]


__all__ = [
    "LIFE",
    "MOST_UNKNOWNS",
    "ROUNDS",
    "SCOUT_ORDER",
    "STAGES",
    "error",
    "finer",
    "first_sizes",
    "given_mesh",
    "scout_mesh",
]
