"""Integration points: no more than a function needs, and polynomials exactly.

Plain cells need none (their stiffness is tabulated), Heaviside sub-cells the few of a polynomial
rule; what sub-cells with tip functions need depends on the dimension.
"""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, offsets, ranges
from xcrack.errors import GeometryError
from xcrack.mesh.simplex import simplex_rule
from xcrack.mesh.split import cut_simplices
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.quadrature_2d import tip_points
from xcrack.xfem.quadrature_3d import front_points
from xcrack.xfem.sides import at_joints, cell_side

_ROUND_OFF = 1e-13  # share of a sub-cell's largest level set below which a value is zero


@dataclass(frozen=True, eq=False)
class Points:
    """Integration points in cells, sorted by cell and piece.

    Attributes
    ----------
    cell : (q,) array of int
    bary : (q, d + 1) array
    weight : (q,) array, length^d
    side : (q, cracks) array of int
        Side of each crack; 0 where that means nothing.
    """

    cell: Ints
    bary: Floats
    weight: Floats
    side: Ints

    def chosen(self, wanted: Bools | Ints) -> "Points":
        """Some of the points, by a mask or by their numbers."""
        return Points(self.cell[wanted], self.bary[wanted], self.weight[wanted], self.side[wanted])

    def of_cells(self, cells: Ints) -> tuple[Ints, Ints, Ints]:
        """Points of the given cells: their numbers, row of their cell, offsets by cell."""
        first = self.cell.searchsorted(cells)
        counts = self.cell.searchsorted(cells, side="right") - first
        row, place = ranges(counts)
        return first[row] + place, row, offsets(counts)


@dataclass(frozen=True, eq=False)
class SubCells:
    """Simplices into which cells are split, each wholly on one side of each crack.

    Attributes
    ----------
    cell : (s,) array of int
    bary : (s, d + 1, d + 1) array
        Vertices in barycentric coordinates of the cell.
    fraction : (s,) array
        Share of the cell's volume.
    side : (s, cracks) array of int
    fan : (s,) array of bool
        Vertex 0 is a tip.
    """

    cell: Ints
    bary: Floats
    fraction: Floats
    side: Ints
    fan: np.ndarray


def sub_cells(space: FunctionSpace, cells: Ints) -> SubCells:
    """Sub-cells of the given cells, in their order."""
    mesh = space.mesh
    base = cell_side(space, cells)
    whole = np.ones(len(cells), dtype=bool)
    parts = []
    for c, cut in enumerate(space.cuts):
        # Cells split by this crack hand over their sub-cells.
        place = np.full(len(mesh.cells), -1, dtype=np.int64)
        place[cells] = np.arange(len(cells))
        rows = place[cut.sub_to_cell]
        mine = rows >= 0
        owner = rows[mine]
        if not whole[owner].all():
            bad = cells[owner[~whole[owner]][0]]
            raise GeometryError(
                f"two cracks run through the cell at "
                f"{np.round(mesh.points[mesh.cells[bad]].mean(axis=0), 6).tolist()}: refine the "
                "mesh between them until at least one cell lies in between."
            )
        side = base[owner].copy()
        side[:, c] = cut.sub_side[mine]
        tip = cut.is_tip[cut.sub_to_cell[mine]]
        parts.append((owner, cut.sub_bary[mine], cut.sub_fraction[mine], side, tip))
        whole[owner] = False
    rest = whole.nonzero()[0]
    if len(rest) or not parts:
        corner = np.zeros((len(rest), mesh.dim + 1, mesh.dim + 1))
        corner[:, range(mesh.dim + 1), range(mesh.dim + 1)] = 1.0
        share, fan = np.ones(len(rest)), np.zeros(len(rest), dtype=bool)
        parts.append((rest, corner, share, base[rest], fan))
    owner, bary, fraction, side, fan = map(np.concatenate, zip(*parts, strict=True))
    order = owner.argsort(kind="stable")
    subs = SubCells(cells[owner[order]], bary[order], fraction[order], side[order], fan[order])
    return _joined(space, subs) if space.joints else subs


def _joined(space: FunctionSpace, subs: SubCells) -> SubCells:
    """Sub-cells with the sides of cracks that end on others, split where both cut a cell."""
    for joint in space.joints:
        phi = space.cuts[joint.crack].level_set.phi
        value = np.einsum("svb,sb->sv", subs.bary, phi[space.mesh.cells[subs.cell]])
        small = np.abs(value) < _ROUND_OFF * np.abs(value).max(axis=1, keepdims=True)
        value[small] = 0.0
        split = joint.both[subs.cell] & (subs.side[:, joint.on] == joint.side)
        split &= (value.min(axis=1) < 0) & (value.max(axis=1) > 0)
        whole, rows = np.nonzero(~split)[0], np.nonzero(split)[0]
        inner, share, _, parent = cut_simplices(value[rows])
        source = np.concatenate([whole, rows[parent]])
        order = np.argsort(source, kind="stable")
        finer = np.einsum("svw,swb->svb", inner, subs.bary[rows[parent]])
        source = source[order]
        subs = SubCells(
            subs.cell[source],
            np.concatenate([subs.bary[whole], finer])[order],
            subs.fraction[source] * np.concatenate([np.ones(len(whole)), share])[order],
            subs.side[source],
            subs.fan[source],
        )
    centre = subs.bary.mean(axis=1)
    return replace(subs, side=at_joints(space, subs.cell, centre, subs.side))


def cell_points(space: FunctionSpace, cells: Ints, n: int, degree: int) -> Points:
    """Integration points of cells, sorted by cell.

    Parameters
    ----------
    space : FunctionSpace
    cells : (k,) array of int, increasing
    n : int
        Points a direction where tip functions act.
    degree : int
        Degree of polynomials integrated exactly elsewhere.
    """
    subs = sub_cells(space, cells)
    with_tip = space.has_tip[subs.cell]
    plain = (~with_tip).nonzero()[0]
    bary, weight = simplex_rule(space.dim, degree)
    number = np.repeat(plain, len(weight))
    where = np.einsum("pv,svb->spb", bary, subs.bary[plain]).reshape(-1, space.dim + 1)
    share = np.outer(subs.fraction[plain], weight).ravel()
    rows = with_tip.nonzero()[0]
    if not len(rows):
        return _sorted(space, subs, number, where, share)
    near, place, part = _NEAR_TIPS[space.dim](
        space, subs.cell[rows], subs.bary[rows], subs.fraction[rows], subs.fan[rows], n
    )
    return _sorted(
        space,
        subs,
        np.concatenate([number, rows[near]]),
        np.concatenate([where, place]),
        np.concatenate([share, part]),
    )


# Points in sub-cells on which tip functions act.
_NEAR_TIPS = {2: tip_points, 3: front_points}


def _sorted(
    space: FunctionSpace, subs: SubCells, numbers: Ints, every: Floats, part: Floats
) -> Points:
    """Points of sub-cells, sorted by cell and sub-cell."""
    cell = subs.cell[numbers]
    order = np.lexsort((numbers, cell))
    cell = cell[order]
    return Points(
        cell, every[order], part[order] * space.mesh.volume[cell], subs.side[numbers[order]]
    )
