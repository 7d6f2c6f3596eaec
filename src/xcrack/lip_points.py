"""Integration points on the lips of a crack, shared by contact, loads and K."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.facet_parts import part_points
from xcrack.space import Space


@dataclass(frozen=True, eq=False)
class LipPoints:
    """Integration points on the lips of one crack.

    Attributes
    ----------
    segment : (q,) array of int
        Lip segment or triangle of the cut.
    cell : (q, 2) array of int
        Cell on side - and on side +.
    bary : (q, 2, d + 1) array
    weight : (q,) array, length^(d - 1)
    normal : (q, d) array
        From lip - to lip +.
    x : (q, d) array, length
    s : (q,) array, length
        In the plane: position along the crack from where it enters the body; zero in space.
    """

    segment: Ints
    cell: Ints
    bary: Floats
    weight: Floats
    normal: Floats
    x: Floats
    s: Floats

    def __len__(self) -> int:
        return len(self.weight)


def lip_points(space: Space, c: int, n: int = 6) -> LipPoints:
    """Points on the lips of crack c, graded towards its tips, in the order of the crack."""
    cut, mesh = space.cuts[c], space.mesh
    bary = cut.lip_bary
    # The ends of a segment on a facet are sorted as the boundary rule sorts them.
    k, place, weight = part_points(space, mesh.cells[cut.lip_cell[:, 1]], bary[:, 1], n)
    at = np.einsum("qv,qsvb->qsb", place, bary[k])
    corners = cut.lip_points(mesh)
    x = np.einsum("qv,qvd->qd", place, corners[k])
    if mesh.dim == 2:
        ends = arc_position(space.cracks[c].points, corners.reshape(-1, mesh.dim))
        s = arc_position(space.cracks[c].points, x) - ends.min(initial=np.inf)
    else:
        s = np.zeros(len(x))
    order = np.argsort(s, kind="stable")
    k = k[order]
    return LipPoints(
        k,
        cut.lip_cell[k],
        at[order],
        weight[order],
        cut.lip_normal[k],
        x[order],
        s[order],
    )


def arc_position(polyline: Floats, x: Floats) -> Floats:
    """Position of points along a polyline, from its first point `(k,)`, length."""
    a, along = polyline[:-1], np.diff(polyline, axis=0)
    length = np.linalg.norm(along, axis=1)
    start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    t = np.einsum("ksd,sd->ks", x[:, None] - a, along) / length**2
    t = np.clip(t, 0.0, 1.0)
    foot = a + t[..., None] * along
    best = np.argmin(np.linalg.norm(x[:, None] - foot, axis=2), axis=1)
    row = np.arange(len(x))
    return start[best] + t[row, best] * length[best]
