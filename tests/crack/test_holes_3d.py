"""Fronts at holes, fillets and roots of notches, in bodies that gmsh meshes.

At holes fronts go into them, meet behind, and go on as one. A front that advances evenly covers
what lies within the advance of it by the shortest way in the body (Huygens): straight to the hole,
round it along its wall, straight on. Area and outline of that are exact.
"""

import shutil
import warnings

import numpy as np
import pytest

import xcrack as xc
from support.rows import slow
from xcrack import Crack, Mesh
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.measures import area_inside, front_ends
from xcrack.crack.stations import place_crack, stations_of
from xcrack.mesh.gmsh_session import session
from xcrack.mesh.locate import Body, cell_sizes, locate
from xcrack.mesh.triangulation import face_areas

H, HALF = 0.1, 0.7  # cells at the crack; half the width of the block


def block(path, *holes, h=H, facets=0):
    """A block with holes through it or into it, `(x, y, z, height, radius)` or a ball of four.

    Seven numbers are a hole in another direction, `(x, y, z, dx, dy, dz, radius)`; walls have at
    least so many facets round them.
    """
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ, mesh = gmsh.model.occ, gmsh.model.mesh
        body = occ.addBox(-1.0, -HALF, -0.3, 1.8, 2 * HALF, 0.6)
        cut = [
            occ.addSphere(*hole)
            if len(hole) == 4
            else occ.addCylinder(
                *hole[:3], *(hole[3:6] if len(hole) == 7 else (0, 0, hole[3])), hole[-1]
            )
            for hole in holes
        ]
        occ.cut([(3, body)], [(3, tag) for tag in cut])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
        for name, z in (("bottom", -0.3), ("top", 0.3)):
            around = (-2, -2, z - 1e-3, 2, 2, z + 1e-3)
            faces = gmsh.model.getEntitiesInBoundingBox(*around, dim=2)
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in faces], name=name)
        mesh.setSizeCallback(lambda d, t, x, y, z, lc: min(lc, h + 0.4 * max(0.0, abs(z) - 0.2)))
        for option, value in (
            ("ExtendFromBoundary", 0),
            ("FromPoints", 0),
            ("FromCurvature", facets),
        ):
            gmsh.option.setNumber(f"Mesh.MeshSize{option}", value)
        mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return xc.read_mesh(path)


def through_crack(x: float) -> Crack:
    return xc.plane_crack([(-3, -3, 0.011), (x, -3, 0.011), (x, 3, 0.011), (-3, 3, 0.011)])


def grown(crack: Crack, mesh: Mesh, da: float) -> Crack:
    """Every front advanced by da straight ahead, and placed again."""
    at = stations_of([crack], mesh)
    size = 0.5 * float(cell_sizes(mesh, at.x).mean())
    even = np.ones(len(at.s))
    body = Body.of(mesh)
    moved = advance_fronts(crack, at.s, at.front, 0 * even, da * even, size, body)
    placed = place_crack(moved, mesh)
    n = len(crack.points)
    assert np.array_equal(placed.points[:n], crack.points)
    assert np.array_equal(placed.faces[: len(crack.faces)], crack.faces)
    return placed


def shortest_way(x, start: float, centre: float, radius: float):
    """From the line x = start to points behind it, round a circle on the axis `(n,)`."""
    away = x - (centre, 0.0)
    r = np.linalg.norm(away, axis=1)
    free = np.sqrt(np.maximum(r**2 - radius**2, 0.0))
    turn = np.arctan2(away[:, 0], np.abs(away[:, 1])) - np.arccos(np.minimum(radius / r, 1.0))
    round_it = centre - start + radius * turn + free
    shadow = (np.abs(x[:, 1]) < radius) & (x[:, 0] > centre) & (turn > 0)
    return np.where(shadow, round_it, x[:, 0] - start), r > radius


