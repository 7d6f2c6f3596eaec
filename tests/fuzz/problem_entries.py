"""Materials, choices of method, problems."""

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Bad, Entry, Hook, Late, arg
from fuzz.kinds import (
    Called,
    Choice,
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
from fuzz.scene_rules import POSITIVE
from xcrack.model.numerics import ContactMethod, LevelSets, TipBasis
from xcrack.verification import methods

HANDBOOK = type(xc.handbook("edge", a=1, W=2)).__bases__

SUPPORTS = type(xc.fix("left")) | type(xc.displacement("left", (0, 0)))


def _problem(**changes):
    cracks = [scenes.crack()]
    given = {"mesh": scenes.mesh(), "material": scenes.STEEL, "cracks": cracks, **changes}
    return xc.Problem(**given)


def _of_dim(kind, dim=2):
    return Seen(rule=lambda value: isinstance(value, kind) and value.dim == dim)


GLUE = xc.Isotropic(0.1, 0.3, plane="strain")
HALVES = {
    "left": lambda x: x[:, 0] < x[:, 0].mean(),
    "right": lambda x: x[:, 0] >= x[:, 0].mean(),
    "whole": lambda x: x[:, 0] > -np.inf,
}


def _by_set(value):
    """Whether a mapping names materials; of pairs that make one nothing is known."""
    if not isinstance(value, dict | tuple) or not value:
        return False
    if isinstance(value, tuple):
        return None
    return all(isinstance(k, str) and isinstance(v, xc.Isotropic) for k, v in value.items())


_COEFFICIENT = Number(least=0, most=1e3)
_each_crack = ListOf(item=_COEFFICIENT, rule=lambda values: len(values) == 1)


ENTRIES = [
    Entry(
        "Isotropic.with_yield_stress",
        lambda yield_stress: scenes.STEEL.with_yield_stress(yield_stress).yield_stress,
        {"yield_stress": arg(Number(above=0, optional=True), 350.0)},
    ),
    Entry(
        "Isotropic",
        xc.Isotropic,
        {
            "E": arg(POSITIVE, 1.0, 210e3, words=["Young's modulus"]),
            "nu": arg(Number(above=-1, below=0.5), 0.3, 0, words=["Poisson"]),
            "plane": arg(Word(optional=True, words=("strain", "stress")), None, "strain", "stress"),
            "yield_stress": arg(Number(optional=True, above=0), None, 350.0),
            "K_c": arg(Number(optional=True, above=0), None, 3000.0),
            "alpha": arg(Number(optional=True), None, 1.2e-5),
        },
    ),
    Entry(
        "Graded",
        xc.Graded,
        {
            "E": arg(Called(), Late(lambda: lambda x: 1 + 0 * x[:, 0]), words=["function"]),
            "nu": arg(Number(above=-1, below=0.5), 0.3, 0, words=["Poisson", "nu"]),
            "plane": arg(Word(optional=True, words=("strain", "stress")), None, "strain"),
            "yield_stress": arg(Number(optional=True, above=0), None, 350.0),
            "K_c": arg(Number(optional=True, above=0), None, 3000.0),
            "alpha": arg(Number(optional=True, also=(Called(),)), None, 1.2e-5),
        },
    ),
    Entry(
        "MaterialSets",
        lambda materials: xc.MaterialSets(materials),
        {
            "materials": arg(
                Seen(rule=_by_set), Late(lambda: {"weld": scenes.STEEL}), words=["material"]
            )
        },
    ),
    Entry(
        "MaterialSets",
        lambda materials: xc.Problem(scenes.mesh().with_cell_sets(HALVES), materials),
        {
            "materials": arg(
                Seen(
                    rule=lambda v: (
                        isinstance(v, xc.Isotropic)  # of the whole body
                        or (_by_set(v) is True and set(v) == {"left", "right"})
                    )
                ),
                Late(lambda: {"left": scenes.STEEL, "right": GLUE}),
                words=["material"],
                near={
                    "missing": Bad(lambda: {"left": scenes.STEEL}),
                    "unknown": Bad(lambda: {"left": scenes.STEEL, "rigth": GLUE}),
                    "plane": Bad(
                        lambda: {"left": scenes.STEEL, "right": xc.Isotropic(1.0, 0.3, "stress")}
                    ),
                    "twice": Bad(
                        lambda: {"left": scenes.STEEL, "right": GLUE, "whole": scenes.STEEL}
                    ),
                },
            )
        },
        cost=0.03,
    ),
    Entry(
        "Isotropic",
        lambda gradient: scenes.STEEL.stress(gradient),
        {
            "gradient": arg(
                Numbers(None, rule=lambda g: g.ndim > 1 and g.shape[-2:] in ((2, 2), (3, 3))),
                np.eye(2),
                np.ones((4, 3, 3)),
            )
        },
    ),
    Entry(
        "Isotropic",
        lambda stress: scenes.BODY.strain(stress),
        {
            "stress": arg(
                Numbers(None, rule=lambda g: g.ndim > 1 and g.shape[-2:] in ((2, 2), (3, 3))),
                np.eye(2),
                np.ones((4, 3, 3)),
            )
        },
    ),
    Entry(
        "Numerics",
        xc.Numerics,
        {
            "enrichment": arg(Word(words=("geometric", "topological")), "geometric"),
            "radius": arg(Number(optional=True, above=0), None, 0.3),
            "functions": arg(Choice(values=(4, 2)), 4, 2),
            "multipliers": arg(Word(words=("reduced", "sparse", "naive")), "naive"),
            "consistent": arg(Flag(), True, False),
            "orthonormal": arg(Word(words=("star", "node", "none")), "star"),
            "patch": arg(Flag(), False),
            "points": arg(Whole(least=2, most=32), 4),
            "domain": arg(Number(optional=True, above=0), None, 0.5),
            "depth": arg(Number(optional=True, above=0), None, 0.1),
            "linear": arg(Word(words=("auto", "direct", "iterative")), "auto"),
            "initial_set": arg(Word(words=("closed", "open")), "open"),
            "substeps": arg(Whole(least=1, most=10_000), 10, 1),
            "threads": arg(Whole(optional=True, least=1), None, 1),
            "contact_method": arg(
                Of(type=ContactMethod, optional=True), methods.penalty(3.0), None
            ),
            "tip_basis": arg(Of(type=TipBasis, optional=True), None),
            "level_sets": arg(Of(type=LevelSets, optional=True), methods.nodal_level_sets(), None),
        },
    ),
    Entry(
        "Problem",
        _problem,
        {
            "mesh": arg(
                _of_dim(xc.Mesh), Late(scenes.mesh), words=["body", "dimensions", "2D", "3D"]
            ),
            "material": arg(Seen(rule=lambda v: v is scenes.STEEL), scenes.STEEL),
            "cracks": arg(
                ListOf(item=_of_dim(xc.Crack)),
                Late(lambda: [scenes.crack()]),
                (),
                words=["crack"],
                near={
                    "twice": Bad(lambda: [scenes.crack(), scenes.crack()]),
                    "outside": Bad(lambda: [xc.line_crack([(5, 5), (6, 6)])]),
                    "3D": lambda: [scenes.crack(3)],
                },
            ),
            "handbook": arg(
                ListOf(
                    item=Seen(rule=lambda v: None if isinstance(v, HANDBOOK) else False),
                    also=(Seen(rule=lambda v: None if isinstance(v, HANDBOOK) else False),),
                ),
                (),
                words=["handbook"],
                near={"another crack": lambda: xc.handbook("edge", a=1, W=2, S=1, crack=9)},
            ),
            "supports": arg(
                ListOf(item=Seen(rule=lambda v: isinstance(v, SUPPORTS))),
                [xc.fix("left")],
                (),
                words=["facet set", "fix"],
                near={
                    "unknown": Bad(lambda: [xc.fix("no such set")]),
                    "3D point": Bad(lambda: [xc.fix((0, 0, 0))]),
                    "axis": Bad(lambda: [xc.fix("left", 2)]),
                    "forces": lambda: scenes.PULL,
                },
            ),
            "loads": arg(
                ListOf(item=Of(type=type(scenes.PULL[0]))),
                scenes.PULL,
                [],
                words=["facet set", "load", "traction", "crack_pressure"],
                near={
                    "unknown": Bad(lambda: [xc.traction("no such set", (0, 1))]),
                    "3D": Bad(lambda: [xc.traction("top", (0, 0, 1))]),
                    "crack": Bad(lambda: [xc.crack_pressure(1.0, 7)]),
                    "support": Bad(lambda: [xc.fix("left")]),
                    "moved": Bad(lambda: [xc.displacement("top", (0, 1))]),
                },
            ),
            "contact": arg(Word(words=("auto", "on", "off")), "auto", "on"),
            "order": arg(Choice(optional=True, values=(1, 2)), None, 1, 2),
            "numerics": arg(Of(type=xc.Numerics), xc.Numerics()),
            "friction": arg(Number(least=0, most=1e3, also=(_each_crack,)), 0.0, 0.3),
        },
        cost=0.03,
    ),
    Entry(
        "Problem",
        lambda file, title: scenes.problem().plot(file, title=title),
        {
            "file": arg(Filename(rule=lambda v: None), "setup.png"),
            "title": arg(Word(optional=True), None, "a plate"),
        },
        in_folder=True,
        cost=0.5,
    ),
    Entry(
        "Problem",
        lambda state: scenes.problem().state(state),
        {
            "state": arg(
                Number(optional=True, also=(ListOf(item=Of(type=type(scenes.PULL[0]))),)),
                None,
                1.0,
                scenes.PULL,
                words=["load"],
            )
        },
    ),
]
HOOKS = [
    Hook(
        "Graded",
        lambda f: xc.Problem(scenes.mesh(), xc.Graded(f, 0.3, "strain")),
        lambda x: 1 + x[:, 0] ** 2,
        Numbers((), rule=lambda s: bool((s > 0).all())),
        "Graded: E",
    )
]
