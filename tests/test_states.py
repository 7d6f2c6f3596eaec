"""Several load states of one solve: one factorisation, one geometry for K."""

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


def test_solutions_of_different_solves_are_refused():
    problem = pulled()
    with pytest.raises(xc.ProblemError, match="do not share one space"):
        xc.stress_intensities([xc.solve(problem), xc.solve(problem)])


@pytest.mark.parametrize("states", [1.0, "max"])
def test_states_must_be_a_list(states):
    with pytest.raises(
        xc.ProblemError, match=r"give a list of load states, such as states=\[1.0\]"
    ):
        xc.solve(pulled(), states=states)
