"""Loads away from cracks are integrated once a mesh; beside a crack at each solve."""

import numpy as np
import pytest

import xcrack as xc

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
    reuse, made = None, []
    for tip in (-0.4, -0.2):
        problem = xc.Problem(
            mesh, STEEL, [xc.line_crack([(-1.2, 0.03), (tip, 0.07)])], loads=loads,
            supports=supports, contact="off",
        )  # fmt: skip
        calls.clear()
        answer = xc.respond(problem, [1.0, -0.5], reuse)
        made.append(len(calls))
        reuse = answer.reuse
        fresh = xc.solve(problem, [1.0, -0.5])[0]
        assert answer.solutions[0].u.tobytes() == fresh.u.tobytes()
    assert made[0] > 0
    assert (made[1] > 0) == again


def test_free_motion_of_other_supports():
    """Supports that changed between two solves in a mesh leave other motions free."""
    mesh, reuse = xc.box((-1, -1), (1, 1), 8), None
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    for supports in ([], [xc.fix("left", 0)], []):
        problem = xc.Problem(
            mesh, STEEL, [xc.line_crack([(-0.4, 0.03), (0.3, 0.07)])], loads=loads,
            supports=supports,
        )  # fmt: skip
        answer = xc.respond(problem, [1.0], reuse)
        reuse = answer.reuse
        assert answer.solutions[0].u.tobytes() == xc.solve(problem).u.tobytes()
