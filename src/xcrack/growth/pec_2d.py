"""Growth of second order at one solve a step: predict, evaluate, correct; tips of 2D cracks.

From the corrected tips of a step the last two solves predict the next tips; there all states are
solved; the parabola through the last three solves then moves the tips once more, without a solve.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import GeometryError, XcrackError, collected_warnings
from xcrack.crack.crack import Crack
from xcrack.fatigue.checks import law_exponent
from xcrack.fatigue.criteria import clipped_K
from xcrack.fatigue.kink import START, Turn, kinked_K, limit_angles
from xcrack.fatigue.retardation import OverloadZones
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.controlled import first, following, share_left
from xcrack.growth.follow_2d import exit_ahead
from xcrack.growth.meeting_2d import (
    AHEAD,
    Faces,
    Meeting,
    joined,
    last_faces,
    meetings,
    moved_on,
    rows_of,
    split,
    with_tips_at,
)
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled, asked_of, crack_size
from xcrack.growth.reach import (
    Growth,
    growth_over,
    growth_until,
    halved,
    looked_ahead,
    overloads_begin,
    overloads_go_on,
    overloads_of_rest,
    piece_of,
    reach_of,
)
from xcrack.growth.step import LEAST, Advance, Step, StepError, memory_of
from xcrack.growth.trail import StepControl, Trail, shortest
from xcrack.mesh.locate import cell_sizes, contains
from xcrack.mesh.mesh import Mesh

# The next step of 2D cracks as the last two solves see it, up to where tips meet other cracks.


@dataclass(frozen=True, eq=False)
class Prediction:
    """The next step as the last two solves see it.

    Attributes
    ----------
    length : float, length
        Of σ.
    stops : bool
        Whether all growth is seen to stop at its end.
    growth : Growth
    place : (n, 2) array, length
        Where the tips come to.
    cracks : list of Crack
    moves : (n,) array of bool
        Tips that move in the mesh; the others wait.
    size : (n,) array, length
        Of the cells at the tips before.
    asked : float, length
        Of σ, where nothing is met.
    apart : list of Crack
        The cracks before tips that meet others have ended or joined there.
    """

    length: float
    stops: bool
    growth: Growth
    place: Floats
    cracks: list[Crack]
    moves: Bools
    size: Floats
    asked: float
    apart: list[Crack]


def predict(run: GrowthRule, cracks: Sequence[Crack], trail: Trail) -> Prediction:
    """Where the last two solves lead; from a first one straight on, at its rates."""
    size = cell_sizes(run.problem.mesh, trail.place)
    reach = reach_of(run, trail)
    place = trail.place + reach.growth.move
    after, moves = with_tips_at(cracks, place, trail.grown, size)
    ahead = Prediction(
        reach.length, reach.stops, reach.growth, place, after, moves, size, reach.length, after
    )
    # Where plastic zones end the run, they do so before the tips meet.
    met = meetings(after, run.problem.mesh) if run.link_up is None else []
    return _met(run, cracks, trail, ahead, met) if met else ahead


def _met(
    run: GrowthRule, cracks: Sequence[Crack], trail: Trail, ahead: Prediction, met: list[Meeting]
) -> Prediction:
    """A step that ends when the first tip meets another crack, and the cracks joined there."""
    faces = last_faces(ahead.apart)
    along = np.stack([np.cos(faces.direction), np.sin(faces.direction)], axis=1)

    def left(own: Meeting, length: float) -> float:
        place = trail.place + growth_until(run, trail, length).move
        to = own.x if own.other < 0 else place[own.other]
        return float((to - place[own.tip]) @ along[own.tip])

    most = ahead.length + max(AHEAD * own.size for own in met)
    arrival = [_arrival(partial(left, own), most) for own in met]
    first = min(arrival)
    if first == np.inf and not any(own.soon for own in met):
        return ahead
    length = ahead.length if first == np.inf else first
    growth = growth_until(run, trail, length)
    place = trail.place + growth.move
    apart, moves = with_tips_at(cracks, place, trail.grown, ahead.size)
    arrived = {own.tip for own, when in zip(met, arrival) if when <= length}
    now = [
        own
        for own in meetings(apart, run.problem.mesh, 2 * AHEAD)
        if own.soon or own.tip in arrived
    ]
    if not now:
        return ahead
    whole = joined(apart, moves.tolist(), now)
    return replace(
        ahead, length=length, growth=growth, place=place, cracks=whole, moves=moves, apart=apart
    )


def _arrival(left: Callable[[float], float], most: float) -> float:
    """Length of σ after which nothing is left of a way; inf where that takes too long."""
    if left(most) > 0:
        return np.inf
    return halved(lambda length: left(length) > 0, most)[1]


# Directions and rates of tips in 2D: at the beginning, behind a kink, and as a face turns.

_COTTERELL_RICE = 4 * np.sqrt(2 / np.pi)
_GEOMETRY = 0.65  # times the face's share of the crack: read off four scenes
_GAMMA = (-2.5, 0.5)


def first_trail(run: GrowthRule, seen: Evaluation, place: Floats, grown: Bools) -> Trail:
    """What growth begins with, or begins anew with after K has jumped.

    Parameters
    ----------
    run : GrowthRule
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
    faces = last_faces(seen.cracks)
    direction, rate, dK_eq, exponent = directions_of(run, seen, faces)
    row, bend = 0, np.zeros(len(rate))
    # Of a law with nominal R the rates of a kinked crack are not known, nor a block's direction.
    nominal = getattr(run.law, "ratio", None) == "nominal"
    known = not (nominal and isinstance(run.cycle, Spectrum))
    asked = asked_of(run, seen.problem, seen.response) if known else []
    for c, angle in enumerate(seen.angle):
        rows = slice(row, row + len(angle))
        row += len(angle)
        turns = (np.abs(angle) > START) & (seen.law_rate[c] > 0)
        if not known or not turns.any():
            continue
        K = clipped_K(asked[c].K)
        theta, converged = limit_angles(_quiet(asked[c].turn), K)
        turns &= converged
        kinked = clipped_K(kinked_K(K, np.where(turns, theta, 0.0)))
        dK, behind = seen.dK_eq[c], seen.law_rate[c]
        if not nominal:
            with collected_warnings([]):
                _, dK, _, behind = asked[c].answer(kinked)
        turns &= (behind > 0) & np.isfinite(behind)
        direction[rows] += np.where(turns, faces.side[rows] * (theta - angle), 0.0)
        rate[rows] = np.where(turns, behind, rate[rows])
        dK_eq[rows] = np.where(turns, dK, dK_eq[rows])
        opening = clipped_K(kinked_K(clipped_K(seen.K(c)), np.where(turns, theta, 0.0)))[..., 0]
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


