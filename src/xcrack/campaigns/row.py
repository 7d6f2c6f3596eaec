"""One case of a campaign: run, and what became of it as a row that can be stored."""

import hashlib
import json
import time
import traceback
import warnings
from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any

import numpy as np

from xcrack.errors import ProblemError, XcrackError
from xcrack.history.history import History
from xcrack.inputs import shown

Parameters = Mapping[str, Any]

COLUMNS = ("error", "seconds")
"""Columns of the table of a study that no parameter and no result may be named like."""


def key_of(parameters: Parameters) -> str:
    """Name of a case: the same for the same parameters, whatever their order."""
    return hashlib.sha256(json.dumps(parameters, sort_keys=True).encode()).hexdigest()[:16]


def checked(parameters: Any, number: int) -> dict[str, Any]:
    """Parameters of a case as values that a file can hold.

    Raises
    ------
    ProblemError
        No mapping of names to finite numbers, texts, flags or None, or a name of `COLUMNS`.
    """
    if not isinstance(parameters, Mapping):
        raise ProblemError(
            f"campaign: cases[{number}] = {shown(parameters)}: give a dict of the arguments "
            "of a case."
        )
    result: dict[str, Any] = {}
    for name, given in parameters.items():
        value = given.item() if isinstance(given, np.generic) else given
        if name in COLUMNS:
            raise ProblemError(
                f"campaign: cases[{number}] has a parameter {name!r}, which is a column of the "
                "table: give it another name."
            )
        fits = value is None or isinstance(value, bool | str)
        fits = fits or (isinstance(value, int | float) and bool(np.isfinite(value)))
        if not isinstance(name, str) or not fits:
            raise ProblemError(
                f"campaign: cases[{number}][{name!r:.40}] = {shown(given)}: give names, and finite "
                "numbers, texts, True, False or None; make meshes and laws within the case."
            )
        result[name] = value
    return result


def run_case(case: Callable[..., Any], parameters: dict[str, Any]) -> dict[str, Any]:
    """Run one case; what it raises becomes part of its row.

    Returns
    -------
    dict
        parameters, result (numbers and texts by name), error, kind, trace, warnings, seconds of the
        processor.
    """
    begin = time.process_time()
    row: dict[str, Any] = {"parameters": parameters, "result": {}, "error": "", "kind": ""}
    row["trace"] = ""
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        try:
            row["result"] = _numbers(case(**parameters), parameters)
        except XcrackError as error:
            row["error"], row["kind"] = str(error), type(error).__name__
        except Exception as error:
            row["error"], row["kind"] = str(error) or repr(error), type(error).__name__
            row["trace"] = traceback.format_exc()
    row["warnings"] = sorted({str(warning.message) for warning in seen})
    row["seconds"] = time.process_time() - begin
    return row


def _numbers(value: Any, parameters: Parameters) -> dict[str, Any]:
    """Result of a case: life and end of a history, or the numbers that the case returned."""
    if isinstance(value, History):
        last = value.steps[-1].index if value.steps else -1
        value = {"life": value.life, "steps": last + 1, "ended": value.ended}
    if isinstance(value, Mapping):
        result = {}
        for name, given in value.items():
            number = given.item() if isinstance(given, np.generic) else given
            if not isinstance(number, Real | str) or isinstance(number, complex):
                raise ProblemError(
                    f"campaign: a case returned {name!r:.40} = {shown(given)}: give numbers "
                    "and texts."
                )
            if name in COLUMNS or (name in parameters and number != parameters[name]):
                raise ProblemError(
                    f"campaign: a case returned {str(name)!r:.40}, which is a parameter or a "
                    "column of the table: give the result another name."
                )
            result[str(name)] = number
        return result
    raise ProblemError(
        f"campaign: a case returned {shown(value)}: give a History, or a dict of numbers."
    )


__all__ = ["COLUMNS", "Parameters", "checked", "key_of", "run_case"]
