import pickle
from itertools import combinations

import numpy as np
import pytest

from xcrack import Mesh, MeshError, box

ROUND_OFF = 1e-12  # sums of a few hundred volumes, each exact to 1e-16
BOXES = [((-1.0, 0.5), (2.0, 1.5), (5, 4)), ((0.0, -1.0, 2.0), (1.0, 1.0, 2.5), (3, 4, 2))]
TRIANGLE = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])


def jittered(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    inside = np.ones(mesh.n_points, dtype=bool)
    inside[np.unique(mesh.facet_sets["boundary"])] = False
    shift = rng.uniform(-0.02, 0.02, mesh.points.shape) * inside[:, None]
    return Mesh(mesh.points + shift, mesh.cells, mesh.facet_sets, mesh.cell_sets)


def measure(points: np.ndarray) -> np.ndarray:
    """Length of edges, area of triangles, from Gram's determinant."""
    edge = points[:, 1:] - points[:, :1]
    return np.sqrt(np.linalg.det(edge @ edge.swapaxes(1, 2))) / (1 if edge.shape[1] == 1 else 2)


@pytest.mark.parametrize(("lower", "upper", "n"), BOXES)
def test_box_fills_its_box(lower, upper, n):
    mesh = box(lower, upper, n)
    sides = np.subtract(upper, lower)
    assert mesh.n_points == np.prod(np.add(n, 1))
    assert len(mesh.cells) == {2: 2, 3: 6}[mesh.dim] * np.prod(n)
    assert (mesh.volume > 0).all()
    assert mesh.volume.sum() == pytest.approx(np.prod(sides), rel=ROUND_OFF)
    np.testing.assert_array_equal(mesh.points.min(axis=0), lower)
    np.testing.assert_array_equal(mesh.points.max(axis=0), upper)
    assert mesh.extent == sides.max()


@pytest.mark.parametrize(("lower", "upper", "n"), BOXES)
def test_box_sides_lie_where_their_names_say(lower, upper, n):
    mesh = box(lower, upper, n)
    d = mesh.dim
    place = {"left": (0, lower), "right": (0, upper), "bottom": (d - 1, lower)}
    place |= {"top": (d - 1, upper)} | ({"front": (1, lower), "back": (1, upper)} if d > 2 else {})
    assert set(mesh.facet_sets) == {*place, "boundary"}
    for name, (axis, corner) in place.items():
        x = mesh.points[mesh.facet_sets[name]]
        assert (x[..., axis] == corner[axis]).all()
        area = np.prod(np.delete(np.subtract(upper, lower), axis))
        assert measure(x).sum() == pytest.approx(area, rel=ROUND_OFF)
    shared = sum(len(mesh.facet_sets[name]) for name in place)
    assert shared == len(mesh.facet_sets["boundary"])


def test_box_diagonals_alternate():
    mesh = box((0, 0), (2, 2), 2)
    middle = 4
    assert np.bincount(mesh.cells.ravel())[middle] == 8


@pytest.mark.parametrize(("lower", "upper", "n"), BOXES)
def test_gradients_are_those_of_linear_fields(lower, upper, n):
    rng = np.random.default_rng(271828)
    mesh = jittered(box(lower, upper, n), rng)
    slope = rng.normal(size=mesh.dim)
    values = mesh.points @ slope + rng.normal()
    result = np.einsum("mai,ma->mi", mesh.gradient, values[mesh.cells])
    # round-off: values of size 10 over edges of 0.2
    np.testing.assert_allclose(result, np.broadcast_to(slope, result.shape), atol=1e-11)
    np.testing.assert_allclose(mesh.gradient.sum(axis=1), 0.0, atol=1e-11)


@pytest.mark.parametrize(("lower", "upper", "n"), BOXES)
def test_boundary_closes(lower, upper, n):
    # Divergence theorem: the normals of a closed surface sum to zero, x . n to d times the volume.
    mesh = jittered(box(lower, upper, n), np.random.default_rng(577215))
    flux, total = 0.0, np.zeros(mesh.dim)
    on_boundary = np.flatnonzero(mesh.facet_to_cell[:, 1] < 0)
    for facet in on_boundary:
        cell = mesh.facet_to_cell[facet, 0]
        opposite = int(np.flatnonzero(mesh.cell_to_facet[cell] == facet)[0])
        normal = -mesh.gradient[cell, opposite] * mesh.volume[cell] * mesh.dim
        total += normal
        flux += normal @ mesh.points[mesh.facets[facet]].mean(axis=0)
    np.testing.assert_allclose(total, 0.0, atol=1e-12)
    assert flux == pytest.approx(mesh.dim * mesh.volume.sum(), rel=ROUND_OFF)


@pytest.mark.parametrize(("lower", "upper", "n"), BOXES)
def test_maps_agree_with_plain_loops(lower, upper, n):
    mesh = box(lower, upper, n)
    pairs = list(combinations(range(mesh.dim + 1), 2))
    edges = {tuple(sorted((c[a], c[b]))) for c in mesh.cells for a, b in pairs}
    assert {tuple(e) for e in mesh.edges} == edges
    assert len(mesh.edges) == len(edges)
    longest = [
        max(np.linalg.norm(mesh.points[c[a]] - mesh.points[c[b]]) for a, b in pairs)
        for c in mesh.cells
    ]
    np.testing.assert_allclose(mesh.cell_size, longest, rtol=1e-15)
    for cell, corners in enumerate(mesh.cells):
        for local, pair in enumerate(pairs):
            edge = mesh.edges[mesh.cell_to_edge[cell, local]]
            assert sorted(corners[list(pair)]) == list(edge)
        for local in range(mesh.dim + 1):
            facet = mesh.cell_to_facet[cell, local]
            assert sorted(np.delete(corners, local)) == list(mesh.facets[facet])
            assert cell in mesh.facet_to_cell[facet]
    offsets, around = mesh.point_to_cell
    for point in range(mesh.n_points):
        result = around[offsets[point] : offsets[point + 1]]
        assert sorted(result) == sorted(np.flatnonzero((mesh.cells == point).any(axis=1)))


def test_euler_characteristic():
    plane, space = box((0, 0), (1, 1), (4, 3)), box((0, 0, 0), (1, 1, 1), 2)
    assert plane.n_points - len(plane.edges) + len(plane.cells) == 1
    assert space.n_points - len(space.edges) + len(space.facets) - len(space.cells) == 1


def test_facet_numbers_find_any_order_and_nothing_else():
    mesh = box((0, 0, 0), (1, 1, 1), 2)
    rng = np.random.default_rng(161803)
    rows = rng.permutation(len(mesh.facets))[:20]
    np.testing.assert_array_equal(mesh.facet_numbers(mesh.facets[rows][:, [2, 0, 1]]), rows)
    assert mesh.facet_numbers(np.array([[0, 1, mesh.n_points - 1]])) == [-1]


def test_turned_cells_are_righted():
    assert Mesh(TRIANGLE, [(0, 2, 1)]).volume == [0.5]


def test_arrays_are_read_only_and_own_their_data():
    points = TRIANGLE.copy()
    mesh = Mesh(points, [(0, 1, 2)], {"base": [(0, 1)]}, {"all": [0]})
    points[0] = 7.0
    assert (mesh.points[0] == 0).all()
    for array in (mesh.points, mesh.cells, mesh.volume, mesh.edges, mesh.facet_sets["base"]):
        with pytest.raises(ValueError):
            array[0] = 1
    with pytest.raises(TypeError):
        mesh.facet_sets["new"] = mesh.facet_sets["base"]
    with pytest.raises(AttributeError):
        mesh.points = points


def test_pickle_keeps_all():
    mesh = Mesh(TRIANGLE, [(0, 1, 2)], {"base": [(0, 1)]}, {"all": [0]})
    back = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(back.points, mesh.points)
    assert set(back.facet_sets) == {"base", "boundary"}
    assert list(back.cell_sets["all"]) == [0]


def test_boundary_holds_every_facet_of_one_cell():
    mesh = Mesh([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)])
    result = {tuple(f) for f in np.sort(mesh.facet_sets["boundary"], axis=1)}
    assert result == {(0, 1), (1, 2), (2, 3), (0, 3)}


