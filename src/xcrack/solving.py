"""From a problem to solutions: one stiffness, one factor, any number of load states."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from xcrack.arrays import Bools, Floats, lock
from xcrack.assembly import Bulk, bulk, enriched_stiffness, total_stiffness
from xcrack.conditions import Displacement, InitialStress, Load
from xcrack.contact import active_set
from xcrack.cut import cut
from xcrack.equilibrium import Motion, balanced, free_motion, without_motion
from xcrack.errors import ProblemError
from xcrack.level_set import level_set
from xcrack.linear import Solver, System, system
from xcrack.lip_points import LipPoints, lip_points
from xcrack.loads import load_vector
from xcrack.multipliers import Multipliers, gap_rows, jump_matrix, multipliers
from xcrack.planning import Ingredient, Report, plan
from xcrack.problem import Problem
from xcrack.solution import Contact, Solution
from xcrack.space import Space, space
from xcrack.supports import Known, known_unknowns
from xcrack.warm import Warm

_OVERLAP = 1e-9  # share of the largest displacement by which lips must overlap to need contact
_BLOCK = 16  # right-hand sides solved at once for the dual matrix; bounds the memory


def solve(
    problem: Problem, states: Sequence[Any] | None = None, solver: Solver | None = None
) -> Any:
    """Solve a problem for one load state or several, with one factorisation.

    Parameters
    ----------
    problem : Problem
    states : sequence, optional
        Load states: numbers that scale all loads and imposed displacements (but not an initial
        stress), or lists of loads. None: the loads as they are.
    solver : callable, optional
        Given a sparse symmetric matrix, returns a function that solves for right-hand sides;
        `xcrack.linear.superlu` where it is left out.

    Returns
    -------
    Solution, or a list of them where states are given

    Raises
    ------
    ProblemError
        A body that is not held and loads out of balance, supports that contradict each other.
    ConvergenceError
        A singular stiffness, or contact that finds no closed set.
    """
    if states is not None and (isinstance(states, str) or not isinstance(states, Iterable)):
        raise ProblemError(
            f"states = {states!r}: give a list of load states, such as states=[1.0]."
        )
    solutions = solve_states(problem, [None] if states is None else list(states), solver=solver)
    return solutions[0] if states is None else solutions


def solve_states(
    problem: Problem,
    states: Sequence[Any],
    *,
    bulk: Bulk | None = None,
    warm: Warm | None = None,
    solver: Solver | None = None,
) -> list[Solution]:
    """Solve all load states; `bulk` and `warm` of an earlier solution save work."""
    if not len(states):
        raise ProblemError("states is empty: give at least one load state, or none at all.")
    model = build(problem, bulk)
    cases = [_case(problem, model, state) for state in states]
    fixed = model.known.fixed.copy()
    motion = free_motion(model.space, fixed)
    fixed[motion.pins] = True
    engine = system(model.space, model.stiffness, fixed, problem.numerics, solver)
    in_balance = [balanced(model.space, motion, case.f) for case in cases]
    f = np.stack([loads for loads, _ in in_balance], axis=1)
    imbalance = max(share for _, share in in_balance)
    known = np.stack([case.known for case in cases], axis=1)
    u = engine.solve(f, known)
    lips_contact = _contact(problem, model, engine, f, known, u, warm)
    u = lips_contact.u
    if motion.modes.shape[1]:
        u = without_motion(motion, u)
    report = _report(problem, model, engine, lips_contact, motion, imbalance, len(states))
    return [
        Solution(
            problem=problem,
            state=state,
            loads=case.loads,
            factor=case.factor,
            space=model.space,
            u=lock(np.ascontiguousarray(u[:, k])),
            lips=model.lips,
            contact=_contact_of(model, lips_contact, u[:, k], k),
            energy=0.5 * float(u[:, k] @ (model.stiffness @ u[:, k])),
            report=report,
            bulk=model.bulk,
            warm=lips_contact.warm,
        )
        for k, (state, case) in enumerate(zip(states, cases, strict=True))
    ]


@dataclass(frozen=True, eq=False)
class Model:
    """Everything that load states share.

    Attributes
    ----------
    space : Space
    lips : tuple of LipPoints
    bulk : Bulk
    stiffness : sparse matrix
    known : Known
    n_points : int
        Integration points of the enriched cells.
    """

    space: Space
    lips: tuple[LipPoints, ...]
    bulk: Bulk
    stiffness: Any
    known: Known
    n_points: int

    @cached_property
    def jumps(self) -> tuple[Any, ...]:
        """Normal jumps at the lip points of each crack, made when first asked for."""
        return tuple(jump_matrix(self.space, c, lips) for c, lips in enumerate(self.lips))


def build(problem: Problem, bulk_: Bulk | None = None) -> Model:
    """Cut, number, integrate and assemble a problem, without solving it."""
    mesh, order = problem.mesh, problem.order or 2
    cracks = problem.placed
    cuts = tuple(cut(mesh, level_set(mesh, crack)) for crack in cracks)
    space_ = space(mesh, order, cracks, cuts, problem.numerics)
    lips = tuple(lip_points(space_, c) for c in range(len(cracks)))
    if (
        bulk_ is None
        or bulk_.mesh is not mesh
        or bulk_.order != order
        or bulk_.material != problem.material
    ):
        bulk_ = bulk(mesh, problem.material, order)
    enriched, n_points = enriched_stiffness(space_, problem.material, problem.numerics, lips)
    return Model(
        space_,
        lips,
        bulk_,
        total_stiffness(bulk_, enriched),
        known_unknowns(space_, tuple(problem.supports)),
        n_points,
    )


@dataclass(frozen=True, eq=False)
class _Case:
    loads: tuple[Load, ...]
    factor: float
    f: Floats
    known: Floats


def _case(problem: Problem, model: Model, state: Any) -> _Case:
    loads, factor = problem.state(state)
    scaled = tuple(load for load in loads if not isinstance(load, InitialStress))
    steady = tuple(load for load in loads if isinstance(load, InitialStress))
    f = factor * load_vector(model.space, scaled, model.lips)
    f += load_vector(model.space, steady, model.lips)
    known = model.known.value
    moved = tuple(load for load in loads if isinstance(load, Displacement))
    if moved:
        new = known_unknowns(model.space, moved)
        known = np.where(new.fixed & model.known.fixed, new.value, known)
    return _Case(loads, factor, f, factor * known)


@dataclass(frozen=True, eq=False)
class _Lips:
    u: Floats
    spaces: tuple[Multipliers | None, ...]
    pressure: tuple[Floats | None, ...]
    active: tuple[Bools | None, ...]
    warm: Warm
    iterations: int


def _contact(
    problem: Problem,
    model: Model,
    engine: System,
    f: Floats,
    known: Floats,
    u: Floats,
    warm: Warm | None,
) -> _Lips:
    n = len(model.lips)
    spaces: list[Multipliers | None] = [None] * n
    pressure: list[Floats | None] = [None] * n
    active: list[Bools | None] = [None] * n
    iterations = 0
    open_u = u
    pending = _needing(problem, model, u, spaces)
    while pending:
        for c in pending:
            spaces[c] = _multipliers(problem, model, c)
        chosen = [m for m in spaces if m is not None]
        rows = [gap_rows(m, model.lips[m.crack], model.jumps[m.crack]) for m in chosen]
        N = rows[0] if len(rows) == 1 else _stacked(rows)
        F = dual(engine, N)
        measure = np.concatenate([m.measure for m in chosen])
        d = N @ open_u
        sets = []
        for k in range(u.shape[1]):
            start = _start(problem, chosen, warm, k)
            stiffness = problem.material.E / _lip_size(model, chosen)
            sets.append(active_set(F, d[:, k], measure, stiffness, start))
        iterations = max(s.iterations for s in sets)
        lam = np.stack([s.pressure for s in sets], axis=1)
        u = engine.solve(f + N.T @ lam, known)
        first = 0
        for m in chosen:
            last = first + len(m.measure)
            pressure[m.crack] = lam[first:last]
            active[m.crack] = np.stack([s.active[first:last] for s in sets])
            first = last
        pending = _needing(problem, model, u, spaces)
    centre = tuple(None if m is None else m.centre for m in spaces)
    return _Lips(
        u, tuple(spaces), tuple(pressure), tuple(active), Warm(centre, tuple(active)), iterations
    )


def _needing(
    problem: Problem, model: Model, u: Floats, spaces: Sequence[Multipliers | None]
) -> list[int]:
    """Cracks without multipliers whose lips overlap in some load state."""
    if problem.contact == "off":
        return []
    needing = []
    for c, lips in enumerate(model.lips):
        if spaces[c] is not None or not len(lips):
            continue
        if problem.contact == "on":
            needing.append(c)
            continue
        gap = model.jumps[c] @ u
        limit = -_OVERLAP * np.abs(u[: model.space.n_nodes * model.space.dim]).max(axis=0)
        if (gap.min(axis=0) >= limit).all():
            continue
        trial = _multipliers(problem, model, c)
        weak = (trial.values.T @ (lips.weight[:, None] * gap)) / trial.measure[:, None]
        if (weak.min(axis=0) < limit).any():
            needing.append(c)
    return needing


def _multipliers(problem: Problem, model: Model, c: int) -> Multipliers:
    kind = problem.numerics.multipliers
    return multipliers(model.space, c, model.lips[c], kind, model.known.fixed)


def _stacked(rows: list[Any]) -> Any:
    import scipy.sparse as sp

    return sp.csr_matrix(sp.vstack(rows))


def dual(engine: System, N: Any) -> Floats:
    """F = N K^-1 N^T, in blocks of right-hand sides."""
    F = np.empty((N.shape[0], N.shape[0]))
    for first in range(0, N.shape[0], _BLOCK):
        rhs = N[first : first + _BLOCK].T.toarray()
        F[:, first : first + _BLOCK] = N @ engine.solve(rhs)
    return (F + F.T) / 2


def _start(problem: Problem, chosen: list[Multipliers], warm: Warm | None, k: int) -> Bools:
    closed = problem.numerics.initial_set == "closed"
    parts = []
    for m in chosen:
        start = None if warm is None else warm.start(m, k)
        parts.append(np.full(len(m.measure), closed) if start is None else start)
    return np.concatenate(parts)


def _lip_size(model: Model, chosen: list[Multipliers]) -> float:
    cells = np.unique(np.concatenate([model.lips[m.crack].cell.ravel() for m in chosen]))
    return float(model.space.mesh.cell_size[cells].mean())


def _contact_of(model: Model, found: _Lips, u: Floats, k: int) -> tuple[Contact | None, ...]:
    result: list[Contact | None] = []
    for c, lips in enumerate(model.lips):
        m, lam, active = found.spaces[c], found.pressure[c], found.active[c]
        if m is None or lam is None or active is None:
            result.append(None)
            continue
        gap = model.jumps[c] @ u
        closed = np.asarray(m.values @ active[k].astype(float)) >= 0.5
        result.append(
            Contact(
                lips.x,
                lips.normal,
                lips.weight,
                lock(np.asarray(m.values @ lam[:, k])),
                lock(np.asarray(gap)),
                lock(closed),
                lips.s,
            )
        )
    return tuple(result)


def _report(
    problem: Problem,
    model: Model,
    engine: System,
    found: _Lips,
    motion: Motion,
    imbalance: float,
    n_states: int,
) -> Report:
    d = model.space.dim
    rows = []
    n_heaviside = sum(int((h >= 0).sum()) for h in model.space.heaviside) * d
    n_tip = sum(int((t.point_to_function >= 0).sum()) * t.functions for t in model.space.tips) * d
    for row in plan(problem).ingredients:
        if row.name == "Heaviside functions":
            row = replace(row, unknowns=n_heaviside)
        elif row.name == "tip functions" and row.used:
            radii = ", ".join(f"{r:.4g}" for r in model.space.radius)
            row = replace(row, unknowns=n_tip, reason=f"{row.reason}; radius {radii}")
        elif row.name.startswith("multipliers of crack"):
            row = _multiplier_row(problem, found, int(row.name.split()[-1]))
        elif row.name == "supports" and motion.modes.shape[1]:
            row = replace(
                row,
                reason=f"{motion.modes.shape[1]} rigid motion(s) free and removed; loads balance "
                f"to {imbalance:.1e}",
            )
        rows.append(row)
    shared = "share one factorisation" if n_states > 1 else "one factorisation"
    rows.append(Ingredient("load states", True, f"{n_states}, {shared}"))
    standard = model.space.n_nodes * d
    rows.append(
        Ingredient("standard functions", True, f"order {model.space.order}", unknowns=standard)
    )
    for c, (given, placed) in enumerate(zip(problem.cracks, problem.placed, strict=True)):
        if given.tips is None and not np.array_equal(given.points, placed.points):
            mouths = len(placed.points) and 2 - placed.n_tips
            rows.append(
                Ingredient(f"mouths of crack {c}", True, f"{mouths}, prolonged to one cell outside")
            )
    operations = {
        "factorisations": engine.count.factorisations,
        "solves": engine.count.solves,
        "assembled_cells": len(model.space.enriched),
        "integration_points": model.n_points,
        "multipliers": sum(len(m.measure) for m in found.spaces if m is not None),
        "contact_iterations": found.iterations,
    }
    return Report(tuple(rows), operations)


def _multiplier_row(problem: Problem, found: _Lips, c: int) -> Ingredient:
    name = f"multipliers of crack {c}"
    m = found.spaces[c]
    if m is not None:
        why = "contact is switched on" if problem.contact == "on" else "the open lips overlap"
        return Ingredient(name, True, why, unknowns=len(m.measure))
    if problem.contact == "off":
        return Ingredient(name, False, "contact is switched off: lips may overlap")
    return Ingredient(name, False, "the lips stay apart in every load state")
