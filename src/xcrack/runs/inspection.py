"""When to look, and what the chance is that all looks miss."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, number, numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.runs.history import History
from xcrack.runs.rerating import cycles_of, driving_forces

_MOST_LOOKS = 1000


@dataclass(frozen=True)
class logistic_pod:  # noqa: N801 - it is used as a function
    """Probability of detection as a logistic function of the logarithm of the length.

    Parameters
    ----------
    a50 : float, length
        Found in half of all looks; positive.
    s : float
        Width, positive: a90 = a50 exp(s ln 9).

    Raises
    ------
    ProblemError
        A value that is not positive.

    Notes
    -----
    POD = 1 / (1 + exp(-(ln a - ln a50) / s)): Berens (1989), Metals Handbook 17; MIL-HDBK-1823.

    Examples
    --------
    >>> print(logistic_pod(a50=2.0, s=0.4)(4.816449).round(6))
    0.9
    """

    a50: float
    s: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "a50", number(self.a50, "logistic_pod: a50", above=0))
        object.__setattr__(self, "s", number(self.s, "logistic_pod: s", above=0))

    def __call__(self, a: ArrayLike) -> Floats:
        """Share of the looks that find a crack of the length a."""
        from scipy.special import expit

        sizes = numbers(a, "logistic_pod: a")
        if (sizes < 0).any():
            raise ProblemError(f"logistic_pod: a = {sizes.min():.6g}: give lengths of at least 0.")
        with np.errstate(divide="ignore"):
            return np.asarray(expit((np.log(sizes) - np.log(self.a50)) / self.s))[()]


@dataclass(frozen=True, eq=False)
class Inspection:
    """Looks at a growing crack.

    Attributes
    ----------
    first : float
        Cycles until the first look.
    interval : float
        Cycles between two.
    at : (k,) array
        Cycles of all looks before the end.
    a : (k,) array, length
        Length of the crack at each.
    missed : float, optional
        Chance that all of them miss the crack, where a probability of detection was given.
    """

    first: float
    interval: float
    at: Floats
    a: Floats
    missed: float | None


@dataclass(frozen=True, eq=False)
class GrowthCurve:
    """Length of the crack that drives a run over cycles, by the power law of each step.

    Attributes
    ----------
    N, a : (n,) arrays
        Cycles and length (length) at the steps.
    rate : (n - 1, 2) array, length/cycle
        At both ends of each step.
    """

    N: Floats
    a: Floats
    rate: Floats

    def cycles_at(self, a: float) -> float:
        """Cycles at which the crack has a length; those of the nearer end outside."""
        a = number(a, "GrowthCurve.cycles_at: a", least=0)
        i = int(np.clip(np.searchsorted(self.a, a, side="right") - 1, 0, len(self.a) - 2))
        a = float(np.clip(a, self.a[i], self.a[i + 1]))
        step = np.array([self.a[i], self.a[i + 1]])
        begin, end = self.rate[i]
        power = np.log(end / begin) / np.log(step[1] / step[0])
        cycles_there = begin * (a / step[0]) ** power if np.isfinite(power) else begin
        part = float(cycles_of(np.array([step[0], a]), np.array([begin, cycles_there])))
        all_of_it = float(cycles_of(step, self.rate[i]))
        return float(self.N[i] + part / all_of_it * (self.N[i + 1] - self.N[i]))

    def length_at(self, N: float) -> float:
        """Length of the crack after some cycles; that of the nearer end outside."""
        from scipy.optimize import brentq

        N = number(N, "GrowthCurve.length_at: N", least=0)
        if N <= self.N[0]:
            return float(self.a[0])
        if N >= self.N[-1]:
            return float(self.a[-1])
        i = int(np.searchsorted(self.N, N, side="right") - 1)
        low, high = self.a[i], self.a[i + 1]
        return float(brentq(lambda a: self.cycles_at(a) - N, low, high, xtol=1e-13 * high))


def growth_curve(history: History) -> GrowthCurve:
    """Length over cycles of the one tip that drives a run.

    Parameters
    ----------
    history : History

    Returns
    -------
    GrowthCurve
        Of lengths as cycles are counted with: of a crack that grows evenly at two tips, half.

    Raises
    ------
    ProblemError
        Another tip drives from some step on: there is no one curve.
    """
    if not isinstance(history, History):
        raise ProblemError(f"growth_curve: history = {value_text(history)}: give a History.")
    rows = driving_forces(history.steps)
    lead = rows.drives
    a, rate, step = rows.a[lead], rows.rate[lead], rows.step[lead]
    if not rows.is_one_tip:
        raise ProblemError(
            "growth_curve: more than one tip drives the run: give the part of the history in which "
            "one does, History(history.steps[:n], ended='')."
        )
    if np.isinf(rate[-1, 1]):  # no power law ends there: one that is steep, over the same cycles
        rate = rate.copy()
        rate[-1, 1] = 3 * rate[-1, 0]
    N = np.concatenate([[0.0], np.cumsum(rows.cycles[step])]) + history.steps[0].cycles
    return GrowthCurve(N, np.concatenate([a[:, 0], a[-1:, 1]]), rate)


def inspection(
    curve: GrowthCurve | History,
    *,
    a_detect: float | None = None,
    factor: float = 2.0,
    a_critical: float | None = None,
    interval: float | None = None,
    pod: logistic_pod | None = None,
) -> Inspection:
    """Thresholds and intervals of inspection from a growth curve.

    Parameters
    ----------
    curve : GrowthCurve or History
    a_detect : float, length, optional
        Length that a look finds for sure; gives the interval.
    factor : float
        Looks between detectable and critical; 2 is usual, 3 for a single load path. The first look
        is at the life over 2.
    a_critical : float, length, optional
        That of the last step, if omitted.
    interval : float, optional
        Cycles between looks instead; the first is after one interval.
    pod : callable a -> probability, optional
        Gives the chance that all looks miss.

    Returns
    -------
    Inspection

    Raises
    ------
    ProblemError
        Neither or both of a_detect and interval, lengths outside of the curve.
    """
    if isinstance(curve, History):
        curve = growth_curve(curve)
    if not isinstance(curve, GrowthCurve):
        raise ProblemError(f"inspection: curve = {value_text(curve)}: give a History.")
    if (a_detect is None) == (interval is None):
        raise ProblemError("inspection: give a_detect or interval, and not both.")
    low, high = float(curve.a[0]), float(curve.a[-1])
    end = high if a_critical is None else number(a_critical, "inspection: a_critical", above=low)
    if end > high * (1 + 1e-12):
        raise ProblemError(
            f"inspection: a_critical = {end:.6g} is beyond the last length of the run, {high:.6g}: "
            "give at most that."
        )
    begin, last = float(curve.N[0]), curve.cycles_at(end)
    if a_detect is not None:
        detected_length = number(a_detect, "inspection: a_detect", above=0)
        if not low <= detected_length < end:
            raise ProblemError(
                f"inspection: a_detect = {detected_length:.6g} is no length of the run: give one "
                f"from {low:.6g} to {end:.6g}."
            )
        share = number(factor, "inspection: factor", least=1)
        every = (last - curve.cycles_at(detected_length)) / share
        first = begin + (last - begin) / 2
    else:
        every = number(interval, "inspection: interval", above=0)
        first = begin + every
    if (last - first) / every > _MOST_LOOKS:
        raise ProblemError(
            f"inspection: {every:.6g} cycles between looks are {(last - first) / every:.3g} looks: "
            "give a longer interval."
        )
    at = np.arange(first, last, every)
    if pod is not None and not callable(pod):
        raise ProblemError(f"inspection: pod = {value_text(pod)}: give logistic_pod.")
    a = np.array([curve.length_at(N) for N in at])
    missed = (
        None
        if pod is None
        else float(np.prod([1 - _detection_probability(pod, each) for each in a]))
    )
    return Inspection(first, every, at, a, missed)


def _detection_probability(pod: Any, a: float) -> float:
    """Probability of detection of a length, by a function of the user's."""
    answer = call_function(pod, f"the probability of detection at a = {a:.6g}", a)
    return number(answer, "inspection: what pod returned", least=0, most=1)


__all__ = ["GrowthCurve", "Inspection", "growth_curve", "inspection", "logistic_pod"]
