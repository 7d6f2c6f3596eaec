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
# Pictures that say at a glance what a scene is come first: the thumbnail of a card is one of them.
FIRST = ("von_mises", "stress", "opening", "after", "stiff", "uncracked", "split", "flaws", "faces",
         "displacement", "bar_after_the_turn")  # fmt: skip
GROUPS = {
    "Bodies and meshes": ("mesh.",),
    "Decks of other programs": ("model.deck",),
    "Cracks": ("crack.",),
    "Materials, loads, supports": ("model.",),
    "Solve, adapt, save": ("analysis.", "linalg.", "adaptivity.", "estimate.", "fem.", "output."),
    "Stress intensity factors": ("sif.",),
    "Laws, metals and load histories": ("fatigue.",),
    "Growth": ("growth.",),
    "Lives, inspections, residual strength, campaigns": ("runs.",),
    "Pictures and reports": ("view.",),
    "Case files, command line, evidence": ("app.", "verification."),
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
    """A page for each example with what it prints, and a grid of thumbnails."""
    cards, names = [], []
    for script in sorted((root / "examples").glob("*.py")):
        title, words, blocks = parts_of(script)
        pictures, printed = results_of(script, root, folder)
        lines = [f"# {title}", "", words, ""]
        for picture in pictures:
            lines += [f"![{picture.stem.replace('_', ' ')}]({picture.name})", ""]
        if printed:
            lines += ["## What it prints", "", "```text", printed, "```", ""]
        for heading, code in blocks:
            lines += [f"## {heading}", ""] if heading else []
            lines += ["```python", code.strip("\n"), "```", ""]
        put(folder / f"{script.stem}.md", "\n".join(lines))
        names.append(f"{re.split('[:,]', title)[0]} <{script.stem}>")
        image = [f"[![]({pictures[0].name})]({script.stem}.md)", ""] if pictures else []
        first = re.split(r"(?<=[a-z)])\. ", words.partition("\n\n")[0].replace("\n", " "))[0]
        first = f"{first.rstrip('.:')}."
        cards += ["::::{container} card", *image, f"**[{title}]({script.stem}.md)**", "",
                  first, "::::", ""]  # fmt: skip
    toc = "\n".join(["```{toctree}", ":hidden:", "", *names, "```"])
    intro = "Narrated scripts of the folder `examples`; each checks its own numbers."
    grid = "\n".join([":::::{container} cards", "", *cards, ":::::"])
    put(folder / "index.md", f"# Gallery\n\n{intro}\n\n{toc}\n\n{grid}\n")


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


def results_of(script: Path, root: Path, folder: Path) -> tuple[list[Path], str]:
    """Pictures of an example beside its page, and what it prints: of a run now, or a stored one."""
    stored = sorted((root / "docs" / "figures" / "gallery").glob(f"{script.stem}*.png"))
    printed = root / "docs" / "figures" / "gallery" / f"{script.stem}.txt"
    text = printed.read_text(encoding="utf-8").rstrip() if printed.is_file() else ""
    stored.sort(key=lambda path: not path.stem.endswith(FIRST))
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
        return taken, run.stdout.rstrip()
    for picture in stored:
        shutil.copy(picture, folder / picture.name)
        taken.append(folder / picture.name)
    return taken, text


def write_reference(folder: Path) -> None:
    """A page for each public name, named as users write it, and lists with a line for each."""
    import xcrack

    left = dict(xcrack._HOME)
    parts, pages = [], []
    for title, homes in GROUPS.items():
        names = sorted(
            (name for name, home in left.items() if f"{home}.".startswith(homes)), key=str.lower
        )
        if not names:
            continue
        rows = []
        for name in names:
            home = left.pop(name)
            value = getattr(xcrack, name)
            kind = "autoclass" if isinstance(value, type) else "autofunction"
            options = ["   :members:", "   :no-inherited-members:"] if kind == "autoclass" else []
            first = (getattr(value, "__doc__", None) or "").strip().partition("\n")[0]
            place = f"`xcrack.{name}`, in `{home.replace('.', '/')}.py`"
            lines = [f"# {name}", "", place, "", "```{eval-rst}", f".. {kind}:: xcrack.{name}",
                     *options, "```", ""]  # fmt: skip
            put(folder / f"{slug(name)}.md", "\n".join(lines))
            rows.append(f"| [`{name}`]({slug(name)}.md) | {cell_text(first)} |")
            pages.append(slug(name))
        parts += [f"## {title}", "", "| name | what it is |", "|---|---|", *rows, ""]
    about = [
        "../glossary",
        "../theory",
        "../factorisation",
        "../developing",
        "../about/changelog",
        "../about/contributing",
    ]
    toc = "\n".join(["```{toctree}", ":hidden:", ":caption: About", "", *about, "```", "",
                     "```{toctree}", ":hidden:", ":caption: Names", "", *pages, "```"])  # fmt: skip
    intro = (
        "[Glossary](../glossary.md), [theory](../theory.md), [developing](../developing.md), "
        "[changelog](../about/changelog.md).\n\nWhat `import xcrack as xc` offers, from the "
        "docstrings: `help(xc.solve)` says the same."
    )
    put(folder / "index.md", "\n".join([f"# Reference\n\n{intro}\n\n{toc}\n", *parts]))


def slug(name: str) -> str:
    """Name of a page; capitals are told apart on disks that do not."""
    return f"{name}_class" if name[:1].isupper() else name


def cell_text(words: str) -> str:
    """A line as a cell of a table."""
    return words.replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")
