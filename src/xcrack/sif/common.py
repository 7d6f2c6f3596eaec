"""What K at the tips of 2D and along the fronts of 3D share."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, initial_stress_at
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import copy_without_checks
from xcrack.fem.function_space import FunctionSpace
from xcrack.mesh.locate import barycentric, cells_at
from xcrack.model.material import Isotropic
from xcrack.sif.sif import SIF


def weight(r: Floats, xi: Floats, r_inner: Floats, r_outer: Floats) -> tuple[Floats, Floats]:
    """Weight q of a domain integral, one inside and zero outside by a quintic, and its gradient.

    Parameters
    ----------
    r : (q,) array, length
        Distance to the tip.
    xi : (q, d) array, length
        Places from the tip.
    r_inner, r_outer : (k,) arrays, length
        Radii of each domain between which q falls.

    Returns
    -------
    q : (k, q) array
    gradient : (k, q, d) array, 1/length
    """
    r_inner = r_inner[:, None]
    width = r_outer[:, None] - r_inner
    z = np.clip((r - r_inner) / width, 0.0, 1.0)
    q = 1 - z**3 * (10 - 15 * z + 6 * z**2)
    slope = -30 * z**2 * (1 - z) ** 2 / width
    return q, slope[..., None] * (xi / np.maximum(r, 1e-300)[:, None])[None]


_ON_CRACK = 1e-6  # of the longest edge


def distances_to(space: FunctionSpace, x: Floats) -> Floats:
    """Distances of the mesh points in 2D to one of them `(n,)`; inf of those on cracks.

    The displacement of a point on a crack is that of one face: which one is left to the numbering.
    """
    distance = np.linalg.norm(space.mesh.points - x, axis=1)
    for cut in space.cuts:
        is_on_crack = np.abs(cut.level_set.phi) <= _ON_CRACK * space.mesh.longest_edge
        distance[is_on_crack] = np.inf
    return np.asarray(distance)


def mean_rotation(solution: Solution, distance: Floats, radius: float) -> Floats:
    """Mean rotation of the mesh points around a tip or front `(d, d)`.

    A rigid rotation adds nothing to the integrals but the quadrature error of terms that would
    vanish.

    Parameters
    ----------
    solution : Solution
    distance : (n,) array, length
        Of the mesh points to the tip or front.
    radius : float, length
    """
    points = solution.space.mesh.points
    d = points.shape[1]
    near_points = np.nonzero(distance < radius * (1 - 1e-9))[0]  # not those on the rim
    if len(near_points) <= d:
        return np.zeros((d, d))
    x = points[near_points]
    y, u = x - x.mean(axis=0), solution.coefficients[near_points]
    square, product = y.T @ y, y.T @ u
    spin = product - product.T
    if d == 2:  # about the third axis
        return np.asarray(spin.T / square.trace())
    inertia = square.trace() * np.eye(3) - square
    w = np.linalg.solve(inertia, [spin[1, 2], spin[2, 0], spin[0, 1]])
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def material_at_tip(solution: Solution, t: int) -> Isotropic:
    """The isotropic material at a tip.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the tip in `space.tips`.

    Raises
    ------
    GeometryError
        The tip lies on an interface.
    ProblemError
        The material there is not isotropic.
    """
    elasticity = solution.problem.elasticity
    if elasticity.is_uniform:
        return elasticity.materials[0].at_tip()
    return elasticity.at_tip(tip_cells(solution, t), solution.space.tips[t].x)


def tip_cells(solution: Solution, t: int) -> Ints:
    """Cells that hold a tip, or along a front."""
    tip = solution.space.tips[t]
    return solution.space.cuts[tip.crack].level_set.tip_cells[tip.number]


def tip_place(solution: Solution, t: int) -> tuple[Floats, Ints, Floats]:
    """Place of a tip in 2D `(1, 2)`, a cell that holds it `(1,)`, and where in it `(1, 3)`."""
    x, cell = solution.space.tips[t].x[None], tip_cells(solution, t)[:1]
    return x, cell, barycentric(solution.space.mesh, cell, x)


def lip_pressure(solution: Solution, c: int) -> Floats:
    """Pressure on the faces of crack c at their points: multipliers and given pressure `(q,)`.

    Parameters
    ----------
    solution : Solution
    c : int
    """
    lips, contact = solution.lips[c], solution.contact[c]
    total = np.zeros(len(lips)) if contact is None else np.array(contact.pressure)
    for load, factor in solution.acting:
        pressure = load.face_pressure(lips.x, c) if "face_pressure" in load.acts else None
        if pressure is not None:
            total = total + factor * pressure
    return total


def lip_shear(solution: Solution, c: int) -> Floats | None:
    """Tangential traction on lip + of crack c at its points `(q, d)`; None without friction.

    Parameters
    ----------
    solution : Solution
    c : int
    """
    contact = solution.contact[c]
    if contact is None or contact.shear is None or contact.tangent is None:
        return None
    if contact.shear.ndim == 1:
        return np.asarray(contact.shear[:, None] * contact.tangent)
    return np.einsum("qm,qmd->qd", contact.shear, contact.tangent)


def initial_stresses(solutions: Sequence[Solution]) -> Callable[[Floats], Floats] | None:
    """Initial stresses of all states, f(x) -> (q, 3, 3, n); None where there are none."""
    if not has_effect(solutions, "initial_stress"):
        return None

    def initial_strain(x: Floats) -> Floats:
        if solutions[0].problem.elasticity.is_uniform:
            return np.stack([s.initial_stress(x) for s in solutions], axis=-1)
        mesh = solutions[0].space.mesh
        cell = cells_at(mesh, x)
        place = cell, barycentric(mesh, cell, x), x
        return np.stack([initial_stress_at(s, *place, True) for s in solutions], axis=-1)

    return initial_strain


def has_effect(solutions: Sequence[Solution], *effects: str) -> bool:
    """Whether a load of any of the states has one of some effects, as `Load.acts` names them."""
    return any(load.acts.intersection(effects) for s in solutions for load in s.loads)


# Closed tips and fronts: where crack faces (lips) press up to there, K_I is exactly zero, and where
# they have not moved at all, so is K.

_STEEPEST = np.cos(np.pi / 4)  # of a point behind a place on a front: those beside it do not count


def with_closed(sif: SIF, solution: Solution, c: int, size: float) -> SIF:
    """K_I of closed places set to zero, and what the integral gave there put into `spread`.

    A place is closed where the lip point nearest to it, that is the one beside the front at its arc
    position, bears pressure of the multipliers; along a front also between two such places within a
    cell on either side. And it is closed where K_I came out negative, which crack faces that cannot
    overlap do not have: they press over less than the multipliers resolve. With friction K is zero
    in all modes where the faces beside a place have stuck from the first.

    Parameters
    ----------
    sif : SIF
        As the integrals gave it.
    solution : Solution
    c : int
        Crack; without multipliers nothing is closed.
    size : float, length
        Of the cells at the tip or front.
    """
    if solution.contact[c] is None:
        return sif
    is_closed = _without_gaps(is_pressed(sif, solution, c), sif, size) | (sif.K_I < 0)
    K, spread = np.array(sif.K), np.array(sif.spread)
    spread[is_closed, 0] = np.abs(K[is_closed, 0])
    K[is_closed, 0] = 0.0
    at_rest = _at_rest(sif, solution, c, size)
    spread[at_rest] = np.maximum(spread[at_rest], np.abs(K[at_rest]))
    K[at_rest] = 0.0
    return copy_without_checks(sif, K=K, spread=spread, closed=is_closed)


_REST = 1e-6  # slip over the largest displacement that is what solvers leave


def _at_rest(sif: SIF, solution: Solution, c: int, size: float) -> Bools:
    """Places beside which the faces of a cell have stuck and never slipped `(f,)`."""
    contact = solution.contact[c]
    if contact is None or not len(contact.points):
        return np.zeros(len(sif.x), dtype=bool)
    if contact.shear is None or contact.stuck is None or contact.slip is None:  # no friction
        return np.zeros(len(sif.x), dtype=bool)
    slip = np.abs(contact.slip).reshape(len(contact.points), -1).max(axis=1)
    largest_u = np.abs(solution.u).max(initial=0.0)
    is_at_rest = np.asarray(contact.stuck) & (slip <= _REST * largest_u)
    tree = cKDTree(contact.points)
    neighbours, nearest_rows = tree.query_ball_point(sif.x, size), tree.query(sif.x)[1]
    rows = [rows_nearby or [row] for rows_nearby, row in zip(neighbours, nearest_rows, strict=True)]
    return np.array([is_at_rest[rows_of_place].all() for rows_of_place in rows], dtype=bool)


def _without_gaps(is_closed: Bools, sif: SIF, size: float) -> Bools:
    """Closed places, and those of a front that have closed ones within a cell on both sides.

    On coarse meshes the multipliers of a few places fall open beside a front that is closed.
    """
    if len(sif.x) == 1 or not is_closed.any():
        return is_closed
    result = np.array(is_closed)
    places = sif.x[is_closed]
    tree = cKDTree(places)
    for row in np.nonzero(~is_closed)[0]:
        offsets = places[tree.query_ball_point(sif.x[row], size)] - sif.x[row]
        distance_along = offsets @ sif.frame[row, -1]
        result[row] = bool((distance_along > 0).any() and (distance_along < 0).any())
    return result


def pressure_at(sif: SIF, solution: Solution, c: int) -> Floats:
    """Pressure of the lip point nearest to each place `(f,)`; 0 where it is open."""
    contact = solution.contact[c]
    if contact is None or not len(contact.points):
        return np.zeros(len(sif.x))
    if len(sif.x) == 1:  # of a 2D crack; a tree takes longer to build than to look at all
        rows = ((contact.points - sif.x) ** 2).sum(axis=1).argmin(keepdims=True)
    else:
        rows = cKDTree(contact.points).query(sif.x)[1]
    return np.where(contact.closed[rows], np.maximum(contact.pressure[rows], 0.0), 0.0)


def is_pressed(sif: SIF, solution: Solution, c: int) -> Bools:
    """Whether the lip point nearest to each place bears pressure `(f,)`."""
    return np.asarray(pressure_at(sif, solution, c) > 0)


def is_shallow(sif: SIF, solution: Solution, c: int, depth: float) -> Bools:
    """Pressed places behind which crack faces are open within a depth `(f,)`.

    Parameters
    ----------
    sif : SIF
    solution : Solution
    c : int
        Crack.
    depth : float, length
    """
    result = is_pressed(sif, solution, c)
    contact = solution.contact[c]
    if contact is None or not result.any():
        return result
    is_open = contact.points[~contact.closed]
    if not len(is_open):
        return np.zeros_like(result)
    tree = cKDTree(is_open)
    for row in np.nonzero(result)[0]:
        way_back = sif.x[row] - is_open[tree.query_ball_point(sif.x[row], depth)]
        is_behind = way_back @ sif.frame[row, 0] > _STEEPEST * np.linalg.norm(way_back, axis=1)
        result[row] = is_behind.any()
    return result


__all__ = []
