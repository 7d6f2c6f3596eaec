"""The next mesh in 3D: cells along the fronts become smaller, others with the distance to them.

Weighted residuals have no useful shares there (fronts are chords). Order 2 on a mesh that is graded
like this is near 1e-3 where two to four cells fit into the radius of a penny; a mesh with smaller
cells at the front tells how near.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.adaptivity.measured import Measured, live_states
from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.size_3d import surface_size
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.scene.problem import Problem
from xcrack.sif.bars import Bars
from xcrack.sif.sif import SIF

# Cells of a crack's size (half the radius of a penny) along its fronts in the first mesh, by their
# longest edges.
_CELLS = 1.25
_PLATEAU = 2.0  # cells around a front that are as small as those at it
_SLOPE = 0.5
_FINER = 1.5


def first_mesh(problem: Problem, coarser: float = 1.0) -> Mesh:
    """The mesh of a scene in 3D, finer along fronts where it is coarser than the crack is small."""
    size = [coarser * first_size(crack, problem.mesh) for crack in problem.placed]
    return _graded(problem, size)


def first_size(crack: Crack, mesh: Mesh) -> float:
    """Longest edge of cells along the fronts of a placed crack that just see it, length."""
    return float(surface_size(crack, mesh) / _CELLS)


def next_mesh(now: Measured, tolerance: float, aim: float, most: int) -> Mesh | None:
    """A finer mesh, or None where it would have too many unknowns."""
    del tolerance, aim
    problem = now.problem
    size = [
        float(np.median(cell_sizes(problem.mesh, _front(problem, c)))) / _FINER
        for c in range(len(problem.cracks))
    ]
    mesh = _graded(problem, size)
    each = now.solutions[0].space.n_dof / len(problem.mesh.cells)
    return mesh if each * len(mesh.cells) <= most else None


def trusted(new: Measured, old: Measured | None) -> Measured:
    """Bars that are no longer than what smaller cells at the front have changed.

    At order 2 the error falls by more than half where cells become smaller by 1.5, so that the
    change is above the error that is left. One place may agree by chance: the root mean square
    along the front is the least.
    """
    if old is None:
        return new
    live = live_states(new)
    sifs = tuple(
        tuple(
            _shorter(sif, before) if k in live else sif
            for sif, before in zip(state, states_before, strict=True)
        )
        for k, (state, states_before) in enumerate(zip(new.sifs, old.sifs, strict=True))
    )
    rows = [
        sifs[k][c].bar[~sifs[k][c].at_surface] for c in range(len(new.problem.cracks)) for k in live
    ]
    return replace(new, sifs=sifs, bar=np.concatenate(rows))


def _shorter(sif: SIF, before: SIF) -> SIF:
    bar = np.array(sif.bar)
    inside = ~sif.at_surface
    for front in np.unique(sif.front):
        own, other = (sif.front == front) & inside, (before.front == front) & ~before.at_surface
        if not own.any() or not other.any():
            continue
        nearest = cKDTree(before.x[other]).query(sif.x[own])[1]
        change = np.abs(sif.best[own] - before.best[other][nearest])
        bar[own] = np.minimum(bar[own], np.maximum(change, np.sqrt((change**2).mean(axis=0))))
    bar[sif.closed, 0] = sif.bar[sif.closed, 0]
    return replace(sif, errors=Bars(sif.eta, bar, sif.reasons))


def _front(problem: Problem, c: int) -> Floats:
    """Points of the fronts of a crack, closer than its edges."""
    crack = problem.placed[c]
    parts = [np.zeros((0, 3))]
    for front in crack.fronts or ():
        x = crack.points[front]
        share = np.linspace(0, 1, 4)[:, None, None]
        parts.append((x[:-1] + share * (x[1:] - x[:-1])).reshape(-1, 3))
    return np.concatenate(parts)


def _graded(problem: Problem, size: list[float]) -> Mesh:
    trees = [
        (cKDTree(_front(problem, c)), h) for c, h in enumerate(size) if len(_front(problem, c))
    ]

    def wanted(x: Floats) -> Floats:
        each = [h + _SLOPE * np.maximum(tree.query(x)[0] - _PLATEAU * h, 0) for tree, h in trees]
        return np.asarray(np.min(each, axis=0))

    return refine(problem.mesh, size=wanted)


__all__ = ["first_mesh", "first_size", "next_mesh", "trusted"]
