"""Which node carries which function, and how far the tip functions reach."""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.crack import Crack, crack_length, tip_frames
from xcrack.crack.fronts import front_frames
from xcrack.crack.junctions_3d import are_opposite
from xcrack.crack.measures import surface_size
from xcrack.fem.cut import Cut
from xcrack.fem.level_set import front_up_to_walls, runs_on
from xcrack.mesh.locate import Body, cells_within, nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes, facet_nodes, leg_size

# How far the tip functions reach around tips in 2D.

_SHARE = {1: 0.3, 2: 0.4}  # of the free length around a tip, measured best for K at each order
_LEAST = 2.0  # cells
# In cells: by then K is right to 1e-7 (order 2) or 1e-4 (order 1), and a wider disc would only cost
# unknowns and fill.
_MOST = {1: 40.0, 2: 20.0}


def disc_radii(
    mesh: Mesh,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    order: int,
    enriched_radius: float | None,
    meeting: Floats,
) -> list[tuple[float, ...]]:
    """Radius of the enriched disc at each tip of each crack, length.

    Without a wanted radius: a share (0.3 at order 1, 0.4 at order 2) of the smallest of crack
    length, distance to the boundary, to another tip and to a junction, at most 20 cells (40 at
    order 1). A wanted radius is used, and shrunk only where the body, another tip or a junction
    demands. Never below two cells.
    """
    tips = [tip_frames(crack)[0] for crack in cracks]
    all_tips = np.concatenate(tips) if tips else np.zeros((0, mesh.dim))
    radii = []
    for crack, cut, tips_of_crack in zip(cracks, cuts, tips, strict=True):
        length = crack_length(crack) / max(len(tips_of_crack), 1)
        row = []
        for k, x in enumerate(tips_of_crack):
            to_boundary, _ = nearest_boundary(mesh, x)
            distance = np.linalg.norm(all_tips - x, axis=1)
            to_tip = float(np.min(distance[distance > 0], initial=np.inf))
            to_joint = float(np.linalg.norm(meeting - x, axis=1).min(initial=np.inf))
            size = leg_size(mesh, cut.level_set.tip_cells[k])
            if enriched_radius is None:
                radius = min(
                    _SHARE[order] * min(length, to_boundary, to_tip, to_joint), _MOST[order] * size
                )
            else:
                radius = min(enriched_radius, 0.8 * to_boundary, 0.45 * to_tip, 0.8 * to_joint)
            row.append(max(radius, _LEAST * size))
        radii.append(tuple(row))
    return radii


# How far the tip functions reach around fronts in 3D.

# Of the crack's size, of the distance to a side of the body, of that to another front.
_SHARE_OF_FRONT, _ASIDE, _APART = 0.65, 0.7, 0.45
# In cells. At order 1 K_I of a penny is 2, .9 and .2 % low with 2.3, 2.8 and 3.4 cells; unknowns
# and points grow with the square of the radius, but are few. At order 2 more than two cells
# change nothing, and take a third more time.
_LEAST_OF_FRONT = 2.0
_RANGE = {1: (2.6, 3.6), 2: (2.0, 2.0)}
_EXIT = 1.5  # a front is near its exit where that is closer than this many distances to the side
_SAMPLES = 24  # points of an open front at which the distance to the boundary is taken


def front_reach(mesh: Mesh, crack: Crack, radius: float | None) -> float:
    """Distance from the fronts of a 3D crack up to which tip functions may act, length."""
    fronts = [crack.points[front] for front in crack.fronts or ()]
    if not fronts:
        return 0.0
    nearest_cells = mesh.cell_tree.query(np.concatenate(fronts))[1]
    size = float(mesh.cell_size[nearest_cells].max())
    return max(radius or 0.0, _RANGE[1][1] * size) + size


def reach_of_tips(dim: int, order: int, size: float, cell: float, radius: float | None) -> float:
    """Radius around the tips or fronts of a crack of that size, with all the room it wants.

    Parameters
    ----------
    dim : int
    order : int
    size : float, length
        Length a tip, in 3D area over the length of fronts.
    cell : float, length
        Leg of the cells there.
    radius : float, length, optional
        What is given.
    """
    if dim == 2:
        least_cells, most_cells, share_of_size = _LEAST, _MOST[order], _SHARE[order] * size
    else:
        (least_cells, most_cells), share_of_size = _RANGE[order], _SHARE_OF_FRONT * size
    if radius is not None:
        return max(radius, _LEAST * cell)
    return max(min(share_of_size, most_cells * cell), least_cells * cell)


