"""Cracks that mean something else than they seem to when they are put into a mesh, or grow."""

import warnings

import numpy as np
import pytest

import xcrack as xc
from xcrack.crack import placing_3d
from xcrack.crack.advance_2d import advance
from xcrack.crack.lines import touching_points
from xcrack.crack.stations import place_crack

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
