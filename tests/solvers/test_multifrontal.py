"""Multifrontal Cholesky against dense factorisations, and against itself where little changed.

Matrices are stiffnesses of real spaces; errors are round-off unless said otherwise.
"""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
import threadpoolctl

import xcrack as xc
from support import scenes_2d as scenes
from support.rows import mission
from xcrack.analysis.solve import solve_states
from xcrack.base.machine import one_blas_thread
from xcrack.fem.system import build
from xcrack.linalg import direct, multifrontal
from xcrack.linalg.basis import function_nodes
from xcrack.linalg.engine import SolverState
from xcrack.linalg.kernels.multifrontal import postorder
from xcrack.linalg.multifrontal import factorise, tree
from xcrack.linalg.rigid_motion import free_motion

STEEL = xc.Isotropic(1.0, 0.3, "strain")


def plane(points, n=9, mesh=None, **options):
    mesh = mesh or scenes.perturbed(n, 611)
    cracks = [xc.line_crack(p) for p in points]
    return xc.Problem(mesh, STEEL, cracks, loads=PULL, **options)


PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
EDGE = [(-1.2, 0.013), (-0.2, 0.031)]
# One side of each cut cell is a millionth of a cell wide: the functions of its nodes nearly repeat.
SLIVER = [(-1.2, 1e-7), (0.03, 1e-7)]


def graded():
    """Cells from 1 to 1e-3 of the side."""
    x = np.array([0.0, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0])
    mesh = xc.box((0, 0), (1, 1), 7)
    return xc.Mesh(np.stack([x[np.round(7 * c).astype(int)] for c in mesh.points.T], 1), mesh.cells)


def penny():
    mesh = xc.box((-1,) * 3, (1,) * 3, 4)
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    loads = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], loads=loads, order=1)


SCENES = {
    "edge, order 2": lambda: plane([EDGE]),
    "edge, order 1": lambda: plane([EDGE], order=1),
    "no crack": lambda: plane([]),
    "two cracks": lambda: plane([EDGE, [(0.1, 0.41), (0.62, -0.33)]]),
    "slivers": lambda: plane([SLIVER], mesh=xc.box((-1, -1), (1, 1), 8)),
    "cut in two": lambda: plane([[(-1.2, 0.11), (1.2, -0.17)]], supports=[
        xc.fix("top"), xc.fix("bottom")]),
    "nearly incompressible": lambda: replace(
        plane([EDGE]), material=xc.Isotropic(1.0, 0.49999, "strain")),
    "graded": lambda: xc.Problem(graded(), STEEL, loads=[]),
    "one cell": lambda: xc.Problem(xc.Mesh([(0, 0), (1, 0), (0, 1)], [(0, 1, 2)]), STEEL),
    "penny": penny,
}  # fmt: skip


def matrix_of(problem):
    """Matrix that is factored, and the columns that it belongs to."""
    model = build(problem)
    fixed = model.imposed_values.is_fixed.copy()
    fixed[free_motion(model.space, fixed).pins] = True
    basis, reduced = direct._reduced_columns(
        model.space, model.stiffness, fixed, problem.numerics, problem.material
    )
    owner = function_nodes(model.space)
    return reduced, (basis.indptr, basis.indices, basis.shape[1], owner, model.space.dim)


@pytest.mark.parametrize(
    "scene", [*(name for name in SCENES if name != "penny"), *mission("penny")]
)
@pytest.mark.parametrize(
    "keep",
    [pytest.param(False, marks=(pytest.mark.slow, pytest.mark.mission)), True],
    ids=["once", "kept"],
)
def test_against_a_dense_factorisation(scene, keep):
    """Residual, solution and halves; P K P^T = L L^T says what the forward half is."""
    problem = SCENES[scene]()
    A, columns = matrix_of(problem)
    factor = factorise(A, columns, tree(problem.mesh, problem.order), keep=keep)
    dense = A.toarray()
    dense = (dense + dense.T) / 2
    exact = scipy.linalg.cholesky(dense[np.ix_(factor.perm, factor.perm)], lower=True)
    b = np.random.default_rng(733).standard_normal((A.shape[0], 3))
    condition = np.linalg.cond(dense)
    for r in (1, 3):
        x = factor.solve(b[:, :r])
        residual = np.linalg.norm(dense @ x - b[:, :r]) / np.linalg.norm(x)
        assert residual <= 1e-13 * np.linalg.norm(dense, 2) * len(b)
        wanted = np.linalg.solve(dense, b[:, :r])
        assert np.linalg.norm(x - wanted) <= 1e-14 * condition * np.linalg.norm(wanted)
        half = scipy.linalg.solve_triangular(exact, b[factor.perm, :r], lower=True)
        off = np.linalg.norm(factor.solve_lower(b[:, :r]) - half)
        assert off <= 1e-16 * condition * np.linalg.norm(half)  # round-off
        np.testing.assert_array_equal(factor.solve_upper(factor.solve_lower(b[:, :r])), x)
    np.testing.assert_array_equal(factor.solve(b[:, 0]), factor.solve(b[:, :1])[:, 0])


