"""K along the fronts of a solution in 3D: hats, domains, loads, and values at the vertices."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution, gradients_at
from xcrack.base.arrays import Bools, Floats, Ints, at, lock
from xcrack.base.errors import warn
from xcrack.base.machine import stream_tasks
from xcrack.crack.fronts import FootPoints, FrontCurve
from xcrack.crack.junctions_3d import are_opposite
from xcrack.crack.stations import FrontInBody, front_in_body, inside_body
from xcrack.fem.function_space import Tip
from xcrack.fem.loads import position
from xcrack.fem.quadrature import cell_points, cell_side, lip_side
from xcrack.mesh.distances import closest_in, triangle_tree
from xcrack.mesh.simplex import leg_size
from xcrack.model.material import Isotropic
from xcrack.sif.accuracy import Domain, check
from xcrack.sif.common import (
    has_effect,
    initial_stresses,
    lip_pressure,
    lip_shear,
    mean_rotation,
    with_closed,
)
from xcrack.sif.front_materials import FrontMaterials, front_materials, warn_of_changes
from xcrack.sif.interaction_3d import (
    domain_integrals,
    front_nodes,
    lip_integrals,
    mean_integrals,
    reading_of_modes,
    smooth_values,
    solve_front,
    twice_as_wide,
)
from xcrack.sif.sides_3d import (
    Sides,
    before_junctions,
    integrals_of_sides,
    on_smooth_planes,
    room_beside,
    sides_around,
)
from xcrack.sif.sif import SIF, SurfaceEnd

SECOND = 0.7  # outer radius of the second domain, as a share of the first
SHORT = 0.55  # and of the third one, to which error bars compare smooth K
_OUTER = 2.6  # wanted outer radius, in legs of the cells at the front
# Outer radius in radii of the enriched tube: the error sits in the cells at its rim, and a domain
# that reaches beyond them makes K of a penny 1 % too low.
_REACH = 1.05
_BESIDE = 3.0  # wanted radii from the end of a front within which another one goes on
_SAMPLES = 101  # of a front, among which what is nearest to the end of another one is looked for
_AHEAD = 0.7  # cosine to the front's direction at its end, in which it does
_BENT = 0.9  # largest outer radius, as a share of the radius of curvature of the front
_LEAST = 0.8  # legs; the radius of the smallest domain
# Of the tops of the hats, in legs: most, where the front bends, and at its ends, from where it
# grows by this share of the distance.
_SPACING, _CLOSEST, _FIRST, _GROWTH = 2.0, 0.7, 1.0, 0.3
_POINTS, _DEGREE = 5, 5  # of the rules around the front and away from it
_AT_PLANE = 0.5  # legs along a front, within which its end lies at a plane of symmetry
_NARROW = 1.5  # legs; a domain clipped below gives a warning
_BEND_OVER = 2.0  # legs over which a bend is averaged that gives a warning: waves are shorter
_DIFFER = 0.05  # difference of two domains, as a share of the largest K, that gives a warning
_DEPTH = 0.02  # of a front, where K is read that has no limit at a free surface
_CHUNK = 1000  # cells integrated at once; bounds the memory
_ON = 1e-9  # of the length of a front, by which a place at the top of a hat may miss it
_IN_HAT = 9  # points on either side of a hat at which the room for its domain is looked at


@dataclass(frozen=True, eq=False)
class FrontValues:
    """K at the tops of the hats of one front.

    Attributes
    ----------
    knots : (p,) array, length
        Parameters of the tops.
    K : (n, 3, p, 3) array, stress · √length
        Of n states and three domains; nan where nothing is known.
    mean_K : (n, p, 3) array, stress · √length
        Means over the hats, of the first domains.
    is_known : (p,) array of bool
        Hats whose integrals are known.
    wide_K : (n, 3, p, 3) array, stress · √length
        K there, with hats twice as wide.
    is_smooth : (p,) array of bool
        Hats at smooth planes perpendicular to the front.
    radius : (p,) array, length
        Outer radius of the domain of each hat.
    domain : Domain
        What is expected of the smallest of them.
    """

    knots: Floats
    K: Floats
    mean_K: Floats
    is_known: Bools
    wide_K: Floats
    is_smooth: Bools
    radius: Floats
    domain: Domain


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
        Zero, with a warning, where K of no part of the front is known.
    """
    space = solutions[0].space
    tip = space.tips[t]
    part = _part_in_body(solutions[0], tip)
    is_closed = part.curve.is_closed
    curve = replace(part.curve, gaps=_gaps(solutions[0], t, part))
    s, ends = part.at, part.ends
    nothing = np.zeros(len(s))
    size = leg_size(space.mesh, space.cuts[tip.crack].level_set.tip_cells[tip.number])
    materials = front_materials(solutions[0], t, curve, size)
    E_prime, nu = materials.moduli(s)
    empty_sif = SIF(
        x=part.x,
        frame=part.frame,
        K=np.zeros((len(s), 3)),
        T=nothing + np.nan,
        spread=np.zeros((len(s), 3)),
        s=part.s,
        front=np.zeros(len(s), dtype=np.int64),
        at_surface=np.ones(len(s), dtype=bool),
        closed=np.zeros(len(s), dtype=bool),
        domain_cells=nothing,
        widened=np.zeros((len(s), 3)),
        smooth_K=np.zeros((len(s), 2, 3)),
        E_prime=E_prime,
        nu=nu,
    )
    if ends is None or not len(s):
        return [empty_sif] * len(solutions)
    values = front_values(solutions, t, curve, ends, materials)
    if not values.is_known.any():
        _warn_unknown(part.x, values)
        return [empty_sif] * len(solutions)
    depth = _depth(solutions[0], curve, ends)
    is_free = _free_ends(curve, values)
    read = np.clip(
        s, ends[0] + depth if is_free[0] else -np.inf, ends[1] - depth if is_free[1] else np.inf
    )
    read, passes = materials.beside_changes(read, values.domain.size)
    all_places = np.append(read, (ends[0] + depth, ends[1] - depth))
    matrix = reading_of_modes(values.knots, values.is_known, curve, all_places, values.is_smooth)
    K = np.einsum("msv,nkvm->nksm", matrix, values.K[:, :, values.is_known])
    K_of_wide = np.einsum("msv,nvm->nsm", matrix, values.wide_K[:, 0][:, values.is_known])
    smooth_K = smooth_values(values.K[:, ::2], values.is_known, is_closed)[:, :, values.is_known]
    smooth_K = np.einsum("msv,nkvm->nksm", matrix, smooth_K)
    if not materials.is_one:
        of_material = materials.factors(all_places)
        K, K_of_wide, smooth_K = (part * of_material for part in (K, K_of_wide, smooth_K))
        values = replace(values, mean_K=values.mean_K * materials.factors(values.knots))
    period = curve.length if is_closed else None
    cells = np.interp(s, values.knots, values.radius, period=period) / values.domain.size
    at_surface = (read != s) | ~_covered_parameters(curve, values.knots, values.is_known, s)
    result = []
    for n, solution in enumerate(solutions):
        rows = K[n, :, : len(s)]
        sif = replace(
            empty_sif,
            K=rows[0],
            spread=np.abs(rows[0] - rows[1]),
            widened=np.abs(rows[0] - K_of_wide[n, : len(s)]),
            smooth_K=smooth_K[n, :, : len(s)].swapaxes(0, 1),
            at_surface=at_surface,
            domain_cells=cells,
        )
        sif = with_closed(sif, solution, tip.crack, values.domain.size)
        surface_ends = tuple(
            _surface_end(curve, ends[e], K[n, 0, len(s) + e], values, n, -e, depth, sif)
            for e in (0, 1)
            if is_free[e]
        )
        result.append(replace(sif, ends=surface_ends))
    for message in check(solutions, t, values.domain, result):
        warn(message)
    warn_of_changes(materials, curve, passes)
    return result


