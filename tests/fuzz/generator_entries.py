"""Bodies that gmsh meshes."""

import shutil
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Entry, Hook, arg
from fuzz.kinds import (
    SKIP,
    Called,
    Filename,
    Number,
    Numbers,
    Seen,
    array,
)
from fuzz.values import paths

SIDES = ("left", "right", "bottom", "top", "boundary")


def holes(value):
    """Whether a value is a list of round holes; whether they fit is no business of this table."""
    if isinstance(value, str | dict) or not hasattr(value, "__iter__"):
        return False
    if isinstance(value, np.ndarray) and not value.ndim:
        return False
    return True if not list(value) else False


def _mesh_step(**named):
    shutil.copy(scenes.step_file(), "box.step")
    Path("there.msh").write_text("no STEP file")
    return xc.mesh_step(**named)


LINE = [(0.5, 0.0), (1.0, 0.0)]

PARTS = {
    "a box elsewhere": lambda: {"a": ((50, 50), (60, 60))},
    "a box of three": lambda: {"a": ((0, 0, 0), (1, 1, 1))},
    "a name that is taken": lambda: {"boundary": ((None, None), (None, None))},
    "text": lambda: {"a": "b"},
    "a side that is none": lambda: {"a": [99]},
    "no side": lambda: {"a": []},
    "list": lambda: [("a", [1])],
    "numbers": lambda: {"a": lambda x: x[:, 0]},
}
SETS = arg(
    Seen(rule=lambda v: v is None or (v == {} if isinstance(v, dict) else False)),
    None,
    near=PARTS,
    words=["sets", "box"],
)


def outlines(value):
    """Whether a value is an outline; whether it closes well is no business of this table."""
    if value is None:  # a plate without width and height
        return False
    if isinstance(value, str | dict) or not hasattr(value, "__iter__"):
        return False
    if isinstance(value, np.ndarray) and not value.ndim:
        return False
    x = array(value)
    good = x is not None and x.ndim == 2 and x.shape[1] == 2 and len(x) > 2
    return None if good else False


def _outlined(outline, size):
    return xc.plate(outline=outline, size=size)


def _part(of, where, name):
    return xc.part(scenes.mesh(), of, where, name)


def boxes(value):
    """Whether a value is a box, or None where it depends on the body."""
    if callable(value):
        return "skip"
    if isinstance(value, str | dict | set) or not hasattr(value, "__iter__"):
        return False
    x = array(value)
    return None if x is not None and x.shape == (2, 2) and np.isfinite(x).all() else False


def _specimen(make, **named):
    return make(**named).problem(scenes.STEEL)


LENGTHS = {
    "W": arg(Number(above=0, rule=lambda v: 8 <= v <= 20 or None), 10.0, words=["size", "width"]),
    "a": arg(Number(above=0, rule=lambda v: 2 <= v <= 3 or None), 2.5, words=["crack", "size"]),
}
CELLS = {
    name: arg(Number(optional=True, rule=lambda v: v > 0 and None), None, words=["size", "plate"])
    for name in ("size", "size_near")
}
FORCED = {"force": arg(Number(rule=lambda v: None), 1.0, words=["force"])}
ANGLED = {"contact_angle": arg(Number(above=0, most=np.pi, rule=lambda v: v > 0.5 or None), 1.0)}
STRESSED = {
    "stress": arg(Number(), 1.0),
    "height": arg(Number(optional=True, rule=lambda v: v > 0 and None), None, words=["size"]),
}

PLATE = {
    "size": arg(Number(above=0, rule=lambda v: 0.5 <= v <= 1.0 or None), 1.0, 0.8),
    "size_near": arg(
        Number(optional=True, rule=lambda v: 0.3 <= v <= 0.8 or (None if 0 < v <= 1.0 else False)),
        None,
        0.5,
    ),
    "along": arg(
        Numbers(
            (None, 2),
            optional=True,
            rule=lambda x: None,
            also=(Numbers((None, None, 2), rule=lambda x: None),),
        ),
        None,
        LINE,
        [LINE],
    ),
    "band": arg(Number(optional=True, rule=lambda v: v >= 0 and (v < 1 or None)), None, 0.3),
    "transition": arg(Number(optional=True, rule=lambda v: v >= 0 and (v > 0.1 or None)), None, 2),
    "sets": SETS,
}


def _length(v, most=np.inf):
    """A length of the bar may fit or not; cells between these sizes take gmsh minutes."""
    if 1e-3 < v < 4:
        return SKIP
    return None if 0 <= v <= most else False


BAR = {
    "diameter": 20.0,
    "length": 140.0,
    "notch_depth": 2.0,
    "notch_angle": 1.0,
    "outer_span": 120.0,
    "inner_span": 40.0,
    "size": 8.0,
}

