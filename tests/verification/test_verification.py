"""The exact fields: elasticity by differences, faces, limits at tips, and tables against formulas.

Each field is checked by laws that it was not made from, or against a source of its own.
"""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from xcrack import ProblemError
from xcrack.verification.exact import (
    arcs,
    closed,
    fields_2d,
    fields_3d,
    kinks,
    lives,
    plates,
)
from xcrack.verification.exact import potentials_2d as potentials

E, NU, A = 2.0, 0.3, 0.9
RNG = 60317
PLANES = ("strain", "stress")

FIELDS = {
    "williams": lambda x, y, plane: fields_2d.williams(
        x, y, E, NU, 1.0, 0.5, 0.3, plane, A=[0.2], B=[-0.1]),
    "griffith": lambda x, y, plane: fields_2d.griffith(x, y, A, E, NU, 0.1, 1.0, 0.4, plane),
    "periodic": lambda x, y, plane: fields_2d.periodic(x, y, 0.4, 3.0, E, NU, 1.0, 0.2, 0.3, plane),
    "slip": lambda x, y, plane: fields_2d.slip_patch(x, y, E, NU, plane=plane),
    "closed": lambda x, y, plane: closed.closed_crack(x, y, A, E, NU, 0.1, -1.0, 0.6, 0.2, plane),
    "partial": lambda x, y, plane: closed.partial_closure(x, y, A, E, NU, 0.1, 1.0, 0.2, plane),
    "centre": lambda x, y, plane: closed.centre_open(x, y, A, E, NU, 1.0, 0.3, plane),
    "kirsch": lambda x, y, plane: plates.kirsch(x, y, 0.3, E, NU, 1.0, 0.4, -0.2, plane),
    "lame": lambda x, y, plane: plates.lame_cylinder(x, y, 0.3, 2.0, 1.0, 0.4, E, NU, plane),
    "arc": lambda x, y, plane: arcs.ArcCrack(0.7, 0.8, E, NU, 1.0, 0.4, 0.3, plane).field(x, y),
    "smooth arc": lambda x, y, plane: arcs.arc_manufactured(x, y, 0.7, E, NU, plane=plane),
}  # fmt: skip


def off_the_cracks():
    """Points that stay 0.05 off y = 0, the arc, the hole and each tip."""
    x, y = np.random.default_rng(RNG).uniform(-1.4, 1.4, (2, 400))
    r = np.hypot(x, y)
    far = (np.abs(y) > 0.05) & (np.abs(r - 0.7) > 0.05) & (r > 0.4)
    return x[far], y[far]


def difference(function, x, y, h=1e-4):
    """Derivatives along x and y, to the order h²."""
    return (
        (function(x + h, y) - function(x - h, y)) / (2 * h),
        (function(x, y + h) - function(x, y - h)) / (2 * h),
    )


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("name", FIELDS)
def test_field_obeys_hooke_and_is_in_equilibrium(name, plane):
    """Truncation of the differences, h² times third derivatives near tips."""
    field, (x, y) = FIELDS[name], off_the_cracks()
    s = field(x, y, plane)[1]
    u_x, u_y = difference(lambda x, y: field(x, y, plane)[0], x, y)
    along, across, shear = u_x[:, 0], u_y[:, 1], u_x[:, 1] + u_y[:, 0]
    if plane == "strain":
        factor, nu = E / (1 + NU) / (1 - 2 * NU), NU
        hooke = factor * np.array([(1 - nu) * along + nu * across, (1 - nu) * across + nu * along])
    else:
        hooke = E / (1 - NU**2) * np.array([along + NU * across, across + NU * along])
    hooke = np.array([*hooke, E / (2 * (1 + NU)) * shear]).T
    assert s == pytest.approx(hooke, abs=2e-4)
    s_x, s_y = difference(lambda x, y: field(x, y, plane)[1], x, y)
    forces = np.array([s_x[:, 0] + s_y[:, 2], s_x[:, 2] + s_y[:, 1]])
    assert forces == pytest.approx(0.0, abs=5e-4)


