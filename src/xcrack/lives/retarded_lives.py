"""Lives of samples with retardation: each sample cycle by cycle, on K that a run has stored."""

from functools import partial
from typing import Any

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.history.block_rates import Block
from xcrack.history.history import History
from xcrack.inputs import shown
from xcrack.laws.law import Law
from xcrack.laws.zones import Retardation
from xcrack.lives.retarded import CycledPath, Retarded, check
from xcrack.lives.sampling import Samples, stretch_of, varied


class RetardedLives:
    """What lives with retardation are made of.

    Parameters
    ----------
    history : History
    law : callable or None
    block : Block or None
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
        block: Block | None,
        model: Retardation,
        max_blocks: float,
    ) -> None:
        if not isinstance(model, Retardation):
            raise ProblemError(f"life: retardation = {shown(model)}: give wheeler or willenborg.")
        if block is None or law is None:
            raise ProblemError(
                "life: retardation goes cycle by cycle: give law, spectrum, criterion and nu as "
                "the run had them."
            )
        check(history, law, block.spectrum, model)
        self.path = CycledPath.of(history, block.spectrum, block.nu)
        self.law, self.model, self.limit = law, model, max_blocks
        self.unit = block.spectrum.unit

    @property
    def life(self) -> float:
        """Blocks with nothing varied."""
        return self._blocks(self.path.grown(self.law, self.model, self.limit))

    def lives(self, drawn: Samples, n: int) -> Floats:
        """Blocks of each sample `(n,)`; inf for those that do not end."""
        names = [name for name in drawn if name not in ("C", "K", "load")]
        stretch = np.broadcast_to(stretch_of(drawn), n)
        C = np.broadcast_to(drawn.get("C", np.ones(1)), n)
        N = np.empty(n)
        for k in range(n):
            law = varied(self.law, {name: float(drawn[name][k]) for name in names})
            grown = self.path.grown(_times(law, float(C[k])), self.model, self.limit, stretch[k])
            N[k] = self._blocks(grown)
        return N

    def of_K(self) -> float:
        """Largest change of the life with all K larger or smaller by their spread."""
        life, share = self.life, self.path.rows.spread.max(axis=1)
        return max(
            abs(self._blocks(self.path.grown(self.law, self.model, self.limit, 1 + s * share))
                - life) / life
            for s in (-1.0, 1.0)
        )  # fmt: skip

    def _blocks(self, grown: Retarded) -> float:
        return grown.life if grown.broken else float("inf")


def _times(law: Law, factor: float) -> Law:
    """A law times a factor; it asks for what the law asks for."""
    if factor == 1:
        return law
    result = partial(_scaled, law, factor)
    result.needs = getattr(law, "needs", ())  # type: ignore[attr-defined]
    return result


def _scaled(law: Law, factor: float, *given: Any, **named: Any) -> Floats:
    return np.asarray(factor * law(*given, **named))


__all__ = ["RetardedLives"]
