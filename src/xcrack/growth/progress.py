"""One line a step, on standard error."""

import sys

from xcrack.growth.follow import following
from xcrack.growth.options import Run
from xcrack.growth.step import Step


def report_step(run: Run, step: Step, cycles: float, seconds: float) -> None:
    """Print where growth is, if the user wants to see it.

    Parameters
    ----------
    run : Run
    step : Step
    cycles : float
        Of this step; 0 for the first.
    seconds : float
        That it took to compute.
    """
    if not _is_wanted(run):
        return
    largest = max((float(d.max(initial=0.0)) for d in step.dK_eq), default=0.0)
    da = max((float(d.max(initial=0.0)) for d in step.da), default=0.0)
    places = f"{following(run.problem.mesh).PLACE}s"
    print(
        f"step {step.index:4d}  N {step.cycles:12.6g}  largest dK_eq {largest:10.5g}  "
        f"da {da:9.4g}  {places} {step.n_tips}{_left(run, step, cycles, seconds)}",
        file=sys.stderr,
    )


def report_end(run: Run, ended: str) -> None:
    """Print why growth ended, if the user wants to see it."""
    if _is_wanted(run):
        print(f"growth ended: {ended}", file=sys.stderr)


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
    notebook = type(sys.stderr).__module__.startswith("ipykernel")
    return run.progress == "always" or (run.progress is True and (notebook or sys.stderr.isatty()))


__all__ = ["report_end", "report_step"]
