"""Cracks as values."""

import numpy as np

import xcrack as xc
from fuzz.entry import Entry, arg
from fuzz.kinds import (
    ListOf,
    Numbers,
    Of,
    Whole,
)
from fuzz.scene_rules import POSITIVE, SQUARE


def polyline(x):
    """Whether a polyline has pieces; of more than one, others are no business of this table."""
    step = np.linalg.norm(np.diff(x, axis=0), axis=1)
    return len(x) > 1 and bool((step > 0).all()) and (len(x) == 2 or None)


def polygon(x):
    """Whether three corners have an area; more of them are no business of this table."""
    if len(x) != 3:
        return False if len(x) < 3 else None
    return float(np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))) > 0


ENTRIES = [
    Entry(
        "Crack",
        xc.Crack,
        {
            "points": arg(
                Numbers((None, 2), rule=lambda x: len(x) > 2),
                [(0, 0), (1, 0), (2, 1)],
                words=["faces"],
            ),
            "faces": arg(
                Numbers((None, 2), whole=True, least=0, most=2, rule=lambda f: len(f) > 0 or None),
                [(0, 1), (1, 2)],
                words=["points"],
            ),
            "tips": arg(
                Numbers((None,), optional=True, whole=True, least=0, most=2), None, (0, 2), []
            ),
            "fronts": arg(
                ListOf(
                    optional=True,
                    item=Numbers((None,), whole=True, least=0, most=2),
                    rule=lambda v: None,
                ),
                None,
            ),
            "ends_on": arg(ListOf(item=Numbers((2,)), rule=lambda v: not v), ()),
        },
    ),
    Entry(
        "line_crack",
        xc.line_crack,
        {
            "points": arg(
                Numbers((None, 2), rule=polyline),
                [(0, 0), (1, 0)],
                near={
                    "back": lambda: [(0, 0), (1, 0), (0.5, 0)],
                    "closed": lambda: [*SQUARE, (0, 0)],
                    "crossing": lambda: [(0, 0), (1, 1), (1, 0), (0, 1)],
                    "one": lambda: [(0.0, 0.0)],
                },
                words=["crack"],
            )
        },
    ),
    Entry(
        "penny_crack",
        xc.penny_crack,
        {
            "center": arg(Numbers((3,)), (0, 0, 0), [1.0, 2.0, 3.0]),
            "normal": arg(Numbers((3,), rule=lambda v: bool(v.any())), (0, 0, 1), [1, 1, 1]),
            "radius": arg(POSITIVE, 1.0, 2),
            "n": arg(Whole(least=8, most=100_000), 16, 33),
        },
    ),
    Entry(
        "arm",
        xc.arm,
        {
            "crack": arg(
                Of(type=xc.Crack, rule=lambda crack: crack.dim == 3),
                xc.penny_crack((0, 0, 0), (0, 0, 1), 1.0, n=16),
                near={"in 2D": lambda: xc.line_crack([(0, 0), (1, 0)])},
            ),
            "on": arg(Whole(least=0), 0, 3),
            "side": arg(Whole(least=-1, most=1, rule=bool), 1, -1),
        },
    ),
    Entry(
        "elliptic_crack",
        xc.elliptic_crack,
        {
            "center": arg(Numbers((3,)), (0, 0, 0)),
            "normal": arg(
                Numbers((3,), rule=lambda v: bool(v.any()) and (not v[1:].any() or None)), (0, 0, 1)
            ),
            "axis": arg(
                Numbers((3,), rule=lambda v: bool(v[:2].any())), (1, 0, 0), [1.0, 2.0, 0.0]
            ),
            "a": arg(POSITIVE, 1.0, 2),
            "b": arg(POSITIVE, 0.5, 3.0),
            "n": arg(Whole(least=8, most=100_000), 16),
        },
    ),
    Entry(
        "plane_crack",
        xc.plane_crack,
        {
            "polygon": arg(
                Numbers((None, 3), rule=polygon),
                [(0, 0, 0), (1, 0, 0), (0, 1, 1)],
                near={
                    "bent": lambda: [(0, 0, 0), (1, 0, 0), (1, 1, 1), (0, 1, 0)],
                    "crossing": lambda: [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],
                    "line": lambda: [(0, 0, 0), (1, 1, 1), (2, 2, 2)],
                },
                words=["plane crack", "corner"],
            )
        },
    ),
    Entry(
        "surface_crack",
        xc.surface_crack,
        {
            "points": arg(
                Numbers(
                    (None, 3),
                    rule=lambda x: (
                        len(x) > 2 and bool(np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0])) > 0)
                    ),
                ),
                np.eye(3),
                words=["triangle"],
            ),
            "triangles": arg(
                Numbers(
                    (None, 3),
                    whole=True,
                    least=0,
                    most=2,
                    rule=lambda f: f.shape == (1, 3) and len(set(f[0])) == 3,
                ),
                [(0, 1, 2)],
                near={"twice": lambda: [(0, 1, 2), (0, 1, 2)]},
                words=["surface", "point"],
            ),
        },
    ),
]
HOOKS = []
