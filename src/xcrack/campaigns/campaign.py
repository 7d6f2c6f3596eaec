"""Run a case for many parameters, and keep what became of each."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.campaigns.engine import (
    Engine,
    answer_of,
    call_off,
    engine_of,
    finished,
    is_good,
    submitted,
)
from xcrack.campaigns.row import COLUMNS, checked, key_of
from xcrack.errors import ProblemError
from xcrack.growth.steps.fingerprint import describe, differences
from xcrack.history.lock import locked
from xcrack.inputs import flag, shown, whole
from xcrack.paths import path_of, system_errors, written_whole

_HEADER = "study.json"


@dataclass(frozen=True, eq=False)
class Study:
    """What became of the cases of a campaign.

    Attributes
    ----------
    path : Path
    rows : tuple of dict
        In the order of the cases: parameters, result, error (empty where all went well), kind of
        the error, trace (of errors that are not xcrack's), warnings, seconds of the processor.
    """

    path: Path
    rows: tuple[dict[str, Any], ...]

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """Rows of the cases that raised an error."""
        return tuple(row for row in self.rows if row["kind"])

    def table(self) -> NDArray[Any]:
        """One row a case: parameters, results, error and seconds; numbers are nan where none is."""
        names: dict[str, list[Any]] = {}
        for n, row in enumerate(self.rows):
            values = {**row["parameters"], **row["result"]}
            values |= {name: row[name] for name in COLUMNS}
            for name, value in values.items():
                names.setdefault(name, [None] * len(self.rows))[n] = value
        columns = {name: _column(values) for name, values in names.items()}
        kinds = [(name, column.dtype) for name, column in columns.items()]
        result = np.empty(len(self.rows), dtype=kinds)
        for name, column in columns.items():
            result[name] = column
        return result


def campaign(
    case: Callable[..., Any],
    cases: Iterable[Mapping[str, Any]],
    *,
    path: str | Path,
    workers: int = 1,
    client: Any = None,
    retry: bool = False,
) -> Study:
    """Run a case for many parameters; begin a study or go on with one.

    Parameters
    ----------
    case : callable
        Takes the parameters of one case by name and returns a History or a dict of numbers and
        texts. With several workers a function of a module, not one of a notebook, and the script
        that calls guarded by ``if __name__ == "__main__":``.
    cases : iterable of dict
        Parameters: finite numbers, texts, flags; see `grid`.
    path : path
        Folder of the study. Each finished case is a file there before the next one is counted.
    workers : int
        Processes of this machine; 1: all in this one.
    client : optional
        Instead of workers, anything with ``submit(function, *arguments)`` that returns futures with
        ``result()``: an executor, or a ``distributed.Client`` of one thread a worker for many
        machines.
    retry : bool
        Run those again that failed.

    Returns
    -------
    Study

    Raises
    ------
    ProblemError
        Cases that a file cannot hold, a parameter called error or seconds, a folder of another
        case, a folder that another process writes to, or a worker that died: finished cases stay,
        and the same call goes on.

    Notes
    -----
    Errors in a case are rows, with their text; a run is never stopped by one. The first case is run
    alone, so that kernels are compiled once and not by each worker. A case is known by its
    parameters alone: options of xcrack that are added later change no name. A result with the name
    of a parameter and another value is an error of its case.
    """
    folder = path_of(path, "campaign: path", error=ProblemError)
    if not callable(case):
        raise ProblemError(f"campaign: case = {shown(case)} cannot be called: give a function.")
    again = flag(retry, "campaign: retry")
    listed = _listed(cases, "campaign: cases", "a list of dicts")
    count = whole(workers, "campaign: workers", least=1, most=1024)
    if client is not None and not callable(getattr(client, "submit", None)):
        raise ProblemError(f"campaign: client = {shown(client)}: give one that has submit(...).")
    every = {key_of(each): each for each in (checked(c, n) for n, c in enumerate(listed))}
    if not every:
        raise ProblemError("campaign: cases is empty: give one, at least.")
    with system_errors("the study cannot be written to", folder, error=ProblemError):
        folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        _check_header(folder, case)
        stored = {key: _read(folder, key) for key in every}
        wanted = [
            key for key, row in stored.items() if row is None or (again and bool(row["kind"]))
        ]
        with engine_of(count, client) as engine:
            _run(folder, case, every, wanted, engine)
    return Study(folder, tuple(_stored(folder, key) for key in every))


def grid(**parameters: Iterable[Any]) -> list[dict[str, Any]]:
    """All combinations of some values.

    Parameters
    ----------
    **parameters
        Values of each parameter.

    Returns
    -------
    list of dict

    Raises
    ------
    ProblemError
        A parameter that is no list.

    Examples
    --------
    >>> grid(a=[5, 6], load=[0.8, 1.0])[1]
    {'a': 5, 'load': 1.0}
    """
    lists = {}
    for name, values in parameters.items():
        lists[name] = _listed(values, f"grid: {name}", "a list of values")
    return [dict(zip(lists, each)) for each in product(*lists.values())]


def _listed(values: Any, what: str, wanted: str) -> list[Any]:
    """Entries of whatever can be gone through, but for text and dicts."""
    if not isinstance(values, str | bytes | Mapping):
        try:
            return list(values)
        except TypeError:
            pass
    raise ProblemError(f"{what} = {shown(values)}: give {wanted}.")


def _run(
    folder: Path,
    case: Callable[..., Any],
    every: Mapping[str, dict[str, Any]],
    wanted: list[str],
    engine: Engine,
) -> None:
    """Run the cases; each is stored as soon as it is finished, in whatever order."""
    if not wanted:
        return
    first, rest = wanted[0], wanted[1:]
    _finish(engine, folder, first, every[first], submitted(engine, every[first], case))
    futures: dict[str, Any] = {}
    try:
        for key in rest:
            futures[key] = submitted(engine, every[key], case)
        for key in finished(engine, futures):
            _finish(engine, folder, key, every[key], futures[key])
    except BaseException:
        _harvest(folder, every, engine, futures)
        raise


def _harvest(
    folder: Path, every: Mapping[str, dict[str, Any]], engine: Engine, futures: Mapping[str, Any]
) -> None:
    """Store what has been finished when a study is broken off, and call off the rest."""
    if engine.is_closed:  # it would wait for an answer that never comes
        return
    for key, future in futures.items():
        if is_good(future) and _read(folder, key) is None:
            _finish(engine, folder, key, every[key], future)
        call_off(future)


def _finish(
    engine: Engine, folder: Path, key: str, parameters: dict[str, Any], future: Any
) -> None:
    row = answer_of(engine, future, parameters)
    with written_whole(
        _file(folder, key), "a row cannot be written to", error=ProblemError
    ) as part:
        part.write_text(json.dumps(row, indent=1, allow_nan=True), encoding="utf-8")


def _check_header(folder: Path, case: Callable[..., Any]) -> None:
    """Write what the case is, or refuse a folder of another one."""
    given, file = describe("case", case), folder / _HEADER
    if file.exists():
        with system_errors("the study cannot be read from", file, error=ProblemError):
            text = file.read_text(encoding="utf-8")
        try:
            stored = json.loads(text)["case"]
        except (ValueError, KeyError, TypeError) as error:
            raise ProblemError(f"{file} is no header of a study: take another folder.") from error
        changed = differences(stored, given)
        if changed:
            raise ProblemError(
                f"{folder} holds a study of another case: take another folder.\n- "
                + "\n- ".join(changed)
            )
        return
    with written_whole(file, "the study cannot be written to", error=ProblemError) as part:
        part.write_text(json.dumps({"case": given}, indent=1), encoding="utf-8")


def _file(folder: Path, key: str) -> Path:
    return folder / f"row_{key}.json"


def _read(folder: Path, key: str) -> dict[str, Any] | None:
    """A stored row; None where there is none, or it is damaged."""
    file = _file(folder, key)
    if not file.exists():
        return None
    try:
        row = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    whole_row = isinstance(row, dict) and {"parameters", "result", "kind", "seconds"} <= set(row)
    return row if whole_row else None


def _stored(folder: Path, key: str) -> dict[str, Any]:
    row = _read(folder, key)
    if row is None:
        raise ProblemError(f"{_file(folder, key)} has gone while the study was running.")
    return row


def _column(values: list[Any]) -> NDArray[Any]:
    """Values of one name, None where a case has none."""
    if all(value is None or (isinstance(value, int | float)) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(["" if value is None else str(value) for value in values])


__all__ = ["Study", "campaign", "grid"]
