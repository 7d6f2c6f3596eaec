"""Run a case for many parameters, and keep what became of each."""

import contextlib
import hashlib
import json
import multiprocessing
import queue
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.checks import flag, value_text, whole_number
from xcrack.base.description import describe, differences
from xcrack.base.errors import ProblemError, XcrackError, warn
from xcrack.base.paths import path_of, system_errors, written_whole
from xcrack.runs.history import History
from xcrack.runs.lock import lock_folder

# One case of a campaign: run, and what became of it as a row that can be stored.

Parameters = Mapping[str, Any]

COLUMNS = ("error", "seconds")
"""Columns of the table of a study that no parameter and no result may be named like."""


def key_of(parameters: Parameters) -> str:
    """Name of a case: the same for the same parameters, whatever their order."""
    return hashlib.sha256(json.dumps(parameters, sort_keys=True).encode()).hexdigest()[:16]


def checked_case(parameters: Any, number: int) -> dict[str, Any]:
    """Parameters of a case as values that a file can hold.

    Raises
    ------
    ProblemError
        No mapping of names to finite numbers, texts, flags or None, or a name of `COLUMNS`.
    """
    if not isinstance(parameters, Mapping):
        raise ProblemError(
            f"campaign: cases[{number}] = {value_text(parameters)}: give a dict of the arguments "
            "of a case."
        )
    result: dict[str, Any] = {}
    for name, parameter in parameters.items():
        value = parameter.item() if isinstance(parameter, np.generic) else parameter
        if name in COLUMNS:
            raise ProblemError(
                f"campaign: cases[{number}] has a parameter {name!r}, which is a column of the "
                "table: give it another name."
            )
        is_valid = value is None or isinstance(value, bool | str)
        is_valid = is_valid or (isinstance(value, int | float) and bool(np.isfinite(value)))
        if not isinstance(name, str) or not is_valid:
            raise ProblemError(
                f"campaign: cases[{number}][{name!r:.40}] = {value_text(parameter)}: give names, "
                "and finite numbers, texts, True, False or None; make meshes and laws in the case."
            )
        result[name] = value
    return result


def run_case(case: Callable[..., Any], parameters: dict[str, Any]) -> dict[str, Any]:
    """Run one case; what it raises becomes part of its row.

    Returns
    -------
    dict
        parameters, result (numbers and texts by name), error, kind, trace, warnings, seconds of the
        processor.
    """
    begin = time.process_time()
    row: dict[str, Any] = {"parameters": parameters, "result": {}, "error": "", "kind": ""}
    row["trace"] = ""
    with warnings.catch_warnings(record=True) as caught_warnings:
        warnings.simplefilter("always")
        try:
            row["result"] = _numbers(case(**parameters), parameters)
        except XcrackError as error:
            row["error"], row["kind"] = str(error), type(error).__name__
        except Exception as error:
            row["error"], row["kind"] = str(error) or repr(error), type(error).__name__
            row["trace"] = traceback.format_exc()
    row["warnings"] = sorted({str(warning.message) for warning in caught_warnings})
    row["seconds"] = time.process_time() - begin
    return row


def _numbers(value: Any, parameters: Parameters) -> dict[str, Any]:
    """Result of a case: life and end of a history, or the numbers that the case returned."""
    if isinstance(value, History):
        last_index = value.steps[-1].index if value.steps else -1
        value = {"life": value.life, "steps": last_index + 1, "ended": value.ended}
    if isinstance(value, Mapping):
        result = {}
        for name, value_of_name in value.items():
            number = (
                value_of_name.item() if isinstance(value_of_name, np.generic) else value_of_name
            )
            if not isinstance(number, Real | str) or isinstance(number, complex):
                raise ProblemError(
                    f"campaign: a case returned {name!r:.40} = {value_text(value_of_name)}: give "
                    "numbers and texts."
                )
            if name in COLUMNS or (name in parameters and number != parameters[name]):
                raise ProblemError(
                    f"campaign: a case returned {str(name)!r:.40}, which is a parameter or a "
                    "column of the table: give the result another name."
                )
            result[str(name)] = number
        return result
    raise ProblemError(
        f"campaign: a case returned {value_text(value)}: give a History, or a dict of numbers."
    )


