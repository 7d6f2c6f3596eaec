"""Picture of a sweep: a result over one key, a line for each combination of the others."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.view.figures import finish_figure, new_figure

_MOST = 12  # lines that a legend can name


def draw_sweep(
    rows: NDArray[Any], keys: Sequence[str], result: str, file: Path, title: str
) -> None:
    """Draw a column of a study over its first key; cases that failed are left out."""
    key, others = keys[0], keys[1:]
    good = np.isfinite(rows[result])
    figure = new_figure((6.4, 4.8), False, "sweep")
    axes = figure.add_subplot()
    lines: dict[tuple[Any, ...], list[int]] = {}
    for n in np.nonzero(good)[0].tolist():
        lines.setdefault(tuple(rows[name][n] for name in others), []).append(n)
    for values, line in lines.items():
        label = ", ".join(f"{name} = {_text(v)}" for name, v in zip(others, values, strict=True))
        axes.plot(_places(rows[key][line]), rows[result][line], "o-", ms=4, label=label or None)
    if others and len(lines) <= _MOST:
        axes.legend(fontsize="small")
    failed = int((~good).sum())
    words = f"{result} of {title}" + (f"; {failed} of {len(rows)} cases failed" if failed else "")
    axes.set(xlabel=key, ylabel=result)
    axes.set_title(words, fontsize="medium")
    axes.grid(True, alpha=0.3)
    finish_figure(figure, file, window=False)


def _places(values: NDArray[Any]) -> Any:
    """Numbers as they are; texts one beside the other."""
    return values if values.dtype.kind == "f" else [str(value) for value in values]


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


__all__ = ["draw_sweep"]
