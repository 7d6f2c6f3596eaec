"""Loads, tested with every function, enriched ones included, and what supports impose."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.fem.assembly import MeshLoad
from xcrack.fem.facets import LipPoints, jump_values, part_points
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import Points, at_joints, cell_points, cell_side
from xcrack.mesh.mesh import facet_set, numbers_of, supported_nodes
from xcrack.mesh.simplex import facet_nodes
from xcrack.model.elasticity import Elasticity
from xcrack.model.loads import FacetPoints, Load, Support


def load_vector(
    space: FunctionSpace, elasticity: Elasticity, load: Load, lips: tuple[LipPoints, ...]
) -> Floats:
    """A load, tested with every function `(n_dof,)`; displacements give nothing.

    Raises
    ------
    ProblemError
        A set with facets inside the body, or what the load says.
    """
    return load_vectors(space, elasticity, [load], lips)[0]


def load_vectors(
    space: FunctionSpace,
    elasticity: Elasticity,
    loads: Sequence[Load],
    lips: tuple[LipPoints, ...],
) -> list[Floats]:
    """Some loads, as `load_vector` has each; the functions on their facets are tabulated once."""
    forces = [np.zeros((space.n_functions, space.dim)) for _ in loads]
    _add_tractions(forces, space, loads)
    for f, load in zip(forces, loads, strict=True):
        kinds = load.acts
        if "point_force" in kinds:
            _add_point_forces(f, space, *load.point_forces(space.mesh))
        if "volume" in kinds:
            points = body_points(space)
            _add(f, space, points, load.volume(position(space, points.cell, points.bary)))
        if "initial_stress" in kinds:
            points = body_points(space)
            x = position(space, points.cell, points.bary)
            sigma = elasticity.initial_stress(load, x, points.cell, points.bary)
            _subtract_stress(f, space, points, sigma)
        if "face_pressure" in kinds:
            for c, on_lip in enumerate(lips):
                p = load.face_pressure(on_lip.x, c)
                if p is not None:
                    f += lip_force(space, c, on_lip, p[:, None] * on_lip.normal)
    return [f.ravel() for f in forces]


def _add_tractions(forces: list[Floats], space: FunctionSpace, loads: Sequence[Load]) -> None:
    """Add the tractions among some loads, each to its own force `(n_functions, d)`."""
    pull = [k for k, load in enumerate(loads) if "traction" in load.acts]
    if not pull:
        return
    sets: dict[str, Ints] = {}
    for k in pull:
        if loads[k].where not in sets:
            sets[loads[k].where] = _outer_facets(space, loads[k])
    facets = np.concatenate(list(sets.values()))
    number_of_set = np.repeat(np.arange(len(sets)), [len(facet) for facet in sets.values()])
    points, normal, owner = _points_on_facets(space, facets)
    x = position(space, points.cell, points.bary)
    rows = {name: (number_of_set[owner] == k).nonzero()[0] for k, name in enumerate(sets)}
    density = np.zeros((len(pull), len(x), space.dim))
    for values, k in zip(density, pull, strict=True):
        at_set = rows[loads[k].where]
        places = FacetPoints(
            space.mesh, sets[loads[k].where], x[at_set], normal[at_set], points.weight[at_set]
        )
        values[at_set] = loads[k].traction(places)
    _add_densities([forces[k] for k in pull], space, points, density)


def outer_points(space: FunctionSpace, load: Load, halvings: int = 0) -> tuple[Points, FacetPoints]:
    """Points of integration on the facet set of a load, and what it is asked at them.

    Raises
    ------
    ProblemError
        A set with facets inside the body.
    """
    facets = _outer_facets(space, load)
    points, normal = facet_points(space, facets, halvings=halvings)
    x = position(space, points.cell, points.bary)
    return points, FacetPoints(space.mesh, facets, x, normal, points.weight)


def _outer_facets(space: FunctionSpace, load: Load) -> Ints:
    """The facet set of a load, all of whose facets lie on the boundary."""
    facets = facet_set(space.mesh, load.where, load.name)
    is_interior = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 1] >= 0
    if is_interior.any():
        raise ProblemError(
            f"{load.name}: {int(is_interior.sum())} of its facets lie inside the body; loads act "
            "on the boundary only."
        )
    return facets


def position(space: FunctionSpace, cell: Ints, bary: Floats) -> Floats:
    """Coordinates of points given by cell and barycentric coordinates."""
    from xcrack.fem.kernels.functions import places

    mesh = space.mesh
    return np.asarray(places(cell, np.ascontiguousarray(bary), mesh.points, mesh.cells))


def _add(f: Floats, space: FunctionSpace, points: Points, density: Floats) -> None:
    """Add the integral of density . v over the points."""
    _add_densities([f], space, points, density[None])


def _add_densities(
    forces: Sequence[Floats], space: FunctionSpace, points: Points, density: Floats
) -> None:
    """Add the integrals of densities . v over the points, each to one of the forces."""
    from xcrack.fem.kernels.functions import add_forces

    for batch, number, row in space.batches_of_points(points.cell):
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number], slopes=False)
        for f, values in zip(forces, density, strict=True):
            add_forces(f, number, batch.functions, row, N, points.weight, values)


def _add_point_forces(
    f: Floats, space: FunctionSpace, cell: Ints, bary: Floats, force: Floats
) -> None:
    """Add forces at places in cells; those at mesh points act on standard functions alone."""
    mesh = space.mesh
    is_point = bary.max(axis=1) == 1
    corner = bary[is_point].argmax(axis=1)
    np.add.at(f, mesh.cells[cell[is_point], corner], force[is_point])
    if is_point.all():
        return
    rows = (~is_point).nonzero()[0]
    rows = rows[np.argsort(cell[rows], kind="stable")]
    cell, bary = cell[rows], bary[rows]
    side = cell_side(space, cell)
    for c, cut in enumerate(space.cuts):
        phi = np.einsum("qv,qv->q", bary, cut.level_set.phi[mesh.cells[cell]])
        is_crossed = cut.is_cut[cell] | (cut.is_tip[cell] & (side[:, c] == 0))
        side[is_crossed, c] = np.where(phi[is_crossed] >= 0, 1, -1)
    _add(f, space, Points(cell, bary, np.ones(len(cell)), side), force[rows])


def _scatter(f: Floats, functions: Ints, force: Floats) -> None:
    is_active = functions >= 0
    np.add.at(f, functions[is_active], force[is_active])


def body_points(space: FunctionSpace) -> Points:
    """Points of integration of loads in the whole body."""
    cells = np.arange(len(space.mesh.cells))
    # Loads are not corrected as the stiffness is: they need a degree more near tips.
    return cell_points(space, cells, 5, space.order + 2)


def facet_points(
    space: FunctionSpace, facets: Ints, n: int = 6, halvings: int = 0
) -> tuple[Points, Floats]:
    """Points on boundary facets with their outward normals; weights are lengths or areas.

    `n` and `halvings` are those of `part_points`.
    """
    return _points_on_facets(space, facets, n, halvings)[:2]


def _points_on_facets(
    space: FunctionSpace, facets: Ints, n: int = 6, halvings: int = 0
) -> tuple[Points, Floats, Ints]:
    """The same, and the row of the facet of each point."""
    mesh = space.mesh
    number = numbers_of(mesh, facets)
    cell = mesh.facet_to_cell[number, 0]
    parts = space.geometry.split_facets(space, facets)
    k, place, weight = part_points(space, facets[parts.number], parts.bary, n, halvings)
    is_vertex = mesh.cells[cell][:, :, None] == facets[:, None, :]
    # The parts in their cells, and the normals of facets: points have those of theirs.
    corners = np.einsum("svf,saf->sav", is_vertex[parts.number].astype(float), parts.bary)
    opposite_corner = (~is_vertex.any(axis=2)).argmax(axis=1)
    inward_normal = mesh.gradient[cell, opposite_corner]
    normal = -inward_normal / np.linalg.norm(inward_normal, axis=1, keepdims=True)
    order = np.argsort(cell[parts.number[k]], kind="stable")
    k = k[order]
    owner = parts.number[k]
    c = cell[owner]
    bary = np.einsum("qa,qav->qv", place[order], corners[k])
    side = cell_side(space, c)
    for i, cut in enumerate(space.cuts):
        is_crossed = cut.is_cut[c] | (cut.is_tip[c] & (side[:, i] == 0))
        side[is_crossed, i] = parts.side[k, i][is_crossed]
    side = at_joints(space, c, bary, side)
    return Points(c, bary, weight[order], side), normal[owner], owner


def _subtract_stress(f: Floats, space: FunctionSpace, points: Points, sigma: Floats) -> None:
    """Subtract the integral of sigma0 : grad v."""
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        bary_and_side = points.bary[number], points.side[number]
        _, G = space.tabulate(batch, row, *bary_and_side, values=False)
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
    for mesh_load in loads:
        if not space.signature[mesh_load.cells].any():
            f = np.zeros(space.n_dof)
            f[: len(mesh_load.f)] = mesh_load.f
            result[id(mesh_load.load)] = f
    return result


def on_mesh(
    space: FunctionSpace, loads: Iterable[tuple[Load, Floats]], previous_loads: Iterable[MeshLoad]
) -> tuple[MeshLoad, ...]:
    """Those loads with their vectors `(n_dof,)` that act on facets of plain cells alone.

    What is known of them from an earlier solve in the mesh serves again.
    """
    loads_before = {id(mesh_load.load): mesh_load for mesh_load in previous_loads}
    result = []
    for load, f in loads:
        if load.acts != {"traction"}:
            continue
        mesh_load = loads_before.get(id(load))
        if mesh_load is None:
            facets = facet_set(space.mesh, load.where, "")
            cells = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 0]
            standard = f[: space.n_nodes * space.dim]
            mesh_load = MeshLoad(load, lock(np.array(cells)), lock(standard.copy()))
        if not space.signature[mesh_load.cells].any():
            result.append(mesh_load)
    return tuple(result)


# What supports impose: which unknowns are known, and their values.

_TRACE = 1e-13  # enriched functions below this value on a facet do not act there (round-off)


@dataclass(frozen=True, eq=False)
class ImposedValues:
    """Unknowns that supports decide, and their values.

    Attributes
    ----------
    is_fixed : (n_dof,) array of bool
    value : (n_dof,) array, length
        Zero where nothing is imposed.
    owner : (n_dof,) array of int
        Number of the support that decides, -1 where none does.
    """

    is_fixed: Bools
    value: Floats
    owner: Ints


def known_unknowns(space: FunctionSpace, supports: Sequence[Support]) -> ImposedValues:
    """Unknowns decided by the supports.

    Raises
    ------
    ProblemError
        Unknown sets, wrong shapes or nan, or two supports that contradict each other at a point.
    """
    is_fixed = np.zeros((space.n_functions, space.dim), dtype=bool)
    value = np.zeros((space.n_functions, space.dim))
    is_fitted = np.zeros_like(is_fixed)
    owner = np.full(is_fixed.shape, -1, dtype=np.int64)
    for number, support in enumerate(supports):
        if support.holds:
            functions = _functions_of(space, support.where, support.kind)
            for axis in _axes(support.displacement_at(np.zeros((1, space.dim)))):
                _impose(
                    space, is_fixed, value, is_fitted, functions, axis, np.zeros(len(functions)), 0
                )
        else:
            for axis, functions, numbers, n_fitted in _imposed_part(space, support):
                _impose(space, is_fixed, value, is_fitted, functions, axis, numbers, n_fitted)
        owner[is_fixed & (owner < 0)] = number
    return ImposedValues(is_fixed.ravel(), value.ravel(), owner.ravel())


def _impose(
    space: FunctionSpace,
    is_fixed: Bools,
    value: Floats,
    is_fitted: Bools,
    functions: Ints,
    axis: int,
    numbers: Floats,
    n_fitted: int,
) -> None:
    """Write values; the last `n_fitted` come from a fit and may differ from a neighbour's."""
    is_fixed_again = is_fixed[functions, axis]
    from_fit = np.arange(len(functions)) >= len(functions) - n_fitted
    scale = max(float(np.abs(numbers).max(initial=0)), float(np.abs(value).max(initial=0)))
    clash = is_fixed_again & (np.abs(value[functions, axis] - numbers) > 1e-6 * scale)
    clash &= ~from_fit & ~is_fitted[functions, axis]
    if clash.any():
        i = int(np.argmax(clash))
        x = space.node_points[functions[i]]
        raise ProblemError(
            f"two supports contradict each other at {np.round(x, 6).tolist()}, axis {axis}: "
            f"{value[functions[i], axis]:.6g} and {numbers[i]:.6g}; leave one direction free."
        )
    value[functions[~is_fixed_again], axis] = numbers[~is_fixed_again]
    is_fixed[functions, axis] = True
    is_fitted[functions[~is_fixed_again], axis] = from_fit[~is_fixed_again]


