"""Where a run is: a bar of tqdm where that is installed, a line a step else; always in the log."""

import logging
import sys
import time
from dataclasses import dataclass, field
from typing import Any

from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Step
from xcrack.growth.tracking.follow import following
from xcrack.optional import in_notebook

_LOG = logging.getLogger("xcrack")


@dataclass
class Progress:
    """What the user sees of a run; `progress="always"` gives lines in any surroundings.

    Every line also goes to the logger "xcrack", at level INFO.

    Attributes
    ----------
    run : Run
    """

    run: Run
    _bar: Any = None
    _cycles: float | None = None
    _begin: float = field(default_factory=lambda: time.perf_counter())

    def step(self, step: Step) -> None:
        """Tell of a step as soon as it is finished."""
        now = time.perf_counter()
        since = 0.0 if self._cycles is None else step.cycles - self._cycles
        line = _line(self.run, step)
        left = _left(self.run, step, since, now - self._begin)
        self._begin, self._cycles = now, step.cycles
        _LOG.info("%s%s", line, left)
        if not _is_wanted(self.run):
            return
        if self._bar is None and self.run.progress != "always":
            self._bar = _new_bar(self.run, step)
        if self._bar is None:
            print(line + left, file=sys.stderr)
        else:
            self._bar.set_postfix_str(f"N {step.cycles:.6g}, dK_eq {_largest(step.dK_eq):.5g}")
            self._bar.update()

    def end(self, ended: str) -> None:
        """Tell why growth ended."""
        _LOG.info("growth ended: %s", ended)
        if _is_wanted(self.run):
            print(f"growth ended: {ended}", file=sys.stderr)

    def close(self) -> None:
        """Leave the bar as it is: after the last step, or where something stopped the run."""
        if self._bar is not None:
            self._bar.close()


def _line(run: Run, step: Step) -> str:
    places = f"{following(run.problem.mesh).PLACE}s"
    return (
        f"step {step.index:4d}  N {step.cycles:12.6g}  largest dK_eq {_largest(step.dK_eq):10.5g}  "
        f"da {_largest(step.da):9.4g}  {places} {step.n_tips}"
    )


def _largest(parts: Any) -> float:
    return max((float(part.max(initial=0.0)) for part in parts), default=0.0)


def _new_bar(run: Run, step: Step) -> Any:
    """A bar for terminal or notebook, with the time that is left; None without tqdm."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=run.max_steps, initial=step.index, unit="step", file=sys.stderr)


def _left(run: Run, step: Step, cycles: float, seconds: float) -> str:
    """Time that is left if all steps take as long as this one; empty where nobody knows."""
    steps = [] if run.max_steps is None else [run.max_steps - 1.0 - step.index]
    if run.max_cycles is not None and cycles > 0:
        steps.append((run.max_cycles - step.cycles) / cycles)
    left = min(steps, default=0.0) * seconds
    if left <= 0:
        return ""
    unit, name = next(
        (u, n) for u, n in ((3600, "h"), (60, "min"), (1, "s")) if left >= u or u == 1
    )
    return f"  about {left / unit:.2g} {name} left"


def _is_wanted(run: Run) -> bool:
    """Whether lines are asked for, or standard error is a terminal or a cell of a notebook."""
    notebook = in_notebook() or type(sys.stderr).__module__.startswith("ipykernel")
    return run.progress == "always" or (run.progress is True and (notebook or sys.stderr.isatty()))


__all__ = ["Progress"]
