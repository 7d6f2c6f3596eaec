"""Level sets of polylines: distances, old faces that stay, cracks that turn far."""

from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.crack.advance_2d import advance
from xcrack.crack.crack import tip_frames
from xcrack.crack.placing_2d import place_line
from xcrack.fem.cut import cut
from xcrack.fem.level_set import line_levels
from xcrack.fem.system import CELLS
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.kernels.location import polyline_distance

EXAMPLE_MESHES = Path(__file__).parents[2] / "examples" / "meshes"


def naive_distance(x, vertices):
    """Signed distance by the smallest of all segments, one point at a time."""
    result = []
    for point in x:
        feet = closest_on_segment(point, vertices[:-1], vertices[1:])
        gaps = np.linalg.norm(point - feet, axis=1)
        near = np.nonzero(gaps <= gaps.min() * (1 + 1e-14))[0]
        along = np.diff(vertices, axis=0)[near]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1).sum(axis=0)
        result.append(np.copysign(gaps.min(), normal @ (point - feet[near[0]])))
    return np.array(result)


def test_distance_agrees_with_its_naive_twin():
    rng = np.random.default_rng(2718)
    vertices = np.cumsum(rng.uniform(0.1, 1.0, (12, 2)), axis=0)
    x = rng.uniform(-1, 8, (400, 2))
    phi, segment = polyline_distance(x, vertices)
    np.testing.assert_allclose(phi, naive_distance(x, vertices), atol=1e-13)  # round-off
    assert segment.min() >= 0
    assert segment.max() <= len(vertices) - 2


def test_straight_crack_has_linear_level_sets():
    mesh = scenes.perturbed(9, seed=31)
    crack = place_line(scenes.edge_line((0.083, 0.047), 0.41), mesh)
    levels = line_levels(mesh, crack)
    x, frame = tip_frames(crack)
    local = (mesh.points - x[0]) @ frame[0].T
    np.testing.assert_allclose(levels.phi, local[:, 1], atol=1e-14)  # round-off
    np.testing.assert_allclose(levels.psi[0], local[:, 0], atol=1e-14)


def turning(steps, radius, degrees):
    """Crack that turns along a circle in equal kinks, from a short straight start."""
    turn = np.radians(degrees / steps)
    da = 2 * radius * np.sin(turn / 2)
    return turn, da


@pytest.mark.parametrize("degrees", [90, 200])
def test_turning_crack_keeps_all_its_faces(degrees):
    """At 200 degrees a purely nodal update loses 7 % of the crack; the polyline loses nothing."""
    mesh = scenes.perturbed(50, seed=77)
    crack = place_line(xc.line_crack([(-1.0, -0.503), (-0.05, -0.503)]), mesh)
    turn, da = turning(40, 0.4, degrees)
    for _ in range(40):
        crack = advance(crack, [turn], [da])
    result = cut(mesh, line_levels(mesh, crack), CELLS[2])
    lips = result.lip_points(mesh)
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    inside = np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum() - (
        -1.0 - crack.points[0, 0]
    )
    h = 2 / 50
    assert length == pytest.approx(inside, rel=2e-3)  # discretisation: kinks cut inside cells
    gaps = np.abs(naive_distance(lips.mean(axis=1), crack.points))
    assert gaps.max() < 0.05 * h  # no lip anywhere else


def test_old_faces_are_frozen_to_the_last_bit():
    mesh = scenes.perturbed(24, seed=5)
    before = place_line(xc.line_crack([(-1.0, 0.013), (0.021, 0.017)]), mesh)
    after = advance(before, [0.6], [0.2])
    old, new = line_levels(mesh, before), line_levels(mesh, after)
    tip = before.points[-1]
    behind = mesh.points[:, 0] < tip[0] - 2 * mesh.cell_size.max()
    behind &= np.abs(mesh.points[:, 1]) < 0.3
    assert behind.sum() > 50
    np.testing.assert_array_equal(new.phi[behind], old.phi[behind])
    np.testing.assert_array_equal(after.points[:-1], before.points)


def test_tip_that_does_not_move_is_the_same_to_the_last_bit():
    mesh = scenes.perturbed(24, seed=6)
    crack = place_line(xc.line_crack([(-0.4, 0.013), (0.4, 0.11)]), mesh)
    moved = advance(crack, [0.3, 0.2], [0.0, 0.15])
    np.testing.assert_array_equal(moved.points[:2], crack.points)
    assert moved.tips == (0, 2)
    levels = line_levels(mesh, moved)
    assert [len(c) for c in levels.tip_cells] == [1, 1]


def test_line_beyond_a_hole_is_no_crack():
    """The ray of a mouth on a hole meets the body again on the far side: nothing is cut there."""
    mesh = xc.read_mesh(EXAMPLE_MESHES / "plate_with_hole_05.msh")
    crack = place_line(xc.line_crack([(1.0, 0.0), (2.4, 0.0)]), mesh)
    lips = cut(mesh, line_levels(mesh, crack), CELLS[2]).lip_points(mesh)
    assert lips[..., 0].min() > 0.95
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    assert length == pytest.approx(1.4, abs=1e-9)  # round-off; a node lies at (1, 0)


def test_growth_steps_given_by_angles_reach_the_published_tips():
    """Three steps of 0.4, each turned by 30 degrees (code_aster SSLV316 in 2D)."""
    mesh = xc.box((0, 0), (8, 18), (40, 90))
    crack = place_line(xc.line_crack([(0.0, 9.0), (2.0, 9.0)]), mesh)
    tips = []
    for _ in range(3):
        crack = advance(crack, [np.pi / 6], [0.4])
        tips.append(crack.points[-1])
    expected = [(2.346410, 9.2), (2.546410, 9.546410), (2.546410, 9.946410)]
    np.testing.assert_allclose(tips, expected, atol=1e-6)  # printed digits
