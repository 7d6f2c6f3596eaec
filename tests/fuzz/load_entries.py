"""Supports and loads, and functions as their values."""

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, arg
from fuzz.kinds import (
    Called,
    Number,
    Numbers,
    Seen,
    Whole,
    Word,
    array,
)

SETS = ("left", "right", "bottom", "top", "boundary")

VECTOR = Numbers((2,), also=(Numbers((3,)), Called()))

IN_2D = Numbers((2,), also=(Called(),))

SCALAR = Number(also=(Called(),))


def where(value, words=SETS):
    """Whether a value names a set of the box; points are left to others."""
    if isinstance(value, str):
        return value in words
    x = array(value)
    return None if x is not None and x.ndim in (1, 2) and np.isfinite(x).all() else False


def several(value):
    """Points in rows, which may suit the body and the other arguments or not."""
    x = array(value)
    is_row = x is not None and x.ndim == 2 and x.shape[1] in (2, 3) and np.isfinite(x).all()
    return None if is_row and len(x) else False


def any_where(value):
    """Whether a value may name a set of some mesh."""
    return isinstance(value, str) or where(value)


def _loaded(kind, *arguments):
    scene = xc.Problem(
        scenes.mesh(), scenes.STEEL, [scenes.crack()], [xc.fix("bottom")], [kind(*arguments)]
    )
    return xc.solve(scene)


def _stretched(value):
    scene = xc.Problem(
        scenes.mesh(), scenes.STEEL, [], [xc.displacement("top", value), xc.fix("bottom")]
    )
    return xc.solve(scene)


def rows(*more):
    """What a function of the points of a side may return: one row a point, or one for all."""

    def rule(value):
        x = array(value)
        if x is None or not np.isfinite(x).all() or x.shape not in ((2,), *more):
            return False
        size = np.abs(x[x != 0])
        return not len(size) or (bool(1e-6 <= size.min() and size.max() <= 1e6) or None)

    return Seen(rule=rule)


ENTRIES = [
    Entry(
        "fix",
        xc.fix,
        {
            "where": arg(Seen(rule=any_where), "left", (0.0, 0.0)),
            "axis": arg(Whole(optional=True, least=0, most=2), None, 1),
        },
    ),
    Entry(
        "displacement",
        xc.displacement,
        {
            "where": arg(Seen(rule=any_where), "left", (0.0, 0.0)),
            "value": arg(
                VECTOR,
                (0, 0),
                (None, 1.0),
                near={
                    "None among three": lambda: (1, None, "a"),
                    "None of four": lambda: (1, None, 2, 3),
                },
            ),
        },
    ),
    Entry(
        "traction",
        xc.traction,
        {
            "where": arg(Word(), "left", words=["facet set"]),
            "value": arg(VECTOR, (0, 1), (0, 0, 1)),
        },
    ),
    Entry(
        "pressure",
        xc.pressure,
        {
            "where": arg(Word(), "left", words=["facet set"]),
            "p": arg(SCALAR, 1.0, 0, words=["value"]),
        },
    ),
    Entry(
        "point_force",
        xc.point_force,
        {
            "x": arg(Numbers((2,), also=(Seen(rule=several),)), (0, 1)),
            "f": arg(Numbers((2,), also=(Seen(rule=several),)), (1.0, 0.0)),
        },
    ),
    Entry(
        "line_force",
        xc.line_force,
        {
            "where": arg(Word(), "left", words=["facet set"]),
            "beside": arg(Word(), "top", words=["facet set"]),
            "f": arg(VECTOR, (0, 1), (0, 0, 1)),
        },
    ),
    Entry("body_force", xc.body_force, {"b": arg(VECTOR, (0, 1), words=["value"])}),
    Entry(
        "crack_pressure",
        xc.crack_pressure,
        {
            "p": arg(SCALAR, 1.0, words=["value"]),
            "crack": arg(Whole(optional=True, least=0), None, 0),
        },
    ),
    Entry(
        "initial_stress",
        xc.initial_stress,
        {
            "f": arg(
                Numbers(
                    None,
                    rule=lambda s: s.shape in ((2, 2), (3, 3)) and np.allclose(s, s.T),
                    also=(Called(),),
                ),
                np.eye(2),
                np.eye(3),
                words=["initial_stress"],
            )
        },
    ),
    *(
        Entry(
            kind.__name__,
            lambda kind=kind, **named: _loaded(kind, *named.values()),
            {
                name: arg(Seen(rule=rule), "top", words=["facet set", kind.__name__])
                if name == "where"
                else rule
                for name, rule in arguments.items()
            },
            cost=0.04,
            arity=False,
        )
        for kind, arguments in (
            (
                xc.traction,
                {
                    "where": lambda v: isinstance(v, str) and v in SETS,
                    "value": arg(IN_2D, (0, 1), words=["vector"]),
                },
            ),
            (
                xc.pressure,
                {
                    "where": lambda v: isinstance(v, str) and v in SETS,
                    "p": arg(SCALAR, 1.0, words=["pressure"]),
                },
            ),
            (
                xc.point_force,
                {
                    "x": arg(
                        Numbers((2,), least=-1, most=1, also=(Seen(rule=several),)),
                        (0.0, 1.0),
                        words=["point"],
                    ),
                    "f": arg(
                        Numbers((2,), also=(Seen(rule=several),)),
                        (1.0, 0.0),
                        words=["point_force"],
                    ),
                },
            ),
            (xc.body_force, {"b": arg(IN_2D, (0, 1), words=["body_force"])}),
            (
                xc.crack_pressure,
                {
                    "p": arg(SCALAR, 1.0, words=["crack_pressure"]),
                    "crack": arg(Whole(optional=True, least=0, most=0), None, 0),
                },
            ),
            (
                xc.initial_stress,
                {
                    "f": arg(
                        Numbers((2, 2), rule=lambda s: np.allclose(s, s.T), also=(Called(),)),
                        np.eye(2),
                        words=["initial_stress"],
                    )
                },
            ),
        )
    ),
]
HOOKS = [
    Hook(
        "traction",
        lambda f: _loaded(xc.traction, "top", f),
        lambda x, *n: 0 * x,
        rows(),
        "traction",
    ),
    Hook(
        "pressure",
        lambda f: _loaded(xc.pressure, "top", f),
        lambda x: x[:, 0],
        Numbers(()),
        "pressure",
    ),
    Hook("body_force", lambda f: _loaded(xc.body_force, f), lambda x: 0 * x, rows(), "body_force"),
    Hook(
        "crack_pressure",
        lambda f: _loaded(xc.crack_pressure, f),
        lambda x: x[:, 0],
        Numbers(()),
        "crack_pressure",
    ),
    Hook(
        "initial_stress",
        lambda f: _loaded(xc.initial_stress, f),
        lambda x: np.zeros((len(x), 2, 2)),
        Numbers((2, 2), rule=lambda s: np.allclose(s, s.T)),
        "initial_stress",
    ),
    Hook("displacement", _stretched, lambda x: 0.1 * x, rows(), "displacement"),
]
