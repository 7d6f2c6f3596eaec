"""Charts of error against time, and the verification book."""

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, Late, arg
from fuzz.file_rules import PICTURE, WINDOW
from fuzz.kinds import (
    NONSENSE,
    SKIP,
    VALID,
    Called,
    Filename,
    Flag,
    ListOf,
    Number,
    Of,
    Seen,
    Whole,
    Word,
    array,
)
from fuzz.values import paths


class Only(Word):
    """Part of the name of a case; others would run for long."""

    def verdict(self, value):
        if isinstance(value, str) and "no such" not in value and value != "cycle-rule":
            return SKIP
        return VALID if isinstance(value, str) and value == "cycle-rule" else NONSENSE


class OnlyTest(Word):
    """Part of the name of a test; others would run for long."""

    def verdict(self, value):
        if isinstance(value, str) and "no such" not in value and value != "demir":
            return SKIP
        return VALID if isinstance(value, str) and value == "demir" else NONSENSE


def settings(value):
    """Whether a value is settings of a chart: of none of the general ones."""
    return None if isinstance(value, dict) and not value else value is None or False


def _charted(**changes):
    given = {
        "settings": [{"order": 1}],
        "repeat": 1,
        "seconds": 0.05,
        "progress": False,
        "meshes": [scenes.mesh(), scenes.fine_mesh()],
    }
    chart = xc.chart(scenes.problem(), **given | changes)
    return [chart.reference_error, *(row.error for row in chart.rows if not row.failed)]


def _quantity(value):
    """Whether a value is numbers, at least one of them not zero."""
    x = array(value)
    if x is None or not np.isfinite(x).all() or not x.any():
        return False
    return None if not 1e-6 < np.abs(x).max() < 1e6 else True


ENTRIES = [
    Entry(
        "verify",
        lambda **named: xc.verify(**named).passed,
        {
            "only": arg(
                Only(), "cycle-rule", near={"unknown": lambda: "no such case"}, words=["case"]
            ),
            "quick": arg(Flag(), True),
            "progress": arg(Flag(), False),
            "file": arg(
                Filename(optional=True, endings=(".html", ".md")),
                None,
                "good.html",
                near=paths(".html", ""),
                words=["book"],
            ),
        },
        in_folder=True,
        cost=0.2,
    ),
    Entry(
        "validate",
        lambda **named: xc.validate(**named).passed,
        {
            "only": arg(
                OnlyTest(), "demir", near={"unknown": lambda: "no such test"}, words=["test"]
            ),
            "quick": arg(Flag(), True),
            "progress": arg(Flag(), False),
            "data": arg(Filename(optional=True, folder=True, known=(".",)), None, words=["folder"]),
            "file": arg(
                Filename(optional=True, endings=(".html", ".md")),
                None,
                "good.html",
                near=paths(".html", ""),
                words=["page", "results"],
            ),
        },
        in_folder=True,
        cost=1.0,
    ),
    Entry(
        "chart",
        _charted,
        {
            "settings": arg(
                Seen(rule=settings),
                [{"order": 1}],
                {"coarse": {"order": 1}},
                near={
                    "unknown field": lambda: [{"no_such": 1}],
                    "mesh": lambda: [{"mesh": 1}],
                    "twice": lambda: [{"order": 1}, {"order": 1}],
                    "numbers": lambda: [{1: 2}],
                    "texts": lambda: ["order"],
                },
                words=["order"],
            ),
            "meshes": arg(
                Seen(rule=lambda v: None if v is None or callable(v) else False),
                Late(lambda: [scenes.mesh(), scenes.fine_mesh()]),
                near={
                    "one": lambda: [scenes.mesh()],
                    "falling": lambda: [scenes.fine_mesh(), scenes.mesh()],
                    "3D": lambda: [scenes.mesh(3)] * 2,
                },
            ),
            "states": arg(
                ListOf(
                    optional=True,
                    item=Number(also=(Seen(rule=lambda v: v is None),)),
                    least=1,
                    rule=lambda v: None,
                ),
                None,
                [1.0],
                words=["load"],
            ),
            "quantity": arg(
                Called(optional=True), None, lambda solutions: 1.0 + np.size(solutions)
            ),
            "tolerances": arg(
                ListOf(optional=True, item=Number(above=0, below=1, rule=lambda v: None), least=1),
                None,
                [0.1, 0.05],
            ),
            "wanted": arg(Number(optional=True, above=0), None, 1e-2),
            "repeat": arg(Whole(least=1, most=1000, far=2), 1),
            "seconds": arg(Number(above=0), 0.05),
            "progress": arg(Flag(also=(Word(words=("always",)),)), False),
            "file": arg(
                Filename(optional=True, endings=(".png", ".pdf", ".svg", ".jpg")),
                None,
                near=paths(".png", ".png"),
                words=["picture"],
            ),
        },
        in_folder=True,
        cost=0.6,
    ),
    Entry(
        "chart",
        lambda problem: xc.chart(problem),
        {"problem": arg(Of(type=xc.Problem, rule=lambda v: None), near={"none": lambda: None})},
        arity=False,
        cost=8.0,
    ),
    Entry(
        "chart",
        lambda wanted: scenes.chart().best(wanted).wanted,
        {"wanted": arg(Number(above=0), 1e-2)},
    ),
    Entry(
        "chart",
        lambda row: scenes.chart().shown(row),
        {"row": arg(Seen(rule=lambda v: False), Late(lambda: scenes.chart().rows[0]))},
    ),
    Entry(
        "chart",
        lambda **named: scenes.chart().plot(**named),
        {"file": PICTURE, "show": WINDOW},
        in_folder=True,
        cost=0.5,
    ),
    Entry(
        "chart", lambda: [len(scenes.chart().table()), len(str(scenes.chart()))], {}, arity=False
    ),
]
HOOKS = [
    Hook(
        "chart",
        lambda f: _charted(quantity=f),
        lambda solution: solution.energy,
        Seen(rule=_quantity),
        "quantity of chart",
        cost=0.5,
        in_folder=True,
    ),
    Hook(
        "chart",
        lambda f: _charted(meshes=f),
        lambda size: xc.box((-1, -1), (1, 1), max(2, round(2 / size))),
        Seen(rule=lambda v: False),
        "meshes of chart",
        cost=0.8,
        in_folder=True,
    ),
]
