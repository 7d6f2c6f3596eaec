"""The purely nodal level-set update against the polyline: equal at first, lost at last."""

import warnings

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from support import scenes_3d as scenes_space
from support.scenes_2d import numerics_of
from xcrack.verification import methods
from xcrack.verification.methods.level_sets import Nodal, nodal_level_set, nodal_update

STEP = np.radians(5.0)
STEEL = xc.Isotropic(1.3, 0.27, plane="strain")
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))
N = 50
H = 2 / N
LEVELS = (None, methods.nodal_level_sets())  # of the polyline, and purely nodal ones


class levels_near_tips(methods.nodal_level_sets):  # noqa: N801 - as its base
    """Nodal level sets of which each advance changes those near the tip only."""

    def of(self, mesh, crack):
        return nodal_level_set(mesh, crack, reach=0.5)


def led_on(points, turns, da):
    """A polyline that goes on by a distance for each turn of its heading."""
    points = [np.array(x, dtype=float) for x in points]
    along = points[-1] - points[-2]
    heading = np.arctan2(along[1], along[0])
    for turn in turns:
        heading += turn
        points.append(points[-1] + da * np.array([np.cos(heading), np.sin(heading)]))
    return np.array(points)


def placed(mesh, points):
    return xc.Problem(mesh, STEEL, [xc.line_crack(points)]).placed[0]


