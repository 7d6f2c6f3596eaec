"""Charts of error against time: refinement, the reference and its error, advice, failures."""

import math

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from xcrack import refine
from xcrack.verification.charting.result import Chart, ChartRow
from xcrack.verification.charting.values import Sampled, at_places, most_trusted, remaining

PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
K = np.array([1.0, 0.6])


def facet_measure(mesh, facets):
    """Length or area of each facet."""
    x = mesh.points[facets]
    edges = x[:, 1:] - x[:, :1]
    gram = np.einsum("fid,fjd->fij", edges, edges)
    return np.sqrt(np.linalg.det(gram)) / math.factorial(mesh.dim - 1)


def shape(mesh):
    """Size by volume over size by edges, cell by cell: 0 for a flat one."""
    x = mesh.points[mesh.cells]
    i, j = np.triu_indices(mesh.dim + 1, 1)
    square = ((x[:, i] - x[:, j]) ** 2).sum(axis=-1).mean(axis=1)
    return mesh.volume ** (1 / mesh.dim) / np.sqrt(square)


def with_sets(mesh):
    """The mesh with a set of the cells on its left half, and one of facets inside."""
    middle = mesh.points[mesh.cells].mean(axis=1)
    left = np.nonzero(middle[:, 0] < 0.1)[0]
    inner = mesh.facets[mesh.facet_to_cell[:, 1] >= 0][::3]
    return xc.Mesh(mesh.points, mesh.cells, {**mesh.facet_sets, "inner": inner}, {"left": left})


def bodies():
    flat = scenes.perturbed(3, seed=5813)
    rng = np.random.default_rng(9127)
    block = xc.box((-1, -1, -1), (1, 1, 1), 2)
    x = block.points + 0.1 * rng.uniform(-1, 1, block.points.shape)
    return [with_sets(flat), with_sets(xc.Mesh(x, block.cells, block.facet_sets))]


@pytest.mark.parametrize("mesh", bodies(), ids=["plane", "space"])
def test_refinement_halves(mesh):
    fine, parts = refine(mesh), 2**mesh.dim
    assert len(fine.cells) == parts * len(mesh.cells)
    assert np.array_equal(fine.points[: mesh.n_points], mesh.points)
    # Every part has the same volume; round-off.
    assert np.allclose(fine.volume.reshape(-1, parts), mesh.volume[:, None] / parts, rtol=1e-12)
    # Conforming: no facet of a part is free unless it lies on the boundary.
    free = fine.facets[fine.facet_to_cell[:, 1] < 0]
    assert len(free) == 2 ** (mesh.dim - 1) * len(mesh.facet_sets["boundary"])
    assert set(fine.facet_sets) == set(mesh.facet_sets)
    for name, facets in mesh.facet_sets.items():
        split = facet_measure(fine, fine.facet_sets[name]).reshape(len(facets), -1)
        assert np.allclose(split, facet_measure(mesh, facets)[:, None] / split.shape[1])
    assert fine.volume[fine.cell_sets["left"]].sum() == pytest.approx(
        mesh.volume[mesh.cell_sets["left"]].sum(), rel=1e-12
    )
    middle = fine.points[fine.cells[fine.cell_sets["left"]]].mean(axis=1)
    assert len(np.unique(middle, axis=0)) == parts * len(mesh.cell_sets["left"])


@pytest.mark.parametrize("seed", [40127, 77351, 5303, 91813])
def test_refinement_keeps_shapes(seed):
    """Zhang (1995): along the shortest diagonal shapes stop getting worse."""
    points = np.random.default_rng(seed).standard_normal((4, 3))
    levels = [xc.Mesh(points, [(0, 1, 2, 3)])]
    for _ in range(4):
        levels.append(refine(levels[-1]))
    worst = [shape(mesh).min() for mesh in levels]
    assert worst[-1] > 0.8 * worst[0]
    assert worst[-1] == pytest.approx(worst[-2], rel=1e-9)


def test_refinement_wants_a_mesh():
    with pytest.raises(xc.MeshError, match=r"refine: mesh = .*: give Mesh"):
        refine([1])


