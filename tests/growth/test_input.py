"""What growth refuses, and what it warns of: laws, criteria, options, advances."""

import warnings

import numpy as np
import pytest

from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    ProblemError,
    XcrackWarning,
    elber,
    grow,
    max_hoop_stress,
    measures,
    paris,
    walker,
)

LAW = paris(C=1e-11, m=3.0)
CYCLE = Cycle(0.0, 1.0)


def run(steps):
    """All steps, and what the generator returned."""
    taken = []
    while True:
        try:
            taken.append(next(steps))
        except StopIteration as stop:
            return taken, stop.value


# --- advances, laws, criteria ------------------------------------------------------------------


def test_advance_below_a_tenth_of_a_cell():
    response = formula(mode_I())
    steps = grow(plate(), LAW, max_hoop_stress, CYCLE, da=0.14, response=response)
    next(steps)
    with pytest.raises(ProblemError, match=r"0\.14 at crack 0, tip 0 .* tenth .* size 1\.414"):
        next(steps)


def turning(share):
    """K that turns the path by a third of a degree for each hundredth of K_II / K_I."""

    def K_of(problem, c):
        a = measures(problem.placed[c], problem.mesh).area
        return [[STRESS * np.sqrt(a), share * STRESS * np.sqrt(a)]]

    return K_of


def test_a_kink_within_one_cell_is_warned_of_once():
    """A turn by 25 degrees, and an advance of half the extent of a cell along the path."""
    response = formula(turning(0.25))
    steps = grow(plate(), LAW, max_hoop_stress, CYCLE, da=0.5, max_steps=4, response=response)
    with pytest.warns(XcrackWarning, match=r"below one cell along the path .* -25.* deg") as caught:
        run(steps)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("share", "da"),
    [(0.0, 0.5), (0.05, 0.5), (0.25, 1.36)],
    ids=["straight", "turning by six degrees", "longer than the cell, not than its longest edge"],
)
def test_an_advance_below_one_cell_is_not_warned_of_where_it_does_no_harm(share, da):
    response = formula(turning(share))
    with warnings.catch_warnings():
        warnings.simplefilter("error", XcrackWarning)
        run(grow(plate(), LAW, max_hoop_stress, CYCLE, da=da, max_steps=2, response=response))


def test_advance_that_becomes_too_short_ends_the_run():
    response = formula(mode_I(lambda a: (5.0 / a) ** 8))
    steps = grow(
        plate(), LAW, max_hoop_stress, CYCLE, cycles=1.0 / LAW(STRESS, 0), response=response
    )
    with pytest.warns(XcrackWarning, match="below a tenth"):
        taken, ended = run(steps)
    assert len(taken) == 2
    assert "Take a larger cycles" in ended


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda dK, R: -dK, r"returned da/dN = -.*dK_eq = .*crack 0, tip 0"),
        (lambda dK, R: dK * np.nan, "da/dN = nan"),
        (lambda dK, R: -np.inf * dK, "da/dN = -inf .* return a number >= 0, and inf where"),
        (lambda dK, R: dK + 0j, "complex"),
        (lambda dK, R: "fast", "str"),
        (lambda dK, R: None, "None"),
        (lambda dK, R: 1.0, r"returned shape \(\) for 1 tips"),
    ],
)
def test_bad_law(law, words):
    response = formula(mode_I())
    with pytest.raises(ProblemError, match=words):
        next(grow(plate(), law, max_hoop_stress, CYCLE, da=2.0, response=response))


@pytest.mark.parametrize(
    ("criterion", "words"),
    [
        (lambda K, nu: 1.0, "three arrays"),
        (lambda K, nu: (K[0, :, 0], K[0, :, 0]), "three arrays"),
        (lambda K, nu: (K[0, :, 0] * np.nan, K[0, :, 0], K[0, :, 0]), r"angle\[0\] = nan"),
        (lambda K, nu: (K[0, :, 0], K[0], K[0, :, 0]), r"dK_eq has the shape \(1, 2\)"),
        (lambda K, nu: (70.5 + K[0, :, 0], K[1, :, 0], K[0, :, 0]), "angle 70.5 .* rad"),
        (lambda K, nu: (-np.pi + K[0, :, 0], K[1, :, 0], K[0, :, 0]), "angle -3.14159 .* rad"),
        (lambda K, nu: "one", "three arrays"),
        (lambda K, nu: (0 * K[0, :, 0], -K[1, :, 0], K[0, :, 0]), "negative range"),
    ],
)
def test_bad_criterion(criterion, words):
    response = formula(mode_I())
    with pytest.raises(ProblemError, match=words):
        next(grow(plate(), LAW, criterion, CYCLE, da=2.0, response=response))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "needs da"),
        ({"da": 0.0}, r"grow: da = 0\.0 .* a finite number above 0"),
        ({"da": np.nan}, "da = nan"),
        ({"cycles": -1}, "cycles = -1"),
        ({"da": 1.0, "max_steps": 0}, "max_steps = 0"),
        ({"da": 1.0, "threshold": -1.0}, "threshold"),
        ({"da": 1.0, "scaling": "square"}, "scaling = 'square'"),
        ({"da": 1.0, "K_c": 0.0}, "K_c"),
    ],
)
def test_bad_options_fail_before_anything_is_computed(options, words):
    with pytest.raises(ProblemError, match=words):
        grow(plate(), LAW, max_hoop_stress, CYCLE, **options)


