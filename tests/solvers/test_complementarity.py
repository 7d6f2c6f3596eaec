"""Dense problems of contact without and with friction: conditions hold, other ways agree."""

import itertools

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from xcrack import ConvergenceError
from xcrack.linalg.active_set import active_set
from xcrack.linalg.coulomb import FrictionRows, Status, all_stuck, coulomb, coulomb_3d
from xcrack.linalg.coulomb import _sweep_functions as swept


def solve(F, d, start=True, measure=None, stiffness=1.0):
    F, d = np.asarray(F, dtype=float), np.asarray(d, dtype=float)
    measure = np.ones(len(d)) if measure is None else measure
    return active_set(F, d, measure, stiffness, np.full(len(d), start))


def by_enumeration(F, d):
    """Pressure by trying every set: the only one that satisfies all conditions."""
    n = len(d)
    for pattern in itertools.product([False, True], repeat=n):
        active, p = np.array(pattern), np.zeros(n)
        if active.any():
            p[active] = np.linalg.solve(F[np.ix_(active, active)], -d[active])
        if (p >= -1e-12).all() and (F @ p + d >= -1e-12)[~active].all():
            return p
    raise AssertionError("no set fits")


def by_least_squares(F, d):
    """Minimum of p F p / 2 + d p over p >= 0 by SciPy."""
    root = np.linalg.cholesky(F).T
    return scipy.optimize.nnls(root, -np.linalg.solve(root.T, d))[0]


def drawn(seed, n, rank=None):
    """A symmetric positive matrix and weak gaps of both signs."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, rank or n + 2))
    return A @ A.T, rng.normal(size=n)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 7), start=st.booleans())
@settings(max_examples=150, deadline=None, derandomize=True)
def test_against_enumeration(seed, n, start):
    F, d = drawn(seed, n)
    result = solve(F, d, start)
    exact = by_enumeration(F, d)
    scale = 1 + np.abs(exact).max()
    # round-off, times the condition number of a small drawn matrix
    assert np.abs(result.pressure - exact).max() <= 1e-8 * scale
    assert result.pressure.min() >= 0
    assert result.gap.min() >= -1e-8 * np.abs(d).max()
    assert np.abs(result.pressure * result.gap).max() <= 1e-8 * scale * np.abs(d).max()


@pytest.mark.parametrize("n", [20, 60])
@pytest.mark.parametrize("start", [True, False])
def test_against_non_negative_least_squares(n, start):
    """Round-off on matrices like those of crack faces: neighbours move together."""
    for seed in range(810, 814):
        x = np.sort(np.random.default_rng(seed).uniform(0, 1, n))
        F = np.exp(-8 * np.abs(x[:, None] - x)) + 0.05 * np.eye(n)
        d = np.cos(9 * x + seed)
        result = solve(F, d, start)
        assert (
            np.abs(result.pressure - by_least_squares(F, d)).max() <= 1e-9 * result.pressure.max()
        )
        assert result.sets <= 12
        assert not result.fallback


# A set that the plain iteration leaves and returns to (found by a search over small integers).
CYCLING = [[11.0, 13.0, -10.0], [13.0, 18.0, -15.0], [-10.0, -15.0, 15.0]], [-1.0, -4.0, 4.0]


def test_a_cycle_ends_in_the_fallback():
    F, d = np.array(CYCLING[0]), np.array(CYCLING[1])
    result = solve(F, d)
    assert result.fallback
    assert result.sets <= 8
    assert result.pressure == pytest.approx([0, 2 / 9, 0], abs=1e-12)  # round-off
    assert result.gap == pytest.approx([17 / 9, 0, 2 / 3], abs=1e-12)
    assert result.active.tolist() == [False, True, False]


def test_start_does_not_matter():
    for seed in range(830, 860):
        F, d = drawn(seed, 6)
        every = [
            active_set(F, d, np.ones(6), 1.0, np.array(start))
            for start in itertools.product([False, True], repeat=6)
        ]
        for result in every:
            assert np.abs(result.pressure - every[0].pressure).max() <= 1e-9 * (
                1 + every[0].pressure.max()
            )


@pytest.mark.parametrize("stiffness", [1e-6, 1e-3, 1.0, 1e3, 1e9])
def test_weight_of_gaps_changes_nothing(stiffness):
    F, d = drawn(871, 12)
    reference = solve(F, d)
    result = solve(F, d, stiffness=stiffness)
    assert np.array_equal(result.active, reference.active)
    assert result.sets == reference.sets


def test_units_change_nothing_but_units():
    F, d = drawn(873, 9)
    reference = solve(F, d)
    for length, stress in ((1e-9, 1e9), (1e3, 1e-6)):
        measure = np.full(9, length)
        scaled = F * length**3 / stress
        result = solve(scaled, d * length**2, measure=measure, stiffness=stress / length)
        assert np.array_equal(result.active, reference.active)
        assert result.pressure * length / stress == pytest.approx(reference.pressure, rel=1e-9)


def test_groups_of_very_different_size():
    """A sliver's group beside others: rows scale with the size of their function."""
    F, d = drawn(877, 8)
    reference = solve(F, d)
    size = 10.0 ** np.array([0, -3, -6, -9, -12, 0, -2, -14])
    result = solve(F * size[:, None] * size, d * size, measure=size)
    assert np.array_equal(result.active, reference.active)
    assert result.pressure * size == pytest.approx(reference.pressure, rel=1e-8, abs=1e-12)


