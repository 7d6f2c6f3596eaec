"""Dual solutions: influence functions of functionals, with closed crack faces kept closed.

In a state A u - N' p = f, N u = 0 on the closed groups; the functional is f_J . u + g_J . p. Then
A z + N' mu = f_J, N z = -g_J: of z0 = A^-1 f_J follow mu = F^-1 (N z0 + g_J) with F = N A^-1 N',
which the contact has made already, and z = z0 - A^-1 N' mu. One factor serves all of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from xcrack.analysis.multipliers import gap_rows
from xcrack.analysis.solution import FactoredSolution, Solution
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.fem.assembly import Tabulated
from xcrack.fem.facets import LipPoints, arc_position
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.active_set import of_set
from xcrack.linalg.coulomb import Status, of_status
from xcrack.linalg.rigid_motion import without_motion

# Functionals that are affine in a solution: a sum over points, and pressures on crack faces.


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
    """m functionals J = f . u + g . p + h . t + a constant of the loads, with shear t.

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
        Makes factors of pressures and shear, which few estimates need.
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
        return np.asarray(self.on_faces()[0])

    @cached_property
    def shear(self) -> Floats:
        """Factors of shear on lip +, along the tangents of friction `(q, m)`."""
        return np.asarray(self.on_faces()[1])

    def on_functions(self, space: FunctionSpace) -> Floats:
        """The part f: each functional of each function and component `(n_dof, m)`."""
        from xcrack.estimate.kernels.goal import add_cells, add_to_functions

        total = np.zeros((space.n_functions, space.dim, self.m))
        turn = np.zeros(self.m)
        for part in self.parts:
            turn += (part.factor[:, 0, 1] - part.factor[:, 1, 0]).sum(axis=0)
            for batch, number, row, slope in part.at.batches:
                add_to_functions(total, batch.functions, row, number, slope, part.factor)
        for cell_group in self.cells:
            turn += cell_group.turn
            nodes = space.cell_nodes[cell_group.cells]
            add_cells(total, nodes, np.ones(nodes.shape), cell_group.on_nodes)
        total[: len(self.rotation)] += self.rotation[:, :, None] * turn
        return total.reshape(-1, self.m)

    def on_pressures(self, values: Floats) -> Floats:
        """The part g: each functional of each pressure function `(g, m)`, from its values."""
        return np.asarray(values.T @ self.pressure)

    def on_shears(self, values: Floats) -> Floats:
        """The part h: each functional of the shear of each function `(g, m)`, from its values."""
        return np.asarray(values.T @ self.shear)

    def of(self, solution: Solution, pressure: Floats, shear: Floats | None = None) -> Floats:
        """Value f . u + g . p + h . t, with tractions at the points of the faces `(m,)`."""
        f = self.on_functions(solution.space)
        value = solution.u @ f + pressure @ self.pressure
        return np.asarray(value if shear is None else value + shear @ self.shear)


@dataclass(frozen=True, eq=False)
class GoalGroups:
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
        Of the crack, between kinks and the ends of other cracks on it.
    """

    N: sp.csr_matrix
    dual: Floats
    active: Bools
    pressure: Floats
    crack: Ints
    position: Floats
    piece: Ints


def groups_of(factored: FactoredSolution) -> GoalGroups | None:
    """Contact groups of a solve; None where no crack has multipliers."""
    model, contact = factored.model, factored.contact
    parts = []
    for m, pressure, is_active in zip(
        contact.spaces, contact.pressure, contact.active, strict=True
    ):
        if m is not None and pressure is not None and is_active is not None:
            rows = gap_rows(m, model.lips[m.crack], model.jumps[m.crack])
            parts.append((rows, is_active, pressure))
    if not parts or contact.dual is None:
        return None
    all_rows, is_closed, pressures = zip(*parts, strict=True)
    crack, position, piece = zip(*_places(factored), strict=True)
    return GoalGroups(
        sp.csr_matrix(sp.vstack(all_rows)),
        contact.dual,
        np.concatenate(is_closed, axis=1),
        np.concatenate(pressures),
        np.concatenate(crack),
        np.concatenate(position),
        np.concatenate(piece),
    )


def _places(factored: FactoredSolution) -> list[tuple[Ints, Floats, Ints]]:
    """Crack, position and piece of the groups of each crack that has some; see `GoalGroups`."""
    model, result = factored.model, []
    for m in factored.contact.spaces:
        if m is not None:
            lips = model.lips[m.crack]
            position = (m.values.T @ (lips.weight * lips.s)) / m.measure
            piece = np.searchsorted(_breaks(model.space, m.crack, lips), position)
            result.append((np.full(len(m.measure), m.crack), position, piece))
    return result


def _breaks(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Positions of the kinks of a cut and of the cracks that end on it, as those of its points."""
    line = space.cracks[c].points
    ends = [joint.x for joint in space.joints if joint.on == c]
    x = np.array([*space.cuts[c].kinks.points, *ends]).reshape(-1, 2)
    if not len(x):
        return np.zeros(0)
    begin = arc_position(line, lips.x[:1])[0] - lips.s[0]
    return np.asarray(np.sort(arc_position(line, x) - begin))


@dataclass(frozen=True, eq=False)
class DualSolutions:
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
    set_number: Ints
    mu: Floats
    per_pressure: Floats


