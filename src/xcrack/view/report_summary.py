"""The first page of a report, which a chief engineer signs: with looks and strength left."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.markup import Markup, element, join_parts, table
from xcrack.base.units import LENGTH, NUMBER, STRESS, TOUGHNESS
from xcrack.crack.crack import Crack
from xcrack.crack.measures import measures
from xcrack.growth.validity import ZONE
from xcrack.runs.assessment import CRITERIA, K_of_cracks
from xcrack.sif.sif import SIF
from xcrack.view.lives import plot_strength
from xcrack.view.report_pictures import drawn_figure, first_picture
from xcrack.view.report_scene import condition_row, values_in_words
from xcrack.view.report_source import Section, Source, setting_words

_MOST_LOADS = 8  # rows of a first page
_FEW = 0.05  # share of the samples that end before the life that is named


def summary(source: Source) -> Section:
    """Part, load, cracks, life, margins, inspections and warnings, with one picture."""
    rows = [*_part(source), *_cracks(source), *_growth(source), *_margins(source),
            *_decisions(source)]  # fmt: skip
    count = source.warnings.total()
    words = Markup(f'<a href="#warnings">{_count_of(count, "warning")}</a>')
    rows.append(("warnings", element("span", words, cls="bad" if count else "good")))
    parts: list[Any] = [table((), rows)]
    picture = first_picture(source.history, source.solutions, source.sif)
    if picture is not None:
        parts.append(picture)
    texts = {name: str(value) for name, value in rows if not isinstance(value, Markup)}
    return Section("summary", "Summary", join_parts(*parts), {**texts, "warnings": count})


Rows = Iterator[tuple[str, Any]]


def _count_of(n: int, word: str) -> str:
    return f"{n} {word}" if n == 1 else f"{n} {word}s"


def _part(source: Source) -> Rows:
    units, mesh, problem = source.units, source.mesh, source.problem
    if mesh is not None:
        size = " × ".join(f"{v:.6g}" for v in np.ptp(mesh.points, axis=0))
        yield "part", units.value(size, LENGTH)
    if problem is None:
        return
    for name, material in problem.elasticity.named:
        words = values_in_words(material, units)
        if source.yield_stress is not None:
            words += f", judged by a yield stress of {units.value(source.yield_stress, STRESS)}"
        yield (f"material {name!r}" if name else "material"), words
    load_rows = [condition_row("load", load, units) for load in problem.loads]
    for _, kind, place, value in load_rows[:_MOST_LOADS]:
        yield "load", ", ".join(part for part in (kind, place and f"at {place}", value) if part)
    if len(load_rows) > _MOST_LOADS:
        yield "load", f"and {len(load_rows) - _MOST_LOADS} more: see Scene"


def _cracks(source: Source) -> Rows:
    mesh, history = source.mesh, source.history
    if history is not None and history.steps:
        yield from ((f"crack {c} at first", _size(crack, source))
                    for c, crack in enumerate(history.steps[0].cracks))  # fmt: skip
    time = "" if history is None else " at the end"
    if mesh is not None or source.dim == 3:
        for c, crack in enumerate(source.cracks):
            yield f"crack {c}{time}", _size(crack, source)


def _size(crack: Crack, source: Source) -> str:
    """Length, or depth and length on the surface that it is deepest under."""
    mesh, units = source.mesh, source.units
    if mesh is None:
        extent = float(np.ptp(crack.points, axis=0).max())
        return f"extent {units.value(f'{extent:.5g}', LENGTH)}"
    of_crack = measures(crack, mesh)
    if source.dim == 2:
        return f"length {units.value(f'{of_crack.area:.5g}', LENGTH)}"
    if np.isnan(of_crack.depth) or not of_crack.traces:
        return f"area {units.value(f'{of_crack.area:.5g}', (2.0, 0.0))}"
    trace = max(of_crack.traces, key=lambda trace: trace.depth)
    return (f"depth {units.value(f'{of_crack.depth:.5g}', LENGTH)}, length "
            f"{units.value(f'{trace.length:.5g}', LENGTH)} on {trace.name}")  # fmt: skip


def _growth(source: Source) -> Rows:
    history = source.history
    if history is None or not history.steps:
        return
    if history.settings:
        yield "growth law", _settings(history.settings, "law")
        yield "load history", _settings(history.settings, "cycle")
    bar, by_steps = history.life_bar.total, history.life_bar.steps
    bars = "" if np.isnan(by_steps) else f" ± {by_steps:.2g} (by the steps; K not estimated)"
    bars = bars if np.isnan(bar) else f" ± {bar:.2g} (numerical error)"
    yield "life", f"{history.life:.6g} {history.unit}s{bars}"
    yield "why it ended", history.ended or "not known"
    for join in history.joins:
        yield "join", str(join)


def _settings(settings: Mapping[str, str], name: str) -> str:
    """A law or a load history in a line."""
    parts = [
        f"{key.removeprefix(name + '.')} = "
        f"{_short_number(setting_words(text).partition(', sha256')[0])}"
        for key, text in settings.items()
        if key.startswith(f"{name}.") and text not in ("None", "()")
    ]
    return f"{settings.get(name, '')}({', '.join(parts)})"


def _short_number(text: str) -> str:
    """A number without the digits that nobody reads."""
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text


def _margins(source: Source) -> Rows:
    units, history = source.units, source.history
    nu = source.nu
    if history is not None and history.solved:
        first_K, last_K = (max(K_of_cracks(history.solved[k], nu), default=0.0) for k in (0, -1))
        yield "largest K at first", units.value(f"{first_K:.5g}", TOUGHNESS)
        yield "largest K at the end", units.value(f"{last_K:.5g}", TOUGHNESS)
    else:
        for k, state in enumerate(source.sif):
            for c, sif in enumerate(state):
                if len(sif.K):
                    state_text = f", state {k}" if len(source.sif) > 1 else ""
                    yield f"K of crack {c}{state_text}", _largest_K(sif, source)
        last_K = np.nan if source.validity is None else source.validity.K
    for handbook_case in (
        () if source.problem is None or history is not None else source.problem.handbook
    ):
        yield "beside a handbook", handbook_case.comparison(source.solutions[-1])
    K_c = source.toughness
    if K_c is not None and last_K > 0:
        yield "margin of toughness", _verdict(f"K_c / K = {K_c / last_K:.4g}", K_c > last_K)
    known_validity = source.validity
    if known_validity is None or np.isnan(known_validity.zone):
        yield "plastic zone, net section", "not judged: no yield stress is known"
        return
    largest_share = np.nanmax([known_validity.of_crack, known_validity.of_ligament])
    words = f"plastic zone {100 * largest_share:.3g} % of the crack or ligament"
    yield "linear elasticity", _verdict(words, largest_share <= ZONE)
    if not np.isnan(known_validity.of_section):
        share = known_validity.of_section
        yield "net section", _verdict(f"{100 * share:.3g} % of the load that yields it", share < 1)


def _largest_K(sif: SIF, source: Source) -> str:
    """K of a tip or the largest of a front, with its bar."""
    names = ("K_I", "K_II", "K_III")
    j = int(np.argmax(np.linalg.norm(sif.K, axis=1)))
    values = ", ".join(f"{name} = {value:.5g}" for name, value in zip(names, sif.K[j]))
    bar = "" if np.isnan(sif.bar[j, 0]) else f" (K_I ± {sif.bar[j, 0]:.2g})"
    return source.units.value(values, TOUGHNESS) + bar


def _verdict(words: str, is_good: bool) -> Markup:
    return element("span", words, cls="good" if is_good else "bad")


def _decisions(source: Source) -> Rows:
    strength, plan, life = source.strength, source.inspection, source.life
    if strength is not None and len(strength):
        names = [name for name in CRITERIA if name in (strength.dtype.names or ())]
        least_factor = np.nanmin([strength[name] for name in names], axis=0)
        if "factor" in (strength.dtype.names or ()):
            least_factor = strength["factor"]
        words = f"bears {least_factor[-1]:.4g} times the largest load at the end"
        yield "residual strength", _verdict(words, least_factor.min() >= 1)
    if life is not None:
        early_life = life.percentile(100 * _FEW)
        yield "life with scatter", f"{100 * _FEW:g} % end before {early_life:.5g} {life.unit}s"
    if plan is not None:
        words_of_chance = "" if plan.missed is None else f"; all miss with chance {plan.missed:.3g}"
        yield "inspection", (f"first after {plan.first:.6g}, then every {plan.interval:.6g}: "
                             f"{_count_of(len(plan.at), 'look')}{words_of_chance}")  # fmt: skip


# --- what keeps a crack from breaking the body: looks, and strength left ---


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
        least_factor = np.nanmin([rows[name] for name in by], axis=0)
        if "factor" in names:
            least_factor = rows["factor"]
        first = np.nonzero(least_factor < 1)[0]
        words = (
            f"The largest load breaks the body from step {int(rows['step'][first[0]])} on."
            if len(first)
            else f"At the last step the body bears {least_factor[-1]:.4g} times the largest load."
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


__all__ = ["inspections", "strength", "summary"]
