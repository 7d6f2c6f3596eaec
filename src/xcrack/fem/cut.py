"""Cut of a mesh by a crack: sub-cells, lips and the cells at tips and fronts.

All topology comes from the linear interpolant of the nodal level set, so that it is watertight
from cell to cell. Sub-cell fractions are products of positive cut positions (no cancellation):
tiny pieces keep their relative accuracy.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.crack.placing_2d import ON_MESH
from xcrack.fem.kinks_2d import NO_KINKS, Kinks, sharpened_cut
from xcrack.fem.level_set import LevelSet
from xcrack.mesh.locate import barycentric
from xcrack.mesh.mesh import Mesh, local_edges
from xcrack.mesh.simplex import cut_simplices, interface_simplices

_ROUND_OFF = 1e-14  # sub-cells below this share of their cell are left out: they are determinants


SubParts = tuple[Ints, Floats, Floats, Ints]  # cell, barycentric vertices, share, side
LipParts = tuple[Ints, Floats]  # cell, barycentric vertices


@dataclass(frozen=True, eq=False)
class CutEnds:
    """Two points on the boundary of each triangle in which φ changes sign: place, ψ and edge."""

    bary: Floats
    psi: Floats
    edge: Ints


def _cut_points(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats, has_position: Bools
) -> CutEnds:
    """The two points where phi = 0 meets the boundary of triangles in which it changes sign."""
    pairs = local_edges(mesh.dim)
    edge = mesh.cell_to_edge[cells]
    phi = level_set.phi[mesh.cells[cells]]
    on_vertex = phi == 0
    on_edge = has_position[edge]
    n_vertices = mesh.dim + 1
    flags = np.concatenate([on_edge, on_vertex], axis=1)
    order = np.argsort(~flags, axis=1, kind="stable")[:, : mesh.dim]
    bary = np.zeros((len(cells), mesh.dim, n_vertices))
    number = np.full((len(cells), mesh.dim), -1, dtype=np.int64)
    row = np.arange(len(cells))
    for k in range(mesh.dim):
        choice = order[:, k]
        vertex = choice >= len(pairs)
        bary[row[vertex], k, choice[vertex] - len(pairs)] = 1.0
        e = choice[~vertex]
        i, j = pairs[e].T
        # Both cut positions are computed from the values, never one as 1 minus the other.
        a, b = phi[~vertex, i], phi[~vertex, j]
        bary[row[~vertex], k, i] = b / (b - a)
        bary[row[~vertex], k, j] = a / (a - b)
        number[row[~vertex], k] = edge[row[~vertex], e]
    psi_at_vertices = level_set.psi_of_ends[mesh.cells[cells]]
    psi = np.einsum("cvb,cb->cv", bary, psi_at_vertices)
    return CutEnds(bary, psi, number)


def tip_parts(
    mesh: Mesh, level_set: LevelSet, positions: Floats, has_position: Bools
) -> list[tuple[SubParts, LipParts, Ints]]:
    """Sub-cells, lips and entry edges of the cells at each tip; see `_tip_cells`."""
    return [
        _tip_cells(mesh, level_set, k, cells, positions, has_position)
        for k, cells in enumerate(level_set.tip_cells)
    ]


def _tip_cells(
    mesh: Mesh, level_set: LevelSet, k: int, cells: Ints, positions: Floats, has_position: Bools
) -> tuple[SubParts, LipParts, Ints]:
    """Fans of sub-cells from tip k, the crack face piece that ends there, and its entry edges."""
    tip = level_set.tip[k]
    apex = barycentric(mesh, cells, np.broadcast_to(tip, (len(cells), mesh.dim)))
    # Round-off of a tip on a facet would leave a sub-cell without area whose points hit the tip.
    apex = np.where(apex > ON_MESH, apex, 0.0)
    apex /= apex.sum(axis=1, keepdims=True)
    phi = level_set.phi[mesh.cells[cells]]
    is_crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    owner, bary, side = [], [], []
    lip_cells, lip_bary, entries = [], [], []
    ends = _cut_points(mesh, level_set, cells[is_crossed], positions, has_position)
    row_of, corners = np.cumsum(is_crossed) - 1, np.eye(mesh.dim + 1)
    for i, cell in enumerate(cells):
        loop: list[Floats] = []
        for v in range(mesh.dim + 1):
            loop.append(corners[v])
            a, b = phi[i, v], phi[i, (v + 1) % 3]
            if a * b < 0:
                point = np.zeros(3)
                point[v], point[(v + 1) % 3] = b / (b - a), a / (a - b)
                loop.append(point)
        for p, q in zip(loop, loop[1:] + loop[:1], strict=True):
            middle = phi[i] @ (p + q)
            owner.append(cell)
            bary.append([apex[i], p, q])
            largest_phi = phi[i, np.argmax(np.abs(phi[i]))]
            side.append(1 if (middle if middle != 0 else largest_phi) >= 0 else -1)
        if is_crossed[i]:
            e = row_of[i]
            psi = level_set.psi[k][mesh.cells[cell]] @ ends.bary[e].T
            first = int(np.argmin(psi))
            if psi[first] < -1e-9 * mesh.cell_size[cell]:
                lip_cells.append(cell)
                lip_bary.append([ends.bary[e, first], apex[i]])
                if ends.edge[e, first] >= 0:
                    entries.append(ends.edge[e, first])
    b = np.array(bary, dtype=float).reshape(-1, 3, 3)
    fraction = np.abs(np.linalg.det(b))
    keep = fraction > _ROUND_OFF
    subs = (np.array(owner)[keep], b[keep], fraction[keep], np.array(side, dtype=np.int64)[keep])
    parent_cells = np.array(lip_cells, dtype=np.int64)
    ends_of_lips = np.array(lip_bary, dtype=float).reshape(-1, 2, 3)
    return subs, (parent_cells, ends_of_lips), np.array(entries, dtype=np.int64)


def lips_up_to_tips(
    mesh: Mesh, level_set: LevelSet, facets: Ints, cells: Ints, psi: Floats
) -> tuple[Floats, Ints]:
    """Ends of the crack faces on edges of the mesh, and the facet of each.

    Those at a tip end there.
    """
    x = mesh.points[mesh.facets[facets]]
    ends_at_tip = np.zeros(len(facets), dtype=bool)
    for k, tip in enumerate(level_set.tip):
        psi_of_facets = level_set.psi[k][mesh.facets[facets]]
        length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        front_corner, back_corner = psi_of_facets.argmax(axis=1), psi_of_facets.argmin(axis=1)
        row = np.arange(len(facets))
        is_at_tip = (psi_of_facets[row, front_corner] > -1e-9 * length) & (
            psi_of_facets[row, back_corner] < -1e-9 * length
        )
        is_at_tip &= np.isin(cells, level_set.tip_cells[k]).any(axis=1)
        begin = x[row, back_corner]
        x = np.where(
            is_at_tip[:, None, None], np.stack([begin, np.broadcast_to(tip, begin.shape)], 1), x
        )
        ends_at_tip |= is_at_tip
    candidate_facets = np.nonzero(ends_at_tip | (psi.mean(axis=1) < 0))[0]
    return x[candidate_facets], candidate_facets


# Cells at the fronts of a crack in 3D: cut by phi, then by psi.

_AT = 1e-10  # share of a cell's range of psi below which a vertex lies on the front
_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def front_parts(
    mesh: Mesh, level_set: LevelSet, positions: Floats, has_position: Bools
) -> list[tuple[tuple[Ints, Floats, Floats, Ints], tuple[Ints, Floats], Ints]]:
    """Sub-cells, lips and entry edges of the cells at all fronts together; see `_front_subs`."""
    is_tip = np.zeros(len(mesh.cells), dtype=bool)
    for cells in level_set.tip_cells:
        is_tip[cells] = True
    return [_front_subs(mesh, level_set, np.nonzero(is_tip)[0], positions)]


def corner_places(mesh: Mesh, level_set: LevelSet, cells: Ints) -> Floats:
    """Corners of cells, the values of the level sets there as further coordinates `(k, d + 1, c)`.

    Distances between them tell corners apart that cells of regular meshes have alike; none in 2D.
    """
    if mesh.dim == 2:  # rules on triangles are symmetric enough: their order may decide
        return np.zeros((0, 3, 1))
    nodes = mesh.cells[cells]
    values = np.stack([level_set.phi, level_set.psi_of_ends], axis=1)
    return np.concatenate([mesh.points[nodes], values[nodes]], axis=2)


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
    is_crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    whole_cells, split = np.nonzero(~is_crossed)[0], np.nonzero(is_crossed)[0]
    corners = corner_places(mesh, level_set, cells)
    bary, share, side, parent = cut_simplices(phi[split], corners[split])
    largest_phi = np.take_along_axis(phi, np.abs(phi).argmax(axis=1)[:, None], 1)[:, 0]
    owner = np.concatenate([whole_cells, split[parent]])
    bary = np.concatenate([np.broadcast_to(np.eye(4), (len(whole_cells), 4, 4)), bary])
    share = np.concatenate([np.ones(len(whole_cells)), share])
    side = np.concatenate([np.where(largest_phi[whole_cells] >= 0, 1, -1), side])
    for psi in level_set.psi:
        values = psi[mesh.cells[cells]]
        owner, bary, share, side = _cut_again(values, corners, owner, bary, share, side)
    lip, row = interface_simplices(phi[split], corners[split])
    lip_owner = split[row]
    psi_at_lips = np.einsum("svb,sb->sv", lip, level_set.psi_of_ends[mesh.cells[cells[lip_owner]]])
    part, row = parts_behind(psi_at_lips, np.einsum("svb,sbd->svd", lip, corners[lip_owner]))
    lips = np.einsum("svw,swb->svb", part, lip[row])
    edges = np.unique(mesh.cell_to_edge[cells])
    t = positions[edges]
    a, b = mesh.edges[edges].T
    at = (1 - t) * level_set.psi_of_ends[a] + t * level_set.psi_of_ends[b]
    size = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    with np.errstate(invalid="ignore"):
        entry = edges[(at < -_AT * size) & level_set.is_near[edges]]
    return (cells[owner], bary, share, side), (cells[lip_owner[row]], lips), entry


def _cut_again(
    psi: Floats, corners: Floats, owner: Ints, bary: Floats, share: Floats, side: Ints
) -> tuple[Ints, Floats, Floats, Ints]:
    """Cut sub-cells along psi, given as the places at the corners of their cells `(k, 4)`."""
    values = _snapped_values(np.einsum("svb,sb->sv", bary, psi[owner]), psi[owner])
    cut = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    whole_cells, rows = np.nonzero(~cut)[0], np.nonzero(cut)[0]
    x = np.einsum("svb,sbd->svd", bary[rows], corners[owner[rows]])
    bary_in_sub, part, _, parent = cut_simplices(values[rows], x)
    source = rows[parent]
    bary_of_parts = np.einsum("svw,swb->svb", bary_in_sub, bary[source])
    source_rows = np.concatenate([whole_cells, source])
    result = np.concatenate([share[whole_cells], share[source] * part])
    keep = result > _NOTHING
    vertices = np.concatenate([bary[whole_cells], bary_of_parts])
    return owner[source_rows][keep], vertices[keep], result[keep], side[source_rows][keep]


def lips_up_to_fronts(
    mesh: Mesh, level_set: LevelSet, facets: Ints, cells: Ints, psi: Floats
) -> tuple[Floats, Ints]:
    """Corners of the crack faces on facets of the mesh, and the facet of each.

    Those behind fronts.
    """
    x = mesh.points[mesh.facets[facets]]
    part, row = parts_behind(psi, x)
    return np.einsum("svb,sbd->svd", part, x[row]), row


def parts_behind(psi: Floats, x: Floats | None = None) -> tuple[Floats, Ints]:
    """Parts of triangles x `(k, 3, 3)` on which psi `(k, 3)` is negative, and their triangles.

    Vertices `(s, 3, 3)` in barycentric coordinates, and numbers `(s,)`.
    """
    values = _snapped_values(psi, psi)
    cut = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    whole_cells = np.nonzero(~cut & (values.min(axis=1) < 0))[0]
    rows = np.nonzero(cut)[0]
    bary_in_triangle, _, side, parent = cut_simplices(values[rows], None if x is None else x[rows])
    is_behind = side < 0
    corner = np.broadcast_to(np.eye(3), (len(whole_cells), 3, 3))
    return np.concatenate([corner, bary_in_triangle[is_behind]]), np.concatenate(
        [whole_cells, rows[parent[is_behind]]]
    )


def _snapped_values(values: Floats, scale: Floats) -> Floats:
    tolerance = _AT * np.abs(scale).max(axis=1, keepdims=True)
    return np.where(np.abs(values) < tolerance, 0.0, values)


_Subs = tuple[Ints, Floats, Floats, Ints]  # cell, barycentric vertices, share, side


@dataclass(frozen=True, eq=False)
class Cut:
    """Where one crack runs through a mesh.

    Attributes
    ----------
    level_set : LevelSet
    cells : (k,) array of int
        Cells cut from side to side (cells at tips and fronts are not among them).
    sub_to_cell, sub_bary, sub_fraction, sub_side : arrays
        Sub-cells of the cut cells and of the tip cells: mesh cell, barycentric coordinates of the
        vertices `(s, d + 1, d + 1)`, share of the cell's volume, side +1 or -1. In 2D vertex 0
        of every sub-cell of a tip cell is the tip; in 3D no sub-cell at a front has parts both
        ahead of it and behind.
    lip_cell : (l, 2) array of int
        Cell on side - and on side + of each lip segment or triangle; twice the same inside a cell.
    lip_bary : (l, 2, d, d + 1) array
        Its vertices in the barycentric coordinates of these cells.
    lip_normal : (l, d) array
        From lip - to lip +.
    cut_edge : (e,) array
        Cut position on each mesh edge, from its first point, nan where the crack does not cross.
    side : (m,) array of int
        Side of each cell, 0 where phi changes its sign in it.
    kinks : Kinks
        In 2D: where the crack is not cut as phi says.
    """

    level_set: LevelSet
    cells: Ints
    sub_to_cell: Ints
    sub_bary: Floats
    sub_fraction: Floats
    sub_side: Ints
    lip_cell: Ints
    lip_bary: Floats
    lip_normal: Floats
    cut_edge: Floats
    side: Ints
    kinks: Kinks = NO_KINKS

    @cached_property
    def is_cut(self) -> Bools:
        """Which cells are cut from side to side `(m,)`."""
        flag = np.zeros(len(self.side), dtype=bool)
        flag[self.cells] = True
        return lock(flag)

    @cached_property
    def is_tip(self) -> Bools:
        """Which cells contain a tip `(m,)`."""
        flag = np.zeros(len(self.side), dtype=bool)
        for cells in self.level_set.tip_cells:
            flag[cells] = True
        return lock(flag)

    def level(self, mesh: Mesh, cell: Ints, bary: Floats) -> Floats:
        """A level set whose zero is the cut, at points of cells `(q,)`, length."""
        result = np.einsum("qb,qb->q", bary, self.level_set.phi[mesh.cells[cell]])
        if len(self.kinks.cells):
            row = np.full(len(mesh.cells), -1)
            row[self.kinks.cells] = np.arange(len(self.kinks.cells))
            rows_at_kinks = np.nonzero(row[cell] >= 0)[0]
            result[rows_at_kinks] = self.kinks.level(row[cell[rows_at_kinks]], bary[rows_at_kinks])
        return np.asarray(result)

    @property
    def n_tips(self) -> int:
        """Number of tips of the crack."""
        return len(self.level_set.psi)

    def lip_points(self, mesh: Mesh) -> Floats:
        """Vertices of the segments or triangles of the crack faces `(l, d, d)`, length."""
        return np.einsum(
            "lvb,lbd->lvd", self.lip_bary[:, 1], mesh.points[mesh.cells[self.lip_cell[:, 1]]]
        )


@dataclass(frozen=True, eq=False)
class _Lips:
    cell: Ints
    bary: Floats


@dataclass(frozen=True)
class CellGeometry:
    """What cells of a plane body and of one in space do in ways of their own.

    Attributes
    ----------
    end_parts : callable
        Cells at tips or fronts, in parts.
    lips_up_to_ends : callable
        Where lips on facets of the mesh end.
    across_lips : callable
        A vector across each lip, given by its corners `(l, d, d)`.
    tip_radii : callable (mesh, cracks, cuts, order, wanted radius or None, places of junctions)
        Of the disc around each tip, or the tube around each front, by crack; length.
    split_facets : callable
        Facets `(k, d)`, given by their points, split where cracks cross them, as `FacetParts`; in
        3D those of cells at a front along psi too.
    facet_points : callable
        Integration points of `part_points`.
    lip_positions : callable
        Along the crack from where it enters the body; zero in 3D, where points have no order.
    joined_cuts : callable (mesh, cuts of cracks drawn beyond those on which they end, junctions)
        Cuts without what lies beyond junctions, and the junctions in the mesh.
    nodes_at_joint : callable
        Nodes that a junction may change, and those close to it.
    least_trace : float
        Share of the largest singular value below which traces of enriched functions on supports do
        not count. A tube that just reaches a side of a 3D body has traces there so small that they
        would buy any value with a coefficient of any size inside the body.
    """

    end_parts: Callable[..., Any]
    lips_up_to_ends: Callable[..., tuple[Floats, Ints]]
    across_lips: Callable[[Floats], Floats]
    tip_radii: Callable[..., list[tuple[float, ...]]]
    split_facets: Callable[..., Any]
    facet_points: Callable[..., tuple[Ints, Floats, Floats]]
    lip_positions: Callable[[Floats, Floats, Floats], Floats]
    joined_cuts: Callable[..., Any]
    nodes_at_joint: Callable[..., tuple[Bools, Bools]]
    least_trace: float


def cut(mesh: Mesh, level_set: LevelSet, geometry: CellGeometry) -> Cut:
    """Cut a mesh along the level sets of a crack."""
    phi = level_set.phi
    values = phi[mesh.cells]
    columns = np.ascontiguousarray(values.T)  # minima of few values are quick along the first axis
    phi_min = columns.min(axis=0)
    is_crossed = (phi_min < 0) & (columns.max(axis=0) > 0)
    positions, has_position = _edge_positions(mesh, phi)
    is_tip = np.zeros(len(mesh.cells), dtype=bool)
    for cells in level_set.tip_cells:
        is_tip[cells] = True
    candidates = np.nonzero(is_crossed & ~is_tip)[0]
    lip, owner = interface_simplices(values[candidates], corner_places(mesh, level_set, candidates))
    psi = np.einsum("svb,sb->s", lip, level_set.psi_of_ends[mesh.cells[candidates[owner]]])
    sign_change = has_position[mesh.cell_to_edge[candidates]]
    is_close = (level_set.is_near[mesh.cell_to_edge[candidates]] | ~sign_change).all(axis=1)
    is_through = is_close & (np.bincount(owner, psi, len(candidates)) < 0)
    cells = candidates[is_through]

    edge_flag = np.zeros(len(mesh.edges), dtype=bool)
    edge_flag[mesh.cell_to_edge[cells]] = True
    kinks = NO_KINKS
    if len(level_set.line) > 2:
        at = np.where(edge_flag, positions, np.nan)
        kinks, at = sharpened_cut(mesh, level_set, cells, at)
        positions = np.where(edge_flag, at, positions)
    if len(kinks.cells):
        subs, lips = _kinked_parts(kinks, values, cells)
    else:
        corners = corner_places(mesh, level_set, cells)
        bary, fraction, side, parent = cut_simplices(values[cells], corners)
        subs = [(cells[parent], bary, fraction, side)]
        lips = [_inner_lips(candidates[owner[is_through[owner]]], lip[is_through[owner]])]
    for end_subs, end_lips, entry in geometry.end_parts(mesh, level_set, positions, has_position):
        subs.append(end_subs)
        lips.append(_inner_lips(*end_lips))
        edge_flag[entry] = True
    lips.append(_facet_lips(mesh, level_set, geometry))
    lip_cell = np.concatenate([part.cell for part in lips])
    lip_bary = np.concatenate([part.bary for part in lips])
    return Cut(
        level_set=level_set,
        cells=lock(cells),
        sub_to_cell=lock(np.concatenate([s[0] for s in subs])),
        sub_bary=lock(np.concatenate([s[1] for s in subs])),
        sub_fraction=lock(np.concatenate([s[2] for s in subs])),
        sub_side=lock(np.concatenate([s[3] for s in subs])),
        lip_cell=lock(lip_cell),
        lip_bary=lock(lip_bary),
        lip_normal=lock(_lip_normals(mesh, phi, lip_cell, lip_bary, geometry)),
        cut_edge=lock(np.where(edge_flag & has_position, positions, np.nan)),
        side=lock(np.where(is_crossed, 0, np.where(phi_min >= 0, 1, -1))),
        kinks=kinks,
    )


def _kinked_parts(kinks: Kinks, values: Floats, cells: Ints) -> tuple[list[_Subs], list[_Lips]]:
    """Sub-cells and crack faces of cut cells, in some of which the crack has a kink."""
    values = np.array(values)
    values[kinks.cells] = kinks.values
    rows, split = kinks.split()
    kinked_cells = kinks.cells[rows]
    bary, fraction, side, parent = cut_simplices(values[cells])
    is_straight = ~np.isin(cells[parent], kinked_cells)
    straight_parts = (
        cells[parent][is_straight],
        bary[is_straight],
        fraction[is_straight],
        side[is_straight],
    )
    lip, owner = interface_simplices(values[cells])
    is_straight = ~np.isin(cells[owner], kinked_cells)
    parts = [(cells[owner][is_straight], lip[is_straight])]
    parts += [(kinked_cells, kinks.faces(rows)[:, k]) for k in (0, 1)]
    owner, lip = (np.concatenate(part) for part in zip(*parts, strict=True))
    length = np.abs(lip[:, 1] - lip[:, 0]).max(axis=1)
    keep = length > 1e-13
    return [straight_parts, split], [_inner_lips(owner[keep], lip[keep])]


def _inner_lips(cell: Ints, bary: Floats) -> _Lips:
    """Lips inside cells: the same cell on both sides."""
    return _Lips(np.stack([cell, cell], axis=1), np.stack([bary, bary], axis=1))


def _cell_sides(values: Floats) -> Ints:
    largest_value = np.take_along_axis(values, np.abs(values).argmax(axis=1)[:, None], 1)[:, 0]
    return np.where(largest_value >= 0, 1, -1).astype(np.int64)


def _edge_positions(mesh: Mesh, phi: Floats) -> tuple[Floats, Bools]:
    a, b = phi[mesh.edges].T
    has_position = a * b < 0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(has_position, a / (a - b), np.nan), has_position


def _facet_lips(mesh: Mesh, level_set: LevelSet, geometry: CellGeometry) -> _Lips:
    """Crack faces that lie on facets of the mesh, each assembled once from its two cells."""
    d = mesh.dim
    on_crack = level_set.phi == 0
    no_lips = _Lips(np.zeros((0, 2), np.int64), np.zeros((0, 2, d, d + 1)))
    if on_crack.sum() < d:
        return no_lips
    zero = on_crack[mesh.facets].all(axis=1)
    facets = np.nonzero(zero & (mesh.facet_to_cell[:, 1] >= 0))[0]
    if not len(facets):
        return no_lips
    cells = mesh.facet_to_cell[facets]
    side = _cell_sides(level_set.phi[mesh.cells[cells.ravel()]]).reshape(-1, 2)
    psi = level_set.psi_of_ends[mesh.facets[facets]]
    keep = (psi.min(axis=1) < 0) & (side[:, 0] != side[:, 1])
    facets, cells, side, psi = facets[keep], cells[keep], side[keep], psi[keep]
    if not len(facets):
        return no_lips
    cells = np.where(side[:, :1] > 0, cells[:, ::-1], cells)
    x, row = geometry.lips_up_to_ends(mesh, level_set, facets, cells, psi)
    cells = cells[row]
    bary = np.stack(
        [
            np.stack([barycentric(mesh, cells[:, s], x[:, v]) for v in range(d)], axis=1)
            for s in (0, 1)
        ],
        axis=1,
    )
    return _Lips(cells, np.where(np.abs(bary) < 1e-14, 0.0, bary))


def _lip_normals(
    mesh: Mesh, phi: Floats, cell: Ints, bary: Floats, geometry: CellGeometry
) -> Floats:
    """Unit normals of lip segments, exactly perpendicular to them, towards growing phi."""
    # From a corner of the cell: far from 0 a short segment has lost its direction.
    nodes = mesh.points[mesh.cells[cell[:, 1]]]
    corners = np.einsum("lvb,lbd->lvd", bary[:, 1], nodes - nodes[:, :1])
    slope = np.einsum("lb,lbd->ld", phi[mesh.cells[cell[:, 1]]], mesh.gradient[cell[:, 1]])
    normal = geometry.across_lips(corners)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(length, 1e-300)
    return np.asarray(normal * np.sign(np.einsum("ld,ld->l", normal, slope))[:, None])


def across_segments(corners: Floats) -> Floats:
    """Vectors across lips in 2D `(l, 2)`."""
    segment = corners[:, 1] - corners[:, 0]
    return np.stack([-segment[:, 1], segment[:, 0]], axis=1)


def across_triangles(corners: Floats) -> Floats:
    """Vectors across lips in 3D `(l, 3)`."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
