"""A tip basis of modes alone, against the functions one by one."""

from functools import cache

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support import scenes_fronts as fronts
from support.matrices import matrix_of
from support.scenes_2d import numerics_of
from xcrack.verification import methods
from xcrack.verification.methods.tip_basis import local_modes, mode_columns

MODES = methods.modal_basis()

MIXED = (1.0, 0.3, 0.2)


def tip_values(r, theta):
    """The four functions at a tip (Belytschko and Black, 1999), in the order of the columns."""
    c, s = np.cos(theta / 2), np.sin(theta / 2)
    return np.sqrt(r)[:, None] * np.stack([c, s, s * np.sin(theta), c * np.sin(theta)], axis=1)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_modes_are_the_fields_of_williams(plane):
    rng = np.random.default_rng(5501)
    r, theta = rng.uniform(0.1, 2.0, 40), rng.uniform(-3.1, 3.1, 40)
    kolosov = xc.Isotropic(1.0, 0.3, plane).kolosov
    u = np.einsum("qk,mck->mqc", tip_values(r, theta), local_modes(kolosov, 2))
    for mode, K in enumerate([(1.0, 0.0), (0.0, 1.0)]):
        wanted, _ = exact.williams(
            r * np.cos(theta), r * np.sin(theta), 1.0, 0.3, *K, 0.0, plane=plane
        )
        # round-off; the modes are those of mu = 1
        np.testing.assert_allclose(u[mode] * 2 * (1 + 0.3), wanted, atol=1e-13)


def test_third_mode_is_antiplane():
    theta = np.linspace(-3, 3, 13)
    u = np.einsum("qk,mck->mqc", tip_values(np.full(13, 0.7), theta), local_modes(1.8, 3))
    wanted = 2 * np.sqrt(0.7 / (2 * np.pi)) * np.sin(theta / 2)  # K_III = 1, mu = 1
    np.testing.assert_allclose(u[2], np.outer(wanted, [0, 0, 1]), atol=1e-15)  # round-off
    assert not u[:2, :, 2].any()


@cache
def measured(n, order, tip_basis):
    """Worst errors in K and energy, most unknowns, over two tips."""
    result = []
    for seed, (tip, angle) in enumerate(scenes.TIPS[:2], start=3):
        problem, field = scenes.williams_edge(
            n, tip, angle, seed=seed, order=order,
            numerics=numerics_of(radius={1: 0.3, 2: 0.4}[order], tip_basis=tip_basis),
        )  # fmt: skip
        solution = xc.solve(problem)
        K = scenes.K_of(problem)[0]
        error = xc.energy_error(solution, lambda x, field=field: field(x)[1])
        unknowns = solution.report.operations["unknowns"]
        result.append((abs(K - [1.0, 0.6]).max(), error, unknowns))
    worst = tuple(np.max(result, axis=0))
    print(f"\norder {order} n {n} {tip_basis}: K {worst[0]:.2e}, E {worst[1]:.3e}, {worst[2]:.0f}")
    return worst


@pytest.mark.parametrize(("n", "order"), [(20, 1), (40, 1), (10, 2), (20, 2)])
def test_a_fifth_more_error_with_fewer_unknowns(n, order):
    scalar, vectorial = measured(n, order, None), measured(n, order, MODES)
    assert 1.1 <= vectorial[1] / scalar[1] <= 1.35  # discretisation
    assert vectorial[2] < scalar[2]
    assert vectorial[0] <= {1: 8e-3, 2: 2e-4}[order]


def test_order_1_keeps_rate_one():
    """The disc of 0.3 is larger than two cells from n = 14 on."""
    sizes = (14, 20, 40)
    errors = [measured(n, 1, MODES)[1] for n in sizes]
    rate = scenes.rate(errors, [2 / n for n in sizes])
    print(f"\nrate of the vectorial basis: {rate:.2f}")
    assert rate >= 0.9


def condition(n, tip_basis, orthonormal):
    tip, angle = scenes.TIPS[0]
    problem, _ = scenes.williams_edge(
        n, tip, angle, order=1,
        numerics=numerics_of(radius=0.3, tip_basis=tip_basis, orthonormal=orthonormal),
    )  # fmt: skip
    return scenes.condition(problem)


def test_condition_number_without_blocks():
    """Scaled by the diagonal alone; blocks of nodes make both like plain elements."""
    sizes = (20, 40)
    scalar = [condition(n, None, "none") for n in sizes]
    vectorial = [condition(n, MODES, "none") for n in sizes]
    print(f"\ncondition by the diagonal: {scalar} one by one, {vectorial} modes")
    assert vectorial[1] < scalar[1] / 100
    assert np.log2(vectorial[1] / vectorial[0]) <= 3.0 < np.log2(scalar[1] / scalar[0])
    for tip_basis in (None, MODES):
        blocks = condition(40, tip_basis, "node")
        print(f"with blocks of nodes: {blocks:.3g}, {tip_basis}")
        assert blocks <= 2.5 * 40**2


def len_of(problem):
    """Number of unknowns that are solved for."""
    return matrix_of(problem).shape[0]


