"""Coulomb friction on crack faces: tangential multipliers, and the load path of all states.

The functions of the pressures carry tangential tractions too: |shear| <= mu times pressure in each
function, which are positive, so that it holds everywhere. The slip counts from the unloaded body,
or from what an earlier crack state left behind.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, lock
from xcrack.contact.friction_path import Place, at_rest, march, shaken_down, with_slip
from xcrack.contact.multipliers import Multipliers, gap_rows
from xcrack.contact.result import Rubbing
from xcrack.contact.slip import weak_slip
from xcrack.scene.problem import Problem
from xcrack.solvers.coulomb import FrictionRows, Status, all_stuck
from xcrack.solvers.engine import Engine, StateContact
from xcrack.solvers.reuse import Slip
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.lips import LipPoints, jump_matrix
from xcrack.xfem.model import Model


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Contact with friction in all load states.

    Attributes
    ----------
    states : list of StateContact
    rubbing : list of Rubbing
        One for each crack with friction and multipliers.
    dissipated : tuple of float
        Energy since the state before.
    between : (n_dof, k) array, length
        Displacements of the substeps; none where nobody asked.
    """

    states: list[StateContact]
    rubbing: list[Rubbing]
    dissipated: tuple[float, ...]
    between: Floats


def rubs(problem: Problem, c: int) -> bool:
    """Whether the faces of crack c rub where they press."""
    return problem.contact != "off" and problem.frictions[c] > 0


def tangents(lips: LipPoints) -> Floats:
    """Directions of shear and slip at each point `(q, d - 1, d)`.

    In 2D along the order of the crack's points. In 3D the first is the direction that most normals
    are farthest from, laid onto the face, the second normal × first: both are continuous along
    curved faces.
    """
    return _TANGENTS[lips.x.shape[1]](lips)


def _tangents_2d(lips: LipPoints) -> Floats:
    return np.stack([lips.normal[:, 1], -lips.normal[:, 0]], axis=1)[:, None]


def _tangents_3d(lips: LipPoints) -> Floats:
    n = lips.normal
    along = np.linalg.eigh(n.T @ (lips.weight[:, None] * n))[1][:, 0]
    along = along * np.sign(along[np.argmax(np.abs(along))])
    first = along - (n @ along)[:, None] * n
    size = np.linalg.norm(first, axis=1, keepdims=True)
    first = np.where(size > 1e-6, first / np.maximum(size, 1e-300), np.roll(n, 1, axis=1))
    first = first - np.einsum("qi,qi->q", first, n)[:, None] * n
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(n, first)], axis=1)


_TANGENTS = {2: _tangents_2d, 3: _tangents_3d}


def tangential_rows(space: FunctionSpace, m: Multipliers, lips: LipPoints) -> list[sp.csr_matrix]:
    """Rows of the weak slips along each tangent `(g, n_dof)`."""
    jumps = tangential_jumps(space, m.crack, lips, tangents(lips))
    return [gap_rows(m, lips, jump) for jump in jumps]


def tangential_jumps(
    space: FunctionSpace, c: int, lips: LipPoints, directions: Floats
) -> list[sp.csr_matrix]:
    """Jumps along directions `(q, m, d)` at the lip points, each `(q, n_dof)`."""
    every = np.moveaxis(directions, 1, 0)
    return [jump_matrix(space, c, lips, along) for along in every]


