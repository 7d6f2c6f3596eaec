"""Coulomb friction in 2D: stick, slip and opening on a small dense problem.

With F = N K^-1 N^T over normal and tangential rows, and d the gaps and slips without tractions,
every function of the multipliers is open (no traction), stuck (no gap, no slip) or slipping
(no gap, traction mu times the pressure against the slip). A semi-smooth Newton iteration predicts
the status of all functions at once (Alart and Curnier, 1991; in 2D each status is linear, so that
it is an active set). Where it cycles, sweeps of non-smooth Gauss-Seidel with exact solutions of
each function lead on (Jourdan, Alart and Jean, 1998).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import ConvergenceError

_MOST = 60  # sets that Newton tries before sweeps
_SWEEPS = (0, 3, 10, 30, 100, 300, 1000)  # before each attempt of Newton
_ROUND_OFF = 1e-12
_REDUNDANT = 1e-13  # smallest pivot of a scaled matrix whose solution is taken


@dataclass(frozen=True, eq=False)
class FrictionRows:
    """A dense problem of contact with friction, without its loads.

    Attributes
    ----------
    F : (g + m r, g + m r) array
        N K^-1 N^T; first the normal rows of all functions, then those of those that rub along each
        of m tangents: one in 2D, two in 3D.
    measure : (g,) array
        Integral of each function.
    rubbing : (r,) array of int
        Numbers of the functions with friction.
    mu : (r,) array
        Coefficients of friction, positive.
    stiffness : float, stress / length
        Weighs gaps against pressures in the prediction of the status; E / h is natural.
    compliance : (g + m r,) array, optional
        Of the springs of a penalty or an augmented Lagrangian, which F contains on its diagonal.
    augmented : bool
        Whether tractions are updated until the springs bear nothing.
    """

    F: Floats
    measure: Floats
    rubbing_rows: Ints
    mu: Floats
    stiffness: float
    compliance: Floats | None = None
    is_augmented: bool = False

    @property
    def n(self) -> int:
        """Number of functions."""
        return len(self.measure)

    @property
    def tangents(self) -> int:
        """Number of tangents."""
        return (len(self.F) - self.n) // max(len(self.rubbing_rows), 1)

    @property
    def sizes(self) -> Floats:
        """Measure of each row's function `(g + m r,)`."""
        return np.concatenate(
            [self.measure, np.tile(self.measure[self.rubbing_rows], self.tangents)]
        )


@dataclass(frozen=True, eq=False)
class Status:
    """Which functions are closed, and which of those that rub slip.

    Attributes
    ----------
    is_closed : (g,) array of bool
    slip : (r,) array of {-1, 0, 1}, or (2, r) array
        Sign of the traction of a slipping function, in 3D its direction; 0 where it sticks or is
        open.
    """

    is_closed: Bools
    slip: Ints | Floats

    @property
    def slips(self) -> Bools:
        """Which functions slip `(r,)`."""
        return np.asarray(np.atleast_2d(self.slip).any(axis=0))

    def key(self) -> bytes:
        """Bytes that name it."""
        return self.is_closed.tobytes() + self.slip.tobytes()


@dataclass(frozen=True, eq=False)
class FrictionState:
    """Tractions and gaps of one load.

    Attributes
    ----------
    lam : (g + r,) array, stress
        Pressures, then tangential tractions.
    gap : (g + r,) array
        Weak gaps, then weak slips since the state before.
    status : Status
    sets : int
        Sets tried.
    """

    lam: Floats
    gap: Floats
    status: Status
    sets: int


def all_stuck(rows: FrictionRows) -> Status:
    """The status that is tried where nothing is known."""
    is_closed, shape = np.ones(rows.n, dtype=bool), (rows.tangents, len(rows.mu))
    if rows.tangents == 1:
        return Status(is_closed, np.zeros(len(rows.mu), dtype=np.int64))
    return Status(is_closed, np.zeros(shape))


