"""Curved sides through the points of a mesh of straight cells.

Files of linear cells have lost their curves; the points are still on them. Around each point of a
smooth side a paraboloid is laid through its neighbours: where all of these are on a circle (2D), a
sphere or a cylinder seen along it, the curvature 2 d·n / d² of the circle through both points with
the normal n (Taubin 1995, Estimating the tensor of curvature of a surface from a polyhedral
approximation) is exact at any distance d.
"""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from scipy.sparse import csr_array

from xcrack.base.arguments import CheckedBy, Error, Number, Part, check_arguments
from xcrack.base.arrays import Floats, Ints, at
from xcrack.base.checks import entries, flag, value_text
from xcrack.base.errors import MeshError, warn
from xcrack.mesh.curved_facets import (
    edges_of,
    raised_lattice,
    ridges,
    sides_of_facets,
    with_curves,
)
from xcrack.mesh.mesh import Mesh, facet_set, numbers_of
from xcrack.mesh.simplex import outward_areas

_ANGLE = 50.0  # degrees: facets that turn by more meet at a corner
_COARSE = 20.0  # degrees from which a mesh that is read says that it looks like chords
OF_TURN = 12.0  # square of a turn over the change of K beside it, measured at holes (docs/body.md)
_PASSES = 4  # in which normals come to rest
_ALIKE = 1.5  # ratio of the curvatures at the ends of an edge up to which their mean is taken
_PARALLEL = 0.9  # cosine of the angle from which two sides are one at their edge
_NEARNESS = 6  # power of the distance with which neighbours count less: arcs end beside them
_LEAST = 1e-9  # of the size of a fit: what neighbours do not decide is left out


def _set_names(value: Any, label: str, error: Error) -> tuple[str, ...]:
    """Names of one facet set or several."""
    names = (value,) if isinstance(value, str) else entries(value, label, error=error)
    if not all(isinstance(name, str) for name in names):
        raise error(f"{label} = {value_text(value)}: give names of facet sets.")
    return names


@check_arguments(MeshError)
def fit_curves(
    mesh: Annotated[Mesh, Part(Mesh)],
    sets: Annotated[str | Sequence[str] | None, CheckedBy(_set_names)] = None,
    *,
    angle: Annotated[float, Number(above=0.0, below=90.0)] = _ANGLE,
) -> Mesh:
    """A mesh with the smooth curves or surfaces that its points lie on.

    For meshes of linear cells, whose holes and fillets are polygons: with curves `refine`, `adapt`
    and runs with a tolerance make them round, and bars of K know what the chords change. Circles
    are exact; other curves are far nearer than their chords. Straight sides stay as they are.

    Parameters
    ----------
    mesh : Mesh
    sets : str or sequence of str, optional
        Facet sets to look at; the whole boundary if omitted.
    angle : float, degrees
        Facets that turn by more from one to the next meet at a corner.

    Returns
    -------
    Mesh
        A set that is one smooth curved side has its curve; other curved sides are in sets
        ``curved_1``, ``curved_2`` ...

    Raises
    ------
    MeshError
        No such set.
    """
    names = ("boundary",) if sets is None else sets
    facets = np.concatenate([facet_set(mesh, name, "fit_curves") for name in names])
    facets = np.unique(np.sort(facets, axis=1), axis=0)
    pairs, offset = _arcs(mesh, facets, angle)
    middles = mesh.points[pairs].mean(axis=1) + offset
    return with_curves(mesh, facets, raised_lattice(mesh, facets, pairs, middles))


def _sets_to_fit(value: Any, label: str, error: Error) -> bool | tuple[str, ...]:
    """Yes or no, or names of facet sets."""
    if isinstance(value, bool):
        return flag(value, label, error=error)
    return _set_names(value, label, error)


Fit = Annotated[bool | str | Sequence[str], CheckedBy(_sets_to_fit)]


def with_fitted_curves(mesh: Mesh, sets: bool | str | Sequence[str], source: str) -> Mesh:
    """The mesh of a file with the curves that are asked for, or a warning where it looks like them.

    Parameters
    ----------
    mesh : Mesh
    sets : bool or names
        True: of the whole boundary.
    source : str
        Name of the file, for the message.
    """
    if sets:
        return fit_curves(mesh, None if sets is True else sets)
    warn_of_chords(mesh, source, float(np.radians(_COARSE)), "Read with fit_curves=True it has")
    return mesh


