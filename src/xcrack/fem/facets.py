"""Facets split where cracks cross them, and the integration points that neighbours share."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, offsets
from xcrack.fem.function_space import Batch, FunctionSpace
from xcrack.fem.quadrature import lip_side, quarters, radius_at, segment_points, triangle_points
from xcrack.mesh.mesh import Mesh, numbers_of
from xcrack.mesh.simplex import cut_simplices

_AT = 1e-10  # share of a facet's level set below which a value is zero


@dataclass(frozen=True, eq=False)
class FacetParts:
    """Parts of facets.

    Attributes
    ----------
    number : (s,) array of int
        Row of the facet that each part belongs to.
    bary : (s, d, d) array
        Vertices in barycentric coordinates of the facet.
    side : (s, cracks) array of int
        Side of the part, 0 where it lies on the crack or phi changes its sign on it.
    """

    number: Ints
    bary: Floats
    side: Ints


def part_points(
    space: FunctionSpace, nodes: Ints, bary: Floats, n: int = 6, halvings: int = 0
) -> tuple[Ints, Floats, Floats]:
    """Integration points on segments or triangles inside simplices, graded towards tips.

    The rule depends only on the part, so that the cells on both sides of a facet share it.

    Parameters
    ----------
    space : FunctionSpace
    nodes : (s, m) array of int
        Points of the facets or cells that the parts lie in.
    bary : (s, d, m) array
        Vertices of the parts in them.
    n : int
        Gauss points of a segment.
    halvings : int
        How often triangles nearer to a front than they are large are halved: rules suit the inverse
        root of the distance to it, products of two such fields need more.

    Returns
    -------
    number : (q,) array of int
        Part of each point.
    place : (q, d) array
        Barycentric coordinates in the part.
    weight : (q,) array
        Length or area.
    """
    x = np.einsum("svm,smd->svd", bary, space.mesh.points[nodes])
    return space.geometry.facet_points(space, x, nodes, bary, n, halvings)


def points_on_segments(
    space: FunctionSpace, x: Floats, nodes: Ints, bary: Floats, n: int, halvings: int
) -> tuple[Ints, Floats, Floats]:
    return segment_points(space, np.ascontiguousarray(x[:, 0]), np.ascontiguousarray(x[:, 1]), n)


def points_on_triangles(
    space: FunctionSpace, x: Floats, nodes: Ints, bary: Floats, n: int, halvings: int
) -> tuple[Ints, Floats, Floats]:
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    of, corner = np.arange(len(x)), np.broadcast_to(np.eye(3), (len(x), 3, 3))
    r, size = radius_at(space, nodes, bary), _longest_side(x)
    share = np.ones(len(x))
    for _ in range(halvings):
        is_near = r.min(axis=1) < size
        if not is_near.any():
            break
        parts = np.einsum("cvw,swb->scvb", quarters(), corner[is_near]).reshape(-1, 3, 3)
        of_parts = np.repeat(of[is_near], 4)
        r_of_parts = radius_at(space, nodes[of_parts], parts @ bary[of_parts])
        of = np.concatenate([of[~is_near], of_parts])
        corner = np.concatenate([corner[~is_near], parts])
        share = np.concatenate([share[~is_near], np.repeat(share[is_near] / 4, 4)])
        size = np.concatenate([size[~is_near], np.repeat(size[is_near] / 2, 4)])
        r = np.concatenate([r[~is_near], r_of_parts])
    number, place, rule = triangle_points(r, size)
    place = np.einsum("qv,qvb->qb", place, corner[number])
    weight = (area[of] * share)[number] * rule
    order = np.argsort(of[number], kind="stable")
    return of[number[order]], place[order], weight[order]


def _longest_side(x: Floats) -> Floats:
    return np.asarray(np.linalg.norm(x[:, [1, 2, 0]] - x, axis=2).max(axis=1))


def split_edges(space: FunctionSpace, ends: Ints) -> FacetParts:
    from xcrack.mesh.kernels.splitting import split_segments

    edge = numbers_of(space.mesh, ends)  # in 2D facets are edges
    position, level = (
        np.empty((len(space.cuts), len(ends))),
        np.empty((len(space.cuts), *ends.shape)),
    )
    for c, cut in enumerate(space.cuts):
        position[c], level[c] = cut.cut_edge[edge], cut.level_set.phi[ends]
    return FacetParts(*split_segments(np.array(ends), position, level))


def split_triangles(space: FunctionSpace, ends: Ints) -> FacetParts:
    k = len(ends)
    number, bary = np.arange(k), np.broadcast_to(np.eye(3), (k, 3, 3))
    side = np.zeros((k, len(space.cuts)), dtype=np.int64)
    facet = space.mesh.facet_numbers(ends)
    for c, cut in enumerate(space.cuts):
        touched_facets, at_front = _touched_facets(space, c)
        levels = [(cut.level_set.phi, touched_facets)]
        levels += [(psi, at_front) for psi in cut.level_set.psi]
        for values, facet_mask in levels:
            is_chosen = facet_mask[facet[number]]
            x = np.einsum("svb,sbd->svd", bary, space.mesh.points[ends[number]])
            number, bary, side = _split_parts(number, bary, side, x, values[ends], is_chosen)
        at = np.einsum("svb,sb->sv", bary, cut.level_set.phi[ends[number]])
        largest_value = np.take_along_axis(at, np.abs(at).argmax(axis=1)[:, None], 1)[:, 0]
        changes = (at.min(axis=1) < 0) & (at.max(axis=1) > 0) & ~touched_facets[facet[number]]
        side[:, c] = np.where(changes, 0, np.sign(largest_value))
    return FacetParts(number, bary, side)


def _touched_facets(space: FunctionSpace, c: int) -> tuple[Bools, Bools]:
    """Facets of the cells that crack c cuts or ends in, and of the latter alone."""
    mesh, cut = space.mesh, space.cuts[c]
    flags = []
    for cells in (cut.is_cut | cut.is_tip, cut.is_tip):
        flag = np.zeros(len(mesh.facets), dtype=bool)
        flag[mesh.cell_to_facet[cells]] = True
        flags.append(flag)
    return flags[0], flags[1]


def _split_parts(
    number: Ints, bary: Floats, side: Ints, x: Floats, values: Floats, is_chosen: Bools
) -> tuple[Ints, Floats, Ints]:
    """Split those of the chosen parts x on which a function of the facet changes its sign."""
    at = np.einsum("svb,sb->sv", bary, values[number])
    tolerance = _AT * np.abs(values[number]).max(axis=1, keepdims=True)
    at = np.where(np.abs(at) < tolerance, 0.0, at)
    cut = is_chosen & (at.min(axis=1) < 0) & (at.max(axis=1) > 0)
    whole_parts, rows = np.nonzero(~cut)[0], np.nonzero(cut)[0]
    bary_in_part, _, _, parent = cut_simplices(at[rows], x[rows])
    source = np.concatenate([whole_parts, rows[parent]])
    bary_of_parts = np.einsum("svw,swb->svb", bary_in_part, bary[rows[parent]])
    return number[source], np.concatenate([bary[whole_parts], bary_of_parts]), side[source]


# Integration points on the faces of a crack, shared by contact, loads and K.


@dataclass(frozen=True, eq=False)
class LipPoints:
    """Integration points on the faces of one crack.

    Attributes
    ----------
    segment : (q,) array of int
        Lip segment or triangle of the cut.
    cell : (q, 2) array of int
        Cell on side - and on side +.
    bary : (q, 2, d + 1) array
    weight : (q,) array, length^(d - 1)
    normal : (q, d) array
        From lip - to lip +.
    x : (q, d) array, length
    s : (q,) array, length
        In 2D: position along the crack from where it enters the body; zero in 3D.
    """

    segment: Ints
    cell: Ints
    bary: Floats
    weight: Floats
    normal: Floats
    x: Floats
    s: Floats

    def __len__(self) -> int:
        return len(self.weight)

    @cached_property
    def inside_cells(self) -> bool:
        """Whether no face lies on a facet of the mesh: both lips of each point are in one cell."""
        return bool((self.cell[:, 0] == self.cell[:, 1]).all())

    def way_from(self, mesh: Mesh, x: Floats) -> Floats:
        """Ways to the points from one place `(q, d)`, exact to round-off of the size of a cell.

        Differences of coordinates are exact to that of coordinates only, which may lie far from 0.
        """
        corners = mesh.points[mesh.cells[self.cell[:, 1]]] - x
        return np.asarray(np.einsum("qb,qbd->qd", self.bary[:, 1], corners))


def lip_points(space: FunctionSpace, c: int, n: int = 6) -> LipPoints:
    """Points on the faces of crack c, graded towards its tips, in the order of the crack."""
    cut, mesh = space.cuts[c], space.mesh
    bary = cut.lip_bary
    # The ends of a segment on a facet are sorted as the boundary rule sorts them.
    k, place, weight = part_points(space, mesh.cells[cut.lip_cell[:, 1]], bary[:, 1], n)
    at = np.einsum("qv,qsvb->qsb", place, bary[k])
    corners = cut.lip_points(mesh)
    x = np.einsum("qv,qvd->qd", place, corners[k])
    s = space.geometry.lip_positions(space.cracks[c].points, x, corners)
    order = np.argsort(s, kind="stable")
    k = k[order]
    return LipPoints(
        k,
        cut.lip_cell[k],
        at[order],
        weight[order],
        cut.lip_normal[k],
        x[order],
        s[order],
    )


def positions_along_line(polyline: Floats, x: Floats, corners: Floats) -> Floats:
    ends = corners.reshape(-1, 2)
    s = arc_position(polyline, np.concatenate([ends, x]))
    return np.asarray(s[len(ends) :] - s[: len(ends)].min(initial=np.inf))


def positions_on_surface(points: Floats, x: Floats, corners: Floats) -> Floats:
    """A surface has no order of its points."""
    return np.zeros(len(x))


def arc_position(polyline: Floats, x: Floats) -> Floats:
    """Position of points along a polyline, from its first point `(k,)`, length."""
    a, segment = polyline[:-1], np.diff(polyline, axis=0)
    length = np.linalg.norm(segment, axis=1)
    start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    t = np.einsum("ksd,sd->ks", x[:, None] - a, segment) / length**2
    t = np.clip(t, 0.0, 1.0)
    foot = a + t[..., None] * segment
    nearest_segment = np.argmin(np.linalg.norm(x[:, None] - foot, axis=2), axis=1)
    row = np.arange(len(x))
    return start[nearest_segment] + t[row, nearest_segment] * length[nearest_segment]


def jump_values(space: FunctionSpace, c: int, lips: LipPoints) -> list[tuple[Ints, Ints, Floats]]:
    """Signed traces of the functions on both crack faces: + lip minus - lip.

    Returns
    -------
    list of (functions (k, n), numbers of the points (k,), values (k, n))
        For each lip and batch; the jump at a point is the sum over all entries of the point.
    """
    result, inner_cells = [], lips.inside_cells
    batches: list[tuple[Batch, Ints, Ints]] = []
    for s, sign in ((0, -1), (1, 1)):
        cell = lips.cell[:, s]
        side = lip_side(space, c, cell, lips.bary[:, s], sign)
        batches = batches if inner_cells and s else space.batches_of_points(cell)
        for batch, number, row in batches:
            N, _ = space.tabulate(batch, row, lips.bary[number, s], side[number], slopes=False)
            result.append((batch.functions[row], number, sign * N))
    return result


def jump_matrix(
    space: FunctionSpace, c: int, lips: LipPoints, tangents: Floats | None = None
) -> sp.csr_matrix:
    """Jump n . [[u]] at the lip points `(q, n_dof)`; with directions `tangents` (q, d), theirs."""
    direction = lips.normal if tangents is None else tangents
    parts, rows, columns, values = jump_values(space, c, lips), [], [], []
    if lips.inside_cells:  # both lips have the same functions
        half = len(parts) // 2
        pairs = zip(parts[:half], parts[half:], strict=True)
        parts = [(functions, number, N + N_2) for (functions, number, N), (*_, N_2) in pairs]
    for functions, number, N in parts:
        is_active = (functions >= 0) & (N != 0)
        rows.append(np.broadcast_to(number[:, None], functions.shape)[is_active])
        columns.append(functions[is_active])
        values.append(N[is_active])
    place = np.concatenate(rows) * np.int64(space.n_functions) + np.concatenate(columns)
    jump = np.concatenate(values)
    if lips.inside_cells:
        order = np.argsort(place)
        place, jump = place[order], jump[order]
    else:
        place, number = np.unique(place, return_inverse=True)
        jump = np.bincount(number, jump, len(place))
    is_jump = jump != 0  # standard functions take one value on both lips of a cell
    point, function = np.divmod(place[is_jump], space.n_functions)
    d = space.dim
    entries = (jump[is_jump, None] * direction[point]).ravel()
    unknowns = (function[:, None] * d + np.arange(d)).ravel().astype(np.int32)
    start = offsets(np.bincount(point, minlength=len(lips)) * d).astype(np.int32)
    return sp.csr_matrix((entries, unknowns, start), shape=(len(lips), space.n_dof))


__all__ = []
