"""The charts: fronts, baselines, and the default settings on the front of the quick run."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from benchmarks import __main__, charts, pareto, runs
from benchmarks.baselines import conforming_2d, conforming_3d, conforming_growth
from benchmarks.runs import Outcome
from benchmarks.scenes import bodies, exact_fields, friction, growth, material
from benchmarks.suites import cases
from support import scenes_2d as scenes
from support import scenes_friction
from xcrack.verification.exact import plates

ROOT = Path(__file__).resolve().parents[2]
WITHIN = 1.3  # of the least time: two runs of one case beside other tests differ by as much


def test_every_script_finds_what_it_imports():
    """Scenes of tests that move take nothing along; in a process of its own, since scripts set up
    theirs."""
    script = (
        "import importlib, pkgutil, sys, benchmarks\n"
        "sys.path.insert(0, 'tests')\n"
        "for each in pkgutil.walk_packages(benchmarks.__path__, 'benchmarks.'):\n"
        "    if 'getfem_script' not in each.name:\n"  # it runs in a Python that has GetFEM
        "        importlib.import_module(each.name)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr


def test_front_keeps_what_nothing_beats():
    points = [(3.0, 0.1), (1.0, 1.0), (2.0, 2.0), (4.0, 0.2), (5.0, 0.01)]
    assert pareto.front(points) == [(1.0, 1.0), (3.0, 0.1), (5.0, 0.01)]


def test_time_at_an_error_is_read_in_logarithms():
    points = [(1.0, 1e-1), (10.0, 1e-3)]
    assert pareto.time_at(points, 1e-2) == pytest.approx(math.sqrt(10.0))  # round-off
    assert pareto.time_at(points, 1.0) == 1.0
    assert pareto.time_at(points, 1e-4) == math.inf


def test_luck_on_one_mesh_does_not_count():
    points = [(1.0, 0.1), (2.0, 1e-6), (4.0, 0.01)]
    assert pareto.settled(points) == [(1.0, 0.1), (2.0, 0.01), (4.0, 0.01)]


def test_behind_names_who_is_ahead():
    def row(series, kind, time, error):
        return {"series": series, "kind": kind, "wall": time, "errors": {"K": error}}

    rows = [
        row("default", "default", 2.0, 1e-3), row("a", "setting", 1.0, 1e-3),
        row("b", "setting", 4.0, 1e-3), row("c", "baseline", 8.0, 1e-3),
    ]  # fmt: skip
    assert pareto.behind(rows, "K", "wall", ("setting",), 1e-3) == (2.0, "a")
    assert pareto.behind(rows, "K", "wall", ("baseline",), 1e-3) == (0.25, "c")
    assert pareto.behind(rows, "K", "wall", ("mesh",), 1e-3) == (0.0, "")


def test_field_of_the_edge_is_that_of_the_textbooks():
    """Round-off: r and theta as Anderson (Fracture Mechanics, tables 2.1 and 2.2) has them."""
    x = np.random.default_rng(40961).uniform(-1.5, 1.5, (40, 2))
    r, theta = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    c, s, kappa = np.cos(theta / 2), np.sin(theta / 2), material.KOLOSOV
    c3, s3 = np.cos(1.5 * theta), np.sin(1.5 * theta)
    one = np.stack([c * (kappa - 1 + 2 * s**2), s * (kappa + 1 - 2 * c**2)], axis=1)
    two = np.stack([s * (kappa + 1 + 2 * c**2), -c * (kappa - 1 - 2 * s**2)], axis=1)
    moved = (np.sqrt(r / (2 * np.pi)) / (2 * material.MU))[:, None] * (one + 0.5 * two)
    xx = c * (1 - s * s3) - 0.5 * s * (2 + c * c3)
    yy = c * (1 + s * s3) + 0.5 * s * c * c3
    xy = c * s * c3 + 0.5 * c * (1 - s * s3)
    stress = np.array([[xx, xy], [xy, yy]]) / np.sqrt(2 * np.pi * r)
    u, sigma = exact_fields.edge_fields((1.0, 0.5), 2.0)
    squeezed = -2.0 * 1.3 * 0.4 * x  # (1 + nu) (1 - 2 nu) p / E
    assert u(x) == pytest.approx(moved + squeezed, abs=1e-13)
    assert sigma(x) == pytest.approx(stress.transpose(2, 0, 1) - 2.0 * np.eye(2), abs=1e-12)


def test_field_of_the_hole_is_that_of_the_package():
    """Round-off; the line that the load is turned with carries the pressure and no shear."""
    rng = np.random.default_rng(40961)
    x = rng.uniform(1, 3, 40)[:, None] * scenes.rows(0.0)[0] @ scenes.rows(0.7)
    x = np.concatenate([x, rng.uniform(1, 3, (40, 2))])
    wanted = scenes.turned(
        lambda x, y: plates.kirsch(x, y, 1.0, 1.0, 0.3, s=-1.0, alpha=np.pi / 2), (0, 0), 0.7
    )
    assert exact_fields.kirsch(0.7)(x) == pytest.approx(wanted(x)[1], abs=1e-12)
    across = np.array([scenes.rows(0.7)[1]] * 40)
    traction = np.einsum("qij,qj->qi", exact_fields.kirsch(0.7)(x[:40]), across)
    pressure = exact_fields.kirsch_pressure(np.hypot(*x[:40].T))
    assert traction == pytest.approx(-pressure[:, None] * across, abs=1e-12)


def test_field_of_the_crack_that_slips_is_that_of_the_package():
    """Round-off; what is locked after the load is gone is what sliding backwards leaves."""
    x = np.random.default_rng(40961).uniform(-2, 2, (40, 2))
    path = (friction.LOADED, friction.UNLOADED)
    locked = scenes_friction.effective_shear([tau for tau, _ in path], [1.0, 1.0], 0.3)
    assert locked == pytest.approx([effective for _, effective in path])
    for tau, effective in path:
        wanted = scenes.turned(scenes_friction.sliding(effective, tau, 1.0), (0.05, -0.07), 0.31)
        field = exact_fields.sliding(effective, tau, 1.0, (0.05, -0.07), 0.31)
        assert field(x) == pytest.approx(wanted(x)[0], abs=1e-12)


def busy(seconds):
    """Use the processor."""
    end = process_time() + seconds
    while process_time() < end:
        pass


def test_what_is_no_part_of_the_work_is_not_timed():
    def later():
        busy(0.3)
        return {"energy": 0.5}

    def run(seed):
        busy(0.02)
        return Outcome({"K": 0.1}, 7, later=later)

    case = runs.Case("default", "default", "n = 1", run, prepare=lambda: busy(0.3))
    outcome, wall, processor = runs.timed(case, 1)
    assert outcome == Outcome({"K": 0.1, "energy": 0.5}, 7)
    assert 0.02 <= processor < 0.2
    assert wall >= 0.02  # a loaded machine may take any time


def test_rows_have_the_errors_that_come_later():
    case = runs.Case("a", "default", "", lambda seed: Outcome({}, 7, later=lambda: {"K": seed}))
    messages = []
    broken = runs.Case("b", "setting", "", case.run, prepare=lambda: 1 / 0)
    rows = runs.measure([case, broken], 2, messages.append)
    assert [(r["series"], r["errors"]) for r in rows] == [("a", {"K": 2})]
    assert messages == ["b, : ZeroDivisionError: division by zero"]


def first(scene, series="default"):
    """Outcome of the coarsest run of a series."""
    case = next(c for c in cases.cases(scene, quick=True) if c.series == series)
    return runs.timed(case, 1)[0]


@pytest.mark.parametrize(
    ("scene", "errors"),
    [
        ("edge", {"K": 1.5e-3, "energy": 0.04}),
        ("half_closed", {"K_I": 2e-3, "K_I, closed tip": 0.05, "pressure": 0.2}),
        ("rubbing", {"K_II": 8e-4, "pressure": 1.5e-3}),
        ("unloading", {"K_II": 8e-4, "pressure": 1e-3}),
        ("penny_closed", {"K_II, K_III": 0.025, "K_I": 0.2}),
        pytest.param("hole", {"pressure": 0.01, "energy": 0.02}, marks=pytest.mark.gmsh),
        ("growth", {"tip": 0.03, "path": 0.02}),
        ("life", {"life": 0.05}),
        pytest.param(
            "cylinder", {"K_I": 0.02, "closed share": 0.25},
            marks=[pytest.mark.gmsh, pytest.mark.slow],
        ),
    ],
)  # fmt: skip
def test_coarsest_run_of_a_scene(scene, errors):
    """Discretisation: about half of each was measured."""
    measured = first(scene).errors
    print(f"\n{scene}: {measured}")
    for name, bound in errors.items():
        assert 0 < measured[name] < bound, name


@pytest.mark.gmsh
def test_contact_that_is_off_has_no_pressure():
    assert "pressure" not in first("hole", "contact off").errors


@pytest.mark.gmsh
def test_meshes_that_are_shared_have_nothing_of_a_run():
    mesh = bodies.plate(5)
    first("hole")
    assert bodies.plate(5) is mesh
    assert "edges" in dir(mesh)
    assert "_edges_and_map" not in vars(mesh)


def test_life_is_the_integral_of_the_law():
    """Interpolation: a cubic through the logarithms of four rates, instead of a quartic of K."""
    a = np.linspace(0.2, 0.5, 4)
    K = np.sqrt(np.pi * a) * [plates.PLATE_EDGE[1.0, round(v, 1)] for v in a]
    logs = np.polynomial.Polynomial.fit(a, np.log(1 / (1e-3 * K**3)), 3)
    fine = np.linspace(0.2, 0.5, 2001)
    assert growth.exact_life() == pytest.approx(np.trapezoid(np.exp(logs(fine)), fine), 2e-3)


@pytest.mark.gmsh
def test_path_ends_where_steps_of_no_length_would_end_it():
    """First order: twice the steps, half of the distance (1.93 was measured)."""
    pytest.importorskip("skfem")
    grading = conforming_2d.Grading(0.02, 0.3, 0.15)
    coarse, fine = (conforming_growth.grown(grading, k).errors for k in (5, 10))
    assert "tip" not in coarse
    assert 1.8 < coarse["path"] / fine["path"] < 2.1


@pytest.mark.gmsh
def test_baseline_lives_as_long():
    """Discretisation; the count of cycles between seven steps is wrong by half a per cent."""
    pytest.importorskip("skfem")
    outcome = first("life", "conforming, remeshed")
    assert outcome.errors["life"] < 0.05
    grading = conforming_2d.Grading(0.005, 0.3, 0.1)
    assert conforming_growth.life(grading, 7, 1).errors["life"] < 0.008


@pytest.mark.gmsh
def test_energy_of_the_baseline_falls_with_the_mesh():
    """Discretisation: 5.0e-2 and 1.5e-2 were measured."""
    pytest.importorskip("skfem")
    stress, errors = exact_fields.edge_fields((1.0, 0.5))[1], []
    for grading in (conforming_2d.Grading(0.1, 0.5, 0.4), conforming_2d.Grading(0.01, 0.3, 0.2)):
        basis, u = conforming_2d.edge_solution(grading, (1.0, 0.5))
        errors.append(conforming_2d.energy_error(basis, u, stress))
        assert conforming_2d.energy_error(basis, 0 * u, stress) == pytest.approx(1.0)
    assert errors[0] < 0.08
    assert errors[1] < 0.4 * errors[0]


def test_every_scene_has_a_chart_and_errors_to_compare_at(tmp_path):
    assert set(__main__._WANTED) == set(cases.ALL) == set(charts._TITLES)
    rows = [
        {
            "series": name, "kind": kind, "size": size, "unknowns": 10 * k, "wall": 1.0 * k,
            "processor": 1.0 * k, "MB": None, "errors": {"K": 0.1 / k, "energy": 0.2 / k},
        }
        for name, kind in (("default", "default"), ("a", "setting"))
        for k, size in ((1, "n = 1"), (2, "n = 2"))
    ]  # fmt: skip
    rows.append({**rows[0], "series": "b", "kind": "steps", "errors": {"path": 0.1}})
    drawn = charts.draw({"scene": "edge", "clock": "wall", "rows": rows}, tmp_path)
    assert [p.name for p in drawn] == ["edge.png", "edge_energy.png"]


@pytest.mark.parametrize("scene", cases.ALL)
def test_record_of_the_page_can_be_drawn_again(scene):
    record = __main__._read(ROOT / "benchmarks" / "results" / f"{scene}.json")
    kinds = {"default", "setting", "mesh", "steps", "baseline", "off"}
    assert {row["kind"] for row in record["rows"]} <= kinds
    assert {name for row in record["rows"] for name in row["errors"]} >= set(
        __main__._WANTED[scene]
    )


@pytest.mark.gmsh
def test_baseline_is_accurate():
    """Discretisation: quarter-point triangles of 3.4 k unknowns are good to 1.2e-4 (measured)."""
    pytest.importorskip("skfem")
    K, unknowns = conforming_2d.edge(conforming_2d.Grading(0.01, 0.3, 0.2), (1.0, 0.5))
    assert unknowns < 4000
    assert pytest.approx([1.0, 0.5], rel=2e-4) == K


@pytest.mark.gmsh
@pytest.mark.slow
def test_baseline_has_K_along_a_front():
    """Discretisation: .8 % along the front of 9 k unknowns was measured, .6 % in the mean."""
    pytest.importorskip("skfem")
    errors = conforming_3d.penny(conforming_2d.Grading(0.15, 0.7, 0.7), 0).errors
    assert errors["K_I"] < errors["rms"] < 0.012  # a mean is no worse than its parts


@pytest.mark.gmsh
def test_baseline_splits_a_crack_that_kinks():
    pytest.importorskip("skfem")
    turn = scenes.rows(1.1)[0]
    crack = np.array([[-1.0, 0.0], [-0.5, 0.2], [-0.4, 0.3], np.array([-0.4, 0.3]) + 0.2 * turn])
    points, cells, tip = conforming_2d.cracked_square(crack, conforming_2d.Grading(0.02, 0.3, 0.2))
    x = points[cells]
    first, second = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert area.sum() == pytest.approx(4.0)  # round-off
    assert points[tip] == pytest.approx(crack[-1])
    # One body, one hole of area zero: edges of one cell only are the sides and both crack faces.
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    once = unique[count == 1]
    length = np.hypot(*(points[once[:, 1]] - points[once[:, 0]]).T).sum()
    face = np.hypot(*np.diff(crack, axis=0).T).sum()
    assert length == pytest.approx(8.0 + 2 * face)


def test_programs_of_time_by_part_follow_the_code(capsys):
    pytest.importorskip("resource")  # not on Windows
    from benchmarks import parts, solid

    parts.run(8)
    row = capsys.readouterr().out.strip("| \n").split(" | ")
    assert len(row) == len(parts.PARTS) + 3
    assert int(row[0]) > 500
    measured = solid.measure(5)
    assert set(measured["seconds"]) > {"bulk", "enriched cells", "contact", "K"}
    assert min(measured["steps"]) > 0


@pytest.mark.slow
@pytest.mark.mission
def test_default_settings_lie_on_the_front(tmp_path):
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks", "--quick", "--repeats", "9",  # medians of 20 ms
         "--out", str(tmp_path / "r"),
         "--figures", str(tmp_path / "f")],
        cwd=ROOT, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    print(run.stdout)
    record = json.loads((tmp_path / "r" / "edge.json").read_text(encoding="utf-8"))
    assert record["machine"]["versions"]["numpy"] == np.__version__
    for error in (1e-3, 2e-4):
        ratio, ahead = pareto.behind(record["rows"], "K", record["clock"], ("setting",), error)
        assert ratio <= WITHIN, f"{ahead} needs {1 / ratio:.2f} of the time at {error:g}"
    for name in ("edge", "closed", "closed_cost"):
        assert (tmp_path / "f" / f"{name}.png").stat().st_size > 10_000