# What takes the cases of a campaign: this process, other ones, or a client beyond one machine.

_LOOK = 2.0  # seconds between two looks at whether a client still lives
_GONE = ("cancelled", "lost")  # status of a future of dask
_CLOSED = ("closed", "closing", "failed")


@dataclass(frozen=True, eq=False)
class Engine:
    """Something that takes calls.

    Attributes
    ----------
    submit : callable (function, *arguments) -> future
    client : optional
        Of the user, which may die.
    """

    submit: Callable[..., Any]
    client: Any = None

    @property
    def is_dask(self) -> bool:
        """Whether the client is one of dask.distributed."""
        return type(self.client).__module__.partition(".")[0] == "distributed"

    @property
    def is_closed(self) -> bool:
        """Whether the client says that it takes and gives nothing any more."""
        return str(getattr(self.client, "status", "")) in _CLOSED


class _Done:
    """Future of a call in this process."""

    def __init__(self, call: Callable[[], Any]) -> None:
        self._call = call

    def result(self) -> Any:
        return self._call()


@contextmanager
def engine_of(workers: int, client: Any) -> Iterator[Engine]:
    """Engine of this process, of other ones, or of a client.

    Parameters
    ----------
    workers : int
    client : anything with submit, or None
    """
    if client is not None:
        engine = Engine(client.submit, client)
        yield replace(engine, submit=_submit_of(client)) if engine.is_dask else engine
    elif workers == 1:
        yield Engine(lambda function, *arguments: _Done(partial(function, *arguments)))
    else:
        with _pool(workers) as engine:
            yield engine


