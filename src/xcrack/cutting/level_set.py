"""Level sets of one crack at the points of a mesh, and what both dimensions do to them."""

from dataclasses import dataclass, field

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, lock
from xcrack.mesh.mesh import Mesh

SNAP = 1e-10  # share of an edge below which a cut point is moved onto its end


@dataclass(frozen=True, eq=False)
class LevelSet:
    """Level sets of one crack.

    Attributes
    ----------
    phi : (n,) array, length
        Signed distance, positive on the side of lip +, zero where snapped.
    psi : (f, n) array, length
        Signed distance to each tip along the crack; the crack is where all are negative.
    tip_cells : tuple of (k,) arrays of int
        Cells whose closed set meets the tip or the front, for each of them.
    tip : (f, d) array, length
        Tip points; in 3D a point of each front.
    mouth : (n,) array, length
        Positive where a point is nearest to the prolongation of a mouth: across a hole, say, the
        line of a crack runs on, but not the crack.
    near : (e,) array of bool
        Edges short enough to be crossed by the crack where phi changes its sign; a change far
        from the crack (behind a strong turn) is no cut.
    line : (n, 2) array, length
        In 2D: the crack itself, whose kinks the cut follows; without points where it does not.
    """

    phi: Floats
    psi: Floats
    tip_cells: tuple[Ints, ...]
    tip: Floats
    mouth: Floats
    near: Bools
    line: Floats = field(default_factory=lambda: lock(np.zeros((0, 2))))

    @property
    def inside(self) -> Floats:
        """Negative along the crack: the largest psi of all its ends `(n,)`."""
        return np.asarray(np.vstack([self.psi, self.mouth[None]]).max(axis=0))


def near_edges(mesh: Mesh, phi: Floats) -> Bools:
    """Edges short enough to be crossed where phi changes its sign `(e,)`."""
    ends = np.abs(phi)[mesh.edges]
    return np.asarray(ends[:, 0] + ends[:, 1] <= mesh.edge_length * (1 + 1e-6))


def snapped(mesh: Mesh, phi: Floats) -> Floats:
    """Move cut points within 1e-10 of an edge's end onto that end, until nothing changes."""
    phi = np.array(phi)
    phi[np.abs(phi) < 1e-15 * mesh.longest_edge] = 0.0
    while True:
        a, b = phi[mesh.edges].T
        crossed = a * b < 0
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(crossed, a / (a - b), 0.5)
        low, high = crossed & (share < SNAP), crossed & (share > 1 - SNAP)
        if not (low.any() or high.any()):
            return phi
        phi[mesh.edges[low, 0]] = 0.0
        phi[mesh.edges[high, 1]] = 0.0
