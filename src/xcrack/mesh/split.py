"""Simplices cut by a linear function: sub-simplices on both sides, and the interface between.

Fractions are products of positive cut positions (no cancellation): tiny pieces keep their
relative accuracy.
"""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.mesh.mesh import local_facets

_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def cut_simplices(phi: Floats) -> tuple[Floats, Floats, Ints, Ints]:
    """Sub-simplices of simplices with vertex values phi `(k, d + 1)` of both signs.

    Returns
    -------
    bary : (s, d + 1, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    fraction : (s,) array
        Share of the parent's volume, a product of positive cut positions.
    side : (s,) array of int
    parent : (s,) array of int
    """
    positive = phi >= 0
    count = positive.sum(axis=1)
    n = phi.shape[1]
    nothing = np.zeros(0, dtype=np.int64)
    parts = [(np.zeros((0, n, n)), np.zeros(0), nothing, nothing)]
    for lonely in (1, n - 1):
        rows = np.nonzero(count == lonely)[0]
        alone_positive = lonely == 1
        alone = np.argmax(positive[rows] == alone_positive, axis=1)
        parts.extend(_one_alone(phi, rows, alone, 1 if alone_positive else -1))
    if n == 4:
        parts.extend(_two_and_two(phi, np.nonzero(count == 2)[0]))
    bary = np.concatenate([p[0] for p in parts])
    fraction = np.concatenate([p[1] for p in parts])
    side = np.concatenate([p[2] for p in parts])
    parent = np.concatenate([p[3] for p in parts])
    keep = fraction > _NOTHING
    order = np.argsort(parent[keep], kind="stable")
    return bary[keep][order], fraction[keep][order], side[keep][order], parent[keep][order]


_Part = tuple[Floats, Floats, Ints, Ints]


def _mix(phi: Floats, i: Ints, j: Ints) -> tuple[Floats, Floats, Floats]:
    """Cut point of edges (i, j): barycentric coordinates, position from i, position from j."""
    row = np.arange(len(phi))
    a, b = phi[row, i], phi[row, j]
    t, u = a / (a - b), b / (b - a)
    point = np.zeros_like(phi)
    point[row, i] = u
    point[row, j] = t
    return point, t, u


def _corner(phi: Floats, i: Ints) -> Floats:
    point = np.zeros_like(phi)
    point[np.arange(len(phi)), i] = 1.0
    return point


def _one_alone(phi: Floats, rows: Ints, alone: Ints, side: int) -> list[_Part]:
    """One vertex on its side, the others (d of them) on the other side."""
    if not len(rows):
        return []
    values = phi[rows]
    n = values.shape[1]
    others = local_facets(n - 1)[alone]
    # The values decide which diagonal splits what is left, not the numbers of the nodes.
    by_value = np.argsort(np.abs(np.take_along_axis(values, others, 1)), axis=1, kind="stable")
    others = np.take_along_axis(others, by_value, 1)
    cut_points, t, u = zip(*[_mix(values, alone, others[:, m]) for m in range(n - 1)], strict=True)
    corners = [_corner(values, others[:, m]) for m in range(n - 1)]
    parts = [(np.stack([_corner(values, alone), *cut_points], 1), np.prod(t, axis=0), side)]
    for m in range(n - 1):
        vertices = [*cut_points[: m + 1], *corners[m:]]
        fraction = np.prod(t[:m], axis=0) * u[m] if m else u[m]
        parts.append((np.stack(vertices, 1), fraction, -side))
    return [(b, f, np.full(len(rows), s, dtype=np.int64), rows) for b, f, s in parts]


def _two_and_two(phi: Floats, rows: Ints) -> list[_Part]:
    """Tetrahedra with two vertices on each side."""
    if not len(rows):
        return []
    values = phi[rows]
    order = np.argsort(values < 0, axis=1, kind="stable")
    parts = []
    for (a, b, c, d), side in ((order.T, 1), (order[:, [2, 3, 0, 1]].T, -1)):
        ac, t_ac, _ = _mix(values, a, c)
        ad, t_ad, _ = _mix(values, a, d)
        bc, t_bc, t_cb = _mix(values, b, c)
        bd, t_bd, t_db = _mix(values, b, d)
        A, B = _corner(values, a), _corner(values, b)
        pieces = [
            ([A, ac, ad, bd], t_ac * t_ad * t_db),
            ([A, ac, bc, bd], t_ac * t_cb * t_bd),
            ([A, B, bc, bd], t_bc * t_bd),
        ]
        sign = np.full(len(rows), side, dtype=np.int64)
        parts.extend([(np.stack(v, 1), f, sign, rows) for v, f in pieces])
    return parts


def interface_simplices(phi: Floats) -> tuple[Floats, Ints]:
    """Segments or triangles on which phi `(k, d + 1)` of both signs vanishes.

    Returns
    -------
    bary : (s, d, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    parent : (s,) array of int
    """
    positive = phi >= 0
    count = positive.sum(axis=1)
    n = phi.shape[1]
    parts = [(np.zeros((0, n - 1, n)), np.zeros(0, dtype=np.int64))]
    for lonely in (1, n - 1):
        rows = np.nonzero(count == lonely)[0]
        alone = np.argmax(positive[rows] == (lonely == 1), axis=1)
        others = local_facets(n - 1)[alone]
        points = [_mix(phi[rows], alone, others[:, m])[0] for m in range(n - 1)]
        parts.append((np.stack(points, axis=1), rows))
    if n == 4:
        rows = np.nonzero(count == 2)[0]
        a, b, c, d = np.argsort(~positive[rows], axis=1, kind="stable").T
        values = phi[rows]
        ac, ad, bd, bc = (_mix(values, i, j)[0] for i, j in ((a, c), (a, d), (b, d), (b, c)))
        parts.append((np.stack([ac, ad, bd], axis=1), rows))
        parts.append((np.stack([ac, bd, bc], axis=1), rows))
    bary, parent = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    # A vertex at phi = 0 is the cut point of several edges: what lies between is nothing.
    whole = np.ones(len(parent), dtype=bool)
    for i in range(n - 1):
        for j in range(i):
            whole &= (bary[:, i] != bary[:, j]).any(axis=1)
    order = np.argsort(parent[whole], kind="stable")
    return bary[whole][order], parent[whole][order]
