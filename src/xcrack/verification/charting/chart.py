"""How accurate, how fast: a scene over some settings and meshes, compared with the best of them."""

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Annotated, Any, cast

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve
from xcrack.base.arguments import (
    CheckedBy,
    FileName,
    Function,
    Items,
    Number,
    Progress,
    Whole,
    check_arguments,
)
from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import call_function
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.model.problem import Problem, ProblemArgument
from xcrack.verification.charting.adapted import (
    ToleranceRun,
    adapted_runs,
    chart_tolerances,
    row_of,
    tolerances_to_run,
)
from xcrack.verification.charting.result import Chart, ChartRow, WantedError
from xcrack.verification.charting.settings import (
    IN_PROBLEM,
    Named,
    checked_meshes,
    default_settings,
    make_mesh,
    mean_size,
    named_settings,
    smallest,
    with_lengths,
)
from xcrack.verification.charting.values import (
    K_of_all,
    Sampled,
    at_places,
    most_trusted,
    sampled_numbers,
)

Settings = Sequence[Mapping[str, Any]] | Mapping[str, Mapping[str, Any]]
Meshes = Sequence[Mesh] | Callable[[float], Mesh]
Quantity = Callable[[Any], Any]

_MOST_MESHES = 4
# Unknowns of the finest mesh by dimension: 1.7 GB of a factor in 2D, of multigrid in 3D.
_MOST_UNKNOWNS = {2: 200_000, 3: 300_000}
# Time on a mesh over that on the one before it, where it has not been seen yet.
_DEARER = {2: 5.0, 3: 10.0}


@check_arguments()
def chart(
    problem: ProblemArgument,
    settings: Annotated[Settings | None, CheckedBy(named_settings)] = None,
    *,
    meshes: Meshes | None = None,
    states: Annotated[Sequence[Any] | None, Items()] = None,
    quantity: Annotated[Quantity | None, Function("a function of the solution")] = None,
    tolerances: Annotated[Sequence[float] | None, CheckedBy(chart_tolerances)] = None,
    wanted: WantedError = None,
    repeat: Annotated[int, Whole(least=1, most=1000)] = 3,
    seconds: Annotated[float, Number(above=0)] = 60.0,
    file: FileName | None = None,
    progress: Annotated[bool | str, Progress()] = True,
) -> Chart:
    """Run a scene over some settings and meshes, and chart its error against its time.

    The reference is the run on the finest mesh that is trusted most: its own error is estimated
    from the differences between the last meshes, and no run counts as better than that. Times are
    medians of runs that take turns, after one that compiles kernels and prepares the mesh.

    Parameters
    ----------
    problem : Problem
        On the coarsest mesh that is of interest.
    settings : sequence of mappings, or mapping of name to mapping, optional
        Each changes fields of Problem (order, contact) or Numerics: ``[{"order": 1}, {"radius":
        0.2}]``. The settings of the problem are always among them. Left out: other order (in the
        plane), radius × 0.7 and × 1.4, topological enrichment, another domain, two functions.
    meshes : sequence of Mesh, or callable, optional
        From coarse to fine, at least two; or a function of the size of the smallest cell, which
        is called with that of the problem's mesh, its half, quarter... Left out: the mesh of the
        problem and what `xcrack.mesh.refinement.refine` makes of it, at most three times. A polygon
        stays one then, and its error is not seen, unless the mesh knows its curve.
    states : sequence, optional
        Load states, as for `solve`.
    quantity : callable, optional
        ``quantity(solution) -> number or array``, given the list of solutions where there are
        states. Left out: K of all cracks; the strain energy where there are no tips.
    tolerances : sequence of float, optional
        Runs of `adapt` from the mesh of the problem, of which all rounds count as time, with its
        best K. Left out: 3e-2 to 1e-3 in 2D where settings are left out too, none in 3D.
    wanted : float, optional
        Relative error for which the cheapest run is named and marked.
    repeat : int
        Timed runs of each setting on each mesh.
    seconds : float
        About how long all may take where the meshes are left to the function; there are two
        meshes at least, and no more than memory is likely to hold.
    file : path, optional
        Where to draw the chart.
    progress : bool or "always"
        Tell what runs, on a terminal or always.

    Returns
    -------
    Chart
        ``print`` shows the table and the advice, ``.best(wanted).problem`` is the scene with the
        cheapest settings, ``.plot()`` draws it.

    Raises
    ------
    ProblemError
        Settings, meshes or numbers that cannot be used, or no runs that can be compared. A run
        that fails is kept with its reason.

    Examples
    --------
    >>> import xcrack as xc
    >>> pull = [xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))]
    >>> scene = xc.Problem(
    ...     xc.box((0, -1), (1, 1), (6, 12)), xc.Isotropic(1.0, 0.3, "strain"), loads=pull
    ... )
    >>> chart = xc.chart(scene, [{"order": 1}], repeat=1, seconds=0.1)
    >>> sorted({row.setting for row in chart.rows})
    ['as given', 'order 1']
    """
    settings_by_name = cast(Named, settings) if settings is not None else default_settings(problem)
    for state in states or ():
        problem.state(state)
    aims = tolerances_to_run(tolerances, problem, settings is None)
    runs = _Runs(problem, settings_by_name, states, quantity, progress)
    every = _meshes(runs, meshes, repeat, seconds)
    outcomes = _timed(runs, every, repeat)
    user_quantity = None if quantity is None else partial(_of_user, quantity)
    others = adapted_runs(problem, aims, states, user_quantity, repeat, runs.say)
    result = _compared(runs, every, outcomes, others, wanted, repeat)
    if file is not None:
        result.plot(file)
    return result


