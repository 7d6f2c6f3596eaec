"""Cycles of a run by another law, on the path of the first."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import number, value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.checks import evaluate_criterion, evaluate_law
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import cycles_between
from xcrack.fatigue.law import Law
from xcrack.fatigue.load_program import Curve, K_over_size, LoadProgram, load_over_size
from xcrack.fatigue.spectrum import Spectrum, distinct_cycles
from xcrack.growth.levels import LevelTable
from xcrack.growth.rates import pairs_of_states
from xcrack.growth.response import best_K
from xcrack.growth.step import Step, moved_places, numbers_after

# Ranges and ratios of all cycles of a spectrum, from K at the levels that a step has stored.

_NEAR = 1e-9  # relative: a stored level is the factor that a spectrum has


@dataclass(frozen=True, eq=False)
class SpectrumBlock:
    """What made rates of the K of a run under a spectrum, beside its law.

    Attributes
    ----------
    spectrum : Spectrum
    criterion : callable
    nu : float
    threshold : float, stress √length
        Of the run: cycles below it do not count.
    is_thinned : bool
        Leave every second level out, to see what the levels are worth.
    """

    spectrum: Spectrum
    criterion: Criterion
    nu: float
    threshold: float = 0.0
    is_thinned: bool = False

    @property
    def values(self) -> Floats:
        """Pairs of factors that differ `(p, 2)`."""
        return distinct_cycles(self.spectrum.cycles)[0]

    def is_solved(self, step: Step) -> bool:
        """Whether K of each factor was solved, or is in proportion to one that was."""
        if self.spectrum.states is not None or len(step.levels) <= 2:
            return True
        return bool(np.isin(self.values, step.levels).all())

    def cycles(self, step: Step, c: int) -> tuple[Floats, Floats, Floats]:
        """Range, ratio and count of each kind of cycle at the places of a crack, each `(p, f)`."""
        K = np.stack([state[c].K for state in best_K(step.sif)])
        if self.spectrum.states is not None:
            pairs = pairs_of_states(K, self.spectrum, self.nu)
            ends, count = pairs.K, pairs.count
        else:
            values, count, _ = distinct_cycles(self.spectrum.cycles)
            ladder = self._ladder(step, K)
            ends = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
            count = np.repeat(count[:, None], K.shape[1], axis=1)
        _, p, f, modes = ends.shape
        K_of_ends = ends.reshape(2, p * f, modes)
        _, dK, R = evaluate_criterion(self.criterion, K_of_ends, self.nu, c, "place of a cycle")
        return dK.reshape(p, f), R.reshape(p, f), count

    def _ladder(self, step: Step, K: Floats) -> LevelTable:
        levels = np.array(step.levels)
        if len(levels) == 2 and levels[0] < 0 < levels[1] and not self.spectrum.steady:
            levels = np.array([levels[0], 0.0, levels[1]])
            return LevelTable(levels, np.stack([K[0], np.zeros_like(K[0]), K[1]]), is_smooth=False)
        if self.is_thinned and len(levels) > 2:
            rows = np.unique([*range(0, len(levels), 2), len(levels) - 1])
            levels, K = levels[rows], K[rows]
        return LevelTable(levels, K, is_smooth=len(levels) > 2)

    def check(self, step: Step, label: str) -> None:
        """Refuse a spectrum that is not that of a step.

        Raises
        ------
        ProblemError
        """
        spectrum = self.spectrum
        if spectrum.states is not None:
            has_levels = not step.levels and len(spectrum.states) == len(step.sif)
        else:
            min_level, max_level = spectrum.extremes
            size = _NEAR * max(abs(min_level), abs(max_level))
            has_levels = bool(step.levels) and len(step.levels) == len(step.sif)
            has_levels = (
                has_levels
                and abs(step.levels[0] - min_level) <= size
                and abs(step.levels[-1] - max_level) <= size
            )
        if not has_levels:
            raise ProblemError(
                f"{label}: spectrum is another one than that of step {step.index}, whose load "
                f"states are {list(step.levels) or len(step.sif)}: give that of the run."
            )


def block_of_run(
    label: str,
    spectrum: Any,
    criterion: Any,
    nu: Any,
    threshold: Any = 0.0,
) -> SpectrumBlock | None:
    """What a caller said of the spectrum of a run, checked; None where there was none.

    Parameters
    ----------
    label : str
        Name of the function, for messages.
    spectrum, criterion, nu, threshold
        As of `SpectrumBlock`, or None.

    Raises
    ------
    ProblemError
        Some of them without the others, or of another type.
    """
    least_range = number(threshold, f"{label}: threshold", least=0)
    if spectrum is None and criterion is None and nu is None:
        if least_range:
            raise ProblemError(f"{label}: threshold belongs to a spectrum: give spectrum=... too.")
        return None
    if not isinstance(spectrum, Spectrum):
        raise ProblemError(f"{label}: spectrum = {value_text(spectrum)}: give that of the run.")
    if not callable(criterion):
        raise ProblemError(
            f"{label}: criterion = {value_text(criterion)}: give that of the run; each cycle of "
            "the spectrum is held against it again."
        )
    return SpectrumBlock(
        spectrum, criterion, number(nu, f"{label}: nu", above=-1, below=0.5), least_range
    )


# The place that drives each step of a run: its lengths, ranges and rates before and after.

_FOLLOWS = 0.01  # of an advance: a crack that turns is a little shorter than the sum of its steps
_NEAR_ADVANCE = 0.5  # of an advance: a place that is taken for the one that it moved to


@dataclass(frozen=True, eq=False)
class DrivingForce:
    """Places of all steps that grow, at the begin and at the end of each step.

    Attributes
    ----------
    step : (k,) array of int
        Which step a row belongs to.
    is_driving : (k,) array of bool
        The place with the largest rate of its step, by which cycles are counted.
    place : (k, 2) array of int
        Crack and number.
    da : (k,) array, length
    a, rate : (k, 2) arrays
        Length that cycles are counted with (length), and growth a cycle before a threshold of the
        run (length/cycle), before and after the step.
    dK, R, count : (k, 2, p) arrays
        Equivalent range (stress √length), ratio and number of each kind of cycle, before and after
        the step: one kind, but for a spectrum that `driving_forces` is told of.
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
    is_driving: Ints
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
        lead = self.is_driving
        a, da = self.a[lead], self.da[lead]
        return bool((np.abs(a[1:, 0] - a[:-1, 1]) <= _FOLLOWS * da[1:]).all())

    @property
    def lead(self) -> "DrivingForce":
        """The driving place of each step only, and the cycles of the steps that have one."""
        names = "step is_driving place da a rate size spread dK R count".split()
        parts = {name: getattr(self, name)[self.is_driving] for name in names}
        return replace(self, **parts, cycles=self.cycles[self.step[self.is_driving]])

    def rates(self, law: Law, factor: float | Floats = 1.0) -> Floats:
        """What a law says of all rows `(..., k, 2)`, with ranges times a factor `(..., k, 2)`."""
        dK = self.dK * np.asarray(factor)[..., None]
        shape = dK.shape
        R, a = (np.broadcast_to(x, shape).ravel() for x in (self.R, self.size[..., None]))
        rate = evaluate_law(law, dK.ravel(), R, 0, "place of a step", a).reshape(shape)
        counts_here = (self.count > 0) & (dK >= self.threshold)
        with np.errstate(invalid="ignore"):  # none of a kind that breaks the body
            return np.asarray(np.where(counts_here, self.count * rate, 0.0).sum(axis=-1))


