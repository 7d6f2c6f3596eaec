"""Contact by projected conjugate gradients, states beside one another: as with dense solvers."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import xcrack as xc
import xcrack.linalg.products as row_blocks_file
from support import scenes_2d as scenes
from xcrack import ConvergenceError
from xcrack.analysis.multipliers import gap_rows, multipliers, vital_edges
from xcrack.analysis.solve import build
from xcrack.base.machine import threads
from xcrack.fem.loads import load_vector
from xcrack.linalg import iterative, products
from xcrack.linalg.active_set import active_set
from xcrack.linalg.direct import system
from xcrack.linalg.engine import ContactRows
from xcrack.linalg.iterative import best_guesses, independent_columns, iterative_system
from xcrack.linalg.products import row_blocks
from xcrack.linalg.projected_cg import (
    Operator,
    Request,
    conjugate_gradients_steps,
    in_lockstep,
    projected_steps,
)
from xcrack.linalg.rigid_motion import balanced_loads, free_motion, without_motion


def dense(K, null=None):
    """Operator of a dense matrix, with its diagonal for a cycle."""
    diagonal = np.diag(K).copy()
    null = np.zeros((len(K), 0)) if null is None else null
    return Operator(lambda v: K @ v, lambda r: r / diagonal, diagonal, null)


def conjugate_gradients(K, b, start, *limits):
    return in_lockstep(K, [conjugate_gradients_steps(K, b, start, *limits)])[0]


def drawn(seed, n, g):
    """Stiffness, load, rows and gaps of a small problem; every row acts."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n + 3))
    return A @ A.T / n, rng.normal(size=n), rng.normal(size=(g, n)), 0.1 * rng.normal(size=g)


def pressed(K, b, N, d, start=True, measure=None, **options):
    measure = np.ones(len(d)) if measure is None else measure
    flags = np.broadcast_to(np.asarray(start, dtype=bool), len(d))
    options = {"tolerance": 1e-12} | options
    y = np.zeros(len(b))
    A = dense(K)
    run = projected_steps(A, b, sp.csr_matrix(N), d, measure, 1.0, flags, y, **options)
    return in_lockstep(A, [run])[0]


def by_enumeration(K, b, N, d):
    """Pressure by trying every set: the only one that satisfies all conditions."""
    F, gap = N @ np.linalg.solve(K, N.T), N @ np.linalg.solve(K, b) + d
    for pattern in itertools.product([False, True], repeat=len(d)):
        active, p = np.array(pattern), np.zeros(len(d))
        if active.any():
            p[active] = np.linalg.solve(F[np.ix_(active, active)], -gap[active])
        if (p >= -1e-12).all() and (F @ p + gap >= -1e-12)[~active].all():
            return p
    raise AssertionError("no set fits")


@given(seed=st.integers(0, 2**32 - 1), g=st.integers(1, 5), start=st.booleans())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_against_enumeration(seed, g, start):
    K, b, N, d = drawn(seed, 9, g)
    result = pressed(K, b, N, d, start)
    exact = by_enumeration(K, b, N, d)
    # the tolerance times condition numbers of small drawn matrices
    assert np.abs(result.pressure - exact).max() <= 1e-7 * (1 + np.abs(exact).max())
    y = np.linalg.solve(K, b + N.T @ exact)
    assert np.abs(result.y - y).max() <= 1e-7 * (1 + np.abs(y).max())
    assert np.abs((N @ result.y + d)[result.active]).max(initial=0) <= 1e-12  # round-off
    assert result.gap.min() >= -1e-7
    assert (result.pressure * result.gap == 0).all()


# A set that plain corrections leave and return to (the one of test_complementarity).
CYCLING = np.array([[11.0, 13.0, -10.0], [13.0, 18.0, -15.0], [-10.0, -15.0, 15.0]])


@pytest.mark.parametrize("start", list(itertools.product([False, True], repeat=3)))
def test_a_cycle_ends_group_by_group(start):
    K = np.linalg.inv(CYCLING)
    d = np.array([-1.0, -4.0, 4.0])
    result = pressed(K, np.zeros(3), np.eye(3), d, start)
    assert result.pressure == pytest.approx([0, 2 / 9, 0], abs=1e-9)
    assert result.gap == pytest.approx([17 / 9, 0, 2 / 3], abs=1e-9)
    assert result.sets <= 12


