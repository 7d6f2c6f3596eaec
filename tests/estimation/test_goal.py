"""K as a functional of the solution equals what the integrals give, whatever acts."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from xcrack.estimate.dual import rubbing_end_changes
from xcrack.linalg.coulomb import Status, of_status
from xcrack.sif.common import lip_pressure
from xcrack.sif.goal_2d import constant, tip_goal

STEEL = xc.Isotropic(210e3, 0.3, "strain")
PULLED = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
PRESSED = [xc.traction("top", (0.3, -1.0)), xc.traction("bottom", (-0.3, 1.0))]
PRESSED += [xc.traction("left", (0.0, -0.3)), xc.traction("right", (0.0, 0.3))]
LOADED = [
    xc.body_force(lambda x: np.stack([x[:, 1], -1 + x[:, 0]], axis=1)),
    xc.initial_stress(
        lambda x: np.stack([x[:, 0], x[:, 1], x[:, 1], 1 + x[:, 0]], axis=1).reshape(-1, 2, 2)
    ),
    xc.crack_pressure(2.0),
]
RUBBED = [
    xc.traction(side, lambda x, n: n @ np.array([[-0.6, -0.5], [-0.5, -1.0]]))
    for side in ("left", "right", "bottom", "top")
]
STRAIGHT, KINKED = [(-0.31, -0.2), (0.4, 0.3)], [(-0.31, -0.2), (0.2, 0.1), (0.4, 0.3)]
SCENES = {
    "straight": (STRAIGHT, PULLED, "auto"),
    "edge, kinked": ([(-1.3, 0.01), (0.2, 0.01), (0.4, 0.15)], PULLED, "auto"),
    "shut": (STRAIGHT, PRESSED, "auto"),
    "shut, kinked": (KINKED, PRESSED, "auto"),
    "pressurised": (KINKED, [xc.crack_pressure(lambda x: 1 + x[:, 0])], "off"),
    "loaded": (KINKED, LOADED, "off"),
}


@pytest.mark.parametrize("name", SCENES)
def test_functional_equals_the_integral(name):
    """To round-off, before K_I of closed tips is set to zero."""
    points, loads, contact = SCENES[name]
    supports = [xc.fix("bottom")] if name == "loaded" else []
    mesh = xc.box((-1, -1), (1, 1), 12)
    crack = xc.line_crack(points)
    solution = xc.solve(xc.Problem(mesh, STEEL, [crack], supports, loads, contact))
    sif = xc.stress_intensity(solution)
    assert sif.closed.all() == ("shut" in name)
    for t, K in enumerate(sif.K_integral):
        goal = tip_goal(solution, t)
        J = goal.of(solution, lip_pressure(solution, 0)) + constant(solution, t)
        J[0] = abs(J[0]) if sif.closed[t] else J[0]
        assert J == pytest.approx(K, abs=1e-12 * np.abs(K).max())


def rubbed(points, n=12, friction=0.3):
    mesh = xc.box((-1, -1), (1, 1), n)
    cracks = [xc.line_crack(points)]
    problem = xc.Problem(mesh, STEEL, cracks, loads=RUBBED, friction=friction, order=2)
    return xc.solve(problem, error=True)


ARC = [(0.6 * np.sin(a) - 0.05, 0.6 * np.cos(a) - 0.3) for a in np.linspace(-0.7, 0.6, 30)]


@pytest.mark.parametrize("points", [STRAIGHT, KINKED, ARC], ids=["straight", "kinked", "arc"])
def test_functional_with_friction(points):
    """Shear on the faces counts as the integral over them counts it."""
    solution = rubbed(points, friction=0.1)
    sif, contact = xc.stress_intensity(solution, error=False), solution.contact[0]
    assert np.abs(contact.shear).max() > 0.01
    for t, K in enumerate(sif.K_integral):
        J = tip_goal(solution, t).of(solution, contact.pressure, contact.shear)
        J[0] = abs(J[0]) if sif.closed[t] else J[0]
        assert J == pytest.approx(K, abs=1e-11 * np.abs(K).max())


def test_ends_of_zones_that_slip():
    """What a group more and one less do to K is what a solution with such zones has."""
    solution = rubbed(ARC, 17)
    factored = solution.factored
    rubbing_states = factored.contact.rubbing_states
    rows, status = rubbing_states.rows, rubbing_states.status[0]
    states = np.where(status.is_closed, status.slip, 2)  # positions rise with the groups here
    ends = np.nonzero(np.diff(states))[0]
    assert len(ends)
    goals = [tip_goal(solution, t) for t in (0, 1)]
    wanted = 0.0
    for end in ends:
        changes = []
        for group, neighbour in ((end, end + 1), (end + 1, end)):
            is_closed, slip = status.is_closed.copy(), status.slip.copy()
            is_closed[group], slip[group] = is_closed[neighbour], slip[neighbour]
            then = of_status(rows, rubbing_states.change[0], Status(is_closed, slip))[0]
            tractions = of_status(rows, rubbing_states.change[0], status)[0]
            u = solution.u + factored.engine.solve(rubbing_states.N.T @ (then - tractions))
            K = []
            for x, y in ((solution.u, tractions), (u, then)):
                at_points = [factored.contact.spaces[0].values @ part for part in np.split(y, 2)]
                K.append([g.of(replace(solution, u=x), *at_points) for g in goals])
            changes.append(np.abs(K[1] - np.array(K[0])).ravel())
        wanted = wanted + 1 / (1 / changes[0] + 1 / changes[1])
    changes_of_K = rubbing_end_changes(factored, goals, [0])[0]
    np.testing.assert_allclose(changes_of_K, wanted, rtol=1e-7)
