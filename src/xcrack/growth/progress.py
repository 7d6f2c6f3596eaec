"""One line a step, on standard error."""

import sys

from xcrack.growth.follow import following
from xcrack.growth.options import Run
from xcrack.growth.step import Step


def report_step(run: Run, step: Step) -> None:
    """Say where growth is, if the user wants to see it."""
    if not _wanted(run):
        return
    largest = max((float(d.max(initial=0.0)) for d in step.dK_eq), default=0.0)
    da = max((float(d.max(initial=0.0)) for d in step.da), default=0.0)
    places = f"{following(run.problem.mesh).PLACE}s"
    print(
        f"step {step.index:4d}  N {step.cycles:12.6g}  largest dK_eq {largest:10.5g}  "
        f"da {da:9.4g}  {places} {step.n_tips}",
        file=sys.stderr,
    )


def report_end(run: Run, ended: str) -> None:
    """Say why growth ended, if the user wants to see it."""
    if _wanted(run):
        print(f"growth ended: {ended}", file=sys.stderr)


def _wanted(run: Run) -> bool:
    return run.progress == "always" or (bool(run.progress) and sys.stderr.isatty())


__all__ = ["report_end", "report_step"]
