"""Integration points around the tips of cracks in 2D.

Sub-cells with tip functions are bisected towards the tip; those that touch it are swept by a fan of
sectors with r = s², in which both the root of r and polynomials are integrated well.
"""

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, ranges
from xcrack.geometry.simplices import closest_on_segment
from xcrack.mesh.simplex import SYMMETRIC, gauss, simplex_rule
from xcrack.xfem.function_space import FunctionSpace

_LEVELS = 5  # bisections towards a tip before the fan takes over
_SECTOR = 0.6  # rad, widest sector of a fan
_EDGE_POINTS = 6  # Gauss points of a boundary piece


def tip_points(
    space: FunctionSpace, cell: Ints, bary: Floats, share: Floats, fan: Bools, n: int
) -> tuple[Ints, Floats, Floats]:
    """Points in sub-cells on which tip functions act.

    Parameters
    ----------
    space : FunctionSpace
    cell : (s,) array of int
    bary : (s, 3, 3) array
        Vertices of the sub-cells in their cells.
    share : (s,) array
        Of the cell's volume.
    fan : (s,) array of bool
        Vertex 0 is a tip.
    n : int
        Points a direction.

    Returns
    -------
    number : (q,) array of int
        Sub-cell of each point.
    place : (q, 3) array
        In barycentric coordinates of the cell.
    weight : (q,) array
        As a share of the cell's volume.
    """
    regular, regular_bary, regular_share, fans = _towards_tips(space, cell, bary, share, fan)
    # Bisected, they are no larger than their distance to a tip: a lower degree than in the fans is
    # enough (K is the same to its error with half of the points, measured).
    enough = max(2 * n - 3, 3)
    rule, weight = simplex_rule(space.dim, enough)
    if enough > SYMMETRIC:
        regular_bary = _from_tips(space, cell[regular], regular_bary)
    place = np.einsum("pv,svb->spb", rule, regular_bary).reshape(-1, space.dim + 1)
    sub, swept, swept_share = _fan_points(space, cell, fans, n)
    return (
        np.concatenate([np.repeat(regular, len(weight)), sub]),
        np.concatenate([place, swept]),
        np.concatenate([np.outer(regular_share, weight).ravel(), swept_share]),
    )


def _from_tips(space: FunctionSpace, cell: Ints, bary: Floats) -> Floats:
    """Vertices of simplices, those nearer to a tip first.

    A conical rule is not symmetric: with an order that geometry decides, points do not depend
    on how nodes are numbered.
    """
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[space.mesh.cells[cell]])
    distance = np.min([np.linalg.norm(x - tip.x, axis=2) for tip in space.tips], axis=0)
    order = np.argsort(distance, axis=1, kind="stable")
    return np.take_along_axis(bary, order[:, :, None], axis=1)


_Fans = tuple[Ints, Floats, Floats]


