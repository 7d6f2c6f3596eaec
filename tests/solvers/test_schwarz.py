"""Smoothing by stars of order 2: blocks, their inverses, the bound of the spectrum."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

import xcrack as xc
from xcrack.fem.system import build
from xcrack.linalg.basis import patch_orthogonal, stars
from xcrack.linalg.iterative import iterative_system
from xcrack.linalg.kernels.sparse import add_solved
from xcrack.linalg.multigrid import _stable_inverses, largest_eigenvalue


def test_blocks_are_solved_and_summed():
    rng = np.random.default_rng(7103)
    sizes = [3, 1, 5]
    members = [np.sort(rng.choice(8, size, replace=False)) for size in sizes]
    inverses = [A + A.T for A in (rng.normal(size=(s, s)) for s in sizes)]
    r, out = rng.normal(size=(2, 8))
    wanted = out.copy()
    for rows, inverse in zip(members, inverses):
        wanted[rows] += inverse @ r[rows]
    add_solved(
        np.concatenate(members).astype(np.uint32), np.cumsum([0, *sizes]).astype(np.uint32),
        np.cumsum([0, *np.square(sizes)[:-1]]).astype(np.uint64),
        np.concatenate([inverse.ravel() for inverse in inverses]), r, out,
    )  # fmt: skip
    np.testing.assert_allclose(out, wanted, atol=1e-14)  # round-off


def test_inverses_of_units_far_apart():
    rng = np.random.default_rng(7109)
    A = rng.normal(size=(4, 6, 9))
    size = 10.0 ** rng.uniform(-6, 6, 6)
    A = size[:, None] * (A @ A.transpose(0, 2, 1)) * size
    unit = np.einsum("bij,bjk->bik", _stable_inverses(A), A) * size[:, None] / size
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(6), unit.shape), atol=1e-9)


@pytest.mark.parametrize("energy", [1e-12, -1e-9], ids=["none to speak of", "below zero"])
def test_a_block_that_is_nearly_singular_stays_positive(energy):
    v = np.array([1.0, -1.0, 0.0])
    A = np.eye(3)[None] - (1 - energy) / 2 * np.outer(v, v)
    inverse = _stable_inverses(A)[0]
    w = np.linalg.eigvalsh(inverse)
    assert w.min() > 0.5
    assert w.max() <= 2e6


@pytest.fixture(scope="module")
def penny():
    problem = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 4), xc.Isotropic(1.0, 0.3),
        [xc.penny_crack((0.013, -0.021, 0.0317), (0.3, -0.5, 1.0), 0.5)],
        [xc.fix("bottom")], [xc.traction("top", (0.3, 0.2, 1.0))], contact="off", order=2,
    )  # fmt: skip
    model = build(problem)
    return model, iterative_system(
        model.space, model.stiffness, model.bulk, model.imposed_values.is_fixed
    )


def test_stars_hold_what_ends_around_a_point(penny):
    space = penny[0].space
    pattern = stars(space.mesh, 2)
    start, cells = space.mesh.point_to_cell
    for point in (0, 31, 62):
        around = space.cell_nodes[cells[start[point] : start[point + 1]]]
        outside = np.ones(len(space.mesh.cells), dtype=bool)
        outside[cells[start[point] : start[point + 1]]] = False
        inside = np.setdiff1d(around, space.cell_nodes[outside])
        own = pattern.indices[pattern.indptr[point] : pattern.indptr[point + 1]]
        # a midpoint on the boundary of the body may lie in these cells alone, without the point
        assert set(own) <= set(around.ravel())
        assert set(own) >= {n for n in inside if n >= space.mesh.n_points} & set(own) | {point}


def test_tip_functions_apart_from_their_star_couple_with_no_more(penny):
    model, _ = penny
    K, free = model.stiffness, ~model.imposed_values.is_fixed
    T = patch_orthogonal(model.space, K, free, "star")
    n = model.space.n_dof
    back = 2 * sp.identity(n) - T
    assert abs(T @ back - sp.identity(n)).max() <= 1e-14
    before, after = K.copy(), sp.csr_matrix(T.T @ K @ T)
    before.data[:] = 1
    after.data = (np.abs(after.data) > 1e-12).astype(float)
    after.eliminate_zeros()
    assert after.nnz <= 1.02 * before.nnz


@pytest.mark.slow
@pytest.mark.mission
def test_the_bound_of_the_spectrum(penny):
    _, engine = penny
    top = engine.operator.cycle.levels[0]
    n = len(engine.operator.diagonal)
    A = (engine.basis.T @ engine.matrix @ engine.basis).toarray()
    supported = ~np.concatenate(
        [engine.hierarchy.is_free, np.ones(n - len(engine.hierarchy.is_free), bool)]
    )
    A[supported, supported] = engine.operator.diagonal[supported]
    B = np.stack([top.patches.times(column) for column in np.eye(n, dtype=np.float32)], axis=1)
    assert np.abs(B - B.T).max() <= 1e-5 * np.abs(B).max()  # single precision
    L = np.linalg.cholesky(A)
    w = scipy.linalg.eigvalsh(L.T @ B @ L)
    assert w[0] > 0
    result = largest_eigenvalue(top.matrix, engine.operator.diagonal, top.patches.times)
    assert w[-1] <= result <= 1.12 * w[-1]


def test_coordinates_come_back(penny):
    _, engine = penny
    y = np.random.default_rng(7121).normal(size=len(engine.operator.diagonal))
    y[: len(engine.hierarchy.is_free)] *= engine.hierarchy.is_free
    back = engine.coordinates(engine.basis @ y)
    assert np.abs(back - y).max() <= 1e-7  # round-off, times the root of the least kept energy
