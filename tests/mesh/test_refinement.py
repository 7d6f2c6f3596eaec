"""Refinement by longest-edge bisection: conformity, shapes, sets, curves, sizes, wrong input."""

import dataclasses
import math
import pickle
import warnings

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes


def quality(mesh):
    """Volume over that of the regular simplex with the same mean square of its edges."""
    x = mesh.points[mesh.cells]
    i, j = np.triu_indices(mesh.dim + 1, 1)
    square = ((x[:, i] - x[:, j]) ** 2).sum(axis=-1).mean(axis=1)
    regular = math.sqrt(mesh.dim + 1) / (math.factorial(mesh.dim) * 2 ** (mesh.dim / 2))
    return mesh.volume / (regular * square ** (mesh.dim / 2))


def smallest_angle(mesh):
    """Smallest angle of each triangle, rad."""
    x = mesh.points[mesh.cells]
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    return np.arccos(np.clip(cosine, -1, 1)).min(axis=1)


def measure(mesh, facets):
    """Length or area of facets together."""
    edges = mesh.points[facets[:, 1:]] - mesh.points[facets[:, :1]]
    gram = np.einsum("fid,fjd->fij", edges, edges)
    return np.sqrt(np.linalg.det(gram)).sum() / math.factorial(mesh.dim - 1)