# The reference ---------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.5, 1.0, 1.7, 2.0])
def test_remaining_error_is_that_of_a_power(rate):
    size = np.array([1.0, 0.5, 0.25])
    values = [np.array([3.0, -1.0]) + np.array([0.2, 0.1]) * h**rate for h in size]
    exact = np.linalg.norm([0.2, 0.1]) * size[-1] ** rate
    assert remaining(values, size) == pytest.approx(exact, rel=1e-9)  # round-off


@pytest.mark.parametrize("rate", [2.5, 3.6])
def test_remaining_error_is_not_flattered(rate):
    """Faster than the second power is not believed."""
    size = np.array([1.0, 0.5, 0.25])
    values = [np.array([1.0 + 0.3 * h**rate]) for h in size]
    assert 0.3 * size[-1] ** rate < remaining(values, size) < 12 * 0.3 * size[-1] ** rate


def test_a_last_change_that_vanishes_by_chance_counts():
    values = [np.array([v]) for v in (1.1, 1.02, 1.02)]
    assert remaining(values, [1.0, 0.5, 0.25]) == pytest.approx(0.08 / 3 / 4)
    assert remaining(values[:2], [1.0, 0.5]) == pytest.approx(0.08)


def test_two_best_that_disagree_widen_the_band():
    values = {(m, s): np.array([1.0 + s * 0.1 + 0.01 * 0.5**m]) for m in range(3) for s in (0, 1)}
    best, error = most_trusted(values, [1.0, 0.5, 0.25])
    assert best[0] == 2
    assert error == pytest.approx(0.1, rel=0.1)
    with pytest.raises(xc.ProblemError, match="no setting ran on two meshes"):
        most_trusted({(1, 0): np.ones(1), (0, 1): np.ones(1)}, [1.0, 0.5])


def test_another_scene_is_no_reference():
    values = {
        (m, s): np.array([1.0 + s + 0.1 * (1 - s) * 0.5**m]) for m in range(2) for s in (0, 1)
    }
    assert most_trusted(values, [1.0, 0.5])[0] == (1, 1)
    assert most_trusted(values, [1.0, 0.5], left_out=[1]) == ((1, 0), pytest.approx(0.05))


def circle(n, start, front=0):
    """A function of the angle at the vertices of a closed front."""
    angle = start + 2 * np.pi * np.arange(n) / n
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    values = np.stack([np.cos(angle), 1 + np.sin(2 * angle)], axis=1)
    group = np.stack([np.zeros(n, int), np.full(n, front)], axis=1)
    return Sampled(values, points, group, np.zeros(n, dtype=bool))


def test_fronts_are_compared_place_by_place():
    fine, coarse = circle(90, 0.31), circle(40, 2.13)
    exact, result = fine.values, at_places(coarse, fine).reshape(-1, 2)
    bend = np.array([1, 4])  # second derivatives; linear interpolation errs by h²/8 of them
    assert np.all(np.abs(result - exact).max(axis=0) < 1.1 * (2 * np.pi / 40) ** 2 / 8 * bend)
    with pytest.raises(xc.ProblemError, match=r"1 tip\(s\) or front\(s\) here.*finer meshes"):
        at_places(circle(40, 0.2), circle(90, 0.1, front=1))


def test_places_at_a_free_surface_are_left_out():
    fine = circle(90, 0.31)
    some = Sampled(fine.values, fine.points, fine.group, np.arange(90) < 30)
    assert len(at_places(circle(40, 0.2), some)) == 2 * 60


# Scenes ----------------------------------------------------------------------------------------

TIP = (0.083, 0.047)


@pytest.fixture(scope="module")
def williams():
    """A chart of an edge crack whose K is known."""
    problem, _ = scenes.williams_edge(6, TIP, 0.12, seed=2381, K=tuple(K))
    settings = {"linear": {"order": 1}, "two": {"functions": 2}, "wrong": {"points": 99}}
    meshes = [problem.mesh, refine(problem.mesh)]
    return xc.chart(problem, settings, meshes=meshes, wanted=1e-2, repeat=1, progress=False)


