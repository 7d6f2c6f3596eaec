"""Multigrid: the cycle, its products, bodies without supports, smoothing by stars of order 2."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as sla

import xcrack as xc
import xcrack.linalg.multigrid as multigrid
from support.rows import slow
from xcrack.fem.assembly import bulk, rigid_modes
from xcrack.fem.system import build
from xcrack.linalg.basis import patch_orthogonal, stars
from xcrack.linalg.iterative import iterative_system
from xcrack.linalg.kernels.cycle import first_step, next_step
from xcrack.linalg.kernels.sparse import add_solved
from xcrack.linalg.multigrid import _stable_inverses, extended_cycle, hierarchy, largest_eigenvalue
from xcrack.linalg.products import BorderedFactor, row_blocks, store_blocks
from xcrack.linalg.projected_cg import Operator, conjugate_gradients_steps, in_lockstep
from xcrack.mesh.simplex import node_points
from xcrack.model.elasticity import elasticity


def conjugate_gradients(K, b, start, *limits):
    return in_lockstep(K, [conjugate_gradients_steps(K, b, start, *limits)])[0]


def drawn(shape, share, seed):
    rng = np.random.default_rng(seed)
    return sp.csr_matrix(rng.normal(size=shape) * (rng.random(shape) < share))


@pytest.mark.parametrize("sizes", [[3, 3, 3], [1, 2, 3, 4, 5, 6, 7], [2, 6, 0, 8], [11]])
def test_blocks_of_rows_multiply_like_csr(sizes):
    A = drawn((sum(sizes), 9), 0.4, 4409 + len(sizes))
    blocks = row_blocks([A], np.cumsum([0, *sizes]))
    x, y = np.random.default_rng(63).normal(size=(2, 50))
    x, y = x[:9], y[: A.shape[0]]
    np.testing.assert_allclose(blocks.times(x), A @ x, atol=1e-14)  # round-off
    np.testing.assert_allclose(blocks.add_product(y.copy(), -0.7, x), y - 0.7 * (A @ x), atol=1e-14)
    single = blocks.in_single_precision().times(x.astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, A @ x, atol=1e-5)  # round-off in single precision


def test_a_matrix_in_parts():
    """Standard and enriched unknowns: blocks side by side, and a border, as if joined before."""
    standard, across = drawn((8, 8), 0.4, 4447), drawn((8, 4), 0.4, 4451)
    below = [drawn((4, 8), 0.5, 4457), drawn((4, 4), 0.5, 4463)]
    first = np.array([0, 3, 4, 8])
    lower = row_blocks(below, np.array([0, 4]))
    joined = row_blocks([sp.csr_matrix(sp.hstack(below))], np.array([0, 4]))
    for name in ("shape", "first_row", "start", "offset", "columns", "values"):
        assert np.array_equal(getattr(lower, name), getattr(joined, name)), name
    A = BorderedFactor(row_blocks([standard], first), row_blocks([across], first), lower)
    whole = sp.vstack([sp.hstack([standard, across]), sp.hstack(below)])
    x = np.random.default_rng(4481).normal(size=12)
    assert A.shape == (12, 12)
    np.testing.assert_allclose(A.times(x), whole @ x, atol=1e-14)  # round-off


@pytest.mark.parametrize("size", [(2, 2), (3, 3), (3, 6), (6, 3), (6, 6)])
def test_blocks_are_stored_without_a_matrix_in_between(size):
    """The same as by way of CSR, for blocks in any order and of any memory layout."""
    rng = np.random.default_rng(7709)
    rows, columns = size
    A = sp.random(12 * rows, 9 * columns, 0.05, random_state=rng).tocsr()
    A = sp.bsr_matrix(A, blocksize=size)
    B = sp.bsr_matrix(sp.random(9 * columns, 12, 0.2, random_state=rng), blocksize=(columns, 3))
    for M in (A, sp.bsr_matrix(A.T, blocksize=size[::-1]), A @ B):
        first = np.arange(0, M.shape[0] + 1, M.blocksize[0])
        for dtype in (np.float32, np.float64):
            ours, wanted = store_blocks(M, dtype), row_blocks([M.tocsr()], first, dtype)
            assert ours.shape == wanted.shape
            for name in ("first_row", "start", "offset", "columns", "values"):
                result, other = getattr(ours, name), getattr(wanted, name)
                assert result.dtype == other.dtype
                np.testing.assert_array_equal(result, other)


def test_unknowns_that_are_not_free_take_no_part(monkeypatch):
    """The body's matrix serves as it is, with any supports: nothing of it is copied."""
    monkeypatch.setattr(multigrid, "_COARSEST", 6)
    rng = np.random.default_rng(7710)
    stiffness = bulk(elasticity(xc.box((-1,) * 3, (1,) * 3, 6), xc.Isotropic(1.0, 0.3)), 1)
    A = stiffness.matrix
    fixed = rng.random(A.shape[0]) < 0.3
    fixed[6:60] = True
    levels = hierarchy(stiffness, fixed)
    assert np.shares_memory(levels.matrix.values, A.data)
    free = sp.diags(~fixed * 1.0)
    left = (free @ A @ free).toarray()
    x = rng.normal(size=A.shape[0]) * ~fixed
    size = np.abs(left).max()
    assert np.abs(levels.matrix.times(x) - left @ x).max() <= 1e-14 * size  # round-off
    y = rng.normal(size=A.shape[0])
    assert (levels.matrix.add_product(y.copy(), 2, x)[fixed] == y[fixed]).all()
    top, below = levels.levels[0], levels.levels[1]
    P = np.array([top.prolong.times(e) for e in np.eye(top.prolong.shape[1], dtype=np.float32)]).T
    assert (P[fixed] == 0).all()
    coarse = np.array([below.matrix.times(e) for e in np.eye(len(P.T), dtype=np.float32)]).T
    assert np.abs(coarse - P.T @ left @ P).max() <= 1e-5 * np.abs(coarse).max()  # single precision


