"""The baseline of the same kind: GetFEM's XFEM, in a process of the Python that has it.

GetFEM comes with the system, for the system's Python and numpy: `getfem_script` runs there, stays
alive from one run to the next, and answers requests line by line. Its clock runs around the scene
alone, so neither the start of the process nor its imports count.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from threading import Timer
from time import monotonic
from typing import IO, Any

from benchmarks.runs import Case, Outcome, peak
from xcrack.base.errors import XcrackError

VARIABLE = "XCRACK_GETFEM_PYTHON"
SCRIPT = Path(__file__).with_name("getfem_script.py")
# The last one is that of the ordering before a factorisation.
_ONE_THREAD = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "SCOTCH_PTHREAD_NUMBER",
)  # fmt: skip
_ADVICE = (
    f"Set {VARIABLE} to a Python in which `import getfem` works, or to `none` to leave GetFEM out."
)
# A file of a mesh is where its Python interface tells the version.
_PROBE = """
import os, tempfile, numpy, getfem
with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "mesh")
    getfem.Mesh("empty", 2).save(path)
    with open(path) as file:
        print("version", file.read().partition("VERSION")[2].split()[0])
"""


class GetfemError(XcrackError):
    """The process of GetFEM ended, gave no sense, or could not solve a scene."""


@dataclass(frozen=True)
class Getfem:
    """A Python that has GetFEM, and its version."""

    python: str
    version: str


class Worker:
    """A process that answers lines of JSON; started when asked, and anew when it has ended.

    Parameters
    ----------
    command : sequence of str
    patience : float
        Seconds that an answer may take.
    """

    def __init__(self, command: Sequence[str], patience: float = 600.0) -> None:
        self._command = tuple(command)
        self._patience = patience
        self._process: subprocess.Popen[str] | None = None
        self._notes: IO[bytes] | None = None
        self._end: Any = None

    def ask(self, request: Mapping[str, object]) -> dict[str, Any]:
        """The answer to a request.

        Parameters
        ----------
        request : mapping

        Returns
        -------
        dict

        Raises
        ------
        GetfemError
            If the process ends, is silent, gives no JSON, or says that it failed.
        """
        process = self._running()
        assert process.stdin is not None
        assert process.stdout is not None
        watch, start = Timer(self._patience, process.kill), monotonic()
        watch.start()
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except OSError:
            line = ""
        finally:
            watch.cancel()
        if not line:
            raise GetfemError(self._ended(process, monotonic() - start > self._patience))
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            self.stop()
            raise GetfemError(f"the process of GetFEM answered {line.strip()[:80]!r}. {_ADVICE}")
        if "failed" in answer:
            raise GetfemError(f"GetFEM could not solve this scene: {answer['failed']}")
        return answer

    def number(self) -> int:
        """Of the process."""
        return self._running().pid

    def stop(self) -> None:
        """End the process."""
        if self._end is not None:
            self._end()
        self._process = None

    def _running(self) -> "subprocess.Popen[str]":
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.stop()
        self._notes = tempfile.TemporaryFile()
        try:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._notes,
                text=True, env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
            )  # fmt: skip
        except OSError as error:
            self._notes.close()
            raise GetfemError(f"GetFEM could not be started: {error}. {_ADVICE}") from None
        self._end = weakref.finalize(self, _end, self._process, self._notes)
        return self._process

    def _ended(self, process: "subprocess.Popen[str]", late: bool) -> str:
        """The message for a process that has ended: how, and its last line."""
        code, words = process.wait(), ""
        if self._notes is not None:
            self._notes.seek(0)
            last = self._notes.read().decode(errors="replace").strip().splitlines()[-1:]
            words = "".join(f": {line}" for line in last)
        self.stop()
        if late:
            return f"the process of GetFEM gave no answer within {self._patience:g} s. {_ADVICE}"
        return f"the process of GetFEM ended ({code}{words}). {_ADVICE}"


def _end(process: "subprocess.Popen[str]", notes: IO[bytes]) -> None:
    """End a process that is done with, by the end of its input where it listens."""
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            try:
                stream.close()
            except OSError:
                pass
    try:
        process.wait(5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    notes.close()


def installed() -> Getfem | None:
    """The first Python that has GetFEM: that of the environment variable, else this, else python3.

    Returns
    -------
    Getfem or None
    """
    named = os.environ.get(VARIABLE)
    usual = (sys.executable, shutil.which("python3") or "", "/usr/bin/python3")
    return _first((named,) if named else usual)


@cache
def _first(candidates: tuple[str, ...]) -> Getfem | None:
    for python in dict.fromkeys(candidates):
        if not python:
            continue
        try:
            probe = subprocess.run(
                [python, "-c", _PROBE], capture_output=True, text=True, timeout=60, check=False
            )
        except (OSError, subprocess.SubprocessError):
            continue
        words = probe.stdout.split()
        if probe.returncode == 0 and words[-2:-1] == ["version"]:
            return Getfem(python, words[-1])
    return None


def missing() -> str:
    """Why GetFEM cannot run, in one line; empty where it can."""
    if installed() is not None:
        return ""
    return (
        "GetFEM is not installed: its XFEM is skipped, points measured before are drawn "
        "(apt-get install python3-getfem)."
    )


def cases(scene: str, sizes: Mapping[int, Sequence[int]]) -> list[Case]:
    """The curves of GetFEM's XFEM; none where it is missing.

    Parameters
    ----------
    scene : {"edge", "closed", "half_closed"}
    sizes : mapping of int to sequence of int
        Order of the rectangles to cells a side, which have to be odd.

    Returns
    -------
    list of Case
    """
    getfem = installed()
    if getfem is None:
        return []
    command = (getfem.python, str(SCRIPT))
    worker = Worker(command)
    return [
        Case(
            f"GetFEM XFEM, Q{order}", "baseline", f"n = {n}",
            partial(_run, worker, scene, n, order),
            memory=partial(_memory, command, scene, n, order),
        )
        for order, some in sizes.items()
        for n in some
    ]  # fmt: skip


def _run(worker: Worker, scene: str, n: int, order: int, seed: int) -> Outcome:
    answer = worker.ask({"scene": scene, "n": n, "order": order, "seed": seed})
    took = answer["wall"], answer["processor"]
    return Outcome(answer["errors"], answer["unknowns"], took=took)


def _memory(command: tuple[str, ...], scene: str, n: int, order: int) -> float:
    """Memory of a run in a fresh process, in which a small one has loaded what is loaded once."""
    worker = Worker(command)
    try:
        _run(worker, "edge" if scene == "edge" else "closed", 5, order, 1)
        return peak(lambda: _run(worker, scene, n, order, 1), worker.number())
    finally:
        worker.stop()
