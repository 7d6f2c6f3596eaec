"""Triangulated surfaces in 3D as arrays: normals, sides, boundary loops, refinement."""

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints

_TWIST = 1e-9  # offset of diagonals over their length, below which a quadrilateral is flat


def unit(vector: Floats) -> Floats:
    """Vectors `(..., d)` divided by their length."""
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))


def face_vectors(points: Floats, faces: Ints) -> Floats:
    """Right-hand normals of length 2 area `(f, 3)`."""
    corner = points[faces]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def face_normals(points: Floats, faces: Ints) -> Floats:
    """Right-hand unit normals `(f, 3)`; zero for a face without area."""
    vector = face_vectors(points, faces)
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    return np.asarray(vector / np.where(length > 0, length, 1.0))


def face_areas(points: Floats, faces: Ints) -> Floats:
    """Areas of the faces `(f,)`."""
    return np.asarray(np.linalg.norm(face_vectors(points, faces), axis=1) / 2)


def sides(faces: Ints) -> Ints:
    """Sides of every face in its own direction, `(f, 3, 2)`: 0-1, 1-2, 2-0."""
    return np.asarray(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2))


def side_keys(faces: Ints) -> Ints:
    """One number a side, the same from both faces `(f, 3)`."""
    pairs = np.sort(sides(faces), axis=2)
    return np.asarray(pairs[..., 0] * (int(faces.max(initial=0)) + 1) + pairs[..., 1])


def on_rim(faces: Ints) -> Bools:
    """Which sides of the faces are boundary `(f, 3)`."""
    _, inverse, count = np.unique(side_keys(faces), return_inverse=True, return_counts=True)
    return np.asarray(count[inverse.reshape(-1, 3)] == 1)


def rim(faces: Ints) -> tuple[Ints, Ints]:
    """Boundary sides in the direction of their faces `(k, 2)`, and these faces `(k,)`."""
    is_rim = on_rim(faces)
    return sides(faces)[is_rim], np.nonzero(is_rim)[0]


def loops(faces: Ints) -> list[Ints]:
    """Boundary loops against the direction of the faces, the first point not repeated.

    This is the direction of b = t x n where t points out of the surface. A loop starts at its
    lowest point number. Loops that touch in a point are loops of their own.
    """
    faces, original_numbers = _parted_at_points(faces)
    edges, _ = rim(faces)
    follower = {int(b): int(a) for a, b in edges}
    result = []
    while follower:
        start = min(follower)
        loop = [start]
        vertex = follower.pop(start)
        while vertex != start:
            loop.append(vertex)
            vertex = follower.pop(vertex)
        number = original_numbers[np.array(loop, dtype=np.int64)]
        result.append(np.roll(number, -int(np.argmin(number))))
    return result


def _parted_at_points(faces: Ints) -> tuple[Ints, Ints]:
    """Faces that share no more than a point parted there, and the numbers of points before."""
    edges, _ = rim(faces)
    count = int(faces.max()) + 1 if len(faces) else 0
    original_numbers = list(range(count))
    pinched_points = np.nonzero(np.bincount(edges[:, 0], minlength=count) > 1)[0]
    if not len(pinched_points):
        return faces, np.arange(count)
    parted_faces = np.array(faces)
    for point in pinched_points.tolist():
        faces_around, corner = np.nonzero(faces == point)
        neighbours = np.stack([faces[faces_around, (corner + k) % 3] for k in (1, 2)], axis=1)
        part = np.unique(neighbours, return_inverse=True)[1].reshape(-1, 2)
        for _ in range(len(faces_around)):
            np.minimum.at(lowest_part := np.arange(part.max() + 1), part, part.min(axis=1)[:, None])
            part = lowest_part[part]
        for part_number in np.unique(part[:, 0])[1:]:
            is_of_part = part[:, 0] == part_number
            parted_faces[faces_around[is_of_part], corner[is_of_part]] = len(original_numbers)
            original_numbers.append(point)
    return parted_faces, np.array(original_numbers, dtype=np.int64)


def ruled_strip(
    n_points: int,
    base: Ints,
    origin: Floats,
    offset: Floats,
    layers: int,
    is_closed: bool,
    is_crossed: bool = False,
) -> tuple[Floats, Ints]:
    """Strip of triangles on one side of a polyline, spanned by a ray from each of its points.

    Parameters
    ----------
    n_points : int
        Number that the first new point gets.
    base : (m,) array of int
        Point numbers of the polyline in the direction of a front; a repeated one makes a fan.
    origin, offset : (m, 3) arrays, length
        Points of the polyline and the rays; a ray of zero length adds no points.
    layers : int
        Rows of triangles.
    is_closed : bool
        Whether the last ray is joined with the first.
    is_crossed : bool
        Whether quadrilaterals that are twisted or turn over are divided by both diagonals: one
        alone would make the strip depend on its direction.

    Returns
    -------
    points : (q, 3) array, length
        New points.
    faces : (k, 3) array of int
        Oriented like a surface whose front the polyline is.
    """
    grid = np.repeat(base[:, None], layers + 1, axis=1)
    long_lines = np.nonzero(np.abs(offset).max(axis=1) > 0)[0]
    share = np.arange(1, layers + 1) / layers
    grid[long_lines, 1:] = n_points + np.arange(len(long_lines) * layers).reshape(-1, layers)
    points = origin[long_lines, None] + share[:, None] * offset[long_lines, None]
    first = grid if is_closed else grid[:-1]
    next_line = np.roll(grid, -1, axis=0) if is_closed else grid[1:]
    corners = [first[:, :-1], next_line[:, :-1], next_line[:, 1:], first[:, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    points, middles = points.reshape(-1, 3), np.zeros((0, 3), dtype=np.int64)
    if is_crossed:
        x = np.zeros((n_points + len(points), 3))
        x[base], x[n_points:] = origin, points
        is_quad = (a != b) & (c != d) & ~_is_flat(x[a], x[b], x[c], x[d])
        quads = np.stack([a, b, c, d], axis=1)[is_quad]
        a, b, c, d = (corner[~is_quad] for corner in (a, b, c, d))
        middle = n_points + len(points) + np.arange(len(quads))
        sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2)
        middles = np.concatenate(
            [sides, np.broadcast_to(middle[:, None, None], (len(quads), 4, 1))], axis=2
        ).reshape(-1, 3)
        points = np.concatenate([points, x[quads].mean(axis=1)])
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=1)
    faces = np.concatenate([faces.reshape(-1, 3), middles])
    is_proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return points, faces[is_proper]


