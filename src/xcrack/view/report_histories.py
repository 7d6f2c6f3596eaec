"""Section on the load history of a run, and on what its overloads have left."""

from typing import Any

import numpy as np

from xcrack.base.markup import element, join_parts, table
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.step import Memory, Step
from xcrack.growth.trail import FrontTrail, Trail
from xcrack.view.lives import plot_spectrum
from xcrack.view.report_pictures import drawn_figure
from xcrack.view.report_source import Section, Source, setting_words


def spectrum(source: Source) -> Section | None:
    """Spectrum, levels of K, model of retardation and its zones; nothing for a plain cycle."""
    steps = () if source.history is None else source.history.steps
    if not steps or steps[-1].memory is None:
        return None
    last, memory = steps[-1], steps[-1].memory
    settings = memory.settings
    if settings.get("cycle") != "Spectrum":
        return None
    unit = source.history.unit if source.history is not None else "block"
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
    model = settings.get("retardation")
    if model is not None:
        parts += [element("h3", "Retardation"),
                  table((), [("model", model), *_rows(settings, "retardation.")])]  # fmt: skip
        zones_left = _zones_of_cracks(last, memory)
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
        if key.startswith(prefix) and key not in besides
    ]


def _zones_of_cracks(step: Step, memory: Memory) -> list[tuple[Any, ...]]:
    """Zones of each crack, as ranges over its places."""
    trail = memory.trail
    if isinstance(trail, FrontTrail):
        return [
            (c, len(part.s), *_ranges(part.zones))
            for c, part in enumerate(trail.parts)
            if part.zones is not None and len(part.s)
        ]
    if not isinstance(trail, Trail) or trail.overloads is None:
        return []
    crack = np.repeat(np.arange(len(step.corrected)), [each.n_tips for each in step.corrected])
    zones = trail.overloads.zones
    if len(crack) != len(zones.K):
        return []
    return [
        (int(c), int((crack == c).sum()), *_ranges(zones.at(crack == c))) for c in np.unique(crack)
    ]


def _ranges(zones: OverloadZones) -> tuple[str, ...]:
    return tuple(_range(x) for x in (zones.K, zones.size, zones.since))


def _range(x: Any) -> str:
    low, high = float(x.min()), float(x.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


__all__ = ["spectrum"]
