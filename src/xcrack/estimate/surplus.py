"""The surplus space: what a solution of order 2 in 2D is tested with besides its own functions.

A cubic on each edge, Li Lj (Li - Lj), and a bubble L1 L2 L3 in each triangle; those of cells that a
crack cuts from side to side also times the side of the crack, none in the cell of a tip. Residuals
of a solution in this space, and blocks of the stiffness in it, make estimates (after Bank and
Smith, 1993, SIAM J. Numer. Anal. 30, 921, whose hierarchical bases these are).
"""

from dataclasses import dataclass
from functools import lru_cache
from math import factorial
from typing import cast

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.estimate.dual import Goal
from xcrack.fem.facets import LipPoints
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import facet_points, position
from xcrack.fem.quadrature import Points, cell_points, cell_side
from xcrack.mesh.mesh import facet_set, local_edges
from xcrack.model.elasticity import Elasticity
from xcrack.model.loads import FacetPoints, Load, Support
from xcrack.model.material import isotropic_part

_POINTS, _DEGREE = 3, 4  # where tip functions act; of the products of a cubic and a quadratic


@dataclass(frozen=True, eq=False)
class HierarchicalSurplus:
    """Surplus functions on a mesh with cracks, numbered: edges, bubbles, copies.

    Attributes
    ----------
    space : FunctionSpace
    functions : (cells, 4) array of int
        Those of the three edges of each cell, and its bubble.
    sign : (cells, 3) array
        +1 where the local direction of an edge is the one of its function, else -1.
    copy : (n,) array of int
        Number of the copy that jumps, -1 where there is none; n functions without copies.
    crack : (n,) array of int
        Across which crack it jumps.
    fixed : (n + copies, 2) array of bool
        Components that supports decide.
    """

    space: FunctionSpace
    functions: Ints
    sign: Floats
    copy: Ints
    crack: Ints
    is_fixed: Bools

    @property
    def arrays(self) -> tuple[Ints, Floats, Ints, Ints, Floats]:
        """What the kernels need."""
        return self.functions, self.sign, self.copy, self.crack, self.space.mesh.gradient


def surplus(space: FunctionSpace, is_fixed: Bools) -> HierarchicalSurplus:
    """The surplus space of a function space.

    Parameters
    ----------
    space : FunctionSpace
        Of order 2 in 2D.
    is_fixed : (n_dof,) array of bool
        Unknowns that supports decide.
    """
    mesh = space.mesh
    cells, edges = len(mesh.cells), len(mesh.edges)
    functions = np.concatenate([mesh.cell_to_edge, edges + np.arange(cells)[:, None]], axis=1)
    n = edges + cells
    jumps, is_whole = np.zeros(n, dtype=bool), np.ones(n, dtype=bool)
    crack = np.zeros(n, dtype=np.int64)
    for c, cut in enumerate(space.cuts):
        functions_of_crack = np.unique(
            np.concatenate([functions[cut.cells].ravel(), _crack_edges(space, c)])
        )
        jumps[functions_of_crack], crack[functions_of_crack] = True, c
        is_whole[functions[cut.is_tip]] = False
    for joint in space.joints:
        is_whole[functions[joint.is_in_both]] = False
    jumps &= is_whole
    copy = np.full(n, -1, dtype=np.int64)
    copy[jumps] = n + np.arange(int(jumps.sum()))
    components = np.zeros((n + int(jumps.sum()), 2), dtype=bool)
    middles = slice(mesh.n_points, mesh.n_points + edges)
    components[:edges] = is_fixed.reshape(-1, 2)[middles]
    components[copy[jumps]] = components[:n][jumps]
    i, j = local_edges(2).T
    sign = np.where(mesh.cells[:, i] < mesh.cells[:, j], 1.0, -1.0)
    return HierarchicalSurplus(
        space, lock(functions), lock(sign), lock(copy), lock(crack), lock(components)
    )


def _crack_edges(space: FunctionSpace, c: int) -> Ints:
    """Edges on which crack c lies."""
    cut, to_edge = space.cuts[c], space.mesh.cell_to_edge
    pairs = cut.lip_cell[cut.lip_cell[:, 0] != cut.lip_cell[:, 1]]
    if not len(pairs):
        return np.zeros(0, dtype=np.int64)
    shared_edges = [np.intersect1d(to_edge[a], to_edge[b]) for a, b in np.unique(pairs, axis=0)]
    return np.concatenate(shared_edges)


