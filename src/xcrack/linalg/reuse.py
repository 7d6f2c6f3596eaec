"""What one solve hands on to the next: matrices of the mesh, factors, closed sets by place."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats
from xcrack.fem.assembly import Bulk
from xcrack.linalg.multifrontal import Factor, Tree
from xcrack.linalg.multigrid import Hierarchy


@dataclass(frozen=True, eq=False)
class SlipField:
    """Slip of the faces of one crack, by place along it.

    Attributes
    ----------
    points : (n, d) array, length
        Of the crack; in 3D the points of its faces.
    place : (q,) array
        Rising: number of the face, plus share of its length. In 3D the width of each point's piece
        of face, length.
    slip : (q,) array, in 3D (q, 3), length
    """

    points: Floats
    place: Floats
    slip: Floats


@dataclass(frozen=True, eq=False)
class SolverState:
    """Work of an earlier solve in the same mesh; an empty one is ``SolverState()``.

    Attributes
    ----------
    centre : tuple of (g, d) arrays or None
        Where the multipliers of each crack sit; None for a crack without.
    active : tuple of (states, g) arrays of bool or None
        Closed sets of all load states.
    tree : Tree, optional
        Halves of the mesh, in whose order a factorisation takes the unknowns.
    factor : Factor, optional
        Of the last crack, whose panels serve the next one where nothing changed.
    bulk : Bulk, optional
        Stiffness of the uncracked body, and cut cells that may serve the next crack.
    hierarchy : Hierarchy, optional
        Coarse levels of the iterative solver.
    levels : tuple of float
        Factors of a spectrum that the closed sets belong to, where levels were refined.
    slip : tuple of SlipField or None
        Of the last load state, with friction: where a repeated cycle of the grown crack begins.
    """

    centre: tuple[Floats | None, ...] = ()
    active: tuple[Bools | None, ...] = ()
    tree: Tree | None = None
    factor: Factor | None = None
    bulk: Bulk | None = None
    hierarchy: Hierarchy | None = None
    levels: tuple[float, ...] = ()
    slip: tuple[SlipField | None, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # A factor holds addresses: in another process they mean nothing.
        return SolverState, (
            self.centre, self.active, None, None, self.bulk, self.hierarchy, self.levels, self.slip,
        )  # fmt: skip

    def without_matrices(self) -> "SolverState":
        """The part that fits into a file, and that decides the last bit of the next solve."""
        return SolverState(self.centre, self.active, levels=self.levels, slip=self.slip)

    def without_factor(self) -> "SolverState":
        """The part that is small enough to be kept with each solution."""
        return replace(self, factor=None)

    def was_closed(self, c: int) -> bool:
        """Whether any group of crack c was closed in any state."""
        active = self.active[c] if c < len(self.active) else None
        return active is not None and bool(active.any())

    def start(self, c: int, centre: Floats, state: int) -> Bools | None:
        """Closed set of the nearest multipliers `(g,)`, or None where nothing is known.

        Parameters
        ----------
        c : int
            Crack.
        centre : (g, d) array, length
            Where its multipliers sit now.
        state : int
        """
        if c >= len(self.centre):
            return None
        before, active = self.centre[c], self.active[c]
        if before is None or active is None or state >= len(active) or not len(before):
            return None
        nearest = cKDTree(before).query(centre)[1]
        return np.asarray(active[state][nearest])
