"""Frames along the fronts of cracks in space, and the strip that prolongs a crack ahead of them."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints, lock
from xcrack.crack.crack import Crack
from xcrack.geometry.distances import corner_normals
from xcrack.geometry.triangulation import face_normals, rim, ruled, unit
from xcrack.mesh.mesh import Mesh

_FAR = 2.5  # median spacings that still close a front, from its last point to its first
_FAN = np.radians(30.0)  # a front that turns away by more gets rays between


@dataclass(frozen=True, eq=False)
class Front:
    """One front of a crack in space.

    Attributes
    ----------
    x : (m, 3) array, length
        Vertices in the direction of the last row of the frames; of a closed front each once.
    frame : (m, 3, 3) array
        Rows (t ahead, n normal, b = t x n along).
    closed : bool
    s : (m,) array, length
        Arc length from the first vertex.
    number : (m,) array of int
        Point numbers of the crack.
    """

    x: Floats
    frame: Floats
    closed: bool
    s: Floats
    number: Ints


def front_frames(crack: Crack) -> list[Front]:
    """Vertices, frames and arc lengths of the fronts of a placed crack in space.

    b is the tangent of the circle through a vertex and its two neighbours, n the normal of the
    faces around the vertex made perpendicular to b, and t = n x b shows out of the crack.

    Parameters
    ----------
    crack : Crack

    Returns
    -------
    list of Front
    """
    normal = corner_normals(crack.points, crack.faces)
    result = []
    for front in crack.fronts or ():
        closed = bool(front[0] == front[-1])
        number = np.array(front[:-1] if closed else front)
        x = crack.points[number]
        b = _tangents(x, closed)
        n = normal[number]
        n = unit(n - np.einsum("ij,ij->i", n, b)[:, None] * b)
        frame = np.stack([np.cross(n, b), n, b], axis=1)
        length = np.linalg.norm(np.diff(x, axis=0), axis=1)
        s = np.concatenate([[0.0], np.cumsum(length)])
        result.append(Front(lock(x), lock(frame), closed, lock(s), lock(number)))
    return result


def _tangents(x: Floats, closed: bool) -> Floats:
    """Unit tangents of the circles through three points in a row, one-sided at open ends."""
    if closed:
        ahead = np.roll(x, -1, axis=0) - x
        back = np.roll(ahead, 1, axis=0)
    else:
        inner = np.diff(x, axis=0)
        ahead, back = np.concatenate([inner, inner[-1:]]), np.concatenate([inner[:1], inner])
    ahead_length = np.linalg.norm(ahead, axis=1, keepdims=True)
    back_length = np.linalg.norm(back, axis=1, keepdims=True)
    tangent = ahead / ahead_length * back_length + back / back_length * ahead_length
    return unit(tangent)


def is_closed(x: Floats) -> bool:
    """Whether points along a front, each once, go round: the last lies next to the first."""
    if len(x) < 4:
        return False
    spacing = np.linalg.norm(np.diff(x, axis=0), axis=1)
    return bool(np.linalg.norm(x[-1] - x[0]) < _FAR * np.median(spacing))


def front_weights(x: Floats) -> Floats:
    """Share of the length of a front that belongs to each of its points `(m,)`; their sum is 1."""
    if len(x) == 1:
        return np.ones(1)
    along = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if is_closed(x):
        along = np.append(along, np.linalg.norm(x[0] - x[-1]))
        weight = along + np.roll(along, 1)
    else:
        weight = np.append(along, 0.0) + np.append(0.0, along)
    total = float(weight.sum())
    return np.asarray(weight / total if total else np.full(len(x), 1 / len(x)))


@dataclass(frozen=True, eq=False)
class Extended:
    """A crack in space prolonged ahead of its fronts.

    Attributes
    ----------
    points : (p, 3) array, length
        First those of the crack.
    triangles : (k, 3) array of int
        First the faces of the crack.
    label : (k,) array of int
        0 for a face of the crack, f + 1 for the strip ahead of front f.
    """

    points: Floats
    triangles: Ints
    label: Ints


def extended(crack: Crack, mesh: Mesh, width: float) -> Extended:
    """A placed crack with a strip of triangles ahead of each front, tangential to it.

    Where a front is hollow the rays of the strip cross; what would be turned over is left out,
    and parts may lie over each other. Where it is sharp, rays fan out.

    Parameters
    ----------
    crack : Crack
        Placed in the mesh.
    mesh : Mesh
        Its cells give the length of the triangles where the front has long sides.
    width : float, length
        How far the strip reaches.

    Returns
    -------
    Extended
    """
    points, triangles = [crack.points], [crack.faces]
    label = [np.zeros(len(crack.faces), dtype=np.int64)]
    n_points = len(crack.points)
    edges, owner = rim(crack.faces)
    side_normal = dict(
        zip(
            map(tuple, edges.tolist()),
            face_normals(crack.points, crack.faces)[owner],
            strict=True,
        )
    )
    for f, front in enumerate(front_frames(crack)):
        base, direction, n = _rays(front, side_normal)
        side = np.linalg.norm(np.diff(front.x, axis=0), axis=1)
        cell = mesh.cell_size[mesh.cell_tree.query(front.x)[1]]
        edge = max(float(np.median(side)), 0.25 * float(cell.min()))
        layers = int(np.clip(np.ceil(width / edge), 1, 64))
        origin = crack.points[base]
        new, faces = ruled(n_points, base, origin, width * direction, layers, front.closed)
        points.append(new)
        everything = np.concatenate(points)
        reference = np.zeros((n_points + len(new), 3))
        reference[base] = n
        reference[n_points:] = np.repeat(n, layers, axis=0)
        expected = reference[faces].sum(axis=1)
        upright = np.einsum("ij,ij->i", face_normals(everything, faces), unit(expected)) > 0.2
        triangles.append(faces[upright])
        label.append(np.full(int(upright.sum()), f + 1))
        n_points += len(new)
    return Extended(
        lock(np.concatenate(points)), lock(np.concatenate(triangles)), lock(np.concatenate(label))
    )


def _rays(front: Front, side_normal: dict[tuple[int, int], Floats]) -> tuple[Ints, Floats, Floats]:
    """Point numbers, directions and normals of the rays of a strip, with fans at sharp places."""
    m = len(front.x)
    following = np.roll(front.number, -1)
    n_sides = m if front.closed else m - 1
    along = np.roll(front.x, -1, axis=0) - front.x
    # The faces run against the direction of the front.
    normal = [
        side_normal.get((int(following[j]), int(front.number[j])), front.frame[j, 1])
        for j in range(n_sides)
    ]
    out = unit(np.cross(normal, along[:n_sides]))
    previous = np.roll(out, 1, axis=0)
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", previous, out), -1, 1))
    base, direction, normals = [], [], []
    for j in range(m):
        t, n, b = front.frame[j]
        rays = [t]
        if front.closed or 0 < j < m - 1:
            before, after, angle = previous[j], out[j], float(angles[j])
            if angle > _FAN and (after - before) @ b > 0:
                pieces = int(np.ceil(angle / _FAN))
                share = np.arange(pieces + 1) / pieces
                rays = [
                    (np.sin((1 - c) * angle) * before + np.sin(c * angle) * after) / np.sin(angle)
                    for c in share
                ]
        base.extend([int(front.number[j])] * len(rays))
        direction.extend(rays)
        normals.extend([n] * len(rays))
    return np.array(base), np.array(direction), np.array(normals)
