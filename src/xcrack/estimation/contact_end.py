"""The end of contact: what functionals would be with the contact a group longer or shorter.

The surplus space sees a wrong pressure, but not that the faces part at a wrong place.
"""

import numpy as np

from xcrack.arrays import Floats
from xcrack.estimation.dual import Duals, Groups
from xcrack.solvers.active_set import of_set


def end_changes(groups: Groups, duals: Duals, gap: Floats, k: int) -> Floats:
    """|dJ with a group more closed + dJ with one less|, summed over the ends of contact `(m,)`.

    The first-order terms of the two are opposite where the end is right: what is left is of second
    order, as the error is. Contact that ends at a kink ends where it should.

    Parameters
    ----------
    groups : Groups
    duals : Duals
    gap : (g,) array
        Weak gaps of the state.
    k : int
        State.
    """
    active, pressure = groups.active[k], groups.pressure[:, k]
    total = np.zeros(duals.per_pressure.shape[1])
    if not active.any():
        return total
    opened = gap - groups.dual @ pressure
    order = np.lexsort((groups.position, groups.crack))
    along, crack, piece = active[order], groups.crack[order], groups.piece[order]
    same = (crack[1:] == crack[:-1]) & (piece[1:] == piece[:-1])
    ends = np.nonzero((along[1:] != along[:-1]) & same)[0]
    for end in ends:
        change = np.zeros(len(total))
        for group in (order[end], order[end + 1]):
            other = active.copy()
            other[group] = ~other[group]
            moved = of_set(groups.dual, opened, other)[0] - pressure
            change += duals.per_pressure.T @ moved
        total += np.abs(change)
    return total
