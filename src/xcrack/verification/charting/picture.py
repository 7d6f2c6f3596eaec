"""The picture of a chart: error against time."""

from os import PathLike
from typing import Any

import numpy as np

from xcrack.verification.charting.result import Chart, ChartRow
from xcrack.view.figures import finish_figure, new_figure, picture_path

_MARKERS = "osD^vP"
_OWN = "X"  # a mesh that a run has made for itself
_BELOW = 0.5  # the picture ends at this share of the error of the reference


def draw(chart: Chart, file: str | PathLike[str] | None, show: bool | None) -> Any:
    """Draw a chart; returns the figure, or the path of the file where there is one.

    Parameters
    ----------
    chart : Chart
    file : path or None
    show : bool or None
        None: only without a file.

    Raises
    ------
    ProblemError
        No path, a format that matplotlib does not know, or a file that cannot be written.
    """
    target = picture_path(file, "Chart.plot")
    window = target is None if show is None else show
    figure = new_figure((8.2, 4.9), window, "Chart.plot")
    _axes(chart, figure.add_subplot())
    return finish_figure(figure, target, window, dpi=160)


def _axes(chart: Chart, axes: Any) -> None:
    floor = chart.reference_error
    bottom, top = _limits(chart)
    axes.axhspan(bottom, floor, color="0.9", lw=0, zorder=0)
    names = list(dict.fromkeys(row.setting for row in chart.rows))
    for number, name in enumerate(names):
        rows = [r for r in chart.good if r.setting == name]
        _setting(chart, axes, rows, _color(chart, name, number))
    front = chart.pareto
    axes.plot(
        [row.seconds for row in front],
        [chart.shown(row) for row in front],
        color="0.75",
        lw=7,
        alpha=0.6,
        solid_capstyle="round",
        zorder=1,
    )
    _wanted(chart, axes)
    axes.set(
        xscale="log",
        yscale="log",
        ylim=(bottom, top),
        xlabel=f"time, s (median of {chart.repeat})",
        ylabel=f"relative error of {chart.quantity}",
    )
    axes.annotate(
        f"error of the reference, about {floor:.1e}",
        (0, 0),
        xycoords="axes fraction",
        xytext=(5, 4),
        textcoords="offset points",
        fontsize="small",
        color="0.35",
    )
    _time_ticks(axes)
    axes.grid(True, which="major", color="0.92", zorder=0)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    _legend(chart, axes, names)


def _color(chart: Chart, name: str, number: int) -> str:
    """Of a setting; black for runs that make their meshes themselves."""
    is_of_user = any(row.mesh < 0 for row in chart.rows if row.setting == name)
    return "black" if is_of_user else f"C{number % 10}"


def _setting(chart: Chart, axes: Any, rows: list[ChartRow], color: str) -> None:
    """One curve a setting, one marker a mesh; hollow where the reference cannot tell."""
    if not rows:
        return
    rows = sorted(rows, key=lambda row: (row.mesh, row.unknowns))
    x, y = [row.seconds for row in rows], [chart.shown(row) for row in rows]
    axes.plot(x, y, "-", color=color, lw=1.1, zorder=2)
    for row, t, error in zip(rows, x, y, strict=True):
        if row is chart.reference:
            axes.plot(t, error, "*", ms=14, mfc=color, mec="black", mew=0.7, zorder=5)
            continue
        axes.plot(
            t,
            error,
            _OWN if row.mesh < 0 else _MARKERS[row.mesh % len(_MARKERS)],
            ms=6,
            color=color,
            mfc="white" if row.error < chart.reference_error else color,
            zorder=4,
        )


def _wanted(chart: Chart, axes: Any) -> None:
    if chart.wanted is None:
        return
    axes.axhline(chart.wanted, color="black", lw=0.9, ls="--", zorder=1)
    axes.annotate(
        f"wanted {chart.wanted:.2g}",
        (1, chart.wanted),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 3),
        textcoords="offset points",
        ha="right",
        fontsize="small",
    )
    best = chart.best()
    if best.row is not None:
        axes.plot(
            best.row.seconds,
            chart.shown(best.row),
            "o",
            ms=15,
            mfc="none",
            mec="black",
            mew=1.3,
            zorder=6,
        )


def _legend(chart: Chart, axes: Any, names: list[str]) -> None:
    """Settings by colour, meshes by marker, and what else is drawn."""
    from matplotlib.lines import Line2D

    failed_settings = {row.setting for row in chart.failed}
    handles = [
        Line2D(
            [],
            [],
            color=_color(chart, name, k),
            lw=2,
            label=name + (" (failed)" * (name in failed_settings)),
        )
        for k, name in enumerate(names)
    ]
    sizes = dict(sorted({row.mesh: row.size for row in chart.rows if row.mesh >= 0}.items()))
    handles += [
        Line2D([], [], color="0.4", ls="", marker=_MARKERS[k % len(_MARKERS)], label=f"h = {h:.3g}")
        for k, h in sizes.items()
    ]
    if any(row.mesh < 0 for row in chart.good):
        label = "a mesh of its own"
        handles.append(Line2D([], [], color="0.4", ls="", marker=_OWN, label=label))
    star = {"ls": "", "marker": "*", "ms": 12, "mfc": "white", "mec": "black"}
    handles.append(Line2D([], [], label="reference", **star))
    handles.append(Line2D([], [], color="0.75", lw=6, alpha=0.6, label="cheapest for its error"))
    if any(r.error < chart.reference_error and r is not chart.reference for r in chart.good):
        hollow_style = {"ls": "", "marker": "o", "mfc": "white", "mec": "0.4"}
        handles.append(Line2D([], [], label="too close to the reference to tell", **hollow_style))
    if chart.wanted is not None and chart.best():
        ring = {"ls": "", "marker": "o", "ms": 11, "mfc": "none", "mec": "black", "mew": 1.3}
        handles.append(Line2D([], [], label="recommended", **ring))
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize="small",
        frameon=False,
    )


def _time_ticks(axes: Any) -> None:
    """Plain numbers of seconds, enough of them for a range below a decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    subs: tuple[float, ...] = (1.0,) if high / low > 300 else (1.0, 2.0, 5.0)
    if high / low < 10:
        subs = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0)
    axes.xaxis.set_major_locator(LogLocator(base=10, subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _limits(chart: Chart) -> tuple[float, float]:
    largest = max([chart.shown(row) for row in chart.good] + [chart.wanted or 0.0])
    lowest_error = min(chart.reference_error, chart.wanted or np.inf)
    return _BELOW * lowest_error, 2.0 * largest


__all__ = ["draw"]
