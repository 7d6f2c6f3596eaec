"""What adaptation returns: the last mesh and its solutions, and how it came about."""

from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF


@dataclass(frozen=True, eq=False)
class AdaptationPass:
    """One mesh of an adaptation.

    Attributes
    ----------
    cells, unknowns : int
    best : (k, 2) array, stress · √length
        Best K of all states, cracks and tips, one after the other; states at rest are left out.
    bar : (k, 2) array, stress · √length
        Half-widths of their errors; nan where there is no estimate.
    scale : float, stress · √length
        What they are compared with: the largest best K, or where that is next to nothing a
        ten-thousandth of K by the mean energy of the body.
    seconds : float
        Time of the round, its refinement included.
    """

    cells: int
    unknowns: int
    best: Floats
    bar: Floats
    scale: float
    seconds: float

    @property
    def error(self) -> float:
        """Largest half-width over `scale`; nan where one of them is missing."""
        return float(self.bar.max(initial=0.0) / self.scale) if self.scale > 0 else float("nan")


@dataclass(frozen=True, eq=False)
class Adaptation:
    """A scene on the mesh that a tolerance asked for; printing it gives the table of its rounds.

    Attributes
    ----------
    problem : Problem
        The scene on the last mesh.
    solutions : tuple of Solution
        One a load state.
    sifs : tuple of tuple of SIF
        K of each state and crack, with `best` and `bar`.
    tolerance : float
        Wanted error of K at every tip, relative to the largest K.
    met : bool
        Whether the bars are within it.
    reason : str
        Why it is not met; empty where it is.
    rounds : tuple of AdaptationPass
    """

    problem: Problem
    solutions: tuple[Solution, ...]
    sifs: tuple[tuple[SIF, ...], ...]
    tolerance: float
    met: bool
    reason: str
    rounds: tuple[AdaptationPass, ...]

    @property
    def solution(self) -> Solution:
        """The solution of the only state.

        Raises
        ------
        ProblemError
            There are several: `solutions`.
        """
        if len(self.solutions) != 1:
            raise ProblemError(
                f"there are {len(self.solutions)} load states: take .solutions and .sifs."
            )
        return self.solutions[0]

    @property
    def sif(self) -> SIF:
        """K of the only crack in the only state.

        Raises
        ------
        ProblemError
            There are several: `sifs`.
        """
        if len(self.sifs) != 1 or len(self.sifs[0]) != 1:
            raise ProblemError(
                f"there are {len(self.sifs)} load states and {len(self.sifs[0])} cracks: take "
                ".sifs[state][crack]."
            )
        return self.sifs[0][0]

    def __str__(self) -> str:
        lines = [f"{'round':>5} {'cells':>8} {'unknowns':>9} {'largest best K':>15} "
                 f"{'error':>8} {'seconds':>8}"]  # fmt: skip
        for k, row in enumerate(self.rounds):
            largest_K = row.best.flat[np.argmax(np.abs(row.best))] if row.best.size else np.nan
            lines.append(
                f"{k:>5} {row.cells:>8} {row.unknowns:>9} {largest_K:>15.7g} {row.error:>8.1e} "
                f"{row.seconds:>8.2f}"
            )
        end = "met" if self.met else f"not met: {self.reason}"
        return "\n".join([*lines, f"tolerance {self.tolerance:g} of the largest K: {end}"])


__all__ = ["Adaptation", "AdaptationPass"]
