"""What a step hands to the next: closed sets by place, and the order of elimination."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Bools, Floats
from xcrack.contact.multipliers import Multipliers
from xcrack.solvers.factor import Elimination


@dataclass(frozen=True, eq=False)
class Warm:
    """Closed sets of all load states, and the order in which a factorisation takes the nodes.

    Attributes
    ----------
    centre : tuple of (g, d) arrays or None
        Where the multipliers of each crack sit; None for a crack without.
    active : tuple of (states, g) arrays of bool or None
    elimination : Elimination, optional
        None without a factorisation.
    """

    centre: tuple[Floats | None, ...]
    active: tuple[Bools | None, ...]
    elimination: Elimination | None = None

    def closed(self, c: int) -> bool:
        """Whether any group of crack c was closed in any state."""
        active = self.active[c] if c < len(self.active) else None
        return active is not None and bool(active.any())

    def start(self, space_of: Multipliers, state: int) -> Bools | None:
        """Closed set of the nearest multipliers, or None where nothing is known."""
        c = space_of.crack
        if c >= len(self.centre):
            return None
        centre, active = self.centre[c], self.active[c]
        if centre is None or active is None or state >= len(active) or not len(centre):
            return None
        nearest = cKDTree(centre).query(space_of.centre)[1]
        return np.asarray(active[state][nearest])
