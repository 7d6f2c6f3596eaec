"""Runs of `adapt` as a line of a chart: the wanted error in, in place of a mesh."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from xcrack.adaptivity.adapt import adapt
from xcrack.adaptivity.adaptation import Adaptation
from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import entries, number
from xcrack.base.errors import ProblemError, XcrackError, collected_warnings
from xcrack.model.problem import Problem
from xcrack.verification.charting.result import ChartRow
from xcrack.verification.charting.settings import smallest
from xcrack.verification.charting.values import Sampled, at_places, sampled

_NAME = "adapt"
_MESH = -1  # number of a mesh that is a run's own
_TOLERANCES = {2: (3e-2, 1e-2, 3e-3, 1e-3), 3: ()}  # in 3D rounds take minutes
_STRONGEST = 1e-6


@dataclass(frozen=True, eq=False)
class ToleranceRun:
    """One tolerance: the result and the median time of it, or why there is none."""

    tolerance: float
    seconds: float = np.nan
    sample: Sampled | None = None
    result: Adaptation | None = None
    warnings: tuple[str, ...] = ()
    failed: str = ""


def chart_tolerances(value: Any, label: str, error: type[XcrackError]) -> tuple[float, ...]:
    """Tolerances of `adapt`, checked, from large to small."""
    arguments = {
        number(one, f"{label}[{k}]", above=0, below=1, error=error)
        for k, one in enumerate(entries(value, label, error=error))
    }
    if not arguments:
        raise error(f"{label} is empty: give numbers between 0 and 1, or leave it out.")
    if min(arguments) < _STRONGEST:
        raise error(f"{label}: {min(arguments):g} is too small: give {_STRONGEST:g} or more.")
    return tuple(sorted(arguments, reverse=True))


def tolerances_to_run(
    tolerances: Sequence[float] | None, problem: Problem, varied: bool
) -> tuple[float, ...]:
    """Tolerances of a chart, from large to small.

    Parameters
    ----------
    tolerances : sequence of float, or None
    problem : Problem
    varied : bool
        Whether settings are those that a chart takes by itself.

    Raises
    ------
    ProblemError
        There is no K to adapt to.
    """
    tips = any(crack.n_tips for crack in problem.placed)
    if tolerances is None:
        return _TOLERANCES[problem.mesh.dim] if varied and tips else ()
    if not tips:
        raise ProblemError("chart: tolerances are those of K, and no crack has a tip in the body.")
    return tuple(tolerances)


def adapted_runs(
    problem: Problem,
    tolerances: Sequence[float],
    states: Sequence[Any] | None,
    quantity: Callable[[Any], Sampled] | None,
    repeat: int,
    say: Callable[[str], None],
) -> list[ToleranceRun]:
    """Each tolerance, so many times, from the mesh of the problem."""
    result = []
    for tolerance in tolerances:
        say(f"adapt to {tolerance:g}, {repeat} times")
        times: list[float] = []
        run = _run(problem, tolerance, states, quantity)  # without a clock: kernels compile
        while not run.failed and len(times) < repeat:
            run = _run(problem, tolerance, states, quantity)
            times.append(run.seconds)
        result.append(replace(run, seconds=float(np.median(times)) if times else np.nan))
    return result


def _run(
    problem: Problem,
    tolerance: float,
    states: Sequence[Any] | None,
    quantity: Callable[[Any], Sampled] | None,
) -> ToleranceRun:
    messages: list[str] = []
    start = perf_counter()
    try:
        with collected_warnings(messages):
            result = adapt(problem, tolerance, states, progress=False)
            if quantity is None:
                sample = sampled(result.sifs, best=True)
            else:
                sample = quantity(result.solution if states is None else list(result.solutions))
    except (XcrackError, np.linalg.LinAlgError, MemoryError) as error:
        return ToleranceRun(tolerance, failed=f"{type(error).__name__}: {error}")
    seconds = perf_counter() - start
    if not np.isfinite(sample.values).all():
        return ToleranceRun(tolerance, failed="the quantity is not finite", result=result)
    if not result.met:
        messages.append(f"the tolerance is not met: {result.reason}")
    return ToleranceRun(tolerance, seconds, sample, result, tuple(dict.fromkeys(messages)))


def row_of(run: ToleranceRun, places: Sampled, reference: Floats, scale: float) -> ChartRow:
    """A run of `adapt` against the reference."""
    values, message = np.zeros(0), run.failed
    if run.sample is not None:
        try:
            values = lock(at_places(run.sample, places))
        except ProblemError as error:
            message = str(error)
    last = None if run.result is None else run.result.problem
    return ChartRow(
        setting=_NAME,
        fields={"tolerance": run.tolerance},
        mesh=_MESH,
        size=np.nan if last is None else smallest(last.mesh),
        unknowns=0 if run.result is None else run.result.rounds[-1].unknowns,
        seconds=run.seconds,
        error=np.nan if message else float(np.linalg.norm(values - reference)) / scale,
        values=values,
        warnings=run.warnings,
        failed=message,
        problem=last,
    )


__all__ = ["ToleranceRun", "adapted_runs", "chart_tolerances", "row_of", "tolerances_to_run"]
