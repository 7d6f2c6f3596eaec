"""Cells at the fronts of a crack in 3D: cut by phi, then by psi.

In a cell the front is the straight line phi = psi = 0. Cut along both, each sub-cell lies in one
quadrant around it and touches it with an edge, with a vertex, or not at all, which is what the
integration rules want.
"""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.cutting.level_set import LevelSet
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.split import cut_simplices, interface_simplices

_AT = 1e-10  # share of a cell's range of psi below which a vertex lies on the front
_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def front_parts(
    mesh: Mesh, level_set: LevelSet, positions: Floats, exists: Bools
) -> list[tuple[tuple[Ints, Floats, Floats, Ints], tuple[Ints, Floats], Ints]]:
    """Sub-cells, lips and entry edges of the cells at all fronts together; see `_front_subs`."""
    is_tip = np.zeros(len(mesh.cells), dtype=bool)
    for cells in level_set.tip_cells:
        is_tip[cells] = True
    return [_front_subs(mesh, level_set, np.nonzero(is_tip)[0], positions)]


def _front_subs(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats
) -> tuple[tuple[Ints, Floats, Floats, Ints], tuple[Ints, Floats], Ints]:
    """Sub-cells and faces of the cells at fronts, and the edges that the crack crosses there.

    Returns
    -------
    subs : cell (s,), barycentric vertices (s, 4, 4), share of the volume (s,), side (s,)
    lips : cell (l,), barycentric vertices (l, 3, 4)
    entry : (e,) array of int
    """
    phi = level_set.phi[mesh.cells[cells]]
    crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    whole, split = np.nonzero(~crossed)[0], np.nonzero(crossed)[0]
    bary, share, side, parent = cut_simplices(phi[split])
    largest = np.take_along_axis(phi, np.abs(phi).argmax(axis=1)[:, None], 1)[:, 0]
    owner = np.concatenate([whole, split[parent]])
    bary = np.concatenate([np.broadcast_to(np.eye(4), (len(whole), 4, 4)), bary])
    share = np.concatenate([np.ones(len(whole)), share])
    side = np.concatenate([np.where(largest[whole] >= 0, 1, -1), side])
    for psi in level_set.psi:
        owner, bary, share, side = _cut_again(psi[mesh.cells[cells]], owner, bary, share, side)
    lip, row = interface_simplices(phi[split])
    lip_owner = split[row]
    inside = np.einsum("svb,sb->sv", lip, level_set.inside[mesh.cells[cells[lip_owner]]])
    part, row = behind(inside)
    lips = np.einsum("svw,swb->svb", part, lip[row])
    edges = np.unique(mesh.cell_to_edge[cells])
    t = positions[edges]
    a, b = mesh.edges[edges].T
    at = (1 - t) * level_set.inside[a] + t * level_set.inside[b]
    size = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    with np.errstate(invalid="ignore"):
        entry = edges[(at < -_AT * size) & level_set.near[edges]]
    return (cells[owner], bary, share, side), (cells[lip_owner[row]], lips), entry


def _cut_again(
    psi: Floats, owner: Ints, bary: Floats, share: Floats, side: Ints
) -> tuple[Ints, Floats, Floats, Ints]:
    """Cut sub-cells along psi, given at the corners of their cells `(k, 4)`."""
    values = _snapped(np.einsum("svb,sb->sv", bary, psi[owner]), psi[owner])
    cut = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    same, rows = np.nonzero(~cut)[0], np.nonzero(cut)[0]
    inner, part, _, parent = cut_simplices(values[rows])
    source = rows[parent]
    finer = np.einsum("svw,swb->svb", inner, bary[source])
    every = np.concatenate([same, source])
    result = np.concatenate([share[same], share[source] * part])
    keep = result > _NOTHING
    vertices = np.concatenate([bary[same], finer])
    return owner[every][keep], vertices[keep], result[keep], side[every][keep]


def lips_up_to_fronts(
    mesh: Mesh, level_set: LevelSet, facets: Ints, cells: Ints, psi: Floats
) -> tuple[Floats, Ints]:
    """Corners of the crack faces on facets of the mesh, and the facet of each.

    Those behind fronts.
    """
    part, row = behind(psi)
    return np.einsum("svb,sbd->svd", part, mesh.points[mesh.facets[facets[row]]]), row


def behind(psi: Floats) -> tuple[Floats, Ints]:
    """Parts of triangles on which psi `(k, 3)` is negative: vertices `(s, 3, 3)`, parent `(s,)`."""
    values = _snapped(psi, psi)
    cut = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    whole = np.nonzero(~cut & (values.min(axis=1) < 0))[0]
    rows = np.nonzero(cut)[0]
    inner, _, side, parent = cut_simplices(values[rows])
    mine = side < 0
    corner = np.broadcast_to(np.eye(3), (len(whole), 3, 3))
    return np.concatenate([corner, inner[mine]]), np.concatenate([whole, rows[parent[mine]]])


def _snapped(values: Floats, scale: Floats) -> Floats:
    small = _AT * np.abs(scale).max(axis=1, keepdims=True)
    return np.where(np.abs(values) < small, 0.0, values)
