"""Pictures: what is drawn, as arrays and on the figure; files are written and not empty."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import xcrack as xc
from xcrack.view import pyvista as plot_pyvista
from xcrack.view.scene_2d import FIELDS, scene


def solved(sign=1.0, order=2, cracks=True):
    problem = xc.Problem(
        xc.box((-1, -1), (1, 1), 10),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[xc.line_crack([(-1.2, 0.03), (0.083, 0.047)])] if cracks else [],
        loads=[xc.traction("top", (0, sign)), xc.traction("bottom", (0, -sign))],
        order=order,
    )
    return xc.solve(problem)


@pytest.fixture(scope="module")
def pulled():
    return solved()


@pytest.fixture(scope="module")
def pressed():
    return solved(-1.0)


@pytest.fixture(scope="module")
def two_cracks():
    problem = xc.Problem(
        xc.box((0, 0), (3, 2), (18, 12)),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[
            xc.line_crack([(-0.2, 0.83), (0.913, 0.87)]),
            xc.line_crack([(3.2, 1.21), (2.1, 1.13)]),
        ],
        loads=[xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))],
    )
    return xc.solve(problem)


def length(curves):
    return np.linalg.norm(np.diff(curves, axis=1), axis=2).sum()


def area(picture):
    x = picture.points[picture.triangles]
    return np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / 2


# --- what is drawn ------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [1, 2])
def test_contours_at_rest(order):
    """Perimeter 8, each lip as long as the crack inside, area 4: round-off."""
    picture = scene(solved(order=order), "von_mises", 0.0, None)
    inside = (0.083 + 1) * np.hypot(1, 0.017 / 1.283)
    assert length(picture.outline) == pytest.approx(8, rel=1e-12)
    assert length(picture.lips) == pytest.approx(2 * inside, rel=1e-12)
    assert len(picture.closed_lips) == 0
    assert area(picture) == pytest.approx(4, rel=1e-12)


def test_triangles_in_corners_show_both_their_sides():
    mesh = xc.Mesh([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)])
    pull = [xc.traction("boundary", lambda x, n: n)]
    steel = xc.Isotropic(E=1.0, nu=0.3, plane="stress")
    picture = scene(xc.solve(xc.Problem(mesh, steel, loads=pull)), "von_mises", 0.0, None)
    assert length(picture.outline) == pytest.approx(4, rel=1e-12)


def test_the_crack_opens_with_the_warp(pulled):
    """The mouth gapes by warp times the jump there; round-off."""
    warp = 0.013
    at_rest, moved = (scene(pulled, "uy", w, None) for w in (0.0, warp))
    mouth = np.array([-1.0, 0.03 + 0.2 * 0.017 / 1.283])
    on_mouth = np.linalg.norm(at_rest.points - mouth, axis=1) < 1e-9
    assert on_mouth.sum() == 2
    gape = np.abs(np.diff(moved.points[on_mouth], axis=0)[0])
    jump = np.abs(pulled.displacement(mouth, 1) - pulled.displacement(mouth, -1))
    np.testing.assert_allclose(gape, warp * jump, rtol=1e-10)
    np.testing.assert_array_equal(moved.at_rest, at_rest.outline)


def test_closed_lips_look_different(pressed):
    picture = scene(pressed, "von_mises", 0.0, None)
    assert len(picture.lips) == 0
    assert length(picture.closed_lips) == pytest.approx(2 * 1.083 * np.hypot(1, 0.01325), rel=1e-4)


def test_cell_edges_are_those_of_the_mesh(pulled):
    """Their length with the outline and what the crack covers; each edge once."""
    picture = scene(pulled, "von_mises", 0.0, None)
    mesh = pulled.problem.mesh
    x = mesh.points[mesh.edges]
    total = np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum()
    assert length(picture.cell_edges) + 8 == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("field", FIELDS)
def test_values_are_those_of_the_solution(pulled, field):
    """Away from the crack, at vertices; a mean of stresses differs by discretisation."""
    picture = scene(pulled, field, 0.0, None)
    assert np.isfinite(picture.values).all()
    low, high = picture.limits
    assert low < high
    far = np.abs(picture.points[:, 0] - 0.5) + np.abs(picture.points[:, 1] + 0.6) < 0.2
    x, values = picture.points[far], picture.values[far]
    u, s = pulled.displacement(x), pulled.stress(x)
    zz = 0.3 * (s[:, 0, 0] + s[:, 1, 1])
    full = np.stack([s[:, 0, 0], s[:, 1, 1], zz], axis=1)
    spread = ((full - np.roll(full, 1, axis=1)) ** 2).sum(axis=1) / 2
    expected = {
        "displacement": np.linalg.norm(u, axis=1),
        "ux": u[:, 0],
        "uy": u[:, 1],
        "sxx": s[:, 0, 0],
        "syy": s[:, 1, 1],
        "sxy": s[:, 0, 1],
        "von_mises": np.sqrt(spread + 3 * s[:, 0, 1] ** 2),
        "material": np.zeros(len(x)),  # the one that it has
    }[field]
    exact = field in ("displacement", "ux", "uy", "material")
    tolerance = 1e-10 if exact else 0.08 * np.abs(s).max()
    np.testing.assert_allclose(values, expected, rtol=0, atol=tolerance)


def test_stress_at_a_tip_is_clipped_and_the_bar_says_so(pulled):
    picture = scene(pulled, "von_mises", 0.0, None)
    assert picture.limits[1] < 0.5 * picture.values.max()
    assert picture.is_beyond == (False, True)
    share = float(picture.label.split("clipped at ")[1].removesuffix(" %"))
    assert 99 <= share < 100
    own = scene(pulled, "von_mises", 0.0, (0.0, 2.0))
    assert own.limits == (0.0, 2.0)
    assert own.label == "von Mises stress"


def test_without_tips_nothing_is_clipped():
    picture = scene(solved(cracks=False), "syy", 0.0, None)
    assert picture.label == "stress yy"
    assert picture.is_beyond == (False, False)
    # Constant stress 1: noise is not spread over the colours.
    assert picture.limits == pytest.approx((0.95, 1.05), rel=1e-6)


def test_colours_part_at_zero_for_both_signs(pulled):
    picture = scene(pulled, "uy", 0.0, None)
    assert picture.has_sign
    assert picture.limits[0] == -picture.limits[1]
    assert not scene(pulled, "displacement", 0.0, None).has_sign


# --- files and figures --------------------------------------------------------------------------


def written(path):
    assert path.exists()
    assert path.stat().st_size > 5000
    return path.read_bytes()


@pytest.mark.parametrize("field", ["von_mises", "uy", "mesh", "pressure", "opening"])
def test_matplotlib_writes_pictures(tmp_path, pressed, field):
    path = xc.plot(
        pressed,
        field,
        file=tmp_path / "new" / "p.png",
        warp=0.1,
        renderer="matplotlib",
        title="pressed",
        edges=True,
    )
    assert path == tmp_path / "new" / "p.png"
    assert written(path).startswith(b"\x89PNG")


def test_a_vector_graphic(tmp_path, pulled):
    assert written(xc.plot(pulled, file=tmp_path / "p.pdf")).startswith(b"%PDF")


def test_a_path_without_suffix(tmp_path, pulled):
    assert xc.plot(pulled, "mesh", file=tmp_path / "p").name == "p.png"


@pytest.fixture
def can_render(monkeypatch):
    """The marker has asked already; a second process would take the time of the test."""
    monkeypatch.setattr(plot_pyvista, "can_render", lambda: True)


@pytest.mark.plot
@pytest.mark.usefixtures("can_render")
def test_pyvista_writes_a_picture(tmp_path, pressed):
    path = xc.plot(pressed, warp=0.1, file=tmp_path / "p.png", renderer="pyvista", title="pressed")
    picture = mpl.image.imread(path)[..., :3]
    lips = np.array(mpl.colors.to_rgb("#d6006c"))
    assert (np.abs(picture - lips).max(axis=2) < 0.02).sum() > 500
    assert (picture == 1).all(axis=2).mean() < 0.6


@pytest.mark.plot
@pytest.mark.usefixtures("can_render")
def test_pyvista_returns_its_plotter(pulled):
    plotter = xc.plot(pulled, "uy", renderer="pyvista", show=False)
    assert plotter.bounds[0] == pytest.approx(-1)
    plotter.close()


def test_auto_falls_back_to_matplotlib(monkeypatch, pulled):
    monkeypatch.setattr(plot_pyvista, "can_render", lambda: False)
    assert isinstance(xc.plot(pulled, show=False), Figure)
    with pytest.raises(xc.ProblemError, match="libegl1"):
        xc.plot(pulled, renderer="pyvista", show=False)


def test_probe_survives_a_process_that_dies(monkeypatch):
    monkeypatch.setattr(plot_pyvista, "_PROBE", "import os; os.abort()")
    assert not plot_pyvista.can_render.__wrapped__()


def test_pressure_along_the_lips(pressed):
    """The curve is the contact's, from where the crack enters the body."""
    axes = xc.plot(pressed, "pressure", show=False).axes[0]
    x, y = axes.lines[0].get_data()
    contact = pressed.contact[0]
    np.testing.assert_array_equal(y, contact.pressure)
    entry = np.array([-1, 0.03 + 0.2 * 0.017 / 1.283])
    np.testing.assert_allclose(x, np.linalg.norm(contact.points - entry, axis=1), atol=1e-12)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["contact pressure p", "crack faces touch"]


