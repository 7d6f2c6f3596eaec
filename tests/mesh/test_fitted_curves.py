"""Curves through the points of meshes of straight cells, against circles, ellipses and surfaces."""

import warnings

import numpy as np
import pytest

import xcrack as xc

ROUND_OFF = 1e-12


def ring(n, shape=(1.0, 1.0)):
    """A square plate with a hole of n chords around an ellipse: its boundary is `hole`."""
    angle = 2 * np.pi * np.arange(n) / n
    inner = np.stack([np.cos(angle), np.sin(angle)], axis=1) * shape
    outer = 3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([inner, (inner + outer) / 2, outer])
    k = np.arange(n)
    quads = [(r * n + k, r * n + (k + 1) % n) for r in range(2)]
    cells = [
        np.stack(corners, axis=1)
        for a, b in quads
        for corners in ((a, a + n, b + n), (a, b + n, b))
    ]
    hole = np.stack([k, (k + 1) % n], axis=1)
    return xc.Mesh(points, np.concatenate(cells), {"hole": hole, "rim": hole + 2 * n})


def middles(mesh, name):
    """Middles of the facets of a set, and where its curve takes them."""
    x = mesh.points[mesh.facet_sets[name]].mean(axis=1)
    return x, mesh.curves[name](x)


@pytest.mark.parametrize("n", [8, 13, 40])
def test_circles_are_exact(n):
    mesh = xc.fit_curves(ring(n))
    assert set(mesh.curves) == {"hole", "rim"}
    for name, radius in (("hole", 1.0), ("rim", 3.0)):
        x, on_curve = middles(mesh, name)
        assert np.linalg.norm(x, axis=1).max() < radius * np.cos(np.pi / n) + ROUND_OFF
        # The quartic pieces of an arc of 45 degrees are a millionth off.
        assert np.linalg.norm(on_curve, axis=1) == pytest.approx(radius, rel=2e-6)


def test_only_the_sets_that_are_named():
    mesh = xc.fit_curves(ring(12), "hole")
    assert set(mesh.curves) == {"hole"}
    assert set(xc.fit_curves(ring(12), ["rim"]).curves) == {"rim"}
    with pytest.raises(xc.ProblemError, match="no facet set 'bore'"):
        xc.fit_curves(ring(12), "bore")
    with pytest.raises(xc.MeshError, match=r"sets = .*: give names of facet sets"):
        xc.fit_curves(ring(12), [["hole"]])


def test_an_angle_decides_what_a_corner_is():
    """A hexagon turns by 60 degrees."""
    assert not xc.fit_curves(ring(6)).curves
    assert set(xc.fit_curves(ring(6), angle=61).curves) == {"hole", "rim"}


def test_ellipses_converge():
    """Of what chords leave beside an ellipse 2:1, half is left at 24 chords, .05 at 192."""
    left = []
    for n in (24, 48, 96, 192):
        mesh = xc.fit_curves(ring(n, (1.0, 0.5)), "hole")
        heights = [np.abs(np.hypot(x[:, 0], 2 * x[:, 1]) - 1).mean() for x in middles(mesh, "hole")]
        left.append(heights[1] / heights[0])
    print(f"\nleft of the chords' error {np.round(left, 4)}")
    assert left[0] < 0.5
    assert (np.diff(left) < 0).all()
    assert left[-1] < 0.05


def rounded(n, of_fillet):
    """A square of 2 with corners of radius .5 in some chords, and n facets along each side."""
    angle = np.pi / 2 * np.arange(of_fillet + 1) / of_fillet
    corner = 0.5 + 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    share = np.arange(1, n)[:, None] / n
    side = (1 - share) * corner[-1] + share * (-corner[-1, 0], corner[-1, 1])
    quarter = np.concatenate([corner, side])
    turned = [quarter]
    for _ in range(3):
        turned.append(turned[-1][:, ::-1] * (-1, 1))
    points = np.concatenate([*turned, np.zeros((1, 2))])
    m = len(points) - 1
    k = np.arange(m)
    return xc.Mesh(points, np.stack([k, (k + 1) % m, np.full(m, m)], axis=1))


@pytest.mark.parametrize(("n", "of_fillet"), [(4, 4), (6, 8)])
def test_straight_sides_stay_straight_beside_fillets(n, of_fillet):
    mesh = rounded(n, of_fillet)
    area = 4 - (4 - np.pi) * 0.25
    fine = xc.fit_curves(mesh)
    for _ in range(3):
        fine = xc.refine(fine)
    x = fine.points[np.unique(fine.boundary)]
    flat = (np.abs(x) < 0.5 - 1e-9).any(axis=1)
    assert np.abs(x[flat]).max(axis=1) == pytest.approx(1.0, abs=ROUND_OFF)
    assert abs(fine.volume.sum() - area) < 0.3 * abs(mesh.volume.sum() - area)


def rounded_cube(n, axes):
    """A cube of 2 whose sides across some axes are moved onto a cylinder or a ball of radius 1."""
    cube = xc.box((-1, -1, -1), (1, 1, 1), n)
    x = cube.points.copy()
    length = np.linalg.norm(x[:, :axes], axis=1, keepdims=True)
    x[:, :axes] *= np.abs(x[:, :axes]).max(axis=1, keepdims=True) / np.maximum(length, 1e-300)
    return xc.Mesh(x, cube.cells)