def test_wide_open_and_wholly_closed():
    F, _ = drawn(881, 5)
    for start in (True, False):
        is_open = solve(F, np.ones(5), start)
        assert is_open.pressure.max() == 0
        assert not is_open.active.any()
        closed = solve(F, -F @ np.arange(1.0, 6.0), start)
        assert closed.pressure == pytest.approx(np.arange(1.0, 6.0), rel=1e-9)  # round-off
        assert closed.active.all()
        assert closed.gap.max() == 0


def test_one_group_and_none():
    assert solve([[2.0]], [-3.0]).pressure == pytest.approx([1.5])
    assert solve([[2.0]], [3.0], start=True).pressure == pytest.approx([0.0])
    assert len(solve(np.zeros((0, 0)), np.zeros(0)).pressure) == 0


@pytest.mark.parametrize("start", [True, False])
def test_neither_pressure_nor_gap(start):
    """d = 0, or of round-off: any set is right, and the pressure is nothing."""
    F, _ = drawn(883, 6)
    assert solve(F, np.zeros(6), start).pressure.max() == 0
    noise = 1e-16 * np.random.default_rng(5).normal(size=6)
    result = solve(F, noise, start)
    assert 0 <= result.pressure.max() <= 1e-12
    assert result.sets <= 30


@pytest.mark.parametrize("start", [True, False])
def test_groups_that_touch(start):
    """Groups whose pressure and gap are both zero, but for round-off, do not let the set hunt."""
    F, _ = drawn(887, 6)
    pressure = np.array([2.0, 0.0, 1.0, 0.0, 3.0, 0.0])
    for seed in range(10):
        noise = 1e-15 * np.random.default_rng(seed).normal(size=6)
        result = solve(F, -F @ pressure + noise, start)
        assert result.pressure == pytest.approx(pressure, abs=1e-12)  # round-off
        assert result.sets <= 10


@pytest.mark.parametrize("start", [True, False])
def test_redundant_groups(start):
    """Two groups with one and the same row share its pressure: the least one is taken."""
    F, d = drawn(891, 4)
    twice = np.array([0, 1, 2, 3, 3])
    d[3] = -abs(d[3]) - 3
    reference = solve(F, d, start)
    result = solve(F[np.ix_(twice, twice)], d[twice], start)
    assert reference.pressure[3] > 0
    assert result.pressure[3] == pytest.approx(result.pressure[4], rel=1e-6)
    assert result.pressure[3] + result.pressure[4] == pytest.approx(reference.pressure[3], rel=1e-6)
    assert result.pressure[:3] == pytest.approx(reference.pressure[:3], rel=1e-6, abs=1e-9)


def test_lips_that_supports_press_into_each_other():
    """A group that nothing free can move, pressed shut by the supports: no pressure opens it."""
    F, d = drawn(893, 4)
    F[3], F[:, 3], d[3] = 0, 0, -1.0
    with pytest.raises(ConvergenceError, match="smallest gap of -1"):
        solve(F, d, False)


# --- drawn dense problems of contact with friction: the conditions hold in what is returned -------


def drawn_rows(seed, g=12, part=1.0, mu=None):
    """A positive problem whose functions couple to their neighbours, and its loads."""
    rng = np.random.default_rng(seed)
    rubbing = np.nonzero(rng.random(g) < part)[0]
    n = g + len(rubbing)
    A = rng.normal(size=(n, 3 * n)) / np.sqrt(3 * n)
    size = 10 ** rng.uniform(-2, 0, g)
    scale = np.concatenate([size, size[rubbing]])
    F = scale[:, None] * (A @ A.T) * scale
    coefficients = np.full(len(rubbing), mu) if mu else rng.choice([0.1, 0.3, 1.0], len(rubbing))
    return FrictionRows(F, size, rubbing, coefficients, 1.0), scale * rng.normal(size=n)


def check_rows(rows, d, state):
    g, lam, gap = rows.n, state.lam, state.gap
    assert np.allclose(gap, rows.F @ lam + d, atol=1e-9 * np.abs(d).max())
    pressure, shear, slip = lam[:g], lam[g:], gap[g:]
    largest = np.abs(lam).max(initial=0.0)
    assert pressure.min() >= 0
    assert gap[:g].min() >= -1e-9 * np.abs(d).max()
    assert np.abs(pressure * gap[:g]).max() <= 1e-12 * largest
    bound = rows.mu * pressure[rows.rubbing_rows]
    assert (np.abs(shear) <= bound + 1e-11 * largest).all()
    slides = np.abs(slip) > 1e-10 * np.abs(d).max()
    # What slides bears all that friction can, against the slip.
    assert np.abs(shear + bound * np.sign(slip))[slides].max(initial=0.0) <= 1e-11 * largest


