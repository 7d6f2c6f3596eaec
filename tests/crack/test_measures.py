"""Depth, surface lengths and ends of cracks against the shapes they were made of."""

import csv
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from xcrack import GeometryError, ProblemError

BOX = xc.box((0, 0, 0), (10, 10, 6), (14, 14, 9))
CELL = 10 / 14


def ellipse(centre: tuple[float, float, float], a: float, b: float):
    return xc.measures(xc.elliptic_crack(centre, (0, 1, 0), (1, 0, 0), a, b), BOX)


def by_name(m) -> dict[str, tuple[float, float]]:
    return {t.name: (t.length, t.depth) for t in m.traces}


def test_a_semi_ellipse_has_its_depth_and_its_length() -> None:
    m = ellipse((5, 5.03, 6), 3, 2)
    # A tenth of a cell is wanted; chords of the 128 points are what is left.
    assert m.depth == pytest.approx(2, abs=1e-3 * CELL)
    assert by_name(m)["top"] == pytest.approx((6, 2), abs=1e-3 * CELL)
    assert m.area == pytest.approx(np.pi * 6 / 2, rel=1e-3)
    assert [e.name for e in m.ends] == ["top", "top"]
    x = sorted(e.x for e in m.ends)
    np.testing.assert_allclose(x, [(2, 5.03, 6), (8, 5.03, 6)], atol=1e-3 * CELL)
    assert "on 'top': length 6" in str(m)


def test_a_corner_crack_has_two_lengths_and_ends_on_two_sets() -> None:
    m = ellipse((0, 5.03, 6), 3, 2)
    assert by_name(m)["top"] == pytest.approx((3, 2), abs=0.01 * CELL)
    assert by_name(m)["left"] == pytest.approx((2, 3), abs=0.01 * CELL)
    assert {e.name: e.x for e in m.ends}["left"] == pytest.approx((0, 5.03, 4), abs=0.01 * CELL)
    assert {e.name: e.x for e in m.ends}["top"] == pytest.approx((3, 5.03, 6), abs=0.01 * CELL)


def test_after_break_through_both_surfaces_have_their_lengths() -> None:
    m = ellipse((5, 5.03, 6), 3, 7)
    below = 2 * 3 * np.sqrt(1 - (6 / 7) ** 2)
    assert by_name(m)["top"][0] == pytest.approx(6, abs=0.01 * CELL)
    assert by_name(m)["bottom"][0] == pytest.approx(below, abs=0.05 * CELL)
    assert sorted(e.name for e in m.ends) == ["bottom", "bottom", "top", "top"]
    assert {e.front for e in m.ends} == {0, 1}


def test_a_crack_inside_and_one_through_all() -> None:
    inside = ellipse((5, 5.03, 3), 3, 2)
    assert np.isnan(inside.depth)
    assert inside.traces == inside.ends == ()
    through = ellipse((5, 5.03, 3), 20, 20)
    assert set(by_name(through)) == {"left", "right", "top", "bottom"}
    assert through.ends == ()
    assert through.front_length == 0
    assert by_name(through)["top"] == pytest.approx((10, 6), abs=0.1 * CELL)
    assert by_name(through)["left"] == pytest.approx((6, 10), abs=0.1 * CELL)


def test_a_slanted_crack_at_a_bore() -> None:
    """A plane that cuts a round bore at 45°: the trace is half an ellipse."""
    n = 48
    angle = 2 * np.pi * np.arange(n) / n
    radii = np.geomspace(2.0, 7.0, 8)
    flat = (radii[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], 1)).reshape(-1, 2)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    rows = [
        np.concatenate([np.stack([k * n + i, k * n + n + i, k * n + j], 1),
                        np.stack([k * n + j, k * n + n + i, k * n + n + j], 1)])
        for k in range(7)
    ]  # fmt: skip
    low = np.sort(np.concatenate(rows), axis=1)
    m, layers = len(flat), 10
    points = np.column_stack([np.tile(flat, (layers + 1, 1)), np.repeat(np.linspace(-4, 4, 11), m)])
    a, b, c = np.concatenate([low + k * m for k in range(layers)]).T
    cells = [[a, b, c, c + m], [a, b, b + m, c + m], [a, a + m, b + m, c + m]]
    bare = xc.Mesh(points, np.concatenate([np.stack(x, 1) for x in cells]))
    facets = bare.boundary
    bore = (np.linalg.norm(points[facets][..., :2], axis=2) < 2.001).all(axis=1)
    mesh = xc.Mesh(points, bare.cells, {"bore": facets[bore]})
    normal = np.array([-1, 0, 1]) / np.sqrt(2)
    crack = xc.elliptic_crack((2.0, 0.03, 2.0), normal, (0, 1, 0), 1.2, 1.0)
    measures = xc.measures(crack, mesh)
    assert {e.name for e in measures.ends} == {"bore"}
    radius = [np.hypot(*e.x[:2]) for e in measures.ends]
    np.testing.assert_allclose(radius, 2, atol=2 * (1 - np.cos(np.pi / n)) + 1e-6)  # polygon
    assert [t.name for t in measures.traces] == ["bore"]
    chord = np.linalg.norm(np.subtract(*(e.x for e in measures.ends)))
    assert chord < measures.traces[0].length < 1.3 * chord
    assert measures.depth == pytest.approx(1.0, abs=0.1)


