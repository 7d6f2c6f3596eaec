"""Nodes that carry the jump of a crack which ends on another one, by the parts of their cells.

Cells that the crack cuts do not tell: next to its end a node may have parts of its cells on either
side of it, though it cuts none of them; and a cell that it does cut may lie on one side of it where
the other crack is cut along a kink. A jump that is missing binds the faces together, and one that
is too many makes the stiffness singular.
"""

import numpy as np

from xcrack.base.arrays import Bools
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.joints_2d import Joint
from xcrack.fem.quadrature import SubCells, sub_cells
from xcrack.mesh.locate import cells_around

_BESIDE = 2.0  # cells to the junction within which nodes are added
_NOTHING = 1e-13  # share of a cell that is round-off


def jump_nodes(space: FunctionSpace) -> tuple[Bools, ...]:
    """Which nodes carry the Heaviside functions of each crack `(nodes,)`.

    Parameters
    ----------
    space : FunctionSpace
        With the nodes of cells that are cut; only those at junctions change.

    Raises
    ------
    GeometryError
        Two cracks run through one cell.
    """
    result = [number >= 0 for number in space.heaviside]
    for joint in space.joints:
        ending_cut, on = space.cuts[joint.crack], space.cuts[joint.on]
        is_near, is_beside = space.geometry.nodes_at_joint(space, joint)
        cells = np.nonzero(is_near[space.cell_nodes].any(axis=1))[0]
        subs = sub_cells(space, cells)
        # Ahead of a tip the level set changes its sign too, but cuts nothing.
        is_crossed = ending_cut.is_cut[subs.cell] | on.is_cut[subs.cell]
        if space.dim == 3:  # along the junction its own front may be near
            psi_at_vertices = ending_cut.level_set.psi_of_ends[space.mesh.cells]
            is_ahead = np.asarray((psi_at_vertices >= 0).any(axis=1))
            is_crossed &= ending_cut.is_cut[subs.cell] | ~is_ahead[subs.cell]
        is_added = _parted_nodes(space, subs, joint.crack, is_crossed) & is_beside
        is_added &= is_near & ~_nodes_of(space, ending_cut.is_tip)
        is_parted = _parted_nodes(space, subs, joint.crack, np.ones(len(is_crossed), dtype=bool))
        result[joint.crack] = is_added | (result[joint.crack] & (is_parted | ~is_near))
    return tuple(result)


def nodes_around_point(space: FunctionSpace, joint: Joint) -> tuple[Bools, Bools]:
    """Nodes in 2D that a junction may change, and those close to it `(nodes,)`."""
    size = space.mesh.cell_size[cells_around(space.mesh, joint.centre, 1e-9)].max()
    distance = np.linalg.norm(space.node_points - joint.centre, axis=1)
    return _nodes_of(space, joint.is_near), distance < _BESIDE * size


def nodes_along_line(space: FunctionSpace, joint: Joint) -> tuple[Bools, Bools]:
    """Nodes in 3D next to cells that both cracks cut `(nodes,)`, twice."""
    nodes_of_both = _nodes_of(space, joint.is_in_both)
    is_near = _nodes_of(space, np.asarray(nodes_of_both[space.cell_nodes].any(axis=1)))
    return is_near, is_near


def _nodes_of(space: FunctionSpace, cells: Bools) -> Bools:
    """Nodes of the flagged cells `(nodes,)`."""
    flag = np.zeros(space.n_nodes, dtype=bool)
    flag[space.cell_nodes[cells]] = True
    return flag


def _parted_nodes(space: FunctionSpace, subs: SubCells, c: int, is_chosen: Bools) -> Bools:
    """Nodes with chosen sub-cells on both sides of crack c `(nodes,)`."""
    result = np.ones(space.n_nodes, dtype=bool)
    for side in (1, -1):
        has_part = is_chosen & (subs.side[:, c] == side) & (subs.fraction > _NOTHING)
        flag = np.zeros(space.n_nodes, dtype=bool)
        flag[space.cell_nodes[subs.cell[has_part]]] = True
        result &= flag
    return result


__all__ = ["jump_nodes", "nodes_along_line", "nodes_around_point"]
