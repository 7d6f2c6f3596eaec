"""Pictures of 3D bodies and of curved sides: what is drawn, as arrays; files are not empty."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import xcrack as xc
from xcrack import History, Step, draw_fronts, draw_K
from xcrack.crack.fronts import front_weights, is_closed
from xcrack.output.curved_sides import CurvedSides, boundary_lines, shading_normals
from xcrack.view import pyvista as plot_pyvista
from xcrack.view.fronts_3d import step_fronts
from xcrack.view.plot import crack_box
from xcrack.view.projection import best_plane, given_plane, on_plane, section_outline
from xcrack.view.scene_2d import SPACE_FIELDS, scene
from xcrack.view.scene_3d import (
    LIP_FIELDS,
    clip_plane,
    crack_scene,
    load_arrows,
    mesh_scene,
    space_scene,
)
from xcrack.view.section_3d import areas

TIP = 0.083


def bent(x):
    """Tension on one side, pressure on the other."""
    return np.stack([0 * x[:, 0], 0 * x[:, 0], x[:, 1]], axis=1)


@pytest.fixture(scope="module")
def solution():
    """An edge crack, straight through along y, half of it pressed together."""
    z = 0.031
    crack = xc.plane_crack([(-1.3, -1.4, z), (TIP, -1.4, z), (TIP, 1.4, z), (-1.3, 1.4, z)])
    problem = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 6),
        xc.Isotropic(E=1.0, nu=0.3),
        [crack],
        loads=[xc.traction("top", bent), xc.traction("bottom", lambda x: -bent(x))],
        contact="on",
        order=1,
    )
    return xc.solve(problem)


def area(corners):
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.linalg.norm(turned, axis=1).sum() / 2


def length(segments):
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()


# --- what is drawn ------------------------------------------------------------------------------


def test_surface_and_lips_at_rest(solution):
    """Six sides of area 4 and both crack faces; edges of a cube, round-off."""
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    lips = 2 * 2 * (1 + TIP)
    assert area(picture.triangles) == pytest.approx(24 + lips, rel=1e-10)
    assert length(picture.outline) == pytest.approx(24, rel=1e-10)
    assert np.isfinite(picture.values).all()
    # The mouth on three sides, on each lip.
    assert length(picture.rims) == pytest.approx(2 * (2 + 2 * (1 + TIP)), rel=1e-10)


def test_cells_with_several_facets_on_the_boundary_show_them_all():
    """Five tetrahedra of a cube: four of them have three facets on its sides."""
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    cells = np.array([(0, 1, 2, 4), (3, 1, 2, 7), (5, 1, 4, 7), (6, 2, 4, 7), (1, 2, 4, 7)])
    mesh = xc.Mesh(corners, cells)
    pull = [xc.traction("boundary", lambda x, n: n)]
    solution = xc.solve(xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3), loads=pull))
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    assert area(picture.triangles) == pytest.approx(6.0, rel=1e-12)
    assert length(picture.outline) == pytest.approx(12.0, rel=1e-12)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (1.0, 0.3, -0.2), (0.0, 0.0, 1.0)])
def test_a_plane_cuts_the_body_open(solution, normal):
    """What is left lies behind; its section and shell close the volume (divergence theorem)."""
    plane = clip_plane(((0.11, -0.07, 0.23), normal))
    picture = space_scene(solution, "szz", 0.0, None, plane, None)
    x = picture.triangles
    depth = (x - plane[0]) @ plane[1]
    assert depth.max() < 1e-12
    assert picture.outline.reshape(-1, 3).shape[0] > 0
    assert ((picture.outline - plane[0]) @ plane[1]).max() < 1e-12
    turned = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
    middle = x.mean(axis=1)
    on_shell = np.abs(np.abs(x).min(axis=1) - 1).min(axis=1) < 1e-9
    in_plane = np.abs(depth).max(axis=1) < 1e-9
    out = np.where(on_shell[:, None], np.where(np.abs(middle) > 1 - 1e-9, middle, 0), plane[1])
    retained = on_shell | in_plane
    turned *= np.sign(np.einsum("td,td->t", turned, out))[:, None]
    enclosed = np.einsum("td,td->", middle[retained], turned[retained]) / 3
    rng = np.random.default_rng(51277)
    sample = rng.uniform(-1, 1, (200_000, 3))
    expected = 8 * np.mean((sample - plane[0]) @ plane[1] < 0)
    # Statistics: 200 000 points, three standard deviations.
    assert enclosed == pytest.approx(expected, abs=3 * 8 * 0.5 / np.sqrt(200_000))


def test_the_section_shows_both_lips(solution):
    """Across the crack: the section has the area of the square, and the crack faces meet it
    twice."""
    plane = clip_plane(((0, 0.04, 0), (0, 1, 0)))
    picture = space_scene(solution, "uz", 0.0, None, plane, None)
    at = np.abs(picture.triangles[..., 1] - 0.04).max(axis=1) < 1e-12
    assert area(picture.triangles[at]) == pytest.approx(4, rel=1e-10)
    rims = np.abs(picture.rims[..., 1] - 0.04).max(axis=1) < 1e-12
    assert length(picture.rims[rims]) == pytest.approx(2 * (1 + TIP), rel=1e-10)
    assert length(picture.fronts) == pytest.approx(1.04, rel=1e-10)


def test_the_crack_opens_with_the_warp(solution):
    warp = 0.05
    rest, moved = (space_scene(solution, "uz", w, None, None, None) for w in (0.0, warp))
    shift = np.abs(moved.triangles - rest.triangles)[..., 2]
    np.testing.assert_allclose(shift, warp * np.abs(rest.values), atol=1e-12)
    assert len(rest.faint_lines) == 0
    assert length(moved.faint_lines) == pytest.approx(24, rel=1e-10)


@pytest.mark.parametrize("field", SPACE_FIELDS)
def test_values_are_those_of_the_solution(solution, field):
    """Displacements, and stresses as means over the plain cells at a point; round-off."""
    picture = space_scene(solution, field, 0.0, None, None, None)
    mesh, space = solution.problem.mesh, solution.space
    plain = np.ones(mesh.n_points, dtype=bool)
    plain[mesh.cells[space.signature > 0]] = False
    distance, point = cKDTree(mesh.points).query(picture.triangles.reshape(-1, 3))
    shown = (distance < 1e-9) & plain[point]
    assert shown.sum() > 20
    values, point = picture.values.ravel()[shown], point[shown]
    u = solution.displacement(mesh.points[point])
    weight = np.zeros((mesh.n_points, len(mesh.cells)))
    weight[mesh.cells.T, np.arange(len(mesh.cells))] = mesh.volume
    weight /= weight.sum(axis=1, keepdims=True)
    of_cell = solution.stress(mesh.points[mesh.cells].mean(axis=1))
    s = np.einsum("pc,cij->pij", weight[point], of_cell)
    deviator = s - np.trace(s, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    if field == "von_mises":
        expected = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
    elif field == "displacement":
        expected = np.linalg.norm(u, axis=1)
    elif field[0] == "u":
        expected = u[:, "xyz".index(field[1])]
    elif field == "material":
        expected = np.zeros(len(point))  # the one that it has
    else:
        expected = s[:, "xyz".index(field[1]), "xyz".index(field[2])]
    np.testing.assert_allclose(values, expected, atol=1e-9 * np.abs(expected).max())


def test_closed_lips_look_unlike_open_ones(solution):
    """Bending about x: open where y > 0, and beyond by a cell."""
    pressed = crack_scene(solution, "pressure", [0], 0.0, None, None, None)
    total = 2 * (1 + TIP)
    assert area(pressed.triangles) + area(pressed.open_faces) == pytest.approx(total, rel=1e-10)
    assert pressed.triangles.mean(axis=1)[:, 1].max() < 0.34
    # Linear pressures: their integral over the triangles is the force between the crack faces.
    contact = solution.contact[0]
    force = contact.pressure @ contact.measure
    x = pressed.triangles
    size = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    assert size @ pressed.values.mean(axis=1) == pytest.approx(force, rel=1e-6)
    opened = crack_scene(solution, "opening", [0], 0.0, None, None, None)
    closed = contact.measure[contact.closed].sum()
    # Half of a triangle or more counts: as wide as a triangle.
    assert area(opened.closed_faces) == pytest.approx(closed, rel=0.3)
    assert area(opened.closed_faces) + area(opened.triangles) == pytest.approx(total, rel=1e-10)
    assert opened.limits[0] == 0
    slid = crack_scene(solution, "sliding", [0], 0.0, None, None, None)
    assert area(slid.triangles) == pytest.approx(total, rel=1e-10)
    assert length(slid.fronts) == pytest.approx(2, rel=1e-10)
    assert area(slid.skin) == pytest.approx(24, rel=1e-12)
    # Seen from a side on which the crack shows its face.
    assert abs(slid.view_direction[2]) > 0.5


def test_mesh_and_enriched_points(solution):
    picture = mesh_scene(solution, None, None)
    space = solution.space
    assert len(picture.heaviside) == (space.heaviside[0] >= 0).sum()
    assert len(picture.tip) == (space.tips[0].point_to_function >= 0).sum()
    assert area(picture.closed_faces) == pytest.approx(2 * (1 + TIP), rel=1e-10)


def test_arrows_of_loads():
    """A large set has many tractions, a small one its resultant; pressure ends on the body."""
    mesh = xc.box((0, 0, 0), (4, 1, 1), (8, 2, 2))
    patch = (mesh.points[mesh.facet_sets["top"]][..., 0] <= 0.5).all(axis=1)
    mesh = xc.Mesh(
        mesh.points, mesh.cells, mesh.facet_sets | {"patch": mesh.facet_sets["top"][patch]}
    )
    small = xc.Problem(
        mesh, xc.Isotropic(E=1.0, nu=0.3),
        supports=[xc.fix("left")],
        loads=[xc.traction("patch", (0, 0, -2.0)), xc.pressure("right", 3.0)],
    )  # fmt: skip
    start, vector = load_arrows(xc.solve(small))
    down = np.abs(vector[:, 2]) > 0
    assert down.sum() == 1
    np.testing.assert_allclose((start + vector)[down], [[0.25, 0.5, 1.0]], atol=1e-12)
    assert (vector[~down, 0] < 0).all()
    np.testing.assert_allclose((start + vector)[~down, 0], 4, atol=1e-12)


# --- fronts -------------------------------------------------------------------------------------


def ring(radius, n, modes=3, part=1.0):
    """K_I = 1 + cos, over the arc of a circle around the origin in z = 0.2."""
    angle = 2 * np.pi * part * np.arange(n) / (n if part == 1 else n - 1)
    ahead = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    normal = np.tile([0.0, 0, 1], (n, 1))
    frame = np.stack([ahead, normal, np.cross(ahead, normal)], axis=1)
    K = np.stack([1 + np.cos(angle), 0.1 * np.sin(angle), 0 * angle], axis=1)[:, :modes]
    surface = np.zeros(n, dtype=bool)
    if part < 1:
        surface[[0, -1]] = True
    x = radius * ahead + [0, 0, 0.2]
    return xc.SIF(
        x, frame, K, 0 * angle, 0 * K, radius * angle, np.zeros(n, int), surface, surface, 0 * angle
    )


def ring_step(index, n=24):
    sif = ring(0.2 + 0.1 * index, n)
    number = np.arange(n)
    faces = np.stack([number, np.roll(number, -1), np.full(n, n)], axis=1)
    crack = xc.Crack(np.concatenate([sif.x, [[0, 0, 0.2]]]), faces, fronts=(np.append(number, 0),))
    part = (0.01 * np.arange(n),)
    return Step(index, 100.0 * index, (crack,), ((sif,),), part, part, part, part, part)


@pytest.fixture
def history():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 3)
    return History(tuple(ring_step(k) for k in range(4)), "enough", None, mesh)


def test_fronts_over_the_section(history):
    figure = draw_fronts(history, show=False)
    axes = figure.axes[0]
    radii = [np.hypot(*line.get_data()) for line in axes.lines]
    assert len(radii) == 4
    for k, r in enumerate(radii):
        assert len(r) == 25  # closed
        np.testing.assert_allclose(r, 0.2 + 0.1 * k, rtol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x", "y")
    section = section_outline(history.mesh, best_plane(history.steps[0].cracks[0].points))
    assert length(section) == pytest.approx(8, rel=1e-12)
    assert len(draw_fronts(history, every=2, show=False).axes[0].lines) == 3


def test_fronts_in_a_given_plane(history):
    """Seen under 45 degrees a circle is an ellipse."""
    figure = draw_fronts(history, plane=((0, 0, 0.2), ((1, 0, 0), (0, 1, 1))), show=False)
    x, y = figure.axes[0].lines[-1].get_data()
    assert np.ptp(x) / 2 == pytest.approx(0.5, rel=1e-12)
    assert np.ptp(y) / 2 == pytest.approx(0.5 / np.sqrt(2), rel=1e-12)


def test_fronts_of_several_runs(history):
    axes = draw_fronts([history, history], labels=["with", "without"], show=False).axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["with", "without"]


def test_K_along_fronts():
    closed, opened = ring(0.5, 48), ring(0.5, 25, part=0.5)
    figure = draw_K([closed, opened], labels=["closed", "open"], show=False)
    assert [axes.get_ylabel() for axes in figure.axes] == ["$K_{I}$", "$K_{II}$", "$K_{III}$"]
    s, K = figure.axes[0].lines[0].get_data()
    assert (s[0], s[-1]) == (0, 1)
    # Chords against arcs: discretisation of the last step.
    np.testing.assert_allclose(K, 1 + np.cos(2 * np.pi * s), atol=1e-3)
    s, K = figure.axes[0].lines[2].get_data()
    np.testing.assert_allclose(K, 1 + np.cos(np.pi * s), atol=1e-12)
    assert len(figure.axes[0].lines[3].get_xdata()) == 2  # hollow at the surface
    # A mode that is nothing does not fill its panel.
    assert figure.axes[2].get_ylim()[1] > 0.1


def test_weights_of_points_along_a_front():
    sif = ring(0.5, 16)
    assert is_closed(sif.x)
    np.testing.assert_allclose(front_weights(sif.x), 1 / 16, rtol=1e-12)
    x = np.array([[0.0, 0, 0], [1, 0, 0], [4, 0, 0]])
    np.testing.assert_allclose(front_weights(x), [0.5 / 4, 2 / 4, 1.5 / 4], rtol=1e-14)
    assert not is_closed(x)


def test_fronts_without_K_are_those_of_the_crack():
    step = ring_step(0)
    places = ("x", "frame", "K", "T", "spread", "s", "front", "at_surface", "closed")
    every = {name: getattr(step.sif[0][0], name)[:0] for name in (*places, "domain_cells")}
    nothing = (np.zeros(0),)
    bare = Step(0, 0.0, step.cracks, ((replace(step.sif[0][0], **every),),), *[nothing] * 5)
    (line,) = step_fronts(bare, 0)
    np.testing.assert_array_equal(line.x, step_fronts(step, 0)[0].x)
    assert line.is_closed


def test_history_in_space(tmp_path, history):
    """Smallest, mean and largest value: K_I = 1 + cos around a circle."""
    table = history.table()
    assert len(table) == 4
    assert table["front"].tolist() == [0, 0, 0, 0]
    np.testing.assert_allclose(table["K_I_0_min"], 0, atol=1e-12)
    np.testing.assert_allclose(table["K_I_0_mean"], 1, rtol=1e-12)
    np.testing.assert_allclose(table["K_I_0_max"], 2, rtol=1e-12)
    np.testing.assert_allclose(table["z"], 0.2, rtol=1e-12)
    np.testing.assert_allclose(table["angle_max"], 0.23, rtol=1e-12)
    for kind in ("K", "a", "fronts", "path"):
        history.plot(kind, tmp_path / f"{kind}.png")
        assert (tmp_path / f"{kind}.png").stat().st_size > 5000
    figure = history.plot("K", tmp_path / "K.png")
    N, K = figure.axes[0].lines[0].get_data()
    np.testing.assert_array_equal(N, [0, 100, 200, 300])
    np.testing.assert_allclose(K, 2, rtol=1e-12)
    history.write(tmp_path / "run")
    header = (tmp_path / "run" / "history.csv").read_text().splitlines()[0]
    assert "K_III_0_max" in header


def test_planes():
    view = given_plane(((1, 0, 0), ((2, 0, 0), (1, 3, 0))))
    np.testing.assert_allclose(on_plane(np.array([2.0, 5, 7]), view), [1, 5], atol=1e-14)
    rng = np.random.default_rng(7719)
    flat = rng.uniform(-1, 1, (40, 3)) * [1, 0, 1] + [0, 0.3, 0]
    view = best_plane(flat)
    assert (view.label(0), view.label(1)) == ("x", "z")
    np.testing.assert_allclose(np.abs(on_plane(flat, view)), np.abs(flat[:, [0, 2]]), atol=1e-12)
    with pytest.raises(xc.ProblemError, match="directions are parallel"):
        given_plane(((0, 0, 0), ((1, 0, 0), (2, 0, 0))))


# --- files and figures --------------------------------------------------------------------------


@pytest.fixture
def can_render(monkeypatch):
    """The marker has asked already; a second process would take the time of the test."""
    monkeypatch.setattr(plot_pyvista, "can_render", lambda: True)


@pytest.mark.plot
@pytest.mark.usefixtures("can_render")
@pytest.mark.parametrize(
    ("field", "options"),
    [
        ("von_mises", {"warp": 0.1, "edges": True, "title": "bent"}),
        ("szz", {"clip": ((0, 0, 0), (0, -1, 0)), "loads": True}),
        ("pressure", {"view": (0, 0, 1)}),
        ("opening", {"crack": 0}),
        ("mesh", {}),
    ],
)
def test_pyvista_writes_pictures(tmp_path, solution, field, options):
    import matplotlib as mpl

    path = xc.plot(solution, field, file=tmp_path / "p", **options)
    assert path == tmp_path / "p.png"
    picture = mpl.image.imread(path)[..., :3]
    assert 0.1 < (picture < 0.999).any(axis=2).mean() < 0.95


@pytest.mark.parametrize("field", LIP_FIELDS)
def test_matplotlib_draws_cracks(tmp_path, solution, field):
    path = xc.plot(solution, field, file=tmp_path / "p.png", renderer="matplotlib", title="bent")
    assert path.stat().st_size > 5000


def test_without_a_renderer(monkeypatch, solution):
    monkeypatch.setattr(plot_pyvista, "can_render", lambda: False)
    assert isinstance(xc.plot(solution, "pressure", show=False), Figure)
    with pytest.raises(xc.ProblemError, match="libegl1"):
        xc.plot(solution, "von_mises", show=False)


# --- bad input ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "options", "message"),
    [
        ("mises", {}, '\'mises\'.*"szz".*"sliding"'),
        ("szz", {"clip": (0, 1)}, "point and a normal"),
        ("szz", {"clip": ((0, 0, 0), (0, 0, 0))}, "point and a normal"),
        ("szz", {"clip": ((9, 0, 0), (-1, 0, 0))}, "leaves nothing"),
        ("szz", {"view": (0, 0)}, "to the viewer"),
        ("pressure", {"crack": 3}, "numbered from 0"),
        ("szz", {"renderer": "vtk"}, "renderer = 'vtk'"),
    ],
)
def test_bad_options(monkeypatch, solution, field, options, message):
    monkeypatch.setattr(plot_pyvista, "can_render", lambda: True)
    with pytest.raises(xc.ProblemError, match=message):
        xc.plot(solution, field, show=False, **options)


def test_bad_fronts(history):
    with pytest.raises(xc.ProblemError, match="numbered from 0"):
        draw_fronts(history, crack=1, show=False)
    with pytest.raises(xc.ProblemError, match="for 2 curve"):
        draw_fronts([history, history], labels=["one"], show=False)
    with pytest.raises(xc.ProblemError, match="no steps"):
        draw_fronts(History((), "nothing"), show=False)
    with pytest.raises(xc.ProblemError, match="front=4"):
        draw_K(ring(0.5, 8), front=4, show=False)
    with pytest.raises(xc.ProblemError, match="modes"):
        draw_K(ring(0.5, 8), modes=("IV",), show=False)
    with pytest.raises(xc.ProblemError, match="every = 0"):
        draw_fronts(history, every=0, show=False)
    with pytest.raises(xc.ProblemError, match="in 3D also"):
        history.plot("S", None)


def test_tilted_plane_keeps_the_axis_it_holds():
    """Points in a plane turned about x by 30 degrees: x to the right."""
    rng = np.random.default_rng(88301)
    flat = rng.uniform(-1, 1, (60, 2))
    x = np.stack([flat[:, 0] + 3, flat[:, 1] * np.cos(0.5), flat[:, 1] * np.sin(0.5)], axis=1)
    view = best_plane(x, (0, 0, 1))
    assert view.label(0) == "x"
    np.testing.assert_allclose(on_plane(x, view)[:, 0], x[:, 0], atol=1e-12)


def test_plane_bodies_are_not_cut_open():
    flat = xc.Problem(
        xc.box((0, 0), (1, 1), 2),
        xc.Isotropic(E=1.0, nu=0.3, plane="strain"),
        loads=[xc.pressure("boundary", 1.0)],
    )
    with pytest.raises(xc.ProblemError, match="only 3D bodies"):
        xc.plot(xc.solve(flat), clip=((0, 0, 0), (1, 0, 0)))


@pytest.mark.plot
def test_the_window_goes_with_the_crack_that_a_warp_moves():
    """A column pushed sideways at its head: the box moves as the middle of the crack does."""
    mesh = xc.box((0, 0, 0), (4, 4, 24), (4, 4, 24))
    crack = xc.penny_crack((2, 0, 20.03), (0, 0, 1), 1.5)
    problem = xc.Problem(
        mesh, xc.Isotropic(70e3, 0.33), [crack], supports=[xc.fix("bottom")],
        loads=[xc.traction("top", (0, 10.0, 0))],
    )  # fmt: skip
    solution = xc.solve(problem)
    moved = 40 * solution.displacement(np.array([[2.0, 1.0, 20.1]]))[0]
    still, gone = (crack_box(solution, [0], 1.5, warp).mean(axis=0) for warp in (0.0, 40.0))
    assert moved[1] > 10
    assert gone - still == pytest.approx(moved, rel=0.1, abs=0.3)  # it turns, too


# --- bodies drawn with the curves that their mesh knows: outlines and areas of what is drawn ------


R, SIDE = 1.0, 6.0
SEEN = 3e-3  # length: half of it is what a picture of the body does not show


def circle(x):
    """Nearest points on the wall of a hole along z."""
    flat = x[:, :2] / np.linalg.norm(x[:, :2], axis=1)[:, None] * R
    return np.concatenate([flat, x[:, 2:]], axis=1)


def plate(n):
    """Square plate with a hole of n chords, which the mesh knows to be round."""
    turn = 2 * np.pi * np.arange(n) / n
    hole = R * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rim = SIDE / 2 * hole / np.abs(hole).max(axis=1)[:, None]
    i, j = np.arange(n), (np.arange(n) + 1) % n
    cells = np.concatenate([np.stack([i, n + i, n + j], 1), np.stack([i, n + j, j], 1)])
    return np.concatenate([hole, rim]), cells, np.stack([i, j], 1)


def flat_plate(n):
    points, cells, rim = plate(n)
    mesh = xc.Mesh(points, cells, {"hole": rim}, curves={"hole": circle})
    return xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3, plane="stress"), loads=LOADS)


def solid_plate(n):
    """The same with a thickness of one, its prisms divided from their smallest number."""
    points, cells, _ = plate(n)
    m = len(points)
    x = np.concatenate([np.column_stack([points, np.full(m, z)]) for z in (0.0, 1.0)])
    p, q, r = np.sort(cells, axis=1).T
    split = [[p, q, r, r + m], [p, q, q + m, r + m], [p, p + m, q + m, r + m]]
    cells = np.concatenate([np.stack(each, axis=1) for each in split])
    bare = xc.Mesh(x, cells)
    on_hole = (np.hypot(*x[bare.boundary][..., :2].transpose(2, 0, 1)) < R + 1e-9).all(axis=1)
    mesh = xc.Mesh(x, bare.cells, {"hole": bare.boundary[on_hole]}, curves={"hole": circle})
    return xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3), loads=LOADS)


LOADS = (xc.pressure("hole", 1e-3),)


def off_circle(x):
    x = x.reshape(-1, x.shape[-1])
    near = np.hypot(x[:, 0], x[:, 1]) < 1.5 * R
    return np.abs(np.hypot(x[near, 0], x[near, 1]) - R)


@pytest.mark.parametrize("order", [1, 2])
def test_a_hole_of_eight_chords_is_drawn_round(order):
    solution = xc.solve(dataclasses.replace(flat_plate(8), order=order))
    picture = scene(solution, "von_mises", 0.0, None)
    for line in (picture.outline, picture.at_rest, boundary_lines(solution.space.mesh)):
        assert len(off_circle(line)) > 60
        assert off_circle(line).max() < SEEN
    corner = picture.points[picture.triangles]
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum() / 2
    assert area == pytest.approx(SIDE**2 - np.pi * R**2, rel=2e-3)
    moved = scene(solution, "ux", 50.0, None)
    assert np.abs(moved.outline - picture.outline).max() > 1e-3


def test_a_hole_in_space_is_drawn_round():
    solution = xc.solve(solid_plate(8))
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    assert off_circle(picture.outline).max() < SEEN
    middle = SIDE**2 - np.pi * R**2
    flat = np.abs(picture.triangles[..., 2] - 1).max(axis=1) < 1e-9
    assert areas(picture.triangles[flat]).sum() == pytest.approx(middle, rel=3e-3)
    wall = (np.hypot(*picture.triangles[..., :2].transpose(2, 0, 1)) < 1.01 * R).all(axis=1)
    assert areas(picture.triangles[wall]).sum() == pytest.approx(2 * np.pi * R, rel=3e-3)
    # No line runs along the chords, though they meet at 45 degrees.
    along = picture.outline[:, 1] - picture.outline[:, 0]
    upright = np.abs(along[:, 2]) > 0.1
    assert not (np.hypot(*picture.outline[upright][..., :2].transpose(2, 0, 1)) < 1.5).any()
    cut = space_scene(solution, "uz", 0.0, None, (np.zeros(3), np.array([0.0, -1.0, 0.0])), None)
    assert off_circle(cut.outline).max() < SEEN + 1e-9
    edges = mesh_scene(solution, None, None)
    assert off_circle(edges.faint_lines).max() < SEEN
    assert off_circle(edges.outline).max() < SEEN
    plane = given_plane(((0, 0, 0.5), ((1, 0, 0), (0, 1, 0))))
    assert off_circle(section_outline(solution.space.mesh, plane)).max() < SEEN
    # Plane sides end on the arc too: the outline of a section along the axis is closed.
    for y in (0.0, 0.1, 0.4):
        beside = given_plane(((0, y, 0), ((1, 0, 0), (0, 0, 1))))
        end = section_outline(solution.space.mesh, beside).reshape(-1, 2)
        _, lines = np.unique(end.round(6), axis=0, return_counts=True)
        assert (lines == 2).all()


def test_normals_of_a_round_side_are_those_of_its_axis():
    solution = xc.solve(solid_plate(8))
    picture = space_scene(solution, "von_mises", 0.0, None, None, None)
    wall = (np.hypot(*picture.triangles[..., :2].transpose(2, 0, 1)) < 1.01 * R).all(axis=1)
    x, normal = picture.triangles[wall], shading_normals(picture.triangles)[wall]
    radial = np.concatenate([x[..., :2] / R, 0 * x[..., 2:]], axis=2)
    assert np.abs(np.einsum("kvd,kvd->kv", radial, normal)).min() > np.cos(np.radians(4))


def test_a_mesh_without_curves_has_none():
    assert CurvedSides.of(xc.box((0, 0), (1, 1), 2)) is None
