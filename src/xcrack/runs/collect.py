"""Growth run to its end: steps collected, stored one by one, and taken up again after a kill."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Unpack

from xcrack.base.checks import call_function, flag, value_text
from xcrack.base.description import differences, only_compiled_differently
from xcrack.base.errors import ProblemError, warn
from xcrack.base.machine import versions
from xcrack.base.paths import path_of, system_errors
from xcrack.crack.measures import measures
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import Law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.options import GrowthOptions, GrowthRule, lists_options, run_of
from xcrack.growth.run import growth_steps, steps_to_go_on_from
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh, facet_set
from xcrack.model.problem import Problem
from xcrack.runs import run_folder
from xcrack.runs.history import History
from xcrack.runs.lock import lock_folder
from xcrack.runs.run_folder import RunHeader, RunStore
from xcrack.runs.saved import read_saved

Until = Callable[[Step], bool] | str | Sequence[str]  # a function, or names of facet sets

_SHOWN = 5  # differences that a message lists


def collect(
    steps: Iterable[Step],
    path: str | Path | None = None,
    until: Until | None = None,
    *,
    overwrite: bool = False,
    keep_solutions: bool = True,
) -> History:
    """Run growth to its end.

    Ctrl-C ends it too, once a step is finished: the history of all finished steps is returned, with
    `ended` that begins with "interrupted", and a warning. Where an error ends it, the error carries
    the history of the finished steps as its attribute `history`.

    Parameters
    ----------
    steps : iterable of Step
        What `grow` returns.
    path : path, optional
        Folder in which each step is stored as soon as it is finished; `resume` goes on from it. One
        process at a time may write to it.
    until : callable Step -> bool, str or sequence of str, optional
        Growth stops at the first step for which it is true; a step without tips is the last one
        anyway, and is not asked. Names of facet sets: at the first step whose cracks are on all of
        them, such as a part-through crack on ``["front", "back"]``.
    overwrite : bool
        Begin although a run is stored in the folder: that one is moved aside, into a folder
        ``moved_aside_1`` in it.
    keep_solutions : bool
        Keep the solutions of all steps in memory, for `History.write`.

    Returns
    -------
    History

    Raises
    ------
    ProblemError
        `path` holds a run, is in use by another process, is a file, or cannot be written.
    """
    try:
        iter(steps)
    except Exception as error:  # whatever an object's own __iter__ raises
        raise ProblemError(
            f"collect: steps = {value_text(steps)}: give what grow returns."
        ) from error
    if isinstance(steps, str | bytes):
        raise ProblemError(
            f"collect: steps = {value_text(steps)} is a text: give what grow returns."
        )
    _check_options("collect", until, overwrite=overwrite, keep_solutions=keep_solutions)
    run = Collector(until, keep_solutions)
    if path is None:
        return run.of(steps)
    folder = path_of(path, "collect: path", error=ProblemError)
    with system_errors("a folder for the run cannot be made at", folder, error=ProblemError):
        if folder.exists() and not folder.is_dir():
            raise ProblemError(f"{folder} is a file; a run needs a folder of its own.")
        folder.mkdir(parents=True, exist_ok=True)
    with lock_folder(folder) as check:
        run_folder.sweep(folder)
        if not overwrite:
            _refuse_stored(folder)
        run.store = RunStore(folder, check)
        return run.of(steps)


@lists_options
def resume(
    path: str | Path,
    problem: Problem,
    law: Law,
    criterion: Criterion,
    cycle: Cycle | Spectrum,
    da: float | None = None,
    *,
    until: Until | None = None,
    keep_solutions: bool = True,
    **options: Unpack[GrowthOptions],
) -> History:
    """Go on with a run that is on disk, to the history it would have had, to the last bit.

    A step that is missing or damaged is computed again, and so are those behind it; their files are
    moved into a folder ``moved_aside_1`` beside them, with a warning. A lost or damaged header is
    made again from the steps. Ctrl-C is handled as in `collect`.

    Parameters
    ----------
    path : path
        Folder that `collect` wrote to.
    problem, law, criterion, cycle, da
        As they were given to `grow`; the problem has the cracks as they were at first. Functions
        are compared by their code and by all that they read.
    until
        As in `collect`.
    cycles, scaling, integrator, threshold, retardation, solver, response, load_program, progress, \
    keep_solutions
        As they were given to `grow` and `collect`.
    tolerance, max_unknowns
        As they were given to `grow`.
    K_c, link_up, stop_at_interface, max_steps, max_cycles, max_size
        Rules that stop a run may be other ones than before.

    Returns
    -------
    History
        With all steps; those from disk have no solutions.

    Raises
    ------
    ProblemError
        No run is there, or it was made with other settings: the message names them. It is in use by
        another process, or cannot be written.

    Warns
    -----
    XcrackWarning
        Versions, the processor or the number of threads of the BLAS are others than those that the
        run was begun with, so that its last bits may differ.
    """
    run = run_of("resume", problem, law, criterion, cycle, da, options)
    _check_options("resume", until, keep_solutions=keep_solutions)
    folder = path_of(path, "resume: path", error=ProblemError)
    with system_errors("no run can be read from", folder, error=ProblemError):
        folder_exists = folder.is_dir()
    if not folder_exists:
        raise ProblemError(
            f"no run to go on with in {folder}: collect(grow(...), path=...) starts one."
        )
    collection = Collector(until, keep_solutions, mesh=problem.mesh)
    with lock_folder(folder) as check:
        run_folder.sweep(folder)
        header, damaged_file = run_folder.read_header(folder)
        if header is None:  # killed before its first step
            collection.store = RunStore(folder, check)
            return collection.of(growth_steps(run))
        _check_settings(run, header, folder)
        stored_steps = run_folder.read_steps(folder, header)
        if stored_steps.rest or damaged_file is not None:
            _move_aside(folder, stored_steps, damaged_file)
        header = replace(header, ended="")
        run_folder.write_header(folder, header)
        steps = steps_to_go_on_from(run, stored_steps.steps)
        collection.steps_taken.extend(steps)
        collection.store = RunStore(folder, check, header)
        if run.tolerance is not None and stored_steps.steps:
            collection.mesh = run_folder.read_mesh_file(folder / run_folder.MESH) or problem.mesh
        return collection.of(growth_steps(run, steps))


def load(path: str | Path) -> Any:
    """Read a stored run without going on with it, or what `save` wrote.

    Another process may write to the folder of a run meanwhile.

    Parameters
    ----------
    path : path
        Folder that `collect` wrote to, that of the results of a case file, or file that `save`
        wrote.

    Returns
    -------
    History, or what was saved
        Steps have no solutions.

    Raises
    ------
    ProblemError
        No run is there, or it cannot be read.

    Warns
    -----
    XcrackWarning
        A step is missing or damaged: those behind it are left out.
    """
    folder = path_of(path, "load: path", error=ProblemError)
    with system_errors("no run can be read from", folder, error=ProblemError):
        is_file = folder.is_file()
        folder = folder if is_file else run_folder.folder_of_steps(folder)
    if is_file:
        return read_saved(folder)
    header, _ = run_folder.read_header(folder)
    if header is None:
        raise ProblemError(
            f"load: path = {str(folder)!r} holds no run, {run_folder.HEADER} is missing: give the "
            "folder that collect wrote to."
        )
    stored_steps = run_folder.read_steps(folder, header)
    if stored_steps.rest:
        warn(
            f"{stored_steps.fault} in {folder}: the {len(stored_steps.steps)} steps before it are "
            "read. resume computes the others again."
        )
    end = header.ended or "not ended: it is still going on, or was killed; resume goes on with it"
    mesh = run_folder.read_mesh_file(folder / run_folder.MESH)
    return History(stored_steps.steps, end, folder, mesh)


@dataclass
class Collector:
    """Steps that are taken until they end, each on disk before the next is asked for."""

    until: Until | None
    keep_solutions: bool
    mesh: Mesh | None = None
    store: RunStore | None = None
    steps_taken: list[Step] = field(default_factory=list)

    def of(self, steps: Iterable[Step]) -> History:
        """Take all steps of an iterable; Ctrl-C and errors lose none of those taken."""
        with ExitStack() as stack:
            close_steps = getattr(steps, "close", None)
            if close_steps is not None:
                stack.callback(close_steps)
            try:
                end = self._take(steps)
            except KeyboardInterrupt:
                end = self._interrupt()
            except Exception as error:
                # Ctrl-C within a compiled kernel is the cause of a SystemError.
                if not _is_interrupt(error):
                    self._attach(error)
                    raise
                end = self._interrupt()
        history = self._history(end)
        if self.store is not None:
            try:
                self.store.end(end)
            except ProblemError as error:
                self._attach(error)
                raise
        if end.startswith("interrupted"):
            warn(f"growth was {end}: {len(self.steps_taken)} finished steps are handed back.")
        return history

    def _take(self, steps: Iterable[Step]) -> str:
        """Take steps, and return why they ended."""
        if self.steps_taken and self._is_enough(
            self.steps_taken[-1]
        ):  # killed before it could write so
            return self._stop()
        iterator = iter(steps)
        while True:
            try:
                step = next(iterator)
            except StopIteration as stop:
                return str(stop.value or "no more steps")
            if not isinstance(step, Step):
                raise ProblemError(
                    f"collect: {value_text(step)} is not a Step: give what grow returns."
                )
            if step.solutions:
                self.mesh = step.solutions[0].problem.mesh
            self.steps_taken.append(step if self.keep_solutions else replace(step, solutions=()))
            if self.store is not None:
                self.store.write(step)
            if self._is_enough(step):
                return self._stop()

    def _is_enough(self, step: Step) -> bool:
        # Where no tip is left the run ends anyway, and functions of users look for K.
        if self.until is None or step.has_left:
            return False
        if not callable(self.until):
            return self._is_on_sets(step)
        is_enough = call_function(self.until, f"until, after step {step.index}", step)
        return flag(is_enough, "collect: what until returned")

    def _is_on_sets(self, step: Step) -> bool:
        """Whether the cracks of a step are on all facet sets that `until` names."""
        if self.mesh is None:
            raise ProblemError(
                f"until = {value_text(self.until)}: the steps have no solutions, and so no mesh "
                "with facet sets: give a function of a Step."
            )
        names = names_of_sets(self.until, "collect: until")
        for name in names:
            facet_set(self.mesh, name, "collect: until")
        on = {row.name for crack in step.cracks for row in measures(crack, self.mesh).traces}
        return on >= set(names)

    def _interrupt(self) -> str:
        if not self.steps_taken:
            raise KeyboardInterrupt
        return f"interrupted after step {self.steps_taken[-1].index}"

    def _stop(self) -> str:
        if callable(self.until):
            return f"until was true at step {self.steps_taken[-1].index}"
        names = ", ".join(names_of_sets(self.until, "collect: until"))
        return f"cracks are on {names} at step {self.steps_taken[-1].index}"

    def _attach(self, error: Exception) -> None:
        """Hand the finished steps over with an error."""
        if not self.steps_taken:
            return
        error.history = self._history(f"an error: {error}")  # type: ignore[attr-defined]
        error.add_note(
            f"{len(self.steps_taken)} finished steps are in the attribute `history` of this error"
            + ("." if self.store is None else f", and in {self.store.folder}: see resume.")
        )

    def _history(self, end: str) -> History:
        folder = None if self.store is None else self.store.folder
        return History(tuple(self.steps_taken), end, folder, self.mesh)


def _is_interrupt(error: BaseException) -> bool:
    if isinstance(error, KeyboardInterrupt):
        return True
    cause = error.__cause__ or error.__context__
    return isinstance(error, SystemError) and cause is not None and _is_interrupt(cause)


def _check_settings(run: GrowthRule, header: RunHeader, folder: Path) -> None:
    """Refuse to go on with a run of other settings; warn of other versions."""
    settings, current_versions = run.settings, versions()
    compiled_keys: list[str] = []
    if header.versions.get("python") != current_versions["python"]:
        compiled_keys = only_compiled_differently(header.settings, settings)
    settings_of_run = {**settings, **{key: header.settings[key] for key in compiled_keys}}
    lines = differences(header.settings, settings_of_run, run.default_settings)
    if lines:
        raise ProblemError(
            f"the run in {folder} was made with other settings: {_first_differences(lines)}. Give "
            f"those, or begin another run in another folder."
        )
    lines = differences(header.versions, current_versions)
    lines += [f"{key}: its code cannot be compared between the two" for key in compiled_keys]
    if lines:
        warn(
            f"the run in {folder} was made with other versions, on another processor or with "
            f"other threads, its last bits may differ: {_first_differences(lines)}."
        )


def _refuse_stored(folder: Path) -> None:
    """Raise where a folder holds a run of which a step is finished."""
    header, _ = run_folder.read_header(folder)
    steps = run_folder.step_files(folder)
    if header is None or not steps:
        return
    raise ProblemError(
        f"{folder} holds a run of {len(steps)} steps already: go on with it by "
        f"resume({str(folder)!r}, ...), take another path, or give overwrite=True, which moves it "
        "into a folder moved_aside_1 beside the new one."
    )


def _move_aside(
    folder: Path, stored_steps: run_folder.StoredSteps, damaged_file: Path | None
) -> None:
    """Move aside what does not belong to the part of a run that is whole, and warn of it."""
    files = [*stored_steps.rest, *([] if damaged_file is None else [damaged_file])]
    new_folder = run_folder.move_aside(folder, files)
    if stored_steps.rest:
        index = len(stored_steps.steps) - 1
        begin = f"growth goes on from step {index}" if stored_steps.steps else "growth begins anew"
        warn(
            f"{stored_steps.fault} in {folder}: {begin}; {len(stored_steps.rest)} files of steps "
            f"were moved to {new_folder}."
        )
    if damaged_file is not None:
        warn(
            f"{damaged_file} was damaged: it was moved to {new_folder}, and made again "
            "from the steps."
        )


def names_of_sets(value: Any, label: str) -> tuple[str, ...]:
    """A name, or several, as a tuple of texts.

    Raises
    ------
    ProblemError
        Something else.
    """
    names = (value,) if isinstance(value, str) else value
    if isinstance(names, Sequence) and names and all(isinstance(n, str) and n for n in names):
        return tuple(names)
    raise ProblemError(
        f"{label} = {value_text(value)}: give a function of a Step, or names of facet sets."
    )


def _check_options(caller: str, until: Any, **flags: Any) -> None:
    if until is not None and not callable(until):
        names_of_sets(until, f"{caller}: until")
    for name, value in flags.items():
        flag(value, f"{caller}: {name}")


def _first_differences(lines: list[str]) -> str:
    """The first few of many differences, in one line."""
    n_more = len(lines) - _SHOWN
    return "; ".join(lines[:_SHOWN]) + (f"; and {n_more} more" if n_more > 0 else "")


__all__ = ["Until", "collect", "load", "names_of_sets", "resume"]
