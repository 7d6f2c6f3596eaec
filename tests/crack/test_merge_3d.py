"""Two coplanar cracks made one: areas, one front, frozen points, what is refused.

Tolerances: circles are polygons of 96 sides (1e-3 of an area); fillets start at a point of a front
up to a side farther out than a circle would touch it.
"""

from dataclasses import replace

import numpy as np
import pytest

from xcrack import Crack, GeometryError, box, penny_crack, plane_crack, surface_crack
from xcrack.crack.front_chain import stitch_side
from xcrack.crack.fronts import front_frames
from xcrack.crack.merging import gap_between, merged_crack, turned_crack
from xcrack.crack.stations import place_crack
from xcrack.mesh.distances import closest_in, triangle_tree
from xcrack.mesh.locate import Body
from xcrack.mesh.triangulation import face_areas, face_normals, loops, oriented_faces

A = 1.0


def whole(crack):
    """A crack all of whose outline is front."""
    fronts = tuple(np.append(loop, loop[0]) for loop in loops(crack.faces))
    return Crack(crack.points, crack.faces, None, fronts)


def pennies(gap, n=96, height=0.0, tilt=0.0):
    d = A + gap / 2
    return (
        whole(penny_crack((-d, 0, 0), (0, 0, 1), A, n=n)),
        whole(penny_crack((d, 0, height), (np.sin(tilt), 0, np.cos(tilt)), A, n=n)),
    )


def closed_gap(gap, radius):
    """Area between two equal circles and the two discs that touch both."""
    half = A + gap / 2
    up = np.sqrt((A + radius) ** 2 - half**2)
    angle = np.arctan2(up, half)  # at the centres of the circles
    quarter = half * up / 2 - angle * A**2 / 2 - (np.pi / 2 - angle) * radius**2 / 2
    return 4 * quarter


def area(crack):
    return float(face_areas(crack.points, crack.faces).sum())


@pytest.mark.parametrize(("gap", "radius"), [(0.05, 0.2), (0.1, 0.4), (0.3, 0.4), (0.02, 1.0)])
def test_the_gap_is_closed_as_by_a_disc(gap, radius):
    """Area of the filled gap against that of circles that touch; 20 %: fillets start at points."""
    one, other = pennies(gap)
    both = merged_crack(one, other, radius, 0.1)
    filled = area(both) - area(one) - area(other)
    assert 1.0 < filled / closed_gap(gap, radius) < 1.2
    (front,) = both.fronts
    assert front[0] == front[-1]
    assert len(set(front[:-1].tolist())) == len(front) - 1
    (loop,) = loops(both.faces)
    start = int(np.nonzero(front == loop[0])[0][0])
    assert np.array_equal(np.roll(front[:-1], -start), loop)
    assert np.array_equal(oriented_faces(both.faces), both.faces)
    assert face_normals(both.points, both.faces)[:, 2].min() > 1 - 1e-12


def test_points_and_faces_of_both_stay_as_they_are():
    one, other = pennies(0.1)
    both = merged_crack(one, other, 0.3, 0.1)
    n, m = len(one.points), len(other.points)
    assert both.points[:n].tobytes() == one.points.tobytes()
    assert both.points[n : n + m].tobytes() == other.points.tobytes()
    assert np.array_equal(both.faces[: len(one.faces)], one.faces)


def test_hollow_corners_are_round():
    """The front turns inwards with about the radius of the disc, and nowhere sharply."""
    both = merged_crack(*pennies(0.05), 0.4, 0.1)
    (front,) = front_frames(both)
    back = front.x - np.roll(front.x, 1, axis=0)
    ahead = np.roll(front.x, -1, axis=0) - front.x
    lengths = np.linalg.norm(back, axis=1), np.linalg.norm(ahead, axis=1)
    turn = np.cross(back, ahead)[:, 2] / (lengths[0] * lengths[1])
    assert np.abs(turn).max() < np.sin(np.radians(35.0))
    inwards = turn > 0.05  # the front runs clockwise about z
    radius = (lengths[0] + lengths[1])[inwards] / 2 / turn[inwards]
    assert np.median(radius) == pytest.approx(0.4, rel=0.2)


