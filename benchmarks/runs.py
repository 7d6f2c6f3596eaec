"""Interleaved runs of cases, their medians, and the file they are saved in."""

import ctypes
import gc
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any

from xcrack.base.errors import XcrackError

Row = dict[str, Any]
_PACKAGES = ("xcrack", "numpy", "scipy", "numba", "gmsh", "scikit-fem", "pyamg", "matplotlib")
_SOURCES = ("src", "benchmarks/*.py")


@dataclass(frozen=True)
class Outcome:
    """What one run of a case gave.

    Attributes
    ----------
    errors : dict
        Relative errors by name; the first one is charted.
    unknowns : int
    parts : dict
        Seconds of parts that the scene times itself.
    later : callable () -> dict, optional
        Further errors, whose evaluation is no part of the work: called when the clock has stopped.
    took : (float, float), optional
        Wall and processor time of a run that took place in another process.
    """

    errors: dict[str, float]
    unknowns: int
    parts: dict[str, float] = field(default_factory=dict)
    later: Callable[[], dict[str, float]] | None = None
    took: tuple[float, float] | None = None


Timed = tuple[Outcome, float, float]  # with wall and processor time


@dataclass(frozen=True)
class Case:
    """One point of a chart.

    Attributes
    ----------
    series : str
        Name of the curve that the point belongs to.
    kind : {"default", "setting", "mesh", "steps", "baseline", "off"}
        Default settings of xcrack, others, another kind of mesh, other steps of growth, another
        method or program, without contact.
    size : str
        What the point differs by from others of its series.
    run : callable (seed) -> Outcome
        What is timed; the `later` errors of the outcome are not.
    prepare : callable (), optional
        What goes before and is not timed, such as a mesh that all cases share.
    memory : callable () -> float, optional
        Memory in MB that a run adds, for runs that take place in another process.
    """

    series: str
    kind: str
    size: str
    run: Callable[[int], Outcome]
    prepare: Callable[[], object] | None = None
    memory: Callable[[], float] | None = None


def measure(cases: Sequence[Case], repeats: int, report: Callable[[str], None]) -> list[Row]:
    """Rows of all cases: worst errors, medians of times.

    Every round runs each case once, so that transient load on the machine affects all cases
    equally; each round has meshes of its own. A round before the first compiles and fills caches.

    Parameters
    ----------
    cases : sequence of Case
    repeats : int
        Rounds that count.
    report : callable (str)
        Called with a message for each case that cannot run.

    Returns
    -------
    list of dict
    """
    results: dict[int, list[Timed]] = {i: [] for i in range(len(cases))}
    for seed in range(repeats + 1):
        for i in list(results):
            try:
                outcome = timed(cases[i], seed)
            except Exception as error:
                report(f"{cases[i].series}, {cases[i].size}: {type(error).__name__}: {error}")
                del results[i]
                continue
            if seed:
                results[i].append(outcome)
    rows = [_row(cases[i], some) for i, some in results.items()]
    return [{**row, "MB": memory(cases[i])} for i, row in zip(results, rows)]


def timed(case: Case, seed: int) -> Timed:
    """Outcome of a case with all of its errors, wall and processor time of the run alone.

    Parameters
    ----------
    case : Case
    seed : int
        Of the mesh.

    Returns
    -------
    Outcome, float, float
    """
    if case.prepare is not None:
        case.prepare()
    wall, processor = perf_counter(), process_time()
    outcome = case.run(seed)
    wall, processor = perf_counter() - wall, process_time() - processor
    if outcome.took is not None:
        wall, processor = outcome.took
    if outcome.later is not None:  # it has the solution: let go of it
        outcome = replace(outcome, errors={**outcome.errors, **outcome.later()}, later=None)
    return outcome, wall, processor


def memory(case: Case) -> float | None:
    """Memory in MB that a run adds at its peak (Linux; elsewhere, or if it fails, None).

    Parameters
    ----------
    case : Case

    Returns
    -------
    float or None
    """
    try:
        if case.memory is not None:
            return case.memory()
        if case.prepare is not None:
            case.prepare()
        gc.collect()
        ctypes.CDLL("libc.so.6").malloc_trim(0)  # or a run would find free memory of the last one
        return peak(lambda: case.run(1))
    except (OSError, AttributeError, XcrackError):
        return None


def peak(run: Callable[[], object], process: int | None = None) -> float:
    """Memory in MB that a process has at the peak of a run above what it had before (Linux).

    Parameters
    ----------
    run : callable ()
    process : int, optional
        Its number; this process where left out.

    Returns
    -------
    float
    """
    account = Path("/proc") / ("self" if process is None else str(process))

    def resident(name: str) -> float:
        lines = (account / "status").read_text(encoding="utf-8").splitlines()
        return next(float(x.split()[1]) for x in lines if x.startswith(name)) / 1024

    (account / "clear_refs").write_text("5", encoding="ascii")  # the peak starts anew
    before = resident("VmRSS")
    run()
    return max(resident("VmHWM") - before, 0.0)


def _row(case: Case, results: Sequence[Timed]) -> Row:
    outcomes = [outcome for outcome, _, _ in results]
    names = sorted({n for o in outcomes for n in o.errors}, key=list(outcomes[0].errors).index)
    return {
        "series": case.series,
        "kind": case.kind,
        "size": case.size,
        "errors": {n: max(o.errors[n] for o in outcomes) for n in names},
        "unknowns": outcomes[0].unknowns,
        "wall": median(w for _, w, _ in results),
        "processor": median(p for _, _, p in results),
        "parts": {n: median(o.parts[n] for o in outcomes) for n in outcomes[0].parts},
    }


def machine() -> dict[str, Any]:
    """What the numbers depend on: machine, load, versions, commit."""
    versions: dict[str, str | None] = {}
    for name in _PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = None
    load = list(os.getloadavg()) if hasattr(os, "getloadavg") else []
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "threads": os.environ.get("OMP_NUM_THREADS"),
        "system": platform.platform(),
        "python": sys.version.split()[0],
        "load": load,
        "versions": versions,
        "commit": _commit(),
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((x.split(":")[1].strip() for x in lines if x.startswith("model name")), "")


def _commit() -> str:
    """The commit of the sources, marked where they differ from it; empty without git."""
    root = Path(__file__).resolve().parent.parent
    try:
        head, changes = (
            subprocess.run(
                ["git", *words], cwd=root, capture_output=True, text=True, check=True, timeout=20
            ).stdout.strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", *_SOURCES])
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return f"{head} with changes" if changes else head


def clock(record: dict[str, Any]) -> str:
    """The time to compare by: wall, or processor where others load the machine.

    All runs keep to one thread, so on an idle machine the two are the same.

    Parameters
    ----------
    record : dict
        As `machine` returns it.

    Returns
    -------
    {"wall", "processor"}
    """
    return "processor" if record["load"] and record["load"][0] > 1.5 else "wall"


def save(folder: Path, scene: str, record: Row) -> Path:
    """Write the record of a scene to `folder/scene.json`."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{scene}.json"
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return path