def warn_of_chords(mesh: Mesh, label: str, least_turn: float, remedy: str) -> None:
    """Say where facets without a curve turn like chords of one.

    Parameters
    ----------
    mesh : Mesh
    label : str
        What the message begins with.
    least_turn : float, rad
        From one facet to the next, of which nothing is said.
    remedy : str
        What has the curves through the points of the mesh.
    """
    curved_numbers = [numbers_of(mesh, mesh.facet_sets[name]) for name in mesh.curves]
    facets = mesh.boundary
    if curved_numbers:
        facets = facets[~np.isin(numbers_of(mesh, facets), np.concatenate(curved_numbers))]
    if not len(facets):
        return
    cosine = _neighbours(facets, _facet_normals(mesh, facets))[2]
    if not ((cosine > np.cos(np.radians(_ANGLE))) & (cosine < np.cos(least_turn / 2))).any():
        return
    pairs, offset = _arcs(mesh, facets, _ANGLE)
    length = np.linalg.norm(mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]], axis=1)
    turn = 8 * np.linalg.norm(offset, axis=1) / length
    k = int(np.argmax(turn))
    if turn[k] > least_turn:
        change = turn[k] ** 2 / OF_TURN
        warn(
            f"{label}: facets near {at(mesh.points[pairs[k, 0]])} turn by about "
            f"{np.degrees(turn[k]):.0f} degrees from one to the next, like chords of a curve that "
            f"straight cells have lost: K at a crack there is then about {change:.1%} "
            f"off. {remedy} the curves through its points; cells of second order hold them."
        )


def _arcs(mesh: Mesh, facets: Ints, angle: float) -> tuple[Ints, Floats]:
    """Edges of facets `(e, 2)`, and how far the curve through the points is off their middles."""
    normal = _facet_normals(mesh, facets)
    side = _sides(facets, normal, _labels(mesh, facets), angle)
    # A point of two sides has a normal of each.
    key, node = np.unique(
        np.stack([np.repeat(side, mesh.dim), facets.ravel()], axis=1), axis=0, return_inverse=True
    )
    corner = node.reshape(facets.shape)
    edges = edges_of(corner)
    x = mesh.points[key[:, 1]]
    normals = _normals(x, _ring(edges, len(x)), _mean_normals(corner, normal, len(x)))
    return _at_shared_edges(key[edges, 1], *_heights(x, normals, edges))


def _facet_normals(mesh: Mesh, facets: Ints) -> Floats:
    normal = outward_areas(mesh, facets, "fit_curves")
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _labels(mesh: Mesh, facets: Ints) -> Ints:
    """A number for each facet `(k,)`, the same where they are in the same sets."""
    number = numbers_of(mesh, facets)
    members = [np.isin(number, numbers_of(mesh, f)) for f in mesh.facet_sets.values()]
    return np.unique(np.array(members), axis=1, return_inverse=True)[1].ravel()


def _neighbours(facets: Ints, normal: Floats) -> tuple[Ints, Ints, Floats]:
    """Pairs of facets that meet `(j,)`, and the cosines of the turns between them."""
    a, b = (ridge % len(facets) for ridge in ridges(facets))
    return a, b, np.einsum("jd,jd->j", normal[a], normal[b])


def _sides(facets: Ints, normal: Floats, label: Ints, angle: float) -> Ints:
    """Number of the smooth side of each facet `(k,)`: no turn from one to the next is sharp.

    Where sets divide the boundary a curve may end, as where a straight side goes on.
    """
    a, b, cosine = _neighbours(facets, normal)
    is_smooth = (label[a] == label[b]) & (cosine > np.cos(np.radians(angle)))
    return sides_of_facets(len(facets), a[is_smooth], b[is_smooth])


def _ring(edges: Ints, count: int) -> tuple[Ints, Ints]:
    """Points `(r,)` and their neighbours, next ones and those behind them."""
    links = np.ones(2 * len(edges))
    pairs = (np.concatenate([edges[:, 0], edges[:, 1]]), np.concatenate([edges[:, 1], edges[:, 0]]))
    next_to = csr_array((links, pairs), shape=(count, count))
    row, neighbour = (next_to + next_to @ next_to).nonzero()
    is_other = row != neighbour
    return row[is_other], neighbour[is_other]


def _mean_normals(corner: Ints, normal: Floats, count: int) -> Floats:
    """Unit means of the normals of the facets around each point."""
    mean = np.zeros((count, normal.shape[1]))
    for column in corner.T:
        np.add.at(mean, column, normal)
    return np.asarray(mean / np.linalg.norm(mean, axis=1, keepdims=True))


