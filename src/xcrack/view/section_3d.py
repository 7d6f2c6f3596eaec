"""Triangles and lines of a 3D body, cut open by a plane."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.mesh.locate import barycentric
from xcrack.mesh.mesh import Mesh, local_edges, local_facets
from xcrack.mesh.simplex import cut_simplices, interface_simplices
from xcrack.output.curved_sides import CurvedSides
from xcrack.output.pieces import Pieces

Plane = tuple[Floats, Floats]  # a point and the unit normal; what lies behind it is drawn
_NEAR = 1e-8  # share of a cell within which a point lies on a facet, on a crack, in a plane
_SHARP = np.cos(np.radians(25.0))  # an edge whose facets turn by more is drawn
# Parts of a triangle and of a tetrahedron with midpoints, in the order of their edges.
_SMALL = {
    6: np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2), (3, 5, 4)]),
    10: np.array(
        [
            [0, 4, 5, 6],
            [4, 1, 7, 8],
            [5, 7, 2, 9],
            [6, 8, 9, 3],
            [4, 9, 5, 6],
            [4, 9, 6, 8],
            [4, 9, 8, 7],
            [4, 9, 7, 5],
        ],
    ),
}


@dataclass(frozen=True, eq=False)
class TriangleSoup:
    """Simplices whose vertices are mixtures of points: numbers `(k, v)`, shares `(k, w, v)`.

    `facet` `(k,)` is the facet of the mesh on which each lies, -1 for none.
    """

    number: Ints
    share: Floats
    facet: Ints

    @classmethod
    def of(
        cls, number: Ints, share: Floats | None = None, facet: Ints | None = None
    ) -> "TriangleSoup":
        """Simplices of points; without shares their vertices are these."""
        v = number.shape[1]
        whole_triangles = np.broadcast_to(np.eye(v), (len(number), v, v))
        on_none = np.full(len(number), -1)
        return cls(
            number,
            whole_triangles if share is None else share,
            on_none if facet is None else facet,
        )

    def at(self, x: Floats) -> Floats:
        """Values at the vertices `(k, w, m)` of what is given at points `(n, m)`."""
        return np.einsum("kwv,kvm->kwm", self.share, x[self.number])

    def part_behind(self, level: Floats | None) -> "TriangleSoup":
        """What is left of triangles behind a plane."""
        if level is None:
            return self
        values = level[self.number]
        level_min, level_max = values.min(axis=1), values.max(axis=1)
        # The section has what lies in the plane, on the side that is drawn: lips lie there twice.
        whole_rows, split = (
            np.nonzero((level_max <= 0) & (level_min < 0))[0],
            np.nonzero((level_min < 0) & (level_max > 0))[0],
        )
        bary, _, side, parent = cut_simplices(values[split])
        is_behind = side < 0
        rows = np.concatenate([whole_rows, split[parent[is_behind]]])
        v = self.number.shape[1]
        corner = np.broadcast_to(np.eye(v), (len(whole_rows), v, v))
        share = np.concatenate([corner, bary[is_behind]])
        return TriangleSoup(self.number[rows], share, self.facet[rows])


def levels(x: Floats, plane: Plane | None) -> Floats | None:
    """Signed distances to a plane, round-off removed."""
    if plane is None:
        return None
    level = (x - plane[0]) @ plane[1]
    # Of points that all lie in the plane the distances are round-off only.
    size = max(float(np.ptp(x, axis=0).max(initial=0.0)), float(np.abs(level).max(initial=0.0)))
    return np.where(np.abs(level) < 1e-9 * size, 0.0, level)


def segments_behind(
    number: Ints, level: Floats | None, facet: Ints | None = None
) -> list[TriangleSoup]:
    """What is left of segments behind a plane."""
    facet = np.full(len(number), -1) if facet is None else facet
    if level is None:
        return [TriangleSoup.of(number, None, facet)]
    a, b = level[number].T
    is_whole = (a <= 0) & (b <= 0)
    is_crossed = a * b < 0
    t = a[is_crossed] / (a[is_crossed] - b[is_crossed])
    # Both vertices on the side that is kept, one of them the cut point.
    share = np.zeros((len(t), 2, 2))
    share[:, 0] = np.stack([1 - t, t], axis=1)
    corner_behind = np.where(a[is_crossed] < 0, 0, 1)
    share[np.arange(len(t)), 1, corner_behind] = 1.0
    whole_segments = TriangleSoup.of(number[is_whole], None, facet[is_whole])
    return [whole_segments, TriangleSoup(number[is_crossed], share, facet[is_crossed])]


def crossing(
    triangles: Ints, level: Floats | None, facet: Ints | None = None
) -> list[TriangleSoup]:
    """Segments in which triangles meet a plane."""
    if level is None:
        return []
    values = level[triangles]
    rows = np.nonzero((values.min(axis=1) < 0) & (values.max(axis=1) >= 0))[0]
    bary, parent = interface_simplices(values[rows])
    rows = rows[parent]
    return [TriangleSoup.of(triangles[rows], bary, None if facet is None else facet[rows])]


def section(body: Pieces, level: Floats | None) -> TriangleSoup:
    """Triangles in which the pieces meet a plane."""
    assert level is not None
    blocks = [body.plain_nodes]
    if body.plain_nodes.shape[1] == 10:
        blocks = [body.plain_nodes[:, _SMALL[10]].reshape(-1, 4)]
    blocks.append(body.split[:, _SMALL[10]].reshape(-1, 4))
    tetrahedra = np.concatenate(blocks)
    values = level[tetrahedra]
    rows = np.nonzero((values.min(axis=1) < 0) & (values.max(axis=1) >= 0))[0]
    bary, parent = interface_simplices(values[rows])
    return TriangleSoup.of(tetrahedra[rows[parent]], bary)


@dataclass(frozen=True, eq=False)
class Faces:
    """Boundary and crack faces of a body in pieces, by their points, and edges on them.

    Attributes
    ----------
    shell, lip : (k, 3) arrays of int
        Triangles on the boundary and on crack faces.
    outline, rims, cell_edges : (k, 2) arrays of int
        Segments: of sharp edges, of crack faces at the boundary, of cells.
    of_shell, of_outline, of_cell_edges : (k,) arrays of int
        Facet of the mesh on which each lies.
    """

    shell: Ints
    lip: Ints
    outline: Ints
    rims: Ints
    cell_edges: Ints
    of_shell: Ints
    of_outline: Ints
    of_cell_edges: Ints


def faces(body: Pieces, curved_sides: CurvedSides | None) -> Faces:
    """Triangles on boundary and crack faces, and segments: sharp, of crack faces, of cells."""
    mesh = body.solution.space.mesh
    rim = mesh.facet_to_cell[mesh.cell_to_facet, 1] < 0  # opposite to each corner of a cell
    is_sharp = sharp_edges(mesh, curved_sides)
    on_lip = _lip_points(body)
    groups: list[list[Ints]] = [[np.zeros((0, 3), np.int64)], [np.zeros((0, 3), np.int64)]]
    lines: list[list[Ints]] = [[np.zeros((0, 2), np.int64)] for _ in range(3)]
    of_shell: list[Ints] = [np.zeros(0, np.int64)]
    of_lines: list[list[Ints]] = [[np.zeros(0, np.int64)] for _ in range(3)]
    first = 0
    for block in (body.plain_nodes, body.split):
        cell = body.cell[first : first + len(block)]
        first += len(block)
        is_near = rim[cell].any(axis=1) | on_lip[block[:, :4]].sum(axis=1).astype(bool)
        rows = np.nonzero(is_near)[0]
        block, cell = block[rows], cell[rows]
        zero = _vanishing_coordinates(mesh, body, block, cell)
        for face in local_facets(3):
            at = zero[:, face].all(axis=1) & rim[cell]
            is_outside = at.any(axis=1)
            is_on_lip = on_lip[block[:, face]].all(axis=1) & ~is_outside
            facet = mesh.cell_to_facet[cell, np.argmax(at, axis=1)]
            groups[0].append(_small_faces(block[is_outside], face))
            of_shell.append(
                np.repeat(facet[is_outside], len(groups[0][-1]) // max(is_outside.sum(), 1))
            )
            groups[1].append(_small_faces(block[is_on_lip], face))
            for i, j in ((0, 1), (1, 2), (0, 2)):
                a, b = face[i], face[j]
                is_zero_side = zero[:, a] & zero[:, b]
                edge = np.zeros(len(block), dtype=bool)
                feature = np.zeros(len(block), dtype=bool)
                for e, (p, q) in enumerate(local_edges(3)):
                    r, s = (v for v in range(4) if v not in (p, q))
                    on = is_zero_side[:, r] & is_zero_side[:, s]
                    edge |= on
                    feature |= on & is_sharp[mesh.cell_to_edge[cell, e]]
                mouth = is_on_lip & (is_zero_side & rim[cell]).any(axis=1)
                for k, rows in enumerate((is_outside & feature, mouth, is_outside & edge)):
                    lines[k].append(_halves(block[rows], a, b))
                    n_lines = len(lines[k][-1]) // max(int(rows.sum()), 1)
                    of_lines[k].append(np.tile(facet[rows], n_lines))
    shell, lip = (np.concatenate(group) for group in groups)
    outline, rims, cells = (
        unique_segments(np.concatenate(line), np.concatenate(facet), curved_sides)
        for line, facet in zip(lines, of_lines, strict=True)
    )
    return Faces(
        shell, lip, outline[0], rims[0], cells[0], np.concatenate(of_shell), outline[1], cells[1]
    )


def unique_segments(line: Ints, facet: Ints, curved_sides: CurvedSides | None) -> tuple[Ints, Ints]:
    """Segments, each once, and the facet on which each lies: a curved one if there is one."""
    if curved_sides is not None:
        order = np.argsort(curved_sides.facet_to_curve[facet] < 0, kind="stable")
        line, facet = line[order], facet[order]
    pairs, first = np.unique(np.sort(line, axis=1), axis=0, return_index=True)
    return pairs, facet[first]


def _vanishing_coordinates(mesh: Mesh, body: Pieces, block: Ints, cell: Ints) -> Bools:
    """Which barycentric coordinates of the vertices of pieces vanish `(k, 4, 4)`."""
    bary = [barycentric(mesh, cell, body.points[block[:, v]]) for v in range(4)]
    return np.asarray(np.abs(np.stack(bary, axis=1)) < _NEAR)


def _lip_points(body: Pieces) -> Bools:
    """Which points lie on a crack or on its front `(n,)`."""
    tolerance = _NEAR * float(body.solution.space.mesh.cell_size.min())
    flag = np.zeros(len(body.points), dtype=bool)
    for phi, psi in zip(body.phi, body.psi, strict=True):
        flag |= (np.abs(phi) <= tolerance) & (psi <= tolerance).all(axis=0)
    return flag


def on_facets(body: Pieces, level: Floats | None) -> Ints:
    """Faces of pieces that a plane meets and that lie on facets of the mesh."""
    assert level is not None
    parts = [np.zeros((0, 3), np.int64)]
    mesh, first = body.solution.space.mesh, 0
    for block in (body.plain_nodes, body.split):
        cell = body.cell[first : first + len(block)]
        first += len(block)
        values = level[block[:, :4]]
        rows = np.nonzero((values.min(axis=1) < 0) & (values.max(axis=1) >= 0))[0]
        zero = _vanishing_coordinates(mesh, body, block[rows], cell[rows])
        for face in local_facets(3):
            on = np.any(zero[:, face].all(axis=1), axis=1)
            parts.append(block[rows[on]][:, face])
    return np.concatenate(parts)


def _small_faces(block: Ints, face: Ints) -> Ints:
    """Triangles of one face of pieces, between its midpoints too."""
    if block.shape[1] == 4:
        return block[:, face]
    a, b, c = face
    nodes = [a, b, c, _middle_of(a, b), _middle_of(a, c), _middle_of(b, c)]
    return block[:, nodes][:, _SMALL[6]].reshape(-1, 3)


def _halves(block: Ints, a: int, b: int) -> Ints:
    """An edge of pieces as one segment, or as two."""
    if block.shape[1] == 4:
        return block[:, [a, b]]
    m = _middle_of(a, b)
    return np.concatenate([block[:, [a, m]], block[:, [m, b]]])


def _middle_of(a: int, b: int) -> int:
    pair = sorted((int(a), int(b)))
    return 4 + local_edges(3).tolist().index(pair)


def sharp_edges(mesh: Mesh, curved_sides: CurvedSides | None) -> Bools:
    """Edges of the mesh at which its boundary turns `(e,)`, other than between its chords."""
    facets = mesh.boundary
    x = mesh.points[facets]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pairs = np.sort(facets[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1)
    key = pairs[:, 0] * mesh.n_points + pairs[:, 1]
    order = np.argsort(key, kind="stable")
    owner = np.repeat(np.arange(len(facets)), 3)[order]
    same_edge = np.nonzero(key[order][1:] == key[order][:-1])[0]
    # Facets need not turn alike: only the angle between their planes counts.
    turn = np.abs(np.einsum("kd,kd->k", normal[owner[same_edge]], normal[owner[same_edge + 1]]))
    is_sharp = turn < _SHARP
    if curved_sides is not None:
        side = curved_sides.facet_to_curve[mesh.facet_to_cell[:, 1] < 0]
        first_curve, second_curve = side[owner[same_edge]], side[owner[same_edge + 1]]
        is_sharp &= (first_curve != second_curve) | (first_curve < 0)
    sharp_keys = np.unique(key[order][same_edge[is_sharp]])
    edges = np.sort(mesh.edges, axis=1)
    return np.isin(edges[:, 0] * mesh.n_points + edges[:, 1], sharp_keys)


def boundary_edges(mesh: Mesh, curved_sides: CurvedSides | None) -> tuple[Ints, Ints, Bools]:
    """Edges of the boundary `(e, 2)`, the facet on which each lies, and which are sharp."""
    outer_facets = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    pairs = mesh.facets[outer_facets][:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
    edges, facet = unique_segments(pairs, np.repeat(outer_facets, 3), curved_sides)
    sharp_pairs = np.sort(mesh.edges[sharp_edges(mesh, curved_sides)], axis=1)
    key, of_sharp = (pair[:, 0] * mesh.n_points + pair[:, 1] for pair in (edges, sharp_pairs))
    return edges, facet, np.isin(key, of_sharp)


def areas(corners: Floats) -> Floats:
    """Areas of triangles `(k, 3, 3)`."""
    area_vector = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(area_vector, axis=1) / 2)


def edges_of(corners: Floats) -> Floats:
    """Edges `(3 k, 2, 3)` of triangles `(k, 3, 3)`."""
    return corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)


__all__ = [
    "Faces",
    "Plane",
    "TriangleSoup",
    "areas",
    "boundary_edges",
    "crossing",
    "edges_of",
    "faces",
    "levels",
    "on_facets",
    "section",
    "segments_behind",
    "sharp_edges",
    "unique_segments",
]
