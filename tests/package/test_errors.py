"""Warnings name the line of the user's code; in a run those that come again have a summary."""

import functools
import warnings

import numpy as np
import pytest

from support.growth_fakes import formula, mode_I, plate
from xcrack import (
    Cycle,
    Isotropic,
    Problem,
    XcrackWarning,
    box,
    grow,
    line_crack,
    max_hoop_stress,
    paris,
)

BODY, STEEL = box((-0.5, -0.5), (0.5, 0.5), 16), Isotropic(1.0, 0.3, plane="strain")


def warn(x=0.47):
    """Of an end close to the boundary, that is taken as a mouth."""
    Problem(BODY, STEEL, [line_crack([(-0.3, 0.01), (0.3, 0.01), (x, 0.02)])])


def inner(function):
    """A function as if it stood in xcrack."""
    names = {"__name__": "xcrack.some.module", "function": function}
    exec("def call(*rest):\n    return function(*rest)", names)
    return names["call"]


def warn_of_a_kink():
    Problem(BODY, STEEL, [line_crack([(-0.3, 0.01), (0.01, 0.6), (0.3, 0.01)])])


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
    assert line_of_warning(warn) == __file__
    assert line_of_warning(inner(deep_warning())) == __file__


def deep_warning():
    """A warning of a call that stands in a frame of xcrack."""
    names = {"__name__": "xcrack.deep", "Problem": Problem, "body": BODY, "steel": STEEL}
    names["crack"] = line_crack([(-0.3, 0.01), (0.3, 0.01), (0.47, 0.02)])
    exec("def call():\n    Problem(body, steel, [crack])", names)
    return names["call"]


def test_through_numpy_and_functools():
    deep = functools.partial(inner(lambda x: deep_warning()() or x), 1.0)
    assert (
        line_of_warning(lambda: np.vectorize(lambda x: deep() * x, otypes=[float])(np.ones(1)))
        == __file__
    )


def test_a_stack_of_nothing_but_xcrack(monkeypatch):
    monkeypatch.setattr("xcrack.base.errors._INSIDE", frozenset(_names()))
    with pytest.warns(XcrackWarning, match="taken as a mouth"):
        warn()


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
        warn(0.47 + a / 10_000)
        if a > 12:
            warn_of_a_kink()
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
    assert "ends at [0.4705, 0.02], 0.0295 inside the boundary" in texts[0]
    assert ["by its kink" in text for text in texts[1:-1]] == ([] if stop else [True])
    n = 4 if stop else 6
    assert f"in {n} of {n} steps, from step 0 to {n - 1}" in texts[-1]
    assert f"ends at [{round(0.4705 + 0.0002 * (n - 1), 4)}, 0.02]" in texts[-1]  # the last in full
    assert ("by its kink" in texts[-1]) == (stop is None)
