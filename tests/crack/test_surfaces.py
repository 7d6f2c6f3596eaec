"""3D cracks: how they are described, and what of them becomes front in a mesh."""

import numpy as np
import pytest

import xcrack as xc
from xcrack import (
    Crack,
    GeometryError,
    XcrackError,
    elliptic_crack,
    penny_crack,
    plane_crack,
    read_surface,
    surface_crack,
)
from xcrack.crack.boundary_trace import Body
from xcrack.crack.fronts import front_frames
from xcrack.crack.placing_3d import check_surfaces
from xcrack.crack.stations import place_crack
from xcrack.fem.level_set import extended_surface
from xcrack.mesh.triangulation import face_areas, face_normals, loops, rim, ruled_strip, side_keys

SQUARE = [(-0.5, -0.5, 0.03), (0.5, -0.5, 0.03), (0.5, 0.5, 0.03), (-0.5, 0.5, 0.03)]


@pytest.fixture(scope="module")
def cube():
    return xc.box((-1, -1, -1), (1, 1, 1), 12)


@pytest.fixture(scope="module")
def body(cube):
    return Body.of(cube)


def rectangle(x0, x1, y0, y1, z=0.03):
    return plane_crack([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])


def area_of(crack):
    return face_areas(crack.points, crack.faces).sum()


# --- constructors ---------------------------------------------------------------------------


@pytest.mark.parametrize("n", [8, 50, 96, 97, 128])
def test_penny_is_a_disc_of_good_triangles(n):
    crack = penny_crack((1, 2, 3), (2, -1, 2), 0.7, n=n)
    normal = np.array([2, -1, 2]) / 3
    np.testing.assert_allclose(face_normals(crack.points, crack.faces) @ normal, 1, atol=1e-12)
    # the area of a regular polygon
    area = n / 2 * 0.7**2 * np.sin(2 * np.pi / n)
    assert area_of(crack) == pytest.approx(area, rel=1e-12)
    (loop,) = loops(crack.faces)
    assert len(loop) == n
    radius = np.linalg.norm(crack.points[loop] - [1, 2, 3], axis=1)
    np.testing.assert_allclose(radius, 0.7, rtol=1e-13)
    if n % 16 == 0:
        corner = crack.points[crack.faces]
        longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
        assert (face_areas(crack.points, crack.faces) / longest**2).min() > 0.2


def test_default_penny_keeps_its_sagitta_small():
    crack = penny_crack((0, 0, 0), (0, 0, 1), 1.0)
    edges, _ = rim(crack.faces)
    middle = np.linalg.norm(crack.points[edges].mean(axis=1), axis=1)
    assert 1 - middle.min() < 1e-3


def test_penny_is_symmetric_to_the_last_bit():
    x = penny_crack((0, 0, 0), (0, 0, 1), 0.5).points + 0.0  # no negative zeros
    rows = {tuple(row) for row in x}
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        assert {tuple(row) for row in x * mirror + 0.0} == rows


def test_ellipse_has_its_axes():
    crack = elliptic_crack((0, 0, 1), (0, 0, 1), (1, 1, 5), 0.8, 0.2)
    local = crack.points - [0, 0, 1]
    along = local @ np.array([1, 1, 0]) / np.sqrt(2)
    across = local @ np.array([-1, 1, 0]) / np.sqrt(2)
    assert along.max() == pytest.approx(0.8, rel=1e-12)
    assert across.max() == pytest.approx(0.2, rel=1e-12)
    (loop,) = loops(crack.faces)
    np.testing.assert_allclose((along[loop] / 0.8) ** 2 + (across[loop] / 0.2) ** 2, 1, rtol=1e-12)


def test_plane_crack_covers_its_polygon_and_looks_along_its_normal():
    rng = np.random.default_rng(818)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 40))
    radius = rng.uniform(0.3, 1.0, 40)
    flat = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    polygon = np.column_stack([flat, np.zeros(40)]) @ turn.T + [3, 1, 2]
    crack = plane_crack(polygon)
    after = np.roll(flat, -1, axis=0)
    shoelace = (flat[:, 0] * after[:, 1] - flat[:, 1] * after[:, 0]).sum() / 2
    assert area_of(crack) == pytest.approx(shoelace, rel=1e-12)
    np.testing.assert_allclose(
        face_normals(crack.points, crack.faces), np.tile(turn[:, 2], (38, 1)), atol=1e-9
    )
    turned = plane_crack(polygon[::-1])
    np.testing.assert_allclose(face_normals(turned.points, turned.faces)[0], -turn[:, 2], atol=1e-9)


