"""Numerical error bar of a life: by the length of the steps, by K, and by contact."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.growth.step import Step

_NUMBER = re.compile(r"\d+(\.\d+)?")


@dataclass(frozen=True, eq=False)
class LifeBar:
    """Numerical error of a life, by source, in cycles; nan where it was not estimated.

    It knows nothing of wrong loads, of scatter, and of a body that is not linear elastic.

    Attributes
    ----------
    life : float
        Cycles at the last step.
    steps : float
        By the length of the steps.
    K : float
        By K within its error bars, without what contact has in them.
    contact : float
        By contact: its end, and the zero of K_I at closed tips.
    unknown : float
        Cycles that passed at rates of which K has no bar.
    path : float, length
        How far the last tips may be astray, by the steps and by K.
    best, places : int
        Places of all steps that grew by the best K, and all of them; the others grew by K as the
        integrals gave it.
    reasons : tuple of str
        Why there is no bar, each once.
    """

    life: float
    steps: float
    K: float
    contact: float
    unknown: float
    path: float
    best: int
    places: int
    reasons: tuple[str, ...]

    @property
    def total(self) -> float:
        """Half-width of the error of the life: the sum of all sources."""
        return self.steps + self.K + self.contact + self.unknown

    @property
    def relative(self) -> float:
        """`total` over the life; nan where that is zero."""
        return self.total / self.life if self.life > 0 else float("nan")

    def __str__(self) -> str:
        if np.isnan(self.K):
            steps = "not estimated" if np.isnan(self.steps) else f"{self.steps:.2g}"
            return (
                f"{self.life:.6g} cycles; error by the steps {steps}, by K not estimated: "
                "grow(..., tolerance=) does"
            )
        parts = f"steps {self.steps:.2g}, K {self.K:.2g}, contact {self.contact:.2g}"
        if self.unknown > 0:
            parts += f", at rates without a bar {self.unknown:.2g}"
        share = f" ({self.relative:.1e})" if self.life > 0 else ""
        text = f"{self.life:.6g} ± {self.total:.2g} cycles{share}: {parts}; "
        text += f"best K at {self.best} of {self.places} places"
        return text + (f", K elsewhere: {'; '.join(self.reasons)}" if self.reasons else "")


def life_bar(steps: Sequence[Step]) -> LifeBar:
    """Error bar of the life of a run."""
    nan = float("nan")
    sifs = [sif for step in steps for sif in (step.sif[0] if step.sif else ())]
    states = [state for step in steps for state in zip(*step.sif)]
    best_flags = [np.all([sif.has_best for sif in crack], axis=0) for crack in states]
    best = sum(int(np.count_nonzero(flags_of_crack)) for flags_of_crack in best_flags)
    places = sum(len(sif.K) for sif in sifs)
    texts = [
        reason for step in steps for state in step.sif for sif in state
        if sif.errors is not None for reason in sif.reasons if reason
    ]  # fmt: skip
    # One of each kind: they may differ in their numbers alone.
    reasons = {_NUMBER.sub("#", reason): reason for reason in reversed(texts)}
    last_step = steps[-1] if steps else None
    error = None if last_step is None else last_step.error
    if last_step is None or error is None:
        life = 0.0 if last_step is None else last_step.cycles
        return LifeBar(life, nan, nan, nan, nan, nan, best, places, ())
    return LifeBar(
        last_step.cycles,
        error.cycles,
        error.K,
        error.contact,
        error.unknown,
        error.path,
        best,
        places,
        tuple(reversed(reasons.values())),
    )


__all__ = ["LifeBar", "life_bar"]
