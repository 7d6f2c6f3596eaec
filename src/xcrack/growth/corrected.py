"""What an integrator makes of the rates that were solved."""

from dataclasses import dataclass, field

from xcrack.crack.crack import Crack
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.solves import SolveHistory
from xcrack.growth.stations import GrowthStations
from xcrack.growth.step import StepControl, StepError


@dataclass(frozen=True, eq=False)
class Corrected:
    """Where growth has come to at a solve, and what the next step goes on from.

    Attributes
    ----------
    cycles : float
        Until the corrected cracks are reached.
    cracks : tuple of Crack
        From which growth goes on.
    stations : GrowthStations
        Their ends.
    solves : SolveHistory
        At these.
    error : StepError, optional
    control : StepControl
    zones, earlier_zones : OverloadZones, optional
        What overloads have left at the stations, and at the begin of the step.
    """

    cycles: float
    cracks: tuple[Crack, ...]
    stations: GrowthStations
    solves: SolveHistory
    error: StepError | None = None
    control: StepControl = field(default_factory=StepControl)
    zones: OverloadZones | None = None
    earlier_zones: OverloadZones | None = None


__all__ = ["Corrected"]
