"""Kernels of fields and of the plane's interaction integral against their naive twins."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.kernels.fields import set_gradients
from xcrack.kernels.ring import add_ring
from xcrack.kernels.shapes import set_jumps, set_standard
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import n_shapes, shape_derivatives
from xcrack.sif.common import weight
from xcrack.xfem.williams import mode_matrix, unit_gradients

STEEL = xc.Isotropic(E=3.0, nu=0.27, plane="strain")


@pytest.mark.parametrize("states", [1, 3])
@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_ring(states, hand):
    """P_kj t_k q_,j written out, for a right-handed and a left-handed frame."""
    rng = np.random.default_rng(3105)
    n = 200
    angle = rng.uniform(-3, 3)
    frame = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    frame[1] *= hand
    theta, r = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.01, 1.2, n)
    xi = r[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    gradient = rng.standard_normal((n, 2, 2, states))
    area, radii = rng.uniform(size=n), np.array([1.0, 0.7])
    result = np.zeros((states, 2, 3))
    add_ring(
        result, gradient, xi, theta, area, radii, 0.15 * radii, frame,
        mode_matrix(STEEL.kolosov, STEEL.mu), STEEL.kolosov, STEEL.lam, STEEL.mu,
    )  # fmt: skip
    _, dq = weight(r, xi, 0.15 * radii, radii)
    wanted = np.zeros_like(result)
    local = np.einsum("ai,qijs,bj->sqab", frame, gradient, frame)
    for m, g in enumerate(unit_gradients(r, theta, STEEL.kolosov, STEEL.mu)):
        for s in range(states):
            sigma, own = STEEL.stress(local[s]), STEEL.stress(g)
            P = np.einsum("qij,qi->qj", sigma, g[:, :, 0])
            P += np.einsum("qij,qi->qj", own, local[s][:, :, 0])
            P[:, 0] -= np.einsum("qij,qij->q", sigma, g)
            wanted[s, :, m] = np.einsum("q,qj,kqj->k", area, P, dq)
    assert result == pytest.approx(wanted, rel=1e-11, abs=1e-12 * np.abs(wanted).max())


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


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_tables(order, d):
    """Standard functions and jumps written out; values alone are the same."""
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
