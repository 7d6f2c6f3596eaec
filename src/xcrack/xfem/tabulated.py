"""Points in cells together with the functions that act there, for sums over several columns."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.xfem.function_space import Batch, FunctionSpace
from xcrack.xfem.quadrature import Points


@dataclass(frozen=True, eq=False)
class Tabulated:
    """Integration points with the gradients of the functions there.

    Attributes
    ----------
    points : Points
    batches : tuple of (batch, number, row, slope)
        Each serves the points of the given numbers `(k,)`: their cells' rows in the batch `(k,)`,
        and the gradients of its functions `(k, n, d)`.
    """

    points: Points
    batches: tuple[tuple[Batch, Ints, Ints, Floats], ...]

    def gradients(self, coefficients: Floats) -> Floats:
        """Gradients of displacements `(q, d, d, s)` from the unknowns by function `(f, d, s)`."""
        from xcrack.kernels.fields import set_gradients

        coefficients = np.ascontiguousarray(coefficients)
        d, states = coefficients.shape[1:]
        gradient = np.zeros((len(self.points.cell), d, d, states))
        for batch, number, row, slope in self.batches:
            set_gradients(gradient, number, slope, batch.functions, row, coefficients)
        return gradient


def tabulated(space: FunctionSpace, points: Points) -> Tabulated:
    """The functions of a space at points.

    Parameters
    ----------
    space : FunctionSpace
    points : Points
    """
    batches = []
    for batch, number, row in space.batches_of_points(points.cell):
        _, slope = space.tabulate(batch, row, points.bary[number], points.side[number])
        batches.append((batch, number, row, slope))
    return Tabulated(points, tuple(batches))
