"""K along fronts in 3D: pennies, ellipses, straight fronts, surface and corner cracks.

Every tolerance is one of discretisation unless it says otherwise. `pytest -s` prints the numbers.
"""

from functools import cache

import numpy as np
import pytest

import xcrack as xc
from support import exact, scenes_3d
from support import scenes_fronts as fronts

# On coarse meshes the two domains may differ by 2 % while K is within 1 %: they say so.
pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")

ROTATION = fronts.turn((0.3, -1.0, 0.7), 0.9)
SEED = 7203
A = 0.5
K_0 = 2 * np.sqrt(A / np.pi)  # K_I of the penny under unit tension
MIXED = (1.0, 0.3, 0.2)


def penny(h, stress, **options):
    return fronts.flat_scene(h, a=A, stress=stress, rotation=ROTATION, seed=SEED, **options)


def errors(problem, place, stress, a=A, b=None):
    """K and its error, exact K `(f, 3)` and the places."""
    sif = xc.stress_intensity(xc.solve(problem))
    wanted = fronts.exact_K(sif.x, place, a, b, stress)
    assert len(sif.s) == len(problem.placed[0].fronts[0]) - 1  # K at every vertex of a closed front
    return sif, sif.K - wanted, wanted


def report_errors(name, error, wanted):
    size = np.abs(wanted).max(axis=0)
    print(f"\n{name}: mean {error.mean(axis=0) / size}, largest {np.abs(error).max(axis=0) / size}")


# Penny -------------------------------------------------------------------------------------------


def test_penny_coarse():
    """a / h = 2.9, ten thousand unknowns: within 4 % at every place, 1.5 % in the mean."""
    problem, place = penny(0.17, MIXED)
    sif, error, wanted = errors(problem, place, MIXED)
    report_errors("penny a/h = 2.9", error, wanted)
    assert abs((sif.K_I / wanted[:, 0]).mean() - 1) <= 0.015
    assert (np.abs(error).max(axis=0) <= 0.04 * np.abs(wanted).max(axis=0)).all()


@pytest.mark.slow
@pytest.mark.mission
def test_penny_under_tension_shear_and_both():
    """a / h = 8 near the crack, box perturbed, turned, crack askew to it; promised numbers."""
    problem, place = penny(0.0625, MIXED)
    sif, error, wanted = errors(problem, place, MIXED)
    ratio = sif.K_I / wanted[:, 0]
    shear = np.abs(error[:, 1:]).max(axis=0) / np.abs(wanted[:, 1:]).max(axis=0)
    print(f"\npenny a/h = 8: K_I {ratio.mean():.4f} ± {ratio.std():.4f}, K_II, K_III {shear}")
    assert abs(ratio.mean() - 1) <= 0.015
    assert ratio.std() <= 0.01
    assert np.abs(ratio - 1).max() <= 0.02
    assert (shear <= 0.03).all()


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("stress", [(1.0, 0, 0), (0, 0.3, 0.2), (0, -0.3, -0.2)], ids=str)
def test_modes_that_are_not_there(stress):
    """K of modes that the load does not make, against the largest K that it makes."""
    problem, place = penny(0.0884, stress)
    _, error, wanted = errors(problem, place, stress)
    spurious = np.abs(error).max(axis=0) / np.abs(wanted).max()
    report_errors(f"penny {stress}", error, np.full(3, np.abs(wanted).max()))
    absent = np.abs(wanted).max(axis=0) == 0
    assert absent.any()
    assert (spurious[absent] <= 0.015).all()
    assert (spurious[~absent] <= 0.03).all()


@pytest.mark.slow
@pytest.mark.mission
def test_penny_converges():
    """Three meshes with one enriched radius: the error of K over all places falls."""
    sizes, result = (0.15, 0.1, 0.0667), []
    for h in sizes:
        problem, place = penny(h, MIXED, half=1.4, depth=0.35, radius=0.3)
        _, error, wanted = errors(problem, place, MIXED)
        result.append(np.sqrt((error**2).sum(axis=1).mean()) / np.abs(wanted).max())
    rate = np.polyfit(np.log(sizes), np.log(result), 1)[0]
    print(f"\npenny, error of K: {np.array(result)}, rate {rate:.2f}")
    assert result[2] < result[1] < result[0]
    assert rate >= 0.5
    assert result[2] <= 0.01


