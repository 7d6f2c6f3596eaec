"""Rules: polynomials exactly, roots of r well, and boundary points that neighbours share."""

from math import factorial

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from xcrack.analysis.solve import build
from xcrack.fem.assembly import boundary_points
from xcrack.fem.loads import position
from xcrack.fem.quadrature import cell_points, n_parts, part_numbers, segment_points
from xcrack.mesh.kernels.splitting import graded_points
from xcrack.mesh.simplex import conical_rule, gauss, simplex_rule


def moment(powers):
    """Mean of a monomial in the barycentric coordinates over a simplex."""
    d = len(powers) - 1
    top = factorial(d) * np.prod([factorial(p) for p in powers], dtype=float)
    return top / factorial(sum(powers) + d)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("degree", range(1, 13))
def test_rules_are_exact_to_their_degree(dim, degree):
    bary, weight = simplex_rule(dim, degree)
    rng = np.random.default_rng(degree)
    for _ in range(12):
        powers = rng.multinomial(degree, np.full(dim + 1, 1 / (dim + 1)))
        result = weight @ np.prod(bary**powers, axis=1)
        assert result == pytest.approx(moment(powers), rel=1e-12)  # round-off


def test_conical_points_lie_inside():
    for n in range(1, 9):
        bary, weight = conical_rule(2, n)
        assert bary.min() > 0
        assert weight.min() > 0


def model(points, order=2, n=9, seed=21, radius=None):
    """A built problem with one crack."""
    return build(
        xc.Problem(
            scenes.perturbed(n, seed),
            xc.Isotropic(1.0, 0.3, "strain"),
            [xc.line_crack(points)],
            order=order,
            numerics=xc.Numerics(radius=radius),
        )
    )


@pytest.mark.parametrize("tip", [(0.083, 0.047), (0.0, 0.0), (1e-12, -1e-9), (0.2, 0.111)])
def test_cells_are_filled_and_cubics_exact(tip):
    """The tip's cell included: its fan is exact for polynomials, which the patch tests need."""
    space = model([(-1.2, 0.03), tip]).space
    mesh = space.mesh
    cells = space.enriched_cells
    points = cell_points(space, cells, 4, 4)
    x = position(space, points.cell, points.bary)
    for powers in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (1, 2)):
        total = np.bincount(
            points.cell,
            points.weight * x[:, 0] ** powers[0] * x[:, 1] ** powers[1],
            len(mesh.cells),
        )
        bary, weight = conical_rule(2, 4)
        y = np.einsum("qb,cbd->cqd", bary, mesh.points[mesh.cells[cells]])
        exact = mesh.volume[cells] * (y[..., 0] ** powers[0] * y[..., 1] ** powers[1] @ weight)
        np.testing.assert_allclose(total[cells], exact, atol=1e-13)  # round-off


def test_one_over_r_around_a_tip():
    """Integral of 1/r over the square, against its closed form: discretisation."""
    tip = (0.083, 0.047)
    space = model([(-1.2, 0.03), tip], radius=2.0).space
    points = cell_points(space, np.arange(len(space.mesh.cells)), 4, 4)
    x = position(space, points.cell, points.bary)
    result = points.weight @ (1 / np.linalg.norm(x - tip, axis=1))
    exact = 0.0
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = 1 - sx * tip[0], 1 - sy * tip[1]
        # In a right triangle with leg a along an axis, int 1/r = a asinh(b/a), and its twin.
        exact += a * np.arcsinh(b / a) + b * np.arcsinh(a / b)
    assert result == pytest.approx(exact, rel=2e-5)


def test_graded_segments_integrate_polynomials_and_roots():
    space = model([(-1.2, 0.03), (0.083, 0.047)]).space
    begin = np.array([[0.083, 0.047], [0.05, 0.05], [0.6, 0.6]])
    end = np.array([[0.2, 0.1], [0.2, 0.05], [0.7, 0.6]])
    segment, place, weight = segment_points(space, begin, end)
    np.testing.assert_allclose(place.sum(axis=1), 1, rtol=1e-15)
    for k in range(3):
        t = place[segment == k, 1]
        w = weight[segment == k] / np.linalg.norm(end[k] - begin[k])
        for p in range(5):
            assert w @ t**p == pytest.approx(1 / (p + 1), rel=1e-12)
        if k == 0:  # starts at the tip: r = u² is exact
            assert w @ np.sqrt(t) == pytest.approx(2 / 3, rel=1e-12)


@pytest.mark.parametrize("tip", [(0.083, 0.047), (0.0, 0.0), (0.2, 0.111)])
def test_boundaries_of_pieces_close(tip):
    """The outward normals of each piece sum to zero: no facet or lip is missing or doubled."""
    built = model([(-1.2, 0.03), tip])
    space = built.space
    cells = space.enriched_cells[space.has_tip[space.enriched_cells]]
    boundary = boundary_points(space, cells, built.lips)
    part = part_numbers(space, boundary.cell, boundary.side)
    piece = n_parts(space) * np.searchsorted(cells, boundary.cell) + part
    for axis in range(2):
        total = np.bincount(piece, boundary.normal[:, axis])
        np.testing.assert_allclose(total, 0.0, atol=1e-14)


@pytest.mark.parametrize("points", [2, 3, 5, 7, 8])
def test_few_points_are_enough(points):
    """K moves by a hundredth of what a cell changes; 7 and more points are not symmetric."""

    def K(n):
        problem, _ = scenes.williams_edge(
            14, *scenes.TIPS[0], order=2, K=(1.0, 0.5), numerics=xc.Numerics(points=n)
        )
        return xc.stress_intensity(xc.solve(problem)).K[0]

    assert np.abs(K(points) - K(4)).max() <= 1e-5


def test_no_point_of_a_short_segment_lies_on_the_tip():
    """Its end is the tip but for round-off; a part as long as that was added to the rule."""
    u, w = gauss(6)
    tip = np.array([[1 / 3, 1 / 3]])
    for length in 10.0 ** np.arange(-12, 0):
        for angle in np.linspace(0.0, 2 * np.pi, 41):
            begin = tip + length * scenes.rows(angle)[:1]
            end = tip + np.array([[1.1e-16, -1.1e-16]])
            _, place, weight = graded_points(begin, end, tip, u, w)
            assert len(weight) == 6
            assert place[:, 0].min() >= 0.99 * u.min() ** 2
            assert weight.sum() == pytest.approx(np.linalg.norm(begin - end), rel=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-8, 1e-4, 1e-2, 0.3])
def test_points_are_graded_from_a_tip_beyond_the_end(gap):
    """The integral of 1/sqrt(r) along a segment that begins a little beside the tip is exact."""
    u, w = gauss(6)
    begin, end = np.array([[gap, 0.0]]), np.array([[gap + 1.0, 0.0]])
    for a, b in ((begin, end), (end, begin)):
        _, place, weight = graded_points(a, b, np.zeros((1, 2)), u, w)
        r = (place @ np.concatenate([a, b]))[:, 0]
        wanted = 2 * (np.sqrt(gap + 1) - np.sqrt(gap))
        assert weight @ r**-0.5 == pytest.approx(wanted, rel=1e-12)  # round-off
        assert weight.sum() == pytest.approx(1.0, rel=1e-12)
        assert weight @ r**2 == pytest.approx(((gap + 1) ** 3 - gap**3) / 3, rel=1e-12)
