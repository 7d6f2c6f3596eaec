"""Rainflow of repeated histories: the standard's example, another program, and invariances."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xcrack import ProblemError, Spectrum, rainflow

ASTM = [-2, 1, -3, 5, -1, 3, -4, 4, -2]  # figure 6 of ASTM E1049-85


def ranges(cycles):
    return Counter((float(a), float(b)) for a, b in cycles[["min", "max"]].tolist())


def test_example_of_the_standard():
    """Of figure 6, repeated and begun at its peak of 5: ranges 3, 4, 7 and 9, once each.

    By hand after 5.4.5: 5 -1 3 -4 4 -3(-2 1) 5.
    """
    cycles = rainflow(ASTM)
    assert ranges(cycles) == {(-1, 3): 1, (-2, 1): 1, (-3, 4): 1, (-4, 5): 1}
    assert np.array_equal(np.array(ASTM)[cycles["at"]], cycles["max"])
    assert (np.diff(cycles["at"]) > 0).all()


def counted_by_rules(history):
    """The rules of 5.4.4 word by word, over a history begun and ended at its largest peak."""
    h = list(history)
    points = [h[0]]
    for x in [*h[1:], h[0]]:
        if x == points[-1]:
            continue
        if len(points) > 1 and (points[-1] - points[-2]) * (x - points[-1]) > 0:
            points[-1] = x
        else:
            points.append(x)
    halves, read = Counter(), []
    for x in points:
        read.append(x)
        while len(read) >= 3:
            X, Y = abs(read[-1] - read[-2]), abs(read[-2] - read[-3])
            if X < Y:
                break
            pair = (min(read[-3], read[-2]), max(read[-3], read[-2]))
            if len(read) == 3:  # Y contains the starting point: a half cycle
                halves[pair] += 1
                del read[0]
            else:
                halves[pair] += 2
                del read[-3:-1]
    for a, b in zip(read, read[1:]):
        halves[min(a, b), max(a, b)] += 1
    return halves


histories = st.lists(st.integers(-8, 8), min_size=2, max_size=60).filter(lambda h: len(set(h)) > 1)


@settings(max_examples=1000, deadline=None)
@given(histories)
def test_a_thousand_histories(history):
    """Cycles of the repeated history are those that the rules give from peak to peak."""
    begin = int(np.argmax(history))
    halves = counted_by_rules([*history[begin:], *history[:begin]])
    whole = {pair: 2 * n for pair, n in ranges(rainflow(history)).items()}
    assert whole == dict(halves)


@settings(max_examples=1000, deadline=None)
@given(histories)
def test_another_program(history):
    """The package rainflow 3.2 (MIT), from peak to peak."""
    package = pytest.importorskip("rainflow")
    begin = int(np.argmax(history))
    closed = [*history[begin:], *history[: begin + 1]]
    theirs = Counter()
    for width, mean, count, *_ in package.extract_cycles(closed):
        theirs[mean - width / 2, mean + width / 2] += count
    assert dict(theirs) == dict(ranges(rainflow(history)))


@settings(max_examples=200, deadline=None)
@given(histories, st.integers(0, 60), st.integers(1, 3))
def test_where_a_block_begins_does_not_matter(history, shift, repeats):
    turned = np.roll(history, shift)
    assert ranges(rainflow(turned)) == ranges(rainflow(history))
    many = ranges(rainflow(np.tile(history, repeats)))
    assert many == {pair: n * repeats for pair, n in ranges(rainflow(history)).items()}
    assert ranges(rainflow(np.repeat(history, 2))) == ranges(rainflow(history))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: rainflow([1.0]), "do not vary"),
        (lambda: rainflow([2.0, 2.0]), "do not vary"),
        (lambda: rainflow([1.0, np.nan]), "must be finite"),
        (lambda: rainflow("wing"), "real numbers"),
        (lambda: Spectrum(), "not nothing"),
        (lambda: Spectrum([0, 1], rows=[(0, 1, 1)]), "factors and rows"),
        (lambda: Spectrum([1.0]), "do not vary"),
        (lambda: Spectrum([]), "do not vary"),
        (lambda: Spectrum([0, np.inf]), "must be finite"),
        (lambda: Spectrum([[0, 1]]), "shape"),
        (lambda: Spectrum(rows=[(1, 0, 1)]), "min < max"),
        (lambda: Spectrum(rows=[(0, 1, 0)]), "count > 0"),
        (lambda: Spectrum(rows=np.zeros((0, 3))), "min < max"),
        (lambda: Spectrum(states=[0.0, 1.0]), "sequence"),
        (lambda: Spectrum(states=[0.0, 1.0], sequence=[0, 2]), "there are 2 states"),
        (lambda: Spectrum(states=[0.0, 1.0], sequence=[0, 0]), "does not vary"),
        (lambda: Spectrum(states=[0.0, "up"], sequence=[0, 1]), "states"),
        (lambda: Spectrum(states=[0.0, 1.0], sequence=[0, 1]).cycles, "a run counts them"),
        (lambda: Spectrum([0, 1], unit=""), "unit"),
        (lambda: Spectrum([0, 1], steady=[3.0]), "not a load"),
        (lambda: Spectrum([0, 1], levels=1), "levels = 1"),
        (lambda: Spectrum([0, 1], levels="many"), "levels = 'many'"),
        (lambda: Spectrum([0, 1], tolerance=0), "tolerance"),
        (lambda: Spectrum([0, 1]).omit(2.0), "least_range = 2 leaves out all"),
        (lambda: Spectrum([0, 1], least_range=5.0), "leaves out all cycles.* range is 1"),
        (lambda: Spectrum([0, 1]).scaled(-1), "factor"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ProblemError, match=words):
        make()


def test_omission_and_scaling():
    spectrum = Spectrum(ASTM)
    small = spectrum.omit(range=5)
    assert ranges(small.cycles) == {(-3, 4): 1, (-4, 5): 1}
    assert ranges(small.left_out) == {(-1, 3): 1, (-2, 1): 1}
    assert ranges(small.scaled(2.0).cycles) == {(-6, 8): 1, (-8, 10): 1}
    assert small.extremes == (-4, 5)
    assert spectrum.ratio == -2.0
    rows = Spectrum(rows=[(0.1, 1.0, 90.0), (0.5, 1.0, 10.0)])
    assert rows.ratio == 0.1
    assert rows.omit(0.6).cycles["count"].tolist() == [90.0]
