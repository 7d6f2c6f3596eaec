"""Curved boundaries from second-order meshes and from CAD, as quartic pieces.

A piece is the polynomial of degree four through its nodes, which is C0 to its neighbours: the nodes
of an edge depend on that edge alone. Second-order cells give three nodes of an edge; its quartic
runs along the circle through them, which is exact for what parts are mostly made of, where a
parabola over 60° is .2 % of the radius off.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints, lock, offsets
from xcrack.mesh.checks import pairs_within
from xcrack.mesh.mesh import Mesh, local_edges, numbers_of, sound_mesh

_FLATTEST = 1e-4  # of its longest edge: a facet whose nodes are no farther from its plane is flat
_SHARP = 0.9  # cosine of the angle across which two pieces are one smooth surface
_NEIGHBOURS = 4  # nodes from whose pieces a nearest point is looked for
_ROOMY = 1.1  # times the distance of the farthest node: pieces bulge between their nodes
_CHORDS = 8  # that stand for the curve of an edge: a 64th of the area beside it is left out
_STRAIGHT = 1e-9  # of an edge: middle of an arc this close to its chord
_NAME = "curved_{}"
_INNER = np.array([(0, 1, 2), (1, 0, 2), (2, 0, 1)])  # corners by weight of the inner nodes


@dataclass(frozen=True, eq=False)
class CurvedFacets:
    """Quartic pieces of a curve or a surface: a function that returns their nearest points.

    Parameters
    ----------
    points : (n, d) array, length
        Nodes.
    facets : (k, 5) or (k, 15) array of int
        Nodes of each piece: corners; of each edge, in the order of `local_edges`, three at its
        quarters from the first corner on; in a triangle the three inside.
    """

    points: Floats
    facets: Ints

    def __call__(self, x: Floats) -> Floats:
        """Nearest points `(n, d)`."""
        return self.feet(x)[0]

    def feet(self, x: Floats) -> tuple[Floats, Ints]:
        """Nearest points `(n, d)`, and the piece that each lies on `(n,)`."""
        from xcrack.mesh.kernels.quartic import nearest_on_pieces

        x = np.ascontiguousarray(x, dtype=float)
        if not len(x):
            return x, np.zeros(0, dtype=np.int64)
        count = min(_NEIGHBOURS, len(self.points))
        candidates = self._tree.query(x, k=count)[1].reshape(len(x), count).astype(np.int64)
        pieces = (*self._owners, self.nodes, *self._balls)
        foot, owner = nearest_on_pieces(lock(x.view()), lock(candidates), *pieces)
        return foot, owner

    @cached_property
    def nodes(self) -> Floats:
        """Nodes of each piece `(k, 5 or 15, d)`, length."""
        return lock(np.ascontiguousarray(self.points[self.facets]))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    @cached_property
    def _owners(self) -> tuple[Ints, Ints, Ints]:
        """Pieces that have each node: offsets, pieces, and the number of the node in them."""
        members = self.facets.ravel()
        order = np.argsort(members, kind="stable")
        piece, number = np.divmod(order, self.facets.shape[1])
        begin = offsets(np.bincount(members, minlength=len(self.points)))
        return lock(begin), lock(piece), lock(number)

    @cached_property
    def _balls(self) -> tuple[Floats, Floats]:
        """Centre and radius of a ball around each piece."""
        centre = self.nodes.mean(axis=1)
        radius = np.linalg.norm(self.nodes - centre[:, None], axis=2).max(axis=1)
        return lock(centre), lock(_ROOMY * radius)

    @cached_property
    def border(self) -> "CurvedFacets | None":
        """Curves where a surface ends; None of a curve, and of a closed surface."""
        if self.facets.shape[1] < 15:
            return None
        edges = np.concatenate([self.facets[:, nodes] for nodes in _edge_nodes()])
        ends = np.sort(edges[:, :2], axis=1)
        _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
        border_edges = edges[first[count == 1]]
        if not len(border_edges):
            return None
        point_numbers, facets = np.unique(border_edges, return_inverse=True)
        return CurvedFacets(lock(self.points[point_numbers]), lock(facets.reshape(-1, 5)))

    def places(self, owner: Ints, bary: Floats) -> tuple[Floats, Floats]:
        """Points of pieces `(q, d)` at barycentric coordinates, and derivatives along these."""
        from xcrack.mesh.kernels.quartic import points_of_pieces

        return points_of_pieces(self.nodes, np.ascontiguousarray(owner), lock(np.array(bary)))


def _edge_nodes() -> Iterator[list[int]]:
    """Local numbers of the nodes of each edge of a triangle, its ends first."""
    for k, (i, j) in enumerate(local_edges(2).tolist()):
        yield [i, j, 3 + 3 * k, 4 + 3 * k, 5 + 3 * k]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes of the quartic pieces that stand for facets of a mesh.

    Attributes
    ----------
    points : (n, d) array, length
        On the straight facets: corners, then three of each edge, then three of each triangle.
    facets : (k, 5) or (k, 15) array of int
    corner : (c,) array of int
        Mesh points of the corners.
    edges : (e, 2) array of int
        Corners of each edge, smaller first; its nodes are ``c + 3 e ...``.
    """

    points: Floats
    facets: Ints
    corner: Ints
    edges: Ints

    @property
    def first_inner_node(self) -> int:
        """Number of the first node inside a triangle."""
        return len(self.corner) + 3 * len(self.edges)


