"""K and T against closed forms and tables: Griffith, the periodic row, finite plates, arcs, kinks.

Every tolerance is one of discretisation unless it says otherwise. `pytest -s` prints the numbers.
"""

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.scenes_2d import numerics_of

# At order 1 the two domains may differ by 1 % while K itself is within 0.5 %: they say so.
pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")

SIDES = ("left", "right", "bottom", "top")
# Promised for both orders is 0.5 %; order 2 is held to what it reaches, with a factor of ten.
GRIFFITH = {1: 5e-3, 2: 5e-5}
TABLE = {1: 5e-3, 2: 5e-4}

PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))


def pulled_plate(half_width, a, order, *, centre, per_crack=20, height=1.0):
    """Plate with an edge or a centre crack of length a, uniform traction on its ends."""
    h = a / per_crack
    low = -half_width if centre else 0.0
    columns = round((half_width - low) / h)
    n_rows = round(2 * height / h)
    mesh = xc.box((low, -height), (half_width, height), (columns, n_rows + 1 - n_rows % 2))
    crack = xc.line_crack([(-a, 0), (a, 0)] if centre else [(-0.1, 0), (a, 0)])
    return xc.Problem(
        mesh, xc.Isotropic(1.0, 0.3, plane="strain"), [crack], loads=PULL, order=order
    )


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("stress", [(0.0, 1.0, 0.5), (0.4, 1.0, -0.5), (-0.3, 1.0, 0.0)])
def test_griffith_both_tips_both_signs(order, stress):
    """a / h = 20, crack at 0.21 rad; the normal is the same at both tips, so K_II changes sign."""
    sxx, syy, sxy = stress
    problem, _ = scenes.griffith_box(
        60, half=1.5, stress=stress, angle=0.21, origin=(0.03, 0.02), order=order
    )
    sif = xc.stress_intensity(xc.solve(problem))
    unit = np.sqrt(np.pi)
    error = np.abs(sif.K / unit - [[syy, -sxy], [syy, sxy]]).max()
    error_T = np.abs(sif.T - (sxx - syy)).max()
    print(f"\nGriffith order {order} {stress}: K {error:.1e}, T {error_T:.1e}")
    assert error <= GRIFFITH[order]
    assert error_T <= {1: 5e-3, 2: 1e-4}[order]
    ahead, normal = scenes.rows(0.21)
    assert sif.frame[1] == pytest.approx(np.array([ahead, normal]), abs=1e-12)  # round-off
    assert sif.frame[0] == pytest.approx(np.array([-ahead, normal]), abs=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_griffith_plane_stress(order):
    problem, _ = scenes.griffith_box(
        60, half=1.5, stress=(0.0, 1.0, 0.5), angle=-0.35, order=order, plane="stress"
    )
    sif = xc.stress_intensity(xc.solve(problem))
    assert sif.K / np.sqrt(np.pi) == pytest.approx(
        np.array([[1.0, -0.5], [1.0, 0.5]]), abs=GRIFFITH[order]
    )


@pytest.mark.parametrize("order", [1, 2])
def test_inclined_crack_under_uniaxial_tension(order):
    """K_I = s sin²b sqrt(pi a), K_II = s sin b cos b sqrt(pi a), b from the axis of the load."""
    b = np.radians(37.0)
    stress = exact.inclined_remote(1.0, b)
    problem, _ = scenes.griffith_box(60, half=1.5, stress=stress, angle=np.pi / 2 - b, order=order)
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = np.sin(b) ** 2, np.sin(b) * np.cos(b)
    # The load is along y, the crack at 90° - b to x: turning x into the crack's frame turns the
    # load axis to the angle b from it, on the side of -normal for a positive shear.
    assert np.abs(sif.K[1]) / np.sqrt(np.pi) == pytest.approx(wanted, abs=GRIFFITH[order])
    assert sif.K_II[0] == pytest.approx(-sif.K_II[1], rel=4 * GRIFFITH[order])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("stress", [(1.0, 0.0, 0.0), (1.0, 0.2, 0.5)])
def test_periodic_row(order, stress):
    """Collinear cracks 2a = 2 with period 3, a / h = 20: K = s sqrt(W tan(pi a / W))."""
    a, period = 1.0, 3.0
    syy, sxx, sxy = stress
    field = scenes.turned(
        lambda x, y: exact.periodic(x, y, a, period, 1.0, 0.3, syy=syy, sxx=sxx, sxy=sxy), (0, 0)
    )
    mesh = scenes.perturbed(60, lower=(-1.5, -1.5), upper=(1.5, 1.5))
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1.0, 0.3, plane="strain"),
        [xc.line_crack([(-a, 0), (a, 0)])],
        supports=scenes.imposed(field, SIDES),
        order=order,
    )
    K = xc.stress_intensity(xc.solve(problem)).K / exact.periodic_K(a, period)
    print(f"\nperiodic row order {order}: {np.abs(K - [[syy, -sxy], [syy, sxy]]).max():.1e}")
    assert pytest.approx(np.array([[syy, -sxy], [syy, sxy]]), abs=GRIFFITH[order]) == K


