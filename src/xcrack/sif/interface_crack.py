"""K of cracks along a bonded interface in the plane, whose tips lie between two materials.

The stress ahead of such a tip oscillates (Williams, 1959):

    sigma_22 + i sigma_12 = (K_1 + i K_2) (r / length)^(i epsilon) / sqrt(2 pi r),

with 2 pi epsilon = ln((kappa_1/mu_1 + 1/mu_2) / (kappa_2/mu_2 + 1/mu_1)), material 1 being that
into which the normal of the tip points. The energy release rate is G = (K_1² + K_2²) / (E* cosh²(pi
epsilon)), 2/E* = 1/E'_1 + 1/E'_2 (Rice, 1988, J. Appl. Mech. 55, 98). K_1 and K_2 come from
interaction integrals with the fields of unit K_1 and K_2 of two half-planes, in Muskhelishvili's
potentials: Phi = F / a of the material, Omega = F / a of the other one, F = C z^(-1/2 - i epsilon),
a_1 = kappa_1/mu_1 + 1/mu_2 and a_2 = kappa_2/mu_2 + 1/mu_1.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from xcrack.analysis.solution import Solution, SolutionArgument, gradients_at, initial_stress_at
from xcrack.base.arguments import Length, Whole, check_arguments
from xcrack.base.arrays import Bools, Floats, at, lock
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.fem.loads import position
from xcrack.fem.quadrature import Points, lip_side
from xcrack.fem.williams import continued_polar
from xcrack.model.material import Isotropic
from xcrack.sif.common import (
    distances_to,
    has_effect,
    lip_pressure,
    lip_shear,
    mean_rotation,
    tip_cells,
    weight,
)
from xcrack.sif.domain_2d import class_points, domain_of, radii_of, ring_classes

_INNER = 0.15  # inner radius of the ring in which the weight falls, as a share of the outer one
_FLAT = 1e-9  # of the radius: what lies on the interface but for round-off
_ZONE = 0.01  # of the radius: longer contact at a tip leaves no field that K describes


@dataclass(frozen=True, eq=False)
class InterfaceSIF:
    """Complex K at tips on an interface.

    Attributes
    ----------
    x : (f, 2) array, length
    frame : (f, 2, 2) array
        Rows ahead and normal; the normal points into material 1.
    K_1, K_2 : (f,) arrays, stress · √length
        With r measured in `length`; nan where a contact zone is too long for them.
    spread : (f,) array, stress · √length
        Difference of two domains.
    G : (f,) array, stress · length
        Energy release rate.
    epsilon : (f,) array
        Index of the oscillation.
    length : float, length
        To which K refers.
    contact_zone : (f,) array, length
        How far from a tip the faces press.
    reasons : tuple of str
        Why K is nan, by tip; empty where it is not.
    """

    x: Floats
    frame: Floats
    K_1: Floats
    K_2: Floats
    spread: Floats
    G: Floats
    epsilon: Floats
    length: float
    contact_zone: Floats
    reasons: tuple[str, ...]

    @property
    def phase(self) -> Floats:
        """Angle of K_1 + i K_2 `(f,)`, degrees: 0 opens, 90 shears."""
        return np.asarray(np.degrees(np.arctan2(self.K_2, self.K_1)))


@check_arguments()
def interface_intensity(
    solution: SolutionArgument, length: Length, crack: Annotated[int, Whole(least=0)] = 0
) -> InterfaceSIF:
    """K_1, K_2 and G at the tips of a crack that runs along a bonded interface, in 2D.

    Parameters
    ----------
    solution : Solution
    length : float, length
        To which K refers, such as the length of the crack or a size of the part: the ratio of K_1
        to K_2 depends on it, G does not.
    crack : int
        Its number in the problem.

    Returns
    -------
    InterfaceSIF

    Raises
    ------
    ProblemError
        Not a solution in 2D, no such crack, a length that is not above 0, graded materials there.
    GeometryError
        A tip that is not on an interface, or whose crack does not run along it.

    Notes
    -----
    Ahead σ₂₂ + iσ₁₂ = (K₁ + iK₂)(r/length)^{iε}/√(2πr), with the second axis normal to the crack
    (Rice, 1988).
    """
    if solution.space.dim != 2:
        raise ProblemError("interface_intensity: K on interfaces is known in 2D alone.")
    if crack >= len(solution.space.cuts):
        raise ProblemError(
            f"interface_intensity: crack = {crack}: the problem has "
            f"{len(solution.space.cuts)} crack(s), numbered from 0."
        )
    tips = solution.space.tips_of(crack)
    if not tips:
        raise GeometryError(f"crack {crack} has no tip in the body.")
    rows = [_tip(solution, t, length) for t in tips]
    K_1, K_2, spread, G, epsilon, zone = lock(np.array([values for values, _ in rows]).T)
    return InterfaceSIF(
        x=lock(np.array([solution.space.tips[t].x for t in tips])),
        frame=lock(np.array([solution.space.tips[t].frame for t in tips])),
        K_1=K_1,
        K_2=K_2,
        spread=spread,
        G=G,
        epsilon=epsilon,
        length=length,
        contact_zone=zone,
        reasons=tuple(reason for _, reason in rows),
    )


@dataclass(frozen=True, eq=False)
class Bimaterial:
    """Two half-planes bonded ahead of a tip; the first is where the normal points."""

    materials: tuple[Isotropic, Isotropic]

    @property
    def a(self) -> tuple[float, float]:
        """a_1 and a_2, 1 / stress."""
        above_tip, below_tip = self.materials
        return (
            above_tip.kolosov / above_tip.mu + 1 / below_tip.mu,
            below_tip.kolosov / below_tip.mu + 1 / above_tip.mu,
        )

    @property
    def epsilon(self) -> float:
        """Index of the oscillation."""
        return float(np.log(self.a[0] / self.a[1]) / (2 * np.pi))

    @property
    def modulus(self) -> float:
        """E* cosh²(pi epsilon), stress: G is |K|² over it."""
        material_above, material_below = self.materials
        E_mean = 2 / (1 / material_above.E_prime + 1 / material_below.E_prime)
        return float(E_mean * np.cosh(np.pi * self.epsilon) ** 2)

    def unit_fields(
        self, r: Floats, theta: Floats, is_above: Bools, length: float
    ) -> tuple[Floats, Floats]:
        """Gradients of unit K_1 and K_2, and their derivatives ahead `(2, q, 2, 2)` each."""
        a_1, a_2 = self.a
        exponent = -0.5 - 1j * self.epsilon
        log_z = np.log(r) + 1j * theta
        z, z_conjugate = np.exp(log_z), np.exp(np.conj(log_z))
        a, other_a = np.where(is_above, a_1, a_2), np.where(is_above, a_2, a_1)
        kolosov, mu = (
            np.where(is_above, *(getattr(m, name) for m in self.materials))
            for name in ("kolosov", "mu")
        )
        gradients, bends = np.empty((2, len(r), 2, 2)), np.empty((2, len(r), 2, 2))
        for mode, K in enumerate((1.0, 1j)):
            C = np.conj(K * length ** (-1j * self.epsilon)) / np.sqrt(2 * np.pi)
            C *= a_1 * a_2 / (a_1 + a_2)
            F = [C * np.exp(exponent * log_z)]
            F_bar = [C * np.exp(exponent * np.conj(log_z))]
            for k in range(2):
                F.append((exponent - k) * F[k] / z)
                F_bar.append((exponent - k) * F_bar[k] / z_conjugate)
            for n, result in ((0, gradients), (1, bends)):
                Phi, Omega = F[n] / a, F_bar[n] / other_a
                slope_term = (z - z_conjugate) * np.conj(F[n + 1] / a)
                slope_along = (kolosov * Phi - Omega - slope_term) / (2 * mu)
                slope_across = (
                    1j * (kolosov * Phi + Omega - 2 * np.conj(Phi) + slope_term) / (2 * mu)
                )
                result[mode, :, 0, 0], result[mode, :, 1, 0] = slope_along.real, slope_along.imag
                result[mode, :, 0, 1], result[mode, :, 1, 1] = slope_across.real, slope_across.imag
        return gradients, bends


def _tip(solution: Solution, t: int, length: float) -> tuple[tuple[float, ...], str]:
    """K_1, K_2, spread, G, epsilon and contact zone at one tip, and why K is nan."""
    tip = solution.space.tips[t]
    body = _materials_beside(solution, t)
    domain = domain_of(solution, t)
    room = _straight_radius(solution, t, domain.outer_radius)
    if room < domain.size:
        raise GeometryError(
            f"the crack that ends at {at(tip.x)} on an interface does not run along it for a cell: "
            "let it end a cell before or behind, or follow the interface."
        )
    scale = min(1.0, room / domain.outer_radius)
    radii = scale * radii_of(domain)
    K = 0.5 * body.modulus * _integrals(solution, t, body, radii, length)
    zone = _contact_zone(solution, t)
    G = float(K[0] @ K[0]) / body.modulus
    reason = ""
    if zone > _ZONE * radii[0]:
        G = _energy_release(solution, t, radii[:1])
        reason = (
            f"the faces press over {zone:.3g} from the tip, {zone / radii[0]:.2g} of the domain: "
            "its field is not that of K_1 and K_2; G holds"
        )
        K = np.full_like(K, np.nan)
    spread = float(np.linalg.norm(K[0] - K[1]))
    return (float(K[0, 0]), float(K[0, 1]), spread, G, body.epsilon, zone), reason


def _materials_beside(solution: Solution, t: int) -> Bimaterial:
    """The materials on both sides of a tip."""
    mesh, elasticity = solution.space.mesh, solution.problem.elasticity
    tip, cells = solution.space.tips[t], tip_cells(solution, t)
    height = (mesh.points[mesh.cells[cells]].mean(axis=1) - tip.x) @ tip.frame[1]
    groups = [elasticity.groups(cells[side]) for side in (height > 0, height <= 0)]
    if [len(group) for group in groups] != [1, 1] or groups[0][0][0] is groups[1][0][0]:
        raise GeometryError(
            f"the crack that ends at {at(tip.x)} does not run along an interface there: "
            "stress_intensity knows K of a tip in one material."
        )
    materials = [group[0][0] for group in groups]
    if any(material.is_graded for material in materials):
        raise ProblemError(
            f"interface_intensity: the modulus beside the tip at {at(tip.x)} is graded: give the "
            "sets there an Isotropic."
        )
    return Bimaterial((materials[0].at_tip(), materials[1].at_tip()))


def _straight_radius(solution: Solution, t: int, r_outer: float) -> float:
    """Radius within which interface and crack are the straight line through the tip, length."""
    mesh, elasticity = solution.space.mesh, solution.problem.elasticity
    tip = solution.space.tips[t]
    cells = tip_cells(solution, t)
    height = (mesh.points[mesh.cells[cells]].mean(axis=1) - tip.x) @ tip.frame[1]
    number_above = elasticity.number[cells[np.argmax(height)]]
    number_below = elasticity.number[cells[np.argmin(height)]]
    corners = (mesh.points[mesh.cells] - tip.x) @ tip.frame.T
    number = elasticity.number
    is_in_half = (number == number_above) & (corners[..., 1].min(axis=1) >= -_FLAT * r_outer)
    is_in_half |= (number == number_below) & (corners[..., 1].max(axis=1) <= _FLAT * r_outer)
    nearest_corner = np.linalg.norm(corners, axis=2).min(axis=1)
    room = float(nearest_corner[~is_in_half].min(initial=np.inf))
    lips = solution.lips[tip.crack]
    way = lips.way_from(mesh, tip.x) @ tip.frame.T
    is_off_line = np.abs(way[:, 1]) > _FLAT * r_outer
    return min(room, float(np.linalg.norm(way[is_off_line], axis=1).min(initial=np.inf)), r_outer)


@dataclass(frozen=True, eq=False)
class RingPoints:
    """Integration points around a tip, in its frame."""

    points: Points
    x: Floats
    xi: Floats
    r: Floats
    theta: Floats
    gradient: Floats
    stress: Floats
    initial_stress: Floats


def _ring_points(
    solution: Solution, t: int, r_inner: float, r_outer: float
) -> Iterator[RingPoints]:
    space, tip = solution.space, solution.space.tips[t]
    mesh, R = space.mesh, tip.frame
    psi = space.cuts[tip.crack].level_set.psi[tip.number]
    distance = distances_to(space, tip.x)
    turn = mean_rotation(solution, distance, r_outer)
    for cells, n, degree in ring_classes(space, tip.x, r_inner, r_outer):
        for points in class_points(space, cells, n, degree):
            x = position(space, points.cell, points.bary)
            xi = (x - tip.x) @ R.T
            is_behind = psi[mesh.cells[points.cell]].mean(axis=1) < 0
            r, theta = continued_polar(xi, points.side[:, tip.crack], is_behind)
            place = points.cell, points.bary
            columns = solution.coefficients[..., None]
            gradient = gradients_at(space, columns, *place, points.side)[..., 0] - turn
            initial_stress = initial_stress_at(solution, *place, x)
            sigma = solution.problem.elasticity.stress(gradient, *place) + initial_stress
            in_frame = (R @ value @ R.T for value in (gradient, sigma, initial_stress))
            yield RingPoints(points, x, xi, r, theta, *in_frame)


def _integrals(
    solution: Solution, t: int, body: Bimaterial, radii: Floats, length: float
) -> Floats:
    """Interaction integrals with unit K_1 and K_2 `(radii, 2)`."""
    r_inner, r_outer = _INNER * radii, float(radii.max())
    sources = has_effect([solution], "volume", "initial_stress")
    total = np.zeros((len(radii), 2))
    for ring in _ring_points(solution, t, 0.0 if sources else float(r_inner.min()), r_outer):
        q, dq = weight(ring.r, ring.xi, r_inner, radii)
        w = ring.points.weight
        is_above = ring.xi[:, 1] > 0
        fields, bends = body.unit_fields(ring.r, ring.theta, is_above, length)
        force = _force(solution, t, ring)
        for m in range(2):
            g = fields[m]
            aux = np.empty_like(g)
            for side, material in zip((is_above, ~is_above), body.materials, strict=True):
                aux[side] = material.stress(g[side])
            flux = np.einsum("qij,qi->qj", ring.stress, g[:, :, 0])
            flux += np.einsum("qij,qi->qj", aux, ring.gradient[:, :, 0])
            flux[:, 0] -= np.einsum("qij,qij->q", ring.stress - ring.initial_stress, g)
            source = np.einsum("qij,qij->q", ring.initial_stress, bends[m])
            source -= np.einsum("qi,qi->q", force, g[:, :, 0])
            total[:, m] += np.einsum("q,qj,rqj->r", w, flux, dq)
            total[:, m] += np.einsum("q,q,rq->r", w, source, q)
    return total - _lip_integrals(solution, t, body, radii, length)


def _force(solution: Solution, t: int, ring: RingPoints) -> Floats:
    """Body forces in the frame of a tip `(q, 2)`."""
    total = np.zeros((len(ring.x), 2))
    for load, factor in solution.acting:
        if "volume" in load.acts:
            total += factor * load.volume(ring.x)
    return total @ solution.space.tips[t].frame.T


def _lip_integrals(
    solution: Solution, t: int, body: Bimaterial, radii: Floats, length: float
) -> Floats:
    """What pressures on the faces add `(radii, 2)`."""
    space, tip = solution.space, solution.space.tips[t]
    lips, R = solution.lips[tip.crack], tip.frame
    way = lips.way_from(space.mesh, tip.x)
    is_near = np.linalg.norm(way, axis=1) < radii.max()
    total = np.zeros((len(radii), 2))
    pressure, shear = lip_pressure(solution, tip.crack)[is_near], lip_shear(solution, tip.crack)
    if not pressure.any() and shear is None:
        return total
    xi = way[is_near] @ R.T
    xi[:, 1] = 0.0
    normal = lips.normal[is_near] @ R.T
    for side in (-1, 1):
        s = (side + 1) // 2
        sides = lip_side(space, tip.crack, lips.cell[is_near, s], lips.bary[is_near, s], side)
        sign = sides[:, tip.crack]
        r, theta = continued_polar(xi, sign, np.ones(len(xi), dtype=bool))
        theta = np.where(sign * np.sign(theta) < 0, -theta, theta)
        traction = side * pressure[:, None] * normal
        if shear is not None:
            traction = traction + side * (shear[is_near] @ R.T)
        q, _ = weight(r, xi, _INNER * radii, radii)
        fields, _ = body.unit_fields(r, theta, theta > 0, length)
        for m in range(2):
            density = np.einsum("qi,qi->q", traction, fields[m][:, :, 0])
            total[:, m] += q @ (lips.weight[is_near] * density)
    return total


def _energy_release(solution: Solution, t: int, radii: Floats) -> float:
    """J integral: of faces that press without friction, and of initial stress alike along x_1."""
    total = 0.0
    for ring in _ring_points(solution, t, 0.0, float(radii.max())):
        q, dq = weight(ring.r, ring.xi, _INNER * radii, radii)
        g = ring.gradient
        energy = 0.5 * np.einsum("qij,qij->q", ring.stress + ring.initial_stress, g)
        flux = np.einsum("qij,qi->qj", ring.stress, g[:, :, 0])
        flux[:, 0] -= energy
        force = np.einsum("qi,qi->q", _force(solution, t, ring), g[:, :, 0])
        total += float(ring.points.weight @ np.einsum("qj,qj->q", flux, dq[0]))
        total -= float(ring.points.weight @ (force * q[0]))
    return total


def _contact_zone(solution: Solution, t: int) -> float:
    """Length of the zone behind a tip over which the faces press; 0 where none do."""
    tip = solution.space.tips[t]
    contact = solution.contact[tip.crack]
    if contact is None or not contact.closed.any():
        return 0.0
    distance = np.linalg.norm(contact.points - tip.x, axis=1)
    order = np.argsort(distance)
    first_open = np.nonzero(~contact.closed[order])[0]
    if len(first_open) and first_open[0] == 0:
        return 0.0
    last_row = (first_open[0] if len(first_open) else len(order)) - 1
    return float(distance[order[last_row]])


__all__ = ["InterfaceSIF", "interface_intensity"]