def test_groups_of_very_different_size():
    K, b, N, d = drawn(8821, 12, 5)
    reference = pressed(K, b, N, d)
    size = 10.0 ** np.array([0, -3, -6, -9, -12])
    result = pressed(K, b, N * size[:, None], d * size, measure=size)
    assert np.array_equal(result.active, reference.active)
    assert result.pressure * size == pytest.approx(reference.pressure, rel=1e-8, abs=1e-12)


def test_redundant_groups_share_their_pressure():
    K, _, N, d = drawn(8831, 12, 4)
    b, d[3] = np.zeros(12), -abs(d[3]) - 3
    reference = pressed(K, b, N, d)
    assert reference.pressure[3] > 0
    twice = np.array([0, 1, 2, 3, 3])
    result = pressed(K, b, N[twice], d[twice])
    assert result.pressure[3] == pytest.approx(result.pressure[4], rel=1e-6)
    assert result.pressure[3] + result.pressure[4] == pytest.approx(reference.pressure[3], rel=1e-6)
    assert result.y == pytest.approx(reference.y, rel=1e-6, abs=1e-9)


def test_many_groups_take_the_sparse_factor():
    n = 900
    K = (
        np.diag(np.full(n, 2.0))
        + np.diag(np.full(n - 1, -0.9), 1)
        + np.diag(np.full(n - 1, -0.9), -1)
    )
    rng = np.random.default_rng(8839)
    b, N, d = -1 - rng.random(n), np.eye(n) + 0.3 * np.eye(n, k=1), np.zeros(n)
    result = pressed(K, b, N[:700], d[:700])
    assert result.active.sum() > 400
    F, gap = N[:700] @ np.linalg.solve(K, N[:700].T), N[:700] @ np.linalg.solve(K, b)
    exact = active_set(F, gap, np.ones(700), 1.0, np.ones(700, dtype=bool))
    assert np.array_equal(result.active, exact.active)
    assert result.pressure == pytest.approx(exact.pressure, rel=1e-8, abs=1e-9)


def test_no_load_no_pressure():
    K, _, N, d = drawn(8849, 7, 3)
    result = pressed(K, np.zeros(7), N, 0 * d)
    assert result.iterations == 0
    assert result.pressure.max() == 0
    assert np.abs(result.y).max() == 0


@pytest.mark.parametrize("start", [True, False])
def test_groups_that_touch(start):
    """Pressure and gap both zero but for round-off: the set must not hunt."""
    K, _, N, _ = drawn(8861, 10, 6)
    p = np.array([2.0, 0.0, 1.0, 0.0, 3.0, 0.0])
    gap = N @ np.linalg.solve(K, N.T @ p)
    for seed in range(8870, 8875):
        noise = 1e-15 * np.random.default_rng(seed).normal(size=6)
        result = pressed(K, np.zeros(10), N, -gap + noise, start, tolerance=1e-10)
        assert result.pressure == pytest.approx(p, abs=1e-7)
        assert result.sets <= 12


def test_no_solution_says_how_far_it_got():
    K, b, N, d = drawn(8887, 20, 4)
    with pytest.raises(ConvergenceError, match=r"after 3 steps .* residual is .* groups are"):
        pressed(K, b, N, d, limit=3)
    with pytest.raises(ConvergenceError, match="after 3 steps the residual is"):
        conjugate_gradients(dense(K), b, np.zeros(20), 1e-12, 3)
    b[0] = np.nan
    with pytest.raises(ConvergenceError):
        pressed(K, b, N, d)
    with pytest.raises(ConvergenceError):
        conjugate_gradients(dense(K), b, np.zeros(20))


def test_a_matrix_that_is_not_positive():
    K = np.diag([1.0, 1.0, -1.0])
    K[0, 2] = K[2, 0] = 3
    with pytest.raises(ConvergenceError, match="singular"):
        conjugate_gradients(dense(K), np.ones(3), np.zeros(3))


def test_lips_that_supports_press_into_each_other():
    K, b, N, d = drawn(8893, 6, 3)
    N[2], d[2] = 0, -1.0
    with pytest.raises(ConvergenceError, match="smallest gap of -1"):
        pressed(K, b, N, d)


# Cracked bodies ----------------------------------------------------------------------------------


def beam(x, normal):
    return np.stack([0.1 + 0 * x[:, 0], -0.7 * x[:, 0] - 0.3], axis=1)


