"""Alternatives to multipliers, for comparison: penalty, augmented Lagrangian, Nitsche.

Each minimises  u K u / 2 - f u + sum c <-(R u + r)>² / 2  by a semi-smooth Newton iteration over
the set where R u + r < 0 (Alart and Curnier, 1991); they differ in K, f, R, r and c alone:

* penalty: R u the gaps at the lip points, r = 0, c = eps times weight;
* augmented Lagrangian (Simo and Laursen, 1992): R u the weak gaps of the multiplier groups,
  r = -lam measure / eps, c = eps / measure, and lam <- <lam - eps gap> until it stays;
* Nitsche (Chouly and Hild, 2013, theta = 1): with the stress S u + s of the crack faces, R u + r =
  S u + s + gamma gap, c = weight / gamma, K less S' (weight / gamma) S. S is a mean on each lip
  segment; gamma grows towards a tip, where the stress of the tip functions does.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import numpy as np
import scipy.optimize
import scipy.sparse as sp

from xcrack.analysis.multipliers import Multipliers, gap_rows, multipliers
from xcrack.base.arguments import Declared, Number
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ConvergenceError
from xcrack.fem.facets import LipPoints
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import lip_side
from xcrack.fem.system import System
from xcrack.linalg.direct import DirectSystem, Solve, superlu
from xcrack.linalg.engine import StateContact
from xcrack.model.material import Material
from xcrack.model.numerics import ContactMethod
from xcrack.model.problem import LoadState, Problem


def stress_matrix(
    space: FunctionSpace, material: Material, c: int, lips: LipPoints
) -> sp.csr_matrix:
    """Mean normal stress n . sigma . n at the lip points, of the strain alone `(q, n_dof)`.

    Parameters
    ----------
    space : FunctionSpace
    material : Material
    c : int
        Crack.
    lips : LipPoints
    """
    d, share = space.dim, lip_shares(space, c, lips)
    stiffness = material.tensor(d)
    rows, columns, values = [], [], []
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        side = lip_side(space, c, cell, lips.bary[:, s], sign)
        for batch, number, row in space.batches_of_points(cell):
            where = lips.bary[number, s], side[number]
            _, G = space.tabulate(batch, row, *where, values=False)
            functions = batch.functions[row]
            normal = lips.normal[number]
            traction_matrix = np.einsum("ijkl,qi,qj->qkl", stiffness, normal, normal)
            stress = np.einsum("qkl,qnl->qnk", traction_matrix, G)
            stress *= share[number, s, None, None]
            is_active = functions >= 0
            point = np.broadcast_to(number[:, None], functions.shape)[is_active]
            for i in range(d):
                rows.append(point)
                columns.append(functions[is_active] * d + i)
                values.append(stress[is_active, i])
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = sp.csr_matrix(triplets, shape=(len(lips), space.n_dof))
    matrix.sum_duplicates()
    return matrix


def lip_shares(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Shares of the stress on lip - and lip + in their mean `(q, 2)`: of the cells' volumes.

    Parameters
    ----------
    space : FunctionSpace
    c : int
        Crack.
    lips : LipPoints
    """
    cut, mesh = space.cuts[c], space.mesh
    volume = np.zeros((len(mesh.cells), 2))
    place = (cut.sub_side > 0).astype(np.int64)
    np.add.at(volume, (cut.sub_to_cell, place), cut.sub_fraction)
    is_whole = lips.cell[:, 0] != lips.cell[:, 1]
    part = np.stack([volume[lips.cell[:, 0], 0], volume[lips.cell[:, 1], 1]], axis=1)
    part[is_whole] = 1.0
    part *= mesh.volume[lips.cell]
    return np.asarray(part / part.sum(axis=1, keepdims=True))


