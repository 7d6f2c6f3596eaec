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

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize
import scipy.sparse as sp

from xcrack.analysis.multipliers import Multipliers, gap_rows, multipliers
from xcrack.analysis.nitsche import averaging, steady_stress, stress_matrix, tip_distance
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ConvergenceError
from xcrack.fem.facets import LipPoints
from xcrack.fem.system import Model
from xcrack.linalg.direct import Solve, System, superlu
from xcrack.linalg.engine import StateContact
from xcrack.model.conditions import Load
from xcrack.model.problem import Problem

FACTORS = {"penalty": 100.0, "augmented": 10.0, "nitsche": 40.0}
_MAX_SETS = 100
_MAX_UPDATES = 500
_TOLERANCE = 1e-8  # change of the multipliers, as a share of the largest, that ends their updates


def lip_space(problem: Problem, model: Model, c: int) -> Multipliers:
    """Where pressures live: groups of multipliers, or the lip points one by one."""
    lips = model.lips[c]
    if problem.numerics.comparison.lips in ("penalty", "nitsche"):
        each = sp.csr_matrix(sp.identity(len(lips), format="csr"))
        return Multipliers(c, each, lips.weight, lips.x)
    return multipliers(model.space, c, lips, problem.numerics.multipliers, model.known.fixed)


def solve_alternative(
    problem: Problem,
    model: Model,
    engine: System,
    chosen: Sequence[Multipliers],
    f: Floats,
    known: Floats,
    start: Sequence[Bools | None],
    closed: bool,
    acting: Sequence[tuple[tuple[Load, ...], float]],
) -> list[StateContact]:
    """Solve all load states by the method that `Comparison.lips` names.

    Parameters
    ----------
    problem : Problem
    model : Model
    engine : System
    chosen : sequence of Multipliers
        Of the cracks that need contact, from `lip_space`.
    f, known : (n_dof, states) arrays
    start : sequence of (g,) arrays of bool or None
        First guess of each state's closed set.
    closed : bool
        State of all rows where there is no guess.
    acting : sequence of (loads, factor)
        Loads of each state and their scale: Nitsche counts pressures that are given on the faces,
        and initial stress.

    Raises
    ------
    ConvergenceError
        A set or multipliers that do not settle; a penalty so small that Nitsche is unstable.
    """
    method = problem.numerics.comparison.lips
    rows, springs = _springs(problem, model, engine, chosen)
    measure, eps = rows.measure, rows.eps
    states = []
    for k in range(f.shape[1]):
        load, r = f[:, k], np.zeros(len(eps))
        first = start[k]
        guess = np.full(len(eps), closed) if first is None else first
        if method == "augmented":
            u, pressure, sets = _augmented(springs, load, known[:, k], guess, eps, measure)
        else:
            if method == "nitsche":
                loads, factor = acting[k]
                r = np.concatenate([_steady(model, m.crack, loads, factor) for m in chosen])
                load = load + rows.stress.T @ (measure / eps * r)
            state = _newton(springs, load, known[:, k], r, guess)
            u, sets = state.u, state.sets
            pressure = np.maximum(-state.residual * _unit(method, eps), 0.0)
        states.append(StateContact(pressure, rows.jump @ u, pressure > 0, sets, u))
    return states


def _steady(model: Model, c: int, loads: tuple[Load, ...], factor: float) -> Floats:
    lips = model.lips[c]
    given = steady_stress(lips, c, loads, factor)
    return np.asarray(averaging(model.space, lips) @ given if given.any() else given)


def _unit(method: str, eps: Floats) -> Floats:
    """What turns -(R u + r) into a pressure: R holds gaps, or stresses in Nitsche's method."""
    return np.ones(len(eps)) if method == "nitsche" else eps


@dataclass(frozen=True, eq=False)
class _Rows:
    jump: sp.csr_matrix  # (g, n_dof): gaps at the points, weak gaps of groups
    stress: sp.csr_matrix  # (g, n_dof): stress of the lips, for Nitsche
    eps: Floats  # (g,) stress / length
    measure: Floats  # (g,)


def compliance(problem: Problem, model: Model, m: Multipliers) -> Floats:
    """Weak gap over traction of each spring of a penalty or an augmented Lagrangian `(g,)`.

    With the rows N of the springs N u + compliance λ = 0 where one presses or sticks: penalties are
    multipliers with a diagonal added to F = N K^-1 N^T.
    """
    return m.measure / _rows(problem, model, m).eps


def _rows(problem: Problem, model: Model, m: Multipliers) -> _Rows:
    method, c = problem.numerics.comparison, m.crack
    lips, jump = model.lips[c], model.jumps[c]
    size = _size(model, lips)
    stress = sp.csr_matrix((len(m.measure), model.space.n_dof))
    if method.lips == "augmented":
        size = np.asarray(m.values.T @ (lips.weight * size)) / m.measure
        jump = gap_rows(m, lips, jump)
    elif method.lips == "nitsche":
        mean = averaging(model.space, lips)
        size = np.minimum(size, tip_distance(model.space, c, lips))
        stress = sp.csr_matrix(mean @ stress_matrix(model.space, problem.material, c, lips))
    factor = FACTORS[method.lips] if method.penalty is None else method.penalty
    return _Rows(jump, stress, factor * problem.material.E / size, m.measure)


def _size(model: Model, lips: LipPoints) -> Floats:
    return np.asarray(model.space.mesh.cell_size[lips.cell].mean(axis=1))


