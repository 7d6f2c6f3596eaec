"""What ends a run from outside: a system that refuses, Ctrl-C, errors, odd arguments."""

import errno
import os
import shutil

import pytest

from support.growth_runs import *  # noqa: F403 - fixtures come by name
from support.growth_runs import N_STEPS, Saboteur, assert_same, run_of
from xcrack import ProblemError, XcrackWarning, collect, grow, load, resume

# --- the system refuses --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "at"),
    [
        pytest.param(
            errno.ENOSPC,
            range(1, 5 * (N_STEPS + 2) + 1),
            marks=(pytest.mark.slow, pytest.mark.mission),
        ),
        (errno.EROFS, (1, 6, 16)),
        (errno.EACCES, (1, 6, 16)),
    ],
    ids=["no space", "read-only", "no permission"],
)
def test_what_the_system_refuses_at_any_write(whole, tmp_path, number, at):
    """Ours, with the path; what was finished is whole and in the error; nothing half is left."""
    words = os.strerror(number)
    for n in at:
        folder = tmp_path / f"full_{n}"
        with pytest.MonkeyPatch.context() as patch:
            Saboteur(patch, n, lambda: OSError(number, words))
            with pytest.raises(ProblemError, match=words) as caught:
                collect(grow(**run_of()), folder)
        assert str(folder) in str(caught.value)
        stored = len(list(folder.glob("step_*.npz")))
        assert len(caught.value.history.steps) >= stored
        assert not list(folder.glob(".*"))
        assert not (folder / "run.lock").exists()
        assert_same(resume(folder, **run_of()), whole)


@pytest.mark.parametrize("make", [collect, load, resume], ids=lambda f: f.__name__)
@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("run\0", "NUL"),
        ("x" * 300, "too long|holds no run|no run to go on with"),
        (3, "is not a path"),
        (b"run", "is not a path"),
        ("", "is empty"),
    ],
    ids=["NUL", "too long", "number", "bytes", "empty"],
)
def test_paths_that_cannot_be(tmp_path, monkeypatch, make, path, words):
    monkeypatch.chdir(tmp_path)
    arguments = {collect: lambda: (grow(**run_of()), path), load: lambda: (path,)}
    with pytest.raises(ProblemError, match=words):
        resume(path, **run_of()) if make is resume else make(*arguments[make]())


def test_folders_in_the_place_of_files(whole, tmp_path):
    """Of a step, of the header, of the parent folder."""
    folder = tmp_path / "step"
    (folder / "step_00001.npz" / "inner").mkdir(parents=True)
    with pytest.warns(XcrackWarning, match="moved_aside_1"):
        assert_same(collect(grow(**run_of()), folder), whole)
    folder = tmp_path / "header"
    (folder / "run.json").mkdir(parents=True)
    with pytest.warns(XcrackWarning, match="moved_aside_1"):
        assert_same(collect(grow(**run_of()), folder), whole)
    (tmp_path / "file").write_text("")
    with pytest.raises(ProblemError, match="Not a directory"):
        collect(grow(**run_of()), tmp_path / "file" / "run")


def test_a_folder_that_vanishes_while_a_run_writes_to_it(tmp_path):
    def until(step):
        if step.index == 2:
            shutil.rmtree(tmp_path / "run")
        return False

    with pytest.raises(ProblemError, match="lock is gone") as caught:
        collect(grow(**run_of()), tmp_path / "run", until=until)
    assert len(caught.value.history.steps) == 4
    assert "4 finished steps are in the attribute `history`" in caught.value.__notes__[0]


@pytest.mark.parametrize(
    ("steps", "options", "words"),
    [
        (lambda: 3, {}, "steps = 3: give what grow returns"),
        (lambda: "steps", {}, "give what grow returns"),
        (lambda: [1, 2], {}, "1 is not a Step"),
        (lambda: run_of()["problem"], {}, "give what grow returns"),
        (lambda: grow(**run_of()), {"until": 3}, "until = 3: give a function of a Step"),
        (lambda: grow(**run_of()), {"overwrite": "no"}, "overwrite = 'no': give True or False"),
        (lambda: grow(**run_of()), {"keep_solutions": 1}, "keep_solutions = 1: give True"),
    ],
)
def test_bad_arguments_of_collect(steps, options, words):
    with pytest.raises(ProblemError, match=words):
        collect(steps(), **options)


def test_what_until_raises_names_where_it_was_called():
    def until(step):
        return step.life > 3

    with pytest.raises(AttributeError) as caught:
        collect(grow(**run_of()), until=until)
    assert any("until, after step 0" in note for note in caught.value.__notes__)
    assert len(caught.value.history.steps) == 1


# --- Ctrl-C --------------------------------------------------------------------------------------


def interrupted(index):
    """Steps of a run in which Ctrl-C comes while a step is computed."""
    for step in grow(**run_of()):
        if step.index == index:
            raise KeyboardInterrupt
        yield step


@pytest.mark.parametrize("stored", [False, True], ids=["in memory", "on disk"])
def test_ctrl_c_hands_back_what_was_finished(whole, tmp_path, stored):
    folder = tmp_path / "run" if stored else None
    with pytest.warns(XcrackWarning, match="interrupted after step 2: 3 finished steps"):
        history = collect(interrupted(3), folder)
    assert history.ended == "interrupted after step 2"
    assert history.table().tobytes() == whole.table().tobytes()[: history.table().nbytes]
    assert history.mesh is whole.mesh
    if stored:
        assert load(folder).ended == "interrupted after step 2"
        assert not (folder / "run.lock").exists()
        assert_same(resume(folder, **run_of()), whole)


def test_ctrl_c_before_the_first_step_is_ctrl_c(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        collect(interrupted(0), tmp_path)
    assert not list(tmp_path.iterdir())


def test_ctrl_c_while_a_step_is_written(whole, tmp_path):
    """Anywhere in it: the step is handed back; on disk it is there as a whole or not at all."""
    for n in range(1, 6):
        folder = tmp_path / f"run_{n}"
        with pytest.MonkeyPatch.context() as patch:
            Saboteur(patch, 5 * 3 + n, KeyboardInterrupt)
            with pytest.warns(XcrackWarning, match="3 finished steps are handed back"):
                history = collect(grow(**run_of()), folder)
        assert len(history.steps) == 3
        assert_same(resume(folder, **run_of()), whole)


def test_ctrl_c_in_resume(whole, tmp_path):
    folder = tmp_path / "run"
    collect(grow(**run_of()), folder, until=lambda step: step.index == 1)
    calls = []

    def until(step):
        calls.append(step.index)
        if step.index == 3:
            raise KeyboardInterrupt
        return False

    with pytest.warns(XcrackWarning, match="interrupted after step 3"):
        history = resume(folder, **run_of(), until=until)
    assert calls == [1, 2, 3]
    assert [step.index for step in history.steps] == [0, 1, 2, 3]
    assert_same(resume(folder, **run_of()), whole)


def test_an_error_hands_over_what_was_finished(tmp_path):
    """Without a path too."""

    def law(dK, R):
        if dK.max() > 700:
            raise FloatingPointError("my table ends")
        return 1e-11 * dK**3

    for folder in (None, tmp_path):
        with pytest.raises(FloatingPointError, match="my table ends") as caught:
            collect(grow(**run_of(law=law)), folder)
        history = caught.value.history
        assert 0 < len(history.steps) < N_STEPS
        assert history.ended == "an error: my table ends"
