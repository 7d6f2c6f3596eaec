"""Scenes in 3D that need no word from the user: cut through, two cracks, ends on a notch.

Tolerances are of discretisation unless they say otherwise. `pytest -s` prints the numbers.
"""

import numpy as np
import pytest

import xcrack as xc
from support import scenes_fronts as fronts

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")

STEEL = xc.Isotropic(E=210e3, nu=0.3)
PULL = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]


def without(mesh, keep):
    """The cells of a mesh whose middles fulfil a condition; sets that go with them are cut."""
    cells = mesh.cells[keep(mesh.points[mesh.cells].mean(axis=1))]
    used = np.unique(cells)
    new_of_old = np.full(mesh.n_points, -1)
    new_of_old[used] = np.arange(len(used))
    sets = {}
    corners = ([1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2])
    sides = {tuple(facet) for k in corners for facet in np.sort(cells[:, k], axis=1).tolist()}
    for name, facets in mesh.facet_sets.items():
        if name != "boundary":
            own = [f for f in facets if tuple(sorted(f)) in sides]
            sets[name] = new_of_old[np.array(own, dtype=int).reshape(-1, 3)]
    return xc.Mesh(mesh.points[used], new_of_old[cells], sets)


def notched(n=10, depth=0.4, height=0.2):
    """Cube with a slot from the side x = -1, through its whole width, of one or two cells."""
    mesh = xc.box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), n)
    return without(mesh, lambda x: (x[:, 0] > -1 + depth) | (np.abs(x[:, 2]) > height))


# Cut through ------------------------------------------------------------------------------------


def sawn_bar(slope, sides, cut=True):
    """Bar 1 x 1 x 2 that a plane crack cuts through; its top is moved down by 0.02."""
    mesh = xc.box((-0.5, -0.5, -1.0), (0.5, 0.5, 1.0), (6, 6, 12))
    corners = [(-2, -2), (2, -2), (2, 2), (-2, 2)]
    crack = xc.plane_crack([(x, y, 0.0317 + slope * x) for x, y in corners])
    return xc.Problem(
        mesh, xc.Isotropic(E=1.0, nu=0.3), [crack] if cut else [],
        supports=[xc.fix("bottom", axis=2), xc.displacement("top", (None, None, -0.02)), *sides],
        order=1,
    )  # fmt: skip


ROLLERS = (xc.fix("left", axis=0), xc.fix("front", axis=1))


def test_bar_cut_through_has_no_front_and_carries_pressure():
    """Free to widen: uniform uniaxial stress, a patch test (tolerance of the iteration)."""
    problem = sawn_bar(0.0, ROLLERS)
    assert not problem.placed[0].fronts
    solution = xc.solve(problem)
    assert not len(solution.space.tips)
    sif = xc.stress_intensity(solution)
    assert sif.K.shape == (0, 3)
    contact = solution.contact[0]
    assert contact.closed.all()
    assert np.abs(contact.pressure - 0.01).max() <= 1e-6 * 0.01
    assert contact.measure.sum() == pytest.approx(1.0, rel=1e-10)
    corner = solution.displacement(np.array([[0.5, 0.5, 1.0]]))[0]
    assert corner == pytest.approx(np.array([0.003, 0.003, -0.02]), rel=1e-5)


def test_bar_cut_through_pulled_apart():
    """Both halves move without stress: nothing goes over the cut."""
    problem = sawn_bar(0.2, ROLLERS)
    solution = xc.solve(problem, [[xc.displacement("top", (None, None, 0.02))]])[0]
    assert solution.energy <= 1e-12  # 2e-4 for the whole bar
    assert solution.opening().min() > 0


def test_oblique_cut_slips():
    """Ends held, pressed over an oblique cut without friction: closed, softer than the whole."""
    supported = [xc.fix(side, axis=k) for side in ("bottom", "top") for k in (0, 1)]
    cut, whole = (xc.solve(sawn_bar(0.3, supported, cut)) for cut in (True, False))
    contact = cut.contact[0]
    inner = np.abs(contact.points[:, :2]).max(axis=1) < 0.3
    assert contact.closed[inner].all()
    print(f"\nenergy over that of the whole: {cut.energy / whole.energy:.3f}")
    assert 0.5 * whole.energy < cut.energy < 0.99 * whole.energy
    # What goes over the cut along z is the force on the ends: equilibrium, within the mesh.
    across = contact.pressure / np.hypot(1.0, 0.3)
    force = 2 * cut.energy / 0.02
    assert contact.measure @ across == pytest.approx(force, rel=0.02)


