"""The mesh of a run with a tolerance: as given, and smaller cells where the bars of K ask for them.

Each step is solved on the mesh that the run begins with, bisected to sizes that are stored with the
step: around the ends of its cracks, with which they move, and around a few places that stay.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from xcrack.adaptivity.indicators import Indicators, indicators_of
from xcrack.adaptivity.resolved import resolved_tips
from xcrack.adaptivity.sizes_2d import cell_ratios, tip_sizes
from xcrack.adaptivity.sizes_3d import coarse_mesh
from xcrack.base.errors import (
    GeometryError,
    ProblemError,
    XcrackError,
    collected_warnings,
    warn,
)
from xcrack.crack.crack import kink_numbers
from xcrack.crack.measures import exit_ahead
from xcrack.crack.meetings import LEAST
from xcrack.fatigue.checks import law_exponent
from xcrack.fatigue.criteria import START
from xcrack.fatigue.cycle import Cycle
from xcrack.growth.options import GrowthRule
from xcrack.growth.response import KnownBars
from xcrack.growth.stations import CellSizes
from xcrack.growth.step import RunState, Step, StepError, plan_of, run_state, solves_of
from xcrack.growth.step_length import (
    PATH,
    REJECTED,
    STEPS,
    cell_for,
    first_length,
    next_length,
)
from xcrack.growth.tips import LONGER_FIRST
from xcrack.growth.uncertainty import TOGETHER, foretold_bars
from xcrack.mesh.locate import cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import graded_sizes, growing_sizes, refine
from xcrack.model.problem import Problem

# The mesh that a run begins with, and that of each step.

_COARSEST = 1.3  # times the size that sees crack and room: error bars can just be had there
_SLOPE = 0.25  # growth of cells with the distance from a tip, on the first mesh
_ROOM = 2.0  # times the least advance in cells: a given da has cells that see it
_LARGER = 1.25  # cells at an end over the size wanted there, from which on the mesh follows it


def begin(rule: GrowthRule) -> GrowthRule:
    """A run on the mesh that it begins with: as given, where error bars can be had on it.

    Else it is finer at tips and fronts, along these as half of the tolerance lets: lives err more.

    Raises
    ------
    ProblemError
        That has more unknowns than the run may have.
    """
    mesh = _MESHES[rule.problem.mesh.dim].first_mesh(rule.problem, (rule.tolerance or 0.0) / 2)
    least_unknowns = mesh.dim * (mesh.n_points + len(mesh.edges))
    if rule.max_unknowns is not None and least_unknowns > rule.max_unknowns:
        raise ProblemError(
            f"grow: max_unknowns = {rule.max_unknowns}, and the first mesh, on which cracks are a "
            f"few cells long, has {least_unknowns} at least: allow more, or give a coarser mesh."
        )
    return replace(rule, problem=replace(rule.problem, mesh=mesh, order=2))


def at_step(first_rule: GrowthRule, state: RunState) -> GrowthRule:
    """A run on the mesh of one of its steps."""
    return _with_cells(first_rule, state.cells, state.meshes)


def bisect_mesh(mesh: Mesh, cells: CellSizes) -> Mesh:
    """A mesh in cells of sizes that grow with the distance from some places."""
    return refine(mesh, size=graded_sizes([cells.x], [cells.size]))


def _with_cells(first_rule: GrowthRule, cells: CellSizes | None, meshes: int) -> GrowthRule:
    if cells is not None:
        mesh = bisect_mesh(first_rule.problem.mesh, cells)
        first_rule = replace(first_rule, problem=replace(first_rule.problem, mesh=mesh))
    return replace(first_rule, cells=cells, meshes=meshes)


def follow(first_rule: GrowthRule, rule: GrowthRule, step: Step) -> GrowthRule:
    """The run on the mesh of the next step, whose ends are where the plan of the last one leads.

    Parameters
    ----------
    first_rule, rule : GrowthRule
        On the mesh that it begins with, and on that of the last step.
    step : Step
    """
    cells = rule.cells or CellSizes.without_places(rule.problem.mesh.dim)
    longest_cell = np.inf if rule.da is None else rule.da / (_ROOM * LEAST)
    if not cells.moves.any() and longest_cell == np.inf:
        return rule
    try:
        x = replace(rule.problem, cracks=plan_of(step).cracks).stations.x
    except (GeometryError, ProblemError):  # the step itself says why it cannot be taken
        return rule
    if not len(x):
        return rule
    size = np.minimum(cells.size_at(x), longest_cell)
    if (cell_sizes(rule.problem.mesh, x) <= _LARGER * size).all():
        return rule
    return _with_cells(first_rule, cells.with_ends(x, size), rule.meshes)


def _first_mesh_2d(problem: Problem, _: float) -> Mesh:
    """The mesh as it was given, where cracks are long enough in it; else finer at the tips."""
    problem = resolved_tips(problem)
    place, size = tip_sizes(problem)
    if (cell_sizes(problem.mesh, place) <= _COARSEST * size).all():
        return problem.mesh
    return refine(problem.mesh, size=growing_sizes(place, size, _SLOPE))


# Sizes by the bars of K at one step.

SHARE = 0.4  # of the tolerance: what K may take
_LEAST_EXPONENT = 2.0  # of the law, in the error of life; directions err by twice that of K_II
_FORETOLD = 4.0  # times the wanted bar: from there the next mesh need not be looked at again
_MOST_UNKNOWNS = 300_000


def refine_cells(first_rule: GrowthRule, rule: GrowthRule, step: Step) -> GrowthRule:
    """The run on a mesh on which the bars of K at a step are as wanted, or nearly so.

    Parameters
    ----------
    first_rule, rule : GrowthRule
        On the mesh that it begins with, and on that of the step.
    step : Step
    """
    dimension, start = _MESHES[rule.problem.mesh.dim], perf_counter()
    most_unknowns = rule.max_unknowns or _MOST_UNKNOWNS
    tolerance = float(rule.tolerance or 0.0)
    target = SHARE / TOGETHER * tolerance / _exponent(rule, step)
    meshes = rule.meshes + 1
    for number in range(dimension.rounds):
        indicators = _bars_of_cracks(rule, step)
        if indicators is None:
            break
        error, unknowns = dimension.error(indicators), indicators.solutions[0].space.n_dof
        _tell(
            rule, f"mesh {number}: {unknowns} unknowns, K within {error:.1e}, wanted {target:.1e}",
            start,
        )  # fmt: skip
        if error <= target:
            break
        new_rule = _with_cells(
            first_rule, dimension.cells(rule.cells, indicators, target * indicators.scale), meshes
        )
        n_cells_before = len(rule.problem.mesh.cells)
        n_cells_after = len(new_rule.problem.mesh.cells)
        if unknowns * n_cells_after > most_unknowns * n_cells_before:
            warn(
                f"grow: the mesh that tolerance = {tolerance:g} asks for would have more than "
                f"{most_unknowns} unknowns: growth goes on with {unknowns}, on which K is known to "
                f"{error:.1e} of its largest value, where {target:.1e} was wanted. Allow more with "
                "max_unknowns; life_bar says what it costs."
            )
            return replace(rule, meshes=_MOST)
        rule = new_rule
        if error <= _FORETOLD * target or n_cells_after == n_cells_before:
            break
    return replace(rule, meshes=meshes)


def _exponent(rule: GrowthRule, step: Step) -> float:
    """Exponent of the law at the ranges of a step, and no less than the least."""
    exponent = law_exponent(rule.law, np.concatenate(step.dK_eq), np.concatenate(step.R))
    return float(max(exponent, _LEAST_EXPONENT))


def _bars_of_cracks(rule: GrowthRule, step: Step) -> Indicators | None:
    """K of the cracks of a step with its bars; None where the mesh has none."""
    with collected_warnings([]):  # they come again in the run
        try:
            scene = replace(rule.problem, cracks=step.cracks)
            return indicators_of(scene, rule.cycle.load_states)
        except XcrackError:
            return None


def _tell(rule: GrowthRule, line: str, start: float) -> None:
    if rule.progress == "always" or (rule.progress and sys.stderr.isatty()):
        print(f"{line}, {perf_counter() - start:.2g} s", file=sys.stderr)


_AIM = 0.7  # of the wanted half-widths
_SMALLER = 0.85  # ratio of sizes from which on a cell is worth a place
_AT_TIP, _AT_KINK = 4.0, 2.0  # cells: what belongs to a tip and moves with it, to a kink and stays


def _error_2d(indicators: Indicators) -> float:
    """Largest half-width of K over the largest K, of those that are known."""
    scale = indicators.scale_of(indicators.K[np.isfinite(indicators.K)])
    return (
        float(indicators.bar[np.isfinite(indicators.bar)].max(initial=0.0)) / scale
        if scale > 0
        else 0.0
    )


def _cells_2d(cells: CellSizes | None, indicators: Indicators, target: float) -> CellSizes:
    """Sizes at the tips and at other cells that contribute much to the bars."""
    mesh, tips = indicators.problem.mesh, indicators.problem.stations.x
    ratio = cell_ratios(indicators, target, _AIM)
    centre, target_size = mesh.cell_middles, ratio * mesh.cell_size
    is_smaller = ratio < _SMALLER
    size = cell_sizes(mesh, tips)
    distance = np.linalg.norm(centre[:, None] - tips, axis=2)
    is_at_tip = distance <= _AT_TIP * size
    bends = [crack.points[kink_numbers(crack.points)] for crack in indicators.problem.placed]
    kinks = np.concatenate([np.zeros((0, 2)), *bends])
    from_kinks = np.linalg.norm(centre[:, None] - kinks, axis=2)
    is_at_kink = (from_kinks <= _AT_KINK * cell_sizes(mesh, kinks)).any(axis=1)
    is_at_tip &= ~is_at_kink[:, None] | (distance <= size)
    if cells is not None and cells.moves.any():
        size = np.minimum(size, cells.size_at(tips))
    for k, is_of_tip in enumerate((is_at_tip & is_smaller[:, None]).T):
        size[k] = min(size[k], target_size[is_of_tip].min(initial=np.inf))
    is_staying = is_smaller & ~is_at_tip.any(axis=1)
    cells_that_stay = CellSizes(
        centre[is_staying], target_size[is_staying], np.zeros(int(is_staying.sum()), dtype=bool)
    )
    return (cells or CellSizes.without_places(2)).with_places(cells_that_stay).with_ends(tips, size)


_POWER = 2.5  # of the cells' size with which bars fall at order 2, on graded meshes (measured)
_FINER = 1.6  # times finer in a round


def _error_3d(indicators: Indicators) -> float:
    """Mean half-width of K along the fronts of all states, over the largest K."""
    is_finite = np.isfinite(indicators.bar).all(axis=1)
    scale = indicators.scale_of(indicators.K[is_finite])
    return float(indicators.bar[is_finite].max(axis=1).mean()) / scale if scale > 0 else 0.0


def _cells_3d(cells: CellSizes | None, indicators: Indicators, target: float) -> CellSizes:
    """Sizes along the fronts, each as much smaller as the mean of the bars asks for."""
    stations, mesh = indicators.problem.stations, indicators.problem.mesh
    excess = _error_3d(indicators) * indicators.scale / target if target > 0 else 1.0
    size = np.array(cell_sizes(mesh, stations.x))
    for crack in np.unique(stations.crack):
        is_of_crack = stations.crack == crack
        size[is_of_crack] = np.median(size[is_of_crack])
    size /= np.clip(excess, 1.0, _FINER**_POWER) ** (1 / _POWER)
    return (cells or CellSizes.without_places(3)).with_ends(stations.x, size)


@dataclass(frozen=True)
class _Dimension:
    """What is another thing in 2D and in 3D."""

    first_mesh: Callable[[Problem, float], Mesh]
    error: Callable[[Indicators], float]
    cells: Callable[[CellSizes | None, Indicators, float], CellSizes]
    rounds: int


_MESHES = {
    2: _Dimension(_first_mesh_2d, _error_2d, _cells_2d, 6),
    3: _Dimension(coarse_mesh, _error_3d, _cells_3d, 3),
}

# When a step asks for a finer mesh than it was computed on, and is computed again on that.

_MOST = 4  # meshes that a run makes: behind that it goes on, and its bars say how well
_FORGIVEN = 3.0  # times the share of K: bars along the way were foretold, not measured

_SETTLED = 4  # steps: before, bars are wide behind a kink whose face is short, on any mesh
_SIZE = 0.5  # of a crack: of less growth than that a path may err by a share of as much
_WHOLE = 1.0  # of the tolerance, by all sources: below that no finer mesh is worth it
# Times the share of K at the first step: bars of a crack that grows become shorter, and directions
# err for the first step only.
_BEGIN, _BEGIN_OF_PATH = 1.5, 3.0
_SHORT_OF_PATH = 0.5  # of the tolerance: by K alone
# A step in 2D whose own error is too large stays as it is where life and path are well within the
# tolerance all the same, if that error is not many times what was wanted.
_WELL_WITHIN, _TOLERABLE = 0.9, 5.0
_SECOND = 0.5  # of the first step: a parabola through nearer solves mends its cycles no more
_LAST = 0.1  # of the cycles so far: what the rest may take at the present rate
_SHORT = 1.3  # times a first step: the shortest that cells at kinks may allow


def plan_again(
    first_rule: GrowthRule, rule: GrowthRule, last_step: Step | None, step: Step
) -> tuple[GrowthRule, Step | None] | None:
    """The run and the step from which one is to be computed again; None where that is good.

    It follows from what is stored with the step before: a run that is resumed does the same.

    Parameters
    ----------
    first_rule, rule : GrowthRule
        On the mesh that it begins with, and on that of the step.
    last_step : Step or None
        The one before, which is handed over.
    step : Step
    """
    new_rule = _finer_at_kinks(first_rule, rule, step) if last_step is None else None
    if new_rule is not None:
        return new_rule, None
    shorter_step = None if last_step is None else _step_before(rule, last_step, step)
    if shorter_step is not None:  # what the mesh leaves to be wished is seen on a step that stays
        return rule, shorter_step
    if not _is_mesh_too_coarse(rule, last_step, step):
        return None
    cells = _cells_for_room(rule, last_step) if _has_no_bar(step) else None
    if cells is not None:
        new_rule = _with_cells(first_rule, cells, rule.meshes + 1)
    elif _ends_soon(rule, step):
        return None
    else:
        new_rule = refine_cells(first_rule, rule, step)
    return new_rule, last_step if last_step is None else _with_room(rule, new_rule, last_step, step)


def _is_within_tolerance(rule: GrowthRule, step: Step) -> bool:
    """Whether life and path are well within the tolerance at a step, by all sources so far."""
    error, limit = step.error, _WELL_WITHIN * float(rule.tolerance or 0.0)
    if error is None or not error.grown > 0:
        return False
    return bool(error.life <= limit * step.cycles and error.path <= limit * error.grown)


def _step_before(rule: GrowthRule, last_step: Step, step: Step) -> Step | None:
    """The step before one whose error is too large, with a shorter way ahead; None if that is not.

    It follows from what is stored with both: a run that is taken up again does the same.
    """
    error, control = step.control.error, last_step.control
    if error is None or error <= REJECTED or not control.can_shorten:
        return None
    if rule.problem.mesh.dim == 2 and error <= _TOLERABLE and _is_within_tolerance(rule, step):
        return None
    least_length = max(control.least, _second_length(rule, last_step))
    length = next_length(control.length, error, None, least_length)
    if length >= control.length:
        return None
    return replace(last_step, control=replace(control, length=length))


def _second_length(rule: GrowthRule, step: Step) -> float:
    """Shortest step after the first one of all tips, length; 0 after others."""
    solves = solves_of(step)[1]
    if rule.problem.mesh.dim == 3 or solves.n_solves != 2:
        return 0.0
    return _SECOND * float(solves.sigma[1] - solves.sigma[0])


def _ends_soon(rule: GrowthRule, step: Step) -> bool:
    """Whether so little of the life is left to the last tip that no finer mesh is worth its time.

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