@dataclass
class _Springs:
    """Stiffness, rows and their weights c, with the last factor."""

    engine: System
    stiffness: sp.csr_matrix
    rows: sp.csr_matrix
    c: Floats
    reduced: sp.csc_matrix
    reduced_rows: sp.csr_matrix
    last: tuple[bytes, Solve] | None = field(default=None)

    def closed(self, active: Bools) -> sp.csc_matrix:
        """The matrix with the rows of a set."""
        R = self.reduced_rows[active]
        return sp.csc_matrix(self.reduced + R.T @ sp.diags(self.c[active]) @ R)

    def solver(self, active: Bools) -> Solve:
        """Solves with the rows of a set; kept while the set stays."""
        key = active.tobytes()
        if self.last is None or self.last[0] != key:
            self.last = key, superlu(self.closed(active))
            self.engine.count.factorisations += 1
        return self.last[1]


def _springs(
    problem: Problem, model: Model, engine: System, chosen: Sequence[Multipliers]
) -> tuple[_Rows, _Springs]:
    parts = [_rows(problem, model, m) for m in chosen]
    rows = _Rows(
        sp.csr_matrix(sp.vstack([p.jump for p in parts])),
        sp.csr_matrix(sp.vstack([p.stress for p in parts])),
        np.concatenate([p.eps for p in parts]),
        np.concatenate([p.measure for p in parts]),
    )
    K, basis, reduced = engine.matrix, engine.basis, engine.reduced
    c, R = rows.eps * rows.measure, rows.jump
    if problem.numerics.comparison.lips == "augmented":
        c = rows.eps / rows.measure
    elif problem.numerics.comparison.lips == "nitsche":
        c = rows.measure / rows.eps
        R = sp.csr_matrix(rows.stress + sp.diags(rows.eps) @ rows.jump)
        own = sp.csr_matrix(rows.stress @ basis)
        K = sp.csr_matrix(K - rows.stress.T @ sp.diags(c) @ rows.stress)
        reduced = sp.csc_matrix(reduced - own.T @ sp.diags(c) @ own)
    return rows, _Springs(engine, K, R, c, reduced, sp.csr_matrix(R @ basis))


@dataclass(frozen=True, eq=False)
class _State:
    u: Floats
    residual: Floats  # R u + r
    active: Bools
    sets: int


def _newton(springs: _Springs, f: Floats, known: Floats, r: Floats, start: Bools) -> _State:
    """Sets of closed rows until one stays; where one comes back, steps are cut by a line search."""
    K, R, c, basis = springs.stiffness, springs.rows, springs.c, springs.engine.basis
    active, u = np.array(start, dtype=bool), None
    seen: set[bytes] = set()
    for sets in range(1, _MAX_SETS + 1):
        part = R[active]
        loads = f - K @ known - part.T @ (c[active] * (r[active] + part @ known))
        new = known + basis @ springs.solver(active)(basis.T @ loads)
        springs.engine.count.solves += 1
        if not np.isfinite(new).all():
            break
        gap = np.asarray(R @ new + r)
        # Values at round-off of zero (crack faces that only touch) must not make the set flicker.
        floor = 1e-13 * float(np.abs(gap).max(initial=0.0))
        if ((gap < -floor) == active).all():
            return _State(new, gap, active, sets)
        if active.tobytes() in seen and u is not None:
            t = _step(springs, f, r, u, new - u)
            new = u + t * (new - u)
            gap = np.asarray(R @ new + r)
        seen.add(active.tobytes())
        u, active = new, gap < -floor
    raise ConvergenceError(
        f"contact: after {sets} sets of {len(c)} places the set of closed ones still changes. Give "
        "another Comparison(penalty=...): less for a penalty, more for Nitsche's method; or take "
        'lips="multipliers".'
    )


def _step(springs: _Springs, f: Floats, r: Floats, u: Floats, step: Floats) -> float:
    """Length of a step in (0, 1] at which the energy is least: its slope is monotone."""
    K, R, c = springs.stiffness, springs.rows, springs.c
    Kstep, gap, change = K @ step, R @ u + r, R @ step
    first, second = float(u @ Kstep - f @ step), float(step @ Kstep)

    def slope(t: float) -> float:
        return float(first + t * second + change @ (c * np.minimum(gap + t * change, 0.0)))

    if slope(1.0) <= 0 or slope(0.0) >= 0:
        return 1.0
    return float(scipy.optimize.brentq(slope, 0.0, 1.0))


def _augmented(
    springs: _Springs, f: Floats, known: Floats, start: Bools, eps: Floats, measure: Floats
) -> tuple[Floats, Floats, int]:
    """Updates of the multipliers (Uzawa) until they stay: displacements, multipliers, sets."""
    lam, sets, active = np.zeros(len(eps)), 0, start
    for _ in range(_MAX_UPDATES):
        state = _newton(springs, f, known, -lam * measure / eps, active)
        sets += state.sets
        new = np.maximum(-state.residual * eps / measure, 0.0)
        change = float(np.abs(new - lam).max(initial=0.0))
        lam, active = new, state.active
        if change <= _TOLERANCE * float(np.abs(lam).max(initial=0.0)):
            return state.u, lam, sets
    raise ConvergenceError(
        f"contact: after {_MAX_UPDATES} updates the multipliers still change by {change:.3g}, "
        f"where the largest is {lam.max():.3g}. Give a larger Comparison(penalty=...)."
    )
