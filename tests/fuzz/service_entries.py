"""Load histories, fields, and loads as engineers have them."""

from functools import cache
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, Late, arg
from fuzz.kinds import (
    EDGE,
    NONSENSE,
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
)
from fuzz.values import paths

LOAD = Of(type=type(scenes.PULL[0]))

FIELD = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


@cache
def _field_text():
    import meshio

    scenes.mesh()
    mesh = meshio.Mesh(FIELD, [("triangle", [(0, 1, 2)])], point_data={"T": [1.0, 2.0, 3.0]})
    with scenes.folder() as folder:
        mesh.write(folder / "T.vtk", file_format="vtk42", binary=False)
        return (folder / "T.vtk").read_text()


def _field(path="T.vtk", name="T"):
    text = _field_text()
    for file, content in (
        ("T", text),
        ("half", text[: len(text) // 2]),
        ("empty", ""),
        ("words", "no field\n" * 9),
    ):
        Path(f"{file}.vtk").write_text(content)
    return xc.read_field(path, name)


def _spectrum(**named):
    Path("there.txt").write_text("# a history\n0 1\n1 2\n0.5 3\n0 1\n")
    Path("words.txt").write_text("0 1\na b\n")
    Path("nan.txt").write_text("0 1\nnan 1\n")
    Path("ragged.txt").write_text("0 1\n1\n")
    Path("empty.txt").write_text("")
    Path("still.txt").write_text("1 1\n1 1\n")
    return xc.read_spectrum(**named).factors


def _converted(source, target):
    xc.write_mesh("there.msh", scenes.mesh())
    return xc.convert_mesh(source, target)


def varies(x):
    """Whether a history has values that differ."""
    return bool(len(x) and x.min() < x.max())


def rows(x):
    """Whether rows are those of counted cycles."""
    return bool(len(x) and (x[:, 0] < x[:, 1]).all() and (x[:, 2] > 0).all())


FACTORS = [0.0, 1.0, 0.4, 0.6, -0.2]

OF_SPECTRUM = {
    "unit": arg(Word(rule=bool), "flight"),
    "steady": arg(ListOf(item=LOAD), (), scenes.PULL, words=["load"]),
    "least_range": arg(Number(least=0), 0.0, 0.1),
    "levels": arg(
        Seen(
            rule=lambda v: (
                (isinstance(v, str) and v == "auto")
                or (None if Whole(least=2).verdict(v) != NONSENSE else False)
            )
        ),
        "auto",
        3,
    ),
    "tolerance": arg(Number(above=0, below=1), 0.01),
}


def _force(v):
    """A force is valid, or nothing where there is a moment."""
    verdict = EDGE if v is None else Numbers((2,)).verdict(v)
    return verdict


ENTRIES = [
    Entry(
        "Spectrum",
        lambda factors, **named: xc.Spectrum(factors, **named).cycles,
        {"factors": arg(Numbers((None,), rule=varies), FACTORS, words=["spectrum"]), **OF_SPECTRUM},
    ),
    Entry(
        "Spectrum",
        lambda **named: xc.Spectrum(**named).cycles,
        {
            "rows": arg(
                Numbers((None, 3), rule=rows),
                [(0.0, 1.0, 5.0)],
                near={"fallen": lambda: [(1, 0, 1)], "none": lambda: np.zeros((0, 3))},
                words=["spectrum"],
            )
        },
    ),
    Entry(
        "Spectrum",
        lambda **named: xc.Spectrum(**named).load_states,
        {
            "states": arg(
                ListOf(item=Number(also=(ListOf(item=LOAD),)), least=2),
                [0.0, 1.0],
                Late(lambda: [0.0, scenes.PULL]),
                words=["spectrum", "sequence", "load"],
            ),
            "sequence": arg(
                Numbers((None,), whole=True, least=0, most=1, rule=varies),
                [0, 1, 0],
                words=["spectrum"],
            ),
        },
    ),
    Entry(
        "Spectrum",
        lambda range: xc.Spectrum(FACTORS).omit(range).cycles,
        {"range": arg(Number(least=0, most=1.2), 0.3)},
    ),
    Entry(
        "Spectrum",
        lambda factor: xc.Spectrum(FACTORS).scaled(factor).cycles,
        {"factor": arg(Number(above=0), 2.0)},
    ),
    Entry("rainflow", xc.rainflow, {"values": arg(Numbers((None,), rule=varies), FACTORS)}),
    Entry(
        "twist",
        lambda **named: xc.twist(**named).factors,
        {
            "mean": arg(Number(above=0), 1.0),
            "seed": arg(Whole(least=0), 73),
            "flights": arg(Whole(least=1, most=4000), 3, 5),
        },
    ),
    Entry(
        "read_spectrum",
        _spectrum,
        {
            "path": arg(
                Filename(known=("there.txt",)),
                "there.txt",
                near=paths(".txt", "")
                | {
                    name: lambda name=name: f"{name}.txt"
                    for name in ("words", "nan", "ragged", "empty", "still")
                },
                words=["spectrum", "txt", "line", "numbers"],
            ),
            "column": arg(Whole(least=0, most=1), 0, 1),
            "rows": arg(Flag(), False),
            "unit": arg(Word(rule=bool), "flight"),
        },
        in_folder=True,
    ),
    Entry(
        "bearing",
        xc.bearing,
        {
            "where": arg(Word(), "left"),
            "force": arg(
                Numbers(None, rule=lambda f: f.shape in ((2,), (3,)) and bool(f.any())),
                (0, 1),
                (0, 0, 1),
            ),
            "contact_angle": arg(Number(above=0, most=np.pi), 3.0),
        },
    ),
    Entry(
        "resultant",
        xc.resultant,
        {
            "where": arg(Word(), "left"),
            "force": arg(Numbers((2,), optional=True), (0, 1)),
            "moment": arg(
                Numbers(None, optional=True, rule=lambda m: m.shape in ((), (1,))), None, 1.0
            ),
            "about": arg(Numbers((2,), optional=True), None, (0.0, 0.0)),
        },
    ),
    Entry(
        "resultant",
        lambda force, moment, where: xc.solve(
            xc.Problem(
                scenes.mesh(),
                scenes.STEEL,
                [],
                [xc.fix("bottom")],
                [xc.resultant(where, force, moment)],
            )
        ),
        {
            "where": arg(Word(words=("top", "left", "right")), "top", words=["facet set"]),
            "force": arg(Seen(rule=_force), (0, 1)),
            "moment": arg(
                Numbers(None, optional=True, rule=lambda m: m.shape in ((), (1,))), None, 1.0
            ),
        },
        cost=0.04,
        arity=False,
    ),
    Entry(
        "temperature",
        xc.temperature,
        {
            "field": arg(Number(also=(Called(),)), 10.0, words=["value"]),
            "alpha": arg(Number(optional=True), None, 1e-5),
        },
    ),
    Entry(
        "temperature",
        lambda field, alpha: xc.solve(
            xc.Problem(
                scenes.mesh(),
                scenes.STEEL,
                [scenes.crack()],
                [xc.fix("bottom")],
                [xc.temperature(field, alpha)],
            )
        ),
        {
            "field": arg(Number(also=(Called(),)), 10.0, words=["value"]),
            "alpha": arg(Number(), 1e-5),
        },
        cost=0.04,
        arity=False,
    ),
    Entry(
        "convert_mesh",
        _converted,
        {
            "source": arg(
                Filename(known=("there.msh",)),
                "there.msh",
                near=paths(".msh", ".msh"),
                words=["mesh file", "path", "triangles"],
            ),
            "target": arg(
                Filename(endings=(".msh", ".inp", ".vtu", ".vtk"), bare=False, makes=False),
                "good.vtu",
                "good.inp",
                near=paths(".msh", ".msh"),
                words=["mesh", "path", "folder", "write"],
            ),
        },
        in_folder=True,
        cost=0.03,
    ),
    Entry(
        "read_field",
        lambda **named: _field(**named).values,
        {
            "path": arg(
                Filename(known=("T.vtk",)),
                "T.vtk",
                near=paths(".vtk", "")
                | {name: lambda name=name: f"{name}.vtk" for name in ("half", "empty", "words")},
                words=["field", ".vtk", "cells"],
            ),
            "name": arg(Word(optional=True, words=("T",)), "T", None, words=["field"]),
        },
        in_folder=True,
        cost=0.03,
    ),
    Entry(
        "read_field",
        lambda x: _field()(x),
        {
            "x": arg(
                Numbers(
                    (None, 2),
                    rule=lambda x: True if (x >= 0).all() and (x.sum(axis=1) <= 1).all() else None,
                ),
                [(0.3, 0.3)],
                words=["points"],
            )
        },
        in_folder=True,
        cost=0.03,
    ),
]
HOOKS = [
    Hook(
        "temperature",
        lambda f: xc.solve(
            xc.Problem(
                scenes.mesh(),
                scenes.STEEL,
                [scenes.crack()],
                [xc.fix("bottom")],
                [xc.temperature(f, 1e-5)],
            )
        ),
        lambda x: x[:, 0],
        Numbers(()),
        "temperature",
    ),
]
