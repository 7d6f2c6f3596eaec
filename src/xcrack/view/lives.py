"""Pictures of lives, load histories and residual strength."""

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.arguments import FileName, Part, Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.spectrum import Spectrum
from xcrack.runs.assessment import CRITERIA
from xcrack.runs.life import Life
from xcrack.view.figures import finish_figure, new_figure, picture_path


def draw_life(life: Life, kind: str, file: FileName | None) -> Any:
    """Figure of the share that has ended over cycles, or of how many end where."""
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


_LABELS = {
    "by_toughness": "K = K_c",
    "by_resistance": "R-curve",
    "by_section": "net section yields",
    "by_link_up": "cracks link up",
    "by_collapse": "collapse",
    "by_line": "assessment line",
}


@check_arguments()
def plot_strength(
    strength: NDArray[Any],
    *,
    unit: Annotated[str, Text('what N counts, such as "cycle"')] = "cycle",
    file: FileName | None = None,
) -> Any:
    """Draw what `residual_strength` returned: factors on the load over the life, as one curve.

    Parameters
    ----------
    strength : structured array
    unit : str
        What N counts, as `History.unit` has it.
    file : path, optional
        Picture to write; without it a window opens, or the notebook shows it.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    ProblemError
        Another array, one without rows or without a finite factor, no word as unit, or a file that
        cannot be written.
    """
    names = getattr(getattr(strength, "dtype", None), "names", None) or ()
    if not {"N", "factor", *CRITERIA} <= set(names) or np.ndim(strength) != 1:
        raise ProblemError(
            f"plot_strength: strength = {value_text(strength)}: give what xc.residual_strength "
            "returns."
        )
    if not np.isfinite(strength["factor"]).any():
        raise ProblemError("plot_strength: there is nothing to draw: no factor is finite.")
    target = picture_path(file, "plot_strength")
    figure = new_figure((6.4, 4.8), target is None, "plot_strength")
    axes = figure.add_subplot()
    N = strength["N"]
    axes.plot(N, strength["factor"], color="0.75", lw=6, zorder=1, label="residual strength")
    for number, name in enumerate(CRITERIA):
        shown = np.where(np.isfinite(strength[name]), strength[name], np.nan)
        if np.isfinite(shown).any():
            axes.plot(N, shown, "o-", ms=3, lw=1.2, color=f"C{number}", label=_LABELS[name])
    axes.axhline(1.0, color="k", lw=1, ls="--", label="largest load of the run")
    for n in np.nonzero(np.diff(strength["crack"]))[0]:
        words = f"crack {strength['crack'][n + 1]} leads"
        axes.axvline(N[n + 1], color="0.5", lw=0.8, ls=":", label=words)
    finite = strength["factor"][np.isfinite(strength["factor"])]
    axes.set(xlabel=f"{unit}s N", ylabel="factor on the largest load",
             ylim=(0, max(1.2, 1.35 * float(finite.max()))))  # fmt: skip
    axes.legend(fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


_FEW = 30  # cycles up to which their axis is linear
_MOST = 400  # points of a history up to which they are joined one by one


@check_arguments()
def plot_spectrum(
    spectrum: Annotated[Spectrum, Part(Spectrum, "xc.Spectrum(...)")],
    *,
    file: FileName | None = None,
) -> Any:
    """Draw a load history: its factors in time, and how often each range is exceeded.

    Parameters
    ----------
    spectrum : Spectrum
        Of factors or of counted rows: with named states the cycles depend on K.
    file : path, optional
        Picture to write; without it a window opens, or the notebook shows it.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    ProblemError
        Something else, a spectrum of named states, or a file that cannot be written.
    """
    target = picture_path(file, "plot_spectrum")
    cycles = spectrum.cycles
    figure = new_figure((9.0, 3.8), target is None, "plot_spectrum")
    history, counts = figure.subplots(1, 2, width_ratios=(1.6, 1))
    if spectrum.factors is not None:
        line = "o-" if len(spectrum.factors) <= _MOST else "-"
        history.plot(np.arange(len(spectrum.factors)), spectrum.factors, line, ms=2.5, lw=0.9)
        history.set(xlabel=f"points of a {spectrum.unit}", ylabel="factor on the loads")
    else:
        each = np.repeat(np.arange(len(cycles)), 2).reshape(-1, 2)
        for x, low, high in zip(each, cycles["min"], cycles["max"], strict=True):
            history.plot(x, (low, high), color="C0", lw=2)
        history.set(xlabel="kinds of cycle", ylabel="factor on the loads")
    history.axhline(0, color="0.7", lw=0.8, zorder=0)
    size = cycles["max"] - cycles["min"]
    order = np.argsort(size)[::-1]
    total = np.cumsum(cycles["count"][order])
    counts.step(
        np.append(0.5 if total[-1] > _FEW else 0.0, total), np.append(size[order][:1], size[order])
    )
    scale = "log" if total[-1] > _FEW else "linear"
    counts.set(xscale=scale, xlabel=f"cycles a {spectrum.unit} of at least",
               ylabel="this range of the factor", ylim=(0, 1.05 * float(size.max())))  # fmt: skip
    counts.set_title(f"{total[-1]:g} cycles, {len(spectrum.left_out)} left out", fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


__all__ = ["draw_life", "plot_spectrum", "plot_strength"]
