"""Meshes that may not be the body they look like are warned of, with the place."""

import warnings

import numpy as np
import pytest

import xcrack as xc

BOXES = {2: ((0.0, 0.0), (1.0, 1.0)), 3: ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))}


def beside(one, other, offset):
    """Two meshes in one, not joined."""
    points = np.concatenate([one.points, other.points + np.asarray(offset)])
    return points, np.concatenate([one.cells, other.cells + one.n_points])


def along_x(dim, length):
    return np.eye(dim)[0] * length


def messages(points, cells, **sets):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        xc.Mesh(points, cells, **sets)
    assert all(issubclass(w.category, xc.XcrackWarning) for w in caught)
    assert all(w.filename == __file__ for w in caught)  # the line of the user
    return [str(w.message) for w in caught]


@pytest.mark.parametrize("dim", [2, 3])
def test_bodies_that_are_not_joined(dim):
    box = xc.box(*BOXES[dim], 4)
    (message,) = messages(*beside(box, box, along_x(dim, 1.0)))
    # every point of the side that both share, of both
    assert f"({2 * 5 ** (dim - 1)} points have such a twin)" in message
    assert "both lie at [1.0, 0.0" in message


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("shift", [0.5, 0.43])
def test_bodies_on_top_of_each_other(dim, shift):
    """K of such a pair is that of a body twice as thick, shift by whole cells or not."""
    box = xc.box(*BOXES[dim], 4)
    text = " ".join(messages(*beside(box, box, along_x(dim, shift))))
    assert "overlap at" in text or "on top of each other" in text


@pytest.mark.parametrize("dim", [2, 3])
def test_two_meshes_of_one_body(dim):
    low, high = BOXES[dim]
    (message,) = messages(*beside(xc.box(low, high, 3), xc.box(low, high, 5), np.zeros(dim)))[:1]
    assert "both lie at" in message  # the corners
    inner = xc.box([0.21] * dim, [0.77] * dim, 3)
    (message,) = messages(*beside(xc.box(low, high, 5), inner, np.zeros(dim)))
    assert "overlap at" in message


@pytest.mark.parametrize("dim", [2, 3])
def test_points_that_hang(dim):
    coarse, fine = xc.box(*BOXES[dim], 3), xc.box(*BOXES[dim], 6)
    points, cells = beside(coarse, fine, along_x(dim, 1.0))
    # joined where points of both coincide, so that only the others hang
    key = np.round(points * 60).astype(int)
    _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    (message,) = messages(points[first], number.ravel()[cells])
    assert f"({7 ** (dim - 1) - 4 ** (dim - 1)} such points)" in message
    assert "without being one of its points" in message


def test_doubled_points_ahead_of_a_tip():
    """A seam of doubled points moved K by 10.7 %: it is as if the body was cut there."""
    plain = xc.box((-1, -1), (1, 1), 8)
    middle = plain.points[plain.cells].mean(axis=1)
    seam = np.nonzero((plain.points[:, 1] == 0) & (plain.points[:, 0] > 0.2))[0]
    copy = np.arange(plain.n_points)
    copy[seam] = plain.n_points + np.arange(len(seam))
    cells = np.where(middle[:, 1:] > 0, copy[plain.cells], plain.cells)
    points = np.concatenate([plain.points, plain.points[seam]])
    (message,) = messages(points, cells)
    assert f"({2 * len(seam)} points" in message


@pytest.mark.parametrize("dim", [2, 3])
def test_sound_meshes_pass(dim):
    rng = np.random.default_rng(8128)
    for n in (1, 2, 5):
        box = xc.box(*BOXES[dim], n)
        inner = (np.abs(box.points - 0.5) < 0.49).all(axis=1)[:, None]
        moved = box.points + inner * rng.uniform(-0.2 / n, 0.2 / n, box.points.shape)
        assert messages(moved, box.cells) == []
        assert messages(1e-7 * moved + 1e3, box.cells) == []  # far from the origin
    graded = box.points**4  # sizes from 1 to 600
    assert messages(graded, box.cells) == []
    # cells that meet in a corner only, and a slit a hundredth of a cell wide
    corner = beside(box, xc.box(*BOXES[dim], 3), np.ones(dim))
    key = np.round(corner[0] * 30).astype(int)
    _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    assert messages(corner[0][first], number.ravel()[corner[1]]) == []
    assert messages(*beside(box, box, along_x(dim, 1.002))) == []


def test_cell_sets_that_divide_the_body():
    box = xc.box((0, 0), (2, 1), (4, 2))
    left, right = np.arange(8), np.arange(8, 16)
    every = np.arange(16)

    def messages(points, cells, cell_sets):
        mesh = xc.Mesh(points, cells, cell_sets=cell_sets)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for _ in range(2):  # said once a mesh
                xc.Problem(mesh, xc.Isotropic(1.0, 0.3, "strain"))
        return [str(w.message) for w in caught]

    (message,) = messages(box.points, box.cells, cell_sets={"steel": left, "glue": right})
    assert "'steel', 'glue'" in message
    assert "given one material" in message
    assert "Problem(mesh, {'steel': ..., ...})" in message
    for sets in (
        {"body": every},
        {"body": every, "left": left},
        {"cells_1": left, "cells_2": right},  # groups without a name
        {"Surface1": left, "Surface2": right},  # of gmsh, in Abaqus files
        {"_Top_S1": left, "_Top_S2": right},  # of Abaqus
        {"left": left, "none": []},
    ):
        assert messages(box.points, box.cells, cell_sets=sets) == []


def test_a_set_called_boundary_is_the_boundary_or_refused():
    """A partial one hid the mouth of an edge crack: one tip of 6.53 became two of 0.21 and 2.96."""
    box = xc.box((-1, -1), (1, 1), 12)
    with pytest.raises(xc.MeshError, match="12 facets, the boundary of the mesh has 48"):
        xc.Mesh(box.points, box.cells, {"boundary": box.facet_sets["top"]})
    again = xc.Mesh(box.points, box.cells, {"boundary": box.boundary[::-1, ::-1]})
    crack = xc.line_crack([(-1.0, 0.013), (0.0, 0.013)])
    steel = xc.Isotropic(E=1.0, nu=0.3, plane="strain")
    loads = [xc.traction("left", (0.0, 0.0))]
    (placed,) = xc.Problem(xc.Mesh(box.points, box.cells, {"left": box.facet_sets["left"]}),
                           steel, [crack], loads=loads).placed  # fmt: skip
    assert placed.tips == (1,)
    (placed,) = xc.Problem(again, steel, [crack]).placed
    assert placed.tips == (1,)


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        ({"facet_sets": [("left", [(0, 1)])]}, "give a dict"),
        ({"facet_sets": {3: [(0, 1)]}}, "other keys"),
        ({"facet_sets": {"left": [0, 1]}}, r"shape \(n, 2\)"),
        ({"facet_sets": {"left": "top"}}, "str entries"),
        ({"facet_sets": {"left": [(0, 99)]}}, "beyond"),
        ({"cell_sets": {"left": [True] * 8}}, "bool entries"),
        ({"cell_sets": {"left": [0.5]}}, "0.5"),
        ({"cell_sets": {"left": [-1]}}, "beyond"),
        ({"cell_sets": None}, "give a dict"),
    ],
)
def test_sets_that_are_none(sets, says):
    box = xc.box((0, 0), (1, 1), 2)
    with pytest.raises(xc.MeshError, match=says):
        xc.Mesh(box.points, box.cells, **sets)
