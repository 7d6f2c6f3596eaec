"""Cells and points of the domain around a tip, for K and for the estimate of its error."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats, Ints
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.quadrature import Points, cell_points
from xcrack.xfem.tabulated import Tabulated, tabulated

# Cells up to a share of the outer radius: points a direction with tip functions, degree without.
_DEGREES = ((0.0, 0.03, 4, 4), (0.03, 0.1, 5, 6), (0.1, 0.25, 5, 8), (0.25, np.inf, 5, 10))
_CHUNK = 4000  # cells integrated at once; bounds the memory


@dataclass(frozen=True, eq=False)
class RingPart:
    """Cells of one class.

    Attributes
    ----------
    plain : (k,) array of int
        On which no enriched function acts.
    degree : int
        Of the rule for them.
    others : iterable of Tabulated
        Points of the other cells.
    """

    plain: Ints
    degree: int
    others: Iterable[Tabulated]


def ring_parts(solution: Solution, t: int, hollow: float, outer: float) -> Iterable[RingPart]:
    """Cells around tip t by class, with points and functions where functions are enriched.

    Where the solve keeps its factor for estimates, these points stay with it too: K and the
    estimate of its error share them.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the tip in `space.tips`.
    hollow, outer : float, length
        Radii between which the cells lie.
    """
    parts, factored = _ring_parts(solution.space, t, hollow, outer), solution.factored
    if factored is None:
        return parts
    key = t, hollow, outer
    stored: Iterable[RingPart] | None = factored.around_tips.get(key)
    if stored is None:
        stored = tuple(parts)
        # More than one chunk of cells is too much to be stored.
        if all(isinstance(part.others, tuple) for part in stored):
            factored.around_tips[key] = stored
    return stored


def _ring_parts(space: FunctionSpace, t: int, hollow: float, outer: float) -> Iterator[RingPart]:
    for cells, n, degree in ring_classes(space, space.tips[t].x, hollow, outer):
        plain = space.signature[cells] == 0
        others = cells[~plain]
        points = (tabulated(space, p) for p in class_points(space, others, n, degree))
        few = len(others) <= _CHUNK
        yield RingPart(cells[plain], degree, tuple(points) if few else points)


def ring_classes(
    space: FunctionSpace, centre: Floats, hollow: float, radius: float
) -> Iterator[tuple[Ints, int, int]]:
    """Cells between two radii by size, points a direction with tip functions, degree without."""
    from xcrack.kernels.ring import cells_between

    mesh = space.mesh
    near = cells_between(mesh.points, mesh.cells, mesh.cell_size, centre, hollow, radius)
    share = mesh.cell_size[near] / radius
    for low, high, n, degree in _DEGREES:
        cells = near[(share > low) & (share <= high)]
        if len(cells):
            yield cells, n, degree


def class_points(space: FunctionSpace, cells: Ints, n: int, degree: int) -> Iterator[Points]:
    """Integration points of cells, of some cells at once."""
    for first in range(0, len(cells), _CHUNK):
        yield cell_points(space, cells[first : first + _CHUNK], n, degree)
