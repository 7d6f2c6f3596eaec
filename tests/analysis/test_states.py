"""Several load states of one solve: one factorisation, one geometry for K."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc


def pulled():
    """Edge crack, pulled and sheared in two states."""
    mesh = xc.box((-1, -1), (1, 1), 12)
    crack = xc.line_crack([(-1.0, 0.03), (0.083, 0.047)])
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=loads)


def test_states_together_give_what_each_gives_alone():
    """Round-off: sums are taken in another order."""
    problem = pulled()
    solutions = xc.solve(problem, states=[0.0, 1.0, 2.5])
    together = xc.stress_intensities(solutions)
    for solution, sif in zip(solutions, together, strict=True):
        alone = xc.stress_intensity(solution)
        np.testing.assert_allclose(sif.K, alone.K, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(sif.T, alone.T, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(together[2].K, 2.5 * together[1].K, rtol=1e-10)
    assert not together[0].K.any()
    assert solutions[0].report.operations["factorisations"] == 1


@pytest.mark.parametrize("order", [[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]], ids=str)
def test_a_state_at_rest_has_no_K(order):
    """In any place, with the tips of the others."""
    result = xc.stress_intensities(xc.solve(pulled(), states=order))
    alone = xc.stress_intensity(xc.solve(pulled()))
    for state, sif in zip(order, result, strict=True):
        np.testing.assert_array_equal(sif.x, alone.x)
        np.testing.assert_allclose(sif.K, state * alone.K, rtol=1e-12)
        np.testing.assert_allclose(sif.T, state * alone.T, rtol=1e-11)


def test_an_initial_stress_is_not_rest():
    """It stays when the loads are scaled to nothing."""
    stress = xc.initial_stress(np.diag([0.0, 0.5]))
    supported = [xc.fix("top"), xc.fix("bottom")]
    solutions = xc.solve(replace(pulled(), supports=supported, loads=[stress]), states=[0.0, 1.0])
    assert not solutions[0].at_rest
    none, loaded = xc.stress_intensities(solutions)
    assert none.K_I[0] > 0.1
    np.testing.assert_allclose(none.K, loaded.K, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_a_front_at_rest():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    loads = [xc.traction("top", (0.0, 0.0, 1.0)), xc.traction("bottom", (0.0, 0.0, -1.0))]
    crack = xc.penny_crack((0, 0, 0.02), (0, 0, 1), 0.5)
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], loads=loads, order=1)
    none, loaded = xc.stress_intensities(xc.solve(problem, states=[0.0, 1.0]))
    assert not none.K.any()
    assert np.isnan(none.T).all()
    np.testing.assert_array_equal(none.x, loaded.x)
    assert loaded.K_I.min() > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_a_warning_names_the_line_that_asked_for_K(dim):
    """Not one of xcrack's own."""
    up, plane = np.eye(dim)[-1], "strain" if dim == 2 else None
    crack = xc.line_crack([(-1.2, 0.01), (0.8, 0.01)])
    if dim == 3:
        crack = xc.penny_crack((0, 0, 0.02), (0, 0, 1), 0.4)  # its bend leaves 1.1 cells
    loads = [xc.traction("top", tuple(up)), xc.traction("bottom", tuple(-up))]
    mesh = xc.box((-1,) * dim, (1,) * dim, 6)
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3, plane), [crack], loads=loads, order=4 - dim)
    solution = xc.solve(problem)
    with pytest.warns(xc.XcrackWarning, match="clipped") as messages:
        xc.stress_intensity(solution)
    assert all(warning.filename == __file__ for warning in messages)


def test_solutions_of_different_solves_are_refused():
    problem = pulled()
    with pytest.raises(xc.ProblemError, match="do not share one space"):
        xc.stress_intensities([xc.solve(problem), xc.solve(problem)])


@pytest.mark.parametrize("states", [1.0, "max"])
def test_states_must_be_a_list(states):
    with pytest.raises(xc.ProblemError, match=r"states = .*: give a list"):
        xc.solve(pulled(), states=states)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_inside_the_body(dim):
    mesh = xc.box((-1,) * dim, (1,) * dim, 3)
    solution = xc.solve(xc.Problem(mesh, xc.Isotropic(1.0, 0.3, "strain" if dim == 2 else None)))
    x = np.zeros((3, dim))
    x[1], x[2, 0] = 1.0, 1.0 + 1e-6
    np.testing.assert_array_equal(solution.inside(x), [True, True, False])
    np.testing.assert_array_equal(solution.inside(x[2]), [False])