def test_errors_are_those_of_the_exact_solution(williams):
    """Discretisation: the estimate bounds the error of the reference, and so that of all others."""
    size = np.linalg.norm(K)
    left = np.linalg.norm(williams.reference.values - K) / size
    assert williams.reference.setting == "as given"
    assert williams.reference.mesh == 1
    assert left < williams.reference_error < 1e-3
    for row in williams.good:
        true = np.linalg.norm(row.values - K) / size
        assert abs(row.error - true) < 1.01 * williams.reference_error
        assert row.seconds > 0
        assert row.unknowns > 0


def test_failures_are_recorded(williams):
    assert len(williams.rows) == 8
    assert {row.setting for row in williams.failed} == {"wrong"}
    assert all("points = 99" in row.failed for row in williams.failed)
    assert "failed: ProblemError" in williams.table()


def test_advice_can_be_solved(williams):
    best = williams.best()
    assert best
    assert best.row is not None
    assert best.row.error + williams.reference_error <= 1e-2
    assert best.row.seconds == min(
        r.seconds for r in williams.good if r.error + williams.reference_error <= 1e-2
    )
    result = scenes.K_of(best.problem)[0]
    assert np.allclose(result, best.row.values, rtol=1e-12)
    assert str(best) in str(williams)
    none = williams.best(1e-12)
    assert not none
    assert "known to" in str(none)
    assert "give finer meshes" in str(none)
    with pytest.raises(xc.ProblemError, match="None of the 6 runs reaches 1e-12"):
        _ = none.problem


def test_picture(williams, tmp_path):
    file = williams.plot(tmp_path / "new" / "chart")
    assert file == tmp_path / "new" / "chart.png"
    assert file.stat().st_size > 10_000
    figure = williams.plot(show=False)
    (axes,) = figure.axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    low, high = axes.get_ylim()
    assert low < williams.reference_error < max(row.error for row in williams.good) < high
    assert "linear" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_meshes_of_a_function():
    asked = []

    def maker(h):
        asked.append(h)
        return xc.box((-1, -1), (1, 1), round(2 / h))

    scene = xc.Problem(xc.box((-1, -1), (1, 1), 4), STEEL, loads=PULL)
    result = xc.chart(
        scene,
        [{"order": 1}],
        meshes=maker,
        states=[1.0, 2.0],
        quantity=lambda states: [s.energy for s in states],
        repeat=1,
        seconds=1e-6,
        progress=False,
    )
    assert np.allclose(asked, [0.5, 0.25])
    # Constant stress: every run is exact, to round-off.
    assert max(row.error for row in result.rows) < 1e-10
    assert result.reference.values[1] == pytest.approx(4 * result.reference.values[0])
    assert result.quantity == "quantity"
    assert "<" in result.table()


def test_without_tips_the_energy_is_compared():
    scene = xc.Problem(xc.box((-1, -1), (1, 1), 3), STEEL, loads=PULL)
    result = xc.chart(scene, repeat=1, seconds=1e-6, progress=False)
    assert {row.setting for row in result.rows} == {"as given", "order 1"}
    # Energy of a constant stress: area (1 - nu²) / 2 E.
    assert result.reference.values[0] == pytest.approx(2 * (1 - 0.3**2))
    assert result.quantity == "strain energy"


@pytest.mark.slow
def test_default_settings_vary_what_is_there():
    crack = xc.line_crack([(-1.2, 0.03), (0.0, 0.03)])
    scene = xc.Problem(xc.box((-1, -1), (1, 1), 6), STEEL, [crack], loads=PULL)
    result = xc.chart(scene, repeat=1, seconds=1e-6, progress=False)
    names = {row.setting for row in result.rows}
    assert names == {"as given", "order 1", "radius × 0.7", "radius × 1.4", "topological",
                     "domain 1.5 radii", "2 functions", "adapt"}  # fmt: skip
    assert not result.failed
    by_name = {row.setting: row for row in result.rows if row.mesh == 1}
    ratio = by_name["radius × 1.4"].fields["radius"] / by_name["radius × 0.7"].fields["radius"]
    assert ratio == pytest.approx(2.0)
    assert any(row.warnings for row in result.rows if row.mesh == 0)


