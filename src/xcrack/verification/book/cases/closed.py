"""Closed and partly closed cracks: pressure in a ring, half closed, closed and sliding."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.output.opening import energy_error
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import (
    NU,
    E,
    along,
    annulus,
    centre_crack,
    l2,
    rows,
    tractions,
    turned,
)
from xcrack.verification.exact import closed, plates

_INNER, _OUTER = 0.5, 1.5
_ROOT = np.sqrt(np.pi)
_ANGLE, _ORIGIN = 0.21, (0.05, -0.07)


def _ring(level: int, order: int) -> list[Value]:
    """Radial crack through the wall of a thick cylinder, pressed by Lamé's hoop stress."""
    n = 6 * 2**level
    p = _OUTER**2 / (_OUTER**2 - _INNER**2)
    field = turned(
        lambda x, y: plates.lame_cylinder(x, y, _INNER, _OUTER, 0.0, 1.0, E, NU), (0.0, 0.0)
    )
    direction = rows(0.4)[0]
    problem = Problem(
        annulus(_INNER, _OUTER, n, 5 * n),
        Isotropic(E, NU, "strain"),
        [line_crack([0.4 * direction, 1.1 * direction])],
        loads=tractions(field, ("inner", "outer")),
        order=order,
        contact="on",
    )
    solution = solve(problem)
    contact = solution.contact[0]
    assert contact is not None
    reference = p * (1 + _INNER**2 / (contact.points**2).sum(axis=1))
    error = energy_error(solution, lambda x: field(x)[1])
    worst = float(np.abs(contact.pressure / reference - 1).max())
    return [
        Value("error of the pressure, L2", l2(contact.pressure, reference, contact.measure), 0.0,
              0.1, 1.0, rate=0.9),
        Value("largest error of the pressure", worst, 0.0, 0.25, 1.0),
        Value("error in energy", error, 0.0, {1: 0.15, 2: 0.02}[order], 1.0, rate=0.9 * order),
    ]  # fmt: skip


def _half(level: int, order: int, s_m: float) -> list[Value]:
    """Tension and bending: the crack is closed up to a point that is known."""
    n = 40 * 2**level
    problem, _ = centre_crack(
        lambda x, y: closed.partial_closure(x, y, 1.0, E, NU, s_m, 1.0),
        n,
        order=order,
        angle=_ANGLE,
        origin=_ORIGIN,
    )
    solution = solve(problem)
    sif, contact = stress_intensity(solution), solution.contact[0]
    x = along(solution, _ANGLE, _ORIGIN)
    assert contact is not None
    x0, c, K = closed.partial_closure_params(1.0, s_m, 1.0)
    p = closed.partial_closure_pressure(x, 1.0, s_m, 1.0)
    end = float(x[contact.closed].max())
    return [
        Value("K_I of the open tip", sif.K_I[1], K, {1: 1e-2, 2: 1e-3}[order]),
        Value("K_I of the closed tip", sif.K_integral[0, 0], 0.0, {1: 3e-2, 2: 5e-3}[order], K),
        Value("end of contact, in cells", end, x0 - c, 1.0, 4 / n),
        Value("error of the pressure, L2", l2(contact.pressure, p, contact.measure), 0.0, 0.15,
              1.0),
    ]  # fmt: skip


def _sliding_crack(level: int, order: int) -> list[Value]:
    """Compression and shear of equal size; friction is none."""
    n = 41 * 2**level
    problem, _ = centre_crack(
        lambda x, y: closed.closed_crack(x, y, 1.0, E, NU, syy=-1.0, sxy=1.0), n, order=order,
        angle=0.634, origin=(0.038, 0.009), seed=31,
    )  # fmt: skip
    solution = solve(problem)
    K, contact = stress_intensity(solution).K_integral / _ROOT, solution.contact[0]
    assert contact is not None
    worst = float(np.abs(contact.pressure - 1).max())
    return [
        *(Value(f"K_I at tip {k}", K[k, 0], 0.0, {1: 2e-2, 2: 1e-3}[order], 1.0) for k in (0, 1)),
        *(
            Value(f"K_II at tip {k}", K[k, 1], sign, {1: 1e-2, 2: 5e-4}[order])
            for k, sign in enumerate((-1.0, 1.0))
        ),
        Value("largest error of the pressure", worst, 0.0, {1: 0.2, 2: 1e-2}[order], 1.0),
        Value("closed share", float(contact.closed.mean()), 1.0, 0.0),
    ]


CASES = (
    *(
        Case(f"ring-{order}", "pressure", "thick cylinder (Lamé, 1852)", "exact", 2, order, True,
             partial(_ring, order=order), 3)
        for order in (1, 2)
    ),
    *(
        Case(f"half-closed-{s_m}-{order}", "partial",
             "superposition with complementarity, exact.closed", "exact", 2, order,
             True, partial(_half, order=order, s_m=s_m), 2)
        for s_m in (0.0, 0.25)
        for order in (1, 2)
    ),
    *(
        Case(f"sliding-{order}", "sliding", "closed crack in shear, exact.closed",
             "exact", 2, order, True, partial(_sliding_crack, order=order), 2)
        for order in (1, 2)
    ),
)  # fmt: skip


__all__ = ["CASES"]