def test_rows_of_fronts_have_their_measures_and_both_ends() -> None:
    """A corner crack: one front that ends on two faces, and its depth below each of them."""
    x = np.zeros((4, 3))
    crack = xc.elliptic_crack((0, 5.03, 6), (0, 1, 0), (1, 0, 0), 3, 2)
    problem = xc.Problem(BOX, xc.Isotropic(E=1e3, nu=0.3), [crack])
    sif = xc.SIF(
        x=x, frame=np.tile(np.eye(3), (4, 1, 1)), K=np.ones((4, 3)), T=x[:, 0], spread=x,
        s=np.arange(4.0), front=np.zeros(4, int), at_surface=x[:, 0] > 0, closed=x[:, 0] > 0,
        domain_cells=x[:, 0],
    )  # fmt: skip
    none = (np.zeros(4),)
    step = xc.Step(0, 0.0, problem.placed, ((sif,),), none, none, none, none, none)
    (row,) = xc.History((step,), "", mesh=BOX).table(measures=True)
    assert (row["depth_top"], row["depth_left"]) == pytest.approx((2, 3), abs=0.01 * CELL)
    assert (row["length_top"], row["length_left"]) == pytest.approx((3, 2), abs=0.01 * CELL)
    assert row["area"] == pytest.approx(np.pi * 6 / 4, rel=2e-3)
    ends = {row[f"end_{k}_set"]: [row[f"end_{k}_{i}"] for i in "xyz"] for k in range(2)}
    assert ends["top"] == pytest.approx([3, 5.03, 6], abs=0.01 * CELL)
    assert ends["left"] == pytest.approx([0, 5.03, 4], abs=0.01 * CELL)


def test_lines_end_on_sets_by_name() -> None:
    mesh = xc.box((0, 0), (1, 1), 9)
    edge = xc.measures(xc.line_crack([(-0.1, 0.51), (0.3, 0.51), (0.4, 0.6)]), mesh)
    assert edge.area == pytest.approx(0.3 + np.hypot(0.1, 0.09))
    assert edge.depth == pytest.approx(np.hypot(0.4, 0.09))
    assert [(e.name, e.x) for e in edge.ends] == [("left", pytest.approx((0, 0.51)))]
    through = xc.measures(xc.line_crack([(-0.1, 0.51), (1.1, 0.51)]), mesh)
    assert sorted(e.name for e in through.ends) == ["left", "right"]
    inside = xc.measures(xc.line_crack([(0.3, 0.51), (0.6, 0.51)]), mesh)
    assert inside.ends == ()


def test_what_cannot_be_measured_says_so() -> None:
    with pytest.raises(GeometryError, match="a crack of 2D needs a body of 2D, not 3D"):
        xc.measures(xc.line_crack([(0.3, 0.5), (0.6, 0.5)]), BOX)
    with pytest.raises(GeometryError, match="measures: crack = 3: give Crack"):
        xc.measures(3, BOX)
    with pytest.raises(xc.XcrackError):
        xc.measures(xc.elliptic_crack((50, 5, 6), (0, 1, 0), (1, 0, 0), 1, 1), BOX)


@pytest.mark.slow
@pytest.mark.mission
def test_a_run_has_tables_of_measures(tmp_path: Path) -> None:
    mesh = xc.box((0, 0), (1, 2), (10, 20))
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E=2e5, nu=0.3, plane="stress"),
        cracks=[xc.line_crack([(-0.1, 1.03), (0.3, 1.03)])],
        loads=[xc.traction("top", (0, 1.0)), xc.traction("bottom", (0, -1.0))],
    )
    steps = xc.grow(
        problem, xc.paris(1e-10, 3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=0.1, max_steps=2,
        progress=False,
    )  # fmt: skip
    history = xc.collect(steps)
    rows, ends = history.measures(mesh)
    assert rows["depth_left"] == pytest.approx([0.3, 0.4, 0.5][: len(rows)], abs=1e-3)
    assert set(ends["set"]) == {"left"}
    whole = xc.History(history.steps, history.ended, mesh=mesh)
    table = whole.table(measures=True)
    assert table.dtype.names[: len(whole.table().dtype.names)] == whole.table().dtype.names
    assert table["depth"] == pytest.approx(rows["depth"])
    assert table["depth_left"] == pytest.approx(table["a"], rel=1e-6)  # it turns a little
    assert (table["end_0_set"] == "left").all()
    assert table["end_0_x"] == pytest.approx(0.0, abs=1e-12)
    assert table["end_0_y"] == pytest.approx(1.03, abs=1e-12)
    assert (table["end_1_set"] == "").all()
    assert np.isnan(table["end_1_x"]).all()
    whole.plot("measures", file=tmp_path / "measures.png")
    with pytest.raises(ProblemError, match="read without its mesh: give"):
        xc.History(history.steps, history.ended).table(measures=True)
    whole.write(tmp_path / "out")
    with open(tmp_path / "out" / "ends.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert lines[0]["set"] == "left"
    assert (tmp_path / "out" / "measures.csv").exists()
    with pytest.raises(ProblemError, match="without its mesh"):
        xc.History(history.steps, history.ended).measures()


def test_depth_after_a_break_through():
    """Of a half penny in a wall of 1: its radius, then the thickness, and it never falls."""
    mesh = xc.box((0, 0, 0), (1, 3, 3), (8, 24, 24))
    for radius in (0.6, 0.9, 1.05, 1.2, 1.3):
        m = xc.measures(xc.penny_crack((0, 1.5, 1.513), (0, 0, 1), radius), mesh)
        assert m.depth == pytest.approx(min(radius, 1.0), rel=5e-3)  # chords of the front
