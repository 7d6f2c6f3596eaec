"""Numbers and arrays where they enter, and declared rules: what is taken, what a refusal says."""

import inspect
import math
import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import xcrack as xc
from fuzz.entry import Argument
from fuzz.kinds import NONSENSE, VALID
from fuzz.run import TABLE
from xcrack import MeshError, ProblemError
from xcrack.base import arguments as rules


def checked(rule, value):
    return rule.check(value, "x", ProblemError)


class Hostile:
    def __repr__(self):
        raise RuntimeError("no repr")

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no array")


@pytest.mark.parametrize(
    "value", [2, 2.0, np.float32(2), np.int8(2), np.array(2.0), Fraction(2), np.longdouble(2)]
)
def test_a_number(value):
    result = checked(rules.Number(), value)
    assert type(result) is float
    assert result == 2.0
    assert checked(rules.Whole(), value) == 2


@pytest.mark.parametrize(
    "value",
    [
        True, np.True_, "2", None, 2j, [2.0], np.array([2.0]), Hostile(), Decimal("nan"), object,
        float, lambda: 2,
    ],
)  # fmt: skip
def test_no_number(value):
    for rule in (rules.Number(), rules.Whole()):
        with pytest.raises(MeshError, match=r"^box: n = .* is not a number: give a .*number"):
            rule.check(value, "box: n", MeshError)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 10**400])
def test_not_finite(value):
    with pytest.raises(ProblemError, match="is not possible: give a finite number"):
        checked(rules.Number(), value)


def test_bounds():
    assert checked(rules.Number(least=1, most=1), 1) == 1
    for bounds, words in (
        ({"above": 1}, "above 1"),
        ({"below": 1}, "below 1"),
        ({"least": 1.5, "below": 2}, "of at least 1.5 and below 2"),
        ({"most": 0}, "of at most 0"),
    ):
        with pytest.raises(ProblemError, match=rf"x = 1 is not possible: give .*number {words}\."):
            checked(rules.Number(**bounds), 1)
    with pytest.raises(ProblemError, match="whole number of at least 2"):
        checked(rules.Whole(least=2), 1)
    with pytest.raises(ProblemError, match="whole number of at most 0"):
        checked(rules.Whole(most=0), 1)
    for odd in (2.5, np.nan, np.inf):
        with pytest.raises(ProblemError, match="give a whole number"):
            checked(rules.Whole(), odd)


def test_an_array():
    np.testing.assert_array_equal(checked(rules.Array((None, 2)), [[1, 2]]), [[1.0, 2.0]])
    np.testing.assert_array_equal(checked(rules.Array((0,)), []), [])
    np.testing.assert_array_equal(checked(rules.Array(), range(3)), [0, 1, 2])
    np.testing.assert_array_equal(checked(rules.Array((2,), is_whole=True), [1.0, 2.0]), [1, 2])
    unmasked = np.ma.array([1.0, 2.0])
    np.testing.assert_array_equal(checked(rules.Array(), unmasked), [1, 2])


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
        rules.Array((None, 2)).check(value, "points", MeshError)
    assert str(caught.value).startswith("points")


@pytest.mark.parametrize("value", [[0.5], [np.nan], [1e300], ["0"], [None]])
def test_no_whole_numbers(value):
    with pytest.raises(ProblemError, match=r"^cells"):
        rules.Array((None,), is_whole=True).check(value, "cells", ProblemError)


def test_an_exception_of_a_users_function_keeps_its_type():
    def broken(x):
        raise ZeroDivisionError("mine")

    body = xc.Problem(
        xc.box((0, 0), (1, 1), 2), xc.Isotropic(1.0, 0.3, "strain"), supports=[xc.fix("bottom")],
        loads=[xc.traction("top", broken)],
    )  # fmt: skip
    with pytest.raises(ZeroDivisionError, match="mine") as caught:
        xc.solve(body)
    (note,) = caught.value.__notes__
    assert "broken, which xcrack called for the value of traction('top')" in note


# --- declared rules: who has them, what they refuse, and that the table of drawn inputs agrees ----

# Whether these fit depends on another argument, and is looked at in the function.
_BY_ANOTHER = {
    "crack",  # of which there are as many as the problem has
    "field",  # of a picture, by the dimension of the body
    "pieces", "knees",  # of a law, by each other
    "states",  # whose order counts with friction
    "da",  # of `grow`, to which `run` hands it
}  # fmt: skip
_HOUSES_TO_COME = ("growth", "runs")  # still check by hand


def declared():
    """Public functions and classes with the rules of their arguments."""
    for name in xc.__all__:
        value = getattr(xc, name)
        if inspect.isclass(value) and issubclass(value, BaseException):
            continue
        yield name, value, rules.arguments_of(value)


