"""The next mesh in 2D: cells that contribute much to the bars are bisected."""

from dataclasses import replace

import numpy as np

from xcrack.adaptivity.indicators import Indicators, live_states
from xcrack.adaptivity.start_2d import first_mesh
from xcrack.adaptivity.target_error import size_ratios
from xcrack.base.arrays import Floats
from xcrack.crack.crack import kink_numbers
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine_to
from xcrack.sif.sif import KErrors

_ORDER = 2
_SWEEPS = 5
_GENTLER = 2  # times that the aim is doubled where the next mesh would be too large
_LEAST = 1.05  # cells of the next mesh over those of this one


def trusted_errors(new: Indicators, old: Indicators | None) -> Indicators:
    """Bars that also cover what the last refinement has changed.

    Two best values may differ by both bars. Where they differ by more, the estimates have missed
    something, and the bar grows by as much. Where faces press on each other at a kink it is at
    least the change itself.
    """
    if old is None:
        return new
    change = np.abs(new.best - old.best)
    bent = np.repeat(np.isin(_cracks(new), _bent_cracks(new)), _ends(new))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = change / np.where(bent, new.bar, new.bar + old.bar)
    growth = np.where(growth > 1, growth, 1.0)
    if (growth == 1).all():
        return new
    rows = iter(np.split(growth, np.cumsum(_ends(new))[:-1]))
    by_crack = [{k: next(rows) for k in live_states(new)} for _ in range(len(new.problem.cracks))]
    sifs = tuple(
        tuple(
            replace(sif, errors=KErrors(sif.eta, sif.bar * by_crack[c].get(k, 1.0), sif.reasons))
            for c, sif in enumerate(state)
        )
        for k, state in enumerate(new.sifs)
    )
    return replace(new, sifs=sifs, bar=new.bar * growth)


def _cracks(given: Indicators) -> list[int]:
    """Crack of each of these."""
    return [c for c in range(len(given.problem.cracks)) for _ in live_states(given)]


def _ends(given: Indicators) -> list[int]:
    """Number of tips of each crack and state, in the order of `best`."""
    return [
        len(given.sifs[k][c].K)
        for c in range(len(given.problem.cracks))
        for k in live_states(given)
    ]


def next_mesh(current: Indicators, tolerance: float, aim: float, most: int) -> Mesh | None:
    """A finer mesh, or None where it would have too many unknowns."""
    mesh, scale = current.problem.mesh, float(np.abs(current.best).max(initial=0.0))
    each = current.solutions[0].space.n_dof / len(mesh.cells)
    for share in aim * 2.0 ** np.arange(1 + _GENTLER):
        target = tolerance * scale * share
        ratio = size_ratios(current.shares, current.bar.ravel(), target, _ORDER, mesh.dim)
        ratio = np.minimum(ratio, at_coarse_tips(current))
        fine = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        while len(fine.cells) < _LEAST * len(mesh.cells):  # the bar does not follow the shares
            largest = np.argsort(current.shares.max(axis=0, initial=0.0))[
                -(len(mesh.cells) // 10) - 1 :
            ]
            ratio[largest] /= 2
            fine = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        if each * len(fine.cells) <= most:
            return fine
    return None


def at_coarse_tips(current: Indicators) -> Floats:
    """Half of the size around tips that have no bar."""
    mesh = current.problem.mesh
    ratio = np.ones(len(mesh.cells))
    centre = mesh.points[mesh.cells].mean(axis=1)
    for sif in (sif for state in current.sifs for sif in state):
        for x, reason in zip(sif.x, sif.reasons, strict=True):
            distance = np.linalg.norm(centre - x, axis=1)
            is_near = distance <= 2 * mesh.cell_size[np.argmin(distance)]
            ratio[is_near & bool(reason)] = 0.5
    return ratio


def _bent_cracks(given: Indicators) -> tuple[int, ...]:
    """Cracks that press and have kinks, of whose pressures the estimates see a part only."""
    return tuple(c for c in given.pressed if len(kink_numbers(given.problem.placed[c].points)))


__all__ = ["at_coarse_tips", "first_mesh", "next_mesh", "trusted_errors"]
