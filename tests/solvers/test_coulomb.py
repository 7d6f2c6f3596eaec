"""Drawn dense problems of contact with friction: the conditions hold in what is returned."""

import numpy as np
import pytest

from xcrack.linalg.coulomb import FrictionRows, Status, all_stuck, coulomb, coulomb_3d
from xcrack.linalg.coulomb import _sweep_functions as swept


def drawn(seed, g=12, part=1.0, mu=None):
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


def check(rows, d, state):
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
        rows, d = drawn(seed + 555, part=part)
        check(rows, d, coulomb(rows, d, all_stuck(rows)))


def test_any_first_guess_gives_the_same_tractions_at_small_friction():
    """Where friction is small there is one solution (Nečas, Jarušek and Haslinger, 1980)."""
    for seed in range(20):
        rows, d = drawn(seed + 911, mu=0.1)
        first = coulomb(rows, d, all_stuck(rows)).lam
        rng = np.random.default_rng(seed)
        start = Status(rng.random(rows.n) < 0.5, rng.integers(-1, 2, len(rows.mu)))
        assert np.allclose(coulomb(rows, d, start).lam, first, atol=1e-9 * np.abs(first).max())


def test_sweeps_alone_converge_to_the_same():
    for seed in range(5):
        rows, d = drawn(seed + 313, g=6, mu=0.2)
        lam = swept(rows, d, np.zeros(len(d)), 400)
        expected = coulomb(rows, d, all_stuck(rows)).lam
        assert np.allclose(lam, expected, atol=1e-6 * np.abs(expected).max())


def test_redundant_functions_share():
    """Two functions that are one: tractions are not unique, gaps are."""
    rows, d = drawn(71, g=4, mu=0.5)
    twice = np.array([0, 1, 2, 3, 3, 4, 5, 6, 7, 7])
    double = FrictionRows(
        rows.F[np.ix_(twice, twice)], rows.measure[twice[:5]], np.arange(5), np.full(5, 0.5), 1.0
    )
    one, two = coulomb(rows, d, all_stuck(rows)), coulomb(double, d[twice], all_stuck(double))
    assert np.allclose(two.gap, one.gap[twice], atol=1e-7 * np.abs(d).max())


def test_nothing_presses():
    rows, d = drawn(72)
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
