"""Coulomb friction on crack faces: tangential multipliers, and the load path of all states.

The functions of the pressures carry tangential tractions too: |shear| <= mu times pressure in each
function, which are positive, so that it holds everywhere. The slip counts from the unloaded body,
or from what an earlier crack state left behind.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from xcrack.analysis.multipliers import Multipliers, gap_rows
from xcrack.base.arrays import Bools, Floats, lock
from xcrack.base.errors import ConvergenceError, warn
from xcrack.fem.facets import LipPoints, arc_position, jump_matrix
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.system import System
from xcrack.linalg.coulomb import (
    FrictionRows,
    FrictionState,
    Status,
    all_stuck,
    coulomb,
    coulomb_3d,
)
from xcrack.linalg.engine import Engine, SlipField, StateContact
from xcrack.model.problem import Problem


@dataclass(frozen=True, eq=False)
class FrictionWork:
    """Friction on the faces of one crack in all load states.

    Attributes
    ----------
    crack : int
    tangents : (q, m, d) array
        One in 2D, two in 3D.
    jumps : list of m sparse matrices (q, n_dof)
        Tangential jumps at the lip points.
    shear : (m, g, states) array, stress
        Tangential tractions of each multiplier function.
    stuck : (states, g) array of bool
    """

    crack: int
    tangents: Floats
    jumps: list[sp.csr_matrix]
    shear: Floats
    stuck: Bools


# Slip that a crack state leaves to the next one of the grown crack.

_OTHER = 0.1  # distance over the length of a crack from which on it is another crack


def slip_of(
    model: System, works: tuple[FrictionWork, ...], u: Floats
) -> tuple[SlipField | None, ...]:
    """Slip of all cracks in one state, None where nothing rubs.

    Parameters
    ----------
    model : System
    works : tuple of FrictionWork
    u : (n_dof,) array, length
    """
    result: list[SlipField | None] = [None] * len(model.lips)
    for work in works:
        slip = np.stack([jump @ u for jump in work.jumps], axis=1)
        result[work.crack] = _SLIP[model.space.dim].slip_left(model, work, slip)
    return tuple(result)


def weak_slip(
    model: System, m: Multipliers, tangents: Floats, earlier_slip: SlipField | None
) -> Floats:
    """Integrals of each function times the slip that was left `(d - 1, g)`.

    Parameters
    ----------
    model : System
    m : Multipliers
    tangents : (q, d - 1, d) array
    earlier_slip : SlipField or None
        None where nothing was left.
    """
    lips = model.lips[m.crack]
    slip = np.zeros((len(lips), tangents.shape[1]))
    if earlier_slip is not None and len(earlier_slip.slip):
        slip = _SLIP[model.space.dim].slip_before(model, m.crack, tangents, earlier_slip)
    return np.asarray((m.values.T @ (lips.weight[:, None] * slip)).T)


def _left_2d(model: System, work: FrictionWork, slip: Floats) -> SlipField:
    points = model.space.cracks[work.crack].points
    place = _places(points, model.lips[work.crack])
    return SlipField(points, lock(place), lock(slip[:, 0]))


def _left_3d(model: System, work: FrictionWork, slip_components: Floats) -> SlipField:
    lips = model.lips[work.crack]
    slip = np.einsum("qm,qmd->qd", slip_components, work.tangents)
    return SlipField(lips.x, lock(np.sqrt(lips.weight)), lock(slip))


def _again_2d(model: System, c: int, tangents: Floats, earlier_slip: SlipField) -> Floats:
    lips, points = model.lips[c], model.space.cracks[c].points
    first = _first_point_number(earlier_slip.points, points)
    line_length = np.linalg.norm(np.diff(earlier_slip.points, axis=0), axis=1).sum()
    if _distance(earlier_slip.points, points, first) > _OTHER * line_length:
        return np.zeros((len(lips), 1))
    place = _places(points, lips) - first
    is_inside = (place >= 0) & (place <= len(earlier_slip.points) - 1)
    slip = np.where(is_inside, np.interp(place, earlier_slip.place, earlier_slip.slip), 0.0)
    return np.asarray(slip[:, None])


def _again_3d(model: System, c: int, tangents: Floats, earlier_slip: SlipField) -> Floats:
    """Of the nearest point before, none farther than its own piece of face is wide."""
    distance, rows = cKDTree(earlier_slip.points).query(model.lips[c].x)
    slip = np.where((distance <= earlier_slip.place[rows])[:, None], earlier_slip.slip[rows], 0.0)
    return np.einsum("qmd,qd->qm", tangents, slip)


def _places(points: Floats, lips: LipPoints) -> Floats:
    """Number of the face, plus share of its length `(q,)`."""
    ends = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.interp(arc_position(points, lips.x), ends, np.arange(len(points)))


def _first_point_number(old_points: Floats, new_points: Floats) -> int:
    """Number of the new point that the first old one is.

    Cracks grow by points at their ends, and corrections move the last ones a little.
    """
    shifts = range(
        min(0, len(new_points) - len(old_points)), max(1, len(new_points) - len(old_points) + 1)
    )
    return min(shifts, key=lambda shift: _distance(old_points, new_points, shift))


def _distance(old_points: Floats, new_points: Floats, shift: int) -> float:
    """Median distance of old points to the new ones that they would be."""
    start, stop = max(0, -shift), min(len(old_points), len(new_points) - shift)
    return float(
        np.median(
            np.linalg.norm(
                old_points[start:stop] - new_points[start + shift : stop + shift], axis=1
            )
        )
    )


# The load path of crack faces with friction: states in their order, in substeps.

_SHORTEST = 1e-2  # share of a state below which a substep is not halved
_OPEN = 1e-9  # gap over the largest one above which a function is open
_RETURNED = 1e-6  # change of slip over a cycle, of the largest jump, at which cycles end
_MOST_CYCLES = 100
_MOST_UPDATES = 500
_UPDATED = 1e-8  # change of tractions, of the largest, that ends the updates
_TWIN = {1: coulomb, 2: coulomb_3d}  # by the number of tangents


@dataclass(frozen=True, eq=False)
class SlipPoint:
    """Where a path stands.

    Attributes
    ----------
    d : (g + r,) array
        Weak gaps and slips of the load without tractions.
    lam : (g + r,) array, stress
        Pressures and tangential tractions.
    gap : (g + r,) array
        Weak gaps and slips.
    status : Status
    dissipated : float, energy (per thickness in 2D)
        Since the state before.
    sets : int
        Sets tried since then, in the worst substep.
    tractions_between : tuple of (share, lam)
        Tractions of all substeps, and where they lie between the state before (0) and this one (1).
    at_rest : bool
        Nothing has acted so far.
    change : (g + r,) array
        Weak gaps of the load without tractions, and slips since the substep before: of these follow
        `lam` and `status`. Empty at rest.
    """

    d: Floats
    lam: Floats
    gap: Floats
    status: Status
    dissipated: float = 0.0
    sets: int = 0
    tractions_between: tuple[tuple[float, Floats], ...] = ()
    at_rest: bool = False
    change: Floats = field(default_factory=lambda: np.zeros(0))


def at_rest(rows: FrictionRows, status: Status) -> SlipPoint:
    """The unloaded body; `status` is where the first guess comes from."""
    nothing = np.zeros(len(rows.F))
    return SlipPoint(nothing, nothing, nothing, status, at_rest=True)


def with_slip(rows: FrictionRows, d: Floats, slip: Floats, status: Status) -> SlipPoint:
    """A state whose weak slips `(r,)` before are given: faces that press stick there, or slide."""
    initial_slip = np.concatenate([np.zeros(rows.n), slip])
    state = _tractions(rows, d - initial_slip, status)
    return SlipPoint(d, state.lam, state.gap + initial_slip, state.status, sets=state.sets)


def march(rows: FrictionRows, d: Floats, begin: SlipPoint, substeps: int) -> list[SlipPoint]:
    """All states in their order.

    Parameters
    ----------
    rows : FrictionRows
    d : (g + r, states) array
        Weak gaps and slips of the states without tractions.
    begin : SlipPoint
    substeps : int
        From one state to the next.

    Raises
    ------
    ConvergenceError
        As of `coulomb`.
    """
    places, place = [], begin
    for load in d.T:
        place = _next_point(rows, load, place, substeps)
        places.append(place)
    return places


def shaken_down(rows: FrictionRows, d: Floats, begin: SlipPoint, substeps: int) -> list[SlipPoint]:
    """Cycles through all states until slip returns; the states of the last one.

    Parameters
    ----------
    rows, d, begin, substeps
        As of `march`.

    Warns
    -----
    XcrackWarning
        Slip that still drifts after a hundred cycles.
    """
    weight = 1 / rows.sizes
    places = march(rows, d, begin, substeps)
    for _ in range(_MOST_CYCLES):
        start_place = places[-1]
        places = march(rows, d, start_place, substeps)
        drift = float(np.abs((places[-1].gap - start_place.gap)[rows.n :] * weight[rows.n :]).max())
        jump = max(float(np.abs(place.gap * weight).max()) for place in places)
        if drift <= _RETURNED * jump:
            return places
    warn(
        f"friction: after {_MOST_CYCLES} cycles the slip of the crack faces still changes by "
        f"{drift:.3g} a cycle, where the largest jump is {jump:.3g}; K is "
        "that of the last cycle."
    )
    return places


def _next_point(rows: FrictionRows, load: Floats, begin: SlipPoint, substeps: int) -> SlipPoint:
    """The next state."""
    longest_step = 1.0 if begin.at_rest else 1.0 / substeps
    shortest_step = min(longest_step, _SHORTEST)
    t, step, place = 0.0, longest_step, begin
    work, sets = 0.0, 0
    tractions_between: list[tuple[float, Floats]] = []
    while t < 1.0:
        end = t + step
        end = 1.0 if end > 1.0 - 1e-9 else end
        d = begin.d + end * (load - begin.d)
        state = _friction_solution(rows, d, place)
        sets = max(sets, state.sets)
        closing = state.status.is_closed & _open_functions(rows, place)
        if closing.any() and step > shortest_step:
            step = max(step / 2, shortest_step)
            continue
        work += _friction_work(rows, place, state)
        gap = state.gap.copy()
        gap[rows.n :] += place.gap[rows.n :]
        place = SlipPoint(d, state.lam, gap, state.status, change=_change_since(rows, d, place))
        tractions_between.append((end, state.lam))
        t, step = end, min(2 * step, longest_step)
    return SlipPoint(
        place.d, place.lam, place.gap, place.status, work, sets, tuple(tractions_between),
        change=place.change,
    )  # fmt: skip


def _friction_solution(rows: FrictionRows, d: Floats, place: SlipPoint) -> FrictionState:
    return _tractions(rows, _change_since(rows, d, place), place.status)


def _change_since(rows: FrictionRows, d: Floats, place: SlipPoint) -> Floats:
    """Weak gaps without tractions, and slips since a place."""
    change = d.copy()
    change[rows.n :] -= place.gap[rows.n :]
    return change


def _tractions(rows: FrictionRows, d: Floats, status: Status) -> FrictionState:
    """Of one load; by an augmented Lagrangian in updates (Simo and Laursen, 1992)."""
    solve = _TWIN[rows.tangents]
    if rows.compliance is None:
        return solve(rows, d, status)
    if not rows.is_augmented:
        try:
            return solve(rows, d, status)
        except ConvergenceError as error:
            raise ConvergenceError(
                f"{error} Or a smaller factor of the penalty: stiff springs at single points "
                "oscillate."
            ) from None
    lam, sets = np.zeros(len(d)), 0
    for _ in range(_MOST_UPDATES):
        state = solve(rows, d - rows.compliance * lam, status)
        sets += state.sets
        change = float(np.abs(state.lam - lam).max(initial=0.0))
        lam, status = state.lam, state.status
        if change <= _UPDATED * float(np.abs(lam).max(initial=0.0)):
            return replace(state, sets=sets)
    raise ConvergenceError(
        f"contact with friction: after {_MOST_UPDATES} updates the tractions still change by "
        f"{change:.3g}. Give a larger factor of the springs."
    )


def _open_functions(rows: FrictionRows, place: SlipPoint) -> Bools:
    """Functions with a gap that is more than round-off."""
    largest_gap = float(np.abs(place.gap / rows.sizes).max(initial=0.0))
    return np.asarray(place.gap[: rows.n] / rows.measure > _OPEN * largest_gap)


def _friction_work(rows: FrictionRows, start_place: SlipPoint, state: FrictionState) -> float:
    """Work of the tractions of slipping functions: their mean bound over the substep times slip."""
    slips = state.status.slips
    pressure = 0.5 * (np.maximum(start_place.lam, 0.0) + state.lam)[: rows.n][rows.rubbing_rows]
    slip = np.sqrt((state.gap[rows.n :].reshape(rows.tangents, -1) ** 2).sum(axis=0))
    return float((rows.mu * pressure * slip)[slips].sum())


@dataclass(frozen=True, eq=False)
class RubbingStates:
    """What the tractions of all states follow from, in 2D: `of_status(rows, change, status)`.

    Attributes
    ----------
    N : sparse matrix (g + r, n_dof)
        Weak gaps, and weak slips.
    rows : FrictionRows
    change : (states, g + r) array
        As of `SlipPoint`.
    status : tuple of Status
    """

    N: sp.csr_matrix
    rows: FrictionRows
    change: Floats
    status: tuple[Status, ...]


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Contact with friction in all load states.

    Attributes
    ----------
    states : list of StateContact
    work : list of FrictionWork
        One for each crack with friction and multipliers.
    dissipated : tuple of float
        Energy since the state before.
    motion_between : (n_dof, k) array, length
        Displacements of the substeps; none where nobody asked.
    rubbing_states : RubbingStates or None
        None in 3D, and for an alternative to multipliers.
    """

    states: list[StateContact]
    work: list[FrictionWork]
    dissipated: tuple[float, ...]
    motion_between: Floats
    rubbing_states: RubbingStates | None = None


