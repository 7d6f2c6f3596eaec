"""Pages of the site that are made from the code: gallery, reference, changelog.

An example that runs in less than a minute is run in the build, and its pictures are shown; the
others show those of a stored run in `figures/gallery`.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

QUICK = ("edge_crack_growth",)
GROUPS = {
    "Bodies and meshes": ("mesh.",),
    "Cracks": ("crack.",),
    "Scene": ("scene.",),
    "Solutions": ("analysis.", "solvers.", "post.", "contact."),
    "Stress intensity factors": ("sif.",),
    "Laws, load histories and growth": ("laws.", "spectra.", "growth.", "history.", "life."),
    "Pictures, charts and reports": ("plotting.", "charting.", "reporting.", "post."),
    "Command, case files, verification": ("command.", "casefile.", "book."),
    "Others": ("",),
}


def write(docs: Path) -> None:
    """Write all pages; folders of an earlier build are replaced."""
    root = docs.parent
    for name in ("gallery", "reference", "about"):
        shutil.rmtree(docs / name, ignore_errors=True)
        (docs / name).mkdir()
    write_gallery(root, docs / "gallery")
    write_reference(docs / "reference")
    for name in ("CHANGELOG", "CONTRIBUTING"):
        text = (root / f"{name}.md").read_text(encoding="utf-8")
        text = text.replace("](docs/", "](../").replace("](CHANGELOG.md)", "](changelog.md)")
        text = re.sub(r"\[([^\]]+)\]\(LICENSE\)", r"\1", text)
        put(docs / "about" / f"{name.lower()}.md", text)


def put(path: Path, text: str) -> None:
    """Write a page where it has changed: an unchanged one is not built again."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_gallery(root: Path, folder: Path) -> None:
    """A page for each example, and one that shows them all."""
    cards, names = [], []
    for script in sorted((root / "examples").glob("*.py")):
        title, words, blocks = parts_of(script)
        pictures = pictures_of(script, root, folder)
        lines = [f"# {title}", "", words, ""]
        for picture in pictures:
            lines += [f"![{picture.stem.replace('_', ' ')}]({picture.name})", ""]
        for heading, code in blocks:
            lines += [f"## {heading}", ""] if heading else []
            lines += ["```python", code.strip("\n"), "```", ""]
        put(folder / f"{script.stem}.md", "\n".join(lines))
        names.append(script.stem)
        image = f"[![{title}]({pictures[0].name})]({script.stem}.md)\n\n" if pictures else ""
        cards.append(
            f"## [{title}]({script.stem}.md)\n\n{image}{words.partition(chr(10) * 2)[0]}\n"
        )
    toc = "\n".join(["```{toctree}", ":hidden:", "", *names, "```"])
    intro = "Narrated scripts of the folder `examples`; each checks its own numbers."
    put(folder / "index.md", f"# Gallery\n\n{intro}\n\n{toc}\n\n" + "\n".join(cards))


def parts_of(script: Path) -> tuple[str, str, list[tuple[str, str]]]:
    """Title, words and blocks (heading, code) of an example."""
    text = script.read_text(encoding="utf-8")
    tree = ast.parse(text)
    docstring = ast.get_docstring(tree) or script.stem
    first, _, rest = docstring.partition("\n\n")
    body = "\n".join(text.splitlines()[tree.body[0].end_lineno or 0 :])
    blocks = []
    for part in re.split(r"^# %%", body, flags=re.MULTILINE):
        heading, _, code = part.partition("\n")
        if code.strip():
            blocks.append((heading.strip() if part is not body else "", code))
    rest = re.sub(r"^    (.*)$", r"`\1`  ", rest, flags=re.MULTILINE)  # commands
    title = " ".join(first.split()).rstrip(".")
    return title, rest.replace("<", "&lt;").replace("*", "\\*"), blocks


def pictures_of(script: Path, root: Path, folder: Path) -> list[Path]:
    """Pictures of an example beside its page: of a run now, or of a stored one."""
    stored = sorted((root / "docs" / "figures" / "gallery").glob(f"{script.stem}*.png"))
    taken = []
    if script.stem in QUICK and os.environ.get("XCRACK_DOCS_RUN", "1") != "0":
        with tempfile.TemporaryDirectory() as name:
            run = subprocess.run([sys.executable, str(script)], cwd=name, check=False,
                                 capture_output=True, text=True, timeout=600)  # fmt: skip
            if run.returncode:
                raise RuntimeError(f"{script.name} does not run:\n{run.stderr[-3000:]}")
            for picture in sorted(Path(name).rglob("*.png")):
                target = folder / f"{script.stem}_{picture.stem}.png"
                shutil.copy(picture, target)
                taken.append(target)
        return taken
    for picture in stored:
        shutil.copy(picture, folder / picture.name)
        taken.append(folder / picture.name)
    return taken


def write_reference(folder: Path) -> None:
    """A page for each group of public names, from their docstrings."""
    import xcrack

    left = {name: home for name, home in xcrack._HOME.items()}
    pages = []
    for title, homes in GROUPS.items():
        mine = [name for name, home in left.items() if home.startswith(homes)]
        if not mine:
            continue
        for name in mine:
            del left[name]
        slug = re.sub(r"\W+", "_", title.lower()).strip("_")
        lines = [f"# {title}", ""]
        for name in sorted(mine, key=str.lower):
            kind = "autoclass" if isinstance(getattr(xcrack, name), type) else "autofunction"
            full = f"xcrack.{xcrack._HOME[name]}.{name}"
            own = xcrack._HOME[name]
            options = [":members:", ":no-inherited-members:"] if kind == "autoclass" else []
            lines += [f"## {name}", "", f"`xcrack.{name}`, in `{own.replace('.', '/')}.py`", "",
                      "```{eval-rst}", f".. {kind}:: {full}",
                      *(f"   {option}" for option in options), "```", ""]  # fmt: skip
        put(folder / f"{slug}.md", "\n".join(lines))
        pages.append(slug)
    toc = "\n".join(["```{toctree}", ":maxdepth: 2", "", *pages, "```"])
    intro = (
        "What `import xcrack as xc` offers, from the docstrings: `help(xc.solve)` says the same."
    )
    put(folder / "index.md", f"# Reference\n\n{intro}\n\n{toc}\n")