def test_open_faces_are_free_and_closed_ones_carry_the_pressure():
    """Round-off."""
    x = np.linspace(-0.85, 0.85, 35)
    pressures = {
        "griffith": 0 * x,
        "closed": 0 * x + 1.0,
        "partial": closed.partial_closure_pressure(x, A, 0.1, 1.0),
        "centre": closed.centre_open_pressure(x, A, 1.0, 0.3),
    }
    calls = {
        "griffith": lambda side: fields_2d.griffith(x, 0, A, E, NU, 0.1, 1.0, 0.4, side=side),
        "closed": lambda side: closed.closed_crack(x, 0, A, E, NU, 0.1, -1.0, 0.6, side=side),
        "partial": lambda side: closed.partial_closure(x, 0, A, E, NU, 0.1, 1.0, 0.2, side=side),
        "centre": lambda side: closed.centre_open(x, 0, A, E, NU, 1.0, 0.3, side=side),
    }
    openings = {
        "griffith": 4 / potentials.plane_modulus(E, NU) * np.sqrt(A * A - x * x),
        "closed": 0 * x,
        "partial": closed.partial_closure_opening(x, A, E, NU, 0.1, 1.0),
        "centre": closed.centre_open_opening(x, A, E, NU, 1.0, 0.3),
    }
    for name, call in calls.items():
        (upper, stress), (lower, other) = call(1), call(-1)
        for s in (stress, other):
            assert s[:, 1] == pytest.approx(-pressures[name], abs=1e-12), name
            assert s[:, 2] == pytest.approx(0.0, abs=1e-12), name
        assert (upper - lower)[:, 1] == pytest.approx(openings[name], abs=1e-12), name


def test_friction_carries_its_share():
    """Round-off: K_II from the slip at the middle of the crack, 4 tau a / E'."""
    (upper, stress), (lower, _) = (
        closed.closed_crack(0.0, 0.0, A, E, NU, 0.0, -1.0, 0.6, 0.2, side=side) for side in (1, -1)
    )
    slip = 4 * 0.4 * A / potentials.plane_modulus(E, NU)
    assert abs(upper - lower)[0] == pytest.approx(slip, rel=1e-12)
    assert stress[2] == pytest.approx(0.2, rel=1e-12)


def limit_of_K(field, tip, r=1e-10):
    """sqrt(2 pi r) times the stress ahead of a right tip on y = 0."""
    stress = field(tip + r, 0.0)[1]
    return np.sqrt(2 * np.pi * r) * stress[1:3]


def test_K_is_the_limit_of_the_stress():
    """Next term of the expansion, of the order sqrt(r): 1e-5 of the stress."""
    root = np.sqrt(np.pi * A)
    cases = [
        (lambda x, y: fields_2d.williams(x, y, E, NU, 1.0, 0.5, 0.3), 0.0, (1.0, 0.5)),
        (lambda x, y: fields_2d.griffith(x, y, A, E, NU, 0.1, 1.0, 0.4), A, (root, 0.4 * root)),
        (lambda x, y: fields_2d.periodic(x, y, 0.4, 3.0, E, NU, 1.0, 0.2, 0.3), 0.4,
         fields_2d.periodic_K(0.4, 3.0) * np.array([1.0, 0.3])),
        (lambda x, y: closed.partial_closure(x, y, A, E, NU, 0.1, 1.0), A,
         (closed.partial_closure_params(A, 0.1, 1.0)[2], 0.0)),
        (lambda x, y: closed.centre_open(x, y, A, E, NU), A, (0.0, 0.0)),
    ]  # fmt: skip
    for field, tip, K in cases:
        assert limit_of_K(field, tip) == pytest.approx(K, abs=3e-5)


