"""Rules around tips and fronts: volumes, polynomials, roots of r; cells are integrated once."""

from dataclasses import replace
from itertools import permutations
from math import factorial

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d
from support import scenes_3d as scenes
from support.scenes_2d import numerics_of
from xcrack.fem.assembly import boundary_points, corrected_gradients, reused_cells, with_one_jump
from xcrack.fem.loads import position
from xcrack.fem.quadrature import (
    Points,
    cell_points,
    front_points,
    n_parts,
    part_numbers,
    radius_at,
    segment_points,
    sub_cells,
    triangle_points,
)
from xcrack.fem.system import build
from xcrack.mesh.kernels.splitting import bisected_towards_fronts, graded_points
from xcrack.mesh.simplex import conical_rule, gauss, simplex_rule

CRACKS = {
    "oblique": xc.penny_crack((0.013, 0.021, 0.034), (0.1, 0.2, 1.0), 0.5),
    "on a layer": xc.penny_crack((0, 0, 0), (0, 0, 1), 0.5),
    "front on nodes": scenes.square_crack(2 / 3, 0.0),
    "a hair above": xc.penny_crack((0, 0, 1e-9), (0, 0, 1), 2 / 3),
    "from side to side": scenes.half_sheet(0.07, 0.1),
}


def model(crack, n=6, seed=None, **options):
    mesh = xc.box((-1, -1, -1), (1, 1, 1), n) if seed is None else scenes.perturbed(n, seed)
    return build(xc.Problem(mesh, scenes.STEEL, [crack], numerics=numerics_of(**options), order=1))


def with_tip(space):
    return space.enriched_cells[space.has_tip[space.enriched_cells]]


def moments(space, cells, points):
    """Largest error of the moments of each degree in the cells, relative to their volume."""
    x = position(space, points.cell, points.bary)
    bary, weight = conical_rule(3, 4)
    y = np.einsum("qb,cbd->cqd", bary, space.mesh.points[space.mesh.cells[cells]])
    error = np.zeros(3)
    for powers in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 0, 0), (0, 1, 1), (0, 0, 2)):
        total = np.bincount(
            points.cell, points.weight * np.prod(x**powers, axis=1), len(space.mesh.cells)
        )
        exact = space.mesh.volume[cells] * (np.prod(y**powers, axis=2) @ weight)
        worst = np.abs(total[cells] - exact) / space.mesh.volume[cells]
        error[sum(powers)] = max(error[sum(powers)], worst.max())
    return error


@pytest.mark.parametrize("name", CRACKS)
def test_cells_are_filled(name):
    """Volumes to round-off; quadratics too, but not where r = s² takes some of the degree."""
    space = model(CRACKS[name]).space
    cells = with_tip(space)
    result = moments(space, cells, cell_points(space, cells, 4, 0))
    assert result[0] <= 1e-13
    away = cells[~np.isin(cells, space.cuts[0].level_set.tip_cells[0])]
    assert (moments(space, away, cell_points(space, away, 4, 0)) <= 1e-13).all()
    rich = moments(space, cells, cell_points(space, cells, 6, 0))
    print(f"\n{name}: moments of degree 0, 1, 2 to {result}; {rich} with 6 points")
    assert (result[1:] <= 1e-2).all()
    assert (rich[:2] <= 1e-13).all()
    assert rich[2] <= 1e-5


def test_points_lie_inside_with_positive_weights():
    space = model(CRACKS["oblique"], seed=19).space
    cells = with_tip(space)
    for n in (2, 3, 4, 6):
        points = cell_points(space, cells, n, 0)
        assert (points.bary > 0).all()
        assert (points.weight > 0).all()
        total = np.bincount(points.cell, points.weight, len(space.mesh.cells))
        np.testing.assert_allclose(total[cells], space.mesh.volume[cells], rtol=1e-12)


def test_no_more_points_than_needed():
    """The time to assemble grows with them; 20 a cell are enough for K."""
    space = model(CRACKS["oblique"], n=8, seed=3).space
    cells = with_tip(space)
    count = len(cell_points(space, cells, 4, 0).weight) / len(cells)
    print(f"\n{count:.1f} points a cell with tip functions")
    assert count < 25


