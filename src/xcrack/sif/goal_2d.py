"""K_I and K_II at a tip as functionals of displacements and pressures, for estimates of error.

What `interaction_2d` integrates, K = E'/2 I, is affine in the solution: the terms of the domain and
of bent faces in the gradients, those of straight ones in the pressures, and a constant of given
pressures, body forces and initial stress.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from xcrack.analysis.friction import tangents
from xcrack.analysis.solution import Solution, initial_stress_at
from xcrack.base.arrays import Floats
from xcrack.estimate.dual import Goal, GoalCells, GoalPoints
from xcrack.fem.assembly import tabulate_functions
from xcrack.fem.facets import LipPoints
from xcrack.fem.quadrature import Points, lip_side
from xcrack.fem.williams import continued_polar, mode_matrix, unit_gradients
from xcrack.mesh.simplex import simplex_rule
from xcrack.sif.common import distances_to, has_effect, material_at_tip, tip_place, weight
from xcrack.sif.domain_2d import class_points, domain_of, radii_of, ring_classes, ring_parts
from xcrack.sif.interaction_2d import (
    ahead_derivative,
    change_in_cells,
    inner_radii,
    ring_around,
    stiffness_change,
    volume_terms,
)

_STRAIGHT = 1e-9  # share of the radius below which a face is on the line through the tip


def tip_goal(solution: Solution, t: int) -> Goal:
    """K_I and K_II at tip t from the larger domain, as in `stress_intensity`.

    Parameters
    ----------
    solution : Solution
        Any state of a solve.
    t : int
        Number of the tip in `space.tips`.
    """
    from xcrack.estimate.kernels.goal import plain_ring, ring_factors

    space, tip_material = solution.space, material_at_tip(solution, t)
    mesh, tip = space.mesh, space.tips[t]
    radii = radii_of(domain_of(solution, t))
    r_outer = float(radii.max())
    r_inner = float(inner_radii(space.order, radii[:1])[0])
    cut = space.cuts[tip.crack]
    psi = cut.level_set.psi[tip.number]
    ring = (
        r_outer, r_inner, np.ascontiguousarray(tip.frame),
        0.5 * tip_material.E_prime * mode_matrix(tip_material.kolosov, tip_material.mu),
        tip_material.lam, tip_material.mu,
    )  # fmt: skip
    parts, plain_parts = [], []
    for part in ring_parts(solution, t, radii):
        if len(part.plain_cells):
            integrals = plain_ring(
                part.plain_cells, mesh.points, mesh.cells, mesh.gradient, mesh.volume, cut.side,
                psi, *simplex_rule(2, part.degree), tip.x, *ring,
                change_in_cells(solution, t, part),
            )  # fmt: skip
            plain_parts.append(GoalCells(part.plain_cells, *integrals))
        for at in part.other_points:
            points = at.points
            change = None
            if part.has_other_material:
                change = stiffness_change(solution, t, points.cell, points.bary)
            factor = ring_factors(
                points.cell, points.bary, points.side[:, tip.crack], points.weight,
                mesh.points, mesh.cells, psi, tip.x, *ring, change,
            )  # fmt: skip
            parts.append(GoalPoints(at, factor))
    rotation = _rotation(solution, t, r_outer)
    faces = partial(_faces, solution, t, r_outer, r_inner)
    if _has_bent_faces(solution, t, r_outer):
        on_crack, tractions, _ = faces()
        parts.extend(on_crack)
        return Goal(tuple(parts), tuple(plain_parts), rotation, tip.crack, 2, lambda: tractions)
    return Goal(tuple(parts), tuple(plain_parts), rotation, tip.crack, 2, lambda: faces()[1])


def constant(solution: Solution, t: int) -> Floats:
    """What body forces and initial stress add to K_I and K_II `(2,)`, whatever the displacements.

    Given pressures are no part of it: they enter `Goal.pressure` with those of the contact.
    """
    space, scale = solution.space, 0.5 * material_at_tip(solution, t).E_prime
    total = np.zeros(2)
    if not has_effect([solution], "volume", "initial_stress"):
        return total
    r_outer = domain_of(solution, t).outer_radius
    radii = np.array([r_outer])
    ring = ring_around([solution], t, radii)
    for cells, n, degree in ring_classes(space, space.tips[t].x, 0.0, r_outer):
        for points in class_points(space, cells, n, degree):
            total += scale * volume_terms([solution], ring, points)[0, 0, :2]
    x, cell, bary = tip_place(solution, t)
    stress_of_tip = initial_stress_at(solution, cell, bary, x, True)[0]
    _, _, per_stress = _faces(solution, t, r_outer, float(inner_radii(space.order, radii)[0]))
    return np.asarray(total + np.einsum("ijm,ij->m", per_stress, stress_of_tip))


def _rotation(solution: Solution, t: int, r_outer: float) -> Floats:
    """Mean rotation of the mesh points around the tip as a functional; see `mean_rotation`."""
    points = solution.space.mesh.points
    result = np.zeros_like(points)
    distance = distances_to(solution.space, solution.space.tips[t].x)
    near_points = np.nonzero(distance < r_outer * (1 - 1e-9))[0]
    if len(near_points) > points.shape[1]:
        y = points[near_points] - points[near_points].mean(axis=0)
        result[near_points] = np.stack([-y[:, 1], y[:, 0]], axis=1) / (y * y).sum()
    return result


def _has_bent_faces(solution: Solution, t: int, r_outer: float) -> bool:
    """Whether faces in the domain leave the line through the tip."""
    tip = solution.space.tips[t]
    way = solution.lips[tip.crack].x - tip.x
    normal_distance = np.abs(way @ tip.frame[1])[np.linalg.norm(way, axis=1) < r_outer]
    return bool((normal_distance >= _STRAIGHT * r_outer).any())


def _faces(
    solution: Solution, t: int, r_outer: float, r_inner: float
) -> tuple[Sequence[GoalPoints], Floats, Floats]:
    """Gradients on bent faces, factors of tractions `(2, q, 2)` and of the stress at the tip.

    Tractions are pressures, and shear on lip + along `tangents`.
    """
    space, tip_material = solution.space, material_at_tip(solution, t)
    tip = space.tips[t]
    lips, R, scale = solution.lips[tip.crack], tip.frame, 0.5 * tip_material.E_prime
    tractions, per_stress = np.zeros((2, len(lips), 2)), np.zeros((2, 2, 2))
    pressure, shear = tractions
    way = lips.way_from(space.mesh, tip.x)
    near_points = np.nonzero(np.linalg.norm(way, axis=1) < r_outer)[0]
    if not len(near_points):
        return (), tractions, per_stress
    xi = way[near_points] @ R.T
    xi[np.abs(xi[:, 1]) < _STRAIGHT * r_outer, 1] = 0.0
    is_bent = bool(xi[:, 1].any())
    lip_tangents = tangents(lips)[near_points, 0] @ R.T
    parts = []
    for s, sign in ((0, -1), (1, 1)):
        cell, bary = lips.cell[near_points, s], lips.bary[near_points, s]
        side = lip_side(space, tip.crack, cell, bary, sign)
        r, theta = continued_polar(xi, side[:, tip.crack], np.ones(len(xi), dtype=bool))
        outward_normal = -sign * lips.normal[near_points] @ R.T
        q, _ = weight(r, xi, np.array([r_inner]), np.array([r_outer]))
        w = scale * q[0] * lips.weight[near_points]
        factor = np.zeros((len(near_points), 2, 2, 2))
        for m, g in enumerate(unit_gradients(r, theta, tip_material.kolosov, tip_material.mu)[:2]):
            pressure[near_points, m] += w * np.einsum("qi,qi->q", outward_normal, g[:, :, 0])
            shear[near_points, m] -= sign * w * np.einsum("qi,qi->q", lip_tangents, g[:, :, 0])
            if not is_bent:
                continue
            sigma = tip_material.stress(g)
            local_tensor = sigma * outward_normal[:, :1, None]
            per_stress[:, :, m] += R.T @ np.einsum("q,qij->ij", w * outward_normal[:, 0], g) @ R
            local_tensor[:, :, 0] -= np.einsum("qij,qj->qi", sigma, outward_normal)
            factor[..., m] = np.einsum("q,ai,qab,bj->qij", w, R, local_tensor, R)
        if is_bent:
            at = tabulate_functions(space, Points(cell, bary, lips.weight[near_points], side))
            parts.append(GoalPoints(at, factor))
    return parts, tractions, per_stress


def on_faces(solution: Solution, tips: Sequence[int], lips: LipPoints) -> tuple[Floats, Floats]:
    """E'/2 q u^a_,1 on the faces - and + of a crack: values and gradients, by tip and mode.

    The influence function of K is singular: the dual solution less this field (the weight functions
    of Bueckner, 1970, behave as u^a_,1 at the tip). Where faces move, it is what counts.

    Returns
    -------
    values : (2, q, 2, 2 tips) array
    gradients : (2, q, 2, 2, 2 tips) array
    """
    singular_parts = [_singular_part(solution, t, lips) for t in tips]
    values, gradients = zip(*singular_parts, strict=True)
    return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=-1)


def _singular_part(solution: Solution, t: int, lips: LipPoints) -> tuple[Floats, Floats]:
    space, tip_material = solution.space, material_at_tip(solution, t)
    tip = space.tips[t]
    R = tip.frame
    radius = domain_of(solution, t).outer_radius
    r_outer = np.array([radius])
    values, gradients = np.zeros((2, len(lips), 2, 2)), np.zeros((2, len(lips), 2, 2, 2))
    way = lips.way_from(space.mesh, tip.x)
    near_points = np.nonzero(np.linalg.norm(way, axis=1) < radius)[0]
    xi = way[near_points] @ R.T
    for s, sign in ((0, -1), (1, 1)):
        side = np.full(len(near_points), sign)
        r, theta = continued_polar(xi, side, np.ones(len(near_points), dtype=bool))
        q, dq = weight(r, xi, inner_radii(space.order, r_outer), r_outer)
        fields = unit_gradients(r, theta, tip_material.kolosov, tip_material.mu)[:2]
        curves = ahead_derivative(tip_material, r, theta)[:2]
        for m, (g, curve) in enumerate(zip(fields, curves, strict=True)):
            scale = 0.5 * tip_material.E_prime
            values[s, near_points, :, m] = scale * q[0][:, None] * (g[:, :, 0] @ R)
            grad = q[0][:, None, None] * curve + g[:, :, :1] * dq[0][:, None]
            gradients[s, near_points, :, :, m] = scale * (R.T @ grad @ R)
    return values, gradients
