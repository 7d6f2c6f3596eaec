"""Numbers and arrays where they enter: what is taken, and what the refusal says."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from xcrack.base.checks import call_function, number, numbers, whole_number, whole_numbers
from xcrack.base.errors import MeshError, ProblemError


class Hostile:
    def __repr__(self):
        raise RuntimeError("no repr")

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no array")


@pytest.mark.parametrize(
    "value", [2, 2.0, np.float32(2), np.int8(2), np.array(2.0), Fraction(2), np.longdouble(2)]
)
def test_a_number(value):
    result = number(value, "x")
    assert type(result) is float
    assert result == 2.0
    assert whole_number(value, "n") == 2


@pytest.mark.parametrize(
    "value",
    [
        True, np.True_, "2", None, 2j, [2.0], np.array([2.0]), Hostile(), Decimal("nan"), object,
        float, lambda: 2,
    ],
)  # fmt: skip
def test_no_number(value):
    for check in (number, whole_number):
        with pytest.raises(MeshError, match=r"^box: n = .* is not a number: give a .*number"):
            check(value, "box: n", error=MeshError)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 10**400])
def test_not_finite(value):
    with pytest.raises(ProblemError, match="is not possible: give a finite number"):
        number(value, "x")


def test_bounds():
    assert number(1, "x", least=1, most=1) == 1
    for bounds, words in (
        ({"above": 1}, "above 1"),
        ({"below": 1}, "below 1"),
        ({"least": 1.5, "below": 2}, "of at least 1.5 and below 2"),
        ({"most": 0}, "of at most 0"),
    ):
        with pytest.raises(ProblemError, match=rf"x = 1 is not possible: give .*number {words}\."):
            number(1, "x", **bounds)
    with pytest.raises(ProblemError, match="whole number of at least 2"):
        whole_number(1, "n", least=2)
    with pytest.raises(ProblemError, match="whole number of at most 0"):
        whole_number(1, "n", most=0)
    for odd in (2.5, np.nan, np.inf):
        with pytest.raises(ProblemError, match="give a whole number"):
            whole_number(odd, "n")


def test_an_array():
    np.testing.assert_array_equal(numbers([[1, 2]], "x", (None, 2)), [[1.0, 2.0]])
    np.testing.assert_array_equal(numbers([], "x", (0,)), [])
    np.testing.assert_array_equal(numbers(range(3), "x"), [0, 1, 2])
    np.testing.assert_array_equal(whole_numbers([1.0, 2.0], "x", (2,)), [1, 2])
    assert np.isnan(numbers([np.nan], "x", finite=False)).all()
    unmasked = np.ma.array([1.0, 2.0])
    np.testing.assert_array_equal(numbers(unmasked, "x"), [1, 2])


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([[1, 2], [3]], "give an array of real numbers of shape"),
        ("abc", "holds str entries"),
        (["1", "2"], "holds str entries"),
        ([True, False], "holds bool entries"),
        ([1j, 2], "holds complex entries"),
        (None, "holds object entries"),
        ([None, 1.0], "holds object entries"),
        ({1.0, 2.0}, "holds object entries"),
        (lambda x: x, "holds object entries"),
        (Hostile(), "no array"),
        (np.ma.array([[1.0, 2.0]], mask=[[0, 1]]), "masked entries"),
        ([1.0, 2.0], r"has the shape \(2,\): give an array of real numbers of shape \(n, 2\)"),
        ([[1.0, 2.0, 3.0]], r"has the shape \(1, 3\)"),
        ([[1.0, np.nan]], r"points\[0, 1\] = nan"),
        ([[np.inf, 0.0]], r"points\[0, 0\] = inf"),
    ],
)
def test_no_array(value, words):
    with pytest.raises(MeshError, match=words) as caught:
        numbers(value, "points", (None, 2), error=MeshError)
    assert str(caught.value).startswith("points")


@pytest.mark.parametrize("value", [[0.5], [np.nan], [1e300], ["0"], [None]])
def test_no_whole_numbers(value):
    with pytest.raises(ProblemError, match=r"^cells"):
        whole_numbers(value, "cells", (None,))


def test_an_exception_of_a_users_function_keeps_its_type():
    def broken(x):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine") as caught:
        call_function(broken, "the value of traction('top')", 1.0)
    (note,) = caught.value.__notes__
    assert "broken, which xcrack called for the value of traction('top')" in note
    assert call_function(lambda a, b: a + b, "a sum", 1, 2) == 3
