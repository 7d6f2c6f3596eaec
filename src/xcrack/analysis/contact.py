"""Contact of crack faces (lips): which cracks need multipliers, and the pressures in all states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import scipy.sparse as sp

from xcrack.analysis.friction import (
    FrictionSolution,
    FrictionWork,
    RubbingStates,
    has_friction,
    solve_friction,
)
from xcrack.analysis.multipliers import Multipliers, gap_rows, multipliers
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.fem.system import System
from xcrack.linalg.direct import DirectSystem
from xcrack.linalg.engine import ContactRows, Engine, SolverState, StateContact
from xcrack.linalg.products import times, times_transposed
from xcrack.model.problem import LoadState, Problem


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact on all faces of one crack in one load state, at their integration points.

    Attributes
    ----------
    points : (q, d) array, length
    normal : (q, d) array
        From lip - to lip +.
    measure : (q,) array, length^(d - 1)
        Weight of each point: sums are integrals along the crack face.
    pressure : (q,) array, stress
        The multiplier field, 0 where open.
    gap : (q,) array, length
        Normal opening n . [[u]].
    closed : (q,) array of bool
    s : (q,) array, length
        Position along the crack from where it enters the body.
    tangent : (q, 2) array, in 3D (q, 2, 3), optional
        With friction: direction of shear and slip, along the order of the crack's points; in 3D two
        directions. None without, as the three that follow.
    shear : (q,) array, in 3D (q, 2), stress, optional
        Tangential traction on lip + along the tangents; lip - bears the opposite one.
    slip : (q,) array, in 3D (q, 2), length, optional
        Tangential jump, that of lip + less that of lip -.
    stuck : (q,) array of bool, optional
        Closed, and without slip since the substep before.
    """

    points: Floats
    normal: Floats
    measure: Floats
    pressure: Floats
    gap: Floats
    closed: Bools
    s: Floats
    tangent: Floats | None = None
    shear: Floats | None = None
    slip: Floats | None = None
    stuck: Bools | None = None


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Displacements and contact pressures of all load states.

    Attributes
    ----------
    u : (n_dof, states) array, length
    spaces : tuple of Multipliers or None
        One entry a crack; None for a crack without multipliers.
    pressure : tuple of (g, states) arrays or None
    active : tuple of (states, g) arrays of bool or None
    sets : int
        Closed sets tried in the worst state.
    dual : (g, g) array or None
        F = N K^-1 N^T over the multipliers of all cracks in their order; None where no
        factorisation made it.
    friction_work : tuple of FrictionWork
        Of the cracks whose faces rub.
    dissipated : tuple of float
        Energy that friction took in each state since the one before; empty without.
    rubbing_states : RubbingStates or None
        In 2D with friction.
    """

    u: Floats
    spaces: tuple[Multipliers | None, ...]
    pressure: tuple[Floats | None, ...]
    active: tuple[Bools | None, ...]
    sets: int
    dual: Floats | None = None
    friction_work: tuple[FrictionWork, ...] = ()
    dissipated: tuple[float, ...] = ()
    rubbing_states: RubbingStates | None = None

    def closed_sets(self) -> SolverState:
        """Closed sets by place, for the next solve."""
        centre = tuple(None if m is None else m.centre for m in self.spaces)
        return SolverState(centre, self.active)


_OVERLAP = 1e-9  # share of the largest displacement by which faces must overlap to need contact


def solve_contact(
    problem: Problem,
    model: System,
    engine: Engine,
    f: Floats,
    u_imposed: Floats,
    reuse: SolverState,
    load_states: Sequence[LoadState],
    is_repeated: bool = False,
) -> ContactSolution:
    """Solve, and give multipliers to cracks whose faces overlap, until none does.

    Conjugate gradients spend as few steps as they can on faces that are not to overlap: a crack
    that was closed in the step before gets its multipliers at once, and without any such crack
    the first solution is a rough one, made exact where nothing overlaps.

    Parameters
    ----------
    problem : Problem
    model : System
    engine : Engine
    f, u_imposed : (n_dof, states) arrays
        Loads, and displacements that supports impose.
    reuse : SolverState
        Of an earlier step.
    load_states : sequence of LoadState
        Loads of each state: some methods need what acts on the faces besides.
    is_repeated : bool
        With friction: the states are a cycle, repeated until slip returns.
    """
    n = len(model.lips)
    spaces: list[Multipliers | None] = [None] * n
    pressure: list[Floats | None] = [None] * n
    closed_sets: list[Bools | None] = [None] * n
    expected_cracks: list[int] = []
    trials: dict[int, Multipliers] = {}
    sets, dual = 0, None
    friction_solution: FrictionSolution | None = None
    contacts: list[Multipliers] = []
    u: Floats | None
    pending_cracks: list[int] = []
    if problem.contact == "off":
        u = engine.solve(f, u_imposed)
    else:
        # A factorisation needs no look at open faces where all cracks get multipliers anyway.
        is_certain = problem.contact == "on" and isinstance(engine, DirectSystem)
        closed_cracks = [
            c for c in range(n) if len(model.lips[c]) and (is_certain or reuse.was_closed(c))
        ]
        u, pending_cracks = _first_look(problem, model, engine, f, u_imposed, closed_cracks, trials)
        if u is None:
            expected_cracks = closed_cracks
    u_opened = u
    while pending_cracks:
        for c in pending_cracks:
            spaces[c] = _space(problem, model, c, trials)
        contacts = [m for m in spaces if m is not None]
        if any(has_friction(problem, m.crack) for m in contacts):
            friction_solution = _solve_friction(
                problem, model, engine, contacts, f, u_imposed, reuse, is_repeated
            )
            states = friction_solution.states
        else:
            states = _solve_states(
                problem, model, engine, contacts, f, u_imposed, (u, u_opened), reuse, load_states
            )
        u = np.stack([cast(Floats, state.u) for state in states], axis=1)
        sets, dual = max(state.sets for state in states), states[0].dual
        first = 0
        for m in contacts:
            stop = first + len(m.measure)
            pressure[m.crack] = np.stack([s.pressure[first:stop] for s in states], axis=1)
            closed_sets[m.crack] = np.stack([s.active[first:stop] for s in states])
            first = stop
        displacements = (
            u
            if friction_solution is None
            else np.concatenate([u, friction_solution.motion_between], axis=1)
        )
        pending_cracks = _overlapping_cracks(problem, model, displacements, spaces, trials)
    assert u is not None  # of the first look, or of the loop that it made begin
    if friction_solution is not None:
        parts = tuple(spaces), tuple(pressure), tuple(closed_sets)
        return ContactSolution(
            u,
            *parts,
            sets,
            friction_work=tuple(friction_solution.work),
            dissipated=friction_solution.dissipated,
            rubbing_states=friction_solution.rubbing_states,
        )
    for c in expected_cracks:
        closed_groups = closed_sets[c]
        if closed_groups is not None and not closed_groups.any() and problem.contact != "on":
            spaces[c] = pressure[c] = closed_sets[c] = None
    if dual is not None and expected_cracks:
        is_retained = np.repeat(
            [spaces[m.crack] is not None for m in contacts], [len(m.measure) for m in contacts]
        )
        dual = dual[np.ix_(is_retained, is_retained)]
    return ContactSolution(u, tuple(spaces), tuple(pressure), tuple(closed_sets), sets, dual)


def open_solution(
    problem: Problem, model: System, engine: Engine, f: Floats, u_imposed: Floats
) -> ContactSolution | None:
    """The solution without pressures; None where faces overlap in it.

    Parameters
    ----------
    problem : Problem
    model : System
    engine : Engine
    f, u_imposed : (n_dof, states) arrays
        Loads, and displacements that supports impose.
    """
    u, pending_cracks = _first_look(problem, model, engine, f, u_imposed, [], {})
    if u is None or pending_cracks:
        return None
    n = len(model.lips)
    return ContactSolution(u, (None,) * n, (None,) * n, (None,) * n, 0)


def _first_look(
    problem: Problem,
    model: System,
    engine: Engine,
    f: Floats,
    u_imposed: Floats,
    closed_cracks: list[int],
    trials: dict[int, Multipliers],
) -> tuple[Floats | None, list[int]]:
    """Displacements of open faces and the cracks that overlap; exact where none does."""
    spaces: list[Multipliers | None] = [None] * len(model.lips)
    u, is_exact = engine.first_look(f, u_imposed, bool(closed_cracks))
    if u is None:
        return None, closed_cracks
    pending_cracks = _overlapping_cracks(problem, model, u, spaces, trials)
    if not pending_cracks and not is_exact:
        u = engine.solve(f, u_imposed, u)
        pending_cracks = _overlapping_cracks(problem, model, u, spaces, trials)
    return u, pending_cracks


def _solve_friction(
    problem: Problem,
    model: System,
    engine: Engine,
    spaces: list[Multipliers],
    f: Floats,
    u_imposed: Floats,
    reuse: SolverState,
    is_repeated: bool,
) -> FrictionSolution:
    """The load path of all states; substeps count where a crack has no multipliers yet."""
    is_closed_first = problem.numerics.initial_set == "closed"
    cracks_with_contact = {m.crack for m in spaces}
    has_others = any(
        len(lips) and c not in cracks_with_contact for c, lips in enumerate(model.lips)
    )
    start, size = _start(spaces, reuse, 0, is_closed_first), _face_size(model, spaces)
    stiffness = problem.elasticity.largest_modulus / size
    earlier_slip = reuse.slip if is_repeated else None
    springs = None
    method = problem.numerics.contact_method
    if method is not None:
        springs = [method.compliance(problem, model, m) for m in spaces]
    return solve_friction(
        problem,
        model,
        engine,
        spaces,
        f,
        u_imposed,
        start,
        stiffness,
        has_others,
        earlier_slip,
        springs,
    )


def _solve_states(
    problem: Problem,
    model: System,
    engine: Engine,
    spaces: list[Multipliers],
    f: Floats,
    u_imposed: Floats,
    guess: tuple[Floats | None, Floats | None],
    reuse: SolverState,
    load_states: Sequence[LoadState],
) -> list[StateContact]:
    """Contact of all load states; `guess` is the latest u and that of open faces."""
    is_closed_first = problem.numerics.initial_set == "closed"
    start = [_start(spaces, reuse, k, is_closed_first) for k in range(f.shape[1])]
    method = problem.numerics.contact_method
    if method is not None:
        return cast(
            list[StateContact],
            method.solve_states(
                problem, model, engine, spaces, f, u_imposed, start, is_closed_first, load_states
            ),
        )
    rows = [gap_rows(m, model.lips[m.crack], model.jumps[m.crack]) for m in spaces]
    N = rows[0] if len(rows) == 1 else sp.csr_matrix(sp.vstack(rows))
    measure = np.concatenate([m.measure for m in spaces])
    stiffness = problem.elasticity.largest_modulus / _face_size(model, spaces)
    conditions = ContactRows(N, measure, stiffness, is_closed_first)
    return engine.contact(conditions, f, u_imposed, start, *guess)


def _overlapping_cracks(
    problem: Problem,
    model: System,
    u: Floats,
    spaces: Sequence[Multipliers | None],
    trials: dict[int, Multipliers],
) -> list[int]:
    """Cracks without multipliers whose faces overlap in some load state.

    The multipliers that say so are kept in `trials`, by crack.
    """
    cracks_in_need = []
    for c, lips in enumerate(model.lips):
        if spaces[c] is not None or not len(lips):
            continue
        if problem.contact == "on":
            cracks_in_need.append(c)
            continue
        gap = times(model.jumps[c], u)
        limit = -_OVERLAP * np.abs(u[: model.space.n_nodes * model.space.dim]).max(axis=0)
        if (gap.min(axis=0) >= limit).all():
            continue
        if c not in trials:
            trials[c] = multipliers(
                model.space, c, lips, problem.numerics.multipliers, model.imposed_values.is_fixed,
                material=material_numbers(problem),
            )  # fmt: skip
        trial = trials[c]
        weighted_gap = times_transposed(trial.values, lips.weight[:, None] * gap)
        weak_gap = weighted_gap / trial.measure[:, None]
        if (weak_gap.min(axis=0) < limit).any():
            cracks_in_need.append(c)
    return cracks_in_need


def _space(
    problem: Problem, model: System, c: int, trials: Mapping[int, Multipliers]
) -> Multipliers:
    """Where the pressures of a crack live: as tried already, where nothing asks for others."""
    method = problem.numerics.contact_method
    if method is not None:
        return cast(Multipliers, method.pressure_space(problem, model, c))
    kind = problem.numerics.multipliers
    is_fixed, rub = model.imposed_values.is_fixed, has_friction(problem, c)
    if c in trials and not rub:
        return trials[c]
    return multipliers(
        model.space, c, model.lips[c], kind, is_fixed, rub, material_numbers(problem)
    )


def material_numbers(problem: Problem) -> Ints | None:
    """Number of the material of each cell, where there are several."""
    number = problem.elasticity.number
    return number if len(number) else None


def _start(spaces: list[Multipliers], reuse: SolverState, k: int, is_closed: bool) -> Bools | None:
    """Closed set that state k starts from; None where no step came before."""
    if not reuse.centre:
        return None
    parts = []
    for m in spaces:
        earlier_set = reuse.start(m.crack, m.centre, k)
        parts.append(np.full(len(m.measure), is_closed) if earlier_set is None else earlier_set)
    return np.concatenate(parts)


def _face_size(model: System, spaces: list[Multipliers]) -> float:
    cells = np.unique(np.concatenate([model.lips[m.crack].cell.ravel() for m in spaces]))
    return float(model.space.mesh.cell_size[cells].mean())


def contact_of(
    model: System, solution: ContactSolution, u: Floats, k: int
) -> tuple[Contact | None, ...]:
    """Contact of each crack in state k, None where it has no multipliers."""
    result: list[Contact | None] = []
    work_of_crack = {work.crack: work for work in solution.friction_work}
    for c, lips in enumerate(model.lips):
        m, pressure, is_active = solution.spaces[c], solution.pressure[c], solution.active[c]
        if m is None or pressure is None or is_active is None:
            result.append(None)
            continue
        is_closed = np.asarray(m.values @ is_active[k].astype(float)) >= 0.5
        contact_fields: dict[str, Any] = {}
        if c in work_of_crack:
            contact_fields = _friction_fields(m, work_of_crack[c], u, k)
        result.append(
            Contact(
                lips.x,
                lips.normal,
                lips.weight,
                lock(np.asarray(m.values @ pressure[:, k])),
                lock(np.asarray(model.jumps[c] @ u)),
                lock(is_closed),
                lips.s,
                **contact_fields,
            )
        )
    return tuple(result)


def _friction_fields(m: Multipliers, work: FrictionWork, u: Floats, k: int) -> dict[str, Any]:
    """What friction adds to the contact of one crack in state k."""
    is_stuck = np.asarray(m.values @ work.stuck[k].astype(float)) >= 0.5
    shear = np.stack([m.values @ tractions[:, k] for tractions in work.shear], axis=1)
    slip = np.stack([jump @ u for jump in work.jumps], axis=1)
    component = (slice(None), 0) if len(work.jumps) == 1 else ()
    return {
        "tangent": lock(work.tangents[component]),
        "shear": lock(np.ascontiguousarray(shear[component])),
        "slip": lock(np.ascontiguousarray(slip[component])),
        "stuck": lock(is_stuck),
    }
