"""Engines of campaigns: fork and spawn, dask on two processes, clients that die, kills."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from support import campaign_cases
from xcrack import ProblemError, XcrackWarning, campaign, grid

TESTS = Path(__file__).parents[1]


def same(one, two):
    """Whether two tables have the same numbers, but for the seconds that they took."""
    return all(np.array_equal(one[name], two[name]) for name in ("a", "life", "error"))


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_fork_and_spawn(tmp_path, start):
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {start} on this system")
    cases = grid(a=[1, 2, 5, 6])
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        study = campaign(campaign_cases.formula, cases, path=tmp_path / start, client=pool)
    alone = campaign(campaign_cases.formula, cases, path=tmp_path / "alone")
    assert same(study.table(), alone.table())


def test_rows_are_stored_as_they_finish(tmp_path):
    """A slow case holds no finished one back: what is done is on disk when a study is killed."""
    cases = [{"a": a, "folder": str(tmp_path), "wait": 0.6 if a == 1 else 0.0} for a in range(5)]
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        campaign(campaign_cases.waiting, cases, path=tmp_path / "study", client=pool)
    files = sorted((tmp_path / "study").glob("row_*.json"), key=lambda f: f.stat().st_mtime_ns)
    assert [json.loads(f.read_text())["parameters"]["a"] for f in files][-1] == 1


class Refusing:
    """A client that takes no more."""

    def submit(self, function, *arguments):
        raise RuntimeError("cannot schedule new futures after shutdown")


def test_a_client_that_takes_nothing(tmp_path):
    with pytest.raises(ProblemError, match=r"did not take the case .*after shutdown"):
        campaign(campaign_cases.formula, grid(a=[1]), path=tmp_path, client=Refusing())


class Closing:
    """A client whose futures never finish, and that says it is closed."""

    status = "closed"

    def submit(self, function, *arguments):
        class Future:
            def add_done_callback(self, function):
                pass

            def cancel(self):
                raise AssertionError("nobody answers any more")

        if arguments[1]["a"] == 1:
            return type("Done", (), {"result": lambda _: function(*arguments)})()
        return Future()


def test_a_client_that_is_closed(tmp_path, monkeypatch):
    monkeypatch.setattr("xcrack.runs.campaign._LOOK", 0.01)
    with pytest.raises(ProblemError, match="client is closed, and 2 cases are not finished"):
        campaign(campaign_cases.formula, grid(a=[1, 2, 5]), path=tmp_path, client=Closing())
    assert len(list(tmp_path.glob("row_*.json"))) == 1


class Lost:
    """A client whose scheduler is gone: futures say so, and their answers would be waited for."""

    def submit(self, function, *arguments):
        class Future:
            status = "cancelled"

            def add_done_callback(self, function):
                function(self)

            def result(self):
                raise AssertionError("it never comes")

        return Future()


def test_a_client_that_lost_its_scheduler(tmp_path):
    with pytest.raises(ProblemError, match=r"lost the case \{'a': 1\}.*call again"):
        campaign(campaign_cases.formula, grid(a=[1, 2]), path=tmp_path, client=Lost())


# --- dask ----------------------------------------------------------------------------------------


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="no dask.distributed here")
    # workers import the cases as this process does
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(TESTS), *sys.path]))
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        local_directory=str(tmp_path / "dask"),
    ) as cluster:
        yield cluster


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_dask_on_two_processes(tmp_path, cluster):
    """Rows, failures and numbers of a run by elements are those of this process."""
    from distributed import Client

    with Client(cluster) as client:
        cases = grid(a=[1, 2, 3, 4, 5])
        study = campaign(campaign_cases.formula, cases, path=tmp_path / "dask_rows", client=client)
        assert [row["kind"] for row in study.failed] == ["ProblemError", "ZeroDivisionError"]
        cracks = campaign_cases.drawn(4, 20268)
        far = campaign(campaign_cases.plate, cracks, path=tmp_path / "far", client=client)
        pids = {row["parameters"]["a"] for row in far.rows}
        assert len(pids) == 4
        study = campaign(
            campaign_cases.process, grid(a=range(8)), path=tmp_path / "p", client=client
        )
        assert len(set(study.table()["pid"])) == 2  # both workers, none of them this process
        assert os.getpid() not in study.table()["pid"]
    near = campaign(campaign_cases.plate, cracks, path=tmp_path / "near")
    assert same(far.table(), near.table())


@pytest.mark.slow
@pytest.mark.mission
def test_a_cluster_that_is_closed_loses_nothing(tmp_path, cluster):
    from distributed import Client

    cases = [{"a": a, "folder": str(tmp_path), "wait": 0.1} for a in range(30)]

    def close_after_some():
        while len(list((tmp_path / "study").glob("row_*.json"))) < 4:
            time.sleep(0.05)
        cluster.close()

    with Client(cluster) as client:
        closing = threading.Thread(target=close_after_some)
        closing.start()
        with pytest.raises(ProblemError, match="Finished cases are stored"):
            campaign(campaign_cases.waiting, cases, path=tmp_path / "study", client=client)
        closing.join()
    done = len(list((tmp_path / "study").glob("row_*.json")))
    assert 4 <= done < 30
    study = campaign(campaign_cases.waiting, cases, path=tmp_path / "study")
    assert study.table()["twice"].tolist() == [2.0 * a for a in range(30)]


@pytest.mark.slow
def test_threads_of_workers_are_spoken_of(tmp_path):
    distributed = pytest.importorskip("distributed", reason="no dask.distributed here")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
        pytest.warns(XcrackWarning, match="have 2 threads"),
    ):
        campaign(campaign_cases.formula, grid(a=[1]), path=tmp_path, client=client)


# --- two hundred cases, killed and gone on with twice --------------------------------------------


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.skipif(os.name != "posix", reason="kills a group of processes")
def test_two_hundred_cases_killed_twice(tmp_path):
    """The whole group of processes is killed at a third and at two thirds; nothing is lost."""
    study = tmp_path / "study"
    command = [sys.executable, "-m", "support.campaign_cases", str(study), "200", "2"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])}
    stamps = {}
    for least in (60, 130):
        running = subprocess.Popen(command, env=environment, start_new_session=True, cwd=tmp_path)
        begin = time.monotonic()
        while len(list(study.glob("row_*.json"))) < least:
            assert running.poll() is None, "it ended before it was killed"
            assert time.monotonic() - begin < 300
            time.sleep(0.02)
        os.killpg(running.pid, signal.SIGKILL)
        running.wait()
        for file, stamp in stamps.items():
            assert file.stat().st_mtime_ns == stamp  # no row was done twice
        stamps = {f: f.stat().st_mtime_ns for f in study.glob("row_*.json")}
    subprocess.run(command, env=environment, check=True, cwd=tmp_path)
    assert all(file.stat().st_mtime_ns == stamp for file, stamp in stamps.items())
    assert len(list(study.glob("row_*.json"))) == 200
    ran = [len(f.read_text()) for f in (tmp_path / "marks").iterdir()]
    assert len(ran) == 200
    assert max(ran) <= 3
    assert sum(ran) - 200 <= 8  # those under way and those done but not yet told, two of each
    cases = campaign_cases.marked(200, tmp_path / "marks_of_series")
    series = campaign(campaign_cases.small_plate, cases, path=tmp_path / "series")
    twice = {
        row["parameters"]["a"]: row["result"]
        for row in map(json.loads, (f.read_text() for f in study.glob("row_*.json")))
    }
    assert {row["parameters"]["a"]: row["result"] for row in series.rows} == twice