def _set_nodes(space: FunctionSpace, where: object, label: str) -> Ints:
    if isinstance(where, str):
        facets = facet_set(space.mesh, where, label)
        return np.unique(facet_nodes(space.mesh, space.order, facets))
    number = supported_nodes(space.mesh, np.asarray(where), label)
    if space.order == 1:  # the ends of an edge hold its middle
        is_middle = number >= space.mesh.n_points
        ends = space.mesh.edges[number[is_middle] - space.mesh.n_points]
        number = np.concatenate([number[~is_middle], ends.ravel()])
    return np.unique(number)


def _functions_of(space: FunctionSpace, where: object, label: str) -> Ints:
    """Functions that act on a set: standard ones, and enriched ones with a trace there.

    At a point only the standard function has a value, and that of a jump on the crack.
    """
    nodes = _set_nodes(space, where, label)
    parts = [nodes]
    if isinstance(where, str):
        facets = facet_set(space.mesh, where, label)
        _check_ends(space, where, facets, label)
        owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
        facets = facets[space.signature[owner] != 0]
        if len(facets):
            parts.append(_traces(space, facets)[1])
    else:
        for cut, number in zip(space.cuts, space.heaviside, strict=True):
            vertices = nodes[nodes < space.mesh.n_points]
            on_lip = vertices[cut.level_set.phi[vertices] == 0]
            parts.append(number[on_lip][number[on_lip] >= 0])
    return np.unique(np.concatenate(parts))