# Two cracks -------------------------------------------------------------------------------------


def pennies(centres, radius, n=12, half=1.0):
    mesh = xc.box((-half,) * 3, (half,) * 3, n)
    cracks = [xc.penny_crack(c, (0, 0, 1), radius, n=64) for c in centres]
    return xc.Problem(mesh, STEEL, cracks, loads=PULL, order=1)


@pytest.mark.slow
def test_two_cracks_far_apart_do_not_see_each_other():
    """Mirrored about x = 0: the same K; each within a few per cent of one alone."""
    one, two = (-0.5, 0.013, 0.0317), (0.5, 0.013, 0.0317)
    both = xc.solve(pennies((one, two), 0.25))
    K = [xc.stress_intensity(both, c).K_I for c in (0, 1)]
    alone = xc.stress_intensity(xc.solve(pennies((one,), 0.25))).K_I
    print(f"\nmean K_I {K[0].mean():.4f} {K[1].mean():.4f}, alone {alone.mean():.4f}")
    assert K[0].mean() == pytest.approx(K[1].mean(), rel=0.02)
    assert K[0].mean() == pytest.approx(alone.mean(), rel=0.05)
    assert K[0].mean() == pytest.approx(2 * np.sqrt(0.25 / np.pi), rel=0.1)


@pytest.mark.slow
def test_two_coplanar_pennies_attract_stacked_ones_shield():
    """Where they face each other K_I grows; one above the other lowers both."""
    a, gap = 0.3, 0.42
    side_by_side = xc.solve(pennies(((-gap, 0.013, 0.0317), (gap, 0.013, 0.0317)), a, n=16))
    sif = xc.stress_intensity(side_by_side, 0)
    facing = sif.K_I[sif.x[:, 0] > -gap + 0.9 * a].mean()
    away = sif.K_I[sif.x[:, 0] < -gap - 0.9 * a].mean()
    single = xc.stress_intensity(xc.solve(pennies(((0.0, 0.013, 0.0317),), a, n=16))).K_I.mean()
    stacked = xc.solve(pennies(((0, 0.013, -0.267), (0, 0.013, 0.273)), a, n=16))
    shielded = [xc.stress_intensity(stacked, c).K_I.mean() for c in (0, 1)]
    print(f"\nfacing {facing / single:.3f}, away {away / single:.3f}, stacked {shielded / single}")
    assert facing > 1.02 * single
    assert facing > away
    assert max(shielded) < 0.97 * single
    assert shielded[0] == pytest.approx(shielded[1], rel=0.02)


# Ends on a side and on a notch --------------------------------------------------------------------


def test_front_from_a_notch_to_a_side():
    """A quarter of the notch root is cracked: one end on the root, one on the free side."""
    corners = [(-0.75, -1.5), (0.1, -1.5), (0.1, 0.05), (-0.75, 0.05)]
    crack = xc.plane_crack([(x, y, 0.0317) for x, y in corners])
    problem = xc.Problem(notched(), STEEL, [crack], loads=PULL, order=1)
    (front,) = problem.placed[0].fronts
    assert front[0] != front[-1]
    solution = xc.solve(problem)
    sif = xc.stress_intensity(solution)
    assert np.isfinite(sif.K).all()
    assert solution.opening().min() > 0
    assert (sif.K_I > 0).all()
    ends = sif.x[[0, -1]]
    on_root = np.abs(ends[:, 0] + 0.6) < 0.1
    on_side = np.abs(ends[:, 1] + 1.0) < 0.1
    assert sorted(on_root.tolist()) == [False, True]
    assert (on_root != on_side).all()


