"""The charts: fronts, the opponent, and the default settings on the front of the quick run."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import exact
import scenes
from xcrack.bench import conforming, fields, pareto

ROOT = Path(__file__).resolve().parent.parent
WITHIN = 1.2  # of the least time: two runs of one case on a busy machine differ by as much


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
        row("b", "setting", 4.0, 1e-3), row("c", "opponent", 8.0, 1e-3),
    ]  # fmt: skip
    assert pareto.behind(rows, "K", "wall", ("setting",), 1e-3) == (2.0, "a")
    assert pareto.behind(rows, "K", "wall", ("opponent",), 1e-3) == (0.25, "c")
    assert pareto.behind(rows, "K", "wall", ("mesh",), 1e-3) == (0.0, "")


def test_fields_are_those_of_the_catalogue():
    """Round-off: two ways to write the same closed form."""
    rng = np.random.default_rng(40961)
    x, X = rng.uniform(-1.5, 1.5, (40, 2)), rng.uniform(-1, 1, (40, 3))
    u, sigma = fields.edge_fields((1.0, 0.5))
    wanted, stress = exact.williams(x[:, 0], x[:, 1], 1.0, 0.3, 1.0, 0.5)
    assert u(x) == pytest.approx(wanted, abs=1e-13)
    assert sigma(x)[:, [0, 1, 0], [0, 1, 1]] == pytest.approx(stress, abs=1e-12)
    for s_m in (0.0, 0.25):
        u, K, end = fields.partial_closure(s_m)
        middle, c, K_exact = exact.partial_closure_params(1.0, s_m, 1.0)
        wanted, _ = exact.partial_closure(x[:, 0], x[:, 1], 1.0, 1.0, 0.3, s_m, sxx=s_m + middle)
        assert u(x) == pytest.approx(wanted, abs=1e-12)
        assert (K, end) == pytest.approx((K_exact, middle - c))
    for tension, shear in ((1.0, 0.0), (-1.0, 0.4)):
        S = np.array([[0, 0, shear], [0, 0, 0], [shear, 0, tension]])
        wanted = exact.penny(X, 0.5, 1.0, 0.3, S)
        assert fields.penny(0.5, tension, shear)(X) == pytest.approx(wanted, abs=1e-13)


@pytest.mark.gmsh
def test_opponent_is_a_worthy_one():
    """Discretisation: quarter-point triangles of 3.4 k unknowns are good to 1.2e-4 (measured)."""
    pytest.importorskip("skfem")
    K, unknowns = conforming.edge(conforming.Grading(0.01, 0.3, 0.2), (1.0, 0.5))
    assert unknowns < 4000
    assert pytest.approx([1.0, 0.5], rel=2e-4) == K


@pytest.mark.gmsh
def test_opponent_splits_a_crack_that_kinks():
    pytest.importorskip("skfem")
    turn = scenes.rows(1.1)[0]
    crack = np.array([[-1.0, 0.0], [-0.5, 0.2], [-0.4, 0.3], np.array([-0.4, 0.3]) + 0.2 * turn])
    points, cells, tip = conforming.cracked_square(crack, conforming.Grading(0.02, 0.3, 0.2))
    x = points[cells]
    first, second = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert area.sum() == pytest.approx(4.0)  # round-off
    assert points[tip] == pytest.approx(crack[-1])
    # One body, one hole of area zero: edges of one cell only are the sides and both lips.
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    once = unique[count == 1]
    length = np.hypot(*(points[once[:, 1]] - points[once[:, 0]]).T).sum()
    lips = np.hypot(*np.diff(crack, axis=0).T).sum()
    assert length == pytest.approx(8.0 + 2 * lips)


@pytest.mark.slow
@pytest.mark.mission
def test_default_settings_lie_on_the_front(tmp_path):
    run = subprocess.run(
        [sys.executable, "-m", "xcrack.bench", "--quick", "--out", "r", "--figures", "f"],
        cwd=tmp_path, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True,
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
