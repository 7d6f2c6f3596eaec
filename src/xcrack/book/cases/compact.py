"""Compact tension: pins in the holes of a standard specimen."""

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.book.case import Case, Value
from xcrack.crack.lines import line_crack
from xcrack.mesh.plates import plate
from xcrack.scene.material import Isotropic
from xcrack.scene.problem import Problem
from xcrack.scene.set_loads import bearing
from xcrack.sif.stress_intensity import stress_intensity

_SOURCE = "polynomial of ASTM E399 and E647 within 0.5 % (Srawley, 1976)"
_SHARES = {0.3: 0.015, 0.45: 0.01, 0.5: 0.01, 0.55: 0.01, 0.7: 0.015}  # a/W and what is allowed
_W = 50.0


def _standard(x: float) -> float:
    """K B sqrt(W) / P of the standards for a/W = x."""
    series = 0.886 + 4.64 * x - 13.32 * x**2 + 14.72 * x**3 - 5.6 * x**4
    return float((2 + x) * series / (1 - x) ** 1.5)


def _run(level: int) -> list[Value]:
    h = 1.5 / 2**level
    mesh = plate(
        1.25 * _W,
        1.2 * _W,
        lower=(-0.25 * _W, -0.6 * _W),
        holes=[((0.0, side * 0.275 * _W), 0.125 * _W) for side in (1, -1)],
        size=3 * h,
        size_near=h,
        along=[(0.2 * _W, 0.0), (0.85 * _W, 0.0)],
        band=1.0,
        transition=15.0,
    )
    values = []
    for share, allowed in _SHARES.items():
        problem = Problem(
            mesh,
            Isotropic(72e3, 0.33, "strain"),
            [line_crack([(-0.26 * _W, 0.0), (share * _W, 0.0)])],
            loads=[bearing(f"hole_{k}", (0.0, side)) for k, side in enumerate((1.0, -1.0))],
        )
        K = stress_intensity(solve(problem)).K_I[0] * np.sqrt(_W)
        values.append(Value(f"K at a/W = {share:g}", float(K), _standard(share), allowed))
    return values


CASES = (
    Case("compact-tension", "K_tables", _SOURCE, "published", 2, 2, False, _run, 2, needs="gmsh"),
)


__all__ = ["CASES"]
