"""The place that drives each step of a run: its lengths, ranges and rates before and after."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.growth.checks import evaluate_law
from xcrack.growth.cycles import cycles_between
from xcrack.growth.step import Step, memory_of, moved_places
from xcrack.laws.law import Law

_FOLLOWS = 0.01  # of an advance: a crack that turns is a little shorter than the sum of its steps
_NEAR = 0.5  # of an advance: a place that is taken for the one that it moved to


@dataclass(frozen=True, eq=False)
class Driving:
    """Places of all steps that grow, at the begin and at the end of each step.

    Attributes
    ----------
    step : (k,) array of int
        Which step a row belongs to.
    drives : (k,) array of bool
        The place with the largest rate of its step, by which cycles are counted.
    place : (k, 2) array of int
        Crack and number.
    da : (k,) array, length
    a, dK, R, rate : (k, 2) arrays
        Length that cycles are counted with (length), equivalent range (stress √length), ratio and
        growth a cycle before a threshold of the run (length/cycle), before and after the step.
    size : (k, 2) array, length
        Crack size that a law is given.
    spread : (k, 2) array
        Difference of K between two domains over K, of the state with the largest K.
    cycles : (n,) array
        Of each step.
    """

    step: Ints
    drives: Ints
    place: Ints
    da: Floats
    a: Floats
    dK: Floats
    R: Floats
    rate: Floats
    size: Floats
    spread: Floats
    cycles: Floats

    @property
    def is_one_tip(self) -> bool:
        """Whether the driving places of the steps follow each other, as those of one tip."""
        lead = self.drives
        a, da = self.a[lead], self.da[lead]
        return bool((np.abs(a[1:, 0] - a[:-1, 1]) <= _FOLLOWS * da[1:]).all())

    def rates(self, law: Law, factor: float | Floats = 1.0) -> Floats:
        """What a law says of all rows `(k, 2)`, with ranges times a factor."""
        dK, R, a = (x.ravel() for x in (self.dK * factor, self.R, self.size))
        return evaluate_law(law, dK, R, 0, "place of a step", a).reshape(self.dK.shape)


def driving(steps: Sequence[Step]) -> Driving:
    """Places that grow, of all steps but the last.

    Raises
    ------
    ProblemError
        Fewer than two steps, or steps that no run made.
    """
    if len(steps) < 2:
        raise ProblemError(f"the history has {len(steps)} steps: a life needs two, at least.")
    rows: list[tuple[float, ...]] = []
    for number, (step, after) in enumerate(zip(steps, steps[1:])):
        rows += _of_step(number, step, after)
    if not rows:
        raise ProblemError("no place of the history grows: there is no life to look at.")
    table = np.array(rows)
    number, crack, place, drives, da = table[:, :5].T
    pairs = table[:, 5:].reshape(len(table), 2, 6)
    a, dK, R, rate, size, spread = np.moveaxis(pairs, 2, 0)
    return Driving(
        step=number.astype(np.int64),
        drives=drives.astype(bool),
        place=np.stack([crack, place], axis=1).astype(np.int64),
        da=da,
        a=a,
        dK=dK,
        R=R,
        rate=rate,
        size=size,
        spread=spread,
        cycles=np.diff([step.cycles for step in steps]),
    )


def _of_step(number: int, step: Step, after: Step) -> list[tuple[float, ...]]:
    before, later = memory_of(step), memory_of(after)
    ligament = {(arrival.crack, arrival.tip): arrival.ligament for arrival in after.arrivals}
    rows = []
    for c in range(len(step.cracks)):
        da, rate = step.da[c], before.law_rate[c]
        grows = np.nonzero((da > 0) & (rate > 0))[0]
        if not len(grows):
            continue
        moved, there = moved_places(step, c), after.sif[0][c].x
        for j in grows.tolist():
            a, way = before.length[c] * float(da[j] / da.sum()), float(da[j])
            first = _values(step, c, j, a, before.length[c])
            distance, k = cKDTree(there).query(moved[j]) if len(there) else (np.inf, 0)
            if distance <= _NEAR * da[j]:
                last = _values(after, c, int(k), a + da[j], later.length[c])
            else:  # it has left the body: its rate stays what it was
                way = ligament.get((c, j), way)
                last = (a + way, *first[1:])
            rows.append((number, c, j, float(rate[j]), way, *first, *last))
    best = max((row[3] for row in rows), default=0.0)
    first_best = next((k for k, row in enumerate(rows) if row[3] == best), -1)
    return [(*row[:3], float(k == first_best), *row[4:]) for k, row in enumerate(rows)]


def _values(step: Step, c: int, j: int, a: float, length: float) -> tuple[float, ...]:
    """Length, range, ratio, rate, size and share of error of a place."""
    tips = 1 if step.cracks[c].fronts is not None else max(len(step.da[c]), 1)
    K = np.stack([state[c].K[j] for state in step.sif])
    spread = np.stack([state[c].spread[j] for state in step.sif])
    largest = int(np.argmax(np.abs(K).max(axis=1)))
    share = spread[largest].max() / max(np.abs(K[largest]).max(), np.finfo(float).tiny)
    dK, R, rate = (x[c][j] for x in (step.dK_eq, step.R, memory_of(step).law_rate))
    return float(a), float(dK), float(R), float(rate), length / tips, float(share)


def cycles_of(a: Floats, rate: Floats) -> Floats:
    """Cycles from a[..., 0] to a[..., 1]; inf where nothing grows, 0 beyond the toughness."""
    first, last = rate[..., 0], rate[..., 1]
    grows = (first > 0) & np.isfinite(first)
    safe = np.where(grows, first, 1.0)
    cycles = cycles_between(a[..., 0], a[..., 1], safe, np.where(grows, last, 1.0))
    return np.where(grows, cycles, np.where(first > 0, 0.0, np.inf))


__all__ = ["Driving", "cycles_of", "driving"]
