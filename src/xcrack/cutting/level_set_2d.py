"""Level sets of a polyline at the points of a mesh.

The polyline is the truth and the level sets derive from it: phi is the signed distance to the
crack (prolonged by rays), psi the signed distance to each tip along it. A node that is nearest to
an old face keeps its value when the crack grows, since the arithmetic is the same: the old crack
is frozen by construction (the aim of Duflot, 2007), and a crack that turns by more than 120
degrees keeps all its faces, where a purely nodal update loses some.
"""

from dataclasses import replace

import numpy as np

from xcrack.arrays import Bools, Floats, lock
from xcrack.crack.crack import Crack
from xcrack.crack.tips_2d import tip_frames
from xcrack.cutting.level_set import SNAP, LevelSet, near_edges, snapped
from xcrack.mesh.locate import cells_around
from xcrack.mesh.mesh import Mesh


def line_levels(mesh: Mesh, crack: Crack) -> LevelSet:
    """Level sets of a placed crack in 2D at the points of a mesh."""
    from xcrack.kernels.distance import polyline_distance

    reach = 10 * mesh.extent + float(np.abs(crack.points - mesh.points[0]).max())
    start, stop = _prolongation(crack.points, reach)
    vertices = np.concatenate([[start], crack.points, [stop]])
    phi, segment = polyline_distance(mesh.points, vertices)
    x, frame = tip_frames(crack)
    psi = np.empty((len(x), mesh.n_points))
    n_segments = len(vertices) - 1
    for k, tip in enumerate(crack.tips or ()):
        from_tip = mesh.points - x[k]
        straight = from_tip @ frame[k, 0]
        r = np.linalg.norm(from_tip, axis=1)
        behind = -np.sqrt(np.maximum((r - np.abs(phi)) * (r + np.abs(phi)), 0.0))
        ray, neighbour = (0, 1) if tip == 0 else (n_segments - 1, n_segments - 2)
        # Points nearest to the kink behind the last piece are as near to one piece as to the
        # other: round-off must not decide.
        last = np.linalg.norm(vertices[neighbour + 1] - vertices[neighbour])
        along = (segment == ray) | ((segment == neighbour) & (straight > -last))
        psi[k] = np.where(along, straight, behind)
    mouth = np.full(mesh.n_points, -reach)
    for end, ray in ((0, 0), (len(crack.points) - 1, n_segments - 1)):
        if end not in (crack.tips or ()):
            beyond = segment == ray
            mouth[beyond] = np.linalg.norm(mesh.points[beyond] - crack.points[end], axis=1)
    levels = tied_to_tips(mesh, crack, phi, psi, mouth, near_edges(mesh, phi))
    return replace(levels, line=crack.points)


def tied_to_tips(
    mesh: Mesh, crack: Crack, phi: Floats, psi: Floats, mouth: Floats, near: Bools
) -> LevelSet:
    """Level sets of a placed crack in 2D from values at the points, which are changed.

    Around a tip they become those of its frame, so that the tip stays where it is even when the
    last kink is less than a cell away.
    """
    x, frame = tip_frames(crack)
    tip_cells = tuple(cells_around(mesh, point, SNAP) for point in x)
    for k, cells in enumerate(tip_cells):
        nodes = np.unique(mesh.cells[cells])
        local = mesh.points[nodes] - x[k]
        phi[nodes] = local @ frame[k, 1]
        psi[k, nodes] = local @ frame[k, 0]
        there = np.zeros(mesh.n_points, dtype=bool)
        there[nodes] = True
        near |= there[mesh.edges[:, 0]] | there[mesh.edges[:, 1]]
    phi = snapped(mesh, phi)
    return LevelSet(lock(phi), lock(psi), tip_cells, lock(x), lock(mouth), lock(near))


def _prolongation(points: Floats, reach: float) -> tuple[Floats, Floats]:
    """Ends of the rays that prolong a polyline, where they meet it or each other at the latest.

    Beyond such a crossing of a crack that turns by more than half a circle the sides of the two
    pieces contradict each other.
    """
    first, last = points[0], points[-1]
    back, on = _unit(first - points[1]), _unit(last - points[-2])
    near = _free_reach(first, back, points[1:], reach)
    far = _free_reach(last, on, points[:-1], reach)
    ahead = np.stack([last, last + far * on])
    near = _free_reach(first, back, ahead, near)
    far = _free_reach(last, on, np.stack([first, first + near * back]), far)
    return first + near * back, last + far * on


def _free_reach(origin: Floats, direction: Floats, polyline: Floats, reach: float) -> float:
    """Length up to which a ray runs before it meets a polyline."""
    a, along = polyline[:-1], np.diff(polyline, axis=0)
    gap = a - origin
    cross = direction[0] * along[:, 1] - direction[1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[:, 0] * along[:, 1] - gap[:, 1] * along[:, 0]) / cross
        u = (gap[:, 0] * direction[1] - gap[:, 1] * direction[0]) / cross
    hit = (cross != 0) & (t > 0) & (u >= -1e-9) & (u <= 1 + 1e-9)
    return float(min(reach, np.min(t[hit], initial=np.inf)))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v))