@pytest.mark.parametrize(
    ("ratio", "counts"), [*slow((0.6, [1]), (1.5, [1, 2, 1])), (2.5, [1, 2, 1])]
)
def test_an_even_front_passes_a_hole(tmp_path, ratio, counts):
    """Two arms beside a hole wider than two cells, one front behind; the area is Huygens'.

    Tolerances are discretisation: a cell's area before the arms meet; the gap that closes
    then is a cell wide.
    """
    radius, centre, start, da = ratio * H, -0.4, -0.4 - ratio * H - 0.12, 0.1
    mesh = block(tmp_path / "hole.msh", (centre, 0, -0.5, 1.0, radius))
    body = Body.of(mesh)
    crack = place_crack(through_crack(start), mesh)
    grid = np.stack(np.meshgrid(np.arange(-1, 0.8, 0.004), np.arange(-HALF, HALF, 0.004)), -1)
    way, solid = shortest_way(grid.reshape(-1, 2) + 0.002, start, centre, radius)
    fronts = []
    for step in range(9):
        fronts.append(len(crack.fronts))
        exact = 0.004**2 * float((solid & (way < step * da)).sum())
        met = 2 in fronts[:-1] and fronts[-1] == 1
        assert area_inside(crack, mesh) == pytest.approx(exact, abs=0.03 if met else 0.01)
        # No face in the body that growth did not make.
        inside = crack.points[body.contains(crack.points)]
        reached, _ = shortest_way(inside[:, :2], start, centre, radius)
        assert reached.max() < step * da + (1.1 if met else 0.7) * H
        if step < 8:
            crack = grown(crack, mesh, da)
    assert [n for n, before in zip(fronts, [0, *fronts]) if n != before] == counts


@pytest.mark.parametrize(
    "holes",
    [
        pytest.param([(-0.4, 0, -0.05, 0.6, 0.15)], id="blind"),
        pytest.param([(-0.4, 0, 0.03, 0.15)], id="cavity", marks=pytest.mark.slow),
        pytest.param(
            [(-0.4, 0.28, -0.5, 1.0, 0.12), (-0.4, -0.28, -0.5, 1.0, 0.12)],
            id="abreast",
            marks=pytest.mark.slow,
        ),
        pytest.param([(-0.6, 0, -0.5, 1.0, 0.12), (0.0, -0.1, -0.5, 1.0, 0.15)], id="in a row"),
    ],
)
def test_blind_holes_cavities_and_several_holes(tmp_path, holes):
    """The front is whole behind them, has gained no more than its way, and no less area."""
    mesh = block(tmp_path / "holes.msh", *holes)
    body, start, da, steps = Body.of(mesh), holes[0][0] - 0.27, 0.1, 11
    crack = place_crack(through_crack(start), mesh)
    area = [area_inside(crack, mesh)]
    counts = set()
    for step in range(1, steps + 1):
        crack = grown(crack, mesh, da)
        area.append(area_inside(crack, mesh))
        counts.add(len(crack.fronts))
        inside = crack.points[body.contains(crack.points)]
        assert inside[:, 0].max() < start + step * da + 1e-6
    assert max(counts) > 1
    assert len(crack.fronts) == 1
    cut = sum(np.pi * (h[-1] ** 2 - (0.03**2 if len(h) == 4 else 0)) for h in holes)
    gained = 2 * HALF * steps * da - cut
    assert area[-1] - area[0] == pytest.approx(gained, rel=0.02)
    assert np.diff(area).max() < 2 * HALF * da * 1.02


@pytest.mark.parametrize(
    ("hole", "section"),
    [
        # Smaller than a cell; two at an angle to the crack, whose section is an ellipse; a bore
        # along the crack from x = -0.4 on, which the front is to follow on both sides.
        pytest.param(
            (-0.4, 0.1, -0.5, 0, 0, 1, 0.03), np.pi * 0.03**2, id="small", marks=pytest.mark.slow
        ),
        pytest.param((-0.9, 0, -0.5, 1, 0, 1, 0.12), np.sqrt(2) * np.pi * 0.12**2, id="tilted"),
        pytest.param(
            (-0.4, -0.5, -0.5, 0, 1, 1, 0.12),
            np.sqrt(2) * np.pi * 0.12**2,
            id="across",
            marks=pytest.mark.slow,
        ),
        pytest.param((-0.4, 0, 0, 2, 0, 0, 0.12), 2 * 0.119 * 0.8, id="bore"),
    ],
)
def test_small_holes_and_holes_at_an_angle(tmp_path, hole, section):
    """The front is nowhere ahead of its way, and the area is that of the way without the hole."""
    mesh = block(tmp_path / "hole.msh", hole, facets=8)
    body, start, da, steps = Body.of(mesh), -0.7, 0.1, 11
    crack = place_crack(through_crack(start), mesh)
    before = area_inside(crack, mesh)
    for step in range(1, steps + 1):
        crack = grown(crack, mesh, da)
        inside = crack.points[body.contains(crack.points)]
        assert inside[:, 0].max() < start + step * da + 1e-6
    assert len(crack.fronts) == (2 if hole[0] + hole[3] > 0.8 else 1)
    gained = 2 * HALF * steps * da - section
    assert area_inside(crack, mesh) - before == pytest.approx(gained, rel=0.01)


