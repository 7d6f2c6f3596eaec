"""Histories read off: as table, picture and files."""

import csv
import sys
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from support.growth_fakes import fake_solution
from support.growth_runs import *  # noqa: F403 - fixtures come by name
from support.growth_runs import N_STEPS, run_of
from xcrack import History, ProblemError, collect, grow, load


def test_table(whole, tmp_path):
    table = whole.table()
    assert table.dtype.names == (
        *("step", "N", "crack", "tip", "id", "x", "y", "a"),
        *("K_I_min", "K_II_min", "K_I_max", "K_II_max", "spread"),
        *(name for name in ("domain_cells",) if hasattr(whole.steps[0].sif[0][0], name)),
        *("angle", "dK_eq", "R", "rate", "da"),
    )
    assert len(table) == 2 * N_STEPS
    last = whole.steps[-1]
    row = table[-1]
    assert (row["step"], row["crack"], row["tip"]) == (N_STEPS - 1, 1, 0)
    assert row["N"] == last.cycles == whole.life
    assert (
        row["K_II_max"] == last.sif[1][1].K[0, 1] == last.sif[last.states.index("max")][1].K_II[0]
    )
    assert table["K_II_1"].tolist() == table["K_II_max"].tolist()  # by number, as in older scripts
    with pytest.raises(ProblemError, match=r"no column 'K_II': it has step, N, .*K_II_max"):
        table["K_II"]
    assert whole.names == ("tip of crack 0", "tip of crack 1")
    assert row["id"] == 1
    assert (row["x"], row["y"]) == tuple(last.cracks[1].points[-1])
    assert row["da"] == last.da[1][0]
    first = table[table["step"] == 0]
    assert first["a"] == pytest.approx([5.0, np.hypot(4.1, 0.2)], rel=1e-12)
    # of first order every step makes its crack longer by its da
    table = collect(grow(**run_of(integrator="euler")), tmp_path / "euler").table()
    own = table[table["crack"] == 0]
    assert np.diff(own["a"]) == pytest.approx(own["da"][:-1], rel=1e-10)


def test_printed(whole):
    """The main columns in rows, all others by name; a step in one line."""
    head, names, *rows = str(whole).splitlines()
    assert head == repr(whole)
    assert names.split() == [*("step", "N", "crack", "tip", "x", "y", "a"), "K_I_max", "K_II_max"]
    assert len(rows) == 2 * N_STEPS
    last = whole.steps[-1]
    assert rows[-1].split()[-2] == f"{last.sif[1][1].K_I[0]:.6g}"
    assert f"N = {last.cycles:.6g}" in repr(last)
    assert "\n" not in repr(last)
    text = str(whole.table())
    assert max(map(len, text.splitlines())) <= 118
    for name in whole.table().dtype.names:
        assert name in text.replace("\n", " ")
    assert str(whole.table()[["step", "a"]]).splitlines()[0].split() == ["step", "a"]


def test_columns_that_say_how_far_K_is_to_be_trusted(whole):
    """The largest spread of all states and modes; domains are known where K says so."""
    steps = []
    for step in whole.steps:
        sif = []
        for k, state in enumerate(step.sif):
            crack = replace(state[0], spread=np.array([[0.1 * step.index, 1.0 - k]]))
            object.__setattr__(crack, "domain_cells", np.array([3.0 - k]))
            other = replace(state[1])
            object.__setattr__(other, "domain_cells", np.array([2.0]))
            sif.append((crack, other))
        steps.append(replace(step, sif=tuple(sif)))
    table = History(tuple(steps), "").table()
    first = table[table["crack"] == 0]
    assert first["spread"].tolist() == [max(0.1 * k, 1.0) for k in range(N_STEPS)]
    assert first["domain_cells"].tolist() == [2.0] * N_STEPS
    assert "spread" in whole.table().dtype.names


def test_empty_history():
    nothing = History((), "never began")
    assert len(nothing.table()) == 0
    assert nothing.life == 0
    assert nothing.cracks == ()
    with pytest.raises(ProblemError, match="nothing to draw"):
        nothing.plot("K")


def test_loaded_history_is_the_same(whole):
    loaded = load(whole.path)
    assert loaded.table().tobytes() == whole.table().tobytes()
    assert loaded.ended == whole.ended == f"max_steps = {N_STEPS} reached"
    assert loaded.steps[1].solutions == ()
    assert not loaded.steps[1].sif[0][0].K.flags.writeable