def bent(x):
    return np.stack([0.01 + 0 * x[:, 0], -0.1 * x[:, 0] - 0.02], axis=1)


CRACKS = {
    "inner": [[[-0.5, 0.07], [0.45, -0.1]]],
    "edge": [[[-1.3, 0.05], [0.3, -0.05]]],
    "two": [[[-0.6, -0.3], [0.2, -0.4]], [[-0.1, 0.3], [0.6, 0.35]]],
    "kinked": [[[-1.3, -0.3], [-0.4, 0.1], [0.3, -0.05]]],
    "through": [[[-1.3, 0.05], [1.3, -0.08]]],
}


def total(problem, model, loads):
    """Nodal forces of loads together."""
    forces = np.zeros(model.space.n_dof)
    for load in loads:
        forces += load_vector(model.space, problem.elasticity, load, model.lips)
    return forces


class Scene:
    """A cracked square and all that both engines need."""

    def __init__(self, name, n=20, seed=3119, supports=None, order=1, **material):
        cracks = [xc.line_crack(points) for points in CRACKS[name]]
        foot = xc.fix("bottom")
        supported = [foot, xc.displacement("top", bent)] if name == "through" else [foot]
        loads = [] if name == "through" else [xc.traction("top", beam)]
        supported = supported if supports is None else supports
        material = {"E": 1.0, "nu": 0.3, "plane": "strain"} | material
        problem = xc.Problem(
            scenes.perturbed(n, seed), xc.Isotropic(**material), cracks, supports=supported,
            loads=loads, order=order,
        )  # fmt: skip
        self.problem, self.model = problem, build(problem)
        self.space, self.fixed = self.model.space, self.model.imposed_values.is_fixed
        self.f = total(problem, self.model, loads)
        self.known = self.model.imposed_values.value
        self.stiffness = problem.material.E * n / 2

    def direct(self):
        return system(self.space, self.model.stiffness, self.fixed, self.problem.numerics)

    def iterative(self, **options):
        model = self.model
        return iterative_system(self.space, model.stiffness, model.bulk, self.fixed, **options)

    def lips(self):
        """Rows of the weak gaps and measures of the groups."""
        model = self.model
        spaces = [
            multipliers(self.space, c, lips, "reduced", self.fixed)
            for c, lips in enumerate(model.lips)
        ]
        rows = [gap_rows(m, model.lips[m.crack], model.jumps[m.crack]) for m in spaces]
        return sp.csr_matrix(sp.vstack(rows)), np.concatenate([m.measure for m in spaces])

    def displacement_error(self, u, reference):
        n = self.space.n_nodes * 2
        jump = max(np.abs(J @ (u - reference)).max() for J in self.model.jumps)
        return max(jump, np.abs((u - reference)[:n]).max()) / np.abs(reference[:n]).max()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("name", list(CRACKS))
