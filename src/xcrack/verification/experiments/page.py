"""The page *Predicted and measured*."""

import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

from xcrack.base.markup import Markup, element, escape_html, join_parts, list_markup, page, table
from xcrack.verification.experiments.experiment import Experiment
from xcrack.verification.experiments.outcome import Comparison, Outcome
from xcrack.verification.experiments.pictures import draw_picture, draw_ratios, png_of

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


__all__ = ["MEANING", "bound_words", "validation_page", "value_words"]