def coulomb(rows: FrictionRows, d: Floats, start: Status) -> FrictionState:
    """Tractions and gaps of one load.

    Parameters
    ----------
    rows : FrictionRows
    d : (g + r,) array
        Weak gaps and slips since the state before, without tractions.
    start : Status
        First guess.

    Raises
    ------
    ConvergenceError
        Neither Newton nor Gauss-Seidel find a status that stays.
    """
    sets_tried = 0
    lam, status = np.zeros(len(d)), start
    for sweeps in _SWEEPS:
        if sweeps:
            lam = _sweep_functions(rows, d, lam, sweeps)
            status = _status_of(rows, lam)
        state, sets = _newton(rows, d, status)
        sets_tried += sets
        if state is not None:
            return FrictionState(state.lam, state.gap, state.status, sets_tried)
    raise ConvergenceError(
        f"contact with friction: after {sets_tried} sets and {sum(_SWEEPS)} sweeps the status of "
        f"{rows.n} groups still changes. Give a smaller friction (here up to {rows.mu.max():.3g}), "
        "or refine the mesh along the crack."
    )


def of_status(rows: FrictionRows, d: Floats, status: Status) -> tuple[Floats, Floats]:
    """Tractions that a status asks for, and the gaps and slips that they leave."""
    g, is_closed, slip = rows.n, status.is_closed, status.slip
    closed_rows = np.nonzero(is_closed)[0]
    is_touching = is_closed[rows.rubbing_rows]
    stuck_rows = np.nonzero(is_touching & (slip == 0))[0]
    slipping_rows = np.nonzero(is_touching & (slip != 0))[0]
    lam = np.zeros(len(d))
    active_rows = np.concatenate([closed_rows, g + stuck_rows])
    if len(active_rows):
        place = np.zeros(g, dtype=np.int64)
        place[closed_rows] = np.arange(len(closed_rows))
        # The traction of a slipping function goes with its pressure.
        spread = np.zeros((len(d), len(active_rows)))
        spread[active_rows, np.arange(len(active_rows))] = 1.0
        column = place[rows.rubbing_rows[slipping_rows]]
        spread[g + slipping_rows, column] = slip[slipping_rows] * rows.mu[slipping_rows]
        diagonal = np.diag(rows.F)[active_rows]
        is_movable = diagonal > 0
        scale = np.where(is_movable, 1 / np.sqrt(np.where(is_movable, diagonal, 1.0)), 0.0)
        A = (rows.F[active_rows] @ spread) * scale[:, None] * scale
        lam = spread @ (scale * smallest_solution(A, -d[active_rows] * scale))
    gap = rows.F @ lam + d
    gap[active_rows] = 0.0
    return lam, gap


def smallest_solution(A: Floats, b: Floats) -> Floats:
    """Solution of a general system; the smallest one where groups are redundant."""
    lu, order, info = scipy.linalg.lapack.dgetrf(A)
    if info == 0 and np.abs(np.diag(lu)).min() > _REDUNDANT:
        x = scipy.linalg.lapack.dgetrs(lu, order, b)[0]
        if np.isfinite(x).all():
            return np.asarray(x)
    return np.asarray(scipy.linalg.lstsq(A, b, cond=_ROUND_OFF)[0])


def _newton(rows: FrictionRows, d: Floats, status: Status) -> tuple[FrictionState | None, int]:
    g, visited_keys = rows.n, set()
    weight = rows.stiffness / rows.measure
    for sets in range(1, _MOST + 1):
        lam, gap = of_status(rows, d, status)
        tolerance = _ROUND_OFF * float(np.abs(lam).max(initial=0.0))
        normal = lam[:g] - weight * gap[:g]
        trial_shear = lam[g:] - weight[rows.rubbing_rows] * gap[g:]
        # Values at round-off of zero (faces that only touch) must not make the status flicker.
        is_closed = normal > 0.1 * tolerance
        bound = rows.mu * np.maximum(normal[rows.rubbing_rows], 0.0)
        is_sliding = is_closed[rows.rubbing_rows] & (np.abs(trial_shear) > bound + tolerance)
        next_status = Status(
            is_closed, np.where(is_sliding, np.sign(trial_shear), 0.0).astype(np.int64)
        )
        if next_status.key() == status.key():
            return FrictionState(lam, gap, status, sets), sets
        if next_status.key() in visited_keys:
            return None, sets
        visited_keys.add(next_status.key())
        status = next_status
    return None, _MOST


