"""What a shape that the mesh or the cut misses does to functionals, to first order.

Where the boundary of the model must move outward by delta, a functional with the dual solution z
changes by -int delta sigma(u) : eps(z) ds on boundaries free of traction (the shape derivative of
an energy product; Sokolowski and Zolésio, 1992).
"""

from collections.abc import Callable, Sequence

import numpy as np

from xcrack.analysis.solution import Solution, fields_at, gradients_at
from xcrack.base.arrays import Floats, Ints
from xcrack.estimate.estimate import Estimate, pressure_on
from xcrack.fem.loads import facet_points, position
from xcrack.fem.quadrature import Points, lip_side
from xcrack.mesh.mesh import Mesh

_ROUND = 0.9  # rad; facets that turn by more meet at a corner
_ALIKE = 3.0  # ratio of the turns at both ends of a facet of a curve
# Share of each absolute contribution of a crack's shape that is in doubt: where it is smooth, of
# each point of open faces, and a larger one of what a stretch of some cells contributes where they
# press, over which the tilt is there and back; and besides at kinks, of each point, all of it from
# a turn of so many rad on (measured: half of what a kink of 1 rad changes is of first order).
_STRETCH = 4.0
_OPEN, _SMOOTH, _KINK, _BLUNT = 0.1, 0.2, 0.9, 0.5


def crack_shape(
    solutions: Sequence[Solution],
    estimated: Estimate,
    c: int,
    singular: Callable[[], tuple[Floats, Floats]],
) -> tuple[Floats, Floats]:
    """Crack c as it was given, not as the cells cut it: changes `(states, m)`, and their bars.

    The cut is straight in each cell: it rounds kinks off and follows arcs by chords. Faces under a
    pressure p that move by delta and turn by dn change a functional by int delta [[sigma(u) :
    eps(z) + p n . grad z n - mu n . grad u n]] + dn . [[p z - mu u]] ds, mu the dual pressure.

    Parameters
    ----------
    solutions : sequence of Solution
    estimated : Estimate
    c : int
    singular : callable
        Values `(2, q, 2, m)` and gradients `(2, q, 2, 2, m)` on the faces - and + that z has and
        influence functions have not; called where the crack is not straight.
    """
    space, lips = solutions[0].space, solutions[0].lips[c]
    z, mu = estimated.z, estimated.mu[c]
    nothing = np.zeros((len(solutions), z.shape[2]))
    foot, turn, normal, way = _nearest_on(space.cracks[c].points, lips.x)
    away = _along_normal(foot - lips.x, lips.normal)
    n = lips.normal
    normal = normal * np.sign(np.einsum("qd,qd->q", normal, n))[:, None]
    moved = np.nonzero(np.abs(away) > 1e-9 * space.mesh.extent)[0]
    if not len(moved):
        return nothing, nothing
    values, slopes = (part[:, moved] for part in singular())
    n, turned = n[moved], (normal - n)[moved]
    pressure = np.stack([pressure_on(s, c)[moved] for s in solutions], axis=1)
    shifted, tilted = np.zeros((2, len(moved), *nothing.shape))
    for s, sign in ((0, -1.0), (1, 1.0)):
        cell = lips.cell[moved, s]
        side = lip_side(space, c, cell, lips.bary[moved, s], int(sign))
        u, gradient = fields_at(space, _columns(solutions, z), cell, lips.bary[moved, s], side)
        for k, solution in enumerate(solutions):
            gradient_of_goal, first = gradient[..., k], len(solutions) + k * z.shape[2]
            dual = gradient[..., first : first + z.shape[2]] - slopes[s]
            weight = u[..., first : first + z.shape[2]] - values[s]
            sigma = solution.problem.elasticity.stress(gradient_of_goal, cell, lips.bary[moved, s])
            shifted[:, k] += sign * np.einsum("qij,qijm->qm", sigma, dual)
            normals = np.einsum("qi,qijm,qj->qm", n, dual, n)
            shifted[:, k] += sign * pressure[:, k, None] * normals
            opening = np.einsum("qi,qij,qj->q", n, gradient_of_goal, n)
            shifted[:, k] -= sign * mu[k][moved] * opening[:, None]
            slid = np.einsum("qi,qim->qm", turned, weight) * pressure[:, k, None]
            slid -= np.einsum("qi,qi->q", turned, u[..., k])[:, None] * mu[k][moved]
            tilted[:, k] += sign * slid
    parts = lips.weight[moved][:, None, None] * (away[moved][:, None, None] * shifted + tilted)
    blunt = np.minimum(turn[moved] / _BLUNT, 1.0)
    presses = pressure.any(axis=1) | np.any([each[moved].any(axis=1) for each in mu], axis=0)
    smooth = (1 - blunt)[:, None, None] * parts
    cells = lips.weight / space.mesh.cell_size[lips.cell[:, 0]]
    order = np.argsort(way, kind="stable")
    stretch = np.empty(len(lips), dtype=np.int64)
    stretch[order] = np.cumsum(cells[order]) / _STRETCH
    of_stretch = np.zeros((int(stretch.max()) + 1, *nothing.shape))
    np.add.at(of_stretch, stretch[moved][presses], smooth[presses])
    doubt = _SMOOTH * np.abs(of_stretch).sum(axis=0)
    doubt += _OPEN * np.abs(smooth[~presses]).sum(axis=0)
    doubt += (_SMOOTH + _KINK) * np.einsum("q,qkm->km", blunt, np.abs(parts))
    return parts.sum(axis=0), doubt


