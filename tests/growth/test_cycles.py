"""Cycles between two states: exact for power laws, second order else."""

import numpy as np
import pytest
from scipy.integrate import quad

from support import exact
from xcrack import ProblemError, cycles_between


@pytest.mark.parametrize("g", [-1.5, 0.0, 0.5, 1.0, 1 + 1e-13, 1 - 1e-9, 1.5, 2.0, 4.0])
def test_exact_for_a_power_law(g):
    """Any step is exact to round-off, through g = 1 without a jump."""
    a0, a1 = 0.7, 3.1
    expected, _ = quad(lambda a: 1 / (2e-4 * a**g), a0, a1, epsabs=0, epsrel=1e-13)
    assert cycles_between(a0, a1, 2e-4 * a0**g, 2e-4 * a1**g) == pytest.approx(expected, rel=1e-12)


def test_very_short_steps_keep_their_digits():
    da = 1e-12
    N = cycles_between(1.0, 1.0 + da, 1e-3, 1e-3 * (1 + 3 * da))
    assert N == pytest.approx(((1.0 + da) - 1.0) / 1e-3, rel=1e-11)
    assert cycles_between(1.0, 1.0, 1e-3, 1e-3) == 0


@pytest.mark.parametrize("m", [2, 3, 4])
def test_paris_in_one_step(m):
    """K = stress √(π a) makes the rate a power of a; m = 2 is the logarithm."""

    def rate(a):
        return 1e-11 * (100 * np.sqrt(np.pi * a)) ** m

    N = cycles_between(1e-3, 1e-2, rate(1e-3), rate(1e-2))
    assert N == pytest.approx(exact.paris_life(1e-3, 1e-2, 1e-11, m, 100), rel=1e-12)


def tangent_row(n):
    """Relative errors of four rules with n equal steps; K ~ √(W tan(π a/W)), m = 3, a 5 to 35."""

    def rate(a):
        return np.tan(np.pi * np.asarray(a) / 90.0) ** 1.5

    N, _ = quad(lambda a: 1 / rate(a), 5, 35, epsabs=0, epsrel=1e-12)
    a = np.linspace(5, 35, n + 1)
    r, d = rate(a), np.diff(a)
    rules = {
        "euler": (d / r[:-1]).sum(),
        "trapezoid": (d * (1 / r[:-1] + 1 / r[1:]) / 2).sum(),
        "midpoint": (d / rate(a[:-1] + d / 2)).sum(),
        "power law": cycles_between(a[:-1], a[1:], r[:-1], r[1:]).sum(),
    }
    return {name: value / N - 1 for name, value in rules.items()}


def test_rule_is_second_order_and_good_to_three_per_mille_in_ten_steps():
    steps = [10, 20, 40, 80]
    table = {n: tangent_row(n) for n in steps}
    for n, row in table.items():
        print(n, {name: f"{100 * value:+.3f} %" for name, value in row.items()})
    assert abs(table[10]["power law"]) <= 3e-3
    assert 0.28 < table[10]["euler"] < 0.35  # what it replaces
    for name, order in (("euler", 1), ("trapezoid", 2), ("midpoint", 2), ("power law", 2)):
        seen = np.log2(table[40][name] / table[80][name])
        assert seen == pytest.approx(order, abs=0.1)
    assert abs(table[10]["power law"]) < 0.2 * abs(table[10]["midpoint"])


def test_forward_rule_is_of_first_order():
    """What it replaces: still above a per cent at fifty steps."""
    rows = [tangent_row(n)["euler"] for n in (50, 100)]
    assert np.log2(rows[0] / rows[1]) >= 0.9
    assert rows[0] > 0.01


def test_a_rate_that_falls_to_zero():
    """The rate falls in proportion to the cycles: twice the time of the first rate."""
    assert cycles_between(1.0, 1.5, 1e-3, 0.0) == pytest.approx(1000.0)


def test_arrays_are_taken_point_by_point():
    a0, a1 = np.array([1.0, 2.0, 5.0]), np.array([1.5, 2.5, 5.0])
    r0, r1 = np.array([1e-3, 1e-4, 1.0]), np.array([2e-3, 1e-4, 1.0])
    N = cycles_between(a0, a1, r0, r1)
    assert N.shape == (3,)
    for i in range(3):
        assert N[i] == cycles_between(a0[i], a1[i], r0[i], r1[i])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((2.0, 1.0, 1.0, 1.0), "not shrink"),
        ((0.0, 1.0, 1.0, 1.0), "positive"),
        ((1.0, 2.0, 0.0, 1.0), "growth rates"),
        ((1.0, 2.0, 1.0, -1.0), "growth rates"),
        ((1.0, 2.0, np.nan, 1.0), "growth rate rate0 = nan"),
        ((1.0, 2.0, 1.0, np.nan), "growth rates"),
        ((1.0, 2.0, np.inf, 1.0), "rate0 = inf"),
        (("one", 2.0, 1.0, 1.0), "crack length a0 = 'one'"),
        (([1.0, 2.0], [2.0, 3.0, 4.0], 1.0, 1.0), r"shapes \(2,\), \(3,\)"),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(ProblemError, match=words):
        cycles_between(*arguments)


def test_a_rate_that_becomes_infinite():
    """1/rate falls to 0 with the length: the triangle under it, and a fine division of it."""
    assert cycles_between(1.0, 2.0, 1e-3, np.inf) == 500.0
    rate = 1e-3 / np.maximum(2.0 - (a := np.linspace(1.0, 2.0, 2001)), 0.0).clip(1e-300)
    rate[-1] = np.inf
    assert cycles_between(a[:-1], a[1:], rate[:-1], rate[1:]).sum() == pytest.approx(500, rel=1e-4)