def _gaps(solution: Solution, t: int, part: FrontInBody) -> tuple[float, float]:
    """Gaps between the ends of a front and what its crack has behind a hole, as `FrontCurve.gaps`.

    That is another front, or its own other end. Domains would reach through a hole that is smaller
    than they are; a plane that cuts them off in the body beside the hole would leave out what acts
    there, so that hats fall to zero over the gap. Over less than a cell that is too steep: 0 there.
    """
    curve, ends = part.curve, part.ends
    if curve.is_closed or ends is None:
        return np.inf, np.inf
    space = solution.space
    tip = space.tips[t]
    x, frame, _ = curve.at(np.array(ends))
    overhang = np.array([ends[0], curve.length - ends[1]])
    size = leg_size(space.mesh, space.cuts[tip.crack].level_set.tip_cells[tip.number])
    reach = _BESIDE * _wanted_radius(solution, t) + overhang
    x_others = []
    for other_tip in space.tips:
        if other_tip.crack == tip.crack and other_tip.number != tip.number:
            box_gap = np.maximum(np.min(other_tip.x, axis=0) - x, x - np.max(other_tip.x, axis=0))
            if (np.linalg.norm(np.maximum(box_gap, 0.0), axis=1) < reach).any():
                of_other = _part_in_body(solution, other_tip)
                if of_other.ends is not None:
                    x_others.append(of_other.curve.at(np.linspace(*of_other.ends, _SAMPLES))[0])
    result = []
    for e, sign in ((0, -1.0), (1, 1.0)):
        ways = np.concatenate([*x_others, x[[1 - e]]]) - x[e]
        distance = np.linalg.norm(ways, axis=1)
        distance_ahead = sign * (ways @ frame[e, 2])
        is_ahead = (distance < reach[e]) & (distance_ahead >= _AHEAD * distance)
        nearest_way = distance_ahead[is_ahead].min(initial=np.inf)
        gap = max(float(nearest_way - overhang[e]), _ON * curve.length)
        result.append(gap if nearest_way >= size else 0.0)
    return result[0], result[1]


