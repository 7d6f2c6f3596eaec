"""What happens between two steps: ends that come to the boundary, and cracks that meet."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xcrack.base.arrays import Floats, at, coordinates
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.fronts import closed_fronts, front_frames
from xcrack.crack.measures import exit_ahead, facet_names, front_ends
from xcrack.crack.meetings import new_ends, new_unions
from xcrack.crack.merging import ends_at_holes
from xcrack.crack.stations import place_crack
from xcrack.fem.system import discretise
from xcrack.growth import joins_3d
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Arrival, Join, Plan, Step, moved_places, plan_of
from xcrack.linalg.rigid_motion import pieces
from xcrack.mesh.distances import signed_in
from xcrack.mesh.locate import ON, Body
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem

# Cracks that meet.


def with_joins(rule: GrowthRule, step: Step, plan: Plan) -> Plan:
    """A plan in which cracks that meet within it are joined.

    Raises
    ------
    GeometryError
        They meet, and what they would become cannot be made, or a load belongs to one of them.
    """
    if rule.problem.mesh.dim == 3:
        return joins_3d.with_joins(rule, step, plan)
    # In 2D tips have met in the advance itself, if the scene allows it.
    unions = new_unions(step.corrected, plan.cracks)
    if not unions:
        return plan
    hindrance = joins_3d.named_by_number(rule)
    if not hindrance and isinstance(rule.problem.friction, Sequence):
        hindrance = "friction differs between them: give one number for all cracks."
    if hindrance:
        (i, k), x = unions[0]
        raise GeometryError(f"cracks {i} and {k} meet near {at(x)}, and {hindrance}")
    return plan


def joins_of(step: Step, problem: Problem) -> tuple[Join, ...]:
    """Cracks that meet in the advance after a step: those of its plan, in 2D as they are placed."""
    plan = plan_of(step)
    N, index = step.cycles + plan.cycles, step.index + 1
    if problem.mesh.dim == 3:
        joins_at_holes = _behind_holes(step, plan.cracks, problem)
        return (*(Join(index, N, x, (c, c)) for c, x in joins_at_holes), *plan.joins)
    ends = new_ends(step.corrected, problem.placed)
    unions = new_unions(step.corrected, problem.placed)
    return tuple(
        [Join(index, N, tuple(x.tolist()), (min(c, on), max(c, on))) for c, on, x in ends]
        + [Join(index, N, tuple(x.tolist()), pair) for pair, x in unions]
    )


def _behind_holes(
    step: Step, advanced_cracks: Sequence[Crack], problem: Problem
) -> list[tuple[int, tuple[float, ...]]]:
    """Cracks whose fronts at both sides of a hole have met behind it, and where."""
    if len(advanced_cracks) < len(step.corrected):
        return []
    body, result = Body.of(problem.mesh), []
    for c, (crack_before, crack_after) in enumerate(
        zip(step.corrected, problem.placed, strict=True)
    ):
        if not crack_after.fronts or closed_fronts(crack_before) == closed_fronts(crack_after):
            continue
        gaps, ends_left = ends_at_holes(crack_before, body), ends_at_holes(crack_after, body)
        if len(gaps) <= len(ends_left):
            continue
        x = np.concatenate([front.x for front in front_frames(crack_after)])
        # The gap that is gone is the one farthest from those that are left.
        distances = [
            min((float(np.linalg.norm(x - y)) for y in ends_left), default=np.inf) for x in gaps
        ]
        middle = gaps[int(np.argmax(distances))]
        place = x[int(np.argmin(np.linalg.norm(x - middle, axis=1)))]
        result.append((c, tuple(place.tolist())))
    return result


def cut_off(step: Step, problem: Problem, joins_of_step: Sequence[Join]) -> str:
    """Why a run ends in which cracks that met cut a piece off; empty where they do not."""
    if not joins_of_step or (problem.mesh.dim == 3 and not problem.junctions):
        return ""
    piece = piece_cut_off(step, problem)
    return "; ".join(map(str, joins_of_step)) + f": {piece}" if piece else ""


def piece_cut_off(step: Step, problem: Problem) -> str:
    """Which piece of the body is cut off that was not in the step before; empty where none is."""
    space, _ = discretise(problem)
    piece, n, part = pieces(space)
    if n < 2 or n <= (pieces(step.solutions[0].space)[1] if step.solutions else 1):
        return ""
    k = int(np.argmin(part))
    x = coordinates(space.node_points[piece == k].mean(axis=0))
    return f"the piece around {x}, {100 * part[k]:.3g} % of the body, is cut off"


# Ends that come to the boundary.

_REACH = 2.0  # cells from a place along a front to those of the step before
_BISECTIONS = 40
_LONGER = (2.0, 4.0, 8.0)  # times an advance: ways on which the last pieces of a front leave
_INWARD = 0.05  # share of the way to the next place by which one on the surface is moved


# An arrival whose cycles are not known yet, and the part of an advance until then; above 1 where
# the boundary is a little farther.
Arriving = tuple[Arrival, float]


def coming_arrivals(step: Step, problem: Problem) -> list[Arriving]:
    """Ends that come to the boundary in the advance after a step, with the facet sets there."""
    plan, mesh = plan_of(step), problem.mesh
    if mesh.dim == 2:
        result = _arriving_tips(step, plan.cracks, problem.placed, mesh)
    elif plan.apart:
        scaled_step = replace(step, da=tuple(plan.part * da for da in step.da))
        placed_cracks = [place_crack(crack, mesh) for crack in plan.apart]
        result = _arriving_fronts(scaled_step, plan.apart, placed_cracks, mesh)
    else:
        result = _arriving_fronts(step, plan.cracks, problem.placed, mesh)
    return [(_with_identity(step, arrival), part) for arrival, part in result]


def _with_identity(step: Step, arrival: Arrival) -> Arrival:
    """The same with the identity of the end."""
    if step.identities is None:
        return arrival
    number = arrival.tip
    if step.cracks[arrival.crack].fronts is not None:
        number = int(step.sif[0][arrival.crack].front[arrival.tip])
    ends = step.identities.ends
    if arrival.crack >= len(ends) or number >= len(ends[arrival.crack]):
        return arrival
    end = ends[arrival.crack][number]
    return replace(arrival, end=end, label=step.identities.names[end])


def have_left(cracks: Sequence[Crack], placed_cracks: Sequence[Crack]) -> bool:
    """Whether tips, or whole fronts, have left the body."""
    return any(_tips_outside(*pair) for pair in zip(cracks, placed_cracks, strict=True))


def _tips_outside(advanced_crack: Crack, placed_crack: Crack) -> list[int]:
    """Numbers of the tips that have left the body; [0] where all fronts have."""
    if advanced_crack.fronts is not None:
        return [0] if advanced_crack.n_tips and not placed_crack.n_tips else []
    return [
        j for j, tip in enumerate(advanced_crack.tips or ()) if tip not in (placed_crack.tips or ())
    ]


def _arriving_tips(
    step: Step, advanced_cracks: Sequence[Crack], placed_cracks: Sequence[Crack], mesh: Mesh
) -> list[Arriving]:
    """Tips that have left the body, and the part of their straight way that lies inside."""
    result = []
    for c, pair in enumerate(zip(advanced_cracks, placed_cracks, strict=True)):
        numbers = _tips_outside(*pair)
        start = _starts(step, advanced_cracks, c) if numbers else np.zeros((0, 2))
        for j in numbers:
            move = pair[0].points[(pair[0].tips or ())[j]] - start[j]
            way = float(np.linalg.norm(move))
            hit = exit_ahead(start[j], move / way, mesh) if way > 0 else None
            if hit is not None:
                x, name = hit
                ligament = float(np.linalg.norm(x - start[j]))
                arrival = Arrival(c, j, tuple(x.tolist()), name, ligament, np.nan)
                result.append((arrival, ligament / way))
    return result


def _starts(step: Step, advanced_cracks: Sequence[Crack], c: int) -> Floats:
    """Where the tips of an advanced crack were before `(f, 2)`."""
    cracks_before = step.corrected
    if [crack.n_tips for crack in cracks_before] == [crack.n_tips for crack in advanced_cracks]:
        return tip_frames(cracks_before[c])[0]
    # Tips have met and are gone: the nearest that was is the same one.
    all_tips = np.concatenate([tip_frames(crack)[0] for crack in cracks_before])
    tips_now = tip_frames(advanced_cracks[c])[0]
    return all_tips[[int(np.argmin(np.linalg.norm(all_tips - x, axis=1))) for x in tips_now]]


def ended_crack(
    advanced_crack: Crack, placed_crack: Crack, arrivals_ahead: Sequence[Arrival]
) -> Crack:
    """A crack that has left the body, as it ends there: in 2D where it meets the boundary."""
    if placed_crack.fronts is not None:
        return placed_crack
    points = np.array(placed_crack.points)
    for arrival in arrivals_ahead:
        points[(advanced_crack.tips or ())[arrival.tip]] = arrival.x
    return Crack(points, placed_crack.faces, ())


def _arriving_fronts(
    step: Step, advanced_cracks: Sequence[Crack], placed_cracks: Sequence[Crack], mesh: Mesh
) -> list[Arriving]:
    """Facet sets that a front has come to, each with the place along it that was first.

    A front that has left the body as a whole comes with its last place.
    """
    body, (names, group) = Body.of(mesh), facet_names(mesh)
    outer_facets = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]

    def name_at(x: Floats) -> str:
        return names[group[outer_facets[signed_in(body.boundary, x[None])[1][0]]]]

    result = []
    for c, pair in enumerate(zip(advanced_cracks, placed_cracks, strict=True)):
        start, move = step.sif[0][c].x, moved_places(step, c) - step.sif[0][c].x
        start = _beside_surface(start, body)
        part_inside = _parts(start, move, body)
        x = start + np.minimum(part_inside, 1.0)[:, None] * move
        if _tips_outside(*pair):
            result += [
                (Arrival(c, place, tuple(y.tolist()), name_at(y), way, np.nan), part)
                for place, y, way, part in _last_out(start, move, part_inside, body)
            ]
            continue
        ends_before = [x for _, x in front_ends(step.corrected[c], body)]
        names_before = {name_at(p) for p in ends_before}
        reach = 2.0 * float(np.linalg.norm(move, axis=1).max(initial=0.0))
        for _, end in front_ends(pair[1], body):
            name, reach_of_end = name_at(end), reach + _REACH * float(body.cell_size(end[None])[0])
            distance = min((float(np.linalg.norm(end - p)) for p in ends_before), default=np.inf)
            if name in names_before and distance <= reach_of_end:
                continue
            names_before.add(name)
            ends_before.append(end)
            gap = np.linalg.norm(x - end, axis=1)
            is_out = np.isfinite(part_inside) & (gap <= reach_of_end + reach)
            is_out &= np.array([bool(o) and name_at(p) == name for o, p in zip(is_out, x)], bool)
            place = int(np.argmin(np.where(is_out, part_inside, np.inf) if is_out.any() else gap))
            place_out, part = (x[place], float(part_inside[place])) if is_out.any() else (end, 1.0)
            way = float(np.linalg.norm(place_out - start[place]))
            arrival = Arrival(c, place, tuple(place_out.tolist()), name, way, np.nan)
            result.append((arrival, part))
    return result


def _last_out(
    start: Floats, move: Floats, part: Floats, body: Body
) -> list[tuple[int, Floats, float, float]]:
    """The place of a front that leaves the body last: number, where, its way, part of the move.

    The last pieces of a front are too short for the mesh: they go on straight.
    """
    part = np.array(part)
    for factor in _LONGER:
        is_inside = np.isinf(part)
        part[is_inside] = factor * _parts(start[is_inside], factor * move[is_inside], body)
    part[np.isinf(part)] = -1.0  # it waits, or runs along a side
    if not len(part) or part.max() < 0:
        return []
    place = int(np.argmax(part))
    y = start[place] + part[place] * move[place]
    return [(place, y, float(np.linalg.norm(y - start[place])), float(part[place]))]


def _beside_surface(x: Floats, body: Body) -> Floats:
    """Places along fronts, those that lie on the surface a little towards the next one inside.

    They run along their side of the body, and come to another one as what is beside them does.
    """
    depth, size = body.depth(x)
    on_surface = np.nonzero(depth >= -ON * size)[0]
    inner_places = x[depth < -ON * size]
    if not (len(on_surface) and len(inner_places)):
        return x
    result = np.array(x)
    distance = np.linalg.norm(x[on_surface, None] - inner_places, axis=2)
    result[on_surface] += _INWARD * (inner_places[distance.argmin(axis=1)] - x[on_surface])
    return result


def _parts(start: Floats, move: Floats, body: Body) -> Floats:
    """Part of a move after which each place is outside the body; inf where it stays inside."""
    part = np.full(len(start), np.inf)
    if not len(start):
        return part
    depth, size = body.depth(start)
    # A front ends on the surface: what begins there runs along it, and leaves by round-off only.
    rows_out = np.nonzero((depth < -ON * size) & (body.depth(start + move)[0] >= 0))[0]
    t_in, t_out = np.zeros(len(rows_out)), np.ones(len(rows_out))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (t_in + t_out)
        is_outside = body.depth(start[rows_out] + middle[:, None] * move[rows_out])[0] >= 0
        t_in, t_out = np.where(is_outside, t_in, middle), np.where(is_outside, middle, t_out)
    part[rows_out] = t_out
    return part


__all__ = [
    "Arriving",
    "coming_arrivals",
    "cut_off",
    "ended_crack",
    "have_left",
    "joins_of",
    "piece_cut_off",
    "with_joins",
]
