"""Cells that a crack cuts away from its tips: integrated once, as long as their cut stays.

Where a crack grows, only cells that its change touches are integrated again: those with tip
functions, and those whose level set, nodes or side have changed.
"""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.quadrature import cell_points


@dataclass(frozen=True, eq=False)
class ReusedCells:
    """Integrals of cells with the Heaviside functions of one crack and no others.

    Attributes
    ----------
    cells : (m,) array of int
        Growing.
    key : (m, k) array
        What the integrals depend on.
    products : (m, n d, n d) array
        Integrals of products of gradients, as `kernels.enriched.gradient_products` makes them.
    """

    cells: Ints
    key: Floats
    products: Floats


def with_one_jump(space: FunctionSpace, cells: Ints) -> Bools:
    """On which cells the Heaviside functions of one crack act, and nothing else.

    Without those around junctions, where they depend on a second crack.
    """
    mask = space.signature[cells]
    one = (mask & (mask - 1) == 0) & (mask < 1 << len(space.cuts))
    for joint in space.joints:
        one &= ~joint.near[cells]
    return np.asarray(one)


def reused_cells(
    space: FunctionSpace, cells: Ints, known: ReusedCells | None
) -> tuple[ReusedCells, int]:
    """Integrate cells with one jump, but those that are known already.

    Parameters
    ----------
    space : FunctionSpace
    cells : (m,) array of int
        Growing.
    known : ReusedCells, optional
        Of an earlier crack in the same mesh.

    Returns
    -------
    ReusedCells
    n_points : int
        Integration points used.
    """
    from xcrack.kernels.enriched import gradient_products

    n, key = space.cell_nodes.shape[1], _keys(space, cells)
    products = np.empty((len(cells), 2 * n * space.dim, 2 * n * space.dim))
    old = np.zeros(len(cells), dtype=bool)
    if known is not None and len(known.cells):
        row = np.minimum(np.searchsorted(known.cells, cells), len(known.cells) - 1)
        old = (known.cells[row] == cells) & (known.key[row] == key).all(axis=1)
        products[old] = known.products[row[old]]
    new = np.nonzero(~old)[0]
    points = cell_points(space, cells[new], 0, 2 * (space.order - 1))
    for batch, rows in space.batches(cells[new]):
        number, place, first = points.of_cells(batch.cells)
        _, G = space.tabulate(batch, place, points.bary[number], points.side[number])
        products[new[rows]] = gradient_products(first, points.weight[number], G, n)
    return ReusedCells(cells, key, products), len(points.weight)


def _keys(space: FunctionSpace, cells: Ints) -> Floats:
    """Crack, its level set, the nodes with its function.

    Side and sub-cells of a cell without a tip follow from the level set at its corners alone, at
    kinks from that of the cut and from where the kink is, and where functions jump in a cell whose
    level set changes its sign, the crack cuts it.
    """
    mesh = space.mesh
    crack = np.log2(space.signature[cells]).astype(np.int64)
    end, nodes = 1 + mesh.cells.shape[1], space.cell_nodes.shape[1]
    key = np.zeros((len(cells), 2 * end + nodes - 1))
    for c in np.unique(crack):
        rows = np.nonzero(crack == c)[0]
        own = cells[rows]
        key[rows, 0] = c
        key[rows, 1:end] = space.cuts[c].level_set.phi[mesh.cells[own]]
        key[rows, end : end + nodes] = space.heaviside[c][space.cell_nodes[own]] >= 0
        kinks = space.cuts[c].kinks
        _, bent, row = np.intersect1d(own, kinks.cells, return_indices=True)
        if len(bent):
            key[rows[bent], 1:end] = kinks.values[row]
            key[rows[bent], end + nodes :] = np.nan_to_num(kinks.vertex[row])
    return key
