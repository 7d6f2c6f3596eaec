"""Level sets of a crack surface at the points of a mesh.

The triangles are the truth: phi is the signed distance to the surface, prolonged ahead of its
fronts by strips, and psi follows from the distance to the front, r² = phi² + psi², with its sign
from the closest triangle: strip or surface (hybrid explicit-implicit description, after Fries and
Baydoun, 2012). Distances are exact in a band around the surface; beyond it only their sign and
size matter.
"""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Bools, Floats, Ints, lock
from xcrack.crack.crack import Crack
from xcrack.crack.fronts_3d import Front, front_frames
from xcrack.cutting.extension_3d import extended
from xcrack.cutting.level_set import LevelSet, near_edges, snapped
from xcrack.geometry.distances import front_distance, surface_distance
from xcrack.mesh.mesh import Mesh, local_facets

_FLAT = 0.03  # share |psi| / r below which the root of r² - phi² loses digits
_AT = 1e-10  # share of a cell below which a psi on the crack is zero
_STRAIGHT = 1e-6  # offset of the chords, as a share of a cell, below which a front is straight
_CHORDS = 12  # chords over which their offset is averaged


def surface_levels(mesh: Mesh, crack: Crack, reach: float) -> LevelSet:
    """Level sets of a placed 3D crack.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
        With its fronts decided.
    reach : float, length
        Distance from the fronts up to which phi and psi are needed.

    Returns
    -------
    LevelSet
    """
    size = _largest_cells(mesh, crack)
    band = reach + 2 * size
    surface = extended(crack, mesh, band + size)
    phi, triangle, at_end = surface_distance(mesh.points, surface.points, surface.triangles, band)
    label = np.where(triangle >= 0, surface.label[triangle], 0)
    fronts = front_frames(crack)
    far = 10 * mesh.extent
    psi = np.empty((len(fronts), mesh.n_points))
    for k, front in enumerate(fronts):
        psi[k] = _along(mesh.points, phi, label == k + 1, front, band, far)
    phi = snapped(mesh, phi)
    near = near_edges(mesh, phi)
    for k, front in enumerate(fronts):
        psi[k] = _unbiased(mesh, phi, psi[k], near, front, band)
    mouth = np.where(at_end & (label == 0), np.abs(phi), -far)
    tip_cells = tuple(_front_cells(mesh, phi, p, near) for p in psi)
    one = np.array([front.x[0] for front in fronts]).reshape(-1, mesh.dim)
    return LevelSet(lock(phi), lock(psi), tip_cells, lock(one), lock(mouth), lock(near))


def _largest_cells(mesh: Mesh, crack: Crack) -> float:
    """Largest cell that the surface runs through, length."""
    near = mesh.cell_tree.query(crack.points[crack.faces].mean(axis=1))[1]
    return float(mesh.cell_size[near].max())


def _along(
    points: Floats,
    phi: Floats,
    ahead: Bools,
    front: Front,
    band: float,
    far: float,
) -> Floats:
    """Distance to one front along the surface, positive ahead."""
    r, segment, position = front_distance(points, front.x, front.closed, band)
    near = segment >= 0
    psi = np.where(ahead, far, -far)
    rows = np.nonzero(near)[0]
    root = np.sqrt(np.maximum((r[rows] - np.abs(phi[rows])) * (r[rows] + np.abs(phi[rows])), 0.0))
    psi[rows] = np.where(ahead[rows], root, -root)
    flat = rows[root < _FLAT * r[rows]]
    foot, direction = _foot(front, segment[flat], position[flat])
    psi[flat] = np.einsum("qd,qd->q", points[flat] - foot, direction)
    return psi