def residuals(
    surplus: HierarchicalSurplus, elasticity: Elasticity, coefficients: Floats
) -> tuple[Floats, Floats]:
    """-a(u, w) of columns of displacements, and the stiffness of each function with its copy.

    Parameters
    ----------
    surplus : HierarchicalSurplus
    elasticity : Elasticity
        Of isotropic materials.
    coefficients : (functions of the space + 1, 2, m) array, length
        The last row is zero.

    Returns
    -------
    residual : (n + copies, 2, m) array
    blocks : (n, 4, 4) array
        Two components of each function, and two of its copy.
    """
    from xcrack.analysis.solution import gradients_at
    from xcrack.estimate.kernels.surplus import take_plain_stress, take_stress

    space = surplus.space
    mesh = space.mesh
    residual = np.zeros((len(surplus.is_fixed), 2, coefficients.shape[2]))
    blocks = np.zeros((len(surplus.copy), 4, 4))
    is_special = space.signature != 0
    is_special |= (surplus.copy[surplus.functions] >= 0).any(axis=1)
    at_corners, square = _reference()
    for material, cells in elasticity.groups(np.arange(len(mesh.cells))):
        lame = isotropic_part(material.unit.tensor(2))[:2]
        is_plain = np.logical_not(is_special[cells]) & (not material.is_graded)
        take_plain_stress(
            residual, blocks, cells[is_plain], space.cell_nodes, coefficients,
            mesh.gradient, mesh.volume, surplus.functions, surplus.sign, at_corners, square, *lame,
        )  # fmt: skip
        points = cell_points(space, cells[~is_plain], _POINTS, _DEGREE + material.is_graded)
        if len(points.cell):
            strain = gradients_at(space, coefficients, points.cell, points.bary, points.side)
            weight = elasticity.weights(points.cell, points.bary, points.weight)
            take_stress(
                residual, blocks, points.cell, points.bary, weight, points.side, strain,
                *surplus.arrays, *lame,
            )  # fmt: skip
    return residual, blocks


def goal_residual(surplus: HierarchicalSurplus, goal: Goal) -> Floats:
    """The functionals of each surplus function `(n + copies, 2, m)`."""
    from xcrack.estimate.kernels.goal import add_cells
    from xcrack.estimate.kernels.surplus import add_functional

    result = np.zeros((len(surplus.is_fixed), 2, goal.m))
    for part in goal.parts:
        at = part.at.points
        add_functional(result, at.cell, at.bary, at.side, part.factor, *surplus.arrays)
    for cell_group in goal.cells:
        functions = surplus.functions[cell_group.cells]
        factor = np.ones(functions.shape)
        factor[:, :3] = surplus.sign[cell_group.cells]
        add_cells(result, functions, factor, cell_group.on_surplus)
        copy = surplus.copy[functions]
        if (copy >= 0).any():
            side = cell_side(surplus.space, cell_group.cells)
            side = np.take_along_axis(side, surplus.crack[functions], axis=1)
            add_cells(result, copy, factor * side, cell_group.on_surplus)
    return result


def solve_surplus(surplus: HierarchicalSurplus, blocks: Floats, residual: Floats) -> Floats:
    """Each function with its copy alone: block^-1 residual `(n + copies, 2, m)`, 0 where fixed."""
    copied_edges = np.nonzero(surplus.copy >= 0)[0]
    copies = surplus.copy[copied_edges]
    n = len(surplus.copy)
    result = np.where(surplus.is_fixed[:, :, None], 0.0, residual)
    a, b, c = blocks[:, 0, 0, None], blocks[:, 0, 1, None], blocks[:, 1, 1, None]
    is_loose = surplus.is_fixed[:n].sum(axis=1) == 0
    x, y = result[:n, 0], result[:n, 1]
    coupling = np.where(is_loose[:, None], b, 0.0)
    determinant = a * c - coupling * coupling
    result[:n] = np.stack([c * x - coupling * y, a * y - coupling * x], axis=1)
    result[:n] /= determinant[:, None]
    if len(copied_edges):
        rhs = np.concatenate([residual[copied_edges], residual[copies]], axis=1)
        is_fixed = np.concatenate(
            [surplus.is_fixed[copied_edges], surplus.is_fixed[copies]], axis=1
        )
        pair_solutions = _regular_solutions(blocks[copied_edges], rhs, is_fixed)
        result[copied_edges], result[copies] = pair_solutions[:, :2], pair_solutions[:, 2:]
    return result


def _regular_solutions(blocks: Floats, rhs: Floats, is_fixed: Bools) -> Floats:
    """Solutions of blocks of four; a copy on a sliver hardly differs from its function."""
    k = np.arange(4)
    is_free: Bools = np.logical_not(is_fixed)
    A = blocks * (is_free[:, :, None] & is_free[:, None, :])
    A[:, k, k] += is_fixed
    scale = 1 / np.sqrt(A[:, k, k])
    A = A * scale[:, :, None] * scale[:, None, :]
    A[:, k, k] += 1e-9
    x = np.linalg.solve(A, rhs * (is_free * scale)[:, :, None])
    return np.asarray(x * scale[:, :, None])