def driving_forces(steps: Sequence[Step], block: SpectrumBlock | None = None) -> DrivingForce:
    """Places that grow, of all steps but the last.

    Parameters
    ----------
    steps : sequence of Step
    block : SpectrumBlock, optional
        Of a run under a spectrum: all of its cycles then, else the largest alone.

    Raises
    ------
    ProblemError
        Fewer than two steps, steps that no run made, or a run with retardation.
    """
    if len(steps) < 2:
        raise ProblemError(f"the history has {len(steps)} steps: a life needs two, at least.")
    if not all(step.sizes for step in steps):
        raise ProblemError(
            "the history has steps without sizes of their cracks: give Step(..., sizes=...)."
        )
    first = steps[0].run
    if first is not None and first.settings.get("retardation", "None") != "None":
        raise ProblemError(
            "the history was grown with retardation: its cycles do not follow from its rates. Grow "
            "without it, and take the model along that path by retarded, or life(retardation=...)."
        )
    if first is not None and first.settings.get("load_program") == "load_over_cycles":
        raise ProblemError(
            "the history was grown under loads that change with the cycles: by other rates they "
            "come at other lengths. Grow with the other law, or give load_over_size."
        )
    rows: list[tuple[float, ...]] = []
    for n, (step, next_step) in enumerate(zip(steps, steps[1:])):
        rows += _of_step(n, step, next_step)
    if not rows:
        raise ProblemError("no place of the history grows: there is no life to look at.")
    table = np.array(rows)
    index, crack, place, is_driving, da, flags = table[:, :6].T
    pairs = table[:, 6:].reshape(len(table), 2, 6)
    a, dK, R, rate, size, spread = np.moveaxis(pairs, 2, 0)
    step, places = index.astype(np.int64), np.stack([crack, place, flags], axis=1).astype(np.int64)
    cycle = (dK[..., None], R[..., None], np.ones((*dK.shape, 1)))
    ranges, ratios, count = cycle if block is None else _of_blocks(steps, block, step, places)
    return DrivingForce(
        step=step,
        is_driving=is_driving.astype(bool),
        place=places[:, :2],
        da=da,
        a=a,
        rate=rate,
        size=size,
        spread=spread,
        dK=ranges,
        R=ratios,
        count=count,
        cycles=np.diff([s.cycles for s in steps]),
        threshold=0.0 if block is None else block.threshold,
    )