def _towards_tips(
    space: FunctionSpace, cell: Ints, bary: Floats, share: Floats, fan: Bools
) -> tuple[Ints, Floats, Floats, _Fans]:
    """Bisect sub-cells until they are no larger than their distance to a tip."""
    from xcrack.kernels.bisect import bisect

    mesh = space.mesh
    tips = np.array([tip.x for tip in space.tips]).reshape(-1, mesh.dim)
    fan_rows, others = np.nonzero(fan)[0], np.nonzero(~fan)[0]
    fans = [(fan_rows, bary[fan_rows], share[fan_rows])]
    x = bary[others] @ mesh.points[mesh.cells[cell[others]]]

    def parts(n: int) -> tuple[Ints, Floats, Ints, Bools]:
        integers = np.empty((2, n), dtype=np.int64)
        return integers[0], np.empty((n, 3, 3)), integers[1], np.empty(n, dtype=bool)

    pieces = parts(bisect(x, tips, _LEVELS, False, *parts(0)))
    bisect(x, tips, _LEVELS, True, *pieces)
    owner, local, depth, near = pieces
    number = others[owner]
    bary, share = local @ bary[number], share[number] / 4.0**depth
    if near.any():
        x = local[near] @ x[owner[near]]
        middle = x.mean(axis=1)
        nearest = np.argmin(np.linalg.norm(middle[:, None] - tips, axis=2), axis=1)
        fans.append(_fan_around(number[near], bary[near], share[near], x, tips[nearest]))
    f = tuple(np.concatenate(p) for p in zip(*fans, strict=True))
    return number[~near], bary[~near], share[~near], (f[0], f[1], f[2])


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _fan_around(number: Ints, bary: Floats, share: Floats, x: Floats, tip: Floats) -> _Fans:
    """Split triangles into fans around their points nearest to a tip outside them."""
    pairs = [(0, 1), (1, 2), (2, 0)]
    foot = np.stack([closest_on_segment(tip, x[:, i], x[:, j]) for i, j in pairs], axis=1)
    best = np.argmin(np.linalg.norm(foot - tip[:, None], axis=2), axis=1)
    row = np.arange(len(x))
    i, j = np.array(pairs)[best].T
    along = x[row, j] - x[row, i]
    t = np.clip(
        ((foot[row, best] - x[row, i]) * along).sum(axis=1) / (along * along).sum(axis=1), 0, 1
    )[:, None]
    apex = (1 - t) * bary[row, i] + t * bary[row, j]
    k = 3 - i - j
    both = [
        (np.stack([apex, bary[row, k], bary[row, i]], axis=1), share * t[:, 0]),
        (np.stack([apex, bary[row, j], bary[row, k]], axis=1), share * (1 - t[:, 0])),
    ]
    keep = [s > 1e-14 * share for _, s in both]
    return (
        np.concatenate([number[k] for k in keep]),
        np.concatenate([b[k] for (b, _), k in zip(both, keep, strict=True)]),
        np.concatenate([s[k] for (_, s), k in zip(both, keep, strict=True)]),
    )


def _fan_points(
    space: FunctionSpace, cell: Ints, fans: _Fans, n: int
) -> tuple[Ints, Floats, Floats]:
    """Sweep triangles from vertex 0 in sectors, x = A + s² (E - A), E on the far side.

    Exact for polynomials, and for products of derivatives of the tip functions along r; the
    angle is resolved by sectors of at most 0.6 rad.
    """
    number, bary, share = fans
    mesh = space.mesh
    x = np.einsum("svb,sbd->svd", bary, mesh.points[mesh.cells[cell[number]]])
    left, right = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    a, b = np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1)
    angle = np.abs(np.arctan2(_cross(left, right), (left * right).sum(axis=1)))
    sectors = np.maximum(np.ceil(angle / _SECTOR), 1).astype(np.int64)
    row, k = ranges(sectors)

    def position(part: Floats) -> Floats:
        part = np.clip(part, 0.0, 1.0)
        first, last = a[row] * np.sin(part * angle[row]), b[row] * np.sin((1 - part) * angle[row])
        total = first + last
        return np.where(total > 0, first / np.where(total > 0, total, 1.0), part)

    begin, end = position(k / sectors[row]), position((k + 1) / sectors[row])
    s, ws = gauss(n + 1)
    t, wt = gauss(n + 4)
    tau = begin[:, None] + (end - begin)[:, None] * t
    far = (1 - tau)[..., None] * bary[row, 1][:, None] + tau[..., None] * bary[row, 2][:, None]
    u = (s * s)[None, :, None, None]
    points = (1 - u) * bary[row, 0][:, None, None] + u * far[:, None]
    # dV = 2 area u du dtau with u = s².
    radial = 4 * s**3 * ws
    weight = (share[row] * (end - begin))[:, None, None] * radial[None, :, None] * wt
    each = len(s) * len(t)
    return np.repeat(number[row], each), points.reshape(-1, 3), weight.ravel()


def segment_points(
    space: FunctionSpace, begin: Floats, end: Floats, n: int = _EDGE_POINTS
) -> tuple[Ints, Floats, Floats]:
    """Gauss points on segments `(k, 2)`, graded towards a tip that is closer than their length.

    The segment is split at the foot of the nearest tip, with r = u² from there. The rule depends
    only on the segment, so that the cells on both sides of an edge share it; plain Gauss points
    near a tip spoil order 2.

    Returns
    -------
    segment : (q,) array of int
    place : (q, 2) array
        Barycentric coordinates in the segment.
    weight : (q,) array, length
    """
    from xcrack.kernels.segments import graded_points

    tips = np.array([tip.x for tip in space.tips]).reshape(-1, space.dim)
    number, place, weight = graded_points(begin, end, tips, *gauss(n))
    return number, place, weight