def _finer_at_kinks(first_rule: GrowthRule, rule: GrowthRule, first: Step) -> GrowthRule | None:
    """Finer cells at tips that kink at once, for a first step that a tolerance asks for.

    None where that step has room.
    """
    if rule.meshes or rule.problem.mesh.dim == 3 or not rule.estimates or not first.n_tips:
        return None
    stations, solves = solves_of(first)
    allowance = STEPS * float(rule.tolerance or 0.0)
    length = first_length(LONGER_FIRST * float(solves.scale.min()), allowance, 0.0)
    if not first.control.least > _SHORT * length:
        return None
    sizes = np.array([cell_for(length, angle) for angle in np.concatenate(first.angle).tolist()])
    stay = np.zeros(len(sizes), dtype=bool)
    return _with_cells(first_rule, CellSizes(stations.x, sizes, stay), rule.meshes + 1)


def _cells_for_room(rule: GrowthRule, step: Step | None) -> CellSizes | None:
    """Smaller cells where tips of the next step have too little room; None where they have it."""
    if step is None or rule.problem.mesh.dim == 3:
        return None
    try:
        place, size = tip_sizes(replace(rule.problem, cracks=plan_of(step).cracks))
    except GeometryError:
        return None
    if (cell_sizes(rule.problem.mesh, place) <= size).all():
        return None
    cells = rule.cells
    if cells is None:
        return CellSizes(place, size, np.ones(len(size), dtype=bool))
    return cells.with_ends(place, np.minimum(size, cells.size_at(place)))


