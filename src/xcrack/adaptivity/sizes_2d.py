"""Meshes in 2D from errors of K.

The first is smaller at tips and kinks; in the next ones cells that contribute much to the bars are
bisected.
"""

from dataclasses import replace

import numpy as np

from xcrack.adaptivity.indicators import Indicators, live_states
from xcrack.base.arrays import Floats
from xcrack.crack.crack import kink_numbers
from xcrack.crack.measures import length_inside
from xcrack.mesh.distances import distance_to_simplices
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import growing_sizes, refine, refine_to
from xcrack.model.problem import Problem
from xcrack.sif.sif import KErrors

_MOST = 5  # bisections of a cell in one round
_STEPS = 60  # in which a threshold is halved in on


def size_ratios(shares: Floats, bar: Floats, target: float, order: int, dim: int) -> Floats:
    """Size of each cell in the next mesh over its size in this one.

    A cell's share falls with its size to the power of 2 p + d, while 1 / size^d such cells take its
    place. With the fewest of them all shares are alike: those above a threshold go down to it, and
    the threshold is such that bars, which follow the sum of the shares, are as wanted.

    Parameters
    ----------
    shares : (k, m) array
        Contributions of the cells to the errors of k values.
    bar : (k,) array
        Half-widths of these errors; nan where there is none, and the shares alone count.
    target : float
        Half-width that all are to have.
    order, dim : int

    Returns
    -------
    (m,) array
        Between `2^(-5 / dim)`, the most that bisection does in a round, and 1.
    """
    power = 2 * order + dim
    ratio = np.ones(shares.shape[1])
    for cell_shares, half in zip(shares, bar, strict=True):
        total = cell_shares.sum()
        error = half if np.isfinite(half) else total
        if not total > 0 or error <= target:
            continue
        aim = target * total / error
        t_min, t_max = 0.0, float(cell_shares.max())
        for _ in range(_STEPS):
            threshold = (t_min + t_max) / 2
            error_left = np.minimum(cell_shares, threshold) ** (2 * order / power)
            error_left *= cell_shares ** (dim / power)
            t_min, t_max = (threshold, t_max) if error_left.sum() < aim else (t_min, threshold)
        is_above = cell_shares > t_min
        ratio[is_above] = np.minimum(
            ratio[is_above], (max(t_min, 1e-300) / cell_shares[is_above]) ** (1 / power)
        )
    return np.maximum(ratio, 2.0 ** (-_MOST / dim))


_CELLS = 4.0  # of a crack's length: less, and no estimate sees what is left out
_ROOM = 2.5  # cells between a tip and the next boundary, crack or tip
_KINK = 20.0  # cells of a crack's length at its kinks: stresses are singular there
_SLOPE = 0.4  # growth of cells a length


def first_mesh(problem: Problem, _: float) -> Mesh:
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
    distance_to_others = [float(np.linalg.norm(x - tip)) for tip in tips if (tip != x).any()]
    return min(distance + distance_to_others)


_ORDER = 2
_SWEEPS = 5
_GENTLER = 2  # times that the aim is doubled where the next mesh would be too large
_LEAST = 1.05  # cells of the next mesh over those of this one


def trusted_errors(indicators: Indicators, last_indicators: Indicators | None) -> Indicators:
    """Bars that also cover what the last refinement has changed.

    Two best values may differ by both bars. Where they differ by more, the estimates have missed
    something, and the bar grows by as much. Where faces press on each other at a kink it is at
    least the change itself.
    """
    if last_indicators is None:
        return indicators
    change = np.abs(indicators.K - last_indicators.K)
    is_bent = np.repeat(np.isin(_cracks(indicators), _bent_cracks(indicators)), _ends(indicators))[
        :, None
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = change / np.where(is_bent, indicators.bar, indicators.bar + last_indicators.bar)
    growth = np.where(growth > 1, growth, 1.0)
    if (growth == 1).all():
        return indicators
    rows = iter(np.split(growth, np.cumsum(_ends(indicators))[:-1]))
    by_crack = [
        {k: next(rows) for k in live_states(indicators)}
        for _ in range(len(indicators.problem.cracks))
    ]
    sifs = tuple(
        tuple(
            replace(sif, errors=KErrors(sif.eta, sif.bar * by_crack[c].get(k, 1.0), sif.reasons))
            for c, sif in enumerate(state)
        )
        for k, state in enumerate(indicators.sifs)
    )
    return replace(indicators, sifs=sifs, bar=indicators.bar * growth)


def _cracks(indicators: Indicators) -> list[int]:
    """Crack of each of these."""
    return [c for c in range(len(indicators.problem.cracks)) for _ in live_states(indicators)]


def _ends(indicators: Indicators) -> list[int]:
    """Number of tips of each crack and state, in the order of `best`."""
    return [
        len(indicators.sifs[k][c].K)
        for c in range(len(indicators.problem.cracks))
        for k in live_states(indicators)
    ]


def next_mesh(indicators: Indicators, tolerance: float, aim: float, most_cells: int) -> Mesh | None:
    """A finer mesh, or None where it would have too many unknowns."""
    mesh, scale = indicators.problem.mesh, indicators.scale
    unknowns_per_cell = indicators.solutions[0].space.n_dof / len(mesh.cells)
    for share in aim * 2.0 ** np.arange(1 + _GENTLER):
        target = tolerance * scale * share
        ratio = cell_ratios(indicators, target, 1.0)
        fine_mesh = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        while len(fine_mesh.cells) < _LEAST * len(mesh.cells):  # the bar does not follow the shares
            worst_cells = np.argsort(indicators.shares.max(axis=0, initial=0.0))[
                -(len(mesh.cells) // 10) - 1 :
            ]
            ratio[worst_cells] /= 2
            fine_mesh = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        if unknowns_per_cell * len(fine_mesh.cells) <= most_cells:
            return fine_mesh
    return None


def at_coarse_tips(indicators: Indicators) -> Floats:
    """Half of the size around tips that have no bar."""
    mesh = indicators.problem.mesh
    ratio = np.ones(len(mesh.cells))
    centre = mesh.cell_middles
    for sif in (sif for state in indicators.sifs for sif in state):
        for x, reason in zip(sif.x, sif.reasons, strict=True):
            distance = np.linalg.norm(centre - x, axis=1)
            is_near = distance <= 2 * mesh.cell_size[np.argmin(distance)]
            ratio[is_near & bool(reason)] = 0.5
    return ratio


def _bent_cracks(indicators: Indicators) -> tuple[int, ...]:
    """Cracks that press and have kinks, of whose pressures the estimates see a part only."""
    return tuple(
        c
        for c in indicators.pressed_cracks
        if len(kink_numbers(indicators.problem.placed[c].points))
    )


def cell_ratios(indicators: Indicators, target: float, aim: float) -> Floats:
    """Size of each cell in a finer mesh over its size in this one `(m,)`.

    Parameters
    ----------
    indicators : Indicators
    target : float, stress · √length
        Half-width that K is to have.
    aim : float
        Share of it that bars of the next mesh are foretold to have.
    """
    ratio = size_ratios(indicators.shares, indicators.bar.ravel(), aim * target, _ORDER, 2)
    return np.minimum(ratio, at_coarse_tips(indicators))


__all__ = [
    "at_coarse_tips",
    "cell_ratios",
    "first_mesh",
    "next_mesh",
    "size_ratios",
    "tip_sizes",
    "trusted_errors",
]
