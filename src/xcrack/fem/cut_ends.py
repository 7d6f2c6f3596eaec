"""Cells at the tips of a crack in 2D: fans of sub-cells, and the crack faces that end there."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.placing_2d import ON_MESH
from xcrack.fem.level_set import LevelSet
from xcrack.mesh.locate import barycentric
from xcrack.mesh.mesh import Mesh, local_edges
from xcrack.mesh.split import cut_simplices, interface_simplices

_ROUND_OFF = 1e-14  # sub-cells below this share of their cell are left out: they are determinants


SubParts = tuple[Ints, Floats, Floats, Ints]  # cell, barycentric vertices, share, side
LipParts = tuple[Ints, Floats]  # cell, barycentric vertices


@dataclass(frozen=True, eq=False)
class CutEnds:
    bary: Floats
    psi: Floats
    edge: Ints


def _cut_points(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats, exists: Bools
) -> CutEnds:
    """The two points where phi = 0 meets the boundary of triangles in which it changes sign."""
    pairs = local_edges(mesh.dim)
    edge = mesh.cell_to_edge[cells]
    phi = level_set.phi[mesh.cells[cells]]
    on_vertex = phi == 0
    on_edge = exists[edge]
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
    inside = level_set.inside[mesh.cells[cells]]
    psi = np.einsum("cvb,cb->cv", bary, inside)
    return CutEnds(bary, psi, number)


def tip_parts(
    mesh: Mesh, level_set: LevelSet, positions: Floats, exists: Bools
) -> list[tuple[SubParts, LipParts, Ints]]:
    """Sub-cells, lips and entry edges of the cells at each tip; see `_tip_cells`."""
    return [
        _tip_cells(mesh, level_set, k, cells, positions, exists)
        for k, cells in enumerate(level_set.tip_cells)
    ]


def _tip_cells(
    mesh: Mesh, level_set: LevelSet, k: int, cells: Ints, positions: Floats, exists: Bools
) -> tuple[SubParts, LipParts, Ints]:
    """Fans of sub-cells from tip k, the crack face piece that ends there, and its entry edges."""
    tip = level_set.tip[k]
    apex = barycentric(mesh, cells, np.broadcast_to(tip, (len(cells), mesh.dim)))
    # Round-off of a tip on a facet would leave a sub-cell without area whose points hit the tip.
    apex = np.where(apex > ON_MESH, apex, 0.0)
    apex /= apex.sum(axis=1, keepdims=True)
    phi = level_set.phi[mesh.cells[cells]]
    crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    owner, bary, side = [], [], []
    lip_cells, lip_bary, entries = [], [], []
    ends = _cut_points(mesh, level_set, cells[crossed], positions, exists)
    row_of = np.cumsum(crossed) - 1
    for i, cell in enumerate(cells):
        corners = [np.eye(mesh.dim + 1)[v] for v in range(mesh.dim + 1)]
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
            largest = phi[i, np.argmax(np.abs(phi[i]))]
            side.append(1 if (middle if middle != 0 else largest) >= 0 else -1)
        if crossed[i]:
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
    both = np.array(lip_cells, dtype=np.int64)
    two = np.array(lip_bary, dtype=float).reshape(-1, 2, 3)
    return subs, (both, two), np.array(entries, dtype=np.int64)


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
        ahead, behind_ = psi_of_facets.argmax(axis=1), psi_of_facets.argmin(axis=1)
        row = np.arange(len(facets))
        reaches = (psi_of_facets[row, ahead] > -1e-9 * length) & (
            psi_of_facets[row, behind_] < -1e-9 * length
        )
        reaches &= np.isin(cells, level_set.tip_cells[k]).any(axis=1)
        begin = x[row, behind_]
        x = np.where(
            reaches[:, None, None], np.stack([begin, np.broadcast_to(tip, begin.shape)], 1), x
        )
        ends_at_tip |= reaches
    candidate_facets = np.nonzero(ends_at_tip | (psi.mean(axis=1) < 0))[0]
    return x[candidate_facets], candidate_facets


# Cells at the fronts of a crack in 3D: cut by phi, then by psi.

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


def corner_places(mesh: Mesh, level_set: LevelSet, cells: Ints) -> Floats:
    """Corners of cells, the values of the level sets there as further coordinates `(k, d + 1, c)`.

    Distances between them tell corners apart that cells of regular meshes have alike; none in 2D.
    """
    if mesh.dim == 2:  # rules on triangles are symmetric enough: their order may decide
        return np.zeros((0, 3, 1))
    nodes = mesh.cells[cells]
    values = np.stack([level_set.phi, level_set.inside], axis=1)
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
    crossed = (phi.min(axis=1) < 0) & (phi.max(axis=1) > 0)
    uncrossed, split = np.nonzero(~crossed)[0], np.nonzero(crossed)[0]
    corners = corner_places(mesh, level_set, cells)
    bary, share, side, parent = cut_simplices(phi[split], corners[split])
    largest = np.take_along_axis(phi, np.abs(phi).argmax(axis=1)[:, None], 1)[:, 0]
    owner = np.concatenate([uncrossed, split[parent]])
    bary = np.concatenate([np.broadcast_to(np.eye(4), (len(uncrossed), 4, 4)), bary])
    share = np.concatenate([np.ones(len(uncrossed)), share])
    side = np.concatenate([np.where(largest[uncrossed] >= 0, 1, -1), side])
    for psi in level_set.psi:
        values = psi[mesh.cells[cells]]
        owner, bary, share, side = _cut_again(values, corners, owner, bary, share, side)
    lip, row = interface_simplices(phi[split], corners[split])
    lip_owner = split[row]
    inside = np.einsum("svb,sb->sv", lip, level_set.inside[mesh.cells[cells[lip_owner]]])
    part, row = parts_behind(inside, np.einsum("svb,sbd->svd", lip, corners[lip_owner]))
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
    psi: Floats, corners: Floats, owner: Ints, bary: Floats, share: Floats, side: Ints
) -> tuple[Ints, Floats, Floats, Ints]:
    """Cut sub-cells along psi, given as the places at the corners of their cells `(k, 4)`."""
    values = _snapped_values(np.einsum("svb,sb->sv", bary, psi[owner]), psi[owner])
    cut = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    uncut, rows = np.nonzero(~cut)[0], np.nonzero(cut)[0]
    x = np.einsum("svb,sbd->svd", bary[rows], corners[owner[rows]])
    inner, part, _, parent = cut_simplices(values[rows], x)
    source = rows[parent]
    finer = np.einsum("svw,swb->svb", inner, bary[source])
    every = np.concatenate([uncut, source])
    result = np.concatenate([share[uncut], share[source] * part])
    keep = result > _NOTHING
    vertices = np.concatenate([bary[uncut], finer])
    return owner[every][keep], vertices[keep], result[keep], side[every][keep]


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
    uncut = np.nonzero(~cut & (values.min(axis=1) < 0))[0]
    rows = np.nonzero(cut)[0]
    inner, _, side, parent = cut_simplices(values[rows], None if x is None else x[rows])
    is_behind = side < 0
    corner = np.broadcast_to(np.eye(3), (len(uncut), 3, 3))
    return np.concatenate([corner, inner[is_behind]]), np.concatenate(
        [uncut, rows[parent[is_behind]]]
    )


def _snapped_values(values: Floats, scale: Floats) -> Floats:
    small = _AT * np.abs(scale).max(axis=1, keepdims=True)
    return np.where(np.abs(values) < small, 0.0, values)


__all__ = []