def _of_blocks(
    steps: Sequence[Step], block: SpectrumBlock, step: Ints, places: Ints
) -> tuple[Floats, Floats, Floats]:
    """Range, ratio and count of all cycles of a block at both ends of each row `(k, 2, p)`."""
    answers: dict[tuple[int, int], tuple[Floats, Floats, Floats]] = {}

    def at(n: int, c: int, j: int) -> tuple[Floats, ...]:
        if (n, c) not in answers:
            answers[n, c] = block.cycles(steps[n], c)
        return tuple(part[:, j] for part in answers[n, c])

    rows = []
    for n, (c, j, next_place) in zip(step.tolist(), places.tolist()):
        first = at(n, c, j)
        next_number = _numbers(steps[n], steps[n + 1])[c]
        rows += [first, first if next_place < 0 else at(n + 1, next_number, next_place)]
    p = max(len(row[0]) for row in rows)
    result = np.zeros((3, len(rows), p))  # kinds of cycles that a step does not have: none of them
    for k, row in enumerate(rows):
        result[:, k, : len(row[0])] = row
    dK, R, count = result.reshape(3, len(step), 2, p)
    return dK, R, count


def _numbers(step: Step, next_step: Step) -> list[int]:
    """Number that each crack of a step has in the next one."""
    return numbers_after(len(step.cracks), next_step.joins, len(next_step.cracks))


def _of_step(number: int, step: Step, next_step: Step) -> list[tuple[float, ...]]:
    ligament = {(arrival.crack, arrival.tip): arrival.ligament for arrival in next_step.arrivals}
    rows = []
    joined_cracks = {c for join in next_step.joins for c in join.cracks}
    for c, next_number in enumerate(_numbers(step, next_step)):
        da, rate = step.da[c], step.law_rate[c]
        growing_places = np.nonzero((da > 0) & (rate > 0))[0]
        if not len(growing_places):
            continue
        moved_x, next_x = moved_places(step, c), next_step.sif[0][next_number].x
        for j in growing_places.tolist():
            a, way = step.sizes[c] * float(da[j] / da.sum()), float(da[j])
            first = _values(step, c, j, a, step.sizes[c])
            distance, k = cKDTree(next_x).query(moved_x[j]) if len(next_x) else (np.inf, 0)
            if distance <= _NEAR_ADVANCE * da[j] and c not in joined_cracks:
                last_values = _values(
                    next_step, next_number, int(k), a + da[j], next_step.sizes[next_number]
                )
            else:  # it has left the body, or joined another crack: its rate stays what it was
                way = ligament.get((c, j), way)
                k, last_values = -1, (a + way, *first[1:])
            rows.append((number, c, j, float(rate[j]), way, int(k), *first, *last_values))
    best_rate = max((row[3] for row in rows), default=0.0)
    first_best = next((k for k, row in enumerate(rows) if row[3] == best_rate), -1)
    return [(*row[:3], float(k == first_best), *row[4:]) for k, row in enumerate(rows)]


def _values(step: Step, c: int, j: int, a: float, length: float) -> tuple[float, ...]:
    """Length, range, ratio, rate, size and share of error of a place."""
    tips = 1 if step.cracks[c].fronts is not None else max(len(step.da[c]), 1)
    K = np.stack([state[c].K[j] for state in step.sif])
    spread = np.stack([state[c].spread[j] for state in step.sif])
    largest_state = int(np.argmax(np.abs(K).max(axis=1)))
    share = spread[largest_state].max() / max(np.abs(K[largest_state]).max(), np.finfo(float).tiny)
    dK, R, rate = (x[c][j] for x in (step.dK_eq, step.R, step.law_rate))
    return float(a), float(dK), float(R), float(rate), length / tips, float(share)


