"""Load vectors: every load is tested with every function, enriched ones included."""

from collections.abc import Iterable

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.checks import shown
from xcrack.base.errors import ProblemError
from xcrack.fem.assembly import MeshLoad
from xcrack.fem.facets import LipPoints, jump_values, part_points, split_facets
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import Points, at_joints, cell_points, cell_side
from xcrack.mesh.holes import Hole, round_hole
from xcrack.mesh.mesh import facet_set, nearest_point, numbers_of
from xcrack.model.conditions import (
    Bearing,
    BodyForce,
    CrackPressure,
    InitialStress,
    Load,
    PointForce,
    Pressure,
    Resultant,
    SetLoad,
    evaluate,
    evaluate_scalar,
    evaluate_stress,
)

# Tractions of loads that are given by their resultant.

_AXIAL = 1e-3  # share of a force along the axis that may stem from the fit of the axis
_COVERED = 0.9  # share of the contact of a pin that must lie on the set


def bearing_traction(load: Bearing, hole: Hole, x: Floats, weight: Floats) -> Floats:
    """Tractions of a pin at integration points, whose sum is the force `(q, d)`.

    Parameters
    ----------
    load : Bearing
    hole : Hole
    x : (q, d) array, length
    weight : (q,) array, length or area

    Raises
    ------
    ProblemError
        A force along the axis, or a set that lacks a part of the contact.
    """
    what = f"bearing({load.where!r})"
    force = hole.section @ load.force
    size = float(np.linalg.norm(load.force))
    rest = load.force - force @ hole.section
    along = float(np.linalg.norm(rest))
    if along > _AXIAL * size:
        raise ProblemError(
            f"{what}: {along:.4g} of the force {size:.4g} acts along the axis of the hole, where a "
            "pin does not press: give that part by traction or resultant."
        )
    local = hole.local(x)
    radial = local / np.linalg.norm(local, axis=1)[:, None]
    ahead = force / np.linalg.norm(force)
    across = np.array([-ahead[1], ahead[0]])
    cosine, sine = radial @ ahead, radial @ across
    angle = np.arctan2(sine, cosine)
    half = load.contact_angle / 2
    p = np.where(np.abs(angle) < half, np.cos(np.pi * angle / load.contact_angle), 0.0)
    height = np.ptp(_axial(hole, x)) if len(load.force) > 2 else 1.0
    pressed = float(weight[np.abs(angle) < half].sum())
    # Points of integration do not reach the ends of the hole: its height is a little larger.
    whole = load.contact_angle * hole.radius * height
    if pressed < _COVERED * whole:
        raise ProblemError(
            f"{what}: the set covers {100 * pressed / whole:.3g} % of where the pin presses, "
            f"{np.degrees(load.contact_angle):.4g} degrees around the force: give the whole hole, "
            "or a smaller contact_angle."
        )
    # On a polygon the cosine alone would pull a little to one side.
    shapes = np.stack([p, p * sine])[:, :, None] * radial
    sums = np.einsum("q,kqs->sk", weight, shapes)
    scale = np.linalg.solve(sums, force)
    across_axis = np.einsum("k,kqs->qs", scale, shapes) @ hole.section
    # The rest is that of an axis that points know to a few digits only.
    return np.asarray(across_axis + rest / weight.sum())


def _axial(hole: Hole, x: Floats) -> Floats:
    return np.asarray(x @ np.cross(*hole.section))