def test_a_coarse_matrix_in_stretches(monkeypatch):
    """Prolongators to the bit; what they make of the matrix to round-off in single precision."""
    monkeypatch.setattr(multigrid, "_COARSEST", 6)
    stiffness, fixed = body((7, 6, 5))
    whole = hierarchy(stiffness, fixed)
    monkeypatch.setattr(multigrid, "_ROWS", 37)
    parts = hierarchy(stiffness, fixed)
    for one, other in zip(whole.levels, parts.levels, strict=True):
        if one is whole.levels[0]:
            assert np.array_equal(one.prolong.values, other.prolong.values)
        size = np.abs(one.matrix.values).max()
        assert np.abs(one.matrix.values - other.matrix.values).max() <= 1e-6 * size


def test_blocks_hold_each_column_once():
    A = drawn((6, 20), 0.2, 4423)
    blocks = row_blocks([A], np.array([0, 3, 6]))
    for k, rows in enumerate((A[:3], A[3:])):
        own = blocks.columns[blocks.start[k] : blocks.start[k + 1]]
        assert own.tolist() == np.unique(rows.indices).tolist()
    assert blocks.columns.dtype == np.uint32


def test_chebyshev_steps():
    rng = np.random.default_rng(4441)
    inverse, r, d, x = rng.normal(size=(4, 7))
    new, moved = d.copy(), x.copy()
    first_step(inverse, r, 0.3, new, moved)
    np.testing.assert_allclose(new, 0.3 * inverse * r)
    np.testing.assert_allclose(moved, x + new)
    before = new.copy()
    next_step(inverse, r, 0.6, 0.2, new, moved)
    np.testing.assert_allclose(new, 0.6 * before + 0.2 * inverse * r)


def body(n, *, supported="foot", E=1.0, nu=0.3, size=1.0, seed=2203, order=1):
    """Stiffness of a box with moved inner points, and which unknowns supports decide."""
    dim = len(n)
    mesh = xc.box((0.0,) * dim, (size,) * dim, n)
    x = np.array(mesh.points)
    inner = ((x > 1e-9 * size) & (x < (1 - 1e-9) * size)).all(axis=1)
    shift = np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), dim))
    x[inner] += 0.15 * size / np.array(n) * shift
    mesh = xc.Mesh(x, mesh.cells, mesh.facet_sets)
    material = xc.Isotropic(E, nu, "strain") if dim == 2 else xc.Isotropic(E, nu)
    x = node_points(mesh, order)
    fixed = np.zeros((len(x), dim), dtype=bool)
    if supported == "foot":
        fixed[x[:, -1] < 1e-9 * size] = True
    elif supported == "symmetry":
        for i in range(dim):
            fixed[x[:, i] < 1e-9 * size, i] = True
    return bulk(elasticity(mesh, material), order), fixed.ravel()


