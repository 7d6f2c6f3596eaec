"""Polylines that cross, touch or only lie on one line: by exact arithmetic, at drawn angles.

What is on one line has no angle to cross at but that of round-off.
"""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

import xcrack as xc
from support.rows import mission
from xcrack.crack.advance_2d import advance
from xcrack.crack.lines import crossing_points, polyline_crack
from xcrack.fem.level_set import line_levels
from xcrack.mesh.polygon import self_crossing
from xcrack.mesh.simplex import boxes_meet

STEEL = xc.Isotropic(1e5, 0.3, plane="strain")
BOX = xc.box((-2, -2), (2, 2), 29)


def drawn_direction(rng):
    angle = rng.uniform(-np.pi, np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def turn(a, b, c):
    """Sign of the area of a triangle, in exact arithmetic of the coordinates."""
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(v) for v in x) for x in (a, b, c))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (area > 0) - (area < 0)


def meet(a, b, c, d):
    """Whether segments ab and cd, which are not on one line, have a point in common."""
    return turn(a, b, c) * turn(a, b, d) <= 0 and turn(c, d, a) * turn(c, d, b) <= 0


def refusal(points):
    try:
        xc.line_crack(points)
    except xc.GeometryError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("centre", [0.0, 1e4])
def test_straight_lines_with_points_in_between(centre):
    """Evenly spread points, and drawn ones; 73 of 400 crossed themselves once."""
    for seed in range(500):
        rng = np.random.default_rng(seed)
        along, origin = drawn_direction(rng), centre + rng.uniform(-0.05, 0.05, 2)
        even = np.linspace(-1.0, 1.0, int(rng.integers(3, 40)))
        uneven = np.sort(np.concatenate([[-1.0, 1.0], rng.uniform(-1, 1, 9)]))
        uneven = uneven[np.append(True, np.diff(uneven) > 1e-6)]
        for place in (even, uneven):
            assert refusal(origin + place[:, None] * along) == "", seed
            ends = np.linspace(origin - along, origin + along, len(place))
            assert refusal(ends) == "", seed


def test_drawn_lines_against_exact_arithmetic():
    """Six points anywhere: half of the lines cross themselves."""
    count = 0
    for seed in range(300):
        x = np.random.default_rng(8800 + seed).uniform(-1, 1, (6, 2))
        pieces = list(pairwise(x))
        exact = any(meet(*pieces[i], *pieces[j]) for i in range(5) for j in range(i + 2, 5))
        assert bool(refusal(x)) == exact, seed
        assert exact == (len(crossing_points(x, x, is_same_line=True)) > 0), seed
        count += exact
    assert 100 < count < 250


@pytest.mark.parametrize("share", [1e-6, 1e-3])
def test_lines_that_end_just_before_themselves_or_just_behind(share):
    """A share of their size decides; the other piece has points of its own along it."""
    for seed in range(200):
        rng = np.random.default_rng(9900 + seed)
        along = drawn_direction(rng)
        across, at = np.array([-along[1], along[0]]), rng.uniform(-0.9, 0.9)
        first = np.linspace(-along, along, int(rng.integers(2, 12)))
        come = at * along + 0.7 * across + rng.uniform(-0.5, 0.5) * along
        corner = 1.3 * along + 0.8 * across
        for beyond, crosses in ((-share, False), (share, True)):
            last = at * along + beyond * (at * along - come)
            assert ("crosses itself" in refusal([*first, corner, come, last])) == crosses, seed


@pytest.mark.parametrize("angle", [1e-3, 1e-7, 1e-9])
def test_lines_that_cross_at_a_small_angle(angle):
    """The place is found to the round-off of coordinates over the angle."""
    for seed in range(100):
        rng = np.random.default_rng(7700 + seed)
        one = drawn_direction(rng)
        other = one + angle * np.array([-one[1], one[0]])
        x = rng.uniform(-0.3, 0.3, 2)
        crossing = crossing_points(np.stack([x - one, x + one]), np.stack([x - other, x + other]))
        assert len(crossing) == 1, seed
        assert np.linalg.norm(crossing[0] - x) <= 1e-15 / angle, seed
        apart = 2.5 * one
        assert not len(
            crossing_points(np.stack([x - one, x + one]), apart + np.stack([x - other, x + other]))
        )


def test_lines_that_turn_back_or_lie_on_themselves_at_drawn_angles():
    """They cross nowhere, but touch along a length."""
    for seed in range(100):
        rng = np.random.default_rng(6600 + seed)
        along = drawn_direction(rng)
        across = np.array([-along[1], along[0]])
        around = [-along, along, along + across, across - 1.5 * along, -1.5 * along, 0.3 * along]
        assert "crosses itself" in refusal(around), seed
        assert "turns back" in refusal([-along, along, 0.2 * along]), seed


