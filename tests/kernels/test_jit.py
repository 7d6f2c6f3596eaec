"""Kernels where their cache cannot be written, or is damaged: fresh processes, one small kernel."""

import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

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
def package(tmp_path):
    """A copy of xcrack without compiled code."""
    source = tmp_path / "src" / "xcrack"
    shutil.copytree(ROOT / "src" / "xcrack", source, ignore=shutil.ignore_patterns("__pycache__"))
    return source


def run(package, *, home, temporary, user=None, **more):
    environment = {
        "PATH": os.environ["PATH"], "PYTHONPATH": str(package.parent), "HOME": str(home),
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
def test_a_damaged_cache_is_made_again(package, tmp_path):
    """Index, data, both; cut short or of other bytes: compiled anew, and whole afterwards."""
    where = {"home": tmp_path, "temporary": tmp_path, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    *first, compiled = run(package, **where)
    assert first == ["2.0", "0 0"]
    assert compiled.startswith("1 xcrack compiles kernels"), compiled  # once for all kernels
    assert run(package, **where) == ["2.0", "0 1", "0"]  # from the cache
    for kind, damage in (("*.nbi", b"\x80\x04nonsense"), ("*.nbc", b"")):
        for path in (tmp_path / "cache").rglob(kind):
            path.write_bytes(damage)
        assert run(package, **where)[:2] == ["2.0", "0 0"]
        assert run(package, **where)[:2] == ["2.0", "0 1"]


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0 or shutil.which("setpriv") is None,
    reason="needs root and setpriv to become a user who may write nothing",
)
def test_nothing_may_be_written(package, tmp_path):
    """A temporary folder of the user's own with one warning, or none at all with one warning."""
    for folder in (tmp_path, *tmp_path.parents):  # pytest's own are closed to others
        if folder.is_relative_to(tempfile.gettempdir()) and folder != Path(tempfile.gettempdir()):
            folder.chmod(0o755)
    nobody = {"home": "/nonexistent", "user": 65534}
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    first = run(package, temporary=shared, **nobody)
    assert first[:2] == ["2.0", "1 0"]
    assert "compiled kernels are stored in" in first[2]
    assert run(package, temporary=shared, **nobody)[:2] == ["2.0", "1 1"]
    (folder,) = shared.glob("xcrack-kernels-*")
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    # A folder of that name that somebody else has made is not trusted.
    shutil.rmtree(folder)
    folder.mkdir()
    folder.chmod(0o777)
    other = run(package, temporary=shared, **nobody)
    assert str(folder) + "." not in other[2]
    assert not list(folder.iterdir())
