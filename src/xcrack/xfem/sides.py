"""Sides of the cracks on which points lie: of cells, of crack faces, and at junctions.

A crack that ends on another one has no sides beyond it: its side is 0 there, the third value of a
junction function (Daux et al., 2000).
"""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.xfem.function_space import FunctionSpace


def cell_side(space: FunctionSpace, cells: Ints) -> Ints:
    """Side of each crack on which cells lie `(k, cracks)`, 0 where a crack crosses them."""
    side = np.empty((len(cells), len(space.cuts)), dtype=np.int64)
    for c, cut in enumerate(space.cuts):
        side[:, c] = cut.side[cells]
    return side


def lip_side(space: FunctionSpace, c: int, cell: Ints, bary: Floats, side: int) -> Ints:
    """Side of each crack `(k, cracks)` for points on lip + or lip - of crack c.

    Parameters
    ----------
    space : FunctionSpace
    c : int
    cell : (k,) array of int
        On that side of the crack.
    bary : (k, d + 1) array
        Of the points in the cells.
    side : {1, -1}
    """
    sides = cell_side(space, cell)
    sides[:, c] = side
    for joint in space.joints:
        if joint.crack == c:
            sides[joint.near[cell], joint.on] = joint.side
    return at_joints(space, cell, bary, sides, c)


def at_joints(
    space: FunctionSpace, cell: Ints, bary: Floats, sides: Ints, c: int | None = None
) -> Ints:
    """Sides `(k, cracks)` of points at junctions, changed in place: of cracks that end there.

    Parameters
    ----------
    space : FunctionSpace
    cell : (k,) array of int
    bary : (k, d + 1) array
        Inside what is on one side of each crack, or on a face of a crack.
    sides : (k, cracks) array of int
        Right for cracks that run through.
    c : int, optional
        A crack whose sides stay.
    """
    for joint in space.joints:
        if joint.crack == c:
            continue
        near = np.nonzero(joint.near[cell])[0]
        through = sides[near, joint.on]
        phi = space.cuts[joint.crack].level_set.phi[space.mesh.cells[cell[near]]]
        own = np.where(np.einsum("kb,kb->k", bary[near], phi) >= 0, 1, -1)
        whole = ~space.cuts[joint.on].is_cut[cell[near]]
        changed = np.where(through == -joint.side, 0, own)
        keep = (through == 0) | ((through == joint.side) & whole & (c != joint.on))
        sides[near, joint.crack] = np.where(keep, sides[near, joint.crack], changed)
    return sides


def part_numbers(space: FunctionSpace, cell: Ints, sides: Ints) -> Ints:
    """Which part of its cell a point lies in `(k,)`, from 0 to `n_parts` - 1, by its sides."""
    plus = np.zeros(len(cell), dtype=bool)
    beside = np.zeros(len(cell), dtype=bool)
    for c, cut in enumerate(space.cuts):
        above = cut.is_cut[cell] & (sides[:, c] > 0)
        for joint in space.joints:
            if joint.crack == c:
                beside |= above & joint.both[cell]
                above = above & ~joint.both[cell]
        plus |= above
    return plus + 2 * beside.astype(np.int64)


def n_parts(space: FunctionSpace) -> int:
    """Into how many parts cracks cut a cell at most: two, or four at a junction."""
    return 4 if space.joints else 2
