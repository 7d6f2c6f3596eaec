"""Cracks that stay closed in smooth fields: rates of energy and pressure, and no oscillation.

Every tolerance is one of discretisation. `pytest -s` prints what was measured.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes

MESHES = Path(__file__).parents[2] / "examples" / "meshes"


def measure(problem, field, pressure):
    """Errors of a closed crack: energy norm, pressure in L2, largest on the inner 80 %."""
    solution = xc.solve(problem)
    contact = solution.contact[0]
    assert contact.closed.all()
    p = pressure(contact.points)
    inner = scenes.inner_part(contact.s)
    return (
        xc.energy_error(solution, lambda x: field(x)[1]),
        scenes.l2(contact.pressure, p, contact.measure),
        float(np.abs(contact.pressure - p)[inner].max() / p[inner].max()),
    )


def rates(computed, sizes, label):
    """Fitted rates of the three errors, printed with them."""
    result = [scenes.rate(errors, sizes) for errors in zip(*computed, strict=True)]
    for size, row in zip(sizes, computed, strict=True):
        print(f"\n{label} h {size:.4f}: E {row[0]:.3e}, p {row[1]:.3e}, max {row[2]:.3e}", end="")
    print(f"\n{label} rates: E {result[0]:.2f}, p {result[1]:.2f}, max {result[2]:.2f}")
    return result


# A plate with a hole, pressed across the crack (Kirsch, 1898) ------------------------------------


def kirsch(angle):
    """The load turned with the crack, which leaves the hole in the direction of the angle."""
    return scenes.turned(
        lambda x, y: exact.kirsch(x, y, 1.0, 1.0, 0.3, s=-1.0, alpha=np.pi / 2), (0, 0), angle
    )


def kirsch_pressure(x):
    r = np.linalg.norm(x, axis=1)
    return 0.5 * (2 + 1 / r**2 + 3 / r**4)


@cache
def plate_with_hole(parts, order, angle):
    """Errors on the mesh with cells of R / parts along the crack.

    No side is supported; the rim is a polygon, whose sides carry the exact traction too.
    """
    mesh = xc.read_mesh(MESHES / f"plate_with_hole_{parts:02d}.msh")
    field, ahead = kirsch(angle), scenes.rows(angle)[0]
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1.0, 0.3, "strain"),
        [xc.line_crack([0.9 * ahead, 2.6 * ahead])],
        loads=scenes.tractions(field, (*scenes.SIDES, "hole")),
        order=order,
        contact="on",
    )
    return measure(problem, field, kirsch_pressure)


@pytest.mark.parametrize("order", [1, 2])
def test_plate_with_hole(order):
    """The three coarser meshes; at h = R/20 two per cent are promised for the pressure."""
    result = [plate_with_hole(parts, order, 0.061) for parts in (5, 10, 20)]
    rate = rates(result, (1 / 5, 1 / 10, 1 / 20), f"Kirsch order {order}")
    assert rate[0] >= 0.95 * order
    assert rate[1] >= 0.9
    assert result[-1][1] <= 0.02
    # No oscillation: the largest error on the inner part is of the size of the mean one, and falls.
    assert result[-1][2] <= 0.03
    assert result[-1][2] < result[0][2]


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("angle", [0.0, 0.03], ids=["along the band", "turned"])
def test_plate_with_hole_over_four_meshes(order, angle):
    result = [plate_with_hole(parts, order, angle) for parts in (5, 10, 20, 40)]
    rate = rates(result, (1 / 5, 1 / 10, 1 / 20, 1 / 40), f"Kirsch order {order} angle {angle}")
    assert rate[0] >= 0.95 * order
    assert rate[1] >= 0.9
    assert result[2][1] <= 0.02
    assert rate[2] >= 0.9
    assert result[-1][2] <= 0.01


# A thick cylinder under outer pressure (Lamé, 1852) ----------------------------------------------

INNER, OUTER = 0.5, 1.5
lame = scenes.turned(
    lambda x, y: exact.lame_cylinder(x, y, INNER, OUTER, 0.0, 1.0, 1.0, 0.3), (0, 0)
)


def lame_pressure(x):
    r = np.linalg.norm(x, axis=1)
    return OUTER**2 / (OUTER**2 - INNER**2) * (1 + INNER**2 / r**2)


def thick_cylinder(n, order, ends):
    """Errors of a radial crack in a ring of n cells, under tractions all round."""
    ahead = scenes.rows(0.4)[0]
    problem = xc.Problem(
        scenes.annulus(INNER, OUTER, n, 5 * n),
        xc.Isotropic(1.0, 0.3, "strain"),
        [xc.line_crack([ends[0] * ahead, ends[1] * ahead])],
        loads=scenes.tractions(lame, ("inner", "outer")),
        order=order,
        contact="on",
    )
    return measure(problem, lame, lame_pressure)


RADIAL = {
    "from the bore": (0.4, 1.1),
    "through the wall": (0.4, 1.6),
    "inside the wall": (0.7, 1.3),
}


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ends", RADIAL.values(), ids=RADIAL)
def test_thick_cylinder(order, ends):
    sizes = (1 / 6, 1 / 12, 1 / 24)
    result = [thick_cylinder(n, order, ends) for n in (6, 12, 24)]
    rate = rates(result, sizes, f"Lamé order {order} {ends}")
    assert rate[0] >= 0.93 * order
    assert rate[1] >= 0.9
    assert result[-1][2] <= 0.02
    assert result[-1][2] < result[0][2]


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ends", RADIAL.values(), ids=RADIAL)
def test_thick_cylinder_over_four_meshes(order, ends):
    sizes = (1 / 6, 1 / 12, 1 / 24, 1 / 48)
    result = [thick_cylinder(n, order, ends) for n in (6, 12, 24, 48)]
    rate = rates(result, sizes, f"Lamé order {order} {ends}")
    assert rate[0] >= 0.95 * order
    assert rate[1] >= 0.9
    assert result[-1][2] <= 0.01


# A crack along an arc, in a smooth field without shear there -------------------------------------

CENTRE = np.array([-0.9, -0.1])
arc_field = scenes.turned(
    lambda x, y: exact.arc_manufactured(x, y, 1.0, 1.0, 0.3, p0=1.0, p2=0.5), CENTRE
)


def arc_pressure(x):
    theta = np.arctan2(*(x - CENTRE).T[::-1])
    return 1 + 0.5 * np.cos(2 * theta)


def arc(n, order):
    """Errors of a crack along an arc of one rad in [-1, 1]².

    The polyline has a piece a cell: its chords lie h² from the circle and turn by h against it,
    and inside a cell the crack face is straight in any case. That limits order 2 to rate 2 in
    energy.
    """
    theta = np.linspace(-0.45, 0.6, max(n // 2, 8) + 1)
    points = CENTRE + np.stack([np.cos(theta), np.sin(theta)], axis=1)
    problem = scenes.on_box(
        scenes.perturbed(n, 40 + n), [xc.line_crack(points)], arc_field, traction=("left",),
        order=order, contact="on",
    )  # fmt: skip
    return measure(problem, arc_field, arc_pressure)


@pytest.mark.parametrize("order", [1, 2])
def test_manufactured_arc(order):
    result = [arc(n, order) for n in (10, 20, 40)]
    rate = rates(result, (1 / 10, 1 / 20, 1 / 40), f"arc order {order}")
    assert rate[0] >= 0.95 * order
    assert rate[1] >= 0.9
    assert result[-1][2] <= 0.02
    assert result[-1][2] < result[0][2]


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("order", [1, 2])
def test_manufactured_arc_over_four_meshes(order):
    result = [arc(n, order) for n in (10, 20, 40, 80)]
    rate = rates(result, (1 / 10, 1 / 20, 1 / 40, 1 / 80), f"arc order {order}")
    assert rate[0] >= 0.95 * order
    assert rate[1] >= 0.9
    assert result[-1][2] <= 0.01


# A closed crack that slides in a field of quadratic pressure -------------------------------------

# sigma_yy(x, 0) = -(1 + 0.15 x + 0.3 x²), no shear there, on top of K_II = 0.6.
QUADRATIC = [(0, -0.5 + 0j, 0.0), (1, -0.02 + 0.05j, -0.015), (2, -0.02 + 0.03j, -0.02)]


@cache
def sliding_edge_crack(n, order, which, multipliers="reduced"):
    """|K_I|, relative error of K_II, of the pressure in L2 and its largest, for one tip."""
    tip, angle = scenes.TIPS[which]
    field = scenes.turned(
        scenes.added(
            lambda x, y: exact.williams(x, y, 1.0, 0.3, 0.0, 0.6),
            lambda x, y: scenes.polynomial_pressure(x, y, QUADRATIC),
        ),
        tip,
        angle,
    )
    problem = scenes.on_box(
        scenes.perturbed(n, 3 + which), [scenes.edge_line(tip, angle)], field,
        traction=("left",), order=order, contact="on",
        numerics=xc.Numerics(radius=0.4, multipliers=multipliers),
    )  # fmt: skip
    solution = xc.solve(problem)
    contact = solution.contact[0]
    p = scenes.pressure_of(QUADRATIC)((contact.points - np.asarray(tip)) @ scenes.rows(angle)[0])
    sif = xc.stress_intensity(solution)
    inner = scenes.inner_part(contact.s)
    return (
        abs(sif.K_integral[0, 0]),
        abs(sif.K_II[0] / 0.6 - 1),
        scenes.l2(contact.pressure, p, contact.measure),
        float(np.abs(contact.pressure - p)[inner].max()),
    )


def mean_of_tips(n, order, multipliers="reduced"):
    return np.mean([sliding_edge_crack(n, order, k, multipliers) for k in range(4)], axis=0)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_sliding_closed_crack_at_order_2():
    """The promise of order 2, worst of four tips at n = 20 with a disc of 0.4."""
    K_I, K_II, p, _ = np.max([sliding_edge_crack(20, 2, k) for k in range(4)], axis=0)
    print(f"\nclosed, order 2, n 20: |K_I| {K_I:.2e}, K_II {K_II:.2e}, p {p:.2e}")
    assert K_II <= 5e-6
    assert K_I <= 1e-3
    assert p <= 2e-3


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("order", [1, 2])
def test_sliding_closed_crack_converges(order):
    """K_II twice as fast as the energy; the pressure has the singular field beside it."""
    rows = [mean_of_tips(n, order) for n in (10, 20, 40)]
    for n, row in zip((10, 20, 40), rows, strict=True):
        print(f"\nclosed, order {order}, n {n}: |K_I| {row[0]:.2e}, K_II {row[1]:.2e}, "
              f"p {row[2]:.2e}, max {row[3]:.2e}", end="")  # fmt: skip
    rate = [scenes.rate(errors, (1 / 10, 1 / 20, 1 / 40)) for errors in zip(*rows, strict=True)]
    print(f"\nrates: K_I {rate[0]:.2f}, K_II {rate[1]:.2f}, p {rate[2]:.2f}, max {rate[3]:.2f}")
    assert rate[1] >= (1.7 if order == 1 else 3.0)
    assert rate[2] >= (0.9 if order == 1 else 1.5)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_naive_multipliers_oscillate():
    """One multiplier a node: the largest error on the inner lip does not fall with the mesh."""
    naive = np.array([mean_of_tips(n, 1, "naive") for n in (10, 20, 40)])
    reduced = np.array([mean_of_tips(n, 1) for n in (10, 20, 40)])
    print(f"\nnaive p {naive[:, 2]}, max {naive[:, 3]}")
    print(f"reduced p {reduced[:, 2]}, max {reduced[:, 3]}")
    assert (naive[:, 3] > 0.1).all()
    assert naive[-1, 3] > 10 * reduced[-1, 3]
    assert naive[-1, 2] > 5 * reduced[-1, 2]