def _unbiased(
    mesh: Mesh, phi: Floats, psi: Floats, near: Bools, front: Front, band: float
) -> Floats:
    """Shift psi so that the front that the cells see is the given one in the mean.

    In a cell the front is straight: a curved one would lose the slivers between chords and arc,
    1 % of the radius of a penny of five cells. The loss is measured at the middle of each chord.
    """
    cells = _front_cells(mesh, phi, psi, near)
    middle, length = _chords(mesh, phi, psi, cells)
    if not len(middle):
        return psi
    _, segment, position = front_distance(middle, front.x, front.closed)
    foot, ahead = _foot(front, segment, position)
    offset = np.einsum("qd,qd->q", middle - foot, ahead)
    if np.abs(offset).max() < _STRAIGHT * mesh.cell_size[cells].mean():
        return psi
    rows = np.nonzero(np.abs(psi) < 2 * band)[0]
    distance, nearest = cKDTree(middle).query(mesh.points[rows], k=min(_CHORDS, len(middle)))
    distance, nearest = (a.reshape(len(rows), -1) for a in (distance, nearest))
    # Chords beside a bend must not move the straight part next to it.
    beyond = (distance**2 - distance[:, :1] ** 2) / mesh.cell_size[cells].mean() ** 2
    share = length[nearest] * np.exp(-np.minimum(beyond, 50.0))
    shifted = psi.copy()
    shifted[rows] += (share * offset[nearest]).sum(axis=1) / share.sum(axis=1)
    return shifted


def _chords(mesh: Mesh, phi: Floats, psi: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """Middle and length of the line phi = psi = 0 in cells that have one."""
    ends = []
    for facet in local_facets(3):
        corner = mesh.cells[cells][:, facet]
        system = np.stack([phi[corner], psi[corner], np.ones(corner.shape)], axis=1)
        size = np.abs(system).max(axis=2, keepdims=True)
        system = system / np.maximum(size, 1e-300)
        regular = np.abs(np.linalg.det(system)) > 1e-12
        bary = np.full(corner.shape, np.nan)
        rhs = np.zeros((int(regular.sum()), 3, 1))
        rhs[:, 2] = 1.0
        bary[regular] = np.linalg.solve(system[regular], rhs)[..., 0]
        hit = bary.min(axis=1) > -_AT
        x = np.einsum("kv,kvd->kd", bary, mesh.points[corner])
        ends.append(np.where(hit[:, None], x, np.nan))
    points = np.stack(ends, axis=1)
    hits = ~np.isnan(points[:, :, 0])
    two = np.nonzero(hits.sum(axis=1) == 2)[0]
    pair = points[two][hits[two]].reshape(-1, 2, 3)
    length = np.linalg.norm(pair[:, 1] - pair[:, 0], axis=1)
    return pair.mean(axis=1)[length > 0], length[length > 0]


def _foot(front: Front, segment: Ints, position: Floats) -> tuple[Floats, Floats]:
    """Points on a front and the directions ahead of it there."""
    t = position[:, None]
    second = (segment + 1) % len(front.x)
    foot = (1 - t) * front.x[segment] + t * front.x[second]
    ahead = (1 - t) * front.frame[segment, 0] + t * front.frame[second, 0]
    return foot, ahead / np.linalg.norm(ahead, axis=1, keepdims=True)


def _front_cells(mesh: Mesh, phi: Floats, psi: Floats, near: Bools) -> Ints:
    """Cells whose closed set meets phi = psi = 0."""
    values = phi[mesh.cells]
    rows = np.nonzero((values.min(axis=1) <= 0) & (values.max(axis=1) >= 0))[0]
    edge = mesh.cell_to_edge[rows]
    a, b = mesh.edges[edge, 0], mesh.edges[edge, 1]
    crossed = phi[a] * phi[b] < 0
    close = (near[edge] | ~crossed).all(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = phi[a] / (phi[a] - phi[b])
        at_edge = np.where(crossed, (1 - t) * psi[a] + t * psi[b], np.nan)
    corner = mesh.cells[rows]
    at_corner = np.where(phi[corner] == 0, psi[corner], np.nan)
    every = np.concatenate([at_edge, at_corner], axis=1)
    every = np.where(np.abs(every) < _AT * mesh.cell_size[rows][:, None], 0.0, every)
    low = np.where(np.isnan(every), np.inf, every).min(axis=1)
    high = np.where(np.isnan(every), -np.inf, every).max(axis=1)
    return rows[close & (low <= 0) & (high >= 0)]
