"""Values as HTML and as columns of text: tables, and whole pages that need no network."""

import html
import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; --good: #2a7d2a; --bad: #c22; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem } h2 { margin-top: 2.2rem; font-size: 1.25rem;
border-bottom: 1px solid var(--line) } table { border-collapse: collapse; margin: .6rem 0;
display: block; max-width: 100%; overflow-x: auto }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); text-align: left;
vertical-align: top; font-variant-numeric: tabular-nums }
th { background: var(--soft) }
td.n { text-align: right } td.n:nth-child(2):last-child { text-align: left }
.scroll { overflow: auto; max-height: 28rem }
img { max-width: min(100%, 46rem);
height: auto; background: #fff } .good { color: var(--good) } .bad { color: var(--bad);
font-weight: 600 } .soft { opacity: .7 } pre { background: var(--soft); padding: .6rem;
overflow: auto } figure { margin: .8rem 0 } nav a { margin-right: 1rem }
p, li, figcaption { overflow-wrap: anywhere }
canvas { width: 100%; height: 32rem; touch-action: none; background: #fff }
@media (max-width: 40rem) { canvas { height: 20rem } td { min-width: 4rem } }
"""


class Markup(str):
    """Text that is HTML already."""


def escape_html(value: Any) -> Markup:
    """A value as HTML: what is no markup yet is escaped, numbers are shortened."""
    if isinstance(value, Markup):
        return value
    return Markup(html.escape(display_text(value)))


def display_text(value: Any) -> str:
    """A value as a reader wants to see it."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: ""}[value]
    if isinstance(value, int):
        return str(value)
    try:
        number = float(value)
    except (TypeError, ValueError):
        return str(value)
    if isinstance(value, str):
        return value
    return f"{number:.6g}" if math.isfinite(number) else str(number)


def element(name: str, content: Any, **attributes: str) -> Markup:
    """One element; `cls` stands for the attribute class."""
    pairs = "".join(
        f' {"class" if key == "cls" else key}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    return Markup(f"<{name}{pairs}>{escape_html(content)}</{name}>")


def table(head: Sequence[str], rows: Sequence[Sequence[Any]], *, scroll: bool = False) -> Markup:
    """A table; numbers are set to the right."""
    top = "".join(element("th", name) for name in head)
    body = "".join("<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows)
    lead = f"<thead><tr>{top}</tr></thead>" if head else ""
    text = Markup(f"<table>{lead}<tbody>{body}</tbody></table>")
    return Markup(f'<div class="scroll">{text}</div>') if scroll else text


_MOST_ROWS = 24  # of a table of text; of more the middle is left out
_MOST_CHARACTERS = 118  # in a line of it


def text_table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns of text, set to the right, as many as a line takes; the others are counted.

    Examples
    --------
    >>> print(text_table(("N", "a"), [(0, 2.0), (1200.0, 2.1234567)]))
       N        a
       0        2
    1200  2.12346
    """
    half = _MOST_ROWS // 2
    row_groups = [rows] if len(rows) <= _MOST_ROWS else [rows[:half], rows[-half:]]
    lines = [[display_text(value) for value in row] for group in row_groups for row in group]
    width = [max(map(len, column)) for column in zip(head, *lines, strict=True)]
    ends = np.cumsum(np.array(width) + 2) - 2
    n = max(1, int(np.searchsorted(ends, _MOST_CHARACTERS, side="right")))
    text = [
        "  ".join(value.rjust(w) for value, w in zip(line[:n], width, strict=False))
        for line in (head, *lines)
    ]
    if len(row_groups) > 1:
        text.insert(1 + half, f"... {len(rows) - 2 * half} more rows")
    if n < len(head):
        names = ", ".join(head[n:])
        text.append(textwrap.fill(f"... {len(head) - n} more columns: {names}", _MOST_CHARACTERS))
    return "\n".join(text)


def list_markup(items: Sequence[Any]) -> Markup:
    """An unordered list."""
    return Markup("<ul>" + "".join(element("li", item) for item in items) + "</ul>")


def join_parts(*parts: Any) -> Markup:
    """Parts one after the other, escaped where they are not markup."""
    return Markup("\n".join(escape_html(part) for part in parts))


def page(title: str, *parts: Any) -> str:
    """A whole page, with its style in it."""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<link rel="icon" href="data:,"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n{join_parts(*parts)}\n</body></html>\n"
    )


def _cell(value: Any) -> Markup:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return element("td", value, cls="n") if is_number else element("td", value)


_WIDTH, _HEIGHT, _MARGIN = 260.0, 200.0, 8.0
_TOWARD = {
    2: np.eye(2),
    3: np.array([[0.86, 0.51, 0.0], [-0.22, 0.37, 0.9]]),  # right and up of a view from above
}
_BODY, _CRACK = "#8a8f98", "#c2184b"


def sketch(points: Floats, boundary: Ints, cracks: Sequence[Floats]) -> Markup:
    """Outline of a body and lines of its cracks.

    Parameters
    ----------
    points : (n, d) array, length
    boundary : (f, d) array of int
        Facets of its boundary; in 3D the box around the points is drawn instead.
    cracks : sequence of (k, 2, d) arrays, length
        Segments of each crack.
    """
    view = _TOWARD[points.shape[1]]
    outline = points[boundary] if points.shape[1] < 3 else _box_of(points)
    projections = [segments @ view.T for segments in (outline, *cracks) if len(segments)]
    all_points = np.concatenate([part.reshape(-1, 2) for part in projections])
    x_min, x_max = all_points.min(axis=0), all_points.max(axis=0)
    size = np.maximum(x_max - x_min, 1e-300)
    scale = min((_WIDTH - 2 * _MARGIN) / size[0], (_HEIGHT - 2 * _MARGIN) / size[1])
    width, height = size * scale + 2 * _MARGIN
    paths = []
    for number, part in enumerate(projections):
        place = _MARGIN + (part - x_min) * scale
        place[..., 1] = height - place[..., 1]
        steps = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in place)
        colour, line = (_BODY, 1.0) if number == 0 else (_CRACK, 2.0)
        paths.append(f'<path d="{steps}" stroke="{colour}" stroke-width="{line}"/>')
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'fill="none" stroke-linecap="round">{"".join(paths)}</svg>'
    )


def rim(points: Floats, faces: Ints) -> Floats:
    """Segments that show a crack `(k, 2, d)`: its line, or the edges of one triangle only."""
    if faces.shape[1] == 2:
        return points[faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edge_pairs, count = np.unique(edges, axis=0, return_counts=True)
    return points[edge_pairs[count == 1]]


def _box_of(points: Floats) -> Floats:
    x_min, x_max = points.min(axis=0), points.max(axis=0)
    corner = np.stack(np.meshgrid(*np.stack([x_min, x_max], 1), indexing="ij"), -1).reshape(-1, 3)
    pairs = [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit]
    return np.asarray(corner[np.array(pairs)])


__all__ = [
    "Markup",
    "display_text",
    "element",
    "escape_html",
    "join_parts",
    "list_markup",
    "page",
    "rim",
    "sketch",
    "table",
]
