"""Where points lie in a mesh."""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.geometry.simplices import distance_to_simplices
from xcrack.mesh.mesh import Mesh

_TOLERANCE = 1e-10  # barycentric; a point this close to a cell belongs to it (round-off)


def barycentric(mesh: Mesh, cell: Ints, x: Floats) -> Floats:
    """Barycentric coordinates `(k, d + 1)` of points `(k, d)` in the given cells `(k,)`."""
    from_first = x - mesh.points[mesh.cells[cell, 0]]
    rest = np.einsum("kid,kd->ki", mesh.gradient[cell, 1:], from_first)
    return np.concatenate([1 - rest.sum(axis=1, keepdims=True), rest], axis=1)


def locate(mesh: Mesh, x: Floats) -> tuple[Ints, Floats]:
    """Cell of each point `(k,)`, -1 outside, and its barycentric coordinates `(k, d + 1)`.

    Candidates are taken by the distance of their centroids, among cells of like size, more and
    more of them until no cell farther away could still reach the point.
    """
    x = np.atleast_2d(np.asarray(x, dtype=float))
    cell = np.full(len(x), -1, dtype=np.int64)
    bary = np.zeros((len(x), mesh.dim + 1))
    boxed = ((x >= mesh.lower) & (x <= mesh.upper)).all(axis=1)
    for number, tree, reach in mesh.cell_classes:
        open_points = np.nonzero((cell < 0) & boxed)[0]
        count, seen = 8, 0
        while len(open_points) and seen < len(number):
            count = min(count, len(number))
            distance, near = tree.query(x[open_points], k=np.arange(seen + 1, count + 1))
            n_new = near.shape[1]
            flat = number[near.ravel()]
            trial = barycentric(mesh, flat, np.repeat(x[open_points], n_new, axis=0))
            inside = (trial.min(axis=1) >= -_TOLERANCE).reshape(-1, n_new)
            hit = inside.any(axis=1)
            pick = np.argmax(inside, axis=1)
            rows = np.nonzero(hit)[0]
            cell[open_points[rows]] = number[near[rows, pick[rows]]]
            bary[open_points[rows]] = trial.reshape(-1, n_new, mesh.dim + 1)[rows, pick[rows]]
            open_points = open_points[~hit & (distance[:, -1] <= reach)]
            seen, count = count, 4 * count
    return cell, bary


def contains(mesh: Mesh, x: Floats) -> Bools:
    """Which points lie in the body."""
    return locate(mesh, x)[0] >= 0


def cells_at(mesh: Mesh, x: Floats) -> Ints:
    """Cell of each point `(k,)`; the nearest where none has it."""
    cell, _ = locate(mesh, x)
    if (cell < 0).any():
        _, nearest = mesh.cell_tree.query(x[cell < 0])
        cell = np.array(cell)
        cell[cell < 0] = nearest
    return cell


def cell_sizes(mesh: Mesh, x: Floats) -> Floats:
    """Size of the cell at each point `(k,)`, length; of the nearest cell where none has it."""
    return np.asarray(mesh.cell_size[cells_at(mesh, x)])


def cell_extents(mesh: Mesh, x: Floats, direction: Floats) -> Floats:
    """Extent of the cell at each point `(k, d)` along a unit vector `(k, d)`: `(k,)`, length."""
    corners = mesh.points[mesh.cells[cells_at(mesh, x)][:, : mesh.dim + 1]]
    return np.asarray(np.ptp(np.einsum("kid,kd->ki", corners, direction), axis=1))


def nearest_boundary(mesh: Mesh, x: Floats) -> tuple[float, float]:
    """Distance of one point to the boundary, and the size of the cell there."""
    facets = mesh.boundary
    tree = mesh.boundary_tree
    first, _ = tree.query(x)
    near = tree.query_ball_point(x, first + float(mesh.cell_size.max()))
    distance = distance_to_simplices(np.asarray(x, dtype=float), mesh.points[facets[near]])
    best = int(np.argmin(distance))
    corners = mesh.points[facets[near[best]]]
    size = np.linalg.norm(corners[:, None] - corners[None], axis=-1).max()
    return float(distance[best]), float(size)


def parts_inside(mesh: Mesh, polyline: Floats) -> list[Floats]:
    """Parts of each piece of a 2D polyline that lie in the body.

    Parameters
    ----------
    mesh : Mesh
    polyline : (p, 2) array, length

    Returns
    -------
    list of (k, 2) arrays, one a piece
        Where each part begins and ends, as shares of the piece.
    """
    corner = mesh.points[mesh.boundary]
    q, s = corner[:, 0], corner[:, 1] - corner[:, 0]
    parts = []
    for p, r in zip(polyline, np.diff(polyline, axis=0)):
        cross = r[0] * s[:, 1] - r[1] * s[:, 0]
        gap = q - p
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            t = (gap[:, 0] * s[:, 1] - gap[:, 1] * s[:, 0]) / cross
            u = (gap[:, 0] * r[1] - gap[:, 1] * r[0]) / cross
        hits = t[(cross != 0) & (u >= 0) & (u <= 1) & (t > 0) & (t < 1)]
        ends = np.concatenate([[0.0], np.sort(hits), [1.0]])
        pairs = np.stack([ends[:-1], ends[1:]], axis=1)
        parts.append(pairs[contains(mesh, p + pairs.mean(axis=1)[:, None] * r)])
    return parts


def cells_within(mesh: Mesh, x: Floats, radius: float) -> Ints:
    """Cells of a 2D mesh that come nearer to a point outside them than a radius.

    A cell that contains the point is among them only if its sides are near enough.
    """
    parts = []
    for number, tree, reach in mesh.cell_classes:
        near = number[np.sort(np.array(tree.query_ball_point(x, radius + reach), dtype=np.int64))]
        corners = mesh.points[mesh.cells[near]]
        sides = [corners[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]
        distance = np.min([distance_to_simplices(x, side) for side in sides], axis=0)
        parts.append(near[distance <= radius])
    return np.concatenate(parts)
