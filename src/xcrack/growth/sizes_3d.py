"""Meshes of a run with a tolerance in 3D: cells along fronts, that become smaller as bars ask."""

from collections.abc import Sequence

import numpy as np

from xcrack.adaptivity.indicators import Indicators
from xcrack.adaptivity.sizes_3d import first_mesh, first_size
from xcrack.base.arrays import Floats
from xcrack.growth.scout import Stage
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem

MOST_UNKNOWNS = 300_000
STAGES, ROUNDS = 3, 3
LIFE = 0.9
SCOUT_ORDER = 1
_POWER = 2.5  # of the cells' size with which bars fall at order 2, on graded meshes (measured)
_MOST = 1.6  # times finer in a round
_COARSER = 1.5  # cells of the scout, over those of the first mesh


def given_mesh(problem: Problem) -> Mesh:
    """The mesh of a scene, finer along fronts where it is coarser than the crack is small."""
    return first_mesh(problem)


def scout_mesh(problem: Problem) -> Mesh:
    """The mesh of a scene, finer along fronts where it is coarser than the crack is small."""
    return first_mesh(problem, _COARSER)


def error(now: Indicators) -> float:
    """Mean half-width of K along the fronts of all states, over the largest K."""
    good = np.isfinite(now.bar).all(axis=1)
    scale = now.scale_of(now.K[good])
    return float(now.bar[good].max(axis=1).mean()) / scale if scale > 0 else 0.0


def first_sizes(problem: Problem, stage: Stage) -> Floats:
    """Longest edges of cells at the places along the fronts of a stage `(n,)`."""
    return np.concatenate([
        np.full(n, first_size(crack, problem.mesh))
        for crack, n in zip(stage.cracks, stage.counts, strict=True)
    ])  # fmt: skip


def finer(
    each: Sequence[Indicators],
    wanted: Sequence[float],
    places: Sequence[Floats],
    sizes: list[Floats],
) -> tuple[Mesh, list[Floats]]:
    """The mesh but for the corridor, and the sizes along that: parameters as in 2D."""
    del places
    result = []
    for now, aim, size in zip(each, wanted, sizes, strict=True):
        scale = now.scale_of(now.K[np.isfinite(now.K)])
        over = error(now) * scale / aim if aim > 0 else 1.0
        result.append(size / np.clip(over, 1.0, _MOST**_POWER) ** (1 / _POWER))
    return each[0].problem.mesh, result


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
