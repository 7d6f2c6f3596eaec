"""Kernels of fields and of the plane's interaction integral against their naive twins."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.fem.kernels.functions import places, set_gradients, set_jumps, set_standard
from xcrack.fem.williams import continued_polar, mode_matrix, unit_gradients
from xcrack.mesh.locate import locate
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import cell_nodes, n_shapes, shape_derivatives, simplex_rule
from xcrack.sif.common import weight
from xcrack.sif.kernels.ring import add_plain_cells, add_points, cells_between

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
