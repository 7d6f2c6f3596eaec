"""Closed cracks that rub: slip along a path of loads, the energy of a cycle, and stick."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.model.loads import displacement
from xcrack.sif.stress_intensity import stress_intensities
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import (
    NU,
    SIDES,
    E,
    centre_crack,
    imposed,
    turned,
)
from xcrack.verification.exact.fields_2d import griffith
from xcrack.verification.exact.potentials_2d import Values, uniform_stress

_ROOT = np.sqrt(np.pi)
_ANGLE, _ORIGIN = 0.31, (0.05, -0.07)


def _plane(x: Floats, y: Floats, felt: float, shear: float, pressure: float) -> Values:
    """A pressed crack [-1, 1] that feels a part of the shear; friction carries the rest."""
    u, s = griffith(x, y, 1.0, E, NU, 0.0, 0.0, felt)
    u_body, s_body = uniform_stress(x, y, 0.0, -pressure, shear - felt, E, NU)
    return u + u_body, s + s_body


def _state(felt: float, shear: float, pressure: float = 1.0) -> list[displacement]:
    plane = partial(_plane, felt=felt, shear=shear, pressure=pressure)
    return imposed(turned(plane, _ORIGIN, _ANGLE), SIDES)


def _cycle(level: int, order: int) -> list[Value]:
    """Shear up and down under a constant pressure: K_II, and the energy of the second cycle."""
    n, mu, range_ = 21 * 2**level, 0.3, 1.8
    felt = range_ / 2 - mu
    states = [_state(sign * felt, sign * range_ / 2) for sign in (1, -1, 1, -1, 1)]
    problem, _ = centre_crack(
        partial(_plane, felt=0.0, shear=0.0, pressure=1.0), n, order=order, angle=_ANGLE,
        origin=_ORIGIN, friction=mu,
    )  # fmt: skip
    solutions = solve(problem, states)
    K = [sif.K_II / _ROOT for sif in stress_intensities(solutions)]
    work = solutions[3].dissipated + solutions[4].dissipated
    loss = 4 * np.pi * mu * (range_ - 2 * mu) * (1 - NU**2) / E
    tolerance = {1: 1e-2, 2: 1e-3}[order]
    return [
        *(
            Value(f"K_II at tip {k}", K[4][k], sign * felt, tolerance)
            for k, sign in ((0, -1), (1, 1))
        ),
        Value("K_II at the other end of the cycle", K[3][1], -felt, tolerance),
        Value("energy of a cycle", work, loss, {1: 4e-2, 2: 2e-3}[order]),
    ]


def _stick(level: int, order: int) -> list[Value]:
    """More friction than shear: the body is uncracked."""
    n = 21 * 2**level
    problem, _ = centre_crack(
        partial(_plane, felt=0.0, shear=0.8, pressure=1.0), n, order=order, angle=_ANGLE,
        origin=_ORIGIN, friction=1.2,
    )  # fmt: skip
    solution = solve(problem)
    contact = solution.contact[0]
    assert contact is not None
    assert contact.shear is not None
    assert contact.slip is not None
    # Lip + is pushed by p n, and sheared by the traction that an uncracked body has there.
    error = np.abs(np.abs(contact.shear) - 0.8).max()
    return [
        Value("largest error of the shear", float(error), 0.0, 1e-9, 0.8),
        Value("largest slip", float(np.abs(contact.slip).max()), 0.0, 1e-9, 1.0 / E),
        Value("largest error of the pressure", float(np.abs(contact.pressure - 1).max()), 0.0,
              1e-9, 1.0),
    ]  # fmt: skip


CASES = (
    *(
        Case(f"rubbing-{order}", "friction", "superposition along the loads", "exact",
             2, order, True, partial(_cycle, order=order), 2)
        for order in (1, 2)
    ),
    *(
        Case(f"stuck-{order}", "friction", "the uncracked body", "exact", 2, order, True,
             partial(_stick, order=order), 1)
        for order in (1, 2)
    ),
)  # fmt: skip


__all__ = ["CASES"]
