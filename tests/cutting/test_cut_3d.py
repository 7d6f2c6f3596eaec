"""Cutting in space: volumes, crack faces that are counted once, cells at fronts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import xcrack as xc
from support import scenes_3d as scenes
from support.scenes_2d import numerics_of


def areas(x):
    return np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2


def model(mesh, *cracks, **options):
    support, load = xc.fix("boundary"), xc.body_force((0.0, 0.0, 1.0))
    return xc.solve(
        xc.Problem(
            mesh, scenes.STEEL, list(cracks), [support], [load], "off", order=1,
            numerics=numerics_of(**options),
        )
    )  # fmt: skip


def check_cut(built, area=None):
    """Volumes of sub-cells, sides, and the area of the crack faces where it is known."""
    space, cut = built.space, built.space.cuts[0]
    mesh, phi = space.mesh, cut.level_set.phi
    total = np.bincount(cut.sub_to_cell, cut.sub_fraction, len(mesh.cells))
    split = np.unique(cut.sub_to_cell)
    np.testing.assert_allclose(total[split], 1.0, rtol=1e-12)
    determinant = np.abs(np.linalg.det(cut.sub_bary))
    np.testing.assert_allclose(determinant, cut.sub_fraction, atol=1e-13)
    middle = np.einsum("sb,sb->s", cut.sub_bary.mean(axis=1), phi[mesh.cells[cut.sub_to_cell]])
    assert (np.sign(middle) == cut.sub_side).all()
    lips = built.lips[0]
    result = areas(cut.lip_points(mesh)).sum()
    assert lips.weight.sum() == pytest.approx(result, rel=1e-10)
    if area is not None:
        assert result == pytest.approx(area, rel=1e-9)  # snapping moves a cut by 1e-10 of a cell


def test_faces_of_a_cap_lie_on_it_in_the_mean():
    """Where φ is interpolated, they lie 0.020 on its hollow side (cells of 0.5)."""
    points, triangles, centre = scenes.cap(24)
    built = model(
        xc.box((-2.5, -2.5, -2), (2.5, 2.5, 2), (10, 10, 8)), xc.surface_crack(points, triangles)
    )
    check_cut(built)
    lips = built.lips[0]
    offset = np.linalg.norm(lips.x - centre, axis=1) - 2.0
    mean = (lips.weight * offset).sum() / lips.weight.sum()
    print(f"mean {mean:.5f}, largest {np.abs(offset).max():.5f}")
    assert abs(mean) <= 1.5e-3


def test_planes_are_not_shifted():
    """No bit of φ of a plane crack changes, turned and on a perturbed mesh."""
    built = model(scenes.perturbed(4, 31), scenes.half_sheet(0.1, 0.03, 0.2))
    levels, mesh = built.space.cuts[0].level_set, built.space.mesh
    a, b, c = built.space.cracks[0].points[built.space.cracks[0].faces[0]]
    normal = np.cross(b - a, c - a)
    distance = (mesh.points - a) @ normal / np.linalg.norm(normal)
    near = np.abs(levels.phi) < 0.5
    np.testing.assert_allclose(levels.phi[near], distance[near], atol=1e-14)  # round-off


@settings(max_examples=15, deadline=None)
@given(
    normal=st.tuples(*[st.integers(-9, 9)] * 3).filter(any),
    offset=st.floats(-0.5, 0.5),
    seed=st.integers(0, 10_000),
)
def test_lips_of_a_plane_through_a_box_have_the_area_of_the_section(normal, offset, seed):
    built = model(scenes.perturbed(4, seed), scenes.sheet(normal, offset))
    check_cut(built, scenes.section_area(normal, offset))
    np.testing.assert_allclose(
        built.lips[0].normal, np.broadcast_to(scenes.unit(normal), built.lips[0].normal.shape),
        atol=1e-7,
    )  # fmt: skip


@pytest.mark.parametrize(
    "normal", [(0, 0, 1), (1, 0, 0), (0, 1, -1), (1, 1, 1), (0, 1, 2)], ids=str
)
def test_planes_on_faces_and_nodes_are_counted_once(normal):
    """On faces of cells, through nodes, and 1e-12 ... 1e-9 of a cell beside."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    for offset in (0.0, 3e-13, -3e-13, 3e-10):
        check_cut(model(mesh, scenes.sheet(normal, offset)), scenes.section_area(normal, offset))