def _status_of(rows: FrictionRows, lam: Floats) -> Status:
    pressure, shear = lam[: rows.n], lam[rows.n :]
    is_closed = pressure > 0
    bound = rows.mu * pressure[rows.rubbing_rows]
    is_sliding = is_closed[rows.rubbing_rows] & (np.abs(shear) >= bound * (1 - 1e-9))
    return Status(is_closed, np.where(is_sliding, np.sign(shear), 0.0).astype(np.int64))


def _sweep_functions(rows: FrictionRows, d: Floats, lam: Floats, sweeps: int) -> Floats:
    """Sweeps of Gauss-Seidel: each function's own problem is solved exactly, one by one."""
    F, g, lam = rows.F, rows.n, np.array(lam)
    partner = np.full(g, -1)
    partner[rows.rubbing_rows] = np.arange(len(rows.rubbing_rows))
    gap = F @ lam + d
    for _ in range(sweeps):
        for i in range(g):
            if F[i, i] <= 0:
                continue
            j = int(partner[i])
            rows_of_function = [i] if j < 0 else [i, g + j]
            block = F[np.ix_(rows_of_function, rows_of_function)]
            free_gap = gap[rows_of_function] - block @ lam[rows_of_function]
            new_tractions = _tractions_of_one(block, free_gap, 0.0 if j < 0 else float(rows.mu[j]))
            change = new_tractions - lam[rows_of_function]
            if change.any():
                gap += F[:, rows_of_function] @ change
                lam[rows_of_function] = new_tractions
    return lam


def _tractions_of_one(block: Floats, free_gap: Floats, mu: float) -> Floats:
    """Tractions of one function whose gap and slip without them are given."""
    a, gap = float(block[0, 0]), float(free_gap[0])
    if len(free_gap) == 1:
        return np.array([max(-gap / a, 0.0)])
    b, c, slip = float(block[0, 1]), float(block[1, 1]), float(free_gap[1])
    det = a * c - b * b
    if det > 0:
        pressure, shear = (-gap * c + slip * b) / det, (-slip * a + gap * b) / det
        if pressure >= 0 and abs(shear) <= mu * pressure:
            return np.array([pressure, shear])
    for sign in (1, -1):
        share = a + b * sign * mu
        pressure = -gap / share if share > 0 else -1.0
        if pressure > 0 and (slip + (b + c * sign * mu) * pressure) * sign <= 0:
            return np.array([pressure, sign * mu * pressure])
    return np.zeros(2)


# Coulomb friction in 3D: two tangential tractions a function, within a disc.

_MOST_CONES = 60
_SWEEPS_OVER_CONES = (0, 10, 30, 100, 300, 1000)
_CHANGE = 1e-12  # of the tractions, as a share of the largest, at which they stay
_STALL = 1e-8  # one that round-off keeps from falling further


@dataclass(frozen=True, eq=False)
class FrictionStart:
    """What a step of Newton is linearised at.

    Attributes
    ----------
    is_closed : (g,) array of bool
    direction : (2, r) array
        Of slip tractions; zero where a function sticks.
    share : (r,) array
        Bound over the size of the trial: how far the direction follows the slip; 0 fixes it.
    """

    is_closed: Bools
    direction: Floats
    share: Floats


def coulomb_3d(rows: FrictionRows, d: Floats, start: Status) -> FrictionState:
    """Tractions and gaps of one load.

    Parameters
    ----------
    rows : FrictionRows
        With two tangential rows a function that rubs.
    d : (g + 2 r,) array
        Weak gaps and slips since the state before, without tractions.
    start : Status
        First guess.

    Raises
    ------
    ConvergenceError
        Neither Newton nor projections settle.
    """
    sets_tried = 0
    guess = FrictionStart(start.is_closed, start.slip.astype(float), np.zeros(len(rows.mu)))
    lam = np.zeros(len(d))
    for sweeps in _SWEEPS_OVER_CONES:
        if sweeps:
            lam = _swept_cones(rows, d, lam, sweeps)
            guess = _next_status(rows, lam, rows.F @ lam + d)
        state, sets = _newton_on_cones(rows, d, guess)
        sets_tried += sets
        if state is not None:
            return FrictionState(state.lam, state.gap, state.status, sets_tried)
    raise ConvergenceError(
        f"contact with friction: after {sets_tried} steps of Newton and {sum(_SWEEPS_OVER_CONES)} "
        f"sweeps the tractions of {rows.n} groups still change. Give a smaller friction (here up "
        f"to {rows.mu.max():.3g}), or refine the mesh along the crack."
    )


