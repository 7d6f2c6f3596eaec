"""Loads away from cracks are integrated once a mesh; beside a crack at each solve."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.analysis.solve import solve_states
from xcrack.linalg.engine import SolverState

STEEL = xc.Isotropic(210e3, 0.3, "strain")


@pytest.mark.parametrize(("side", "again"), [("top", 0), ("left", 1)])
def test_vectors_of_an_earlier_solve(side, again):
    """The mouth changes the vector of what acts on its side; bits are those of new vectors."""
    calls = []

    def stress(x):
        calls.append(len(x))
        return np.stack([1 + x[:, 1], 0.3 * x[:, 0]], axis=1)

    mesh = xc.box((-1, -1), (1, 1), 8)
    loads = [xc.traction(side, stress), xc.traction("right", (2.0, 0.0))]
    supports = [xc.fix("bottom", 0), xc.fix("bottom", 1)]
    reuse, made = SolverState(), []
    for tip in (-0.4, -0.2):
        problem = xc.Problem(
            mesh, STEEL, [xc.line_crack([(-1.2, 0.03), (tip, 0.07)])], loads=loads,
            supports=supports, contact="off",
        )  # fmt: skip
        calls.clear()
        solution = solve_states(problem, [1.0, -0.5], reuse=reuse)[0]
        made.append(len(calls))
        reuse = solution.reuse
        assert solution.u.tobytes() == solve_states(problem, [1.0, -0.5])[0].u.tobytes()
    assert made[0] > 0
    assert (made[1] > 0) == again


def test_free_motion_of_other_supports():
    """Supports that changed between two solves in a mesh leave other motions free."""
    mesh, reuse = xc.box((-1, -1), (1, 1), 8), SolverState()
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    for supports in ([], [xc.fix("left", 0)], []):
        problem = xc.Problem(
            mesh, STEEL, [xc.line_crack([(-0.4, 0.03), (0.3, 0.07)])], loads=loads,
            supports=supports,
        )  # fmt: skip
        solution = solve_states(problem, [1.0], reuse=reuse)[0]
        reuse = solution.reuse
        assert solution.u.tobytes() == solve_states(problem, [1.0])[0].u.tobytes()
