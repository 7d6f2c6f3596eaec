"""The folder of a growth run: one file a step, and one that says what the run is.

Files hold plain arrays by name (`step_arrays`), and text: numpy alone reads them. Each step also
carries what the run is, so that a lost header is made again from the steps. What was finished is
never deleted: files that do not belong to the run are moved into a folder beside them.
"""

import contextlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.errors import ProblemError, XcrackError, warn
from xcrack.base.machine import versions
from xcrack.base.paths import system_errors
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh
from xcrack.runs import lock
from xcrack.runs.step_arrays import (
    arrays_of,
    arrays_of_mesh,
    mesh_of,
    packed_arrays,
    read_arrays,
    step_of,
)
from xcrack.runs.store import PART, write_whole

HEADER = "run.json"
STEPS = "steps"  # folder of the run in that of the results of a case file
MESH = "mesh.npz"
FORMAT = 3
_STEP = re.compile(r"step_(\d{5,})\.npz")


@dataclass(frozen=True)
class RunHeader:
    """What a run is: the same in its first file and in each step.

    Attributes
    ----------
    settings : mapping of str to str
        What the run was asked to do.
    versions : mapping of str to str
    ended : str
        Why the run ended; empty while it goes on.
    """

    settings: Mapping[str, str]
    versions: Mapping[str, str]
    ended: str = ""


@dataclass(frozen=True, eq=False)
class StoredSteps:
    """Steps of a folder.

    Attributes
    ----------
    steps : tuple of Step
        From the first to the last before one that is missing or damaged.
    fault : str
        What is wrong with the next one; empty where no file follows.
    rest : tuple of Path
        Files of steps that are not among these, the last first.
    """

    steps: tuple[Step, ...]
    fault: str
    rest: tuple[Path, ...]


def folder_of_steps(folder: Path) -> Path:
    """The folder itself, or the one in it where a case file has its steps."""
    steps_folder = folder / STEPS
    return steps_folder if steps_folder.is_dir() and not (folder / HEADER).is_file() else folder


def write_header(folder: Path, header: RunHeader) -> None:
    """Write, or write anew, what the run is."""
    content = {"ended": header.ended, **_content(header)}
    with system_errors("the header of the run cannot be written to", folder, error=ProblemError):
        write_whole(folder / HEADER, (json.dumps(content, indent=1) + "\n").encode())


def _content(header: RunHeader) -> dict[str, Any]:
    """What each file of a run says of it."""
    return {
        "format": FORMAT,
        "versions": dict(header.versions),
        "settings": dict(header.settings),
    }


def _header(content: Any, path: Path) -> RunHeader:
    """What a file says of its run.

    Raises
    ------
    ProblemError
        It was written by an xcrack that this one cannot follow.
    KeyError, TypeError, ValueError
        It is not a file of a run.
    """
    version = content["format"]
    if version < FORMAT:
        raise ProblemError(
            f"{path} has format {version}, from before the first release, and this xcrack reads "
            f"{FORMAT}: start the run again in another folder."
        )
    if version > FORMAT:
        raise ProblemError(
            f"{path} was written by a newer xcrack (format {version}, this one reads {FORMAT}): "
            "update xcrack, or read the run with the version that wrote it."
        )
    settings, versions = ({**content[key]} for key in ("settings", "versions"))
    return RunHeader(settings, versions, str(content.get("ended", "")))


def read_header(folder: Path) -> tuple[RunHeader | None, Path | None]:
    """What the run is, and the file of it that is damaged, if one is.

    Where the file is lost or damaged, it is taken from the first step that is whole; None where
    there is none of these either.

    Raises
    ------
    ProblemError
        The file is not one of xcrack's, and no step says more; or it is of another format.
    """
    path = folder / HEADER
    with system_errors("the header of the run cannot be read from", path, error=ProblemError):
        text = path.read_bytes() if path.is_file() else None
    if text is None:
        return _header_of_steps(folder), path if path.exists() else None
    try:
        return _header(json.loads(text), path), None
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        header = _header_of_steps(folder)
        if header is None:
            raise ProblemError(
                f"{path} is not the header of a run ({error}), and no step beside it is whole: "
                "move it away."
            ) from error
        return header, path


def _header_of_steps(folder: Path) -> RunHeader | None:
    for path in step_files(folder):
        header, step = _read(path)
        if step is not None:
            return header
    return None


def step_path(folder: Path, index: int) -> Path:
    """File of a step."""
    return folder / f"step_{index:05d}.npz"


def read_mesh_file(path: Path) -> Mesh | None:
    """A mesh of a run; None where it is not there, or not whole."""
    arrays = read_arrays(path.read_bytes()) if path.is_file() else None
    try:
        return None if arrays is None else mesh_of(arrays)
    except (KeyError, ProblemError):
        return None


def step_files(folder: Path) -> list[Path]:
    """All files, and whatever else, in the place of steps, by their number."""
    with system_errors("the run cannot be read from", folder, error=ProblemError):
        names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    numbers = sorted(int(match[1]) for match in map(_STEP.fullmatch, names) if match)
    return [path for path in (step_path(folder, n) for n in numbers) if path.name in names]


