import numpy as np
import pytest
from scipy.integrate import quad

from support.gmsh_models import gmsh_model
from xcrack import GeometryError, Mesh, MeshError, notched_cylinder

ROUND_OFF = 1e-12
RADIUS, DEPTH, ANGLE = 10.0, 2.0, np.pi / 3
WIDTH = 2 * RADIUS * np.sin(np.pi / 24)  # of an edge of the regular polygon of 24
APOTHEM = RADIUS * np.cos(np.pi / 24)
STATIONS = {"outer": 60.0, "inner": 20.0}


def example_bar(**changes: float) -> Mesh:
    """Bar of the example, coarse to be quick."""
    scene = {
        "diameter": 2 * RADIUS, "length": 140.0, "notch_depth": DEPTH, "notch_angle": ANGLE,
        "outer_span": 120.0, "inner_span": 40.0, "size": 5.0, "size_near": 0.8, "transition": 10.0,
    }  # fmt: skip
    return notched_cylinder(**{**scene, **changes})


@pytest.fixture(scope="module")
def bar() -> Mesh:
    return example_bar()


def area_vectors(mesh: Mesh, name: str) -> np.ndarray:
    """Area times normal of each facet, the sign that of the order of its points."""
    x = mesh.points[mesh.facet_sets[name]]
    return np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2


def area(mesh: Mesh, name: str) -> float:
    return float(np.linalg.norm(area_vectors(mesh, name), axis=1).sum())


def centroid(mesh: Mesh, name: str) -> np.ndarray:
    weight = np.linalg.norm(area_vectors(mesh, name), axis=1)
    return weight @ mesh.points[mesh.facet_sets[name]].mean(axis=1) / weight.sum()


def smallest_angle(mesh: Mesh) -> np.ndarray:
    """Smallest angle between two faces of each cell, degrees; 70.5 in a regular one."""
    normal = mesh.gradient / np.linalg.norm(mesh.gradient, axis=2, keepdims=True)
    i, j = np.triu_indices(4, 1)
    cosine = -np.einsum("cid,cjd->cij", normal, normal)[:, i, j]
    return np.degrees(np.arccos(cosine)).min(axis=1)


def fine_cells(mesh: Mesh, depth: float = RADIUS, band: float = RADIUS / 10) -> np.ndarray:
    x, _, z = mesh.points[mesh.cells].mean(axis=1).T
    return (abs(x) < band) & (z < depth - RADIUS)


def segment_area(depth: float) -> float:
    """Area of the segment of height `depth` of the round section."""
    level = RADIUS - depth
    return RADIUS**2 * np.arccos(level / RADIUS) - level * np.sqrt(2 * RADIUS * depth - depth**2)


def exact_volume() -> float:
    """Prism, transition, cylinder, less the notch."""
    notch = quad(
        lambda t: 2 * (DEPTH - t) * np.tan(ANGLE / 2) * 2 * np.sqrt(2 * RADIUS * t - t**2), 0, DEPTH
    )[0]
    polygon, circle = 12 * RADIUS**2 * np.sin(np.pi / 12), np.pi * RADIUS**2
    prism, turn = 70.0 - 20.0 + WIDTH / 2, RADIUS / 2
    # Sections of the transition lie between the two; their mean is right to 1e-6 of the bar.
    blend = (polygon + circle) / 2
    return 2 * (prism * polygon + turn * blend + (70.0 - prism - turn) * circle) - notch


@pytest.mark.gmsh
@pytest.mark.parametrize("station", STATIONS)
@pytest.mark.parametrize(("side", "sign"), [("left", -1), ("right", 1)])
def test_patches_are_squares_turned_by_15_degrees(bar, station, side, sign):
    for k in range(24):
        name = f"{station}_{side}_{k:02d}"
        turn = np.radians(15 * k)
        normal = np.array([0.0, np.sin(turn), -np.cos(turn)])
        x = bar.points[bar.facet_sets[name]]
        np.testing.assert_allclose(x @ normal, APOTHEM, rtol=ROUND_OFF)
        assert np.ptp(x[..., 0]) == pytest.approx(WIDTH, rel=ROUND_OFF)
        assert area(bar, name) == pytest.approx(WIDTH**2, rel=ROUND_OFF)
        middle = np.array([sign * STATIONS[station], *(APOTHEM * normal[1:])])
        np.testing.assert_allclose(centroid(bar, name), middle, atol=ROUND_OFF * 140)


