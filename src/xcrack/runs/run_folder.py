"""The folder of a growth run: one file a step, and one that says what the run is.

Each step also carries what the run is, so that a lost header is made again from the steps. What was
finished is never deleted: files that do not belong to the run are moved into a folder beside them.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors
from xcrack.crack.crack import Crack
from xcrack.fatigue.retardation import BlockCycles, CycleIntegration, OverloadZones
from xcrack.growth.description import DEFAULTS
from xcrack.growth.step import Arrival, Join, Memory, Step, StepError
from xcrack.growth.trail import FrontTrail, Overloads, Places, StepControl, Trail
from xcrack.linalg.engine import SlipField, SolverState
from xcrack.runs import lock
from xcrack.runs.store import PART, load, save, write_whole
from xcrack.sif.sif import SIF, KErrors, SurfaceEnd

HEADER = "run.json"
STEPS = "steps"  # folder of the run in that of the results of a case file
BODY = "body.npz"
_OTHER_BODY = "body_{}.npz"  # on a mesh that growth has asked for, by its fingerprint
_FORMAT = 2
_STEP = re.compile(r"step_(\d{5,})\.npz")
CLASSES: dict[str, type] = {
    kind.__name__: kind for kind in (
        Step, Memory, SolverState, SlipField, Crack, SIF, StepError, Trail, FrontTrail,
        Places, Arrival, Join, Overloads, OverloadZones, BlockCycles, CycleIntegration,
        StepControl, KErrors, SurfaceEnd,
    )
}  # fmt: skip


@dataclass(frozen=True)
class RunHeader:
    """What a run is: the same in its first file and in each step.

    Attributes
    ----------
    settings : mapping of str to str
        What the run was asked to do, and the number of its set of defaults.
    versions : mapping of str to str
    ended : str
        Why the run ended; empty while it goes on.
    """

    settings: Mapping[str, str]
    versions: Mapping[str, str]
    ended: str = ""

    @property
    def defaults(self) -> int:
        """Number of the set of defaults that the run began with."""
        return int(self.settings["defaults"])


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
    inner = folder / STEPS
    return inner if inner.is_dir() and not (folder / HEADER).is_file() else folder


def write_header(folder: Path, header: RunHeader) -> None:
    """Write, or write anew, what the run is."""
    content = {"ended": header.ended, **_content(header)}
    with system_errors("the header of the run cannot be written to", folder, error=ProblemError):
        write_whole(folder / HEADER, (json.dumps(content, indent=1) + "\n").encode())


def _content(header: RunHeader) -> dict[str, Any]:
    """What each file of a run says of it."""
    return {
        "format": _FORMAT,
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
    written = content["format"]
    if written < _FORMAT:
        raise ProblemError(
            f"{path} has format {written}, from before the first release, and this xcrack reads "
            f"{_FORMAT}: start the run again in another folder."
        )
    newer = ProblemError(
        f"{path} was written by a newer xcrack (format {written}, this one reads {_FORMAT}): "
        "update xcrack, or read the run with the version that wrote it."
    )
    if written > _FORMAT:
        raise newer
    settings, versions = ({**content[key]} for key in ("settings", "versions"))
    header = RunHeader(settings, versions, str(content.get("ended", "")))
    if header.defaults > DEFAULTS:
        raise newer
    return header


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


def body_path(folder: Path, mesh: str) -> Path:
    """File of the body on its first mesh, or on the one with a fingerprint."""
    return folder / (_OTHER_BODY.format(mesh) if mesh else BODY)


def body_files(folder: Path) -> list[Path]:
    """All files of bodies: on the first mesh, and on others."""
    with system_errors("the run cannot be read from", folder, error=ProblemError):
        return [folder / BODY, *sorted(folder.glob(_OTHER_BODY.format("*")))]


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
    memory = None if step.memory is None else replace(step.memory, settings={})
    stored = {"run": _content(header), "step": replace(step, solutions=(), memory=memory)}
    path = step_path(folder, step.index)
    try:
        save(path, stored, CLASSES)
    except OSError as error:
        before = f"The {step.index} steps before it are whole" if step.index else "No step is there"
        raise ProblemError(
            f"step {step.index} cannot be written to {path}: {error.strerror or error}. {before}: "
            "mend that and go on by resume."
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
        memory = None if step.memory is None else replace(step.memory, settings=header.settings)
        steps.append(replace(step, memory=memory))
    return StoredSteps(tuple(steps), fault, tuple(reversed(files[len(steps) :])))


def _read(path: Path) -> tuple[RunHeader | None, Step | None]:
    """What a file says of its run, and its step; None where it is no step of a run."""
    content = load(path, CLASSES)
    if not isinstance(content, dict):
        return None, None
    try:
        header = _header(content["run"], path)
    except (ValueError, KeyError, TypeError):
        return None, None
    step = content.get("step")
    return header, step if isinstance(step, Step) else None


def move_aside(folder: Path, files: Sequence[Path]) -> Path:
    """Move files of a folder into a new folder in it, and return that.

    They go in the order in which they are given: with the last steps first, what is left by a kill
    is always a run.
    """
    with system_errors("files cannot be moved aside in", folder, error=ProblemError):
        number = 1
        while True:
            aside = folder / f"moved_aside_{number}"
            try:
                aside.mkdir()
                break
            except FileExistsError:
                number += 1
        for path in files:
            path.rename(aside / path.name)
    return aside


def sweep(folder: Path) -> None:
    """Remove what killed processes left half written; only the owner of the lock may do so."""
    with system_errors("left over files cannot be removed from", folder, error=ProblemError):
        for path in folder.glob(f".*{PART}"):
            name = path.name.removeprefix(".")
            if name.startswith((f"{HEADER}.", f"{lock.NAME}.")) or _STEP.match(name):
                path.unlink(missing_ok=True)


__all__ = [
    "BODY",
    "CLASSES",
    "HEADER",
    "RunHeader",
    "StoredSteps",
    "body_files",
    "body_path",
    "folder_of_steps",
    "move_aside",
    "read_header",
    "read_steps",
    "step_files",
    "step_path",
    "sweep",
    "write_header",
    "write_step",
]
