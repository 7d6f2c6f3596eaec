"""Run the verification book, and write its page: what `xc.verify` and the command do."""

import json
import math
import sys
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from xcrack.base.arguments import FilePath, Switch, Text, check_arguments
from xcrack.base.errors import ProblemError
from xcrack.base.machine import versions
from xcrack.base.markup import Markup, element, escape_html, join_parts, list_markup, page, table
from xcrack.base.paths import write_texts
from xcrack.verification.book.case import REQUIREMENTS
from xcrack.verification.book.run import Book, Result, chosen, find_cases, line_of, run_cases

_MARK = {"passed": ("good", "✓"), "failed": ("bad", "✗"), "skipped": ("soft", "–")}


def book_page(book: Book, versions: dict[str, str]) -> str:
    """The whole page.

    Parameters
    ----------
    book : Book
    versions : dict
        Of xcrack, Python and the packages it was run with.
    """
    failures = [result for result in book.results if result.status == "failed"]
    verdict = "Every case passed." if book.passed else f"{len(failures)} case(s) failed."
    extent = "coarsest meshes of the quick cases" if book.quick else "all meshes"
    intro = (
        f"{len(book.results)} cases, {extent}, {book.seconds:.0f} s. Each number is compared with "
        "an exact solution, a published table or another program; an error is a share of the "
        "reference, or of the scale of the field. Run it yourself: python -m xcrack verify"
        + (" --quick" if book.quick else "")
    )
    gaps = book.uncovered
    return page(
        "xcrack: verification book",
        element("h1", "Verification book of xcrack"),
        element("p", verdict, cls="good" if book.passed else "bad"),
        element("p", intro),
        element("h2", "Requirements"),
        _matrix(book),
        element("h2", "Requirements without a case"),
        list_markup(gaps) if gaps else element("p", "There are none."),
        element("h2", "Cases"),
        *(_case(result) for result in book.results),
        element("h2", "Versions"),
        table((), tuple(versions.items())),
    )


def _matrix(book: Book) -> Markup:
    """Requirement × modelling; each entry links to its case."""
    columns = sorted({case.modelling for case in find_cases()})
    entries: dict[tuple[str, str], list[Markup]] = {}
    for result in book.results:
        case = result.case
        entries.setdefault((case.requirement, case.modelling), []).append(_link(result))
    rows: list[list[Any]] = []
    for key, text in REQUIREMENTS.items():
        cells = [join_parts(*entries.get((key, column), [])) for column in columns]
        rows.append([text, *cells])
    return table(("requirement", *columns), rows)


def _link(result: Result) -> Markup:
    kind, mark = _MARK[result.status]
    link = (
        f'<a href="#{escape_html(result.case.id)}" title="{escape_html(result.case.id)}">{mark}</a>'
    )
    return element("span", Markup(link), cls=kind)


def _case(result: Result) -> Markup:
    case = result.case
    kind, mark = _MARK[result.status]
    head = Markup(
        f'<h3 id="{escape_html(case.id)}">{element("span", mark, cls=kind)} {case.id}</h3>'
    )
    label = (
        f"{REQUIREMENTS[case.requirement]} · {case.modelling} · {case.kind}: {case.reference} · "
        f"{result.seconds:.1f} s"
    )
    parts: list[Any] = [head, element("p", label)]
    if result.skipped or result.error:
        parts.append(element("pre", result.skipped or result.error))
    rows = [
        (
            value.name, level, value.value, value.reference, f"{value.error:.1e}",
            f"{value.tolerance:.1e}", _rate(row.rate) if value is row.values[-1] else "",
            element("span", *(("ok",) if row.passed else ("fails",)),
                    cls="good" if row.passed else "bad"),
        )
        for row in result.rows
        for level, value in enumerate(row.values)
    ]  # fmt: skip
    if rows:
        head_row = ("number", "mesh", "value", "reference", "error", "tolerance", "rate", "")
        parts.append(table(head_row, rows))
    if result.warnings:
        parts.append(element("p", f"{len(result.warnings)} warning(s), such as:", cls="soft"))
        parts.append(list_markup(result.warnings[:2]))
    return join_parts(*parts)


def _rate(rate: float) -> str:
    return "" if math.isnan(rate) else f"{rate:.2f}"


@check_arguments()
def verify(
    only: Annotated[str, Text("a part of the name of a case", may_be_empty=True)] = "",
    *,
    quick: Switch = False,
    file: Annotated[str | PathLike[str] | None, FilePath(is_file=True)] = None,
    progress: Switch = True,
) -> Book:
    """Compare this installation with exact solutions, published tables and other programs.

    Parameters
    ----------
    only : str
        Run cases that have this in their name, or the requirement of this key.
    quick : bool
        Quick cases on their coarsest mesh: less than three minutes on two cores.
    file : path, optional
        Where to write the book as a page; numbers go into a ``.json`` file beside it.
    progress : bool
        Print a line on standard error for each case.

    Returns
    -------
    Book
        Printed, it gives a line for each case; `passed` says whether all of them are right.

    Raises
    ------
    ProblemError
        No case of that name, or a file that cannot be written.

    Examples
    --------
    >>> import xcrack as xc
    >>> xc.verify("cycle-rule", quick=True, progress=False).passed
    True
    """

    def report_case(result: Result) -> None:
        if progress:
            print(line_of(result), file=sys.stderr, flush=True)

    book = run_cases(chosen(only, quick=quick), quick=quick, report=report_case)
    if file is not None:
        write_book(book, Path(file))
    return book


def write_book(book: Book, path: Path) -> None:
    """Write a book as a page, and its numbers beside it.

    Raises
    ------
    ProblemError
        The system refuses.
    """
    versions_in_use = versions()
    numbers = {"quick": book.quick, "passed": book.passed, "versions": versions_in_use,
               "cases": [_content(result) for result in book.results],
               "uncovered": list(book.uncovered)}  # fmt: skip
    text = json.dumps(numbers, indent=1, ensure_ascii=False)
    texts = {path: book_page(book, versions_in_use), path.with_suffix(".json"): text + "\n"}
    write_texts(texts, "the book cannot be written to", error=ProblemError)


def _content(result: Result) -> dict[str, Any]:
    case = result.case
    return {
        "id": case.id, "requirement": case.requirement, "modelling": case.modelling,
        "kind": case.kind, "reference": case.reference, "status": result.status,
        "seconds": round(result.seconds, 3), "error": result.error or result.skipped,
        "numbers": [
            {"name": v.name, "mesh": level, "value": v.value, "reference": v.reference,
             "error": v.error, "tolerance": v.tolerance}
            for row in result.rows for level, v in enumerate(row.values)
        ],
    }  # fmt: skip


__all__ = ["book_page", "verify", "write_book"]
