"""Simplices: shape functions, quadrature rules, and their parts on both sides of a linear function.

Fractions are products of positive cut positions (no cancellation): tiny pieces keep their
relative accuracy.
"""

from functools import lru_cache
from itertools import permutations
from math import factorial

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.errors import ProblemError
from xcrack.mesh.mesh import Mesh, local_edges


def n_shapes(order: int, dim: int) -> int:
    """Number of shape functions of a simplex of the given order, 1 or 2."""
    return dim + 1 if order == 1 else (dim + 1) * (dim + 2) // 2


def cell_nodes(mesh: Mesh, order: int) -> Ints:
    """Node numbers of each cell `(m, n_shapes)`: points first, then edge midpoints."""
    if order == 1:
        return mesh.cells
    return mesh.corners_and_edges


def node_points(mesh: Mesh, order: int) -> Floats:
    """Coordinates of the nodes `(n, d)`: points first, then edge midpoints."""
    if order == 1:
        return mesh.points
    return np.concatenate([mesh.points, mesh.edge_middles])


def facet_nodes(mesh: Mesh, order: int, facets: Ints) -> Ints:
    """Node numbers of the given facets `(k, .)`: points first, then edge midpoints."""
    if order == 1:
        return facets
    pairs = local_edges(facets.shape[1] - 1)
    ends = np.sort(facets[:, pairs].reshape(-1, 2), axis=1)
    key = mesh.edges[:, 0] * np.int64(mesh.n_points) + mesh.edges[:, 1]
    number = np.searchsorted(key, ends[:, 0] * np.int64(mesh.n_points) + ends[:, 1])
    return np.concatenate([facets, mesh.n_points + number.reshape(-1, len(pairs))], axis=1)


def shape_derivatives(order: int, bary: Floats) -> Floats:
    """Derivatives with respect to the barycentric coordinates, `(..., n_shapes, d + 1)`."""
    k = bary.shape[-1]
    result = np.zeros((*bary.shape[:-1], n_shapes(order, k - 1), k))
    vertex = np.arange(k)
    if order == 1:
        result[..., vertex, vertex] = 1.0
        return result
    result[..., vertex, vertex] = 4 * bary - 1
    i, j = local_edges(k - 1).T
    edge = k + np.arange(len(i))
    result[..., edge, i] = 4 * bary[..., j]
    result[..., edge, j] = 4 * bary[..., i]
    return result


