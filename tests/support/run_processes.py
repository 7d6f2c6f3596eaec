"""A process that runs growth in children of its own, each a process that can be killed.

Loading xcrack takes longer than the runs: it is done once, and a child is a fork. Orders are lines
of JSON on standard input, reports lines of JSON on standard output.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue
from threading import Thread


def scene_of(dim):
    """Arguments of a run of about a second: with contact in 2D, with a front in 3D."""
    import xcrack as xc

    steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain" if dim == 2 else None)
    up = (0.0,) * (dim - 1) + (1.0,)
    loads = [xc.traction("top", up), xc.traction("bottom", tuple(-v for v in up))]
    if dim == 2:
        crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
        mesh, cycle, da, steps = xc.box((-1, -1), (1, 1), 16), xc.Cycle(-1.0, 1.0), 0.1, 7
    else:
        x, y, z = 1.5, 0.2, 0.03
        crack = xc.plane_crack([(-x, -x, z), (-y, -x, z), (-y, x, z), (-x, x, z)])
        mesh, cycle, da, steps = xc.box((-1,) * 3, (1,) * 3, 6), xc.Cycle(0.1, 1.0), 0.35, 3
    problem = xc.Problem(mesh, steel, [crack], loads=loads)
    asked = {"problem": problem, "law": xc.elber(1.4e-11, 2.9, 0.5, 0.4), "cycle": cycle, "da": da}
    return {**asked, "criterion": xc.weighted_angle, "max_steps": steps, "progress": False}


def serve(dim):
    """Take orders until standard input ends."""
    import xcrack as xc

    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    run = scene_of(dim)
    next(iter(xc.grow(**run)))  # kernels are compiled, or read, before the first fork
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for a child: none is left over
    say(ready=True)
    for line in sys.stdin:
        order = json.loads(line)
        pid = os.fork()
        if pid == 0:
            try:
                report = {"ended": obey(xc, run, **order)}
            except BaseException as error:
                report = {"error": f"{type(error).__name__}: {error}"}
            say(pid=os.getpid(), **report)
            os._exit(0)
        say(started=pid)


def obey(xc, run, folder, call, hold=None, limit=None):
    """One run; it may wait at a step, or lose the right to write large files there."""

    def until(step):
        if step.index == hold and limit is None:
            say(pid=os.getpid(), waits=step.index)
            signal.pause()
        if step.index == hold:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        return False

    if call == "resume" or (call == "any" and Path(folder).exists()):
        return xc.resume(folder, **run, until=until).ended
    return xc.collect(xc.grow(**run), folder, until=until).ended


def say(**report):
    os.write(1, (json.dumps(report) + "\n").encode())  # in one go, so that lines do not mix


class Server:
    """The other side: starts children, and reads what they report."""

    def __init__(self, process):
        self.process = process
        self.lines: Queue[dict] = Queue()
        self.pending: list[dict] = []
        Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(json.loads(line))

    def report(self, key, timeout=120.0, **equal):
        """The next report with a key, and with these values; None after the time."""
        end = time.monotonic() + timeout
        while True:
            for report in self.pending:
                if key in report and all(report.get(k) == v for k, v in equal.items()):
                    self.pending.remove(report)
                    return report
            try:
                self.pending.append(self.lines.get(timeout=max(end - time.monotonic(), 1e-3)))
            except Empty:
                return None

    def start(self, folder, call="any", **options):
        order = {"folder": str(folder), "call": call, **options}
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        return self.report("started")["started"]

    def result(self, pid, timeout=120.0):
        """Why the run of a child ended, or its error; None if it goes on."""
        end = time.monotonic() + timeout
        while True:
            for key in ("ended", "error"):
                report = self.report(key, 1e-3, pid=pid)
                if report:
                    return report[key]
            if time.monotonic() > end:
                return None

    def kill(self, pid):
        """SIGKILL, and wait until the process is gone."""
        try:
            os.kill(pid, signal.SIGKILL)
            while True:
                os.kill(pid, 0)
                time.sleep(1e-3)
        except ProcessLookupError:
            return


@contextmanager
def server(dim: int) -> Iterator[Server]:
    """A process that serves, for as long as the block lasts."""
    process = subprocess.Popen(
        [sys.executable, __file__, str(dim)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        served = Server(process)
        assert served.report("ready", 300.0)
        yield served
    finally:
        process.stdin.close()
        process.wait(60)


if __name__ == "__main__":
    serve(int(sys.argv[1]))