@pytest.mark.parametrize("ligament", [0.015, *slow(0.004, 0.035, 0.1)])
def test_a_front_passes_under_the_bottom_of_a_hole(tmp_path, ligament):
    """Of .04 to 1 cells above it: one front, all of the area, and K has a value there.

    Below half a cell the orders are 20 % apart, 6 to 17 % of the largest K off (cells of .03), and
    a warning says so; at a cell they are within 4 %, and nothing is said.
    """
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, 0.011 + ligament, 0, 0, 1, 0.14), facets=8)
    crack = place_crack(through_crack(-0.7), mesh)
    before = area_inside(crack, mesh)
    for step in range(1, 8):
        crack = grown(crack, mesh, 0.1)
        assert len(crack.fronts) == 1
        gained = area_inside(crack, mesh) - before
        assert gained == pytest.approx(2 * HALF * 0.1 * step, rel=0.01)
        if step == 3:
            under = crack
    ends = [xc.displacement("top", (0.0, 0.0, 1e-3)), xc.displacement("bottom", (0.0, 0.0, 0.0))]
    problem = xc.Problem(mesh, xc.Isotropic(210e3, 0.3), [under], supports=ends, order=1)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        sif = xc.stress_intensity(xc.solve(problem))
    steep = [each for each in issued if "changes from cell to cell" in str(each.message)]
    assert len(steep) == (ligament < 0.05)
    # Under the hole little is pulled, which is more just beside it.
    below, beside = (np.abs(sif.x[:, 1]) < 0.1), (np.abs(sif.x[:, 1]) > 0.34)
    far = sif.K_I[np.abs(sif.x[:, 1]) > 0.5].mean()
    assert 0 < sif.K_I[below].min()
    assert 0.2 * far < sif.K_I[below].mean() < 0.85 * far
    assert sif.K_I[beside] == pytest.approx(far, rel=0.25)


@pytest.mark.slow
def test_points_that_stay_in_the_middle_of_a_side_keep_their_order(tmp_path):
    """A skew blind hole whose wall and bottom the front meets at once: refused in words."""
    hole = (-0.35809569, -0.035, -0.07393365, -0.92658734, -1.13745398, 0.31246489, 0.16069562)
    mesh = block(tmp_path / "hole.msh", hole, facets=8)
    crack = grown(place_crack(through_crack(-0.85), mesh), mesh, 0.1)

    def to_the_other_side():
        again = crack
        for _ in range(10):
            again = grown(again, mesh, 0.1)

    with pytest.raises(xc.GeometryError, match=r"ligament between them|folds"):
        to_the_other_side()


def test_a_front_that_has_just_come_round_a_hole_is_whole(tmp_path):
    """A chord of it cuts off 0.01 of the wall, as facets do: nothing leaves the body there."""
    mesh = block(tmp_path / "hole.msh", (-0.45, 0.3, -0.5, 1.0, 0.1), facets=8)
    round_it = [(-0.466, 0.113), (-0.341, 0.231), (-0.392, 0.376), (-0.445, 0.425), (-0.549, 0.475)]
    below = [(-0.52, y) for y in np.linspace(-1.0, 0.05, 14)]
    above = [(-0.555, y) for y in np.linspace(0.56, 1.0, 6)]
    line = np.array([*below, *round_it, *above])
    outline = np.array([(-3.0, -1.0), *line, (-3.0, 1.0)])
    plane = xc.plane_crack(np.column_stack([outline, np.full(len(outline), 0.011)]))
    front = np.arange(len(line), 0, -1)
    placed = place_crack(Crack(plane.points, plane.faces, None, (front,)), mesh)
    assert len(placed.fronts) == 1
    fresh = placed.points[len(plane.points) :]
    assert not Body.of(mesh).contains(fresh).any()


def test_no_face_is_a_line_where_one_end_of_a_front_stays(tmp_path):
    """The end outside at y < -0.7 has no advance, while the front comes to a hole."""
    mesh = block(tmp_path / "hole.msh", (-0.4, 0.3, -0.5, 1.0, 0.1), facets=8)
    crack = place_crack(through_crack(-0.55), mesh)
    body = Body.of(mesh)
    for _ in range(3):
        at = stations_of([crack], mesh)
        size = 0.5 * float(cell_sizes(mesh, at.x).mean())
        da = np.where(at.x[:, 1] > -0.5, 0.1, 0.0)
        crack = advance_fronts(crack, at.s, at.front, np.zeros(len(at.s)), da, size, body)
        assert face_areas(crack.points, crack.faces).min() > 1e-6
        crack = place_crack(crack, mesh)


