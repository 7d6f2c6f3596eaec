"""One round: solve, K with error bars, and what the cells contribute to them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution, mean_stress
from xcrack.analysis.solve import solve_states
from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.errors import ProblemError
from xcrack.crack.measures import surface_size
from xcrack.model.problem import Problem
from xcrack.sif.error import bars_and_shares
from xcrack.sif.sif import SIF, KErrors
from xcrack.sif.stress_intensity import stress_intensities


@dataclass(frozen=True, eq=False)
class Indicators:
    """A mesh with its solutions and the errors of K.

    Attributes
    ----------
    problem : Problem
    solutions : tuple of Solution
        Without their factor.
    sifs : tuple of tuple of SIF
        Of each state and crack.
    K, bar : (k, 2 or 3) arrays, stress · √length
        Of all tips, or places along fronts away from surfaces, of all cracks in all states but
        those at rest.
    shares : (2 k, cells) array, stress · √length
        Absolute contributions of the cells to K_I and K_II of each.
    surface_depths : tuple of float, length
        Of each crack: places of its fronts closer than this to a free surface do not count.
    """

    problem: Problem
    solutions: tuple[Solution, ...]
    sifs: tuple[tuple[SIF, ...], ...]
    K: Floats
    bar: Floats
    shares: Floats
    surface_depths: tuple[float, ...]

    @property
    def error(self) -> float:
        """Largest half-width over `scale`; nan where one of them is missing."""
        scale = self.scale
        return float(self.bar.max(initial=0.0) / scale) if scale > 0 else float("nan")

    @property
    def scale(self) -> float:
        """What errors of all K are compared with, stress · √length."""
        return self.scale_of(self.K)

    def scale_of(self, best_K: Floats) -> float:
        """The largest of some best K, or where that is next to nothing a share of K by the energy.

        A crack that is closed by symmetry has K = 0: what a mesh gives is its error, and no cell
        is small enough for a share of that.
        """
        largest_K = float(np.abs(best_K).max(initial=0.0))
        if not largest_K > 0:
            return largest_K
        size = max(self.problem.sizes, default=0.0)
        K_of_energy = mean_stress(self.solutions) * np.sqrt(np.pi * size)
        return max(largest_K, float(_FAINT * K_of_energy))

    @property
    def worst_place(self) -> str:
        """Where bars are longest, in words; empty where there is no bar."""
        for k in live_states(self):
            for c, sif in enumerate(self.sifs[k]):
                if len(sif.K) and not counted_places(sif, self.surface_depths[c]).any():
                    return f"no place of crack {c} is away from free surfaces: its fronts are short"
        ends = [
            (
                float(sif.bar[is_counted].max()),
                c,
                sif.x[is_counted][int(sif.bar[is_counted].max(axis=1).argmax())],
            )
            for k in live_states(self)
            for c, sif in enumerate(self.sifs[k])
            for is_counted in [counted_places(sif, self.surface_depths[c])]
            if np.isfinite(sif.bar[is_counted]).all() and is_counted.any()
        ]
        if not ends:
            return ""
        _, c, x = max(ends, key=lambda end: end[0])
        return f"bars are longest at {at(x)} of crack {c}"

    @property
    def pressed_cracks(self) -> tuple[int, ...]:
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
        reasons_of_tips = [
            reason
            for state in self.sifs
            for sif in state
            for reason, at_surface in zip(sif.reasons, sif.at_surface, strict=True)
            if reason and not at_surface
        ]
        return tuple(dict.fromkeys(reasons_of_tips))


def indicators_of(problem: Problem, states: Sequence[Any]) -> Indicators:
    """Solutions of a scene at order 2, K and its errors; of fronts no shares."""
    is_plane = problem.mesh.dim < 3
    solutions = solve_states(problem, states, error=is_plane)
    if solutions[0].has_friction:
        raise ProblemError(
            "adapt: crack faces press and rub, and K with friction has no error bars: adapt the "
            "mesh with friction=0, and compare two meshes with friction."
        )
    numbers_under_load = [k for k, s in enumerate(solutions) if not s.at_rest]
    by_crack: list[list[SIF]] = []
    shares = [np.zeros((0, len(problem.mesh.cells)))]
    for c in range(len(problem.cracks)):
        sifs = stress_intensities(solutions, c, error=not is_plane)
        zero = np.zeros_like(sifs[0].K)
        rows = [replace(sif, errors=KErrors(zero, zero, ("",) * len(zero))) for sif in sifs]
        if numbers_under_load and not is_plane:
            rows = sifs
        if numbers_under_load and is_plane:
            bars, shares_of_crack = bars_and_shares(
                [solutions[k] for k in numbers_under_load], [sifs[k] for k in numbers_under_load], c
            )
            for k, errors in zip(numbers_under_load, bars, strict=True):
                rows[k] = replace(sifs[k], errors=errors)
            shares.append(shares_of_crack.reshape(-1, shares_of_crack.shape[-1]))
        by_crack.append(rows)
    # Fronts that end at no side have no places beside one.
    surface_reach = tuple(
        _SHARE * surface_size(crack, problem.mesh)
        if any(len(ending_fronts(row)) for row in rows)
        else 0.0
        for crack, rows in zip(problem.placed, by_crack, strict=True)
    )
    sifs_of = tuple(tuple(rows[k] for rows in by_crack) for k in range(len(solutions)))
    best_K, bar = values(sifs_of, numbers_under_load, surface_reach)
    return Indicators(
        problem,
        tuple(replace(s, factored=None) for s in solutions),
        sifs_of,
        best_K,
        bar,
        np.concatenate(shares),
        surface_reach,
    )


def values(
    sifs: Sequence[Sequence[SIF]], numbers_under_load: Sequence[int], surface_reach: Sequence[float]
) -> tuple[Floats, Floats]:
    """Best K and its half-widths at all places that count, crack by crack in all live states.

    Of a crack none of whose places count, K is one zero and its half-width nan.
    """
    best_K, bar = [], []
    for c in range(len(surface_reach)):
        for sif in (sifs[k][c] for k in numbers_under_load):
            is_counted = counted_places(sif, surface_reach[c])
            nothing = np.zeros((int(len(sif.K) > 0 and not is_counted.any()), sif.K.shape[1]))
            best_K += [sif.best[is_counted], nothing]
            bar += [sif.bar[is_counted], nothing + np.nan]
    if not best_K:
        return np.zeros((0, 2)), np.zeros((0, 2))
    return np.concatenate(best_K), np.concatenate(bar)


def counted_places(sif: SIF, surface_reach: float) -> Bools:
    """Places of a crack whose K the tolerance is asked of: those away from free surfaces."""
    result = ~sif.at_surface
    for front in ending_fronts(sif):
        is_on_front = sif.front == front
        s = sif.s[is_on_front]
        result[is_on_front] &= np.minimum(s - s.min(), s.max() - s) >= surface_reach
    return np.asarray(result)


def ending_fronts(sif: SIF) -> Ints:
    """Numbers of the fronts of a crack that end at a side of the body."""
    return np.union1d(sif.front[sif.at_surface], [end.front for end in sif.ends]).astype(np.int64)


_FAINT = 1e-4  # of K by the mean energy of the body: a smaller one counts as this
_SHARE = 0.5  # of a crack's size, half the radius of a penny


def live_states(indicators: Indicators) -> list[int]:
    """Numbers of the states that are not at rest."""
    return [k for k, s in enumerate(indicators.solutions) if not s.at_rest]


__all__ = [
    "Indicators",
    "counted_places",
    "ending_fronts",
    "indicators_of",
    "live_states",
    "values",
]
