"""Fatigue crack growth: one step after the other, from load states to cycles."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from math import inf, sqrt
from typing import Protocol, Unpack

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.checks import build_without_checks, copy_without_checks
from xcrack.base.errors import GeometryError, ProblemError, XcrackError, warn
from xcrack.crack.measures import crack_size
from xcrack.crack.meetings import LEAST
from xcrack.fatigue.checks import depends_on_ratio
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import Law, LawSets
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth import euler, fronts, joins_3d, tips
from xcrack.growth.alarms import alarm_of_energy, alarm_of_life, judged_step
from xcrack.growth.cells import at_step, begin, follow, known_bars, plan_again
from xcrack.growth.ends import (
    beyond_end,
    cannot_go_on,
    end_of_run,
    law_reaches_toughness,
    left_the_body,
    nothing_grows,
    refusal_of,
    short_kink,
    size_beyond,
)
from xcrack.growth.events import (
    Arriving,
    coming_arrivals,
    cut_off,
    ended_crack,
    have_left,
    joins_of,
    piece_cut_off,
    with_joins,
)
from xcrack.growth.levels import (
    load_factor_at,
    respond_to_states,
    respond_under_program,
    states_and_levels,
)
from xcrack.growth.options import GrowthOptions, GrowthRule, lists_options, run_of
from xcrack.growth.progress import Progress, WarningLog
from xcrack.growth.rates import Rates, check_choice, rates_of, warn_of_left_out
from xcrack.growth.response import Response, best_K
from xcrack.growth.stations import Identities, first_identities, identities_after, split
from xcrack.growth.step import (
    Arrival,
    Corrected,
    Join,
    Plan,
    RunState,
    Step,
    numbers_after,
    plan_of,
    run_state,
    solves_of,
)
from xcrack.growth.uncertainty import add_K_error, shortfall
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import Problem, problem_with_cracks
from xcrack.sif.sif import SIF


@lists_options
def grow(
    problem: Problem,
    law: Law | Mapping[str, Law] | LawSets,
    criterion: Criterion,
    cycle: Cycle | Spectrum,
    da: float | None = None,
    **options: Unpack[GrowthOptions],
) -> Generator[Step, None, str]:
    """Let the cracks of a problem grow under a repeated load cycle.

    Say how long the steps are (`da`, `cycles`), or how accurate the result is to be (`tolerance`).

    A generator: each `Step` is complete when it is handed over, and the next one is computed only
    when it is asked for. The value it returns says why growth ended, as `History.ended` does.

    Parameters
    ----------
    problem : Problem
        With the cracks as they are at first. The radius of the tip functions is taken at the
        first step and used in all.
    law : callable (dK_eq, R) -> da/dN, or mapping of str to such
        A mapping gives each material of the problem, by the name of its cell set, a law of its own,
        and a tip grows by that of the material that it is in, with its threshold and toughness.
        `paris`, `walker`, `forman`, `nasgro` ... or your own. Where it returns inf, the toughness
        is reached and growth ends. One with ``ratio="nominal"`` gets range and R < 0 of the scene
        without contact, in the direction that K with contact asks for: one more solve a step.
    criterion : callable (K, nu) -> (angle, dK_eq, R)
        `max_hoop_stress`, `mean_reference`, `weighted_angle` or your own; angles in rad.
    cycle : Cycle or Spectrum
        Of a spectrum `cycles` and `max_cycles` count repetitions, and so do the cycles of a step.
    da : float, length, optional
        Largest advance of any tip in a step.
    tolerance : float, optional
        Wanted error of the life, relative, and of the path, over the length grown: in place of `da`
        and `cycles`, which are upper bounds then. The mesh may be coarse: from the first step on
        whose error bars ask for it, cells are smaller where they contribute most, and those at the
        ends of the cracks move on with these. Each step is as long as its estimated error allows.
        Solved at order 2; growth follows the best K where its error bar is known, K elsewhere.
        `History.life_bar` says what came of it. The mesh of a step follows from the one as given
        and from what is stored with the step: whatever stops the run, and resumes it, the meshes
        are the same.
    max_unknowns : int, optional
        Most unknowns of the mesh that a tolerance chooses; 300 000 if omitted.
    cycles : float, optional
        Cycles of a step, as far as the last solves can tell; the fastest tip advances at most by
        `da`. The cycles of the step are then counted with the rates at its end too.
    scaling : {"law", "linear"}
        Advance of the slower tips: in proportion to their rate, or to dK_eq (with
        ``integrator="euler"`` only).
    integrator : {"pec", "euler"}
        Predict, evaluate, correct: path, shares of the tips and life of second order in the length
        of the steps, at one solve a step; fronts grow without the waves of long steps. Or Euler's
        rule, as in the source paper: each step goes on with the direction and rate at its
        beginning, so that the path is of first order.
    threshold : float, stress √length
        Below this dK_eq a tip does not grow.
    retardation : wheeler or willenborg, or mapping of str to such, optional
        Of cycles after an overload: growth is then followed cycle by cycle under a `Spectrum` of
        factors, with zones kept at each tip, or place along a front. `cycles` of a step are that;
        its `rate` stays that of the law. A mapping gives each material, by the name of its cell
        set, a model of its own.
    K_c : float, stress √length, optional
        Stop when the K_eq of any tip in any state reaches it; where it is left out, that of the
        material. The last step is made as long as that takes, to 2e-4 of K_c, with a solve at its
        end; so it is where a law returns inf, a ligament yields, or `max_cycles` are over.
    link_up : plastic_zone or callable K -> length, optional
        In 2D: stop when plastic zones fill a ligament: those of two tips that head for each other
        add up, that of one tip reaches what lies straight ahead, a hole, a side or another crack.
        Swift's criterion has ``plastic_zone(sigma_y, beta=2)``.
    stop_at_interface : bool
        End the run where a tip has come into a material in which none was at the start.
    max_steps : int, optional
        Stop after this many steps, the first included.
    max_cycles : float, optional
        Stop after this many cycles, to 2e-4 of them, or at the first step beyond where that is less
        than a tenth of a cell away.
    max_size : float, length, optional
        Stop when a crack is as long, by `Step.sizes`: in 2D its length in the body, in 3D its area
        over the length of its fronts. The last step ends there, unless one is shorter than two
        tenths of a cell.
    solver : optional
        As in `solve`.
    response : callable (problem, states, reuse, bars) -> Response, optional
        K from elsewhere than a solution: a handbook, a table, a test. It is asked in each step for
        K of the cracks of `problem` under some load states, factors of the loads or lists of loads:
        `Response.of_K` makes the answer from numbers. `reuse` is that of the response before, and
        `bars` says whether K needs error bars. `respond` is what is asked where it is left out.
    load_program : K_gradient, K_over_size, load_over_size or load_over_cycles, optional
        Loads that change as the crack grows: what all of them are multiplied by beside the cycle or
        spectrum, or the K that they are to give. `Step.load_factor` has it.
    progress : bool or "always"
        One line a step on standard error, if that is a terminal or a notebook (or always); with the
        time that is left, where `max_steps` or `max_cycles` allows an estimate.

    Returns
    -------
    generator of Step

    Raises
    ------
    ProblemError
        Options that do not fit; R < 0 under a law that must know how R is meant, and does not; a
        law that returns negative or nan; an angle of pi or more; an advance below a tenth of the
        cell at the tip (later in a run: a warning, and the run ends). A tolerance that is not
        between 0 and 1, with ``integrator="euler"``, or with contact by a method without estimate;
        `max_unknowns` below the first mesh.

    Warns
    -----
    XcrackWarning
        What `check` finds: numbers at the first step that are more likely slips of units, and where
        linear elasticity does not hold.
        A tolerance that is not met, with the source of the error and what to do; a mesh that would
        have more than `max_unknowns`.
        Where a tip passes from one material into another, with the cycles.
        A turn by more than 10 degrees with an advance below the cell along the path; R < 0 asked
        of a law that depends on R. Warnings that come again in later steps are counted, and
        summarised in one when the run ends.

    Notes
    -----
    Where the materials ahead of a tip differ, in stiffness or in law, a step ends before their
    interface and the next one behind it, whatever `da`: 1.1 cells beside one at which the stiffness
    changes, as K is off closer to it, and .3 cells where only laws do. The cycles of that step are
    those of its two parts, each by the law of its own material. Close to another stiffness K goes
    like a power of the distance (Zak and Williams 1963, for a crack that meets it at right angles).

    Cycles between two steps: `cycles_between`, with the rates at both, so a step costs one
    analysis of all load states and the life of ten steps is good to a few tenths of a per cent.

    Of a tolerance of the life, six tenths are for the steps and four for K: where the bars of K ask
    for more, cells become smaller until those of the step are as wanted, or nearly so.
    Steps are controlled by their estimated error (proportional and integral: Gustafsson 1991, ACM
    Trans. Math. Softw. 17, 533).

    Examples
    --------
    >>> import xcrack as xc
    >>> strip = xc.box((0, -1), (1, 1), (6, 12))
    >>> pull = [xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))]
    >>> crack = xc.line_crack([(-0.1, 0.02), (0.2, 0.02)])
    >>> scene = xc.Problem(strip, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=pull)
    >>> law, cycle = xc.paris(C=1e-3, m=3.0), xc.Cycle(0.0, 1.0)
    >>> steps = xc.grow(scene, law, xc.max_hoop_stress, cycle, tolerance=0.05, progress=False)
    >>> history = xc.collect(steps, until=lambda step: step.cycles > 50)
    >>> bool(history.life_bar.relative < 0.05)
    True
    """
    return growth_steps(run_of("grow", problem, law, criterion, cycle, da, options))


def first_step(rule: GrowthRule) -> Step:
    """The first step of a run alone, on the mesh as it is."""
    return _solved_step(rule, rule.problem, None, SolverState())[0]


def growth_steps(rule: GrowthRule, steps_done: Sequence[Step] = ()) -> Generator[Step, None, str]:
    """Steps of a run: from the beginning, or those that follow the steps that are done.

    Returns why the run ended.
    """
    check_choice(rule.law, rule.cycle.ratio)
    settings = rule.settings  # before a law is called that may change what it reads
    steps_done = steps_to_go_on_from(rule, steps_done)
    last_step, end = steps_done[-1] if steps_done else None, ""
    if rule.estimates:
        rule = begin(rule)
    first_rule = rule  # on the mesh of no step in particular
    if rule.estimates and last_step is not None:
        rule = at_step(first_rule, run_state(last_step))
    notices, progress = WarningLog(), Progress(rule)
    kink, is_torn = "", any(_alarm_of_segments(rule, step) for step in steps_done)
    try:
        if last_step is None:
            with notices.watch(0) as messages:
                first, reuse = _solved_step(rule, rule.problem, None, SolverState())
                count = len(messages)
                restart = None
                if not nothing_grows(rule, first):  # where nothing does, no mesh is fine enough
                    restart = plan_again(first_rule, rule, None, first)
                if restart is not None:
                    rule = restart[0]
                    del messages[:count]  # of a mesh that is not used
                    first, reuse = _solved_step(rule, rule.problem, None, SolverState())
                _warn_of_ratio(rule, first)
                _warn_of_left_out(rule, first)
                is_torn = _warn_of_mode_III(rule, first)
                first = _with_validity(rule, first)
            run = replace(run_state(first), settings=settings)
            last_step = copy_without_checks(first, warnings=tuple(messages), run=run)
            progress.step(last_step)
            yield last_step
        else:
            reuse = run_state(last_step).reuse
        while True:
            end = end_of_run(rule, last_step) or refusal_of(rule, last_step)
            if end:
                _refuse(last_step, end)
                break
            if not kink and (kink := short_kink(rule, last_step)):
                warn(kink)
            with notices.watch(last_step.index + 1) as messages:
                cut = last_step if rule.max_size is None else _cut_at_size(rule, last_step)
                next_rule = rule if rule.tolerance is None else follow(first_rule, rule, cut)
                reuse = reuse if next_rule is rule else reuse.without_matrices()
                next_step, reuse, end = _step_after(next_rule, cut, reuse)
                if next_step is None:
                    break
                is_torn = is_torn or _warn_of_mode_III(next_rule, next_step)
                count = len(messages)
                estimates = next_rule.estimates
                restart = plan_again(first_rule, next_rule, cut, next_step) if estimates else None
                if restart is not None:
                    del messages[:count]  # of a step that is not handed over
                else:
                    if cut is not last_step:
                        next_step = _with_mark(next_step)
                    next_step, reuse, end = _cut_at_end(
                        next_rule, cut, (next_step, reuse, end), messages
                    )
                    next_step = _with_validity(next_rule, next_step)
            if restart is not None:
                reuse = reuse if restart[0] is rule else run_state(last_step).reuse
                rule, last_step = restart[0], _with_plan(restart[0], restart[1] or last_step)
                continue
            rule = next_rule
            # Not kept with the step: a run that is resumed does not know the energy before.
            if alarm := alarm_of_energy(rule, cut, next_step):
                warn(str(alarm))
            last_step = copy_without_checks(next_step, warnings=tuple(messages))
            progress.step(last_step)
            yield last_step
            if end:
                break
    finally:
        notices.summarise()
        if end and last_step is not None:
            alarm = alarm_of_life(rule, last_step, end)
            if alarm is not None:
                warn(str(alarm))
        message = "" if last_step is None or not rule.estimates else shortfall(rule, last_step)
        if message:
            warn(message)
        progress.close()
    progress.end(end)
    return end


def steps_to_go_on_from(rule: GrowthRule, steps_done: Sequence[Step]) -> Sequence[Step]:
    """Stored steps without the last ones, if these were shortened for an end that has changed."""
    if steps_done and end_of_run(rule, steps_done[-1]):
        return steps_done
    while len(steps_done) > 1 and steps_done[-1].run is not None and steps_done[-1].run.cut:
        steps_done = steps_done[:-1]
    return steps_done


def _with_mark(step: Step) -> Step:
    """The step, marked as shorter than planned because the run ends."""
    return step if step.run is None else replace(step, run=replace(step.run, cut=True))


_AIM = 1e-4  # of K, or of the cycles: a run ends as far beyond its end, and at most twice
_TRIES = 6  # solves for that


def _cut_at_end(
    rule: GrowthRule,
    last_step: Step,
    ending: tuple[Step, SolverState, str],
    messages: list[str],
) -> tuple[Step, SolverState, str]:
    """A step that ends where the run does, in place of one that goes beyond.

    Parameters
    ----------
    rule : GrowthRule
    last_step : Step
        The one before.
    ending : (Step, SolverState, str)
        The whole step, what the next solve starts from, and why the run ends there, if it does.
    messages : list of str
        Warnings of the step, in place of which those of the shorter one come.

    Notes
    -----
    The false position by Dowell and Jarratt (1971, BIT 11, 168, "Illinois"), between the ends of
    the step, each time with a solve. No advance is below a tenth of a cell, which no mesh sees.
    """
    plan, is_break = plan_of(last_step), bool(law_reaches_toughness(rule, ending[0]))
    lower_length, upper_length = 0.0, plan.length * plan.part
    at_upper = beyond_end(rule, ending[0], is_break) - _AIM
    if at_upper <= _AIM:
        return ending
    at_lower = max(beyond_end(rule, last_step, is_break), -1.0) - _AIM
    least_length, reuse, bound = (1 + 1e-6) * LEAST * float(plan.cell[plan.tip]), ending[1], ""
    for _ in range(_TRIES):
        length = lower_length + (upper_length - lower_length) * at_lower / (at_lower - at_upper)
        length = max(length, least_length)
        if length >= upper_length - 1e-3 * least_length:
            break
        shorter_step = _with_length(rule, last_step, length)
        if plan_of(shorter_step).limit:
            break
        messages_before = messages[:]
        messages.clear()
        step, reuse, end = _step_after(rule, shorter_step, reuse)
        excess = -np.inf if step is None else beyond_end(rule, step, is_break) - _AIM
        if step is None or excess < -_AIM:
            messages[:] = messages_before
            if step is None:
                break
            lower_length, at_lower = length, excess
            at_upper *= 0.5 if bound == "upper" else 1.0
            bound = "upper"
            continue
        ending = _with_mark(step), reuse, end
        upper_length, at_upper = length, excess
        if excess <= _AIM:
            break
        at_lower *= 0.5 if bound == "lower" else 1.0
        bound = "lower"
    return ending


_SAME = 1e-10  # of a length that was asked for


def _cut_at_size(rule: GrowthRule, step: Step) -> Step:
    """A step shortened to end where a crack has the size `max_size`, found from the cracks alone.

    A rest of less than a tenth of a cell is avoided: then this step leaves that much.
    """
    from scipy.optimize import brentq

    plan = plan_of(step)
    least_length = (1 + 1e-6) * LEAST * float(plan.cell[plan.tip])
    planned_length = plan.length * plan.part

    def length_beyond(length: float) -> float:
        return size_beyond(rule, _scene(rule, _with_length(rule, step, length)).sizes)

    try:
        at_end, at_begin = (
            size_beyond(rule, _scene(rule, step).sizes),
            size_beyond(rule, step.sizes),
        )
        if at_end <= _SAME:
            slope = (at_end - at_begin) / planned_length
            is_there = (
                at_end >= -_SAME
                or planned_length < 2 * least_length
                or -at_end >= slope * least_length
            )
            return (
                step
                if is_there
                else _with_length(rule, step, planned_length - least_length - at_end / slope)
            )
        if length_beyond(least_length) >= 0:
            return _with_length(rule, step, least_length)
        length = brentq(
            length_beyond, least_length, planned_length, xtol=_SAME * least_length, rtol=1e-15
        )
        return _with_length(rule, step, length)
    except (GeometryError, ProblemError):  # the step itself says why it cannot be taken
        return step


def _with_length(rule: GrowthRule, step: Step, length: float) -> Step:
    """A step with a shorter plan; the advance of its stations is reduced in proportion."""
    shorter_step = _with_plan(
        rule, copy_without_checks(step, control=replace(step.control, length=length))
    )
    plan, plan_before = plan_of(shorter_step), plan_of(step)
    share = plan.largest / plan_before.largest if plan_before.largest > 0 else 1.0
    if rule.integrator == "euler":  # it recognises its stations by that, to round-off
        return copy_without_checks(shorter_step, da=split(plan.arc, [len(da) for da in step.da]))
    return copy_without_checks(shorter_step, da=tuple(share * da for da in step.da))


def _refuse(step: Step, end: str) -> None:
    """Raise where the first step of a run is too short for the mesh; later that ends it."""
    if step.plan is not None and step.plan.limit == "short" and end.startswith("the advance"):
        if step.index == 0:
            raise ProblemError(end)
        warn(end)


def _with_validity(rule: GrowthRule, step: Step) -> Step:
    """A step with how far elasticity holds at it; warns of what is beyond its limit."""
    validity, alarms = judged_step(rule, step)
    for alarm in alarms:
        warn(str(alarm))
    return copy_without_checks(step, validity=validity)


def _warn_of_left_out(rule: GrowthRule, first: Step) -> None:
    if isinstance(rule.cycle, Spectrum):
        warn_of_left_out(rule, Response(first.levels or rule.cycle.load_states, first.sif))


def _step_after(
    rule: GrowthRule, last_step: Step, reuse: SolverState
) -> tuple[Step | None, SolverState, str]:
    """The step after another one, or why there is none."""
    plan = plan_of(last_step)
    try:
        problem = _scene(rule, last_step)
    except GeometryError as error:
        return None, reuse, cannot_go_on(last_step, error)
    if plan.joins:
        slip = reuse.slip if len(plan.cracks) == len(last_step.cracks) else ()
        reuse = replace(reuse, centre=(), active=(), slip=slip)
    joins_of_step = joins_of(last_step, problem)
    try:
        end = cut_off(last_step, problem, joins_of_step)
    except GeometryError as error:
        return None, reuse, cannot_go_on(last_step, error)
    if joins_of_step and problem.mesh.dim == 2:
        reuse = SolverState()  # what belongs to numbers of cracks is void
    arrivals_ahead = coming_arrivals(last_step, problem)
    if not any(placed_crack.n_tips for placed_crack in problem.placed):
        step = _last_step(rule, last_step, problem, arrivals_ahead, joins_of_step)
        return step, reuse, end
    if end:
        return None, reuse, end
    try:
        step, reuse = _solved_step(rule, problem, last_step, reuse, joins_of_step)
        arrivals = _arrivals(rule, last_step, arrivals_ahead, step.cycles - last_step.cycles)
        return copy_without_checks(step, arrivals=arrivals), reuse, ""
    except GeometryError as error:
        return None, reuse, cannot_go_on(last_step, error)
    except XcrackError as error:
        if not have_left(plan.cracks, problem.placed):
            piece = piece_cut_off(last_step, problem) if problem.junctions else ""
            if not piece:
                raise
            return None, reuse, f"{piece}, after step {last_step.index}, N = {last_step.cycles:.6g}"
        words = left_the_body(rule, _arrivals(rule, last_step, arrivals_ahead))
        return None, reuse, f"{words}, and the body cannot be solved without it: {error}"


def _scene(rule: GrowthRule, step: Step) -> Problem:
    """The scene after the plan of a step, with the radius of the first."""
    problem = problem_with_cracks(rule.problem, plan_of(step).cracks, run_state(step).radius)
    _ = problem.placed  # an error here ends a run
    return problem


# How cracks go from one step to the next: the choice of an integrator.


class Integrator(Protocol):
    """What a run asks of an integrator; `euler`, `tips` and `fronts` have it."""

    def begin(self, rule: GrowthRule, rates: Rates, identities: Identities) -> Corrected:
        """The first step of a run."""

    def correct(
        self, rule: GrowthRule, step: Step, rates: Rates, identities: Identities
    ) -> Corrected:
        """What the cracks after an advance mean for the cycles and for the next advance."""

    def predict(self, rule: GrowthRule, step: Step) -> Plan:
        """What comes after a step."""

    def ends_of(self, step: Step, plan: Plan) -> Floats:
        """Where the ends of the cracks at the stations come to `(n, d)`."""

    def advance_of(self, step: Step, plan: Plan, rates: Rates) -> Floats:
        """Advance to the next step at the stations that were solved `(n,)`, length."""

    def cycles_until(
        self, rule: GrowthRule, step: Step, part: float, end_rate: float | None
    ) -> float:
        """Cycles of a part of the advance after a step, of which the whole takes `end_rate`.

        As the last solves see it, where no solve after it says what the whole takes.
        """


def integrator_of(rule: GrowthRule) -> Integrator:
    """The integrator of a run."""
    return _INTEGRATORS[rule.integrator, rule.problem.mesh.dim]


_INTEGRATORS: dict[tuple[str, int], Integrator] = {
    ("euler", 2): euler,
    ("euler", 3): euler,
    ("pec", 2): tips,
    ("pec", 3): fronts,
}


# A step.

_AGREES = 40  # times, until loads and cycles of a solve agree
_ROUND_OFF = 1e-12  # of the body: a place as near to zero is zero


def _solved_step(
    rule: GrowthRule,
    problem: Problem,
    last_step: Step | None,
    reuse: SolverState,
    joins_of_step: Sequence[Join] = (),
    may_foretell: bool = True,
) -> tuple[Step, SolverState]:
    """Solve all load states of a problem and decide where and how fast its cracks grow.

    With `may_foretell`, bars of K may be those of the last solve, a little wider.
    """
    bars_ahead = None
    if may_foretell and rule.estimates and not joins_of_step and last_step is not None:
        bars_ahead = known_bars(rule, last_step)
    if bars_ahead is not None and last_step is not None:
        if rule.max_steps is not None and last_step.index + 2 >= rule.max_steps:
            # The last step has bars of its own; of a run that goes on it is one among others.
            step, handed_on = _solved_step(rule, problem, last_step, reuse, joins_of_step, False)
            return _with_mark(step), handed_on
    if rule.load_program is None:
        response = respond_to_states(rule, problem, reuse, rule.estimates, known_bars=bars_ahead)
    else:
        N = 0.0 if last_step is None else last_step.cycles + plan_of(last_step).cycles
        response = respond_under_program(rule, problem, reuse, rule.estimates, N)
    sif, solutions, handed_on = response.sif, response.solutions, response.reuse
    rates = rates_of(rule, problem, copy_without_checks(response, sif=best_K(sif)))
    integrator = integrator_of(rule)
    if last_step is None:
        index, radius = 0, rule.problem.numerics.radius
        identities = first_identities(problem.placed)
        result = integrator.begin(rule, rates, identities)
        has_tip_functions = bool(solutions) and len(solutions[0].space.radius) > 0
        if radius is None and rule.tolerance is None and has_tip_functions:
            radius = float(np.min(solutions[0].space.radius))
    else:
        index, radius = last_step.index + 1, run_state(last_step).radius
        identities = _identities(rule, last_step, problem, joins_of_step)
        correct = joins_3d.correct_join if plan_of(last_step).joins else integrator.correct
        result = correct(rule, last_step, rates, identities)
        for _ in range(_AGREES if rule.follows_cycles else 0):  # the cycles were foretold
            change = load_factor_at(rule, problem, result.cycles) / response.load_factor
            if abs(change - 1) < _SAME:
                break
            response = response.scaled(sqrt(change))  # half of it: fewer cycles, smaller loads
            sif, solutions = response.sif, response.solutions
            rates = rates_of(rule, problem, copy_without_checks(response, sif=best_K(sif)))
            result = correct(rule, last_step, rates, identities)
    if rule.estimates:
        result = add_K_error(rule, last_step, result, rates, sif)
    states, levels = states_and_levels(rule.cycle, response)
    step = build_without_checks(
        Step,
        index=index,
        cycles=result.cycles,
        cracks=rates.cracks,
        sif=sif,
        angle=rates.split(rates.angle),
        dK_eq=rates.split(rates.dK_eq),
        R=rates.split(rates.R),
        rate=rates.split(rates.rate),
        da=rates.split(np.zeros(len(rates.rate))),
        solutions=solutions,
        levels=levels,
        corrected=result.cracks,
        error=result.error,
        joins=tuple(replace(join, N=result.cycles) for join in joins_of_step),
        states=states,
        law_rate=rates.split(rates.law_rate),
        R_range=rates.split(rates.R_range),
        sizes=problem.sizes,
        load_factor=response.load_factor,
        identities=identities,
        stations=result.stations,
        solves=result.solves,
        zones=result.zones,
        earlier_zones=result.earlier_zones,
        control=result.control,
        run=RunState(
            {} if last_step is None else run_state(last_step).settings,
            handed_on.without_matrices(),
            radius,
            rule.cells,
            rule.meshes,
        ),
    )
    step = _with_plan(rule, step)
    if response.has_known_bars and (step.plan is None or step.plan.limit or end_of_run(rule, step)):
        step, handed_on = _solved_step(rule, problem, last_step, handed_on, joins_of_step, False)
        return _with_mark(step), handed_on
    da = integrator.advance_of(step, plan_of(step), rates)
    return copy_without_checks(step, da=rates.split(da)), handed_on


def _with_plan(rule: GrowthRule, step: Step) -> Step:
    """A step with the plan of what comes after it."""
    plan = integrator_of(rule).predict(rule, step)
    step = copy_without_checks(step, plan=plan)
    if plan.limit and (plan.limit != "geometry" or rule.problem.mesh.dim == 2):
        return step
    try:
        return copy_without_checks(step, plan=with_joins(rule, step, plan))
    except GeometryError as error:
        return copy_without_checks(step, plan=replace(plan, limit="geometry", refusal=str(error)))


def _identities(
    rule: GrowthRule, step: Step, problem: Problem, joins_of_step: Sequence[Join]
) -> Identities:
    """Which tips, fronts and cracks those of the next scene are."""
    identities_before = step.identities or first_identities(step.cracks)
    numbers = numbers_after(len(step.cracks), joins_of_step, len(problem.placed))
    place = integrator_of(rule).ends_of(step, plan_of(step))
    return identities_after(identities_before, numbers, solves_of(step)[0], place, problem.placed)


def _last_step(
    rule: GrowthRule,
    step: Step,
    problem: Problem,
    arrivals_ahead: Sequence[Arriving],
    joins_of_step: Sequence[Join],
) -> Step:
    """The step at which no tip is left: cracks that end on the boundary, without K.

    Its cycles are those of the last tip.
    """
    plan = plan_of(step)
    arrivals = _arrivals(rule, step, arrivals_ahead)
    cracks = tuple(
        ended_crack(planned_crack, placed_crack, [a for a, _ in arrivals_ahead if a.crack == c])
        for c, (planned_crack, placed_crack) in enumerate(
            zip(plan.cracks, problem.placed, strict=True)
        )
    )
    no_places = tuple(np.zeros(0) for _ in cracks)
    cycles = max((arrival.cycles for arrival in arrivals), default=step.cycles)
    error = step.error
    if error is not None:  # no K has been solved for the last ligament: its cycles count in full
        unknown_cycles = error.unknown + cycles - step.cycles
        error = replace(error, place=no_places, newest_place=(), unknown=unknown_cycles)
    return Step(
        index=step.index + 1,
        cycles=max([cycles, *(join.N for join in joins_of_step)]),
        cracks=cracks,
        # Two cracks may have become one.
        sif=tuple(tuple(map(_without_stations, state[: len(cracks)])) for state in step.sif),
        angle=no_places,
        dK_eq=no_places,
        R=no_places,
        rate=no_places,
        da=no_places,
        levels=step.levels,
        error=error,
        arrivals=arrivals,
        joins=tuple(joins_of_step),
        states=step.states,
        law_rate=no_places,
        R_range=tuple(np.zeros((0, 2)) for _ in cracks),
        sizes=tuple(crack_size(cracks, c, problem.mesh) for c in range(len(cracks))),
        identities=_identities(rule, step, problem, joins_of_step),
        run=step.run,
    )


def _arrivals(
    rule: GrowthRule, step: Step, arrivals_ahead: Sequence[Arriving], end_rate: float | None = None
) -> tuple[Arrival, ...]:
    """When ends come to the boundary in the advance after a step.

    With the cycles of the whole advance, where it was solved.
    """
    integrator, mesh, result = integrator_of(rule), rule.problem.mesh, []
    for arrival, part in arrivals_ahead:
        N = step.cycles + integrator.cycles_until(rule, step, part, end_rate)
        x = tuple(0.0 if abs(v) < _ROUND_OFF * mesh.extent else v for v in arrival.x)
        result.append(replace(arrival, x=x, cycles=N))
    return tuple(result)


def _without_stations(sif: SIF) -> SIF:
    rows = {name: getattr(sif, name)[:0] for name in (
        "x", "frame", "K", "T", "spread", "s", "front", "at_surface", "closed", "domain_cells",
    )}  # fmt: skip
    return replace(
        sif, **rows, errors=None, ends=(), widened=None, smooth_K=None, E_prime=None, nu=None
    )


_OF_LARGEST = 0.1  # K_I below this share of the largest of a front compares with nothing


def _warn_of_mode_III(rule: GrowthRule, step: Step) -> bool:
    alarm = _alarm_of_segments(rule, step)
    if alarm:
        warn(alarm)
    return bool(alarm)


def _alarm_of_segments(rule: GrowthRule, step: Step) -> str:
    """What to say where a front is unstable under K_III, and would break into segments, or "".

    Above |K_III| / K_I = √((1 - nu)(2 - 3 nu) / (3 (2 - nu) - 4 √2 (1 - 2 nu))) a straight front is
    unstable (Leblond, Karma and Lazarus, 2011); below nu of -.04 it never is.
    """
    if rule.problem.mesh.dim == 2:
        return ""
    nu = rule.problem.elasticity.poisson
    growth = 3 * (2 - nu) - 4 * sqrt(2) * (1 - 2 * nu)
    limit = sqrt((1 - nu) * (2 - 3 * nu) / growth) if growth > 0 else inf
    for c, states in enumerate(zip(*step.sif, strict=True)):
        K = np.stack([state.K for state in states])
        K_I, K_III = K[..., 0], np.abs(K[..., 2])
        counts = (K_I > _OF_LARGEST * K_I.max(initial=0.0)) & ~states[0].at_surface
        ratio = np.divide(K_III, K_I, out=np.zeros_like(K_I), where=counts)
        if ratio.max(initial=0.0) > limit:
            state, place = np.unravel_index(np.argmax(ratio), ratio.shape)
            return (
                f"crack {c}: |K_III| is {ratio[state, place]:.2g} K_I at "
                f"{np.round(states[0].x[place], 6).tolist()}. Above {limit:.2g} a front breaks "
                "into segments that turn out of its surface; xcrack grows it as one, and its rate "
                "is a guess there."
            )
    return ""


def _warn_of_ratio(rule: GrowthRule, first: Step) -> None:
    """Warn where R < 0 was asked for and a law that depends on R never sees it."""
    if getattr(rule.law, "ratio", None) is not None:
        return
    ratio, dK_eq = rule.cycle.ratio, np.concatenate([d[d > 0] for d in first.dK_eq])
    if ratio is None or ratio >= 0 or not len(dK_eq) or not depends_on_ratio(rule.law, dK_eq):
        return
    warn(
        f"the cycle has R = {ratio:.4g}, but a closed crack has K_I = 0: the law sees K_max as "
        f"range and R = {min(float(R.min(initial=1.0)) for R in first.R):.2g} or more. Constants "
        "fitted with nominal R < 0 then give up to 3 times too small rates, which is unsafe: take "
        "those fitted for R = 0."
    )


__all__ = ["first_step", "grow", "growth_steps", "steps_to_go_on_from"]