def _normals(x: Floats, ring: tuple[Ints, Ints], normal: Floats) -> Floats:
    """Unit normals for which the curvatures towards the neighbours are those of a paraboloid.

    2 d·n / d² = κ(t) + 2 g·d / d² of a tangent direction t, with a form κ and the tilt g of n.
    """
    row, neighbour = ring
    d = x[neighbour] - x[row]
    length = np.linalg.norm(d, axis=1)
    first = np.searchsorted(row, np.arange(len(x)))
    scale = np.add.reduceat(length, first) / np.bincount(row)
    for _ in range(_PASSES):
        tangents = _tangents(normal)
        shadow = np.einsum("qkd,qd->qk", tangents[row], d)
        direction = shadow / np.maximum(np.linalg.norm(shadow, axis=1), 1e-300)[:, None]
        squares = [
            direction[:, i] * direction[:, j] * (length / scale[row])
            for i in range(shadow.shape[1])
            for j in range(i + 1)
        ]
        table = np.stack([*squares, *(2 * shadow / length[:, None]).T], axis=1)
        weight = (scale[row] / length) ** _NEARNESS
        value = 2 * np.einsum("qd,qd->q", d, normal[row]) / length
        rows = weight[:, None] * table
        n = table.shape[1]
        matrix = np.empty((len(x), n, n))
        for i in range(n):
            for j in range(n):
                matrix[:, i, j] = np.add.reduceat(rows[:, i] * table[:, j], first)
        vector = np.add.reduceat(rows * value[:, None], first)
        size = np.trace(matrix, axis1=1, axis2=2)[:, None, None]
        fit = np.linalg.solve(matrix + _LEAST * size * np.eye(n), vector[..., None])
        tilt = fit[:, len(squares) :, 0]
        normal = normal - np.einsum("pk,pkd->pd", tilt, tangents)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return normal


def _tangents(normal: Floats) -> Floats:
    """Unit vectors across normals `(n, d - 1, d)`."""
    if normal.shape[1] == 2:
        return np.stack([normal[:, ::-1] * (-1, 1)], axis=1)
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = np.cross(normal, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def _heights(x: Floats, normal: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """Heights of the arcs over edges `(e,)`, and the unit normals there `(e, d)`."""
    a, b = edges.T
    d = x[b] - x[a]
    square = np.einsum("ed,ed->e", d, d)
    at_a = 2 * np.einsum("ed,ed->e", d, normal[a]) / square
    at_b = -2 * np.einsum("ed,ed->e", d, normal[b]) / square
    half = np.sqrt(square) / 2
    bend = _curvature_between(at_a, at_b) * half
    height = -half * bend / (1 + np.sqrt(np.maximum(1 - bend * bend, 0.0)))
    up = normal[a] + normal[b]
    up -= (np.einsum("ed,ed->e", up, d) / square)[:, None] * d
    up /= np.maximum(np.linalg.norm(up, axis=1), 1e-300)[:, None]
    return np.where(np.abs(bend) < 1, height, 0.0), up


def _at_shared_edges(pairs: Ints, height: Floats, up: Floats) -> tuple[Ints, Floats]:
    """Edges, each once, and what their middles are off the chord `(e, d)`.

    Where two sides meet, the edge has the height of each along its normal.
    """
    pairs, row, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(row.ravel(), kind="stable")
    first = order[np.concatenate([[0], np.cumsum(count)[:-1]])]
    offset = height[first, None] * up[first]
    is_shared = count == 2
    a, b = first[is_shared], order[np.cumsum(count)[is_shared] - 1]
    cosine = np.einsum("ed,ed->e", up[a], up[b])
    is_one = np.abs(cosine) > _PARALLEL
    sine_square = np.where(is_one, 1.0, 1 - cosine * cosine)[:, None]
    of_a, of_b = height[a] - cosine * height[b], height[b] - cosine * height[a]
    crossing = (of_a[:, None] * up[a] + of_b[:, None] * up[b]) / sine_square
    mean = (height[a, None] * up[a] + height[b, None] * up[b]) / 2
    offset[is_shared] = np.where(is_one[:, None], mean, crossing)
    return pairs, offset


def _curvature_between(a: Floats, b: Floats) -> Floats:
    """The mean where both ends agree, else the smaller one: straight sides end arcs smoothly."""
    smaller = np.where(np.abs(a) < np.abs(b), a, b)
    is_alike = np.maximum(np.abs(a), np.abs(b)) < _ALIKE * np.abs(smaller)
    return np.where(a * b <= 0, 0.0, np.where(is_alike, (a + b) / 2, smaller))


__all__ = ["OF_TURN", "Fit", "fit_curves", "warn_of_chords", "with_fitted_curves"]
