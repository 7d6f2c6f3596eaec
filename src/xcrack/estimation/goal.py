"""Functionals that are affine in a solution: a sum over points, and pressures on crack faces."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats, Ints
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.tabulated import Tabulated


@dataclass(frozen=True, eq=False)
class GoalPoints:
    """Points at which displacement gradients enter m functionals.

    Attributes
    ----------
    at : Tabulated
    factor : (q, 2, 2, m) array
        By component and derivative; weights included.
    """

    at: Tabulated
    factor: Floats


@dataclass(frozen=True, eq=False)
class GoalCells:
    """Plain cells over which m functionals are integrated with each function of order 2.

    Attributes
    ----------
    cells : (k,) array of int
    on_nodes : (k, 6, 2, m) array
        By shape function and component.
    on_surplus : (k, 4, 2, m) array
        By surplus function, the edges' in their local directions.
    turn : (m,) array
        Of a rigid rotation by minus one.
    """

    cells: Ints
    on_nodes: Floats
    on_surplus: Floats
    turn: Floats


@dataclass(frozen=True, eq=False)
class Goal:
    """m functionals J = f . u + g . p + a constant of the loads.

    Attributes
    ----------
    parts : tuple of GoalPoints
    cells : tuple of GoalCells
    rotation : (n_points, 2) array
        Mean rotation as a sum over the displacements of mesh points, which it is free of.
    crack : int
    m : int
        Number of functionals.
    on_faces : callable
        Makes `pressure`, which few estimates need.
    """

    parts: tuple[GoalPoints, ...]
    cells: tuple[GoalCells, ...]
    rotation: Floats
    crack: int
    m: int
    on_faces: Callable[[], Floats]

    @cached_property
    def pressure(self) -> Floats:
        """Factors of pressures on the faces of that crack, at their integration points `(q, m)`."""
        return self.on_faces()

    def on_functions(self, space: FunctionSpace) -> Floats:
        """The part f: each functional of each function and component `(n_dof, m)`."""
        from xcrack.kernels.goal import add_cells, add_to_functions

        total = np.zeros((space.n_functions, space.dim, self.m))
        turn = np.zeros(self.m)
        for part in self.parts:
            turn += (part.factor[:, 0, 1] - part.factor[:, 1, 0]).sum(axis=0)
            for batch, number, row, slope in part.at.batches:
                add_to_functions(total, batch.functions, row, number, slope, part.factor)
        for plain in self.cells:
            turn += plain.turn
            nodes = space.cell_nodes[plain.cells]
            add_cells(total, nodes, np.ones(nodes.shape), plain.on_nodes)
        total[: len(self.rotation)] += self.rotation[:, :, None] * turn
        return total.reshape(-1, self.m)

    def on_pressures(self, values: Floats) -> Floats:
        """The part g: each functional of each pressure function `(g, m)`, from its values."""
        return np.asarray(values.T @ self.pressure)

    def of(self, solution: Solution, pressure: Floats) -> Floats:
        """Value f . u + g . p, with pressures at the points of the faces `(m,)`."""
        f = self.on_functions(solution.space)
        return np.asarray(solution.u @ f + pressure @ self.pressure)