def test_open_lips_as_with_a_factor(name, order):
    scene = Scene(name, n=20 // order, order=order)
    reference = scene.direct().solve(scene.f, scene.known)
    engine = scene.iterative()
    u = engine.solve(scene.f, scene.known)
    assert scene.displacement_error(u, reference) <= 1e-7  # the iteration's tolerance
    assert engine.count.iterations <= 70
    assert np.array_equal(u[scene.fixed], scene.known[scene.fixed])
    back = engine.basis @ engine.coordinates(u - scene.known) + scene.known
    assert scene.displacement_error(back, u) <= 1e-12  # round-off


@pytest.mark.parametrize("start", ["closed", "open", "overlap"])
@pytest.mark.parametrize("name", list(CRACKS))
def test_contact_as_with_a_factor(name, start):
    scene = Scene(name)
    direct, engine = scene.direct(), scene.iterative()
    N, measure = scene.lips()
    u0 = direct.solve(scene.f, scene.known)
    exact = active_set(
        N @ direct.solve(N.T.toarray()),
        N @ u0,
        measure,
        scene.stiffness,
        np.ones(len(measure), dtype=bool),
    )
    reference = direct.solve(scene.f + N.T @ exact.pressure, scene.known)
    guess = None if start == "overlap" else np.full(len(measure), start == "closed")
    result = engine.contact(
        ContactRows(N, measure, scene.stiffness, True), scene.f[:, None], scene.known[:, None],
        [guess], u0[:, None] if start == "overlap" else None,
    )[0]  # fmt: skip
    assert np.array_equal(result.active, exact.active)
    assert result.pressure == pytest.approx(
        exact.pressure, rel=0, abs=1e-6 * exact.pressure.max() + 1e-300
    )
    assert scene.displacement_error(result.u, reference) <= 1e-7
    assert np.abs(N @ result.u)[result.active].max(initial=0) <= 1e-15  # round-off
    assert (result.gap[result.active] == 0).all()


def test_a_solution_is_a_perfect_start():
    scene = Scene("two")
    engine = scene.iterative()
    N, measure = scene.lips()
    f, known = scene.f[:, None], scene.known[:, None]
    guess = [np.ones(len(measure), dtype=bool)]
    rows = ContactRows(N, measure, scene.stiffness, True)
    result = engine.contact(rows, f, known, guess)[0]
    before = engine.count.iterations
    again = engine.contact(rows, f, known, [result.active], result.u[:, None])[0]
    assert engine.count.iterations == before
    assert again.sets == 1
    assert scene.displacement_error(again.u, result.u) <= 1e-12


def test_proportional_loads_cost_nothing():
    scene = Scene("inner")
    engine = scene.iterative()
    first = engine.solve(scene.f)
    before = engine.count.iterations
    both = engine.solve(np.stack([scene.f, -0.3 * scene.f], axis=1))
    assert engine.count.iterations == 2 * before
    assert scene.displacement_error(both[:, 1], -0.3 * first) <= 1e-7


def test_levels_serve_the_next_crack():
    scene = Scene("inner")
    engine = scene.iterative()
    again = scene.iterative(levels=engine.hierarchy)
    assert again.hierarchy is engine.hierarchy
    assert np.array_equal(again.solve(scene.f), engine.solve(scene.f))
    other = Scene("inner", supports=[xc.fix("left")])
    assert other.iterative(levels=engine.hierarchy).hierarchy is not engine.hierarchy


def test_standard_block_is_that_of_the_uncracked_body():
    scene = Scene("two")
    engine = scene.iterative()
    A = (engine.basis.T @ scene.model.stiffness @ engine.basis).tocsr()
    n = engine.hierarchy.matrix.shape[0]
    x = np.random.default_rng(3137).normal(size=n) * engine.hierarchy.is_free
    np.testing.assert_allclose(A[:n, :n] @ x, engine.hierarchy.matrix.times(x), atol=1e-13)
    # enriched unknowns of a node: orthonormal, orthogonal to its standard ones
    scale = engine.operator.diagonal[n:]
    assert scale == pytest.approx(scale[0], rel=1e-6)


def test_units_change_nothing():
    steps = []
    for E in (1.0, 2e11):
        scene = Scene("edge", E=E)
        engine = scene.iterative()
        N, measure = scene.lips()
        u = engine.solve(E * scene.f, scene.known)
        engine.contact(
            ContactRows(N, measure, scene.stiffness, True), E * scene.f[:, None],
            scene.known[:, None], [None], u[:, None],
        )  # fmt: skip
        steps.append(engine.count.iterations)
    # the last digits, where the cycle's single precision is felt
    assert abs(steps[0] - steps[1]) <= 12


def test_without_supports():
    """Balanced loads on a body that nothing holds, as with pins, up to a rigid motion."""
    scene = Scene("inner", supports=[])
    pull = [xc.traction("top", (0.0, -1.0)), xc.traction("bottom", (0.0, 1.0))]
    f = total(scene.problem, scene.model, pull)
    motion = free_motion(scene.space, scene.fixed)
    assert motion.modes.shape[1] == 3
    f = balanced_loads(scene.space, motion, f[:, None])[0][:, 0]
    engine = scene.iterative(modes=motion.modes)
    pinned = scene.fixed.copy()
    pinned[motion.pins] = True
    direct = system(scene.space, scene.model.stiffness, pinned, scene.problem.numerics)
    reference = without_motion(motion, direct.solve(f))
    u = without_motion(motion, engine.solve(f))
    assert scene.displacement_error(u, reference) <= 1e-7
    assert engine.count.iterations <= 45
    N, measure = scene.lips()
    exact = active_set(
        N @ direct.solve(N.T.toarray()),
        N @ reference,
        measure,
        scene.stiffness,
        np.ones(len(measure), dtype=bool),
    )
    assert exact.active.any()
    rows = ContactRows(N, measure, scene.stiffness, True)
    result = engine.contact(rows, f[:, None], 0 * f[:, None], [None], u[:, None])[0]
    assert np.array_equal(result.active, exact.active)
    assert result.pressure == pytest.approx(exact.pressure, abs=1e-6 * exact.pressure.max())
    closed = without_motion(motion, direct.solve(f + N.T @ exact.pressure))
    assert scene.displacement_error(without_motion(motion, result.u), closed) <= 1e-7


# 3D bodies ---------------------------------------------------------------------------------


def turning(x, normal):
    return np.stack([0.2 + 0 * x[:, 0], 0 * x[:, 0], -0.2 - x[:, 0]], axis=1)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("supports", [[xc.fix("bottom")], []], ids=["held", "not held"])
def test_a_tilted_penny_as_with_a_factor(supports, order):
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 8 - 2 * order)
    crack = xc.penny_crack((0.01, 0.02, 0.03), (0.3, -0.2, 1.0), 0.5)
    sides = [xc.traction("top", (0.0, 0.0, -1.0)), xc.traction("bottom", (0.0, 0.0, 1.0))]
    loads = [xc.traction("top", turning)] if supports else sides
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], supports, loads, order=order)
    model = build(problem)
    space, fixed = model.space, model.imposed_values.is_fixed
    motion = free_motion(space, fixed)
    f = total(problem, model, loads)
    f = balanced_loads(space, motion, f[:, None])[0][:, 0]
    pinned = fixed.copy()
    pinned[motion.pins] = True
    direct = system(space, model.stiffness, pinned, problem.numerics)
    engine = iterative_system(space, model.stiffness, model.bulk, fixed, modes=motion.modes)
    m = multipliers(space, 0, model.lips[0], "reduced", fixed)
    N = gap_rows(m, model.lips[0], model.jumps[0])
    u0, u = direct.solve(f), engine.solve(f)
    closed = np.ones(len(m.measure), dtype=bool)
    F = N @ direct.solve(N.T.toarray())
    exact = active_set(F, N @ u0, m.measure, 6.0, closed)
    reference = direct.solve(f + N.T @ exact.pressure)
    assert exact.active.any()
    assert exact.active.all() == (not supports)
    rows = ContactRows(N, m.measure, 6.0, True)
    result = engine.contact(rows, f[:, None], 0 * f[:, None], [None], u[:, None])[0]
    assert np.array_equal(result.active, exact.active)
    assert result.pressure == pytest.approx(exact.pressure, abs=1e-6 * exact.pressure.max())
    for one, other in ((u, u0), (result.u, reference)):
        gap = without_motion(motion, one) - without_motion(motion, other)
        size = np.abs(without_motion(motion, other)).max()
        assert np.abs(gap[: 3 * space.n_nodes]).max() <= 1e-7 * size
        assert np.abs(model.jumps[0] @ gap).max() <= 1e-7 * size
    assert engine.count.iterations <= {1: 70, 2: 120}[order]