def averaging(space: FunctionSpace, lips: LipPoints) -> sp.csr_matrix:
    """Projection on polynomials of one degree less than u on each lip segment or triangle `(q, q)`.

    The stress of the tip functions goes like 1 / sqrt(r) along the crack faces: its square could
    not be integrated, and at points near a tip a small error in K would be a large pressure.
    """
    n = int(lips.segment.max()) + 1
    # Segments without points divide by something that is not zero.
    size = np.maximum(np.bincount(lips.segment, lips.weight, n), 1e-300)
    first = np.stack([np.bincount(lips.segment, lips.weight * x, n) for x in lips.x.T], axis=1)
    centre = first / size[:, None]
    basis = np.ones((len(lips), 1))
    if space.order == 2:
        local = lips.x - centre[lips.segment]
        extent = np.zeros(n)
        np.maximum.at(extent, lips.segment, np.abs(local).max(axis=1))
        basis = np.concatenate([basis, local / extent[lips.segment, None]], axis=1)
    m = basis.shape[1]
    gram = np.zeros((n, m, m))
    np.add.at(gram, lips.segment, lips.weight[:, None, None] * basis[:, :, None] * basis[:, None])
    # In the plane of a lip its normal adds no function: a pseudo-inverse leaves it out.
    inverse = np.linalg.pinv(gram / size[:, None, None], rcond=1e-9)
    inverse /= size[:, None, None]
    place = np.arange(n + 1)
    middle = sp.bsr_matrix((inverse, place[:-1], place), shape=(n * m, n * m))
    row = np.repeat(np.arange(len(lips)), m)
    column = (lips.segment[:, None] * m + np.arange(m)).ravel()
    B = sp.csr_matrix((basis.ravel(), (row, column)), shape=(len(lips), n * m))
    return sp.csr_matrix(B @ middle @ B.T @ sp.diags(lips.weight))


def tip_distance(space: FunctionSpace, c: int, lips: LipPoints) -> Floats:
    """Mean distance of each point's lip segment to the nearest tip or front `(q,)`, length.

    Parameters
    ----------
    space : FunctionSpace
    c : int
        Crack.
    lips : LipPoints
    """
    nearest = np.full(len(lips), np.inf)
    cell = space.mesh.cells[lips.cell[:, 1]]
    for psi in space.cuts[c].level_set.psi:
        distance = np.abs(np.einsum("qb,qb->q", lips.bary[:, 1], psi[cell]))
        nearest = np.fmin(nearest, distance)
    total = np.bincount(lips.segment, lips.weight * nearest)
    size = np.bincount(lips.segment, lips.weight)
    return np.asarray((total / np.maximum(size, 1e-300))[lips.segment])


def steady_stress(material: Material, lips: LipPoints, c: int, load_state: LoadState) -> Floats:
    """Normal stress that loads add to that of the strain `(q,)`: initial stress, given pressure.

    Parameters
    ----------
    material : Material
    lips : LipPoints
    c : int
        Crack.
    load_state : LoadState
    """
    total = np.zeros(len(lips))
    for load, factor in load_state:
        if "initial_stress" in load.acts:
            sigma = factor * load.initial_stress(lips.x, material)
            total += np.einsum("qi,qij,qj->q", lips.normal, sigma, lips.normal)
        if "face_pressure" in load.acts:
            p = load.face_pressure(lips.x, c)
            total += 0.0 if p is None else factor * p
    return total


_MAX_SETS = 100
_MAX_UPDATES = 500
_TOLERANCE = 1e-8  # change of the multipliers, as a share of the largest, that ends their updates


_Factor = Annotated[float, Number(above=0)]


