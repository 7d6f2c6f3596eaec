"""Growth runs against what they gave when they were stored: paths, K, rates and lives.

What they should be is tested elsewhere; here a change of the code shows what else it moves. Stored
by `python scripts/growth_scenes.py --save tests/data/growth_scenes.npz`.
"""

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
