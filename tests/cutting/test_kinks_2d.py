"""Level sets of polylines, and cuts at their kinks: the crack as it is given, to round-off."""

from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.analysis.solution import sides_of
from xcrack.crack.advance_2d import advance
from xcrack.crack.crack import kink_numbers, tip_frames
from xcrack.crack.placing_2d import place_line
from xcrack.fem.assembly import boundary_points
from xcrack.fem.cut import cut
from xcrack.fem.level_set import line_levels
from xcrack.fem.system import CELLS, discretise
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.kernels.location import polyline_distance

STEEL = xc.Isotropic(1.0, 0.3, "strain")


def scene(seed, kink=None, turn=None):
    """An inner crack with a kink of 16 to 95 degrees anywhere in a cell."""
    rng = np.random.default_rng(seed)
    mesh = scenes.perturbed(int(rng.integers(9, 16)), seed, 0.15)
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.radians(rng.uniform(16, 95)) * rng.choice((-1, 1)) if turn is None else turn
    x = rng.uniform(-0.1, 0.1, 2) if kink is None else kink(mesh)
    line = [x - 0.6 * scenes.rows(angle)[0], x, x + 0.5 * scenes.rows(angle + turn)[0]]
    return xc.Problem(mesh, STEEL, [xc.line_crack(line)], order=2), np.array(line)


def area_beside(space, line, radius):
    """Areas of both sides within the cells at the kink, from sub-cells."""
    cut, mesh = space.cuts[0], space.mesh
    away = np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - line[1], axis=1)
    near = (cut.is_cut & (away < radius))[cut.sub_to_cell]
    size = cut.sub_fraction * mesh.volume[cut.sub_to_cell]
    return [size[near & (cut.sub_side == side)].sum() for side in (1, -1)]


def inside_of_cells(space, line, radius):
    """The same by points of a fine rule, each on its side of the polyline."""
    cut, mesh = space.cuts[0], space.mesh
    away = np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - line[1], axis=1)
    cells = np.nonzero(cut.is_cut & (away < radius))[0]
    k = 60
    i, j = np.meshgrid(np.arange(k), np.arange(k))
    lower = np.stack([(i + 1 / 3).ravel() / k, (j + 1 / 3).ravel() / k], axis=1)
    upper = np.stack([(i + 2 / 3).ravel() / k, (j + 2 / 3).ravel() / k], axis=1)
    t = np.concatenate([lower[lower.sum(1) < 1], upper[upper.sum(1) < 1]])
    bary = np.column_stack([1 - t.sum(axis=1), t])
    x = np.einsum("qb,cbd->cqd", bary, mesh.points[mesh.cells[cells]])
    u, v = np.diff(line, axis=0)
    d = x - line[1]
    one, two = u[0] * d[..., 1] - u[1] * d[..., 0], v[0] * d[..., 1] - v[1] * d[..., 0]
    left = u[0] * v[1] - u[1] * v[0] > 0
    plus = (np.minimum(one, two) if left else np.maximum(one, two)) > 0
    share = plus.mean(axis=1)
    return [mesh.volume[cells] @ share, mesh.volume[cells] @ (1 - share)], len(cells) / k**1.5


@pytest.mark.parametrize("seed", range(6))
def test_sides_and_lengths_are_those_of_the_polyline(seed):
    """Areas to the error of the reference; lengths of the faces to round-off."""
    problem, line = scene(seed)
    space, lips = discretise(problem)
    cut, mesh = space.cuts[0], space.mesh
    assert len(cut.kinks.points) == 1
    sticks_out = np.linalg.norm(cut.kinks.points[0] - line[1]) > 1e-9
    size = mesh.cell_size.max()
    area = mesh.volume[np.unique(cut.sub_to_cell)]
    total = np.bincount(np.searchsorted(np.unique(cut.sub_to_cell), cut.sub_to_cell),
                        cut.sub_fraction)  # fmt: skip
    assert np.abs(total - 1).max() <= 1e-12
    assert area.min() > 0
    if sticks_out:
        return
    assert lips[0].weight.sum() == pytest.approx(1.1, abs=1e-12)
    wanted, doubt = inside_of_cells(space, line, 1.5 * size)
    assert area_beside(space, line, 1.5 * size) == pytest.approx(
        wanted, abs=doubt * mesh.volume.max()
    )


def test_a_point_is_on_its_side_of_the_kink():
    """`level` is zero on the faces, and its sign is that of the sub-cells."""
    for seed in range(3):
        space, lips = discretise(scene(seed)[0])
        cut, mesh = space.cuts[0], space.mesh
        phi = cut.level(mesh, lips[0].cell[:, 1], lips[0].bary[:, 1])
        assert np.abs(phi).max() <= 1e-12
        centre = cut.sub_bary.mean(axis=1)
        level = cut.level(mesh, cut.sub_to_cell, centre)
        inner = cut.is_cut[cut.sub_to_cell]
        assert (np.sign(level) == cut.sub_side)[inner].all()
        side = sides_of(space, cut.sub_to_cell, centre, 0)[:, 0]
        assert (side == cut.sub_side)[inner].all()