def _newton_on_cones(
    rows: FrictionRows, d: Floats, guess: FrictionStart
) -> tuple[FrictionState | None, int]:
    previous_lam, previous_change = np.full(len(d), np.inf), np.inf
    for sets in range(1, _MOST_CONES + 1):
        lam, gap = _linearised_solution(rows, d, guess)
        next_guess = _next_status(rows, lam, gap)
        largest_traction = float(np.abs(lam).max(initial=0.0))
        change = float(np.abs(lam - previous_lam).max(initial=0.0)) if sets > 1 else np.inf
        same_status = np.array_equal(next_guess.is_closed, guess.is_closed) and np.array_equal(
            next_guess.direction.any(axis=0), guess.direction.any(axis=0)
        )
        direction_change = next_guess.direction - guess.direction
        bound = rows.mu * np.maximum(lam[: rows.n], 0.0)[rows.rubbing_rows]
        error = float(np.abs(bound * direction_change).max(initial=0.0))
        is_settled = error <= _CHANGE * largest_traction
        is_stalled = error <= _STALL * largest_traction and change >= 0.5 * previous_change
        if same_status and (is_settled or is_stalled):
            return FrictionState(
                lam, gap, Status(next_guess.is_closed, next_guess.direction), sets
            ), sets
        previous_lam, previous_change, guess = lam, change, next_guess
    return None, _MOST_CONES


def _next_status(rows: FrictionRows, lam: Floats, gap: Floats) -> FrictionStart:
    """Status that tractions and gaps ask for, and how directions follow the slip."""
    g, weight = rows.n, rows.stiffness / rows.measure
    tolerance = 1e-12 * float(np.abs(lam).max(initial=0.0))
    normal = lam[:g] - weight * gap[:g]
    trial = (lam[g:] - np.tile(weight[rows.rubbing_rows], 2) * gap[g:]).reshape(2, -1)
    is_closed = normal > 0.1 * tolerance
    bound = rows.mu * np.maximum(normal[rows.rubbing_rows], 0.0)
    size = np.sqrt((trial**2).sum(axis=0))
    is_sliding = is_closed[rows.rubbing_rows] & (size > bound + tolerance)
    length = np.where(is_sliding, size, 1.0)
    bound_of_row = rows.mu * np.maximum(lam[:g], 0.0)[rows.rubbing_rows]
    share = np.where(is_sliding, np.minimum(bound_of_row / length, 1.0), 0.0)
    return FrictionStart(is_closed, np.where(is_sliding, trial / length, 0.0), share)


def _linearised_solution(
    rows: FrictionRows, d: Floats, guess: FrictionStart
) -> tuple[Floats, Floats]:
    """Tractions of the linearised conditions, and the gaps and slips that they leave."""
    g, r = rows.n, len(rows.mu)
    closed_rows = np.nonzero(guess.is_closed)[0]
    touching_rows = np.nonzero(guess.is_closed[rows.rubbing_rows])[0]
    active_rows = np.concatenate([closed_rows, g + touching_rows, g + r + touching_rows])
    lam = np.zeros(len(d))
    is_sliding = np.asarray(guess.direction.any(axis=0))[touching_rows]
    if len(active_rows):
        diagonal = rows.F.diagonal()
        diagonal_rows = np.concatenate(
            [closed_rows, g + touching_rows, g + touching_rows]
        )  # one scale for both tangents
        size = diagonal[diagonal_rows]
        scale = np.where(size > 0, 1 / np.sqrt(np.where(size > 0, size, 1.0)), 0.0)
        A = rows.F[np.ix_(active_rows, active_rows)] * scale[:, None] * scale
        b = -d[active_rows] * scale
        _put_slip_conditions(rows, guess, A, b, closed_rows, touching_rows, is_sliding, scale)
        lam[active_rows] = scale * smallest_solution(A, b)
    gap = rows.F @ lam + d
    gap[closed_rows] = 0.0
    for part in (g, g + r):
        gap[part + touching_rows[~is_sliding]] = 0.0
    return lam, gap