def cycles_of(a: Floats, rate: Floats) -> Floats:
    """Cycles from a[..., 0] to a[..., 1]; inf where nothing grows, 0 beyond the toughness."""
    first, last_rate = rate[..., 0], rate[..., 1]
    is_growing = (first > 0) & np.isfinite(first)
    safe_rate = np.where(is_growing, first, 1.0)
    cycles = cycles_between(a[..., 0], a[..., 1], safe_rate, np.where(is_growing, last_rate, 1.0))
    return np.where(is_growing, cycles, np.where(first > 0, 0.0, np.inf))


_MOST = 0.05


@dataclass(frozen=True, eq=False)
class RecomputedRates:
    """Cycles of the steps of a run by another law.

    Attributes
    ----------
    cycles : (n,) array
        At each step that the law reaches.
    bound : float
        Share by which other tips would have moved another way against the driving one, the mean
        over the cycles; 0 for a single tip. The life is uncertain by no more where K of a tip
        depends on the others no more than on itself.
    ended : str
        Empty, or why the new law ends before the last step.
    factor : (n,) array
        On the loads of the run, at each step.
    """

    cycles: Floats
    bound: float
    ended: str = ""
    factor: Floats = field(default_factory=lambda: np.ones(0))

    @property
    def life(self) -> float:
        """Cycles at the last step."""
        return float(self.cycles[-1])


_SAME_RATIO = 1e-4  # spread of R along a run whose K is in proportion to its loads


def load_program_of(load: Curve | None, K_max: Curve | LoadProgram | None) -> LoadProgram | None:
    """How loads change along a path that is known: by a factor or a K over the size.

    Raises
    ------
    ProblemError
        Both are given, or what is no function.
    """
    if load is not None and K_max is not None:
        raise ProblemError("rerate: give load=..., a factor over a, or K_max=..., not both.")
    if K_max is not None:
        return K_max if isinstance(K_max, LoadProgram) else K_over_size(K_max)
    return None if load is None else load_over_size(load)


def _factors(program: LoadProgram, rows: DrivingForce) -> Floats:
    """Factor on the loads before and after each step that grows `(n, 2)`."""
    lead = rows.lead
    largest_K = np.where(lead.count > 0, lead.dK / (1.0 - lead.R), 0.0).max(axis=2)
    a = lead.size
    values = program.factors(a.ravel(), np.full(a.size, np.nan), largest_K.ravel())
    return np.broadcast_to(values, a.size).reshape(a.shape)


def check_in_proportion(steps: Sequence[Step], rows: DrivingForce, label: str) -> None:
    """Refuse a run whose K is not in proportion to its loads.

    Raises
    ------
    ProblemError
        Friction, loads that a load state does not scale, or a ratio R that changes on the way.
    """
    for solution in steps[0].solutions:
        problem = solution.problem
        steady_loads = [load.name for load in problem.loads if load.is_steady]
        if steady_loads or any(problem.frictions):
            raise ProblemError(
                f"{label}: {steady_loads[0] if steady_loads else 'friction'} does not scale with "
                "the loads, so K is not in proportion to them: grow the cracks under loads of "
                "that size."
            )
    R = rows.lead.R
    if np.ptp(R, axis=1).max(initial=0.0) > _SAME_RATIO or (
        R.shape[2] == 1 and np.ptp(R) > _SAME_RATIO
    ):
        raise ProblemError(
            f"{label}: R goes from {R.min():.4g} to {R.max():.4g} along the run: K is not in "
            "proportion to the loads. Steady loads, initial stress or contact that begins on the "
            "way do that: grow the cracks under loads of that size."
        )