def exactly(monkeypatch):
    """Iterate far below the default tolerance."""
    plain = iterative.conjugate_gradients_steps
    monkeypatch.setattr(
        iterative, "conjugate_gradients_steps", lambda K, b, y, t: plain(K, b, y, 1e-4 * t)
    )
    monkeypatch.setattr(iterative, "TOLERANCE", 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("supported", [True, False], ids=["held", "not held"])
def test_states_as_with_a_factor(monkeypatch, supported):
    """Open, closed and bent, so that a part is closed: all to 1e-8."""
    exactly(monkeypatch)
    pull = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    problem = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 6), xc.Isotropic(E=1.0, nu=0.3),
        [xc.penny_crack((0.013, -0.021, 0.0317), (0.3, -0.5, 1.0), 0.5)],
        supports=[xc.fix("bottom")] if supported else [], loads=pull[: 2 - supported],
    )  # fmt: skip
    bend = [
        xc.traction("top", lambda x: np.outer(x[:, 0], (0, 0, 1.0))),
        xc.traction("bottom", lambda x: np.outer(x[:, 0], (0, 0, -1.0))),
    ]
    states = [1.0, -1.0, bend[:1] if supported else bend]
    result = [
        xc.solve(replace(problem, numerics=xc.Numerics(linear=linear)), states=states)
        for linear in ("iterative", "direct")
    ]
    closed = []
    for one, other in zip(*result, strict=True):
        n = 3 * one.space.n_nodes
        size = np.abs(other.u[:n]).max()
        assert np.abs(one.u[:n] - other.u[:n]).max() <= 1e-8 * size
        assert one.energy == pytest.approx(other.energy, rel=1e-8)
        wanted = xc.stress_intensity(other).K
        np.testing.assert_allclose(
            xc.stress_intensity(one).K, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max()
        )
        p, q = (s.contact[0].pressure for s in (one, other))
        assert np.abs(p - q).max() <= 1e-8 * max(np.abs(q).max(), 1.0)
        closed.append(other.contact[0].closed.mean())
    assert closed[0] == 0
    assert closed[1] == 1
    assert 0 < closed[2] < 1