def lattice(points: Floats, facets: Ints) -> Lattice:
    """Nodes of pieces on straight facets `(k, d)`."""
    d = facets.shape[1]
    corner, local_corners = np.unique(facets, return_inverse=True)
    local_corners = local_corners.reshape(facets.shape)
    pairs = local_edges(d - 1)
    ends = local_corners[:, pairs]
    is_turned = ends[..., 0] > ends[..., 1]
    edges, number = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    number = number.reshape(len(facets), len(pairs))
    quarter = np.where(is_turned[..., None], [2, 1, 0], [0, 1, 2])
    first = len(corner) + 3 * number[..., None] + quarter
    nodes = [local_corners, first.reshape(len(facets), -1)]
    if d == 3:
        inner_nodes = len(corner) + 3 * len(edges) + np.arange(3 * len(facets)).reshape(-1, 3)
        nodes.append(inner_nodes)
    all_nodes = np.concatenate(nodes, axis=1)
    x = np.empty((int(all_nodes.max(initial=-1)) + 1, points.shape[1]))
    x[all_nodes] = np.einsum("ac,kcd->kad", _lattice_places(d), points[facets])
    return Lattice(x, all_nodes, corner, edges)


def _lattice_places(n: int) -> Floats:
    """Barycentric coordinates of the nodes of a piece of n corners: there, on edges, inside."""
    corner = np.eye(n)
    edges = [(k * corner[a] + (4 - k) * corner[b]) / 4
             for a, b in combinations(range(n), 2) for k in (3, 2, 1)]  # fmt: skip
    inner_nodes = [(corner + 1) / 4 for _ in combinations(range(n), 3)]
    return np.vstack([corner, *edges, *inner_nodes])


def arcs(a: Floats, middle: Floats, b: Floats) -> Floats:
    """Points at the quarters of circular arcs from a to b through a third point `(e, 3, d)`."""
    chord = b - a
    half = np.linalg.norm(chord, axis=1) / 2
    chord_direction = chord / (2 * half)[:, None]
    offset = middle - (a + b) / 2
    share = np.einsum("ed,ed->e", offset, chord_direction)
    offset -= share[:, None] * chord_direction
    height = np.linalg.norm(offset, axis=1)
    is_straight = height <= _STRAIGHT * half
    height = np.where(is_straight, half, height)
    height_direction = offset / height[:, None]
    centre = (share**2 + height**2 - half**2) / (2 * height)
    radius, angle = np.hypot(half, centre), np.arctan2(half, -centre)
    result = np.empty((len(a), 3, a.shape[1]))
    for k, quarter in enumerate((-0.5, 0.0, 0.5)):
        x = np.where(is_straight, quarter * half, radius * np.sin(quarter * angle))
        y = np.where(is_straight, 0.0, centre + radius * np.cos(quarter * angle))
        result[:, k] = (a + b) / 2 + x[:, None] * chord_direction + y[:, None] * height_direction
    return result


