"""One round: solve, K with error bars, and what the cells contribute to them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.scene.problem import Problem
from xcrack.sif.bars import Bars
from xcrack.sif.bars_2d import bars_and_shares
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities


@dataclass(frozen=True, eq=False)
class Measured:
    """A mesh with its solutions and the errors of K.

    Attributes
    ----------
    problem : Problem
    solutions : tuple of Solution
        Without their factor.
    sifs : tuple of tuple of SIF
        Of each state and crack.
    best, bar : (k, 2 or 3) arrays, stress · √length
        Of all tips, or places along fronts away from surfaces, of all cracks in all states but
        those at rest.
    shares : (2 k, cells) array, stress · √length
        Absolute contributions of the cells to K_I and K_II of each.
    """

    problem: Problem
    solutions: tuple[Solution, ...]
    sifs: tuple[tuple[SIF, ...], ...]
    best: Floats
    bar: Floats
    shares: Floats

    @property
    def error(self) -> float:
        """Largest half-width over the largest best K; nan where one of them is missing."""
        scale = np.abs(self.best).max(initial=0.0)
        return float(self.bar.max(initial=0.0) / scale) if scale > 0 else float("nan")

    @property
    def pressed(self) -> tuple[int, ...]:
        """Cracks whose faces press on each other in some state."""
        contacts = [[s.contact[c] for s in self.solutions] for c in range(len(self.sifs[0]))]
        return tuple(
            c
            for c, states in enumerate(contacts)
            if any(contact is not None and contact.closed.any() for contact in states)
        )

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why tips have no bar, each once."""
        every = [
            reason
            for state in self.sifs
            for sif in state
            for reason, at_surface in zip(sif.reasons, sif.at_surface, strict=True)
            if reason and not at_surface
        ]
        return tuple(dict.fromkeys(every))


def measured(problem: Problem, states: Sequence[Any]) -> Measured:
    """Solutions of a scene at order 2, K and its errors; of fronts no shares."""
    flat = problem.mesh.dim < 3
    solutions = solve_states(problem, states, error=flat)
    if any(each is not None and each.shear is not None for each in solutions[0].contact):
        raise ProblemError(
            "adapt: crack faces press and rub, and K with friction has no error bars: adapt the "
            "mesh with friction=0, and compare two meshes with friction."
        )
    live = [k for k, s in enumerate(solutions) if not s.at_rest]
    by_crack: list[list[SIF]] = []
    shares = [np.zeros((0, len(problem.mesh.cells)))]
    for c in range(len(problem.cracks)):
        sifs = stress_intensities(solutions, c, error=not flat)
        zero = np.zeros_like(sifs[0].K)
        rows = [replace(sif, errors=Bars(zero, zero, ("",) * len(zero))) for sif in sifs]
        if live and not flat:
            rows = sifs
        if live and flat:
            bars, own = bars_and_shares([solutions[k] for k in live], [sifs[k] for k in live], c)
            for k, errors in zip(live, bars, strict=True):
                rows[k] = replace(sifs[k], errors=errors)
            shares.append(own.reshape(-1, own.shape[-1]))
        by_crack.append(rows)
    ends = [sif for rows in by_crack for sif in (rows[k] for k in live)]
    inside = [~sif.at_surface for sif in ends]
    empty = np.zeros((0, problem.mesh.dim))
    return Measured(
        problem,
        tuple(replace(s, factored=None) for s in solutions),
        tuple(tuple(rows[k] for rows in by_crack) for k in range(len(solutions))),
        np.concatenate([empty, *(s.best[i] for s, i in zip(ends, inside))]),
        np.concatenate([empty, *(s.bar[i] for s, i in zip(ends, inside))]),
        np.concatenate(shares),
    )


def live_states(given: Measured) -> list[int]:
    """Numbers of the states that are not at rest."""
    return [k for k, s in enumerate(given.solutions) if not s.at_rest]


__all__ = ["Measured", "live_states", "measured"]