@pytest.mark.parametrize("where", ["node", "edge", "beside a node", "beside an edge"])
def test_kinks_on_mesh_points_and_edges(where):
    def kink(mesh):
        edge = mesh.edges[np.argmin(np.linalg.norm(mesh.points[mesh.edges].mean(axis=1), axis=1))]
        a, b = mesh.points[edge]
        x = a if "node" in where else 0.3 * a + 0.7 * b
        return x + ([3e-12, -4e-12] if "beside" in where else 0)

    for seed in (20, 21):
        problem, _ = scene(seed, kink)
        space, lips = discretise(problem)
        assert len(space.cuts[0].kinks.points) == 1
        assert lips[0].weight.sum() == pytest.approx(1.1, abs=1e-9)
        assert xc.inf_sup(problem) >= 0.25


def test_what_is_no_kink_is_cut_as_before():
    """Chords of a curve, kinks sharper than 100 degrees, and kinks less than a cell from a tip."""
    t = np.linspace(0, 1.2, 9)
    arc = np.stack([0.6 * np.sin(t) - 0.3, 0.6 * np.cos(t) - 0.4], axis=1)
    assert not len(kink_numbers(arc))
    mesh = scenes.perturbed(11, 5)
    sharp = [(-0.5, 0.02), (0.1, 0.03), (-0.1, 0.4)]
    close = [(-0.5, 0.02), (0.1, 0.03), (0.103, 0.04)]
    for line in (arc, sharp, close):
        space, _ = discretise(xc.Problem(mesh, STEEL, [xc.line_crack(line)], order=2))
        assert not len(space.cuts[0].kinks.points)


@pytest.mark.parametrize("n", [12, pytest.param(24, marks=pytest.mark.slow)])
def test_two_kinks_side_by_side(n):
    """Half a cell to three cells apart: a closed constant patch stays exact, pressures stable."""
    for leg in (0.05, 0.1, 0.2, 0.4):
        turned = np.array([0.05, 0.03]) + leg * scenes.rows(0.9)[0]
        line = [(-0.5, 0.01), (0.05, 0.03), turned, turned + 0.4 * scenes.rows(0.1)[0]]
        mesh = scenes.perturbed(n, 7)
        loads = [xc.traction(s, lambda x, normal: -normal) for s in scenes.SIDES]
        problem = xc.Problem(mesh, STEEL, [xc.line_crack(line)], order=2, loads=loads)
        solution = xc.solve(problem)
        assert np.abs(solution.contact[0].pressure - 1).max() <= 1e-9
        assert xc.inf_sup(problem) >= 0.25


def test_tip_functions_go_on_beyond_pi():
    """Between the level set and the crack gradients are those of the values, by differences."""
    checked = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x, angle = rng.uniform(-0.1, 0.1, 2), rng.uniform(0, 2 * np.pi)
        line = [x - 0.6 * scenes.rows(angle)[0], x, x + 0.3 * scenes.rows(angle + 0.9)[0]]
        problem = xc.Problem(scenes.perturbed(15, seed), STEEL, [xc.line_crack(line)], order=2)
        space, _ = discretise(problem)
        cut, mesh = space.cuts[0], space.mesh
        centre, cell = cut.sub_bary.mean(axis=1), cut.sub_to_cell
        inner = np.concatenate([(centre + 2 * cut.sub_bary[:, v]) / 3 for v in range(3)])
        cell, side = np.tile(cell, 3), np.tile(cut.sub_side, 3)
        phi = np.einsum("qb,qb->q", inner, cut.level_set.phi[mesh.cells[cell]])
        psi = np.einsum("qb,qb->q", inner, cut.level_set.psi_of_ends[mesh.cells[cell]])
        beyond = (phi * side < -1e-3 * np.abs(psi)) & (psi < 0) & cut.is_cut[cell]
        for batch, number, row in space.batches_of_points(cell[beyond]):
            if not batch.tips:
                continue
            bary, own = inner[beyond][number], side[beyond][number][:, None]
            _, slope = space.tabulate(batch, row, bary, own)
            for along in np.eye(2):
                shift = np.einsum("qbd,d->qb", mesh.gradient[batch.cells][row], 1e-6 * along)
                up = space.tabulate(batch, row, bary + shift, own)[0]
                down = space.tabulate(batch, row, bary - shift, own)[0]
                assert np.abs((up - down) / 2e-6 - slope @ along).max() <= 1e-5
                checked += len(number)
    assert checked > 10


