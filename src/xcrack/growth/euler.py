"""Growth of first order: each step goes on with the directions and rates at its beginning."""

import numpy as np

from xcrack.crack.crack import Crack
from xcrack.growth.follow import following
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled
from xcrack.growth.step import Advance, PerCrack, Step, StepError, memory_of, plan_advance
from xcrack.mesh.locate import cell_sizes


def begun(run: GrowthRule, seen: Evaluation) -> Settled:
    """The first step of a run."""
    return begun_at(run, seen, 0.0)


def begun_at(
    run: GrowthRule, seen: Evaluation, cycles: float, error: StepError | None = None
) -> Settled:
    """A step before which there is nothing to follow."""
    del error
    return _settled(run, seen, cycles, tuple(np.zeros_like(r) for r in seen.rate))


def settled(run: GrowthRule, last: Step, seen: Evaluation) -> Settled:
    """What the cracks after an advance mean for the cycles and for the next advance."""
    mesh = seen.problem.mesh
    since, pending = following(mesh).followed(
        last, seen.cracks, seen.sif[0], seen.law_rate, seen.length, mesh
    )
    return _settled(run, seen, last.cycles + since, pending)


def planned(run: GrowthRule, step: Step) -> Advance:
    """The advance after a step."""
    sizes = tuple(cell_sizes(run.problem.mesh, sif.x) for sif in step.sif[0])
    return _plan(run, sizes, step.rate, step.dK_eq, memory_of(step).pending)


def advanced(run: GrowthRule, step: Step, share: float = 1.0) -> list[Crack]:
    """The cracks after the advance of a step, or after a share of it."""
    mesh = run.problem.mesh
    moved = [
        following(mesh).advanced(crack, step.sif[0][c], step.angle[c], share * step.da[c], mesh)
        for c, crack in enumerate(step.cracks)
    ]
    return moved if run.link_up is not None else following(mesh).met(moved, step.da, mesh)


def cycles_to(run: GrowthRule, step: Step, share: float, after: float | None) -> float:
    """Cycles of a share of the advance after a step, in proportion to it."""
    if after is not None:
        return share * after
    plan = planned(run, step)
    c, j = plan.tip
    return share * plan.largest / float(step.rate[c][j])


def _settled(run: GrowthRule, seen: Evaluation, cycles: float, pending: PerCrack) -> Settled:
    sizes = tuple(cell_sizes(seen.problem.mesh, sif.x) for sif in seen.sif[0])
    plan = _plan(run, sizes, seen.rate, seen.dK_eq, pending)
    return Settled(cycles, seen.cracks, plan.da, plan.pending)


def _plan(
    run: GrowthRule, sizes: PerCrack, rate: PerCrack, dK_eq: PerCrack, pending: PerCrack
) -> Advance:
    return plan_advance(
        rate,
        dK_eq,
        pending,
        sizes,
        da=run.da,
        cycles=run.cycles,
        scaling=run.scaling,
        least=following(run.problem.mesh).WAITS_BELOW,
    )


__all__ = ["advanced", "begun", "cycles_to", "planned", "settled"]