def _is_mesh_too_coarse(rule: GrowthRule, last_step: Step | None, step: Step) -> bool:
    """Whether the bars of K are too wide on the mesh of a step, or its cells too long."""
    error = step.error
    if not rule.estimates or error is None or not step.n_tips or rule.meshes >= _MOST:
        return False
    meshes_before = 0 if last_step is None else run_state(last_step).meshes
    if rule.meshes > meshes_before or (rule.meshes and step.index < _SETTLED):
        return False  # it was made for this step, or for a kink just behind it
    tolerance = float(rule.tolerance or 0.0)
    forgiven_factor = 1.0 if rule.meshes == 0 else _FORGIVEN
    rate, turn = _errors_of_step(step)
    if rule.meshes and _has_no_bar(step) and _cells_for_room(rule, last_step) is None:
        return False
    if rule.meshes and last_step is not None and not _has_no_bar(step):
        rate, turn = map(min, (rate, turn), _errors_of_step(last_step))
    of_life, of_path = SHARE * tolerance, (1 - PATH) * tolerance
    if last_step is None:
        return rate > _BEGIN * of_life or turn > _BEGIN_OF_PATH * of_path
    cycles, way = step.cycles, max(error.grown, _SIZE * min(step.sizes, default=0.0))
    if not (cycles > 0 and way > 0):
        return False
    # What the next solve tells better is no reason yet.
    life, path = error.life - error.newest_cycles, error.path_but_newest
    short_of_life = (error.K + error.contact + error.unknown) / cycles > of_life
    short_of_path = error.K_place / way > _SHORT_OF_PATH * tolerance
    return bool(
        (rate > forgiven_factor * of_life and short_of_life and life / cycles > _WHOLE * tolerance)
        or (turn > forgiven_factor * of_path and short_of_path and path / way > _WHOLE * tolerance)
        or (rule.meshes == 0 and _has_no_room(last_step, step))
    )


