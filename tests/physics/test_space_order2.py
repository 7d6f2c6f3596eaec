"""Order 2 in space: quadratic tetrahedra and Heaviside functions, tip functions on linear hats."""

import numpy as np
import pytest

import exact
import scenes_space as scenes
import xcrack as xc

C = np.array([0.013, -0.021, 0.0317])


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, 2.0, 3.0)], ids=str)
def test_contact_patch(normal):
    problem = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 4),
        xc.Isotropic(E=1.0, nu=0.3),
        [xc.penny_crack(C, normal, 0.6)],
        loads=[xc.pressure("boundary", 2.5)],
        contact="on",
        order=2,
    )
    contact = xc.solve(problem).contact[0]
    assert np.abs(contact.pressure / 2.5 - 1).max() < 1e-10  # round-off
    assert xc.inf_sup(problem) > 0.25
    assert xc.inf_sup(problem, norm="energy") > 0.25


@pytest.mark.slow
@pytest.mark.mission
def test_penny_on_a_mesh_of_half_the_cells():
    """Exact data in a drawn rotation; a / h = 1.75 at order 2 is as good as 3 at order 1."""
    normal = scenes.unit(np.array([0.3, -0.5, 1.0]))
    rows = np.array([*scenes.axes(normal), normal])
    a, nu = 0.5, 0.3
    stress = np.array([[0, 0, 0.3], [0, 0, 0.2], [0.3, 0.2, 1.0]])

    def field(x):
        return exact.penny((x - C) @ rows.T, a, 1.0, nu, stress) @ rows

    found = {}
    for order, n in ((1, 12), (2, 7)):
        problem = xc.Problem(
            xc.box((-1, -1, -1), (1, 1, 1), n),
            xc.Isotropic(E=1.0, nu=nu),
            [xc.penny_crack(C, rows[2], a)],
            supports=[xc.displacement("boundary", field)],
            contact="off",
            order=order,
            numerics=xc.Numerics(linear="direct"),
        )
        solution = xc.solve(problem)
        ratio = xc.stress_intensity(solution).K_I / (2 * np.sqrt(a / np.pi))
        found[order] = solution.n_dof, abs(ratio.mean() - 1), ratio.std()
        print(f"order {order}: {found[order]}")
    assert found[2][0] < 1.25 * found[1][0]
    for _, mean, scatter in found.values():  # discretisation
        assert mean < 0.01
        assert scatter < 0.015


def test_iterations_are_for_order_1():
    problem = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 4),
        xc.Isotropic(E=1.0, nu=0.3),
        [xc.penny_crack(C, (0, 0, 1), 0.6)],
        loads=[xc.pressure("boundary", -1.0)],
        order=2,
        numerics=xc.Numerics(linear="iterative"),
    )
    with pytest.raises(xc.ProblemError, match="order"):
        xc.solve(problem)
