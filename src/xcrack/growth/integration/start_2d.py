"""Directions and rates of tips in 2D: at the beginning, behind a kink, and as a face turns."""

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.errors import collected_warnings
from xcrack.growth.directions.checks import law_exponent
from xcrack.growth.directions.criteria import clipped
from xcrack.growth.directions.kink import START, Turn, kinked_K, limit_angles
from xcrack.growth.rates.evaluation import Evaluation
from xcrack.growth.rates.rating import asked_of, size_at_places
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.trail import Trail
from xcrack.growth.tracking.tips_2d import Faces, faces_of
from xcrack.spectra.spectrum import Spectrum

_COTTERELL_RICE = 4 * np.sqrt(2 / np.pi)
_GEOMETRY = 0.65  # times the face's share of the crack: read off four scenes
_GAMMA = (-2.5, 0.5)


def first_trail(run: Run, seen: Evaluation, place: Floats, grown: Bools) -> Trail:
    """What growth begins with, or begins anew with after K has jumped.

    Parameters
    ----------
    run : Run
    seen : Evaluation
    place : (n, 2) array, length
        Where the tips are.
    grown : (n,) array of bool
        Whether the last face was added by growth.

    Returns
    -------
    Trail

    Notes
    -----
    Where a criterion turns a crack by more than three degrees, the kinked crack begins in the
    direction in which the criterion, asked again at the kink, turns no further (`limit_angles`),
    with the rate of the kinked crack. From there its direction changes by
    4 √(2/π) T/K_I* sin θ cos θ √s over the length s (the shear that T adds on the kink, Cotterell
    and Rice 1980).
    """
    faces = faces_of(seen.cracks)
    direction, rate, dK_eq, exponent = directions_of(run, seen, faces)
    row, bend = 0, np.zeros(len(rate))
    # Of a law with nominal R the rates of a kinked crack are not known, nor a block's direction.
    nominal = getattr(run.law, "ratio", None) == "nominal"
    known = not (nominal and isinstance(run.cycle, Spectrum))
    asked = asked_of(run, seen.problem, (seen.solutions, seen.sif)) if known else []
    for c, angle in enumerate(seen.angle):
        rows = slice(row, row + len(angle))
        row += len(angle)
        turns = (np.abs(angle) > START) & (seen.law_rate[c] > 0)
        if not known or not turns.any():
            continue
        K = clipped(asked[c].K)
        theta, converged = limit_angles(_quiet(asked[c].turn), K)
        turns &= converged
        kinked = clipped(kinked_K(K, np.where(turns, theta, 0.0)))
        dK, behind = seen.dK_eq[c], seen.law_rate[c]
        if not nominal:
            with collected_warnings([]):
                _, dK, _, behind = asked[c].answer(kinked)
        turns &= (behind > 0) & np.isfinite(behind)
        direction[rows] += np.where(turns, faces.side[rows] * (theta - angle), 0.0)
        rate[rows] = np.where(turns, behind, rate[rows])
        dK_eq[rows] = np.where(turns, dK, dK_eq[rows])
        opening = clipped(kinked_K(clipped(seen.K(c)), np.where(turns, theta, 0.0)))[..., 0]
        begins = _ratio(opening, _T(seen, c)) * np.sin(theta) * np.cos(theta)
        bend[rows] = np.where(turns, faces.side[rows] * _COTTERELL_RICE * begins, 0.0)
    bend *= np.sqrt(rate / rate.max()) if np.isfinite(rate).all() and rate.any() else 0.0
    return Trail(
        sigma=np.zeros(1),
        direction=direction[None],
        rate=rate[None],
        dK_eq=dK_eq[None],
        scale=crack_share(seen),
        exponent=exponent,
        bend=bend,
        place=place,
        grown=grown,
    )


def directions_of(run: Run, seen: Evaluation, faces: Faces) -> tuple[Floats, Floats, Floats, float]:
    """Directions (n,), rates (n,), ranges (n,) at all tips, and the exponent of the law."""
    angle, dK_eq = np.concatenate(seen.angle), np.concatenate(seen.dK_eq)
    exponent = law_exponent(run.law, dK_eq, np.concatenate(seen.R))
    rate = np.concatenate(seen.law_rate)
    return faces.direction + faces.side * angle, rate, dK_eq, exponent


def crack_share(seen: Evaluation) -> Floats:
    """Length of the crack of each tip, half of it where the crack has two `(n,)`."""
    counts = [len(angle) for angle in seen.angle]
    return np.concatenate([size_at_places(seen.problem, c, n) for c, n in enumerate(counts)])


def turn_of_faces(seen: Evaluation, faces: Faces) -> Floats:
    """How much the direction of growth at a tip turns as its last face is turned `(n,)`.

    Notes
    -----
    γ = 4 √(2/π) T √ℓ / K_I + 0.65 ℓ/a, ℓ the last face and a the crack, after Cotterell and Rice
    (1980) for a short kink; of the state with the largest K_I.
    """
    cracks = range(len(seen.cracks))
    ratio = np.concatenate([_ratio(seen.K(c)[..., 0], _T(seen, c)) for c in cracks])
    opens = np.concatenate([seen.K(c)[..., 0].max(axis=0) > 0 for c in cracks])
    gamma = _COTTERELL_RICE * ratio * np.sqrt(faces.length)
    gamma += _GEOMETRY * faces.length / crack_share(seen)
    return np.where(opens, np.clip(gamma, *_GAMMA), 0.0)


def _ratio(K_I: Floats, T: Floats) -> Floats:
    """T over K_I of the state with the largest K_I of each tip `(f,)`; 0 where none opens it."""
    tip = np.arange(K_I.shape[1])
    state = np.argmax(K_I, axis=0)
    opening, along = K_I[state, tip], T[state, tip]
    opens = (opening > 0) & np.isfinite(along)
    return np.asarray(np.where(opens, along, 0.0) / np.where(opens, opening, 1.0))


def _T(seen: Evaluation, c: int) -> Floats:  # noqa: N802
    """T at the tips of crack c in all states `(s, f)`."""
    return np.stack([state[c].T for state in seen.sif])


def _quiet(turn: Turn) -> Turn:
    """Directions by a criterion; its warnings are of cracks that nobody has."""

    def quiet(K: Floats) -> Floats:
        with collected_warnings([]):
            return turn(clipped(K))

    return quiet


__all__ = ["crack_share", "directions_of", "first_trail", "turn_of_faces"]