def _part_in_body(solution: Solution, tip: Tip) -> FrontInBody:
    """The part of a front that lies in the body."""
    cracks = solution.space.cracks
    number = cracks[tip.crack].fronts or ()
    is_closed = bool(number[tip.number][0] == number[tip.number][-1])
    is_inside = partial(inside_body, cracks, tip.crack, solution.space.mesh)
    return front_in_body(tip.x, tip.frame, is_closed, is_inside)


def _wanted_radius(solution: Solution, t: int) -> float:
    """Outer radius of the domains along a front where nothing limits it, length."""
    tip, space = solution.space.tips[t], solution.space
    given_radius = solution.problem.numerics.domain
    if given_radius is not None:
        return given_radius
    size = leg_size(space.mesh, space.cuts[tip.crack].level_set.tip_cells[tip.number])
    return max(_OUTER * size, _REACH * tip.radius)


def _surface_end(
    curve: FrontCurve, s: float, K: Floats, values: FrontValues, n: int, e: int, depth: float,
    sif: SIF,
) -> SurfaceEnd:  # fmt: skip
    """What is known where a front comes to a free surface."""
    x = curve.at(np.array([s]))[0][0]
    K, mean = np.array(K), np.array(values.mean_K[n, e])
    if sif.closed[np.linalg.norm(sif.x - x, axis=1).argmin()]:
        K[0] = mean[0] = 0.0
    width = abs(float(values.knots[e] - values.knots[e + 1 if e == 0 else e - 1]))
    return SurfaceEnd(0, lock(x), depth, lock(K), width, lock(mean))


def _depth(solution: Solution, curve: FrontCurve, ends: tuple[float, float]) -> float:
    """Depth below a free surface at which K is read, length along the front."""
    length = ends[1] - ends[0]
    given_depth = solution.problem.numerics.depth
    return min(_DEPTH * length if given_depth is None else given_depth, length / 2)