def has_friction(problem: Problem, c: int) -> bool:
    """Whether the faces of crack c rub where they press."""
    return problem.contact != "off" and problem.frictions[c] > 0


def tangents(lips: LipPoints) -> Floats:
    """Directions of shear and slip at each point `(q, d - 1, d)`.

    In 2D along the order of the crack's points. In 3D the first is the direction that most normals
    are farthest from, laid onto the face, the second normal × first: both are continuous along
    curved faces.
    """
    return _SLIP[lips.x.shape[1]].tangents(lips)


def _tangents_2d(lips: LipPoints) -> Floats:
    return np.stack([lips.normal[:, 1], -lips.normal[:, 0]], axis=1)[:, None]


def _tangents_3d(lips: LipPoints) -> Floats:
    n = lips.normal
    first_direction = np.linalg.eigh(n.T @ (lips.weight[:, None] * n))[1][:, 0]
    first_direction = first_direction * np.sign(first_direction[np.argmax(np.abs(first_direction))])
    first = first_direction - (n @ first_direction)[:, None] * n
    size = np.linalg.norm(first, axis=1, keepdims=True)
    first = np.where(size > 1e-6, first / np.maximum(size, 1e-300), np.roll(n, 1, axis=1))
    first = first - np.einsum("qi,qi->q", first, n)[:, None] * n
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(n, first)], axis=1)


