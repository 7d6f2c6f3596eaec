"""Cut of a mesh by a crack: sub-cells, lip segments and the cells at the tips.

All topology comes from the linear interpolant of the nodal level set, so that it is watertight
from cell to cell. Sub-cell fractions are products of positive cut positions (no cancellation):
tiny pieces keep their relative accuracy.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, lock
from xcrack.level_set import LevelSet
from xcrack.locate import barycentric
from xcrack.mesh import Mesh, local_edges, local_facets

_ON_FACET = 1e-13  # barycentric coordinates of a tip below this are zero
_NOTHING = 1e-30  # sub-cells below this share of their cell are left out

_ROUND_OFF = 1e-14  # the same for fractions that are determinants


@dataclass(frozen=True, eq=False)
class Cut:
    """Where one crack runs through a mesh.

    Attributes
    ----------
    level_set : LevelSet
    cells : (k,) array of int
        Cells cut from side to side (tip cells are not among them).
    sub_to_cell, sub_bary, sub_fraction, sub_side : arrays
        Sub-cells of the cut cells and of the tip cells: mesh cell, barycentric coordinates of the
        vertices `(s, d + 1, d + 1)`, share of the cell's volume, side +1 or -1. In a tip cell
        vertex 0 of every sub-cell is the tip.
    lip_cell : (l, 2) array of int
        Cell on side - and on side + of each lip segment; the same cell twice inside a cell.
    lip_bary : (l, 2, d, d + 1) array
        Vertices of the segment in the barycentric coordinates of these cells.
    lip_normal : (l, d) array
        From lip - to lip +.
    cut_edge : (e,) array
        Cut position on each mesh edge, from its first point, nan where the crack does not cross.
    side : (m,) array of int
        Side of each cell, 0 where phi changes its sign in it.
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

    @property
    def n_tips(self) -> int:
        """Number of tips of the crack."""
        return len(self.level_set.tip)

    def lip_points(self, mesh: Mesh) -> Floats:
        """Vertices of the lip segments `(l, d, d)`, length."""
        return np.einsum(
            "lvb,lbd->lvd", self.lip_bary[:, 1], mesh.points[mesh.cells[self.lip_cell[:, 1]]]
        )


def cut(mesh: Mesh, level_set: LevelSet) -> Cut:
    """Cut a mesh along the level sets of a crack."""
    phi = level_set.phi
    values = phi[mesh.cells]
    crossed = (values.min(axis=1) < 0) & (values.max(axis=1) > 0)
    positions, exists = _edge_positions(mesh, phi)
    is_tip = np.zeros(len(mesh.cells), dtype=bool)
    for cells in level_set.tip_cells:
        is_tip[cells] = True
    candidates = np.nonzero(crossed & ~is_tip)[0]
    ends = _cut_points(mesh, level_set, candidates, positions, exists)
    sign_change = exists[mesh.cell_to_edge[candidates]]
    close = (level_set.near[mesh.cell_to_edge[candidates]] | ~sign_change).all(axis=1)
    kept = close & (ends.psi.mean(axis=1) < 0)
    cells = candidates[kept]

    bary, fraction, side, owner = cut_simplices(phi[mesh.cells[cells]])
    lips = [_Lips(np.stack([cells, cells], 1), np.stack([ends.bary[kept]] * 2, 1))]
    edge_flag = np.zeros(len(mesh.edges), dtype=bool)
    edge_flag[mesh.cell_to_edge[cells]] = True
    subs = [(cells[owner], bary, fraction, side)]
    for k, around in enumerate(level_set.tip_cells):
        tip_subs, tip_lips, entry = _tip_cells(mesh, level_set, k, around, positions, exists)
        subs.append(tip_subs)
        lips.append(tip_lips)
        edge_flag[entry] = True
    lips.append(_facet_lips(mesh, level_set))
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
        lip_normal=lock(_lip_normals(mesh, phi, lip_cell, lip_bary)),
        cut_edge=lock(np.where(edge_flag & exists, positions, np.nan)),
        side=lock(np.where(crossed, 0, _cell_sides(values))),
    )


@dataclass(frozen=True, eq=False)
class _Lips:
    cell: Ints
    bary: Floats


@dataclass(frozen=True, eq=False)
class _Ends:
    bary: Floats
    psi: Floats
    edge: Ints