def _free_ends(curve: FrontCurve, values: FrontValues) -> tuple[bool, bool]:
    """Whether a front has a first and a last end at a surface whose tractions are known."""
    if curve.is_closed:
        return False, False
    is_known = values.is_known & ~values.is_smooth
    return bool(is_known[0]), bool(is_known[-1])


def _warn_unknown(x: Floats, values: FrontValues) -> None:
    warn(
        f"the front from {at(x[0])} to {at(x[-1])} has no K: everywhere along it a side that is "
        f"held is nearer than {_LEAST:g} cells, and what that bears is unknown. K counts as 0 "
        "there, and it does not grow. Refine the mesh around it."
    )


def _covered_parameters(curve: FrontCurve, knots: Floats, is_valid: Bools, s: Floats) -> Bools:
    """Which parameters lie at or between valid tops of hats; ends of open fronts with them."""
    on = (np.abs(s[:, None] - knots[is_valid]) <= _ON * curve.length).any(axis=1)
    if curve.is_closed:
        left_knot = np.mod(np.searchsorted(knots, s * (1 + 1e-12), side="right") - 1, len(knots))
        return np.asarray(on | (is_valid[left_knot] & is_valid[(left_knot + 1) % len(knots)]))
    left_knot = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    return np.asarray(on | (is_valid[left_knot] & is_valid[left_knot + 1]))


def front_values(
    solutions: Sequence[Solution],
    t: int,
    curve: FrontCurve,
    ends: tuple[float, float],
    materials: FrontMaterials,
) -> FrontValues:
    """K at the tops of the hats of one front.

    Parameters
    ----------
    solutions : sequence of Solution
    t : int
    curve : FrontCurve
    ends : tuple of float, length
        Where the front enters and leaves the body.
    materials : FrontMaterials
        K of its places is given as if all of the front were of the first reference.
    """
    space, tip_material = solutions[0].space, materials.references[0]
    tip = space.tips[t]
    size = leg_size(space.mesh, space.cuts[tip.crack].level_set.tip_cells[tip.number])
    target_radius = _wanted_radius(solutions[0], t)
    sides = sides_around(solutions, tip.crack, curve, target_radius)
    at_planes = (False, False) if curve.is_closed else _ends_at_planes(ends, sides, size)
    knots = front_nodes(curve, _spacing(curve, ends, size, at_planes), ends, sum(at_planes))
    room = _room(solutions[0], t, curve, knots, size)
    tops, is_on_front = _with_gaps(knots, curve)
    room_at_sides = np.full(len(knots), np.inf)
    is_smooth = np.zeros(len(knots), dtype=bool)
    if sides is not None:
        room_at_sides = room_beside(sides, curve, tops)[is_on_front]
        is_smooth = on_smooth_planes(sides, curve, tops)[is_on_front]
    is_valid = room_at_sides > _LEAST * size
    room = np.where(is_valid, np.minimum(room, room_at_sides), room)
    radius = np.clip(room, _LEAST * size, target_radius)
    radii = np.interp(tops, knots, radius)[:, None] * np.array([1.0, SECOND, SHORT])
    r_outer = float(radius.max())
    distance = curve.distance(space.mesh.points, r_outer)
    turn = np.stack([mean_rotation(s, distance, r_outer) for s in solutions], axis=-1)
    total = _lip_part(solutions, t, curve, tops, radii, turn, materials)
    if sides is not None:
        total += integrals_of_sides(solutions, t, sides, curve, tops, radii, turn, materials)
    for part in _domain_parts(solutions, t, curve, tops, radii, turn, materials):
        total += part
    total = np.ascontiguousarray(total[..., is_on_front])
    scene = knots, curve, tip_material
    K = solve_front(total, *scene, is_valid, is_smooth, materials.modulus_ratio)
    wide_K = twice_as_wide(total, *scene, is_valid, is_smooth, materials.modulus_ratio)
    mean = mean_integrals(total[:, 0], *scene, materials.modulus_ratio)
    least_row = int(np.argmin(room))
    bend = curve.bend(knots, _BEND_OVER * size)
    bend_at = int(np.argmin(bend))
    domain = Domain(
        outer_radius=float(radius.min()),
        free_radius=target_radius,
        room=float(room[least_row]),
        least_room=_NARROW * size,
        is_short=False,
        size=size,
        narrow_place=curve.at(knots[[least_row]])[0][0],
        differ=_DIFFER,
        label="K along the front, at",
        bend=float(bend[bend_at]),
        bend_at=curve.at(knots[[bend_at]])[0][0],
        interface=_distance_to_interface(
            solutions[0], curve.at(knots[~materials.beside_changes(knots, 1.5 * size)[1]])[0]
        ),
    )
    return FrontValues(knots, K, mean, is_valid, wide_K, is_smooth, radius, domain)


