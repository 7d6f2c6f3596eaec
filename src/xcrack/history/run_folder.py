"""The folder of a growth run: one file a step, and one that says what the run is.

Each step also carries what the run is, so that a lost header is made again from the steps.
"""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.growth.fingerprint import DEFAULTS, differences
from xcrack.growth.step import Memory, Step
from xcrack.history.store import load, save, write_whole
from xcrack.sif.sif import SIF
from xcrack.solvers.factor import Elimination
from xcrack.solvers.reuse import Reuse

_HEADER = "run.json"
_FORMAT = 2
_SHOWN = 5
CLASSES: dict[str, type] = {
    "Step": Step, "Memory": Memory, "Reuse": Reuse, "Elimination": Elimination, "Crack": Crack,
    "SIF": SIF,
}  # fmt: skip


@dataclass(frozen=True)
class Header:
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


def versions() -> dict[str, str]:
    """Versions of all that the last bit of a result depends on."""
    found = {"python": platform.python_version()}
    for name in ("xcrack", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def write_header(folder: Path, header: Header) -> None:
    """Write, or write anew, what the run is."""
    content = {"ended": header.ended, **_content(header)}
    write_whole(folder / _HEADER, (json.dumps(content, indent=1) + "\n").encode())


def _content(header: Header) -> dict[str, Any]:
    """What each file of a run says of it."""
    return {
        "format": _FORMAT,
        "versions": dict(header.versions),
        "settings": dict(header.settings),
    }


def _header(content: Any, path: Path) -> Header:
    """What a file says of its run.

    Raises
    ------
    ProblemError
        It was written by an xcrack that this one cannot follow.
    """
    written = content["format"]
    if written < _FORMAT:
        raise ProblemError(
            f"{path} has format {written}, from before the first release, and this xcrack reads "
            f"{_FORMAT}: start the run again in another folder."
        )
    header = Header(content["settings"], content["versions"], content.get("ended", ""))
    if written > _FORMAT or header.defaults > DEFAULTS:
        raise ProblemError(
            f"{path} was written by a newer xcrack (format {written}, this one reads {_FORMAT}): "
            "update xcrack, or read the run with the version that wrote it."
        )
    return header


def read_header(folder: Path) -> Header | None:
    """What the run is; None where nothing was written yet.

    Where the file is lost, it is taken from the first step that is whole.

    Raises
    ------
    ProblemError
        The file is not one of xcrack's, or of another format.
    """
    path = folder / _HEADER
    if not path.exists():
        return _header_of_steps(folder)
    try:
        return _header(json.loads(path.read_text()), path)
    except (ValueError, KeyError, TypeError) as error:
        raise ProblemError(f"{path} is not the header of a run ({error}): move it away.") from error


def _header_of_steps(folder: Path) -> Header | None:
    for path in sorted(folder.glob("step_*.npz")):
        stored = load(path, CLASSES)
        if stored is not None:
            return _header(stored["run"], path)
    return None


def step_path(folder: Path, index: int) -> Path:
    """File of a step."""
    return folder / f"step_{index:05d}.npz"


def write_step(folder: Path, step: Step, header: Header) -> None:
    """Write a step without its solutions; afterwards it is on disk as a whole.

    An order of elimination is written by the step that found it; those that follow only say so.
    """
    memory = None if step.memory is None else replace(step.memory, settings={})
    order = _order_of(memory)
    if memory is not None and order is not None and order.age:
        memory = _with_order(memory, replace(order, place=np.zeros(0, dtype=np.int32)))
    stored = {"run": _content(header), "step": replace(step, solutions=(), memory=memory)}
    save(step_path(folder, step.index), stored, CLASSES)


def read_steps(folder: Path, settings: Mapping[str, str]) -> tuple[list[Step], Path | None]:
    """Steps up to the first that is missing or not whole, and its file if it is there."""
    steps: list[Step] = []
    while True:
        path = step_path(folder, len(steps))
        if not path.exists():
            return steps, None
        stored = load(path, CLASSES)
        step = stored["step"] if isinstance(stored, dict) else None
        if not isinstance(step, Step) or step.index != len(steps):
            return steps, path
        if isinstance(step.memory, Memory):
            memory = replace(step.memory, settings=dict(settings))
            order = _order_of(memory)
            if order is not None and order.age:
                found = _order_of(steps[-1].memory) if steps else None
                if found is None:
                    return steps, path
                memory = _with_order(memory, replace(order, place=found.place))
            step = replace(step, memory=memory)
        steps.append(step)


def _order_of(memory: Memory | None) -> Elimination | None:
    return memory.reuse.elimination if memory else None


def _with_order(memory: Memory, order: Elimination) -> Memory:
    return replace(memory, reuse=replace(memory.reuse, elimination=order))


def remove_steps(folder: Path, begin: int) -> None:
    """Remove the steps from a number on, the last first: what is left is always a run."""
    for path in sorted(folder.glob("step_*.npz"), reverse=True):
        number = path.stem.removeprefix("step_")
        if number.isdigit() and int(number) >= begin:
            path.unlink()
    for name in (_HEADER, "step_*.npz"):
        for path in folder.glob(f".{name}.part"):
            path.unlink()


def begin(folder: Path, settings: Mapping[str, str], overwrite: bool) -> Header:
    """Make the folder ready for a new run.

    A run of the very same settings may be written anew, since it comes out the same.

    Raises
    ------
    ProblemError
        The folder holds another run.
    """
    stored = read_header(folder)
    if stored is not None and not overwrite:
        lines = differences(stored.settings, settings)
        if lines:
            raise ProblemError(
                f"{folder} holds a run with other settings ({shortened(lines)}). Take another "
                "path, or overwrite=True to lose it."
            )
    remove_steps(folder, 0)
    header = Header(dict(settings), versions())
    write_header(folder, header)
    return header


def shortened(lines: list[str]) -> str:
    """The first few of many differences, in one line."""
    more = len(lines) - _SHOWN
    return "; ".join(lines[:_SHOWN]) + (f"; and {more} more" if more > 0 else "")


__all__ = [
    "CLASSES",
    "Header",
    "begin",
    "read_header",
    "read_steps",
    "remove_steps",
    "shortened",
    "step_path",
    "versions",
    "write_header",
    "write_step",
]