def _edge_plates():
    for (height, share), F in exact.SENT_LS.items():
        for order in (1, 2):
            if order == 1 and share > 0.45:
                continue  # next test
            slow = [pytest.mark.slow] if share < 0.25 and order == 2 else []
            yield pytest.param(height, share, F, order, marks=slow)


@pytest.mark.parametrize(("height", "share", "F", "order"), list(_edge_plates()))
def test_edge_crack_in_a_finite_plate(height, share, F, order):
    """a / h = 20."""
    problem = pulled_plate(1.0, share, order, centre=False, height=height)
    sif = xc.stress_intensity(xc.solve(problem))
    error = sif.K_I[0] / (F * np.sqrt(np.pi * share)) - 1
    print(f"\nedge crack a/W {share} order {order}: K {error:+.1e}, T {sif.T[0]:.4f}")
    assert abs(error) <= TABLE[order]
    # Round-off of a symmetric scene would be smaller: the diagonals of the mesh alternate.
    assert abs(sif.K_II[0]) <= 1e-3 * sif.K_I[0]
    T = {0.2: -0.5885, 0.3: -0.6074, 0.4: -0.5709, 0.5: -0.4102, 0.6: 0.0501}[share]
    assert sif.T[0] == pytest.approx(T, abs={1: 5e-3, 2: 3e-4}[order])


@pytest.mark.parametrize(("share", "per_crack"), [(0.5, 24), (0.6, 36)])
def test_deep_edge_crack_at_order_1_needs_cells_in_the_ligament(share, per_crack):
    """The ligament, not the crack, is what linear triangles resolve worst: (W - a) / h = 24.

    With a / h = 20 order 1 is 0.51 % (a/W = .5) and 1.3 % (.6) low, at the rate h².
    """
    F = exact.SENT_LS[(1.0, share)]
    error = []
    for n in (per_crack // 2, per_crack):
        problem = pulled_plate(1.0, share, 1, centre=False, per_crack=n)
        sif = xc.stress_intensity(xc.solve(problem))
        error.append(abs(sif.K_I[0] / (F * np.sqrt(np.pi * share)) - 1))
    print(f"\ndeep edge crack a/W {share} order 1: {error}")
    assert error[1] <= 5e-3
    assert error[1] <= error[0] / 3


def _centre_plates():
    for height, share in ((1.0, 0.3), (1.0, 0.5), (1.0, 0.6), (2.0, 0.5)):
        for order in (1, 2):
            slow = [pytest.mark.slow] if order == 2 and (height > 1 or share < 0.4) else []
            yield pytest.param(height, share, order, marks=slow)


@pytest.mark.parametrize(("height", "share", "order"), list(_centre_plates()))
def test_centre_crack_in_a_finite_plate(height, share, order):
    F = exact.CCT_LS[(height, share)]
    problem = pulled_plate(1.0, share, order, centre=True, height=height)
    sif = xc.stress_intensity(xc.solve(problem))
    error = sif.K_I / (F * np.sqrt(np.pi * share)) - 1
    print(f"\ncentre crack H/W {height} a/W {share} order {order}: K {np.abs(error).max():.1e}")
    assert np.abs(error).max() <= TABLE[order]
    if height == 1.0:
        T = {0.3: -1.1554, 0.5: -1.3851, 0.6: -1.5492}[share]
        assert sif.T == pytest.approx(T, abs={1: 8e-3, 2: 4e-4}[order])


@pytest.mark.gmsh
@pytest.mark.parametrize(("both", "column"), [(True, 0), (False, 1)])
def test_cracks_from_a_hole(both, column):
    """Bowie's problem, a = R; a plate of half width 100 R is infinite to some 1e-3."""
    R, a, half = 1.0, 1.0, 100.0
    mesh = xc.plate_with_hole(
        width=2 * half, height=2 * half, radius=R, size=20.0, size_near=0.05,
        along=[[(R, 0.0), (R + a, 0.0)], [(-R, 0.0), (-R - a, 0.0)]], band=0.3, transition=60.0,
    )  # fmt: skip
    cracks = [xc.line_crack([(R, 0.0), (R + a, 0.0)])]
    if both:
        cracks.append(xc.line_crack([(-R - a, 0.0), (-R, 0.0)]))
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3, plane="strain"), cracks, loads=PULL)
    solution = xc.solve(problem)
    K = [xc.stress_intensity(solution, c).K_I[0] for c in range(len(cracks))]
    error = np.array(K) / (exact.BOWIE[1.0][column] * np.sqrt(np.pi * a)) - 1
    print(f"\nBowie order 2, {len(cracks)} crack(s): {np.abs(error).max():.1e}")
    assert np.abs(error).max() <= 2e-3


