"""Level sets of polylines: distances, old faces that stay, cracks that turn far."""

from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
EXAMPLE_MESHES = Path(__file__).parents[2] / "examples" / "meshes"


def naive_distance(x, vertices):
    """Signed distance by the smallest of all segments, one point at a time."""
    result = []
    for point in x:
        a, edge = vertices[:-1], np.diff(vertices, axis=0)
        share = np.clip(((point - a) * edge).sum(axis=1) / (edge**2).sum(axis=1), 0, 1)
        feet = a + share[:, None] * edge
        gaps = np.linalg.norm(point - feet, axis=1)
        near = np.nonzero(gaps <= gaps.min() * (1 + 1e-14))[0]
        along = np.diff(vertices, axis=0)[near]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1).sum(axis=0)
        result.append(np.copysign(gaps.min(), normal @ (point - feet[near[0]])))
    return np.array(result)


def solved(mesh, points):
    """A solution, for what it knows of the crack and the cells that it cuts."""
    load = xc.body_force((0.0, 1.0))
    problem = xc.Problem(mesh, STEEL, [xc.line_crack(points)], [xc.fix("top")], [load], "off", 1)
    return xc.solve(problem)


def led_on(points, turns, da):
    """A polyline that goes on by a distance for each turn of its heading."""
    points = [np.array(x, dtype=float) for x in points]
    along = points[-1] - points[-2]
    heading = np.arctan2(along[1], along[0])
    for turn in turns:
        heading += turn
        points.append(points[-1] + da * np.array([np.cos(heading), np.sin(heading)]))
    return np.array(points)


def test_distance_agrees_with_its_naive_twin():
    """A staircase with a tip at each end: phi near it, where its end is not the nearest place."""
    rng = np.random.default_rng(2718)
    steps = np.stack([rng.uniform(0.1, 0.2, 8), rng.uniform(-0.1, 0.1, 8)], axis=1)
    vertices = np.cumsum(steps, axis=0) - (0.6, 0.0)
    mesh = scenes.perturbed(24, seed=31)
    levels = solved(mesh, vertices).space.cuts[0].level_set
    x = mesh.points
    beside = (x[:, 0] > vertices[0, 0] + 0.2) & (x[:, 0] < vertices[-1, 0] - 0.2)
    beside &= np.abs(x[:, 1]) < 0.3
    assert beside.sum() > 40
    wanted = naive_distance(x[beside], vertices)
    np.testing.assert_allclose(levels.phi[beside], wanted, atol=1e-13)  # round-off


def test_straight_crack_has_linear_level_sets():
    mesh = scenes.perturbed(9, seed=31)
    solution = solved(mesh, scenes.edge_line((0.083, 0.047), 0.41).points)
    levels, ends = solution.space.cuts[0].level_set, solution.problem.stations
    local = (mesh.points - ends.x[0]) @ ends.frame[0].T
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
    turn, da = turning(40, 0.4, degrees)
    points = led_on([(-1.0, -0.503), (-0.05, -0.503)], [turn] * 40, da)
    lips = solved(mesh, points).space.cuts[0].lip_points(mesh)
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    inside = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    h = 2 / 50
    assert length == pytest.approx(inside, rel=2e-3)  # discretisation: kinks cut inside cells
    gaps = np.abs(naive_distance(lips.mean(axis=1), points))
    assert gaps.max() < 0.05 * h  # no lip anywhere else


def test_old_faces_are_frozen_to_the_last_bit():
    mesh = scenes.perturbed(24, seed=5)
    before = np.array([(-1.0, 0.013), (0.021, 0.017)])
    after = led_on(before, [0.6], 0.2)
    old, new = (solved(mesh, points).space.cuts[0].level_set for points in (before, after))
    tip = before[-1]
    behind = mesh.points[:, 0] < tip[0] - 2 * mesh.cell_size.max()
    behind &= np.abs(mesh.points[:, 1]) < 0.3
    assert behind.sum() > 50
    np.testing.assert_array_equal(new.phi[behind], old.phi[behind])


def grown(mesh, points, turns, da, steps):
    """A crack that grows by a turn at each tip in each step, whatever K is; which tips grow."""
    driven = np.array([[float(turn is not None), 0.0] for turn in turns])

    def criterion(K, nu):
        _, dK, R = xc.max_hoop_stress(K, nu)
        return np.resize([turn or 0.0 for turn in turns], K.shape[1]), dK, R

    def response(problem, states, reuse, bars):
        return xc.Response.of_K(problem, states, [state * driven for state in states])

    law, cycle = xc.paris(1.0, 2.0), xc.Cycle(0.0, 1.0)
    problem = xc.Problem(mesh, STEEL, [xc.line_crack(points)])
    run = xc.grow(problem, law, criterion, cycle, da, integrator="euler", max_steps=steps + 1,
                  response=response, progress=False)  # fmt: skip
    return [step.cracks[0] for step in run]


def test_tip_that_does_not_move_is_the_same_to_the_last_bit():
    mesh, points = scenes.perturbed(24, seed=6), [(-0.4, 0.013), (0.4, 0.11)]
    moved = grown(mesh, points, [None, 0.2], 0.15, 1)[-1]
    np.testing.assert_array_equal(moved.points[:2], points)
    assert moved.tips == (0, 2)
    levels = solved(mesh, moved.points).space.cuts[0].level_set
    assert [len(c) for c in levels.tip_cells] == [1, 1]


def test_line_beyond_a_hole_is_no_crack():
    """The ray of a mouth on a hole meets the body again on the far side: nothing is cut there."""
    mesh = xc.read_mesh(EXAMPLE_MESHES / "plate_with_hole_05.msh")
    lips = solved(mesh, [(1.0, 0.0), (2.4, 0.0)]).space.cuts[0].lip_points(mesh)
    assert lips[..., 0].min() > 0.95
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    assert length == pytest.approx(1.4, abs=1e-9)  # round-off; a node lies at (1, 0)


def test_growth_steps_given_by_angles_reach_the_published_tips():
    """Three steps of 0.4, each turned by 30 degrees (code_aster SSLV316 in 2D)."""
    mesh = xc.box((0, 0), (8, 18), (40, 90))
    cracks = grown(mesh, [(0.0, 9.0), (2.0, 9.0)], [np.pi / 6], 0.4, 3)
    tips = [crack.points[-1] for crack in cracks[1:]]
    expected = [(2.346410, 9.2), (2.546410, 9.546410), (2.546410, 9.946410)]
    np.testing.assert_allclose(tips, expected, atol=1e-6)  # printed digits
