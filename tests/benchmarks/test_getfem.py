"""GetFEM's XFEM in the charts: what it gives where it is, what is printed where it is not."""

from __future__ import annotations

import ast
import gc
import json
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

from benchmarks import __main__, charts, quoted, runs
from benchmarks.baselines import getfem_runs, getfem_script
from benchmarks.baselines.getfem_runs import GetfemError, Worker
from benchmarks.runs import Outcome
from benchmarks.scenes import exact_fields
from benchmarks.suites import cases as suites

LINUX = sys.platform.startswith("linux")


@pytest.fixture
def absent(monkeypatch):
    monkeypatch.setenv(getfem_runs.VARIABLE, "none")


@pytest.fixture(scope="module")
def worker():
    getfem = getfem_runs.installed()
    if getfem is None:
        pytest.skip(getfem_runs.missing())
    process = Worker((getfem.python, str(getfem_runs.SCRIPT)))
    yield process
    process.stop()


def program(*lines):
    """A process that runs these lines of Python."""
    return Worker((sys.executable, "-c", "\n".join(("import sys, time", *lines))), patience=30.0)


def ask(worker, scene, n, order, seed=None):
    return worker.ask({"scene": scene, "n": n, "order": order, "seed": seed})


@pytest.mark.parametrize(
    ("scene", "order", "errors"),
    [
        ("edge", 1, {"K": 6e-3, "energy": 0.1}),
        ("edge", 2, {"K": 6e-4, "energy": 5e-3}),
        ("closed", 1, {"K_II": 6e-3, "K_I": 6e-3, "pressure": 3e-3}),
        ("closed", 2, {"K_II": 6e-4, "K_I": 2e-3, "pressure": 6e-4}),
        ("half_closed", 1, {"K_I": 0.01, "K_I, closed tip": 0.03, "pressure": 0.35}),
        ("half_closed", 2, {"K_I": 1.5e-3, "K_I, closed tip": 2e-3, "pressure": 0.06}),
    ],
)
@pytest.mark.parametrize("seed", [None, 7])
def test_getfem_solves_the_scenes(worker, scene, order, errors, seed):
    """Discretisation, with 21 cells a side: about half of each was measured."""
    answer = ask(worker, scene, 21, order, seed)
    print(f"\n{answer}")
    assert set(answer["errors"]) == set(errors)
    for name, bound in errors.items():
        assert 0 < answer["errors"][name] < bound, name
    assert 0 < answer["processor"]


def test_unknowns_are_those_that_are_quoted(worker):
    by_name = quoted.QUOTED["edge"]
    for order, name in ((1, "GetFEM 5.4 XFEM, Q1, radius"), (2, "GetFEM 5.4 XFEM, Q2, radius")):
        n = 21
        assert ask(worker, "edge", n, order)["unknowns"] in [p[0] for p in by_name[name]]


def test_errors_of_getfem_fall_with_the_mesh(worker):
    """Discretisation: 1.9e-2 and 2.6e-3 were measured for K, 0.108 and 0.052 for the energy."""
    coarse, fine = (ask(worker, "edge", n, 1, 3)["errors"] for n in (11, 21))
    assert fine["K"] < 0.4 * coarse["K"]
    assert fine["energy"] < 0.6 * coarse["energy"]


def test_getfem_is_a_series_like_others(worker):
    cases = [c for c in suites.cases("edge", quick=True) if c.series.startswith("GetFEM")]
    assert {c.series for c in cases} == {"GetFEM XFEM, Q1", "GetFEM XFEM, Q2"}
    start = perf_counter()
    outcome, wall, processor = runs.timed(cases[-1], 1)
    assert 0 < wall < perf_counter() - start
    assert (wall, processor) == outcome.took
    assert not LINUX or runs.memory(cases[-1]) > 1.0  # 16 MB were measured


def test_scene_that_getfem_cannot_solve_is_reported(worker):
    """No node lies within the radius of a tip: there is nothing to enrich, and no factor."""
    with pytest.raises(GetfemError, match="could not solve this scene: RuntimeError"):
        ask(worker, "half_closed", 5, 2)
    assert ask(worker, "edge", 11, 1)["unknowns"] == 436  # and the process lives


def test_without_getfem_one_line_says_how_to_install_it(absent, tmp_path, capsys):
    assert getfem_runs.installed() is None
    cases = suites.cases("edge", quick=True)
    assert cases
    assert not [c for c in cases if c.series.startswith("GetFEM")]
    rows = [row("default", "default", k) for k in (1, 2)]
    record = {"scene": "edge", "clock": "wall", "rows": rows}
    (tmp_path / "edge.json").write_text(json.dumps(record))
    words = ["--draw", "edge", "--out", str(tmp_path), "--figures", str(tmp_path)]
    assert __main__.main(words) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "GetFEM" in line]
    assert len(lines) == 1
    assert "skipped" in lines[0]
    assert "apt-get install python3-getfem" in lines[0]
    assert (tmp_path / "edge.png").stat().st_size > 10_000


def row(series, kind, k, error="K"):
    return {
        "series": series, "kind": kind, "size": f"n = {k}", "unknowns": 10 * k, "wall": 1.0 * k,
        "processor": 1.0 * k, "MB": 1.0, "errors": {error: 0.1 / k},
    }  # fmt: skip


