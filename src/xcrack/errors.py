"""Errors and warnings of xcrack: each says what was wrong, where, and how to mend it."""

import sys
import warnings

# Frames of these are passed over when a warning looks for the line of the user that it is about.
_INSIDE = {"xcrack", "numpy", "scipy", "functools", "contextlib"}


class XcrackError(Exception):
    """Base of every error that xcrack raises on purpose."""


class MeshError(XcrackError):
    """A mesh that cannot be used: no cells, flat or doubled cells, nodes of nan, unknown sets."""


class GeometryError(XcrackError):
    """A crack that cannot be modelled: outside the body, of zero length, crossing itself."""


class ProblemError(XcrackError):
    """A scene that is not well posed: supports, loads, material or options that do not fit."""


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
