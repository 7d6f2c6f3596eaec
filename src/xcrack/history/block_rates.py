"""Ranges and ratios of all cycles of a spectrum, from K at the levels that a step has stored."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.growth.directions.checks import evaluate_criterion
from xcrack.growth.directions.criteria import Criterion
from xcrack.growth.rates.block import pairs_of_states
from xcrack.growth.rates.ladder import Ladder
from xcrack.growth.rates.uncertainty import best_known
from xcrack.growth.steps.step import Step
from xcrack.inputs import number, shown
from xcrack.spectra.spectrum import Spectrum, distinct

_NEAR = 1e-9  # relative: a stored level is the factor that a spectrum has


@dataclass(frozen=True, eq=False)
class Block:
    """What made rates of the K of a run under a spectrum, beside its law.

    Attributes
    ----------
    spectrum : Spectrum
    criterion : callable
    nu : float
    threshold : float, stress √length
        Of the run: cycles below it do not count.
    coarse : bool
        Leave every second level out, to see what the levels are worth.
    """

    spectrum: Spectrum
    criterion: Criterion
    nu: float
    threshold: float = 0.0
    coarse: bool = False

    @property
    def values(self) -> Floats:
        """Pairs of factors that differ `(p, 2)`."""
        return distinct(self.spectrum.cycles)[0]

    def is_solved(self, step: Step) -> bool:
        """Whether K of each factor was solved, or is in proportion to one that was."""
        if self.spectrum.states is not None or len(step.levels) <= 2:
            return True
        return bool(np.isin(self.values, step.levels).all())

    def cycles(self, step: Step, c: int) -> tuple[Floats, Floats, Floats]:
        """Range, ratio and count of each kind of cycle at the places of a crack, each `(p, f)`."""
        K = np.stack([state[c].K for state in best_known(step.sif)])
        if self.spectrum.states is not None:
            pairs = pairs_of_states(K, self.spectrum, self.nu)
            ends, count = pairs.K, pairs.count
        else:
            values, count, _ = distinct(self.spectrum.cycles)
            ladder = self._ladder(step, K)
            ends = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
            count = np.repeat(count[:, None], K.shape[1], axis=1)
        _, p, f, modes = ends.shape
        flat = ends.reshape(2, p * f, modes)
        _, dK, R = evaluate_criterion(self.criterion, flat, self.nu, c, "place of a cycle")
        return dK.reshape(p, f), R.reshape(p, f), count

    def _ladder(self, step: Step, K: Floats) -> Ladder:
        levels = np.array(step.levels)
        if len(levels) == 2 and levels[0] < 0 < levels[1] and not self.spectrum.steady:
            levels = np.array([levels[0], 0.0, levels[1]])
            return Ladder(levels, np.stack([K[0], np.zeros_like(K[0]), K[1]]), smooth=False)
        if self.coarse and len(levels) > 2:
            chosen = np.unique([*range(0, len(levels), 2), len(levels) - 1])
            levels, K = levels[chosen], K[chosen]
        return Ladder(levels, K, smooth=len(levels) > 2)

    def check(self, step: Step, what: str) -> None:
        """Refuse a spectrum that is not that of a step.

        Raises
        ------
        ProblemError
        """
        spectrum = self.spectrum
        if spectrum.states is not None:
            fits = not step.levels and len(spectrum.states) == len(step.sif)
        else:
            low, high = spectrum.extremes
            size = _NEAR * max(abs(low), abs(high))
            fits = bool(step.levels) and len(step.levels) == len(step.sif)
            fits = (
                fits and abs(step.levels[0] - low) <= size and abs(step.levels[-1] - high) <= size
            )
        if not fits:
            raise ProblemError(
                f"{what}: spectrum is another one than that of step {step.index}, whose load "
                f"states are {list(step.levels) or len(step.sif)}: give that of the run."
            )


def block_of_run(
    what: str,
    spectrum: Any,
    criterion: Any,
    nu: Any,
    threshold: Any = 0.0,
) -> Block | None:
    """What a caller said of the spectrum of a run, checked; None where there was none.

    Parameters
    ----------
    what : str
        Name of the function, for messages.
    spectrum, criterion, nu, threshold
        As of `Block`, or None.

    Raises
    ------
    ProblemError
        Some of them without the others, or of another type.
    """
    least = number(threshold, f"{what}: threshold", least=0)
    if spectrum is None and criterion is None and nu is None:
        if least:
            raise ProblemError(f"{what}: threshold belongs to a spectrum: give spectrum=... too.")
        return None
    if not isinstance(spectrum, Spectrum):
        raise ProblemError(f"{what}: spectrum = {shown(spectrum)}: give that of the run.")
    if not callable(criterion):
        raise ProblemError(
            f"{what}: criterion = {shown(criterion)}: give that of the run; each cycle of the "
            "spectrum is held against it again."
        )
    return Block(spectrum, criterion, number(nu, f"{what}: nu", above=-1, below=0.5), least)


__all__ = ["Block", "block_of_run"]
