"""What a shape that the mesh or the cut misses, and faces that overlap, do to functionals.

Where the boundary of the model must move outward by delta, a functional with the dual solution z
changes by -int delta sigma(u) : eps(z) ds on boundaries free of traction (the shape derivative of
an energy product; Sokolowski and Zolésio, 1992).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from xcrack.analysis.solution import Solution, fields_at, gradients_at
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.crack import turns
from xcrack.estimate.estimate import Estimate, given_pressure, pressure_on
from xcrack.fem.facets import LipPoints, lip_points
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import facet_points, position
from xcrack.fem.quadrature import Points, lip_side
from xcrack.mesh.mesh import Mesh

_ROUND = 1.1  # rad; facets that turn by more meet at a corner
_ALIKE = 6.0  # ratio of the turns at both ends of a chord of a curve, and of lengths of chords
_STRAIGHT = 1e-6  # rad; facets that turn by less lie in one line
# Share of each absolute contribution of a crack's shape that is in doubt: where it is smooth, of
# each point of open faces, and a larger one of what a stretch of some cells contributes where they
# press, over which the tilt is there and back; and besides at kinks, of each point, all of it from
# a turn of so many rad on (measured: half of what a kink of 1 rad changes is of first order).
_STRETCH = 4.0
_OPEN, _SMOOTH, _KINK, _BLUNT = 0.1, 0.2, 0.9, 0.5
# Turns of a polyline (rad) at which faces under pressure lock, if both legs are so many cells long;
# within a reach, in cells, of them or of a junction, gaps of closed faces are theirs.
_LOCKS, _LEG, _REACH = 0.03, 0.4, 1.5
# Change of a functional over E / h times the product of both gaps, at turns, where its sign is
# known; half-widths over the absolute products at turns, at junctions, elsewhere, and where faces
# that no pressure holds apart overlap.
_AT_TURNS = -1.6
_GAPS = (1.0, 1.9, 0.38, 1.8)
_DENSE = 24  # points of a piece of the faces, four times those of solutions


def crack_shape(
    solutions: Sequence[Solution],
    estimate: Estimate,
    c: int,
    singular_part: Callable[[], tuple[Floats, Floats]],
) -> tuple[Floats, Floats]:
    """Crack c as it was given, not as the cells cut it: changes `(states, m)`, and their bars.

    The cut is straight in each cell: it rounds kinks off and follows arcs by chords. Faces under a
    pressure p that move by delta and turn by dn change a functional by int delta [[sigma(u) :
    eps(z) + p n . grad z n - mu n . grad u n]] + dn . [[p z - mu u]] ds, mu the dual pressure.

    Parameters
    ----------
    solutions : sequence of Solution
    estimate : Estimate
    c : int
    singular_part : callable
        Values `(2, q, 2, m)` and gradients `(2, q, 2, 2, m)` on the faces - and + that z has and
        influence functions have not; called where the crack is not straight.
    """
    space, lips = solutions[0].space, solutions[0].lips[c]
    z, mu = estimate.z, estimate.mu[c]
    nothing = np.zeros((len(solutions), z.shape[2]))
    foot, turn, normal, way = _nearest_on(space.cracks[c].points, lips.x)
    offset = _along_normal(foot - lips.x, lips.normal)
    n = lips.normal
    normal = normal * np.sign(np.einsum("qd,qd->q", normal, n))[:, None]
    moved_points = np.nonzero(np.abs(offset) > 1e-9 * space.mesh.extent)[0]
    if not len(moved_points):
        return nothing, nothing
    values, slopes = (part[:, moved_points] for part in singular_part())
    n, normal_change = n[moved_points], (normal - n)[moved_points]
    pressure = np.stack([pressure_on(s, c)[moved_points] for s in solutions], axis=1)
    shifted, by_turn = np.zeros((2, len(moved_points), *nothing.shape))
    for s, sign in ((0, -1.0), (1, 1.0)):
        cell = lips.cell[moved_points, s]
        side = lip_side(space, c, cell, lips.bary[moved_points, s], int(sign))
        u, gradient = fields_at(
            space, _columns(solutions, z), cell, lips.bary[moved_points, s], side
        )
        for k, solution in enumerate(solutions):
            gradient_of_goal, first = gradient[..., k], len(solutions) + k * z.shape[2]
            dual = gradient[..., first : first + z.shape[2]] - slopes[s]
            weight = u[..., first : first + z.shape[2]] - values[s]
            sigma = solution.problem.elasticity.stress(
                gradient_of_goal, cell, lips.bary[moved_points, s]
            )
            shifted[:, k] += sign * np.einsum("qij,qijm->qm", sigma, dual)
            normals = np.einsum("qi,qijm,qj->qm", n, dual, n)
            shifted[:, k] += sign * pressure[:, k, None] * normals
            opening = np.einsum("qi,qij,qj->q", n, gradient_of_goal, n)
            shifted[:, k] -= sign * mu[k][moved_points] * opening[:, None]
            slip_work = np.einsum("qi,qim->qm", normal_change, weight) * pressure[:, k, None]
            slip_work -= (
                np.einsum("qi,qi->q", normal_change, u[..., k])[:, None] * mu[k][moved_points]
            )
            by_turn[:, k] += sign * slip_work
    parts = lips.weight[moved_points][:, None, None] * (
        offset[moved_points][:, None, None] * shifted + by_turn
    )
    bluntness = np.minimum(turn[moved_points] / _BLUNT, 1.0)
    has_traction = pressure.any(axis=1) | np.any(
        [mu_of_state[moved_points].any(axis=1) for mu_of_state in mu], axis=0
    )
    smooth_parts = (1 - bluntness)[:, None, None] * parts
    cells = lips.weight / space.mesh.cell_size[lips.cell[:, 0]]
    order = np.argsort(way, kind="stable")
    stretch = np.empty(len(lips), dtype=np.int64)
    stretch[order] = np.cumsum(cells[order]) / _STRETCH
    of_stretch = np.zeros((int(stretch.max()) + 1, *nothing.shape))
    np.add.at(of_stretch, stretch[moved_points][has_traction], smooth_parts[has_traction])
    doubt = _SMOOTH * np.abs(of_stretch).sum(axis=0)
    doubt += _OPEN * np.abs(smooth_parts[~has_traction]).sum(axis=0)
    doubt += (_SMOOTH + _KINK) * np.einsum("q,qkm->km", bluntness, np.abs(parts))
    return parts.sum(axis=0), doubt


@dataclass(frozen=True, eq=False)
class GapChanges:
    """What the gaps that closed faces have between their pressures' functions do to functionals.

    Attributes
    ----------
    change : (states, m) array
        Signed, of gaps where faces turn: they lock there, and slide too far on coarse cells.
    bar : (states, m) array
        Half-width of what all gaps do.
    by_cell : (states, m, cells) array
        Absolute contributions of cells.
    """

    change: Floats
    bar: Floats
    by_cell: Floats


def gap_changes(
    solutions: Sequence[Solution],
    known_error: Estimate,
    c: int,
    singular_fields: Callable[[], tuple[Floats, Floats]],
) -> GapChanges:
    """What finer pressures on closed faces would change.

    Faces that are closed in the mean of each pressure function have gaps g of either sign in
    between, and those that are open in the mean may overlap. A pressure of the size E g / h, h the
    cell, would close them; it changes a functional by its product with the gap of the dual
    solution, to a factor that is measured.

    Parameters
    ----------
    solutions : sequence of Solution
    known_error : Estimate
    c : int
        Crack of the functionals.
    singular_fields : callable
        As of `crack_shape`; called where faces are closed.
    """
    space, m = solutions[0].space, known_error.z.shape[2]
    places = np.array([j.x for j in solutions[0].problem.junctions]).reshape(-1, 2)
    change, by_zone = np.zeros((len(solutions), m)), np.zeros((len(_GAPS), len(solutions), m))
    by_cell = np.zeros((len(solutions), m, len(space.mesh.cells)))
    for k, solution in enumerate(solutions):
        for crack, contact in enumerate(solution.contact):
            if contact is not None and contact.shear is not None:
                continue
            lips, is_pressed = solution.lips[crack], np.zeros(len(solution.lips[crack]), dtype=bool)
            if contact is not None:
                is_pressed = np.asarray(contact.closed) & (np.asarray(contact.pressure) > 0)
            rows = np.nonzero(is_pressed | _are_overlapping(solution, crack))[0]
            if not len(rows):
                continue
            columns = _columns([solution], known_error.z[[k]])
            cell, x = lips.cell[rows, 0], lips.x[rows]
            size = space.mesh.cell_size[cell]
            gap = _gaps(space, columns, crack, lips, rows)
            if crack == c:
                gap[:, 1:] -= _opening_of(singular_fields()[0][:, rows], lips.normal[rows])
            modulus = solution.problem.elasticity.moduli_of_cells[cell]
            part = (modulus * lips.weight[rows] / size * gap[:, 0])[:, None] * gap[:, 1:]
            bends = _locking_points(space.cracks[crack].points, float(size.mean()))
            is_open = ~is_pressed[rows]
            at_junction = _is_near(x, places, _REACH * size) & ~is_open
            at_turn = _is_near(x, bends, _REACH * size) & ~at_junction & ~is_open
            change[k] += _AT_TURNS * part[at_turn].sum(axis=0)
            zones = at_turn, at_junction, ~at_turn & ~at_junction & ~is_open, is_open
            for zone, among in enumerate(zones):
                by_zone[zone, k] += np.abs(part[among]).sum(axis=0)
            np.add.at(by_cell[k].T, cell, np.abs(part))
    factor = np.array(_GAPS)[:, None, None]
    return GapChanges(change, np.sqrt(((factor * by_zone) ** 2).sum(axis=0)), by_cell)


def _are_overlapping(solution: Solution, c: int) -> Bools:
    """Points of crack c at which the faces lie over each other, where they may not `(q,)`."""
    lips = solution.lips[c]
    if solution.problem.contact == "off":
        return np.zeros(len(lips), dtype=bool)
    return np.asarray(np.einsum("qd,qd->q", solution.jump(c), lips.normal) < 0)


def load_changes(
    solutions: Sequence[Solution],
    z: Floats,
    c: int,
    singular_on: Callable[[LipPoints], tuple[Floats, Floats]],
) -> Floats:
    """What given pressures change that vary between the points of the faces `(states, m)`.

    The work of each on the gap of the dual solution, at points that are denser and at those of
    the solution: exact less computed value, but for a quarter at a jump, less at a bend.

    Parameters
    ----------
    solutions : sequence of Solution
    z : (states, n_dof, m) array
    c : int
        Crack of the functionals.
    singular_on : callable
        As `singular_part` of `crack_shape`, on faces of crack c that are given by points.
    """
    space, change = solutions[0].space, np.zeros((len(solutions), z.shape[2]))
    for crack, lips in enumerate(solutions[0].lips):
        if not any(np.ptp(given_pressure(s, crack, lips.x)) > 0 for s in solutions):
            continue
        for faces, sign in ((lips, -1.0), (lip_points(space, crack, _DENSE), 1.0)):
            singular_gap = _opening_of(singular_on(faces)[0], faces.normal) if crack == c else 0.0
            for k, solution in enumerate(solutions):
                gap = _gaps(space, _columns([solution], z[[k]]), crack, faces)[:, 1:] - singular_gap
                force = sign * faces.weight * given_pressure(solution, crack, faces.x)
                change[k] += force @ gap
    return change


def _gaps(
    space: FunctionSpace, columns: Floats, c: int, lips: LipPoints, rows: Ints | slice = slice(None)
) -> Floats:
    """Gaps between the faces of crack c at some of their points, of each column `(q, k)`."""
    u = []
    for s, sign in ((0, -1), (1, 1)):
        cell, bary = lips.cell[rows, s], lips.bary[rows, s]
        u.append(fields_at(space, columns, cell, bary, lip_side(space, c, cell, bary, sign))[0])
    return _opening_of(np.stack(u), lips.normal[rows])


def _opening_of(u: Floats, normal: Floats) -> Floats:
    """Opening of values on the faces - and + `(q, k)`."""
    return np.asarray(np.einsum("qi,qik->qk", normal, u[1] - u[0]))


def _locking_points(points: Floats, size: float) -> Floats:
    """Points of a polyline where it turns between legs that cells resolve `(k, 2)`."""
    leg = np.linalg.norm(np.diff(points, axis=0), axis=1)
    locks = (turns(points) > _LOCKS) & (np.minimum(leg[1:], leg[:-1]) > _LEG * size)
    return np.asarray(points[1:-1][locks])


def _is_near(x: Floats, places: Floats, reach: Floats) -> Bools:
    """Whether points are within a reach of one of some places `(q,)`."""
    distance = np.linalg.norm(x[:, None] - places, axis=2).min(axis=1, initial=np.inf)
    return np.asarray(distance < reach)


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
        offset = np.einsum("qd,qd->q", np.asarray(curve(x)) - x, normal)
        shape_terms -= _boundary_changes(solutions, z, points, offset)
    facets, legs, turn = _chords(mesh)
    is_curved = turn != 0
    if sides:
        curved_numbers = mesh.facet_numbers(np.concatenate([side for side, _ in sides]))
        is_curved &= ~np.isin(mesh.facet_numbers(facets), curved_numbers)
    if not is_curved.any():
        return shape_terms, np.zeros_like(shape_terms)
    facets, legs, turn = facets[is_curved], legs[is_curved], turn[is_curved]
    points, _ = facet_points(solutions[0].space, facets, 3)
    row_of_cell = np.zeros(len(mesh.cells), dtype=np.int64)
    row_of_cell[mesh.facet_to_cell[mesh.facet_numbers(facets), 0]] = np.arange(len(facets))
    row = row_of_cell[points.cell]
    x = position(solutions[0].space, points.cell, points.bary)
    # An arc that turns by t over a chord of length L is t a b / 2 L high, a and b from its ends.
    to_ends = np.linalg.norm(x[:, None] - legs[row], axis=2).prod(axis=1)
    length = np.linalg.norm(legs[row, 1] - legs[row, 0], axis=1)
    offset = turn[row] / 2 * to_ends / length
    return shape_terms, -_boundary_changes(solutions, z, points, offset)


def _boundary_changes(
    solutions: Sequence[Solution], z: Floats, points: Points, offset: Floats
) -> Floats:
    """Integral of away sigma(u) : eps(z) over boundary points `(states, m)`."""
    density = _products(solutions, z, (points.cell, points.bary, points.side))
    return np.asarray(np.einsum("q,qkm->km", points.weight * offset, density))


def _nearest_on(polyline: Floats, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Nearest points on a polyline, its turn at the next vertex, its normal there, and way there.

    Turns and ways along the line are `(q,)`.
    """
    a, segment = polyline[:-1], np.diff(polyline, axis=0)
    t = np.einsum("qsd,sd->qs", x[:, None] - a, segment) / (segment * segment).sum(axis=1)
    t = np.clip(t, 0.0, 1.0)
    foot = a + t[..., None] * segment
    leg = np.linalg.norm(x[:, None] - foot, axis=2).argmin(axis=1)
    row = np.arange(len(x))
    heading = np.unwrap(np.arctan2(segment[:, 1], segment[:, 0]))
    turn = np.concatenate([[0.0], np.abs(np.diff(heading)), [0.0]])
    normal = np.stack([-segment[:, 1], segment[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    length = np.linalg.norm(segment, axis=1)
    way = (np.cumsum(length) - length)[leg] + t[row, leg] * length[leg]
    return foot[row, leg], turn[leg + (t[row, leg] > 0.5)], normal[leg], way


def _along_normal(way: Floats, normal: Floats) -> Floats:
    """Distances along the normal to lines whose nearest points are given by the way there."""
    distance = np.einsum("qd,qd->q", way, normal)
    square = np.einsum("qd,qd->q", way, way)
    is_steep = distance * distance < 0.5 * square  # at a vertex, or far from parallel
    return np.where(
        is_steep, distance, square / np.where(is_steep, 1.0, distance + (distance == 0))
    )


def _columns(solutions: Sequence[Solution], z: Floats) -> Floats:
    """Coefficients of the states, then of their dual solutions, with a last row of zeros."""
    columns = np.concatenate([np.stack([s.u for s in solutions], axis=1), *z], axis=1)
    values_at_nodes = columns.reshape(solutions[0].space.n_functions, 2, -1)
    return np.concatenate([values_at_nodes, np.zeros((1, *values_at_nodes.shape[1:]))])


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


def _chords(mesh: Mesh) -> tuple[Ints, Floats, Floats]:
    """Facets of the boundary in 2D, ends of their legs `(k, 2, 2)`, and turns between legs.

    Facets in one line are one leg. Turns (rad, `(k,)`) are those between legs that look like chords
    of a curve, outward where positive; 0 elsewhere.
    """
    facets = mesh.boundary
    cell = mesh.facet_to_cell[mesh.facet_to_cell[:, 1] < 0, 0]
    x = mesh.points[facets]
    chord = x[:, 1] - x[:, 0]
    outward_direction = x.mean(axis=1) - mesh.points[mesh.cells[cell]].mean(axis=1)
    is_backward = chord[:, 0] * outward_direction[:, 1] - chord[:, 1] * outward_direction[:, 0] > 0
    ends = np.where(is_backward[:, None], facets[:, ::-1], facets)  # the body on the left
    chord = np.where(is_backward[:, None], -chord, chord)
    heading = np.arctan2(chord[:, 1], chord[:, 0])
    facet_from_point = np.full(mesh.n_points, -1)
    facet_from_point[ends[:, 0]] = np.arange(len(ends))
    next_facet = facet_from_point[ends[:, 1]]
    turn_to_next = (heading[next_facet] - heading + np.pi) % (2 * np.pi) - np.pi
    is_straight = (next_facet >= 0) & (np.abs(turn_to_next) < _STRAIGHT)
    links = (np.ones(int(is_straight.sum())), (is_straight.nonzero()[0], next_facet[is_straight]))
    n_legs, leg = connected_components(coo_array(links, shape=(len(ends),) * 2), directed=False)
    length = np.bincount(leg, np.linalg.norm(chord, axis=1), n_legs)
    end_facet = np.full(n_legs, -1)
    end_facet[leg[~is_straight]] = (~is_straight).nonzero()[0]
    next_leg = leg[next_facet[end_facet]]
    begin_facet = np.full(n_legs, -1)
    begin_facet[next_leg] = next_facet[end_facet]
    turn = turn_to_next[end_facet]
    leg_before = np.arange(n_legs)
    leg_before[next_leg] = np.arange(n_legs)
    turn_at_begin, turn_at_end = turn[leg_before], turn
    smaller_turn = np.minimum(np.abs(turn_at_begin), np.abs(turn_at_end))
    larger_turn = np.maximum(np.abs(turn_at_begin), np.abs(turn_at_end))
    neighbours = np.stack([length[leg_before], length[next_leg]])
    is_curved = (turn_at_begin * turn_at_end > 0) & (larger_turn < _ROUND)
    is_curved &= (larger_turn < _ALIKE * smaller_turn) & (length < _ALIKE * neighbours).all(axis=0)
    turn = np.where(is_curved, (turn_at_begin + turn_at_end) / 2, 0.0)
    legs = np.stack([ends[begin_facet, 0], ends[end_facet, 1]], axis=1)
    return ends, mesh.points[legs][leg], turn[leg]