@dataclass(frozen=True)
class _Slip:
    """Slip that a state leaves, what of it is found again on a crack that has grown, directions."""

    slip_left: Callable[[System, FrictionWork, Floats], SlipField]
    slip_before: Callable[[System, int, Floats, SlipField], Floats]
    tangents: Callable[[LipPoints], Floats]


_SLIP = {
    2: _Slip(_left_2d, _again_2d, _tangents_2d),
    3: _Slip(_left_3d, _again_3d, _tangents_3d),
}


def tangential_rows(space: FunctionSpace, m: Multipliers, lips: LipPoints) -> list[sp.csr_matrix]:
    """Rows of the weak slips along each tangent `(g, n_dof)`."""
    jumps = tangential_jumps(space, m.crack, lips, tangents(lips))
    return [gap_rows(m, lips, jump) for jump in jumps]


def tangential_jumps(
    space: FunctionSpace, c: int, lips: LipPoints, directions: Floats
) -> list[sp.csr_matrix]:
    """Jumps along directions `(q, m, d)` at the lip points, each `(q, n_dof)`."""
    vectors = np.moveaxis(directions, 1, 0)
    return [jump_matrix(space, c, lips, tangents) for tangents in vectors]


def solve_friction(
    problem: Problem,
    model: System,
    engine: Engine,
    spaces: Sequence[Multipliers],
    f: Floats,
    u_imposed: Floats,
    start: Bools | None,
    stiffness: float,
    with_substeps: bool,
    earlier_slip: Sequence[SlipField | None] | None,
    springs: Sequence[Floats] | None = None,
) -> FrictionSolution:
    """Solve all load states in their order, from the unloaded body; or a cycle that is repeated.

    Parameters
    ----------
    problem : Problem
    model : System
    engine : Engine
    spaces : sequence of Multipliers
        Of the cracks that need contact.
    f, u_imposed : (n_dof, states) arrays
    start : (g,) array of bool or None
        First guess of the closed set.
    stiffness : float, stress / length
        As of `ContactRows`.
    with_substeps : bool
        Whether displacements of the substeps are asked for.
    earlier_slip : sequence of SlipField or None
        Of all cracks, for a cycle that is repeated until slip returns: what its last state left
        behind when the crack was shorter; empty where there was none. None: the path alone.
    springs : sequence of (g,) arrays, optional
        Compliances of the springs of an alternative to multipliers, one array a crack.

    Raises
    ------
    ConvergenceError
        A load for which no status of the functions stays.
    """
    faces = [_face(problem, model, m) for m in spaces]
    rubbing_faces = [face for face in faces if face.mu > 0]
    slip_rows = [face.slip_rows[k] for k in range(model.space.dim - 1) for face in rubbing_faces]
    N = sp.csr_matrix(sp.vstack([face.normal for face in faces] + slip_rows))
    condensed = engine.condense(N, f, u_imposed)
    rows = _rows(faces, condensed.dual, stiffness)
    if springs is not None:
        eps = np.concatenate(springs)
        diagonal = np.concatenate([eps, np.tile(eps[rows.rubbing_rows], rows.tangents)])
        method = problem.numerics.contact_method
        is_augmented = method is not None and method.updates
        rows = replace(
            rows, F=rows.F + np.diag(diagonal), compliance=diagonal, is_augmented=is_augmented
        )
    status = all_stuck(rows)
    if start is not None:
        status = Status(start, status.slip)
    elif problem.numerics.initial_set == "open":
        status = Status(np.zeros_like(status.is_closed), status.slip)
    begin, pass_through = at_rest(rows, status), march
    if earlier_slip is not None:
        pass_through = shaken_down
        slip_left = {c: slip for c, slip in enumerate(earlier_slip)}
        slips = [
            slip_left.get(r.space.crack) for r in rubbing_faces
        ]  # cracks may have joined others
        if any(slip is not None for slip in slips):
            slip_of_faces = [
                weak_slip(model, r.space, r.tangents, s)
                for r, s in zip(rubbing_faces, slips, strict=True)
            ]
            begin = with_slip(
                rows, condensed.gap[:, -1], np.concatenate(slip_of_faces, axis=1).ravel(), status
            )
    places = pass_through(rows, condensed.gap, begin, problem.numerics.substeps)
    u = condensed.displacements(np.stack([place.lam for place in places], axis=1))
    states = [
        StateContact(p.lam[: rows.n], p.gap[: rows.n], p.status.is_closed, p.sets, u[:, k])
        for k, p in enumerate(places)
    ]
    return FrictionSolution(
        states,
        _by_crack(rubbing_faces, rows, places),
        tuple(place.dissipated for place in places),
        _substep_displacements(engine, N, f, u_imposed, places)
        if with_substeps
        else np.zeros((len(f), 0)),
        _rubbing_states(N, rows, places),
    )


