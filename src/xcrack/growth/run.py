"""Fatigue crack growth: one step after the other, from load states to cycles."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from typing import Unpack

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.crack.crack import Crack
from xcrack.errors import GeometryError, ProblemError, XcrackError, warn
from xcrack.growth.advance import LEAST, Advance, PerCrack, plan_advance
from xcrack.growth.checks import directed, law_rate
from xcrack.growth.criteria import Criterion
from xcrack.growth.ending import end_at, left_the_body, place_name, too_short
from xcrack.growth.follow import following
from xcrack.growth.laws import Law
from xcrack.growth.options import GrowOptions, Run, lists_options, run_of
from xcrack.growth.progress import report_end, report_step
from xcrack.growth.step import Cycle, Memory, Step, memory_of
from xcrack.mesh.locate import cell_sizes
from xcrack.scene.problem import Problem
from xcrack.sif.interaction_2d import stress_intensities
from xcrack.sif.sif import SIF
from xcrack.solvers.reuse import Reuse


@lists_options
def grow(
    problem: Problem,
    law: Law,
    criterion: Criterion,
    cycle: Cycle,
    da: float | None = None,
    **options: Unpack[GrowOptions],
) -> Generator[Step, None, str]:
    """Let the cracks of a problem grow under a repeated load cycle.

    A generator: each `Step` is complete when it is handed over, and the next one is computed only
    when it is asked for. The value it returns says why growth ended; `collect` keeps it.

    Parameters
    ----------
    problem : Problem
        With the cracks as they are at first. The radius of the tip functions is taken at the
        first step and kept.
    law : callable (dK_eq, R) -> da/dN
        `paris`, `elber`, `walker` or your own.
    criterion : callable (K, nu) -> (angle, dK_eq, R)
        `max_hoop_stress`, `mean_reference`, `weighted_angle` or your own.
    cycle : Cycle
    da : float, length, optional
        Largest advance of any tip in a step.
    cycles : float, optional
        Cycles of a step: each tip advances by its rate times this, at most by `da`. The cycles
        of the step are then counted with the rate at its end too.
    scaling : {"law", "linear"}
        Advance of the slower tips: in proportion to their rate, or to dK_eq.
    threshold : float, stress √length
        Below this dK_eq a tip does not grow.
    K_c : float, stress √length, optional
        Stop when the K_eq of any tip in any state reaches it.
    max_steps : int, optional
        Stop after this many steps, the first included.
    max_cycles : float, optional
        Stop at the first step with at least this many cycles.
    solver : optional
        As in `solve`.
    progress : bool or "always"
        One line a step on standard error, if that is a terminal (or always).

    Returns
    -------
    generator of Step

    Raises
    ------
    ProblemError
        Options that do not fit; a law that returns negative or nan; an advance below a tenth of
        the cell at the tip (later in a run: a warning, and the run ends). Warns where it is below
        one cell.

    Notes
    -----
    Cycles between two steps: `cycles_between`, with the rates at both, so a step costs one
    analysis of all load states and the life of ten steps is good to a few tenths of a per cent.
    """
    return steps_of(run_of("grow", problem, law, criterion, cycle, da, options))


def steps_of(run: Run, last: Step | None = None) -> Generator[Step, None, str]:
    """Steps of a run: from the beginning, or those that follow a step."""
    warned = False
    if last is None:
        last, reuse = _next_step(run, run.problem, None, None)
        yield last
    else:
        reuse = memory_of(last).reuse
    while True:
        memory = memory_of(last)
        ended = end_at(run, last)
        plan = _plan(run, last.sif[0], last.rate, last.dK_eq, memory.pending)
        if not ended and plan.largest < LEAST * plan.size:
            ended = too_short(run, last, plan)
            if last.index == 0:
                raise ProblemError(ended)
            warn(ended)
        if ended:
            break
        if plan.largest < plan.size and not warned:
            warned = True
            warn(
                f"the advance {plan.largest:.4g} is below one cell at "
                f"{place_name(run, last, *plan.tip)} (cell size {plan.size:.4g}): K of the next "
                "step feels the kink through one cell only. Take a larger da or a finer mesh "
                "around the tip."
            )
        try:
            cracks = _advanced(run, last)
            problem = _problem(run, cracks, memory)
        except GeometryError as error:
            ended = f"the cracks cannot go on after step {last.index}: {error}"
            break
        gone = _gone(run, cracks, problem.placed)
        if not any(placed.n_tips for placed in problem.placed):
            ended = left_the_body(run, last, gone)
            break
        try:
            last, reuse = _next_step(run, problem, last, reuse)
        except GeometryError as error:
            ended = f"the cracks cannot go on after step {last.index}: {error}"
            break
        except XcrackError as error:
            if not gone:
                raise
            left = left_the_body(run, last, gone)
            ended = f"{left}, and the body cannot be solved without it: {error}"
            break
        yield last
    report_end(run, ended)
    return ended


def _next_step(
    run: Run, problem: Problem, last: Step | None, reuse: Reuse | None
) -> tuple[Step, Reuse]:
    """Solve all load states of a problem and decide where and how fast its cracks grow."""
    before = None if last is None else memory_of(last)
    cracks, mesh, nu = problem.placed, problem.mesh, run.problem.material.nu
    solutions, sif = respond(problem, run, reuse)
    angle, dK_eq, R, law_rates = [], [], [], []
    for c in range(len(cracks)):
        K = np.stack([state[c].K for state in sif])
        direction, dK, ratio = directed(run.criterion, K, nu, c)
        angle.append(direction)
        dK_eq.append(dK)
        R.append(ratio)
        law_rates.append(law_rate(run.law, dK, ratio, c))
    rate = tuple(np.where(d < run.threshold, 0.0, r) for d, r in zip(dK_eq, law_rates))
    length = tuple(following(mesh).crack_size(crack, mesh) for crack in cracks)
    if last is None or before is None:
        n_cycles, index = 0.0, 0
        pending = tuple(np.zeros_like(r) for r in rate)
        settings: Mapping[str, str] = run.settings
        radius = run.problem.numerics.radius
        if radius is None and len(solutions[0].space.radius):
            radius = float(np.min(solutions[0].space.radius))
    else:
        index, settings, radius = last.index + 1, before.settings, before.radius
        since, pending = following(mesh).followed(last, cracks, sif[0], law_rates, length, mesh)
        n_cycles = last.cycles + since
    plan = _plan(run, sif[0], rate, tuple(dK_eq), pending)
    handed_on = solutions[0].reuse
    memory = Memory(
        tuple(law_rates), length, plan.pending, radius, handed_on.without_matrices(), settings
    )
    step = Step(
        index=index,
        cycles=n_cycles,
        cracks=cracks,
        sif=sif,
        angle=tuple(angle),
        dK_eq=tuple(dK_eq),
        R=tuple(R),
        rate=rate,
        da=plan.da,
        solutions=solutions,
        memory=memory,
    )
    report_step(run, step)
    return step, handed_on


def respond(
    problem: Problem, run: Run, reuse: Reuse | None
) -> tuple[tuple[Solution, ...], tuple[tuple[SIF, ...], ...]]:
    """Solutions of all load states, and K of each crack in each of them."""
    solutions = solve_states(problem, run.cycle.load_states, reuse=reuse, solver=run.solver)
    by_crack = [stress_intensities(solutions, c) for c in range(len(problem.cracks))]
    return tuple(solutions), tuple(zip(*by_crack, strict=True))


def _plan(
    run: Run, sif: Sequence[SIF], rate: PerCrack, dK_eq: PerCrack, pending: PerCrack
) -> Advance:
    mesh = run.problem.mesh
    return plan_advance(
        rate,
        dK_eq,
        pending,
        tuple(cell_sizes(mesh, crack_sif.x) for crack_sif in sif),
        da=run.da,
        cycles=run.cycles,
        scaling=run.scaling,
        least=following(mesh).WAITS_BELOW,
    )


def _advanced(run: Run, step: Step) -> list[Crack]:
    """The cracks after the advance of a step."""
    mesh = run.problem.mesh
    return [
        following(mesh).advanced(crack, step.sif[0][c], step.angle[c], step.da[c], mesh)
        for c, crack in enumerate(step.cracks)
    ]


def _problem(run: Run, cracks: Sequence[Crack], memory: Memory) -> Problem:
    """The scene with the cracks of another step, and the radius of the first."""
    numerics = run.problem.numerics
    if memory.radius is not None:
        numerics = replace(numerics, radius=memory.radius)
    return replace(run.problem, cracks=tuple(cracks), numerics=numerics)


def _gone(run: Run, cracks: Sequence[Crack], placed: Sequence[Crack]) -> list[tuple[int, int]]:
    """Tips, or fronts, that have left the body: crack and number."""
    twin = following(run.problem.mesh)
    return [(c, j) for c, pair in enumerate(zip(cracks, placed)) for j in twin.gone(*pair)]


__all__ = ["grow", "respond", "steps_of"]