def arc_points(alpha, n=300):
    """Points of the arc, denser towards its tips: the last piece shows the tangent there."""
    theta = alpha * np.sin(np.pi / 2 * np.linspace(-1, 1, n + 1))
    return np.stack([np.cos(theta), np.sin(theta)], axis=1)


def arc_box(n, order, alpha, stress, **options):
    """Open arc of radius 1, with the exact displacements imposed on a square around it."""
    arc = exact.ArcCrack(1.0, alpha, 1.0, 0.3, *stress)
    field = scenes.turned(arc.field, (0.0, 0.0))
    mesh = scenes.perturbed(n, lower=(-0.5, -1.5), upper=(2.5, 1.5))
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1.0, 0.3, plane="strain"),
        [xc.line_crack(arc_points(alpha))],
        supports=scenes.imposed(field, SIDES),
        order=order,
        contact="off",
        numerics=numerics_of(**options),
    )
    return problem, arc


ARCS = [
    (30, (1.0, 1.0, 0.0)),  # biaxial
    (60, (1.0, 1.0, 0.0)),
    (45, (1.0, 0.0, 0.0)),  # normal to the chord
    (60, (0.0, 1.0, 0.0)),  # along it
]


@pytest.mark.parametrize(("degrees", "stress"), ARCS)
@pytest.mark.parametrize(("order", "n"), [(1, 80), (2, 40)])
def test_open_arc(order, n, degrees, stress):
    problem, arc = arc_box(n, order, np.radians(degrees), stress)
    sif = xc.stress_intensity(xc.solve(problem))
    # The normal at the lower tip (tip 0) is that of the upper one: K_II changes its sign.
    wanted = np.array([arc.K_lower, arc.K_upper]) * [[1, -1], [1, 1]]
    error = np.abs(sif.K - wanted).max() / np.abs(wanted).max()
    print(f"\narc {degrees}° {stress} order {order}: K {error:.1e}")
    assert error <= {1: 5e-3, 2: 2e-3}[order]


MISSION = (pytest.mark.slow, pytest.mark.mission)


@pytest.mark.parametrize(
    ("order", "n", "domains"),
    [
        pytest.param(1, 120, (0.25, 0.35, 0.5, 0.7), marks=MISSION),
        (2, 60, (0.2, 0.35, 0.5, 0.7)),
    ],
)
def test_K_of_an_arc_does_not_depend_on_the_domain(order, n, domains):
    """Domains in which the crack faces turn by 0.2 ... 0.7 rad: 0.2 % of the largest K."""
    result = []
    for domain in domains:
        problem, _ = arc_box(n, order, np.radians(60), (1.0, 1.0, 0.0), radius=0.1, domain=domain)
        result.append(xc.stress_intensity(xc.solve(problem)).K)
    spread = float(np.ptp(result, axis=0).max() / np.abs(result).max())
    print(f"\narc, domains {domains}, order {order}: spread {spread:.1e}")
    assert spread <= 2e-3