def test_row_of_far_cracks_is_one_crack():
    """Next term in (pi a / W)² / 6."""
    assert fields_2d.periodic_K(0.01, 10.0) == pytest.approx(np.sqrt(np.pi * 0.01), rel=1e-5)


@pytest.mark.parametrize("alpha", [0.2, 0.8, 1.4])
def test_arc_under_equal_tension_has_the_K_of_its_formula(alpha):
    """Limit at a distance of 1e-8 of the tip: 1e-8 relative was seen."""
    arc = arcs.ArcCrack(0.7, alpha, E, NU, 1.0, 1.0)
    K_I, K_II = arcs.arc_K_biaxial(0.7, alpha)
    for K in (arc.K_upper, arc.K_lower):
        assert [K[0], abs(K[1])] == pytest.approx([K_I, K_II], rel=1e-6)
    assert arc.K_upper[1] == pytest.approx(-arc.K_lower[1], rel=1e-6)


def test_short_arc_is_a_straight_crack():
    """Next term in alpha: the chord stands upright, pulled along x."""
    arc = arcs.ArcCrack(100.0, 1e-3, E, NU, 1.0, 0.0, 0.0)
    assert arc.K_upper[0] == pytest.approx(np.sqrt(np.pi * 0.1), rel=1e-3)


def test_faces_of_arcs():
    """Round-off of 1e-9 beside the arc; the smooth field has the pressure that it is made for."""
    theta = np.linspace(-0.7, 0.7, 15)
    n = np.array([np.cos(theta), np.sin(theta)]).T
    arc = arcs.ArcCrack(0.7, 0.8, E, NU, 1.0, 0.4, 0.3)
    for r in (0.7 * (1 - 1e-9), 0.7 * (1 + 1e-9)):
        s = arc.field(*(r * n).T)[1]
        traction = [s[:, 0] * n[:, 0] + s[:, 2] * n[:, 1], s[:, 2] * n[:, 0] + s[:, 1] * n[:, 1]]
        assert np.array(traction) == pytest.approx(0.0, abs=1e-6)
    s = arcs.arc_manufactured(*(0.7 * n).T, 0.7, E, NU, 1.0, 0.5)[1]
    traction = [s[:, 0] * n[:, 0] + s[:, 2] * n[:, 1], s[:, 2] * n[:, 0] + s[:, 1] * n[:, 1]]
    assert np.array(traction).T == pytest.approx(
        -(1 + 0.5 * np.cos(2 * theta))[:, None] * n, abs=1e-12
    )


def test_holes_are_loaded_as_stated():
    """Round-off."""
    theta = np.linspace(0, 2 * np.pi, 17)
    n = np.array([np.cos(theta), np.sin(theta)]).T

    def traction(s):
        pairs = [s[:, 0] * n[:, 0] + s[:, 2] * n[:, 1], s[:, 2] * n[:, 0] + s[:, 1] * n[:, 1]]
        return np.array(pairs).T

    s = plates.kirsch(*(0.3 * n).T, 0.3, E, NU, 1.0, 0.4)[1]
    assert traction(s) == pytest.approx(0.0, abs=1e-12)
    assert s[:, 0] + s[:, 1] == pytest.approx(plates.kirsch_hoop(0.3, 0.3, 1.0, theta - 0.4))
    for r, p in ((0.3, 1.0), (2.0, 0.4)):
        s = plates.lame_cylinder(*(r * n).T, 0.3, 2.0, 1.0, 0.4, E, NU)[1]
        assert traction(s) == pytest.approx(-p * n, abs=1e-12)


# Three dimensions -----------------------------------------------------------------------------

S = np.array([[0.2, 0.1, 0.3], [0.1, -0.1, 0.4], [0.3, 0.4, 1.0]])


