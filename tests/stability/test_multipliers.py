"""What a multiplier for each node does to pressures, beside the space in use.

`tests/physics/test_inf_sup_2d.py` and `test_inf_sup_3d.py` have the inf-sup constants.
"""

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def pressed(n, kind):
    """Largest error of the pressure on the inner lips, bending on compression, order 1."""
    angle, origin = 0.21, (0.05, -0.07)
    problem, _ = scenes.centre_crack(
        lambda x, y: scenes.bending_cycle(x, y, -1.2), n, order=1, angle=angle, origin=origin,
        contact="on", numerics=xc.Numerics(multipliers=kind),
    )  # fmt: skip
    contact = xc.solve(problem).contact[0]
    x = (contact.points - origin) @ scenes.rows(angle)[0]
    return float(np.abs(contact.pressure - (1.2 - x))[scenes.inner_part(contact.s)].max())


def test_pressure_of_bending():
    """Smooth with the reduced space; with one multiplier a node it does not settle."""
    reduced, naive = ([pressed(n, kind) for n in (20, 40)] for kind in ("reduced", "naive"))
    print(f"\npressure errors: reduced {reduced}, naive {naive}")
    assert reduced[1] <= 0.04  # discretisation
    assert reduced[1] <= 0.6 * reduced[0]
    assert naive[0] > 5 * reduced[0]


@pytest.mark.parametrize("order", [1, 2])
def test_sliver_of_a_hundred_millionth(order):
    """Uniform pressure, a crack 1e-8 of a cell above nodes: exact to round-off.

    With naive multipliers the system is singular: the last bits decide between round-off and 97 %.
    """
    field = scenes.turned(lambda x, y: exact.uniform_stress(x, y, -2, -2, 0, 1.0, 0.3), (0, 0))
    errors = {}
    for kind in ("reduced", "naive"):
        problem = scenes.on_box(
            xc.box((-1, -1), (1, 1), 10), [xc.line_crack([(-1.5, 2e-9), (0.37, 2e-9)])], field,
            traction=("left", "top"), order=order, contact="on",
            numerics=xc.Numerics(multipliers=kind),
        )  # fmt: skip
        errors[kind] = float(np.abs(xc.solve(problem).contact[0].pressure / 2 - 1).max())
    print(f"\n{errors}")
    assert errors["reduced"] <= 1e-10


# Junctions moved by next to nothing ---------------------------------------------------------------


def pressed_junction(seed, n, shift, order):
    """A pressed crack, from the lower side or inner, and one that ends on it, among squares."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.6:
        x = rng.uniform(-0.4, 0.4)
        main = np.array([(x, -1.001), (x + rng.uniform(-0.3, 0.3), rng.uniform(-0.4, 0.1))])
    else:
        ahead = rng.uniform(0.35, 0.5) * scenes.rows(rng.uniform(0, np.pi))[0]
        main = rng.uniform(-0.2, 0.2, 2) + np.array([-ahead, ahead])
    where = main[0] + rng.uniform(0.3, 0.7) * (main[1] - main[0])
    along = np.arctan2(*(main[1] - main[0])[::-1])
    turn = rng.choice([-1, 1]) * np.radians(rng.uniform(60, 120))
    branch = np.array([where, where + rng.uniform(0.3, 0.5) * scenes.rows(along + turn)[0]])
    spread = rng.uniform(-0.3, 0.3, (2, 2))
    stress = -np.eye(2) + (spread + spread.T) / 2
    loads = [xc.traction(side, lambda x, n: n @ stress) for side in scenes.SIDES]
    return xc.Problem(
        xc.box((-1, -1), (1, 1), n), xc.Isotropic(1.0, 0.3, plane="strain"),
        [xc.line_crack(main + shift), xc.line_crack(branch + shift)], loads=loads, order=order,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_junctions_moved_by_next_to_nothing(order):
    """In meshes of squares groups of pressures are halves of others: round-off decides nothing.

    K changes by a few times the move over a cell: round-off.
    """
    worst = 0.0
    for seed in range(350, 362):
        K = []
        for move in (0.0, 1e-10, 3e-10, 1e-9):
            shift = move * scenes.rows(seed + 1e9 * move)[0]
            solution = xc.solve(pressed_junction(seed, 16, shift, order))
            K.append([xc.stress_intensity(solution, c).K for c in (0, 1)])
        one, *others = (np.concatenate(k) for k in K)
        worst = max(worst, *(np.abs(other - one).max() / np.abs(one).max() for other in others))
    print(f"\norder {order}: K changes by {worst:.1e} at most")
    assert worst <= 1e-7