def test_a_crack_that_looks_the_other_way_is_turned():
    one, other = pennies(0.1)
    mesh = box((-3, -2, -1), (3, 2, 1), (6, 4, 2))
    gap = gap_between(one, turned_crack(other), Body.of(mesh), 1.0)
    assert gap.turn == pytest.approx(-1.0)
    assert gap.width == pytest.approx(0.1, abs=1e-12)
    assert gap.x == pytest.approx((0, 0, 0))
    again = turned_crack(turned_crack(other))
    assert np.array_equal(again.faces, other.faces)
    assert np.array_equal(again.fronts[0], other.fronts[0])


@pytest.mark.parametrize(
    ("height", "tilt", "good"),
    [
        (0.0, 0.0, True),
        (0.15, 0.0, True),
        (0.25, 0.0, True),
        (0.8, 0.0, True),
        (0.85, 0.0, False),
        (0.0, 0.2, True),
        (0.0, 0.6, True),
        (0.0, 0.9, False),
    ],
)
def test_one_surface_is_a_matter_of_offset_and_angle(height, tilt, good):
    one, other = pennies(0.1, height=height - A * np.sin(tilt), tilt=tilt)
    mesh = box((-3, -2, -2), (3, 2, 2), (6, 4, 4))
    gap = gap_between(one, other, Body.of(mesh), 1.0)
    assert gap.in_surface(0.4) == good
    assert gap.faces
    if good:
        assert gap.offset == pytest.approx(height + 0.1 * np.sin(tilt), abs=0.11)
        # A step leads across.
        both = merged_crack(one, other, 0.4, 0.1, 0.82)
        assert len(both.fronts) == 1
        assert len(both.faces) > len(one.faces) + len(other.faces)


def test_cracks_beside_each_other_are_bridged_over_a_small_offset():
    one, other = pennies(0.1, height=0.05)
    both = merged_crack(one, other, 0.4, 0.1)
    assert len(both.fronts) == 1
    assert face_normals(both.points, both.faces)[:, 2].min() > 0.7


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("height", "tilt"), [(0.25, 0.0), (0.0, 0.4), (0.3, -0.3)])
def test_a_gap_is_closed_alike_in_a_mirror_and_with_other_numbers(axis, height, tilt):
    """The same surface, whose front begins at the same place, to round-off."""

    def mirrored(crack):
        points = crack.points * np.where(np.arange(3) == axis, -1.0, 1.0)
        return whole(surface_crack(points, crack.faces[:, ::-1]))

    one, other = pennies(0.1, height=height, tilt=tilt)
    smaller = surface_crack(0.9 * other.points + (0.1, 0.04, 0.0), other.faces)
    both = merged_crack(one, whole(smaller), 0.4, 0.1, 0.82)
    again = merged_crack(mirrored(smaller), mirrored(one), 0.4, 0.1, 0.82)
    (front,), (front_again,) = both.fronts, again.fronts
    x = mirrored(again).points
    assert np.abs(both.points[front[0]] - x[front_again[0]]).max() < 1e-9
    assert area(again) == pytest.approx(area(both), rel=1e-9)
    tree = triangle_tree(both.points, both.faces)
    assert closest_in(tree, x[again.faces].mean(axis=1)).distance.max() < 1e-9


def test_a_quad_is_cut_alike_in_a_mirror():
    """A twisted strip: of two ways to cut it that are as good, the one that bulges to lip +."""
    x = np.array([(0, 0, 0.1), (0, 1, -0.1), (1, 0, -0.1), (1, 1, 0.1)])
    normal, order = np.array([0, 0, -1.0]), [1, 0, 3, 2]

    def faces(corners, numbers, x, normal):
        return {frozenset(t) for t in stitch_side(corners, numbers, x, normal)[0]}

    assert np.linalg.norm(x[0] - x[3]) == pytest.approx(np.linalg.norm(x[1] - x[2]))
    cut = faces((0, 1), [2, 3], x, normal)
    assert faces((1, 0), [3, 2], (x * (1, -1, 1))[order], normal) == cut
    assert faces((1, 0), [3, 2], (x * (1, 1, -1))[order], -normal) == cut
    assert faces((1, 0), [3, 2], x[order], -normal) != cut  # the lips exchanged


