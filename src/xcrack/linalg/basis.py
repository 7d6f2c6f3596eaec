"""Change of basis that keeps the condition number that of plain finite elements.

For each node, its enriched unknowns are made orthogonal in energy to its standard ones and
orthonormal among themselves; dependent combinations are dropped. At order 2 a thin sliver makes
4 N_c plus the Heaviside functions of the midpoints of its cut edges nearly vanish, though they
sit on different nodes: the unknowns of each cut edge therefore join the block of the edge's end
that is farther from the crack (star). Those of an edge whose other end lies on the crack, or next
to it, do so too: in 3D a sliver may be a wedge along an edge of the mesh, with an uncut edge.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, offsets
from xcrack.base.machine import one_blas_thread
from xcrack.fem.function_space import FunctionSpace
from xcrack.mesh.mesh import Mesh

_BESIDE = 0.05  # of the level set at one end of an edge: nearer to the crack is the other one
_DEPENDENT = 1e-10  # eigenvalues below this share of a block's largest are dropped


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of unknowns: standard ones first, then enriched ones, ragged.

    Attributes
    ----------
    members : (k,) array of int
    offsets : (b + 1,) array of int
    n_standard : (b,) array of int
        Leading members of each block that are kept as they are.
    nodes : (b,) array of int
        At which each block is.
    """

    members: Ints
    offsets: Ints
    n_standard: Ints
    nodes: Ints


def function_nodes(space: FunctionSpace) -> Ints:
    """Node of each function `(n_functions,)`."""
    owner = np.arange(space.n_functions)
    for number in space.heaviside:
        nodes = np.nonzero(number >= 0)[0]
        owner[number[nodes]] = nodes
    for tip in space.tips:
        points = np.nonzero(tip.point_to_function >= 0)[0]
        tip_functions = tip.point_to_function[points][:, None] + np.arange(tip.functions)
        owner[tip_functions] = points[:, None]
    return owner


def node_blocks(space: FunctionSpace, kind: str, is_free: Bools) -> Blocks:
    """Free unknowns of each enriched node, in blocks: "node" or "star"."""
    owner, d = function_nodes(space), space.dim
    if kind == "star" and space.order == 2:
        for c, number in enumerate(space.heaviside):
            nodes = np.nonzero(number >= 0)[0]
            owner[number[nodes]] = _star_home(space, c, nodes)
    owner = owner[space.n_nodes :]
    nodes = np.nonzero(np.bincount(owner, minlength=1))[0]
    # Sorted by node, and so that standard functions are the first of each.
    order = np.argsort(np.concatenate([nodes, owner]), kind="stable")
    functions = np.concatenate([nodes, np.arange(space.n_nodes, space.n_functions)])[order]
    is_standard = order < len(nodes)
    members = (functions[:, None] * d + np.arange(d)).ravel()
    keep = is_free[members]
    block = np.repeat(np.cumsum(is_standard) - 1, d)[keep]
    counts = np.bincount(block, minlength=len(nodes))
    n_standard = np.bincount(block, np.repeat(is_standard, d)[keep], len(nodes)).astype(np.int64)
    return Blocks(members[keep], offsets(counts), n_standard, nodes)


def _star_home(space: FunctionSpace, c: int, nodes: Ints) -> Ints:
    mesh, cut = space.mesh, space.cuts[c]
    n = mesh.n_points
    home = nodes.copy()
    is_edge = nodes >= n
    edge = nodes[is_edge] - n
    ends = mesh.edges[edge]
    end_of_edge = np.argmax(np.abs(cut.level_set.phi[ends]), axis=1)
    end = ends[np.arange(len(ends)), end_of_edge]
    distance = np.abs(cut.level_set.phi[ends])
    on_crack = distance.min(axis=1) < _BESIDE * distance.max(axis=1)
    move = (~np.isnan(cut.cut_edge[edge]) | on_crack) & (space.heaviside[c][end] >= 0)
    home[is_edge] = np.where(move, end, nodes[is_edge])
    return home


