"""Entries of the stiffness, bit by bit: plain elements without cracks, and beside them."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla

import xcrack as xc
from support import scenes_2d, scenes_3d

PLANE, SOLID = xc.Isotropic(1.3, 0.27, plane="strain"), xc.Isotropic(1.3, 0.27)
EDGE = xc.line_crack([(-1.1, 0.031), (0.07, 0.012)])
INNER = xc.line_crack([(-0.41, -0.47), (0.33, -0.52)])
PENNY = xc.penny_crack((0.013, -0.021, 0.0317), (0.1, -0.2, 1.0), 0.55, n=24)


def build(problem):
    """The system of a problem that is solved, bound at the bottom."""
    supports = problem.supports or [xc.fix("bottom")]
    loads = problem.loads or [xc.body_force((0.0,) * (problem.mesh.dim - 1) + (1.0,))]
    problem = replace(problem, supports=supports, loads=loads, contact="off")
    return xc.solve(problem, error=True).factored.model


def plate(*cracks, mesh=None, **options):
    return xc.Problem(mesh or scenes_2d.perturbed(14, 5), PLANE, list(cracks), **options)


def block(*cracks, mesh=None, **options):
    mesh = mesh or scenes_3d.perturbed(5, 71)
    return xc.Problem(mesh, SOLID, list(cracks), order=1, **options)


def naive_stiffness(mesh, order, lam, mu):
    """Plain finite elements by loops: the same sums in the same order as the kernel's."""
    pairs = np.array([(0, 1), (1, 2), (2, 0)])
    edges = {tuple(sorted(e)): mesh.n_points + k for k, e in enumerate(mesh.edges.tolist())}
    nodes, bary, weight = mesh.cells, np.full((1, 3), 1 / 3), np.ones(1)
    derivative = np.eye(3)[None]
    if order == 2:
        ends = np.sort(nodes[:, pairs], axis=2).reshape(-1, 2).tolist()
        middle = np.array([edges[tuple(e)] for e in ends]).reshape(-1, 3)
        nodes = np.concatenate([nodes, middle], axis=1)
        bary, weight = np.full((3, 3), 1 / 6) + np.eye(3) * (1 - 3 * (1 / 6)), np.full(3, 1 / 3)
        derivative = np.zeros((3, 6, 3))
        for q, L in enumerate(bary):
            derivative[q, :3] = np.diag(4 * L - 1)
            for k, (a, b) in enumerate(pairs, 3):
                derivative[q, k, a], derivative[q, k, b] = 4 * L[b], 4 * L[a]
    n = int(nodes.max()) + 1
    K = {}
    for e, cell in enumerate(nodes):
        for q, share in enumerate(weight):
            w = share * mesh.volume[e]
            G = np.zeros((len(cell), 2))
            for a in range(len(cell)):
                for i in range(2):
                    total = 0.0
                    for k in range(3):
                        total += derivative[q, a, k] * mesh.gradient[e, k, i]
                    G[a, i] = total
            for a, row in enumerate(cell):
                for b, column in enumerate(cell):
                    block = K.setdefault((int(row), int(column)), np.zeros((2, 2)))
                    (ax, ay), (bx, by) = w * G[a], G[b]
                    block[0, 0] += (lam + 2 * mu) * (ax * bx) + mu * (ay * by)
                    block[0, 1] += lam * (ax * by) + mu * (ay * bx)
                    block[1, 0] += lam * (ay * bx) + mu * (ax * by)
                    block[1, 1] += (lam + 2 * mu) * (ay * by) + mu * (ax * bx)
    dense = np.zeros((2 * n, 2 * n))
    for (row, column), block in K.items():
        dense[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] = block
    return dense


@pytest.mark.parametrize("order", [1, 2])
def test_an_uncracked_problem_is_plain_fem_to_the_last_bit(order):
    mesh = scenes_2d.perturbed(3, 5)
    scene = plate(
        mesh=mesh, order=order, supports=[xc.fix("bottom")], loads=[xc.traction("top", (0.0, 1.0))]
    )
    model = build(scene)
    assert (model.stiffness.toarray() == naive_stiffness(mesh, order, PLANE.lam, PLANE.mu)).all()
    assert model.n_points == 0
    assert len(model.space.enriched_cells) == 0
    # The same linear system, solved by the same factorisation without anything of ours.
    solution = xc.solve(scene)
    free = ~model.imposed_values.is_fixed
    K = sp.csr_matrix(naive_stiffness(mesh, order, PLANE.lam, PLANE.mu))
    f = np.zeros(K.shape[0])
    for ends in mesh.facet_sets["top"]:
        length = np.linalg.norm(mesh.points[ends[1]] - mesh.points[ends[0]])
        number = mesh.n_points + np.nonzero((mesh.edges == np.sort(ends)).all(axis=1))[0][0]
        shares = {1: [(e, 1 / 2) for e in ends], 2: [(e, 1 / 6) for e in ends] + [(number, 2 / 3)]}
        for node, share in shares[order]:
            f[2 * node + 1] += length * share
    plain = np.zeros(len(f))
    plain[free] = sla.spsolve(sp.csc_matrix(K[free][:, free]), f[free])
    # Round-off: the load is summed at other points here, and the pivots come in another order.
    assert solution.u == pytest.approx(plain, abs=1e-12 * np.abs(plain).max())


@pytest.mark.parametrize("order", [1, 2])
def test_standard_entries_do_not_know_the_crack(order):
    """Entries of two standard functions are those of the uncracked body, to the last bit."""
    plain = build(plate(order=order)).stiffness
    cracked = build(plate(EDGE, INNER, order=order)).stiffness
    n = plain.shape[0]
    difference = (cracked[:n, :n] - plain).tocoo()
    assert not difference.data.any()


def naive_stiffness_3d(mesh, lam, mu):
    """Plain finite elements by loops: the same sums in the same order as the kernel's."""
    K = np.zeros((3 * mesh.n_points, 3 * mesh.n_points))
    for e, cell in enumerate(mesh.cells):
        G = mesh.gradient[e]
        w = 1.0 * mesh.volume[e]
        for a, row in enumerate(cell):
            for b, column in enumerate(cell):
                dot = 0.0
                for i in range(3):
                    dot += G[a, i] * G[b, i]
                dot *= w * mu
                for i in range(3):
                    for j in range(3):
                        K[3 * row + i, 3 * column + j] += w * (
                            lam * G[a, i] * G[b, j] + mu * G[a, j] * G[b, i]
                        )
                    K[3 * row + i, 3 * column + i] += dot
    return K


def test_an_uncracked_body_is_plain_fem_to_the_last_bit():
    mesh = scenes_3d.perturbed(2, 71)
    model = build(block(mesh=mesh, supports=[xc.fix("bottom")]))
    plain = naive_stiffness_3d(mesh, SOLID.lam, SOLID.mu)
    assert (model.stiffness.toarray() == plain).all()
    assert model.n_points == 0
    assert len(model.space.enriched_cells) == 0


def test_standard_entries_do_not_know_a_crack_in_space():
    """Entries of two standard functions are those of the uncracked body, to the last bit."""
    plain = build(block()).stiffness
    n = plain.shape[0]
    difference = (build(block(PENNY)).stiffness[:n, :n] - plain).tocoo()
    assert not difference.data.any()
