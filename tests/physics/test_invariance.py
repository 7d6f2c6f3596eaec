"""What must not matter: units, position, numbering, the order of a crack's points, a mirror.

All tolerances here are round-off: the same arithmetic on other numbers. What round-off may grow
to is the condition number of the stiffness (1e4 ... 1e6 here) times 1e-16.
"""

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes

ROUND_OFF = 1e-8
SIDES = ("left", "right", "bottom", "top")
# An inner crack with a kink, and an edge crack from the left; both tips of both matter.
INNER = np.array([[-0.32, -0.29], [0.07, -0.21], [0.41, 0.04]])
EDGE = np.array([[-1.1, 0.43], [-0.38, 0.37]])
STRESS = np.array([[0.3, 0.4], [0.4, 1.0]])


def scene(order, points=None, cells=None, sets=None, *, cracks=(INNER, EDGE), stress=STRESS,
          E=1.0, plane="strain", loads=None, **options):  # fmt: skip
    """Uniform tractions on a perturbed square, no supports, two cracks, contact on its own."""
    base = scenes.perturbed(18, 31)
    mesh = xc.Mesh(
        base.points if points is None else points,
        base.cells if cells is None else cells,
        base.facet_sets if sets is None else sets,
    )
    if loads is None:
        loads = [xc.traction(s, lambda x, normal: normal @ stress) for s in SIDES]
    return xc.Problem(
        mesh, xc.Isotropic(E, 0.3, plane=plane), [xc.line_crack(c) for c in cracks],
        loads=loads, order=order, **options,
    )  # fmt: skip


def all_K(problem):
    """K and T of all tips of all cracks."""
    solution = xc.solve(problem)
    sif = [xc.stress_intensity(solution, c) for c in range(len(problem.cracks))]
    return np.concatenate([s.K for s in sif]), np.concatenate([s.T for s in sif])


def agree(result, wanted, label):
    K, T = result
    scale = np.abs(wanted[0]).max()
    error = np.abs(K - wanted[0]).max() / scale
    print(f"\n{label}: {error:.1e}")
    assert error <= ROUND_OFF
    assert np.abs(T - wanted[1]).max() <= 10 * ROUND_OFF * max(np.abs(wanted[1]).max(), scale)


@pytest.fixture(params=[1, 2], ids=["order1", "order2"])
def order(request):
    return request.param


@pytest.fixture(scope="module")
def reference():
    return {n: all_K(scene(n)) for n in (1, 2)}


pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


@pytest.mark.parametrize(("length", "stress"), [(1e3, 1.0), (1e-3, 1e9), (1e3, 1e-6), (1.0, 1e9)])
def test_units(order, reference, length, stress):
    """Lengths in other units, stresses and moduli too: K is stress times the root of length."""
    base = scenes.perturbed(18, 31)
    result = all_K(
        scene(
            order,
            length * base.points,
            cracks=(length * INNER, length * EDGE),
            stress=stress * STRESS,
            E=stress,
        )
    )
    K, T = reference[order]
    agree((result[0] / (stress * np.sqrt(length)), result[1] / stress), (K, T), "units")


@pytest.mark.parametrize("E", [1e-6, 2.1e11])
def test_modulus_alone(order, reference, E):
    """Tractions only: K does not know E."""
    agree(all_K(scene(order, E=E)), reference[order], "modulus")


@pytest.mark.parametrize("angle", [0.7, np.pi / 2, 2.9])
def test_body_rotated_and_shifted(order, reference, angle):
    Q, shift = scenes.rows(angle), np.array([3.7, -11.0])
    base = scenes.perturbed(18, 31)
    result = all_K(
        scene(
            order,
            base.points @ Q + shift,
            cracks=(INNER @ Q + shift, EDGE @ Q + shift),
            stress=Q.T @ STRESS @ Q,
        )
    )
    agree(result, reference[order], f"rotated by {angle:.2f}")


def test_far_from_the_origin(order, reference):
    """1e4 sizes of the body away: coordinates have lost four digits, and K no more."""
    shift = np.array([2e4, -1e4])
    base = scenes.perturbed(18, 31)
    result = all_K(scene(order, base.points + shift, cracks=(INNER + shift, EDGE + shift)))
    agree(result, reference[order], "far away")


