"""A load history as a value, and its cycles by rainflow."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from xcrack.base.arguments import (
    Array,
    CheckedBy,
    Choice,
    Declared,
    Either,
    Number,
    Text,
    Whole,
    check_arguments,
)
from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import entries, number, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.model.loads import Load

CYCLE = np.dtype([("min", float), ("max", float), ("count", float), ("at", np.int64)])


def turning_points(values: Floats) -> Ints:
    """Numbers of the points at which a history turns, as it is repeated `(n,)`.

    Parameters
    ----------
    values : (n,) array

    Returns
    -------
    (k,) array of int
        In order; of equal neighbours the first. Empty where nothing varies.
    """
    is_turning = np.nonzero(values != np.roll(values, 1))[0]
    x = values[is_turning]
    turns = (x > np.roll(x, 1)) != (np.roll(x, -1) > x)  # neighbours differ
    return np.asarray(is_turning[turns], dtype=np.int64)


def closed_cycles(values: Floats) -> list[tuple[int, int]]:
    """Pairs of points that make a cycle when a history is repeated.

    Parameters
    ----------
    values : (n,) array

    Returns
    -------
    list of (int, int)
        Numbers of the two turning points of each cycle, in the order in which they close.

    Notes
    -----
    ASTM E1049-85, 5.4.5, simplified rainflow for repeating histories: begun at the largest peak,
    all cycles are whole.
    """
    points = turning_points(values)
    if not len(points):
        return []
    begin = int(np.argmax(values[points]))
    order = [*points[begin:].tolist(), *points[: begin + 1].tolist()]
    x = values.tolist()
    stack: list[int] = []
    pairs: list[tuple[int, int]] = []
    for point in order:
        stack.append(point)
        while len(stack) >= 3:
            first_value, second_value, third_value = x[stack[-3]], x[stack[-2]], x[stack[-1]]
            if abs(third_value - second_value) < abs(second_value - first_value):
                break
            pairs.append((stack[-3], stack[-2]))
            del stack[-3:-1]
    return pairs


@check_arguments()
def rainflow(values: Annotated[ArrayLike, Array((None,))]) -> NDArray[Any]:
    """Cycles of a history that is repeated, with exact ranges.

    Parameters
    ----------
    values : (n,) array
        At least two that differ; points between turning points do not matter.

    Returns
    -------
    (k,) structured array
        Columns min, max, count (1: no halves are left when a history is repeated) and at, the
        number of the value that is the maximum; ordered by it.

    Raises
    ------
    ProblemError
        Nothing varies.

    Notes
    -----
    ASTM E1049-85, 5.4.5. `rainflow` of a history that is not repeated (5.4.4) would leave halves,
    which growth by blocks has no use for.

    Examples
    --------
    >>> print(rainflow([-2, 1, -3, 5, -1, 3, -4, 4, -2])[["min", "max"]].tolist())
    [(-2.0, 1.0), (-4.0, 5.0), (-1.0, 3.0), (-3.0, 4.0)]
    """
    history = np.asarray(values)
    pairs = closed_cycles(history)
    if not pairs:
        raise ProblemError("rainflow: the values do not vary: give two that differ, at least.")
    cycles = np.zeros(len(pairs), dtype=CYCLE)
    ends = history[np.array(pairs)]
    cycles["min"], cycles["max"], cycles["count"] = ends.min(axis=1), ends.max(axis=1), 1.0
    cycles["at"] = np.array(pairs)[np.arange(len(pairs)), ends.argmax(axis=1)]
    return cycles[np.argsort(cycles["at"], kind="stable")]


BlockName = Annotated[str, Text("a word, such as 'flight'")]


def checked_loads(value: Any, label: str, error: type[XcrackError]) -> tuple[Load, ...]:
    """Loads as a tuple, checked."""
    loads = entries(value, label, error=error)
    for load in loads:
        if not isinstance(load, Load):
            raise error(f"{label} has {value_text(load)}, which is not a load: see traction.")
    return loads


def named_states(value: Any, label: str, error: type[XcrackError]) -> tuple[Any, ...]:
    """Load states, checked: a factor or loads each."""
    return tuple(
        number(state, f"{label}[{k}]", error=error)
        if isinstance(state, Real)
        else checked_loads(state, f"{label}[{k}]", error)
        for k, state in enumerate(entries(value, label, error=error))
    )


@dataclass(frozen=True, eq=False)
class Spectrum(Declared):
    """A load history that is repeated until a run ends.

    Give `factors` for one factor on the loads of the problem, `rows` for cycles that were counted
    already, or `states` with `sequence` for events that name load states.

    Parameters
    ----------
    factors : (n,) array, optional
        Factor on all loads, in time; points between turning points do not matter.
    rows : (n, 3) array, optional
        Smallest and largest factor, and number, of each kind of cycle in a block.
    states : sequence of load states, optional
        Each a factor or a list of loads, as of `Cycle`. At each tip K_eq of a state in its own
        direction decides what is a cycle; two states of equal K_eq and opposite shear are none.
    sequence : (n,) array of int, optional
        Numbers of the states, in time.
    unit : str
        What one repetition is called in reports: "flight", "day".
    steady : sequence of loads
        Loads that the factors do not scale: dead weight, a press fit. Imposed displacements of the
        supports count as steady then.
    least_range : float
        Cycles of the factor with a smaller range are left out.
    levels : "auto" or int
        Factors for which K is solved. "auto": the two extremes where that is exact (no steady load
        and no initial stress, or no contact), else as many as `tolerance` asks for. An int:
        that many, evenly spaced.
    tolerance : float
        Of K between two levels, as a share of the largest K.

    Raises
    ------
    ProblemError
        None or several of the three forms, a history that does not vary, rows whose minimum is not
        below their maximum, states that the sequence does not have.

    Examples
    --------
    >>> spectrum = Spectrum([0.0, 1.0, 0.4, 0.6, -0.2], unit="flight")
    >>> print(spectrum.cycles[["min", "max"]].tolist())
    [(-0.2, 1.0), (0.4, 0.6)]
    """

    factors: Annotated[Any, Array((None,))] = None
    rows: Annotated[Any, Array((None, 3))] = None
    states: Annotated[Any, CheckedBy(named_states)] = None
    sequence: Annotated[Any, Array((None,), is_whole=True)] = None
    unit: BlockName = "block"
    steady: Annotated[Sequence[Load], CheckedBy(checked_loads)] = ()
    least_range: Annotated[float, Number(least=0)] = 0.0
    levels: Annotated[str | int, Either(Choice(("auto",)), Whole(least=2))] = "auto"
    tolerance: Annotated[float, Number(above=0, below=1)] = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        forms = [name for name in ("factors", "rows", "states") if getattr(self, name) is not None]
        if len(forms) != 1 or (self.sequence is not None) != (self.states is not None):
            raise ProblemError(
                "Spectrum: give factors, or rows=..., or states=[...] with sequence=[...], not "
                f"{' and '.join(forms) or 'nothing'}."
            )
        getattr(self, f"_check_{forms[0]}")()
        if self.least_range > 0 and not len(self.cycles):
            cycles = self._all_cycles
            raise ProblemError(
                f"Spectrum: least_range = {self.least_range:g} leaves out all cycles: their "
                f"largest range is {(cycles['max'] - cycles['min']).max():g}. Give less."
            )

    def _check_factors(self) -> None:
        if not len(self.factors) or self.factors.min() == self.factors.max():
            raise ProblemError("Spectrum: the factors do not vary: give two that differ, at least.")

    def _check_rows(self) -> None:
        rows = self.rows
        is_invalid = ~((rows[:, 0] < rows[:, 1]) & (rows[:, 2] > 0))
        if not len(rows) or is_invalid.any():
            location = (
                f"rows[{int(np.argmax(is_invalid))}] = {rows[np.argmax(is_invalid)]}"
                if len(rows)
                else "rows"
            )
            raise ProblemError(
                f"Spectrum: {location}: give (min, max, count) with min < max, count > 0."
            )

    def _check_states(self) -> None:
        states, sequence = self.states, self.sequence
        if not len(states) or not len(sequence) or len(np.unique(sequence)) < 2:
            raise ProblemError(
                "Spectrum: the sequence does not vary: it needs two states, at least."
            )
        if sequence.min() < 0 or sequence.max() >= len(states):
            raise ProblemError(
                f"Spectrum: sequence from {sequence.min()} to {sequence.max()}: there are "
                f"{len(states)} states, numbered from 0."
            )
        if self.least_range or self.steady:
            raise ProblemError("Spectrum: least_range and steady belong to factors, not to states.")

    @cached_property
    def _all_cycles(self) -> NDArray[Any]:
        """All cycles of a block, those that are left out included."""
        if self.states is not None:
            raise ProblemError(
                "Spectrum: cycles of states depend on K at each tip: a run counts them."
            )
        if self.rows is None:
            return rainflow(self.factors)
        cycles = np.zeros(len(self.rows), dtype=CYCLE)
        for column, name in enumerate(("min", "max", "count")):
            cycles[name] = self.rows[:, column]
        cycles["at"] = np.arange(len(cycles))
        return cycles

    @property
    def cycles(self) -> NDArray[Any]:
        """Cycles of a block that are not left out.

        Returns
        -------
        (k,) structured array
            Columns min, max, count, and at: which point of the history the maximum is.
        """
        cycles = self._all_cycles
        return cycles[cycles["max"] - cycles["min"] >= self.least_range]

    @property
    def left_out(self) -> NDArray[Any]:
        """Cycles of a block below `least_range`; columns as of `cycles`."""
        cycles = self._all_cycles
        return cycles[cycles["max"] - cycles["min"] < self.least_range]

    @property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest factor."""
        cycles = self._all_cycles
        return float(cycles["min"].min()), float(cycles["max"].max())

    @property
    def ratio(self) -> float | None:
        """Smallest R = min / max of all cycles with max > 0.

        None where that is no ratio of forces: with named states, or steady loads.
        """
        if self.states is not None or self.steady:
            return None
        cycles = self.cycles[self.cycles["max"] > 0]
        return float((cycles["min"] / cycles["max"]).min()) if len(cycles) else None

    @property
    def load_states(self) -> tuple[Any, ...]:
        """The states as `solve` takes them: those with a name, or the two extreme factors."""
        return self.extremes if self.states is None else tuple(self.states)

    def omit(self, range: float) -> "Spectrum":
        """The spectrum without small cycles.

        Parameters
        ----------
        range : float
            Cycles of the factor with a smaller range are left out; a run says how much of the
            growth that is.

        Raises
        ------
        ProblemError
            No cycle is left.

        Examples
        --------
        >>> len(Spectrum([0.0, 1.0, 0.4, 0.6]).omit(range=0.3).cycles)
        1
        """
        return replace(self, least_range=range)

    @check_arguments()
    def scaled(self, factor: Annotated[float, Number(above=0)]) -> "Spectrum":
        """The spectrum with all factors times another one.

        Parameters
        ----------
        factor : float
        """
        if self.states is not None:
            raise ProblemError("Spectrum.scaled: states are loads: scale them where they are made.")
        if self.rows is not None:
            rows: ArrayLike = self.rows * np.array([factor, factor, 1.0])
            return replace(self, rows=rows, least_range=self.least_range * factor)
        return replace(self, factors=self.factors * factor, least_range=self.least_range * factor)


def distinct_cycles(cycles: NDArray[Any]) -> tuple[Floats, Floats, Ints]:
    """Pairs (min, max) that differ `(p, 2)`, count of each `(p,)`, and which each cycle is."""
    pairs = np.stack([cycles["min"], cycles["max"]], axis=1)
    values, number = np.unique(pairs, axis=0, return_inverse=True)
    number = number.reshape(-1)
    count = np.bincount(number, weights=cycles["count"], minlength=len(values)).astype(float)
    return values, count, number.astype(np.int64)


__all__ = [
    "CYCLE",
    "BlockName",
    "Spectrum",
    "closed_cycles",
    "distinct_cycles",
    "rainflow",
    "turning_points",
]