def shares(surplus: HierarchicalSurplus, parts: Floats, is_total: bool = False) -> Floats:
    """Absolute contributions of functions, by cell: an edge's is halved between its cells.

    Parameters
    ----------
    surplus : HierarchicalSurplus
    parts : (n + copies, m) array
    is_total : bool
        A function and its copy count as one: on a sliver both are large and cancel.

    Returns
    -------
    (cells, m) array
    """
    n, mesh = len(surplus.copy), surplus.space.mesh
    size = np.array if is_total else np.abs
    edge_shares = size(parts[:n])
    copied_edges = np.nonzero(surplus.copy >= 0)[0]
    edge_shares[copied_edges] += size(parts[surplus.copy[copied_edges]])
    edge_shares = np.abs(edge_shares)
    edge_shares[: len(mesh.edges)][mesh.facet_to_cell[:, 1] >= 0] /= 2
    return np.asarray(edge_shares[surplus.functions].sum(axis=1))


@lru_cache(maxsize=1)
def _reference() -> tuple[Floats, Floats]:
    """Means over a triangle of w_,b times L_c, and of w_,a times w_,b, `(4, 3, 3)` each.

    w_,b is the derivative with respect to the barycentric coordinate L_b.
    """
    cubics = {0: [((2, 1, 0), 1.0), ((1, 2, 0), -1.0)], 1: [((2, 0, 1), 1.0), ((1, 0, 2), -1.0)],
             2: [((0, 2, 1), 1.0), ((0, 1, 2), -1.0)], 3: [((1, 1, 1), 1.0)]}  # fmt: skip
    at_corners, square = np.zeros((4, 3, 3)), np.zeros((4, 3, 3))
    for a, terms in cubics.items():
        slopes = [[_derivative(power, b, f) for power, f in terms] for b in range(3)]
        for b in range(3):
            for power, f in slopes[b]:
                for c in range(3):
                    at_corners[a, b, c] += f * _mean_of_monomial(
                        np.add(power, np.eye(3, dtype=int)[c])
                    )
            for c in range(3):
                for p, f in slopes[b]:
                    square[a, b, c] += sum(
                        f * g * _mean_of_monomial(np.add(p, q)) for q, g in slopes[c]
                    )
    return lock(at_corners), lock(square)


def _derivative(power: tuple[int, ...], b: int, factor: float) -> tuple[tuple[int, ...], float]:
    """Derivative of a monomial with respect to L_b; factor 0 where it vanishes."""
    lower_power = tuple(p - (k == b) for k, p in enumerate(power))
    return (lower_power, factor * power[b]) if power[b] else (power, 0.0)


def _mean_of_monomial(power: Ints) -> float:
    """Mean of a monomial of barycentric coordinates over a triangle: 2 a! b! c! / (a+b+c+2)!."""
    a, b, c = (int(p) for p in power)
    return 2 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 2)


# What loads, pressures on crack faces and imposed displacements do to the surplus functions.

_BODY = 5  # degree of the rule for body forces and initial stress


def load_residual(surplus: HierarchicalSurplus, solution: Solution) -> Floats:
    """The loads of a state, tested with the surplus functions `(n + copies, 2)`.

    Pressures on crack faces are left out: see `face_residual`.
    """
    result = np.zeros((len(surplus.is_fixed), 2))
    for load, factor in solution.acting:
        if "traction" in load.acts:
            _add_traction(result, surplus, load, factor)
        if load.acts & {"volume", "initial_stress"}:
            _add_volume(result, surplus, load, factor, solution.problem.elasticity)
    return result


def _add_traction(result: Floats, surplus: HierarchicalSurplus, load: Load, factor: float) -> None:
    """Uniform tractions do no work on the cubic of an edge, which is odd, unless it is cut."""
    space = surplus.space
    facets = facet_set(space.mesh, load.where, load.name)
    if load.is_uniform:
        owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
        facets = facets[(surplus.copy[surplus.functions[owner]] >= 0).any(axis=1)]
    if not len(facets):
        return
    points, normal = facet_points(space, facets)
    x = position(space, points.cell, points.bary)
    t = load.traction(FacetPoints(space.mesh, facets, x, normal, points.weight))
    _add(result, surplus, points, factor * t)