@dataclass(frozen=True, eq=False)
class _Runs:
    """What is asked of every run."""

    problem: Problem
    named: dict[str, dict[str, Any]]
    states: Sequence[Any] | None
    quantity: Quantity | None
    progress: bool | str

    @property
    def has_tips(self) -> bool:
        return any(crack.n_tips for crack in self.problem.placed)

    def say(self, words: str) -> None:
        if self.progress == "always" or (self.progress and sys.stderr.isatty()):
            print(words, file=sys.stderr)


@dataclass(frozen=True, eq=False)
class _Outcome:
    """Result of one run; `failed` states why there is none."""

    fields: dict[str, Any]
    seconds: float = np.nan
    sample: Sampled | None = None
    unknowns: int = 0
    radius: float | None = None
    warnings: tuple[str, ...] = ()
    failed: str = ""
    problem: Problem | None = None


def _run(runs: _Runs, mesh: Mesh, changes: dict[str, Any]) -> _Outcome:
    scene: Problem | None = None
    with warnings.catch_warnings(record=True) as messages:
        warnings.simplefilter("always")
        start = perf_counter()
        try:
            scene = _varied(runs.problem, mesh, changes)
            result = solve(scene, runs.states)
            solutions: list[Solution] = [result] if runs.states is None else result
            if runs.quantity is None:
                values = K_of_all(solutions) if runs.has_tips else _energies(solutions)
        except (XcrackError, np.linalg.LinAlgError, MemoryError) as error:
            return _failure_outcome(changes, scene, error)
        try:  # of the user's function no exception but ours is a run that failed
            sample = values if runs.quantity is None else _of_user(runs.quantity, result)
        except XcrackError as error:
            return _failure_outcome(changes, scene, error)
        seconds = perf_counter() - start
    if not np.isfinite(sample.values).all():
        return _Outcome(changes, failed="the quantity is not finite", problem=scene)
    radii = [tip.radius for tip in solutions[0].space.tips if np.isfinite(tip.radius)]
    return _Outcome(
        changes,
        seconds,
        sample,
        solutions[0].n_dof,
        min(radii, default=None),
        tuple(dict.fromkeys(str(one.message) for one in messages)),
        problem=scene,
    )


def _failure_outcome(
    changes: dict[str, Any], scene: Problem | None, error: BaseException
) -> _Outcome:
    return _Outcome(changes, failed=f"{type(error).__name__}: {error}", problem=scene)


def _energies(solutions: Sequence[Solution]) -> Sampled:
    return sampled_numbers([solution.energy for solution in solutions])


def _of_user(quantity: Quantity, result: Any) -> Sampled:
    return sampled_numbers(call_function(quantity, "the quantity of chart", result))


def _varied(problem: Problem, mesh: Mesh, changes: dict[str, Any]) -> Problem:
    of_problem = {name: value for name, value in changes.items() if name in IN_PROBLEM}
    method = {name: value for name, value in changes.items() if name not in IN_PROBLEM}
    return replace(problem, mesh=mesh, numerics=replace(problem.numerics, **method), **of_problem)


def _meshes(runs: _Runs, meshes: Meshes | None, repeat: int, seconds: float) -> list[Mesh]:
    """All meshes; where they are made here, as many as time and memory are likely to allow."""
    if meshes is not None and not callable(meshes):
        return checked_meshes(runs.problem, meshes)
    first = runs.problem.mesh
    size = smallest(first)
    every = [first if meshes is None else make_mesh(meshes, size)]
    _run(runs, every[0], {})  # compiles kernels: its time says nothing about finer meshes
    spent, base_seconds = 0.0, None
    while len(every) < _MOST_MESHES:
        base = _run(runs, every[-1], {})
        d = first.dim
        growth = _DEARER[d] if not base_seconds else max(base.seconds / base_seconds, 2.0)
        spent += base.seconds
        base_seconds = base.seconds
        if len(every) > 1:
            total = (spent + growth * base.seconds) * len(runs.named) * (repeat + 0.5)
            if base.failed or total > seconds or base.unknowns * 2**d > _MOST_UNKNOWNS[d]:
                break
        every.append(
            refine(every[-1]) if meshes is None else make_mesh(meshes, size / 2 ** len(every))
        )
    runs.say(f"{len(every)} meshes, {len(runs.named)} settings, {repeat} timed runs of each")
    return every


