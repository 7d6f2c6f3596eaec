"""Draw the pictures of pages again: those of the guide, and what the gallery has of examples.

``python scripts/page_pictures.py [page ...]`` runs the first block of each page of the guide and
keeps its picture: names without ``.md``; all that have one in ``docs/figures/guide`` if none is
given. ``python scripts/page_pictures.py penny --quick`` runs an example with these options and
keeps what it prints, and its pictures: those that the gallery has, or all if it has none.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parents[1] / "docs"
EXAMPLES = DOCS.parent / "examples"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
PICTURE = re.compile(r"\]\(figures/guide/([\w.]+)\)")


def draw(page: Path) -> None:
    """Run the first block of a page in a folder of its own and keep the picture it shows."""
    text = page.read_text(encoding="utf-8")
    (picture, *_), (code, *_) = PICTURE.findall(text), BLOCK.findall(text)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        os.chdir(folder)
        exec(compile(code, page.name, "exec"), {})
        keep(Path(picture), DOCS / "figures" / "guide" / picture)
        os.chdir(DOCS)


def keep(picture: Path, target: Path) -> None:
    """Store a picture with few colours, which is a small file."""
    image = Image.open(picture).convert("RGB")
    image.quantize(256, method=Image.Quantize.MAXCOVERAGE).save(target, optimize=True)


def run_example(script: Path, options: list[str]) -> None:
    """Keep what an example prints, and its pictures that the gallery shows."""
    gallery = DOCS / "figures" / "gallery"
    shown = {path.name for path in gallery.glob(f"{script.stem}_*.png")}
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, str(script), *options]
        run = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
        text = run.stdout.replace(f"{Path(folder).resolve()}/", "")
        (gallery / f"{script.stem}.txt").write_text(text, encoding="utf-8")
        for picture in sorted(Path(folder).rglob("*.png")):
            name = f"{script.stem}_{picture.stem}.png"
            if name in shown or not shown:
                keep(picture, gallery / name)


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if not word.startswith("-")]
    options = [word for word in sys.argv[1:] if word.startswith("-")]
    examples = [path for path in EXAMPLES.glob("*.py") if path.stem in names]
    for script in examples:
        run_example(script, options)
        names.remove(script.stem)
    pages = [DOCS / f"{name}.md" for name in names]
    if not pages and not examples:
        every = sorted(DOCS.glob("*.md"))
        pages = [page for page in every if PICTURE.search(page.read_text("utf-8"))]
    for page in pages:
        print(page.name)
        draw(page)
