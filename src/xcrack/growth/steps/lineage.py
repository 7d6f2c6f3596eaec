"""Which cracks of the steps of a run are one crack, over the joins between them."""

from collections.abc import Sequence

from xcrack.growth.steps.joins import numbers_after
from xcrack.growth.steps.step import Step


def lineage(steps: Sequence[Step], crack: int) -> list[list[int]]:
    """Numbers in each step of a crack, and of all cracks that it joins in the end.

    Parameters
    ----------
    steps : sequence of Step
    crack : int
        Number in the first step.

    Returns
    -------
    list of list of int
    """
    number = [
        numbers_after(len(one.cracks), other.joins, len(other.cracks))
        for one, other in zip(steps, steps[1:])
    ]
    last = crack
    for after in number:
        last = after[last]
    rows = [[last]]
    for after in reversed(number):
        rows.append([c for c, now in enumerate(after) if now in rows[-1]])
    return rows[::-1]


__all__ = ["lineage"]
