"""Stations: the places of cracks' ends where K is known, a tip in 2D, a vertex of a front in 3D."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.front_curve import front_curve
from xcrack.crack.fronts_3d import front_frames
from xcrack.mesh.locate import contains
from xcrack.mesh.mesh import Mesh

_ON = 1e-6  # of a side of a front, by which its end may miss the boundary


@dataclass(frozen=True, eq=False)
class Stations:
    """Ends of all cracks of a problem, as arrays over their n stations.

    Attributes
    ----------
    crack : (n,) array of int
        Number of the crack.
    front : (n,) array of int
        Number of the tip or front within its crack.
    s : (n,) array, length
        Position along the front; 0 in 2D.
    x : (n, d) array, length
    frame : (n, d, d) array
        Rows (ahead, normal), in 3D (ahead, normal, ahead x normal).
    """

    crack: Ints
    front: Ints
    s: Floats
    x: Floats
    frame: Floats

    def __len__(self) -> int:
        return len(self.crack)


def part_inside(mesh: Mesh, x: Floats, inside: Ints) -> tuple[int, int]:
    """First vertex of an open front to count, and the one behind the last.

    One beyond each end of the part in the body, where that does not end at a vertex: from there a
    front is led out of the body in a direction of its own.
    """
    if not len(inside):
        return 0, len(x)
    first, last = int(inside[0]), int(inside[-1])
    ahead = [min(max(k, 0), len(x) - 1) for k in (first - 1, last + 1)]
    on = x[[first, last]] + _ON * (x[ahead] - x[[first, last]])
    goes_on = contains(mesh, on)
    first, last = (k if beyond else own for k, own, beyond in zip(ahead, (first, last), goes_on))
    return (first, last + 1) if last > first else (0, len(x))


def stations_of(cracks: Sequence[Crack], mesh: Mesh) -> Stations:
    """Stations of placed cracks in the body, in the order of `SIF` of each.

    Parameters
    ----------
    cracks : sequence of Crack
        Placed in the mesh.
    mesh : Mesh
    """
    d = mesh.dim
    rows: list[tuple[int, int, Floats, Floats, Floats]] = []
    for c, crack in enumerate(cracks):
        if d == 2:
            for k, (x, frame) in enumerate(zip(*tip_frames(crack), strict=True)):
                rows.append((c, k, np.zeros(1), x[None], frame[None]))
        else:
            for k, front in enumerate(front_frames(crack)):
                within = np.nonzero(contains(mesh, np.array(front.x)))[0]
                whole = front_curve(front.x, front.frame, front.closed)
                first, last = 0, len(front.x)
                if not front.closed:
                    first, last = part_inside(mesh, front.x, within)
                part = front_curve(front.x[first:last], front.frame[first:last], front.closed)
                frame = part.at(part.breaks[within - first])[1]
                s = whole.arc(whole.breaks[within])
                rows.append((c, k, s, front.x[within], frame))
    count = [len(row[2]) for row in rows]
    return Stations(
        lock(np.repeat([row[0] for row in rows], count).astype(np.int64)),
        lock(np.repeat([row[1] for row in rows], count).astype(np.int64)),
        lock(np.concatenate([np.zeros(0), *(row[2] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d)), *(row[3] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d, d)), *(row[4] for row in rows)])),
    )


CutEnds = tuple[Sequence[Floats], Sequence[Floats]]


def _tips(crack: Crack) -> CutEnds:
    x, frame = tip_frames(crack)
    return list(x), list(frame)


def _fronts(crack: Crack) -> CutEnds:
    fronts = front_frames(crack)
    return [front.x for front in fronts], [front.frame for front in fronts]


_ENDS: dict[int, Callable[[Crack], CutEnds]] = {2: _tips, 3: _fronts}


def end_frames(crack: Crack) -> CutEnds:
    """Points and frames of each tip, in 3D of each front, of a placed crack.

    Parameters
    ----------
    crack : Crack

    Returns
    -------
    points : sequence of (2,) or (m, 3) arrays, length
    frames : sequence of (2, 2) or (m, 3, 3) arrays
        Rows (ahead, normal), in 3D (ahead, normal, along).
    """
    return _ENDS[crack.dim](crack)


__all__ = ["Stations", "end_frames", "stations_of"]
