"""Files of results, and pictures."""

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Late, arg
from fuzz.file_rules import PICTURE, WINDOW
from fuzz.kinds import (
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

TITLE = arg(Word(optional=True), None, "a title")

SOLVED = Seen(rule=lambda v: isinstance(v, xc.Solution))

FIELDS = (
    "von_mises",
    "sxx",
    "syy",
    "sxy",
    "displacement",
    "ux",
    "uy",
    "pressure",
    "opening",
    "mesh",
)


def limits(value):
    """Whether a value is a pair that grows."""
    x = array(value)
    return value is None or (
        x is not None and x.shape == (2,) and bool(np.isfinite(x).all()) and bool(x[0] < x[1])
    )


def names(n):
    """Kind of labels for n things."""
    one = (Word(),) if n == 1 else ()
    return ListOf(optional=True, item=Word(), least=n, most=n, also=one)


def modes(value):
    """Whether a value names modes."""
    if isinstance(value, str):
        return value in ("I", "II", "III")
    return (
        None
        if isinstance(value, dict | set)
        else isinstance(value, list | tuple)
        and len(value) > 0
        and all(isinstance(v, str) and v in ("I", "II", "III") for v in value)
    )


def _three_d(value):
    if isinstance(value, xc.History):
        return bool(value.steps) and value.steps[0].cracks[0].dim == 3
    return None if isinstance(value, list | tuple) else False


def _body_of_history(value):
    """None is the mesh of the run; another mesh may fit its cracks or not."""
    if value is None:
        return True
    return None if isinstance(value, xc.Mesh) else False


ENTRIES = [
    Entry(
        "save",
        xc.save,
        {
            "result": arg(
                Seen(
                    rule=lambda v: (
                        isinstance(v, xc.Solution | xc.History)
                        or (None if isinstance(v, list | tuple) and len(v) else False)
                    )
                ),
                Late(scenes.solution),
                Late(lambda: scenes.history()),
                words=["solution"],
            ),
            "path": arg(
                Filename(),
                "good.npz",
                near={
                    k: v
                    for k, v in paths(".npz", "").items()
                    if "other" not in k and "full" not in k
                },
                words=["result"],
            ),
        },
        in_folder=True,
        cost=0.05,
    ),
    Entry(
        "write",
        xc.write,
        {
            "solution": arg(Of(type=xc.Solution), Late(scenes.solution), words=["Solution"]),
            "path": arg(
                Filename(rule=None, endings=()),
                "good",
                "good.vtu",
                near=paths(".vtu", ".vtu"),
                words=["solution cannot"],
            ),
            "sif": arg(
                ListOf(
                    optional=True, item=Of(type=xc.SIF), least=1, most=1, also=(Of(type=xc.SIF),)
                ),
                None,
                Late(scenes.sif),
            ),
        },
        in_folder=True,
        cost=0.05,
    ),
    Entry(
        "write",
        lambda **named: xc.write(scenes.solution(3), **named),
        {
            "path": arg(Filename(), "good"),
            "sif": arg(
                Seen(rule=lambda v: v is None or v is scenes.sif(3)),
                None,
                Late(lambda: scenes.sif(3)),
                words=["K"],
            ),
        },
        in_folder=True,
        cost=0.3,
    ),
    Entry(
        "History",
        lambda path: scenes.history().write(path),
        {"path": arg(Filename(folder=True), "good", near=paths("", ""), words=["history"])},
        in_folder=True,
        cost=0.2,
    ),
    Entry(
        "History",
        lambda mesh: len(scenes.history().measures(mesh)),
        {"mesh": arg(Seen(rule=_body_of_history), None, Late(scenes.mesh), words=["crack"])},
        cost=0.2,
    ),
    Entry(
        "History",
        lambda kind, file: scenes.history().plot(kind, file),
        {
            "kind": arg(Word(words=("K", "a", "path", "measures")), "K", "a", "path"),
            "file": arg(
                Filename(optional=True, endings=(".png", ".pdf", ".svg", ".jpg")),
                "good.png",
                near=paths(".png", ".png"),
                words=["picture"],
            ),
        },
        in_folder=True,
        cost=0.4,
    ),
    Entry(
        "plot",
        xc.plot,
        {
            "solution": arg(SOLVED, Late(scenes.solution), words=["Solution", "Problem"]),
            "field": arg(Word(words=FIELDS), "von_mises", "opening", "mesh", "ux"),
            "file": PICTURE,
            "warp": arg(Number(far=1e3), 0.0, 10.0),
            "show": WINDOW,
            "renderer": arg(Word(words=("auto", "pyvista", "matplotlib")), "matplotlib"),
            "title": TITLE,
            "edges": arg(Flag(), False, True),
            "limits": arg(Seen(rule=limits), None, (0.0, 1.0)),
            "cmap": arg(Word(optional=True, words=("RdBu", "viridis")), None, "RdBu"),
            "crack": arg(Whole(optional=True, least=0, most=0), None, 0),
            "zoom": arg(
                Number(optional=True, above=0, rule=lambda v: 1 <= v <= 10 or None), None, 2.0
            ),
            "clip": arg(Seen(rule=lambda v: v is None), None),
            "view": arg(Seen(rule=lambda v: v is None), None),
            "loads": arg(Flag(rule=None), False),
        },
        in_folder=True,
        cost=0.6,
    ),
    Entry(
        "plot",
        lambda **named: xc.plot(
            scenes.solution(3), "opening", file="a.png", show=False, renderer="matplotlib", **named
        ),
        {
            "clip": arg(
                Seen(rule=lambda v: True if v is None else False),
                None,
                near={
                    "pair": lambda: ((0, 0, 0), (0, 0, 0)),
                    "nan": lambda: ((0, 0, np.nan), (0, 0, 1)),
                    "2D": lambda: ((0, 0), (0, 1)),
                    "texts": lambda: ("a", "b"),
                    "alone": lambda: ((0, 0, 0),),
                },
            ),
            "view": arg(
                Seen(
                    rule=lambda v: (
                        v is None
                        or (
                            (x := array(v)) is not None
                            and x.shape == (3,)
                            and bool(np.isfinite(x).all())
                            and bool(x.any())
                        )
                    )
                ),
                None,
            ),
            "limits": arg(Seen(rule=limits), None),
            "title": TITLE,
            "crack": arg(Whole(optional=True, least=0, most=0), None),
        },
        in_folder=True,
        cost=0.8,
    ),
    Entry(
        "draw_fronts",
        xc.draw_fronts,
        {
            "history": arg(
                Seen(rule=_three_d), Late(lambda: scenes.history(3)), words=["steps", "crack"]
            ),
            "crack": arg(Whole(least=0, most=0), 0),
            "plane": arg(
                Seen(rule=lambda v: v is None),
                None,
                ((0, 0, 0), ((1, 0, 0), (0, 1, 0))),
                near={
                    "parallel": lambda: ((0, 0, 0), ((1, 0, 0), (2, 0, 0))),
                    "nan": lambda: ((0, 0, np.nan), ((1, 0, 0), (0, 1, 0))),
                    "2D": lambda: ((0, 0), ((1, 0), (0, 1))),
                    "point": lambda: (0, 0, 0),
                },
            ),
            "labels": arg(names(1), None, ["a"]),
            "every": arg(Whole(least=1), 1),
            "mesh": arg(Of(optional=True, type=xc.Mesh, rule=lambda v: v.dim == 3), None),
            "file": PICTURE,
            "show": WINDOW,
            "title": TITLE,
        },
        in_folder=True,
        cost=0.5,
    ),
    Entry(
        "draw_K",
        xc.draw_K,
        {
            "sif": arg(
                Seen(rule=lambda v: isinstance(v, xc.SIF) and v.K.shape[1] == 3),
                Late(lambda: scenes.sif(3)),
                words=["K"],
            ),
            "front": arg(Whole(least=0, most=0), 0),
            "labels": arg(names(1), None, ["a"]),
            "modes": arg(Seen(rule=modes), ("I",), ("I", "II", "III")),
            "file": PICTURE,
            "show": WINDOW,
            "title": TITLE,
        },
        in_folder=True,
        cost=0.5,
    ),
]
HOOKS = []
