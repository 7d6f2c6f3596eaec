"""Tips and fronts that come to the boundary: when, and the step that ends there."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.crack.crack import Crack
from xcrack.growth.follow import following
from xcrack.growth.integrators import integrator_of
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Arrival, Arriving, PerCrack, Step, StepError, memory_of
from xcrack.sif.sif import SIF

_ROUND_OFF = 1e-12  # of the body: a place as near to zero is zero


def arrivals_of(
    run: GrowthRule, last: Step, arriving: Sequence[Arriving], after: float | None
) -> tuple[Arrival, ...]:
    """When places come to the boundary.

    Parameters
    ----------
    run : GrowthRule
    last : Step
        Before the advance.
    arriving : sequence of Arriving
    after : float, optional
        Cycles of the whole advance, where it was solved.
    """
    integrator, mesh = integrator_of(run), run.problem.mesh
    result = []
    for one in arriving:
        N = last.cycles + integrator.cycles_to(run, last, one.share, after)
        x = tuple(0.0 if abs(v) < _ROUND_OFF * mesh.extent else v for v in one.x)
        result.append(Arrival(one.crack, one.tip, x, one.name, one.ligament, N))
    return tuple(result)


def last_step(
    run: GrowthRule,
    last: Step,
    advanced: Sequence[Crack],
    placed: Sequence[Crack],
    arriving: Sequence[Arriving],
) -> Step:
    """The step at which no tip is left: cracks that end on the boundary, without K.

    Its cycles are those of the last tip.
    """
    twin = following(run.problem.mesh)
    arrivals = arrivals_of(run, last, arriving, None)
    cracks = tuple(
        twin.ended(before, after, [one for one in arriving if one.crack == c])
        for c, (before, after) in enumerate(zip(advanced, placed, strict=True))
    )
    none = tuple(np.zeros(0) for _ in cracks)
    cycles = max((arrival.cycles for arrival in arrivals), default=last.cycles)
    return Step(
        index=last.index + 1,
        cycles=cycles,
        cracks=cracks,
        # Two cracks may have become one.
        sif=tuple(tuple(map(_without_places, state[: len(cracks)])) for state in last.sif),
        angle=none,
        dK_eq=none,
        R=none,
        rate=none,
        da=none,
        memory=replace(
            memory_of(last),
            law_rate=none,
            pending=none,
            length=tuple(twin.crack_size(crack, run.problem.mesh) for crack in cracks),
            trail=None,
        ),
        levels=last.levels,
        error=None if last.error is None else _last_error(last.error, cycles - last.cycles, none),
        arrivals=arrivals,
    )


def _last_error(error: StepError, cycles: float, none: PerCrack) -> StepError:
    """Error at the end of a ligament whose cycles no K has been solved for: they count in full."""
    return replace(error, place=none, unknown=error.unknown + cycles)


def _without_places(sif: SIF) -> SIF:
    rows = {
        name: getattr(sif, name)[:0]
        for name in (
            "x", "frame", "K", "T", "spread", "s", "front", "at_surface", "closed", "domain_cells"
        )
    }  # fmt: skip
    return replace(sif, **rows, errors=None, ends=(), widened=None, E_prime=None, nu=None)


__all__ = ["arrivals_of", "last_step"]
