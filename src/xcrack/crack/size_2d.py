"""Length of a 2D crack in the body."""

import numpy as np

from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.mesh.locate import contains
from xcrack.mesh.mesh import Mesh


def length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of the part of a 2D crack that lies in the body.

    A mouth lies outside, as far as the crack was prolonged; that part does not count.
    """
    facets = mesh.points[mesh.boundary]
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


__all__ = ["length_inside"]
