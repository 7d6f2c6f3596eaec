"""Real processes with real kernels: kill -9, two writers, no space, Ctrl-C; then the same bytes."""

import json
import os
import signal
import sys
import time

import numpy as np
import pytest

from support.growth_runs import content

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the system has no fork and /proc")

DONE = {2: "max_steps = 7 reached", 3: "max_steps = 3 reached"}


@pytest.fixture(scope="module")
def processes():
    from support.run_processes import server

    with server(2) as served:
        yield served


def undisturbed(processes, folder, dim=2):
    """Files of a run that nothing disturbs, and how long it takes."""
    begin = time.monotonic()
    assert processes.result(processes.start(folder)) == DONE[dim]
    return content(folder), time.monotonic() - begin


@pytest.fixture(scope="module")
def whole(processes, tmp_path_factory):
    return undisturbed(processes, tmp_path_factory.mktemp("whole") / "run")


def assert_finished(folder, expected):
    assert content(folder) == expected
    assert not list(folder.glob("moved_aside_*"))


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("dim", [2, 3])
def test_fifty_kills_at_random_moments(tmp_path, dim):
    """Drawn over the time of a whole run; killed again while it resumes; no step is lost."""
    from support.run_processes import server

    with server(dim) as processes:
        kill_and_resume(processes, tmp_path, dim)


def kill_and_resume(processes, tmp_path, dim):
    expected, duration = undisturbed(processes, tmp_path / "whole", dim)
    generator = np.random.default_rng(59207 + dim)
    kills, runs, stored = 0, 0, []
    folder = tmp_path / "run_0"
    while kills < 50:
        pid = processes.start(folder)
        result = processes.result(pid, generator.uniform(0, duration))
        if result is None:
            processes.kill(pid)
            kills += 1
            steps = {n: d for n, d in expected.items() if n.startswith("step_")}
            there = content(folder) if folder.exists() else {}
            stored.append(len(set(steps) & set(there)))
            assert all(there[name] == steps[name] for name in set(steps) & set(there))
            late = processes.result(pid, 0.0)  # it ended just before the kill
            assert late in (None, DONE[dim])
        else:
            assert result == DONE[dim]
            assert_finished(folder, expected)
            runs += 1
            folder = tmp_path / f"run_{runs}"
    assert processes.result(processes.start(folder)) == DONE[dim]
    assert_finished(folder, expected)
    counts = np.bincount(stored, minlength=len(expected)).tolist()
    print(f"{dim}D: {kills} kills of {runs + 1} runs; kills with 0, 1, ... steps on disk: {counts}")


def test_a_killed_process_leaves_a_lock_that_blocks_nobody(processes, whole, tmp_path):
    folder = tmp_path / "run"
    pid = processes.start(folder, hold=2)
    assert processes.report("waits", pid=pid)
    processes.kill(pid)
    assert json.loads((folder / "run.lock").read_text())["pid"] == pid
    assert processes.result(processes.start(folder, call="resume")) == DONE[2]
    assert_finished(folder, whole[0])


def test_two_writers_in_one_folder(processes, whole, tmp_path):
    """The second is refused, by the id of the first, and touches nothing."""
    folder = tmp_path / "run"
    first = processes.start(folder, hold=3)
    assert processes.report("waits", pid=first)
    before = content(folder)
    for call in ("collect", "resume"):
        error = processes.result(processes.start(folder, call=call))
        assert error.startswith("ProblemError")
        assert f"in use by process {first} since" in error
    assert content(folder) == before
    processes.kill(first)
    assert processes.result(processes.start(folder, call="resume")) == DONE[2]
    assert_finished(folder, whole[0])


def test_many_writers_at_once(processes, whole, tmp_path):
    """In an empty folder, and in one with the lock of a dead process: one of them does it all."""
    folder = tmp_path / "run"
    results = [processes.start(folder, call="collect") for _ in range(6)]
    results = [processes.result(pid) for pid in results]
    assert results.count(DONE[2]) == 1
    assert all("in use by" in r or "holds a run" in r for r in results if r != DONE[2])
    assert_finished(folder, whole[0])
    folder = tmp_path / "killed"
    pid = processes.start(folder, hold=2)
    assert processes.report("waits", pid=pid)
    processes.kill(pid)
    results = [processes.start(folder, call="resume") for _ in range(6)]
    results = [processes.result(pid) for pid in results]
    assert results.count(DONE[2]) >= 1
    assert all("in use by" in r for r in results if r != DONE[2])
    assert_finished(folder, whole[0])


def test_no_space_for_a_real_process(processes, whole, tmp_path):
    """RLIMIT_FSIZE from step 2 on: an error with the path; the steps before are whole."""
    folder, expected = tmp_path / "run", whole[0]
    limit = min(len(data) for data in expected.values()) // 2
    error = processes.result(processes.start(folder, hold=2, limit=limit))
    assert error.startswith(f"ProblemError: step 3 cannot be written to {folder}/step_00003.npz: ")
    assert "File too large. The 3 steps before it are whole" in error
    there = content(folder)
    assert {name: there[name] for name in there if name != "run.json"} == {
        name: expected[name] for name in (f"step_0000{k}.npz" for k in range(3))
    }
    assert processes.result(processes.start(folder, call="resume")) == DONE[2]
    assert_finished(folder, expected)


@pytest.mark.slow
@pytest.mark.mission
def test_ctrl_c_for_a_real_process(processes, whole, tmp_path):
    folder = tmp_path / "run"
    pid = processes.start(folder, hold=3)
    assert processes.report("waits", pid=pid)
    ended = None
    while ended is None:  # Python drops an interrupt that falls into a finaliser: press again
        os.kill(pid, signal.SIGINT)
        ended = processes.result(pid, timeout=10.0)
    assert ended == "interrupted after step 3"
    assert processes.result(processes.start(folder, call="resume")) == DONE[2]
    assert_finished(folder, whole[0])


@pytest.mark.slow
def test_ctrl_c_at_random_moments(processes, whole, tmp_path):
    """What was finished is handed back, or it is too early for that; and the same bytes."""
    expected, duration = whole
    generator = np.random.default_rng(4451)
    results = []
    for k in range(20):
        folder = tmp_path / f"run_{k}"
        pid = processes.start(folder)
        result = processes.result(pid, generator.uniform(0, duration))
        if result is None:
            os.kill(pid, signal.SIGINT)
            result = processes.result(pid)
        results.append(result)
        assert result == DONE[2] or result.startswith(("interrupted after", "KeyboardInterrupt"))
        assert processes.result(processes.start(folder)) == DONE[2]
        assert_finished(folder, expected)
    print(sorted(results))
