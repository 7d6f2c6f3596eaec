"""Where a run is: a bar of tqdm where that is installed, a line a step else; always in the log."""

import logging
import re
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from xcrack.base.errors import XcrackWarning, collected_warnings, warn
from xcrack.base.optional import in_notebook
from xcrack.crack.stations import GEOMETRY
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Step

_LOG = logging.getLogger("xcrack")


@dataclass
class Progress:
    """What the user sees of a run; `progress="always"` gives lines in any surroundings.

    Every line also goes to the logger "xcrack", at level INFO.

    Attributes
    ----------
    run : GrowthRule
    """

    run: GrowthRule
    _bar: Any = None
    _cycles: float | None = None
    _begin: float = field(default_factory=lambda: time.perf_counter())

    def step(self, step: Step) -> None:
        """Tell of a step as soon as it is finished."""
        time_now = time.perf_counter()
        new_cycles = 0.0 if self._cycles is None else step.cycles - self._cycles
        seconds = time_now - self._begin
        self._begin, self._cycles = time_now, step.cycles
        is_shown = _is_wanted(self.run)
        if not is_shown and not _LOG.isEnabledFor(logging.INFO):
            return
        line, time_left = _line(self.run, step), _time_left(self.run, step, new_cycles, seconds)
        _LOG.info("%s%s", line, time_left)
        if not is_shown:
            return
        if self._bar is None and self.run.progress != "always":
            self._bar = _new_bar(self.run, step)
        if self._bar is None:
            print(line + time_left, file=sys.stderr)
        else:
            self._bar.set_postfix_str(f"N {step.cycles:.6g}, dK_eq {_largest_part(step.dK_eq):.5g}")
            self._bar.update()

    def end(self, end: str) -> None:
        """Tell why growth ended."""
        _LOG.info("growth ended: %s", end)
        if _is_wanted(self.run):
            print(f"growth ended: {end}", file=sys.stderr)

    def close(self) -> None:
        """Leave the bar as it is: after the last step, or where something stopped the run."""
        if self._bar is not None:
            self._bar.close()


def _line(run: GrowthRule, step: Step) -> str:
    places = f"{GEOMETRY[run.problem.mesh.dim].station}s"
    return (
        f"step {step.index:4d}  N {step.cycles:12.6g}  largest dK_eq "
        f"{_largest_part(step.dK_eq):10.5g}  "
        f"da {_largest_part(step.da):9.4g}  {places} {step.n_tips}"
    )


def _largest_part(parts: Any) -> float:
    return max((float(part.max(initial=0.0)) for part in parts), default=0.0)


def _new_bar(run: GrowthRule, step: Step) -> Any:
    """A bar for terminal or notebook, with the time that is left; None without tqdm."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=run.max_steps, initial=step.index, unit="step", file=sys.stderr)


def _time_left(run: GrowthRule, step: Step, cycles: float, seconds: float) -> str:
    """Time that is left if all steps take as long as this one; empty where nobody knows."""
    steps = [] if run.max_steps is None else [run.max_steps - 1.0 - step.index]
    if run.max_cycles is not None and cycles > 0:
        steps.append((run.max_cycles - step.cycles) / cycles)
    seconds_left = min(steps, default=0.0) * seconds
    if seconds_left <= 0:
        return ""
    unit, name = next(
        (u, n) for u, n in ((3600, "h"), (60, "min"), (1, "s")) if seconds_left >= u or u == 1
    )
    return f"  about {seconds_left / unit:.2g} {name} left"


def _is_wanted(run: GrowthRule) -> bool:
    """Whether lines are asked for, or standard error is a terminal or a cell of a notebook."""
    if run.progress is not True:
        return run.progress == "always"
    notebook = in_notebook() or type(sys.stderr).__module__.startswith("ipykernel")
    return notebook or sys.stderr.isatty()


# Warnings of a run: each kind when it comes first, and one summary of those that came again.

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", re.IGNORECASE)
_SEVERAL = re.compile(r"#(,? #)+")


@dataclass
class WarningGroup:
    """What became of one kind of warning: messages alike but for their numbers."""

    first_step: int
    steps: int
    last_step: int
    message: str


@dataclass
class WarningLog:
    """Warnings of a run by their kind; the one value of a run that changes."""

    kinds: dict[str, WarningGroup] = field(default_factory=dict)
    n_steps: int = 0

    @contextmanager
    def watch(self, step: int) -> Iterator[list[str]]:
        """Issue what is new of the warnings within a block, count the rest, and list them all."""
        messages: list[str] = []
        try:
            with collected_warnings(messages):
                yield messages
        finally:
            self.n_steps += 1
            for message in dict.fromkeys(messages):
                self._add(message, step)

    def _add(self, message: str, step: int) -> None:
        key = _SEVERAL.sub("#", _NUMBER.sub("#", message))
        kind = self.kinds.setdefault(key, WarningGroup(step, 1, step, message))
        if kind.last_step != step:
            self.kinds[key] = WarningGroup(kind.first_step, kind.steps + 1, step, message)
        if kind.first_step == step:
            warn(message)

    def summarise(self) -> None:
        """Issue one warning for all kinds that came in more than one step, and are not ignored."""
        kinds_of_steps = (kind for kind in self.kinds.values() if kind.steps > 1)
        repeated_kinds = [kind for kind in kinds_of_steps if not _is_ignored(kind.message)]
        self.kinds = {}
        if not repeated_kinds:
            return
        lines = [
            f"in {kind.steps} of {self.n_steps} steps, from step {kind.first_step} to "
            f"{kind.last_step}, where it was: {kind.message}"
            for kind in repeated_kinds
        ]
        warn(
            "during growth warnings came again; the columns spread and domain_cells of "
            "history.table() show each step.\n- " + "\n- ".join(lines)
        )


def _is_ignored(message: str) -> bool:
    """Whether the user's filters ignore a warning of this text: the summary begins with another."""
    for action, text, category, module, _ in warnings.filters:
        is_match = text is None or re.match(text, message) is not None
        if is_match and module is None and issubclass(XcrackWarning, category):
            return action == "ignore"
    return False


__all__ = ["Progress", "WarningLog"]