@pytest.mark.parametrize("start", [-0.4, -0.35])
def test_a_front_drawn_across_a_hole_goes_on_behind_it(tmp_path, start):
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 1.0, 0.25))
    crack = place_crack(through_crack(start), mesh)
    assert len(crack.fronts) == 2
    body, before = Body.of(mesh), area_inside(crack, mesh)
    for step in range(1, 6):
        crack = grown(crack, mesh, 0.1)
        inside = crack.points[body.contains(crack.points)]
        assert inside[:, 0].max() < start + 0.1 * step + 0.1 * H
    assert len(crack.fronts) == 1
    x = np.linspace(start, -0.15, 1001)
    chord = 2 * np.trapezoid(np.sqrt(np.maximum(0.25**2 - (x + 0.4) ** 2, 0.0)), x)
    assert area_inside(crack, mesh) - before == pytest.approx(2 * HALF * 0.5 - chord, rel=0.03)


def test_a_front_that_touches_a_hole_from_both_sides(tmp_path):
    """Just before and just behind it; discretisation is what facets cut off."""
    mesh = block(tmp_path / "hole.msh", (-0.4, 0.1, -0.5, 1.0, 0.2))
    crack = place_crack(through_crack(-0.7), mesh)
    for _ in range(6):
        crack = grown(crack, mesh, 0.1)
    assert len(crack.fronts) == 1
    exact = 2 * HALF * 0.9 - np.pi * 0.2**2
    assert area_inside(crack, mesh) == pytest.approx(exact, rel=0.01)


def test_ligaments_that_cells_do_not_resolve_are_named(tmp_path):
    """What is left beside the hole is two cells wide; half a one at each side does not count."""
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 1.0, 0.25), h=0.2)
    crack = place_crack(through_crack(-0.75), mesh)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always", xc.XcrackWarning)
        while crack.fronts:
            crack = grown(crack, mesh, 0.15)
    assert any("as if it had left the body. Take at" in str(each.message) for each in issued)


@pytest.mark.slow
def test_a_run_passes_a_hole_and_goes_on_where_it_was_stopped(tmp_path):
    """Both arms have the same K: the body is symmetric, its cells (1.9 a radius) are not.

    They are 2.3 % apart in the step that touches the hole, .8 and .5 % after it.
    """
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 1.0, 0.25), h=0.13)
    ends = [xc.displacement("top", (0.0, 0.0, 1e-3)), xc.displacement("bottom", (0.0, 0.0, 0.0))]
    steel, crack = xc.Isotropic(E=210e3, nu=0.3), through_crack(-0.85)
    problem = xc.Problem(mesh, steel, [crack], supports=ends)
    given = {
        "problem": problem, "law": xc.paris(C=1e-12, m=3.0), "criterion": xc.max_hoop_stress,
        "cycle": xc.Cycle(0.0, 1.0), "da": 0.15, "max_steps": 9, "progress": False,
    }  # fmt: skip
    with pytest.warns(xc.XcrackWarning):
        run = xc.collect(xc.grow(**given), tmp_path / "whole", keep_solutions=False)
    apart, counts = [], []
    for step in run.steps:
        sif = step.sif[-1][0]
        counts.append(len(step.corrected[0].fronts))
        if counts[-1] == 2:
            one, other = (sif.K[sif.front == k, 0].mean() for k in range(2))
            apart.append(abs(one - other) / (one + other) * 2)
    assert 2 in counts
    assert counts[-1] == 1
    assert np.median(apart) < 0.02
    assert max(apart) < 0.04
    joined = len(counts) - counts[::-1].index(2)
    (join,) = run.joins
    assert (join.step, join.cracks, join.N) == (joined, (0, 0), run.steps[joined].cycles)
    assert join.point == pytest.approx((-0.4 + 0.25, 0.0, 0.0), abs=0.2)
    split = counts.index(2)
    # Killed after each step, and resumed for one more: byte for byte the same files.
    part = tmp_path / "part"
    shutil.copytree(tmp_path / "whole", part)
    for path in sorted(part.glob("step_*.npz"))[1:]:
        path.unlink()
    for stop in range(2, given["max_steps"] + 1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            xc.resume(part, **given | {"max_steps": stop}, keep_solutions=False)
    whole = sorted((tmp_path / "whole").glob("step_*.npz"))
    assert len(whole) > split + 2
    for path in whole:
        assert path.read_bytes() == (part / path.name).read_bytes()


@pytest.mark.parametrize("x", [-0.4, *slow(-0.45)])
def test_both_arms_of_a_straight_front_across_a_hole_are_alike(tmp_path, x):
    """Each is seen by the cells at it alone, and K is a mirror's: arms differ by the mesh.

    The level set of one arm jumps behind the hole, where the strips ahead of both meet: that jump
    was taken for its front, functions of one arm stood at the other, and half of that was not cut.
    """
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 1.0, 0.13), h=0.08)
    ends = [xc.displacement("top", (0.0, 0.0, 1e-3)), xc.displacement("bottom", (0.0, 0.0, 0.0))]
    problem = xc.Problem(mesh, xc.Isotropic(E=210e3, nu=0.3), [through_crack(x)], supports=ends)
    solution = xc.solve(problem)
    mesh = solution.space.mesh
    levels = solution.space.cuts[0].level_set
    for tip, cells in zip(solution.space.tips, levels.tip_cells, strict=True):
        away = np.abs(mesh.points[mesh.cells[cells]][..., 0] - x).min(axis=1)
        assert (away <= mesh.cell_size[cells]).all()
        side = np.sign(np.mean(tip.x, axis=0)[1])
        assert (side * mesh.points[mesh.cells[cells]][..., 1]).max(axis=1).min() > 0
    sif = xc.stress_intensity(solution)
    grid, K = np.linspace(0.14, 0.6, 100), []
    for k in range(2):
        y, values = np.abs(sif.x[sif.front == k, 1]), sif.K_I[sif.front == k]
        K.append(np.interp(grid, np.sort(y), values[np.argsort(y)]))
    one, other = K
    assert one.mean() == pytest.approx(other.mean(), rel=0.01)
    assert np.sqrt(((one - other) ** 2).mean()) < 0.03 * one.mean()


