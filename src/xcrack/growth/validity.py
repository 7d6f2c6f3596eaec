"""Where linear elastic fracture mechanics holds: plastic zones, toughness, the net section."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.analysis.report import Alarm
from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, coordinates
from xcrack.crack.crack import Crack
from xcrack.crack.lines import crossing_points
from xcrack.crack.measures import exit_ahead, length_inside
from xcrack.fatigue.criteria import clipped_K, equivalent_K, kink_angle
from xcrack.mesh.mesh import Mesh
from xcrack.model.elasticity import elasticity
from xcrack.model.material import Material
from xcrack.sif.sif import SIF

ZONE = 0.15  # share of crack or ligament up to which a plastic zone counts as small
_RADIUS = {"stress": 1 / (2 * np.pi), "strain": 1 / (6 * np.pi)}  # Irwin's, of (K / yield)²

# What lies ahead of tips.


@dataclass(frozen=True)
class Ahead:
    """What a tip heads for.

    Attributes
    ----------
    length : float
        Of the ligament up to there.
    label : str
        Facet set or crack.
    """

    length: float
    label: str


def ahead_of(
    x: Floats, direction: Floats, c: int, cracks: Sequence[Crack], mesh: Mesh
) -> Ahead | None:
    """Boundary or crack straight ahead of a tip of crack c in 2D; None where nothing is."""
    hit = exit_ahead(x, direction, mesh)
    if hit is None:
        return None
    way = np.stack([x, hit[0]])
    obstacles = [(float(np.linalg.norm(hit[0] - x)), repr(hit[1]))]
    for k, crack in enumerate(cracks):
        crossings = crossing_points(way, crack.points) if k != c else way[:0]
        obstacles += [(float(np.linalg.norm(y - x)), f"crack {k}") for y in crossings]
    return Ahead(*min(obstacles))


def _depth_ahead(x: Floats, direction: Floats, mesh: Mesh) -> float:
    """Way from a place of a front straight ahead to the boundary in 3D; inf where none is met.

    Möller and Trumbore's intersection of a ray with triangles (1997, J. Graphics Tools 2, 21).
    """
    corner = mesh.points[mesh.facets[mesh.facet_to_cell[:, 1] < 0]]
    first_side, second_side = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    edge_normal = np.cross(direction, second_side)
    volume = (first_side * edge_normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        gap = x - corner[:, 0]
        u = (gap * edge_normal).sum(axis=1) / volume
        gap_normal = np.cross(gap, first_side)
        v = gap_normal @ direction / volume
        t = (gap_normal * second_side).sum(axis=1) / volume
        hit = (volume != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return float(t[hit].min(initial=np.inf))


# Plastic zones against lengths.


@dataclass(frozen=True)
class Validity:
    """How far linear elastic fracture mechanics holds, each at its worst place.

    nan where a number is not known: without yield stress, without toughness, without solutions.

    Attributes
    ----------
    K : float, stress √length
        Largest equivalent factor.
    zone : float, length
        Radius of Irwin's plastic zone with it.
    state : {"strain", "stress"}
        For which the zone is.
    of_crack, of_ligament : float
        Zone over the length of its crack, and over the ligament ahead of it.
    of_toughness : float
        K over the toughness.
    of_section : float
        Force and moment on the ligament over those at which it yields (2D).
    places : mapping of str to str
        Where each of these numbers is largest.
    """

    K: float
    zone: float
    state: str
    of_crack: float
    of_ligament: float
    of_toughness: float
    of_section: float
    places: dict[str, str]

    def alarms(self) -> list[Alarm]:
        """What is beyond its limit."""
        remedy = (
            "K of linear elasticity does not hold there. Stop the run before, or judge it by "
            "elastic-plastic means."
        )
        plane = f"the plastic zone (Irwin, plane {self.state}) over the "
        rows = [
            ("of_crack", plane + "length of its crack", ZONE, remedy),
            ("of_ligament", plane + "ligament ahead", ZONE, remedy),
            ("of_toughness", "K over the toughness K_c", 1.0,
             "the crack is unstable under this load. Is K_c in the unit of the model? One in MPa√m "
             "is 31.6 times as large in MPa√mm."),
            ("of_section", "the load on the ligament over that at which it yields", 1.0, remedy),
        ]  # fmt: skip
        return [
            Alarm(quantity, getattr(self, key), limit, f"at {self.places[key]}", words)
            for key, quantity, limit, words in rows
            if getattr(self, key) > limit
        ]


def validity(
    material: Material,
    mesh: Mesh,
    cracks: Sequence[Crack],
    sif: Sequence[Sequence[SIF]],
    solutions: Sequence[Solution] = (),
    K_c: float | None = None,
) -> Validity | None:
    """Plastic zones, toughness and net sections of cracks in the most severe load state.

    Parameters
    ----------
    material : Material
        With a yield stress, where zones and sections are to be judged.
    mesh : Mesh
    cracks : sequence of Crack
        As they lie in the mesh.
    sif : sequence of sequence of SIF
        ``sif[state][crack]``.
    solutions : sequence of Solution
        Of the states, for the net section in 2D.
    K_c : float, stress √length, optional
        Toughness.

    Returns
    -------
    Validity, or None where no crack has a tip

    Notes
    -----
    Zones: (K / yield)² / 2π in plane stress, a third of it in plane strain; a body in space counts
    as plane strain where its smallest extent is at least 2.5 (K / yield)².
    """
    largest_share: dict[str, float] = {}
    places: dict[str, str] = {}

    def judge(key: str, value: float, place: str) -> None:
        if value > largest_share.get(key, -np.inf):
            largest_share[key], places[key] = value, place

    yield_stress, state = material.yield_stress, "stress"
    nu = elasticity(mesh, material).poisson
    thickness = float(np.ptp(mesh.points, axis=0).min())  # of a body in space, at least
    for c, crack in enumerate(cracks):
        K = clipped_K(np.stack([row[c].K for row in sif])) if sif else np.zeros((0, 0, 2))
        if not K.size:
            continue
        largest_K, angle = _largest_K_eq(K, nu)
        places_of_crack = sif[0][c]
        directions = _directions(places_of_crack, angle)
        size = _size(crack, mesh)
        is_inside = ~places_of_crack.at_surface
        is_inside = is_inside if is_inside.any() else np.ones(len(is_inside), dtype=bool)
        for j in np.nonzero(is_inside)[0].tolist():
            place = f"crack {c}, {coordinates(places_of_crack.x[j])}"
            judge("K", float(largest_K[j]), place)
            if K_c is not None:
                judge("of_toughness", float(largest_K[j]) / K_c, place)
            if yield_stress is None:
                continue
            square = (float(largest_K[j]) / yield_stress) ** 2
            state = material.constraint(thickness, square)
            zone = _RADIUS[state] * square
            judge("zone", zone, place)
            judge("of_crack", zone / size, place)
            if mesh.dim == 3:
                way = _depth_ahead(places_of_crack.x[j], directions[j], mesh)
                judge("of_ligament", zone / way, place)
                continue
            obstacle = ahead_of(places_of_crack.x[j], directions[j], c, cracks, mesh)
            if obstacle is not None:
                judge("of_ligament", zone / obstacle.length, f"{place}, towards {obstacle.label}")
                for solution in solutions:
                    load = _section(solution, places_of_crack.x[j], directions[j], obstacle.length)
                    judge("of_section", load / yield_stress, f"{place}, towards {obstacle.label}")
    if "K" not in largest_share:
        return None
    if yield_stress is not None:
        state = material.constraint(thickness, (largest_share["K"] / yield_stress) ** 2)
    keys = ("K", "zone", "of_crack", "of_ligament", "of_toughness", "of_section")
    numbers: dict[str, Any] = {key: largest_share.get(key, np.nan) for key in keys}
    return Validity(**numbers, state=state, places=places)


def _largest_K_eq(K: Floats, nu: float) -> tuple[Floats, Floats]:
    """Largest equivalent factor of the states `(f,)`, and the direction in that state."""
    angle = kink_angle(K)
    K_eq = equivalent_K(K, angle, nu)
    row = K_eq.argmax(axis=0)
    column = np.arange(K.shape[1])
    return K_eq[row, column], angle[row, column]


def _directions(places: SIF, angle: Floats) -> Floats:
    frame, beta = places.frame, angle[:, None]
    return np.asarray(np.cos(beta) * frame[:, 0] + np.sin(beta) * frame[:, 1])


def _size(crack: Crack, mesh: Mesh) -> float:
    """Length of a crack in the body in 2D, its extent in 3D."""
    if mesh.dim == 2:
        return length_inside(crack, mesh)
    return float(np.ptp(crack.points, axis=0).max())


_X, _W = np.polynomial.legendre.leggauss(40)
_INSIDE = 1e-6  # share of a ligament at its ends: points lie in the body


def _section(solution: Solution, x: Floats, direction: Floats, length: float) -> float:
    """Yield stress at which force and moment on a ligament of a plane body make it yield.

    A strip of width b yields under N and M where (N / b s)² + |4 M / b² s| = 1: the stress s is the
    larger root. Points crowd towards both ends, where stress may be singular.
    """
    turn = 0.25 * np.pi * (_X + 1)
    share = _INSIDE + (1 - 2 * _INSIDE) * np.sin(turn) ** 2
    weight = 0.25 * np.pi * _W * np.sin(2 * turn)
    points = x + length * share[:, None] * direction
    weight = weight * solution.inside(points)
    points = points[weight > 0]
    weight, share = weight[weight > 0], share[weight > 0]
    if not len(points):
        return 0.0
    normal = np.array([-direction[1], direction[0]])
    stress = np.einsum("qij,i,j->q", solution.stress(points), normal, normal)
    force = abs(float(weight @ stress))  # over b
    moment = abs(4 * float(weight @ (stress * (share - 0.5))))  # 4 M / b²
    return 0.5 * (moment + float(np.sqrt(moment**2 + 4 * force**2)))


__all__ = ["ZONE", "Ahead", "Validity", "ahead_of", "validity"]