# Stiffness -------------------------------------------------------------------------------------


def eighths(bary, share, number):
    """Cut tetrahedra in eight."""
    a, b, c, d = (bary[:, k] for k in range(4))
    ab, ac, ad, bc, bd, cd = ((p + q) / 2 for p, q in
                              ((a, b), (a, c), (a, d), (b, c), (b, d), (c, d)))  # fmt: skip
    children = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d),
                (ab, ac, ad, bd), (ab, ac, bc, bd), (ac, ad, bd, cd), (ac, bc, bd, cd)]  # fmt: skip
    finer = np.concatenate([np.stack(child, axis=1) for child in children])
    return finer, np.tile(share / 8, 8), np.tile(number, 8)


def brute_force(space, cells, levels):
    """Points by cutting in eight towards the front, with no map at all."""
    subs = sub_cells(space, cells)
    bary, share, number = subs.bary, subs.fraction, np.arange(len(subs.cell))
    rule, weight = conical_rule(3, 3)
    parts = []
    for level in range(levels + 1):
        nodes = space.mesh.cells[subs.cell[number]]
        x = np.einsum("svb,sbd->svd", bary, space.mesh.points[nodes])
        size = np.linalg.norm(x[:, :, None] - x[:, None], axis=3).max(axis=(1, 2))
        near = (radius_at(space, nodes, bary).min(axis=1) < size) & (level < levels)
        rows = np.nonzero(~near)[0]
        place = np.einsum("pv,svb->spb", rule, bary[rows]).reshape(-1, 4)
        parts.append((np.repeat(number[rows], len(weight)), place, np.outer(share[rows], weight)))
        bary, share, number = eighths(bary[near], share[near], number[near])
    number = np.concatenate([p[0] for p in parts])
    place = np.concatenate([p[1] for p in parts])
    weight = np.concatenate([p[2].ravel() for p in parts])
    order = np.argsort(subs.cell[number], kind="stable")
    number = number[order]
    cell = subs.cell[number]
    volume = space.mesh.volume[cell]
    return Points(cell, place[order], weight[order] * volume, subs.side[number])


def gram(space, lips, cell, points, consistent):
    """Gram matrix of the gradients of all functions on one cell."""
    ((batch, _),) = space.batches(np.array([cell]))
    row = np.zeros(len(points.weight), dtype=np.int64)
    N, G = space.tabulate(batch, row, points.bary, points.side)
    if consistent:
        boundary = boundary_points(space, np.array([cell]), lips)
        part = (row, points.bary, points.weight, points.side)
        G = corrected_gradients(space, batch, part, N, G.copy(), boundary)
    return np.einsum("q,qad,qbd->ab", points.weight, G, G)


@pytest.mark.slow
@pytest.mark.mission
def test_stiffness_against_brute_force():
    """Cells at the front and around it: the rules in use against thousands of points a cell."""
    built = model(CRACKS["oblique"], seed=23)
    space, lips = built.space, built.lips
    rng = np.random.default_rng(23)
    at_front = space.cuts[0].level_set.tip_cells[0]
    around = np.setdiff1d(with_tip(space), at_front)
    worst = {}
    for name, cells in (("front", at_front), ("around", around)):
        errors = []
        for cell in rng.choice(cells, 6, replace=False):
            one = np.array([cell])
            wanted = gram(space, lips, cell, brute_force(space, one, 3), False)
            result = gram(space, lips, cell, cell_points(space, one, 4, 0), True)
            errors.append(np.linalg.norm(result - wanted) / np.linalg.norm(wanted))
        worst[name] = max(errors)
    print(f"\nstiffness of cells: {worst}")
    assert worst["front"] <= 1e-2
    assert worst["around"] <= 1e-2


