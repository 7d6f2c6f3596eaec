"""Run growth in a folder, or a case file, with table, pictures, files and report in its folder."""

import csv
from itertools import chain, count
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

from xcrack.adaptivity.adapt import adapt
from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve
from xcrack.app.case import CaseFile, read_case
from xcrack.base.arguments import FileName, Switch, check_arguments
from xcrack.base.errors import ProblemError, warn
from xcrack.base.paths import system_errors, written_whole
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import Law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.options import GrowthOptions, lists_options, refuse_unknown_options
from xcrack.growth.run import grow
from xcrack.model.problem import Problem
from xcrack.output.vtk import write
from xcrack.runs.assessment import residual_strength
from xcrack.runs.collect import Until, collect, resume
from xcrack.runs.history import History
from xcrack.runs.inspection import inspection
from xcrack.runs.life import life
from xcrack.runs.retarded import Retarded, retarded
from xcrack.runs.run_folder import STEPS
from xcrack.view.plot import plot
from xcrack.view.report import report


@lists_options
@check_arguments()
def run(
    path: FileName,
    problem: Problem | None = None,
    law: Law | None = None,
    criterion: Criterion | None = None,
    cycle: Cycle | Spectrum | None = None,
    da: float | None = None,
    *,
    resumed: Switch = False,
    overwrite: Switch = False,
    until: Until | None = None,
    keep_solutions: Switch = True,
    **options: Unpack[GrowthOptions],
) -> Any:
    """Run growth in a folder, to its end: begin, or go on with it. Or run a case file.

    With a problem, the same call begins a run, goes on with one that was killed, and reads one that
    has ended. With a case file alone, its folder gets ``report.html`` and ``report.json``,
    files for ParaView and the pictures that the file asks for; a growth run also has its steps
    there, from which it can go on.

    Parameters
    ----------
    path : path
        Folder of the run; or a toml file, as of `read_case`.
    problem, law, criterion, cycle, da : optional
        As of `grow`; left out with a case file.
    resumed : bool
        Of a case file: go on with the steps that are in the folder; where there are none, begin.
    overwrite : bool
        Begin anew although steps are there: they are moved aside.
    until, keep_solutions : optional
        As of `collect`.
    tolerance, max_unknowns : optional
        As of `grow`.
    cycles, scaling, integrator, threshold, retardation, solver, response, load_program, K_c, \
    link_up, stop_at_interface, max_steps, max_cycles, max_size, tolerance, max_unknowns, progress
        As of `grow`.

    Returns
    -------
    History
        Or what a case file asks for: a Solution, or a list of them where it has states.

    Raises
    ------
    ProblemError
        As of `grow`, `collect` and `resume`: the folder holds a run with other settings. Of a case
        file as of `read_case`, `solve`, `grow` and `resume`.
    """
    if problem is not None:
        if resumed:
            raise ProblemError("run: resumed belongs to a case file: a run in a folder goes on.")
        options_of_collect: dict[str, Any] = {"until": until, "keep_solutions": keep_solutions}
        return _run_in(
            path, (problem, law, criterion, cycle, da), options_of_collect, overwrite, options
        )
    refuse_unknown_options("run", options)
    growth_arguments = {
        "law": law,
        "criterion": criterion,
        "cycle": cycle,
        "da": da,
        "until": until,
    }
    surplus = sorted(
        [*options, *(name for name, value in growth_arguments.items() if value is not None)]
    )
    if surplus or keep_solutions is not True:
        raise ProblemError(
            f"run: {', '.join(surplus or ['keep_solutions'])} without a problem: give the problem "
            "too, for a run in a folder, or a case file alone."
        )
    return _run_case(path, is_resumed=resumed, overwrite=overwrite)


def _run_in(
    path: str | PathLike[str],
    scene: tuple[Any, ...],
    options_of_collect: dict[str, Any],
    overwrite: bool,
    options: GrowthOptions,
) -> History:
    """History of the run in a folder: begun, gone on with, or read."""
    problem, law, criterion, cycle, da = scene
    folder = Path(path)
    with system_errors("a folder for the run cannot be made at", folder, error=ProblemError):
        if folder.is_file():
            raise ProblemError(
                f"run: path = {str(folder)!r} is a file: a run needs a folder of its own, and a "
                "case file is given alone."
            )
        has_begun = folder.is_dir() and any(folder.iterdir())
    if overwrite or not has_begun:
        steps = grow(problem, law, criterion, cycle, da, **options)
        return collect(steps, folder, overwrite=overwrite, **options_of_collect)
    return resume(folder, problem, law, criterion, cycle, da, **options_of_collect, **options)


