"""The meshes of a run with a tolerance: as given, and fine where a scout has been."""

import hashlib
import sys
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Protocol

import numpy as np

from xcrack.adaptivity.indicators import Indicators, indicators_of
from xcrack.adaptivity.sizes_2d import tip_sizes
from xcrack.base.arrays import Floats
from xcrack.base.errors import (
    GeometryError,
    ProblemError,
    XcrackError,
    collected_warnings,
    warn,
)
from xcrack.crack.measures import exit_ahead
from xcrack.fatigue.cycle import Cycle
from xcrack.growth import sizes_2d, sizes_3d
from xcrack.growth.corridor import corridor, ways_of
from xcrack.growth.options import GrowthRule
from xcrack.growth.scout import Stage, samples, scouted
from xcrack.growth.step import Step, plan_of, run_state, solves_of
from xcrack.growth.step_length import (
    PATH,
    REJECTED,
    STEPS,
    cell_for,
    first_length,
    next_length,
)
from xcrack.growth.tips import LONGER_FIRST
from xcrack.growth.uncertainty import TOGETHER
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import growing_sizes, refine
from xcrack.model.problem import Problem

SHARE = 0.4  # of the tolerance: what K may take
_LEAST_EXPONENT = 2.0  # of the law, in the error of life; directions err by twice that of K_II
_FAINT = 1e-3  # of the largest K of all stages: a smaller one need not be known to its own size
_FORETOLD = 4.0  # times the wanted bar: from there the next mesh need not be looked at again

Steps = Callable[[GrowthRule], Generator[Step, None, str]]


class Sizes(Protocol):
    """What decides the sizes of cells in one dimension; `sizes_2d` and `sizes_3d` have it."""

    MOST_UNKNOWNS: int
    STAGES: int  # that stand for the path
    ROUNDS: int
    LIFE: float  # share of it at the last of these
    SCOUT_ORDER: int

    def given_mesh(self, problem: Problem) -> Mesh:
        """The mesh of a scene to begin with."""

    def scout_mesh(self, problem: Problem) -> Mesh:
        """The mesh of a scene for a scout."""

    def first_sizes(self, problem: Problem, stage: Stage) -> Floats:
        """Sizes of cells at the places of a stage, before any bar is known."""

    def error(self, now: Indicators) -> float:
        """Half-width of K over the largest K."""

    def finer(
        self,
        each: Sequence[Indicators],
        wanted: Sequence[float],
        places: Sequence[Floats],
        sizes: list[Floats],
    ) -> tuple[Mesh, list[Floats]]:
        """The next mesh but for the corridor, and the sizes along that."""


def prepared(
    rule: GrowthRule, steps_of: Steps, done: Sequence[Step] = (), stored: Sequence[Mesh] = ()
) -> GrowthRule:
    """A run on the mesh that it begins with, or goes on with.

    Parameters
    ----------
    rule : GrowthRule
        On the mesh as it was given.
    steps_of : callable
        What makes the steps of a run.
    done : sequence of Step, optional
        Those that a run goes on from.
    stored : sequence of Mesh, optional
        Meshes that it has had; where the last one is not among them, it is made again.

    Returns
    -------
    GrowthRule
    """
    first = _first_mesh(rule)
    if not done:
        _check_unknowns(rule, first)
        return on(rule, first)
    known = run_state(done[-1]).mesh
    rule = replace(rule, meshes=run_state(done[-1]).meshes)
    for mesh in (first, *stored):
        if fingerprint(mesh) == known:
            return on(rule, replace(mesh, curves=rule.problem.mesh.curves))
    earlier = [step for step in done if run_state(step).mesh != known]
    for mesh in _meshes_again(rule, steps_of, earlier, (first, *stored)):
        if fingerprint(mesh) == known:
            return on(rule, mesh)
    mesh, _ = finer(rule, steps_of, earlier[-1] if earlier else None)
    if fingerprint(mesh) != known:
        warn(
            "the mesh that the run had is not stored, and the one that was made again differs "
            "from it in the last bits: so may the steps that follow."
        )
    return on(rule, mesh)