@pytest.mark.parametrize("turn", [0.6, -0.9])
def test_K_behind_a_kink_in_the_disc_of_the_tip(turn):
    """The last leg is three cells long; K changes by 1 % at most on a mesh that is fine there."""
    kink = np.array([0.013, 0.027])
    tip = kink + 0.2 * scenes.rows(0.1 + turn)[0]
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]

    def K(mesh):
        crack = xc.line_crack([(-0.5, -0.01), kink, tip])
        problem = xc.Problem(mesh, STEEL, [crack], loads=loads, order=2, contact="off")
        return xc.stress_intensity(xc.solve(problem), 0).K

    coarse = scenes.perturbed(30, 3)
    fine = xc.refine(
        coarse, size=lambda x: np.maximum(2e-3, 0.2 * np.linalg.norm(x - kink, axis=1))
    )
    wanted = K(fine)
    assert np.abs(K(coarse) - wanted).max() <= 1e-2 * np.abs(wanted).max()


@pytest.mark.parametrize("seed", range(8))
def test_boundaries_of_pieces_are_closed(seed):
    """Normals of each side of each cell add up to zero, also where the kink lies on a mesh edge,
    a quarter of the edge from where phi is zero on it: to round-off."""
    places = {0: lambda mesh: mesh.points[mesh.edges[40]].mean(axis=0) * 1.0,
              1: lambda mesh: mesh.points[mesh.edges[61]].T @ (0.75, 0.25),
              2: lambda mesh: mesh.points[mesh.edges[57]].T @ (0.9, 0.1)}  # fmt: skip
    problem, _ = scene(seed, places.get(seed))
    space, lips = discretise(problem)
    cells = np.nonzero(space.cuts[0].is_cut)[0]
    points = boundary_points(space, cells, lips)
    for side in (1, -1):
        mine = points.side[:, 0] == side
        total = np.zeros((len(problem.mesh.cells), 2))
        np.add.at(total, points.cell[mine], points.normal[mine])
        assert np.abs(total[cells]).max() < 1e-14


def test_kink_on_a_mesh_edge_close_behind_the_tip():
    """A quarter of the way along the edge, the tip 1.25 cells ahead: K as on a finer mesh.

    Discretisation: 3e-5 of K_I and 1e-4 were measured.
    """
    line = [(-1.1, -0.04), (-0.5, 0.2), (-0.45011915, 0.20344981), (-0.40036527, 0.2084047)]
    pull = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    K = []
    for n in (25, 51):
        body = xc.box((-1, -1), (1, 1), n)
        problem = xc.Problem(body, STEEL, [xc.line_crack(line)], loads=pull)
        K.append(xc.stress_intensity(xc.solve(problem)).K[0])
    assert K[0] == pytest.approx(K[1], abs=5e-4 * K[1][0])


def test_kinks_on_mesh_points_of_a_crack_along_edges():
    """No cell is cut there; pressures end at the kinks all the same, as of a crack just beside.

    Before, K_I of the open tip was .014 and K_II .034 off.
    """
    stress = np.array([[0.2527, -0.3982], [-0.3982, -0.6235]])
    line = np.array([[-1.0, 2.0], [-1.0, 1.0], [0.0, 0.0], [1.0, -1.0], [2.0, -2.0]]) / 7
    loads = [
        xc.traction(side, lambda x, normal: normal @ stress)
        for side in ("left", "right", "bottom", "top")
    ]

    def K_of(points):
        problem = xc.Problem(
            xc.box((-1, -1), (1, 1), 14), xc.Isotropic(1.0, 0.3, "strain"),
            [xc.line_crack(points)], loads=loads,
        )  # fmt: skip
        return xc.stress_intensity(xc.solve(problem)).K

    assert np.abs(K_of(line) - K_of(line + np.array([1e-6, 7e-7]))).max() < 1e-3


# --- level sets of polylines: distances, old faces that stay, cracks that turn far ----------------


EXAMPLE_MESHES = Path(__file__).parents[2] / "examples" / "meshes"


def naive_distance(x, vertices):
    """Signed distance by the smallest of all segments, one point at a time."""
    result = []
    for point in x:
        feet = closest_on_segment(point, vertices[:-1], vertices[1:])
        gaps = np.linalg.norm(point - feet, axis=1)
        near = np.nonzero(gaps <= gaps.min() * (1 + 1e-14))[0]
        along = np.diff(vertices, axis=0)[near]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1).sum(axis=0)
        result.append(np.copysign(gaps.min(), normal @ (point - feet[near[0]])))
    return np.array(result)