def test_nodes_and_cells_renumbered(order, reference):
    base = scenes.perturbed(18, 31)
    rng = np.random.default_rng(5120947)
    new = rng.permutation(base.n_points)  # new[i]: new number of point i
    points = np.empty_like(base.points)
    points[new] = base.points
    cells = new[base.cells][rng.permutation(len(base.cells))]
    turn = rng.integers(0, 3, len(cells))
    cells = np.stack([np.roll(c, t) for c, t in zip(cells, turn, strict=True)])
    sets = {name: new[base.facet_sets[name]] for name in SIDES}
    agree(all_K(scene(order, points, cells, sets)), reference[order], "renumbered")


def test_points_of_the_cracks_reversed(order, reference):
    """Lip + is lip - now and the first tip the last: n and with it K_II change their signs."""
    K, T = all_K(scene(order, cracks=(INNER[::-1], EDGE[::-1])))
    order_of_tips = [1, 0, 2]
    agree((K[order_of_tips] * [1, -1], T[order_of_tips]), reference[order], "reversed")


def test_order_of_the_cracks(order, reference):
    K, T = all_K(scene(order, cracks=(EDGE, INNER)))
    agree((K[[1, 2, 0]], T[[1, 2, 0]]), reference[order], "cracks swapped")


def test_mirrored(order, reference):
    """x -> -x: the left of a direction becomes its right, so K_II changes its sign."""
    base = scenes.perturbed(18, 31)
    M = np.diag([-1.0, 1.0])
    result = all_K(
        scene(order, base.points @ M, cracks=(INNER @ M, EDGE @ M), stress=M @ STRESS @ M)
    )
    agree((result[0] * [1, -1], result[1]), reference[order], "mirrored")


def test_a_point_in_the_middle_of_a_straight_piece(order, reference):
    middle = np.insert(INNER, 1, 0.4 * INNER[0] + 0.6 * INNER[1], axis=0)
    agree(all_K(scene(order, cracks=(middle, EDGE))), reference[order], "point inserted")


def test_supports_that_hold_only_the_rigid_motion(order, reference):
    """Pinned at three unknowns instead of free: loads balance, so nothing changes."""
    base = scene(order)
    corner = [xc.fix((-1.0, -1.0)), xc.fix((1.0, -1.0), axis=1)]
    supported = xc.Problem(
        base.mesh, base.material, base.cracks, supports=corner, loads=base.loads, order=order
    )
    agree(all_K(supported), reference[order], "pinned")


def test_a_rigid_motion_of_all_supports(order):
    """Imposed displacements plus a small rotation and a shift: the same stresses."""
    result = []
    for turn in (0.0, 0.02):
        W = np.array([[0.0, -turn], [turn, 0.0]])
        supports = [
            xc.displacement("top", lambda x, W=W: 0.1 * x[:, ::-1] + x @ W.T + 3 * W[1]),
            xc.displacement("bottom", lambda x, W=W: 0.1 * x[:, ::-1] + x @ W.T + 3 * W[1]),
        ]
        base = scene(order, loads=())
        result.append(
            all_K(xc.Problem(base.mesh, base.material, base.cracks, supports=supports, order=order))
        )
    agree(result[1], result[0], "rigid motion")


def test_load_states_scale(order, reference):
    """A number as load state scales everything; states share nothing but the factor."""
    problem = scene(order, contact="off")
    alone = all_K(problem)[0]
    solutions = xc.solve(problem, states=[2.5, -1.0, 0.0])
    for factor, solution in zip((2.5, -1.0, 0.0), solutions, strict=True):
        K = np.concatenate([xc.stress_intensity(solution, c).K for c in range(2)])
        assert K == pytest.approx(factor * alone, abs=ROUND_OFF * np.abs(alone).max())


def test_superposition(order):
    """Open solutions are linear in the loads."""
    parts = [
        [xc.traction(s, lambda x, normal: normal @ STRESS) for s in SIDES],
        [xc.crack_pressure(0.7, crack=1)],
    ]
    each = [all_K(scene(order, loads=p, contact="off")) for p in parts]
    both = all_K(scene(order, loads=parts[0] + parts[1], contact="off"))
    agree(both, (each[0][0] + each[1][0], each[0][1] + each[1][1]), "superposition")


def test_the_same_numbers_twice(order):
    """To the last bit: nothing depends on memory, time or an order that is not ours."""
    first, second = all_K(scene(order)), all_K(scene(order))
    assert (first[0] == second[0]).all()
    assert (first[1] == second[1]).all()
