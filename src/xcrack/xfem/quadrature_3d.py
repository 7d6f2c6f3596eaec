"""Integration points around the fronts of cracks in 3D.

Near a front the products of derivatives of tip functions go like 1 / r. Sub-cells that touch the
front with an edge are swept by rays from that edge, those that touch it with a vertex by rays
from there, both with r = s², so that roots of r turn into polynomials. Others get a rule of
degree 5 or, away from the front and where they are tiny, of degree 2: more points change the
stiffness of a cell by less than 1 % and K by a tenth of its discretisation error, while the time
to assemble grows with their number.

Not so at order 2, where tip functions nearly repeat the quadratic ones: the little that is left of
them must not drown in errors of the rules, or the stiffness has negative eigenvalues. There the
rules at a front take one point more, and all others degree 5.
"""

from functools import lru_cache

import numpy as np

from xcrack.arrays import Bools, Floats, Ints, lock
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import gauss, simplex_rule
from xcrack.xfem.function_space import FunctionSpace

_AT = 1e-9  # share of a sub-cell's size below which a vertex lies on the front
_FAR = 0.7  # distance to the front, in sizes of the sub-cell, beyond which a rule of degree 2 does
_TINY = 0.01  # sub-cells below this share of their cell get fewer points
_NEAR = 0.5  # triangles closer to the front, in their sizes, are cut in four


def radius_at(space: FunctionSpace, nodes: Ints, bary: Floats) -> Floats:
    """Distance to the nearest front `(k, v)`, from the level sets as they are interpolated.

    Parameters
    ----------
    space : FunctionSpace
    nodes : (k, m) array of int
        Mesh points of simplices.
    bary : (k, v, m) array
        Places in them.
    """
    result = np.full(bary.shape[:2], np.inf)
    for tip in space.tips:
        levels = space.cuts[tip.crack].level_set
        phi = np.einsum("kvm,km->kv", bary, levels.phi[nodes])
        psi = np.einsum("kvm,km->kv", bary, levels.psi[tip.number][nodes])
        result = np.minimum(result, np.hypot(phi, psi))
    return result


def front_points(
    space: FunctionSpace, cell: Ints, bary: Floats, share: Floats, fan: Bools, n: int
) -> tuple[Ints, Floats, Floats]:
    """Points in sub-cells on which tip functions act.

    Parameters
    ----------
    space : FunctionSpace
    cell : (s,) array of int
    bary : (s, 4, 4) array
        Vertices of the sub-cells in their cells.
    share : (s,) array
        Of the cell's volume.
    fan : (s,) array of bool
        Not used: which vertices lie on the front follows from the level sets.
    n : int
        Gauss points along the angle at a front; at order 2 one more.

    Returns
    -------
    number : (q,) array of int
        Sub-cell of each point.
    place : (q, 4) array
        In barycentric coordinates of the cell.
    weight : (q,) array
        As a share of the cell's volume.
    """
    nodes = space.mesh.cells[cell]
    r = radius_at(space, nodes, bary)
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[nodes])
    i, j = local_edges(3).T
    size = np.linalg.norm(x[:, i] - x[:, j], axis=2).max(axis=1)
    at = r < _AT * size[:, None]
    corner = np.take_along_axis(bary, np.argsort(~at, axis=1, kind="stable")[:, :, None], axis=1)
    touches = at.sum(axis=1)
    edge, free = touches == 2, touches == 0
    vertex = ~edge & ~free
    tiny = share < _TINY
    coarse = free & (tiny | (r.min(axis=1) > _FAR * size)) & (space.order == 1)
    along = n if space.order == 1 else n + 1
    parts = []
    for chosen, rule in (
        (edge & ~tiny, _edge_rule(along)),
        (edge & tiny, _edge_rule(max(along - 1, 2))),
        (vertex & ~tiny, _vertex_rule(along)),
        (vertex & tiny, _vertex_rule(max(along - 1, 2))),
        (free & ~coarse, simplex_rule(3, 2 * n - 3)),
        (coarse, simplex_rule(3, max(n - 2, 1))),
    ):
        rows = np.nonzero(chosen)[0]
        place = np.einsum("pv,svb->spb", rule[0], corner[rows])
        weight = share[rows, None] * rule[1]
        parts.append((np.repeat(rows, len(rule[1])), place.reshape(-1, 4), weight.ravel()))
    a, b, c = (np.concatenate(p) for p in zip(*parts, strict=True))
    return a, b, c


