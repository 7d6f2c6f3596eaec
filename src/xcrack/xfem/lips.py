"""Integration points on the faces of a crack, shared by contact, loads and K."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Floats, Ints, offsets
from xcrack.xfem.facets import part_points
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.sides import lip_side


@dataclass(frozen=True, eq=False)
class LipPoints:
    """Integration points on the faces of one crack.

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
        In 2D: position along the crack from where it enters the body; zero in 3D.
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


def lip_points(space: FunctionSpace, c: int, n: int = 6) -> LipPoints:
    """Points on the faces of crack c, graded towards its tips, in the order of the crack."""
    cut, mesh = space.cuts[c], space.mesh
    bary = cut.lip_bary
    # The ends of a segment on a facet are sorted as the boundary rule sorts them.
    k, place, weight = part_points(space, mesh.cells[cut.lip_cell[:, 1]], bary[:, 1], n)
    at = np.einsum("qv,qsvb->qsb", place, bary[k])
    corners = cut.lip_points(mesh)
    x = np.einsum("qv,qvd->qd", place, corners[k])
    s = _POSITION[mesh.dim](space.cracks[c].points, x, corners)
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


def _along_line(polyline: Floats, x: Floats, corners: Floats) -> Floats:
    ends = arc_position(polyline, corners.reshape(-1, 2))
    return arc_position(polyline, x) - ends.min(initial=np.inf)


def _nowhere(points: Floats, x: Floats, corners: Floats) -> Floats:
    """A surface has no order of its points."""
    return np.zeros(len(x))


_POSITION = {2: _along_line, 3: _nowhere}


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


def jump_values(space: FunctionSpace, c: int, lips: LipPoints) -> list[tuple[Ints, Ints, Floats]]:
    """Signed traces of the functions on both crack faces: + lip minus - lip.

    Returns
    -------
    list of (functions (k, n), numbers of the points (k,), values (k, n))
        For each lip and batch; the jump at a point is the sum over all entries of the point.
    """
    result = []
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        side = lip_side(space, c, cell, lips.bary[:, s], sign)
        for batch, number, row in space.batches_of_points(cell):
            N, _ = space.tabulate(batch, row, lips.bary[number, s], side[number], slopes=False)
            result.append((batch.functions[row], number, sign * N))
    return result


def jump_matrix(
    space: FunctionSpace, c: int, lips: LipPoints, along: Floats | None = None
) -> sp.csr_matrix:
    """Jump n . [[u]] at the lip points `(q, n_dof)`; with directions `along` (q, d), theirs."""
    direction = lips.normal if along is None else along
    rows, columns, values = [], [], []
    for functions, number, N in jump_values(space, c, lips):
        acts = (functions >= 0) & (N != 0)
        rows.append(np.broadcast_to(number[:, None], functions.shape)[acts])
        columns.append(functions[acts])
        values.append(N[acts])
    place = np.concatenate(rows) * np.int64(space.n_functions) + np.concatenate(columns)
    place, number = np.unique(place, return_inverse=True)
    jump = np.bincount(number, np.concatenate(values), len(place))
    differs = jump != 0  # standard functions take one value on both lips of a cell
    point, function = np.divmod(place[differs], space.n_functions)
    d = space.dim
    entries = (jump[differs, None] * direction[point]).ravel()
    unknown = (function[:, None] * d + np.arange(d)).ravel().astype(np.int32)
    start = offsets(np.bincount(point, minlength=len(lips)) * d).astype(np.int32)
    return sp.csr_matrix((entries, unknown, start), shape=(len(lips), space.n_dof))