def write_step(folder: Path, step: Step, header: RunHeader) -> None:
    """Write a step without its solutions; afterwards it is on disk as a whole.

    Raises
    ------
    ProblemError
        The system refuses: no space, no permission. The steps before are whole.
    """
    path = step_path(folder, step.index)
    content = {"run": np.array(json.dumps(_content(header))), **arrays_of(step)}
    try:
        write_whole(path, packed_arrays(content))
    except OSError as error:
        state_of_folder = (
            f"The {step.index} steps before it are whole" if step.index else "No step is there"
        )
        raise ProblemError(
            f"step {step.index} cannot be written to {path}: {error.strerror or error}. "
            f"{state_of_folder}: mend that and go on by resume."
        ) from error


def read_steps(folder: Path, header: RunHeader) -> StoredSteps:
    """Steps up to the first that is missing, damaged, or of another run."""
    files = step_files(folder)
    steps: list[Step] = []
    fault = ""
    for path in files:
        number = len(steps)
        if path != step_path(folder, number):
            fault = f"{step_path(folder, number).name} is missing"
            break
        own_header, step = _read(path)
        if own_header is None or step is None or step.index != number:
            fault = f"{path.name} is not whole"
            break
        if own_header.settings != header.settings:
            fault = f"{path.name} belongs to another run"
            break
        steps.append(step)
    return StoredSteps(tuple(steps), fault, tuple(reversed(files[len(steps) :])))


def _read(path: Path) -> tuple[RunHeader | None, Step | None]:
    """What a file says of its run, and its step; None where it is no step of a run."""
    if path.is_dir():
        return None, None
    with system_errors("a step cannot be read from", path, error=ProblemError):
        arrays = read_arrays(path.read_bytes())
    if arrays is None:
        return None, None
    is_old_format = "Step" in str(arrays.get("tree", ""))  # the text of all older formats
    try:
        header = _header(
            {"format": 2} if is_old_format else json.loads(str(arrays.pop("run"))), path
        )
    except (ValueError, KeyError, TypeError):
        return None, None
    try:
        return header, step_of(arrays, dict(header.settings))
    except (ValueError, KeyError, TypeError, IndexError, XcrackError):
        return header, None


def move_aside(folder: Path, files: Sequence[Path]) -> Path:
    """Move files of a folder into a new folder in it, and return that.

    They go in the order in which they are given: with the last steps first, what is left by a kill
    is always a run.
    """
    with system_errors("files cannot be moved aside in", folder, error=ProblemError):
        number = 1
        while True:
            new_folder = folder / f"moved_aside_{number}"
            try:
                new_folder.mkdir()
                break
            except FileExistsError:
                number += 1
        for path in files:
            path.rename(new_folder / path.name)
    return new_folder


def sweep(folder: Path) -> None:
    """Remove what killed processes left half written; only the owner of the lock may do so."""
    with system_errors("left over files cannot be removed from", folder, error=ProblemError):
        for path in folder.glob(f".*{PART}"):
            name = path.name.removeprefix(".")
            if name.startswith((f"{HEADER}.", f"{MESH}.", f"{lock.NAME}.")) or _STEP.match(name):
                path.unlink(missing_ok=True)


@dataclass
class RunStore:
    """Where the steps of a run go; the header is written with the first of them."""

    folder: Path
    check: Callable[[], None]  # raises where another process has taken over
    header: RunHeader | None = None
    mesh: Mesh | None = None  # written last by this process

    def write(self, step: Step) -> None:
        """Write a step; afterwards it is on disk as a whole."""
        self.check()
        if self.header is None:
            settings = {} if step.run is None else dict(step.run.settings)
            _make_room(self.folder)
            self.header = RunHeader(settings, versions())
            write_header(self.folder, self.header)
        mesh = getattr(step.solutions[0].problem, "mesh", None) if step.solutions else None
        if isinstance(mesh, Mesh) and mesh is not self.mesh:
            # A run does without it: where the system refuses, it is left out.
            with contextlib.suppress(OSError):
                write_whole(self.folder / MESH, packed_arrays(arrays_of_mesh(mesh)))
            self.mesh = mesh
        write_step(self.folder, step, self.header)

    def end(self, end: str) -> None:
        """Write why the run ended."""
        if self.header is not None:
            self.check()
            write_header(self.folder, replace(self.header, ended=end))


def _make_room(folder: Path) -> None:
    """Move aside what stands in the place of the files of a new run."""
    files = step_files(folder)[::-1]
    header = folder / HEADER
    if header.exists() and (files or not _is_header(folder)):
        files.append(header)
    if files:
        new_folder = move_aside(folder, files)
        warn(f"{len(files)} files that stood in {folder} were moved to {new_folder}.")


def _is_header(folder: Path) -> bool:
    """Whether the header of a folder can be read; one without steps may be written anew."""
    try:
        return read_header(folder)[1] is None
    except ProblemError:
        return False


__all__ = [
    "FORMAT",
    "HEADER",
    "MESH",
    "RunHeader",
    "RunStore",
    "StoredSteps",
    "folder_of_steps",
    "move_aside",
    "read_header",
    "read_mesh_file",
    "read_steps",
    "step_files",
    "step_path",
    "sweep",
    "write_header",
    "write_step",
]