def test_surface_crack_turns_its_faces_alike():
    crack = penny_crack((0, 0, 0), (0, 0, 1), 1.0, n=32)
    rng = np.random.default_rng(5171)
    faces = np.array(crack.faces)
    turned = rng.uniform(size=len(faces)) < 0.5
    turned[0] = False
    faces[turned] = faces[turned][:, ::-1]
    points = np.vstack([crack.points, [[9, 9, 9]]])
    again = surface_crack(points, faces)
    assert len(again.points) == len(crack.points)
    assert (face_normals(again.points, again.faces)[:, 2] > 0).all()


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".vtk", ".ply"])
def test_surface_from_a_file(tmp_path, suffix):
    import meshio

    crack = penny_crack((0, 0, 0), (1, 0, 2), 0.5, n=32)
    path = tmp_path / f"disc{suffix}"
    meshio.write(path, meshio.Mesh(np.array(crack.points), [("triangle", np.array(crack.faces))]))
    again = read_surface(path)
    assert len(again.points) == len(crack.points)
    assert again.faces.shape == crack.faces.shape
    assert area_of(again) == pytest.approx(area_of(crack), rel=1e-6)  # single precision
    assert len(loops(again.faces)) == 1


def test_surface_file_that_is_none(tmp_path):
    with pytest.raises(XcrackError, match="does not exist"):
        read_surface(tmp_path / "nowhere.stl")
    (tmp_path / "words.stl").write_text("no surface")
    with pytest.raises(XcrackError):
        read_surface(tmp_path / "words.stl")


