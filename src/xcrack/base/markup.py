"""Values as HTML: tables and whole pages that need no network; for reports and notebooks."""

import html
import math
from collections.abc import Sequence
from typing import Any

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; --good: #2a7d2a; --bad: #c22; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem } h2 { margin-top: 2.2rem; font-size: 1.25rem;
border-bottom: 1px solid var(--line) } table { border-collapse: collapse; margin: .6rem 0 }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); text-align: left;
vertical-align: top; font-variant-numeric: tabular-nums }
th { background: var(--soft) }
td.n { text-align: right } .scroll { overflow: auto; max-height: 28rem }
img { max-width: min(100%, 46rem);
height: auto; background: #fff } .good { color: var(--good) } .bad { color: var(--bad);
font-weight: 600 } .soft { opacity: .7 } pre { background: var(--soft); padding: .6rem;
overflow: auto } figure { margin: .8rem 0 } nav a { margin-right: 1rem }
canvas { width: 100%; height: 32rem; touch-action: none; background: #fff }
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


__all__ = [
    "Markup",
    "display_text",
    "element",
    "escape_html",
    "join_parts",
    "list_markup",
    "page",
    "table",
]
