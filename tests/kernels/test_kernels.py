"""Kernels against twins without tricks, and kernels that stand for many calls of numpy."""

import importlib
from collections import defaultdict
from pathlib import Path

import numba
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import Delaunay

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel
from xcrack.fem.assembly import bulk
from xcrack.fem.kernels.functions import (
    places,
    set_gradients,
    set_jumps,
    set_standard,
    solve_moments,
)
from xcrack.fem.kernels.stiffness import (
    add_block_stiffness,
    add_stiffness,
    block_pattern,
    enriched_pattern,
    joined_blocks,
)
from xcrack.fem.williams import continued_polar, mode_matrix, unit_gradients
from xcrack.linalg.kernels.sparse import (
    bordered_matrix,
    dense_blocks,
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
from xcrack.mesh.locate import cells_around, locate
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import cell_nodes, n_shapes, shape_derivatives, simplex_rule
from xcrack.model.elasticity import elasticity
from xcrack.model.material import isotropic_part
from xcrack.sif.common import weight
from xcrack.sif.kernels.ring import add_plain_cells, add_points, cells_between


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


def test_no_points_where_an_integrand_vanishes():
    """What is left out lies within the first circle or beyond the last; the others are the same."""
    from xcrack.mesh.kernels.splitting import triangle_points
    from xcrack.mesh.simplex import gauss, simplex_rule

    rng = np.random.default_rng(5221)
    x, radii = rng.uniform(size=(60, 3, 2)), np.array([0.3, 0.4])
    flags = np.ones(60, dtype=bool)
    triangles = np.broadcast_to(np.eye(3), (60, 3, 3)).copy(), x, np.ones(60), flags, ~flags
    rules = *simplex_rule(2, 2), *simplex_rule(2, 4), *gauss(5), *gauss(8)
    tips = np.array([[0.5, 0.5]])
    points = triangle_points(*triangles, tips, 4, *rules, tips[0], np.zeros(0))
    fewer_points = triangle_points(*triangles, tips, 4, *rules, tips[0], radii)
    rows, chosen_rows = (
        [tuple(row) for row in np.column_stack(columns).tolist()]
        for columns in (points, fewer_points)
    )
    assert set(chosen_rows) < set(rows)
    omitted = np.array(sorted(set(rows) - set(chosen_rows)))
    at = np.einsum("qb,qbd->qd", omitted[:, 1:4], x[omitted[:, 0].astype(int)])
    r = np.linalg.norm(at - tips[0], axis=1)
    assert ((r <= radii[0]) | (r >= radii[-1])).all()
    assert (r <= radii[0]).any()
    assert (r >= radii[-1]).any()


# --- kernels of fields and of the plane's interaction integral against their naive twins ----------


STEEL = xc.Isotropic(E=3.0, nu=0.27, plane="strain")


def _twin(gradient, x, side, behind, area, tip, turn, radii, frame):
    """P_kj t_k q_,j written out, by numpy."""
    xi = (x - tip) @ frame.T
    r, theta = continued_polar(xi, side, behind)
    _, dq = weight(r, xi, 0.15 * radii, radii)
    local = np.einsum("ai,qijs,bj->sqab", frame, gradient - turn, frame)
    wanted = np.zeros((local.shape[0], len(radii), 3))
    for m, g in enumerate(unit_gradients(r, theta, STEEL.kolosov, STEEL.mu)):
        for s, u in enumerate(local):
            sigma, own = STEEL.stress(u), STEEL.stress(g)
            P = np.einsum("qij,qi->qj", sigma, g[:, :, 0])
            P += np.einsum("qij,qi->qj", own, u[:, :, 0])
            P[:, 0] -= np.einsum("qij,qij->q", sigma, g)
            wanted[s, :, m] = np.einsum("q,qj,kqj->k", area, P, dq)
    return wanted


def _scene(rng, states, hand, order):
    """Cells around a tip, some of them behind it on either side, and what kernels ask for."""
    mesh = xc.box((-1, -1), (1, 1), 9)
    angle = rng.uniform(-3, 3)
    frame = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    frame[1] *= hand
    tip, radii = np.array([0.11, -0.07]), np.array([0.8, 0.55])
    psi = (mesh.points - tip) @ frame[0] - 0.1
    side = rng.choice([-1, 0, 1], len(mesh.cells))
    nodes = cell_nodes(mesh, order)
    coefficients = rng.standard_normal((nodes.max() + 1, 2, states))
    turn = rng.standard_normal((2, 2, states))
    last = (
        tip, turn, radii, 0.15 * radii, frame, mode_matrix(STEEL.kolosov, STEEL.mu),
        STEEL.kolosov, STEEL.lam, STEEL.mu,
    )  # fmt: skip
    return mesh, psi, side, nodes, coefficients, last


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("states", [1, 3])
@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_ring(states, hand, order):
    """Given gradients and those of plain cells, for a right-handed and a left-handed frame."""
    rng = np.random.default_rng(3105)
    mesh, psi, side, nodes, coefficients, last = _scene(rng, states, hand, order)
    tip, turn, radii, _, frame = last[:5]
    bary, share = simplex_rule(2, 6)
    near = cells_between(mesh.points, mesh.cells, mesh.cell_size, tip, 0.15 * 0.55, 0.8)
    cell = np.repeat(near, len(share))
    where = np.tile(bary, (len(near), 1))
    x = np.einsum("qb,qbd->qd", where, mesh.points[mesh.cells[cell]])
    slope = np.einsum("qnb,qbd->qnd", shape_derivatives(order, where), mesh.gradient[cell])
    gradient = np.einsum("qnj,qnis->qijs", slope, coefficients[nodes[cell]])
    area = np.tile(share, len(near)) * mesh.volume[cell]
    behind = psi[mesh.cells[cell]].mean(axis=1) < 0
    wanted = _twin(gradient, x, side[cell], behind, area, tip, turn, radii, frame)
    near_zero = 1e-12 * np.abs(wanted).max()
    of_points, of_cells = np.zeros_like(wanted), np.zeros_like(wanted)
    add_points(
        of_points, gradient, cell, where, side[cell], area, mesh.points, mesh.cells, psi, *last,
        None,
    )  # fmt: skip
    assert of_points == pytest.approx(wanted, rel=1e-11, abs=near_zero)
    edges = local_edges(2)[: None if order == 2 else 0]
    add_plain_cells(
        of_cells, near, mesh.points, mesh.cells, mesh.gradient, mesh.volume, nodes, edges,
        coefficients, side, psi, bary, share, *last, None,
    )  # fmt: skip
    assert of_cells == pytest.approx(wanted, rel=1e-11, abs=near_zero)


@pytest.mark.parametrize("theta", [0.0, np.pi / 2, np.pi, -np.pi, -np.pi / 2, 3.1415926535])
@pytest.mark.parametrize("side", [-1, 1])
def test_ring_on_axes(theta, side):
    """Half the angle without trigonometry is right on the axes, and on both lips behind."""
    rng = np.random.default_rng(3108)
    mesh = xc.box((-1, -1), (1, 1), 1)
    x = 0.5 * np.array([[np.cos(theta), np.sin(theta) if abs(theta) < np.pi else 0.0 * theta]])
    cell, where = locate(mesh, x)
    gradient, turn = rng.standard_normal((1, 2, 2, 1)), np.zeros((2, 2, 1))
    tip, radii, frame = np.zeros(2), np.array([0.9]), np.eye(2)
    psi = np.full(mesh.n_points, -1.0)
    result = np.zeros((1, 1, 3))
    add_points(
        result, gradient, cell, where, np.array([side]), np.ones(1), mesh.points, mesh.cells, psi,
        tip, turn, radii, 0.15 * radii, frame, mode_matrix(STEEL.kolosov, STEEL.mu),
        STEEL.kolosov, STEEL.lam, STEEL.mu, None,
    )  # fmt: skip
    x = np.einsum("qb,qbd->qd", where, mesh.points[mesh.cells[cell]])
    wanted = _twin(
        gradient, x, np.array([side]), np.ones(1, bool), np.ones(1), tip, turn, radii, frame
    )
    assert result == pytest.approx(wanted, rel=1e-7, abs=1e-7 * np.abs(wanted).max())


def test_cells_between():
    """All cells that meet the ring, and none that is wholly inside or far outside."""
    mesh = xc.box((-1, -1), (1, 1), 12)
    centre = np.array([0.2, -0.3])
    chosen = cells_between(mesh.points, mesh.cells, mesh.cell_size, centre, 0.3, 0.6)
    apart = np.linalg.norm(mesh.points[mesh.cells] - centre, axis=2)
    meets = (apart.max(axis=1) > 0.3) & (apart.min(axis=1) < 0.6)
    assert np.isin(np.nonzero(meets)[0], chosen).all()
    assert (np.diff(chosen) > 0).all()
    assert (apart[chosen].max(axis=1) > 0.3).all()
    assert (apart[chosen].min(axis=1) < 0.6 + 1.5 * mesh.cell_size[chosen]).all()


@pytest.mark.parametrize("d", [2, 3])
def test_gradients(d):
    """Functions that do not act on a cell (-1) count nothing; other points stay as they are."""
    rng = np.random.default_rng(3106)
    slope, row = rng.standard_normal((7, 5, d)), rng.integers(0, 3, 7)
    functions = rng.integers(-1, 9, (3, 5))
    coefficients = rng.standard_normal((9, d, 2))
    number = np.array([8, 1, 0, 5, 3, 9, 2])
    result = np.full((10, d, d, 2), 7.0)
    set_gradients(result, number, slope, functions, row, coefficients)
    values = np.where((functions >= 0)[..., None, None], coefficients[functions], 0.0)
    wanted = np.full((10, d, d, 2), 7.0)
    wanted[number] = np.einsum("qnj,qnis->qijs", slope, values[row])
    assert result == pytest.approx(wanted, rel=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_places(d):
    """Coordinates are the corners weighted."""
    rng = np.random.default_rng(3111)
    points, cells = rng.standard_normal((9, d)), rng.integers(0, 9, (4, d + 1))
    cell, bary = rng.integers(0, 4, 11), rng.dirichlet(np.ones(d + 1), 11)
    wanted = np.einsum("qb,qbd->qd", bary, points[cells[cell]])
    assert places(cell, bary, points, cells) == pytest.approx(wanted, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_tables(order, d):
    """Standard functions and jumps written out; values alone and gradients alone are the same."""
    rng = np.random.default_rng(3107)
    n, m, nodes_n = 9, 4, n_shapes(order, d)
    bary = rng.dirichlet(np.ones(d + 1), n)
    row, gradient = rng.integers(0, m, n), rng.standard_normal((m, d + 1, d))
    edges = local_edges(d)[: None if order == 2 else 0]
    value, slope = np.full((n, 2 * nodes_n), np.nan), np.full((n, 2 * nodes_n, d), np.nan)
    nodes = rng.integers(0, 30, (m, nodes_n))
    side, node_side = rng.choice([-1, 0, 1], n), rng.choice([-1, 1], 30)
    number = rng.integers(-1, 3, 30)
    set_standard(value, slope, row, bary, gradient, edges)
    set_jumps(value, slope, nodes_n, row, side, nodes, node_side, number)
    i, j = local_edges(d).T
    N = bary
    if order == 2:
        N = np.hstack([bary * (2 * bary - 1), 4 * bary[:, i] * bary[:, j]])
    dN = np.einsum("qnb,qbd->qnd", shape_derivatives(order, bary), gradient[row])
    jump = np.where(number[nodes[row]] >= 0, side[:, None] - node_side[nodes[row]], 0)
    assert value == pytest.approx(np.hstack([N, N * jump]), abs=1e-14)
    assert slope == pytest.approx(np.hstack([dN, dN * jump[..., None]]), abs=1e-13)
    alone = np.empty_like(value)
    set_standard(alone, np.empty((0, 0, d)), row, bary, gradient, edges)
    set_jumps(alone, np.empty((0, 0, d)), nodes_n, row, side, nodes, node_side, number)
    assert (alone == value).all()
    alone, no_values = np.empty_like(slope), np.empty((0, 2 * nodes_n))
    set_standard(no_values, alone, row, bary, gradient, edges)
    set_jumps(no_values, alone, nodes_n, row, side, nodes, node_side, number)
    assert (alone == slope).all()


# --- kernels that take the place of many small calls, against numpy and scipy ---------------------


def spd(rng, n):
    root = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.4) + 2 * np.eye(n)
    return root @ root.T


def arrays(A):
    return A.indptr, A.indices, A.data


def test_bordered_with_groups():
    """Columns that share their rows, those that share some, and rows of standard unknowns."""
    rng = np.random.default_rng(4413)
    A, Z, fixed = spd(rng, 40), np.zeros((40, 11)), np.zeros(40, dtype=bool)
    fixed[[3, 17, 29]] = True
    for columns, rows in (
        ([0, 1, 2], [4, 5, 28, 30, 31]), ([3, 4], [30, 31, 33]), ([5], [6]), ([6], [6, 34]),
        ([7, 8, 9], [0, 1, 35, 36, 37]), ([10], [38]),
    ):  # fmt: skip
        Z[np.ix_(rows, columns)] = rng.normal(size=(len(rows), len(columns)))
    matrix, basis, energy = bordered_matrix(
        *arrays(sp.csr_matrix(A)), *arrays(sp.csr_matrix(Z)), 11, fixed, 28
    )
    columns = np.concatenate([np.eye(40)[:, :28][:, ~fixed[:28]], Z], axis=1)
    expected = columns / np.sqrt(np.diag(columns.T @ A @ columns))
    size = expected.shape[1]
    result = sp.csr_matrix((basis[2], basis[1], basis[0]), shape=(40, size)).toarray()
    np.testing.assert_allclose(result, expected, rtol=1e-13)
    np.testing.assert_allclose(energy, np.diag(Z.T @ A @ Z), rtol=1e-13)
    reduced = sp.csc_matrix((matrix[2], matrix[1], matrix[0]), shape=(size, size))
    assert reduced.has_sorted_indices
    np.testing.assert_allclose(reduced.toarray(), expected.T @ A @ expected, atol=1e-13)


def test_bordered():
    """Both sides scaled; fixed unknowns and those without energy are left out."""
    rng = np.random.default_rng(4411)
    A = spd(rng, 9)
    A[2], A[:, 2] = 0, 0  # a standard unknown without energy
    Z = np.zeros((9, 2))
    Z[6:, 0], Z[[1, 7], 1] = rng.normal(size=3), rng.normal(size=2)
    fixed = np.zeros(9, dtype=bool)
    fixed[4] = True
    matrix, basis, energy = bordered_matrix(
        *arrays(sp.csr_matrix(A)), *arrays(sp.csr_matrix(Z)), 2, fixed, 6
    )
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


# --- what a first run compiles: new arrays in place, each kernel for one kind of arguments ---


@kernel
def new_arrays(n, m, like):  # type: ignore[no-untyped-def]
    full = empty(n, np.int32)
    for i in range(n):
        full[i] = i
    short = empty((n, m))
    for i in range(n):
        for j in range(m):
            short[i, j] = i + 10 * j
    return full, short, zeros((n, 2, m)), zeros(m, np.bool_), zeros((m, m), like.dtype)


@pytest.mark.parametrize(("n", "m"), [(5, 3), (1, 70), (0, 4), (4, 0)])
def test_new_arrays_are_those_of_numpy(n: int, m: int) -> None:
    """Type, shape, strides and values; twice, for memory that was in use before."""
    expected = (
        np.arange(n, dtype=np.int32), np.add.outer(np.arange(n), 10.0 * np.arange(m)),
        np.zeros((n, 2, m)), np.zeros(m, bool), np.zeros((m, m), np.uint8),
    )  # fmt: skip
    for _ in range(2):
        for array, wanted in zip(new_arrays(n, m, np.ones(1, np.uint8)), expected, strict=True):
            assert (array.dtype, array.shape) == (wanted.dtype, wanted.shape)
            assert array.flags.c_contiguous
            assert array.flags.writeable
            np.testing.assert_array_equal(array, wanted)
            array[...] = 1  # not zero where it is handed out again


@pytest.mark.parametrize(("n", "m"), [(-1, 2), (2, -3), (-1, 0), (2**40, 2**20), (2**40, 2**30)])
def test_arrays_without_memory(n: int, m: int) -> None:
    """An error as numpy has one, not a crash."""
    with pytest.raises((MemoryError, ValueError)):
        new_arrays(n, m, np.ones(1, np.uint8))


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_kernels_are_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """No kernel meets arguments of two kinds: it would be compiled twice in a first run."""
    kinds = defaultdict(set)

    def record(name, dispatcher):  # type: ignore[no-untyped-def]
        def call(*args):  # type: ignore[no-untyped-def]
            kinds[name].add(tuple(str(numba.typeof(a)) for a in args))
            return dispatcher(*args)

        return call

    for path in Path(xc.__file__).parent.glob("*/kernels/*.py"):
        module = importlib.import_module(f"xcrack.{path.parts[-3]}.kernels.{path.stem}")
        for name, value in list(vars(module).items()):
            if isinstance(value, numba.core.dispatcher.Dispatcher) and name[0] != "_":
                monkeypatch.setattr(module, name, record(f"{path.stem}.{name}", value))
    scene = xc.Problem(
        xc.box((-1, -1), (1, 1), 10), xc.Isotropic(1.0, 0.3, "strain"),
        [xc.line_crack([(-1.2, 0.03), (0.1, 0.07)])],
        loads=[xc.pressure("top", 1.0), xc.pressure("bottom", 1.0)],
    )  # fmt: skip
    sif = xc.stress_intensity(xc.solve(scene))
    assert np.isfinite(sif.K).all()
    assert len(kinds) > 30
    assert [name for name, sets in kinds.items() if len(sets) > 1] == []