def directions_of(
    run: GrowthRule, seen: Evaluation, faces: Faces
) -> tuple[Floats, Floats, Floats, float]:
    """Directions (n,), rates (n,), ranges (n,) at all tips, and the exponent of the law."""
    angle, dK_eq = np.concatenate(seen.angle), np.concatenate(seen.dK_eq)
    exponent = law_exponent(run.law, dK_eq, np.concatenate(seen.R))
    rate = np.concatenate(seen.law_rate)
    return faces.direction + faces.side * angle, rate, dK_eq, exponent


def crack_share(seen: Evaluation) -> Floats:
    """Length of the crack of each tip, half of it where the crack has two `(n,)`."""
    counts = [len(angle) for angle in seen.angle]
    return np.concatenate([crack_size(seen.problem, c, n) for c, n in enumerate(counts)])


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
            return turn(clipped_K(K))

    return quiet


_PASSES = 6  # of the correction, which turns the last face, which turns the direction
_OF_LENGTH = 0.5  # relative change of K with that of the length of a crack, also of another one
_FIRST = 0.5  # of that for the first step's cycles, of which no parabola is known yet
_LEAST_RATIO = 0.2  # of what two parabolas say of a step to what the first of them did
_MENDED = 0.1  # of that squared and relative: what is left once the second step has mended it


def begun(run: GrowthRule, seen: Evaluation) -> Settled:
    """The first step of a run."""
    faces = last_faces(seen.cracks)
    trail = first_trail(run, seen, faces.tip, np.zeros(len(faces.tip), dtype=bool))
    trail = replace(trail, control=_first(run, trail, seen))
    trail = looked_ahead(run, overloads_begin(run, seen, trail))
    none = split(np.zeros(len(faces.tip)), seen.cracks)
    return _settled(run, 0.0, seen.cracks, trail, StepError(none, 0.0))


