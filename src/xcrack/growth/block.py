"""Direction, range and rate of a block of cycles: each cycle is rated, and their growth added."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.fatigue.checks import evaluate_criterion, evaluate_law
from xcrack.fatigue.criteria import clipped_K, equivalent_K, kink_angle, nominal_range
from xcrack.fatigue.rainflow import closed_cycles
from xcrack.fatigue.spectrum import Spectrum, distinct
from xcrack.growth.levels import ladders
from xcrack.growth.options import GrowthRule
from xcrack.growth.response import Response
from xcrack.model.problem import Problem

_CHUNK = 20_000  # places times cycles that are rated at once


@dataclass(frozen=True, eq=False)
class RangePairs:
    """Kinds of cycles at the places of one crack.

    Attributes
    ----------
    K : (2, p, f, 2 or 3) array, stress √length
        At both ends of each kind of cycle.
    count : (p, f) array
        How often a block has it.
    """

    K: Floats
    count: Floats


@dataclass(frozen=True, eq=False)
class PairRates:
    """Every kind of cycle, rated at each place `(p, f)`: rad, stress √length, length/cycle."""

    angle: Floats
    dK: Floats
    R: Floats
    rate: Floats


def pairs_of(run: GrowthRule, problem: Problem, response: Response) -> list[RangePairs]:
    """Kinds of cycles of each crack under the spectrum of a run."""
    spectrum = run.cycle
    if not isinstance(spectrum, Spectrum):
        return []
    if spectrum.states is not None:
        n = range(len(response.sif[0]))
        every = [np.stack([state[c].K for state in response.sif]) for c in n]
        return [pairs_of_states(K, spectrum, problem.elasticity.poisson) for K in every]
    values, count, _ = distinct(spectrum.cycles)
    result = []
    for ladder in ladders(problem, spectrum, response):
        K = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
        result.append(RangePairs(K, np.repeat(count[:, None], K.shape[2], axis=1)))
    return result


def pairs_of_states(K: Floats, spectrum: Spectrum, nu: float) -> RangePairs:
    """Cycles between named states, counted at each place by K_eq of the state's own direction."""
    opening = clipped_K(K)
    severity = equivalent_K(opening, kink_angle(opening), nu)
    n, f = severity.shape
    count = np.zeros((n, n, f))
    for place in range(f):
        for one, other in closed_cycles(severity[spectrum.sequence, place]):
            i, j = sorted((int(spectrum.sequence[one]), int(spectrum.sequence[other])))
            count[i, j, place] += 1
    first, second = np.nonzero(count.any(axis=2))
    if not len(first):  # no place feels a difference
        first, second = np.array([0]), np.array([1])
    return RangePairs(np.stack([K[first], K[second]]), count[first, second])


def rated(
    run: GrowthRule,
    pairs: RangePairs,
    nu: float,
    c: int,
    place: str,
    a: Floats,
    nominal: RangePairs | None = None,
) -> PairRates:
    """Ask criterion and law about every kind of cycle; they see them as places of one front.

    Parameters
    ----------
    run : GrowthRule
    pairs : RangePairs
    nu : float
    c : int
        Number of the crack.
    place : str
        What a place is called in messages.
    a : (f,) array, length
        Crack size at each place.
    nominal : RangePairs, optional
        The same without contact, for a law with nominal R.
    """
    _, p, f, modes = pairs.K.shape
    parts = []
    rows = max(1, _CHUNK // max(f, 1))
    for begin in range(0, p, rows):
        K = pairs.K[:, begin : begin + rows]
        n = K.shape[1]
        angle, dK, R = evaluate_criterion(
            run.criterion, K.reshape(2, n * f, modes), nu, c, f"{place} of a cycle"
        )
        if nominal is not None:
            free = nominal.K[:, begin : begin + rows].reshape(2, n * f, modes)
            dK, R = nominal_range(free, angle, nu)
        rate = evaluate_law(run.law, dK, R, c, f"{place} of a cycle", np.tile(a, n))
        rate = np.where(dK < run.threshold, 0.0, rate)
        parts.append(np.stack([angle, dK, R, rate]).reshape(4, n, f))
    return PairRates(*np.concatenate(parts, axis=1)) if parts else PairRates(*np.zeros((4, p, f)))


def block_of(every: PairRates, count: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Direction, range, ratio and growth of a block at each place.

    Parameters
    ----------
    every : PairRates
    count : (p, f) array

    Returns
    -------
    angle, dK_eq, R, rate : (f,) arrays
        Range and ratio are those of the cycle with the largest range; the direction is the mean of
        the cycles' directions, each weighted with its growth. One cycle stays as it is.
    """
    share = np.where(count > 0, count * every.rate, 0.0)
    there = np.where(count > 0, every.dK, -1.0)
    largest, place = there.argmax(axis=0), np.arange(count.shape[1])
    dK, R, angle = (x[largest, place] for x in (every.dK, every.R, every.angle))
    rate = share.sum(axis=0)
    mean = np.isfinite(rate) & (rate > 0) & ((share > 0).sum(axis=0) > 1)
    with np.errstate(invalid="ignore"):
        x, y = (np.where(mean, (share * f(every.angle)).sum(axis=0), 1.0) for f in (np.cos, np.sin))
    return np.where(mean, np.arctan2(y, x) + 0.0, angle), dK, R, rate


def left_out_share(run: GrowthRule, problem: Problem, response: Response) -> float:
    """Growth of the cycles that a spectrum leaves out, over that of those it has; the worst place.

    inf where only they would let a place grow.
    """
    spectrum = run.cycle
    if not isinstance(spectrum, Spectrum) or spectrum.states is not None:
        return 0.0
    omitted = spectrum.left_out
    if not len(omitted) or spectrum.least_range == 0:
        return 0.0
    values, count, _ = distinct(omitted)
    nu, worst = problem.elasticity.poisson, 0.0
    every = pairs_of(run, problem, response)
    for c, ladder in enumerate(ladders(problem, spectrum, response)):
        K = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
        f = K.shape[2]
        if f == 0:
            continue
        a = np.ones(f)
        small = RangePairs(K, np.repeat(count[:, None], f, axis=1))
        growth = [
            block_of(rated(run, pairs, nu, c, "tip", a), pairs.count)[3]
            for pairs in (small, every[c])
        ]
        grows = np.nonzero(growth[0])[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = growth[0][grows] / growth[1][grows]
        worst = max(worst, float(share.max(initial=0.0)))
    return worst


__all__ = [
    "PairRates",
    "RangePairs",
    "block_of",
    "left_out_share",
    "pairs_of",
    "pairs_of_states",
    "rated",
]
