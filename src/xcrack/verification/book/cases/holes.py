"""Cracks from a circular hole in a wide plate under tension; made with gmsh."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.mesh.plates import plate_with_hole
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact.plates import BOWIE

_HALF = 60.0  # of the plate, in radii: wide enough for 1e-3


def _run(level: int, both: bool) -> list[Value]:
    h = 0.08 / 2**level
    lines = [[(1.0, 0.0), (2.3, 0.0)], *([[(-1.0, 0.0), (-2.3, 0.0)]] if both else [])]
    mesh = plate_with_hole(
        width=2 * _HALF, height=2 * _HALF, radius=1.0, size=_HALF / 6, size_near=h, along=lines
    )
    cracks = [line_crack([(0.9 * s, 0.0), (2.0 * s, 0.0)]) for s in ((1, -1) if both else (1,))]
    problem = Problem(
        mesh,
        Isotropic(1.0, 0.3, "strain"),
        cracks,
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
    )
    solution = solve(problem)
    reference = BOWIE[1.0][0 if both else 1]
    return [
        Value(f"K_I / s √(π a), crack {c}", stress_intensity(solution, c).K_I[0] / np.sqrt(np.pi),
              reference, 5e-3)
        for c in range(len(cracks))
    ]  # fmt: skip


CASES = tuple(
    Case(f"bowie-{'two' if both else 'one'}", "K_hole",
         "crack from a hole (Bowie, 1956; digits of Tada, Paris and Irwin, 2000)", "published", 2,
         2, False, partial(_run, both=both), needs="gmsh")
    for both in (True, False)
)  # fmt: skip


__all__ = ["CASES"]
