"""Bars of K in 2D where one solution gives none: a second one, with smaller cells there.

Cells that are too large for an estimate (a crack, or the room to a boundary, another tip, a kink or
another material, of less than a few of them) become small enough for it: K of the second solution
with its own bar is then what is known. Where nothing is estimated, cells along all faces become
smaller, and the change of K is the bar; with friction a small part of it, for most of a large
change is what the second solution mends, and what its cells and domains leave.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import XcrackError, XcrackWarning
from xcrack.estimate.dual import rubbing_end_changes
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.refinement import growing_sizes, refine
from xcrack.sif.domain_2d import domain_of, intensity_at_tip
from xcrack.sif.goal_2d import tip_goal
from xcrack.sif.sif import SIF, KErrors, bars_of, joined_sif

_GROWS = 0.3  # by which cells grow with the distance from where they are smallest
_HALF = 0.5  # of a cell, where nothing is estimated
# Of the change of both modes of K to the second solution: what is added, as squares are, where that
# has a bar of its own; of the largest change of a crack, least half-width where it has none.
_ADDED, _LEAST = 0.002, 0.75
# With friction the root of the sum of squares of parts of the largest change of a crack, the spread
# of both modes in the second solution, its largest K times (cell / length of the crack)^1.5, and
# what the ends of zones that stick, slip and are open change by a group.
_RUBBED_CHANGE, _RUBBED_SPREAD, _RUBBED_CELLS, _RUBBED_ENDS = 0.03, 1.8, 0.02, 0.5
# Reasons that smaller cells do not take away, and that the change of K does not show.
_STAYS = (
    "order 1", "contact by", "the faces press at the kink",
    "parts of the boundary look like chords", "is not isotropic",
)  # fmt: skip

Bars = Callable[[Sequence[Solution], Sequence[SIF], int], list[KErrors]]


@dataclass(frozen=True, eq=False)
class Places:
    """Where cells become smaller.

    Attributes
    ----------
    x : (k, 2) array, length
    size : (k,) array, length
        Longest edge wanted there.
    """

    x: Floats
    size: Floats


def has_help(reason: str) -> bool:
    """Whether smaller cells give a bar where there is none for a reason."""
    return bool(reason) and not any(words in reason for words in _STAYS)


def along_faces(solution: Solution) -> Places:
    """All crack faces, with cells of half the size."""
    x = np.concatenate([lips.x for lips in solution.lips])
    return Places(x, _HALF * cell_sizes(solution.problem.mesh, x))


def finer_solutions(solutions: Sequence[Solution], places: Places) -> list[Solution]:
    """The same states with smaller cells at some places, order 2; the factor is kept.

    Where these solutions kept theirs, the second ones stay with it: cracks share them.
    """
    factored = solutions[0].factored
    key = ("finer", tuple(s.number for s in solutions), places.x.tobytes(), places.size.tobytes())
    if factored is not None and key in factored.around_tips:
        refined_solutions: list[Solution] = factored.around_tips[key]
        return refined_solutions
    problem = solutions[0].problem
    mesh = refine(problem.mesh, size=growing_sizes(places.x, places.size, _GROWS))
    scene = replace(problem, mesh=mesh, order=2)
    result = solve_states(scene, [s.state for s in solutions], error=True)
    if factored is not None:
        factored.around_tips[key] = result
    return result


def bars_by_finer_cells(
    solutions: Sequence[Solution],
    sifs: Sequence[SIF],
    crack: int,
    places: Places,
    estimate: Bars,
) -> list[KErrors] | None:
    """Bars of one crack from a second solution; None where that is refused, or has other tips.

    All cracks of a scene take theirs from it, also those whose cells are small enough: what one
    crack lacks is in K of its neighbours.

    Parameters
    ----------
    solutions : sequence of Solution
    sifs : sequence of SIF
        One for each.
    crack : int
    places : Places
    estimate : callable
        Bars of the second solution by its factor.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", XcrackWarning)  # those of the first solution count
        try:
            finer_solutions_ = finer_solutions(solutions, places)
        except XcrackError:
            return None
        tips = finer_solutions_[0].space.tips_of(crack)
        by_tip = [intensity_at_tip(finer_solutions_, t)[0] for t in tips]
    if len(tips) != len(sifs[0].K):
        return None
    second_sifs = [
        joined_sif([states[k] for states in by_tip], 2) for k in range(len(finer_solutions_))
    ]
    of_second = estimate(finer_solutions_, second_sifs, crack)
    cells, ends = None, np.zeros((len(sifs), len(tips), 2))
    if finer_solutions_[0].has_friction:
        length = float(finer_solutions_[0].lips[crack].weight.sum())
        cells = np.array([domain_of(finer_solutions_[0], t).size for t in tips]) / length
        ends = rubbing_ends(finer_solutions_, crack)
    state_rows = zip(sifs, second_sifs, of_second, ends, strict=True)
    return [_from_second(*row, cells) for row in state_rows]


