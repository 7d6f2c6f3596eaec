"""The site is built without a warning: every link and anchor leads somewhere."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NEEDS = ("sphinx", "myst_parser", "numpydoc")
MISSING = [name for name in NEEDS if find_spec(name) is None]


def test_the_gallery_has_a_picture_and_the_words_of_each_example():
    """The one that is run as the site is built has none stored."""
    gallery = ROOT / "docs" / "figures" / "gallery"
    for script in (ROOT / "examples").glob("*.py"):
        if script.stem != "edge_crack_growth":
            assert list(gallery.glob(f"{script.stem}_*.png")), script.name
            assert (gallery / f"{script.stem}.txt").read_text(encoding="utf-8").strip()


def test_every_picture_is_shown():
    """On a page, or in the gallery with its example."""
    figures = ROOT / "docs" / "figures"
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    examples = tuple(f"{script.stem}_" for script in (ROOT / "examples").glob("*.py"))
    for picture in figures.rglob("*.png"):
        name = picture.relative_to(figures).as_posix()
        assert name in text or picture.name.startswith(examples), f"{name} is shown nowhere"


@pytest.mark.slow
@pytest.mark.skipif(bool(MISSING), reason=f"site not available: no {', '.join(MISSING)}")
def test_the_site_has_no_warning(tmp_path):
    """Without the examples, which `make docs` runs."""
    for name in ("docs", "examples", "src"):
        ignored = shutil.ignore_patterns("gallery", "reference", "about", "__pycache__", "out")
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignored)
    shutil.copytree(ROOT / "docs/figures", tmp_path / "docs/figures", dirs_exist_ok=True)
    for name in ("CHANGELOG.md", "CONTRIBUTING.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    run = subprocess.run([*command, "docs", "site"], cwd=tmp_path, capture_output=True, text=True,
                         env={**os.environ, "XCRACK_DOCS_RUN": "0"}, check=False)  # fmt: skip
    assert run.returncode == 0, run.stderr[-3000:]
    site = tmp_path / "site"
    pages = {path.relative_to(site): path for path in site.rglob("*.html")}
    pages = {name: path for name, path in pages.items() if name.parts[0] != "_static"}
    assert len(pages) > 30
    for name, path in pages.items():
        text = path.read_text(encoding="utf-8")
        for link in re.findall(r'(?:href|src)="([^"#:]+)(?:#[^"]*)?"', text):
            assert (path.parent / link.partition("?")[0]).exists(), f"{name} links to {link}"
