"""Cracks in 3D: flat ones by their outline, others by their triangles."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import (
    Array,
    FileName,
    Length,
    Points,
    Whole,
    check_arguments,
)
from xcrack.base.arrays import Floats, Ints, at
from xcrack.base.checks import LARGEST, numbers, point_coordinates, whole_numbers
from xcrack.base.errors import GeometryError
from xcrack.base.units import NUMBER
from xcrack.crack.crack import Crack
from xcrack.mesh.files import read_triangles
from xcrack.mesh.polygon import ear_clipped, self_crossing
from xcrack.mesh.triangulation import face_areas, oriented_faces, rim, side_keys

_FLAT = 1e-9  # share of its size by which a plane polygon may leave its plane
_FEWEST, _MOST = 8, 100_000  # boundary points of a disc

Place = Annotated[ArrayLike, Points((3,))]
_Vector = Annotated[ArrayLike, Points((3,), unit=NUMBER)]
_Count = Annotated[int, Whole(least=_FEWEST, most=_MOST)]


@check_arguments(GeometryError)
def penny_crack(center: Place, normal: _Vector, radius: Length, *, n: _Count = 128) -> Crack:
    """Circular 3D crack.

    Parameters
    ----------
    center : (3,) array, length
    normal : (3,) array
        Points from lip - to lip +; need not have unit length.
    radius : float, length
    n : int
        Points on the circle. With 128 the polygon stays within 3e-4 of the radius of it.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        A normal without direction.

    Examples
    --------
    >>> penny_crack((0, 0, 0), (0, 0, 1), 2.0, n=32).dim
    3
    """
    middle, z = np.asarray(center), _unit(np.asarray(normal), "the normal of the penny crack")
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(np.cross(z, x), z)
    x /= np.linalg.norm(x)
    return _disc(middle, x * radius, np.cross(z, x) * radius, n)


@check_arguments(GeometryError)
def elliptic_crack(
    center: Place, normal: _Vector, axis: _Vector, a: Length, b: Length, *, n: _Count = 128
) -> Crack:
    """Elliptic 3D crack.

    Parameters
    ----------
    center : (3,) array, length
    normal : (3,) array
        Points from lip - to lip +; need not have unit length.
    axis : (3,) array
        Direction of the half-axis a; its part along the normal does not count.
    a, b : float, length
        Half-axes along `axis` and across it.
    n : int
        Points on the ellipse, denser where it is more curved.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        A normal without direction, an axis along the normal.

    Examples
    --------
    >>> elliptic_crack((0, 0, 0), (0, 0, 1), (1, 0, 0), 2.0, 1.0).dim
    3
    """
    middle, axis_vector = np.asarray(center), np.asarray(axis)
    z = _unit(np.asarray(normal), "the normal of the elliptic crack")
    axis_in_plane = axis_vector - (axis_vector @ z) * z
    if not np.linalg.norm(axis_in_plane) > 1e-9 * np.linalg.norm(axis_vector):
        raise GeometryError(
            f"the axis {axis_vector.tolist()} of the elliptic crack runs along its normal or is "
            "zero: give the direction of the half-axis a, which lies in the plane of the crack."
        )
    x = axis_in_plane / np.linalg.norm(axis_in_plane)
    y = np.cross(z, x)
    return _disc(middle, x * a, y * b, n)


def _disc(center: Floats, first_axis: Floats, second_axis: Floats, n: int) -> Crack:
    """Disc spanned by two conjugate half-axes, in rings whose points become half as many."""
    rings = [(n, 1.0)]
    while rings[-1][0] % 2 == 0 and rings[-1][0] >= 2 * _FEWEST:
        count, radius = rings[-1]
        side = 2 * np.pi * radius / count
        # The inner side is twice as long as the outer one, the height between both.
        inner_radius = max(radius - 1.4 * side, radius / 2)
        rings.append((count // 2, inner_radius))
    points, faces = [], []
    begin = 0
    for k, (count, radius) in enumerate(rings):
        turns = np.arange(count) / count
        points.append(
            center
            + radius * _cosine(turns)[:, None] * first_axis
            + radius * _cosine(turns - 0.25)[:, None] * second_axis
        )
        i = np.arange(count)
        ring = begin + i
        if k == len(rings) - 1:
            middle = np.full(count, begin + count)
            faces.append(np.stack([ring, begin + (i + 1) % count, middle], axis=1))
        else:
            half = np.arange(count // 2)
            inner_now = begin + count + half
            inner_next = begin + count + (half + 1) % (count // 2)
            even_points, odd_points = ring[::2], ring[1::2]
            next_even = np.roll(even_points, -1)
            faces.append(np.stack([even_points, odd_points, inner_now], axis=1))
            faces.append(np.stack([odd_points, inner_next, inner_now], axis=1))
            faces.append(np.stack([odd_points, next_even, inner_next], axis=1))
        begin += count
    points.append(center[None])
    return Crack(np.concatenate(points), np.concatenate(faces))


def _cosine(turns: Floats) -> Floats:
    """Cosine of an angle in full turns, such that mirrored points mirror to the last bit."""
    part = np.mod(turns, 1.0)
    part = np.minimum(part, 1 - part)
    is_second_half = part > 0.25
    value = np.cos(2 * np.pi * np.where(is_second_half, 0.5 - part, part))
    return np.where(part == 0.25, 0.0, np.where(is_second_half, -value, value))


@check_arguments(GeometryError)
def plane_crack(polygon: Annotated[ArrayLike, Points((None, 3))]) -> Crack:
    """Flat 3D crack bounded by a polygon.

    Edges inside the body become its front as soon as it is put into a mesh, edges outside or
    within half a cell of the boundary its mouth; corners of the front are rounded there.

    Parameters
    ----------
    polygon : (m, 3) array, length
        Corners in order; seen from the side of lip + they run counter-clockwise. Need not be
        convex.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        Fewer than three corners, corners that coincide, a polygon that is not plane (to
        1e-9 of its size), has no area or crosses itself.

    Examples
    --------
    >>> plane_crack([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    Crack(4 points, 2 faces, not placed)
    """
    x = np.asarray(polygon)
    if len(x) < 3:
        raise GeometryError(f"a plane crack needs at least three corners (m, 3), not {len(x)}.")
    size = float(np.linalg.norm(np.ptp(x, axis=0)))
    length = np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1)
    if (length <= 1e-12 * size).any():
        i = int(np.argmin(length))
        raise GeometryError(
            f"corners {i} and {(i + 1) % len(x)} of the plane crack both lie at {x[i].tolist()}: "
            "leave one out (the first corner is not repeated at the end)."
        )
    offset = x - x.mean(axis=0)
    vector = np.cross(offset, np.roll(offset, -1, axis=0)).sum(axis=0)
    if np.linalg.norm(vector) <= 1e-12 * size**2:
        raise GeometryError(
            f"the plane crack at {at(x[0])} has no area: its corners lie on a "
            "line, or the polygon crosses itself; give them in order around the crack."
        )
    normal = vector / np.linalg.norm(vector)
    height = offset @ normal
    if np.abs(height).max() > _FLAT * size:
        i = int(np.argmax(np.abs(height)))
        raise GeometryError(
            f"corner {i} at {x[i].tolist()} lies {abs(height[i]):.4g} off the plane of the others; "
            f"{_FLAT * size:.4g} is allowed. Use surface_crack for a crack that is not plane."
        )
    first_axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first_axis = np.cross(np.cross(normal, first_axis), normal)
    first_axis /= np.linalg.norm(first_axis)
    plane_points = np.stack([offset @ first_axis, offset @ np.cross(normal, first_axis)], axis=1)
    crossing = self_crossing(plane_points)
    if crossing is not None:
        i, j = crossing
        raise GeometryError(
            f"sides {i} and {j} of the plane crack meet near {at(x[j])}: give "
            "the corners in order around the crack."
        )
    return Crack(x, ear_clipped(plane_points))


def surface_crack(
    points: Annotated[ArrayLike, Points((None, 3))],
    triangles: Annotated[ArrayLike, Array((None, 3), is_whole=True)],
) -> Crack:
    """3D crack along a triangulated surface, in one or several pieces.

    Faces are turned so that neighbours agree; the first face of each piece decides where lip + is
    (on the side from which its points run counter-clockwise).

    Parameters
    ----------
    points : (p, 3) array, length
        Points that no triangle uses are dropped.
    triangles : (f, 3) array of int
        Point numbers of each triangle.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        Wrong shapes, nan, point numbers out of range, triangles without area, sides with more
        than two triangles, pieces that touch in a point only, a one-sided (Möbius) or a closed
        surface.

    Examples
    --------
    >>> surface_crack([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)], [(0, 1, 2), (0, 3, 2)])
    Crack(4 points, 2 faces, not placed)
    """
    label = "surface_crack: points"
    x = numbers(points, label, (None, 3), must_be_finite=False, error=GeometryError)
    faces = whole_numbers(triangles, "surface_crack: triangles", error=GeometryError)
    if not faces.size:
        raise GeometryError("a surface crack needs triangles (f, 3), and there are none.")
    faces = whole_numbers(faces, "surface_crack: triangles", (None, 3), error=GeometryError)
    if faces.min() < 0 or faces.max() >= len(x):
        face = int(np.argmax(((faces < 0) | (faces >= len(x))).any(axis=1)))
        raise GeometryError(
            f"triangle {face} {faces[face].tolist()} of the surface crack names a point outside "
            f"0 ... {len(x) - 1}: points are numbered from 0."
        )
    used_points, inverse = np.unique(faces, return_inverse=True)
    x, faces = x[used_points], inverse.reshape(-1, 3)
    if not np.isfinite(x).all():
        face = int(used_points[np.argmax(~np.isfinite(x).all(axis=1))])
        raise GeometryError(f"point {face} of the surface crack is not finite: give it.")
    x = point_coordinates(x, label, (None, 3), error=GeometryError)
    _check_shape(x, faces)
    new_faces = oriented_faces(faces)
    if new_faces is None:
        raise GeometryError(
            "the surface crack has only one side (a Möbius strip): cut it open, so that lip + and "
            "lip - can be distinguished."
        )
    edges, _ = rim(new_faces)
    if not len(edges):
        raise GeometryError(
            f"the surface crack around {at(x.mean(axis=0))} is closed: it would "
            "cut a piece out of the body and has no front."
        )
    starts = np.bincount(edges[:, 0], minlength=len(x))
    if starts.max() > 1:
        raise GeometryError(
            f"pieces of the surface crack touch at {x[int(np.argmax(starts))].tolist()} in a point "
            "only: join them along a side, or move them apart."
        )
    return Crack(x, new_faces)


def _check_shape(x: Floats, faces: Ints) -> None:
    corner = x[faces]
    longest_side = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    is_thin = face_areas(x, faces) <= 1e-10 * longest_side**2
    if is_thin.any():
        face = int(np.argmax(is_thin))
        raise GeometryError(
            f"triangle {face} of the surface crack at {at(corner[face][0])} has no "
            f"area ({int(is_thin.sum())} such triangles): remove it or merge its points."
        )
    key, count = np.unique(side_keys(faces), return_counts=True)
    if count.max() > 2:
        i, j = divmod(int(key[np.argmax(count)]), int(faces.max()) + 1)
        raise GeometryError(
            f"{int(count.max())} triangles meet at the side from {x[i].tolist()} to "
            f"{x[j].tolist()}: a crack must not branch; describe the branches as cracks of their "
            "own that end before they meet."
        )


@check_arguments()
def read_surface(path: FileName) -> Crack:
    """Read a 3D crack from a file with triangles.

    Parameters
    ----------
    path : path
        File in a format of meshio, chosen by its extension: ``.stl``, ``.obj``, ``.vtk``, ``.msh``
        ... Points that coincide (every STL has them) are merged; other cells than triangles do
        not count.

    Returns
    -------
    Crack

    Raises
    ------
    XcrackError
        The file is missing or cannot be read.
    GeometryError
        It has no triangles, or not such as `surface_crack` takes.
    """
    return surface_crack(*_merged_points(*read_triangles(path)))


def _merged_points(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Points within 1e-7 of the size of the surface made one; triangles that collapse dropped."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    used_points = np.unique(triangles)
    if not (np.abs(points[used_points]) <= LARGEST).all():
        return points, triangles  # refused by surface_crack
    x = points[used_points]
    # Single precision is what a binary STL stores.
    close_pairs = cKDTree(x).query_pairs(
        1e-7 * float(np.ptp(x, axis=0).max()), output_type="ndarray"
    )
    n = len(x)
    graph = coo_array(
        (np.ones(len(close_pairs)), (close_pairs[:, 0], close_pairs[:, 1])), shape=(n, n)
    )
    group = connected_components(graph, directed=False)[1]
    _, first = np.unique(group, return_index=True)
    place = np.zeros(len(points), dtype=np.int64)
    place[used_points] = group
    faces = place[triangles]
    is_proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return x[first], faces[is_proper]


def _unit(vector: Floats, label: str) -> Floats:
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise GeometryError(f"{label} is zero: give the direction from lip - to lip +.")
    return np.asarray(vector / length)
