"""K along the fronts of a solution in 3D: radii, points, loads, and values at the vertices."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, gradients_at
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import warn
from xcrack.base.threads import streamed
from xcrack.crack.front_curve import Feet, FrontCurve, front_curve
from xcrack.fem.loads import position
from xcrack.fem.quadrature import cell_points, cell_side
from xcrack.mesh.locate import Body, contains
from xcrack.mesh.simplex import leg_size
from xcrack.sif.accuracy import Domain, check
from xcrack.sif.common import acts, lip_pressure, lip_shear, mean_rotation, with_closed
from xcrack.sif.interaction_3d import (
    front_nodes,
    full_measure,
    inside_body,
    integrals,
    lip_integrals,
    solve_front,
)
from xcrack.sif.sif import SIF
from xcrack.sif.smoothing_3d import along, smoothed

SECOND = 0.7  # outer radius of the second domain, as a share of the first
_OUTER = 2.6  # least outer radius, in legs of the cells at the front
# Outer radius in radii of the enriched tube: the error sits in the cells at its rim, and a domain
# that reaches beyond them makes K of a penny 1 % too low.
_REACH = 1.05
_BENT = 0.9  # largest outer radius, as a share of the radius of curvature of the front
_SPACING = 2.0  # of the hats, in legs: with less K scatters more
_SMOOTH = 12  # hats; fewer are so far apart that smoothing would cut off what varies
_LEAST = 1.2  # legs; the radius of the smallest domain
_POINTS, _DEGREE = 5, 5  # of the rules around the front and away from it
_NARROW = 1.5  # legs; a domain clipped below gives a warning
_DIFFER = 0.05  # difference of two domains, as a share of the largest K, that gives a warning
_CHUNK = 1000  # cells integrated at once; bounds the memory
_SAMPLES = 400  # points of an open front among which its way into the body is looked for


def tube_of(solution: Solution, t: int, curve: FrontCurve, ends: tuple[float, float]) -> Domain:
    """Radius of the tube around a front, and the room for it.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the front in `solution.space.tips`.
    curve : FrontCurve
        Of that front.
    ends : tuple of float, length
        Where an open front enters and leaves the body.
    """
    space = solution.space
    tip = space.tips[t]
    cells = space.cuts[tip.crack].level_set.tip_cells[tip.number]
    size = leg_size(space.mesh, cells)
    wanted = solution.problem.numerics.domain
    if wanted is None:
        wanted = max(_OUTER * size, _REACH * tip.radius)
    s = np.linspace(*ends, max(8, round((ends[1] - ends[0]) / (2 * size))) + 1)
    x = curve.at(s)[0]
    # Near its exits a front is close to the boundary; that is dealt with by leaving out hats, and
    # neither that nor a bend there must narrow the whole tube.
    inner = np.ones(len(s), dtype=bool)
    ahead = 0.0 if curve.closed else min(wanted, 0.4 * (ends[1] - ends[0]))
    if not curve.closed:
        inner = np.minimum(s - ends[0], ends[1] - s) >= ahead
    room = _BENT * _bends(curve, s, (ends[0] + ahead, ends[1] - ahead), 2 * size)
    depth = np.abs(Body.of(space.mesh).depth(x[inner])[0])
    room[inner] = np.minimum(room[inner], 0.95 * depth)
    for other in space.tips:
        if other is not tip:
            room = np.minimum(room, 0.8 * cKDTree(other.x).query(x)[0])
    for c, lips in enumerate(solution.lips):
        if c != tip.crack and len(lips):
            room = np.minimum(room, 0.9 * cKDTree(lips.x).query(x)[0])
    least = float(room.min())
    return Domain(
        outer=min(wanted, max(least, _LEAST * size)),
        wanted=wanted,
        room=least,
        least=_NARROW * size,
        short=False,
        size=size,
        narrowest=x[int(room.argmin())],
        differ=_DIFFER,
        label="K along the front, at",
    )


def _bends(curve: FrontCurve, s: Floats, between: tuple[float, float], over: float) -> Floats:
    """Smallest radius of curvature around each of evenly spaced parameters `(k,)`, length."""
    half = 0.51 * (s[1] - s[0])
    low, high = np.maximum(s - half, between[0]), np.minimum(s + half, between[1])
    return np.array([curve.sharpest(a, b, over) for a, b in zip(low, high, strict=True)])


def way_inside(solution: Solution, curve: FrontCurve) -> tuple[float, float] | None:
    """Parameters at which an open front enters and leaves the body; None if it never does."""
    if curve.closed:
        return 0.0, curve.length
    mesh = solution.space.mesh
    s = np.linspace(0.0, curve.length, _SAMPLES + 1)
    inside = np.nonzero(contains(mesh, curve.at(s)[0]))[0]
    if not len(inside):
        return None
    ends = []
    for last, step in ((int(inside[0]), -1), (int(inside[-1]), 1)):
        within = s[last]
        outside = s[min(max(last + step, 0), _SAMPLES)]
        for _ in range(30 if outside != within else 0):
            middle = (within + outside) / 2
            if contains(mesh, curve.at(np.array([middle]))[0])[0]:
                within = middle
            else:
                outside = middle
        ends.append(float(within))
    return ends[0], ends[1]


def front_intensity(solutions: Sequence[Solution], t: int) -> list[SIF]:
    """K at the vertices of one front in the body, for several load states of one solve.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    t : int
        Number of the front in `space.tips`.

    Returns
    -------
    list of SIF
        Zero, with a warning, where the front is too short for K.
    """
    space = solutions[0].space
    tip = space.tips[t]
    number = space.cracks[tip.crack].fronts or ()
    closed = bool(number[tip.number][0] == number[tip.number][-1])
    curve = front_curve(tip.x, tip.frame, closed)
    at_vertex = curve.breaks[: len(tip.x)]
    knots, K, valid, domain = front_values(solutions, t, curve)
    inside = contains(space.mesh, np.array(tip.x))
    if not valid.any():
        K = np.zeros_like(K)
        _warn_short(np.array(tip.x)[inside] if inside.any() else np.array(tip.x))
    _, frame, _ = curve.at(at_vertex)
    shape = (int(inside.sum()),)
    result = []
    for solution, values in zip(
        solutions, along(K, knots, valid, curve, at_vertex)[:, :, inside], strict=True
    ):
        sif = SIF(
            x=np.array(tip.x)[inside],
            frame=frame[inside],
            K=values[0],
            T=np.full(shape, np.nan),
            spread=np.abs(values[0] - values[1]),
            s=curve.arc(at_vertex)[inside],
            front=np.zeros(shape, dtype=np.int64),
            at_surface=~_covered(curve, knots, valid, at_vertex)[inside],
            closed=np.zeros(shape, dtype=bool),
            domain_cells=np.full(shape, 0.0 if domain is None else domain.outer / domain.size),
        )
        if domain is not None:
            sif = with_closed(sif, solution, tip.crack, domain.size)
        result.append(sif)
    if domain is not None and valid.any() and inside.any():
        check(solutions, t, domain, result)
    return result


def _warn_short(x: Floats) -> None:
    warn(
        f"the front from {np.round(x[0], 6).tolist()} to {np.round(x[-1], 6).tolist()} is too "
        "short inside the body for K: no domain around it is whole. K counts as 0 there, and it "
        "does not grow. Refine the mesh around it."
    )


def _covered(curve: FrontCurve, knots: Floats, valid: Bools, s: Floats) -> Bools:
    """Which parameters lie between two valid tops of hats."""
    if curve.closed:
        left = np.mod(np.searchsorted(knots, s * (1 + 1e-12), side="right") - 1, len(knots))
        return np.asarray(valid[left] & valid[(left + 1) % len(knots)])
    left = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    within = (s >= knots[0]) & (s <= knots[-1])
    return np.asarray(within & valid[left] & valid[left + 1])


def front_values(
    solutions: Sequence[Solution], t: int, curve: FrontCurve
) -> tuple[Floats, Floats, Bools, Domain | None]:
    """K at the tops of the hats of one front.

    Parameters
    ----------
    solutions : sequence of Solution
    t : int
    curve : FrontCurve

    Returns
    -------
    knots : (p,) array, length
    K : (n, 2, p, 3) array, stress · √length
        Of n states and two domains; smoothed where there are hats enough.
    valid : (p,) array of bool
        Hats whose domains lie in the body.
    domain : Domain
        None where no part of the front lies in the body.
    """
    ends = way_inside(solutions[0], curve)
    if ends is None:
        knots = front_nodes(curve, curve.length)
        return (
            knots,
            np.full((len(solutions), 2, len(knots), 3), np.nan),
            np.zeros(len(knots), bool),
            None,
        )
    domain = tube_of(solutions[0], t, curve, ends)
    outer, size = domain.outer, domain.size
    radii = np.array([outer, SECOND * outer])
    knots = front_nodes(curve, _SPACING * size, None if curve.closed else ends)
    distance = curve.distance(solutions[0].space.mesh.points, outer)
    turn = np.stack([mean_rotation(s, distance, outer) for s in solutions], axis=-1)
    total = _lip_part(solutions, t, curve, knots, radii, turn)
    measure = np.zeros((len(radii), len(knots)))
    for part, volume in _domain_parts(solutions, t, curve, knots, radii, turn):
        total += part
        measure += volume
    valid = inside_body(measure, full_measure(curve, knots, radii))
    if not curve.closed:
        valid[[0, -1]] = False
    K = solve_front(total, knots, curve, solutions[0].problem.material, valid)
    rows = np.nonzero(valid)[0]
    period = curve.length if curve.closed and valid.all() else None
    if len(rows) >= _SMOOTH:
        K[:, :, rows] = smoothed(K[:, :, rows], knots[rows], period)
    return knots, K, valid, domain


def _domain_parts(
    solutions: Sequence[Solution],
    t: int,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    turn: Floats,
) -> Iterator[tuple[Floats, Floats]]:
    """Domain integrals of the hats and their measures, of the same chunks for any threads."""
    space = solutions[0].space
    tip = space.tips[t]
    mesh, psi = space.mesh, space.cuts[tip.crack].level_set.psi[tip.number]
    outer = float(radii.max())
    coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
    initial = partial(_initial, solutions) if acts(solutions, "initial_stress") else None
    middle = mesh.points[mesh.cells].mean(axis=1)
    reach = 1.05 * outer
    distance = curve.distance(middle, reach + float(mesh.cell_size.max())) - reach
    cells = np.nonzero(distance <= mesh.cell_size)[0]
    reach = np.linalg.norm(mesh.points[mesh.cells[cells]] - middle[cells, None], axis=2).max(axis=1)
    cells = cells[distance[cells] <= reach]

    def part(first: int) -> tuple[Floats, Floats] | None:
        points = cell_points(space, cells[first : first + _CHUNK], _POINTS, _DEGREE, True)
        x = position(space, points.cell, points.bary)
        near, feet = curve.near(x, outer)
        if not len(near):
            return None
        points = points.chosen(near)
        gradient = gradients_at(space, coefficients, points.cell, points.bary, points.side)
        behind = np.einsum("qb,qb->q", psi[mesh.cells[points.cell]], points.bary) < 0
        return integrals(
            curve,
            knots,
            feet,
            points.weight,
            gradient - turn,
            points.side[:, tip.crack],
            behind,
            solutions[0].problem.material,
            radii,
            force=_force(solutions, x[near]),
            initial=initial,
        )

    chunks = range(0, len(cells), _CHUNK)
    # Functions of the user are called by one thread alone.
    own = acts(solutions, "volume", "initial_stress")
    parts = map(part, chunks) if own else streamed(part, chunks)
    yield from (result for result in parts if result is not None)


def _force(solutions: Sequence[Solution], x: Floats) -> Floats | None:
    """Body forces of all states `(q, 3, n)`."""
    if not acts(solutions, "volume"):
        return None
    total = np.zeros((len(x), 3, len(solutions)))
    for n, solution in enumerate(solutions):
        for load, factor in solution.acting:
            if "volume" in load.acts:
                total[:, :, n] += factor * load.volume(x)
    return total


def _initial(solutions: Sequence[Solution], x: Floats) -> Floats:
    return np.stack([solution.initial_stress(x) for solution in solutions], axis=-1)


def _lip_part(
    solutions: Sequence[Solution],
    t: int,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    turn: Floats,
) -> Floats:
    """Lip integrals of the hats `(n, k, 3, p)`."""
    space = solutions[0].space
    c = space.tips[t].crack
    lips, outer = solutions[0].lips[c], float(radii.max())
    near, feet = curve.near(lips.x, outer)
    feet = _as_seen(solutions[0], t, near, feet)
    pressure = np.stack([lip_pressure(solution, c)[near] for solution in solutions], axis=-1)
    inside = feet.r < outer
    height = np.abs(feet.local[inside, 1]).max(initial=0.0)
    bent = height > 1e-9 * outer
    traction = lips.normal[near][:, :, None] * pressure[:, None]
    for k, shear in enumerate(lip_shear(solution, c) for solution in solutions):
        if shear is not None:
            traction[:, :, k] += shear[near]
    if not bent and not traction.any():
        return np.zeros((len(solutions), len(radii), 3, len(knots)))
    gradient = None
    if bent:
        coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
        both = [
            gradients_at(space, coefficients, *_on_lip(solutions[0], c, near, s, sign)) - turn
            for s, sign in ((0, -1), (1, 1))
        ]
        gradient = np.stack(both)
    return lip_integrals(
        curve,
        knots,
        feet,
        lips.normal[near],
        lips.weight[near],
        traction,
        solutions[0].problem.material,
        radii,
        gradient=gradient,
        initial=partial(_initial, solutions) if acts(solutions, "initial_stress") else None,
    )


def _as_seen(solution: Solution, t: int, rows: Ints, feet: Feet) -> Feet:
    """Feet of points on the crack faces, x1 measured from the front that the cells see.

    The crack faces end at its chords, and so does the pressure: on a lip the auxiliary field goes
    like the inverse root of x1, and a strip of 1 % that chords cut off would lose 10 % of the term.
    """
    space = solution.space
    tip = space.tips[t]
    lips = solution.lips[tip.crack]
    corner = space.mesh.cells[lips.cell[rows, 1]]
    psi = space.cuts[tip.crack].level_set.psi[tip.number][corner]
    ahead = np.einsum("qb,qb->q", lips.bary[rows, 1], psi)
    local = np.array(feet.local)
    # Out of reach of the tube psi has only a sign.
    known = np.abs(ahead - local[:, 0]) < tip.radius
    local[known, 0] = ahead[known]
    return replace(feet, local=local)


def _on_lip(solution: Solution, c: int, rows: Ints, s: int, sign: int) -> tuple[Ints, Floats, Ints]:
    """Cells, places and sides of points on one lip."""
    lips = solution.lips[c]
    cell = lips.cell[rows, s]
    side = cell_side(solution.space, cell)
    side[:, c] = sign
    return cell, lips.bary[rows, s], side
