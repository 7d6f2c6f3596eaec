"""What loads, pressures on crack faces and imposed displacements do to the surplus functions."""

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Bools, Floats, Ints
from xcrack.estimation.surplus import Surplus
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.sets import facet_set
from xcrack.scene.conditions import (
    BodyForce,
    Displacement,
    InitialStress,
    Load,
    Pressure,
    SetLoad,
    Traction,
    evaluate,
    evaluate_stress,
)
from xcrack.xfem.lips import LipPoints
from xcrack.xfem.loads import facet_points, name_of, position, traction_of
from xcrack.xfem.quadrature import Points, cell_points

_BODY = 5  # degree of the rule for body forces and initial stress


def load_residual(surplus: Surplus, solution: Solution) -> Floats:
    """The loads of a state, tested with the surplus functions `(n + copies, 2)`.

    Pressures on crack faces are left out: see `face_residual`.
    """
    result = np.zeros((len(surplus.fixed), 2))
    for load in solution.loads:
        if isinstance(load, SetLoad):
            _add_traction(result, surplus, load, solution.factor)
        elif isinstance(load, BodyForce | InitialStress):
            _add_volume(result, surplus, load, solution.factor)
    return result


def _add_traction(result: Floats, surplus: Surplus, load: SetLoad, by: float) -> None:
    """Constant tractions do no work on the cubic of an edge, which is odd, unless it is cut."""
    space = surplus.space
    facets = facet_set(space.mesh, load.where, name_of(load))
    if isinstance(load, Traction | Pressure) and not callable(load.value):
        owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
        facets = facets[(surplus.copy[surplus.functions[owner]] >= 0).any(axis=1)]
    if not len(facets):
        return
    points, normal = facet_points(space, facets)
    _add(result, surplus, points, by * traction_of(load, space, facets, points, normal))


def _add_volume(result: Floats, surplus: Surplus, load: Load, by: float) -> None:
    from xcrack.kernels.surplus import add_functional

    space = surplus.space
    points = cell_points(space, np.arange(len(space.mesh.cells)), 4, _BODY)
    x = position(space, points.cell, points.bary)
    if isinstance(load, BodyForce):
        _add(result, surplus, points, by * evaluate(load.value, x, "body_force"))
    elif isinstance(load, InitialStress):
        factor = -points.weight[:, None, None] * evaluate_stress(load.value, x)
        add_functional(
            result[:, :, None], points.cell, points.bary, points.side, factor[..., None],
            *surplus.arrays,
        )  # fmt: skip


def _add(result: Floats, surplus: Surplus, points: Points, density: Floats) -> None:
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


def _values(surplus: Surplus, cell: Ints, bary: Floats) -> Floats:
    """The functions of cells at points `(q, 4)`."""
    i, j = local_edges(2).T
    edges = bary[:, i] * bary[:, j] * (bary[:, i] - bary[:, j]) * surplus.sign[cell]
    return np.concatenate([edges, bary.prod(axis=1)[:, None]], axis=1)


def face_residual(surplus: Surplus, lips: LipPoints, pressure: Floats) -> Floats:
    """Pressures on the faces of a crack, tested with the jumps `(n + copies, 2, m)`.

    Parameters
    ----------
    surplus : Surplus
    lips : LipPoints
    pressure : (q, m) array, stress
        Positive where it opens the crack.
    """
    result = np.zeros((len(surplus.fixed), 2, pressure.shape[1]))
    force = (lips.weight[:, None] * lips.normal)[:, :, None] * pressure[:, None]
    for s in (0, 1):  # a copy is w on face + and -w on face -, and the force turns its sign too
        cell = lips.cell[:, s]
        values = _values(surplus, cell, lips.bary[:, s])
        copy = surplus.copy[surplus.functions[cell]]
        row, place = np.nonzero(copy >= 0)
        np.add.at(result, copy[row, place], values[row, place, None, None] * force[row])
    return result


def imposed(surplus: Surplus, solution: Solution) -> Floats:
    """Imposed displacements less their interpolant, as surplus coefficients `(n + copies, 2)`.

    Displacements that are fitted beside a crack count as exact.
    """
    result = np.zeros((len(surplus.fixed), 2))
    taken = np.zeros((len(surplus.fixed), 2), dtype=bool)
    again = {str(x.where): x for x in solution.loads if isinstance(x, Displacement)}
    for support in solution.problem.supports:
        if isinstance(support, Displacement) and isinstance(support.where, str):
            support = again.get(support.where, support)
            if callable(support.value):
                _impose(result, taken, surplus, support)
    return solution.factor * result


def _impose(result: Floats, taken: Bools, surplus: Surplus, support: Displacement) -> None:
    mesh = surplus.space.mesh
    facets = facet_set(mesh, support.where, "displacement")
    owner = mesh.facet_to_cell[mesh.facet_numbers(facets), 0]
    ends = np.sort(facets[surplus.space.signature[owner] == 0], axis=1)
    if not len(ends):
        return
    i, j = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
    key = mesh.edges[:, 0] * np.int64(mesh.n_points) + mesh.edges[:, 1]
    edge = np.searchsorted(key, ends[:, 0] * np.int64(mesh.n_points) + ends[:, 1])
    what = f"displacement({support.where!r})"
    at = {
        t: evaluate(support.value, t * i + (1 - t) * j, what) for t in (0.0, 0.25, 0.5, 0.75, 1.0)
    }

    def rest(t: float) -> Floats:
        quadratic = at[1.0] * t * (2 * t - 1) + at[0.0] * (1 - t) * (1 - 2 * t)
        return at[t] - quadratic - at[0.5] * 4 * t * (1 - t)

    # Li Lj (Li - Lj) is 3/32 at Li = 3/4 and -3/32 at 1/4.
    coefficient = (rest(0.75) - rest(0.25)) / 2 * (32 / 3)
    new = surplus.fixed[edge] & ~taken[edge]
    result[edge] = np.where(new, coefficient, result[edge])
    taken[edge] = True
