"""Stress intensity factors by the interaction integral, with what acts on the lips.

I = int P_kj t_k q_,j dA - int_lips (P_kj m_j t_k) q ds + volume terms, where
P_kj = sigma_ij u^a_i,k + sigma^a_ij u_i,k - (sigma : eps^a) delta_kj, t is the direction ahead of
the tip and m the outward normal of a lip, on which sigma m is the true traction: the multipliers
or a given pressure. On lips that are not straight the auxiliary field of Williams is continued
in angle to the side of the lip, and its own traction counts (full lip term).
K = E'/2 I with the unit fields; T = E' I / f with that of a point force f along the lips, less
the pressure on the lips at the tip. An initial stress enters by its value at the tip, which is
counted in sigma : eps^a, and by its change from there, times the derivative of eps^a.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.analysis.solution import Solution, gradients_at
from xcrack.arrays import Floats
from xcrack.errors import ProblemError, warn
from xcrack.scene.conditions import (
    BodyForce,
    CrackPressure,
    InitialStress,
    evaluate,
    evaluate_scalar,
    evaluate_stress,
)
from xcrack.sif.domain_2d import domain_points, domain_radius, inner_radii, mean_rotation, weight
from xcrack.sif.fronts_3d import along_fronts
from xcrack.sif.sif import SIF
from xcrack.xfem.lips import LipPoints
from xcrack.xfem.quadrature import Points, cell_side
from xcrack.xfem.williams import continued_polar, mode_matrix, unit_gradients

_SECOND = 0.7  # outer radius of the second domain, as a share of the first
_WARN = 0.01  # difference of the two domains, as a share of K, that is worth a word


def stress_intensity(solution: Solution, crack: int = 0) -> SIF:
    """K_I, K_II and T at the tips, or K_I to K_III along the fronts of a crack, from two domains.

    Parameters
    ----------
    solution : Solution
    crack : int

    Returns
    -------
    SIF

    Raises
    ------
    ProblemError
        No such crack.

    Warns
    -----
    XcrackWarning
        A domain that body or other tips clip below two cells beyond the tip's disc, or two
        domains that differ by more than 1 % of K there.
    """
    return stress_intensities([solution], crack)[0]


def stress_intensities(solutions: Sequence[Solution], crack: int = 0) -> list[SIF]:
    """K of several load states that one solve returned; what is geometry is made once.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    crack : int

    Returns
    -------
    list of SIF

    Raises
    ------
    ProblemError
        No such crack, or solutions of different problems.
    """
    space = solutions[0].space
    if any(solution.space is not space for solution in solutions):
        raise ProblemError("the solutions do not share one space: pass the states of one solve.")
    if not 0 <= crack < len(space.cuts):
        raise ProblemError(
            f"crack {crack}: the problem has {len(space.cuts)} crack(s), numbered from 0."
        )
    # Cycles from nothing are the most common ones: their lower state has no K to look for.
    live = [s for s in solutions if not s.at_rest] or list(solutions[:1])
    found = along_fronts(live, crack) if space.dim == 3 else _at_tips(live, crack)
    place = np.cumsum([not s.at_rest for s in solutions]) - 1
    K, T = np.zeros_like(found[0].K), np.where(np.isnan(found[0].T), np.nan, 0.0)
    rest = replace(found[0], K=K, T=T, spread=K)
    return [rest if s.at_rest else found[k] for s, k in zip(solutions, place, strict=True)]


def _at_tips(solutions: Sequence[Solution], crack: int) -> list[SIF]:
    """K_I, K_II and T at the tips of a crack in the plane, for each state."""
    space = solutions[0].space
    tips = [t for t, tip in enumerate(space.tips) if tip.crack == crack]
    by_tip = [_at_tip(solutions, t) for t in tips]
    d = space.dim
    return [
        SIF(
            x=np.array([space.tips[t].x for t in tips]).reshape(-1, d),
            frame=np.array([space.tips[t].frame for t in tips]).reshape(-1, d, d),
            K=np.array([found[k][0] for found in by_tip]).reshape(-1, d),
            T=np.array([found[k][1] for found in by_tip]),
            spread=np.array([found[k][2] for found in by_tip]).reshape(-1, d),
            s=np.zeros(len(tips)),
            front=np.arange(len(tips)),
            at_surface=np.zeros(len(tips), dtype=bool),
        )
        for k in range(len(solutions))
    ]


def _at_tip(solutions: Sequence[Solution], t: int) -> list[tuple[Floats, float, Floats]]:
    """K, T and spread of each state at one tip."""
    space, tip = solutions[0].space, solutions[0].space.tips[t]
    outer, wanted, size = domain_radius(solutions[0], t)
    radii = np.array([outer, max(_SECOND * outer, min(outer, 1.5 * size))])
    E_prime = solutions[0].problem.material.E_prime
    where = np.round(tip.x, 6).tolist()
    needed = max(tip.radius + size, 3.0 * size)
    if outer < min(wanted, needed) * (1 - 1e-12):
        warn(
            f"K at {where}: the domain is clipped to {outer:.4g} ({outer / size:.1f} cells) by the "
            f"boundary or another tip; to leave the enriched disc it needs {needed:.4g}. Refine "
            "the mesh around the tip."
        )
    volume = float(space.mesh.volume.sum())
    result, worst = [], (0.0, 0.0)
    for solution, values in zip(solutions, _integrals(solutions, t, radii), strict=True):
        K = 0.5 * E_prime * values[:, :2]
        T = E_prime * values[0, 2] + _constant_part(solution, t)
        spread = np.abs(K[0] - K[1])
        # At a closed tip K is zero: what counts there is K of the body's mean stress at the disc.
        mean_stress = np.sqrt(2 * max(solution.energy, 0.0) * E_prime / volume)
        scale = max(float(np.abs(K).max()), 0.1 * mean_stress * np.sqrt(np.pi * tip.radius))
        if scale > 0 and spread.max() / scale > worst[1]:
            worst = float(spread.max()), float(spread.max() / scale)
        result.append((K[0], float(T), spread))
    if worst[1] > _WARN:
        warn(
            f"K at {where}: domains of radius {radii[0]:.4g} and {radii[1]:.4g} differ by "
            f"{worst[0]:.3g}, {100 * worst[1]:.2g} % of K there. Refine the mesh around the tip."
        )
    return result


def _constant_part(solution: Solution, t: int) -> float:
    """What pressure on the lips and initial stress at the tip add to E' I / f.

    A uniform state gives E' I / f = sigma_11 - sigma_22 for its elastic part: the displacement of
    the point force jumps across the lips. T is sigma_11 of the whole.
    """
    tip, material = solution.space.tips[t], solution.problem.material
    lips = solution.lips[tip.crack]
    at_tip = int(np.argmin(np.linalg.norm(lips.x - tip.x, axis=1)))
    pressure = float(_lip_pressure(solution, tip.crack, lips)[at_tip])
    steady = _steady(solution, t)
    contraction = material.lam / (material.lam + 2 * material.mu)
    return float(steady[0, 0] - contraction * steady[1, 1]) - pressure


def _steady(solution: Solution, t: int) -> Floats:
    """Initial stress at the tip in its frame `(d, d)`."""
    tip = solution.space.tips[t]
    return np.asarray(tip.frame @ solution.initial_stress(tip.x[None])[0] @ tip.frame.T)


def _integrals(solutions: Sequence[Solution], t: int, radii: Floats) -> Floats:
    """I of modes I, II and of the point force for each state and domain `(s, radii, 3)`."""
    space, tip = solutions[0].space, solutions[0].space.tips[t]
    turn = np.stack([mean_rotation(s, t, float(radii.max())) for s in solutions], axis=-1)
    total = _lip_terms(solutions, t, radii, turn)
    coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
    # Within the inner radius grad q vanishes: only loads of the volume need points there.
    hollow = 0.0 if _volume_loads(solutions) else float(inner_radii(space.order, radii).min())
    for points, x in domain_points(space, tip.x, (hollow, float(radii.max()))):
        gradient = gradients_at(space, coefficients, points.cell, points.bary, points.side)
        total += _domain_terms(solutions, t, radii, points, x, gradient - turn)
    return total


def _volume_loads(solutions: Sequence[Solution]) -> bool:
    return any(isinstance(load, BodyForce | InitialStress) for s in solutions for load in s.loads)


def _domain_terms(
    solutions: Sequence[Solution],
    t: int,
    radii: Floats,
    points: Points,
    x: Floats,
    gradient: Floats,
) -> Floats:
    """Domain integrals over some of the points `(s, radii, 3)`; gradient: (q, d, d, s)."""
    from xcrack.kernels.ring import add_ring

    space, material = solutions[0].space, solutions[0].problem.material
    tip = space.tips[t]
    xi = (x - tip.x) @ tip.frame.T
    psi = space.cuts[tip.crack].level_set.psi[tip.number]
    behind = psi[space.mesh.cells[points.cell]].mean(axis=1) < 0
    r, theta = continued_polar(xi, points.side[:, tip.crack], behind)
    result = np.zeros((len(solutions), len(radii), 3))
    add_ring(
        result, gradient, xi, theta, points.weight, radii, inner_radii(space.order, radii),
        np.ascontiguousarray(tip.frame), mode_matrix(material.kolosov, material.mu),
        material.kolosov, material.lam, material.mu,
    )  # fmt: skip
    if _volume_loads(solutions):
        q, dq = weight(space.order, r, xi, radii)
        weighted = points.weight[:, None] * dq  # (radii, q, d)
        for m, field in enumerate(_auxiliary(solutions, r, theta)):
            for s, solution in enumerate(solutions):
                result[s, :, m] += _load_terms(solution, t, points, x, field, q, weighted)
    return result


@dataclass(frozen=True, eq=False)
class _Field:
    """A unit field: gradient `(q, d, d)`, stress, derivative of the gradient ahead (if needed)."""

    gradient: Floats
    stress: Floats
    curve: Floats


def _auxiliary(solutions: Sequence[Solution], r: Floats, theta: Floats) -> list[_Field]:
    """The unit fields of modes I, II and of the point force."""
    material = solutions[0].problem.material
    gradients = unit_gradients(r, theta, material.kolosov, material.mu)
    curves = np.zeros((len(gradients), 0, 2, 2))
    if any(isinstance(load, InitialStress) for s in solutions for load in s.loads):
        curves = _ahead_derivative(solutions[0], r, theta)
    return [_Field(g, material.stress(g), c) for g, c in zip(gradients, curves, strict=True)]


def _ahead_derivative(solution: Solution, r: Floats, theta: Floats) -> Floats:
    """Derivatives along ahead of the unit gradients, by central differences of size 1e-5 r."""
    material = solution.problem.material
    x, y = r * np.cos(theta), r * np.sin(theta)
    step = 1e-5 * r
    shifted = []
    for sign in (1, -1):
        moved = x + sign * step
        turn = np.arctan2(y, moved)
        continued = turn + 2 * np.pi * np.round((theta - turn) / (2 * np.pi))
        shifted.append(unit_gradients(np.hypot(moved, y), continued, material.kolosov, material.mu))
    return np.asarray((shifted[0] - shifted[1]) / (2 * step)[:, None, None])


def _load_terms(
    solution: Solution, t: int, points: Points, x: Floats, field: _Field, q: Floats, dq: Floats
) -> Floats:
    """Terms of body forces and initial stress, for each domain; dq is weighted."""
    tip = solution.space.tips[t]
    R = tip.frame
    total = np.zeros(len(q))
    for load in solution.loads:
        if isinstance(load, BodyForce):
            b = solution.factor * evaluate(load.value, x, "body_force") @ R.T
            total -= np.einsum("q,qi,qi,rq->r", points.weight, b, field.gradient[:, :, 0], q)
        elif isinstance(load, InitialStress):
            everywhere = evaluate_stress(load.value, x)
            at_tip = evaluate_stress(load.value, tip.x[None])
            full = np.einsum("ai,qij,bj->qab", R, everywhere, R)
            change = np.einsum("ai,qij,bj->qab", R, everywhere - at_tip, R)
            steady = R @ at_tip[0] @ R.T
            total += np.einsum("q,qij,qij,rq->r", points.weight, change, field.curve, q)
            total += np.einsum("qij,qi,rqj->r", full, field.gradient[:, :, 0], dq)
            total -= np.einsum("ij,qij,rq->r", steady, field.gradient, dq[..., 0])
    return total


def _lip_terms(solutions: Sequence[Solution], t: int, radii: Floats, turn: Floats) -> Floats:
    """Full lip term of each state, domain and field `(s, radii, 3)`; turn: (d, d, s)."""
    space = solutions[0].space
    tip, lips = space.tips[t], solutions[0].lips[space.tips[t].crack]
    result = np.zeros((len(solutions), len(radii), 3))
    near = np.linalg.norm(lips.x - tip.x, axis=1) < radii.max()
    if not near.any():
        return result
    pressure = np.stack([_lip_pressure(s, tip.crack, lips)[near] for s in solutions])
    R = tip.frame
    material = solutions[0].problem.material
    xi = (lips.x[near] - tip.x) @ R.T
    # The last piece is straight: what differs there is round-off, which 1 / r would magnify.
    xi[np.abs(xi[:, 1]) < 1e-9 * radii.max(), 1] = 0.0
    bent = bool(xi[:, 1].any())
    if not bent and not pressure.any():
        return result
    coefficients = np.stack([s.coefficients for s in solutions], axis=-1)
    behind = np.ones(len(xi), dtype=bool)
    w = lips.weight[near]
    for s, sign in ((0, -1), (1, 1)):
        cell, bary = lips.cell[near, s], lips.bary[near, s]
        side = cell_side(space, cell)
        side[:, tip.crack] = sign
        r, theta = continued_polar(xi, side[:, tip.crack], behind)
        outward = -sign * lips.normal[near] @ R.T
        q, _ = weight(space.order, r, xi, radii)
        aux = _auxiliary(solutions, r, theta)
        local = None
        if bent:
            gradient = gradients_at(space, coefficients, cell, bary, side) - turn
            local = np.einsum("ai,qijs,bj->sqab", R, gradient, R)
        for k, solution in enumerate(solutions):
            traction = -pressure[k][:, None] * outward
            for m, field in enumerate(aux):
                density = np.einsum("qi,qi->q", traction, field.gradient[:, :, 0])
                if local is not None:
                    density += np.einsum("qij,qj,qi->q", field.stress, outward, local[k][:, :, 0])
                    sigma = material.stress(local[k]) + _steady(solution, t)
                    density -= np.einsum("qij,qij->q", sigma, field.gradient) * outward[:, 0]
                result[k, :, m] -= q @ (w * density)
    return result


def _lip_pressure(solution: Solution, c: int, lips: LipPoints) -> Floats:
    """Pressure on the lips at their points: multipliers and given pressure `(q,)`."""
    contact = solution.contact[c]
    total = np.zeros(len(lips)) if contact is None else np.array(contact.pressure)
    for load in solution.loads:
        if isinstance(load, CrackPressure) and load.crack in (None, c):
            given = evaluate_scalar(load.value, lips.x, "crack_pressure")
            total = total + solution.factor * given
    return total
