"""The folder of a growth run: one file a step, and one that says what the run is."""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.elimination import Elimination
from xcrack.errors import ProblemError
from xcrack.settings import differences
from xcrack.step import Memory, Step
from xcrack.store import load, save, write_whole
from xcrack.warm import Warm

_HEADER = "run.json"
_FORMAT = 1
_SHOWN = 5


@dataclass(frozen=True)
class Header:
    """What the first file of a run says.

    Attributes
    ----------
    settings, versions : mapping of str to str
    ended : str
        Why the run ended; empty while it goes on.
    """

    settings: Mapping[str, str]
    versions: Mapping[str, str]
    ended: str = ""


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
    content = {
        "format": _FORMAT,
        "ended": header.ended,
        "versions": dict(header.versions),
        "settings": dict(header.settings),
    }
    write_whole(folder / _HEADER, (json.dumps(content, indent=1) + "\n").encode())


def read_header(folder: Path) -> Header | None:
    """What the run is; None where nothing was written yet.

    Raises
    ------
    ProblemError
        The file is not one of xcrack's.
    """
    path = folder / _HEADER
    if not path.exists():
        return None
    try:
        content: dict[str, Any] = json.loads(path.read_text())
        if content["format"] != _FORMAT:
            raise ProblemError(
                f"{path} has format {content['format']}, this xcrack reads {_FORMAT}: read it with "
                "the version that wrote it."
            )
        return Header(content["settings"], content["versions"], content["ended"])
    except (ValueError, KeyError, TypeError) as error:
        raise ProblemError(f"{path} is not the header of a run ({error}): move it away.") from error


def step_path(folder: Path, index: int) -> Path:
    """File of a step."""
    return folder / f"step_{index:05d}.npz"


def write_step(folder: Path, step: Step) -> None:
    """Write a step without its solutions; afterwards it is on disk as a whole.

    An order of elimination is written by the step that found it; those that follow only say so.
    """
    memory = None if step.memory is None else replace(step.memory, settings={})
    order = _order_of(memory)
    if memory is not None and order is not None and order.age:
        memory = _with_order(memory, replace(order, place=np.zeros(0, dtype=np.int32)))
    save(step_path(folder, step.index), replace(step, solutions=(), memory=memory))


def read_steps(folder: Path, settings: Mapping[str, str]) -> tuple[list[Step], Path | None]:
    """Steps up to the first that is missing or not whole, and its file if it is there."""
    steps: list[Step] = []
    while True:
        path = step_path(folder, len(steps))
        if not path.exists():
            return steps, None
        step = load(path)
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
    return memory.warm.elimination if memory and isinstance(memory.warm, Warm) else None


def _with_order(memory: Memory, order: Elimination) -> Memory:
    return replace(memory, warm=replace(memory.warm, elimination=order))


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
