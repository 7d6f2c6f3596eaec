"""Pictures of lives."""

from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.runs.life import Life
from xcrack.view.figures import finish_figure, new_figure, picture_path


def draw_life(life: Life, kind: str, file: str | Path | None) -> Any:
    """Figure of the share that has ended over cycles, or of how many end where."""
    if not isinstance(kind, str) or kind not in ("cdf", "density"):
        raise ProblemError(f'plot kind = {value_text(kind)}: give "cdf" or "density".')
    N = life.N[np.isfinite(life.N) & (life.N > 0)]
    if not len(N):
        raise ProblemError("there is nothing to draw: no sample ends; give a larger load.")
    target = picture_path(file, "Life.plot")
    figure = new_figure((6.4, 4.8), target is None, "Life.plot")
    axes = figure.add_subplot()
    if kind == "cdf":
        share = np.arange(1, len(N) + 1) / len(life.N)
        rows = np.unique(np.linspace(0, len(N) - 1, 2000).astype(int))
        axes.plot(N[rows], share[rows], label="samples")
        axes.set(ylabel="share that has ended", ylim=(0, 1))
    else:
        edges = np.geomspace(N[0], N[-1] * (1 + 1e-12), 60) if N[0] < N[-1] else 10
        axes.hist(N, bins=edges, weights=np.full(len(N), 1 / len(life.N)), label="samples")
        axes.set(ylabel="share of the samples")
    axes.axvline(life.life, color="k", lw=0.8, label="the run")
    for p in (5, 95):
        axes.axvline(life.percentile(p), color="0.6", lw=0.8, ls="--")
    axes.set(xlabel=f"life in {life.unit}s", xscale="log")
    axes.legend(fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


__all__ = ["draw_life"]
