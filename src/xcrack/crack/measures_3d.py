"""Lines in which a surface meets the boundary of a body, and what lies how deep below them."""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, ranges
from xcrack.crack.crack import Crack
from xcrack.crack.size_3d import area_inside, front_length_inside, halved
from xcrack.geometry.distances import signed_in
from xcrack.geometry.simplices import distance_to_simplices
from xcrack.mesh.body import Body
from xcrack.mesh.mesh import Mesh

_FINE = 0.1  # of a facet of the boundary: pieces of the crack that meet it, steps along fronts
_MOST = 2000  # steps on a side of a front
_REACH = 1.5  # cells up to which a front that ends inside is prolonged to the boundary
_BISECTIONS = 60


def measures_of_surface(
    crack: Crack, mesh: Mesh, group: Ints
) -> tuple[float, float, dict[int, tuple[float, float]], list[tuple[Floats, int, int]]]:
    """Area, length of fronts, length and depth by set, and ends of fronts of a placed 3D crack.

    Parameters
    ----------
    crack : Crack
    mesh : Mesh
    group : (f,) array of int
        Number of the set of each facet of the mesh.

    Returns
    -------
    area : float, length²
    front_length : float, length
    traces : dict of set to (length, depth)
    ends : list of (x, facet, number of the front)
    """
    body = Body.of(mesh)
    outer = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    segment = _trace(crack, body)
    facet = outer[signed_in(body.boundary, segment.mean(axis=1))[1]] if len(segment) else outer[:0]
    fronts = [_front_points(crack, front, body) for front in crack.fronts or ()]
    deepest = np.concatenate([np.zeros((0, 3)), *fronts])
    ends = [
        (x, int(outer[signed_in(body.boundary, x[None])[1][0]]), k)
        for k, x in front_ends(crack, body)
    ]
    # Traces and fronts end at the same places.
    deepest = np.concatenate([deepest, *(x[None] for x, _, _ in ends)])
    if not len(deepest):
        deepest = segment.reshape(-1, 3)
    of = group[facet]
    traces = {}
    for k in np.unique(of).tolist():
        own = segment[of == k]
        length = float(np.linalg.norm(own[:, 1] - own[:, 0], axis=1).sum())
        depth = max((float(distance_to_simplices(x, own).min()) for x in deepest), default=0.0)
        traces[k] = (length, depth)
    return area_inside(crack, mesh), front_length_inside(crack, mesh), traces, ends


def front_ends(crack: Crack, body: Body) -> list[tuple[int, Floats]]:
    """Where the fronts of a placed crack meet the boundary: number of the front, place.

    Parameters
    ----------
    crack : Crack
    body : Body

    Returns
    -------
    list of (int, (3,) array)
        Places in the direction of the front.
    """
    return [
        (k, x)
        for k, front in enumerate(crack.fronts or ())
        for x in _ends(crack.points[front], body)
    ]


def _trace(crack: Crack, body: Body) -> Floats:
    """Segments in which the faces of a crack meet the boundary `(k, 2, 3)`."""
    piece = crack.points[crack.faces]
    parts = [np.zeros((0, 2, 3))]
    while len(piece):
        centre = piece.mean(axis=1)
        radius = np.linalg.norm(piece - centre[:, None], axis=2).max(axis=1)
        depth, size = body.depth(centre)
        near = np.abs(depth) < radius
        piece, size = piece[near], size[near]
        side = np.linalg.norm(np.roll(piece, -1, axis=1) - piece, axis=2)
        small = side.max(axis=1) <= _FINE * size
        parts.append(_zero_lines(piece[small], body))
        piece = halved(piece[~small], side[~small])
    return np.concatenate(parts)


def _zero_lines(piece: Floats, body: Body) -> Floats:
    """Segments of small triangles where the depth, linear between their corners, is zero."""
    if not len(piece):
        return np.zeros((0, 2, 3))
    depth = body.depth(piece.reshape(-1, 3))[0].reshape(-1, 3)
    outside: Bools = depth >= 0
    count = outside.sum(axis=1)
    crossed = (count == 1) | (count == 2)
    piece, depth, outside, count = piece[crossed], depth[crossed], outside[crossed], count[crossed]
    # The corner alone on its side first, the two others after it.
    alone = np.argmax(outside == (count == 1)[:, None], axis=1)
    order = (alone[:, None] + np.arange(3)) % 3
    x = np.take_along_axis(piece, order[..., None], axis=1)
    d = np.take_along_axis(depth, order, axis=1)
    t = d[:, :1] / (d[:, :1] - d[:, 1:])
    return np.asarray(x[:, :1] + t[..., None] * (x[:, 1:] - x[:, :1]))


def _front_points(crack: Crack, front: Ints, body: Body) -> Floats:
    """Points along a front inside the body."""
    x = _dense(crack.points[front], body)
    return x[body.depth(x)[0] <= 0]


def _dense(x: Floats, body: Body) -> Floats:
    side = np.diff(x, axis=0)
    length = np.linalg.norm(side, axis=1)
    size = body.depth((x[1:] + x[:-1]) / 2)[1]
    parts = np.clip(np.ceil(length / (_FINE * size)), 1, _MOST).astype(np.int64)
    row, part = ranges(parts)
    points = x[row] + (part / parts[row])[:, None] * side[row]
    return np.concatenate([points, x[-1:]])


def _ends(x: Floats, body: Body) -> list[Floats]:
    """Where an open front meets the boundary, or would if its end were prolonged."""
    closed = bool((x[0] == x[-1]).all())
    points = _dense(x, body)
    inside = body.depth(points)[0] < 0
    if not inside.any():
        return []
    change = np.nonzero(inside[1:] != inside[:-1])[0]
    result = [_crossing(points[i], points[i + 1], body) for i in change]
    if closed:
        return result
    for end, before in ((points[0], points[1]), (points[-1], points[-2])):
        if body.depth(end[None])[0][0] >= 0:
            continue
        ahead = (end - before) / max(float(np.linalg.norm(end - before)), 1e-300)
        far = end + _REACH * body.cell_size(end[None])[0] * ahead
        if body.depth(far[None])[0][0] >= 0:
            result.append(_crossing(end, far, body))
    return result


def _crossing(one: Floats, other: Floats, body: Body) -> Floats:
    """Place on the boundary between a point inside and one outside."""
    inside = body.depth(one[None])[0][0] < 0
    for _ in range(_BISECTIONS):
        middle = (one + other) / 2
        if (body.depth(middle[None])[0][0] < 0) == inside:
            one = middle
        else:
            other = middle
    return np.asarray((one + other) / 2)
