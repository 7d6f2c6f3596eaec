"""Nearest points of curves and surfaces that are given by quartic pieces."""

import math

import numpy as np

from xcrack.base.kernels.arrays import empty
from xcrack.base.kernels.jit import kernel

# Four times the barycentric coordinates of the nodes: corners, edges from their first corner on, in
# the order of `local_edges`, inside.
_OF_LINE = np.array([(4, 0), (0, 4), (3, 1), (2, 2), (1, 3)])
_OF_TRIANGLE = np.array([
    (4, 0, 0), (0, 4, 0), (0, 0, 4), (3, 1, 0), (2, 2, 0), (1, 3, 0), (3, 0, 1), (2, 0, 2),
    (1, 0, 3), (0, 3, 1), (0, 2, 2), (0, 1, 3), (2, 1, 1), (1, 2, 1), (1, 1, 2),
])  # fmt: skip
_STEPS = 60
_AT_REST = 1e-13  # of a parameter: steps become smaller at a rate well below one half
_NEARLY = 1e-2  # of a parameter: steps this small do not come back from outside of a piece
_WIDEST = 0.25  # of a parameter: longest step
_MOST_PIECES = 64  # looked at for one point
_ROOMY = 1.1  # times the farthest node of an edge from its middle: it bulges between nodes


@kernel
def _factors(c, value, slope):  # type: ignore[no-untyped-def]
    """Products 4c (4c - 1) ... / k! for k = 0 ... 4, and their derivatives."""
    value[0], slope[0] = 1.0, 0.0
    for k in range(1, 5):
        factor = (4.0 * c - (k - 1)) / k
        slope[k] = slope[k - 1] * factor + value[k - 1] * 4.0 / k
        value[k] = value[k - 1] * factor


@kernel
def _place(table, nodes, bary, x, tangents, value, slope):  # type: ignore[no-untyped-def]
    """Point of a piece, and its derivatives along the barycentric coordinates `(c, d)`."""
    corners, d = table.shape[1], nodes.shape[1]
    for j in range(corners):
        _factors(bary[j], value[j], slope[j])
    x[:] = 0.0
    tangents[:] = 0.0
    for a in range(len(table)):
        shape = 1.0
        for j in range(corners):
            shape *= value[j, table[a, j]]
        for i in range(d):
            x[i] += shape * nodes[a, i]
        for j in range(corners):
            change = slope[j, table[a, j]]
            for k in range(corners):
                if k != j:
                    change *= value[k, table[a, k]]
            for i in range(d):
                tangents[j, i] += change * nodes[a, i]


@kernel
def _along_edge(table, nodes, target, bary, begin, end, work):  # type: ignore[no-untyped-def]
    """Move `bary` to the nearest point of an edge of a piece; the squared distance to it."""
    x, tangents, value, slope = work
    t = bary[end] / max(bary[begin] + bary[end], 1e-300)
    t = min(max(t, 0.0), 1.0)
    if not t >= 0.0:
        t = 0.5
    d = len(x)
    best_t, square = t, np.inf
    for _ in range(_STEPS):
        bary[:] = 0.0
        bary[begin], bary[end] = 1.0 - t, t
        _place(table, nodes, bary, x, tangents, value, slope)
        up, curvature, distance = 0.0, 0.0, 0.0
        for i in range(d):
            tangent = tangents[end, i] - tangents[begin, i]
            up += tangent * (target[i] - x[i])
            curvature += tangent * tangent
            distance += (target[i] - x[i]) ** 2
        if distance < square:
            best_t, square = t, distance
        step = min(max(up / max(curvature, 1e-300), -_WIDEST), _WIDEST)
        position = min(max(t + step, 0.0), 1.0)
        if abs(position - t) <= _AT_REST:
            break
        t = position
    bary[:] = 0.0
    bary[begin], bary[end] = 1.0 - best_t, best_t
    _place(table, nodes, bary, x, tangents, value, slope)
    return square


@kernel
def _move_inside(table, nodes, target, bary, work):  # type: ignore[no-untyped-def]
    """Move `bary` to the nearest point of a surface piece, by Gauss and Newton.

    Returns the squared distance to it, inf where it would lie beyond an edge.
    """
    x, tangents, value, slope = work
    square = np.inf
    for _ in range(_STEPS):
        _place(table, nodes, bary, x, tangents, value, slope)
        aa, bb, ab, ea, eb, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            a, b = tangents[1, i] - tangents[0, i], tangents[2, i] - tangents[0, i]
            e = target[i] - x[i]
            aa, bb, ab = aa + a * a, bb + b * b, ab + a * b
            ea, eb, square = ea + e * a, eb + e * b, square + e * e
        determinant = aa * bb - ab * ab
        if not determinant > 1e-12 * aa * bb:
            return np.inf
        u, v = (ea * bb - eb * ab) / determinant, (eb * aa - ea * ab) / determinant
        step_length = max(abs(u), abs(v))
        if step_length > _WIDEST:
            u, v = u * _WIDEST / step_length, v * _WIDEST / step_length
        bary[1] += u
        bary[2] += v
        bary[0] = 1.0 - bary[1] - bary[2]
        least_coordinate = min(bary[0], bary[1], bary[2])
        if least_coordinate < -2 * _WIDEST or (
            step_length < _NEARLY and least_coordinate < -10 * step_length
        ):
            return np.inf
        if step_length <= _AT_REST:
            break
    if least_coordinate < 0.0:
        return np.inf
    _place(table, nodes, bary, x, tangents, value, slope)
    return square


