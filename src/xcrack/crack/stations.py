"""Stations: the places of cracks' ends where K is known, a tip in 2D, a vertex of a front in 3D."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.front_curve import front_curve
from xcrack.crack.fronts_3d import front_frames
from xcrack.mesh.locate import contains
from xcrack.mesh.mesh import Mesh


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
                within = contains(mesh, np.array(front.x))
                curve = front_curve(front.x, front.frame, front.closed)
                s = curve.breaks[: len(front.x)]
                frame = curve.at(s)[1]
                rows.append((c, k, curve.arc(s)[within], front.x[within], frame[within]))
    count = [len(row[2]) for row in rows]
    return Stations(
        lock(np.repeat([row[0] for row in rows], count).astype(np.int64)),
        lock(np.repeat([row[1] for row in rows], count).astype(np.int64)),
        lock(np.concatenate([np.zeros(0), *(row[2] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d)), *(row[3] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d, d)), *(row[4] for row in rows)])),
    )


__all__ = ["Stations", "stations_of"]
