"""Each kernel against a twin without tricks."""

import numpy as np
import pytest
import scipy.sparse as sp

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.fem.assembly import bulk
from xcrack.fem.kernels.stiffness import (
    add_block_stiffness,
    add_stiffness,
    block_pattern,
    enriched_pattern,
)
from xcrack.linalg.kernels.sparse import dense_blocks
from xcrack.mesh.simplex import cell_nodes, shape_derivatives, simplex_rule
from xcrack.model.elasticity import elasticity
from xcrack.model.material import isotropic_part


def elastic_block(G, weight, lam, mu):
    """Stiffness of tabulated gradients (q, n, d), term by term."""
    n, d = G.shape[1:]
    K = np.zeros((n, d, n, d))
    for q, w in enumerate(weight):
        for a in range(n):
            for b in range(n):
                ga, gb = G[q, a], G[q, b]
                K[a, :, b, :] += w * (
                    lam * np.outer(ga, gb) + mu * np.outer(gb, ga) + mu * (ga @ gb) * np.eye(d)
                )
    return K


def general_block(G, weight, C):
    """Stiffness of tabulated gradients (q, n, d) by the tensor of the material."""
    return np.einsum("q,ikjl,qak,qbl->aibj", weight, C, G, G)


def drawn_tensor(rng, d):
    """A stiffness with the symmetries of an elastic one, and no other."""
    C = rng.normal(size=(d,) * 4)
    C = C + C.transpose(1, 0, 2, 3)
    C = C + C.transpose(0, 1, 3, 2)
    return C + C.transpose(2, 3, 0, 1)


