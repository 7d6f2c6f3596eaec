"""Tips in 2D that become one crack: what a scene may say of cracks that lose their numbers."""

from collections.abc import Sequence

import numpy as np

from xcrack.base.arrays import Floats, at
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Step
from xcrack.mesh.polygon import closest_on_segment

# Where cracks have met between one step and the next: the polylines alone tell.

_SAME = 1e-9  # of the extent of the cracks: an end lies on another crack


def ends_on_others(cracks: Sequence[Crack]) -> list[tuple[int, int, Floats]]:
    """Ends of placed cracks on others in 2D: crack, the other one, place `(2,)`."""
    if len(cracks) < 2 or any(crack.tips is None for crack in cracks):
        return []
    reach = _SAME * float(np.ptp(np.concatenate([crack.points for crack in cracks]), axis=0).max())
    result = []
    for c, crack in enumerate(cracks):
        for end in (0, len(crack.points) - 1):
            if end in (crack.tips or ()):
                continue
            x = crack.points[end]
            for on, other in enumerate(cracks):
                line = other.points
                if on == c or np.linalg.norm(line[[0, -1]] - x, axis=1).min() <= reach:
                    continue
                foot = closest_on_segment(x, line[:-1], line[1:])
                if np.linalg.norm(foot - x, axis=1).min() <= reach:
                    result.append((c, on, x))
                    break
    return result


def new_ends(before: Sequence[Crack], after: Sequence[Crack]) -> list[tuple[int, int, Floats]]:
    """Ends on others that were not there before."""
    known = {tuple(x.tolist()) for _, _, x in ends_on_others(before)}
    return [own for own in ends_on_others(after) if tuple(own[2].tolist()) not in known]


def new_unions(
    before: Sequence[Crack], after: Sequence[Crack]
) -> list[tuple[tuple[int, int], Floats]]:
    """Points at which two tips have become one crack; none in 3D.

    Returns
    -------
    list of (numbers of the cracks before, the smaller one first, place (2,))
    """
    if len(after) >= len(before) or any(crack.tips is None for crack in after):
        return []
    owner = {tuple(x): c for c, crack in enumerate(before) for x in crack.points.tolist()}
    result = []
    for crack in after:
        of_point = [owner.get(tuple(x), -1) for x in crack.points.tolist()]
        for k in range(1, len(of_point) - 1):
            if of_point[k] >= 0:
                continue
            left = next((c for c in of_point[k::-1] if c >= 0), -1)
            right = next((c for c in of_point[k:] if c >= 0), -1)
            if left != right and min(left, right) >= 0:
                result.append(((min(left, right), max(left, right)), crack.points[k]))
    return result


def joined(run: GrowthRule, last: Step, cracks: Sequence[Crack]) -> None:
    """Nothing is left to be joined: the advance has done that, if the scene allows it.

    Parameters
    ----------
    run : GrowthRule
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


def named_by_number(run: GrowthRule) -> str:
    """Why cracks cannot become one: a load names one by its number; empty where none does."""
    states = [state for state in run.cycle.load_states if isinstance(state, list | tuple)]
    loads = [*run.problem.loads, *(load for state in states for load in state)]
    if any(load.is_of_one_crack for load in loads):
        return (
            "a load names a crack by its number, which is another one's after they have joined: "
            "give it without crack."
        )
    return ""


__all__ = ["ends_on_others", "joined", "named_by_number", "new_ends", "new_unions"]