ENTRIES = [
    Entry(
        "mesh_step",
        _mesh_step,
        {
            "path": arg(
                Filename(known=("box.step", "./box.step")),
                "box.step",
                near=paths(".step", "") | {"a mesh": lambda: "there.msh"},
                words=["STEP"],
            ),
            "size": arg(
                Number(above=0, rule=lambda v: 0.3 <= v <= 2 or None, also=(Called(),)), 0.8
            ),
            "sets": arg(
                Seen(rule=lambda v: v is None or v == {} if isinstance(v, dict | None) else False),
                None,
                near={
                    "text": lambda: {"a": "b"},
                    "no face": lambda: {"a": [99]},
                    "list": lambda: [("a", [1])],
                    "none": lambda: {"a": []},
                },
            ),
        },
        in_folder=True,
        cost=0.3,
    ),
    Entry(
        "plate",
        lambda **named: xc.plate(named.pop("width"), named.pop("height"), **named),
        {
            "width": arg(
                Number(above=0, rule=lambda v: 2 <= v <= 20 or None), 4.0, 5, words=["size", "hole"]
            ),
            "height": arg(
                Number(above=0, rule=lambda v: 2 <= v <= 20 or None), 3.0, 4, words=["size", "hole"]
            ),
            "lower": arg(Numbers((2,), rule=lambda x: None), (0.0, 0.0)),
            "holes": arg(
                Seen(rule=holes),
                (),
                words=["hole"],
                near={
                    "far": lambda: [((50.0, 50.0), 1.0)],
                    "negative": lambda: [((2, 1.5), -0.2)],
                    "texts": lambda: [("a", 1.0)],
                    "no pair": lambda: [(1.0, 2.0, 3.0)],
                    "nan": lambda: [((np.nan, 1.0), 0.3)],
                    "overlapping": lambda: [((2, 1.5), 0.5), ((2.2, 1.5), 0.5)],
                },
            ),
            **PLATE,
        },
        cost=0.1,
    ),
    Entry(
        "plate",
        _outlined,
        {
            "outline": arg(
                Seen(rule=outlines),
                [(0, 0), (4, 0), ((5, 1), (4, 2)), (0, 2)],
                [(0, 0), (4, 0), (0, 3)],
                near={
                    "crossing": lambda: [(0, 0), (4, 4), (4, 0), (0, 4)],
                    "two points": lambda: [(0, 0), (4, 4)],
                    "a point twice": lambda: [(0, 0), (0, 0), (4, 0), (0, 3)],
                    "an arc on a line": lambda: [(0, 0), ((1, 0), (4, 0)), (0, 3)],
                    "nan": lambda: [(0, 0), (np.nan, 0), (0, 3)],
                    "of three": lambda: [(0, 0, 0), (4, 0, 0), (0, 3, 0)],
                },
                words=["outline", "plate"],
            ),
            "size": PLATE["size"],
        },
        cost=0.1,
        arity=False,
    ),
    Entry(
        "part",
        _part,
        {
            "of": arg(
                Seen(rule=lambda v: isinstance(v, str) and v in SIDES),
                "top",
                "left",
                words=["part", "set"],
            ),
            "where": arg(
                Seen(rule=boxes),
                ((None, None), (None, None)),
                words=["part", "box"],
                near={"elsewhere": lambda: ((50, 50), (60, 60)), "flags": lambda: lambda x: 1},
            ),
            "name": arg(
                Seen(rule=lambda v: isinstance(v, str) and v not in SIDES),
                "",
                "new",
                words=["part", "name"],
            ),
        },
    ),
    *(
        Entry(
            make.__name__,
            lambda make=make, **named: _specimen(make, **named),
            {**LENGTHS, **more, **CELLS},
            cost=0.4,
            arity=False,
        )
        for make, more in (
            (xc.compact_tension, FORCED | ANGLED),
            (xc.disc_compact, FORCED | ANGLED),
            (xc.middle_tension, STRESSED),
            (xc.single_edge_tension, STRESSED),
            (xc.single_edge_bend, FORCED),
            (
                xc.lug,
                {
                    "D": arg(
                        Number(above=0, rule=lambda v: 3 <= v <= 4 or None),
                        3.5,
                        words=["hole", "size"],
                    ),
                    **FORCED,
                    **ANGLED,
                    "length": arg(
                        Number(optional=True, rule=lambda v: v > 0 and None),
                        None,
                        words=["size", "hole", "plate"],
                    ),
                },
            ),
        )
    ),
    Entry(
        "plate_with_hole",
        xc.plate_with_hole,
        {
            "width": arg(
                Number(above=0, rule=lambda v: 4 <= v <= 20 or None),
                6.0,
                words=["size", "hole", "plate"],
            ),
            "height": arg(
                Number(above=0, rule=lambda v: 4 <= v <= 20 or None),
                5.0,
                words=["size", "hole", "plate"],
            ),
            "radius": arg(
                Number(above=0.0, below=2.0, rule=lambda v: v >= 0.4 or None), 0.8, words=["hole"]
            ),
            "center": arg(
                Numbers((2,), rule=lambda x: True if np.abs(x).max() < 1 else None),
                (0.0, 0.0),
                words=["centre"],
            ),
            **PLATE,
        },
        cost=0.2,
    ),
    Entry(
        "notched_cylinder",
        xc.notched_cylinder,
        {
            **{
                name: arg(
                    Number(rule=lambda v, good=value: _length(v, 2 * good)),
                    value,
                    words=["station", "size", "notch", "bar", "patch", "span", "inner", "outer"],
                )
                for name, value in BAR.items()
            },
            **{
                name: arg(Number(optional=True, rule=_length), None)
                for name in ("size_near", "patch_length", "crack_depth", "band", "transition")
            },
        },
        cost=2.0,
    ),
]
HOOKS = [
    Hook(
        "mesh_step",
        lambda f: _mesh_step(path="box.step", size=f),
        lambda x: 0.8 + 0 * x[:, 0],
        Number(
            above=0,
            rule=lambda v: 0.3 <= v <= 2 or None,
            also=(Numbers((1,), rule=lambda v: None),),
        ),
        "size",
        cost=0.3,
        in_folder=True,
    ),
    Hook(
        "mesh_step",
        lambda f: _mesh_step(path="box.step", size=0.8, sets={"a": f}),
        lambda x: x[:, 0] < 1e-6,
        Seen(rule=lambda v: False),
        "sets",
        cost=0.3,
        in_folder=True,
    ),
]
