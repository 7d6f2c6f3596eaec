"""Contact patch tests: uniform and linear pressures come out exactly, wherever the crack runs.

The exact displacements are in the space, so every tolerance here is one of round-off: it is free
of mesh size, cut position and tip position.
"""

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.scenes_2d import SIDES, numerics_of

P0 = 2.5
EXACT = 1e-10  # round-off; measured 1e-15 to 2e-12
# Rows of nodes at y = 0, ±0.2, ... in [-1, 1]² with 10 cells a side.
CELL = 0.2
CUTS = (0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-14, 0.0)
CUTS_BELOW = (-1e-14, -1e-12, -1e-10, -1e-8, -1e-4, -0.1)
# All sides under tractions: the body floats; two of them; none: held all round.
DATA = (SIDES, ("left", "top"), ())

uniform = scenes.turned(lambda x, y: exact.uniform_stress(x, y, -P0, -P0, 0.0, 1.0, 0.3), (0, 0))


def deviation(problem, pressure=P0):
    """Largest error of the pressure, relative to the largest pressure."""
    solution = xc.solve(problem)
    assert len(solution.contact) == len(problem.cracks)
    worst = 0.0
    for contact in solution.contact:
        exact_p = pressure(contact.points) if callable(pressure) else pressure
        worst = max(worst, float(np.abs(contact.pressure - exact_p).max() / np.abs(exact_p).max()))
        assert contact.closed.all()
        # Gaps are round-off too, of displacements of size P0 / E.
        assert np.abs(contact.gap).max() <= 1e-9 * P0
    return worst


def uniform_patch(mesh, cracks, order, traction=SIDES, **options):
    """Worst deviation of the multipliers from P0."""
    problem = scenes.on_box(
        mesh, cracks, uniform, traction=traction, order=order, contact="on", **options
    )
    return deviation(problem)


def drawn_crack(seed):
    """Straight crack anywhere in [-1, 1]²: in every third the first tip is a mouth instead."""
    rng = np.random.default_rng(seed)
    middle, length = rng.uniform(-0.25, 0.25, 2), rng.uniform(0.25, 0.45)
    ahead = scenes.rows(rng.uniform(0, 2 * np.pi))[0]
    back = 2.5 if seed % 3 == 0 else length
    return xc.line_crack([middle - back * ahead, middle + length * ahead])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("data", range(3), ids=["tractions", "mixed", "displacements"])
def test_crack_of_any_angle(order, data):
    for seed in range(310, 316):
        traction = DATA[data]
        if seed % 3 == 0 and not traction:
            traction = ("left",)
        mesh = scenes.perturbed(9 + seed % 7, seed)
        assert uniform_patch(mesh, [drawn_crack(seed)], order, traction) <= EXACT, seed


TIPS = {
    "two tips anywhere": (-0.43, 0.37),
    "one tip anywhere": (-1.5, 0.37),
    "tips on nodes": (-0.4, 0.4),
    "tips 1e-12 from nodes": (-0.4 + 1e-12, 0.4 - 1e-12),
    "tips amid mesh edges": (-0.3, 0.5),
    "one tip on a node": (-1.5, 0.4),
}


def parallel_patch(order, ends, eps):
    """Deviation for a crack parallel to a row of nodes, at a share eps of a cell from it."""
    mesh = xc.box((-1, -1), (1, 1), 10)
    crack = xc.line_crack([(ends[0], eps * CELL), (ends[1], eps * CELL)])
    return uniform_patch(mesh, [crack], order, ("left", "top"))


@pytest.mark.parametrize("order", [1, 2])
def test_any_cut_position(order):
    """From half a cell above the nodes down to 1e-14, on them, and below; ends take turns."""
    ends = list(TIPS.values())
    for k, eps in enumerate(CUTS + CUTS_BELOW):
        assert parallel_patch(order, ends[k % len(ends)], eps) <= EXACT, eps
    for tips in ends:
        assert parallel_patch(order, tips, 0.0) <= EXACT, tips


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ends", TIPS.values(), ids=TIPS)
def test_any_cut_position_and_any_tip(order, ends):
    for eps in CUTS + CUTS_BELOW:
        assert parallel_patch(order, ends, eps) <= EXACT, eps


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("slope", [1, -1])
def test_crack_along_diagonals_of_the_mesh(order, slope):
    """Exactly on the diagonals of the cells, or across them through nodes, and next to that."""
    mesh = xc.box((-1, -1), (1, 1), 10)
    along = np.array([1.0, slope])
    across = np.array([-slope, 1.0]) * CELL
    ends = ((-0.4, 0.4), (-0.37, 0.41), (-0.4 + 1e-12, 0.3), (-1.5, 0.33))
    for k, eps in enumerate((0.0, 0.1, 1e-3, 1e-8, 1e-12, -1e-12, -1e-8)):
        for first, last in ends if eps == 0 else (ends[k % 4], ends[(k + 1) % 4]):
            crack = xc.line_crack([first * along + eps * across, last * along + eps * across])
            assert uniform_patch(mesh, [crack], order) <= EXACT, (eps, first)


