"""Solutions, factors and criteria."""

import numpy as np
import scipy.sparse as sp

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, Late, arg
from fuzz.kinds import (
    SKIP,
    Called,
    Flag,
    ListOf,
    Number,
    Numbers,
    Of,
    Seen,
    Whole,
    Word,
    array,
    items_of,
    real,
)
from fuzz.result_rules import LOAD, NOTHING, NU, K, fits

SIDE = Seen(rule=lambda v: real(v) in (0, 1, -1) and (type(v) is int or None))

STATES = ListOf(
    optional=True, item=Number(also=(ListOf(item=LOAD), Seen(rule=lambda v: v is None))), least=1
)


def points(x):
    """Whether numbers are points of the square, one or several."""
    if x.ndim not in (1, 2) or x.shape[-1] != 2:
        return False
    return bool((np.abs(x) <= 1).all())


def columns(x):
    """Whether an array has columns of K."""
    return x.ndim > 0 and x.shape[-1] in (2, 3)


def cracked(value):
    """Whether a value is a problem with a crack in 2D."""
    return isinstance(value, xc.Problem) and (None if value.mesh.dim == 3 else bool(value.cracks))


CRACKED = arg(Seen(rule=cracked), Late(scenes.problem), words=["crack"])

SOLVED = arg(
    Of(type=xc.Solution),
    Late(scenes.solution),
    Late(lambda: scenes.solution(2, False)),
    words=["Solution"],
)

WITH_CRACK = arg(Of(type=xc.Solution), Late(scenes.solution), words=["Solution"])

X = arg(
    Numbers(None, rule=points),
    (0.3, 0.3),
    Late(scenes.inside),
    np.zeros((0, 2)),
    words=["outside the body", "lies"],
)

CRACK = arg(Whole(least=0, most=0), 0)

RANGE = arg(Word(words=("difference", "component")), "difference", "component")

SIF = (
    {
        "x": arg(Numbers((1, 2)), [(0.0, 0.0)], words=["frame"]),
        "frame": arg(Numbers((1, 2, 2)), np.eye(2)[None]),
        "K": arg(Numbers((1, 2)), [(1.0, 0.0)]),
    }
    | {name: arg(Numbers((1,)), [1.0]) for name in ("T", "s", "domain_cells")}
    | {
        "spread": arg(Numbers((1, 2)), [(0.0, 0.0)]),
        "front": arg(Numbers((1,), whole=True, least=0), [0]),
        "at_surface": arg(
            Seen(
                rule=lambda v: (
                    None if v is ... else np.shape(v) == (1,) and np.asarray(v).dtype == bool
                )
            ),
            np.array([False]),
        ),
        "closed": arg(
            Seen(rule=lambda v: np.shape(v) == (1,) and np.asarray(v).dtype == bool),
            np.array([True]),
        ),
    }
)


def _flags(value):
    """Whether a value is one flag of a place."""
    if isinstance(value, np.ma.MaskedArray) or not isinstance(value, list | tuple | np.ndarray):
        return False
    items = items_of(value)
    return items is not None and len(items) == 1 and isinstance(items[0], bool | np.bool_)


for _name in ("at_surface", "closed"):
    SIF[_name] = arg(Seen(rule=_flags), np.array([False]))

for _name in ("T", "domain_cells"):
    SIF[_name] = arg(Seen(rule=lambda v: (x := array(v)) is not None and x.shape == (1,)), [1.0])

_WIDENED = Seen(rule=lambda v: v is None or ((x := array(v)) is not None and x.shape == (1, 2)))
_OF_DOMAINS = Seen(
    rule=lambda v: v is None or ((x := array(v)) is not None and x.shape == (1, 2, 2))
)
_CONSTANT = Seen(rule=lambda v: v is None or ((x := array(v)) is not None and x.shape == (1,)))
OF_FRONTS = {
    "errors": arg(Seen(rule=lambda v: v is None), None),
    "ends": arg(Seen(rule=lambda v: isinstance(v, tuple) and not v), ()),
    "widened": arg(_WIDENED, None, [(0.0, 0.0)]),
    "smooth_K": arg(_OF_DOMAINS, None, [[(0.0, 0.0), (0.0, 0.0)]]),
    "E_prime": arg(_CONSTANT, None, [1.0]),
    "nu": arg(_CONSTANT, None, [0.3]),
}


def _solved_by(function):
    return xc.solve(scenes.problem(), solver=function)


