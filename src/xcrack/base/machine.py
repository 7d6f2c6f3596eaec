"""What the machine gives: threads, loops whose tasks run beside one another, and memory.

Kernels release Python's lock, so plain threads of Python run them side by side. A pool lives only
as long as one solve: nothing is left that a fork could break, and several threads of the user may
solve at once. Every task does the same whoever runs it, and results are taken in the order of the
tasks: results have the same bits for any number of threads. BLAS within our own loops has one
thread for the same reason.
"""

import ctypes
import os
import platform
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from threading import Lock
from typing import TypeVar

from xcrack.base.errors import ProblemError

Task = TypeVar("Task")
Result = TypeVar("Result")

_MOST = 16  # threads where nobody asked for more: products are bound by memory before
_QUOTA = Path("/sys/fs/cgroup/cpu.max")
_MEMORY = Path("/proc/meminfo")
_FREE = "MemAvailable:"

_pool: ContextVar[ThreadPoolExecutor | None] = ContextVar("xcrack threads", default=None)


def available_processors() -> int:
    """Processors that this process may use, by affinity and quota, at most 16.

    The environment variable XCRACK_THREADS takes precedence.

    Raises
    ------
    ProblemError
        XCRACK_THREADS is not a whole number above 0.
    """
    requested_number = os.environ.get("XCRACK_THREADS")
    if requested_number is not None:
        if not (
            requested_number.isascii() and requested_number.isdigit() and int(requested_number) > 0
        ):
            raise ProblemError(
                f"XCRACK_THREADS = {requested_number!r} in the environment: give a whole number "
                f"above 0."
            )
        return int(requested_number)
    try:
        count = len(os.sched_getaffinity(0))
    except AttributeError:  # not on this system
        count = os.cpu_count() or 1
    return max(1, min(count, _quota(), _MOST))


