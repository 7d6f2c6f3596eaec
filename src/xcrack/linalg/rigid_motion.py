"""Rigid motion: what holds the body, and what to do where nothing does."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.fem.assembly import rigid_modes
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import at_joints, n_parts, part_numbers, sub_cells
from xcrack.mesh.locate import barycentric

_HELD = 1e-6  # least eigenvalue of supported rows of motions of length one from which none is left
_IMBALANCE = 1e-3  # share of the sum of all forces above which loads count as out of balance


@dataclass(frozen=True, eq=False)
class Motion:
    """Rigid motions that no support prevents.

    Attributes
    ----------
    modes : (n_dof, k) array
        Orthonormal; k = 0 for a supported body.
    pins : (k,) array of int
        Unknowns pinned to make the stiffness regular.
    """

    modes: Floats
    pins: Ints

    @cached_property
    def size(self) -> Floats:
        """Largest entry of each motion `(k,)`."""
        return np.abs(np.ascontiguousarray(self.modes.T)).max(axis=1)


def free_modes(space: FunctionSpace, is_fixed: Bools) -> Floats:
    """Orthonormal rigid motions left by supports of standard unknowns `(n,)`: `(n, k)`."""
    motions = rigid_modes(space.node_points)
    # Most bodies are held: motions of length one, orthogonal or not, show that at less cost.
    supported_rows = motions[is_fixed] / np.sqrt(np.einsum("im,im->m", motions, motions))
    if np.linalg.eigvalsh(supported_rows.T @ supported_rows)[0] > _HELD:
        return np.zeros((len(motions), 0))
    R = np.linalg.qr(motions)[0]
    supported_rows = R[is_fixed]
    gram = supported_rows.T @ supported_rows
    w, V = np.linalg.eigh(gram)
    return np.asarray(R @ V[:, w < 1e-10 * max(float(w.max(initial=0.0)), 1.0 / len(R))])


def free_motion(
    space: FunctionSpace, is_fixed: Bools, free_motions: Floats | None = None
) -> Motion:
    """Rigid motions left by the supports, and far standard unknowns to pin.

    Parameters
    ----------
    space : FunctionSpace
    is_fixed : (n_dof,) array of bool
        Unknowns that supports decide.
    free_motions : (n, k) array, optional
        As of `free_modes`, where it is known.
    """
    if space.joints or any(cut.n_tips == 0 for cut in space.cuts):
        _check_pieces(space, is_fixed)
    if free_motions is None:
        free_motions = free_modes(space, is_fixed[: space.n_nodes * space.dim])
    modes = np.zeros((space.n_dof, free_motions.shape[1]))
    modes[: len(free_motions)] = free_motions
    if free_motions.shape[1] == 0:
        return Motion(modes, np.zeros(0, dtype=np.int64))
    is_standard = np.ones(space.n_nodes, dtype=bool)
    is_standard[space.cell_nodes[space.enriched_cells]] = False
    is_standard[space.mesh.n_points :] = False
    is_point = np.zeros(space.n_nodes, dtype=bool)
    is_point[: space.mesh.n_points] = True
    for mask in (is_standard, is_point):
        candidates = (np.nonzero(mask)[0][:, None] * space.dim + np.arange(space.dim)).ravel()
        candidates = candidates[~is_fixed[candidates]]
        if len(candidates) < free_motions.shape[1]:
            continue
        triangle, pivots = scipy.linalg.qr(modes[candidates].T, mode="r", pivoting=True)
        diagonal = np.abs(np.diag(triangle))
        # Two points in 3D leave the turn about their line free.
        if diagonal[-1] > 1e-6 * diagonal[0]:
            break
    return Motion(modes, candidates[pivots[: free_motions.shape[1]]])


def balanced_loads(space: FunctionSpace, motion: Motion, f: Floats) -> tuple[Floats, float]:
    """Loads `(n_dof, states)` without their small resultants, and the largest share removed.

    Raises
    ------
    ProblemError
        A resultant above 1e-3 of the sum of all forces in a direction that nothing supports.
    """
    if motion.modes.shape[1] == 0:
        return f, 0.0
    d = space.dim
    n = space.n_nodes * d
    resultants = motion.modes.T @ f
    # Of unit translations and of rotations with a lever of the body's size.
    largest_share = 0.0
    for k, residual in enumerate(resultants.T / motion.size):
        total = _total_force(space, f[:, k])
        if total == 0:
            continue
        share = float(np.abs(residual).max() / total)
        if share > _IMBALANCE:
            resultant = rigid_modes(space.node_points).T @ f[:n, k]
            raise ProblemError(
                f"the supports leave a rigid motion free and the loads are out of balance by "
                f"{100 * share:.3g} % of the sum of all forces ({total:.4g}; resultant force "
                f"{np.round(resultant[:d], 6).tolist()}, moment about the centre "
                f"{np.round(resultant[d:], 6).tolist()}): add a support such as fix(set, axis), "
                "or loads that balance."
            )
        largest_share = max(largest_share, share)
    return f - motion.modes @ resultants, largest_share


def _total_force(space: FunctionSpace, f: Floats) -> float:
    """Sum of all forces; pressure on crack faces acts on the jumps of enriched functions alone."""
    by_function = f.reshape(-1, space.dim)
    size = np.sqrt(np.einsum("ni,ni->n", by_function, by_function))
    total = float(size[: space.n_nodes].sum())
    for number in space.heaviside:
        total += float(size[number[number >= 0]].sum())
    for tip in space.tips:
        first = tip.point_to_function[tip.point_to_function >= 0]
        functions = (first[:, None] + np.arange(tip.functions)).ravel()
        total += float(size[functions].sum()) / np.sqrt(tip.radius)
    return total


def without_motion(motion: Motion, u: Floats) -> Floats:
    """Displacements without the rigid motion that nothing prevents."""
    return np.asarray(u - motion.modes @ (motion.modes.T @ u))


def _check_pieces(space: FunctionSpace, is_fixed: Bools) -> None:
    """Raise where a crack cuts off a piece that nothing holds."""
    piece_of_node, n_pieces, volume = pieces(space)
    if n_pieces == 1:
        return
    x, d = space.node_points, space.dim
    R = rigid_modes(x) / np.abs(rigid_modes(x)).max(axis=0)
    for k in range(n_pieces):
        nodes = piece_of_node == k
        mask = is_fixed[: len(R)] & np.repeat(nodes, d)
        rank = np.linalg.matrix_rank(R[mask], tol=1e-8) if mask.any() else 0
        if rank < R.shape[1]:
            raise ProblemError(
                f"the cracks cut the body into {n_pieces} pieces, and the one around "
                f"{np.round(x[nodes].mean(axis=0), 6).tolist()} ({100 * volume[k]:.3g} % of the "
                f"body) has {R.shape[1] - rank} free rigid motion(s): give it a support of its "
                "own; contact alone cannot support it."
            )


def pieces(space: FunctionSpace) -> tuple[Ints, int, Floats]:
    """Connected pieces of the cut body: piece of each node, their number, shares of volume."""
    mesh, parts = space.mesh, n_parts(space)
    subs = sub_cells(space, np.arange(len(mesh.cells)))
    of_sub = parts * subs.cell + part_numbers(space, subs.cell, subs.side)
    part, neighbour = _neighbours(space)
    n = parts * len(mesh.cells)
    graph = sp.csr_matrix((np.ones(len(part)), (part, neighbour)), shape=(n, n))
    label = connected_components(graph, directed=False)[1]
    names, number = np.unique(label[of_sub], return_inverse=True)
    piece = np.zeros(n, dtype=np.int64)
    piece[of_sub] = number
    share = np.bincount(number, subs.fraction * mesh.volume[subs.cell], len(names))
    nodes = space.cell_nodes
    node, cell = nodes.ravel(), np.repeat(np.arange(len(nodes)), nodes.shape[1])
    sides = np.stack(space.node_side, axis=1)[node]
    of_node = np.zeros(space.n_nodes, dtype=np.int64)
    of_node[node] = piece[parts * cell + part_numbers(space, cell, sides)]
    return of_node, len(names), share / share.sum()


def _neighbours(space: FunctionSpace) -> tuple[Ints, Ints]:
    """Parts of cells that share a part of a facet on which no crack lies, by their numbers."""
    mesh = space.mesh
    inner_facets = np.nonzero(mesh.facet_to_cell[:, 1] >= 0)[0]
    parts = space.geometry.split_facets(space, mesh.facets[inner_facets])
    facet = inner_facets[parts.number]
    is_apart = np.zeros(len(facet), dtype=bool)
    for c, cut in enumerate(space.cuts):
        has_two_cells = cut.lip_cell[:, 0] != cut.lip_cell[:, 1]
        on_lip = np.zeros(len(mesh.facets), dtype=bool)
        for a, b in cut.lip_cell[has_two_cells]:
            on_lip[np.intersect1d(mesh.cell_to_facet[a], mesh.cell_to_facet[b])] = True
        lip_facets = on_lip[facet]
        for joint in space.joints:
            if joint.crack == c:
                lip_facets &= parts.side[:, joint.on] != -joint.side
        is_apart |= lip_facets
    facet, sides = facet[~is_apart], parts.side[~is_apart]
    corners = mesh.points[mesh.facets[facet]]
    x = np.einsum("svb,sbd->sd", parts.bary[~is_apart], corners) / mesh.dim
    vertex = []
    for cell in mesh.facet_to_cell[facet].T:
        own_sides = sides
        if space.joints:
            own_sides = at_joints(space, cell, barycentric(mesh, cell, x), sides.copy())
        vertex.append(n_parts(space) * cell + part_numbers(space, cell, own_sides))
    return vertex[0], vertex[1]
