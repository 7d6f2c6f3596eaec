"""Warnings name the line of the user's code; in a run those that come again have a summary."""

import functools
import warnings

import numpy as np
import pytest

from support.growth_fakes import formula, mode_I, plate
from xcrack import Cycle, XcrackWarning, grow, max_hoop_stress, paris
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


@pytest.mark.parametrize("stop", [None, 3])
def test_a_repeated_warning_is_summarised_once(stop):
    """Each kind when it comes first, and one summary, whether the run ends or is left."""
    whole = formula(mode_I())

    def response(problem, *rest):
        a = float(problem.placed[0].points[-1, 0])
        warn(f"K at [{a}, 0.37]: the domain is clipped to {1 / a:.4g} (2.3 cells)")
        if a > 12:
            warn("a crack is long")
        return whole(problem, *rest)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        steps = grow(plate(), paris(1e-11, 3.0), max_hoop_stress, Cycle(0, 1), da=2.0, max_steps=6,
                     response=response)  # fmt: skip
        for step in steps:
            if step.index == stop:
                break
        steps.close()
    texts = [str(w.message) for w in caught]
    assert all(w.filename == __file__ for w in caught)
    assert texts[0].startswith("K at [5.0, 0.37]: the domain is clipped to 0.2 ")
    assert texts[1:-1] == ([] if stop else ["a crack is long"])
    n = 4 if stop else 6
    assert f"in {n} of {n} steps, from step 0 to {n - 1}" in texts[-1]
    assert f"K at [{5.0 + 2 * (n - 1)}, 0.37]" in texts[-1]  # the last of them in full
    assert ("a crack is long" in texts[-1]) == (stop is None)