@pytest.mark.gmsh
def test_sets_are_the_96_patches_the_ends_the_notch_and_the_cylinder(bar):
    patches = [f"{a}_{b}_{k:02d}" for a in STATIONS for b in ("left", "right") for k in range(24)]
    assert set(bar.facet_sets) == {*patches, "left", "right", "notch", "round", "boundary"}
    named = np.concatenate([f for name, f in bar.facet_sets.items() if name != "boundary"])
    assert len(np.unique(np.sort(named, axis=1), axis=0)) == len(named)
    assert (bar.facet_to_cell[bar.facet_numbers(named), 1] < 0).all()
    for name, x in (("left", -70.0), ("right", 70.0)):
        assert (bar.points[bar.facet_sets[name], 0] == x).all()
        assert area(bar, name) == pytest.approx(12 * RADIUS**2 * np.sin(np.pi / 12), rel=ROUND_OFF)


@pytest.mark.gmsh
def test_notch_has_two_plane_faces_that_meet_in_the_root(bar):
    x, _, z = np.moveaxis(bar.points[bar.facet_sets["notch"]], -1, 0)
    np.testing.assert_allclose(
        abs(x), (DEPTH - RADIUS - z) * np.tan(ANGLE / 2), atol=ROUND_OFF * 140
    )
    # Seen along the bar each face is the segment; its rim is a polygon of fine edges.
    seen = abs(area_vectors(bar, "notch")[:, 0])
    for side in (x < 0, x > 0):
        assert seen[side.any(axis=1)].sum() == pytest.approx(segment_area(DEPTH), rel=0.01)
    points = bar.points[np.unique(bar.facet_sets["notch"])]
    root = points[points[:, 0] == 0]
    assert (root[:, 2] == DEPTH - RADIUS).all()
    half = np.sqrt(2 * RADIUS * DEPTH - DEPTH**2)
    assert [root[:, 1].min(), root[:, 1].max()] == pytest.approx([-half, half], rel=ROUND_OFF)
    assert np.diff(np.sort(root[:, 1])).max() < 0.8 * 1.3


@pytest.mark.gmsh
def test_bar_is_round_in_the_middle_and_a_polygon_at_the_ends(bar):
    notch = np.unique(bar.facet_sets["notch"])
    skin = np.setdiff1d(np.unique(bar.facet_sets["boundary"]), notch)
    x, y, z = bar.points[skin].T
    middle = abs(x) < 20.0 - WIDTH / 2 - RADIUS / 2
    np.testing.assert_allclose(np.hypot(y, z)[middle], RADIUS, rtol=ROUND_OFF)
    turn = np.radians(15 * np.arange(24))[:, None]
    height = (np.sin(turn) * y - np.cos(turn) * z).max(axis=0)
    prism = (abs(x) > 20.0 - WIDTH / 2) & (abs(x) < 70.0)
    np.testing.assert_allclose(height[prism], APOTHEM, rtol=ROUND_OFF)
    # Facets are chords of the circle, so that the mesh is a little too small.
    assert 0.996 * exact_volume() < bar.volume.sum() < exact_volume()


@pytest.mark.gmsh
def test_cells_are_fine_where_the_crack_runs_and_well_shaped(bar):
    fine = fine_cells(bar)
    edges = bar.points[bar.edges[np.unique(bar.cell_to_edge[fine])]]
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    # gmsh keeps sizes to a third or so
    assert np.median(length) == pytest.approx(0.8, rel=0.4)
    ends = abs(bar.points[bar.cells].mean(axis=1)[:, 0]) > 30.0
    assert np.median(bar.cell_size[ends]) > 3 * np.median(bar.cell_size[fine])
    assert smallest_angle(bar).min() > 8
    assert smallest_angle(bar)[fine].min() > 18


@pytest.mark.slow
@pytest.mark.gmsh
def test_depth_and_band_say_where_cells_are_fine(bar):
    deep = example_bar(crack_depth=14.0, band=1.6)
    sizes = []
    for mesh in (bar, deep):
        x, _, z = mesh.points[mesh.cells].mean(axis=1).T
        sizes.append(np.median(mesh.cell_size[(abs(x) < 1.5) & (z > 1.0) & (z < 4.0)]))
    near = np.median(bar.cell_size[fine_cells(bar)])
    assert sizes[0] > 1.3 * near
    assert sizes[1] == pytest.approx(near, rel=0.15)