# Ellipse -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.mission
def test_ellipse_all_round():
    """2:1, three and a third cells to the radius of curvature at its sharp ends, b / h = 6.7.

    With three cells the largest error, at the sharp ends, is 2.9 and 3.0 % for two seeds.
    """
    a, b = 0.6, 0.3
    problem, place = fronts.flat_scene(
        0.045, a=a, b=b, stress=MIXED, rotation=ROTATION, seed=SEED,
        half=1.2, margin=0.11, depth=0.17,
    )  # fmt: skip
    sif, error, wanted = errors(problem, place, MIXED, a, b)
    ratio = sif.K_I / wanted[:, 0]
    shear = np.abs(error[:, 1:]).max(axis=0) / np.abs(wanted[:, 1:]).max(axis=0)
    print(f"\nellipse: K_I {ratio.min():.4f} to {ratio.max():.4f}, K_II, K_III {shear}")
    assert np.abs(ratio - 1).max() <= 0.03
    assert (shear <= 0.03).all()


# Closed penny ------------------------------------------------------------------------------------


def closed_penny(h):
    """Pressed and sheared: error of the pressure, largest K_I over K_0, errors of K_II, K_III."""
    stress = (-1.0, 0.3, 0.2)
    problem, place = penny(h, stress, contact="auto")
    solution = xc.solve(problem)
    contact = solution.contact[0]
    assert contact.closed.all()
    error = (contact.pressure - 1) ** 2
    pressure = np.sqrt((contact.measure @ error) / contact.measure.sum())
    sif = xc.stress_intensity(solution)
    wanted = fronts.exact_K(sif.x, place, A, None, stress)
    shear = np.abs(sif.K - wanted)[:, 1:].max(axis=0) / np.abs(wanted[:, 1:]).max(axis=0)
    K_I = np.abs(sif.K_integral[:, 0]).max() / K_0
    print(f"\nclosed penny a/h = {A / h:.1f}: p {pressure:.4f}, K_I {K_I:.4f}, others {shear}")
    return pressure, K_I, shear


def test_closed_penny_coarse():
    pressure, K_I, shear = closed_penny(0.17)
    assert pressure <= 0.05
    assert K_I <= 0.04
    assert (shear <= 0.05).all()


@pytest.mark.slow
@pytest.mark.mission
def test_closed_penny():
    pressure, K_I, shear = closed_penny(0.0625)
    assert pressure <= 0.05
    assert K_I <= 0.01
    assert (shear <= 0.03).all()


# Straight fronts ---------------------------------------------------------------------------------

TIP = np.array([0.013, 0.017])
MU = 1 / 2.6


def straight(x, K):
    """Displacement of a straight front along z, lips behind it at y = const (E = 1, nu = 0.3)."""
    along, up = x[:, 0] - TIP[0], x[:, 1] - TIP[1]
    u, _ = exact.williams(along, up, 1.0, 0.3, KI=K[0], KII=K[1])
    r, theta = np.hypot(along, up), np.arctan2(up, along)
    w = 2 * K[2] / MU * np.sqrt(r / (2 * np.pi)) * np.sin(theta / 2)
    return np.column_stack([u, w])


def antiplane(x, normal):
    """Traction of K_III = 1."""
    r = np.hypot(x[:, 0] - TIP[0], x[:, 1] - TIP[1])
    theta = np.arctan2(x[:, 1] - TIP[1], x[:, 0] - TIP[0])
    size = 1 / np.sqrt(2 * np.pi * r)
    xz, yz = -size * np.sin(theta / 2), size * np.cos(theta / 2)
    n = normal.T
    return np.stack([xz * n[2], yz * n[2], xz * n[0] + yz * n[1]], axis=1)


def extruded(n, layers, K, seed=None):
    """Through crack: exact sides; plane strain at bottom and top, or exact traction in mode III."""
    line = np.linspace(-1, 1, n + 1)
    mesh = fronts.graded([line, line, np.linspace(-1, 1, layers + 1) * layers / n], seed=seed)
    x, y = TIP
    crack = xc.plane_crack([(-1.5, y, -1.5), (-1.5, y, 1.5), (x, y, 1.5), (x, y, -1.5)])
    sides = ("left", "right", "front", "back")
    supports = [xc.displacement(side, lambda x: straight(x, K)) for side in sides]
    loads = []
    if K[2] == 0:
        supports += [xc.fix("bottom", axis=2), xc.fix("top", axis=2)]
    else:
        loads = [
            xc.traction(side, lambda x, normal: K[2] * antiplane(x, normal))
            for side in ("bottom", "top")
        ]
    return xc.Problem(
        mesh,
        xc.Isotropic(E=1.0, nu=0.3),
        [crack],
        supports=supports,
        loads=loads,
        contact="off",
        order=1,
    )


