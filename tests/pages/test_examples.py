"""Every example runs from any folder, keeps what it asserts, and leaves its pictures."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "examples").glob("*.py"))
IN_SPACE = (
    "cylinder_bending",
    "penny",
    "semi_elliptic_growth",
    "corner_crack_at_hole",
    "small_crack",
    "weld_toe",
)  # seconds with --quick
MANY = ("flaw_campaign",)  # minutes without --quick
PLANE = [path for path in EXAMPLES if path.stem not in (*IN_SPACE, *MANY)]
SPACE = [path for path in EXAMPLES if path.stem in IN_SPACE]

# An example that warns is a bad example.
RUN = (
    "import runpy, sys, warnings, xcrack; "
    "warnings.simplefilter('error', xcrack.XcrackWarning); "
    "runpy.run_path(sys.argv[1], run_name='__main__')"
)


def test_there_are_examples():
    assert {path.stem for path in EXAMPLES} >= {
        "plate_with_hole", "edge_crack_growth", "two_holes", "turning_load", "compressed_crack",
        "link_up",
        *IN_SPACE,
    }  # fmt: skip


def run_and_look(tmp_path, script, *options, timeout):
    """Run an example in a folder of its own, with warnings as errors, and look at what it left."""
    run = subprocess.run(
        [sys.executable, "-c", RUN, str(script), *options],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg", "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=timeout,
        check=False,
    )
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-4000:]
    folder = tmp_path / "out" / script.stem
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == [script.stem]
    assert str(folder) in run.stdout.splitlines()[-1]  # it says where things are
    pictures = sorted(folder.glob("*.png"))
    assert len(pictures) >= 2
    for picture in pictures:
        image = matplotlib.image.imread(picture)
        assert min(image.shape[:2]) > 300
        assert image[..., :3].std() > 0.01, f"{picture.name} is blank"
    assert list(folder.glob("*.csv"))
    assert list(folder.rglob("*.vtu"))
    assert list(folder.rglob("*.vtp"))


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("script", PLANE, ids=lambda path: path.stem)
def test_example_runs_from_another_folder_and_leaves_pictures(script, tmp_path):
    run_and_look(tmp_path, script, timeout=500)


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("name", MANY)
def test_campaign_runs_with_a_few_cases(name, tmp_path):
    script = next(path for path in EXAMPLES if path.stem == name)
    run_and_look(tmp_path, script, "--quick", timeout=500)


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.gmsh
@pytest.mark.plot
@pytest.mark.parametrize("script", SPACE, ids=lambda path: path.stem)
def test_example_in_space_runs_on_a_coarse_mesh(script, tmp_path):
    run_and_look(tmp_path, script, "--quick", timeout=500)


@pytest.mark.slow
@pytest.mark.gmsh
@pytest.mark.plot
def test_inclined_crack_runs_on_a_coarse_mesh(tmp_path):
    script = next(path for path in SPACE if path.stem == "cylinder_bending")
    run_and_look(tmp_path, script, "--quick", "--skew", timeout=500)


@pytest.mark.slow
@pytest.mark.gmsh
@pytest.mark.plot
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("script", SPACE, ids=lambda path: path.stem)
def test_example_in_space_runs_at_full_size(script, tmp_path):
    run_and_look(tmp_path, script, timeout=3500)
