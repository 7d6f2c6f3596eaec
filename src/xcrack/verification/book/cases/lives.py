"""Cycles under constant amplitude: a row of cracks, the rule for cycles alone, a penny."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import quad

from xcrack.crack.lines import line_crack
from xcrack.fatigue.criteria import weighted_angle
from xcrack.fatigue.cycle import Cycle, cycles_between
from xcrack.fatigue.law import Law
from xcrack.fatigue.power import elber, paris, walker
from xcrack.growth.run import grow
from xcrack.growth.step import Step
from xcrack.mesh.box import box
from xcrack.model.loads import fix, traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.collect import collect
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact import lives
from xcrack.verification.exact.fields_2d import periodic_K

_W, _A0, _GROWTH, _C = 3.0, 0.4, 0.6, 1e-3
_CYCLE, _R = Cycle(0.0, 1.0), 0.3
_EDGE = "integral of the law over K = s √(W tan(π a / W)) (Westergaard, 1939; Paris, 1963)"


def row_of_cracks(cells: int, order: int, height: int = 1) -> Problem:
    """One crack of a row: between mirror planes, far ends under traction."""
    mesh = box((-_W / 2, -height * _W), (_W / 2, height * _W), (cells, 2 * height * cells + 1))
    return Problem(
        mesh,
        Isotropic(1.0, 0.3, "strain"),
        [line_crack([(-_A0, 0.0), (_A0, 0.0)])],
        supports=[fix("left", axis=0), fix("right", axis=0)],
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
        order=order,
    )


def _grow(problem: Problem, law: Law, cycle: Cycle, n: int) -> tuple[float, float]:
    """Half length of the crack after n advances, and the cycles until then."""
    run = grow(problem, law, weighted_angle, cycle, da=_GROWTH / n, max_steps=n + 1, progress=False)
    history = collect(run, keep_solutions=False)
    x = history.cracks[0].points[:, 0]
    return float(np.ptp(x)) / 2, history.life


def _life(level: int, order: int, law: Law, cycle: Cycle, dK_exponent: float) -> list[Value]:
    """Cycles of the row by a law that sees a share of the range; exact for m = 2."""
    cells = {1: 31, 2: 15}[order] * 2**level
    a, N = _grow(row_of_cracks(cells, order), law, cycle, 4 * 2**level)
    reference = lives.paris_life_periodic(_A0, a, _W, _C, dK_exponent)
    return [
        Value("half length", a, _A0 + _GROWTH, 1e-3),
        # No rate: what steps of second order leave is below the error of the first step's rates.
        Value("cycles", N, reference, {1: 2e-2, 2: 2e-3}[order]),
    ]


def _power(level: int, order: int) -> list[Value]:
    """The same with m = 3, by quadrature."""
    law = paris(_C, 3.0)
    a, N = _grow(row_of_cracks({1: 31, 2: 15}[order] * 2**level, order), law, _CYCLE, 4 * 2**level)
    reference = quad(lambda a: 1 / law(periodic_K(a, _W), 0.0), _A0, a, epsrel=1e-12)[0]
    return [Value("cycles", N, reference, {1: 4e-2, 2: 2e-3}[order])]


def _to_a_tolerance(level: int) -> list[Value]:
    """Mesh and steps by a tolerance: the life within it, and within its bar."""
    law, tolerance = paris(_C, 3.0), 1e-2 * 10.0**-level
    run = grow(
        row_of_cracks(9, 2, 2), law, weighted_angle, _CYCLE, tolerance=tolerance, progress=False
    )  # fmt: skip
    history = collect(run, until=_has_grown, keep_solutions=False)
    a = float(np.ptp(history.cracks[0].points[:, 0])) / 2
    reference = quad(lambda a: 1 / law(periodic_K(a, _W), 0.0), _A0, a, epsrel=1e-12)[0]
    bar = history.life_bar
    return [
        Value("cycles", history.life, reference, tolerance),
        Value("error over its bar", abs(history.life - reference) / bar.total, 0.0, 1.0, scale=1.0),
        Value("bar over the cycles", bar.relative, 0.0, tolerance, scale=1.0),
    ]


def _has_grown(step: Step) -> bool:
    return float(np.ptp(step.corrected[0].points[:, 0])) / 2 > _A0 + _GROWTH


def _by_rule(rate: Callable[[Any], Any], n: int) -> float:
    a = np.linspace(1.0, 3.0, n + 1)
    return float(cycles_between(a[:-1], a[1:], rate(a[:-1]), rate(a[1:])).sum())


def _power_rate(m: float, a: Any) -> Any:
    return _C * (np.pi * a) ** (m / 2)


def _rule(level: int) -> list[Value]:
    """Ten steps of the cycle rule: exact for powers of the length, of second order else."""
    values = []
    for m in (2.0, 3.3):
        reference = lives.paris_life(1.0, 3.0, _C, m, 1.0)
        N = _by_rule(partial(_power_rate, m), 10)
        values.append(Value(f"cycles, power law m = {m:g}", N, reference, 1e-9))

    def rate(a: Any) -> Any:
        return _C * (8.0 * np.tan(np.pi * a / 8.0)) ** 1.5

    reference = quad(lambda a: 1 / rate(a), 1.0, 3.0, epsrel=1e-12)[0]
    N = _by_rule(rate, 10 * 2**level)
    values.append(Value("cycles, finite width", N, reference, 5e-3, rate=1.9))
    return values


def _case(name: str, requirement: str, run: Any, order: int, source: str = _EDGE) -> Case:
    return Case(name, requirement, source, "exact", 2, order, False, run, 2)


CASES = (
    *(
        Case(f"row-paris-{order}", "life", _EDGE, "exact", 2, order, False,
             partial(_life, order=order, law=paris(_C, 2.0), cycle=_CYCLE, dK_exponent=1.0), 2)
        for order in (1, 2)
    ),
    _case("row-paris-m3-2", "life", partial(_power, order=2), 2),
    _case("row-elber-2", "ratio",
          partial(_life, order=2, law=elber(_C, 2.0, a=0.5, b=0.4), cycle=Cycle(_R, 1.0),
                  dK_exponent=(0.5 + 0.4 * _R) * (1 - _R)), 2,
          _EDGE + ", range U ΔK (Elber, 1971)"),
    _case("row-walker-2", "ratio",
          partial(_life, order=2, law=walker(_C, 2.0, gamma=0.5), cycle=Cycle(_R, 1.0),
                  dK_exponent=(1 - _R) ** 0.5), 2,
          _EDGE + ", range ΔK / (1 - R)^(1 - γ) (Walker, 1970)"),
    _case("row-tolerance-2", "error_bars", _to_a_tolerance, 2),
    Case("cycle-rule", "life", "integrals of the law (closed form, quadrature)", "exact", 0, 0,
         False, _rule, 3),
)  # fmt: skip


__all__ = ["CASES", "row_of_cracks"]
