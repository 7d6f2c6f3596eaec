"""Sections of a report on what keeps a crack from breaking the body: looks, and strength left."""

from typing import Any

import numpy as np

from xcrack.base.markup import element, join_parts, table
from xcrack.view.report_source import Section, Source

_MOST_LOOKS = 50  # rows of a page


def inspections(source: Source) -> Section | None:
    """When to look, how long the crack is then, and the chance that all looks miss it."""
    plan = source.inspection
    if plan is None:
        return None
    rows: list[tuple[str, Any]] = [
        ("first look after", plan.first),
        ("cycles between looks", plan.interval),
        ("looks before the end", len(plan.at)),
    ]
    if plan.missed is not None:
        rows.append(("chance that all of them miss", f"{plan.missed:.3g}"))
    looks = list(zip(plan.at.tolist(), plan.a.tolist(), strict=True))
    parts: list[Any] = [table((), rows), table(("N", "length"), looks[:_MOST_LOOKS])]
    if len(looks) > _MOST_LOOKS:
        parts.append(element("p", f"and {len(looks) - _MOST_LOOKS} looks more", cls="soft"))
    numbers = {"first": plan.first, "interval": plan.interval, "at": plan.at.tolist(),
               "a": plan.a.tolist(), "missed": plan.missed}  # fmt: skip
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
    by = [name for name in names if name.startswith("by_")]
    parts: list[Any] = []
    if by and len(rows):
        least = np.nanmin([rows[name] for name in by], axis=0)
        first = np.nonzero(least < 1)[0]
        words = (
            f"The largest load breaks the body from step {int(rows['step'][first[0]])} on."
            if len(first)
            else f"At the last step the body bears {least[-1]:.4g} times the largest load."
        )
        parts.append(element("p", words, cls="bad" if len(first) else ""))
    parts.append(table(names, values, scroll=len(values) > 12))
    return Section(
        "strength",
        "Strength that is left",
        join_parts(*parts),
        {name: [_json_number(value) for value in rows[name].tolist()] for name in names},
    )


def _json_number(value: float) -> float | None:
    """A number that json has; None where there is none."""
    return value if np.isfinite(value) else None


__all__ = ["inspections", "strength"]