@pytest.mark.parametrize("order", [1, 2])
def test_tip_at_nodes_and_edges_from_any_direction(order):
    """The tip on a node, on an edge, in a cell's middle, and at 1e-6 … 1e-14 of them."""
    mesh = xc.box((-1, -1), (1, 1), 10)
    shift = np.array([0.6, -0.8]) * CELL
    for k, at in enumerate([(0.2, 0.0), (0.3, 0.0), (0.3, 0.1), (1 / 15, 2 / 15)]):
        for j, eps in enumerate((0.0, 1e-14, 1e-12, 1e-6)):
            tip = np.array(at) + eps * shift
            ahead = scenes.rows(0.3 + 1.1 * k + 0.7 * j)[0]
            crack = xc.line_crack([tip - 0.63 * ahead, tip])
            assert uniform_patch(mesh, [crack], order) <= EXACT, (at, eps)


@pytest.mark.parametrize("order", [1, 2])
def test_kinked_cracks(order):
    """Kinks anywhere, also less than a cell from a tip."""
    for seed in range(520, 526):
        rng = np.random.default_rng(seed)
        turns = np.cumsum(rng.uniform(-0.9, 0.9, 4)) + rng.uniform(0, 2 * np.pi)
        steps = rng.uniform(0.12, 0.3, 4)[:, None] * np.array([scenes.rows(t)[0] for t in turns])
        points = np.cumsum(np.concatenate([rng.uniform(-0.3, 0.3, (1, 2)), steps]), axis=0)
        points -= 0.5 * points.mean(axis=0)
        mesh = scenes.perturbed(9 + seed % 4, seed)
        assert uniform_patch(mesh, [xc.line_crack(points)], order) <= EXACT, seed


@pytest.mark.parametrize("order", [1, 2])
def test_arc_and_several_cracks(order):
    t = np.linspace(-0.7, 0.9, 15)
    arc = xc.line_crack(np.stack([0.6 * np.cos(t) - 0.2, 0.6 * np.sin(t)], axis=1))
    second = xc.line_crack([(-1.2, 0.31), (-0.28, 0.12)])
    mesh = scenes.perturbed(17, 91)
    assert uniform_patch(mesh, [arc, second], order) <= EXACT


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    "numerics",
    [
        {"enrichment": "topological"},
        {"functions": 2},
        {"radius": 0.21},
        {"orthonormal": "node"},
        {"patch": True},
        {"points": 3},
    ],
    ids=str,
)
def test_no_option_of_method_spoils_it(order, numerics):
    mesh = scenes.perturbed(11, 77)
    crack = drawn_crack(311)
    result = uniform_patch(mesh, [crack], order, numerics=numerics_of(**numerics))
    assert result <= EXACT


@pytest.mark.parametrize("order", [1, 2])
def test_material_has_no_part_in_it(order):
    """Plane stress and strain, nearly incompressible, and units: 1e-10 as above."""
    mesh, crack = scenes.perturbed(11, 78), drawn_crack(313)
    for E, nu, plane in ((1e9, 0.0, "strain"), (210e3, 0.3, "stress"), (1.0, 0.499, "strain")):
        field = scenes.turned(
            lambda x, y, E=E, nu=nu, plane=plane: exact.uniform_stress(
                x, y, -P0, -P0, 0.0, E, nu, plane
            ),
            (0, 0),
        )
        problem = scenes.on_box(
            mesh, [crack], field, traction=("left", "top"), order=order, plane=plane, E=E, nu=nu,
            contact="on",
        )  # fmt: skip
        assert deviation(problem) <= EXACT


@pytest.mark.parametrize("order", [1, 2])
def test_without_the_consistent_correction_it_fails(order):
    """The correction is what makes the test exact: ordinary quadrature leaves 1e-6 and more."""
    problem = scenes.on_box(
        scenes.perturbed(11, 77), [drawn_crack(311)], uniform, traction=SIDES, order=order,
        contact="on", numerics=xc.Numerics(consistent=False),
    )  # fmt: skip
    result = np.abs(xc.solve(problem).contact[0].pressure / P0 - 1).max()
    assert 1e-7 < result < 0.1


# Sliding -----------------------------------------------------------------------------------------


def sliding(angle, origin, shift=0.01):
    """Uniform pressure over an interface whose sides slide: another s_xx and a shift on each."""
    return scenes.turned(
        lambda x, y: exact.slip_patch(x, y, 1.0, 0.3, p=P0, shift=shift), origin, angle
    )