def _is_flat(a: Floats, b: Floats, c: Floats, d: Floats) -> Bools:
    """Whether either diagonal divides a quadrilateral into the same area: convex, without twist."""
    normal = np.cross(c - a, d - b)
    twist = np.abs(np.einsum("ij,ij->i", b - a, normal))
    halves = [np.cross(q - p, r - p) for p, q, r in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))]
    is_convex = np.all([np.einsum("ij,ij->i", half, normal) > 0 for half in halves], axis=0)
    return np.asarray(is_convex & (twist <= _TWIST * np.linalg.norm(normal, axis=1) ** 1.5))


def split_sides(points: Floats, faces: Ints, is_marked: Bools) -> tuple[Floats, Ints]:
    """Halve the marked sides `(f, 3)` and what must go with them, without hanging points.

    A face is cut through its longest side first (Rivara, 1984), so that angles stay bounded.
    """
    key, inverse = np.unique(side_keys(faces), return_inverse=True)
    inverse = inverse.reshape(-1, 3)
    pairs = np.zeros((len(key), 2), dtype=np.int64)
    pairs[inverse.ravel()] = np.sort(sides(faces), axis=2).reshape(-1, 2)
    length = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1)
    number_of_longest = np.argmax(length[inverse] * (1 - 1e-12 * np.arange(3)), axis=1)
    longest_side = inverse[np.arange(len(faces)), number_of_longest]
    cut = np.zeros(len(key), dtype=bool)
    cut[inverse[is_marked]] = True
    while True:
        is_pulled = cut[inverse].any(axis=1) & ~cut[longest_side]
        if not is_pulled.any():
            break
        cut[longest_side[is_pulled]] = True
    number = np.full(len(key), -1)
    number[cut] = len(points) + np.arange(int(cut.sum()))
    middle = (points[pairs[cut, 0]] + points[pairs[cut, 1]]) / 2
    # Turned so that the longest side is the first one of every face.
    column = (number_of_longest[:, None] + np.arange(3)) % 3
    corner = np.take_along_axis(faces, column, axis=1)
    centre = number[np.take_along_axis(inverse, column, axis=1)]
    (a, b, c), (ab, bc, ca) = corner.T, centre.T
    is_whole, is_from_b, is_from_c = ab < 0, bc >= 0, ca >= 0
    parts = [
        faces[is_whole],
        np.stack([b, c, ab], axis=1)[~is_whole & ~is_from_b],
        np.stack([b, bc, ab], axis=1)[~is_whole & is_from_b],
        np.stack([bc, c, ab], axis=1)[~is_whole & is_from_b],
        np.stack([c, a, ab], axis=1)[~is_whole & ~is_from_c],
        np.stack([c, ca, ab], axis=1)[~is_whole & is_from_c],
        np.stack([ca, a, ab], axis=1)[~is_whole & is_from_c],
    ]
    return np.concatenate([points, middle]), np.concatenate(parts)


def components(faces: Ints) -> Ints:
    """Number of the connected piece of each face `(f,)`, joined by common sides."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, inverse = np.unique(side_keys(faces), return_inverse=True)
    edges = inverse.ravel()
    face = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(edges, kind="stable")
    same_edge = edges[order][1:] == edges[order][:-1]
    a, b = face[order][:-1][same_edge], face[order][1:][same_edge]
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(faces),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def oriented_faces(faces: Ints) -> Ints | None:
    """Faces turned so that neighbours agree, the first of each piece as it is; None: one-sided."""
    _, inverse = np.unique(side_keys(faces), return_inverse=True)
    edges = inverse.ravel()
    pairs = sides(faces).reshape(-1, 2)
    is_forward = pairs[:, 0] < pairs[:, 1]
    order = np.argsort(edges, kind="stable")
    same_edge = edges[order][1:] == edges[order][:-1]
    a, b = order[:-1][same_edge], order[1:][same_edge]
    differ = is_forward[a] == is_forward[b]
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in faces]
    for i, j, turn in zip(a // 3, b // 3, differ, strict=True):
        neighbours[i].append((int(j), bool(turn)))
        neighbours[j].append((int(i), bool(turn)))
    sense = np.full(len(faces), -1)
    for start in range(len(faces)):
        if sense[start] >= 0:
            continue
        sense[start] = 0
        queue = [start]
        while queue:
            i = queue.pop()
            for j, turn in neighbours[i]:
                target_turn = int(sense[i]) ^ int(turn)
                if sense[j] < 0:
                    sense[j] = target_turn
                    queue.append(j)
                elif sense[j] != target_turn:
                    return None
    return np.where(sense[:, None] == 1, faces[:, ::-1], faces)