WRONG = {
    "no cells": (TRIANGLE, np.zeros((0, 3), int), {}, {}),
    r"\(n, 2\) or \(n, 3\)": (TRIANGLE[:, :1], [(0, 1, 2)], {}, {}),
    r"cells must be \(m, 3\)": (TRIANGLE, [(0, 1, 2, 0)], {}, {}),
    "nan": (np.array([(0, 0), (1, np.nan), (0, 1)]), [(0, 1, 2)], {}, {}),
    "outside": (TRIANGLE, [(0, 1, 3)], {}, {}),
    "belongs to no cell": (np.vstack([TRIANGLE, [(2, 2)]]), [(0, 1, 2)], {}, {}),
    "same points": (TRIANGLE, [(0, 1, 2), (1, 2, 0)], {}, {}),
    "no volume": ([(0, 0), (1, 0), (2, 0)], [(0, 1, 2)], {}, {}),
    "facet set 'a'": (TRIANGLE, [(0, 1, 2)], {"a": [(0, 5)]}, {}),
    "cell set 'b'": (TRIANGLE, [(0, 1, 2)], {}, {"b": [1]}),
}


@pytest.mark.parametrize("says", WRONG)
def test_wrong_meshes_are_refused(says):
    with pytest.raises(MeshError, match=says):
        Mesh(*WRONG[says])


def test_facet_that_no_cell_has_is_refused():
    mesh = box((0, 0), (1, 1), 2)
    with pytest.raises(MeshError, match="no facet of any cell"):
        Mesh(mesh.points, mesh.cells, {"far": [(0, mesh.n_points - 1)]})


def test_three_cells_at_one_facet_are_refused():
    points = [(0, 0), (1, 0), (0.5, 1), (0.5, 2), (0.5, -1)]
    with pytest.raises(MeshError, match="at most two"):
        Mesh(points, [(0, 1, 2), (0, 1, 3), (0, 4, 1)])


@pytest.mark.parametrize(
    ("lower", "upper", "n"), [((0, 0), (1, 0), 2), ((0, 0), (1, 1), 0), ((0,), (1,), 2)]
)
def test_wrong_boxes_are_refused(lower, upper, n):
    with pytest.raises(MeshError, match="box"):
        box(lower, upper, n)


def test_inverted_cell_is_named():
    """A point pulled across its neighbours folds cells over one another."""
    mesh = box((0, 0), (1, 1), 6)
    points = np.array(mesh.points)
    points[24] = (0.9, 0.9)
    with pytest.raises(MeshError, match=r"is inverted: it folds over its neighbour .* remesh"):
        Mesh(points, mesh.cells)