def _with_gaps(knots: Floats, curve: FrontCurve) -> tuple[Floats, Bools]:
    """Tops of the hats, with those where gaps end, to which the last hats fall; which are not."""
    s_first, s_last = -curve.gaps[0], curve.length + curve.gaps[1]
    tops = np.concatenate([[s_first], knots, [s_last]])
    is_on_front = (tops >= knots[0]) & (tops <= knots[-1])
    counts = np.isfinite(tops)
    counts[[0, -1]] &= np.array(curve.gaps) > 0
    return tops[counts], is_on_front[counts]


def _distance_to_interface(solution: Solution, x: Floats) -> float:
    """Least distance of points of a front to another material, length; inf without."""
    mesh, interfaces = solution.space.mesh, solution.problem.elasticity.interfaces
    if not len(interfaces) or not len(x):
        return np.inf
    tree = triangle_tree(mesh.points, mesh.facets[interfaces])
    return float(np.abs(closest_in(tree, x).distance).min())


def _ends_at_planes(
    ends: tuple[float, float], sides: Sides | None, size: float
) -> tuple[bool, bool]:
    """Ends of a front at planes of symmetry: it does not end there, it goes on as in a mirror."""
    if sides is None:
        return False, False
    s = sides.feet.s[sides.is_smooth]
    at_start, at_end = (bool((np.abs(s - end) < _AT_PLANE * size).any()) for end in ends)
    return at_start, at_end


def _spacing(
    curve: FrontCurve, ends: tuple[float, float], size: float, at_planes: tuple[bool, bool]
) -> Callable[[Floats], Floats]:
    """Distance between the tops of hats along a front, length: shorter at ends, where K falls."""

    def spacing(s: Floats) -> Floats:
        width = np.clip(curve.bend(s, size), _CLOSEST * size, _SPACING * size)
        if curve.is_closed:
            return width
        for at_plane, from_end in zip(at_planes, (s - ends[0], ends[1] - s)):
            if not at_plane:
                width = np.minimum(width, _FIRST * size + _GROWTH * from_end)
        return width

    return spacing


def _room(solution: Solution, t: int, curve: FrontCurve, knots: Floats, size: float) -> Floats:
    """What bends of the front, other fronts and other cracks leave for each hat `(p,)`, length."""
    tip = solution.space.tips[t]
    period = curve.length if curve.is_closed else 0.0
    grid = np.concatenate([[knots[-1] - period], knots, [knots[0] + period]])
    if not curve.is_closed:
        grid[[0, -1]] = knots[[0, -1]]
    share = np.linspace(0.0, 1.0, _IN_HAT)[:, None]
    s = np.concatenate(
        [(1 - share) * grid[:-2] + share * knots, (1 - share) * knots + share * grid[2:]]
    )
    x = curve.at(s.ravel())[0]
    room = _BENT * curve.bend(s.ravel(), size)
    cracks = solution.space.cracks
    cracks_under = [on for on, _ in cracks[tip.crack].ends_on]  # their faces bound the domains
    for other_tip in solution.space.tips:
        if other_tip is not tip and not are_opposite(cracks[other_tip.crack], cracks[tip.crack]):
            room = np.minimum(room, 0.8 * cKDTree(other_tip.x).query(x)[0])
    for c, lips in enumerate(solution.lips):
        if c == tip.crack or c in cracks_under or are_opposite(cracks[c], cracks[tip.crack]):
            continue
        if len(lips):
            room = np.minimum(room, 0.9 * cKDTree(lips.x).query(x)[0])
    return np.asarray(room.reshape(s.shape).min(axis=0))