def cells_met(mesh: Mesh, x: float, z: float):
    """Cells that a line along y runs through."""
    y = np.linspace(-HALF, HALF, 4001)
    at = np.column_stack([np.full(len(y), x), y, np.full(len(y), z)])
    return np.setdiff1d(np.unique(locate(mesh, at)[0]), [-1])


@pytest.mark.parametrize(
    ("radius", "x"),
    # Behind the middle of the hole, before its wall; before the middle, behind its wall.
    [(0.13, -0.342), *slow((0.2, -0.5645), (0.1, -0.343), (0.13, -0.484), (0.2, -0.2336))],
)
def test_what_is_drawn_of_a_front_in_a_hole_does_not_matter(tmp_path, radius, x):
    """Front cells are those of the line, and energy and K those of other vertices in the hole.

    By the distance to its last vertex a front began anew where strips of both arms meet: up to 11
    cells behind the hole had its functions, energy differed by .25 %, K from a cell on by 3 %.
    """
    half = np.sqrt(radius**2 - (x + 0.4) ** 2)
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 1.0, radius), h=0.08, facets=8)
    ends = [xc.displacement("top", (0.0, 0.0, 1e-3)), xc.displacement("bottom", (0.0, 0.0, 0.0))]
    steel, energy, K = xc.Isotropic(E=210e3, nu=0.3), [], []
    for in_hole in ([], [(x, 0.35 * half)], [(x, -0.6 * half), (x, 0.5 * half)]):
        outline = np.array([(-3.0, -3.0), (x, -3.0), *in_hole, (x, 3.0), (-3.0, 3.0)])
        crack = xc.plane_crack(np.column_stack([outline, np.full(len(outline), 0.011)]))
        solution = xc.solve(xc.Problem(mesh, steel, [crack], supports=ends, order=1))
        of_fronts = np.unique(np.concatenate(solution.space.cuts[0].level_set.tip_cells))
        assert np.isin(cells_met(solution.space.mesh, x, 0.011), of_fronts).all()
        corners = solution.space.mesh.points[solution.space.mesh.cells[of_fronts]]
        for i, level in ((0, x), (2, 0.011)):
            assert (corners[..., i].min(axis=1) <= level + 1e-9).all()
            assert (corners[..., i].max(axis=1) >= level - 1e-9).all()
        energy.append(solution.energy)
        sif = xc.stress_intensity(solution)
        order = np.argsort(sif.x[:, 1])
        away = np.linspace(half + 0.08, 0.6, 50)  # a cell beside the hole and farther
        K += [np.interp(y, sif.x[order, 1], sif.K_I[order]).mean() for y in (-away, away)]
    assert np.ptp(energy) < 1.5e-4 * np.mean(energy)
    assert np.ptp(K) < 0.015 * np.mean(K)