def _superlu(A):
    from scipy.sparse.linalg import splu

    return splu(A.tocsc()).solve


ENTRIES = [
    Entry(
        "crack_opening",
        lambda solution, crack: xc.crack_opening(solution, crack=crack),
        {"solution": WITH_CRACK, "crack": arg(Whole(least=0, most=0), 0)},
        cost=0.05,
    ),
    Entry(
        "crack_opening",
        lambda x: xc.crack_opening(scenes.solution(), x),
        {"x": arg(Seen(rule=lambda v: None), None)},
        cost=0.05,
    ),
    Entry(
        "compliance",
        xc.compliance,
        {"solution": SOLVED, "force": arg(Number(rule=lambda v: v != 0), 1.0, -2.5)},
        cost=0.05,
    ),
    Entry(
        "solve",
        xc.solve,
        {
            "problem": arg(Of(type=xc.Problem), Late(scenes.problem)),
            "states": arg(STATES, None, [1.0], [0.0, 0.5, scenes.PULL], words=["load"]),
            "solver": arg(Called(optional=True), None),
            "error": arg(Flag(), False, True),
        },
        cost=0.06,
    ),
    Entry(
        "Solution",
        lambda x, side: scenes.solution().displacement(x, side),
        {"x": X, "side": arg(SIDE, 0, 1, -1)},
    ),
    Entry(
        "Solution",
        lambda x, side: scenes.solution().stress(x, side),
        {"x": X, "side": arg(SIDE, 0, 1, -1)},
    ),
    Entry(
        "Solution",
        lambda x: scenes.solution().inside(x),
        {
            "x": arg(
                Numbers(None, rule=lambda x: x.ndim in (1, 2) and x.shape[-1] == 2),
                (0, 0),
                Late(scenes.inside),
            )
        },
    ),
    Entry(
        "Solution",
        lambda x: scenes.solution().initial_stress(x),
        {"x": arg(Numbers((None, 2)), [(0.0, 0.0)])},
    ),
    *(
        Entry(
            "Solution",
            lambda method=method, **named: getattr(scenes.solution(), method)(**named),
            {
                "cell": arg(
                    Numbers((2,), whole=True, least=0, most=71),
                    np.array([3, 7]),
                    words=["bary", "side"],
                ),
                "bary": arg(
                    Numbers((2, 3), rule=lambda b: True if np.allclose(b.sum(axis=1), 1) else None),
                    np.full((2, 3), 1 / 3),
                ),
                "side": arg(
                    Numbers(
                        (2, 1),
                        rule=lambda s: bool((np.abs(s) < 2).all()) and (bool(s.all()) or None),
                    ),
                    [[1], [-1]],
                ),
            },
        )
        for method in ("at", "stress_at")
    ),
    Entry("Solution", lambda crack: scenes.solution().opening(crack), {"crack": CRACK}),
    Entry("Solution", lambda crack: scenes.solution().jump(crack), {"crack": CRACK}),
    Entry(
        "plan",
        lambda problem: str(xc.plan(problem)),
        {"problem": arg(Of(type=xc.Problem), Late(scenes.problem))},
    ),
    Entry(
        "plan",
        lambda name: xc.plan(scenes.problem())[name],
        {"name": arg(Word(words=("tip functions", "supports")), "supports", words=["ingredient"])},
    ),
    Entry(
        "stress_intensity",
        xc.stress_intensity,
        {"solution": WITH_CRACK, "crack": CRACK, "error": arg(Flag(optional=True), None, False)},
        cost=0.03,
    ),
    Entry(
        "interface_intensity",
        xc.interface_intensity,
        {
            "solution": arg(Of(type=xc.Solution), Late(scenes.split), words=["Solution"]),
            "length": arg(Number(above=0), 2.0),
            "crack": CRACK,
        },
        cost=0.03,
    ),
    Entry(
        "handbook",
        lambda kind, values: (
            xc.handbook(kind, **values)
            if isinstance(values, dict)
            else xc.handbook(kind, a=values, W=10.0)
        ),
        {
            "kind": arg(Word(words=("edge",)), "edge", words=["handbook", "kind"]),
            "values": arg(
                Number(above=0, rule=lambda v: v < 10 or None),
                2.0,
                words=["handbook", "EdgeCrack"],
                near={
                    "missing": lambda: {"a": 1.0},
                    "unknown": lambda: {"a": 1.0, "W": 3.0, "q": 1.0},
                },
            ),
        },
        arity=False,
    ),
    Entry(
        "handbook",
        lambda phi: xc.handbook("surface", a=1, c=1, t=3, W=9, S=1).K(phi),
        {"phi": arg(Numbers(None, least=0, most=np.pi / 2), 0.3, words=["handbook", "phi"])},
        arity=False,
    ),
    *(
        Entry(
            "handbook",
            lambda sif, method=method: getattr(xc.handbook("edge", a=1, W=9, S=1), method)(sif),
            {
                "sif": arg(
                    Of(type=xc.SIF),
                    Late(lambda: xc.stress_intensity(scenes.solution())),
                    words=["handbook", "SIF"],
                )
            },
            arity=False,
        )
        for method in ("at", "ratio")
    ),
    Entry(
        "stress_intensities",
        xc.stress_intensities,
        {
            "solutions": arg(
                ListOf(item=Of(type=xc.Solution), least=1),
                Late(scenes.states),
                Late(lambda: [scenes.solution()]),
            ),
            "crack": CRACK,
            "error": arg(Flag(optional=True), None, True),
        },
        cost=0.04,
    ),
    Entry("SIF", xc.SIF, SIF | OF_FRONTS),
    Entry(
        "measures",
        xc.measures,
        {
            "crack": arg(Seen(rule=lambda v: v is scenes.crack()), Late(scenes.crack)),
            "mesh": arg(Seen(rule=lambda v: v is scenes.mesh()), Late(scenes.mesh), words=["body"]),
        },
    ),
    Entry(
        "energy_error",
        xc.energy_error,
        {"solution": SOLVED, "stress": arg(Called(), lambda x: np.ones((len(x), 2, 2)))},
        cost=0.03,
    ),
    Entry(
        "adapt",
        lambda **named: xc.adapt(tolerance=0.5, max_unknowns=3000, **named).rounds[-1].error,
        {
            "problem": arg(
                Seen(
                    rule=lambda v: (
                        (SKIP if isinstance(v, xc.Problem) else False)
                        if v is not scenes.problem()
                        else None
                    )
                ),
                Late(scenes.problem),
            ),
            "states": arg(
                Seen(rule=lambda v: SKIP if items_of(v) is not None else v is None), None
            ),
            "progress": arg(Flag(rule=None), False),
        },
        cost=0.5,
        share=0.0,
        arity=False,
    ),
    Entry(
        "adapt",
        lambda tolerance, max_unknowns: (
            xc.adapt(scenes.problem(), tolerance, max_unknowns=max_unknowns, progress=False)
            .rounds[-1]
            .error
        ),
        {
            "tolerance": arg(Number(above=0, below=1, rule=lambda v: v >= 1e-2 or None), 0.1),
            "max_unknowns": arg(
                Whole(
                    least=1, most=10**7, far=1e9, optional=True, rule=lambda v: v >= 5000 or None
                ),
                None,
                20_000,
            ),
        },
        cost=0.3,
    ),
    Entry(
        "inf_sup",
        xc.inf_sup,
        {
            "problem": CRACKED,
            "crack": CRACK,
            "norm": arg(Word(words=("h1", "energy")), "h1", "energy"),
        },
        cost=0.05,
    ),
    Entry(
        "equivalent_K",
        xc.equivalent_K,
        {
            "K": arg(Numbers(None, rule=columns), (1.0, 0.5), [[1.0, 0.5, 0.2]]),
            "angle": arg(Numbers(None, least=-np.pi, most=np.pi, rule=fits((1,))), 0.1),
            "nu": arg(NU, 0.3),
        },
    ),
    *(
        Entry(
            name,
            getattr(xc, name),
            {"K": K, "nu": arg(NU, 0.3), "range": RANGE}
            | (
                {"reference": arg(Word(words=("mean", "max", "min")), "mean", "max")}
                if name == "mean_reference"
                else {}
            ),
        )
        for name in ("max_hoop_stress", "mean_reference", "weighted_angle")
    ),
    Entry(
        "pardiso",
        xc.pardiso,
        {"A": arg(Seen(rule=lambda v: False), near={"lopsided": lambda: sp.csc_matrix((2, 3))})},
        share=0.0,
    ),
]
HOOKS = [
    Hook("solve", _solved_by, _superlu, Called(), "solver", cost=0.05),
    Hook(
        "energy_error",
        lambda f: xc.energy_error(scenes.solution(), f),
        lambda x: np.ones((len(x), 2, 2)),
        NOTHING,
        "energy_error",
    ),
]