def _meshes_again(
    rule: GrowthRule, steps_of: Steps, earlier: Sequence[Step], meshes: Sequence[Mesh]
) -> list[Mesh]:
    """Meshes that a run may have gone on with from earlier steps, but for those by a scout."""
    if not earlier:
        begin = next(steps_of(replace(rule, meshes=0, progress=False)))
        return [solution.problem.mesh for solution in begin.solutions[:1]]
    made = [
        _mesh_with_room(on(rule, mesh), earlier[-1])
        for mesh in meshes
        if fingerprint(mesh) == run_state(earlier[-1]).mesh
    ]
    return [mesh for mesh in made if mesh is not None]


def on(rule: GrowthRule, mesh: Mesh) -> GrowthRule:
    """A run on another mesh."""
    return replace(rule, problem=replace(rule.problem, mesh=mesh, order=2))


def _first_mesh(rule: GrowthRule) -> Mesh:
    """The mesh as given, where error bars can be had on it: else finer at the tips, or fronts."""
    return _TWINS[rule.problem.mesh.dim].given_mesh(rule.problem)


def _check_unknowns(rule: GrowthRule, mesh: Mesh) -> None:
    """Refuse a first mesh that has too many unknowns before anything is solved on it."""
    least = mesh.dim * (mesh.n_points + len(mesh.edges))
    if rule.max_unknowns is not None and least > rule.max_unknowns:
        raise ProblemError(
            f"grow: max_unknowns = {rule.max_unknowns}, and the first mesh, on which cracks are a "
            f"few cells long, has {least} at least: allow more, or give a coarser mesh."
        )


