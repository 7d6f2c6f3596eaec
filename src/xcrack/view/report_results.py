"""Sections on what came out: K, contact, growth, load history, table."""

import base64
import csv
import io
from typing import Any

import numpy as np

from xcrack.analysis.contact import Contact
from xcrack.analysis.solution import Solution
from xcrack.base.arrays import coordinates
from xcrack.base.markup import Markup, element, join_parts, table
from xcrack.base.units import FORCE, LENGTH, LINE_FORCE, NUMBER, STRESS, TOUGHNESS
from xcrack.crack.stations import GEOMETRY
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.step import Step
from xcrack.sif.sif import SIF
from xcrack.view.lives import plot_spectrum
from xcrack.view.report_pictures import drawn_figure
from xcrack.view.report_source import Section, Source, UnitNames, setting_words

_MODES = ("K_I", "K_II", "K_III")


def intensity(source: Source) -> Section | None:
    """K of every state, crack and tip; along fronts its ends and mean."""
    if not any(len(sif.K) for state in source.sif for sif in state):
        return None
    rows, numbers = [], []
    head: tuple[str, ...] = ()
    for k, state in enumerate(source.sif):
        for c, sif in enumerate(state):
            for tip in np.unique(sif.front):
                is_of_tip = sif.front == tip
                head, row = _row(sif, is_of_tip, source.dim)
                rows.append((k, c, int(tip), *row))
                numbers.append({"state": k, "crack": c, "tip": int(tip),
                                **dict(zip(head, map(_json_value, row), strict=True))})  # fmt: skip
    first = ("state", "crack", GEOMETRY[source.dim].end)
    note = ("spread: difference between two domains of the integral; domain: radius of the larger "
            "one, in cells. K_I of closed places is exactly zero. best ± bar: estimate of exact K "
            "and half-width of its error, left out where there is none.")  # fmt: skip
    reasons = {reason for state in source.sif for sif in state for reason in sif.reasons if reason}
    if reasons:
        note += f" No bars: {'; '.join(sorted(reasons))}."
    names = (*first, *(_K_head(name, source.units) for name in head))
    known_columns = [k for k in range(len(names)) if any(not _is_nan(row[k]) for row in rows)]
    cells = [[row[k] for k in known_columns] for row in rows]
    is_long = len(rows) > 12 or source.dim > 2
    content = join_parts(table([names[k] for k in known_columns], cells, scroll=is_long),
                     element("p", note, cls="soft"))  # fmt: skip
    return Section("K", "Stress intensity factors", content, {"rows": numbers})


def _is_nan(value: Any) -> bool:
    """Whether it is a number that is not known."""
    return isinstance(value, float) and bool(np.isnan(value))


def _K_head(name: str, units: UnitNames) -> str:
    if "K_" in name or name == "spread":
        return units.head(name, TOUGHNESS)
    return units.head(name, {"T": STRESS, "place": LENGTH}.get(name, NUMBER))


def _row(sif: SIF, is_of_tip: Any, dim: int) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    """Names and values of one tip or front."""
    quality = (
        float(sif.spread[is_of_tip].max(initial=0.0)),
        float(sif.domain_cells[is_of_tip].min()),
    )
    return _ROW[dim](sif, is_of_tip, quality)


def _at_tip(sif: SIF, is_of_tip: Any, quality: Any) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    K, is_closed = sif.K[is_of_tip][0], bool(sif.closed[is_of_tip].any())
    best_K, bar = sif.best[is_of_tip][0], sif.bar[is_of_tip][0]
    place = coordinates(sif.x[is_of_tip][0])
    head = ("place", "K_I", "K_II", "T", "best K_I", "± K_I", "best K_II", "± K_II", "spread",
            "domain", "closed")  # fmt: skip
    bars = (best_K[0], bar[0], best_K[1], bar[1])
    return head, (place, K[0], K[1], sif.T[is_of_tip][0], *bars, *quality, is_closed)


def _along_front(sif: SIF, is_of_tip: Any, quality: Any) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    K, n_closed = sif.K[is_of_tip], int(sif.closed[is_of_tip].sum())
    head = ("places", *(f"{mode} {end}" for mode in _MODES for end in ("min", "mean", "max")),
            "largest ± K_I", "± K_II", "± K_III", "spread", "domain",
            "closed places")  # fmt: skip
    bar = sif.bar[is_of_tip]
    bars = [float(np.nanmax(column)) if np.isfinite(column).any() else np.nan for column in bar.T]
    ends = [f(K[:, m]) for m in range(3) for f in (np.min, np.mean, np.max)]
    return head, (int(is_of_tip.sum()), *map(float, ends), *bars, *quality, n_closed)


_ROW = {2: _at_tip, 3: _along_front}


_RUBBED = ("stuck share", "largest shear", "largest slip", "dissipated since the state before")