def with_sets(mesh, seed):
    """The mesh with inner facets and some cells as sets."""
    rng = np.random.default_rng(seed)
    inner = mesh.facets[mesh.facet_to_cell[:, 1] >= 0]
    facets = {**mesh.facet_sets, "inner": rng.permutation(inner)[: len(inner) // 4]}
    some = np.nonzero(rng.random(len(mesh.cells)) < 0.3)[0]
    return xc.Mesh(mesh.points, mesh.cells, facets, {"some": some})


def drawn(dim, seed):
    """A box whose points are moved at random, with sets."""
    mesh = xc.box((-1,) * dim, (1,) * dim, 8 if dim == 2 else 4)
    rng = np.random.default_rng(seed)
    inner = np.setdiff1d(np.arange(mesh.n_points), mesh.boundary)
    x = mesh.points.copy()
    x[inner] += rng.uniform(-0.25, 0.25, (len(inner), dim)) * 2 / (8 if dim == 2 else 4) / 2
    return with_sets(xc.Mesh(x, mesh.cells, mesh.facet_sets), seed)


def cell_around(mesh, members, x):
    """Whether each point lies in one of the cells."""
    bary = np.einsum(
        "mkd,nmd->nmk",
        mesh.gradient[members],
        x[:, None] - mesh.points[mesh.cells[members]].mean(axis=1),
    ) + 1 / (mesh.dim + 1)
    return (bary.min(axis=2) > -1e-12).any(axis=1)


def same_body(fine, mesh):
    """Whether a refined mesh conforms and has kept volume, sets and points; all round-off."""
    assert np.array_equal(fine.points[: mesh.n_points], mesh.points)
    assert fine.volume.sum() == pytest.approx(mesh.volume.sum(), rel=1e-12)
    assert set(fine.facet_sets) == set(mesh.facet_sets)
    for name, facets in mesh.facet_sets.items():
        assert measure(fine, fine.facet_sets[name]) == pytest.approx(
            measure(mesh, facets), rel=1e-12
        )
        assert len(np.unique(fine.facet_numbers(fine.facet_sets[name]))) == len(
            fine.facet_sets[name]
        )
    for name, members in mesh.cell_sets.items():
        inside = fine.cell_sets[name]
        assert len(np.unique(inside)) == len(inside)
        assert fine.volume[inside].sum() == pytest.approx(mesh.volume[members].sum(), rel=1e-12)
        assert (cell_around(mesh, members, fine.points[fine.cells[inside]].mean(axis=1))).all()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of hanging points and overlaps
        xc.Mesh(fine.points, fine.cells)


def shapes_of(mesh):
    """Cells as coordinates, in an order that numbers play no part in."""
    x = mesh.points[mesh.cells]
    order = np.lexsort(np.moveaxis(x, -1, 0)[::-1], axis=1)
    flat = np.take_along_axis(x, order[..., None], axis=1).reshape(len(x), -1)
    return flat[np.lexsort(flat.T)]


def near(mesh, x, reach):
    return np.nonzero(np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - x, axis=1) < reach)[0]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", [90217, 3371])
def test_bisection_conforms_and_keeps_sets(dim, seed):
    mesh = drawn(dim, seed)
    rng = np.random.default_rng(seed + 1)
    fine = mesh
    for _ in range(3):
        chosen = rng.permutation(len(fine.cells))[: max(len(fine.cells) // 20, 1)]
        coarse, fine = fine, xc.refine(fine, chosen)
        assert len(fine.cells) >= len(coarse.cells) + len(chosen)
    same_body(fine, mesh)


@pytest.mark.parametrize(("dim", "bound"), [(2, 0.86), (3, 0.65)])
def test_boxes_keep_their_shapes(dim, bound):
    """A hundredfold grading; in 2D the right triangles stay what they are."""
    fine = xc.box((0,) * dim, (1,) * dim, 4)
    spot = np.full(dim, 0.4)
    fine = xc.refine(fine, size=lambda x: 0.004 + 0.5 * np.linalg.norm(x - spot, axis=1))
    assert fine.cell_size.max() > 50 * fine.cell_size.min()
    assert quality(fine).min() > bound


@pytest.mark.parametrize("seed", [1409, 86243, 5077])
def test_angles_stay_above_half_of_the_smallest(seed):
    """Rosenberg and Stenger (1975), Math. Comp. 29, 390: a bound for every triangle."""
    mesh = fine = drawn(2, seed)
    for _ in range(8):
        fine = xc.refine(fine, near(fine, (0.3, -0.2), 0.3))
    assert smallest_angle(fine).min() > smallest_angle(mesh).min() / 2


@pytest.mark.parametrize("seed", [733, 60899, 24419])
def test_tetrahedra_keep_their_shapes(seed):
    """Without a theorem in 3D: the worst of drawn meshes after twelve sweeps, measured .44."""
    mesh = fine = drawn(3, seed)
    for k in range(12):
        fine = xc.refine(fine, near(fine, (0.3, -0.2, 0.1), 0.5 / 2 ** (k / 3)))
    assert quality(fine).min() > 0.3 * quality(mesh).min()


@pytest.mark.parametrize("seed", [4523, 70001])
@pytest.mark.parametrize("dim", [2, 3])
def test_slivers_get_no_worse(dim, seed):
    """Flat cells first become better: their long edges are split."""
    rng = np.random.default_rng(seed)
    flat = np.eye(dim)
    flat[-1, -1] = 1e-4
    mesh = xc.box((0,) * dim, (1,) * dim, 3)
    mesh = xc.Mesh(mesh.points @ flat, mesh.cells)
    fine = mesh
    for _ in range(6):
        fine = xc.refine(fine, rng.permutation(len(fine.cells))[: len(fine.cells) // 4])
    same_body(fine, mesh)
    assert quality(fine).min() > 0.4 * quality(mesh).min()


@pytest.mark.parametrize("kind", ["drawn", "box"])
@pytest.mark.parametrize("dim", [2, 3])
def test_renumbering_gives_the_same_cells(dim, kind):
    """To the last bit; in a box most edges have equals, and middles decide."""
    rng = np.random.default_rng(6067)
    mesh = drawn(dim, 6067) if kind == "drawn" else xc.box((0,) * dim, (1,) * dim, 3)
    points, cells = rng.permutation(mesh.n_points), rng.permutation(len(mesh.cells))
    number = np.argsort(points)
    other = xc.Mesh(mesh.points[points], rng.permuted(number[mesh.cells[cells]], axis=1))
    marked = rng.permutation(len(mesh.cells))[:5]
    one, two = xc.refine(mesh, marked), xc.refine(other, np.argsort(cells)[marked])
    assert np.array_equal(shapes_of(one), shapes_of(two))

    def size(x):
        return 0.03 + 0.4 * np.linalg.norm(x - 0.3, axis=1)

    assert np.array_equal(
        shapes_of(xc.refine(mesh, size=size)), shapes_of(xc.refine(other, size=size))
    )


def test_equilateral_triangles_are_bisected_once():
    """All edges are alike: a chain of neighbours that each prefer another edge would be long."""
    height = math.sqrt(3) / 2
    i, j = np.meshgrid(np.arange(13), np.arange(13), indexing="ij")
    points = np.stack([(i + j / 2).ravel(), (height * j).ravel()], axis=1)
    number = np.arange(169).reshape(13, 13)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:]
    cells = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)]
    )
    mesh = xc.Mesh(points, cells)
    for chosen in (5, 100, 211):
        assert len(xc.refine(mesh, [chosen]).cells) <= len(cells) + 2


@pytest.mark.parametrize("dim", [2, 3])
def test_size_is_reached_and_no_more(dim):
    mesh = drawn(dim, 50461)
    spot = np.full(dim, -0.35)

    def size(x):
        return 0.05 * (dim - 1) + 0.6 * np.linalg.norm(x - spot, axis=1)

    fine = xc.refine(mesh, size=size)
    same_body(fine, mesh)
    assert (fine.cell_size <= size(fine.points[fine.cells].mean(axis=1))).all()
    # No finer than asked, but for what conformity takes.
    wanted = size(fine.points[fine.cells].mean(axis=1))
    assert np.median(fine.cell_size / wanted) > 0.5
    assert xc.refine(fine, size=size) is fine
    even = xc.refine(mesh, size=0.3)
    assert even.cell_size.max() <= 0.3
    assert np.median(even.cell_size) > 0.15


def test_a_size_of_inf_asks_for_nothing():
    mesh = xc.box((0, 0), (1, 1), 4)
    assert xc.refine(mesh, size=lambda x: np.full(len(x), np.inf)) is mesh
    fine = xc.refine(mesh, size=lambda x: np.where(x[:, 0] < 0.2, 0.1, np.inf))
    right = fine.points[fine.cells].mean(axis=1)[:, 0] > 0.7
    assert np.allclose(fine.cell_size[right], math.hypot(0.25, 0.25))


def test_no_cells_change_nothing():
    mesh = xc.box((0, 0, 0), (1, 1, 1), 2)
    assert xc.refine(mesh, []) is mesh
    assert xc.refine(mesh, np.zeros(0, dtype=int)) is mesh


# Curves ----------------------------------------------------------------------------------------


def test_a_hole_becomes_round():
    """What is missing to the disc is of the second power of the edges: .2 % of 24 are left."""
    mesh = xc.plate_with_hole(width=6.0, height=6.0, radius=1.0, size=1.0)
    exact = 36 - math.pi
    errors = []
    for level in range(3):
        fine = xc.refine(mesh, size=0.3 / 2**level) if level else mesh
        rim = fine.points[np.unique(fine.facet_sets["hole"])]
        assert np.allclose(np.linalg.norm(rim, axis=1), 1.0, rtol=1e-12)
        assert quality(fine).min() > 0.4
        errors.append(fine.volume.sum() - exact)
    rounded = xc.refine(mesh)
    assert rounded.volume.sum() - exact == pytest.approx(errors[0] / 4, rel=0.01)
    assert 0 < errors[2] < errors[1] / 2.5 < errors[0] / 2.5


@pytest.mark.slow
@pytest.mark.mission
def test_an_edge_between_a_curved_side_and_a_flat_one_stays_on_both():
    """Points of the mouth of a notch lie in its face and on the cylinder."""
    slope = math.tan(math.pi / 6)
    bar = xc.notched_cylinder(
        diameter=20.0, length=140.0, notch_depth=2.0, notch_angle=math.pi / 3, outer_span=120.0,
        inner_span=40.0, size=5.0, size_near=2.5,
    )  # fmt: skip
    for fine in (xc.refine(bar), xc.refine(bar, size=lambda x: 1.0 + 0.4 * np.abs(x[:, 0]))):
        side = fine.points[np.unique(fine.facet_sets["round"])]
        assert np.allclose(np.hypot(side[:, 1], side[:, 2]), 10.0, rtol=1e-12)
        notch = fine.points[np.unique(fine.facet_sets["notch"])]
        assert np.allclose(np.abs(notch[:, 0]), (-8 - notch[:, 2]) * slope, atol=1e-12)
        both = np.intersect1d(fine.facet_sets["round"], fine.facet_sets["notch"])
        assert len(both) > len(np.intersect1d(bar.facet_sets["round"], bar.facet_sets["notch"]))
        assert fine.volume.sum() > bar.volume.sum()
        assert quality(fine).min() > 0.5 * quality(bar).min()


def test_a_curve_of_a_file_is_given_by_replace():
    mesh = xc.plate_with_hole(width=6.0, height=6.0, radius=1.0, size=1.0, center=(0.5, 0.2))
    bare = xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets)
    assert not bare.curves

    def circle(x):
        away = x - (0.5, 0.2)
        return (0.5, 0.2) + away / np.linalg.norm(away, axis=1)[:, None]

    known = dataclasses.replace(bare, curves={"hole": circle})
    assert xc.refine(bare).volume.sum() > xc.refine(known).volume.sum()
    assert np.allclose(xc.refine(known).points, xc.refine(mesh).points, atol=1e-13)
    assert set(xc.refine(xc.refine(known, [3])).curves) == {"hole"}


