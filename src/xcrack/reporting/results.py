"""Sections on what came out: K, contact, growth, table."""

import base64
import csv
import io
from typing import Any

import numpy as np

from xcrack.markup import Markup, element, joined, table
from xcrack.reporting.section import Section
from xcrack.reporting.source import Source
from xcrack.sif.sif import SIF

_MODES = ("K_I", "K_II", "K_III")
_END = {2: "tip", 3: "front"}


def intensity(source: Source) -> Section | None:
    """K of every state, crack and tip; along fronts its ends and mean."""
    if not any(len(sif.K) for state in source.sif for sif in state):
        return None
    rows, numbers = [], []
    head: tuple[str, ...] = ()
    for k, state in enumerate(source.sif):
        for c, sif in enumerate(state):
            for tip in np.unique(sif.front):
                mine = sif.front == tip
                head, row = _row(sif, mine, source.dim)
                rows.append((k, c, int(tip), *row))
                numbers.append({"state": k, "crack": c, "tip": int(tip),
                                **dict(zip(head, map(_plain, row), strict=True))})  # fmt: skip
    first = ("state", "crack", _END[source.dim])
    note = ("spread: difference between two domains of the integral; domain: radius of the larger "
            "one, in cells. K_I of closed places is exactly zero.")  # fmt: skip
    content = joined(table((*first, *head), rows, scroll=len(rows) > 12 or source.dim > 2),
                     element("p", note, cls="soft"))  # fmt: skip
    return Section("K", "Stress intensity factors", content, {"rows": numbers})


def _row(sif: SIF, mine: Any, dim: int) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    """Names and values of one tip or front."""
    quality = float(sif.spread[mine].max(initial=0.0)), float(sif.domain_cells[mine].min())
    return _ROW[dim](sif, mine, quality)


def _at_tip(sif: SIF, mine: Any, quality: Any) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    K, closed = sif.K[mine][0], bool(sif.closed[mine].any())
    place = "(" + ", ".join(f"{v:.6g}" for v in sif.x[mine][0]) + ")"
    head = ("place", "K_I", "K_II", "T", "spread", "domain", "closed")
    return head, (place, K[0], K[1], sif.T[mine][0], *quality, closed)


def _along_front(sif: SIF, mine: Any, quality: Any) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    K, closed = sif.K[mine], int(sif.closed[mine].sum())
    head = ("places", *(f"{mode} {end}" for mode in _MODES for end in ("min", "mean", "max")),
            "spread", "domain", "closed places")  # fmt: skip
    ends = [f(K[:, m]) for m in range(3) for f in (np.min, np.mean, np.max)]
    return head, (int(mine.sum()), *map(float, ends), *quality, closed)


_ROW = {2: _at_tip, 3: _along_front}


def contact(source: Source) -> Section | None:
    """Share of each crack that is closed, largest pressure and opening."""
    rows = []
    for k, solution in enumerate(source.solutions):
        for c, lips in enumerate(solution.lips):
            gap, pressed = solution.opening(c), solution.contact[c]
            share, force, largest = 0.0, 0.0, 0.0
            if pressed is not None:
                total = float(pressed.measure.sum())
                share = float(pressed.measure[pressed.closed].sum()) / total if total else 0.0
                force = float(pressed.measure @ pressed.pressure)
                largest = float(pressed.pressure.max(initial=0.0))
            low = float(gap.min(initial=np.inf)) if len(lips) else 0.0
            rows.append((k, solution.state, c, pressed is not None, share, largest, force,
                         float(gap.max(initial=0.0)), low))  # fmt: skip
    if not rows:
        return None
    head = ("state", "load", "crack", "multipliers", "closed share", "largest pressure",
            "contact force", "largest opening", "smallest opening")  # fmt: skip
    shown = [(k, _load(state), *rest) for k, state, *rest in rows]
    numbers = [{name: _plain(v) for name, v in zip(head, row, strict=True)} for row in shown]
    return Section("contact", "Contact of the crack faces", table(head, shown), {"rows": numbers})


def _load(state: Any) -> str:
    if state is None:
        return "as given"
    return f"{len(state)} loads" if isinstance(state, list | tuple) else f"× {state}"


def growth(source: Source) -> Section | None:
    """Steps, cycles, and why the run ended."""
    history = source.history
    if history is None:
        return None
    if not history.steps:
        return Section("growth", "Growth", element("p", "No step is finished yet.", cls="bad"),
                       {"steps": 0, "ended": history.ended})  # fmt: skip
    last = history.steps[-1]
    rates = [r for step in history.steps for part in step.rate for r in part if np.isfinite(r)]
    ranges = [r for step in history.steps for part in step.dK_eq for r in part]
    rows: list[tuple[str, Any]] = [
        ("steps", len(history.steps)),
        ("cycles N at the last step", history.life),
        ("why it ended", history.ended),
    ]
    if rates and ranges:
        rows += [("ΔK_eq of the run", f"{min(ranges):.6g} to {max(ranges):.6g}"),
                 ("da/dN of the run", f"{min(rates):.4g} to {max(rates):.4g}")]  # fmt: skip
    if last.memory is not None:
        law = {k: v for k, v in last.memory.settings.items() if k == "law" or k.startswith("law.")}
        rows += [(name, text) for name, text in law.items()]
        rows += [(f"size of crack {c} at the end", v) for c, v in enumerate(last.memory.length)]
    parts: list[Any] = [table((), rows)]
    if not source.is_whole:
        words = "This run is not finished: the report shows the steps that are there."
        parts.insert(0, element("p", words, cls="bad"))
    numbers = {"steps": len(history.steps), "cycles": history.life, "ended": history.ended,
               "whole": source.is_whole}  # fmt: skip
    return Section("growth", "Growth and life", joined(*parts), numbers)


def numbers(source: Source) -> Section | None:
    """The table of a run, to read and to save."""
    history = source.history
    if history is None or not history.steps:
        return None
    rows = history.table()
    names = list(rows.dtype.names or ())
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows.tolist())
    coded = base64.b64encode(text.getvalue().encode()).decode()
    link = Markup(f'<a download="history.csv" href="data:text/csv;base64,{coded}">history.csv</a>')
    content = joined(element("p", joined("Save it as ", link)),
                     table(names, rows.tolist(), scroll=True))  # fmt: skip
    return Section(
        "table",
        "Table of all steps",
        content,
        {"columns": names, "rows": [[_plain(v) for v in row] for row in rows.tolist()]},
    )


def _plain(value: Any) -> Any:
    """A value that json has; nan and inf are texts."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    return value


__all__ = ["contact", "growth", "intensity", "numbers"]