def _check_ends(space: FunctionSpace, where: str, facets: Ints, label: str) -> None:
    """Raise where a set ends at a point on a crack and holds its lip - there.

    The functions of such a point are those of lip + and of the jump: only their sum is known.
    """
    for c, cut in enumerate(space.cuts):
        phi = cut.level_set.phi
        is_touched = np.zeros((2, space.mesh.n_points), dtype=bool)
        for corner in range(facets.shape[1]):
            other_values = np.delete(phi[facets], corner, axis=1)
            is_touched[0, facets[(other_values < 0).any(axis=1), corner]] = True
            is_touched[1, facets[(other_values > 0).any(axis=1), corner]] = True
        ends = (phi == 0) & (space.heaviside[c][: space.mesh.n_points] >= 0)
        is_cut_off = ends & is_touched[0] & ~is_touched[1]
        if is_cut_off.any():
            x = np.round(space.mesh.points[np.argmax(is_cut_off)], 6).tolist()
            raise ProblemError(
                f"{label}({value_text(where)}) ends at {x}, where crack {c} meets the boundary, "
                "and supports its lip - only: give the points of the crack in the reverse order "
                "(the supported lip is then lip +), or move its mouth by a thousandth of a cell."
            )


def _traces(space: FunctionSpace, facets: Ints) -> tuple[Points, Ints, Ints, Floats]:
    """Points on facets, and what acts there: function, number of the point, value."""
    points, _ = facet_points(space, facets)
    columns: list[Ints] = []
    rows: list[Ints] = []
    values: list[Floats] = []
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number], slopes=False)
        functions = batch.functions[row]
        is_active = (functions >= 0) & (np.abs(N) > _TRACE)
        columns.append(functions[is_active])
        rows.append(np.broadcast_to(number[:, None], functions.shape)[is_active])
        values.append(N[is_active])
    return points, np.concatenate(columns), np.concatenate(rows), np.concatenate(values)


