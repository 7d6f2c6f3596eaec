"""Lives under a spectrum and with scatter, looks that miss, and strength left: a row of cracks."""

from functools import cache

import numpy as np
from scipy.special import ndtri

from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.fatigue.criteria import weighted_angle
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.run import grow
from xcrack.mesh.box import box
from xcrack.model.loads import fix, traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.assessment import residual_strength
from xcrack.runs.collect import collect
from xcrack.runs.history import History
from xcrack.runs.inspection import inspection, logistic_pod
from xcrack.runs.life import life
from xcrack.runs.scatter import Scatter, lognormal, normal
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact.fields_2d import periodic_K
from xcrack.verification.exact.lives import paris_life_periodic

_W, _A0, _GROWTH, _C = 3.0, 0.4, 0.6, 1e-3
_LAW = paris(_C, 2.0)
_FLIGHT = Spectrum([0.0, 1.0, 0.4, 0.6, 0.1, 0.9, 0.3], unit="flight")
_RANGES = _FLIGHT.cycles["max"] - _FLIGHT.cycles["min"]
_ROW = "K = s √(W tan(π a / W)) (Westergaard, 1939; Paris, 1963)"


@cache
def _run(level: int, *, flights: bool) -> History:
    """Growth of one crack of a row: between mirror planes, far ends under traction."""
    cells = 15 * 2**level
    problem = Problem(
        box((-_W / 2, -_W), (_W / 2, _W), (cells, 2 * cells + 1)),
        Isotropic(1.0, 0.3, "strain"),
        [line_crack([(-_A0, 0.0), (_A0, 0.0)])],
        supports=[fix("left", axis=0), fix("right", axis=0)],
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
        order=2,
    )
    n = 4 * 2**level
    cycle = _FLIGHT if flights else Cycle(0.0, 1.0)
    steps = grow(
        problem, _LAW, weighted_angle, cycle, da=_GROWTH / n, max_steps=n + 1, progress=False
    )
    return collect(steps, keep_solutions=False)


def _end(history: History) -> float:
    """Half length at the end."""
    return float(np.ptp(history.cracks[0].points[:, 0])) / 2


def _spectrum(level: int) -> list[Value]:
    """Blocks by m = 2, and by m = 3 on the same path."""
    history = _run(level, flights=True)
    a = _end(history)
    reference = paris_life_periodic(_A0, a, _W, _C, 1.0) / float((_RANGES**2).sum())
    steps = np.linspace(_A0, a, 4001)
    rate = _C * (_RANGES**3).sum() * np.array([periodic_K(x, _W) for x in steps]) ** 3
    cubed = float(((1 / rate[1:] + 1 / rate[:-1]) / 2 * np.diff(steps)).sum())
    other = history.rerate(paris(_C, 3.0), _LAW, spectrum=_FLIGHT, criterion=weighted_angle, nu=0.3)
    return [
        Value("blocks", history.life, reference, 2e-3),
        Value("blocks by another law", other.life, cubed, 1e-2, rate=0.9),
    ]


def _scatter(level: int) -> list[Value]:
    """Percentiles of lognormal lives, and the chance that four looks miss."""
    history = _run(level, flights=False)
    a = _end(history)
    N = paris_life_periodic(_A0, a, _W, _C, 1.0)
    one = life(history, _LAW, scatter=Scatter(C=lognormal(0.3)), samples=20_000, seed=27)
    loads = Scatter(load=lognormal(0.1))
    two = life(history, _LAW, scatter=loads, samples=20_000, seed=28)
    joint = Scatter(C=lognormal(0.3), constants={"m": normal(1e-9)}, correlation={("C", "m"): -0.5})
    three = life(history, _LAW, scatter=joint, samples=2000, seed=29)
    values = []
    for p in (5, 50, 95):
        z = float(ndtri(p / 100))
        values.append(Value(f"{p} % by C", one.percentile(p), N * np.exp(0.3 * z), 5e-3))
        values.append(Value(f"{p} % by load", two.percentile(p), N * np.exp(0.2 * z), 5e-3))
    values.append(Value("median of two that are correlated", three.percentile(50), N, 5e-3))
    pod = logistic_pod(0.6, 0.3)
    looks = inspection(history, interval=N / 5, pod=pod)
    at = np.arange(1, 5) * N / 5
    chance_of_miss = float(np.prod(1 - pod(_length(at))))
    return [*values, Value("chance that all looks miss", looks.missed or 0.0, chance_of_miss, 5e-3)]


def _length(N: Floats) -> Floats:
    """Half length after N cycles, by the inverse of the integral."""
    sine = np.sin(np.pi * _A0 / _W) * np.exp(np.pi * _C * N)
    return np.asarray(_W / np.pi * np.arcsin(sine))


def _strength(level: int) -> list[Value]:
    """Factor on the load by toughness, at the first step and at a later one."""
    rows = residual_strength(_run(level, flights=False), nu=0.3, K_c=2.5)
    values = []
    for n in (0, len(rows) - 1):
        half = _A0 + _GROWTH * n / (len(rows) - 1)
        reference = 2.5 / float(periodic_K(half, _W))
        values.append(Value(f"factor at a = {half:.3g}", rows["by_toughness"][n], reference, 2e-3))
    return values


CASES = (
    Case("row-spectrum-2", "spectrum", f"integral of the law, cycle by cycle, over {_ROW}",
         "exact", 2, 2, False, _spectrum, 2),
    Case("row-scatter-2", "scatter", f"lognormal lives and lengths in closed form, {_ROW}",
         "exact", 2, 2, False, _scatter, 2),
    Case("row-strength-2", "residual_strength", f"toughness over {_ROW}", "exact", 2, 2, False,
         _strength, 2),
)  # fmt: skip


__all__ = ["CASES"]