def _add_volume(
    result: Floats, surplus: HierarchicalSurplus, load: Load, factor: float, elasticity: Elasticity
) -> None:
    from xcrack.estimate.kernels.surplus import add_functional

    space = surplus.space
    points = cell_points(space, np.arange(len(space.mesh.cells)), 4, _BODY)
    x = position(space, points.cell, points.bary)
    if "volume" in load.acts:
        _add(result, surplus, points, factor * load.volume(x))
    if "initial_stress" in load.acts:
        sigma = factor * elasticity.initial_stress(load, x, points.cell, points.bary)
        weighted_stress = -points.weight[:, None, None] * sigma
        add_functional(
            result[:, :, None], points.cell, points.bary, points.side, weighted_stress[..., None],
            *surplus.arrays,
        )  # fmt: skip


def _add(result: Floats, surplus: HierarchicalSurplus, points: Points, density: Floats) -> None:
    """Add the integral of density . w over points."""
    functions = surplus.functions[points.cell]
    values = _values(surplus, points.cell, points.bary)
    force = (values * points.weight[:, None])[:, :, None] * density[:, None]
    np.add.at(result, functions, force)
    copy = surplus.copy[functions]
    jumps = copy >= 0
    if jumps.any():
        row, place = np.nonzero(jumps)
        side = points.side[row, surplus.crack[functions[row, place]]]
        np.add.at(result, copy[row, place], side[:, None] * force[row, place])


def _values(surplus: HierarchicalSurplus, cell: Ints, bary: Floats) -> Floats:
    """The functions of cells at points `(q, 4)`."""
    i, j = local_edges(2).T
    edges = bary[:, i] * bary[:, j] * (bary[:, i] - bary[:, j]) * surplus.sign[cell]
    return np.concatenate([edges, bary.prod(axis=1)[:, None]], axis=1)


def face_residual(surplus: HierarchicalSurplus, lips: LipPoints, pressure: Floats) -> Floats:
    """Pressures on the faces of a crack, tested with the jumps `(n + copies, 2, m)`.

    Parameters
    ----------
    surplus : HierarchicalSurplus
    lips : LipPoints
    pressure : (q, m) array, stress
        Positive where it opens the crack.
    """
    result = np.zeros((len(surplus.is_fixed), 2, pressure.shape[1]))
    force = (lips.weight[:, None] * lips.normal)[:, :, None] * pressure[:, None]
    for s in (0, 1):  # a copy is w on face + and -w on face -, and the force turns its sign too
        cell = lips.cell[:, s]
        values = _values(surplus, cell, lips.bary[:, s])
        copy = surplus.copy[surplus.functions[cell]]
        row, place = np.nonzero(copy >= 0)
        np.add.at(result, copy[row, place], values[row, place, None, None] * force[row])
    return result


def imposed_coefficients(surplus: HierarchicalSurplus, solution: Solution) -> Floats:
    """Imposed displacements less their interpolant, as surplus coefficients `(n + copies, 2)`.

    Displacements that are fitted beside a crack count as exact.
    """
    result = np.zeros((len(surplus.is_fixed), 2))
    is_taken = np.zeros((len(surplus.is_fixed), 2), dtype=bool)
    moved_supports = {
        str(load.place): (load, f) for load, f in solution.acting if "support" in load.acts
    }
    for support_of_problem in solution.problem.supports:
        support, factor = moved_supports.get(
            str(support_of_problem.where), (support_of_problem, solution.factor)
        )
        if isinstance(support_of_problem.where, str) and not support.is_uniform:
            _impose(result, is_taken, surplus, cast(Support, support), factor)
    return result


def _impose(
    result: Floats, is_taken: Bools, surplus: HierarchicalSurplus, support: Support, factor: float
) -> None:
    mesh = surplus.space.mesh
    facets = facet_set(mesh, support.where, support.name)
    owner = mesh.facet_to_cell[mesh.facet_numbers(facets), 0]
    ends = np.sort(facets[surplus.space.signature[owner] == 0], axis=1)
    if not len(ends):
        return
    i, j = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
    key = mesh.edges[:, 0] * np.int64(mesh.n_points) + mesh.edges[:, 1]
    edge = np.searchsorted(key, ends[:, 0] * np.int64(mesh.n_points) + ends[:, 1])
    at = {t: support.displacement_at(t * i + (1 - t) * j) for t in (0.0, 0.25, 0.5, 0.75, 1.0)}

    def rest(t: float) -> Floats:
        parabola = at[1.0] * t * (2 * t - 1) + at[0.0] * (1 - t) * (1 - 2 * t)
        return at[t] - parabola - at[0.5] * 4 * t * (1 - t)

    # Li Lj (Li - Lj) is 3/32 at Li = 3/4 and -3/32 at 1/4.
    coefficient = (rest(0.75) - rest(0.25)) / 2 * (32 / 3)
    is_new = surplus.is_fixed[edge] & ~is_taken[edge] & np.isfinite(coefficient)
    result[edge] = np.where(is_new, factor * coefficient, result[edge])
    is_taken[edge] = True


__all__ = []