def sliding_patch(mesh, angle, origin, order, traction):
    """Deviations of pressure and of sliding, of a crack that cuts the square in two."""
    origin, ahead = np.asarray(origin), scenes.rows(angle)[0]
    crack = xc.line_crack([origin - 2 * ahead, origin + 2 * ahead])
    field = sliding(angle, origin)
    problem = scenes.on_box(mesh, [crack], field, traction=traction, order=order, contact="on")
    solution = xc.solve(problem)
    contact = solution.contact[0]
    slip = np.einsum("qd,d->q", solution.jump(0), ahead)
    along = (contact.points - origin) @ ahead
    # [u_x] = shift + (s⁺ - s⁻) x (1 - nu²) / E of `exact.slip_patch`
    exact_slip = 0.01 + 0.5 * along * (1 - 0.3**2)
    assert np.abs(contact.gap).max() <= 1e-9 * P0
    assert contact.closed.all()
    return max(
        np.abs(contact.pressure / P0 - 1).max(),
        np.abs(slip - exact_slip).max() / np.abs(exact_slip).max(),
    )


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("traction", [(), ("left",), ("left", "right")], ids=str)
def test_sliding_at_any_angle(order, traction):
    for seed in range(640, 644):
        rng = np.random.default_rng(seed)
        mesh = scenes.perturbed(8 + seed % 5, seed)
        result = sliding_patch(
            mesh, rng.uniform(-0.7, 0.7), rng.uniform(-0.2, 0.2, 2), order, traction
        )
        assert result <= EXACT, seed


@pytest.mark.parametrize("order", [1, 2])
def test_sliding_at_any_cut_position(order):
    mesh = xc.box((-1, -1), (1, 1), 10)
    for eps in CUTS + CUTS_BELOW:
        result = sliding_patch(mesh, 0.0, (0.0, eps * CELL), order, ("left", "right"))
        assert result <= EXACT, eps


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("traction", [(), ("left",)], ids=str)
def test_sliding_where_the_cut_sides_are_supported(order, traction):
    """Displacements imposed on the sides the crack leaves through, whatever sliver it leaves."""
    mesh = xc.box((-1, -1), (1, 1), 10)
    for eps in CUTS + CUTS_BELOW:
        result = sliding_patch(mesh, 0.0, (0.0, eps * CELL), order, traction)
        assert result <= EXACT, eps


@pytest.mark.parametrize("order", [1, 2])
def test_tip_next_to_a_supported_side(order):
    """Tip functions that reach a side with imposed displacements: 1e-8, round-off of the fit."""
    for k, tip in enumerate([(0.72, 0.77), (-0.635, -0.681), (0.574, 0.765)]):
        ahead = scenes.rows(0.6 + 0.3 * k)[0] * (-1 if k == 1 else 1)
        crack = xc.line_crack([np.array(tip) - 0.9 * ahead, tip])
        result = uniform_patch(scenes.perturbed(7 + 2 * k, 31 + k), [crack], order, ())
        assert result <= 1e-8, tip


# Linear pressure ---------------------------------------------------------------------------------

# Uniform, and two of Airy's cubics; pressure 1 - (0.28 x) along the crack, with shear off it.
LINEAR = [(0, -0.5 + 0j, 0.0), (1, 0.03 + 0.07j, 0.05)]


def linear_patch(mesh, points, order=2, traction=SIDES, origin=(0.0, 0.0), angle=0.0):
    """Deviation of the multipliers from a pressure that falls along the crack."""
    field = scenes.turned(lambda x, y: scenes.polynomial_pressure(x, y, LINEAR), origin, angle)
    law = scenes.pressure_of(LINEAR)
    ahead = scenes.rows(angle)[0]
    problem = scenes.on_box(
        mesh, [xc.line_crack(points)], field, traction=traction, order=order, contact="on"
    )
    return deviation(problem, lambda x: law((x - np.asarray(origin)) @ ahead))


@pytest.mark.parametrize("data", range(3), ids=["tractions", "mixed", "displacements"])
def test_linear_pressure_at_order_2(data):
    for seed in range(710, 716):
        rng = np.random.default_rng(seed)
        angle, origin = rng.uniform(0, 2 * np.pi), rng.uniform(-0.25, 0.25, 2)
        first = -2.5 if seed % 3 == 0 and data == 0 else -rng.uniform(0.25, 0.45)
        ends = np.array([first, rng.uniform(0.25, 0.45)])
        result = linear_patch(
            scenes.perturbed(9 + seed % 6, seed),
            origin + ends[:, None] * scenes.rows(angle)[0],
            traction=DATA[data],
            origin=origin,
            angle=angle,
        )
        assert result <= EXACT, seed


def parallel_linear(ends, eps):
    y = eps * CELL
    mesh = xc.box((-1, -1), (1, 1), 10)
    return linear_patch(
        mesh, [(ends[0], y), (ends[1], y)], traction=("left", "right"), origin=(0.0, y)
    )


def test_linear_pressure_at_any_cut_position():
    ends = [*TIPS.values(), (-1.5, 1.5)]
    for k, eps in enumerate(CUTS + CUTS_BELOW):
        assert parallel_linear(ends[k % len(ends)], eps) <= EXACT, eps


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("ends", [*TIPS.values(), (-1.5, 1.5)], ids=[*TIPS, "no tip"])
def test_linear_pressure_at_any_cut_position_and_any_tip(ends):
    for eps in CUTS + CUTS_BELOW:
        assert parallel_linear(ends, eps) <= EXACT, eps
