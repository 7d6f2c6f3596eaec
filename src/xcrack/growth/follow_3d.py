"""From one step of 3D cracks to the next, place by place along their fronts."""

from collections.abc import Sequence

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.crack import Crack
from xcrack.crack.size_3d import surface_size
from xcrack.geometry.distances import front_distance
from xcrack.growth.advance import PerCrack
from xcrack.growth.cycles_3d import elapsed_3d
from xcrack.growth.step import Step, memory_of, moved_places
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.sif.sif import SIF

PLACE = "front place"
WAITS_BELOW = 0.02  # of a cell: neighbours along a front move on, so a slow part has to follow

_SPACING = 0.5  # of a cell, between the points of a new front
_REACH = 2.0  # cells from a place along a front to those of the step before


def crack_size(crack: Crack, mesh: Mesh) -> float:
    """Area of a crack over the length of its fronts, in the body."""
    return surface_size(crack, mesh)


def advanced(crack: Crack, sif: SIF, angle: Floats, da: Floats, mesh: Mesh) -> Crack:
    """A crack after the advance of its fronts."""
    if not len(sif.s):
        return crack
    size = _SPACING * float(cell_sizes(mesh, sif.x).mean())
    return advance_fronts(crack, sif.s, sif.front, angle, da, size)


def gone(advanced: Crack, placed: Crack) -> list[int]:
    """[0] where all fronts have left the body."""
    return [0] if advanced.n_tips and not placed.n_tips else []


def left(where: Sequence[str], cracks: Sequence[int]) -> str:
    """Why a run ends whose last fronts have left the body."""
    del where
    return "front left the body: crack " + ", ".join(str(c) for c in cracks)


def exit_ahead(x: Floats, ahead: Floats, mesh: Mesh) -> tuple[Floats, str] | None:
    """None: a front leaves the body along a line, not at a place."""
    del x, ahead, mesh
    return None


def followed(
    last: Step,
    cracks: Sequence[Crack],
    sif: Sequence[SIF],
    law_rate: Sequence[Floats],
    length: Sequence[float],
    mesh: Mesh,
) -> tuple[float, PerCrack]:
    """Cycles since the last step, and the growth that waits at the places of this one.

    Parameters and results are those of `Following.followed`.
    """
    before = memory_of(last)
    after, pending = [], []
    for c in range(len(cracks)):
        old, new, moved = last.sif[0][c], sif[c], moved_places(last, c)
        size = cell_sizes(mesh, new.x).mean() if len(new.x) else 0.0
        reach = _REACH * float(size)
        new_closed, old_closed = _closed(cracks[c]), _closed(last.cracks[c])
        after.append(carried(new.x, new.front, new_closed, law_rate[c], moved, reach))
        waits = carried(moved, old.front, old_closed, before.pending[c], new.x, reach)
        pending.append(np.nan_to_num(waits))
    cycles = elapsed_3d(before.length, length, last.da, before.law_rate, after)
    return cycles, tuple(pending)


def carried(
    x: Floats,
    front: Ints,
    closed: Sequence[bool],
    values: Floats,
    target: Floats,
    reach: float,
) -> Floats:
    """Values along fronts, taken over to points nearby, as those of the fronts after a step.

    Parameters
    ----------
    x : (f, 3) array, length
        Places with values, in order along each front.
    front : (f,) array of int
        Which front.
    closed : sequence of bool
        Whether each front is closed.
    values : (f,) array
    target : (g, 3) array, length
        Where values are sought.
    reach : float, length
        A point farther from all places than this gets none.

    Returns
    -------
    (g,) array
        Linear between the places, nan beyond reach.
    """
    result = np.full(len(target), np.nan)
    best = np.full(len(target), float(reach))
    for number in np.unique(front):
        own = front == number
        line, along = x[own], values[own]
        if len(line) == 1:
            line, along = np.concatenate([line, line]), np.concatenate([along, along])
        shut = bool(closed[number]) and len(line) > 2
        r, segment, place = front_distance(target, line, shut)
        following = (segment + 1) % len(line)
        place = np.nan_to_num(place)
        first, second = along[segment], along[following]
        with np.errstate(invalid="ignore"):  # inf where the toughness is reached
            between = (1 - place) * first + place * second
        value = np.where(place == 0, first, np.where(place == 1, second, between))
        nearer = r <= best
        result[nearer], best[nearer] = value[nearer], r[nearer]
    return result


def _closed(crack: Crack) -> list[bool]:
    return [bool(front[0] == front[-1]) for front in crack.fronts or ()]


__all__ = [
    "PLACE",
    "WAITS_BELOW",
    "advanced",
    "carried",
    "crack_size",
    "exit_ahead",
    "followed",
    "gone",
    "left",
]
