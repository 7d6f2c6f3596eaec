"""Tables of docs/run_folder.md: each array of a run folder, by the docstrings of the values.

    python scripts/run_folder_page.py             # write them into the page

`tests/history/test_run_folder.py` holds the page against them, and the files of runs too.
"""

import inspect
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

from xcrack.fatigue.retardation import BlockCycles, OverloadZones
from xcrack.growth.solves import SolveHistory
from xcrack.growth.stations import CellSizes, GrowthStations
from xcrack.growth.step import Arrival, Join, Plan, RunState, StepControl, StepError
from xcrack.growth.validity import Validity
from xcrack.linalg.engine import SlipField
from xcrack.sif.sif import SIF, KErrors, SurfaceEnd

PAGE = Path(__file__).resolve().parent.parent / "docs" / "run_folder.md"
BEGIN, END = "<!-- arrays -->\n", "<!-- end of arrays -->"
Row = tuple[str, str, str]  # name, shape and unit, what it is

# What is no field of one value, or has another shape there.
_CRACKS: tuple[Row, ...] = (
    ("points", "(p, d), length", "Points of all cracks, one after the other."),
    ("point_count", "(cracks,), int", "How many of them each crack has."),
    ("faces", "(f, d), int", "Numbers of the points of each face, within its crack."),
    ("face_count", "(cracks,), int", "How many faces each crack has."),
    ("ends", "(e,), int", "In 2D the point of each tip, in 3D the points along each front."),
    ("end_length", "(ends,), int", "How many of `ends` each tip or front has."),
    ("end_count", "(cracks,), int", "How many tips or fronts each crack has; -1: not placed yet."),
)
_STEP: tuple[Row, ...] = (
    ("array_count", "int", "How many other arrays the file has: one that has fewer is damaged."),
    ("run", "text", "What the run is: format, versions and settings, in JSON."),
    ("index", "int", "Number of the step."),
    ("cycles", "float", "Cycles until the cracks look like `corrected`."),
    ("states", "(s,), text", "Names of the load states."),
    ("levels", "(s,)", "Factors of the load states of a spectrum of factors."),
    ("sizes", "(cracks,), length", "Length of each crack inside the body; in 3D its area over the "
     "length of its fronts."),
    ("load_factor", "float, optional", "On all loads beside the `states`, where they change as the "
     "crack grows; K has it. Missing: 1."),
    ("warnings", "(w,), text", "Messages of the warnings; missing: not known."),
    ("identity_crack", "(cracks,), int", "Number that each crack had at first."),
    ("identity_end", "(ends,), int", "Identity of each tip or front."),
    ("identity_end_count", "(cracks,), int", "How many tips or fronts each crack has."),
    ("identity_name", "(identities,), text", "Name of each identity."),
)  # fmt: skip
_SOLVED: tuple[Row, ...] = (
    ("crack", "(n,), int", "Number of the crack of each station."),
    ("has_bar, has_contact_bar, has_widened, has_moduli", "(s, cracks), bool",
     "Whether K of a crack has them; missing where none has."),
    ("contact_bar", "(s, n, m), stress · √length", "Part of `bar` that contact has."),
    ("bar_reason", "(s, n), text", "Why there is no bar; empty where there is one."),
    ("corner_state, corner_crack", "(k,), int", "State and crack of each corner of a front."),
    ("angle", "(n,), rad", "Kink angle."),
    ("dK_eq", "(n,), stress · √length", "Equivalent range."),
    ("R", "(n,)", "Ratio."),
    ("R_range", "(n, 2)", "Smallest and largest ratio of all cycles of a block."),
    ("rate", "(n,), length/cycle", "Growth a cycle; 0 below the threshold, inf at the toughness."),
    ("law_rate", "(n,), length/cycle", "The same before the threshold."),
    ("da", "(n,), length", "Advance to the next step."),
)  # fmt: skip
_REUSE: tuple[Row, ...] = (
    ("reuse_count", "(2,), int", "Numbers of cracks of the closed sets and of the slip."),
    ("reuse_levels", "(k,)", "Levels of a spectrum that were refined."),
    ("reuse_centre_<crack>", "(g, d), length", "Where contact is looked at."),
    ("reuse_closed_<crack>", "(s, g), bool", "Where faces were closed."),
)
_MESH: tuple[Row, ...] = (
    ("points", "(p, d), length", "Points of the mesh."),
    ("cells", "(c, d + 1), int", "Their numbers in each cell."),
    ("facet_set_<name>", "(f, d), int", "Points of the facets of a set."),
    ("cell_set_<name>", "(k,), int", "Cells of a set."),
    ("arc_<name>_center, arc_<name>_radius, arc_<name>_axis", "(d,), float, (3,)",
     "Circle or cylinder that a facet set stands for."),
    ("pieces_<name>_points, pieces_<name>_facets", "(n, d), (k, 5) or (k, 15)",
     "Quartic pieces of a curve or surface that a facet set stands for: nodes, and those of each."),
)  # fmt: skip


