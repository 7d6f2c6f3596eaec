"""Case files, reports, and what the command line offers."""

from pathlib import Path

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Bad, Entry, Late, arg
from fuzz.kinds import (
    EDGE,
    NONSENSE,
    SKIP,
    VALID,
    Filename,
    Flag,
    Kind,
    Number,
    Of,
    Seen,
    Word,
)
from fuzz.values import paths
from xcrack.growth.options import GrowthOptions

CASE = """
title = "Edge crack"
[units]
length = {length}
force = {force}
[mesh]
kind = {kind}
lower = {lower}
upper = [20.0, 20.0]
n = {n}
[material]
E = {E}
nu = {nu}
plane = {plane}
[[cracks]]
kind = "line"
points = {points}
[[loads]]
kind = "traction"
where = {where}
value = {value}
[[loads]]
kind = "traction"
where = "bottom"
value = [0.0, -80.0]
[solve]
order = {order}
"""


class Toml(Kind):
    """A text of toml in the place of a value: some are valid, all else is nonsense."""

    def verdict(self, value):
        if not isinstance(value, str):
            return SKIP
        return VALID if value in GOOD_TOML else EDGE if value in EDGES_OF_TOML else NONSENSE


_TEXTS = (
    '"a"', "-1", "nan", "inf", "true", "[]", "{}", '"1 m/s"', '"three mm"', "[1, [2]]", '""', "= 1",
    "1979-05-27", "[nan, 1.0]", '["a", "b"]', "2.5", '"nan MPa"', "[[1]]", "-0.5", "'''a\nb'''",
    "1e400", "9" * 400,
)  # fmt: skip

NONSENSE_TOML = {text: lambda text=text: text for text in _TEXTS}

TOML = {
    "length": '"mm"',
    "force": '"N"',
    "kind": '"box"',
    "lower": "[0.0, -20.0]",
    "n": "[10, 20]",
    "E": '"210 GPa"',
    "nu": "0.3",
    "plane": '"strain"',
    "points": '[[0.0, "0.1 cm"], [6.0, 1.0]]',
    "where": '"top"',
    "value": '[0.0, "80 MPa"]',
    "order": "1",
}

GOOD_TOML = set(TOML.values())

EDGES_OF_TOML = {
    "true",
    "-1",
    "2.5",
    "[]",
    "-0.5",
    '"a"',
    '""',
    "9" * 400,
    "inf",
    "1e400",
}  # right in some places


def _case(**changes):
    Path("case.toml").write_text(CASE.format(**TOML | changes), encoding="utf-8")
    return xc.read_case("case.toml").problem.mesh


def _read_case(path):
    _case()
    Path("half.toml").write_text(CASE.format(**TOML)[:150])
    Path("empty.toml").write_text("")
    Path("bytes.toml").write_bytes(bytes(range(256)))
    Path("unknown.toml").write_text("[nothing]\na = 1\n")
    return xc.read_case(path).problem.mesh


def _run(path, **named):
    _case()
    return xc.run(path, **named)


def _changed(changes):
    _case()
    return xc.read_case("case.toml", changes)


def _swept(path, values, **named):
    _case()
    return xc.sweep(path, values, **named).table()["seconds"]


def _reported(**named):
    given = {"result": scenes.solution(), "file": "good.html"}
    return xc.report(**given | named)


# `grow` has entries for what these are; here they only must not be taken for another thing.
GROWTH = tuple(GrowthOptions.__annotations__)

