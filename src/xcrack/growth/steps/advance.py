"""How far each tip of all cracks goes in one step."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats

LEAST = 0.1  # of a cell: a shorter new face turns the tip's frame, but not the crack the mesh sees

PerCrack = tuple[Floats, ...]  # one array (f,) a crack


@dataclass(frozen=True, eq=False)
class Advance:
    """What one step is to do.

    Attributes
    ----------
    da : tuple of (f,) arrays, length
        Advance of each tip, one array a crack.
    pending : tuple of (f,) arrays, length
        Growth that is too short to be modelled yet and waits for the next steps.
    largest : float, length
        Advance asked for at the fastest tip; 0 where nothing grows, or a rate is infinite.
    size : float, length
        Cell size at that tip.
    tip : (int, int)
        That tip: crack and number.
    falls_to_zero : bool
        Whether all growth is seen to stop within a tenth of that cell.
    cycles : float
        That it is seen to take; 0 where the integrator cannot tell.
    """

    da: PerCrack
    pending: PerCrack
    largest: float
    size: float
    tip: tuple[int, int]
    falls_to_zero: bool = False
    cycles: float = 0.0


def plan_advance(
    rate: PerCrack,
    dK_eq: PerCrack,
    pending: PerCrack,
    size: PerCrack,
    *,
    da: float | None,
    cycles: float | None,
    scaling: str,
    least: float = LEAST,
) -> Advance:
    """Share one step out over the tips.

    Parameters
    ----------
    rate, dK_eq, pending, size : tuple of (f,) arrays
        Growth a cycle, equivalent range, growth left over from earlier steps, cell size.
    da : float, length, or None
        Largest advance of any tip.
    cycles : float or None
        Cycles of the step; with `da` too, the smaller advance holds.
    scaling : {"law", "linear"}
        Advance of the other tips in proportion to the rate, or to dK_eq as in the source paper
        (which contradicts its own law, and does not converge to the right path).
    least : float
        Share of a cell below which an advance waits.

    Returns
    -------
    Advance
    """
    every_rate = np.concatenate(rate)
    fastest = float(every_rate.max(initial=0.0))
    if fastest == 0 or np.isinf(fastest):
        still = tuple(np.zeros_like(r) for r in rate)
        return Advance(still, pending, 0.0, np.inf, (0, 0))
    score = (
        rate if scaling == "law" else tuple(np.where(r > 0, k, 0.0) for r, k in zip(rate, dK_eq))
    )
    best = max(float(s.max(initial=0.0)) for s in score)
    crack = next(c for c, s in enumerate(score) if s.max(initial=0.0) == best)
    number = int(np.argmax(score[crack]))
    by_cycles = np.inf if cycles is None else cycles * fastest
    largest = float(min(np.inf if da is None else da, by_cycles))
    wanted = [p + largest * (s / best) for p, s in zip(pending, score)]
    go = [w >= least * h for w, h in zip(wanted, size)]
    return Advance(
        da=tuple(np.where(g, w, 0.0) for g, w in zip(go, wanted)),
        pending=tuple(np.where(g, 0.0, w) for g, w in zip(go, wanted)),
        largest=largest,
        size=float(size[crack][number]),
        tip=(crack, number),
    )


__all__ = ["LEAST", "Advance", "PerCrack", "plan_advance"]
