"""Dual-weighted residuals in the surplus space: signed estimates, and their shares by cell.

eta = r_z . e_u with the residuals of the solution and of the dual one in the surplus space and
e_u = (blocks of its stiffness)^-1 r_u (after Becker and Rannacher, 2001, Acta Numerica 10, 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.contact import Contact
from xcrack.analysis.solution import FactoredSolution, Solution
from xcrack.base.arrays import Floats
from xcrack.estimate.dual import Goal, duals, end_changes, groups_of
from xcrack.estimate.surplus import (
    HierarchicalSurplus,
    face_residual,
    goal_residual,
    imposed_coefficients,
    load_residual,
    residuals,
    shares,
    solve_surplus,
    surplus,
)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated errors of m functionals in some states.

    Attributes
    ----------
    eta : (states, m) array
        Exact value less computed one.
    shares : (states, m, cells) array
        Absolute contributions of the cells to eta: they add up to more than it.
    surplus : HierarchicalSurplus
    parts : (states, n, m) array
        Contributions of the surplus functions to eta.
    end : (states, m) array
        What a group more and one less at the ends of contact change; see `end_changes`.
    z : (states, n_dof, m) array
        Dual solutions.
    mu : tuple of (states, q, m) arrays
        Dual pressures on the faces of each crack, at their points.
    """

    eta: Floats
    shares: Floats
    surplus: HierarchicalSurplus
    parts: Floats
    end: Floats
    z: Floats
    mu: tuple[Floats, ...]


def estimate(
    factored: FactoredSolution, solutions: Sequence[Solution], goals: Sequence[Goal]
) -> Estimate:
    """Estimated errors of the functionals of goals, one after the other in m.

    Parameters
    ----------
    factored : FactoredSolution
        Of the solve that gave the solutions.
    solutions : sequence of Solution
        Some of its states; order 2 in 2D.
    goals : sequence of Goal
    """
    space = factored.model.space
    groups = groups_of(factored)
    dual = duals(factored, groups, goals)
    w = surplus(space, factored.model.imposed_values.is_fixed)
    m = dual.z.shape[2]
    sets = np.unique(dual.set_number[[s.number for s in solutions]])
    columns = [np.stack([s.u for s in solutions], axis=1), *dual.z[sets]]
    values_at_nodes = np.concatenate(columns, axis=1).reshape(space.n_functions, 2, -1)
    values_at_nodes = np.concatenate([values_at_nodes, np.zeros((1, *values_at_nodes.shape[1:]))])
    residual, blocks = residuals(w, solutions[0].problem.elasticity, values_at_nodes)
    r_u, r_z = residual[:, :, : len(solutions)], residual[:, :, len(solutions) :]
    for k, solution in enumerate(solutions):
        r_u[:, :, k] += load_residual(w, solution)
    for c, lips in enumerate(factored.model.lips):
        pressure = np.stack([pressure_on(s, c) for s in solutions], axis=1)
        if pressure.any():
            r_u += face_residual(w, lips, pressure)
    e_u = solve_surplus(w, blocks, r_u)
    imposed_values = [imposed_coefficients(w, s) for s in solutions]
    goal = np.concatenate([goal_residual(w, g) for g in goals], axis=2)
    mus = tuple(np.zeros((len(solutions), len(lips), m)) for lips in factored.model.lips)
    eta, end = np.zeros((2, len(solutions), m))
    by_cell = np.zeros((len(solutions), m, len(space.mesh.cells)))
    parts = np.zeros((len(solutions), len(w.is_fixed), m))
    for k, solution in enumerate(solutions):
        set_number = int(dual.set_number[solution.number])
        place = int(np.searchsorted(sets, set_number)) * m
        r = r_z[:, :, place : place + m] + goal
        for c, lips in enumerate(factored.model.lips):
            contact = factored.contact.spaces[c]
            if groups is not None and contact is not None:
                mu = contact.values @ dual.mu[set_number][groups.crack == c]
                mus[c][k] = mu
                if mu.any():
                    r -= face_residual(w, lips, mu)
        contributions = np.einsum("nim,ni->nm", r, e_u[:, :, k] + imposed_values[k])
        eta[k] = contributions.sum(axis=0)
        parts[k], by_cell[k] = contributions, shares(w, contributions).T
        if groups is not None:
            end[k] = end_changes(groups, dual, groups.N @ solution.u, solution.number)
    numbers = [s.number for s in solutions]
    return Estimate(eta, by_cell, w, parts, end, dual.z[dual.set_number[numbers]], mus)


def pressure_on(solution: Solution, c: int) -> Floats:
    """Pressure on the faces of crack c at their points, of contact and given `(q,)`."""
    contact: Contact | None = solution.contact[c]
    total = given_pressure(solution, c, solution.lips[c].x)
    return total if contact is None else total + contact.pressure


def given_pressure(solution: Solution, c: int, x: Floats) -> Floats:
    """Pressure that the loads of a state give at places on the faces of crack c `(q,)`."""
    total = np.zeros(len(x))
    for load, factor in solution.acting:
        pressure = load.face_pressure(x, c) if "face_pressure" in load.acts else None
        if pressure is not None:
            total += factor * pressure
    return total