@dataclass(frozen=True)
class Springs(Declared, ContactMethod):
    """What the methods share: springs or stresses on rows of gaps, and Newton's iteration."""

    factor: _Factor

    def pressure_space(self, problem: Problem, model: System, c: int) -> Multipliers:
        """The points on the crack faces, one by one."""
        lips = model.lips[c]
        each = sp.csr_matrix(sp.identity(len(lips), format="csr"))
        return Multipliers(c, each, lips.weight, lips.x)

    def compliance(self, problem: Problem, model: System, chosen: Multipliers) -> Floats:
        """Weak gap over traction of each spring `(g,)`.

        With the rows N of the springs N u + compliance λ = 0 where one presses or sticks: penalties
        are multipliers with a diagonal added to F = N K^-1 N^T.
        """
        return chosen.measure / self.rows(problem, model, chosen).eps

    def rows(self, problem: Problem, model: System, m: Multipliers) -> "Rows":
        """Gaps at the points of one crack, and the stiffness there."""
        size = _size(model, model.lips[m.crack])
        stress = sp.csr_matrix((len(m.measure), model.space.n_dof))
        eps = self.factor * problem.elasticity.largest_modulus / size
        return Rows(model.jumps[m.crack], stress, eps, m.measure)

    def solve_states(
        self,
        problem: Problem,
        model: System,
        engine: DirectSystem,
        chosen: Sequence[Multipliers],
        f: Floats,
        u_known: Floats,
        start: Sequence[Bools | None],
        closed: bool,
        acting: Sequence[LoadState],
    ) -> list[StateContact]:
        """Contact of all load states.

        Parameters
        ----------
        problem : Problem
        model : System
        engine : DirectSystem
        chosen : sequence of Multipliers
            Of the cracks that need contact, from `pressure_space`.
        f, known : (n_dof, states) arrays
        start : sequence of (g,) arrays of bool or None
            First guess of each state's closed set.
        closed : bool
            State of all rows where there is no guess.
        acting : sequence of LoadState
            Loads of each state: Nitsche counts pressures that are given on the faces, and initial
            stress.

        Raises
        ------
        ConvergenceError
            A set or multipliers that do not settle; a penalty so small that Nitsche is unstable.
        """
        parts = [self.rows(problem, model, m) for m in chosen]
        rows = Rows(
            sp.csr_matrix(sp.vstack([p.jump for p in parts])),
            sp.csr_matrix(sp.vstack([p.stress for p in parts])),
            np.concatenate([p.eps for p in parts]),
            np.concatenate([p.measure for p in parts]),
        )
        system = self.system(engine, rows)
        states = []
        for k in range(f.shape[1]):
            first = start[k]
            guess = np.full(len(rows.eps), closed) if first is None else first
            tractions = partial(face_tractions, problem, model, chosen, acting[k])
            u, pressure, sets = self.solution(
                system, rows, f[:, k], u_known[:, k], guess, tractions
            )
            states.append(StateContact(pressure, rows.jump @ u, pressure > 0, sets, u))
        return states

    def system(self, engine: DirectSystem, rows: "Rows") -> "ClosedSystem":
        """Stiffness and rows of the iteration."""
        c = rows.eps * rows.measure
        return ClosedSystem(engine, engine.matrix, rows.jump, c, engine.basis_matrix)

    def solution(
        self, system: "ClosedSystem", rows: "Rows", f: Floats, u_known: Floats, start: Bools,
        tractions: Callable[[], Floats],
    ) -> tuple[Floats, Floats, int]:  # fmt: skip
        """Displacements, pressures, and the number of sets of one state."""
        state = _newton(system, f, u_known, np.zeros(len(rows.eps)), start)
        return state.u, np.maximum(-state.residual * rows.eps, 0.0), state.sets


@dataclass(frozen=True)
class penalty(Springs):  # noqa: N801 - it is used as a function
    """A spring at each point of the crack faces that overlaps.

    Parameters
    ----------
    factor : float
        Stiffness per area of crack face over E / size of a cell. The overlap falls with it, and
        the pressure starts to oscillate.
    """

    label = "a penalty"
    friction_dims = (2,)
    factor: _Factor = 100.0


