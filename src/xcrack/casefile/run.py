"""Run a case file: solve or grow, and leave table, pictures, files and report in its folder."""

from os import PathLike
from pathlib import Path
from typing import Any

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve
from xcrack.casefile.case import CaseFile, read_case
from xcrack.errors import ProblemError
from xcrack.growth.run import grow
from xcrack.history.collect import collect, resume
from xcrack.history.history import History
from xcrack.inputs import flag
from xcrack.paths import system_errors
from xcrack.plotting.plot import plot
from xcrack.post.vtk import write
from xcrack.reporting.report import report

_STEPS = "steps"


def run(path: str | PathLike[str], *, resumed: bool = False, overwrite: bool = False) -> Any:
    """Run a case file.

    Its folder gets ``report.html`` and ``report.json``, files for ParaView and the pictures that
    the file asks for; a growth run also has its steps there, from which it can go on.

    Parameters
    ----------
    path : path
        A toml file, as of `read_case`.
    resumed : bool
        Go on with the steps that are in the folder; where there are none, begin.
    overwrite : bool
        Begin anew although steps are there: they are moved aside.

    Returns
    -------
    History, or Solution, or a list of Solution where the file has states

    Raises
    ------
    ProblemError
        As of `read_case`, `solve`, `grow` and `resume`.
    """
    for name, value in (("resumed", resumed), ("overwrite", overwrite)):
        flag(value, f"run: {name}")
    case = read_case(path)
    with system_errors("results cannot be written to", case.folder, error=ProblemError):
        case.folder.mkdir(parents=True, exist_ok=True)
    result: Any
    if case.growth is None:
        result = solve(case.problem, case.states)
        solutions = [result] if isinstance(result, Solution) else list(result)
        for k, solution in enumerate(solutions):
            write(solution, case.folder / ("solution" if len(solutions) == 1 else f"state_{k}"))
    else:
        result = _grown(case, resumed=resumed, overwrite=overwrite)
        result.write(case.folder)
        solved = [step for step in result.steps if not step.has_left]
        solutions = list(solved[-1].solutions) if solved else []
    _draw(case, solutions)
    report(result, case.folder / "report.html", title=case.title)
    return result


def _grown(case: CaseFile, *, resumed: bool, overwrite: bool) -> History:
    folder = case.folder / _STEPS
    given = dict(case.growth or {})
    if resumed and _begun(folder):
        law, criterion, cycle = (given.pop(name) for name in ("law", "criterion", "cycle"))
        return resume(folder, case.problem, law, criterion, cycle, given.pop("da", None), **given)
    return collect(grow(case.problem, **given), folder, overwrite=overwrite)


def _begun(folder: Path) -> bool:
    with system_errors("a run cannot be read from", folder, error=ProblemError):
        return folder.is_dir() and any(folder.glob("step_*.npz"))


def _draw(case: CaseFile, solutions: list[Solution]) -> None:
    for k, solution in enumerate(solutions):
        for field in case.pictures:
            name = field if len(solutions) == 1 else f"{field}_{k}"
            plot(solution, field, file=case.folder / f"{name}.png", warp=case.warp)


__all__ = ["run"]
