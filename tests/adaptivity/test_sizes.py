"""Sizes of the cells that `adapt` asks for, before K is known and from its bars.

References: the law that the sizes come from, and lengths of the cracks.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import xcrack as xc
from xcrack.adaptivity import sizes_3d
from xcrack.adaptivity.indicators import counted_places, values
from xcrack.adaptivity.resolved import resolved_fronts, resolved_tips
from xcrack.adaptivity.sizes_2d import size_ratios
from xcrack.mesh.locate import cell_sizes, locate
from xcrack.mesh.refinement import refine_to
from xcrack.mesh.simplex import leg_size
from xcrack.sif.error import finer_along
from xcrack.sif.sif import KErrors

PULL = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]


def block(*cracks, n=4):
    mesh = xc.box((-1, -1, -1), (1, 1, 1), n)
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3), cracks, loads=PULL, contact="off")


# Before K is known


def test_first_mesh_sees_the_ends_of_a_flat_ellipse():
    """Cells of 1.2 radii there, where they are as large as the tolerance lets them elsewhere."""
    scene = block(xc.elliptic_crack((0.01, 0.02, 0.013), (0, 0, 1), (1, 0, 0), 0.5, 0.25), n=5)
    mesh = sizes_3d.coarse_mesh(scene, 0.03)
    at_end, at_side = cell_sizes(mesh, np.array([[0.51, 0.02, 0.013], [0.01, 0.27, 0.013]]))
    assert at_end < 1.2 * 0.25**2 / 0.5 < at_side


def test_a_mesh_that_is_fine_enough_stays():
    crack = xc.line_crack([(20.3, 20.1), (21.0, 20.5)])
    steel = xc.Isotropic(1.0, 0.3, plane="strain")
    problem = xc.Problem(xc.box((0, 0), (50, 50), 6), steel, [crack])
    fine = resolved_tips(problem)
    assert resolved_tips(fine) is fine
    assert len(fine.mesh.cells) > len(problem.mesh.cells)


def test_the_first_mesh_in_3d_is_fine_along_the_front():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    mesh = xc.refine(mesh, size=lambda x: 0.14 + 0.6 * np.linalg.norm(x, axis=1))
    crack = xc.penny_crack((0.01, 0.02, 0.013), (0, 0, 1), 0.15)
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], loads=PULL, contact="off")
    mesh = sizes_3d.first_mesh(problem)
    angle = np.linspace(0, 2 * np.pi, 50)
    front = np.stack([0.15 * np.cos(angle), 0.15 * np.sin(angle), 0 * angle], 1)
    front += (0.01, 0.02, 0.013)
    at = mesh.cell_tree.query(front)[1]
    assert mesh.cell_size[at].max() <= 0.15 / 2.5 * 1.01
    assert mesh.cell_size.max() > 4 * mesh.cell_size[at].max()
    assert len(mesh.cells) < 60_000


@pytest.mark.parametrize(
    ("crack", "radius", "tips"),
    [
        (xc.penny_crack((0.01, 0.02, 0.013), (0, 0, 1), 0.1), 0.1, 1),
        (xc.elliptic_crack((-1, 0.02, 0.013), (0, 0, 1), (1, 0, 0), 0.1, 0.15), 0.12, 1),
        (xc.elliptic_crack((-1, -1, 0.013), (0, 0, 1), (1, 0, 0), 0.12, 0.12), 0.12, 1),
    ],
)
def test_a_crack_within_a_cell_in_3d(crack, radius, tips):
    """Inner, surface and corner cracks: fronts are seen, with the cells of the first mesh."""
    problem = block(crack)
    assert problem.mesh.cell_size.min() > 0.8
    with pytest.raises(xc.GeometryError):
        _ = problem.placed
    placed = resolved_fronts(problem)
    assert placed.placed[0].n_tips == tips
    mesh = sizes_3d.first_mesh(problem)
    x = placed.placed[0].points[placed.placed[0].fronts[0]]
    x = x[(np.abs(x) < 0.99).all(axis=1)]
    at = mesh.cell_tree.query(x)[1]
    assert np.median(mesh.cell_size[at]) <= radius / 2
    assert len(mesh.cells) < 40_000


def test_cells_between_two_fronts_are_as_small_as_their_distance():
    """Pennies of radius .2 with .1 between them, in one cell; a third one far away is coarser."""
    cracks = [
        xc.penny_crack((-0.25, 0.0, 0.0), (0, 0, 1), 0.2),
        xc.penny_crack((0.25, 0.0, 0.0), (0, 0, 1), 0.2),
    ]
    mesh = sizes_3d.first_mesh(block(*cracks))
    between, away = mesh.cell_tree.query([(0.0, 0.0, 0.0), (-0.45, 0.0, 0.0)])[1]
    assert mesh.cell_size[between] <= 0.05 * 1.01
    assert mesh.cell_size[away] > 0.055


def test_adapt_refines_where_a_front_bends():
    """Two cells a radius of curvature at least, where an ellipse is sharp."""
    mesh = xc.box((-1,) * 3, (1,) * 3, 4)
    crack = xc.elliptic_crack((0.01, 0.02, 0.013), (0, 0, 1), (1, 0, 0), 0.6, 0.3)
    problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], contact="off")
    first = sizes_3d.first_mesh(problem)
    ends = crack.points[np.abs(crack.points[:, 0] - 0.01) > 0.599]
    cells = np.unique(locate(first, ends)[0])
    assert leg_size(first, cells) <= 0.3**2 / 0.6 / 2


def test_finer_cells_along_a_front():
    """Of the error of K by a finer mesh: cells of two thirds at the front, few beside it."""
    crack = xc.plane_crack(
        [(-1.5, -1.0, 0.03), (0.1, -1.0, 0.03), (0.1, 1.0, 0.03), (-1.5, 1.0, 0.03)]
    )
    problem = block(crack, n=5)
    mesh, finer = problem.mesh, finer_along(problem, 0)
    at, before = (m.cell_tree.query([(0.1, 0.0, 0.03)])[1] for m in (finer, mesh))
    assert finer.cell_size[at] <= mesh.cell_size[before] / 1.5 * (1 + 1e-9)
    assert len(finer.cells) < 8 * len(mesh.cells)


# From bars


@pytest.mark.parametrize(("order", "dim"), [(2, 2), (2, 3), (1, 3)])
def test_wanted_sizes_give_the_wanted_sum(order, dim):
    """Shares that follow the law from which the sizes come: the sum is as wanted."""
    rng = np.random.default_rng(7103)
    shares = np.exp(rng.normal(size=(1, 400)))
    total = shares.sum()
    ratio = size_ratios(shares, np.array([2 * total]), 1.2 * total, order, dim)
    assert 0.25 < ratio.min() < 1
    assert (shares * ratio ** (2 * order)).sum() == pytest.approx(0.6 * total, rel=1e-6)
    # Cells that are refined have equal shares then.
    left = (shares[0] * ratio ** (2 * order + dim))[ratio < 1]
    assert np.ptp(left) <= 1e-6 * left.max()


def test_cells_inherit_what_is_wanted_of_them():
    mesh = xc.box((0, 0), (1, 1), 3)
    wanted = np.full(len(mesh.cells), np.inf)
    wanted[7] = 0.05
    fine = refine_to(mesh, wanted, 20)
    assert fine.cell_size.min() <= 0.05
    assert len(refine_to(mesh, wanted, 2).cells) < len(fine.cells)


def test_errors_that_are_small_enough_ask_for_nothing():
    shares = np.array([[1.0, 2.0], [0.0, 0.0]])
    assert (size_ratios(shares, np.array([3.0, np.nan]), 4.0, 2, 2) == 1).all()
    assert (size_ratios(shares, np.array([np.nan, np.nan]), 1e-30, 2, 2) == 2.0**-2.5).all()


def intensity(x, bar, at_surface=None, front=None):
    """K of 1 with these half-widths at some places of a line."""
    n = len(x)
    point = np.stack([x, 0 * x, 0 * x], axis=1)
    zero = np.zeros((n, 3))
    own = np.zeros(n, dtype=bool)
    return xc.SIF(
        x=point, frame=np.tile(np.eye(3), (n, 1, 1)), K=zero + 1.0, T=np.full(n, np.nan),
        spread=zero, s=np.asarray(x, float),
        front=np.zeros(n, dtype=np.int64) if front is None else front,
        at_surface=own if at_surface is None else at_surface, closed=own,
        domain_cells=np.full(n, 3.0),
        errors=KErrors(zero, zero + np.asarray(bar)[:, None], ("",) * n),
    )  # fmt: skip


def state(*sifs, pressed=(), beside=None):
    """What a round has measured, as far as the next mesh asks for it."""
    best, bar = values([sifs], [0], beside or (0.0,) * len(sifs))
    return SimpleNamespace(
        sifs=[sifs], solutions=[SimpleNamespace(at_rest=False)], K=best, bar=bar,
        pressed_cracks=pressed, surface_depths=beside or (0.0,) * len(sifs),
        scale=np.abs(best).max(),
    )  # fmt: skip


def test_cracks_become_finer_by_their_own_need():
    x = np.linspace(0, 1, 5)
    now = state(intensity(x, x * 0 + 0.001), intensity(x, x * 0 + 0.01), intensity(x, x * 0 + 0.2))
    times = [sizes_3d._refinement_factor(now, c, 0.005, 0.5) for c in range(3)]
    assert times[0] == 1.0
    assert 1.5 <= times[1] < times[2] == 2.0
    pressing = state(intensity(x, x * 0 + 0.001), pressed=(0,))
    assert sizes_3d._refinement_factor(pressing, 0, 0.005, 0.5) == 1.5
    missing = state(intensity(x, x * 0 + np.nan))
    assert sizes_3d._refinement_factor(missing, 0, 0.005, 0.5) == 1.5


def test_a_front_without_finer_cells_keeps_its_bars():
    """Its K has not changed because its cells have not: that is no small error."""
    x = np.linspace(0, 1, 5)
    before, now = intensity(x, x * 0 + 0.02), intensity(x, x * 0 + 0.03)
    assert np.allclose(sizes_3d._shorten_errors(now, before, is_finer=False).bar, 0.02)
    assert (sizes_3d._shorten_errors(now, before, is_finer=True).bar == 0).all()


def test_places_beside_a_free_surface_do_not_count():
    s = np.linspace(0, 1, 11)
    ends = (s < 0.05) | (s > 0.95)
    open_front = intensity(s, s * 0, at_surface=ends)
    assert counted_places(open_front, 0.0).tolist() == (~ends).tolist()
    assert counted_places(open_front, 0.25).tolist() == ((s > 0.25) & (s < 0.75)).tolist()
    assert counted_places(intensity(s, s * 0), 0.25).all()  # a closed front is nowhere beside one
    best, bar = values([[intensity(s, s * 0, at_surface=s >= 0)]], [0], [0.1])
    assert best.tolist() == [[0.0, 0.0, 0.0]]
    assert np.isnan(bar).all()


def test_each_front_has_cells_of_its_own_size():
    cracks = [
        xc.penny_crack((-0.5, 0.0, 0.0), (0, 0, 1), 0.25),
        xc.penny_crack((0.6, 0.0, 0.0), (0, 0, 1), 0.1),
    ]
    problem = resolved_fronts(block(*cracks))
    mesh = sizes_3d.first_mesh(problem)
    at = [mesh.cell_tree.query(c.points[c.fronts[0]])[1] for c in problem.placed]
    large, small = (float(np.median(mesh.cell_size[own])) for own in at)
    assert 1.6 < large / small < 4.0
