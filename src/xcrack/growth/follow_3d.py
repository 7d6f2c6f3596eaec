"""From one step of 3D cracks to the next, place by place along their fronts."""

from collections.abc import Sequence

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.crack import Crack
from xcrack.crack.measures import facet_names, front_ends, surface_size
from xcrack.crack.stations import closed_fronts
from xcrack.growth.cycles import elapsed_3d
from xcrack.growth.step import Arriving, PerCrack, Step, memory_of, moved_places
from xcrack.growth.trail import Places
from xcrack.mesh.distances import front_distance, signed_in
from xcrack.mesh.locate import Body, cell_sizes
from xcrack.mesh.mesh import Mesh
from xcrack.sif.sif import SIF

PLACE = "front place"
END = "front"
WAITS_BELOW = 0.02  # of a cell: neighbours along a front move on, so a slow part has to follow

_SPACING = 0.5  # of a cell, between the points of a new front
_REACH = 2.0  # cells from a place along a front to those of the step before
_BISECTIONS = 40
_LONGER = (2.0, 4.0, 8.0)  # times an advance: ways on which the last pieces of a front leave


def crack_size(crack: Crack, mesh: Mesh) -> float:
    """Area of a crack over the length of its fronts, in the body."""
    return surface_size(crack, mesh)


def advanced(crack: Crack, places: SIF | Places, angle: Floats, da: Floats, mesh: Mesh) -> Crack:
    """A crack after the advance of its fronts by `da` at places along them."""
    if not len(places.s):
        return crack
    size = _SPACING * float(cell_sizes(mesh, places.x).mean())
    return advance_fronts(crack, places.s, places.front, angle, da, size)


def met(cracks: list[Crack], da: PerCrack, mesh: Mesh) -> list[Crack]:
    """Fronts that meet others end the run with the place."""
    del da, mesh
    return cracks


def gone(advanced: Crack, placed: Crack) -> list[int]:
    """[0] where all fronts have left the body."""
    return [0] if advanced.n_tips and not placed.n_tips else []


def arriving(
    last: Step, advanced: Sequence[Crack], placed: Sequence[Crack], mesh: Mesh
) -> list[Arriving]:
    """Facet sets that a front has come to, each with the place along it that was first.

    A front that has left the body as a whole comes with its last place.
    """
    body, (names, group) = Body.of(mesh), facet_names(mesh)
    outer = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]

    def name_at(x: Floats) -> str:
        return names[group[outer[signed_in(body.boundary, x[None])[1][0]]]]

    result = []
    for c, pair in enumerate(zip(advanced, placed, strict=True)):
        start, move = last.sif[0][c].x, moved_places(last, c) - last.sif[0][c].x
        share = _shares(start, move, body)
        x = start + np.minimum(share, 1.0)[:, None] * move
        if gone(*pair):
            result += [
                Arriving(c, place, tuple(y.tolist()), name_at(y), way, part)
                for place, y, way, part in _last_out(start, move, share, body)
            ]
            continue
        before = [x for _, x in front_ends(last.corrected[c], body)]
        known = {name_at(each) for each in before}
        reach = 2.0 * float(np.linalg.norm(move, axis=1).max(initial=0.0))
        for _, end in front_ends(pair[1], body):
            name, near = name_at(end), reach + _REACH * float(body.cell_size(end[None])[0])
            away = min((float(np.linalg.norm(end - each)) for each in before), default=np.inf)
            if name in known and away <= near:
                continue
            known.add(name)
            before.append(end)
            gap = np.linalg.norm(x - end, axis=1)
            out = np.isfinite(share) & (gap <= near + reach)
            out &= np.array([bool(o) and name_at(each) == name for o, each in zip(out, x)], bool)
            place = int(np.argmin(np.where(out, share, np.inf) if out.any() else gap))
            there, part = (x[place], float(share[place])) if out.any() else (end, 1.0)
            way = float(np.linalg.norm(there - start[place]))
            result.append(Arriving(c, place, tuple(there.tolist()), name, way, part))
    return result


