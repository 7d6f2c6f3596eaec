"""Bodies drawn with the curves that their mesh knows: outlines and areas of what is drawn."""

import dataclasses

import numpy as np
import pytest

import xcrack as xc
from xcrack.output.curved_sides import CurvedSides, boundary_lines, shading_normals
from xcrack.view.projection import given_plane, section_outline
from xcrack.view.scene_2d import scene
from xcrack.view.scene_3d import mesh_scene, space_scene
from xcrack.view.section_3d import areas

R, SIDE = 1.0, 6.0
SEEN = 3e-3  # length: half of it is what a picture of the body does not show


def circle(x):
    """Nearest points on the wall of a hole along z."""
    flat = x[:, :2] / np.linalg.norm(x[:, :2], axis=1)[:, None] * R
    return np.concatenate([flat, x[:, 2:]], axis=1)


def plate(n):
    """Square plate with a hole of n chords, which the mesh knows to be round."""
    turn = 2 * np.pi * np.arange(n) / n
    hole = R * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rim = SIDE / 2 * hole / np.abs(hole).max(axis=1)[:, None]
    i, j = np.arange(n), (np.arange(n) + 1) % n
    cells = np.concatenate([np.stack([i, n + i, n + j], 1), np.stack([i, n + j, j], 1)])
    return np.concatenate([hole, rim]), cells, np.stack([i, j], 1)


def flat_plate(n):
    points, cells, rim = plate(n)
    mesh = xc.Mesh(points, cells, {"hole": rim}, curves={"hole": circle})
    return xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3, plane="stress"), loads=LOADS)


def solid_plate(n):
    """The same with a thickness of one, its prisms divided from their smallest number."""
    points, cells, _ = plate(n)
    m = len(points)
    x = np.concatenate([np.column_stack([points, np.full(m, z)]) for z in (0.0, 1.0)])
    p, q, r = np.sort(cells, axis=1).T
    split = [[p, q, r, r + m], [p, q, q + m, r + m], [p, p + m, q + m, r + m]]
    cells = np.concatenate([np.stack(each, axis=1) for each in split])
    bare = xc.Mesh(x, cells)
    on_hole = (np.hypot(*x[bare.boundary][..., :2].transpose(2, 0, 1)) < R + 1e-9).all(axis=1)
    mesh = xc.Mesh(x, bare.cells, {"hole": bare.boundary[on_hole]}, curves={"hole": circle})
    return xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3), loads=LOADS)


LOADS = (xc.pressure("hole", 1e-3),)


def off_circle(x):
    x = x.reshape(-1, x.shape[-1])
    near = np.hypot(x[:, 0], x[:, 1]) < 1.5 * R
    return np.abs(np.hypot(x[near, 0], x[near, 1]) - R)


@pytest.mark.parametrize("order", [1, 2])
def test_a_hole_of_eight_chords_is_drawn_round(order):
    solution = xc.solve(dataclasses.replace(flat_plate(8), order=order))
    picture = scene(solution, "von_mises", 0.0, None)
    for line in (picture.outline, picture.at_rest, boundary_lines(solution.space.mesh)):
        assert len(off_circle(line)) > 60
        assert off_circle(line).max() < SEEN
    corner = picture.points[picture.triangles]
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum() / 2
    assert area == pytest.approx(SIDE**2 - np.pi * R**2, rel=2e-3)
    moved = scene(solution, "ux", 50.0, None)
    assert np.abs(moved.outline - picture.outline).max() > 1e-3


def test_a_hole_in_space_is_drawn_round():
    solution = xc.solve(solid_plate(8))
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    assert off_circle(picture.outline).max() < SEEN
    middle = SIDE**2 - np.pi * R**2
    flat = np.abs(picture.triangles[..., 2] - 1).max(axis=1) < 1e-9
    assert areas(picture.triangles[flat]).sum() == pytest.approx(middle, rel=3e-3)
    wall = (np.hypot(*picture.triangles[..., :2].transpose(2, 0, 1)) < 1.01 * R).all(axis=1)
    assert areas(picture.triangles[wall]).sum() == pytest.approx(2 * np.pi * R, rel=3e-3)
    # No line runs along the chords, though they meet at 45 degrees.
    along = picture.outline[:, 1] - picture.outline[:, 0]
    upright = np.abs(along[:, 2]) > 0.1
    assert not (np.hypot(*picture.outline[upright][..., :2].transpose(2, 0, 1)) < 1.5).any()
    cut = space_scene(solution, "uz", 0.0, None, (np.zeros(3), np.array([0.0, -1.0, 0.0])), None)
    assert off_circle(cut.outline).max() < SEEN + 1e-9
    edges = mesh_scene(solution, None, None)
    assert off_circle(edges.faint_lines).max() < SEEN
    assert off_circle(edges.outline).max() < SEEN
    plane = given_plane(((0, 0, 0.5), ((1, 0, 0), (0, 1, 0))))
    assert off_circle(section_outline(solution.space.mesh, plane)).max() < SEEN


def test_normals_of_a_round_side_are_those_of_its_axis():
    solution = xc.solve(solid_plate(8))
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    wall = (np.hypot(*picture.triangles[..., :2].transpose(2, 0, 1)) < 1.01 * R).all(axis=1)
    x, normal = picture.triangles[wall], shading_normals(picture.triangles)[wall]
    radial = np.concatenate([x[..., :2] / R, 0 * x[..., 2:]], axis=2)
    assert np.abs(np.einsum("kvd,kvd->kv", radial, normal)).min() > np.cos(np.radians(4))


def test_a_mesh_without_curves_has_none():
    assert CurvedSides.of(xc.box((0, 0), (1, 1), 2)) is None
