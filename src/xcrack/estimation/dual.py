"""Dual solutions: influence functions of functionals, with closed crack faces kept closed.

In a state A u - N' p = f, N u = 0 on the closed groups; the functional is f_J . u + g_J . p. Then
A z + N' mu = f_J, N z = -g_J: of z0 = A^-1 f_J follow mu = F^-1 (N z0 + g_J) with F = N A^-1 N',
which the contact has made already, and z = z0 - A^-1 N' mu. One factor serves all of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.analysis.factored import Factored
from xcrack.arrays import Bools, Floats, Ints
from xcrack.contact.multipliers import gap_rows
from xcrack.estimation.goal import Goal
from xcrack.solvers.active_set import of_set
from xcrack.solvers.rigid_motion import without_motion
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.lips import LipPoints, arc_position


@dataclass(frozen=True, eq=False)
class Groups:
    """Contact groups of all cracks, one after the other.

    Attributes
    ----------
    N : sparse matrix (g, n_dof)
        Rows of the weak gaps.
    dual : (g, g) array
        F = N A^-1 N'.
    active : (states, g) array of bool
        The closed ones.
    pressure : (g, states) array, stress
    crack : (g,) array of int
    position : (g,) array, length
        Of each along its crack.
    piece : (g,) array of int
        Of the crack, between kinks.
    """

    N: sp.csr_matrix
    dual: Floats
    active: Bools
    pressure: Floats
    crack: Ints
    position: Floats
    piece: Ints


def groups_of(factored: Factored) -> Groups | None:
    """Contact groups of a solve; None where no crack has multipliers."""
    model, contact = factored.model, factored.contact
    parts = []
    for m, pressure, active in zip(contact.spaces, contact.pressure, contact.active, strict=True):
        if m is not None and pressure is not None and active is not None:
            lips = model.lips[m.crack]
            position = (m.values.T @ (lips.weight * lips.s)) / m.measure
            number = np.full(len(m.measure), m.crack)
            rows = gap_rows(m, lips, model.jumps[m.crack])
            piece = np.searchsorted(_kinks(model.space, m.crack, lips), position)
            parts.append((rows, active, pressure, number, position, piece))
    if not parts or contact.dual is None:
        return None
    every, closed, pressures, crack, position, piece = zip(*parts, strict=True)
    return Groups(
        sp.csr_matrix(sp.vstack(every)),
        contact.dual,
        np.concatenate(closed, axis=1),
        np.concatenate(pressures),
        np.concatenate(crack),
        np.concatenate(position),
        np.concatenate(piece),
    )


def _kinks(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Positions of the kinks of a cut, as those of the points on its faces."""
    line, kinks = space.cracks[c].points, space.cuts[c].kinks.points
    if not len(kinks):
        return np.zeros(0)
    begin = arc_position(line, lips.x[:1])[0] - lips.s[0]
    return np.asarray(np.sort(arc_position(line, kinks) - begin))


@dataclass(frozen=True, eq=False)
class Duals:
    """Dual solutions of all functionals in all states.

    Attributes
    ----------
    z : (sets, n_dof, m) array
    which : (states,) array of int
        States with the same closed groups share a set.
    mu : (sets, g, m) array
        Dual pressures of the groups.
    per_pressure : (g, m) array
        Change of each functional with the pressures, the displacements following: N z0 + g_J.
    """

    z: Floats
    which: Ints
    mu: Floats
    per_pressure: Floats


def duals(factored: Factored, groups: Groups | None, goals: Sequence[Goal]) -> Duals:
    """Dual solutions of the functionals of goals, one after the other in m.

    Parameters
    ----------
    factored : Factored
    groups : Groups or None
    goals : sequence of Goal
    """
    model, motion = factored.model, factored.motion
    f = np.concatenate([goal.on_functions(model.space) for goal in goals], axis=1)
    # Loads of a functional that no rigid motion changes: what is left of them is round-off.
    z0 = factored.engine.solve(f - motion.modes @ (motion.modes.T @ f))
    if groups is None:
        z = without_motion(motion, z0)[None]
        states = factored.contact.u.shape[1]
        nothing = np.zeros((0, f.shape[1]))
        return Duals(z, np.zeros(states, dtype=np.int64), nothing[None], nothing)
    per_pressure = groups.N @ z0 + _on_groups(factored, groups, goals)
    sets, which = np.unique(groups.active, axis=0, return_inverse=True)
    every, mus = [], []
    for active in sets:
        z, mu = z0, np.zeros_like(per_pressure)
        if active.any():
            columns = [of_set(groups.dual, -d, active)[0] for d in per_pressure.T]
            mu = np.stack(columns, axis=1)
            z = z0 - factored.engine.solve(groups.N.T @ mu)
        every.append(without_motion(motion, z))
        mus.append(mu)
    return Duals(np.stack(every), which.ravel(), np.stack(mus), per_pressure)


def _on_groups(factored: Factored, groups: Groups, goals: Sequence[Goal]) -> Floats:
    """g_J of the goals `(g, m)`."""
    columns = []
    for goal in goals:
        part = np.zeros((len(groups.crack), goal.m))
        space = factored.contact.spaces[goal.crack]
        if space is not None:
            part[groups.crack == goal.crack] = goal.on_pressures(space.values)
        columns.append(part)
    return np.concatenate(columns, axis=1)