def _with_insides(points: Floats, facets: Ints) -> Floats:
    """Nodes inside triangles from those of their edges: arcs between the middles of edges.

    An arc from the middle of one edge to that of another has the curvature of the third edge, to
    which it is parallel, and rises along the normal at its own place.
    """
    x = points.copy()
    middle = {(0, 1): 4, (0, 2): 7, (1, 2): 10}
    parabola = points[facets[:, [0, 1, 2, 4, 7, 10]]]
    for node, (k, i, j) in zip(facets[:, 12:].T, _INNER):
        bary = np.full(3, 0.25)
        bary[k] = 0.5
        start, end = (points[facets[:, middle[min(k, c), max(k, c)]]] for c in (i, j))
        top = points[facets[:, middle[min(i, j), max(i, j)]]]
        chord = points[facets[:, j]] - points[facets[:, i]]
        rise = top - (points[facets[:, i]] + points[facets[:, j]]) / 2
        edge = np.zeros(3)
        edge[[i, j]] = 0.5
        edge_normal, node_normal = (
            _parabolic_normals(parabola, edge),
            _parabolic_normals(parabola, bary),
        )
        height = np.einsum("kd,kd->k", rise, edge_normal)
        half = np.linalg.norm(chord, axis=1) / 2
        curvature = 2 * height / (half**2 + np.einsum("kd,kd->k", rise, rise))
        reach = np.linalg.norm(end - start, axis=1) / 2
        bend = np.minimum(np.abs(curvature * reach), 1.0)
        lift = curvature * reach**2 / (1 + np.sqrt(1 - bend**2))
        tangential_rise = rise - height[:, None] * edge_normal
        x[node] = (start + end) / 2 + tangential_rise / 4 + lift[:, None] * node_normal
    return x


def _parabolic_normals(parabola: Floats, bary: Floats) -> Floats:
    """Unit normals of second-order triangles `(k, 6, 3)` at one place."""
    a, b, c = bary
    slope = np.array([
        (1 - 4 * a, 1 - 4 * a), (4 * b - 1, 0), (0, 4 * c - 1), (4 * (a - b), -4 * b),
        (-4 * c, 4 * (a - c)), (4 * c, 4 * b),
    ])  # fmt: skip
    u, v = np.einsum("as,kad->skd", slope, parabola)
    normal = np.cross(u, v)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None])


# Which facets of a mesh are curved, in sets whose pieces do not meet at an edge.


def raised_lattice(mesh: Mesh, facets: Ints, pairs: Ints, middles: Floats) -> Lattice:
    """Lattice on facets of a mesh, from the middles of some of its edges.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
    pairs : (e, 2) array of int
        Mesh points at the ends of edges, in any order.
    middles : (e, d) array, length
        Their midside nodes.
    """
    grid = lattice(mesh.points, facets)
    ends = grid.corner[grid.edges]
    place = (mesh.points[ends[:, 0]] + mesh.points[ends[:, 1]]) / 2
    row, has_row = rows_of(np.sort(pairs, axis=1), ends, mesh.n_points)
    place[has_row] = middles[row[has_row]]
    points, count = grid.points.copy(), len(grid.corner)
    arc = arcs(mesh.points[ends[:, 0]], place, mesh.points[ends[:, 1]])
    points[count : grid.first_inner_node] = arc.reshape(-1, mesh.dim)
    if mesh.dim == 3:
        points = _with_insides(points, grid.facets)
    return replace(grid, points=points)


def rows_of(pairs: Ints, pairs_to_find: Ints, n_points: int) -> tuple[Ints, Bools]:
    """Rows of pairs of points, smaller first, in a list of such; and which are there."""
    key, sought_key = (p[:, 0] * np.int64(n_points) + p[:, 1] for p in (pairs, pairs_to_find))
    order = np.argsort(key, kind="stable")
    place = np.minimum(np.searchsorted(key[order], sought_key), max(len(key) - 1, 0))
    row = order[place] if len(key) else np.zeros(len(sought_key), dtype=np.int64)
    has_row = key[row] == sought_key if len(key) else np.zeros(len(sought_key), dtype=bool)
    return row, has_row


