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

import warnings
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.conditions import (
    BodyForce,
    CrackPressure,
    InitialStress,
    evaluate,
    evaluate_scalar,
    evaluate_stress,
)
from xcrack.errors import ProblemError, XcrackWarning
from xcrack.lip_points import LipPoints, lip_points
from xcrack.loads import position
from xcrack.locate import nearest_boundary
from xcrack.quadrature import Points, cell_points, cell_side
from xcrack.solution import Solution
from xcrack.space import Space
from xcrack.williams import unit_gradients

# Inner radius of the ring in which q falls, as a share of the outer one. At order 1 the ring stays
# outside the enriched disc; at order 2 a wide ring saves digits on coarse meshes (measured).
_RING = {1: 0.4, 2: 0.2}
_OUTER = {1: 2.5, 2: 2.5}  # outer radius, as a multiple of the enriched radius
_SECOND = 0.7  # outer radius of the second domain, as a share of the first
_CHUNK = 4000  # cells integrated at once; bounds the memory
_WARN = 0.01  # difference of the two domains, as a share of K, that is worth a word


@dataclass(frozen=True, eq=False)
class SIF:
    """Stress intensity factors of one crack.

    Attributes
    ----------
    x : (f, d) array, length
        Tips in the order of the crack's points; mouths are left out.
    frame : (f, d, d) array
        Rows (ahead, normal).
    K : (f, 2) array, stress · √length
        Columns I, II; K_II is positive for a positive shear in the frame (ahead, normal).
    T : (f,) array, stress
        Stress along the lips.
    spread : (f, 2) array
        Difference between two domains, stress · √length.
    s : (f,) array, length
        Position along the front; zero in the plane.
    front : (f,) array of int
        Which front.
    at_surface : (f,) array of bool
        Ends of a front at a free surface; never in the plane.
    """

    x: Floats
    frame: Floats
    K: Floats
    T: Floats
    spread: Floats
    s: Floats
    front: Ints
    at_surface: Bools

    @property
    def K_I(self) -> Floats:
        """Opening mode `(f,)`."""
        return self.K[:, 0]

    @property
    def K_II(self) -> Floats:
        """Sliding mode `(f,)`."""
        return self.K[:, 1]

    @property
    def K_III(self) -> Floats:
        """Tearing mode `(f,)`; zero in the plane."""
        return self.K[:, 2] if self.K.shape[1] > 2 else np.zeros(len(self.K))

    def __repr__(self) -> str:
        rows = ", ".join(f"({k[0]:.6g}, {k[1]:.6g})" for k in self.K)
        return f"SIF(K = [{rows}])"


