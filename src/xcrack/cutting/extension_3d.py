"""Strips of triangles that prolong cracks in 3D ahead of their fronts, for their level sets."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints, lock
from xcrack.crack.crack import Crack
from xcrack.crack.fronts_3d import Front, front_frames
from xcrack.geometry.triangulation import face_normals, rim, ruled, unit
from xcrack.mesh.mesh import Mesh

_FAN = np.radians(30.0)  # a front that turns away by more gets rays between


@dataclass(frozen=True, eq=False)
class Extended:
    """A 3D crack prolonged ahead of its fronts.

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
