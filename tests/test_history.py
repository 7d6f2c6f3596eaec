"""Histories: on disk step by step, taken up again to the last bit, as table, picture and files."""

import csv
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from growth_fakes import mode_I, patch_respond, plate
from xcrack.crack.crack import line_crack
from xcrack.errors import ProblemError, XcrackWarning
from xcrack.growth import fingerprint as settings
from xcrack.growth.criteria import max_hoop_stress, weighted_angle
from xcrack.growth.fingerprint import describe, differences
from xcrack.growth.laws import paris
from xcrack.growth.options import Run
from xcrack.growth.run import grow
from xcrack.growth.step import Cycle
from xcrack.history import run_folder as run_files
from xcrack.history import store
from xcrack.history.history import History, collect, load, resume
from xcrack.scene import conditions

LAW = paris(C=1e-11, m=3.0)
CYCLE = Cycle(0.0, 1.0)
N_STEPS = 5


def both_modes(problem, c):
    """K of two cracks that turn: all digits of every array are in use."""
    K_I = mode_I()(problem, c)[0][0]
    return [[K_I * (1.0 + 0.31 * c), K_I * 0.217 * (-1) ** len(problem.placed[c].points)]]


@cache
def scene():
    return plate([line_crack([(0, 8.3), (5, 8.3)]), line_crack([(0, -8.3), (4.1, -8.5)])])


def run_of(problem=None, **changes):
    """Arguments of a run, the same for grow and resume."""
    options = {"da": 1.7, "max_steps": N_STEPS, "law": LAW, "criterion": weighted_angle}
    options |= {"cycle": CYCLE, "problem": problem or scene(), **changes}
    return options


@pytest.fixture
def formula(monkeypatch):
    patch_respond(monkeypatch, both_modes)


@pytest.fixture
def whole(formula, tmp_path):
    """A run that nothing disturbed."""
    return collect(grow(**run_of()), tmp_path / "whole")


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def assert_same(history, expected):
    """Equal to the last bit: the numbers, and the files."""
    assert history.ended == expected.ended
    assert history.table().tobytes() == expected.table().tobytes()
    for a, b in zip(history.cracks, expected.cracks):
        assert a.points.tobytes() == b.points.tobytes()
        assert a.tips == b.tips
    assert content(history.path) == content(expected.path)


# --- to disk and on ----------------------------------------------------------------------------


def test_each_step_is_on_disk_before_the_next_begins(formula, tmp_path):
    seen = []

    def steps():
        for step in grow(**run_of()):
            seen.append(len(list(tmp_path.glob("step_*.npz"))))
            yield step

    history = collect(steps(), tmp_path)
    assert seen == list(range(N_STEPS))
    assert len(history.steps) == N_STEPS
    assert not list(tmp_path.glob(".*"))  # nothing half done is left
    assert json.loads((tmp_path / "run.json").read_text())["versions"]["numpy"] == np.__version__


class Killed(BaseException):
    """Stands for SIGKILL: nothing may catch it and tidy up."""


