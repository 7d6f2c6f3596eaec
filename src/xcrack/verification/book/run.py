"""Cases found, chosen and run; what came of each."""

import math
import pkgutil
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

from xcrack.base.errors import ProblemError, collected_warnings
from xcrack.base.optional import require_package
from xcrack.verification.book import cases as package
from xcrack.verification.book.case import REQUIREMENTS, Case, Value


@dataclass(frozen=True)
class CaseRow:
    """One number of a case over all meshes that were run.

    Attributes
    ----------
    values : tuple of Value
        From the coarsest mesh to the finest.
    """

    values: tuple[Value, ...]

    @property
    def rate(self) -> float:
        """Power of the cell size with which the error falls; nan on one mesh, or at round-off."""
        errors = [value.error for value in self.values]
        if len(errors) < 2 or not all(error > 0 for error in errors):
            return math.nan
        return math.log2(errors[0] / errors[-1]) / (len(errors) - 1)

    @property
    def passed(self) -> bool:
        """Whether every error is within its tolerance, and the rate is what it has to be."""
        is_within = all(value.error <= value.tolerance for value in self.values)  # nan fails
        rate = self.values[0].rate
        return is_within and (rate is None or math.isnan(self.rate) or self.rate >= rate)


@dataclass(frozen=True)
class Result:
    """What came of a case.

    Attributes
    ----------
    case : Case
    rows : tuple of CaseRow
        One for each of its numbers.
    seconds : float
    error : str
        Why it could not be run to its end; empty where it was.
    skipped : str
        What it needs and is not there; empty where nothing is missing.
    warnings : tuple of str
    """

    case: Case
    rows: tuple[CaseRow, ...]
    seconds: float
    error: str = ""
    skipped: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the case was run, and all of its numbers are right."""
        return bool(self.rows) and not self.error and all(row.passed for row in self.rows)

    @property
    def status(self) -> str:
        """One word: passed, failed or skipped."""
        return "skipped" if self.skipped else "passed" if self.passed else "failed"

    @property
    def worst(self) -> CaseRow | None:
        """The number that uses most of its tolerance."""
        return max(self.rows, key=_use, default=None)


@dataclass(frozen=True)
class Book:
    """Results of all cases that were run.

    Attributes
    ----------
    results : tuple of Result
    quick : bool
        Whether only quick cases and coarsest meshes were asked for.
    """

    results: tuple[Result, ...]
    quick: bool

    @property
    def passed(self) -> bool:
        """Whether no case failed; skipped ones do not count."""
        return all(result.status != "failed" for result in self.results)

    @property
    def seconds(self) -> float:
        """Time that all cases took."""
        return sum(result.seconds for result in self.results)

    @property
    def uncovered(self) -> tuple[str, ...]:
        """Requirements that no case of the book covers, run or not."""
        requirements = {case.requirement for case in find_cases()}
        return tuple(text for key, text in REQUIREMENTS.items() if key not in requirements)

    def __str__(self) -> str:
        lines = [line_of(result) for result in self.results]
        count = {
            w: sum(r.status == w for r in self.results) for w in ("passed", "failed", "skipped")
        }
        lines.append(
            ", ".join(f"{n} {word}" for word, n in count.items()) + f"; {self.seconds:.0f} s"
        )
        lines += [f"no case covers: {text}" for text in self.uncovered]
        return "\n".join(lines)


def find_cases() -> tuple[Case, ...]:
    """All cases of the book, file by file.

    Raises
    ------
    ProblemError
        Two cases share an id.
    """
    cases: list[Case] = []
    for info in pkgutil.iter_modules(package.__path__):
        module: ModuleType = import_module(f"{package.__name__}.{info.name}")
        cases.extend(module.CASES)
    ids = [case.id for case in cases]
    double = {name for name in ids if ids.count(name) > 1}
    if double:
        raise ProblemError(f"cases share an id: {', '.join(sorted(double))}.")
    return tuple(cases)


def chosen(only: str = "", *, quick: bool = False) -> tuple[Case, ...]:
    """Cases whose id or requirement contains a text.

    Raises
    ------
    ProblemError
        No case does.
    """
    cases = tuple(
        case
        for case in find_cases()
        if (case.quick or not quick) and (only in case.id or only == case.requirement)
    )
    if not cases:
        raise ProblemError(
            f"no {'quick ' * quick}case has {only!r} in its id, and no requirement is called so: "
            f"requirements are {', '.join(REQUIREMENTS)}."
        )
    return cases


def run_case(case: Case, *, quick: bool = True) -> Result:
    """Run a case on its coarsest mesh, or on all of them.

    Parameters
    ----------
    case : Case
    quick : bool
        The coarsest mesh only.
    """
    missing_package = _missing_package(case.needs)
    if missing_package:
        return Result(case, (), 0.0, skipped=missing_package)
    messages: list[str] = []
    levels: list[Sequence[Value]] = []
    error, begin = "", time.perf_counter()
    try:
        with collected_warnings(messages):
            levels.extend(case.run(level) for level in range(1 if quick else case.levels))
    except Exception as problem:  # a case that breaks has failed; the others are run all the same
        error = "".join(traceback.format_exception_only(problem)).strip()
    return Result(
        case, _rows(levels), time.perf_counter() - begin, error, "", tuple(dict.fromkeys(messages))
    )


def run_cases(
    cases: Sequence[Case], *, quick: bool, report: Callable[[Result], None] | None = None
) -> Book:
    """Run cases one after the other; `report` sees each result as it comes."""
    results = []
    for case in cases:
        result = run_case(case, quick=quick)
        results.append(result)
        if report is not None:
            report(result)
    return Book(tuple(results), quick)


def line_of(result: Result) -> str:
    """A result in one line."""
    head = f"{result.status:<8}{result.case.id:<24}{result.case.modelling:<22}"
    if result.skipped:
        return f"{head}{result.skipped}"
    if result.error:
        return f"{head}{result.error.splitlines()[0]}"
    row = result.worst
    if row is None:
        return head
    last = row.values[-1]
    rate = "" if math.isnan(row.rate) else f", rate {row.rate:.2f}"
    return (
        f"{head}{last.name}: {last.value:.6g} for {last.reference:.6g}, error {last.error:.1e} of "
        f"{last.tolerance:.1e}{rate}; {result.seconds:.1f} s"
    )


def _rows(levels: Sequence[Sequence[Value]]) -> tuple[CaseRow, ...]:
    """Values of the same name, mesh by mesh."""
    names = dict.fromkeys(value.name for values in levels for value in values)
    return tuple(
        CaseRow(tuple(value for values in levels for value in values if value.name == name))
        for name in names
    )


def _use(row: CaseRow) -> float:
    """Share of the tolerance that the worst error uses; broken numbers use most."""
    if not row.passed:
        return math.inf
    return max(v.error / v.tolerance if v.tolerance else 0.0 for v in row.values)


def _missing_package(name: str) -> str:
    """Why a package that a case needs cannot be used; empty where it can."""
    if not name:
        return ""
    try:
        require_package(name, "this case")
    except Exception as error:
        return str(error).splitlines()[0]
    return ""


__all__ = ["Book", "CaseRow", "Result", "chosen", "find_cases", "line_of", "run_case", "run_cases"]
