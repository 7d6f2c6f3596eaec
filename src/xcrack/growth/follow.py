"""From one step to the next: cycles between them, and growth that waits, place by place."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.size_3d import carried, elapsed_in_space, surface_size
from xcrack.errors import ProblemError
from xcrack.growth.advance import PerCrack, cell_sizes, elapsed, length_inside
from xcrack.growth.step import Memory, Step
from xcrack.mesh.mesh import Mesh
from xcrack.sif.sif import SIF

_SAME = 1e-6  # of the coordinates: a tip found again after its advance
_REACH = 2.0  # cells from a place along a front to those of the step before


def memory_of(step: Step) -> Memory:
    """What a step left to the next one."""
    if step.memory is None:
        raise ProblemError(f"step {step.index} carries no memory: it was not made by grow.")
    return step.memory


def crack_sizes(cracks: Sequence[Crack], mesh: Mesh) -> tuple[float, ...]:
    """Length of each crack in the body; in space its area over the length of its fronts."""
    size = length_inside if mesh.dim == 2 else surface_size
    return tuple(size(crack, mesh) for crack in cracks)


def followed(
    last: Step,
    cracks: Sequence[Crack],
    sif: Sequence[SIF],
    law_rate: Sequence[Floats],
    length: Sequence[float],
    mesh: Mesh,
) -> tuple[float, PerCrack]:
    """Cycles since the last step, and the growth that waits at the places of this one.

    Parameters
    ----------
    last : Step
    cracks : sequence of Crack
        After the advance.
    sif : sequence of SIF
        Tips, or places along fronts, of each crack.
    law_rate : sequence of (f,) arrays, length/cycle
        Growth there, before any threshold.
    length : sequence of float, length
        `crack_sizes` after the advance.
    mesh : Mesh
    """
    before = memory_of(last)
    moved = [_moved(last, c) for c in range(len(cracks))]
    if mesh.dim == 2:
        rate1, pending = [], []
        for c, found in enumerate(sif):
            new_of_old = _matched(moved[c], found.x)
            rate1.append([None if n < 0 else float(law_rate[c][n]) for n in new_of_old])
            waits = np.zeros(len(found.x))
            kept = new_of_old >= 0
            waits[new_of_old[kept]] = before.pending[c][kept]
            pending.append(waits)
        return elapsed(before.length, last.da, before.law_rate, rate1), tuple(pending)
    after, pending = [], []
    for c, found in enumerate(sif):
        old = last.sif[0][c]
        size = cell_sizes(mesh, found.x).mean() if len(found.x) else 0.0
        reach = _REACH * float(size)
        new_closed, old_closed = _closed(cracks[c]), _closed(last.cracks[c])
        after.append(carried(found.x, found.front, new_closed, law_rate[c], moved[c], reach))
        waits = carried(moved[c], old.front, old_closed, before.pending[c], found.x, reach)
        pending.append(np.nan_to_num(waits))
    cycles = elapsed_in_space(before.length, length, last.da, before.law_rate, after)
    return cycles, tuple(pending)


def _moved(step: Step, c: int) -> Floats:
    """Where the places of crack c have come to."""
    found, beta = step.sif[0][c], step.angle[c][:, None]
    direction = np.cos(beta) * found.frame[:, 0] + np.sin(beta) * found.frame[:, 1]
    return np.asarray(found.x + step.da[c][:, None] * direction)


def _matched(moved: Floats, found: Floats) -> np.ndarray:
    """Row of each tip after the step, -1 where it has left the body."""
    if not len(found) or not len(moved):
        return np.full(len(moved), -1)
    distance, row = cKDTree(found).query(moved)
    return np.where(distance <= _SAME * np.abs(found).max(), row, -1)


def _closed(crack: Crack) -> list[bool]:
    return [bool(front[0] == front[-1]) for front in crack.fronts or ()]