@contextmanager
def _pool(workers: int) -> Iterator[Engine]:
    """Engine of other processes of this machine."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        yield Engine(pool.submit)


class WorkerDeathError(ProblemError):
    """A process that ran cases died."""


def _submit_of(client: Any) -> Callable[..., Any]:
    """How dask takes a call: a case is no pure function, whose answer it may use again."""
    with contextlib.suppress(Exception):
        threads = max(client.nthreads().values(), default=1)
        if threads > 1:
            warn(
                f"campaign: workers of this client have {threads} threads: gmsh and warnings "
                "belong to a process, so cases disturb each other. Give one thread a worker: "
                "LocalCluster(threads_per_worker=1), or dask worker --nthreads 1."
            )
    return partial(client.submit, pure=False)


def submit_case(engine: Engine, parameters: dict[str, Any], case: Callable[..., Any]) -> Any:
    """Future of a case.

    Raises
    ------
    ProblemError
        The engine takes none any more.
    """
    try:
        return engine.submit(run_case, case, parameters)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BrokenProcessPool as error:
        raise WorkerDeathError(_row_of_death(parameters)) from error
    except Exception as error:
        raise ProblemError(
            f"campaign: the client did not take the case {parameters} "
            f"({type(error).__name__}: {error}). Finished cases are stored: call again to go on."
        ) from error


def finished_names(engine: Engine, futures: Mapping[str, Any]) -> Iterator[str]:
    """Names of futures as they finish, where they can say so, else in their order.

    Raises
    ------
    ProblemError
        The client is closed before all have finished.
    """
    finished_queue: queue.SimpleQueue[str] = queue.SimpleQueue()
    has_callback = [
        callable(getattr(future, "add_done_callback", None)) for future in futures.values()
    ]
    if not has_callback or not all(has_callback):
        yield from futures
        return
    for key, future in futures.items():
        future.add_done_callback(lambda _, key=key: finished_queue.put(key))
    open_futures = set(futures)
    while open_futures:
        try:
            key = finished_queue.get(timeout=_LOOK)
        except queue.Empty:
            if engine.is_closed:
                raise ProblemError(
                    f"campaign: the client is closed, and {len(open_futures)} cases are not "
                    "finished. Finished cases are stored: call again with another client to go on."
                ) from None
            continue
        open_futures.discard(key)
        yield key


def answer_of(engine: Engine, future: Any, parameters: dict[str, Any]) -> Any:
    """Row of a case.

    Raises
    ------
    ProblemError
        Its worker died, or the client gives no answer.
    """
    if getattr(future, "status", "") in _GONE:  # a closed client would be waited for
        raise ProblemError(
            f"campaign: the client lost the case {parameters}, its scheduler or its workers are "
            "gone. Finished cases are stored: call again to go on."
        )
    try:
        return _await_answer(engine, future)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BrokenProcessPool as error:
        raise WorkerDeathError(_row_of_death(parameters)) from error
    except BaseException as error:  # futures of a client that is cancelled raise no Exception
        raise ProblemError(
            f"campaign: the client gave no answer for the case {parameters} "
            f"({type(error).__name__}: {error}). Finished cases are stored: call again to go on."
        ) from error


def _await_answer(engine: Engine, future: Any) -> Any:
    """Answer of a future; one of dask may say that it has one, whose scheduler then dies."""
    while engine.is_dask:
        try:
            return future.result(timeout=_LOOK)
        except TimeoutError:
            if engine.is_closed:
                raise
    return future.result()


def _row_of_death(parameters: dict[str, Any]) -> str:
    return (
        f"campaign: a worker died at or near the case {parameters} (killed, or out of memory). "
        "Finished cases are stored: call again to go on, with fewer workers if memory is short."
    )


def is_good(future: Any) -> bool:
    """Whether a future has its answer, and no error; False where it cannot say so at once."""
    if isinstance(future, Future):
        return future.done() and not future.cancelled() and future.exception() is None
    return getattr(future, "status", "") == "finished"


def call_off(future: Any) -> None:
    """Cancel a future, if it can be."""
    cancel = getattr(future, "cancel", None)
    if callable(cancel):
        with contextlib.suppress(Exception):  # its client may be dead
            cancel()


_HEADER = "study.json"
_ROW: dict[str, Any] = {
    "parameters": dict,
    "result": dict,
    "kind": str,
    "error": str,
    "seconds": (int, float),
}
_SHOWN, _LINE = 5, 200  # errors of a summary, and letters of each


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

    def __str__(self) -> str:
        n, words = len(self.rows), _failures(self.failed)
        head = f"{n} cases in {self.path}, {n - len(self.failed)} without error"
        return f"{head}\n{words}" if words else head

    __repr__ = __str__

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
        case, a folder that another process writes to, or a worker of a client that died: finished
        cases stay, and the same call goes on.

    Warns
    -----
    XcrackWarning
        Cases failed: how many, and the first error.

    Notes
    -----
    Errors in a case are rows, with their text; a run is never stopped by one. With several workers
    a case that kills its process is a row too, once it has done so alone. A folder belongs to the
    function that its good rows are from: where all have failed, they are run anew with a mended
    one. The first case is run alone, so that kernels are compiled once and not by each worker. A
    case is known by its parameters alone: options of xcrack that are added later change no name. A
    result with the name of a parameter and another value is an error of its case.
    """
    folder = path_of(path, "campaign: path", error=ProblemError)
    if not callable(case):
        raise ProblemError(
            f"campaign: case = {value_text(case)} cannot be called: give a function."
        )
    is_retry = flag(retry, "campaign: retry")
    case_list = _list_of(cases, "campaign: cases", "a list of dicts")
    count = whole_number(workers, "campaign: workers", least=1, most=1024)
    if client is not None and not callable(getattr(client, "submit", None)):
        raise ProblemError(
            f"campaign: client = {value_text(client)}: give one that has submit(...)."
        )
    cases_by_key = {key_of(p): p for p in (checked_case(c, n) for n, c in enumerate(case_list))}
    if not cases_by_key:
        raise ProblemError("campaign: cases is empty: give one, at least.")
    with system_errors("the study cannot be written to", folder, error=ProblemError):
        folder.mkdir(parents=True, exist_ok=True)
    with lock_folder(folder):
        _check_header(folder, case)
        stored_rows = {key: _read(folder, key) for key in cases_by_key}
        result_names = [
            key
            for key, row in stored_rows.items()
            if row is None or (is_retry and bool(row["kind"]))
        ]
        _run_through_deaths(folder, case, cases_by_key, result_names, count, client)
    study = Study(folder, tuple(_stored_case(folder, key) for key in cases_by_key))
    if study.failed:
        first = study.failed[0]
        warn(
            f"campaign: {len(study.failed)} of {len(study.rows)} cases failed, the first of them "
            f"{value_text(first['parameters'])} with {first['kind']}: "
            f"{_first_line(first['error'])} `failed` of the study has all; "
            "retry=True runs them again."
        )
    return study


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
        lists[name] = _list_of(values, f"grid: {name}", "a list of values")
    return [dict(zip(lists, combination)) for combination in product(*lists.values())]


