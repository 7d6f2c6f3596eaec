"""Circular arc cracks: K of open ones, pressure of a closed one."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import (
    NU,
    SIDES,
    E,
    imposed,
    l2,
    on_box,
    perturbed,
    turned,
)
from xcrack.verification.exact.arcs import ArcCrack, arc_manufactured

_CENTRE = np.array([-0.9, -0.1])


def _open(level: int, order: int, degrees: float, stress: tuple[float, float]) -> list[Value]:
    alpha = np.radians(degrees)
    arc = ArcCrack(1.0, alpha, E, NU, *stress)
    # Denser towards the tips: the last piece shows the tangent there.
    theta = alpha * np.sin(np.pi / 2 * np.linspace(-1, 1, 301))
    n = {1: 40, 2: 20}[order] * 2**level
    problem = Problem(
        perturbed(n, lower=(-0.5, -1.5), upper=(2.5, 1.5)),
        Isotropic(E, NU, plane="strain"),
        [line_crack(np.stack([np.cos(theta), np.sin(theta)], axis=1))],
        supports=imposed(turned(arc.field, (0.0, 0.0)), SIDES),
        order=order,
        contact="off",
    )
    sif = stress_intensity(solve(problem))
    reference = np.array([arc.K_lower, arc.K_upper]) * [[1, -1], [1, 1]]
    scale = float(np.abs(reference).max())
    tolerance = {1: 1e-2, 2: 5e-3}[order]
    return [
        Value(f"K_{'I' * (m + 1)} at tip {k}", sif.K[k, m], reference[k, m], tolerance, scale)
        for k in (0, 1)
        for m in (0, 1)
    ]


def _closed_arc(level: int, order: int) -> list[Value]:
    field = turned(lambda x, y: arc_manufactured(x, y, 1.0, E, NU, p0=1.0, p2=0.5), _CENTRE)
    n = 10 * 2**level
    theta = np.linspace(-0.45, 0.6, max(n // 2, 8) + 1)
    points = _CENTRE + np.stack([np.cos(theta), np.sin(theta)], axis=1)
    problem = on_box(
        perturbed(n, 40 + n), [line_crack(points)], field, traction=("left",), order=order,
        contact="on",
    )  # fmt: skip
    contact = solve(problem).contact[0]
    assert contact is not None
    p = _pressure(contact.points)
    largest = float(np.abs(contact.pressure - p).max())
    return [
        Value("error of the pressure, L2", l2(contact.pressure, p, contact.measure), 0.0, 0.08,
              1.0, rate=0.9),
        Value("largest error of the pressure", largest, 0.0, 0.15, 1.0),
    ]  # fmt: skip


def _pressure(x: Floats) -> Floats:
    theta = np.arctan2(*(x - _CENTRE).T[::-1])
    return np.asarray(1 + 0.5 * np.cos(2 * theta))


CASES = (
    *(
        Case(f"arc-{degrees}-{order}", "K_curved", "arc crack (Muskhelishvili, 1953)", "exact", 2,
             order, False, partial(_open, order=order, degrees=degrees, stress=stress), 2)
        for degrees, stress in ((60, (1.0, 1.0)), (45, (1.0, 0.0)))
        for order in (1, 2)
    ),
    *(
        Case(f"closed-arc-{order}", "pressure", "smooth field without shear on a circle", "exact",
             2, order, True, partial(_closed_arc, order=order), 3)
        for order in (1, 2)
    ),
)  # fmt: skip


__all__ = ["CASES"]
