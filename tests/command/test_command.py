"""The command line: each command, its exit status, and what a wrong input says."""

import os
import subprocess
import sys

import pytest

import xcrack as xc
from xcrack.__main__ import main

pytestmark = [
    pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning"),
    pytest.mark.usefixtures("blank_pictures"),
]


@pytest.fixture(autouse=True)
def _by_matplotlib(monkeypatch):
    monkeypatch.setattr("xcrack.view.pyvista.can_render", lambda: False)
    monkeypatch.setattr("xcrack.app.info.can_render", lambda: False)


def test_info_lists_what_there_is(capsys):
    assert main(["info"]) == 0
    out = capsys.readouterr().out
    assert f"xcrack            {xc.__version__}" in out
    assert "matplotlib only" in out
    known = xc.info()
    assert known.packages["numpy"]
    assert known.warm_seconds is None
    with pytest.raises(xc.ProblemError, match="warm = 1"):
        xc.info(warm=1)


@pytest.mark.slow
def test_warm_compiles_the_kernels(capsys):
    assert main(["info", "--warm"]) == 0
    assert "kernels ready in" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.mission
def test_demo_leaves_a_report(tmp_path, capsys):
    assert main(["demo", str(tmp_path / "demo")]) == 0
    page, printed = tmp_path / "demo" / "report.html", capsys.readouterr()
    assert "solving" in printed.err
    assert str(page.resolve()) in printed.out
    assert "closed crack at a hole" in page.read_text(encoding="utf-8")


def test_demo_needs_no_mesh_generator(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    assert xc.demo(tmp_path).is_file()


def test_verify_says_how_it_went(tmp_path, capsys, monkeypatch):
    assert main(["verify", "--quick", "-k", "cycle-rule", "-o", str(tmp_path / "book.html")]) == 0
    assert "1 cases in 0 s: all right" in capsys.readouterr().out
    assert (tmp_path / "book.html").is_file()
    monkeypatch.setattr(
        "xcrack.verification.book.cases.lives.cycles_between",
        lambda a0, a1, r0, r1: (a1 - a0) / r0,
    )
    assert main(["verify", "--quick", "-k", "cycle-rule"]) == 1
    assert "FAILED" in capsys.readouterr().out
    assert main(["verify", "-k", "nothing"]) == 2
    assert "no case has 'nothing'" in capsys.readouterr().err


def test_mesh_converts(tmp_path, capsys):
    xc.write_mesh(tmp_path / "a.msh", xc.box((0, 0), (1, 1), 3))
    assert main(["mesh", str(tmp_path / "a.msh"), str(tmp_path / "b.inp")]) == 0
    assert len(xc.read_mesh(tmp_path / "b.inp").cells) == 18
    assert main(["mesh", str(tmp_path / "none.msh"), str(tmp_path / "b.inp")]) == 2
    assert "none.msh" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_life_of_a_stored_run(tmp_path, capsys):
    from reporting.test_report import edge

    folder = tmp_path / "run"
    history = edge(path=folder)
    looks = ["--interval", str(0.3 * history.life), "--pod", "0.7", "0.3"]
    strength = ["--toughness", "200", "--nu", "0.3"]
    page = tmp_path / "life.html"
    given = ["life", str(folder), "--scatter", "0.3", "--samples", "1000", "--unit", "flight"]
    assert main([*given, *looks, *strength, "-o", str(page)]) == 0
    out = capsys.readouterr().out
    for words in (f"life {history.life:.4g} flights", "chance that all of them miss", "at last"):
        assert words in out
    assert page.is_file()
    results = tmp_path / "results"  # as a case file leaves them
    results.mkdir()
    folder.rename(results / "steps")
    assert main(["life", str(results), *given[2:]]) == 0
    given[1] = str(results)
    capsys.readouterr()
    assert main([*given, "--toughness", "200"]) == 2
    assert "give --nu" in capsys.readouterr().err
    assert main([*given, "--pod", "0.7", "0.3"]) == 2
    assert "give --detect or --interval" in capsys.readouterr().err
    assert main(["life", str(tmp_path / "none"), "--scatter", "0.3"]) == 2
    assert "holds no run" in capsys.readouterr().err


@pytest.mark.drawn
@pytest.mark.slow
@pytest.mark.mission
def test_run_report_and_chart(tmp_path, capsys):
    from casefile.test_casefile import GROWTH

    case = tmp_path / "case.toml"
    case.write_text(GROWTH.replace("max_steps = 3", "max_steps = 2"), encoding="utf-8")
    assert main(["run", str(case)]) == 0
    assert "case_results" in capsys.readouterr().out
    assert main(["run", str(case)]) == 2
    assert "overwrite=True" in capsys.readouterr().err
    assert main(["run", str(case), "--resume"]) == 0
    folder = tmp_path / "case_results"
    (folder / "report.html").unlink()
    assert main(["plot", str(folder), "a"]) == 0
    assert (folder / "a.png").stat().st_size > 5e3
    assert main(["life", str(folder), "--scatter", "0.2", "--samples", "200"]) == 0
    assert "90 %" in capsys.readouterr().out
    assert main(["report", str(folder), "--units", "N, mm, MPa"]) == 0
    assert "MPa√mm" in (folder / "report.html").read_text(encoding="utf-8")
    case.write_text(GROWTH.replace("nu = 0.3", "nuu = 0.3"), encoding="utf-8")
    assert main(["run", str(case)]) == 2
    assert "line 15" in capsys.readouterr().err
    script = tmp_path / "scene.py"
    script.write_text("scene = 1\n")
    assert main(["chart", str(script)]) == 2
    assert "makes nothing that is called `problem`" in capsys.readouterr().err


def test_ctrl_c_ends_it(monkeypatch, capsys):
    def interrupted(**options):
        raise KeyboardInterrupt

    monkeypatch.setattr("xcrack.app.info.info", interrupted)
    assert main(["info"]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_python_m_xcrack(tmp_path):
    def run(*words):
        return subprocess.run([sys.executable, "-m", "xcrack", *words], cwd=tmp_path,
                              capture_output=True, text=True, check=False,
                              env={**os.environ, "PYTHONIOENCODING": "utf-8"})  # fmt: skip

    assert run("--version").stdout.strip() == f"xcrack {xc.__version__}"
    assert run("verify", "--quick", "-k", "cycle-rule").returncode == 0
    nothing = run("mesh", "a.msh", "b.msh")
    assert nothing.returncode == 2
    assert "Traceback" not in nothing.stderr
    assert run().returncode == 2
