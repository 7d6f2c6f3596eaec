"""The load path of crack faces with friction: states in their order, in substeps.

Loads and imposed displacements vary linearly between states, and so do the gaps and slips without
tractions; only the small dense problem is solved in each substep. From a body at rest a state is
reached in one: tractions and displacements grow in proportion. Later ones take several, and a
substep in which an open function closes is halved: it sticks at the slip that it had when that
substep began.
"""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.errors import ConvergenceError, warn
from xcrack.solvers.coulomb import FrictionRows, FrictionState, Status, coulomb
from xcrack.solvers.coulomb_3d import coulomb_3d

_SHORTEST = 1e-2  # share of a state below which a substep is not halved
_OPEN = 1e-9  # gap over the largest one above which a function is open
_RETURNED = 1e-6  # change of slip over a cycle, of the largest jump, at which cycles end
_MOST_CYCLES = 100
_MOST_UPDATES = 500
_UPDATED = 1e-8  # change of tractions, of the largest, that ends the updates
_TWIN = {1: coulomb, 2: coulomb_3d}  # by the number of tangents


@dataclass(frozen=True, eq=False)
class Place:
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
    between : tuple of (share, lam)
        Tractions of all substeps, and where they lie between the state before (0) and this one (1).
    at_rest : bool
        Nothing has acted so far.
    """

    d: Floats
    lam: Floats
    gap: Floats
    status: Status
    dissipated: float = 0.0
    sets: int = 0
    between: tuple[tuple[float, Floats], ...] = ()
    at_rest: bool = False


def at_rest(rows: FrictionRows, status: Status) -> Place:
    """The unloaded body; `status` is where the first guess comes from."""
    nothing = np.zeros(len(rows.F))
    return Place(nothing, nothing, nothing, status, at_rest=True)


def with_slip(rows: FrictionRows, d: Floats, slip: Floats, status: Status) -> Place:
    """A state whose weak slips `(r,)` before are given: faces that press stick there, or slide."""
    before = np.concatenate([np.zeros(rows.n), slip])
    state = _tractions(rows, d - before, status)
    return Place(d, state.lam, state.gap + before, state.status, sets=state.sets)


def march(rows: FrictionRows, d: Floats, begin: Place, substeps: int) -> list[Place]:
    """All states in their order.

    Parameters
    ----------
    rows : FrictionRows
    d : (g + r, states) array
        Weak gaps and slips of the states without tractions.
    begin : Place
    substeps : int
        From one state to the next.

    Raises
    ------
    ConvergenceError
        As of `coulomb`.
    """
    places, place = [], begin
    for wanted in d.T:
        place = _reached(rows, wanted, place, substeps)
        places.append(place)
    return places


def shaken_down(rows: FrictionRows, d: Floats, begin: Place, substeps: int) -> list[Place]:
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
        before = places[-1]
        places = march(rows, d, before, substeps)
        drift = float(np.abs((places[-1].gap - before.gap)[rows.n :] * weight[rows.n :]).max())
        largest = max(float(np.abs(place.gap * weight).max()) for place in places)
        if drift <= _RETURNED * largest:
            return places
    warn(
        f"friction: after {_MOST_CYCLES} cycles the slip of the crack faces still changes by "
        f"{drift:.3g} a cycle, where the largest jump is {largest:.3g}; K is "
        "that of the last cycle."
    )
    return places


def _reached(rows: FrictionRows, wanted: Floats, begin: Place, substeps: int) -> Place:
    """The next state."""
    longest = 1.0 if begin.at_rest else 1.0 / substeps
    shortest = min(longest, _SHORTEST)
    t, step, place = 0.0, longest, begin
    dissipated, sets = 0.0, 0
    between: list[tuple[float, Floats]] = []
    while t < 1.0:
        end = t + step
        end = 1.0 if end > 1.0 - 1e-9 else end
        d = begin.d + end * (wanted - begin.d)
        state = _solved(rows, d, place)
        sets = max(sets, state.sets)
        closing = state.status.closed & _opened(rows, place)
        if closing.any() and step > shortest:
            step = max(step / 2, shortest)
            continue
        dissipated += _dissipated(rows, place, state)
        gap = state.gap.copy()
        gap[rows.n :] += place.gap[rows.n :]
        place = Place(d, state.lam, gap, state.status)
        between.append((end, state.lam))
        t, step = end, min(2 * step, longest)
    return Place(place.d, place.lam, place.gap, place.status, dissipated, sets, tuple(between))


def _solved(rows: FrictionRows, d: Floats, place: Place) -> FrictionState:
    change = d.copy()
    change[rows.n :] -= place.gap[rows.n :]
    return _tractions(rows, change, place.status)


def _tractions(rows: FrictionRows, d: Floats, status: Status) -> FrictionState:
    """Of one load; by an augmented Lagrangian in updates (Simo and Laursen, 1992)."""
    solve = _TWIN[rows.tangents]
    if rows.compliance is None:
        return solve(rows, d, status)
    if not rows.augmented:
        try:
            return solve(rows, d, status)
        except ConvergenceError as error:
            raise ConvergenceError(
                f"{error} Or a smaller Comparison(penalty=...): stiff springs at single points "
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
        f"{change:.3g}. Give a larger Comparison(penalty=...)."
    )


def _opened(rows: FrictionRows, place: Place) -> Bools:
    """Functions with a gap that is more than round-off."""
    largest = float(np.abs(place.gap / rows.sizes).max(initial=0.0))
    return np.asarray(place.gap[: rows.n] / rows.measure > _OPEN * largest)


def _dissipated(rows: FrictionRows, before: Place, state: FrictionState) -> float:
    """Work of the tractions of slipping functions: their mean bound over the substep times slip."""
    slips = state.status.slips
    pressure = 0.5 * (np.maximum(before.lam, 0.0) + state.lam)[: rows.n][rows.rubbing]
    slip = np.sqrt((state.gap[rows.n :].reshape(rows.tangents, -1) ** 2).sum(axis=0))
    return float((rows.mu * pressure * slip)[slips].sum())


__all__ = ["Place", "at_rest", "march", "shaken_down", "with_slip"]