@dataclass(frozen=True)
class augmented_lagrangian(Springs):  # noqa: N801
    """Multipliers in the space that `Numerics.multipliers` names, updated until they stay.

    Parameters
    ----------
    factor : float
        As of `penalty`: stiffer springs take fewer updates.

    Notes
    -----
    Simo and Laursen (1992).
    """

    label = "an augmented Lagrangian"
    has_unknowns = True
    friction_dims = (2,)
    updates = True
    factor: _Factor = 10.0

    def pressure_space(self, problem: Problem, model: System, c: int) -> Multipliers:
        """Groups of points, as multipliers have them."""
        kind = problem.numerics.multipliers
        return multipliers(model.space, c, model.lips[c], kind, model.imposed_values.is_fixed)

    def rows(self, problem: Problem, model: System, m: Multipliers) -> "Rows":
        """Weak gaps of the groups."""
        lips = model.lips[m.crack]
        size = np.asarray(m.values.T @ (lips.weight * _size(model, lips))) / m.measure
        stress = sp.csr_matrix((len(m.measure), model.space.n_dof))
        eps = self.factor * problem.elasticity.largest_modulus / size
        return Rows(gap_rows(m, lips, model.jumps[m.crack]), stress, eps, m.measure)

    def system(self, engine: DirectSystem, rows: "Rows") -> "ClosedSystem":
        """Springs on weak gaps."""
        c = rows.eps / rows.measure
        return ClosedSystem(engine, engine.matrix, rows.jump, c, engine.basis_matrix)

    def solution(
        self, system: "ClosedSystem", rows: "Rows", f: Floats, u_known: Floats, start: Bools,
        tractions: Callable[[], Floats],
    ) -> tuple[Floats, Floats, int]:  # fmt: skip
        """Updates of the multipliers (Uzawa) until they stay."""
        eps, measure = rows.eps, rows.measure
        lam, sets, is_active = np.zeros(len(eps)), 0, start
        for _ in range(_MAX_UPDATES):
            state = _newton(system, f, u_known, -lam * measure / eps, is_active)
            sets += state.sets
            new_lam = np.maximum(-state.residual * eps / measure, 0.0)
            change = float(np.abs(new_lam - lam).max(initial=0.0))
            lam, is_active = new_lam, state.active
            if change <= _TOLERANCE * float(np.abs(lam).max(initial=0.0)):
                return state.u, lam, sets
        raise ConvergenceError(
            f"contact: after {_MAX_UPDATES} updates the multipliers still change by {change:.3g}, "
            f"where the largest is {lam.max():.3g}. Give a larger factor of augmented_lagrangian."
        )


@dataclass(frozen=True)
class nitsche(Springs):  # noqa: N801
    """The stress of the crack faces instead of multipliers, with a penalty that makes it stable.

    Parameters
    ----------
    factor : float
        As of `penalty`: the method is unstable below a bound that depends on order and cells.

    Notes
    -----
    Symmetric (Chouly and Hild, 2013, theta = 1). The stress is a mean on each segment of a face;
    the stiffness grows towards a tip, where the stress of the tip functions does.
    """

    label = "Nitsche's method"
    factor: _Factor = 40.0

    def rows(self, problem: Problem, model: System, m: Multipliers) -> "Rows":
        """Gaps and mean stresses at the points."""
        lips, c = model.lips[m.crack], m.crack
        mean = averaging(model.space, lips)
        size = np.minimum(_size(model, lips), tip_distance(model.space, c, lips))
        stress = sp.csr_matrix(
            mean @ stress_matrix(model.space, problem.elasticity.material, c, lips)
        )
        eps = self.factor * problem.elasticity.largest_modulus / size
        return Rows(model.jumps[c], stress, eps, m.measure)

    def system(self, engine: DirectSystem, rows: "Rows") -> "ClosedSystem":
        """The stiffness less that of the stresses, on rows of stress and gap."""
        c = rows.measure / rows.eps
        R = sp.csr_matrix(rows.stress + sp.diags(rows.eps) @ rows.jump)
        stress = sp.csr_matrix(rows.stress @ engine.basis)
        K = sp.csr_matrix(engine.matrix - rows.stress.T @ sp.diags(c) @ rows.stress)
        reduced_matrix = sp.csc_matrix(engine.basis_matrix - stress.T @ sp.diags(c) @ stress)
        return ClosedSystem(engine, K, R, c, reduced_matrix)

    def solution(
        self, system: "ClosedSystem", rows: "Rows", f: Floats, u_known: Floats, start: Bools,
        tractions: Callable[[], Floats],
    ) -> tuple[Floats, Floats, int]:  # fmt: skip
        """The residual holds stresses: pressures as they are."""
        r = tractions()
        load = f + rows.stress.T @ (rows.measure / rows.eps * r)
        state = _newton(system, load, u_known, r, start)
        return state.u, np.maximum(-state.residual, 0.0), state.sets


