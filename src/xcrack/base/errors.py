"""Errors and warnings of xcrack: each says what was wrong, where, and how to mend it."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# Frames of these are passed over when a warning looks for the line of the user that it is about.
_INSIDE = {"xcrack", "numpy", "scipy", "functools", "contextlib"}

# Where messages of `warn` go within `collected_warnings`: of each thread its own.
_collecting: ContextVar[list[str] | None] = ContextVar("collecting", default=None)


class XcrackError(Exception):
    """Base of every error that xcrack raises on purpose."""


class MeshError(XcrackError):
    """A mesh that cannot be used: no cells, flat or doubled cells, nodes of nan, unknown sets."""


class GeometryError(XcrackError):
    """A crack that cannot be modelled: outside the body, of zero length, crossing itself."""


class CoarseMeshError(GeometryError):
    """A crack that the mesh is too coarse for: a finer one, as `adapt` makes it, may hold it."""


class ProblemError(XcrackError):
    """A scene that is not well posed: supports, loads, material or options that do not fit."""


class SizeError(ProblemError):
    """A scene that needs more memory than is free."""


class ConvergenceError(XcrackError):
    """An iteration that did not end: the message carries the residual and the state reached."""


class XcrackWarning(UserWarning):
    """The result stands, but with less accuracy or another meaning than the user may expect."""


def warn(message: str) -> None:
    """Issue an XcrackWarning at the line of the user's code that led to it.

    Parameters
    ----------
    message : str
        What is wrong, where, and how to mend it.
    """
    messages = _collecting.get()
    if messages is not None:
        messages.append(message)
        return
    level = 2  # the caller of this function
    while True:
        try:
            frame = sys._getframe(level - 1)
        except ValueError:  # all frames are inside, as for a call from a thread of ours
            break
        if frame.f_globals.get("__name__", "").partition(".")[0] not in _INSIDE:
            break
        level += 1
    warnings.warn(message, XcrackWarning, stacklevel=level)


@contextmanager
def collected_warnings(messages: list[str]) -> Iterator[None]:
    """Append the messages of `warn` to a list instead of issuing them, within a `with` block.

    Warnings of others, and the filters of the user, stay as they are.
    """
    token = _collecting.set(messages)
    try:
        yield
    finally:
        _collecting.reset(token)
