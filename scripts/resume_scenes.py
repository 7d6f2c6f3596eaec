"""Stop each growth scene after each of its steps, resume it, and compare all files byte for byte.

    python scripts/resume_scenes.py                # all scenes
    python scripts/resume_scenes.py --only penny

One thread: sums in another order have other last bits. `tests/growth/test_scenes.py` does the same.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    import os

    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
    for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[_name] = "1"

import xcrack as xc
from scripts import growth_scenes


def arguments_of(name: str) -> dict[str, Any]:
    """Arguments of a scene, for `grow` and `resume` alike."""
    problem, cycle, options = growth_scenes.SCENES[name]()
    given = {"law": growth_scenes.LAW, "criterion": xc.max_hoop_stress, "progress": False}
    return {**given, "problem": problem, "cycle": cycle, **options}


def files_of(folder: Path) -> dict[str, bytes]:
    """Content of a run, by the names of its files."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def differences(name: str, folder: Path) -> list[str]:
    """Stops of a scene after which a resumed run is another one, with the files that differ."""
    given = arguments_of(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        whole = xc.collect(xc.grow(**given), folder / "whole", keep_solutions=False)
        expected, result = files_of(folder / "whole"), []
        for stop in range(len(whole.steps)):
            part = folder / f"part_{stop}"
            shutil.copytree(folder / "whole", part)
            for path in sorted(part.glob("step_*.npz"))[stop + 1 :]:
                path.unlink()
            xc.resume(part, **given, keep_solutions=False)
            now = files_of(part)
            other = {k for k in {*expected, *now} if expected.get(k) != now.get(k)}
            result += [f"{name}, resumed after step {stop}: {', '.join(sorted(other))}"] * bool(
                other
            )
    return result


def main() -> int:
    """Stop and resume all scenes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--only", default="", help="part of the name of a scene")
    options = parser.parse_args()
    wrong = []
    for name in growth_scenes.SCENES:
        if options.only in name:
            start = time.perf_counter()
            with tempfile.TemporaryDirectory() as folder:
                lines = differences(name, Path(folder))
            print(
                f"{name:32} {time.perf_counter() - start:6.1f} s  {lines or 'the same'}", flush=True
            )
            wrong += lines
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
