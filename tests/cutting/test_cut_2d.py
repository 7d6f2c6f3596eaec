"""Cutting: fractions without cancellation, crack faces that are counted once."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.crack.placing_2d import place_line
from xcrack.fem.cut import cut, cut_simplices
from xcrack.fem.level_set import line_levels


@pytest.mark.parametrize("n", [3, 4])
def test_sub_cells_fill_their_cell_and_keep_their_side(n):
    rng = np.random.default_rng(1618)
    phi = rng.uniform(-1, 1, (300, n)) * 10.0 ** rng.uniform(-9, 0, (300, n))
    phi[::7, 0] = 0.0
    phi = phi[(phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)]
    bary, fraction, side, parent = cut_simplices(phi)
    total = np.bincount(parent, fraction, minlength=len(phi))
    np.testing.assert_allclose(total, 1.0, rtol=1e-12)  # round-off
    np.testing.assert_allclose(np.abs(np.linalg.det(bary)), fraction, atol=1e-14)
    middle = np.einsum("sb,sb->s", bary.mean(axis=1), phi[parent])
    assert (np.sign(middle) == side).all()


def test_tiny_pieces_keep_their_relative_accuracy():
    """Against rational arithmetic: a corner of 1e-28 of a triangle to 15 digits."""
    phi = np.array([[1e-14, -1.0, -0.3]])
    _, fraction, side, _ = cut_simplices(phi)
    a, b, c = (Fraction(float(v)) for v in phi[0])
    exact = (a / (a - b)) * (a / (a - c))
    assert fraction[side > 0].sum() == pytest.approx(float(exact), rel=1e-14)


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(-1.5, 1.5),
    offset=st.floats(-0.4, 0.4),
    seed=st.integers(0, 10_000),
)
def test_lips_of_a_line_through_a_box_have_its_length(angle, offset, seed):
    mesh = scenes.perturbed(7, seed)
    t, n = scenes.rows(angle)
    crack = place_line(xc.line_crack([offset * n - 3 * t, offset * n + 3 * t]), mesh)
    lips = cut(mesh, line_levels(mesh, crack)).lip_points(mesh)
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
    lips = cut(mesh, line_levels(mesh, place_line(xc.line_crack(points), mesh))).lip_points(mesh)
    assert np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum() == pytest.approx(length, abs=1e-9)


def test_normals_point_to_the_left_of_the_order_of_the_points():
    mesh = scenes.perturbed(11, seed=12)
    for points in ([(-1, 0.1), (0.3, 0.2)], [(0.3, 0.2), (-1, 0.1)], [(-1, 0.0), (0.0, 0.0)]):
        crack = place_line(xc.line_crack(points), mesh)
        normal = cut(mesh, line_levels(mesh, crack)).lip_normal
        along = np.subtract(points[1], points[0])
        assert (normal @ np.array([-along[1], along[0]]) > 0).all()