def stress_of(displacement, x, h=1e-4):
    """Stress by differences of displacements."""
    steps = h * np.eye(3)
    gradient = np.stack(
        [(displacement(x + d) - displacement(x - d)) / (2 * h) for d in steps], axis=-1
    )
    strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return E / (1 + NU) * (strain + NU / (1 - 2 * NU) * trace * np.eye(3))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_penny_is_in_equilibrium_with_free_or_sliding_faces(sign):
    """Differences of differences: round-off over h², and truncation."""
    remote = S * np.array([[1, 1, 1], [1, 1, 1], [1, 1, sign]])
    x = np.random.default_rng(RNG).uniform(-1, 1, (60, 3))
    x = x[(np.abs(x[:, 2]) > 0.1)]

    def u(x):
        return fields_3d.penny(x, 0.5, E, NU, remote)

    h = 1e-2
    divergence = sum(
        (stress_of(u, x + d)[..., i] - stress_of(u, x - d)[..., i]) / (2 * h)
        for i, d in enumerate(h * np.eye(3))
    )
    assert divergence == pytest.approx(0.0, abs=2e-2)
    radius, omega = 0.3, np.linspace(0, 6, 7)
    face = np.stack([radius * np.cos(omega), radius * np.sin(omega), 0 * omega + 2e-4], axis=1)
    traction = stress_of(u, face)[..., 2]
    assert traction[:, 2] == pytest.approx(min(sign, 0.0), abs=5e-3)
    assert traction[:, :2] == pytest.approx(0.0, abs=5e-3)


def test_jump_at_a_front_has_the_K_of_its_formula():
    """Next term along the face, of the order of the distance, 1e-6 of the radius."""
    a, d = 0.5, 5e-7
    omega = np.linspace(0, 2 * np.pi, 9)
    n = np.stack([np.cos(omega), np.sin(omega), 0 * omega], axis=1)
    tangent = np.stack([-n[:, 1], n[:, 0], 0 * omega], axis=1)
    faces = [(a - d) * n + [0, 0, z] for z in (1e-14, -1e-14)]
    jump = np.subtract(*(fields_3d.penny(x, a, E, NU, S) for x in faces))
    K_I, K_II, K_III = fields_3d.penny_K(
        omega - np.arctan2(0.4, 0.3), a, NU, 1.0, float(np.hypot(0.3, 0.4))
    )
    mu, root = E / (2 * (1 + NU)), np.sqrt(2 * np.pi / d)
    plane = root * mu / (4 * (1 - NU))
    assert plane * jump[:, 2] == pytest.approx(K_I, rel=1e-5)
    assert plane * (jump * n).sum(axis=1) == pytest.approx(K_II, abs=1e-5)
    assert root * mu / 4 * (jump * tangent).sum(axis=1) == pytest.approx(K_III, abs=1e-5)


def test_friction_holds_a_penny():
    K = fields_3d.penny_K(np.zeros(1), 0.5, NU, -1.0, 0.4, friction=0.5)
    assert np.array(K) == pytest.approx(0.0)
    closed_penny = np.diag([0.0, 0.0, -1.0])
    closed_penny[0, 2] = closed_penny[2, 0] = 0.4
    x = np.random.default_rng(RNG).uniform(-1, 1, (5, 3))
    u = fields_3d.penny(x, 0.5, E, NU, closed_penny, friction=0.5)
    assert u == pytest.approx(fields_3d.uniform_stress_3d(x, closed_penny, E, NU)[0])


def test_round_ellipse_is_a_penny():
    """Round-off for K; quadrature of the displacements."""
    omega = np.linspace(0, 6, 7)
    round_K = fields_3d.ellipse_K(omega, 0.5, 0.5 * (1 - 1e-9), NU, 1.0, 0.4)
    assert np.array(round_K) == pytest.approx(
        np.array(fields_3d.penny_K(omega, 0.5, NU, 1.0, 0.4)), abs=1e-8
    )
    x = np.random.default_rng(RNG).uniform(-1, 1, (40, 3))
    x = x[np.abs(x[:, 2]) > 0.2]
    assert fields_3d.ellipse_displacement(x, 0.5, 0.5, E, NU, S) == pytest.approx(
        fields_3d.penny(x, 0.5, E, NU, S), abs=1e-7
    )