class Saboteur:
    """Dies at the n-th call that touches the disk, a write at half of its bytes."""

    def __init__(self, monkeypatch, n):
        self.n, self.count = n, 0
        real_open = open
        # no power is cut here: to wait for the disk would only take time
        real = {"fsync": lambda number: None, "replace": os.replace}

        def opened(path, mode="r", **rest):
            self.tick()
            file = real_open(path, mode, **rest)
            write = file.write
            if "w" in mode:
                # a BufferedWriter has no settable write: a thin stand-in has
                return Half(
                    file,
                    lambda data: (self.tick(lambda: write(data[: len(data) // 2])), write(data)),
                )
            return file

        def wrapped(name):
            def call(*arguments):
                self.tick()
                return real[name](*arguments)

            return call

        monkeypatch.setattr(store, "open", opened, raising=False)
        for name in real:
            monkeypatch.setattr(store.os, name, wrapped(name))

    def tick(self, last_deed=lambda: None):
        self.count += 1
        if self.count == self.n:
            last_deed()
            raise Killed


class Half:
    def __init__(self, file, write):
        self.file, self.write = file, write

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.file.close()  # what the system does with a dead process' files

    def __getattr__(self, name):
        return getattr(self.file, name)


def test_killed_between_any_two_writes(whole, tmp_path):
    """Every place where the disk is touched, from the first to the last."""
    with pytest.MonkeyPatch.context() as patch:
        counter = Saboteur(patch, 0)
        collect(grow(**run_of()), tmp_path / "count")
    assert counter.count == 5 * (N_STEPS + 2)
    for n in range(1, counter.count + 1):
        folder = tmp_path / f"killed_{n}"
        with pytest.MonkeyPatch.context() as patch:
            Saboteur(patch, n)
            with pytest.raises(Killed):
                collect(grow(**run_of()), folder)
        assert_same(resume(folder, **run_of()), whole)


def test_killed_again_while_it_resumes(whole, tmp_path):
    folder = tmp_path / "killed"
    n, done = 9, False
    while not done:
        with pytest.MonkeyPatch.context() as patch:
            Saboteur(patch, n)
            try:
                history = (
                    resume(folder, **run_of())
                    if folder.exists()
                    else collect(grow(**run_of()), folder)
                )
                done = True
            except Killed:
                n += 1
    assert_same(history, whole)


@pytest.mark.parametrize("keep", [0, 1, 100])
@pytest.mark.parametrize("index", [0, 2, N_STEPS - 1])
def test_a_step_that_is_cut_short_is_computed_again(whole, tmp_path, index, keep):
    path = run_files.step_path(whole.path, index)
    before = content(whole.path)
    path.write_bytes(path.read_bytes()[: keep * path.stat().st_size // 101])
    with pytest.warns(XcrackWarning, match=rf"{path.name} is not whole"):
        history = resume(whole.path, **run_of())
    assert content(whole.path) == before
    assert history.table().tobytes() == whole.table().tobytes()


def test_left_over_parts_are_swept_away(whole):
    (whole.path / ".step_00003.npz.part").write_bytes(b"half")
    (whole.path / "notes.txt").write_text("the user's own")
    resume(whole.path, **run_of())
    assert not (whole.path / ".step_00003.npz.part").exists()
    assert (whole.path / "notes.txt").exists()


CHILD = """
import sys
from pathlib import Path
sys.path[:0] = {paths!r}
import pytest
from growth_fakes import patch_respond
from test_history import both_modes, collect, grow, run_of
with pytest.MonkeyPatch.context() as patch:
    patch_respond(patch, both_modes)
    def steps():
        for step in grow(**run_of()):
            print(step.index, flush=True)
            yield step
            if step.index == 2:
                print("wait", flush=True)
                sys.stdin.read()
    collect(steps(), sys.argv[1])
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has no SIGKILL")
def test_a_real_kill(whole, tmp_path):
    folder = tmp_path / "real"
    script = CHILD.format(paths=[str(Path(__file__).parent), *sys.path])
    child = subprocess.Popen(
        [sys.executable, "-c", script, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    for line in child.stdout:
        if line.strip() == "wait":
            break
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    child.stdin.close()
    assert child.returncode == -signal.SIGKILL
    assert len(list(folder.glob("step_*.npz"))) == 3
    history = resume(folder, **run_of())
    # the cracks and numbers; the header names the same script by another module
    assert_same(history, whole)


def test_until_and_the_rules_that_stop_a_run_may_change(formula, whole, tmp_path):
    folder = tmp_path / "short"
    first = collect(grow(**run_of()), folder, until=lambda step: step.index == 1)
    assert first.ended == "until was true at step 1"
    again = resume(folder, **run_of(), until=lambda step: step.index >= 1)
    assert (len(again.steps), again.ended) == (2, first.ended)
    longer = resume(folder, **run_of(max_steps=3))
    assert (len(longer.steps), longer.ended) == (3, "max_steps = 3 reached")
    assert load(folder).ended == "max_steps = 3 reached"
    assert_same(resume(folder, **run_of(K_c=1e9)), whole)


def test_no_step_is_computed_after_until_was_true(formula):
    steps = grow(**run_of())
    collect(steps, until=lambda step: True)
    assert list(steps) == []


# --- with other settings -----------------------------------------------------------------------


def push(size):
    return lambda x: np.full_like(x, size)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"law": paris(1e-11, 3.1)}, r"law\.m: stored 3\.0, given 3\.1"),
        ({"criterion": max_hoop_stress}, r"criterion: stored xcrack\.weighted_angle, given .*hoop"),
        ({"cycle": Cycle(0.1, 1.0)}, r"cycle\.min: stored 0\.0, given 0\.1"),
        ({"da": 1.8}, r"da: stored 1\.7, given 1\.8"),
        ({"threshold": 1.0}, "threshold: stored the default, given 1.0"),
        ({"scaling": "linear"}, "scaling"),
        ({"cycles": 1e5}, "cycles: stored the default, given 100000"),
    ],
)
def test_resume_names_what_is_different(whole, changes, words):
    before = content(whole.path)
    with pytest.raises(ProblemError, match=words):
        resume(whole.path, **run_of(**changes))
    with pytest.raises(ProblemError, match="holds a run with other settings"):
        collect(grow(**run_of(**changes)), whole.path)
    assert content(whole.path) == before


def test_resume_names_what_is_different_in_the_problem(whole):
    problem = scene()
    for changed, words in (
        (replace(problem, material=replace(problem.material, nu=0.2)), r"problem\.material\.nu"),
        (replace(problem, order=1), r"problem\.order: stored the default, given 1"),
        (replace(problem, contact="off"), r"problem\.contact"),
        (replace(problem, numerics=replace(problem.numerics, points=5)), r"numerics\.points"),
        (replace(problem, loads=[conditions.body_force((1.0, 0.0))]), r"problem\.loads"),
        (replace(problem, cracks=problem.cracks[:1]), "problem.cracks: stored 2 entries, given 1"),
        (plate(problem.cracks, n=(60, 41)), r"problem\.mesh\.(cells|points)"),
    ):
        with pytest.raises(ProblemError, match=words):
            resume(whole.path, **run_of(changed))


def test_functions_are_known_by_what_they_do():
    one = describe("f", push(1.0))
    assert differences(one, describe("f", push(1.0))) == []
    assert differences(one, describe("f", push(2.0))) == ["f.size: stored 1.0, given 2.0"]
    twin = describe("f", (lambda size: lambda x: np.full_like(x, 2 * size))(1.0))
    assert len(differences(one, twin)) == 1


def test_other_versions_are_said_but_no_obstacle(whole):
    path = whole.path / "run.json"
    path.write_text(path.read_text().replace(np.__version__, "1.0.0"))
    with pytest.warns(XcrackWarning, match=r"other versions.*numpy: stored 1\.0\.0"):
        resume(whole.path, **run_of())


def test_a_folder_that_holds_something_else(formula, tmp_path):
    with pytest.raises(ProblemError, match="no run to go on with"):
        resume(tmp_path / "nowhere", **run_of())
    (tmp_path / "file").write_text("")
    with pytest.raises(ProblemError, match="is a file"):
        collect(grow(**run_of()), tmp_path / "file")
    for text in ("{", "{}", "[]", '{"format": 99}'):
        (tmp_path / "run.json").write_text(text)
        with pytest.raises(ProblemError, match=r"run\.json"):
            resume(tmp_path, **run_of())
    with pytest.raises(ProblemError, match="holds no run"):
        load(tmp_path / "nowhere")


def test_a_run_may_be_written_anew(whole):
    before = content(whole.path)
    collect(grow(**run_of()), whole.path)  # the same settings
    assert content(whole.path) == before
    other = collect(grow(**run_of(da=3.0, max_steps=2)), whole.path, overwrite=True)
    assert len(other.steps) == 2
    assert len(list(whole.path.glob("step_*.npz"))) == 2


def test_a_stored_file_chooses_no_code(tmp_path):
    tree = {"class": "subprocess:Popen", "fields": {"args": "true"}}
    np.savez(tmp_path / "x.npz", tree=np.array(json.dumps(tree)))
    with pytest.raises(ProblemError, match=r"x\.npz holds a 'subprocess:Popen'"):
        store.load(tmp_path / "x.npz", run_files.CLASSES)
    with pytest.raises(ProblemError, match=r"Path cannot be stored"):
        store.save(tmp_path / "y.npz", {"path": Path()}, run_files.CLASSES)


# --- other formats, other defaults ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "words"), [(1, "before the first release"), (3, "newer xcrack")]
)
@pytest.mark.parametrize("lost", [False, True], ids=["header", "steps"])
def test_a_run_of_another_format(whole, monkeypatch, written, words, lost):
    """Whether the header says so, or the steps where it is lost."""
    folder = whole.path.parent / "other"
    with monkeypatch.context() as patch:
        patch.setattr(run_files, "_FORMAT", written)
        collect(grow(**run_of()), folder)
    if lost:
        (folder / "run.json").unlink()
    before = content(folder)
    for read in (load, lambda path: resume(path, **run_of())):
        with pytest.raises(ProblemError, match=words):
            read(folder)
    assert content(folder) == before


def test_a_lost_header_is_made_again_from_the_steps(whole):
    before = content(whole.path)
    (whole.path / "run.json").unlink()
    assert load(whole.path).table().tobytes() == whole.table().tobytes()
    with pytest.raises(ProblemError, match=r"da: stored 1\.7, given 1\.8"):
        resume(whole.path, **run_of(da=1.8))
    resume(whole.path, **run_of())
    assert content(whole.path) == before


def test_a_class_of_another_version(whole):
    """A name that is not known, a field that is not, a field that is missing."""
    path = run_files.step_path(whole.path, 1)
    with np.load(path) as members:
        arrays = dict(members)
    tree = str(arrays.pop("tree"))
    for old, new, words in (
        ('"class": "SIF"', '"class": "Jump"', "holds a 'Jump'"),
        ('"spread":', '"scatter":', "holds a SIF that differs in scatter, spread"),
    ):
        np.savez(path, tree=np.array(tree.replace(old, new)), **arrays)
        with pytest.raises(ProblemError, match=words):
            load(whole.path)


def test_a_run_goes_on_with_its_own_defaults(formula, whole, monkeypatch):
    """Of the set it began with, where the user left the choice to them."""
    monkeypatch.setattr(settings, "DEFAULTS", 2)
    monkeypatch.setitem(settings.REPLACED, 2, {"problem.numerics.points": 6, "scaling": "linear"})
    run = Run(**run_of())
    begun = run.as_begun(whole.steps[0].memory.settings)
    assert begun.problem.numerics.points == 6
    assert begun.scaling == "linear"
    assert begun.settings == whole.steps[0].memory.settings
    assert begun.as_begun(begun.settings).settings == begun.settings


def test_a_choice_that_became_the_default_is_still_a_choice(whole, monkeypatch):
    monkeypatch.setattr(settings, "DEFAULTS", 2)
    monkeypatch.setitem(settings.REPLACED, 2, {"scaling": "linear"})
    stored = {**whole.steps[0].memory.settings, "scaling": "'law'"}
    assert Run(**run_of()).as_begun(stored).settings == stored


def test_what_changes_no_result_is_not_in_the_settings():
    keys = set(Run(**run_of(max_steps=3, K_c=1e9, progress=False)).settings)
    assert not keys & {"max_steps", "max_cycles", "K_c", "progress"}
    assert "problem.order" not in keys
    assert "problem.order" in Run(**run_of(replace(scene(), order=1))).settings


# --- what is read off --------------------------------------------------------------------------


def test_table(whole):
    table = whole.table()
    assert table.dtype.names == (
        *("step", "N", "crack", "tip", "x", "y", "a"),
        *("K_I_0", "K_II_0", "K_I_1", "K_II_1", "angle", "dK_eq", "R", "rate", "da"),
    )
    assert len(table) == 2 * N_STEPS
    last = whole.steps[-1]
    row = table[-1]
    assert (row["step"], row["crack"], row["tip"]) == (N_STEPS - 1, 1, 0)
    assert row["N"] == last.cycles == whole.life
    assert row["K_II_1"] == last.sif[1][1].K[0, 1]
    assert (row["x"], row["y"]) == tuple(last.cracks[1].points[-1])
    assert row["da"] == last.da[1][0]
    first = table[table["step"] == 0]
    assert first["a"] == pytest.approx([5.0, np.hypot(4.1, 0.2)], rel=1e-12)
    # every step makes its crack longer by its da
    own = table[table["crack"] == 0]
    assert np.diff(own["a"]) == pytest.approx(own["da"][:-1], rel=1e-10)


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

    monkeypatch.setitem(sys.modules, "xcrack.post.vtk", SimpleNamespace(write=write))
    mixed = replace(whole, steps=(load(whole.path).steps[0], *whole.steps[1:2]))
    mixed.write(tmp_path / "out")
    with open(tmp_path / "out" / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    assert float(rows[3]["K_II_1"]) == mixed.table()["K_II_1"][3]  # all digits
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
