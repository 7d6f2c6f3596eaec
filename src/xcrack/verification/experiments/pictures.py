"""Pictures of a page of predicted and measured."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.verification.experiments.outcome import Outcome, Picture
from xcrack.view.figures import finish_figure, new_figure

_STYLES: Mapping[str, dict[str, Any]] = {
    "body": {"color": "0.55", "lw": 1.0, "zorder": 1},
    "measured": {
        "color": "#111111",
        "ls": "",
        "marker": "o",
        "ms": 4.0,
        "mfc": "none",
        "zorder": 4,
    },
    "predicted": {"color": "#c2184b", "lw": 1.8, "zorder": 5},
    "variant": {"lw": 1.1, "ls": "--", "zorder": 3},
    "other": {"lw": 1.5, "ls": ":", "zorder": 2},
}
_VARIANTS = ("#1f6fb4", "#2a8a5a", "#d08a1d", "#7a5aa6", "#5a7f8f")
_MANY = 8  # curves of one role: drawn thin and grey


def draw_picture(picture: Picture, file: Path) -> None:
    """Draw one picture of a test."""
    figure = new_figure((7.4, 4.9), False, "validate")
    axes = figure.add_subplot()
    number = 0
    roles = [curve.role for curve in picture.curves]
    for curve in picture.curves:
        style = dict(_STYLES[curve.role])
        if curve.role in ("variant", "other"):
            style["color"] = _VARIANTS[number % len(_VARIANTS)]
            number += 1
        if curve.role == "other" and roles.count("other") > _MANY:
            style |= {"color": "0.75", "lw": 0.6, "ls": "-"}
        x, y = np.array(curve.points).reshape(-1, 2).T
        axes.plot(x, y, label=curve.name or None, **style)
    axes.set(xlabel=picture.x, ylabel=picture.y)
    if picture.is_to_scale:
        _frame(axes, picture)
    else:
        axes.grid(alpha=0.25)
    if any(curve.name for curve in picture.curves):
        figure.legend(fontsize=8, frameon=False, loc="outside lower center", ncols=2)
    finish_figure(figure, file, False, dpi=110)


def _frame(axes: Any, picture: Picture) -> None:
    """Body and cracks to one scale, nearer to where the cracks are."""
    axes.set_aspect("equal")
    points = np.concatenate(
        [np.array(c.points) for c in picture.curves if c.role not in ("body",) and c.points]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.62 * (high - low)
    half = np.maximum(half, 0.75 * half.max() * np.array([1.2, 1.0]))
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])


def draw_ratios(outcomes: Sequence[Outcome], titles: Mapping[str, str], file: Path) -> None:
    """All ratios, predicted over measured, with the band of a factor of 2."""
    rows = [
        (outcome, [c.value for c in outcome.comparisons if c.measure == "ratio"])
        for outcome in outcomes
    ]
    rows = [(outcome, values) for outcome, values in rows if values]
    figure = new_figure((9.6, 1.4 + 0.42 * max(len(rows), 1)), False, "validate")
    axes = figure.add_subplot()
    axes.axvspan(0.5, 2.0, color="#2a7d2a", alpha=0.10, lw=0, label="factor of 2")
    axes.axvline(1.0, color="0.3", lw=1.0)
    for place, (_, values) in enumerate(rows):
        axes.plot(values, np.full(len(values), place), "o", ms=5, mfc="none", color="#c2184b")
    axes.set(
        xscale="log", xlabel="predicted over measured",
        ylim=(len(rows) - 0.5, -0.5),
    )  # fmt: skip
    every = [value for _, values in rows for value in values]
    axes.set_xlim(min([0.4, *every]) / 1.15, max([2.5, *every]) * 1.15)
    ticks = [0.1, 0.2, 0.5, 1.0, 2.0]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_yticks(range(len(rows)), [titles[outcome.name] for outcome, _ in rows], fontsize=8)
    figure.legend(fontsize=8, frameon=False, loc="outside lower left")
    finish_figure(figure, file, False, dpi=110)


def png_of(draw: Any, *arguments: Any) -> bytes:
    """PNG bytes of what a function draws into the file that is its last argument."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "picture.png"
        draw(*arguments, file)
        return file.read_bytes()


__all__ = ["draw_picture", "draw_ratios", "png_of"]