@lru_cache(maxsize=64)
def gauss(n: int) -> tuple[Floats, Floats]:
    """Gauss points and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return lock((x + 1) / 2), lock(w / 2)


@lru_cache(maxsize=64)
def conical_rule(dim: int, n: int) -> tuple[Floats, Floats]:
    """Conical product rule of degree 2 n - 1: points `(n^d, d + 1)`, weights summing to 1.

    Stroud (1971), Approximate Calculation of Multiple Integrals, conical products.
    """
    from scipy.special import roots_jacobi

    bary = np.ones((1, 1))
    weight = np.ones(1)
    for k in range(1, dim + 1):
        t, w = roots_jacobi(n, k - 1, 0)
        t, w = (t + 1) / 2, w / w.sum()
        head = np.repeat(t, len(bary))[:, None]
        bary = np.concatenate([head, (1 - head) * np.tile(bary, (n, 1))], axis=1)
        weight = np.repeat(w, len(weight)) * np.tile(weight, n)
    return lock(bary), lock(weight)


# Fully symmetric rules on triangles (degree 5: Radon, 1948, in closed form; the others: Dunavant,
# 1985, polished to round-off on the moments):
# degree -> (weight of each point, first two barycentric coordinates of the orbit).
_TRIANGLES: dict[int, list[tuple[float, ...]]] = {
    4: [
        (0.22338158967801147, 0.10810301816807023, 0.44594849091596489),
        (0.10995174365532187, 0.81684757298045851, 0.09157621350977074),
    ],
    5: [
        (9 / 40, 1 / 3, 1 / 3),
        ((155 - 15**0.5) / 1200, (6 - 15**0.5) / 21, (6 - 15**0.5) / 21),
        ((155 + 15**0.5) / 1200, (6 + 15**0.5) / 21, (6 + 15**0.5) / 21),
    ],
    6: [
        (0.11678627572637902, 0.2492867451709106, 0.2492867451709106),
        (0.05084490637020671, 0.06308901449150216, 0.06308901449150216),
        (0.08285107561837379, 0.05314504984481712, 0.3103524510337842),
    ],
    8: [
        (0.144315607677787, 1 / 3, 1 / 3),
        (0.095091634267285, 0.081414823414554, 0.459292588292723),
        (0.103217370534718, 0.65886138449648, 0.17056930775176),
        (0.032458497623198, 0.898905543365938, 0.050547228317031),
        (0.027230314174435, 0.008394777409958, 0.263112829634638),
    ],
    10: [
        (0.09081799038275107, 1 / 3, 1 / 3),
        (0.0367259577564673, 0.0288447332326864, 0.4855776333836568),
        (0.04532105943552854, 0.78103684902992574, 0.10948157548503713),
        (0.07275791684541925, 0.141707219414882, 0.30793983876412084),
        (0.028327242531058037, 0.025003534762687105, 0.24667256063990545),
        (0.009421666963732934, 0.009540815400298792, 0.06680325101220144),
    ],
}


SYMMETRIC = max(_TRIANGLES)  # degree up to which rules on triangles are symmetric

# The same on tetrahedra: degree -> (weight, first three barycentric coordinates of the orbit).
_TETRAHEDRA: dict[int, list[tuple[float, ...]]] = {
    5: [  # Walkington, 2000
        (0.1126879257180158508, *(0.3108859192633006098,) * 3),
        (0.0734930431163619495, *(0.0927352503108912264,) * 3),
        (0.0425460207770814664, *(0.0455037041256496495,) * 2, 0.4544962958743503505),
    ],
    7: [  # orbits of Witherden and Vincent, 2015, polished to round-off on the moments
        (0.09548528946413026, *(0.25,) * 3),
        (0.04232958120996812, *(0.3157011497782027,) * 3),
        (0.0318969278328577, *(0.44951017740160354,) * 2, 0.05048982259839646),
        (0.03720713072833442, *(0.18883383102600002,) * 2, 0.04716070036099767),
        (0.00811077082990316, *(0.02126547254148261,) * 2, 0.1466388138184847),
    ],
}
_RULES = {2: _TRIANGLES, 3: _TETRAHEDRA}


@lru_cache(maxsize=16)
def _symmetric_points(dim: int, degree: int) -> tuple[Floats, Floats]:
    bary, weight = [], []
    for w, *first in _RULES[dim][degree]:
        orbit = np.array(list(permutations((*first, 1 - sum(first)))))
        # Images less than 1e-6 apart are one; the rules keep their points far wider apart.
        first_rows = np.unique(np.round(orbit, 6), axis=0, return_index=True)[1]
        bary.append(orbit[np.sort(first_rows)])
        weight.append(np.full(len(first_rows), w))
    points, total = np.concatenate(bary), np.concatenate(weight)
    return lock(points / points.sum(axis=1, keepdims=True)), lock(total / total.sum())


@lru_cache(maxsize=64)
def simplex_rule(dim: int, degree: int) -> tuple[Floats, Floats]:
    """A rule exact for polynomials of the given degree: points `(q, d + 1)`, weights sum to 1.

    In 2D up to degree 10 it is symmetric, so that a mirrored mesh gives a mirrored result;
    in 3D up to degree 7.
    """
    if degree <= 1:
        return lock(np.full((1, dim + 1), 1 / (dim + 1))), lock(np.ones(1))
    if degree == 2:
        a = {1: 0.5 - 0.5 / np.sqrt(3), 2: 1 / 6, 3: (5 - np.sqrt(5)) / 20}[dim]
        bary = np.full((dim + 1, dim + 1), a) + np.eye(dim + 1) * (1 - (dim + 1) * a)
        return lock(bary), lock(np.full(dim + 1, 1 / (dim + 1)))
    for degree_of_rule in _RULES.get(dim, {}):
        if degree <= degree_of_rule:
            return _symmetric_points(dim, degree_of_rule)
    return conical_rule(dim, degree // 2 + 1)


# Sizes of cells.


def leg_size(mesh: Mesh, cells: Ints) -> float:
    """Size of the simplex with right angles that has the mean volume of the cells, length."""
    return float((factorial(mesh.dim) * mesh.volume[cells].mean()) ** (1 / mesh.dim))


def leg_sizes(mesh: Mesh, cells: Ints) -> Floats:
    """Size of the simplex with right angles that has the volume of each cell, length."""
    return np.asarray((factorial(mesh.dim) * mesh.volume[cells]) ** (1 / mesh.dim))


# Area vectors of boundary facets.


def outward_areas(mesh: Mesh, facets: Ints, label: str) -> Floats:
    """Outward normal of each facet times its length (2D) or area (3D), `(k, d)`.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
    label : str
        For messages.

    Raises
    ------
    ProblemError
        Facets inside the body.
    """
    number = mesh.facet_numbers(facets)
    cell = mesh.facet_to_cell[number, 0]
    is_inner = mesh.facet_to_cell[number, 1] >= 0
    if is_inner.any():
        raise ProblemError(
            f"{label}: {int(is_inner.sum())} of its facets lie inside the body; loads act on the "
            "boundary only."
        )
    place = np.argmax(mesh.cell_to_facet[cell] == number[:, None], axis=1)
    # The gradient of the corner across is the inward normal over the height above the facet.
    return np.asarray(-mesh.dim * mesh.volume[cell, None] * mesh.gradient[cell, place])


_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def cut_simplices(phi: Floats, x: Floats | None = None) -> tuple[Floats, Floats, Ints, Ints]:
    """Sub-simplices of simplices with vertex values of both signs.

    Parameters
    ----------
    phi : (k, d + 1) array
    x : (k, d + 1, m) array, optional
        Vertices. What several vertices have equal values in is split by distances between them,
        without them by the order of the vertices.

    Returns
    -------
    bary : (s, d + 1, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    fraction : (s,) array
        Share of the parent's volume, a product of positive cut positions.
    side : (s,) array of int
    parent : (s,) array of int
    """
    from xcrack.mesh.kernels import splitting

    bary, fraction, side, parent = splitting.cut_simplices(*_arrays(phi, x), _NOTHING)
    return bary, fraction, side, parent


def interface_simplices(phi: Floats, x: Floats | None = None) -> tuple[Floats, Ints]:
    """Segments or triangles on which a function of both signs vanishes.

    Parameters
    ----------
    phi : (k, d + 1) array
    x : (k, d + 1, m) array, optional
        As of `cut_simplices`.

    Returns
    -------
    bary : (s, d, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    parent : (s,) array of int
    """
    from xcrack.mesh.kernels import splitting

    bary, parent = splitting.interface_simplices(*_arrays(phi, x))
    return bary, parent


def _arrays(phi: Floats, x: Floats | None) -> tuple[Floats, Floats]:
    """Both as kernels take them."""
    vertices = np.zeros((0, phi.shape[1], 1)) if x is None else np.ascontiguousarray(x)
    return np.ascontiguousarray(phi), vertices


def boxes_meet(a: Floats, b: Floats, c: Floats, d: Floats, reach: float = 0.0) -> Bools:
    """Whether the boxes along the axes around segments ab and cd `(..., d)` come within a reach."""
    overlap_min = np.maximum(np.minimum(a, b), np.minimum(c, d))
    overlap_max = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray((overlap_min <= overlap_max + reach).all(axis=-1))
