"""From a problem to solutions: one stiffness, one factor, any number of load states."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, cast

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from xcrack.analysis.contact import contact_of, open_solution, solve_contact
from xcrack.analysis.friction import slip_of
from xcrack.analysis.plan import check_memory
from xcrack.analysis.report import alarms_of_solutions, report
from xcrack.analysis.solution import FactoredSolution, Solution, outcome_of, resultants
from xcrack.base.arguments import Function, Items, Switch, check_arguments
from xcrack.base.arrays import Bools, Floats, lock
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, warn
from xcrack.base.machine import one_blas_thread, threads
from xcrack.fem.assembly import MeshLoad, body_forces, next_to_enriched
from xcrack.fem.loads import (
    body_points,
    known_unknowns,
    load_vector,
    load_vectors,
    mesh_loads,
    on_mesh,
    position,
)
from xcrack.fem.system import System, build
from xcrack.linalg.direct import Solver, system
from xcrack.linalg.engine import Engine, SolverState, is_open_first, takes_iterations
from xcrack.linalg.iterative import iterative_system
from xcrack.linalg.products import times
from xcrack.linalg.rigid_motion import (
    Motion,
    balanced_loads,
    free_modes,
    free_motion,
    without_motion,
)
from xcrack.model.loads import Load, Support
from xcrack.model.problem import LoadState, Problem, ProblemArgument, check_order

# How much of an initial stress the body cannot bear: its part out of balance.

_RESIDUAL = 1e-3  # of the conjugate gradients: the energy is then known to far better than 1 %
_MOST = 2000


def out_of_balance(problem: Problem, model: System, loads: Sequence[Load]) -> float | None:
    """Share of the energy of the initial stress that relaxes in the body without cracks.

    A stress in equilibrium with free sides keeps all of its energy, one that is a strain in
    disguise keeps nothing (projection theorem). A change of temperature is left out: what it does
    is meant.

    Parameters
    ----------
    problem : Problem
    model : System
    loads : sequence of loads

    Returns
    -------
    float or None
        Between 0 and 1; None where no such stress acts.
    """
    stresses = tuple(load for load in loads if load.relaxes)
    if not stresses:
        return None
    space = model.space
    n = space.n_nodes * space.dim
    points = body_points(space)
    x = position(space, points.cell, points.bary)
    elasticity, at = problem.elasticity, (points.cell, points.bary)
    sigma = np.zeros((len(x), space.dim, space.dim))
    for load in stresses:
        sigma = sigma + elasticity.initial_stress(load, x, *at)
    energy = np.einsum("q,qij,qij->", points.weight, sigma, elasticity.strain(sigma, *at))
    if energy <= 0:
        return None
    free_forces = ~model.imposed_values.is_fixed[:n]
    vector = sum(load_vector(space, elasticity, load, ())[:n] for load in stresses)
    f = np.where(free_forces, vector, 0.0)
    matrix = model.bulk.matrix
    keep = sp.diags(free_forces.astype(float))
    scale = np.where(free_forces, 1 / matrix.diagonal(), 0.0)
    operator = LinearOperator(
        (n, n), matvec=lambda v: keep @ body_forces(matrix, keep @ v), dtype=float
    )
    scaling = LinearOperator((n, n), matvec=lambda v: scale * v, dtype=float)
    u = cg(operator, f, rtol=_RESIDUAL, maxiter=_MOST, M=scaling)[0]
    return float(np.clip(f @ u / energy, 0.0, 1.0))


_SOLVER = (
    "a function of a sparse matrix that returns a function of right-hand sides, such as xc.pardiso"
)
_LARGEST = 1e120  # force or displacement whose square, over a small stiffness, is still a number


@check_arguments()
def solve(
    problem: ProblemArgument,
    states: Annotated[Sequence[Any] | None, Items(keeps_sets=True)] = None,
    solver: Annotated[Solver | None, Function(_SOLVER)] = None,
    error: Switch = False,
) -> Any:
    """Solve a problem for one load state or several, with one factorisation.

    Parameters
    ----------
    problem : Problem
    states : sequence, optional
        Load states: numbers that scale all loads and imposed displacements (but not an initial
        stress), or lists of loads. None: the loads as they are. With friction each is reached from
        the one before it, the first from the unloaded body.
    solver : callable, optional
        Given a sparse symmetric matrix, returns a function that solves for right-hand sides;
        a multifrontal factorisation if omitted.
    error : bool
        Keep the factor with the solutions: `stress_intensity` then gives an error bar with K, and
        needs no second factorisation for it. The memory of the factor is free once the solutions
        are.

    Returns
    -------
    Solution, or a list of them where states are given

    Raises
    ------
    ProblemError
        An unsupported body and loads out of balance, supports that contradict each other; states
        without an order where there is friction.
    SizeError
        It would take more memory than is free (a `ProblemError`; `xc.plan` says how much). With a
        `solver` of one's own nobody knows.
    ConvergenceError
        A singular stiffness, or contact that finds no closed set.

    Warns
    -----
    XcrackWarning
        Nothing acts, or displacements above 2 % of the body that are more likely a slip of units.
    """
    if states is not None:
        check_order(problem.frictions, states)
    load_states = [None] if states is None else tuple(states)
    solutions = solve_states(problem, load_states, solver=solver, error=error)
    for alarm in alarms_of_solutions(solutions, stresses=False):
        warn(str(alarm))
    return solutions[0] if states is None else solutions


def solve_states(
    problem: Problem,
    states: Sequence[Any],
    *,
    reuse: SolverState | None = None,
    solver: Solver | None = None,
    error: bool = False,
    is_repeated: bool = False,
) -> list[Solution]:
    """Solve all load states; `reuse` of an earlier solution in the same mesh saves work.

    Give `SolverState()` at the first of several solves in one mesh: what serves the next is then
    kept. With `error` the factor stays with the solutions. With `is_repeated` the states are a
    cycle: where faces rub it goes on until slip returns, from what `reuse` left behind.
    """
    if not len(states):
        raise ProblemError("states is empty: give at least one load state, or none at all.")
    with threads(problem.numerics.threads):
        if solver is not None:  # a user's solver may use threads of BLAS
            return _solve_states(problem, states, reuse, solver, error, is_repeated)
        with one_blas_thread():  # entered anew by every factorisation, which then costs nothing
            return _solve_states(problem, states, reuse, solver, error, is_repeated)


def _solve_states(
    problem: Problem,
    states: Sequence[Any],
    reuse: SolverState | None,
    solver: Solver | None,
    error: bool,
    is_repeated: bool,
) -> list[Solution]:
    old_bulk = None if reuse is None else reuse.bulk
    if solver is None and (old_bulk is None or old_bulk.mesh is not problem.mesh):
        check_memory(problem, len(states))
    model = build(problem, old_bulk)
    vectors = mesh_loads(model.space, model.bulk.loads)
    cases = [_case(problem, model, state, vectors) for state in states]
    is_fixed = model.imposed_values.is_fixed.copy()
    free_motions = _fixed_unknowns(model, is_fixed)
    motion = free_motion(model.space, is_fixed, free_motions[1])
    f, imbalance = balanced_loads(model.space, motion, np.stack([case.f for case in cases], axis=1))
    u_imposed = np.stack([case.u_imposed for case in cases], axis=1)
    load_states = [case.load_state for case in cases]
    start = reuse or SolverState()
    was_closed = any(start.was_closed(c) for c in range(len(problem.cracks)))
    contact_solution = None
    if solver is None and not was_closed and is_open_first(problem, model.space.n_dof):
        # Faces with friction that stay open need no factor.
        engine = _engine(problem, model, is_fixed, motion, solver, reuse, has_contact=False)
        contact_solution = open_solution(problem, model, engine, f, u_imposed)
    if contact_solution is None:
        engine = _engine(problem, model, is_fixed, motion, solver, reuse, has_contact=True)
        contact_solution = solve_contact(
            problem, model, engine, f, u_imposed, start, load_states, is_repeated
        )
    u = contact_solution.u
    if motion.modes.shape[1]:
        u = without_motion(motion, u)
    loads: tuple[MeshLoad, ...] = ()
    if reuse is not None:  # else there is no next step
        all_loads = {id(load): load for case in cases for load in case.load_state.loads}.values()
        pairs = [(load, vectors[id(load)]) for load in all_loads]
        loads = on_mesh(model.space, pairs, model.bulk.loads)
    end_state = replace(
        contact_solution.closed_sets(),
        bulk=replace(model.bulk, loads=loads, free_motions=free_motions),
    )
    if contact_solution.friction_work:
        end_state = replace(
            end_state, slip=slip_of(model, contact_solution.friction_work, u[:, -1])
        )
    handed_on = engine.handed_on(end_state)
    factored = FactoredSolution(model, engine, motion, contact_solution) if error else None
    # It depends on the mesh, not on the cracks: steps of a run leave it out.
    first = cases[0].load_state.loads
    unbalanced_share = None if reuse is not None else out_of_balance(problem, model, first)
    outcome = outcome_of(
        problem, model, engine, contact_solution, motion.modes.shape[1], imbalance, len(states),
        unbalanced_share,
    )  # fmt: skip
    solutions = []
    all_forces = times(engine.matrix, u)
    for k, (state, case) in enumerate(zip(states, cases, strict=True)):
        forces = all_forces[:, k]
        rows = resultants(problem, model, case.load_state.loads, case.parts, forces - case.f)
        solutions.append(
            Solution(
                problem=problem,
                state=state,
                acting=case.load_state,
                space=model.space,
                u=lock(np.ascontiguousarray(u[:, k])),
                lips=model.lips,
                contact=contact_of(model, contact_solution, u[:, k], k),
                energy=0.5 * float(u[:, k] @ forces),
                make_summary=partial(report, problem, model.space, outcome, rows),
                reuse=handed_on,
                number=k,
                factored=factored,
                dissipated=contact_solution.dissipated[k] if contact_solution.dissipated else 0.0,
            )
        )
    return solutions


def _fixed_unknowns(model: System, is_fixed: Bools) -> tuple[Bools, Floats]:
    """Fixed standard unknowns and the rigid motions left: those of the last solve, or new ones."""
    space, earlier_free = model.space, model.bulk.free_motions
    standard = is_fixed[: space.n_nodes * space.dim]
    if earlier_free is not None and np.array_equal(earlier_free[0], standard):
        return earlier_free
    return lock(standard.copy()), lock(free_modes(space, standard))


def _engine(
    problem: Problem,
    model: System,
    is_fixed: Bools,
    motion: Motion,
    solver: Solver | None,
    reuse: SolverState | None,
    has_contact: bool,
) -> Engine:
    """A factorisation, or in 3D above some size conjugate gradients."""
    space_, basis = model.space, problem.numerics.tip_basis
    if solver is None and takes_iterations(problem, space_.n_dof, has_contact, reuse is None):
        # Rows beside the crack are enough where no basis is changed but that of single nodes.
        by_parts = space_.order == 1 and basis is None
        return iterative_system(
            space_,
            model.parts if by_parts else model.stiffness,
            model.bulk,
            is_fixed,
            None if reuse is None else reuse.hierarchy,
            motion.modes,
            None if basis is None else partial(basis.columns, space_, problem.elasticity.material),
            next_to_enriched(space_) if by_parts else None,
        )
    is_fixed[motion.pins] = True
    return system(
        space_,
        model.stiffness,
        is_fixed,
        problem.numerics,
        solver,
        problem.elasticity.material,
        reuse,
    )


@dataclass(frozen=True, eq=False)
class LoadCase:
    """A load state: its vector, those of each load, and imposed displacements."""

    load_state: LoadState
    f: Floats
    parts: tuple[Floats, ...]
    u_imposed: Floats


def _case(problem: Problem, model: System, state: Any, vectors: dict[int, Floats]) -> LoadCase:
    """A load state; states that share loads integrate them once."""
    load_state = problem.state(state)
    parts = []
    new_loads = list({id(load): load for load, _ in load_state if id(load) not in vectors}.values())
    new_vectors = load_vectors(model.space, problem.elasticity, new_loads, model.lips)
    vectors.update(zip(map(id, new_loads), new_vectors, strict=True))
    for load, factor in load_state:
        vector = vectors[id(load)]
        parts.append(vector if factor == 1 else factor * vector)
    f = sum(parts, np.zeros(model.space.n_dof))
    u_imposed = load_state.factor * model.imposed_values.value
    moved_supports = [(load, factor) for load, factor in load_state if "support" in load.acts]
    for factor in sorted({factor for _, factor in moved_supports}):
        imposed_values = known_unknowns(
            model.space, [cast(Support, x) for x, f in moved_supports if f == factor]
        )
        u_imposed = np.where(
            imposed_values.is_fixed & model.imposed_values.is_fixed,
            factor * imposed_values.value,
            u_imposed,
        )
    size = max(np.abs(f).max(initial=0.0), np.abs(u_imposed).max(initial=0.0))
    if not size < _LARGEST:
        raise ProblemError(
            f"the loads of state {value_text(state)} give forces or displacements of up to "
            f"{size:.3g}, whose squares are no numbers: take other units."
        )
    return LoadCase(load_state, f, tuple(parts), u_imposed)


__all__ = []