def _put_slip_conditions(
    rows: FrictionRows, guess: FrictionStart, A: Floats, b: Floats, closed_rows: Ints,
    touching_rows: Ints, is_sliding: Bools, scale: Floats,
) -> None:  # fmt: skip
    """Put the conditions of slipping functions in the place of those of stuck ones.

    Scaled tractions x = lam / scale; k weighs slips, so that both terms are tractions:
    x_t - mu s x_n - share (1 - s s') (x_t - k (A x - b)_t) = 0.
    """
    m, n = len(closed_rows), len(touching_rows)
    sliding_rows = np.nonzero(is_sliding)[0]
    if not len(sliding_rows):
        return
    place = np.zeros(rows.n, dtype=np.int64)
    place[closed_rows] = np.arange(m)
    number = touching_rows[sliding_rows]
    s, share, mu = guess.direction[:, number], guess.share[number], rows.mu[number]
    t = [m + sliding_rows, m + n + sliding_rows]
    column = place[rows.rubbing_rows[number]]
    scale_of_slip = np.array([scale[t[0]], scale[t[1]]])
    weight = (rows.stiffness / rows.measure)[rows.rubbing_rows[number]]
    slip = np.stack([A[t[0]] / scale_of_slip[0][:, None], A[t[1]] / scale_of_slip[1][:, None]])
    free_gap = np.stack([b[t[0]] / scale_of_slip[0], b[t[1]] / scale_of_slip[1]])
    line = np.arange(len(sliding_rows))
    for i in (0, 1):
        row = np.zeros((len(sliding_rows), A.shape[1]))
        rhs = np.zeros(len(sliding_rows))
        row[line, t[i]] += scale_of_slip[i]
        row[line, column] -= mu * s[i] * scale[column]
        for j in (0, 1):
            projection = share * ((i == j) - s[i] * s[j])
            row[line, t[j]] -= projection * scale_of_slip[j]
            row += (projection * weight)[:, None] * slip[j]
            rhs += projection * weight * free_gap[j]
        A[t[i]] = row / scale_of_slip[i][:, None]
        b[t[i]] = rhs / scale_of_slip[i]


def _swept_cones(rows: FrictionRows, d: Floats, lam: Floats, sweeps: int) -> Floats:
    """Sweeps of projections: each function's tractions are corrected by its own gap and slip."""
    F, g, r, lam = rows.F, rows.n, len(rows.mu), np.array(lam)
    partner = np.full(g, -1)
    partner[rows.rubbing_rows] = np.arange(r)
    gap = F @ lam + d
    for _ in range(sweeps):
        for i in range(g):
            if F[i, i] <= 0:
                continue
            pressure = max(lam[i] - gap[i] / F[i, i], 0.0)
            gap += F[:, i] * (pressure - lam[i])
            lam[i], j = pressure, int(partner[i])
            if j < 0:
                continue
            rows_of_function = np.array([g + j, g + r + j])
            stiffness = float(np.linalg.eigvalsh(F[np.ix_(rows_of_function, rows_of_function)])[-1])
            if stiffness <= 0:
                continue
            trial = lam[rows_of_function] - gap[rows_of_function] / stiffness
            size, bound = float(np.hypot(*trial)), float(rows.mu[j]) * pressure
            new_tractions = trial if size <= bound else trial * (bound / size)
            gap += F[:, rows_of_function] @ (new_tractions - lam[rows_of_function])
            lam[rows_of_function] = new_tractions
    return lam


__all__ = [
    "FrictionRows",
    "FrictionState",
    "Status",
    "all_stuck",
    "coulomb",
    "coulomb_3d",
    "of_status",
    "smallest_solution",
]