def turned(degrees, *, start=0.15, mouth=False, radius=0.4):
    """A straight beginning, then a circle in steps of 5 degrees, on a mesh of its own."""
    mesh = scenes.perturbed(N, seed=77)
    y = -0.503
    first = [(-1.0, y), (-1.0 + start, y)] if mouth else [(-0.05 - start, y), (-0.05, y)]
    points = led_on(first, [STEP] * (degrees // 5), 2 * radius * np.sin(STEP / 2))
    return mesh, placed(mesh, points)


def level_set(mesh, crack, levels):
    return cut_by(mesh, crack, levels).level_set


def cut_by(mesh, crack, levels):
    """What a solution by some level sets knows of the cells that a crack cuts."""
    problem = xc.Problem(
        mesh, STEEL, [xc.line_crack(crack.points)], [xc.fix("top"), xc.fix("bottom")],
        [xc.body_force((0.0, 1.0))], "off", 1, numerics=numerics_of(level_sets=levels),
    )  # fmt: skip
    return xc.solve(problem).space.cuts[0]


def lips(mesh, crack, levels=None):
    return cut_by(mesh, crack, levels).lip_points(mesh)


def gaps(x, a, b):
    """Distance of points to the nearest of some segments."""
    edge = b - a
    share = ((x[:, None] - a) * edge).sum(axis=2) / (edge**2).sum(axis=1)
    feet = a + np.clip(share, 0, 1)[:, :, None] * edge
    return np.linalg.norm(x[:, None] - feet, axis=2).min(axis=1)


def covered(result, crack):
    """Share of a crack that has a lip within a tenth of a cell."""
    share = (np.arange(20) + 0.5)[:, None, None] / 20
    a, b = crack.points[:-1], crack.points[1:]
    x = a + share * (b - a)
    weight = np.where((np.abs(x) < 1).all(axis=2), np.linalg.norm(b - a, axis=1), 0.0).ravel()
    near = gaps(x.reshape(-1, 2), result[:, 0], result[:, 1]) < 0.1 * H
    return float(weight[near].sum() / weight.sum())


@pytest.mark.parametrize("mouth", [False, True])
@pytest.mark.parametrize("degrees", [60, 120])
def test_up_to_120_degrees_both_cut_alike(degrees, mouth):
    mesh, crack = turned(degrees, start=0.5 if mouth else 0.15, mouth=mouth)
    explicit, nodal = (lips(mesh, crack, levels) for levels in LEVELS)
    apart = gaps(nodal.reshape(-1, 2), explicit[:, 0], explicit[:, 1]).max()
    back = gaps(explicit.reshape(-1, 2), nodal[:, 0], nodal[:, 1]).max()
    print(f"\n{degrees} degrees: {apart / H:.1e} and {back / H:.1e} of a cell apart")
    assert max(apart, back) <= 0.02 * H  # discretisation
    assert covered(nodal, crack) == covered(explicit, crack) == pytest.approx(1.0)


@pytest.mark.parametrize(("start", "mouth", "least"), [(0.15, False, 0.1), (0.5, True, 0.25)])
def test_at_200_degrees_the_beginning_is_lost(start, mouth, least):
    """It lies ahead of the tip's frame by then. The longer the beginning, the greater the loss."""
    mesh, crack = turned(200, start=start, mouth=mouth)
    explicit, nodal = (covered(lips(mesh, crack, levels), crack) for levels in LEVELS)
    print(f"\n200 degrees: {1 - explicit:.1%} lost by the polyline, {1 - nodal:.1%} by the nodes")
    assert explicit == pytest.approx(1.0)
    assert least <= 1 - nodal <= 0.5


def test_updates_near_the_tip_leave_phantoms():
    """They keep the beginning, but phi jumps where they end: lips appear far from the crack."""
    mesh, crack = turned(200)
    result = lips(mesh, crack, levels_near_tips())
    assert covered(result, crack) == pytest.approx(1.0)
    off = gaps(result.mean(axis=1), crack.points[:-1], crack.points[1:])
    print(f"\nupdates within 0.5: lips up to {off.max() / H:.1f} cells off the crack")
    assert off.max() > 5 * H
    explicit = lips(mesh, crack)
    assert gaps(explicit.mean(axis=1), crack.points[:-1], crack.points[1:]).max() < 0.05 * H


def K_by(levels, mesh, crack, order):
    problem = xc.Problem(
        mesh, STEEL, [crack], loads=PULL, order=order, contact="off",
        numerics=numerics_of(level_sets=levels),
    )  # fmt: skip
    return scenes.K_of(problem)[0]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kinks", [4, 12])
def test_K_of_a_moderately_turned_crack(kinks, order):
    mesh = scenes.perturbed(24, seed=78)
    crack = xc.line_crack(led_on([(-1.0, -0.103), (-0.4, -0.103)], [STEP] * kinks, 0.06))
    explicit, nodal = (K_by(levels, mesh, crack, order) for levels in LEVELS)
    apart = np.abs(nodal - explicit).max() / np.linalg.norm(explicit)
    print(f"\n{5 * kinks} degrees, order {order}: K {apart:.1e} apart")
    assert apart <= 0.01  # discretisation


def test_both_tips_of_a_crack_grow():
    mesh = scenes.perturbed(24, seed=79)
    first = led_on([(0.3, -0.05), (-0.4, -0.103)], [0.08] * 5, 0.07)[:1:-1]
    last = led_on([(-0.4, -0.103), (0.3, -0.05)], [-0.11] * 5, 0.06)
    crack = placed(mesh, np.concatenate([first, last]))
    explicit, nodal = level_set(mesh, crack, None), nodal_level_set(mesh, crack)
    one, other = (lips(mesh, crack, levels) for levels in LEVELS)
    assert gaps(other.reshape(-1, 2), one[:, 0], one[:, 1]).max() <= 0.02 * 2 / 24
    np.testing.assert_array_equal(nodal.tip, explicit.tip)
    # The longest face is the one that was there at first.
    again = nodal_level_set(mesh, crack, first=5)
    np.testing.assert_array_equal(again.phi, nodal.phi)


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_one_update(angle):
    rng = np.random.default_rng(9042)
    x = rng.uniform(-1, 1, (200, 2))
    tip, frame = np.array([0.1, -0.2]), scenes.rows(0.3)
    old = (x - tip) @ frame.T
    new = nodal_update(x, Nodal(old[:, 1], old[None, :, 0]), 0, tip, frame, angle, 0.25)
    moved = tip + 0.25 * scenes.rows(0.3 + angle)[0]
    local = (x - moved) @ scenes.rows(0.3 + angle).T
    behind = old[:, 0] <= 0
    np.testing.assert_array_equal(new.phi[behind], old[behind, 1])  # frozen, to the last bit
    np.testing.assert_allclose(new.phi[~behind], local[~behind, 1], atol=1e-15)
    np.testing.assert_allclose(new.psi[0], local[:, 0], atol=1e-15)
    near = nodal_update(x, Nodal(old[:, 1], old[None, :, 0]), 0, tip, frame, angle, 0.25, 0.5)
    far = np.linalg.norm(x - moved, axis=1) > 0.5
    np.testing.assert_array_equal(near.phi[far], old[far, 1])
    np.testing.assert_array_equal(near.psi[0, far], old[far, 0])
    np.testing.assert_array_equal(near.psi[0, ~far], new.psi[0, ~far])


def test_cracks_that_have_not_grown_are_the_same():
    mesh = scenes.perturbed(20, seed=80)
    for line in ([(-1.0, 0.03), (0.1, 0.11)], [(-0.4, 0.03), (0.3, 0.11)], [(-1.2, 0), (1.2, 0.1)]):
        crack = placed(mesh, line)
        explicit, nodal = (level_set(mesh, crack, levels) for levels in LEVELS)
        np.testing.assert_array_equal(nodal.phi, explicit.phi)
        np.testing.assert_array_equal(nodal.psi, explicit.psi)


def test_growth_follows_the_same_path():
    tips = []
    for levels in LEVELS:
        problem = xc.Problem(
            scenes.perturbed(20, seed=81), STEEL, [xc.line_crack([(-1.1, -0.203), (-0.3, 0.05)])],
            loads=PULL, numerics=numerics_of(level_sets=levels),
        )  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            steps = list(
                xc.grow(
                    problem, xc.paris(C=1e-3, m=3.0), xc.max_hoop_stress, xc.Cycle(0, 1),
                    da=0.1, max_steps=4,
                )
            )  # fmt: skip
        tips.append(steps[-1].cracks[0].points[-1])
    # What the last digits of K differ by, times the length grown.
    np.testing.assert_allclose(tips[1], tips[0], atol=1e-4)


def test_in_space_there_is_none():
    problem = scenes_space.flat_penny(
        4, 0.013, 0.5, (1.0, 0.0), level_sets=methods.nodal_level_sets()
    )
    with pytest.raises(xc.ProblemError, match="2D only"):
        xc.solve(problem)