def test_curves_can_be_stored_and_change_no_run():
    mesh = xc.plate_with_hole(width=6.0, height=6.0, radius=1.0, size=1.0)
    copy = pickle.loads(pickle.dumps(mesh))
    assert copy.curves == dict(mesh.curves)
    bare = xc.Mesh(mesh.points, mesh.cells, {**mesh.facet_sets})
    scene = {"material": xc.Isotropic(1.0, 0.3, "strain"), "loads": [xc.pressure("hole", 1.0)],
             "cracks": [xc.line_crack([(1.0, 0.1), (2.0, 0.1)])]}  # fmt: skip
    rule = {"law": xc.paris(1e-9, 3.0), "criterion": xc.max_hoop_stress, "da": 0.5,
            "cycle": xc.Cycle(0.0, 1.0), "max_steps": 1, "progress": False}  # fmt: skip
    one, other = (xc.collect(xc.grow(xc.Problem(body, **scene), **rule)) for body in (bare, mesh))
    assert one.settings == other.settings


@pytest.mark.parametrize(
    ("curve", "match"),
    [
        (lambda x: x + 3.0, r"curves\['hole'\] takes the point .* away"),
        (lambda x: x[:1], "shape"),
        (lambda x: np.full_like(x, np.nan), "finite"),
        (lambda x: None, r"curves\['hole'\]"),
        ("circle", "give a function"),
    ],
)
def test_wrong_curves_are_refused(curve, match):
    mesh = xc.plate_with_hole(width=6.0, height=6.0, radius=1.0, size=1.5)
    with pytest.raises(xc.MeshError, match=match):
        dataclasses.replace(mesh, curves={"hole": curve})