_MEASURED = 4  # solves: each of so many has bars of its own
_MARGIN = 0.8  # of what K may take of a tolerance: bars that are foretold may be wrong
_PASSING = 2.0  # times that, in a step of few cycles
_OF_TURN = 2.0  # times K_II over K_I: the angle by which a crack turns
_STRAIGHT = 0.2  # rad, most that a path turns by on the way to a solve with foretold bars


def known_bars(rule: GrowthRule, step: Step) -> KnownBars | None:
    """Bars of K at the next solve, as they follow from those of the last one; None: from its own.

    In 2D under a cycle, between solves that have their own: where these leave a margin, the mesh
    stays, and the path is smooth. It follows from what is stored with the step: a run that is
    resumed does the same.
    """
    error, index = step.error, step.index + 1
    if error is None or rule.problem.mesh.dim == 3:
        return None
    if index % _MEASURED == 0 or run_state(step).meshes != rule.meshes:
        return None
    if not isinstance(rule.cycle, Cycle) or rule.load_program is not None or step.joins:
        return None
    plan = plan_of(step)
    if plan.joins or any(crack.ends_on for crack in plan.cracks):
        return None
    max_angle = max((float(np.abs(angle).max(initial=0.0)) for angle in step.angle), default=0.0)
    is_behind_kink = step.index == 0 and max_angle > START
    if not np.isfinite(error.rate) or (max_angle > _STRAIGHT and not is_behind_kink):
        return None
    widths = _widest_bars(rule, step, error)
    if foretold_bars(step.sif, step.sif, widths, is_behind_kink) is None:
        return None  # not even at the same K
    return lambda sif: foretold_bars(step.sif, sif, widths, is_behind_kink)


