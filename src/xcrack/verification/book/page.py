"""The book as one HTML page: matrix of requirements, every number, what no case covers."""

import math
from typing import Any

from xcrack.base.markup import Markup, element, escape_html, join_parts, list_markup, page, table
from xcrack.verification.book.requirements import REQUIREMENTS
from xcrack.verification.book.run import Book, Result, find_cases

_MARK = {"passed": ("good", "✓"), "failed": ("bad", "✗"), "skipped": ("soft", "–")}


def book_page(book: Book, versions: dict[str, str]) -> str:
    """The whole page.

    Parameters
    ----------
    book : Book
    versions : dict
        Of xcrack, Python and the packages it was run with.
    """
    failed = [result for result in book.results if result.status == "failed"]
    verdict = "Every case passed." if book.passed else f"{len(failed)} case(s) failed."
    extent = "coarsest meshes of the quick cases" if book.quick else "all meshes"
    intro = (
        f"{len(book.results)} cases, {extent}, {book.seconds:.0f} s. Each number is compared with "
        "an exact solution, a published table or another program; an error is a share of the "
        "reference, or of the scale of the field. Run it yourself: python -m xcrack verify"
        + (" --quick" if book.quick else "")
    )
    uncovered = book.uncovered
    return page(
        "xcrack: verification book",
        element("h1", "Verification book of xcrack"),
        element("p", verdict, cls="good" if book.passed else "bad"),
        element("p", intro),
        element("h2", "Requirements"),
        _matrix(book),
        element("h2", "Requirements without a case"),
        list_markup(uncovered) if uncovered else element("p", "There are none."),
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
    what = (
        f"{REQUIREMENTS[case.requirement]} · {case.modelling} · {case.kind}: {case.reference} · "
        f"{result.seconds:.1f} s"
    )
    parts: list[Any] = [head, element("p", what)]
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


__all__ = ["book_page"]
