"""What every test runs under: one thread, a cache of compiled kernels, no display."""

from __future__ import annotations

import functools
import hashlib
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
PIXEL = bytes.fromhex(  # a white PNG
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c494441"
    "54789c63f8ffff3f0005fe02fe0def46b80000000049454e44ae426082"
)


def _kernels_key() -> str:
    digest = hashlib.sha256()
    for path in sorted((ROOT / "src" / "xcrack").glob("*/kernels/*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


# numba keeps a caller's compiled code when a helper in another file has changed: a cache folder
# for each state of the kernels cannot be stale.  Set before anything imports numba.
os.environ.setdefault("NUMBA_CACHE_DIR", str(ROOT / ".cache" / "numba" / _kernels_key()))
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")  # two workers on two cores; and sums in one order

PROBES = {
    "gmsh": (
        "gmsh",
        "import gmsh; gmsh.initialize(interruptible=False, readConfigFiles=False); gmsh.finalize()",
    ),
    "plot": (
        "renderer",
        "import pyvista as pv; p = pv.Plotter(off_screen=True, window_size=(64, 64));"
        "p.add_mesh(pv.Sphere()); image = p.screenshot(None, return_img=True);"
        "assert image.std() > 0, 'an empty picture'",
    ),
}


@functools.cache
def missing(marker: str) -> str:
    """Why tests with a marker cannot run here; empty if they can.

    Asked of a process of its own: a missing driver may end it without an exception.
    """
    thing, code = PROBES[marker]
    try:
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False
        )
    except subprocess.TimeoutExpired:
        return f"{thing} not available: no answer in 120 s"
    if run.returncode == 0:
        return ""
    errors = [line for line in run.stderr.splitlines() if "Error:" in line]
    return f"{thing} not available: {errors[-1] if errors else f'exit code {run.returncode}'}"


@pytest.hookimpl(trylast=True)  # after -m has left out what is not asked for: probe only at need
def pytest_addoption(parser: pytest.Parser) -> None:
    """`--ratchet` lowers the limits of tests/package/limits.json to what is measured."""
    parser.addoption("--ratchet", action="store_true", help="lower limits.json to what it is now")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        for marker in PROBES:
            if item.get_closest_marker(marker) and missing(marker):
                item.add_marker(pytest.mark.skip(reason=missing(marker)))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped: Counter[str] = Counter()
    for report in terminalreporter.getreports("skipped"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        for thing, _ in PROBES.values():
            skipped[thing] += f"{thing} not available" in reason
    counts = ", ".join(f"{count} for want of {thing}" for thing, count in skipped.items() if count)
    if counts:
        terminalreporter.write_line(f"skipped: {counts}")


@pytest.fixture(autouse=True)
def _no_figure_left_open() -> Iterator[None]:
    """Close matplotlib's figures after each test; a test that never drew pays nothing."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")


@pytest.fixture
def blank_pictures(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """PNG files of matplotlib have one pixel, but for tests marked as `drawn`.

    Figures are made as ever. To draw one takes half a second, and tests/plotting does that.
    """
    if request.node.get_closest_marker("drawn"):
        return
    from matplotlib.figure import Figure

    save = Figure.savefig

    def save_pixel(figure: Figure, file: Any, **options: Any) -> None:
        if options.get("format") != "png" or not hasattr(file, "write"):
            save(figure, file, **options)
        else:
            file.write(PIXEL)

    monkeypatch.setattr(Figure, "savefig", save_pixel)
