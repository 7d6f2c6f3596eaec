"""The folder of a run: kills between any two writes, damage, files of others."""

import io
import json
import pickle
import re
import warnings
import zipfile
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

import xcrack as xc
from scripts.run_folder_page import PAGE, page_with_tables, patterns
from support.growth_runs import *  # noqa: F403 - fixtures come by name
from support.growth_runs import N_STEPS, Killed, Saboteur, assert_same, content, run_of
from xcrack import ProblemError, XcrackWarning, collect, grow, load, resume


def step_path(folder, index):
    """The file of a step, as docs/run_folder.md names it."""
    return folder / f"step_{index:05d}.npz"


# --- to disk and on ----------------------------------------------------------------------------


def test_each_step_is_on_disk_before_the_next_begins(tmp_path):
    seen = []

    def steps():
        for step in grow(**run_of()):
            seen.append(len(list(tmp_path.glob("step_*.npz"))))
            yield step

    history = collect(steps(), tmp_path)
    assert seen == list(range(N_STEPS))
    assert len(history.steps) == N_STEPS
    assert not list(tmp_path.glob(".*"))  # nothing half done is left
    assert not (tmp_path / "run.lock").exists()
    assert json.loads((tmp_path / "run.json").read_text())["versions"]["numpy"] == np.__version__


@pytest.mark.slow
@pytest.mark.mission
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


def test_until_and_the_rules_that_stop_a_run_may_change(whole, tmp_path):
    folder = tmp_path / "short"
    first = collect(grow(**run_of()), folder, until=lambda step: step.index == 1)
    assert first.ended == "until was true at step 1"
    again = resume(folder, **run_of(), until=lambda step: step.index >= 1)
    assert (len(again.steps), again.ended) == (2, first.ended)
    longer = resume(folder, **run_of(max_steps=3))
    assert (len(longer.steps), longer.ended) == (3, "max_steps = 3 reached")
    assert load(folder).ended == "max_steps = 3 reached"
    assert_same(resume(folder, **run_of(K_c=1e9)), whole)


def test_no_step_is_computed_after_until_was_true():
    steps = grow(**run_of())
    collect(steps, until=lambda step: True)
    assert list(steps) == []


# --- other formats, other defaults ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "words"), [(2, "before the first release"), (4, "newer xcrack")]
)
@pytest.mark.parametrize("lost", [False, True], ids=["header", "steps"])
def test_a_run_of_another_format(whole, written, words, lost):
    """Whether the header says so, or the steps where it is lost."""
    folder = whole.path.parent / "other"
    collect(grow(**run_of()), folder)
    for path in folder.glob("step_*.npz"):
        with np.load(path) as members:
            arrays = dict(members)
        arrays.pop("array_count", None)
        text, count = re.subn(r'("format": )3\b', rf"\g<1>{written}", str(arrays["run"]))
        assert count == 1
        np.savez(path, **arrays | {"run": np.array(text)})
    header = (folder / "run.json").read_text(encoding="utf-8")
    (folder / "run.json").write_text(header.replace('"format": 3', f'"format": {written}'))
    if lost:
        (folder / "run.json").unlink()
    before = content(folder)
    for read in (load, lambda path: resume(path, **run_of())):
        with pytest.raises(ProblemError, match=words):
            read(folder)
    assert content(folder) == before


def test_a_folder_of_an_older_format_is_refused_in_words(tmp_path):
    """Its steps are private classes by name, in a text called tree."""
    tree = {"dict": [["run", {"dict": [["format", 2]]}], ["step", {"class": "Step"}]]}
    np.savez(tmp_path / "step_00000.npz", tree=np.array(json.dumps(tree)))
    for header in (None, {"format": 2, "settings": {}, "versions": {}}):
        if header:
            (tmp_path / "run.json").write_text(json.dumps(header))
        with pytest.raises(ProblemError, match="has format 2, from before the first release"):
            load(tmp_path)


def test_a_step_that_knows_more_or_less_is_read(whole):
    """Arrays of a later version are not looked at; values with a default may be missing."""
    path = step_path(whole.path, 1)
    with np.load(path, allow_pickle=False) as members:
        arrays = dict(members)
    others = ("arrival_", "identity_", "array_count")
    less = {k: v for k, v in arrays.items() if not k.startswith(others)}
    np.savez(path, **less, later_array=np.arange(3))
    read = load(whole.path)
    assert len(read.steps) == len(whole.steps)
    assert read.steps[1].identities is None
    assert read.steps[1].sif[1][0].K.tobytes() == whole.steps[1].sif[1][0].K.tobytes()


