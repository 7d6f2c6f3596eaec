"""Fatigue crack growth: one step after the other, from load states to cycles."""

import sys
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.crack import Crack, advance
from xcrack.errors import GeometryError, ProblemError, XcrackError, warn
from xcrack.growth.advance import (
    LEAST,
    Advance,
    PerCrack,
    cell_sizes,
    plan_advance,
)
from xcrack.growth.checks import directed, law_rate
from xcrack.growth.criteria import Criterion, clipped, equivalent_K
from xcrack.growth.fingerprint import DEFAULTS, describe, with_defaults_of
from xcrack.growth.follow import crack_sizes, followed, memory_of
from xcrack.growth.laws import Law
from xcrack.growth.step import Cycle, Memory, Step
from xcrack.scene.problem import Problem
from xcrack.sif.interaction_2d import stress_intensities
from xcrack.sif.sif import SIF
from xcrack.solvers.reuse import Reuse

_SPACING = 0.5  # of a cell, between the points of a new front in space
_LEAST_IN_SPACE = 0.02  # of a cell: neighbours along a front move on, so a slow part has to follow


_STOPS = {"changes_results": False}  # when a run stops, not how its cracks grow


@dataclass(frozen=True, eq=False)
class Run:
    """All that `grow` was asked for, checked."""

    problem: Problem
    law: Law
    criterion: Criterion
    cycle: Cycle
    da: float | None = None
    cycles: float | None = None
    scaling: str = "law"
    threshold: float = 0.0
    solver: Any = None
    K_c: float | None = field(default=None, metadata=_STOPS)
    max_steps: int | None = field(default=None, metadata=_STOPS)
    max_cycles: float | None = field(default=None, metadata=_STOPS)
    progress: bool | str = field(default=True, metadata=_STOPS)
    defaults: int = field(default=DEFAULTS, metadata=_STOPS)

    def __post_init__(self) -> None:
        if self.da is None and self.cycles is None:
            raise ProblemError("grow needs da (largest advance a step) or cycles (cycles a step).")
        for name in ("da", "cycles", "K_c", "max_cycles"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ProblemError(f"grow: {name} = {value} must be positive and finite.")
        if self.max_steps is not None and self.max_steps < 1:
            raise ProblemError(f"grow: max_steps = {self.max_steps} must be at least 1.")
        if not (np.isfinite(self.threshold) and self.threshold >= 0):
            raise ProblemError(f"grow: threshold = {self.threshold} must not be negative.")
        if self.scaling not in ("law", "linear"):
            raise ProblemError(f'grow: scaling = {self.scaling!r}: give "law" or "linear".')
        for name in ("law", "criterion"):
            if not callable(getattr(self, name)):
                raise ProblemError(f"grow: {name} = {getattr(self, name)!r} cannot be called.")
        if not isinstance(self.cycle, Cycle):
            raise ProblemError(f"grow: cycle = {self.cycle!r}: give Cycle(min, max).")
        if not self.problem.cracks:
            raise ProblemError("grow: the problem has no crack; growth does not start one.")

    @property
    def settings(self) -> dict[str, str]:
        """Text of all that decides how the cracks grow; rules that stop a run are not in it."""
        return {"defaults": str(self.defaults), **describe("", self, self.defaults)}

    def as_begun(self, stored: Mapping[str, str]) -> "Run":
        """The run with the defaults of a stored one, where it leaves a choice to them."""
        number = int(stored["defaults"])
        return replace(with_defaults_of(self, number, stored), defaults=number)


def grow(
    problem: Problem,
    law: Law,
    criterion: Criterion,
    cycle: Cycle,
    da: float | None = None,
    *,
    cycles: float | None = None,
    scaling: str = "law",
    threshold: float = 0.0,
    K_c: float | None = None,
    max_steps: int | None = None,
    max_cycles: float | None = None,
    solver: Any = None,
    progress: bool | str = True,
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
    run = Run(
        problem, law, criterion, cycle, da, cycles, scaling, threshold, solver, K_c, max_steps,
        max_cycles, progress,
    )  # fmt: skip
    return steps_of(run)


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
        ended = _stop(run, last)
        plan = _plan(run, last.sif[0], last.rate, last.dK_eq, memory.pending)
        if not ended and plan.largest < LEAST * plan.size:
            if last.index == 0:
                raise ProblemError(_too_short(last, plan, run))
            ended = _too_short(last, plan, run)
            warn(ended)
        if ended:
            return _said(run, ended)
        if plan.largest < plan.size and not warned:
            warned = True
            warn(
                f"the advance {plan.largest:.4g} is below one cell at {_where(last, plan.tip)} "
                f"(cell size {plan.size:.4g}): K of the next step feels the kink through one cell "
                "only. Take a larger da or a finer mesh around the tip."
            )
        try:
            moved = [_advanced(run, last, c) for c in range(len(last.cracks))]
            problem = _problem(run, moved, memory)
        except GeometryError as error:
            return _said(run, f"the cracks cannot go on after step {last.index}: {error}")
        gone = _gone(moved, problem.placed)
        left = _left(last, gone)
        if not any(placed.n_tips for placed in problem.placed):
            return _said(run, left)
        try:
            last, reuse = _next_step(run, problem, last, reuse)
        except GeometryError as error:
            return _said(run, f"the cracks cannot go on after step {last.index}: {error}")
        except XcrackError as error:
            if not gone:
                raise
            return _said(run, f"{left}, and the body cannot be solved without it: {error}")
        yield last


def _next_step(
    run: Run,
    problem: Problem,
    last: Step | None,
    reuse: Reuse | None,
) -> tuple[Step, Reuse]:
    """Solve all load states of a problem and decide where and how fast its cracks grow."""
    before = None if last is None else memory_of(last)
    cracks = problem.placed
    solutions, sif = respond(problem, run, reuse)
    nu = run.problem.material.nu
    angle, dK_eq, R, law_rates = [], [], [], []
    for c in range(len(cracks)):
        K = np.stack([state[c].K for state in sif])
        direction, dK, ratio = directed(run.criterion, K, nu, c)
        angle.append(direction)
        dK_eq.append(dK)
        R.append(ratio)
        law_rates.append(law_rate(run.law, dK, ratio, c))
    rate = tuple(np.where(d < run.threshold, 0.0, r) for d, r in zip(dK_eq, law_rates))
    length = crack_sizes(cracks, problem.mesh)
    if last is None or before is None:
        n_cycles, index = 0.0, 0
        pending = tuple(np.zeros_like(r) for r in rate)
        settings: Mapping[str, str] = run.settings
        radius = run.problem.numerics.radius
        if radius is None and len(solutions[0].space.radius):
            radius = float(np.min(solutions[0].space.radius))
    else:
        index, settings, radius = last.index + 1, before.settings, before.radius
        since, pending = followed(last, cracks, sif[0], law_rates, length, problem.mesh)
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
    _report(run, step)
    return step, handed_on


def _problem(run: Run, cracks: Sequence[Crack], memory: Memory) -> Problem:
    """The scene with the cracks of another step, and the radius of the first."""
    numerics = run.problem.numerics
    if memory.radius is not None:
        numerics = replace(numerics, radius=memory.radius)
    return replace(run.problem, cracks=tuple(cracks), numerics=numerics)


def _advanced(run: Run, step: Step, c: int) -> Crack:
    """Crack c after the advance of a step."""
    crack = step.cracks[c]
    if crack.dim == 2:
        return advance(crack, step.angle[c], step.da[c])
    found = step.sif[0][c]
    if not len(found.s):
        return crack
    size = _SPACING * float(cell_sizes(run.problem.mesh, found.x).mean())
    return advance_fronts(crack, found.s, found.front, step.angle[c], step.da[c], size)


def _gone(moved: Sequence[Crack], placed: Sequence[Crack]) -> list[tuple[int, int]]:
    """Tips that have left the body: crack and number. A front counts when all of it has."""
    gone: list[tuple[int, int]] = []
    for c, (m, p) in enumerate(zip(moved, placed)):
        if m.dim == 2:
            gone.extend((c, j) for j, tip in enumerate(m.tips or ()) if tip not in (p.tips or ()))
        elif m.n_tips and not p.n_tips:
            gone.append((c, 0))
    return gone


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
    size = tuple(cell_sizes(run.problem.mesh, found.x) for found in sif)
    return plan_advance(
        rate,
        dK_eq,
        pending,
        size,
        da=run.da,
        cycles=run.cycles,
        scaling=run.scaling,
        least=LEAST if run.problem.mesh.dim == 2 else _LEAST_IN_SPACE,
    )


def _stop(run: Run, step: Step) -> str:
    """Why growth ends at this step; empty where it goes on."""
    if run.K_c is not None:
        for c in range(len(step.cracks)):
            K = clipped(np.stack([state[c].K for state in step.sif]))
            K_eq = equivalent_K(K, step.angle[c], run.problem.material.nu).max(axis=0)
            for j in np.nonzero(K_eq >= run.K_c)[0].tolist():
                return (
                    f"K_c reached: K_eq = {K_eq[j]:.6g} >= {run.K_c:.6g} at {_where(step, (c, j))}"
                )
    if run.max_cycles is not None and step.cycles >= run.max_cycles:
        return f"max_cycles = {run.max_cycles:.6g} reached: {step.cycles:.6g} cycles"
    if run.max_steps is not None and step.index + 1 >= run.max_steps:
        return f"max_steps = {run.max_steps} reached"
    if not any((r > 0).any() for r in step.rate):
        if any((r > 0).any() for r in memory_of(step).law_rate):
            return f"rate is zero: dK_eq is below the threshold {run.threshold:.6g} at every tip"
        return "rate is zero at every tip"
    return ""


def _too_short(step: Step, plan: Advance, run: Run) -> str:
    remedy = "cycles" if run.da is None else "da"
    return (
        f"the advance {plan.largest:.4g} at {_where(step, plan.tip)} is below a tenth of the cell "
        f"there (cell size {plan.size:.4g}): the mesh cannot see it. Take a larger {remedy} or a "
        "finer mesh around the tip."
    )


def _left(step: Step, gone: list[tuple[int, int]]) -> str:
    if any(step.cracks[c].dim == 3 for c, _ in gone):
        return "front left the body: crack " + ", ".join(str(c) for c, _ in gone)
    return "tip left the body: " + "; ".join(_where(step, tip) for tip in gone)


def _where(step: Step, tip: tuple[int, int]) -> str:
    c, j = tip
    x = ", ".join(f"{v:.6g}" for v in step.sif[0][c].x[j])
    what = "tip" if step.cracks[c].dim == 2 else "front place"
    return f"crack {c}, {what} {j} at ({x})"


def _report(run: Run, step: Step) -> None:
    if not (run.progress == "always" or (run.progress and sys.stderr.isatty())):
        return
    largest = max((float(d.max(initial=0.0)) for d in step.dK_eq), default=0.0)
    da = max((float(d.max(initial=0.0)) for d in step.da), default=0.0)
    print(
        f"step {step.index:4d}  N {step.cycles:12.6g}  largest dK_eq {largest:10.5g}  "
        f"da {da:9.4g}  {'tips' if step.cracks[0].dim == 2 else 'front places'} {step.n_tips}",
        file=sys.stderr,
    )


def _said(run: Run, ended: str) -> str:
    if run.progress == "always" or (run.progress and sys.stderr.isatty()):
        print(f"growth ended: {ended}", file=sys.stderr)
    return ended


__all__ = ["Cycle", "Run", "Step", "grow", "steps_of"]