@pytest.mark.parametrize("scene", ["edge, order 2", "penny", "two cracks"])
def test_forward_half_of_sparse_rows(scene):
    """Only parts that the rows touch are visited; B K^-1 B^T comes from it."""
    problem = SCENES[scene]()
    A, columns = matrix_of(problem)
    factor = factorise(A, columns, tree(problem.mesh, problem.order))
    rng = np.random.default_rng(734)
    rows = sp.csr_matrix((np.ones(7), (rng.integers(0, 3, 7), rng.choice(A.shape[0], 7))),
                         shape=(3, A.shape[0]))  # fmt: skip
    Y, places = factor.forward_sparse(rows)
    np.testing.assert_allclose(Y, factor.solve_lower(rows.T.toarray())[places], atol=1e-12)
    assert len(places) < A.shape[0]
    wanted = rows @ np.linalg.solve(A.toarray(), rows.T.toarray())
    np.testing.assert_allclose(Y.T @ Y, wanted, rtol=1e-9, atol=1e-12)


def test_a_matrix_that_is_not_positive_is_refused():
    problem = plane([EDGE])
    A, columns = matrix_of(problem)
    halves = tree(problem.mesh, 2)
    assert factorise(A - 0.5 * sp.identity(A.shape[0], format="csc"), columns, halves) is None
    holes = sp.diags((np.arange(A.shape[0]) != 11) * 1.0)
    assert factorise(sp.csc_matrix(holes @ A @ holes), columns, halves) is None


def test_one_pivot_that_is_not_positive_is_refused_in_every_front():
    """In those that loops factor and in those of LAPACK, in their first columns and their last."""
    problem = plane([EDGE])
    A, columns = matrix_of(problem)
    halves = tree(problem.mesh, 2)
    factor = factorise(A, columns, halves)
    first = factor.first_unknown
    widths = np.diff(first)
    assert widths.min() <= 8
    assert widths.max() > 32
    for part in (*range(0, len(widths), 9), len(widths) - 1):
        for place in {first[part], first[part + 1] - 1} if widths[part] else ():
            unknown = factor.perm[place]
            dent = sp.csc_matrix(([A[unknown, unknown]], ([unknown], [unknown])), A.shape)
            assert factorise(sp.csc_matrix(A - dent), columns, halves) is None


def test_nan_is_not_taken_for_a_solution(monkeypatch):
    sound = multifrontal.factorise

    def spoilt(A, *arguments, **options):
        return sound(sp.csc_matrix(np.nan * A), *arguments, **options)

    monkeypatch.setattr(direct, "factorise", spoilt)
    assert np.isfinite(xc.solve(plane([EDGE])).u).all()


def test_superlu_takes_what_is_not_positive(monkeypatch):
    """The body itself is; its factor is refused for a reason of its own."""
    wanted = xc.solve(plane([EDGE]))
    monkeypatch.setattr(direct, "factorise", lambda *a, **k: None)
    solution = xc.solve(plane([EDGE]))
    np.testing.assert_allclose(solution.u, wanted.u, atol=1e-9 * np.abs(wanted.u).max())


def test_a_factor_that_lost_its_digits_is_replaced(monkeypatch):
    wanted = xc.solve(plane([EDGE]))
    sound = multifrontal.Factor.solve
    monkeypatch.setattr(multifrontal.Factor, "solve", lambda self, b: 1.01 * sound(self, b))
    solution = xc.solve(plane([EDGE]))
    np.testing.assert_allclose(solution.u, wanted.u, atol=1e-9 * np.abs(wanted.u).max())
    assert solution.report.operations["factorisations"] == 2


