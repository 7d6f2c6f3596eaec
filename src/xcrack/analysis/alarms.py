"""Magnitudes of a solution that no part of a machine has: slips of units, or loads left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, coordinates
from xcrack.model.material import von_mises
from xcrack.model.problem import Problem

# Limits beyond which a number is more likely a slip than a state of a part.
_MOVED = 0.02  # displacement over the size of the body
_STRAINED = 0.01  # stress over Young's modulus
_SHARE = 0.95  # of the volume: beside corners and point forces stress has no limit
_UNIT = 10.0  # Young's moduli up to here are those of scenes without units
_MPA, _PA = (1e3, 1e6), (1e9, 1e12)  # between which Young's modulus of a solid lies


@dataclass(frozen=True)
class Alarm:
    """A number beyond its limit.

    Attributes
    ----------
    quantity : str
        What the number is.
    value, limit : float
    place : str
        Where it is; empty where that is the whole scene.
    remedy : str
    """

    quantity: str
    value: float
    limit: float
    place: str
    remedy: str

    def __str__(self) -> str:
        side = (
            "below"
            if self.value < self.limit
            else "above"
            if self.value > self.limit
            else "not above"
        )
        place = f" {self.place}" if self.place else ""
        number = f"{self.value:.4g}, {side} {self.limit:.4g}"
        return f"{self.quantity} is {number}{place}: {self.remedy}"


def has_units(problem: Problem) -> bool:
    """Whether numbers of the scene have units: a yield stress is given, or a modulus of a solid."""
    material = problem.material
    return material.yield_stress is not None or material.largest_modulus > _UNIT


def millimetre(problem: Problem) -> float | None:
    """Length of a millimetre where Young's modulus is in MPa or Pa; None where it is in neither."""
    E = problem.material.largest_modulus
    return 1.0 if _MPA[0] < E < _MPA[1] else 1e-3 if _PA[0] < E < _PA[1] else None


def alarms_of_solutions(solutions: Sequence[Solution], *, stresses: bool = True) -> list[Alarm]:
    """What is beyond its limit in the load states of a problem.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one problem, at least one.
    stresses : bool
        Judge stresses too, which takes as long as a picture of them.
    """
    problem = solutions[0].problem
    if not any(solution.u.any() for solution in solutions):
        words = "give loads=[...], or a displacement that is not zero: K is zero everywhere."
        return [Alarm("the largest displacement", 0.0, 0.0, "in all load states", words)]
    # What is imposed has no unit of a modulus.
    forces = any("support" not in load.acts for each in solutions for load in each.loads)
    if not has_units(problem) or not forces:
        return []
    alarms = [_displacement(solution) for solution in solutions]
    if stresses:
        alarms += [_stress(solution) for solution in solutions]
    worst: dict[str, Alarm] = {}
    for alarm in alarms:
        before = worst.get(alarm.quantity)
        if alarm.value > alarm.limit and (before is None or alarm.value > before.value):
            worst[alarm.quantity] = alarm
    return list(worst.values())


def _displacement(solution: Solution) -> Alarm:
    """Largest displacement over the size of the body, of nodes without other functions."""
    space = solution.space
    n = space.mesh.n_points
    plain = np.ones(n, dtype=bool)
    plain[np.unique(space.mesh.cells[space.signature != 0])] = False
    u = np.linalg.norm(solution.coefficients[:n], axis=1) * (plain if plain.any() else 1)
    node = int(np.argmax(u))
    E = solution.problem.material.largest_modulus
    remedy = f"is Young's modulus, {E:.4g}, in the unit of the loads, and are these as meant?"
    if E < _MPA[0]:
        remedy += " A modulus in GPa is a thousand times as large in MPa."
    return Alarm(
        "the largest displacement over the size of the body",
        float(u[node] / np.ptp(space.mesh.points, axis=0).max()),
        _MOVED,
        f"at {coordinates(space.mesh.points[node])}",
        remedy,
    )


def _stress(solution: Solution) -> Alarm:
    """Stress that a twentieth of the body exceeds, away from cracks."""
    space, material = solution.space, solution.problem.material
    cells = np.nonzero(space.signature == 0)[0]
    cells = cells if len(cells) else np.arange(len(space.mesh.cells))
    d = space.dim
    bary = np.full((len(cells), d + 1), 1 / (d + 1))
    sides = np.ones((len(cells), len(space.cuts)), dtype=np.int64)
    equivalent = von_mises(_in_space(solution, solution.stress_at(cells, bary, sides)))
    order = np.argsort(equivalent)
    volume = np.cumsum(space.mesh.volume[cells][order])
    k = int(order[np.searchsorted(volume, _SHARE * volume[-1])])
    place = f"at {coordinates(space.mesh.points[space.mesh.cells[cells[k]]].mean(axis=0))}"
    if material.yield_stress is not None:
        return Alarm(
            "the stress (von Mises) that 5 % of the body exceeds",
            float(equivalent[k]),
            material.yield_stress,
            place,
            "the body yields away from cracks too, so that linear elasticity does not hold: is the "
            "yield stress in the unit of the loads, and are these as meant?",
        )
    return Alarm(
        "the strain (von Mises stress over Young's modulus) that 5 % of the body exceeds",
        float(equivalent[k] / material.largest_modulus),
        _STRAINED,
        place,
        "is Young's modulus in the unit of the loads, and are these as meant?",
    )


def _in_space(solution: Solution, sigma: Floats) -> Floats:
    """Stress in space `(q, 3, 3)` of that in a body `(q, d, d)`."""
    if sigma.shape[-1] == 3:
        return sigma
    full = np.zeros((len(sigma), 3, 3))
    full[:, :2, :2] = sigma
    full[:, 2, 2] = solution.problem.material.stress_across(sigma)
    return full


__all__ = ["Alarm", "alarms_of_solutions", "has_units", "millimetre"]