def outline_gain(mesh: Mesh, facets: Ints) -> float:
    """Area between the straight outline of plane facets and the curves for which it stands.

    Below zero where they reach beyond these, as beside a hole; zero in 2D, where an outline is
    points. Facets that have a curve of their own do not count.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
        Of its boundary.
    """
    sides = [(mesh.facet_sets[name], curve) for name, curve in mesh.curves.items()]
    if mesh.dim == 2 or not sides:
        return 0.0
    curved_numbers = numbers_of(mesh, np.concatenate([side for side, _ in sides]))
    facets = facets[~np.isin(numbers_of(mesh, facets), curved_numbers)]
    corner = facets[:, local_edges(2)].reshape(-1, 2)
    inner_corner = facets[:, [2, 1, 0]].ravel()
    gain = 0.0
    for side, curve in sides:
        edges = edges_of(side)
        on_curve = rows_of(edges, np.sort(corner, axis=1), mesh.n_points)[1]
        start, end = mesh.points[corner[on_curve]].transpose(1, 0, 2)
        to_edge = (start + end) / 2 - mesh.points[inner_corner[on_curve]]
        normal = np.cross(to_edge, end - start)
        share = np.linspace(0.0, 1.0, _CHORDS + 1)[:, None, None]
        line = (1 - share) * start + share * end
        outline = getattr(curve, "border", None) or curve
        line[1:-1] = np.reshape(outline(line[1:-1].reshape(-1, 3)), line[1:-1].shape)
        fan = np.cross(line[:-1] - start, line[1:] - start).sum(axis=0) / 2
        gain += float((fan * normal).sum(axis=1) @ (1 / np.linalg.norm(normal, axis=1)))
    return gain


def with_curves(mesh: Mesh, facets: Ints, nodes: Lattice) -> Mesh:
    """A mesh with its curved sides as sets, and the curves of these.

    A set of the mesh that consists of whole smooth sides, none of which meets another one at an
    edge, gets its curve; other sides come into sets ``curved_1``, ``curved_2`` ..., as few as it
    takes to keep those apart that meet.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
        Of its boundary.
    nodes : Lattice
        Of these facets.
    """
    is_curved = _bulge_of(nodes) > _FLATTEST
    if not is_curved.any():
        return mesh
    facets, pieces = facets[is_curved], nodes.facets[is_curved]
    side = _smooth_sides(mesh, facets, CurvedFacets(nodes.points, pieces))
    conflicts = _meeting_sides(mesh, facets, side)
    row_of = np.full(len(mesh.facets), -1)
    row_of[numbers_of(mesh, facets)] = np.arange(len(facets))
    groups, is_free = {}, np.ones(int(side.max()) + 1, dtype=bool)
    for name, members in mesh.facet_sets.items():
        row = row_of[numbers_of(mesh, members)]
        sides = np.unique(side[row]) if len(row) and (row >= 0).all() else np.zeros(0, np.int64)
        is_whole = len(row) == int(np.isin(side, sides).sum())
        if name != "boundary" and is_whole and is_free[sides].all():
            if not conflicts[np.ix_(sides, sides)].any():
                groups[name], is_free[sides] = sides, False
    facet_sets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
    for sides in _groups_without_conflict(conflicts, np.nonzero(is_free)[0], np.bincount(side)):
        number = 1
        while (name := _NAME.format(number)) in facet_sets:
            number += 1
        groups[name], facet_sets[name] = sides, facets[np.isin(side, sides)]
    curves = {}
    for name, sides in groups.items():
        point_numbers, local_pieces = np.unique(pieces[np.isin(side, sides)], return_inverse=True)
        curves[name] = CurvedFacets(
            lock(nodes.points[point_numbers]), lock(local_pieces.reshape(-1, pieces.shape[1]))
        )
    return sound_mesh(mesh.points, mesh.cells, facet_sets, mesh.cell_sets, curves)


def _bulge_of(nodes: Lattice) -> Floats:
    """Largest distance of the nodes of each piece from its straight facet, over its size."""
    x = nodes.points[nodes.facets]
    d = x.shape[2]
    corner = x[:, :d]
    size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    edge = corner[:, 1:] - corner[:, :1]
    normal = np.cross(edge[:, 0], edge[:, 1]) if d == 3 else edge[:, 0, ::-1] * (1, -1)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    height = np.abs(np.einsum("kad,kd->ka", x - x[:, :1], normal))
    return np.asarray(height.max(axis=1) / size)