def test_opening_of_lips_that_stay_apart(pulled):
    axes = xc.plot(pulled, "opening", show=False).axes[0]
    np.testing.assert_allclose(axes.lines[0].get_ydata(), pulled.opening(0), rtol=1e-14)
    slip = pulled.jump(0) @ np.array([1.283, 0.017]) / np.hypot(1.283, 0.017)
    np.testing.assert_allclose(axes.lines[1].get_ydata(), slip, atol=1e-12)
    assert "crack faces touch" not in [text.get_text() for text in axes.get_legend().get_texts()]


def test_one_graph_a_crack(two_cracks):
    assert len(xc.plot(two_cracks, "opening", show=False).axes) == 2
    (axes,) = xc.plot(two_cracks, "opening", crack=1, show=False).axes
    assert axes.get_xlabel().startswith("crack 1")
    axes = xc.plot(two_cracks, "pressure", show=False).axes[0]
    assert "no multipliers" in axes.texts[-1].get_text()


def test_partial_contact_shades_the_closed_part_only():
    """Closed at the tip only: pulled at the left, pressed at the right."""

    def bending(x):
        return np.stack([0 * x[:, 0], 0.1 + 0.6 * np.sign(x[:, 0] + 0.5)], axis=1)

    problem = xc.Problem(
        xc.box((-1, -1), (1, 1), 10),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[xc.line_crack([(-1.2, 0.03), (0.083, 0.047)])],
        loads=[
            xc.traction("top", lambda x: -bending(x)),
            xc.traction("bottom", bending),
        ],
    )
    solution = xc.solve(problem)
    closed = solution.contact[0].closed
    assert closed.any()
    assert not closed.all()
    shades = xc.plot(solution, "pressure", show=False).axes[0].patches
    s = solution.contact[0].s
    width = sum(patch.get_width() for patch in shades)
    # Half a distance of points at each end.
    assert width == pytest.approx(s[closed].max() - s[closed].min(), abs=0.1)
    picture = scene(solution, "von_mises", 0.0, None)
    assert length(picture.closed_lips) == pytest.approx(2 * width, abs=0.2)
    assert len(picture.lips) > 0


