"""Constants, file names and public names that the pages quote are those of the code.

A number that a page takes from the code has a comment beside it that names the constant,
`<!-- xcrack.sif.domain_3d._OUTER = 2.6 -->`; semicolons separate several. The code must have the
value, and the paragraph must state it, as written in the comment or in the words that follow it:
`xcrack.growth.step.LEAST = 0.1: "a tenth of a cell"`.
"""

import importlib
import re
from ast import literal_eval
from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

import xcrack

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "xcrack"
PAGES = ["README.md", *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").glob("*.md"))]
COMMENT = re.compile(r"<!-- (xcrack\..*?) -->", re.DOTALL)
CONSTANT = re.compile(
    r'(xcrack[\w.]+)((?:\[[^\]]+\])?) = ([^:;]+?)(?:: "([^"]+)")?(?:;|$)'  # name, key, value, words
)


def one_line(text):
    return " ".join(text.split())


def paragraphs(text):
    """Blocks between empty lines; an item of a list is a block of its own."""
    return re.split(r"\n\s*\n|\n(?=\s*\* )", text)


def constants(page):
    """Rows (name, key, value, words, paragraph without comments) of a page."""
    rows = []
    for block in paragraphs((ROOT / page).read_text(encoding="utf-8")):
        plain = one_line(COMMENT.sub("", block))
        for comment in COMMENT.findall(block):
            line = one_line(comment)
            matches = list(CONSTANT.finditer(line))
            assert one_line(CONSTANT.sub("", line)) == "", f"{page}: {line} is not understood"
            rows += [(*match.groups(), plain) for match in matches]
    return rows


def in_code(name, key):
    """Value of a constant by its full name; an error says where a constant of that name is now."""
    words = name.split(".")
    for n in range(len(words) - 1, 0, -1):
        try:
            value = importlib.import_module(".".join(words[:n]))
        except ModuleNotFoundError:
            continue
        for word in words[n:]:
            assert hasattr(value, word), f"{name} is not in the code; {elsewhere(words[-1])}"
            value = getattr(value, word)
        return value[literal_eval(key[1:-1])] if key else value
    raise AssertionError(f"{name} is not in the code; {elsewhere(words[-1])}")


def elsewhere(word):
    assigned = re.compile(rf"^[\w, ]*\b{word}\b[^=\n]* = ", re.MULTILINE)
    files = [p for p in sorted(SOURCE.rglob("*.py")) if assigned.search(p.read_text("utf-8"))]
    return f"{word} is in " + (", ".join(str(p.relative_to(SOURCE)) for p in files) or "no file")


@pytest.mark.parametrize("page", [p for p in PAGES if constants(p)])
def test_quoted_constants_are_those_of_the_code(page):
    for name, key, value, words, paragraph in constants(page):
        assert in_code(name, key) == literal_eval(value), f"{page}: {name}{key} = {value}"
        stated = re.search(rf"(?<![\w.]){re.escape(words or value)}(?![\w]|\.\d)", paragraph)
        assert stated, f"{page}: {words or value} ({name}) is not in: {paragraph}"


def test_the_constants_that_matter_are_tied():
    tied = {name.rpartition(".")[2] + key for page in PAGES for name, key, *_ in constants(page)}
    assert tied >= {
        "_SHARE[1]", "_SHARE[2]", "_MOST[1]", "_MOST[2]", "_RANGE[1]", "_RANGE[2]",  # enrichment
        "_OUTER", "_OUTER[1]", "_OUTER[2]", "_REACH", "_BENT",  # domains of K
        "_DIRECT[1]", "_DIRECT[2]", "TOLERANCE",  # solvers
        "_ORDER", "points", "_OVERLAP", "LEAST", "FORMAT",
    }  # fmt: skip


@pytest.mark.parametrize("page", [*PAGES, "CONTRIBUTING.md"])
def test_files_named_on_pages_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for name in re.findall(r"`([\w/*.-]+\.py)`", text):
        folders = (ROOT, ROOT / "src", SOURCE, ROOT / "benchmarks")
        there = any(list(folder.glob(name)) for folder in folders)
        if "/" not in name:
            there = there or any(list((ROOT / f).rglob(name)) for f in ("tests", "examples"))
        assert there, f"{page} names {name}, which is not there"


def table_rows(page, head):
    """Cells of the rows of the table with this head."""
    _, _, rest = (ROOT / page).read_text(encoding="utf-8").partition(head + "\n")
    lines = rest.partition("\n\n")[0].splitlines()[1:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_packages_are_those_of_the_house():
    rows = table_rows("docs/developing.md", "| package | content |")
    named = {name for cell, _ in rows for name in re.findall(r"`(\w+)`", cell)}
    there = {p.parent.name for p in SOURCE.glob("*/__init__.py")}
    there |= {p.stem for p in SOURCE.glob("*.py")} - {"__init__", "__main__"}
    assert named == there


def test_glossary():
    rows = table_rows("docs/glossary.md", "| term | meaning | public name |")
    terms = [term for term, _, _ in rows]
    assert terms == sorted(terms, key=str.lower)
    assert len(terms) == len(set(terms)) > 40
    for _, _, names in rows:
        for name in re.findall(r"`([\w.]+)`", names):
            owner, _, attribute = name.partition(".")
            value = getattr(xcrack, owner, None) or contact_class(owner)
            if attribute:
                own = {f.name for f in fields(value)} if is_dataclass(value) else set()
                assert attribute in own or hasattr(value, attribute), name


def contact_class(name):
    """Classes of results that users meet but never make."""
    return getattr(importlib.import_module("xcrack.analysis.contact"), name)