def resultant_traction(load: Resultant, x: Floats, weight: Floats) -> Floats:
    """Tractions a + b x (x - centre) with the wanted force and moment `(q, d)`.

    Parameters
    ----------
    load : Resultant
    x : (q, d) array, length
    weight : (q,) array, length or area

    Raises
    ------
    ProblemError
        A set that is too small for a moment.
    """
    d = x.shape[1]
    force, moment, about = np.zeros(3), np.zeros(3), np.zeros(3)
    area = weight.sum()
    centre = weight @ x / area
    r = np.zeros((len(x), 3))
    r[:, :d] = x - centre
    if load.force is not None:
        force[:d] = load.force
    if load.moment is not None:
        moment[3 - len(load.moment) :] = load.moment
    if load.about is not None:
        about[:d] = load.about - centre
    # Moment about the centre of the set: the force acts there otherwise.
    moment = moment + np.cross(about, force) if load.about is not None else moment
    inertia = np.einsum("q,q,ij->ij", weight, (r * r).sum(axis=1), np.eye(3))
    inertia -= np.einsum("q,qi,qj->ij", weight, r, r)
    turn = np.zeros(3)
    axes = slice(0 if d > 2 else 2, 3)  # a 2D body turns about the third axis
    if moment.any():
        values = np.linalg.eigvalsh(inertia[axes, axes])
        if values[0] <= 1e-12 * values[-1] or not values[-1]:
            raise ProblemError(
                f"resultant({load.where!r}): the set is too small or too slender for a moment."
            )
        turn[axes] = np.linalg.solve(inertia[axes, axes], moment[axes])
    return np.asarray((force / area + np.cross(turn, r))[:, :d])


def load_vector(
    space: FunctionSpace, loads: tuple[Load, ...], lips: tuple[LipPoints, ...]
) -> Floats:
    """Sum of the given loads, tested with every function `(n_dof,)`; displacements are skipped."""
    f = np.zeros((space.n_functions, space.dim))
    for load in loads:
        if isinstance(load, SetLoad):
            _add_traction(f, space, load)
        elif isinstance(load, PointForce):
            point = nearest_point(space.mesh, load.x, "point_force")
            f[point] += load.force
        elif isinstance(load, BodyForce):
            points = body_points(space)
            b = evaluate(load.value, position(space, points.cell, points.bary), "body_force")
            _add(f, space, points, b)
        elif isinstance(load, InitialStress):
            _add_initial_stress(f, space, load)
        elif isinstance(load, CrackPressure):
            for c, points_on_lip in enumerate(lips):
                if load.crack is None or load.crack == c:
                    p = evaluate_scalar(load.value, points_on_lip.x, "crack_pressure")
                    f += lip_force(space, c, points_on_lip, p[:, None] * points_on_lip.normal)
    return f.ravel()


def position(space: FunctionSpace, cell: Ints, bary: Floats) -> Floats:
    """Coordinates of points given by cell and barycentric coordinates."""
    from xcrack.fem.kernels.fields import places

    mesh = space.mesh
    return np.asarray(places(cell, np.ascontiguousarray(bary), mesh.points, mesh.cells))


def _add(f: Floats, space: FunctionSpace, points: Points, density: Floats) -> None:
    """Add the integral of density . v over the points."""
    cells = np.unique(points.cell)
    for batch, _ in space.batches(cells):
        number, row, _ = points.of_cells(batch.cells)
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number], slopes=False)
        force = N[:, :, None] * (points.weight[number, None] * density[number])[:, None]
        _scatter(f, batch.functions[row], force)


def _scatter(f: Floats, functions: Ints, force: Floats) -> None:
    active = functions >= 0
    np.add.at(f, functions[active], force[active])


def body_points(space: FunctionSpace) -> Points:
    """Points of integration of loads in the whole body."""
    cells = np.arange(len(space.mesh.cells))
    # Loads are not corrected as the stiffness is: they need a degree more near tips.
    return cell_points(space, cells, 5, space.order + 2)


def facet_points(space: FunctionSpace, facets: Ints, n: int = 6) -> tuple[Points, Floats]:
    """Points on boundary facets with their outward normals; weights are lengths or areas."""
    mesh = space.mesh
    number = numbers_of(mesh, facets)
    cell = mesh.facet_to_cell[number, 0]
    parts = split_facets(space, facets)
    k, place, weight = part_points(space, facets[parts.number], parts.bary, n)
    owner = parts.number[k]
    c = cell[owner]
    # Place of each point of the facet among those of its cell.
    same = mesh.cells[c][:, :, None] == facets[owner][:, None, :]
    on_facet = np.einsum("qv,qvb->qb", place, parts.bary[k])
    bary = np.einsum("qvf,qf->qv", same.astype(float), on_facet)
    opposite = (~same.any(axis=2)).argmax(axis=1)
    inward = mesh.gradient[c, opposite]
    normal = -inward / np.linalg.norm(inward, axis=1, keepdims=True)
    side = cell_side(space, c)
    for i, cut in enumerate(space.cuts):
        crossed = cut.is_cut[c] | (cut.is_tip[c] & (side[:, i] == 0))
        side[crossed, i] = parts.side[k, i][crossed]
    side = at_joints(space, c, bary, side)
    order = np.argsort(c, kind="stable")
    return Points(c[order], bary[order], weight[order], side[order]), normal[order]