def test_unknowns_in_use_are_reported():
    tip, angle = scenes.TIPS[1]
    problem, _ = scenes.williams_edge(
        14, tip, angle, order=1, numerics=numerics_of(tip_basis=MODES)
    )
    solution = xc.solve(problem)
    space = solution.space
    points = int((space.tips[0].point_to_function >= 0).sum())
    row = solution.report["tip functions"]
    assert row.unknowns == 2 * points
    assert "modes I to II only" in row.reason
    assert "modes I to II only" in xc.plan(problem)["tip functions"].reason
    plain, _ = scenes.williams_edge(14, tip, angle, order=1, numerics=numerics_of())
    # Four functions of two components a point are replaced by two modes.
    unknowns = [len_of(scene) for scene in (problem, plain)]
    assert solution.report.operations["unknowns"] == unknowns[0] == unknowns[1] - 6 * points


def test_columns_are_the_modes_in_the_frame_of_the_tip():
    tip, angle = scenes.TIPS[2]
    problem, _ = scenes.williams_edge(
        10, tip, angle, order=2, numerics=numerics_of(tip_basis=MODES)
    )
    space = xc.solve(problem).space
    free = np.ones(space.n_dof, dtype=bool)
    matrix, used = mode_columns(space, problem.material, free)
    points = np.nonzero(space.tips[0].point_to_function >= 0)[0]
    first = 2 * space.tips[0].point_to_function[points[3]]
    assert used[first : first + 8].tolist() == [True, True] + 6 * [False]
    modes = local_modes(problem.material.kolosov, 2)
    for mode in (0, 1):
        column = matrix[:, [first + mode]].toarray().ravel()
        turned = modes[mode].T @ scenes.rows(angle)  # (functions, components)
        np.testing.assert_allclose(column[first : first + 8], turned.ravel(), atol=1e-15)
        assert np.count_nonzero(column) <= 8
    standard = np.arange(2 * space.n_nodes)
    assert (matrix[standard][:, standard] != np.eye(len(standard))).sum() == 0


def test_a_point_that_a_support_decides_goes_without():
    tip, angle = scenes.TIPS[0]
    problem, _ = scenes.williams_edge(
        10, tip, angle, order=1, numerics=numerics_of(tip_basis=MODES)
    )
    space = xc.solve(problem).space
    first = 2 * space.tips[0].point_to_function.max()
    free = np.ones(space.n_dof, dtype=bool)
    free[first + 3] = False
    _, used = mode_columns(space, problem.material, free)
    assert not used[first : first + 8].any()


@pytest.mark.parametrize("orthonormal", ["star", "node", "none"])
@pytest.mark.parametrize("patch", [False, True])
def test_the_basis_of_the_solver_changes_no_digit(orthonormal, patch):
    tip, angle = scenes.TIPS[3]
    K = [
        scenes.K_of(scenes.williams_edge(12, tip, angle, numerics=numerics_of(**options))[0])[0]
        for options in (
            {"tip_basis": MODES},
            {"tip_basis": MODES, "orthonormal": orthonormal, "patch": patch},
        )
    ]
    np.testing.assert_allclose(K[1], K[0], atol=1e-8)  # round-off times the condition number


def test_closed_lips_carry_the_pressure():
    """A uniform field lies in both spaces: round-off alone."""
    problem = xc.Problem(
        scenes.perturbed(12, seed=609),
        xc.Isotropic(1.3, 0.27, plane="strain"),
        [xc.line_crack([(-0.41, 0.013), (0.37, 0.013)])],
        loads=(xc.traction("top", (0.0, -1.0)), xc.traction("bottom", (0.0, 1.0))),
        numerics=numerics_of(tip_basis=MODES),
    )
    contact = xc.solve(problem).contact[0]
    np.testing.assert_allclose(contact.pressure[contact.closed], 1.0, atol=1e-8)
    assert contact.closed.all()


@pytest.mark.slow
@pytest.mark.mission
def test_in_space_both_solvers_agree():
    """Modes I to III at each point, in the frame of the nearest vertex of the front."""
    K, energy = [], []
    for options in (
        {"linear": "direct"},
        {"tip_basis": MODES, "linear": "direct"},
        {"tip_basis": MODES, "linear": "iterative"},
    ):
        problem, place = fronts.flat_scene(
            0.25, a=0.5, stress=MIXED, seed=3107, points=48, **options
        )
        solution = xc.solve(problem)
        points = int((solution.space.tips[0].point_to_function >= 0).sum())
        each = 3 if "tip_basis" in options else 12
        assert solution.report["tip functions"].unknowns == each * points
        sif = xc.stress_intensity(solution)
        K.append(sif.K)
        energy.append(solution.energy)
        wanted = fronts.exact_K(sif.x, place, 0.5, None, MIXED)
        size = np.abs(wanted).max(axis=0)
        mean, worst = (
            (K[-1] - wanted).mean(axis=0) / size,
            np.abs(K[-1] - wanted).max(axis=0) / size,
        )
        unknowns = solution.report.operations["unknowns"]
        print(f"\n{options}: mean {mean}, largest {worst}, {unknowns} unknowns")
    np.testing.assert_allclose(K[2], K[1], atol=1e-5)  # the tolerance of conjugate gradients
    assert np.abs(mean[0]) <= 0.02  # discretisation, a / h = 2
    assert (worst <= [0.06, 0.08, 0.15]).all()
    # Imposed displacements: a part of the space stores more energy than the whole.
    assert energy[1] >= energy[0]


def test_what_does_not_go_together():
    with pytest.raises(xc.ProblemError, match="functions = 2"):
        numerics_of(tip_basis=MODES, functions=2)
    with pytest.raises(xc.ProblemError, match=r"tip_basis = 'modes': give one of"):
        numerics_of(tip_basis="modes")