def test_a_step_with_fewer_arrays_than_it_had_is_damaged(whole):
    """As a bit of the directory of its file leaves it, which no checksum guards."""
    path = step_path(whole.path, 2)
    data = path.read_bytes()
    with np.load(path, allow_pickle=False) as members:
        arrays = {name: members[name] for name in members.files if "identity" not in name}
    np.savez(path, **arrays)
    with pytest.warns(XcrackWarning, match=r"step_00002\.npz"):
        assert len(load(whole.path).steps) == 2
    path.write_bytes(data)


def test_a_member_whose_name_has_lost_its_ending_is_damage(whole):
    path = step_path(whole.path, 2)
    data = path.read_bytes()
    path.write_bytes(data.replace(b"identity_end_count.npy", b"identity_end_count.nqy"))
    with pytest.warns(XcrackWarning, match=r"step_00002\.npz"):
        assert len(load(whole.path).steps) == 2
    path.write_bytes(data)


def test_a_member_that_holds_no_array_is_damage(whole):
    path = step_path(whole.path, 2)
    data = path.read_bytes()
    with zipfile.ZipFile(io.BytesIO(data)) as members:
        content_of = {name: members.read(name) for name in members.namelist()}
    with zipfile.ZipFile(path, "w") as members:
        for name, text in (content_of | {"identity_end_count.npy": b"no array"}).items():
            members.writestr(name, text)
    with pytest.warns(XcrackWarning, match=r"step_00002\.npz"):
        assert len(load(whole.path).steps) == 2
    path.write_bytes(data)


def test_what_cannot_be_stored_is_named(tmp_path):
    pull = [xc.traction("top", (0, 1.0)), xc.traction("bottom", (0, -1.0))]
    steel = xc.Isotropic(1.0, 0.3, "strain")
    solution = xc.solve(xc.Problem(xc.box((0, 0), (1, 1), 3), steel, loads=pull))
    with pytest.raises(ProblemError, match=r"(Posix|Windows)Path cannot be stored"):
        xc.save(replace(solution, state=tmp_path), tmp_path / "x.npz")
    tree = {"class": "subprocess:Popen", "fields": {"args": "true"}}
    np.savez(tmp_path / "x.npz", tree=np.array(json.dumps(tree)))
    with pytest.raises(ProblemError, match=r"x\.npz holds a 'subprocess:Popen'"):
        load(tmp_path / "x.npz")


# --- what files hold -----------------------------------------------------------------------------


def test_the_page_lists_the_arrays():
    text = PAGE.read_text(encoding="utf-8")
    assert page_with_tables(text) == text, "python scripts/run_folder_page.py writes them anew"


def check_files(folder):
    """Plain arrays, for numpy alone, whose names the page has."""
    known = re.compile("|".join(patterns()))
    for path in [*folder.glob("step_*.npz"), *folder.glob("mesh*.npz")]:
        with np.load(path, allow_pickle=False) as arrays:
            for name in arrays.files:
                assert arrays[name].dtype.kind in "fibU", (path.name, name)
                assert known.fullmatch(name), (path.name, name)


def test_files_are_plain_arrays(whole, tmp_path):
    check_files(whole.path)
    plate, crack = xc.box((0, -2), (4, 2), (8, 8)), xc.line_crack([(0, 0.1), (1, 0.1)])
    loads = [xc.traction("top", (0.0, -80.0)), xc.traction("bottom", (0.0, 80.0))]
    steel = xc.Isotropic(210e3, 0.3, "strain")
    problem = xc.Problem(plate, steel, [crack], loads=loads, contact="on")
    collect(grow(**run_of(problem, response=None, max_steps=1)), tmp_path / "closed")
    check_files(tmp_path / "closed")
    assert (tmp_path / "closed" / "mesh.npz").exists()


def same_value(one, other, where):
    """Whether two values are the same to the last bit, part by part."""
    if is_dataclass(one):
        for each in fields(one):
            place = f"{where}.{each.name}"
            same_value(getattr(one, each.name), getattr(other, each.name), place)
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        assert one.tobytes() == other.tobytes(), where
    elif isinstance(one, tuple | list):
        assert len(one) == len(other), where
        for k, pair in enumerate(zip(one, other)):
            same_value(*pair, f"{where}[{k}]")
    else:
        assert one == other or (one != one and other != other), where