def _cell_sides(values: Floats) -> Ints:
    largest = np.take_along_axis(values, np.abs(values).argmax(axis=1)[:, None], 1)[:, 0]
    return np.where(largest >= 0, 1, -1).astype(np.int64)


def _edge_positions(mesh: Mesh, phi: Floats) -> tuple[Floats, Bools]:
    a, b = phi[mesh.edges].T
    exists = a * b < 0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(exists, a / (a - b), np.nan), exists


def _cut_points(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats, exists: Bools
) -> _Ends:
    """The two points where phi = 0 meets the boundary of plane cells in which it changes sign."""
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
    return _Ends(bary, psi, number)


def cut_simplices(phi: Floats) -> tuple[Floats, Floats, Ints, Ints]:
    """Sub-simplices of simplices with vertex values phi `(k, d + 1)` of both signs.

    Returns
    -------
    bary : (s, d + 1, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    fraction : (s,) array
        Share of the parent's volume, a product of positive cut positions.
    side : (s,) array of int
    parent : (s,) array of int
    """
    positive = phi >= 0
    count = positive.sum(axis=1)
    n = phi.shape[1]
    nothing = np.zeros(0, dtype=np.int64)
    parts = [(np.zeros((0, n, n)), np.zeros(0), nothing, nothing)]
    for lonely in (1, n - 1):
        rows = np.nonzero(count == lonely)[0]
        alone_positive = lonely == 1
        alone = np.argmax(positive[rows] == alone_positive, axis=1)
        parts.extend(_one_alone(phi, rows, alone, 1 if alone_positive else -1))
    if n == 4:
        parts.extend(_two_and_two(phi, np.nonzero(count == 2)[0]))
    bary = np.concatenate([p[0] for p in parts])
    fraction = np.concatenate([p[1] for p in parts])
    side = np.concatenate([p[2] for p in parts])
    parent = np.concatenate([p[3] for p in parts])
    keep = fraction > _NOTHING
    order = np.argsort(parent[keep], kind="stable")
    return bary[keep][order], fraction[keep][order], side[keep][order], parent[keep][order]


_Part = tuple[Floats, Floats, Ints, Ints]


def _mix(phi: Floats, i: Ints, j: Ints) -> tuple[Floats, Floats, Floats]:
    """Cut point of edges (i, j): barycentric coordinates, position from i, position from j."""
    row = np.arange(len(phi))
    a, b = phi[row, i], phi[row, j]
    t, u = a / (a - b), b / (b - a)
    point = np.zeros_like(phi)
    point[row, i] = u
    point[row, j] = t
    return point, t, u


def _corner(phi: Floats, i: Ints) -> Floats:
    point = np.zeros_like(phi)
    point[np.arange(len(phi)), i] = 1.0
    return point


def _one_alone(phi: Floats, rows: Ints, alone: Ints, side: int) -> list[_Part]:
    """One vertex on its side, the others (d of them) on the other side."""
    if not len(rows):
        return []
    values = phi[rows]
    n = values.shape[1]
    others = local_facets(n - 1)[alone]
    # The values decide which diagonal splits what is left, not the numbers of the nodes.
    by_value = np.argsort(np.abs(np.take_along_axis(values, others, 1)), axis=1, kind="stable")
    others = np.take_along_axis(others, by_value, 1)
    cut_points, t, u = zip(*[_mix(values, alone, others[:, m]) for m in range(n - 1)], strict=True)
    corners = [_corner(values, others[:, m]) for m in range(n - 1)]
    parts = [(np.stack([_corner(values, alone), *cut_points], 1), np.prod(t, axis=0), side)]
    for m in range(n - 1):
        vertices = [*cut_points[: m + 1], *corners[m:]]
        fraction = np.prod(t[:m], axis=0) * u[m] if m else u[m]
        parts.append((np.stack(vertices, 1), fraction, -side))
    return [(b, f, np.full(len(rows), s, dtype=np.int64), rows) for b, f, s in parts]


