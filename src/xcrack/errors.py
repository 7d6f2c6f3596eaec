"""Errors and warnings of xcrack: each says what was wrong, where, and how to mend it."""


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