def fingerprint(mesh: Mesh) -> str:
    """Text that two meshes share if they are the same to the last bit."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes())
    digest.update(np.ascontiguousarray(mesh.cells).tobytes())
    return digest.hexdigest()[:16]


def finer(rule: GrowthRule, steps_of: Steps, last: Step | None) -> tuple[Mesh, bool]:
    """A mesh on which bars of K are as wanted along all of the way that a scout finds.

    Parameters
    ----------
    rule : GrowthRule
        On the mesh as it was given.
    steps_of : callable
        What makes the steps of a run.
    last : Step, optional
        From which on the cracks are to grow; from their start, where it is left out.

    Returns
    -------
    Mesh
    bool
        Whether it would have more unknowns than it may.
    """
    twin, start = _TWINS[rule.problem.mesh.dim], perf_counter()
    before = _first_mesh(rule)
    if last is not None:
        rule = replace(rule, problem=replace(rule.problem, cracks=last.corrected))
    most = rule.max_unknowns or twin.MOST_UNKNOWNS
    mesh = twin.scout_mesh(rule.problem)
    _tell(rule, f"scout: on {len(mesh.cells)} cells", start)
    scene = replace(rule.problem, mesh=mesh, order=twin.SCOUT_ORDER)
    seen = scouted(rule, scene, steps_of, 0 if last is None else last.index)
    if not seen.stages:
        return mesh, False
    _tell(rule, f"scout: {len(seen.stages)} steps, N = {seen.stages[-1].cycles:.4g}", start)
    ways = ways_of(seen)
    # Of one that has begun long ago, most of the life is over; not where nothing of it is left.
    most_of_life = 1 - float(rule.tolerance or 0.0)
    chosen = samples(seen, twin.STAGES, most_of_life if last and last.index else twin.LIFE)
    stages = [seen.stages[k] for k in chosen]
    sizes = [twin.first_sizes(scene, stage) for stage in stages]
    sizes[0] = np.minimum(sizes[0], seen.step)
    mesh = refine(mesh, size=corridor(seen, ways, chosen, sizes, most))
    wanted = SHARE / TOGETHER * float(rule.tolerance or 0.0) / max(seen.exponent, _LEAST_EXPONENT)
    for number in range(twin.ROUNDS):
        each = [_bars_of_stage(rule, mesh, stage) for stage in stages]
        there = [k for k, now in enumerate(each) if now is not None]
        good = [now for now in each if now is not None]
        if not good:
            break
        error = max(map(twin.error, good))
        unknowns = max(now.solutions[0].space.n_dof for now in good)
        text = f"{unknowns} unknowns, K within {error:.1e}, wanted {wanted:.1e}"
        _tell(rule, f"mesh {number}: {text}", start)
        if number == 0 and unknowns > most:
            instead = f"{unknowns} are the fewest for the way ahead; growth keeps the mesh it has"
            _warn_of_most(rule, most, instead)
            return before, True
        if error <= wanted:
            break
        largest = [now.scale for now in good]
        goals = [wanted * max(K, _FAINT * max(largest)) for K in largest]
        places = [stages[k].places for k in there]
        smaller, own = twin.finer(good, goals, places, [sizes[k] for k in there])
        for k, size in zip(there, own, strict=True):
            sizes[k] = size
        smaller = refine(smaller, size=corridor(seen, ways, chosen, sizes, most))
        if unknowns * len(smaller.cells) > most * len(mesh.cells):
            _warn_of_most(
                rule, most, f"growth goes on with {unknowns}, on which K is known to {error:.1e} "
                f"of its largest value, where {wanted:.1e} was wanted",
            )  # fmt: skip
            return mesh, True
        same, mesh = len(smaller.cells) == len(mesh.cells), smaller
        if error <= _FORETOLD * wanted or same:
            break
    _tell(rule, f"mesh: {len(mesh.cells)} cells", start)
    return mesh, False


def _warn_of_most(rule: GrowthRule, most: int, instead: str) -> None:
    warn(
        f"grow: the mesh that tolerance = {rule.tolerance:g} asks for would have more than {most} "
        f"unknowns: {instead}. Allow more with max_unknowns; life_bar says what it costs."
    )


def _bars_of_stage(rule: GrowthRule, mesh: Mesh, stage: Stage) -> Indicators | None:
    """K of a stage with its bars; None where that mesh has none."""
    with collected_warnings([]):  # they come again in the run
        try:
            scene = replace(rule.problem, mesh=mesh, cracks=stage.cracks, order=2)
            return indicators_of(scene, rule.cycle.load_states)
        except XcrackError:
            return None


def _tell(rule: GrowthRule, line: str, start: float) -> None:
    if rule.progress == "always" or (rule.progress and sys.stderr.isatty()):
        print(f"{line}, {perf_counter() - start:.2g} s", file=sys.stderr)


_TWINS: dict[int, Sizes] = {2: sizes_2d, 3: sizes_3d}


# When a step asks for a finer mesh than it was computed on, and is computed again on that.

_MOST = 4  # meshes that a run makes: behind that it goes on, and its bars say how well
_FORGIVEN = 3.0  # times the share of K: bars along the way were foretold, not measured

_SETTLED = 4  # steps: before, bars are wide behind a kink whose face is short, on any mesh
_SIZE = 0.5  # of a crack: of less growth than that a path may err by a share of as much
_WHOLE = 1.0  # of the tolerance, by all sources: below that no finer mesh is worth it
_SLOPE = 0.4  # growth of cells with the distance from a tip that has little room
# Times the share of K at the first step: bars of a crack that grows become shorter, and directions
# err for the first step only.
_BEGIN, _BEGIN_OF_PATH = 1.5, 3.0
_SHORT_OF_PATH = 0.5  # of the tolerance: by K alone
_LAST = 0.1  # of the cycles so far: what the rest may take at the present rate
_SHORT = 1.3  # times a first step: the shortest that cells at kinks may allow


def replanned(
    asked: GrowthRule, rule: GrowthRule, steps_of: Steps, last: Step | None, step: Step
) -> tuple[GrowthRule, Step | None] | None:
    """The run and the step from which one is to be computed again; None where that is good.

    It follows from what is stored with the step before: a run that is resumed does the same.

    Parameters
    ----------
    asked : GrowthRule
        On the mesh as it was given.
    rule : GrowthRule
        On the one of the step.
    steps_of : callable
        What makes the steps of a run.
    last : Step or None
        The one before, which is handed over.
    step : Step
    """
    mesh = _mesh_for_kinks(rule, step) if last is None else None
    if mesh is not None:
        return replace(on(rule, mesh), meshes=rule.meshes + 1), None
    shorter = None if last is None else _step_before(last, step)
    if shorter is not None:  # what the mesh leaves to be wished is seen on a step that stays
        return rule, shorter
    if not _is_mesh_too_coarse(rule, last, step):
        return None
    mesh, is_largest = _mesh_with_room(rule, last) if _has_no_bar(step) else None, False
    if mesh is None and _ends_soon(rule, step):
        return None
    if mesh is None:
        mesh, is_largest = finer(asked, steps_of, last)
    other = replace(on(rule, mesh), meshes=_MOST if is_largest else rule.meshes + 1)
    return other, last if last is None else _with_room(rule, other, last, step)


def _step_before(last: Step, step: Step) -> Step | None:
    """The step before one whose error is too large, with a shorter way ahead; None if that is not.

    It follows from what is stored with both: a run that is taken up again does the same.
    """
    error, control = step.control.error, last.control
    if error is None or error <= REJECTED or not control.can_shorten:
        return None
    length = next_length(control.length, error, None, control.least)
    return replace(last, control=replace(control, length=length))


def _ends_soon(rule: GrowthRule, step: Step) -> bool:
    """Whether so little of the life is left to the last tip that no scout is worth its time.

    Not where cells are too coarse for steps of `da`: the run would end there.
    """
    if rule.problem.mesh.dim == 3 or step.n_tips != 1 or not step.cycles > 0:
        return False
    if rule.da is not None and rule.da < step.control.least:
        return False
    stations, solves = solves_of(step)
    hit = exit_ahead(stations.x[0], solves.direction[-1, 0], rule.problem.mesh)
    if hit is None:
        return False
    room = float(np.linalg.norm(hit[0] - stations.x[0]))
    return room <= _LAST * step.cycles * float(solves.rate[-1, 0])


def _has_no_bar(step: Step) -> bool:
    return step.error is not None and bool(np.isnan(step.error.rate))


def _mesh_for_kinks(rule: GrowthRule, first: Step) -> Mesh | None:
    """Finer cells at tips that kink at once, for a first step that a tolerance asks for.

    None where that step has room.
    """
    if rule.meshes or rule.problem.mesh.dim == 3 or not rule.estimates or not first.n_tips:
        return None
    stations, solves = solves_of(first)
    wanted = STEPS * float(rule.tolerance or 0.0)
    length = first_length(LONGER_FIRST * float(solves.scale.min()), wanted, 0.0)
    if not first.control.least > _SHORT * length:
        return None
    sizes = np.array([cell_for(length, angle) for angle in np.concatenate(first.angle).tolist()])
    return refine(rule.problem.mesh, size=growing_sizes(stations.x, sizes, _SLOPE))


def _mesh_with_room(rule: GrowthRule, last: Step | None) -> Mesh | None:
    """Finer cells where the tips of the next step have too little room; None where they do not."""
    size = _sizes_for_room(rule, last)
    return None if size is None else refine(rule.problem.mesh, size=size)


def _sizes_for_room(rule: GrowthRule, last: Step | None) -> Callable[[Floats], Floats] | None:
    """Sizes of the cells of `_mesh_with_room`; None where it makes none."""
    if last is None or rule.problem.mesh.dim == 3:
        return None
    try:
        place, size = tip_sizes(replace(rule.problem, cracks=plan_of(last).cracks))
    except GeometryError:
        return None
    if (cell_sizes(rule.problem.mesh, place) <= size).all():
        return None
    return growing_sizes(place, size, _SLOPE)


def _is_mesh_too_coarse(rule: GrowthRule, last: Step | None, step: Step) -> bool:
    """Whether the bars of K are too wide on the mesh of a step, or its cells too long."""
    error = step.error
    if not rule.estimates or error is None or not step.n_tips or rule.meshes >= _MOST:
        return False
    before = 0 if last is None else run_state(last).meshes
    if rule.meshes > before or (rule.meshes and step.index < _SETTLED):
        return False  # it was made for this step, or for a kink just behind it
    tolerance = float(rule.tolerance or 0.0)
    forgiven = 1.0 if rule.meshes == 0 else _FORGIVEN
    rate, turn = _errors_of_step(rule, step)
    if rule.meshes and _has_no_bar(step) and _sizes_for_room(rule, last) is None:
        return False
    if rule.meshes and last is not None and not _has_no_bar(step):
        rate, turn = map(min, (rate, turn), _errors_of_step(rule, last))
    of_life, of_path = SHARE * tolerance, (1 - PATH) * tolerance
    if last is None:
        return rate > _BEGIN * of_life or turn > _BEGIN_OF_PATH * of_path
    cycles, way = step.cycles, max(error.grown, _SIZE * min(step.sizes, default=0.0))
    if not (cycles > 0 and way > 0):
        return False
    # What the next solve tells better is no reason yet.
    life, path = error.life - error.newest_cycles, error.path_but_newest
    short_of_life = (error.K + error.contact + error.unknown) / cycles > of_life
    short_of_path = error.K_place / way > _SHORT_OF_PATH * tolerance
    return bool(
        (rate > forgiven * of_life and short_of_life and life / cycles > _WHOLE * tolerance)
        or (turn > forgiven * of_path and short_of_path and path / way > _WHOLE * tolerance)
        or (rule.meshes == 0 and _has_no_room(last, step))
    )


_FIRST, _MEASURED = 3, 4  # solves with bars of their own: the first ones, and each of so many
_MARGIN = 0.5  # of what K may take of a tolerance: bars that are foretold may be wrong
_STRAIGHT = 0.2  # rad, most that a path turns by on the way to a solve with foretold bars


def bars_are_foretold(rule: GrowthRule, last: Step) -> bool:
    """Whether the bars of K at the next solve may follow from those of the last one.

    In 2D under a cycle, between solves that have their own: where these leave a margin, the mesh
    stays, and the path is smooth. It follows from what is stored with the step: a run that is
    resumed does the same.
    """
    error, index = last.error, last.index + 1
    if not rule.estimates or error is None or rule.problem.mesh.dim == 3:
        return False
    if index < _FIRST or index % _MEASURED == 0 or run_state(last).meshes != rule.meshes:
        return False
    if not isinstance(rule.cycle, Cycle) or rule.load_program is not None or last.joins:
        return False
    plan = plan_of(last)
    if plan.joins or any(crack.ends_on for crack in plan.cracks):
        return False
    largest = max((float(np.abs(angle).max(initial=0.0)) for angle in last.angle), default=0.0)
    if largest > _STRAIGHT or not np.isfinite(error.rate):
        return False
    wanted = _MARGIN * float(rule.tolerance or 0.0)
    rate, turn = _errors_of_step(rule, last)
    return rate <= SHARE * wanted and turn <= (1 - PATH) * wanted


def _errors_of_step(rule: GrowthRule, step: Step) -> tuple[float, float]:
    """Errors of rate and direction at a step by K, as they count for life and path."""
    error = step.error
    if error is None or np.isnan(error.rate):  # a finer mesh may have one
        return 1.0, 1.0
    return TOGETHER * error.rate, error.turn


def _has_no_room(last: Step, step: Step) -> bool:
    """Whether a step is too long, and the cells leave no room for a shorter one."""
    error = step.control.error
    return error is not None and error > REJECTED and not last.control.can_shorten


def _with_room(rule: GrowthRule, other: GrowthRule, last: Step, step: Step) -> Step:
    """The step before, with the way ahead that a finer mesh allows."""
    places = np.concatenate([sif.x for sif in step.sif[0]])
    sizes = [cell_sizes(each.problem.mesh, places) for each in (rule, other)]
    control, error = last.control, step.control.error
    least = control.least * min(float(np.median(sizes[1] / sizes[0])), 1.0)
    length = control.length
    if error is not None and error > REJECTED:
        length = next_length(length, error, None, least)
    return replace(last, control=replace(control, length=length, least=least))


__all__ = ["SHARE", "bars_are_foretold", "finer", "fingerprint", "on", "prepared", "replanned"]
