"""The bundled growth examples to a tolerance of 1 %, against stored runs that are much finer.

``python -m benchmarks.wanted_examples [example ...]`` makes the finer runs (tolerance 2e-3 in steps
a third as long as in the example) and stores path and life of the first tip in
``benchmarks/results/wanted_examples.json``. `errors` compares a run with them;
tests/growth/test_tolerance_examples.py holds the runs against 1 %.
"""

import json
import os
import runpy
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from scipy.interpolate import CubicSpline

import xcrack as xc
from xcrack.base.arrays import Floats

RESULT = Path(__file__).parent / "results" / "wanted_examples.json"
FOLDER = Path(__file__).parent.parent / "examples"
EXAMPLES = ("edge_crack_growth", "compact_tension", "two_holes")
FINE = 2e-3
_SHORTER = 3.0
_FARTHER = 1  # steps that the finer runs go on after the end of the example


@dataclass(frozen=True, eq=False)
class Growth:
    """The first call of `grow` in an example.

    Attributes
    ----------
    given : tuple
        Problem, law, criterion, cycle.
    options : dict
        All others, `da` too.
    until : callable or None
    """

    given: tuple[Any, ...]
    options: dict[str, Any]
    until: Callable[[xc.Step], bool] | None


class _CapturedError(Exception):
    pass


def growth_of(example: str) -> Growth:
    """What an example asks `grow` for; the example runs up to there, in a folder of its own."""
    seen: list[Any] = []

    def grow(*given: Any, **options: Any) -> str:
        seen.append((given, options))
        return "steps"

    def collect(steps: Any, *_: Any, until: Any = None, **__: Any) -> None:
        raise _CapturedError(until)

    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            with (
                warnings.catch_warnings(),
                mock.patch.object(xc, "grow", grow),
                mock.patch.object(xc, "collect", collect),
                mock.patch.object(sys, "stdout", open(os.devnull, "w", encoding="utf-8")),
            ):
                warnings.simplefilter("ignore")
                runpy.run_path(str(FOLDER / f"{example}.py"), run_name="__main__")
        except _CapturedError as stopped:
            until = stopped.args[0]
        finally:
            os.chdir(here)
    given, options = seen[-1]
    if len(given) > 4:
        options = {"da": given[4], **options}
    return Growth(given[:4], options, until)


def run(growth: Growth, tolerance: float, shorter: float | None = None) -> xc.History:
    """The growth of an example to a tolerance; in its own steps, divided, where that is given."""
    ends = ("da", "cycles", "progress", "max_steps")
    options = {k: v for k, v in growth.options.items() if k not in ends}
    asked = growth.until or (_far_enough(growth) if "max_steps" in growth.options else _never)
    if shorter is not None:
        for name in ("da", "cycles"):
            if growth.options.get(name) is not None:
                options[name] = growth.options[name] / shorter
    past = 0

    def until(step: xc.Step) -> bool:
        nonlocal past
        if shorter is None:
            return bool(asked(step))
        past += bool(past) or bool(asked(step))
        return past > shorter * _FARTHER

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        steps = xc.grow(*growth.given, tolerance=tolerance, progress=False, **options)
        return xc.collect(steps, until=until, keep_solutions=False)


def _never(step: xc.Step) -> bool:
    del step
    return False


def _far_enough(growth: Growth) -> Callable[[xc.Step], bool]:
    """As far as the steps of an example that ends with a number of them."""
    far = growth.options["da"] * (growth.options["max_steps"] - 1)

    def there(step: xc.Step) -> bool:
        now, first = (crack.points[crack.tips[-1]] for crack in (step.corrected[0], begin[0]))
        return bool(np.linalg.norm(now - first) >= far)

    begin = growth.given[0].placed
    return there


def way_of(history: xc.History) -> Floats:
    """Where the first tip is, and the cycles, at all steps that have tips `(n, 3)`."""
    rows: list[list[float]] = []
    for step in history.steps:
        if step.n_tips and step.corrected[0].tips:
            x = step.corrected[0].points[step.corrected[0].tips[-1]]
            if not rows or np.linalg.norm(x - rows[-1][:2]) > 1e-9:
                rows.append([*x, step.cycles])
    return np.array(rows)


def errors(history: xc.History, truth: Floats) -> tuple[float, float]:
    """Errors of path, over the length grown, and of life, at the last tip within the finer run."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1))])
    fine = np.linspace(0.0, s[-1], 20001)
    way = CubicSpline(s, truth)(fine)
    for last in way_of(history)[::-1]:
        away = np.linalg.norm(way[:, :2] - last[:2], axis=1)
        near = int(np.argmin(away))
        if near < len(fine) - 1:
            break
    return float(away[near] / fine[near]), abs(float(last[2] / way[near, 2] - 1))


def main() -> None:
    """Make and store the finer runs."""
    stored = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}
    for name in sys.argv[1:] or EXAMPLES:
        history = run(growth_of(name), FINE, _SHORTER)
        stored[name] = way_of(history).tolist()
        print(f"{name}: {len(history.steps)} steps, {history.life_bar}", flush=True)
        RESULT.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