def _quota() -> int:
    """Processors that the control group of this process grants."""
    try:
        limit, period = _QUOTA.read_text().split()[:2]
        return max(1, -(-int(limit) // int(period)))
    except (OSError, ValueError):  # no such file, or "max"
        return _MOST


@contextmanager
def threads(count: int | None) -> Iterator[int]:
    """Let `map_tasks` use a number of threads within the block; None: as many as are available.

    Parameters
    ----------
    count : int, optional
    """
    number = available_processors() if count is None else count
    if number == 1 or _pool.get() is not None:
        yield number
        return
    with ThreadPoolExecutor(number, thread_name_prefix="xcrack") as pool:
        token = _pool.set(pool)
        try:
            yield number
        finally:
            _pool.reset(token)


def number_of_threads() -> int:
    """Threads that `map_tasks` would use here."""
    pool = _pool.get()
    return 1 if pool is None else int(pool._max_workers)


def map_tasks(function: Callable[[Task], Result], tasks: Iterable[Task]) -> list[Result]:
    """Results of a function for tasks, in their order; tasks must not depend on each other.

    Parameters
    ----------
    function : callable
        Spends its time where Python's lock is released.
    tasks : iterable
    """
    pool, all_tasks = _pool.get(), list(tasks)
    if pool is None or len(all_tasks) < 2:  # to hand over one alone only takes time
        return [function(task) for task in all_tasks]
    return list(pool.map(function, all_tasks))


def stream_tasks(function: Callable[[Task], Result], tasks: Iterable[Task]) -> Iterator[Result]:
    """Results of `map_tasks` one by one, while later ones are made: at most two a thread wait.

    What takes them, say the sum of chunks, runs beside the tasks, and memory is bounded.
    """
    pool = _pool.get()
    if pool is None:
        yield from map(function, tasks)
        return
    pending_tasks: deque[Future[Result]] = deque()
    for task in tasks:
        pending_tasks.append(pool.submit(function, task))
        if len(pending_tasks) > number_of_threads():
            yield pending_tasks.popleft().result()
    while pending_tasks:
        yield pending_tasks.popleft().result()


class _Blas:
    """Numbers of threads of the libraries of BLAS, one while anybody needs it."""

    def __init__(self) -> None:
        import scipy.linalg  # noqa: F401 - so that its BLAS is among those that are found
        import threadpoolctl

        blas_controller = threadpoolctl.ThreadpoolController().select(user_api="blas")
        self.libraries = blas_controller.lib_controllers
        self.lock, self.users = Lock(), 0
        self.counts_before: list[int | None] = []

    def enter(self) -> None:
        with self.lock:
            if self.users == 0:
                self.counts_before = [library.get_num_threads() for library in self.libraries]
                self._set(1, self.counts_before)
            self.users += 1

    def leave(self) -> None:
        with self.lock:
            self.users -= 1
            if self.users == 0:
                self._set(None, self.counts_before)

    def _set(self, target_number: int | None, numbers_before: Sequence[int | None]) -> None:
        """Let libraries that had other numbers of threads use a number, or what they had."""
        for library, number in zip(self.libraries, numbers_before):
            if number is None or number == 1:
                continue
            # threadpoolctl lets one thread alone change the number, to settle what is settled
            # here: it is this process' own, and the last to leave may not be the first to enter.
            change = getattr(library, "_real_set_num_threads", library.set_num_threads)
            change(number if target_number is None else target_number)


_blas = cache(_Blas)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """BLAS with one thread, and afterwards with as many as before: the same bits everywhere.

    The number belongs to the whole process: it is restored when the last of several threads of the
    user that solve at once has left.
    """
    blas = _blas()
    blas.enter()
    try:
        yield
    finally:
        blas.leave()


def free_memory() -> float | None:
    """Bytes that a process may still take before the system swaps; None where it does not say so.

    Linux says it. Others have no number that counts what caches would give back.
    """
    try:
        lines = _MEMORY.read_text(encoding="ascii", errors="replace").splitlines()
        row = next(line.split() for line in lines if line.startswith(_FREE))
        return 1024.0 * int(row[1])
    except (OSError, StopIteration, ValueError, IndexError):
        return None


# --- all that the last bit of a result depends on beside the settings of a run ---


_PACKAGES = ("xcrack", "numpy", "scipy", "numba")
# Extension modules that are linked with a BLAS, and what its functions may be called there.
_LINKED = ("numpy._core._multiarray_umath", "numpy.linalg._umath_linalg", "scipy.linalg._fblas")
_PREFIXES, _SUFFIXES = ("scipy_", ""), ("64_", "", "_64")


def versions() -> dict[str, str]:
    """Versions of python and of packages, and what the BLAS runs on.

    Sums that a BLAS shares out over other numbers of threads, or does with the instructions of
    another processor, are rounded in another order.
    """
    result = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            result[name] = version(name)
        except PackageNotFoundError:
            result[name] = "unknown"
    return {**result, "processor": _processor(), "BLAS threads": _threads()}


def _threads() -> str:
    """Number of threads of each BLAS that is loaded; what the environment asks for if none says."""
    counts = [_ask_library(module, "get_num_threads", ctypes.c_int) for module in _LINKED]
    numbers = dict.fromkeys(str(count) for count in counts if count is not None)
    if numbers:
        return ", ".join(numbers)
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        if os.environ.get(name):
            return os.environ[name]
    return str(os.cpu_count())


def _processor() -> str:
    """Kind of processor as the BLAS sees it, else as the system does."""
    names = (_ask_library(module, "get_corename", ctypes.c_char_p) for module in _LINKED)
    core_names = [name.decode(errors="replace") for name in names if isinstance(name, bytes)]
    return " ".join([platform.machine(), *dict.fromkeys(core_names)])


def _ask_library(module: str, function: str, kind: type) -> object:
    """What a function of OpenBLAS returns; None where the module knows none of that name."""
    try:
        library = ctypes.CDLL(import_module(module).__file__)
    except (ImportError, OSError, TypeError):
        return None
    for prefix in _PREFIXES:
        for suffix in _SUFFIXES:
            call = getattr(library, f"{prefix}openblas_{function}{suffix}", None)
            if call is not None:
                call.restype, call.argtypes = kind, []
                return call()
    return None


__all__ = [
    "available_processors",
    "free_memory",
    "map_tasks",
    "number_of_threads",
    "one_blas_thread",
    "threads",
    "versions",
]