@pytest.mark.parametrize(("order", "n"), [pytest.param(1, 120, marks=MISSION), (2, 60)])
def test_K_behind_a_kink_does_not_depend_on_the_domain(order, n):
    """The kink of 45° is 0.3 behind the tip: two domains end before it, three contain it."""
    leg = 0.3 * np.sqrt(0.5)
    crack = xc.line_crack([(-1.1, -0.013), (0.02, -0.013), (0.02 + leg, -0.013 + leg)])
    result = []
    for domain in (0.24, 0.29, 0.36, 0.45, 0.55):
        problem = xc.Problem(
            scenes.perturbed(n, 7),
            xc.Isotropic(1.0, 0.3, plane="strain"),
            [crack],
            loads=PULL,
            order=order,
            numerics=xc.Numerics(radius=0.1, domain=domain),
        )
        result.append(xc.stress_intensity(xc.solve(problem)).K[0])
    spread = float(np.ptp(result, axis=0).max() / np.abs(result).max())
    print(f"\nkink, order {order}: K {result[-1]}, spread {spread:.1e}")
    assert spread <= 2e-3


# What acts on the crack faces or in the body
# ----------------------------------------------------------

_E, _NU, _A = 1.0, 0.3, 1.0


def _imposed_griffith(order, shift, loads, *, n=60, stress=(0.0, 1.0, 0.5), **options):
    """Griffith's crack, its displacement minus `shift` imposed on a square, other loads given."""
    field = scenes.turned(lambda x, y: exact.griffith(x, y, _A, _E, _NU, *stress), (0, 0), 0.21)
    mesh = scenes.perturbed(n, lower=(-1.5, -1.5), upper=(1.5, 1.5))
    ends = np.array([[-_A, 0.0], [_A, 0.0]]) @ scenes.rows(0.21)
    return xc.Problem(
        mesh,
        xc.Isotropic(_E, _NU, plane="strain"),
        [xc.line_crack(ends)],
        supports=[xc.displacement(s, lambda x: field(x)[0] - shift(x)) for s in SIDES],
        loads=loads,
        order=order,
        contact="off",
        **options,
    )


def _uniform(stress):
    """Displacement and stress `(d, d)` of a uniform stress."""
    sxx, syy, sxy = stress
    return (
        lambda x: exact.uniform_stress(x[:, 0], x[:, 1], sxx, syy, sxy, _E, _NU)[0],
        np.array([[sxx, sxy], [sxy, syy]]),
    )


@pytest.mark.parametrize("order", [1, 2])
def test_pressure_on_the_lips_stands_for_remote_tension(order):
    """Griffith's field minus an isotropic tension p: pressure p on the crack faces, the same K."""
    p = 0.8
    shift, _ = _uniform((p, p, 0.0))
    problem = _imposed_griffith(order, shift, [xc.crack_pressure(p)])
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = np.sqrt(np.pi) * np.array([[1.0, -0.5], [1.0, 0.5]])
    print(f"\ncrack pressure order {order}: {np.abs(sif.K - wanted).max() / np.sqrt(np.pi):.1e}")
    assert np.abs(sif.K - wanted).max() / np.sqrt(np.pi) <= GRIFFITH[order]
    # T is the stress along the crack: that of the whole field minus the tension taken away.
    assert sif.T == pytest.approx(-1.0 - p, abs={1: 1e-2, 2: 1e-3}[order])


@pytest.mark.parametrize("order", [1, 2])
def test_uniform_initial_stress(order):
    """Part of Griffith's stress given as initial stress; the rest is elastic. K is of the whole."""
    shift, sigma0 = _uniform((0.3, 0.6, -0.2))
    problem = _imposed_griffith(order, shift, [xc.initial_stress(sigma0)])
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = np.sqrt(np.pi) * np.array([[1.0, -0.5], [1.0, 0.5]])
    print(f"\ninitial stress order {order}: {np.abs(sif.K - wanted).max() / np.sqrt(np.pi):.1e}")
    assert np.abs(sif.K - wanted).max() / np.sqrt(np.pi) <= GRIFFITH[order]
    assert sif.T == pytest.approx(-1.0, abs={1: 1e-2, 2: 1e-3}[order])


