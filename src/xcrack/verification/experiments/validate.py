"""Compare predictions with the tests of others: what `xc.validate` and the command do."""

import sys
import time
import traceback
from dataclasses import dataclass, replace
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Annotated

from xcrack.base.arguments import FilePath, Switch, Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, collected_warnings
from xcrack.base.machine import versions
from xcrack.base.optional import require_package
from xcrack.base.paths import system_errors, write_texts
from xcrack.verification.experiments import (
    fronts,
    half_disc,
    lives,
    rethore,
    shear,
    wagner,
)
from xcrack.verification.experiments.experiment import Experiment, Trial, read_experiment
from xcrack.verification.experiments.outcome import Outcome
from xcrack.verification.experiments.page import validation_page

TRIALS: tuple[Trial, ...] = (
    *wagner.TRIALS,
    *rethore.TRIALS,
    *half_disc.TRIALS,
    *shear.TRIALS,
    *lives.TRIALS,
    *fronts.TRIALS,
)
_UNWRITTEN = "the results cannot be written to"


@dataclass(frozen=True)
class Validation:
    """What came of all tests.

    Attributes
    ----------
    outcomes : tuple of Outcome
    quick : bool
    folder : Path, optional
        Where measured numbers were read from that the package does not hold.
    """

    outcomes: tuple[Outcome, ...]
    quick: bool
    folder: Path | None = None

    @property
    def passed(self) -> bool:
        """Whether what is asserted holds in every test that was run."""
        return all(each.status not in ("differs", "failed") for each in self.outcomes)

    @property
    def seconds(self) -> float:
        """Time of one processor; stored results count with what they took."""
        return sum(each.seconds for each in self.outcomes if each.seconds == each.seconds)

    def __str__(self) -> str:
        words = ("agrees", "differs", "reported", "skipped", "failed")
        count = {word: sum(each.status == word for each in self.outcomes) for word in words}
        total = ", ".join(f"{n} {word}" for word, n in count.items() if n)
        return "\n".join([*map(line_of, self.outcomes), f"{total}; {self.seconds:.0f} s"])


@check_arguments()
def validate(
    only: Annotated[str, Text("a part of a test's name", may_be_empty=True)] = "",
    *,
    quick: Switch = False,
    file: Annotated[str | PathLike[str], FilePath(is_file=True)] | None = None,
    data: Annotated[str | PathLike[str], FilePath()] | None = None,
    progress: Switch = True,
) -> Validation:
    """Predict tests that others made, and put what they measured beside it.

    Parameters
    ----------
    only : str
        Tests that have this in their name.
    quick : bool
        Tests in the plane with coarse cells and long steps: less than 90 seconds on one core.
    file : path, optional
        Where to write the page *Predicted and measured*. The result of each test is kept in the
        folder beside it of the same name with ``.results``: a run that was stopped goes on there,
        and a test whose result is there, from the same version, is not run again.
    data : path, optional
        Folder with measured numbers whose licence does not let them be in the package, in files
        such as ``rethore_2018.toml``; without it figures quoted from their sources stand for them.
    progress : bool
        Print a line on standard error for each test.

    Returns
    -------
    Validation
        Printed, it gives a line for each test; `passed` says whether what is asserted holds.

    Raises
    ------
    ProblemError
        No test of that name, a folder that is not there, or a file that cannot be written.

    Notes
    -----
    Validation is no proof: it says how near a prediction came to the tests that were at hand, with
    the constants that their authors measured. Lives within a factor of 1.5 to 2 are what tests of
    one material scatter.

    Examples
    --------
    >>> import xcrack as xc
    >>> print(xc.validate("demir", quick=True, progress=False).outcomes[0].status)
    agrees
    """
    page = None if file is None else Path(file)
    folder = None if data is None else Path(data)
    if folder is not None and not folder.is_dir():
        raise ProblemError(f"validate: data = {value_text(str(folder))} is no folder.")
    trials = [t for t in TRIALS if only in t.name and (t.quick or not quick)]
    if not trials:
        names = ", ".join(t.name for t in TRIALS)
        raise ProblemError(
            f"validate: no {'quick ' * quick}test has {only!r} in its name: give a part of {names}."
        )
    outcomes = []
    for trial in trials:
        experiment = read_experiment(trial.name, folder)
        store = None if page is None else page.with_suffix(".results")
        outcomes.append(_outcome(trial, experiment, quick, store))
        if progress:
            print(line_of(outcomes[-1]), file=sys.stderr, flush=True)
    result = Validation(tuple(outcomes), quick, folder)
    if page is not None:
        write_validation(result, page)
    return result


