"""Temperatures as the states of a cycle: K of each state, closure when it is hot, growth."""

import numpy as np
import pytest

import xcrack as xc
from support.rows import mission

pytestmark = pytest.mark.filterwarnings("ignore:K a")

ALPHA = 1.2e-5
HOT, COLD = 20.0, -40.0


def strip(d, loads=(), contact="auto"):
    """A strip between stiff grips with an edge crack, straight in 3D."""
    if d == 2:
        mesh, plane = xc.box((0, 0), (1, 2), (14, 28)), "stress"
        crack = xc.line_crack([(-0.1, 1.013), (0.4, 1.013)])
    else:
        mesh, plane = xc.box((0, 0, 0), (1, 0.4, 2), (8, 3, 16)), None
        corners = [(-1.0, -1.0), (0.4, -1.0), (0.4, 1.4), (-1.0, 1.4)]
        crack = xc.plane_crack([(x, y, 1.013) for x, y in corners])
    ends = [xc.fix("bottom", axis=d - 1), xc.fix("top", axis=d - 1)]
    sides = [xc.fix((0.0,) * d, axis=0)] if d == 2 else [xc.fix("front", axis=1)]
    sides += [] if d == 2 else [xc.fix("back", axis=1), xc.fix((0.0,) * d, axis=0)]
    body = xc.Isotropic(E=2e5, nu=0.3, plane=plane)
    return xc.Problem(mesh, body, [crack], [*ends, *sides], list(loads), contact, 4 - d)


def rise(x):
    return 1.0 + 0.5 * x[:, 0]


def cycle():
    states = [[xc.temperature(lambda x, T=T: T * rise(x), ALPHA)] for T in (HOT, COLD)]
    return xc.Cycle(states=states)


@pytest.mark.parametrize("d", [2, *mission(3)])
def test_states_have_the_K_of_their_own_solve(d):
    """And so of the same stress as a pressure on the faces, within the discretisation."""
    problem = strip(d, contact="off")
    several = xc.solve(problem, states=cycle().load_states)
    for solution, state, T in zip(several, cycle().load_states, (HOT, COLD), strict=True):
        one = xc.stress_intensity(xc.solve(strip(d, state, contact="off")))
        K = xc.stress_intensity(solution)
        np.testing.assert_allclose(K.K, one.K, rtol=1e-6, atol=1e-6 * np.abs(one.K_I).max())
        if d == 2:
            same = xc.crack_pressure(lambda x, T=T: -2e5 * ALPHA * T * rise(x))
            pressed = xc.stress_intensity(xc.solve(strip(d, [same], contact="off")))
            assert K.K_I[0] == pytest.approx(pressed.K_I[0], rel=2e-3)


def test_a_cycle_of_temperature_grows_the_crack_while_it_is_cold():
    history = xc.collect(
        xc.grow(
            strip(2), xc.paris(1e-11, 3.0), xc.max_hoop_stress, cycle(), da=0.1, max_steps=3,
            progress=False,
        )
    )  # fmt: skip
    first = history.steps[0]
    hot, cold = (state[0].K_I[0] for state in first.sif)
    assert hot == 0.0  # the faces press together: contact, not -1/2 of the other end
    assert first.dK_eq[0][0] == pytest.approx(cold, rel=1e-2)  # K_II of the mesh
    assert first.R[0][0] == pytest.approx(0.0, abs=1e-6)  # K_II of the closed state
    assert np.diff([step.cycles for step in history.steps]).min() > 0
    assert history.steps[0].solutions[0].contact[0].closed.any()


def test_a_steady_force_and_a_temperature_that_changes():
    """Without contact K adds up: what acts steadily stands in both states."""
    pull = xc.crack_pressure(100.0)
    states = [[pull, *state] for state in cycle().load_states]
    problem = strip(2, contact="off")
    both, alone, steady = (
        [xc.stress_intensity(s).K_I[0] for s in xc.solve(problem, states=each)]
        for each in (states, cycle().load_states, [[pull]])
    )
    np.testing.assert_allclose(both, np.add(alone, steady[0]), rtol=1e-9)


def test_a_temperature_of_the_problem_is_there_in_every_state():
    """As residual stress is: a state adds to it."""
    warm = xc.temperature(10.0, ALPHA)
    problem = strip(2, [warm], contact="off")
    states = [[], [xc.temperature(-10.0, ALPHA)]]
    K = [xc.stress_intensity(s).K_I[0] for s in xc.solve(problem, states=states)]
    assert K[0] < -10
    assert abs(K[1]) < 1e-9 * abs(K[0])


def test_states_that_do_not_differ_are_named():
    """A temperature of the problem that is given as a state too, beside one of no degrees."""
    warm = xc.temperature(-10.0, ALPHA)
    states = [[xc.temperature(0.0, ALPHA)], [warm]]
    problem = strip(2, [warm], contact="off")
    run = {"law": xc.paris(1e-11, 3.0), "criterion": xc.max_hoop_stress, "da": 0.1}
    with pytest.warns(xc.XcrackWarning, match=r"state 0 .* leave it out of Problem\(loads"):
        steps = xc.grow(problem, cycle=xc.Cycle(states=states), progress=False, **run)
    history = xc.collect(steps)
    assert history.ended.startswith("rate is zero at every tip: K is the same in all 2 load states")
