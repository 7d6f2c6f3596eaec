"""Meshes, their refinement, and files of them."""

import math
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, Late, arg
from fuzz.kinds import (
    Called,
    Filename,
    Flag,
    ListOf,
    Number,
    Numbers,
    Of,
    Seen,
    Whole,
    Word,
    items_of,
    real,
)
from fuzz.scene_rules import SQUARE
from fuzz.values import paths

TWO = ((0, 1, 2), (0, 2, 3))


def square(x):
    """Whether four points suit the two triangles."""
    if x.shape != (4, 2):
        return False
    with np.errstate(over="ignore"):
        one, two = (np.linalg.det(x[[b, c]] - x[0]) for b, c in ((1, 2), (2, 3)))
    return bool(one * two > 0)


def upper(x):
    """Whether an upper corner of a box suits both lower ones, or one of them."""
    return bool((x > 0).all()) or (None if (x > (-1.0, -0.5)).all() else False)


def axis_sets(value):
    """Whether a value may be sets by name: of none is known more."""
    if not isinstance(value, dict):
        return False
    return (
        True if not value else value.keys() == {"a"} and {} != value and value["a"] in ([(0, 1)],)
    )


def set_names(value):
    """Whether a value is a facet set of the meshes here, or a list of such; of none is none asked.

    Containers that have no order may be meant so.
    """
    if isinstance(value, str):
        return value == "boundary"
    items = items_of(value)
    if items is None or not all(isinstance(v, str) and v == "boundary" for v in items):
        return False
    return True if items and isinstance(value, list | tuple) else None


def sets_to_fit(value):
    """The same, or yes or no."""
    return None if isinstance(value, np.bool_) else isinstance(value, bool) or set_names(value)


def _read_mesh(path, **named):
    xc.write_mesh("there.msh", scenes.mesh(), msh_version="2.2")
    text = Path("there.msh").read_text()
    for name, content in _damaged(text).items():
        Path(f"{name}.msh").write_text(content)
    return xc.read_mesh(path, **named)


