"""What takes the cases of a campaign: this process, other ones, or a client beyond one machine."""

import contextlib
import multiprocessing
import queue
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from xcrack.campaigns.row import run_case
from xcrack.errors import ProblemError, warn

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
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context) as pool:
            yield Engine(pool.submit)


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


def submitted(engine: Engine, parameters: dict[str, Any], case: Callable[..., Any]) -> Any:
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
        raise ProblemError(_died(parameters)) from error
    except Exception as error:
        raise ProblemError(
            f"campaign: the client did not take the case {parameters} "
            f"({type(error).__name__}: {error}). Finished cases are stored: call again to go on."
        ) from error


def finished(engine: Engine, futures: Mapping[str, Any]) -> Iterator[str]:
    """Names of futures as they finish, where they can say so, else in their order.

    Raises
    ------
    ProblemError
        The client is closed before all have finished.
    """
    done: queue.SimpleQueue[str] = queue.SimpleQueue()
    tells = [callable(getattr(future, "add_done_callback", None)) for future in futures.values()]
    if not tells or not all(tells):
        yield from futures
        return
    for key, future in futures.items():
        future.add_done_callback(lambda _, key=key: done.put(key))
    left = set(futures)
    while left:
        try:
            key = done.get(timeout=_LOOK)
        except queue.Empty:
            if engine.is_closed:
                raise ProblemError(
                    f"campaign: the client is closed, and {len(left)} cases are not finished. "
                    "Finished cases are stored: call again with another client to go on."
                ) from None
            continue
        left.discard(key)
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
        return _awaited(engine, future)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BrokenProcessPool as error:
        raise ProblemError(_died(parameters)) from error
    except BaseException as error:  # futures of a client that is cancelled raise no Exception
        raise ProblemError(
            f"campaign: the client gave no answer for the case {parameters} "
            f"({type(error).__name__}: {error}). Finished cases are stored: call again to go on."
        ) from error


def _awaited(engine: Engine, future: Any) -> Any:
    """Answer of a future; one of dask may say that it has one, whose scheduler then dies."""
    while engine.is_dask:
        try:
            return future.result(timeout=_LOOK)
        except TimeoutError:
            if engine.is_closed:
                raise
    return future.result()


def _died(parameters: dict[str, Any]) -> str:
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


__all__ = ["Engine", "answer_of", "call_off", "engine_of", "finished", "is_good", "submitted"]
