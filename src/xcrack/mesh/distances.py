"""Exact distances: to segments and triangles; in 3D to surfaces, with a sign, and to polylines."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.machine import map_tasks
from xcrack.mesh.triangulation import face_normals, face_vectors, side_keys

_AT_ONCE = 8192  # points of one task: the same for any number of threads
_EQUAL = 1e-14  # share of the surface's extent below which two distances are the same


def distance_to_simplices(x: Floats, corners: Floats) -> Floats:
    """Distance of one or k points to segments `(k, 2, d)` or triangles `(k, 3, d)`."""
    a, b = corners[:, 0], corners[:, 1]
    if corners.shape[1] == 2:
        return np.linalg.norm(x - closest_on_segment(x, a, b), axis=1)
    c = corners[:, 2]
    normal = np.cross(b - a, c - a)
    area = np.einsum("kd,kd->k", normal, normal)
    v = np.einsum("kd,kd->k", np.cross(b - a, x - a), normal) / area
    w = np.einsum("kd,kd->k", np.cross(x - a, c - a), normal) / area
    is_inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    plane = np.abs(np.einsum("kd,kd->k", x - a, normal)) / np.sqrt(area)
    edges = np.min(
        [
            np.linalg.norm(x - closest_on_segment(x, p, q), axis=1)
            for p, q in ((a, b), (b, c), (c, a))
        ],
        axis=0,
    )
    return np.where(is_inside, plane, edges)


def closest_on_segment(x: Floats, a: Floats, b: Floats) -> Floats:
    """Closest points on segments a b `(..., d)` to x."""
    edge = b - a
    square = np.maximum((edge * edge).sum(axis=-1), 1e-300)
    t = np.clip(((x - a) * edge).sum(axis=-1) / square, 0, 1)
    return np.asarray(a + t[..., None] * edge)


@dataclass(frozen=True, eq=False)
class NearestPoint:
    """Closest points of a triangulated surface.

    Attributes
    ----------
    distance : (n,) array, length
        Without a sign; the band where nothing is nearer.
    triangle : (n,) array of int
        -1 where nothing lies in the band.
    part : (n,) array of int
        0 the face, 1 ... 3 a corner, 4 ... 6 the edge from corner 0, 1, 2 to the next.
    foot : (n, d) array, length
        The closest points.
    """

    distance: Floats
    triangle: Ints
    part: Ints
    foot: Floats


@dataclass(frozen=True, eq=False)
class TriangleTree:
    """Tree of boxes around the triangles of a surface, to find closest points again and again.

    Attributes
    ----------
    corners : (k, 3, 3) array, length
    normal : (k, 3) array
        Unit normals.
    feature_normals : (k, 6, 3) array
        Normals at the corners 0, 1, 2 and at the sides 0-1, 1-2, 2-0, of any length.
    rim : (k, 6) array of bool
        Which corners and sides lie on the boundary of the surface.
    boxes : tuple of arrays
        As `kernels.triangles.box_tree` makes them.
    distance_tolerance : float, length
        Distances that differ by less are equal.
    """

    corners: Floats
    normal: Floats
    feature_normals: Floats
    rim: Bools
    boxes: tuple[Ints, Ints, Floats, Floats]
    distance_tolerance: float


def triangle_tree(points: Floats, triangles: Ints) -> TriangleTree:
    """Search tree of a triangulated surface of at least one triangle."""
    from xcrack.mesh.kernels.triangles import box_tree

    corners = np.ascontiguousarray(points[triangles])
    tolerance = _EQUAL * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    boxes = box_tree(corners.min(axis=1), corners.max(axis=1))
    normal = face_normals(points, triangles)
    edge_normals, rim = _pseudo_normals(points, triangles, normal)
    return TriangleTree(corners, normal, edge_normals, rim, boxes, tolerance)


def _pseudo_normals(points: Floats, triangles: Ints, normal: Floats) -> tuple[Floats, Bools]:
    """Normals at the corners and sides of each triangle, and which lie on the boundary."""
    _, inverse, count = np.unique(side_keys(triangles), return_inverse=True, return_counts=True)
    inverse = inverse.reshape(-1, 3)
    total = np.zeros((len(count), 3))
    for d in range(3):
        total[:, d] = np.bincount(inverse.ravel(), np.repeat(normal[:, d], 3), len(count))
    rim_side = count[inverse] == 1
    rim_point = np.zeros(len(points), dtype=bool)
    for side in range(3):
        for end in (side, (side + 1) % 3):
            rim_point[triangles[rim_side[:, side], end]] = True
    at_corner = corner_normals(points, triangles, normal)[triangles]
    edge_normals = np.concatenate([at_corner, total[inverse]], axis=1)
    return edge_normals, np.concatenate([rim_point[triangles], rim_side], axis=1)


def closest_in(tree: TriangleTree, x: Floats, band: float = np.inf) -> NearestPoint:
    """Closest point of a surface for each point `(n, 3)`; nothing is sought beyond the band."""
    from xcrack.mesh.kernels.triangles import closest_triangle

    # A copy is never read-only, for which the kernel would be compiled once more.
    points = np.array(x, dtype=float, order="C")
    arrays = _in_parts(
        closest_triangle,
        points,
        tree.corners,
        tree.normal,
        *tree.boxes,
        float(band),
        tree.distance_tolerance,
    )
    return NearestPoint(*arrays)


def _in_parts(kernel: Callable[..., Any], x: Floats, *arguments: Any) -> tuple[Any, ...]:
    """What a kernel returns for points, threads taking some of the points each."""

    def part(first: int) -> tuple[Any, ...]:
        return tuple(kernel(x[first : first + _AT_ONCE], *arguments))

    parts = map_tasks(part, range(0, max(len(x), 1), _AT_ONCE))
    return tuple(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def signed_in(tree: TriangleTree, x: Floats, band: float = np.inf) -> tuple[Floats, Ints, Bools]:
    """What `surface_distance` gives, for a surface whose tree is there already."""
    x = np.asarray(x, dtype=float)
    nearest_points = closest_in(tree, x, band)
    phi = np.array(nearest_points.distance)
    on_boundary = np.zeros(len(phi), dtype=bool)
    rows = np.nonzero((nearest_points.triangle >= 0) & (nearest_points.part == 0))[0]
    t = nearest_points.triangle[rows]
    phi[rows] = np.einsum("ij,ij->i", x[rows] - tree.corners[t, 0], tree.normal[t])
    edge = np.nonzero(nearest_points.part > 0)[0]
    t, part = nearest_points.triangle[edge], nearest_points.part[edge] - 1
    side = np.einsum("ij,ij->i", x[edge] - nearest_points.foot[edge], tree.feature_normals[t, part])
    phi[edge] = np.copysign(phi[edge], side)
    on_boundary[edge] = tree.rim[t, part]
    return phi, nearest_points.triangle, on_boundary


def surface_distance(
    x: Floats, points: Floats, triangles: Ints, band: float = np.inf
) -> tuple[Floats, Ints, Bools]:
    """Signed distance of points to a triangulated surface, positive on the side of its normals.

    Above a face it is (x - v) . n, so that points in the plane of a flat crack get zero to
    round-off; the sign beside an edge or a corner comes from the normals of the faces around it,
    weighted by their angles (Bærentzen and Aanæs, 2005).

    Parameters
    ----------
    x : (n, 3) array, length
    points : (p, 3) array, length
        Vertices of the surface.
    triangles : (k, 3) array of int
        Oriented alike; the right-hand normal shows to the positive side.
    band : float, length
        Farther away nothing is sought.

    Returns
    -------
    phi : (n,) array, length
        `band` outside the band.
    triangle : (n,) array of int
        Closest triangle, the lowest number of several; -1 outside the band.
    on_boundary : (n,) array of bool
        The closest point lies on the boundary of the surface.
    """
    if not len(triangles):
        no_triangle = np.full(len(x), -1)
        return np.full(len(x), float(band)), no_triangle, np.zeros(len(x), dtype=bool)
    return signed_in(triangle_tree(points, triangles), x, band)


def corner_normals(points: Floats, triangles: Ints, normal: Floats | None = None) -> Floats:
    """Normals at the points of a surface, weighted by angles, not normalised `(p, 3)`."""
    normal = face_normals(points, triangles) if normal is None else normal
    corners, vector = points[triangles], face_vectors(points, triangles)
    sine = np.sqrt(np.einsum("ij,ij->i", vector, vector))  # the same at each corner, times lengths
    edge = np.roll(corners, -1, axis=1) - corners
    cosine = -np.einsum("kid,kid->ki", edge, np.roll(edge, 1, axis=1))
    angle = np.arctan2(sine[:, None], cosine)
    result = np.empty((len(points), 3))
    for d in range(3):
        share = (angle * normal[:, d : d + 1]).ravel()
        result[:, d] = np.bincount(triangles.ravel(), share, len(points))
    return result


def first_crossing(tree: TriangleTree, start: Floats, stop: Floats) -> tuple[Ints, Floats]:
    """First triangle that each segment crosses `(n,)`, -1: none, and where, in [0, 1]."""
    from xcrack.mesh.kernels.triangles import crossed_triangle

    start, stop = np.array(start, dtype=float, order="C"), np.array(stop, dtype=float, order="C")
    triangle, position = crossed_triangle(start, stop, tree.corners, tree.normal, *tree.boxes)
    return triangle, position


def front_distance(
    x: Floats, polyline: Floats, is_closed: bool, band: float = np.inf
) -> tuple[Floats, Ints, Floats]:
    """Distance of points to a polyline in 3D.

    Parameters
    ----------
    x : (n, 3) array, length
    polyline : (m, 3) array, length
        Distinct points; a closed one does not repeat its first point.
    is_closed : bool
        Whether a last segment leads from the last point to the first.
    band : float, length
        Farther away nothing is sought.

    Returns
    -------
    r : (n,) array, length
        `band` outside the band.
    segment : (n,) array of int
        Segment j leads from point j to the next one; -1 outside the band.
    position : (n,) array
        Place of the closest point along its segment, in [0, 1].
    """
    from xcrack.mesh.kernels.triangles import box_tree, closest_segment

    polyline = np.array(polyline, dtype=float, order="C")
    stop = np.roll(polyline, -1, axis=0)
    start = polyline
    if not is_closed:
        start, stop = np.ascontiguousarray(start[:-1]), np.ascontiguousarray(stop[:-1])
    tree = box_tree(np.minimum(start, stop), np.maximum(start, stop))
    x = np.array(x, dtype=float, order="C")
    r, segment, position = _in_parts(closest_segment, x, start, stop, *tree, float(band))
    return r, segment, position