def test_cover_of_edges_does_not_hang_on_numbers():
    """Of edges as long as each other but for round-off, the first along the crack is removed."""
    pairs = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    length, place = np.ones(4), np.array([0.1, 0.2, 0.3, 0.4])
    cover = vital_edges(pairs, length, place)
    for k in range(4):
        changed = length + 1e-12 * (np.arange(4) == k)
        assert vital_edges(pairs, changed, place).tolist() == cover.tolist()
    number = np.array([2, 0, 3, 1])
    assert vital_edges(number[pairs], length, place).tolist() == cover.tolist()


# --- states that are solved beside one another: bits as of each alone, multiples for nothing ------


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


def dense_operator(seed, n=30):
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
    K, operator, asked = dense_operator(71)
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
    _, operator, _ = dense_operator(73)
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
    K, operator, _ = dense_operator(76)
    a, b, c = rng.normal(size=(3, 30))
    vectors = [a, 0 * a, -3 * a, b, 1e6 * a + 1e-3 * b, a + 2 * b, a + 1e-7 * c, c]
    assert independent_columns(vectors) == [0, 3, 7]
    solved = [np.linalg.solve(K, v) for v in (a, b)]
    guess, nothing = best_guesses(operator, solved, [a + 2 * b, 0 * a])
    np.testing.assert_allclose(guess, solved[0] + 2 * solved[1], rtol=1e-9)
    assert (nothing == 0).all()
    assert (best_guesses(operator, [], [a])[0] == 0).all()


def solved_block(n=6):
    """Edge crack through a solved_block that is held at its bottom."""
    crack = xc.plane_crack(
        [(-1.5, -1.5, 0.03), (-0.1, -1.5, 0.03), (-0.1, 1.5, 0.03), (-1.5, 1.5, 0.03)]
    )
    numerics = xc.Numerics(linear="iterative")
    return xc.Problem(
        xc.box((-1,) * 3, (1,) * 3, n), xc.Isotropic(2.0, 0.3), [crack],
        supports=[xc.fix("bottom")], numerics=numerics, order=1,
    )  # fmt: skip


def loads_of(stress):
    """Traction on the top, given over x."""
    return [xc.traction("top", lambda x: np.outer(stress(x[:, 0]), (0.1, 0, 1.0)))]


def bending(factor):
    return loads_of(lambda x: factor * (np.sin(x) + 0.45))


@pytest.mark.slow
@pytest.mark.mission
def test_a_state_has_its_bits_whoever_runs_beside_it():
    """Open, half closed and closed states, together, in another order, alone, with threads."""
    problem = solved_block()
    several = [
        loads_of(np.ones_like),
        bending(1.0),
        loads_of(lambda x: -1 - x**2),
        loads_of(lambda x: x + 0.6),
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
    one = xc.solve(solved_block(), states=[bending(1.0)])[0]
    factors = 1.0, 0.3, 2.0
    several = xc.solve(solved_block(), states=[bending(factor) for factor in factors])
    assert 0 < one.contact[0].closed.mean() < 1
    counts = [s.report.operations["iterations"] for s in (one, several[0])]
    assert counts[0] == counts[1]
    assert several[0].u.tobytes() == one.u.tobytes()
    for solution, factor in zip(several, factors):
        assert np.abs(solution.u - factor * one.u).max() <= 1e-12 * np.abs(one.u).max() * factor
        assert (solution.contact[0].closed == one.contact[0].closed).all()
    turned = xc.solve(solved_block(), states=[bending(1.0), bending(-1.0)])
    alone = xc.solve(solved_block(), states=[bending(-1.0)])[0]
    # The residual of the rough first look is scaled from the other state: no bits are the same.
    assert np.abs(turned[1].u - alone.u).max() <= 1e-7 * np.abs(alone.u).max()