def front_radii(
    mesh: Mesh,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    order: int,
    radius: float | None,
    meeting: Floats,
) -> list[tuple[float, ...]]:
    """Radius of the enriched tube around each front of each crack, length.

    Without a wanted radius: the smallest of 0.65 of the crack's size (area over length of its
    fronts, twice that where they are closed), 0.7 of the distance to sides that the front does not
    pierce, and 0.45 of that to other fronts; from 2.6 to 3.6 cells, and two at order 2. A wanted
    radius is used, and shrunk only where the body or another front demands; never below two cells.
    """
    del meeting
    least_cells, most_cells = _RANGE[order]
    fronts_of_cracks = [[crack.points[front] for front in crack.fronts or ()] for crack in cracks]
    if not any(fronts_of_cracks):
        return [() for _ in cracks]
    body, radii = Body.of(mesh), []
    for c, (crack, cut) in enumerate(zip(cracks, cuts, strict=True)):
        row = []
        fronts = crack.fronts or ()
        if fronts and radius is None:
            size = surface_size(crack, mesh, body)
        for k, numbers in enumerate(fronts):
            cell = leg_size(mesh, cut.level_set.tip_cells[k])
            is_closed = bool(numbers[0] == numbers[-1])
            room = _ASIDE * _to_sides(body, fronts_of_cracks[c][k], is_closed)
            other_fronts = [
                x
                for d, fronts_of_crack in enumerate(fronts_of_cracks)
                for j, x in enumerate(fronts_of_crack)
                if (d, j) != (c, k) and not are_opposite(cracks[d], crack)
            ]
            if other_fronts:
                distance = cKDTree(np.concatenate(other_fronts)).query(fronts_of_cracks[c][k])[0]
                room = min(room, _APART * float(distance.min()))
            if radius is None:
                share_of_size = min(_SHARE_OF_FRONT * (2 if is_closed else 1) * size, room)
                row.append(max(min(share_of_size, most_cells * cell), least_cells * cell))
            else:
                row.append(max(min(radius, room), _LEAST_OF_FRONT * cell))
        radii.append(tuple(row))
    return radii


def _to_sides(body: Body, x: Floats, is_closed: bool) -> float:
    """Distance of a front to the boundary, but where it runs into it."""
    inner_points = np.nonzero(body.contains(x))[0]
    if not len(inner_points):
        return np.inf
    rows: Ints = inner_points[
        np.unique(np.linspace(0, len(inner_points) - 1, _SAMPLES).astype(int))
    ]
    distance = np.abs(body.depth(x[rows])[0])
    if is_closed:
        return float(distance.min())
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    exits = np.minimum(s[rows] - s[inner_points[0]], s[inner_points[-1]] - s[rows])
    is_along_front = exits > _EXIT * distance
    return float(distance[is_along_front].min(initial=np.inf))


# Cells: within this distance of a tip all cells carry its functions whole. By dimension and order:
# at order 1 pressures of closed cracks gained nothing.
_WHOLE = {(2, 2): 1.5}


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
        v, v_beyond = mesh.cells[np.unique(cut.lip_cell[on_facets], axis=0)].transpose(1, 0, 2)
        is_shared = (v[:, :, None] == v_beyond[:, None, :]).any(axis=2)
        facets = v[is_shared].reshape(-1, mesh.dim)
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
            whole_size = _WHOLE[mesh.dim, order] * leg_size(mesh, tip_cells)
            flag[mesh.cells[cells_within(mesh, cut.level_set.tip[k], whole_size * (1 + 1e-9))]] = (
                True
            )
    return flag


def divided_points(mesh: Mesh, crack: Crack, cut: Cut, flags: list[Bools]) -> list[Bools]:
    """Points of the fronts of a 3D crack, each of one front around ends that are beside each other.

    On both sides of a hole fronts end beside each other in it: around these ends the functions of
    both are the same, and a point carries those of the nearer front.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
    cut : Cut
    flags : list of (n,) array of bool
        Points that may carry the functions of each front.

    Returns
    -------
    list of (n,) array of bool
    """
    result = list(flags)
    phi, psi = cut.level_set.phi, cut.level_set.psi
    fronts = [(k, front) for k, front in enumerate(front_frames(crack)) if not front.is_closed]
    if len(fronts) > 1:
        fronts = [(k, front_up_to_walls(front, mesh)) for k, front in fronts]
    for place, (j, front) in enumerate(fronts):
        cell = leg_size(mesh, cut.level_set.tip_cells[j])
        for i, other_front in fronts[:place]:
            if runs_on(front, other_front, cell) or runs_on(other_front, front, cell):
                common_points = result[i] & result[j]
                is_nearer = np.hypot(phi, psi[i]) <= np.hypot(phi, psi[j])
                result[i] = result[i] & ~(common_points & ~is_nearer)
                result[j] = result[j] & ~(common_points & is_nearer)
    return result


def node_level(mesh: Mesh, order: int, phi: Floats) -> Floats:
    """The linear level set at the nodes `(n_nodes,)`."""
    if order == 1:
        return phi
    return np.concatenate([phi, phi[mesh.edges].mean(axis=1)])


__all__ = []
