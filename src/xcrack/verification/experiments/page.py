"""The page *Predicted and measured*, with its pictures."""

import math
import tempfile
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.markup import Markup, element, escape_html, join_parts, list_markup, page, table
from xcrack.verification.experiments.experiment import Experiment
from xcrack.verification.experiments.outcome import Comparison, Outcome, Picture
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


_CLASS = {
    "agrees": "good",
    "differs": "bad",
    "failed": "bad",
    "reported": "soft",
    "skipped": "soft",
}
MEANING = (
    "Validation is no proof. Verification says that the equations are solved: that is the book. "
    "This page says how near predictions came to tests that others made, with the constants that "
    "they gave; nothing was fitted to a test that it is compared with, unless it says so.",
    "Tests of one material scatter: lives of equal specimens by some 10 to 30 per cent in one "
    "laboratory, and by a factor of 1.5 to 2 between heats and laboratories. A prediction within "
    "that band is as good as its law, one far inside of it is luck.",
    "What was taken from memory is named with each test. Numbers were read in the sources that are "
    "named, not measured again from their figures.",
)


def validation_page(
    outcomes: Sequence[Outcome],
    tests: Sequence[Experiment],
    versions: Mapping[str, str],
    *,
    quick: bool,
) -> str:
    """The whole page.

    Parameters
    ----------
    outcomes : sequence of Outcome
    tests : sequence of Experiment
        Of each outcome.
    versions : mapping
        Of xcrack, Python and the packages it was run with.
    quick : bool
    """
    titles = {test.name: test.title for test in tests}
    seconds = sum(each.seconds for each in outcomes if math.isfinite(each.seconds))
    extent = "coarse cells and long steps, tests in the plane" if quick else "all tests"
    command = "python -m xcrack validate" + (" --quick" if quick else "")
    return page(
        "xcrack: predicted and measured",
        element("h1", "Predicted and measured"),
        element("p", f"{len(outcomes)} tests, {extent}, {seconds:.0f} s. Make it: {command}"),
        *(element("p", words) for words in MEANING),
        element("h2", "All ratios"),
        _image(png_of(draw_ratios, outcomes, titles), "Predicted over measured, all tests"),
        element("h2", "Summary"),
        _summary(outcomes, titles),
        element("h2", "Tests"),
        *(_test(outcome, test) for outcome, test in zip(outcomes, tests, strict=True)),
        element("h2", "Versions"),
        table((), tuple(versions.items())),
    )


def _summary(outcomes: Sequence[Outcome], titles: Mapping[str, str]) -> Markup:
    rows = []
    for outcome in outcomes:
        link = Markup(
            f'<a href="#{escape_html(outcome.name)}">{escape_html(titles[outcome.name])}</a>'
        )
        first = next(iter(outcome.comparisons), None)
        number = "" if first is None else f"{first.name}: {value_words(first)}"
        status = element("span", outcome.status, cls=_CLASS[outcome.status])
        rows.append([link, number, status, f"{outcome.seconds:.0f} s"])
    return table(("test", "first number", "", "time"), rows)


def value_words(comparison: Comparison) -> str:
    """What is judged, with its unit."""
    unit = "" if comparison.measure == "ratio" else f" {comparison.unit}".rstrip()
    return f"{comparison.value:.3g}{unit}"


def bound_words(comparison: Comparison) -> str:
    """The bounds in words; empty where there is none."""
    low, high = comparison.least, comparison.most
    if math.isfinite(low) and math.isfinite(high):
        return f"{low:.3g} to {high:.3g}"
    if math.isfinite(high):
        return f"at most {high:.3g}"
    return f"at least {low:.3g}" if math.isfinite(low) else ""


def _test(outcome: Outcome, test: Experiment) -> Markup:
    head = Markup(
        f'<h3 id="{escape_html(outcome.name)}">{escape_html(test.title)} '
        f"{element('span', outcome.status, cls=_CLASS[outcome.status])}</h3>"
    )
    parts: list[Any] = [head, element("p", f"{test.kind} · {test.units} · {outcome.seconds:.0f} s")]
    if outcome.skipped or outcome.error:
        parts.append(element("pre", outcome.skipped or outcome.error))
    parts += [_image(png_of(draw_picture, each), each.words) for each in outcome.pictures]
    if outcome.comparisons:
        parts.append(table(
            ("number", "predicted", "measured", "ratio, difference or distance", "asserted", ""),
            [_row(each) for each in outcome.comparisons],
        ))  # fmt: skip
    words = [*outcome.words, *test.remarks]
    if words:
        parts.append(list_markup(words))
    source = test.source
    parts.append(element("p", f"Measured by: {source['work']}."))
    where = [source["place"], *([f"commit {source['commit']}"] if "commit" in source else [])]
    files = f": {', '.join(source['files'])}" if "files" in source else ""
    parts.append(
        element("p", f"Read in: {', '.join(where)}{files}. Licence: {test.license}.", cls="soft")
    )
    recalled = "; ".join(test.recalled) or "nothing"
    parts.append(element("p", f"From memory: {recalled}.", cls="soft"))
    if outcome.warnings:
        parts.append(element("p", f"{len(outcome.warnings)} warning(s), such as:", cls="soft"))
        parts.append(list_markup(outcome.warnings[:2]))
    return join_parts(*parts)


def _row(comparison: Comparison) -> list[Any]:
    has_pair = comparison.measure in ("ratio", "difference")
    verdict = ""
    if comparison.is_asserted:
        words, kind = ("ok", "good") if comparison.passed else ("differs", "bad")
        verdict = element("span", words, cls=kind)
    return [
        comparison.name,
        f"{comparison.predicted:.5g}" if has_pair else "",
        f"{comparison.measured:.5g}" if has_pair else "",
        value_words(comparison),
        bound_words(comparison),
        verdict,
    ]


def _image(png: bytes, words: str) -> Markup:
    data = b64encode(png).decode()
    image = f'<img alt="{escape_html(words)}" src="data:image/png;base64,{data}">'
    return Markup(f"<figure>{image}<figcaption>{escape_html(words)}</figcaption></figure>")


__all__ = [
    "MEANING",
    "bound_words",
    "draw_picture",
    "draw_ratios",
    "png_of",
    "validation_page",
    "value_words",
]