def edge_plate(n=5):
    crack = xc.line_crack([(-1.2, 0.03), (0.0, 0.03)])
    return xc.Problem(xc.box((-1, -1), (1, 1), n), STEEL, [crack], loads=PULL)


def test_adapt_is_a_line_of_the_chart(tmp_path):
    """Each tolerance a row with a mesh of its own; its best K is nearer than the tolerance."""
    tolerances = [1e-2, 3e-4]
    result = xc.chart(
        edge_plate(), [{"functions": 2}], tolerances=tolerances, wanted=2e-3,
        repeat=1, seconds=1e-6,
        meshes=[xc.box((-1, -1), (1, 1), n) for n in (8, 16, 32)], progress=False,
        file=tmp_path / "chart.png",
    )  # fmt: skip
    rows = [row for row in result.rows if row.setting == "adapt"]
    assert [row.fields["tolerance"] for row in rows] == tolerances
    assert not result.failed
    for row in rows:
        assert row.mesh == -1
        assert row.seconds > 0
        assert row.error <= row.fields["tolerance"] + result.reference_error
        assert row.problem.order == 2
    assert rows[1].unknowns >= rows[0].unknowns
    assert "adapt 0.01" in result.table()
    assert "'adapt 0.0003' (h = " in str(rows[1])
    assert result.reference.setting == "as given"
    alone = Chart(tuple(rows), result.reference, result.reference_error, "K")
    assert "Take xc.adapt(problem, tolerance=0.0" in str(alone.best(1e-2))
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def test_adapt_with_states_and_a_quantity_of_ones_own():
    """A quantity sees what solve would return: a list where there are states."""
    result = xc.chart(
        edge_plate(), [{"functions": 2}], tolerances=[0.05], states=[0.5, 1.0],
        repeat=1, seconds=1e-6,
        quantity=lambda states: [s.energy for s in states], progress=False,
    )  # fmt: skip
    row = result.rows[-1]
    assert row.setting == "adapt"
    assert row.values[1] == pytest.approx(4 * row.values[0])
    assert row.error < 0.1


def test_contact_is_compared_but_no_reference():
    """Crack faces that overlap have K_I = -K where those that touch have none: an error of 1."""
    crack = xc.line_crack([(-1.2, 0.03), (0.0, 0.03)])
    body = xc.Problem(xc.box((-1, -1), (1, 1), 5), STEEL, [crack], loads=PULL)
    off, states = [{"contact": "off"}], [1.0, -1.0]
    result = xc.chart(body, off, states=states, seconds=1e-6, repeat=1, progress=False)
    assert result.reference.setting == "as given"
    errors = [row.error for row in result.rows if row.setting == "contact off"]
    assert np.allclose(errors, 1.0, atol=0.05)  # discretisation


@pytest.mark.slow
def test_penny():
    """A penny under tension in a small block: K_I is uniform but for the sides of the block."""
    scene = xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), 6),
        xc.Isotropic(1.0, 0.3),
        [xc.penny_crack((0.02, 0.03, 0.04), (0, 0, 1), 0.5)],
        loads=[xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))],
    )
    meshes = [xc.box((-1, -1, -1), (1, 1, 1), n) for n in (6, 9, 13)]
    result = xc.chart(
        scene, [{"functions": 2}], meshes=meshes, wanted=0.1, repeat=1, progress=False
    )
    assert not result.failed
    assert result.reference.mesh == 2
    assert result.reference_error < 0.05
    assert result.best()
    infinite = 2 * np.sqrt(0.5 / np.pi)
    K_I = result.reference.values.reshape(-1, 3)[:, 0]
    assert 1.0 < K_I.mean() / infinite < 1.15  # finite block: above that of an infinite body


# Advice and bad input --------------------------------------------------------------------------


def row(setting, mesh, seconds, error, **options):
    return ChartRow(setting, {}, mesh, 1.0 / 2**mesh, 100, seconds, error, np.ones(1), **options)


