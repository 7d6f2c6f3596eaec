"""What became of the cracks: steps collected, kept on disk, and taken up again."""

import csv
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Unpack

from numpy.typing import NDArray

from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError, warn
from xcrack.growth.criteria import Criterion
from xcrack.growth.fingerprint import differences
from xcrack.growth.laws import Law
from xcrack.growth.options import GrowOptions, lists_options, run_of
from xcrack.growth.run import steps_of
from xcrack.growth.step import Cycle, Step
from xcrack.history import run_folder as run_files
from xcrack.history.table import table
from xcrack.mesh.mesh import Mesh
from xcrack.scene.problem import Problem

Until = Callable[[Step], bool]


@dataclass(frozen=True, eq=False)
class History:
    """Steps of a growth run, and why it ended.

    Attributes
    ----------
    steps : tuple of Step
    ended : str
    path : Path, optional
        Folder that holds the steps.
    mesh : Mesh, optional
        For the outline of the body in pictures.
    """

    steps: tuple[Step, ...]
    ended: str
    path: Path | None = None
    mesh: Mesh | None = None

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """The cracks of the last step."""
        return self.steps[-1].cracks if self.steps else ()

    @property
    def life(self) -> float:
        """Cycles at the last step."""
        return self.steps[-1].cycles if self.steps else 0.0

    def __repr__(self) -> str:
        return f"History({len(self.steps)} steps, {self.life:.6g} cycles, ended: {self.ended})"

    def table(self) -> NDArray[Any]:
        """All numbers, one row for each tip, in space for each front, of each step.

        Returns
        -------
        structured array
            Columns step, N, crack, tip; x, y[, z] of the tip; a (length of its crack inside the
            body); K_I, K_II[, K_III] of load state 0 as ``K_I_0`` and so on, then of state 1, ...;
            angle, dK_eq, R, rate, da as in `Step`. In space ``front`` stands for ``tip`` and x, y,
            z is the middle of the front; each K and each of the others has three columns, its
            smallest value along the front, its mean over the length and its largest:
            ``K_I_0_min``, ``K_I_0_mean``, ``K_I_0_max``.
        """
        return table(self.steps)

    def plot(self, kind: str, file: str | Path | None = None) -> Any:
        """Draw the run.

        Parameters
        ----------
        kind : {"K", "a", "path", "fronts"}
            K of the most severe state over the crack length, length over cycles, or the cracks
            in the body; in space the largest K along each front over cycles, and the fronts over
            the section of the body.
        file : path, optional
            Where to save the picture; else it is shown.

        Returns
        -------
        matplotlib figure
        """
        from xcrack.plotting.history import draw

        return draw(self, kind, file)

    def write(self, path: str | Path) -> None:
        """Write a table and a series for ParaView into a folder.

        ``history.csv`` is `table`; ``history.pvd`` lists for each step the solutions of all load
        states with their lips, or the lines of the cracks where a step has no solutions any
        more (it was read from disk).

        Parameters
        ----------
        path : path
            Folder; made if it is not there.
        """
        from xcrack.history.series import write_series

        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        table = self.table()
        with open(folder / "history.csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table.dtype.names or ())
            writer.writerows(table.tolist())
        write_series(self.steps, folder)


def collect(
    steps: Iterable[Step],
    path: str | Path | None = None,
    until: Until | None = None,
    *,
    overwrite: bool = False,
    keep_solutions: bool = True,
) -> History:
    """Run growth to its end.

    Parameters
    ----------
    steps : iterable of Step
        What `grow` returns.
    path : path, optional
        Folder in which each step is stored as soon as it is finished; `resume` goes on from it.
        A stored run of the same settings is replaced.
    until : callable Step -> bool, optional
        Growth stops at the first step for which it is true.
    overwrite : bool
        Also replace a stored run of other settings.
    keep_solutions : bool
        Keep the solutions of all steps in memory, for `History.write`.

    Returns
    -------
    History

    Raises
    ------
    ProblemError
        `path` holds a run with other settings, or is a file.
    """
    folder = None if path is None else _folder(path)
    return _collected(steps, folder, until, (), None, overwrite, keep_solutions)


@lists_options
def resume(
    path: str | Path,
    problem: Problem,
    law: Law,
    criterion: Criterion,
    cycle: Cycle,
    da: float | None = None,
    *,
    until: Until | None = None,
    keep_solutions: bool = True,
    **options: Unpack[GrowOptions],
) -> History:
    """Go on with a run that is on disk, to the history it would have had, to the last bit.

    Parameters
    ----------
    path : path
        Folder that `collect` wrote to.
    problem, law, criterion, cycle, da
        As they were given to `grow`; the problem has the cracks as they were at first.
    until
        As in `collect`.
    cycles, scaling, threshold, solver, progress, keep_solutions
        As they were given to `grow` and `collect`.
    K_c, max_steps, max_cycles
        Rules that stop a run may be other ones than before.

    Returns
    -------
    History
        With all steps; those from disk have no solutions.

    Raises
    ------
    ProblemError
        No run is there, or it was made with other settings: the message names them.
    """
    run = run_of("resume", problem, law, criterion, cycle, da, options)
    folder = Path(path)
    if not folder.is_dir():
        raise ProblemError(
            f"no run to go on with in {folder}: collect(grow(...), path=...) starts one."
        )
    header = run_files.read_header(folder)
    if header is None:  # killed before its first step
        return _collected(steps_of(run), folder, until, (), None, False, keep_solutions)
    run = run.as_begun(header.settings)
    settings = run.settings
    lines = differences(header.settings, settings)
    if lines:
        raise ProblemError(
            f"the run in {folder} was made with other settings: {run_files.shortened(lines)}."
        )
    lines = differences(header.versions, run_files.versions())
    if lines:
        warn(
            f"the run in {folder} was made with other versions, its last bits may differ: "
            f"{run_files.shortened(lines)}."
        )
    done, damaged = run_files.read_steps(folder, settings)
    if damaged is not None:
        warn(f"{damaged} is not whole: growth goes on from step {len(done) - 1}.")
    run_files.remove_steps(folder, len(done))
    header = replace(header, ended="")
    run_files.write_header(folder, header)
    history = _collected(
        steps_of(run, done[-1] if done else None),
        folder,
        until,
        tuple(done),
        header,
        False,
        keep_solutions,
    )
    return replace(history, mesh=problem.mesh)


def load(path: str | Path) -> History:
    """Read a stored run without going on with it.

    Parameters
    ----------
    path : path
        Folder that `collect` wrote to.

    Returns
    -------
    History
        Its steps have no solutions.

    Raises
    ------
    ProblemError
        No run is there.
    """
    folder = Path(path)
    header = run_files.read_header(folder)
    if header is None:
        raise ProblemError(f"{folder} holds no run: {folder / 'run.json'} is missing.")
    steps, _ = run_files.read_steps(folder, header.settings)
    return History(tuple(steps), header.ended, folder)


def _collected(
    steps: Iterable[Step],
    folder: Path | None,
    until: Until | None,
    done: tuple[Step, ...],
    header: run_files.Header | None,
    overwrite: bool,
    keep_solutions: bool,
) -> History:
    """Take steps until they end, each on disk before the next is asked for."""
    kept = list(done)
    iterator = iter(steps)
    ended = ""
    mesh: Mesh | None = None
    if kept and until is not None and until(kept[-1]):  # killed before it could say so
        ended = _stopped(kept[-1])
    while not ended:
        try:
            step = next(iterator)
        except StopIteration as stop:
            ended = stop.value or "no more steps"
            break
        if folder is not None:
            if header is None:
                settings = {} if step.memory is None else step.memory.settings
                header = run_files.begin(folder, settings, overwrite)
            run_files.write_step(folder, step, header)
        if mesh is None and step.solutions:
            mesh = step.solutions[0].problem.mesh
        kept.append(step if keep_solutions else replace(step, solutions=()))
        if until is not None and until(step):
            ended = _stopped(step)
    close = getattr(iterator, "close", None)
    if close is not None:
        close()
    if folder is not None and header is not None:
        run_files.write_header(folder, replace(header, ended=ended))
    return History(tuple(kept), ended, folder, mesh)


def _stopped(step: Step) -> str:
    return f"until was true at step {step.index}"


def _folder(path: str | Path) -> Path:
    folder = Path(path)
    if folder.exists() and not folder.is_dir():
        raise ProblemError(f"{folder} is a file; a run needs a folder of its own.")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


__all__ = ["History", "collect", "load", "resume"]
