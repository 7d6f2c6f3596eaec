"""Cracks in 3D that wave about a plane of mesh points: conjugate gradients converge for any offset.

Parts of such a crack lie on the plane, others a little beside it: slivers are wedges along edges of
the mesh, of which one end lies on the crack.
"""

import numpy as np
import pytest

import xcrack as xc

OFFSETS = (1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # cells
_PULL = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]


def waving_penny(n, offset):
    """A penny on the plane z = 0 of the mesh, around its middle some cells beside it."""
    flat = xc.penny_crack((0.013, 0.02, 0.0), (0, 0, 1), 0.5, n=64)
    points = np.array(flat.points)
    outer = np.hypot(points[:, 0] - 0.013, points[:, 1] - 0.02) > 0.3
    waves = np.random.default_rng(319).normal(size=len(points))
    points[:, 2] = 2 / n * offset * np.where(outer, waves, 0.0)
    return xc.surface_crack(points, flat.faces)


def iterations_and_energy(n, offset, order):
    problem = xc.Problem(
        xc.box((-1,) * 3, (1,) * 3, n),
        xc.Isotropic(1e5, 0.3),
        [waving_penny(n, offset)],
        loads=_PULL,
        order=order,
        contact="off",
        numerics=xc.Numerics(linear="iterative"),
    )
    solution = xc.solve(problem)
    return solution.report.operations["iterations"], solution.energy


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_iterations_do_not_know_the_offset(order):
    """They are a few more than on the plane itself; the energy is that within discretisation."""
    steps, energy = np.array([iterations_and_energy(8, e, order) for e in (0.0, *OFFSETS)]).T
    print(f"\norder {order}: {steps.astype(int).tolist()}, {np.ptp(energy) / energy[0]:.2e}")
    assert max(steps) <= 1.2 * steps[0] + 2
    assert np.ptp(energy) <= 3e-3 * energy[0]


@pytest.mark.slow
@pytest.mark.mission
def test_the_worst_offset():
    """Without the uncut edges this took 68 steps, in larger scenes more than 2000."""
    assert iterations_and_energy(8, 3e-5, 2)[0] <= 25
