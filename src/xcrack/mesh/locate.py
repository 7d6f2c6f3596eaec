"""Where points lie in a mesh."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.mesh.distances import TriangleTree, closest_in, closest_on_segment, signed_in
from xcrack.mesh.mesh import Mesh, nearest_nodes

_CROSSINGS = 1_000_000  # pairs of a piece and a boundary facet that are looked at at once
_WHOLE = lock(np.array([0.0, 1.0]))
_AT_NODE = 1e-6  # of a cell: a point this close to a node is there
_TOLERANCE = 1e-10  # barycentric; a point this close to a cell belongs to it (round-off)


def barycentric(mesh: Mesh, cell: Ints, x: Floats) -> Floats:
    """Barycentric coordinates `(k, d + 1)` of points `(k, d)` in the given cells `(k,)`."""
    from_first = x - mesh.points[mesh.cells[cell, 0]]
    last_coordinates = np.einsum("kid,kd->ki", mesh.gradient[cell, 1:], from_first)
    return np.concatenate(
        [1 - last_coordinates.sum(axis=1, keepdims=True), last_coordinates], axis=1
    )


def points_at(mesh: Mesh, cell: Ints, bary: Floats) -> Floats:
    """Points `(k, d)` at places in cells `(k,)`: what `barycentric` undoes."""
    return np.einsum("kv,kvd->kd", bary, mesh.points[mesh.cells[cell]])


def locate(mesh: Mesh, x: Floats) -> tuple[Ints, Floats]:
    """Cell of each point `(k,)`, -1 outside, and its barycentric coordinates `(k, d + 1)`.

    Of several cells that a point belongs to, it is the one with the nearest centroid.
    """
    from xcrack.mesh.kernels.location import locate_points

    # A copy: kernels are compiled for read-only arrays anew.
    x = np.array(x, dtype=float, order="C", ndmin=2)
    cell, bary = locate_points(
        mesh.points, mesh.cells, mesh.gradient, *mesh.cell_grid, x, _TOLERANCE
    )
    cell[~((x >= mesh.lower) & (x <= mesh.upper)).all(axis=1)] = -1  # nan too
    return cell, bary


def contains(mesh: Mesh, x: Floats) -> Bools:
    """Which points lie in the body."""
    return locate(mesh, x)[0] >= 0


def places_in_body(mesh: Mesh, x: Floats, label: str) -> tuple[Ints, Floats]:
    """A cell of each point `(k,)`, and barycentric coordinates of the place nearest to it there.

    Points next to a mesh point or the middle of an edge are there exactly; those beside the body
    are taken to the nearest place of its boundary.

    Parameters
    ----------
    mesh : Mesh
    x : (k, d) array, length
    label : str
        For messages.

    Raises
    ------
    ProblemError
        Other numbers of coordinates; a point that is more than a cell away from the body.
    """
    nodes = nearest_nodes(mesh, x, label)
    cell, bary = locate(mesh, x)
    rows = np.nonzero(cell < 0)[0]
    if len(rows):
        cell[rows], feet = nearest_on_boundary(mesh, x[rows])
        place = np.maximum(barycentric(mesh, cell[rows], feet), 0.0)
        bary[rows] = place / place.sum(axis=1, keepdims=True)
    node_points = np.concatenate([mesh.points, mesh.edge_middles])[nodes]
    is_near = np.linalg.norm(node_points - x, axis=1) <= _AT_NODE * mesh.cell_size[cell]
    is_point = is_near & (nodes < mesh.n_points)
    cell[is_point], bary[is_point] = cells_of_points(mesh, nodes[is_point])
    is_middle = is_near & ~is_point
    if is_middle.any():
        edge = nodes[is_middle] - mesh.n_points
        cell_of_edge = np.empty(len(mesh.edges), dtype=np.int64)
        cell_of_edge[mesh.cell_to_edge] = np.arange(len(mesh.cells))[:, None]
        cell[is_middle] = cell_of_edge[edge]
        corners = mesh.cells[cell[is_middle]]
        bary[is_middle] = (corners[:, :, None] == mesh.edges[edge][:, None]).mean(axis=2)
    return cell, bary


def cells_of_points(mesh: Mesh, number: Ints) -> tuple[Ints, Floats]:
    """A cell of each mesh point `(k,)`, and its barycentric coordinates `(k, d + 1)`."""
    cell_of_point = np.empty(mesh.n_points, dtype=np.int64)
    cell_of_point[mesh.cells] = np.arange(len(mesh.cells))[:, None]
    cell = cell_of_point[number]
    return cell, (mesh.cells[cell] == number[:, None]).astype(float)


def nearest_on_boundary(mesh: Mesh, x: Floats) -> tuple[Ints, Floats]:
    """Cells at the nearest places of the boundary `(k,)`, and these places `(k, d)`."""
    outer_cells = mesh.facet_to_cell[mesh.facet_to_cell[:, 1] < 0, 0]
    if mesh.dim == 3:
        nearest_point = closest_in(mesh.boundary_tree[0], x)
        return outer_cells[nearest_point.triangle], nearest_point.foot
    a, b = mesh.points[mesh.boundary].transpose(1, 0, 2)
    feet = closest_on_segment(x[:, None], a, b)
    row = np.linalg.norm(feet - x[:, None], axis=2).argmin(axis=1)
    return outer_cells[row], feet[np.arange(len(x)), row]


def cells_at(mesh: Mesh, x: Floats) -> Ints:
    """Cell of each point `(k,)`; the nearest where none has it."""
    cell, _ = locate(mesh, x)
    if (cell < 0).any():
        _, nearest_cells = mesh.cell_tree.query(x[cell < 0])
        cell = np.array(cell)
        cell[cell < 0] = nearest_cells
    return cell


def cell_sizes(mesh: Mesh, x: Floats) -> Floats:
    """Size of the cell at each point `(k,)`, length; of the nearest cell where none has it."""
    return np.asarray(mesh.cell_size[cells_at(mesh, x)])


def cell_extents(mesh: Mesh, x: Floats, direction: Floats) -> Floats:
    """Extent of the cell at each point `(k, d)` along a unit vector `(k, d)`: `(k,)`, length."""
    corners = mesh.points[mesh.cells[cells_at(mesh, x)][:, : mesh.dim + 1]]
    return np.asarray(np.ptp(np.einsum("kid,kd->ki", corners, direction), axis=1))


def cells_around(mesh: Mesh, x: Floats, tolerance: float) -> Ints:
    """Cells whose closed set contains one point, with a tolerance in barycentric coordinates."""
    (origin, width, start, member), shape = mesh.cell_grid
    place = np.clip((x - origin) / width, 0, shape - 1).astype(np.int64)
    number = 0
    for j, side in zip(place.tolist(), shape.tolist()):
        number = number * side + j
    cells = member[start[number] : start[number + 1]].astype(np.int64)
    bary = barycentric(mesh, cells, np.broadcast_to(x, (len(cells), mesh.dim)))
    return cells[bary.min(axis=1) >= -tolerance]


def nearest_boundary(mesh: Mesh, x: Floats) -> tuple[float, float]:
    """Distance of one point to the boundary of a 2D mesh, and the size of the cell there."""
    from xcrack.mesh.kernels.location import nearest_segment

    distance, size = nearest_segment(mesh.points, mesh.boundary, np.array(x))
    return float(distance), float(size)


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
    p, r = polyline[:-1], np.diff(polyline, axis=0)
    pairs, middles = [], []
    chunk = max(_CROSSINGS // max(len(s), 1), 1)
    for first in range(0, len(p), chunk):
        chunk_rows = slice(first, first + chunk)
        x, y = r[chunk_rows, 0, None], r[chunk_rows, 1, None]
        gap_x, gap_y = q[:, 0] - p[chunk_rows, 0, None], q[:, 1] - p[chunk_rows, 1, None]
        cross = x * s[:, 1] - y * s[:, 0]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            t = (gap_x * s[:, 1] - gap_y * s[:, 0]) / cross
            u = (gap_x * y - gap_y * x) / cross
        hit = (cross != 0) & (u >= 0) & (u <= 1) & (t > 0) & (t < 1)
        for k, any_hit in enumerate(hit.any(axis=1)):
            ends = np.concatenate([[0.0], np.sort(t[k, hit[k]]), [1.0]]) if any_hit else _WHOLE
            pairs.append(np.stack([ends[:-1], ends[1:]], axis=1))
            middle = (ends[:-1] + ends[1:]) / 2
            middles.append(p[first + k] + middle[:, None] * r[first + k])
    is_inside = contains(mesh, np.concatenate(middles))
    cuts = np.cumsum([len(span) for span in pairs])[:-1]
    return [
        span[chunk_rows] for span, chunk_rows in zip(pairs, np.split(is_inside, cuts), strict=True)
    ]


def cells_within(mesh: Mesh, x: Floats, radius: float) -> Ints:
    """Cells of a 2D mesh that come nearer to a point outside them than a radius.

    A cell that contains the point is among them only if its sides are near enough.
    """
    from xcrack.mesh.kernels import location

    x = np.ascontiguousarray(x)
    return np.asarray(location.cells_within(mesh.points, mesh.cells, x, radius))


# The body that a 3D mesh fills: how deep points lie in it, and how large its cells are.

ON = 1e-9  # share of a cell within which a point lies on the boundary


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh and the search tree of its boundary."""

    mesh: Mesh
    boundary: TriangleTree
    facet_size: Floats

    @staticmethod
    def of(mesh: Mesh) -> "Body":
        """The body that a mesh fills."""
        return Body(mesh, *mesh.boundary_tree)

    def depth(self, x: Floats) -> tuple[Floats, Floats]:
        """Distance to the boundary, negative inside, and the size of the facet there."""
        distance, facet, _ = signed_in(self.boundary, x)
        return distance, self.facet_size[facet]

    def contains(self, x: Floats) -> Bools:
        """Which points lie in the body, its boundary included."""
        distance, size = self.depth(x)
        return np.asarray(distance <= ON * size)

    def cell_size(self, x: Floats) -> Floats:
        """Size of the cell with the nearest centroid, outside the body as well."""
        return np.asarray(self.mesh.cell_size[self.mesh.cell_tree.query(x)[1]])


__all__ = []