def test_pareto_and_advice():
    rows = (
        row("a", 0, 0.1, 0.1), row("b", 0, 0.2, 0.2), row("a", 1, 0.3, 0.001),
        row("b", 1, 0.4, 0.0), row("c", 0, math.nan, math.nan, failed="no"),
    )  # fmt: skip
    chart = Chart(rows, rows[3], 0.002, "K")
    assert chart.pareto == (rows[0], rows[2])  # below 0.002 the reference cannot tell
    assert chart.best(0.2).row is rows[0]
    assert chart.best(0.1).row is rows[2]
    assert chart.best(0.0025).row is rows[3]
    assert not chart.best(0.0015)
    with pytest.raises(xc.ProblemError, match="wanted = None: give a relative error"):
        chart.best()
    assert "K to 0.01: 'a' on mesh 1" in str(chart)


def scene(n=3):
    return xc.Problem(xc.box((-1, -1), (1, 1), n), STEEL, loads=PULL)


BAD = {
    "no problem": (lambda: xc.chart(3), "chart: problem = 3: give a Problem"),
    "settings": (lambda: xc.chart(scene(), 3), "give a list of dicts"),
    "one dict": (lambda: xc.chart(scene(), {"order": 1}), "give a list of dicts"),
    "no dict": (lambda: xc.chart(scene(), ["order"]), "'order' is no dict of fields"),
    "field": (lambda: xc.chart(scene(), [{"odrer": 1}]), "'odrer' is no choice.*one of order"),
    "scene": (lambda: xc.chart(scene(), [{"mesh": 1}]), "Meshes go into meshes="),
    "twice": (lambda: xc.chart(scene(), [{"order": 1}, {"order": 1}]), "'order 1' stands.*twice"),
    "tolerance": (lambda: xc.chart(scene(), tolerances=[2.0]), r"chart: tolerances\[0\] = 2.0"),
    "tiny": (lambda: xc.chart(edge_plate(), tolerances=[1e-9]), "give 1e-06 or more"),
    "no tips": (lambda: xc.chart(scene(), tolerances=[0.1]), "no crack has a tip"),
    "wanted": (lambda: xc.chart(scene(), wanted=0), "chart: wanted = 0 is not possible"),
    "repeat": (lambda: xc.chart(scene(), repeat=0), "repeat = 0.*whole number"),
    "seconds": (lambda: xc.chart(scene(), seconds="1"), "seconds = '1'.*number above 0"),
    "quantity": (lambda: xc.chart(scene(), quantity="K"), "give a function"),
    "one mesh": (lambda: xc.chart(scene(), meshes=[scene().mesh]), "two or more meshes"),
    "no meshes": (lambda: xc.chart(scene(), meshes="fine"), "two or more meshes"),
    "dimension": (
        lambda: xc.chart(scene(), meshes=[xc.box((0, 0, 0), (1, 1, 1), n) for n in (1, 2)]),
        "must have 2 dimensions",
    ),
    "order of meshes": (
        lambda: xc.chart(scene(), meshes=[scene(4).mesh, scene(3).mesh]),
        "number 1 has cells of .* from coarse to fine",
    ),
    "maker": (lambda: xc.chart(scene(), meshes=lambda h: h), "returned float: .*return a Mesh"),
    "zero": (
        lambda: xc.chart(scene(), quantity=lambda s: 0.0, seconds=1e-6, repeat=1),
        "zero in the reference.*give another",
    ),
    "words": (
        lambda: xc.chart(scene(), quantity=lambda s: "high", seconds=1e-6, repeat=1),
        "no setting ran.*quantity returned = 'high'",
    ),
    "nan": (
        lambda: xc.chart(scene(), quantity=lambda s: math.nan, seconds=1e-6, repeat=1),
        "no setting ran on two meshes.*not finite",
    ),
    "shapes": (
        lambda: xc.chart(scene(), quantity=lambda s: s.u, seconds=1e-6, repeat=1),
        "no setting ran on two meshes.*return as many",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case):
    call, words = BAD[case]
    with pytest.raises(xc.ProblemError, match=words):
        call()


def test_progress(capsys):
    xc.chart(scene(), repeat=1, seconds=1e-6, progress="always")
    assert "2 meshes, 2 settings" in capsys.readouterr().err