def _damaged(text):
    """Texts of mesh files that cannot be read."""
    half = text[: len(text) // 2]
    return {
        "empty": "",
        "half": half,
        "words": "no mesh at all\n" * 20,
        "letters": text.replace(".5", ".x"),
        "points": text.replace("$Elements", "$Elementary"),
        "number": text.replace(" 3 2 ", " 3 -7 "),
    }


DECK = """*NODE
1, 0., 0.
2, 1., 0.
3, 0., 1.
*ELEMENT, TYPE=CPS3, ELSET=E
1, 1, 2, 3
*SOLID SECTION, ELSET=E, MATERIAL=M
1.
*MATERIAL, NAME=M
*ELASTIC
100., 0.3
*BOUNDARY
1, 1, 2
2, 2
*STEP
*STATIC
*CLOAD
3, 2, 5.
*END STEP
"""

DAMAGED_DECKS = {
    "no_deck": "no deck at all\n" * 20,
    "half_deck": DECK[:60],
    "no_node": DECK.replace("1, 2, 3", "1, 2, 9"),
    "no_set": DECK.replace("ELSET=E,", "ELSET=F,"),
    "no_number": DECK.replace("100., 0.3", "a, b"),
    "no_elastic": DECK.replace("*ELASTIC\n100., 0.3\n", ""),
    "tied": DECK + "*TIE, NAME=a\nb, c\n",
    "clash": DECK.replace("2, 2\n", "1, 1, 1, .5\n"),
    "no_force": DECK.replace("3, 2, 5.", "3, 9, 5."),
}


def _read_deck(path, **named):
    for name, text in {"there": DECK, **DAMAGED_DECKS}.items():
        Path(f"{name}.inp").write_text(text)
    deck = xc.read_deck(path, **named)
    return deck.problem() if deck.material is not None else deck


def step_of_deck(value):
    """Whether a value is the one step of the deck."""
    if isinstance(value, str):
        return value.casefold() == "step-1"
    number = real(value)
    if number is not None and not isinstance(value, int):
        return None if number == 1 else False
    return value is ... or number == 1


DAMAGED = {name: lambda name=name: f"{name}.msh" for name in _damaged("")}


def _read_surface(path):
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
    lines = "\n".join("vertex {} {} {}".format(*x) for x in corners)
    Path("there.stl").write_text(
        f"solid a\nfacet normal 0 0 1\nouter loop\n{lines}\nendloop\nendfacet\nendsolid a\n"
    )
    return xc.read_surface(path)


ENTRIES = [
    Entry(
        "Mesh",
        xc.Mesh,
        {
            "points": arg(
                Numbers((None, 2), rule=square),
                SQUARE,
                near={
                    "1e200": lambda: 1e200 * np.array(SQUARE),
                    "ints": lambda: [[0, 0], [1, 0], [1, 1], [0, 1]],
                    "same": lambda: [[0.5, 0.5]] * 4,
                    "flat": lambda: [[k, 2.0 * k] for k in range(4)],
                    "3D": lambda: np.ones((4, 3)),
                    "one more": lambda: [*SQUARE, (2.0, 2.0)],
                },
            ),
            "cells": arg(
                Numbers(
                    (None, 3),
                    whole=True,
                    least=0,
                    most=3,
                    rule=lambda c: (
                        c.tolist() in ([list(row) for row in TWO], [[2, 1, 0], [0, 2, 3]])
                    ),
                ),
                TWO,
                [[2, 1, 0], [0, 2, 3]],
                near={
                    "twice": lambda: [(0, 1, 2), (0, 1, 2), (0, 2, 3)],
                    "floats": lambda: np.array(TWO) + 0.5,
                    "overlapping": lambda: [(0, 1, 2), (0, 1, 3)],
                    "empty": lambda: np.zeros((0, 3), int),
                },
            ),
            "facet_sets": arg(
                Seen(rule=axis_sets),
                {},
                {"a": [(0, 1)]},
                words=["facet set", "sets"],
                near={
                    "diagonal": lambda: {"a": [(1, 3)]},
                    "no name": lambda: {1: [(0, 1)]},
                    "list": lambda: [("a", [(0, 1)])],
                    "boundary": lambda: {"boundary": [(0, 1)]},
                },
            ),
            "cell_sets": arg(
                Seen(rule=lambda v: isinstance(v, dict) and not v),
                {},
                words=["cell set", "sets"],
                near={
                    "beyond": lambda: {"a": [2]},
                    "texts": lambda: {"a": ["b"]},
                    "none": lambda: {"a": None},
                },
            ),
            "curves": arg(
                Seen(rule=lambda v: isinstance(v, dict) and not v),
                {},
                near={"unknown": lambda: {"b": np.copy}, "no function": lambda: {"boundary": 1.0}},
            ),
        },
    ),
    Entry(
        "Mesh",
        lambda facets: scenes.mesh().facet_numbers(facets),
        {
            "facets": arg(
                Numbers(
                    (None, 2),
                    whole=True,
                    rule=lambda f: True if ((f >= 0) & (f < 49)).all() else None,
                ),
                [[0, 1]],
                np.zeros((0, 2), int),
            )
        },
    ),
    Entry(
        "box",
        xc.box,
        {
            "lower": arg(
                Numbers(
                    (2,), rule=lambda x: bool(x[0] < 1 and x[1] < 2) and (bool(x[1] < 1.5) or None)
                ),
                (0, 0),
                [-1.0, -0.5],
                words=["upper"],
            ),
            "upper": arg(Numbers((2,), rule=upper), (1, 2), [1.0, 1.5]),
            "n": arg(Whole(least=1, also=(Numbers((2,), whole=True, least=1),)), 3, (2, 3)),
        },
    ),
    Entry(
        "part",
        lambda mesh: (
            xc.part(mesh, "boundary", ((None,) * mesh.dim,) * 2, "new")
            if isinstance(mesh, xc.Mesh)
            else xc.part(mesh, "boundary", ((0, 0), (1, 1)))
        ),
        {"mesh": arg(Of(type=xc.Mesh), Late(scenes.mesh), Late(lambda: scenes.mesh(3)))},
    ),
    Entry("refine", xc.refine, {"mesh": arg(Of(type=xc.Mesh), Late(scenes.mesh))}),
    Entry(
        "fit_curves",
        xc.fit_curves,
        {
            "mesh": arg(Of(type=xc.Mesh), Late(scenes.mesh), Late(lambda: scenes.mesh(3))),
            "sets": arg(
                Seen(rule=lambda v: v is ... or set_names(v)), None, "boundary", ["boundary"]
            ),
            "angle": arg(Number(above=0, below=90), 50.0, 30),
        },
        cost=0.02,
    ),
    Entry(
        "refine",
        lambda cells: xc.refine(scenes.mesh(), cells),
        {
            "cells": arg(
                Numbers((None,), optional=True, whole=True, least=0, most=71),
                [0, 5],
                np.zeros(0, int),
            )
        },
        cost=0.03,
    ),
    Entry(
        "refine",
        lambda size: xc.refine(scenes.mesh(), size=size),
        {
            "size": arg(
                Number(optional=True, above=0, rule=lambda v: v >= 0.1 or None, also=(Called(),)),
                0.3,
            )
        },
        cost=0.05,
    ),
    Entry(
        "read_mesh",
        _read_mesh,
        {
            "path": arg(
                Filename(known=("there.msh",)),
                "there.msh",
                near=paths(".msh", ".msh") | DAMAGED,
                words=["mesh file", "triangles", "cell"],
            ),
            "strict": arg(Flag(), False, True),
            "fit_curves": arg(Seen(rule=sets_to_fit), True, ["boundary"]),
        },
        in_folder=True,
    ),
    Entry(
        "read_deck",
        _read_deck,
        {
            "path": arg(
                Filename(known=("there.inp",)),
                "there.inp",
                near=paths(".inp", ".inp")
                | {name: lambda name=name: f"{name}.inp" for name in DAMAGED_DECKS},
                words=["deck", "line"],
            ),
            "step": arg(Seen(rule=step_of_deck), None, 1, "Step-1", words=["step"]),
            "time": arg(Number(optional=True, least=0), None, 0.5),
            "ignore": arg(ListOf(item=Word()), (), ["TIE"], words=["ignore"]),
            "fit_curves": arg(Seen(rule=sets_to_fit), True, ["boundary"]),
        },
        in_folder=True,
    ),
    Entry(
        "read_surface",
        _read_surface,
        {
            "path": arg(
                Filename(known=("there.stl",)),
                "there.stl",
                near=paths(".stl", ""),
                words=["surface"],
            )
        },
        in_folder=True,
    ),
    Entry(
        "write_mesh",
        xc.write_mesh,
        {
            "path": arg(
                Filename(endings=(".msh", ".inp", ".vtu", ".vtk"), bare=False, makes=False),
                "good.msh",
                "good.vtu",
                "good.inp",
                near=paths(".msh", ".msh"),
                words=["mesh file", "mesh cannot", "folder", "cannot write"],
            ),
            "mesh": arg(Of(type=xc.Mesh), Late(scenes.mesh), Late(lambda: scenes.mesh(3))),
            "msh_version": arg(Word(words=("4.1", "2.2")), "4.1", "2.2", words=["version"]),
        },
        in_folder=True,
    ),
]
HOOKS = [
    Hook(
        "refine",
        lambda f: xc.refine(scenes.mesh(), size=f),
        lambda x: 0.3 + 0 * x[:, 0],
        Number(
            above=0,
            rule=lambda v: v >= 0.1 or None,
            also=(Seen(rule=lambda v: None if real(v) == math.inf else False),),
        ),
        "size of refine",
    ),
]
