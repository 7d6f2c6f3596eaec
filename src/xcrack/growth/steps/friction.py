"""Growth of cracks whose faces rub: ends that friction locks, and histories that it refuses."""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Bools
from xcrack.errors import ProblemError
from xcrack.growth.directions.criteria import clipped, equivalent_K, kink_angle
from xcrack.growth.steps.advance import PerCrack
from xcrack.scene.problem import Problem
from xcrack.sif.sif import SIF

_ROUND_OFF = 1e-5  # range over the largest K_eq below which it is the error of a stuck crack


def without_locked(
    problem: Problem,
    solutions: Sequence[Solution],
    sif: Sequence[Sequence[SIF]],
    dK_eq: PerCrack,
    rate: PerCrack,
) -> tuple[PerCrack, PerCrack]:
    """Ranges and rates, zero where the faces beside a tip stick in every state.

    K does not change there: what is left of its range is the error of quadrature, which a crack
    must not grow on. Without friction they stay as they are.

    Parameters
    ----------
    problem : Problem
    solutions : sequence of Solution
        One a state.
    sif : sequence of sequence of SIF
        ``sif[state][crack]``.
    dK_eq, rate : tuple of (f,) arrays
    """
    if not any(problem.frictions):
        return dK_eq, rate
    rubs = [c for c in range(len(dK_eq)) if _rubs(solutions[0], c)]
    if not rubs:
        return dK_eq, rate
    nu, largest = problem.material.nu, 0.0
    for c in range(len(dK_eq)):
        K = clipped(np.stack([state[c].K for state in sif]))
        largest = max(largest, float(equivalent_K(K, kink_angle(K), nu).max(initial=0.0)))
    ranges, rates = list(dK_eq), list(rate)
    for c in rubs:
        still = locked(solutions, c, sif[0][c]) | (dK_eq[c] <= _ROUND_OFF * largest)
        ranges[c] = np.where(still, 0.0, dK_eq[c])
        rates[c] = np.where(still, 0.0, rate[c])
    return tuple(ranges), tuple(rates)


def locked(solutions: Sequence[Solution], c: int, sif: SIF) -> Bools:
    """Ends of crack c beside which the faces stick in every state `(f,)`."""
    lips = solutions[0].lips[c]
    nearest = [int(np.argmin(np.linalg.norm(lips.x - x, axis=1))) for x in sif.x]
    stuck = [s.contact[c].stuck[nearest] for s in solutions]  # type: ignore[union-attr,index]
    return np.asarray(np.all(stuck, axis=0))


def refuse_friction(problem: Problem, solutions: Sequence[Solution]) -> None:
    """Raise where faces rub under a spectrum: K depends on the path, not on the factor alone."""
    for c, mu in enumerate(problem.frictions):
        if mu and _rubs(solutions[0], c):
            raise ProblemError(
                f"grow: a Spectrum with friction on crack {c}, whose faces press: K then depends "
                "on the loads before, and a spectrum takes its cycles one by one. Give "
                "Cycle(states=[...]), or friction=0."
            )


def _rubs(solution: Solution, c: int) -> bool:
    contact = solution.contact[c]
    return contact is not None and contact.shear is not None


__all__ = ["locked", "refuse_friction", "without_locked"]
