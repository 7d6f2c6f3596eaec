"""Cracks and tips keep their names where numbers change: at joins, and at the boundary."""

import numpy as np
import pytest

import xcrack as xc

LAW, CYCLE = xc.paris(1e-11, 3.0), xc.Cycle(0.0, 1.0)
pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


@pytest.fixture(scope="module")
def history():
    """Two cracks that join, and a third one far away, whose number changes then."""
    lines = [[(-6, 0.1), (-3.2, 0.1)], [(-2.0, 0.1), (0.8, 0.1)], [(5, 0.1), (6.2, 0.1)]]
    problem = xc.Problem(
        xc.box((-10, -6), (10, 6), (60, 36)), xc.Isotropic(73e3, 0.33, plane="stress"),
        [xc.line_crack(line) for line in lines],
        loads=[xc.traction("top", (0, 100.0)), xc.traction("bottom", (0, -100.0))],
    )  # fmt: skip
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=0.4, max_steps=4, progress=False)
    return xc.collect(steps)


def test_names_go_through_a_join(history):
    assert len(history.joins) == 1
    counts = [len(step.cracks) for step in history.steps]
    assert {3, 2} == set(counts)
    for count, step in zip(counts, history.steps):
        known = step.identities
        assert known.cracks == ((0, 1, 2) if count == 3 else (0, 2))
        assert known.ends == (((0, 1), (2, 3), (4, 5)) if count == 3 else ((0, 3), (4, 5)))
    assert history.names[3] == step.end_name(0, 1) == "right tip of crack 1"
    table = history.table()
    rows = table[table["id"] == 3]
    assert (np.diff(rows["x"]) > 0).all()
    assert rows["tip"].tolist() == [1] * len(history.steps)
    assert set(rows["crack"].tolist()) == {1, 0}


def test_a_curve_is_one_crack(history, tmp_path):
    """No length of a crack falls; the one that has joined another one ends there."""
    (axes,) = history.plot("a", tmp_path / "a.png").axes
    curves = {line.get_label(): np.array(line.get_ydata()) for line in axes.get_lines()}
    for c in range(3):
        assert (np.diff(curves[f"crack {c}"]) > 0).all()
    assert len(curves["crack 1"]) < len(history.steps) == len(curves["crack 2"])
    for kind in ("K", "path"):
        history.plot(kind, tmp_path / f"{kind}.png")


def test_names_go_through_an_arrival():
    """The left tip leaves the body: the right one is tip 0 then, and keeps its name."""
    problem = xc.Problem(
        xc.box((0, -6), (20, 6), (40, 24)), xc.Isotropic(73e3, 0.33, plane="stress"),
        [xc.line_crack([(1.3, 0.1), (4.3, 0.1)])],
        loads=[xc.traction("top", (0, 100.0)), xc.traction("bottom", (0, -100.0))],
    )  # fmt: skip
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=1.0, max_steps=4, progress=False)
    history = xc.collect(steps)
    assert history.arrivals
    assert history.steps[-1].identities.ends == ((1,),)
    (arrival,) = history.arrivals
    assert (arrival.end, arrival.label) == (0, "left tip of crack 0")
    assert str(arrival).startswith("left tip of crack 0 reached 'left' at (0, ")
