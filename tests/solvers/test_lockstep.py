"""States that are solved beside one another: bits as of each alone, multiples for nothing."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

import xcrack as xc
import xcrack.linalg.products as row_blocks_file
from xcrack import ConvergenceError
from xcrack.base.machine import threads
from xcrack.linalg import products
from xcrack.linalg.iterative import best_guesses, independent_columns
from xcrack.linalg.products import row_blocks
from xcrack.linalg.projected_cg import Operator, Request, conjugate_gradients_steps, in_lockstep


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 9])
def test_products_of_several_vectors_are_those_of_each(dtype, count):
    """To the bit, and round-off from scipy's, in blocks of any number of rows."""
    rng = np.random.default_rng(90 + count)
    first = np.cumsum([0, 3, 1, 6, 2, 0, 5, 3])
    A = sp.random(first[-1], 17, 0.3, format="csr", rng=rng)
    matrix = row_blocks([A], first, dtype)
    x = rng.normal(size=(count, 17)).astype(dtype)
    x[-1, 3] = np.inf if count > 1 else x[-1, 3]  # must not spoil those beside it
    y = rng.normal(size=(count, first[-1])).astype(dtype)
    alone = [matrix.add_product(own.copy(), -2.5, v) for own, v in zip(y, x)]
    for k in range(0, count, 4):
        wide, sums = np.zeros((17, 4), dtype), np.zeros((first[-1], 4), dtype)
        wide[:, : len(x[k : k + 4])], sums[:, : len(x[k : k + 4])] = x[k : k + 4].T, y[k : k + 4].T
        result = matrix.add_product(sums, -2.5, wide)
        for c, own in enumerate(alone[k : k + 4]):
            assert result[:, c].tobytes() == own.tobytes()
    exact = y[0] - 2.5 * (A @ x[0])
    np.testing.assert_allclose(alone[0], exact, rtol=0, atol=40 * np.finfo(dtype).eps)


def test_matrices_made_by_threads_have_the_same_bits(monkeypatch):
    """Products of sparse matrices and blocks of rows, in stretches however short."""
    rng = np.random.default_rng(91)
    A = sp.random(41, 30, 0.2, format="csr", rng=rng)
    B = sp.random(30, 23, 0.3, format="csr", rng=rng)
    first = np.cumsum([0, 3, 1, 6, 2, 0, 5, 3, 9, 12])

    def made():
        blocks = row_blocks([A, A @ B], first)
        return products.product(A, B), blocks, blocks.times(np.ones(53))

    alone, blocks, image = made()
    np.testing.assert_allclose(alone.toarray(), A.toarray() @ B.toarray(), rtol=0, atol=1e-14)
    monkeypatch.setattr(products, "_LEAST", 1)
    monkeypatch.setattr(row_blocks_file, "_LEAST", 1)
    for count in (2, 3, 16):
        with threads(count):
            shared, other, forces = made()
        for name in ("indptr", "indices", "data"):
            assert np.array_equal(getattr(shared, name), getattr(alone, name))
        for name in ("first_row", "start", "offset", "columns", "values"):
            assert np.array_equal(getattr(other, name), getattr(blocks, name))
        assert forces.tobytes() == image.tobytes()


def dense(seed, n=30):
    A = np.random.default_rng(seed).normal(size=(n, n + 5))
    K = A @ A.T / n
    diagonal = np.diag(K).copy()
    asked = []

    def all_of(function):
        def several(vectors):
            asked.append(len(vectors))
            return [function(v) for v in vectors]

        return several

    one = (lambda v: K @ v), (lambda r: r / diagonal)
    null = np.zeros((n, 0))
    return K, Operator(*one, diagonal, null, *map(all_of, one)), asked


def test_iterations_end_on_their_own():
    """More of them than go at a time, of different lengths, one with nothing to do."""
    K, operator, asked = dense(71)
    b = list(np.random.default_rng(72).normal(size=(7, 30)))
    b[3] *= 0
    limits = [1e-3, 1e-12, 1e-6, 1e-9, 1e-1, 1e-9, 1e-12]
    runs = [conjugate_gradients_steps(operator, own, 0 * own, t) for own, t in zip(b, limits)]
    results = in_lockstep(operator, runs)
    assert max(asked) == 4
    assert results[3][1] == 0
    assert len({steps for _, steps in results}) > 3
    for own, limit, (y, steps) in zip(b, limits, results):
        assert np.linalg.norm(own - K @ y) <= 1.01 * limit * np.linalg.norm(own)
        alone = in_lockstep(operator, [conjugate_gradients_steps(operator, own, 0 * own, limit)])[0]
        assert alone[1] == steps
        assert alone[0].tobytes() == y.tobytes()


