"""Length of a 2D crack in the body."""

import numpy as np

from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.mesh.locate import parts_inside
from xcrack.mesh.mesh import Mesh


def length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of the part of a 2D crack that lies in the body.

    A mouth lies outside, as far as the crack was prolonged; that part does not count.
    """
    length = np.linalg.norm(np.diff(crack.points, axis=0), axis=1)
    share = [float(np.diff(parts, axis=1).sum()) for parts in parts_inside(mesh, crack.points)]
    total = float(length @ share)
    if total <= 0:
        raise ProblemError(f"no part of the crack from {crack.points[0].tolist()} is in the body.")
    return total


__all__ = ["length_inside"]