# --- the tree ------------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [0, 1, 2, 5])
def test_children_come_before_parents(depth):
    order, rank, height = postorder(depth)
    assert sorted(order) == list(range(1, 2 ** (depth + 1)))
    np.testing.assert_array_equal(order[rank[1:]], np.arange(1, 2 ** (depth + 1)))
    for p in range(1, 2**depth):
        assert rank[2 * p] < rank[2 * p + 1] < rank[p]
        # A subtree is a stretch, the second child's right before the parent.
        assert rank[2 * p + 1] == rank[p] - 1
    for p in range(1, 2 ** (depth + 1)):
        assert height[rank[p]] == depth - int(np.log2(p))


@pytest.mark.parametrize("dim", [2, 3])
def test_halves_of_a_mesh(dim):
    """As many levels as halving takes; a node sits where all its cells are."""
    mesh = xc.box((0,) * dim, (1,) * dim, {2: 21, 3: 5}[dim])
    halves = tree(mesh, 1)
    assert tree(mesh, 1).node_to_part.tobytes() == halves.node_to_part.tobytes()
    moved = xc.Mesh(mesh.points * 4.0, mesh.cells)  # exact, ties stay ties
    np.testing.assert_array_equal(tree(moved, 1).node_to_part, halves.node_to_part)
    depth = len(halves.postorder).bit_length() - 1
    assert len(mesh.cells) / 8 <= 2**depth < len(mesh.cells) / 4
    # No cell couples two nodes of which neither is an ancestor of the other.
    for a in range(dim + 1):
        for b in range(a):
            one, other = (halves.node_to_part[mesh.cells[:, i]] for i in (a, b))
            high, low = np.maximum(one, other), np.minimum(one, other)
            level = [np.floor(np.log2(x)).astype(int) for x in (high, low)]
            np.testing.assert_array_equal(high >> (level[0] - level[1]), low)


@pytest.mark.parametrize("odd", [False, True])
def test_cuts_lie_on_lines_of_the_mesh(odd):
    """The first cut of a square of n rows is one line of n + 1 points, also where n is odd."""
    n = 14 + odd
    mesh = xc.box((0, 0), (1, 1), n)
    assert (tree(mesh, 1).node_to_part == 1).sum() == n + 1