def _friction_values(solution: Solution, contact: Contact | None) -> tuple[float, ...]:
    """What friction adds to a row: nothing in a scene without."""
    if not any(solution.problem.frictions):
        return ()
    if contact is None or contact.shear is None or contact.slip is None or contact.stuck is None:
        return 0.0, 0.0, 0.0, solution.dissipated
    total = float(contact.measure.sum())
    return (
        float(contact.measure[contact.stuck].sum()) / total if total else 0.0,
        float(np.abs(contact.shear).max(initial=0.0)),
        float(np.abs(contact.slip).max(initial=0.0)),
        solution.dissipated,
    )


def contact(source: Source) -> Section | None:
    """Share of each crack that is closed, largest pressure and opening."""
    rows = []
    has_friction = any(any(solution.problem.frictions) for solution in source.solutions)
    for k, solution in enumerate(source.solutions):
        for c, lips in enumerate(solution.lips):
            gap, contact_of_crack = solution.opening(c), solution.contact[c]
            share, force, p_max = 0.0, 0.0, 0.0
            if contact_of_crack is not None:
                total = float(contact_of_crack.measure.sum())
                share = (
                    float(contact_of_crack.measure[contact_of_crack.closed].sum()) / total
                    if total
                    else 0.0
                )
                force = float(contact_of_crack.measure @ contact_of_crack.pressure)
                p_max = float(contact_of_crack.pressure.max(initial=0.0))
            least_gap = float(gap.min(initial=np.inf)) if len(lips) else 0.0
            rows.append((k, solution.state, c, contact_of_crack is not None, share, p_max, force,
                         float(gap.max(initial=0.0)), least_gap,
                         *_friction_values(solution, contact_of_crack)))  # fmt: skip
    if not rows:
        return None
    head = ("state", "load", "crack", "multipliers", "closed share", "largest pressure",
            "contact force", "largest opening", "smallest opening",
            *(_RUBBED if has_friction else ()))  # fmt: skip
    shown_rows = [(k, _load(state), *rest) for k, state, *rest in rows]
    numbers = [
        {name: _json_value(v) for name, v in zip(head, row, strict=True)} for row in shown_rows
    ]
    stresses, lengths = {"largest pressure", "largest shear"}, {"largest slip"}
    units = source.units
    headings = [
        units.head(name, STRESS if name in stresses
                   else LENGTH if "opening" in name or name in lengths
                   else LINE_FORCE if name == "contact force" and source.dim == 2
                   else FORCE if name == "contact force" else NUMBER)
        for name in head
    ]  # fmt: skip
    content = table(headings, shown_rows)
    return Section("contact", "Contact of the crack faces", content, {"rows": numbers})


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
    last_step = history.steps[-1]
    rates = [r for step in history.steps for part in step.rate for r in part if np.isfinite(r)]
    ranges = [r for step in history.steps for part in step.dK_eq for r in part]
    rows: list[tuple[str, Any]] = [
        ("steps", len(history.steps)),
        (f"{history.unit}s N at the last step", history.life),
        ("its numerical error", str(history.life_bar).replace("cycles", f"{history.unit}s")),
        *(("join", str(join)) for join in history.joins),
        ("why it ended", history.ended),
    ]
    rows += [("break-through", str(arrival)) for arrival in history.arrivals]
    if rates and ranges:
        units = source.units
        rate = f"{min(rates):.4g} to {max(rates):.4g}"
        rows += [("ΔK_eq of the run",
                  units.value(f"{min(ranges):.6g} to {max(ranges):.6g}", TOUGHNESS)),
                 ("da/dN of the run", f"{units.value(rate, LENGTH)} a {history.unit}")
                 ]  # fmt: skip
    law = {k: v for k, v in history.settings.items() if k == "law" or k.startswith("law.")}
    rows += [(name, setting_words(text)) for name, text in law.items() if text != "None"]
    rows += [(f"size of crack {c} at the end", source.units.value(v, LENGTH))
             for c, v in enumerate(last_step.sizes)]  # fmt: skip
    parts: list[Any] = [table((), rows)]
    if not source.is_whole:
        words = "This run is not finished: the report shows the steps that are there."
        parts.insert(0, element("p", words, cls="bad"))
    bar = history.life_bar
    sources = {
        name: _json_value(getattr(bar, name)) for name in ("steps", "K", "contact", "unknown")
    }
    numbers = {"steps": len(history.steps), "cycles": history.life, "ended": history.ended,
               "error of cycles": sources, "whole": source.is_whole}  # fmt: skip
    return Section("growth", "Growth and life", join_parts(*parts), numbers)