def rim_shape(solutions: Sequence[Solution], z: Floats) -> tuple[Floats, Floats]:
    """Curved boundaries as they are, not as polygons: changes `(states, m)`.

    Boundaries are taken as free of traction.

    Returns
    -------
    shape_terms : (states, m) array
        Where the mesh knows the curve.
    guessed : (states, m) array
        Where facets look like chords of a curve that it does not know.
    """
    mesh = solutions[0].space.mesh
    sides = [(mesh.facet_sets[name], curve) for name, curve in mesh.curves.items()]
    shape_terms = np.zeros((len(solutions), z.shape[2]))
    for facets, curve in sides:
        points, normal = facet_points(solutions[0].space, facets, 3)
        x = position(solutions[0].space, points.cell, points.bary)
        away = np.einsum("qd,qd->q", np.asarray(curve(x)) - x, normal)
        shape_terms -= _boundary_changes(solutions, z, points, away)
    facets, sagitta = _chords(mesh)
    if len(facets) and sides:
        curved = mesh.facet_numbers(np.concatenate([facets for facets, _ in sides]))
        other = ~np.isin(mesh.facet_numbers(facets), curved)
        facets, sagitta = facets[other], sagitta[other]
    if not len(facets):
        return shape_terms, np.zeros_like(shape_terms)
    points, _ = facet_points(solutions[0].space, facets, 3)
    of_cell = np.zeros(len(mesh.cells))
    of_cell[mesh.facet_to_cell[mesh.facet_numbers(facets), 0]] = sagitta
    return shape_terms, -_boundary_changes(solutions, z, points, of_cell[points.cell])


def _boundary_changes(
    solutions: Sequence[Solution], z: Floats, points: Points, away: Floats
) -> Floats:
    """Integral of away sigma(u) : eps(z) over boundary points `(states, m)`."""
    density = _products(solutions, z, (points.cell, points.bary, points.side))
    return np.asarray(np.einsum("q,qkm->km", points.weight * away, density))


