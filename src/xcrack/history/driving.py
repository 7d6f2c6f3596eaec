"""The place that drives each step of a run: its lengths, ranges and rates before and after."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.growth.directions.checks import evaluate_law
from xcrack.growth.steps.joins import numbers_after
from xcrack.growth.steps.step import Step, memory_of, moved_places
from xcrack.growth.tracking.cycles import cycles_between
from xcrack.history.block_rates import Block
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
    a, rate : (k, 2) arrays
        Length that cycles are counted with (length), and growth a cycle before a threshold of the
        run (length/cycle), before and after the step.
    dK, R, count : (k, 2, p) arrays
        Equivalent range (stress √length), ratio and number of each kind of cycle, before and after
        the step: one kind, but for a spectrum that `driving` is told of.
    size : (k, 2) array, length
        Crack size that a law is given.
    spread : (k, 2) array
        Difference of K between two domains over K, of the state with the largest K.
    cycles : (n,) array
        Of each step.
    threshold : float, stress √length
        Ranges of a spectrum below it do not count.
    """

    step: Ints
    drives: Ints
    place: Ints
    da: Floats
    a: Floats
    rate: Floats
    size: Floats
    spread: Floats
    dK: Floats
    R: Floats
    count: Floats
    cycles: Floats
    threshold: float = 0.0

    @property
    def is_one_tip(self) -> bool:
        """Whether the driving places of the steps follow each other, as those of one tip."""
        lead = self.drives
        a, da = self.a[lead], self.da[lead]
        return bool((np.abs(a[1:, 0] - a[:-1, 1]) <= _FOLLOWS * da[1:]).all())

    @property
    def lead(self) -> "Driving":
        """The driving place of each step only, and the cycles of the steps that have one."""
        names = ("step", "drives", "place", "da", "a", "rate", "size", "spread", "dK", "R", "count")
        parts = {name: getattr(self, name)[self.drives] for name in names}
        return replace(self, **parts, cycles=self.cycles[self.step[self.drives]])

    def rates(self, law: Law, factor: float | Floats = 1.0) -> Floats:
        """What a law says of all rows `(..., k, 2)`, with ranges times a factor `(..., k, 2)`."""
        dK = self.dK * np.asarray(factor)[..., None]
        shape = dK.shape
        R, a = (np.broadcast_to(x, shape).ravel() for x in (self.R, self.size[..., None]))
        rate = evaluate_law(law, dK.ravel(), R, 0, "place of a step", a).reshape(shape)
        there = (self.count > 0) & (dK >= self.threshold)
        with np.errstate(invalid="ignore"):  # none of a kind that breaks the body
            return np.asarray(np.where(there, self.count * rate, 0.0).sum(axis=-1))


def driving(steps: Sequence[Step], block: Block | None = None) -> Driving:
    """Places that grow, of all steps but the last.

    Parameters
    ----------
    steps : sequence of Step
    block : Block, optional
        Of a run under a spectrum: all of its cycles then, else the largest alone.

    Raises
    ------
    ProblemError
        Fewer than two steps, steps that no run made, or a run with retardation.
    """
    if len(steps) < 2:
        raise ProblemError(f"the history has {len(steps)} steps: a life needs two, at least.")
    if any(key.startswith("retardation") for key in memory_of(steps[0]).settings):
        raise ProblemError(
            "the history was grown with retardation: its cycles do not follow from its rates. Grow "
            "without it, and take the model along that path by retarded, or life(retardation=...)."
        )
    rows: list[tuple[float, ...]] = []
    for number, (step, after) in enumerate(zip(steps, steps[1:])):
        rows += _of_step(number, step, after)
    if not rows:
        raise ProblemError("no place of the history grows: there is no life to look at.")
    table = np.array(rows)
    number, crack, place, drives, da, there = table[:, :6].T
    pairs = table[:, 6:].reshape(len(table), 2, 6)
    a, dK, R, rate, size, spread = np.moveaxis(pairs, 2, 0)
    step, where = number.astype(np.int64), np.stack([crack, place, there], axis=1).astype(np.int64)
    one = (dK[..., None], R[..., None], np.ones((*dK.shape, 1)))
    ranges, ratios, count = one if block is None else _of_blocks(steps, block, step, where)
    return Driving(
        step=step,
        drives=drives.astype(bool),
        place=where[:, :2],
        da=da,
        a=a,
        rate=rate,
        size=size,
        spread=spread,
        dK=ranges,
        R=ratios,
        count=count,
        cycles=np.diff([each.cycles for each in steps]),
        threshold=0.0 if block is None else block.threshold,
    )


def _of_blocks(
    steps: Sequence[Step], block: Block, step: Ints, where: Ints
) -> tuple[Floats, Floats, Floats]:
    """Range, ratio and count of all cycles of a block at both ends of each row `(k, 2, p)`."""
    answers: dict[tuple[int, int], tuple[Floats, Floats, Floats]] = {}

    def at(n: int, c: int, j: int) -> tuple[Floats, ...]:
        if (n, c) not in answers:
            answers[n, c] = block.cycles(steps[n], c)
        return tuple(part[:, j] for part in answers[n, c])

    rows = []
    for n, (c, j, there) in zip(step.tolist(), where.tolist()):
        first = at(n, c, j)
        now = _numbers(steps[n], steps[n + 1])[c]
        rows += [first, first if there < 0 else at(n + 1, now, there)]
    p = max(len(row[0]) for row in rows)
    result = np.zeros((3, len(rows), p))  # kinds of cycles that a step does not have: none of them
    for k, row in enumerate(rows):
        result[:, k, : len(row[0])] = row
    dK, R, count = result.reshape(3, len(step), 2, p)
    return dK, R, count


def _numbers(step: Step, after: Step) -> list[int]:
    """Number that each crack of a step has in the next one."""
    return numbers_after(len(step.cracks), after.joins, len(after.cracks))


def _of_step(number: int, step: Step, after: Step) -> list[tuple[float, ...]]:
    before, later = memory_of(step), memory_of(after)
    ligament = {(arrival.crack, arrival.tip): arrival.ligament for arrival in after.arrivals}
    rows = []
    joined = {c for join in after.joins for c in join.cracks}
    for c, now in enumerate(_numbers(step, after)):
        da, rate = step.da[c], before.law_rate[c]
        grows = np.nonzero((da > 0) & (rate > 0))[0]
        if not len(grows):
            continue
        moved, there = moved_places(step, c), after.sif[0][now].x
        for j in grows.tolist():
            a, way = before.length[c] * float(da[j] / da.sum()), float(da[j])
            first = _values(step, c, j, a, before.length[c])
            distance, k = cKDTree(there).query(moved[j]) if len(there) else (np.inf, 0)
            if distance <= _NEAR * da[j] and c not in joined:
                last = _values(after, now, int(k), a + da[j], later.length[now])
            else:  # it has left the body, or joined another crack: its rate stays what it was
                way = ligament.get((c, j), way)
                k, last = -1, (a + way, *first[1:])
            rows.append((number, c, j, float(rate[j]), way, int(k), *first, *last))
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
