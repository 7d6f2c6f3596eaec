"""Threads: the same bits for any number, no harm to those of the user; caches of kernels."""

import multiprocessing
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import threadpoolctl

import xcrack as xc
from xcrack.base import machine
from xcrack.fem import assembly
from xcrack.linalg import multifrontal, products
from xcrack.mesh import distances
from xcrack.sif import domain_3d


def plane(n=24):
    crack = xc.line_crack([(-1.2, 0.013), (-0.2, 0.031)])
    push = [xc.traction("top", (0.3, -1.0)), xc.traction("bottom", (-0.3, 1.0))]
    sides = [xc.traction("right", (0.0, 0.3)), xc.traction("left", (0.0, -0.3))]
    mesh = xc.box((-1, -1), (1, 1), n)
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=push + sides)


def solid(n=10):
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    loads = [xc.traction("top", (0, 0, -1.0)), xc.traction("bottom", (0, 0, 1.0))]
    return xc.Problem(
        xc.box((-1,) * 3, (1,) * 3, n), xc.Isotropic(1.0, 0.3), [crack], loads=loads, order=1
    )


def bits(problem, count=None):
    """Displacements, pressures and K of two states, as bytes."""
    problem = replace(problem, numerics=replace(problem.numerics, threads=count))
    solutions = xc.solve(problem, states=[1.0, -1.0])
    K = [s.K for s in xc.stress_intensities(solutions)]
    parts = [s.u for s in solutions] + K
    parts += [c.pressure for s in solutions for c in s.contact if c is not None]
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts)


@pytest.mark.parametrize("scene", [plane, pytest.param(solid, marks=pytest.mark.slow)])
def test_the_same_bits_for_any_number(scene, monkeypatch):
    # Small matrices are shared too, and few cells and points make many tasks.
    monkeypatch.setattr(products, "_LEAST", 1000)
    monkeypatch.setattr(multifrontal, "_LEAST", 0)
    monkeypatch.setattr(assembly, "_CHUNK", 1500)
    monkeypatch.setattr(domain_3d, "_CHUNK", 150)
    monkeypatch.setattr(distances, "_AT_ONCE", 100)
    problem = scene()
    one = bits(problem, 1)
    for count in (2, 3, 7):
        assert bits(problem, count) == one
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        if scene is plane:  # BLAS outside our own loops belongs to numpy: bases of small blocks
            assert len(bits(problem, 2)) == len(one)


def test_threads_are_no_setting_of_a_run():
    problem = plane()
    other = replace(problem, numerics=xc.Numerics(threads=3))
    from xcrack.base.description import describe

    assert describe("problem", problem) == describe("problem", other)


# --- how many ------------------------------------------------------------------------------------


def test_available(monkeypatch, tmp_path):
    monkeypatch.delenv("XCRACK_THREADS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(40)), raising=False)
    monkeypatch.setattr(machine, "_QUOTA", tmp_path / "cpu.max")
    assert machine.available_processors() == 16
    for text, count in (("max 100000", 16), ("250000 100000", 3), ("50000 100000", 1), ("x", 16)):
        (tmp_path / "cpu.max").write_text(text + "\n")
        assert machine.available_processors() == count
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {3}, raising=False)
    assert machine.available_processors() == 1
    monkeypatch.setenv("XCRACK_THREADS", "24")
    assert machine.available_processors() == 24
    for wrong in ("0", "-1", "two", "1.5", ""):
        monkeypatch.setenv("XCRACK_THREADS", wrong)
        with pytest.raises(xc.ProblemError, match=f"XCRACK_THREADS = '{wrong}' in the environment"):
            machine.available_processors()


@pytest.mark.parametrize("wrong", [0, -1, 1.5, "two", True])
def test_a_number_that_is_none(wrong):
    with pytest.raises(xc.ProblemError, match=r"Numerics: threads = .*whole number of at least 1"):
        xc.Numerics(threads=wrong)


def test_each_keeps_the_order_and_its_errors():
    def slow(k):
        time.sleep(0.01 * (3 - k))
        return k

    with machine.threads(3) as count:
        assert count == machine.number_of_threads() == 3
        assert machine.map_tasks(slow, range(4)) == [0, 1, 2, 3]
        counts = machine.map_tasks(lambda _: machine.number_of_threads(), range(2))
        assert counts == [1, 1]  # no pool in a pool
        caller = threading.get_ident()
        assert machine.map_tasks(lambda _: threading.get_ident(), [0]) == [caller]
        with pytest.raises(ZeroDivisionError):
            machine.map_tasks(lambda k: 1 / k, [1, 0])
        with machine.threads(2):  # that of the outer block goes on
            assert machine.number_of_threads() == 3
    assert machine.number_of_threads() == 1
    assert not any(thread.name.startswith("xcrack") for thread in threading.enumerate())


def test_results_are_taken_while_others_are_made():
    """In order, with as many at once as there are threads; an error comes where its task stands."""
    running, most, lock = 0, 0, threading.Lock()

    def slow(k):
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        time.sleep(0.02 * (3 - k % 3))
        with lock:
            running -= 1
        return k

    assert list(machine.stream_tasks(slow, range(5))) == [0, 1, 2, 3, 4]
    assert most == 1
    started = []

    def tasks():
        for k in range(20):
            started.append(k)
            yield k

    with machine.threads(3):
        results = machine.stream_tasks(slow, tasks())
        assert next(results) == 0
        assert len(started) <= 5  # memory is bounded
        assert list(results) == list(range(1, 20))
        assert 1 < most <= 3
        results = machine.stream_tasks(lambda k: 1 / k, [1, 2, 0, 4])
        assert [next(results), next(results)] == [1.0, 0.5]
        with pytest.raises(ZeroDivisionError):
            next(results)


