"""Growth cycle by cycle along the path of a run, with what overloads leave behind."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import number, value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.checks import law_exponent
from xcrack.fatigue.criteria import clipped_K, equivalent_K
from xcrack.fatigue.law import Law
from xcrack.fatigue.retardation import (
    POINTS,
    BlockCycles,
    Retardation,
    cycle_rates,
    march,
    no_zones,
)
from xcrack.fatigue.spectrum import Spectrum, distinct_cycles
from xcrack.growth.levels import LevelTable
from xcrack.growth.response import best_K
from xcrack.growth.step import Step
from xcrack.runs.history import History
from xcrack.runs.rerating import DrivingForce, SpectrumBlock, driving_forces
from xcrack.runs.scatter import Samples, stretch_of, varied_law

_BREAKS = "the law returns inf: the toughness is reached"
_STANDS = "a whole block lets nothing grow"
_ROUND_OFF = 1e-9  # relative


@dataclass(frozen=True, eq=False)
class Retarded:
    """Growth of one tip, cycle by cycle.

    Attributes
    ----------
    a : (n,) array, length
        At the steps of the run that are reached, and where growth ends.
    blocks : (n,) array
        Blocks of cycles until then.
    ended : str
        Empty where the crack reaches the last step; else why it does not.
    """

    a: Floats
    blocks: Floats
    ended: str = ""

    @property
    def life(self) -> float:
        """Blocks at the end."""
        return float(self.blocks[-1])

    @property
    def is_broken(self) -> bool:
        """Whether the crack comes to its end: the last step, or the toughness."""
        return self.ended in ("", _BREAKS)


def retarded(
    history: History,
    law: Law,
    spectrum: Spectrum,
    model: Retardation | None,
    *,
    nu: float,
    max_blocks: float = 1e6,
) -> Retarded:
    """Life of one tip under a spectrum, cycle by cycle, with retardation after overloads.

    Along the path of a run of the same spectrum, whose K at the levels of each step is linear in
    the length between two steps. The path itself is that of growth without retardation: with one
    tip that is the same one.

    Parameters
    ----------
    history : History
        Of `spectrum`, with one tip that grows.
    law : callable
        For K as computed with contact.
    spectrum : Spectrum
        Of factors, in time.
    model : wheeler or willenborg, or None
        None: cycle by cycle without retardation, to compare with.
    nu : float
        Poisson's ratio, for K_eq.
    max_blocks : float
        Blocks after which to stop.

    Returns
    -------
    Retarded

    Raises
    ------
    ProblemError
        A history of something else or with several tips, rows without an order, a law with nominal
        R: zones and reductions belong to the K that acts.

    Notes
    -----
    Each cycle sits where its maximum occurs. The law is asked at both ends of each step for each
    kind of cycle, for Willenborg also at 257 values of the reduction of K.
    """
    check(history, law, spectrum, model)
    limit = number(max_blocks, "retarded: max_blocks", above=0)
    nu = number(nu, "retarded: nu", above=-1, below=0.5)
    return CycledPath.of(history, spectrum, nu).grown_by(law, model, limit)


@dataclass(frozen=True, eq=False)
class CycledPath:
    """Path of one tip, with the kinds of cycles of a block at its solves.

    Attributes
    ----------
    rows : DrivingForce
    a, size : (n + 1,) arrays, length
        Length that cycles are counted with, and crack size that a law is given, at the solves.
    K : (n + 1, p, 2) array, stress √length
        Of each kind of cycle, at its minimum and its maximum.
    order : (c,) array of int
        Kinds of the cycles of a block, in time.
    threshold : float, stress √length
        Of the run: cycles below it let nothing grow.
    """

    rows: DrivingForce
    a: Floats
    size: Floats
    K: Floats
    order: Ints
    threshold: float = 0.0

    @classmethod
    def of(
        cls, history: History, spectrum: Spectrum, nu: float, threshold: float = 0.0
    ) -> "CycledPath":
        """Path of a run.

        Raises
        ------
        ProblemError
            Several tips grow.
        """
        rows = driving_forces(history.steps)
        if len(np.unique(rows.step)) < len(rows.step) or not rows.is_one_tip:
            raise ProblemError(
                "retarded: several tips grow in this history: retardation along a stored path is "
                "for one tip, whose path does not depend on its rate."
            )
        values, _, order = distinct_cycles(spectrum.cycles)
        ends = [
            _ends(rows, row, (history.steps[n], history.steps[n + 1]), values, spectrum, nu)
            for row, n in enumerate(rows.step.tolist())
        ]
        a, size = (np.append(column[:, 0], column[-1:, 1]) for column in (rows.a, rows.size))
        K = np.stack([ends[0][0], *(pair[1] for pair in ends)])
        return cls(rows, a, size, K, order, threshold)

    def grown_by(
        self, law: Law, model: Retardation | None, limit: float, factor: float | Floats = 1.0
    ) -> Retarded:
        """Growth cycle by cycle, with K times a factor, of each step where it is an array."""
        factors = np.broadcast_to(factor, len(self.a) - 1)
        a, blocks, zones = [float(self.a[0])], [0.0], no_zones(1)
        for row, (begin, end) in enumerate(zip(self.a[:-1].tolist(), self.a[1:].tolist())):
            solves, cycles = self._solves(row, law, float(factors[row]))
            if not len(solves):
                return Retarded(np.array([*a, begin]), np.array([*blocks, blocks[-1]]), _BREAKS)
            integration = march(
                law,
                model,
                self.order,
                cycles,
                np.log(self.a[solves])[:, None],
                np.log(np.linspace(begin, end, POINTS))[:, None],
                zones,
                end - begin,
                exponent=law_exponent(law, cycles.dK[0, 0], cycles.R[0, 0]),
                threshold=self.threshold,
                blocks=limit - blocks[-1],
            )
            zones = integration.zones
            a.append(begin + integration.grown_length)
            blocks.append(blocks[-1] + float(integration.cycles[-1]))
            if integration.grown_length < (end - begin) * (1 - _ROUND_OFF):
                is_at_limit = blocks[-1] >= limit * (1 - _ROUND_OFF)
                why_ended = f"max_blocks = {limit:.6g} reached" if is_at_limit else _STANDS
                return Retarded(np.array(a), np.array(blocks), why_ended)
        return Retarded(np.array(a), np.array(blocks))

    def _solves(self, row: int, law: Law, factor: float) -> tuple[Ints, BlockCycles]:
        """Solves that lead through a step: both ends and the one before; none if the law is inf."""
        first = max(row - 1, 0)
        solves = np.arange(first, min(first + 3, len(self.a)))
        cycles = self._cycles(solves, factor)
        rates = cycle_rates(law, cycles, np.zeros(1), 0.0)
        is_finite: Bools = np.array([np.isfinite(rate).all() for rate in rates])
        if not is_finite[np.isin(solves, (row, row + 1))].all():
            solves = solves[:0]
        return solves[is_finite[: len(solves)]], cycles.rows(is_finite)

    def _cycles(self, solves: Ints, factor: float) -> BlockCycles:
        K_min, K_max = np.moveaxis(self.K[solves] * factor, -1, 0)
        R = np.divide(K_min, K_max, out=np.zeros_like(K_max), where=K_max > 0)
        return BlockCycles((K_max - K_min)[:, None], R[:, None], self.size[solves][:, None])


def check(history: object, law: object, spectrum: object, model: object) -> None:
    """Refuse what cannot be taken cycle by cycle.

    Raises
    ------
    ProblemError
    """
    if not isinstance(history, History):
        raise ProblemError(f"retarded: history = {value_text(history)}: give a History.")
    if not callable(law):
        raise ProblemError(f"retarded: law = {value_text(law)} cannot be called: give a law.")
    if not isinstance(spectrum, Spectrum) or spectrum.factors is None:
        raise ProblemError(
            f"retarded: spectrum = {value_text(spectrum)}: give Spectrum(factors): rows and states "
            f"have no order in time."
        )
    if not (model is None or isinstance(model, Retardation)):
        raise ProblemError(f"retarded: model = {value_text(model)}: give wheeler or willenborg.")
    if getattr(law, "ratio", None) == "nominal":
        raise ProblemError(
            'retarded: the law has ratio="nominal", but zones and reductions belong to K with '
            'contact: give a law for it, with ratio="contact".'
        )
    if not all(step.levels for step in history.steps):
        raise ProblemError("retarded: the history was not made with a Spectrum of factors.")


def _ends(
    rows: DrivingForce,
    row: int,
    ends: tuple[Step, Step],
    values: Floats,
    spectrum: Spectrum,
    nu: float,
) -> Floats:
    """K_eq of both ends of each kind of cycle, before and after a step `(2, p, 2)`."""
    c, j = rows.place[row].tolist()
    last_c, last_j = rows.place[min(row + 1, len(rows.step) - 1)].tolist()
    places = ((c, j), (last_c, last_j))
    result: list[Floats] = []
    for step, (crack, place) in zip(ends, places):
        if place >= len(step.angle[crack]):  # it has left the body: K stays what it was
            result.append(result[-1])
            continue
        levels = np.array(step.levels)
        K = np.stack([state[crack].K[place] for state in best_K(step.sif)])[:, None]
        if len(levels) == 2 and levels[0] < 0 < levels[1] and not spectrum.steady:
            levels = np.array([levels[0], 0.0, levels[1]])
            K = np.stack([K[0], np.zeros_like(K[0]), K[1]])
        ladder = LevelTable(levels, K, is_smooth=len(levels) > 3)
        angle = step.angle[crack][place]
        K_at_ends = [
            equivalent_K(clipped_K(ladder.at(values[:, k])), angle, nu)[:, 0] for k in (0, 1)
        ]
        result.append(np.stack([np.minimum(*K_at_ends), np.maximum(*K_at_ends)], axis=1))
    return np.stack(result)


# Lives of samples with retardation: each sample cycle by cycle, on K that a run has stored.


class RetardedLives:
    """What lives with retardation are made of.

    Parameters
    ----------
    history : History
    law : callable or None
    block : SpectrumBlock or None
        Of the run.
    model : wheeler or willenborg
    max_blocks : float
        Samples that are longer do not end.

    Raises
    ------
    ProblemError
        Parts that are not given, several tips.
    """

    def __init__(
        self,
        history: History,
        law: Law | None,
        block: SpectrumBlock | None,
        model: Retardation,
        max_blocks: float,
    ) -> None:
        if not isinstance(model, Retardation):
            raise ProblemError(
                f"life: retardation = {value_text(model)}: give wheeler or willenborg."
            )
        if block is None or law is None:
            raise ProblemError(
                "life: retardation goes cycle by cycle: give law, spectrum, criterion and nu as "
                "the run had them."
            )
        check(history, law, block.spectrum, model)
        self.path = CycledPath.of(history, block.spectrum, block.nu, block.threshold)
        self.law, self.model, self.limit = law, model, max_blocks
        self.unit = block.spectrum.unit

    @property
    def life(self) -> float:
        """Blocks with nothing varied."""
        return self._blocks(self.path.grown_by(self.law, self.model, self.limit))

    def lives(self, samples: Samples, n: int) -> Floats:
        """Blocks of each sample `(n,)`; inf for those that do not end."""
        names = [name for name in samples if name not in ("C", "K", "load")]
        stretch = np.broadcast_to(stretch_of(samples), n)
        C = np.broadcast_to(samples.get("C", np.ones(1)), n)
        N = np.empty(n)
        for k in range(n):
            law = varied_law(self.law, {name: float(samples[name][k]) for name in names})
            path = self.path.grown_by(_times(law, float(C[k])), self.model, self.limit, stretch[k])
            N[k] = self._blocks(path)
        return N

    def of_K(self) -> float:
        """Largest change of the life with all K larger or smaller by their spread."""
        life, share = self.life, self.path.rows.spread.max(axis=1)
        return max(
            abs(self._blocks(self.path.grown_by(self.law, self.model, self.limit, 1 + s * share))
                - life) / life
            for s in (-1.0, 1.0)
        )  # fmt: skip

    def _blocks(self, path: Retarded) -> float:
        return path.life if path.is_broken else float("inf")


def _times(law: Law, factor: float) -> Law:
    """A law times a factor; it asks for what the law asks for."""
    if factor == 1:
        return law
    result = partial(_scaled_K, law, factor)
    result.needs = getattr(law, "needs", ())  # type: ignore[attr-defined]
    return result


def _scaled_K(law: Law, factor: float, *ranges: Any, **constants: Any) -> Floats:
    return np.asarray(factor * law(*ranges, **constants))


__all__ = ["CycledPath", "Retarded", "RetardedLives", "check", "retarded"]