@cache
def plane_K(n, radius):
    """K in 2D analysis of order 1 on the same mesh."""
    problem = xc.Problem(
        xc.box((-1.0, -1.0), (1.0, 1.0), n),
        xc.Isotropic(E=1.0, nu=0.3, plane="strain"),
        [xc.line_crack([(-1.0, TIP[1]), TIP])],
        supports=[xc.displacement("boundary", lambda x: straight(x, (1.0, 0.5, 0.0))[:, :2])],
        contact="off",
        order=1,
        numerics=xc.Numerics(radius=radius),
    )
    return xc.stress_intensity(xc.solve(problem)).K[0]


def through(n, layers, K, seed=None):
    problem = extruded(n, layers, K, seed)
    solution = xc.solve(problem)
    sif = xc.stress_intensity(solution)
    assert np.isfinite(sif.K).all()
    assert (np.diff(sif.s) > 0).all()
    assert len(sif.ends) == (2 if problem.loads else 0)  # on rollers K is known to the ends
    inner = sif.K[~sif.at_surface]
    print(f"\nthrough crack {K}: {inner.mean(axis=0)}, {inner.min(axis=0)} to {inner.max(axis=0)}")
    return inner, sif, float(solution.space.radius[0])


def test_through_crack_coarse():
    inner, sif, radius = through(12, 6, (1.0, 0.5, 0.0))
    assert inner.mean(axis=0)[:2] == pytest.approx(plane_K(12, radius), rel=0.02)
    assert np.abs(inner - [1.0, 0.5, 0.0]).max() <= 0.03
    # Up to where the front leaves the body.
    assert np.abs(sif.K - [1.0, 0.5, 0.0]).max() <= 0.03


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("seed", [None, 471])
def test_through_crack(seed):
    """Twenty layers: spread along the front below 1 %, mean as in 2D."""
    inner, _, radius = through(20, 20, (1.0, 0.5, 0.0), seed)
    assert inner.mean(axis=0)[:2] == pytest.approx(plane_K(20, radius), rel=0.005)
    assert (inner.std(axis=0)[:2] <= 0.01 * inner.mean(axis=0)[:2]).all()
    assert np.abs(inner - inner.mean(axis=0)).max() <= 0.01
    assert np.abs(inner[:, 2]).max() <= 0.01


def test_mode_III_coarse():
    inner, _, _ = through(12, 6, (0.0, 0.0, 1.0))
    assert inner[:, 2] == pytest.approx(1.0, abs=0.02)
    # Up to the loaded ends; the mesh mirrors nearly what crosses the modes.
    assert np.abs(inner[:, :2]).max() <= 0.005


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_mode_III(sign):
    """Cross-talk is an error that scatters: 0.5 % in the mean square, 1.5 % anywhere."""
    inner, _, _ = through(20, 20, (0.0, 0.0, sign), 471 if sign > 0 else 472)
    assert inner[:, 2].mean() == pytest.approx(sign, abs=0.01)
    assert inner[:, 2] == pytest.approx(sign, abs=0.02)
    assert np.sqrt((inner[:, :2] ** 2).mean(axis=0)).max() <= 0.005
    assert np.abs(inner[:, :2]).max() <= 0.015


# Surface and corner cracks -----------------------------------------------------------------------