def _quadratic(c):
    """A quadratic displacement and its stress."""
    material = xc.Isotropic(_E, _NU, plane="strain")

    def u(x):
        X, Y = x.T
        return c * np.stack([X * X + 0.4 * X * Y, 0.7 * Y * Y - 0.3 * X * X], axis=1)

    def stress(x):
        X, Y = x.T
        gradient = np.empty((len(x), 2, 2))
        gradient[:, 0, 0], gradient[:, 0, 1] = 2 * X + 0.4 * Y, 0.4 * X
        gradient[:, 1, 0], gradient[:, 1, 1] = -0.6 * X, 1.4 * Y
        return material.stress(c * gradient)

    return u, stress


@pytest.mark.parametrize("order", [1, 2])
def test_initial_stress_that_varies(order):
    u, stress = _quadratic(0.15)
    # Total stress is Griffith's, so no body force: the elastic part is Griffith's minus sigma0.
    problem = _imposed_griffith(order, u, [xc.initial_stress(stress)])
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = np.sqrt(np.pi) * np.array([[1.0, -0.5], [1.0, 0.5]])
    assert sif.T == pytest.approx(-1.0, abs={1: 1e-2, 2: 1e-3}[order])
    print(f"\nvarying initial stress order {order}: {np.abs(sif.K - wanted).max() / 1.7725:.1e}")
    assert np.abs(sif.K - wanted).max() / np.sqrt(np.pi) <= GRIFFITH[order]


@pytest.mark.parametrize("order", [1, 2])
def test_body_force_with_pressure_on_the_lips(order):
    """Griffith's field plus u = (0, c y²) in the frame of the crack.

    It needs the body force -2 c (lam + 2 mu) along the normal, loads no lip (its stress vanishes
    on y = 0 but for a shear-free sxx = 0) and adds nothing to K.
    """
    c = 0.3
    ahead, normal = scenes.rows(0.21)
    material = xc.Isotropic(_E, _NU, plane="strain")
    force = -2 * c * (material.lam + 2 * material.mu) * normal

    def shift(x):
        return -c * ((x @ normal) ** 2)[:, None] * normal

    problem = _imposed_griffith(order, shift, [xc.body_force(force)])
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = np.sqrt(np.pi) * np.array([[1.0, -0.5], [1.0, 0.5]])
    print(f"\nbody force order {order}: {np.abs(sif.K - wanted).max() / np.sqrt(np.pi):.1e}")
    assert np.abs(sif.K - wanted).max() / np.sqrt(np.pi) <= GRIFFITH[order]
    assert sif.T == pytest.approx(-1.0, abs={1: 1e-2, 2: 1e-3}[order])

    # u = (c x², 0): pressure -2 c lam x on the crack faces, body force -2 c (lam + 2 mu) along
    # them.
    def along(x):
        return -c * ((x @ ahead) ** 2)[:, None] * ahead

    loads = [
        xc.body_force(-2 * c * (material.lam + 2 * material.mu) * ahead),
        xc.crack_pressure(lambda x: -2 * c * material.lam * (x @ ahead)),
    ]
    sif = xc.stress_intensity(xc.solve(_imposed_griffith(order, along, loads)))
    print(f"body force and pressure order {order}: {np.abs(sif.K - wanted).max() / 1.7725:.1e}")
    assert np.abs(sif.K - wanted).max() / np.sqrt(np.pi) <= GRIFFITH[order]


def test_loads_scale_but_initial_stress_does_not():
    """Load state s: s times the loads, and the initial stress as it is."""
    shift, sigma0 = _uniform((0.3, 0.6, -0.2))
    free = _imposed_griffith(2, shift, [], n=30)
    both = _imposed_griffith(2, shift, [xc.initial_stress(sigma0)], n=30)
    K = [np.array(xc.stress_intensity(s).K) for s in xc.solve(both, states=[0.0, 1.0, 2.5])]
    elastic = np.array(xc.stress_intensity(xc.solve(free)).K)
    # Round-off.
    assert K[1] - K[0] == pytest.approx(elastic, abs=1e-9)
    assert K[2] - K[0] == pytest.approx(2.5 * elastic, abs=1e-9)
