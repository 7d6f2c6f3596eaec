"""Contact by projected conjugate gradients, against the dense active set and a direct solver."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import xcrack as xc
from support import scenes_2d as scenes
from xcrack import ConvergenceError
from xcrack.analysis.multipliers import gap_rows, multipliers
from xcrack.analysis.solve import build
from xcrack.fem.loads import load_vector
from xcrack.linalg import iterative
from xcrack.linalg.active_set import active_set
from xcrack.linalg.direct import system
from xcrack.linalg.engine import ContactRows
from xcrack.linalg.iterative import iterative_system
from xcrack.linalg.projected_cg import (
    Operator,
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


# A set that plain corrections leave and return to (the one of test_active_set).
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