def test_more_points_are_more_exact():
    built = model(CRACKS["oblique"], seed=29)
    space, lips = built.space, built.lips
    cells = space.cuts[0].level_set.tip_cells[0][:5]
    error = []
    for n in (3, 4, 6):
        part = []
        for cell in cells:
            one = np.array([cell])
            wanted = gram(space, lips, cell, cell_points(space, one, 9, 0), True)
            result = gram(space, lips, cell, cell_points(space, one, n, 0), True)
            part.append(np.linalg.norm(result - wanted) / np.linalg.norm(wanted))
        error.append(max(part))
    print(f"\nstiffness with 3, 4, 6 points: {error}")
    assert error[0] > error[1] > error[2]
    assert error[2] < 1e-3


# Boundaries ------------------------------------------------------------------------------------


def test_triangles_with_roots_of_the_distance():
    """Triangles at, near and away from a front x = 0; r = x: integrals of 1, x, sqrt(x)."""
    r = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.2, 1.1, 1.2], [3.0, 4.0, 4.0]])
    size = np.full(4, 1.2)
    number, bary, weight = triangle_points(r, size)
    x = np.einsum("qv,qv->q", bary, r[number])
    # With linear x the mean of f(x) over a triangle is a divided difference of its antiderivative.
    result = [np.bincount(number, weight * f) for f in (np.ones_like(x), x, x**2, np.sqrt(x))]
    np.testing.assert_allclose(result[0], 1.0, rtol=1e-14)
    np.testing.assert_allclose(result[1], r.mean(axis=1), rtol=1e-13)
    square = ((r**2).sum(axis=1) + r[:, 0] * r[:, 1] + r[:, 0] * r[:, 2] + r[:, 1] * r[:, 2]) / 6
    np.testing.assert_allclose(result[2], square, rtol=1e-12)
    fine, share = conical_rule(2, 12)
    wanted = np.sqrt(r @ fine.T) @ share
    # The first two by closed form: 2 int (1 - x) sqrt(x), 2 int x sqrt(x).
    wanted[:2] = 8 / 15, 4 / 5
    np.testing.assert_allclose(result[3][:2], wanted[:2], rtol=1e-12)
    np.testing.assert_allclose(result[3][2:], wanted[2:], rtol=1e-4)


def sums_of_normals(built, cells):
    """Sums of the outward normals of each piece of cells, by direction."""
    space = built.space
    boundary = boundary_points(space, cells, built.lips)
    part = part_numbers(space, boundary.cell, boundary.side)
    piece = n_parts(space) * np.searchsorted(cells, boundary.cell) + part
    return [np.bincount(piece, normal) for normal in boundary.normal.T]


@pytest.mark.parametrize("name", CRACKS)
def test_boundaries_of_pieces_close(name):
    """The outward normals of each piece sum to zero: no facet or lip is missing or doubled."""
    built = model(CRACKS[name])
    for total in sums_of_normals(built, with_tip(built.space)):
        np.testing.assert_allclose(total, 0.0, atol=1e-13)


@pytest.mark.parametrize("name", ["oblique", "a hair above"])
def test_the_correction_closes_the_defect(name):
    """Integral of the gradient against that of the normal over the boundary, piece by piece."""
    built = model(CRACKS[name], seed=None if name == "a hair above" else 31)
    space = built.space
    cells = with_tip(space)
    points = cell_points(space, cells, 4, 0)
    boundary = boundary_points(space, cells, built.lips)
    before = after = largest = 0.0
    for batch, _ in space.batches(cells):
        number, row, _ = points.of_cells(batch.cells)
        bary, weight, side = points.bary[number], points.weight[number], points.side[number]
        N, G = space.tabulate(batch, row, bary, side)
        fixed = corrected_gradients(space, batch, (row, bary, weight, side), N, G.copy(), boundary)
        chosen = np.isin(boundary.cell, batch.cells)
        brow = np.searchsorted(batch.cells, boundary.cell[chosen])
        values, _ = space.tabulate(batch, brow, boundary.bary[chosen], boundary.side[chosen])
        acts = batch.functions >= 0
        flux = np.zeros((len(batch.cells), N.shape[1], 3))
        np.add.at(flux, brow, values[:, :, None] * boundary.normal[chosen][:, None])
        for gradient, which in ((G, "before"), (fixed, "after")):
            inner = np.zeros_like(flux)
            np.add.at(inner, row, weight[:, None, None] * gradient)
            defect = float(np.abs((inner - flux)[acts]).max())
            if which == "before":
                before = max(before, defect)
            else:
                after = max(after, defect)
        largest = max(largest, float(np.abs(flux[acts]).max()))
    print(f"\n{name}: defect {before / largest:.1e} before, {after / largest:.1e} after")
    assert before > 1e-5 * largest
    assert after <= 1e-12 * largest