def recompute_rates(
    steps: Sequence[Step],
    law: Law,
    old_law: Law | None = None,
    block: SpectrumBlock | None = None,
    program: LoadProgram | None = None,
) -> RecomputedRates:
    """Cycles of the same steps by another law.

    Parameters
    ----------
    steps : sequence of Step
    law : callable
    old_law : callable, optional
        Law of the run, to be sure that ranges and ratios of the steps are what it was given.
    block : SpectrumBlock, optional
        Of a run under a spectrum.
    program : LoadProgram, optional
        How the loads change as the crack grows.

    Raises
    ------
    ProblemError
        K that is not in proportion to loads that are to change; several tips would have shared the
        advance another way, by more than 5 %; a spectrum that is not given, or another one; a law
        with nominal R under it; the new law lets nothing grow.
    """
    for name, value in (("law", law), ("old", old_law)):
        if not (callable(value) or (name == "old" and value is None)):
            raise ProblemError(
                f"rerate: {name} = {value_text(value)} cannot be called: give a law."
            )
    check_block(steps, block, law, "rerate")
    rows = driving_forces(steps, block)
    if old_law is not None and not np.allclose(rows.rates(old_law), rows.rate, rtol=1e-6, atol=0):
        raise ProblemError("rerate: the steps have other rates than the law they are said to have.")
    first, scale = rows.is_driving, np.ones((int(rows.is_driving.sum()), 2))
    if program is None:
        rate = rows.rates(law)
    else:
        check_in_proportion(steps, rows, "rerate")
        scale = _factors(program, rows)
        rate = rows.rates(law, scale[np.searchsorted(rows.step[first], rows.step)])
    if not (rate[first][:, 0] > 0).all():
        stop = int(np.argmin(rate[first][:, 0] > 0))
        raise ProblemError(
            f"rerate: by this law the driving tip does not grow at step {stop}: the path ends "
            "there. Run it with the law to see where."
        )
    with np.errstate(invalid="ignore"):
        share = cycles_of(rows.a[first], rate[first]) / cycles_of(rows.a[first], rows.rate[first])
    new_cycles = rows.cycles[rows.step[first]] * share
    is_broken = np.isinf(rate[first]).any(axis=1)
    end = ""
    if is_broken.any():
        end_row = int(np.argmax(is_broken))
        new_cycles = new_cycles[: end_row + 1]
        end = f"the law returns inf in step {end_row}: its toughness is reached"
    bound = bound_of_shares(rows, rate[:, 0], new_cycles)
    if bound > _MOST:
        raise ProblemError(
            f"rerate: by this law the tips would have shared the advance another way, by "
            f"{bound:.1%} in the mean (more than {_MOST:.0%}): the path would differ. Run it with "
            "the law."
        )
    factor = np.concatenate([scale[:1, 0], scale[: len(new_cycles), 1]])
    return RecomputedRates(
        np.concatenate([[0.0], np.cumsum(new_cycles)]) + steps[0].cycles, bound, end, factor
    )


def check_block(
    steps: Sequence[Step], block: SpectrumBlock | None, law: Law | None, label: str
) -> None:
    """Refuse steps of a spectrum without it, with another one, or with a law that it cannot serve.

    Raises
    ------
    ProblemError
    """
    if block is None:
        if any(step.levels for step in steps):
            raise ProblemError(
                f"{label}: the run has a spectrum, of whose cycles the steps have the largest "
                "only: give spectrum=..., criterion=... and nu=... as the run had them."
            )
        return
    for step in steps:
        block.check(step, label)
    if getattr(law, "ratio", None) == "nominal":
        raise ProblemError(
            f'{label}: the law has ratio="nominal", but the steps of a spectrum have K with '
            "contact alone: run the spectrum with the law."
        )


def bound_of_shares(rows: DrivingForce, new_rates: Floats, new_cycles: Floats) -> float:
    """Mean over the cycles of the largest change of an advance over that of the driving place.

    Parameters
    ----------
    rows : DrivingForce
    new_rates : (k,) array
        Other rates before the steps.
    since : (n,) array
        Cycles by them of the steps that are reached.
    """
    old_rates, first = rows.rate[:, 0], np.unique(rows.step)
    largest_bound = np.zeros(len(new_cycles))
    for n, step in enumerate(first[: len(new_cycles)].tolist()):
        is_of_step = rows.step == step
        lead = is_of_step & rows.is_driving
        with np.errstate(invalid="ignore"):
            change = np.abs(
                (new_rates[is_of_step] / old_rates[is_of_step])
                / (new_rates[lead] / old_rates[lead])
                - 1
            )
        largest_bound[n] = np.nan_to_num(
            change * rows.da[is_of_step] / rows.da[lead], nan=0.0, posinf=1.0
        ).max()
    total = new_cycles.sum()
    return float(largest_bound @ new_cycles / total) if total else 0.0


__all__ = [
    "DrivingForce",
    "RecomputedRates",
    "SpectrumBlock",
    "block_of_run",
    "bound_of_shares",
    "check_block",
    "check_in_proportion",
    "cycles_of",
    "driving_forces",
    "load_program_of",
    "recompute_rates",
]
