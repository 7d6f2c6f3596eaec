"""Sides of the body that cut the domains of K along a front, and what acts on them.

Where a front comes to a side the domain of its last hat ends there. The integral of P_kj m_j V_k
over that side counts: of the true field the traction alone is needed, and that is known where
nothing is held. On a smooth plane (a symmetry plane, rollers) perpendicular to the front only the
pressure of the plane is unknown, which meets a zero displacement in modes I and II.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution, gradients_at
from xcrack.base.arrays import Bools, Floats
from xcrack.crack.fronts import FootPoints, FrontCurve
from xcrack.fem.facets import part_points
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import facet_points, outer_points, position
from xcrack.fem.quadrature import Points, lip_side
from xcrack.mesh.mesh import facet_set, numbers_of
from xcrack.model.loads import Support
from xcrack.sif.common import initial_stresses, lip_pressure, lip_shear
from xcrack.sif.front_materials import FrontMaterials
from xcrack.sif.interaction_3d import hats, side_integrals

_ALONG = 1e-6  # of a unit normal beside an axis: a plane across that axis
_HALVINGS = 4  # of facets beside a front: two fields that go like the inverse root are multiplied
_ACROSS = 0.999  # least cosine between a front and the normal of a plane perpendicular to it


@dataclass(frozen=True, eq=False)
class Sides:
    """Points on the boundary of the body near a front.

    Attributes
    ----------
    points : Points
    normal : (q, 3) array
        Out of the body.
    feet : FootPoints
    reaction : (q,) array of bool
        Where the traction is an unknown reaction that counts.
    smooth : (q,) array of bool
        On planes perpendicular to the front that hold the body along their normal alone.
    """

    points: Points
    normal: Floats
    feet: FootPoints
    reaction: Bools
    is_smooth: Bools


def before_junctions(space: FunctionSpace, crack: int, points: Points) -> Bools:
    """Which points do not lie beyond a crack on which this one ends `(q,)`.

    Ahead of its fronts that one parts nothing.
    """
    result = np.ones(len(points.cell), dtype=bool)
    for joint in space.joints:
        if joint.crack == crack:
            level_inside = space.cuts[joint.on].level_set.psi_of_ends[space.mesh.cells[points.cell]]
            is_ahead = np.einsum("qb,qb->q", level_inside, points.bary) > 0
            result &= is_ahead | (points.side[:, joint.on] == joint.side)
    return result


def sides_around(
    solutions: Sequence[Solution], crack: int, curve: FrontCurve, reach: float
) -> Sides | None:
    """The sides within reach of a front, or None where there are none.

    Where the crack ends on another one that is a side of what it lies in, too.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem.
    crack : int
        Whose front it is.
    curve : FrontCurve
    reach : float, length
    """
    boundary_part = _boundary_around(solutions, crack, curve, reach)
    faces = _faces_around(solutions[0].space, crack, curve, reach)
    parts = [part for part in (boundary_part, *faces) if part is not None]
    if len(parts) < 2:
        return parts[0] if parts else None
    points, feet = [part.points for part in parts], [part.feet for part in parts]
    return Sides(
        Points(*(np.concatenate([getattr(part, n) for part in points])
                 for n in ("cell", "bary", "weight", "side"))),
        np.concatenate([part.normal for part in parts]),
        FootPoints(*(np.concatenate([getattr(part, n) for part in feet])
                     for n in ("s", "offset", "frame", "turn"))),
        np.concatenate([part.reaction for part in parts]),
        np.concatenate([part.is_smooth for part in parts]),
    )  # fmt: skip


def _boundary_around(
    solutions: Sequence[Solution], crack: int, curve: FrontCurve, reach: float
) -> Sides | None:
    """The boundary of the body within reach of a front."""
    space = solutions[0].space
    mesh = space.mesh
    facets = mesh.boundary
    corner = mesh.points[facets]
    middle = corner.mean(axis=1)
    size = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
    # The distance to a sample of the front may be a little more than that to the front.
    facets = facets[curve.distance(middle, reach + 2 * float(size.max())) <= reach + 1.2 * size]
    if not len(facets):
        return None
    points, normal = facet_points(space, facets, halvings=_HALVINGS)
    near_points, feet = curve.points_near(position(space, points.cell, points.bary), reach)
    if not len(near_points):
        return None
    points, normal = points.subset(near_points), normal[near_points]
    counts = before_junctions(space, crack, points)
    if not counts.any():
        return None
    if not counts.all():
        points, normal, feet = points.subset(counts), normal[counts], feet.subset(counts)
    axes = _fixed_axes(solutions, points)
    if axes is None:
        no_points = np.zeros(len(points.cell), dtype=bool)
        return Sides(points, normal, feet, no_points, no_points)
    is_along_axis = np.abs(np.einsum("qd,qd->q", normal, axes)) > 1 - _ALONG
    is_across_front = np.abs(np.einsum("qd,qd->q", normal, feet.frame[:, 2])) > _ACROSS
    is_smooth = (axes.sum(axis=1) == 1) & is_along_axis & is_across_front
    return Sides(points, normal, feet, axes.any(axis=1) & ~is_smooth, is_smooth)


def _faces_around(space: FunctionSpace, crack: int, curve: FrontCurve, reach: float) -> list[Sides]:
    """Faces of the cracks on which this one ends, from its side, within reach of a front."""
    mesh, result = space.mesh, []
    for joint in space.joints:
        if joint.crack != crack:
            continue
        cut, k = space.cuts[joint.on], (1 + joint.side) // 2
        corner = cut.lip_points(mesh)
        middle = corner.mean(axis=1)
        size = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1, initial=0.0)
        largest_size = float(size.max(initial=0.0))
        rows = np.nonzero(curve.distance(middle, reach + 2 * largest_size) <= reach + 2 * size)[0]
        owner, lip_bary = cut.lip_cell[rows, k], cut.lip_bary[rows, k]
        number, place, weight = part_points(space, mesh.cells[owner], lip_bary, halvings=_HALVINGS)
        cell = owner[number]
        bary = np.einsum("qv,qvb->qb", place, lip_bary[number])
        near_points, feet = curve.points_near(position(space, cell, bary), reach)
        cell, bary, weight = cell[near_points], bary[near_points], weight[near_points]
        sides = lip_side(space, joint.on, cell, bary, joint.side)
        points = Points(cell, bary, weight, sides)
        counts = before_junctions(space, crack, points)
        points = points.subset(counts)
        normal = -joint.side * cut.lip_normal[rows][number[near_points]][counts]
        no_points = np.zeros(len(points.cell), dtype=bool)
        result.append(Sides(points, normal, feet.subset(counts), no_points, no_points))
    return result


def _fixed_axes(solutions: Sequence[Solution], points: Points) -> Floats | None:
    """One where a direction is held at points of the boundary `(q, 3)`, else zero; or None."""
    mesh = solutions[0].space.mesh
    loads = [load for s in solutions for load in s.loads if isinstance(load, Support)]
    supports = [
        support
        for support in dict.fromkeys([*solutions[0].problem.supports, *loads])
        if isinstance(support.where, str)
    ]
    if not supports:
        return None
    axes = np.zeros((len(points.cell), 3))
    facet = mesh.cell_to_facet[points.cell, points.bary.argmin(axis=1)]
    for support in supports:
        is_of_set = np.isin(facet, numbers_of(mesh, facet_set(mesh, support.where, support.name)))
        if is_of_set.any():
            middle = mesh.points[mesh.facets[facet[is_of_set]]].mean(axis=1)
            is_fixed = ~np.isnan(support.displacement_at(middle))
            # What is not the same everywhere along a side makes it no plane of symmetry.
            axes[is_of_set] = np.maximum(
                axes[is_of_set], is_fixed if support.holds or support.is_uniform else 1.0
            )
    return axes


def room_beside(sides: Sides, curve: FrontCurve, knots: Floats) -> Floats:
    """Distance of the hats to what is held, as far as it reaches into their domains `(p,)`."""
    room = np.full(len(knots), np.inf)
    feet = sides.feet.subset(sides.reaction)
    hat, share, _ = hats(curve, knots, feet.s)
    for place, value in ((0, 1 - share), (1, share)):
        counts = value > 0
        np.minimum.at(room, hat[counts, place], feet.r[counts])
    return room


def on_smooth_planes(sides: Sides, curve: FrontCurve, knots: Floats) -> Bools:
    """Hats that are not zero on a smooth plane perpendicular to the front `(p,)`."""
    result = np.zeros(len(knots), dtype=bool)
    hat, share, _ = hats(curve, knots, sides.feet.s[sides.is_smooth])
    for place, value in ((0, 1 - share), (1, share)):
        result[hat[value > 0.5, place]] = True
    return result


def integrals_of_sides(
    solutions: Sequence[Solution],
    t: int,
    sides: Sides,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    turn: Floats,
    materials: FrontMaterials,
) -> Floats:
    """What the sides of the body add to the integrals of the hats `(n, k, 3, p)`.

    Parameters
    ----------
    solutions : sequence of Solution
    t : int
        Number of the front in `space.tips`.
    sides : Sides
    curve : FrontCurve
    knots : (p,) array, length
    radii : (p, k) array, length
    turn : (3, 3, n) array
        Rotation of each state that is left out.
    materials : FrontMaterials
    """
    space, points = solutions[0].space, sides.points
    coefficients = np.stack([solution.coefficients for solution in solutions], axis=-1)
    gradient = gradients_at(space, coefficients, points.cell, points.bary, points.side) - turn
    no_traction = np.zeros((len(points.cell), 3, len(solutions)))
    total = _integrals(
        solutions,
        t,
        points,
        sides.normal,
        sides.feet,
        no_traction,
        curve,
        knots,
        radii,
        materials,
        gradient,
    )
    reach, crack = float(radii.max()), space.tips[t].crack
    loaded_parts = _loaded_points(solutions, curve, reach) + _face_points(
        solutions, crack, curve, reach
    )
    for points, normal, feet, traction in loaded_parts:
        counts = before_junctions(space, crack, points)
        if not counts.all():
            points, normal, feet, traction = (
                points.subset(counts), normal[counts], feet.subset(counts), traction[counts]
            )  # fmt: skip
        total += _integrals(
            solutions, t, points, normal, feet, traction, curve, knots, radii, materials
        )
    return total


def _integrals(
    solutions: Sequence[Solution],
    t: int,
    points: Points,
    normal: Floats,
    feet: FootPoints,
    traction: Floats,
    curve: FrontCurve,
    knots: Floats,
    radii: Floats,
    materials: FrontMaterials,
    gradient: Floats | None = None,
) -> Floats:
    space = solutions[0].space
    tip = space.tips[t]
    psi = space.cuts[tip.crack].level_set.psi[tip.number]
    is_behind = np.einsum("qb,qb->q", psi[space.mesh.cells[points.cell]], points.bary) < 0
    side, initial_stress = points.side[:, tip.crack], initial_stresses(solutions)
    if materials.is_one:
        return side_integrals(
            curve, knots, feet, normal, points.weight, traction, side, is_behind,
            materials.references[0], radii, gradient=gradient, initial_stress=initial_stress,
        )  # fmt: skip
    total = np.zeros((len(solutions), radii.shape[1], 3, len(knots)))
    for material, rows, ratio in materials.parts(feet.s):
        local_gradient = None if gradient is None else gradient[rows]
        if local_gradient is not None and ratio is not None:
            local_gradient = local_gradient * ratio[0][:, None, None, None]
        total += side_integrals(
            curve, knots, feet.subset(rows), normal[rows], points.weight[rows], traction[rows],
            side[rows], is_behind[rows], material, radii, gradient=local_gradient,
            initial_stress=initial_stress,
        )  # fmt: skip
    return total


def _loaded_points(
    solutions: Sequence[Solution], curve: FrontCurve, reach: float
) -> list[tuple[Points, Floats, FootPoints, Floats]]:
    """Points on loaded facets within reach, with normals, feet and tractions of all states."""
    space = solutions[0].space
    mesh = space.mesh
    result = []
    for load in dict.fromkeys(load for s in solutions for load in s.loads):
        if "traction" not in load.acts:
            continue
        facets = facet_set(mesh, load.where, load.name)
        middle = mesh.points[facets].mean(axis=1)
        size = np.linalg.norm(mesh.points[facets] - middle[:, None], axis=2).max(axis=1)
        is_close = curve.distance(middle, reach + 2 * float(size.max())) <= reach + 2 * size
        if not is_close.any():
            continue
        points, on_facets = outer_points(space, load, _HALVINGS)
        near_points, feet = curve.points_near(on_facets.x, reach)
        factor = np.array([sum(f for part, f in s.acting if part is load) for s in solutions])
        traction = load.traction(on_facets)[near_points, :, None] * factor
        result.append((points.subset(near_points), on_facets.normal[near_points], feet, traction))
    return result


def _face_points(
    solutions: Sequence[Solution], crack: int, curve: FrontCurve, reach: float
) -> list[tuple[Points, Floats, FootPoints, Floats]]:
    """Points on the faces of the cracks on which this one ends, with what acts there."""
    space = solutions[0].space
    result = []
    for joint in space.joints:
        if joint.crack != crack:
            continue
        lips, k = solutions[0].lips[joint.on], (1 + joint.side) // 2
        traction = (
            lips.normal[:, :, None]
            * np.stack([lip_pressure(solution, joint.on) for solution in solutions], axis=-1)[
                :, None
            ]
        )
        for n, solution in enumerate(solutions):
            shear = lip_shear(solution, joint.on)
            if shear is not None:
                traction[:, :, n] += shear
        if not traction.any():
            continue
        near_points, feet = curve.points_near(lips.x, reach)
        cell, bary = lips.cell[near_points, k], lips.bary[near_points, k]
        sides = lip_side(space, joint.on, cell, bary, joint.side)
        points = Points(cell, bary, lips.weight[near_points], sides)
        normal = -joint.side * lips.normal[near_points]
        result.append((points, normal, feet, joint.side * traction[near_points]))
    return result


__all__ = []
