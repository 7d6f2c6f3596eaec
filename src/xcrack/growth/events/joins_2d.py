"""Tips in 2D that become one crack: what a scene may say of cracks that lose their numbers."""

from collections.abc import Sequence

from xcrack.arrays import at
from xcrack.crack.crack import Crack
from xcrack.errors import GeometryError
from xcrack.growth.events.unions import new_unions
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Step
from xcrack.scene.conditions import CrackPressure


def joined(run: Run, last: Step, cracks: Sequence[Crack]) -> None:
    """Nothing is left to be joined: the advance has done that, if the scene allows it.

    Parameters
    ----------
    run : Run
    last : Step
    cracks : sequence of Crack
        After the advance.

    Raises
    ------
    GeometryError
        Two cracks have become one, and loads or friction belong to a number.
    """
    unions = new_unions(last.corrected, cracks)
    if not unions:
        return
    hindrance = named_by_number(run)
    if not hindrance and isinstance(run.problem.friction, Sequence):
        hindrance = "friction differs between them: give one number for all cracks."
    if hindrance:
        (i, k), x = unions[0]
        raise GeometryError(f"cracks {i} and {k} meet near {at(x)}, and {hindrance}")


def named_by_number(run: Run) -> str:
    """Why cracks cannot become one: a load names one by its number; empty where none does."""
    states = [state for state in run.cycle.load_states if isinstance(state, list | tuple)]
    loads = [*run.problem.loads, *(load for state in states for load in state)]
    if any(isinstance(load, CrackPressure) and load.crack is not None for load in loads):
        return (
            "a load names a crack by its number, which is another one's after they have joined: "
            "give crack_pressure without crack."
        )
    return ""


__all__ = ["joined", "named_by_number"]
