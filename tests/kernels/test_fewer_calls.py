"""Kernels that take the place of many small calls, against numpy and scipy."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import Delaunay

import xcrack as xc
from tests.support import scenes_2d as scenes
from xcrack.fem.kernels.functions import solve_moments
from xcrack.fem.kernels.stiffness import joined_blocks
from xcrack.linalg.kernels.sparse import (
    bordered_matrix,
    orthonormal_columns,
    residual,
    times,
    times_transposed,
)
from xcrack.mesh.distances import distance_to_simplices
from xcrack.mesh.kernels.location import cells_within, locate_points, nearest_segment
from xcrack.mesh.kernels.splitting import (
    cut_simplices,
    graded_points,
    interface_simplices,
    split_segments,
)
from xcrack.mesh.locate import cells_around


def spd(rng, n):
    root = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.4) + 2 * np.eye(n)
    return root @ root.T


def arrays(A):
    return A.indptr, A.indices, A.data


def test_bordered():
    """Both sides scaled; fixed unknowns and those without energy are left out."""
    rng = np.random.default_rng(4411)
    A = spd(rng, 9)
    A[2], A[:, 2] = 0, 0  # a standard unknown without energy
    Z = np.zeros((9, 2))
    Z[6:, 0], Z[[1, 7], 1] = rng.normal(size=3), rng.normal(size=2)
    fixed = np.zeros(9, dtype=bool)
    fixed[4] = True
    products = (Z, A @ Z, Z.T @ A, Z.T @ A @ Z)
    parts = (arrays(sp.csr_matrix(each)) for each in products)
    matrix, basis, energy = bordered_matrix(*arrays(sp.csr_matrix(A)), *parts, fixed, 6)
    columns = np.concatenate([np.eye(9)[:, [0, 1, 3, 5]], Z], axis=1)
    expected = columns / np.sqrt(np.diag(columns.T @ A @ columns))
    result = sp.csr_matrix((basis[2], basis[1], basis[0]), shape=(9, 6)).toarray()
    np.testing.assert_allclose(result, expected, rtol=1e-14)
    np.testing.assert_allclose(energy, np.diag(Z.T @ A @ Z), rtol=1e-14)
    reduced = sp.csc_matrix((matrix[2], matrix[1], matrix[0]), shape=(6, 6))
    assert reduced.has_sorted_indices
    np.testing.assert_allclose(reduced.toarray(), expected.T @ A @ expected, atol=1e-14)


def test_orthonormal_columns():
    """Orthonormal in each block, orthogonal to its standard unknowns, all that is independent."""
    rng = np.random.default_rng(977)
    A = spd(rng, 12)
    A[10] = A[7]  # 10 repeats 7
    A[:, 10] = A[:, 7]
    members, offsets = np.array([0, 1, 5, 6, 2, 3, 7, 8, 9, 10, 4]), np.array([0, 4, 10, 11])
    standard = np.array([2, 2, 1])
    start, column, value, count = orthonormal_columns(
        *arrays(sp.csr_matrix(A)), members, offsets, standard, 1e-10
    )
    Z = sp.csr_matrix((value, column, start), shape=(12, count)).toarray()
    assert count == 2 + 3
    for own, s, columns in ((members[:4], 2, [0, 1]), (members[4:10], 2, [2, 3, 4])):
        block, part = A[np.ix_(own, own)], Z[np.ix_(own, columns)]
        np.testing.assert_allclose(part.T @ block @ part, np.eye(len(columns)), atol=1e-12)
        np.testing.assert_allclose(block[:s] @ part, 0, atol=1e-12)
        assert not np.delete(Z[:, columns], own, axis=0).any()


def test_orthonormal_columns_of_a_singular_block():
    start = np.array([0, 1, 2])
    wrong = np.array([0.0, 1.0])  # no energy of the standard unknown
    result = orthonormal_columns(
        start, np.array([0, 1]), wrong, np.array([0, 1]), np.array([0, 2]), np.array([1]), 1e-10
    )
    assert result[-1] == -1


def test_joined():
    rng = np.random.default_rng(31)
    body, over = rng.normal(size=(6, 6)), rng.normal(size=(10, 10))
    body[:2, 2:4], body[4, 5], over[:6, :6], over[2:4, 8:] = 0, 0, 0, 0
    one, other = sp.bsr_matrix(body, blocksize=(2, 2)), sp.bsr_matrix(over, blocksize=(2, 2))
    result = joined_blocks(*arrays(one), *arrays(other), np.ones(5, dtype=bool))
    matrix = sp.csr_matrix((result[2], result[1], result[0]), shape=(10, 10))
    over[:6, :6] = body
    np.testing.assert_array_equal(matrix.toarray(), over)
    assert matrix.has_sorted_indices
    assert matrix.data.all()
    assert matrix.indices.dtype == np.int32


def test_products_are_those_of_scipy():
    rng = np.random.default_rng(5501)
    A = sp.random(40, 30, 0.2, "csr", random_state=rng)
    x, y = rng.normal(size=(30, 3)), rng.normal(size=(40, 2))
    np.testing.assert_array_equal(times(*arrays(A), x), A @ x)
    np.testing.assert_array_equal(times_transposed(*arrays(A), 30, y), A.T @ y)
    b = rng.normal(size=(40, 3))
    share = np.linalg.norm(b - A @ x, axis=0) / np.linalg.norm(b, axis=0)
    assert residual(*arrays(A), x, b) == pytest.approx(share.max(), rel=1e-14)
    b[3, 1] = np.nan
    assert np.isnan(residual(*arrays(A), x, b))


@pytest.mark.parametrize("dim", [2, 3])
def test_located(dim):
    rng = np.random.default_rng(83)
    tree = Delaunay(rng.random((60, dim)))
    mesh = xc.Mesh(tree.points, tree.simplices.astype(np.int64))
    of = mesh.points, mesh.cells, mesh.gradient, *mesh.cell_grid
    x = rng.uniform(-0.2, 1.2, (90, dim))
    cell, bary = locate_points(*of, x, 1e-10)
    outside = tree.find_simplex(x) < 0
    np.testing.assert_array_equal(cell < 0, outside)
    inside = ~outside
    back = np.einsum("kv,kvd->kd", bary[inside], mesh.points[mesh.cells[cell[inside]]])
    np.testing.assert_allclose(back, x[inside], atol=1e-13)
    assert bary[inside].min() >= -1e-10
    at = mesh.points[17]
    around = cells_around(mesh, at, 1e-10)
    np.testing.assert_array_equal(around, np.nonzero((mesh.cells == 17).any(axis=1))[0])
    where = locate_points(*of, at[None], 1e-10)[0][0]
    apart = np.linalg.norm(mesh.points[mesh.cells[around]].mean(axis=1) - at, axis=1)
    assert where == around[apart.argmin()]
    assert locate_points(*of, x[:0], 1e-10)[0].shape == (0,)


def test_cells_and_segments_near_a_point():
    mesh, x = scenes.perturbed(9, seed=677), np.array([0.31, -0.12])
    corner = mesh.points[mesh.cells]
    sides = [distance_to_simplices(x, corner[:, pair]) for pair in ([0, 1], [1, 2], [2, 0])]
    wanted = np.nonzero(np.min(sides, axis=0) <= 0.3)[0]
    np.testing.assert_array_equal(cells_within(mesh.points, mesh.cells, x, 0.3), wanted)
    distance, length = nearest_segment(mesh.points, mesh.boundary, x)
    every = distance_to_simplices(x, mesh.points[mesh.boundary])
    a, b = mesh.points[mesh.boundary[every.argmin()]]
    assert distance == pytest.approx(every.min(), rel=1e-15)
    assert length == pytest.approx(np.linalg.norm(b - a), rel=1e-15)


def test_graded_points_without_a_tip():
    u, w = np.array([0.25, 0.75]), np.array([0.5, 0.5])
    begin, end = np.zeros((2, 2)), np.array([[2.0, 0.0], [0.0, 0.0]])  # one without length
    segment, place, weight = graded_points(begin, end, np.zeros((0, 2)), u, w)
    np.testing.assert_array_equal(segment, [0, 0, 1, 1])
    np.testing.assert_array_equal(place[:2], [[0.75, 0.25], [0.25, 0.75]])
    np.testing.assert_array_equal(weight, [1.0, 1.0, 0.0, 0.0])


def test_split():
    """An edge that a crack cuts, one ahead of its tip, one beside it, one that runs backwards."""
    ends = np.array([[0, 1], [2, 3], [4, 5], [7, 6]])
    cut = np.array([[0.25, np.nan, np.nan, 0.25]])
    level = np.array([[[-1.0, 3.0], [-1.0, 2.0], [1.0, 2.0], [3.0, -1.0]]])
    number, bary, side = split_segments(ends, cut, level)
    np.testing.assert_array_equal(number, [0, 1, 2, 3, 0, 3])
    np.testing.assert_array_equal(side[:, 0], [-1, 0, 1, 1, 1, -1])
    np.testing.assert_array_equal(bary[0], [[1, 0], [0.75, 0.25]])
    np.testing.assert_array_equal(bary[4], [[0.75, 0.25], [0, 1]])
    np.testing.assert_array_equal(bary[3], [[1, 0], [0.25, 0.75]])


def test_split_by_three_cracks():
    """Parts in their order along the edge; a position that two cracks share counts once."""
    ends = np.array([[0, 1], [3, 2], [4, 5]])
    cut = np.array([[0.5, 0.8, np.nan], [0.9, 0.3, 0.5], [0.1, 0.5, 0.5]])
    level = np.repeat(np.array([[[-1.0, 1.0]]]), 3, axis=0).repeat(3, axis=1)
    number, bary, side = split_segments(ends, cut, level)
    np.testing.assert_array_equal(number, [0, 1, 2, 0, 1, 2, 0, 1, 0, 1])
    first = bary[number == 0, :, 1]
    np.testing.assert_allclose(first, [[0, 0.1], [0.1, 0.5], [0.5, 0.9], [0.9, 1]])
    np.testing.assert_array_equal(
        side[number == 0], [[-1, -1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1]]
    )
    turned = bary[number == 1, :, 1]
    np.testing.assert_allclose(turned, [[0, 0.2], [0.2, 0.5], [0.5, 0.7], [0.7, 1]])
    np.testing.assert_allclose(bary[number == 2, :, 1], [[0, 0.5], [0.5, 1]])


@pytest.mark.parametrize("by_place", [False, True])
@pytest.mark.parametrize("n", [3, 4])
def test_cut_simplices_fill_their_parents(n, by_place):
    """Shares are determinants, sum to one, and phi has one sign on each part."""
    rng = np.random.default_rng(1201)
    phi = rng.normal(size=(500, n))
    phi[rng.random(phi.shape) < 0.1] = 0
    phi = phi[(phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)]
    x = rng.normal(size=(len(phi) if by_place else 0, n, n - 1))
    bary, fraction, side, parent = cut_simplices(phi, x, 1e-30)
    np.testing.assert_allclose(fraction, np.abs(np.linalg.det(bary)), atol=1e-15)
    np.testing.assert_allclose(np.bincount(parent, fraction), 1, rtol=1e-14)
    at = np.einsum("svb,sb->sv", bary, phi[parent]) * side[:, None]
    assert at.min() >= -1e-15
    lips, of = interface_simplices(phi, x)
    np.testing.assert_allclose(np.einsum("svb,sb->sv", lips, phi[of]), 0, atol=1e-15)
    assert len(cut_simplices(np.abs(phi), x, 1e-30)[0]) == 0
    assert len(interface_simplices(np.abs(phi), x)[0]) == 0


@pytest.mark.parametrize("count", [1, 3, 4])
def test_moments_are_solved_as_by_pinv(count):
    rng = np.random.default_rng(59)
    root = rng.normal(size=(6, count, count))
    root[2, :, -1] = root[2, :, 0]  # singular unless it is one number
    gram = root @ np.swapaxes(root, 1, 2) * 3e-5
    defect = rng.normal(size=(6, 5, 2, count))
    inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
    wanted = np.einsum("pfda,pab->pfdb", defect, inverse)
    result, scratch = defect.copy(), gram.copy()
    solve_moments(result, scratch, 1e-12)
    np.testing.assert_allclose(result, wanted, rtol=1e-9)  # round-off times the condition
