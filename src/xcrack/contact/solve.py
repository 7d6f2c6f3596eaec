"""Which cracks need multipliers, and the pressures on their lips in all load states."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, lock
from xcrack.contact.active_set import active_set
from xcrack.contact.alternatives import Held, held_lips, lip_space
from xcrack.contact.multipliers import Multipliers, gap_rows, multipliers
from xcrack.contact.result import Contact
from xcrack.contact.warm_start import Warm
from xcrack.scene.conditions import Load
from xcrack.scene.problem import Problem
from xcrack.solvers.direct import System
from xcrack.solvers.iterative import IterativeSystem
from xcrack.xfem.model import Model

_OVERLAP = 1e-9  # share of the largest displacement by which lips must overlap to need contact
_ROUGH = 0.02  # residual of a first solution that only shows which lips overlap
_BLOCK = 16  # right-hand sides solved at once for the dual matrix; bounds the memory


@dataclass(frozen=True, eq=False)
class Pressed:
    """Pressures on the lips in all load states.

    Attributes
    ----------
    u : (n_dof, states) array, length
    spaces : tuple of Multipliers or None
        One entry a crack.
    pressure : tuple of (g, states) arrays or None
    active : tuple of (states, g) arrays of bool or None
    warm : Warm
        What the next step may start from.
    iterations : int
        Sets tried in the worst state.
    """

    u: Floats
    spaces: tuple[Multipliers | None, ...]
    pressure: tuple[Floats | None, ...]
    active: tuple[Bools | None, ...]
    warm: Warm
    iterations: int


def contact(
    problem: Problem,
    model: Model,
    engine: System | IterativeSystem,
    f: Floats,
    known: Floats,
    warm: Warm | None,
    acting: Sequence[tuple[tuple[Load, ...], float]],
) -> Pressed:
    """Solve, and give multipliers to cracks whose lips overlap, until none does.

    Conjugate gradients spend as few steps as they can on lips that are not to overlap: a crack
    that was closed in the step before gets its multipliers at once, and without any such crack
    the first solution is a rough one, made exact where nothing overlaps.

    Parameters
    ----------
    problem : Problem
    model : Model
    engine : System or IterativeSystem
    f, known : (n_dof, states) arrays
        Loads, and displacements that supports impose.
    warm : Warm, optional
        Of an earlier step.
    acting : sequence of (loads, factor)
        Loads of each state and their scale, for Nitsche's method: what acts on the lips besides.
    """
    n = len(model.lips)
    spaces: list[Multipliers | None] = [None] * n
    pressure: list[Floats | None] = [None] * n
    active: list[Bools | None] = [None] * n
    iterations = 0
    open_u, pending = _first(problem, model, engine, f, known, warm)
    expected = pending if open_u is None else []
    u = open_u
    while pending:
        for c in pending:
            spaces[c] = lip_space(problem, model, c)
        chosen = [m for m in spaces if m is not None]
        if problem.numerics.lips == "multipliers":
            held = _by_multipliers(problem, model, engine, chosen, f, known, (u, open_u), warm)
        else:
            start = [_start(problem, chosen, warm, k) for k in range(f.shape[1])]
            assert isinstance(engine, System)  # Numerics and solving see to it
            held = held_lips(problem, model, engine, chosen, f, known, start, acting)
        u, iterations = held.u, held.iterations
        first = 0
        for m in chosen:
            last = first + len(m.measure)
            pressure[m.crack] = held.pressure[first:last]
            active[m.crack] = held.active[:, first:last]
            first = last
        pending = _needing(problem, model, u, spaces)
    assert u is not None
    for c in expected:
        states = active[c]
        if states is not None and not states.any() and problem.contact != "on":
            spaces[c] = pressure[c] = active[c] = None
    centre = tuple(None if m is None else m.centre for m in spaces)
    return Pressed(
        u, tuple(spaces), tuple(pressure), tuple(active), Warm(centre, tuple(active)), iterations
    )


def _by_multipliers(
    problem: Problem,
    model: Model,
    engine: System | IterativeSystem,
    chosen: list[Multipliers],
    f: Floats,
    known: Floats,
    guess: tuple[Floats | None, Floats | None],
    warm: Warm | None,
) -> Held:
    """Pressures of all load states by multipliers; `guess` is the last u and that of open lips."""
    u, open_u = guess
    rows = [gap_rows(m, model.lips[m.crack], model.jumps[m.crack]) for m in chosen]
    N = rows[0] if len(rows) == 1 else _stacked(rows)
    measure = np.concatenate([m.measure for m in chosen])
    states = range(f.shape[1])
    stiffness = problem.material.E / _lip_size(model, chosen)
    if isinstance(engine, IterativeSystem):
        # Without an earlier set the overlap of the open lips is the best guess.
        first = [None if warm is None else _start(problem, chosen, warm, k) for k in states]
        sets: list[Any] = engine.contact(N, f, known, measure, stiffness, first, u)
        u = np.stack([s.u for s in sets], axis=1)
        lam = np.stack([s.pressure for s in sets], axis=1)
    else:
        F = dual(engine, N)
        assert open_u is not None
        d = N @ open_u
        sets = [
            active_set(F, d[:, k], measure, stiffness, _start(problem, chosen, warm, k))
            for k in states
        ]
        lam = np.stack([s.pressure for s in sets], axis=1)
        u = engine.solve(f + N.T @ lam, known)
    return Held(u, lam, np.stack([s.active for s in sets]), max(s.iterations for s in sets))


def _first(
    problem: Problem,
    model: Model,
    engine: System | IterativeSystem,
    f: Floats,
    known: Floats,
    warm: Warm | None,
) -> tuple[Floats | None, list[int]]:
    """Displacements with open lips, if they were needed, and the cracks that need contact."""
    none: list[Multipliers | None] = [None] * len(model.lips)
    if isinstance(engine, IterativeSystem) and problem.contact != "off":
        closed = [] if warm is None else [c for c in range(len(none)) if warm.closed(c)]
        closed = [c for c in closed if len(model.lips[c])]
        if closed:
            return None, closed
        u = engine.solve(f, known, tolerance=_ROUGH)
        pending = _needing(problem, model, u, none)
        if pending:
            return u, pending
        u = engine.solve(f, known, u)
    else:
        u = engine.solve(f, known)
    return u, _needing(problem, model, u, none)


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


def contact_of(model: Model, found: Pressed, u: Floats, k: int) -> tuple[Contact | None, ...]:
    """Contact of each crack in state k, None where it has no multipliers."""
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
