"""A solution as it is seen: pieces of the body that show every jump, and the faces of its cracks.

Plain cells share their points, cells with enriched functions are replaced by their sub-cells, and
points on a crack exist twice, once for each lip, as do points on interfaces, once for each
material. Files and pictures are made of these.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, initial_stress_at
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import position
from xcrack.fem.quadrature import SubCells, cell_side, lip_side, sub_cells
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import n_shapes

# Simplices of which a cracked body is drawn: whole cells, and sub-cells that fit each other.

_REACH = 1.731  # lengths of an edge from a tip within which it is halved; no tie on regular meshes
_LEVELS = 4  # times that an edge at a tip is halved
# Parts of a triangle by its halved edges 01, 02, 12; numbers 3, 4, 5 are their midpoints.
_PARTS = {
    (True, False, False): [(0, 3, 2), (3, 1, 2)],
    (False, True, False): [(0, 1, 4), (4, 1, 2)],
    (False, False, True): [(0, 1, 5), (0, 5, 2)],
    (True, True, False): [(0, 3, 4), (3, 1, 2), (3, 2, 4)],
    (True, False, True): [(3, 1, 5), (0, 3, 5), (0, 5, 2)],
    (False, True, True): [(4, 5, 2), (0, 1, 5), (0, 5, 4)],
    (True, True, True): [(0, 3, 4), (3, 1, 5), (4, 5, 2), (3, 5, 4)],
}


@dataclass(frozen=True, eq=False)
class PieceCells:
    """Simplices that fill a body.

    Attributes
    ----------
    plain_cells : (m,) array of int
        Cells drawn whole.
    cell : (s,) array of int
        Cell of each sub-cell of the others.
    bary : (s, d + 1, d + 1) array
        Vertices of the sub-cells in barycentric coordinates of the cell, turning as it does.
    side : (s, cracks) array of int
        Side of each crack, 0 where that means nothing.
    """

    plain_cells: Ints
    cell: Ints
    bary: Floats
    side: Ints


def piece_cells(space: FunctionSpace) -> PieceCells:
    """Split the cells on which enriched functions act, in 2D finer towards the tips.

    In 3D a face of a cell at a front may be split while its neighbour ahead is whole, and two
    neighbours may halve a four-sided face along different diagonals: points on such a face hang.
    They lie where they should and carry the value of the solution there, which a picture needs.
    """
    is_touched = space.signature > 0
    for cut in space.cuts:
        is_touched = is_touched | cut.is_cut | cut.is_tip
    mesh, plane = space.mesh, space.dim == 2
    if plane:
        is_near = _near_tip(space, mesh.points[mesh.edges])
        is_touched = is_touched | is_near[mesh.cell_to_edge].any(axis=1)
    plain_cells, touched_cells = np.nonzero(~is_touched)[0], np.nonzero(is_touched)[0]
    subs = sub_cells(space, touched_cells)
    cell, bary, side = (
        _without_exits(space, subs) if plane else (subs.cell, subs.bary.copy(), subs.side.copy())
    )
    is_reversed = np.linalg.det(bary) < 0
    bary[is_reversed, -2:] = bary[is_reversed, -2:][:, ::-1]
    for _ in range(_LEVELS if plane else 0):
        cell, bary, side = _halve_edges(space, cell, bary, side)
    return PieceCells(plain_cells, cell, bary, side)


def _near_tip(space: FunctionSpace, ends: Floats) -> Bools:
    """Edges `(..., 2, d)` to be halved: a matter of the edge alone, so that neighbours agree."""
    if not space.tips:
        return np.zeros(ends.shape[:-2], dtype=bool)
    tips = cKDTree(np.array([tip.x for tip in space.tips]))
    length = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
    return np.asarray(tips.query(ends.mean(axis=-2))[0] < _REACH * length)


def _halve_edges(
    space: FunctionSpace, cell: Ints, bary: Floats, side: Ints
) -> tuple[Ints, Floats, Ints]:
    """Halve the edges of triangles near a tip."""
    pairs = local_edges(2)
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[space.mesh.cells[cell]])
    mark = _near_tip(space, x[:, pairs])
    nodes = np.concatenate([bary, bary[:, pairs].mean(axis=2)], axis=1)
    unmarked_rows = np.nonzero(~mark.any(axis=1))[0]
    rows, parts = [unmarked_rows], [bary[unmarked_rows]]
    for pattern, triangles in _PARTS.items():
        rows_of_pattern = np.nonzero((mark == pattern).all(axis=1))[0]
        for triangle in triangles:
            rows.append(rows_of_pattern)
            parts.append(nodes[rows_of_pattern][:, triangle])
    all_rows = np.concatenate(rows)
    return cell[all_rows], np.concatenate(parts), side[all_rows]


def _without_exits(space: FunctionSpace, subs: SubCells) -> tuple[Ints, Floats, Ints]:
    """Join the two sub-cells of a tip cell that meet where the prolonged crack leaves it.

    No function jumps there, and the cell ahead is whole: its edge would not fit two.
    """
    bary, side = subs.bary.copy(), subs.side.copy()
    keep = np.ones(len(bary), dtype=bool)
    corner = space.mesh.cells[subs.cell]
    for c, cut in enumerate(space.cuts):
        if not cut.n_tips:
            continue
        phi = np.einsum("svb,sb->sv", bary, cut.level_set.phi[corner])
        psi = np.einsum("svb,sb->sv", bary, cut.level_set.psi_of_ends[corner])
        tolerance = 1e-9 * space.mesh.cell_size[subs.cell][:, None]
        exits = (np.abs(phi) <= tolerance) & (psi > 0) & (bary.max(axis=2) < 1 - 1e-12)
        exits &= (subs.fan & cut.is_tip[subs.cell])[:, None]
        previous_rows, next_rows = np.nonzero(exits[:, 2])[0], np.nonzero(exits[:, 1])[0]
        _, i, j = np.intersect1d(
            subs.cell[previous_rows], subs.cell[next_rows], return_indices=True
        )
        previous_rows, next_rows = previous_rows[i], next_rows[j]
        bary[previous_rows, 2] = bary[next_rows, 2]
        side[previous_rows, c] = 0
        keep[next_rows] = False
    return subs.cell[keep], bary[keep], side[keep]


_SAME = 1e-9  # share of a cell within which points are one, or lie on a lip


@dataclass(frozen=True, eq=False)
class Pieces:
    """A body cut into simplices that show every jump.

    The nodes of a piece are its vertices, then the midpoints of its edges.

    Attributes
    ----------
    solution : Solution
    points : (n, d) array, length
        Twice where a crack is, once for each lip, and once for each material at interfaces.
    displacement : (n, d) array, length
    stress : (n, 3, 3) array, stress
        Mean of the pieces that meet at the point on the same lip, weighted by their size. At a
        tip or front, where it is infinite, each gives the value half way to its centre.
    plain_nodes : (m, k) array of int
        Cells without enriched functions, with the nodes of the order of the solution.
    split : (s, k) array of int
        Sub-cells of the other cells, always with midpoints.
    cell : (m + s,) array of int
        Mesh cell of each piece, plain ones first.
    side : (m + s, cracks) array of int
        Side of each crack, 0 where that means nothing.
    center_stress : (m + s, 3, 3) array, stress
        At the centre of each piece, no mean.
    phi : (cracks, n) array, length
        Signed distance to each crack.
    psi : tuple of (tips, n) arrays, length
        Signed distance to each tip along each crack.
    """

    solution: Solution
    points: Floats
    displacement: Floats
    stress: Floats
    plain_nodes: Ints
    split: Ints
    cell: Ints
    side: Ints
    center_stress: Floats
    phi: Floats
    psi: tuple[Floats, ...]

    @cached_property
    def corners(self) -> Ints:
        """Vertices of all pieces `(m + s, d + 1)`."""
        d = self.points.shape[1]
        return lock(np.concatenate([self.plain_nodes[:, : d + 1], self.split[:, : d + 1]]))

    @cached_property
    def material(self) -> Ints:
        """Which of the named materials of the body each point has `(n,)`."""
        set_number = self.solution.problem.elasticity.set_number
        result = np.zeros(len(self.points), dtype=np.int64)
        if len(set_number):
            for block, cells in zip(
                (self.plain_nodes, self.split),
                np.split(self.cell, [len(self.plain_nodes)]),
                strict=True,
            ):
                result[block] = set_number[cells][:, None]
        return lock(result)

    @cached_property
    def volume(self) -> Floats:
        """Volume of all pieces `(m + s,)`, length^d."""
        return lock(_volume(self.points[self.corners]))

    @cached_property
    def enriched(self) -> Ints:
        """What acts on each piece: 0 nothing, 1 Heaviside, 2 tip functions, 3 both."""
        space = self.solution.space
        heaviside = space.signature & ((1 << len(space.cuts)) - 1)
        return lock(((heaviside > 0) + 2 * space.has_tip)[self.cell].astype(np.int64))


def pieces(solution: Solution) -> Pieces:
    """Cut the body of a solution into pieces and evaluate the solution on them."""
    space = solution.space
    mesh, d = space.mesh, space.dim
    cells = piece_cells(space)
    plain_cells = cells.plain_cells
    whole_pieces = np.broadcast_to(np.eye(d + 1), (len(plain_cells), d + 1, d + 1))
    blocks = [
        _Block.of(space, plain_cells, whole_pieces, space.order),
        _Block.of(space, cells.cell, cells.bary, 2, cells.side),
    ]
    nodes = space.cell_nodes[plain_cells]
    nodes_in_use, first, number = np.unique(nodes, return_index=True, return_inverse=True)
    number = number.reshape(nodes.shape)
    is_shared = np.isin(nodes_in_use, space.cell_nodes[np.unique(cells.cell)])
    joined_numbers, n, source = _join(space, blocks, nodes_in_use, first, is_shared)
    point = [number.ravel(), joined_numbers]

    x = np.empty((n, d))
    u = np.empty((n, d))
    with np.errstate(divide="ignore", invalid="ignore"):  # the gradient at a tip, not looked at
        x[joined_numbers], u[joined_numbers] = blocks[1].x, solution.at(*blocks[1].places)[0]
    x[: len(nodes_in_use)], u[: len(nodes_in_use)] = (
        space.node_points[nodes_in_use],
        solution.coefficients[nodes_in_use],
    )
    stress, center = zip(*[_stresses(solution, block) for block in blocks], strict=True)
    weight = np.concatenate([block.weight for block in blocks])
    ids, origin = np.concatenate(point), np.arange(n)
    set_number = solution.problem.elasticity.set_number
    if len(set_number):
        owner = np.concatenate([block.places[0] for block in blocks])
        ids, origin = _apart_by_material(ids, set_number[owner], n)
        n, x, u, source = len(origin), x[origin], u[origin], source[origin]
        number, joined_numbers = ids[: number.size].reshape(number.shape), ids[number.size :]
    total = np.bincount(ids, weight, n)
    values = np.concatenate(stress).reshape(-1, 9)
    mean = np.stack([np.bincount(ids, weight * v, n) / total for v in values.T], axis=1)

    cell, bary = (np.concatenate([b.places[i] for b in blocks]) for i in (0, 1))
    corner = mesh.cells[cell[source]]
    levels = [cut.level_set for cut in space.cuts]
    return Pieces(
        solution=solution,
        points=lock(x),
        displacement=lock(u),
        stress=lock(mean.reshape(-1, 3, 3)),
        plain_nodes=lock(number),
        split=lock(joined_numbers.reshape(-1, n_shapes(2, d))),
        cell=lock(np.concatenate([plain_cells, cells.cell])),
        side=lock(np.concatenate([cell_side(space, plain_cells), cells.side])),
        center_stress=lock(np.concatenate(center)),
        phi=lock(
            np.array([c.level(mesh, cell[source], bary[source]) for c in space.cuts]).reshape(-1, n)
        ),
        psi=tuple(np.einsum("nb,fnb->fn", bary[source], s.psi[:, corner]) for s in levels),
    )


def _apart_by_material(point: Ints, material: Ints, n: int) -> tuple[Ints, Ints]:
    """Points of nodes `(q,)` of which each has one material, and the point each was `(m,)`."""
    key, number = np.unique(point * (material.max() + 1) + material, return_inverse=True)
    old_point = key // (material.max() + 1)
    first = np.append(True, old_point[1:] != old_point[:-1])  # it keeps its number
    new_number = np.where(first, old_point, n - 1 + np.cumsum(~first))
    origin = np.empty(n + int((~first).sum()), dtype=np.int64)
    origin[new_number] = old_point
    return new_number[number], origin


@dataclass(frozen=True, eq=False)
class _Block:
    """Nodes of pieces, piece by piece: cell, coordinates in it, sides, place, weight."""

    places: tuple[Ints, Floats, Ints]
    x: Floats
    weight: Floats
    center: tuple[Ints, Floats, Ints]

    @classmethod
    def of(
        cls, space: FunctionSpace, cell: Ints, corners: Floats, order: int, side: Ints | None = None
    ) -> "_Block":
        side = cell_side(space, cell) if side is None else side
        bary = corners
        if order == 2:
            middle = corners[:, local_edges(space.dim)].mean(axis=2)
            bary = np.concatenate([corners, middle], axis=1)
        k = bary.shape[1]
        bary_rows = bary.reshape(-1, space.dim + 1)
        owner = np.repeat(cell, k)
        volume = np.abs(np.linalg.det(corners)) * space.mesh.volume[cell]
        return cls(
            (owner, bary_rows, np.repeat(side, k, axis=0)),
            position(space, owner, bary_rows),
            # A piece too thin for its volume to be distinguished from zero still has a weight.
            np.repeat(np.maximum(volume, 1e-30 * space.mesh.volume[cell]), k),
            (cell, corners.mean(axis=1), side),
        )


def _join(
    space: FunctionSpace, blocks: list[_Block], nodes_in_use: Ints, first: Ints, is_shared: Bools
) -> tuple[Ints, int, Ints]:
    """Points of the split pieces `(q,)`: one for each place and lip; plain nodes come first.

    Also the number of points, and for each a row of the two blocks in which it occurs.
    """
    plain_block, split = blocks
    n_plain, n_rows = len(nodes_in_use), len(plain_block.weight)
    shared_rows = np.nonzero(is_shared)[0]
    cell, bary, side = (
        np.concatenate([a[first[shared_rows]], b])
        for a, b in zip(plain_block.places, split.places, strict=True)
    )
    x = np.concatenate([plain_block.x[first[shared_rows]], split.x])
    size = float(space.mesh.cell_size.min())
    key = np.concatenate([(x - x[:1]) / size, 3.0 * _lip(space, cell, bary, side)], axis=1)
    group = _place_numbers(key)
    point = np.full(group.max(initial=-1) + 1, -1, dtype=np.int64)
    point[group[: len(shared_rows)]] = shared_rows
    new_points = np.nonzero(point < 0)[0]
    point[new_points] = n_plain + np.arange(len(new_points))
    _, group_rows = np.unique(group, return_index=True)
    source = np.concatenate([first, n_rows + group_rows[new_points] - len(shared_rows)])
    return point[group[len(shared_rows) :]], n_plain + len(new_points), source


def _place_numbers(key: Floats) -> Ints:
    """Number of the place of each row: rows closer than `_SAME` share it.

    Most rows are equal when rounded; only one of these is compared with others.
    """
    _, place_rows, group_of_place = np.unique(
        np.round(key / _SAME).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    pairs = cKDTree(key[place_rows]).query_pairs(_SAME, output_type="ndarray")
    n = len(place_rows)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    return np.asarray(group[group_of_place.ravel()], dtype=np.int64)


def _lip(space: FunctionSpace, cell: Ints, bary: Floats, side: Ints) -> Ints:
    """Lip of each crack on which points lie `(q, cracks)`: +1, -1, or 0 off the crack."""
    lip = np.zeros(side.shape, dtype=np.int64)
    tolerance = _SAME * space.mesh.cell_size[cell]
    corner = space.mesh.cells[cell]
    for c, cut in enumerate(space.cuts):
        phi = cut.level(space.mesh, cell, bary)
        # A crack without tips lies behind them everywhere.
        psi = (bary * np.maximum(cut.level_set.psi_of_ends, -1e300)[corner]).sum(axis=1)
        lip[:, c] = np.where((np.abs(phi) <= tolerance) & (psi < -tolerance), side[:, c], 0)
    return lip


def _stresses(solution: Solution, block: _Block) -> tuple[Floats, Floats]:
    """Stress at the nodes of pieces, and at their centres."""
    cell, bary, side = block.places
    center = block.center[1]
    n_nodes = len(cell) // max(len(center), 1)
    if solution.space.tips:
        inner_bary = (bary + np.repeat(center, n_nodes, axis=0)) / 2
        bary = np.where(_at_tip(solution.space, cell, bary)[:, None], inner_bary, bary)
    return full_stress(solution, cell, bary, side), full_stress(solution, *block.center)


def _at_tip(space: FunctionSpace, cell: Ints, bary: Floats) -> Bools:
    """Which points `(q,)` lie at a tip or on a front, as the level sets have it."""
    corner = space.mesh.cells[cell]
    nearest_distance = np.full(len(cell), np.inf)
    for cut in space.cuts:
        phi = np.einsum("qb,qb->q", bary, cut.level_set.phi[corner])
        for level in cut.level_set.psi:
            psi = np.einsum("qb,qb->q", bary, level[corner])
            nearest_distance = np.minimum(nearest_distance, np.hypot(phi, psi))
    return np.asarray(nearest_distance < _SAME * space.mesh.cell_size[cell])


def full_stress(solution: Solution, cell: Ints, bary: Floats, side: Ints) -> Floats:
    """Stress tensor `(q, 3, 3)` at points given by cell, out of the plane too.

    An initial stress of a plane body is taken to have no part out of the plane.
    """
    d = solution.space.dim
    stress = np.zeros((len(cell), 3, 3))
    stress[:, :d, :d] = solution.stress_at(cell, bary, side)
    if d == 2:
        elastic_stress = stress[:, :d, :d] - initial_stress_at(solution, cell, bary)
        stress[:, 2, 2] = solution.problem.elasticity.stress_across(elastic_stress, cell, bary)
    return stress


def _volume(x: Floats) -> Floats:
    d = x.shape[-1]
    scale = (1, 1, 2, 6)[d]
    return np.asarray(np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / scale)


@dataclass(frozen=True, eq=False)
class Lips:
    """Fields on the faces of one crack, at their integration points in the order of the crack.

    Attributes
    ----------
    x, normal : (q, d) arrays
    s : (q,) array, length
    pressure, gap : (q,) arrays
        Pressure of contact, 0 without; normal opening.
    is_closed : (q,) array of bool
    jump : (q, d) array, length
        Displacement of lip + minus that of lip -.
    minus, plus : (q, d) arrays, length
        Displacement of each lip.
    runs : tuple of (k,) arrays of int
        Points that follow each other without leaving the body.
    """

    x: Floats
    normal: Floats
    s: Floats
    pressure: Floats
    gap: Floats
    is_closed: Bools
    jump: Floats
    minus: Floats
    plus: Floats
    runs: tuple[Ints, ...]


def lips_of(solution: Solution, crack: int) -> Lips:
    """Fields on the faces of a crack."""
    lips, contact = solution.lips[crack], solution.contact[crack]
    tangents = [
        solution.at(cell, bary, lip_side(solution.space, crack, cell, bary, sign))
        for cell, bary, sign in zip(lips.cell.T, lips.bary.transpose(1, 0, 2), (-1, 1))
    ]
    ends = solution.space.cuts[crack].lip_points(solution.space.mesh)[lips.segment]
    gaps = np.linalg.norm(ends[1:, :, None] - ends[:-1, None], axis=3).min(axis=(1, 2))
    size = solution.space.mesh.cell_size[lips.cell[1:, 1]]
    leaves = (np.diff(lips.segment) != 0) & (gaps > 1e-6 * size)
    runs = np.split(np.arange(len(lips)), np.nonzero(leaves)[0] + 1)
    opening = solution.opening(crack)
    return Lips(
        lips.x,
        lips.normal,
        lips.s,
        np.zeros(len(lips)) if contact is None else contact.pressure,
        opening if contact is None else contact.gap,
        np.zeros(len(lips), dtype=bool) if contact is None else contact.closed,
        solution.jump(crack),
        tangents[0][0],
        tangents[1][0],
        tuple(run for run in runs if len(run)),
    )


__all__ = []