def test_K_beside_a_hole_smaller_than_a_cell_is_that_of_a_strip(tmp_path):
    """A straight front across a hole of half a cell: domains of both parts end at its middle.

    K is that of a long strip pulled apart (Rice, 1967), K² = E' G with the energy of the strip far
    ahead, between plane stress (free sides) and plane strain, to the 1 % that cells leave. Beside
    the hole it is 8 % higher (cells of half the size, order 2), alike on both sides; it was 1 and
    11 % while points past the end of a front took their distance to that for one along the crack.
    """
    E, nu, pull, height = 210e3, 0.3, 1e-3, 0.6
    mesh = block(tmp_path / "hole.msh", (-0.4, 0, -0.5, 0, 0, 1, 0.05), h=0.12, facets=8)
    ends = [xc.displacement("top", (0.0, 0.0, pull)), xc.displacement("bottom", (0.0, 0.0, 0.0))]
    problem = xc.Problem(
        mesh, xc.Isotropic(E=E, nu=nu), [through_crack(-0.4)], supports=ends, order=1
    )
    with pytest.warns(xc.XcrackWarning, match="clipped"):
        sif = xc.stress_intensity(xc.solve(problem))
    assert sif.front.max() == 1
    inner = sif.K_I[np.abs(sif.x[:, 1]) < 0.5]
    stress = E * np.sqrt(pull**2 / (2 * height) / (1 - nu**2))
    strain = E * np.sqrt((1 - nu) / (1 + nu) / (1 - 2 * nu) * pull**2 / (2 * height) / (1 - nu**2))
    assert stress < inner.mean() < 1.01 * strain
    assert inner == pytest.approx(inner.mean(), rel=0.08)
    at_hole = inner[np.argsort(np.abs(sif.x[np.abs(sif.x[:, 1]) < 0.5, 1]))[:2]]
    assert at_hole == pytest.approx(np.full(2, at_hole.mean()), rel=0.01)


def test_a_penny_opens_around_a_hole_and_leaves_the_block(tmp_path):
    """A closed front round a hole advances in the body alone; steps are those of circles."""
    mesh = block(tmp_path / "hole.msh", (-0.1, 0, -0.5, 1.0, 0.12))
    crack = place_crack(xc.penny_crack((-0.1, 0, 0.011), (0, 0, 1), 0.3), mesh)
    for step in range(4):
        exact = np.pi * ((0.3 + 0.1 * step) ** 2 - 0.12**2)
        assert area_inside(crack, mesh) == pytest.approx(exact, rel=0.02)
        assert len(crack.fronts) == 1
        crack = grown(crack, mesh, 0.1)


# --- fillets of shafts, roots of grooves and threads ----------------------------------------------
#
# A penny that begins at the surface of a round section and advances evenly covers what it has in
# common with that section: the lens of two circles, exactly. K is compared with a finer mesh.


HALF_LENGTH = 1.5  # of the length
CRACK_DEPTH = 0.15  # of the crack
# Corners (r, z, radius of the fillet) of the half section; radius of the section that is cracked,
# and its height.
FILLET = [(0.5, -HALF_LENGTH, 0), (0.5, 0, 0.1), (0.8, 0, 0), (0.8, HALF_LENGTH, 0)]
GROOVE = [
    (0.5, -HALF_LENGTH, 0),
    (0.5, -0.1, 0),
    (0.4, 0, 0.08),
    (0.5, 0.1, 0),
    (0.5, HALF_LENGTH, 0),
]
THREAD = [
    (0.5, -HALF_LENGTH, 0),
    *(
        corner
        for k in (-1, 0, 1)
        for corner in ((0.5, 0.22 * k - 0.08, 0), (0.4, 0.22 * k, 0.06), (0.5, 0.22 * k + 0.08, 0))
    ),
    (0.5, HALF_LENGTH, 0),
]
BODIES = {
    "fillet": (FILLET, 0.6 - np.sqrt(0.1**2 - 0.02**2), -0.08),
    "groove": (GROOVE, 0.4 + 0.08 * (np.sqrt(2) - 1), 0.0),
    "thread": (THREAD, 0.4 + 0.06 * (1 / np.sin(np.arctan2(0.08, 0.1)) - 1), 0.0),
}