def settled(run: GrowthRule, last: Step, seen: Evaluation) -> Settled:
    """Correct a predicted step by what was solved there, and predict the next."""
    trail, error = _remembered(last)
    before = predict(run, last.corrected, trail)
    rows = _rows_that_stay(before.apart, seen.cracks)
    if len(rows) < len(before.place):
        return _without_lost_tips(run, last, seen, before, rows)
    if any(np.isinf(rate).any() for rate in seen.rate):
        return _broken(run, last, seen, before)
    return _corrected(run, last, seen, before, error)


def planned(run: GrowthRule, step: Step) -> Advance:
    """The advance after a step."""
    trail, _ = _remembered(step)
    still = split(np.zeros(len(trail.place)), step.corrected)
    rate = np.concatenate(step.rate)
    if not (rate > 0).any() or np.isinf(rate).any():
        return Advance(still, still, 0.0, np.inf, (0, 0))
    ahead = predict(run, step.corrected, trail)
    row = int(np.argmax(ahead.growth.arc))
    c = next(c for c, rows in enumerate(rows_of(step.corrected)) if rows.start <= row < rows.stop)
    size, first = float(ahead.size[row]), rows_of(step.corrected)[c].start
    falls = ahead.stops and float(ahead.growth.arc[row]) < LEAST * size
    return Advance(
        step.da,
        memory_of(step).pending,
        ahead.asked,
        size,
        (c, row - first),
        falls_to_zero=falls,
        cycles=ahead.growth.cycles,
    )


def advanced(run: GrowthRule, step: Step) -> list[Crack]:
    """The cracks after the predicted advance of a step."""
    trail, _ = _remembered(step)
    return predict(run, step.corrected, trail).cracks


def cycles_to(run: GrowthRule, step: Step, share: float, after: float | None) -> float:
    """Cycles of a share of the advance after a step, by the line through two solves."""
    del after  # behind the first exit other rates count
    trail, _ = _remembered(step)
    ahead = predict(run, step.corrected, trail)
    two, start = trail.last(2), float(trail.sigma[-1])
    return piece_of(run, two, start, share * ahead.length, _zones(trail)).over(two).cycles


def _remembered(step: Step) -> tuple[Trail, StepError]:
    trail, error = memory_of(step).trail, step.error
    if not isinstance(trail, Trail) or error is None:
        raise XcrackError(f"step {step.index} was not made by integrator='pec'.")
    return trail, error


def _settled(
    run: GrowthRule, cycles: float, corrected: Sequence[Crack], trail: Trail, error: StepError
) -> Settled:
    """A step that is settled, with the advance that follows."""
    waits = np.linalg.norm(trail.place - last_faces(corrected).tip, axis=1)
    da = np.zeros(len(waits))
    if np.isfinite(trail.rate[-1]).all() and (trail.rate[-1] > 0).any():
        ahead = predict(run, corrected, trail)
        way = np.linalg.norm(ahead.place - last_faces(corrected).tip, axis=1)
        da = np.where(ahead.moves, way, 0.0)
    return Settled(
        cycles, tuple(corrected), split(da, corrected), split(waits, corrected), trail, error
    )


def _corrected(
    run: GrowthRule, last: Step, seen: Evaluation, before: Prediction, error: StepError
) -> Settled:
    """Correct the last points by the parabola through the last three solves."""
    old, _ = _remembered(last)
    faces = last_faces(seen.cracks)
    direction, rate, dK_eq, exponent = directions_of(run, seen, faces)
    start = float(old.sigma[-1])
    trail = old.with_solve(start + before.length, direction, rate, dK_eq, exponent)
    trail = overloads_go_on(run, seen, old, trail)
    piece = piece_of(run, trail, start, before.length, _zones(old))
    solved = trail.direction[-1]
    gamma = np.where(before.moves, turn_of_faces(seen, faces), 0.0)
    begin = _begins(last.corrected, old, before)
    growth = before.growth
    for _ in range(_PASSES):
        growth = piece.over(trail)
        face = old.place + growth.move - begin
        turn = np.arctan2(face[:, 1], face[:, 0]) - faces.direction
        turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
        trail = trail.with_direction(solved + gamma * turn)
    place = old.place + growth.move
    try:
        corrected, moves = with_tips_at(last.corrected, place, old.grown, before.size)
    except GeometryError:  # which the predicted cracks are free of
        place, corrected, moves = before.place, list(seen.cracks), before.moves
    off = share_left(run) * np.linalg.norm(place - before.place, axis=1)
    if old.n_solves == 1:
        off *= _FIRST
    cycles, own, alone = _cycles(run, trail, old, before, growth)
    along = np.stack([np.cos(trail.direction[-1]), np.sin(trail.direction[-1])], axis=1)
    ahead = share_left(run) * np.abs(((place - before.place) * along).sum(axis=1))
    behind = error.behind + float((_OF_LENGTH * ahead / trail.scale).max(initial=0.0))
    own += trail.exponent * behind * cycles
    trail = replace(trail, place=place, grown=old.grown | moves)
    control = following(
        run, old.control, before.length, float(off.max(initial=0.0)), alone, growth.cycles,
        last.cycles, *_ahead(run, trail, seen),
    )  # fmt: skip
    return _settled(
        run,
        last.cycles + cycles,
        corrected,
        looked_ahead(run, _with_zones(replace(trail, control=control), _zones(old), piece.after)),
        StepError(
            tuple(a + b for a, b in zip(error.place, split(off, corrected))),
            error.cycles + own,
            behind=behind,
        ),
    )


