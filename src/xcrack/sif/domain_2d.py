"""The domain of the interaction integral: its size, its points and its weight q."""

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.mesh.locate import nearest_boundary
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.loads import position
from xcrack.xfem.quadrature import Points, cell_points

# Inner radius of the ring in which q falls, as a share of the outer one. At order 1 the ring stays
# outside the enriched disc; at order 2 a wide ring saves digits on coarse meshes (measured).
_RING = {1: 0.4, 2: 0.15}
_OUTER = {1: 2.5, 2: 2.5}  # outer radius, as a multiple of the enriched radius
# Cells up to a share of the outer radius: points a direction with tip functions, degree without.
_DEGREES = ((0.0, 0.03, 4, 4), (0.03, 0.1, 5, 6), (0.1, 0.25, 5, 8), (0.25, np.inf, 5, 10))
_CHUNK = 4000  # cells integrated at once; bounds the memory


def domain_radius(solution: Solution, t: int) -> tuple[float, float, float]:
    """Outer radius of the domain at tip t, the wanted one, and the cell size there, length."""
    space = solution.space
    tip = space.tips[t]
    cells = space.cuts[tip.crack].level_set.tip_cells[tip.number]
    size = float(space.mesh.cell_size[cells].mean())
    wanted = solution.problem.numerics.domain or max(_OUTER[space.order] * tip.radius, 4.0 * size)
    free, _ = nearest_boundary(space.mesh, tip.x)
    others = [np.linalg.norm(o.x - tip.x) for o in space.tips if o is not tip]
    lips = [
        np.linalg.norm(points.x - tip.x, axis=1).min()
        for c, points in enumerate(solution.lips)
        if c != tip.crack and len(points)
    ]
    limit = min([0.95 * free, *[0.8 * float(o) for o in others], *[0.9 * float(v) for v in lips]])
    return min(wanted, max(limit, 1.2 * size)), wanted, size


def domain_points(
    space: FunctionSpace, centre: Floats, radii: tuple[float, float]
) -> list[tuple[Points, Floats]]:
    """Integration points between two radii and their places, denser where cells are large."""
    mesh = space.mesh
    hollow, radius = radii
    near = np.array(
        mesh.cell_tree.query_ball_point(centre, radius + float(mesh.cell_size.max())),
        dtype=np.int64,
    )
    near.sort()
    x = mesh.points[mesh.cells[near]]
    inside = np.linalg.norm(x - centre, axis=2).max(axis=1) <= hollow
    far = np.linalg.norm(x.mean(axis=1) - centre, axis=1) > radius + mesh.cell_size[near]
    near = near[~inside & ~far]
    share = mesh.cell_size[near] / radius
    parts: list[tuple[Points, Floats]] = []
    for low, high, n, degree in _DEGREES:
        cells = near[(share > low) & (share <= high)]
        for first in range(0, len(cells), _CHUNK):
            points = cell_points(space, cells[first : first + _CHUNK], n, degree)
            x = position(space, points.cell, points.bary)
            r = np.linalg.norm(x - centre, axis=1)
            between = (hollow < r) & (r < radius)
            parts.append((points.chosen(between), x[between]))
    return parts


def inner_radii(order: int, radii: Floats) -> Floats:
    """Radii within which the weight q is one, length."""
    return _RING[order] * radii


def weight(order: int, r: Floats, xi: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Weight q, one inside and zero outside by a quintic, and its gradient, for each domain."""
    inner = inner_radii(order, radii)[:, None]
    width = radii[:, None] - inner
    z = np.clip((r - inner) / width, 0.0, 1.0)
    q = 1 - z**3 * (10 - 15 * z + 6 * z**2)
    slope = -30 * z**2 * (1 - z) ** 2 / width
    return q, slope[..., None] * (xi / np.maximum(r, 1e-300)[:, None])[None]


def mean_rotation(solution: Solution, t: int, radius: float) -> Floats:
    """Mean rotation of the mesh points around tip t `(d, d)`.

    A rigid rotation adds nothing to I but the quadrature error of a term that would vanish.
    """
    space = solution.space
    x = space.mesh.points - space.tips[t].x
    near = np.nonzero(np.linalg.norm(x, axis=1) < radius)[0]
    if len(near) < 2:
        return np.zeros((2, 2))
    y, u = x[near] - x[near].mean(axis=0), solution.coefficients[near]
    w = float((y[:, 0] * u[:, 1] - y[:, 1] * u[:, 0]).sum() / (y * y).sum())
    return np.array([[0.0, -w], [w, 0.0]])
