"""Inclined crack in an infinite sheet under tension and shear: both tips, T, energy, units."""

from functools import partial
from typing import Any

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.fatigue.criteria import max_hoop_stress
from xcrack.model.numerics import Numerics
from xcrack.output.opening import energy_error
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import NU, centre_crack
from xcrack.verification.exact import fields_2d, kinks

_SXX, _SYY, _SXY = 0.4, 1.0, -0.5
_SOURCE = "crack in an infinite sheet (Griffith, 1921; Westergaard, 1939), imposed on a square"
_ROOT = np.sqrt(np.pi)
_K = {1: 8e-3, 2: 2e-4}


def _scene(
    level: int, order: int, angle: float = 0.21, E: float = 1.0, radius: float | None = None
) -> Any:
    n = 30 * 2**level
    return centre_crack(
        lambda x, y: fields_2d.griffith(x, y, 1.0, E, NU, _SXX * E, _SYY * E, _SXY * E),
        n, half=1.5, angle=angle, origin=(0.03, 0.02), order=order, contact="off", E=E,
        numerics=Numerics(radius=radius),
    )  # fmt: skip


def _values(
    sif: SIF, tolerance: float, unit: float = 1.0, rate: float | None = None
) -> list[Value]:
    # The normal is the same at both tips: K_II changes its sign.
    return [
        Value(
            f"K_{mode} at tip {tip}", sif.K[tip, m] / _ROOT / unit, reference, tolerance, 1.0, rate
        )
        for m, (mode, pair) in enumerate((("I", (_SYY, _SYY)), ("II", (-_SXY, _SXY))))
        for tip, reference in enumerate(pair)
    ]


def _K_run(level: int, order: int) -> list[Value]:
    return _values(stress_intensity(solve(_scene(level, order)[0])), _K[order])


def _bars_run(level: int, order: int) -> list[Value]:
    """Distance of the best K from the exact one, in half-widths of its bar: at most one."""
    sif = stress_intensity(solve(_scene(level, order)[0]), error=True)
    exact_K = _ROOT * np.array([[_SYY, -_SXY], [_SYY, _SXY]])
    share = (sif.best - exact_K) / sif.bar
    return [
        Value(f"K_{'I' * (m + 1)} at tip {k}, in bars", share[k, m], 0.0, 1.0, 1.0)
        for k in (0, 1)
        for m in (0, 1)
    ]


def _stress_run(level: int, order: int) -> list[Value]:
    T = stress_intensity(solve(_scene(level, order)[0])).T
    tolerance = {1: 2e-2, 2: 5e-4}[order]
    return [Value(f"T at tip {k}", T[k], _SXX - _SYY, tolerance, 1.0) for k in (0, 1)]


def _energy_run(level: int, order: int) -> list[Value]:
    problem, field = _scene(level, order, radius=0.4)
    error = energy_error(solve(problem), lambda x: field(x)[1])
    tolerance = {1: 0.12, 2: 0.012}[order]
    return [Value("error in energy", error, 0.0, tolerance, 1.0, rate={1: 0.9, 2: 1.6}[order])]


def _units_run(level: int, angle: float, E: float) -> list[Value]:
    sif = stress_intensity(solve(_scene(level, 2, angle, E)[0]))
    return _values(sif, _K[2], E)


def _direction_run(level: int, order: int) -> list[Value]:
    """Erdogan and Sih's angle of the computed K against that of the exact one."""
    problem, _ = _scene(level, order)
    sif = stress_intensity(solve(problem))
    angle, _, _ = max_hoop_stress(np.stack([np.zeros_like(sif.K), sif.K]), NU)
    reference = kinks.hoop_angle(np.full(2, _SYY), np.array([-_SXY, _SXY]))
    degree = np.pi / 180
    return [
        Value(f"angle at tip {k}, degrees", angle[k] / degree, float(reference[k]) / degree,
              {1: 1.0, 2: 0.05}[order], 1.0)
        for k in (0, 1)
    ]  # fmt: skip


def _case(name: str, requirement: str, run: Any, source: str = _SOURCE, order: int = 2,
          levels: int = 2) -> Case:  # fmt: skip
    return Case(name, requirement, source, "exact", 2, order, False, run, levels)


CASES = (
    _case("griffith-1", "K", partial(_K_run, order=1), order=1),
    _case("griffith-2", "K", partial(_K_run, order=2)),
    _case("griffith-T-1", "T", partial(_stress_run, order=1), order=1),
    _case("griffith-T-2", "T", partial(_stress_run, order=2)),
    _case("griffith-energy-1", "energy", partial(_energy_run, order=1), order=1, levels=3),
    _case("griffith-energy-2", "energy", partial(_energy_run, order=2)),
    _case("griffith-turned", "invariance", partial(_units_run, angle=2.3, E=1.0), levels=1),
    _case("griffith-pascal", "invariance", partial(_units_run, angle=0.21, E=210e9), levels=1),
    _case("griffith-bars-2", "error_bars", partial(_bars_run, order=2), levels=1),
    _case("griffith-direction-1", "direction", partial(_direction_run, order=1),
          "largest hoop stress (Erdogan and Sih, 1963) of exact K", 1, 1),
    _case("griffith-direction-2", "direction", partial(_direction_run, order=2),
          "largest hoop stress (Erdogan and Sih, 1963) of exact K", 2, 1),
)  # fmt: skip


__all__ = ["CASES"]
