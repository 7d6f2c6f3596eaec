"""Warnings name the line of the user's code."""

import functools
import warnings

import numpy as np
import pytest

from xcrack import XcrackWarning
from xcrack.base.errors import warn


def inner(function):
    """A function as if it stood in xcrack."""
    names = {"__name__": "xcrack.some.module", "function": function}
    exec("def call(*rest):\n    return function(*rest)", names)
    return names["call"]


def line_of_warning(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    (warning,) = caught
    assert warning.category is XcrackWarning
    return warning.filename


def test_at_once_and_through_layers():
    layered = inner(inner(inner(lambda: None)))
    assert layered() is None
    assert line_of_warning(lambda: warn("mind")) == __file__
    assert line_of_warning(inner(warn_of("mind"))) == __file__


def warn_of(message):
    """`warn` called from a frame of xcrack."""
    names = {"__name__": "xcrack.deep", "warn": warn}
    exec(f"def call():\n    warn({message!r})", names)
    return names["call"]


def test_through_numpy_and_functools():
    deep = functools.partial(inner(lambda x: warn_of("mind")() or x), 1.0)
    assert (
        line_of_warning(lambda: np.vectorize(lambda x: deep() * x, otypes=[float])(np.ones(1)))
        == __file__
    )


def test_a_stack_of_nothing_but_xcrack(monkeypatch):
    monkeypatch.setattr("xcrack.base.errors._INSIDE", frozenset(_names()))
    with pytest.warns(XcrackWarning, match="mind"):
        warn("mind")


def _names():
    import sys

    frame, names = sys._getframe(), set()
    while frame is not None:
        names.add(frame.f_globals.get("__name__", "").partition(".")[0])
        frame = frame.f_back
    return names
