"""In 3D K depends neither on the numbers of nodes and cells nor on the order of corners in cells.

On regular meshes, where the values that decide how cells are cut and integrated are often equal.
All tolerances here are round-off: the same arithmetic on other numbers, with level sets of 1e-9.
"""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import xcrack as xc
from support import scenes_3d as scenes

ROUND_OFF = 2e-8
SHIFT = (3.7, -11.3, 0.9)
STRESS = np.array([[0.2, 0.1, 0.3], [0.1, -0.1, 0.2], [0.3, 0.2, 1.0]])
STRAIN = 1.3 * STRESS - 0.3 * np.trace(STRESS) * np.eye(3)
EVEN = np.array([p for p in permutations(range(4)) if np.linalg.det(np.eye(4)[list(p)]) > 0])
INNER = xc.penny_crack((0.03, -0.02, 0.04), (0.3, -0.5, 1.0), 0.5)
SURFACE = xc.penny_crack((0.03, -1.0, 0.04), (0.3, 0.0, 1.0), 0.5)


BENT = xc.surface_crack(
    INNER.points + np.outer(INNER.points[:, 0] ** 2, (0.0, 0.0, 0.3)), INNER.faces
)


def turn():
    q = np.linalg.qr(np.random.default_rng(17).normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def corners_permuted(cells):
    """The same cells, with another even permutation of the corners of each."""
    drawn = EVEN[np.random.default_rng(3).integers(0, len(EVEN), len(cells))]
    return np.take_along_axis(cells, drawn, axis=1)


def renumbered(points, cells):
    rng = np.random.default_rng(5)
    order = rng.permutation(len(points))
    return points[order], np.argsort(order)[cells][rng.permutation(len(cells))]


def solved(crack, order, points, cells, to=None, by=(0.0, 0.0, 0.0)):
    """K along the front of a crack in a cube that an even strain pulls, one side left free.

    The scene is turned, or mirrored, and then shifted; places of K are as before.
    """
    to = np.eye(3) if to is None else to
    points = points @ to.T + by
    if np.linalg.det(to) < 0:
        cells = cells[:, [1, 0, 2, 3]]
    boundary = xc.Mesh(points, cells).boundary
    free = np.abs(((points[boundary].mean(axis=1) - by) @ to)[:, 1] + 1) < 1e-9
    mesh = xc.Mesh(points, cells, {"held": boundary[~free]})
    support = xc.displacement("held", lambda x: ((x - by) @ to) @ STRAIN @ to.T)
    faces = crack.faces if np.linalg.det(to) > 0 else crack.faces[:, [0, 2, 1]]
    placed = xc.surface_crack(crack.points @ to.T + by, faces)
    problem = xc.Problem(
        mesh, xc.Isotropic(1.0, 0.3), [placed], supports=[support], order=order, contact="off"
    )
    sif = xc.stress_intensity(xc.solve(problem))
    return (sif.x - by) @ to, sif.K


def differ(one, other, is_mirrored):
    """Largest difference of K at the same places, over the largest K."""
    (x, K), (x_wanted, wanted) = one, other
    away, at = cKDTree(x).query(x_wanted)
    assert away.max() < 1e-11
    K = K[at]
    if is_mirrored:  # the sense of shear follows the frame
        K, wanted = np.abs(K), np.abs(wanted)
    return np.abs(K - wanted).max() / np.abs(wanted).max()


@pytest.fixture(scope="module")
def reference():
    mesh, results = xc.box((-1, -1, -1), (1, 1, 1), 6), {}
    for crack in (INNER, SURFACE):
        for order in (1, 2):
            results[crack, order] = solved(crack, order, mesh.points, mesh.cells)
    return results


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("crack", [INNER, SURFACE], ids=["inner", "surface"])
@pytest.mark.parametrize(
    "change",
    [
        *(pytest.param(each, marks=pytest.mark.slow) for each in ("corners", "numbers")),
        "turned",
        "mirrored",
        pytest.param("shifted", marks=pytest.mark.slow),
    ],
)
def test_K(reference, crack, order, change):
    mesh, to = xc.box((-1, -1, -1), (1, 1, 1), 6), None
    points, cells = mesh.points, mesh.cells
    if change == "mirrored":
        to = np.diag([-1.0, 1.0, 1.0])
    else:
        cells = corners_permuted(cells)
    if change in ("numbers", "turned"):
        points, cells = renumbered(points, cells)
    if change == "turned":
        to = turn()
    by = SHIFT if change == "shifted" else (0.0, 0.0, 0.0)
    K = solved(crack, order, points, cells, to, by)
    assert differ(K, reference[crack, order], change == "mirrored") <= ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize("change", ["turned", "mirrored"])
def test_K_of_a_bent_crack(change):
    """Ahead of its front the level sets are those of a twisted strip."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    to = turn() if change == "turned" else np.diag([-1.0, 1.0, 1.0])
    one = solved(BENT, 1, mesh.points, mesh.cells, to)
    other = solved(BENT, 1, mesh.points, mesh.cells)
    off = differ(one, other, change == "mirrored")
    print(f"\n{change}: {off:.1e}")
    assert off <= 1e-6


def drawn(rng):
    """A penny or ellipse inside or at the free side; along mesh planes one time in four."""
    normal = np.eye(3)[2] if rng.random() < 0.25 else rng.normal(size=3)
    along = np.cross(normal, rng.normal(size=3))
    a = rng.uniform(0.45, 0.6)
    b = a * rng.uniform(0.7, 1.0)
    at = rng.uniform(-0.05, 0.05, 3) - (0.0, rng.choice([0.0, 1.0]), 0.0)
    return xc.elliptic_crack(at, normal, along, a, b)


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(7301, 7309))
def test_K_of_drawn_scenes(seed, order):
    """All at once: turned and mirrored, shifted, renumbered, corners in another order."""
    rng = np.random.default_rng(seed)
    crack, n = drawn(rng), int(rng.integers(5, 8))
    mesh = scenes.perturbed(n, seed) if rng.random() < 0.5 else xc.box((-1,) * 3, (1,) * 3, n)
    to = turn() @ np.diag([1.0, 1.0, rng.choice([-1.0, 1.0])])
    points, cells = renumbered(mesh.points, corners_permuted(mesh.cells))
    one = solved(crack, order, points, cells, to, SHIFT)
    other = solved(crack, order, mesh.points, mesh.cells)
    off = differ(one, other, np.linalg.det(to) < 0)
    print(f"\n{seed}, order {order}: {off:.1e}")
    assert off <= 1e-6
