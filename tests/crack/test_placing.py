"""Lines that cross, touch or lie on each other, and cracks that mean what they do not seem."""

import warnings
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

import xcrack as xc
from support.rows import mission
from xcrack.crack import placing_3d
from xcrack.crack.advance_2d import advance
from xcrack.crack.lines import crossing_points, polyline_crack, touching_points
from xcrack.crack.meetings import joined_cracks, meetings
from xcrack.crack.stations import place_crack
from xcrack.fem.level_set import line_levels
from xcrack.mesh.polygon import self_crossing
from xcrack.mesh.simplex import boxes_meet

STEEL = xc.Isotropic(E=1.0, nu=0.3, plane="strain")
BOX = xc.box((-0.5, -0.5), (0.5, 0.5), 16)
CELL = 1 / 16  # sides of the boundary facets


def put(*lines, mesh=BOX):
    """Tips of cracks in a scene, and what was warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        problem = xc.Problem(mesh, STEEL, [xc.line_crack(line) for line in lines])
    assert all(w.filename == __file__ for w in caught)
    return [crack.tips for crack in problem.placed], [str(w.message) for w in caught]


# --- cracks that lie on each other, and on themselves ---------------------------------------


@pytest.mark.parametrize("y", [0.0, 1e-13, 0.003], ids=["mesh line", "snapped", "between"])
@pytest.mark.parametrize(
    ("one", "other"),
    [((-0.3, 0.3), (-0.2, 0.2)), ((-0.3, 0.1), (-0.2, 0.3)), ((-0.6, 0.0), (-0.7, -0.2))],
    ids=["within", "partly", "both from the left side"],
)
def test_cracks_on_each_other_are_refused(one, other, y):
    with pytest.raises(xc.GeometryError, match=r"cracks 0 and 1 touch or lie on each other near"):
        put([(x, y) for x in one], [(x, 0.0 if y == 1e-13 else y) for x in other])


def test_cracks_that_meet_outside_the_body_are_not_refused():
    tips, _ = put([(-0.6, 0.0), (-0.1, 0.2)], [(-0.6, 0.0), (-0.1, -0.2)])
    assert tips == [(1,), (1,)]


def test_touching_points_against_plain_loops():
    rng = np.random.default_rng(14142)
    a, b = rng.integers(0, 5, (30, 2)).astype(float), rng.integers(0, 5, (40, 2)).astype(float)
    wanted = []
    for x, line in ((a, b), (b, a)):
        for p in x:
            for q, r in zip(line, line[1:]):
                s = r - q
                t = np.clip((p - q) @ s / max(s @ s, 1e-300), 0, 1)
                if np.linalg.norm(p - q - t * s) <= 1e-9:
                    wanted.append(p)
                    break
    np.testing.assert_array_equal(touching_points(a, b, 1e-9), wanted)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, 33)], "closed.*two arcs"),
        ([(0, 0), (1, 0), (1, 1), (0, 0)], "closed.*leave a gap"),
        ([(0, 0), (1, 0), (1, 1), (-1, 1), (-1, 0), (0.5, 0)], "crosses itself"),  # lies on itself
        ([(0, 0), (2, 0), (2, 1), (1, 1), (1, 1e-13)], "crosses itself"),  # touches itself
    ],
)
def test_lines_that_meet_themselves_are_refused(points, says):
    with pytest.raises(xc.GeometryError, match=says):
        xc.line_crack(points)


def test_tips_of_one_crack_that_nearly_close_it():
    turns = np.linspace(0.05, 2 * np.pi - 0.05, 33)
    with pytest.raises(xc.GeometryError, match=r"tips of crack 0 .* a crack that closes"):
        put([(0.2 * np.cos(t), 0.2 * np.sin(t)) for t in turns])


def test_a_tip_beside_its_own_crack():
    """Half a cell from a part of the crack that is more than two cells away along it."""
    hook = [(-0.3, 0.0), (0.2, 0.0), (0.2, 0.2), (0.0, 0.2)]
    assert put([*hook, (0.0, 0.1)])[0] == [(0, 4)]
    with pytest.raises(xc.GeometryError, match=r"a tip of crack 0 at \[0.0, 0.02\] is 0.02 from"):
        put([*hook, (0.0, 0.02)])


# --- growth across itself ---------------------------------------------------------------------


def test_advance_across_itself_names_the_place():
    crack = place_crack(xc.line_crack([(-0.6, 0.0), (0.2, 0.0), (0.2, 0.2), (0.0, 0.2)]), BOX)
    on = advance(crack, [np.pi / 2], [0.1])
    np.testing.assert_allclose(on.points[-1], (0.0, 0.1), atol=1e-15)
    with pytest.raises(xc.GeometryError, match=r"across itself near \[0.0, 0.0\]"):
        advance(crack, [np.pi / 2], [0.3])
    two = place_crack(xc.line_crack([(-0.2, 0.0), (0.2, 0.0)]), BOX)
    right = np.pi / 2 - 0.1
    one = advance(two, [right, right], [0.15, 0.15])  # both up
    with pytest.raises(xc.GeometryError, match="across itself"):
        advance(one, [right, right], [0.4, 0.4])  # and into each other


@pytest.mark.parametrize(
    ("angle", "da", "says"),
    [
        ([np.pi], [0.1], "turns back"),
        ([0.1], [-0.1], "does not shrink"),
        ([np.nan], [0.1], r"angle\[0\] = nan"),
        ([0.1, 0.1], [0.1], r"shape \(1,\)"),
        ([0.1], "far", "str entries"),
    ],
)
def test_advances_that_are_none(angle, da, says):
    crack = place_crack(xc.line_crack([(-0.6, 0.0), (0.2, 0.0)]), BOX)
    with pytest.raises(xc.GeometryError, match=says):
        advance(crack, angle, da)


def test_a_run_ends_where_a_crack_grows_across_itself():
    """As in 3D: the criterion turns the crack by 70 degrees a step, until it closes a loop."""
    crack = xc.line_crack([(-0.6, 0.013), (0.1, 0.013)])
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]

    def spiral(K, nu):
        angle = np.full(K.shape[1], np.radians(70.0))
        _, dK, R = xc.max_hoop_stress(K, nu)
        return angle, dK, R

    problem = xc.Problem(BOX, STEEL, [crack], loads=loads)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        history = xc.collect(
            xc.grow(problem, xc.paris(1e-3, 2.0), spiral, xc.Cycle(0.0, 1.0), 0.13, max_steps=9)
        )
    assert "cannot go on after step" in history.ended
    assert "across itself near" in history.ended or "part of the same crack" in history.ended
    points = history.steps[-1].cracks[0].points
    xc.line_crack(points)  # what was computed crosses nowhere


# --- mouths that nobody meant -------------------------------------------------------------------


def test_an_end_close_to_the_boundary_says_that_it_is_a_mouth():
    """Its ligament of .03 is gone: K_I of the other end grows from 2 to 19."""
    tips, says = put([(-0.3, 0.01), (0.3, 0.01), (0.47, 0.02)])
    assert tips == [(0,)]
    assert len(says) == 1
    assert "ends at [0.47, 0.02], 0.03 inside the boundary" in says[0]
    assert "taken as a mouth" in says[0]
    for end in (0.5, 0.4995, 0.51, 0.6, 0.45):  # at the boundary, outside, or a tip
        assert put([(-0.3, 0.01), (end, 0.02)])[1] == []


def test_a_kink_outside_the_body():
    tips, says = put([(-0.3, 0.01), (0.01, 0.6), (0.3, 0.01)])
    assert tips == [(0, 2)]
    assert "leaves the body by its kink at [0.01, 0.6]" in says[0]
    with pytest.raises(xc.GeometryError, match=r"kink at \[0.01, 0.52\] and comes back only 0.023"):
        put([(-0.3, 0.01), (0.01, 0.52), (0.3, 0.01)])


@pytest.mark.gmsh
def test_a_crack_across_a_hole_is_no_kink():
    mesh = xc.plate(2.0, 2.0, size=0.15, holes=[((1.0, 1.0), 0.3)])
    for line in ([(-0.1, 1.01), (1.8, 1.01)], [(-0.1, 1.0), (1.0, 1.03), (1.8, 1.0)]):
        tips, says = put(line, mesh=mesh)
        assert says == []
        assert tips == [(len(line) - 1,)]


@pytest.mark.parametrize(
    "line",
    [
        [(-0.6, -0.5), (0.0, -0.5)],  # on the symmetry plane of a half model
        [(-0.3, -0.5), (0.3, -0.5)],
        [(-0.3, 0.48), (0.3, 0.48)],  # it was prolonged to both sides, and cut the body in two
    ],
)
def test_cracks_along_the_boundary(line):
    with pytest.raises(xc.GeometryError, match=r"runs along the boundary.*model both halves"):
        put(line)


def test_a_long_piece_through_a_small_body_is_inside():
    """Nine samples a piece missed the body."""
    assert put([(-70.0, 0.01), (30.0, 0.01)])[0] == [()]


# --- fronts that a mesh is too coarse for ------------------------------------------------------


def test_a_front_shorter_than_a_cell_is_reported_here_and_in_plan():
    mesh = xc.box((0, 0, 0), (4, 4, 0.6), (13, 13, 2))
    crack = xc.plane_crack([(-1, 2.03, -1), (2.05, 2.03, -1), (2.05, 2.03, 2), (-1, 2.03, 2)])
    steel = xc.Isotropic(E=1.0, nu=0.3)
    with pytest.warns(xc.XcrackWarning, match=r"the front at \[2.05, 2.03, .* is shorter than a"):
        problem = xc.Problem(mesh, steel, [crack])
    row = xc.plan(problem)["tip functions"]
    assert not row.used
    ((_, (short,)),) = problem.placements
    assert str(short) in row.reason
    assert short.length < short.cell == pytest.approx(mesh.cell_size.max())
    assert 0.2 < short.length < 0.6  # of .6, without half a cell at both ends
    fine = xc.box((0, 0, 0), (4, 4, 0.6), (25, 25, 8))
    with warnings.catch_warnings():
        warnings.simplefilter("error", xc.XcrackWarning)
        problem = xc.Problem(fine, steel, [crack])
    assert problem.placements[0][1] == []
    assert xc.plan(problem)["tip functions"].used


def test_a_surface_is_placed_once_for_a_problem_its_solution_and_the_report(monkeypatch):
    """Of small scenes in space placing it again for the report took 4 % of the time."""
    calls = []
    place = placing_3d._placed_crack
    monkeypatch.setattr(placing_3d, "_placed_crack", lambda *a: calls.append(a) or place(*a))
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0, 0.1, 1), 0.4)
    pull = xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))
    mesh = xc.box((-1,) * 3, (1,) * 3, 5)
    problem = xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3), [crack], loads=pull)
    assert "4 functions" in str(xc.solve(problem).report)
    assert len(calls) == 1


@pytest.mark.parametrize(("depth", "cells"), [(0.05, (10, 1, 10)), (0.15, (10, 2, 10))])
def test_a_front_in_a_slab_of_a_cell_is_reported(depth, cells):
    """It would be cut in two without a word; a crack that is drawn through is."""
    mesh = xc.box((-1, 0, -1), (1, 0.1 * cells[1], 1), cells)
    crack = xc.plane_crack([(-2, -1, 0.02), (2, -1, 0.02), (2, depth, 0.02), (-2, depth, 0.02)])
    with pytest.warns(xc.XcrackWarning, match=r"within half a cell .* Take at least three cells"):
        assert place_crack(crack, mesh).fronts == ()
    with warnings.catch_warnings():
        warnings.simplefilter("error", xc.XcrackWarning)
        through = xc.plane_crack([(-2, -1, 0.02), (2, -1, 0.02), (2, 1, 0.02), (-2, 1, 0.02)])
        assert place_crack(through, mesh).fronts == ()


def test_the_same_crack_twice_is_refused_on_any_mesh():
    line = xc.line_crack([(-0.2, 0.1), (0.2, -0.1)])
    with pytest.raises(xc.GeometryError, match=r"cracks 0 and 1 both end at .* no mesh can part"):
        xc.Problem(BOX, xc.Isotropic(E=1.0, nu=0.3, plane="strain"), [line, line])


def test_checks_of_both_dimensions_go_by_one_name():
    cube = xc.box((-1, -1, -1), (1, 1, 1), 8)
    pennies = [xc.penny_crack((0, 0, z), (0, 0, 1), 0.5) for z in (0.03, 0.05)]
    with pytest.raises(xc.GeometryError, match="closer than a cell"):
        _ = xc.Problem(cube, xc.Isotropic(E=1.0, nu=0.3), pennies).placed
    lines = [xc.line_crack([(-0.2, y), (0.2, -y)]) for y in (0.1, -0.1)]
    with pytest.raises(xc.GeometryError, match=r"cracks 0 and 1 cross near \[0.0, 0.0\]"):
        _ = xc.Problem(BOX, xc.Isotropic(E=1.0, nu=0.3, plane="strain"), lines).placed


# --- what tips meet ----------------------------------------------------------------------------


INTO = [[(0, 10.05), (8.6, 10.05)], [(11.05, 7.1), (13.05, 13.4)]]
MEETING = xc.box((0, 0), (20, 20), 40)


def placed(lines):
    cracks = [xc.line_crack(line) for line in lines]
    return xc.Problem(MEETING, STEEL, cracks, loads=[xc.traction("top", (0, 1.0))]).placed


def test_what_a_tip_meets():
    """Only what lies ahead within a cell and a half, seen along the last face."""
    assert meetings(placed(INTO), MEETING) == []
    near = [[(0, 10.05), (11.4, 10.05)], INTO[1]]
    (own,) = meetings(placed(near), MEETING)
    assert (own.tip, own.crack, own.facing_tip) == (0, 1, -1)
    assert own.distance == pytest.approx(np.linalg.norm(own.x - (11.4, 10.05)))
    beside = [[(0, 10.05), (11.0, 10.05)], [(20, 13.05), (10.0, 13.05)]]
    assert meetings(placed(beside), MEETING) == []


def test_a_tip_that_comes_to_another_tip_ends_a_cell_behind_it():
    """Else the junction would lie within a cell of a tip, which nothing resolves."""
    cracks = placed([[(0, 10.05), (9.5, 10.05)], [(10.2, 9.9), (10.2, 15.0)]])
    (own,) = [met for met in meetings(cracks, MEETING) if met.tip == 0]
    assert own.x[1] > 10.05 + 0.5
    ended = joined_cracks(cracks, [False] * 3, [own])
    assert ended[0].tips == ()
    np.testing.assert_array_equal(ended[0].points[-1], own.x)


# --- polylines that cross, touch or only lie on one line: by exact arithmetic, at drawn angles ----
# What is on one line has no angle to cross at but that of round-off.


HARD_STEEL = xc.Isotropic(1e5, 0.3, plane="strain")
LARGE_BOX = xc.box((-2, -2), (2, 2), 29)


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
        problem = xc.Problem(LARGE_BOX, HARD_STEEL, cracks_on_one_line(rng, 0.3, 1.2))
        assert [crack.tips for crack in problem.placed] == [(0, 1), (0, 1)], seed
    for seed in range(40):
        for first, last in ((-0.6, 0.5), (-0.9, -0.6), (-0.3, 0.6), (-1.5, 0.2)):
            rng = np.random.default_rng(seed)
            lines = cracks_on_one_line(rng, first, last)
            with pytest.raises(xc.GeometryError, match=r"touch or lie on|or join the cracks"):
                xc.solve(xc.Problem(LARGE_BOX, HARD_STEEL, lines, loads=[xc.crack_pressure(1.0)]))


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
                xc.Problem(LARGE_BOX, HARD_STEEL, [xc.line_crack(line) for line in lines])


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