def test_a_cut_keeps_away_from_fine_cells():
    """Cells halved around a point: the cut at the median has a quarter more points (38 and 49)."""
    mesh = xc.box((-1, -1), (1, 1), 24)
    for reach in (0.6, 0.4, 0.25, 0.12):
        distance = np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - [-0.1, 0.04], axis=1)
        mesh = xc.refine(mesh, np.nonzero(distance < reach)[0])
    middle = mesh.points[mesh.cells].mean(axis=1)
    left = np.argsort(middle[:, 0], kind="stable")[: len(middle) // 2]
    right = np.setdiff1d(np.arange(len(middle)), left)
    on_both = np.intersect1d(mesh.cells[left], mesh.cells[right])
    assert (tree(mesh, 1).node_to_part == 1).sum() < 0.85 * len(on_both)


# --- what changed --------------------------------------------------------------------------------


def grown(steps):
    """An edge crack that gets longer, step by step, in one mesh."""
    mesh = scenes.perturbed(24, 612)
    return [
        plane([[*EDGE[:1], (-0.2 + 0.05 * k, 0.031 + 0.01 * k)]], mesh=mesh) for k in range(steps)
    ]


@pytest.mark.parametrize("order", [1, 2])
def test_only_what_changed_is_factored_and_the_bits_are_the_same(order, monkeypatch):
    """Solutions of the same tree are equal to the last bit, whatever was taken over."""
    fresh = [p for p in grown(4)]
    halves, before, shares = tree(fresh[0].mesh, order), None, []
    seen = {}
    sound = multifrontal._parts_to_factor

    def watched(*arguments):
        seen["wanted"] = sound(*arguments)
        return seen["wanted"]

    monkeypatch.setattr(multifrontal, "_parts_to_factor", watched)
    for problem in fresh:
        problem = replace(problem, order=order)
        A, columns = matrix_of(problem)
        alone = factorise(A, columns, halves)
        seen.clear()
        after = factorise(A, columns, halves, before, keep=True)
        b = np.random.default_rng(735).standard_normal((A.shape[0], 2))
        assert after.solve(b).tobytes() == alone.solve(b).tobytes()
        if before is not None:
            shares.append(seen["wanted"].mean())
        assert sum(map(len, after.memory)) <= multifrontal._SPREAD * after.n_numbers
        before = after
    assert max(shares) < 0.7
    again = factorise(A, columns, halves, before, keep=True)
    assert not seen["wanted"].any()
    assert again.solve(b).tobytes() == before.solve(b).tobytes()


def test_a_change_in_the_last_bit_is_seen():
    """Values are compared, not a hash of them."""
    problem = plane([EDGE])
    A, columns = matrix_of(problem)
    halves = tree(problem.mesh, 2)
    before = factorise(A, columns, halves, keep=True)
    for value in (np.nextafter(A.data[40], 9.0), A.data[40] + 1e-9):
        changed = A.copy()
        i = int(changed.indices[40])
        j = int(np.searchsorted(changed.indptr, 40, side="right") - 1)
        changed[i, j] = changed[j, i] = value
        after = factorise(sp.csc_matrix(changed), columns, halves, before, keep=True)
        alone = factorise(sp.csc_matrix(changed), columns, halves)
        b = np.ones(A.shape[0])
        assert after.solve(b).tobytes() == alone.solve(b).tobytes()


def test_memory_of_update_matrices_is_bounded(monkeypatch):
    problem = grown(1)[0]
    A, columns = matrix_of(problem)
    halves = tree(problem.mesh, 2)
    free = factorise(A, columns, halves, keep=True)
    once = factorise(A, columns, halves)
    retained = free.n_numbers - once.n_numbers
    monkeypatch.setattr(multifrontal, "_MOST", retained // 3)
    bound = factorise(A, columns, halves, keep=True)
    assert bound.subtree_levels > free.subtree_levels
    assert bound.n_numbers - once.n_numbers <= retained // 3
    b = np.ones(A.shape[0])
    assert bound.solve(b).tobytes() == free.solve(b).tobytes()
    # A factor with other units is not taken over, and one of another tree neither.
    after = factorise(A, columns, halves, free, keep=True)
    assert after.solve(b).tobytes() == free.solve(b).tobytes()
    other = factorise(A, columns, tree(problem.mesh, 2), free, keep=True)
    assert other.solve(b).tobytes() == free.solve(b).tobytes()


@pytest.mark.parametrize("contact", ["off", "on"])
def test_growth_hands_the_factor_on(contact):
    """The solution of the next crack has the bits of a fresh solve that knows no factor."""
    problems = [replace(p, contact=contact) for p in grown(3)]
    states = [1.0, -0.5]
    reuse = SolverState()
    for problem in problems:
        light = replace(reuse, factor=None, tree=None, bulk=None)
        alone = solve_states(problem, states, reuse=light)
        together = solve_states(problem, states, reuse=reuse)
        for one, other in zip(alone, together, strict=True):
            assert one.u.tobytes() == other.u.tobytes()
        reuse = together[0].reuse
        assert reuse.factor is not None
        assert reuse.tree is reuse.factor.tree
    assert xc.solve(problem).reuse.factor is None  # nobody asked for more
    assert pickle.loads(pickle.dumps(reuse)).factor is None  # its addresses mean nothing elsewhere


def test_steps_of_a_run_keep_no_factor():
    run = xc.grow(
        grown(1)[0], xc.paris(1e-3, 2.0), xc.max_hoop_stress, xc.Cycle(0, 1), 0.15, max_steps=2,
        progress=False,
    )  # fmt: skip
    assert all(s.reuse.factor is None for step in run for s in step.solutions)


# --- threads of BLAS -----------------------------------------------------------------------------


def test_blas_has_one_thread_inside_and_as_many_as_before_outside():
    def threads():
        return [
            p["num_threads"] for p in threadpoolctl.threadpool_info() if p["user_api"] == "blas"
        ]

    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        before = threads()
        with one_blas_thread():
            assert set(threads()) == {1}
        assert threads() == before
        problem = grown(1)[0]
        many = xc.solve(problem)
        assert threads() == before
    with threadpoolctl.threadpool_limits(1, user_api="blas"):
        one = xc.solve(problem)
    A, columns = matrix_of(problem)
    b = np.ones(A.shape[0])
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        two = factorise(A, columns, tree(problem.mesh, 2)).solve(b)
    with threadpoolctl.threadpool_limits(1, user_api="blas"):
        assert factorise(A, columns, tree(problem.mesh, 2)).solve(b).tobytes() == two.tobytes()
    np.testing.assert_allclose(many.u, one.u, atol=1e-12 * np.abs(one.u).max())