def _domain_parts(
    solutions: Sequence[Solution],
    t: int,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    turn: Floats,
    materials: FrontMaterials,
) -> Iterator[Floats]:
    """Domain integrals of the hats, of the same chunks for any threads."""
    space = solutions[0].space
    tip = space.tips[t]
    mesh, psi = space.mesh, space.cuts[tip.crack].level_set.psi[tip.number]
    r_outer = float(radii.max())
    coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
    initial_stress, elasticity = initial_stresses(solutions), solutions[0].problem.elasticity
    middle = mesh.cell_middles
    reach = 1.05 * r_outer
    distance = curve.distance(middle, reach + float(mesh.cell_size.max())) - reach
    cells = np.nonzero(distance <= mesh.cell_size)[0]
    reach = np.linalg.norm(mesh.points[mesh.cells[cells]] - middle[cells, None], axis=2).max(axis=1)
    cells = cells[distance[cells] <= reach]

    def part(first: int) -> Floats | None:
        points = cell_points(space, cells[first : first + _CHUNK], _POINTS, _DEGREE, True)
        x = position(space, points.cell, points.bary)
        near_points, feet = curve.points_near(x, r_outer)
        if not len(near_points):
            return None
        points = points.subset(near_points)
        counts = before_junctions(space, tip.crack, points)
        if not counts.all():
            near_points, feet = near_points[counts], feet.subset(counts)
            points = points.subset(counts)
        gradient = gradients_at(space, coefficients, points.cell, points.bary, points.side)
        is_behind = np.einsum("qb,qb->q", psi[mesh.cells[points.cell]], points.bary) < 0
        force, side = _force(solutions, x[near_points]), points.side[:, tip.crack]
        if materials.is_one:
            material, change = materials.references[0], None
            if not elasticity.is_uniform:
                change = elasticity.stress_change(material, gradient, points.cell, points.bary)
            gradient -= turn
            return domain_integrals(
                curve, knots, feet, points.weight, gradient, side, is_behind, material, radii,
                force=force, initial_stress=initial_stress, stress_change=change,
            )  # fmt: skip
        total = np.zeros((len(solutions), radii.shape[1], 3, len(knots)))
        for material, rows, ratio in materials.parts(feet.s):
            local_gradient, of_feet = gradient[rows], feet.subset(rows)
            cell, bary = points.cell[rows], points.bary[rows]
            change, rise, no_turn = (
                elasticity.stress_change(material, local_gradient, cell, bary),
                None,
                turn,
            )
            if ratio is not None:
                change -= (ratio[0] - 1)[:, None, None, None] * _stresses(material, local_gradient)
                local_gradient = ratio[0][:, None, None, None] * (local_gradient - turn)
                rise, no_turn = ratio[1] / of_feet.turn[:, 3], np.zeros_like(turn)
            total += domain_integrals(
                curve, knots, of_feet, points.weight[rows], local_gradient - no_turn, side[rows],
                is_behind[rows],
                material, radii, force=None if force is None else force[rows],
                initial_stress=initial_stress,
                stress_change=change, rise=rise,
            )  # fmt: skip
        return total

    chunks = range(0, len(cells), _CHUNK)
    # Functions of the user are called by one thread alone.
    has_sources = has_effect(solutions, "volume", "initial_stress")
    parts = map(part, chunks) if has_sources else stream_tasks(part, chunks)
    yield from (result for result in parts if result is not None)


def _stresses(material: Isotropic, gradient: Floats) -> Floats:
    """Stress `(q, 3, 3, n)` of displacement gradients of n states."""
    states = [np.ascontiguousarray(gradient[..., n]) for n in range(gradient.shape[3])]
    return np.stack([material.stress(state) for state in states], axis=-1)


