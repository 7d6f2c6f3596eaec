"""Load vectors: every load is tested with every function, enriched ones included."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.inputs import shown
from xcrack.mesh.holes import round_hole
from xcrack.mesh.mesh import numbers_of
from xcrack.mesh.sets import facet_set, nearest_point
from xcrack.scene.conditions import (
    BodyForce,
    CrackPressure,
    InitialStress,
    Load,
    PointForce,
    Pressure,
    SetLoad,
    evaluate,
    evaluate_scalar,
    evaluate_stress,
)
from xcrack.scene.set_loads import Bearing, Resultant
from xcrack.xfem.facets import part_points, split_facets
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.lips import LipPoints, jump_values
from xcrack.xfem.quadrature import Points, cell_points
from xcrack.xfem.set_loads import bearing_traction, resultant_traction
from xcrack.xfem.sides import at_joints, cell_side


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
    from xcrack.kernels.fields import places

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