def probes(rule):
    """Values on either side of what a rule says, and whether they fit."""
    match rule:
        case rules.Number(above=above, least=least, below=below, most=most):
            low = least if least is not None else above
            high = most if most is not None else below
            high = None if high is not None and high > 1e6 else high  # an edge there
            yield from ((value, False) for value in (math.nan, math.inf, "1", None, True, [1.0]))
            if low is not None:
                yield from ((low, least is not None), (low - max(1e-3, 1e-3 * abs(low)), False))
            if high is not None:
                yield from ((high, most is not None), (high + max(1e-3, 1e-3 * abs(high)), False))
        case rules.Whole(least=least, most=most):
            yield from ((value, False) for value in (1.5, math.nan, "1", True))
            if least is not None:
                yield from ((least, True), (least - 1, False))
            if most is not None and most < 1e6:
                yield from ((most, True), (most + 1, False))
        case rules.Choice(values=values):
            yield from ((value, True) for value in values)
            yield from ((value, False) for value in ("none of them", [values[0]], object()))
        case rules.Flag():
            yield from ((value, type(value) is bool) for value in (True, False, 1, "yes", [True]))
        case rules.Progress():
            yield from ((value, False) for value in (1, "never", [True]))
        case rules.Array(shape=shape) | rules.Points(shape=shape):
            yield from ((value, False) for value in ("points", {}, lambda x: x))
            if shape is not None:
                yield np.zeros([3 if side is None else side + 1 for side in (*shape, 2)]), False
                yield np.full([3 if side is None else side for side in shape], math.nan), False
        case rules.Interval() | rules.Direction():
            yield from ((value, False) for value in ((0.0, 0.0), (0.0, 0.0, 0.0), "ab", 3))
        case rules.Part() | rules.Parts() | rules.OneOrMore() | rules.SomeOf():
            yield from ((value, False) for value in (object(), 3, [object()]))
        case rules.Function():
            yield from ((value, False) for value in (3, "f", [abs]))
        case rules.Text() | rules.FilePath():
            yield from ((value, False) for value in (3, b"text", ["text"]))


@pytest.mark.parametrize("name", sorted(name for name, _, _ in declared()))
def test_plain_arguments_have_rules(name):
    """Numbers, flags and words of functions that are not of a house to come."""
    value = getattr(xc, name)
    if value.__module__.split(".")[1] in _HOUSES_TO_COME:
        pytest.skip("checks by hand until it is rebuilt")
    if inspect.isclass(value) and not issubclass(value, rules.Declared):
        pytest.skip("made by xcrack, or a base")
    plain = re.compile(r"(float|int|bool|str)( \| None)?")
    missing = [
        argument.name
        for argument in rules.arguments_of(value).values()
        if argument.rule is None
        and argument.name not in _BY_ANOTHER
        and plain.fullmatch(inspect.formatannotation(argument.annotation))
    ]
    assert not missing


def test_a_refusal_names_argument_value_and_remedy():
    count = 0
    for name, _, arguments in declared():
        for argument in arguments.values():
            for value, fits in probes(argument.rule):
                if fits or (value is None and argument.is_optional):
                    continue
                with pytest.raises(ProblemError) as caught:
                    argument.check(value, f"{name}: {argument.name}")
                words = str(caught.value)
                assert words.startswith(f"{name}: {argument.name}"), words
                assert re.search("give|must|take another", words), words
                count += 1
    assert count > 600


def test_the_table_of_drawn_inputs_has_the_same_bounds():
    """Two lists, made apart: what a rule refuses is not valid there, what fits is no nonsense."""
    drawn = {}  # an argument of a value that is called may have the name of one it is made with
    for one in TABLE:
        for name, argument in getattr(one, "arguments", {}).items():
            if isinstance(argument, Argument):
                drawn.setdefault((one.name, name), []).append(argument.kind)
    compared, faults = 0, []
    for owner, _, arguments in declared():
        for name, argument in arguments.items():
            kinds = drawn.get((owner, name), [])
            for value, fits in probes(argument.rule) if kinds else ():
                if value is None and argument.is_optional:
                    continue
                compared += 1
                if all(kind.verdict(value) == (NONSENSE if fits else VALID) for kind in kinds):
                    faults.append(f"{owner}: {name} = {value!r}: {argument.rule}, fits: {fits}")
    assert not faults, "\n".join(faults)
    assert compared > 300


def test_docstrings_read_the_bounds_and_do_not_repeat_them():
    """Help and the site say what the rule says; words beside it would be a second rule."""
    quoted, faults = 0, []
    for owner, value, arguments in declared():
        text = inspect.cleandoc(value.__doc__ or "").partition("\nReturns\n")[0]
        for name, argument in arguments.items():
            if not isinstance(argument.rule, rules.Number | rules.Whole) or not argument.rule.words:
                continue
            line = re.search(
                rf"^(?:\w+, )*{name}(?:, \w+)* : .*(?:\n {{4}}.*)*", text, re.MULTILINE
            )
            if line is None:
                continue
            head, *rest = line[0].splitlines()
            quoted += argument.rule.words in head
            if argument.rule.words not in head:
                faults.append(f"{owner}: {head}: {argument.rule.words}")
            if re.search(
                r"\b(positive\b(?! towards)|not negative|[Bb]etween 0|[Ii]n \[0)", " ".join(rest)
            ):
                faults.append(f"{owner}: {name}: {rest}")
    assert not faults, "\n".join(faults)
    assert quoted > 80
