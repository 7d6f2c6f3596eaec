"""Estimated errors of K at tips of solutions of order 2 in 2D."""

from collections.abc import Sequence
from dataclasses import dataclass

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.estimation.estimate import estimate
from xcrack.estimation.shape import crack_shape, rim_shape
from xcrack.sif.goal_2d import on_faces, tip_goal
from xcrack.threads import threads


@dataclass(frozen=True, eq=False)
class TipErrors:
    """Estimated errors of K_I and K_II at the tips of one crack, and where they come from.

    Attributes
    ----------
    eta : (states, tips, 2) array, stress · √length
        Signed estimate of exact K less K as the integrals gave it.
    shares : (states, tips, 2, cells) array, stress · √length
        Absolute contributions of the cells to it.
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
        result.end.reshape(shape),
        bend.reshape(shape),
        bend_bar.reshape(shape),
        rim.reshape(shape),
        chords.reshape(shape),
    )