def _smooth_sides(mesh: Mesh, facets: Ints, curve: CurvedFacets) -> Ints:
    """Number of the smooth side that each curved facet belongs to `(k,)`."""
    d, count = mesh.dim, len(facets)
    owner = np.tile(np.arange(count), d)
    bary = np.eye(2) if d == 2 else 0.5 * (1 - np.eye(3))[::-1]
    normal = _outward_normals(mesh, facets, curve, owner, np.repeat(bary, count, axis=0))
    a, b = ridges(facets)
    is_smooth = np.einsum("jd,jd->j", normal[a], normal[b]) > _SHARP
    return sides_of_facets(count, owner[a[is_smooth]], owner[b[is_smooth]])


def edges_of(facets: Ints) -> Ints:
    """Pairs of points between which facets `(k, d)` have an edge `(e, 2)`, smaller first."""
    pairs = facets[:, local_edges(facets.shape[1] - 1)].reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def ridges(facets: Ints) -> tuple[Ints, Ints]:
    """Where two facets `(k, d)` meet, at points in 2D, at edges in 3D: their numbers there.

    Number ``j k + i`` is ridge j of facet i: its point j, or its edge j of `local_edges`.
    """
    d = facets.shape[1]
    points = facets[:, [[0], [1]]] if d == 2 else facets[:, local_edges(2)]
    key = np.sort(np.concatenate(list(points.transpose(1, 0, 2))), axis=1)
    _, group, members = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(group.ravel(), kind="stable")
    begin = np.concatenate([[0], np.cumsum(members)])[:-1][members == 2]
    return order[begin], order[begin + 1]


def sides_of_facets(count: int, a: Ints, b: Ints) -> Ints:
    """Number of the side of each facet `(count,)`, where facets a and b go on smoothly `(j,)`."""
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _outward_normals(
    mesh: Mesh, facets: Ints, curve: CurvedFacets, owner: Ints, bary: Floats
) -> Floats:
    """Unit normals of pieces out of the body."""
    tangents = curve.places(owner, bary)[1]
    tangents = tangents[:, 1:] - tangents[:, :1]
    normal = (
        np.cross(tangents[:, 0], tangents[:, 1])
        if mesh.dim == 3
        else tangents[:, 0, ::-1] * (1, -1)
    )
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    cell = mesh.facet_to_cell[numbers_of(mesh, facets), 0]
    towards_cell = mesh.points[mesh.cells[cell]].mean(axis=1) - mesh.points[facets].mean(axis=1)
    x = mesh.points[facets]
    edge = x[:, 1:] - x[:, :1]
    straight_normal = (
        np.cross(edge[:, 0], edge[:, 1]) if mesh.dim == 3 else edge[:, 0, ::-1] * (1, -1)
    )
    is_turned = np.einsum("kd,kd->k", straight_normal, towards_cell) > 0
    return np.asarray(np.where(is_turned[owner, None], -normal, normal))


def _meeting_sides(mesh: Mesh, facets: Ints, side: Ints) -> Bools:
    """Which sides share a point, or come as close to each other as their facets are long."""
    count = int(side.max()) + 1
    pairs = np.unique(np.stack([np.repeat(side, mesh.dim), facets.ravel()], axis=1), axis=0)
    order = np.argsort(pairs[:, 1], kind="stable")
    pairs = pairs[order]
    result = np.zeros((count, count), dtype=bool)
    for step in range(1, count):  # of the sides at a point, each with the one so many further on
        is_same = pairs[step:, 1] == pairs[:-step, 1]
        if not is_same.any():
            break
        result[pairs[step:, 0][is_same], pairs[:-step, 0][is_same]] = True
    x = mesh.points[facets]
    size = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
    row, partner = pairs_within(cKDTree(x.mean(axis=1)), x.mean(axis=1), size)
    is_other_side = side[row] != side[partner]
    result[side[row[is_other_side]], side[partner[is_other_side]]] = True
    return result | result.T


def _groups_without_conflict(conflicts: Bools, sides: Ints, sizes: Ints) -> list[Ints]:
    """Sides in groups without conflicts, the largest first."""
    groups: list[list[int]] = []
    for s in sides[np.argsort(-sizes[sides], kind="stable")].tolist():
        home = next((g for g in groups if not conflicts[s, g].any()), None)
        if home is None:
            groups.append([s])
        else:
            home.append(s)
    return [np.array(g) for g in groups]


__all__ = [
    "CurvedFacets", "Lattice", "edges_of", "lattice", "outline_gain", "raised_lattice", "ridges",
    "rows_of", "sides_of_facets", "with_curves",
]  # fmt: skip