def test_ellipse_under_tension_is_that_of_irwin():
    """Round-off: two forms, by Carlson's and by Legendre's integrals."""
    theta = np.linspace(0, np.pi / 2, 9)
    K_I = fields_3d.ellipse_K(theta, 0.6, 0.4, NU, 1.0)[0]
    assert pytest.approx(fields_3d.ellipse_K_I(theta, 0.6, 0.4, 1.0), rel=1e-12) == K_I


# Tables ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "formula", "within", "last"),
    [
        (plates.STRIP_CENTRE, plates.strip_centre_K, 0.002, 0.8),
        (plates.STRIP_EDGE_TENSION, plates.strip_edge_K, 0.006, 0.9),
        (plates.STRIP_EDGE_BENDING, plates.strip_bending_K, 0.01, 0.6),
    ],
)
def test_formulas_and_tables_of_strips_agree(table, formula, within, last):
    """The accuracy that the formulas claim, and the digits of the tables."""
    share = np.array([v for v in table if v <= last])
    assert formula(share) == pytest.approx([table[v] for v in share], rel=within)


def test_tables_tend_to_their_limits():
    """A long plate is a strip; a short edge crack that of a half plane; a hole with long cracks."""
    for share in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7):
        assert plates.PLATE_CENTRE[2.0, share] == pytest.approx(plates.STRIP_CENTRE[share], 2e-3)
        if share < 0.7:
            strip = plates.STRIP_EDGE_TENSION[share]
            assert plates.PLATE_EDGE[1.0, share] == pytest.approx(strip, rel=1e-3)
    assert plates.strip_edge_K(1e-6) == pytest.approx(plates.EDGE_HALFPLANE, rel=2e-3)
    # Two long cracks are one of the length between their tips: sqrt((a + R) / a).
    assert plates.BOWIE[10.0][0] == pytest.approx(np.sqrt(1.1), rel=2e-3)
    assert plates.BOWIE[10.0][1] == pytest.approx(np.sqrt(1.2 / 2), rel=7e-3)
    # Short ones see the stress on the rim of the hole, 3 and 2.
    assert plates.BOWIE[0.01][0] == pytest.approx(3 * plates.EDGE_HALFPLANE, rel=0.03)
    assert plates.BOWIE[0.01][2] == pytest.approx(2 * plates.EDGE_HALFPLANE, rel=0.03)


def test_tables_cannot_be_changed():
    with pytest.raises(TypeError):
        plates.BOWIE[1.0] = (0, 0, 0, 0)


def test_surface_cracks_of_no_size_in_a_thick_plate():
    """Newman and Raju claim 5 % of finite elements: a half penny's deepest point is at 1.04."""
    K = plates.newman_raju_surface(np.pi / 2, 0.01, 0.01, 1.0, 1.0) / np.sqrt(0.01 / np.pi) / 2
    assert pytest.approx(1.04, rel=0.01) == K
    in_bending = plates.newman_raju_surface(np.pi / 2, 0.01, 0.01, 1.0, 1.0, 0.0, 1.0)
    in_tension = plates.newman_raju_surface(np.pi / 2, 0.01, 0.01, 1.0, 1.0)
    assert in_bending / in_tension == pytest.approx(1 - 2 * 0.01, rel=0.01)  # stress at that depth
    corner = plates.newman_raju_corner(np.pi / 4, 0.01, 0.01, 1.0, 1.0)
    assert corner / np.sqrt(0.01 / np.pi) / 2 == pytest.approx(1.05, rel=0.05)


# Growth ---------------------------------------------------------------------------------------


