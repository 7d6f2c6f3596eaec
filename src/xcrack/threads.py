"""Threads: BLAS within our own loops has one, so that sums have the same order everywhere."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@cache
def _libraries() -> Any:
    import scipy.linalg  # noqa: F401 - so that its BLAS is among those that are found
    import threadpoolctl

    return threadpoolctl.ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """BLAS with one thread, and afterwards with as many as before: the same bits everywhere."""
    with _libraries().limit(limits=1, user_api="blas"):
        yield