def test_what_ran_is_not_quoted(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(
        charts, "to_draw", lambda *a: drawn.append(quoted.to_draw(*a)) or drawn[-1]
    )  # fmt: skip
    rows = [row("default", "default", k) for k in (1, 2)]
    live = [row("GetFEM XFEM, Q2", "baseline", k) for k in (1, 2)]
    for some in (rows, rows + live):
        charts.draw({"scene": "edge", "clock": "wall", "rows": some}, tmp_path)
    before, now = drawn
    assert before == quoted.QUOTED["edge"]
    assert [name for name in before if name not in now] == [
        "GetFEM 5.4 XFEM, Q1, radius", "GetFEM 5.4 XFEM, Q2, radius",
    ]  # fmt: skip


def test_every_baseline_is_compared_with():
    rows = [
        row("default", "default", 2), row("conforming, remeshed", "baseline", 1),
        row("GetFEM XFEM, Q1", "baseline", 3), row("GetFEM XFEM, Q2", "baseline", 4),
    ]  # fmt: skip
    groups = [{r["series"] for r in some} for some, kind in __main__._groups(rows)]
    assert groups[-2:] == [
        {"default", "conforming, remeshed"},
        {"default", "GetFEM XFEM, Q1", "GetFEM XFEM, Q2"},
    ]  # fmt: skip


def test_process_keeps_to_one_thread(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    worker = program(
        "import json, os", "sys.stdin.readline()",
        "print(json.dumps({k: v for k, v in os.environ.items() if 'THREAD' in k}), flush=True)",
    )  # fmt: skip
    assert set(worker.ask({}).values()) == {"1"}


def test_process_that_ends_is_reported_and_started_anew():
    worker = program("sys.stdin.readline()", "sys.exit('out of memory')")
    numbers = []
    for _ in range(2):
        numbers.append(worker.number())
        with pytest.raises(GetfemError, match=r"ended \(1: out of memory\).*GETFEM_PYTHON"):
            worker.ask({"scene": "edge"})
    assert numbers[0] != numbers[1]


def test_process_that_is_gone_before_it_is_asked():
    worker = program("sys.exit(3)")
    with pytest.raises(GetfemError, match=r"ended \(3\)"):
        worker.ask({"scene": "edge"})


def test_python_that_is_not_there():
    with pytest.raises(GetfemError, match=r"could not be started.*GETFEM_PYTHON"):
        Worker(("/nowhere/python",)).ask({})


@pytest.mark.parametrize("answer", ["print('Trace 2 in model')", "print('[1, 2]')"])
def test_rubbish_is_reported(answer):
    worker = program("sys.stdin.readline()", answer, "sys.stdout.flush()", "sys.stdin.readline()")
    with pytest.raises(GetfemError, match=r"answered .*GETFEM_PYTHON"):
        worker.ask({"scene": "edge"})


def test_answer_that_never_comes():
    worker = Worker((sys.executable, "-c", "import time; time.sleep(60)"), patience=0.3)
    with pytest.raises(GetfemError, match=r"no answer within 0.3 s.*GETFEM_PYTHON"):
        worker.ask({"scene": "edge"})


def test_process_ends_with_its_owner():
    worker = program("sys.stdin.read()")
    worker.number()
    process = worker._process
    del worker
    gc.collect()
    assert process.poll() == 0


def test_chart_goes_on_without_a_process_that_dies():
    worker = program("sys.exit('broken')")
    cases = [
        runs.Case("GetFEM XFEM, Q1", "baseline", "n = 1", lambda seed: worker.ask({})),
        runs.Case("default", "default", "n = 1", lambda seed: Outcome({"K": 0.1}, 7)),
    ]
    messages = []
    assert [r["series"] for r in runs.measure(cases, 1, messages.append)] == ["default"]
    assert len(messages) == 1
    assert messages[0].startswith(
        "GetFEM XFEM, Q1, n = 1: GetfemError: the process of GetFEM ended"
    )


def test_what_getfem_prints_is_no_answer(tmp_path, monkeypatch):
    """A module that prints, as GetFEM does from C++, and knows nothing."""
    (tmp_path / "getfem.py").write_text(
        "import os\n"
        "def util_trace_level(level): os.write(1, b'Trace 1\\n'); print('Trace 2', flush=True)\n"
        "util_warning_level = util_trace_level\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    worker = Worker((sys.executable, str(getfem_runs.SCRIPT)))
    for request in ({"scene": "edge", "n": 5, "order": 1, "seed": None}, {}):
        with pytest.raises(GetfemError, match=r"could not solve this scene: (Attribute|Key)Error"):
            worker.ask(request)
    worker.stop()


def test_script_stands_alone():
    tree = ast.parse(Path(getfem_script.__file__).read_text(encoding="utf-8"))
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add((node.module or "").partition(".")[0])
    assert names - set(sys.stdlib_module_names) == {"getfem", "numpy"}


def test_fields_of_the_script_are_those_of_the_charts():
    """Round-off: two ways to write the same closed form."""
    x = np.random.default_rng(50321).uniform(-1.5, 1.5, (60, 2))
    for K, pressure in (((1.0, 0.5), 0.0), ((0.0, 0.5), 1.0)):
        u, sigma = exact_fields.edge_fields(K, pressure)
        assert getfem_script.williams(K, pressure, x.T).T == pytest.approx(u(x), abs=1e-13)
        computed = getfem_script.stress_of(getfem_script.williams_gradient(K, x))
        assert computed - pressure * np.eye(2) == pytest.approx(sigma(x), abs=1e-11)
    u, K_I, end = exact_fields.partial_closure(0.0)
    assert getfem_script.bent(x.T).T == pytest.approx(u(x), abs=1e-12)
    assert getfem_script.OPENING * np.sqrt(np.pi * getfem_script.OPENING) == pytest.approx(K_I)
    along = np.linspace(-1, 1, 41)
    wanted = exact_fields.closure_pressure(along, 0.0)
    assert getfem_script.bent_pressure(along) == pytest.approx(wanted, abs=1e-14)
    assert end == pytest.approx(1 - 2 * getfem_script.OPENING)
