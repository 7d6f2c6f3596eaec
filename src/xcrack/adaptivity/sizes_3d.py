"""The next mesh in 3D: cells along the fronts become smaller, others with the distance to them.

Weighted residuals have no useful shares there (fronts are chords). Order 2 on a mesh that is graded
like this is near 1e-3 where two to four cells fit into the radius of a penny; a mesh with smaller
cells at the front tells how near.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.adaptivity.indicators import (
    Indicators,
    counted_places,
    ending_fronts,
    live_states,
    values,
)
from xcrack.adaptivity.resolved import CELLS, resolved_fronts
from xcrack.base.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.measures import surface_size
from xcrack.mesh.fitted_curves import OF_TURN, warn_of_chords
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import graded_sizes, points_between, radii, refine, with_room
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF, KErrors

# The tolerance of the first mesh at which fronts are just seen, the power of coarser ones (of least
# time, second rounds included: 1.25 times coarser at 1 %, 3 at 3 %), and the coarsest.
_BAR, _RISE, _COARSEST = 0.00756, 1.255, 3.0
_LEAST, _MOST = 1.5, 2.0  # times finer in a round: what less changes is no bar
_POWER = 2.5  # of the cells' size with which bars fall at order 2, on graded meshes (measured)
_BEND = 0.6  # of the radius of curvature of a front: the domains of K have to fit into it
_COARSE_BEND = 2.0  # times that, where the tolerance lets cells be larger
_SHARPEST = 0.4  # of the cells along a front: least where it turns
_OPEN = 1.5  # error of K beside a free surface over the bar of two domains (measured)
_SMALLER = 1.3  # times finer that cells are at least where 1.5 was asked for


def coarse_mesh(problem: Problem, tolerance: float) -> Mesh:
    """The first mesh of a scene in 3D: cells along its fronts as large as the tolerance lets them.

    Their bars are within it in most scenes (measured), else one more round is. They know nothing of
    curves that the mesh does not: where these would change K by more, a warning says so.
    """
    turn = float(np.sqrt(OF_TURN * tolerance))
    warn_of_chords(problem.mesh, "the mesh", turn, "xc.fit_curves(mesh) has")
    return first_mesh(problem, float(np.clip((tolerance / _BAR) ** (1 / _RISE), 1.0, _COARSEST)))


def first_mesh(problem: Problem, coarseness: float = 1.0) -> Mesh:
    """The mesh of a scene in 3D, finer along fronts where it is coarser than the crack is small."""
    problem = resolved_fronts(problem)
    return refine(problem.mesh, size=graded_sizes(*_first_sizes(problem, coarseness)))


def first_size(crack: Crack, mesh: Mesh) -> float:
    """Longest edge of cells along the fronts of a placed crack that just see it, length."""
    return float(surface_size(crack, mesh) / CELLS)


def next_mesh(indicators: Indicators, tolerance: float, aim: float, most_cells: int) -> Mesh | None:
    """A finer mesh along fronts whose bars are too long, or None where it would be too large."""
    problem = indicators.problem
    places, first = _first_sizes(problem)
    sizes = []
    for c, (x, size) in enumerate(zip(places, first, strict=True)):
        if len(x):
            size_ratio = float(np.median(cell_sizes(problem.mesh, x) / size))
            size = size * size_ratio / _refinement_factor(indicators, c, tolerance, aim)
        sizes.append(size)
    mesh = refine(problem.mesh, size=graded_sizes(places, sizes))
    unknowns_per_cell = indicators.solutions[0].space.n_dof / len(problem.mesh.cells)
    return mesh if unknowns_per_cell * len(mesh.cells) <= most_cells else None


def _refinement_factor(indicators: Indicators, c: int, tolerance: float, aim: float) -> float:
    """How many times smaller the cells along the fronts of a crack are to be."""
    error = error_of(indicators, c)
    if error <= tolerance and c not in indicators.pressed_cracks:
        return 1.0
    if error <= tolerance or not np.isfinite(error):
        return _LEAST
    return float(np.clip((error / (aim * tolerance)) ** (1 / _POWER), _LEAST, _MOST))


def error_of(indicators: Indicators, c: int) -> float:
    """Largest half-width of K along the fronts of a crack, over the largest K of all.

    Nan where there is none.
    """
    bars = [np.zeros(1)]
    for k in live_states(indicators):
        sif = indicators.sifs[k][c]
        bars_of_crack = sif.bar[counted_places(sif, indicators.surface_depths[c])]
        bars.append(
            bars_of_crack.max(axis=1)
            if len(bars_of_crack) or not len(sif.K)
            else np.full(1, np.nan)
        )
    scale = indicators.scale
    return float(np.concatenate(bars).max() / scale) if scale > 0 else float("nan")


def trusted_errors(indicators: Indicators, previous_indicators: Indicators | None) -> Indicators:
    """Bars that are no longer than what smaller cells at the front have changed.

    At order 2 the error falls by more than half where cells become smaller by 1.5, so that the
    change is above the error that is left. One place may agree by chance: the root mean square
    along the front is the least. Fronts whose cells have stayed keep the bars that they had, or
    take what the finer cells elsewhere have changed. Before, bars of fronts that end at a free
    surface are longer by a half than two domains tell.
    """
    numbers_under_load = live_states(indicators)
    if previous_indicators is None:
        sifs = tuple(tuple(map(_lengthen_errors, state)) for state in indicators.sifs)
        return replace(
            indicators,
            sifs=sifs,
            bar=values(sifs, numbers_under_load, indicators.surface_depths)[1],
        )
    is_finer = [
        _sizes_at(previous_indicators, c) >= _SMALLER * _sizes_at(indicators, c)
        for c in range(len(indicators.problem.cracks))
    ]
    sifs = tuple(
        tuple(
            _shorten_errors(_lengthen_errors(sif), previous_sif, is_finer[c])
            if k in numbers_under_load
            else sif
            for c, (sif, previous_sif) in enumerate(zip(state, states_before, strict=True))
        )
        for k, (state, states_before) in enumerate(
            zip(indicators.sifs, previous_indicators.sifs, strict=True)
        )
    )
    return replace(
        indicators, sifs=sifs, bar=values(sifs, numbers_under_load, indicators.surface_depths)[1]
    )


def _lengthen_errors(sif: SIF) -> SIF:
    """Bars as long as corner cracks on coarse cells ask for."""
    ends = np.isin(sif.front, ending_fronts(sif))
    if not ends.any():
        return sif
    bar = np.where(ends[:, None], _OPEN, 1.0) * sif.bar
    return replace(sif, errors=KErrors(sif.eta, bar, sif.reasons))


def _sizes_at(indicators: Indicators, c: int) -> float:
    """Median of the cells along the fronts of a crack, length; 0 where there is none."""
    x = _front(indicators.problem.placed[c])
    return float(np.median(cell_sizes(indicators.problem.mesh, x))) if len(x) else 0.0


def _shorten_errors(sif: SIF, previous_sif: SIF, is_finer: bool) -> SIF:
    """Bars by the change, as far as two meshes have K at the same places."""
    bar = np.array(sif.bar)
    is_inside, is_inside_before = ~sif.at_surface, ~previous_sif.at_surface
    if not is_inside_before.any():
        return sif
    nearest_rows = np.nonzero(is_inside_before)[0][
        cKDTree(previous_sif.x[is_inside_before]).query(sif.x)[1]
    ]
    changes = np.abs(sif.best - previous_sif.best[nearest_rows])
    for front in np.unique(sif.front):
        is_on_front = (sif.front == front) & is_inside
        if not is_on_front.any():
            continue
        change = changes[is_on_front]
        change = np.maximum(change, np.sqrt((change**2).mean(axis=0)))
        if not is_finer:
            change = np.maximum(change, previous_sif.bar[nearest_rows][is_on_front])
        bar[is_on_front] = np.fmin(bar[is_on_front], change)
    bar[sif.closed, 0] = sif.bar[sif.closed, 0]
    return replace(sif, errors=KErrors(sif.eta, bar, sif.reasons))


def _first_sizes(problem: Problem, coarseness: float = 1.0) -> tuple[list[Floats], list[Floats]]:
    """Places along the fronts of each crack, and the longest edges of the first mesh there."""
    places, sizes, coarse_sizes = [], [], []
    for crack in problem.placed:
        size = first_size(crack, problem.mesh)
        lines = [crack.points[front] for front in crack.fronts or ()]
        bend = np.maximum(_BEND * radii(lines, CELLS * size), _SHARPEST * size)
        places.append(points_between(lines))
        sizes.append(np.minimum(size, bend))
        coarse_sizes.append(np.minimum(coarseness * sizes[-1], _COARSE_BEND * bend))
    # Where cracks are near each other cells stay small all along: sizes that differ much within
    # the reach of the tip functions leave a matrix that is not positive.
    sizes_in_room = with_room(places, coarse_sizes)
    is_alone = [np.array_equal(a, b) for a, b in zip(sizes_in_room, coarse_sizes, strict=True)]
    return places, [
        a if is_alone_here else b
        for a, b, is_alone_here in zip(
            sizes_in_room, with_room(places, sizes), is_alone, strict=True
        )
    ]


def _front(crack: Crack) -> Floats:
    """Points of the fronts of a placed crack, closer than its edges."""
    return points_between([crack.points[front] for front in crack.fronts or ()])


__all__ = ["coarse_mesh", "first_mesh", "first_size", "next_mesh", "trusted_errors"]
