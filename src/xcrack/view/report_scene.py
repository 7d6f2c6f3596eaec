"""Sections on what was asked: scene, assumptions, validity, inputs and how to run it again."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arguments import Argument, Declared, arguments_of
from xcrack.base.arrays import coordinates
from xcrack.base.machine import versions
from xcrack.base.markup import Markup, display_text, element, join_parts, list_markup, table
from xcrack.base.units import FORCE, LENGTH, LINE_FORCE, MOMENT, NUMBER, Dimension
from xcrack.crack.crack import Crack
from xcrack.crack.measures import Measures, measures
from xcrack.crack.stations import GEOMETRY
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import Condition
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.view.report_source import Section, Source, UnitNames, setting_words


def scene(source: Source) -> Section:
    """Body, material, cracks, supports, and each load with its resultant."""
    rows: list[tuple[Any, Any]] = []
    numbers: dict[str, Any] = {"dim": source.dim, "cracks": len(source.cracks)}
    mesh, problem = source.mesh, source.problem
    if mesh is not None:
        size = " × ".join(f"{v:.6g}" for v in np.ptp(mesh.points, axis=0))
        rows += [
            ("body", source.units.value(size, LENGTH)),
            ("mesh", f"{mesh.n_points} points, {len(mesh.cells)} cells"),
        ]
        numbers |= {"points": mesh.n_points, "cells": len(mesh.cells)}
    if problem is not None:
        rows += [
            (
                f"material {name!r}" if name else "material",
                values_in_words(material, source.units) or repr(material),
            )
            for name, material in problem.elasticity.named
        ]
        rows += [("order of the elements", problem.order), ("contact", problem.contact)]
    for c, crack in enumerate(source.cracks):
        tip_materials = "" if problem is None else _materials_of_tips(problem, source.sif, c)
        rows.append((f"crack {c}", _crack(crack, mesh) + tip_materials))
    parts: list[Any] = [table((), rows)]
    crack_measures = [] if mesh is None else [measures(crack, mesh) for crack in source.cracks]
    if crack_measures:
        size = GEOMETRY[source.dim].size
        area = LENGTH if source.dim == 2 else (2.0, 0.0)
        head = ("crack", source.units.head(size, area), source.units.head("depth", LENGTH),
                "on the surfaces", "ends")  # fmt: skip
        parts.append(table(head, [_measures_of_crack(c, m) for c, m in enumerate(crack_measures)]))
        numbers["measures"] = [
            asdict(m) | {"depth": None if np.isnan(m.depth) else m.depth} for m in crack_measures
        ]
    if problem is not None and source.solutions:
        parts.append(_conditions(source.solutions[-1], source.units))
    else:
        parts.append(element("p", "The stored steps do not hold the loads: they are in the script "
                             "or the case file that made the run.", cls="soft"))  # fmt: skip
    return Section("scene", "Scene", join_parts(*parts), numbers)


def _materials_of_tips(problem: Problem, sif: Sequence[Sequence[SIF]], c: int) -> str:
    """In which materials the tips of a crack are, where there are several."""
    elasticity = problem.elasticity
    if not len(elasticity.set_number) or not sif or not len(sif[0][c].x):
        return ""
    sets = elasticity.sets_at(sif[0][c].x)
    if problem.mesh.dim == 3:
        sets = np.unique(sets)
    return f", in {', '.join(repr(elasticity.named[k][0]) for k in sets.tolist())}"


def _crack(crack: Crack, mesh: Mesh | None) -> str:
    if crack.fronts is not None:
        n = [len(front) for front in crack.fronts]
        return f"{len(crack.faces)} triangles, {len(n)} front(s) of {', '.join(map(str, n))} points"
    tips = "not placed" if crack.tips is None else f"{len(crack.tips)} tip(s)"
    length = "" if mesh is None else f"length {measures(crack, mesh).area:.6g} in the body, "
    return f"{len(crack.points)} points, {length}{tips}"


def _measures_of_crack(c: int, m: Measures) -> tuple[str, ...]:
    """A crack as it is read off: lengths and depths by facet set, ends by place and set."""
    surfaces = "; ".join(f"{t.name}: length {t.length:.4g}, depth {t.depth:.4g}" for t in m.traces)
    ends = "; ".join(f"{_vector(end.x)} on {end.name}" for end in m.ends)
    depth = "" if np.isnan(m.depth) else f"{m.depth:.6g}"
    return str(c), f"{m.area:.6g}", depth, surfaces or "none", ends or "none"


def _conditions(solution: Solution, units: UnitNames) -> Markup:
    """Supports and loads, and what they add up to in this state."""
    rows = [condition_row("support", support, units) for support in solution.problem.supports]
    rows += [condition_row("load", load, units) for load in solution.loads]
    if not rows:
        return element("p", "No supports and no loads.")
    parts = [table(("", "kind", "where", "value"), rows)]
    sums = [(resultant.name, *resultant.sums_as_text) for resultant in solution.report.resultants]
    if sums:
        force, moment = (LINE_FORCE, FORCE) if solution.space.dim == 2 else (FORCE, MOMENT)
        head = ("resultants and reactions", units.head("force", force),
                units.head("moment about the origin", moment))  # fmt: skip
        parts += [element("p", f"Scale of the loads in this state: {solution.factor:.6g}."),
                  table(head, sums)]  # fmt: skip
    return join_parts(*parts)


def condition_row(role: str, condition: Condition, units: UnitNames) -> tuple[str, str, str, str]:
    """Role, kind, place and values of a support or a load."""
    location = condition.place
    place = "" if location is None else location if isinstance(location, str) else _vector(location)
    return role, condition.kind, place, values_in_words(condition, units)


def values_in_words(value: Declared, units: UnitNames) -> str:
    """Arguments of a value that are not left out, but for its place, with their units."""
    words = [
        f"{name} = {_value(getattr(value, name))} {units.label(_unit(argument))}".rstrip()
        for name, argument in arguments_of(type(value)).items()
        if name != "where" and getattr(value, name) is not argument.default
    ]
    return ", ".join(words)


def _unit(argument: Argument) -> Dimension:
    unit = None if argument.rule is None else argument.rule.unit
    return NUMBER if unit is None or callable(unit) else unit


def _vector(values: Any) -> str:
    return coordinates(np.atleast_1d(np.asarray(values, dtype=float)))


def _value(value: Any) -> str:
    if callable(value):
        name = getattr(value, "__name__", getattr(value, "name", type(value).__name__))
        return f"function {name}"
    array = np.asarray(value, dtype=object)
    return str(_short_number(array.tolist())) if array.ndim else display_text(value)


def _short_number(value: Any) -> Any:
    """Numbers without the digits that nobody reads."""
    if isinstance(value, list):
        return [_short_number(entry) for entry in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def assumptions(source: Source) -> Section:
    """What was modelled and what was left out, and why; where linear elasticity holds."""
    rows, numbers = [], {}
    if source.solutions:
        for row in source.solutions[0].report.ingredients:
            rows.append((row.name, "used" if row.used else "left out", row.reason,
                         row.unknowns or ""))  # fmt: skip
            numbers[row.name] = {"used": row.used, "reason": row.reason}
    parts: list[Any] = []
    if rows:
        parts.append(table(("ingredient", "", "reason", "unknowns"), rows))
    notes = _notes(source)
    parts.append(element("h3", "Validity of linear elastic fracture mechanics"))
    parts.append(list_markup(notes))
    return Section("assumptions", "Assumptions", join_parts(*parts),
                   {"ingredients": numbers, "validity": notes})  # fmt: skip


def _notes(source: Source) -> list[str]:
    has_friction = any(any(solution.problem.frictions) for solution in source.solutions)
    faces = "with Coulomb friction" if has_friction else "without friction"
    notes = [f"Small strains, a linear elastic isotropic body, crack faces {faces}."]
    notes.append(plastic_zone(source)[0])
    history = source.history
    if history is not None and history.settings:
        law = history.settings.get("law", "")
        ratios = [R for step in history.steps for R in step.R_range or step.R if len(R)]
        if ratios:
            all_R = np.concatenate([R.ravel() for R in ratios])
            all_R = all_R[np.isfinite(all_R)]
            if len(all_R):
                label = "run" if history.unit == "cycle" else f"cycles of each {history.unit}"
                notes.append(f"R of the {label} is {all_R.min():.3g} to {all_R.max():.3g}: compare "
                             "it with the range that the growth law was fitted for.")  # fmt: skip
        program = history.settings.get("load_program", "None")
        if program != "None":
            factors = [step.load_factor for step in history.steps]
            notes.append(f"The loads change as the crack grows ({program}): their factor goes "
                         f"from {factors[0]:.4g} to {factors[-1]:.4g}, see load_factor in the "
                         "table of the run.")  # fmt: skip
        has_contact = any(state[c].closed.any() for step in history.steps for state in step.sif
                       for c in range(len(state)))  # fmt: skip
        if "elber" in law and has_contact:
            notes.append("Closure may be counted twice: the law has a share U of the range, and "
                         "contact of the crack faces was computed too.")  # fmt: skip
    return notes


def plastic_zone(source: Source) -> tuple[str, list[str]]:
    """Plastic zones against crack, ligament and cell in words, and what is beyond its limit."""
    check = source.validity
    if check is None or np.isnan(check.zone):
        words = ("Plastic zones and net sections were not judged: no yield stress is known. Give "
                 "Isotropic(..., yield_stress=...), or report(..., yield_stress=...).")  # fmt: skip
        return words, [] if check is None else [str(alarm) for alarm in check.alarms()]
    shares = {"crack": check.of_crack, "ligament ahead": check.of_ligament}
    if _cell(source) > 0:
        shares["smallest cell"] = check.zone / _cell(source)
    parts = ", ".join(f"{100 * share:.3g} % of the {of}" for of, share in shares.items()
                      if not np.isnan(share))  # fmt: skip
    alarms = [str(alarm) for alarm in check.alarms()]
    verdict = "NOT small: linear elastic K does not hold" if alarms else "small"
    words = (f"Plastic zone (Irwin, plane {check.state}) of {check.zone:.4g} for the largest K "
             f"{check.K:.6g}: at most {parts}; {verdict}.")  # fmt: skip
    if not np.isnan(check.of_section):
        words += f" Net section: {100 * check.of_section:.3g} % of the load at which it yields."
    return words, alarms


def _cell(source: Source) -> float:
    return 0.0 if source.mesh is None else float(source.mesh.cell_size.min())


def all_warnings(source: Source) -> Section:
    """All warnings, counted."""
    if source.warnings:
        rows = [(n, text) for text, n in source.warnings.most_common()]
        content = join_parts(table(("times", "warning"), rows))
    else:
        content = element("p", "There were none.")
    history = source.history
    if history is not None and any(s.warnings is None and not s.solutions for s in history.steps):
        hint = ("Steps of this run, made by an older xcrack, hold no warnings of K: columns spread "
                "and domain_cells of the table show how far each K is to be trusted.")  # fmt: skip
        content = join_parts(content, element("p", hint, cls="soft"))
    return Section("warnings", f"Warnings ({source.warnings.total()})", content,
                   {"messages": dict(source.warnings)})  # fmt: skip


def rerun_section(source: Source) -> Section:
    """Inputs, versions, and how to run it again."""
    software, hashes = versions(), source.hashes()
    history = source.history
    settings = {} if history is None else dict(history.settings)
    parts: list[Any] = [table((), [*software.items(), *hashes.items()])]
    if history is not None and history.path is not None:
        text = f"history = xc.load({str(history.path)!r})\nxc.report(history, 'report.html')"
        if not source.is_whole:
            text += (
                f"\n# go on: xc.resume({str(history.path)!r}, problem, law, criterion, cycle, ...)"
            )
        parts.append(element("pre", text))
    else:
        parts.append(element("p", "Run the script or the case file that made this again; equal "
                             "hashes say that mesh and cracks are the same."))  # fmt: skip
    if settings:
        rows = [(k, setting_words(v)) for k, v in sorted(settings.items()) if v != "None"]
        body = table((), rows, scroll=True)
        parts.append(Markup(f"<details><summary>settings of the run</summary>{body}</details>"))
    return Section("again", "Inputs, versions, and how to run it again", join_parts(*parts),
                   {"versions": software, "hashes": hashes, "settings": settings})  # fmt: skip


__all__ = [
    "all_warnings",
    "assumptions",
    "condition_row",
    "plastic_zone",
    "rerun_section",
    "scene",
    "values_in_words",
]