def rounded(occ, corners):
    """Curves of a half section from the axis to the axis, with fillets."""
    x = np.array([(c[0], 0, c[1]) for c in corners], dtype=float)
    x = np.concatenate([[(0, 0, -HALF_LENGTH)], x, [(0, 0, HALF_LENGTH)]])
    radius = [0, *(c[2] for c in corners), 0]
    first = last = occ.addPoint(*x[0])
    curves = []
    for k in range(1, len(x)):
        if not radius[k]:
            begin = end = occ.addPoint(*x[k])
            arc = []
        else:
            to = [(x[j] - x[k]) / np.linalg.norm(x[j] - x[k]) for j in (k - 1, k + 1)]
            half = np.arccos(to[0] @ to[1]) / 2
            tangent = radius[k] / np.tan(half)
            middle = (to[0] + to[1]) / np.linalg.norm(to[0] + to[1]) * radius[k] / np.sin(half)
            begin, centre, end = (
                occ.addPoint(*(x[k] + d)) for d in (tangent * to[0], middle, tangent * to[1])
            )
            arc = [occ.addCircleArc(begin, centre, end)]
        curves += [occ.addLine(last, begin), *arc]
        last = end
    return [*curves, occ.addLine(last, first)]


def turned_body(path, corners, at, h):
    """A body of revolution about z, its cells small around a place."""
    off = {"Mesh__MeshSizeFromPoints": 0, "Mesh__MeshSizeExtendFromBoundary": 0}
    with session(**off) as gmsh:
        occ = gmsh.model.occ
        face = occ.addPlaneSurface([occ.addCurveLoop(rounded(occ, corners))])
        solid = occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, 2 * np.pi)
        place = occ.addPoint(*at)
        occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [tag for dim, tag in solid if dim == 3], name="body")
        for name, z in (("bottom", -HALF_LENGTH), ("top", HALF_LENGTH)):
            around = (-2, -2, z - 1e-3, 2, 2, z + 1e-3)
            faces = gmsh.model.getEntitiesInBoundingBox(*around, dim=2)
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in faces], name=name)
        field = gmsh.model.mesh.field
        distance, size = field.add("Distance"), field.add("MathEval")
        field.setNumbers(distance, "PointsList", [place])
        field.setString(
            size, "F", f"Min(0.35, {h} + 0.5 * Max(F{distance} - {2 * CRACK_DEPTH}, 0))"
        )
        field.setAsBackgroundMesh(size)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    return xc.read_mesh(path)


def scene_at_notch(tmp_path, name, h):
    """Body, crack, radius of the section."""
    corners, radius, z = BODIES[name]
    at = (radius, 0.0, z)
    return turned_body(tmp_path / f"{h}.msh", corners, at, h), at, radius


def lens(radius, reach):
    """Area that a circle has in common with another whose middle is on it."""
    one, two = np.arccos(reach / (2 * radius)), np.arccos(1 - reach**2 / (2 * radius**2))
    segment = reach**2 * (one - np.sin(one) * np.cos(one))
    return segment + radius**2 * (two - np.sin(two) * np.cos(two))


@pytest.mark.parametrize("name", [*slow("groove", "thread"), "fillet"])
def test_an_even_front_covers_the_lens_of_two_circles(tmp_path, name):
    """No face that growth did not make, ends at the surface; the rest are facets of the wall."""
    h, da = 0.06, 0.06
    mesh, at, radius = scene_at_notch(tmp_path, name, h)
    body = Body.of(mesh)
    crack = place_crack(xc.penny_crack(at, (0, 0, 1), CRACK_DEPTH), mesh)
    for step in range(6):
        reach = CRACK_DEPTH + step * da
        inside = crack.points[body.contains(crack.points)]
        # Where an end turns to the facets of the wall, points beside it lead: .072 of a step.
        assert np.linalg.norm(inside - at, axis=1).max() < reach + 0.1 * da
        assert len(crack.fronts) == 1
        assert area_inside(crack, mesh) == pytest.approx(lens(radius, reach), rel=0.03)
        ends = np.array([x for _, x in front_ends(crack, body)])
        assert len(ends) == 2
        assert np.linalg.norm(ends - at, axis=1) == pytest.approx(reach, abs=0.3 * h)
        st = stations_of([crack], mesh)
        size = 0.5 * float(cell_sizes(mesh, st.x).mean())
        even = np.ones(len(st.s))
        crack = advance_fronts(crack, st.s, st.front, 0 * even, da * even, size, body)
        crack = place_crack(crack, mesh)


def pulled(mesh, crack, order):
    pull, steel = xc.traction("top", (0, 0, 100.0)), xc.Isotropic(E=210e3, nu=0.3)
    return xc.Problem(mesh, steel, [crack], [xc.fix("bottom")], [pull], order=order)


