"""Errors of a solution against a known field."""

from collections.abc import Callable

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.xfem.loads import position
from xcrack.xfem.quadrature import cell_points

_CHUNK = 20_000  # cells integrated at once; bounds the memory


def energy_error(solution: Solution, stress: Callable[[Floats], Floats]) -> float:
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
    """
    space, material = solution.space, solution.problem.material
    error = total = 0.0
    for first in range(0, len(space.mesh.cells), _CHUNK):
        cells = np.arange(first, min(first + _CHUNK, len(space.mesh.cells)))
        points = cell_points(space, cells, 8, 2 * space.order + 2)
        x = position(space, points.cell, points.bary)
        exact = np.asarray(stress(x), dtype=float)
        computed = solution.stress_at(points.cell, points.bary, points.side)
        difference = exact - computed
        error += _energy(material.strain(difference), difference, points.weight)
        total += _energy(material.strain(exact), exact, points.weight)
    return float(np.sqrt(error / total))


def _energy(strain: Floats, stress: Floats, weight: Floats) -> float:
    return float(np.einsum("q,qij,qij->", weight, strain, stress))
