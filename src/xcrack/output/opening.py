"""How far a crack gapes, how compliant the body is, and how far a solution is from a known one."""

from collections.abc import Callable
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, SolutionArgument
from xcrack.base.arguments import Function, Number, Points, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import FORCE
from xcrack.crack.measures import measures
from xcrack.fem.loads import position
from xcrack.fem.quadrature import cell_points
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
        points, is_single = _mouths(solution, c), False
    else:
        places = np.asarray(x)
        is_single, points = places.ndim == 1, np.atleast_2d(places)
        if points.ndim != 2 or points.shape[1] != d:
            raise ProblemError(
                f"crack_opening: x has the shape {places.shape}: give points (n, {d}) or one."
            )
    lips = solution.lips[c]
    distance, nearest_rows = cKDTree(lips.x).query(points)
    normal = lips.normal[nearest_rows]
    normal_distance = np.abs(np.einsum("qd,qd->q", points - lips.x[nearest_rows], normal))
    if (normal_distance > 0.5 * distance + _NEAR * solution.problem.mesh.extent).any():
        farthest_point = points[int(np.argmax(normal_distance))]
        raise ProblemError(
            f"crack_opening: {np.round(farthest_point, 9).tolist()} does not lie on crack {c}: "
            f"give points on it, or leave x out for its mouths."
        )
    jump = solution.displacement(points, side=1) - solution.displacement(points, side=-1)
    opening = np.einsum("qd,qd->q", jump, normal)
    return opening[0] if is_single else opening


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


# --- errors of a solution against a known field ---


_CHUNK = 20_000  # cells integrated at once; bounds the memory
_STRESS = "a function f(x) of points (n, d) that returns (n, d, d)"


@check_arguments()
def energy_error(
    solution: SolutionArgument,
    stress: Annotated[Callable[[Floats], Floats], Function(_STRESS)],
) -> float:
    """Relative error in the energy norm, integrated on the cut sub-cells.

    Parameters
    ----------
    solution : Solution
    stress : callable
        f(x) -> (n, d, d), the exact stress at points (n, d).

    Returns
    -------
    float
        sqrt(int (sigma - sigma_h) : C^-1 : (sigma - sigma_h)) / sqrt(int sigma : C^-1 : sigma).

    Raises
    ------
    ProblemError
        Values of another shape or not finite, or an exact stress that is zero everywhere.
    """
    space, elasticity = solution.space, solution.problem.elasticity
    error = total = 0.0
    for first in range(0, len(space.mesh.cells), _CHUNK):
        cells = np.arange(first, min(first + _CHUNK, len(space.mesh.cells)))
        points = cell_points(space, cells, 8, 2 * space.order + 2)
        x = position(space, points.cell, points.bary)
        result = call_function(stress, "the exact stress of energy_error", x)
        exact_stress = numbers(
            result, "energy_error: the stress at points (n, d)", (*x.shape, x.shape[1])
        )
        difference = exact_stress - solution.stress_at(points.cell, points.bary, points.side)
        places = points.cell, points.bary
        error += _energy(elasticity.strain(difference, *places), difference, points.weight)
        total += _energy(elasticity.strain(exact_stress, *places), exact_stress, points.weight)
    if not total > 0:
        raise ProblemError(
            "energy_error: the exact stress is zero everywhere, so there is no relative error."
        )
    return float(np.sqrt(error / total))


def _energy(strain: Floats, stress: Floats, weight: Floats) -> float:
    return float(np.einsum("q,qij,qij->", weight, strain, stress))


__all__ = ["compliance", "crack_opening"]