def test_points_that_are_the_same_but_for_round_off():
    assert "zero length" in refusal([(0, 0), (1, 1), (1 + 1e-10, 1), (2, 2)])
    assert refusal([(0, 0), (1, 1), (1 + 1e-8, 1 + 1e-8), (2, 2)]) == ""


def cracks_on_one_line(rng, first, last):
    """A crack between -1.2 and -0.3 of a drawn line through the middle, and another one."""
    along, x = drawn_direction(rng), rng.uniform(-0.05, 0.05, 2)
    one = [x - 1.2 * along, x - 0.3 * along]
    return [xc.line_crack(one), xc.line_crack([x + first * along, x + last * along])]


@pytest.mark.slow
@pytest.mark.mission
def test_cracks_on_one_line():
    """Apart they are two cracks; what overlaps or touches is refused."""
    for seed in range(400):
        rng = np.random.default_rng(seed)
        problem = xc.Problem(BOX, STEEL, cracks_on_one_line(rng, 0.3, 1.2))
        assert [crack.tips for crack in problem.placed] == [(0, 1), (0, 1)], seed
    for seed in range(40):
        for first, last in ((-0.6, 0.5), (-0.9, -0.6), (-0.3, 0.6), (-1.5, 0.2)):
            rng = np.random.default_rng(seed)
            lines = cracks_on_one_line(rng, first, last)
            with pytest.raises(xc.GeometryError, match=r"touch or lie on|or join the cracks"):
                xc.solve(xc.Problem(BOX, STEEL, lines, loads=[xc.crack_pressure(1.0)]))


def test_cracks_that_cross_at_drawn_angles():
    """By a third of their length or by half of it; less than a cell would be a junction."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        one, other = drawn_direction(rng), drawn_direction(rng)
        if abs(one[0] * other[1] - one[1] * other[0]) < 0.2:
            continue
        for short in (1.0, 0.5):
            lines = [-one, one], [-short * other, other]
            with pytest.raises(xc.GeometryError, match="cross near"):
                xc.Problem(BOX, STEEL, [xc.line_crack(line) for line in lines])


def test_cracks_that_grow_straight_do_not_cross_themselves():
    for seed in range(300):
        rng = np.random.default_rng(seed)
        along = drawn_direction(rng)
        crack = polyline_crack(np.stack([-along, along]), (0, 1))
        for _ in range(8):
            crack = advance(crack, np.zeros(2), np.full(2, rng.uniform(0.05, 0.3)))
        assert len(crack.points) == 18


@pytest.mark.parametrize("seeds", [range(300), *mission(range(300, 2000))], ids=["few", "rest"])
def test_level_sets_of_a_straight_line_with_points_in_between(seeds):
    """The rays that prolong it end nowhere: 2 of 2000 met what lies behind them."""
    mesh = xc.box((-1.5, -1.5), (1.5, 1.5), 6)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        along, x = drawn_direction(rng), rng.uniform(-0.2, 0.2, 2)
        many = x + np.linspace(-1, 1, 9)[:, None] * along
        levels = line_levels(mesh, polyline_crack(many, (0, 8)))
        plain = line_levels(mesh, polyline_crack(many[[0, 8]], (0, 1)))
        np.testing.assert_allclose(levels.phi, plain.phi, atol=1e-12)
        np.testing.assert_allclose(levels.psi, plain.psi, atol=1e-12)


def test_outlines_with_points_in_between():
    """Sides of a square at drawn angles, each of eight pieces; and one that crosses itself."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    for seed in range(200):
        rng = np.random.default_rng(seed)
        along = drawn_direction(rng)
        turned = corners @ np.stack([along, [-along[1], along[0]]]) + rng.uniform(-1, 1, 2)
        for order, crosses in (([0, 1, 2, 3], False), ([0, 2, 1, 3], True)):
            x = turned[order]
            pairs = zip(x, np.roll(x, -1, axis=0), strict=True)
            outline = np.concatenate([np.linspace(a, b, 9)[:-1] for a, b in pairs])
            assert (self_crossing(outline) is not None) == crosses, seed


def test_boxes_that_meet():
    a, b = np.array([0.0, 0.0]), np.array([1.0, 2.0])
    c = np.array([[1.0, 2.0], [1.1, 0.0], [0.5, 3.0], [2.0, -1.0]])
    d = np.array([[3.0, 3.0], [2.0, 2.0], [0.2, 1.0], [-1.0, 5.0]])
    np.testing.assert_array_equal(boxes_meet(a, b, c, d), [True, False, True, True])
    np.testing.assert_array_equal(boxes_meet(c, d, b, a, 0.2), [True, True, True, True])
