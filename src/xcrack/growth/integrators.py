"""How cracks go from one step to the next: the choice of an integrator."""

from typing import Protocol

from xcrack.crack.crack import Crack
from xcrack.growth import euler, pec_2d, pec_3d
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Evaluation, Settled
from xcrack.growth.step import Advance, Step


class Integrator(Protocol):
    """What a run asks of an integrator; `euler`, `pec_2d` and `pec_3d` have it."""

    def begun(self, run: GrowthRule, seen: Evaluation) -> Settled:
        """The first step of a run."""

    def settled(self, run: GrowthRule, last: Step, seen: Evaluation) -> Settled:
        """What the cracks after an advance mean for the cycles and for the next advance."""

    def planned(self, run: GrowthRule, step: Step) -> Advance:
        """The advance after a step."""

    def advanced(self, run: GrowthRule, step: Step) -> list[Crack]:
        """The cracks after the advance of a step."""

    def cycles_to(self, run: GrowthRule, step: Step, share: float, after: float | None) -> float:
        """Cycles of a share of the advance after a step, of which the whole takes `after`.

        As the last solves see it, where no solve after it says what the whole takes.
        """


def integrator_of(run: GrowthRule) -> Integrator:
    """The integrator of a run."""
    return _INTEGRATORS[run.integrator, run.problem.mesh.dim]


_INTEGRATORS: dict[tuple[str, int], Integrator] = {
    ("euler", 2): euler,
    ("euler", 3): euler,
    ("pec", 2): pec_2d,
    ("pec", 3): pec_3d,
}

__all__ = ["Integrator", "integrator_of"]
