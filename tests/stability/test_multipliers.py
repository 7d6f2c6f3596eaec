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