def write_validation(validation: Validation, page: Path) -> None:
    """Write the page of results.

    Raises
    ------
    ProblemError
        The system refuses.
    """
    tests = [read_experiment(each.name, validation.folder) for each in validation.outcomes]
    text = validation_page(validation.outcomes, tests, versions(), quick=validation.quick)
    write_texts({page: text}, "the page cannot be written to", error=ProblemError)


def line_of(outcome: Outcome) -> str:
    """A result in one line."""
    head = f"{outcome.status:<9}{outcome.name:<18}"
    if outcome.skipped or outcome.error:
        return head + (outcome.skipped or outcome.error.splitlines()[0])
    judged = [c for c in outcome.comparisons if c.is_asserted] or list(outcome.comparisons)
    first = next((c for c in judged if not c.passed), judged[0])
    unit = "" if first.measure == "ratio" else f" {first.unit}"
    return f"{head}{first.name}: {first.value:.3g}{unit}; {outcome.seconds:.1f} s"


def _outcome(trial: Trial, experiment: Experiment, quick: bool, store: Path | None) -> Outcome:
    """The stored result of a trial, or what comes of it now."""
    key = _key(experiment, quick)
    path = None if store is None else store / f"{trial.name}.{key}.json"
    if path is not None and path.is_file():
        try:
            with system_errors("the results cannot be read from", path, error=ProblemError):
                return Outcome.from_json(path.read_text(encoding="utf-8"))
        except (ValueError, KeyError, TypeError):
            pass  # cut off by a stop, or another form: run it again
    outcome = run_trial(trial, experiment, quick=quick)
    if path is not None and not (outcome.skipped or outcome.error):
        write_texts({path: outcome.to_json() + "\n"}, _UNWRITTEN, error=ProblemError)
    return outcome


def _key(experiment: Experiment, quick: bool) -> str:
    """Of what a result hangs on: version, measured numbers, and what is quick."""
    text = repr((versions()["xcrack"], experiment, quick))
    return sha256(text.encode()).hexdigest()[:12]


def run_trial(trial: Trial, experiment: Experiment, *, quick: bool) -> Outcome:
    """Predict one test; what it lacks, and what goes wrong, is in the outcome."""
    missing_package = _missing_package(trial.needs)
    no_outcome = Outcome(trial.name, (trial.name,), quick=quick)
    if missing_package:
        return replace(no_outcome, skipped=missing_package, seconds=0.0)
    messages: list[str] = []
    begin = time.process_time()
    try:
        with collected_warnings(messages):
            outcome = trial.run(experiment, quick)
    except Exception as problem:  # the others are run all the same
        text = "".join(traceback.format_exception_only(problem)).strip()
        return replace(no_outcome, error=text, seconds=time.process_time() - begin)
    seconds = time.process_time() - begin
    warnings = tuple(dict.fromkeys(messages))
    return replace(outcome, quick=quick, seconds=seconds, warnings=warnings)


def _missing_package(name: str) -> str:
    """Why a package that a trial needs cannot be used; empty where it can."""
    if not name:
        return ""
    try:
        require_package(name, "this test")
    except Exception as error:
        return str(error).splitlines()[0]
    return ""


__all__ = ["TRIALS", "Validation", "line_of", "run_trial", "validate", "write_validation"]
