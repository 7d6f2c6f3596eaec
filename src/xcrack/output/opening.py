"""How far a crack gapes, and how compliant it makes the body: what clip gauges measure."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, SolutionArgument
from xcrack.base.arguments import Number, Points, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError
from xcrack.base.units import FORCE
from xcrack.crack.measures import measures
from xcrack.model.problem import CrackNumber, crack_number

_NEAR = 1e-6  # of the body: points that lie on a crack


@check_arguments()
def crack_opening(
    solution: SolutionArgument,
    x: Annotated[ArrayLike | None, Points()] = None,
    crack: CrackNumber = 0,
) -> Floats:
    """Distance of the crack faces at points of a crack: CMOD at its mouth, COD elsewhere.

    Parameters
    ----------
    solution : Solution
    x : (n, d) array, or one point (d,), length, optional
        On the crack, inside of the body or on its boundary. If omitted, in 2D all mouths.
    crack : int

    Returns
    -------
    (n,) array, length
        n . (u of face + less u of face -); for one point a number.

    Raises
    ------
    ProblemError
        Points that do not lie on the crack; a crack without mouths, or one in 3D, where x is left
        out.
    """
    c = crack_number(solution.problem, crack, "crack_opening")
    d = solution.space.dim
    if x is None:
        points, single = _mouths(solution, c), False
    else:
        given = np.asarray(x)
        single, points = given.ndim == 1, np.atleast_2d(given)
        if points.ndim != 2 or points.shape[1] != d:
            raise ProblemError(
                f"crack_opening: x has the shape {given.shape}: give points (n, {d}), or one point."
            )
    lips = solution.lips[c]
    distance, nearest = cKDTree(lips.x).query(points)
    normal = lips.normal[nearest]
    normal_distance = np.abs(np.einsum("qd,qd->q", points - lips.x[nearest], normal))
    if (normal_distance > 0.5 * distance + _NEAR * solution.problem.mesh.extent).any():
        farthest = points[int(np.argmax(normal_distance))]
        raise ProblemError(
            f"crack_opening: {np.round(farthest, 9).tolist()} does not lie on crack {c}: give "
            f"points on it, or leave x out for its mouths."
        )
    jump = solution.displacement(points, side=1) - solution.displacement(points, side=-1)
    opening = np.einsum("qd,qd->q", jump, normal)
    return opening[0] if single else opening


def _mouths(solution: Solution, c: int) -> Floats:
    problem = solution.problem
    if problem.placed[c].fronts is not None:
        raise ProblemError("crack_opening: in 3D the mouth is a line: give x, points on it.")
    ends = measures(problem.placed[c], problem.mesh).ends
    if not ends:
        raise ProblemError(
            f"crack_opening: crack {c} has no mouth, both of its ends lie inside the body: give x."
        )
    return np.array([end.x for end in ends])


@check_arguments()
def compliance(
    solution: SolutionArgument,
    force: Annotated[float, Number(unit=FORCE)],
) -> float:
    """Displacement of the loads over their force, from the strain energy: 2 U / P².

    Parameters
    ----------
    solution : Solution
        Of a body whose loads are in proportion to one force, or that is pulled by a displacement.
    force : float, force
        P of this state; in 2D for unit thickness.

    Returns
    -------
    float, length/force

    Raises
    ------
    ProblemError
        A force that is 0, initial stress.

    Notes
    -----
    P times its displacement is twice the strain energy, with contact of the crack faces too (its
    forces act where the gap is zero). G = P²/2 dC/da (Irwin and Kies 1954) is G of
    `energy_release_rate` found another way: from two solutions instead of K.
    """
    if force == 0:
        raise ProblemError("compliance: force = 0: give the force of this load state.")
    if any("initial_stress" in load.acts for load in solution.loads):
        raise ProblemError(
            "compliance: initial stress has energy without a force: leave it out of the problem."
        )
    return float(2 * solution.energy / force / force)


__all__ = ["compliance", "crack_opening"]