def _widest_bars(rule: GrowthRule, step: Step, error: StepError) -> tuple[float, float]:
    """Half-widths of K_I and K_II at the next solve, over the largest K, that life and path bear.

    With them, and those of before, K takes no more of the whole than a margin lets it.
    """
    plan, tolerance = plan_of(step), float(rule.tolerance or 0.0)
    way = float(plan.arc.max(initial=0.0))

    def largest_error(
        share: float, total: float, spent: float, part: float, error_now: float
    ) -> float:
        unspent = _MARGIN * share * tolerance * total - spent
        bound = 2 * unspent / part - error_now if part > 0 else 0.0
        return float(np.clip(bound, 0.0, _PASSING * share * tolerance))

    spent_cycles = (error.K + error.contact) / TOGETHER
    rate_error = largest_error(
        SHARE / TOGETHER, step.cycles + plan.cycles, spent_cycles, plan.cycles, error.rate
    )
    turn = largest_error(1 - PATH, error.grown + way, error.K_place, way, error.turn)
    return rate_error / _exponent(rule, step), turn / _OF_TURN


def _errors_of_step(step: Step) -> tuple[float, float]:
    """Errors of rate and direction at a step by K, as they count for life and path."""
    error = step.error
    if error is None or np.isnan(error.rate):  # a finer mesh may have one
        return 1.0, 1.0
    return TOGETHER * error.rate, error.turn


def _has_no_room(last_step: Step, step: Step) -> bool:
    """Whether a step is too long, and the cells leave no room for a shorter one."""
    error = step.control.error
    return error is not None and error > REJECTED and not last_step.control.can_shorten


def _with_room(rule: GrowthRule, new_rule: GrowthRule, last_step: Step, step: Step) -> Step:
    """The step before, with the way ahead that a finer mesh allows."""
    places = np.concatenate([sif.x for sif in step.sif[0]])
    sizes = [cell_sizes(r.problem.mesh, places) for r in (rule, new_rule)]
    control, error = last_step.control, step.control.error
    least_length = control.least * min(float(np.median(sizes[1] / sizes[0])), 1.0)
    length = control.length
    if error is not None and error > REJECTED:
        length = next_length(length, error, None, least_length)
    return replace(last_step, control=replace(control, length=length, least=least_length))


__all__ = [
    "SHARE",
    "at_step",
    "begin",
    "bisect_mesh",
    "follow",
    "known_bars",
    "plan_again",
    "refine_cells",
]