@pytest.mark.parametrize("graded", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_stiffness_of_any_material(d, graded):
    """Of plain cells, and of cells with enriched functions, against sums over the tensor."""
    rng = np.random.default_rng(5813)
    C = drawn_tensor(rng, d)
    stiffness = isotropic_part(C)
    corners = rng.uniform(size=(d + 1, d)) + np.eye(d + 1, d)
    mesh = xc.Mesh(corners, [range(d + 1)], {})
    nodes = cell_nodes(mesh, 2)
    indptr, indices, slot = block_pattern(nodes, len(nodes[0]))
    bary, share = simplex_rule(d, 2)
    derivative = shape_derivatives(2, bary)
    data = np.zeros((len(indices), d, d))
    factor = rng.uniform(0.5, 2, (1, d + 1)) if graded else None
    middle = indptr[2]  # rows of blocks by two threads
    for low, high in ((0, middle), (middle, len(indices))):
        add_block_stiffness(
            data, low, high, np.arange(1), slot, mesh.gradient, mesh.volume, derivative, bary,
            share, factor, *stiffness,
        )  # fmt: skip
    blocks = data[slot[0]].transpose(0, 2, 1, 3)
    gradient = np.einsum("qak,ki->qai", derivative, mesh.gradient[0])
    at_points = bary @ factor[0] if graded else 1.0
    expected = general_block(gradient, share * mesh.volume[0] * at_points, C)
    assert np.allclose(blocks, expected, rtol=0, atol=1e-13 * np.abs(expected).max())

    weight, G = rng.uniform(0.1, 1, 5), rng.normal(size=(5, 3, d))
    functions, offsets = np.array([[0, 2, 3]]), np.array([0, 5])
    indptr, indices = enriched_pattern(functions, 4, 2)
    data = np.zeros((len(indices), d, d))
    add_stiffness(data, indptr, indices, functions, offsets, weight, G, 2, *stiffness)
    result = sp.bsr_matrix((data, indices, indptr), shape=(4 * d, 4 * d)).toarray()
    expected = np.zeros((4, d, 4, d))
    on = functions[0]
    expected[np.ix_(on, range(d), on, range(d))] = general_block(G, weight, C)
    expected[0, :, 0] = 0.0  # of two standard functions: that of the uncracked body
    expected = expected.reshape(result.shape)
    assert np.allclose(result, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_enriched_stiffness():
    rng = np.random.default_rng(577)
    functions = np.array([[0, 3, 5, 6], [1, 4, -1, 7], [2, 0, 5, -1]])
    offsets = np.array([0, 2, 5, 6])
    weight, G = rng.uniform(0.1, 1, 6), rng.normal(size=(6, 4, 2))
    indptr, indices = enriched_pattern(functions, 8, 5)
    data = np.zeros((len(indices), 2, 2))
    add_stiffness(data, indptr, indices, functions, offsets, weight, G, 5, 1.3, 0.7, None)
    result = sp.bsr_matrix((data, indices, indptr), shape=(16, 16)).toarray()
    expected = np.zeros((8, 2, 8, 2))
    for e, numbers in enumerate(functions):
        on = np.nonzero(numbers >= 0)[0]
        q = slice(offsets[e], offsets[e + 1])
        block = elastic_block(G[q][:, on], weight[q], 1.3, 0.7)
        for i, a in enumerate(numbers[on]):
            for j, b in enumerate(numbers[on]):
                if a >= 5 or b >= 5:
                    expected[a, :, b] += block[i, :, j]
    np.testing.assert_allclose(result, expected.reshape(16, 16), atol=1e-13)  # round-off


def test_bulk_stiffness():
    material = xc.Isotropic(E=3.0, nu=0.2, plane="stress")
    for order in (1, 2):
        mesh = scenes.perturbed(3, seed=8)
        nodes = cell_nodes(mesh, order)
        bary, rule = simplex_rule(2, 2 * (order - 1))
        dN = shape_derivatives(order, bary)
        size = int(nodes.max()) + 1
        expected = np.zeros((size, 2, size, 2))
        for c, numbers in enumerate(nodes):
            G = np.einsum("qnb,bd->qnd", dN, mesh.gradient[c])
            block = elastic_block(G, rule * mesh.volume[c], material.lam, material.mu)
            expected[np.ix_(numbers, range(2), numbers, range(2))] += block
        result = bulk(elasticity(mesh, material), order).matrix.toarray()
        np.testing.assert_allclose(result, expected.reshape(2 * size, -1), atol=1e-13)


def test_pattern_holds_every_pair_once():
    mesh = scenes.perturbed(4, seed=9)
    indptr, indices, slot = block_pattern(np.ascontiguousarray(mesh.cells), mesh.n_points)
    pairs = {(int(a), int(b)) for cell in mesh.cells for a in cell for b in cell}
    rows = np.repeat(np.arange(mesh.n_points), np.diff(indptr))
    assert sorted(pairs) == list(zip(rows.tolist(), indices.tolist(), strict=True))
    for cell, own in zip(mesh.cells, slot, strict=True):
        np.testing.assert_array_equal(indices[own], np.broadcast_to(cell, (3, 3)))


def test_dense_blocks():
    rng = np.random.default_rng(83)
    matrix = rng.normal(size=(9, 9)) * (rng.random((9, 9)) < 0.6)
    import scipy.sparse as sp

    K = sp.csr_matrix(matrix)
    members, offsets = np.array([2, 5, 0, 8, 3]), np.array([0, 3, 5])
    result = dense_blocks(K.indptr, K.indices, K.data, members, offsets)
    first, second = matrix[np.ix_(members[:3], members[:3])], matrix[np.ix_([8, 3], [8, 3])]
    np.testing.assert_array_equal(result, np.concatenate([first.ravel(), second.ravel()]))


def test_points_of_triangles_near_tips():
    """Moments are exact on every triangle; next to a tip points are as dense as their distance."""
    from xcrack.mesh.kernels.splitting import triangle_points
    from xcrack.mesh.simplex import gauss, simplex_rule

    rng = np.random.default_rng(4410)
    x, tips = rng.uniform(size=(40, 3, 2)), rng.uniform(size=(2, 2))
    x[30:, 0] = tips[0]
    bary = np.broadcast_to(np.eye(3), (40, 3, 3)).copy()
    bears, fan = np.arange(40) >= 10, np.arange(40) >= 30
    for levels, degree in ((4, 2), (1, 10)):
        number, place, weight = triangle_points(
            bary, x, np.full(40, 0.5), bears, fan, tips, levels, *simplex_rule(2, 2),
            *simplex_rule(2, degree), *gauss(5), *gauss(8), np.zeros(2), np.zeros(0),
        )  # fmt: skip
        assert (np.diff(number) >= 0).all()
        assert np.bincount(number, weight) == pytest.approx(np.full(40, 0.5), abs=1e-14)
        # The integrals of a barycentric coordinate and of its square, as shares of the area.
        for b in range(3):
            first, second = (np.bincount(number, weight * place[:, b] ** p) for p in (1, 2))
            assert first == pytest.approx(np.full(40, 1 / 6), abs=1e-14)
            assert second == pytest.approx(np.full(40, 1 / 12), abs=1e-14)
        # 1 / r over a triangle with the tip as a vertex, by the height h of the tip over the far
        # side and the places t of its ends from the foot: h (asinh(t_2 / h) - asinh(t_1 / h)). It
        # is exact along the radius; across, flat triangles leave the error of a Gauss rule.
        r = np.linalg.norm(np.einsum("qb,qbd->qd", place, x[number]) - tips[0], axis=1)
        along = x[30:, 2] - x[30:, 1]
        length = np.linalg.norm(along, axis=1)
        t = [((x[30:, k] - tips[0]) * along).sum(axis=1) / length for k in (1, 2)]
        h = np.sqrt(((x[30:, 1] - tips[0]) ** 2).sum(axis=1) - t[0] ** 2)
        exact = h * (np.arcsinh(t[1] / h) - np.arcsinh(t[0] / h))
        integral = np.bincount(number, weight / r)[30:] * h * length
        assert integral == pytest.approx(exact, rel=2e-4)


def test_fans_begin_and_end_at_circles():
    """What is left of a triangle between two circles around its first corner, in polar form."""
    from xcrack.mesh.kernels.splitting import triangle_points
    from xcrack.mesh.simplex import gauss, simplex_rule

    rng = np.random.default_rng(5219)
    x, radii = rng.uniform(size=(40, 3, 2)), np.array([0.2, 0.35, 0.6])
    x[:, 0] = x[0, 0]
    side, other = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    cross = np.abs(side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0])
    rules = *simplex_rule(2, 2), *simplex_rule(2, 2), *gauss(5), *gauss(8)
    bary, flags = np.broadcast_to(np.eye(3), (40, 3, 3)).copy(), np.ones(40, dtype=bool)
    triangles = bary, x, cross / 2, flags, flags, x[0, :1], 4, *rules
    number, place, weight = triangle_points(*triangles, x[0, 0], radii)
    r = np.linalg.norm(np.einsum("qb,qbd->qd", place, x[number]) - x[0, 0], axis=1)
    assert (r > radii[0]).all()
    assert (r < radii[-1]).all()
    tau, share = gauss(4000)
    far = side[:, None] + tau[:, None] * (other - side)[:, None]
    reach = np.clip(np.linalg.norm(far, axis=2), radii[0], radii[-1])
    turn = share * cross[:, None] / np.einsum("kqd,kqd->kq", far, far)
    for p in (0, 1):  # area, and the integral of r
        exact = ((reach ** (2 + p) - radii[0] ** (2 + p)) / (2 + p) * turn).sum(axis=1)
        assert np.bincount(number, weight * r**p, 40) == pytest.approx(exact, abs=2e-5)
    # Around another place the fans are whole.
    number, _, weight = triangle_points(*triangles, x[0, 0] + 0.1, radii)
    assert np.bincount(number, weight) == pytest.approx(cross / 2, abs=1e-14)