# --- processes and threads of the user -----------------------------------------------------------


def test_threads_of_the_user():
    """Four solve at once, each with two threads of its own."""
    problem = plane(12)
    one = bits(problem, 1)
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(lambda _: bits(problem, 2), range(4))) == {one}


def _child(queue):
    queue.put(bits(plane(12), 2))


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_processes_started_after_a_solve(method):
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} on this system")
    if method == "spawn":
        code = "from test_machine import bits, plane; print(hash(bits(plane(12), 2)))"
        folder = os.path.dirname(__file__)
        environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONPATH": os.pathsep.join(
            [folder, *sys.path])}  # fmt: skip
        runs = [
            subprocess.run([sys.executable, "-c", c], env=environment, capture_output=True,
                           text=True, timeout=120, check=True).stdout
            for c in (code, code.replace(", 2)", ", 1)"))
        ]  # fmt: skip
        assert runs[0] == runs[1]
        return
    context = multiprocessing.get_context(method)
    one, queue = bits(plane(12), 2), context.Queue()
    child = context.Process(target=_child, args=(queue,))
    child.start()
    assert queue.get(timeout=60) == one
    child.join(10)
    assert child.exitcode == 0
    assert bits(plane(12), 2) == one


def test_blas_is_restored_when_the_last_has_left():
    def blas():
        pools = threadpoolctl.threadpool_info()
        return {pool["num_threads"] for pool in pools if pool["user_api"] == "blas"}

    inside, leave = threading.Event(), threading.Event()

    def other():
        with machine.one_blas_thread():
            inside.set()
            leave.wait(10)

    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        thread = threading.Thread(target=other)
        thread.start()
        inside.wait(10)
        with machine.one_blas_thread():
            assert blas() == {1}
        assert blas() == {1}  # the other one is still inside
        leave.set()
        thread.join()
        assert blas() == {2}


# --- kernels where their cache cannot be written, or is damaged: fresh processes, one small kernel


ROOT = Path(__file__).resolve().parents[2]
SCRIPT = """
import logging, warnings, sys
announced = []
logging.getLogger("xcrack").setLevel(logging.INFO)
logging.getLogger("xcrack").addFilter(lambda record: announced.append(record.getMessage()))
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import numpy as np
    from xcrack.mesh.kernels.location import polyline_distance as kernel
    line = np.array([[0.0, 0.0], [1.0, 0.0]])
    print(np.asarray(kernel(np.array([[0.5, 2.0]]), line)[0]).ravel()[0])
    from xcrack.fem.kernels.functions import set_gradients
print(len(caught), sum(kernel.stats.cache_hits.values()))
for warning in caught:
    print(warning.message)
print(len(announced), *announced)
"""


@pytest.fixture
def package_copy(tmp_path):
    """A copy of xcrack without compiled code."""
    source = tmp_path / "src" / "xcrack"
    shutil.copytree(ROOT / "src" / "xcrack", source, ignore=shutil.ignore_patterns("__pycache__"))
    return source


def run_script(package_copy, *, home, temporary, user=None, **more):
    environment = {
        "PATH": os.environ["PATH"], "PYTHONPATH": str(package_copy.parent), "HOME": str(home),
        "TMPDIR": str(temporary), "PYTHONDONTWRITEBYTECODE": "1", **more,
    }  # fmt: skip
    command = [sys.executable, "-c", SCRIPT]
    if user is not None:
        command = ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", *command]
    done = subprocess.run(
        command, env=environment, cwd="/", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
@pytest.mark.mission
def test_a_damaged_cache_is_made_again(package_copy, tmp_path):
    """Index, data, both; cut short or of other bytes: compiled anew, and whole afterwards."""
    where = {"home": tmp_path, "temporary": tmp_path, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    *first, compiled = run_script(package_copy, **where)
    assert first == ["2.0", "0 0"]
    assert compiled.startswith("1 xcrack compiles kernels"), compiled  # once for all kernels
    assert run_script(package_copy, **where) == ["2.0", "0 1", "0"]  # from the cache
    for kind, damage in (("*.nbi", b"\x80\x04nonsense"), ("*.nbc", b"")):
        for path in (tmp_path / "cache").rglob(kind):
            path.write_bytes(damage)
        assert run_script(package_copy, **where)[:2] == ["2.0", "0 0"]
        assert run_script(package_copy, **where)[:2] == ["2.0", "0 1"]


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0 or shutil.which("setpriv") is None,
    reason="needs root and setpriv to become a user who may write nothing",
)
def test_nothing_may_be_written(package_copy, tmp_path):
    """A temporary folder of the user's own with one warning, or none at all with one warning."""
    for folder in (tmp_path, *tmp_path.parents):  # pytest's own are closed to others
        if folder.is_relative_to(tempfile.gettempdir()) and folder != Path(tempfile.gettempdir()):
            folder.chmod(0o755)
    nobody = {"home": "/nonexistent", "user": 65534}
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    first = run_script(package_copy, temporary=shared, **nobody)
    assert first[:2] == ["2.0", "1 0"]
    assert "compiled kernels are stored in" in first[2]
    assert run_script(package_copy, temporary=shared, **nobody)[:2] == ["2.0", "1 1"]
    (folder,) = shared.glob("xcrack-kernels-*")
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    # A folder of that name that somebody else has made is not trusted.
    shutil.rmtree(folder)
    folder.mkdir()
    folder.chmod(0o777)
    other = run_script(package_copy, temporary=shared, **nobody)
    assert str(folder) + "." not in other[2]
    assert not list(folder.iterdir())
