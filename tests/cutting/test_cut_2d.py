"""Cutting in 2D: crack faces that are counted once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xcrack as xc
from support import scenes_2d as scenes


def cut(mesh, points):
    """What a solution knows of the cells that a crack cuts."""
    steel = xc.Isotropic(1.0, 0.3, plane="strain")
    support, load = xc.fix("boundary"), xc.body_force((0.0, 1.0))
    problem = xc.Problem(mesh, steel, [xc.line_crack(points)], [support], [load], "off", order=1)
    return xc.solve(problem).space.cuts[0]


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(-1.5, 1.5),
    offset=st.floats(-0.4, 0.4),
    seed=st.integers(0, 10_000),
)
def test_lips_of_a_line_through_a_box_have_its_length(angle, offset, seed):
    mesh = scenes.perturbed(7, seed)
    t, n = scenes.rows(angle)
    lips = cut(mesh, [offset * n - 3 * t, offset * n + 3 * t]).lip_points(mesh)
    reach = np.min(
        [(np.sign(ti) - o) / ti for ti, o in zip(t, offset * n, strict=True) if abs(ti) > 1e-12]
    )
    back = np.min(
        [(np.sign(ti) + o) / ti for ti, o in zip(t, offset * n, strict=True) if abs(ti) > 1e-12]
    )
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    assert length == pytest.approx(
        reach + back, rel=1e-9
    )  # snapping moves a cut by 1e-10 of a cell


@pytest.mark.parametrize(
    ("points", "length"),
    [
        ([(-1.0, 0.0), (0.0, 0.0)], 1.0),  # on edges, tip on a node
        ([(-1.0, 0.0), (0.05, 0.0)], 1.05),  # on edges, tip on an edge
        ([(-1.0, 1e-12), (0.05, 1e-12)], 1.05),  # 1e-11 of a cell beside the edges
        ([(-1.0, -1.0), (0.03, 0.03)], 1.03 * 2**0.5),  # through nodes and along diagonals
        ([(-0.5, -0.3), (0.3, 0.4)], (0.8**2 + 0.7**2) ** 0.5),  # two tips on nodes
        ([(-1.0, 0.05), (0.1, 0.05)], 1.1),  # half way between node rows
    ],
)
def test_cracks_on_mesh_lines_are_counted_once(points, length):
    mesh = xc.box((-1, -1), (1, 1), 20)
    lips = cut(mesh, points).lip_points(mesh)
    assert np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum() == pytest.approx(length, abs=1e-9)


def test_normals_point_to_the_left_of_the_order_of_the_points():
    mesh = scenes.perturbed(11, seed=12)
    for points in ([(-1, 0.1), (0.3, 0.2)], [(0.3, 0.2), (-1, 0.1)], [(-1, 0.0), (0.0, 0.0)]):
        normal = cut(mesh, points).lip_normal
        along = np.subtract(points[1], points[0])
        assert (normal @ np.array([-along[1], along[0]]) > 0).all()