def _last_out(
    start: Floats, move: Floats, share: Floats, body: Body
) -> list[tuple[int, Floats, float, float]]:
    """The place of a front that leaves the body last: number, where, its way, part of the move.

    The last pieces of a front are too short for the mesh: they go on straight.
    """
    share = np.array(share)
    for longer in _LONGER:
        inside = np.isinf(share)
        share[inside] = longer * _shares(start[inside], longer * move[inside], body)
    share[np.isinf(share)] = -1.0  # it waits, or runs along a side
    if not len(share) or share.max() < 0:
        return []
    place = int(np.argmax(share))
    y = start[place] + share[place] * move[place]
    return [(place, y, float(np.linalg.norm(y - start[place])), float(share[place]))]


def _shares(start: Floats, move: Floats, body: Body) -> Floats:
    """Part of a move after which each place is outside the body; inf where it stays inside."""
    share = np.full(len(start), np.inf)
    if not len(start):
        return share
    out = np.nonzero((body.depth(start)[0] < 0) & (body.depth(start + move)[0] >= 0))[0]
    low, high = np.zeros(len(out)), np.ones(len(out))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        outside = body.depth(start[out] + middle[:, None] * move[out])[0] >= 0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    share[out] = high
    return share


def ended(advanced: Crack, placed: Crack, arriving: Sequence[Arriving]) -> Crack:
    """A crack whose fronts have all left the body: as it was placed."""
    del advanced, arriving
    return placed


def followed(
    last: Step,
    cracks: Sequence[Crack],
    sif: Sequence[SIF],
    law_rate: Sequence[Floats],
    length: Sequence[float],
    mesh: Mesh,
) -> tuple[float, PerCrack]:
    """Cycles since the last step, and the growth that waits at the places of this one.

    Parameters and results are those of `Following.followed`.
    """
    before = memory_of(last)
    after, pending = [], []
    for c in range(len(cracks)):
        old, new, moved = last.sif[0][c], sif[c], moved_places(last, c)
        size = cell_sizes(mesh, new.x).mean() if len(new.x) else 0.0
        reach = _REACH * float(size)
        new_closed, old_closed = closed_fronts(cracks[c]), closed_fronts(last.cracks[c])
        after.append(
            interpolate_along_front(new.x, new.front, new_closed, law_rate[c], moved, reach)
        )
        waits = interpolate_along_front(
            moved, old.front, old_closed, before.pending[c], new.x, reach
        )
        pending.append(np.nan_to_num(waits))
    cycles = elapsed_3d(before.length, length, last.da, before.law_rate, after)
    return cycles, tuple(pending)


def interpolate_along_front(
    x: Floats,
    front: Ints,
    closed: Sequence[bool],
    values: Floats,
    target: Floats,
    reach: float,
) -> Floats:
    """Values along fronts, taken over to points nearby, as those of the fronts after a step.

    Parameters
    ----------
    x : (f, 3) array, length
        Places with values, in order along each front.
    front : (f,) array of int
        Which front.
    closed : sequence of bool
        Whether each front is closed.
    values : (f,) or (f, m) array
    target : (g, 3) array, length
        Where values are sought.
    reach : float, length
        A point farther from all places than this gets none.

    Returns
    -------
    (g,) or (g, m) array
        Linear between the places, nan beyond reach.
    """
    result = np.full((len(target), *values.shape[1:]), np.nan)
    best = np.full(len(target), float(reach))
    for number in np.unique(front):
        own = front == number
        line, along = x[own], values[own]
        if len(line) == 1:
            line, along = np.concatenate([line, line]), np.concatenate([along, along])
        shut = bool(closed[number]) and len(line) > 2
        r, segment, place = front_distance(target, line, shut)
        following = (segment + 1) % len(line)
        place = np.nan_to_num(place).reshape(-1, *[1] * (values.ndim - 1))
        first, second = along[segment], along[following]
        with np.errstate(invalid="ignore"):  # inf where the toughness is reached
            between = (1 - place) * first + place * second
        value = np.where(place == 0, first, np.where(place == 1, second, between))
        nearer = r <= best
        result[nearer], best[nearer] = value[nearer], r[nearer]
    return result


__all__ = [
    "END",
    "PLACE",
    "WAITS_BELOW",
    "advanced",
    "arriving",
    "crack_size",
    "ended",
    "followed",
    "gone",
    "interpolate_along_front",
    "met",
]
