"""Stress intensity factors by the interaction integral, with what acts on the crack faces.

I = int P_kj t_k q_,j dA - int_lips (P_kj m_j t_k) q ds + volume terms, where
P_kj = sigma_ij u^a_i,k + sigma^a_ij u_i,k - (sigma : eps^a) delta_kj, t is the direction ahead of
the tip and m the outward normal of a lip, on which sigma m is the true traction: the multipliers
(pressure, and shear where the faces rub) or a given pressure. On crack faces that are not straight
the auxiliary field of Williams is continued in angle to the side of the crack face, and its own
traction counts (full lip term). K = E'/2 I with the unit fields; T = E' I / f with that of a point
force f along the crack faces, less the pressure on the crack faces at the tip. An initial stress
enters by its value at the tip, which is counted in sigma : eps^a, and by its change from there,
times the derivative of eps^a.

The auxiliary fields are those of the material at the tip, C_t. A body of C(x) is one of C_t with
the initial stress (C - C_t) eps(u), which is zero at the tip; it adds

    int (C - C_t) eps(u) : (u^a_,1 (x) grad q + q grad u^a_,1) dA

and nothing where two materials are bonded: there sigma m is continuous, and the jump of grad u is
a (x) m, so that sigma^a m . u_,1 and (sigma^a : eps) m_1 jump by the same (after Yu, Wu, Guo, Du
and He, 2009, Int. J. Solids Struct. 46, 3710). Derivatives of C do not enter.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution, gradients_at, initial_stress_at
from xcrack.base.arrays import Floats, Ints
from xcrack.fem.assembly import Tabulated
from xcrack.fem.loads import position
from xcrack.fem.quadrature import Points, lip_side
from xcrack.fem.williams import continued_polar, mode_matrix, unit_gradients
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import simplex_rule
from xcrack.model.material import Isotropic
from xcrack.sif.common import (
    distances_to,
    has_effect,
    lip_pressure,
    lip_shear,
    material_at_tip,
    mean_rotation,
    tip_place,
    weight,
)

# Inner radius of the ring in which q falls, as a share of the outer one. At order 1 the ring stays
# outside the enriched disc; at order 2 a wide ring saves digits on coarse meshes (measured).
_RING = {1: 0.4, 2: 0.15}


def inner_radii(order: int, radii: Floats) -> Floats:
    """Radii within which the weight q is one, length."""
    return _RING[order] * radii


def constant_part(solution: Solution, t: int) -> float:
    """What pressure on the crack faces and initial stress at the tip add to E' I / f.

    A uniform state gives E' I / f = sigma_11 - sigma_22 for its elastic part: the displacement of
    the point force jumps across the crack faces. T is sigma_11 of the whole.
    """
    tip, tip_material = solution.space.tips[t], material_at_tip(solution, t)
    lips = solution.lips[tip.crack]
    at_tip = int(np.argmin(np.linalg.norm(lips.x - tip.x, axis=1)))
    pressure = float(lip_pressure(solution, tip.crack)[at_tip])
    stress_at_tip = _steady_stress(solution, t)
    contraction = tip_material.lam / (tip_material.lam + 2 * tip_material.mu)
    return float(stress_at_tip[0, 0] - contraction * stress_at_tip[1, 1]) - pressure


def _steady_stress(solution: Solution, t: int) -> Floats:
    """Initial stress at the tip in its frame `(d, d)`."""
    if not has_effect([solution], "initial_stress"):
        return np.zeros((2, 2))
    tip, (x, cell, bary) = solution.space.tips[t], tip_place(solution, t)
    initial_stress = initial_stress_at(solution, cell, bary, x, True)[0]
    return np.asarray(tip.frame @ initial_stress @ tip.frame.T)


@dataclass(frozen=True, eq=False)
class IntegrationRing:
    """What the domain integrals around one tip need, for several states.

    Attributes
    ----------
    t : int
        Number of the tip.
    radii, inner_radii : (k,) arrays, length
        Outer radii of the domains, and radii within which their weight is one.
    turn : (d, d, s) array
        Mean rotation of each state, subtracted from its gradients.
    coefficients : (f, d, s) array
    """

    t: int
    radii: Floats
    inner_radii: Floats
    turn: Floats
    coefficients: Floats


def ring_around(solutions: Sequence[Solution], t: int, radii: Floats) -> IntegrationRing:
    """The domains around tip t with the given outer radii."""
    space = solutions[0].space
    distance = distances_to(space, space.tips[t].x)
    turns = [mean_rotation(s, distance, float(radii.max())) for s in solutions]
    coefficients = np.stack([s.coefficients for s in solutions], axis=-1)
    return IntegrationRing(
        t, radii, inner_radii(space.order, radii), np.stack(turns, axis=-1), coefficients
    )


def _constants(solution: Solution, ring: IntegrationRing) -> tuple[Any, ...]:
    """Last arguments of the kernels of domain integrals."""
    tip, tip_material = solution.space.tips[ring.t], material_at_tip(solution, ring.t)
    return (
        tip.x, ring.turn, ring.radii, ring.inner_radii, np.ascontiguousarray(tip.frame),
        mode_matrix(tip_material.kolosov, tip_material.mu), tip_material.kolosov,
        tip_material.lam, tip_material.mu,
    )  # fmt: skip


def stiffness_change(solution: Solution, t: int, cell: Ints, bary: Floats) -> Floats:
    """Stiffness at points less that of a tip, in its frame `(q, 3, 3)`."""
    frame, tip_material = solution.space.tips[t].frame, material_at_tip(solution, t)
    return solution.problem.elasticity.change(tip_material, cell, bary, frame)


def change_in_cells(solution: Solution, t: int, part: Any) -> Floats | None:
    """The same at the points of a rule in plain cells `(k, q or 1, 3, 3)`; None where it is zero.

    Parameters
    ----------
    solution : Solution
    t : int
    part : RingPart
    """
    if not part.has_other_material:
        return None
    bary, cells = simplex_rule(2, part.degree)[0], part.plain_cells
    if not solution.problem.elasticity.is_graded:
        bary = bary[:1]
    points = np.repeat(cells, len(bary)), np.tile(bary, (len(cells), 1))
    return stiffness_change(solution, t, *points).reshape(len(cells), len(bary), 3, 3)


def plain_terms(solutions: Sequence[Solution], ring: IntegrationRing, part: Any) -> Floats:
    """Domain integrals over the plain cells of a `RingPart` `(s, radii, 3)`."""
    from xcrack.sif.kernels.ring import add_plain_cells

    space = solutions[0].space
    mesh, tip = space.mesh, space.tips[ring.t]
    cut, edges = space.cuts[tip.crack], local_edges(2)
    result = np.zeros((len(solutions), len(ring.radii), 3))
    add_plain_cells(
        result, part.plain_cells, mesh.points, mesh.cells, mesh.gradient, mesh.volume,
        space.cell_nodes, edges if space.order == 2 else edges[:0], ring.coefficients, cut.side,
        cut.level_set.psi[tip.number], *simplex_rule(2, part.degree),
        *_constants(solutions[0], ring), change_in_cells(solutions[0], ring.t, part),
    )  # fmt: skip
    return result


def point_terms(
    solutions: Sequence[Solution], ring: IntegrationRing, table: Tabulated, has_other_material: bool
) -> Floats:
    """Domain integrals over points of any cells `(s, radii, 3)`.

    Their stiffness may differ from that of the tip.
    """
    from xcrack.sif.kernels.ring import add_points

    space = solutions[0].space
    mesh, tip = space.mesh, space.tips[ring.t]
    points, gradient = table.points, table.gradients(ring.coefficients)
    result = np.zeros((len(solutions), len(ring.radii), 3))
    change = None
    if has_other_material:
        change = stiffness_change(solutions[0], ring.t, points.cell, points.bary)
    add_points(
        result, gradient, points.cell, points.bary, points.side[:, tip.crack], points.weight,
        mesh.points, mesh.cells, space.cuts[tip.crack].level_set.psi[tip.number],
        *_constants(solutions[0], ring), change,
    )  # fmt: skip
    return result


def volume_terms(solutions: Sequence[Solution], ring: IntegrationRing, points: Points) -> Floats:
    """What body forces and initial stress add at points `(s, radii, 3)`."""
    space = solutions[0].space
    tip = space.tips[ring.t]
    x = position(space, points.cell, points.bary)
    xi = (x - tip.x) @ tip.frame.T
    psi = space.cuts[tip.crack].level_set.psi[tip.number]
    is_behind = psi[space.mesh.cells[points.cell]].mean(axis=1) < 0
    r, theta = continued_polar(xi, points.side[:, tip.crack], is_behind)
    result = np.zeros((len(solutions), len(ring.radii), 3))
    q, dq = weight(r, xi, ring.inner_radii, ring.radii)
    weighted_slope = points.weight[:, None] * dq  # (radii, q, d)
    for m, field in enumerate(_auxiliary_fields(solutions, ring.t, r, theta)):
        for s, solution in enumerate(solutions):
            result[s, :, m] += _load_terms(solution, ring.t, points, x, field, q, weighted_slope)
    return result


@dataclass(frozen=True, eq=False)
class AuxiliaryField:
    """A unit field: gradient `(q, d, d)`, derivative of the gradient ahead (if needed)."""

    gradient: Floats
    curve: Floats


def _auxiliary_fields(
    solutions: Sequence[Solution], t: int, r: Floats, theta: Floats
) -> list[AuxiliaryField]:
    """The unit fields of modes I, II and of the point force."""
    tip_material = material_at_tip(solutions[0], t)
    gradients = unit_gradients(r, theta, tip_material.kolosov, tip_material.mu)
    curves = np.zeros((len(gradients), 0, 2, 2))
    if has_effect(solutions, "initial_stress"):
        curves = ahead_derivative(tip_material, r, theta)
    return [AuxiliaryField(g, c) for g, c in zip(gradients, curves, strict=True)]


def ahead_derivative(tip_material: Isotropic, r: Floats, theta: Floats) -> Floats:
    """Derivatives along ahead of the unit gradients `(3, q, 2, 2)`, by differences of 1e-5 r."""
    x, y = r * np.cos(theta), r * np.sin(theta)
    step = 1e-5 * r
    shifted = []
    for sign in (1, -1):
        moved_x = x + sign * step
        turn = np.arctan2(y, moved_x)
        angle = turn + 2 * np.pi * np.round((theta - turn) / (2 * np.pi))
        constants = tip_material.kolosov, tip_material.mu
        shifted.append(unit_gradients(np.hypot(moved_x, y), angle, *constants))
    return np.asarray((shifted[0] - shifted[1]) / (2 * step)[:, None, None])


def _load_terms(
    solution: Solution,
    t: int,
    points: Points,
    x: Floats,
    field: AuxiliaryField,
    q: Floats,
    dq: Floats,
) -> Floats:
    """Terms of body forces and initial stress, for each domain; dq is weighted."""
    tip = solution.space.tips[t]
    R, elasticity = tip.frame, solution.problem.elasticity
    total = np.zeros(len(q))
    for load, factor in solution.acting:
        if "volume" in load.acts:
            b = factor * load.volume(x) @ R.T
            total -= np.einsum("q,qi,qi,rq->r", points.weight, b, field.gradient[:, :, 0], q)
        if "initial_stress" in load.acts:
            place = x, points.cell, points.bary
            initial_stress = factor * elasticity.initial_stress(load, *place, is_exact=True)
            at_tip = factor * elasticity.initial_stress(
                load, *tip_place(solution, t), is_exact=True
            )
            stress_in_frame = np.einsum("ai,qij,bj->qab", R, initial_stress, R)
            change = np.einsum("ai,qij,bj->qab", R, initial_stress - at_tip, R)
            stress_of_tip = R @ at_tip[0] @ R.T
            total += np.einsum("q,qij,qij,rq->r", points.weight, change, field.curve, q)
            total += np.einsum("qij,qi,rqj->r", stress_in_frame, field.gradient[:, :, 0], dq)
            total -= np.einsum("ij,qij,rq->r", stress_of_tip, field.gradient, dq[..., 0])
    return total


def lip_terms(solutions: Sequence[Solution], ring: IntegrationRing) -> Floats:
    """Full lip term of each state, domain and field `(s, radii, 3)`."""
    from xcrack.sif.kernels.ring import add_lips

    space, t, radii = solutions[0].space, ring.t, ring.radii
    tip, lips = space.tips[t], solutions[0].lips[space.tips[t].crack]
    result = np.zeros((len(solutions), len(radii), 3))
    way = lips.way_from(space.mesh, tip.x)
    is_near = np.linalg.norm(way, axis=1) < radii.max()
    if not is_near.any():
        return result
    pressure = np.stack([lip_pressure(s, tip.crack)[is_near] for s in solutions])
    shear_of_solutions = [
        None if x is None else x[is_near] for x in (lip_shear(s, tip.crack) for s in solutions)
    ]
    R = tip.frame
    xi = way[is_near] @ R.T
    # The last piece is straight: what differs there is round-off, which 1 / r would magnify.
    xi[np.abs(xi[:, 1]) < 1e-9 * radii.max(), 1] = 0.0
    is_bent = bool(xi[:, 1].any())
    has_friction = any(shear is not None and shear.any() for shear in shear_of_solutions)
    if not is_bent and not pressure.any() and not has_friction:
        return result
    # Both faces at once, face - first.
    cell, bary = lips.cell[is_near], lips.bary[is_near]
    faces = [lip_side(space, tip.crack, cell[:, s], bary[:, s], 2 * s - 1) for s in (0, 1)]
    gradient, shear = np.zeros((0, 2, 2, len(solutions))), np.zeros((0, len(xi), 2))
    if is_bent:
        places = cell.T.ravel(), np.concatenate([bary[:, 0], bary[:, 1]])
        gradient = gradients_at(space, ring.coefficients, *places, np.concatenate(faces))
    if has_friction:
        shear = np.stack([np.zeros_like(xi) if x is None else x for x in shear_of_solutions])
    stress_at_tip = np.stack([_steady_stress(solution, t) for solution in solutions])
    _, *constants = _constants(solutions[0], ring)
    add_lips(
        result, xi, lips.normal[is_near] @ R.T, np.stack([face[:, tip.crack] for face in faces]),
        lips.weight[is_near], pressure, shear, gradient, stress_at_tip, *constants,
    )  # fmt: skip
    return result
