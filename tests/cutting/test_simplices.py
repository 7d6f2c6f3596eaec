"""Triangles and tetrahedra cut by level sets: interfaces, shares without cancellation."""

from fractions import Fraction

import numpy as np
import pytest

from xcrack.fem.cut import parts_behind
from xcrack.mesh.simplex import cut_simplices, interface_simplices

REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def drawn_levels(seed, k=400):
    """Values at the corners of tetrahedra, of both signs, over nine decades, some zero."""
    rng = np.random.default_rng(seed)
    phi = rng.uniform(-1, 1, (k, 4)) * 10.0 ** rng.uniform(-9, 0, (k, 4))
    phi[::7, 0] = 0.0
    phi[::21, 1] = 0.0
    return phi[(phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)]


def areas(x):
    return np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2


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


def test_interfaces_lie_on_phi_zero_and_close_both_sides():
    """Divergence theorem: on each side the area vectors of the faces and the interface cancel."""
    phi = drawn_levels(2236)
    bary, parent = interface_simplices(phi)
    at = np.einsum("svb,sb->sv", bary, phi[parent])
    assert (np.abs(at) <= 1e-15 * np.abs(phi[parent]).max(axis=1, keepdims=True)).all()
    np.testing.assert_allclose(bary.sum(axis=2), 1.0, rtol=1e-14)
    assert (bary >= 0).all()
    # The derivative of the volume behind phi = c is the area over |grad phi|, c from below.
    x = np.einsum("svb,bd->svd", bary, REGULAR)
    vertices = np.concatenate([np.ones((4, 1)), REGULAR], axis=1)
    slope = np.linalg.norm(np.linalg.solve(vertices, phi.T)[1:], axis=0)
    area = np.bincount(parent, areas(x), len(phi))
    step = 1e-4 * np.abs(phi).min(axis=1, keepdims=True)
    smooth = (phi != 0).all(axis=1)
    volume = abs(np.linalg.det(REGULAR[1:] - REGULAR[0])) / 6

    def positive(values):
        _, fraction, side, owner = cut_simplices(values)
        return volume * np.bincount(owner, fraction * (side > 0), len(values))

    rows = smooth & (np.abs(phi).min(axis=1) > 1e-3 * np.abs(phi).max(axis=1))
    assert rows.sum() > 20
    change = (positive((phi + step)[rows]) - positive((phi - step)[rows])) / (2 * step[rows, 0])
    np.testing.assert_allclose(change, area[rows] / slope[rows], rtol=1e-5)  # differences


def test_sub_cells_are_bounded_by_the_interface():
    """Area of the faces that sub-cells of one side leave on phi = 0 is that of the interface."""
    phi = drawn_levels(449)
    bary, _, side, parent = cut_simplices(phi)
    at = np.einsum("svb,sb->sv", bary, phi[parent])
    on = np.abs(at) <= 1e-15 * np.abs(phi[parent]).max(axis=1, keepdims=True)
    generic = (phi != 0).all(axis=1)
    flat, owner = interface_simplices(phi)
    wanted = np.bincount(owner, areas(np.einsum("svb,bd->svd", flat, REGULAR)), len(phi))
    for sign in (1, -1):
        rows = np.nonzero((on.sum(axis=1) == 3) & (side == sign) & generic[parent])[0]
        corner = np.array([b[f] for b, f in zip(bary[rows], on[rows], strict=True)])
        area = np.bincount(parent[rows], areas(np.einsum("svb,bd->svd", corner, REGULAR)), len(phi))
        np.testing.assert_allclose(area[generic], wanted[generic], rtol=1e-9, atol=1e-15)


def test_parts_of_triangles_behind_a_front():
    rng = np.random.default_rng(86028)
    psi = rng.uniform(-1, 1, (300, 3))
    psi[::5, 1] = 0.0
    part, row = parts_behind(psi)
    share = np.abs(np.linalg.det(part))
    total = np.bincount(row, share, len(psi))
    a, b, c = np.sort(psi, axis=1).T
    # Share of a triangle on which a linear function is negative, by its sorted corner values.
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = a * a / ((b - a) * (c - a)), 1 - c * c / ((c - a) * (c - b))
    wanted = np.select([c <= 0, b <= 0, a < 0], [1.0, two, one], 0.0)
    np.testing.assert_allclose(total, wanted, atol=1e-12)
