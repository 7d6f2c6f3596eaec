"""Coulomb friction in 3D: two tangential tractions a function, within a disc.

The status of a function is open, stuck, or slipping in a direction. A slipping one obeys
lam_t = mu lam_n s, s the direction of tau = lam_t - k g_t; the derivative of s turns it with
the slip (Alart and Curnier, 1991). Where Newton does not settle, sweeps of projections of one
function after the other lead on.
"""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.errors import ConvergenceError
from xcrack.solvers.coulomb import FrictionRows, FrictionState, Status, solved

_MOST = 60
_SWEEPS = (0, 10, 30, 100, 300, 1000)
_CHANGE = 1e-12  # of the tractions, as a share of the largest, at which they stay
_STALL = 1e-8  # one that round-off keeps from falling further


@dataclass(frozen=True, eq=False)
class _Guess:
    """What a step of Newton is linearised at.

    Attributes
    ----------
    closed : (g,) array of bool
    direction : (2, r) array
        Of slip tractions; zero where a function sticks.
    share : (r,) array
        Bound over the size of the trial: how far the direction follows the slip; 0 fixes it.
    """

    closed: Bools
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
    tried = 0
    guess = _Guess(start.closed, start.slip.astype(float), np.zeros(len(rows.mu)))
    lam = np.zeros(len(d))
    for sweeps in _SWEEPS:
        if sweeps:
            lam = _swept(rows, d, lam, sweeps)
            guess = _next(rows, lam, rows.F @ lam + d)
        state, sets = _newton(rows, d, guess)
        tried += sets
        if state is not None:
            return FrictionState(state.lam, state.gap, state.status, tried)
    raise ConvergenceError(
        f"contact with friction: after {tried} steps of Newton and {sum(_SWEEPS)} sweeps the "
        f"tractions of {rows.n} groups still change. Give a smaller friction (here up to "
        f"{rows.mu.max():.3g}), or refine the mesh along the crack."
    )


def _newton(rows: FrictionRows, d: Floats, guess: _Guess) -> tuple[FrictionState | None, int]:
    before, last = np.full(len(d), np.inf), np.inf
    for sets in range(1, _MOST + 1):
        lam, gap = _solved(rows, d, guess)
        new = _next(rows, lam, gap)
        largest = float(np.abs(lam).max(initial=0.0))
        change = float(np.abs(lam - before).max(initial=0.0)) if sets > 1 else np.inf
        same = np.array_equal(new.closed, guess.closed) and np.array_equal(
            new.direction.any(axis=0), guess.direction.any(axis=0)
        )
        turned = new.direction - guess.direction
        bound = rows.mu * np.maximum(lam[: rows.n], 0.0)[rows.rubbing]
        wrong = float(np.abs(bound * turned).max(initial=0.0))
        settled = wrong <= _CHANGE * largest
        stalled = wrong <= _STALL * largest and change >= 0.5 * last
        if same and (settled or stalled):
            return FrictionState(lam, gap, Status(new.closed, new.direction), sets), sets
        before, last, guess = lam, change, new
    return None, _MOST


def _next(rows: FrictionRows, lam: Floats, gap: Floats) -> _Guess:
    """Status that tractions and gaps ask for, and how directions follow the slip."""
    g, weight = rows.n, rows.stiffness / rows.measure
    tolerance = 1e-12 * float(np.abs(lam).max(initial=0.0))
    normal = lam[:g] - weight * gap[:g]
    trial = (lam[g:] - np.tile(weight[rows.rubbing], 2) * gap[g:]).reshape(2, -1)
    closed = normal > 0.1 * tolerance
    bound = rows.mu * np.maximum(normal[rows.rubbing], 0.0)
    size = np.sqrt((trial**2).sum(axis=0))
    slides = closed[rows.rubbing] & (size > bound + tolerance)
    length = np.where(slides, size, 1.0)
    pressed = rows.mu * np.maximum(lam[:g], 0.0)[rows.rubbing]
    share = np.where(slides, np.minimum(pressed / length, 1.0), 0.0)
    return _Guess(closed, np.where(slides, trial / length, 0.0), share)