def _imposed_part(space: FunctionSpace, support: Support) -> list[tuple[int, Ints, Floats, int]]:
    """Axis, functions, values and number of fitted values of an imposed displacement."""
    where, label = support.where, support.kind
    nodes = _set_nodes(space, where, label)
    if not isinstance(where, str):
        u = support.displacement_at(space.node_points[nodes])
        return [(axis, nodes, u[:, axis], 0) for axis in _axes(u)]
    _check_ends(space, where, facet_set(space.mesh, where, support.name), label)
    fitted_functions, coefficients = _fit(space, support)
    other_nodes = nodes[~np.isin(nodes, fitted_functions[fitted_functions < space.n_nodes])]
    parts = [coefficients]
    if len(other_nodes):
        parts.insert(0, support.displacement_at(space.node_points[other_nodes]))
    values = np.concatenate(parts)
    functions = np.concatenate([other_nodes, fitted_functions])
    return [(axis, functions, values[:, axis], len(fitted_functions)) for axis in _axes(values)]


def _axes(values: Floats) -> list[int]:
    """Directions in which values are imposed, which are the same at all points."""
    return [int(axis) for axis in np.nonzero(np.isfinite(values).any(axis=0))[0]]


def _fit(space: FunctionSpace, support: Support) -> tuple[Ints, Floats]:
    """Least-squares fit on the facets where enriched functions act, and at nodes on a crack.

    Shifted functions vanish at nodes, not between them: fixing only the standard unknowns there
    would leave the facet half free. At a node on a crack the value has two answers: the facets
    beside it tell which one is meant.
    """
    no_values = np.zeros(0, dtype=np.int64), np.zeros((0, space.dim))
    facets = facet_set(space.mesh, support.where, support.name)
    owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
    on_lip = np.zeros(space.n_nodes, dtype=bool)
    for cut, number in zip(space.cuts, space.heaviside, strict=True):
        vertices = np.arange(space.mesh.n_points)
        on_lip[vertices] |= (cut.level_set.phi == 0) & (number[vertices] >= 0)
    facets = facets[(space.signature[owner] != 0) | on_lip[facets].any(axis=1)]
    if not len(facets):
        return no_values
    points, column, row, entry = _traces(space, facets)
    is_special = (column >= space.n_nodes) | np.isin(column, np.nonzero(on_lip)[0])
    if not is_special.any():
        return no_values
    keep = np.isin(row, np.unique(row[is_special]))
    unknowns, place = np.unique(column[keep], return_inverse=True)
    row_ids, row_place = np.unique(row[keep], return_inverse=True)
    A = np.zeros((len(row_ids), len(unknowns)))
    A[row_place, place] = entry[keep]
    x = position(space, points.cell, points.bary)[row_ids]
    values_there = support.displacement_at(x)
    target = np.nan_to_num(values_there)
    # Each point counts alike: weighted by length, the data of a sliver would be cut off as noise.
    # Enriched functions take what standard ones leave, or they would take part in every field
    # where their traces are nearly those of polynomials.
    standard = unknowns < space.n_nodes
    solution = np.zeros((len(unknowns), space.dim))
    solution[standard] = np.linalg.lstsq(A[:, standard], target, rcond=1e-11)[0]
    scale = _scales(space)[unknowns]
    least_trace = space.geometry.least_trace
    correction = np.linalg.lstsq(A / scale, target - A @ solution, rcond=least_trace)[0]
    is_free = np.isnan(values_there).any(axis=0)
    return unknowns, np.where(is_free, np.nan, solution + correction / scale[:, None])


def _scales(space: FunctionSpace) -> Floats:
    """Size of each function: 1, but the root of the radius for those of a tip."""
    scale = np.ones(space.n_functions)
    for tip in space.tips:
        first = tip.point_to_function[tip.point_to_function >= 0]
        scale[first[:, None] + np.arange(tip.functions)] = np.sqrt(tip.radius)
    return scale
