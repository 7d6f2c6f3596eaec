"""How far each tip of all cracks goes in one step, and how many cycles that takes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.growth.cycles import cycles_between
from xcrack.mesh.locate import contains, locate
from xcrack.mesh.mesh import Mesh

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
        Advance asked for at the fastest tip; 0 where nothing grows.
    size : float, length
        Cell size at that tip.
    tip : (int, int)
        That tip: crack and number.
    """

    da: PerCrack
    pending: PerCrack
    largest: float
    size: float
    tip: tuple[int, int]


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
    if fastest == 0:
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


def elapsed(
    length: Sequence[float],
    da: PerCrack,
    rate0: PerCrack,
    rate1: Sequence[Sequence[float | None]],
) -> float:
    """Cycles of one step, by the local power law of the tip that drives it.

    The driving tip is the one with the largest rate of those that moved, and that are still
    there: a tip that has left the body has no rate after the step. If none is left, the rate
    before the step stands for the whole of it.

    Parameters
    ----------
    length : sequence of float, length
        Length of each crack before the step. A tip is given the part of it that its advance has
        in that of its crack: half for each tip of a crack that grows evenly.
    da, rate0 : tuple of (f,) arrays
        Advance of each tip, and growth a cycle before the step.
    rate1 : sequence of sequence of float or None
        Growth a cycle after the step, None at tips that are gone.

    Returns
    -------
    float
    """
    moved = [
        (c, j) for c, d in enumerate(da) for j in range(len(d)) if d[j] > 0 and rate0[c][j] > 0
    ]
    stay = [(c, j) for c, j in moved if rate1[c][j] is not None]
    c, j = max(stay or moved, key=lambda tip: rate0[tip[0]][tip[1]])
    after = rate1[c][j]
    if after is None:
        return float(da[c][j] / rate0[c][j])
    a = length[c] * float(da[c][j] / da[c].sum())
    return float(cycles_between(a, a + da[c][j], rate0[c][j], after))


def cell_sizes(mesh: Mesh, x: Floats) -> Floats:
    """Size of the cell at each point `(k,)`, length; at the nearest cell where none has it."""
    cell, _ = locate(mesh, x)
    if (cell < 0).any():
        _, nearest = mesh.cell_tree.query(x[cell < 0])
        cell = np.array(cell)
        cell[cell < 0] = nearest
    return np.asarray(mesh.cell_size[cell])


def length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of the part of a crack in the plane that lies in the body.

    A mouth lies outside, as far as the crack was prolonged; that part does not count.
    """
    facets = mesh.points[mesh.facet_sets["boundary"]]
    q, s = facets[:, 0], facets[:, 1] - facets[:, 0]
    total = 0.0
    for first, second in crack.faces:
        p, r = crack.points[first], crack.points[second] - crack.points[first]
        cross = r[0] * s[:, 1] - r[1] * s[:, 0]
        gap = q - p
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (gap[:, 0] * s[:, 1] - gap[:, 1] * s[:, 0]) / cross
            u = (gap[:, 0] * r[1] - gap[:, 1] * r[0]) / cross
        hits = t[(cross != 0) & (u >= 0) & (u <= 1) & (t > 0) & (t < 1)]
        ends = np.concatenate([[0.0], np.sort(hits), [1.0]])
        inside = contains(mesh, p + 0.5 * (ends[:-1] + ends[1:])[:, None] * r)
        total += float(np.diff(ends)[inside].sum() * np.linalg.norm(r))
    if total <= 0:
        raise ProblemError(f"no part of the crack from {crack.points[0].tolist()} is in the body.")
    return total


__all__ = [
    "LEAST",
    "Advance",
    "PerCrack",
    "cell_sizes",
    "elapsed",
    "length_inside",
    "plan_advance",
]