def test_far_cracks_have_no_gap_to_close():
    one, other = pennies(1.0)
    mesh = box((-3, -2, -1), (3, 2, 1), (6, 4, 2))
    assert gap_between(one, other, Body.of(mesh), 0.9) is None
    with pytest.raises(GeometryError, match="0 and 0 pieces of the fronts"):
        merged_crack(one, other, 0.4, 0.1)


def test_a_crack_within_a_hole_of_another_is_refused():
    ring = np.linspace(0, 2 * np.pi, 65)[:-1]
    line = np.stack([np.cos(ring), np.sin(ring), 0 * ring], axis=1)
    points = np.concatenate([line, 1.6 * line])
    i = np.arange(64)
    j = (i + 1) % 64
    faces = np.concatenate([np.stack([i, i + 64, j], 1), np.stack([j, i + 64, j + 64], 1)])
    outer = whole(surface_crack(points, faces))
    inner = whole(penny_crack((0, 0, 0), (0, 0, 1), 0.9, n=64))
    with pytest.raises(GeometryError, match="encloses"):
        merged_crack(outer, inner, 0.3, 0.1)


def test_two_cracks_from_one_side_meet_at_the_surface():
    """Half discs side by side: an open front from side to side, the gap closed out of the body."""
    mesh = box((-3, 0, -1), (3, 2, 1), (30, 10, 10))
    half = np.linspace(0, np.pi, 33)
    arc = np.stack([np.cos(half), np.sin(half), 0.013 + 0 * half], axis=1)
    pair = [place_crack(plane_crack(arc + np.array([c, 0, 0])), mesh) for c in (-1.05, 1.05)]
    both = merged_crack(*pair, 0.3, 0.1)
    assert len(both.fronts) == 1
    placed = place_crack(both, mesh)
    (front,) = placed.fronts
    ends = placed.points[front[[0, -1]]]
    assert front[0] != front[-1]
    assert (ends[:, 1] < 0).all()
    assert np.sort(ends[:, 0]) == pytest.approx([-2.05, 2.05], abs=0.1)
    inner = placed.points[front]
    assert inner[np.abs(inner[:, 0]) < 0.3, 1].min() > 0.2


def test_two_straight_fronts_of_a_plate_vanish_together():
    """Through cracks: the fronts that face each other are gone, the others stay."""
    mesh = box((-3, 0, -1), (3, 1, 1), (30, 5, 10))
    pair = [
        place_crack(
            plane_crack([(x0, -1, 0.013), (x1, -1, 0.013), (x1, 2, 0.013), (x0, 2, 0.013)]), mesh
        )
        for x0, x1 in ((-2.05, -0.05), (0.06, 1.98))
    ]
    assert [len(crack.fronts) for crack in pair] == [2, 2]
    both = place_crack(merged_crack(*pair, 0.3, 0.1), mesh)
    x = sorted(both.points[front][:, 0].mean() for front in both.fronts)
    assert x == pytest.approx([-2.05, 1.98], abs=1e-12)


def test_the_gap_is_that_within_the_body():
    """Discs that come closest outside: at the side of the body they are a chord apart.

    Exact; the spacing of the points along the fronts is .05, of which eight lie on a side.
    """
    for side in (0.2, 0.6):
        mesh = box((-3, side, -1), (3, 2, 1), (12, 4, 4))
        gap = gap_between(*pennies(0.3), Body.of(mesh), 3.0)
        assert gap.width == pytest.approx(0.3 + 2 * (A - np.sqrt(A**2 - side**2)), abs=0.02)
        assert gap.faces


def test_the_gap_closes_as_the_cracks_do():
    """Widths while one crack moves by a sixtieth of a side: no jump (round-off of the placing)."""
    mesh = box((-3, 0.35, -1), (3, 2, 1), (12, 4, 4))
    one, other = pennies(0.3)
    shift = np.linspace(0.0, 0.2, 21)
    body = Body.of(mesh)
    moved = [replace(other, points=other.points - [d, 0, 0]) for d in shift]
    width = np.array([gap_between(one, crack, body, 3.0).width for crack in moved])
    assert np.diff(width) == pytest.approx(-np.diff(shift), abs=1e-6)