ENTRIES = [
    Entry(
        "read_case",
        _read_case,
        {
            "path": arg(
                Filename(known=("case.toml",)),
                "case.toml",
                near=paths(".toml", "")
                | {
                    name: lambda name=name: f"{name}.toml"
                    for name in ("half", "empty", "bytes", "unknown")
                },
                words=["toml", "file"],
            ),
        },
        in_folder=True,
        cost=0.05,
    ),
    Entry(
        "read_case",
        _case,
        {
            name: arg(Toml(), text, near=NONSENSE_TOML, words=["toml", "lines"])
            for name, text in TOML.items()
        },
        in_folder=True,
        arity=False,
        cost=0.05,
    ),
    Entry(
        "read_case",
        lambda changes: _changed(changes).problem.mesh,
        {
            "changes": arg(
                Seen(rule=lambda v: v is None or (None if isinstance(v, dict) else False)),
                None,
                {"material.nu": 0.2},
                words=["changes", "key"],
            )
        },
        in_folder=True,
        arity=False,
        cost=0.05,
    ),
    Entry(
        "write_case",
        lambda **named: xc.write_case(**{"path": "w.toml", "problem": scenes.growing()} | named),
        {
            "path": arg(
                Filename(rule=lambda v: None), "w.toml", near=paths(".toml", ""), words=["file"]
            ),
            "problem": arg(Of(type=xc.Problem), Late(scenes.problem)),
            "states": arg(
                Seen(rule=lambda v: v is None or (None if isinstance(v, list | tuple) else SKIP)),
                None,
                [0.0, 1.0],
                words=["states", "state"],
            ),
            "title": arg(Word(), "a"),
            "until": arg(Seen(rule=lambda v: v is None), None),
            "tolerance": arg(Number(above=0, below=1, optional=True), None, 0.1),
            **{
                name: arg(Seen(rule=lambda v: v is None or SKIP), None)
                for name in ("law", "criterion", "cycle", "da", *GROWTH)
                if name != "tolerance"
            },
        },
        in_folder=True,
        cost=0.1,
        share=0.2,
    ),
    Entry(
        "sweep",
        _swept,
        {
            "path": arg(
                Filename(known=("case.toml",)),
                "case.toml",
                near=paths(".toml", ""),
                words=["toml", "file", "scene"],
            ),
            "values": arg(
                Seen(rule=lambda v: None if isinstance(v, dict) else False),
                {"material.nu": [0.2, 0.3]},
                words=["values", "key", "list"],
            ),
            "folder": arg(Filename(rule=lambda v: None), "swept"),
            "workers": arg(Seen(rule=lambda v: True if type(v) is int and v == 1 else "skip"), 1),
            "retry": arg(Flag(), False),
        },
        in_folder=True,
        cost=3.0,
        share=0.02,
    ),
    Entry(
        "run",
        _run,
        {
            "path": arg(
                Filename(known=("case.toml",)),
                "case.toml",
                near=paths(".toml", ""),
                words=["toml", "file"],
            ),
            "resumed": arg(Flag(), False),
            "overwrite": arg(Flag(), True),
        },
        in_folder=True,
        cost=3.0,
        share=0.02,
    ),
    Entry(
        "report",
        _reported,
        {
            "result": arg(
                Seen(rule=lambda v: False if not isinstance(v, xc.Solution | xc.History) else True),
                Late(scenes.solution),
                near={"no run": Bad(lambda: "folder")},
                words=["run", "solution", "path"],
            ),
            "file": arg(
                Filename(endings=(".html",)),
                "good.html",
                near=paths(".html", ""),
                words=["report"],
            ),
            "title": arg(Word(), "a"),
            "yield_stress": arg(Number(optional=True, above=0), None, 1.0),
            "inspection": arg(Seen(rule=lambda v: v is None), None),
            "strength": arg(Seen(rule=lambda v: v is None), None),
            "spectrum": arg(Seen(rule=lambda v: v is None), None),
            "units": arg(
                Seen(
                    rule=lambda v: v is None or (v == "N, mm, MPa" if isinstance(v, str) else False)
                ),
                None,
                "N, mm, MPa",
            ),
        },
        in_folder=True,
        cost=3.0,
        share=0.02,
    ),
    Entry(
        "demo",
        xc.demo,
        {
            "folder": arg(
                Filename(folder=True),
                "good",
                near={k: v for k, v in paths("", "").items() if "other" not in k},
                words=["report"],
            ),
            "progress": arg(Flag(), False),
        },
        in_folder=True,
        cost=60.0,
        share=0.0,
    ),
    Entry(
        "info",
        lambda warm: str(xc.info(warm=warm)),
        {"warm": arg(Seen(rule=lambda v: "skip" if v is True else v is False), False)},
        cost=1.0,
        share=0.02,
    ),
]
HOOKS = []