def _two_and_two(phi: Floats, rows: Ints) -> list[_Part]:
    """Tetrahedra with two vertices on each side."""
    if not len(rows):
        return []
    values = phi[rows]
    order = np.argsort(values < 0, axis=1, kind="stable")
    parts = []
    for (a, b, c, d), side in ((order.T, 1), (order[:, [2, 3, 0, 1]].T, -1)):
        ac, t_ac, _ = _mix(values, a, c)
        ad, t_ad, _ = _mix(values, a, d)
        bc, t_bc, t_cb = _mix(values, b, c)
        bd, t_bd, t_db = _mix(values, b, d)
        A, B = _corner(values, a), _corner(values, b)
        pieces = [
            ([A, ac, ad, bd], t_ac * t_ad * t_db),
            ([A, ac, bc, bd], t_ac * t_cb * t_bd),
            ([A, B, bc, bd], t_bc * t_bd),
        ]
        sign = np.full(len(rows), side, dtype=np.int64)
        parts.extend([(np.stack(v, 1), f, sign, rows) for v, f in pieces])
    return parts


def _tip_cells(
    mesh: Mesh, level_set: LevelSet, k: int, cells: Ints, positions: Floats, exists: Bools
) -> tuple[tuple[Ints, Floats, Floats, Ints], _Lips, Ints]:
    """Fans of sub-cells from tip k, the lip piece that ends there, and its entry edges."""
    tip = level_set.tip[k]
    apex = barycentric(mesh, cells, np.broadcast_to(tip, (len(cells), mesh.dim)))
    # Round-off of a tip on a facet would leave a sub-cell without area whose points hit the tip.
    apex = np.where(apex > _ON_FACET, apex, 0.0)
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
    lips = _Lips(np.stack([both, both], 1), np.stack([two, two], 1))
    return subs, lips, np.array(entries, dtype=np.int64)


def _facet_lips(mesh: Mesh, level_set: LevelSet) -> _Lips:
    """Lip segments that lie on facets of the mesh, each assembled once from its two cells."""
    d = mesh.dim
    zero = (level_set.phi[mesh.facets] == 0).all(axis=1)
    facets = np.nonzero(zero & (mesh.facet_to_cell[:, 1] >= 0))[0]
    empty = _Lips(np.zeros((0, 2), np.int64), np.zeros((0, 2, d, d + 1)))
    if not len(facets):
        return empty
    cells = mesh.facet_to_cell[facets]
    side = _cell_sides(level_set.phi[mesh.cells[cells.ravel()]]).reshape(-1, 2)
    psi = level_set.inside[mesh.facets[facets]]
    keep = (psi.min(axis=1) < 0) & (side[:, 0] != side[:, 1])
    facets, cells, side, psi = facets[keep], cells[keep], side[keep], psi[keep]
    if not len(facets):
        return empty
    cells = np.where(side[:, :1] > 0, cells[:, ::-1], cells)
    x = mesh.points[mesh.facets[facets]]
    ends_at_tip = np.zeros(len(facets), dtype=bool)
    for k, tip in enumerate(level_set.tip):
        own = level_set.psi[k][mesh.facets[facets]]
        length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        ahead, behind = own.argmax(axis=1), own.argmin(axis=1)
        row = np.arange(len(facets))
        reaches = (own[row, ahead] > -1e-9 * length) & (own[row, behind] < -1e-9 * length)
        reaches &= np.isin(cells, level_set.tip_cells[k]).any(axis=1)
        begin = x[row, behind]
        x = np.where(
            reaches[:, None, None], np.stack([begin, np.broadcast_to(tip, begin.shape)], 1), x
        )
        ends_at_tip |= reaches
    far = ~ends_at_tip & (psi.mean(axis=1) >= 0)
    x, cells = x[~far], cells[~far]
    bary = np.stack(
        [
            np.stack([barycentric(mesh, cells[:, s], x[:, v]) for v in range(d)], axis=1)
            for s in (0, 1)
        ],
        axis=1,
    )
    return _Lips(cells, np.where(np.abs(bary) < 1e-14, 0.0, bary))


def _lip_normals(mesh: Mesh, phi: Floats, cell: Ints, bary: Floats) -> Floats:
    """Unit normals of lip segments, exactly perpendicular to them, towards growing phi."""
    corners = np.einsum("lvb,lbd->lvd", bary[:, 1], mesh.points[mesh.cells[cell[:, 1]]])
    slope = np.einsum("lb,lbd->ld", phi[mesh.cells[cell[:, 1]]], mesh.gradient[cell[:, 1]])
    if mesh.dim == 2:
        along = corners[:, 1] - corners[:, 0]
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    else:
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(length, 1e-300)
    return np.asarray(normal * np.sign(np.einsum("ld,ld->l", normal, slope))[:, None])
