"""Which node carries which function, and how far the tip functions reach."""

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.crack.crack import Crack, crack_length
from xcrack.crack.tips_2d import tip_frames
from xcrack.cutting.cut import Cut
from xcrack.mesh.locate import cells_within, nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, facet_nodes
from xcrack.xfem.enrichment_3d import front_radii, leg_size

_SHARE = {1: 0.3, 2: 0.4}  # of the free length around a tip, measured best for K at each order

_LEAST = 2.0  # cells
# Cells: within this distance of a tip all cells carry its functions whole. By dimension and order:
# at order 1 pressures of closed cracks gained nothing.
_WHOLE = {(2, 2): 1.5}
# In cells: by then K is right to 1e-7 (order 2) or 1e-4 (order 1), and a wider disc would only cost
# unknowns and fill.
_MOST = {1: 40.0, 2: 20.0}


def tip_radii(
    mesh: Mesh, cracks: tuple[Crack, ...], cuts: tuple[Cut, ...], order: int, wanted: float | None
) -> list[tuple[float, ...]]:
    """Radius of the enriched disc at each tip of each crack, length; see `front_radii` in space.

    Without a wanted radius: a share (0.3 at order 1, 0.4 at order 2) of the smallest of crack
    length, distance to the boundary and distance to another tip, at most 20 cells (40 at
    order 1). A wanted radius is kept, and shrunk only where the body or another tip demands.
    Never below two cells.
    """
    if mesh.dim == 3:
        return front_radii(mesh, cracks, cuts, order, wanted)
    tips = [tip_frames(crack)[0] for crack in cracks]
    every = np.concatenate(tips) if tips else np.zeros((0, mesh.dim))
    radii = []
    for crack, cut, own in zip(cracks, cuts, tips, strict=True):
        length = crack_length(crack) / max(len(own), 1)
        row = []
        for k, x in enumerate(own):
            to_boundary, _ = nearest_boundary(mesh, x)
            apart = np.linalg.norm(every - x, axis=1)
            to_tip = float(np.min(apart[apart > 0], initial=np.inf))
            size = leg_size(mesh, cut.level_set.tip_cells[k])
            if wanted is None:
                radius = min(_SHARE[order] * min(length, to_boundary, to_tip), _MOST[order] * size)
            else:
                radius = min(wanted, 0.8 * to_boundary, 0.45 * to_tip)
            row.append(max(radius, _LEAST * size))
        radii.append(tuple(row))
    return radii


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

    At order 2 in the plane, besides those within the radius, the corners of all cells that come
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
