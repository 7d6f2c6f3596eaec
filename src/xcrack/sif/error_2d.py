"""Estimated errors of K at tips of solutions of order 2 in 2D."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.crack.kinks_2d import kink_numbers
from xcrack.errors import ProblemError
from xcrack.estimation.estimate import Estimate, estimate
from xcrack.estimation.shape import crack_shape, rim_shape
from xcrack.estimation.surplus import shares
from xcrack.mesh.locate import cell_sizes, contains
from xcrack.sif.goal_2d import on_faces, tip_goal
from xcrack.threads import threads

_NEAR = 1.5  # cells: the middles of those at a kink


@dataclass(frozen=True, eq=False)
class TipErrors:
    """Estimated errors of K_I and K_II at the tips of one crack, and where they come from.

    Attributes
    ----------
    eta : (states, tips, 2) array, stress · √length
        Signed estimate of exact K less K as the integrals gave it.
    shares : (states, tips, 2, cells) array, stress · √length
        Absolute contributions of the cells to it.
    kinks : (states, tips, 2) array, stress · √length
        Those of the cells at kinks, with functions and their copies taken together.
    end : (states, tips, 2) array, stress · √length
        What moving the ends of contact by a group does; see `contact_end.end_changes`.
    bend, rim : (states, tips, 2) arrays, stress · √length
        Signed change of K with the crack as given, not rounded by the cut, and with boundaries on
        the curves that the mesh knows.
    bend_bar : (states, tips, 2) array, stress · √length
        Half-width of the error of `bend`.
    chords : (states, tips, 2) array, stress · √length
        As `rim`, of boundaries that look like chords of curves that it does not know.
    """

    eta: Floats
    shares: Floats
    kinks: Floats
    end: Floats
    bend: Floats
    bend_bar: Floats
    rim: Floats
    chords: Floats


def tip_errors(solutions: Sequence[Solution], crack: int) -> TipErrors:
    """Estimates for the tips of one crack, in the order of `stress_intensities`.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one solve that kept its factor, of order 2 in 2D.
    crack : int
        With at least one tip.

    Raises
    ------
    ProblemError
        The factor is gone.
    """
    factored = solutions[0].factored
    if factored is None:
        raise ProblemError("no factor was kept: solve(..., error=True) keeps it.")
    space = solutions[0].space
    tips = [t for t, tip in enumerate(space.tips) if tip.crack == crack]
    with threads(solutions[0].problem.numerics.threads):
        result = estimate(factored, solutions, [tip_goal(solutions[0], t) for t in tips])
        bend, bend_bar = crack_shape(solutions, result, crack, lambda: on_faces(solutions[0], tips))
        rim, chords = rim_shape(solutions, result.z)
    shape = (len(solutions), len(tips), 2)
    return TipErrors(
        result.eta.reshape(shape),
        result.shares.reshape(*shape, -1),
        _at_kinks(solutions[0], result, crack).reshape(shape),
        result.end.reshape(shape),
        bend.reshape(shape),
        bend_bar.reshape(shape),
        rim.reshape(shape),
        chords.reshape(shape),
    )


def kinks_inside(solution: Solution, crack: int) -> Floats:
    """Kinks of a crack in the body `(k, 2)`."""
    points = solution.space.cracks[crack].points
    kinks = points[kink_numbers(points)]
    return np.asarray(kinks[contains(solution.problem.mesh, kinks)] if len(kinks) else kinks)


def _at_kinks(solution: Solution, result: Estimate, crack: int) -> Floats:
    """Absolute contributions of the cells at the kinks of a crack `(states, m)`."""
    mesh, kinks = solution.problem.mesh, kinks_inside(solution, crack)
    if not len(kinks):
        return np.zeros_like(result.eta)
    middle = mesh.points[mesh.cells].mean(axis=1)
    away = np.linalg.norm(middle[:, None] - kinks, axis=2)
    near = (away < _NEAR * cell_sizes(mesh, kinks)).any(axis=1)
    every = [shares(result.surplus, parts, together=True)[near] for parts in result.parts]
    return np.asarray(np.sum(every, axis=1))