def test_every_field_of_a_step_survives(whole):
    for one, other in zip(whole.steps, load(whole.path).steps, strict=True):
        same_value(replace(one, solutions=()), other, f"step {one.index}")


# --- damage and strangers ------------------------------------------------------------------------


@pytest.mark.parametrize("keep", [0, 1, 100])
@pytest.mark.parametrize("index", [0, 2, N_STEPS - 1])
def test_a_step_that_is_cut_short_is_computed_again(whole, index, keep):
    path = step_path(whole.path, index)
    before = content(whole.path)
    path.write_bytes(path.read_bytes()[: keep * path.stat().st_size // 101])
    damaged = content(whole.path)
    with pytest.warns(XcrackWarning, match=rf"{path.name} is not whole.*moved_aside_1"):
        history = resume(whole.path, **run_of())
    assert content(whole.path) == before
    assert history.table().tobytes() == whole.table().tobytes()
    aside = content(whole.path / "moved_aside_1")
    assert aside == {name: damaged[name] for name in sorted(damaged) if name >= path.name}


@pytest.mark.parametrize("index", [0, 2, N_STEPS - 2])
def test_a_lost_middle_step_is_computed_again_to_the_same_bytes(whole, index):
    """Nothing that was finished is lost: the steps behind it are moved aside."""
    path = step_path(whole.path, index)
    before = content(whole.path)
    path.unlink()
    with pytest.warns(XcrackWarning, match=rf"{path.name} is missing .* {index} steps before it"):
        assert len(load(whole.path).steps) == index
    with pytest.warns(XcrackWarning, match=rf"{path.name} is missing.*moved_aside_1"):
        history = resume(whole.path, **run_of())
    assert content(whole.path) == before
    assert history.table().tobytes() == whole.table().tobytes()
    aside = content(whole.path / "moved_aside_1")
    assert aside == {name: before[name] for name in before if name > path.name}


@pytest.mark.parametrize("text", [None, "", "{", '{"format": 3}', "[]"])
def test_a_lost_or_damaged_header_is_made_again_from_the_steps(whole, text):
    before = content(whole.path)
    path = whole.path / "run.json"
    if text is None:
        path.unlink()
    else:
        path.write_text(text)
    assert load(whole.path).table().tobytes() == whole.table().tobytes()
    with pytest.raises(ProblemError, match=r"da: stored 1\.7, given 1\.8"):
        resume(whole.path, **run_of(da=1.8))
    with pytest.raises(ProblemError, match="holds a run of 5 steps"):
        collect(grow(**run_of(da=1.8)), whole.path)
    if text is None:
        resume(whole.path, **run_of())
    else:
        with pytest.warns(XcrackWarning, match=r"run\.json was damaged.*moved_aside_1"):
            resume(whole.path, **run_of())
        assert (whole.path / "moved_aside_1" / "run.json").read_text() == text
    assert content(whole.path) == before


def junk(folder):
    """Contents that are no step, by what they are."""
    tree = {"tuple": [1, 2]}
    member = io.BytesIO()
    np.savez(member, tree=np.array(json.dumps(tree)))
    array = io.BytesIO()
    np.save(array, np.arange(3))
    deep = io.BytesIO()
    np.savez(deep, tree=np.array("[" * 10_000 + "]" * 10_000))
    odd = io.BytesIO()
    run = json.loads((folder / "run.json").read_text())
    del run["ended"]
    np.savez(odd, run=np.array(json.dumps(run)), index=np.array(2), cycles=np.array("many"))
    return {
        "empty": b"",
        "text": b"my own notes",
        "pickle": pickle.dumps({"a": 1}),
        "zip of something": zipped({"a.txt": b"b"}),
        "array": array.getvalue(),
        "other values": member.getvalue(),
        "deep nesting": deep.getvalue(),
        "step of odd parts": odd.getvalue(),
    }


def zipped(files):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return target.getvalue()


@pytest.mark.slow
def test_files_of_others_in_the_place_of_steps(whole, tmp_path):
    """None ends in a traceback, none is lost, and the run comes out the same."""
    for name, data in junk(whole.path).items():
        folder = tmp_path / name
        folder.mkdir()
        step_path(folder, 2).write_bytes(data)
        with pytest.raises(ProblemError, match="holds no run"):
            load(folder)
        with pytest.warns(XcrackWarning, match="1 files that stood in .* were moved"):
            history = collect(grow(**run_of()), folder)
        assert_same(history, whole)
        assert content(folder / "moved_aside_1") == {"step_00002.npz": data}
        # and in the place of a step of a run
        step_path(folder, 2).write_bytes(data)
        with pytest.warns(XcrackWarning, match=r"step_00002\.npz is not whole"):
            history = resume(folder, **run_of())
        assert_same(history, whole)


@pytest.mark.slow
@pytest.mark.mission
def test_flipped_bits_are_noticed(whole):
    """A hundred places, drawn: the step is computed again, or the bit was one of padding."""
    before = content(whole.path)
    path = step_path(whole.path, 2)
    data = path.read_bytes()
    generator = np.random.default_rng(70412)
    for bit in generator.integers(0, 8 * len(data), 100):
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << (bit % 8)
        path.write_bytes(bytes(changed))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", XcrackWarning)
            steps = load(whole.path)
        assert len(steps.steps) in (2, N_STEPS)
        assert steps.table().tobytes() == whole.table().tobytes()[: steps.table().nbytes]
    path.write_bytes(data)
    assert content(whole.path) == before


def test_a_step_of_another_run(whole, tmp_path):
    other = collect(grow(**run_of(da=1.8)), tmp_path / "other")
    before = content(whole.path)
    path = step_path(whole.path, 3)
    path.write_bytes(step_path(other.path, 3).read_bytes())
    with pytest.warns(XcrackWarning, match=r"step_00003\.npz belongs to another run"):
        resume(whole.path, **run_of())
    assert content(whole.path) == before


def test_left_over_parts_are_swept_away_and_nothing_else(whole):
    parts = [".step_00003.npz.4711_0a0b0c0d.part", ".run.json.12_aa.part", ".run.lock.3_bb.part"]
    for name in parts:
        (whole.path / name).write_bytes(b"half")
    others = ["notes.txt", ".mine.part", "step_3.npz", "step_last.npz", "step_00003.npz.bak"]
    for name in others:
        (whole.path / name).write_text("the user's own")
    resume(whole.path, **run_of())
    names = {path.name for path in whole.path.iterdir()}
    assert not names & set(parts)
    assert set(others) <= names
    assert "moved_aside_1" not in names


def test_a_folder_that_holds_something_else(tmp_path):
    with pytest.raises(ProblemError, match="no run to go on with"):
        resume(tmp_path / "nowhere", **run_of())
    (tmp_path / "file").write_text("")
    with pytest.raises(ProblemError, match="is a file"):
        collect(grow(**run_of()), tmp_path / "file")
    for text in ("{", "{}", "[]", '{"format": 99}'):
        (tmp_path / "run.json").write_text(text)
        for call in (lambda: resume(tmp_path, **run_of()), lambda: load(tmp_path)):
            with pytest.raises(ProblemError, match=r"run\.json"):
                call()
        with pytest.raises(ProblemError, match=r"run\.json"):
            collect(grow(**run_of()), tmp_path)
    with pytest.warns(XcrackWarning, match="moved_aside_1"):
        collect(grow(**run_of()), tmp_path, overwrite=True)
    assert (tmp_path / "moved_aside_1" / "run.json").read_text() == text
    with pytest.raises(ProblemError, match="holds no run"):
        load(tmp_path / "nowhere")


def test_a_finished_step_is_never_replaced_by_a_new_run(whole):
    """The same settings or others: refused before anything is computed, or moved aside."""
    before = content(whole.path)
    for run in (run_of(), run_of(da=3.0)):
        steps = grow(**run)
        with pytest.raises(ProblemError, match="run of 5 steps already: go on with it by resume"):
            collect(steps, whole.path)
        next(steps)  # not begun, not closed
    assert content(whole.path) == before
    with pytest.warns(XcrackWarning, match="6 files .*moved_aside_1"):
        other = collect(grow(**run_of(da=3.0, max_steps=2)), whole.path, overwrite=True)
    assert len(other.steps) == 2
    assert len(list(whole.path.glob("step_*.npz"))) == 2
    assert content(whole.path / "moved_aside_1") == before
    with pytest.warns(XcrackWarning, match="3 files .*moved_aside_2"):
        collect(grow(**run_of()), whole.path, overwrite=True)
    assert content(whole.path) == before


def test_an_overwritten_run_is_there_until_the_first_step_is_finished(whole):
    before = content(whole.path)

    def broken(dK, R):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        collect(grow(**run_of(law=broken)), whole.path, overwrite=True)
    assert content(whole.path) == before