def _rubbing_states(
    N: sp.csr_matrix, rows: FrictionRows, places: Sequence[SlipPoint]
) -> RubbingStates | None:
    if rows.tangents != 1 or rows.compliance is not None:
        return None
    change = np.stack([place.change for place in places])
    return RubbingStates(N, rows, lock(change), tuple(place.status for place in places))


@dataclass(frozen=True, eq=False)
class _Face:
    """Rows of one crack."""

    space: Multipliers
    mu: float
    normal: sp.csr_matrix
    tangents: Floats
    jumps: list[sp.csr_matrix]
    slip_rows: list[sp.csr_matrix]


def _face(problem: Problem, model: System, m: Multipliers) -> _Face:
    lips, mu = model.lips[m.crack], problem.frictions[m.crack]
    normal = gap_rows(m, lips, model.jumps[m.crack])
    if not mu:
        return _Face(m, mu, normal, np.zeros((0, 0, 0)), [], [])
    directions = tangents(lips)
    jumps = tangential_jumps(model.space, m.crack, lips, directions)
    slip_rows = [gap_rows(m, lips, jump) for jump in jumps]
    return _Face(m, mu, normal, directions, jumps, slip_rows)


def _rows(faces: Sequence[_Face], dual: Floats, stiffness: float) -> FrictionRows:
    measure = np.concatenate([face.space.measure for face in faces])
    mu = np.concatenate([np.full(len(face.space.measure), face.mu) for face in faces])
    rubbing_rows = np.nonzero(mu > 0)[0]
    return FrictionRows(dual, measure, rubbing_rows, mu[rubbing_rows], stiffness)


