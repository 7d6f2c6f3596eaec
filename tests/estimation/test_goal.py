"""K as a functional of the solution equals what the integrals give, whatever acts."""

import numpy as np
import pytest

import xcrack as xc
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