def test_distance_agrees_with_its_naive_twin():
    rng = np.random.default_rng(2718)
    vertices = np.cumsum(rng.uniform(0.1, 1.0, (12, 2)), axis=0)
    x = rng.uniform(-1, 8, (400, 2))
    phi, segment = polyline_distance(x, vertices)
    np.testing.assert_allclose(phi, naive_distance(x, vertices), atol=1e-13)  # round-off
    assert segment.min() >= 0
    assert segment.max() <= len(vertices) - 2


def test_straight_crack_has_linear_level_sets():
    mesh = scenes.perturbed(9, seed=31)
    crack = place_line(scenes.edge_line((0.083, 0.047), 0.41), mesh)
    levels = line_levels(mesh, crack)
    x, frame = tip_frames(crack)
    local = (mesh.points - x[0]) @ frame[0].T
    np.testing.assert_allclose(levels.phi, local[:, 1], atol=1e-14)  # round-off
    np.testing.assert_allclose(levels.psi[0], local[:, 0], atol=1e-14)


def turning(steps, radius, degrees):
    """Crack that turns along a circle in equal kinks, from a short straight start."""
    turn = np.radians(degrees / steps)
    da = 2 * radius * np.sin(turn / 2)
    return turn, da


@pytest.mark.parametrize("degrees", [90, 200])
def test_turning_crack_keeps_all_its_faces(degrees):
    """At 200 degrees a purely nodal update loses 7 % of the crack; the polyline loses nothing."""
    mesh = scenes.perturbed(50, seed=77)
    crack = place_line(xc.line_crack([(-1.0, -0.503), (-0.05, -0.503)]), mesh)
    turn, da = turning(40, 0.4, degrees)
    for _ in range(40):
        crack = advance(crack, [turn], [da])
    result = cut(mesh, line_levels(mesh, crack), CELLS[2])
    lips = result.lip_points(mesh)
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    inside = np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum() - (
        -1.0 - crack.points[0, 0]
    )
    h = 2 / 50
    assert length == pytest.approx(inside, rel=2e-3)  # discretisation: kinks cut inside cells
    gaps = np.abs(naive_distance(lips.mean(axis=1), crack.points))
    assert gaps.max() < 0.05 * h  # no lip anywhere else


def test_old_faces_are_frozen_to_the_last_bit():
    mesh = scenes.perturbed(24, seed=5)
    before = place_line(xc.line_crack([(-1.0, 0.013), (0.021, 0.017)]), mesh)
    after = advance(before, [0.6], [0.2])
    old, new = line_levels(mesh, before), line_levels(mesh, after)
    tip = before.points[-1]
    behind = mesh.points[:, 0] < tip[0] - 2 * mesh.cell_size.max()
    behind &= np.abs(mesh.points[:, 1]) < 0.3
    assert behind.sum() > 50
    np.testing.assert_array_equal(new.phi[behind], old.phi[behind])
    np.testing.assert_array_equal(after.points[:-1], before.points)


def test_tip_that_does_not_move_is_the_same_to_the_last_bit():
    mesh = scenes.perturbed(24, seed=6)
    crack = place_line(xc.line_crack([(-0.4, 0.013), (0.4, 0.11)]), mesh)
    moved = advance(crack, [0.3, 0.2], [0.0, 0.15])
    np.testing.assert_array_equal(moved.points[:2], crack.points)
    assert moved.tips == (0, 2)
    levels = line_levels(mesh, moved)
    assert [len(c) for c in levels.tip_cells] == [1, 1]


def test_line_beyond_a_hole_is_no_crack():
    """The ray of a mouth on a hole meets the body again on the far side: nothing is cut there."""
    mesh = xc.read_mesh(EXAMPLE_MESHES / "plate_with_hole_05.msh")
    crack = place_line(xc.line_crack([(1.0, 0.0), (2.4, 0.0)]), mesh)
    lips = cut(mesh, line_levels(mesh, crack), CELLS[2]).lip_points(mesh)
    assert lips[..., 0].min() > 0.95
    length = np.linalg.norm(lips[:, 1] - lips[:, 0], axis=1).sum()
    assert length == pytest.approx(1.4, abs=1e-9)  # round-off; a node lies at (1, 0)


def test_growth_steps_given_by_angles_reach_the_published_tips():
    """Three steps of 0.4, each turned by 30 degrees (code_aster SSLV316 in 2D)."""
    mesh = xc.box((0, 0), (8, 18), (40, 90))
    crack = place_line(xc.line_crack([(0.0, 9.0), (2.0, 9.0)]), mesh)
    tips = []
    for _ in range(3):
        crack = advance(crack, [np.pi / 6], [0.4])
        tips.append(crack.points[-1])
    expected = [(2.346410, 9.2), (2.546410, 9.546410), (2.546410, 9.946410)]
    np.testing.assert_allclose(tips, expected, atol=1e-6)  # printed digits
