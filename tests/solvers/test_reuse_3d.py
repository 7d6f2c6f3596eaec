"""What a step in 3D takes over from the one before: fewer steps, the same answer."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import scenes_3d as scenes_space

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
PRESS = [xc.traction("top", (0.3, 0, -1.0)), xc.traction("bottom", (-0.3, 0, 1.0)),
         xc.traction("right", (0, 0, 0.3)), xc.traction("left", (0, 0, -0.3))]  # fmt: skip
PULL = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]


CUBE = (-1, -1, -1), (1, 1, 1)


def scene(radius, **options):
    mesh = xc.box(*CUBE, 8)
    crack = xc.penny_crack((0.013, -0.021, 0.0317), (0.2, -0.3, 1.0), radius)
    defaults = {"order": 1, "numerics": xc.Numerics(linear="iterative")}
    return xc.Problem(mesh, scenes_space.STEEL, [crack], **defaults | options)


@pytest.mark.slow
@pytest.mark.mission
def test_next_step_starts_from_closed_lips():
    """One solve a state instead of two, and what a fresh start finds."""
    first = xc.respond(scene(0.55), [PRESS, PULL])
    next_scene = replace(scene(0.58), mesh=first.solutions[0].problem.mesh)
    warm = xc.respond(next_scene, [PRESS, PULL], first.reuse).solutions
    fresh = xc.respond(next_scene, [PRESS, PULL]).solutions
    count = [s[0].report.operations for s in (warm, fresh)]
    assert count[0]["solves"] == 2 < count[1]["solves"]
    assert count[0]["iterations"] < count[1]["iterations"]
    for one, other in zip(warm, fresh, strict=True):
        # To the residual of the conjugate gradients, 1e-8.
        assert one.u == pytest.approx(other.u, abs=1e-6 * np.abs(other.u).max())
        p = other.contact[0].pressure
        assert one.contact[0].pressure == pytest.approx(p, abs=1e-5)


def test_a_crack_that_opens_again_gives_its_multipliers_back():
    closed = xc.respond(scene(0.55), [PRESS])
    (before,) = closed.solutions
    again = replace(scene(0.55), mesh=before.problem.mesh)
    (opened,) = xc.respond(again, [PULL], closed.reuse).solutions
    assert before.contact[0] is not None
    assert opened.contact[0] is None
    assert opened.opening(0).min() >= 0
    assert not opened.report["multipliers of crack 0"].used


@pytest.mark.slow
@pytest.mark.mission
def test_an_open_crack_is_solved_to_the_end():
    """The rough look at the crack faces is not the answer."""
    result = xc.solve(scene(0.55, loads=PULL))
    exact = xc.solve(replace(scene(0.55, loads=PULL), numerics=xc.Numerics(linear="direct")))
    # To rigid motions, which neither engine decides alike: by the opening.
    assert result.opening(0) == pytest.approx(exact.opening(0), rel=1e-5, abs=1e-7)


def test_a_scene_that_is_solved_once_is_factorised():
    """At 12 k unknowns of order 2 a factor is cheaper than levels that no other step shares."""
    problem = replace(scene(0.55, order=2, numerics=xc.Numerics()), mesh=xc.box(*CUBE, 7))
    alone, in_a_run = xc.solve(problem, [PULL])[0], xc.respond(problem, [PULL]).solutions[0]
    assert 10_000 < alone.n_dof < 15_000
    assert "iterations" in in_a_run.report.operations
    assert "iterations" not in alone.report.operations
    assert alone.u == pytest.approx(in_a_run.u, abs=1e-6 * np.abs(alone.u).max())
