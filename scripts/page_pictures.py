"""Draw the pictures of the guide again: the first block of each page is run, and its picture kept.

``python scripts/page_pictures.py [page ...]``: names without ``.md``; all that have a picture in
``docs/figures/guide`` if none is given.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
import warnings
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parents[1] / "docs"
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
        colours = Image.open(picture).convert("RGB").quantize(128)
        colours.save(DOCS / "figures" / "guide" / picture, optimize=True)
        os.chdir(DOCS)


if __name__ == "__main__":
    pages = [DOCS / f"{name}.md" for name in sys.argv[1:]] or [
        page for page in sorted(DOCS.glob("*.md")) if PICTURE.search(page.read_text("utf-8"))
    ]
    for page in pages:
        print(page.name)
        draw(page)