def face_tractions(
    problem: Problem, model: System, chosen: Sequence[Multipliers], load_state: LoadState
) -> Floats:
    """Normal stress that loads add to that of the strain, at the points of all cracks `(q,)`."""
    parts = []
    for m in chosen:
        lips = model.lips[m.crack]
        stress = steady_stress(problem.elasticity.material, lips, m.crack, load_state)
        parts.append(averaging(model.space, lips) @ stress if stress.any() else stress)
    return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a method on the crack faces.

    Attributes
    ----------
    jump : (g, n_dof) sparse matrix
        Gaps at the points, weak gaps of groups.
    stress : (g, n_dof) sparse matrix
        Stress of the faces, for Nitsche.
    eps : (g,) array, stress / length
    measure : (g,) array
    """

    jump: sp.csr_matrix
    stress: sp.csr_matrix
    eps: Floats
    measure: Floats


def _size(model: System, lips: LipPoints) -> Floats:
    return np.asarray(model.space.mesh.cell_size[lips.cell].mean(axis=1))


@dataclass
class ClosedSystem:
    """Stiffness, rows and their weights c, with the last factor."""

    engine: DirectSystem
    stiffness: sp.csr_matrix
    rows: sp.csr_matrix
    c: Floats
    reduced: sp.csc_matrix
    last: tuple[bytes, Solve] | None = field(default=None)

    def __post_init__(self) -> None:
        self.reduced_rows = sp.csr_matrix(self.rows @ self.engine.basis)

    def closed(self, is_active: Bools) -> sp.csc_matrix:
        """The matrix with the rows of a set."""
        R = self.reduced_rows[is_active]
        return sp.csc_matrix(self.reduced + R.T @ sp.diags(self.c[is_active]) @ R)

    def solver(self, is_active: Bools) -> Solve:
        """Solves with the rows of a set; kept while the set stays."""
        key = is_active.tobytes()
        if self.last is None or self.last[0] != key:
            self.last = key, superlu(self.closed(is_active))
            self.engine.count.factorisations += 1
        return self.last[1]


@dataclass(frozen=True, eq=False)
class _State:
    u: Floats
    residual: Floats  # R u + r
    active: Bools
    sets: int


def _newton(system: ClosedSystem, f: Floats, u_known: Floats, r: Floats, start: Bools) -> _State:
    """Sets of closed rows until one stays; where one comes back, steps are cut by a line search."""
    K, R, c, basis = system.stiffness, system.rows, system.c, system.engine.basis
    is_active, u = np.array(start, dtype=bool), None
    visited_sets: set[bytes] = set()
    for sets in range(1, _MAX_SETS + 1):
        part = R[is_active]
        loads = f - K @ u_known - part.T @ (c[is_active] * (r[is_active] + part @ u_known))
        new_u = u_known + basis @ system.solver(is_active)(basis.T @ loads)
        system.engine.count.solves += 1
        if not np.isfinite(new_u).all():
            break
        gap = np.asarray(R @ new_u + r)
        # Values at round-off of zero (crack faces that only touch) must not make the set flicker.
        floor = 1e-13 * float(np.abs(gap).max(initial=0.0))
        if ((gap < -floor) == is_active).all():
            return _State(new_u, gap, is_active, sets)
        if is_active.tobytes() in visited_sets and u is not None:
            t = _step(system, f, r, u, new_u - u)
            new_u = u + t * (new_u - u)
            gap = np.asarray(R @ new_u + r)
        visited_sets.add(is_active.tobytes())
        u, is_active = new_u, gap < -floor
    raise ConvergenceError(
        f"contact: after {sets} sets of {len(c)} places the set of closed ones still changes. Give "
        "another factor of the contact method: less for a penalty, more for Nitsche's method; or "
        "leave the method out."
    )


def _step(system: ClosedSystem, f: Floats, r: Floats, u: Floats, step: Floats) -> float:
    """Length of a step in (0, 1] at which the energy is least: its slope is monotone."""
    K, R, c = system.stiffness, system.rows, system.c
    Kstep, gap, change = K @ step, R @ u + r, R @ step
    first, second = float(u @ Kstep - f @ step), float(step @ Kstep)

    def slope(t: float) -> float:
        return float(first + t * second + change @ (c * np.minimum(gap + t * change, 0.0)))

    if slope(1.0) <= 0 or slope(0.0) >= 0:
        return 1.0
    return float(scipy.optimize.brentq(slope, 0.0, 1.0))


__all__ = ["augmented_lagrangian", "nitsche", "penalty"]
