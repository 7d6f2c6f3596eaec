"""Write a report: sections, pictures and the interactive view in one file."""

import datetime
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from numpy.typing import NDArray

from xcrack.base.arguments import CheckedBy, FilePath, Number, Part, Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError, warn
from xcrack.base.machine import versions
from xcrack.base.markup import Markup, element, join_parts, list_markup, page
from xcrack.base.paths import write_texts
from xcrack.base.units import STRESS
from xcrack.fatigue.spectrum import Spectrum
from xcrack.runs.inspection import Inspection
from xcrack.runs.life import Life
from xcrack.view import report_results as results
from xcrack.view import report_scene as scene
from xcrack.view import report_summary as front
from xcrack.view.report_pictures import figure_markup, history_pictures, solution_pictures
from xcrack.view.report_source import Section, Source, UnitNames, path_or_result, source_of
from xcrack.view.report_viewer import history_layers, packed_layers, solution_layers, viewer

_FORMAT = 1


@check_arguments()
def report(
    result: Annotated[Any, CheckedBy(path_or_result)],
    file: Annotated[str | PathLike[str], FilePath(is_file=True)],
    *,
    title: Annotated[str, Text(may_be_empty=True)] = "",
    yield_stress: Annotated[float | None, Number(above=0, unit=STRESS)] = None,
    life: Annotated[Life | None, Part(Life, "what xc.life returns")] = None,
    inspection: Annotated[Inspection | None, Part(Inspection, "what xc.inspection returns")] = None,
    strength: NDArray[Any] | None = None,
    spectrum: Annotated[Spectrum | None, Part(Spectrum, "a Spectrum")] = None,
    units: Annotated[str | None, Text('force, length and stress, such as "N, mm, MPa"')] = None,
) -> Path:
    """Write what was modelled and what came out, as one page that needs no network.

    The page begins with a summary to sign: part, material, load, law, cracks at first and at the
    end, life with its bar, margins, inspections, the number of warnings, one picture. Behind it
    are the scene, assumptions and their validity, K, contact, growth, all warnings, the
    table of a run as CSV, pictures, for bodies in space a view to turn, and how to run it again.
    A ``.json`` file beside it has the numbers.

    Parameters
    ----------
    result : Solution, list of Solution, History, or path
        A path is the folder that `collect` wrote to; a run that is half written is reported as far
        as it is there.
    file : path
        Of the page; ``.html`` is added where it has no suffix.
    title : str
    yield_stress : float, stress, optional
        In place of that of the material: lets the report compare plastic zones with crack,
        ligament and cell. What `check` says of them is a warning.
    life : Life, optional
        What `xc.life` made of the run: the report shows it and what drives it.
    inspection : Inspection, optional
        What `xc.inspection` made of the run: when to look.
    strength : structured array, optional
        What `xc.residual_strength` made of the run.
    spectrum : Spectrum, optional
        Load history of the run, for its picture: runs store its hash alone.
    units : str, optional
        Names of force, length and stress, such as ``"N, mm, MPa"``: they stand in all tables.

    Returns
    -------
    Path

    Raises
    ------
    ProblemError
        No run in the folder, a file with another suffix, or one that cannot be written.
    """
    path = Path(file)
    path = path if path.suffix else path.with_name(path.name + ".html")
    if path.suffix.lower() != ".html":
        raise ProblemError(
            f"report: file = {value_text(str(file))}: a report is a page: give a file that ends "
            "in .html."
        )
    names = getattr(getattr(strength, "dtype", None), "names", None) or ()
    if strength is not None and not {"step", "by_toughness"} <= set(names):
        raise ProblemError(
            f"report: strength = {value_text(strength)}: give what xc.residual_strength returns."
        )
    names_of_units = UnitNames.read(units)
    source = source_of(result, title, yield_stress, life)
    source = replace(source, inspection=inspection, strength=strength, spectrum=spectrum,
                     units=names_of_units)  # fmt: skip
    for words in scene.plastic_zone(source)[1]:
        warn(words)
        source.warnings.update([words])
    sections = [section for make in SECTIONS if (section := make(source)) is not None]
    texts = {path: _page(source, sections), path.with_suffix(".json"): _json(source, sections)}
    write_texts(texts, "the report cannot be written to", error=ProblemError)
    return path


def pictures(source: Source) -> Section:
    """Pictures; why some are missing is said."""
    figures, messages = solution_pictures(source.solutions, source.sif)
    if source.history is not None:
        of_run, messages_of_run = history_pictures(source.history)
        figures, messages = figures + of_run, messages + messages_of_run
    parts: list[Any] = [figure_markup(picture) for picture in figures]
    if messages:
        parts += [element("p", "Not drawn here:", cls="soft"), list_markup(messages)]
    if not parts:
        parts.append(element("p", "There is nothing to draw yet."))
    return Section("pictures", "Pictures", join_parts(*parts),
                   {"drawn": [words for words, _ in figures], "missing": messages})  # fmt: skip


def space_view(source: Source) -> Section | None:
    """The interactive view of a body in space."""
    layers: list[dict[str, Any]] = []
    if source.dim < 3:
        return None
    history = source.history
    try:
        if history is not None and len(history.steps) > 1:
            layers = history_layers(history)
        elif source.solutions:
            layers = solution_layers(source.solutions[-1])
    except XcrackError:
        layers = []
    content = packed_layers(layers)
    if content is None:
        words = (
            "No view to turn: there is nothing to draw, or too much for a page; see the pictures."
        )
        return Section("view", "View", element("p", words, cls="soft"), {"layers": 0})
    return Section("view", "View", viewer(content), {"layers": len(content["layers"])})


SECTIONS: Sequence[Callable[[Source], Section | None]] = (
    front.summary,
    scene.scene,
    space_view,
    results.growth,
    results.spectrum,
    results.lives,
    front.inspections,
    front.strength,
    results.intensity,
    results.contact,
    scene.assumptions,
    scene.all_warnings,
    pictures,
    results.numbers,
    scene.rerun_section,
)
"""Parts of a report in their order; a new one is a function of the source, and an entry here."""


def _page(source: Source, sections: Sequence[Section]) -> str:
    date = datetime.date.today().isoformat()
    links = Markup(" ".join(f'<a href="#{s.key}">{s.title}</a>' for s in sections))
    parts: list[Any] = [
        element("h1", source.title),
        element("p", f"xcrack {versions()['xcrack']} · {date}", cls="soft"),
    ]
    if not source.is_whole:
        words = "This run is not finished; the report shows what is there."
        parts.append(element("p", words, cls="bad"))
    parts.append(element("nav", links))
    for section in sections:
        parts += [Markup(f'<h2 id="{section.key}">{section.title}</h2>'), section.content]
    return page(source.title, *parts)


def _json(source: Source, sections: Sequence[Section]) -> str:
    content = {"format": _FORMAT, "title": source.title, "whole": source.is_whole,
               **{section.key: dict(section.numbers) for section in sections}}  # fmt: skip
    return json.dumps(content, indent=1, ensure_ascii=False, default=str) + "\n"


__all__ = ["SECTIONS", "report"]
