"""When to look, and what the chance is that all looks miss."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Declared, Function, Number, Text, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, number, numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH
from xcrack.growth.step import Step, numbers_after
from xcrack.runs.history import History
from xcrack.runs.rerating import DrivingForce, cycles_of, driving_forces
from xcrack.runs.table import crack_numbers

_MOST_LOOKS = 1000
_ADVANCE = "advance"  # the length that cycles are counted with
_FALLS = 1e-6  # share by which a measure may fall in a step: round-off of clipped faces


@dataclass(frozen=True)
class logistic_pod(Declared):  # noqa: N801 - it is used as a function
    """Probability of detection as a logistic function of the logarithm of the length.

    Parameters
    ----------
    a50 : float, length
        Found in half of all looks.
    s : float
        Width: a90 = a50 exp(s ln 9).

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

    a50: Annotated[float, Number(above=0, unit=LENGTH)]
    s: Annotated[float, Number(above=0)]

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
    measure : str
        What its length is, as of `growth_curve`.
    """

    first: float
    interval: float
    at: Floats
    a: Floats
    missed: float | None
    measure: str = _ADVANCE


@dataclass(frozen=True, eq=False)
class GrowthCurve:
    """Length of a crack over cycles, by the power law of each step.

    Attributes
    ----------
    N, a : (n,) arrays
        Cycles and length (length) at the steps; where it does not grow it stays what it is.
    rate : (n - 1, 2) array, length/cycle
        At both ends of each step.
    measure : str
        What the length is, as of `growth_curve`.
    """

    N: Floats
    a: Floats
    rate: Floats
    measure: str = _ADVANCE

    def cycles_at(self, a: float) -> float:
        """Cycles up to which the crack has a length; those of the nearer end outside."""
        a = number(a, "GrowthCurve.cycles_at: a", least=0)
        i = int(np.clip(np.searchsorted(self.a, a, side="right") - 1, 0, len(self.a) - 2))
        a = float(np.clip(a, self.a[i], self.a[i + 1]))
        step = np.array([self.a[i], self.a[i + 1]])
        if step[0] == step[1]:
            return float(self.N[i + 1])
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
        a_begin, a_end = self.a[i], self.a[i + 1]
        if a_begin == a_end:
            return float(a_begin)
        return float(brentq(lambda a: self.cycles_at(a) - N, a_begin, a_end, xtol=1e-13 * a_end))


def growth_curve(
    history: History, *, measure: str | None = None, crack: int | None = None
) -> GrowthCurve:
    """Length of a crack over cycles, of one tip or as an engineer measures it.

    Parameters
    ----------
    history : History
        With its mesh where the measure is another one than the length of a 2D crack.
    measure : str, optional
        "advance": the length that cycles are counted with, of the one tip that drives a 2D run; of
        a crack that grows evenly at two tips, half. "length" of a 2D crack within the body;
        "root_area" of a 3D one, the root of its area; or a column of `History.measures`: "depth",
        "length_<set>" and "depth_<set>" of a facet set, "front_length". If omitted, "root_area" in
        3D; in 2D "advance" where one tip drives, else "length".
    crack : int, optional
        Number in the first step; it is followed through joins. If omitted, the crack that leads at
        the end, and before each join the longer one of those that joined: of several cracks
        (multiple-site damage) that is one curve. In 2D it jumps where they join, at the end of the
        step; in 3D the join rises over its step.

    Returns
    -------
    GrowthCurve

    Raises
    ------
    ProblemError
        "advance" of a run in which another tip drives from some step on; no such measure or crack;
        a measure that falls, or that the crack does not have at some step; no mesh.

    Notes
    -----
    Within a step a measure grows in proportion to the advance of the place that drives, with its
    rates at both ends; of a run with retardation, evenly in cycles.
    """
    if not isinstance(history, History):
        raise ProblemError(f"growth_curve: history = {value_text(history)}: give a History.")
    if measure is not None and not isinstance(measure, str):
        raise ProblemError(f"growth_curve: measure = {value_text(measure)}: give {_MEASURES}.")
    is_plane = history.steps[0].cracks[0].dim == 2
    if measure is None and not is_plane:
        measure = "root_area"
    if measure not in (None, _ADVANCE):
        return _measured_curve(history, measure, crack)
    rows = driving_forces(history.steps)
    if crack is not None or not rows.is_one_tip:
        if measure is None:
            return _measured_curve(history, "length", crack)
        raise ProblemError(
            'growth_curve: measure = "advance" is of the one tip that drives a run, and '
            f"{'more than one does' if crack is None else 'a crack is named'}: give {_MEASURES}."
        )
    lead = rows.is_driving
    a, step = rows.a[lead], rows.step[lead]
    N = np.concatenate([[0.0], np.cumsum(rows.cycles[step])]) + history.steps[0].cycles
    return GrowthCurve(N, np.concatenate([a[:, 0], a[-1:, 1]]), _bounded_rates(rows.rate[lead]))


_MEASURES = (
    'measure="length" in 2D, "root_area" in 3D, or a column of History.measures, such as "depth"'
)


def _bounded_rates(rate: Floats) -> Floats:
    """Rates of steps; where the last one has no power law: a steep one, over the same cycles."""
    if np.isinf(rate[-1, 1]):
        rate = rate.copy()
        rate[-1, 1] = 3 * rate[-1, 0]
    return rate


def _measured_curve(history: History, measure: str, crack: int | None) -> GrowthCurve:
    """The curve of one crack by a measure of it."""
    steps = history.steps
    if len(steps) < 2:
        raise ProblemError("growth_curve: the history has one step: a curve needs two.")
    values = _measures_of(history, steps, measure)
    line = _line_of(steps, values, crack)
    a = np.array([of[c] for of, c in zip(values, line, strict=True)])
    N = np.array([step.cycles for step in steps])
    is_unknown = ~(np.isfinite(a) & (a > 0))
    if is_unknown.any():
        index = steps[int(np.argmax(is_unknown))].index
        raise ProblemError(
            f"growth_curve: the crack has no {measure!r} at step {index}: give {_MEASURES}."
        )
    falls = a[1:] < a[:-1] * (1 - _FALLS)
    if falls.any():
        n = int(np.argmax(falls))
        raise ProblemError(
            f"growth_curve: {measure!r} falls from {a[n]:.6g} to {a[n + 1]:.6g} after step "
            f"{steps[n].index}: a curve rises. Give another measure, or the part of the history in "
            "which it rises, History(history.steps[:n], ended='', mesh=history.mesh)."
        )
    a = np.maximum.accumulate(a)
    growth, cycles = np.diff(a), np.diff(N)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.repeat((growth / cycles)[:, None], 2, axis=1)
    if _settings(steps).get("retardation", "None") == "None":
        lead: DrivingForce = driving_forces(history.steps).lead
        for n, ends, advance in zip(lead.step, _bounded_rates(lead.rate), np.diff(lead.a).ravel()):
            if n < len(rate) and advance > 0:
                rate[n] = ends * growth[n] / advance
    if measure == "length":
        N, a, rate = _with_jumps(steps, line, N, a, rate)
    return GrowthCurve(N, a, rate, measure)


def _with_jumps(
    steps: Sequence[Step], line: Sequence[int], N: Floats, a: Floats, rate: Floats
) -> tuple[Floats, Floats, Floats]:
    """A 2D curve that goes on by its own advance up to a join, and rises there at once."""
    for n in range(len(steps) - 2, -1, -1):
        c = line[n]
        if not any(c in join.cracks for join in steps[n + 1].joins):
            continue
        size_before_join = min(float(a[n] + steps[n].da[c].sum()), float(a[n + 1]))
        share = (size_before_join - a[n]) / (a[n + 1] - a[n]) if a[n + 1] > a[n] else 1.0
        N, a = np.insert(N, n + 1, N[n + 1]), np.insert(a, n + 1, size_before_join)
        rate = np.insert(rate, n + 1, 1.0, axis=0)
        rate[n] *= share
    return N, a, rate


def _settings(steps: Sequence[Step]) -> Any:
    return {} if steps[0].run is None else steps[0].run.settings


def _measures_of(history: History, steps: Sequence[Step], measure: str) -> list[list[float]]:
    """The measure of each crack of each step."""
    is_plane = steps[0].cracks[0].dim == 2
    if is_plane and measure == "length":
        if not all(step.sizes for step in steps):
            raise ProblemError(
                "growth_curve: the history has steps without sizes of their cracks: give "
                "Step(..., sizes=...)."
            )
        return [list(step.sizes) for step in steps]
    table, _ = history.measures()
    names = [n for n in table.dtype.names or () if n.startswith(("depth", "length_"))]
    if is_plane:
        measure_names = ["length", *(n for n in names if n.startswith("depth"))]
    else:
        measure_names = ["root_area", "front_length", *names]
    if measure not in measure_names:
        raise ProblemError(
            f"growth_curve: measure = {value_text(measure)}: the run has "
            f"{', '.join(measure_names)}."
        )
    column = np.sqrt(table["area"]) if measure == "root_area" else table[measure]
    return [column[table["step"] == step.index].tolist() for step in steps]


def _line_of(
    steps: Sequence[Step], values: Sequence[Sequence[float]], crack: int | None
) -> list[int]:
    """Number of a crack at each step: the one that is named, or back from the one that leads."""
    pairs = list(zip(steps, steps[1:], strict=False))
    numbers_of_pairs = [numbers_after(len(a.cracks), b.joins, len(b.cracks)) for a, b in pairs]
    if crack is not None:
        first = crack_numbers(steps[0])
        if isinstance(crack, bool) or crack not in first:
            raise ProblemError(
                f"growth_curve: crack = {value_text(crack)}: give the number of one that the run "
                f"begins with: {', '.join(map(str, first))}."
            )
        line = [first.index(crack)]
        for numbers_there in numbers_of_pairs:
            line.append(numbers_there[line[-1]])
        return line
    last_row = max(n for n, step in enumerate(steps) if n == 0 or not step.has_left)
    rate = [float(of_crack.max(initial=0)) for of_crack in steps[last_row].law_rate]
    line = [max(range(len(rate)), key=lambda c: (rate[c], _length_or_zero(values[last_row][c])))]
    for numbers_there, sizes in zip(
        numbers_of_pairs[:last_row][::-1], values[:last_row][::-1], strict=True
    ):
        joined_cracks = [c for c, number in enumerate(numbers_there) if number == line[0]]
        line.insert(0, max(joined_cracks, key=lambda c: _length_or_zero(sizes[c])))
    for numbers_there in numbers_of_pairs[last_row:]:
        line.append(numbers_there[line[-1]])
    return line


def _length_or_zero(value: float) -> float:
    """A length to compare with; none is the least of all."""
    return value if np.isfinite(value) else -np.inf


@check_arguments()
def inspection(
    curve: GrowthCurve | History,
    *,
    a_detect: Annotated[float | None, Number(above=0, unit=LENGTH)] = None,
    factor: Annotated[float, Number(least=1)] = 2.0,
    a_critical: Annotated[float | None, Number(above=0, unit=LENGTH)] = None,
    interval: Annotated[float | None, Number(above=0)] = None,
    pod: Annotated[Callable[[float], Any] | None, Function("logistic_pod")] = None,
    measure: Annotated[str | None, Text("a measure, as of growth_curve")] = None,
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
    measure : str, optional
        Of a history: what all these lengths are, as of `growth_curve`.

    Returns
    -------
    Inspection

    Raises
    ------
    ProblemError
        Neither or both of a_detect and interval, lengths outside of the curve, a measure of what
        is a curve already; as of `growth_curve`.
    """
    if isinstance(curve, History):
        curve = growth_curve(curve, measure=measure)
    elif measure is not None:
        raise ProblemError("inspection: measure belongs to a history: a curve has its own.")
    if not isinstance(curve, GrowthCurve):
        raise ProblemError(f"inspection: curve = {value_text(curve)}: give a History.")
    if (a_detect is None) == (interval is None):
        raise ProblemError("inspection: give a_detect or interval, and not both.")
    a0, a1 = float(curve.a[0]), float(curve.a[-1])
    end = a1 if a_critical is None else number(a_critical, "inspection: a_critical", above=a0)
    if end > a1 * (1 + 1e-12):
        raise ProblemError(
            f"inspection: a_critical = {end:.6g} is beyond the last length of the run, {a1:.6g}: "
            "give at most that."
        )
    begin, stop = float(curve.N[0]), curve.cycles_at(end)
    if a_detect is not None:
        if not a0 <= a_detect < end:
            raise ProblemError(
                f"inspection: a_detect = {a_detect:.6g} is no length of the run: give one "
                f"from {a0:.6g} to below {end:.6g}."
            )
        step = (stop - curve.cycles_at(a_detect)) / factor
        first = begin + (stop - begin) / 2
    else:
        assert interval is not None  # one of the two
        step = interval
        first = begin + step
    if (stop - first) / step > _MOST_LOOKS:
        raise ProblemError(
            f"inspection: {step:.6g} cycles between looks are {(stop - first) / step:.3g} looks: "
            "give a longer interval."
        )
    at = np.arange(first, stop, step)
    a = np.array([curve.length_at(N) for N in at])
    probability_missed = (
        None
        if pod is None
        else float(np.prod([1 - _detection_probability(pod, length) for length in a]))
    )
    return Inspection(first, step, at, a, probability_missed, curve.measure)


def _detection_probability(pod: Any, a: float) -> float:
    """Probability of detection of a length, by a function of the user's."""
    answer = call_function(pod, f"the probability of detection at a = {a:.6g}", a)
    return number(answer, "inspection: what pod returned", least=0, most=1)


__all__ = ["GrowthCurve", "Inspection", "growth_curve", "inspection", "logistic_pod"]