def _documented(kind: type) -> dict[str, tuple[str, str]]:
    """Shape and unit, and the first sentences, of the attributes in a docstring."""
    result: dict[str, tuple[str, str]] = {}
    text = inspect.cleandoc(kind.__doc__ or "")
    part = re.split(r"^Attributes\n-+\n", text, flags=re.MULTILINE)[-1]
    part = re.split(r"^\n?[A-Z]\w+\n-{3,}\n", part, flags=re.MULTILINE)[0]
    for names, shape, words in re.findall(
        r"^(\w[\w, ]*) : (.*)\n((?:    .*\n?|\n(?=    ))*)", part + "\n", re.MULTILINE
    ):
        sentence = " ".join(words.split())
        for name in names.split(", "):
            result[name] = (shape, sentence)
    return result


def _rows(kind: Any, prefix: str, leave_out: tuple[str, ...] = (), lead: str = "") -> list[Row]:
    known = _documented(kind)
    rows = []
    for field in fields(kind):
        if field.name in leave_out:
            continue
        shape, words = known.get(field.name, ("", ""))
        rows.append((f"{prefix}{field.name}", f"{lead}{shape}", words))
    return rows


def array_names() -> dict[str, list[Row]]:
    """Names of the arrays of a run folder, shapes and units, and what they are, by groups."""
    K = _rows(SIF, "", ("front", "s", "x", "frame", "errors", "ends", "smooth_K"))
    stations = _rows(SIF, "", ("K", "T", "spread", "at_surface", "closed", "domain_cells", "errors",
                               "ends", "widened", "smooth_K", "E_prime", "nu"))  # fmt: skip
    nested = ("cracks", "apart", "joins")
    return {
        "A step": [*_STEP],
        "Cracks: `crack_` as solved, `corrected_` as they go on, `plan_` as they will be, `apart_` "
        "the same before they join": [
            (f"…_{name}", shape, words) for name, shape, words in _CRACKS
        ],
        "K at the n stations of all cracks, in s load states": [
            *stations,
            *((name, f"(s, …) of {shape}", words) for name, shape, words in K),
            *_rows(KErrors, "", ("reasons", "contact"), "(s, …) of "),
            *_SOLVED,
            *_rows(SurfaceEnd, "corner_", (), "(k, …) of "),
        ],
        "Where growth has come to, at n stations": _rows(GrowthStations, "station_"),
        "The last k solves at these": [
            *_rows(SolveHistory, "solves_", ("kinds",)),
            *_rows(BlockCycles, "solves_kinds_"),
        ],
        "What overloads have left: `zones_` there, `earlier_zones_` at the begin of the step": (
            _rows(OverloadZones, "…_")
        ),
        "The next step": [*_rows(Plan, "plan_", nested), *_rows(Join, "plan_join_")],
        "How long it may be": _rows(StepControl, "control_"),
        "Estimated errors": [
            (
                "error_place",
                "(n,), length",
                "How far each station may be from where steps of no length lead.",
            ),
            *_rows(StepError, "error_", ("place",)),
        ],
        "How far linear elasticity holds, with a yield stress or a toughness": [
            *_rows(Validity, "validity_", ("places",)),
            ("validity_number", "(k,), text", "Which of these numbers have a place."),
            ("validity_place", "(k,), text", "Where each of them is largest."),
        ],
        "What happened since the step before": [
            *_rows(Arrival, "arrival_", (), "each "),
            *_rows(Join, "join_", (), "each "),
        ],
        "What the run carries along": [
            *_rows(CellSizes, "run_cells_", (), "optional: "),
            *_rows(RunState, "run_", ("cells", "settings", "reuse")),
            *_REUSE,
            *_rows(SlipField, "reuse_slip_<crack>_"),
        ],
        "A mesh": [*_MESH],
    }


def table_of_names() -> str:
    """The same as tables of markdown."""
    lines = []
    for title, rows in array_names().items():
        lines += [f"## {title}", "", "| array | shape, unit | what it is |", "|---|---|---|"]
        for name, shape, words in rows:
            names = ", ".join(f"`{each}`" for each in name.split(", "))
            lines.append(f"| {names} | {shape.replace('|', 'or')} | {words.replace('|', 'or')} |")
        lines.append("")
    return "\n".join(lines)


def patterns() -> list[str]:
    """Regular expressions of all names of a step, and of a mesh."""
    result = []
    for rows in array_names().values():
        for name, *_ in rows:
            for each in name.split(", "):
                pattern = re.escape(each).replace("…", r"\w+?")
                result.append(re.sub(r"<\w+>", ".+", pattern))
    return result


def page_with_tables(text: str) -> str:
    """The page with the tables as they are now."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + "\n" + table_of_names() + rest[rest.index(END) :]


if __name__ == "__main__":
    PAGE.write_text(page_with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