def rubbing_ends(solutions: Sequence[Solution], crack: int) -> Floats:
    """Change of K where a zone that sticks, slips or is open ends a function later or earlier.

    Parameters
    ----------
    solutions : sequence of Solution
        With friction, in 2D, of one solve that kept its factor.
    crack : int

    Returns
    -------
    (states, tips, 2) array, stress · √length
    """
    factored, tips = solutions[0].factored, solutions[0].space.tips_of(crack)
    shape = (len(solutions), len(tips), 2)
    if factored is None or not tips:
        return np.zeros(shape)
    goals = [tip_goal(solutions[0], t) for t in tips]
    return rubbing_end_changes(factored, goals, [s.number for s in solutions]).reshape(shape)


def _half_widths_of_change(change: Floats) -> Floats:
    """The change of K to the second solution, at least a share of the largest of the crack."""
    change_size = np.linalg.norm(change, axis=1, keepdims=True)
    return np.asarray(np.maximum(np.abs(change), _LEAST * change_size.max(initial=0.0)))


def _half_widths_of_friction(
    second_sif: SIF, change: Floats, ends: Floats, cells: Floats
) -> Floats:
    """What the second solution leaves: its change, spread, ends of zones, and cells per length."""
    largest_K = np.abs(second_sif.K).max(initial=0.0)
    parts = [
        np.full(len(cells), _RUBBED_CHANGE * np.abs(change).max(initial=0.0)),
        _RUBBED_SPREAD * np.linalg.norm(second_sif.spread, axis=1),
        _RUBBED_ENDS * np.linalg.norm(ends, axis=1),
        _RUBBED_CELLS * largest_K * cells**1.5,
    ]
    half = np.sqrt(np.sum(np.square(parts), axis=0))
    return np.asarray(np.repeat(half[:, None], change.shape[1], axis=1))


def _from_second(
    sif: SIF, second_sif: SIF, of_second: KErrors, ends: Floats, cells: Floats | None
) -> KErrors:
    """Bars of one state from the second solution; with friction by ends and cells per length."""
    reasons_that_stay = ["" if has_help(reason) else reason for reason in of_second.reasons]
    is_known: Bools = np.array([not reason for reason in of_second.reasons], dtype=bool)
    best_K = np.where(is_known[:, None], second_sif.K + of_second.eta, second_sif.K)
    eta = best_K - sif.K
    eta[sif.closed, 0] = 0.0  # K_I of closed tips is zero
    eta_size = np.linalg.norm(eta, axis=1, keepdims=True)
    half = (
        _half_widths_of_change(eta)
        if cells is None
        else _half_widths_of_friction(second_sif, eta, ends, cells)
    )
    bar_of_second = np.hypot(of_second.bar, _ADDED * eta_size)
    bar = np.where(is_known[:, None], bar_of_second, half)
    K_if_open = np.maximum(np.abs(sif.K_integral[:, 0]), np.abs(best_K[:, 0]))
    bar[sif.closed, 0] = K_if_open[sif.closed]
    contact = np.zeros_like(bar) if of_second.contact is None else np.array(of_second.contact)
    return bars_of(eta, bar, reasons_that_stay, np.where(is_known[:, None], contact, 0.0))


__all__: list[str] = []
