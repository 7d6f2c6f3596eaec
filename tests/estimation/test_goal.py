"""K as a functional of the solution equals what the integrals give, and what bars are made of."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from xcrack.analysis.solution import gradients_at
from xcrack.analysis.solve import solve_states
from xcrack.estimate.dual import rubbing_end_changes
from xcrack.estimate.kernels.goal import add_to_functions, ring_factors
from xcrack.estimate.kernels.surplus import add_functional
from xcrack.estimate.surplus import residuals, surplus
from xcrack.fem.quadrature import cell_points
from xcrack.fem.williams import mode_matrix, unit_gradients
from xcrack.linalg.coulomb import Status, of_status
from xcrack.sif.common import lip_pressure, weight
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


# --- kernels of estimates against twins without tricks --------------------------------------------


SOFT_STEEL = xc.Isotropic(1.0, 0.3, "strain")


def test_factors_of_the_ring():
    rng = np.random.default_rng(733)
    xi, w = rng.uniform(-1, 1, (40, 2)), rng.uniform(0.5, 1, 40)
    r, theta = np.hypot(*xi.T), np.arctan2(xi[:, 1], xi[:, 0])
    frame = np.array([[0.6, 0.8], [-0.8, 0.6]])
    modes = mode_matrix(SOFT_STEEL.kolosov, SOFT_STEEL.mu)
    corners, cells, tip = (
        np.array([[-3.0, -3.0], [5.0, -3.0], [-3.0, 5.0]]),
        np.arange(3),
        [0.3, 0.2],
    )
    local = (xi @ frame + tip - corners[0]) / 8
    bary = np.column_stack([1 - local.sum(axis=1), local])
    result = ring_factors(
        np.zeros(40, dtype=int), bary, np.zeros(40, dtype=int), w, corners, cells[None],
        np.ones(3), np.array(tip), 0.9, 0.2, frame, modes, SOFT_STEEL.lam, SOFT_STEEL.mu, None,
    )  # fmt: skip
    _, dq = weight(r, xi, np.array([0.2]), np.array([0.9]))
    for m, g in enumerate(unit_gradients(r, theta, SOFT_STEEL.kolosov, SOFT_STEEL.mu)[:2]):
        sigma = SOFT_STEEL.stress(g)
        local = SOFT_STEEL.stress(np.einsum("qi,qj->qij", g[:, :, 0], dq[0]))
        local[:, :, 0] += np.einsum("qij,qj->qi", sigma, dq[0])
        local -= sigma * dq[0][:, :1, None]
        wanted = np.einsum("q,ai,qab,bj->qij", w, frame, local, frame)
        assert result[..., m] == pytest.approx(wanted, rel=1e-11, abs=1e-12)


def test_functionals_on_functions():
    rng = np.random.default_rng(739)
    functions = np.array([[0, 2, -1], [1, 2, 3]])
    row, number = np.array([0, 1, 1]), np.array([2, 0, 1])
    slope, factor = rng.normal(size=(3, 3, 2)), rng.normal(size=(3, 2, 2, 2))
    total = np.zeros((4, 2, 2))
    add_to_functions(total, functions, row, number, slope, factor)
    wanted = np.zeros((5, 2, 2))
    for q in range(3):
        for a in range(3):
            wanted[functions[row[q], a]] += np.einsum("ijm,j->im", factor[number[q]], slope[q, a])
    assert total == pytest.approx(wanted[:4], rel=1e-13, abs=1e-13)


def cracked():
    mesh = xc.box((0, -1), (1, 1), (5, 10))
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    cracks = [xc.line_crack([(-0.3, 0.03), (0.52, 0.07)])]
    return solve_states(xc.Problem(mesh, SOFT_STEEL, cracks, loads=loads), [None], error=True)[0]


def polynomials(bary, sign):
    """The four surplus functions of a cell, and their derivatives by barycentric coordinate."""
    x, y, z = bary.T
    values = np.stack([x * y * (x - y), x * z * (x - z), y * z * (y - z), x * y * z], axis=1)
    zero = 0 * x
    slopes = np.stack(
        [
            np.stack([2 * x * y - y * y, x * x - 2 * x * y, zero], axis=1),
            np.stack([2 * x * z - z * z, zero, x * x - 2 * x * z], axis=1),
            np.stack([zero, 2 * y * z - z * z, y * y - 2 * y * z], axis=1),
            np.stack([y * z, x * z, x * y], axis=1),
        ],
        axis=1,
    )
    factor = np.concatenate([sign, np.ones((len(sign), 1))], axis=1)
    return values * factor, slopes * factor[:, :, None]


def test_residuals_and_blocks_of_a_cracked_body():
    solution = cracked()
    space = solution.space
    w = surplus(space, solution.factored.model.imposed_values.is_fixed)
    body = solution.problem.elasticity
    residual, blocks = residuals(w, body, solution.coefficients[..., None])
    points = cell_points(space, np.arange(len(space.mesh.cells)), 3, 4)
    gradient = gradients_at(
        space, solution.coefficients[..., None], points.cell, points.bary, points.side
    )[..., 0]
    sigma = SOFT_STEEL.stress(gradient)
    _, by_bary = polynomials(points.bary, w.sign[points.cell])
    slope = np.einsum("qab,qbj->qaj", by_bary, space.mesh.gradient[points.cell])
    wanted, square = np.zeros(residual.shape[:2]), np.zeros((len(w.copy), 4, 4))
    for a in range(4):
        f = w.functions[points.cell, a]
        work = np.einsum("q,qij,qj->qi", points.weight, sigma, slope[:, a])
        np.subtract.at(wanted, f, work)
        H = np.where(w.copy[f] >= 0, points.side[:, 0], 0)
        jumps = H != 0
        np.subtract.at(wanted, w.copy[f][jumps], (H[:, None] * work)[jumps])
        g = np.zeros((len(f), 4, 2, 2))
        for i in range(2):
            g[:, i, i], g[:, 2 + i, i] = slope[:, a], H[:, None] * slope[:, a]
        s = np.stack([SOFT_STEEL.stress(g[:, k]) for k in range(4)], axis=1)
        np.add.at(square, f, np.einsum("q,qaij,qbij->qab", points.weight, s, g))
    assert (w.copy >= 0).sum() > 5
    assert residual[..., 0] == pytest.approx(wanted, rel=1e-10, abs=1e-13)
    assert blocks == pytest.approx(square, rel=1e-10, abs=1e-13)


def test_functionals_on_surplus_functions():
    space = cracked().space
    w = surplus(space, np.zeros(space.n_dof, dtype=bool))
    points = cell_points(space, space.enriched_cells[::3], 2, 2)
    factor = np.random.default_rng(743).normal(size=(len(points.cell), 2, 2, 2))
    result = np.zeros((len(w.is_fixed), 2, 2))
    add_functional(result, points.cell, points.bary, points.side, factor, *w.arrays)
    _, by_bary = polynomials(points.bary, w.sign[points.cell])
    slope = np.einsum("qab,qbj->qaj", by_bary, space.mesh.gradient[points.cell])
    wanted = np.zeros_like(result)
    for q, cell in enumerate(points.cell):
        for a, f in enumerate(w.functions[cell]):
            work = np.einsum("ijm,j->im", factor[q], slope[q, a])
            wanted[f] += work
            if w.copy[f] >= 0:
                wanted[w.copy[f]] += points.side[q, 0] * work
    assert result == pytest.approx(wanted, rel=1e-12, abs=1e-12)