def test_bad_arguments():
    with pytest.raises(ProblemError, match="law = 3 cannot be called"):
        grow(plate(), 3, max_hoop_stress, CYCLE, da=1.0)
    with pytest.raises(ProblemError, match="cycle ="):
        grow(plate(), LAW, max_hoop_stress, (0, 1), da=1.0)
    with pytest.raises(ProblemError, match="no crack"):
        grow(plate([]), LAW, max_hoop_stress, CYCLE, da=1.0)
    with pytest.raises(ProblemError, match="give a Problem"):
        grow("scene", LAW, max_hoop_stress, CYCLE, da=1.0)
    with pytest.raises(ProblemError, match="solver = 'lu' cannot be called"):
        grow(plate(), LAW, max_hoop_stress, CYCLE, da=1.0, solver="lu")
    with pytest.raises(ProblemError, match="progress = 'often'"):
        grow(plate(), LAW, max_hoop_stress, CYCLE, da=1.0, progress="often")


def test_what_a_law_or_a_criterion_raises_names_where_it_was_called():
    def broken(*arguments):
        raise ZeroDivisionError("mine")

    response = formula(mode_I())
    for law, criterion, words in (
        (broken, max_hoop_stress, "the growth rates of crack 0"),
        (LAW, broken, "the directions of crack 0"),
    ):
        with pytest.raises(ZeroDivisionError, match="mine") as caught:
            next(grow(plate(), law, criterion, CYCLE, da=2.0, response=response))
        assert any(words in note for note in caught.value.__notes__)


def test_a_law_may_change_the_arrays_it_gets():
    def careless(dK, R):
        dK -= 1.0
        dK[dK < 0] = 0.0
        return 1e-11 * dK**3

    response = formula(mode_I())
    step = next(grow(plate(), careless, max_hoop_stress, CYCLE, da=2.0, response=response))
    assert step.dK_eq[0][0] == pytest.approx(STRESS * np.sqrt(np.pi * 5.0), rel=1e-12)


# --- the toughness, as a law says it -------------------------------------------------------------


def forman(dK, R, K_c=600.0):
    """Forman's law; inf where the toughness is reached."""
    left = (1 - R) * K_c - dK
    return np.where(left > 0, 1e-9 * dK**3 / np.where(left > 0, left, 1.0), np.inf)


def test_a_law_without_a_finite_rate_ends_the_run():
    """K_c between the lengths 11 and 13: the last step is where it is reached, its advance 0."""
    response = formula(mode_I())
    steps, ended = run(grow(plate(), forman, max_hoop_stress, CYCLE, da=2.0, response=response))
    assert ended.startswith("K_c reached: the law returned da/dN = inf for dK_eq = 600.0")
    assert "crack 0, tip 0 at (11.46" in ended
    last, before = steps[-1], steps[-2]
    assert np.isinf(last.rate[0][0])
    assert last.da[0][0] == 0
    # 1/rate falls to 0 in proportion to the length: half of what the rate before gives
    way = last.cracks[0].points[-1, 0] - before.cracks[0].points[-1, 0]
    assert last.cycles - before.cycles == pytest.approx(0.5 * way / before.rate[0][0], rel=1e-6)


def test_a_first_step_beyond_the_toughness():
    response = formula(mode_I())
    law = lambda dK, R: forman(dK, R, 10.0)  # noqa: E731
    steps, ended = run(grow(plate(), law, max_hoop_stress, CYCLE, da=2.0, response=response))
    assert (len(steps), steps[0].cycles) == (1, 0)
    assert ended.startswith("K_c reached")


# --- R below 0 -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "cycle", "warned"),
    [
        (elber(1e-11, 3.0, 0.5, 0.4), Cycle(-1.0, 1.0), True),
        (walker(1e-11, 3.0, 0.5), Cycle(states=[0.5, -2.0, 1.0]), True),
        (forman, Cycle(-0.1, 1.0), True),
        (elber(1e-11, 3.0, 0.5, 0.4), Cycle(0.0, 1.0), False),
        (walker(1e-11, 3.0, 1.0), Cycle(-1.0, 1.0), False),  # gamma = 1: the law of Paris
        (paris(1e-11, 3.0), Cycle(-1.0, 1.0), False),
    ],
    ids=["elber", "walker", "own", "R = 0", "walker as paris", "paris"],
)
def test_a_negative_ratio_is_warned_of_where_the_law_depends_on_it(law, cycle, warned):
    response = formula(lambda problem, c: [[100.0, 0.0]])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        next(grow(plate(), law, max_hoop_stress, cycle, da=2.0, response=response))
    texts = [str(w.message) for w in caught if "the cycle has R = -" in str(w.message)]
    assert len(texts) == warned


# --- warnings that come again --------------------------------------------------------------------


def test_a_warning_that_comes_once_is_not_in_the_summary():
    """R < 0 is warned of at first, K_I < 0 of the state -1 in each step."""
    response = formula(mode_I())
    law, cycle = elber(1e-11, 3.0, 0.5, 0.4), Cycle(-1, 1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run(grow(plate(), law, max_hoop_stress, cycle, 2.0, max_steps=3, response=response))
    first, second, summary = (str(w.message) for w in caught)
    assert first.startswith("K_I < 0 in 1 of 2 values")
    assert second.startswith("the cycle has R = -1")
    assert "K_I < 0" in summary
    assert "the cycle has R" not in summary


def test_a_kind_that_is_ignored_is_not_in_the_summary():
    response = formula(mode_I())
    law, cycle = elber(1e-11, 3.0, 0.5, 0.4), Cycle(-1, 1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", "K_I < 0", XcrackWarning)
        run(grow(plate(), law, max_hoop_stress, cycle, 2.0, max_steps=3, response=response))
    assert [str(w.message)[:19] for w in caught] == ["the cycle has R = -"]
