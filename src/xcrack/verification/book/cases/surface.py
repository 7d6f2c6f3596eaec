"""Surface and corner cracks in a wide plate, by the fits of Newman and Raju."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.surfaces import elliptic_crack
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_3d import graded, lines
from xcrack.verification.exact import plates

_A, _C, _T, _B = 0.4, 0.5, 1.0, 4.0
_SOURCE = "fit to finite elements, good to 5 % (Newman and Raju, 1981)"


def _run(level: int, corner: bool) -> list[Value]:
    h = 0.15 / 2**level
    low = 0.0 if corner else -_B
    fine = (0.0 if corner else -_C - 0.15, _C + 0.15)
    problem = Problem(
        graded(
            [
                lines(low, _B, fine, h),
                lines(-4.0, 4.0, (-0.2, 0.2), h),
                lines(-_T, 0.0, (-_A - 0.15, 0.0), h),
            ],
            seed=511,
        ),
        Isotropic(E=1.0, nu=0.3),
        [elliptic_crack((0.0, 0.0071, 0.0), (0, 1, 0), (1, 0, 0), _C, _A)],
        loads=[traction("back", (0.0, 1.0, 0.0)), traction("front", (0.0, -1.0, 0.0))],
    )
    sif = stress_intensity(solve(problem))
    phi = np.arctan2(np.maximum(-sif.x[:, 2], 0) / _A, sif.x[:, 0] / _C)
    table = plates.newman_raju_corner if corner else plates.newman_raju_surface
    ratio = (sif.K_I / table(phi, _A, _C, _T, _B))[~sif.at_surface]
    return [
        Value("mean K_I over the fit", float(ratio.mean()), 1.0, 0.05),
        Value("largest difference", float(np.abs(ratio - 1).max()), 0.0, 0.1, 1.0),
    ]


CASES = tuple(
    Case("corner-crack" if corner else "surface-crack", "K_surface", _SOURCE, "published", 3, 2,
         False, partial(_run, corner=corner), 2)
    for corner in (False, True)
)  # fmt: skip


__all__ = ["CASES"]