def _first(run: GrowthRule, trail: Trail, seen: Evaluation) -> StepControl:
    """Length of the first step."""
    return first(run, float(trail.scale.min(initial=np.inf)), *_ahead(run, trail, seen))


def _ahead(run: GrowthRule, trail: Trail, seen: Evaluation) -> tuple[float, float]:
    """Shortest step of the fastest tip, and the way to the boundary ahead of it, length."""
    if not len(trail.place):
        return 0.0, np.inf
    tip = int(np.argmax(trail.rate[-1]))
    x, angle, mesh = trail.place[tip], trail.direction[-1, tip], run.problem.mesh
    hit = exit_ahead(x, np.array([np.cos(angle), np.sin(angle)]), mesh)
    room = np.inf if hit is None else float(np.linalg.norm(hit[0] - x))
    turn = float(np.concatenate(seen.angle)[tip])
    return shortest(float(cell_sizes(mesh, x[None])[0]), turn), room


def _cycles(
    run: GrowthRule, trail: Trail, old: Trail, before: Prediction, growth: Growth
) -> tuple[float, float, float]:
    """Cycles of a corrected step, what they add to the estimated error, and that of them alone."""
    if old.n_solves == 1:
        off = abs(growth.cycles - before.growth.cycles)
        # The parabola of the next step mends it: of that, a square is left.
        rest = _MENDED * share_left(run) * off**2 / growth.cycles if growth.cycles > 0 else 0.0
        return growth.cycles, _FIRST * share_left(run) * off, rest
    start = float(old.sigma[-1])
    two = trail.last(2)
    line = piece_of(run, two, start, before.length, _zones(old)).over(two).cycles
    alone = own = share_left(run) * abs(growth.cycles - line)
    if old.n_solves > 2:
        return growth.cycles, *_better_known(run, trail, old, own)
    # The second step: the parabola tells what the first one, along a line, was off.
    span = float(old.sigma[1] - old.sigma[0])
    first = float(old.sigma[0])
    begin = None if old.overloads is None else old.overloads.earlier
    line, curve, constant = (
        piece_of(run, each, first, span, begin).over(each).cycles
        for each in (old, trail, old.first(1))
    )
    own += share_left(run) * (abs(curve - line) - _FIRST * abs(line - constant))
    return growth.cycles + curve - line, own, alone


def _better_known(run: GrowthRule, trail: Trail, old: Trail, own: float) -> tuple[float, float]:
    """What a step adds to the estimated error of the cycles, and that of the step alone.

    Two parabolas span the step before: that of its own, and that of the step behind it. The error
    is between them, so that their difference takes the place of what was reckoned with then; the
    error of this step, of which no second parabola is known yet, is taken to be smaller likewise.
    """
    if old.overloads is not None:
        return own, own

    def cycles(each: Trail, k: int) -> float:
        begin, end = old.sigma[k], old.sigma[k + 1]
        return growth_over(each, float(begin), float(end - begin), run.threshold).cycles

    was = share_left(run) * abs(cycles(old, 1) - cycles(old.last(2), 1))
    now = abs(cycles(old, 1) - cycles(trail, 1))
    ratio = float(np.clip(now / was, _LEAST_RATIO, 1.0)) if was > 0 else 1.0
    change = now - was
    if old.sigma[0] == 0:  # the first step of all is spanned by one parabola: the next is prolonged
        was = share_left(run) * abs(cycles(old, 0) - cycles(old.first(2), 0))
        change += min(abs(cycles(old, 0) - cycles(trail, 0)), was) - was
    return change + own, ratio * own