@pytest.mark.parametrize(("order", "count"), [(1, 4), (2, 14)])
def test_points_away_from_a_front(order, count):
    """Degree 2 at order 1; 5 at order 2, whose tip functions nearly repeat the quadratic ones."""
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    space = build(xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], order=order)).space
    cells = np.nonzero(space.has_tip)[0]
    corner = np.broadcast_to(np.eye(4), (len(cells), 4, 4))
    far = radius_at(space, mesh.cells[cells], corner).min(axis=1) > mesh.cell_size[cells]
    assert far.sum() > 20
    whole = np.ones(far.sum())
    number, _, weight = front_points(space, cells[far], corner[far], whole, 4)
    np.testing.assert_array_equal(np.bincount(number), count)
    np.testing.assert_allclose(np.bincount(number, weight), 1, rtol=1e-14)  # round-off


@pytest.mark.parametrize("graded", [False, True])
@pytest.mark.parametrize("centre", [(0.03, -0.02, 0.04), (0.03, -1.0, 0.04)])
def test_points_do_not_depend_on_the_order_of_corners(centre, graded):
    """Integrals over each cell of what no rule has exactly, on a regular mesh; round-off."""
    base = xc.box((-1, -1, -1), (1, 1, 1), 6)
    even = np.array([p for p in permutations(range(4)) if np.linalg.det(np.eye(4)[list(p)]) > 0])
    drawn = even[np.random.default_rng(3).integers(0, len(even), len(base.cells))]
    every = []
    for cells in (base.cells, np.take_along_axis(base.cells, drawn, axis=1)):
        mesh = xc.Mesh(base.points, cells)
        crack = xc.penny_crack(centre, (0.3, 0.0, 1.0), 0.5)
        space = build(xc.Problem(mesh, scenes.STEEL, [crack], order=1)).space
        points = cell_points(space, np.arange(len(cells)), 5, 5, graded)
        x = np.einsum("qb,qbd->qd", points.bary, mesh.points[cells[points.cell]])
        every.append(np.bincount(points.cell, points.weight * np.sin(9 * x).sum(axis=1)))
    np.testing.assert_allclose(every[1], every[0], atol=1e-14)


def test_parts_for_K_are_no_larger_than_their_distance():
    """Tetrahedra around two straight fronts: parts fill them, each is far enough or cut enough."""
    rng = np.random.default_rng(5)
    corner = rng.uniform(-1, 1, (40, 4, 3))
    corner[0] += 30  # far from both fronts: one part
    share = rng.uniform(0.01, 1, 40)
    levels = np.stack([corner[..., 1:], corner[..., :2] - 0.3], axis=1)  # along x, and along z
    number, bary, part = bisected_towards_fronts(
        np.broadcast_to(np.eye(4), (40, 4, 4)).copy(), corner, levels, share, 0.7, 6, 1e-6
    )
    assert (np.diff(number) >= 0).all()
    assert np.bincount(number)[0] == 1
    np.testing.assert_allclose(np.bincount(number, part), share, rtol=1e-14)
    np.testing.assert_allclose(np.abs(np.linalg.det(bary)) * share[number], part, rtol=1e-12)
    x = np.einsum("svb,sbd->svd", bary, corner[number])
    distance = np.minimum(np.hypot(x[..., 1], x[..., 2]), np.hypot(*(x[..., :2].T - 0.3)).T)
    longest = np.linalg.norm(x[:, :, None] - x[:, None], axis=3).max(axis=(1, 2))
    is_far = distance.min(axis=1) >= 0.7 * part**0.25 * longest * (1 - 1e-12)
    times = np.log2(share[number] / part).round().astype(int)
    assert times.max() == 6
    assert (is_far | (times == 6)).all()
    assert len(number) > 4 * len(corner)


