"""Cycles under variable amplitude: a row of cracks under blocks, with overloads, by hand."""

import math
from functools import partial
from typing import Any

import numpy as np

from xcrack.fatigue.criteria import weighted_angle
from xcrack.fatigue.law import Law
from xcrack.fatigue.power import paris
from xcrack.fatigue.retardation import Retardation, plastic_zone, wheeler, willenborg
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.run import grow
from xcrack.runs.collect import collect
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.cases.lives import row_of_cracks
from xcrack.verification.exact import lives

_W, _A0, _GROWTH, _C = 3.0, 0.4, 0.3, 2e-5
_OVER, _SMALL, _N = 1.0, 0.5, 60  # an overload, and cycles after it, in a block
_YIELD = 6.0
_ZONE = plastic_zone(_YIELD, beta=2)
_ROW = "K = s √(W tan(π a / W)) (Westergaard, 1939)"


def _grow(
    level: int, order: int, law: Law, spectrum: Spectrum, model: Retardation | None
) -> tuple[float, float]:
    """Half length of the cracks of a row after its growth, and the blocks until then."""
    problem = row_of_cracks({1: 31, 2: 15}[order] * 2**level, order)
    n = 4 * 2**level
    steps = grow(
        problem, law, weighted_angle, spectrum, da=_GROWTH / n, max_steps=n + 1,
        retardation=model, progress=False,
    )  # fmt: skip
    history = collect(steps, keep_solutions=False)
    return float(np.ptp(history.cracks[0].points[:, 0])) / 2, history.life


def _blocks(level: int, order: int) -> list[Value]:
    """Ranges 1.0, 0.6 and 0.3 of different numbers: m = 2 has a closed form."""
    rows = [(0.0, 1.0, 2.0), (0.1, 0.7, 15.0), (0.2, 0.5, 100.0)]
    a, N = _grow(level, order, paris(_C, 2.0), Spectrum(rows=rows), None)
    total = sum(count * (high - low) ** 2 for low, high, count in rows)
    reference = lives.paris_life_periodic(_A0, a, _W, _C, float(np.sqrt(total)))
    return [Value("blocks", N, reference, {1: 2e-2, 2: 3e-3}[order])]


def _overloads(level: int, order: int, model: Retardation) -> list[Value]:
    """An overload and small cycles; the sum cycle by cycle over K of the row."""
    spectrum = Spectrum([0.0, _OVER, *[0.0, _SMALL] * _N])
    a, N = _grow(level, order, paris(_C, 3.0), spectrum, model)
    reference = _by_hand(model, a)
    return [Value("blocks", N, reference, {1: 4e-2, 2: 3e-3}[order])]


def _by_hand(model: Retardation, last: float) -> float:
    """Blocks from the first length to the last, one cycle after the other."""
    a, end, size, K_over, count = _A0, 0.0, 0.0, 0.0, 0
    while a < last:
        K = (_SMALL if count % (_N + 1) else _OVER) * math.sqrt(_W * math.tan(math.pi * a / _W))
        zone = K**2 / (2 * math.pi * _YIELD**2)
        if a + zone >= end:
            end, size, K_over = a + zone, zone, K
        if isinstance(model, wheeler):
            growth = _C * K**3 * min((zone / (end - a)) ** model.w, 1.0)
        else:
            residual_K = (K_over * math.sqrt((end - a) / size) - K) / (model.shutoff - 1)
            growth = _C * (K - min(max(residual_K, 0.0), K)) ** 3
        a, count = a + growth, count + 1
    return count / (_N + 1)


def _case(name: str, run: Any, order: int, source: str) -> Case:
    return Case(name, "spectrum", source, "exact", 2, order, False, run, 2)


CASES = tuple(
    case
    for order in (1, 2)
    for case in (
        _case(f"row-blocks-{order}", partial(_blocks, order=order), order,
              f"closed form for m = 2, {_ROW}"),
        _case(f"row-wheeler-{order}",
              partial(_overloads, order=order, model=wheeler(1.0, _ZONE)), order,
              f"sum over cycles with the factor of Wheeler (1972), {_ROW}"),
        _case(f"row-willenborg-{order}",
              partial(_overloads, order=order, model=willenborg(2.5, 0.0, _ZONE)), order,
              f"sum over cycles with K less that of Willenborg (Gallagher, 1974), {_ROW}"),
    )
)  # fmt: skip


__all__ = ["CASES"]
