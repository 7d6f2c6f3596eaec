"""Run the verification book: what `xc.verify` and the command do."""

import json
import sys
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from xcrack.base.arguments import FilePath, Switch, Text, check_arguments
from xcrack.base.errors import ProblemError
from xcrack.base.paths import write_texts
from xcrack.runs.versions import versions
from xcrack.verification.book.page import book_page
from xcrack.verification.book.run import Book, Result, chosen, line_of, run_cases


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

    def after(result: Result) -> None:
        if progress:
            print(line_of(result), file=sys.stderr, flush=True)

    book = run_cases(chosen(only, quick=quick), quick=quick, after=after)
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
    known = versions()
    numbers = {"quick": book.quick, "passed": book.passed, "versions": known,
               "cases": [_content(result) for result in book.results],
               "uncovered": list(book.uncovered)}  # fmt: skip
    text = json.dumps(numbers, indent=1, ensure_ascii=False)
    texts = {path: book_page(book, known), path.with_suffix(".json"): text + "\n"}
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


__all__ = ["verify", "write_book"]