@pytest.mark.gmsh
@pytest.mark.slow
def test_halving_both_sizes_halves_the_cells_at_the_crack(bar):
    half = example_bar(size=2.5, size_near=0.4)
    assert fine_cells(half).sum() / fine_cells(bar).sum() == pytest.approx(8.0, rel=0.15)
    # Not four: where the section becomes a polygon, an arc is one edge in both.
    missed = [1 - mesh.volume.sum() / exact_volume() for mesh in (bar, half)]
    assert missed[0] / missed[1] > 2


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.gmsh
def test_same_call_same_mesh_also_inside_a_session_of_the_user(bar):
    with gmsh_model(Mesh__Algorithm3D=10, Geometry__OCCUnionUnify=1) as gmsh:
        again = example_bar()
        assert gmsh.option.getNumber("Geometry.OCCUnionUnify") == 1
    np.testing.assert_array_equal(again.points, bar.points)
    np.testing.assert_array_equal(again.cells, bar.cells)


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.gmsh
def test_units_do_not_matter(bar):
    unit = 2.0**-37
    lengths = {
        "diameter": 20.0, "length": 140.0, "notch_depth": 2.0, "outer_span": 120.0,
        "inner_span": 40.0, "size": 5.0, "size_near": 0.8, "transition": 10.0,
    }  # fmt: skip
    mesh = example_bar(**{name: value * unit for name, value in lengths.items()})
    np.testing.assert_array_equal(mesh.points, bar.points * unit)


SHAPES = {
    "slim": {"diameter": 10.0, "notch_depth": 1.0, "size": 3.0, "size_near": 0.5},
    "deep": {"notch_depth": 13.0, "notch_angle": 0.6, "crack_depth": 20.0, "size_near": 1.2},
    "blunt": {"notch_depth": 4.0, "notch_angle": 2.2, "size_near": 1.2},
    "short": {"inner_span": 17.0, "outer_span": 60.0, "length": 70.0, "patch_length": 4.0},
    "plain": {"size": 4.0, "size_near": None},
}


@pytest.mark.gmsh
@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_other_proportions(name):
    mesh = example_bar(**SHAPES[name])
    assert smallest_angle(mesh).min() > 7
    width = SHAPES[name].get("diameter", 20.0) * np.sin(np.pi / 24)
    patch = SHAPES[name].get("patch_length", width)
    areas = [area(mesh, n) for n in mesh.facet_sets if n[-1].isdigit()]
    assert len(areas) == 96
    np.testing.assert_allclose(areas, width * patch, rtol=ROUND_OFF * 100)


REFUSED = {
    "diameter = -20": {"diameter": -20.0},
    "length = nan": {"length": np.nan},
    "notch_depth = 0": {"notch_depth": 0.0},
    "size_near = inf": {"size_near": np.inf},
    "band = -1": {"band": -1.0},
    "transition = nan": {"transition": np.nan},
    r"notch_angle = 60.0 .*np\.radians": {"notch_angle": 60.0},
    "notch_angle = nan": {"notch_angle": np.nan},
    "crack_depth = 1.5 must exceed notch_depth = 2": {"crack_depth": 1.5},
    "crack_depth = 21 .* not diameter = 20": {"crack_depth": 21.0},
    "size = 21 is larger than the diameter": {"size": 21.0},
    "size_near = 6 is larger than size = 5": {"size_near": 6.0},
    "points, more than 5e": {"size_near": 1e-3},
    r"no room \(-2\) between the outer .* make length exceed 124": {
        "length": 120.0, "patch_length": 4.0,
    },
    r"no room \(-1\) between outer and inner .* make outer_span exceed 50": {
        "outer_span": 48.0, "patch_length": 5.0,
    },
    r"no room .* between the inner patches and the notch: make inner_span exceed": {
        "notch_angle": 3.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("says", REFUSED)
def test_wrong_bars_are_refused(says):
    with pytest.raises(GeometryError, match=says):
        example_bar(**REFUSED[says])


@pytest.mark.gmsh
def test_a_bar_that_gmsh_cannot_mesh_is_a_mesh_error(monkeypatch):
    def fail(dim: int) -> None:
        raise Exception("no luck")

    gmsh = pytest.importorskip("gmsh")
    monkeypatch.setattr(gmsh.model.mesh, "generate", fail)
    with pytest.raises(MeshError, match="no luck"):
        example_bar()
