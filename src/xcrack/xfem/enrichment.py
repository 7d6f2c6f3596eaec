"""Which node carries which function, and how far the tip functions reach."""

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.crack.crack import Crack
from xcrack.cutting.cut import Cut
from xcrack.mesh.locate import cells_within
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, facet_nodes
from xcrack.mesh.sizes import leg_size
from xcrack.xfem.enrichment_2d import disc_radii
from xcrack.xfem.enrichment_3d import front_radii

# Cells: within this distance of a tip all cells carry its functions whole. By dimension and order:
# at order 1 pressures of closed cracks gained nothing.
_WHOLE = {(2, 2): 1.5}


_RADII = {2: disc_radii, 3: front_radii}


def tip_radii(
    mesh: Mesh,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    order: int,
    wanted: float | None,
    meeting: Floats,
) -> list[tuple[float, ...]]:
    """Radius of the enriched disc around each tip, in 3D of the tube around each front, by crack.

    Parameters
    ----------
    mesh : Mesh
    cracks : tuple of Crack
    cuts : tuple of Cut
    order : int
        Of the standard functions.
    wanted : float, length, optional
        Shrunk only where the body or another tip demands; see `disc_radii` and `front_radii` for
        what is taken without it.
    meeting : (k, d) array, length
        Where cracks end on others.
    """
    return _RADII[mesh.dim](mesh, cracks, cuts, order, wanted, meeting)


def heaviside_nodes(mesh: Mesh, order: int, cut: Cut) -> Bools:
    """Nodes whose support the crack splits, without those of the tip cells `(n_nodes,)`.

    Nodes of cells that are cut from side to side, and, where the crack lies on mesh lines, the
    nodes of the facets under it: without the latter such a crack would vanish.
    """
    nodes = cell_nodes(mesh, order)
    n_nodes = mesh.n_points + (len(mesh.edges) if order == 2 else 0)
    flag = np.zeros(n_nodes, dtype=bool)
    flag[nodes[cut.cells]] = True
    on_facets = cut.lip_cell[:, 0] != cut.lip_cell[:, 1]
    if on_facets.any():
        one, other = mesh.cells[np.unique(cut.lip_cell[on_facets], axis=0)].transpose(1, 0, 2)
        shared = (one[:, :, None] == other[:, None, :]).any(axis=2)
        facets = one[shared].reshape(-1, mesh.dim)
        flag[facet_nodes(mesh, order, facets)] = True
    for cells in cut.level_set.tip_cells:
        flag[nodes[cells]] = False
    return flag


def tip_points(mesh: Mesh, order: int, cut: Cut, k: int, radius: float, kind: str) -> Bools:
    """Mesh points that carry the functions of tip k `(n,)`.

    At order 2 in 2D, besides those within the radius, the corners of all cells that come
    nearer to the tip than 1.5 cells. The functions represent the field of the tip only in cells
    all of whose corners carry them: in a disc of two cells, points taken by their own distance
    leave such cells out as near as one cell or as far as two, as the mesh happens to lie.
    """
    flag = np.zeros(mesh.n_points, dtype=bool)
    tip_cells = cut.level_set.tip_cells[k]
    flag[mesh.cells[tip_cells]] = True
    if kind == "geometric":
        # What is on the rim counts whatever its round-off: the set is symmetric where the mesh is.
        distance = np.hypot(cut.level_set.phi, cut.level_set.psi[k])
        flag |= distance <= radius * (1 + 1e-9)
        if (mesh.dim, order) in _WHOLE:
            whole = _WHOLE[mesh.dim, order] * leg_size(mesh, tip_cells)
            flag[mesh.cells[cells_within(mesh, cut.level_set.tip[k], whole * (1 + 1e-9))]] = True
    return flag


def node_level(mesh: Mesh, order: int, phi: Floats) -> Floats:
    """The linear level set at the nodes `(n_nodes,)`."""
    if order == 1:
        return phi
    return np.concatenate([phi, phi[mesh.edges].mean(axis=1)])
