"""Growth runs against what they gave when they were stored: paths, K, rates and lives.

What they should be is tested elsewhere; here a change of the code shows what else it moves. Stored
by `python scripts/growth_scenes.py --save tests/data/growth_scenes.npz`.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scripts import growth_scenes, resume_scenes

STORED = Path(__file__).resolve().parent.parent / "data" / "growth_scenes.npz"
ROUND_OFF = 1e-6  # other processors add in another order, and contact and steps amplify it


@pytest.fixture(scope="module")
def stored():
    return dict(np.load(STORED))


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("name", growth_scenes.SCENES)
def test_scene(stored, name):
    before = {k[len(name) + 1 :]: v for k, v in stored.items() if k.startswith(f"{name}/")}
    apart = growth_scenes.differences(before, growth_scenes.run_of(name))
    assert max(apart.values()) <= ROUND_OFF, apart


@pytest.mark.slow
def test_a_scene_on_another_processor(tmp_path):
    """Other kernels, sums in another order: round-off must not choose points of a regular front."""
    other = {
        "NUMBA_CPU_NAME": "generic", "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3", "NUMBA_CACHE_DIR": str(tmp_path),
    }  # fmt: skip
    command = [sys.executable, growth_scenes.__file__, "--compare", str(STORED)]
    command += ["--only", "corner_crack_at_hole", "--tolerance", str(ROUND_OFF)]
    run = subprocess.run(
        command, env={**os.environ, **other}, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


LONG = ("penny", "surface", "corner", "pennies", "overloads_along", "tolerance_as")  # in space


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        name if name.startswith(LONG) else pytest.param(name, marks=pytest.mark.mission)
        for name in growth_scenes.SCENES
    ],
)
def test_scene_goes_on_after_each_step(name, tmp_path):
    """Stopped and resumed after each step, to the last bit of all files."""
    assert resume_scenes.differences(name, tmp_path) == []
