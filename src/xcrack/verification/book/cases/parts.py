"""Real parts: what is read off a crack, resultants of loads, a part under the whole's motion."""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.crack.measures import measures
from xcrack.crack.surfaces import elliptic_crack
from xcrack.mesh.box import box
from xcrack.mesh.fields import read_field
from xcrack.mesh.plates import plate_with_hole
from xcrack.model.loads import Load, bearing, displacement, fix, resultant, traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.output.vtk import write
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value

_STEEL = Isotropic(2e5, 0.3, "stress")
_A, _C = 2.0, 3.0  # depth and half length
_SHAPES = {"semi-ellipse": (5.0, 2.0), "corner": (0.0, 1.0)}  # x of the middle, halves of 2c
_FORCE, _MOMENT = (30.0, -70.0), 900.0


def _read_off(level: int, shape: str) -> list[Value]:
    n = 14 * 2**level
    mesh, cell = box((0, 0, 0), (10, 10, 6), (n, n, n * 6 // 10)), 10.0 / n
    x, halves = _SHAPES[shape]
    m = measures(elliptic_crack((x, 5.03, 6), (0, 1, 0), (1, 0, 0), _C, _A), mesh)
    of = {trace.name: trace for trace in m.traces}
    values = [
        Value("length on the surface, in cells", of["top"].length, halves * _C, 0.1, cell),
        Value("depth, in cells", of["top"].depth, _A, 0.1, cell),
        Value("area", m.area, halves * np.pi * _A * _C / 4, 5e-3),
    ]
    if shape == "corner":
        values.append(Value("length on the side, in cells", of["left"].length, _A, 0.1, cell))
    return values


def _resultants(level: int) -> list[Value]:
    del level
    mesh = plate_with_hole(width=40, height=40, radius=5, size=4, size_near=1.5)
    loads: list[Load] = [bearing("hole", _FORCE), resultant("right", _FORCE, _MOMENT)]
    problem = Problem(mesh, _STEEL, supports=[fix("left")], loads=loads)
    pin, end, reaction = solve(problem).report.resultants
    size = float(np.hypot(*_FORCE))
    arm = 20.0 * _FORCE[1]  # of the end, about the origin
    return [
        *(Value(f"bearing, {i}", pin.force[k], _FORCE[k], 1e-9, size) for k, i in enumerate("xy")),
        *(Value(f"end, {i}", end.force[k], _FORCE[k], 1e-9, size) for k, i in enumerate("xy")),
        Value("moment of the end", float(np.sum(end.moment)), _MOMENT + arm, 1e-9),
        *(
            Value(f"reaction, {i}", reaction.force[k], -2 * _FORCE[k], 1e-8, size)
            for k, i in enumerate("xy")
        ),
    ]


def _submodel(level: int) -> list[Value]:
    n = 20 * 2**level
    crack = line_crack([(-0.1, 1.513), (0.3, 1.513)])
    pull = [traction("top", (0, 1.0)), traction("bottom", (0, -1.0))]
    whole_body = solve(Problem(box((0, 0), (1, 3), (n, 3 * n)), _STEEL, [crack], loads=pull))
    with TemporaryDirectory() as folder:
        write(whole_body, Path(folder) / "whole")
        field = read_field(Path(folder) / "whole.vtu", "displacement")
    sides = [displacement(name, field) for name in ("right", "top", "bottom")]
    part = box((0, 1.1), (0.7, 1.9), (7 * n // 5, 8 * n // 5))
    K = stress_intensity(solve(Problem(part, _STEEL, [crack], sides))).K_I[0]
    return [Value("K_I", float(K), float(stress_intensity(whole_body).K_I[0]), 5e-3)]


CASES = (
    *(
        Case(f"measures-{shape}", "measures", "the ellipse that the crack is", "exact", 3, 1,
             False, partial(_read_off, shape=shape), 2)
        for shape in _SHAPES
    ),
    Case("resultants", "resultants", "the force and the moment asked for", "exact", 2, 2, False,
         _resultants, needs="gmsh"),
    Case("submodel", "submodel", "the whole body with the crack, by xcrack itself", "program", 2, 2,
         False, _submodel, 2),
)  # fmt: skip


__all__ = ["CASES"]
