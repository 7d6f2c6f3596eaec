"""Facets split where cracks cross them, and the integration points that neighbours share."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.mesh.mesh import numbers_of
from xcrack.mesh.split import cut_simplices
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.quadrature_2d import segment_points
from xcrack.xfem.quadrature_3d import radius_at, triangle_points

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


def split_facets(space: FunctionSpace, ends: Ints) -> FacetParts:
    """Split facets `(k, d)`, given by their points, where cracks cross them.

    In 3D those of cells at a front are split along psi too.
    """
    return _SPLIT[space.dim](space, ends)


def part_points(
    space: FunctionSpace, nodes: Ints, bary: Floats, n: int = 6
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
    return _POINTS[space.dim](space, x, nodes, bary, n)


def _on_segments(
    space: FunctionSpace, x: Floats, nodes: Ints, bary: Floats, n: int
) -> tuple[Ints, Floats, Floats]:
    return segment_points(space, np.ascontiguousarray(x[:, 0]), np.ascontiguousarray(x[:, 1]), n)


def _on_triangles(
    space: FunctionSpace, x: Floats, nodes: Ints, bary: Floats, n: int
) -> tuple[Ints, Floats, Floats]:
    sides = x[:, [1, 2, 0]] - x
    size = np.linalg.norm(sides, axis=2).max(axis=1)
    number, place, share = triangle_points(radius_at(space, nodes, bary), size)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 2]), axis=1) / 2
    order = np.argsort(number, kind="stable")
    number = number[order]
    return number, place[order], area[number] * share[order]


def _split_segments(space: FunctionSpace, ends: Ints) -> FacetParts:
    from xcrack.kernels.segments import split

    edge = numbers_of(space.mesh, ends)  # in 2D facets are edges
    position, level = (
        np.empty((len(space.cuts), len(ends))),
        np.empty((len(space.cuts), *ends.shape)),
    )
    for c, cut in enumerate(space.cuts):
        position[c], level[c] = cut.cut_edge[edge], cut.level_set.phi[ends]
    return FacetParts(*split(np.array(ends), position, level))


def _split_triangles(space: FunctionSpace, ends: Ints) -> FacetParts:
    k = len(ends)
    number, bary = np.arange(k), np.broadcast_to(np.eye(3), (k, 3, 3))
    side = np.zeros((k, len(space.cuts)), dtype=np.int64)
    facet = space.mesh.facet_numbers(ends)
    for c, cut in enumerate(space.cuts):
        touched, at_front = _touched(space, c)
        levels = [(cut.level_set.phi, touched)]
        levels += [(psi, at_front) for psi in cut.level_set.psi]
        for values, where in levels:
            chosen = where[facet[number]]
            number, bary, side = _split(number, bary, side, values[ends], chosen)
        at = np.einsum("svb,sb->sv", bary, cut.level_set.phi[ends[number]])
        largest = np.take_along_axis(at, np.abs(at).argmax(axis=1)[:, None], 1)[:, 0]
        changes = (at.min(axis=1) < 0) & (at.max(axis=1) > 0) & ~touched[facet[number]]
        side[:, c] = np.where(changes, 0, np.sign(largest))
    return FacetParts(number, bary, side)


def _touched(space: FunctionSpace, c: int) -> tuple[Bools, Bools]:
    """Facets of the cells that crack c cuts or ends in, and of the latter alone."""
    mesh, cut = space.mesh, space.cuts[c]
    flags = []
    for cells in (cut.is_cut | cut.is_tip, cut.is_tip):
        flag = np.zeros(len(mesh.facets), dtype=bool)
        flag[mesh.cell_to_facet[cells]] = True
        flags.append(flag)
    return flags[0], flags[1]


_SPLIT = {2: _split_segments, 3: _split_triangles}
_POINTS = {2: _on_segments, 3: _on_triangles}


def _split(
    number: Ints, bary: Floats, side: Ints, values: Floats, chosen: Bools
) -> tuple[Ints, Floats, Ints]:
    """Split those of the chosen parts on which a function of the facet changes its sign."""
    at = np.einsum("svb,sb->sv", bary, values[number])
    small = _AT * np.abs(values[number]).max(axis=1, keepdims=True)
    at = np.where(np.abs(at) < small, 0.0, at)
    cut = chosen & (at.min(axis=1) < 0) & (at.max(axis=1) > 0)
    same, rows = np.nonzero(~cut)[0], np.nonzero(cut)[0]
    inner, _, _, parent = cut_simplices(at[rows])
    source = np.concatenate([same, rows[parent]])
    finer = np.einsum("svw,swb->svb", inner, bary[rows[parent]])
    return number[source], np.concatenate([bary[same], finer]), side[source]