def orthonormal_functions(K: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """The functions that replace the enriched unknowns of blocks, in the old basis `(n, k)`."""
    from xcrack.linalg.kernels.sparse import orthonormal_columns

    with one_blas_thread():
        indptr, indices, data, count = orthonormal_columns(
            K.indptr, K.indices, K.data, blocks.members, blocks.offsets, blocks.n_standard,
            _DEPENDENT,
        )  # fmt: skip
    if count < 0:
        raise np.linalg.LinAlgError("the stiffness of a block of unknowns is singular")
    return sp.csr_matrix((data, indices, indptr), shape=(K.shape[0], count))


def _by_shape(K: sp.csr_matrix, blocks: Blocks) -> list[tuple[Ints, Floats, int]]:
    """Dense blocks of K, grouped by size and number of standard unknowns."""
    from xcrack.linalg.kernels.sparse import dense_blocks

    size = np.diff(blocks.offsets)
    blocks_in_row = dense_blocks(K.indptr, K.indices, K.data, blocks.members, blocks.offsets)
    start = offsets(size**2)
    groups = []
    for s, n_standard in sorted(set(zip(size.tolist(), blocks.n_standard.tolist(), strict=True))):
        if s == n_standard:
            continue
        numbers = np.nonzero((size == s) & (blocks.n_standard == n_standard))[0]
        members = blocks.members[blocks.offsets[numbers][:, None] + np.arange(s)]
        k = blocks_in_row[start[numbers][:, None] + np.arange(s * s)].reshape(-1, s, s)
        groups.append((members, k, n_standard))
    return groups


def stars(mesh: Mesh, order: int) -> sp.csr_matrix:
    """Pattern `(n_points, n_nodes)`: each point and, at order 2, the midpoints of its edges.

    Their functions are those that end inside the cells around the point.
    """
    n = mesh.n_points
    rows, columns = [np.arange(n)], [np.arange(n)]
    if order == 2:
        rows.append(mesh.edges.T.ravel())
        columns.append(n + np.tile(np.arange(len(mesh.edges)), 2))
    row, column = np.concatenate(rows), np.concatenate(columns)
    shape = (n, int(column.max()) + 1)
    return sp.csr_matrix((np.ones(len(row), np.int8), (row, column)), shape=shape)


def patch_orthogonal(
    space: FunctionSpace, K: sp.csr_matrix, is_free: Bools, patch_kind: str = "cells"
) -> sp.csr_matrix:
    """Basis in which tip functions are orthogonal to the functions around them.

    F_i minus its projection in energy on standard and Heaviside functions, all those of the cells
    round point i ("cells") or those that end inside these cells ("star"); the latter couple it
    with no further unknown. Columns of all other unknowns are those of the identity `(n, n)`.
    """
    d = space.dim
    start, cells = space.mesh.point_to_cell
    star = stars(space.mesh, space.order) if patch_kind == "star" else None
    rows, columns, values = (
        [np.arange(space.n_dof)],
        [np.arange(space.n_dof)],
        [np.ones(space.n_dof)],
    )
    members, counts, n_patch, patch_points = [], [], [], []
    for tip in space.tips:
        for point in np.nonzero(tip.point_to_function >= 0)[0]:
            if star is not None:
                nodes = star.indices[star.indptr[point] : star.indptr[point + 1]]
            else:
                nodes = np.unique(space.cell_nodes[cells[start[point] : start[point + 1]]])
            functions = [nodes, *[h[nodes][h[nodes] >= 0] for h in space.heaviside]]
            patch = (np.concatenate(functions)[:, None] * d + np.arange(d)).ravel()
            functions_of_tip = tip.point_to_function[point] + np.arange(tip.functions)
            F = (functions_of_tip[:, None] * d + np.arange(d)).ravel()
            patch, F = patch[is_free[patch]], F[is_free[F]]
            members.append(np.concatenate([patch, F]))
            counts.append(len(patch) + len(F))
            n_patch.append(len(patch))
            patch_points.append(point)
    if members:
        blocks = Blocks(
            np.concatenate(members), offsets(np.array(counts)), np.array(n_patch),
            np.array(patch_points),
        )  # fmt: skip
        for group, k, n_p in _by_shape(K, blocks):
            pp, pf = k[:, :n_p, :n_p], k[:, :n_p, n_p:]
            diagonal = np.einsum("bii->bi", pp)
            # Functions of a sliver may have no energy but round-off.
            D = np.where(diagonal > 0, 1 / np.sqrt(np.maximum(diagonal, 1e-300)), 0.0)
            inverse = np.linalg.pinv(
                D[:, :, None] * pp * D[:, None, :], rcond=1e-10, hermitian=True
            )
            C = D[:, :, None] * (inverse @ (D[:, :, None] * pf))
            n_f = group.shape[1] - n_p
            rows.append(np.repeat(group[:, :n_p], n_f, axis=1).ravel())
            columns.append(np.tile(group[:, n_p:], (1, n_p)).ravel())
            values.append(-C.reshape(-1))
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_matrix(triplets, shape=(space.n_dof, space.n_dof))