def _force(solutions: Sequence[Solution], x: Floats) -> Floats | None:
    """Body forces of all states `(q, 3, n)`."""
    if not has_effect(solutions, "volume"):
        return None
    total = np.zeros((len(x), 3, len(solutions)))
    for n, solution in enumerate(solutions):
        for load, factor in solution.acting:
            if "volume" in load.acts:
                total[:, :, n] += factor * load.volume(x)
    return total


def _lip_part(
    solutions: Sequence[Solution],
    t: int,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    turn: Floats,
    materials: FrontMaterials,
) -> Floats:
    """Lip integrals of the hats `(n, k, 3, p)`."""
    space = solutions[0].space
    c = space.tips[t].crack
    lips, r_outer = solutions[0].lips[c], float(radii.max())
    near_points, feet = curve.points_near(lips.x, r_outer)
    feet = _as_seen(solutions[0], t, near_points, feet)
    pressure = np.stack([lip_pressure(solution, c)[near_points] for solution in solutions], axis=-1)
    is_inside = feet.r < r_outer
    height = np.abs(feet.offset[is_inside, 1]).max(initial=0.0)
    is_bent = height > 1e-9 * r_outer
    traction = lips.normal[near_points][:, :, None] * pressure[:, None]
    for k, shear in enumerate(lip_shear(solution, c) for solution in solutions):
        if shear is not None:
            traction[:, :, k] += shear[near_points]
    if not is_bent and not traction.any():
        return np.zeros((len(solutions), radii.shape[1], 3, len(knots)))
    gradient = None
    if is_bent:
        coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
        parts_of_sides = [
            gradients_at(space, coefficients, *_on_lip(solutions[0], c, near_points, s, sign))
            - turn
            for s, sign in ((0, -1), (1, 1))
        ]
        gradient = np.stack(parts_of_sides)
    normal, weight = lips.normal[near_points], lips.weight[near_points]
    total = np.zeros((len(solutions), radii.shape[1], 3, len(knots)))
    initial_stress = initial_stresses(solutions)
    for material, rows, ratio in materials.parts(feet.s):
        local_gradient = None if gradient is None else gradient[:, rows]
        if local_gradient is not None and ratio is not None:
            local_gradient = local_gradient * ratio[0][None, :, None, None, None]
        total += lip_integrals(
            curve, knots, feet.subset(rows), normal[rows], weight[rows], traction[rows], material,
            radii, gradient=local_gradient, initial_stress=initial_stress,
        )  # fmt: skip
    return total


def _as_seen(solution: Solution, t: int, rows: Ints, feet: FootPoints) -> FootPoints:
    """Feet of points on the crack faces, x1 measured from the front that the cells see.

    The crack faces end at its chords, and so does the pressure: on a lip the auxiliary field goes
    like the inverse root of x1, and a strip of 1 % that chords cut off would lose 10 % of the term.
    """
    space = solution.space
    tip = space.tips[t]
    lips = solution.lips[tip.crack]
    corner = space.mesh.cells[lips.cell[rows, 1]]
    psi = space.cuts[tip.crack].level_set.psi[tip.number][corner]
    psi_of_lips = np.einsum("qb,qb->q", lips.bary[rows, 1], psi)
    xi = np.array(feet.offset)
    # Out of reach of the tube psi has only a sign.
    is_within = np.abs(psi_of_lips - xi[:, 0]) < tip.radius
    xi[is_within, 0] = psi_of_lips[is_within]
    return replace(feet, offset=xi)


def _on_lip(solution: Solution, c: int, rows: Ints, s: int, sign: int) -> tuple[Ints, Floats, Ints]:
    """Cells, places and sides of points on one lip."""
    lips = solution.lips[c]
    cell = lips.cell[rows, s]
    if solution.space.joints:
        return cell, lips.bary[rows, s], lip_side(solution.space, c, cell, lips.bary[rows, s], sign)
    side = cell_side(solution.space, cell)
    side[:, c] = sign
    return cell, lips.bary[rows, s], side