def _timed(
    runs: _Runs, every: list[Mesh], repeat: int
) -> dict[tuple[int, int], tuple[_Outcome, float]]:
    """Outcome and median time of each setting on each mesh."""
    first: dict[tuple[int, int], _Outcome] = {}
    times: dict[tuple[int, int], list[float]] = {}
    for k, mesh in enumerate(every):
        base = _run(runs, mesh, {})
        for s, (name, changes) in enumerate(runs.named.items()):
            resolved_changes, message = with_lengths(changes, base.radius)
            if message:
                first[k, s] = _Outcome(resolved_changes, failed=message)
            elif k == 0:  # once without a clock: another setting may need another kernel
                first[k, s] = _run(runs, mesh, resolved_changes)
            else:
                first[k, s] = _Outcome(resolved_changes)
            if first[k, s].failed:
                runs.say(f"mesh {k}, {name!r} failed: {first[k, s].failed}")
    for turn in range(repeat):
        for k, mesh in enumerate(every):
            runs.say(f"turn {turn + 1} of {repeat}, mesh {k}: {len(mesh.cells)} cells")
            for s in range(len(runs.named)):
                if not first[k, s].failed:
                    outcome = first[k, s] = _run(runs, mesh, first[k, s].fields)
                    if not outcome.failed:
                        times.setdefault((k, s), []).append(outcome.seconds)
    return {
        key: (outcome, float(np.median(times[key])) if key in times else np.nan)
        for key, outcome in first.items()
    }


def _compared(
    runs: _Runs,
    every: list[Mesh],
    outcomes: dict[tuple[int, int], tuple[_Outcome, float]],
    others: Sequence[ToleranceRun],
    wanted: float | None,
    repeat: int,
) -> Chart:
    """Errors of all runs against the one that is trusted most."""
    places = _places(outcomes)
    values: dict[tuple[int, int], Floats] = {}
    failures: dict[tuple[int, int], str] = {}
    for key, (outcome, _) in outcomes.items():
        if outcome.failed or outcome.sample is None or places is None:
            failures[key] = outcome.failed
            continue
        try:
            values[key] = lock(at_places(outcome.sample, places))
        except ProblemError as error:
            failures[key] = str(error)
    # Without contact, say, it is another scene, which converges to other values.
    other = [s for s, changes in enumerate(runs.named.values()) if "contact" in changes]
    try:
        best, remainder = most_trusted(values, [mean_size(mesh) for mesh in every], other)
    except ProblemError as error:
        reasons = "; ".join(dict.fromkeys(failures.values()))
        raise ProblemError(f"{error} {reasons}".strip()) from error
    scale = float(np.linalg.norm(values[best]))
    if scale == 0:
        raise ProblemError(
            "the quantity is zero in the reference, so that errors have no measure: give another "
            "one, such as quantity=lambda solution: solution.energy."
        )
    names = list(runs.named)
    rows = {
        (k, s): ChartRow(
            setting=names[s],
            fields=outcome.fields,
            mesh=k,
            size=smallest(every[k]),
            unknowns=outcome.unknowns,
            seconds=time,
            error=float(np.linalg.norm(values[k, s] - values[best])) / scale
            if (k, s) in values
            else np.nan,
            values=values.get((k, s), np.zeros(0)),
            warnings=outcome.warnings,
            failed=failures.get((k, s), ""),
            problem=outcome.problem,
        )
        for (k, s), (outcome, time) in outcomes.items()
    }
    assert places is not None
    adapted = [row_of(run, places, values[best], scale) for run in others]
    label = "quantity" if runs.quantity is not None else "K" if runs.has_tips else "strain energy"
    every_row = (*rows.values(), *adapted)
    return Chart(every_row, rows[best], max(remainder / scale, 1e-15), label, wanted, repeat)


def _places(outcomes: dict[tuple[int, int], tuple[_Outcome, float]]) -> Sampled | None:
    """Where all are compared: the places of the first run that succeeded on the finest mesh."""
    keys = sorted(outcomes, key=lambda key: (-key[0], key[1]))
    return next((outcomes[k][0].sample for k in keys if outcomes[k][0].sample is not None), None)


__all__ = ["chart"]