def _zones(trail: Trail) -> OverloadZones | None:
    return None if trail.overloads is None else trail.overloads.zones


def _with_zones(trail: Trail, begin: OverloadZones | None, after: OverloadZones | None) -> Trail:
    """The same after a step, with what overloads have left at its begin and at its end."""
    if trail.overloads is None or after is None:
        return trail
    return replace(trail, overloads=replace(trail.overloads, zones=after, earlier=begin))


def _begins(cracks: Sequence[Crack], trail: Trail, before: Prediction) -> Floats:
    """Where the last faces of the predicted cracks begin `(n, 2)`."""
    faces = last_faces(cracks)
    instead = moved_on(faces, trail.grown, before.size)
    return np.where(instead[:, None], faces.anchor, faces.tip)


def _rows_that_stay(advanced: Sequence[Crack], placed: Sequence[Crack]) -> Ints:
    """Rows of the advanced tips that the placed ones are `(n,)`: some have left or joined."""
    row = {tuple(x): k for k, x in enumerate(last_faces(advanced).tip.tolist())}
    return np.array([row[tuple(x)] for x in last_faces(placed).tip.tolist()], dtype=np.int64)


def _without_lost_tips(
    run: GrowthRule, last: Step, seen: Evaluation, before: Prediction, stays: Ints
) -> Settled:
    """Begin anew after tips have left the body or met: their solves say nothing of the others now.

    Up to the first exit the cycles are those that the solves before it predicted, behind it the
    new rates count.
    """
    old, error = _remembered(last)
    place = before.place[stays]
    trail = first_trail(run, seen, place, (old.grown | before.moves)[stays])
    lost_rows = np.setdiff1d(np.arange(len(before.place)), stays)
    trail = replace(trail, control=_first(run, trail, seen))
    trail = looked_ahead(run, overloads_begin(run, seen, trail, overloads_of_rest(old, stays)))
    exit_ = _exit(run, old, before, lost_rows)
    cycles = growth_until(run, old, exit_).cycles
    largest = max((float(rate.max(initial=0.0)) for rate in seen.rate), default=0.0)
    rest = before.length - exit_
    if 0 < largest < np.inf and old.overloads is None:
        cycles += rest / largest
    elif rest > 0:
        cycles = before.growth.cycles
    lost = np.concatenate(error.place)[stays]
    own = share_left(run) * abs(cycles - before.growth.cycles)
    own += trail.exponent * error.behind * cycles
    return _settled(
        run,
        last.cycles + cycles,
        seen.cracks,
        trail,
        StepError(split(lost, seen.cracks), error.cycles + own, behind=error.behind),
    )


def _exit(run: GrowthRule, trail: Trail, before: Prediction, lost: Ints) -> float:
    """Piece of σ until the first of the lost tips is outside the body; all of it where none is."""
    mesh = run.problem.mesh
    if _inside(mesh, before.place[lost]):
        return before.length

    def holds(length: float) -> bool:
        return _inside(mesh, (trail.place + growth_until(run, trail, length).move)[lost])

    return halved(holds, before.length)[1]


def _inside(mesh: Mesh, x: Floats) -> bool:
    return bool(contains(mesh, x).all())


def _broken(run: GrowthRule, last: Step, seen: Evaluation, before: Prediction) -> Settled:
    """The last step of a run, at whose end a rate is infinite: no polynomial leads there.

    The inverse of the largest rate is taken to fall to zero along the step, as `cycles_between`
    does it.
    """
    old, error = _remembered(last)
    largest = float(old.rate[-1].max())
    cycles = 0.5 * before.length / largest
    if old.overloads is not None:
        cycles = 0.5 * before.growth.cycles
    trail = replace(
        old,
        place=before.place,
        grown=old.grown | before.moves,
        rate=np.vstack([old.rate[:-1], np.concatenate(seen.law_rate)]),
    )
    return _settled(
        run, last.cycles + cycles, seen.cracks, trail, StepError(error.place, error.cycles + cycles)
    )


__all__ = [
    "Prediction",
    "advanced",
    "begun",
    "crack_share",
    "cycles_to",
    "directions_of",
    "first_trail",
    "planned",
    "predict",
    "settled",
    "turn_of_faces",
]
