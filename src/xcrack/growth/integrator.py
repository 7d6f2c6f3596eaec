"""How cracks go from one step to the next: the choice of an integrator."""

from typing import Protocol

from xcrack.base.arrays import Floats
from xcrack.growth import euler, fronts, tips
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates
from xcrack.growth.stations import Identities
from xcrack.growth.step import Corrected, Plan, Step


class Integrator(Protocol):
    """What a run asks of an integrator; `euler`, `tips` and `fronts` have it."""

    def begin(self, rule: GrowthRule, rates: Rates, identities: Identities) -> Corrected:
        """The first step of a run."""

    def correct(
        self, rule: GrowthRule, step: Step, rates: Rates, identities: Identities
    ) -> Corrected:
        """What the cracks after an advance mean for the cycles and for the next advance."""

    def predict(self, rule: GrowthRule, step: Step) -> Plan:
        """What comes after a step."""

    def ends_of(self, step: Step, plan: Plan) -> Floats:
        """Where the ends of the cracks at the stations come to `(n, d)`."""

    def advance_of(self, step: Step, plan: Plan, rates: Rates) -> Floats:
        """Advance to the next step at the stations that were solved `(n,)`, length."""

    def cycles_until(
        self, rule: GrowthRule, step: Step, part: float, end_rate: float | None
    ) -> float:
        """Cycles of a part of the advance after a step, of which the whole takes `end_rate`.

        As the last solves see it, where no solve after it says what the whole takes.
        """


def integrator_of(rule: GrowthRule) -> Integrator:
    """The integrator of a run."""
    return _INTEGRATORS[rule.integrator, rule.problem.mesh.dim]


_INTEGRATORS: dict[tuple[str, int], Integrator] = {
    ("euler", 2): euler,
    ("euler", 3): euler,
    ("pec", 2): tips,
    ("pec", 3): fronts,
}

__all__ = ["Integrator", "integrator_of"]
