"""Griffith's crack with a part of its stress given as a load.

The load is a pressure on the faces, an initial stress or a change of temperature.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.model.loads import Load, crack_pressure, displacement, initial_stress, temperature
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import NU, SIDES, E, perturbed, rows, turned
from xcrack.verification.exact import fields_2d, potentials_2d

_SYY, _SXY, _ANGLE = 1.0, 0.5, 0.21
_WITHIN = {1: 8e-3, 2: 3e-4}
_PRESSURE = 0.8
_INITIAL = (0.3, 0.6, -0.2)
_HEAT, _EXPANSION = 0.4, 0.25
_THERMAL = -E / (1 - 2 * NU) * _EXPANSION * _HEAT  # of a body that cannot expand, plane strain
_SOURCE = "superposition of Griffith's crack and a uniform stress"


def _run(
    level: int, order: int, stress: tuple[float, float, float], loads: Sequence[Load]
) -> list[Value]:
    """K of Griffith's crack, whose sides have its displacement without that of a uniform stress."""
    field = turned(
        lambda x, y: fields_2d.griffith(x, y, 1.0, E, NU, 0.0, _SYY, _SXY), (0, 0), _ANGLE
    )

    def sides(x: np.ndarray) -> np.ndarray:
        uniform = potentials_2d.uniform_stress(x[:, 0], x[:, 1], *stress, E, NU)[0]
        return np.asarray(field(x)[0] - uniform)

    n = 30 * 2**level
    problem = Problem(
        perturbed(n, lower=(-1.5, -1.5), upper=(1.5, 1.5)),
        Isotropic(E, NU, "strain"),
        [line_crack(np.array([[-1.0, 0.0], [1.0, 0.0]]) @ rows(_ANGLE))],
        supports=[displacement(side, sides) for side in SIDES],
        loads=loads,
        order=order,
        contact="off",
    )
    K = stress_intensity(solve(problem)).K / np.sqrt(np.pi)
    return [
        Value("K_I at tip 0", K[0, 0], _SYY, _WITHIN[order], 1.0),
        Value("K_I at tip 1", K[1, 0], _SYY, _WITHIN[order], 1.0),
        Value("K_II at tip 1", K[1, 1], _SXY, _WITHIN[order], 1.0),
    ]


def _initial_stress_load() -> list[Load]:
    sxx, syy, sxy = _INITIAL
    return [initial_stress(np.array([[sxx, sxy], [sxy, syy]]))]


CASES = tuple(
    Case(f"{name}-{order}", requirement, _SOURCE, "exact", 2, order, False,
         partial(_run, order=order, stress=stress, loads=loads), 2)
    for name, requirement, stress, loads in (
        ("face-pressure", "loads", (_PRESSURE, _PRESSURE, 0.0), [crack_pressure(_PRESSURE)]),
        ("initial-stress", "loads", _INITIAL, _initial_stress_load()),
        ("temperature", "temperature", (_THERMAL, _THERMAL, 0.0), [temperature(_HEAT, _EXPANSION)]),
    )
    for order in (1, 2)
)  # fmt: skip


__all__ = ["CASES"]