@pytest.mark.parametrize("part", [1.0, 0.6])
def test_drawn_problems(part):
    for seed in range(100):
        rows, d = drawn_rows(seed + 555, part=part)
        check_rows(rows, d, coulomb(rows, d, all_stuck(rows)))


def test_any_first_guess_gives_the_same_tractions_at_small_friction():
    """Where friction is small there is one solution (Nečas, Jarušek and Haslinger, 1980)."""
    for seed in range(20):
        rows, d = drawn_rows(seed + 911, mu=0.1)
        first = coulomb(rows, d, all_stuck(rows)).lam
        rng = np.random.default_rng(seed)
        start = Status(rng.random(rows.n) < 0.5, rng.integers(-1, 2, len(rows.mu)))
        assert np.allclose(coulomb(rows, d, start).lam, first, atol=1e-9 * np.abs(first).max())


def test_sweeps_alone_converge_to_the_same():
    for seed in range(5):
        rows, d = drawn_rows(seed + 313, g=6, mu=0.2)
        lam = swept(rows, d, np.zeros(len(d)), 400)
        expected = coulomb(rows, d, all_stuck(rows)).lam
        assert np.allclose(lam, expected, atol=1e-6 * np.abs(expected).max())


def test_redundant_functions_share():
    """Two functions that are one: tractions are not unique, gaps are."""
    rows, d = drawn_rows(71, g=4, mu=0.5)
    twice = np.array([0, 1, 2, 3, 3, 4, 5, 6, 7, 7])
    double = FrictionRows(
        rows.F[np.ix_(twice, twice)], rows.measure[twice[:5]], np.arange(5), np.full(5, 0.5), 1.0
    )
    one, two = coulomb(rows, d, all_stuck(rows)), coulomb(double, d[twice], all_stuck(double))
    assert np.allclose(two.gap, one.gap[twice], atol=1e-7 * np.abs(d).max())


def test_nothing_presses():
    rows, d = drawn_rows(72)
    state = coulomb(rows, np.abs(d), all_stuck(rows))
    assert not state.status.is_closed.any() or state.lam[: rows.n].min() >= 0


# Two tangents ------------------------------------------------------------------------------------


def drawn_3d(seed, g=10):
    rng = np.random.default_rng(seed)
    A_ = rng.normal(size=(3 * g, 9 * g)) / np.sqrt(9 * g)
    size = 10 ** rng.uniform(-1, 0, g)
    scale = np.tile(size, 3)
    rows = FrictionRows(
        scale[:, None] * (A_ @ A_.T) * scale,
        size,
        np.arange(g),
        rng.choice([0.1, 0.3, 1.0], g),
        1.0,
    )
    return rows, scale * rng.normal(size=3 * g)


def test_drawn_problems_in_3d():
    for seed in range(60):
        rows, d = drawn_3d(seed + 808)
        state = coulomb_3d(rows, d, all_stuck(rows))
        g, largest = rows.n, np.abs(state.lam).max()
        shear, slip = state.lam[g:].reshape(2, -1), state.gap[g:].reshape(2, -1)
        bound = rows.mu * state.lam[:g]
        assert state.lam[:g].min() >= -1e-12 * largest
        assert state.gap[:g].min() >= -1e-9 * np.abs(d).max()
        assert (np.linalg.norm(shear, axis=0) <= bound + 1e-7 * largest).all()
        size = np.linalg.norm(slip, axis=0)
        slides = size > 1e-7 * np.abs(d).max()
        opposed = shear + bound * slip / np.where(slides, size, 1.0)
        assert np.abs(opposed[:, slides]).max(initial=0.0) <= 1e-6 * largest


def test_one_tangent_is_the_problem_of_2d():
    for seed in range(20):
        rows, d = drawn_3d(seed + 202)
        g = rows.n
        F = rows.F.copy()
        F[: 2 * g, 2 * g :] = F[2 * g :, : 2 * g] = 0.0
        d[2 * g :] = 0.0
        three = FrictionRows(F, rows.measure, rows.rubbing_rows, rows.mu, 1.0)
        two = FrictionRows(F[: 2 * g, : 2 * g], rows.measure, rows.rubbing_rows, rows.mu, 1.0)
        expected = coulomb(two, d[: 2 * g], all_stuck(two)).lam
        lam = coulomb_3d(three, d, all_stuck(three)).lam
        assert np.abs(lam[: 2 * g] - expected).max() <= 1e-7 * np.abs(expected).max()
        assert np.abs(lam[2 * g :]).max() <= 1e-9 * np.abs(expected).max()
