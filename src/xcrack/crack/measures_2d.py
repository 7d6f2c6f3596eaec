"""Length of a line in a body, and where it meets the boundary."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.crack.crack import Crack
from xcrack.crack.size_2d import length_inside
from xcrack.crack.tips_2d import tip_frames
from xcrack.geometry.simplices import distance_to_simplices
from xcrack.mesh.locate import parts_inside
from xcrack.mesh.mesh import Mesh

_END = 1e-9  # share of a piece of a line within which it begins or ends


def measures_of_line(
    crack: Crack, mesh: Mesh, group: Ints
) -> tuple[float, float, dict[int, tuple[float, float]], list[tuple[Floats, int, int]]]:
    """Length inside, depth by set, and mouths of a placed 2D crack.

    Parameters
    ----------
    crack : Crack
    mesh : Mesh
    group : (f,) array of int
        Number of the set of each facet of the mesh.

    Returns
    -------
    length : float, length
    front_length : float
        0.
    traces : dict of set to (0, depth)
    ends : list of (x, facet, -1)
    """
    outer = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    sides = mesh.points[mesh.facets[outer]]
    tips, _ = tip_frames(crack)
    ends: list[tuple[Floats, int, int]] = []
    pieces = list(zip(crack.points, np.diff(crack.points, axis=0), strict=False))
    for (p, r), parts in zip(pieces, parts_inside(mesh, crack.points), strict=True):
        for t in np.unique(parts):
            x = p + t * r
            distance = distance_to_simplices(x, sides)
            best = int(np.argmin(distance))
            # Pieces meet inside the body, and tips lie there: neither is a mouth.
            if distance[best] <= _END * mesh.extent and not _is_tip(x, tips, mesh.extent):
                if not any(np.linalg.norm(x - y) <= _END * mesh.extent for y, _, _ in ends):
                    ends.append((x, int(outer[best]), -1))
    traces: dict[int, tuple[float, float]] = {}
    for x, facet, _ in ends:
        away = np.linalg.norm(tips - x, axis=1).max(initial=0.0)
        far = max((float(np.linalg.norm(x - y)) for y, _, _ in ends), default=0.0)
        k = int(group[facet])
        depth = float(away) if len(tips) else far
        traces[k] = (0.0, max(depth, traces.get(k, (0.0, 0.0))[1]))
    return length_inside(crack, mesh), 0.0, traces, ends


def _is_tip(x: Floats, tips: Floats, extent: float) -> bool:
    return bool((np.linalg.norm(tips - x, axis=1) <= _END * extent).any())