def stress_intensity(solution: Solution, crack: int = 0) -> SIF:
    """K_I, K_II and T at the tips of a crack, from two domains.

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
    space = solution.space
    if not 0 <= crack < len(space.cuts):
        raise ProblemError(f"crack {crack}: the problem has {len(space.cuts)}, numbered from 0.")
    tips = [t for t, tip in enumerate(space.tips) if tip.crack == crack]
    found = [_at_tip(solution, t) for t in tips]
    d = space.dim
    K = np.array([f[0] for f in found]).reshape(-1, d)
    return SIF(
        x=np.array([space.tips[t].x for t in tips]).reshape(-1, d),
        frame=np.array([space.tips[t].frame for t in tips]).reshape(-1, d, d),
        K=K,
        T=np.array([f[1] for f in found]),
        spread=np.array([f[2] for f in found]).reshape(-1, d),
        s=np.zeros(len(tips)),
        front=np.arange(len(tips)),
        at_surface=np.zeros(len(tips), dtype=bool),
    )


def _at_tip(solution: Solution, t: int) -> tuple[Floats, float, Floats]:
    space = solution.space
    outer, wanted, size = domain_radius(solution, t)
    radii = np.array([outer, max(_SECOND * outer, min(outer, 1.5 * size))])
    values = _integrals(solution, t, radii)
    E_prime = solution.problem.material.E_prime
    K = 0.5 * E_prime * values[:, :2]
    T = E_prime * values[:, 2] + _constant_part(solution, t)
    spread = np.abs(K[0] - K[1])
    # At a closed tip K is zero: what counts there is K of the body's mean stress at the disc.
    volume = float(space.mesh.volume.sum())
    mean_stress = np.sqrt(2 * max(solution.energy, 0.0) * E_prime / volume)
    scale = max(float(np.abs(K).max()), 0.1 * mean_stress * np.sqrt(np.pi * space.tips[t].radius))
    tip = space.tips[t]
    where = np.round(tip.x, 6).tolist()
    needed = max(tip.radius + size, 3.0 * size)
    if outer < min(wanted, needed) * (1 - 1e-12):
        warnings.warn(
            f"K at {where}: the domain is clipped to {outer:.4g} ({outer / size:.1f} cells) by the "
            f"boundary or another tip; to leave the enriched disc it needs {needed:.4g}. Refine "
            "the mesh around the tip.",
            XcrackWarning,
            stacklevel=4,
        )
    if spread.max() > _WARN * scale:
        warnings.warn(
            f"K at {where}: domains of radius {radii[0]:.4g} and {radii[1]:.4g} differ by "
            f"{spread.max():.3g}, {100 * spread.max() / scale:.2g} % of K there. Refine the mesh "
            "around the tip.",
            XcrackWarning,
            stacklevel=4,
        )
    return K[0], float(T[0]), spread


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


def domain_radius(solution: Solution, t: int) -> tuple[float, float, float]:
    """Outer radius of the domain at tip t, the wanted one, and the cell size there, length."""
    space = solution.space
    tip = space.tips[t]
    cells = space.cuts[tip.crack].level_set.tip_cells[tip.number]
    size = float(space.mesh.cell_size[cells].mean())
    wanted = solution.problem.numerics.domain or max(_OUTER[space.order] * tip.radius, 4.0 * size)
    free, _ = nearest_boundary(space.mesh, tip.x)
    others = [np.linalg.norm(o.x - tip.x) for o in space.tips if o is not tip]
    lips = [
        np.linalg.norm(points.x - tip.x, axis=1).min()
        for c, points in enumerate(solution.lips)
        if c != tip.crack and len(points)
    ]
    limit = min([0.95 * free, *[0.8 * float(o) for o in others], *[0.9 * float(v) for v in lips]])
    return min(wanted, max(limit, 1.2 * size)), wanted, size


def _integrals(solution: Solution, t: int, radii: Floats) -> Floats:
    """I of modes I, II and of the point force for each domain `(radii, 3)`."""
    total = _lip_terms(solution, t, radii)
    tip = solution.space.tips[t]
    for points in _domain_points(solution.space, tip.x, float(radii.max())):
        total += _domain_terms(solution, t, radii, points)
    return total


def _domain_terms(solution: Solution, t: int, radii: Floats, points: Points) -> Floats:
    """Domain integrals over some of the points `(radii, 3)`."""
    space = solution.space
    tip = space.tips[t]
    x = position(space, points.cell, points.bary)
    _, gradient = solution.at(points.cell, points.bary, points.side)
    material = solution.problem.material
    sigma0 = solution.initial_stress(x)
    R = tip.frame
    # Everything in the frame (ahead, normal); mirrored where the frame is left-handed, which
    # changes no formula because K_II is defined by that frame.
    local = np.einsum("ai,qij,bj->qab", R, gradient, R)
    elastic = material.stress(local)
    sigma = elastic + np.einsum("ai,qij,bj->qab", R, sigma0, R)
    steady = _steady(solution, t)
    xi = (x - tip.x) @ R.T
    psi = space.cuts[tip.crack].level_set.psi[tip.number]
    behind = psi[space.mesh.cells[points.cell]].mean(axis=1) < 0
    r, theta = _angle(xi, points.side[:, tip.crack], behind)
    aux = _auxiliary(solution, r, theta)
    result = np.zeros((len(radii), 3))
    q, dq = _weight(r, xi, radii, _RING[space.order])
    for m, (grad_a, sigma_a, curve) in enumerate(aux):
        W = np.einsum("qij,qij->q", elastic + steady, grad_a)
        P = np.einsum("qij,qi->qj", sigma, grad_a[:, :, 0]) + np.einsum(
            "qij,qi->qj", sigma_a, local[:, :, 0]
        )
        P[:, 0] -= W
        result[:, m] += np.einsum("q,qj,rqj->r", points.weight, P, dq)
        result[:, m] += _volume_terms(solution, t, points, x, grad_a, curve, q)
    return result


def _domain_points(space: Space, centre: Floats, radius: float) -> list[Points]:
    """Integration points of all cells that meet the disc, denser where cells are large."""
    mesh = space.mesh
    near = np.array(
        mesh.cell_tree.query_ball_point(centre, radius + float(mesh.cell_size.max())),
        dtype=np.int64,
    )
    near.sort()
    middle = mesh.points[mesh.cells[near]].mean(axis=1)
    near = near[np.linalg.norm(middle - centre, axis=1) <= radius + mesh.cell_size[near]]
    share = mesh.cell_size[near] / radius
    parts: list[Points] = []
    for low, high, n, degree in ((0.0, 0.03, 4, 4), (0.03, 0.1, 4, 8), (0.1, np.inf, 5, 10)):
        cells = near[(share > low) & (share <= high)]
        parts.extend(
            cell_points(space, cells[first : first + _CHUNK], n, degree)
            for first in range(0, len(cells), _CHUNK)
        )
    return parts


def _weight(r: Floats, xi: Floats, radii: Floats, ring: float) -> tuple[Floats, Floats]:
    """Weight q, one inside and zero outside by a quintic, and its gradient, for each domain."""
    inner = ring * radii[:, None]
    width = radii[:, None] - inner
    z = np.clip((r - inner) / width, 0.0, 1.0)
    q = 1 - z**3 * (10 - 15 * z + 6 * z**2)
    slope = -30 * z**2 * (1 - z) ** 2 / width
    return q, slope[..., None] * (xi / np.maximum(r, 1e-300)[:, None])[None]


def _angle(xi: Floats, side: Ints, behind: Bools) -> tuple[Floats, Floats]:
    """Polar coordinates at a tip, the cut of the angle following the real lips.

    A point on side + of a crack that bends down may have a negative polar angle: it is continued
    by a turn, so that the auxiliary field jumps where the crack is. `behind` tells the side of
    the crack from that of its prolongation ahead.
    """
    r = np.hypot(xi[:, 0], xi[:, 1])
    theta = np.arctan2(xi[:, 1], xi[:, 0])
    known = behind & (side != 0)
    theta = np.where(known & (side > 0) & (theta < 0), theta + 2 * np.pi, theta)
    return r, np.where(known & (side < 0) & (theta > 0), theta - 2 * np.pi, theta)


_Aux = tuple[Floats, Floats, Floats]


def _auxiliary(solution: Solution, r: Floats, theta: Floats) -> list[_Aux]:
    """Gradient, stress and derivative of the gradient ahead, of the three unit fields."""
    material = solution.problem.material
    gradients = unit_gradients(r, theta, material.kolosov, material.mu)
    curves = np.zeros((len(gradients), 0, 2, 2))
    if any(isinstance(load, InitialStress) for load in solution.loads):
        curves = _ahead_derivative(solution, r, theta)
    return [(g, material.stress(g), c) for g, c in zip(gradients, curves, strict=True)]


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


def _volume_terms(
    solution: Solution, t: int, points: Points, x: Floats, grad_a: Floats, curve: Floats, q: Floats
) -> Floats:
    """Terms of body forces and initial stress, for each domain."""
    R = solution.space.tips[t].frame
    total = np.zeros(len(q))
    for load in solution.loads:
        if isinstance(load, BodyForce):
            b = solution.factor * evaluate(load.value, x, "body_force") @ R.T
            total -= np.einsum("q,qi,qi,rq->r", points.weight, b, grad_a[:, :, 0], q)
        elif isinstance(load, InitialStress):
            at_tip = evaluate_stress(load.value, solution.space.tips[t].x[None])
            change = evaluate_stress(load.value, x) - at_tip
            s0 = np.einsum("ai,qij,bj->qab", R, change, R)
            total += np.einsum("q,qij,qij,rq->r", points.weight, s0, curve, q)
    return total


def _lip_terms(solution: Solution, t: int, radii: Floats) -> Floats:
    """Full lip term of each domain and field `(radii, 3)`."""
    space = solution.space
    tip = space.tips[t]
    lips = lip_points(space, tip.crack)
    near = np.linalg.norm(lips.x - tip.x, axis=1) < radii.max()
    result = np.zeros((len(radii), 3))
    if not near.any():
        return result
    pressure = _lip_pressure(solution, tip.crack, lips)
    R = tip.frame
    material = solution.problem.material
    steady = _steady(solution, t)
    xi = (lips.x - tip.x) @ R.T
    bent = np.abs(xi[near, 1]).max() > 1e-9 * radii.max()
    if not bent and not np.abs(pressure[near]).any():
        return result
    for s, sign in ((0, -1), (1, 1)):
        cell, bary = lips.cell[near, s], lips.bary[near, s]
        side = cell_side(space, cell)
        side[:, tip.crack] = sign
        r, theta = _angle(xi[near], side[:, tip.crack], np.ones(len(cell), dtype=bool))
        m_out = -sign * lips.normal[near] @ R.T
        traction = -pressure[near, None] * m_out
        q, _ = _weight(r, xi[near], radii, _RING[space.order])
        w = lips.weight[near]
        aux = _auxiliary(solution, r, theta)
        local = None
        if bent:
            _, gradient = solution.at(cell, bary, side)
            local = np.einsum("ai,qij,bj->qab", R, gradient, R)
        for k, (grad_a, sigma_a, _) in enumerate(aux):
            density = np.einsum("qi,qi->q", traction, grad_a[:, :, 0])
            if local is not None:
                density += np.einsum("qij,qj,qi->q", sigma_a, m_out, local[:, :, 0])
                W = np.einsum("qij,qij->q", material.stress(local) + steady, grad_a)
                density -= W * m_out[:, 0]
            result[:, k] -= np.einsum("q,q,rq->r", w, density, q)
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
