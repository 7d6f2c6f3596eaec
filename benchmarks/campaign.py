"""Wall time of a campaign by its engine: in series, two processes, dask, killed and resumed twice.

``python -m benchmarks.campaign [cases] [seconds]`` prints the tables of `docs/campaigns.md`; with
seconds each case waits so long instead of growing a crack.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import xcrack as xc

TESTS = Path(__file__).parents[1] / "tests"
sys.path.insert(0, str(TESTS))

from support import campaign_cases  # noqa: E402


def measured(folder: Path, cases: list[dict[str, Any]], **engine: Any) -> tuple[float, Any]:
    """Seconds of a study, and its table."""
    case = campaign_cases.waiting if "wait" in cases[0] else campaign_cases.small_plate
    begin = time.perf_counter()
    table = xc.campaign(case, cases, path=folder, **engine).table()
    return time.perf_counter() - begin, table


def same(one: Any, other: Any) -> bool:
    """Whether no case failed, and all lives are the same to the last bit."""
    name = "life" if "life" in (one.dtype.names or ()) else "twice"
    return bool((one[name] == other[name]).all() and not any(one["error"]))


def killed(folder: Path, n: int) -> float:
    """Seconds of a study on two processes that is killed, and gone on with, twice."""
    command = [sys.executable, "-m", "support.campaign_cases", str(folder), str(n), "2"]
    path = os.pathsep.join([str(TESTS), *sys.path])
    total = 0.0
    for share in (0.3, 0.65, None):
        begin = time.perf_counter()
        running = subprocess.Popen(
            command, env={**os.environ, "PYTHONPATH": path}, start_new_session=True
        )
        while running.poll() is None:
            time.sleep(0.05)
            if share is not None and len(list(folder.glob("row_*.json"))) >= share * n:
                os.killpg(running.pid, signal.SIGKILL)
                running.wait()
        total += time.perf_counter() - begin
    return total


def main(n: int = 200, wait: float = 0.0) -> None:
    """Measure, and print the table; cases that wait show what engines cost on a busy machine."""
    from distributed import Client, LocalCluster

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = campaign_cases.marked(n, folder / "marks")
        campaign_cases.small_plate(**cases[0])  # machine code is there before the clock starts
        if wait:
            cases = [{"a": a, "folder": str(folder), "wait": wait} for a in range(n)]
        series, expected = measured(folder / "series", cases)
        rows: list[tuple[str, float, bool]] = [("one process", series, True)]
        os.environ["PYTHONPATH"] = os.pathsep.join([str(TESTS), *sys.path])
        seconds, table = measured(folder / "two", cases, workers=2)
        rows.append(("two processes", seconds, same(table, expected)))
        begin = time.perf_counter()
        with (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            _, table = measured(folder / "dask", cases, client=client)
        seconds = time.perf_counter() - begin
        rows.append(("dask, two processes", seconds, same(table, expected)))
        if not wait:
            seconds = killed(folder / "killed", n)
            files = len(list((folder / "killed").glob("row_*.json")))
            rows.append(("two processes, killed and resumed twice", seconds, files == n))
    print(f"{n} cases; wall time over that of one process, {series:.1f} s here")
    print("| engine | wall time | same numbers |\n|---|---|---|")
    for words, seconds, alike in rows:
        print(f"| {words} | {seconds / series:.2f} | {'yes' if alike else 'NO'} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 200, *map(float, sys.argv[2:]))
