"""Growth of 3D cracks (D-4): exact geometry, old surface frozen, spacing, folds, meeting."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from xcrack import (
    Crack,
    GeometryError,
    XcrackWarning,
    box,
    cycles_between,
    elliptic_crack,
    penny_crack,
)
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.front_chain import along_front
from xcrack.crack.fronts import front_frames
from xcrack.crack.lines import crossing_points
from xcrack.crack.measures import area_inside, front_length_inside, surface_size
from xcrack.crack.stations import place_crack
from xcrack.growth.euler import elapsed_3d
from xcrack.growth.fronts import interpolate_along_front
from xcrack.mesh.locate import Body
from xcrack.mesh.triangulation import face_areas, face_normals, loops, oriented_faces, side_keys


def whole(crack):
    """A crack all of whose outline is front."""
    fronts = tuple(np.append(loop, loop[0]) for loop in loops(crack.faces))
    return Crack(crack.points, crack.faces, None, fronts)


def penny(radius=1.0, n=64, normal=(0, 0, 1), center=(0, 0, 0)):
    return whole(penny_crack(center, normal, radius, n=n))


def sheet(x, z, height=9.0):
    """Crack from x = 0 with a front over z, normal y at the height given; the front is open."""
    m = len(z)
    points = [(-1.0, height, t) for t in z] + [(a, height, t) for a, t in zip(x, z)]
    faces = []
    for j in range(m - 1):
        faces += [(j, j + m + 1, j + m), (j, j + 1, j + m + 1)]
    return Crack(np.array(points), np.array(faces), None, (np.arange(m, 2 * m),))


def grown(crack, da, size, angle=0.0, front=0):
    """The same angle and advance all along one front."""
    return advance_fronts(crack, [0.0], [front], [angle], [da], size)


def front_points(crack, front=0):
    line = crack.fronts[front]
    return crack.points[line[:-1] if line[0] == line[-1] else line]


def sides(crack, front=0):
    return np.linalg.norm(np.diff(crack.points[crack.fronts[front]], axis=0), axis=1)


def check(new, old):
    """A sound surface whose first part is the old one; the worst shape of a new triangle."""
    assert np.array_equal(new.points[: len(old.points)], old.points)
    assert np.array_equal(new.faces[: len(old.faces)], old.faces)
    _, count = np.unique(side_keys(new.faces), return_counts=True)
    assert count.max() <= 2
    assert np.array_equal(oriented_faces(new.faces), new.faces)
    assert len(np.unique(new.faces)) == len(new.points)
    outline = set()
    for loop in loops(new.faces):
        outline |= set(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True))
    for front in new.fronts:
        assert set(zip(front[:-1].tolist(), front[1:].tolist(), strict=True)) <= outline
    corner = new.points[new.faces[len(old.faces) :]]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    area = face_areas(new.points, new.faces[len(old.faces) :])
    return (2 * area / longest**2).min(initial=1.0)


# --- exact geometry ----------------------------------------------------------------------------


def test_penny_stays_a_circle():
    """Fairing takes 1e-5 of the radius in a step; the sagitta of a side is 1e-3 of it."""
    crack, radius = penny(), 1.0
    for _ in range(5):
        before = crack
        crack = grown(crack, 0.15, 0.08)
        radius += 0.15
        assert check(crack, before) > 0.1
        r = np.linalg.norm(front_points(crack), axis=1)
        assert r == pytest.approx(radius, rel=1e-4)
    assert np.abs(crack.points[:, 2]).max() == 0
    x = front_points(crack)
    polygon = np.linalg.norm(np.cross(x, np.roll(x, -1, axis=0)), axis=1).sum() / 2
    assert face_areas(crack.points, crack.faces).sum() == pytest.approx(polygon, rel=1e-12)


def test_coarse_front_is_divided_on_its_curve():
    """16 points, divided by six: the cubic through them is within 1e-4 of the circle."""
    crack = grown(penny(n=16), 0.3, 0.06)
    assert len(front_points(crack)) > 90
    assert np.linalg.norm(front_points(crack), axis=1) == pytest.approx(1.3, rel=1e-3)


def test_ellipse_grows_to_its_offset_curve():
    crack = whole(elliptic_crack((0, 0, 0), (0, 0, 1), (1, 0, 0), 2.0, 1.0, n=128))
    for _ in range(4):
        crack = grown(crack, 0.2, 0.1)
    t = np.linspace(0, 2 * np.pi, 40001)
    gap, _ = cKDTree(np.stack([2 * np.cos(t), np.sin(t)], axis=1)).query(front_points(crack)[:, :2])
    assert gap == pytest.approx(0.8, abs=0.02 * 0.2)
    assert gap == pytest.approx(0.8, abs=3e-4)


def test_linear_advance_of_a_straight_front_is_linear():
    """Round-off: neither the cubics nor the fairing bend a straight line."""
    crack = sheet(np.full(31, 2.0), np.linspace(0, 6, 31))
    crack = advance_fronts(crack, [0.0, 2.0, 6.0], [0, 0, 0], [0.0] * 3, [0.2, 0.4, 0.8], 0.2)
    x = front_points(crack)
    assert x[:, 0] == pytest.approx(2.2 + 0.1 * x[:, 2], abs=1e-12)


def test_three_kinks_of_30_degrees():
    """SSLV316: position after each step; round-off."""
    crack = sheet(np.full(11, 2.0), np.linspace(0, 1, 11))
    tips = [(2.346410, 9.2), (2.546410, 9.546410), (2.546410, 9.946410)]
    for tip in tips:
        before = crack
        crack = grown(crack, 0.4, 0.1, angle=np.radians(30))
        check(crack, before)
        assert front_points(crack)[:, :2] == pytest.approx(np.tile(tip, (11, 1)), abs=1e-6)


@pytest.mark.parametrize("degrees", [-90, 45, 90])
def test_sharp_kinks(degrees):
    crack = penny(n=48)
    new = grown(crack, 0.2, 0.13, angle=np.radians(degrees))
    assert check(new, crack) > 0.1
    x = front_points(new)
    angle = np.radians(degrees)
    assert x[:, 2] == pytest.approx(0.2 * np.sin(angle), abs=1e-12)
    assert np.linalg.norm(x[:, :2], axis=1) == pytest.approx(1 + 0.2 * np.cos(angle), rel=1e-4)
    ahead = front_frames(new)[0].frame[:, 0]
    assert ahead[:, 2] == pytest.approx(np.sin(angle), abs=0.01)


def test_growth_does_not_depend_on_where_the_crack_lies():
    """Round-off: the same penny, turned and shifted."""
    rng = np.random.default_rng(6174)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    one = penny()
    other = Crack(one.points @ rotation.T + 3.0, one.faces, None, one.fronts)
    s = np.linspace(0, 6, 13)
    angle, da = 0.4 * np.sin(s + 1.0), 0.2 + 0.1 * np.cos(2 * s)
    for _ in range(3):
        one, other = (
            advance_fronts(crack, s, np.zeros(13, int), angle, da, 0.1) for crack in (one, other)
        )
    assert np.array_equal(one.faces, other.faces)
    assert other.points == pytest.approx(one.points @ rotation.T + 3.0, abs=1e-9)


# --- what does not grow ------------------------------------------------------------------------


def test_no_growth_on_an_arc_leaves_it_exactly_unchanged():
    crack = penny(n=96)
    frames = front_frames(crack)[0]
    phi = np.arctan2(frames.x[:, 1], frames.x[:, 0])
    da = np.where(np.abs(phi) < np.pi / 2, 0.1, 0.0)
    new = advance_fronts(crack, frames.s, np.zeros(96, int), np.zeros(96), da, 0.065)
    assert check(new, crack) > 0.02
    still = frames.number[da == 0]
    assert np.isin(still, new.fronts[0]).all()
    place = {int(p): i for i, p in enumerate(new.fronts[0][:-1])}
    order = np.array([place[int(p)] for p in np.roll(frames.number, -30) if int(p) in place])
    assert ((np.diff(order) % len(place)) == 1).sum() >= len(still) - 2
    middle = front_points(new)[np.abs(np.arctan2(*front_points(new)[:, 1::-1].T)) < 1.2]
    assert np.linalg.norm(middle, axis=1) == pytest.approx(1.1, rel=1e-4)


def test_nothing_grows():
    crack = penny()
    new = grown(crack, 0.0, 0.1)
    assert np.array_equal(new.points, crack.points)
    assert np.array_equal(new.faces, crack.faces)
    assert np.array_equal(new.fronts[0], crack.fronts[0])


def test_a_front_without_places_stays():
    two = _two_pennies(5.0)
    new = grown(two, 0.2, 0.1, front=1)
    assert check(new, two) > 0.1
    assert np.array_equal(new.fronts[0], two.fronts[0])
    assert np.linalg.norm(front_points(new, 1) - [5, 0, 0], axis=1) == pytest.approx(1.2, rel=1e-4)


def test_a_very_short_advance_is_none_unless_all_are():
    crack = penny()
    s, zeros = np.array([0.0, 3.0]), np.zeros(2, int)
    new = advance_fronts(crack, s, zeros, zeros, [1e-4, 0.1], 0.1)
    assert np.isin(crack.fronts[0], new.fronts[0]).sum() > 3
    assert np.linalg.norm(front_points(grown(crack, 1e-4, 0.1)), axis=1) == pytest.approx(
        1.0001, abs=1e-5
    )


# --- spacing, smoothness -----------------------------------------------------------------------


def test_spacing_over_ten_steps():
    crack = penny(n=64)
    for _ in range(10):
        before = crack
        crack = grown(crack, 0.2, 0.12)
        assert check(crack, before) > 0.1
        assert sides(crack).min() >= 0.5 * 0.12
        assert sides(crack).max() <= 1.5 * 0.12
    assert np.linalg.norm(front_points(crack), axis=1) == pytest.approx(3.0, rel=1e-4)


def test_a_fine_front_is_merged():
    crack = grown(penny(n=512), 0.2, 0.1)
    assert sides(crack).min() >= 0.05
    assert np.linalg.norm(front_points(crack), axis=1) == pytest.approx(1.2, rel=1e-4)


def test_mixed_mode_growth_keeps_front_and_frames_smooth():
    """Angle and advance as K of an inclined penny would give them; n turns as the front does."""
    crack = penny(n=64, normal=(0, 0, 1))
    for step in range(6):
        frames = front_frames(crack)[0]
        phi = np.arctan2(frames.x[:, 1], frames.x[:, 0])
        before = crack
        angle = -0.5 * np.cos(phi) * 0.5**step
        da = 0.15 * (1 + 0.3 * np.cos(phi))
        crack = advance_fronts(crack, frames.s, np.zeros(len(phi), int), angle, da, 0.1)
        assert check(crack, before) > 0.15
        assert 0.05 <= sides(crack).min()
        assert sides(crack).max() <= 0.15
        frames = front_frames(crack)[0]
        for row in range(3):
            vector = frames.frame[:, row]
            bend = np.roll(vector, 1, axis=0) + np.roll(vector, -1, axis=0) - 2 * vector
            assert np.linalg.norm(bend, axis=1).max() < 0.06
        # Symmetric about the plane y = 0, as the loads are: only diagonals are not.
        x = frames.x
        gap, _ = cKDTree(x).query(x * [1, -1, 1])
        assert gap.max() < 0.08


@pytest.mark.parametrize(("period", "share"), [(2, 0.01), (3, 0.05), (4, 0.3)])
def test_zigzag_dies_out(period, share):
    """A twentieth of the spacing high; waves of two to four points, in four steps."""
    z = np.linspace(0, 6, 61)
    crack = sheet(2 + 0.005 * np.cos(2 * np.pi * np.arange(61) / period), z)
    for _ in range(4):
        crack = grown(crack, 0.1, 0.1)
    inner = front_points(crack)[6:-6, 0]
    assert np.ptp(inner) < share * 0.01
    assert inner.mean() == pytest.approx(2.4, abs=1e-3)


def test_zigzag_that_loses_length_warns():
    z = np.linspace(0, 6, 61)
    crack = sheet(2 + 0.03 * (-1.0) ** np.arange(61), z)
    with pytest.warns(XcrackWarning, match="zigzag"):
        grown(crack, 0.2, 0.1)


# --- hollow fronts -----------------------------------------------------------------------------


def test_hollow_front_converges_and_its_loops_vanish():
    """Offset of a wave by more than its radius; in one step, and in ten."""
    z = np.linspace(0, 6, 121)
    wave = sheet(0.5 * np.cos(np.pi * z), z)
    line = np.linspace(0, 6, 60001)
    curve = cKDTree(np.stack([0.5 * np.cos(np.pi * line), line], axis=1))
    once = grown(wave, 1.0, 0.05)
    check(once, wave)
    often = wave
    for _ in range(10):
        before = often
        often = grown(often, 0.1, 0.05)
        check(often, before)
    for crack, tolerance in ((once, 0.03), (often, 0.05)):
        flat = front_points(crack)[:, [0, 2]]
        assert not len(crossing_points(flat, flat, is_same_line=True))
        inner = (flat[:, 1] > 0.3) & (flat[:, 1] < 5.7)
        assert curve.query(flat[inner])[0] == pytest.approx(1.0, abs=tolerance)
        assert sides(crack)[1:-1].min() >= 0.5 * 0.05


def ring(inner=1.0, outer=3.0, n=64):
    t = 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(t), np.sin(t), np.zeros(n)], axis=1)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = np.concatenate([np.stack([i, i + n, j + n], 1), np.stack([i, j + n, j], 1)])
    return whole(Crack(np.concatenate([inner * circle, outer * circle]), faces))


def test_ligament_in_a_ring_shrinks_until_it_is_cut_through():
    crack = ring()
    hole = int(np.argmin([np.linalg.norm(front_points(crack, k)[0]) for k in range(2)]))
    for radius in (0.8, 0.6, 0.4):
        before = crack
        crack = grown(crack, 0.2, 0.1, front=hole)
        assert check(crack, before) > 0.1
        r = np.linalg.norm(front_points(crack, hole), axis=1)
        assert r == pytest.approx(radius, rel=3e-3)
    with pytest.raises(GeometryError, match="cut through"):
        grown(crack, 0.5, 0.1, front=hole)


def _two_pennies(apart):
    one, other = (
        penny_crack((0, 0, 0), (0, 0, 1), 1.0, n=64),
        penny_crack((apart, 0, 0), (0, 0, 1), 1.0, n=64),
    )
    faces = np.concatenate([one.faces, other.faces + len(one.points)])
    return whole(Crack(np.concatenate([one.points, other.points]), faces))


@pytest.mark.parametrize("da", [0.22, 0.25, 0.5, 1.5])
def test_fronts_of_a_crack_that_meet(da):
    two = _two_pennies(2.5)
    places = ([0.0, 0.0], [0, 1], [0.0, 0.0])
    check(advance_fronts(two, *places, [0.1, 0.1], 0.1), two)
    with pytest.raises(GeometryError, match="meets another part of the same crack"):
        advance_fronts(two, *places, [da, da], 0.1)


@pytest.mark.filterwarnings("ignore:fairing:xcrack.base.errors.XcrackWarning")
def test_opposite_kinks_of_neighbours_make_no_broken_surface():
    """Angles of +-60 degrees from point to point have no meaning; fairing takes a part of them."""
    crack = penny()
    frames = front_frames(crack)[0]
    angle = np.radians(60) * (-1.0) ** np.arange(64)
    new = advance_fronts(crack, frames.s, np.zeros(64, int), angle, np.full(64, 0.3), 0.1)
    check(new, crack)


# --- anything ----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [5813, 2718, 9041, 3377, 6469, 7853])
def test_drawn_growth_gives_sound_surfaces(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(16, 120))
    if seed % 2:
        crack = whole(
            elliptic_crack(rng.normal(size=3), rng.normal(size=3), (1, 0.3, 0), 1.5, 0.7, n=n)
        )
    else:
        z = np.linspace(0, 4, n)
        crack = sheet(2 + 0.1 * np.cos(2 * z), z)
    size = max(4 / n, 0.05) * rng.uniform(0.6, 1.5)
    for _ in range(4):
        frames = front_frames(crack)[0]
        length = float(sides(crack).sum())
        q = int(rng.integers(4, 30))
        s = np.sort(rng.uniform(0, length, q))
        t = 2 * np.pi * s / length
        angle = 0.4 * np.cos(t + rng.uniform(0, 6))
        da = size * np.maximum(0, 0.4 + rng.uniform(0, 1.5) * np.cos(2 * t + rng.uniform(0, 6)))
        before = crack
        crack = advance_fronts(crack, s, np.zeros(q, int), angle, da, size)
        assert check(crack, before) > 1e-5
        assert np.isfinite(front_frames(crack)[0].frame).all()
        assert front_frames(crack)[0].is_closed == frames.is_closed


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"da": [-0.1]}, "shrink"),
        ({"da": [np.nan]}, "not finite"),
        ({"angle": [np.inf]}, "not finite"),
        ({"front": [1]}, "fronts 0 to 0"),
        ({"s": [0.0, 1.0]}, "as long as each other"),
        ({"size": 0.0}, "positive"),
    ],
)
def test_bad_input(change, match):
    given = {"s": [0.0], "front": [0], "angle": [0.0], "da": [0.1], "size": 0.1} | change
    with pytest.raises(GeometryError, match=match):
        advance_fronts(penny(), **given)


def test_crack_that_is_not_placed():
    with pytest.raises(GeometryError, match="not placed"):
        advance_fronts(penny_crack((0, 0, 0), (0, 0, 1), 1.0), [0.0], [0], [0.0], [0.1], 0.1)


def test_along_front():
    s = np.array([4.0, 1.0, 2.0])
    assert along_front(s, s, np.array([0.0, 1.5, 3.0, 9.0]), False, 10.0) == pytest.approx(
        [1.0, 1.5, 3.0, 4.0]
    )
    place = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    fine = np.linspace(-1, 8, 91)
    result = along_front(place, np.cos(place), fine, True, 2 * np.pi)
    assert result == pytest.approx(np.cos(fine), abs=0.02)
    step = along_front(place, np.where(place < 3, 0.0, 1.0), fine, True, 2 * np.pi)
    assert step.min() == 0
    assert step.max() == 1


# --- size and cycles ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("normal", "center"), [((0, 0, 1), (0.9, 0, 0.03)), ((1, 1, 1), (0.9, 0, 0.2))]
)
def test_area_and_front_length_inside(normal, center):
    """A disc that leaves a cube, against a sum over a fine polar grid."""
    mesh, radius = box((-1, -1, -1), (1, 1, 1), 8), 0.6
    crack = penny(radius, 128, normal, center)
    z = np.array(normal) / np.linalg.norm(normal)
    x = np.cross(z, [0, 1, 0])
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    t = 2 * np.pi * (np.arange(2000) + 0.5) / 2000
    around = np.cos(t)[:, None] * x + np.sin(t)[:, None] * y
    r = radius * np.sqrt((np.arange(300) + 0.5) / 300)
    inside = (np.abs(center + r[:, None, None] * around) < 1).all(axis=2)
    area = np.pi * radius**2 * inside.mean()
    length = 2 * np.pi * radius * (np.abs(center + radius * around) < 1).all(axis=1).mean()
    assert area_inside(crack, mesh) == pytest.approx(area, rel=3e-3)
    assert front_length_inside(crack, mesh) == pytest.approx(length, rel=3e-3)


def test_area_of_large_faces():
    """Two triangles whose corners all lie outside, on an oblique mouth; edges of the body."""
    mesh = box((-1, -1, -1), (1, 1, 1), 6)
    corners = [(-3, -3, 0.1), (0.25, -3, 0.1), (0.25, 3, 0.1), (-3, 3, 0.1)]
    crack = Crack(np.array(corners), np.array([(0, 1, 2), (0, 2, 3)]), None, (np.array([2, 1]),))
    assert area_inside(crack, mesh) == pytest.approx(2.5, rel=2e-3)
    assert front_length_inside(crack, mesh) == pytest.approx(2.0, rel=1e-12)
    assert surface_size(penny(0.5, 128), mesh) == pytest.approx(0.25, rel=1e-3)


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0, 3.0])
def test_cycles_of_a_penny_and_of_a_straight_front(power):
    """Rate ~ radius^power: cycles of the same law in 2D; round-off."""
    a0, a1 = 2.0, 3.0
    rate0, rate1 = (np.full(8, 1e-3 * a**power) for a in (a0, a1))
    da = np.full(8, a1 - a0)
    exact = cycles_between(a0, a1, rate0[0], rate1[0])
    for size in ((a0 / 2, a1 / 2), (a0, a1)):
        result = elapsed_3d([size[0]], [size[1]], [da], [rate0], [rate1])
        assert result == pytest.approx(exact, rel=1e-12)
    scatter = rate1 * (1 + 0.03 * np.array([1, -1, 1, -1, -1, 1, -1, 1]))
    result = elapsed_3d([1.0], [1.5], [da], [rate0], [scatter])
    assert result == pytest.approx(exact, rel=1e-12)


def test_cycles_where_points_stop_or_leave():
    da, rate = [np.array([0.1, 0.2]), np.zeros(0)], [np.array([1e-3, 2e-3]), np.zeros(0)]
    gone = [np.full(2, np.nan), np.zeros(0)]
    assert elapsed_3d([1, 1], [1.1, 1], da, rate, gone) == pytest.approx(100)
    still = [np.zeros(2), np.zeros(0)]
    assert elapsed_3d([1, 1], [1.1, 1], da, rate, still) == pytest.approx(200)
    one = [np.array([1e-3, np.nan]), np.zeros(0)]
    assert elapsed_3d([1, 1], [1.1, 1], da, rate, one) == pytest.approx(100, rel=1e-12)
    assert elapsed_3d([1, 1], [1.0, 1], da, rate, rate) == pytest.approx(100, rel=1e-12)


def test_life_of_a_penny_that_grows():
    """Rate ~ K^3 ~ radius^1.5 from 1 to 2 in five steps: closed form, but for the polygon."""
    mesh = box((-3, -3, -3), (3, 3, 3), 8)
    crack, cycles, sizes = penny(n=96), 0.0, [0.5]
    for step in range(5):
        places = front_frames(crack)[0].x
        da = np.full(len(places), 0.2)
        crack = grown(crack, 0.2, 0.1)
        sizes.append(surface_size(crack, mesh))
        new = front_points(crack)
        radius = np.linalg.norm(new, axis=1)
        after = interpolate_along_front(
            new, np.zeros(len(new), int), [True], radius**1.5, places * 1.2, 0.9
        )
        before = np.full(len(places), (1 + 0.2 * step) ** 1.5)
        cycles += elapsed_3d(sizes[-2:-1], sizes[-1:], [da], [before], [after])
    assert cycles == pytest.approx(2 - 2 / np.sqrt(2), rel=2e-3)


def test_a_front_that_reaches_its_toughness():
    """As in 2D: half of what the rate before gives; and inf goes along a front as far as it is."""
    da, rate = [np.array([0.1, 0.1])], [np.array([1e-3, 1e-3])]
    assert elapsed_3d([1.0], [1.1], da, rate, [np.array([1e-2, np.inf])]) == pytest.approx(50)
    x = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    values = np.array([1.0, 2.0, np.inf])
    target = np.array([[0.0, 0, 0], [0.5, 0, 0], [1.0, 0, 0], [1.5, 0, 0], [2.0, 0, 0]])
    got = interpolate_along_front(x, np.zeros(3, int), [False], values, target, 0.1)
    assert got.tolist() == [1.0, 1.5, 2.0, np.inf, np.inf]


def test_values_are_carried_to_a_front_that_has_moved():
    crack = penny()
    frames = front_frames(crack)[0]
    value = np.cos(np.arctan2(frames.x[:, 1], frames.x[:, 0]))
    new = front_points(grown(crack, 0.05, 0.05))
    number = np.zeros(64, int)
    result = interpolate_along_front(frames.x, number, [True], value, new, 0.1)
    assert result == pytest.approx(np.cos(np.arctan2(new[:, 1], new[:, 0])), abs=0.01)
    assert np.isnan(interpolate_along_front(frames.x, number, [True], value, new * 2, 0.1)).all()


def test_normals_agree_with_the_frames():
    crack = grown(penny(), 0.2, 0.1, angle=0.3)
    normal = face_normals(crack.points, crack.faces)
    assert (normal[:, 2] > 0.9).all()


def test_growth_in_a_body_until_the_front_has_left_it():
    """Placed again after each step: a closed front opens, splits at the faces, and is gone."""
    mesh = box((-1, -1, -1), (1, 1, 1), 12)
    body, size = Body.of(mesh), 0.6 * float(mesh.cell_size.min())
    crack = place_crack(penny_crack((0.1, 0.2, 0.03), (0, 0, 1), 0.5), mesh)
    kinds, area = [], []
    while crack.fronts and len(kinds) < 12:
        frames = front_frames(crack)
        s = np.concatenate([f.s for f in frames])
        number = np.repeat(np.arange(len(frames)), [len(f.s) for f in frames])
        moved = advance_fronts(crack, s, number, 0 * s, np.full(len(s), 0.1), size, body)
        check(moved, crack)
        crack = place_crack(moved, mesh)
        assert np.array_equal(crack.points[: len(moved.points)], moved.points)
        kinds.append(tuple(bool(f[0] == f[-1]) for f in crack.fronts))
        area.append(area_inside(crack, mesh))
    assert kinds[0] == (True,)
    assert kinds[-1] == ()
    assert (False, False) in kinds
    assert np.all(np.diff(area) > 0)
    assert area[0] == pytest.approx(np.pi * 0.6**2, rel=0.02)  # a polygon of about 30 sides
    assert area[-1] == pytest.approx(4.0, rel=2e-3)