@pytest.mark.slow
def test_straight_front_along_a_notch():
    """The whole root is cracked: K as of an edge crack as deep as notch and crack together."""
    corners = [(-0.75, -1.5), (-0.1, -1.5), (-0.1, 1.5), (-0.75, 1.5)]
    crack = xc.plane_crack([(x, y, 0.0317) for x, y in corners])
    from_notch = xc.stress_intensity(
        xc.solve(xc.Problem(notched(), STEEL, [crack], loads=PULL, order=1))
    )
    corners[0], corners[3] = (-1.5, -1.5), (-1.5, 1.5)
    longer = xc.plane_crack([(x, y, 0.0317) for x, y in corners])
    mesh = xc.box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), 10)
    edge = xc.stress_intensity(xc.solve(xc.Problem(mesh, STEEL, [longer], loads=PULL, order=1)))
    middle = [s.K_I[~s.at_surface].mean() for s in (from_notch, edge)]
    print(f"\nK_I from the notch {middle[0]:.4f}, of the edge crack {middle[1]:.4f}")
    assert middle[0] == pytest.approx(middle[1], rel=0.1)
    assert np.abs(from_notch.x[:, 1]).max() == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_growth_from_a_notch():
    """The front keeps its two ends, one on the root and one on the side, and gains area."""
    corners = [(-0.75, -1.5), (-0.1, -1.5), (-0.1, 0.05), (-0.75, 0.05)]
    crack = xc.plane_crack([(x, y, 0.0317) for x, y in corners])
    problem = xc.Problem(
        notched(12, depth=1 / 3, height=1 / 6), STEEL, [crack], loads=PULL, order=1
    )
    steps = list(
        xc.grow(
            problem,
            xc.paris(C=1e-3, m=1.0),
            xc.max_hoop_stress,
            xc.Cycle(0.0, 1.0),
            da=0.15,
            max_steps=3,
            progress=False,
        )
    )
    assert len(steps) == 3
    area = [step.solutions[1].lips[0].weight.sum() for step in steps]
    assert (np.diff(area) > 0.02).all()
    for step in steps:
        sif = step.sif[1][0]
        assert np.isfinite(sif.K).all()
        assert sif.K_I[~sif.at_surface].min() > 0
        ends = sif.x[[0, -1]]
        assert min(ends[:, 1]) < -0.85  # on the side y = -1
        assert max(ends[:, 1]) > 0.0


@pytest.mark.slow
def test_front_reaches_a_hole():
    """A square hole along z ahead of a straight front: the front splits where it meets it."""
    mesh = without(
        xc.box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), 12),
        lambda x: np.abs(x[:, :2] - [0.5, 0.0]).max(axis=1) > 0.17,
    )
    corners = [(-2.0, -2.0), (0.05, -2.0), (0.05, 2.0), (-2.0, 2.0)]
    problem = xc.Problem(
        mesh, STEEL, [xc.plane_crack([(x, y, 0.0317) for x, y in corners])], loads=PULL, order=1
    )
    run = xc.grow(
        problem, lambda dK, R: 1e-9 + 0.0 * dK, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=0.2,
        max_steps=3, progress=False,
    )  # fmt: skip
    steps = list(run)
    n_fronts = [len(step.cracks[0].fronts) for step in steps]
    print(f"\nfronts: {n_fronts}")
    assert n_fronts[0] == 1
    assert n_fronts[-1] == 2
    last = steps[-1].sif[1][0]
    assert np.isfinite(last.K).all()
    assert set(last.front.tolist()) == {0, 1}


def test_front_is_turned_with_the_scene():
    """The axes of the body do not matter: a rotated edge crack has the same K (iteration)."""
    corners = np.array([(-2.0, -2.0), (0.1, -2.0), (0.1, 2.0), (-2.0, 2.0)])
    flat = np.column_stack([corners, np.full(4, 0.0317)])
    line = np.linspace(-1, 1, 9)
    mesh = fronts.graded([line] * 3, seed=77)  # perturbed: no ties for round-off to decide
    R = fronts.turn((0.3, -1.0, 0.7), 0.9)
    K = []
    for Q in (np.eye(3), R):
        body = xc.Mesh(mesh.points @ Q, mesh.cells, mesh.facet_sets)
        pull = Q[2]  # e_z turned with the body
        loads = [xc.traction("top", tuple(pull)), xc.traction("bottom", tuple(-pull))]
        problem = xc.Problem(body, STEEL, [xc.plane_crack(flat @ Q)], loads=loads, order=1)
        K.append(xc.stress_intensity(xc.solve(problem)).K)
    assert K[0].shape == K[1].shape
    assert np.abs(K[0] - K[1]).max() <= 1e-6 * np.abs(K[0]).max()