# --- bad input ----------------------------------------------------------------------------------


def test_an_unknown_field_lists_the_known(pulled):
    with pytest.raises(xc.ProblemError) as caught:
        xc.plot(pulled, "mises")
    for name in (*FIELDS, "mesh", "pressure", "opening", "'mises'"):
        assert name in str(caught.value)


def test_bad_options(pulled, tmp_path):
    with pytest.raises(xc.ProblemError, match="renderer = 'vtk'"):
        xc.plot(pulled, renderer="vtk")
    with pytest.raises(xc.ProblemError, match="numbered from 0"):
        xc.plot(pulled, "pressure", crack=1)
    with pytest.raises(xc.ProblemError, match="no crack"):
        xc.plot(solved(cracks=False), "opening")
    with pytest.raises(xc.ProblemError, match=r"\.svg"):
        xc.plot(pulled, file=tmp_path / "p.svg", renderer="pyvista")


def test_zoom_shows_the_crack_and_refuses_nonsense(tmp_path):
    import xcrack as xc

    mesh = xc.box((0, 0), (10, 10), 10)
    body = xc.Isotropic(E=1.0, nu=0.3, plane="strain")
    crack = xc.line_crack([(-0.1, 5.03), (3, 5.03)])
    loads = [xc.traction("top", (0, 1.0)), xc.traction("bottom", (0, -1.0))]
    solution = xc.solve(xc.Problem(mesh, body, cracks=[crack], loads=loads))
    for field in ("syy", "mesh"):
        figure = xc.plot(solution, field, zoom=1.5, show=False, renderer="matplotlib")
        low, high = figure.axes[0].get_xlim()
        # 1.5 times the crack of 3, and a margin of 2 % on both sides.
        assert high - low == pytest.approx(1.04 * 4.5, rel=0.02)
        assert low < 0 < 3 < high
    for wrong in (0, -1.0, "near"):
        with pytest.raises(xc.ProblemError, match="zoom"):
            xc.plot(solution, zoom=wrong, file=tmp_path / "a.png")
    whole = xc.solve(xc.Problem(mesh, body, loads=loads))
    with pytest.raises(xc.ProblemError, match="no crack"):
        xc.plot(whole, zoom=2.0, file=tmp_path / "a.png")