@pytest.mark.parametrize("z", [0.0, 0.1, 1e-12], ids=str)
def test_lips_end_at_the_front(z):
    """A straight front is cut exactly, wherever it runs: on nodes, beside them, through cells."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    for x in (0.0, 0.07, 1 / 3, 1e-12, 1 / 6):
        check_cut(model(mesh, scenes.half_sheet(x, z)), 2 * (1 + x))


def test_area_of_a_penny_converges():
    """The front is straight in a cell: what it cuts off the circle goes like h²."""
    sizes, error = (6, 12), []
    for n in sizes:
        built = model(
            xc.box((-1, -1, -1), (1, 1, 1), n), xc.penny_crack((0, 0, 0.03), (1, 2, 3), 0.6)
        )
        check_cut(built)
        error.append(1 - built.lips[0].weight.sum() / (np.pi * 0.36))
    print(f"\narea of a penny: {error}")
    assert abs(error[1]) < 0.4 * abs(error[0])
    assert abs(error[1]) < 0.01


def test_front_cells_hold_the_front():
    """All cells that the circle passes through are known, and no cell away from it."""
    mesh = scenes.perturbed(6, 17)
    crack = xc.penny_crack((0.02, 0.01, 0.03), (0.2, -0.1, 1), 0.55)
    built = model(mesh, crack)
    cut, placed = built.space.cuts[0], built.space.cracks[0]
    front = placed.points[placed.fronts[0]]
    cells = cut.level_set.tip_cells[0]
    fine = np.concatenate(
        [a + np.linspace(0, 1, 9)[:-1, None] * (b - a) for a, b in zip(front, front[1:])]
    )
    corner, inverse = mesh.points[mesh.cells], np.linalg.inv
    edges = np.moveaxis(corner[:, 1:] - corner[:, :1], 1, 2)
    bary = np.einsum("cij,cpj->cpi", inverse(edges), fine - corner[:, :1])
    passed = np.nonzero(((bary >= 0).all(axis=2) & (bary.sum(axis=2) <= 1)).any(axis=1))[0]
    # The level sets are interpolated: a circle seen through them lies a little off, h²/8a.
    assert np.isin(passed, cells).mean() > 0.8
    centre = mesh.points[mesh.cells[cells]].mean(axis=1)
    away = np.linalg.norm(centre[:, None] - fine, axis=2).min(axis=1)
    assert (away <= mesh.cell_size[cells]).all()
    # Sub-cells there are cut along psi as well: none has parts both ahead and behind.
    at = cut.is_tip[cut.sub_to_cell]
    psi = np.einsum(
        "svb,sb->sv", cut.sub_bary[at], cut.level_set.psi[0][mesh.cells[cut.sub_to_cell[at]]]
    )
    scale = 1e-9 * mesh.cell_size[cut.sub_to_cell[at]]
    assert ((psi.min(axis=1) >= -scale) | (psi.max(axis=1) <= scale)).all()


def ruled(first, last, n):
    """A surface between two polylines `(m, 3)`, n faces wide."""
    points = np.stack([(1 - t) * first + t * last for t in np.linspace(0, 1, n + 1)], axis=1)
    number = np.arange(points[..., 0].size).reshape(points.shape[:2])
    a, b, c, d = (
        part.ravel()
        for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return xc.surface_crack(points.reshape(-1, 3), faces)


def hook(angle):
    """A sheet through a box whose front heads for its own face, three cells before it."""
    turn = np.radians(angle)
    end = np.array([-0.04, 0.2])
    back = end + 0.42 * np.array([np.cos(turn), np.sin(turn)])
    corners = np.array([(-0.7, -0.1), (0.76, -0.1), (0.76, back[1]), back, end])
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    s = np.union1d(np.linspace(0, length[-1], 24), length)
    x, z = (np.interp(s, length, line) for line in corners.T)
    return ruled(*(np.stack([x, np.full(len(s), y), z], axis=1) for y in (-0.5, 0.5)), 5)


def helix(rise, gap):
    """A C whose ends lie beside each other, by a rise, over an angle of twice a gap."""
    angle = np.linspace(gap, 2 * np.pi - gap, 61)
    z = 0.03 + rise * (angle / (2 * np.pi) - 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    up = np.stack([0 * z, 0 * z, z], axis=1)
    return ruled(0.33 * circle + up, 0.57 * circle + up, 4)


@pytest.mark.parametrize(
    ("crack", "cells", "off"),
    [
        (hook(50), (18, 5, 11), 0.025),
        pytest.param(hook(60), (18, 5, 11), 0.025, marks=pytest.mark.slow),
        (helix(0.06, 0.35), (11, 11, 7), 0.011),
        pytest.param(helix(0.1, 0.35), (11, 11, 7), 0.011, marks=pytest.mark.slow),
    ],
    ids=["hook 50", "hook 60", "helix 0.06", "helix 0.1"],
)
def test_faces_come_before_prolongations_of_the_same_crack(crack, cells, off):
    """Area over which cells are cut; a hook loses .15 of a cell at each of its sharp corners.

    While what is nearest decided it was .84 and .91 of that of hooks, .77 and .84 of the others.
    """
    size = np.array(cells) / 15  # half of the box: cells of .133
    built = model(xc.box(-size, size, cells), crack)
    area = xc.measures(built.problem.placed[0], built.problem.mesh).area
    cut = float(built.lips[0].weight.sum())
    print(f"\ncut over {cut / area:.4f} of the area")
    assert cut == pytest.approx(area, rel=off)


def bent_back(turn, gap):
    """A sheet through a box that comes back to its own face, with a gap between."""
    end = np.array([-0.04, gap - 0.1])
    back = end + 0.42 * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    corners = np.array([(-0.7, -0.1), (0.76, -0.1), (0.76, back[1]), back, end])
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    s = np.union1d(np.linspace(0, length[-1], 24), length)
    x, z = (np.interp(s, length, line) for line in corners.T)
    return ruled(*(np.stack([x, np.full(len(s), y), z], axis=1) for y in (-0.5, 0.5)), 5)


@pytest.mark.parametrize(("turn", "gap"), [(90, 2.25), (90, 1.9), (90, 1.5), (50, 1.9), (50, 1.5)])
def test_no_crack_between_a_front_and_its_own_face(turn, gap):
    """Gaps of cells: at 90 degrees the cut was 4 to 6 % too large, 7 % of it on no face.

    Tolerance as for hooks, that lose .15 of a cell at each of three sharp corners.
    """
    size = np.array((18, 5, 11)) / 15
    mesh = xc.box(-size, size, (18, 5, 11))
    built = model(mesh, bent_back(turn, 2 / 15 * gap))
    area = xc.measures(built.problem.placed[0], mesh).area
    x = built.lips[0].x.reshape(-1, 3)
    placed = built.problem.placed[0]
    n = 30  # points an edge of a face: finer than a fortieth of a cell
    lattice = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    on_faces = np.einsum("lb,fbd->fld", lattice, placed.points[placed.faces]).reshape(-1, 3)
    away = cKDTree(on_faces).query(x)[0]
    cut = float(built.lips[0].weight.sum())
    print(f"\ncut over {cut / area:.4f} of the area, at most {away.max() * 7.5:.2f} cells away")
    assert cut == pytest.approx(area, rel=0.022)
    assert float(built.lips[0].weight.ravel()[away > 0.3 * 2 / 15].sum()) < 0.02 * area


def test_a_front_less_than_a_cell_before_its_own_face_is_refused():
    """K of it was a foreign error: no cell held the front."""
    size = np.array((18, 5, 11)) / 15
    with pytest.raises(xc.GeometryError, match="a face of its own crack, closer than a cell"):
        model(xc.box(-size, size, (18, 5, 11)), bent_back(90, 0.1))