MOEBIUS = [(np.cos(t), np.sin(t), 0) for t in np.linspace(0, 2 * np.pi, 7)[:-1]]
BAD = {
    "nan centre": (lambda: penny_crack((0, np.nan, 0), (0, 0, 1), 1), "center"),
    "no normal": (lambda: penny_crack((0, 0, 0), (0, 0, 0), 1), "normal"),
    "no radius": (lambda: penny_crack((0, 0, 0), (0, 0, 1), 0), "radius"),
    "negative radius": (lambda: penny_crack((0, 0, 0), (0, 0, 1), -1), "radius"),
    "few points": (lambda: penny_crack((0, 0, 0), (0, 0, 1), 1, n=4), "n = 4"),
    "plane centre": (lambda: penny_crack((0, 0), (0, 0, 1), 1), r"shape \(3,\)"),
    "axis along normal": (lambda: elliptic_crack((0, 0, 0), (0, 0, 1), (0, 0, 2), 2, 1), "axis"),
    "half-axis": (
        lambda: elliptic_crack((0, 0, 0), (0, 0, 1), (1, 0, 0), 2, np.inf),
        "b = inf is not possible",
    ),
    "two corners": (lambda: plane_crack(SQUARE[:2]), "three corners"),
    "doubled corner": (lambda: plane_crack([*SQUARE, SQUARE[0]]), "leave one out"),
    "not plane": (lambda: plane_crack([*SQUARE[:3], (-0.5, 0.5, 0.04)]), "off the plane"),
    "on a line": (lambda: plane_crack([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), "no area"),
    "bow tie": (lambda: plane_crack([(0, 0, 0), (3, 2, 0), (3, 0, 0), (0, 1, 0)]), "in order"),
    "touching itself": (
        lambda: plane_crack([(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0, 0), (0, 2, 0)]),
        "in order",
    ),
    "nan corner": (lambda: plane_crack([*SQUARE[:3], (0, 0, np.nan)]), r"polygon\[3, 2\] = nan"),
    "no triangles": (lambda: surface_crack(SQUARE, np.zeros((0, 3), int)), "triangles"),
    "number out of range": (lambda: surface_crack(SQUARE, [(0, 1, 4)]), "outside"),
    "flat triangle": (lambda: surface_crack([*SQUARE, (0, 0.5, 0.03)], [(2, 3, 4)]), "no area"),
    "branch": (
        lambda: surface_crack([*SQUARE, (0, 0, 1)], [(0, 1, 2), (0, 2, 3), (0, 2, 4)]),
        "3 triangles meet",
    ),
    "point contact": (
        lambda: surface_crack([*SQUARE, (2, 2, 1)], [(0, 1, 2), (2, 3, 4)]),
        "touch",
    ),
    "closed": (
        lambda: surface_crack(
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
            [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)],
        ),
        "closed",
    ),
    "one-sided": (
        lambda: surface_crack(
            [(1, 0, 0.2), (-0.5, 0.9, 0.1), (-0.5, -0.9, 0), (0.2, 0.1, 1), (0.1, 0.3, -1)],
            [(0, 1, 2), (1, 2, 3), (2, 3, 4), (3, 4, 0), (4, 0, 1)],
        ),
        "one side",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_descriptions(case):
    make, message = BAD[case]
    with pytest.raises(GeometryError, match=message):
        make()


# --- placing --------------------------------------------------------------------------------


def check_fronts(crack, body, plane=True):
    """What every placed crack must satisfy; returns the number of vertices inside each front."""
    counts = []
    _, count = np.unique(side_keys(crack.faces), return_counts=True)
    assert count.max() == 2
    if plane:
        normal = face_normals(crack.points, crack.faces)
        assert (normal @ normal[0]).min() > 1 - 1e-12
    edges = {(int(b), int(a)) for a, b in rim(crack.faces)[0]}
    on_front = np.zeros(len(crack.points), dtype=bool)
    for number, front in zip(crack.fronts, front_frames(crack), strict=True):
        assert all(pair in edges for pair in zip(number[:-1], number[1:], strict=True))
        on_front[number] = True
        depth, _ = body.depth(front.x)
        size = body.cell_size(front.x)
        counts.append(int((depth < 0).sum()))
        if not front.is_closed:
            assert (depth[[0, -1]] >= 1.99 * size[[0, -1]]).all()
        else:
            assert (depth < 0).all()
    mouth = np.setdiff1d(np.unique(rim(crack.faces)[0]), np.nonzero(on_front)[0])
    depth, _ = body.depth(crack.points[mouth])
    assert (depth >= 0.99 * body.cell_size(crack.points[mouth])).all()
    return counts


def test_penny_inside_has_one_closed_front_clockwise(cube, body):
    placed = place_crack(penny_crack((0, 0, 0), (0, 0, 1), 0.5), cube)
    assert check_fronts(placed, body) == [128]
    (front,) = placed.fronts
    assert front[0] == front[-1]
    x = placed.points[front]
    assert np.cross(x[:-1], x[1:])[:, 2].max() < 0


def test_half_penny_at_a_face_has_one_open_front(cube, body):
    placed = place_crack(penny_crack((1, 0, 0.03), (0, 0, 1), 0.5), cube)
    (inside,) = check_fronts(placed, body)
    assert inside == pytest.approx(64, abs=2)


CASES = {
    # crack and the number of open fronts
    "inclined half penny": (penny_crack((1, 0, 0.03), (0.3, 0.1, 1), 0.5), 1),
    "quarter penny": (penny_crack((1, 1, 0.03), (0, 0, 1), 0.6), 1),
    "penny that just comes out": (penny_crack((0.55, 0, 0.03), (0, 0, 1), 0.5), 1),
    "penny across an edge": (penny_crack((0.62, 0.62, 0.03), (0, 0.4, 1), 0.5), 1),
    "penny out of four faces": (penny_crack((0, 0, 0.03), (0, 0, 1), 1.08), 4),
    "edge crack, exact": (rectangle(-1, 0, -1, 1), 1),
    "edge crack, a little short": (rectangle(-0.97, 0, -0.97, 0.97), 1),
    "edge crack, a little long": (rectangle(-1.04, 0, -1.04, 1.04), 1),
    "edge crack, far out": (rectangle(-4, 0.1, -5, 6), 1),
    "corner crack": (rectangle(0, 2, 0, 2), 1),
    "out of two faces": (rectangle(-0.3, 0.3, -1, 1), 2),
    "through, exact": (rectangle(-1, 1, -1, 1), 0),
    "through, far out": (rectangle(-3, 4, -5, 6), 0),
}


@pytest.mark.parametrize("case", CASES)
def test_fronts_are_open_and_led_outside(case, cube, body):
    crack, n_fronts = CASES[case]
    placed = place_crack(crack, cube)
    assert len(placed.fronts) == n_fronts
    assert all(front[0] != front[-1] for front in placed.fronts)
    assert all(count >= 3 for count in check_fronts(placed, body))
    again = place_crack(placed, cube)
    np.testing.assert_array_equal(again.points, placed.points)
    np.testing.assert_array_equal(again.faces, placed.faces)
    for one, other in zip(again.fronts, placed.fronts, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_small_crack_in_a_corner_is_followed_by_its_front_outside():
    """A front that left its outline at the sides went on at 45 degrees, and its ends ran ahead."""
    coarse = xc.box((-1, -1, -1), (1, 1, 1), 8)  # radius 1.85 cells
    corner = np.array([-1.0, -1.0, 0.04])
    placed = place_crack(penny_crack(corner, (0, 0, 1), 0.8), coarse)
    (front,) = placed.fronts
    x = placed.points[front]
    depth, size = Body.of(coarse).depth(x)[0], Body.of(coarse).cell_size(x)
    near = depth <= 1.25 * size
    assert (near & (depth > size)).any()
    np.testing.assert_allclose(np.linalg.norm(x[near] - corner, axis=1), 0.8, rtol=1e-12)
    assert (depth[[0, -1]] > 1.9 * size[[0, -1]]).all()


def test_straight_front_ends_on_the_surface_and_goes_on_straight(cube):
    placed = place_crack(rectangle(-1, 0.1, -1, 1), cube)
    (front,) = front_frames(placed)
    np.testing.assert_allclose(front.x[:, [0, 2]], np.tile([0.1, 0.03], (len(front.x), 1)))
    np.testing.assert_allclose(front.frame[:, 0], np.tile([1, 0, 0], (len(front.x), 1)), atol=1e-14)
    assert np.abs(front.x[:, 1]).max() > 1.3


def test_sides_of_the_outline_are_at_most_a_cell(cube, body):
    for crack in (rectangle(-3, 0.1, -5, 6), rectangle(-0.5, 0.6, -0.5, 0.4)):
        placed = place_crack(crack, cube)
        for front in front_frames(placed):
            size = body.cell_size(front.x)
            assert (np.diff(front.s) < size[1:]).all()


def test_front_corners_are_rounded_and_mouth_corners_are_not(cube):
    square = place_crack(plane_crack([(6 * x / 5, 6 * y / 5, z) for x, y, z in SQUARE]), cube)
    (front,) = front_frames(square)
    radius = 0.45 * 1.2  # the room that corners 1.2 apart leave for arcs of 2 * 0.2887
    assert area_of(square) == pytest.approx(1.44 - (4 - np.pi) * radius**2, rel=0.02)
    turn = np.einsum("ij,ij->i", front.frame[:, 2], np.roll(front.frame[:, 2], 1, axis=0))
    assert turn.min() > np.cos(np.radians(25))
    edge = place_crack(rectangle(-1.5, 0, -1.5, 1.5), cube)
    assert len(front_frames(edge)[0].x) > 0
    assert {(-1.5, -1.5), (-1.5, 1.5)} <= {tuple(row) for row in edge.points[:, :2].tolist()}
    corner = place_crack(rectangle(0, 2, 0, 2), cube)
    lost = 4 - area_of(corner)
    assert lost == pytest.approx((1 - np.pi / 4) * (2 * np.sqrt(3) / 6) ** 2, rel=0.1)


def test_curved_surface_is_placed(cube, body):
    t = np.linspace(0, 1, 15)
    x, y = np.meshgrid(2.4 * t - 1.2, 1.4 * t - 1.2, indexing="ij")
    points = np.stack([x, y, 0.25 * np.cos(2 * x)], axis=-1).reshape(-1, 3)
    k = np.arange(225).reshape(15, 15)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    placed = place_crack(surface_crack(points, faces), cube)
    check_fronts(placed, body, plane=False)
    (front,) = front_frames(placed)
    inside = body.contains(front.x)
    np.testing.assert_allclose(front.x[inside, 1], 0.2, atol=1e-12)
    np.testing.assert_allclose(front.frame[inside, 0], [[0, 1, 0]] * int(inside.sum()), atol=1e-12)


def test_two_pieces_and_a_hole(cube, body):
    """A ring has two closed fronts, the inner one the other way round."""
    disc = penny_crack((0, 0, 0.03), (0, 0, 1), 0.8)
    r = np.hypot(*disc.points[disc.faces].mean(axis=1)[:, :2].T)
    placed = place_crack(surface_crack(disc.points, disc.faces[r > 0.35]), cube)
    outer, inner = front_frames(placed)
    assert check_fronts(placed, body) == [len(outer.x), len(inner.x)]
    assert outer.is_closed
    assert inner.is_closed
    assert (np.einsum("ij,ij->i", outer.x, outer.frame[:, 0]) > 0).all()
    assert (np.einsum("ij,ij->i", inner.x, inner.frame[:, 0]) < 0).all()
    two = surface_crack(
        np.vstack([disc.points * 0.4 + [0.5, 0, 0], disc.points * 0.4 - [0.5, 0, 0]]),
        np.vstack([disc.faces, disc.faces + len(disc.points)]),
    )
    assert len(place_crack(two, cube).fronts) == 2


def grown(crack, da):
    """The crack with a row of faces ahead of each front."""
    points, faces, fronts = crack.points, crack.faces, []
    for front in front_frames(crack):
        number = len(points) + np.arange(len(front.x))
        new, row = ruled_strip(
            len(points), front.number, front.x, da * front.frame[:, 0], 1, front.is_closed
        )
        points, faces = np.concatenate([points, new]), np.concatenate([faces, row])
        fronts.append(np.append(number, number[:1]) if front.is_closed else number)
    return Crack(points, faces, None, tuple(fronts))


def test_front_that_reaches_four_faces_splits_and_vanishes(cube):
    """The disc of radius 0.7 grows until it has cut the body; old points stay as they are."""
    crack = place_crack(penny_crack((0, 0, 0.03), (0, 0, 1), 0.7, n=64), cube)
    seen = []
    for _ in range(12):
        larger = grown(crack, 0.08)
        crack = place_crack(larger, cube)
        np.testing.assert_array_equal(crack.points[: len(larger.points)], larger.points)
        np.testing.assert_array_equal(crack.faces[: len(larger.faces)], larger.faces)
        seen.append(len(crack.fronts))
        if not crack.fronts:
            break
    assert seen[0] == 1
    assert 4 in seen
    assert seen[-1] == 0


def test_front_leaves_through_a_far_face(cube, body):
    crack = place_crack(rectangle(-1, 0.5, -1, 1), cube)
    for _ in range(8):
        crack = place_crack(grown(crack, 0.1), cube)
        check_fronts(crack, body)
        if not crack.fronts:
            break
    assert crack.fronts == ()


@pytest.mark.parametrize("seed", [2718, 1618, 5772])
def test_drawn_cracks_have_ends_outside(seed, cube, body):
    """Ellipses of any place and turn: whatever is accepted is sound, and stays as it is."""
    rng = np.random.default_rng(seed)
    accepted = 0
    for _ in range(12):
        crack = elliptic_crack(
            rng.uniform(-1, 1, 3),
            rng.normal(size=3),
            rng.normal(size=3),
            rng.uniform(0.5, 1.4),
            rng.uniform(0.3, 0.8),
        )
        try:
            placed = place_crack(crack, cube)
        except GeometryError:
            continue
        accepted += 1
        edges = {(int(b), int(a)) for a, b in rim(placed.faces)[0]}
        for number, front in zip(placed.fronts, front_frames(placed), strict=True):
            assert all(pair in edges for pair in zip(number[:-1], number[1:], strict=True))
            depth, _ = body.depth(front.x[[0, -1]])
            assert front.is_closed or (depth > 1.9 * body.cell_size(front.x[[0, -1]])).all()
        again = place_crack(placed, cube)
        np.testing.assert_array_equal(again.points, placed.points)
    assert accepted >= 9


def test_extension_reaches_ahead_of_every_front(cube):
    placed = place_crack(rectangle(-0.3, 0.3, -1, 1), cube)
    surface = extended_surface(placed, cube, 0.25)
    for k, x in ((1, -0.55), (2, 0.55)):
        strip = surface.points[np.unique(surface.triangles[surface.label == k])]
        ends = {round(float(v), 12) for v in (strip[:, 0].min(), strip[:, 0].max())}
        assert x in ends
    assert (surface.triangles[surface.label == 0] == placed.faces).all()


def test_strips_are_crossed_where_they_are_not_flat(cube):
    """Two triangles a field ahead of a plane crack, four where rays from a bent one turn."""
    disc = penny_crack((0, 0, 0.03), (0, 0, 1), 0.5)
    bent = xc.surface_crack(disc.points + np.outer(disc.points[:, 0] ** 2, (0, 0, 0.3)), disc.faces)
    both = [extended_surface(place_crack(crack, cube), cube, 0.25) for crack in (disc, bent)]
    flat_strip, twisted_strip = ((surface.label == 1).sum() for surface in both)
    assert twisted_strip == pytest.approx(2 * flat_strip, rel=0.05)


@pytest.mark.parametrize(
    ("crack", "message"),
    [
        (penny_crack((3, 0, 0), (0, 0, 1), 0.5), "outside the body"),
        (rectangle(-1, 1, -1, 1, z=1.0), "lies on the boundary.*model both halves"),
        (penny_crack((0.02, 0, 0), (0, 0, 1), 0.05), "less than the cell"),
        (penny_crack((1.44, 0, 0), (0, 0, 1), 0.5), "less than half a cell"),
    ],
    ids=["outside", "on the boundary", "small", "nick"],
)
def test_cracks_that_no_mesh_takes(crack, message, cube):
    with pytest.raises(GeometryError, match=message):
        place_crack(crack, cube)


def sheet(profile, n=8):
    """A surface ruled along y over a profile of x and z `(k, 2)`."""
    y = np.linspace(-0.45, 0.45, n)
    x = np.array([(a, b, c) for a, c in profile for b in y])
    k = np.arange(len(x)).reshape(-1, n)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return surface_crack(x, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def hairpin(gap):
    """A sheet that turns back, with a gap between its parts."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 10)
    turn = [0.3, gap / 2] + gap / 2 * np.column_stack([np.cos(t), np.sin(t)])
    x = np.linspace(-0.5, 0.3, 9)[:-1]
    ways = np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x + gap])
    return sheet(np.array((0.01, 0.02)) + np.concatenate([ways[0], turn, ways[1]]))


def folded(degrees):
    t, angle = np.linspace(0, 0.5, 6)[:, None], np.radians(degrees)
    ways = t[::-1] * [1, 0], t[1:] * [np.cos(angle), np.sin(angle)]
    return sheet(np.array((-0.2, 0.03)) + np.concatenate(ways))


def loop_of_rope():
    """A sheet that runs across itself."""
    t = np.linspace(-0.5, 2 * np.pi - 0.7, 40)
    return sheet(np.column_stack([0.5 * np.sin(t), 0.35 * np.sin(2 * t)]) + 0.017)


def pieces(*cracks):
    first = np.cumsum([0, *(len(crack.points) for crack in cracks)])
    faces = [crack.faces + n for crack, n in zip(cracks, first, strict=False)]
    return surface_crack(np.concatenate([crack.points for crack in cracks]), np.concatenate(faces))


DISC = penny_crack((0, 0, 0.03), (0, 0, 1), 0.8, n=48)
ACROSS = penny_crack((0.05, 0, 0.05), (1, 0, 0.3), 0.5, n=24)
BESIDE = penny_crack((0.1, 0, 0.03), (0, 0, 1), 0.8, n=48)


@pytest.mark.parametrize(
    ("crack", "message"),
    [
        (hairpin(0.1), "0.1 apart, less than half a cell .*refine the mesh between"),
        (folded(5), "apart, less than half a cell .*open it to 40 degrees"),
        (folded(20), "apart, less than half a cell .*open it to 40 degrees"),
        (loop_of_rope(), "crosses itself near.*arm"),
        (pieces(DISC, ACROSS), "pieces of the surface crack meet near.*cracks of their own"),
        (pieces(DISC, BESIDE), "pieces of the surface crack meet near.*leave out what lies"),
    ],
    ids=["hairpin", "fold of 5", "fold of 20", "loop", "crossing", "on each other"],
)
def test_surfaces_that_meet_themselves(crack, message):
    with pytest.raises(GeometryError, match=message):
        place_crack(crack, xc.box((-1,) * 3, (1,) * 3, 8))


def test_remedies_for_surfaces_that_meet_themselves():
    """What the refusals say is done, and the crack is taken."""
    coarse, fine = (xc.box((-1,) * 3, (1,) * 3, n) for n in (8, 20))
    assert len(place_crack(hairpin(0.1), fine).fronts) == 1
    assert len(place_crack(folded(40), coarse).fronts) == 1
    arms = [xc.arm(ACROSS, on=0, side=side) for side in (1, -1)]
    scene = xc.Problem(coarse, xc.Isotropic(1.0, 0.3), cracks=[DISC, *arms])
    assert all(crack.fronts for crack in scene.placed)


def test_plane_and_space_do_not_mix(cube):
    with pytest.raises(GeometryError, match="3D crack"):
        place_crack(penny_crack((0, 0, 0), (0, 0, 1), 0.5), xc.box((0, 0), (1, 1), 4))
    with pytest.raises(GeometryError, match="2D crack"):
        place_crack(xc.line_crack([(0, 0), (1, 0)]), cube)


def test_a_notch_is_narrower_than_a_cell(body):
    """A mouth in a slit of half a cell: it ends half way, not in the body across."""
    mesh = xc.box((0, 0, 0), (1, 1, 1), (20, 8, 8))
    middle = mesh.points[mesh.cells].mean(axis=1)
    slit = (np.abs(middle[:, 0] - 0.475) < 0.025) & (middle[:, 2] > 0.25)
    used, inverse = np.unique(mesh.cells[~slit], return_inverse=True)
    mesh = xc.Mesh(mesh.points[used], inverse.reshape(-1, 4))
    placed = place_crack(rectangle(0.5, 0.8, 0, 1, z=0.6), mesh)
    (front,) = front_frames(placed)
    np.testing.assert_allclose(front.x[:, 0], 0.8, atol=1e-12)
    mouth = placed.points[np.abs(placed.points[:, 1] - 0.5) < 0.3]
    assert 0.45 < mouth[:, 0].min() < 0.5


# --- several cracks -------------------------------------------------------------------------


def placed_pair(cube, *cracks):
    return tuple(place_crack(crack, cube) for crack in cracks)


def test_cracks_that_cross_or_touch(cube):
    one = penny_crack((0, 0, 0.03), (0, 0, 1), 0.5)
    for other, words in (
        (penny_crack((0.2, 0, 0.1), (1, 0, 0.2), 0.4), "cracks 0 and 1 cross"),
        (penny_crack((0.4, 0, 0.03), (0, 0, 1), 0.5), "cracks 0 and 1 lie on each other"),
        (penny_crack((0, 0, 0.03), (0, 0, 1), 0.25), "cracks 0 and 1 lie on each other"),
    ):
        with pytest.raises(GeometryError, match=words):
            check_surfaces(placed_pair(cube, one, other), cube)


def test_fronts_closer_than_a_cell(cube):
    one = penny_crack((-0.4, 0, 0.03), (0, 0, 1), 0.3)
    close = penny_crack((0.35, 0, 0.03), (0, 0, 1), 0.3)
    apart = penny_crack((0.55, 0, 0.03), (0, 0, 1), 0.3)
    with pytest.raises(GeometryError, match="closer than a cell"):
        check_surfaces(placed_pair(cube, one, close), cube)
    tangent = penny_crack((0.2, 0, 0.03), (0, 0, 1), 0.3)
    with pytest.raises(GeometryError, match="share the point"):
        check_surfaces(placed_pair(cube, one, tangent), cube)
    check_surfaces(placed_pair(cube, one, apart), cube)
    check_surfaces(placed_pair(cube, one), cube)


def test_cracks_may_meet_outside(cube):
    """Mouths that are led outside may cross there."""
    one = place_crack(rectangle(-1, -0.2, -1, 1, z=0.4), cube)
    tilted = plane_crack([(-1, -1, 0.7), (-1, 1, 0.7), (-0.2, 1, 1.6), (-0.2, -1, 1.6)])
    check_surfaces((one, place_crack(tilted, cube)), cube)
