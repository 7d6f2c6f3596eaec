"""Sections of a report on what keeps a crack from breaking the body: looks, and strength left."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.markup import element, join_parts, table
from xcrack.base.units import LENGTH, NUMBER, TOUGHNESS
from xcrack.view.lives import plot_strength
from xcrack.view.report_pictures import drawn_figure
from xcrack.view.report_source import Section, Source

_MOST_LOOKS = 50  # rows of a page
_MEASURES = {"advance": "its advance at the driving tip", "root_area": "the root of its area"}


def inspections(source: Source) -> Section | None:
    """When to look, how long the crack is then, and the chance that all looks miss it."""
    plan = source.inspection
    if plan is None:
        return None
    rows: list[tuple[str, Any]] = [
        ("first look after", plan.first),
        ("cycles between looks", plan.interval),
        ("looks before the end", len(plan.at)),
        ("length of the crack is", _MEASURES.get(plan.measure, plan.measure.replace("_", " of "))),
    ]
    if plan.missed is not None:
        rows.append(("chance that all of them miss", f"{plan.missed:.3g}"))
    looks = list(zip(plan.at.tolist(), plan.a.tolist(), strict=True))
    head = ("N", source.units.head("length", LENGTH))
    parts: list[Any] = [table((), rows), table(head, looks[:_MOST_LOOKS])]
    if len(looks) > _MOST_LOOKS:
        parts.append(element("p", f"and {len(looks) - _MOST_LOOKS} looks more", cls="soft"))
    numbers = {"first": plan.first, "interval": plan.interval, "at": plan.at.tolist(),
               "a": plan.a.tolist(), "missed": plan.missed, "measure": plan.measure}  # fmt: skip
    return Section("inspection", "Inspections", join_parts(*parts), numbers)


def strength(source: Source) -> Section | None:
    """Factors on the load at which the body breaks, step by step."""
    rows = source.strength
    if rows is None:
        return None
    names = [
        name for name in rows.dtype.names or () if not np.isnan(rows[name].astype(float)).all()
    ]
    values = [[float(row[name]) for name in names] for row in rows]
    by = [name for name in names if name == "factor" or name.startswith("by_")]
    parts: list[Any] = []
    if by and len(rows):
        least = np.nanmin([rows[name] for name in by], axis=0)
        if "factor" in names:
            least = rows["factor"]
        first = np.nonzero(least < 1)[0]
        words = (
            f"The largest load breaks the body from step {int(rows['step'][first[0]])} on."
            if len(first)
            else f"At the last step the body bears {least[-1]:.4g} times the largest load."
        )
        parts.append(element("p", words, cls="bad" if len(first) else ""))
    if "factor" in names:
        unit = "cycle" if source.history is None else source.history.unit
        draw = partial(_draw_strength, rows, unit)
        parts.append(drawn_figure("Factors on the largest load over the life", draw))
    heads = [source.units.head(name, {"a": LENGTH, "K": TOUGHNESS}.get(name, NUMBER))
             for name in names]  # fmt: skip
    parts.append(table(heads, values, scroll=len(values) > 12))
    return Section(
        "strength",
        "Residual strength",
        join_parts(*parts),
        {name: [_json_number(value) for value in rows[name].tolist()] for name in names},
    )


def _draw_strength(rows: Any, unit: str, file: Path) -> None:
    plot_strength(rows, unit=unit, file=file)


def _json_number(value: float) -> float | None:
    """A number that json has; None where there is none."""
    return value if np.isfinite(value) else None


__all__ = ["inspections", "strength"]
