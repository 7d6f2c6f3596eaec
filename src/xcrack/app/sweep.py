"""A case file for many values of some of its keys: one table, one picture."""

import csv
import tomllib
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.app.case import read_case
from xcrack.app.case_run import growth_of_case, retarded_lives, solved_case
from xcrack.app.case_tables import read_tables
from xcrack.base.arguments import FileName, Switch, Whole, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors, written_whole
from xcrack.runs.campaign import Study, campaign, grid, key_of
from xcrack.runs.run_folder import STEPS
from xcrack.sif.stress_intensity import stress_intensities
from xcrack.view.lives import draw_sweep

TABLE, PICTURE = "sweep.csv", "sweep.png"
_MODES = ("K_I", "K_II", "K_III")


@check_arguments()
def sweep(
    path: FileName,
    values: Mapping[str, Sequence[Any]],
    *,
    folder: FileName | None = None,
    workers: Annotated[int, Whole(least=1, most=1024)] = 1,
    retry: Switch = False,
) -> Study:
    """Run a case file for all combinations of values of some keys.

    Parameters
    ----------
    path : path
        A toml file, as of `read_case`.
    values : mapping of key to sequence
        Such as ``{"cracks.0.radius": [1, 2, 3], "loads.0.value": ["80 MPa", "100 MPa"]}``: tables
        of a list and entries of an array are counted from 0.
    folder : path, optional
        For the results; by default beside the file, named as it with ``_sweep``.
    workers : int
        Processes of this machine.
    retry : bool
        Run those again that failed.

    Returns
    -------
    Study
        Of `campaign`: a row for each combination. The folder gets ``sweep.csv`` with all rows,
        ``sweep.png`` with life, or K, over the first key, and a folder ``run_...`` for each growth
        run, which `load`, `report` and `life` take.

    Raises
    ------
    ProblemError
        No such file or key, no values, a folder of another case file; as of `campaign`.

    Warns
    -----
    XcrackWarning
        Cases failed: how many, and the first error.

    Notes
    -----
    The results of a case that solves are the largest K_I, and the largest K_II and K_III by size,
    of each crack and state. What is finished stays: the same call goes on after a kill, in a growth
    run with its next step.
    """
    file = Path(path)
    if not isinstance(values, Mapping) or not values:
        raise ProblemError(
            f"sweep: values = {value_text(values)}: give a dict of keys of the file and lists, "
            'such as {"cracks.0.radius": [1, 2]}.'
        )
    keys = [str(key) for key in values]
    cases = grid(**{key: values[key] for key in keys})
    if not cases:
        raise ProblemError("sweep: values: a list is empty: give one value a key, at least.")
    title = read_tables(file, cases[0]).text("title", file.stem)  # wrong keys are said at once
    target = file.with_name(f"{file.stem}_sweep") if folder is None else Path(folder)
    with system_errors("the scene cannot be read from", file, error=ProblemError):
        text = file.read_text(encoding="utf-8")
    run_case = partial(run_changed, str(file), text, str(target))
    study = campaign(run_case, cases, path=target, workers=workers, retry=retry)
    _write(study, keys, title, target)
    return study


def run_changed(file: str, text: str, folder: str, /, **changes: Any) -> dict[str, Any]:
    """Results of a case file with other values; its text only tells one study from another.

    Parameters
    ----------
    file, text, folder : str
        Where the case is, what it says, and where results go.
    **changes
        Values by key.

    Returns
    -------
    dict
        Numbers and texts by name.
    """
    case = read_case(file, changes)
    if case.growth is None:
        result = solved_case(case)
        return _largest_K([result] if isinstance(result, Solution) else list(result))
    steps = Path(folder) / f"run_{key_of(changes)}" / STEPS
    history = growth_of_case(case, steps, is_resumed=True, keep_solutions=False, progress=False)
    return {
        "life": history.life,
        "steps": len(history.steps),
        "ended": history.ended,
        "folder": steps.parent.name,
        **{f"life_{name}": life.life for name, life in retarded_lives(case, history).items()},
    }


def _largest_K(solutions: Sequence[Solution]) -> dict[str, float]:
    """Largest K_I, and K_II and K_III by size, of each crack and state."""
    result = {}
    n = len(solutions[0].problem.cracks)
    for c in range(n):
        for k, sif in enumerate(stress_intensities(solutions, c)):
            suffix = f" of crack {c}" if n > 1 else ""
            suffix += f" in state {k}" if len(solutions) > 1 else ""
            for mode, column in zip(_MODES, sif.K.T):
                j = int(np.argmax(column if mode == "K_I" else np.abs(column)))
                result[mode + suffix] = float(column[j])
    if not result:
        result["energy"] = float(solutions[-1].energy)
    return result


def _write(study: Study, keys: Sequence[str], title: str, folder: Path) -> None:
    rows = study.table()
    with written_whole(
        folder / TABLE, "the table cannot be written to", error=ProblemError
    ) as part:
        with part.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(rows.dtype.names or ())
            writer.writerows(rows.tolist())
    names = rows.dtype.names or ()
    results = [name for name in names if name == "life" or name.startswith(_MODES[0])]
    if results:
        draw_sweep(rows, keys, results[0], folder / PICTURE, title=title)


def values_of(text: str) -> tuple[str, list[Any]]:
    """Key and values of an option such as ``cracks.0.radius=1,2,3``.

    Raises
    ------
    ProblemError
        No sign of equality, no key or no value.
    """
    key, sign, value_list = text.partition("=")
    parts = [part.strip() for part in value_list.split(",")]
    if not sign or not key.strip() or not all(parts):
        raise ProblemError(
            f"--set {text!r:.60}: give a key of the file and its values, such as "
            "cracks.0.radius=1,2,3."
        )
    return key.strip(), [_value(part) for part in parts]


def _value(text: str) -> Any:
    """A number, a flag or a text without its quotes."""
    try:
        value = tomllib.loads(f"v = {text}")["v"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text
    return value if isinstance(value, bool | int | float | str) else text


__all__ = ["sweep", "values_of"]