def lives(source: Source) -> Section | None:
    """Life with its error bar, and what drives it."""
    life = source.life
    if life is None:
        return None
    levels = (1, 5, 50, 95, 99)
    quantiles = [(f"{p} % of the samples end before", life.percentile(p)) for p in levels]
    drivers = sorted(life.scatter.items(), key=lambda item: item[1][0] - item[1][1])
    parts: list[Any] = [table((), [(f"life of the run, {life.unit}s", life.life), *quantiles])]
    if drivers:
        rows = [(name, N_min, N_max, N_max / N_min) for name, (N_min, N_max) in drivers]
        head = ("what varies alone", "5 %", "95 %", "ratio")
        parts += [element("h3", "What drives it"), table(head, rows)]
    if life.bounds:
        bounds = [
            (name, f"{100 * share:.3g} %" if np.isfinite(share) else "not known")
            for name, share in life.bounds.items()
        ]
        parts += [element("h3", "Numerical bounds, as shares of the life"), table((), bounds)]
    values = {"life": life.life, "quantiles": {str(p): _json_value(life.percentile(p)) for p in
    levels},
              "scatter": {k: list(map(_json_value, v)) for k, v in life.scatter.items()},
              "bounds": {k: _json_value(v) for k, v in life.bounds.items()}}  # fmt: skip
    return Section("life", "Life with its error bar", join_parts(*parts), values)


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
    text_of_file = base64.b64encode(text.getvalue().encode()).decode()
    link = Markup(
        f'<a download="history.csv" href="data:text/csv;base64,{text_of_file}">history.csv</a>'
    )
    content = join_parts(element("p", join_parts("Save it as ", link)),
                     table([_column_head(name, source.units) for name in names], rows.tolist(),
                           scroll=True))  # fmt: skip
    return Section(
        "table",
        "Table of all steps",
        content,
        {"columns": names, "rows": [[_json_value(v) for v in row] for row in rows.tolist()]},
    )


_LENGTHS = ("x", "y", "z", "a", "da")


def _column_head(name: str, units: UnitNames) -> str:
    """A column of the table of a run, with its unit."""
    if name.startswith(("K_", "dK_eq", "spread", "bar")):
        return units.head(name, TOUGHNESS)
    first = name.partition("_")[0]
    return units.head(name, LENGTH if first in _LENGTHS or first == "rate" else NUMBER)


def _json_value(value: Any) -> Any:
    """A value that json has; nan and inf are texts."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    return value


# --- section on the load history of a run, and on what its overloads have left ---


def spectrum(source: Source) -> Section | None:
    """Spectrum, levels of K, model of retardation and its zones; nothing for a plain cycle."""
    history = source.history
    if history is None or history.settings.get("cycle") != "Spectrum":
        return None
    steps, settings, unit = history.steps, history.settings, history.unit
    last_step = steps[-1]
    rows: list[tuple[str, Any]] = [
        ("one repetition", unit),
        ("repetitions at the last step", last_step.cycles),
    ]
    rows += _rows(settings, "cycle.", other_keys=("cycle.unit",))
    counts = [len(step.levels) for step in steps if step.levels]
    if counts:
        levels = last_step.levels
        rows += [("levels of K a step", f"{min(counts)} to {max(counts)}"),
                 ("their factors", f"{min(levels):.6g} to {max(levels):.6g}"),
                 ("largest range", max(levels) - min(levels))]  # fmt: skip
    parts: list[Any] = [table((), rows)]
    drawn_spectrum = source.spectrum
    if drawn_spectrum is not None and drawn_spectrum.states is None:
        words = f"Load history: a {drawn_spectrum.unit} in time, and how often a range is exceeded"
        parts.append(drawn_figure(words, lambda file: plot_spectrum(drawn_spectrum, file=file)))
    values: dict[str, Any] = {"unit": unit, "blocks": last_step.cycles}
    values["levels"] = list(last_step.levels)
    model = settings.get("retardation", "None")
    if model != "None":
        parts += [element("h3", "Retardation"),
                  table((), [("model", model), *_rows(settings, "retardation.")])]  # fmt: skip
        zones_left = _zones_of_cracks(last_step)
        head = ("crack", "places", "K of the overload", "its zone", "growth since")
        parts += [
            element("p", "What overloads have left at the last step:"),
            table(head, zones_left),
        ]
        note = "Cycles are retarded; the rate of a step is that of the law. Ranges: all places."
        parts.append(element("p", note, cls="soft"))
        values |= {"retardation": model, "zones": [dict(zip(head, row)) for row in zones_left]}
    return Section("spectrum", "Load history", join_parts(*parts), values)


def _rows(settings: Any, prefix: str, other_keys: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    return [
        (key.removeprefix(prefix), setting_words(text).partition(", sha256")[0])
        for key, text in settings.items()
        if key.startswith(prefix) and key not in other_keys and text != "None"
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
    x_min, x_max = float(x.min()), float(x.max())
    return f"{x_min:.4g}" if x_min == x_max else f"{x_min:.4g} to {x_max:.4g}"


__all__ = ["contact", "growth", "intensity", "lives", "numbers", "spectrum"]