@kernel
def _may_be_nearer(x, centre, radius, square):  # type: ignore[no-untyped-def]
    """Whether a ball may hold a point nearer than the root of a square."""
    gap = 0.0
    for i in range(len(x)):
        gap += (x[i] - centre[i]) ** 2
    return math.sqrt(gap) - radius <= math.sqrt(square)


@kernel
def nearest_on_pieces(x, candidates, offsets, piece, node_number, nodes, centre, radius):  # type: ignore[no-untyped-def]
    """Nearest points of quartic pieces.

    Parameters
    ----------
    x : (q, d) array
    candidates : (q, k) array of int
        Nodes from whose pieces the search begins.
    offsets : (n + 1,) array of int
    piece, node_number : (.,) arrays of int
        Pieces that have each node, and its number in them.
    nodes : (p, 5, d) or (p, 15, 3) array
        Nodes of the pieces of a curve or of a surface.
    centre, radius : (p, d), (p,) arrays
        Balls in which the pieces lie.

    Returns
    -------
    foot : (q, d) array
    owner : (q,) array of int
        The piece that it lies on.
    """
    table = _OF_LINE if nodes.shape[1] == 5 else _OF_TRIANGLE
    corners, d = table.shape[1], x.shape[1]
    foot, owner = x.copy(), np.full(len(x), -1, np.int64)
    work = (empty(d), empty((corners, d)), empty((corners, 5)), empty((corners, 5)))
    bary, tried_pieces = empty(corners), empty(_MOST_PIECES, np.int64)
    start = empty((_MOST_PIECES, corners))
    for q in range(len(x)):
        least_square, count = np.inf, 0
        for n in candidates[q]:
            for row in range(offsets[n], offsets[n + 1]):
                f = piece[row]
                is_new = count < _MOST_PIECES
                for g in tried_pieces[:count]:
                    is_new = is_new and g != f
                if not is_new:
                    continue
                tried_pieces[count] = f
                for j in range(corners):
                    bary[j] = start[count, j] = table[node_number[row], j] / 4.0
                count += 1
                if corners == 3 and _may_be_nearer(x[q], centre[f], radius[f], least_square):
                    square = _move_inside(table, nodes[f], x[q], bary, work)
                    if square < least_square:
                        least_square, owner[q] = square, f
                        foot[q] = work[0]
        # Edges after all insides: most of them are farther than what has been found.
        for c in range(count):
            f = tried_pieces[c]
            if not _may_be_nearer(x[q], centre[f], radius[f], least_square):
                continue
            edge = corners + 1  # the node at the middle of the first edge; of the next, three on
            for begin in range(corners - 1):
                for end in range(begin + 1, corners):
                    middle = nodes[f, edge]
                    half = 0.0
                    for i in range(d):
                        a, b = nodes[f, begin, i] - middle[i], nodes[f, end, i] - middle[i]
                        half = max(half, abs(a), abs(b))
                    edge += 3
                    if not _may_be_nearer(x[q], middle, _ROOMY * math.sqrt(d) * half, least_square):
                        continue
                    bary[:] = start[c]
                    square = _along_edge(table, nodes[f], x[q], bary, begin, end, work)
                    if square < least_square:
                        least_square, owner[q] = square, f
                        foot[q] = work[0]
    return foot, owner


@kernel
def points_of_pieces(nodes, owner, bary):  # type: ignore[no-untyped-def]
    """Points of pieces at barycentric coordinates, and their derivatives along these.

    Parameters
    ----------
    nodes : (p, 5, d) or (p, 15, 3) array
    owner : (q,) array of int
    bary : (q, c) array

    Returns
    -------
    x : (q, d) array
    tangents : (q, c, d) array
    """
    table = _OF_LINE if nodes.shape[1] == 5 else _OF_TRIANGLE
    corners, d = table.shape[1], nodes.shape[2]
    x, tangents = empty((len(owner), d)), empty((len(owner), corners, d))
    value, slope = empty((corners, 5)), empty((corners, 5))
    for q in range(len(owner)):
        _place(table, nodes[owner[q]], bary[q], x[q], tangents[q], value, slope)
    return x, tangents


__all__ = []
