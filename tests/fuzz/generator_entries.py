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
)
from fuzz.values import paths


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