def _nearest_on(polyline: Floats, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Nearest points on a polyline, its turn at the next vertex, its normal there, and way there.

    Turns and ways along the line are `(q,)`.
    """
    a, along = polyline[:-1], np.diff(polyline, axis=0)
    t = np.einsum("qsd,sd->qs", x[:, None] - a, along) / (along * along).sum(axis=1)
    t = np.clip(t, 0.0, 1.0)
    foot = a + t[..., None] * along
    best = np.linalg.norm(x[:, None] - foot, axis=2).argmin(axis=1)
    row = np.arange(len(x))
    heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    turn = np.concatenate([[0.0], np.abs(np.diff(heading)), [0.0]])
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    length = np.linalg.norm(along, axis=1)
    way = (np.cumsum(length) - length)[best] + t[row, best] * length[best]
    return foot[row, best], turn[best + (t[row, best] > 0.5)], normal[best], way


def _along_normal(way: Floats, normal: Floats) -> Floats:
    """Distances along the normal to lines whose nearest points are given by the way there."""
    across = np.einsum("qd,qd->q", way, normal)
    square = np.einsum("qd,qd->q", way, way)
    steep = across * across < 0.5 * square  # at a vertex, or far from parallel
    return np.where(steep, across, square / np.where(steep, 1.0, across + (across == 0)))


def _columns(solutions: Sequence[Solution], z: Floats) -> Floats:
    """Coefficients of the states, then of their dual solutions, with a last row of zeros."""
    columns = np.concatenate([np.stack([s.u for s in solutions], axis=1), *z], axis=1)
    stacked = columns.reshape(solutions[0].space.n_functions, 2, -1)
    return np.concatenate([stacked, np.zeros((1, *stacked.shape[1:]))])


def _products(
    solutions: Sequence[Solution], z: Floats, points: tuple[Ints, Floats, Ints]
) -> Floats:
    """sigma(u) : eps(z) at points given by cell, place and side `(q, states, m)`."""
    space, elasticity = solutions[0].space, solutions[0].problem.elasticity
    states, _, m = z.shape
    gradient = gradients_at(space, _columns(solutions, z), *points)
    result = np.empty((len(points[0]), states, m))
    for k in range(states):
        first = states + k * m
        dual = gradient[..., first : first + m]
        sigma = elasticity.stress(gradient[..., k], *points[:2])
        result[:, k] = np.einsum("qij,qijm->qm", sigma, dual)
    return result


def _chords(mesh: Mesh) -> tuple[Ints, Floats]:
    """Boundary facets that look like chords of a curve, and how far it lies outward in the mean."""
    facets = mesh.boundary
    cell = mesh.facet_to_cell[mesh.facet_to_cell[:, 1] < 0, 0]
    x = mesh.points[facets]
    along = x[:, 1] - x[:, 0]
    outward = x.mean(axis=1) - mesh.points[mesh.cells[cell]].mean(axis=1)
    backward = along[:, 0] * outward[:, 1] - along[:, 1] * outward[:, 0] > 0
    ends = np.where(backward[:, None], facets[:, ::-1], facets)  # the body on the left
    along = np.where(backward[:, None], -along, along)
    incoming, outgoing = np.full((2, mesh.n_points), -1)
    incoming[ends[:, 1]], outgoing[ends[:, 0]] = np.arange(len(ends)), np.arange(len(ends))
    heading = np.arctan2(along[:, 1], along[:, 0])
    before, after = incoming[ends[:, 0]], outgoing[ends[:, 1]]

    def turn(first: Ints, second: Ints) -> Floats:
        difference = heading[second] - heading[first]
        return np.asarray((difference + np.pi) % (2 * np.pi) - np.pi)

    facet_numbers = np.arange(len(ends))
    low, high = turn(before, facet_numbers), turn(facet_numbers, after)
    small, large = np.minimum(np.abs(low), np.abs(high)), np.maximum(np.abs(low), np.abs(high))
    curved = (before >= 0) & (after >= 0) & (low * high > 0) & (small > 1e-6)
    curved &= (large < _ROUND) & (large < _ALIKE * small)
    length = np.linalg.norm(along, axis=1)
    # An arc that turns by t over a chord of length L lies L t / 12 outside of it in the mean.
    sagitta = (low + high) / 2 * length / 12
    return ends[curved], sagitta[curved]