@lru_cache(maxsize=8)
def _edge_rule(n: int) -> tuple[Floats, Floats]:
    """Rule on a tetrahedron whose first two vertices lie on the front.

    x = (1 - u) [(1 - v) T0 + v T1] + u [(1 - w) T2 + w T3], u = s², dV = 6 V u (1 - u) du dv dw.
    """
    (s, ws), (v, wv), (w, ww) = gauss(n - 1), gauss(max(n - 2, 2)), gauss(n)
    s, v, w = (a.ravel() for a in np.meshgrid(s, v, w, indexing="ij"))
    u = s * s
    weight = np.einsum("i,j,k->ijk", ws, wv, ww).ravel() * 12 * s * u * (1 - u)
    bary = np.stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - w), u * w], axis=1)
    return lock(bary), lock(weight / weight.sum())


@lru_cache(maxsize=8)
def _vertex_rule(n: int) -> tuple[Floats, Floats]:
    """Rule on a tetrahedron whose first vertex lies on the front, u = s² from there."""
    s, ws = gauss(n - 1)
    far, share = simplex_rule(2, 4)
    u = np.repeat(s * s, len(share))
    weight = np.outer(ws * s**5, share).ravel()
    bary = np.concatenate([(1 - u)[:, None], u[:, None] * np.tile(far, (len(s), 1))], axis=1)
    return lock(bary), lock(weight / weight.sum())


def triangle_points(r: Floats, size: Floats, degree: int = 4) -> tuple[Ints, Floats, Floats]:
    """Points on triangles on which tip functions may act, denser towards the front.

    Parameters
    ----------
    r : (k, 3) array, length
        Distance to the front at the corners; inf where there is none.
    size : (k,) array, length
        Longest side.
    degree : int
        Degree of polynomials integrated exactly away from the front.

    Returns
    -------
    number : (q,) array of int
    bary : (q, 3) array
    weight : (q,) array
        Share of the area.
    """
    number = np.arange(len(r))
    corner = np.broadcast_to(np.eye(3), (len(r), 3, 3))
    share = np.ones(len(r))
    parts = []
    for level in (0, 1):
        at = r < _AT * size[:, None]
        touches = at.sum(axis=1)
        first = np.argsort(~at, axis=1, kind="stable")
        corner = np.take_along_axis(corner, first[:, :, None], axis=1)
        r = np.take_along_axis(r, first, axis=1)
        near = (touches == 0) & (r.min(axis=1) < _NEAR * size) & (level == 0)
        for chosen, rule in (
            (touches == 2, _side_rule()),
            ((touches == 1) | (touches == 3), _corner_rule()),
            ((touches == 0) & ~near, simplex_rule(2, degree)),
        ):
            rows = np.nonzero(chosen)[0]
            place = np.einsum("pv,svb->spb", rule[0], corner[rows])
            weight = share[rows, None] * rule[1]
            parts.append(
                (np.repeat(number[rows], len(rule[1])), place.reshape(-1, 3), weight.ravel())
            )
        rows = np.nonzero(near)[0]
        number, share = np.repeat(number[rows], 4), np.repeat(share[rows] / 4, 4)
        size = np.repeat(size[rows] / 2, 4)
        corner = np.einsum("cvw,swb->scvb", _quarters(), corner[rows]).reshape(-1, 3, 3)
        r = np.einsum("cvw,sw->scv", _quarters(), r[rows]).reshape(-1, 3)
    a, b, c = (np.concatenate(p) for p in zip(*parts, strict=True))
    return a, b, c


@lru_cache(maxsize=1)
def _side_rule() -> tuple[Floats, Floats]:
    """Rule on a triangle whose first two corners lie on the front."""
    (s, ws), (v, wv) = gauss(4), gauss(3)
    s, v = (a.ravel() for a in np.meshgrid(s, v, indexing="ij"))
    u = s * s
    weight = np.outer(ws, wv).ravel() * s * (1 - u)
    return lock(np.stack([(1 - u) * (1 - v), (1 - u) * v, u], axis=1)), lock(weight / weight.sum())


@lru_cache(maxsize=1)
def _corner_rule() -> tuple[Floats, Floats]:
    """Rule on a triangle whose first corner lies on the front."""
    (s, ws), (v, wv) = gauss(4), gauss(4)
    s, v = (a.ravel() for a in np.meshgrid(s, v, indexing="ij"))
    u = s * s
    weight = np.outer(ws, wv).ravel() * s**3
    return lock(np.stack([1 - u, u * (1 - v), u * v], axis=1)), lock(weight / weight.sum())


@lru_cache(maxsize=1)
def _quarters() -> Floats:
    a, b, c = np.eye(3)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return lock(np.array([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]))