def _by_crack(
    faces: Sequence[_Face], rows: FrictionRows, places: Sequence[SlipPoint]
) -> list[FrictionWork]:
    shear = np.stack([place.lam[rows.n :].reshape(rows.tangents, -1) for place in places], axis=2)
    is_stuck = np.stack([p.status.is_closed[rows.rubbing_rows] & ~p.status.slips for p in places])
    result, first = [], 0
    for face in faces:
        rows_of_crack = slice(first, first + len(face.space.measure))
        result.append(
            FrictionWork(
                face.space.crack,
                lock(face.tangents),
                face.jumps,
                shear[:, rows_of_crack],
                is_stuck[:, rows_of_crack],
            )
        )
        first = rows_of_crack.stop
    return result


def _substep_displacements(
    engine: Engine, N: sp.csr_matrix, f: Floats, u_imposed: Floats, places: Sequence[SlipPoint]
) -> Floats:
    """Displacements of all substeps: other faces may overlap in one of them."""
    loads, u_of_substeps = [], []
    previous_load = np.zeros(len(f)), np.zeros(len(f))
    for k, place in enumerate(places):
        for share, lam in place.tractions_between[:-1]:
            loads.append(previous_load[0] + share * (f[:, k] - previous_load[0]) + N.T @ lam)
            u_of_substeps.append(previous_load[1] + share * (u_imposed[:, k] - previous_load[1]))
        previous_load = f[:, k], u_imposed[:, k]
    if not loads:
        return np.zeros((len(f), 0))
    return engine.solve(np.stack(loads, axis=1), np.stack(u_of_substeps, axis=1))


__all__ = [
    "FrictionSolution",
    "RubbingStates",
    "SlipPoint",
    "at_rest",
    "has_friction",
    "march",
    "shaken_down",
    "slip_of",
    "solve_friction",
    "tangential_jumps",
    "tangential_rows",
    "tangents",
    "weak_slip",
    "with_slip",
]