def test_hoop_angle_is_where_the_hoop_stress_is_largest():
    """A grid of 0.02°."""
    angle = np.radians(np.linspace(-180, 180, 18001))
    for K in np.random.default_rng(RNG).normal(size=(20, 2)):
        largest = angle[np.argmax(kinks.hoop_K(*K, angle))]
        assert kinks.hoop_angle(*K) == pytest.approx(largest, abs=4e-4)
    assert np.degrees(kinks.hoop_angle(0.0, 1.0)) == pytest.approx(-70.5288, abs=1e-4)
    assert kinks.equivalent_K(3.0, 0.0, 2.0) == pytest.approx(np.sqrt(9 + 4 / 0.7))
    assert kinks.equivalent_K(-1.0, 0.0, 0.0, 0.0) == 0.0


def test_kink_of_no_angle_is_the_crack():
    """Round-off; pure mode II turns by 77.3° (Amestoy and Leblond, 1992)."""
    assert np.array(kinks.kink_factors(0.0)) == pytest.approx([1, 0, 0, 1])
    assert np.degrees(kinks.local_symmetry_angle(0.0, 1.0)) == pytest.approx(-77.3, abs=0.1)
    assert kinks.local_symmetry_angle(1.0, 0.0) == 0.0
    small = 1e-3  # both criteria turn by -2 K_II / K_I
    assert kinks.local_symmetry_angle(1.0, small) == pytest.approx(-2 * small, rel=1e-4)
    assert kinks.hoop_angle(1.0, small) == pytest.approx(-2 * small, rel=1e-4)


@pytest.mark.parametrize("m", [2.0, 3.0])
def test_lives_are_the_integral_of_the_law(m):
    """Quadrature, 1e-10."""
    cycles = quad(lambda a: 1 / (1e-3 * (1.1 * 2.0 * np.sqrt(np.pi * a)) ** m), 0.1, 0.4)[0]
    assert lives.paris_life(0.1, 0.4, 1e-3, m, 2.0, 1.1) == pytest.approx(cycles, rel=1e-8)
    cycles = quad(lambda a: 1 / (1e-3 * (2 * 2.0 * np.sqrt(a / np.pi)) ** m), 0.1, 0.4)[0]
    assert lives.penny_life(0.1, 0.4, 1e-3, m, 2.0) == pytest.approx(cycles, rel=1e-8)
    cycles = quad(lambda a: 1 / (1e-3 * fields_2d.periodic_K(a, 1.0, 2.0) ** 2), 0.1, 0.4)[0]
    assert lives.paris_life_periodic(0.1, 0.4, 1.0, 1e-3, 2.0) == pytest.approx(cycles, rel=1e-8)
    assert lives.elber_share(0.5) == 0.7


def test_stresses_in_the_frame_of_an_inclined_crack():
    """Round-off: the tensor turned."""
    angle = 0.3
    along = np.array([np.cos(angle), np.sin(angle)])
    normal = np.array([np.sin(angle), -np.cos(angle)])
    stress = np.diag([2.0, 2.0 * 0.4])
    wanted = [along @ stress @ along, normal @ stress @ normal, along @ stress @ normal]
    assert fields_2d.inclined_remote(2.0, angle, 0.4) == pytest.approx(wanted)


def test_misuse_says_what_to_do():
    with pytest.raises(ProblemError, match="opens the crack; use griffith"):
        closed.closed_crack(0.0, 1.0, A, E, NU, syy=0.1)
    with pytest.raises(ProblemError, match="not partly closed"):
        closed.partial_closure_params(A, 0.6, 1.0)
    with pytest.raises(ProblemError, match='"strain" or "stress"'):
        potentials.kolosov(NU, "axial")


def test_nothing_of_the_solver_is_used():
    allowed = {"xcrack.base.arrays", "xcrack.base.errors", "xcrack.base.checks"}
    for path in Path(potentials.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("xcrack"):
                own = node.module.startswith("xcrack.verification.exact")
                assert own or node.module in allowed, path
