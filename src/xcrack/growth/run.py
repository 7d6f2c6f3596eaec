"""Fatigue crack growth: one step after the other, from load states to cycles."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from math import inf, sqrt
from typing import Unpack

import numpy as np

from xcrack.base.errors import GeometryError, ProblemError, XcrackError, warn
from xcrack.crack.crack import Crack
from xcrack.fatigue.checks import depends_on_ratio
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import Law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth import joining
from xcrack.growth.alarms import alarm_of_life, alarms_of_step
from xcrack.growth.arrivals import arrivals_of, last_step
from xcrack.growth.ending import (
    cut_off,
    end_at,
    falls_to_zero,
    joins_of,
    left_the_body,
    short_kink,
    too_short,
)
from xcrack.growth.follow import following
from xcrack.growth.integrators import integrator_of
from xcrack.growth.options import GrowthOptions, GrowthRule, lists_options, run_of
from xcrack.growth.prepared import again, fingerprint, prepared
from xcrack.growth.progress import Progress, WarningLog
from xcrack.growth.rates import (
    check_choice,
    evaluate,
    levels_of,
    respond_to_states,
    warn_of_left_out,
)
from xcrack.growth.step import LEAST, Advance, Cycle, Joined, Memory, Step, memory_of
from xcrack.growth.uncertainty import add_K_error, best_K, shortfall
from xcrack.linalg.engine import SolverState
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem


@lists_options
def grow(
    problem: Problem,
    law: Law,
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
    law : callable (dK_eq, R) -> da/dN
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
        and `cycles`, which are upper bounds then. The mesh may be coarse: at the first step whose
        error bars ask for it a scout grows the cracks from there in long steps, and where they
        run, cells become small enough for K; once more where the path leaves these cells. Each
        step is as long as its estimated error allows. Solved at order
        2; growth follows the best K where its error bar is known, K elsewhere. `History.life_bar`
        says what came of it. The scout knows nothing of `max_steps`, `max_cycles`, `K_c` and
        `until`: whatever stops the run, and resumes it, the meshes are the same.
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
    retardation : wheeler or willenborg, optional
        Of cycles after an overload: growth is then followed cycle by cycle under a `Spectrum` of
        factors, with zones kept at each tip, or place along a front. `cycles` of a step are that;
        its `rate` stays that of the law.
    K_c : float, stress √length, optional
        Stop when the K_eq of any tip in any state reaches it; where it is left out, that of the
        material.
    link_up : plastic_zone or callable K -> length, optional
        In 2D: stop when plastic zones fill a ligament: those of two tips that head for each other
        add up, that of one tip reaches what lies straight ahead, a hole, a side or another crack.
        Swift's criterion has ``plastic_zone(sigma_y, beta=2)``.
    max_steps : int, optional
        Stop after this many steps, the first included.
    max_cycles : float, optional
        Stop at the first step with at least this many cycles.
    solver : optional
        As in `solve`.
    response : callable (problem, states, reuse, bars) -> Response, optional
        K from elsewhere than a solution: a handbook, a table, a test. It is asked in each step for
        K of the cracks of `problem` under some load states, factors of the loads or lists of loads:
        `Response.of_K` makes the answer from numbers. `reuse` is that of the response before, and
        `bars` says whether K needs error bars. `respond` is what is asked where it is left out.
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
        A turn by more than 10 degrees with an advance below the cell along the path; R < 0 asked
        of a law that depends on R. Warnings that come again in later steps are counted, and
        summarised in one when the run ends.

    Notes
    -----
    Cycles between two steps: `cycles_between`, with the rates at both, so a step costs one
    analysis of all load states and the life of ten steps is good to a few tenths of a per cent.

    Of a tolerance of the life, half is for the steps and four tenths are for K: where the bars of K
    ask for more, cells become smaller until those of a few stages of the way are as wanted.
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
    return steps_of(run_of("grow", problem, law, criterion, cycle, da, options))


def first_step(run: GrowthRule) -> Step:
    """The first step of a run alone, on the mesh as it is."""
    return _next_step(run, run.problem, None, SolverState(), run.settings)[0]


def steps_of(
    run: GrowthRule, done: Sequence[Step] = (), meshes: Sequence[Mesh] = ()
) -> Generator[Step, None, str]:
    """Steps of a run: from the beginning, or those that follow the steps that are done.

    Of one with a tolerance, `meshes` are those that it has had.
    """
    check_choice(run.law, run.cycle.ratio)
    settings = run.settings  # before a law is called that may change what it reads
    asked, last = run, done[-1] if done else None
    ended = ""
    if run.estimates:
        run = prepared(run, steps_of, done, meshes)
    notices, progress = WarningLog(), Progress(run)
    kink, is_torn = "", False
    try:
        if last is None:
            with notices.watch(0) as messages:
                first, reuse = _next_step(run, run.problem, None, SolverState(), settings)
                own = len(messages)
                other = again(asked, run, steps_of, None, first)
                if other is not None:
                    run = other[0]
                    del messages[:own]  # of a mesh that nobody has
                    first, reuse = _next_step(run, run.problem, None, SolverState(), settings)
                _warn_of_ratio(run, first)
                warn_of_left_out(run, first)
                is_torn = _warn_of_mode_III(run, first)
                _warn_of_alarms(run, first)
            last = replace(first, warnings=tuple(messages))
            progress.step(last)
            yield last
        else:
            reuse = memory_of(last).reuse
        while True:
            ended = end_at(run, last)
            if ended:
                break
            plan = integrator_of(run).planned(run, last)
            if plan.falls_to_zero:
                ended = falls_to_zero(run, last, plan)
            if not ended and plan.largest < LEAST * plan.size:
                ended = too_short(run, last, plan)
                if last.index == 0:
                    raise ProblemError(ended)
                warn(ended)
            if ended:
                break
            if not kink:
                kink = short_kink(run, last, plan)
                if kink:
                    warn(kink)
            with notices.watch(last.index + 1) as messages:
                next_step, reuse, ended = _after(run, last, plan, reuse)
                if next_step is None:
                    break
                is_torn = is_torn or _warn_of_mode_III(run, next_step)
                own = len(messages)
                other = again(asked, run, steps_of, last, next_step)
                if other is not None:
                    del messages[:own]  # of a step that nobody has
                else:
                    _warn_of_alarms(run, next_step)
            if other is not None:
                reuse = reuse if other[0] is run else memory_of(last).reuse
                run, last = other[0], other[1] or last
                continue
            last = replace(next_step, warnings=tuple(messages))
            progress.step(last)
            yield last
            if ended:
                break
    finally:
        notices.summarise()
        if ended and last is not None and not run.scouts:
            alarm = alarm_of_life(run, last, ended)
            if alarm is not None:
                warn(str(alarm))
        short = "" if last is None or not run.estimates else shortfall(run, last)
        if short:
            warn(short)
        progress.close()
    progress.end(ended)
    return ended


def _warn_of_alarms(run: GrowthRule, step: Step) -> None:
    if not run.scouts:
        for alarm in alarms_of_step(run, step):
            warn(str(alarm))


def _after(
    run: GrowthRule, last: Step, plan: Advance, reuse: SolverState
) -> tuple[Step | None, SolverState, str]:
    """The step after another one, or why there is none."""
    try:
        cracks = integrator_of(run).advanced(run, last)
        met = joining.joined(run, last, cracks)
        if met is not None:
            cracks, reuse = list(met.cracks), replace(reuse, centre=(), active=())
        problem = _problem(run, cracks, memory_of(last))
    except GeometryError as error:
        return None, reuse, _stopped(last, error)
    joins = joins_of(last, problem, plan.cycles)
    ended = cut_off(last, problem, joins) if joins else ""
    if joins:
        reuse = (
            SolverState()
        )  # two cracks have become one: what belongs to numbers of cracks is void
    arriving = (
        following(run.problem.mesh).arriving(last, cracks, problem.placed, run.problem.mesh)
        if met is None
        else joining.arriving(run, last, met)
    )
    if not any(placed.n_tips for placed in problem.placed):
        step = last_step(run, last, cracks, problem.placed, arriving)
        when = max([step.cycles, *(join.N for join in joins)])
        return replace(step, cycles=when, joins=joins), reuse, ended
    if ended:
        return None, reuse, ended
    try:
        step, reuse = _next_step(run, problem, last, reuse, memory_of(last).settings, met)
        arrivals = arrivals_of(run, last, arriving, step.cycles - last.cycles)
        own = tuple(replace(join, N=step.cycles) for join in joins)
        return replace(step, arrivals=arrivals, joins=own or step.joins), reuse, ""
    except GeometryError as error:
        return None, reuse, _stopped(last, error)
    except XcrackError as error:
        if not _gone(run, cracks, problem.placed):
            raise
        left = left_the_body(run, arrivals_of(run, last, arriving, None))
        return None, reuse, f"{left}, and the body cannot be solved without it: {error}"


def _stopped(last: Step, error: Exception) -> str:
    return f"the cracks cannot go on after step {last.index}, N = {last.cycles:.6g}: {error}"


_OF_LARGEST = 0.1  # K_I below this share of the largest of a front compares with nothing


def _warn_of_mode_III(run: GrowthRule, step: Step) -> bool:
    """Warn where a front is unstable under K_III, and would break into segments.

    Above |K_III| / K_I = √((1 - nu)(2 - 3 nu) / (3 (2 - nu) - 4 √2 (1 - 2 nu))) a straight front is
    unstable (Leblond, Karma and Lazarus, 2011); below nu of -.04 it never is.
    """
    if run.problem.mesh.dim == 2:
        return False
    nu = run.problem.elasticity.poisson
    growth = 3 * (2 - nu) - 4 * sqrt(2) * (1 - 2 * nu)
    limit = sqrt((1 - nu) * (2 - 3 * nu) / growth) if growth > 0 else inf
    for c, states in enumerate(zip(*step.sif, strict=True)):
        K = np.stack([state.K for state in states])
        K_I, K_III = K[..., 0], np.abs(K[..., 2])
        counts = (K_I > _OF_LARGEST * K_I.max(initial=0.0)) & ~states[0].at_surface
        ratio = np.divide(K_III, K_I, out=np.zeros_like(K_I), where=counts)
        if ratio.max(initial=0.0) > limit:
            state, place = np.unravel_index(np.argmax(ratio), ratio.shape)
            warn(
                f"crack {c}: |K_III| is {ratio[state, place]:.2g} K_I at "
                f"{np.round(states[0].x[place], 6).tolist()}. Above {limit:.2g} a front breaks "
                "into segments that turn out of its surface; xcrack grows it as one, and its rate "
                "is a guess there."
            )
            return True
    return False


def _warn_of_ratio(run: GrowthRule, first: Step) -> None:
    """Warn where R < 0 was asked for and a law that depends on R never sees it."""
    if getattr(run.law, "ratio", None) is not None:
        return
    ratio, dK_eq = run.cycle.ratio, np.concatenate([d[d > 0] for d in first.dK_eq])
    if ratio is None or ratio >= 0 or not len(dK_eq) or not depends_on_ratio(run.law, dK_eq):
        return
    warn(
        f"the cycle has R = {ratio:.4g}, but a closed crack has K_I = 0: the law sees K_max as "
        f"range and R = {min(float(R.min(initial=1.0)) for R in first.R):.2g} or more. Constants "
        "fitted with nominal R < 0 then give up to 3 times too small rates, which is unsafe: take "
        "those fitted for R = 0."
    )


def _next_step(
    run: GrowthRule,
    problem: Problem,
    last: Step | None,
    reuse: SolverState,
    settings: Mapping[str, str],
    met: Joined | None = None,
) -> tuple[Step, SolverState]:
    """Solve all load states of a problem and decide where and how fast its cracks grow."""
    response = respond_to_states(run, problem, reuse, run.estimates)
    sif, solutions, handed_on = response.sif, response.solutions, response.reuse
    seen = evaluate(run, problem, replace(response, sif=best_K(sif)))
    integrator = integrator_of(run)
    if last is None:
        index, radius = 0, run.problem.numerics.radius
        settled = integrator.begun(run, seen)
        modelled = bool(solutions) and len(solutions[0].space.radius) > 0
        if radius is None and run.tolerance is None and modelled:
            radius = float(np.min(solutions[0].space.radius))
    else:
        index, radius = last.index + 1, memory_of(last).radius
        settled = (
            integrator.settled(run, last, seen)
            if met is None
            else joining.settled(run, last, seen, met)
        )
    settled = add_K_error(run, last, settled, seen, sif)
    memory = Memory(
        seen.law_rate,
        seen.length,
        settled.pending,
        radius,
        handed_on.without_matrices(),
        settings,
        settled.trail,
        fingerprint(problem.mesh) if run.estimates else "",
        run.meshes,
    )
    step = Step(
        index=index,
        cycles=settled.cycles,
        cracks=seen.cracks,
        sif=sif,
        angle=seen.angle,
        dK_eq=seen.dK_eq,
        R=seen.R,
        rate=seen.rate,
        da=settled.da,
        solutions=solutions,
        memory=memory,
        levels=levels_of(run.cycle, response),
        corrected=settled.corrected,
        error=settled.error,
        joins=() if met is None else met.joins,
    )
    return step, handed_on


def _problem(run: GrowthRule, cracks: Sequence[Crack], memory: Memory) -> Problem:
    """The scene with the cracks of another step, and the radius of the first."""
    numerics = run.problem.numerics
    if memory.radius is not None:
        numerics = replace(numerics, radius=memory.radius)
    problem = replace(run.problem, cracks=tuple(cracks), numerics=numerics)
    _ = problem.placed  # an error here ends a run
    return problem


def _gone(run: GrowthRule, cracks: Sequence[Crack], placed: Sequence[Crack]) -> bool:
    """Whether tips, or fronts, have left the body."""
    twin = following(run.problem.mesh)
    return any(twin.gone(*pair) for pair in zip(cracks, placed, strict=True))


__all__ = ["grow", "steps_of"]
