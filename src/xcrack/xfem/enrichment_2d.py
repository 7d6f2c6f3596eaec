"""How far the tip functions reach around tips in 2D."""

import numpy as np

from xcrack.arrays import Floats
from xcrack.crack.crack import Crack, crack_length
from xcrack.crack.tips_2d import tip_frames
from xcrack.cutting.cut import Cut
from xcrack.mesh.locate import nearest_boundary
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.sizes import leg_size

_SHARE = {1: 0.3, 2: 0.4}  # of the free length around a tip, measured best for K at each order
_LEAST = 2.0  # cells
# In cells: by then K is right to 1e-7 (order 2) or 1e-4 (order 1), and a wider disc would only cost
# unknowns and fill.
_MOST = {1: 40.0, 2: 20.0}


def disc_radii(
    mesh: Mesh,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    order: int,
    wanted: float | None,
    meeting: Floats,
) -> list[tuple[float, ...]]:
    """Radius of the enriched disc at each tip of each crack, length.

    Without a wanted radius: a share (0.3 at order 1, 0.4 at order 2) of the smallest of crack
    length, distance to the boundary, to another tip and to a junction, at most 20 cells (40 at
    order 1). A wanted radius is used, and shrunk only where the body, another tip or a junction
    demands. Never below two cells.
    """
    tips = [tip_frames(crack)[0] for crack in cracks]
    every = np.concatenate(tips) if tips else np.zeros((0, mesh.dim))
    radii = []
    for crack, cut, own in zip(cracks, cuts, tips, strict=True):
        length = crack_length(crack) / max(len(own), 1)
        row = []
        for k, x in enumerate(own):
            to_boundary, _ = nearest_boundary(mesh, x)
            apart = np.linalg.norm(every - x, axis=1)
            to_tip = float(np.min(apart[apart > 0], initial=np.inf))
            to_joint = float(np.linalg.norm(meeting - x, axis=1).min(initial=np.inf))
            size = leg_size(mesh, cut.level_set.tip_cells[k])
            if wanted is None:
                radius = min(
                    _SHARE[order] * min(length, to_boundary, to_tip, to_joint), _MOST[order] * size
                )
            else:
                radius = min(wanted, 0.8 * to_boundary, 0.45 * to_tip, 0.8 * to_joint)
            row.append(max(radius, _LEAST * size))
        radii.append(tuple(row))
    return radii