def test_curves_of_no_set_are_refused():
    with pytest.raises(xc.MeshError, match="no facet set 'rim'"):
        dataclasses.replace(xc.box((0, 0), (1, 1), 2), curves={"rim": lambda x: x})
    with pytest.raises(xc.MeshError, match="give a dict"):
        dataclasses.replace(xc.box((0, 0), (1, 1), 2), curves=[1])


def test_a_curve_that_goes_astray_later_is_refused():
    """It returns the old points, but new ones elsewhere."""
    mesh = xc.plate_with_hole(width=6.0, height=6.0, radius=1.0, size=1.5)

    def astray(x):
        return np.where(np.linalg.norm(x, axis=1)[:, None] > 1 - 1e-9, x, 2.0)

    known = dataclasses.replace(mesh, curves={"hole": astray})
    with pytest.raises(xc.MeshError, match="nearest points of the curve"):
        xc.refine(known)
    with pytest.raises(xc.MeshError, match="nearest points of the curve"):
        xc.refine(known, size=0.1)


def under_an_arc(cells):
    """A flat cell under an arc: its third point lies within the arc's height."""
    points = np.array([(-1, 0), (1, 0), (0, -0.05), (-1, -1), (1, -1)], dtype=float)
    radius = (1 + 0.3**2) / (2 * 0.3)

    def arc(x):
        away = x - (0, radius - 0.3)
        return (0, radius - 0.3) + away / np.linalg.norm(away, axis=1)[:, None] * radius

    used = points[: max(map(max, cells)) + 1]
    return xc.Mesh(used, cells, {"rim": [(0, 1)]}, curves={"rim": arc})


def test_inner_points_follow_where_cells_would_be_folded():
    mesh = under_an_arc([(0, 2, 1), (0, 3, 2), (2, 4, 1), (3, 4, 2)])
    fine = xc.refine(mesh, [0])
    middle = fine.points[np.setdiff1d(fine.facet_sets["rim"], [0, 1])]
    assert np.allclose(middle, [(0, -0.3)])
    assert fine.points[2, 1] < -0.3
    assert fine.volume.min() > 0.02


def test_points_that_would_fold_cells_stay_and_are_named():
    """Where the third point lies on another side, as in a thin wall, it cannot follow."""
    mesh = under_an_arc([(0, 2, 1)])
    with pytest.warns(xc.XcrackWarning, match="1 new points of the boundary stay off their curve"):
        fine = xc.refine(mesh, [0])
    assert fine.volume.sum() == pytest.approx(mesh.volume.sum(), rel=1e-12)


# Wrong input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"cells": [0], "size": 0.1}, "not both"),
        ({"cells": [99]}, "names 99"),
        ({"cells": [-1]}, "names -1"),
        ({"cells": [True]}, "bool"),
        ({"cells": [[0, 1]]}, "shape"),
        ({"cells": "all"}, "cells"),
        ({"size": 0.0}, "above 0"),
        ({"size": -1}, "above 0"),
        ({"size": math.nan}, "finite"),
        ({"size": "fine"}, "not a number"),
        ({"size": 1e-9}, "millionth"),
        ({"size": lambda x: np.full(len(x), math.nan)}, "is nan at"),
        ({"size": lambda x: -np.ones(len(x))}, "is -1 at"),
        ({"size": lambda x: np.ones((len(x), 2))}, "shape"),
        ({"size": lambda x: None}, "size"),
        ({"size": 1e-5}, "more than"),
    ],
)
def test_wrong_input(options, match, monkeypatch):
    monkeypatch.setattr("xcrack.mesh.refinement._MOST_CELLS", 20_000)
    with pytest.raises(xc.MeshError, match=match):
        xc.refine(xc.box((0, 0), (1, 1), 2), **options)


def test_an_error_of_the_size_keeps_its_type():
    def size(x):
        raise KeyError("depth")

    with pytest.raises(KeyError) as error:
        xc.refine(scenes.perturbed(3, seed=5), size=size)
    assert "xcrack called" in error.value.__notes__[0]
