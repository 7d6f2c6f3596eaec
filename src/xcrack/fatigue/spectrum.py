"""A load history as a value."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.checks import entries, number, numbers, value_text, whole_number, whole_numbers
from xcrack.base.errors import ProblemError
from xcrack.fatigue.rainflow import CYCLE, rainflow
from xcrack.model.loads import Load


@dataclass(frozen=True, eq=False)
class Spectrum:
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
        None or several of the three forms, numbers that are not finite, a history that does not
        vary, rows whose minimum is not below their maximum, states that the sequence does not
        have.

    Examples
    --------
    >>> spectrum = Spectrum([0.0, 1.0, 0.4, 0.6, -0.2], unit="flight")
    >>> print(spectrum.cycles[["min", "max"]].tolist())
    [(-0.2, 1.0), (0.4, 0.6)]
    """

    factors: Any = None
    rows: Any = None
    states: Any = None
    sequence: Any = None
    unit: str = "block"
    steady: Sequence[Load] = ()
    least_range: float = 0.0
    levels: str | int = "auto"
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        forms = [name for name in ("factors", "rows", "states") if getattr(self, name) is not None]
        if len(forms) != 1 or (self.sequence is not None) != (self.states is not None):
            raise ProblemError(
                "Spectrum: give factors, or rows=..., or states=[...] with sequence=[...], not "
                f"{' and '.join(forms) or 'nothing'}."
            )
        if not isinstance(self.unit, str) or not self.unit:
            raise ProblemError(
                f"Spectrum: unit = {value_text(self.unit)}: give a word, such as 'flight'."
            )
        least = number(self.least_range, "Spectrum: least_range", least=0)
        object.__setattr__(self, "least_range", least)
        share = number(self.tolerance, "Spectrum: tolerance", above=0, below=1)
        object.__setattr__(self, "tolerance", share)
        if not (isinstance(self.levels, str) and self.levels == "auto"):
            object.__setattr__(
                self, "levels", whole_number(self.levels, "Spectrum: levels", least=2)
            )
        steady = _loads(self.steady, "Spectrum: steady")
        object.__setattr__(self, "steady", steady)
        getattr(self, f"_check_{forms[0]}")()
        if least > 0 and not len(self.cycles):
            every = self._all_cycles
            raise ProblemError(
                f"Spectrum: least_range = {least:g} leaves out all cycles: their largest range is "
                f"{(every['max'] - every['min']).max():g}. Give less."
            )

    def _check_factors(self) -> None:
        factors = lock(np.array(numbers(self.factors, "Spectrum: factors", (None,))))
        if not len(factors) or factors.min() == factors.max():
            raise ProblemError("Spectrum: the factors do not vary: give two that differ, at least.")
        object.__setattr__(self, "factors", factors)

    def _check_rows(self) -> None:
        rows = lock(np.array(numbers(self.rows, "Spectrum: rows", (None, 3))))
        is_invalid = ~((rows[:, 0] < rows[:, 1]) & (rows[:, 2] > 0))
        if not len(rows) or is_invalid.any():
            where = (
                f"rows[{int(np.argmax(is_invalid))}] = {rows[np.argmax(is_invalid)]}"
                if len(rows)
                else "rows"
            )
            raise ProblemError(
                f"Spectrum: {where}: give (min, max, count) with min < max, count > 0."
            )
        object.__setattr__(self, "rows", rows)

    def _check_states(self) -> None:
        given = entries(self.states, "Spectrum: states")
        states = tuple(
            number(state, f"Spectrum: states[{k}]")
            if isinstance(state, Real)
            else _loads(state, f"Spectrum: states[{k}]")
            for k, state in enumerate(given)
        )
        sequence = lock(np.array(whole_numbers(self.sequence, "Spectrum: sequence", (None,))))
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
        object.__setattr__(self, "states", states)
        object.__setattr__(self, "sequence", sequence)

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
        every = self._all_cycles
        return every[every["max"] - every["min"] >= self.least_range]

    @property
    def left_out(self) -> NDArray[Any]:
        """Cycles of a block below `least_range`; columns as of `cycles`."""
        every = self._all_cycles
        return every[every["max"] - every["min"] < self.least_range]

    @property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest factor."""
        every = self._all_cycles
        return float(every["min"].min()), float(every["max"].max())

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

    def scaled(self, factor: float) -> "Spectrum":
        """The spectrum with all factors times another one.

        Parameters
        ----------
        factor : float
            Positive.
        """
        factor = number(factor, "Spectrum.scaled: factor", above=0)
        if self.states is not None:
            raise ProblemError("Spectrum.scaled: states are loads: scale them where they are made.")
        if self.rows is not None:
            rows: ArrayLike = self.rows * np.array([factor, factor, 1.0])
            return replace(self, rows=rows, least_range=self.least_range * factor)
        return replace(self, factors=self.factors * factor, least_range=self.least_range * factor)


def distinct(cycles: NDArray[Any]) -> tuple[Floats, Floats, Ints]:
    """Pairs (min, max) that differ `(p, 2)`, count of each `(p,)`, and which each cycle is."""
    pairs = np.stack([cycles["min"], cycles["max"]], axis=1)
    values, which = np.unique(pairs, axis=0, return_inverse=True)
    which = which.reshape(-1)
    count = np.bincount(which, weights=cycles["count"], minlength=len(values)).astype(float)
    return values, count, which.astype(np.int64)


def _loads(value: Any, what: str) -> tuple[Load, ...]:
    loads = entries(value, what)
    for load in loads:
        if not isinstance(load, Load):
            raise ProblemError(f"{what} has {value_text(load)}, which is not a load: see traction.")
    return loads


__all__ = ["Spectrum", "distinct"]