def _list_of(values: Any, label: str, expectation: str) -> list[Any]:
    """Entries of whatever can be gone through, but for text and dicts."""
    if not isinstance(values, str | bytes | Mapping):
        try:
            return list(values)
        except TypeError:
            pass
    raise ProblemError(f"{label} = {value_text(values)}: give {expectation}.")


def _run_through_deaths(
    folder: Path,
    case: Callable[..., Any],
    cases: Mapping[str, dict[str, Any]],
    names: list[str],
    workers: int,
    client: Any,
) -> None:
    """Run the cases; one that kills its worker is a row, and the others go on in new workers.

    A pool does not say which case its process died of. It takes them in order, so that it is one of
    the first that have no answer: each of those is run in a process of its own.
    """
    remaining_names = list(names)
    while remaining_names:
        finished_keys: set[str] = set()
        try:
            with engine_of(workers, client) as engine:
                _run(folder, case, cases, remaining_names, engine, finished_keys)
            return
        except WorkerDeathError:
            if client is not None:
                raise
        remaining_names = [key for key in remaining_names if key not in finished_keys]
        suspects = remaining_names[: 2 * workers + 1]  # under way, and handed out
        for key in suspects:
            _run_alone(folder, case, key, cases[key])
        remaining_names = remaining_names[len(suspects) :]


def _run_alone(
    folder: Path, case: Callable[..., Any], key: str, parameters: dict[str, Any]
) -> None:
    """Run a case in a process of its own; that it dies is a row."""
    row: dict[str, Any] = {"parameters": parameters, "result": {}, "trace": "", "warnings": []}
    try:
        with _pool(1) as engine:
            row = answer_of(engine, submit_case(engine, parameters, case), parameters)
    except WorkerDeathError as error:
        row |= {"error": _DEATH, "kind": type(error).__name__, "seconds": 0.0}
    _store(folder, key, row)


_DEATH = (
    "the process that ran this case died twice, the second time with this case alone: it was "
    "killed, out of memory, or ended by a fault in compiled code. Run it by itself to see, or "
    "again with retry=True."
)


def _run(
    folder: Path,
    case: Callable[..., Any],
    cases: Mapping[str, dict[str, Any]],
    names: list[str],
    engine: Engine,
    finished_keys: set[str],
) -> None:
    """Run the cases; each is stored as soon as it is finished, in whatever order."""
    first, remaining_names = names[0], names[1:]
    _finish(engine, folder, first, cases[first], submit_case(engine, cases[first], case))
    finished_keys.add(first)
    futures: dict[str, Any] = {}
    try:
        for key in remaining_names:
            futures[key] = submit_case(engine, cases[key], case)
        for key in finished_names(engine, futures):
            _finish(engine, folder, key, cases[key], futures[key])
            finished_keys.add(key)
    except BaseException:
        _store_finished(folder, cases, engine, futures, finished_keys)
        raise


