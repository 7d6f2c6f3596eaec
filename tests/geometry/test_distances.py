"""Distances to surfaces and fronts in 3D: naive twins, signs, flat and curved cracks."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import xcrack as xc
from xcrack import Crack, elliptic_crack, penny_crack, plane_crack, surface_crack
from xcrack.crack.fronts import front_frames
from xcrack.crack.stations import place_crack
from xcrack.fem.level_set import extended_surface
from xcrack.mesh.distances import (
    closest_in,
    closest_on_segment,
    distance_to_simplices,
    first_crossing,
    front_distance,
    signed_in,
    surface_distance,
    triangle_tree,
)
from xcrack.mesh.kernels.location import nearest_vertices
from xcrack.mesh.triangulation import face_normals, rim, split_sides

ROUND_OFF = 1e-14


def cube(n=8):
    return xc.box((-1, -1, -1), (1, 1, 1), n)


def bumpy(rng, n=9):
    """A surface with hills, of triangles of several sizes."""
    t = np.sort(np.concatenate([[0, 1], rng.uniform(0, 1, n - 2)]))
    x, y = np.meshgrid(t, t, indexing="ij")
    points = np.stack([x, y, 0.15 * np.sin(5 * x) * np.cos(4 * y)], axis=-1).reshape(-1, 3)
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return points, faces


def test_distance_agrees_with_its_naive_twin():
    rng = np.random.default_rng(60421)
    points, faces = bumpy(rng)
    x = rng.uniform(-0.4, 1.4, (500, 3)) * [1, 1, 0.5]
    phi, triangle, _ = surface_distance(x, points, faces)
    naive = np.array([distance_to_simplices(p, points[faces]) for p in x])
    np.testing.assert_allclose(np.abs(phi), naive.min(axis=1), atol=ROUND_OFF)
    at = naive[np.arange(len(x)), triangle]
    np.testing.assert_allclose(at, naive.min(axis=1), atol=ROUND_OFF)


def test_band_only_leaves_out():
    rng = np.random.default_rng(7193)
    points, faces = bumpy(rng)
    x = rng.uniform(-0.5, 1.5, (2000, 3))
    phi, triangle, rim_of = surface_distance(x, points, faces)
    near, narrow, narrow_rim = surface_distance(x, points, faces, band=0.2)
    inside = np.abs(phi) < 0.2
    np.testing.assert_array_equal(near[inside], phi[inside])
    np.testing.assert_array_equal(narrow[inside], triangle[inside])
    np.testing.assert_array_equal(narrow_rim[inside], rim_of[inside])
    assert (near[~inside] == 0.2).all()
    assert (narrow[~inside] == -1).all()


@pytest.mark.parametrize("closed", [True, False])
def test_front_distance_agrees_with_its_naive_twin(closed):
    rng = np.random.default_rng(8837)
    polyline = np.cumsum(rng.normal(size=(40, 3)), axis=0)
    x = rng.uniform(polyline.min(), polyline.max(), (400, 3))
    r, segment, position = front_distance(x, polyline, closed)
    start = polyline if closed else polyline[:-1]
    stop = np.roll(polyline, -1, axis=0)[: len(start)]
    naive = np.array([np.linalg.norm(p - closest_on_segment(p, start, stop), axis=1) for p in x])
    np.testing.assert_allclose(r, naive.min(axis=1), rtol=1e-13)  # round-off
    foot = start[segment] + position[:, None] * (stop - start)[segment]
    np.testing.assert_allclose(np.linalg.norm(x - foot, axis=1), r, rtol=1e-13)
    banded, nearest, _ = front_distance(x, polyline, closed, band=1.0)
    np.testing.assert_array_equal(nearest >= 0, r < 1.0)
    np.testing.assert_array_equal(banded, np.minimum(r, 1.0))


def test_signs_around_a_sharp_fold():
    """The side of a fold of 20 degrees, where single face normals go wrong."""
    half = np.radians(10)
    wing = np.array([np.sin(half), 0, -np.cos(half)])
    points = np.array([[0, 0, 0], [0, 1, 0], wing, wing, wing * [-1, 1, 1]])
    points[3, 1] = 1
    points = np.vstack([points, points[4:]])
    points[5, 1] = 1
    faces = np.array([[0, 2, 3], [0, 3, 1], [1, 5, 4], [1, 4, 0]])
    rng = np.random.default_rng(5230)
    x = rng.uniform((-0.3, 0.05, -0.8), (0.3, 0.95, 0.4), (4000, 3))
    phi, _, at_rim = surface_distance(x, points, faces)
    between = np.abs(x[:, 0]) < -np.tan(half) * x[:, 2]
    lip = face_normals(points, faces)[0, 0] > 0
    clear = ~at_rim & (np.abs(phi) > 1e-9)
    assert clear.sum() > 2000
    np.testing.assert_array_equal(phi[clear] > 0, (~between if lip else between)[clear])


def test_inside_and_outside_of_a_body():
    """Boundary of a box with a notch: an independent answer to which points it contains."""
    mesh = xc.box((0, 0, 0), (2, 1, 1), (4, 2, 2))
    middle = mesh.points[mesh.cells].mean(axis=1)
    mesh = xc.Mesh(*_used(mesh.points, mesh.cells[~((middle[:, 0] < 1) & (middle[:, 2] > 0.5))]))
    facets = mesh.facet_sets["boundary"]
    crack = Crack(*_outward(mesh, facets))
    x = np.random.default_rng(311).uniform((-0.3, -0.3, -0.3), (2.3, 1.3, 1.3), (3000, 3))
    phi, _, at_rim = signed_in(triangle_tree(crack.points, crack.faces), x)
    inside = ((x > 0) & (x < [2, 1, 1])).all(axis=1) & ~((x[:, 0] < 1) & (x[:, 2] > 0.5))
    np.testing.assert_array_equal(phi < 0, inside)
    assert not at_rim.any()


def _used(points, cells):
    used, inverse = np.unique(cells, return_inverse=True)
    return points[used], inverse.reshape(cells.shape)


def _outward(mesh, facets):
    cell = mesh.facet_to_cell[mesh.facet_numbers(facets), 0]
    corner = mesh.points[facets]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    out = corner.mean(axis=1) - mesh.points[mesh.cells[cell]].mean(axis=1)
    turn = np.einsum("ij,ij->i", normal, out) < 0
    return mesh.points, np.where(turn[:, None], facets[:, ::-1], facets)


@pytest.mark.parametrize(
    "crack",
    [
        penny_crack((0, 0, 0.03), (0, 0, 1), 0.5),
        penny_crack((1, 0, 0.03), (0, 0, 1), 0.5),
        elliptic_crack((0.1, 0, 0.03), (0, 0, 1), (1, 2, 0), 0.6, 0.3),
        plane_crack([(-1, -1, 0.03), (0.1, -1, 0.03), (0.3, 1, 0.03), (-1, 1, 0.03)]),
        plane_crack(
            [(-0.7, -0.7, 0.03), (0.7, -0.7, 0.03), (0.7, 0, 0.03), (0, 0, 0.03), (-0.1, 0.7, 0.03)]
        ),
    ],
    ids=["penny", "half penny", "ellipse", "edge", "hollow"],
)
def test_flat_crack_has_linear_phi_ahead_of_its_front_as_well(crack):
    placed = place_crack(crack, cube())
    surface = extended_surface(placed, cube(), 0.4)
    x = np.random.default_rng(97).uniform(-1, 1, (4000, 3)) * [1, 1, 0.3]
    x[::5, 2] = 0.03
    phi, _, beyond = surface_distance(x, surface.points, surface.triangles)
    assert (~beyond).sum() > 1000
    np.testing.assert_allclose(phi[~beyond], (x[:, 2] - 0.03)[~beyond], atol=ROUND_OFF)


def test_points_in_the_plane_of_a_crack_get_zero():
    placed = place_crack(penny_crack((0, 0, 0), (0, 0, 1), 0.5), cube())
    surface = extended_surface(placed, cube(), 0.3)
    x = np.random.default_rng(1312).uniform(-0.5, 0.5, (3000, 3)) * [1, 1, 0]
    phi, _, _ = surface_distance(x, surface.points, surface.triangles)
    assert (phi == 0).all()


def test_surface_comes_before_the_strip_that_lies_on_it():
    """A slot narrower than the strip: the faces across it must not be taken for what is ahead."""
    u = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (0.15, 0.5), (0.15, -0.2), (-0.15, -0.2)]
    outline = [(x, y, 0.0) for x, y in [*u, (-0.15, 0.5), (-0.5, 0.5)]]
    mesh = cube(20)
    placed = place_crack(plane_crack(outline), mesh)
    surface = extended_surface(placed, mesh, 0.5)
    x = placed.points[placed.faces].mean(axis=1)
    x[:, 2] = 0.01
    _, triangle, _ = surface_distance(x, surface.points, surface.triangles)
    assert (surface.label[triangle] == 0).all()


def cap(angle, edge):
    """Cap of the unit sphere around (0, 0, 1), its points on the sphere."""
    n = max(8, 8 * round(2 * np.pi * np.sin(angle) / edge / 8))
    disc = penny_crack((0, 0, 0), (0, 0, 1), 1.0, n=n)
    flat, faces = np.array(disc.points), np.array(disc.faces)
    while True:
        r = np.hypot(*flat[:, :2].T)
        stretch = angle * np.sinc(angle * r / np.pi)
        x = np.column_stack([flat[:, :2] * stretch[:, None], np.cos(angle * r)])
        long = np.linalg.norm(x[np.roll(faces, -1, axis=1)] - x[faces], axis=2) > 1.3 * edge
        if not long.any():
            return surface_crack(x, faces)
        flat, faces = split_sides(flat, faces, long)
        edge_points = np.unique(rim(faces)[0])
        flat[edge_points, :2] /= np.hypot(*flat[edge_points, :2].T)[:, None]


def test_spherical_cap_converges():
    """phi and r of second order in the edge (chords and facets of a smooth surface)."""
    angle, mesh = 0.6, xc.box((-1, -1, 0), (1, 1, 1.6), (12, 12, 10))
    edges = (0.15, 0.075, 0.0375)
    x = np.random.default_rng(4409).uniform((-0.8, -0.8, 0.5), (0.8, 0.8, 1.2), (20000, 3))
    rho, radius = np.hypot(*x[:, :2].T), np.linalg.norm(x, axis=1)
    behind = (np.arctan2(rho, x[:, 2]) < angle) & (np.abs(radius - 1) < 0.2)
    exact_r = np.hypot(rho - np.sin(angle), x[:, 2] - np.cos(angle))
    ahead = (rho - np.sin(angle)) * np.cos(angle) - (x[:, 2] - np.cos(angle)) * np.sin(angle)
    error = []
    for edge in edges:
        placed = place_crack(cap(angle, edge), mesh)
        surface = extended_surface(placed, mesh, 0.4)
        front = front_frames(placed)[0]
        phi, triangle, _ = surface_distance(x, surface.points, surface.triangles)
        r, _, _ = front_distance(x, front.x, front.is_closed)
        error.append((np.abs(phi - radius + 1)[behind].max(), np.abs(r - exact_r).max()))
        close = (exact_r > 0.05) & (exact_r < 0.2) & (np.abs(ahead) > 0.5 * edge)
        sign = np.where(surface.label[triangle] == 1, 1, -1)
        assert (sign * ahead > 0)[close].all()
    rate = np.log(np.array(error[0]) / error[-1]) / np.log(edges[0] / edges[-1])
    assert rate.min() > 1.8
    assert max(error[-1]) < 6e-4  # discretisation: the table of the prototype has 5.4e-4


def test_frames_of_a_penny():
    placed = place_crack(penny_crack((0.2, 0, 0.1), (1, 2, 2), 0.4, n=64), cube())
    (front,) = front_frames(placed)
    n = np.array([1, 2, 2]) / 3
    radial = (front.x - [0.2, 0, 0.1]) / 0.4
    np.testing.assert_allclose(front.frame[:, 0], radial, atol=1e-13)  # round-off
    np.testing.assert_allclose(front.frame[:, 1], np.tile(n, (64, 1)), atol=1e-13)
    np.testing.assert_allclose(front.frame[:, 2], np.cross(radial, n), atol=1e-13)
    np.testing.assert_allclose(np.diff(front.s), 0.8 * np.sin(np.pi / 64), rtol=1e-12)
    along = np.roll(front.x, -1, axis=0) - front.x
    assert (np.einsum("ij,ij->i", along, front.frame[:, 2]) > 0).all()


def test_first_crossing():
    placed = penny_crack((0, 0, 0), (0, 0, 1), 0.5)
    tree = triangle_tree(placed.points, placed.faces)
    rng = np.random.default_rng(707)
    start, stop = rng.uniform(-1, 1, (2, 2000, 3))
    triangle, position = first_crossing(tree, start, stop)
    share = start[:, 2] / (start[:, 2] - stop[:, 2])
    at = start + share[:, None] * (stop - start)
    r = np.hypot(*at[:, :2].T)
    crosses = (share >= 0) & (share <= 1) & (r < 0.5 * np.cos(np.pi / 128))
    misses = (share < 0) | (share > 1) | (r > 0.5)
    assert (triangle[crosses] >= 0).all()
    assert (triangle[misses] == -1).all()
    np.testing.assert_allclose(position[crosses], share[crosses], atol=1e-14)  # round-off


def test_foot_is_the_closest_point():
    rng = np.random.default_rng(2881)
    points, faces = bumpy(rng)
    x = rng.uniform(-0.4, 1.4, (300, 3))
    near = closest_in(triangle_tree(points, faces), x)
    np.testing.assert_allclose(np.linalg.norm(x - near.foot, axis=1), near.distance, atol=1e-14)


@pytest.mark.slow
def test_narrow_band_is_quick_on_a_large_mesh():
    """1.7e5 points and 1e4 triangles: the size of a mesh of a million tetrahedra."""
    from time import perf_counter

    rng = np.random.default_rng(99)
    points, faces = bumpy(rng, 72)
    x = rng.uniform(-0.5, 1.5, (170_000, 3))
    surface_distance(x[:10], points, faces, 0.2)
    begin = perf_counter()
    surface_distance(x, points, faces, 0.2)
    assert perf_counter() - begin < 3.0


# The nearest vertex of a polyline, against a search tree


def _curve(kind, count):
    t = np.linspace(0, 1, count)[:, None]
    turn = 2 * np.pi * t
    if kind == "closed":  # the last vertex repeats the first
        return np.hstack([np.cos(turn), np.sin(turn), 0 * t])
    if kind == "helix":  # turns that nearly touch
        return np.hstack([np.cos(7 * turn), np.sin(7 * turn), 0.2 * t])
    if kind == "hairpin":
        return np.hstack([np.abs(t - 0.5), 0.01 * t, 0 * t])
    if kind == "crowded":  # sides of very different lengths, one of length zero
        return np.vstack([t**6, t[-1:] ** 6]) * np.ones(3)
    return np.hstack([t, 0 * t, 0 * t])


@pytest.mark.parametrize("kind", ["straight", "closed", "helix", "hairpin", "crowded"])
@pytest.mark.parametrize("count", [2, 3, 41, 401])
def test_nearest(kind, count):
    """Distances are those of the tree to the last bit but round-off; in any order of points."""
    rng = np.random.default_rng(3109)
    vertices = _curve(kind, count)
    x = rng.normal(scale=1.2, size=(800, 3))
    x[:50] = vertices[rng.integers(0, len(vertices), 50)]  # on the curve
    x[50:90] = 0.0  # in the middle of the circle, where all vertices are as far
    wanted, nearest = cKDTree(vertices).query(x)
    for bound in (np.inf, 0.7):
        number, distance = nearest_vertices(x, vertices, bound)
        within = wanted < bound
        assert (number >= 0).tolist() == within.tolist()
        assert np.isinf(distance[~within]).all()
        assert distance[within] == pytest.approx(wanted[within], rel=1e-14, abs=1e-15)
        apart = np.linalg.norm(x[within] - vertices[number[within]], axis=1)
        assert apart == pytest.approx(distance[within], rel=1e-14, abs=1e-15)
    clear = np.linalg.norm(x[:, None] - vertices, axis=2)
    clear = np.diff(np.sort(clear, axis=1)[:, :2], axis=1)[:, 0] > 1e-9
    assert (nearest_vertices(x, vertices, np.inf)[0][clear] == nearest[clear]).all()


def test_nearest_of_nothing():
    """No points give nothing; a point that is no number has no vertex."""
    vertices = _curve("closed", 9)
    number, distance = nearest_vertices(np.empty((0, 3)), vertices, np.inf)
    assert len(number) == len(distance) == 0
    number, distance = nearest_vertices(np.full((1, 3), np.nan), vertices, np.inf)
    assert number[0] == -1
    assert distance[0] == np.inf