def operator_of(stiffness, fixed, null=None):
    """Levels, their finest matrix and the operator of a body without a crack."""
    levels = hierarchy(stiffness, fixed)
    n = len(levels.is_free)
    free = sp.diags(levels.is_free.astype(float))
    A = free @ stiffness.matrix.tocsr() @ free
    A = sp.csr_matrix(A + sp.diags(levels.diagonal * ~levels.is_free))
    nothing = np.zeros(1, dtype=np.int64)
    border = [
        row_blocks([sp.csr_matrix((n, 0))], levels.matrix.first_row),
        row_blocks([sp.csr_matrix((0, n)), sp.csr_matrix((0, 0))], nothing),
    ]
    K = BorderedFactor(levels.matrix, *border)
    null = np.zeros((n, 0)) if null is None else null
    return A, levels, Operator(K.times, extended_cycle(levels, K, A.diagonal()), A.diagonal(), null)


def load(levels, seed=911):
    return np.random.default_rng(seed).normal(size=len(levels.is_free)) * levels.is_free


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("supported", ["foot", *slow("symmetry")])
def test_against_a_direct_solver(supported, order):
    A, levels, K = operator_of(
        *body((9 - 2 * order, 8, 11 - 2 * order), supported=supported, order=order)
    )
    b = load(levels)
    y, steps = conjugate_gradients(K, b, np.zeros_like(b), 1e-11)
    exact = sla.spsolve(sp.csc_matrix(A), b)
    assert steps <= 25
    # the tolerance, times the root of the condition number
    assert np.abs(y - exact).max() <= 1e-9 * np.abs(exact).max()
    assert (y[~levels.is_free] == 0).all()


def test_cycle_is_symmetric_and_positive():
    _, levels, K = operator_of(*body((9, 8, 7)))
    x, y = load(levels, 77), load(levels, 78)
    Vx, Vy = K.cycle(x), K.cycle(y)
    size = np.sqrt((x @ Vx) * (y @ Vy))
    assert x @ Vx > 0
    assert y @ Vy > 0
    assert abs(x @ Vy - y @ Vx) <= 1e-5 * size  # round-off in single precision
    np.testing.assert_allclose(K.cycle(1e12 * x), 1e12 * Vx, rtol=1e-3, atol=1e-5 * 1e12)
    assert (K.cycle(0 * x) == 0).all()


def test_steps_hardly_grow_with_the_mesh():
    steps = []
    for n in (4, 8, 14):
        A, levels, K = operator_of(*body((n, n, n)))
        b = np.zeros(len(levels.is_free)).reshape(-1, 3)
        top = levels.bulk.mesh.points[:, 2] > 1 - 1e-9
        b[top] = (1.0, 0.3, 0.5)
        b = b.ravel()
        y, count = conjugate_gradients(K, b, np.zeros_like(b))
        assert np.linalg.norm(b - A @ y) <= 1.1e-8 * np.linalg.norm(b)
        steps.append(count)
    assert max(steps) <= 20, steps


def test_quadratic_functions_take_no_more_steps():
    """One level on top, which contains the linear functions."""
    steps = []
    for n in (3, 5, 8):
        stiffness, fixed = body((n, n, n), order=2)
        _, levels, K = operator_of(stiffness, fixed)
        b = load(levels)
        steps.append(conjugate_gradients(K, b, np.zeros_like(b))[1])
        lower = hierarchy(bulk(stiffness.elasticity, 1), fixed)
        assert len(levels.levels) == len(lower.levels) + 1
        # Linear functions have the energy that they have at order 1.
        v = load(lower, 913).astype(np.float32)
        top, below = levels.levels[0], lower.levels[0]
        w = top.prolong.times(v)
        assert w @ top.matrix.times(w) == pytest.approx(v @ below.matrix.times(v), rel=1e-5)
    assert max(steps) <= 20, steps


@pytest.mark.slow
@pytest.mark.mission
def test_a_thin_plate_and_a_plane_body():
    """The aggregates have no say in the shape of the body or its dimension."""
    for n in ((30, 20, 2), (60, 50)):
        _, levels, K = operator_of(*body(n))
        b = load(levels)
        assert conjugate_gradients(K, b, np.zeros_like(b))[1] <= 40