def _store_finished(
    folder: Path,
    cases: Mapping[str, dict[str, Any]],
    engine: Engine,
    futures: Mapping[str, Any],
    finished_keys: set[str],
) -> None:
    """Store what has been finished when a study is broken off, and call off the rest."""
    if engine.is_closed:  # it would wait for an answer that never comes
        return
    for key, future in futures.items():
        if is_good(future) and key not in finished_keys:
            _finish(engine, folder, key, cases[key], future)
            finished_keys.add(key)
        call_off(future)


def _finish(
    engine: Engine, folder: Path, key: str, parameters: dict[str, Any], future: Any
) -> None:
    _store(folder, key, answer_of(engine, future, parameters))


def _store(folder: Path, key: str, row: Mapping[str, Any]) -> None:
    with written_whole(
        _file(folder, key), "a row cannot be written to", error=ProblemError
    ) as part:
        part.write_text(json.dumps(row, indent=1, allow_nan=True), encoding="utf-8")


def _check_header(folder: Path, case: Callable[..., Any]) -> None:
    """Write what the case is, or refuse a folder of another one."""
    lines, header = describe("case", case), folder / _HEADER
    if header.exists():
        with system_errors("the study cannot be read from", header, error=ProblemError):
            data = header.read_bytes()
        try:
            stored_lines = json.loads(data)["case"]
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise ProblemError(f"{header} is no header of a study: take another folder.") from error
        changes = differences(stored_lines, lines)
        rows = list(folder.glob("row_*.json"))
        if changes and not any(_is_good_row(file) for file in rows):
            with system_errors("the study cannot be written to", folder, error=ProblemError):
                for file in rows:  # failures of another function
                    file.unlink()
            _write_header(header, lines)
        elif changes:
            raise ProblemError(
                f"{folder} holds a study of another case: take another folder.\n- "
                + "\n- ".join(changes)
            )
        return
    _write_header(header, lines)


def _write_header(header: Path, lines: Mapping[str, str]) -> None:
    with written_whole(header, "the study cannot be written to", error=ProblemError) as part:
        part.write_text(json.dumps({"case": lines}, indent=1), encoding="utf-8")


def _file(folder: Path, key: str) -> Path:
    return folder / f"row_{key}.json"


def _read(folder: Path, key: str) -> dict[str, Any] | None:
    """A stored row; None where there is none, or it is damaged."""
    return _row_of(_file(folder, key))


def _row_of(file: Path) -> dict[str, Any] | None:
    if not file.exists():
        return None
    try:
        row = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(row, dict):
        return None
    whole_row = all(isinstance(row.get(name), kind) for name, kind in _ROW.items())
    return row if whole_row else None


def _is_good_row(file: Path) -> bool:
    row = _row_of(file)
    return row is not None and not row["kind"]


def _failures(rows: Iterable[Mapping[str, Any]]) -> str:
    """Errors of cases by their kind, the most frequent ones first; empty where there are none."""
    count = Counter((row["kind"], _first_line(row["error"])) for row in rows)
    lines = [f"{n} failed with {kind}: {text}" for (kind, text), n in count.most_common(_SHOWN)]
    n_left = len(count) - len(lines)
    return "\n".join([*lines, *([f"and {n_left} other errors"] if n_left > 0 else [])])


def _first_line(text: str) -> str:
    line = text.strip().partition("\n")[0]
    return line if len(line) <= _LINE else f"{line[:_LINE]} ..."


def _stored_case(folder: Path, key: str) -> dict[str, Any]:
    row = _read(folder, key)
    if row is None:
        raise ProblemError(f"{_file(folder, key)} has gone while the study was running.")
    return row


def _column(values: list[Any]) -> NDArray[Any]:
    """Values of one name, None where a case has none."""
    if all(value is None or (isinstance(value, int | float)) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(["" if value is None else str(value) for value in values])


__all__ = [
    "COLUMNS",
    "Engine",
    "Parameters",
    "Study",
    "answer_of",
    "call_off",
    "campaign",
    "checked_case",
    "engine_of",
    "finished_names",
    "grid",
    "is_good",
    "key_of",
    "run_case",
    "submit_case",
]