# --- rules: polynomials exactly, roots of r well, and boundary points that neighbours share -------


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


def plane_model(points, order=2, n=9, seed=21, radius=None):
    """A built problem with one crack."""
    return build(
        xc.Problem(
            scenes_2d.perturbed(n, seed),
            xc.Isotropic(1.0, 0.3, "strain"),
            [xc.line_crack(points)],
            order=order,
            numerics=xc.Numerics(radius=radius),
        )
    )


@pytest.mark.parametrize("tip", [(0.083, 0.047), (0.0, 0.0), (1e-12, -1e-9), (0.2, 0.111)])
def test_triangles_are_filled_and_cubics_exact(tip):
    """The tip's cell included: its fan is exact for polynomials, which the patch tests need."""
    space = plane_model([(-1.2, 0.03), tip]).space
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
    space = plane_model([(-1.2, 0.03), tip], radius=2.0).space
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
    space = plane_model([(-1.2, 0.03), (0.083, 0.047)]).space
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
def test_boundaries_of_pieces_of_triangles_close(tip):
    """The outward normals of each piece sum to zero: no facet or lip is missing or doubled."""
    built = plane_model([(-1.2, 0.03), tip])
    for total in sums_of_normals(built, with_tip(built.space)):
        np.testing.assert_allclose(total, 0.0, atol=1e-14)


@pytest.mark.parametrize("points", [2, 3, 5, 7, 8])
def test_few_points_are_enough(points):
    """K moves by a hundredth of what a cell changes; 7 and more points are not symmetric."""

    def K(n):
        problem, _ = scenes_2d.williams_edge(
            14, *scenes_2d.TIPS[0], order=2, K=(1.0, 0.5), numerics=xc.Numerics(points=n)
        )
        return xc.stress_intensity(xc.solve(problem)).K[0]

    assert np.abs(K(points) - K(4)).max() <= 1e-5


def test_no_point_of_a_short_segment_lies_on_the_tip():
    """Its end is the tip but for round-off; a part as long as that was added to the rule."""
    u, w = gauss(6)
    tip = np.array([[1 / 3, 1 / 3]])
    for length in 10.0 ** np.arange(-12, 0):
        for angle in np.linspace(0.0, 2 * np.pi, 41):
            begin = tip + length * scenes_2d.rows(angle)[:1]
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


# --- cut cells are integrated once, as long as their cut stays ------------------------------------


STEEL_IN_PLANE = xc.Isotropic(1.0, 0.3, "strain")
BODY = xc.Problem(xc.box((0, 0), (1, 1), 1), STEEL_IN_PLANE).elasticity  # the same everywhere
ROOT = [(-1.2, 0.013), (-0.5, 0.03)]


def plane_scene(tip, order, more=()):
    cracks = [xc.line_crack([*ROOT, tip]), *more]
    return xc.Problem(scenes_2d.perturbed(20, 31), STEEL_IN_PLANE, cracks, order=order)


def solid_scene(front, _):
    mesh = scenes.perturbed(8, 32)
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [scenes.half_sheet(front, 0.03)], order=1)


@pytest.mark.parametrize(
    ("scene", "first", "second", "order"),
    [
        (plane_scene, (0.1, 0.05), (0.25, 0.12), 1),
        (plane_scene, (0.1, 0.05), (0.25, 0.12), 2),
        (solid_scene, 0.2, 0.45, 1),
    ],
    ids=["plane, order 1", "plane, order 2", "space"],
)
def test_only_what_changed_is_integrated(scene, first, second, order):
    """The stiffness is the same to the last bit, with fewer points."""
    before = scene(first, order)
    after = replace(scene(second, order), mesh=before.mesh)
    retained = build(after, build(before).bulk)
    fresh = build(after)
    assert (retained.stiffness != fresh.stiffness).nnz == 0
    assert retained.n_points < fresh.n_points
    simple = fresh.space.enriched_cells[with_one_jump(fresh.space, fresh.space.enriched_cells)]
    _, again = reused_cells(fresh.space, BODY, simple, retained.bulk.cells)
    assert again == 0
    _, changed = reused_cells(fresh.space, BODY, simple, build(before).bulk.cells)
    _, every = reused_cells(fresh.space, BODY, simple, None)
    assert 0 < changed < every
    assert fresh.n_points - retained.n_points == every - changed


