"""From one step of 2D cracks to the next, tip by tip."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, Ints
from xcrack.crack.advance_2d import advance
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.measures import facet_names, length_inside
from xcrack.growth.cycles import elapsed
from xcrack.growth.meeting_2d import joined, meetings
from xcrack.growth.step import LEAST, Arriving, PerCrack, Step, memory_of, moved_places
from xcrack.mesh.mesh import Mesh
from xcrack.sif.sif import SIF

PLACE = "tip"
END = "tip"
WAITS_BELOW = LEAST

_SAME = 1e-6  # of the coordinates: a tip recognised after its advance


def crack_size(crack: Crack, mesh: Mesh) -> float:
    """Length of a crack in the body."""
    return length_inside(crack, mesh)


def advanced(crack: Crack, places: SIF, angle: Floats, da: Floats, mesh: Mesh) -> Crack:
    """A crack after the advance of its tips."""
    del places, mesh
    return advance(crack, angle, da)


def met(cracks: list[Crack], da: PerCrack, mesh: Mesh) -> list[Crack]:
    """Cracks whose tips have met others, or will within a cell, are ended or joined there."""
    now = [own for own in meetings(cracks, mesh) if own.soon]
    moved = [float(way) > 0 for own in da for way in own]
    return joined(cracks, moved, now) if now else cracks


def gone(advanced: Crack, placed: Crack) -> list[int]:
    """Numbers of the tips that have left the body."""
    return [j for j, tip in enumerate(advanced.tips or ()) if tip not in (placed.tips or ())]


def arriving(
    last: Step, advanced: Sequence[Crack], placed: Sequence[Crack], mesh: Mesh
) -> list[Arriving]:
    """Tips that have left the body, and the part of their straight way that lies inside."""
    result = []
    for c, pair in enumerate(zip(advanced, placed, strict=True)):
        start = _starts(last, advanced, c)
        for j in gone(*pair):
            move = pair[0].points[(pair[0].tips or ())[j]] - start[j]
            way = float(np.linalg.norm(move))
            hit = exit_ahead(start[j], move / way, mesh) if way > 0 else None
            if hit is not None:
                x, name = hit
                ligament = float(np.linalg.norm(x - start[j]))
                result.append(Arriving(c, j, tuple(x.tolist()), name, ligament, ligament / way))
    return result


def _starts(last: Step, advanced: Sequence[Crack], c: int) -> Floats:
    """Where the tips of an advanced crack were before `(f, 2)`."""
    before = last.corrected
    if [crack.n_tips for crack in before] == [crack.n_tips for crack in advanced]:
        return tip_frames(before[c])[0]
    # Tips have met and are gone: the nearest that was is the same one.
    every = np.concatenate([tip_frames(crack)[0] for crack in before])
    now = tip_frames(advanced[c])[0]
    return every[[int(np.argmin(np.linalg.norm(every - x, axis=1))) for x in now]]


def ended(advanced: Crack, placed: Crack, arriving: Sequence[Arriving]) -> Crack:
    """A crack whose tips have all left the body, with its last points where it meets that."""
    points = np.array(placed.points)
    for each in arriving:
        points[(advanced.tips or ())[each.tip]] = each.x
    return Crack(points, placed.faces, ())


def exit_ahead(x: Floats, ahead: Floats, mesh: Mesh) -> tuple[Floats, str] | None:
    """Where a tip that runs straight meets the boundary, and the facet set there."""
    facet = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    start, stop = mesh.points[mesh.facets[facet]].transpose(1, 0, 2)
    side, gap = stop - start, start - x
    cross = ahead[0] * side[:, 1] - ahead[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (gap[:, 0] * side[:, 1] - gap[:, 1] * side[:, 0]) / cross
        share = (gap[:, 0] * ahead[1] - gap[:, 1] * ahead[0]) / cross
    hit = (cross != 0) & (share >= 0) & (share <= 1) & (far > 0)
    if not hit.any():
        return None
    first = int(np.argmin(np.where(hit, far, np.inf)))
    names, group = facet_names(mesh)
    return x + far[first] * ahead, names[group[facet[first]]]


def followed(
    last: Step,
    cracks: Sequence[Crack],
    sif: Sequence[SIF],
    law_rate: Sequence[Floats],
    length: Sequence[float],
    mesh: Mesh,
) -> tuple[float, PerCrack]:
    """Cycles since the last step, and the growth that waits at the tips of this one.

    Parameters and results are those of `Following.followed`.
    """
    del length, mesh, cracks
    before = memory_of(last)
    # All tips together: where two cracks have become one, their numbers have changed.
    tips, rates = np.concatenate([own.x for own in sif]), np.concatenate(law_rate)
    waits = np.zeros(len(tips))
    rate1 = []
    for c in range(len(last.cracks)):
        new_of_old = _matched(moved_places(last, c), tips)
        rate1.append([None if n < 0 else float(rates[n]) for n in new_of_old])
        there = new_of_old >= 0
        waits[new_of_old[there]] = before.pending[c][there]
    ends = np.cumsum([len(own.x) for own in sif])[:-1]
    pending = tuple(np.split(waits, ends))
    return elapsed(before.length, last.da, before.law_rate, rate1), pending


def _matched(moved: Floats, tips: Floats) -> Ints:
    """Row of each tip after the step, -1 where it has left the body."""
    if not len(tips) or not len(moved):
        return np.full(len(moved), -1)
    distance, row = cKDTree(tips).query(moved)
    return np.where(distance <= _SAME * np.abs(tips).max(), row, -1)


__all__ = [
    "END",
    "PLACE",
    "WAITS_BELOW",
    "advanced",
    "arriving",
    "crack_size",
    "ended",
    "exit_ahead",
    "followed",
    "gone",
    "met",
]
