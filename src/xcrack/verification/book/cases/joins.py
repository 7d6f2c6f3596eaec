"""Two coplanar pennies that grow together, and the shape that one front takes on."""

import numpy as np
from scipy.integrate import solve_ivp

from xcrack.base.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.surfaces import penny_crack
from xcrack.fatigue.criteria import max_hoop_stress
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.growth.gaps import amplification
from xcrack.growth.run import grow
from xcrack.mesh.triangulation import face_areas
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.collect import collect
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_3d import graded, lines
from xcrack.verification.exact.fields_3d import ellipse_K_I

_C, _M = 1e-3, 3.0
_GAP = 0.6  # between pennies of radius 1
_STEPS = 9
_SOURCE = "Fabrikant (1987) for two coplanar pennies; ellipse of equal area, Irwin (1962)"


def _run(level: int) -> list[Value]:
    del level
    h, d = 0.3, 1 + _GAP / 2
    mesh = graded(
        [lines(-9, 9, (-3.2, 3.2), h, 2.0), lines(-9, 9, (-2.6, 2.6), h, 2.0),
         lines(-8, 8, (-h, h), h, 2.0)], seed=3, amplitude=0.0,
    )  # fmt: skip
    problem = Problem(
        mesh,
        Isotropic(1000.0, 0.3),
        [penny_crack((x, -0.0315, 0.0175), (0, 0, 1), 1.0, n=64) for x in (0.02 - d, 0.02 + d)],
        loads=[traction("top", (0, 0, 1.0)), traction("bottom", (0, 0, -1.0))],
        contact="off",
        order=1,
    )
    history = collect(
        grow(problem, paris(_C, _M), max_hoop_stress, Cycle(0.0, 1.0), da=0.25, max_steps=_STEPS,
             progress=False)
    )  # fmt: skip
    last = history.steps[-1]
    share = last.sif[-1][0].K_I / _ellipse(last.sif[-1][0].x, last.cracks[0])
    return [
        Value("cracks at the end", float(len(last.cracks)), 1.0, 0.0, 1.0),
        Value("cycles to the join", history.joins[0].N, _cycles(), 0.15),
        Value("mean K over that of the ellipse", float(share.mean()), 1.0, 0.03),
        Value("largest deviation from the ellipse", float(np.abs(share - 1).max()), 0.0, 0.05, 1.0),
    ]


def _ellipse(x: Floats, crack: Crack) -> Floats:
    """K_I at places of a front by the ellipse of equal area, with axes in the same ratio."""
    low, high = crack.points.min(axis=0), crack.points.max(axis=0)
    area = float(face_areas(crack.points, crack.faces).sum())
    half = (high - low)[:2] / 2
    a, b = half * np.sqrt(area / (np.pi * half[0] * half[1]))
    offset = x - (low + high) / 2
    return ellipse_K_I(np.arctan2(offset[:, 1] / b, offset[:, 0] / a), float(a), float(b), 1.0)


def _cycles() -> float:
    """Cycles until the gap is closed, for pennies that stay round: some per cent too few.

    The facing points run by the amplified K, the radius by that of one penny. In fact they bulge
    towards each other, which lowers K there.
    """

    def slope(share: float, y: Floats) -> list[float]:
        gap = _GAP * (1 - share) ** 2 + 1e-14  # points crowd where K is singular
        way, faster = _GAP * (1 - share), float(amplification(np.array(gap / y[0]))) ** _M
        return [way / faster, way / (_C * (4 * y[0] / np.pi) ** (_M / 2) * faster)]

    return float(solve_ivp(slope, (0.0, 1 - 1e-9), [1.0, 0.0], rtol=1e-8).y[1, -1])


CASES = (Case("joined-pennies", "joins", _SOURCE, "exact", 3, 1, False, _run, quick=False),)


__all__ = ["CASES"]