def _solved(rows: FrictionRows, d: Floats, guess: _Guess) -> tuple[Floats, Floats]:
    """Tractions of the linearised conditions, and the gaps and slips that they leave."""
    g, r = rows.n, len(rows.mu)
    shut = np.nonzero(guess.closed)[0]
    touching = np.nonzero(guess.closed[rows.rubbing])[0]
    active = np.concatenate([shut, g + touching, g + r + touching])
    lam = np.zeros(len(d))
    slides = np.asarray(guess.direction.any(axis=0))[touching]
    if len(active):
        diagonal = rows.F.diagonal()
        one = np.concatenate([shut, g + touching, g + touching])  # one scale for both tangents
        size = diagonal[one]
        scale = np.where(size > 0, 1 / np.sqrt(np.where(size > 0, size, 1.0)), 0.0)
        A = rows.F[np.ix_(active, active)] * scale[:, None] * scale
        b = -d[active] * scale
        _slide(rows, guess, A, b, shut, touching, slides, scale)
        lam[active] = scale * solved(A, b)
    gap = rows.F @ lam + d
    gap[shut] = 0.0
    for part in (g, g + r):
        gap[part + touching[~slides]] = 0.0
    return lam, gap


def _slide(
    rows: FrictionRows, guess: _Guess, A: Floats, b: Floats, shut: Ints, touching: Ints,
    slides: Bools, scale: Floats,
) -> None:  # fmt: skip
    """Put the conditions of slipping functions in the place of those of stuck ones.

    Scaled tractions x = lam / scale; k weighs slips, so that both terms are tractions:
    x_t - mu s x_n - share (1 - s s') (x_t - k (A x - b)_t) = 0.
    """
    m, n = len(shut), len(touching)
    chosen = np.nonzero(slides)[0]
    if not len(chosen):
        return
    place = np.zeros(rows.n, dtype=np.int64)
    place[shut] = np.arange(m)
    number = touching[chosen]
    s, share, mu = guess.direction[:, number], guess.share[number], rows.mu[number]
    t = [m + chosen, m + n + chosen]
    pressed = place[rows.rubbing[number]]
    own = np.array([scale[t[0]], scale[t[1]]])
    weight = (rows.stiffness / rows.measure)[rows.rubbing[number]]
    slip = np.stack([A[t[0]] / own[0][:, None], A[t[1]] / own[1][:, None]])
    free = np.stack([b[t[0]] / own[0], b[t[1]] / own[1]])
    line = np.arange(len(chosen))
    for i in (0, 1):
        row = np.zeros((len(chosen), A.shape[1]))
        right = np.zeros(len(chosen))
        row[line, t[i]] += own[i]
        row[line, pressed] -= mu * s[i] * scale[pressed]
        for j in (0, 1):
            across = share * ((i == j) - s[i] * s[j])
            row[line, t[j]] -= across * own[j]
            row += (across * weight)[:, None] * slip[j]
            right += across * weight * free[j]
        A[t[i]] = row / own[i][:, None]
        b[t[i]] = right / own[i]


def _swept(rows: FrictionRows, d: Floats, lam: Floats, sweeps: int) -> Floats:
    """Sweeps of projections: each function's tractions are corrected by its own gap and slip."""
    F, g, r, lam = rows.F, rows.n, len(rows.mu), np.array(lam)
    partner = np.full(g, -1)
    partner[rows.rubbing] = np.arange(r)
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
            own = np.array([g + j, g + r + j])
            stiff = float(np.linalg.eigvalsh(F[np.ix_(own, own)])[-1])
            if stiff <= 0:
                continue
            trial = lam[own] - gap[own] / stiff
            size, bound = float(np.hypot(*trial)), float(rows.mu[j]) * pressure
            new = trial if size <= bound else trial * (bound / size)
            gap += F[:, own] @ (new - lam[own])
            lam[own] = new
    return lam


__all__ = ["coulomb_3d"]
