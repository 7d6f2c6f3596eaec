"""Errors of a solution against a known field."""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from xcrack.analysis.solution import SolutionArgument
from xcrack.base.arguments import Function, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import ProblemError
from xcrack.fem.loads import position
from xcrack.fem.quadrature import cell_points

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
        exact = numbers(result, "energy_error: the stress at points (n, d)", (*x.shape, x.shape[1]))
        difference = exact - solution.stress_at(points.cell, points.bary, points.side)
        where = points.cell, points.bary
        error += _energy(elasticity.strain(difference, *where), difference, points.weight)
        total += _energy(elasticity.strain(exact, *where), exact, points.weight)
    if not total > 0:
        raise ProblemError(
            "energy_error: the exact stress is zero everywhere, so there is no relative error."
        )
    return float(np.sqrt(error / total))


def _energy(strain: Floats, stress: Floats, weight: Floats) -> float:
    return float(np.einsum("q,qij,qij->", weight, strain, stress))
