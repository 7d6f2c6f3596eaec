"""When a step asks for a finer mesh than it was computed on, and is computed again on that."""

from dataclasses import replace
from typing import Any

import numpy as np

from xcrack.growth.integration.controlled import PATH, can_be_shortened, shortened
from xcrack.growth.rates.uncertainty import TOGETHER
from xcrack.growth.steps.controller import REJECTED, next_length
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Step, memory_of
from xcrack.growth.tolerance.prepared import SHARE, Steps, finer, on
from xcrack.mesh.locate import cell_sizes

_MOST = 4  # meshes that a run makes: behind that it goes on, and its bars say how well
_FORGIVEN = 3.0  # times the share of K: bars along the way were foretold, not measured

_SETTLED = 4  # steps: before, bars are wide behind a kink whose face is short, on any mesh
_SIZE = 0.5  # of a crack: of less growth than that a path may err by a share of as much
_HALF, _WHOLE = 0.5, 0.8  # of the tolerance, by all sources: below that no finer mesh is worth it
_BEGIN = 1.5  # times the share of K at the first step: bars of a crack that grows become shorter


def again(
    asked: Run, run: Run, steps_of: Steps, last: Step | None, step: Step
) -> tuple[Run, Step | None] | None:
    """The run and the step from which one is to be computed again; None where that is good.

    It follows from what is stored with the step before: a run that is taken up again does the same.

    Parameters
    ----------
    asked : Run
        On the mesh as it was given.
    run : Run
        On the one of the step.
    steps_of : callable
        What makes the steps of a run.
    last : Step or None
        The one before, which is handed over.
    step : Step
    """
    if _outgrown(run, last, step):
        mesh, is_largest = finer(asked, steps_of, last)
        other = replace(on(run, mesh), meshes=_MOST if is_largest else run.meshes + 1)
        return other, last if last is None else _with_room(run, other, last, step)
    if last is None:
        return None
    shorter = shortened(last, step)
    return None if shorter is None else (run, shorter)


def _outgrown(run: Run, last: Step | None, step: Step) -> bool:
    """Whether the bars of K are too wide on the mesh of a step, or its cells too long."""
    error = step.error
    if not run.estimates or error is None or not step.n_tips or run.meshes >= _MOST:
        return False
    before = 0 if last is None else memory_of(last).meshes
    if run.meshes > before or (run.meshes and step.index < _SETTLED):
        return False  # it was made for this step, or for a kink just behind it
    tolerance = float(run.tolerance or 0.0)
    forgiven = 1.0 if run.meshes == 0 else _FORGIVEN
    rate, turn = _local(run, step)
    before_it = (np.inf, np.inf) if run.meshes == 0 or last is None else _local(run, last)
    rate, turn = min(rate, before_it[0]), min(turn, before_it[1])
    of_life, of_path = SHARE * tolerance, (1 - PATH) * tolerance
    if last is None:
        return rate > _BEGIN * of_life or turn > _BEGIN * of_path
    cycles, way = step.cycles, max(error.grown, _SIZE * min(memory_of(step).length, default=0.0))
    if not (cycles > 0 and way > 0):
        return False
    whole = (_WHOLE if run.meshes else _HALF) * tolerance
    short_of_life = (error.K + error.contact + error.unknown) / cycles > of_life
    short_of_path = error.K_place / way > of_path
    return bool(
        (rate > forgiven * of_life and short_of_life and error.life / cycles > whole)
        or (turn > forgiven * of_path and short_of_path and error.path / way > whole)
        or (run.meshes == 0 and _has_no_room(last, step))
    )


def _local(run: Run, step: Step) -> tuple[float, float]:
    """Errors of rate and direction at a step by K, as they count for life and path."""
    error = step.error
    # No bar: a finer mesh may have one, but once.
    unknown = 1.0 if run.meshes == 0 else 0.0
    if error is None or np.isnan(error.rate):
        return unknown, unknown
    return TOGETHER * error.rate, error.turn


def _has_no_room(last: Step, step: Step) -> bool:
    """Whether a step is too long, and the cells leave no room for a shorter one."""
    control = memory_of(step).trail
    error = None if control is None else control.control.error
    return error is not None and error > REJECTED and not can_be_shortened(last)


def _with_room(run: Run, other: Run, last: Step, step: Step) -> Step:
    """The step before, with the way ahead that a finer mesh allows."""
    trail: Any = memory_of(last).trail
    own: Any = memory_of(step).trail
    places = np.concatenate([sif.x for sif in step.sif[0]])
    sizes = [cell_sizes(each.problem.mesh, places) for each in (run, other)]
    control = trail.control
    least = control.least * min(float(np.median(sizes[1] / sizes[0])), 1.0)
    length = control.length
    if own.control.error is not None and own.control.error > REJECTED:
        length = next_length(length, own.control.error, None, least)
    control = replace(control, length=length, least=least)
    return replace(last, memory=replace(memory_of(last), trail=replace(trail, control=control)))


__all__ = ["again"]
