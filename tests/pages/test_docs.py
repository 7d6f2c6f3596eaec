"""Every python block of the pages runs, in order, in a folder of its own."""

import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ["README.md", *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").glob("*.md"))]
# Seconds each: with the slow tests.
LONG = ("docs/three_dimensions.md", "docs/weld.md", "docs/life.md")
MADE = ("gallery/", "reference/", "about/")
BLOCK = re.compile(r"(<!-- needs gmsh -->\n)?```python\n(.*?)```", re.DOTALL)


def blocks(page):
    """Pairs (needs gmsh, code) of a page."""
    result = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))
    return [(bool(mark), code) for mark, code in result]


def pages(needs_gmsh):
    """Pages with such blocks; those that take seconds are slow."""
    slow = (pytest.mark.slow, pytest.mark.mission)
    return [
        pytest.param(page, marks=slow if page in LONG else ())
        for page in PAGES
        if any(gmsh == needs_gmsh for gmsh, _ in blocks(page))
    ]


def run(codes, folder):
    """Run blocks one after the other, as a reader would."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        names = {}
        for code in codes:
            exec(compile(code, "block", "exec"), names)
    finally:
        os.chdir(before)


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("page", pages(needs_gmsh=False))
def test_blocks_run(page, tmp_path):
    run([code for gmsh, code in blocks(page) if not gmsh], tmp_path)


@pytest.mark.gmsh
@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("page", pages(needs_gmsh=True))
def test_blocks_with_gmsh_run(page, tmp_path):
    header = "import numpy as np\nimport xcrack as xc\n"
    run([header, *[code for gmsh, code in blocks(page) if gmsh]], tmp_path)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    folder = (ROOT / page).parent
    for target in re.findall(r"\]\(([^)#:]+)\)", (ROOT / page).read_text(encoding="utf-8")):
        if target.startswith(MADE):  # with the site, by site_pages.py
            continue
        assert (folder / target).exists(), f"{page} links to {target}, which is not there"