def plate_with_part_through_crack(h, *, corner, a=0.4, c=0.5, t=1.0, b=4.0):
    """Wide plate pulled along y; depth a below the face z = 0, half-length c along x."""
    low = 0.0 if corner else -b
    fine = (0.0 if corner else -c - 0.15, c + 0.15)
    lines = [
        fronts.lines(low, b, fine, h),
        fronts.lines(-4.0, 4.0, (-0.2, 0.2), h),
        fronts.lines(-t, 0.0, (-a - 0.15, 0.0), h),
    ]
    problem = xc.Problem(
        fronts.graded(lines, seed=511),
        xc.Isotropic(E=1.0, nu=0.3),
        [xc.elliptic_crack((0.0, 0.0071, 0.0), (0, 1, 0), (1, 0, 0), c, a)],
        loads=[xc.traction("back", (0.0, 1.0, 0.0)), xc.traction("front", (0.0, -1.0, 0.0))],
        order=1,
    )
    sif = xc.stress_intensity(xc.solve(problem))
    phi = np.arctan2(np.maximum(-sif.x[:, 2], 0) / a, sif.x[:, 0] / c)
    table = exact.newman_raju_corner if corner else exact.newman_raju_surface
    return sif, table(phi, a, c, t, b), phi


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("corner", [False, True], ids=["surface", "corner"])
def test_against_newman_and_raju(corner):
    """Their fit holds to 5 %; 7 % are promised, away from where the front meets a face."""
    sif, wanted, phi = plate_with_part_through_crack(0.05, corner=corner)
    inner = ~sif.at_surface
    ratio = sif.K_I / wanted
    print(f"\nNewman-Raju: {ratio[inner].min():.3f} to {ratio[inner].max():.3f}")
    assert inner.sum() >= 0.6 * len(phi)
    assert sif.at_surface[[0, -1]].all()
    assert np.abs(ratio[inner] - 1).max() <= 0.07
    assert np.abs(ratio - 1).max() <= 0.15
    # Pulled across a mirror plane of the body: mode I only, but for the perturbed mesh.
    assert np.abs(sif.K[inner, 1:]).max() <= 0.02 * wanted.max()


@pytest.mark.slow
@pytest.mark.mission
def test_surface_crack_coarse():
    sif, wanted, _ = plate_with_part_through_crack(0.11, corner=False)
    inner = ~sif.at_surface
    assert np.abs(sif.K_I / wanted - 1)[inner].max() <= 0.1
    assert np.isfinite(sif.K).all()


# One scene, told in other ways -------------------------------------------------------------------


def small(**options):
    return fronts.flat_scene(0.25, a=A, stress=MIXED, half=1.0, margin=0.1, depth=0.25, **options)


def K_of(problem):
    return xc.stress_intensity(xc.solve(problem)).K


@pytest.mark.slow
@pytest.mark.mission
def test_several_load_states_are_equal_to_one_by_one():
    """One multigrid hierarchy for all: to the tolerance of the iteration (1e-6)."""
    problem, (c, Q) = small()
    S = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.2], [0.3, 0.2, 1.0]])

    def state(sigma, sign=1.0):
        def u(x):
            return sign * exact.penny((x - c) @ Q.T, A, 1.0, 0.3, sigma) @ Q

        return [xc.displacement("boundary", u)]

    tension, shear = np.diag([0, 0, 1.0]), S - np.diag([0, 0, 1.0])
    stresses = (S, tension, shear, -shear)
    states = [*map(state, stresses), state(tension, -1.0)]
    together = xc.stress_intensities(xc.solve(problem, states))
    for k in (0, 2):
        alone = xc.stress_intensity(xc.solve(problem, [states[k]])[0])
        assert np.abs(together[k].K - alone.K).max() <= 1e-6 * K_0
    K = [sif.K for sif in together]
    assert np.abs(K[1] + K[2] - K[0]).max() <= 1e-6 * K_0
    assert np.abs(K[2] + K[3]).max() <= 1e-6 * K_0
    assert np.abs(K[1] + K[4]).max() <= 1e-6 * K_0  # lips may overlap: contact is off


@pytest.mark.slow
@pytest.mark.mission
def test_renumbered_nodes_and_cells():
    """To the tolerance of the iteration (round-off with a direct solver)."""
    problem, _ = small(seed=811)
    mesh, rng = problem.mesh, np.random.default_rng(9071)
    order = rng.permutation(mesh.n_points)
    new_of_old = np.argsort(order)
    sets = {name: new_of_old[facets] for name, facets in mesh.facet_sets.items()}
    cells = new_of_old[mesh.cells][rng.permutation(len(mesh.cells))]
    other = xc.Problem(
        xc.Mesh(mesh.points[order], cells, sets), problem.material, problem.cracks,
        supports=problem.supports, contact="off", order=1,
    )  # fmt: skip
    assert np.abs(K_of(other) - K_of(problem)).max() <= 1e-6 * K_0


@cache
def reference_K():
    """K of an ellipse with equal axes: its points start from an axis that turns with it."""
    return K_of(small(b=A, seed=811)[0])


