"""Drawn pairs of pennies and ellipses: a handful of those of `benchmarks/drawn.py`."""

import pytest

import xcrack as xc
from support import drawn_pairs

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")]


def test_kinds_of_pairs():
    """By the line in which both planes meet."""
    large = xc.penny_crack((0, 0, 0), (0, 0, 1), 0.6)

    def kind(centre, radius=0.3):
        return drawn_pairs.kind_of(large, xc.penny_crack(centre, (1, 0, 0), radius))

    assert kind((0, 0, 0)) == "cut through"
    assert kind((0, 0.5, 0)) == "interlocked"
    assert kind((0, 0, 0.35)) == "apart"
    assert kind((0, 1.0, 0)) == "apart"
    assert kind((0, 0, 0), 0.7) == "cuts through"


@pytest.mark.parametrize("seed", [2, 4, 7])
def test_a_drawn_pair_is_solved(seed):
    """No K that is nan, and more energy than a penny inside one of them has (see there)."""
    row = drawn_pairs.pair_row(seed)
    assert row["K is nan"] == 0


def test_interlocked_pairs_are_refused_with_the_remedy():
    one = xc.penny_crack((0.01, 0, 0.02), (0, 0, 1), 0.5)
    other = xc.penny_crack((0.01, 0.45, 0.02), (1, 0, 0), 0.3)
    mesh = xc.box((-1,) * 3, (1,) * 3, 10)
    with pytest.raises(xc.XcrackError, match=r"end (one of them|it) a few cells before"):
        drawn_pairs.solved(drawn_pairs.given_as("interlocked", one, other), mesh)