@pytest.mark.parametrize(("axes", "n", "left"), [(3, 4, 0.02), (2, 4, 0.05), (2, 8, 0.02)])
def test_balls_and_cylinders(axes, n, left):
    """Of what chords leave; the ends of a cylinder stay plane, their outlines become circles."""
    mesh = xc.fit_curves(rounded_cube(n, axes))
    (name,) = mesh.curves
    radii = [np.linalg.norm(x[:, :axes], axis=1) for x in middles(mesh, name)]
    print(f"\nchords {1 - radii[0].min():.4f}, curve {np.abs(radii[1] - 1).max():.1e}")
    assert np.abs(radii[1] - 1).max() < left * (1 - radii[0].min())
    fine = xc.refine(mesh)
    x = fine.points[np.unique(fine.boundary)]
    if axes == 2:
        assert {"curved_1", "boundary"} == set(mesh.facet_sets)
        at_end = np.abs(np.abs(x[:, 2]) - 1) < ROUND_OFF
        radius = np.linalg.norm(x[at_end, :2], axis=1)
        rim = radius > 0.9
        assert np.abs(radius[rim] - 1).max() < left * (1 - radii[0].min())
    volume = {3: 4 * np.pi / 3, 2: 2 * np.pi}[axes]
    lacks = [1 - m.volume.sum() / volume for m in (mesh, fine)]
    assert 0 < lacks[1] < 0.27 * lacks[0]  # chords: a quarter at half of the size


def test_a_box_has_no_curves():
    for mesh in (xc.box((0, 0), (2, 1), (4, 2)), xc.box((0, 0, 0), (2, 1, 1), (4, 2, 2))):
        assert not xc.fit_curves(mesh).curves


def read(tmp_path, mesh, **options):
    path = tmp_path / "part.msh"
    xc.write_mesh(path, mesh)
    with warnings.catch_warnings(record=True) as messages:
        warnings.simplefilter("always")
        xc.read_mesh(path, **options)
    return [str(message.message) for message in messages]


def test_a_file_that_has_lost_its_curves_says_so(tmp_path):
    """Of twelve chords K is 1 to 2 % off (docs/body.md); nothing is said of 24, and of curves."""
    (message,) = read(tmp_path, xc.Mesh(ring(12).points, ring(12).cells))
    assert "turn by about 30 degrees" in message
    assert "2.3% off" in message
    assert "fit_curves=True" in message
    assert not read(tmp_path, ring(12), fit_curves=True)
    assert not read(tmp_path, ring(24))
    assert not read(tmp_path, xc.fit_curves(ring(12)))
    assert not read(tmp_path, xc.box((0, 0), (1, 1), 3))


def test_a_tolerance_in_space_names_chords_that_matter_more():
    """A bar of 16 chords: K beside them is off by 1.3 %."""
    bar = rounded_cube(4, 2)
    crack = xc.elliptic_crack((0.0, 1.0, 0.01), (0, 0, 1), (1, 0, 0), 0.4, 0.4)
    at_end = np.abs(np.abs(bar.points[bar.boundary][:, :, 2]) - 1).max(axis=1) < ROUND_OFF
    ends = {"ends": bar.boundary[at_end]}
    bar = xc.Mesh(bar.points, bar.cells, ends)
    for mesh, tolerance, count in ((bar, 0.005, 1), (bar, 0.05, 0), (xc.fit_curves(bar), 0.005, 0)):
        loads = [xc.traction("ends", lambda x, n: n)]
        problem = xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [crack], loads=loads)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with pytest.raises(xc.ProblemError, match="max_unknowns"):
                xc.adapt(problem, tolerance, max_unknowns=10, progress=False)
        messages = [str(m.message) for m in caught if "like chords" in str(m.message)]
        assert len(messages) == count
        if count:
            assert "xc.fit_curves(mesh) has the curves" in messages[0]


@pytest.mark.parametrize("ending", ["inp", "bdf"])
def test_decks_that_have_lost_their_curves(tmp_path, ending):
    """Of Abaqus and of Nastran: named, and given back where that is asked for."""
    mesh, path = ring(12), tmp_path / f"part.{ending}"
    if ending == "inp":
        xc.write_mesh(path, mesh)
    else:
        x = np.concatenate([mesh.points, np.zeros((len(mesh.points), 1))], axis=1)
        grids = [f"GRID,{i},,{a!r},{b!r},{c!r}" for i, (a, b, c) in enumerate(x.tolist(), 1)]
        cells = [f"CTRIA3,{i},1,{a},{b},{c}" for i, (a, b, c) in enumerate(
            (mesh.cells + 1).tolist(), 1)]  # fmt: skip
        path.write_text("\n".join(["BEGIN BULK", *grids, *cells, "ENDDATA", ""]))
    with pytest.warns(xc.XcrackWarning, match="like chords of a curve"):
        assert not xc.read_deck(path).mesh.curves
    deck = xc.read_deck(path, fit_curves=True).mesh
    assert len(deck.curves) == (2 if ending == "inp" else 1)
    for name in deck.curves:
        x, on_curve = middles(deck, name)
        radius = np.linalg.norm(on_curve, axis=1)
        assert radius == pytest.approx(np.where(radius < 2, 1.0, 3.0), rel=2e-6)
        assert (np.linalg.norm(x, axis=1) < radius - 1e-3).all()
