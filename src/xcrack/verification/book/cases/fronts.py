"""K along fronts: pennies and ellipses in a wide body, surface and corner cracks of a plate."""

from functools import partial
from typing import Any

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.surfaces import elliptic_crack
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_3d import Stress, exact_K, flat_crack, graded, lines
from xcrack.verification.exact import plates

_MIXED: Stress = (1.0, 0.3, 0.2)
_CLOSED: Stress = (-1.0, 0.3, 0.2)
_PENNY = "penny-shaped crack in an infinite body (Sneddon, 1946; Segedin, 1951)"
_ELLIPSE = "elliptic crack in an infinite body (Irwin, 1962; Kassir and Sih, 1966)"


def _open(level: int, h: float, b: float | None, order: int, **shape: Any) -> list[Value]:
    a = 0.5 if b is None else 0.6
    problem, Q = flat_crack(h / 2**level, _MIXED, a=a, b=b, order=order, contact="off", **shape)
    sif = stress_intensity(solve(problem))
    reference = exact_K(sif, Q, _MIXED, a=a, b=b)
    error, size = sif.K - reference, np.abs(reference).max(axis=0)
    mean, worst = {1: (2e-2, 5e-2), 2: (2e-2, 5e-2)}[order]
    values = [
        Value("mean of K_I", float(sif.K_I.mean()), float(reference[:, 0].mean()), mean),
    ]
    for m, mode in enumerate(("I", "II", "III")):
        values.append(
            Value(f"largest error of K_{mode}", float(np.abs(error[:, m]).max() / size[m]), 0.0,
                  worst, 1.0)
        )  # fmt: skip
    return values


def _closed_penny(level: int) -> list[Value]:
    problem, Q = flat_crack(0.17 / 2**level, _CLOSED, order=1)
    solution = solve(problem)
    sif, contact = stress_intensity(solution), solution.contact[0]
    assert contact is not None
    reference = exact_K(sif, Q, _CLOSED)
    size = float(np.abs(reference[:, 1:]).max())
    mean = float(contact.measure @ contact.pressure / contact.measure.sum())
    return [
        Value("mean pressure", mean, 1.0, 1e-2),
        Value("largest K_I", float(np.abs(sif.K_I).max()), 0.0, 1e-9, size),
        *(
            Value(
                f"mean error of K_{mode}", float(np.abs(sif.K - reference)[:, m].mean()), 0.0,
                5e-2, size,
            )
            for m, mode in ((1, "II"), (2, "III"))
        ),
    ]  # fmt: skip


_IN_SPACE = (
    Case("penny-1", "K_fronts", _PENNY, "exact", 3, 1, False,
         partial(_open, h=0.17, b=None, order=1), 2),
    Case("penny-2", "K_fronts", _PENNY, "exact", 3, 2, False,
         partial(_open, h=0.25, b=None, order=2), 1, quick=False),
    Case("ellipse-1", "K_fronts", _ELLIPSE, "exact", 3, 1, False,
         partial(_open, h=0.06, b=0.3, order=1, half=1.2, margin=0.11, depth=0.17), 1,
         quick=False),
    Case("penny-closed-1", "sliding", _PENNY, "exact", 3, 1, True, _closed_penny, 2),
)  # fmt: skip


# --- surface and corner cracks in a wide plate, by the fits of Newman and Raju ---


_A, _C, _T, _B = 0.4, 0.5, 1.0, 4.0
_FIT = "fit to finite elements, good to 5 % (Newman and Raju, 1981)"


def _at_surface_run(level: int, corner: bool) -> list[Value]:
    h = 0.15 / 2**level
    low = 0.0 if corner else -_B
    fine_range = (0.0 if corner else -_C - 0.15, _C + 0.15)
    problem = Problem(
        graded(
            [
                lines(low, _B, fine_range, h),
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


_AT_SURFACE = tuple(
    Case("corner-crack" if corner else "surface-crack", "K_surface", _FIT, "published", 3, 2,
         False, partial(_at_surface_run, corner=corner), 2)
    for corner in (False, True)
)  # fmt: skip


CASES = (*_IN_SPACE, *_AT_SURFACE)


__all__ = ["CASES"]
