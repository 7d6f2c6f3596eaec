"""Bars of K along fronts in 3D from another solution: with smaller cells along the fronts.

Where domains agree by chance, or both miss what the cells miss, a finer solution sees it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
from xcrack.errors import GeometryError
from xcrack.geometry.around import between
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.scene.problem import Problem
from xcrack.sif.bars import Bars, no_bars
from xcrack.sif.bars_3d import bars_beside, without_estimate
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.sif import SIF, joined

FINER = 1.5  # times
_NEAR = 2.0  # cells around the fronts that become smaller


def finer_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[Bars]:
    """Bars along the fronts of one crack: its states are solved again, with finer cells there.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one solve, in 3D. Whatever their order, the others are of order 2.
    sifs : sequence of SIF
        One for each.
    crack : int

    Returns
    -------
    list of Bars
        `best` is K of the finer solution.
    """
    missing = without_estimate(solutions, sifs)
    if missing is not None:
        return missing
    problem = solutions[0].problem
    try:
        scene = replace(problem, mesh=finer_along(problem, crack), order=2)
        finer = solve_states(scene, [s.state for s in solutions])
    except GeometryError as error:
        return [no_bars(sif.K.shape, f"no finer mesh to compare with: {error}") for sif in sifs]
    fronts = [t for t, tip in enumerate(finer[0].space.tips) if tip.crack == crack]
    by_front = [front_intensity(finer, t) for t in fronts]
    every = [joined([states[k] for states in by_front], 3) for k in range(len(finer))]
    return bars_beside(sifs, every, "the finer mesh has other fronts: refine the mesh along them")


def finer_along(problem: Problem, crack: int) -> Mesh:
    """The mesh with cells along the fronts of one crack that are smaller by 1.5."""
    mesh, placed = problem.mesh, problem.placed[crack]
    front = cKDTree(between([placed.points[front] for front in placed.fronts or ()]))
    centre = mesh.points[mesh.cells].mean(axis=1)
    near = front.query(centre)[0] <= _NEAR * mesh.cell_size
    each = np.where(near, mesh.cell_size / FINER, np.inf)

    def wanted(x: Floats) -> Floats:
        return np.asarray(each[mesh.cell_tree.query(x)[1]])

    return refine(mesh, size=wanted)


__all__ = ["FINER", "finer_along", "finer_bars"]
