"""One round: solve, K with error bars, and what the cells contribute to them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.adaptivity.start_2d import kinks
from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.arrays import Floats
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
    best, bar : (k, 2) arrays, stress · √length
        Of all tips of all cracks in all states but those at rest.
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
    def bent(self) -> tuple[int, ...]:
        """Those that have kinks, of whose pressures the estimates see a part only."""
        return tuple(c for c in self.pressed if len(kinks(self.problem.placed[c].points)))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why tips have no bar, each once."""
        every = [r for state in self.sifs for sif in state for r in sif.reasons if r]
        return tuple(dict.fromkeys(every))


def measured(problem: Problem, states: Sequence[Any]) -> Measured:
    """Solutions of a scene in 2D at order 2, K and its errors."""
    solutions = solve_states(problem, states, error=True)
    live = [k for k, s in enumerate(solutions) if not s.at_rest]
    by_crack: list[list[SIF]] = []
    shares = [np.zeros((0, len(problem.mesh.cells)))]
    for c in range(len(problem.cracks)):
        sifs = stress_intensities(solutions, c, error=False)
        zero = np.zeros_like(sifs[0].K)
        rows = [replace(sif, errors=Bars(zero, zero, ("",) * len(zero))) for sif in sifs]
        if live:
            bars, own = bars_and_shares([solutions[k] for k in live], [sifs[k] for k in live], c)
            for k, errors in zip(live, bars, strict=True):
                rows[k] = replace(sifs[k], errors=errors)
            shares.append(own.reshape(-1, own.shape[-1]))
        by_crack.append(rows)
    ends = [sif for rows in by_crack for sif in (rows[k] for k in live)]
    empty = np.zeros((0, problem.mesh.dim))
    return Measured(
        problem,
        tuple(replace(s, factored=None) for s in solutions),
        tuple(tuple(rows[k] for rows in by_crack) for k in range(len(solutions))),
        np.concatenate([empty, *(sif.best for sif in ends)]),
        np.concatenate([empty, *(sif.bar for sif in ends)]),
        np.concatenate(shares),
    )


def trusted(new: Measured, old: Measured | None) -> Measured:
    """Bars that also cover what the last refinement has changed.

    Two best values may differ by both bars. Where they differ by more, the estimates have missed
    something, and the bar grows by as much. Where faces press on each other at a kink it is at
    least the change itself.
    """
    if old is None:
        return new
    change = np.abs(new.best - old.best)
    bent = np.repeat(np.isin(_cracks(new), new.bent), _ends(new))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = change / np.where(bent, new.bar, new.bar + old.bar)
    growth = np.where(growth > 1, growth, 1.0)
    if (growth == 1).all():
        return new
    rows = iter(np.split(growth, np.cumsum(_ends(new))[:-1]))
    by_crack = [{k: next(rows) for k in _live(new)} for _ in range(len(new.problem.cracks))]
    sifs = tuple(
        tuple(
            replace(sif, errors=Bars(sif.eta, sif.bar * by_crack[c].get(k, 1.0), sif.reasons))
            for c, sif in enumerate(state)
        )
        for k, state in enumerate(new.sifs)
    )
    return replace(new, sifs=sifs, bar=new.bar * growth)


def _live(given: Measured) -> list[int]:
    return [k for k, s in enumerate(given.solutions) if not s.at_rest]


def _cracks(given: Measured) -> list[int]:
    """Crack of each of these."""
    return [c for c in range(len(given.problem.cracks)) for _ in _live(given)]


def _ends(given: Measured) -> list[int]:
    """Number of tips of each crack and state, in the order of `best`."""
    return [len(given.sifs[k][c].K) for c in range(len(given.problem.cracks)) for k in _live(given)]


__all__ = ["Measured", "measured", "trusted"]