def solve_friction(
    problem: Problem,
    model: Model,
    engine: Engine,
    chosen: Sequence[Multipliers],
    f: Floats,
    known: Floats,
    start: Bools | None,
    stiffness: float,
    between: bool,
    before: Sequence[Slip | None] | None,
    springs: Sequence[Floats] | None = None,
) -> FrictionSolution:
    """Solve all load states in their order, from the unloaded body; or a cycle that is repeated.

    Parameters
    ----------
    problem : Problem
    model : Model
    engine : Engine
    chosen : sequence of Multipliers
        Of the cracks that need contact.
    f, known : (n_dof, states) arrays
    start : (g,) array of bool or None
        First guess of the closed set.
    stiffness : float, stress / length
        As of `ContactRows`.
    between : bool
        Whether displacements of the substeps are asked for.
    before : sequence of Slip or None
        Of all cracks, for a cycle that is repeated until slip returns: what its last state left
        behind when the crack was shorter; empty where there was none. None: the path alone.
    springs : sequence of (g,) arrays, optional
        Compliances of the springs of an alternative to multipliers, one array a crack.

    Raises
    ------
    ConvergenceError
        A load for which no status of the functions stays.
    """
    faces = [_face(problem, model, m) for m in chosen]
    rubbing = [face for face in faces if face.mu > 0]
    along = [face.along[k] for k in range(model.space.dim - 1) for face in rubbing]
    N = sp.csr_matrix(sp.vstack([face.normal for face in faces] + along))
    small = engine.condensed(N, f, known)
    rows = _rows(faces, small.dual, stiffness)
    if springs is not None:
        every = np.concatenate(springs)
        diagonal = np.concatenate([every, np.tile(every[rows.rubbing], rows.tangents)])
        augmented = problem.numerics.comparison.lips == "augmented"
        rows = replace(rows, F=rows.F + np.diag(diagonal), compliance=diagonal, augmented=augmented)
    status = all_stuck(rows)
    if start is not None:
        status = Status(start, status.slip)
    elif problem.numerics.initial_set == "open":
        status = Status(np.zeros_like(status.closed), status.slip)
    begin, pass_through = at_rest(rows, status), march
    if before is not None:
        pass_through = shaken_down
        left = {c: slip for c, slip in enumerate(before)}
        slips = [left.get(r.space.crack) for r in rubbing]  # cracks may have joined others
        if any(slip is not None for slip in slips):
            weak = [
                weak_slip(model, r.space, r.tangents, s)
                for r, s in zip(rubbing, slips, strict=True)
            ]
            begin = with_slip(rows, small.gap[:, -1], np.concatenate(weak, axis=1).ravel(), status)
    places = pass_through(rows, small.gap, begin, problem.numerics.substeps)
    u = small.displacements(np.stack([place.lam for place in places], axis=1))
    states = [
        StateContact(p.lam[: rows.n], p.gap[: rows.n], p.status.closed, p.sets, u[:, k])
        for k, p in enumerate(places)
    ]
    return FrictionSolution(
        states,
        _by_crack(rubbing, rows, places),
        tuple(place.dissipated for place in places),
        _between(engine, N, f, known, places) if between else np.zeros((len(f), 0)),
    )


@dataclass(frozen=True, eq=False)
class _Face:
    """Rows of one crack."""

    space: Multipliers
    mu: float
    normal: sp.csr_matrix
    tangents: Floats
    jumps: list[sp.csr_matrix]
    along: list[sp.csr_matrix]


def _face(problem: Problem, model: Model, m: Multipliers) -> _Face:
    lips, mu = model.lips[m.crack], problem.frictions[m.crack]
    normal = gap_rows(m, lips, model.jumps[m.crack])
    if not mu:
        return _Face(m, mu, normal, np.zeros((0, 0, 0)), [], [])
    directions = tangents(lips)
    jumps = tangential_jumps(model.space, m.crack, lips, directions)
    along = [gap_rows(m, lips, jump) for jump in jumps]
    return _Face(m, mu, normal, directions, jumps, along)


def _rows(faces: Sequence[_Face], dual: Floats, stiffness: float) -> FrictionRows:
    measure = np.concatenate([face.space.measure for face in faces])
    mu = np.concatenate([np.full(len(face.space.measure), face.mu) for face in faces])
    rubbing = np.nonzero(mu > 0)[0]
    return FrictionRows(dual, measure, rubbing, mu[rubbing], stiffness)


def _by_crack(faces: Sequence[_Face], rows: FrictionRows, places: Sequence[Place]) -> list[Rubbing]:
    shear = np.stack([place.lam[rows.n :].reshape(rows.tangents, -1) for place in places], axis=2)
    stuck = np.stack([p.status.closed[rows.rubbing] & ~p.status.slips for p in places])
    result, first = [], 0
    for face in faces:
        own = slice(first, first + len(face.space.measure))
        result.append(
            Rubbing(face.space.crack, lock(face.tangents), face.jumps, shear[:, own], stuck[:, own])
        )
        first = own.stop
    return result


def _between(
    engine: Engine, N: sp.csr_matrix, f: Floats, known: Floats, places: Sequence[Place]
) -> Floats:
    """Displacements of all substeps: other faces may overlap in one of them."""
    loads, given = [], []
    before = np.zeros(len(f)), np.zeros(len(f))
    for k, place in enumerate(places):
        for share, lam in place.between[:-1]:
            loads.append(before[0] + share * (f[:, k] - before[0]) + N.T @ lam)
            given.append(before[1] + share * (known[:, k] - before[1]))
        before = f[:, k], known[:, k]
    if not loads:
        return np.zeros((len(f), 0))
    return engine.solve(np.stack(loads, axis=1), np.stack(given, axis=1))


__all__ = [
    "FrictionSolution",
    "rubs",
    "solve_friction",
    "tangential_jumps",
    "tangential_rows",
    "tangents",
]