def test_pictures(whole, tmp_path):
    for kind in ("K", "a", "path"):
        figure = whole.plot(kind, file=tmp_path / "pictures" / f"{kind}.png")
        assert (tmp_path / "pictures" / f"{kind}.png").stat().st_size > 5000
        labels = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
        assert any("crack 1" in label for label in labels)
    with pytest.raises(ProblemError, match="plot kind = 'N'"):
        whole.plot("N")


def test_write_with_solutions_and_without(whole, tmp_path, monkeypatch):
    def write(solution, path):
        files = [path.with_name(path.name + ".vtu"), path.with_name(path.name + "_lips.vtp")]
        for file in files:
            file.write_text("<VTKFile/>")
        return files

    monkeypatch.setitem(sys.modules, "xcrack.output.vtk", SimpleNamespace(write=write))
    solved = replace(whole.steps[1], solutions=(fake_solution(), fake_solution()))
    mixed = replace(whole, steps=(load(whole.path).steps[0], solved))
    mixed.write(tmp_path / "out")
    with open(tmp_path / "out" / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    assert float(rows[3]["K_II_max"]) == mixed.table()["K_II_1"][3]  # all digits
    sets = list(ElementTree.parse(tmp_path / "out" / "history.pvd").getroot().iter("DataSet"))
    assert [s.get("file") for s in sets] == [
        "steps/step_00000_cracks.vtp",
        "steps/step_00001_state_0.vtu",
        "steps/step_00001_state_0_lips.vtp",
        "steps/step_00001_state_1.vtu",
        "steps/step_00001_state_1_lips.vtp",
    ]
    assert [s.get("timestep") for s in sets] == ["0", "1", "1", "1", "1"]
    for s in sets:
        assert (tmp_path / "out" / s.get("file")).exists()
    piece = ElementTree.parse(tmp_path / "out/steps/step_00000_cracks.vtp").find(".//Piece")
    assert (piece.get("NumberOfPoints"), piece.get("NumberOfLines")) == ("4", "2")
    lines = piece.find(".//Lines/DataArray[@Name='connectivity']").text.split()
    assert lines == ["0", "1", "2", "3"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"steps": 3}, "History: steps = 3"),
        ({"steps": ("step",)}, "'step' among the steps is not a Step"),
        ({"ended": None}, "ended = None"),
        ({"path": 3}, "History: path = 3 is not a path"),
        ({"mesh": "mesh"}, "mesh = 'mesh': give a Mesh"),
    ],
)
def test_histories_that_cannot_be(changes, words):
    with pytest.raises(ProblemError, match=words):
        History(**{"steps": (), "ended": "", **changes})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"index": -1}, "Step: index = -1"),
        ({"cycles": "many"}, "Step: cycles = 'many'"),
        ({"cracks": (1, 2)}, "give a tuple of Crack"),
        ({"sif": ((1, 2),)}, "give SIF"),
        ({"angle": (np.zeros(2), np.zeros(1))}, r"\[2, 1\].* one for each tip"),
        ({"rate": 3.0}, "Step: rate = 3.0: give a list"),
        ({"plan": {}}, "that is made by grow"),
    ],
)
def test_steps_that_cannot_be(whole, changes, words):
    with pytest.raises(ProblemError, match=words):
        replace(whole.steps[0], **changes)


def test_what_the_system_refuses_to_write(whole, tmp_path):
    """A file in the place of a folder, a folder in the place of a file, odd names."""
    (tmp_path / "file").write_text("")
    (tmp_path / "out" / "history.csv").mkdir(parents=True)
    (tmp_path / "a.png").mkdir()
    for call, words in (
        (lambda: whole.write(tmp_path / "file"), "cannot be written as a whole to .*File exists"),
        (lambda: whole.write(tmp_path / "out"), "cannot be written as a whole .*Is a directory"),
        (lambda: whole.write("a\0b"), "NUL"),
        (lambda: whole.write(None), "is not a path"),
        (lambda: whole.plot("K", tmp_path / "a.png"), r"a\.png'?: Is a directory"),
        (lambda: whole.plot("K", tmp_path / "file" / "b.png"), "Not a directory|File exists"),
        (lambda: whole.plot("K", tmp_path / "b.xyz"), r"b\.xyz.*ends in .*png"),
        (lambda: whole.plot("K", tmp_path / ("x" * 300 + ".png")), "too long"),
        (lambda: whole.plot(["K"], tmp_path / "c.png"), "plot kind"),
    ):
        with pytest.raises(ProblemError, match=words):
            call()