def along(sif, at):
    """Angle about the middle of the crack and K_I of a front, from one end to the other."""
    angle = np.arctan2(sif.x[:, 1], at[0] - sif.x[:, 0])
    order = np.argsort(angle)
    return angle[order], sif.K_I[order], sif.at_surface[order]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fillet", "groove", "thread"])
def test_K_at_a_notch_is_that_of_a_finer_mesh(tmp_path, name):
    """Rms of K_I within 2 % of cells that are 1.7 times smaller, the ends within 6 %.

    Discretisation; most of it are facets of the notch, which files of gmsh do not tell to be round:
    those of the fillet make the crack 2 % larger.
    """
    crack = xc.penny_crack((BODIES[name][1], 0.0, BODIES[name][2]), (0, 0, 1), CRACK_DEPTH)
    front = []
    for h in (0.04, 0.024):
        mesh, at, _ = scene_at_notch(tmp_path, name, h)
        solution = xc.solve(pulled(mesh, crack, 2))
        front.append(along(xc.stress_intensity(solution), at))
    (angle, K, free), (finer, wanted, _) = front
    off = K / np.interp(angle, finer, wanted) - 1
    rms = float(np.sqrt((off[~free] ** 2).mean()))
    inner = np.abs(angle) < np.radians(60)
    print(f"\n{name}: {solution.n_dof} unknowns, rms {rms:.2%}, within 60 degrees "
          f"{np.abs(off[inner]).max():.2%}, ends {off[0]:.2%} {off[-1]:.2%}")  # fmt: skip
    assert rms < 0.02
    assert np.abs(off).max() < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fillet", "thread"])
def test_a_crack_grows_from_a_notch(tmp_path, name):
    """Four steps: one front with two ends, the faces of each step within its advance."""
    mesh, at, radius = scene_at_notch(tmp_path, name, 0.06)
    crack = xc.penny_crack(at, (0, 0, 1), CRACK_DEPTH)
    steps = list(
        xc.grow(
            pulled(mesh, crack, 1), xc.paris(C=1e-12, m=3.0), xc.max_hoop_stress,
            xc.Cycle(0.0, 1.0), da=0.06, max_steps=4, progress=False,
        )
    )  # fmt: skip
    body = Body.of(mesh)
    area = [area_inside(step.corrected[0], mesh) for step in steps]
    print(f"\n{name}: areas {np.round(area, 4)}, N {[round(step.cycles) for step in steps]}")
    for k, step in enumerate(steps):
        grown = step.corrected[0]
        assert len(grown.fronts) == 1
        assert len(front_ends(grown, body)) == 2
        sif = step.sif[-1][0]
        assert sif.K_I[~sif.at_surface].min() > 0
        inside = grown.points[body.contains(grown.points)]
        assert np.linalg.norm(inside - at, axis=1).max() < CRACK_DEPTH + 0.066 * k + 1e-3
    assert (np.diff(area) > 0).all()
    assert area[-1] < lens(radius, CRACK_DEPTH + 3 * 0.066)


# --- beside a shoulder: a way out of one wall comes near another one ------------------------------


def shoulder():
    """A square column of side 2 on a square base of side 4, whose top is z = 0."""
    block = xc.box((-2, -2, -2), (2, 2, 2), 16)
    middle = block.points[block.cells].mean(axis=1)
    keep = (middle[:, 2] < 0) | (np.abs(middle[:, :2]).max(axis=1) < 1)
    used, cells = np.unique(block.cells[keep], return_inverse=True)
    return xc.Mesh(block.points[used], cells.reshape(-1, 4))


@pytest.mark.parametrize("slope", [0.35, 0.4, 0.45])
def test_a_front_at_a_shoulder_ends_between_its_walls(slope):
    """It went on over the base until it was two cells outside: below its top, beyond its edge.

    In growth such an end came into the base, and was front there.
    """
    crack = xc.penny_crack((0.02, -1, 0.5), (0, -slope, 1), 0.55)
    problem = xc.Problem(shoulder(), xc.Isotropic(E=1.0, nu=0.3), [crack])
    (placed,) = problem.placed
    front = placed.points[placed.fronts[0]]
    beside = front[np.abs(front[:, 1]) > 1]
    column = np.maximum(np.abs(beside[:, :2]) - 1, 0)
    from_column, from_base = np.hypot(*column.T), beside[:, 2]
    assert from_base.min() > 0.1
    assert from_column[[0, -1]].min() > 0.4  # two cells of .25 along the way
