"""Section on the load history of a run, and on what its overloads have left."""

from typing import Any

import numpy as np

from xcrack.base.markup import element, join_parts, table
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.step import Step
from xcrack.view.lives import plot_spectrum
from xcrack.view.report_pictures import drawn_figure
from xcrack.view.report_source import Section, Source, setting_words


def spectrum(source: Source) -> Section | None:
    """Spectrum, levels of K, model of retardation and its zones; nothing for a plain cycle."""
    history = source.history
    if history is None or history.settings.get("cycle") != "Spectrum":
        return None
    steps, settings, unit = history.steps, history.settings, history.unit
    last = steps[-1]
    rows: list[tuple[str, Any]] = [
        ("one repetition", unit),
        ("repetitions at the last step", last.cycles),
    ]
    rows += _rows(settings, "cycle.", besides=("cycle.unit",))
    counts = [len(step.levels) for step in steps if step.levels]
    if counts:
        levels = last.levels
        rows += [("levels of K a step", f"{min(counts)} to {max(counts)}"),
                 ("their factors", f"{min(levels):.6g} to {max(levels):.6g}"),
                 ("largest range", max(levels) - min(levels))]  # fmt: skip
    parts: list[Any] = [table((), rows)]
    shown = source.spectrum
    if shown is not None and shown.states is None:
        words = f"Load history: a {shown.unit} in time, and how often a range is exceeded"
        parts.append(drawn_figure(words, lambda file: plot_spectrum(shown, file=file)))
    values: dict[str, Any] = {"unit": unit, "blocks": last.cycles, "levels": list(last.levels)}
    model = settings.get("retardation", "None")
    if model != "None":
        parts += [element("h3", "Retardation"),
                  table((), [("model", model), *_rows(settings, "retardation.")])]  # fmt: skip
        zones_left = _zones_of_cracks(last)
        head = ("crack", "places", "K of the overload", "its zone", "growth since")
        parts += [
            element("p", "What overloads have left at the last step:"),
            table(head, zones_left),
        ]
        note = "Cycles are retarded; the rate of a step is that of the law. Ranges: all places."
        parts.append(element("p", note, cls="soft"))
        values |= {"retardation": model, "zones": [dict(zip(head, row)) for row in zones_left]}
    return Section("spectrum", "Load history", join_parts(*parts), values)


def _rows(settings: Any, prefix: str, besides: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    return [
        (key.removeprefix(prefix), setting_words(text).partition(", sha256")[0])
        for key, text in settings.items()
        if key.startswith(prefix) and key not in besides and text != "None"
    ]


def _zones_of_cracks(step: Step) -> list[tuple[Any, ...]]:
    """Zones of each crack, as ranges over its places."""
    if step.stations is None or step.zones is None:
        return []
    crack = step.stations.crack
    return [
        (int(c), int((crack == c).sum()), *_ranges(step.zones.at(crack == c)))
        for c in np.unique(crack)
    ]


def _ranges(zones: OverloadZones) -> tuple[str, ...]:
    return tuple(_range(x) for x in (zones.K, zones.size, zones.since))


def _range(x: Any) -> str:
    low, high = float(x.min()), float(x.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


__all__ = ["spectrum"]