def duals(
    factored: FactoredSolution, groups: GoalGroups | None, goals: Sequence[Goal]
) -> DualSolutions:
    """Dual solutions of the functionals of goals, one after the other in m.

    Parameters
    ----------
    factored : FactoredSolution
    groups : GoalGroups or None
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
        return DualSolutions(z, np.zeros(states, dtype=np.int64), nothing[None], nothing)
    per_pressure = groups.N @ z0 + _on_groups(factored, groups.crack, goals, Goal.on_pressures)
    sets, set_number = np.unique(groups.active, axis=0, return_inverse=True)
    zs, mus = [], []
    for is_active in sets:
        z, mu = z0, np.zeros_like(per_pressure)
        if is_active.any():
            columns = [of_set(groups.dual, -d, is_active)[0] for d in per_pressure.T]
            mu = np.stack(columns, axis=1)
            z = z0 - factored.engine.solve(groups.N.T @ mu)
        zs.append(without_motion(motion, z))
        mus.append(mu)
    return DualSolutions(np.stack(zs), set_number.ravel(), np.stack(mus), per_pressure)


def _on_groups(
    factored: FactoredSolution,
    crack: Ints,
    goals: Sequence[Goal],
    on_functions: Callable[[Goal, Floats], Floats],
) -> Floats:
    """Tractions of groups, of which the cracks are given, in the goals `(g, m)`."""
    columns = []
    for goal in goals:
        part = np.zeros((len(crack), goal.m))
        space = factored.contact.spaces[goal.crack]
        if space is not None:
            part[crack == goal.crack] = on_functions(goal, space.values)
        columns.append(part)
    return np.concatenate(columns, axis=1)


# The end of contact: what functionals would be with the contact a group longer or shorter.


def end_changes(groups: GoalGroups, duals: DualSolutions, gap: Floats, k: int) -> Floats:
    """What a group more and one less do at the ends of contact: 1 / (1/|dJ+| + 1/|dJ-|) `(m,)`.

    The end is between the two. Where one of the changes is small the end is near, however far off
    the other would be: one group more at a wide gap, say. Contact that ends at a kink, or where
    another crack ends on this one, ends where it should.

    Parameters
    ----------
    groups : GoalGroups
    duals : DualSolutions
    gap : (g,) array
        Weak gaps of the state.
    k : int
        State.
    """
    is_active, pressure = groups.active[k], groups.pressure[:, k]
    gap_without_group = gap - groups.dual @ pressure

    def change_with(group: int, neighbour: int) -> Floats:
        is_active_then = is_active.copy()
        is_active_then[group] = is_active[neighbour]
        pressure_change = of_set(groups.dual, gap_without_group, is_active_then)[0] - pressure
        return np.asarray(duals.per_pressure.T @ pressure_change)

    place = groups.crack, groups.position, groups.piece
    return _sum_at_ends(is_active, place, change_with, duals.per_pressure.shape[1])


def _sum_at_ends(
    status: Ints | Bools,
    place: tuple[Ints, Floats, Ints],
    change_with: Callable[[int, int], Floats],
    m: int,
) -> Floats:
    """1 / (1/|a| + 1/|b|) over neighbours of other status on one piece of a crack `(m,)`.

    a is the change if one takes the status of the other, b if the other takes that of the one.
    """
    crack, position, piece = place
    order, total = np.lexsort((position, crack)), np.zeros(m)
    same_piece = (np.diff(crack[order]) == 0) & (np.diff(piece[order]) == 0)
    for end in np.nonzero((status[order][1:] != status[order][:-1]) & same_piece)[0]:
        pair = order[end], order[end + 1]
        change, opposite_change = np.abs(change_with(*pair)), np.abs(change_with(*pair[::-1]))
        change_sum = change + opposite_change
        total += change * opposite_change / np.where(change_sum > 0, change_sum, 1.0)
    return total


# With friction a function may stick (0), slip either way (-1, 1), or be open.
_OPEN = 2


def rubbing_end_changes(
    factored: FactoredSolution, goals: Sequence[Goal], states: Sequence[int]
) -> Floats:
    """As `end_changes`, of the ends of zones that stick, slip and are open `(states, m)`.

    Of two neighbours one takes the status of the other, and then the other that of the one.

    Parameters
    ----------
    factored : FactoredSolution
        With friction, of multipliers.
    goals : sequence of Goal
        Their functionals one after the other in m.
    states : sequence of int
    """
    rubbing_states, motion = factored.contact.rubbing_states, factored.motion
    if rubbing_states is None:
        return np.zeros((len(states), sum(goal.m for goal in goals)))
    f = np.concatenate([goal.on_functions(factored.model.space) for goal in goals], axis=1)
    z = factored.engine.solve(f - motion.modes @ (motion.modes.T @ f))
    crack, position, piece = (np.concatenate(part) for part in zip(*_places(factored), strict=True))
    rows, change = rubbing_states.rows, rubbing_states.change
    of_pressure = _on_groups(factored, crack, goals, Goal.on_pressures)
    of_shear = _on_groups(factored, crack, goals, Goal.on_shears)[rows.rubbing_rows]
    per_traction = rubbing_states.N @ z + np.concatenate([of_pressure, of_shear])

    def of_state(k: int) -> Floats:
        slip = np.zeros(rows.n, dtype=np.int64)
        slip[rows.rubbing_rows] = rubbing_states.status[k].slip
        status = np.where(rubbing_states.status[k].is_closed, slip, _OPEN)
        tractions = of_status(rows, change[k], rubbing_states.status[k])[0]

        def change_with(group: int, neighbour: int) -> Floats:
            status_then = status.copy()
            status_then[group] = status[neighbour]
            slip_then = np.where(status_then == _OPEN, 0, status_then)[rows.rubbing_rows]
            tractions_then = of_status(rows, change[k], Status(status_then != _OPEN, slip_then))[0]
            return np.asarray(per_traction.T @ (tractions_then - tractions))

        return _sum_at_ends(status, (crack, position, piece), change_with, f.shape[1])

    return np.array([of_state(k) for k in states])


__all__ = []