@pytest.mark.parametrize(
    ("scale", "options"),
    [
        (1.0, {"rotation": ROTATION}),
        (1000.0, {}),
        (1e-3, {"rotation": ROTATION.T}),
        (1.0, {"E": 210e9}),
    ],
    ids=["turned", "millimetres", "turned kilometres", "pascals"],
)
def test_turned_scaled_and_in_other_units(scale, options):
    """To the tolerance of the iteration; K goes with the root of length. No ties: mesh perturbed.

    On a structured mesh round-off decides which cells get the finer rule of quadrature.
    """
    other = K_of(small(b=A, seed=811, scale=scale, **options)[0])
    assert np.abs(other / np.sqrt(scale) - reference_K()).max() <= 1e-6 * K_0


@pytest.mark.slow
@pytest.mark.parametrize(("bent", "inner", "ends"), [(0.0, 1e-3, 2e-3), (1.0, 2e-3, 5e-3)])
def test_initially_stressed_sides(bent, inner, ends):
    """An initial stress −C ε(v) is a change of the displacement by v, at free sides as well.

    So K is that of the body without it whose ends move by v less. v is a polynomial that the
    functions contain, so all that is left is quadrature, of terms that are larger than K.
    """
    E, nu = 1.0, 0.3
    lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
    straight = np.array([[0.3, 0.2, -0.1], [0.15, -0.2, 0.25], [0.1, -0.3, 0.4]])
    second = bent * np.random.default_rng(5).uniform(-0.5, 0.5, (3, 3, 3))
    second = second + second.transpose(0, 2, 1)

    def v(x):
        return x @ straight.T + 0.5 * np.einsum("ijk,nj,nk->ni", second, x, x)

    def stress(x):
        gradient = straight + np.einsum("ijk,nk->nij", second, x)
        strain = (gradient + gradient.transpose(0, 2, 1)) / 2
        trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
        return -2 * mu * strain - lame * trace * np.eye(3)

    def pull(x):
        return np.stack([0.1 * x[:, 2], 0 * x[:, 0], 0.5 * x[:, 2]], axis=1)

    mesh = xc.box((0, 0, -1), (1, 1, 1), (8, 6, 12))
    corners = [(-0.5, -0.5, 0.011), (0.45, -0.5, 0.011), (0.45, 1.5, 0.03), (-0.5, 1.5, 0.03)]
    both = []
    for loads, move in (([xc.initial_stress(stress)], lambda x: pull(x) + v(x)), ([], pull)):
        grips = [xc.displacement(side, move) for side in ("top", "bottom")]
        problem = xc.Problem(
            mesh, xc.Isotropic(E=E, nu=nu), [xc.plane_crack(corners)], loads=loads, supports=grips,
            contact="off",
        )  # fmt: skip
        both.append(xc.stress_intensity(xc.solve(problem)))
    stressed, free = both
    apart = np.abs(stressed.K - free.K).max(axis=1) / np.abs(free.K).max()
    assert free.at_surface.sum() >= 2
    assert apart[~free.at_surface].max() < inner
    assert apart[free.at_surface].max() < ends


# Curved surfaces ---------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.mission
def test_spherical_cap():
    """A cap of 90 degrees with 1.6 cells in the radius of its rim, pulled from all sides.

    K_I = 1.1943, K_II = 0.3322 are those of a conforming axisymmetric model of quadratic triangles
    in a cylinder (11 774 unknowns, quarter points at the tip; within 0.1 % for twice the size at
    the tip). Without the shift of its level set K is 2.2 % low and 2.3 % high.
    """
    rim = np.sqrt(2)
    points, triangles, _ = scenes_3d.cap(60)
    mesh = xc.refine(
        xc.box((-9,) * 3, (9,) * 3, 5),
        size=lambda x: (
            1.0 + 0.6 * np.maximum(0, np.hypot(np.hypot(x[:, 0], x[:, 1]) - rim, x[:, 2]) - 1)
        ),
    )
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E=1.0, nu=0.22),
        [xc.surface_crack(points, triangles)],
        loads=[
            xc.pressure(side, -1.0) for side in ("left", "right", "front", "back", "bottom", "top")
        ],
    )
    K = np.abs(xc.stress_intensity(xc.solve(problem)).K)
    error = (K - (1.1943, 0.3322, 0.0)) / 1.1943
    print(f"\ncap: mean {error.mean(axis=0)}, largest {np.abs(error).max(axis=0)}")
    assert (np.sqrt((error**2).mean(axis=0)) <= 0.01).all()