def test_the_first_that_fails_ends_all():
    _, operator, _ = dense(73)
    b = list(np.random.default_rng(74).normal(size=(3, 30)))
    runs = [
        conjugate_gradients_steps(operator, own, 0 * own, 1e-12, limit)
        for own, limit in zip(b, (90, 3, 90))
    ]
    with pytest.raises(ConvergenceError, match="after 3 steps"):
        in_lockstep(operator, runs)


def test_an_answer_for_each_request_in_any_order():
    """Requests of different kinds at a time."""
    operator = Operator(lambda v: 2 * v, lambda r: r + 1, np.ones(1), np.zeros((1, 0)))

    def asking(kinds):
        v = np.zeros(1)
        for kind in kinds:
            v = yield kind, v
        return v[0]

    patterns = ["tcc", "cct", "c", "", "ctctct"]
    results = in_lockstep(
        operator,
        [asking([Request.TIMES if k == "t" else Request.CYCLE for k in p]) for p in patterns],
    )
    assert results == [2, 4, 1, 0, 14]


def test_combinations_of_solved_loads_are_seen():
    rng = np.random.default_rng(75)
    K, operator, _ = dense(76)
    a, b, c = rng.normal(size=(3, 30))
    vectors = [a, 0 * a, -3 * a, b, 1e6 * a + 1e-3 * b, a + 2 * b, a + 1e-7 * c, c]
    assert independent_columns(vectors) == [0, 3, 7]
    solved = [np.linalg.solve(K, v) for v in (a, b)]
    guess, nothing = best_guesses(operator, solved, [a + 2 * b, 0 * a])
    np.testing.assert_allclose(guess, solved[0] + 2 * solved[1], rtol=1e-9)
    assert (nothing == 0).all()
    assert (best_guesses(operator, [], [a])[0] == 0).all()


def block(n=6):
    """Edge crack through a block that is held at its bottom."""
    crack = xc.plane_crack(
        [(-1.5, -1.5, 0.03), (-0.1, -1.5, 0.03), (-0.1, 1.5, 0.03), (-1.5, 1.5, 0.03)]
    )
    numerics = xc.Numerics(linear="iterative")
    return xc.Problem(
        xc.box((-1,) * 3, (1,) * 3, n), xc.Isotropic(2.0, 0.3), [crack],
        supports=[xc.fix("bottom")], numerics=numerics, order=1,
    )  # fmt: skip


def loads(stress):
    """Traction on the top, given over x."""
    return [xc.traction("top", lambda x: np.outer(stress(x[:, 0]), (0.1, 0, 1.0)))]


def bending(factor):
    return loads(lambda x: factor * (np.sin(x) + 0.45))


@pytest.mark.slow
@pytest.mark.mission
def test_a_state_has_its_bits_whoever_runs_beside_it():
    """Open, half closed and closed states, together, in another order, alone, with threads."""
    problem = block()
    several = [
        loads(np.ones_like),
        bending(1.0),
        loads(lambda x: -1 - x**2),
        loads(lambda x: x + 0.6),
    ]
    together = xc.solve(problem, states=several)
    shares = [s.contact[0].closed.mean() for s in together]
    assert min(shares) == 0
    assert max(shares) == 1
    assert any(0 < share < 1 for share in shares)
    turned = xc.solve(problem, states=several[::-1])[::-1]
    numerics = xc.Numerics(linear="iterative", threads=2)
    shared = xc.solve(replace(problem, numerics=numerics), states=several)
    alone = xc.solve(problem, states=several[1:2])
    for one, other, third in zip(together, turned, shared):
        assert one.u.tobytes() == other.u.tobytes() == third.u.tobytes()
        pressures = [s.contact[0].pressure.tobytes() for s in (one, other, third)]
        assert len(set(pressures)) == 1
    assert together[1].u.tobytes() == alone[0].u.tobytes()


@pytest.mark.slow
@pytest.mark.mission
def test_multiples_of_a_load_cost_nothing():
    """Half closed too: the same set, scaled; with another sign it is another state."""
    one = xc.solve(block(), states=[bending(1.0)])[0]
    factors = 1.0, 0.3, 2.0
    several = xc.solve(block(), states=[bending(factor) for factor in factors])
    assert 0 < one.contact[0].closed.mean() < 1
    counts = [s.report.operations["iterations"] for s in (one, several[0])]
    assert counts[0] == counts[1]
    assert several[0].u.tobytes() == one.u.tobytes()
    for solution, factor in zip(several, factors):
        assert np.abs(solution.u - factor * one.u).max() <= 1e-12 * np.abs(one.u).max() * factor
        assert (solution.contact[0].closed == one.contact[0].closed).all()
    turned = xc.solve(block(), states=[bending(1.0), bending(-1.0)])
    alone = xc.solve(block(), states=[bending(-1.0)])[0]
    # The residual of the rough first look is scaled from the other state: no bits are the same.
    assert np.abs(turned[1].u - alone.u).max() <= 1e-7 * np.abs(alone.u).max()