def _add_traction(f: Floats, space: FunctionSpace, load: SetLoad) -> None:
    what = name_of(load)
    facets = facet_set(space.mesh, load.where, what)
    inner = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 1] >= 0
    if inner.any():
        raise ProblemError(
            f"{what}: {int(inner.sum())} of its facets lie inside the body; loads act on the "
            "boundary only."
        )
    points, normal = facet_points(space, facets)
    _add(f, space, points, traction_of(load, space, facets, points, normal))


def name_of(load: SetLoad) -> str:
    """What messages call a load on a facet set."""
    return f"{type(load).__name__.lower()}({shown(load.where)})"


def traction_of(
    load: SetLoad, space: FunctionSpace, facets: Ints, points: Points, normal: Floats
) -> Floats:
    """Tractions `(q, d)` of a load at the integration points of all facets of its set."""
    what, x = name_of(load), position(space, points.cell, points.bary)
    if isinstance(load, Pressure):
        return np.asarray(-evaluate_scalar(load.value, x, what)[:, None] * normal)
    if isinstance(load, Bearing):
        hole = round_hole(space.mesh, facets, what)
        return load.factor * bearing_traction(load, hole, x, points.weight)
    if isinstance(load, Resultant):
        return load.factor * resultant_traction(load, x, points.weight)
    return evaluate(load.value, x, what, normal)


def _add_initial_stress(f: Floats, space: FunctionSpace, load: InitialStress) -> None:
    """Subtract the integral of sigma0 : grad v."""
    points = body_points(space)
    sigma = evaluate_stress(load.value, position(space, points.cell, points.bary))
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        _, G = space.tabulate(batch, row, points.bary[number], points.side[number])
        force = -np.einsum("q,qij,qnj->qni", points.weight[number], sigma[number], G)
        _scatter(f, batch.functions[row], force)


def lip_force(space: FunctionSpace, c: int, lips: LipPoints, force: Floats) -> Floats:
    """Integral of force . [[v]] over the faces of crack c `(n_functions, d)`.

    Parameters
    ----------
    force : (q, d) array, stress
        On lip +; the opposite acts on lip -.
    """
    f = np.zeros((space.n_functions, space.dim))
    for functions, number, N in jump_values(space, c, lips):
        _scatter(f, functions, N[:, :, None] * (lips.weight[number, None] * force[number])[:, None])
    return f


# Load vectors that belong to the mesh: growth makes them once, and not at each step.


def mesh_loads(space: FunctionSpace, loads: Iterable[MeshLoad]) -> dict[int, Floats]:
    """Vectors `(n_dof,)` of loads of an earlier solve that act on plain cells here, by identity."""
    result = {}
    for one in loads:
        if not space.signature[one.cells].any():
            f = np.zeros(space.n_dof)
            f[: len(one.f)] = one.f
            result[id(one.load)] = f
    return result


def on_mesh(
    space: FunctionSpace, loads: Iterable[tuple[Load, Floats]], before: Iterable[MeshLoad]
) -> tuple[MeshLoad, ...]:
    """Those loads with their vectors `(n_dof,)` that act on facets of plain cells alone.

    What is known of them from an earlier solve in the mesh serves again.
    """
    known = {id(one.load): one for one in before}
    result = []
    for load, f in loads:
        if not isinstance(load, SetLoad):
            continue
        one = known.get(id(load))
        if one is None:
            facets = facet_set(space.mesh, load.where, "")
            cells = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 0]
            standard = f[: space.n_nodes * space.dim]
            one = MeshLoad(load, lock(np.array(cells)), lock(standard.copy()))
        if not space.signature[one.cells].any():
            result.append(one)
    return tuple(result)


__all__ = []
