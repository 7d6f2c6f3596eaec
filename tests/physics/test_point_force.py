"""Forces at points of the body that are no mesh points."""

import warnings

import numpy as np
import pytest

import xcrack as xc

STEEL = {2: xc.Isotropic(1000.0, 0.3, "stress"), 3: xc.Isotropic(1000.0, 0.3)}
ROUND_OFF = 1e-9


def moved(x, f, mesh, order=1, cracks=(), supports=None, at=((0.4, 0.3),)):
    """Displacements at some points under one force."""
    supports = [xc.fix("bottom" if mesh.dim == 2 else "back")] if supports is None else supports
    loads = [xc.point_force(x, f)]
    problem = xc.Problem(
        mesh, STEEL[mesh.dim], list(cracks), supports, loads, order=order, contact="off"
    )
    return xc.solve(problem).displacement(np.array(at))


def test_between_mesh_points_it_is_shared_as_statics_asks():
    """At order 1, between two points of a side and within a cell: the mean by hats (round-off)."""
    mesh, f = xc.box((0, 0), (1, 1), 5), (3.0, -1.0)
    ends = [moved((x, 1.0), f, mesh) for x in (0.4, 0.6)]
    between = moved((0.45, 1.0), f, mesh)
    assert between == pytest.approx(0.75 * ends[0] + 0.25 * ends[1], rel=ROUND_OFF)
    cell = mesh.cells[7]
    corners = [moved(x, f, mesh) for x in mesh.points[cell]]
    share = np.array([0.5, 0.3, 0.2])
    inside = moved(share @ mesh.points[cell], f, mesh)
    assert inside == pytest.approx(np.einsum("i,ipd->pd", share, corners), rel=ROUND_OFF)


def test_on_a_facet_in_space():
    mesh, f = xc.box((0, 0, 0), (1, 1, 1), 3), (1.0, 2.0, -1.0)
    facet = mesh.facet_sets["front"][4]
    at, supports = ((0.4, 0.3, 0.5),), [xc.fix("top")]
    corners = [moved(x, f, mesh, at=at, supports=supports) for x in mesh.points[facet]]
    share = np.array([0.2, 0.3, 0.5])
    middle = moved(share @ mesh.points[facet], f, mesh, at=at, supports=supports)
    assert middle == pytest.approx(np.einsum("i,ipd->pd", share, corners), rel=ROUND_OFF)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_beside_a_mouth_it_acts_on_its_own_side(order, side):
    """A crack cuts the body through: the half without the force does not move."""
    mesh = xc.box((0, 0), (1, 1), 5)
    crack = xc.line_crack([(-0.1, 0.47), (1.1, 0.47)])
    supports = [xc.fix("bottom"), xc.fix("top")]
    y = 0.47 + side * 0.02
    at = ((0.7, 0.1), (0.7, 0.9))
    u = moved((0.0, y), (-1.0, 0.0), mesh, order, [crack], supports, at)
    size = np.linalg.norm(u, axis=1)
    assert size[(1 - side) // 2] < ROUND_OFF * size[(1 + side) // 2]


def disc(n=30, rings=6, turn=0.0):
    """A disc of radius 1 of n chords, its first point turned by some angle."""
    angle = turn + 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([*(r / rings * circle for r in range(1, rings + 1)), [[0.0, 0.0]]])
    k = np.arange(n)
    following = (k + 1) % n
    cells = [np.stack([np.full(n, n * rings), k, following], axis=1)]
    for r in range(rings - 1):
        a, b, c, d = r * n + k, r * n + following, (r + 1) * n + k, (r + 1) * n + following
        cells += [np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)]
    return xc.Mesh(points, np.concatenate(cells))


@pytest.mark.parametrize("turn", [0.0, 0.03, 0.1])
def test_a_disc_that_two_forces_press(turn):
    """An oblique crack has the same K at both tips, wherever points of the mesh are.

    The forces are on the circle, between points of the mesh and outside of its chords. A force that
    went to the nearest mesh point had a moment, and K of the tips was up to 2 % apart.
    """
    way = 0.25 * np.array([np.sin(0.4), np.cos(0.4)])
    loads = [xc.point_force((0, s), (0, -s)) for s in (1, -1)]
    crack = xc.line_crack([-way, way])
    K = xc.stress_intensity(xc.solve(xc.Problem(disc(turn=turn), STEEL[2], [crack], loads=loads))).K
    print(f"\nK {K}")
    assert np.abs(K[0]) == pytest.approx(np.abs(K[1]), rel=3e-3)  # discretisation


def test_far_points_are_refused():
    with pytest.raises(xc.ProblemError, match="away from the nearest mesh point"):
        moved((3.0, 0.0), (1, 0), xc.box((0, 0), (1, 1), 5))


def bent(n, at, f=(0.0, -1.0)):
    """A bar of 8 x 1 on two rollers, pressed in its middle, with cells of 8 / n."""
    bar = xc.box((-4, 0), (4, 1), (n, 6))
    supports = [xc.fix((-at, 0.0)), xc.fix((at, 0.0), axis=1)]
    crack = xc.line_crack([(0.0, -0.1), (0.0, 0.5)])
    loads = [xc.point_force((0, 1), f)] if f else [xc.traction(s, lambda x, n: n) for s in
                                                   ("left", "right")]  # fmt: skip
    return xc.Problem(bar, STEEL[2], [crack], supports, loads)


def warned(problem):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution = xc.solve(problem)
    messages = [str(m.message) for m in caught if "mesh point" in str(m.message)]
    return xc.stress_intensity(solution).K_I[0], messages


def test_supports_that_hold_other_points_are_named():
    """K of a bent bar follows its span; where nothing bears, nothing is said."""
    exact, messages = warned(bent(41, 140 / 41))
    assert not messages
    K, messages = warned(bent(41, 3.5))
    assert len(messages) == 2
    assert "the distance of fix([-3.5, 0.0]) from the mesh point (-3.41463, 0)" in messages[0]
    assert "is 0.01067, above 0.002" in messages[0]
    assert K == pytest.approx(exact, rel=1e-9)  # the points that are nearest to both
    assert not warned(bent(41, 3.5, None))[1]
