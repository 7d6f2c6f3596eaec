"""Where the steps of a run go: its folder, with a header and the body beside them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from xcrack.base.errors import ProblemError, warn
from xcrack.growth.step import Step
from xcrack.model.problem import Problem
from xcrack.runs import run_folder
from xcrack.runs.run_folder import RunHeader
from xcrack.runs.saved import write_body
from xcrack.runs.versions import versions


@dataclass
class RunStore:
    """Where the steps of a run go; the header is written with the first of them."""

    folder: Path
    check: Callable[[], None]  # raises where another process has taken over
    header: RunHeader | None = None
    first: str = ""  # fingerprint of the mesh that a run with a tolerance has begun with
    # Written by this process: a killed one may have left half of them.
    bodies: set[Path] = field(default_factory=set)

    def write(self, step: Step) -> None:
        """Write a step; afterwards it is on disk as a whole."""
        self.check()
        if self.header is None:
            settings = {} if step.memory is None else dict(step.memory.settings)
            _make_room(self.folder)
            self.header = RunHeader(settings, versions())
            run_folder.write_header(self.folder, self.header)
        problem = step.solutions[0].problem if step.solutions else None
        mesh = "" if step.memory is None else step.memory.mesh
        if step.index == 0:
            self.first = mesh
        body = run_folder.body_path(self.folder, "" if mesh == self.first else mesh)
        if body not in self.bodies and isinstance(problem, Problem):
            write_body(body, problem)
            self.bodies.add(body)
        run_folder.write_step(self.folder, step, self.header)

    def end(self, ended: str) -> None:
        """Write why the run ended."""
        if self.header is not None:
            self.check()
            run_folder.write_header(self.folder, replace(self.header, ended=ended))


def _make_room(folder: Path) -> None:
    """Move aside what stands in the place of the files of a new run."""
    files = run_folder.step_files(folder)[::-1]
    if files:
        files += run_folder.body_files(folder)[1:]
    header = folder / run_folder.HEADER
    if header.exists() and (files or not _is_header(folder)):
        files.append(header)
    if files:
        aside = run_folder.move_aside(folder, files)
        warn(f"{len(files)} files that stood in {folder} were moved to {aside}.")


def _is_header(folder: Path) -> bool:
    """Whether the header of a folder can be read; one without steps may be written anew."""
    try:
        return run_folder.read_header(folder)[1] is None
    except ProblemError:
        return False


__all__ = ["RunStore"]