@pytest.mark.parametrize("order", [1, 2])
def test_a_node_that_lost_its_function(order):
    """Cells around it are integrated anew, all others taken over."""
    space_ = build(plane_scene((0.1, 0.05), order)).space
    cells = space_.enriched_cells[with_one_jump(space_, space_.enriched_cells)]
    known, _ = reused_cells(space_, BODY, cells, None)
    nodes = space_.cell_nodes[cells]
    lost = np.array(space_.heaviside[0])
    lost[nodes[lost[nodes] >= 0][0]] = -1
    changed = replace(space_, heaviside=(lost,))
    cells = changed.enriched_cells[with_one_jump(changed, changed.enriched_cells)]
    result, used = reused_cells(changed, BODY, cells, known)
    fresh, every = reused_cells(changed, BODY, cells, None)
    np.testing.assert_array_equal(result.products, fresh.products)
    assert 0 < used < every


def test_functions_jump_in_a_crossed_cell_only_where_it_is_cut():
    """What the key of a cell leaves out."""
    for problem in (
        plane_scene((0.1, 0.05), 2),
        plane_scene((0.31, -0.22), 1),
        solid_scene(0.2, 1),
    ):
        space_ = build(problem).space
        cells = space_.enriched_cells[with_one_jump(space_, space_.enriched_cells)]
        cut = space_.cuts[0]
        np.testing.assert_array_equal(cut.is_cut[cells], cut.side[cells] == 0)


def test_another_crack_in_the_same_cells_is_integrated_anew():
    """Shifted by a millionth of a cell, mirrored, or numbered as another crack."""
    known = build(plane_scene((0.1, 0.05), 2)).bulk.cells
    assert len(known.cells)
    shifted = xc.line_crack([(x, y + 1e-7) for x, y in (*ROOT, (0.1, 0.05))])
    turned = xc.line_crack([*ROOT, (0.1, 0.05)][::-1])
    other = xc.line_crack([(-1.2, -0.6), (-0.4, -0.61)])
    scene = plane_scene((0.1, 0.05), 2)
    for cracks in ([shifted], [turned], [other, xc.line_crack([*ROOT, (0.1, 0.05)])]):
        changed = build(replace(scene, cracks=cracks))
        cells = changed.space.enriched_cells[
            with_one_jump(changed.space, changed.space.enriched_cells)
        ]
        _, used = reused_cells(changed.space, BODY, cells, known)
        _, every = reused_cells(changed.space, BODY, cells, None)
        assert used == every


def test_a_crack_that_stands_still_beside_one_that_grows():
    """All of its simple cells are taken over."""
    other = xc.line_crack([(1.2, -0.55), (0.2, -0.52)])
    before = build(plane_scene((0.1, 0.05), 2, [other]))
    after = build(replace(plane_scene((0.3, 0.1), 2, [other]), mesh=before.space.mesh), before.bulk)
    same = np.isin(after.bulk.cells.cells, before.bulk.cells.cells)
    second = after.bulk.cells.key[:, 0] == 1
    assert second.any()
    assert same[second].all()


def test_cells_with_tip_functions_or_two_cracks_are_not_reused():
    other = xc.line_crack([(1.2, -0.15), (0.0, -0.12)])
    problem = plane_scene((0.1, 0.05), 2, [other])
    space_ = build(problem).space
    simple = with_one_jump(space_, space_.enriched_cells)
    assert not space_.has_tip[space_.enriched_cells[simple]].any()
    one = np.isin(space_.signature[space_.enriched_cells], [1, 2])
    np.testing.assert_array_equal(simple, one)