def test_units_change_nothing():
    steps = []
    for E, size in ((1.0, 1.0), (2e11, 1e-3), (1e-9, 1e4)):
        _, levels, K = operator_of(*body((6, 6, 6), E=E, size=size))
        b = load(levels)
        steps.append(conjugate_gradients(K, b, np.zeros_like(b))[1])
    assert max(steps) - min(steps) <= 1, steps


@pytest.mark.parametrize("order", [1, 2])
def test_without_supports(order):
    """Six rigid motions: any solution is right, up to such a motion."""
    stiffness, fixed = body((7, 6, 7) if order == 1 else (4, 3, 4), supported="not", order=order)
    x = node_points(stiffness.mesh, order)
    modes = np.linalg.qr(rigid_modes(x))[0]
    A, levels, K = operator_of(stiffness, fixed, modes)
    b = load(levels)
    b -= modes @ (modes.T @ b)
    y, steps = conjugate_gradients(K, b, np.zeros_like(b), 1e-11)
    assert steps <= 30
    assert np.linalg.norm(b - A @ y) <= 2e-11 * np.linalg.norm(b)
    assert np.abs(modes.T @ y).max() <= 1e-12 * np.linalg.norm(y)  # round-off
    pinned = sp.csc_matrix(A + 1e-2 * sp.csr_matrix(modes @ modes.T))
    exact = sla.spsolve(pinned, b)
    assert np.abs(y - exact).max() <= 1e-8 * np.abs(exact).max()


@pytest.mark.parametrize("E", [1.0, 2.1e5])
def test_one_aggregate_without_supports(monkeypatch, E):
    """The coarsest matrix is round-off alone: inverted, it would swamp everything."""
    monkeypatch.setattr(multigrid, "_COARSEST", 6)
    stiffness, fixed = body((7, 6, 7), supported="not", E=E)
    modes = np.linalg.qr(rigid_modes(stiffness.mesh.points))[0]
    A, levels, K = operator_of(stiffness, fixed, modes)
    assert levels.coarse_inverse.shape == (6, 6)
    b = load(levels)
    b -= modes @ (modes.T @ b)
    y, steps = conjugate_gradients(K, b, np.zeros_like(b), 1e-11)
    assert steps <= 35
    assert np.linalg.norm(b - A @ y) <= 2e-11 * np.linalg.norm(b)


def test_a_small_body_is_solved_at_once():
    A, levels, K = operator_of(*body((2, 2, 2)))
    assert len(levels.is_free) < 100
    b = load(levels)
    y, steps = conjugate_gradients(K, b, np.zeros_like(b))
    exact = sla.spsolve(sp.csc_matrix(A), b)
    assert steps <= 15
    assert np.abs(y - exact).max() <= 1e-7 * np.abs(exact).max()


def test_made_twice_is_the_same():
    """No draw of random numbers by anyone: bit by bit."""
    np.random.seed(99)  # noqa: NPY002
    stiffness, fixed = body((6, 7, 6))
    first = hierarchy(stiffness, fixed)
    np.random.seed(98)  # noqa: NPY002
    second = hierarchy(stiffness, fixed)
    assert len(first.levels) == len(second.levels)
    for a, b in zip(first.levels, second.levels):
        assert a.spectrum_bound == b.spectrum_bound
        assert np.array_equal(a.matrix.values, b.matrix.values)
        assert np.array_equal(a.prolong.values, b.prolong.values)
    assert np.array_equal(first.coarse_inverse, second.coarse_inverse)


def test_serves_the_same_body_and_supports():
    stiffness, fixed = body((4, 4, 4))
    levels = hierarchy(stiffness, fixed)
    longer = np.concatenate([fixed, np.ones(12, dtype=bool)])
    assert levels.fits(stiffness, longer)
    assert not levels.fits(stiffness, ~fixed)
    assert not levels.fits(body((4, 4, 4))[0], fixed)


def test_largest_eigenvalue_is_a_bound():
    A, _, _ = operator_of(*body((6, 6, 6)))
    root = sp.diags(1 / np.sqrt(A.diagonal()))
    exact = sla.eigsh(root @ A @ root, k=1, return_eigenvectors=False)[0]
    blocks = row_blocks([A], np.arange(0, A.shape[0] + 1, 3))
    assert exact <= largest_eigenvalue(blocks, A.diagonal()) <= 1.12 * exact


# --- smoothing by stars of order 2: blocks, their inverses, the bound of the spectrum -------------


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