def _run_case(path: str | PathLike[str], *, is_resumed: bool, overwrite: bool) -> Any:
    case = read_case(path)
    with system_errors("results cannot be written to", case.folder, error=ProblemError):
        case.folder.mkdir(parents=True, exist_ok=True)
    result: Any
    if case.growth is None:
        result = solved_case(case)
        solutions = [result] if isinstance(result, Solution) else list(result)
        for k, solution in enumerate(solutions):
            write(solution, case.folder / ("solution" if len(solutions) == 1 else f"state_{k}"))
    else:
        steps = case.folder / STEPS
        result = growth_of_case(case, steps, is_resumed=is_resumed, overwrite=overwrite,
                                keep_solutions=case.keep_solutions)  # fmt: skip
        result.write(case.folder)
        _write_retarded(case, result)
        solutions = list(result.solved[-1].solutions) if result.solved else []
    _draw(case, solutions)
    report(result, case.folder / "report.html", title=case.title, units=case.units,
           **_assessment_of(case, result))  # fmt: skip
    return result


def solved_case(case: CaseFile) -> Solution | list[Solution]:
    """The solution of a case that does not grow, or those of its states."""
    if "tolerance" not in case.solving:
        return solve(case.problem, case.states, **case.solving)
    adaptation = adapt(case.problem, states=case.states, **case.solving)
    if not adaptation.met:
        warn(f"{case.path}: tolerance = {adaptation.tolerance:g} is not met: {adaptation.reason}")
    return list(adaptation.solutions) if case.states is not None else adaptation.solution


def _assessment_of(case: CaseFile, result: Any) -> dict[str, Any]:
    """What the file asks for beside a run: its spectrum, life, inspections and strength."""
    if case.growth is None:
        return {}
    cycle = case.growth["cycle"]
    arguments: dict[str, Any] = {"spectrum": cycle if isinstance(cycle, Spectrum) else None}
    if case.life is not None:
        arguments["life"] = life(result, **case.life)
    if case.inspection is not None:
        arguments["inspection"] = inspection(result, **case.inspection)
    if case.strength is not None:
        arguments["strength"] = residual_strength(result, **case.strength)
    return arguments


def retarded_lives(case: CaseFile, history: History) -> dict[str, Retarded]:
    """Growth along the path of a run with each model of retardation, by what tells them apart."""
    results: dict[str, Retarded] = {}
    for arguments in case.retarded:
        kind = type(arguments["model"]).__name__
        names = chain([kind], (f"{kind}_{k}" for k in count(2)))
        name = next(candidate for candidate in names if candidate not in results)
        results[name] = retarded(history, **arguments)
    return results


def _write_retarded(case: CaseFile, history: History) -> None:
    """A table of lengths and blocks for each model, and why growth ends."""
    lives = retarded_lives(case, history)
    if not lives:
        return
    target = case.folder / "retarded.csv"
    with (
        written_whole(target, "the table cannot be written to", error=ProblemError) as part,
        part.open("w", encoding="utf-8", newline="") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("model", "a", "blocks", "ended"))
        for name, growth in lives.items():
            rows = [[name, a, N, ""] for a, N in zip(growth.a.tolist(), growth.blocks.tolist())]
            rows[-1][-1] = growth.ended or "the last step"
            writer.writerows(rows)


def growth_of_case(
    case: CaseFile,
    folder: Path,
    *,
    is_resumed: bool,
    overwrite: bool = False,
    keep_solutions: bool = True,
    **options: Any,
) -> History:
    """The growth of a case, stored in a folder; gone on with where it has begun there."""
    growth_options = {**(case.growth or {}), **options}
    storage_options: dict[str, Any] = {"until": case.until, "keep_solutions": keep_solutions}
    if is_resumed and _has_begun(folder):
        law, criterion, cycle = (growth_options.pop(name) for name in ("law", "criterion", "cycle"))
        return resume(folder, case.problem, law, criterion, cycle, growth_options.pop("da", None),
                      **storage_options, **growth_options)  # fmt: skip
    steps = grow(case.problem, **growth_options)
    return collect(steps, folder, overwrite=overwrite, **storage_options)


def _has_begun(folder: Path) -> bool:
    with system_errors("a run cannot be read from", folder, error=ProblemError):
        return folder.is_dir() and any(folder.glob("step_*.npz"))


def _draw(case: CaseFile, solutions: list[Solution]) -> None:
    for k, solution in enumerate(solutions):
        for field in case.pictures:
            name = field if len(solutions) == 1 else f"{field}_{k}"
            plot(solution, field, file=case.folder / f"{name}.png", warp=case.warp)


__all__ = ["growth_of_case", "retarded_lives", "run", "solved_case"]
