"""Depth, lengths and break-through of grown cracks: circles that grow evenly in their plane."""

import re

import numpy as np
import pytest

import xcrack as xc

BOX = xc.box((0, 0, 0), (10, 10, 6), (14, 14, 9))
CELL = 10 / 14
RATE = 1e-3


def straight_on(K, nu):
    """A criterion for which growth stays in the plane, and is the same everywhere."""
    n = np.asarray(K).shape[-2]
    return np.zeros(n), np.ones(n), np.zeros(n)


def grown(centre):
    crack = xc.elliptic_crack(centre, (0, 1, 0), (1, 0, 0), 3, 3)
    pull = [xc.traction("back", (0, 1, 0)), xc.traction("front", (0, -1, 0))]
    problem = xc.Problem(
        BOX, xc.Isotropic(E=1e3, nu=0.3), [crack], loads=pull, contact="off", order=1
    )
    steps = xc.grow(
        problem, lambda dK, R: RATE + 0.0 * dK, straight_on, xc.Cycle(0, 1), da=0.8, max_steps=6,
        progress=False,
    )  # fmt: skip
    return xc.collect(steps, keep_solutions=False)


def lengths(step):
    return {t.name: t.length for t in xc.measures(step.cracks[0], BOX).traces}


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.filterwarnings("ignore")
def test_a_corner_crack_grown_through_the_far_side():
    """Radius r: depth r, and a length √(r² - 36) on the face at distance 6, from N = 3000 on."""
    history = grown((0, 5.03, 6))
    for step in history.steps:
        r, m = 3 + RATE * step.cycles, lengths(step)
        assert m["top"] == pytest.approx(r, abs=0.1 * CELL)
        assert m["left"] == pytest.approx(min(r, 6), abs=0.1 * CELL)
        if r > 6:
            assert m["bottom"] == pytest.approx(np.sqrt(r**2 - 36), abs=0.1 * CELL)
        else:
            assert "bottom" not in m
    (arrival,) = [each for step in history.steps for each in step.arrivals]
    assert arrival.name == "bottom"
    # The place on the other side comes first, looked at a twentieth of the way to the next one.
    assert arrival.x[::2] == pytest.approx((0, 0), abs=0.1 * CELL)
    assert arrival.cycles == pytest.approx(3000, rel=1e-3)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_surface_crack_grown_through_three_sides():
    """It comes out at the sides at N = 2000, below at N = 3000, and ends in the corners."""
    history = grown((5, 5.03, 6))
    first = {}
    for step in history.steps:
        for each in step.arrivals:
            first.setdefault(each.name, each.cycles)
    expected = {"left": 2000, "right": 2000, "bottom": 3000}
    assert first == pytest.approx(expected, abs=0.1 * CELL / RATE)
    last = history.steps[-1]
    assert last.n_tips == 0
    assert re.match(r"front left the body: front( 1)? of crack 0 reached ", history.ended)
    # A mirror of the scene is one of the front, and the place between both arms is on it.
    left, right = history.steps[3].arrivals
    assert left.cycles == pytest.approx(right.cycles, rel=1e-9)
    assert history.steps[4].arrivals[0].x[0] == pytest.approx(5.0, abs=1e-6)
    # √61 from the middle to the corners; the last places lie up to a cell beside them.
    assert last.cycles == pytest.approx((np.sqrt(61) - 3) / RATE, abs=0.5 * CELL / RATE)
    for step in history.steps[:3]:
        r = 3 + RATE * step.cycles
        assert lengths(step)["top"] == pytest.approx(2 * r, abs=0.1 * CELL)
